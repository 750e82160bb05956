"""Hands that are composed with MjSpec.attach; model files that count from the model's folder."""

import shutil

import mujoco
import pytest
import scenes

import fingerpad_mujoco

HAND = f"""<mujoco>
  {scenes.extension(scenes.instance("index", "tip", "{geoms}", model_file="finger.fpm"))}
  <worldbody>
    <body name="finger" pos="0 0 -0.001">
      <joint name="press" type="slide" axis="0 0 1"/>
      <geom name="bone" type="sphere" size="0.005" mass="0.02" contype="0" conaffinity="0"/>
      <site name="tip" euler="0 30 0"/>
    </body>
    {{more}}
  </worldbody>
  <sensor>{scenes.sensor("index")}</sensor>
</mujoco>"""


def hand(folder, geoms="plate", more="", model_file=scenes.PAD_FILE):
    folder.mkdir(exist_ok=True)
    shutil.copy(model_file, folder / "finger.fpm")
    (folder / "hand.xml").write_text(HAND.format(geoms=geoms, more=more))
    return folder / "hand.xml"


def plate():
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(name="plate", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1], contype=0, conaffinity=0)
    return spec


def attach(spec, part, x=0.0, **affixes):
    spec.attach(part, frame=spec.worldbody.add_frame(pos=[x, 0, 0]), **affixes)


def forces(model, sensors):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return [fingerpad_mujoco.read(data, name)[0]["normal_force_n"] for name in sensors]


def test_two_hands_with_prefixes_are_those_of_one_hand(tmp_path):
    path = hand(tmp_path / "hands")
    alone = plate()
    attach(alone, fingerpad_mujoco.spec_from_path(path), prefix="only_")
    [one] = forces(alone.compile(), ["only_index"])
    both = plate()
    attach(both, fingerpad_mujoco.spec_from_path(path), prefix="L_")
    attach(both, fingerpad_mujoco.spec_from_path(path), x=0.2, prefix="R_", suffix="_2")
    assert forces(both.compile(), ["L_index", "R_index_2"]) == [one, one] and one > 0.1


def test_hands_within_hands(tmp_path):
    path = hand(tmp_path / "hands")
    robot = plate()
    attach(robot, fingerpad_mujoco.spec_from_path(path), prefix="inner_")
    world = mujoco.MjSpec()
    attach(world, robot, prefix="outer_")
    assert forces(world.compile(), ["outer_inner_index"])[0] > 0.1


def test_each_hand_touches_its_own_object(tmp_path):
    # A box in each hand, at another height.
    box = '<geom name="cube" type="box" size="0.02 0.02 0.02" pos="0 0 -0.02" contype="0" conaffinity="0"/>'
    path = hand(tmp_path / "hands", geoms="cube", more=box)
    both = mujoco.MjSpec()
    for x, prefix in ((0.0, "L_"), (0.2, "R_")):
        attach(both, fingerpad_mujoco.spec_from_path(path), x=x, prefix=prefix)
    model = both.compile()
    model.geom("R_cube").pos[2] += 1e-3
    left, right = forces(model, ["L_index", "R_index"])
    assert right > 2 * left > 0.1


def test_a_name_that_fits_two_objects_is_refused(tmp_path):
    box = '<geom name="cube" type="box" size="0.02 0.02 0.02" contype="0" conaffinity="0"/>'
    world = mujoco.MjSpec.from_string(f'<mujoco><worldbody>{box}</worldbody></mujoco>')
    attach(world, fingerpad_mujoco.spec_from_path(hand(tmp_path / "hands", geoms="cube", more=box)), prefix="L_")
    with pytest.raises(ValueError, match="geoms = \"cube\": the model has an object of this name and one with a prefix"):
        world.compile()
    # The whole name settles it.
    for plugin in world.plugins:
        plugin.config = dict(plugin.config) | {"geoms": "L_cube"}
    world.compile()


def test_a_model_file_counts_from_the_models_folder(tmp_path, own_folder):
    path = hand(own_folder / "deep", more='<geom name="plate" type="plane" size="1 1 1" contype="0" conaffinity="0"/>')
    model = fingerpad_mujoco.model_from_path(path.relative_to(own_folder))
    assert forces(model, ["index"])[0] > 0.1
    # MuJoCo gives a plugin no folder.
    with pytest.raises(ValueError, match="counts from the working directory"):
        mujoco.MjModel.from_xml_path(str(path))
