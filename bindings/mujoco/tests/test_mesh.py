"""Convex meshes beside the bodies that they were made of, and edges of boxes beside the C library."""

import hold
import meshes
import mujoco
import numpy as np
import paths
import pytest
import scenes
from paths import NO_DAMPING, PAD, STILL, first_of
from reference import EDGE, PadFinger
from scipy.spatial.transform import Rotation
from test_passive import energies_after_a_hit, taken_by_cycles

import fingerpad_mujoco

#: The edge of a box between +x and +z.
EDGE_FACE = 11

FORCES = ("normal_force_n", "friction_x_n", "friction_y_n", "spin_moment_n_mm")


def along(geom, radius, path, pose_of=lambda i: STILL):
    """The contacts of a finger that is led along a path over a geom."""
    top = np.array([0.0, 0.0, 1e3 * radius])
    return paths.lead_along(path, lambda row: paths.pad_at(row, top), pose_of, geom=geom, radius=radius, **PAD)


def apart(one, other):
    """Largest difference of each force over the largest force of the first."""
    seen = {name: [np.array([c[name] for c in run]) for run in (one, other)] for name in FORCES}
    return {name: np.abs(a - b).max() / np.abs(a).max() for name, (a, b) in seen.items()}


@pytest.mark.parametrize("seed", first_of(4, 7))
@pytest.mark.parametrize("geom, radius", [("box", paths.HALF), ("ball", 0.012), ("ball", 0.03), ("rod", 0.012), ("rod", 0.005)])
def test_a_fine_mesh_has_the_forces_of_its_body(geom, radius, seed):
    # Presses, slides, turns, tilts, lift-off; the body moves as well.
    path = paths.wandering(seed, steps=200)
    exact, mesh = (along(name, radius, path, paths.tumbling(seed, 200)) for name in (geom, f"mesh {geom}"))
    assert sum(c["normal_force_n"] > 0 for c in exact) > 60
    assert max(apart(exact, mesh).values()) < 2e-3, apart(exact, mesh)
    assert {c["status"] for c in exact} == {c["status"] for c in mesh} == {0.0}


@pytest.mark.parametrize("seed", first_of(4, 7))
def test_a_mesh_with_two_curvatures_is_the_sphere_between(seed):
    # As for an ellipsoid of MuJoCo, whose curvatures at the apex are exact; those of the mesh are means over the contact.
    path = paths.wandering(seed, steps=200)
    exact, mesh = (along(name, 0.012, path) for name in ("egg", "mesh egg"))
    assert max(apart(exact, mesh).values()) < 0.1, apart(exact, mesh)


def test_a_mesh_contact_ends_at_its_end():
    model, data = paths.model_and_data(geom="mesh rod", radius=0.012, **PAD)
    at = lambda x: (np.array([x, 0, 11.0]), Rotation.identity())
    assert paths.lead(model, data, at(100.4), STILL)["normal_force_n"] > 0.03
    # Where the mesh is 0.5 mm inside the cylinder.
    assert paths.lead(model, data, at(100.6), STILL)["normal_force_n"] == 0


def test_a_contact_over_the_edge_of_a_mesh_is_flagged_as_over_that_of_a_box():
    seen = {}
    for geom in ("box", "mesh box"):
        model, data = paths.model_and_data(geom=geom, **PAD)
        contacts = [paths.lead(model, data, paths.pad_at([1.0, x, 0, 0, 0, 0]), STILL) for x in np.arange(0.0, 29.9, 0.5)]
        seen[geom] = [fingerpad_mujoco.flags(c["status"]) == ["beyond_edge"] for c in contacts]
        assert contacts[-1]["normal_force_n"] > 0.1
    # The box takes the contact as a disk, the mesh as eight points of its rim.
    assert sum(seen["box"]) > 3 and abs(sum(seen["box"]) - sum(seen["mesh box"])) <= 1, seen


def test_a_coarse_mesh_counts_as_its_facet_and_is_flagged():
    # Twelve sides of 6.2 mm: no cylinder within 0.15 mm.
    path = paths.wandering(4, steps=100)
    flags = [fingerpad_mujoco.flags(c["status"]) for c in along("coarse rod", 0.012, path) if c["normal_force_n"] > 0]
    assert len(flags) > 50 and all("beyond_edge" in names for names in flags)


def test_a_finger_that_slides_over_facets_feels_none():
    # 128 sides of 0.6 mm; the finger goes round by 0.5 rad over 20 of them. A contact keeps the cylinder with which it began.
    forces = {}
    for geom in ("rod", "mesh rod"):
        model, data = paths.model_and_data(geom=geom, radius=0.012, **PAD)
        seen = []
        for roll in np.linspace(0.0, 0.5, 400):
            turned = Rotation.from_euler("x", roll)
            depth = min(1.0, 10 * roll)
            seen.append(paths.lead(model, data, (turned.apply([0, 0, 12.0 - depth]), turned), STILL))
        forces[geom] = np.array([c["normal_force_n"] for c in seen])
    second = {geom: np.abs(np.diff(force[100:], 2)).max() for geom, force in forces.items()}
    assert forces["mesh rod"][-1] > 0.05
    assert second["mesh rod"] < 1.5 * second["rod"] + 1e-5, second
    assert np.abs(forces["rod"] - forces["mesh rod"]).max() < 2e-3 * forces["rod"].max()


@pytest.mark.parametrize("timestep", first_of(0.004, 0.001))
@pytest.mark.parametrize("name, grip_n", first_of(("ball", 1.0), ("die", 1.0), ("key", 1.0)))
def test_pads_hold_a_mesh_as_the_body(name, grip_n, timestep):
    exact, mesh = (hold.held_by_pads(held, grip_n, timestep, 6.0) for held in (name, f"mesh {name}"))
    assert mesh["drift_um_s"] < 1e-3 and mesh["turn_rad_s"] < 1e-6 and mesh["hum_um"] < 0.05, mesh
    assert mesh["sag_mm"] == pytest.approx(exact["sag_mm"], abs=0.01)
    assert mesh["normal_force_n"] == pytest.approx(exact["normal_force_n"], rel=2e-3)
    assert mesh["flags"] == exact["flags"]


@pytest.mark.nightly
@pytest.mark.parametrize("held, grip_n", [("pen", 1.0), ("tube", 1.0)])
def test_a_mesh_rolls_between_the_fingers_as_the_body(held, grip_n):
    turned = {name: hold.rolled(name, grip_n, 1.0) for name in (held, f"mesh {held}")}
    assert turned[f"mesh {held}"]["turn_rad"] == pytest.approx(turned[held]["turn_rad"], rel=0.01), turned


@pytest.mark.parametrize("held, grip_n", first_of(("mesh die", 3.0), ("mesh ball", 1.0), ("mesh pen", 1.0)))
def test_a_held_mesh_that_is_hit_gains_no_energy(held, grip_n):
    _, shares = energies_after_a_hit(held, grip_n, 0.002, seed=3)
    # A pen still rolls a little into its place when it is hit, as the cylinder does: the first steps may have more than the hit.
    assert shares[10:].max() < shares[:10].max() < 1.001, (shares[:10].max(), shares[10:].max())


@pytest.mark.parametrize("geom", first_of("mesh egg", "mesh box", "mesh ball", "mesh rod"))
def test_closed_paths_over_a_mesh_yield_nothing(geom):
    for sense in (1, -1):
        *_, (left, gone) = taken_by_cycles(1, 2, sense, steps=400, part=0.03, geom=geom, strength_factor=5, **PAD)
        assert gone > 5e-3 and abs(left) < 2e-4 * gone, (left, gone)
        *_, (left, gone) = taken_by_cycles(1, 1, sense, slide_mm=2.0, steps=200, geom=geom, **PAD)
        assert 0.2 * gone < left < 0.7 * gone, (left, gone)


def test_a_state_with_a_mesh_goes_on_with_the_same_bits():
    model, data = hold.gripped(held="mesh pen", **PAD)
    mujoco.mj_step(model, data, 200)
    other, copied = mujoco.MjData(model), mujoco.MjData(model)
    state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    mujoco.mj_setState(model, other, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    mujoco.mj_copyData(copied, model, data)
    for each in (data, other, copied):
        mujoco.mj_step(model, each, 100)
    assert fingerpad_mujoco.read(data, "left")[0]["normal_force_n"] > 0.1
    assert (data.qpos == other.qpos).all() and (data.qpos == copied.qpos).all()
    assert (data.plugin_state == other.plugin_state).all() and np.isfinite(data.plugin_state).all()


# ---- edges of boxes ----

#: A finger that faces the edge of +x and +z of a box: its z axis is the bisector, its x axis across the edge.
BISECTOR = Rotation.from_euler("y", np.pi / 4)


def over_edge(depth_mm, along_mm=0.0, across_mm=0.0, radius_mm=2.0):
    """Place and axes of a finger that is pressed onto the rounded edge; ``across_mm`` is along its own x axis."""
    top = 1e3 * paths.HALF - radius_mm
    apex = np.array([top, 0.0, top]) + BISECTOR.apply([0, 0, radius_mm])
    lowest = paths.pad().first_touch(30.0, 0.0)[2]
    return apex + BISECTOR.apply([across_mm, along_mm, -depth_mm - lowest]), BISECTOR


@pytest.mark.parametrize("radius_mm", first_of(2.0, 3.0, 5.0))
def test_an_edge_of_a_box_is_the_edge_of_the_library(radius_mm):
    model, data = paths.model_and_data(edge_radius_mm=radius_mm, **PAD)
    # The edge lies across the finger: 90 degrees from its x axis.
    finger = PadFinger(scenes.PAD_FILE, (EDGE, radius_mm, 90.0, 90.0), (30.0, 0.0))
    contacts, answers = [], []
    for i in range(120):
        depth, slide = min(0.02 * i, 1.2), 0.01 * max(0, i - 60)
        contacts.append(paths.lead(model, data, over_edge(depth, along_mm=slide, radius_mm=radius_mm), STILL))
        answers.append(finger.step(depth, 0.0, -0.01 if i > 60 else 0.0))
    assert contacts[-1]["face"] == EDGE_FACE and contacts[-1]["normal_force_n"] > 0.02 and contacts[-1]["status"] == 0
    for name in ("normal_force_n", "friction_x_n", "friction_y_n"):
        seen, own = np.array([c[name] for c in contacts]), np.array([getattr(r, name) for r in answers])
        scale = max(np.abs([getattr(r, "friction_y_n") for r in answers]).max(), np.abs(own).max())
        assert np.abs(seen - own).max() < 2e-2 * scale, (name, np.abs(seen - own).max() / scale)


def test_an_edge_sharper_than_the_patches_is_flagged():
    model, data = paths.model_and_data(edge_radius_mm=0.5, **PAD)
    contact = paths.lead(model, data, over_edge(1.0, radius_mm=0.5), STILL)
    assert contact["normal_force_n"] > 0.02 and fingerpad_mujoco.flags(contact["status"]) == ["body_too_sharp"]


def test_an_edge_ends_at_its_corner_and_is_flagged_before():
    model, data = paths.model_and_data(**PAD)
    half = 1e3 * paths.HALF
    middle = paths.lead(model, data, over_edge(1.0), STILL)
    near = paths.lead(model, data, over_edge(1.0, along_mm=half - 0.5), STILL)
    beyond = paths.lead(model, data, over_edge(1.0, along_mm=half + 0.5), STILL)
    assert (middle["face"], fingerpad_mujoco.flags(middle["status"])) == (EDGE_FACE, [])
    assert (near["face"], fingerpad_mujoco.flags(near["status"])) == (EDGE_FACE, ["beyond_edge"])
    assert beyond["face"] == 0 and beyond["normal_force_n"] == 0


def test_a_finger_that_slides_off_a_face_does_not_come_to_its_edge():
    model, data = paths.model_and_data(**PAD)
    seen = [paths.lead(model, data, paths.pad_at([1.0, x, 0, 0, 0, 0]), STILL) for x in np.arange(25.0, 34.0, 0.25)]
    assert {c["face"] for c in seen} == {3.0, 0.0} and seen[-1]["normal_force_n"] == 0


@pytest.mark.nightly
def test_an_edge_yields_no_work():
    # Closed paths of depth, slides and tilts on the edge, with slip.
    model, data = paths.model_and_data(**NO_DAMPING, **PAD)
    for seed in range(3):
        random = np.random.default_rng(seed)
        phase, order = random.uniform(0, 2 * np.pi, 5), random.permutation([1, 1, 2, 2, 3])
        mujoco.mj_resetData(model, data)
        work, gone, before = 0.0, 0.0, None
        for i in range(2 * 400 + 1):
            angle = 2 * np.pi * i / 400
            depth, along_mm, across, pitch, roll = np.array([0.3, 1.0, 1.0, 0.08, 0.08]) * np.sin(order * angle + phase)
            at, axes = over_edge(1.0 + depth, along_mm, across)
            axes = axes * Rotation.from_euler("y", pitch) * Rotation.from_euler("x", roll)
            paths.lead(model, data, (at, axes), STILL)
            now = (1e-3 * at, axes, data.qfrc_passive[:3].copy(), axes.apply(data.qfrc_passive[3:6]))
            if before is not None and i > 400:
                force, moment = 0.5 * (before[2] + now[2]), 0.5 * (before[3] + now[3])
                step = -1e3 * (force @ (now[0] - before[0]) + moment @ (axes * before[1].inv()).as_rotvec())
                work, gone = work + step, gone + abs(step)
            before = now
        assert gone > 0.05 and work > 0.02 * gone, (work, gone)


# ---- refused ----


@pytest.mark.parametrize(
    "mesh, reason",
    [
        ("concave", "geom 'object' is a mesh that is not convex: a corner lies"),
        ("open", "geom 'object' is a mesh that is not closed"),
        ("large", "geom 'object' is a mesh of 36480 facets; a pad touches meshes of 4 to 20000"),
    ],
)
def test_a_mesh_that_a_pad_cannot_touch_is_refused_by_name(mesh, reason, capfd, own_folder):
    from test_misuse import why_refused

    vertices, faces = meshes.sphere(0.02, rings=96 if mesh == "large" else 24)
    if mesh == "concave":
        vertices = vertices * np.where(vertices[:, [2]] > 0.018, 0.8, 1.0)
    if mesh == "open":
        faces = faces[48:]
    scene = paths.scene(geom="mesh ball", **PAD)
    begin, end = scene.index("<asset>"), scene.index("</asset>")
    element = meshes.element("ball", vertices, faces).replace("<mesh", '<mesh inertia="shell"')
    said = why_refused(scene[:begin] + "<asset>" + element + scene[end:], capfd, own_folder)
    assert reason in said, said
