"""Pads whose tissue relaxes: against the sum of their branches, on light objects, in a grip."""

import hold
import numpy as np
import paths
import pytest
from paths import PAD
from test_light import lifts

ASSUMED = ((1.0, 0.004), (0.6, 0.07), (0.6, 1.4))


def held_at(depth_mm, steps, **attributes):
    """Normal forces of a pad that comes to a depth within one step and stays, N."""
    path = np.zeros((steps + 1, 6))
    path[0, 0], path[1:, 0] = -0.1, depth_mm
    return np.array([c["normal_force_n"] for c in paths.lead_along(path, paths.pad_at, **PAD, **attributes)])[1:]


@pytest.mark.parametrize("relaxation, branches", [("human-assumed", ASSUMED), ("0.5:0.02 2:0.3", ((0.5, 0.02), (2.0, 0.3)))])
def test_a_hold_falls_as_the_branches(relaxation, branches):
    steps = 400
    forces, relaxed = held_at(0.8, steps, relaxation=relaxation), held_at(0.8, 1)[0]
    time_s = 1e-3 * np.arange(1, steps + 1)
    expected = 1 + sum(share * np.exp(-time_s / tau_s) for share, tau_s in branches)
    assert np.abs(forces / relaxed / expected - 1).max() < 3e-3
    assert held_at(0.8, 2, relaxation="none") == pytest.approx(relaxed, rel=1e-4)


def test_tissue_recovers_in_the_air_and_remembers_as_well_far_away():
    def again(away_mm, steps):
        """Normal force at touch, after 40 steps, and at touch after some steps in the air, N."""
        path = np.zeros((43 + steps, 6))
        path[:, 0] = -0.1
        path[1:40, 0] = path[-1, 0] = 0.8
        path[41:-2, 0] = -away_mm
        contacts = paths.lead_along(path, paths.pad_at, **PAD, relaxation="0.5:0.05")
        return [contacts[k]["normal_force_n"] for k in (1, 39, -1)]

    first, held, near = again(0.2, 20)
    assert held < 0.9 * first and near < 0.96 * first
    assert again(30.0, 20)[2] == pytest.approx(near, rel=1e-3)
    assert again(30.0, 1000)[2] == pytest.approx(first, rel=2e-3)


def test_light_blocks_are_lifted():
    for mass, timestep in ((0.001, 0.004), (0.005, 0.004), (0.005, 0.001)):
        lifts(mass, timestep, (0.8, 1.9), relaxation="human-assumed")


@pytest.mark.parametrize("timestep", [0.001, 0.004])
def test_a_held_block_creeps_and_comes_to_rest(timestep):
    held = hold.held_by_pads("block", 1.0, timestep, 20.0, relaxation="human-assumed")
    assert held["normal_force_n"] == pytest.approx(1.0, rel=0.01) and held["flags"] == [], held
    still = hold.held_by_pads("block", 1.0, timestep, 5.0)
    assert held["drift_um_s"] < 1 and held["sag_mm"] == pytest.approx(still["sag_mm"], rel=0.2), (held, still)
