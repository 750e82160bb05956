"""Cost of a finger's step in a batch of 4096, ns: ``python bench/path.py MODEL.fpm < path``.

A line of the path is a step: depth, slide along x and y, spin. Finger ``i`` begins at row 17 i. Prints lines ``step ns`` and
``spin_step ns``, the least of five rounds, since other work on the machine only ever adds.
"""

from __future__ import annotations

import sys
import time

import numpy as np
import numpy.typing as npt

import fingerpad

FINGERS = 4096
STEPS = 400
ROUNDS = 5


def least_ns(model: fingerpad.Model, path: npt.NDArray[np.float32], *, spin: bool) -> float:
    """Least time of a finger's step over ``path``, an array of steps by fingers by four numbers."""
    least_s = float("inf")
    for _ in range(ROUNDS):
        fingers = fingerpad.Fingers(model, FINGERS, spin=spin)
        out = fingers.step(0.0)
        start = time.perf_counter()
        for depth, x, y, turn in path:
            fingers.step(depth, x, y, turn if spin else 0.0, out=out)
        least_s = min(least_s, time.perf_counter() - start)
    return 1e9 * least_s / (FINGERS * STEPS)


def main() -> None:
    rows = np.loadtxt(sys.stdin, dtype=np.float32)
    row = (np.arange(STEPS)[:, None] + 17 * np.arange(FINGERS)) % len(rows)
    path = np.ascontiguousarray(rows[row].transpose(0, 2, 1))
    model = fingerpad.Model.from_file(sys.argv[1])
    print(f"step {least_ns(model, path, spin=False):.2f}")
    print(f"spin_step {least_ns(model, path, spin=True):.2f}")


if __name__ == "__main__":
    main()
