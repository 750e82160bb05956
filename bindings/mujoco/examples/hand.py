"""A whole hand: the LEAP hand of mujoco-menagerie grasps a block, a bottle, a pen and a card, lifts them, and is pulled until it slips.

    pip install mujoco-menagerie
    python examples/hand.py                                     a table of all objects
    python examples/hand.py --picture hand.webp                 and a picture that moves (needs pillow and a display)

The package downloads the hand on first use. The folder of a clone of mujoco_menagerie in MENAGERIE_ROOT replaces the download.
"""

import argparse
import collections

import mujoco
import mujoco.minimize
import numpy as np

import scenes

import fingerpad_mujoco

PAD_FILE = scenes.MODELS / "leap-tip-pad.fpm"
FINGERS = ("if", "mf", "rf", "th")
#: Half the width where the fingertips touch, half the length along y and half the height, m; mass, kg; geom.
OBJECTS = {
    "block": (0.02, 0.06, 0.025, 0.1, 'type="box" size="0.02 0.06 0.025"'),
    "bottle": (0.025, 0.08, 0.025, 0.15, 'type="cylinder" size="0.025 0.08" euler="90 0 0"'),
    "pen": (0.005, 0.07, 0.005, 0.02, 'type="cylinder" size="0.005 0.07" euler="90 0 0"'),
    "card": (0.0004, 0.0428, 0.027, 0.005, 'type="box" size="0.0004 0.0428 0.027"'),
}
#: Where each fingertip touches along the object, m from its middle.
ALONG_M = {"if": 0.03, "mf": 0.0, "rf": -0.03, "th": 0.0}
#: Joints of the pre-grasp, rad, from which the search for the grasp begins.
START_RAD = {"mcp": 1.0, "pip": 0.5, "dip": 0.4, "cmc": 1.5, "axl": 0.5}
#: Inertia of a servo's rotor at the joint, 1.7e-8 kg m² times 288². The model of the package has none: its light links vibrate at 4 ms.
ROTOR_KG_M2 = 0.00141
#: Gap of the open hand, m. Ends of closing, lifting and holding, s; height of the lift, m.
OPEN_M, CLOSE_S, LIFT_S, HOLD_S, LIFT_M = 0.008, 0.8, 1.6, 2.4, 0.05
#: A string pulls the object down: stiffness, N/m, damping, N s/m, and speed of its lower end, m/s.
STRING_N_M, STRING_N_S_M, PULL_M_S = 300, 2, 0.01
#: An object that has come down so far in the hand is lost, m: the hand's servos give way by up to 6 mm.
FALL_M = 0.008
#: Least and largest force of a finger, N; margin that the controller aims at.
LEAST_N, MOST_N, AIM = 0.15, 1.2, 0.4


def hand():
    """The hand without its meshes: rigid tips make way for pads, whose sites have the axes of the bone. What is seen are the geoms of collisions."""
    import mujoco_menagerie

    spec = mujoco_menagerie.get("leap_hand").spec("right_hand")
    for geom in [geom for geom in spec.geoms if geom.meshname]:
        spec.delete(geom)
    for mesh in list(spec.meshes):
        spec.delete(mesh)
    for finger in FINGERS:
        # The tip curls towards -x of its body and points along -y. The dome of 9 mm is first touched 30 degrees in front of its middle.
        middle = [0, -0.052, -0.0145] if finger == "th" else [0, -0.042, 0.0145]
        at = np.array(middle) - 0.009 * np.array([np.cos(np.pi / 6), np.sin(np.pi / 6), 0])
        spec.body(f"{finger}_ds").add_geom(name=f"{finger}_dome", size=[0.009, 0, 0], pos=middle, mass=0, contype=0, conaffinity=0)
        spec.body(f"{finger}_ds").add_site(name=f"{finger}_pad", pos=at, quat=[0.5, -0.5, 0.5, -0.5])
    for geom in spec.geoms:
        geom.material, geom.rgba = "", [0.75, 0.75, 0.78, 1]
    return spec


def scene(name, timestep=0.002):
    """The hand above a table with an object, on a slide `lift`. Returns the model."""
    _, length, height, mass, geom = OBJECTS[name]
    plugin = scenes.extension(*(scenes.instance(f, f"leap_{f}_pad", "object", model_file=PAD_FILE) for f in FINGERS))
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
      <sensor>{"".join(map(scenes.sensor, FINGERS))}</sensor>
    </mujoco>""")
    frame = world.body("wrist").add_frame()
    palm = hand()
    for joint in palm.joints:
        joint.armature = ROTOR_KG_M2
    for body in palm.bodies[1:]:
        body.gravcomp = 1
    palm.body("palm").quat, palm.body("palm").pos = [1, 0, 0, 0], [0, 0, 0]
    world.attach(palm, prefix="leap_", frame=frame)
    fingerpad_mujoco.add_bones(world)
    return world.compile()


class Grasp:
    """Joints that bring the fingertips to both sides of the object, found once, and servos that press with a force for each finger.

    The fingers regulate the force that their sensors report; the thumb, which opposes all of them, has their sum as a torque of its own.
    """

    def __init__(self, model, half):
        self.model, self.data = model, mujoco.MjData(model)
        self.joints = [model.joint(i) for i in range(model.njnt) if model.joint(i).name.startswith("leap_")]
        self.at = np.array([joint.qposadr[0] for joint in self.joints])
        self.dofs = np.array([joint.dofadr[0] for joint in self.joints])
        self.acts = np.array([model.actuator(f"{joint.name}_act").id for joint in self.joints])
        self.kp = model.actuator_gainprm[self.acts, 0]
        start = [START_RAD.get(joint.name.split("_")[-1], 0) for joint in self.joints] + [-0.03, -0.035, -0.14]
        touch, self.from_wrist = self._search(np.array(start), half)
        self.touch = touch
        self.open, _ = self._search(np.append(touch, self.from_wrist), half + OPEN_M, fixed=True)
        self.squeeze = dict.fromkeys(FINGERS, 0.0)

    def _search(self, start, half, fixed=False):
        """Joints, and the middle of the object from the wrist, with the sites on both faces in the neutral pose of the pads."""
        ranges = np.array([joint.range for joint in self.joints])
        room = 1e-6 if fixed else 0.1
        bounds = [np.append(ranges[:, k], start[-3:] + (-room, room)[k]) for k in (0, 1)]

        def residual(columns):
            return np.array([self._misses(column, half, ranges) for column in columns.T]).T

        found, _ = mujoco.minimize.least_squares(np.clip(start, *bounds), residual, bounds=bounds, verbose=0)
        return found[:-3], found[-3:]

    def _misses(self, column, half, ranges):
        self.data.qpos[self.at] = column[:-3]
        mujoco.mj_kinematics(self.model, self.data)
        out = list(0.3 * (column[:-3] - 0.3 * ranges.sum(axis=1)))
        for finger in FINGERS:
            site, out_of = self.data.site(f"leap_{finger}_pad"), np.array([-1.0 if finger == "th" else 1.0, 0, 0])
            axes = site.xmat.reshape(3, 3)
            off = site.xpos - self.data.body("wrist").xpos - column[-3:] - half * out_of - [0, ALONG_M[finger], 0]
            out += [*(1e3 * off), 10 * (out_of @ axes[:, 2] - np.cos(np.pi / 6)), 3 * (out_of @ axes[:, 0] + 0.5), 3 * out_of @ axes[:, 1]]
        return out

    def command(self, data, contacts, force_n, dt):
        """Writes the servos' targets for a force of each finger, N."""
        closing = np.clip(data.time / (0.6 * CLOSE_S), 0, 1)
        target = self.open + (self.touch - self.open) * closing
        jacobian = np.zeros((3, self.model.nv))
        for finger in FINGERS:
            force = force_n * (3 if finger == "th" else 1) * (closing == 1)
            if finger != "th" and closing == 1:
                self.squeeze[finger] += 10 * (force - contacts[finger]["normal_force_n"]) * dt
            inward = np.array([1.0 if finger == "th" else -1.0, 0, 0]) * (force + self.squeeze[finger])
            mujoco.mj_jacSite(self.model, data, jacobian, None, self.model.site(f"leap_{finger}_pad").id)
            target = target + (jacobian.T @ inward)[self.dofs] / self.kp
        data.ctrl[self.acts] = target


class Margin:
    """The controller: as much force as keeps the least slip margin of the fingers at AIM. Up at once, down within a second."""

    def __init__(self, force_n=0.5):
        self.force_n = force_n

    def __call__(self, contacts, dt):
        margin = min(contact["slip_margin"] for contact in contacts.values())
        if all(contact["regime"] for contact in contacts.values()):
            needed = self.force_n * (1 - margin) / (1 - AIM)
            self.force_n += (needed - self.force_n) * min(1, dt / (0.01 if needed > self.force_n else 0.5))
        self.force_n = np.clip(self.force_n, LEAST_N, MOST_N)
        return self.force_n


def run(name, control, timestep=0.002, pull_m=np.inf, watch=None):
    """Grasps, lifts and pulls an object until it is 8 mm lower in the hand, or the string's end ``pull_m``. ``control``: from contacts and time step
    to the force of a finger, N. Returns what was seen: the largest speed before slip; of slip the least margin of a finger in the tenth of a second in which
    it slipped, the largest of all; forces and margins of each step since the lift."""
    model, half = scene(name, timestep), OBJECTS[name][0]
    grasp, data = Grasp(model, half), mujoco.MjData(model)
    # The wrist stands so that the object on the rails is between the fingers.
    model.body("wrist").pos[:] = model.body("object").pos - grasp.from_wrist
    data.qpos[grasp.at] = grasp.open
    mujoco.mj_forward(model, data)
    body, hook = data.body("object"), data.mocap_pos[0].copy()
    seen = dict(speed_m_s=0.0, margin_at_slip=-1.0, pull_n=0.0, force_n=[], margin=[], flags=set(), lost=False)
    window = collections.deque(maxlen=round(0.1 / timestep))
    read = lambda: {finger: fingerpad_mujoco.read(data, finger)[0] for finger in FINGERS}
    contacts, has_slipped = read(), False
    while data.time < HOLD_S + min(pull_m, 0.08) / PULL_M_S:
        grasp.command(data, contacts, control(contacts, timestep), timestep)
        share = np.clip((data.time - CLOSE_S) / (LIFT_S - CLOSE_S), 0, 1)
        lift = LIFT_M * share**2 * (3 - 2 * share)
        data.ctrl[model.actuator("lift").id] = lift
        data.mocap_pos[0] = hook + [0, 0, lift - PULL_M_S * max(0.0, data.time - HOLD_S)]
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
        # Where the fingers are on the object, mm.
        places = 1e3 * np.array([body.xmat.reshape(3, 3).T @ (data.site(f"leap_{f}_pad").xpos - body.xpos) for f in FINGERS])[:, 1:]
        window.append((places, [contact["slip_margin"] for contact in contacts.values()], [contact["regime"] == 3 for contact in contacts.values()]))
        slips = (np.linalg.norm(places - window[0][0], axis=1) > 1.5) | window[-1][2]
        seen["margin_at_slip"] = max(seen["margin_at_slip"], np.min([margins for _, margins, _ in window], axis=0)[slips].max(initial=-1))
        has_slipped = has_slipped or slips.any()
        fall = (grasp.from_wrist - body.xpos + data.body("wrist").xpos)[2]
        if fall > FALL_M:
            seen["lost"] = True
            break
        seen["pull_n"] = max(seen["pull_n"], STRING_N_M * (data.ten_length[0] - 0.1))
        seen["force_n"].append(sum(contact["normal_force_n"] for contact in contacts.values()))
        seen["margin"].append(min(window[-1][1]))
    return seen | dict(warnings=int(data.warning.number.sum()), is_finite=bool(np.isfinite(data.qpos).all()))


def least_fixed(name, timestep, pull_m):
    """The least force of a fixed grip, in steps of 0.1 N a finger, that keeps every margin above 0.2; None if none does."""
    for force_n in np.arange(0.1, MOST_N + 0.01, 0.1):
        seen = run(name, lambda contacts, dt: force_n, timestep, pull_m)
        if not seen["lost"] and min(seen["margin"]) > 0.2:
            return seen
    return None


def compared(name, timestep=0.002, pull_m=0.005):
    """Mean force of all fingers with the controller, and with the least fixed grip that keeps the margin above 0.2 under the same pull."""
    own, fixed = run(name, Margin(), timestep, pull_m), least_fixed(name, timestep, pull_m)
    return dict(pull_n=own["pull_n"], margin=min(own["margin"]), force_n=np.mean(own["force_n"]), fixed_n=fixed and np.mean(fixed["force_n"]))


def picture(path, name="bottle", size=(400, 400), every_s=0.05):
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
            margin = contact["slip_margin"]
            model.geom(f"leap_{finger}_dome").rgba = (1 - margin, margin, 0, 1) if contact["regime"] else (0.9, 0.9, 0.9, 1)
        renderers[0].update_scene(data, camera)
        frames.append(Image.fromarray(renderers[0].render()))

    run(name, Margin(), watch=watch)
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=round(1e3 * every_s), loop=0, quality=60)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", metavar="FILE", help="write a picture that moves")
    parser.add_argument("--object", choices=OBJECTS, default="bottle", help="what it shows")
    arguments = parser.parse_args()
    if arguments.picture:
        picture(arguments.picture, arguments.object)
        return
    for name in OBJECTS:
        numbers = compared(name)
        print(f"{name}, pull of {numbers['pull_n']:.2f} N: controller {numbers['force_n']:.2f} N, least margin {numbers['margin']:.2f}; "
              f"least fixed grip with a margin above 0.2: {numbers['fixed_n'] or np.nan:.2f} N")
        for timestep in (0.001, 0.002, 0.004):
            seen = run(name, Margin(), timestep)
            print(f"  {1e3 * timestep:g} ms: slips at {seen['pull_n']:.2f} N; margin in slip at most {max(0, seen['margin_at_slip']):.3f}; "
                  f"fastest before slip {seen['speed_m_s']:.3f} m/s; {' '.join(sorted(seen['flags']))}")


if __name__ == "__main__":
    main()
