"""The commands in docs/my-simulation-mujoco.md run, and print the output on the page up to its numbers."""

import os
import pathlib
import re
import subprocess
import sys

import pytest

import fingerpad_mujoco
import scenes
from reference import CYLINDER, SPHERE, Finger, PadFinger

ROOT = pathlib.Path(__file__).resolve().parents[3]
PAGE = (ROOT / "docs" / "my-simulation-mujoco.md").read_text()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def page_runs(python, model_file, folder):
    """The page's program on the page's scene prints what stands there, up to the numbers."""
    [scene], [program] = blocks("xml"), blocks("python")
    (folder / "finger.xml").write_text(scene.replace("fingertip-pad.fpm", model_file))
    ran = subprocess.run([python, "-W", "error", "-c", program], capture_output=True, text=True, timeout=60)
    assert ran.returncode == 0, ran.stderr

    def shape(text):
        return re.sub(r"\d+\.\d+", "#", text)

    assert shape(ran.stdout) == shape(blocks("text")[0])
    margins = [float(line.split()[-1]) for line in ran.stdout.splitlines() if "margin" in line]
    assert margins == sorted(margins, reverse=True) and margins[0] > 0.9 and len(margins) == 4


@pytest.mark.parametrize("model_file", ["fingertip.fpm", "fingertip-pad.fpm"])
def test_the_page_runs(model_file, own_folder):
    page_runs(sys.executable, model_file, own_folder)


@pytest.mark.nightly
def test_the_page_runs_where_nothing_but_the_wheel_was_installed(own_folder):
    page_runs(os.environ["FINGERPAD_WHEEL_PYTHON"], "fingertip-pad.fpm", own_folder)


def test_every_attribute_and_the_number_of_outputs_are_described():
    source = (ROOT / "bindings" / "mujoco" / "src" / "settings.c").read_text()
    names = re.findall(r'^    "(\w+)",$', source, re.MULTILINE)
    assert len(names) == 15
    assert [name for name in names if f"`{name}`" not in PAGE] == []
    header = (ROOT / "bindings" / "mujoco" / "src" / "contact.h").read_text()
    assert int(re.search(r"OUTPUT_NUMBERS (\d+)", header).group(1)) == len(fingerpad_mujoco.OUTPUTS)
    assert f"{len(fingerpad_mujoco.OUTPUTS)} numbers a geom" in PAGE
    assert [flag for flag in fingerpad_mujoco.STATUS.values() if f"`{flag}`" not in PAGE] == []


def test_the_force_ranges_of_the_page_are_those_of_the_models():
    bed, flat = Finger(scenes.MODEL_FILE), PadFinger(scenes.PAD_FILE)
    ball = PadFinger(scenes.PAD_FILE, (SPHERE, 10.0, 0.0, 0.0), (30.0, 0.0))
    pen = PadFinger(scenes.PAD_FILE, (CYLINDER, 4.0, 90.0, 0.0), (30.0, 0.0))
    for finger, name in ((bed, "bed"), (flat, "flat"), (ball, "ball"), (pen, "pen")):
        forces = [finger.step(0.05 * i) for i in range(1, 120)]
        within = max(r.normal_force_n for r in forces if r.status == 0)
        stated = float(re.search(rf"0 to ([\d.]+) N<!-- {name} -->", PAGE).group(1))
        assert stated <= within < stated + 0.15, (name, stated, within)
