"""Fingertips as passive forces in MuJoCo Warp, in all worlds at once.

Main class: `Callback`. A fingertip is a site of the model; what it touches are planes and boxes. Each pass through MuJoCo Warp's forward
dynamics is a trial on the memory of the contacts; the memory moves on when the time of a world has moved on.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from fingerpad_warp import _arrays, _bed, _pad
from fingerpad_warp import _pad_model as place
from fingerpad_warp._errors import InputError
from fingerpad_warp._fingers import Response, _Bed
from fingerpad_warp._model import Model
from fingerpad_warp._pad_model import Pad, Plane
from fingerpad_warp._status import Regime

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

#: Integrators that ask for passive forces once a step.
INTEGRATORS = ("EULER", "IMPLICIT", "IMPLICITFAST")
#: MuJoCo's numbers of the geoms that a finger touches.
PLANE, BOX = 0, 6

MM_PER_M = wp.constant(wp.float32(1000.0))
# Least cosine between the site's z axis and a face's normal: 60 degrees.
FACING = wp.constant(wp.float32(0.5))
# Depth over which the dampers grow from nothing, mm.
DAMPING_DEPTH_MM = wp.constant(wp.float32(0.2))
FAR = wp.constant(wp.float32(1e30))
TURN = wp.constant(wp.float32(2 * np.pi))
DEGREES = wp.constant(wp.float32(180 / np.pi))
HALF_TURN = wp.constant(wp.float32(np.pi))
# A small angle, rad.
SMALL = wp.constant(wp.float32(0.01))


@wp.struct
class Face:
    """A face of a geom in the geom's frame: u, v and the normal are right-handed."""

    u: wp.vec3
    v: wp.vec3
    normal: wp.vec3
    offset: float
    half_u: float
    half_v: float
    thickness: float


@wp.func
def unit(axis: int, length: float):
    out = wp.vec3(0.0, 0.0, 0.0)
    out[axis % 3] = length
    return out


@wp.func
def face_of(number: int, kind: int, size: wp.vec3):
    """Face 1 of a plane; faces 1 to 6 of a box: +x, +y, +z, -x, -y, -z."""
    out = Face()
    axis = int(2)
    side = float(1.0)
    out.offset = 0.0
    out.half_u = FAR
    out.half_v = FAR
    out.thickness = FAR
    if kind == wp.static(BOX):
        axis = (number - 1) % 3
        if number > 3:
            side = -1.0
        out.offset = size[axis]
        out.half_u = size[(axis + 1) % 3]
        out.half_v = size[(axis + 2) % 3]
        out.thickness = size[axis]
    out.normal = unit(axis, side)
    out.u = unit(axis + 1, 1.0)
    out.v = unit(axis + 2, side)
    return out


@wp.func
def stands_over(face: Face, at: wp.vec3, z: wp.vec3):
    """Whether the site stands over a face and looks at it."""
    return (
        wp.dot(z, face.normal) > FACING
        and wp.abs(wp.dot(at, face.u)) <= face.half_u
        and wp.abs(wp.dot(at, face.v)) <= face.half_v
        and wp.dot(at, face.normal) > face.offset - face.thickness
    )


@wp.func
def choose_face(kind: int, size: wp.vec3, at: wp.vec3, z: wp.vec3, old: int):
    """The face over which a site stands: the old one, else the one at which it looks most; 0 for none."""
    best = int(0)
    if old > 0 and stands_over(face_of(old, kind, size), at, z):
        best = old
    else:
        most = float(0.0)
        faces = int(1)
        if kind == wp.static(BOX):
            faces = 6
        for number in range(1, faces + 1):
            face = face_of(number, kind, size)
            facing = wp.dot(z, face.normal)
            if stands_over(face, at, z) and facing > most:
                best = number
                most = facing
    return best


@wp.func
def column(m: wp.mat33, k: int):
    return wp.vec3(m[0, k], m[1, k], m[2, k])


@wp.func
def one_less_cos(angle: float):
    half = wp.sin(0.5 * angle)
    return 2.0 * half * half


@wp.func
def normal_at(pitch: float, roll: float):
    """The normal of the face in the finger's frame."""
    return wp.vec3(-wp.sin(pitch), wp.cos(pitch) * wp.sin(roll), wp.cos(pitch) * wp.cos(roll))


@wp.func
def normal_by_pitch(pitch: float, roll: float):
    return wp.vec3(-wp.cos(pitch), -wp.sin(pitch) * wp.sin(roll), -wp.sin(pitch) * wp.cos(roll))


@wp.func
def normal_by_roll(pitch: float, roll: float):
    return wp.vec3(0.0, wp.cos(pitch) * wp.cos(roll), -wp.cos(pitch) * wp.sin(roll))


@wp.func
def held_pose(pad: wp.array(dtype=float), pitch: float, roll: float):
    """Pitch from the neutral one and roll, held within those of the pad's fit."""
    neutral = pad[wp.static(place.NEUTRAL_PITCH)]
    roll_max = pad[wp.static(place.ROLL_MAX)] / DEGREES
    least = (pad[wp.static(place.PITCH_RANGE)] - neutral) / DEGREES
    most = (pad[wp.static(place.PITCH_RANGE + 1)] - neutral) / DEGREES
    return wp.vec2(wp.clamp(pitch, least, most), wp.clamp(roll, -roll_max, roll_max))


@wp.func
def touch_mm(pad: wp.array(dtype=float), pitch: float, roll: float):
    """The point of the finger that a plane touches first in a pose."""
    return _pad.first_touch_point_mm(pad, _pad.tilted_axes(pitch, roll))


@wp.func
def lowest_slopes_mm(pad: wp.array(dtype=float), pitch: float, roll: float, held: wp.vec2, follows_pitch: bool, follows_roll: bool):
    """Derivatives over pitch and roll of the distance of the finger's lowest point below its site, mm/rad."""
    normal = normal_at(pitch, roll)
    touch = touch_mm(pad, held[0], held[1])
    by_pitch = -wp.dot(normal_by_pitch(pitch, roll), touch)
    by_roll = -wp.dot(normal_by_roll(pitch, roll), touch)
    # While one angle is held the point that touches still moves with the other one, and not along the plane.
    if follows_pitch:
        moves = touch_mm(pad, held[0] + SMALL, held[1]) - touch_mm(pad, held[0] - SMALL, held[1])
        by_pitch = by_pitch - wp.dot(normal, moves) / (SMALL + SMALL)
    if follows_roll:
        moves = touch_mm(pad, held[0], held[1] + SMALL) - touch_mm(pad, held[0], held[1] - SMALL)
        by_roll = by_roll - wp.dot(normal, moves) / (SMALL + SMALL)
    return wp.vec2(by_pitch, by_roll)


@wp.kernel
def commit(
    time: wp.array(dtype=float),
    dt_s: float,
    contacts: int,
    trial_time: wp.array(dtype=float),
    trial: wp.array2d(dtype=float),
    past: wp.array2d(dtype=float),
    fresh: wp.array(dtype=float),
    memory_rows: int,
):
    """A trial becomes the past of a world whose time has moved on; a world whose time went back starts without memory.

    Where the time is so late that single precision no longer moves it by a step, each pass counts as a step.
    """
    i = wp.tid()
    now = time[i // contacts]
    if now > trial_time[i] or (now == trial_time[i] and now + dt_s == now):
        for row in range(past.shape[0]):
            past[row, i] = trial[row, i]
    elif now < trial_time[i]:
        for row in range(past.shape[0]):
            past[row, i] = 0.0
            if row < memory_rows:
                past[row, i] = fresh[row]
    trial_time[i] = now


@wp.kernel
def place_sites(
    site: wp.array(dtype=int),
    geom: wp.array(dtype=int),
    geom_kind: wp.array(dtype=int),
    geom_size: wp.array2d(dtype=wp.vec3),
    site_xpos: wp.array2d(dtype=wp.vec3),
    site_xmat: wp.array2d(dtype=wp.mat33),
    geom_xpos: wp.array2d(dtype=wp.vec3),
    geom_xmat: wp.array2d(dtype=wp.mat33),
    pad_radius_mm: wp.vec2,
    level: wp.mat33,
    pad: wp.array(dtype=float),
    fresh: wp.array(dtype=float),
    memory_rows: int,
    past: wp.array2d(dtype=float),
    start: wp.array2d(dtype=float),
    trial: wp.array2d(dtype=float),
    depth_mm: wp.array(dtype=float),
    slide_x_mm: wp.array(dtype=float),
    slide_y_mm: wp.array(dtype=float),
    spin_rad: wp.array(dtype=float),
    pitch_deg: wp.array(dtype=float),
    roll_deg: wp.array(dtype=float),
    pose: wp.array(dtype=wp.vec2),
    axes: wp.array(dtype=wp.mat33),
    is_placed: wp.array(dtype=int),
):
    """Where each finger stands against its geom, and the motion since the past; the rows behind the memory are face, foot and angle."""
    world, k = wp.tid()
    i = world * site.shape[0] + k
    tip = site_xpos[world, site[k]]
    middle = geom_xpos[world, geom[k]]
    turn = geom_xmat[world, geom[k]]
    of_site = site_xmat[world, site[k]]
    kind = geom_kind[k]
    size = geom_size[world % geom_size.shape[0], geom[k]]
    for row in range(memory_rows):
        start[row, i] = past[row, i]
    slide_x_mm[i] = 0.0
    slide_y_mm[i] = 0.0
    spin_rad[i] = 0.0
    finite = wp.isfinite(tip[0] + tip[1] + tip[2] + middle[0] + middle[1] + middle[2])
    for r in range(3):
        for c in range(3):
            finite = finite and wp.isfinite(turn[r, c]) and wp.isfinite(of_site[r, c])
    if not finite:
        # The memory is held and flagged; no force goes to bodies whose place is unknown.
        depth_mm[i] = wp.nan
        is_placed[i] = 0
        for row in range(4):
            trial[memory_rows + row, i] = past[memory_rows + row, i]
        return
    at = wp.transpose(turn) @ (tip - middle)
    # Axes that are the plane's in the neutral pose; the finger's own first, whose rounding stays the same while only the object moves.
    local = wp.transpose(turn) @ (of_site @ level)
    old = int(past[memory_rows, i])
    number = choose_face(kind, size, at, column(local, 2), old)
    trial[memory_rows, i] = float(number)
    if number == 0:
        depth_mm[i] = -1.0
        is_placed[i] = 0
        return
    face = face_of(number, kind, size)
    foot_u = MM_PER_M * wp.dot(at, face.u)
    foot_v = MM_PER_M * wp.dot(at, face.v)
    height = wp.dot(at, face.normal) - face.offset
    x = column(local, 0)
    cosine = wp.dot(x, face.u)
    sine = wp.dot(x, face.v)
    angle = wp.atan2(sine, cosine)
    along = face.u * wp.cos(angle) + face.v * wp.sin(angle)
    across = face.v * wp.cos(angle) - face.u * wp.sin(angle)
    pitch = wp.atan2(-wp.dot(x, face.normal), wp.sqrt(cosine * cosine + sine * sine))
    roll = wp.atan2(-wp.dot(column(local, 2), across), wp.dot(column(local, 1), across))
    if old == number:
        turned = angle - past[memory_rows + 3, i]
        if turned > HALF_TURN:
            turned = turned - TURN
        elif turned < -HALF_TURN:
            turned = turned + TURN
        mean = past[memory_rows + 3, i] + 0.5 * turned
        u = foot_u - past[memory_rows + 1, i]
        v = foot_v - past[memory_rows + 2, i]
        # The face goes one way when the finger goes the other.
        slide_x_mm[i] = -(u * wp.cos(mean) + v * wp.sin(mean))
        slide_y_mm[i] = -(v * wp.cos(mean) - u * wp.sin(mean))
        spin_rad[i] = -turned
    else:
        for row in range(memory_rows):
            start[row, i] = fresh[row]
    trial[memory_rows + 1, i] = foot_u
    trial[memory_rows + 2, i] = foot_v
    trial[memory_rows + 3, i] = angle
    if pad.shape[0] == 0:
        # A bed's finger is round and touches at the site when it lies flat.
        sinks = pad_radius_mm[0] * one_less_cos(pitch) + pad_radius_mm[1] * one_less_cos(roll)
        depth_mm[i] = sinks - MM_PER_M * height
    else:
        held = held_pose(pad, pitch, roll)
        touch = touch_mm(pad, held[0], held[1])
        depth_mm[i] = -wp.dot(normal_at(pitch, roll), touch) - MM_PER_M * height
        pitch_deg[i] = pad[wp.static(place.NEUTRAL_PITCH)] + DEGREES * pitch
        roll_deg[i] = DEGREES * roll
    pose[i] = wp.vec2(pitch, roll)
    axes[i] = wp.transpose(wp.matrix_from_cols(turn @ along, turn @ across, turn @ face.normal))
    is_placed[i] = 1


@wp.func
def velocity_at(
    body: int, world: int, at: wp.vec3, body_rootid: wp.array(dtype=int), subtree_com: wp.array2d(dtype=wp.vec3),
    cvel: wp.array2d(dtype=wp.spatial_vector),
):
    """Turn and speed of a body at a point, in the world."""
    v = cvel[world, body]
    turn = wp.spatial_top(v)
    return wp.spatial_vector(turn, wp.spatial_bottom(v) + wp.cross(turn, at - subtree_com[world, body_rootid[body]]))


@wp.kernel
def bed_wrench(
    site: wp.array(dtype=int),
    site_body: wp.array(dtype=int),
    geom_body: wp.array(dtype=int),
    body_rootid: wp.array(dtype=int),
    subtree_com: wp.array2d(dtype=wp.vec3),
    cvel: wp.array2d(dtype=wp.spatial_vector),
    site_xpos: wp.array2d(dtype=wp.vec3),
    damping: wp.vec3,
    pad_radius_mm: wp.vec2,
    depth_mm: wp.array(dtype=float),
    pose: wp.array(dtype=wp.vec2),
    axes: wp.array(dtype=wp.mat33),
    is_placed: wp.array(dtype=int),
    response: wp.array2d(dtype=float),
    regime: wp.array(dtype=int),
    wrench: wp.array2d(dtype=wp.spatial_vector),
    dampers: wp.array(dtype=wp.vec4),
):
    """Force and moment on the finger about its site, in the world: those of the springs, and the dampers."""
    world, k = wp.tid()
    i = world * site.shape[0] + k
    wrench[world, k] = wp.spatial_vector()
    dampers[i] = wp.vec4()
    if regime[i] == wp.static(int(Regime.NO_CONTACT)) or is_placed[i] == 0:
        return
    tip = site_xpos[world, site[k]]
    finger = velocity_at(site_body[k], world, tip, body_rootid, subtree_com, cvel)
    plane = velocity_at(geom_body[k], world, tip, body_rootid, subtree_com, cvel)
    to_contact = axes[i]
    turn = to_contact @ wp.spatial_top(finger - plane)
    speed = to_contact @ wp.spatial_bottom(finger - plane)
    pitch = pose[i][0]
    roll = pose[i][1]
    by_pitch = pad_radius_mm[0] * wp.sin(pitch) / MM_PER_M
    by_roll = pad_radius_mm[1] * wp.sin(roll) / MM_PER_M
    roll_rate = turn[0] / wp.cos(pitch)
    spin_rate = turn[2] + wp.sin(pitch) * roll_rate
    share = wp.min(1.0, depth_mm[i] / DAMPING_DEPTH_MM)
    stuck = share * response[wp.static(_bed.STICK), i]
    normal_n = response[wp.static(_bed.NORMAL_N), i]
    damp_x = -stuck * damping[1] * speed[0]
    damp_y = -stuck * damping[1] * speed[1]
    # It never pulls.
    damp_z = wp.max(-normal_n, share * damping[0] * (-speed[2] + by_pitch * turn[1] + by_roll * roll_rate))
    damp_spin = -stuck * damping[2] * spin_rate
    normal = normal_n + damp_z
    spin = response[wp.static(_bed.MOMENT), i] / MM_PER_M + damp_spin
    force = wp.vec3(response[wp.static(_bed.FRICTION_X), i] + damp_x, response[wp.static(_bed.FRICTION_Y), i] + damp_y, normal)
    moment = wp.vec3((spin * wp.sin(pitch) - normal * by_roll) / wp.cos(pitch), -normal * by_pitch, spin)
    to_world = wp.transpose(to_contact)
    wrench[world, k] = wp.spatial_vector(to_world @ force, to_world @ moment)
    dampers[i] = wp.vec4(damp_x, damp_y, damp_z, MM_PER_M * damp_spin)


@wp.kernel
def pad_wrench(
    site: wp.array(dtype=int),
    site_body: wp.array(dtype=int),
    geom_body: wp.array(dtype=int),
    body_rootid: wp.array(dtype=int),
    subtree_com: wp.array2d(dtype=wp.vec3),
    cvel: wp.array2d(dtype=wp.spatial_vector),
    site_xpos: wp.array2d(dtype=wp.vec3),
    damping: wp.vec3,
    pad: wp.array(dtype=float),
    depth_mm: wp.array(dtype=float),
    pose: wp.array(dtype=wp.vec2),
    axes: wp.array(dtype=wp.mat33),
    is_placed: wp.array(dtype=int),
    response: wp.array2d(dtype=float),
    regime: wp.array(dtype=int),
    wrench: wp.array2d(dtype=wp.spatial_vector),
    dampers: wp.array(dtype=wp.vec4),
):
    """The same for pads. Where the pad holds pitch or roll at the end of its range, its moment is the derivative of the depth alone."""
    world, k = wp.tid()
    i = world * site.shape[0] + k
    wrench[world, k] = wp.spatial_vector()
    dampers[i] = wp.vec4()
    if regime[i] == wp.static(int(Regime.NO_CONTACT)) or is_placed[i] == 0:
        return
    tip = site_xpos[world, site[k]]
    finger = velocity_at(site_body[k], world, tip, body_rootid, subtree_com, cvel)
    plane = velocity_at(geom_body[k], world, tip, body_rootid, subtree_com, cvel)
    to_contact = axes[i]
    turn = to_contact @ wp.spatial_top(finger - plane)
    speed = to_contact @ wp.spatial_bottom(finger - plane)
    pitch = pose[i][0]
    roll = pose[i][1]
    held = held_pose(pad, pitch, roll)
    touch = touch_mm(pad, held[0], held[1]) / MM_PER_M
    normal_n = response[wp.static(_bed.NORMAL_N), i]
    force = wp.vec3(response[wp.static(_bed.FRICTION_X), i], response[wp.static(_bed.FRICTION_Y), i], normal_n)
    # The foot of the site as the pad has it: in a pose that it follows, where it is.
    foot = wp.vec3(0.0, 0.0, depth_mm[i] / MM_PER_M + wp.dot(normal_at(held[0], held[1]), touch))
    moment = wp.cross(foot, force) + wp.vec3(
        response[wp.static(_bed.TILT_X), i] / MM_PER_M,
        response[wp.static(_bed.TILT_Y), i] / MM_PER_M,
        response[wp.static(_bed.MOMENT), i] / MM_PER_M,
    )
    follows_pitch = held[0] == pitch
    follows_roll = held[1] == roll
    if not (follows_pitch and follows_roll):
        # Generalised forces of pitch, and of roll, which goes about the finger's own axis.
        by_held = lowest_slopes_mm(pad, held[0], held[1], held, follows_pitch, follows_roll) / MM_PER_M
        by_pose = lowest_slopes_mm(pad, pitch, roll, held, follows_pitch, follows_roll) / MM_PER_M
        of_pitch = float(0.0)
        of_roll = float(0.0)
        if follows_pitch:
            of_pitch = moment[1] + normal_n * by_held[0]
        if follows_roll:
            of_roll = wp.cos(held[0]) * moment[0] - wp.sin(held[0]) * moment[2] + normal_n * by_held[1]
        of_pitch = of_pitch - normal_n * by_pose[0]
        of_roll = of_roll - normal_n * by_pose[1]
        moment = wp.vec3((of_roll + wp.sin(pitch) * moment[2]) / wp.cos(pitch), of_pitch, moment[2])
    # Dampers act at the point of the finger that touches first.
    at = _pad.tilted_axes(pitch, roll) @ touch
    swept = speed + wp.cross(turn, at)
    share = wp.min(1.0, depth_mm[i] / DAMPING_DEPTH_MM)
    stuck = share * response[wp.static(_bed.STICK), i]
    damp = wp.vec3(
        -stuck * damping[1] * swept[0], -stuck * damping[1] * swept[1], wp.max(-normal_n, -share * damping[0] * swept[2])
    )
    damp_spin = -stuck * damping[2] * turn[2]
    moment = moment + wp.cross(at, damp) + wp.vec3(-share * damping[2] * turn[0], -share * damping[2] * turn[1], damp_spin)
    to_world = wp.transpose(to_contact)
    wrench[world, k] = wp.spatial_vector(to_world @ (force + damp), to_world @ moment)
    dampers[i] = wp.vec4(damp[0], damp[1], damp[2], MM_PER_M * damp_spin)


@wp.kernel
def apply(
    site: wp.array(dtype=int),
    site_body: wp.array(dtype=int),
    geom_body: wp.array(dtype=int),
    moves: wp.array2d(dtype=int),
    dof_bodyid: wp.array(dtype=int),
    body_rootid: wp.array(dtype=int),
    subtree_com: wp.array2d(dtype=wp.vec3),
    cdof: wp.array2d(dtype=wp.spatial_vector),
    site_xpos: wp.array2d(dtype=wp.vec3),
    wrench: wp.array2d(dtype=wp.spatial_vector),
    qfrc_passive: wp.array2d(dtype=float),
):
    """Adds the generalised forces: what acts on the finger, and the opposite on the geom's body at the same point."""
    world, dof = wp.tid()
    axis = cdof[world, dof]
    turn = wp.spatial_top(axis)
    com = subtree_com[world, body_rootid[dof_bodyid[dof]]]
    sum = float(0.0)
    for k in range(site.shape[0]):
        # 1 where the degree of freedom moves the body.
        sign = float(moves[site_body[k], dof] - moves[geom_body[k], dof])
        if sign != 0.0:
            w = wrench[world, k]
            at = wp.spatial_bottom(axis) + wp.cross(turn, site_xpos[world, site[k]] - com)
            sum = sum + sign * (wp.dot(at, wp.spatial_top(w)) + wp.dot(turn, wp.spatial_bottom(w)))
    qfrc_passive[world, dof] = qfrc_passive[world, dof] + sum


class Callback:
    """The contacts of fingertips in all worlds of a MuJoCo Warp simulation, as its `m.callback.passive`.

    The site stands where the undeformed pad first touches in the neutral pose and has the axes of the bone: x along the finger from
    proximal to distal, z to the nail's side, so that a finger of pitch 30 has its x axis inclined by 30 degrees. Switch MuJoCo's own
    contact between finger and object off, else there are two.
    """

    def __init__(
        self,
        model: Model | Pad,
        mj_model: Any,
        m: Any,
        d: Any,
        contacts: Sequence[tuple[str, str]],
        *,
        strength_factor: Any = None,
        damping_normal_n_s_per_m: float = 2.0,
        damping_slide_n_s_per_m: float = 2.0,
        damping_spin_n_m_s_per_rad: float = 2e-5,
        pad_radius_mm: tuple[float, float] | None = None,
    ) -> None:
        """Hooks the contacts into `m.callback.passive`; a callback that is there already is called first.

        model: a bed of springs, which is of one pose of the finger, or a pad, which follows it. mj_model: the MuJoCo model; m, d: of MuJoCo
        Warp, made from it. contacts: names of a site and of a plane or box, one pair a contact. strength_factor: on the friction, a number
        or an array of shape (worlds, contacts); later in the Warp array `strength`. pad_radius_mm: of a bed, radius of the finger along
        and across (21 and 21 without): how depth counts when it tilts. Dampers are those of the plugin for MuJoCo: the only part that is
        not the model of the finger.
        """
        if not isinstance(model, (Model, Pad)):
            raise InputError(f"model: {type(model).__name__} where a Model or a Pad is needed")
        if isinstance(model, Model) and model.effects:
            warnings.warn(f"steps leave out the {model.effects} effects of this model file", stacklevel=2)
        integrator = getattr(m.opt.integrator, "name", None) or type_name(m.opt.integrator)
        if integrator not in INTEGRATORS:
            raise InputError(f"mj_model.opt.integrator: {integrator} is none of {', '.join(INTEGRATORS)}")
        self.contacts = [_pair(mj_model, each) for each in _listed(contacts)]
        self.worlds, self.device = d.nworld, d.qpos.device
        count = self.worlds * len(self.contacts)
        self._dt_s = float(mj_model.opt.timestep)
        self._damping = wp.vec3(
            _positive("damping_normal_n_s_per_m", damping_normal_n_s_per_m),
            _positive("damping_slide_n_s_per_m", damping_slide_n_s_per_m),
            _positive("damping_spin_n_m_s_per_rad", damping_spin_n_m_s_per_rad),
        )
        is_pad = isinstance(model, Pad)
        if is_pad and pad_radius_mm is not None:
            raise InputError(f"pad_radius_mm: {pad_radius_mm!r}, but a pad has a shape of its own; leave it out")
        radii = (21.0, 21.0) if pad_radius_mm is None else pad_radius_mm
        if np.shape(radii) != (2,):
            raise InputError(f"pad_radius_mm: {radii!r} where two numbers are needed")
        self._level = _level_axes(model.neutral_pitch_deg if is_pad else model.pose_deg[0], 0.0 if is_pad else model.pose_deg[1])
        self._radii = wp.vec2(*(_positive("pad_radius_mm", radius, 1000.0) for radius in radii))
        if is_pad:
            neutral = _pad.poses(model, None, None, count)
            self._engine: Any = _pad.Engine(model, Plane(), neutral, count, self.device)
        else:
            self._engine = _Bed(model, True, self.device, False)
        # The numbers of a pad; none of a bed.
        self._pad = self._engine.tables[0] if is_pad else _arrays.nothing(self.device)
        rows = self._engine.rows
        sites, geoms = ([pair[k] for pair in self.contacts] for k in (0, 1))
        ints = {
            "site": sites, "geom": geoms, "geom_kind": mj_model.geom_type[geoms],
            "site_body": mj_model.site_bodyid[sites], "geom_body": mj_model.geom_bodyid[geoms],
        }  # fmt: skip
        for name, values in ints.items():
            setattr(self, f"_{name}", wp.array(np.asarray(values, np.int32), dtype=int, device=self.device))
        self._moves = wp.array(_moved_bodies(mj_model), dtype=int, device=self.device)
        fresh = self._engine.fresh(count)
        self._fresh = wp.array(np.ascontiguousarray(fresh[:, 0]), dtype=float, device=self.device)
        # Behind the memory: face, foot along u and v, angle.
        self._past, self._trial = (_arrays.table(rows + 4, count, self.device) for _ in range(2))
        # A pad steps in place.
        self._start = self._trial if is_pad else _arrays.table(rows, count, self.device)
        for each in (self._past, self._trial):
            each.assign(np.concatenate([fresh, np.zeros((4, count), np.float32)]))
        self._trial_time = wp.full(count, -np.inf, dtype=float, device=self.device)
        self._motion = {
            name: wp.zeros(count, dtype=float, device=self.device) for name in ("depth_mm", "slide_x_mm", "slide_y_mm", "spin_rad")
        }
        if is_pad:
            for name, values in zip(("pitch_deg", "roll_deg"), neutral, strict=True):
                self._motion[name] = wp.array(values, dtype=float, device=self.device)
        given = _arrays.numbers("strength_factor", 1.0 if strength_factor is None else strength_factor, (self.worlds, len(sites)))
        outside = given[~((given >= 0.1) & (given <= 5))]
        if outside.size:
            raise InputError(f"strength_factor: {outside[0]:g} is not between 0.1 and 5")
        #: Factor on the friction of each contact: a Warp array, world by world.
        self.strength = wp.array(given.reshape(-1), dtype=float, device=self.device)
        self._motion["strength_factor"] = self.strength
        self._pose = wp.zeros(count, dtype=wp.vec2, device=self.device)
        self._axes = wp.zeros(count, dtype=wp.mat33, device=self.device)
        self._is_placed = wp.zeros(count, dtype=int, device=self.device)
        self._wrench = wp.zeros((self.worlds, len(sites)), dtype=wp.spatial_vector, device=self.device)
        self._dampers = wp.zeros(count, dtype=wp.vec4, device=self.device)
        #: What the contacts answered in the last pass: contact k of world w is number w * contacts + k.
        self.response = Response(count, self.device)
        self._before = m.callback.passive
        m.callback.passive = self

    def __call__(self, m: Any, d: Any) -> None:
        """Adds the forces of the contacts to `d.qfrc_passive`."""
        if self._before is not None:
            self._before(m, d)
        if d.nworld != self.worlds:
            raise InputError(f"d: {d.nworld} worlds where {self.worlds} are needed; make a Callback for each Data")
        count, rows, each = self._trial_time.shape[0], self._engine.rows, (self.worlds, len(self.contacts))
        names = ("depth_mm", "slide_x_mm", "slide_y_mm", "spin_rad", "pitch_deg", "roll_deg")
        motion = [self._motion.get(name, self._pad) for name in names]
        is_pad = self._pad.shape[0] > 0
        wp.launch(
            commit,
            dim=count,
            inputs=[d.time, self._dt_s, len(self.contacts), self._trial_time, self._trial, self._past, self._fresh, rows],
            device=self.device,
        )
        wp.launch(
            place_sites,
            dim=each,
            inputs=[
                self._site, self._geom, self._geom_kind, m.geom_size, d.site_xpos, d.site_xmat, d.geom_xpos, d.geom_xmat,
                self._radii, self._level, self._pad, self._fresh, rows, self._past,
            ],
            outputs=[self._start, self._trial, *motion, self._pose, self._axes, self._is_placed],
            device=self.device,
        )  # fmt: skip
        self._engine.launch(self._motion, self._dt_s, self._start, self._trial, self.response, self.device)
        wp.launch(
            pad_wrench if is_pad else bed_wrench,
            dim=each,
            inputs=[
                self._site, self._site_body, self._geom_body, m.body_rootid, d.subtree_com, d.cvel, d.site_xpos, self._damping,
                self._pad if is_pad else self._radii, motion[0], self._pose, self._axes, self._is_placed, self.response.values,
                self.response.regime,
            ],
            outputs=[self._wrench, self._dampers],
            device=self.device,
        )  # fmt: skip
        wp.launch(
            apply,
            dim=(self.worlds, m.nv),
            inputs=[
                self._site, self._site_body, self._geom_body, self._moves, m.dof_bodyid, m.body_rootid, d.subtree_com, d.cdof,
                d.site_xpos, self._wrench,
            ],
            outputs=[d.qfrc_passive],
            device=self.device,
        )  # fmt: skip

    def read(self) -> np.ndarray[Any, Any]:
        """What the contacts answered in the last pass, a structured array of shape (worlds, contacts)."""
        return self.response.numpy().reshape(self.worlds, len(self.contacts))

    def depth_mm(self) -> np.ndarray[Any, Any]:
        """Depth of the contacts in the last pass, mm, shape (worlds, contacts); negative in the air."""
        return self._motion["depth_mm"].numpy().reshape(self.worlds, len(self.contacts))


def _level_axes(pitch_deg: float, roll_deg: float) -> Any:
    """Axes of the plane in the neutral pose, in the finger's frame, as columns."""
    (ps, rs), (pc, rc) = np.sin(np.radians((pitch_deg, roll_deg))), np.cos(np.radians((pitch_deg, roll_deg)))
    return wp.mat33(pc, -ps * rs, -ps * rc, 0.0, rc, -rs, ps, pc * rs, pc * rc)


def type_name(integrator: Any) -> str:
    """Name of an integrator that is given by its number."""
    from mujoco import mjtIntegrator

    return mjtIntegrator(int(integrator)).name.removeprefix("mjINT_")


def _listed(contacts: Any) -> list[Any]:
    try:
        pairs = [(str(site), str(geom)) for site, geom in contacts]
    except (TypeError, ValueError):
        raise InputError(f"contacts: {contacts!r} where pairs of the names of a site and a geom are needed") from None
    if not pairs:
        raise InputError("contacts: at least one pair is needed")
    return pairs


def _pair(mj_model: Any, names: tuple[str, str]) -> tuple[int, int]:
    """Numbers of a site and a geom; refused by name."""
    import mujoco

    site = mujoco.mj_name2id(mj_model, mujoco.mjtObj.mjOBJ_SITE, names[0])
    geom = mujoco.mj_name2id(mj_model, mujoco.mjtObj.mjOBJ_GEOM, names[1])
    if site < 0:
        raise InputError(f"contacts: the model has no site {names[0]!r}")
    if geom < 0:
        raise InputError(f"contacts: the model has no geom {names[1]!r}")
    kind = mujoco.mjtGeom(int(mj_model.geom_type[geom])).name.removeprefix("mjGEOM_").lower()
    if kind not in ("plane", "box"):
        raise InputError(f"contacts: geom {names[1]!r} is a {kind}; a finger touches planes and boxes")
    return site, geom


def _moved_bodies(mj_model: Any) -> np.ndarray[Any, Any]:
    """Whether a degree of freedom moves a body: shape (bodies, degrees of freedom)."""
    moves = np.zeros((mj_model.nbody, max(mj_model.nv, 1)), np.int32)
    for body in range(1, mj_model.nbody):
        moves[body] = moves[mj_model.body_parentid[body]]
        start, count = mj_model.body_dofadr[body], mj_model.body_dofnum[body]
        if count:
            moves[body, start : start + count] = 1
    return moves


def _positive(name: str, value: Any, most: float = 1e6) -> float:
    number = _arrays.one_number(name, value)
    if not 0 <= number <= most:
        raise InputError(f"{name}: {number:g} is not between 0 and {most:g}")
    return number
