"""Two fingertips hold a block of 45 g in four worlds of Newton, each with another grip; torch reads and writes where it is installed.

    python examples/newton_hold.py

The left finger stands, the right one is pushed along a slide joint. The last world has a grip that is too small.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import newton
import numpy as np
import warp as wp

import fingerpad_warp as fw
from fingerpad_warp.newton import attach

try:
    import torch
except ImportError:
    torch = None

MODELS = Path(__file__).resolve().parents[3] / "data/models"
MASS_KG, GRAVITY, DT_S = 0.045, 9.81, 0.004
GRIP_N = (0.6, 0.8, 1.0, 0.1)
FINGERS = [("*left_tip", "*block"), ("*right_tip", "*block")]


def tip(side: int) -> Any:
    """A finger at x = side * 20 mm, inclined by 30 degrees, that points to the block; x of the site: from proximal to distal."""
    x, y = np.array([-0.5 * side, 0, np.sqrt(0.75)]), np.array([0, -side, 0])
    axes = wp.mat33(*np.stack([x, y, np.cross(x, y)], axis=1).ravel())
    return wp.transform(wp.vec3(0.02 * side, 0.0, 0.0), wp.quat_from_matrix(axes))


def world() -> newton.ModelBuilder:
    """Fingers and block, without weight."""
    scene = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    scene.add_site(-1, xform=tip(-1), label="left_tip")
    finger = scene.add_link(mass=0.02, inertia=wp.mat33(np.eye(3) * 1e-6), lock_inertia=True, label="finger")
    slide = scene.add_joint_prismatic(-1, finger, axis=newton.Axis.X, damping=2.0, label="grip")
    scene.add_articulation([slide])
    scene.add_site(finger, xform=tip(1), label="right_tip")
    block = scene.add_body(mass=0.0, label="block")
    density = MASS_KG / (0.04 * 0.04 * 0.06)
    scene.add_shape_box(block, hx=0.02, hy=0.02, hz=0.03, cfg=newton.ModelBuilder.ShapeConfig(density=density), label="block")
    return scene


class Hold:
    """The worlds, stepped by a `SolverMuJoCo`, with their contacts."""

    def __init__(self, finger: Any, grip_n: Any = GRIP_N, **options: Any) -> None:
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
        builder.replicate(world(), len(grip_n))
        self.model = builder.finalize()
        self.solver = newton.solvers.SolverMuJoCo(self.model)
        self.contacts = attach(finger, self.solver, FINGERS, DT_S, **options)
        self.now, self.next, self.control = self.model.state(), self.model.state(), self.model.control()
        newton.eval_fk(self.model, self.now.joint_q, self.now.joint_qd, self.now)
        # One degree of freedom of the finger and six of the block in each world.
        if torch is not None:
            forces = wp.to_torch(self.control.joint_f).view(len(grip_n), 7)
            forces[:, 0] = -torch.tensor(grip_n, dtype=torch.float32, device=forces.device)
        else:
            forces = np.zeros((len(grip_n), 7), np.float32)
            forces[:, 0] = -np.asarray(grip_n)
            self.control.joint_f.assign(forces.ravel())

    def seconds(self, duration: float) -> None:
        """Simulates for a while."""
        for _ in range(round(duration / DT_S)):
            self.now.clear_forces()
            self.solver.step(self.now, self.next, self.control, None, DT_S)
            self.now, self.next = self.next, self.now

    def set_gravity(self, gravity: float) -> None:
        """Switches the weight on."""
        self.model.set_gravity((0.0, 0.0, -gravity))
        self.solver.notify_model_changed(newton.ModelFlags.MODEL_PROPERTIES)

    def height_mm(self) -> Any:
        """Height of the block in each world, mm."""
        return 1e3 * self.now.joint_q.numpy().reshape(self.model.world_count, 8)[:, 3]


def main() -> None:
    hold = Hold(fw.load(MODELS / "fingertip.fpm"))
    hold.seconds(0.3)
    hold.set_gravity(GRAVITY)
    hold.seconds(2.0)
    # One number per contact, world by world; the torch tensor is the same memory.
    margin = hold.contacts.response.slip_margin
    margin = margin.numpy().reshape(-1, 2).min(axis=1) if torch is None else wp.to_torch(margin).view(-1, 2).amin(dim=1).tolist()
    for grip_n, height_mm, least in zip(GRIP_N, hold.height_mm(), margin, strict=True):
        print(f"grip {grip_n:.1f} N: block at {height_mm:.2f} mm, slip margin {least:.2f}" if height_mm > -10 else f"grip {grip_n:.1f} N: dropped")


if __name__ == "__main__":
    main()
