"""Warp's tape through steps of a bed, against finite differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import warp as wp
from conftest import SEED

import fingerpad_warp as fw

pytestmark = pytest.mark.nightly
COUNT = 256
OUTPUTS = ("normal_force_n", "friction_x_n", "friction_y_n", "spin_moment_n_mm", "slip_margin", "stick_ratio", "friction_limit_n")
#: Step of the finite differences to either side: mm, rad, and of the strength factor.
STEP = 1e-3


def motions(spin: bool) -> dict[str, Any]:
    random = np.random.default_rng(SEED)
    # A third sticks, a third slips in part, a third slips.
    slide = np.resize([0.05, 0.5, 4.0], COUNT)
    out = {
        "depth_mm": random.uniform(0.6, 1.6, COUNT),
        "slide_x_mm": slide * random.normal(0, 1, COUNT),
        "slide_y_mm": slide * random.normal(0, 1, COUNT),
        "strength_factor": random.uniform(0.7, 1.3, COUNT),
    }
    return out | ({"spin_rad": random.normal(0, 0.1, COUNT)} if spin else {})


def third_step(model: fw.Model, device: str, motion: dict[str, Any], requires_grad: bool) -> tuple[Any, Any, Any]:
    """A press, a slide, and a step with this motion, in contacts that stick, slip in part and slip."""
    fingers = fw.Fingers(model, COUNT, spin="spin_rad" in motion, device=device, requires_grad=requires_grad)
    arrays = {
        name: wp.array(value.astype(np.float32), dtype=float, device=device, requires_grad=requires_grad)
        for name, value in motion.items()
    }
    start = motions(False)["depth_mm"]
    tape = wp.Tape()
    with tape:
        fingers.step(0.8 * start)
        fingers.step(1.05 * start, 0.1, 0.05)
        response = fingers.step(**arrays)
    return tape, arrays, response


@pytest.mark.parametrize("spin", [False, True], ids=["plain", "spin"])
def test_against_finite_differences(model: fw.Model, device: str, spin: bool) -> None:
    """Within 1e-3 of the largest derivative of that output, where the differences to either side agree that there is no kink."""
    motion = motions(spin)
    tape, arrays, response = third_step(model, device, motion, True)
    here = response.numpy()
    regimes = np.bincount(here["regime"], minlength=4)
    assert (regimes[1:] > 5).all(), f"sticking, slipping in part and slipping: {regimes}"
    beside = {
        name: [third_step(model, device, motion | {name: motion[name] + by}, False)[2].numpy() for by in (STEP, -STEP)]
        for name in motion
    }
    compared, worst = 0, 0.0
    for row, out in enumerate(fw.Response.OUTPUTS):
        if out not in OUTPUTS:
            continue
        seed = np.zeros(response.values.shape, np.float32)
        seed[row] = 1
        tape.zero()
        tape.backward(grads={response.values: wp.array(seed, dtype=float, device=device)})
        sides = {
            name: [(end[out].astype(np.float64) - here[out]) / by for end, by in zip(ends, (STEP, -STEP), strict=True)]
            for name, ends in beside.items()
        }
        largest = max(np.abs(side).max() for each in sides.values() for side in each)
        for name, (up, down) in sides.items():
            found = arrays[name].grad.numpy()
            assert np.isfinite(found).all(), (out, name)
            smooth = np.abs(up - down) < 1.5e-3 * largest
            off = np.abs(found - (up + down) / 2)[smooth] / largest
            compared, worst = compared + off.size, max(worst, off.max())
            assert off.max() < 1e-3, f"seed {SEED}: {out} by {name} is off by {off.max():.1e} of the largest derivative"
    print(f"{compared} derivatives, the largest error is {worst:.1e} of the largest derivative")
    assert compared > 0.8 * len(OUTPUTS) * COUNT * len(motion), compared / (len(OUTPUTS) * COUNT * len(motion))


def test_through_many_steps(model: fw.Model, device: str) -> None:
    """The derivative of friction by the slide of every one of 20 steps."""
    slides = [wp.full(8, 0.02, dtype=float, device=device, requires_grad=True) for _ in range(20)]
    depth = np.linspace(0.6, 2.0, 8)

    def friction(changed: int | None = None, by: float = 0.0, requires_grad: bool = False) -> tuple[Any, Any]:
        fingers = fw.Fingers(model, 8, device=device, requires_grad=requires_grad)
        tape = wp.Tape()
        with tape:
            fingers.step(depth)
            for k, slide in enumerate(slides):
                moved = slide.numpy() + (by if k == changed else 0)
                response = fingers.step(depth, slide if requires_grad else moved)
        return tape, response

    tape, response = friction(requires_grad=True)
    seed = np.zeros(response.values.shape, np.float32)
    seed[response.OUTPUTS.index("friction_x_n")] = 1
    tape.backward(grads={response.values: wp.array(seed, device=device)})
    for k in (0, 7, 19):
        ends = [friction(k, by)[1].numpy()["friction_x_n"].astype(np.float64) for by in (2e-3, -2e-3)]
        np.testing.assert_allclose(slides[k].grad.numpy(), (ends[0] - ends[1]) / 4e-3, atol=2e-3 * 0.5)


def test_where_nothing_moves_there_is_no_nan(model: fw.Model, device: str) -> None:
    """A fresh contact, one in the air, one at rest: square roots of 0 on the way."""
    fingers = fw.Fingers(model, 3, spin=True, device=device, requires_grad=True)
    depth = wp.array([1.0, -0.5, 1.5], dtype=float, device=device, requires_grad=True)
    tape = wp.Tape()
    with tape:
        fingers.step(depth)
        response = fingers.step(depth)
    tape.backward(grads={response.values: wp.full(response.values.shape, 1.0, dtype=float, device=device)})
    assert np.isfinite(depth.grad.numpy()).all(), depth.grad


def test_a_pad_refuses_gradients(pad: fw.Pad, device: str) -> None:
    with pytest.raises(fw.InputError, match="requires_grad: True, but steps of a pad have no adjoint"):
        fw.Fingers(pad, device=device, requires_grad=True)


def test_an_array_that_would_get_no_gradient_is_refused(model: fw.Model, pad: fw.Pad, device: str) -> None:
    depth = wp.full(2, 1.0, dtype=float, device=device, requires_grad=True)
    for source in (model, pad):
        with pytest.raises(fw.InputError, match="depth_mm: an array that requires a gradient, but the fingers were made with"):
            fw.Fingers(source, 2, device=device).step(depth)
