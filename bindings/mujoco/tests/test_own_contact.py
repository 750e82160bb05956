"""The parameters of MuJoCo's own contact that `fingerpad export --format mujoco-contact-json` wrote: a sphere with them has the depth, the limits and
the creep that the file states, of the human finger and of a silicone tip. A test of the program holds that the files are what it writes."""

import json
import pathlib

import mujoco
import numpy as np
import pytest

HERE = pathlib.Path(__file__).resolve().parent


@pytest.fixture(params=["fingertip", "silicone-dome"])
def stated(request):
    return json.loads((HERE / f"contact_{request.param}.json").read_text())


def pressed(stated, force_n, pull_n=0.0, torque_n_m=0.0):
    """A sphere with the parameters that is pressed onto a plate, pulled and turned, after a second and 0.1 s later; `body_invweight0` is the file's."""
    words = {key: " ".join(map(str, stated[key])) for key in ("solref", "solimp", "friction")}
    # Two slides: a third of the inverse mass for each.
    mass = 2 / 3 / stated["inverse_mass_per_kg"]
    model = mujoco.MjModel.from_xml_string(f"""<mujoco>
      <option timestep="0.0005" gravity="0 0 0" cone="elliptic" impratio="10"/>
      <worldbody>
        <geom type="plane" size="1 1 1"/>
        <body><joint name="press" type="slide" axis="0 0 -1"/><joint name="pull" type="slide" axis="1 0 0"/><joint name="turn" axis="0 0 1"/>
          <geom type="sphere" size="0.008" pos="0 0 0.008" mass="{mass}" priority="1" condim="{stated['condim']}"
                friction="{words['friction']}" solref="{words['solref']}" solimp="{words['solimp']}"/></body>
      </worldbody></mujoco>""")
    assert model.body_invweight0[1, 0] == pytest.approx(stated["inverse_mass_per_kg"], rel=1e-6)
    data, seen = mujoco.MjData(model), []
    for seconds, loads in ((1.0, (force_n, 0, 0)), (0.9, (force_n, pull_n, torque_n_m)), (0.1, (force_n, pull_n, torque_n_m))):
        data.qfrc_applied[:] = loads
        mujoco.mj_step(model, data, round(seconds / model.opt.timestep))
        seen.append((data.qpos.copy(), data.qvel.copy()))
    return seen


@pytest.mark.parametrize("share", [0.5, 0.8, 1.0, 1.5])
def test_the_depth_is_the_pads_within_the_stated_error(stated, share):
    at = np.argmin(np.abs(np.array(stated["loads_n"]) - share * stated["load_n"]))
    depth_mm = 1e3 * pressed(stated, stated["loads_n"][at])[0][0][0]
    # Force grows faster than depth, so that a share of force is less in depth.
    most = abs(stated["normal_force_errors"][at]) + 1e-3
    assert depth_mm == pytest.approx(stated["depths_mm"][at], rel=most) and most < 0.03


@pytest.mark.parametrize("axis, limit, unit", [(1, "friction_limits_n", 1.0), (2, "torsional_limits_n_mm", 1e-3)])
def test_it_slips_at_the_stated_limit(stated, axis, limit, unit):
    most = unit * stated[limit][len(stated["loads_n"]) // 2]
    speeds = {}
    for share in (0.95, 1.05):
        loads = [0.0, 0.0]
        loads[axis - 1] = share * most
        (_, (_, early), (_, late)) = pressed(stated, stated["load_n"], *loads)
        speeds[share] = late[axis] - early[axis]
    # Below the limit it creeps at one speed; above it speeds up.
    scale = abs(speeds[1.05])
    assert abs(speeds[0.95]) < 1e-3 * scale and scale > (0.01 if axis == 1 else 1.0), speeds


def test_it_creeps_as_stated(stated):
    half = 0.5 * stated["friction_limits_n"][len(stated["loads_n"]) // 2]
    *_, (_, speed) = pressed(stated, stated["load_n"], half)
    assert speed[1] == pytest.approx(stated["creep_at_half_limit_m_per_s"], rel=0.02)
