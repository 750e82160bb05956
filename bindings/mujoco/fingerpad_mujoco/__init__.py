"""Fingertip contact for MuJoCo: names the numbers of the sensors of the engine plugin ``fingerpad.contact``.

``import mujoco`` loads the plugin once this package is installed::

    model = mujoco.MjModel.from_xml_path("hand.xml")
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    print(fingerpad_mujoco.read(data, "thumb")[0]["slip_margin"])

Raises ImportError if the plugin was built against another version of MuJoCo.
"""

import ctypes
import pathlib

import mujoco
import numpy as np

from ._plugin import MODELS as MODELS, load
#: Name of the plugin in a model.
PLUGIN = "fingerpad.contact"
#: Numbers of the sensor for each contact, in this order. Forces are those that the geom exerts on the finger along x (the finger's
#: axis within the face), y and the face's normal, without the dampers. The ``damping_...`` forces are those of the dampers.
OUTPUTS = (
    "normal_force_n",
    "friction_x_n",
    "friction_y_n",
    "spin_moment_n_mm",
    "depth_mm",
    "stick_ratio",
    "slip_margin",
    "friction_limit_n",
    "contact_area_mm2",
    "pressure_centre_x_mm",
    "pressure_centre_y_mm",
    "regime",
    "status",
    "face",
    "damping_x_n",
    "damping_y_n",
    "damping_normal_n",
    "damping_moment_n_mm",
    "stable_step_s",
    "semi_implicit",
)
#: Numbers of a patch in a sensor of the plugin ``fingerpad.patches``, in this order and in SI units; see :func:`read_patches`.
PATCH = np.dtype(
    [
        ("position_m", float, 3),
        ("force_n", float, 3),
        ("moment_n_m", float, 3),
        ("pressure_pa", float),
        ("shear_pa", float, 2),
        ("area_m2", float),
        ("contact_area_m2", float),
        ("stick_ratio", float),
    ]
)
_stable_step = load().fingerpad_mujoco_stable_step
_stable_step.restype, _stable_step.argtypes = ctypes.c_double, [ctypes.c_void_p, ctypes.c_void_p]
#: Flags of ``status``.
STATUS = {
    2: "bad_input",
    4: "bad_time_step",
    8: "depth_above_range",
    16: "large_increment",
    128: "memory_lost",
    512: "pose_out_of_range",
    1024: "not_converged",
    2048: "body_too_sharp",
    4096: "began_inside",
    8192: "beyond_edge",
    16384: "step_too_long",
}


def spec_from_path(path):
    """The MjSpec of a model's XML file, in which each relative ``model_file`` counts from the folder of that file, unless only :data:`MODELS` has it.

    Attach it to another with ``MjSpec.attach(spec, prefix="L_", ...)``, or compile it. MuJoCo itself gives a plugin no folder: in
    a model that is loaded otherwise a relative ``model_file`` counts from the working directory. Raises ValueError for a file that
    MuJoCo cannot read.
    """
    path = pathlib.Path(path)
    spec = mujoco.MjSpec.from_file(str(path))
    for plugin in spec.plugins:
        config = dict(plugin.config)
        if plugin.plugin_name == PLUGIN and config.get("model_file"):
            # An absolute path replaces the folder before it.
            beside = path.resolve().parent / config["model_file"]
            if beside.is_file() or not (MODELS / config["model_file"]).is_file():
                config["model_file"] = str(beside)
                plugin.config = config
    return spec


def model_from_path(path):
    """The MjModel of a model's XML file, in which each relative ``model_file`` counts from the folder of that file."""
    return spec_from_path(path).compile()


def add_bones(spec, margin=0.0, **geom):
    """Adds the rigid part of each fingertip of a spec, bone and nail: a capsule that MuJoCo's own contact handles.

    Radius 4 mm, from 4 to 25 mm behind the site along the finger and 9.7 mm above it, so that a flat face meets it 6.4 mm deep in the neutral
    pose, beyond the range of the shipped pad; times the instance's ``size``. It touches the geoms of the instance, whatever their
    ``contype``, and the other bones, but has no mass. ``margin``: of these contacts, m. ``geom``: further arguments of ``add_geom``. Call it
    when all parts are attached. Returns the names of the geoms: those of the sites with ``_bone`` appended.
    """
    bones = {}
    for plugin in spec.plugins:
        if plugin.plugin_name != PLUGIN or not plugin.config.get("site"):
            continue
        config, who = dict(plugin.config), plugin.name
        named = lambda objects, name: _named(objects, name, who)
        site, size = named(spec.sites, config["site"]), float(config.get("size") or 1)
        bone = site.name + "_bone"
        if bone not in bones:
            made = site.parent.add_geom(
                name=bone, type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[0.004 * size, 0, 0], mass=0, contype=0, conaffinity=0,
                fromto=[-0.004 * size, 0, 0.0097 * size, -0.025 * size, 0, 0.0097 * size], **geom,
            )
            made.set_frame(_frame_at(site))
            for other in bones:
                if bones[other].parent != site.parent:
                    spec.add_pair(geomname1=bone, geomname2=other, margin=margin)
            bones[bone] = site
        for name in config.get("geoms", "").split():
            spec.add_pair(geomname1=bone, geomname2=named(spec.geoms, name).name, margin=margin)
    return list(bones)


def _named(objects, name, instance):
    """The object of a name, or of the name with a prefix and a suffix of the instance's, as the plugin finds it."""
    size = len(instance)
    names = {name} | {instance[:i] + name + instance[j:] for i in range(size + 1) for j in range(i, size + 1)}
    found = [o for o in objects if o.name in names]
    if len(found) != 1:
        raise ValueError(f"instance '{instance}': {len(found)} objects go by the name '{name}'")
    return found[0]


def _frame_at(site):
    """A frame of the site's body that lies at the site, however its orientation was given."""
    frame = site.parent.add_frame(pos=site.pos, quat=site.quat)
    for name in ("axisangle", "xyaxes", "zaxis", "euler", "type"):
        setattr(frame.alt, name, getattr(site.alt, name))
    if site.frame:
        frame.set_frame(site.frame)
    return frame


def stable_step(model, data):
    """The largest time step, s, at which the contacts of the last forward pass are stable; ``inf`` without contact.

    Counts all contacts of the plugin, the masses and inertias of all bodies, shifts and turns of the fingertips against the
    geoms. Springs and servos of the model are not counted.
    """
    return _stable_step(model._address, data._address)


def read(data, sensor):
    """The contacts of one plugin sensor at the last forward pass.

    ``data``: MjData. ``sensor``: the sensor's name. Returns one dict per geom, in the order of the attribute ``geoms``, with the
    names of ``OUTPUTS``; regime 0 is no contact, 1 stick, 2 partial slip, 3 slip. Raises KeyError for an unknown name.
    """
    numbers = data.sensor(sensor).data.reshape(-1, len(OUTPUTS))
    return [dict(zip(OUTPUTS, map(float, row))) for row in numbers]


def read_patches(data, sensor):
    """The skin of a pad at the last forward pass: an array of ``PATCH``, one record a patch.

    ``data``: MjData. ``sensor``: name of a sensor of the plugin ``fingerpad.patches``. Positions, forces of the geoms on the patch, and moments
    about its middle are along the axes of the site. ``pressure_pa`` and ``shear_pa`` (along and across the finger within the face) are over
    the patch's own area, ``area_m2``. ``stick_ratio`` is 1 where the patch sticks, 0 where it slips or touches nothing. Without the dampers.
    The array has the memory of ``data.sensordata``. Raises KeyError for an unknown name.
    """
    return data.sensor(sensor).data.view(PATCH)


def flags(status):
    """The names of the flags in a ``status``."""
    return [name for bit, name in STATUS.items() if int(status) & bit]
