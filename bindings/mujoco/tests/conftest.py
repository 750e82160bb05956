"""The examples' modules can be imported; the plugin is that of the installed package."""

import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "examples"))


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    """MuJoCo writes its warnings into a file in the working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
