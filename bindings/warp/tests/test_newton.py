"""Fingertips in Newton: four worlds hold a block; resets, misuse; and Newton's own contact with exported parameters. In an environment of its own, as
Newton asks for other versions of MuJoCo."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import warp as wp
from conftest import DEVICES, ROOT

import fingerpad_warp as fw

newton = pytest.importorskip("newton")
pytestmark = pytest.mark.nightly
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
import newton_hold  # noqa: E402

from fingerpad_warp.newton import attach  # noqa: E402


PAGE = ROOT / "docs/my-simulation-warp.md"


@pytest.fixture(params=DEVICES, autouse=True)
def on_device(request: pytest.FixtureRequest) -> Any:
    with wp.ScopedDevice(request.param):
        yield request.param


@pytest.mark.parametrize("kind", ["bed", "pad"])
def test_four_worlds_carry_the_weight(model: fw.Model, pad: fw.Pad, kind: str) -> None:
    """The fingers of three worlds carry the weight within 1e-3 and the block stays; the fourth grip is too small and it falls."""
    hold = newton_hold.Hold(model if kind == "bed" else pad)
    hold.seconds(0.4)
    hold.set_gravity(newton_hold.GRAVITY)
    hold.seconds(2.0)
    before = hold.height_mm()
    hold.seconds(0.4)
    answer, weight_n = hold.contacts.read(), newton_hold.MASS_KG * newton_hold.GRAVITY
    carried = hold.contacts._wrench.numpy()[:, :, 2].sum(axis=1) / -weight_n
    print(f"{kind}: carried over the weight, less 1: {carried[:3] - 1}, fall in 0.4 s, mm: {before - hold.height_mm()}")
    np.testing.assert_allclose(carried[:3], 1, atol=1e-3)
    np.testing.assert_allclose(before[:3], hold.height_mm()[:3], atol=1e-3)
    assert (answer["status"][:3] == 0).all() and (answer["slip_margin"][:3] > 0.3).all()
    assert before[3] - hold.height_mm()[3] > 100


def test_worlds_that_are_reset_begin_anew(model: fw.Model) -> None:
    """A world that is reset goes again through the same steps to the bit; the others keep the memory of their contacts."""
    hold = newton_hold.Hold(model, (0.6, 0.6))
    hold.seconds(0.1)
    first = hold.contacts.read()["friction_x_n"]
    mask = wp.array([True, False, False], dtype=bool)
    hold.solver.reset(hold.now, mask)
    hold.contacts.reset(mask)
    hold.seconds(0.1)
    second = hold.contacts.read()["friction_x_n"]
    np.testing.assert_array_equal(second[0], first[0])
    assert (second[1] != first[1]).any()
    hold.solver.reset(hold.now)
    hold.contacts.reset()
    hold.seconds(0.1)
    np.testing.assert_array_equal(hold.contacts.read()["friction_x_n"], first)


def test_the_page_shows_what_the_example_prints(capsys: pytest.CaptureFixture[str]) -> None:
    newton_hold.main()
    said = [line for line in capsys.readouterr().out.splitlines() if line.startswith("grip")]
    shown = [block for block in re.findall(r"```text\n(.*?)```", PAGE.read_text(), re.DOTALL) if block.startswith("grip 0.6 N")]
    assert [block.splitlines() for block in shown] == [said]


def test_misuse_is_named(model: fw.Model) -> None:
    hold = newton_hold.Hold(model, (0.6,))
    for contacts, text in (
        ([("thumb", "*block")], "the solver has no site with the label 'thumb'"),
        ([("*left_tip", "*finger")], "the solver has no geom with the label '.finger'; the solver leaves out"),
        ([("*tip", "*block")], "the label '.tip' matches 2 sites: .*left_tip, .*right_tip"),
    ):
        with pytest.raises(fw.InputError, match=text):
            attach(model, hold.solver, contacts, 0.004)
    with pytest.raises(fw.InputError, match="dt_s: 0 is not between"):
        attach(model, hold.solver, newton_hold.FINGERS, 0)
    with pytest.raises(fw.InputError, match="dt_s: 0.002 s at attach, but the solver steps by 0.004 s"):
        attach(model, hold.solver, newton_hold.FINGERS, 0.002)
        hold.seconds(0.004)
    with pytest.raises(fw.InputError, match="use_mujoco_cpu=False"):
        attach(model, newton.solvers.SolverMuJoCo(hold.model, use_mujoco_cpu=True), newton_hold.FINGERS, 0.004)


#: So much that it does not roll.
INERTIA_KG_M2 = 1e3


def pressed(stated: Any, load_n: float, pull_n: float, turn_n_m: float) -> tuple[float, Any]:
    """Depth, mm, after a second, of a sphere with exported parameters that is pressed, pulled and turned on a plane, and its speeds then and 0.1 s before."""
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    cfg = newton.ModelBuilder.ShapeConfig(density=0.0, **{name: stated[name] for name in ("ke", "kd", "kf", "mu")})
    builder.add_ground_plane(cfg=cfg)
    tip = builder.add_body(mass=1 / stated["inverse_mass_per_kg"], inertia=wp.mat33(np.eye(3) * INERTIA_KG_M2), lock_inertia=True)
    builder.add_shape_sphere(tip, radius=0.008, xform=wp.transform((0.0, 0.0, 0.008), wp.quat_identity()), cfg=cfg)
    model, seen, dt_s = builder.finalize(), [], 2e-4
    solver, pipeline = newton.solvers.SolverSemiImplicit(model, angular_damping=0.0), newton.CollisionPipeline(model)
    now, then, control, contacts = model.state(), model.state(), model.control(), pipeline.contacts()
    for k in range(5000):
        now.body_f.assign(np.array([[pull_n, 0, -load_n, 0, 0, turn_n_m]], np.float32))
        pipeline.collide(now, contacts)
        solver.step(now, then, control, contacts, dt_s)
        now, then = then, now
        if k in (4499, 4999):
            seen.append(now.body_qd.numpy()[0][[0, 5]])
    return -1e3 * now.body_q.numpy()[0, 2], seen


@pytest.mark.parametrize("tip", ["fingertip", "silicone-dome"])
def test_newtons_own_contact_has_the_stated_depth_limit_and_creep(tip: str) -> None:
    """The parameters that `fingerpad export --format newton-contact-json` wrote; a test of the program holds that the files are what it writes."""
    stated = json.loads((Path(__file__).parent / f"newton_{tip}.json").read_text())
    limit_n = stated["friction_limits_n"][len(stated["loads_n"]) // 2]
    for at in (0, -1):
        depth_mm, _ = pressed(stated, stated["loads_n"][at], 0, 0)
        assert depth_mm * (1 + stated["normal_force_errors"][at]) == pytest.approx(stated["depths_mm"][at], rel=1e-3)
    depth_mm, (early, late) = pressed(stated, stated["load_n"], limit_n / 2, 1.0)
    assert depth_mm == pytest.approx(stated["depth_mm"], rel=1e-3)
    assert late[0] == pytest.approx(stated["creep_at_half_limit_m_per_s"], rel=1e-3)
    # No moment holds against a turn.
    assert late[1] - early[1] == pytest.approx(0.1 / INERTIA_KG_M2, rel=0.02)
    gain = {}
    for share in (0.95, 1.05):
        _, (early, late) = pressed(stated, stated["load_n"], share * limit_n, 0)
        gain[share] = late[0] - early[0]
    assert abs(gain[0.95]) < 1e-3 * gain[1.05] and gain[1.05] > 0.05, gain
