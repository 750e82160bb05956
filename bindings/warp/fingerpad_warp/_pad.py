"""One step of a pad, as a Warp kernel with one thread a contact.

Main functions: `step_pad` (the kernel), `solve` (the bulk in equilibrium); main class: `Engine`. The formulas are those of the core
(`core/src/pad`): one stored energy of the bulk's sixteen coordinates and of the patches, brought to equilibrium by Newton's method with
the tangent stiffness of an earlier step and with secants over the last rounds. What a patch does in a state of the bulk is computed again
wherever it is needed, which takes less memory than to keep it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from fingerpad_warp import _arrays, _bed
from fingerpad_warp import _pad_model as place
from fingerpad_warp._errors import InputError
from fingerpad_warp._pad_model import MODES, Pad, Plane, body_numbers
from fingerpad_warp._status import Regime, Status

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 4})

Bulk = wp.types.vector(length=MODES, dtype=wp.float32)
Square = wp.types.matrix(shape=(MODES, MODES), dtype=wp.float32)
Modes = wp.types.matrix(shape=(3, MODES), dtype=wp.float32)
Rigid = wp.types.matrix(shape=(6, MODES), dtype=wp.float32)
Pairs = wp.types.matrix(shape=(3, MODES), dtype=wp.float32)
Vec6 = wp.types.vector(length=6, dtype=wp.float32)

# Rows of the memory of a contact; behind them, for all patches, anchors (2 a patch), reserves (1 a patch) and turns (2 a patch).
BULK, DRIFT, MOTION, FACTOR = 0, 16, 32, 38
SHIFT, ANGLE, PIVOT, DEPTH, TILT, STRENGTH, FLAGS, APPROACH, PATCHES = 174, 178, 180, 183, 184, 186, 187, 188, 189
PER_PATCH = 5
IN_CONTACT, FACTORED = 1, 2

# Rows of what a step keeps of a patch: spread (negative for a patch that is not looked at), strength at full area, anchor.
KEPT = 4

TOUCH_MM = wp.constant(wp.float32(1.0 / (1 << 20)))
LARGEST = wp.constant(wp.float32(1e9))
LONGEST_STEP = wp.constant(wp.float32(64.0))
TINY = wp.constant(wp.float32(1.17549435e-38))
FAR_MM = wp.constant(wp.float32(16.0))
LEAST_SPREAD_MM2 = wp.constant(wp.float32(1e-8))
ROOT_3 = wp.constant(wp.float32(1.7320508))
WAKE_MM = wp.constant(wp.float32(0.15))
ARM_MM = wp.constant(wp.float32(20.0))
TURN_MM = wp.constant(wp.float32(5.0))
RAD = wp.constant(wp.float32(np.pi / 180))
APART = wp.constant(wp.float32(2.0))
SLIPS_SHARE = wp.constant(wp.float32(1.0 + 4e-6))
SLIPS_MM = wp.constant(wp.float32(4e-6))
NOTICED = wp.constant(wp.float32(4e-3))
NOTICED_LENGTH = wp.constant(wp.float32(5e-5))
MOST_RESERVE_MM = wp.constant(wp.float32(0.6))
# Exponent of the slipping share of a patch that touches over its whole area, over that of the file.
WHOLE = wp.constant(wp.float32(0.8))
# Stick ratios from which on a contact sticks, and up to which it slips.
STICKS = wp.constant(wp.float32(0.99))
SLIPS = wp.constant(wp.float32(0.01))
# The shift of a body near first touch, as in `touch.rs` of the core.
SHIFTED = wp.constant(wp.float32(0.02))
PER_DISTANCE = wp.constant(wp.float32(3.0))
MOST_SHIFTED = wp.constant(wp.float32(0.22))
ROUND = wp.constant(wp.float32(20.0))
TOGETHER_MM = wp.constant(wp.float32(0.005))
AWAY_RAD2 = wp.constant(wp.float32(0.05 * 0.05))

# Depth beyond which the bands grow with depth, and where the slope of a body is taken beside its apex, mm.
DEEP_MM = wp.constant(wp.float32(2.6))
BESIDE_MM = wp.constant(wp.float32(2.0))
# Least mean square of the arms of a contact about its middle, mm2.
LEAST_ARM2 = wp.constant(wp.float32(0.01))

# Largest exponent of the stiffening of the bulk.
MOST_GROWTH = wp.constant(wp.float32(20.0))
# Most rounds of a step, most halvings of a round, most factors of the stiffness in a step.
EFFORT = wp.constant(200)
FACTOR_COST = wp.constant(4)
BETTER2 = wp.constant(wp.float32(0.25))
HALVINGS = wp.constant(6)
# Square of the change of the bulk below which it is in equilibrium, over the square of its size, and the least size that counts.
TOLERANCE2 = wp.constant(wp.float32(2e-4 * 2e-4))
LEAST_SIZE2 = wp.constant(wp.float32(3e-3 * 3e-3))
LONGEST2 = wp.constant(wp.float32(4.0))
MET2 = wp.constant(wp.float32(3e-3 * 3e-3))
KEPT2 = wp.constant(wp.float32(0.4 * 0.4))
FACTORS = wp.constant(2)
LEAST_PIVOT = wp.constant(wp.float32(0.25))


# ---- bodies ----


@wp.struct
class Solid:
    """A rigid body: kind (plane, sphere, cylinder, edge), radius, directions of axis and faces."""

    kind: int
    radius: float
    axis_cos: float
    axis_sin: float
    face_cos: float
    face_sin: float


@wp.func
def side_of(radius: float):
    side = float(1.0)
    if radius < 0.0:
        side = -1.0
    return side


@wp.func
def overlap_at(body: Solid, at: wp.vec3):
    """How far a place lies below the surface, mm, and how that changes with the place: a unit vector into the body."""
    out = wp.vec4(-at[2], 0.0, 0.0, -1.0)
    if body.kind == 1:
        up = at[2] + body.radius
        distance = wp.sqrt(at[0] * at[0] + at[1] * at[1] + up * up + TINY)
        side = side_of(body.radius)
        over = at[0] * at[0] + at[1] * at[1] + at[2] * (at[2] + 2.0 * body.radius)
        inward = -side / distance
        out = wp.vec4(-side * over / (distance + wp.abs(body.radius)), at[0] * inward, at[1] * inward, up * inward)
    elif body.kind == 2:
        u = body.axis_cos * at[1] - body.axis_sin * at[0]
        up = at[2] + body.radius
        distance = wp.sqrt(u * u + up * up + TINY)
        side = side_of(body.radius)
        over = u * u + at[2] * (at[2] + 2.0 * body.radius)
        inward = -side / distance
        across = u * inward
        out = wp.vec4(
            -side * over / (distance + wp.abs(body.radius)), -body.axis_sin * across, body.axis_cos * across, up * inward
        )
    elif body.kind == 3:
        u = body.axis_cos * at[1] - body.axis_sin * at[0]
        up = at[2] + body.radius
        far = wp.abs(u)
        overlap = body.radius - far * body.face_sin - up * body.face_cos
        out_u = body.face_sin
        if u < 0.0:
            out_u = -body.face_sin
        out_z = body.face_cos
        if up > 0.0 and far * body.face_cos <= up * body.face_sin:
            distance = wp.sqrt(u * u + up * up + TINY)
            overlap = -(u * u + at[2] * (at[2] + 2.0 * body.radius)) / (distance + body.radius)
            out_u = u / distance
            out_z = up / distance
        out = wp.vec4(overlap, body.axis_sin * out_u, -body.axis_cos * out_u, -out_z)
    return out


@wp.func
def arc(radius: float, square: float):
    rest = wp.sqrt(wp.max(radius * radius - square, 0.0))
    return -side_of(radius) * square / (wp.abs(radius) + rest)


@wp.func
def surface_point(body: Solid, x: float, y: float):
    """The point of the surface over a place of the tangent plane."""
    z = float(0.0)
    if body.kind == 1:
        z = arc(body.radius, x * x + y * y)
    elif body.kind >= 2:
        u = wp.abs(body.axis_cos * y - body.axis_sin * x)
        z = arc(body.radius, u * u)
        if body.kind == 3:
            end = body.radius * body.face_sin
            if u > end:
                z = -(body.radius * (1.0 - body.face_cos) + (u - end) * body.face_sin / body.face_cos)
    return wp.vec3(x, y, z)


@wp.func
def into(body: Solid, at: wp.vec3):
    o = overlap_at(body, at)
    return wp.vec3(o[1], o[2], o[3])


@wp.func
def foot(body: Solid, at: wp.vec3):
    """Where a place is held that is not in contact: on the surface beside it."""
    o = overlap_at(body, at)
    return wp.vec2(at[0] - o[0] * o[1], at[1] - o[0] * o[2])


@wp.func
def mean_overlap(body: Solid, at: wp.vec3, sides: wp.mat33):
    """Mean overlap of a patch on a curved body and its slope; points beside the middle are in the columns of `sides`."""
    sum = wp.vec4(0.0, 0.0, 0.0, 0.0)
    for k in range(3):
        side = wp.vec3(sides[0, k], sides[1, k], sides[2, k])
        sum = sum + overlap_at(body, at + side) + overlap_at(body, at - side)
    return sum * (1.0 / 6.0)


@wp.struct
class Spread:
    """How the overlap differs within a patch; see the core's `Spread`."""

    moment: wp.vec3
    variance: float
    variance_slope: wp.vec3
    variance_moment: wp.vec3


@wp.func
def spread_of(body: Solid, at: wp.vec3, sides: wp.mat33):
    mean = mean_overlap(body, at, sides)
    out = Spread()
    out.moment = wp.vec3(0.0, 0.0, 0.0)
    out.variance = 0.0
    out.variance_slope = wp.vec3(0.0, 0.0, 0.0)
    out.variance_moment = wp.vec3(0.0, 0.0, 0.0)
    for k in range(6):
        arm = wp.vec3(sides[0, k // 2], sides[1, k // 2], sides[2, k // 2])
        if k % 2 == 1:
            arm = -arm
        o = overlap_at(body, at + arm)
        off = o[0] - mean[0]
        slope = wp.vec3(o[1], o[2], o[3])
        out.variance = out.variance + off * off * (1.0 / 6.0)
        out.moment = out.moment + wp.cross(arm, slope) * (1.0 / 6.0)
        out.variance_slope = out.variance_slope + slope * (off / 6.0)
        out.variance_moment = out.variance_moment + wp.cross(arm, slope) * (off / 6.0)
    return out


# ---- where the body is ----


@wp.struct
class Frame:
    """From the finger's frame to that of the body."""

    axes: wp.mat33
    soft: wp.mat33
    apex: wp.vec3
    pivot: wp.vec3
    # The part that only holds near first touch: shift along the normal, mm, change of the place per depth, and addition to the arm of the
    # normal force, finger's frame, mm.
    shift: float
    rate: float
    arm: wp.vec3


@wp.func
def tilted_axes(pitch: float, roll: float):
    ps = wp.sin(pitch)
    pc = wp.cos(pitch)
    rs = wp.sin(roll)
    rc = wp.cos(roll)
    return wp.mat33(pc, ps * rs, ps * rc, 0.0, rc, -rs, -ps, pc * rs, pc * rc)


@wp.func
def first_touch_mm(numbers: wp.array(dtype=float), normal: wp.vec3):
    """Height of the plane at first touch over the origin, along its normal, mm."""
    x = normal[0]
    y = normal[1] * normal[1]
    x2 = x * x
    y2 = y * y
    x3 = x2 * x
    x4 = x2 * x2
    x6 = x2 * x2 * x2
    a = wp.static(place.FIRST_TOUCH)
    sum = numbers[a] + x * numbers[a + 1] + x2 * numbers[a + 2] + x3 * numbers[a + 3] + x4 * numbers[a + 4]
    sum = sum + x4 * x * numbers[a + 5] + x6 * numbers[a + 6] + y * numbers[a + 7] + y * x * numbers[a + 8]
    sum = sum + y * x2 * numbers[a + 9] + y * x3 * numbers[a + 10] + y * x4 * numbers[a + 11] + y2 * numbers[a + 12]
    sum = sum + y2 * x * numbers[a + 13] + y2 * x2 * numbers[a + 14] + y2 * y * numbers[a + 15] + y2 * y * x * numbers[a + 16]
    return sum + x6 * x * numbers[a + 17] + y2 * x3 * numbers[a + 18] + y2 * y2 * numbers[a + 19]


@wp.func
def first_touch_point_mm(numbers: wp.array(dtype=float), axes: wp.mat33):
    """The point of the undeformed finger that a plane with these axes touches first, along the axes of the finger, mm."""
    x = axes[2, 0]
    root = axes[2, 1]
    y = root * root
    x2 = x * x
    x3 = x2 * x
    y2 = y * y
    a = wp.static(place.FIRST_TOUCH)
    by_x = numbers[a + 1] + 2.0 * x * numbers[a + 2] + 3.0 * x2 * numbers[a + 3] + 4.0 * x3 * numbers[a + 4]
    by_x = by_x + 5.0 * x2 * x2 * numbers[a + 5] + 6.0 * x2 * x3 * numbers[a + 6] + 7.0 * x3 * x3 * numbers[a + 17]
    by_x = by_x + y * (numbers[a + 8] + 2.0 * x * numbers[a + 9] + 3.0 * x2 * numbers[a + 10] + 4.0 * x3 * numbers[a + 11])
    by_x = by_x + y2 * (numbers[a + 13] + 2.0 * x * numbers[a + 14] + 3.0 * x2 * numbers[a + 18]) + y2 * y * numbers[a + 16]
    by_y = numbers[a + 7] + x * numbers[a + 8] + x2 * numbers[a + 9] + x3 * numbers[a + 10] + x2 * x2 * numbers[a + 11]
    by_y = by_y + 2.0 * y * (numbers[a + 12] + x * numbers[a + 13] + x2 * numbers[a + 14] + x3 * numbers[a + 18])
    by_y = by_y + 3.0 * y2 * (numbers[a + 15] + x * numbers[a + 16]) + 4.0 * y2 * y * numbers[a + 19]
    # The terms are in the square of the normal's y.
    by_root = 2.0 * root * by_y
    along = axes[0, 0] * by_x + axes[0, 1] * by_root
    across = axes[1, 0] * by_x + axes[1, 1] * by_root
    normal = wp.vec3(x, root, axes[2, 2])
    return wp.transpose(axes) @ wp.vec3(along, across, first_touch_mm(numbers, normal))


@wp.func
def middle_of(patches: wp.array2d(dtype=float), j: int):
    return wp.vec3(patches[j, 0], patches[j, 1], patches[j, 2])


@wp.func
def root_of_spread(patches: wp.array2d(dtype=float), j: int):
    """Lower triangle L of the second moment L L' of a patch, mm."""
    s = wp.static(place.SPREAD)
    return wp.mat33(
        patches[j, s], 0.0, 0.0, patches[j, s + 1], patches[j, s + 2], 0.0, patches[j, s + 3], patches[j, s + 4], patches[j, s + 5]
    )


@wp.func
def patches_meet(patches: wp.array2d(dtype=float), normal: wp.vec3):
    """Place, mm, at which the first patches meet a plane, and the plane's height there, mm; finger's frame."""
    least = float(3.0e38)
    sum = float(0.0)
    met = wp.vec3(0.0, 0.0, 0.0)
    for j in range(patches.shape[0]):
        low = root_of_spread(patches, j)
        along = wp.transpose(low) @ normal
        spread = wp.sqrt(wp.dot(along, along) + LEAST_SPREAD_MM2)
        height = wp.dot(normal, middle_of(patches, j)) - spread
        weight = float(1.0)
        if height < least:
            kept = float(0.0)
            if least - height < 20.0 * TOGETHER_MM:
                kept = wp.exp((height - least) / TOGETHER_MM)
            sum = sum * kept
            met = met * kept
            least = height
        elif height - least < 20.0 * TOGETHER_MM:
            weight = wp.exp((least - height) / TOGETHER_MM)
        else:
            weight = 0.0
        sum = sum + weight
        # The point of the ellipsoid that is closest to the plane.
        met = met + (middle_of(patches, j) - low @ along / spread) * weight
    return wp.vec4(met[0] / sum, met[1] / sum, met[2] / sum, least - TOGETHER_MM * wp.log(sum))


@wp.func
def steepness(body: Solid):
    """Mean slope from the apex of a body to points beside it; 0 for a plane."""
    sum = float(0.0)
    if body.kind != 0:
        for k in range(2):
            side = BESIDE_MM * (1.0 - 2.0 * float(k))
            along = surface_point(body, side, 0.0)
            across = surface_point(body, 0.0, side)
            sum = sum + along[2] + across[2]
    return wp.abs(sum) * (0.25 / BESIDE_MM)


@wp.func
def with_approach(
    frame: Frame,
    numbers: wp.array(dtype=float),
    patches: wp.array2d(dtype=float),
    body: Solid,
    tilted: wp.mat33,
    depth: float,
):
    """The frame with the shift of the body near first touch, where the patches meet a plane before or after the skin does."""
    frame.shift = 0.0
    frame.rate = 1.0
    frame.arm = wp.vec3(0.0, 0.0, 0.0)
    depth_max = numbers[wp.static(place.DEPTH_MAX)]
    flatness = wp.max(1.0 - ROUND * steepness(body), 0.0)
    if depth < MOST_SHIFTED * depth_max and flatness > 0.0:
        normal = wp.vec3(tilted[2, 0], tilted[2, 1], tilted[2, 2])
        meets = patches_meet(patches, normal)
        largest = (MOST_SHIFTED - SHIFTED) * depth_max / PER_DISTANCE
        off = meets[3] - first_touch_mm(numbers, normal)
        within = wp.clamp(off, -largest, largest)
        late = within * flatness
        range = SHIFTED * depth_max + PER_DISTANCE * wp.abs(late)
        left = 1.0 - depth / range
        if left > 0.0:
            touch = first_touch_point_mm(numbers, tilted)
            per_depth = -2.0 * late * left / range
            per_off = (left * left + wp.abs(per_depth) * PER_DISTANCE * depth / range) * flatness
            if within != off:
                per_off = 0.0
            frame.shift = late * left * left
            frame.rate = 1.0 + per_depth
            frame.arm = (touch - wp.vec3(meets[0], meets[1], meets[2])) * per_off + (touch - frame.pivot) * per_depth
    frame.apex = frame.apex + wp.vec3(0.0, 0.0, frame.shift)
    return frame


@wp.func
def frame_of(
    numbers: wp.array(dtype=float), patches: wp.array2d(dtype=float), memory: wp.array2d(dtype=float), body: Solid, i: int
):
    tilted = tilted_axes(memory[wp.static(TILT), i], memory[wp.static(TILT + 1), i])
    sin = wp.sin(memory[wp.static(ANGLE), i])
    cos = wp.cos(memory[wp.static(ANGLE), i])
    turned = wp.mat33(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0)
    frame = Frame()
    frame.axes = turned @ tilted
    across = numbers[wp.static(place.SOFTNESS)]
    along = numbers[wp.static(place.SOFTNESS + 1)]
    frame.soft = wp.mat33(across, 0.0, 0.0, 0.0, across, 0.0, 0.0, 0.0, along) @ frame.axes
    frame.pivot = wp.vec3(memory[wp.static(PIVOT), i], memory[wp.static(PIVOT + 1), i], memory[wp.static(PIVOT + 2), i])
    normal = wp.vec3(tilted[2, 0], tilted[2, 1], tilted[2, 2])
    x = memory[wp.static(SHIFT), i]
    y = memory[wp.static(SHIFT + 2), i]
    height = first_touch_mm(numbers, normal) - wp.dot(normal, frame.pivot) + memory[wp.static(DEPTH), i]
    frame.apex = wp.vec3(cos * x + sin * y, cos * y - sin * x, height)
    return with_approach(frame, numbers, patches, body, tilted, memory[wp.static(DEPTH), i])


@wp.func
def placed(patches: wp.array2d(dtype=float), frame: Frame, j: int):
    """Place of an undeformed patch, body's frame, mm."""
    return frame.axes @ (middle_of(patches, j) - frame.pivot) - frame.apex


@wp.func
def sides_of(patches: wp.array2d(dtype=float), frame: Frame, j: int):
    return frame.axes @ root_of_spread(patches, j) * ROOT_3


# ---- one patch ----


@wp.func
def flat_rate(patches: wp.array2d(dtype=float), numbers: wp.array(dtype=float), j: int):
    return numbers[wp.static(place.FLATTENING + 1)] * wp.sqrt(patches[j, wp.static(place.PATCH_AREA)])


@wp.func
def flat_force(patches: wp.array2d(dtype=float), numbers: wp.array(dtype=float), j: int, spread: float):
    """Force at which all of a patch touches, N."""
    own = patches[j, wp.static(place.PATCH_AREA)] * numbers[wp.static(place.FLATTENING)]
    return own + flat_rate(patches, numbers, j) * spread


@wp.func
def full_strength(patches: wp.array2d(dtype=float), numbers: wp.array(dtype=float), j: int, spread: float):
    """Largest friction of a patch at the force at which its area is largest, N."""
    full = numbers[wp.static(place.AREA + 1)] * flat_force(patches, numbers, j, spread)
    area = numbers[wp.static(place.AREA)] * patches[j, wp.static(place.PATCH_AREA)]
    beta = numbers[wp.static(place.FRICTION + 1)]
    return numbers[wp.static(place.FRICTION)] * area * wp.exp(beta * wp.log(full / area))


@wp.struct
class Acting:
    """A patch in a state of the bulk. Unless it touches, place and overlap alone are set."""

    touches: int
    place: wp.vec3
    overlap: float
    inward: wp.vec3
    force: float
    slope: float
    strength: float
    below: float
    stretch: wp.vec3
    held_inward: wp.vec3
    length: float
    bound: float
    grip: float


@wp.func
def act(
    numbers: wp.array(dtype=float),
    patches: wp.array2d(dtype=float),
    modes: wp.array(dtype=Modes),
    kept: wp.array2d(dtype=float),
    body: Solid,
    frame: Frame,
    strength_factor: float,
    bulk: Bulk,
    lift: wp.vec3,
    swept: wp.mat33,
    i: int,
    j: int,
):
    """What a patch does in a state of the bulk."""
    out = Acting()
    out.touches = 0
    spread = kept[KEPT * j, i]
    centre = wp.vec3(
        numbers[wp.static(place.CENTRE)], numbers[wp.static(place.CENTRE + 1)], numbers[wp.static(place.CENTRE + 2)]
    )
    second = lift + swept @ (middle_of(patches, j) - centre)
    out.place = placed(patches, frame, j) + frame.soft @ (modes[j] @ bulk + second)
    o = overlap_at(body, out.place)
    if body.kind != 0:
        o = mean_overlap(body, out.place, sides_of(patches, frame, j))
    out.overlap = o[0]
    if out.overlap + spread > 0.0:
        out.touches = 1
        out.inward = wp.vec3(o[1], o[2], o[3])
        # Of the share s³ of the force at which all of it touches: compliance flat s³ + spread s² = overlap + spread, up to s = 1.
        compliance = patches[j, wp.static(place.COMPLIANCE)]
        flat = flat_force(patches, numbers, j, spread)
        over = out.overlap + spread
        a = compliance * flat
        if over >= a + spread:
            out.force = out.overlap / compliance
            out.slope = 1.0 / compliance
        else:
            s = wp.sqrt(wp.min(over / spread, 1.0))
            for _round in range(24):
                value = (a * s + spread) * (s * s) - over
                fall = value / ((3.0 * a * s + 2.0 * spread) * s + TINY)
                s = s - fall
                if not (fall > 1e-5 * s):
                    break
            s = wp.max(s, 0.0)
            out.force = flat * (s * s * s)
            out.slope = 3.0 * flat * s / (3.0 * a * s + 2.0 * spread)
        beta = numbers[wp.static(place.FRICTION + 1)]
        log = wp.log(out.force / (numbers[wp.static(place.AREA + 1)] * flat) + TINY)
        exponent = beta
        out.below = 0.0
        if log < 0.0:
            exponent = beta + numbers[wp.static(place.AREA + 2)] * (1.0 - beta)
            out.below = log
        out.strength = kept[KEPT * j + 1, i] * wp.exp(exponent * log) * strength_factor
        anchor = surface_point(body, kept[KEPT * j + 2, i], kept[KEPT * j + 3, i])
        out.held_inward = into(body, anchor)
        across = anchor - out.place
        if body.kind == 0:
            out.stretch = wp.vec3(across[0], across[1], 0.0)
        else:
            out.stretch = across - out.held_inward * wp.dot(across, out.held_inward)
        out.length = wp.sqrt(wp.dot(out.stretch, out.stretch) + TINY)
        tangential = patches[j, wp.static(place.COMPLIANCE + 1)]
        out.bound = out.strength * tangential
        out.grip = 1.0 / tangential
        if out.length > out.bound:
            out.grip = out.strength / out.length
    return out


# ---- the bulk ----


@wp.func
def lifted(numbers: wp.array(dtype=float), axis: int, a: wp.vec3, b: wp.vec3):
    """The part of the second order that is the same for all patches, along z (axis 0) or x (axis 1), mm."""
    n = wp.static(place.LIFT) + 12 * axis
    sum = numbers[n] * (a[0] * a[0]) + numbers[n + 1] * (a[1] * a[1]) + numbers[n + 2] * (a[2] * a[2])
    sum = sum + numbers[n + 3] * (a[0] * a[1]) + numbers[n + 4] * (a[0] * a[2]) + numbers[n + 5] * (a[1] * a[2])
    sum = sum + numbers[n + 6] * (b[0] * b[0]) + numbers[n + 7] * (b[1] * b[1]) + numbers[n + 8] * (b[2] * b[2])
    return sum + numbers[n + 9] * (b[0] * b[1]) + numbers[n + 10] * (b[0] * b[2]) + numbers[n + 11] * (b[1] * b[2])


@wp.func
def lift_of(numbers: wp.array(dtype=float), m: Vec6):
    a = wp.vec3(m[0], m[2], m[4])
    b = wp.vec3(m[1], m[3], m[5])
    return wp.vec3(lifted(numbers, 1, a, b), 0.0, lifted(numbers, 0, a, b))


@wp.func
def lift_slope(numbers: wp.array(dtype=float), axis: int, m: Vec6):
    """Derivatives of `lifted` over the rigid motion."""
    n = wp.static(place.LIFT) + 12 * axis
    out = Vec6()
    for part in range(2):
        p = n + 6 * part
        a = m[part]
        b = m[2 + part]
        c = m[4 + part]
        if part == 1:
            a = m[1]
            b = m[3]
            c = m[5]
        out[part] = 2.0 * numbers[p] * a + numbers[p + 3] * b + numbers[p + 4] * c
        out[2 + part] = 2.0 * numbers[p + 1] * b + numbers[p + 3] * a + numbers[p + 5] * c
        out[4 + part] = 2.0 * numbers[p + 2] * c + numbers[p + 4] * a + numbers[p + 5] * b
    return out


@wp.func
def swept_by(m: Vec6, factor: float):
    """The matrix of r x (r x a) times a factor, of the rotation vector r of a rigid motion."""
    r = wp.vec3(m[3], m[4], m[5])
    return (wp.outer(r, r) - wp.identity(n=3, dtype=float) * wp.dot(r, r)) * factor


@wp.func
def misfit(
    numbers: wp.array(dtype=float),
    patches: wp.array2d(dtype=float),
    modes: wp.array(dtype=Modes),
    rigid: wp.array(dtype=Rigid),
    squash: wp.array(dtype=Square),
    kept: wp.array2d(dtype=float),
    body: Solid,
    frame: Frame,
    strength_factor: float,
    bulk: Bulk,
    i: int,
):
    """What is missing to equilibrium: the gradient of the energy."""
    m = rigid[0] @ bulk
    half_turn = 0.5 * numbers[wp.static(place.TURN)]
    lift = lift_of(numbers, m)
    swept = swept_by(m, half_turn)
    whole = wp.vec3(0.0, 0.0, 0.0)
    products = wp.mat33(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    centre = wp.vec3(
        numbers[wp.static(place.CENTRE)], numbers[wp.static(place.CENTRE + 1)], numbers[wp.static(place.CENTRE + 2)]
    )
    gradient = bulk
    for j in range(patches.shape[0]):
        if kept[KEPT * j, i] >= 0.0:
            acting = act(numbers, patches, modes, kept, body, frame, strength_factor, bulk, lift, swept, i, j)
            if acting.touches == 1:
                pull = wp.transpose(frame.soft) @ (acting.stretch * acting.grip - acting.inward * acting.force)
                whole = whole + pull
                products = products + wp.outer(middle_of(patches, j) - centre, pull)
                gradient = gradient - pull @ modes[j]
    turn = wp.vec3(m[3], m[4], m[5])
    trace = products[0, 0] + products[1, 1] + products[2, 2]
    by_turn = products @ turn + wp.transpose(products) @ turn - turn * (2.0 * trace)
    on_motion = lift_slope(numbers, 0, m) * whole[2] + lift_slope(numbers, 1, m) * whole[0]
    for k in range(3):
        on_motion[3 + k] = on_motion[3 + k] + by_turn[k] * half_turn
    gradient = gradient - on_motion @ rigid[0]
    # The bulk stiffens as it is squashed: its energy grows by rate q³ exp(growth q²).
    pulled = bulk @ squash[0]
    q = wp.sqrt(wp.max(wp.dot(pulled, bulk), 0.0) + 1e-18)
    y = wp.min(numbers[wp.static(place.STIFFENING + 1)] * q * q, MOST_GROWTH)
    per_size = numbers[wp.static(place.STIFFENING)] * q * wp.exp(y) * (3.0 + 2.0 * y)
    return gradient + pulled * per_size


@wp.func
def upper_half(x: float):
    """The nearest number in the upper 16 bits of single precision, in which the core keeps the factor."""
    bits = wp.cast(x, wp.uint32)
    rounded = bits + wp.uint32(0x7FFF) + ((bits >> wp.uint32(16)) & wp.uint32(1))
    return wp.cast((rounded >> wp.uint32(16)) << wp.uint32(16), wp.float32)


@wp.func
def factor_of_stiffness(
    numbers: wp.array(dtype=float),
    patches: wp.array2d(dtype=float),
    modes: wp.array(dtype=Modes),
    rigid: wp.array(dtype=Rigid),
    squash: wp.array(dtype=Square),
    kept: wp.array2d(dtype=float),
    body: Solid,
    frame: Frame,
    strength_factor: float,
    bulk: Bulk,
    i: int,
):
    """Factor of the tangent stiffness, without the curvature of the body and of the bulk's second order, in 16 bits a number."""
    pulled = bulk @ squash[0]
    q = wp.sqrt(wp.max(wp.dot(pulled, bulk), 0.0) + 1e-18)
    direction = pulled * (1.0 / q)
    y = wp.min(numbers[wp.static(place.STIFFENING + 1)] * q * q, MOST_GROWTH)
    scale = numbers[wp.static(place.STIFFENING)] * q * wp.exp(y)
    per_size = scale * (3.0 + 2.0 * y)
    beyond = scale * (6.0 + y * (14.0 + 4.0 * y)) - per_size
    m = rigid[0] @ bulk
    lift = lift_of(numbers, m)
    swept = swept_by(m, 0.5 * numbers[wp.static(place.TURN)])
    stiffness = squash[0] * per_size + wp.outer(direction * beyond, direction)
    for k in range(MODES):
        stiffness[k, k] = stiffness[k, k] + 1.0
    lifts_z = lift_slope(numbers, 0, m) @ rigid[0]
    lifts_x = lift_slope(numbers, 1, m) @ rigid[0]
    for j in range(patches.shape[0]):
        if kept[KEPT * j, i] >= 0.0:
            acting = act(numbers, patches, modes, kept, body, frame, strength_factor, bulk, lift, swept, i, j)
            if acting.touches == 1:
                first = acting.stretch / acting.length
                if acting.length <= 1e-9:
                    raw = wp.vec3(-acting.held_inward[2], 0.0, acting.held_inward[0])
                    first = raw / wp.sqrt(wp.dot(raw, raw) + 1e-12)
                second = wp.cross(acting.held_inward, first)
                # Displacement in a direction of the body's frame per coordinate of the bulk.
                own = modes[j]
                to = wp.transpose(frame.soft) @ acting.inward
                a = to @ own + lifts_x * to[0] + lifts_z * to[2]
                stiffness = stiffness + wp.outer(a * acting.slope, a)
                if acting.length <= acting.bound:
                    to = wp.transpose(frame.soft) @ first
                    a = to @ own + lifts_x * to[0] + lifts_z * to[2]
                    stiffness = stiffness + wp.outer(a * acting.grip, a)
                to = wp.transpose(frame.soft) @ second
                a = to @ own + lifts_x * to[0] + lifts_z * to[2]
                stiffness = stiffness + wp.outer(a * acting.grip, a)
    # L D L' in the lower triangle: ones on the diagonal of L, 1/D in their place. The matrix is at least the unit matrix.
    for r in range(MODES):
        for column in range(r):
            x = stiffness[r, column]
            for k in range(column):
                x = x - stiffness[r, k] * stiffness[column, k]
            stiffness[r, column] = x
        pivot = stiffness[r, r]
        for column in range(r):
            scaled = stiffness[r, column]
            low = scaled * stiffness[column, column]
            pivot = pivot - scaled * low
            stiffness[r, column] = low
        if not (pivot > LEAST_PIVOT):
            pivot = 1.0
        stiffness[r, r] = 1.0 / pivot
    for r in range(MODES):
        for k in range(r + 1):
            stiffness[r, k] = upper_half(stiffness[r, k])
    return stiffness


@wp.func
def with_factor(factor: Square, right: Bulk):
    """Solution with a factor of `factor_of_stiffness`."""
    x = right
    for r in range(MODES):
        sum = x[r]
        for k in range(r):
            sum = sum - factor[r, k] * x[k]
        x[r] = sum
    for r in range(MODES):
        x[r] = x[r] * factor[r, r]
    for back in range(MODES):
        r = MODES - 1 - back
        value = x[r]
        for k in range(r):
            x[k] = x[k] - factor[r, k] * value
    return x


@wp.func
def stored_factor(memory: wp.array2d(dtype=float), i: int):
    out = Square()
    at = int(FACTOR)
    for r in range(MODES):
        for k in range(r + 1):
            out[r, k] = memory[at + k, i]
        at = at + r + 1
    return out


@wp.func
def store_factor(memory: wp.array2d(dtype=float), factor: Square, i: int):
    at = int(FACTOR)
    for r in range(MODES):
        for k in range(r + 1):
            memory[at + k, i] = factor[r, k]
        at = at + r + 1


@wp.func
def solve(
    numbers: wp.array(dtype=float),
    patches: wp.array2d(dtype=float),
    modes: wp.array(dtype=Modes),
    rigid: wp.array(dtype=Rigid),
    squash: wp.array(dtype=Square),
    kept: wp.array2d(dtype=float),
    memory: wp.array2d(dtype=float),
    body: Solid,
    frame: Frame,
    strength_factor: float,
    i: int,
):
    """Brings the bulk to equilibrium by Newton's method; returns whether it is met."""
    bulk = Bulk()
    for k in range(MODES):
        bulk[k] = memory[BULK + k, i]
    gradient = misfit(numbers, patches, modes, rigid, squash, kept, body, frame, strength_factor, bulk, i)
    changes = Pairs()
    moves = Pairs()
    pairs = int(0)
    has_last = bool(False)
    last_step = Bulk()
    last_bulk = Bulk()
    factors = int(0)
    before = float(3.4e38)
    is_met = bool(False)
    best_off = float(3.4e38)
    start_off = float(3.4e38)
    left = int(EFFORT) - 1
    best = bulk
    is_factored = int(memory[FLAGS, i]) & wp.static(FACTORED) != 0
    factor = stored_factor(memory, i)
    for round in range(EFFORT):
        if not is_factored:
            factor = factor_of_stiffness(numbers, patches, modes, rigid, squash, kept, body, frame, strength_factor, bulk, i)
            is_factored = True
            factors = factors + 1
            left = wp.max(left - FACTOR_COST, 0)
            pairs = 0
            has_last = False
        step = with_factor(factor, gradient)
        off = wp.abs(wp.dot(step, gradient))
        size = wp.dot(bulk, bulk) + LEAST_SIZE2
        is_met = off <= MET2 * size
        if round == 0:
            start_off = off
        if off < best_off:
            best_off = off
            best = bulk
        if not (off > TOLERANCE2 * size) or left == 0:
            break
        if off > KEPT2 * before and factors < FACTORS and left > FACTOR_COST and pairs > 0:
            is_factored = False
            before = 3.4e38
        else:
            before = off
            # The way to go by that stiffness, corrected by secants over the last rounds.
            if has_last:
                if pairs == 3:
                    pairs = 0
                change = step - last_step
                moved = bulk - last_bulk
                whole = wp.dot(change, change)
                for p in range(pairs):
                    old = changes[p]
                    share = wp.dot(old, change)
                    change = change - old * share
                    moved = moved - moves[p] * share
                beside = wp.dot(change, change)
                if beside > 1e-4 * whole:
                    one = 1.0 / wp.sqrt(beside)
                    changes[pairs] = change * one
                    moves[pairs] = moved * one
                    pairs = pairs + 1
            last_step = step
            last_bulk = bulk
            has_last = True
            way = step
            for p in range(pairs):
                old = changes[p]
                share = wp.dot(old, step)
                way = way - (old - moves[p]) * share
            # No round goes farther than from a finger in the air to a deep press.
            long = wp.dot(way, way)
            longest = size + LONGEST2
            if long > longest:
                way = way * wp.sqrt(longest / long)
            start = bulk
            for _halving in range(HALVINGS):
                bulk = start - way
                gradient = misfit(numbers, patches, modes, rigid, squash, kept, body, frame, strength_factor, bulk, i)
                left = wp.max(left - 1, 0)
                # Not far beyond the least energy along this direction.
                if left == 0 or not (wp.dot(step, gradient) < -0.5 * off):
                    break
                way = way * 0.5
    if not is_met:
        if best_off < BETTER2 * start_off:
            bulk = best
        is_factored = False
    flags = int(wp.static(IN_CONTACT))
    if is_factored:
        flags = flags | wp.static(FACTORED)
        if factors > 0:
            store_factor(memory, factor, i)
    memory[FLAGS, i] = float(flags)
    for k in range(MODES):
        memory[BULK + k, i] = bulk[k]
    return is_met


@wp.func
def stored_bulk(memory: wp.array2d(dtype=float), i: int):
    bulk = Bulk()
    for k in range(MODES):
        bulk[k] = memory[BULK + k, i]
    return bulk


@wp.func
def wake(
    numbers: wp.array(dtype=float),
    patches: wp.array2d(dtype=float),
    modes: wp.array(dtype=Modes),
    kept: wp.array2d(dtype=float),
    memory: wp.array2d(dtype=float),
    body: Solid,
    frame: Frame,
    near: float,
    i: int,
):
    """Finds the patches that are to be looked at, and what of them does not change within a step."""
    count = patches.shape[0]
    bulk = stored_bulk(memory, i)
    for j in range(count):
        reserve = memory[PATCHES + 2 * count + j, i]
        if not (reserve <= near):
            kept[KEPT * j, i] = -1.0
        else:
            at = placed(patches, frame, j)
            variance = float(0.0)
            if body.kind == 0:
                a = wp.transpose(root_of_spread(patches, j)) @ wp.vec3(frame.axes[2, 0], frame.axes[2, 1], frame.axes[2, 2])
                variance = wp.dot(a, a)
            else:
                spreads = spread_of(body, at, sides_of(patches, frame, j))
                variance = spreads.variance
            spread = wp.sqrt(variance + LEAST_SPREAD_MM2)
            kept[KEPT * j, i] = spread
            kept[KEPT * j + 1, i] = full_strength(patches, numbers, j, spread)
            anchor = wp.vec2(memory[PATCHES + 2 * j, i], memory[PATCHES + 2 * j + 1, i])
            if reserve >= APART:
                # Where it is with the bulk as it was: apart it may be held anywhere.
                anchor = foot(body, at + frame.soft @ modes[j] @ bulk)
            kept[KEPT * j + 2, i] = anchor[0]
            kept[KEPT * j + 3, i] = anchor[1]


@wp.func
def moved_mm(numbers: wp.array(dtype=float), start: Bulk, end: Bulk):
    """Bound of the way of any patch between two states of the bulk, mm."""
    way = end - start
    return 1.5 * numbers[wp.static(place.REACH)] * wp.sqrt(wp.dot(way, way))


@wp.func
def may_touch(kept: wp.array2d(dtype=float), memory: wp.array2d(dtype=float), count: int, near: float, i: int):
    """Whether a patch that is not looked at may touch."""
    found = bool(False)
    for j in range(count):
        if kept[KEPT * j, i] < 0.0 and not (memory[PATCHES + 2 * count + j, i] > near):
            found = True
    return found


@wp.func
def slipping_part(acting: Acting, x: float, y: float, contact_share: float, onset: float):
    """Slipping share of a patch whose reserve falls, by the way of its stretch since its last turn at (x, y), mm; (0, 0) without one."""
    way = acting.length
    whole = acting.bound
    if x != 0.0 or y != 0.0:
        along_x = acting.stretch[0] - x
        along_y = acting.stretch[1] - y
        way = wp.sqrt(along_x * along_x + along_y * along_y + TINY)
        outward = (x * along_x + y * along_y) / way
        square = outward * outward + acting.bound * acting.bound - (x * x + y * y)
        whole = wp.sqrt(wp.max(square, 0.0)) - outward
    share = wp.min(way / (wp.max(whole, 0.0) + TINY), 1.0)
    exponent = WHOLE * onset / wp.sqrt(contact_share + TINY)
    return wp.exp(exponent * wp.log(share + TINY))


@wp.func
def parabola(numbers: wp.array(dtype=float), at: int, x: float):
    return numbers[at] + x * (numbers[at + 1] + x * numbers[at + 2])


@wp.func
def band(numbers: wp.array(dtype=float), at: int, away: float, stick: float):
    return parabola(numbers, at, stick) + parabola(numbers, at + 3, stick) * away


@wp.func
def forget_pad(memory: wp.array2d(dtype=float), count: int, strength: float, i: int):
    for row in range(PATCHES + PER_PATCH * count):
        memory[row, i] = 0.0
    memory[STRENGTH, i] = strength


@wp.func
def usual(x: float):
    """An increment cut to what a step may be; 0 for one that is not finite."""
    return _bed.bounded(x, LONGEST_STEP)


@wp.func
def usual_flags(x: float):
    flags = int(0)
    if not (wp.abs(x) <= LONGEST_STEP):
        flags = wp.static(int(Status.LARGE_INCREMENT))
        if not wp.isfinite(x):
            flags = wp.static(int(Status.BAD_INPUT))
    return flags


@wp.kernel
def step_pad(
    numbers: wp.array(dtype=float),
    patches: wp.array2d(dtype=float),
    modes: wp.array(dtype=Modes),
    rigid: wp.array(dtype=Rigid),
    squash: wp.array(dtype=Square),
    bodies: wp.array(dtype=Solid),
    depth_mm: wp.array(dtype=float),
    slide_x_mm: wp.array(dtype=float),
    slide_y_mm: wp.array(dtype=float),
    spin_rad: wp.array(dtype=float),
    strength_factor: wp.array(dtype=float),
    pitch_deg: wp.array(dtype=float),
    roll_deg: wp.array(dtype=float),
    dt_s: float,
    kept: wp.array2d(dtype=float),
    memory: wp.array2d(dtype=float),
    response: wp.array2d(dtype=float),
    regime: wp.array(dtype=int),
    status: wp.array(dtype=int),
):
    i = wp.tid()
    # One body a contact, or one for all.
    body = bodies[i % bodies.shape[0]]
    count = patches.shape[0]
    flags = int(0)
    strength = memory[STRENGTH, i]
    if strength_factor.shape[0] > 0:
        strength = _bed.clamped_strength(strength_factor[i], strength)
    if not (strength >= 0.1 and strength <= 5.0):
        forget_pad(memory, count, _bed.clamped_strength(strength, 1.0), i)
        _bed.answer_in_the_air(response, regime, status, wp.static(int(Status.MEMORY_LOST)), i)
        return
    memory[STRENGTH, i] = strength

    # ---- body and pose ----
    if not (dt_s >= TINY and dt_s <= LARGEST):
        flags = flags | wp.static(int(Status.BAD_TIME_STEP))
    depth_before = memory[DEPTH, i]
    pitch_before = memory[TILT, i]
    roll_before = memory[TILT + 1, i]
    depth = depth_before
    depth_max = numbers[wp.static(place.DEPTH_MAX)]
    if wp.abs(depth_mm[i]) <= LARGEST:
        depth = wp.min(depth_mm[i], 2.0 * depth_max)
    else:
        flags = flags | wp.static(int(Status.BAD_INPUT))
    if depth > depth_max:
        flags = flags | wp.static(int(Status.DEPTH_ABOVE_RANGE))
    pitch = pitch_before
    roll = roll_before
    if wp.isfinite(pitch_deg[i]) and wp.isfinite(roll_deg[i]):
        roll_max = numbers[wp.static(place.ROLL_MAX)]
        pitch_held = wp.clamp(pitch_deg[i], numbers[wp.static(place.PITCH_RANGE)], numbers[wp.static(place.PITCH_RANGE + 1)])
        roll_held = wp.clamp(roll_deg[i], -roll_max, roll_max)
        if pitch_held != pitch_deg[i] or roll_held != roll_deg[i]:
            flags = flags | wp.static(int(Status.POSE_OUT_OF_RANGE))
        pitch = (pitch_held - numbers[wp.static(place.NEUTRAL_PITCH)]) * RAD
        roll = roll_held * RAD
    else:
        flags = flags | wp.static(int(Status.BAD_INPUT))
    memory[DEPTH, i] = depth
    memory[TILT, i] = pitch
    memory[TILT + 1, i] = roll
    raw_spin = float(0.0)
    if spin_rad.shape[0] > 0:
        raw_spin = spin_rad[i]
    flags = flags | usual_flags(slide_x_mm[i]) | usual_flags(slide_y_mm[i]) | usual_flags(raw_spin)
    slide_x = usual(slide_x_mm[i])
    slide_y = usual(slide_y_mm[i])
    spin = usual(raw_spin)
    if slide_x != 0.0 or slide_y != 0.0 or spin != 0.0:
        x = memory[SHIFT, i]
        y = memory[SHIFT + 2, i]
        way_x = slide_x
        way_y = slide_y
        # A curved body turns about its apex, a plane about the foot.
        if spin != 0.0 and body.kind == 0:
            sin = wp.sin(spin)
            half_sin = wp.sin(0.5 * spin)
            half_cos = wp.cos(0.5 * spin)
            less = 2.0 * half_sin * half_sin
            way_x = half_cos * slide_x - half_sin * slide_y - less * x - sin * y
            way_y = half_sin * slide_x + half_cos * slide_y + sin * x - less * y
        to_x = _bed.two_sum(x, memory[SHIFT + 1, i], way_x)
        to_y = _bed.two_sum(y, memory[SHIFT + 3, i], way_y)
        to = _bed.two_sum(memory[ANGLE, i], memory[ANGLE + 1, i], spin)
        angle = to[0]
        angle_low = to[1]
        if angle > wp.static(float(np.float32(np.pi))):
            angle = angle - wp.static(float(np.float32(2 * np.pi)))
            angle_low = angle_low + 1.7484556e-7
        elif angle < wp.static(-float(np.float32(np.pi))):
            angle = angle + wp.static(float(np.float32(2 * np.pi)))
            angle_low = angle_low - 1.7484556e-7
        memory[SHIFT, i] = to_x[0]
        memory[SHIFT + 1, i] = to_x[1]
        memory[SHIFT + 2, i] = to_y[0]
        memory[SHIFT + 3, i] = to_y[1]
        memory[ANGLE, i] = angle
        memory[ANGLE + 1, i] = angle_low
        if body.kind == 0 and (wp.abs(to_x[0]) > FAR_MM or wp.abs(to_y[0]) > FAR_MM):
            # The origin of a plane is put where the finger is.
            turned_sin = wp.sin(angle)
            turned_cos = wp.cos(angle)
            for j in range(count):
                memory[PATCHES + 2 * j, i] = memory[PATCHES + 2 * j, i] + (turned_cos * to_x[0] + turned_sin * to_y[0])
                memory[PATCHES + 2 * j + 1, i] = memory[PATCHES + 2 * j + 1, i] + (turned_cos * to_y[0] - turned_sin * to_x[0])
            for k in range(4):
                memory[SHIFT + k, i] = 0.0
    turned = wp.abs(pitch - pitch_before) + wp.abs(roll - roll_before)
    travel = wp.abs(depth - depth_before) + turned * ARM_MM
    if body.kind != 0:
        travel = travel + wp.abs(slide_x) + wp.abs(slide_y) + wp.abs(spin) * ARM_MM
    if not (depth >= TOUCH_MM):
        memory[FLAGS, i] = 0.0
        _bed.answer_in_the_air(response, regime, status, flags, i)
        return
    frame = frame_of(numbers, patches, memory, body, i)
    travel = travel + wp.abs(frame.shift - memory[APPROACH, i])
    memory[APPROACH, i] = frame.shift
    if int(memory[FLAGS, i]) & wp.static(IN_CONTACT) == 0:
        memory[FLAGS, i] = float(wp.static(IN_CONTACT))
        for k in range(MODES):
            memory[BULK + k, i] = 0.0
            memory[DRIFT + k, i] = 0.0
        for j in range(count):
            beside = foot(body, placed(patches, frame, j))
            memory[PATCHES + 2 * j, i] = beside[0]
            memory[PATCHES + 2 * j + 1, i] = beside[1]
            memory[PATCHES + 2 * count + j, i] = APART
    # Near first touch the normal force is the patches' times the rate of approach.
    strength_now = strength * frame.rate

    # ---- equilibrium, from where the bulk would be if it went on as before ----
    start = stored_bulk(memory, i)
    motion = Vec6(depth - depth_before, slide_x, slide_y, spin, pitch - pitch_before, roll - roll_before)
    both = float(0.0)
    whole = float(0.0)
    for k in range(6):
        weight = float(1.0)
        if k >= 3:
            weight = TURN_MM * TURN_MM
        last = memory[MOTION + k, i]
        both = both + weight * motion[k] * last
        whole = whole + weight * last * last
        memory[MOTION + k, i] = motion[k]
    share = both / (whole + TINY)
    if share >= 0.5 and share <= 1.5:
        for k in range(MODES):
            memory[BULK + k, i] = memory[BULK + k, i] + share * memory[DRIFT + k, i]
    near = APART + WAKE_MM + travel
    is_met = bool(False)
    end = start
    for _attempt in range(2):
        wake(numbers, patches, modes, kept, memory, body, frame, near, i)
        is_met = solve(numbers, patches, modes, rigid, squash, kept, memory, body, frame, strength_now, i)
        end = stored_bulk(memory, i)
        moved = moved_mm(numbers, start, end)
        if not (moved > WAKE_MM and may_touch(kept, memory, count, APART + travel + moved, i)):
            break
        # A patch that was taken to be far.
        near = LARGEST
    for k in range(MODES):
        memory[DRIFT + k, i] = end[k] - start[k]
    travel = travel + moved_mm(numbers, start, end)

    # ---- what slips or is apart moves; what all bear together ----
    m = rigid[0] @ end
    lift = lift_of(numbers, m)
    swept = swept_by(m, 0.5 * numbers[wp.static(place.TURN)])
    force = wp.vec3(0.0, 0.0, 0.0)
    moment = wp.vec3(0.0, 0.0, 0.0)
    friction = wp.vec3(0.0, 0.0, 0.0)
    friction_spin = float(0.0)
    middle = wp.vec3(0.0, 0.0, 0.0)
    turning = wp.vec3(0.0, 0.0, 0.0)
    area = float(0.0)
    stuck = float(0.0)
    limit = float(0.0)
    reach = float(0.0)
    apex = wp.vec3(frame.apex[0], frame.apex[1], 0.0)
    onset = numbers[wp.static(place.ONSET)]
    # The bulk's softness stays along the body's axes when the body turns: along over across the normal.
    soft = numbers[wp.static(place.SOFTNESS + 1)] / numbers[wp.static(place.SOFTNESS)]
    for j in range(count):
        reserve = memory[PATCHES + 2 * count + j, i]
        spread = kept[KEPT * j, i]
        if spread < 0.0:
            memory[PATCHES + 2 * count + j, i] = reserve - travel
        else:
            acting = act(numbers, patches, modes, kept, body, frame, strength_now, end, lift, swept, i, j)
            anchor = wp.vec2(memory[PATCHES + 2 * j, i], memory[PATCHES + 2 * j + 1, i])
            turn_x = memory[PATCHES + 3 * count + 2 * j, i]
            turn_y = memory[PATCHES + 3 * count + 2 * j + 1, i]
            if acting.touches == 0:
                anchor = foot(body, acting.place)
                reserve = APART - (acting.overlap + spread)
            else:
                now = wp.min(wp.max(acting.bound - acting.length, 0.0), MOST_RESERVE_MM)
                if reserve >= APART:
                    anchor = wp.vec2(kept[KEPT * j + 2, i], kept[KEPT * j + 3, i])
                    reserve = now
                    turn_x = 0.0
                    turn_y = 0.0
                slips = acting.length > acting.bound * SLIPS_SHARE + SLIPS_MM
                if slips:
                    anchor = foot(body, acting.place + acting.stretch * (acting.bound / acting.length))
                # A rise of the reserve is a turn. Then nothing slips until the reserve falls.
                extreme = wp.abs(reserve)
                fell = reserve >= 0.0
                beyond = extreme - now
                if fell:
                    beyond = now - extreme
                dead_band = NOTICED * acting.bound + NOTICED_LENGTH * numbers[wp.static(place.DEPTH_MAX)]
                at_bound = now <= dead_band
                falls = at_bound or fell != (beyond > dead_band)
                if at_bound:
                    turn_x = 0.0
                    turn_y = 0.0
                elif fell and not falls:
                    turn_x = acting.stretch[0]
                    turn_y = acting.stretch[1]
                # Within the dead band the extreme value of this fall or rise remains.
                if falls == fell and beyond > 0.0:
                    now = extreme
                reserve = -now
                if falls:
                    reserve = now
                contact_share = wp.exp(numbers[wp.static(place.AREA + 2)] * acting.below)
                touching = numbers[wp.static(place.AREA)] * patches[j, wp.static(place.PATCH_AREA)] * contact_share
                area = area + touching
                if not falls:
                    stuck = stuck + touching
                elif not slips:
                    stuck = stuck + touching * (1.0 - slipping_part(acting, turn_x, turn_y, contact_share, onset))
                flat = flat_force(patches, numbers, j, spread)
                limit = limit + acting.strength
                traction = acting.stretch * acting.grip
                on_skin = traction - acting.inward * acting.force
                arm = acting.place + apex
                friction = friction + traction
                friction_spin = friction_spin + (arm[0] * traction[1] - arm[1] * traction[0])
                force = force + on_skin
                rest = placed(patches, frame, j)
                carried = acting.place - rest
                tilting = wp.cross(rest + apex, on_skin)
                softly = wp.cross(wp.vec3(soft * carried[0], soft * carried[1], carried[2] / soft), on_skin)
                spinning = arm[0] * on_skin[1] - arm[1] * on_skin[0]
                moment = moment + wp.vec3(tilting[0] + softly[0], tilting[1] + softly[1], spinning)
                middle = middle + arm * acting.strength
                reach = reach + acting.strength * (arm[0] * arm[0] + arm[1] * arm[1])
                # The spread of the gaps within the patch changes as the body turns against it.
                compliance = patches[j, wp.static(place.COMPLIANCE)]
                rate = flat_rate(patches, numbers, j)
                by_spread = float(0.0)
                if acting.force >= flat:
                    by_spread = 0.4 * flat + 0.4 * spread * rate
                else:
                    square = (acting.overlap + spread - compliance * acting.force) / spread
                    by_spread = acting.force * (1.0 - 0.6 * square) + 0.4 * spread * acting.force * square / flat * rate
                pull = by_spread / spread
                if body.kind == 0:
                    low = root_of_spread(patches, j)
                    normal_axis = wp.vec3(frame.axes[2, 0], frame.axes[2, 1], frame.axes[2, 2])
                    turning = turning + low @ (wp.transpose(low) @ normal_axis) * pull
                else:
                    sides = sides_of(patches, frame, j)
                    undeformed = spread_of(body, rest, sides)
                    couple = spread_of(body, acting.place, sides)
                    pulled = undeformed.variance_slope * (-pull)
                    force = force + pulled
                    moment = moment + wp.cross(rest + apex, pulled)
                    moment = moment - (undeformed.variance_moment * pull + couple.moment * acting.force)
            memory[PATCHES + 2 * j, i] = anchor[0]
            memory[PATCHES + 2 * j + 1, i] = anchor[1]
            memory[PATCHES + 2 * count + j, i] = reserve
            memory[PATCHES + 3 * count + 2 * j, i] = turn_x
            memory[PATCHES + 3 * count + 2 * j + 1, i] = turn_y
        if not is_met:
            # The next step may move the skin anywhere.
            memory[PATCHES + 2 * count + j, i] = wp.min(memory[PATCHES + 2 * count + j, i], APART)
    turning = frame.axes @ turning
    lever = frame.axes @ frame.arm
    about_x = lever[1] * force[2] - frame.shift * force[1] - turning[1]
    about_y = frame.shift * force[0] - lever[0] * force[2] + turning[0]
    moment = moment + wp.vec3(about_x, about_y, 0.0)
    force = wp.vec3(force[0], force[1], force[2] * frame.rate)
    # Back from the body's axes to those of the plane.
    sin_back = wp.sin(memory[ANGLE, i])
    cos_back = wp.cos(memory[ANGLE, i])
    back = wp.mat33(cos_back, -sin_back, 0.0, sin_back, cos_back, 0.0, 0.0, 0.0, 1.0)
    force = back @ force
    moment = back @ moment
    friction = back @ friction
    normal = force[2]
    borne = wp.abs(normal) + wp.abs(force[0]) + wp.abs(force[1]) + wp.abs(moment[2])
    if not (borne <= LARGEST):
        forget_pad(memory, count, strength, i)
        _bed.answer_in_the_air(response, regime, status, flags | wp.static(int(Status.MEMORY_LOST)), i)
        return
    some = limit + TINY
    middle = back @ (middle * (1.0 / some))
    mean_arm = wp.sqrt(wp.max(reach / some - (middle[0] * middle[0] + middle[1] * middle[1]), 0.0) + LEAST_ARM2)
    about_middle = friction_spin - (middle[0] * friction[1] - middle[1] * friction[0])
    friction_share = wp.length(friction) / some
    turning_share = about_middle / (some * mean_arm + 1e-12)
    stick = float(0.0)
    if area > 0.0:
        stick = stuck / area
    margin = float(0.0)
    centre_x = float(0.0)
    centre_y = float(0.0)
    sort = int(wp.static(int(Regime.NO_CONTACT)))
    if normal > 0.0:
        centre_x = -moment[1] / normal
        centre_y = moment[0] / normal
    if area > 0.0:
        margin = wp.max(1.0 - wp.sqrt(friction_share * friction_share + turning_share * turning_share), 0.0)
        sort = wp.static(int(Regime.PARTIAL_SLIP))
        if stick >= STICKS:
            sort = wp.static(int(Regime.STICK))
        elif stick <= SLIPS:
            sort = wp.static(int(Regime.SLIP))
    if not is_met:
        flags = flags | wp.static(int(Status.NOT_CONVERGED))
    response[wp.static(_bed.NORMAL_N), i] = normal
    response[wp.static(_bed.FRICTION_X), i] = force[0]
    response[wp.static(_bed.FRICTION_Y), i] = force[1]
    response[wp.static(_bed.MOMENT), i] = moment[2]
    response[wp.static(_bed.MARGIN), i] = margin
    response[wp.static(_bed.STICK), i] = stick
    response[wp.static(_bed.LIMIT_N), i] = limit
    response[wp.static(_bed.AREA_MM2), i] = area
    response[wp.static(_bed.TANGENTIAL_X), i] = friction[0]
    response[wp.static(_bed.TANGENTIAL_Y), i] = friction[1]
    response[wp.static(_bed.TILT_X), i] = moment[0]
    response[wp.static(_bed.TILT_Y), i] = moment[1]
    response[wp.static(_bed.CENTRE_X), i] = centre_x
    response[wp.static(_bed.CENTRE_Y), i] = centre_y
    band_normal = float(0.0)
    band_friction = float(0.0)
    if area > 0.0:
        turned2 = pitch * pitch + roll * roll
        away = turned2 / (turned2 + AWAY_RAD2)
        steep = steepness(body)
        deep = wp.max(depth - DEEP_MM, 0.0)
        b = wp.static(place.BAND_BODY)
        d = wp.static(place.BAND_DEEP)
        light = wp.static(place.BAND_LIGHT)
        of_normal = band(numbers, wp.static(place.BAND_NORMAL), away, stick) + steep * numbers[b] + deep * numbers[d]
        of_limit = band(numbers, wp.static(place.BAND_FRICTION), away, stick) + steep * numbers[b + 1] + deep * numbers[d + 1]
        band_normal = wp.max(wp.max(normal, 0.0) * of_normal + numbers[light] + away * numbers[light + 2], 0.0)
        band_friction = wp.max(limit * of_limit + numbers[light + 1] + away * numbers[light + 3], 0.0)
    response[wp.static(_bed.BAND_N), i] = band_normal
    response[wp.static(_bed.BAND_F), i] = band_friction
    regime[i] = sort
    status[i] = flags


# ---- from Python ----


def poses(pad: Pad, pitch_deg: Any, roll_deg: Any, count: int) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """The poses in which fingers are made, one a finger; refused beyond the pad's range."""
    given = {
        "pitch_deg": (pad.neutral_pitch_deg if pitch_deg is None else pitch_deg, pad.pitch_range_deg),
        "roll_deg": (0.0 if roll_deg is None else roll_deg, pad.roll_range_deg),
    }
    out = []
    for name, (value, (least, most)) in given.items():
        array = _arrays.numbers(name, value, (count,))
        outside = array[~((array >= least) & (array <= most))]
        if outside.size:
            raise InputError(f"{name}: {outside[0]:g} is not between {least:g} and {most:g}")
        out.append(array)
    return out[0], out[1]


class Engine:
    """The kernel and the numbers of a pad on a device, and the bodies that it touches."""

    def __init__(self, pad: Pad, body: Any, poses_deg: tuple[Any, Any], count: int, device: Any, bodies: Any = None) -> None:
        """bodies: a Warp array of `Solid`, one a contact, that another kernel writes, in place of one body for all."""
        self.pad, self.rows = pad, PATCHES + PER_PATCH * len(pad.patches)
        self.body = Plane() if body is None else body
        kind, numbers = body_numbers(self.body)
        least_mm = pad.least_radii_mm.get(type(self.body), -np.inf)
        if 0 < numbers[0] < least_mm:
            raise InputError(f"body: {self.body} is too sharp for the patches of the pad, which see {least_mm:.3g} mm and more")
        solid = Solid()
        solid.kind = kind
        for name, value in zip(("radius", "axis_cos", "axis_sin", "face_cos", "face_sin"), numbers, strict=True):
            setattr(solid, name, float(value))
        self.bodies = wp.array([solid], dtype=Solid, device=device) if bodies is None else bodies
        modes = pad.patches[:, place.PATCH_MODES : place.COMPLIANCE].reshape(-1, 3, MODES)
        rigid = pad.numbers[place.RIGID : place.SQUASH].reshape(1, 6, MODES)
        lower = np.zeros((MODES, MODES), np.float32)
        lower[np.tril_indices(MODES)] = pad.numbers[place.SQUASH : place.REACH]
        squash = lower + np.tril(lower, -1).T
        self.tables = [wp.array(each, dtype=float, device=device) for each in (pad.numbers, pad.patches)]
        self.tables.append(wp.array(np.ascontiguousarray(modes), dtype=Modes, device=device))
        self.tables.append(wp.array(rigid, dtype=Rigid, device=device))
        self.tables.append(wp.array(squash[None], dtype=Square, device=device))
        self.kept = _arrays.table(KEPT * len(pad.patches), count, device)
        self._poses_deg = poses_deg

    def fresh(self, count: int) -> np.ndarray[Any, Any]:
        """The memory of fingers in the air; the apex of a curved body lies under first touch in their poses."""
        memory = np.zeros((self.rows, count), np.float32)
        pitch, roll = self._poses_deg
        memory[STRENGTH] = 1
        # On a plane every pose turns about the origin, as in the core's bindings.
        if isinstance(self.body, Plane):
            return memory
        memory[TILT] = (pitch - np.float32(self.pad.neutral_pitch_deg)) * np.float32(np.pi / 180)
        memory[TILT + 1] = roll * np.float32(np.pi / 180)
        # In the neutral pose it is the origin, which the fitted heights meet within their error.
        tilted = (memory[TILT] != 0) | (memory[TILT + 1] != 0)
        memory[PIVOT : PIVOT + 3] = np.where(tilted, self.pad.first_touch_point_mm(pitch, roll), 0)
        return memory

    def launch(self, motion: dict[str, Any], dt_s: float, before: Any, after: Any, response: Any, device: Any) -> None:
        """Steps in place: `after` is `before`."""
        names = ("depth_mm", "slide_x_mm", "slide_y_mm", "spin_rad", "strength_factor", "pitch_deg", "roll_deg")
        wp.launch(
            step_pad,
            dim=before.shape[1],
            inputs=[*self.tables, self.bodies, *(motion[name] for name in names), dt_s, self.kept],
            outputs=[after, response.values, response.regime, response.status],
            device=device,
        )
