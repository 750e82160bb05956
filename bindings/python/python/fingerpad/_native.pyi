"""The compiled part of the package."""

from os import PathLike
from typing import Any, Literal, Sequence, final, overload

import numpy as np
import numpy.typing as npt

from fingerpad._bodies import Body
from fingerpad._fingers import Fingers, Regime, Status

__all__ = [
    "HAS_PROGRAM",
    "Contacts",
    "Finger",
    "Margin",
    "MarginObserver",
    "Model",
    "Pad",
    "Response",
    "__version__",
    "load",
    "run_program",
    "status_words",
]

#: Version of the package.
__version__: str
#: Whether the wheel contains the program.
HAS_PROGRAM: bool

_Floats = npt.NDArray[np.float32]
_Words = npt.NDArray[np.uint32]

@final
class Model:
    """A fitted bed of springs, of one pose on a plane: the numbers of a model file (.fpm), copied and checked.

    A file is checked once: magic, version, length, checksum, and that no motion yields work with its numbers.
    """

    @staticmethod
    def from_bytes(data: bytes) -> Model:
        """A model from a file's bytes. Raises ModelError with the cause."""

    @staticmethod
    def from_file(path: str | PathLike[str]) -> Model:
        """A model from a file. Raises InputError for a file that cannot be read, ModelError for one that is refused."""

    @staticmethod
    def shipped(name: str = "human") -> Model:
        """The fitted fingertip that ships with the package: "human", or "human-stiffening", whose tissue stiffens."""

    def to_bytes(self) -> bytes:
        """The bytes of the file that the model came from; a tuning is not in them."""

    @property
    def springs(self) -> int:
        """Number of springs."""

    @property
    def depth_max_mm(self) -> float:
        """Largest depth for which the model was fitted, mm; with the tuning's size."""

    @property
    def normal_force_max_n(self) -> float:
        """Normal force at the largest depth without a slide, N; with the tuning."""

    @property
    def pose_deg(self) -> tuple[float, float]:
        """The pose that the model is of: pitch, the angle of the finger's long axis with the plane, and roll, degrees."""

    @property
    def meta(self) -> dict[str, Any]:
        """Where the model comes from: name, ranges, hash of the settings, versions, errors of the fit."""

    @property
    def effects(self) -> list[tuple[str, list[float]]]:
        """Names and values of the effects in the file; a step of Fingers leaves them out."""

    @property
    def own_columns(self) -> list[tuple[str, str, tuple[float, float], float]]:
        """Columns of the user's own (a voltage) that tables of the file read: name, unit, range, value in the calibration.

        A step of Fingers leaves the tables out, as all effects; the command `eval` takes the columns from its path or its runs.
        """

    @property
    def tuning(self) -> tuple[float, float, float]:
        """The factors on size, stiffness and lambda that the model was retuned with."""

    def tuned(self, *, size: float = 1.0, stiffness: float = 1.0, lambda_factor: float = 1.0) -> Model:
        """The model of another finger, counted from the fitted one.

        size: factor on all lengths, 0.5 to 2. stiffness: factor on that of the tissue, 0.2 to 5. lambda_factor: on that of
        the friction law, 0.1 to 10. Raises ModelError beyond.
        """

    @property
    def relaxation(self) -> list[tuple[float, float]]:
        """Branches of tissue that relaxes: share of the relaxed stiffness, and time, s. Empty for tissue that does not."""

    def relaxing(self, branches: Literal["human-assumed"] | list[tuple[float, float]]) -> Model:
        """The same bed with tissue that relaxes, as `Pad.relaxing`; its `to_bytes` is a file of that.

        Raises ModelError for shares with which a fast press would exceed the range of the bed's springs, and for a file with the effect
        `normal_relaxation`.
        """

    @overload
    def least_grip(
        self,
        friction_x_n: float,
        friction_y_n: float | None = None,
        *,
        margin: float | None = None,
        strength_factor: float | None = None,
    ) -> tuple[float, float, int]:
        """The least depth (mm) and normal force (N) that hold a friction force with a slip margin, and the status.

        friction_x_n, friction_y_n: the load, N; 0 along y by default. margin: share of the limit kept in reserve, 0 to 0.95, 0 by
        default. strength_factor: on the friction, 0.1 to 5, 1 by default. Arrays broadcast, and give arrays. The status has
        LOAD_NOT_REACHED if even the largest depth does not hold the load, and BAD_INPUT for a load that is NaN or infinite. The
        half-width of friction's 95 % band is on the safe side already. Raises InputError beyond the ranges.
        """

    @overload
    def least_grip(
        self,
        friction_x_n: npt.ArrayLike,
        friction_y_n: npt.ArrayLike | None = None,
        *,
        margin: npt.ArrayLike | None = None,
        strength_factor: npt.ArrayLike | None = None,
    ) -> tuple[_Floats, _Floats, _Words]: ...
    def _least_grips(
        self, given: tuple[_Floats, _Floats, _Floats, _Floats], depth_mm: _Floats, normal_force_n: _Floats, status: _Words
    ) -> None: ...

    def __eq__(self, other: object, /) -> bool:
        """Whether file and tuning are the same."""

    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes, Sequence[float] | None]]: ...

@final
class Pad:
    """A fitted pad, of every pose and of rigid bodies: the numbers of its model file (.fpm), copied and checked.

    Slower than a bed and less accurate in the bed's own pose; see `docs/pad.md` of the repository.
    """

    @staticmethod
    def from_bytes(data: bytes) -> Pad:
        """A pad from a file's bytes. Raises ModelError with the cause."""

    @staticmethod
    def from_file(path: str | PathLike[str]) -> Pad:
        """A pad from a file. Raises InputError for a file that cannot be read, ModelError for one that is refused."""

    @staticmethod
    def shipped(name: str = "human") -> Pad:
        """The fitted pad that ships with the package: "human", or "human-stiffening", whose tissue stiffens; that one is usable in its
        neutral pose alone."""

    def to_bytes(self) -> bytes:
        """The bytes of the file that the pad came from; a tuning is not in them."""

    @property
    def patches(self) -> int:
        """Number of patches."""

    @property
    def patch_areas_mm2(self) -> list[float]:
        """Area of each patch of the skin, mm^2; with the tuning's size."""

    @property
    def depth_max_mm(self) -> float:
        """Largest depth for which the pad was fitted, mm; with the tuning's size. Steps go on to twice that, flagged."""

    @property
    def normal_force_max_n(self) -> float:
        """Normal force at the largest depth on a plane in the neutral pitch without a slide, N; with the tuning. Takes 100 steps."""

    @property
    def pitch_range_deg(self) -> tuple[float, float]:
        """Least and largest pitch, degrees: the angle of the finger's long axis with the plane."""

    @property
    def roll_range_deg(self) -> tuple[float, float]:
        """Least and largest roll, degrees."""

    @property
    def neutral_pitch_deg(self) -> float:
        """The pitch in which fingers are without another one, degrees."""

    @property
    def meta(self) -> dict[str, Any]:
        """Where the pad comes from: name, ranges, hash of the settings, versions, errors of the fit."""

    @property
    def tuning(self) -> tuple[float, float, float]:
        """The factors on size, stiffness and lambda that the pad was retuned with."""

    def tuned(self, *, size: float = 1.0, stiffness: float = 1.0, lambda_factor: float = 1.0) -> Pad:
        """The pad of another finger, counted from the fitted one.

        size: factor on all lengths, 0.5 to 2. stiffness: factor on that of the tissue, 0.2 to 5. lambda_factor: on that of
        the friction law, 0.1 to 10. Raises ModelError beyond.
        """

    @property
    def relaxation(self) -> list[tuple[float, float]]:
        """Branches of tissue that relaxes: share of the relaxed stiffness, and time, s. Empty for tissue that does not."""

    def relaxing(self, branches: Literal["human-assumed"] | list[tuple[float, float]]) -> Pad:
        """The same pad with tissue that relaxes; its `to_bytes` is a file of that.

        branches: up to three of share and time (s): held, the force falls as 1 plus the sum of share times exp(-t / time). None of them: tissue
        that does not relax. "human-assumed" has published times (4 ms, 70 ms, 1.4 s; Pawluk and Howe 1999) and assumed shares (1, 0.6, 0.6):
        measure them. Raises InputError for a share that is not between 0 and 100 and a time that is not between 1e-5 and 1e5 s.
        """

    @overload
    def least_grip(
        self,
        friction_x_n: float,
        friction_y_n: float | None = None,
        *,
        margin: float | None = None,
        strength_factor: float | None = None,
        pitch_deg: float | None = None,
        roll_deg: float | None = None,
        body: Body | None = None,
    ) -> tuple[float, float, int]:
        """The least depth (mm) at which a finger that slides comes to hold a friction force with a slip margin, the normal force under
        the load (N), and the status.

        friction_x_n, friction_y_n, margin, strength_factor: as of `Model.least_grip`. pitch_deg, roll_deg, body: as of `Fingers`. Numbers
        broadcast, and arrays give arrays. By bisection over the depth, each with a press from the air and a slide to the load. The half-width
        of friction's 95 % band is on the safe side already. The status has LOAD_NOT_REACHED, and the depth is the largest one, if that does not
        hold the load; BAD_INPUT for a load that is NaN or infinite. Tissue that relaxes has relaxed: the grip holds the load for good. Raises
        InputError beyond the ranges.
        """

    @overload
    def least_grip(
        self,
        friction_x_n: npt.ArrayLike,
        friction_y_n: npt.ArrayLike | None = None,
        *,
        margin: npt.ArrayLike | None = None,
        strength_factor: npt.ArrayLike | None = None,
        pitch_deg: npt.ArrayLike | None = None,
        roll_deg: npt.ArrayLike | None = None,
        body: Body | None = None,
    ) -> tuple[_Floats, _Floats, _Words]: ...
    def _least_grips(
        self, kind: str, numbers: Any, given: tuple[_Floats, ...], depth_mm: _Floats, normal_force_n: _Floats, status: _Words
    ) -> None: ...
    def __eq__(self, other: object, /) -> bool:
        """Whether file and tuning are the same."""

    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes, Sequence[float] | None]]: ...

def load(source: bytes | str | PathLike[str]) -> Model | Pad:
    """The bed or the pad that a model file holds, from its bytes or its path.

    Raises InputError for a file that cannot be read, ModelError for one that is refused.
    """

@final
class Response:
    """Result of a step of a `Finger`: the fields of `RESPONSE` as plain numbers. Forces are those on the finger."""

    @property
    def normal_force_n(self) -> float:
        """Normal force, N."""

    @property
    def friction_x_n(self) -> float:
        """Friction along x, N."""

    @property
    def friction_y_n(self) -> float:
        """Friction along y, N."""

    @property
    def spin_moment_n_mm(self) -> float:
        """Moment of friction about the normal, N mm."""

    @property
    def slip_margin(self) -> float:
        """1 less the share of its limit that the load uses; 0 without contact."""

    @property
    def stick_ratio(self) -> float:
        """Share of the contact that sticks, 0 to 1."""

    @property
    def regime(self) -> Regime:
        """Stick and slip of the contact as a whole."""

    @property
    def status(self) -> Status:
        """Remarks on the step; none is 0."""

    @property
    def friction_limit_n(self) -> float:
        """Friction in full slip along the present direction, N."""

    @property
    def contact_area_mm2(self) -> float:
        """Area in contact, mm^2."""

    @property
    def pressure_centre_x_mm(self) -> float:
        """Centre of pressure along x, mm."""

    @property
    def pressure_centre_y_mm(self) -> float:
        """Centre of pressure along y, mm."""

    @property
    def band_normal_n(self) -> float:
        """Half-width of the 95 % band of the normal force, N."""

    @property
    def band_friction_n(self) -> float:
        """Half-width of the 95 % band of the friction, N."""

    @property
    def tangential_friction_x_n(self) -> float:
        """Friction alone along x, N: the sum of the tangential tractions."""

    @property
    def tangential_friction_y_n(self) -> float:
        """Friction alone along y, N."""

    @property
    def tilt_moment_x_n_mm(self) -> float:
        """Moment of all forces about x, N mm."""

    @property
    def tilt_moment_y_n_mm(self) -> float:
        """Moment of all forces about y, N mm."""

    @property
    def slip_margin_relaxed(self) -> float:
        """The slip margin that is left when the tissue has relaxed at the present depth; 0: the load slips before. Where nothing relaxes
        the slip margin."""

    def to_record(self) -> npt.NDArray[np.void]:
        """The same as an array of one record of `RESPONSE`."""

    def __eq__(self, other: object, /) -> bool:
        """Whether all bits are the same."""

    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, tuple[Sequence[int]]]: ...
    @staticmethod
    def _of(words: Sequence[int]) -> Response: ...

@final
class Finger:
    """One contact whose step takes and returns plain numbers, for a control loop.

    The same contact as one of `Fingers`, with the same bits, without the cost of arrays.
    """

    def __new__(
        cls,
        model: Model | Pad,
        *,
        spin: bool = False,
        body: Body | None = None,
        pitch_deg: float | None = None,
        roll_deg: float | None = None,
    ) -> Finger:
        """A finger in the air; arguments as of `Fingers`."""

    @property
    def model(self) -> Model | Pad:
        """The bed or the pad."""

    @property
    def body(self) -> Body:
        """The body that the finger touches; a plane for one of a bed."""

    @property
    def spin(self) -> bool:
        """Whether the contact follows a turn of the body."""

    def step(
        self,
        depth_mm: float,
        slide_x_mm: float = 0.0,
        slide_y_mm: float = 0.0,
        spin_rad: float = 0.0,
        *,
        dt_s: float = 1e-3,
        strength_factor: float | None = None,
        pitch_deg: float | None = None,
        roll_deg: float | None = None,
    ) -> Response:
        """Advances the finger by one step; arguments as of `Fingers.step`.

        Raises TypeError for an argument that is not a number, and InputError for a pose of a bed; the finger does not move then.
        """

    @property
    def depth_mm(self) -> float:
        """Depth of the last step, mm."""

    @property
    def strength_factor(self) -> float:
        """Factor on the friction in use."""

    def reset(self) -> None:
        """Lifts the finger off and clears its memory."""

    def save(self) -> bytes:
        """The state, as that of `Fingers` of one."""

    def restore(self, data: bytes) -> None:
        """Takes up a saved state of one finger. Raises ModelError, and changes nothing, for damage or another model's."""

    def copy(self) -> Finger:
        """The same finger again, in the same state."""

    def fingers(self) -> Fingers:
        """`Fingers` of one in this state, for maps, limit surface and gradient; it moves on its own."""

    def __reduce__(self) -> tuple[Any, tuple[Fingers, bytes]]: ...
    @staticmethod
    def _of(fingers: Fingers) -> Finger: ...

@final
class MarginObserver:
    """Slip margin on a surface of unknown friction, from measured force and motion of one contact of a bed or a pad."""

    def __new__(
        cls,
        model: Model | Pad,
        *,
        body: Body | None = None,
        pitch_deg: float | None = None,
        roll_deg: float | None = None,
        model_error: float | None = None,
        strength: float | None = None,
        stiffness: float | None = None,
        force_lag_s: float = 0.0,
        play_mm: float = 0.0,
        drift: float = 0.0,
        tare_n: float | None = None,
        tare_drift_n: float = 0.0,
        confidence: float | None = None,
        ahead_s: float | None = None,
    ) -> MarginObserver:
        """An observer in the air. Raises InputError for a setting out of its range, and for tissue that relaxes.

        Of a pad only: body (a plane by default), and the pose of the finger, which stays. pitch_deg is the neutral one and roll_deg 0 by default.

        model_error is the standard deviation of the model's friction, share of the limit: 0.018 for a bed, 0.035 for a pad by default.
        strength and stiffness are standard deviations of the prior: of the logarithm of the strength factor (0.7), and of the finger's
        tangential stiffness, share (0.15). confidence is the probability of the bands (0.95), ahead_s the time of slip_chance (0.05).
        """

    def step(
        self,
        normal_force_n: float,
        friction_x_n: float,
        friction_y_n: float,
        slide_x_mm: float,
        slide_y_mm: float,
        *,
        dt_s: float = 1e-3,
        normal_variance_n2: float = 25e-6,
        friction_covariance_n2: tuple[float, float, float] = ...,
        slide_covariance_mm2: tuple[float, float, float] = ...,
        stick_ratio: float = 0.0,
        stick_variance: float = 0.0,
        spin_rad: float = 0.0,
        spin_moment_n_mm: float = 0.0,
        spin_variance_n2_mm2: float = 0.0,
    ) -> Margin:
        """Takes forces, slide since the last reading and the covariance of their noise (xx, yy, xy; of the position for the slide).

        Without them the noise of a force and of a position is 5 mN and 5 um. stick_ratio is the share of the contact area that sticks, from the
        shear field of a tactile skin, and counts where stick_variance is not 0. spin_rad is the turn about the normal since the last reading, and
        spin_moment_n_mm the moment, which counts where spin_variance_n2_mm2 is not 0. A pad uses both, a bed neither.

        A reading that is unsound is left out and flagged, and the bounds widen.
        """

@final
class Margin:
    """What is known of a surface after a reading."""

    @property
    def strength_factor(self) -> float:
        """Strength factor of the surface."""

    @property
    def strength_low(self) -> float:
        """Lower end of its band."""

    @property
    def strength_high(self) -> float:
        """Upper end of its band."""

    @property
    def slip_margin(self) -> float:
        """Slip margin of the present friction; 0 without contact."""

    @property
    def margin_low(self) -> float:
        """Lower end of its band: 0 announces slip."""

    @property
    def margin_high(self) -> float:
        """Upper end of its band."""

    @property
    def slip_chance(self) -> float:
        """Chance of full slip within the time ahead at the present rates of the forces."""

    @property
    def stiffness_factor(self) -> float:
        """Tangential stiffness of the finger over that of the model."""

    @property
    def information(self) -> float:
        """0 where nothing but the prior is known, 1 where all is."""

    @property
    def known(self) -> str:
        """no_contact, prior, part or strength."""

    @property
    def surface_changed(self) -> bool:
        """Whether the strength starts again from its prior with this reading."""

    @property
    def status(self) -> int:
        """Flags as in `Status`."""

@final
class Contacts:
    @staticmethod
    def of_bed(model: Model, count: int, spin: bool) -> Contacts: ...
    @staticmethod
    def of_pad(
        pad: Pad, kind: str, numbers: tuple[float, float, float], description: str, poses_deg: _Floats
    ) -> Contacts: ...
    @staticmethod
    def in_frames(model: Model | Pad, kind: str, sizes: Sequence[float], count: int) -> Contacts: ...
    def step_frames(
        self, poses: npt.NDArray[np.float64], strength_factor: _Floats | None, dt_s: _Floats, out: _Words
    ) -> None: ...
    def take_up(self, other: Contacts) -> None: ...
    def run(
        self,
        depth_mm: _Floats,
        slide_x_mm: _Floats,
        slide_y_mm: _Floats,
        spin_rad: _Floats | None,
        strength_factor: _Floats | None,
        pitch_deg: _Floats | None,
        roll_deg: _Floats | None,
        dt_s: _Floats,
        out: _Words,
    ) -> None: ...
    def step_driven(
        self,
        normal: _Floats,
        along_x: _Floats,
        along_y: _Floats,
        spin_rad: _Floats | None,
        strength_factor: _Floats | None,
        by_normal_force: bool,
        by_friction: bool,
        pitch_deg: _Floats | None,
        roll_deg: _Floats | None,
        dt_s: _Floats,
        out: _Words,
    ) -> None: ...
    def gradient(self, direction: _Floats, out: _Floats) -> None: ...
    def limit_surface(self, motion: _Floats, out: _Floats) -> None: ...
    def patches(self, out: _Floats) -> None: ...
    def state(self) -> tuple[list[float], list[float]]: ...
    def reset(self, which: npt.NDArray[np.bool_]) -> None: ...
    def save(self) -> bytes: ...
    def restore(self, data: bytes) -> None: ...
    def watch(
        self,
        first_slip: float,
        sure_slip: float,
        full_slip: float,
        partial_restick: float,
        restick: float,
        looks: int,
        contact_looks: int,
    ) -> None: ...
    def take_events(self) -> list[tuple[int, int, str]]: ...
    def copy(self) -> Contacts: ...

def run_program(words: Sequence[str], line_every_s: float | None = None) -> int: ...
def status_words(bits: int) -> str:
    """The names of the flags in a status, joined by `+`; `ok` for none."""
