"""The lines of Python in the documents run, and print what stands below them."""

from __future__ import annotations

import contextlib
import io
import os
import re
from pathlib import Path

import pytest

from fingerpad import _native

#: Calls that run the program.
COMMANDS = re.compile(r"fingerpad\.(simulate|identify|finger|diagnose)")


@pytest.mark.parametrize("page", ["docs/my-python.md", "bindings/python/README.md"])
def test_lines_run(root: Path, page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "data").symlink_to(root / "data")
    monkeypatch.chdir(tmp_path)
    has_program = _native.HAS_PROGRAM or "FINGERPAD_PROGRAM" in os.environ
    blocks = re.findall(r"^```python\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?", (root / page).read_text(), re.DOTALL | re.MULTILINE)
    assert blocks
    names: dict[str, object] = {}
    for block, expected in blocks:
        if COMMANDS.search(block) and not has_program:
            continue
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            exec(compile(block, page, "exec"), names)
        if expected:
            assert said.getvalue() == expected, block
