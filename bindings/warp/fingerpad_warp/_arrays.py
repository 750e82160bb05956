"""Arguments as Warp arrays, and arrays laid out for a device.

Main functions: `one_each` (an argument of a step), `table` (rows over contacts).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from fingerpad_warp._errors import InputError


def device_of(device: Any) -> Any:
    """A Warp device; the current one for None, a GPU where there is one."""
    try:
        return wp.get_device(device)
    except Exception as error:
        known = ", ".join(str(each) for each in wp.get_devices())
        raise InputError(f"device: {device!r} is none of {known}") from error


def table(rows: int, count: int, device: Any, requires_grad: bool = False) -> Any:
    """An array of shape (rows, count), 0 throughout: rows lie one after the other on a GPU, contacts one after the other on the CPU."""
    if device.is_cuda:
        return wp.zeros((rows, count), dtype=float, device=device, requires_grad=requires_grad)
    return wp.zeros((count, rows), dtype=float, device=device, requires_grad=requires_grad).transpose()


def numbers(name: str, value: Any, shape: tuple[int, ...]) -> np.ndarray[Any, Any]:
    """A number or an array of numbers, broadcast to a shape, in single precision."""
    try:
        array = np.asarray(value)
    except (ValueError, TypeError, RuntimeError) as error:
        raise InputError(f"{name}: {error}") from None
    if array.dtype.kind not in "fiu":
        raise InputError(f"{name}: {_short(value)} ({array.dtype}) where real numbers are needed")
    # A number beyond 32 bits becomes infinite, which a step flags.
    with np.errstate(over="ignore"):
        array = array.astype(np.float32)
    try:
        return np.ascontiguousarray(np.broadcast_to(array, shape))
    except ValueError:
        raise InputError(f"{name}: an array of shape {array.shape} where {shape} is needed") from None


def one_each(name: str, value: Any, count: int, device: Any) -> Any:
    """An argument of a step as a Warp array of one number a contact.

    Warp arrays and torch tensors of the device are used as they are, without a copy, so that gradients pass. Anything else is a
    number or an array that numpy reads.
    """
    if type(value).__module__.split(".")[0] == "torch":
        try:
            value = wp.from_torch(value)
        except Exception as error:
            raise InputError(f"{name}: {error}") from error
    if not isinstance(value, wp.array):
        return wp.array(numbers(name, value, (count,)), dtype=float, device=device)
    if value.dtype != wp.float32:
        raise InputError(f"{name}: a Warp array of {wp.types.type_repr(value.dtype)} where float32 is needed")
    if value.shape != (count,):
        raise InputError(f"{name}: a Warp array of shape {tuple(value.shape)} where {(count,)} is needed")
    if value.device != device:
        raise InputError(f"{name}: a Warp array on {value.device} where one on {device} is needed")
    return value


def nothing(device: Any) -> Any:
    """The array that stands for an argument that is not given."""
    return wp.zeros(0, dtype=float, device=device)


def one_number(name: str, value: Any) -> float:
    """A single number; NaN and infinity pass, a step flags them."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.floating, np.integer)):
        raise InputError(f"{name}: {_short(value)} where one number is needed")
    return float(value)


def number_within(name: str, value: Any, least: float, most: float) -> float:
    """A single number between two others."""
    number = one_number(name, value)
    if not least <= number <= most:
        raise InputError(f"{name}: {value} is not between {least:.7g} and {most:.7g}")
    return number


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
