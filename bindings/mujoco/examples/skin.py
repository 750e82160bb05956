"""A pad as a tactile skin: a plate is pulled from under a finger that presses with 1 N, and the patches show where the skin sticks and slips.

    python examples/skin.py
"""

import mujoco
import numpy as np

import scenes

import fingerpad_mujoco

#: Pull on the plate, N, and time for each, s.
PULLS_N, HOLD_S = (0.1, 0.5, 0.9, 1.1, 1.25), 0.1

SCENE = f"""<mujoco>
  {scenes.extension(scenes.instance("tip", "tip", "plate", model_file=scenes.PAD_FILE))}
  <worldbody>
    <body name="plate" pos="0 0 -0.005">
      <joint name="pull" type="slide" axis="1 0 0" damping="5"/>
      <geom name="plate" type="box" size="0.05 0.05 0.005" contype="0" conaffinity="0"/>
    </body>
    <body name="finger">
      <joint name="press" type="slide" axis="0 0 -1" damping="5"/>
      <geom size="0.008" pos="0 0 0.012" mass="0.03" contype="0" conaffinity="0"/>
      <site name="tip" euler="0 30 0"/>
    </body>
  </worldbody>
  <actuator><motor name="press" joint="press"/><motor name="pull" joint="pull"/></actuator>
  <sensor>{scenes.sensor("tip")}</sensor>
</mujoco>"""


def story(each=lambda pull_n, patches, contact: None):
    """Pulls the plate harder and harder; returns what the skin feels at each pull: stick ratio of the contact, of the patches within 5 mm of
    the middle of the pressure, and of the others."""
    model = mujoco.MjModel.from_xml_string(scenes.with_skin(SCENE, skin="tip"))
    data, rows = mujoco.MjData(model), []
    data.ctrl[0] = 1 - 0.03 * scenes.GRAVITY
    mujoco.mj_step(model, data, 500)
    for pull_n in PULLS_N:
        data.ctrl[1] = pull_n
        mujoco.mj_step(model, data, round(HOLD_S / model.opt.timestep))
        patches, contact = fingerpad_mujoco.read_patches(data, "skin"), fingerpad_mujoco.read(data, "tip")[0]
        each(pull_n, patches, contact)
        middle = np.average(patches["position_m"], axis=0, weights=patches["pressure_pa"])
        inside = np.linalg.norm(patches["position_m"] - middle, axis=1) < 0.005
        ratio = lambda which: np.average(patches["stick_ratio"][which], weights=patches["contact_area_m2"][which])
        rows.append(
            {"pull_n": pull_n, "stick_ratio": contact["stick_ratio"], "stick_ratio_inside": ratio(inside), "stick_ratio_outside": ratio(~inside)}
        )
    return rows


def draw(pull_n, patches, contact):
    """Prints a map of the patches, seen from the nail: x down the page to proximal, y across. `#` sticks, `+` slips in part, `.` slips, blank
    touches nothing."""
    x, y = (1e3 * patches["position_m"][:, k] for k in (0, 1))
    rows = [[" "] * 25 for _ in range(13)]
    for i in np.argsort(patches["contact_area_m2"]):
        if patches["contact_area_m2"][i] > 0:
            stick = patches["stick_ratio"][i]
            rows[round(min(max(x[i] + 12, 0), 24) / 2)][round(min(max(y[i] + 12, 0), 24))] = "#" if stick > 0.9 else "+" if stick > 0.1 else "."
    print(f"pull {pull_n} N, friction {contact['friction_x_n']:.2f} N, {sum(patches['force_n'][:, 2] > 0)} patches touch, slip margin {contact['slip_margin']:.2f}")
    print("\n".join("    " + "".join(row).rstrip() for row in rows if "".join(row).strip()))


if __name__ == "__main__":
    story(draw)
