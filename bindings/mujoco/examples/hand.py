"""A whole hand: the LEAP, Allegro or Shadow hand of mujoco-menagerie grasps a block, a bottle, a pen and a card, lifts them, and is pulled until it slips. A LEAP hand also
rolls bottle and pen between thumb and fingers.

    pip install mujoco-menagerie
    python examples/hand.py --hand shadow                       a table of all objects
    python examples/hand.py --picture hand.webp                 and a picture that moves (needs pillow and a display)

The package downloads a hand on first use. The folder of a clone of mujoco_menagerie in MENAGERIE_ROOT replaces the download.
"""

import argparse
import collections
import dataclasses

import mujoco
import mujoco.minimize
import numpy as np

import scenes

import fingerpad_mujoco


@dataclasses.dataclass
class Hand:
    """What the example needs to know of a hand. Its thumb `th` is on one side of the object, all other fingers are on the other."""

    #: Name in the package, and the body of a fingertip with {} for the finger.
    model: str
    tip: str
    #: Where each fingertip touches along the object, m from its middle, and where its pad is first touched in the axes of its body, m.
    along_m: dict
    touch_m: dict
    #: The directions to the end of a finger and to its back in the axes of the tip's body.
    end: tuple
    back: tuple
    pad: str
    #: Rotation that turns the palm down and the fingers to x. Ends of actuators' names with their values, and the place of the object from the
    #: wrist, m, from which the search for the grasp begins.
    quat: tuple
    start: dict
    object_m: tuple
    #: Pairs of joints that one tendon drives, here by equal angles.
    coupled: tuple = ()
    #: The thumb's pad is so many times as large as the file's.
    thumb_size: float = 1.0

    @property
    def fingers(self):
        return tuple(self.along_m)


HANDS = {
    "leap": Hand(
        "leap_hand", "{}_ds", {"if": 0.036, "mf": 0.0, "rf": -0.036, "th": 0.0},
        dict.fromkeys(("if", "mf", "rf"), (-0.0109, -0.0485, 0.0145)) | {"th": (-0.0109, -0.0612, -0.0145)},
        (0, -1, 0), (1, 0, 0), "leap-tip-pad.fpm", (1, 0, 0, 0),
        {"th_mcp_act": -0.3, "mcp_act": 1.1, "pip_act": 0.3, "dip_act": 0.6, "cmc_act": 1.8, "ipl_act": 0.8}, (-0.035, -0.038, -0.14),
    ),
    "allegro": Hand(
        "wonik_allegro", "{}_tip", {"ff": 0.03, "mf": 0.0, "rf": -0.03, "th": 0.0},
        dict.fromkeys(("ff", "mf", "rf"), (0.0104, 0, 0.035)) | {"th": (0.0104, 0, 0.049)},
        (0, 0, 1), (-1, 0, 0), "allegro-tip-pad.fpm", (0.631, -0.058, 0.772, 0.047),
        {"tha0": 1.2, "tha1": 0.3, "tha2": 0.5, "tha3": 0.5, "a1": 0.8, "a2": 0.5, "a3": 0.4}, (-0.01, 0.04, -0.11),
    ),
    "shadow": Hand(
        "shadow_hand", "rh_{}distal", {"ff": 0.03, "mf": 0.01, "rf": -0.01, "lf": -0.03, "th": 0.0},
        dict.fromkeys(("ff", "mf", "rf", "lf"), (0, -0.0039, 0.0292)) | {"th": (0, -0.0046, 0.031)},
        (0, 0, 1), (0, 1, 0), "fingertip-pad.fpm", (0.702, -0.088, 0.702, 0.088),
        {"A_THJ5": 0.3, "A_THJ4": 1.1, "A_THJ2": 0.2, "A_THJ1": 0.3, "J3": 0.9, "J0": 0.9}, (0.33, 0.09, -0.1),
        coupled=tuple((f"rh_{finger}J1", f"rh_{finger}J2") for finger in ("FF", "MF", "RF", "LF")), thumb_size=1.25,
    ),
}
#: Half the width where the fingertips touch, half the length along y and half the height, m; mass, kg; geom.
OBJECTS = {
    "block": (0.02, 0.06, 0.025, 0.1, 'type="box" size="0.02 0.06 0.025"'),
    "bottle": (0.025, 0.08, 0.025, 0.15, 'type="cylinder" size="0.025 0.08" euler="90 0 0"'),
    "pen": (0.005, 0.07, 0.005, 0.02, 'type="cylinder" size="0.005 0.07" euler="90 0 0"'),
    "card": (0.0004, 0.0428, 0.027, 0.005, 'type="box" size="0.0004 0.0428 0.027"'),
}
#: Gap of the open hand, m. Ends of closing, lifting and holding, s; height of the lift, m.
OPEN_M, CLOSE_S, LIFT_S, HOLD_S, LIFT_M = 0.008, 0.8, 1.6, 2.4, 0.05
#: How far the fingertips of a LEAP hand go up, and the thumb down, to roll an object, m, and how long one way takes, s.
ROLLS_M, ROLL_S = {"bottle": 0.008, "pen": 0.002}, 1.0
#: A string pulls the object down: stiffness, N/m, damping, N s/m, and speed of its lower end, m/s.
STRING_N_M, STRING_N_S_M, PULL_M_S = 300, 2, 0.005
#: An object that has come down so far between the fingertips is lost, m.
FALL_M = 0.008
#: Least and largest force of a finger, N; margin that the controller aims at. More force presses a pen out of the fingers.
LEAST_N, MOST_N, AIM = 0.15, {"block": 1.0, "bottle": 1.0, "pen": 0.7, "card": 1.0}, 0.3


def palm(hand):
    """The hand of the package: its rigid tips touch nothing, sites at their places have the axes of the bone. Nothing has weight."""
    import mujoco_menagerie

    spec = mujoco_menagerie.get(hand.model).spec("right_hand")
    spec.option.impratio = 100
    for geom in spec.geoms:
        if geom.type != mujoco.mjtGeom.mjGEOM_MESH:
            geom.group = 3
    axes = np.column_stack([hand.end, np.cross(hand.back, hand.end), hand.back]).astype(float)
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, axes.ravel())
    for finger in hand.fingers:
        tip = spec.body(hand.tip.format(finger))
        for geom in tip.geoms:
            if geom.type != mujoco.mjtGeom.mjGEOM_BOX:
                geom.contype, geom.conaffinity = 0, 0
        tip.add_site(name=finger, pos=hand.touch_m[finger], quat=quat)
    for one, other in hand.coupled:
        spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT, name1=one, name2=other, data=[0, 1] + [0] * 10)
    for actuator in spec.actuators:
        # A target that presses may lie beyond the range.
        actuator.ctrllimited = False
    for body in spec.bodies[1:]:
        body.gravcomp = 1
    spec.bodies[1].quat, spec.bodies[1].pos = hand.quat, [0, 0, 0]
    return spec


def scene(hand, name, timestep=0.002):
    """The hand above a table with an object, on a slide `lift`. Returns the model."""
    _, length, height, mass, geom = OBJECTS[name]
    pads = (scenes.instance(f, f"hand_{f}", "object", model_file=scenes.MODELS / hand.pad, size=hand.thumb_size if f == "th" else 1) for f in hand.fingers)
    plugin = scenes.extension(*pads)
    rails = "".join(f'<geom name="rail{k}" type="box" size="0.02 0.003 0.02" pos="0 {0.85 * k * length} -0.02" contype="0" conaffinity="0"/>' for k in (-1, 1))
    world = mujoco.MjSpec.from_string(f"""<mujoco>
      <option timestep="{timestep}" integrator="implicitfast" cone="elliptic" impratio="100"/>
      {plugin}
      <asset><texture type="skybox" builtin="flat" rgb1="1 1 1" rgb2="1 1 1" width="8" height="48"/></asset>
      <worldbody>
        <light pos="0.2 -0.4 0.6" dir="-0.3 0.6 -0.8"/>
        {rails}
        <body name="hook" mocap="true" pos="0 0 {height - 0.1}"><site name="hook" size="0.002"/></body>
        <body name="wrist" pos="0 0 0.15"><joint name="lift" type="slide" axis="0 0 1" damping="20"/>
          <inertial pos="0 0 0" mass="0.5" diaginertia="0.001 0.001 0.001"/></body>
        <body name="object" pos="0 0 {height}">
          <freejoint name="object"/><site name="middle" size="0.002"/>
          <geom name="object" {geom} mass="{mass}" rgba="0.2 0.5 0.8 1" contype="0" conaffinity="0"/>
        </body>
      </worldbody>
      <tendon><spatial name="string" stiffness="{STRING_N_M}" damping="{STRING_N_S_M}" springlength="0 0.1" width="0.0005">
        <site site="middle"/><site site="hook"/></spatial></tendon>
      <contact><pair geom1="object" geom2="rail-1" condim="3" friction="0.5 0.5"/><pair geom1="object" geom2="rail1" condim="3" friction="0.5 0.5"/></contact>
      <actuator><position name="lift" joint="lift" kp="2000" dampratio="1"/></actuator>
      <sensor>{"".join(map(scenes.sensor, hand.fingers))}</sensor>
    </mujoco>""")
    world.attach(palm(hand), prefix="hand_", frame=world.body("wrist").add_frame())
    fingerpad_mujoco.add_bones(world)
    return world.compile()


def smooth(time, begin, end):
    """From 0 to 1 without a jump of the speed."""
    share = np.clip((time - begin) / (end - begin), 0, 1)
    return share**2 * (3 - 2 * share)


class Grasp:
    """Lengths of the actuators that bring the fingertips to both sides of the object, found once, and servos that press with a force for each finger.

    The fingers regulate the force that their sensors report; the thumb, which opposes all of them, has their sum as a torque of its own.
    """

    def __init__(self, model, hand, half):
        self.model, self.data, self.hand = model, mujoco.MjData(model), hand
        mujoco.mj_forward(model, self.data)
        moment = np.zeros((model.nu, model.nv))
        mujoco.mju_sparse2dense(moment, self.data.actuator_moment, self.data.moment_rownnz, self.data.moment_rowadr, self.data.moment_colind)
        self.acts = np.array([i for i in range(model.nu) if model.actuator(i).name.startswith("hand_")])
        self.dofs = np.flatnonzero(moment[self.acts].any(axis=0))
        self.at = model.jnt_qposadr[model.dof_jntid[self.dofs]]
        #: Joints' angles from actuators' lengths; its transpose is from joints' torques to actuators' forces.
        self.joints = np.linalg.pinv(moment[np.ix_(self.acts, self.dofs)])
        self.kp = model.actuator_gainprm[self.acts, 0]
        names = [model.actuator(i).name for i in self.acts]
        start = [next((value for end, value in hand.start.items() if name.endswith(end)), 0) for name in names]
        self.touch, self.open, self.from_wrist = self._search(start, half)
        self.squeeze, self.lengths = dict.fromkeys(hand.fingers, 0.0), moment[np.ix_(self.acts, self.dofs)]
        #: How far the fingers go up and the thumb goes down, m.
        self.roll_m = 0.0

    def _search(self, start, half):
        """Actuators' lengths on the object and beside it, and its middle from the wrist, with the sites at both faces in the neutral pose of the pads."""
        n, ranges, place = len(self.acts), self.model.actuator_ctrlrange[self.acts], np.array(self.hand.object_m)
        bounds = [np.concatenate([ranges[:, k], ranges[:, k], place + (-0.1, 0.1)[k]]) for k in (0, 1)]

        def misses(column):
            return [*self._misses(column[:n], column[-3:], half), *self._misses(column[n:-3], column[-3:], half + OPEN_M)]

        begin = np.clip(np.concatenate([start, start, place]), *bounds)
        found, _ = mujoco.minimize.least_squares(begin, lambda columns: np.array([misses(column) for column in columns.T]).T, bounds=bounds, verbose=0)
        return found[:n], found[n:-3], found[-3:]

    def _misses(self, lengths, place, half):
        self.data.qpos[self.at] = self.joints @ lengths
        mujoco.mj_kinematics(self.model, self.data)
        out = list(0.3 * (lengths - 0.3 * self.model.actuator_ctrlrange[self.acts].sum(axis=1)))
        for finger, along in self.hand.along_m.items():
            site, out_of = self.data.site(f"hand_{finger}"), np.array([-1.0 if finger == "th" else 1.0, 0, 0])
            axes = site.xmat.reshape(3, 3)
            off = site.xpos - self.data.body("wrist").xpos - place - half * out_of - [0, along, 0]
            out += [*(1e3 * off), 10 * (out_of @ axes[:, 2] - np.cos(np.pi / 6)), 3 * (out_of @ axes[:, 0] + 0.5), 3 * out_of @ axes[:, 1]]
        return out

    def command(self, data, contacts, force_n, dt):
        """Writes the servos' targets for a force of each finger, N."""
        closing, pressing = smooth(data.time, 0, 0.6 * CLOSE_S), smooth(data.time, 0.6 * CLOSE_S, 0.8 * CLOSE_S)
        target = self.open + (self.touch - self.open) * closing
        jacobian = np.zeros((3, self.model.nv))
        for finger in self.hand.fingers:
            force = force_n * (len(self.hand.fingers) - 1 if finger == "th" else 1) * pressing
            if finger != "th" and pressing:
                self.squeeze[finger] += 10 * (force - contacts[finger]["normal_force_n"]) * dt
            inward = np.array([1.0 if finger == "th" else -1.0, 0, 0]) * (force + self.squeeze[finger])
            mujoco.mj_jacSite(self.model, data, jacobian, None, self.model.site(f"hand_{finger}").id)
            target = target + self.joints.T @ (jacobian.T @ inward)[self.dofs] / self.kp
            moves = np.linalg.pinv(jacobian[:, self.dofs])
            target = target + self.lengths @ moves[:, 2] * (-self.roll_m if finger == "th" else self.roll_m)
        data.ctrl[self.acts] = target


class Margin:
    """The controller: as much force as keeps the least slip margin of the fingers at AIM. Up at once, down within a second."""

    def __init__(self, name, force_n=0.5):
        self.force_n, self.most_n = force_n, MOST_N[name]

    def __call__(self, contacts, dt):
        margin = min(contact["slip_margin"] for contact in contacts.values())
        if all(contact["regime"] for contact in contacts.values()):
            needed = self.force_n * (1 - margin) / (1 - AIM)
            self.force_n += (needed - self.force_n) * min(1, dt / (0.01 if needed > self.force_n else 0.5))
        self.force_n = np.clip(self.force_n, LEAST_N, self.most_n)
        return self.force_n


def rolling_rad_s(data, hand, radius):
    """How fast the object turns about y if it rolls without slip on the tips, which move as rigid bodies: mean of the thumb and of the other fingers."""
    rates, body, speed = {}, data.body("object"), np.zeros(6)
    for finger in hand.fingers:
        site = data.site(f"hand_{finger}")
        out = (site.xpos - body.xpos) * [1, 0, 1]
        out /= np.linalg.norm(out)
        mujoco.mj_objectVelocity(data.model, data, mujoco.mjtObj.mjOBJ_SITE, site.id, speed, 0)
        there = speed[3:] + np.cross(speed[:3], body.xpos * [1, 0, 1] + site.xpos * [0, 1, 0] + radius * out - site.xpos)
        rates[finger] = np.cross([0, 1, 0], out) @ there / radius
    return (rates.pop("th") + np.mean(list(rates.values()))) / 2


def run(hand, name, control, timestep=0.002, most_pull_n=np.inf, watch=None, roll_m=0.0):
    """Grasps, lifts and pulls an object until it is 8 mm lower in the hand, or until the pull ``most_pull_n``. With ``roll_m`` it rolls the object
    instead: the fingers go up and the thumb down by so much within ROLL_S, and back. ``control``: from contacts and time step
    to the force of a finger, N. Returns what was seen: the largest speed before slip; of slip the least margin of a finger in the tenth of a second in which
    it slipped, the largest of all; forces and margins of each step since the lift."""
    hand = HANDS[hand]
    model, half = scene(hand, name, timestep), OBJECTS[name][0]
    grasp, data = Grasp(model, hand, half), mujoco.MjData(model)
    # The wrist stands so that the object on the rails is between the fingers.
    model.body("wrist").pos[:] = model.body("object").pos - grasp.from_wrist
    data.qpos[grasp.at] = grasp.joints @ grasp.open
    mujoco.mj_forward(model, data)
    body, hook = data.body("object"), data.mocap_pos[0].copy()
    seen = dict(turn_rad=[0.0], rolled_rad=[0.0], speed_m_s=0.0, margin_at_slip=-1.0, pull_n=0.0, force_n=[], margin=[], flags=set(), lost=False)
    window = collections.deque(maxlen=round(0.1 / timestep))
    read = lambda: {finger: fingerpad_mujoco.read(data, finger)[0] for finger in hand.fingers}
    contacts, has_slipped = read(), False
    end_s, pull_m_s = (HOLD_S + 3 * ROLL_S, 0.0) if roll_m else (HOLD_S + 0.08 / PULL_M_S, PULL_M_S)
    while data.time < end_s and seen["pull_n"] < most_pull_n:
        grasp.roll_m = roll_m * (smooth(data.time, HOLD_S, HOLD_S + ROLL_S) - smooth(data.time, end_s - ROLL_S, end_s))
        grasp.command(data, contacts, control(contacts, timestep), timestep)
        lift = LIFT_M * smooth(data.time, CLOSE_S, LIFT_S)
        data.ctrl[model.actuator("lift").id] = lift
        data.mocap_pos[0] = hook + [0, 0, lift - pull_m_s * max(0.0, data.time - HOLD_S)]
        if watch:
            watch(model, data, contacts)
        mujoco.mj_step(model, data)
        # All that follows is of the position at which the step began.
        contacts = read()
        if not has_slipped:
            seen["speed_m_s"] = max(seen["speed_m_s"], np.linalg.norm(body.cvel[3:] - data.body("wrist").cvel[3:]))
        seen["flags"] |= {flag for contact in contacts.values() for flag in fingerpad_mujoco.flags(contact["status"])}
        if data.time < LIFT_S:
            continue
        if roll_m:
            first_rad = np.arctan2(-body.xmat[6], body.xmat[0]) if len(seen["turn_rad"]) == 1 else first_rad
            seen["turn_rad"].append(np.arctan2(-body.xmat[6], body.xmat[0]) - first_rad)
            seen["rolled_rad"].append(seen["rolled_rad"][-1] + rolling_rad_s(data, hand, half) * timestep)
        # Where the fingers are on the object, mm.
        places = 1e3 * np.array([body.xmat.reshape(3, 3).T @ (data.site(f"hand_{f}").xpos - body.xpos) for f in hand.fingers])[:, 1:]
        window.append((places, [contact["slip_margin"] for contact in contacts.values()], [contact["regime"] == 3 for contact in contacts.values()]))
        slips = (np.linalg.norm(places - window[0][0], axis=1) > 1.5) | window[-1][2]
        seen["margin_at_slip"] = max(seen["margin_at_slip"], np.min([margins for _, margins, _ in window], axis=0)[slips].max(initial=-1))
        has_slipped = has_slipped or slips.any()
        if places[:, 1].mean() > 1e3 * FALL_M:
            seen["lost"] = True
            break
        seen["pull_n"] = max(seen["pull_n"], STRING_N_M * (data.ten_length[0] - 0.1))
        seen["force_n"].append(sum(contact["normal_force_n"] for contact in contacts.values()))
        seen["margin"].append(min(window[-1][1]))
    return seen | dict(warnings=int(data.warning.number.sum()), is_finite=bool(np.isfinite(data.qpos).all()))


def least_fixed(hand, name, timestep, pull_n):
    """The least force of a fixed grip, in steps of 0.1 N a finger, that keeps every margin above 0.2; None if none does."""
    for force_n in np.arange(0.1, 1.6, 0.1):
        seen = run(hand, name, lambda contacts, dt: force_n, timestep, pull_n)
        if seen["pull_n"] >= pull_n and min(seen["margin"]) > 0.2:
            return seen
    return None


def compared(hand, name, timestep=0.002, pull_n=1.0):
    """Mean force of all fingers with the controller, and with the least fixed grip that keeps the margin above 0.2 under the same pull."""
    own, fixed = run(hand, name, Margin(name), timestep, pull_n), least_fixed(hand, name, timestep, pull_n)
    return dict(pull_n=own["pull_n"], margin=min(own["margin"]), force_n=np.mean(own["force_n"]), fixed_n=fixed and np.mean(fixed["force_n"]))


def picture(path, hand="leap", name="bottle", size=(400, 400), every_s=0.05):
    """A picture that moves: grasp, lift and pull. Needs pillow and a display, or MUJOCO_GL=osmesa or egl."""
    from PIL import Image

    frames, renderers = [], []
    camera = mujoco.MjvCamera()
    camera.distance, camera.azimuth, camera.elevation, camera.lookat[:] = 0.4, 65, -14, (0.0, 0.0, 0.09)

    def watch(model, data, contacts):
        if data.time < len(frames) * every_s:
            return
        renderers[:] = renderers or [mujoco.Renderer(model, size[1], size[0])]
        for finger, contact in contacts.items():
            margin = min(1, contact["slip_margin"] / AIM)
            tip = model.body("hand_" + HANDS[hand].tip.format(finger)).id
            model.geom_rgba[model.geom_bodyid == tip] = (1 - margin, margin, 0, 1) if contact["regime"] else (0.9, 0.9, 0.9, 1)
        renderers[0].update_scene(data, camera)
        frames.append(Image.fromarray(renderers[0].render()))

    run(hand, name, Margin(name), watch=watch)
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=round(1e3 * every_s), loop=0, quality=60)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hand", choices=HANDS, default="leap")
    parser.add_argument("--picture", metavar="FILE", help="write a picture that moves")
    parser.add_argument("--object", choices=OBJECTS, default="bottle", help="what it shows")
    arguments = parser.parse_args()
    if arguments.picture:
        picture(arguments.picture, arguments.hand, arguments.object)
        return
    for name in OBJECTS:
        numbers = compared(arguments.hand, name)
        print(f"{name}, pull of {numbers['pull_n']:.2f} N: controller {numbers['force_n']:.2f} N, least margin {numbers['margin']:.2f}; "
              f"least fixed grip with a margin above 0.2: {numbers['fixed_n'] or np.nan:.2f} N")
        for timestep in (0.001, 0.002, 0.004):
            seen = run(arguments.hand, name, Margin(name), timestep)
            print(f"  {1e3 * timestep:g} ms: slips at {seen['pull_n']:.2f} N; margin in slip at most {max(0, seen['margin_at_slip']):.3f}; "
                  f"fastest before slip {seen['speed_m_s']:.3f} m/s; {' '.join(sorted(seen['flags']))}")
    for name, roll_m in ROLLS_M.items() if arguments.hand == "leap" else ():
        seen = run("leap", name, Margin(name), roll_m=roll_m)
        most = np.argmax(np.abs(seen["rolled_rad"]))
        print(f"{name} rolled by {abs(seen['turn_rad'][most]):.3f} rad, rolling without slip {abs(seen['rolled_rad'][most]):.3f}; "
              f"{seen['turn_rad'][-1]:.3f} after the way back; least margin {min(seen['margin']):.2f}")


if __name__ == "__main__":
    main()
