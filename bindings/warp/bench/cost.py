"""What a contact costs: nanoseconds of a step in batches, on a device, beside the package `fingerpad` where that is installed.

    python bench/cost.py [--device cpu] [--contacts 4096] [--rounds 15]

Medians over rounds in which the cases take turns. On the CPU the time is that of the process, on a GPU that between two events.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

import fingerpad_warp as fw

MODELS = Path(__file__).resolve().parents[3] / "data/models"
#: Steps of a round.
STEPS = 20


def motion(count: int, noise_mm: float, pad: bool, spin: bool) -> list[dict[str, Any]]:
    """Pressed contacts that slide on, with noise on depth and slide; of a pad in a pose that changes."""
    random = np.random.default_rng(1)
    base = random.uniform(0.6, 1.6, count)
    out = []
    for k in range(STEPS):
        noise = noise_mm * random.standard_normal((3, count))
        step = {"depth_mm": base + noise[0], "slide_x_mm": 0.01 + noise[1], "slide_y_mm": noise[2]}
        if spin or pad:
            step["spin_rad"] = np.full(count, 1e-3)
        if pad:
            step["pitch_deg"], step["roll_deg"] = np.full(count, 30 + 0.2 * k), np.full(count, 0.1 * k)
        out.append({name: values.astype(np.float32) for name, values in step.items()})
    return out


def on_warp(fingers: fw.Fingers, steps: list[dict[str, Any]]) -> Callable[[], float]:
    """A round on a device: seconds of its steps, arrays being there already."""
    device = fingers.device
    arrays = [{name: wp.array(values, dtype=float, device=device) for name, values in step.items()} for step in steps]
    fingers.step(**arrays[0])

    def on_cpu() -> float:
        start = time.process_time()
        for step in arrays:
            fingers.step(**step)
        return time.process_time() - start

    def on_gpu() -> float:
        start, end = (wp.Event(device, enable_timing=True) for _ in range(2))
        wp.record_event(start)
        for step in arrays:
            fingers.step(**step)
        wp.record_event(end)
        return wp.get_event_elapsed_time(start, end) / 1e3

    return on_gpu if device.is_cuda else on_cpu


def with_gradient(model: fw.Model, count: int, device: str, steps: list[dict[str, Any]]) -> Callable[[], float]:
    """A round of steps on a tape and the way back through them."""

    def go() -> float:
        fingers = fw.Fingers(model, count, device=device, requires_grad=True)
        arrays = [
            {name: wp.array(values, dtype=float, device=device, requires_grad=True) for name, values in step.items()} for step in steps
        ]
        wp.synchronize_device(device)
        clock = time.perf_counter if fingers.device.is_cuda else time.process_time
        start, tape = clock(), wp.Tape()
        with tape:
            for step in arrays:
                response = fingers.step(**step)
        tape.backward(grads={response.values: wp.full(response.values.shape, 1.0, dtype=float, device=device)})
        wp.synchronize_device(device)
        return clock() - start

    return go


def on_core(make: Callable[[Any], Any], steps: list[dict[str, Any]]) -> Callable[[], float] | None:
    """A round of the package `fingerpad`."""
    try:
        import fingerpad
    except ImportError:
        return None
    fingers = make(fingerpad)

    def go() -> float:
        start = time.process_time()
        for step in steps:
            fingers.step(**step, outputs="all")
        return time.process_time() - start

    return go


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--device", default=None)
    parser.add_argument("--contacts", type=int, default=4096)
    parser.add_argument("--rounds", type=int, default=15)
    options = parser.parse_args()
    device, count = str(wp.get_device(options.device)), options.contacts
    bed, pad = fw.Model.from_file(MODELS / "fingertip.fpm"), fw.Pad.from_file(MODELS / "fingertip-pad.fpm")
    cases: dict[tuple[str, str], Callable[[], float] | None] = {}

    def add(name: str, steps: list[dict[str, Any]], ours: fw.Fingers, make: Callable[[Any], Any]) -> None:
        cases[name, "warp"], cases[name, "core"] = on_warp(ours, steps), on_core(make, steps)

    for noise in (0.0, 0.01):
        text = f", {1e3 * noise:g} um of noise" if noise else ""
        for spin in (False, True):
            add(
                f"bed{' with spin' if spin else ''}{text}",
                motion(count, noise, False, spin),
                fw.Fingers(bed, count, spin=spin, device=device),
                lambda f, spin=spin: f.Fingers(f.Model.from_bytes(bed.to_bytes()), count, spin=spin),
            )
        for name, numbers in (("Plane", ()), ("Sphere", (20.0,))):
            add(
                f"pad on a {name.lower()}{' of 20 mm' if numbers else ''}{text}",
                motion(count, noise, True, True),
                fw.Fingers(pad, count, body=getattr(fw, name)(*numbers), device=device),
                lambda f, name=name, numbers=numbers: f.Fingers(
                    f.Pad.from_bytes(pad.to_bytes()), count, body=getattr(f, name)(*numbers)
                ),
            )
    cases["bed, a step and its way back on the tape", "warp"] = with_gradient(bed, count, device, motion(count, 0.0, False, False))
    times: dict[tuple[str, str], list[float]] = {name: [] for name, go in cases.items() if go}
    for _ in range(options.rounds):
        for name, each in times.items():
            each.append(1e9 * cases[name]() / STEPS / count)  # type: ignore[misc]
    name_of = wp.get_device(device).name
    print(f"{count} contacts on {device} ({name_of}), ns a contact and step; medians of {options.rounds} rounds\n")
    print("| | Warp | `fingerpad` on one core |\n|---|---|---|")
    for name in dict.fromkeys(name for name, _ in times):
        ours, core = times[name, "warp"], times.get((name, "core"))
        print(f"| {name} | {statistics.median(ours):.0f} | {f'{statistics.median(core):.0f}' if core else ''} |")


if __name__ == "__main__":
    main()
