//! What a contact does at the equilibrium of a step: patches slip, and their loads add up to the response.
//!
//! Main functions: [`Pad::update_anchors_and_sum`], [`Pad::response`]. Uses equilibrium, body and patch.

use nalgebra::Vector3;

use crate::math::Elementary;
use crate::relaxation::Perhaps;
use crate::{Regime, Response, Status};

use super::body::{Surface, spread, steepness};
use super::equilibrium::{ActivePatch, Equations, Frame, PatchContact, PlacedPatch};
use super::memory::{Memory, Weights};
use super::patch::{flat_force_rate, spread_along, times_spread};
use super::state::{APART, PadState};
use super::step::closest_place;
use super::{Law, Pad, Patch};

/// A patch slips if its stretch exceeds the bound by this factor and by this length, mm. Both are above the rounding of its place.
const SLIPS: [f32; 2] = [1.0 + 4e-6, 4e-6];
/// Least rise of the reserve of a patch above its least value, over its strength, that counts as a rise, and fall below its largest value
/// that counts as a fall. It is above the error of equilibrium.
const NOTICED: f32 = 4e-3;
/// The same as a length of its stretch, over the largest depth; it counts where the bound is short.
const NOTICED_LENGTH: f32 = 5e-5;
/// A larger reserve counts as this one, mm. It is less than [`APART`], which marks patches without contact.
const MOST_RESERVE_MM: f32 = 0.6;
/// Exponent of the slipping share of a patch that touches over its whole area, over that of the file.
const WHOLE: f32 = 0.8;

/// Least mean square of the arms of a contact about its middle, mm².
const LEAST_ARM_MM2: f32 = 0.01;
/// Depth above which the bands grow with depth, mm.
const DEEP_MM: f32 = 2.6;
/// Angle from the neutral pose at which half of the addition for other poses is applied to the bands, rad.
const AWAY_RAD: f32 = 0.05;

impl<T: Elementary> Pad<'_, T> {
    /// Moves the anchors of patches that slip or do not touch, and sums loads and areas over the patches.
    #[inline(always)]
    pub(super) fn update_anchors_and_sum<const P: usize, B: Surface<T>, M: Memory<P, T>>(
        &self,
        state: &mut PadState<P, T, M>,
        equations: &Equations<'_, P, T, B, M::Weights>,
        active: &[ActivePatch<'_, T>],
    ) -> Sums<T> {
        let law = &self.numbers.law;
        let zero = T::of(0.0);
        let mut loads = Loads::none();
        let mut is_changed = false;
        let noticed_mm = T::of(NOTICED_LENGTH) * self.numbers.depth_max_mm;
        let (mut area, mut stuck_area, mut strength, mut reach, mut later) = (zero, zero, zero, zero, zero);
        let mut middle = Vector3::zeros();
        let (apex, [soft, stiff]) = Loads::constants(equations, law);
        for ActivePatch { index, patch, placed, contact } in active {
            let (Some(anchor), Some(reserve), Some(turn)) =
                (state.anchors.get_mut(*index), state.reserve.get_mut(*index), state.turn.get_mut(*index))
            else {
                continue;
            };
            let before = (*anchor, *reserve);
            if !contact.touches {
                *anchor = closest_place(equations.body, &contact.place);
                let mut overlap = contact.overlap + placed.compressed.spread;
                if equations.stiff().is_some() {
                    // Skin that lags behind the body does not touch it, but will.
                    if overlap > zero {
                        later +=
                            placed.compressed.press(contact.overlap, law, None).strength * equations.strength_factor;
                    }
                    overlap = overlap.at_most(zero);
                }
                *reserve = T::of(APART) - overlap;
                is_changed |= before != (*anchor, *reserve);
                continue;
            }
            let reserve_now = (contact.bound - contact.length).not_negative().at_most(T::of(MOST_RESERVE_MM));
            if *reserve >= T::of(APART) {
                // The patch did not touch at the end of the last step.
                *anchor = [placed.anchor[0], placed.anchor[1]];
                *reserve = reserve_now;
                *turn = [zero; 2];
            }
            let slips = contact.length > contact.bound * T::of(SLIPS[0]) + T::of(SLIPS[1]);
            if slips {
                let mut to_anchor = contact.stretch * (contact.bound / contact.length);
                if let Some(weights) = equations.weights.get() {
                    to_anchor = (to_anchor + weights.across(*index, &placed.inward)) * (T::of(1.0) / weights.stiff);
                }
                *anchor = closest_place(equations.body, &(contact.place + to_anchor));
            }
            // A rise of the reserve, because friction falls or strength rises, is a turn. Then nothing slips until the reserve falls.
            let (extreme, fell) = (reserve.magnitude(), *reserve >= zero);
            let beyond = if fell { reserve_now - extreme } else { extreme - reserve_now };
            let dead_band = T::of(NOTICED) * contact.bound + noticed_mm;
            let at_bound = reserve_now <= dead_band;
            let falls = at_bound || fell != (beyond > dead_band);
            if at_bound {
                *turn = [zero; 2];
            } else if fell && !falls {
                *turn = [contact.stretch.x, contact.stretch.y];
            }
            // Within the dead band the extreme value of this fall or rise remains.
            let reserve_now = if falls == fell && beyond > zero { extreme } else { reserve_now };
            *reserve = if falls { reserve_now } else { -reserve_now };
            is_changed |= before != (*anchor, *reserve);
            let contact_share = placed.compressed.contact_share(contact.below, law);
            let contact_area = placed.compressed.full_area * contact_share;
            area += contact_area;
            if !falls {
                stuck_area += contact_area;
            } else if !slips {
                stuck_area += contact_area * (T::of(1.0) - slipping(contact, turn, contact_share, law));
            }
            strength += contact.strength;
            if equations.stiff().is_some() {
                later += placed.compressed.relaxed_strength(contact.relaxed, law) * equations.strength_factor;
            }
            let arm = loads.add(equations, law, &apex, &[soft, stiff], patch, placed, contact);
            middle += arm * contact.strength;
            reach += contact.strength * (arm[0] * arm[0] + arm[1] * arm[1]);
        }
        let later = equations.stiff().map(|_| later);
        Sums { loads, area, stuck_area, strength, later, middle, reach, is_changed }
    }

    /// Force, N, and moment about the point of the plane under the centre of rotation, N mm, of loads, along the axes of the plane.
    #[inline(always)]
    pub(super) fn wrench(&self, angle: T, frame: &Frame<T>, loads: &Loads<T>) -> [Vector3<T>; 2] {
        let Frame { axes, approach, .. } = frame;
        let (turning, arm) = (axes * loads.turning, axes * approach.arm);
        let [x, y, normal] = loads.force.into();
        let about = [arm[1] * normal - approach.shift * y, approach.shift * x - arm[0] * normal];
        let moment = loads.moment + Vector3::new(about[0] - turning.y, about[1] + turning.x, T::of(0.0));
        let force = Vector3::new(x, y, normal * approach.rate);
        // From the body's axes to those of the plane.
        let (sin, cos) = angle.sin_cos();
        [force, moment].map(|v| Vector3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z))
    }

    /// The response of a contact with these sums over its patches.
    #[inline(always)]
    pub(super) fn response<const P: usize, B: Surface<T>, M: Memory<P, T>>(
        &self,
        state: &PadState<P, T, M>,
        equations: &Equations<'_, P, T, B, M::Weights>,
        sums: &Sums<T>,
    ) -> Response<T> {
        let Sums { loads: Loads { friction_spin, .. }, area, stuck_area, strength, reach, .. } = *sums;
        let zero = T::of(0.0);
        let [force, moment] = self.wrench(state.angle[0], &equations.frame, &sums.loads);
        let (sin, cos) = state.angle[0].sin_cos();
        let back = |v: &Vector3<T>| Vector3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z);
        let friction = back(&sums.loads.friction);
        let (normal, in_contact) = (force[2], area > zero);
        let pressing = normal.not_negative();
        let strength_or_tiny = strength + T::of(f32::MIN_POSITIVE);
        // Where friction is orthotropic, the limit is that in the direction of friction, and against spin the smallest one.
        let (resultant, limit, least) = match &equations.axis {
            None => (friction.dot(&friction).magnitude().sqrt(), strength, strength_or_tiny),
            Some(axis) => {
                let [length, scaled] =
                    axis.lengths(&sums.loads.friction, &Vector3::new(T::of(0.0), T::of(0.0), T::of(1.0)));
                (scaled, strength * (length / scaled), strength_or_tiny * axis.least_limit())
            }
        };
        // The slip margin compares friction, and its moment about the centre of the strengths, with an ellipse.
        let middle = back(&(sums.middle * (T::of(1.0) / strength_or_tiny)));
        let square = (reach / strength_or_tiny - (middle[0] * middle[0] + middle[1] * middle[1])).not_negative();
        // With one patch in contact the difference is rounding only.
        let arm = (square + T::of(LEAST_ARM_MM2)).magnitude().sqrt();
        let about_middle = friction_spin - (middle[0] * friction[1] - middle[1] * friction[0]);
        let (share, turning) = (resultant / strength_or_tiny, about_middle / (least * arm + T::of(1e-12)));
        let stick_ratio = if in_contact { stuck_area / area } else { zero };
        let (numbers, steepness) = (self.numbers, steepness(equations.body));
        let (away, deep) = (away(state.tilt), (state.depth - T::of(DEEP_MM)).not_negative());
        let added = [0, 1].map(|k| steepness * numbers.band_body[k] + deep * numbers.band_deep[k]);
        let band =
            |[neutral, other]: &[[T; 3]; 2]| parabola(neutral, stick_ratio) + away * parabola(other, stick_ratio);
        let [light, more] = numbers.band_light_n;
        let light = [0, 1].map(|k| light[k] + away * more[k]);
        let per_normal = if pressing > zero { T::of(1.0) / pressing } else { zero };
        let used = (share * share + turning * turning).magnitude().sqrt();
        let left = |used: T| if in_contact { (T::of(1.0) - used).not_negative() } else { zero };
        Response {
            normal_force_n: normal,
            friction_n: [force[0], force[1]],
            tangential_friction_n: [friction[0], friction[1]],
            stick_ratio,
            friction_limit_n: limit,
            slip_margin: left(used),
            slip_margin_relaxed: left(sums.later.map_or(used, |later| {
                used * (strength_or_tiny / (later + T::of(f32::MIN_POSITIVE))).at_most(T::of(1e9))
            })),
            spin_moment_n_mm: moment[2],
            tilt_moment_n_mm: [moment[0], moment[1]],
            pressure_centre_mm: [-moment[1] * per_normal, moment[0] * per_normal],
            contact_area_mm2: area,
            band_normal_n: if in_contact {
                (pressing * (band(&numbers.band_normal) + added[0]) + light[0]).not_negative()
            } else {
                zero
            },
            band_friction_n: if in_contact {
                (limit * (band(&numbers.band_friction) + added[1]) + light[1]).not_negative()
            } else {
                zero
            },
            regime: Regime::classify(in_contact, stick_ratio.to_f32()),
            status: Status::OK,
        }
    }
}

/// Loads of patches in contact, along the axes of the body and about the centre of rotation of poses.
pub(super) struct Loads<T> {
    /// Force on the skin, N.
    force: Vector3<T>,
    /// Its moment, N mm.
    moment: Vector3<T>,
    /// Its part along the surface, N, and the moment of that about the normal, N mm.
    friction: Vector3<T>,
    friction_spin: T,
    /// Moment of a plane due to the spread of the gaps, which changes with its rotation; finger's frame, N mm.
    turning: Vector3<T>,
}

impl<T: Elementary> Loads<T> {
    pub(super) fn none() -> Self {
        let zeros = Vector3::zeros();
        Self { force: zeros, moment: zeros, friction: zeros, friction_spin: T::of(0.0), turning: zeros }
    }

    /// What [`Self::add`] uses of the equations: the place of the apex along the body's axes, and the bulk's softness along over across the
    /// normal, with its inverse. It stays along the body's axes when the body turns.
    pub(super) fn constants<const P: usize, B: Surface<T>, W: Perhaps<Weights<P, T>>>(
        equations: &Equations<'_, P, T, B, W>,
        law: &Law<T>,
    ) -> (Vector3<T>, [T; 2]) {
        let [across_soft, along_soft] = law.softness;
        let apex = Vector3::new(equations.frame.apex.x, equations.frame.apex.y, T::of(0.0));
        (apex, [along_soft / across_soft, across_soft / along_soft])
    }

    /// Adds the load of a patch that touches; returns its place from the centre of rotation along the body's axes, mm.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "a patch and the constants of its step")]
    pub(super) fn add<const P: usize, B: Surface<T>, W: Perhaps<Weights<P, T>>>(
        &mut self,
        equations: &Equations<'_, P, T, B, W>,
        law: &Law<T>,
        apex: &Vector3<T>,
        &[soft, stiff]: &[T; 2],
        patch: &Patch<T>,
        placed: &PlacedPatch<T>,
        contact: &PatchContact<T>,
    ) -> Vector3<T> {
        let traction = contact.stretch * contact.grip;
        let on_skin = traction - contact.inward * contact.force;
        let arm = contact.place + apex;
        self.friction += traction;
        self.friction_spin += arm[0] * traction[1] - arm[1] * traction[0];
        self.force += on_skin;
        let moved = contact.place - placed.place;
        let tilting = (placed.place + apex).cross(&on_skin);
        let soft_tilting = Vector3::new(soft * moved.x, soft * moved.y, stiff * moved.z).cross(&on_skin);
        let spinning = arm[0] * on_skin[1] - arm[1] * on_skin[0];
        self.moment += Vector3::new(tilting.x + soft_tilting.x, tilting.y + soft_tilting.y, spinning);
        // The energy also depends on the spread of the gaps, which changes with the rotation of the body. On a curved body the mean
        // overlap adds a moment about the middle.
        let relaxed = equations.stiff().map_or(contact.force, |_| contact.relaxed);
        let energy = placed.compressed.energy(contact.overlap, relaxed, flat_force_rate(patch, law));
        let mut pull = energy.1 / placed.compressed.spread;
        if equations.stiff().is_some() && contact.force != relaxed {
            pull *= contact.force / (relaxed + T::of(f32::MIN_POSITIVE));
        }
        if equations.body.is_plane() {
            // The second moment times the normal.
            let (along, _) = spread_along(patch, &equations.frame.axes.row(2).transpose());
            self.turning += times_spread(patch, &along) * pull;
            return arm;
        }
        let sides = equations.frame.sides(patch);
        let undeformed = spread(equations.body, &placed.place, &sides);
        let mean_moment = spread(equations.body, &contact.place, &sides).moment;
        let by_spread = undeformed.variance_slope * (-pull);
        self.force += by_spread;
        self.moment += (placed.place + apex).cross(&by_spread);
        self.moment -= undeformed.variance_moment * pull + mean_moment * contact.force;
        arm
    }
}

/// Sums over the patches in contact, along the axes of the body and about the centre of rotation of poses.
pub(super) struct Sums<T> {
    loads: Loads<T>,
    /// Area in contact and its stuck part, mm².
    area: T,
    stuck_area: T,
    /// Strength, N, and its first and second moment about the centre of rotation, N mm and N mm².
    strength: T,
    /// Strength when the tissue has relaxed, N; none where it does not.
    later: Option<T>,
    middle: Vector3<T>,
    reach: T,
    /// Whether the state of a patch is another one than before the step.
    pub is_changed: bool,
}

/// Value of a parabola b[0] + b[1] x + b[2] x².
fn parabola<T: Elementary>(b: &[T; 3], x: T) -> T {
    b[0] + x * (b[1] + x * b[2])
}

/// Factor of the addition for other poses to the bands: 0 in the neutral pose, 1 far from it.
fn away<T: Elementary>([pitch, roll]: [T; 2]) -> T {
    let rotated = pitch * pitch + roll * roll;
    rotated / (rotated + T::of(AWAY_RAD * AWAY_RAD))
}

/// Slipping share of a patch whose reserve falls: a power of the way of its stretch since the last turn, over the whole way from there to the
/// bound. A patch that touches in part slips later.
///
/// * `turn`: stretch at the last turn, mm; zero without one
/// * `contact_share`: share of the patch's area that touches
#[inline(always)]
pub(super) fn slipping<T: Elementary>(contact: &PatchContact<T>, turn: &[T; 2], contact_share: T, law: &Law<T>) -> T {
    let tiny = T::of(f32::MIN_POSITIVE);
    let [x, y] = *turn;
    let (way, whole) = if *turn == [T::of(0.0); 2] {
        (contact.length, contact.bound)
    } else {
        let [along_x, along_y] = [contact.stretch.x - x, contact.stretch.y - y];
        let way = (along_x * along_x + along_y * along_y + tiny).magnitude().sqrt();
        let outward = (x * along_x + y * along_y) / way;
        let square = outward * outward + contact.bound * contact.bound - (x * x + y * y);
        (way, square.not_negative().sqrt() - outward)
    };
    let share = (way / (whole.not_negative() + tiny)).at_most(T::of(1.0));
    let exponent = T::of(WHOLE) * law.onset / (contact_share + tiny).magnitude().sqrt();
    (exponent * (share + tiny).ln()).exp()
}
