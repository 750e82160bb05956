"""Boxes of unknown friction are lifted, examples/unknown.py."""

import pytest

pytest.importorskip("fingerpad")

import unknown

SLIPPERY = unknown.Lift(strength=0.45, mass_kg=0.08, stiffness=0.9, seed=3)


def test_the_observer_lifts_a_slippery_box_that_a_fixed_grip_drops():
    fixed = unknown.CONTROLLERS["fixed, expected strength and 50 %"]("bed", SLIPPERY)
    assert unknown.run("bed", SLIPPERY, fixed)[0]
    is_lost, slip_m, normal_n = unknown.run("bed", SLIPPERY, unknown.Stroked())
    assert not is_lost and slip_m < 1e-3, slip_m
    assert normal_n < 1.8 * unknown.least_n("bed", SLIPPERY), normal_n


@pytest.mark.nightly
def test_the_least_grip_is_the_least():
    """A box is dropped below it, slides at it, and stays above it."""
    least = unknown.least_n("bed", SLIPPERY)
    assert unknown.run("bed", SLIPPERY, unknown.Fixed(0.9 * least))[0]
    is_lost, slip_m, _ = unknown.run("bed", SLIPPERY, unknown.Fixed(1.1 * least))
    assert not is_lost and slip_m < 1e-4, slip_m


@pytest.fixture(scope="module")
def compared():
    lifts = unknown.drawn(20, 1)
    seen = unknown.compared("bed", lifts)
    print(unknown.table(seen, len(lifts)))
    return seen


def half(of):
    return sorted(of["ratios"])[len(of["ratios"]) // 2]


@pytest.mark.nightly
def test_an_observer_drops_less_than_a_fixed_grip_and_presses_less_than_a_safe_one(compared):
    stroked, without, expected, weakest, rate, known = compared.values()
    assert known["drops"] == 0 and half(known) == pytest.approx(1.1, abs=0.02)
    assert stroked["drops"] == without["drops"] == weakest["drops"] == 0
    assert expected["drops"] >= 4 and rate["drops"] >= 1
    assert half(stroked) < 1.6 and max(stroked["slips_m"]) < 1e-3
    assert 1.2 * half(stroked) < half(expected) < half(without) < half(weakest)
