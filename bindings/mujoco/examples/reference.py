"""The reduced model through its C library, without MuJoCo: what the plugin's contacts are compared with."""

import ctypes
import pathlib

C_FOLDER = pathlib.Path(__file__).resolve().parents[2] / "c"
#: Numbers of a response in the order of the header.
RESPONSE = (
    "normal_force_n friction_x_n friction_y_n stick_ratio friction_limit_n slip_margin spin_moment_n_mm "
    "pressure_centre_x_mm pressure_centre_y_mm contact_area_mm2 band_normal_n band_friction_n"
).split()


class Response(ctypes.Structure):
    _fields_ = [(name, ctypes.c_float) for name in RESPONSE] + [("regime", ctypes.c_uint16), ("status", ctypes.c_uint16)]


class Motion(ctypes.Structure):
    _fields_ = [(name, ctypes.c_float) for name in ("depth_mm", "slide_x_mm", "slide_y_mm", "spin_rad", "dt_s")]


class Drive(ctypes.Structure):
    _fields_ = [("by_normal_force", ctypes.c_uint16), ("by_friction", ctypes.c_uint16)] + [
        (name, ctypes.c_float)
        for name in (
            "depth_mm normal_force_n slide_x_mm slide_y_mm friction_x_n friction_y_n spin_rad dt_s"
        ).split()
    ]


class State(ctypes.Structure):
    # Room for a state of any version; the library uses the first words.
    _fields_ = [("words", ctypes.c_uint32 * 128)]


class Finger:
    """A model file and one contact with spin. Lengths mm, forces N, angles rad."""

    def __init__(self, model_file, dt_s=0.001):
        self.library = ctypes.CDLL(str(C_FOLDER / "target" / "release" / "libfingerpad_c.so"))
        # Aligned to 8 bytes, as the library asks; kept as long as the model.
        file = pathlib.Path(model_file).read_bytes()
        self.bytes = (ctypes.c_uint64 * (len(file) // 8 + 1)).from_buffer_copy(file.ljust(8 * (len(file) // 8 + 1), b"\0"))
        self.model = (ctypes.c_uint64 * 64)()
        code = self.library.fingerpad_model_load(self.model, self.bytes, ctypes.c_size_t(len(file)))
        assert code == 0, code
        self.state, self.dt_s = State(), dt_s
        self.library.fingerpad_spin_state_init(ctypes.byref(self.state))

    def set_strength_factor(self, factor):
        self.library.fingerpad_spin_state_set_strength_factor(ctypes.byref(self.state), ctypes.c_float(factor))

    def pose(self, pitch_deg, roll_deg):
        code = self.library.fingerpad_model_pose(self.model, ctypes.c_float(pitch_deg), ctypes.c_float(roll_deg))
        assert code == 0, code

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
        """One step at ``depth_mm`` with a turn of ``spin_rad`` that slides as far as the friction asks; returns the response."""
        r = Response()
        drive = Drive(0, 1, depth_mm, 0.0, 0.0, 0.0, friction_x_n, friction_y_n, spin_rad, self.dt_s)
        code = self.library.fingerpad_spin_step_driven(self.model, ctypes.byref(self.state), drive, ctypes.byref(r), None)
        assert code == 0, code
        return r

    def moment_after(self, depth_mm, friction_x_n, turn_rad):
        """The moment, N mm, of a contact that carries the friction ``friction_x_n`` along x when it was turned by ``turn_rad``."""
        self.step(depth_mm)
        for i in range(1, 101):
            self.step_with_friction(depth_mm, 0.01 * i * friction_x_n, 0.0)
        for _ in range(500):
            r = self.step_with_friction(depth_mm, friction_x_n, 0.0, turn_rad / 500)
        return abs(r.spin_moment_n_mm)
