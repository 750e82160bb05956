"""A hand lifts boxes of unknown friction: with the strength that an observer finds, with fixed grips, and with a threshold on dF/dt.

    pip install fingerpad fingerpad-mujoco
    python examples/unknown.py --lifts 20                    a table of 20 lifts with each controller
    python examples/unknown.py --lifts 20 --finger pad       the same with pads, which the observer's model matches less
    python examples/unknown.py --lifts 20 --tune             the threshold on dF/dt, found on other lifts

Two fingers close on a box that stands on a table, lift it by 20 mm, and shake it. Mass, strength of the surface and stiffness of the fingers are
drawn for each lift, and all controllers have the same lifts. A controller gets forces and positions with noise, as a hand measures them.
"""

import argparse
import dataclasses
import math
import sys

import fingerpad
import mujoco
import numpy as np

import scenes

import fingerpad_mujoco

SIDES = ("left", "right")
FILES = {"bed": scenes.MODEL_FILE, "pad": scenes.PAD_FILE}
LOADERS = {"bed": fingerpad.Model, "pad": fingerpad.Pad}
NORMAL, FRICTION, DAMPING, REGIME = map(fingerpad_mujoco.OUTPUTS.index, ("normal_force_n", "friction_x_n", "damping_x_n", "regime"))
DT_S = 0.002
#: Strength of the surface over the one that is expected, mass of the box, kg, and spread of the fingers' stiffness.
STRENGTHS, MASSES_KG, STIFFNESS_SPREAD = (0.4, 2.0), (0.04, 0.1), 0.15
#: Noise of a force, N, and of a position, mm.
NOISE_N, NOISE_MM = 0.005, 0.005
#: Ends of closing, of a stroke down, of the way back, of the lift, of a pause, and of the shake, s. Stroke and lift, m.
CLOSE_S, DOWN_S, READY_S, UP_S, HELD_S, END_S = 0.4, 1.0, 1.2, 2.4, 2.6, 3.4
STROKE_M, LIFT_M = 0.003, 0.02
#: The shake: size, m, frequency, Hz, and acceleration, m/s².
SHAKE_M, SHAKE_HZ = 0.002, 4.0
SHAKE_M_S2 = SHAKE_M * (2 * math.pi * SHAKE_HZ) ** 2
#: A box that stays behind the hand by so much is dropped, m; one that is higher by so much is in the air, m.
LOST_M, LIFTED_M = 0.01, 0.0005
#: First, least and largest grip, N, and how fast controllers raise and lower it, N/s.
START_N, LEAST_N, MOST_N, RAISE_N_S, LOWER_N_S = 0.3, 0.05, 1.4, 5.0, 0.3
#: The lower bound of the margin is kept between these; spread of the strengths that the observer expects.
AIM, SPREAD = (0.1, 0.2), 0.5
#: dF/dt: time constant, s; the grip rises while friction falls faster than this share of its fastest rise; shares to choose from.
RATE_S, SHARE, SHARES = 0.02, 0.1, (0.05, 0.1, 0.2, 0.4)


@dataclasses.dataclass
class Lift:
    strength: float
    mass_kg: float
    stiffness: float
    seed: int

    @property
    def load_n(self):
        """The largest friction that a finger needs, N."""
        return 0.5 * self.mass_kg * (scenes.GRAVITY + SHAKE_M_S2)


def drawn(number, seed):
    """Lifts at random: strengths log-uniform, masses uniform, stiffnesses log-normal."""
    random = np.random.default_rng(seed)
    return [
        Lift(
            float(np.exp(random.uniform(*np.log(STRENGTHS)))), random.uniform(*MASSES_KG),
            float(np.exp(STIFFNESS_SPREAD * random.standard_normal())), int(random.integers(2**31)),
        )
        for _ in range(number)
    ]


def full_slip(model, strength=1.0):
    """Normal force and friction of full slip, N, over growing depths."""
    rows = [(0.0, 0.0)]
    for depth_mm in np.linspace(0.3, 2.6, 12):
        # 13 mm are enough for any strength.
        finger = fingerpad.Finger(model)
        for _ in range(16):
            last = finger.step(depth_mm, 0.8, strength_factor=strength)
        rows.append((last.normal_force_n, last.friction_x_n))
    return np.array(rows).T


def least_n(finger, lift):
    """The least grip that holds the box while it is shaken, N: where friction of full slip is the load."""
    normal, friction = full_slip(LOADERS[finger].from_file(FILES[finger]).tuned(stiffness=lift.stiffness), lift.strength)
    return float(np.interp(lift.load_n, friction, normal))


class Fixed:
    """A grip that stays. Other controllers change ``grip_n`` in :meth:`step`, which takes the time, s, normal force and friction of
    both fingers, N, and the way of the hand against the box since the step before, mm."""

    #: Whether the hand strokes the box downwards before it lifts it. It then has the way of its encoders, as if the box stood still.
    strokes = False

    def __init__(self, grip_n):
        self.grip_n = grip_n

    def step(self, time, forces_n, slide_mm):
        pass


class Rate(Fixed):
    """Raises the grip while friction falls fast."""

    def __init__(self, share=SHARE):
        super().__init__(START_N)
        self.share, self.slow_n, self.fastest_n_s = share, 0.0, 0.0

    def step(self, time, forces_n, slide_mm):
        rate = (sum(friction for _, friction in forces_n) / 2 - self.slow_n) / RATE_S
        self.slow_n += rate * DT_S
        if time > READY_S:
            self.fastest_n_s = max(self.fastest_n_s, rate)
            if rate < -self.share * self.fastest_n_s:
                self.grip_n = min(MOST_N, self.grip_n + RAISE_N_S * DT_S)


class Observed(Fixed):
    """Keeps the lower bound of the margin at AIM from the beginning of the lift on. It needs the slide against the box in the air too."""

    def __init__(self):
        super().__init__(START_N)
        model = fingerpad.Model.from_file(scenes.MODEL_FILE)
        self.observers = [fingerpad.MarginObserver(model, strength=SPREAD) for _ in SIDES]

    def step(self, time, forces_n, slide_mm):
        margins = [o.step(n, f, 0.0, slide_mm, 0.0, dt_s=DT_S).margin_low for o, (n, f) in zip(self.observers, forces_n)]
        if time > READY_S:
            self.follow(min(margins))

    def follow(self, margin):
        change = RAISE_N_S if margin < AIM[0] else -LOWER_N_S if margin > AIM[1] else 0.0
        self.grip_n = min(max(self.grip_n + change * DT_S, LEAST_N), MOST_N)


class Stroked(Observed):
    """Strokes the box, which the table keeps from moving, so that encoders alone see the slide. In the air it has the lower end of the strength."""

    strokes = True

    def __init__(self):
        super().__init__()
        self.normal_n, self.friction_n = full_slip(fingerpad.Model.from_file(scenes.MODEL_FILE))
        self.strengths, self.now_n = [1.0, 1.0], [(0.0, 0.0)] * 2

    def step(self, time, forces_n, slide_mm):
        if time < READY_S:
            told = [o.step(n, f, 0.0, slide_mm, 0.0, dt_s=DT_S) for o, (n, f) in zip(self.observers, forces_n)]
            self.strengths = [t.strength_low for t in told]
        # The forces, smoothed over 5 ms.
        self.now_n = [(n + 0.3 * (m - n), f + 0.3 * (g - f)) for (n, f), (m, g) in zip(self.now_n, forces_n)]
        if time > READY_S:
            self.follow(min(1 - abs(f) / (s * np.interp(n, self.normal_n, self.friction_n) + 1e-6) for s, (n, f) in zip(self.strengths, self.now_n)))


def smooth(time, begin, end):
    """From 0 to 1 without a jump of the speed."""
    share = min(max((time - begin) / (end - begin), 0.0), 1.0)
    return share**2 * (3 - 2 * share)


def height_m(time, strokes):
    """Height of the hand over its first place, m."""
    stroke = STROKE_M * (smooth(time, CLOSE_S, DOWN_S) - smooth(time, DOWN_S, READY_S)) if strokes else 0.0
    shake = SHAKE_M * math.sin(2 * math.pi * SHAKE_HZ * (time - HELD_S)) * smooth(time, HELD_S, HELD_S + 0.2) if time > HELD_S else 0.0
    return LIFT_M * smooth(time, READY_S, UP_S) + shake - stroke


def run(finger, lift, control):
    """One lift. Returns whether the box was dropped, its slip since the lift began, m, and the mean normal force of a finger in the air, N."""
    scene = scenes.lifted(
        lift.mass_kg, DT_S, "implicitfast", "elliptic", model_file=FILES[finger], strength_factor=lift.strength, stiffness=lift.stiffness
    )
    model = mujoco.MjModel.from_xml_string(scene.replace('kp="500"', 'kp="20000"'))
    data = mujoco.MjData(model)
    hand, box, sensors, ctrl = data.joint("lift").qpos, data.body("object").xpos, [data.sensor(side).data for side in SIDES], data.ctrl
    steps = round(END_S / DT_S)
    noise = (np.random.default_rng(lift.seed).standard_normal((steps, 5)) * [NOISE_MM, *[NOISE_N] * 4]).tolist()
    mujoco.mj_forward(model, data)
    lags_m, seen_mm, slip_m, rest_m, normal_n = [hand[0] - box[2]], 0.0, 0.0, box[2], []
    for i, (of_place, *of_forces) in enumerate(noise):
        time, contacts = i * DT_S, [sensor.tolist() for sensor in sensors]
        forces_n = [(c[NORMAL] + a, c[FRICTION] + c[DAMPING] + b) for c, a, b in zip(contacts, of_forces[::2], of_forces[1::2])]
        before_mm, seen_mm = seen_mm, 1e3 * (hand[0] if control.strokes else lags_m[-1] - lags_m[0]) + of_place
        control.step(time, forces_n, seen_mm - before_mm)
        ctrl[0], ctrl[1:] = height_m(time, control.strokes), control.grip_n * smooth(time, 0, 0.8 * CLOSE_S)
        mujoco.mj_step(model, data)
        lags_m.append(float(hand[0] - box[2]))
        if time < READY_S:
            ready_m, rest_m = lags_m[-1], box[2]
            continue
        if all(c[REGIME] == 3 for c in contacts):
            slip_m += abs(lags_m[-1] - lags_m[-2])
        if box[2] > rest_m + LIFTED_M:
            normal_n.append(sum(c[NORMAL] for c in contacts) / 2)
        if lags_m[-1] - ready_m > LOST_M:
            return True, slip_m, None
    return False, slip_m, sum(normal_n) / len(normal_n)


CONTROLLERS = {
    "observer, after a stroke, encoders alone": lambda finger, lift: Stroked(),
    "observer without a stroke": lambda finger, lift: Observed(),
    "fixed, expected strength and 50 %": lambda finger, lift: Fixed(1.5 * least_n(finger, dataclasses.replace(lift, strength=1.0, stiffness=1.0))),
    "fixed, weakest strength": lambda finger, lift: Fixed(1.1 * least_n(finger, dataclasses.replace(lift, strength=STRENGTHS[0], stiffness=1.0))),
    "threshold on dF/dt": lambda finger, lift: Rate(),
    "friction is known, 10 %": lambda finger, lift: Fixed(1.1 * least_n(finger, lift)),
}


def compared(finger, lifts, controllers=CONTROLLERS, tell=lambda done: None):
    """Of each controller the grip over the least one and the slip, m, in lifts that held, and the number of drops."""
    seen = {name: dict(ratios=[], slips_m=[], drops=0) for name in controllers}
    for done, lift in enumerate(lifts, 1):
        least = least_n(finger, lift)
        for name, made in controllers.items():
            is_lost, slip_m, normal_n = run(finger, lift, made(finger, lift))
            if is_lost:
                seen[name]["drops"] += 1
            else:
                seen[name]["ratios"].append(normal_n / least)
                seen[name]["slips_m"].append(slip_m)
        tell(done)
    return seen


def table(seen, lifts):
    """The comparison as Markdown."""
    lines = [f"| controller | grip over the least one, median | 90 % | drops in {lifts} lifts | largest slip without a drop, mm |"]
    lines.append("|---|---|---|---|---|")
    for name, of in seen.items():
        half, most = np.percentile(of["ratios"] or [np.nan], [50, 90])
        lines.append(f"| {name} | {half:.2f} | {most:.2f} | {of['drops']} | {1e3 * max(of['slips_m'], default=np.nan):.2f} |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lifts", type=int, default=200, help="how many lifts, each with every controller (200)")
    parser.add_argument("--seed", type=int, default=1, help="of the draw of the lifts (1)")
    parser.add_argument("--finger", choices=FILES, default="bed", help="what the fingers are; the observer's model is the bed")
    parser.add_argument("--tune", action="store_true", help="compare thresholds on dF/dt instead, on the lifts of another seed")
    arguments = parser.parse_args()
    lifts = drawn(arguments.lifts, arguments.seed + 1000 * arguments.tune)
    controllers = CONTROLLERS
    if arguments.tune:
        controllers = {f"dF/dt below -{share:g} of its largest": lambda finger, lift, share=share: Rate(share) for share in SHARES}
    seen = compared(arguments.finger, lifts, controllers, lambda done: print(f"lift {done} of {len(lifts)}", end="\r", file=sys.stderr, flush=True))
    print(file=sys.stderr)
    print(table(seen, len(lifts)))


if __name__ == "__main__":
    main()
