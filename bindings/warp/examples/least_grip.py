"""The least grip that holds each of 4096 random objects with a margin of 10 %, found by gradient for all of them at once.

    python examples/least_grip.py [--worlds 4096] [--picture least_grip.png]

Each object pulls on two fingers with a load of its own in a direction of its own within the plane of the contacts, and its surface has
a strength of friction of its own. Damped Newton steps move depth and slide of a contact until friction carries half of the load and the
slip margin is 0.1; the derivatives of all contacts come from Warp's tape in three passes. The normal force is then the grip. MuJoCo Warp
holds the objects with that grip, and with 80 % of it, in 4096 worlds to check the result.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import mujoco_warp
import numpy as np
import warp as wp

import fingerpad_warp as fw
import scenes
from fingerpad_warp._model import LIMIT

MARGIN = 0.1
#: Steps of the slide from the press to the load.
STEPS = 4
#: Most rounds of Newton's method, and the largest misfit at its end, over the load and of the margin.
ROUNDS, TOLERANCE = 60, 5e-4
#: Longest change of depth or slide in a round, mm.
LONGEST_MM = 0.4
TIMESTEP = 0.004


def random_objects(count: int, seed: int = 1) -> dict[str, Any]:
    """Loads, N, within the plane of the contacts, and strength factors."""
    random = np.random.default_rng(seed)
    size, angle = random.uniform(0.1, 0.8, count), random.uniform(-np.pi, np.pi, count)
    strength = random.uniform(0.7, 1.4, count)
    return {"load_x_n": size * np.cos(angle), "load_y_n": size * np.sin(angle), "strength": strength}


class Contacts:
    """One finger on each object: friction and margin after a press and a slide, and their derivatives."""

    def __init__(self, model: fw.Model, strength: Any) -> None:
        self.model, self.count = model, len(strength)
        self.strength = strength.astype(np.float32)

    def answer(self, unknowns: Any) -> tuple[Any, Any, Any]:
        """Misfit-relevant numbers (friction x, friction y, margin), their derivatives by depth and slides, and the normal force."""
        leaves = [wp.array(row.astype(np.float32), dtype=float, requires_grad=True) for row in unknowns]
        depth = leaves[0]
        parts = [wp.empty(self.count, dtype=float, requires_grad=True) for _ in range(2)]
        fingers = fw.Fingers(self.model, self.count, spin=True, requires_grad=True)
        tape = wp.Tape()
        with tape:
            for part, whole in zip(parts, leaves[1:], strict=True):
                wp.launch(share_of, dim=self.count, inputs=[whole, 1.0 / STEPS], outputs=[part])
            fingers.step(depth, strength_factor=self.strength)
            for _ in range(STEPS):
                response = fingers.step(depth, parts[0], parts[1])
        values, slopes = response.numpy(), np.empty((self.count, 3, 3))
        for row, name in enumerate(("friction_x_n", "friction_y_n", "slip_margin")):
            seed = np.zeros(response.values.shape, np.float32)
            seed[fw.Response.OUTPUTS.index(name)] = 1
            tape.zero()
            tape.backward(grads={response.values: wp.array(seed, dtype=float)})
            for column, leaf in enumerate(leaves):
                slopes[:, row, column] = leaf.grad.numpy()
        found = np.stack([values[name] for name in ("friction_x_n", "friction_y_n", "slip_margin")], axis=1)
        return found.astype(np.float64), slopes, values["normal_force_n"]


@wp.kernel
def share_of(whole: wp.array(dtype=float), share: float, part: wp.array(dtype=float)):
    i = wp.tid()
    part[i] = share * whole[i]


def first_depth_mm(model: fw.Model, objects: dict[str, Any]) -> Any:
    """Depth at which half of the load is 1 less the margin of the friction in full slip along x, from the table of the model."""
    limit_n = np.hypot(objects["load_x_n"], objects["load_y_n"]) / 2 / (1 - MARGIN) / objects["strength"]
    nodes_mm = np.linspace(0, model.depth_max_mm, len(model.rows))
    return np.interp(limit_n, model.rows[:, LIMIT], nodes_mm)


def least_grip(model: fw.Model, objects: dict[str, Any]) -> tuple[Any, Any, int]:
    """The least normal force of each finger, N, whether it was found within the depth of the model, and the rounds that it took."""
    contacts = Contacts(model, objects["strength"])
    wanted = np.stack([objects["load_x_n"] / 2, objects["load_y_n"] / 2, np.full(contacts.count, MARGIN)], axis=1)
    direction = wanted[:, :2] / np.linalg.norm(wanted[:, :2], axis=1, keepdims=True)
    bounds = [0.1, 0.99 * model.depth_max_mm]
    # Misfits in shares of the load, and of the margin.
    scale = np.stack([*[1 / np.linalg.norm(wanted[:, :2], axis=1)] * 2, np.ones(contacts.count)], axis=1)
    unknowns = np.stack([np.clip(first_depth_mm(model, objects), *bounds), *(0.2 * direction.T)])
    # From the side of stick, where every derivative carries information; damped as by Levenberg and Marquardt, each contact on its own.
    found, slopes, normal_n = contacts.answer(unknowns)
    damping, random = np.full(contacts.count, 1e-3), np.random.default_rng(0)
    for round_number in range(1, ROUNDS + 1):  # noqa: B007
        misfit = scale * (found - wanted)
        is_met = np.abs(misfit).max(axis=1) < TOLERANCE
        if is_met.all():
            break
        scaled = scale[:, :, None] * slopes
        squares = np.einsum("nki,nkj->nij", scaled, scaled) + damping[:, None, None] * np.eye(3)
        way = np.linalg.solve(squares, np.einsum("nki,nk->ni", scaled, misfit)[:, :, None])[:, :, 0]
        # No round goes far enough to slip as a whole, where friction and margin no longer depend on the slide.
        way *= np.minimum(1.0, LONGEST_MM / np.maximum(np.abs(way).max(axis=1, keepdims=True), 1e-9))
        tried = unknowns - np.where(is_met[:, None], 0, way).T
        tried[0] = np.clip(tried[0], *bounds)
        found_there, slopes_there, normal_there = contacts.answer(tried)
        better = np.linalg.norm(scale * (found_there - wanted), axis=1) < np.linalg.norm(misfit, axis=1)
        damping = np.where(better, damping / 5, damping * 5)
        unknowns = np.where(better, tried, unknowns)
        found, slopes = np.where(better[:, None], found_there, found), np.where(better[:, None, None], slopes_there, slopes)
        normal_n = np.where(better, normal_there, normal_n)
        # One that is stuck at a kink goes on from a place beside it.
        stuck = ~is_met & (damping > 1e3)
        damping[stuck] = 1e-3
        unknowns[:, stuck] *= random.uniform(0.6, 1.4, (3, stuck.sum()))
        found[stuck], slopes[stuck] = 1e3, 0
    return normal_n, is_met, round_number


def held(objects: dict[str, Any], grip_n: Any) -> tuple[Any, Any]:
    """Whether each object stays with this grip, and the least slip margin of its fingers, in MuJoCo Warp."""
    worlds = len(grip_n)
    _, m, d, callback = scenes.grip(worlds, TIMESTEP, strength_factor=objects["strength"][:, None])
    d.ctrl.assign(grip_n[:, None].astype(np.float32))
    scenes.seconds(m, d, 0.3, TIMESTEP)
    loads = np.zeros((worlds, 4, 6), np.float32)
    # The x axis of a contact is the world's z axis; the load grows over 0.2 s.
    loads[:, 3, 1], loads[:, 3, 2] = objects["load_y_n"], objects["load_x_n"]
    for share in np.linspace(0, 1, 50):
        d.xfrc_applied.assign(loads * np.float32(share))
        mujoco_warp.step(m, d)
    scenes.seconds(m, d, 0.8, TIMESTEP)
    before = scenes.place_mm(d)
    scenes.seconds(m, d, 0.2, TIMESTEP)
    # The last trembling on the elastic pads is some hundredths of a millimetre; what slips out moves by centimetres.
    still = np.abs(scenes.place_mm(d) - before).max(axis=1) < 0.2
    return still, callback.read()["slip_margin"].min(axis=1)


def picture(path: str, objects: dict[str, Any], grip_n: Any, margin: Any) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    load_n = np.hypot(objects["load_x_n"], objects["load_y_n"])
    points = left.scatter(load_n, grip_n, c=objects["strength"], s=3, cmap="viridis")
    figure.colorbar(points, ax=left, label="strength of friction, factor")
    left.set(xlabel="load of the object, N", ylabel="least grip with a margin of 10 %, N", xlim=(0, None), ylim=(0, None))
    right.hist(margin, bins=np.linspace(0, 0.2, 41), color="tab:blue")
    right.set_xticks(np.linspace(0, 0.2, 5))
    right.axvline(MARGIN, color="black", lw=1, ls="--")
    right.set(xlabel="slip margin in MuJoCo Warp with that grip", ylabel="objects")
    figure.savefig(path, dpi=120)


def main() -> dict[str, Any]:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--worlds", type=int, default=4096)
    parser.add_argument("--picture", default="least_grip.png")
    options = parser.parse_args()
    start = time.perf_counter()
    model, objects = fw.Model.from_file(scenes.MODELS / "fingertip.fpm"), random_objects(options.worlds)
    grip_n, is_met, rounds = least_grip(model, objects)
    found, took = f"{is_met.sum()} of {options.worlds} objects", time.perf_counter() - start
    print(f"device {wp.get_device()}: least grip of {found} after {rounds} rounds, {took:.0f} s")
    objects, grip_n = {name: values[is_met] for name, values in objects.items()}, grip_n[is_met]
    result = {"met": int(is_met.sum()), "grip_n": grip_n}
    for share in (1.0, 0.8):
        still, margin = held(objects, share * grip_n)
        result[f"held at {share:g}"] = still.mean()
        low, middle, high = np.quantile(margin, [0.05, 0.5, 0.95])
        print(f"grip x {share:g}: {still.sum()} of {len(still)} held, slip margin {middle:.3f} (5 to 95 %: {low:.3f} to {high:.3f})")
        if share == 1:
            result["margin"] = margin
            picture(options.picture, objects, grip_n, margin)
    print(f"{time.perf_counter() - start:.0f} s in all, picture in {options.picture}")
    return result


if __name__ == "__main__":
    main()
