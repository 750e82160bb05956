"""Many contacts of one model over numpy arrays."""

from __future__ import annotations

import warnings
from enum import IntEnum, IntFlag
from typing import Any, Literal, NamedTuple, Union, final

import numpy as np
import numpy.typing as npt

from fingerpad._errors import InputError
from fingerpad._native import Contacts, Model

#: What a contact answers with outputs="forces": forces that the plane exerts on the finger, N, and moment, N mm. The slip margin is
#: 1 less the share of its limit that the load uses; 0 without contact.
FORCES = np.dtype(
    [
        ("normal_force_n", np.float32),
        ("friction_x_n", np.float32),
        ("friction_y_n", np.float32),
        ("spin_moment_n_mm", np.float32),
        ("slip_margin", np.float32),
        ("stick_ratio", np.float32),
        ("regime", np.uint32),
        ("status", np.uint32),
    ]
)
#: What a contact answers with outputs="all": the forces, then limit, area, centre of pressure and 95 % bands.
RESPONSE = np.dtype(
    [(name, FORCES.fields[name][0]) for name in FORCES.names or ()]  # type: ignore[index]
    + [
        ("friction_limit_n", np.float32),
        ("contact_area_mm2", np.float32),
        ("pressure_centre_x_mm", np.float32),
        ("pressure_centre_y_mm", np.float32),
        ("band_normal_n", np.float32),
        ("band_friction_n", np.float32),
    ]
)
#: What a driven contact answers: the response, then the motion that led to it.
DRIVEN = np.dtype(
    [(name, RESPONSE.fields[name][0]) for name in RESPONSE.names or ()]  # type: ignore[index]
    + [
        ("depth_mm", np.float32),
        ("slide_x_mm", np.float32),
        ("slide_y_mm", np.float32),
        ("spin_rad", np.float32),
    ]
)
#: An event: step since Fingers.watch, number of the finger, and touch, first_slip, full_slip, restick or lift_off.
EVENT = np.dtype([("tick", np.uint32), ("finger", np.uint32), ("change", "U10")])

#: What a step may leave out.
OPTIONAL = ("spin_rad", "strength_factor", "pitch_deg", "roll_deg")

#: Numbers, or an array of them that broadcasts to the fingers.
Numbers = Union[float, npt.ArrayLike]


class Regime(IntEnum):
    """What a contact as a whole does."""

    NO_CONTACT = 0
    STICK = 1
    PARTIAL_SLIP = 2
    SLIP = 3


class Status(IntFlag):
    """Remarks on a step; none is 0."""

    STABILISED = 1
    BAD_INPUT = 1 << 1
    BAD_TIME_STEP = 1 << 2
    DEPTH_ABOVE_RANGE = 1 << 3
    LARGE_INCREMENT = 1 << 4
    LOAD_NOT_REACHED = 1 << 5
    SPIN_IGNORED = 1 << 6
    MEMORY_LOST = 1 << 7
    EFFECT_HELD = 1 << 8
    POSE_OUT_OF_RANGE = 1 << 9
    NOT_CONVERGED = 1 << 10


class Pose(NamedTuple):
    """Pitch (10 to 70, angle of the finger's long axis with the plane) and roll (-30 to 30), degrees; numbers, or one a
    finger."""

    pitch_deg: Numbers
    roll_deg: Numbers = 0.0


@final
class Fingers:
    """Contacts of one model, which know nothing of each other and step together.

    A contact remembers where its springs are held on the plane, and nothing else: at rest it keeps its bits. Frame: x along
    the finger from proximal to distal, z out of the plane into the finger. Steps are the same bits as those of the core on
    a microcontroller. While they are computed other threads run; threads that step the same fingers wait for each other.
    A number that is NaN or infinite is flagged in `status` and leaves its axis where it was.
    """

    def __init__(self, model: Model, count: int = 1, *, spin: bool = False) -> None:
        """Fingers in the air.

        model: kept by its numbers, the object may go. count: how many. spin: whether contacts follow a turn of the plane
        about its normal, which costs about twice a plain step; others flag it.
        """
        if count < 0:
            raise InputError(f"count: {count} fingers")
        if model.effects:
            names = ", ".join(name for name, _ in model.effects)
            warnings.warn(f"the steps of Fingers leave out the effects of this model file: {names}", stacklevel=2)
        self._model, self._count, self._spin = model, int(count), bool(spin)
        self._contacts = Contacts(model, self._count, self._spin)

    @property
    def model(self) -> Model:
        """The model."""
        return self._model

    @property
    def spin(self) -> bool:
        """Whether contacts follow a turn of the plane."""
        return self._spin

    def __len__(self) -> int:
        """Number of fingers."""
        return self._count

    def __repr__(self) -> str:
        return f"<fingerpad.Fingers: {self._count} of {self._model!r}{', with spin' if self._spin else ''}>"

    def step(
        self,
        depth_mm: Numbers,
        slide_x_mm: Numbers = 0.0,
        slide_y_mm: Numbers = 0.0,
        spin_rad: Numbers | None = None,
        *,
        dt_s: float = 1e-3,
        strength_factor: Numbers | None = None,
        pose: Pose | tuple[Numbers, Numbers] | None = None,
        outputs: Literal["forces", "all"] = "forces",
        out: npt.NDArray[np.void] | None = None,
    ) -> npt.NDArray[np.void]:
        """Advances every finger by one step; returns an array of `FORCES` or `RESPONSE`, one a finger.

        depth_mm: at the end of the step, positive into the finger, 0 or less is no contact. slide_x_mm, slide_y_mm: slide of
        the plane during the step. spin_rad: turn of the plane during the step, counter-clockwise seen from the finger.
        strength_factor: on the friction, 0.1 to 5, kept until it is set again. pose: of this step; the fitted one without.
        out: an array of an earlier step to write into. Raises InputError for arrays that do not fit, ModelError for a pose
        out of range; no finger moves then.
        """
        names = {"depth_mm": depth_mm, "slide_x_mm": slide_x_mm, "slide_y_mm": slide_y_mm, "spin_rad": spin_rad}
        first, x, y, spin, strength, pitch, roll = self._arrays(1, names, strength_factor, pose)
        record = _record(outputs)
        result = _target(out, record, (self._count,))
        words = _words(result, 1)
        self._contacts.run(first, x, y, spin, strength, pitch, roll, _times(dt_s, 1), words)
        return result

    def run(
        self,
        depth_mm: Numbers,
        slide_x_mm: Numbers = 0.0,
        slide_y_mm: Numbers = 0.0,
        spin_rad: Numbers | None = None,
        *,
        dt_s: Numbers = 1e-3,
        strength_factor: Numbers | None = None,
        pose: Pose | tuple[Numbers, Numbers] | None = None,
        outputs: Literal["forces", "all"] = "forces",
        out: npt.NDArray[np.void] | None = None,
    ) -> npt.NDArray[np.void]:
        """Advances every finger by many steps; returns an array of shape (steps, fingers).

        As `step`; arrays broadcast to (steps, fingers), so that (steps, 1) is the same for all fingers and (fingers,) the same
        in all steps. For one finger (steps,) will do. dt_s: a number, or one a step. Ctrl-C ends it within some milliseconds
        and leaves the fingers as they were before.
        """
        names = {"depth_mm": depth_mm, "slide_x_mm": slide_x_mm, "slide_y_mm": slide_y_mm, "spin_rad": spin_rad}
        steps = self._steps(names, strength_factor, pose, dt_s)
        first, x, y, spin, strength, pitch, roll = self._arrays(steps, names, strength_factor, pose)
        record = _record(outputs)
        result = _target(out, record, (steps, self._count))
        words = _words(result, steps)
        self._contacts.run(first, x, y, spin, strength, pitch, roll, _times(dt_s, steps), words)
        return result

    def step_driven(
        self,
        *,
        depth_mm: Numbers | None = None,
        normal_force_n: Numbers | None = None,
        slide_x_mm: Numbers | None = None,
        slide_y_mm: Numbers | None = None,
        friction_x_n: Numbers | None = None,
        friction_y_n: Numbers | None = None,
        spin_rad: Numbers | None = None,
        dt_s: float = 1e-3,
        strength_factor: Numbers | None = None,
        pose: Pose | tuple[Numbers, Numbers] | None = None,
        out: npt.NDArray[np.void] | None = None,
    ) -> npt.NDArray[np.void]:
        """Advances every finger by one step that leads to forces; returns an array of `DRIVEN`, one a finger.

        Give depth or normal force at the end of the step, and slides or friction (0 where one of the two is left out). A force
        out of reach leads to the nearest state that was found and the status LOAD_NOT_REACHED; a load that is there already
        does not creep. Otherwise as `step`.
        """
        if (depth_mm is None) == (normal_force_n is None):
            raise InputError("give depth_mm or normal_force_n, and not both")
        by_friction = friction_x_n is not None or friction_y_n is not None
        if by_friction and (slide_x_mm is not None or slide_y_mm is not None):
            raise InputError("give slides or friction, and not both")
        normal = {"depth_mm": depth_mm} if normal_force_n is None else {"normal_force_n": normal_force_n}
        plane = (
            {"friction_x_n": friction_x_n, "friction_y_n": friction_y_n}
            if by_friction
            else {"slide_x_mm": slide_x_mm, "slide_y_mm": slide_y_mm}
        )
        plane = {name: 0.0 if value is None else value for name, value in plane.items()}
        first, x, y, spin, strength, pitch, roll = self._arrays(1, normal | plane | {"spin_rad": spin_rad}, strength_factor, pose)
        result = _target(out, DRIVEN, (self._count,))
        words, by_force = _words(result, 1), normal_force_n is not None
        self._contacts.step_driven(
            first, x, y, spin, strength, pitch, roll, by_force, by_friction, _times(dt_s, 1), words
        )
        return result

    def gradient(
        self, direction: npt.ArrayLike = (0.0, 0.0, 0.0), *, pose: Pose | tuple[float, float] | None = None
    ) -> npt.NDArray[np.float32]:
        """How forces change with a further motion, N/mm: shape (fingers, 3, 3), rows normal force, friction x, friction y,
        columns depth, slide x, slide y.

        direction: depth, slide x and slide y along which the motion goes on, of any length, for all fingers or one a finger:
        springs on their limit slip if it loads them further; with zeros all stick. 0 without contact.
        """
        directions = _broadcast("direction", direction, (self._count, 3))
        result = np.empty((self._count, 3, 3), np.float32)
        self._contacts.gradient(directions, None if pose is None else _one_pose(pose), result.reshape(-1))
        return result

    @property
    def depth_mm(self) -> npt.NDArray[np.float32]:
        """Depth of the last step, mm, one a finger."""
        return np.array(self._contacts.state()[0], np.float32)

    @property
    def strength_factor(self) -> npt.NDArray[np.float32]:
        """Factor on the friction in use, one a finger."""
        return np.array(self._contacts.state()[1], np.float32)

    def reset(self, which: npt.ArrayLike | None = None) -> None:
        """Lifts fingers off and makes them forget: all, or those where `which` (booleans, one a finger) is true."""
        chosen = np.asarray(True if which is None else which)
        if chosen.dtype != np.bool_:
            raise InputError(f"which: {chosen.dtype} where booleans are needed")
        self._contacts.reset(np.ascontiguousarray(_fit("which", chosen, (self._count,))))

    def save(self) -> bytes:
        """The state of all fingers, each with its checksum and that of the model. Watches and their events are not in it."""
        return self._contacts.save()

    def restore(self, data: bytes) -> None:
        """Takes up a saved state of as many fingers. Raises ModelError, and changes nothing, for damage or another model's."""
        self._contacts.restore(bytes(data))

    def copy(self) -> Fingers:
        """The same fingers again, in the same state."""
        made = Fingers.__new__(Fingers)
        made._model, made._count, made._spin = self._model, self._count, self._spin
        made._contacts = self._contacts.copy()
        return made

    def watch(
        self,
        *,
        first_slip: float = 0.99,
        sure_slip: float = 0.95,
        full_slip: float = 0.03,
        partial_restick: float = 0.3,
        restick: float = 0.995,
        looks: int = 8,
        contact_looks: int = 2,
    ) -> None:
        """Sees events from the next step on, and counts ticks from there.

        Thresholds are stick ratios, with a gap between there and back: first slip below `first_slip` for `looks` steps or
        below `sure_slip` at once, full slip at `full_slip`, restick above `partial_restick` (in part) and `restick`; touch
        and lift-off after `contact_looks` steps. An event comes up to `looks` - 1 steps late. The defaults pass noise of 5 um on
        depth and slide: no event at rest, one first slip for each slide.
        """
        for name, value in {"looks": looks, "contact_looks": contact_looks}.items():
            if not 0 <= value <= 255:
                raise InputError(f"{name}: {value} is not between 0 and 255")
        self._contacts.watch(first_slip, sure_slip, full_slip, partial_restick, restick, looks, contact_looks)

    def events(self) -> npt.NDArray[np.void]:
        """What happened since `watch`, or since it was last asked: an array of `EVENT`."""
        return np.array(self._contacts.take_events(), EVENT)

    def __reduce__(self) -> tuple[Any, tuple[Model, int, bool, bytes]]:
        from fingerpad import _pickle

        return _pickle.fingers, (self._model, self._count, self._spin, self.save())

    def _steps(
        self,
        names: dict[str, Numbers | None],
        strength_factor: Numbers | None,
        pose: Pose | tuple[Numbers, Numbers] | None,
        dt_s: Numbers,
    ) -> int:
        """Number of steps: that of the arrays that have a row a step."""
        given = {**names, "strength_factor": strength_factor, **_pose_names(pose)}
        lengths = {name: _rows(np.shape(_number(name, value)), self._count) for name, value in given.items() if value is not None}
        lengths["dt_s"] = len(np.atleast_1d(_number("dt_s", dt_s)))
        steps = max(lengths.values())
        if all(np.ndim(value) < 2 for value in given.values() if value is not None) and self._count != 1:
            raise InputError(f"run needs an array with a row a step, of shape (steps, {self._count}) or (steps, 1)")
        return steps if all(lengths.values()) else 0

    def _arrays(
        self,
        steps: int,
        names: dict[str, Numbers | None],
        strength_factor: Numbers | None,
        pose: Pose | tuple[Numbers, Numbers] | None,
    ) -> Any:
        """The arrays in the order of the compiled part, each of shape (steps, fingers), or None."""
        shape = (steps, self._count)
        given = {**names, "strength_factor": strength_factor, **_pose_names(pose)}
        return [
            None if value is None and name in OPTIONAL else _broadcast(name, value, shape) for name, value in given.items()
        ]


def _pose_names(pose: Pose | tuple[Numbers, Numbers] | None) -> dict[str, Numbers | None]:
    if pose is None:
        return {"pitch_deg": None, "roll_deg": None}
    pitch_deg, roll_deg = pose
    return {"pitch_deg": pitch_deg, "roll_deg": roll_deg}


def _one_pose(pose: Pose | tuple[Numbers, Numbers]) -> tuple[float, float]:
    pitch_deg, roll_deg = pose
    if np.ndim(pitch_deg) or np.ndim(roll_deg):
        raise InputError("pose: one for all fingers is needed here")
    return float(pitch_deg), float(roll_deg)  # type: ignore[arg-type]


def _rows(shape: tuple[int, ...], count: int) -> int:
    """Rows that an array asks for."""
    if len(shape) == 1 and count == 1:
        return shape[0]
    return shape[0] if len(shape) > 1 else 1


def _number(name: str, value: Any) -> npt.NDArray[Any]:
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise InputError(f"{name}: {error}") from None
    if array.dtype.kind not in "fiub":
        raise InputError(f"{name}: {array.dtype} where real numbers are needed")
    return array


def _fit(name: str, array: npt.NDArray[Any], shape: tuple[int, ...]) -> npt.NDArray[Any]:
    if array.ndim == 1 and len(shape) == 2 and shape[1] == 1:
        array = array.reshape(-1, 1)
    try:
        return np.broadcast_to(array, shape)
    except ValueError:
        raise InputError(f"{name}: an array of shape {array.shape} where {shape} is needed") from None


def _broadcast(name: str, value: Any, shape: tuple[int, ...]) -> npt.NDArray[np.float32]:
    array = _number(name, value)
    if array.dtype != np.float32:
        # A number beyond 32 bits becomes infinite, which a step flags.
        with np.errstate(over="ignore"):
            array = array.astype(np.float32)
    return np.ascontiguousarray(array if array.shape == shape else _fit(name, array, shape))


def _times(dt_s: Numbers, steps: int) -> npt.NDArray[np.float32]:
    return _broadcast("dt_s", dt_s, (steps,))


def _record(outputs: str) -> np.dtype[np.void]:
    if outputs not in ("forces", "all"):
        raise InputError(f'outputs: {outputs!r} is neither "forces" nor "all"')
    return FORCES if outputs == "forces" else RESPONSE


def _words(result: npt.NDArray[np.void], steps: int) -> npt.NDArray[np.uint32]:
    """The memory of responses, a row a step."""
    return result.view(np.uint32).reshape(steps, result.nbytes // 4 // max(steps, 1))


def _target(out: npt.NDArray[np.void] | None, record: np.dtype[np.void], shape: tuple[int, ...]) -> npt.NDArray[np.void]:
    """The array to write into."""
    if out is None:
        return np.empty(shape, record)
    if not isinstance(out, np.ndarray) or out.dtype != record or out.shape != shape:
        raise InputError(f"out: an array of shape {shape} with the fields {record.names} is needed")
    if not (out.flags.c_contiguous and out.flags.writeable and out.flags.aligned):
        raise InputError("out: the array must be contiguous and writeable")
    return out
