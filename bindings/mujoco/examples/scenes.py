"""The scenes of the examples and tests, as MJCF. Metres, kilograms, newtons, as MuJoCo has them."""

import meshes
import numpy as np

from fingerpad_mujoco import MODELS

#: The bed, which is of one pose on a plane, and the pad, which follows the pose on every geom that it can touch.
MODEL_FILE, PAD_FILE = MODELS / "fingertip.fpm", MODELS / "fingertip-pad.fpm"
#: Half the object's width, where the fingers touch it, m.
HALF_WIDTH = 0.02
MASS_KG = 0.045
GRAVITY = 9.81


def instance(name, site, geoms, **attributes):
    """The element of one plugin instance; attributes as in the documentation."""
    attributes = {"model_file": MODEL_FILE, "site": site, "geoms": geoms, **attributes}
    configs = "".join(f'<config key="{key}" value="{value}"/>' for key, value in attributes.items())
    return f'<instance name="{name}">{configs}</instance>'


def sensor(name):
    """The sensor of the instance of the same name."""
    return f'<plugin name="{name}" plugin="fingerpad.contact" instance="{name}"/>'


def with_skin(scene, **contacts):
    """The scene with sensors of the patches: names of the sensors and of the instances whose fingers they are of."""
    sensors = "".join(
        f'<plugin name="{name}" plugin="fingerpad.patches"><config key="contact" value="{contact}"/></plugin>' for name, contact in contacts.items()
    )
    scene = scene.replace("<extension>", '<extension><plugin plugin="fingerpad.patches"/>', 1)
    return scene.replace("</sensor>", f"{sensors}</sensor>", 1)


def extension(*instances):
    return f'<extension><plugin plugin="fingerpad.contact">{"".join(instances)}</plugin></extension>'


#: What stands in <option> for each of MuJoCo's own ways to hold the object. `stock` is MuJoCo as it comes; `best` what its
#: manual recommends against slow slip: elliptic cones, impratio, the solver without slip, with all of its iterations; `noslip` the same with the
#: tolerance that MuJoCo has by default.
MUJOCO = {
    "stock": "",
    "impratio": 'cone="elliptic" impratio="100"',
    "noslip": 'cone="elliptic" impratio="100" noslip_iterations="20"',
    "best": 'cone="elliptic" impratio="100" noslip_iterations="20" noslip_tolerance="0"',
}


#: Objects to hold: half the width where the fingers touch them, m, mass, kg, and geom. A pen and a tube lie across the fingers.
OBJECTS = {
    "block": (HALF_WIDTH, MASS_KG, f'type="box" size="{HALF_WIDTH} 0.02 0.03"'),
    "pen": (0.004, 0.02, 'type="cylinder" size="0.004 0.07" euler="90 0 0"'),
    "rod": (0.004, 0.02, 'type="capsule" size="0.004 0.07"'),
    "ball": (0.01, 0.033, 'type="sphere" size="0.01"'),
    # A key of 2 mm, a coin of 23 mm, a card of 0.8 mm, a plate of 6 mm, a die of 16 mm: flat between the fingers.
    "key": (0.001, 0.01, 'type="box" size="0.001 0.012 0.028"'),
    "coin": (0.00117, 0.0075, 'type="cylinder" size="0.0116 0.00117" euler="0 90 0"'),
    "card": (0.0004, 0.005, 'type="box" size="0.0004 0.027 0.0428"'),
    "plate": (0.003, 0.012, 'type="box" size="0.003 0.02 0.03"'),
    "tube": (0.01, 0.05, 'type="cylinder" size="0.01 0.05" euler="90 0 0"'),
    "die": (0.008, 0.005, 'type="box" size="0.008 0.008 0.008"'),
    # The same bodies as convex meshes.
    "mesh ball": (0.01, 0.033, 'type="mesh" mesh="ball"'),
    "mesh pen": (0.004, 0.02, 'type="mesh" mesh="pen" euler="90 0 0"'),
    "mesh tube": (0.01, 0.05, 'type="mesh" mesh="tube" euler="90 0 0"'),
    "mesh die": (0.008, 0.005, 'type="mesh" mesh="die"'),
    "mesh key": (0.001, 0.01, 'type="mesh" mesh="key"'),
}
#: The meshes of OBJECTS.
MESHES = {
    "ball": lambda: meshes.sphere(0.01, rings=24),
    "pen": lambda: meshes.cylinder(0.004, 0.07),
    "tube": lambda: meshes.cylinder(0.01, 0.05),
    "die": lambda: meshes.box((0.008, 0.008, 0.008)),
    "key": lambda: meshes.box((0.001, 0.012, 0.028)),
}


def grip(
    contact="fingerpad", timestep=0.001, integrator="Euler", mass=None, friction=1.5, torsion=0.004, held="block", **attributes
):
    """An object between two fingers: the left one stands, the right one is pushed by the motor `grip`, N; both hang on a hand
    that the actuator `hand` moves up and down, m.

    ``contact``: `fingerpad`, `none`, or one of MUJOCO, then with the coefficients ``friction`` and ``torsion`` (m).
    ``held``: one of OBJECTS; ``mass``: in place of its own.
    ``attributes``: of the plugin.
    """
    own, option = contact == "fingerpad", MUJOCO.get(contact)
    half, own_mass, geom = OBJECTS[held]
    mesh = held.removeprefix("mesh ")
    asset = f"<asset>{meshes.element(mesh, *MESHES[mesh]())}</asset>" if mesh != held else ""
    pad = "" if option is None else (
        f'<geom name="{{}}_pad" type="sphere" size="0.008" pos="{{}} 0 0" mass="0" condim="4" '
        f'friction="{friction} {torsion} 0.0001"/>'
    )
    flag = '<flag contact="disable"/>' if option is None else ""
    plugin = extension(*(instance(s, s, "object", **attributes) for s in ("left", "right"))) if own else ""
    sensors = f'<sensor>{sensor("left")}{sensor("right")}</sensor>' if own else ""
    collides = "" if option is None else f'condim="4" friction="{friction} {torsion} 0.0001"'
    return f"""<mujoco>
  <option timestep="{timestep}" integrator="{integrator}" {option or ""}>{flag}</option>
  <size nuserdata="4"/>
  {plugin}
  {asset}
  <worldbody>
    <body name="hand">
      <joint name="hand" type="slide" axis="0 0 1"/>
      <geom type="box" size="0.06 0.01 0.01" pos="0 0.06 0" mass="0.5" contype="0" conaffinity="0"/>
      <body name="left_finger">
        <geom type="capsule" size="0.004" fromto="-0.05 0 0 -0.03 0 0" mass="0.02" contype="0" conaffinity="0"/>
        {pad.format("left", -half - 0.008)}
        <site name="left" pos="{-half} 0 0" xyaxes="0.5 0 0.8660254037844386 0 1 0"/>
      </body>
      <body name="right_finger">
        <joint name="grip" type="slide" axis="-1 0 0" damping="2" range="-0.02 0.02"/>
        <geom type="capsule" size="0.004" fromto="0.05 0 0 0.03 0 0" mass="0.02" contype="0" conaffinity="0"/>
        {pad.format("right", half + 0.008)}
        <site name="right" pos="{half} 0 0" xyaxes="-0.5 0 0.8660254037844386 0 -1 0"/>
      </body>
    </body>
    <body name="object">
      <freejoint name="object"/>
      <geom name="object" {geom} mass="{mass or own_mass}" {collides}/>
    </body>
  </worldbody>
  <actuator>
    <motor name="grip" joint="grip"/>
    <position name="hand" joint="hand" kp="20000" dampratio="1"/>
  </actuator>
  {sensors}
</mujoco>"""


def pinched(contact="fingerpad", kp=6000, **attributes):
    """The scene of google-deepmind/mujoco#3328: two pads on damped slides squeeze a rod of 45 g and 4 mm radius, which lies across them.

    ``contact``: `fingerpad`, or what stands in <option> for MuJoCo's own contact of boxes with friction 0.7. Actuators `left` and `right`: places
    of the pads, m, 0.5 mm from the rod at 0; ``kp``: their stiffness, N/m.
    """
    own, bodies = contact == "fingerpad", ""
    for sign, name in ((1, "left"), (-1, "right")):
        touch = (
            f'<geom size="0.008" pos="{-sign * 0.012} 0 0" mass="0.2" contype="0" conaffinity="0"/>'
            f'<site name="{name}" pos="{sign * 0.008} 0 0" xyaxes="{sign * 0.5} 0 0.8660254037844386 0 {sign} 0"/>'
            if own
            else '<geom type="box" size="0.008 0.03 0.02" mass="0.2" friction="0.7 0.005 0.0001"/>'
        )
        bodies += f'<body name="{name}" pos="{-sign * 0.0125} 0 0"><joint name="{name}" type="slide" axis="{sign} 0 0" damping="100"/>{touch}</body>'
    rod = "" if not own else 'contype="0" conaffinity="0"'
    attributes = {"model_file": PAD_FILE, **attributes}
    return f"""<mujoco>
  <option timestep="0.002" {"" if own else contact}/>
  {extension(*(instance(name, name, "rod", **attributes) for name in ("left", "right"))) if own else ""}
  <worldbody>
    {bodies}
    <body name="rod"><freejoint name="rod"/><geom name="rod" type="capsule" size="0.004 0.025" euler="90 0 0" mass="0.045" {rod}/></body>
  </worldbody>
  <actuator><position name="left" joint="left" kp="{kp}"/><position name="right" joint="right" kp="{kp}"/></actuator>
  {f"<sensor>{sensor('left')}{sensor('right')}</sensor>" if own else ""}
</mujoco>"""


def five(contact="fingerpad", held="box", timestep=0.002, **attributes):
    """A box or a cylinder of 20 x 100 mm and 100 g that a thumb and four fingers hold from two sides: actuators `thumb`, N, and `finger0` to
    `finger3`. ``contact`` as in :func:`grip`."""
    own, option = contact == "fingerpad", MUJOCO.get(contact)
    names = ("thumb", "finger0", "finger1", "finger2", "finger3")
    collides = "" if option is None else 'condim="4" friction="1.5 0.004 0.0001"'
    bodies = ""
    for k, name in enumerate(names):
        sign, y = (1, 0.0) if k == 0 else (-1, 0.02 * (k - 2.5))
        ball = "" if option is None else f'<geom type="sphere" size="0.008" pos="{sign * 0.018} {y} 0" mass="0" {collides}/>'
        bodies += (
            f'<body name="{name}"><joint name="{name}" type="slide" axis="{-sign} 0 0" damping="2"/>'
            f'<geom size="0.005" pos="{sign * 0.04} {y} 0" mass="0.02" contype="0" conaffinity="0"/>{ball}'
            f'<site name="{name}" pos="{sign * 0.01} {y} 0" xyaxes="{-sign * 0.5} 0 0.8660254037844386 0 {-sign} 0"/></body>'
        )
    geom = 'type="box" size="0.01 0.05 0.02"' if held == "box" else 'type="cylinder" size="0.01 0.05" euler="90 0 0"'
    plugin = extension(*(instance(name, name, "object", **attributes) for name in names)) if own else ""
    return f"""<mujoco>
  <option timestep="{timestep}" {option or ""}>{'<flag contact="disable"/>' if option is None else ""}</option>
  {plugin}
  <worldbody>{bodies}<body name="object"><freejoint/><geom name="object" {geom} mass="0.1" {collides}/></body></worldbody>
  <actuator>{"".join(f'<motor name="{name}" joint="{name}"/>' for name in names)}</actuator>
  <sensor>{"".join(map(sensor, names)) if own else ""}</sensor>
</mujoco>"""


def rolling_grip(held="pen", timestep=0.001, **attributes):
    """As :func:`grip` with pads, with actuators `left_up` and `right_up` that move each finger along its axis, m."""
    scene = grip(held=held, timestep=timestep, **{"model_file": PAD_FILE, **attributes})
    for side in ("left", "right"):
        joint = f'<joint name="{side}_up" type="slide" axis="0 0 1"/>'
        scene = scene.replace(f'<body name="{side}_finger">', f'<body name="{side}_finger">{joint}')
        servo = f'<position name="{side}_up" joint="{side}_up" kp="500" dampratio="1"/>'
        scene = scene.replace("<actuator>", f"<actuator>{servo}")
    return scene


def pulled_card(timestep=0.001, **attributes):
    """As :func:`grip` with pads and a card that does not turn; the actuator `pull` moves it up, m."""
    scene = grip(held="card", timestep=timestep, **{"model_file": PAD_FILE, **attributes})
    scene = scene.replace('<freejoint name="object"/>', '<joint name="object" type="slide" axis="0 0 1"/><joint type="slide" axis="1 0 0"/>')
    return scene.replace("<actuator>", '<actuator><position name="pull" joint="object" kp="500" dampratio="1"/>')


def pulled_by_string(pads=4, held="card", mass=0.005, timestep=0.004, integrator="implicitfast", pull=(0, 0, -1), at=(0, 0, 0), **attributes):
    """A card of 0.8 mm, or a ball, without gravity between a thumb, `finger0`, and the other pads, on fingers that are as heavy as rotors make them and give way
    along the card. Motors `finger0` and so on, N. A string of 300 N/m from the place ``at`` along ``pull`` ends at the mocap body `hook`, 0.1 m off."""
    (half, _, geom), names, bodies = OBJECTS[held], [f"finger{k}" for k in range(pads)], ""
    for k, name in enumerate(names):
        sign, y = (-1, 0.0) if k == 0 else (1, 0.022 * (k - pads / 2))
        gives = "".join(f'<joint type="slide" axis="{axis}" armature="0.14" stiffness="1000" damping="3"/>' for axis in ("0 0 1", "0 1 0"))
        bodies += (
            f'<body name="{name}">{gives}<joint name="{name}" type="slide" axis="{-sign} 0 0" armature="0.14" damping="5"/>'
            f'<geom size="0.005" pos="{sign * 0.03} {y} 0" mass="0.02" contype="0" conaffinity="0"/>'
            f'<site name="{name}" pos="{sign * half} {y} 0" xyaxes="{-sign * 0.5} 0 0.8660254037844386 0 {-sign} 0"/></body>'
        )
    x, y, z = np.array(at) + 0.1 * np.array(pull)
    return f"""<mujoco>
  <option timestep="{timestep}" integrator="{integrator}" gravity="0 0 0"/>
  {extension(*(instance(name, name, "object", **attributes) for name in names))}
  <worldbody>
    {bodies}
    <body name="hook" mocap="true" pos="{x} {y} {z}"><site name="hook"/></body>
    <body name="object"><freejoint name="object"/><site name="middle" pos="{at[0]} {at[1]} {at[2]}"/>
      <geom name="object" {geom} euler="90 0 0" mass="{mass}" contype="0" conaffinity="0"/></body>
  </worldbody>
  <tendon><spatial name="string" stiffness="300" damping="2" springlength="0 0.1"><site site="middle"/><site site="hook"/></spatial></tendon>
  <actuator>{"".join(f'<motor name="{name}" joint="{name}"/>' for name in names)}</actuator>
  <sensor>{"".join(map(sensor, names))}</sensor>
</mujoco>"""


def fan(timestep=0.001, friction=0.2, **attributes):
    """Two cards between two pads, each touched by one finger; MuJoCo's own contact acts between the cards. The actuator `pull` moves the
    card at the right finger up, m."""
    scene = grip(held="card", timestep=timestep, **{"model_file": PAD_FILE, **attributes})
    scene = scene.replace('<flag contact="disable"/>', "").replace("<option ", '<option cone="elliptic" impratio="100" ')
    half = OBJECTS["card"][0]
    card = f'{OBJECTS["card"][2]} mass="0.005" condim="3" friction="{friction} 0.005 0.0001" solref="0.01 1"'
    begin, end = scene.index('<body name="object">'), scene.index("</body>", scene.index('<body name="object">')) + 7
    cards = (
        f'<body name="object" pos="{-half} 0 0"><freejoint name="object"/><geom name="object" {card}/></body>'
        f'<body name="other" pos="{half} 0 0"><joint name="other" type="slide" axis="0 0 1"/><joint type="slide" axis="1 0 0"/>'
        f'<geom name="other" {card}/></body>'
    )
    scene = scene[:begin] + cards + scene[end:]
    for sign in (-1, 1):
        # The sites begin in front of both cards.
        scene = scene.replace(f'pos="{sign * half} 0 0" xyaxes', f'pos="{sign * (2 * half + 1e-4)} 0 0" xyaxes')
    before, right = scene.split('<instance name="right">')
    right = right.replace('key="geoms" value="object"', 'key="geoms" value="other"', 1)
    scene = f'{before}<instance name="right">{right}'
    return scene.replace("<actuator>", '<actuator><position name="pull" joint="other" kp="500" dampratio="1"/>')


def hand_of_pads(touched, half, above, gap=0.004, **attributes):
    """Plugin, body and equality of a hand with two pads that close along x about the middle, on a slide `lift`."""
    attributes = {"model_file": PAD_FILE, **attributes}
    plugin = extension(*(instance(side, side, touched, **attributes) for side in ("left", "right")))
    fingers = "".join(
        f'''<body name="{side}_finger" pos="{sign * (half + gap)} 0 0"><joint name="{side}" type="slide" axis="{-sign} 0 0" damping="3"/>
        <geom type="capsule" size="0.004" fromto="{sign * 0.012} 0 0 {sign * 0.012} 0 0.06" mass="0.03" contype="0" conaffinity="0"/>
        <site name="{side}" xyaxes="{-sign * 0.5} 0 -0.8660254037844386 0 {sign} 0"/></body>'''
        for side, sign in (("left", -1), ("right", 1))
    )
    body = f'''<body name="hand" pos="0 0 {above}"><joint name="lift" type="slide" axis="0 0 1" damping="20" {{lift}}/>
      <geom size="0.02" pos="0 0 0.12" mass="0.3" contype="0" conaffinity="0"/>{fingers}</body>'''
    closes = '<equality><joint joint1="left" joint2="right" polycoef="0 1 0 0 0"/></equality>'
    return plugin, body, closes


def lifted(mass=0.005, timestep=0.004, integrator="Euler", cone="pyramidal", jacobian="auto", **attributes):
    """A block of 40 x 40 x 60 mm on a table, touched by MuJoCo's own contact, between two pads. Actuators `hand`, m, `left` and `right`, N."""
    plugin, hand, closes = hand_of_pads("object", HALF_WIDTH, 0.032, **attributes)
    return f"""<mujoco>
  <option timestep="{timestep}" integrator="{integrator}" cone="{cone}" jacobian="{jacobian}"/>
  {plugin}
  <worldbody>
    <geom type="plane" size="1 1 0.1" friction="0.5 0.005 0.0001"/>
    {hand.format(lift="")}
    <body name="object" pos="0 0 0.0305">
      <freejoint/>
      <geom name="object" type="box" size="{HALF_WIDTH} {HALF_WIDTH} 0.03" mass="{mass}" friction="0.5 0.004 0.0001" condim="4"/>
    </body>
  </worldbody>
  {closes}
  <actuator>
    <position name="hand" joint="lift" kp="500" dampratio="1"/><motor name="left" joint="left"/><motor name="right" joint="right"/>
  </actuator>
  <sensor>{sensor("left")}{sensor("right")}</sensor>
</mujoco>"""


def crowded(random, timestep=0.004, integrator="Euler", cone="pyramidal", **attributes):
    """A block of random size and mass on a table, beside a wall and a second block, between two pads of a hand that hangs on a spring and
    begins off its rest. All but the pads touch by MuJoCo's own contact. Actuators `left` and `right`, N."""
    half, deep, high = random.uniform(0.008, 0.025), random.uniform(0.01, 0.025), random.uniform(0.01, 0.04)
    other = random.uniform(0.006, 0.015, 3)
    masses = 0.001 * np.exp(random.uniform(0, np.log(45), 2))
    plugin, hand, closes = hand_of_pads("object", half, high + random.uniform(-0.3, 0.5) * high, **attributes)
    lift = f'stiffness="{random.uniform(50, 500)}" springref="{random.uniform(-0.004, 0.03)}"'
    # Beside it, on it, or on the table behind it.
    at = ((0, deep + other[1], other[2]), (0, 0, 2 * high + other[2] + 0.0002), (0.3 * half, deep + other[1], high))[random.integers(3)]
    surface = f'friction="{random.uniform(0.2, 1)} 0.004 0.0001" condim="{random.choice([3, 4])}"'
    return f"""<mujoco>
  <option timestep="{timestep}" integrator="{integrator}" cone="{cone}"/>
  {plugin}
  <worldbody>
    <geom type="plane" size="1 1 0.1" {surface}/>
    <geom type="box" size="0.2 0.01 0.2" pos="0 {-deep - 0.01 - random.uniform(0, 0.002)} 0.2" {surface}/>
    {hand.format(lift=lift)}
    <body name="object" pos="0 0 {high + 0.0002}">
      <freejoint/>
      <geom name="object" type="box" size="{half} {deep} {high}" mass="{masses[0]}" {surface}/>
    </body>
    <body name="other" pos="{at[0]} {at[1] + 0.0002} {at[2] + 0.0002}">
      <freejoint/>
      <geom type="box" size="{other[0]} {other[1]} {other[2]}" mass="{masses[1]}" {surface}/>
    </body>
  </worldbody>
  {closes}
  <actuator><motor name="left" joint="left"/><motor name="right" joint="right"/></actuator>
  <sensor>{sensor("left")}{sensor("right")}</sensor>
</mujoco>"""


def one_slide(timestep=0.001, integrator="RK4", depth_mm=1.5, mass=MASS_KG, **attributes):
    """An object that can only fall, held by one finger from the side: one degree of freedom, for comparison with a
    calculation by hand. The finger is pressed in by ``depth_mm`` throughout."""
    return f"""<mujoco>
  <option timestep="{timestep}" integrator="{integrator}"><flag contact="disable"/></option>
  <size nuserdata="4"/>
  {extension(instance("finger", "finger", "object", **attributes))}
  <worldbody>
    <site name="finger" pos="{-HALF_WIDTH + depth_mm / 1000} 0 0" xyaxes="0.5 0 0.8660254037844386 0 1 0"/>
    <body name="object">
      <joint name="fall" type="slide" axis="0 0 1"/>
      <geom name="object" type="box" size="{HALF_WIDTH} 0.02 0.03" mass="{mass}"/>
    </body>
  </worldbody>
  <sensor>{sensor("finger")}</sensor>
</mujoco>"""
