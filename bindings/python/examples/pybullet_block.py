"""A block between two finger pads in PyBullet, an engine that has no adapter: pip install pybullet; python pybullet_block.py

In each step the pose of the block goes to `FrameContacts`, and the forces go back to the block. The x axis of the world points up.
"""

import numpy as np
import pybullet as bullet
import fingerpad

MASS_KG, HALF_MM, GRAVITY, DT_S = 0.02, 15.0, 9.81, 1e-3
#: Of the skin, which the model leaves out: N s/m and N m s/rad.
DAMPING, TURN_DAMPING = 2.0, 2e-4


def hold(seconds: float = 2.0, closed_by_mm: float = 1.5) -> dict[str, float]:
    """Closes both pads on the block, hangs its weight on them, and returns what they carry and how fast the block creeps."""
    client = bullet.connect(bullet.DIRECT)
    bullet.setTimeStep(DT_S)
    block = bullet.createMultiBody(MASS_KG)
    inertia = MASS_KG * (2e-3 * HALF_MM) ** 2 / 6
    bullet.changeDynamics(block, -1, localInertiaDiagonal=[inertia] * 3, linearDamping=0, angularDamping=0)
    contacts = fingerpad.FrameContacts(fingerpad.Pad.shipped(), fingerpad.Shape.cuboid([HALF_MM] * 3, 2), 2)
    # Both fingers lie at pitch 30 on the block, one over +z, the other turned over under -z. PyBullet's quaternions are (x, y, z, w).
    half = np.radians(30) / 2
    fingers = [[np.cos(half), 0, np.sin(half), 0], [0, np.cos(half), 0, np.sin(half)]]
    places_mm, steps = [], int(seconds / DT_S)
    for k in range(steps):
        height_mm = HALF_MM - min(0.01 * k, closed_by_mm)
        place_m, turn = map(np.array, bullet.getBasePositionAndOrientation(block))
        velocity, rate = map(np.array, bullet.getBaseVelocity(block))
        pose = fingerpad.relative_pose([[0, 0, height_mm], [0, 0, -height_mm]], fingers, 1e3 * place_m, np.roll(turn, 1))
        felt = contacts.step(*pose, DT_S)
        axes = np.reshape(bullet.getMatrixFromQuaternion(turn), (3, 3))
        force_n = axes @ felt["force_on_body_n"].sum(axis=0, dtype=float) - DAMPING * velocity
        moment_n_m = axes @ felt["moment_on_body_n_mm"].sum(axis=0, dtype=float) / 1e3 - TURN_DAMPING * rate
        bullet.setGravity(-GRAVITY if k > 200 else 0, 0, 0)
        bullet.applyExternalForce(block, -1, list(force_n), list(place_m), bullet.WORLD_FRAME)
        bullet.applyExternalTorque(block, -1, list(moment_n_m), bullet.WORLD_FRAME)
        bullet.stepSimulation()
        places_mm.append(1e3 * place_m)
    bullet.disconnect(client)
    return {
        "carried_share": float(force_n[0] / (MASS_KG * GRAVITY)),
        "creep_um_s": float(1e3 * np.linalg.norm(places_mm[-1] - places_mm[-501]) / (500 * DT_S)),
        "sag_mm": float(-places_mm[-1][0]),
        "slip_margin": float(felt["slip_margin"].min()),
        "flags": int(np.bitwise_or.reduce(felt["status"])),
    }


if __name__ == "__main__":
    for name, value in hold().items():
        print(f"{name} {value:.4g}")
