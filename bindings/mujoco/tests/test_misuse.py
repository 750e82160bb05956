"""Bad attributes are refused by name and value; positions that are not finite do no harm."""

import subprocess
import sys

import mujoco
import numpy as np
import paths
import pytest
from scipy.spatial.transform import Rotation

import fingerpad_mujoco
import hold
import scenes

SITE = '<site name="finger" euler="0 30 0"/>'


def why_refused(scene, capfd, folder):
    """All that MuJoCo says when it refuses a scene: the exception and the warning before it."""
    with pytest.raises((ValueError, mujoco.FatalError)) as error:
        model = mujoco.MjModel.from_xml_string(scene)
        mujoco.MjData(model)
    log = folder / "MUJOCO_LOG.TXT"
    return str(error.value) + "".join(capfd.readouterr()) + (log.read_text() if log.exists() else "")


@pytest.mark.parametrize(
    "attribute, value, reason",
    [
        ("model_file", "nowhere.fpm", "cannot be read (No such file or directory)"),
        ("model_file", "", "give the path of a .fpm file"),
        ("model_file", "{cut}", "cut off"),
        ("model_file", "{text}", "not a model file"),
        ("site", "thumb", "the model has no site of this name"),
        ("geoms", "", "name the geoms that are touched"),
        ("geoms", "object lid", "the model has no geom 'lid'"),
        ("geoms", "ball", "geom 'ball' is of type sphere; a bed of springs touches planes and boxes, a pad also spheres, ellipsoids"),
        ("geoms", "wedge", "geom 'wedge' is of type mesh; a bed of springs touches planes and boxes"),
        ("edge_radius_mm", "1", "a bed touches no edges"),
        ("geoms", "nail", "geom 'nail' belongs to the body of the site"),
        ("strength_factor", "strong", "'strong' is not a number from 0.1 to 5"),
        ("strength_factor", "nan", "'nan' is not a number from 0.1 to 5"),
        ("strength_factor", "7", "'7' is not a number from 0.1 to 5"),
        ("strength_factor", "1 1 1", "holds 3 numbers"),
        ("strength_userdata", "4", "'4' is not a number from 0 to 3"),
        ("strength_userdata", "0.5", "not a whole number"),
        ("damping_normal_n_s_per_m", "-1", "'-1' is not a number from 0 to"),
        ("damping_slide_n_s_per_m", "2,5", "'2,5' is not a number"),
        ("damping_spin_n_m_s_per_rad", "inf", "'inf' is not a number"),
        ("pad_radius_mm", "1 2 3", "holds 3 numbers"),
        ("pose", "follow", "pose"),
        ("size", "3", "'3' is not a number from 0.5 to 2"),
        ("gripping", "1", "gripping"),
    ],
)
def test_a_bad_attribute_is_named_with_its_value(attribute, value, reason, capfd, own_folder):
    whole = scenes.MODEL_FILE.read_bytes()
    (own_folder / "cut.fpm").write_bytes(whole[: len(whole) // 2])
    (own_folder / "text.fpm").write_text("this is no model file, however long it may be\n" * 20)
    value = value.format(cut=own_folder / "cut.fpm", text=own_folder / "text.fpm")
    more = '<geom name="nail" type="box" size="1 1 1"/><geom name="ball" size="1"/><geom name="wedge" type="mesh" mesh="wedge"/>'
    assets = '<asset><mesh name="wedge" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset><worldbody>'
    scene = paths.scene(**{attribute: value}).replace(SITE, SITE + more).replace("<worldbody>", assets)
    said = why_refused(scene, capfd, own_folder)
    assert reason in said, said
    if attribute not in ("gripping", "pose"):
        assert f'attribute {attribute} = "{value}"' in said and "instance 'finger'" in said, said


@pytest.mark.parametrize(
    "attribute, value, reason",
    [
        ("geoms", "egg", "geom 'egg' is an ellipsoid whose longest semi-axis is 2 times its least; a pad takes up to 1.4"),
        ("geoms", "hills", "geom 'hills' is of type height field; a pad touches planes, boxes, spheres, ellipsoids, cylinders, capsules"),
        ("edge_radius_mm", "0", "'0' is not a number from 0.1 to 10"),
        ("geoms", "needle", "geom 'needle' has the sizes 5e-05 1 0 m"),
        ("pad_radius_mm", "21", "a pad has a shape of its own"),
        ("stiffness", "9", "'9' is not a number from 0.2 to 5"),
        ("model_file", "{cut}", "cut off"),
    ],
)
def test_a_bad_attribute_of_a_pad_is_named_with_its_value(attribute, value, reason, capfd, own_folder):
    whole = scenes.PAD_FILE.read_bytes()
    (own_folder / "cut.fpm").write_bytes(whole[: len(whole) // 2])
    value = value.format(cut=own_folder / "cut.fpm")
    more = (
        '<geom name="egg" type="ellipsoid" size="1 2 1"/><geom name="needle" type="capsule" size="5e-5 1"/>'
        '<geom name="hills" type="hfield" hfield="hills"/>'
    )
    assets = '<asset><hfield name="hills" nrow="2" ncol="2" size="1 1 1 1"/></asset>'
    scene = paths.scene(**{"model_file": scenes.PAD_FILE, attribute: value}).replace("<worldbody>", assets + "<worldbody>" + more)
    said = why_refused(scene, capfd, own_folder)
    assert reason in said and f'attribute {attribute} = "{value}"' in said, said


def test_a_pad_follows_the_branches_of_its_file(own_folder):
    # The Python package of the core writes such files.
    core = pytest.importorskip("fingerpad")
    soft = own_folder / "soft.fpm"
    soft.write_bytes(core.Pad.from_file(scenes.PAD_FILE).relaxing("human-assumed").to_bytes())
    path = np.zeros((40, 6))
    path[0, 0], path[1:, 0] = -0.1, 0.8
    by_file, by_attribute = (
        [c["normal_force_n"] for c in paths.lead_along(path, paths.pad_at, **attributes)]
        for attributes in (dict(model_file=soft), dict(model_file=scenes.PAD_FILE, relaxation="human-assumed"))
    )
    assert by_file == by_attribute and by_file[1] > 1.5 * by_file[-1]


@pytest.mark.parametrize(
    "model_file, value, reason",
    [
        (scenes.PAD_FILE, "1", "'1': expected human-assumed, none, or up to 3 words SHARE:TIME_S"),
        (scenes.PAD_FILE, "1:0.1 1:0.2 1:0.3 1:0.4", "'1:0.4': expected"),
        (scenes.PAD_FILE, "-1:0.1", "a share is outside 0 to 100, or a time outside 1e-5 to 1e5 s"),
        (scenes.MODEL_FILE, "1:0.1", "the plugin lets the tissue of pads relax, not of beds"),
    ],
)
def test_branches_that_are_none_are_refused(model_file, value, reason, capfd, own_folder):
    said = why_refused(paths.scene(model_file=model_file, relaxation=value), capfd, own_folder)
    assert reason in said and f'attribute relaxation = "{value}"' in said, said


def test_another_version_of_mujoco_is_refused_by_name(monkeypatch):
    monkeypatch.setattr(mujoco, "mj_versionString", lambda: "4.99.0")
    with pytest.raises(ImportError, match=r"built against MuJoCo 4\.\d+\.\d+, and MuJoCo 4\.99\.0 is installed; this helps: pip install mujoco==4"):
        fingerpad_mujoco.load()


@pytest.mark.parametrize("first", ["mujoco", "fingerpad_mujoco, mujoco"])
def test_the_import_of_mujoco_alone_finds_plugin_and_model(first, own_folder):
    (own_folder / "finger.xml").write_text(paths.scene(model_file="fingertip-pad.fpm"))
    program = f"import {first}; print(mujoco.MjModel.from_xml_path('finger.xml').nplugin)"
    ran = subprocess.run([sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, timeout=60)
    assert (ran.stdout, ran.stderr) == ("1\n", ""), ran.stderr


def test_a_model_beside_the_scene_comes_before_one_that_ships(own_folder):
    name = "fingertip-pad.fpm"
    folder = own_folder / "scenes"
    folder.mkdir()
    path = folder / "finger.xml"
    path.write_text(paths.scene(model_file=name))
    stated = lambda: dict(fingerpad_mujoco.spec_from_path(path).plugins[0].config)["model_file"]
    assert stated() == name
    (folder / name).write_bytes(scenes.PAD_FILE.read_bytes())
    assert stated() == str(folder / name)


def test_an_unknown_sensor_is_named():
    _, data = hold.gripped()
    with pytest.raises(KeyError, match="thumb"):
        fingerpad_mujoco.read(data, "thumb")


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_a_position_that_is_no_number_is_held_and_flagged(bad, integrator):
    model, data = paths.model_and_data()
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    # Without this flag MuJoCo itself resets the simulation before any plugin sees the number.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    object_at = (np.zeros(3), Rotation.identity())
    at = 1e3 * np.array([0, 0, paths.HALF])
    for slide in np.linspace(0, 0.5, 20):
        before = paths.lead(model, data, (at + [-slide, 0, -1], Rotation.identity()), object_at)
    assert before["friction_x_n"] > 0.1
    lost = paths.lead(model, data, ([bad, 0, 0], Rotation.identity()), object_at)
    assert lost["normal_force_n"] == 0 and fingerpad_mujoco.flags(lost["status"]) == ["bad_input"]
    assert np.isfinite(data.plugin_state).all()
    # The memory outlives the bad step.
    data.qpos[:] = 0
    data.qacc_warmstart[:] = 0
    after = paths.lead(model, data, (at + [-0.5, 0, -1], Rotation.identity()), object_at)
    assert after["friction_x_n"] == before["friction_x_n"] and after["status"] == 0


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf, -5.0, 1e300])
@pytest.mark.parametrize("model_file", [scenes.MODEL_FILE, scenes.PAD_FILE], ids=["bed", "pad"])
def test_a_state_that_was_overwritten_is_restarted_and_flagged(value, model_file):
    model, data = hold.gripped(model_file=model_file)
    mujoco.mj_step(model, data, 100)
    data.plugin_state[:] = value
    mujoco.mj_forward(model, data)
    assert "memory_lost" in fingerpad_mujoco.flags(fingerpad_mujoco.read(data, "left")[0]["status"])
    mujoco.mj_step(model, data, 2000)
    right = fingerpad_mujoco.read(data, "right")[0]
    assert right["status"] == 0 and right["normal_force_n"] == pytest.approx(hold.GRIP_N, rel=0.05)


@pytest.mark.parametrize(
    "model_file, held",
    [(scenes.MODEL_FILE, "block"), (scenes.PAD_FILE, "block"), (scenes.PAD_FILE, "ball"), (scenes.PAD_FILE, "mesh pen")],
    ids=["bed", "pad", "pad and ball", "pad and mesh"],
)
def test_random_state_bits_do_no_harm(model_file, held):
    random = np.random.default_rng(23)
    model, data = hold.gripped(model_file=model_file, held=held)
    for _ in range(300):
        data.plugin_state[:] = random.integers(0, 2**32, model.npluginstate)
        mujoco.mj_step(model, data)
        assert np.isfinite(data.qfrc_passive).all()
        mujoco.mj_resetData(model, data)


def test_a_jump_is_flagged():
    model, data = paths.model_and_data(geom="plane")
    contacts = [paths.lead(model, data, ([x, 0, -1], Rotation.identity())) for x in (0.0, 0.0, 100.0)]
    assert [fingerpad_mujoco.flags(c["status"]) for c in contacts] == [[], [], ["large_increment"]]


def test_too_deep_is_flagged():
    model, data = paths.model_and_data(geom="plane")
    contacts = [paths.lead(model, data, ([0, 0, -depth], Rotation.identity())) for depth in np.arange(0.0, 9.5, 0.5)]
    assert fingerpad_mujoco.flags(contacts[-1]["status"]) == ["depth_above_range"]


@pytest.mark.parametrize("scene", [dict(), paths.PAD], ids=["bed", "pad"])
def test_a_finger_that_comes_from_the_side_begins_near_the_surface(scene):
    # 8 mm below the top of a box, beside it at first, then over it: no contact of 8 mm.
    model, data = paths.model_and_data(**scene)
    edge = 1e3 * paths.HALF
    at = lambda x: paths.lead(model, data, ([x, 0, edge - 8], Rotation.identity()), paths.STILL)
    assert at(edge + 20)["normal_force_n"] == 0
    assert at(0.0)["normal_force_n"] < 1e-6
    sunk = paths.lead(model, data, ([0, 0, edge - 8.5], Rotation.identity()), paths.STILL)
    assert sunk["depth_mm"] == pytest.approx(0.5, abs=0.01) and fingerpad_mujoco.flags(sunk["status"]) == ["began_inside"]


def test_a_jump_without_equilibrium_is_flagged_and_found_in_the_next_steps():
    """A finger that jumps about a plane as none does, by up to 1 cm and half a turn a step: few steps find no equilibrium."""
    scene = f"""<mujoco><option gravity="0 0 0"/>{scenes.extension(scenes.instance("tip", "tip", "plate", model_file=scenes.PAD_FILE))}
      <worldbody><geom name="plate" type="plane" size="1 1 1" contype="0" conaffinity="0"/>
        <body name="tip" mocap="true"><site name="tip" euler="0 30 0"/></body></worldbody>
      <sensor>{scenes.sensor("tip")}</sensor></mujoco>"""
    model, random = mujoco.MjModel.from_xml_string(scene), np.random.default_rng(1)
    data, flagged = mujoco.MjData(model), 0
    for _ in range(500):
        data.mocap_pos[0] = random.uniform(-0.004, 0.004), random.uniform(-0.004, 0.004), -random.uniform(0, 0.01)
        data.mocap_quat[0] = [1, *random.normal(0, 0.3, 3)]
        mujoco.mj_step(model, data)
        contact = fingerpad_mujoco.read(data, "tip")[0]
        assert np.isfinite(list(contact.values())).all()
        if "not_converged" in fingerpad_mujoco.flags(contact["status"]):
            flagged += 1
            mujoco.mj_step(model, data, 3)
            contact = fingerpad_mujoco.read(data, "tip")[0]
            assert "not_converged" not in fingerpad_mujoco.flags(contact["status"]) and contact["normal_force_n"] > 1
    assert 1 <= flagged <= 10
