"""A finger against a rigid body, from the frames of both: depth, slide, spin, pitch and roll of a step, and forces and moments back.

Main class: `Frames`. The formulas are those of the core (`core/src/frames`), with poses in single precision: lengths in mm, in the frame of
the body. Three kernels a step: where the finger is (`sites_of_poses`, or one of a simulator), how it stands (`stand`), what both feel
(`feel`). Uses `_bed` or `_pad` for the step between the last two.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import warp as wp

from fingerpad_warp import _arrays, _bed, _pad
from fingerpad_warp import _pad_model as place
from fingerpad_warp._fingers import Response, _Bed
from fingerpad_warp._pad_model import Cylinder, Edge, Pad, Sphere
from fingerpad_warp._status import Regime, Status

# The compiler's first level: half the time of the second one, for kernels that cost little beside a step of a pad.
wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 4, "optimization_level": 1})

#: Kinds of shapes, numbered as in the C header.
PLANE, SPHERE, ELLIPSOID, CAPSULE, CYLINDER, EDGE, BOX = range(7)
#: Number of the first edge of a box.
FIRST_EDGE = 7
#: Radius of a bed's finger along and across, mm.
BED_RADIUS_MM = 21.0
# Rows of the memory behind that of the model: the finger in the body's frame and whether it is known, the face and the apex of a round
# one, place and direction on it, where a long face began, how much lower the surface counts.
AT, AXES, KNOWN, NUMBER, APEX, PLACE, DIRECTION, START, LOWER, ROWS = 0, 3, 12, 13, 14, 17, 19, 21, 22, 23

FACING = wp.constant(wp.float32(0.5))
FACING_EDGE = wp.constant(wp.float32(0.8))
FINGER_RADIUS_MM = wp.constant(wp.float32(20.0))
HOVER_MM = wp.constant(wp.float32(5.0))
NEAR_MM = wp.constant(wp.float32(30.0))
ROUNDS = wp.constant(60)
SETTLED = wp.constant(wp.float32(1e-6))
BEGINS_MM = wp.constant(wp.float32(1.0))
TOLERATED_MM = wp.constant(wp.float32(0.01))
# Share of the work of friction in slip that raises the surface of a contact that began inside the body.
RAISES = wp.constant(wp.float32(0.1))
UNIT = wp.constant(wp.float32(1e-3))
FARTHEST_MM = wp.constant(wp.float32(1e9))
FAR = wp.constant(wp.float32(1e30))
DEGREES = wp.constant(wp.float32(180 / np.pi))
PI = wp.constant(wp.float32(np.pi))
ROOT_HALF = wp.constant(wp.float32(math.sqrt(0.5)))
# A small angle, rad.
SMALL = wp.constant(wp.float32(0.01))


@wp.struct
class Solid:
    """The shape of a body in its own frame: kind, sizes as in the C header, cosine and sine of the slope of an edge's faces."""

    kind: int
    size: wp.vec3
    edge_radius: float
    face_cos: float
    face_sin: float


@wp.struct
class Face:
    """A face of a shape: u, v and the normal are right-handed; the centre of curvature, and the distance from there to the apex."""

    u: wp.vec3
    v: wp.vec3
    normal: wp.vec3
    middle: wp.vec3
    offset: float
    half_u: float
    half_v: float
    rim: float
    thickness: float
    # What the finger meets there, as a body of a pad with its axis along u.
    bent: int
    radius: float
    face_cos: float
    face_sin: float


@wp.struct
class Chosen:
    """A face by its number, 0 for none, with the normal at the apex of a round one."""

    number: int
    apex: wp.vec3


@wp.struct
class Stand:
    """How a finger stands against a face: its foot, height and direction, its tilt against level, the axes of the plane as columns."""

    foot: wp.vec2
    height: float
    direction: wp.vec2
    pitch: float
    roll: float
    axes: wp.mat33


@wp.func
def column(m: wp.mat33, k: int):
    return wp.vec3(m[0, k], m[1, k], m[2, k])


@wp.func
def unit(axis: int, length: float):
    out = wp.vec3(0.0, 0.0, 0.0)
    out[axis % 3] = length
    return out


@wp.func
def flat_face(axis: int, side: float, offset: float):
    out = Face()
    out.u = unit(axis + 1, 1.0)
    out.v = unit(axis + 2, side)
    out.normal = unit(axis, side)
    out.middle = wp.vec3(0.0, 0.0, 0.0)
    out.offset = offset
    out.half_u = FAR
    out.half_v = FAR
    out.rim = FAR
    out.thickness = FAR
    out.bent = 0
    out.radius = 1.0
    out.face_cos = 1.0
    out.face_sin = 0.0
    return out


@wp.func
def round_face(radius: float, middle: wp.vec3, apex: wp.vec3):
    least = int(0)
    if wp.abs(apex[0]) >= wp.abs(apex[1]):
        least = 1
    if wp.abs(apex[2]) < wp.abs(apex[least]):
        least = 2
    out = flat_face(2, 1.0, radius)
    out.u = wp.normalize(wp.cross(unit(least, 1.0), apex))
    out.v = wp.cross(apex, out.u)
    out.normal = apex
    out.middle = middle
    out.thickness = radius + radius
    out.bent = 1
    out.radius = radius
    return out


@wp.func
def side_face(radius: float, half_length: float, apex: wp.vec3):
    out = flat_face(2, 1.0, radius)
    out.u = unit(2, 1.0)
    out.v = wp.cross(apex, out.u)
    out.normal = apex
    out.half_u = half_length
    out.thickness = radius + radius
    out.bent = 2
    out.radius = radius
    return out


@wp.func
def sign_of(is_far: bool):
    out = float(1.0)
    if is_far:
        out = -1.0
    return out


@wp.func
def edge_of_box(half: wp.vec3, radius: float, axis: int, side_a: float, side_b: float):
    a = (axis + 1) % 3
    b = (axis + 2) % 3
    out = flat_face(2, 1.0, radius)
    out.normal = (unit(a, side_a) + unit(b, side_b)) * ROOT_HALF
    out.u = unit(axis, 1.0)
    out.v = wp.cross(out.normal, out.u)
    out.middle = unit(a, side_a * (half[a] - radius)) + unit(b, side_b * (half[b] - radius))
    out.half_u = half[axis]
    out.thickness = wp.min(half[a], half[b])
    out.bent = 3
    out.radius = radius
    out.face_cos = ROOT_HALF
    out.face_sin = ROOT_HALF
    return out


@wp.func
def face_of(shape: Solid, number: int, apex: wp.vec3):
    """The face of a number: see `FRAMES` of the Python package; `apex` is the normal of a round one."""
    kind = shape.kind
    size = shape.size
    out = flat_face(2, 1.0, 0.0)
    if kind == wp.static(SPHERE) or kind == wp.static(ELLIPSOID):
        squares = wp.vec3(size[0] * size[0] * apex[0], size[1] * size[1] * apex[1], size[2] * size[2] * apex[2])
        height = wp.sqrt(wp.dot(squares, apex))
        radius = size[0] * size[1] * size[2] / (height * height)
        out = round_face(radius, squares * (1.0 / height) - apex * radius, apex)
        out.thickness = height
    elif kind == wp.static(CAPSULE) or kind == wp.static(CYLINDER):
        side = sign_of(number == 3)
        if number == 1:
            out = side_face(size[0], size[1], apex)
        elif kind == wp.static(CAPSULE):
            out = round_face(size[0], unit(2, side * size[1]), apex)
        else:
            out = flat_face(2, side, size[1])
            out.rim = size[0]
            out.thickness = size[1]
    elif kind == wp.static(EDGE):
        out.u = unit(0, 1.0)
        out.v = unit(1, 1.0)
        out.middle = unit(2, -size[0])
        out.offset = size[0]
        out.bent = 3
        out.radius = size[0]
        out.face_cos = shape.face_cos
        out.face_sin = shape.face_sin
    elif kind == wp.static(BOX):
        if number >= wp.static(FIRST_EDGE):
            edge = number - wp.static(FIRST_EDGE)
            out = edge_of_box(size, shape.edge_radius, edge / 4, sign_of((edge & 1) != 0), sign_of((edge & 2) != 0))
        else:
            axis = (number - 1) % 3
            out = flat_face(axis, sign_of(number > 3), size[axis])
            out.half_u = size[(axis + 1) % 3]
            out.half_v = size[(axis + 2) % 3]
            out.thickness = size[axis]
    return out


@wp.func
def is_below(face: Face, at: wp.vec3, axes: wp.mat33, reach: float):
    """Whether the finger stands over the face, faces it, and is no deeper below it than `reach`."""
    to = at - face.middle
    u = wp.dot(to, face.u)
    v = wp.dot(to, face.v)
    return (
        wp.dot(column(axes, 2), face.normal) > FACING
        and wp.abs(u) <= face.half_u
        and wp.abs(v) <= face.half_v
        and wp.sqrt(u * u + v * v) <= face.rim
        and wp.dot(to, face.normal) > face.offset - reach
    )


@wp.func
def stand_of(face: Face, at: wp.vec3, axes: wp.mat33, rest: wp.vec3):
    """How a finger at the sum of `at` and the small `rest` stands against a face."""
    x = column(axes, 0)
    z = column(axes, 2)
    cosine = wp.dot(x, face.u)
    sine = wp.dot(x, face.v)
    flat = wp.sqrt(cosine * cosine + sine * sine)
    out = Stand()
    out.direction = wp.vec2(1.0, 0.0)
    if flat > 1e-6:
        out.direction = wp.vec2(cosine / flat, sine / flat)
    along = face.u * out.direction[0] + face.v * out.direction[1]
    across = face.v * out.direction[0] - face.u * out.direction[1]
    to = at - face.middle
    # The rest at the end: the body is far larger than what is left.
    out.foot = wp.vec2(wp.dot(to, face.u) + wp.dot(rest, face.u), wp.dot(to, face.v) + wp.dot(rest, face.v))
    out.height = wp.dot(to, face.normal) - face.offset + wp.dot(rest, face.normal)
    out.pitch = wp.atan2(-wp.dot(x, face.normal), flat)
    out.roll = wp.atan2(-wp.dot(z, across), wp.dot(column(axes, 1), across))
    out.axes = wp.matrix_from_cols(along, across, face.normal)
    return out


@wp.func
def normal_at(pitch: float, roll: float):
    """The normal of the face along the finger's level axes."""
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
    """The point of the finger that a plane touches first in a pose; the origin of a bed's."""
    out = wp.vec3(0.0, 0.0, 0.0)
    if pad.shape[0] > 0:
        held = held_pose(pad, pitch, roll)
        out = _pad.first_touch_point_mm(pad, _pad.tilted_axes(held[0], held[1]))
    return out


@wp.func
def one_less_cos(angle: float):
    half = wp.sin(0.5 * angle)
    return 2.0 * half * half


@wp.func
def lowest_mm(pad: wp.array(dtype=float), radius_mm: wp.vec2, pitch: float, roll: float):
    """Distance of the finger's lowest point below its origin: a bed's finger is round and touches at the origin when it lies level."""
    out = radius_mm[0] * one_less_cos(pitch) + radius_mm[1] * one_less_cos(roll)
    if pad.shape[0] > 0:
        out = -wp.dot(normal_at(pitch, roll), touch_mm(pad, pitch, roll))
    return out


@wp.func
def lowest_slopes_mm(
    pad: wp.array(dtype=float), radius_mm: wp.vec2, pitch: float, roll: float, held: wp.vec2, follows_pitch: bool, follows_roll: bool
):
    """Derivatives of `lowest_mm` over pitch and roll, with the point that touches in the pose that is held, mm/rad."""
    out = wp.vec2(radius_mm[0] * wp.sin(pitch), radius_mm[1] * wp.sin(roll))
    if pad.shape[0] > 0:
        normal = normal_at(pitch, roll)
        touch = touch_mm(pad, held[0], held[1])
        out = -wp.vec2(wp.dot(normal_by_pitch(pitch, roll), touch), wp.dot(normal_by_roll(pitch, roll), touch))
        # While one angle is held the point that touches still moves with the other one, and not along the plane.
        if follows_pitch:
            moves = touch_mm(pad, held[0] + SMALL, held[1]) - touch_mm(pad, held[0] - SMALL, held[1])
            out[0] = out[0] - wp.dot(normal, moves) / (SMALL + SMALL)
        if follows_roll:
            moves = touch_mm(pad, held[0], held[1] + SMALL) - touch_mm(pad, held[0], held[1] - SMALL)
            out[1] = out[1] - wp.dot(normal, moves) / (SMALL + SMALL)
    return out


@wp.func
def find_apex(shape: Solid, number: int, at: wp.vec3, axes: wp.mat33, pad: wp.array(dtype=float)):
    """The apex of a round face: the point of it under which the finger touches first. Number 0 where the finger is beyond its end."""
    is_long = shape.kind == wp.static(CAPSULE) or shape.kind == wp.static(CYLINDER)
    is_side = number == 1 and is_long
    apex = column(axes, 2)
    if is_side:
        apex[2] = 0.0
    out = Chosen()
    out.number = 0
    if wp.dot(apex, apex) > 1e-24:
        apex = wp.normalize(apex)
        touched = wp.vec3(0.0, 0.0, 0.0)
        middle = wp.vec3(0.0, 0.0, 0.0)
        for _round in range(ROUNDS):
            face = face_of(shape, number, apex)
            s = stand_of(face, at, axes, wp.vec3())
            middle = face.middle
            touched = at + axes @ touch_mm(pad, s.pitch, s.roll) - middle
            to = touched + apex * FINGER_RADIUS_MM
            if is_side:
                to[2] = 0.0
            to = wp.normalize(to)
            turn = wp.abs(to[0] - apex[0]) + wp.abs(to[1] - apex[1]) + wp.abs(to[2] - apex[2])
            apex = to
            if turn < SETTLED:
                break
        is_there = bool(True)
        if shape.kind == wp.static(CAPSULE):
            # Beyond the end of a capsule's side its cap is touched, and the other way round.
            if is_side:
                is_there = wp.abs(touched[2]) <= shape.size[1]
            else:
                is_there = not (touched[2] * middle[2] < 0.0)
        if is_there:
            out.number = number
    out.apex = apex
    return out


@wp.func
def choose_edge(shape: Solid, at: wp.vec3, axes: wp.mat33, pad: wp.array(dtype=float)):
    """The edge of a box to which a finger comes next: the centre of its surface lies beyond two of the box's faces."""
    z = column(axes, 2)
    out = at + axes @ touch_mm(pad, 0.0, 0.0) + z * FINGER_RADIUS_MM
    within = int(0)
    axis = int(0)
    for k in range(3):
        if wp.abs(out[k]) <= shape.size[k]:
            within = within + 1
            axis = k
    number = int(0)
    if within == 1:
        number = wp.static(FIRST_EDGE) + 4 * axis
        if out[(axis + 1) % 3] < 0.0:
            number = number + 1
        if out[(axis + 2) % 3] < 0.0:
            number = number + 2
        face = face_of(shape, number, z)
        facing = wp.dot(z, face.normal)
        if not (shape.edge_radius <= face.thickness and facing >= FACING_EDGE and is_below(face, at, axes, face.thickness)):
            number = 0
    return number


@wp.func
def is_kept(shape: Solid, old: Chosen, touches: bool, at: wp.vec3, axes: wp.mat33):
    """Whether the finger is still over the face of the last step. One that touches may sink in deeper than the body is thick."""
    kept = bool(False)
    if old.number > 0:
        face = face_of(shape, old.number, old.apex)
        reach = wp.max(face.thickness, HOVER_MM)
        if touches:
            reach = FAR
        kept = is_below(face, at, axes, reach)
    return kept


@wp.func
def choose(shape: Solid, at: wp.vec3, axes: wp.mat33, pad: wp.array(dtype=float)):
    """The face over which a finger stands: an edge that it comes next to, else the face that it faces most."""
    kind = shape.kind
    best = Chosen()
    best.number = 0
    size = wp.abs(shape.size[0]) + wp.abs(shape.size[1])
    if kind == wp.static(SPHERE) or kind == wp.static(ELLIPSOID):
        size = size + wp.abs(shape.size[2])
    is_endless = kind == wp.static(PLANE) or kind == wp.static(EDGE) or kind == wp.static(BOX)
    if is_endless or wp.dot(at, at) <= (size + NEAR_MM) * (size + NEAR_MM):
        if kind == wp.static(BOX) and pad.shape[0] > 0:
            best.number = choose_edge(shape, at, axes, pad)
        if best.number == 0:
            most = float(0.0)
            faces = int(1)
            if kind == wp.static(BOX):
                faces = 6
            elif not is_endless and kind >= wp.static(CAPSULE):
                faces = 3
            for number in range(1, faces + 1):
                chosen = Chosen()
                chosen.number = number
                if not is_endless and (kind != wp.static(CYLINDER) or number == 1):
                    chosen = find_apex(shape, number, at, axes, pad)
                if chosen.number > 0:
                    face = face_of(shape, number, chosen.apex)
                    facing = wp.dot(column(axes, 2), face.normal)
                    if facing > most and is_below(face, at, axes, face.thickness):
                        best = chosen
                        most = facing
    return best


@wp.func
def in_contact(pad: wp.array(dtype=float), state: wp.array2d(dtype=float), contact_row: int, i: int):
    """Whether the last step left the finger in contact: by the flags of a pad, by the depth of a bed."""
    out = state[contact_row, i] > 0.0
    if pad.shape[0] > 0:
        out = int(state[contact_row, i]) & wp.static(_pad.IN_CONTACT) != 0
    return out


@wp.func
def restart(state: wp.array2d(dtype=float), fresh: wp.array(dtype=float), strength_row: int, i: int):
    """Ends a contact; the strength factor is kept."""
    for row in range(fresh.shape[0]):
        if row != strength_row:
            state[row, i] = fresh[row]


@wp.kernel
def sites_of_poses(
    position_mm: wp.array(dtype=wp.vec3),
    quaternion: wp.array(dtype=wp.vec4),
    level: wp.mat33,
    at: wp.array(dtype=wp.vec3d),
    axes: wp.array(dtype=wp.mat33),
    is_known: wp.array(dtype=int),
):
    """The finger in the body's frame, from the pose of the body in the finger's; a pose that is none is not known."""
    n = wp.tid()
    p = position_mm[n]
    q = quaternion[n]
    square = wp.dot(q, q)
    is_known[n] = 0
    far = wp.max(wp.max(wp.abs(p[0]), wp.abs(p[1])), wp.abs(p[2]))
    if wp.abs(square - 1.0) <= UNIT and far <= FARTHEST_MM and wp.isfinite(p[0] + p[1] + p[2]):
        w = q[0]
        i = q[1]
        j = q[2]
        k = q[3]
        s = 2.0 / square
        back = wp.mat33(
            1.0 - s * (j * j + k * k), s * (i * j + k * w), s * (i * k - j * w),
            s * (i * j - k * w), 1.0 - s * (i * i + k * k), s * (j * k + i * w),
            s * (i * k + j * w), s * (j * k - i * w), 1.0 - s * (i * i + j * j),
        )  # fmt: skip
        at[n] = wp.vec3d(-(back @ p))
        axes[n] = back @ level
        is_known[n] = 1


@wp.kernel
def stand(
    at: wp.array(dtype=wp.vec3d),
    axes: wp.array(dtype=wp.mat33),
    is_known: wp.array(dtype=int),
    shapes: wp.array(dtype=Solid),
    pad: wp.array(dtype=float),
    radius_mm: wp.vec2,
    neutral_deg: wp.vec2,
    depth_max_mm: float,
    least_mm: wp.vec4,
    fresh: wp.array(dtype=float),
    contact_row: int,
    strength_row: int,
    past: wp.array2d(dtype=float),
    start: wp.array2d(dtype=float),
    trial: wp.array2d(dtype=float),
    depth_mm: wp.array(dtype=float),
    slide_x_mm: wp.array(dtype=float),
    slide_y_mm: wp.array(dtype=float),
    spin_rad: wp.array(dtype=float),
    pitch_deg: wp.array(dtype=float),
    roll_deg: wp.array(dtype=float),
    bodies: wp.array(dtype=_pad.Solid),
    stands: wp.array(dtype=Stand),
    flags: wp.array(dtype=int),
):
    """How each finger stands against its body, and the motion since the past."""
    i = wp.tid()
    rows = fresh.shape[0]
    for row in range(rows):
        start[row, i] = past[row, i]
    for row in range(wp.static(ROWS)):
        trial[rows + row, i] = past[rows + row, i]
    slide_x_mm[i] = 0.0
    slide_y_mm[i] = 0.0
    spin_rad[i] = 0.0
    depth_mm[i] = -1.0
    flags[i] = 0
    was_known = past[rows + wp.static(KNOWN), i] > 0.0
    before = wp.vec3()
    axes_before = wp.mat33()
    for k in range(3):
        before[k] = past[rows + wp.static(AT) + k, i]
        for c in range(3):
            axes_before[k, c] = past[rows + wp.static(AXES) + 3 * k + c, i]
    now = before
    rest = wp.vec3()
    turned = axes_before
    if is_known[i] == 1:
        # What single precision leaves of a place is too coarse: a body that is held would drift within its steps.
        now = wp.vec3(at[i])
        rest = wp.vec3(at[i] - wp.vec3d(now))
        turned = axes[i]
    else:
        # The body stays where it was.
        flags[i] = wp.static(int(Status.BAD_INPUT))
        if not was_known:
            trial[rows + wp.static(NUMBER), i] = 0.0
            return
    trial[rows + wp.static(KNOWN), i] = 1.0
    for k in range(3):
        trial[rows + wp.static(AT) + k, i] = now[k]
        for c in range(3):
            trial[rows + wp.static(AXES) + 3 * k + c, i] = turned[k, c]
    shape = shapes[i % shapes.shape[0]]
    chosen = Chosen()
    chosen.number = int(past[rows + wp.static(NUMBER), i])
    for k in range(3):
        chosen.apex[k] = past[rows + wp.static(APEX) + k, i]
    lower = past[rows + wp.static(LOWER), i]
    kept = is_kept(shape, chosen, in_contact(pad, past, contact_row, i), now, turned)
    if not kept:
        chosen = choose(shape, now, turned, pad)
        restart(start, fresh, strength_row, i)
        lower = 0.0
    trial[rows + wp.static(NUMBER), i] = float(chosen.number)
    trial[rows + wp.static(LOWER), i] = lower
    if chosen.number == 0:
        return
    face = face_of(shape, chosen.number, chosen.apex)
    s = stand_of(face, now, turned, rest)
    # ---- slide and spin ----
    is_plane = face.bent == 0
    old = wp.vec2(past[rows + wp.static(PLACE), i], past[rows + wp.static(PLACE + 1), i])
    old_direction = wp.vec2(past[rows + wp.static(DIRECTION), i], past[rows + wp.static(DIRECTION + 1), i])
    begun = past[rows + wp.static(START), i]
    if not kept:
        # A round body begins with its apex below the finger and its axes along the plane's; the first motion brings it to where it is.
        begun = 0.0
        old = s.foot
        old_direction = s.direction
        if not is_plane:
            old = wp.vec2(0.0, 0.0)
            old_direction = wp.vec2(1.0, 0.0)
        if face.bent >= 2:
            begun = s.foot[0]
    u = s.foot[0] - begun
    v = s.foot[1]
    cos = s.direction[0]
    sin = s.direction[1]
    # The face turns one way when the finger turns the other.
    spin = -wp.atan2(old_direction[0] * sin - old_direction[1] * cos, old_direction[0] * cos + old_direction[1] * sin)
    at_now = wp.vec2(-(u * cos + v * sin), -(v * cos - u * sin))
    slide = at_now - old
    if is_plane:
        at_now = s.foot
        # Along the axes halfway between both.
        half_sin = wp.sin(0.5 * spin)
        half_cos = wp.cos(0.5 * spin)
        mean_cos = cos * half_cos - sin * half_sin
        mean_sin = sin * half_cos + cos * half_sin
        u = s.foot[0] - old[0]
        v = s.foot[1] - old[1]
        slide = wp.vec2(-(u * mean_cos + v * mean_sin), -(v * mean_cos - u * mean_sin))
    # ---- depth, with the rule of how a contact begins ----
    depth = lowest_mm(pad, radius_mm, s.pitch, s.roll) - s.height
    if not in_contact(pad, start, contact_row, i) and depth > 0.0:
        most = depth_max_mm
        if was_known:
            touch = touch_mm(pad, s.pitch, s.roll)
            closer = wp.dot(before + axes_before @ touch - now - turned @ touch, face.normal)
            most = wp.clamp(closer, 0.0, BEGINS_MM)
        lower = 0.0
        if depth - most > TOLERATED_MM:
            lower = depth - most
    trial[rows + wp.static(LOWER), i] = lower
    trial[rows + wp.static(START), i] = begun
    for k in range(3):
        trial[rows + wp.static(APEX) + k, i] = chosen.apex[k]
    for k in range(2):
        trial[rows + wp.static(PLACE) + k, i] = at_now[k]
        trial[rows + wp.static(DIRECTION) + k, i] = s.direction[k]
    depth_mm[i] = depth - lower
    slide_x_mm[i] = slide[0]
    slide_y_mm[i] = slide[1]
    spin_rad[i] = spin
    if pitch_deg.shape[0] > 0:
        pitch_deg[i] = neutral_deg[0] + DEGREES * s.pitch
        roll_deg[i] = neutral_deg[1] + DEGREES * s.roll
    stands[i] = s
    body = _pad.Solid()
    body.kind = face.bent
    # A body that is sharper than the patches see is answered as the sharpest that they do.
    body.radius = wp.max(face.radius, least_mm[face.bent])
    body.axis_cos = 1.0
    body.axis_sin = 0.0
    body.face_cos = face.face_cos
    body.face_sin = face.face_sin
    if body.radius > face.radius:
        flags[i] = flags[i] | wp.static(int(Status.BODY_TOO_SHARP))
    if pad.shape[0] > 0:
        bodies[i] = body


@wp.kernel
def feel(
    shapes: wp.array(dtype=Solid),
    pad: wp.array(dtype=float),
    radius_mm: wp.vec2,
    level: wp.mat33,
    fresh: wp.array(dtype=float),
    contact_row: int,
    strength_row: int,
    depth_max_mm: float,
    depth_mm: wp.array(dtype=float),
    slide_x_mm: wp.array(dtype=float),
    slide_y_mm: wp.array(dtype=float),
    stands: wp.array(dtype=Stand),
    flags: wp.array(dtype=int),
    response: wp.array2d(dtype=float),
    regime: wp.array(dtype=int),
    status: wp.array(dtype=int),
    trial: wp.array2d(dtype=float),
    face_number: wp.array(dtype=int),
    on_finger: wp.array(dtype=wp.spatial_vector),
    on_body: wp.array(dtype=wp.spatial_vector),
):
    """Force, N, and moment, N mm, on the finger in its frame and on the body in its own; the end of contacts; flags."""
    i = wp.tid()
    rows = fresh.shape[0]
    number = int(trial[rows + wp.static(NUMBER), i])
    face_number[i] = number
    on_finger[i] = wp.spatial_vector()
    on_body[i] = wp.spatial_vector()
    if number == 0:
        restart(trial, fresh, strength_row, i)
        status[i] = flags[i]
        return
    apex = wp.vec3()
    at = wp.vec3()
    axes = wp.mat33()
    for k in range(3):
        apex[k] = trial[rows + wp.static(APEX) + k, i]
        at[k] = trial[rows + wp.static(AT) + k, i]
        for c in range(3):
            axes[k, c] = trial[rows + wp.static(AXES) + 3 * k + c, i]
    face = face_of(shapes[i % shapes.shape[0]], number, apex)
    s = stands[i]
    depth = depth_mm[i]
    out = status[i] | flags[i]
    touches = regime[i] != wp.static(int(Regime.NO_CONTACT))
    if touches:
        normal_n = response[wp.static(_bed.NORMAL_N), i]
        force = wp.vec3(response[wp.static(_bed.FRICTION_X), i], response[wp.static(_bed.FRICTION_Y), i], normal_n)
        moment = wp.vec3(response[wp.static(_bed.TILT_X), i], response[wp.static(_bed.TILT_Y), i], response[wp.static(_bed.MOMENT), i])
        # ---- flags ----
        lower = trial[rows + wp.static(LOWER), i]
        if lower > 0.0:
            out = out | wp.static(int(Status.BEGAN_INSIDE))
            slips = regime[i] == wp.static(int(Regime.SLIP)) and response[wp.static(_bed.STICK), i] <= 0.0
            if slips and normal_n > 0.0 and lower <= depth_max_mm:
                work = response[wp.static(_bed.TANGENTIAL_X), i] * slide_x_mm[i] + response[wp.static(_bed.TANGENTIAL_Y), i] * slide_y_mm[i]
                rise = RAISES * work / normal_n
                trial[rows + wp.static(LOWER), i] = wp.max(lower - wp.max(rise, 0.0), 0.0)
        if (face.bent == 1 or face.bent == 2) and depth > face.radius:
            out = out | wp.static(int(Status.DEPTH_ABOVE_RANGE))
        disk = wp.sqrt(wp.abs(response[wp.static(_bed.AREA_MM2), i] / PI))
        x = response[wp.static(_bed.CENTRE_X), i]
        y = response[wp.static(_bed.CENTRE_Y), i]
        u = s.foot[0] + x * s.direction[0] - y * s.direction[1]
        v = s.foot[1] + x * s.direction[1] + y * s.direction[0]
        if wp.abs(u) + disk > face.half_u or wp.abs(v) + disk > face.half_v or wp.sqrt(u * u + v * v) + disk > face.rim:
            out = out | wp.static(int(Status.BEYOND_EDGE))
        # ---- the moment about the finger's origin ----
        held = wp.vec2(0.0, 0.0)
        follows_pitch = bool(False)
        follows_roll = bool(False)
        if pad.shape[0] > 0:
            held = held_pose(pad, s.pitch, s.roll)
            follows_pitch = wp.abs(held[0] - s.pitch) < 1e-5
            follows_roll = wp.abs(held[1] - s.roll) < 1e-5
        # The response is about the foot in the pose that the model follows.
        foot = depth - lowest_mm(pad, radius_mm, held[0], held[1])
        moment = moment + wp.vec3(-foot * force[1], foot * force[0], 0.0)
        if not (follows_pitch and follows_roll):
            # As to an angle that is held, the moment is the derivative of depth alone. Roll goes about the finger's own axis.
            by_held = lowest_slopes_mm(pad, radius_mm, held[0], held[1], held, follows_pitch, follows_roll)
            by_pose = lowest_slopes_mm(pad, radius_mm, s.pitch, s.roll, held, follows_pitch, follows_roll)
            of_pitch = -normal_n * by_pose[0]
            of_roll = -normal_n * by_pose[1]
            if follows_pitch:
                of_pitch = of_pitch + moment[1] + normal_n * by_held[0]
            if follows_roll:
                of_roll = of_roll + wp.cos(held[0]) * moment[0] - wp.sin(held[0]) * moment[2] + normal_n * by_held[1]
            moment = wp.vec3((of_roll + wp.sin(s.pitch) * moment[2]) / wp.cos(s.pitch), of_pitch, moment[2])
        force = s.axes @ force
        moment = s.axes @ moment
        own = level @ wp.transpose(axes)
        on_finger[i] = wp.spatial_vector(own @ force, own @ moment)
        on_body[i] = wp.spatial_vector(-force, -(moment + wp.cross(at, force)))
    if not in_contact(pad, trial, contact_row, i):
        trial[rows + wp.static(LOWER), i] = 0.0
        if face.bent != 0:
            # In the air the apex of a round face goes along with the finger.
            restart(trial, fresh, strength_row, i)
            trial[rows + wp.static(NUMBER), i] = 0.0
    status[i] = out


def level_axes(pitch_deg: float, roll_deg: float) -> Any:
    """Axes of the plane in the neutral pose, in the finger's frame, as columns."""
    (ps, rs), (pc, rc) = np.sin(np.radians((pitch_deg, roll_deg))), np.cos(np.radians((pitch_deg, roll_deg)))
    return wp.mat33(pc, -ps * rs, -ps * rc, 0.0, rc, -rs, ps, pc * rs, pc * rc)


class Frames:
    """The kernels, the numbers and the memory of contacts in frames on a device, each with a body of its own."""

    def __init__(self, model: Any, count: int, device: Any, shapes: Any, radius_mm: tuple[float, float]) -> None:
        """shapes: a Warp array of `Solid`, one a contact or one for all; in the past all fingers are in the air."""
        self.device, self.count, self.shapes = device, count, shapes
        is_pad = isinstance(model, Pad)
        neutral = (model.neutral_pitch_deg, 0.0) if is_pad else model.pose_deg
        self.level, self._neutral, self._radius = level_axes(*neutral), wp.vec2(*neutral), wp.vec2(*radius_mm)
        self._depth_max_mm = model.depth_max_mm
        bodies = wp.zeros(count if is_pad else 0, dtype=_pad.Solid, device=device)
        if is_pad:
            self.engine: Any = _pad.Engine(model, None, _pad.poses(model, None, None, count), count, device, bodies)
            self.pad, least = self.engine.tables[0], model.least_radii_mm
            self._least = wp.vec4(0.0, least[Sphere], least[Cylinder], least[Edge])
            self._contact_row, self._strength_row = _pad.FLAGS, _pad.STRENGTH
        else:
            self.engine = _Bed(model, True, device, False)
            self.pad, self._least = _arrays.nothing(device), wp.vec4()
            self._contact_row, self._strength_row = self.engine.rows - 2, self.engine.rows - 1
        self._bodies = bodies
        rows, fresh = self.engine.rows, self.engine.fresh(count)
        self._fresh = wp.array(np.ascontiguousarray(fresh[:, 0]), dtype=float, device=device)
        self._empty = np.concatenate([fresh, np.zeros((ROWS, count), np.float32)])
        self.past, self.trial = (_arrays.table(rows + ROWS, count, device) for _ in range(2))
        # A pad steps in place: from the trial to the trial.
        self._bed_start = None if is_pad else _arrays.table(rows, count, device)
        for table in (self.past, self.trial):
            table.assign(self._empty)
        names = ("depth_mm", "slide_x_mm", "slide_y_mm", "spin_rad", *(("pitch_deg", "roll_deg") if is_pad else ()))
        self.motion = {name: wp.zeros(count, dtype=float, device=device) for name in names}
        self.motion["strength_factor"] = _arrays.nothing(device)
        self.at = wp.zeros(count, dtype=wp.vec3d, device=device)
        self.axes = wp.zeros(count, dtype=wp.mat33, device=device)
        self.is_known = wp.zeros(count, dtype=int, device=device)
        self.stands = wp.zeros(count, dtype=Stand, device=device)
        self._flags = wp.zeros(count, dtype=int, device=device)
        self.response = Response(count, device)
        self.face = wp.zeros(count, dtype=int, device=device)
        self.on_finger, self.on_body = (wp.zeros(count, dtype=wp.spatial_vector, device=device) for _ in range(2))

    @property
    def fresh(self) -> Any:
        """The memory of the model of a finger in the air."""
        return self._fresh

    def step(self, dt_s: float) -> None:
        """From the past to the trial, with the fingers at `at`, `axes` and `is_known`; writes `response`, `face` and both wrenches."""
        names = ("depth_mm", "slide_x_mm", "slide_y_mm", "spin_rad", "pitch_deg", "roll_deg")
        motion = [self.motion.get(name, self.pad) for name in names]
        rows = [self._fresh, self._contact_row, self._strength_row]
        start = self.trial if self._bed_start is None else self._bed_start
        wp.launch(
            stand,
            dim=self.count,
            inputs=[
                self.at, self.axes, self.is_known, self.shapes, self.pad, self._radius, self._neutral, self._depth_max_mm, self._least,
                *rows, self.past,
            ],
            outputs=[start, self.trial, *motion, self._bodies, self.stands, self._flags],
            device=self.device,
        )  # fmt: skip
        self.engine.launch(self.motion, dt_s, start, self.trial, self.response, self.device)
        wp.launch(
            feel,
            dim=self.count,
            inputs=[
                self.shapes, self.pad, self._radius, self.level, *rows, self._depth_max_mm, *motion[:3], self.stands, self._flags,
                self.response.values,
            ],
            outputs=[self.response.regime, self.response.status, self.trial, self.face, self.on_finger, self.on_body],
            device=self.device,
        )  # fmt: skip

    def advance(self) -> None:
        """The trial becomes the past."""
        self.past, self.trial = self.trial, self.past

    def reset(self, which: Any) -> None:
        """Lifts off the fingers where `which` is true, and forgets where their bodies were."""
        self.past.assign(np.ascontiguousarray(np.where(which, self._empty, self.past.numpy()), np.float32))
