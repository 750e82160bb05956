"""Fixtures: models, the pad, the documented vectors, the core without Python."""

from __future__ import annotations

import os
import re
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest

import fingerpad

ROOT = Path(__file__).resolve().parents[3]
MODEL = ROOT / "data/models/fingertip.fpm"
PAD = ROOT / "data/models/fingertip-pad.fpm"
#: A step as the native example reads it.
STEP = np.dtype([(n, "<f4") for n in ("depth_mm", "x", "y", "spin_rad", "dt_s", "strength", "pitch_deg", "roll_deg")])


# A shell that starts the tests in the background has them ignore Ctrl-C, and what they start as well.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def model() -> fingerpad.Model:
    return fingerpad.Model.from_file(MODEL)


@pytest.fixture(scope="session")
def pad() -> fingerpad.Pad:
    return fingerpad.Pad.from_file(PAD)


@pytest.fixture(scope="session")
def vectors() -> list[tuple[list[float], list[int]]]:
    """Motion (depth, slides) and words (nine floats' bits, regime, status) of the documented steps."""
    text = (ROOT / "core/docs/fpm-format.md").read_text()
    found = re.search(r"```vectors\n(.*?)\n```", text, re.DOTALL)
    assert found, "the document has no vectors"
    rows = []
    for line in found[1].splitlines():
        motion, answer = line.split("|")
        *bits, regime, status = answer.split()
        rows.append(([float(x) for x in motion.split()], [int(b, 16) for b in bits] + [int(regime), int(status)]))
    return rows


@pytest.fixture(scope="session")
def native() -> Path:
    """The program `fingerpad-native` of this workspace: the path in FINGERPAD_NATIVE, or built here."""
    if there := os.environ.get("FINGERPAD_NATIVE"):
        return Path(there)
    package = ROOT / "bindings/python"
    subprocess.run(["cargo", "build", "--release", "--package", "fingerpad-native"], cwd=package, check=True)
    return package / "target/release/fingerpad-native"


@pytest.fixture(scope="session")
def program() -> Path:
    """The program `fingerpad` that cargo built: the path in FINGERPAD_CARGO_PROGRAM, or built here."""
    if there := os.environ.get("FINGERPAD_CARGO_PROGRAM"):
        return Path(there)
    subprocess.run(["cargo", "build", "--release", "--package", "fingerpad-cli"], cwd=ROOT, check=True)
    return ROOT / "target/release/fingerpad"
