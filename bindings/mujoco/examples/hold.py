"""An object of 45 g held by two fingers: the plugin beside MuJoCo's own contact, in one run.

    python examples/hold.py            every table, about a minute
    python examples/hold.py --quick    10 s of holding in place of 60
    python examples/hold.py --contact-ns fingerpad [--shaken]    what one contact adds to a step, ns

`test_hold.py` runs these functions and checks their numbers.
"""

import argparse
import copy
import statistics
import time

import mujoco
import numpy as np

import scenes

import fingerpad_mujoco
from reference import Finger

#: Force of the motor that pushes the right finger, N.
GRIP_N = 0.6
#: Time during which the fingers close before the weight comes, s.
CLOSE_S = 0.5


def gripped(contact="fingerpad", grip_n=GRIP_N, load_n=None, **scene):
    """A model and its data with the object in the fingers and the weight on; ``load_n`` in place of the weight."""
    model = mujoco.MjModel.from_xml_string(scenes.grip(contact, **scene))
    data = mujoco.MjData(model)
    data.ctrl[0] = grip_n
    model.opt.gravity[:] = 0
    mujoco.mj_step(model, data, round(CLOSE_S / model.opt.timestep))
    if load_n is None:
        model.opt.gravity[2] = -scenes.GRAVITY
    else:
        data.body("object").xfrc_applied[2] = -load_n
    return model, data


def seconds(model, data, duration):
    mujoco.mj_step(model, data, round(duration / model.opt.timestep))


def below_hand_mm(data):
    """How far the object hangs below the hand, mm."""
    return 1e3 * (data.joint("hand").qpos[0] - data.joint("object").qpos[2])


#: What a pad holds: the object and the forces of the motor, N.
PAD_GRIPS_N = {"block": (0.3, 0.6, 1.0, 2.0, 4.0, 6.0, 7.0), "pen": (0.5, 1.0, 1.5), "rod": (1.0,), "ball": (0.5, 1.0, 3.0)}


def held_by_pads(held_object, grip_n, timestep, duration=10.0, **scene):
    """As :func:`held`, with the depth of the left finger, mm, and the names of its flags."""
    model, data = gripped(grip_n=grip_n, timestep=timestep, held=held_object, model_file=scenes.PAD_FILE, **scene)
    found = drift(model, data, duration)
    contact = fingerpad_mujoco.read(data, "left")[0]
    return found | {name: contact[name] for name in ("depth_mm", "normal_force_n")} | {
        "flags": fingerpad_mujoco.flags(contact["status"])
    }


def held(contact, timestep, duration=60.0, **scene):
    """Drift over the second half of ``duration``, um/s and rad/s, and the sag, mm; a drift of None if it fell out."""
    return drift(*gripped(contact, timestep=timestep, **scene), duration)


def drift(model, data, duration):
    """What :func:`held` measures, of a scene with the weight on."""
    seconds(model, data, duration / 2)
    before = data.joint("object").qpos.copy()
    seconds(model, data, duration / 2)
    if below_hand_mm(data) > 30:
        return dict(drift_um_s=None, turn_rad_s=None, sag_mm=None)
    moved = np.abs(data.joint("object").qpos - before) / (duration / 2)
    return dict(drift_um_s=1e6 * moved[:3].max(), turn_rad_s=2 * moved[3:].max(), sag_mm=below_hand_mm(data))


def too_weak(contact="fingerpad", grip_n=0.06, timestep=0.001, **scene):
    """Acceleration, m/s², of an object that slips out, and the one by gravity less friction at its limit (None for MuJoCo)."""
    model, data = gripped(contact, grip_n=grip_n, timestep=timestep, **scene)
    seconds(model, data, 0.02)
    friction = None
    if contact == "fingerpad":
        friction = sum(fingerpad_mujoco.read(data, side)[0]["friction_limit_n"] for side in ("left", "right"))
    start = data.joint("object").qvel[2]
    seconds(model, data, 0.01)
    return (start - data.joint("object").qvel[2]) / 0.01, friction and scenes.GRAVITY - friction / scenes.MASS_KG


def pivot(share, timestep=0.001, turn_rad=1.0):
    """A growing torque turns the object between the fingers while each carries ``share`` of its friction limit.

    Returns the moment, N mm a finger, at which it has turned by ``turn_rad``, the moment that the model alone has after the
    same turn under the same friction (C library), and the slip margin: 0 on the limit surface of friction and moment."""
    model, data = gripped(load_n=0.0, timestep=timestep)
    load = share * fingerpad_mujoco.read(data, "left")[0]["friction_limit_n"]
    for i in range(1, 201):
        data.body("object").xfrc_applied[2] = -2 * load * i / 200
        seconds(model, data, 0.005)
    for torque_n_mm in np.arange(0.0, 20.0, 0.01):
        data.body("object").xfrc_applied[3] = 1e-3 * torque_n_mm
        seconds(model, data, 0.02)
        if 2 * np.arcsin(data.joint("object").qpos[4]) > turn_rad:
            contacts = [fingerpad_mujoco.read(data, side)[0] for side in ("left", "right")]
            seen = statistics.mean(abs(c["spin_moment_n_mm"]) for c in contacts)
            own = Finger(scenes.MODEL_FILE).moment_after(contacts[0]["depth_mm"], -load, turn_rad)
            return dict(moment_n_mm=seen, own_n_mm=own, slip_margin=contacts[0]["slip_margin"])
    raise RuntimeError(f"no pivot with {share} of the friction limit")


def restored(timestep=0.001, **scene):
    """Whether a state saved while the object is shaken and read into fresh data leads to the same bits 1000 steps later."""
    model, data = gripped(timestep=timestep, **scene)
    shake(model, data, 0.3, seed=1)
    whole = mujoco.mjtState.mjSTATE_INTEGRATION
    saved = np.empty(mujoco.mj_stateSize(model, whole))
    mujoco.mj_getState(model, data, saved, whole)
    fresh = mujoco.MjData(model)
    mujoco.mj_setState(model, fresh, saved, whole)
    ends = []
    for d in (data, fresh):
        mujoco.mj_step(model, d, 1000)
        end = np.empty_like(saved)
        mujoco.mj_getState(model, d, end, whole)
        ends.append(end)
    return bool((ends[0].view(np.uint64) == ends[1].view(np.uint64)).all()), model.npluginstate


def of_changing_strength(contact):
    """What a scene needs so that :func:`shake` changes the strength of the contact."""
    return dict(strength_userdata=0) if contact == "fingerpad" else {}


def shake(model, data, duration, seed, contact="fingerpad"):
    """Shakes the hand (30 um at 90 Hz and 0.5 mm at 8 Hz), makes the grip noisy (5 %), pushes the object up and down by 60 %
    of its weight and changes the strength of the contact (0.8 to 1.2, MuJoCo's coefficients likewise), at random. Returns the
    CPU time of the simulation's steps, s."""
    random = np.random.default_rng(seed)
    coefficients = model.geom_friction.copy()
    start = data.time
    took_s = 0.0
    for i in range(round(duration / 0.004)):
        t = data.time - start
        fade = min(1.0, 10 * t)
        data.ctrl[1] = fade * (3e-5 * np.sin(2 * np.pi * 90 * t) + 5e-4 * np.sin(2 * np.pi * 8 * t))
        data.ctrl[0] = GRIP_N * (1 + 0.05 * random.standard_normal())
        data.body("object").xfrc_applied[2] = 0.6 * scenes.MASS_KG * scenes.GRAVITY * np.sign(np.sin(2 * np.pi * 3 * t))
        if i % 5 == 0:
            strength = random.uniform(0.8, 1.2)
            data.userdata[0] = strength
            if contact != "fingerpad":
                model.geom_friction[:] = strength * coefficients
        before = time.process_time()
        seconds(model, data, 0.004)
        took_s += time.process_time() - before
    model.geom_friction[:] = coefficients
    data.ctrl[:] = [GRIP_N, 0.0]
    data.userdata[0] = 0
    data.body("object").xfrc_applied[:] = 0
    return took_s


def disturbed(contact, timestep, seed=7, **scene):
    """How far the object has gone below the hand after 2, 4 and 6 s of shaking, mm, then its drift at rest, um/s."""
    model, data = gripped(contact, timestep=timestep, **of_changing_strength(contact), **scene)
    seconds(model, data, 1.0)
    start, gone = below_hand_mm(data), []
    for _ in range(3):
        shake(model, data, 2.0, seed, contact)
        seconds(model, data, 1.0)
        gone.append(below_hand_mm(data) - start)
        seed += 1
    seconds(model, data, 2.0)
    before = data.joint("object").qpos[:3].copy()
    seconds(model, data, 10.0)
    return dict(gone_mm=gone, drift_um_s=1e6 * np.abs(data.joint("object").qpos[:3] - before).max() / 10)


def cost(rounds=41, steps=1000):
    """Microseconds of CPU a step of the whole simulation takes, the median over rounds that take turns."""
    cases = {
        "no contact": gripped("none", grip_n=0.0),
        "fingerpad": gripped(),
        "fingerpad, pad": gripped(model_file=scenes.PAD_FILE),
        **{f"MuJoCo, {name}": gripped(name) for name in scenes.MUJOCO},
    }
    times = {name: [] for name in cases}
    for _ in range(rounds):
        for name, (model, data) in cases.items():
            # Always the same second, so that what creeps does not fall out.
            held_still = copy.copy(data)
            start = time.process_time()
            mujoco.mj_step(model, held_still, steps)
            times[name].append(1e6 * (time.process_time() - start) / steps)
    return {name: statistics.median(each) for name, each in times.items()}


def contact_ns(contact, shaken, rounds=21, duration=1.0):
    """Nanoseconds that one of the two contacts adds to a step of 1 ms, while the object is held or ``shaken``: the median of
    rounds in which scenes with and without contact take turns."""
    cases = {"none": gripped("none", grip_n=0.0), contact: gripped(contact, **of_changing_strength(contact))}
    added = []
    for seed in range(rounds):
        took_s = {}
        for name, (model, data) in cases.items():
            fresh = copy.copy(data)
            if shaken:
                took_s[name] = shake(model, fresh, duration, seed, name)
            else:
                start = time.process_time()
                seconds(model, fresh, duration)
                took_s[name] = time.process_time() - start
        added.append(took_s[contact] - took_s["none"])
    return 1e9 * statistics.median(added) / (2 * duration / 0.001)


def print_held(name, timestep, r):
    numbers = "falls out | |" if r["drift_um_s"] is None else f"{r['drift_um_s']:.2g} | {r['turn_rad_s']:.1g} | {r['sag_mm']:.3f}"
    print(f"| {name} | {1e3 * timestep:g} | {numbers} |")


def print_held_by_pads():
    print("\nHeld by pads for 10 s, drift over the second half\n")
    print("| object | grip, N | step, ms | drift, um/s | turn, rad/s | sag, mm | depth, mm | flags |\n|---|---|---|---|---|---|---|---|")
    for name, grips in PAD_GRIPS_N.items():
        for grip_n in grips:
            for timestep in (0.00025, 0.001, 0.002):
                r = held_by_pads(name, grip_n, timestep)
                numbers = "falls out | | | |"
                if r["drift_um_s"] is not None:
                    numbers = f"{r['drift_um_s']:.1g} | {r['turn_rad_s']:.1g} | {r['sag_mm']:.2f} | {r['depth_mm']:.2f} |"
                print(f"| {name} | {grip_n:g} | {1e3 * timestep:g} | {numbers} {', '.join(r['flags'])} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="hold for 10 s in place of 60")
    parser.add_argument("--contact-ns", choices=["fingerpad", *scenes.MUJOCO], help="print only what one contact costs")
    parser.add_argument("--shaken", action="store_true", help="with --contact-ns: while all is shaken")
    arguments = parser.parse_args()
    duration = 10.0 if arguments.quick else 60.0
    fingerpad_mujoco.load()
    if arguments.contact_ns:
        print(f"spin_step {contact_ns(arguments.contact_ns, arguments.shaken):.0f}")
        return
    contacts = ["fingerpad", *scenes.MUJOCO]

    print(f"Held for {duration:g} s, drift over the second half\n")
    print("| contact | step, ms | drift, um/s | turn, rad/s | sag, mm |\n|---|---|---|---|---|")
    for contact in contacts:
        for timestep in (0.00025, 0.001, 0.004):
            print_held(contact, timestep, held(contact, timestep, duration))
    print_held("fingerpad, RK4", 0.001, held("fingerpad", 0.001, duration, integrator="RK4"))
    print_held_by_pads()

    print("\nA grip of 0.06 N, too weak: acceleration, m/s², and that of gravity less friction at the limit\n")
    for contact in contacts:
        seen, expected = too_weak(contact)
        print(f"    {contact:10} {seen:.2f}" + (f" and {expected:.2f}" if expected else ""))

    print("\nA growing torque turns the object by 1 rad; moment a finger, N mm\n")
    print("| friction over its limit | moment | the model alone | slip margin |\n|---|---|---|---|")
    for share in (0.0, 0.3, 0.6, 0.85):
        r = pivot(share)
        print(f"| {share:g} | {r['moment_n_mm']:.3f} | {r['own_n_mm']:.3f} | {r['slip_margin']:.3f} |")

    print("\nShaken, noise on the grip, load reversed, strength changed: below the hand, mm\n")
    print("| contact | step, ms | after 2 s | 4 s | 6 s | drift at rest, um/s |\n|---|---|---|---|---|---|")
    for contact in contacts:
        for timestep in (0.00025, 0.001, 0.004):
            r = disturbed(contact, timestep)
            lost = r["gone_mm"][0] > 30
            gone = "falls out | |" if lost else " | ".join(f"{mm:.4f}" for mm in r["gone_mm"])
            print(f"| {contact} | {1e3 * timestep:g} | {gone} | " + ("" if lost else f"{r['drift_um_s']:.2g}") + " |")
    for timestep in (0.00025, 0.001, 0.002):
        r = disturbed("fingerpad", timestep, model_file=scenes.PAD_FILE)
        print(f"| fingerpad, pad | {1e3 * timestep:g} | " + " | ".join(f"{mm:.4f}" for mm in r["gone_mm"]) + f" | {r['drift_um_s']:.2g} |")

    same, numbers = restored()
    print(f"\nSaved and restored while shaken: {'the same bits' if same else 'OTHER BITS'} ({numbers} numbers of plugin state)")

    print("\nCost of a step\n\n| contact | us of CPU | over fingerpad |\n|---|---|---|")
    times = cost()
    for name, us in times.items():
        print(f"| {name} | {us:.2f} | {us / times['fingerpad']:.2f} |")


if __name__ == "__main__":
    main()
