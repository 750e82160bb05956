"""The plugin is loaded once; the examples' modules can be imported."""

import pathlib
import sys

import pytest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parent / "examples")]

import fingerpad_mujoco  # noqa: E402

fingerpad_mujoco.load()


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    """MuJoCo writes its warnings into a file in the working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
