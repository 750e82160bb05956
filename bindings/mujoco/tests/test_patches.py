"""The sensor of the patches: sums are the contact's forces in scenes with an object on a table, in the air all is zero, what is refused."""

import mujoco
import numpy as np
import pytest
import scenes
import skin
from test_misuse import why_refused

import fingerpad_mujoco

LOADS = ("force_n", "moment_n_m", "pressure_pa", "shear_pa", "contact_area_m2", "stick_ratio")


def is_unloaded(patches):
    return not any(patches[name].any() for name in LOADS) and (patches["area_m2"] > 0).all()


def sums(data, side):
    """Force and moment about the site in the world."""
    patches, axes = fingerpad_mujoco.read_patches(data, side + "_skin"), data.site(side).xmat.reshape(3, 3)
    moment = np.cross(patches["position_m"], patches["force_n"]) + patches["moment_n_m"]
    return axes @ patches["force_n"].sum(0), axes @ moment.sum(0)


@pytest.mark.parametrize("model_file", ["fingertip-pad.fpm", "silicone-dome-pad.fpm"])
def test_the_patches_carry_a_block_from_the_table(model_file):
    scene = scenes.lifted(mass=0.045, timestep=0.002, model_file=scenes.MODELS / model_file)
    model = mujoco.MjModel.from_xml_string(scenes.with_skin(scene, left_skin="left", right_skin="right"))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    assert all(is_unloaded(fingerpad_mujoco.read_patches(data, side)) for side in ("left_skin", "right_skin"))
    seen = 0
    for k in range(600):
        data.ctrl[:] = 0.02 * min(max(k - 250, 0) / 250, 1), 1.5, 1.5
        mujoco.mj_step(model, data)
        for sign, side in ((1, "left"), (-1, "right")):
            contact, (force, moment) = fingerpad_mujoco.read(data, side)[0], sums(data, side)
            normal = np.array([-sign, 0, 0]) @ data.body("object").xmat.reshape(3, 3).T
            size = 1e-5 * (0.1 + contact["normal_force_n"])
            assert force @ normal == pytest.approx(contact["normal_force_n"], abs=size)
            assert np.linalg.norm(force - (force @ normal) * normal) == pytest.approx(
                np.hypot(contact["friction_x_n"], contact["friction_y_n"]), abs=size
            )
            assert 1e3 * moment @ normal == pytest.approx(contact["spin_moment_n_mm"], abs=10 * size)
            # The other moments are those of the pressure about the foot, and of friction in the face, which the site has passed by the depth.
            along = data.site(side).xmat.reshape(3, 3)[:, 0]
            along = along - (along @ normal) * normal
            axes = np.array([along / np.linalg.norm(along), np.cross(normal, along) / np.linalg.norm(along)])
            x, y = contact["pressure_centre_x_mm"], contact["pressure_centre_y_mm"]
            about_foot = contact["normal_force_n"] * np.array([y, -x])
            about_site = about_foot + contact["depth_mm"] * np.array([-contact["friction_y_n"], contact["friction_x_n"]])
            is_human = model_file.startswith("fingertip")
            assert not is_human or 1e3 * axes @ moment == pytest.approx(about_site, abs=0.05 * (0.02 + contact["normal_force_n"])), k
            seen += contact["normal_force_n"] > 1
    held = sum(sums(data, side)[0][2] for side in ("left", "right"))
    # What the fingers feel is the weight, less the dampers and what the object still accelerates.
    assert seen > 800 and data.body("object").xpos[2] > 0.035 and held == pytest.approx(-0.045 * scenes.GRAVITY, rel=0.02)
    before = [fingerpad_mujoco.read_patches(data, side).copy() for side in ("left_skin", "right_skin")]
    place = data.qpos.copy()
    data.qpos[:] = np.nan
    mujoco.mj_forward(model, data)
    assert all(is_unloaded(fingerpad_mujoco.read_patches(data, side)) for side in ("left_skin", "right_skin"))
    data.qpos[:] = place
    mujoco.mj_forward(model, data)
    assert all(np.abs(fingerpad_mujoco.read_patches(data, side + "_skin")["force_n"] - old["force_n"]).max() < 0.01 for side, old in zip(("left", "right"), before))
    data.ctrl[1:] = -1
    mujoco.mj_step(model, data, 100)
    assert all(is_unloaded(fingerpad_mujoco.read_patches(data, side)) for side in ("left_skin", "right_skin"))


def on_two_blocks(sensor="skin", contact="tip", model_file=scenes.PAD_FILE):
    blocks = "".join(f'<geom name="{name}" type="box" size="0.02 0.02 0.01" pos="{x} 0 -0.01"/>' for name, x in (("near", -0.019), ("far", 0.021)))
    return scenes.with_skin(
        f"""<mujoco><extension><plugin plugin="fingerpad.contact">{scenes.instance("tip", "tip", "near far", model_file=model_file)}</plugin></extension>
        <worldbody>{blocks}<body><joint name="down" type="slide" axis="0 0 -1"/><geom size="0.008" pos="0 0 0.02" contype="0" conaffinity="0"/>
        <site name="tip" euler="0 30 0"/></body></worldbody><sensor>{scenes.sensor("tip")}</sensor></mujoco>""",
        **{sensor: contact},
    )


def test_patches_on_two_geoms_add_up():
    model = mujoco.MjModel.from_xml_string(on_two_blocks())
    data = mujoco.MjData(model)
    data.joint("down").qpos[0] = 0.001
    mujoco.mj_forward(model, data)
    patches, contacts = fingerpad_mujoco.read_patches(data, "skin"), fingerpad_mujoco.read(data, "tip")
    force = data.site("tip").xmat.reshape(3, 3) @ patches["force_n"].sum(0)
    touching = [c for c in contacts if c["normal_force_n"] > 0.1]
    assert touching and force[2] == pytest.approx(sum(c["normal_force_n"] for c in contacts), rel=1e-5)


@pytest.mark.parametrize(
    "scene, reason",
    [
        (dict(contact="thumb"), 'sensor \'skin\': attribute contact = "thumb": the model has no instance of fingerpad.contact of this name'),
        (dict(contact=""), "the model has no instance of fingerpad.contact of this name"),
        (dict(model_file=scenes.MODEL_FILE), "its model is a bed of springs, which has no patches; a pad has them"),
    ],
)
def test_what_has_no_patches_is_refused_by_name(scene, reason, capfd, own_folder):
    assert reason in why_refused(on_two_blocks(**scene), capfd, own_folder)


def test_a_composed_sensor_finds_its_own_finger():
    spec = mujoco.MjSpec()
    for k, prefix in enumerate(("L_", "R_")):
        spec.attach(mujoco.MjSpec.from_string(on_two_blocks()), prefix=prefix, frame=spec.worldbody.add_frame(pos=[0.2 * k, 0, 0]))
    model = spec.compile()
    data = mujoco.MjData(model)
    data.joint("L_down").qpos[0], data.joint("R_down").qpos[0] = -0.001, 0.001
    mujoco.mj_forward(model, data)
    assert is_unloaded(fingerpad_mujoco.read_patches(data, "L_skin")) and not is_unloaded(fingerpad_mujoco.read_patches(data, "R_skin"))


def test_the_example_shows_slip_that_begins_at_the_rim():
    rows = skin.story()
    sticks = [row["stick_ratio"] for row in rows]
    assert sticks == sorted(sticks, reverse=True) and sticks[0] > 0.6 and sticks[-1] < 0.1
    # The middle third sticks longer than the rest.
    middle = rows[len(rows) // 2]
    assert middle["stick_ratio_inside"] > middle["stick_ratio_outside"] + 0.1, middle
