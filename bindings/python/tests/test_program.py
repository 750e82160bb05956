"""Which program the commands start, and how its end becomes a result or an exception.

A script replaces the program: it reads its options, writes files and ends as the program does. `test_commands.py` tests the
numbers of the program itself.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import fingerpad
from fingerpad import InputError, Interrupted, NumericsError, Progress, _native

pd = pytest.importorskip("pandas")

#: Ends with the code in the table's first column; 0 writes what `simulate` writes.
STAND_IN = """#!{python}
import csv, os, signal, sys, time
if sys.argv[1] != "simulate":
    print("output", *sys.argv[1:])
    sys.exit(7)
options = dict(word[2:].split("=", 1) for word in sys.argv[2:])
rows = list(csv.DictReader(open(options["path"])))
code = int(float(rows[0]["code"]))
print("simulate: 40 %, row 2", file=sys.stderr)
print("warning: a stand-in", file=sys.stderr)
if code == 130:
    def stop(*_):
        print("interrupted: rows kept in somewhere.csv", file=sys.stderr)
        sys.exit(130)
    signal.signal(signal.SIGINT, stop)
    print("simulate: 50 %", file=sys.stderr, flush=True)
    time.sleep(60)
if code:
    print("error: depth_mm of row 1 is bad", file=sys.stderr)
    sys.exit(code)
os.makedirs(os.path.dirname(options["out"]), exist_ok=True)
with open(options["out"], "w") as out:
    print("t_s,normal_force_n\\n0,0.1\\n1,0.30000000000000004", file=out)
print("1 row, lambda", options["lambda"])
"""


@pytest.fixture
def stand_in(tmp_path: Path) -> Path:
    folder = tmp_path / "bin"
    folder.mkdir()
    path = folder / "fingerpad"
    path.write_text(STAND_IN.format(python=sys.executable))
    path.chmod(0o755)
    return path


@pytest.fixture(params=["variable", "path"])
def found(request: Any, stand_in: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The stand-in, named by the variable or on PATH, which a wheel with a program of its own does not look at."""
    monkeypatch.delenv("FINGERPAD_PROGRAM", raising=False)
    if request.param == "variable":
        monkeypatch.setenv("FINGERPAD_PROGRAM", str(stand_in))
    elif _native.HAS_PROGRAM:
        pytest.skip("this wheel has a program of its own")
    else:
        monkeypatch.setenv("PATH", str(stand_in.parent) + os.pathsep + os.environ["PATH"])
    return str(request.param)


def test_a_result(found: str) -> None:
    seen: list[Progress] = []
    with pytest.warns(UserWarning, match="a stand-in"):
        run = fingerpad.simulate(pd.DataFrame({"code": [0]}), lambda_=0.1, progress=seen.append)
    assert list(run.response["normal_force_n"]) == [0.1, 0.1 + 0.2] and str(run) == "1 row, lambda 0.1\n"
    assert seen == [Progress("simulate", 0.4, "row 2")]


@pytest.mark.parametrize(("code", "error"), [(2, InputError), (3, NumericsError), (9, NumericsError)])
def test_exit_codes(found: str, code: int, error: Any) -> None:
    with pytest.raises(error, match="depth_mm of row 1 is bad" + (r" \(exit code 9\)" if code == 9 else "$")):
        fingerpad.simulate(pd.DataFrame({"code": [code]}))


def test_an_interrupt_waits_for_what_is_kept(found: str) -> None:
    def stop(progress: Progress) -> None:
        if progress.share == 0.5:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted, match="rows kept in somewhere.csv"):
        fingerpad.simulate(pd.DataFrame({"code": [130]}), progress=stop)


def test_the_command_line_is_passed_on(found: str) -> None:
    done = subprocess.run([sys.executable, "-m", "fingerpad", "mesh", "--size", "1 2"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (7, "output mesh --size 1 2\n"), done.stderr


def test_a_program_that_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = tmp_path / "plain"
    plain.write_text("no program")
    for given in (str(tmp_path / "none"), str(plain), str(tmp_path), "no-such-program"):
        monkeypatch.setenv("FINGERPAD_PROGRAM", given)
        with pytest.raises(InputError, match="FINGERPAD_PROGRAM: '.*' is not a program that can be run"):
            fingerpad.simulate(pd.DataFrame({"code": [0]}))
        done = subprocess.run([sys.executable, "-m", "fingerpad", "--help"], capture_output=True, text=True)
        assert done.returncode == 2 and done.stderr.startswith("error: FINGERPAD_PROGRAM: ")


@pytest.mark.skipif(_native.HAS_PROGRAM, reason="this wheel has a program of its own")
def test_no_program_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FINGERPAD_PROGRAM", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    frame = pd.DataFrame({"code": [0]})
    commands: list[Any] = [
        lambda: fingerpad.simulate(frame),
        lambda: fingerpad.diagnose(frame, frame),
        lambda: fingerpad.identify(frame),
        lambda: fingerpad.finger(),
    ]
    for command in commands:
        with pytest.raises(InputError, match="the program fingerpad was not found: .* FINGERPAD_PROGRAM is not set.*cargo install"):
            command()
    done = subprocess.run([sys.executable, "-m", "fingerpad", "simulate"], capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr.startswith("error: the program fingerpad was not found")
    with pytest.raises(InputError, match="run_program: this wheel was built without the program"):
        _native.run_program(["fingerpad", "--help"])
