"""Many contacts that step together, in Warp arrays.

Main classes: `Fingers`, `Response`. Uses `_bed` or `_pad` for the step.
"""

from __future__ import annotations

import operator
import warnings
from typing import Any, SupportsIndex

import numpy as np
import warp as wp

from fingerpad_warp import _arrays, _bed
from fingerpad_warp._errors import InputError
from fingerpad_warp._model import Model

#: Most fingers: 2 GB of memory.
MOST_FINGERS = {"Model": 1 << 22, "Pad": 1 << 19}

#: A response as numpy has it; the fields are those of the package `fingerpad`.
RESPONSE = np.dtype(
    [(name, np.float32) for name in _bed.OUTPUTS[:6]]
    + [("regime", np.uint32), ("status", np.uint32)]
    + [(name, np.float32) for name in _bed.OUTPUTS[6:]]
)


def checked_count(model: Any, count: SupportsIndex) -> int:
    """The number of fingers of a model, once both are checked."""
    kind = type(model).__name__
    if kind not in MOST_FINGERS or not type(model).__module__.startswith("fingerpad_warp."):
        raise InputError(f"model: {type(model).__module__}.{kind} where a fingerpad_warp.Model or Pad is needed")
    try:
        number = operator.index(count)
    except TypeError:
        raise InputError(f"count: {count!r} where a whole number is needed") from None
    if not 1 <= number <= MOST_FINGERS[kind]:
        raise InputError(f"count: {number} is not between 1 and {MOST_FINGERS[kind]}")
    return number


class Response:
    """What the contacts answer to a step: Warp arrays with one number a contact, by names that end in their unit.

    `values` has all of them in the rows of `OUTPUTS`. Forces are those of the body on the finger. A next step of the same fingers
    writes into the same arrays, unless the fingers were made with `requires_grad`.
    """

    OUTPUTS = _bed.OUTPUTS

    def __init__(self, count: int, device: Any, requires_grad: bool = False) -> None:
        self.values = _arrays.table(len(_bed.OUTPUTS), count, device, requires_grad)
        self.regime = wp.zeros(count, dtype=int, device=device)
        self.status = wp.zeros(count, dtype=int, device=device)

    def __getattr__(self, name: str) -> Any:
        if name in _bed.OUTPUTS:
            return self.values[_bed.OUTPUTS.index(name)]
        raise AttributeError(f"a response has no {name}; it has {', '.join(_bed.OUTPUTS)}, regime, status")

    def numpy(self) -> np.ndarray[Any, Any]:
        """A copy as a structured array of `RESPONSE`, one record a contact."""
        values, record = self.values.numpy(), np.empty(self.values.shape[1], RESPONSE)
        for name, row in zip(_bed.OUTPUTS, values, strict=True):
            record[name] = row
        record["regime"], record["status"] = self.regime.numpy(), self.status.numpy()
        return record


class _Bed:
    """The kernel and the numbers of a bed on a device."""

    def __init__(self, model: Model, spin: bool, device: Any, requires_grad: bool) -> None:
        self.pairs = 2 if spin else 1
        self.rows = _bed.memory_rows(self.pairs)
        self.kernel = _bed.step_kernel(self.pairs, requires_grad)
        tables = (model.head, model.springs, model.rows)
        self.tables = [wp.array(each, dtype=float, device=device) for each in tables]

    def fresh(self, count: int) -> np.ndarray[Any, Any]:
        """The memory of fingers in the air."""
        memory = np.zeros((self.rows, count), np.float32)
        memory[-1] = 1
        return memory

    def launch(self, motion: dict[str, Any], dt_s: float, before: Any, after: Any, response: Response, device: Any) -> None:
        names = ("depth_mm", "slide_x_mm", "slide_y_mm", "spin_rad", "strength_factor")
        wp.launch(
            self.kernel,
            dim=before.shape[1],
            inputs=[*self.tables, *(motion[name] for name in names), dt_s, before],
            outputs=[after, response.values, response.regime, response.status],
            device=device,
        )


class Fingers:
    """Contacts of one model that know nothing of each other, on a device of Warp.

    A contact remembers where its springs or patches are held, and nothing else: at rest it keeps its bits. Frame: x along the finger
    from proximal to distal, z out of the body into the finger.

    A number that is NaN or infinite does not raise: it sets a flag in `status` and leaves its axis where it was.
    """

    def __init__(
        self,
        model: Model | Any,
        count: SupportsIndex = 1,
        *,
        spin: bool = False,
        body: Any = None,
        pitch_deg: Any = None,
        roll_deg: Any = None,
        device: Any = None,
        requires_grad: bool = False,
    ) -> None:
        """Fingers in the air.

        model: a bed (`Model`) or a pad (`Pad`). count: how many. device: of Warp, the current one without. requires_grad: of a bed,
        whether Warp's tape may go back through the steps; each step then has arrays of its own.

        spin: of a bed, whether its contacts follow a turn of the plane about its normal, which costs about 1.5 times a plain step;
        others flag it. Of a pad only: body: what all fingers touch, a plane without. pitch_deg, roll_deg: the pose in which the
        body's apex lies under first touch and that of steps which name none, numbers or one a finger.
        """
        self._count = checked_count(model, count)
        kind = type(model).__name__
        self._model = model
        self._device = _arrays.device_of(device)
        self._requires_grad = bool(requires_grad)
        self._is_pad = kind == "Pad"
        self._nothing = _arrays.nothing(self._device)
        self._poses: tuple[Any, Any] | None = None
        if self._is_pad:
            from fingerpad_warp import _pad

            if requires_grad:
                raise InputError("requires_grad: True, but steps of a pad have no adjoint; those of a bed have")
            poses = _pad.poses(model, pitch_deg, roll_deg, self._count)
            self._engine: Any = _pad.Engine(model, body, poses, self._count, self._device)
            pitch, roll = poses
            self._poses = tuple(wp.array(each, dtype=float, device=self._device) for each in (pitch, roll))
        else:
            for name, value in {"body": body, "pitch_deg": pitch_deg, "roll_deg": roll_deg}.items():
                if value is not None:
                    raise InputError(f"{name}: {value!r}, but {_one_pose(model)}")
            if model.effects:
                warnings.warn(f"steps leave out the {model.effects} effects of this model file", stacklevel=2)
            self._engine = _Bed(model, bool(spin), self._device, self._requires_grad)
        self._memory = self._table()
        # A pad steps in place; a bed from one array into another.
        self._other = None if self._requires_grad else self._memory if self._is_pad else self._table()
        self._response = None if self._requires_grad else Response(self._count, self._device)
        self._memory.assign(self._engine.fresh(self._count))

    @property
    def model(self) -> Any:
        """The bed or the pad."""
        return self._model

    @property
    def device(self) -> Any:
        """The device of Warp on which the fingers are."""
        return self._device

    @property
    def memory(self) -> Any:
        """All that the contacts remember: a Warp array with a column a contact, valid until the next step."""
        return self._memory

    def __len__(self) -> int:
        """Number of fingers."""
        return self._count

    def __repr__(self) -> str:
        return f"<fingerpad_warp.Fingers: {self._count} of {self._model!r} on {self._device}>"

    def step(
        self,
        depth_mm: Any,
        slide_x_mm: Any = 0.0,
        slide_y_mm: Any = 0.0,
        spin_rad: Any = None,
        *,
        dt_s: float = 1e-3,
        strength_factor: Any = None,
        pitch_deg: Any = None,
        roll_deg: Any = None,
    ) -> Response:
        """Advances every finger by one step.

        Each argument is a number, an array that broadcasts to the fingers, or a Warp array or torch tensor (float32) of one number a
        finger on the device of the fingers, which is read without a copy.

        depth_mm: at the end of the step, positive into the finger, 0 or less is no contact. slide_x_mm, slide_y_mm: slide of the body
        during the step. spin_rad: turn of the body, counter-clockwise seen from the finger. strength_factor: on the friction, 0.1 to 5
        (held there), kept until it is set again. dt_s: length of the step. pitch_deg, roll_deg: of a pad, the pose at the end of the
        step; beyond the pad's range the nearest one, flagged.
        """
        given = {
            "depth_mm": depth_mm, "slide_x_mm": slide_x_mm, "slide_y_mm": slide_y_mm,
            "spin_rad": spin_rad, "strength_factor": strength_factor,
        }  # fmt: skip
        motion = {
            name: self._nothing if value is None else _arrays.one_each(name, value, self._count, self._device)
            for name, value in given.items()
        }
        time_s = _arrays.one_number("dt_s", dt_s)
        for name, value in {"pitch_deg": pitch_deg, "roll_deg": roll_deg}.items():
            if value is not None and not self._is_pad:
                raise InputError(f"{name}: {value!r}, but {_one_pose(self._model)}")
        if self._poses is not None:
            for name, value, usual in (("pitch_deg", pitch_deg, self._poses[0]), ("roll_deg", roll_deg, self._poses[1])):
                motion[name] = usual if value is None else _arrays.one_each(name, value, self._count, self._device)
        return self._step(motion, time_s)

    def _step(self, motion: dict[str, Any], dt_s: float) -> Response:
        """A step of arguments that are Warp arrays already."""
        if not self._requires_grad:
            for name, array in motion.items():
                if array.requires_grad:
                    raise InputError(f"{name}: an array that requires a gradient, but the fingers were made with requires_grad=False")
        after = self._table() if self._other is None else self._other
        response = Response(self._count, self._device, True) if self._response is None else self._response
        self._engine.launch(motion, dt_s, self._memory, after, response, self._device)
        if self._other is not None:
            self._other = self._memory
        self._memory = after
        return response

    def save(self) -> np.ndarray[Any, Any]:
        """A copy of all that the contacts remember."""
        return self._memory.numpy().copy()

    def restore(self, saved: Any) -> None:
        """Takes up a saved memory of as many contacts of the same model."""
        memory = np.asarray(saved)
        if memory.dtype != np.float32 or memory.shape != self._memory.shape:
            raise InputError(f"saved: {memory.dtype} of shape {memory.shape} where float32 of shape {self._memory.shape} is needed")
        self._set(memory)

    def reset(self, which: Any = None) -> None:
        """Lifts fingers off and makes them forget, strength factors included: all, or those where `which` (booleans) is true."""
        chosen = np.asarray(True if which is None else which)
        if chosen.dtype != np.bool_:
            raise InputError(f"which: {chosen.dtype} where booleans are needed")
        if chosen.shape not in ((), (self._count,)):
            raise InputError(f"which: an array of shape {chosen.shape} where {(self._count,)} is needed")
        self._set(np.where(chosen, self._engine.fresh(self._count), self._memory.numpy()))

    def _set(self, memory: np.ndarray[Any, Any]) -> None:
        # A tape may still refer to the old array.
        if self._requires_grad:
            self._memory = self._table()
        self._memory.assign(np.ascontiguousarray(memory, np.float32))

    def _table(self) -> Any:
        return _arrays.table(self._engine.rows, self._count, self._device, self._requires_grad)


def _one_pose(model: Model) -> str:
    pitch_deg, roll_deg = model.pose_deg
    return f"a bed of springs is of one pose (pitch {pitch_deg:g} deg, roll {roll_deg:g} deg) on a plane; a pad follows others"
