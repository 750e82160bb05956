"""The compiled part of the package."""

from os import PathLike
from typing import Any, Sequence, final

import numpy as np
import numpy.typing as npt

__all__ = ["Contacts", "Model", "Pad", "__version__", "load", "run_program", "status_words"]

#: Version of the package.
__version__: str

_Floats = npt.NDArray[np.float32]
_Words = npt.NDArray[np.uint32]

@final
class Model:
    """A fitted bed of springs, of one pose on a plane: the numbers of a model file (.fpm), copied and checked.

    A file is checked once: magic, version, length, checksum, and that no motion yields work with its numbers.
    """

    @staticmethod
    def from_bytes(data: bytes) -> Model:
        """A model from a file's bytes. Raises ModelError with what is wrong."""

    @staticmethod
    def from_file(path: str | PathLike[str]) -> Model:
        """A model from a file. Raises InputError for a file that cannot be read, ModelError for one that is refused."""

    @staticmethod
    def shipped() -> Model:
        """The fitted fingertip that ships with the package."""

    def to_bytes(self) -> bytes:
        """The bytes of the file that the model came from; a tuning is not in them."""

    @property
    def springs(self) -> int:
        """Number of springs."""

    @property
    def depth_max_mm(self) -> float:
        """Largest depth for which the model was fitted, mm; with the tuning's size."""

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
    def tuning(self) -> tuple[float, float, float, float]:
        """The factors on size, stiffness and lambda, and tau_0 in MPa, that the model was retuned with."""

    def tuned(
        self, *, size: float = 1.0, stiffness: float = 1.0, lambda_factor: float = 1.0, tau0_mpa: float = 0.0
    ) -> Model:
        """The model of another finger, counted from the fitted one.

        size: factor on all lengths, 0.5 to 2. stiffness: factor on that of the tissue, 0.2 to 5. lambda_factor: on that of
        the friction law, 0.1 to 10. tau0_mpa: shear strength at zero pressure, MPa, 0 to 0.1. Raises ModelError beyond.
        """

    def least_grip(
        self, friction_x_n: float, friction_y_n: float = 0.0, *, margin: float = 0.0, strength_factor: float = 1.0
    ) -> tuple[float, float, int]:
        """The least depth (mm) and normal force (N) that hold a friction force with a slip margin, and the status.

        margin: share of the limit kept in reserve, 0 to 0.95. The status has LOAD_NOT_REACHED if even the largest depth
        does not hold the load. The half-width of friction's 95 % band is on the safe side already.
        """

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
        """A pad from a file's bytes. Raises ModelError with what is wrong."""

    @staticmethod
    def from_file(path: str | PathLike[str]) -> Pad:
        """A pad from a file. Raises InputError for a file that cannot be read, ModelError for one that is refused."""

    @staticmethod
    def shipped() -> Pad:
        """The fitted pad that ships with the package."""

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

    def __eq__(self, other: object, /) -> bool:
        """Whether file and tuning are the same."""

    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, tuple[bytes, Sequence[float] | None]]: ...

def load(source: bytes | str | PathLike[str]) -> Model | Pad:
    """The bed or the pad that a model file holds, from its bytes or its path.

    Raises InputError for a file that cannot be read, ModelError for one that is refused.
    """

@final
class Contacts:
    @staticmethod
    def of_bed(model: Model, count: int, spin: bool) -> Contacts: ...
    @staticmethod
    def of_pad(
        pad: Pad, kind: str, numbers: tuple[float, float, float], description: str, poses_deg: _Floats
    ) -> Contacts: ...
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
        dt_s: _Floats,
        out: _Words,
    ) -> None: ...
    def gradient(self, direction: _Floats, out: _Floats) -> None: ...
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
