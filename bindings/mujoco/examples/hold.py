"""An object of 45 g held by two fingers: the plugin beside MuJoCo's own contact, in one run.

    python examples/hold.py            every table, about six minutes
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
from reference import Finger, PadFinger

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


#: Objects that pads hold, and forces of the motor, N; thin and light ones.
THIN = ("key", "coin", "card", "die")
THIN_GRIPS_N = (0.3, 1.0, 3.0, 5.0)
PAD_GRIPS_N = {
    "block": (0.3, 0.6, 1.0, 2.0, 4.0, 6.0, 7.0),
    "pen": (0.3, 0.5, 1.0, 1.5),
    "rod": (1.0,),
    "ball": (0.5, 1.0, 3.0),
    **{name: THIN_GRIPS_N for name in THIN},
}


def held_by_pads(held_object, grip_n, timestep, duration=10.0, **scene):
    """As :func:`held`, with the depth of the left finger, mm, the names of its flags, its largest stable step, s, and whether the
    time step was ever too long while the fingers closed."""
    model, data = gripped(load_n=0.0, grip_n=0.0, timestep=timestep, held=held_object, **{"model_file": scenes.PAD_FILE, **scene})
    data.ctrl[0] = grip_n
    too_long = False
    for _ in range(round(CLOSE_S / timestep)):
        mujoco.mj_step(model, data)
        too_long |= any("step_too_long" in fingerpad_mujoco.flags(fingerpad_mujoco.read(data, side)[0]["status"]) for side in ("left", "right"))
    data.body("object").xfrc_applied[:] = 0
    model.opt.gravity[2] = -scenes.GRAVITY
    found = drift(model, data, duration)
    contact = fingerpad_mujoco.read(data, "left")[0]
    return found | {name: contact[name] for name in ("depth_mm", "normal_force_n", "stable_step_s")} | {
        "flags": fingerpad_mujoco.flags(contact["status"]), "too_long": too_long
    }


def held(contact, timestep, duration=60.0, **scene):
    """Drift over the second half of ``duration``, um/s and rad/s, and the sag, mm; a drift of None if it fell out."""
    return drift(*gripped(contact, timestep=timestep, **scene), duration)


def mean_place(model, data, duration):
    """Mean position and quaternion of the object over ``duration``, and the range of its position, um."""
    places = []
    for _ in range(round(duration / model.opt.timestep)):
        mujoco.mj_step(model, data)
        places.append(data.joint("object").qpos.copy())
    return np.mean(places, axis=0), 1e6 * np.ptp(places, axis=0)[:3].max()


def drift(model, data, duration):
    """What :func:`held` measures, of a scene with the weight on.

    Places are means over a sixth of ``duration`` at the end of each half, so that a vibration is not taken for a drift;
    ``hum_um`` is the range of the vibration at the end."""
    window = duration / 6
    seconds(model, data, duration / 2 - window)
    before, _ = mean_place(model, data, window)
    seconds(model, data, duration / 2 - window)
    after, hum_um = mean_place(model, data, window)
    if not below_hand_mm(data) < 30:
        return dict(drift_um_s=None, turn_rad_s=None, sag_mm=None, hum_um=None)
    moved = np.abs(after - before) / (duration / 2)
    return dict(drift_um_s=1e6 * moved[:3].max(), turn_rad_s=2 * moved[3:].max(), sag_mm=below_hand_mm(data), hum_um=hum_um)


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


def limit_of(model_file, depth_mm):
    """Friction of the model alone at full slip along x, N."""
    finger = (PadFinger if model_file == scenes.PAD_FILE else Finger)(model_file)
    finger.step(depth_mm)
    for _ in range(400):
        r = finger.step(depth_mm, -0.02)
    return abs(r.friction_x_n)


def pivot(share, timestep=0.001, turn_rad=1.0, model_file=scenes.MODEL_FILE, grip_n=GRIP_N):
    """A growing torque turns the object between the fingers while each carries ``share`` of its friction limit.

    Returns the moment, N mm a finger, at which it has turned by ``turn_rad``, the moment that the model alone has after the
    same turn under the same friction (C library), and the slip margins of both: 0 on the limit surface of friction and moment."""
    model, data = gripped(load_n=0.0, timestep=timestep, model_file=model_file, grip_n=grip_n)
    load = share * limit_of(model_file, fingerpad_mujoco.read(data, "left")[0]["depth_mm"])
    for i in range(1, 201):
        data.body("object").xfrc_applied[2] = -2 * load * i / 200
        seconds(model, data, 0.005)
    for torque_n_mm in np.arange(0.0, 60.0, 0.02):
        data.body("object").xfrc_applied[3] = 1e-3 * torque_n_mm
        seconds(model, data, 0.02)
        if 2 * np.arcsin(data.joint("object").qpos[4]) > turn_rad:
            contacts = [fingerpad_mujoco.read(data, side)[0] for side in ("left", "right")]
            seen = statistics.mean(abs(c["spin_moment_n_mm"]) for c in contacts)
            finger = (PadFinger if model_file == scenes.PAD_FILE else Finger)(model_file)
            own, margin = finger.moment_after(contacts[0]["depth_mm"], -load, turn_rad)
            return dict(moment_n_mm=seen, own_n_mm=own, slip_margin=contacts[0]["slip_margin"], own_slip_margin=margin)
    raise RuntimeError(f"no pivot with {share} of the friction limit")


def rolled(held_object, grip_n, way_mm, timestep=0.001):
    """The fingers move by ``way_mm`` along their axes, one up, one down, and back: the object rolls between them.

    Returns four numbers: the rotation of the object, rad; the rotation of a rigid cylinder that rolls without slip between the same
    fingers, rad; the rotation that remains after the fingers have returned, rad; and the least slip margin."""
    model = mujoco.MjModel.from_xml_string(scenes.rolling_grip(held_object, timestep))
    data, turns, margin = mujoco.MjData(model), [], 1.0
    model.opt.gravity[:] = 0
    data.actuator("grip").ctrl[0] = grip_n
    seconds(model, data, CLOSE_S)
    for goal_mm, start_mm in ((way_mm, 0.0), (0.0, way_mm)):
        for i in range(1, 201):
            up = 1e-3 * (start_mm + (goal_mm - start_mm) * i / 200)
            data.actuator("left_up").ctrl[0], data.actuator("right_up").ctrl[0] = up, -up
            seconds(model, data, 0.005)
            margin = min([margin] + [fingerpad_mujoco.read(data, side)[0]["slip_margin"] for side in ("left", "right")])
        seconds(model, data, 0.3)
        ways = data.joint("left_up").qpos[0] - data.joint("right_up").qpos[0]
        turns.append((2 * np.arcsin(data.joint("object").qpos[5]), ways / (2 * scenes.OBJECTS[held_object][0])))
    return dict(turn_rad=turns[0][0], rolling_rad=turns[0][1], left_rad=turns[1][0], slip_margin=margin)


def pulled(grip_n, way_mm=20.0, timestep=0.0005):
    """A card is pulled out from between the fingers.

    Returns the force of the pull while it slides, N, the friction of two pads alone at the same depths (C library), and the normal
    forces."""
    model = mujoco.MjModel.from_xml_string(scenes.pulled_card(timestep))
    data, forces = mujoco.MjData(model), []
    model.opt.gravity[:] = 0
    data.actuator("grip").ctrl[0] = grip_n
    seconds(model, data, CLOSE_S)
    for i in range(1, 641):
        data.actuator("pull").ctrl[0] = 1e-3 * way_mm * i / 640
        seconds(model, data, 0.005)
        forces.append(data.actuator("pull").force[0])
    depths = [fingerpad_mujoco.read(data, side)[0]["depth_mm"] for side in ("left", "right")]
    # The card moves up, the finger's x axis: the plane's motion along +x.
    limits = []
    for depth in depths:
        finger = PadFinger(scenes.PAD_FILE)
        finger.step(depth)
        limits.append([finger.step(depth, 0.02).friction_x_n for _ in range(800)][-1])
    normal = [fingerpad_mujoco.read(data, side)[0]["normal_force_n"] for side in ("left", "right")]
    return dict(force_n=statistics.mean(forces[-50:]), limits_n=sum(limits), normal_forces_n=normal)


def fanned(grip_n, friction=0.2, way_mm=20.0, timestep=0.001):
    """A card is slid out of a fan of two, from under one finger and off the other card.

    Returns friction of the finger on the card that stays, N, friction of the finger on the other and its limit, the force of the pull, and
    the normal forces of both fingers."""
    model = mujoco.MjModel.from_xml_string(scenes.fan(timestep, friction))
    data, forces = mujoco.MjData(model), []
    model.opt.gravity[:] = 0
    data.actuator("grip").ctrl[0] = grip_n
    seconds(model, data, CLOSE_S)
    for i in range(1, 401):
        data.actuator("pull").ctrl[0] = 1e-3 * way_mm * i / 400
        seconds(model, data, 0.005)
        forces.append(data.actuator("pull").force[0])
    left, right = (fingerpad_mujoco.read(data, side)[0] for side in ("left", "right"))
    return dict(
        held_n=left["friction_x_n"], slid_n=right["friction_x_n"], limit_n=right["friction_limit_n"],
        force_n=statistics.mean(forces[-50:]), normal_forces_n=[left["normal_force_n"], right["normal_force_n"]],
    )


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


def held_by_five(contact="fingerpad", held="box", **attributes):
    """A model and its data with an object in five fingers for a second: a thumb with 1.2 N, the others with 0.3 N."""
    model = mujoco.MjModel.from_xml_string(scenes.five(contact, held, **attributes))
    data = mujoco.MjData(model)
    data.ctrl[:] = [1.2, 0.3, 0.3, 0.3, 0.3] if contact != "none" else 0
    model.opt.gravity[:] *= contact != "none"
    seconds(model, data, 1.0)
    return model, data


def cost(rounds=41, steps=1000):
    """Microseconds of CPU a step of the whole simulation takes with two contacts, the median over rounds that take turns."""
    return cost_of(rounds, steps, {
        "no contact": gripped("none", grip_n=0.0),
        "fingerpad": gripped(),
        "fingerpad, pad": gripped(model_file=scenes.PAD_FILE),
        **{f"MuJoCo, {name}": gripped(name) for name in scenes.MUJOCO},
    })


def cost_of_five(held, rounds=21, steps=500):
    """The same with five contacts on a box or a cylinder; beds touch flat faces alone."""
    beds = {"fingerpad": held_by_five(held=held)} if held == "box" else {}
    return cost_of(rounds, steps, {
        "no contact": held_by_five("none", held),
        **beds,
        "fingerpad, pad": held_by_five(held=held, model_file=scenes.PAD_FILE),
        **{f"MuJoCo, {name}": held_by_five(name, held) for name in scenes.MUJOCO},
    })


def cost_of(rounds, steps, cases):
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
    print("\nHeld by pads for 60 s, drift over the second half; best: drift of MuJoCo's own contact at its best, at 1 ms\n")
    print("| object | grip, N | step, ms | drift, um/s | vibration, um | sag, mm | depth, mm | largest explicit step, ms | flags | best, um/s |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for name, grips in PAD_GRIPS_N.items():
        for grip_n in grips:
            best = held("best", 0.001, 10.0, grip_n=grip_n, held=name)["drift_um_s"]
            for timestep in (0.001, 0.002, 0.004):
                r = held_by_pads(name, grip_n, timestep, 60.0)
                numbers = "lost | | | | |"
                if r["drift_um_s"] is not None:
                    numbers = (
                        f"{r['drift_um_s']:.1g} | {r['hum_um']:.1g} | {r['sag_mm']:.2f} | {r['depth_mm']:.2f} | "
                        f"{1e3 * r['stable_step_s']:.1f} |"
                    )
                flags = r["flags"] + ["step_too_long"] * (r["too_long"] and "step_too_long" not in r["flags"])
                print(f"| {name} | {grip_n:g} | {1e3 * timestep:g} | {numbers} {', '.join(flags)} | {'lost' if best is None else f'{best:.1g}'} |")


def print_manipulated():
    print("\nA growing torque turns a block between two fingers: moment a finger, N mm, and slip margin; the model alone\n")
    print("| model, turn, grip | friction over its limit | moment | the model alone | slip margin | the model alone |\n|---|---|---|---|---|---|")
    bed = ("bed, 1 rad, 0.6 N", dict())
    pad = ("pad, 0.5 rad, 1 N", dict(turn_rad=0.5, model_file=scenes.PAD_FILE, grip_n=1.0))
    for name, scene in (bed, pad):
        for share in (0.0, 0.3, 0.6, 0.85):
            r = pivot(share, **scene)
            print(
                f"| {name} | {share:g} | {r['moment_n_mm']:.3f} | {r['own_n_mm']:.3f} | {r['slip_margin']:.3f} | {r['own_slip_margin']:.3f} |"
            )
    print("\nFingers move by a way in opposite directions and roll an object between them: turn, and way over radius, rad\n")
    print("| object, grip, way | turn | rolling without slip | left after the way back | least slip margin |\n|---|---|---|---|---|")
    for name, grip_n, way_mm in (("pen", 0.5, 1.0), ("pen", 1.0, 1.0), ("tube", 0.5, 2.0), ("tube", 1.0, 2.0)):
        r = rolled(name, grip_n, way_mm)
        print(
            f"| {name}, {grip_n:g} N, {way_mm:g} mm | {r['turn_rad']:.3f} | {r['rolling_rad']:.3f} | {r['left_rad']:.3f} | {r['slip_margin']:.2f} |"
        )
    print("\nA card pulled out from between two pads: force, N, and friction of two pads alone\n")
    print("| grip, N | force | friction of the pads alone |\n|---|---|---|")
    for grip_n in (0.5, 1.0, 2.0):
        r = pulled(grip_n)
        print(f"| {grip_n:g} | {r['force_n']:.3f} | {r['limits_n']:.3f} |")
    print("\nA card slid out of a fan of two: friction on the card that stays, on the other and its limit, force of the pull, N\n")
    print("| grip, N | held | slid | limit | force |\n|---|---|---|---|---|")
    for grip_n in (0.5, 1.0):
        r = fanned(grip_n)
        print(f"| {grip_n:g} | {r['held_n']:.3f} | {r['slid_n']:.3f} | {r['limit_n']:.3f} | {r['force_n']:.3f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="hold for 10 s in place of 60")
    parser.add_argument("--contact-ns", choices=["fingerpad", *scenes.MUJOCO], help="print only what one contact costs")
    parser.add_argument("--shaken", action="store_true", help="with --contact-ns: while all is shaken")
    arguments = parser.parse_args()
    duration = 10.0 if arguments.quick else 60.0
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

    print_manipulated()

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

    for what, times in (("two contacts", cost()), *((f"five contacts on a {held}", cost_of_five(held)) for held in ("box", "cylinder"))):
        print(f"\nCost of a step, {what}\n\n| contact | us of CPU | over MuJoCo, noslip | over MuJoCo, best |\n|---|---|---|---|")
        for name, us in times.items():
            print(f"| {name} | {us:.2f} | {us / times['MuJoCo, noslip']:.2f} | {us / times['MuJoCo, best']:.2f} |")


if __name__ == "__main__":
    main()
