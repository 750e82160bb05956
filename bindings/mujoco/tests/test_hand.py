"""A whole hand, examples/hand.py: the hand of mujoco-menagerie from the folder MENAGERIE_ROOT. Nothing is downloaded."""

import os

import hand
import pytest

pytestmark = pytest.mark.skipif("MENAGERIE_ROOT" not in os.environ, reason="no folder of mujoco_menagerie in MENAGERIE_ROOT")

#: Pulls, N, at which the objects slip at 1 ms.
PULLS_N = {"block": 4.86, "bottle": 4.08, "pen": 4.04, "card": 6.31}


@pytest.mark.nightly
@pytest.mark.parametrize("timestep", [0.001, 0.002, 0.004])
@pytest.mark.parametrize("name", hand.OBJECTS)
def test_a_hand_lifts_an_object_and_lets_it_slip(name, timestep):
    seen = hand.run(name, hand.Margin(), timestep)
    # Two seconds of closing, lifting and holding: the margin stays. Then a string pulls until the object is lost.
    assert min(seen["margin"][: round(0.8 / timestep)]) > 0.2 and seen["lost"], seen
    assert seen["is_finite"] and seen["warnings"] == 0 and seen["speed_m_s"] < 0.5, seen
    # Whatever slips has a small margin.
    assert 0 <= seen["margin_at_slip"] <= 0.1, seen
    assert seen["pull_n"] == pytest.approx(PULLS_N[name], rel=0.1), seen


@pytest.mark.nightly
@pytest.mark.parametrize("name", hand.OBJECTS)
def test_the_controller_needs_less_force_than_a_fixed_grip(name):
    numbers = hand.compared(name)
    assert numbers["margin"] > 0.2 and numbers["force_n"] < 0.97 * numbers["fixed_n"], numbers


@pytest.mark.nightly
def test_a_grip_that_is_too_weak_drops_the_block():
    seen = hand.run("block", lambda contacts, dt: 0.1)
    assert seen["lost"] and seen["pull_n"] < 0.5, seen
