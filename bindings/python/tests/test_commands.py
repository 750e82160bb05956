"""The commands on frames give what the command line gives, and end as it does."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import fingerpad
from fingerpad import InputError, Interrupted, Model, NumericsError, Progress

pytestmark = pytest.mark.nightly

#: Largest difference from the program that cargo built for this machine's processor, relative: it fuses multiplications with
#: additions, which a wheel for all processors does not, and iterations end within their tolerance of 1e-6.
BETWEEN_BUILDS = 1e-4
#: The same from where on one build has halved an increment.
BETWEEN_INCREMENTS = 1e-3


def wheel_program(*words: Any) -> subprocess.CompletedProcess[str]:
    """The program of the wheel, as its users call it."""
    return subprocess.run([sys.executable, "-m", "fingerpad", *map(str, words)], capture_output=True, text=True)


def frame(path: Path) -> pd.DataFrame:
    """A frame whose numbers are exactly those of the file: each is read by Python itself."""
    text = pd.read_csv(path, dtype=str, keep_default_na=False)

    def number(cell: str) -> Any:
        try:
            return float(cell) if cell else np.nan
        except ValueError:
            return cell

    return text.map(number)


def without_time(report: dict[str, Any]) -> dict[str, Any]:
    """A report without the entries that differ between two equal runs: times, and names of the input files."""
    return {k: v for k, v in report.items() if k not in ("elapsed_s", "input", "cost", "path")}


def test_simulate(root: Path, program: Path, tmp_path: Path) -> None:
    path = root / "data/examples/path.csv"
    options = ["--mesh-preset", "coarse", "--lambda", "0.1", "--beta", "0.45"]
    found = fingerpad.simulate(
        frame(path),
        mesh_preset="coarse",
        lambda_=0.1,
        beta=0.45,
        fields=True,
        report=True,
        probe="papillae:0.7",
        reactions=True,
    )
    assert found.reactions is not None and found.probes is not None
    assert list(found.reactions["t_s"]) == list(found.response["t_s"])
    held = found.reactions[["nail_force_z_n", "bone_force_z_n", "section_force_z_n"]].sum(axis=1)
    assert (held + found.response["normal_force_n"]).abs().max() < 1e-3
    assert len(found.probes) % len(found.response) == 0
    done = wheel_program("simulate", "--path", path, "--out", tmp_path / "wheel.csv", *options)
    assert done.returncode == 0, done.stderr
    pd.testing.assert_frame_equal(found.response, frame(tmp_path / "wheel.csv"), check_exact=True, check_dtype=False)
    subprocess.run([program, "simulate", "--path", path, "--out", tmp_path / "cargo.csv", *options], check=True)
    native = frame(tmp_path / "cargo.csv")
    # Rounding can make one build halve an increment that the other does not: the rows at the same times are compared.
    ours, theirs = (table.set_index(table["t_s"].round(9)) for table in (found.response, native))
    common = ours.index.intersection(theirs.index)
    alike = int((ours.index[: len(common)] == theirs.index[: len(common)]).cumprod().sum())
    assert set(frame(path)["t_s"].round(9)) <= set(common) and alike > 25
    ours, theirs = ours.loc[common], theirs.loc[common]
    forces = ["normal_force_n", "friction_x_n", "friction_y_n", "contact_area_mm2", "stick_ratio"]
    for name in forces:
        scale = theirs[name].abs().max() or 1.0
        differences = (ours[name] - theirs[name]).abs()
        assert differences.iloc[:alike].max() <= BETWEEN_BUILDS * scale, name
        assert differences.max() <= BETWEEN_INCREMENTS * scale, name
    assert (ours["regime"] == theirs["regime"]).all()
    rows = len(frame(path))
    assert len(found.fields) == len(found.pad_fields) == rows and found.report is not None
    assert (found.folder / "report/report.html").exists() and f"{len(found.response)} rows" in str(found)


def test_diagnose(root: Path, program: Path, tmp_path: Path) -> None:
    examples = root / "data/examples"
    names = ("calibration", "measured", "holdout")
    frames = {name: frame(examples / f"{name}.csv") for name in names}
    found = fingerpad.diagnose(**frames, covariate_sd={"hydration_au": 2}, seed=3)
    options = [w for name in names for w in (f"--{name}", examples / f"{name}.csv")]
    options += ["--covariate-sd", "hydration_au=2", "--seed", "3"]
    done = wheel_program("diagnose", *options, "--out", tmp_path / "wheel")
    assert done.returncode == 0 and done.stdout == str(found)
    wheel = json.loads((tmp_path / "wheel/report.json").read_text())
    assert without_time(found.report) == without_time(wheel)
    subprocess.run([program, "diagnose", *options, "--out", tmp_path / "cargo"], check=True)
    native = json.loads((tmp_path / "cargo/report.json").read_text())
    assert found.verdict == native["verdict"] == "named"
    for ours, theirs in zip(found.report["baseline"]["parameters"], native["baseline"]["parameters"]):
        assert ours["calibrated"] == pytest.approx(theirs["calibrated"], rel=BETWEEN_BUILDS, abs=1e-9), ours["name"]
    # The fit that follows has no one minimum to the last digits; rounding moves it within its own confidence interval.
    [ours], [theirs] = found.report["effects"], native["effects"]
    assert ours["law"] == theirs["law"]
    for parameter, other in zip(ours["parameters"], theirs["parameters"]):
        low, high = parameter["ci95"]
        assert low <= other["value"] <= high, parameter["name"]
    [(law, parameters)] = found.effects.items()
    assert law == "hydration_bell" and parameters["amplitude"] > 0.4
    corrected = found.corrected_model
    assert corrected is not None and corrected.effects[0][0] == "hydration_bell"
    assert found.next_experiment is None and len(found.pictures) >= 4
    found.save(tmp_path / "saved")
    assert (tmp_path / "saved/report.html").exists()


def test_diagnose_takes_columns_and_units_as_they_come(root: Path) -> None:
    """Columns under other names, depths in micrometres: the same verdict, and a wrong name is refused."""
    examples = root / "data/examples"
    calibration, measured = (frame(examples / f"{name}.csv") for name in ("calibration", "measured"))
    mine = [f.rename(columns={"run_id": "Trial"}).assign(depth_mm=f["depth_mm"] * 1000) for f in (calibration, measured)]
    names: Any = {"columns": {"run": "Trial"}, "units": {"depth": "um"}, "can_set": ["depth", "speed"], "least_rest_s": 30}
    found = fingerpad.diagnose(*mine, **names)
    assert list(found.effects) == list(fingerpad.diagnose(calibration, measured).effects) == ["hydration_bell"]
    with pytest.raises(InputError, match="Versuch"):
        fingerpad.diagnose(*mine, columns={"run": "Versuch"}, units={"depth": "um"})


def test_diagnose_appends_runs_and_turns_forces(root: Path) -> None:
    """Runs that are appended, of a sensor that is mounted upside down: the report of one file in the contact frame."""
    examples = root / "data/examples"
    calibration, measured = (frame(examples / f"{name}.csv") for name in ("calibration", "measured"))
    whole = fingerpad.diagnose(calibration, measured)
    turned = {"friction_y_n": -1, "normal_force_n": -1}
    calibration, measured = (f.assign(**{c: s * f[c] for c, s in turned.items()}) for f in (calibration, measured))
    names = list(dict.fromkeys(measured["run_id"]))
    parts = [measured[measured["run_id"].isin(some)] for some in (names[:9], names[9:12], names[12:])]
    found = fingerpad.diagnose(calibration, parts[0], append=parts[1:], sensor_matrix=[1, 0, 0, 0, -1, 0, 0, 0, -1])
    assert [file["role"] for file in found.report["input"]] == ["calibration", "measured", "appended", "appended"]
    assert found.report["effects"] == whole.report["effects"]
    with pytest.raises(InputError, match="left-handed"):
        fingerpad.diagnose(calibration, measured, sensor_matrix=[1, 0, 0, 0, 1, 0, 0, 0, -1])


def test_diagnose_forces_and_table(root: Path, tmp_path: Path) -> None:
    table = root / "data/yoshida2011.csv"
    found = fingerpad.diagnose_table(frame(table), mesh_preset="coarse")
    wheel_program("diagnose", "--table", table, "--mesh-preset", "coarse", "--out", tmp_path / "table")
    assert without_time(found.report) == without_time(json.loads((tmp_path / "table/report.json").read_text()))
    trace = root / "data/human_texture_exploration/July3_2_force_data_1.csv"
    columns = {"normal": "-Fz", "x": "Fx", "y": "Fy", "t": "Timestamp"}
    forces = fingerpad.diagnose_forces(trace, columns=columns)
    words = ["--force-only", "--measured", trace, "--map", "normal=-Fz,x=Fx,y=Fy,t=Timestamp"]
    assert wheel_program("diagnose", *words, "--out", tmp_path / "forces").returncode == 0
    assert without_time(forces.report) == without_time(json.loads((tmp_path / "forces/report.json").read_text()))


def test_identify(root: Path, tmp_path: Path) -> None:
    """The published constants on two rows of the table; a second call in the same folder has it at once."""
    table = root / "data/yoshida2011.csv"
    rows = frame(table).iloc[:2]
    rows.to_csv(tmp_path / "rows.csv", index=False)
    seen: list[Progress] = []
    options: Any = {"mesh_preset": "coarse", "published": True, "prediction": False}
    found = fingerpad.identify(rows, **options, out=tmp_path / "python", progress=seen.append)
    assert any("calibration" in progress.what for progress in seen)
    words = ["--mesh-preset", "coarse", "--published", "--no-prediction", "--data", tmp_path / "rows.csv"]
    done = wheel_program("identify", *words, "--out", tmp_path / "wheel")
    assert done.returncode == 0, done.stderr
    wheel = json.loads((tmp_path / "wheel/report.json").read_text())
    assert found.report["published"] == wheel["published"] and found.law is None
    assert found.calibrated_config is not None
    start = time.monotonic()
    again = fingerpad.identify(rows, **options, out=tmp_path / "python")
    assert again.report == found.report and "finished before" in again.text and time.monotonic() - start < 10


def test_finger_refuses_as_the_command_does(tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    done = wheel_program("finger", "--design", "stored", "--runs", tmp_path / "runs", "--out", tmp_path / "made")
    assert done.returncode == 2
    with pytest.raises(InputError) as error:
        fingerpad.finger(design="stored", runs=tmp_path / "runs", out=tmp_path / "made")
    # A command that takes longer than a second also tells its progress.
    assert done.stderr.splitlines()[-1] == f"error: {error.value}"


def test_a_robots_fingertip_from_its_dimensions(tmp_path: Path) -> None:
    """Coulomb's law comes back from pad and bed; runs that are there are not repeated."""
    tip: Any = {"shape": "dome:10,5", "young_mpa": 0.1, "mu": 0.8, "mesh_preset": "coarse", "out": tmp_path}
    made = fingerpad.finger(**tip)
    assert made.pad is not None and made.bed is not None and made.report is not None
    for model in (made.pad, made.bed):
        contact = fingerpad.Finger(model)
        for _ in range(10):
            contact.step(0.8)
        for _ in range(400):
            last = contact.step(0.8, 0.02)
        assert abs(last.friction_x_n / last.normal_force_n / 0.8 - 1.0) < 0.01
    assert "21 of 21 paths are there" in fingerpad.finger(**tip, only="pad").text


def test_errors_have_the_text_of_the_command_line(root: Path, tmp_path: Path) -> None:
    path = frame(root / "data/examples/path.csv")
    bad = path.copy()
    bad.loc[2, "depth_mm"] = np.nan
    bad.to_csv(tmp_path / "bad.csv", index=False)
    done = wheel_program("simulate", "--path", tmp_path / "bad.csv", "--out", tmp_path / "r.csv")
    assert done.returncode == 2
    for given in (bad, tmp_path / "bad.csv"):
        with pytest.raises(InputError) as error:
            fingerpad.simulate(given)
        assert str(error.value).split(".csv", 1)[1] == done.stderr.strip().split(".csv", 1)[1]
    for options, text in [
        ({"beta": float("nan")}, "--beta NaN: not a valid value"),
        ({"mesh_preset": "huge"}, "invalid value 'huge' for '--mesh-preset"),
        ({"config": tmp_path / "none.toml"}, "none.toml"),
        ({"map_rows": [99], "report": True}, "--map-rows 99"),
    ]:
        with pytest.raises(InputError, match=text):
            fingerpad.simulate(path, **options)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="a pandas frame or the path"):
        fingerpad.simulate(42)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="none.csv"):
        fingerpad.diagnose(tmp_path / "none.csv", tmp_path / "none.csv")


def test_numerics_that_fail_keep_what_was_reached(root: Path, tmp_path: Path) -> None:
    """Without iterations there is no equilibrium in contact; the error names the file of the rows before."""
    config = tmp_path / "hard.toml"
    config.write_text("[numerics.solver]\nmax_iterations = 1\n")
    with pytest.raises(NumericsError, match="increment") as error:
        fingerpad.simulate(root / "data/examples/path.csv", mesh_preset="coarse", config=config)
    kept = re.search(r"rows kept in (\S+\.csv)", str(error.value))
    assert kept and len(frame(Path(kept[1]))) >= 1, error.value


def interrupt_after(seconds: float) -> None:
    threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGINT)).start()


def test_ctrl_c_keeps_what_was_reached(root: Path, tmp_path: Path) -> None:
    """Ctrl-C during a run ends it within two seconds; the rows are there, and the same call goes on from them."""
    path = pd.DataFrame({"t_s": [0.0, 1, 2, 3, 4, 5, 6], "depth_mm": [0.0, 1, 1, 1, 1, 1, 1]})
    path["slide_x_mm"], path["slide_y_mm"] = [0.0, 0, 3, -3, 3, -3, 3], 0.0
    started: list[float] = []

    def progress(progress: Progress) -> None:
        if (progress.share or 0) > 0.1 and not started:
            started.append(time.monotonic())
            os.kill(os.getpid(), signal.SIGINT)

    options: Any = {"mesh_preset": "medium", "out": tmp_path / "out"}
    with pytest.raises(Interrupted, match=r"rows kept in .*response\.partial\.csv") as error:
        fingerpad.simulate(path, **options, progress=progress)
    assert isinstance(error.value, KeyboardInterrupt) and time.monotonic() - started[0] < 6
    kept = frame(tmp_path / "out/response.partial.csv")
    assert len(kept) > 1 and list((tmp_path / "out").glob("response.checkpoint*"))


def test_ctrl_c_stops_what_keeps_nothing(root: Path) -> None:
    start = time.monotonic()
    interrupt_after(1.0)
    with pytest.raises(Interrupted):
        fingerpad.finger(design="stored", only="bed", restarts=100)
    assert time.monotonic() - start < 6


def test_an_exception_of_the_callback_ends_the_work(root: Path) -> None:
    def refuse(_: Progress) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        fingerpad.identify(mesh_preset="coarse", published=True, progress=refuse)


def test_a_model_goes_through_a_command(root: Path, tmp_path: Path) -> None:
    """The shipped model as an object is the model that ships, but for its name."""
    examples = root / "data/examples"
    plain = fingerpad.diagnose(examples / "calibration.csv", examples / "measured.csv")
    given = fingerpad.diagnose(examples / "calibration.csv", examples / "measured.csv", model=Model.shipped())
    assert plain.verdict == given.verdict == "named" and given.report["baseline"]["model"] == "model.fpm"
