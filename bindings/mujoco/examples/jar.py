"""Five fingers turn the lid of a jar, let go, reach back and turn on; a weak grip slips.

    python examples/jar.py                       what the lid did
    MUJOCO_GL=osmesa python examples/jar.py --picture jar.png     and a strip of pictures (needs pillow)

The lid has fifteen flat faces and resists with 0.07 N m; the hand's axis is 2 mm beside its own, so that the
fingers slide and spin on it as they turn it. After each stroke of 72
degrees the fingers find like faces again.
"""

import argparse

import mujoco
import numpy as np

import scenes

import fingerpad_mujoco

FINGERS = ("thumb", "index", "middle", "ring", "little")
STROKE_RAD = 2 * np.pi / 5
#: Where the lid's faces stand, m from its axis; resistance, N m.
FACE_M, RESISTANCE_N_M = 0.037, 0.07
#: Faces of the lid, of which three pass in a stroke.
FACES = 15
#: Grips that hold and that slip, N a finger.
HOLDS_N, SLIPS_N = 1.0, 0.1
#: Phases of a stroke and their ends, s: close, turn, open, reach back.
CLOSE_S, TURN_S, OPEN_S, BACK_S = 0.5, 2.0, 2.4, 3.4


def lid_faces():
    faces, width = [], FACE_M * np.tan(np.pi / FACES)
    for i, angle in enumerate(2 * np.pi / FACES * np.arange(FACES)):
        x, y = (FACE_M - 0.01) * np.cos(angle), (FACE_M - 0.01) * np.sin(angle)
        faces.append(
            f'<geom name="face{i}" type="box" size="0.01 {width} 0.012" pos="{x} {y} 0" euler="0 0 {np.degrees(angle)}" '
            f'mass="0.005" rgba="{"0.1 0.2 0.6 1" if i == 0 else "0.75 0.75 0.78 1"}"/>'
        )
    return "".join(faces)


def finger(name, angle):
    """A finger on a radial slide; its long axis points down, its pad to the lid."""
    cosine, sine = np.cos(angle), np.sin(angle)
    at = FACE_M + 0.003
    return f"""
      <body name="{name}" pos="{at * cosine} {at * sine} 0" xyaxes="0 0 -1 {-sine} {cosine} 0">
        <joint name="{name}" type="slide" axis="0 0 -1" range="-0.012 0.012" damping="3"/>
        <geom name="{name}" type="capsule" size="0.0075" fromto="-0.003 0 0.0078 -0.035 0 0.016" mass="0.03" contype="0" conaffinity="0"/>
        <geom type="capsule" size="0.007" fromto="-0.035 0 0.016 -0.07 0 0.002" mass="0.03" contype="0" conaffinity="0" rgba="0.8 0.62 0.5 1"/>
        <site name="{name}" size="0.001" euler="0 30 0"/>
      </body>"""


def scene(timestep=0.001):
    faces = " ".join(f"face{i}" for i in range(FACES))
    instances = [scenes.instance(name, name, faces) for name in FINGERS]
    fingers = "".join(finger(name, STROKE_RAD * i) for i, name in enumerate(FINGERS))
    motors = "".join(f'<motor name="{name}" joint="{name}"/>' for name in FINGERS)
    return f"""<mujoco>
  <option timestep="{timestep}" integrator="implicitfast"><flag contact="disable"/></option>
  <visual><global offwidth="480" offheight="480"/><headlight ambient="0.45 0.45 0.45" diffuse="0.35 0.35 0.35" specular="0 0 0"/><map znear="0.05"/></visual>
  <asset><texture type="skybox" builtin="flat" rgb1="1 1 1" width="8" height="8"/></asset>
  <statistic center="0 0 0.12" extent="0.25"/>
  {scenes.extension(*instances)}
  <worldbody>
    <light pos="0.2 -0.3 0.8" dir="-0.2 0.3 -0.8" diffuse="0.4 0.4 0.4" specular="0.1 0.1 0.1"/>
    <camera name="side" pos="0.24 -0.27 0.34" xyaxes="0.75 0.66 0 -0.36 0.41 0.84" fovy="38"/>
    <geom type="plane" size="3 3 0.1" contype="0" conaffinity="0" rgba="0.93 0.92 0.9 1"/>
    <geom type="cylinder" size="0.04 0.045" pos="0 0 0.045" contype="0" conaffinity="0" rgba="0.7 0.85 0.95 0.6"/>
    <body name="lid" pos="0 0 0.105">
      <joint name="lid" type="hinge" axis="0 0 1" frictionloss="{RESISTANCE_N_M}" armature="0.0005" solreffriction="0.004 1" solimpfriction="0.999 0.999 0.001 0.5 2"/>
      {lid_faces()}
      <geom type="cylinder" size="0.036 0.002" pos="0 0 0.0125" mass="0.005" contype="0" conaffinity="0" rgba="0.62 0.62 0.65 1"/>
      <geom type="box" size="0.016 0.002 0.001" pos="0.018 0 0.0145" mass="0.001" contype="0" conaffinity="0" rgba="0.1 0.2 0.6 1"/>
    </body>
    <body name="hand" pos="0.002 0 0.105">
      <joint name="wrist" type="hinge" axis="0 0 1"/>
      <geom type="cylinder" size="0.055 0.01" pos="0 0 0.075" mass="0.3" contype="0" conaffinity="0" rgba="0 0 0 0"/>
      {fingers}
    </body>
  </worldbody>
  <actuator>{motors}<position name="wrist" joint="wrist" kp="20" dampratio="1"/></actuator>
  <sensor>{"".join(scenes.sensor(name) for name in FINGERS)}</sensor>
</mujoco>"""


def smooth(share):
    share = np.clip(share, 0.0, 1.0)
    return share * share * (3 - 2 * share)


def command(data, grip_n, time):
    """Motors and wrist at a time within a stroke."""
    closed = time < TURN_S
    turned = smooth((time - CLOSE_S) / (TURN_S - CLOSE_S)) if closed else 1 - smooth((time - OPEN_S) / (BACK_S - OPEN_S))
    data.ctrl[:5] = grip_n * smooth(time / (0.5 * CLOSE_S)) if closed else -0.5
    data.ctrl[5] = STROKE_RAD * turned


def contacts(data):
    """The contact of each finger with the face that it presses most."""
    return [max(fingerpad_mujoco.read(data, name), key=lambda c: c["normal_force_n"]) for name in FINGERS]


def turn(grip_n, strokes=2, watch=None, timestep=0.001):
    """Turns the lid. Returns its angle, degrees, after each stroke, and the least slip margin while it turned.

    ``watch`` is called with the data every 10 ms."""
    model = mujoco.MjModel.from_xml_string(scene(timestep))
    data = mujoco.MjData(model)
    angles, margin = [], 1.0
    for stroke in range(strokes):
        for i in range(round(BACK_S / 0.01)):
            command(data, grip_n, 0.01 * i)
            mujoco.mj_step(model, data, round(0.01 / timestep))
            if CLOSE_S < 0.01 * i < TURN_S:
                margin = min([margin] + [c["slip_margin"] for c in contacts(data)])
            if watch:
                watch(model, data, stroke * BACK_S + 0.01 * (i + 1))
        angles.append(np.degrees(data.joint("lid").qpos[0]))
    return dict(angles_deg=angles, least_margin=margin, data=data)


def frames(grip_n, times, size):
    """Pictures at the given times; the fingertips are green while they hold and turn red as they slip."""
    from PIL import Image, ImageDraw

    left, pictures = list(times), []

    def watch(model, data, time):
        if not left or time < left[0]:
            return
        left.pop(0)
        for name, contact in zip(FINGERS, contacts(data)):
            margin, touches = contact["slip_margin"], contact["normal_force_n"] > 0
            model.geom(name).rgba = [0.9 - 0.7 * margin, 0.15 + 0.55 * margin, 0.2, 1] if touches else [0.85, 0.68, 0.56, 1]
        with mujoco.Renderer(model, size, size) as renderer:
            renderer.update_scene(data, camera="side")
            image = Image.fromarray(renderer.render())
        text = f"{grip_n:g} N a finger, {time:.1f} s: lid at {np.degrees(data.joint('lid').qpos[0]):.0f}\N{DEGREE SIGN}"
        ImageDraw.Draw(image).text((12, 10), text, fill=(20, 20, 20), font_size=17)
        pictures.append(image)

    turn(grip_n, watch=watch)
    return pictures


def picture(path, size=320):
    """A strip of pictures: two strokes with a grip that holds, and one with a grip that slips."""
    from PIL import Image

    shown = frames(HOLDS_N, [0.6, 1.3, 2.0, 3.0, 4.7, 5.4], size) + frames(SLIPS_N, [0.6, 1.3, 2.0], size)
    strip = Image.new("RGB", (3 * size, 3 * size), "white")
    for i, frame in enumerate(shown):
        strip.paste(frame, (i % 3 * size, i // 3 * size))
    strip.save(path, optimize=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", metavar="FILE", help="write a strip of pictures")
    arguments = parser.parse_args()
    for grip_n in (HOLDS_N, SLIPS_N):
        result = turn(grip_n)
        angles = ", ".join(f"{angle:.1f}" for angle in result["angles_deg"])
        print(f"{grip_n:g} N a finger: lid at {angles} degrees after strokes of 72, least slip margin {result['least_margin']:.2f}")
    if arguments.picture:
        picture(arguments.picture)


if __name__ == "__main__":
    main()
