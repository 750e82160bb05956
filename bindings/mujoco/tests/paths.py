"""A finger and an object that are led along a path: positions are prescribed, step by step."""

import functools

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fingerpad_mujoco
import meshes
import scenes
from reference import PadFinger

#: Half the size of the object, m: as wide as thick, so that all faces are alike.
HALF = 0.03
TOP = np.array([0.0, 0.0, 1e3 * HALF])
#: The plugin's own when none is given.
PAD_RADIUS_MM = 21.0
PAD = dict(model_file=scenes.PAD_FILE)
NO_DAMPING = dict(damping_slide_n_s_per_m=0, damping_spin_n_m_s_per_rad=0, damping_normal_n_s_per_m=0)
#: Place and turn of an object at rest.
STILL = (np.zeros(3), Rotation.identity())


def first_of(value, *others):
    """Values of a parameter; all but the first are nightly."""
    nightly = (pytest.param(*(other if isinstance(other, tuple) else (other,)), marks=pytest.mark.nightly) for other in others)
    return [value, *nightly]


def within_limit(data, names):
    """Checks that the semi-implicit friction of each finger is within the limit of its normal force."""
    for pad in (fingerpad_mujoco.read(data, name)[0] for name in names):
        friction = np.hypot(pad["friction_x_n"] + pad["damping_x_n"], pad["friction_y_n"] + pad["damping_y_n"])
        share = (pad["normal_force_n"] + pad["damping_normal_n"]) / max(pad["normal_force_n"], 1e-9)
        assert not pad["semi_implicit"] or friction <= 1.001 * share * pad["friction_limit_n"] + 1e-6, pad


def scene(geom="box", radius=HALF, **attributes):
    """A free finger, its site at its origin, and a free object, a box of half the size HALF, a round one of `radius`,
    or a mesh of one of these; `plane` is fixed to the world."""
    attributes = {"site": "finger", "geoms": "object", **attributes}
    shapes = {
        "box": f'type="box" size="{HALF} {HALF} {HALF}"',
        "ball": f'type="sphere" size="{radius}"',
        # As high as the ball, with the same mean curvature on top.
        "egg": f'type="ellipsoid" size="{1.15 * radius} {radius / 1.15} {radius}"',
        "rod": f'type="cylinder" size="{radius} 0.1" euler="0 90 0"',
        "capsule": f'type="capsule" size="{radius} 0.1" euler="90 0 0"',
        "mesh box": 'type="mesh" mesh="box"',
        "mesh ball": 'type="mesh" mesh="ball"',
        "mesh egg": 'type="mesh" mesh="egg"',
        "mesh rod": 'type="mesh" mesh="rod" euler="0 90 0"',
        "coarse rod": 'type="mesh" mesh="coarse" euler="0 90 0"',
    }
    own = {
        "mesh box": lambda: meshes.element("box", *meshes.box((HALF, HALF, HALF))),
        "mesh ball": lambda: meshes.element("ball", *meshes.sphere(radius, rings=24)),
        "mesh egg": lambda: meshes.element("egg", *meshes.ellipsoid((1.15 * radius, radius / 1.15, radius), rings=24)),
        "mesh rod": lambda: meshes.element("rod", *meshes.cylinder(radius, 0.1)),
        "coarse rod": lambda: meshes.element("coarse", *meshes.cylinder(radius, 0.1, sides=12)),
    }
    asset = f"<asset>{own[geom]()}</asset>" if geom in own else ""
    if geom == "plane":
        what = '<geom name="object" type="plane" size="1 1 1"/>'
    else:
        what = f'<body name="object"><freejoint/><geom name="object" {shapes[geom]} mass="1"/></body>'
    return f"""<mujoco>
  <option timestep="0.001" gravity="0 0 0"><flag contact="disable"/></option>
  <size nuserdata="4"/>
  {scenes.extension(scenes.instance("finger", **attributes))}
  {asset}
  <worldbody>
    <body name="finger"><freejoint/><geom size="0.01" mass="1" contype="0" conaffinity="0"/><site name="finger" euler="0 30 0"/></body>
    {what}
  </worldbody>
  <sensor>{scenes.sensor("finger")}</sensor>
</mujoco>"""


#: Turns that bring the upper face of the object to each of its faces: +x, +y, +z, -x, -y, -z.
FACES = [Rotation.from_rotvec(v) for v in np.pi / 2 * np.array(
    [[0, 1, 0], [-1, 0, 0], [0, 0, 0], [0, -1, 0], [1, 0, 0], [2, 0, 0]])]


def finger_at(row):
    """The finger on the upper face of an object at the origin: depth of the pad's lowest point, place, turn, pitch and roll, as
    in `wandering`; position, mm, and turn."""
    depth, x, y, turn, pitch, roll = row
    axes = Rotation.from_euler("z", turn) * Rotation.from_euler("y", pitch) * Rotation.from_euler("x", roll)
    lift = PAD_RADIUS_MM * (2 - np.cos(pitch) - np.cos(roll))
    return TOP + [x, y, lift - depth], axes


@functools.cache
def pad():
    """The pad, for numbers that do not depend on a contact."""
    return PadFinger(scenes.PAD_FILE)


def lowest(pitch, roll):
    """How far the pad's lowest point lies below the site in a pose, mm."""
    touch = pad().first_touch(30 + np.degrees(pitch), np.degrees(roll))
    turned = Rotation.from_euler("y", pitch) * Rotation.from_euler("x", roll)
    return -turned.apply(touch)[2]


def pad_at(row, top=TOP):
    """As `finger_at`, of a pad, whose lowest point depends on the pose."""
    depth, x, y, turn, pitch, roll = row
    axes = Rotation.from_euler("z", turn) * Rotation.from_euler("y", pitch) * Rotation.from_euler("x", roll)
    return top + [x, y, lowest(pitch, roll) - depth], axes


def place(data, name, position_mm, turn):
    joint = data.body(name)
    address = data.model.jnt_qposadr[data.model.body_jntadr[joint.id]]
    data.qpos[address : address + 3] = 1e-3 * np.asarray(position_mm)
    data.qpos[address + 3 : address + 7] = turn.as_quat(scalar_first=True)


def lead(model, data, finger, object=None):
    """Takes one step with the finger (and the object) at the given place, at rest; returns the contact there."""
    place(data, "finger", *finger)
    if object is not None:
        place(data, "object", *object)
    data.qvel[:] = 0
    mujoco.mj_step(model, data)
    return fingerpad_mujoco.read(data, "finger")[0]


def model_and_data(**options):
    model = mujoco.MjModel.from_xml_string(scene(**options))
    return model, mujoco.MjData(model)


def lead_along(path, where=finger_at, pose_of=lambda i: STILL, **options):
    """The contacts along a path. `where` places the finger against an object at the origin, `pose_of` the object at each step."""
    model, data = model_and_data(**options)
    contacts = []
    for i, row in enumerate(path):
        (at, axes), (moved, turn) = where(row), pose_of(i)
        contacts.append(lead(model, data, (moved + turn.apply(at), turn * axes), (moved, turn)))
    return contacts


def tumbling(seed, steps):
    """Place and turn of an object that moves at random, for `lead_along`."""
    random = np.random.default_rng(seed)
    turns = Rotation.from_rotvec(np.cumsum(random.normal(0, 0.01, (steps, 3)), axis=0))
    places = np.cumsum(random.normal(0, 0.3, (steps, 3)), axis=0)
    return lambda i: (places[i], turns[i])


def reference_along(finger, path):
    """The responses of a finger of the C library along a path on a plane: slide and turn of the plane in the finger's axes, the pose
    as well for a pad."""
    answers, last = [], None
    for row in path:
        depth, x, y, turn, pitch, roll = row
        motion = [0.0, 0.0, 0.0]
        if last is not None:
            middle = 0.5 * (turn + last[3])
            u, v = x - last[1], y - last[2]
            motion = [-(u * np.cos(middle) + v * np.sin(middle)), -(v * np.cos(middle) - u * np.sin(middle)), last[3] - turn]
        pose = (30 + np.degrees(pitch), np.degrees(roll)) if isinstance(finger, PadFinger) else ()
        answers.append(finger.step(depth, *motion, *pose))
        last = row
    return answers


def wandering(seed, steps=600):
    """A path that presses, slides, turns and tilts a little at random, with reversals and lift-offs; rows of depth mm, slide of
    the finger x, y mm, turn about the normal, pitch and roll, rad."""
    random = np.random.default_rng(seed)
    knots = np.zeros((13, 6))
    knots[1:, 0] = random.uniform(-0.3, 2.0, 12)
    knots[:, 1:3] = np.cumsum(random.normal(0, 0.8, (13, 2)), axis=0)
    knots[:, 3] = np.cumsum(random.normal(0, 0.3, 13))
    knots[:, 4:] = random.uniform(-0.2, 0.2, (13, 2))
    at = np.linspace(0, 12, steps)
    path = np.stack([np.interp(at, np.arange(13), column) for column in knots.T], axis=1)
    return path + random.normal(0, 1e-4, path.shape)
