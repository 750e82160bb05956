"""The scene of google-deepmind/mujoco#3328: MuJoCo's own contact creeps as its reporter found, fingertips hold the rod. The first table of the page."""

import pathlib
import re

import creep
import pytest
import scenes

PAGE = (pathlib.Path(__file__).resolve().parents[3] / "docs" / "my-simulation-mujoco.md").read_text()


def on_page(name):
    """The creep that the page states, um/s."""
    [stated] = re.findall(rf"^\| {re.escape(name)} \| (?:below )?([\d.]+) \|", PAGE, re.MULTILINE)
    return float(stated)


@pytest.mark.parametrize("name", creep.OPTIONS)
def test_mujocos_own_contact_creeps_as_the_page_states(name):
    found = creep.creep(name, watch_s=0.5)
    assert found["creep_um_s"] == pytest.approx(on_page(name), rel=0.1) and found["limit_over_weight"] > 10, found


@pytest.mark.parametrize("model_file", ["fingertip-pad.fpm", "silicone-dome-pad.fpm"])
def test_fingertips_hold_the_rod(model_file):
    found = creep.creep(creep.FINGERTIPS, model_file=scenes.MODELS / model_file)
    assert abs(found["creep_um_s"]) < on_page(creep.FINGERTIPS) and 0 < found["sag_mm"] < 2, found
    assert found["normal_force_n"] == pytest.approx(1.0, abs=0.1) and found["limit_over_weight"] > 2, found
