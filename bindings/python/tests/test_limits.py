"""Limit surfaces, least grips and maps, each against another route to the same numbers."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import pytest

import fingerpad
from fingerpad import LIMIT, PRESSURE_MAP, SLIP_MAP, Cylinder, Edge, Finger, Fingers, InputError, Model, Pad, Plane, Sphere, Status, limit_surface

LOAD = ("friction_x_n", "friction_y_n", "spin_moment_n_mm")
SEED = 5


def loads(points: Any) -> Any:
    """Friction and moment, a column each."""
    return np.stack([points[name] for name in LOAD], -1).astype(float)


def slid(fingers: Fingers, depth_mm: float, motions: Any, step_mm: float, steps: int) -> Any:
    """Where a slide along each row of `motions` ends, one a finger."""
    for _ in range(steps):
        r = fingers.step(depth_mm, *(step_mm * motions.T), outputs="all")
    return r


def springs_at(data: bytes, depth_mm: float) -> dict[str, Any]:
    """Numbers of a bed at a depth, read after core/docs/fpm-format.md."""
    (count,) = struct.unpack_from("<I", data, 16)
    sections = [struct.unpack_from("<4sII", data, 20 + 12 * k) for k in range(count)]
    (start,) = (at for name, at, _ in sections if name == b"DATA")
    m, n = struct.unpack_from("<II", data, start)
    floats = np.frombuffer(data, "<f4", 19 + 5 * m + n * (31 + 4 * m), start + 8).astype(float)
    springs, rows = floats[19 : 19 + 5 * m].reshape(m, 5), floats[19 + 5 * m :].reshape(n, -1)
    cell = int(depth_mm * floats[1])
    row, t = rows[cell], depth_mm * floats[1] - cell
    line = lambda k: row[k] + t * row[k + 1]  # noqa: E731
    stiffness = [row[k] + t * (row[k + 1] + t * row[k + 2]) for k in (4, 7)]
    yields = np.array([line(31 + 2 * j) for j in range(m)])
    return {
        "share": springs[:, 0], "x": springs[:, 2], "arm": springs[:, 3:], "odd": floats[2], "stiffness": stiffness,
        "anisotropy": line(13), "tilt": line(15), "yields": yields,
    }  # fmt: skip


def steady_slip(data: bytes, depth_mm: float, motions: Any, factor: float) -> Any:
    """Friction and moment of springs that all slip, in closed form: each is displaced so far along its own motion, its friction against
    it, as its limit allows: (u_x - alpha R)^2 + (b u_y)^2 = R^2 (1 + alpha^2)."""
    s = springs_at(data, depth_mm)
    (kx, ky), tilt = s["stiffness"], s["tilt"]
    ratio, loads = ky / kx, np.zeros((len(motions), 3))
    for share, centre, arm, radius in zip(s["share"], s["x"], s["arm"], factor * s["yields"]):
        for x, y in ((centre + arm[0], arm[1]), (centre - arm[0], -arm[1])):
            way = motions[:, :2] + motions[:, 2:] * [-y, x]
            way /= np.linalg.norm(way, axis=1, keepdims=True)
            square = way[:, 0] ** 2 + (s["anisotropy"] * way[:, 1] / ratio) ** 2
            half = tilt * radius * way[:, 0]
            length = (half + np.sqrt(half**2 + square * radius**2)) / square
            ux, uy = length * way[:, 0], length * way[:, 1] / ratio
            fx, fy = 0.5 * share * kx * (ux - s["odd"] / factor * ux**2), 0.5 * share * ky * uy
            loads += np.stack([fx, fy, x * fy - y * fx], 1)
    return loads


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("depth_mm", [0.2, 1.3, 2.5])
def test_a_beds_surface_is_that_of_its_springs(model: Model, depth_mm: float, factor: float) -> None:
    points = limit_surface(model, depth_mm, strength_factor=factor).points
    expected = steady_slip(model.to_bytes(), depth_mm, loads_of_motion(points), factor)
    assert (np.abs(loads(points) - expected) < 1e-2 * np.abs(expected).max(0)).all()


def test_a_beds_surface_is_where_long_slides_end(model: Model) -> None:
    """Slides of 60 mm in short steps, from a state with a history; tuned fingers as well. Springs near the pole of a turn lag behind."""
    motions = loads_of_motion(limit_surface(model, 1.0).points)[::7]
    for made, factor in ((model, 1.0), (model.tuned(size=1.2, stiffness=0.7, lambda_factor=1.5), 1.0), (model, 0.4)):
        depth = 0.5 * made.depth_max_mm
        fingers = Fingers(made, len(motions), spin=True)
        fingers.run(np.full((30, 1), depth), 0.02, -0.01, 0.003, strength_factor=factor)
        before = fingers.save()
        found = fingers.limit_surface(motions)
        assert fingers.save() == before and found.dtype == LIMIT and found.shape == (len(motions), len(motions))
        np.testing.assert_array_equal(found, np.broadcast_to(found[0], found.shape), "history counts for nothing")
        slid(fingers, depth, motions, 0.05, 1000)
        expected = loads(slid(fingers, depth, motions, 0.005, 2000))
        points, scale = loads(found[0]), np.abs(expected).max(0)
        rms = np.sqrt(((points - expected) ** 2).mean(0)) / scale
        assert (rms < 0.04).all() and (np.median(np.abs(points - expected) / scale, axis=0) < 1e-2).all(), rms
        whole = limit_surface(made, depth, strength_factor=factor, motion=motions)
        np.testing.assert_array_equal(whole.points, found[0])
        assert whole.pressed["status"] == 0 and whole.pressed["normal_force_n"] > 0.05


def loads_of_motion(points: Any) -> Any:
    return np.stack([points[name] for name in ("slide_x_mm", "slide_y_mm", "spin_rad")], -1).astype(float)


def test_a_beds_surface_meets_the_limit_of_a_step(model: Model) -> None:
    """Slides along the axes end at the friction limit that a step reports; across them that limit is an ellipse, up to 8 % larger."""
    azimuths = np.deg2rad(np.arange(0, 360, 15))
    motions = np.stack([np.cos(azimuths), np.sin(azimuths), 0 * azimuths], 1)
    for depth in (0.3, 1.0, 2.4):
        points = loads(limit_surface(model, depth, motion=motions).points)
        limits = slid(Fingers(model, len(motions)), depth, motions, 0.02, 800)["friction_limit_n"]
        shares = np.hypot(*points[:, :2].T) / limits
        np.testing.assert_allclose(shares[::6], 1, rtol=1e-3)
        assert (0.9 < shares).all() and (shares < 1.001).all()
        along = (points[:, :2] * motions[:, :2]).sum(1)
        np.testing.assert_allclose(along, np.hypot(*points[:, :2].T), rtol=2e-3)


def from_patches(fingers: Fingers, motions: Any) -> Any:
    """The surface from the state of the patches: traction over the used share is the strength, which acts along the motion."""
    patches, area = fingers.patches()[0], np.array(fingers.model.patch_areas_mm2)  # type: ignore[union-attr]
    used = patches["used_share"] > 0
    patches, area = patches[used], area[used]
    strength = np.hypot(patches["traction_x_mpa"], patches["traction_y_mpa"]) * area / patches["used_share"]
    x, y = patches["place_x_mm"], patches["place_y_mm"]
    turn = motions[:, 2:]
    way = np.stack([motions[:, :1] - turn * y, motions[:, 1:2] + turn * x], -1)
    force = strength[:, None] * way / np.linalg.norm(way, axis=-1, keepdims=True)
    return np.stack([force[..., 0].sum(1), force[..., 1].sum(1), (x * force[..., 1] - y * force[..., 0]).sum(1)], 1)


@pytest.mark.parametrize("tuned", [False, True])
def test_a_pads_surface_adds_up_over_its_patches(pad: Pad, tuned: bool) -> None:
    made = pad.tuned(size=1.1, stiffness=0.8, lambda_factor=1.3) if tuned else pad
    for pitch_deg, roll_deg, factor in ((30, 0, 1), (50, 15, 0.5), (20, -20, 2)):
        fingers = Fingers(made, pitch_deg=pitch_deg, roll_deg=roll_deg)
        fingers.run(np.linspace(0.05, 1.2, 30), strength_factor=factor)
        fingers.run(np.full(15, 1.2), 0.02, 0.01, 0.004)
        points = fingers.limit_surface()[0]
        expected = from_patches(fingers, loads_of_motion(points))
        assert (np.abs(loads(points) - expected) < 3e-3 * np.abs(expected).max(0)).all()


@pytest.mark.parametrize("pitch_deg", [30, 50])
def test_long_slides_of_a_pad_end_on_its_surface(pad: Pad, pitch_deg: float) -> None:
    """After the slide the surface passes through the load; that of the press differs as the normal force does."""
    azimuths = np.deg2rad(np.arange(0, 360, 15))
    motions = np.stack([np.cos(azimuths), np.sin(azimuths), 0 * azimuths], 1)
    motions = np.vstack([motions, [[0, 0, 0.3], [0, 0, -0.3]]])
    for depth in (0.5, 1.0):
        pressed = limit_surface(pad, depth, pitch_deg=pitch_deg, motion=motions)
        fingers = Fingers(pad, len(motions), pitch_deg=pitch_deg)
        fingers.run(np.linspace(0.05, depth, 40)[:, None])
        r = slid(fingers, depth, motions, 0.05, 400)
        own = loads(np.diagonal(fingers.limit_surface(motions)))
        assert (r["status"] == 0).all()
        scale = np.abs(loads(r)).max(0)
        slides, spins = slice(0, -2), slice(-2, None)
        assert (np.abs(own - loads(r))[slides, :2] < 3e-3 * scale[:2]).all()
        assert (np.abs(own - loads(r))[spins, 2] < 3e-2 * scale[2]).all()
        share = np.hypot(*loads(pressed.points)[slides, :2].T) / np.hypot(*loads(r)[slides, :2].T)
        force = pressed.pressed["normal_force_n"] / r["normal_force_n"][slides]
        assert (np.abs(share - force) < 0.15).all(), (share, force)


def test_a_surface_of_a_similar_finger_is_similar(model: Model, pad: Pad) -> None:
    """Forces go with the size squared, moments with its cube; a strength of twice lambda gives twice the friction of patches."""
    motions = np.array([[1, 0, 0], [0.3, -0.4, 0.1], [0, 0, -1.0]])
    for made, body, larger in ((model, None, None), (pad, None, None), (pad, Sphere(20), Sphere(25))):
        small = limit_surface(made, 1.0, body=body, motion=motions)
        large = limit_surface(made.tuned(size=1.25), 1.25, body=larger, motion=motions * [1.25, 1.25, 1])
        expected = loads(small.points) * np.array([1.25**2, 1.25**2, 1.25**3])
        assert (np.abs(loads(large.points) - expected) < 2e-3 * np.abs(expected).max(0)).all(), made
    fingers = Fingers(pad, 2)
    fingers.run(np.linspace(0.05, 1, 20)[:, None], strength_factor=[1, 1])
    once = loads(fingers.limit_surface(motions))
    fingers.step(1.0, strength_factor=[1, 2])
    twice = loads(fingers.limit_surface(motions))
    np.testing.assert_allclose(twice[0], once[0], rtol=1e-3, atol=1e-5)
    np.testing.assert_allclose(twice[1], 2 * twice[0], rtol=2e-2, atol=1e-3)


def test_the_motion_counts_by_its_direction(model: Model, pad: Pad) -> None:
    motions = np.array([[1, 0.2, 0.1], [0, 0, 1], [-1, 2, -0.3]])
    for fingers in (Fingers(model, 2), Fingers(pad, 2, body=Cylinder(10, 30))):
        fingers.run(np.linspace(0.05, 1, 20)[:, None] * [1, 0.7])
        expected = loads(fingers.limit_surface(motions))
        for scale in (1e-30, 1e-3, 1e6, 1e30):
            np.testing.assert_allclose(loads(fingers.limit_surface(scale * motions)), expected, rtol=1e-4, atol=1e-6)
        one = fingers.limit_surface([0, 1, 0])
        assert one.shape == (2, 1) and (loads(one)[..., 1] > 0.01).all()
        fingers.step(-1.0)
        assert not loads(fingers.limit_surface()).any(), "0 without contact"
    assert fingers.limit_surface().shape == (2, 266) and Fingers(pad, 0).limit_surface().shape == (0, 266)


def test_shapes_of_surfaces(model: Model, pad: Pad) -> None:
    depth = np.array([[0.3], [0.9]])
    found = limit_surface(pad, depth, pitch_deg=[20, 30, 50], body=Edge(5, 90, 150), motion=[[1, 0, 0], [0, 1, 0]])
    assert found.points.shape == (2, 3, 2) and found.pressed.shape == (2, 3)
    alone = limit_surface(pad, 0.9, pitch_deg=50, body=Edge(5, 90, 150), motion=[[1, 0, 0], [0, 1, 0]])
    np.testing.assert_allclose(loads(alone.points), loads(found.points[1, 2]), rtol=2e-3, atol=1e-4)
    assert limit_surface(model, np.linspace(0, 2, 5)).points.shape == (5, 266)
    assert not loads(limit_surface(model, 0).points).any() and limit_surface(pad, np.zeros((0, 3))).points.shape == (0, 3, 266)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"depth_mm": -0.1}, "depth_mm: -0.1 is not between 0 and 5.1"),
        ({"depth_mm": [1, float("nan")]}, "depth_mm: nan is not between 0"),
        ({"depth_mm": 9}, "depth_mm: 9 is not between 0 and 5.1"),
        ({"pitch_deg": 80}, "pitch_deg: 80 is not between 10 and 70"),
        ({"roll_deg": [0, 31]}, "roll_deg: 31 is not between -30 and 30"),
        ({"strength_factor": 6}, "strength_factor: 6 is not between 0.1 and 5"),
        ({"depth_mm": [1, 2], "pitch_deg": [20, 30, 40]}, r"do not broadcast: depth_mm \(2,\), pitch_deg \(3,\)"),
        ({"motion": [1, 0]}, r"motion: an array of shape \(2,\)"),
        ({"motion": 1}, r"motion: an array of shape \(\)"),
        ({"motion": [[1, 0, 0], [0, 0, 0]]}, r"motion: row 1 is \[0.0, 0.0, 0.0\]"),
        ({"motion": [[1, float("inf"), 0]]}, "motion: row 0 is "),
        ({"motion": "all"}, "motion: <U3 where real numbers are needed"),
        ({"body": 3}, "body: 3 where a Plane"),
    ],
)
def test_what_a_surface_refuses(pad: Pad, arguments: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        limit_surface(pad, **{"depth_mm": 1.0, **arguments})
    if "body" in arguments:
        with pytest.raises(InputError, match="pitch_deg: 40, but a bed of springs is of one pose"):
            limit_surface(Model.shipped(), 1.0, pitch_deg=40)
        with pytest.raises(InputError, match="model: str where a Model or a Pad"):
            limit_surface("fingertip.fpm", 1.0)  # type: ignore[arg-type]


def holds(model: Model, depth_mm: float, load: Any, margin: float, factor: float) -> bool:
    """Whether slides in the load's direction end at a friction that holds it, less the band and the margin."""
    way = np.append(load / np.linalg.norm(load), 0.0)[None]
    fingers = Fingers(model)
    fingers.step(depth_mm, strength_factor=factor)
    r = slid(fingers, depth_mm, way, 0.02, 400)[0]
    return bool(np.hypot(r["friction_x_n"], r["friction_y_n"]) - r["band_friction_n"] >= np.linalg.norm(load) / (1 - margin))


def test_least_grips_are_those_of_bisection_over_steps(model: Model) -> None:
    random = np.random.default_rng(SEED)
    for made in (model, model.tuned(size=0.9, stiffness=1.4, lambda_factor=0.8)):
        for _ in range(3):
            load, margin, factor = random.uniform(-0.2, 0.2, 2), random.uniform(0, 0.4), random.uniform(0.7, 2)
            found, normal, status = made.least_grip(load[0], load[1], margin=margin, strength_factor=factor)
            assert status == 0
            low, high = 0.0, made.depth_max_mm
            for _ in range(12):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if holds(made, middle, load, margin, factor) else (middle, high)
            assert found == pytest.approx(high, rel=0.05, abs=2e-3), (SEED, load, margin, factor)
            fingers = Fingers(made)
            fingers.step(found, strength_factor=factor)
            for _ in range(40):
                r = fingers.step_driven(depth_mm=found, friction_x_n=load[0], friction_y_n=load[1])[0]
            assert r["status"] == 0 and r["slip_margin"] >= margin - 0.01
            assert r["normal_force_n"] == pytest.approx(normal, rel=0.05), (SEED, load, margin, factor)


def margin_under(pad: Pad, depth_mm: float, load: Any, factor: float, options: Any) -> Any:
    """The response of a finger that was pressed in steps of 0.02 mm and slid in steps of at most 0.02 mm until it carries a load."""
    finger = Finger(pad, **options)
    for depth in np.linspace(0, depth_mm, 2 + int(depth_mm / 0.02))[1:]:
        r = finger.step(depth, strength_factor=factor)
    for _ in range(2000):
        missing = load - [r.friction_x_n, r.friction_y_n]
        if np.hypot(*missing) < 1e-3 * np.hypot(*load):
            break
        r = finger.step(depth_mm, *(missing * min(0.5, 0.02 / np.hypot(*missing))))
    return r


@pytest.mark.parametrize("options", [{}, {"pitch_deg": 50, "roll_deg": 10}, {"body": Sphere(20)}, {"body": Cylinder(12, 90), "pitch_deg": 20}])
def test_least_grips_of_a_pad_hold_their_loads(pad: Pad, options: Any) -> None:
    """A finer press and slide holds the load with the margin at the depth found, and does not at 6 % less."""
    random = np.random.default_rng(SEED)
    for made in (pad, pad.tuned(size=1.1, stiffness=1.2, lambda_factor=0.9)):
        for _ in range(2):
            load, margin, factor = random.uniform(-0.3, 0.3, 2), random.uniform(0.1, 0.5), random.uniform(0.7, 2)
            depth, normal, status = made.least_grip(load[0], load[1], margin=margin, strength_factor=factor, **options)
            assert status == 0 and 0 < depth < made.depth_max_mm
            r = margin_under(made, depth, load, factor, options)
            assert r.normal_force_n == pytest.approx(normal, rel=0.05)
            safe = 1 - (1 - margin) * (1 - r.band_friction_n / r.friction_limit_n)
            assert r.slip_margin > max(margin, safe - 0.03), (SEED, load, margin, factor, r)
            assert margin_under(made, 0.94 * depth, load, factor, options).slip_margin < safe, (SEED, load, margin, factor)


def test_least_grips_of_a_pad_over_arrays(model: Model, pad: Pad) -> None:
    x, pitch = np.array([0.05, 0.2, 0.5]), np.array([[20.0], [30.0], [50.0]])
    depth, normal, status = pad.least_grip(x, margin=0.2, pitch_deg=pitch)
    assert depth.shape == normal.shape == status.shape == (3, 3) and not status.any() and (np.diff(depth, axis=1) > 0).all()
    for i, j in ((0, 0), (2, 1)):
        one = pad.least_grip(float(x[j]), margin=0.2, pitch_deg=float(pitch[i, 0]))
        assert one[:2] == pytest.approx((depth[i, j], normal[i, j]), rel=1e-3) and [type(v) for v in one] == [float, float, int]
    # In the bed's own pose the two models need about the same force.
    np.testing.assert_allclose(normal[1], model.least_grip(x, margin=0.2)[1], rtol=0.2)
    depth, _, status = pad.least_grip([0.0, 20, np.nan, np.inf, 0.2])
    assert list(status) == [0, Status.LOAD_NOT_REACHED, Status.BAD_INPUT, Status.BAD_INPUT, 0] and depth[0] == 0
    assert depth[1] == depth[2] == np.float32(pad.depth_max_mm) and 0 < depth[4] < 1
    assert pad.least_grip(np.zeros((0, 2)))[0].shape == (0, 2)
    for options, text in (
        ({"margin": 1}, "margin: 1 is not between 0 and 0.95"),
        ({"pitch_deg": 5}, "pitch_deg: 5 is not between 10 and 70"),
        ({"body": "ball"}, "body: 'ball' where a Plane"),
        ({"friction_y_n": [0, 1], "roll_deg": [1, 2, 3]}, r"friction_y_n \(2,\), roll_deg \(3,\)"),
    ):
        with pytest.raises(InputError, match=text):
            pad.least_grip(0.1, **options)  # type: ignore[call-overload]


def test_least_grips_over_arrays(model: Model) -> None:
    x, margin = np.linspace(-0.4, 0.4, 9), np.array([[0.0], [0.2], [0.5]])
    depth, normal, status = model.least_grip(x, 0.1, margin=margin, strength_factor=1.5)
    assert depth.shape == normal.shape == status.shape == (3, 9) and depth.dtype == np.float32
    for i, j in np.ndindex(3, 9):
        one = model.least_grip(float(x[j]), 0.1, margin=float(margin[i, 0]), strength_factor=1.5)
        assert one == (depth[i, j], normal[i, j], status[i, j]) and [type(v) for v in one] == [float, float, int]
    assert (np.diff(depth, axis=0) > 0).all()
    _, _, status = model.least_grip([0.1, 50, np.nan, np.inf, 1e300])
    assert list(status) == [0, Status.LOAD_NOT_REACHED, *3 * [Status.BAD_INPUT]]
    assert model.least_grip(0.0) == (0, 0, 0) and model.least_grip(np.zeros((0, 2)))[0].shape == (0, 2)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"margin": 0.96}, "margin: 0.96 is not between 0 and 0.95"),
        ({"margin": [0, float("nan")]}, "margin: nan is not between"),
        ({"margin": -0.1}, "margin: -0.1 is not between"),
        ({"strength_factor": 0.05}, "strength_factor: 0.05 is not between 0.1 and 5"),
        ({"friction_x_n": "much"}, "friction_x_n: <U4 where real numbers are needed"),
        ({"friction_y_n": np.ma.masked_array([1, 2], [0, 1])}, "friction_y_n: 1 of 2 numbers are masked"),
        ({"friction_x_n": [1, 2], "margin": [0, 0, 0]}, r"friction_x_n \(2,\), margin \(3,\)"),
    ],
)
def test_what_a_least_grip_refuses(model: Model, arguments: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        model.least_grip(**{"friction_x_n": 0.1, **arguments})


@pytest.mark.parametrize("body", [Plane(), Sphere(12), Cylinder(-30, 45)])
def test_maps_are_the_columns_of_patches(pad: Pad, body: Any) -> None:
    fingers = Fingers(pad, 3, body=body, pitch_deg=[25, 30, 55])
    assert not fingers.slip_map().view(np.float32).any()
    depth = np.linspace(0.05, 1.2, 30)[:, None]
    fingers.run(depth)
    r = fingers.run(np.full((20, 1), 1.2), 0.06, 0.02)[-1]
    pressure, slip, patches = fingers.pressure_map(), fingers.slip_map(), fingers.patches()
    assert pressure.dtype == PRESSURE_MAP and slip.dtype == SLIP_MAP and pressure.shape == slip.shape == (3, 37)
    for made in (pressure, slip):
        for name in set(made.dtype.names or ()) - {"area_mm2"}:
            np.testing.assert_array_equal(made[name], patches[name], name)
    if body == Plane():
        np.testing.assert_allclose((pressure["pressure_mpa"] * pressure["area_mm2"]).sum(1), r["normal_force_n"], rtol=1e-4)
    # The half of the patches in contact that is pressed most sticks longest, over its area: a patch that touches in part slips later.
    for k in range(3):
        order = np.argsort(pressure[k]["pressure_mpa"])[(slip[k]["contact_area_mm2"] == 0).sum() :]
        half = len(order) // 2
        stick, area = slip[k]["stick_ratio"][order], slip[k]["contact_area_mm2"][order]
        least, most = (np.average(stick[part], weights=area[part]) for part in (slice(half), slice(half, None)))
        assert most > least + 0.1, (most, least)
    with pytest.raises(InputError, match="patches: a bed of springs has none"):
        Fingers(Model.shipped()).pressure_map()


def test_force_ranges(model: Model, pad: Pad) -> None:
    assert model.normal_force_max_n == pytest.approx(Fingers(model).step(model.depth_max_mm)["normal_force_n"][0])
    assert f"normal force 0 to {model.normal_force_max_n:.2f} N" in repr(model)
    pressed = Fingers(pad).run(np.linspace(0, pad.depth_max_mm, 300))[-1, 0]
    assert pad.normal_force_max_n == pytest.approx(pressed["normal_force_n"], rel=5e-3) and pressed["status"] == 0
    assert f"normal force 0 to {pad.normal_force_max_n:.2f} N on a plane at pitch 30 deg" in repr(pad)
    assert pad.tuned(size=1.2, stiffness=1.5).normal_force_max_n == pytest.approx(1.2**2 * 1.5 * pad.normal_force_max_n, rel=2e-2)
