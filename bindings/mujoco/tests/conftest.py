"""The plugin is loaded once; the examples' modules can be imported."""

import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parent / "examples")]

import fingerpad_mujoco  # noqa: E402

fingerpad_mujoco.load()
