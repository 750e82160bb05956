"""Cost of a step of a pad in a batch of 4096, us per contact: ``python bench/pad.py``.

The fingers press, slide back and forth, and pitch, each at its own phase. Prints lines ``body threads clock cpu``: us of the clock and of
all processors together, the least of five rounds, since other work on the machine only ever adds. With two threads each has half of the
fingers.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import fingerpad
from fingerpad import Fingers, Plane, Sphere

FINGERS = 4096
STEPS = 25
ROUNDS = 5


def ride(pad: fingerpad.Pad, body: Plane | Sphere, first: int, count: int) -> None:
    """Goes along the path with the fingers from ``first`` on."""
    t = np.arange(STEPS)[:, None] + 17 * np.arange(first, first + count) % 251
    fingers = Fingers(pad, count, body=body)
    depth, slide = 1.0 + 0.3 * np.sin(0.05 * t), np.where(t % 150 < 75, 0.02, -0.02)
    fingers.run(depth, slide, pitch_deg=30 + 8 * np.sin(0.03 * t))


def least_us(pad: fingerpad.Pad, body: Plane | Sphere, threads: int) -> tuple[float, float]:
    """Least time of a contact's step by the clock, and of processors."""
    share = FINGERS // threads
    rounds = []
    with ThreadPoolExecutor(threads) as pool:
        for _ in range(ROUNDS):
            start = time.perf_counter(), time.process_time()
            list(pool.map(lambda k: ride(pad, body, k * share, share), range(threads)))
            rounds.append((time.perf_counter() - start[0], time.process_time() - start[1]))
    clock_s, cpu_s = (min(times) for times in zip(*rounds))
    return 1e6 * clock_s / (FINGERS * STEPS), 1e6 * cpu_s / (FINGERS * STEPS)


def main() -> None:
    pad = fingerpad.Pad.shipped()
    for body in (Plane(), Sphere(20)):
        for threads in (1, 2):
            clock_us, cpu_us = least_us(pad, body, threads)
            print(f"{body} {threads} {clock_us:.2f} {cpu_us:.2f}", flush=True)


if __name__ == "__main__":
    main()
