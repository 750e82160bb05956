"""Many contacts of one model or pad over numpy arrays."""

from __future__ import annotations

import operator
import warnings
from enum import IntEnum, IntFlag
from typing import Any, Literal, SupportsIndex, final

import numpy as np
import numpy.typing as npt

from fingerpad import _bodies
from fingerpad._arrays import Numbers, broadcast, check_range, fit, number
from fingerpad._bodies import Body, Plane
from fingerpad._errors import InputError
from fingerpad._native import Contacts, Model, Pad

#: Response of a contact with outputs="forces": forces that the plane exerts on the finger, N, and moment, N mm. The slip margin is
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
#: Response of a contact with outputs="all": the forces, then limit, area, centre of pressure, 95 % bands,
#: friction alone, the moments about x and y, and the slip margin that is left when the tissue has relaxed at the present depth (0: the
#: load slips before; the slip margin itself where nothing relaxes).
RESPONSE = np.dtype(
    [(name, FORCES.fields[name][0]) for name in FORCES.names or ()]  # type: ignore[index]
    + [
        ("friction_limit_n", np.float32),
        ("contact_area_mm2", np.float32),
        ("pressure_centre_x_mm", np.float32),
        ("pressure_centre_y_mm", np.float32),
        ("band_normal_n", np.float32),
        ("band_friction_n", np.float32),
        ("tangential_friction_x_n", np.float32),
        ("tangential_friction_y_n", np.float32),
        ("tilt_moment_x_n_mm", np.float32),
        ("tilt_moment_y_n_mm", np.float32),
        ("slip_margin_relaxed", np.float32),
    ]
)
#: Response of a driven contact: the plain response, then the motion that led to it.
DRIVEN = np.dtype(
    [(name, RESPONSE.fields[name][0]) for name in RESPONSE.names or ()]  # type: ignore[index]
    + [
        ("depth_mm", np.float32),
        ("slide_x_mm", np.float32),
        ("slide_y_mm", np.float32),
        ("spin_rad", np.float32),
    ]
)
#: State of a patch of a pad: place of its middle along the axes of the plane, from the point about which poses turn; pressure and
#: traction on the finger over the patch's own area; area in contact, the share of it that sticks, and the share of its strength in use.
PATCH = np.dtype(
    [
        ("place_x_mm", np.float32),
        ("place_y_mm", np.float32),
        ("place_z_mm", np.float32),
        ("pressure_mpa", np.float32),
        ("traction_x_mpa", np.float32),
        ("traction_y_mpa", np.float32),
        ("contact_area_mm2", np.float32),
        ("stick_ratio", np.float32),
        ("used_share", np.float32),
    ]
)
#: A patch in a map of pressure: place as in `PATCH`, area of the patch, area of it in contact, mean pressure over the patch's area.
PRESSURE_MAP = np.dtype(
    [
        ("place_x_mm", np.float32),
        ("place_y_mm", np.float32),
        ("place_z_mm", np.float32),
        ("area_mm2", np.float32),
        ("contact_area_mm2", np.float32),
        ("pressure_mpa", np.float32),
    ]
)
#: A patch in a map of slip: place as in `PATCH`, area in contact, the share of it that sticks, the share of the patch's strength in
#: use, and mean traction over the patch's area.
SLIP_MAP = np.dtype(
    [
        ("place_x_mm", np.float32),
        ("place_y_mm", np.float32),
        ("place_z_mm", np.float32),
        ("contact_area_mm2", np.float32),
        ("stick_ratio", np.float32),
        ("used_share", np.float32),
        ("traction_x_mpa", np.float32),
        ("traction_y_mpa", np.float32),
    ]
)
#: A point of a limit surface: the motion of the body (slides, turn; of any length), and friction and moment under it in full slip.
LIMIT = np.dtype(
    [
        ("slide_x_mm", np.float32),
        ("slide_y_mm", np.float32),
        ("spin_rad", np.float32),
        ("friction_x_n", np.float32),
        ("friction_y_n", np.float32),
        ("spin_moment_n_mm", np.float32),
    ]
)
#: An event: step since Fingers.watch, number of the finger, and touch, first_slip, full_slip, restick or lift_off.
EVENT = np.dtype([("tick", np.uint32), ("finger", np.uint32), ("change", "U10")])

#: Arguments that a step may leave out.
OPTIONAL = ("spin_rad", "strength_factor", "pitch_deg", "roll_deg")

#: Most fingers of a bed and of a pad: 2 GB of memory.
MOST_FINGERS = {Model: 1 << 24, Pad: 1 << 20}

#: Distance from the centre of a turn at which its length counts, mm.
ARM_MM = 3.0
#: Directions of slide, and angles of the motion with the plane of slides (deg), over which a limit surface is taken.
AZIMUTHS, RISES_DEG = 24, range(-75, 90, 15)


class Regime(IntEnum):
    """Stick and slip of a contact as a whole."""

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
    BODY_TOO_SHARP = 1 << 11
    BEGAN_INSIDE = 1 << 12
    BEYOND_EDGE = 1 << 13


class Batch:
    """What all contacts that step together have."""

    _model: Model | Pad
    _count: int
    _contacts: Contacts

    def _take(self, model: Model | Pad, count: SupportsIndex) -> None:
        """Takes a model and a count once both are checked."""
        kind = Pad if isinstance(model, Pad) else Model
        if not isinstance(model, kind):
            raise InputError(f"model: {type(model).__name__} where a Model or a Pad is needed")
        try:
            # A boolean is an index, but no count.
            self._count = operator.index(count if not isinstance(count, bool) else None)  # type: ignore[arg-type]
        except TypeError:
            raise InputError(f"count: {count!r} where a whole number is needed") from None
        if not 0 <= self._count <= MOST_FINGERS[kind]:
            raise InputError(f"count: {self._count} is not between 0 and {MOST_FINGERS[kind]}")
        if isinstance(model, Model) and model.effects:
            names = ", ".join(name for name, _ in model.effects)
            warnings.warn(f"the steps of {type(self).__name__} leave out the effects of this model file: {names}", stacklevel=3)
        self._model = model

    @property
    def model(self) -> Model | Pad:
        """The bed or the pad."""
        return self._model

    def __len__(self) -> int:
        """Number of fingers."""
        return self._count

    @property
    def depth_mm(self) -> npt.NDArray[np.float32]:
        """Depth of the last step, mm, one a finger."""
        return np.array(self._contacts.state()[0], np.float32)

    @property
    def strength_factor(self) -> npt.NDArray[np.float32]:
        """Factor on the friction in use, one a finger."""
        return np.array(self._contacts.state()[1], np.float32)

    def reset(self, which: npt.ArrayLike | None = None) -> None:
        """Lifts fingers off and clears their memory: all, or those where `which` (booleans, one a finger) is true."""
        chosen = np.asarray(True if which is None else which)
        if chosen.dtype != np.bool_:
            raise InputError(f"which: {chosen.dtype} where booleans are needed")
        self._contacts.reset(np.ascontiguousarray(fit("which", chosen, (self._count,))))

    def watch(
        self,
        *,
        first_slip: float = 0.99,
        sure_slip: float = 0.95,
        full_slip: float = 0.1,
        partial_restick: float = 0.3,
        restick: float = 0.995,
        looks: int = 8,
        contact_looks: int = 2,
    ) -> None:
        """Records events from the next step on, and counts ticks from there.

        Thresholds are stick ratios, with a gap between there and back: first slip below `first_slip` for `looks` steps or
        below `sure_slip` at once, full slip at `full_slip`, restick above `partial_restick` (in part) and `restick`; touch
        and lift-off after `contact_looks` steps. An event comes up to `looks` - 1 steps late. The defaults pass noise of 10 um on
        depth and slide: no event at rest, one first slip for each slide.
        """
        for name, value in {"looks": looks, "contact_looks": contact_looks}.items():
            if not 0 <= value <= 255:
                raise InputError(f"{name}: {value} is not between 0 and 255")
        self._contacts.watch(first_slip, sure_slip, full_slip, partial_restick, restick, looks, contact_looks)

    def events(self) -> npt.NDArray[np.void]:
        """Events since `watch`, or since the last call: an array of `EVENT`."""
        return np.array(self._contacts.take_events(), EVENT)


@final
class Fingers(Batch):
    """Contacts of one model, which step together and do not influence each other.

    A contact of a bed (`Model`) remembers where its springs are held on the plane, one of a pad (`Pad`) where its patches are held on
    the body and how the finger is deformed, and nothing else: at rest it keeps its bits. Frame: x along the finger from proximal to
    distal, z out of the body into the finger. Steps are the same bits as those of the core on a microcontroller. While they are
    computed other threads run; threads that step the same fingers wait for each other. A number that is NaN or infinite is flagged in
    `status` and leaves its axis where it was.
    """

    def __init__(
        self,
        model: Model | Pad,
        count: SupportsIndex = 1,
        *,
        spin: bool = False,
        body: Body | None = None,
        pitch_deg: Numbers | None = None,
        roll_deg: Numbers | None = None,
    ) -> None:
        """Fingers in the air.

        model: a bed or a pad, kept by its numbers, the object may go. count: how many. spin: whether contacts of a bed follow a turn
        of the plane about its normal, which costs about twice a plain step; others flag it. Those of a pad always do.

        Of a pad only: body: the body that each finger touches, a plane by default. pitch_deg, roll_deg: the pose in which the body's
        apex lies under first touch, and that of steps which name none; numbers or one a finger, the pad's neutral pitch and no roll
        by default.
        """
        self._take(model, count)
        if not isinstance(spin, (bool, np.bool_)):
            raise InputError(f"spin: {spin!r} where True or False is needed")
        self._body: Body = Plane() if body is None else body
        self._poses: npt.NDArray[np.float32] | None = None
        if isinstance(model, Pad):
            self._init_pad(model, pitch_deg, roll_deg)
        else:
            refuse_pose(model, body=body, pitch_deg=pitch_deg, roll_deg=roll_deg)
            self._spin = bool(spin)
            self._contacts = Contacts.of_bed(model, self._count, self._spin)

    def _init_pad(self, pad: Pad, pitch_deg: Numbers | None, roll_deg: Numbers | None) -> None:
        _bodies.check(self._body)
        given = {
            "pitch_deg": (pad.neutral_pitch_deg if pitch_deg is None else pitch_deg, pad.pitch_range_deg),
            "roll_deg": (0.0 if roll_deg is None else roll_deg, pad.roll_range_deg),
        }
        columns = []
        for name, (value, (least, most)) in given.items():
            column = broadcast(name, value, (self._count,))
            check_range(name, column, least, most)
            columns.append(column)
        self._spin, poses, body = True, np.ascontiguousarray(np.stack(columns, axis=1)), self._body
        self._poses = poses
        self._contacts = Contacts.of_pad(pad, type(body).__name__, _bodies.numbers(body), repr(body), poses)

    @property
    def body(self) -> Body:
        """The body that the fingers touch; a plane for those of a bed."""
        return self._body

    @property
    def spin(self) -> bool:
        """Whether contacts follow a turn of the body."""
        return self._spin

    def __repr__(self) -> str:
        more = f" on {self._body!r}" if isinstance(self._model, Pad) else ", with spin" if self._spin else ""
        return f"<fingerpad.Fingers: {self._count} of {self._model!r}{more}>"

    def step(
        self,
        depth_mm: Numbers,
        slide_x_mm: Numbers = 0.0,
        slide_y_mm: Numbers = 0.0,
        spin_rad: Numbers | None = None,
        *,
        dt_s: float = 1e-3,
        strength_factor: Numbers | None = None,
        pitch_deg: Numbers | None = None,
        roll_deg: Numbers | None = None,
        outputs: Literal["forces", "all"] = "forces",
        out: npt.NDArray[np.void] | None = None,
    ) -> npt.NDArray[np.void]:
        """Advances every finger by one step; returns an array of `FORCES` or `RESPONSE`, one a finger.

        depth_mm: at the end of the step, positive into the finger, 0 or less is no contact. slide_x_mm, slide_y_mm: slide of
        the body during the step. spin_rad: turn of the body during the step, counter-clockwise seen from the finger.
        strength_factor: on the friction, 0.1 to 5, kept until it is set again. pitch_deg, roll_deg: of a pad, the pose at the end
        of the step; without, that in which the fingers were made; beyond the pad's range the nearest one, flagged. out: an array of
        an earlier step to write into. Raises InputError for arrays that do not fit; no finger moves then.

        On a curved body depth counts from where the plane through its apex would touch.
        """
        names = {"depth_mm": depth_mm, "slide_x_mm": slide_x_mm, "slide_y_mm": slide_y_mm, "spin_rad": spin_rad}
        names |= self._pose(pitch_deg, roll_deg)
        first, x, y, spin, strength, pitch, roll = self._arrays(1, names | {"strength_factor": strength_factor})
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
        pitch_deg: Numbers | None = None,
        roll_deg: Numbers | None = None,
        outputs: Literal["forces", "all"] = "forces",
        out: npt.NDArray[np.void] | None = None,
    ) -> npt.NDArray[np.void]:
        """Advances every finger by many steps; returns an array of shape (steps, fingers).

        As `step`; arrays broadcast to (steps, fingers), so that (steps, 1) is the same for all fingers and (fingers,) the same
        in all steps. For one finger (steps,) will do. dt_s: a number, or one a step. Ctrl-C ends it within some milliseconds
        and leaves the fingers as they were before.
        """
        names = {"depth_mm": depth_mm, "slide_x_mm": slide_x_mm, "slide_y_mm": slide_y_mm, "spin_rad": spin_rad}
        names |= self._pose(pitch_deg, roll_deg) | {"strength_factor": strength_factor}
        steps = self._steps(names, dt_s)
        first, x, y, spin, strength, pitch, roll = self._arrays(steps, names)
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
        pitch_deg: Numbers | None = None,
        roll_deg: Numbers | None = None,
        out: npt.NDArray[np.void] | None = None,
    ) -> npt.NDArray[np.void]:
        """Advances every finger by one step that leads to forces; returns an array of `DRIVEN`, one a finger.

        Give depth or normal force at the end of the step, and slides or friction (0 where one of the two is left out). A force
        out of reach leads to the nearest state that was found and the status LOAD_NOT_REACHED; a load that is there already
        does not creep. A finger of a pad that touches in this step is pressed first, then loaded. Otherwise as `step`.
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
        names = normal | plane | {"spin_rad": spin_rad} | self._pose(pitch_deg, roll_deg) | {"strength_factor": strength_factor}
        first, x, y, spin, strength, pitch, roll = self._arrays(1, names)
        result = _target(out, DRIVEN, (self._count,))
        words, by_force = _words(result, 1), normal_force_n is not None
        self._contacts.step_driven(first, x, y, spin, strength, by_force, by_friction, pitch, roll, _times(dt_s, 1), words)
        return result

    def gradient(self, direction: npt.ArrayLike = (0.0, 0.0, 0.0)) -> npt.NDArray[np.float32]:
        """How forces change with a further motion, N/mm: shape (fingers, 3, 3), rows normal force, friction x, friction y,
        columns depth, slide x, slide y.

        direction: depth, slide x and slide y along which the motion goes on, of any length, for all fingers or one a finger:
        springs and patches on their limit slip if it loads them further; with zeros all stick. 0 without contact. Of a pad by
        differences of seven steps.
        """
        directions = broadcast("direction", direction, (self._count, 3))
        result = np.empty((self._count, 3, 3), np.float32)
        self._contacts.gradient(directions, result.reshape(-1))
        return result

    def patches(self) -> npt.NDArray[np.void]:
        """State of the patches of a pad after the last step: an array of `PATCH` of shape (fingers, patches).

        The sum of pressure times area (`Pad.patch_areas_mm2`) is the normal force on a plane. A patch that is apart has a place and
        zeros; of a finger in the air all is 0. Costs about as much as a round of a step.
        """
        if not isinstance(self._model, Pad):
            raise InputError("patches: a bed of springs has none; a pad has them: fingerpad.Pad.shipped()")
        result = np.zeros((self._count, self._model.patches), PATCH)
        self._contacts.patches(result.view(np.float32).reshape(-1))
        return result

    def pressure_map(self) -> npt.NDArray[np.void]:
        """Where the pad is pressed after the last step: an array of `PRESSURE_MAP` of shape (fingers, patches).

        The columns of `patches` that concern pressure, and the area of each patch.
        """
        return self._map(PRESSURE_MAP)

    def slip_map(self) -> npt.NDArray[np.void]:
        """Where the pad sticks and slips after the last step: an array of `SLIP_MAP` of shape (fingers, patches).

        The columns of `patches` that concern friction.
        """
        return self._map(SLIP_MAP)

    def _map(self, record: np.dtype[np.void]) -> npt.NDArray[np.void]:
        patches = self.patches()
        result = np.empty(patches.shape, record)
        for name in record.names or ():
            result[name] = self._model.patch_areas_mm2 if name == "area_mm2" else patches[name]  # type: ignore[union-attr]
        return result

    def limit_surface(self, motion: npt.ArrayLike | None = None) -> npt.NDArray[np.void]:
        """Friction and moment of each finger in full slip: an array of `LIMIT` of shape (fingers, motions).

        motion: rows of slide x, slide y (mm) and turn (rad) of the body, of any length: only the direction counts; by default 266
        directions all around. The moment counts about the point under first touch, about which poses turn.

        Of a pad: the sum over the patches of the strength under their pressure after the last step, each against its own motion (a
        round of a step for each motion). A slide at the same depth changes these pressures. Of a bed: where a long slide in that
        direction at the depth of the last step ends (940 steps for each motion), within 1 % of the largest; fingers without spin
        have a moment as well. 0 without contact. No finger moves.
        """
        motions = _all_around() if motion is None else np.asarray(number("motion", motion), np.float64)
        if motions.ndim == 0 or motions.ndim > 2 or motions.shape[-1] != 3:
            raise InputError(f"motion: an array of shape {motions.shape} where (motions, 3) is needed: slide x, slide y, turn")
        motions = motions.reshape(-1, 3)
        length = np.sqrt((np.multiply(motions, (1.0, 1.0, ARM_MM)) ** 2).sum(1))
        wrong = np.flatnonzero(~(np.isfinite(length) & (length > 0)))
        if wrong.size:
            raise InputError(f"motion: row {wrong[0]} is {motions[wrong[0]].tolist()}; finite numbers that are not all 0 are needed")
        forces = np.zeros((self._count, len(motions), 3), np.float32)
        self._contacts.limit_surface((motions / length[:, None]).astype(np.float32), forces.reshape(-1))
        result = np.empty(forces.shape[:2], LIMIT)
        for k, name in enumerate(("slide_x_mm", "slide_y_mm", "spin_rad")):
            result[name] = motions[:, k]
        for k, name in enumerate(("friction_x_n", "friction_y_n", "spin_moment_n_mm")):
            result[name] = forces[:, :, k]
        return result

    def save(self) -> bytes:
        """The state of all fingers, each with its checksum and that of the model; of a pad also its body and tuning. Watches and
        their events are not in it."""
        return self._contacts.save()

    def restore(self, data: bytes) -> None:
        """Takes up a saved state of as many fingers. Raises ModelError, and changes nothing, for damage or another model's."""
        self._contacts.restore(bytes(data))

    def copy(self) -> Fingers:
        """The same fingers again, in the same state."""
        made = Fingers.__new__(Fingers)
        made._model, made._count, made._spin = self._model, self._count, self._spin
        made._body, made._poses = self._body, self._poses
        made._contacts = self._contacts.copy()
        return made

    def __reduce__(self) -> tuple[Any, tuple[Model | Pad, int, dict[str, Any], bytes]]:
        from fingerpad import _pickle

        options: dict[str, Any] = {"spin": self._spin}
        if self._poses is not None:
            options = {"body": self._body, "pitch_deg": self._poses[:, 0], "roll_deg": self._poses[:, 1]}
        return _pickle.fingers, (self._model, self._count, options, self.save())

    def _pose(self, pitch_deg: Numbers | None, roll_deg: Numbers | None) -> dict[str, Numbers | None]:
        """The pose of a step by its names; refused for a bed."""
        pose = {"pitch_deg": pitch_deg, "roll_deg": roll_deg}
        if isinstance(self._model, Model):
            refuse_pose(self._model, **pose)
        return pose

    def _steps(self, given: dict[str, Numbers | None], dt_s: Numbers) -> int:
        """Number of steps: that of the arrays that have a row a step."""
        lengths = {name: _rows(np.shape(number(name, value)), self._count) for name, value in given.items() if value is not None}
        lengths["dt_s"] = len(np.atleast_1d(number("dt_s", dt_s)))
        steps = max(lengths.values())
        if all(np.ndim(value) < 2 for value in given.values() if value is not None) and self._count != 1:
            raise InputError(f"run needs an array with a row a step, of shape (steps, {self._count}) or (steps, 1)")
        return steps if all(lengths.values()) else 0

    def _arrays(self, steps: int, given: dict[str, Numbers | None]) -> Any:
        """The motion's three arrays, then the optional ones in the order of the compiled part; each (steps, fingers), or None."""
        shape = (steps, self._count)
        motion = [broadcast(name, value, shape) for name, value in given.items() if name not in OPTIONAL]
        more = [(name, given.get(name)) for name in OPTIONAL]
        return motion + [None if value is None else broadcast(name, value, shape) for name, value in more]


def refuse_pose(model: Model, pitch_deg: Any = None, roll_deg: Any = None, body: Any = None) -> None:
    """Raises InputError for a body or a pose of a bed."""
    for name, value in {"body": body, "pitch_deg": pitch_deg, "roll_deg": roll_deg}.items():
        if value is None:
            continue
        given = repr(value) if np.ndim(value) == 0 else f"an array of shape {np.shape(value)}"
        pitch, roll = model.pose_deg
        raise InputError(
            f"{name}: {given}, but a bed of springs is of one pose (pitch {pitch:g} deg, roll {roll:g} deg) on a plane; "
            "a pad follows others: fingerpad.Pad.shipped()"
        )


def record_of(words: bytes) -> npt.NDArray[np.void]:
    """The record of a single finger's response."""
    return np.frombuffer(words, RESPONSE).copy()


def _all_around() -> npt.NDArray[np.float64]:
    """Directions of motion, spread over the sphere of slide x, slide y and turn times `ARM_MM`."""
    azimuths = np.arange(AZIMUTHS) * (2 * np.pi / AZIMUTHS)
    rows = [(0.0, 0.0, -1.0)]
    for rise in np.deg2rad(RISES_DEG):
        rows += [(np.cos(rise) * np.cos(a), np.cos(rise) * np.sin(a), np.sin(rise)) for a in azimuths]
    return np.array([*rows, (0.0, 0.0, 1.0)]) / (1.0, 1.0, ARM_MM)


def _rows(shape: tuple[int, ...], count: int) -> int:
    """Number of steps that an array stands for."""
    if len(shape) == 1 and count == 1:
        return shape[0]
    return shape[0] if len(shape) > 1 else 1


def _times(dt_s: Numbers, steps: int) -> npt.NDArray[np.float32]:
    return broadcast("dt_s", dt_s, (steps,))


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
