"""Bed and pad through their C library, without MuJoCo: what the plugin's contacts are compared with."""

import ctypes
import pathlib

C_FOLDER = pathlib.Path(__file__).resolve().parents[2] / "c"
#: Numbers of a response in the order of the header, and those of them that the plugin writes.
FIELDS = (
    "normal_force_n friction_x_n friction_y_n tangential_friction_x_n tangential_friction_y_n stick_ratio friction_limit_n "
    "slip_margin slip_margin_relaxed spin_moment_n_mm tilt_moment_x_n_mm tilt_moment_y_n_mm "
    "pressure_centre_x_mm pressure_centre_y_mm contact_area_mm2 band_normal_n band_friction_n"
).split()
RESPONSE = [name for name in FIELDS if not name.startswith(("tangential", "tilt", "slip_margin_relaxed"))]


class Response(ctypes.Structure):
    _fields_ = [(name, ctypes.c_float) for name in FIELDS] + [("regime", ctypes.c_uint32), ("status", ctypes.c_uint32)]


class Motion(ctypes.Structure):
    _fields_ = [(name, ctypes.c_float) for name in ("depth_mm", "slide_x_mm", "slide_y_mm", "spin_rad", "dt_s")]


class Drive(ctypes.Structure):
    _fields_ = [("by_normal_force", ctypes.c_uint16), ("by_friction", ctypes.c_uint16)] + [
        (name, ctypes.c_float)
        for name in (
            "depth_mm normal_force_n slide_x_mm slide_y_mm friction_x_n friction_y_n spin_rad dt_s"
        ).split()
    ]


class PadMotion(ctypes.Structure):
    _fields_ = [
        (name, ctypes.c_float)
        for name in ("depth_mm", "slide_x_mm", "slide_y_mm", "spin_rad", "pitch_deg", "roll_deg", "dt_s")
    ]


class Body(ctypes.Structure):
    _fields_ = [("kind", ctypes.c_uint32)] + [(name, ctypes.c_float) for name in ("radius_mm", "axis_deg", "angle_deg")]


PLANE, SPHERE, CYLINDER, EDGE = 0, 1, 2, 3


class State(ctypes.Structure):
    # Room for a state of any version; the library uses the first words.
    _fields_ = [("words", ctypes.c_uint32 * 512)]


def library():
    return ctypes.CDLL(str(C_FOLDER / "target" / "release" / "libfingerpad_c.so"))


def read_file(path):
    """A model file at an address divisible by 8, and its length."""
    file = pathlib.Path(path).read_bytes()
    words = len(file) // 8 + 1
    return (ctypes.c_uint64 * words).from_buffer_copy(file.ljust(8 * words, b"\0")), len(file)


class Finger:
    """The model file of a bed and one contact with spin. Lengths mm, forces N, angles rad."""

    def __init__(self, model_file, dt_s=0.001):
        self.library = library()
        self.bytes, length = read_file(model_file)
        self.model = (ctypes.c_uint64 * 64)()
        code = self.library.fingerpad_model_load(self.model, self.bytes, ctypes.c_size_t(length))
        assert code == 0, code
        self.state, self.dt_s = State(), dt_s
        self.library.fingerpad_spin_state_init(ctypes.byref(self.state))

    def set_strength_factor(self, factor):
        self.library.fingerpad_spin_state_set_strength_factor(ctypes.byref(self.state), ctypes.c_float(factor))

    def save(self):
        return State.from_buffer_copy(self.state)

    def restore(self, state):
        self.state = State.from_buffer_copy(state)

    def step(self, depth_mm, slide_x_mm=0.0, slide_y_mm=0.0, spin_rad=0.0):
        """One step; returns the response."""
        r = Response()
        motion = Motion(depth_mm, slide_x_mm, slide_y_mm, spin_rad, self.dt_s)
        code = self.library.fingerpad_spin_step(self.model, ctypes.byref(self.state), motion, ctypes.byref(r))
        assert code == 0, code
        return r

    def step_with_friction(self, depth_mm, friction_x_n, friction_y_n, spin_rad=0.0):
        """One step at ``depth_mm`` with a turn of ``spin_rad`` that slides until friction has these components; returns the response."""
        r = Response()
        drive = Drive(0, 1, depth_mm, 0.0, 0.0, 0.0, friction_x_n, friction_y_n, spin_rad, self.dt_s)
        code = self.library.fingerpad_spin_step_driven(self.model, ctypes.byref(self.state), drive, ctypes.byref(r), None)
        assert code == 0, code
        return r

    def moment_after(self, depth_mm, friction_x_n, turn_rad):
        """The moment, N mm, and slip margin of a contact that carries the friction ``friction_x_n`` along x when it was turned by
        ``turn_rad``."""
        self.step(depth_mm)
        for i in range(1, 101):
            self.step_with_friction(depth_mm, 0.01 * i * friction_x_n, 0.0)
        for _ in range(500):
            r = self.step_with_friction(depth_mm, friction_x_n, 0.0, turn_rad / 500)
        return abs(r.spin_moment_n_mm), r.slip_margin


class PadFinger:
    """The model file of a pad and one contact with a body. Lengths mm, forces N, poses in degrees."""

    def __init__(self, model_file, body=(PLANE, 0.0, 0.0, 0.0), pose_deg=None, dt_s=0.001):
        """``pose_deg``: pitch and roll in which the apex of a curved body lies under first touch."""
        self.library, self.body, self.dt_s = library(), Body(*body), dt_s
        self.bytes, length = read_file(model_file)
        self.pad, self.state = (ctypes.c_uint64 * 64)(), State()
        code = self.library.fingerpad_pad_load(self.pad, self.bytes, ctypes.c_size_t(length))
        assert code == 0, code
        if pose_deg is None:
            code = self.library.fingerpad_pad_state_init(self.pad, ctypes.byref(self.state))
        else:
            pose = [ctypes.c_float(angle) for angle in pose_deg]
            code = self.library.fingerpad_pad_state_init_over(self.pad, ctypes.byref(self.state), *pose)
        assert code == 0, code

    def first_touch(self, pitch_deg, roll_deg):
        """The point of the finger that a plane touches first in a pose, mm along the finger's axes."""
        place = (ctypes.c_float * 3)()
        code = self.library.fingerpad_pad_first_touch(self.pad, ctypes.c_float(pitch_deg), ctypes.c_float(roll_deg), place)
        assert code == 0, code
        return list(place)

    def step(self, depth_mm, slide_x_mm=0.0, slide_y_mm=0.0, spin_rad=0.0, pitch_deg=30.0, roll_deg=0.0):
        """One step; returns the response."""
        r = Response()
        motion = PadMotion(depth_mm, slide_x_mm, slide_y_mm, spin_rad, pitch_deg, roll_deg, self.dt_s)
        code = self.library.fingerpad_pad_step(self.pad, ctypes.byref(self.state), self.body, motion, ctypes.byref(r))
        assert code == 0, code
        return r

    def moment_after(self, depth_mm, friction_x_n, turn_rad, steps=1000):
        """The moment, N mm, and slip margin of a contact that carries the friction ``friction_x_n`` along x when it was turned by
        ``turn_rad``. The slide of each step removes the error of friction at 1 N/mm, about the stiffness of a pad."""
        r = self.step(depth_mm)
        for i in range(1, 2 * steps + 1):
            load = friction_x_n * min(1.0, i / steps)
            slide = [load - r.friction_x_n, -r.friction_y_n]
            r = self.step(depth_mm, *slide, turn_rad / steps if i > steps else 0.0)
        return abs(r.spin_moment_n_mm), r.slip_margin
