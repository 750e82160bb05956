"""Semi-implicit forces of the contacts of a world, for time steps at which explicit forces would vibrate or be unstable.

Kernels of a step: `laws`, a thread a contact, and `couple`, a thread a world. The formulas are those of the plugin for MuJoCo
(`bindings/mujoco/src/semi_implicit.c`), along the axes of the world and in double precision.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from fingerpad_warp import _bed, _frames, _pad
from fingerpad_warp import _model as place
from fingerpad_warp._fingers import Fingers
from fingerpad_warp._model import Model
from fingerpad_warp._pad_model import Pad
from fingerpad_warp._status import Regime, Status

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 2})

vec5 = wp.types.vector(length=5, dtype=wp.float32)
mat33 = wp.mat33d
mat44 = wp.mat44d
mat46 = wp.types.matrix(shape=(4, 6), dtype=wp.float64)
mat66 = wp.types.matrix(shape=(6, 6), dtype=wp.float64)
vec3 = wp.vec3d
vec6 = wp.types.vector(length=6, dtype=wp.float64)

ZERO = wp.constant(wp.float64(0.0))
ONE = wp.constant(wp.float64(1.0))
TWO = wp.constant(wp.float64(2.0))
MM_PER_M = wp.constant(wp.float64(1000.0))
# Depth over which the dampers grow from nothing, mm.
DAMPING_DEPTH_MM = wp.constant(wp.float32(0.2))
# How much closer a finger may come in a step in which it touches, mm.
TOO_FAST_MM = wp.constant(wp.float32(2.0))
# Least pivot of a factor, and least divisor.
LEAST = wp.constant(wp.float64(1e-15))
# Largest  h² K + 2 h C  over the mass at which explicit forces calm every vibration.
CALM = wp.constant(wp.float64(1.5))
# Rounds of the limits of friction; of Newton's method; of a search along one of its steps.
SHARES, ROUNDS, TRIALS = wp.constant(6), wp.constant(60), wp.constant(40)
# Change of a share of the normal force after which the limits stay, and the one that is flagged; what may be left of the gradient.
CLOSE, OFF = wp.constant(wp.float64(1e-3)), wp.constant(wp.float64(0.05))
SMALL, FOUND = wp.constant(wp.float64(1e-10)), wp.constant(wp.float64(1e-6))
# MuJoCo's kinds of constraints: the last of friction, and elliptic contacts.
EQUALITY, FRICTION_TENDON, ELLIPTIC = wp.constant(0), wp.constant(2), wp.constant(7)
#: Vectors of a world: forces, accelerations, the gradient, a step, a trial.
FORCE, NOW, GRADIENT, STEP, TRIAL, VECTORS = range(6)


@wp.struct
class Finger:
    """What the stiffness of a contact follows from: of a pad that of its patches, N/m per mm²; of a bed sums over its springs, mm and mm²."""

    patch_stiffness: float
    centre: float
    square_x: float
    square_y: float
    damping: wp.vec3


@wp.struct
class Law:
    """How the wrench of a contact on its finger follows the velocities of the site, along the axes of the world. Friction and its moment about the
    centre of pressure are one force along x, y and a turn about the normal, in two parts, of the area that sticks and of that which slips."""

    touches: int
    # Velocities along these directions and the normal by the six of the site; what else stiffness and damping are of the six.
    rows: mat46
    rest: mat66
    # Stiffness times the time step and damping, N s/m, of both parts and along the normal.
    across: wp.vec2d
    normal: wp.float64
    # Friction of both parts and its limits at the present normal force, N; that force; the wrench at rest.
    sticking: vec3
    slipping: vec3
    limit: wp.vec2d
    pressure: wp.float64
    all: vec6
    # h² K + 2 h C; the velocities at the start of the step; the normal force at its end over the present one, by the last prediction.
    vibrates: mat66
    before: vec6
    share: wp.float64


@wp.struct
class Followed:
    """The wrench of a contact at other velocities, its fall with them, and the normal force before it is held at 0."""

    all: vec6
    fall: mat66
    pressure: wp.float64


@wp.struct
class World:
    """All that the prediction is of: MuJoCo's mass matrix, forces and constraints, the contacts, and room."""

    dt_s: wp.float64
    contacts: int
    rownnz: wp.array(dtype=int)
    rowadr: wp.array(dtype=int)
    colind: wp.array(dtype=int)
    mass: wp.array2d(dtype=float)
    # The mass matrix with what the integrator treats implicitly; else the damping of the joints is added.
    damped: wp.array2d(dtype=float)
    dof_damping: wp.array2d(dtype=float)
    force: wp.array2d(dtype=float)
    nefc: wp.array(dtype=int)
    is_sparse: int
    efc_kind: wp.array2d(dtype=int)
    efc_id: wp.array2d(dtype=int)
    efc_J: wp.array3d(dtype=float)
    efc_rownnz: wp.array2d(dtype=int)
    efc_rowadr: wp.array2d(dtype=int)
    efc_colind: wp.array3d(dtype=int)
    efc_D: wp.array2d(dtype=float)
    efc_aref: wp.array2d(dtype=float)
    efc_loss: wp.array2d(dtype=float)
    dim: wp.array(dtype=int)
    friction: wp.array(dtype=vec5)
    address: wp.array2d(dtype=int)
    impratio: wp.array(dtype=float)
    law: wp.array(dtype=Law)
    jacobian: wp.array3d(dtype=float)
    matrix: wp.array3d(dtype=wp.float64)
    vector: wp.array3d(dtype=wp.float64)


# ---- one contact ----


@wp.func
def add_square(to: mat66, row: vec6, weight: wp.float64):
    for i in range(6):
        for k in range(6):
            to[i, k] = to[i, k] + weight * row[i] * row[k]
    return to


@wp.func
def velocity_row(k: int, arm: vec3):
    """Velocity along axis k of a point at `arm` from the site, by the six of the site."""
    axis = vec3()
    axis[k] = ONE
    turn = wp.cross(arm, axis)
    return vec6(axis[0], axis[1], axis[2], turn[0], turn[1], turn[2])


@wp.func
def pad_stiffness(spring: wp.float64, area_mm2: wp.float64, arm: vec3):
    """Stiffness of the patches that touch, taken as a disk of springs about the centre of pressure: N/m, N and N m."""
    out = mat66()
    for k in range(3):
        out = add_square(out, velocity_row(k, arm), spring)
    square = spring * area_mm2 / (wp.float64(4.0) * wp.float64(wp.PI) * MM_PER_M * MM_PER_M)
    out[3, 3] = out[3, 3] + square
    out[4, 4] = out[4, 4] + square
    out[5, 5] = out[5, 5] + TWO * square
    return out


@wp.func
def bed_stiffness(
    head: wp.array(dtype=float), rows: wp.array2d(dtype=float), finger: Finger, radius_mm: wp.vec2, depth_mm: float, normal_n: float,
    pitch: float, roll: float,
):
    """Stiffness of a bed all of which sticks: of springs along the face and of the table of normal force over depth."""
    per_mm = head[wp.static(place.CELLS_PER_MM)]
    cells = wp.min(depth_mm * per_mm, wp.static(float(place.NODES - 1)))
    c = wp.min(int(cells), wp.static(place.NODES - 2))
    t = cells - float(c)
    kx = wp.float64(_bed.parabola(rows, c, wp.static(place.STIFFNESS_X), t)) / MM_PER_M
    ky = wp.float64(_bed.parabola(rows, c, wp.static(place.STIFFNESS_Y), t)) / MM_PER_M
    rise = wp.float64(rows[c, wp.static(place.NORMAL + 1)] * per_mm) / MM_PER_M
    coupling = wp.float64(_bed.slope(rows, c, wp.static(place.PRESS_SLIDE), t) * per_mm)
    # The depth by the six, mm; a finger that shifts has a plane that slides back.
    depth = vec6(ZERO, ZERO, -MM_PER_M, wp.float64(radius_mm[1] * wp.sin(roll)), wp.float64(radius_mm[0] * wp.sin(pitch)), ZERO)
    along = coupling * depth
    along[0] = along[0] - MM_PER_M
    across = vec6()
    across[1] = -MM_PER_M
    across[5] = -wp.float64(finger.centre)
    out = add_square(add_square(add_square(mat66(), along, kx), across, ky), depth, rise)
    around = kx * wp.float64(finger.square_x) + ky * (wp.float64(finger.square_y) - wp.float64(finger.centre * finger.centre))
    out[5, 5] = out[5, 5] + around
    # The point that touches first wanders on the round finger.
    out[3, 3] = out[3, 3] + wp.float64(normal_n * radius_mm[1] * wp.cos(roll)) / MM_PER_M
    out[4, 4] = out[4, 4] + wp.float64(normal_n * radius_mm[0] * wp.cos(pitch)) / MM_PER_M
    return out


@wp.func
def turned_columns(to_world: mat33, row: vec6):
    """A row of velocities by the six along the axes of a contact, by those along the axes of the world."""
    shift = to_world @ vec3(row[0], row[1], row[2])
    turn = to_world @ vec3(row[3], row[4], row[5])
    return vec6(shift[0], shift[1], shift[2], turn[0], turn[1], turn[2])


@wp.func
def turned(to_world: mat33, whole: mat66):
    """A symmetric matrix over the six along the axes of a contact, along those of the world."""
    half = mat66()
    for i in range(6):
        half[i] = turned_columns(to_world, whole[i])
    half = wp.transpose(half)
    for i in range(6):
        half[i] = turned_columns(to_world, half[i])
    return half


@wp.kernel
def laws(
    site: wp.array(dtype=int),
    geom: wp.array(dtype=int),
    site_xmat: wp.array2d(dtype=wp.mat33),
    geom_xmat: wp.array2d(dtype=wp.mat33),
    qvel: wp.array2d(dtype=float),
    finger: Finger,
    head: wp.array(dtype=float),
    bed_rows: wp.array2d(dtype=float),
    pad: wp.array(dtype=float),
    radius_mm: wp.vec2,
    depth_mm: wp.array(dtype=float),
    stands: wp.array(dtype=_frames.Stand),
    is_known: wp.array(dtype=int),
    face: wp.array(dtype=int),
    on_finger: wp.array(dtype=wp.spatial_vector),
    response: wp.array2d(dtype=float),
    regime: wp.array(dtype=int),
    dt_s: float,
    jacobian: wp.array3d(dtype=float),
    law: wp.array(dtype=Law),
    wrench: wp.array2d(dtype=wp.spatial_vector),
    status: wp.array(dtype=int),
):
    """The law of each contact, from its response and the Jacobian of its site; and its explicit wrench, with the dampers. Flags a finger that comes too
    fast."""
    world, k = wp.tid()
    i = world * site.shape[0] + k
    out = Law()
    wrench[world, k] = wp.spatial_vector()
    # No force goes to bodies whose place is unknown.
    if face[i] == 0 or is_known[i] == 0:
        law[i] = out
        return
    s = stands[i]
    to_world = mat33(geom_xmat[world, geom[k]] @ s.axes)
    touch = vec3(first_touch(pad, radius_mm, s.pitch, s.roll)) / MM_PER_M
    for dof in range(jacobian.shape[2]):
        out.before = out.before + wp.float64(qvel[world, dof]) * column(jacobian, i, dof)
    # The velocity of the point that touches first, away from the face.
    normal = vec3(to_world[0, 2], to_world[1, 2], to_world[2, 2])
    lever = wp.cross(to_world @ touch, normal)
    away = vec6(normal[0], normal[1], normal[2], lever[0], lever[1], lever[2])
    swept = wp.dot(away, out.before)
    closer_mm = -1000.0 * dt_s * float(swept)
    if closer_mm > TOO_FAST_MM and closer_mm > -depth_mm[i]:
        status[i] = status[i] | wp.static(int(Status.STEP_TOO_LONG))
    if regime[i] == wp.static(int(Regime.NO_CONTACT)):
        law[i] = out
        return
    out.touches = 1
    out.share = ONE
    stick = response[wp.static(_bed.STICK), i]
    share = wp.min(1.0, depth_mm[i] / DAMPING_DEPTH_MM)
    # The damping of small velocities.
    damping = mat66()
    for axis in range(3):
        weight = share * finger.damping[0]
        if axis < 2:
            weight = share * stick * finger.damping[1]
        damping = add_square(damping, velocity_row(axis, touch), wp.float64(weight))
        turning = share * finger.damping[2]
        if axis == 2:
            turning = turning * stick
        damping[3 + axis, 3 + axis] = damping[3 + axis, 3 + axis] + wp.float64(turning)
    arm = vec3(
        wp.float64(response[wp.static(_bed.CENTRE_X), i]), wp.float64(response[wp.static(_bed.CENTRE_Y), i]), wp.float64(depth_mm[i])
    )
    arm = arm / MM_PER_M
    arm[2] = arm[2] + touch[2]
    stiffness = mat66()
    if pad.shape[0] > 0:
        area = wp.float64(response[wp.static(_bed.AREA_MM2), i])
        stiffness = pad_stiffness(wp.float64(finger.patch_stiffness) * area, area, arm)
    else:
        stiffness = bed_stiffness(
            head, bed_rows, finger, radius_mm, depth_mm[i], response[wp.static(_bed.NORMAL_N), i], s.pitch, s.roll
        )
    h = wp.float64(dt_s)
    whole = h * stiffness + damping
    # Motions of the site that move the centre of pressure along x, along y, that turn about it, that move it along the normal.
    motions = mat46()
    motions[0, 0] = ONE
    motions[1, 1] = ONE
    motions[2, 0] = arm[1]
    motions[2, 1] = -arm[0]
    motions[2, 5] = ONE
    motions[3, 2] = ONE
    by = motions @ whole
    along = by @ wp.transpose(motions)
    rows = wp.inverse(along) @ by
    rest = whole - wp.transpose(by) @ rows
    out.normal = along[3, 3]
    across = wp.max(along[0, 0], along[1, 1])
    radius = wp.sqrt(along[2, 2] / wp.max(across, LEAST))
    for c in range(6):
        rows[2, c] = rows[2, c] * radius
    stuck = wp.clamp(wp.float64(stick), ZERO, ONE)
    out.across = wp.vec2d(stuck * across, (ONE - stuck) * across)
    # ---- friction, its moment, and their limit: with the moment friction is no larger than the limit that it has alone ----
    of_site = mat33(site_xmat[world, site[k]])
    force = of_site @ vec3(wp.spatial_top(on_finger[i]))
    moment = of_site @ vec3(wp.spatial_bottom(on_finger[i])) / MM_PER_M
    out.all = vec6(force[0], force[1], force[2], moment[0], moment[1], moment[2])
    force = wp.transpose(to_world) @ force
    moment = wp.transpose(to_world) @ moment - wp.cross(arm, force)
    friction = vec3(
        wp.float64(response[wp.static(_bed.TANGENTIAL_X), i]), wp.float64(response[wp.static(_bed.TANGENTIAL_Y), i]), ZERO
    )
    alone = wp.max(wp.length(friction), wp.float64(response[wp.static(_bed.LIMIT_N), i]))
    room = wp.sqrt(alone * alone - wp.dot(friction, friction))
    friction[2] = wp.clamp(moment[2] / wp.max(radius, LEAST), -room, room)
    # Where all slips, friction is its limit: on round bodies that is less than the limit of the response.
    size = wp.length(friction)
    limit = size + stuck * (alone - size)
    slips = wp.min(size, (ONE - stuck) * limit) / wp.max(size, LEAST)
    out.sticking = (ONE - slips) * friction
    out.slipping = slips * friction
    out.limit = wp.vec2d(stuck * limit, (ONE - stuck) * limit)
    out.pressure = wp.float64(response[wp.static(_bed.NORMAL_N), i])
    # ---- along the axes of the world ----
    for r in range(4):
        rows[r] = turned_columns(to_world, rows[r])
    out.rows = rows
    out.rest = turned(to_world, rest)
    out.vibrates = turned(to_world, h * (whole + damping))
    law[i] = out
    # ---- explicit: dampers act where the finger touches first; that of the normal force never pulls ----
    over = wp.max(wp.float64(share * finger.damping[0]) * swept - out.pressure, ZERO)
    explicit = out.all - turned(to_world, damping) @ out.before + over * away
    w = wp.spatial_vector()
    for c in range(6):
        w[c] = float(explicit[c])
    wrench[world, k] = w


@wp.func
def first_touch(pad: wp.array(dtype=float), radius_mm: wp.vec2, pitch: float, roll: float):
    """The point of the finger that touches first, mm from the site along the axes of the face; a bed's finger is round."""
    out = wp.vec3(radius_mm[0] * wp.sin(pitch), -radius_mm[1] * wp.sin(roll) / wp.cos(pitch), -_frames.lowest_mm(pad, radius_mm, pitch, roll))
    if pad.shape[0] > 0:
        out = _pad.tilted_axes(pitch, roll) @ _frames.touch_mm(pad, pitch, roll)
    return out


@wp.func
def follow(law: Law, after: vec6):
    """The wrench at the velocities `after` within Coulomb's law, and its fall with them. A contact does not pull."""
    out = Followed()
    along = law.rows @ after
    more = wp.vec4d()
    own = mat44()
    for part in range(2):
        stiffness = law.across[part]
        if stiffness > ZERO:
            friction = law.sticking
            if part == 1:
                friction = law.slipping
            trial = friction - stiffness * vec3(along[0], along[1], along[2])
            size = wp.length(trial)
            limit = law.share * law.limit[part]
            kept = ONE
            if size > limit:
                kept = limit / size
            for k in range(3):
                more[k] = more[k] + kept * trial[k] - friction[k]
                own[k, k] = own[k, k] + kept * stiffness
                if size > limit:
                    for j in range(3):
                        own[k, j] = own[k, j] - kept * stiffness * trial[k] * trial[j] / (size * size)
    out.pressure = law.pressure - law.normal * along[3]
    more[3] = wp.max(ZERO, out.pressure) - law.pressure
    if out.pressure > ZERO:
        own[3, 3] = law.normal
    by_rows = wp.transpose(law.rows)
    out.all = law.all - law.rest @ after + by_rows @ more
    out.fall = law.rest + by_rows @ (own @ law.rows)
    return out


# ---- all contacts of a world ----


@wp.func
def column(jacobian: wp.array3d(dtype=float), i: int, dof: int):
    out = vec6()
    for c in range(6):
        out[c] = wp.float64(jacobian[i, c, dof])
    return out


@wp.func
def add_in_joints(matrix: wp.array3d(dtype=wp.float64), world: int, jacobian: wp.array3d(dtype=float), i: int, weight: mat66):
    """Adds J' W J of a contact to the lower triangle of a world's matrix."""
    for a in range(jacobian.shape[2]):
        of_a = column(jacobian, i, a)
        if wp.dot(of_a, of_a) > ZERO:
            by = weight @ of_a
            for b in range(a + 1):
                matrix[world, a, b] = matrix[world, a, b] + wp.dot(by, column(jacobian, i, b))


@wp.func
def factor(matrix: wp.array3d(dtype=wp.float64), world: int):
    """Replaces the lower triangle by Cholesky's factor; returns whether the matrix was positive."""
    is_positive = bool(True)
    for a in range(matrix.shape[1]):
        for b in range(a + 1):
            left = matrix[world, a, b]
            for k in range(b):
                left = left - matrix[world, a, k] * matrix[world, b, k]
            if a > b:
                matrix[world, a, b] = left / matrix[world, b, b]
            else:
                if not (left > LEAST):
                    is_positive = False
                    left = LEAST
                matrix[world, a, a] = wp.sqrt(left)
    return is_positive


@wp.func
def solve(p: World, world: int):
    """The step of Newton's method, from the gradient and the factor."""
    nv = p.matrix.shape[1]
    for a in range(nv):
        left = p.vector[world, wp.static(GRADIENT), a]
        for k in range(a):
            left = left - p.matrix[world, a, k] * p.vector[world, wp.static(STEP), k]
        p.vector[world, wp.static(STEP), a] = left / p.matrix[world, a, a]
    for back in range(nv):
        a = nv - 1 - back
        left = p.vector[world, wp.static(STEP), a]
        for k in range(a + 1, nv):
            left = left - p.matrix[world, k, a] * p.vector[world, wp.static(STEP), k]
        p.vector[world, wp.static(STEP), a] = left / p.matrix[world, a, a]


@wp.func
def dot(p: World, world: int, one: int, other: int):
    sum = ZERO
    for a in range(p.matrix.shape[1]):
        sum = sum + p.vector[world, one, a] * p.vector[world, other, a]
    return sum


@wp.func
def set_mass(p: World, world: int, mass: wp.array2d(dtype=float), scale: wp.float64):
    """The lower triangle of a mass matrix, times a number."""
    for a in range(p.matrix.shape[1]):
        for b in range(a + 1):
            p.matrix[world, a, b] = ZERO
        for at in range(p.rowadr[a], p.rowadr[a] + p.rownnz[a]):
            p.matrix[world, a, p.colind[at]] = scale * wp.float64(mass[world, at])


@wp.func
def entries(p: World, world: int, row: int):
    """Number of entries of a row of MuJoCo's constraints."""
    count = p.matrix.shape[1]
    if p.is_sparse != 0:
        count = p.efc_rownnz[world, row]
    return count


@wp.func
def dof_of(p: World, world: int, row: int, k: int):
    dof = k
    if p.is_sparse != 0:
        dof = p.efc_colind[world, 0, p.efc_rowadr[world, row] + k]
    return dof


@wp.func
def entry(p: World, world: int, row: int, k: int):
    out = float(0.0)
    if p.is_sparse != 0:
        out = p.efc_J[world, 0, p.efc_rowadr[world, row] + k]
    else:
        out = p.efc_J[world, row, k]
    return wp.float64(out)


@wp.func
def off_reference(p: World, world: int, row: int, at: int):
    """Acceleration along a constraint less the one that it is to have."""
    sum = -wp.float64(p.efc_aref[world, row])
    for k in range(entries(p, world, row)):
        sum = sum + entry(p, world, row, k) * p.vector[world, at, dof_of(p, world, row, k)]
    return sum


@wp.func
def push(p: World, world: int, row: int, force: wp.float64):
    """Takes the force of a constraint off the gradient."""
    for k in range(entries(p, world, row)):
        dof = dof_of(p, world, row, k)
        p.vector[world, wp.static(GRADIENT), dof] = p.vector[world, wp.static(GRADIENT), dof] - force * entry(p, world, row, k)


@wp.func
def add_rows(p: World, world: int, first: int, count: int, contact: int, weight: mat66):
    """Adds J' W J of the rows of one contact, or of the single row `first`, whose entries are of the same joints."""
    for a in range(entries(p, world, first)):
        of_a = vec6()
        for r in range(count):
            of_a[r] = entry(p, world, row_of(p, first, contact, r), a)
        by = weight @ of_a
        if wp.dot(by, by) > ZERO:
            dof = dof_of(p, world, first, a)
            for b in range(entries(p, world, first)):
                other = dof_of(p, world, first, b)
                if other <= dof:
                    sum = ZERO
                    for r in range(count):
                        sum = sum + by[r] * entry(p, world, row_of(p, first, contact, r), b)
                    p.matrix[world, dof, other] = p.matrix[world, dof, other] + sum


@wp.func
def row_of(p: World, first: int, contact: int, r: int):
    row = first
    if r > 0:
        row = p.address[contact, r]
    return row


@wp.func
def cone(p: World, world: int, first: int, contact: int, at: int, curves: bool):
    """Force and curvature of a contact with an elliptic cone."""
    count = p.dim[contact]
    mu = wp.float64(p.friction[contact][0] * p.impratio[world % p.impratio.shape[0]])
    off = vec6()
    scale = vec6()
    scale[0] = mu
    for r in range(count):
        off[r] = off_reference(p, world, row_of(p, first, contact, r), at)
        if r > 0:
            scale[r] = wp.float64(p.friction[contact][r - 1])
    u = wp.cw_mul(off, scale)
    n = u[0]
    t = wp.sqrt(wp.max(wp.dot(u, u) - n * n, ZERO))
    force = vec6()
    weight = mat66()
    acts = bool(True)
    if n >= mu * t:
        acts = False
    elif mu * n + t <= ZERO:
        for r in range(count):
            d = wp.float64(p.efc_D[world, row_of(p, first, contact, r)])
            force[r] = -d * off[r]
            weight[r, r] = d
    else:
        d = wp.float64(p.efc_D[world, first]) / (mu * mu * (ONE + mu * mu))
        inside = n - mu * t
        # Of the cost d (n - mu t)² / 2 over u.
        for r in range(count):
            way = ONE
            if r > 0:
                way = -mu * u[r] / t
            force[r] = -d * inside * way * scale[r]
            for c in range(count):
                other = ONE
                if c > 0:
                    other = -mu * u[c] / t
                bend = way * other
                if r > 0 and c > 0:
                    bend = bend + inside * mu * u[r] * u[c] / (t * t * t)
                    if r == c:
                        bend = bend - inside * mu / t
                weight[r, c] = d * bend * scale[r] * scale[c]
    if acts:
        for r in range(count):
            push(p, world, row_of(p, first, contact, r), force[r])
        if curves:
            add_rows(p, world, first, count, contact, weight)


@wp.func
def constraints(p: World, world: int, at: int, curves: bool):
    """Force and curvature of MuJoCo's constraints."""
    for row in range(wp.min(p.nefc[world], p.efc_aref.shape[1])):
        kind = p.efc_kind[world, row]
        if kind == ELLIPTIC:
            contact = p.efc_id[world, row]
            if p.address[contact, 0] == row:
                cone(p, world, row, contact, at, curves)
        else:
            off = off_reference(p, world, row, at)
            d = wp.float64(p.efc_D[world, row])
            force = -d * off
            is_quadratic = bool(True)
            if kind > EQUALITY and kind <= FRICTION_TENDON:
                loss = wp.float64(p.efc_loss[world, row])
                is_quadratic = wp.abs(force) < loss
                force = wp.clamp(force, -loss, loss)
            elif kind > FRICTION_TENDON and off >= ZERO:
                is_quadratic = False
                force = ZERO
            if force != ZERO:
                push(p, world, row, force)
            if curves and is_quadratic:
                weight = mat66()
                weight[0, 0] = d
                add_rows(p, world, row, 1, 0, weight)


@wp.func
def velocity_after(p: World, world: int, i: int, at: int):
    """The velocities of a contact at the end of a step with the accelerations in place `at`."""
    out = p.law[i].before
    for dof in range(p.matrix.shape[1]):
        out = out + (p.dt_s * p.vector[world, at, dof]) * column(p.jacobian, i, dof)
    return out


@wp.func
def slope_at(p: World, world: int, at: int, curves: bool):
    """Gradient, and if asked for the curvature, of the cost that the accelerations minimise: that of MuJoCo's solver with the contacts. Returns
    the norm of the gradient."""
    nv = p.matrix.shape[1]
    for a in range(nv):
        p.vector[world, wp.static(GRADIENT), a] = -p.vector[world, wp.static(FORCE), a]
    for a in range(nv):
        for k in range(p.rowadr[a], p.rowadr[a] + p.rownnz[a]):
            b = p.colind[k]
            m = wp.float64(p.damped[world, k])
            if a == b and p.dof_damping.shape[0] > 0:
                m = m + p.dt_s * wp.float64(p.dof_damping[world % p.dof_damping.shape[0], a])
            p.vector[world, wp.static(GRADIENT), a] = p.vector[world, wp.static(GRADIENT), a] + m * p.vector[world, at, b]
            if a != b:
                p.vector[world, wp.static(GRADIENT), b] = p.vector[world, wp.static(GRADIENT), b] + m * p.vector[world, at, a]
    if curves:
        set_mass(p, world, p.damped, ONE)
        if p.dof_damping.shape[0] > 0:
            for a in range(nv):
                more = p.dt_s * wp.float64(p.dof_damping[world % p.dof_damping.shape[0], a])
                p.matrix[world, a, a] = p.matrix[world, a, a] + more
    constraints(p, world, at, curves)
    for k in range(p.contacts):
        i = world * p.contacts + k
        if p.law[i].touches != 0:
            f = follow(p.law[i], velocity_after(p, world, i, at))
            for dof in range(nv):
                less = wp.dot(column(p.jacobian, i, dof), f.all)
                p.vector[world, wp.static(GRADIENT), dof] = p.vector[world, wp.static(GRADIENT), dof] - less
            if curves:
                add_in_joints(p.matrix, world, p.jacobian, i, p.dt_s * f.fall)
    return wp.sqrt(dot(p, world, wp.static(GRADIENT), wp.static(GRADIENT)))


@wp.func
def search(p: World, world: int, slope: wp.float64):
    """Goes along the step to where the cost falls no more, or all of it where it still falls there. Returns the norm of the gradient there."""
    begin = ZERO
    end = ONE
    share = ONE
    left = slope
    right = ZERO
    norm = ZERO
    for _trial in range(TRIALS):
        for a in range(p.matrix.shape[1]):
            p.vector[world, wp.static(TRIAL), a] = p.vector[world, wp.static(NOW), a] - share * p.vector[world, wp.static(STEP), a]
        norm = slope_at(p, world, wp.static(TRIAL), False)
        here = -dot(p, world, wp.static(GRADIENT), wp.static(STEP))
        if wp.abs(here) <= -wp.float64(0.1) * slope or (here < ZERO and share == ONE):
            break
        if here < ZERO:
            begin = share
            left = here
        else:
            end = share
            right = here
        share = begin + (end - begin) * wp.clamp(left / (left - right), wp.float64(0.1), wp.float64(0.9))
    for a in range(p.matrix.shape[1]):
        p.vector[world, wp.static(NOW), a] = p.vector[world, wp.static(TRIAL), a]
    return norm


@wp.func
def minimise(p: World, world: int):
    """Brings the accelerations to the minimum of the cost, by Newton's method. Returns the gradient that is left over the forces."""
    size = wp.sqrt(dot(p, world, wp.static(FORCE), wp.static(FORCE)))
    for k in range(p.contacts):
        size = size + wp.length(p.law[world * p.contacts + k].all)
    left = slope_at(p, world, wp.static(NOW), False)
    for _round in range(ROUNDS):
        if not (left > SMALL * size):
            break
        slope_at(p, world, wp.static(NOW), True)
        factor(p.matrix, world)
        solve(p, world)
        left = search(p, world, -dot(p, world, wp.static(GRADIENT), wp.static(STEP)))
    return left / wp.max(size, LEAST)


@wp.kernel
def couple(
    p: World, wrench: wp.array2d(dtype=wp.spatial_vector), semi_implicit: wp.array(dtype=int), status: wp.array(dtype=int)
):
    """Finds the forces of all contacts of a world together, where explicit ones would not be calm: those at the velocities at the end of the step."""
    world = wp.tid()
    nv = p.matrix.shape[1]
    semi_implicit[world] = 0
    set_mass(p, world, p.mass, CALM)
    for k in range(p.contacts):
        i = world * p.contacts + k
        if p.law[i].touches != 0:
            semi_implicit[world] = 1
            add_in_joints(p.matrix, world, p.jacobian, i, -p.law[i].vibrates)
    if semi_implicit[world] == 0 or factor(p.matrix, world):
        semi_implicit[world] = 0
        return
    for a in range(nv):
        p.vector[world, wp.static(FORCE), a] = wp.float64(p.force[world, a])
        p.vector[world, wp.static(NOW), a] = ZERO
    left = ZERO
    changed = ONE
    # The limits of friction follow the normal forces at the end of the step.
    for _round in range(SHARES):
        if not (changed > CLOSE):
            break
        left = minimise(p, world)
        changed = ZERO
        for k in range(p.contacts):
            i = world * p.contacts + k
            if p.law[i].touches != 0:
                pressure = follow(p.law[i], velocity_after(p, world, i, wp.static(NOW))).pressure
                share = ONE
                if p.law[i].pressure > ZERO:
                    share = wp.max(ZERO, pressure) / p.law[i].pressure
                changed = wp.max(changed, wp.abs(share - p.law[i].share))
                p.law[i].share = share
    is_found = left < FOUND and changed < OFF
    for k in range(p.contacts):
        i = world * p.contacts + k
        if p.law[i].touches != 0:
            f = follow(p.law[i], velocity_after(p, world, i, wp.static(NOW)))
            w = wp.spatial_vector()
            if f.pressure > ZERO:
                for c in range(6):
                    w[c] = float(f.all[c])
            wrench[world, k] = w
            if not is_found:
                status[i] = status[i] | wp.static(int(Status.NOT_CONVERGED))


@wp.kernel
def other_forces(
    applied: wp.array2d(dtype=float), actuator: wp.array2d(dtype=float), bias: wp.array2d(dtype=float), passive: wp.array2d(dtype=float),
    force: wp.array2d(dtype=float),
):
    """Forces of a step but those of contacts, constraints and on bodies."""
    world, dof = wp.tid()
    force[world, dof] = passive[world, dof] + applied[world, dof] + actuator[world, dof] - bias[world, dof]


def patch_stiffness(pad: Pad, device: Any) -> float:
    """Stiffness of the patches of a pad over the area in contact, N/m per mm², against motions within the tolerance of its equilibrium, in
    which the bulk does not move. Such a motion may still start a new equilibrium, so the upper quartile of many is taken."""
    depths, tiny_mm = 12, 5e-5
    depth = np.repeat(pad.depth_max_mm * np.arange(1, depths + 1, dtype=np.float32) / np.float32(depths + 1), 4)
    way = np.tile(np.array([[tiny_mm, 0], [-tiny_mm, 0], [0, tiny_mm], [0, -tiny_mm]], np.float32), (depths, 1))
    fingers = Fingers(pad, len(depth), device=device)
    rest = fingers.step(depth, strength_factor=5.0).numpy()
    to = depth + way[:, 0]
    moved = fingers.step(to, way[:, 1]).numpy()
    more = np.where(way[:, 1] == 0, moved["normal_force_n"] - rest["normal_force_n"], moved["friction_x_n"] - rest["friction_x_n"])
    found = 1000 * more.astype(np.float64) / (to - depth + way[:, 1]) / np.maximum(rest["contact_area_mm2"], 1e-15)
    return max(0.0, float(np.sort(found)[3 * len(found) // 4]))


def finger_of(model: Model | Pad, damping: wp.vec3, device: Any) -> Finger:
    """The numbers of a model of which the stiffness of its contacts follows."""
    out = Finger()
    out.damping = damping
    if isinstance(model, Pad):
        out.patch_stiffness = patch_stiffness(model, device)
    else:
        share, centre, arm_x, arm_y = (model.springs[:, k].astype(np.float64) for k in (place.STIFFNESS, place.CENTRE, place.ARM, place.ARM + 1))
        out.centre = float(share @ centre)
        out.square_x, out.square_y = float(share @ arm_y**2), float(share @ (centre**2 + arm_x**2))
    return out


class Coupling:
    """The laws of the contacts and the room for their coupling, in all worlds."""

    def __init__(self, worlds: int, is_implicit: bool, jacobian: Any) -> None:
        """is_implicit: whether the integrator takes the damping of tendons and actuators from the end of the step as well."""
        self.worlds, self.device, nv, self._is_implicit = worlds, jacobian.device, jacobian.shape[2], is_implicit
        self.law = wp.zeros(jacobian.shape[0], dtype=Law, device=self.device)
        self._force = wp.zeros((worlds, nv), dtype=float, device=self.device)
        self._no_damping, self._damped = wp.zeros((0, 0), dtype=float, device=self.device), None
        self._world = world = World()
        world.contacts, world.jacobian, world.law = jacobian.shape[0] // worlds, jacobian, self.law
        world.matrix = wp.zeros((worlds, nv, nv), dtype=wp.float64, device=self.device)
        world.vector = wp.zeros((worlds, VECTORS, nv), dtype=wp.float64, device=self.device)

    def solve(self, m: Any, d: Any, dt_s: float, wrench: Any, semi_implicit: Any, status: Any) -> None:
        """Replaces the wrenches of contacts in worlds where explicit ones would not be calm."""
        import mujoco
        import mujoco_warp

        # MuJoCo Warp itself computes these two after the passive forces.
        mujoco_warp.rne(m, d)
        mujoco_warp.fwd_actuation(m, d)
        wp.launch(
            other_forces,
            dim=self._force.shape,
            inputs=[d.qfrc_applied, d.qfrc_actuator, d.qfrc_bias, d.qfrc_passive],
            outputs=[self._force],
            device=self.device,
        )
        mujoco_warp.xfrc_accumulate(m, d, self._force)
        world, efc, flag = self._world, d.efc, mujoco.mjtDisableBit
        world.dt_s, world.force, world.mass, world.damped = dt_s, self._force, d.M, d.M
        world.rownnz, world.rowadr, world.colind = m.M_rownnz, m.M_rowadr, m.M_colind
        world.dof_damping = self._no_damping
        if self._is_implicit:
            # Made once: a step that allocates fits in no CUDA graph.
            if self._damped is None:
                self._damped = wp.empty_like(d.M)
            world.damped = self._damped
            mujoco_warp.deriv_smooth_vel(m, d, world.damped)
        elif not m.opt.disableflags & (flag.mjDSBL_EULERDAMP | flag.mjDSBL_DAMPER):
            world.dof_damping = m.dof_damping
        world.nefc, world.is_sparse, world.efc_kind, world.efc_id = d.nefc, int(m.is_sparse), efc.type, efc.id
        world.efc_J, world.efc_rownnz, world.efc_rowadr, world.efc_colind = efc.J, efc.J_rownnz, efc.J_rowadr, efc.J_colind
        world.efc_D, world.efc_aref, world.efc_loss = efc.D, efc.aref, efc.frictionloss
        world.dim, world.friction, world.address = d.contact.dim, d.contact.friction, d.contact.efc_address
        world.impratio = m.opt.impratio_invsqrt
        wp.launch(couple, dim=self.worlds, inputs=[world], outputs=[wrench, semi_implicit, status], device=self.device)
