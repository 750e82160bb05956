"""The kernels compile for CUDA on a machine without a GPU: NVRTC comes with Warp."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import warp as wp

from fingerpad_warp import _bed, _frames, _semi_implicit, mujoco

pytestmark = pytest.mark.nightly

#: Compute capability of an A100, the least of a data-centre GPU in common use.
ARCHITECTURE = 80


@pytest.mark.parametrize(
    "module", [lambda: _bed.step_kernel(1, False).module, lambda: _bed.step_kernel(2, False).module, lambda: _frames, lambda: mujoco,
               lambda: _semi_implicit],
    ids=["bed", "bed with spin", "frames", "mujoco", "coupling"],
)  # fmt: skip
def test_the_kernels_compile_for_cuda(module: Any, tmp_path: Path) -> None:
    wp.compile_aot_module(module(), arch=ARCHITECTURE, module_dir=tmp_path, use_ptx=True)
    made = list(tmp_path.glob("*.ptx"))
    assert made and ".entry" in made[0].read_text()
