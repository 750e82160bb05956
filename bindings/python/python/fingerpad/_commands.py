"""The commands of the program on pandas frames or on files, with the same numbers.

Frames go to the program and come back as CSV with all their digits.
"""

from __future__ import annotations

import json
import shutil
import tempfile
import warnings
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union, final

from fingerpad._errors import InputError
from fingerpad._native import Model, Pad
from fingerpad._program import Progressing, flags, run

if TYPE_CHECKING:
    import pandas as pd

#: A table: a frame, or the path of a CSV file.
Table = Union["pd.DataFrame", str, "PathLike[str]"]
#: A file or a folder.
Place = Union[str, "PathLike[str]"]


@final
class Folder:
    """Where a command works: a folder of the caller's, or one of its own that goes with the result."""

    def __init__(self, out: Place | None) -> None:
        self.scratch = Path(tempfile.mkdtemp(prefix="fingerpad-"))
        self.path = self.scratch / "out" if out is None else Path(out)

    def run(self, command: str, options: Mapping[str, Any], progress: Progressing, *words: str) -> str:
        """Runs a command; returns its output. A command that fails or is stopped, other than by bad input, keeps the folder."""
        try:
            output, warned = run([command, *words, *flags(options)], progress)
        except InputError:
            self.remove()
            raise
        weakref.finalize(self, shutil.rmtree, self.scratch, ignore_errors=True)
        for warning in warned:
            warnings.warn(warning.removeprefix("warning: "), stacklevel=3)
        return output

    def remove(self) -> None:
        """Removes the files that are not the caller's."""
        shutil.rmtree(self.scratch, ignore_errors=True)

    def table(self, name: str, table: Table | None) -> str | None:
        """The path of a table's CSV file; a frame is written."""
        if table is None or isinstance(table, (str, PathLike)):
            return None if table is None else str(table)
        if not hasattr(table, "to_csv"):
            self.remove()
            raise InputError(f"{name}: a pandas frame or the path of a CSV file is needed, not {type(table).__name__}")
        file = self.scratch / f"{name}.csv"
        table.to_csv(file, index=False)
        return str(file)

    def model(self, model: Model | Place | None) -> str | None:
        """The path of a model file; a model is written."""
        if not isinstance(model, Model):
            return None if model is None else str(model)
        file = self.scratch / "model.fpm"
        file.write_bytes(model.to_bytes())
        return str(file)


def read_csv(path: Place) -> pd.DataFrame:
    """A frame of a CSV file with all digits of its numbers."""
    try:
        import pandas as pd
    except ImportError:
        raise InputError("frames need pandas: pip install fingerpad[frames]") from None
    # From 3.1 on that precision is the default, and asking for it is deprecated.
    exact = {} if tuple(map(int, pd.__version__.split(".")[:2])) >= (3, 1) else {"float_precision": "round_trip"}
    table: pd.DataFrame = pd.read_csv(path, **exact)  # type: ignore[call-overload]
    # A column of whole numbers is one of numbers all the same.
    return table.astype({name: float for name in table.select_dtypes("integer")})


def _json(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


class _Result:
    """Files of a result in a folder."""

    text: str
    _folder: Folder

    @property
    def folder(self) -> Path:
        """Where the files are; without an `out` of the caller's it goes with this object."""
        return self._folder.path

    def save(self, folder: Place) -> None:
        """Copies all files into a folder."""
        shutil.copytree(self.folder, folder, dirs_exist_ok=True)

    def __str__(self) -> str:
        return self.text


@final
@dataclass(repr=False)
class Simulation(_Result):
    """A path of the plane by finite elements."""

    response: pd.DataFrame
    """Forces along the path, columns as in the response file: mm, N, s."""
    fields: list[Path]
    """ParaView files (.vtu) of the whole finger at the rows of the path, if requested."""
    pad_fields: list[Path]
    """The same of the faces of the pad: pressure and traction (MPa), slip (mm), stick."""
    report: dict[str, Any] | None
    """Numbers of the report, if requested."""
    probes: pd.DataFrame | None
    """Strain, strain energy density (MPa) and their rates at points of the tissue, if requested."""
    reactions: pd.DataFrame | None
    """Forces (N) and moments (N mm) of what holds nail, bone and the cut end, if requested."""
    text: str
    """The output of the program."""
    _folder: Folder = field(repr=False)


def simulate(
    path: Table,
    *,
    config: Place | None = None,
    shape: Place | None = None,
    volume: Place | None = None,
    imported: Place | None = None,
    mesh_preset: str | None = None,
    lambda_: float | None = None,
    beta: float | None = None,
    tau0_mpa: float | None = None,
    gamma_crit_mm: float | None = None,
    across_over_along: float | None = None,
    skin_axis_deg: float | None = None,
    body: Place | None = None,
    radius_mm: float | None = None,
    axis_deg: float | None = None,
    angle_deg: float | None = None,
    frictionless_press: bool = False,
    probe: Table | None = None,
    reactions: bool = False,
    fields: bool = False,
    report: bool = False,
    map_rows: Sequence[int] | None = None,
    out: Place | None = None,
    progress: Progressing = None,
) -> Simulation:
    """Follows a path of a rigid body with the finite-element model; `fingerpad simulate`.

    path: columns t_s, depth_mm, slide_x_mm, slide_y_mm (or normal_force_n, friction_x_n, friction_y_n in their place), and
    spin_deg, pitch_deg, roll_deg or moments if wanted. lambda_: factor of the friction law, MPa^(1-beta). across_over_along: strength across an
    axis of the skin over that along it; skin_axis_deg: angle of that axis from x. body: plane, sphere,
    cylinder, edge, groove or a file of heights; radius_mm: its radius, negative for a hollow sphere or cylinder; axis_deg: direction
    of its axis from x; angle_deg: angle between the faces of an edge or a groove. probe: columns x_mm, y_mm, and z_mm or
    below_skin_mm, of points of the tissue to read, or "papillae:0.7" for a grid 0.7 mm under the pad. reactions: keep forces and
    moments of what holds nail, bone and the cut end. fields: keep
    displacement, stress and contact at every row for ParaView or pyvista. report: draw it into report/report.html. map_rows:
    rows, the first is 1, that the report draws. out: folder of the files; a run that was stopped goes on there.

    Raises InputError; NumericsError and Interrupted, whose text names the place of the results so far.
    """
    folder = Folder(out)
    options = {
        "path": folder.table("path", path),
        "out": folder.path / "response.csv",
        "config": config,
        "shape": shape,
        "volume": volume,
        "imported": imported,
        "mesh_preset": mesh_preset,
        "lambda": lambda_,
        "beta": beta,
        "tau0_mpa": tau0_mpa,
        "gamma_crit_mm": gamma_crit_mm,
        "across_over_along": across_over_along,
        "skin_axis_deg": skin_axis_deg,
        "body": body,
        "radius_mm": radius_mm,
        "axis_deg": axis_deg,
        "angle_deg": angle_deg,
        "frictionless_press": frictionless_press,
        "probe": folder.table("probe", probe),
        "probe_out": None if probe is None else folder.path / "probes.csv",
        "reactions": folder.path / "reactions.csv" if reactions else None,
        "vtu": folder.path / "fields" if fields else None,
        "report": folder.path / "report" if report else None,
        "map_rows": None if map_rows is None else list(map_rows),
    }
    text = folder.run("simulate", options, progress)
    files = sorted((folder.path / "fields").glob("response_*.vtu")) if fields else []
    return Simulation(
        response=read_csv(folder.path / "response.csv"),
        fields=[file for file in files if "_pad_" not in file.name],
        pad_fields=[file for file in files if "_pad_" in file.name],
        report=_json(folder.path / "report/report.json") if report else None,
        probes=None if probe is None else read_csv(folder.path / "probes.csv"),
        reactions=read_csv(folder.path / "reactions.csv") if reactions else None,
        text=text,
        _folder=folder,
    )


@final
@dataclass(repr=False)
class Diagnosis(_Result):
    """Which effect measured runs show and the model lacks."""

    report: dict[str, Any]
    """All numbers, as in report.json."""
    text: str
    """The verdict in words."""
    _folder: Folder = field(repr=False)

    @property
    def verdict(self) -> str:
        """none, named, ambiguous or unexplained_structure."""
        return str(self.report["verdict"])

    @property
    def effects(self) -> dict[str, dict[str, float]]:
        """Names of the effects with the values of their parameters."""
        return {e["law"]: {p["name"]: p["value"] for p in e["parameters"]} for e in self.report["effects"]}

    @property
    def corrected_model(self) -> Model | None:
        """The model with the effect, where one was named."""
        file = self.folder / "corrected.fpm"
        return Model.from_file(file) if file.exists() else None

    @property
    def next_experiment(self) -> pd.DataFrame | None:
        """The strokes that would settle an ambiguous verdict."""
        file = self.folder / "next_experiment.csv"
        return read_csv(file) if file.exists() else None

    @property
    def pictures(self) -> list[Path]:
        """The figures of the report (SVG)."""
        return sorted(self.folder.glob("*.svg"))


def diagnose(
    calibration: Table,
    measured: Table,
    *,
    holdout: Table | None = None,
    append: Sequence[Table] = (),
    append_start_s: Sequence[float] | None = None,
    model: Model | Place | None = None,
    laws: Place | None = None,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    sensor_rpy_deg: Sequence[float] | None = None,
    sensor_matrix: Sequence[float] | None = None,
    covariate_sd: Mapping[str, float] | None = None,
    can_set: Sequence[str] | None = None,
    least_rest_s: float | None = None,
    alpha: float = 0.01,
    seed: int = 1,
    confirm_fe: bool = False,
    fe_strokes: int | None = None,
    config: Place | None = None,
    shape: Place | None = None,
    mesh_preset: str | None = None,
    out: Place | None = None,
    progress: Progressing = None,
) -> Diagnosis:
    """Names the effect that measured runs show and the model lacks; `fingerpad diagnose`.

    calibration: runs without an effect. measured: runs to be explained. holdout: runs that are opened after the verdict.
    Columns run_id, t_s, depth_mm, slide_x_mm, slide_y_mm, normal_force_n, friction_x_n, friction_y_n and state columns;
    columns: their names in these tables, as in {"run": "Trial"}; units: their units, as in {"depth": "um"}.
    append: further measured runs, one table after the other; append_start_s: the time of the first row of each on the clock of
    measured, where its clock was started again.
    sensor_rpy_deg: roll, pitch and yaw of the force sensor in the contact frame, degrees; sensor_matrix: the same as nine numbers,
    row by row. Forces are turned by one of them.
    laws: file of laws of one's own. covariate_sd: standard deviation of a state column's readings.
    can_set, least_rest_s: what the next experiment may vary, and the least rest between its strokes.
    alpha, seed: level and seed of the sign-flip test.
    confirm_fe: switch the effect on inside the finite elements as well, on fe_strokes strokes of the finger of config, shape
    and mesh_preset.

    Raises InputError with file, line and column; NumericsError; Interrupted.
    """
    folder = Folder(out)
    options = {
        "calibration": folder.table("calibration", calibration),
        "measured": folder.table("measured", measured),
        "holdout": folder.table("holdout", holdout),
        "model": folder.model(model),
        "laws": laws,
        "map": _pairs(columns),
        "unit": _pairs(units),
        "sensor_rpy_deg": sensor_rpy_deg,
        "sensor_matrix": sensor_matrix,
        "append_start_s": append_start_s,
        "can_set": can_set,
        "least_rest_s": least_rest_s,
        "alpha": alpha,
        "seed": seed,
        "confirm_fe": confirm_fe,
        "fe_strokes": fe_strokes,
        "config": config,
        "shape": shape,
        "mesh_preset": mesh_preset,
        "out": folder.path,
    }
    errors = [f"--covariate-sd={column}={float(sd)!r}" for column, sd in (covariate_sd or {}).items()]
    errors += [f"--append={folder.table(f'append_{number}', runs)}" for number, runs in enumerate(append)]
    text = folder.run("diagnose", options, progress, *errors)
    return Diagnosis(report=_json(folder.path / "report.json"), text=text, _folder=folder)


def diagnose_forces(
    measured: Table,
    *,
    columns: Mapping[str, str] | None = None,
    alpha: float = 0.01,
    out: Place | None = None,
    progress: Progressing = None,
) -> Diagnosis:
    """Diagnoses forces alone, of a finger that was moved freely on a force plate; `fingerpad diagnose trace`.

    columns: where normal, x, y and t are, a minus sign turns one round, as in {"normal": "-Fz", "t": "Timestamp"}.
    """
    folder = Folder(out)
    options = {"force_only": True, "map": _pairs(columns), "alpha": alpha, "out": folder.path}
    text = folder.run("diagnose", options, progress, f"--measured={folder.table('measured', measured)}")
    return Diagnosis(report=_json(folder.path / "report.json"), text=text, _folder=folder)


def diagnose_table(
    table: Table,
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    config: Place | None = None,
    shape: Place | None = None,
    mesh_preset: str | None = None,
    out: Place | None = None,
    progress: Progressing = None,
) -> Diagnosis:
    """Compares a table with the finite elements and looks for effects that close the gap; `fingerpad diagnose table`.

    table: depth_mm and any of normal_force_n, contact_area_mm2, friction_coefficient, each with its spread as ..._sd where it is
    known; columns, units: as in diagnose. config, shape, mesh_preset: the finger. Takes minutes on the medium mesh, which is
    the default; with `out`, finished slides are kept there.

    Raises InputError, NumericsError, Interrupted.
    """
    folder = Folder(out)
    options = {
        "table": folder.table("table", table),
        "map": _pairs(columns),
        "unit": _pairs(units),
        "config": config,
        "shape": shape,
        "mesh_preset": mesh_preset,
        "out": folder.path,
    }
    text = folder.run("diagnose", options, progress)
    return Diagnosis(report=_json(folder.path / "report.json"), text=text, _folder=folder)


def _pairs(names: Mapping[str, str] | None) -> list[str] | None:
    return None if names is None else [f"{ours}={theirs}" for ours, theirs in names.items()]


@final
@dataclass(repr=False)
class Identification(_Result):
    """Finger and friction law of a measured table."""

    report: dict[str, Any]
    """All numbers, as in report.json."""
    text: str
    """The tables in words."""
    _folder: Folder = field(repr=False)

    @property
    def law(self) -> dict[str, float] | None:
        """Constants of the friction law, where it was searched for: lambda, MPa^(1-beta), beta, tau0_mpa."""
        law = self.report.get("law")
        return None if law is None else {name: law["comparison"][name] for name in ("lambda", "beta", "tau0_mpa")}

    @property
    def calibrated_config(self) -> Path | None:
        """Configuration of finger and law, for `simulate`."""
        file = self.folder / "calibrated.toml"
        return file if file.exists() else None


def identify(
    data: Table | None = None,
    *,
    config: Place | None = None,
    shape: Place | None = None,
    volume: Place | None = None,
    imported: Place | None = None,
    mesh_preset: str | None = None,
    published: bool = False,
    joint: bool = False,
    free_tau0: bool = False,
    fast: bool = False,
    prediction: bool = True,
    full: bool = False,
    jobs: int | None = None,
    out: Place | None = None,
    progress: Progressing = None,
) -> Identification:
    """Calibrates the finger on a table and identifies lambda and beta of its friction; `fingerpad identify`.

    data: columns depth_mm, normal_force_n, friction_coefficient and, if measured, contact_area_mm2; Table 1 of Yoshida et al.
    (2011) without. published: the published constants only. joint: finger, depths and law at once as well. fast: without the
    paper's simplex. prediction: with the F/N curve, the published checks and the sensitivities. full: run everything again.
    out: folder of the results; finished work is kept there, and a run that was stopped goes on.

    Raises InputError, NumericsError, Interrupted.
    """
    folder = Folder(out)
    options = {
        "data": folder.table("data", data),
        "config": config,
        "shape": shape,
        "volume": volume,
        "imported": imported,
        "mesh_preset": mesh_preset,
        "published": published,
        "joint": joint,
        "free_tau0": free_tau0,
        "fast": fast,
        "no_prediction": not prediction,
        "full": full,
        "jobs": jobs,
        "out": folder.path,
    }
    text = folder.run("identify", options, progress)
    return Identification(report=_json(folder.path / "report.json"), text=text, _folder=folder)


@final
@dataclass(repr=False)
class Models(_Result):
    """The reduced models of a finger."""

    pad: Pad | None
    """The pad; None if it was not asked for or is not usable."""
    bed: Model | None
    """The bed of springs; None if it was not asked for or is not usable."""
    report: dict[str, Any] | None
    """Numbers of the bed's report."""
    text: str
    """Errors and verdict in words."""
    _folder: Folder = field(repr=False)


def finger(
    *,
    config: Place | None = None,
    shape: Place | None = None,
    volume: Place | None = None,
    imported: Place | None = None,
    mesh_preset: str | None = None,
    material: str | None = None,
    young_mpa: float | None = None,
    poisson: float | None = None,
    mu: float | None = None,
    design: str | None = None,
    runs: Place | None = None,
    only: str | None = None,
    patches: int | None = None,
    restarts: int | None = None,
    accept: bool = False,
    jobs: int | None = None,
    out: Place | None = None,
    progress: Progressing = None,
) -> Models:
    """Makes the pad and the bed of springs of a finger from finite-element runs; `fingerpad finger`.

    shape: a, b, d, e, base, a geometry file, or dimensions in mm: "dome:12,7" (radius, radius of the core) or "flat:20,16,4" (length,
    width, thickness of a gel on a plate). material: "ecoflex-00-30" and others, or young_mpa and poisson, of all soft tissue. mu: Coulomb
    friction. design: "quick" (the default), "full", or "stored" for the runs that are there. runs: folder of the runs, which are kept and
    continued. only: "pad" or "bed". accept: write models that are not usable too. out: folder of everything.

    Raises InputError, NumericsError, NotGoodEnough, Interrupted.
    """
    folder = Folder(out)
    options = {
        "out": folder.path,
        "config": config,
        "shape": shape,
        "volume": volume,
        "imported": imported,
        "mesh_preset": mesh_preset,
        "material": material,
        "young_mpa": young_mpa,
        "poisson": poisson,
        "mu": mu,
        "design": design,
        "runs": runs,
        "only": only,
        "patches": patches,
        "restarts": restarts,
        "accept": accept,
        "jobs": jobs,
    }
    text = folder.run("finger", options, progress)
    pad, bed, report = (folder.path / name for name in ("pad.fpm", "model.fpm", "reduced.json"))
    return Models(
        pad=Pad.from_file(pad) if pad.exists() else None,
        bed=Model.from_file(bed) if bed.exists() else None,
        report=_json(report) if report.exists() else None,
        text=text,
        _folder=folder,
    )
