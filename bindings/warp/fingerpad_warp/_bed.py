"""One step of a bed of springs, as a Warp kernel with one thread a contact.

Main function: `step_kernel`. The formulas and the order of their operations are those of the core (`core/src/step.rs`, `plane.rs`,
`spring.rs`, `springs.rs`, `stick_ratio.rs`): multiplications and additions are not fused, so that the results are the same numbers.

The kernel reads the memory of a contact from one array and writes it to another, which Warp's adjoint needs.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import warp as wp

from fingerpad_warp import _model as place
from fingerpad_warp._model import NODES, SPRINGS
from fingerpad_warp._status import Regime, Status

#: Rows of the response.
OUTPUTS = (
    "normal_force_n", "friction_x_n", "friction_y_n", "spin_moment_n_mm", "slip_margin", "stick_ratio", "friction_limit_n",
    "contact_area_mm2", "pressure_centre_x_mm", "pressure_centre_y_mm", "band_normal_n", "band_friction_n",
    "tangential_friction_x_n", "tangential_friction_y_n", "tilt_moment_x_n_mm", "tilt_moment_y_n_mm",
)  # fmt: skip
NORMAL_N, FRICTION_X, FRICTION_Y, MOMENT, MARGIN, STICK, LIMIT_N, AREA_MM2, CENTRE_X, CENTRE_Y, BAND_N, BAND_F = range(12)
TANGENTIAL_X, TANGENTIAL_Y, TILT_X, TILT_Y = range(12, 16)


def memory_rows(pairs: int) -> int:
    """Rows of the memory of a contact: anchors, then what `AFTER_ANCHORS` names."""
    return 2 * SPRINGS * pairs + 19


#: Rows behind the anchors: position x, y and their low parts, angle and its low part, last turn, last place noted, turn before the
#: growth (three each), friction limit at the place noted and before the growth, depth, strength factor.
AFTER_ANCHORS = {"position": 0, "angle": 4, "turn": 6, "reached": 9, "turn_before": 12, "limit_reached": 15, "limit_before": 16}
DEPTH, STRENGTH = 17, 18

# Depth below which there is no contact, mm; deepest depth and longest time, mm and s; least normal number.
TOUCH_MM = wp.constant(wp.float32(1.0 / (1 << 20)))
LARGEST = wp.constant(wp.float32(1e9))
TINY = wp.constant(wp.float32(1.17549435e-38))
# Longest slide, mm, and largest angle, rad, of one step.
SLIDE_MAX_MM = wp.constant(wp.float32(64.0))
SPIN_MAX_RAD = wp.constant(wp.float32(8.0))
LEAST_STRENGTH = wp.constant(wp.float32(0.1))
MOST_STRENGTH = wp.constant(wp.float32(5.0))
# A square that is added to others, so that quotients of the two are numbers.
NOTHING = wp.constant(wp.float32(1e-26))
# Slack of a spring's limit: share of the square, and twice a length, mm.
WITHIN = wp.constant(wp.float32(1.0 - 1.0 / (1 << 20)))
SLACK_MM = wp.constant(wp.float32(8e-6))
# Slide that is taken note of, mm; change of depth likewise; see `stick_ratio.rs` for the others.
NOTICED_MM = wp.constant(wp.float32(0.029))
NOTICED_DEPTH_MM = wp.constant(wp.float32(0.025))
GROWTH = wp.constant(wp.float32(0.8))
SAME = wp.constant(wp.float32(1.01))
REMEMBERED = wp.constant(wp.float32(1.1))
LEFT = wp.constant(wp.float32(0.03))
# Makes the square of a way of more than 1e9 mm larger than any number.
ENDLESS = wp.constant(wp.float32(1e20))

LAST = wp.constant(wp.float32(NODES - 1))


@wp.func
def root(x: float):
    """Square root of the magnitude, whose derivative at 0 is taken as 0: what is 0 there is not moved by a small motion."""
    return wp.sqrt(wp.abs(x))


@wp.func_grad(root)
def adj_root(x: float, adj_ret: float):
    r = wp.sqrt(wp.abs(x))
    if r > 0.0:
        wp.adjoint[x] += wp.sign(x) * 0.5 * adj_ret / r


@wp.func
def line(rows: wp.array2d(dtype=float), i: int, at: int, t: float):
    return rows[i, at] + rows[i, at + 1] * t


@wp.func
def parabola(rows: wp.array2d(dtype=float), i: int, at: int, t: float):
    return rows[i, at] + t * (rows[i, at + 1] + t * rows[i, at + 2])


@wp.func
def slope(rows: wp.array2d(dtype=float), i: int, at: int, t: float):
    """Slope of a parabola, per cell."""
    return rows[i, at + 1] + (t + t) * rows[i, at + 2]


@wp.func
def two_sum(high: float, low: float, increment: float):
    """Adds an increment to a number in two parts (Knuth)."""
    by = increment + low
    to = high + by
    part = to - high
    return wp.vec2(to, (high - (to - part)) + (by - part))


@wp.func
def bounded(x: float, most: float):
    """A number cut to a range; 0 for one that is not finite."""
    to = x
    if not wp.isfinite(x):
        to = 0.0
    elif x < -most:
        to = -most
    elif x > most:
        to = most
    return to


@wp.func
def clamped_strength(factor: float, before: float):
    """The strength factor in use once `factor` is set: NaN changes nothing."""
    to = before
    if factor < LEAST_STRENGTH:
        to = LEAST_STRENGTH
    elif factor > MOST_STRENGTH:
        to = MOST_STRENGTH
    elif factor == factor:
        to = factor
    return to


@wp.func
def product(a: wp.vec3, b: wp.vec3, gyration: float):
    """Scalar product of two ways, mm²."""
    return (a[0] * b[0] + a[1] * b[1]) + gyration * gyration * (a[2] * b[2])


@wp.func
def outweighs(grown: float, square: float, stiffness: float):
    """Whether a change of the limit, N, is more than what friction changes by along a way of this square, mm²."""
    return grown * grown > square * stiffness * stiffness


@wp.func
def share_to_full_slip(way: wp.vec3, limit: float, stiffness: float):
    """Share of a way that leads to full slip, at most 1."""
    full = limit / stiffness
    return root(wp.min(full * full / (way[0] * way[0] + way[1] * way[1] + NOTHING), 1.0))


@wp.func
def turned_back(
    reached: wp.vec3, moved: wp.vec3, way: wp.vec3, square: float, ahead: float, limit: float, stiffness: float, gyration: float
):
    """Place of the turn of a contact that is moved back, straight or at an obtuse angle to its way."""
    back = ahead / square
    cosine = root(ahead * back / (product(way, way, gyration) + NOTHING))
    left = (1.0 - cosine) * share_to_full_slip(way, limit, stiffness)
    across = wp.vec3(way[0] - back * moved[0], way[1] - back * moved[1], way[2] - back * moved[2])
    return wp.vec3(reached[0] - left * across[0], reached[1] - left * across[1], reached[2] - left * across[2])


@wp.func
def share_of_way(square: float, ahead: float, over: float):
    """The way of a spring since the last turn over that from there to its limit."""
    r = root(ahead * ahead - square * over)
    return square / (square + NOTHING + (r - ahead))


@wp.func
def slipping_share(
    way_x: float, way_y: float, ux: float, w: float, over: float, radius: float, shift: float, anisotropy: float, sharpness: float
):
    """Share of a spring's area that slips, after a way since the motion last turned back."""
    wy = way_y * anisotropy
    ahead = way_x * ux + wy * w - shift * way_x * radius
    p = share_of_way(way_x * way_x + wy * wy, ahead, over)
    square = p * p
    return square - square * (sharpness * (1.0 - square))


@wp.func
def forget(memory_out: wp.array2d(dtype=float), rows: int, strength: float, i: int):
    """The memory of a finger in the air."""
    for row in range(rows - 1):
        memory_out[row, i] = 0.0
    memory_out[rows - 1, i] = strength


@wp.func
def answer_in_the_air(
    response: wp.array2d(dtype=float), regime: wp.array(dtype=int), status: wp.array(dtype=int), flags: int, i: int
):
    for row in range(wp.static(len(OUTPUTS))):
        response[row, i] = 0.0
    regime[i] = wp.static(int(Regime.NO_CONTACT))
    status[i] = flags


@cache
def step_kernel(pairs: int, backward: bool = True) -> Any:
    """The kernel of a step: `pairs` is 1 for contacts that slide, 2 for contacts that also spin, whose springs are pairs."""
    anchors = 2 * SPRINGS * pairs
    count = memory_rows(pairs)
    share = 1.0 / pairs

    @wp.kernel(module="unique", module_options={"fuse_fp": False}, enable_backward=backward)
    def step_bed(
        head: wp.array(dtype=float),
        springs: wp.array2d(dtype=float),
        rows: wp.array2d(dtype=float),
        depth_mm: wp.array(dtype=float),
        slide_x_mm: wp.array(dtype=float),
        slide_y_mm: wp.array(dtype=float),
        spin_rad: wp.array(dtype=float),
        strength_factor: wp.array(dtype=float),
        dt_s: float,
        memory_in: wp.array2d(dtype=float),
        memory_out: wp.array2d(dtype=float),
        response: wp.array2d(dtype=float),
        regime: wp.array(dtype=int),
        status: wp.array(dtype=int),
    ):
        i = wp.tid()
        depth = depth_mm[i]
        slide_x = slide_x_mm[i]
        slide_y = slide_y_mm[i]
        spin = float(0.0)
        if spin_rad.shape[0] > 0:
            spin = spin_rad[i]
        strength = memory_in[wp.static(anchors + STRENGTH), i]
        if strength_factor.shape[0] > 0:
            strength = clamped_strength(strength_factor[i], strength)
        flags = int(0)

        # The memory that a step multiplies by must be in its range.
        if not (strength >= LEAST_STRENGTH and strength <= MOST_STRENGTH):
            forget(memory_out, wp.static(count), clamped_strength(strength, 1.0), i)
            answer_in_the_air(response, regime, status, wp.static(int(Status.MEMORY_LOST)), i)
            return
        depth_before = memory_in[wp.static(anchors + DEPTH), i]
        if not (dt_s > 0.0 and wp.isfinite(dt_s)):
            flags = flags | wp.static(int(Status.BAD_TIME_STEP))
        if not wp.isfinite(depth):
            flags = flags | wp.static(int(Status.BAD_INPUT))
            depth = depth_before
        if not (depth >= TOUCH_MM):
            if not (wp.isfinite(slide_x) and wp.isfinite(slide_y) and wp.isfinite(spin)):
                flags = flags | wp.static(int(Status.BAD_INPUT))
            forget(memory_out, wp.static(count), strength, i)
            answer_in_the_air(response, regime, status, flags, i)
            return

        # ---- the tables at this depth ----
        cells = depth * head[wp.static(place.CELLS_PER_MM)]
        c = wp.min(int(wp.min(cells, LAST)), wp.static(NODES - 2))
        t = cells - float(c)
        if cells >= LAST:
            t = 1.0
            depth = head[wp.static(place.DEPTH_MAX)]
            if cells > LAST:
                flags = flags | wp.static(int(Status.DEPTH_ABOVE_RANGE))
            cells = LAST
        plain_limit = line(rows, c, wp.static(place.LIMIT), t)
        press_slide = parabola(rows, c, wp.static(place.PRESS_SLIDE), t)
        limit = plain_limit * strength
        kx = parabola(rows, c, wp.static(place.STIFFNESS_X), t)
        ky = parabola(rows, c, wp.static(place.STIFFNESS_Y), t)
        per_mm = head[wp.static(place.CELLS_PER_MM)]
        gyration = head[wp.static(place.GYRATION)]

        # ---- the plane moves ----
        fresh = not (depth_before > 0.0)
        x0 = memory_in[wp.static(anchors), i]
        y0 = memory_in[wp.static(anchors + 1), i]
        x0_low = memory_in[wp.static(anchors + 2), i]
        y0_low = memory_in[wp.static(anchors + 3), i]
        angle0 = memory_in[wp.static(anchors + 4), i]
        angle0_low = memory_in[wp.static(anchors + 5), i]
        turns = wp.abs(spin) <= SPIN_MAX_RAD
        if wp.static(pairs == 1):
            turns = spin == 0.0
        if not (slide_x * slide_x + slide_y * slide_y <= SLIDE_MAX_MM * SLIDE_MAX_MM and turns):
            # NaN and infinity become 0, long steps are cut; both are flagged.
            if not (slide_x * slide_x + slide_y * slide_y <= SLIDE_MAX_MM * SLIDE_MAX_MM):
                if wp.isfinite(slide_x) and wp.isfinite(slide_y):
                    flags = flags | wp.static(int(Status.LARGE_INCREMENT))
                else:
                    flags = flags | wp.static(int(Status.BAD_INPUT))
                slide_x = bounded(slide_x, 1e6)
                slide_y = bounded(slide_y, 1e6)
                length = wp.abs(slide_x) + wp.abs(slide_y)
                if length > SLIDE_MAX_MM:
                    cut = SLIDE_MAX_MM / length
                    slide_x = slide_x * cut
                    slide_y = slide_y * cut
            if wp.static(pairs == 1):
                if spin != 0.0:
                    flags = flags | wp.static(int(Status.SPIN_IGNORED))
            else:
                if not (wp.abs(spin) <= SPIN_MAX_RAD):
                    if wp.isfinite(spin):
                        flags = flags | wp.static(int(Status.LARGE_INCREMENT))
                    else:
                        flags = flags | wp.static(int(Status.BAD_INPUT))
                    spin = bounded(spin, SPIN_MAX_RAD)
        x_to = two_sum(x0, x0_low, slide_x)
        y_to = two_sum(y0, y0_low, slide_y)
        angle_to = wp.vec2(angle0, angle0_low)
        if wp.static(pairs == 2):
            angle_to = two_sum(angle0, angle0_low, spin)
        x = x_to[0]
        y = y_to[0]
        angle = angle_to[0]
        turn = wp.vec3(
            memory_in[wp.static(anchors + 6), i], memory_in[wp.static(anchors + 7), i], memory_in[wp.static(anchors + 8), i]
        )
        reached = wp.vec3(
            memory_in[wp.static(anchors + 9), i], memory_in[wp.static(anchors + 10), i], memory_in[wp.static(anchors + 11), i]
        )
        turn_before = wp.vec3(
            memory_in[wp.static(anchors + 12), i], memory_in[wp.static(anchors + 13), i], memory_in[wp.static(anchors + 14), i]
        )
        limit_reached = memory_in[wp.static(anchors + 15), i]
        limit_before = memory_in[wp.static(anchors + 16), i]
        # Where the origin was before it was moved, by which anchors are moved as well.
        moved_x = float(0.0)
        moved_y = float(0.0)
        moved_angle = float(0.0)
        is_far = not (wp.abs(x) < 2.0 and wp.abs(y) < 2.0 and wp.abs(angle) < 2.0)
        if is_far:
            moved_x = x + press_slide
            moved_y = y
            moved_angle = angle
            origin = wp.vec3(moved_x, moved_y, moved_angle)
            turn = turn - origin
            reached = reached - origin
            turn_before = turn_before - origin
            x = -press_slide
            y = -0.0
            angle = 0.0
        slid = wp.vec3(x, y, angle)
        here_x = x + press_slide
        here_y = y
        if fresh:
            turn = slid
            reached = slid

        # ---- the way since the last turn ----
        first_x = here_x
        first_y = here_y
        held_x = memory_in[0, i]
        held_y = memory_in[1, i]
        if wp.static(pairs == 2):
            first_x = here_x - springs[0, 4] * angle
            first_y = here_y + springs[0, 2] * angle + springs[0, 3] * angle
            if is_far:
                held_x = held_x - (moved_x - springs[0, 4] * moved_angle)
                held_y = held_y - (moved_y + springs[0, 2] * moved_angle + springs[0, 3] * moved_angle)
        else:
            if is_far:
                held_x = held_x - moved_x
                held_y = held_y - moved_y
        if fresh:
            held_x = first_x
            held_y = first_y
        stretch_x = first_x - held_x
        stretch_y = first_y - held_y
        noticed_growth = NOTICED_DEPTH_MM * (limit * (rows[c, wp.static(place.LIMIT + 1)] * per_mm / plain_limit))
        moved = slid - reached
        square = product(moved, moved, gyration)
        grown = limit - limit_reached
        weighed = GROWTH * grown
        distant = square > NOTICED_MM * NOTICED_MM
        if distant or grown > noticed_growth:
            grows = grown > 0.0 and outweighs(weighed, square, kx)
            is_clear = distant
            if grows:
                is_clear = grown > noticed_growth
            if is_clear:
                if grows:
                    if not (limit_before > 0.0):
                        turn_before = turn
                        limit_before = limit_reached
                    old = slid - turn_before
                    left = LEFT * share_to_full_slip(old, limit, kx)
                    turn = wp.vec3(slid[0] - left * old[0], slid[1] - left * old[1], slid[2] - left * old[2])
                else:
                    if limit_before > 0.0:
                        # The contact has grown and now slides: its old way goes on, or is forgotten.
                        forgets = bool(True)
                        if limit <= REMEMBERED * limit_before:
                            since = slid - turn
                            is_back = limit <= SAME * limit_before
                            if not is_back and outweighs(limit - limit_before, product(since, since, gyration), kx):
                                forgets = False
                            else:
                                turn = turn_before
                        if forgets:
                            limit_before = 0.0
                    way_back = reached - turn
                    ahead_back = product(moved, way_back, gyration)
                    if ahead_back < 0.0:
                        if outweighs(weighed, square, kx) and stretch_x * way_back[0] + stretch_y * way_back[1] > 0.0:
                            turn = slid - way_back
                        else:
                            turn = turned_back(reached, moved, way_back, square, ahead_back, limit, kx, gyration)
                        limit_before = 0.0
                reached = slid
                limit_reached = limit
        elif grown < 0.0:
            if grown < -noticed_growth:
                way_down = reached - turn
                if product(moved, way_down, gyration) < 0.0 and outweighs(weighed, square, kx):
                    if stretch_x * way_down[0] + stretch_y * way_down[1] > 0.0:
                        turn = slid - way_down
                        reached = slid
                limit_reached = limit
            if limit < limit_before:
                turn = turn_before
                limit_before = 0.0
        way = slid - turn

        # ---- the springs ----
        odd = head[wp.static(place.ODD)] / strength
        shift = line(rows, c, wp.static(place.YIELD_SHIFT), t)
        anisotropy = line(rows, c, wp.static(place.ANISOTROPY), t)
        ratio = ky / kx
        wide = (1.0 + shift * shift) * WITHIN
        x1 = float(0.0)
        x2 = float(0.0)
        x3 = float(0.0)
        y1 = float(0.0)
        y2 = float(0.0)
        moment_x = float(0.0)
        moment_y = float(0.0)
        levered = float(0.0)
        stick = float(1.0)
        for j in range(wp.static(SPRINGS)):
            stiffness = springs[j, 0]
            sharpness = springs[j, 1]
            centre = springs[j, 2]
            radius = line(rows, c, wp.static(place.RADIUS) + 2 * j, t) * strength
            slipping = float(0.0)
            for k in range(wp.static(pairs)):
                to_x = here_x
                to_y = here_y
                from_x = moved_x
                from_y = moved_y
                gone_x = way[0]
                gone_y = way[1]
                arm_x = float(0.0)
                arm_y = float(0.0)
                if wp.static(pairs == 2):
                    arm_x = springs[j, 3]
                    arm_y = springs[j, 4]
                    if k == 1:
                        arm_x = -arm_x
                        arm_y = -arm_y
                    to_x = here_x - arm_y * angle
                    to_y = here_y + centre * angle + arm_x * angle
                    from_x = moved_x - arm_y * moved_angle
                    from_y = moved_y + centre * moved_angle + arm_x * moved_angle
                    gone_x = way[0] - arm_y * way[2]
                    gone_y = way[1] + centre * way[2] + arm_x * way[2]
                a_x = memory_in[2 * (wp.static(pairs) * j + k), i]
                a_y = memory_in[2 * (wp.static(pairs) * j + k) + 1, i]
                if fresh:
                    a_x = to_x
                    a_y = to_y
                elif is_far:
                    a_x = a_x - from_x
                    a_y = a_y - from_y
                ux = to_x - a_x
                uy = to_y - a_y
                w = uy * anisotropy
                over = ux * ux + w * w - radius * ((radius + SLACK_MM) + (shift + shift) * ux)
                if over > 0.0:
                    # Back onto the limit by slip along the friction.
                    middle = shift * radius
                    vx = ux - middle
                    limit_square = radius * radius * wide
                    excess = vx * vx + w * w - limit_square
                    along = ux * vx + ratio * (w * w)
                    part = excess / (excess + wp.abs(along + along))
                    back_y = 1.0 - ratio * part
                    nx = vx - part * ux
                    ny = w * back_y
                    scale = root(limit_square / (nx * nx + ny * ny + NOTHING))
                    back_y = back_y * scale
                    ux = middle + nx * scale
                    uy = uy * back_y
                    w = w * back_y
                    a_x = to_x - ux
                    a_y = to_y - uy
                    over = 0.0
                memory_out[2 * (wp.static(pairs) * j + k), i] = a_x
                memory_out[2 * (wp.static(pairs) * j + k) + 1, i] = a_y
                first = stiffness * ux
                across = stiffness * uy
                second = first * ux
                x1 = x1 + first
                x2 = x2 + second
                x3 = x3 + second * ux
                y1 = y1 + across
                y2 = y2 + across * uy
                slipping = slipping + slipping_share(gone_x, gone_y, ux, w, over, radius, shift, anisotropy, sharpness)
                if wp.static(pairs == 2):
                    moment_x = moment_x + arm_y * first
                    moment_y = moment_y + (centre + arm_x) * across
                    levered = levered + arm_y * second
            area_share = line(rows, c, wp.static(place.AREA_SHARE) + 2 * j, t)
            stick = stick - area_share * (wp.static(share) * slipping)
        if wp.static(pairs == 2):
            x1 = x1 * wp.static(share)
            x2 = x2 * wp.static(share)
            x3 = x3 * wp.static(share)
            y1 = y1 * wp.static(share)
            y2 = y2 * wp.static(share)
            moment_x = wp.static(share) * (moment_x - odd * levered)
            moment_y = wp.static(share) * moment_y
        # Slip leads along x and lags along y.
        stick = wp.max(stick, 0.0)
        along_square = way[0] * way[0]
        across_square = way[1] * way[1]
        slip_lead = head[wp.static(place.SLIP_LEAD)] + head[wp.static(place.SLIP_LEAD + 1)] * cells
        lead = slip_lead * (along_square - across_square) / (along_square + across_square + NOTHING)
        stick = stick * (1.0 - lead * (1.0 - stick))

        # ---- what they bear together ----
        third = float(1.0) / float(3.0)
        friction_x = kx * (x1 - odd * x2)
        friction_y = ky * y1
        energy_x = 0.5 * x2 - odd * third * x3
        energy_y = 0.5 * y2
        coupling = slope(rows, c, wp.static(place.PRESS_SLIDE), t) * per_mm
        slope_x = slope(rows, c, wp.static(place.STIFFNESS_X), t) * per_mm
        slope_y = slope(rows, c, wp.static(place.STIFFNESS_Y), t) * per_mm
        plain = line(rows, c, wp.static(place.NORMAL), t)
        normal = plain + coupling * friction_x + slope_x * energy_x + slope_y * energy_y
        way_square = way[0] * way[0] + way[1] * way[1]
        if wp.static(pairs == 2):
            way_square = way_square + way[2] * way[2]
        if not wp.isfinite(normal + friction_y + ENDLESS * way_square):
            forget(memory_out, wp.static(count), strength, i)
            answer_in_the_air(response, regime, status, flags | wp.static(int(Status.MEMORY_LOST)), i)
            return

        # ---- memory ----
        memory_out[wp.static(anchors), i] = x
        memory_out[wp.static(anchors + 1), i] = y
        memory_out[wp.static(anchors + 2), i] = x_to[1]
        memory_out[wp.static(anchors + 3), i] = y_to[1]
        memory_out[wp.static(anchors + 4), i] = angle
        memory_out[wp.static(anchors + 5), i] = angle_to[1]
        for axis in range(3):
            memory_out[wp.static(anchors + 6) + axis, i] = turn[axis]
            memory_out[wp.static(anchors + 9) + axis, i] = reached[axis]
            memory_out[wp.static(anchors + 12) + axis, i] = turn_before[axis]
        memory_out[wp.static(anchors + 15), i] = limit_reached
        memory_out[wp.static(anchors + 16), i] = limit_before
        memory_out[wp.static(anchors + DEPTH), i] = depth
        memory_out[wp.static(anchors + STRENGTH), i] = strength

        # ---- answer, in shares of the limit ----
        per_limit = 1.0 / limit
        along_share = friction_x * per_limit
        across_share = friction_y * per_limit
        stretched = across_share / line(rows, c, wp.static(place.LIMIT_RATIO), t)
        shifted = line(rows, c, wp.static(place.LIMIT_SHIFT), t) * along_share
        alone = root(along_share * along_share + NOTHING + stretched * stretched + shifted * shifted) - shifted
        alone = wp.min(alone, 1.0)
        magnitude = root(along_share * along_share + NOTHING + across_share * across_share)
        friction_moment = line(rows, c, wp.static(place.FRICTION_CENTRE), t) * friction_y
        moment = friction_moment
        margin = 1.0 - alone
        if wp.static(pairs == 2):
            moment = ky * moment_y - kx * moment_x
            most = line(rows, c, wp.static(place.SPIN_LIMIT), t) / plain_limit + NOTHING
            turning = (moment - friction_moment) * per_limit / most
            cross = head[wp.static(place.SPIN_CROSS)] * wp.abs(turning * alone)
            margin = wp.max(1.0 - root(alone * alone + turning * turning + cross), 0.0)
        area = line(rows, c, wp.static(place.AREA), t)
        band_of_normal = head[wp.static(place.BAND_NORMAL_OF)] + stick * (
            head[wp.static(place.BAND_NORMAL_OF + 1)] + stick * head[wp.static(place.BAND_NORMAL_OF + 2)]
        )
        band_of_friction = head[wp.static(place.BAND_FRICTION_OF)] + stick * (
            head[wp.static(place.BAND_FRICTION_OF + 1)] + stick * head[wp.static(place.BAND_FRICTION_OF + 2)]
        )
        normal = wp.max(normal, 0.0)
        centre_x = line(rows, c, wp.static(place.PRESSURE_CENTRE), t) + head[wp.static(place.PRESSURE_CENTRE_PER_N)] * friction_x
        centre_y = head[wp.static(place.PRESSURE_CENTRE_PER_N + 1)] * friction_y
        response[wp.static(NORMAL_N), i] = normal
        response[wp.static(FRICTION_X), i] = friction_x
        response[wp.static(FRICTION_Y), i] = friction_y
        response[wp.static(MOMENT), i] = moment
        response[wp.static(MARGIN), i] = margin
        response[wp.static(STICK), i] = stick
        response[wp.static(LIMIT_N), i] = limit * (magnitude / alone)
        response[wp.static(AREA_MM2), i] = area + area * head[wp.static(place.AREA_TILT)] * along_share
        response[wp.static(TANGENTIAL_X), i] = friction_x
        response[wp.static(TANGENTIAL_Y), i] = friction_y
        response[wp.static(TILT_X), i] = normal * centre_y
        response[wp.static(TILT_Y), i] = -(normal * centre_x)
        response[wp.static(CENTRE_X), i] = centre_x
        response[wp.static(CENTRE_Y), i] = centre_y
        response[wp.static(BAND_N), i] = line(rows, c, wp.static(place.BAND_NORMAL), t) * band_of_normal
        response[wp.static(BAND_F), i] = limit * band_of_friction
        sort = int(1)
        if stick < 0.99:
            sort = sort + 1
        if stick <= 0.01:
            sort = sort + 1
        regime[i] = sort
        status[i] = flags

    return step_bed
