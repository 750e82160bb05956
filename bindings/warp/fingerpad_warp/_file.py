"""The envelope of a model file (`.fpm`): magic, version, length, checksum, sections.

Main class: `Envelope`. The layout is in `core/docs/fpm-format.md` of the repository.
"""

from __future__ import annotations

import os
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fingerpad_warp._errors import InputError, ModelError

MAGIC = b"FPM1"
#: The format version that this package reads.
VERSION = 10
HEADER = 20
ENTRY = 12
MOST_SECTIONS = 16

Floats = npt.NDArray[np.float32]


def read_bytes(source: bytes | str | os.PathLike[str]) -> bytes:
    """The bytes of a model file, from bytes or a path."""
    if isinstance(source, (bytes, bytearray, memoryview)):
        return bytes(source)
    if not isinstance(source, (str, os.PathLike)):
        raise InputError(f"source: {type(source).__name__} where bytes or a path is needed")
    try:
        return Path(source).read_bytes()
    except OSError as error:
        raise InputError(f"source: {os.fspath(source)}: {error.strerror or error}") from None


class Envelope:
    """A model file whose header and checksum are in order."""

    def __init__(self, data: bytes) -> None:
        if data[:4] != MAGIC:
            raise ModelError("not a model file (it does not start with FPM1)")
        if len(data) < HEADER:
            raise ModelError(f"{len(data)} bytes where at least {HEADER} are expected")
        version, length, checksum, count = struct.unpack_from("<4I", data, 4)
        if version != VERSION:
            raise ModelError(f"format version {version}; this package reads version {VERSION}")
        if length != len(data):
            raise ModelError(f"{len(data)} bytes where {length} are expected")
        if zlib.crc32(data[16:]) != checksum:
            raise ModelError("checksum wrong: the file is damaged")
        self._data = data
        self._sections: dict[bytes, bytes] = {}
        for i in range(min(count, MOST_SECTIONS)):
            at = HEADER + i * ENTRY
            if at + ENTRY > len(data):
                raise ModelError(f"{len(data)} bytes where {at + ENTRY} are expected")
            name, offset, size = struct.unpack_from("<4s2I", data, at)
            if offset + size > len(data):
                raise ModelError(f"section {_letters(name)}: {len(data)} bytes where {offset + size} are expected")
            self._sections.setdefault(name, data[offset : offset + size])

    def __contains__(self, name: bytes) -> bool:
        return name in self._sections

    def section(self, name: bytes) -> bytes:
        """The bytes of a section that must be there."""
        try:
            return self._sections[name]
        except KeyError:
            raise ModelError(f"section {_letters(name)} is missing") from None

    def floats(self, name: bytes, skip_bytes: int, count: int) -> Floats:
        """The floats of a section behind its first bytes; their number must be `count`."""
        data = self.section(name)[skip_bytes:]
        if len(data) != 4 * count:
            raise ModelError(f"section {_letters(name)}: {len(data)} bytes of numbers where {4 * count} are expected")
        return np.frombuffer(data, "<f4").astype(np.float32)


def _letters(name: bytes) -> str:
    return name.decode("ascii", "backslashreplace")


def check_range(name: str, values: Any, least: float, most: float) -> None:
    """Refuses values out of a range, NaN included, by the name, the index and the value of the first."""
    flat = np.atleast_1d(np.asarray(values, np.float64)).reshape(-1)
    outside = np.flatnonzero(~((flat >= least) & (flat <= most)))
    if outside.size:
        i = int(outside[0])
        raise ModelError(f"{name}[{i}] = {flat[i]:g} is not between {least:g} and {most:g}")
