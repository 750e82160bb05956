"""Fingertip contact for MuJoCo: loads the engine plugin ``fingerpad.contact`` and names the numbers of its sensor.

``load()`` before any model that uses the plugin; then::

    model = mujoco.MjModel.from_xml_path("hand.xml")
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    print(read(data, "thumb")[0]["slip_margin"])
"""

import pathlib

import mujoco

HERE = pathlib.Path(__file__).resolve().parent
#: Where ``cmake --build`` leaves the plugin.
LIBRARY = HERE / "build" / "libfingerpad_mujoco.so"
#: Name under which MuJoCo knows the plugin.
PLUGIN = "fingerpad.contact"
#: Numbers that the sensor tells of each contact, in this order. Forces are those that the plane exerts on the finger along x
#: (the finger's axis within the face), y and the face's normal, without the dampers' part; those are the last four.
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
)
#: Flags of ``status``.
STATUS = {
    2: "bad_input",
    4: "bad_time_step",
    8: "depth_above_range",
    16: "large_increment",
    128: "memory_lost",
    512: "pose_out_of_range",
    1024: "not_converged",
}


def load(library=LIBRARY):
    """Registers the plugin with MuJoCo; once in a program is enough, twice does no harm.

    ``library``: the built plugin. Raises FileNotFoundError with the lines that build it.
    """
    path = pathlib.Path(library)
    if not path.is_file():
        folder = pathlib.Path(mujoco.__file__).parent
        raise FileNotFoundError(
            f"no {path}; build it:\n"
            f"  (cd {HERE.parent / 'c'} && cargo build --release)\n"
            f"  cmake -S {HERE} -B {HERE / 'build'} -DMUJOCO_FOLDER={folder}\n"
            f"  cmake --build {HERE / 'build'}"
        )
    mujoco.mj_loadPluginLibrary(str(path))


def read(data, sensor):
    """What the contacts of one plugin sensor did at the last forward pass.

    ``data``: MjData. ``sensor``: the sensor's name. Returns one dict a geom, in the order of the attribute ``geoms``, with the
    names of ``OUTPUTS``; regime 0 no contact, 1 stick, 2 partial slip, 3 slip. Raises KeyError for an unknown name.
    """
    numbers = data.sensor(sensor).data.reshape(-1, len(OUTPUTS))
    return [dict(zip(OUTPUTS, map(float, row))) for row in numbers]


def flags(status):
    """The names of the flags in a ``status``."""
    return [name for bit, name in STATUS.items() if int(status) & bit]
