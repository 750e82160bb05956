"""What the tests start from: devices, models, the package `fingerpad` as the reference, which has the bits of the core.

Every test that steps contacts runs on the CPU, and on the first CUDA device as well where there is one; the head of the report and the
name of each such test say which.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import warp as wp

import fingerpad_warp as fw

ROOT = Path(__file__).resolve().parents[3]
MODEL, PAD = ROOT / "data/models/fingertip.fpm", ROOT / "data/models/fingertip-pad.fpm"
DEVICES = ["cpu"] + (["cuda:0"] if wp.is_cuda_available() else [])
#: Seed of all random numbers here; failures print it.
SEED = 20


def pytest_report_header() -> str:
    gpu = wp.get_device("cuda:0").name if len(DEVICES) > 1 else "no CUDA device here, nothing was tested on a GPU"
    return f"Warp {wp.__version__}, devices under test: {', '.join(DEVICES)} ({gpu})"


@pytest.fixture(params=DEVICES)
def device(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="session")
def model() -> fw.Model:
    return fw.Model.from_file(MODEL)


@pytest.fixture(scope="session")
def pad() -> fw.Pad:
    return fw.Pad.from_file(PAD)


def disturbed_bed_path(steps: int, fingers: int) -> dict[str, Any]:
    """Reversals, noise and vibration on the depth, changing strength, spin, lift-offs, jumps, and numbers that are none."""
    random, t = np.random.default_rng(SEED), np.arange(steps)[:, None]
    phase = random.uniform(0, 150, fingers)
    shape = (steps, fingers)
    depth = 0.9 + 0.5 * np.sin(0.01 * (t + phase)) + 0.1 * np.sin(0.7 * t) + random.normal(0, 0.01, shape)
    depth[(t + 7 * np.arange(fingers)) % 700 < 12] = -0.1
    depth[(t + np.arange(fingers)) % 913 == 5] = 2.9
    path = {
        "depth_mm": depth,
        "slide_x_mm": np.where((t + phase) % 150 < 80, 0.03, -0.04) + random.normal(0, 0.002, shape),
        "slide_y_mm": random.normal(0, 0.02, shape),
        "spin_rad": random.normal(0, 0.02, shape) + np.where((t + phase) % 400 < 30, 0.03, 0),
        "strength_factor": random.uniform(0.05, 3, shape),
    }
    path["slide_x_mm"][::97] = np.nan
    path["depth_mm"][::131] = np.inf
    path["spin_rad"][::173] = np.nan
    path["slide_y_mm"][::501] = 70
    return {name: values.astype(np.float32) for name, values in path.items()}


def disturbed_pad_path(steps: int, fingers: int) -> dict[str, Any]:
    """A press, slides, spins, rolling and lift-offs in poses that change, noise, changing strength, and numbers that are none."""
    random, shape = np.random.default_rng(SEED), (steps, fingers)
    t = np.arange(steps)[:, None] + random.integers(0, 200, fingers)
    depth = np.minimum(np.arange(steps)[:, None] / 60, 1.4) + 0.1 * np.sin(0.2 * t) + random.normal(0, 0.002, shape)
    depth[t % 300 < 8] = -0.1
    path = {
        "depth_mm": depth,
        "slide_x_mm": np.where(t % 150 < 80, 0.03, -0.04) + random.normal(0, 0.002, shape),
        "slide_y_mm": random.normal(0, 0.01, shape),
        "spin_rad": np.where(t % 90 < 30, 0.005, 0.0),
        "strength_factor": np.where(t < 250, 1, random.uniform(0.5, 2, shape)),
        "pitch_deg": 35 + 12 * np.sin(t / 60) + np.zeros(shape),
        "roll_deg": 10 * np.cos(t / 45) + np.zeros(shape),
    }
    path["pitch_deg"][149::149] = 85
    for name, every in {"slide_x_mm": 97, "depth_mm": 131, "pitch_deg": 163, "roll_deg": 167}.items():
        path[name][every::every] = np.nan
    return {name: values.astype(np.float32) for name, values in path.items()}


def follow(fingers: Any, path: dict[str, Any], **options: Any) -> Any:
    """The responses of fingers of either package along a path: a structured array of shape (steps, fingers)."""
    steps = len(path["depth_mm"])
    responses = []
    for k in range(steps):
        response = fingers.step(**{name: values[k] for name, values in path.items()}, **options)
        responses.append(response.numpy() if isinstance(response, fw.Response) else response)
    return np.array(responses)


def differences(found: Any, expected: Any, names: tuple[str, ...]) -> Any:
    """The largest difference of the named numbers in each step of each finger."""
    return np.max([np.abs(found[name].astype(np.float64) - expected[name]) for name in names], axis=0)
