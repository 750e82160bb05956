"""Objects that are turned, rolled and pulled between two pads, against the model alone and against rolling without slip."""

import hold
import pytest
import scenes

pytestmark = pytest.mark.nightly


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6])
def test_a_torque_about_the_pinch_axis_meets_the_moment_of_the_pad(share):
    pivot = hold.pivot(share, turn_rad=0.5, model_file=scenes.PAD_FILE, grip_n=1.0)
    assert pivot["moment_n_mm"] == pytest.approx(pivot["own_n_mm"], rel=0.03)
    assert pivot["slip_margin"] == pytest.approx(pivot["own_slip_margin"], abs=0.03)


def test_friction_takes_the_moment_away():
    # On the limit surface: the more friction, the less moment.
    moments = [hold.pivot(share, turn_rad=0.5, model_file=scenes.PAD_FILE, grip_n=1.0)["moment_n_mm"] for share in (0.0, 0.6, 0.85)]
    assert 0.55 < moments[1] / moments[0] < 0.75 and moments[2] < 0.3 * moments[0], moments


@pytest.mark.parametrize(
    "held, grip_n, way_mm, error",
    [("pen", 0.5, 1.0, 0.11), ("pen", 1.0, 1.0, 0.12), ("tube", 0.5, 2.0, 0.05), ("tube", 1.0, 2.0, 0.08)],
)
def test_a_round_object_rolls_between_two_fingers(held, grip_n, way_mm, error):
    rolled = hold.rolled(held, grip_n, way_mm)
    assert rolled["turn_rad"] == pytest.approx(rolled["rolling_rad"], rel=error) and rolled["turn_rad"] > 0.15, rolled
    assert abs(rolled["left_rad"]) < 0.02 and rolled["slip_margin"] > 0.5, rolled


@pytest.mark.parametrize("grip_n", [0.5, 1.0, 2.0])
def test_a_card_slides_out_against_the_friction_of_both_pads(grip_n):
    pulled = hold.pulled(grip_n)
    assert pulled["force_n"] == pytest.approx(pulled["limits_n"], rel=0.03), pulled
    assert pulled["normal_forces_n"] == pytest.approx([grip_n, grip_n], rel=0.02), pulled


@pytest.mark.parametrize("grip_n", [0.5, 1.0])
def test_a_card_slides_out_of_a_fan_off_the_other_card(grip_n):
    # The finger on the card that stays holds the friction of card on card, the other finger slips at its limit.
    fan = hold.fanned(grip_n, friction=0.2)
    assert fan["normal_forces_n"] == pytest.approx([grip_n, grip_n], rel=0.01), fan
    assert fan["held_n"] == pytest.approx(0.2 * grip_n, rel=0.01) and fan["slid_n"] == pytest.approx(fan["limit_n"], rel=0.01), fan
    assert fan["force_n"] == pytest.approx(fan["limit_n"] + 0.2 * grip_n, rel=0.02), fan
