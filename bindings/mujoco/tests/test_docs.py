"""The lines in docs/my-simulation-mujoco.md run, and print what the page shows up to the model's numbers."""

import pathlib
import re
import subprocess
import sys

import pytest

import fingerpad_mujoco

ROOT = pathlib.Path(__file__).resolve().parents[3]
PAGE = (ROOT / "docs" / "my-simulation-mujoco.md").read_text()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("model_file", ["fingertip.fpm", "fingertip-pad.fpm"])
def test_the_page_runs(model_file, own_folder):
    for name in ("bindings", "data"):
        (own_folder / name).symlink_to(ROOT / name)
    [scene], [program] = blocks("xml"), blocks("python")
    (own_folder / "finger.xml").write_text(scene.replace("fingertip.fpm", model_file))
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert ran.returncode == 0, ran.stderr

    def shape(text):
        return re.sub(r"\d+\.\d+", "#", text)

    assert shape(ran.stdout) == shape(blocks("text")[0])
    margins = [float(line.split()[-1]) for line in ran.stdout.splitlines()]
    assert margins == sorted(margins, reverse=True) and margins[0] > 0.9


def test_every_attribute_and_the_number_of_outputs_are_told():
    source = (ROOT / "bindings" / "mujoco" / "src" / "settings.c").read_text()
    names = re.findall(r'^    "(\w+)",$', source, re.MULTILINE)
    assert len(names) == 13
    assert [name for name in names if f"`{name}`" not in PAGE] == []
    header = (ROOT / "bindings" / "mujoco" / "src" / "contact.h").read_text()
    assert int(re.search(r"OUTPUT_NUMBERS (\d+)", header).group(1)) == len(fingerpad_mujoco.OUTPUTS)
    assert f"{len(fingerpad_mujoco.OUTPUTS)} numbers a geom" in PAGE
