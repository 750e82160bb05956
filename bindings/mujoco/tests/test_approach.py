"""Before a contact: fingers that are far, that come too fast, that are turned round, that meet MuJoCo's own contact, and their bones."""

import mujoco
import numpy as np
import paths
import pytest
from paths import PAD, STILL, first_of
from scipy.spatial.transform import Rotation

import fingerpad_mujoco
import scenes


def contact_at(model, at, axes):
    """The contact of a finger that is placed there in the first step of all, in which the model of the finger is asked wherever it is."""
    return paths.lead(model, mujoco.MjData(model), (at, axes), *still(model))


def still(model):
    """The object at rest, if it can move."""
    return [STILL] if model.nbody > 2 else []


@pytest.mark.parametrize(
    "geom, scene",
    first_of(("egg", PAD), ("box", {}), ("plane", {}), *((geom, PAD) for geom in "box,plane,ball,rod,capsule,mesh egg,mesh box,mesh rod".split(","))),
)
def test_a_finger_that_counts_as_far_touches_nothing(geom, scene):
    random = np.random.default_rng(5)
    model, data = paths.model_and_data(geom=geom, **scene)
    paths.lead(model, data, (4 * paths.TOP, Rotation.identity()), *still(model))
    before, far = data.plugin_state.copy(), 0
    for _ in range(150):
        at, axes = random.uniform(-70, 70, 3), Rotation.random(rng=random)
        data.plugin_state[:] = before
        depth = paths.lead(model, data, (at, axes), *still(model))["depth_mm"]
        # The words of the library stay as they are while the finger is far.
        if (data.plugin_state[40:] == before[40:]).all():
            far += 1
            asked = contact_at(model, at, axes)
            assert depth < -2 and asked["normal_force_n"] == 0, (at, axes.as_quat(), depth, asked)
            # At an edge the depth of a pose beyond the fit may be positive without a force.
            assert asked["depth_mm"] <= 0 or asked["face"] > 6, asked
    assert 25 < far < 148


@pytest.mark.parametrize("scene", [dict(), PAD], ids=["bed", "pad"])
def test_a_finger_that_was_far_touches_as_one_that_never_was(scene):
    path = np.zeros((60, 6))
    path[:, 0] = np.concatenate([np.linspace(-40, -3, 20), np.linspace(-1.9, 1.5, 40)])
    path[:, 1] = np.linspace(0, 8, 60)
    contacts = paths.lead_along(path, **scene)
    alone = paths.lead_along(path[20:], **scene)
    assert contacts[20:] == alone and contacts[-1]["normal_force_n"] > 0.3 and contacts[-1]["status"] == 0
    assert [c["depth_mm"] for c in contacts[:20]] == pytest.approx(path[:20, 0], abs=0.2)


@pytest.mark.parametrize("speed, flagged", [(0.3, False), (3.0, True)])
def test_a_finger_that_comes_too_fast_is_flagged_before_it_goes_through(speed, flagged, own_folder):
    model, data = paths.model_and_data(geom="plane", **PAD)
    model.opt.timestep = 0.004
    flags = set()
    for height in np.arange(30.0, -20.0, -1e3 * speed * 0.004):
        flags |= set(fingerpad_mujoco.flags(paths.lead(model, data, ([0, 0, height], Rotation.identity()))["status"]))
    assert ("step_too_long" in flags) == flagged
    log = own_folder / "MUJOCO_LOG.TXT"
    said = log.read_text() if log.exists() else ""
    assert said.count("closer to geom 'object' by more than 2 mm in a step of 0.004 s") == flagged


TRAP = """<mujoco>
  {plugin}
  <worldbody>
    <body name="plate" pos="0 0 -0.01"><geom name="plate" type="box" size="0.1 0.1 0.01" {plate}/></body>
    <body name="finger"><joint type="slide" axis="0 0 -1" damping="5"/><geom size="0.008" pos="0 0 0.008" mass="0.03"/>{site}</body>
  </worldbody>
  <sensor>{sensor}</sensor>
</mujoco>"""
OFF = 'contype="0" conaffinity="0"'


@pytest.mark.parametrize(
    "site, plate, reason",
    [
        ('<site name="tip" euler="0 30 0"/>', OFF, None),
        ('<site name="tip" euler="180 30 0"/>', OFF, "site 'tip' reaches geom 'plate' with its back"),
        ('<site name="tip" euler="0 30 0"/>', "", "MuJoCo's own contact acts between the finger and geom 'plate'"),
    ],
    ids=["right", "turned round", "own contact"],
)
@pytest.mark.parametrize("scene", [dict(), PAD], ids=["bed", "pad"])
def test_a_trap_is_warned_of_once(site, plate, reason, scene, own_folder):
    plugin = scenes.extension(scenes.instance("index", "tip", "plate", **scene))
    model = mujoco.MjModel.from_xml_string(TRAP.format(plugin=plugin, plate=plate, site=site, sensor=scenes.sensor("index")))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 1000)
    log = own_folder / "MUJOCO_LOG.TXT"
    said = log.read_text() if log.exists() else ""
    assert said.count("WARNING") == (reason is not None) and (reason or "") in said, said


def from_the_side(below_mm, bones):
    """A pad that looks down, moved sideways by 50 mm/s so many mm below the top of a free block: depth at which a contact begins, mm, the
    largest speed of the block, m/s, and how far it was pushed, mm."""
    scene = f"""<mujoco>
      <option timestep="0.002"/>
      {scenes.extension(scenes.instance("index", "tip", "block", **PAD))}
      <worldbody>
        <geom type="plane" size="1 1 .1"/>
        <body name="block" pos="0 0 0.025"><freejoint/><geom name="block" type="box" size="0.025 0.025 0.025" mass="0.071"/></body>
        <body name="finger" mocap="true" pos="-0.06 0 {0.05 - 1e-3 * below_mm}"><site name="tip" xyaxes="-0.8660254 0 -0.5 0 -1 0"/></body>
      </worldbody>
      <sensor>{scenes.sensor("index")}</sensor>
    </mujoco>"""
    spec = mujoco.MjSpec.from_string(scene)
    assert not bones or fingerpad_mujoco.add_bones(spec) == ["tip_bone"]
    model = spec.compile()
    data, began, speed = mujoco.MjData(model), None, 0.0
    for _ in range(600):
        data.mocap_pos[0, 0] += 0.05 * 0.002
        mujoco.mj_step(model, data)
        contact = fingerpad_mujoco.read(data, "index")[0]
        if began is None and contact["normal_force_n"] > 0:
            began = contact["depth_mm"]
        speed = max(speed, np.abs(data.qvel[:3]).max())
    return began, speed, 1e3 * data.body("block").xpos[0]


@pytest.mark.parametrize("below_mm", first_of(15, 2, 20))
def test_a_pad_from_the_side_starts_near_the_surface_and_its_bone_pushes(below_mm):
    began, speed, _ = from_the_side(below_mm, bones=False)
    assert (began or 0) < 0.01 and speed < 0.05
    began, speed, pushed_mm = from_the_side(below_mm, bones=True)
    assert (began or 0) < 0.1 and speed < 0.2
    # The inclined bone passes over the block 2 mm below its top.
    assert below_mm < 6 or pushed_mm > 5, pushed_mm


def test_bones_of_composed_hands_touch_geoms_and_each_other():
    spec = mujoco.MjSpec.from_string(scenes.lifted())
    assert fingerpad_mujoco.add_bones(spec) == ["left_bone", "right_bone"]
    part = mujoco.MjSpec.from_string(scenes.lifted(timestep=0.002))
    world = mujoco.MjSpec()
    world.attach(part, prefix="L_", frame=world.worldbody.add_frame())
    assert fingerpad_mujoco.add_bones(world) == ["L_left_bone", "L_right_bone"]
    model = world.compile()
    pairs = {frozenset(model.geom(g).name for g in (model.pair_geom1[i], model.pair_geom2[i])) for i in range(model.npair)}
    left, right, held = "L_left_bone", "L_right_bone", "L_object"
    assert pairs == {frozenset(p) for p in ((left, right), (left, held), (right, held))}
    # Beyond the range of the pad in the neutral pose: 6 to 7 mm from a flat face at the site.
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bone, site = data.geom(left), data.site("L_left")
    ends = [bone.xpos + s * model.geom(left).size[1] * bone.xmat.reshape(3, 3)[:, 2] for s in (-1, 1)]
    assert 6.0 < 1e3 * min(site.xpos[0] - end[0] for end in ends) - 4.0 < 7.0
