"""Checks and conversions of arguments to arrays of 32-bit floats."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from fingerpad._errors import InputError

#: Numbers, or an array of them that broadcasts to the fingers.
Numbers = Union[float, npt.ArrayLike]

#: Largest number that is filled in without a look at whether it fits into 32 bits.
_FITS = 3e38


def number(name: str, value: Any) -> npt.NDArray[Any]:
    """The array of an argument. Raises InputError for masked elements and for other than real numbers."""
    if np.ma.is_masked(value):
        raise InputError(
            f"{name}: {np.ma.getmaskarray(value).sum()} of {np.size(value)} numbers are masked, where all are needed; "
            "fill them: array.filled(float('nan')) has a step flag them"
        )
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise InputError(f"{name}: {error}") from None
    if array.dtype.kind not in "fiu":
        raise InputError(f"{name}: {array.dtype} where real numbers are needed")
    return array


def fit(name: str, array: npt.NDArray[Any], shape: tuple[int, ...]) -> npt.NDArray[Any]:
    """The array broadcast to a shape; an array of steps alone also fits one finger."""
    if array.ndim == 1 and len(shape) == 2 and shape[1] == 1:
        array = array.reshape(-1, 1)
    try:
        return np.broadcast_to(array, shape)
    except ValueError:
        needed = shape[1:] if len(shape) == 2 and shape[0] == 1 else shape
        raise InputError(f"{name}: an array of shape {array.shape} where {needed} is needed") from None


def broadcast(name: str, value: Any, shape: tuple[int, ...]) -> npt.NDArray[np.float32]:
    """A contiguous array of a shape."""
    if type(value) is float and -_FITS < value < _FITS:
        return np.full(shape, value, np.float32)
    array = number(name, value)
    if array.dtype != np.float32:
        # A number beyond 32 bits becomes infinite, which a step flags.
        with np.errstate(over="ignore"):
            array = array.astype(np.float32)
    return np.ascontiguousarray(array if array.shape == shape else fit(name, array, shape))


def rows(name: str, value: Any, length: int) -> npt.NDArray[np.float64]:
    """Rows of 64-bit floats."""
    array = number(name, value).astype(np.float64)
    if array.shape[-1:] != (length,):
        raise InputError(f"{name}: an array of shape {array.shape} where rows of {length} numbers are needed")
    return array


def broadcast_shape(arrays: Mapping[str, npt.NDArray[Any]]) -> tuple[int, ...]:
    """The common shape of arguments. Raises InputError with the shapes that do not fit."""
    try:
        return np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items() if array.shape)
        raise InputError(f"arrays of shapes that do not broadcast: {shapes}") from None


def check_range(name: str, array: npt.NDArray[Any], least: float, most: float) -> None:
    """Raises InputError with the first number that is not within a range."""
    outside = array[~((array >= least) & (array <= most))]
    if outside.size:
        raise InputError(f"{name}: {outside.flat[0]:g} is not between {least:g} and {most:g}")
