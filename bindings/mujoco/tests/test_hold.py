"""The numbers of examples/hold.py: the plugin beside MuJoCo's own contact."""

import hold
import pytest


@pytest.mark.parametrize("timestep", [0.00025, 0.001, 0.004])
def test_a_held_object_does_not_creep(timestep):
    held = hold.held("fingerpad", timestep, 60.0)
    assert held["drift_um_s"] < 1e-3 and held["turn_rad_s"] < 1e-6
    assert 0.1 < held["sag_mm"] < 2.0


def test_nor_does_it_under_runge_kutta():
    held = hold.held("fingerpad", 0.001, 60.0, integrator="RK4")
    assert held["drift_um_s"] < 1e-3
    assert held["sag_mm"] == pytest.approx(hold.held("fingerpad", 0.00025, 4.0)["sag_mm"], abs=0.01)


def test_mujocos_own_contact_creeps_without_its_slip_solver():
    # What the comparison is worth: the same scene, the same measure, a contact that is known to creep.
    assert hold.held("impratio", 0.001, 10.0)["drift_um_s"] > 1.0


def test_too_weak_a_grip_slips_with_friction_at_its_limit():
    seen, expected = hold.too_weak()
    assert seen > 1.0
    # Acceleration by gravity less friction at the limit; the dampers add friction only as far as the contact sticks.
    assert seen == pytest.approx(expected, abs=0.15)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6, 0.85])
def test_a_torque_pivots_the_object_at_the_limit_surface(share):
    pivot = hold.pivot(share)
    assert pivot["moment_n_mm"] == pytest.approx(pivot["own_n_mm"], rel=0.005)
    assert pivot["slip_margin"] < 0.1


@pytest.mark.parametrize("timestep", [0.00025, 0.001, 0.004])
def test_a_shaken_object_stays_and_comes_to_rest(timestep):
    shaken = hold.disturbed("fingerpad", timestep)
    first, _, last = shaken["gone_mm"]
    assert abs(first) < 0.5 and abs(last - first) < 0.05, shaken
    assert shaken["drift_um_s"] < 1e-3


def test_saved_and_restored_it_goes_on_with_the_same_bits():
    same, _ = hold.restored()
    assert same


def test_the_cost_is_of_the_order_of_mujocos_own():
    # Generous: machines are busy. The table in the documentation has what was measured.
    times = hold.cost(rounds=5, steps=500)
    assert times["fingerpad"] < 4 * times["MuJoCo, stock"]
    assert times["fingerpad"] - times["no contact"] < 50.0
