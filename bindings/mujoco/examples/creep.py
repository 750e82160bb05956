"""The held rod that creeps: the scene of google-deepmind/mujoco#3328 with MuJoCo's own contact and with fingertips.

    python examples/creep.py

The pads squeeze while nothing pulls, as fingers close, then the weight of 0.44 N comes. The creep is the mean speed of the rod downwards from 0.5 s
to 2.5 s after that. MuJoCo's pads press 2 mm past first touch. Fingertips are softer, and press with 1.5 N at most: they go as deep as 1 N takes.
"""

import mujoco

import scenes

import fingerpad_mujoco

#: What stands in <option> for MuJoCo's own contact: as it comes, and what its documentation recommends for grasps.
OPTIONS = {
    "MuJoCo, as it comes": "",
    "MuJoCo, elliptic": 'cone="elliptic"',
    "MuJoCo, elliptic, impratio 10": 'cone="elliptic" impratio="10"',
    "MuJoCo, elliptic, impratio 10, noslip 10": 'cone="elliptic" impratio="10" noslip_iterations="10"',
}
FINGERTIPS = "fingertips"
SETTLE_S, WATCH_S = 0.5, 2.0


def creep(name, watch_s=WATCH_S, model_file=scenes.PAD_FILE):
    """Creep, um/s, the normal force of a pad, N, its largest friction over its share of the weight, and how far the rod hangs, mm."""
    own = name == FINGERTIPS
    model = mujoco.MjModel.from_xml_string(scenes.pinched(model_file=model_file) if own else scenes.pinched(OPTIONS[name]))
    data = mujoco.MjData(model)
    # 2 mm past first touch; fingertips: a force of 1 N, which takes them some 3 mm deep.
    data.ctrl[:] = 0.0025
    model.opt.gravity[:] = 0
    for _ in range(500):
        if own:
            data.ctrl[:] += 2e-4 * (1 - fingerpad_mujoco.read(data, "left")[0]["normal_force_n"])
        mujoco.mj_step(model, data)
    model.opt.gravity[2] = -scenes.GRAVITY
    at = lambda seconds: (mujoco.mj_step(model, data, round(seconds / model.opt.timestep)), data.body("rod").xpos[2])[1]
    before = at(SETTLE_S)
    after = at(watch_s)
    force = abs(data.joint("left").qfrc_actuator[0])
    limit = fingerpad_mujoco.read(data, "left")[0]["friction_limit_n"] if own else 0.7 * force
    return {
        "creep_um_s": 1e6 * (before - after) / watch_s,
        "normal_force_n": force,
        "limit_over_weight": 2 * limit / (0.045 * scenes.GRAVITY),
        "sag_mm": -1e3 * after,
    }


if __name__ == "__main__":
    for name in (*OPTIONS, FINGERTIPS):
        row = creep(name)
        print(f"{name}: {row['creep_um_s']:.2g} um/s at {row['normal_force_n']:.1f} N, {row['limit_over_weight']:.1f} times the weight, {row['sag_mm']:.2f} mm lower")
