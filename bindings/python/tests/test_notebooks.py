"""The example notebooks run, and their pictures are made."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

# Packages of the nightly tests.
nbclient = pytest.importorskip("nbclient")
nbformat = pytest.importorskip("nbformat")
pytestmark = pytest.mark.nightly
NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))


def pictures(notebook: Any) -> int:
    """Pictures among the outputs."""
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    return sum(not {"image/png", "image/svg+xml"}.isdisjoint(output.get("data", {})) for output in outputs)


def test_there_are_four() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["contact_maps", "first_diagnosis", "grips", "identification"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook(path: Path) -> None:
    notebook = nbformat.read(path, 4)
    stored = pictures(notebook)
    assert stored >= 1, "the stored notebook has no picture"
    folder = {"metadata": {"path": str(path.parent)}}
    nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3", resources=folder).execute()
    assert pictures(notebook) == stored
