"""What a finger step of a batch of 4096 costs: Python beside the same in plain Rust, one after the other on one core.

python bench/batch.py NATIVE MODEL.fpm, with NATIVE the example of this package: cargo build --release --example native
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from typing import Any

import numpy as np

import fingerpad

CONTACTS = 4096
STEPS = 400


def python(fingers: fingerpad.Fingers, outputs: Any) -> float:
    """Time of a finger step, ns: the best of five times, since other work on the machine only ever adds."""
    share = np.arange(CONTACTS, dtype=np.float32) / CONTACTS
    depth = 0.4 + 1.2 * share
    there = 0.01 + 0.02 * share
    across = np.full(CONTACTS, 0.004, np.float32)
    out = fingers.step(0.0, outputs=outputs)
    best_s = float("inf")
    for _ in range(5):
        start = time.perf_counter()
        for k in range(STEPS):
            slide = there if k % 100 < 50 else -there
            fingers.step(depth, slide, across, outputs=outputs, out=out)
        best_s = min(best_s, time.perf_counter() - start)
    return 1e9 * best_s / (CONTACTS * STEPS)


def main() -> None:
    native, model = sys.argv[1:]
    rows = [("python batch", "forces", False), ("python batch, all outputs", "all", False), ("python batch, spin", "forces", True)]
    rust = subprocess.run([native, "batch", model, str(CONTACTS), str(STEPS)], check=True, capture_output=True, text=True)
    print(json.dumps({"row": "rust batch, generic x86-64", "ns_per_step": float(rust.stdout)}))
    for row, outputs, spin in rows:
        fingers = fingerpad.Fingers(fingerpad.Model.from_file(model), CONTACTS, spin=spin)
        print(json.dumps({"row": row, "ns_per_step": round(python(fingers, outputs), 2)}))


if __name__ == "__main__":
    main()
