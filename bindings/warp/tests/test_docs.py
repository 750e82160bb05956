"""What the documents show runs and prints what they say."""

from __future__ import annotations

import contextlib
import io
import os
import re
from typing import Any

import numpy as np
import pytest
import warp as wp
from conftest import ROOT

pytestmark = pytest.mark.nightly
PAGE = ROOT / "docs/my-simulation-warp.md"


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def test_the_page_runs_and_prints_what_it_says(monkeypatch: pytest.MonkeyPatch) -> None:
    """All blocks of the page one after the other, in the repository's root."""
    monkeypatch.chdir(ROOT)
    text, names, printed = PAGE.read_text(), {}, []
    with wp.ScopedDevice("cpu"):
        for code in blocks(text, "python"):
            out: Any = io.StringIO()
            with contextlib.redirect_stdout(out):
                exec(compile(code, str(PAGE), "exec"), names)
            printed.append(out.getvalue())
    assert len(printed) == 5
    slide = names["slide"].grad.numpy()
    assert slide[0] > slide[2] > 0 and abs(slide[3]) < 1e-6, "N/mm: the stiffness while it sticks, 0 once it slips"
    shown = [block for block in blocks(text, "text") if block.startswith("friction")]
    assert len(shown) == 1
    # Warp may report that it loads its modules, in the same stream.
    said = [line for line in printed[4].splitlines() if line.startswith("friction")]
    assert said == shown[0].splitlines()


def test_the_readme_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (code,) = blocks((ROOT / "bindings/warp/README.md").read_text(), "python")
    with wp.ScopedDevice("cpu"):
        names: dict[str, Any] = {}
        exec(compile(code, "README.md", "exec"), names)
        assert names["response"].slip_margin.numpy()[0] > 0.1


def test_the_example_finds_the_grip(monkeypatch: pytest.MonkeyPatch, tmp_path: Any) -> None:
    """The gradient part for all of its objects, without the simulation: every one is met, and the core agrees."""
    monkeypatch.syspath_prepend(str(ROOT / "bindings/warp/examples"))
    import fingerpad
    import least_grip

    import fingerpad_warp as fw

    model, objects = fw.Model.from_file(ROOT / "data/models/fingertip.fpm"), least_grip.random_objects(4096)
    with wp.ScopedDevice("cpu"):
        grip_n, is_met, rounds = least_grip.least_grip(model, objects)
    assert is_met.all() and rounds < 30
    core = fingerpad.Model.from_bytes(model.to_bytes())
    for k in range(0, 4096, 64):
        load = objects["load_x_n"][k] / 2, objects["load_y_n"][k] / 2
        # The core has the band of friction on the safe side, and counts no moment.
        _, least_n, _ = core.least_grip(*load, margin=least_grip.MARGIN, strength_factor=objects["strength"][k])
        assert 0.6 * least_n < grip_n[k] < 1.15 * least_n, (k, grip_n[k], least_n)
    assert os.listdir(tmp_path) == []
    assert np.corrcoef(grip_n, np.hypot(objects["load_x_n"], objects["load_y_n"]) / objects["strength"])[0, 1] > 0.95
