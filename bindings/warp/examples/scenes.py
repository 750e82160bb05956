"""The scene of the examples and tests: a block of 45 g between two fingers, for MuJoCo Warp in many worlds.

The left finger stands, the right one is pushed by the motor `grip`. Metres, kilograms, newtons, as MuJoCo has them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import mujoco_warp
import numpy as np
import warp as wp

import fingerpad_warp as fw
from fingerpad_warp.mujoco import Callback

MODELS = Path(__file__).resolve().parents[3] / "data/models"
MASS_KG, GRAVITY = 0.045, 9.81
FINGERS = [("left", "object"), ("right", "object")]

GRIP = """<mujoco>
  <option timestep="{timestep}" integrator="{integrator}" gravity="0 0 0"><flag contact="disable"/></option>
  <worldbody>
    <body name="left_finger"><site name="left" pos="-0.02 0 0" xyaxes="0.5 0 0.8660254037844386 0 1 0"/></body>
    <body name="right_finger">
      <joint name="grip" type="slide" axis="-1 0 0" damping="2" range="-0.02 0.02"/>
      <geom type="capsule" size="0.004" fromto="0.05 0 0 0.03 0 0" mass="0.02"/>
      <site name="right" pos="0.02 0 0" xyaxes="-0.5 0 0.8660254037844386 0 -1 0"/>
    </body>
    <body name="object">
      <freejoint name="object"/>
      <geom name="object" type="{geom}" size="0.02 0.02 0.03" mass="{mass_kg}"/>
    </body>
  </worldbody>
  <actuator><motor name="grip" joint="grip"/></actuator>
</mujoco>"""


def grip(
    worlds: int, timestep: float = 0.004, integrator: str = "Euler", geom: str = "box", mass_kg: float = MASS_KG, **options: Any
) -> tuple[Any, Any, Any, Any]:
    """The MuJoCo model, MuJoCo Warp's model and data, and the callback; `options` are those of `Callback`."""
    mj_model = mujoco.MjModel.from_xml_string(GRIP.format(timestep=timestep, integrator=integrator, geom=geom, mass_kg=mass_kg))
    mj_data = mujoco.MjData(mj_model)
    mujoco.mj_forward(mj_model, mj_data)
    m = mujoco_warp.put_model(mj_model)
    d = mujoco_warp.put_data(mj_model, mj_data, nworld=worlds)
    options.setdefault("model", fw.Model.from_file(MODELS / "fingertip.fpm"))
    return mj_model, m, d, Callback(options.pop("model"), mj_model, m, d, options.pop("contacts", FINGERS), **options)


def set_gravity(m: Any, gravity: float) -> None:
    """Switches the weight on."""
    m.opt.gravity.assign(np.array([[0, 0, -gravity]], np.float32))


def seconds(m: Any, d: Any, duration: float, timestep: float = 0.004) -> None:
    """Simulates for a while."""
    for _ in range(round(duration / timestep)):
        mujoco_warp.step(m, d)


def place_mm(d: Any) -> Any:
    """Place of the object in each world, mm."""
    return 1e3 * d.qpos.numpy()[:, 1:4].astype(np.float64)


def mean_place_mm(m: Any, d: Any, steps: int = 50) -> Any:
    """Place of the object in each world, mm, as the mean over some steps: single precision makes it tremble by some 1e-6 mm."""
    places = []
    for _ in range(steps):
        mujoco_warp.step(m, d)
        places.append(place_mm(d))
    return np.mean(places, axis=0)


LIFT = """<mujoco>
  <option timestep="{timestep}" integrator="{integrator}" cone="{cone}" jacobian="{jacobian}"/>
  {plugin}
  <worldbody>
    <geom type="plane" size="1 1 0.1" friction="0.5 0.005 0.0001"/>
    <body name="hand" pos="0 0 0.032">
      <joint name="lift" type="slide" axis="0 0 1" damping="20"/>
      <geom size="0.02" pos="0 0 0.12" mass="0.3" contype="0" conaffinity="0"/>
      {fingers}
    </body>
    <body name="object" pos="0 0 0.0305">
      <freejoint/>
      <geom name="object" type="box" size="0.02 0.02 0.03" mass="{mass_kg}" friction="0.5 0.004 0.0001" condim="4"/>
    </body>
  </worldbody>
  <equality><joint joint1="left" joint2="right" polycoef="0 1 0 0 0"/></equality>
  <actuator>
    <position name="hand" joint="lift" kp="500" dampratio="1"/><motor name="left" joint="left"/><motor name="right" joint="right"/>
  </actuator>
  {sensors}
</mujoco>"""
LIFT_FINGER = """<body name="{side}_finger" pos="{out}0.024 0 0">
  <joint name="{side}" type="slide" axis="{back}1 0 0" damping="3"/>
  <geom type="capsule" size="0.004" fromto="{out}0.012 0 0 {out}0.012 0 0.06" mass="0.03" contype="0" conaffinity="0"/>
  <site name="{side}" xyaxes="{back}0.5 0 -0.8660254037844386 0 {out}1 0"/>
</body>"""
#: Numbers of MuJoCo's model that follow from the masses.
OF_MASS = "body_mass", "body_subtreemass", "body_inertia", "body_invweight0", "dof_invweight0"


def lift_model(
    mass_kg: float, timestep: float, integrator: str = "Euler", cone: str = "pyramidal", jacobian: str = "auto", plugin: str = "", sensors: str = ""
) -> Any:
    """A block on a table, which it touches by MuJoCo's own contact, between two fingers of a hand. Actuators `hand`, m, `left` and `right`, N."""
    fingers = "".join(LIFT_FINGER.format(side=side, out=out, back=back) for side, out, back in (("left", "-", ""), ("right", "", "-")))
    return mujoco.MjModel.from_xml_string(LIFT.format(**locals()))


def lift(masses_kg: Any, model: Any, timestep: float, njmax: int = 100, **options: Any) -> tuple[Any, Any, Any]:
    """MuJoCo Warp's model and data of that block in worlds with these masses, and the callback."""
    models = [lift_model(mass, timestep, **options) for mass in masses_kg]
    mj_data = mujoco.MjData(models[0])
    mujoco.mj_forward(models[0], mj_data)
    m, d = mujoco_warp.put_model(models[0]), mujoco_warp.put_data(models[0], mj_data, nworld=len(models), nconmax=16, njmax=njmax)
    for name in OF_MASS:
        values, old = np.array([getattr(each, name) for each in models], np.float32), getattr(m, name)
        setattr(m, name, wp.array(values.reshape(len(models), *old.shape[1:], -1).squeeze(-1) if old.dtype == float else values, dtype=old.dtype))
    return m, d, Callback(model, models[0], m, d, FINGERS)
