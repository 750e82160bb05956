"""Cost of one step of one contact, us: ``python bench/step.py``.

The finger is pressed to 1 mm and slides by 1 um a step. Prints lines ``what least median`` over 100 rounds of 1000 steps; the least is
the cost of the call itself, the median that on this machine with its other work.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import fingerpad
from fingerpad import Finger, Fingers, Model, Pad, Sphere

ROUNDS = 100
STEPS = 1000


def times_us(step: Callable[[], object]) -> tuple[float, float]:
    """Least and median time of a call."""
    rounds = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        for _ in range(STEPS):
            step()
        rounds.append(1e6 * (time.perf_counter() - start) / STEPS)
    return min(rounds), statistics.median(rounds)


def pressed(finger: Finger | Fingers) -> Finger | Fingers:
    for k in range(1, 21):
        finger.step(k / 20)
    return finger


def main() -> None:
    bed, pad = Model.shipped(), Pad.shipped()
    cases: dict[str, Finger | Fingers] = {
        "Finger of a bed": Finger(bed),
        "Finger of a bed with spin": Finger(bed, spin=True),
        "Finger of a pad on a plane": Finger(pad),
        "Finger of a pad on a ball": Finger(pad, body=Sphere(20)),
        "Fingers of a bed, one": Fingers(bed, 1),
        "Fingers of a pad on a plane, one": Fingers(pad, 1),
    }
    print(f"fingerpad {fingerpad.__version__}")
    for name, finger in cases.items():
        step = pressed(finger).step
        least, median = times_us(lambda: step(1.0, 1e-3))
        print(f"{name:33} {least:6.2f} {median:6.2f}", flush=True)


if __name__ == "__main__":
    main()
