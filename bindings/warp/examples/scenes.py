"""The scene of the examples and tests: a block of 45 g between two fingers, for MuJoCo Warp in many worlds.

The left finger stands, the right one is pushed by the motor `grip`. Metres, kilograms, newtons, as MuJoCo has them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import mujoco_warp
import numpy as np

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
