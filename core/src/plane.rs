//! Motion of the plane: positions of the springs on it, and the origin of the state.
//!
//! Main functions: [`spring_positions`], [`move_plane`]. Uses data, state, memory, stick_ratio and math.

use core::array::from_fn;

use crate::build::DataOf;
use crate::data::Spring;
use crate::math::{Scalar, add};
use crate::memory::Memory;
use crate::relaxation::Perhaps;
use crate::step::rare;
use crate::stick_ratio::Remembers;
use crate::{ForceStateOf, ModelOf, Motion, Status};

/// Longest slide in one step, mm of the fitted finger, and largest angle, rad: beyond full slip of every spring, so that a cut loses nothing.
const SLIDE_MAX_MM: f32 = 64.0;
const SPIN_MAX_RAD: f32 = 8.0;

/// Moves the plane. If it is 2 mm from the state's origin, the origin moves too, so positions are accurate to a quarter of a nanometre.
///
/// An increment that is not a number or too large leads far away as well, so one check of the position of the plane finds all of them.
#[inline(always)]
pub(crate) fn move_plane<const M: usize, const N: usize, const P: usize, T: Scalar, R>(
    model: &ModelOf<'_, M, N, T>,
    state: &mut ForceStateOf<M, P, T, R>,
    history: &mut impl Remembers<T>,
    motion: Motion<T>,
    press_slide: T,
    status: &mut Status,
) {
    let is_far = |place: &Place<T>| {
        place.position[0][0].needs_rebase(place.position[0][1]) | (P > 1 && place.angle[0].needs_rebase(T::of(0.0)))
    };
    let [x, y] = motion.slide_increment_mm.map(|slide| slide * model.units.per_length);
    let spin = motion.spin_increment_rad;
    let mut place = Place::moved(state, [x, y], spin);
    let mut far = is_far(&place);
    if far | (P == 1 && spin != T::of(0.0)) {
        rare();
        let turns = if P == 1 { spin == T::of(0.0) } else { spin.magnitude() <= T::of(SPIN_MAX_RAD) };
        if !((x * x + y * y <= T::of(SLIDE_MAX_MM * SLIDE_MAX_MM)) & turns) {
            let ([x, y], spin) = bounded::<P, T>([x, y], spin, status);
            place = Place::moved(state, [x, y], spin);
            far = is_far(&place);
        }
    }
    (state.position, state.angle) = (place.position, place.angle);
    if far {
        let origin = move_origin(state, press_slide, model.data);
        history.move_origin(origin);
    }
}

/// Position of the plane: slide and angle in the form of the state.
struct Place<T> {
    position: [[T; 2]; 2],
    angle: [T; 2],
}

impl<T: Scalar> Place<T> {
    #[inline(always)]
    fn moved<const M: usize, const P: usize, R>(state: &ForceStateOf<M, P, T, R>, [x, y]: [T; 2], spin: T) -> Self {
        let [at, low] = state.position;
        let (to_x, low_x) = add(at[0], low[0], x);
        let (to_y, low_y) = add(at[1], low[1], y);
        let angle = if P == 1 { state.angle } else { add(state.angle[0], state.angle[1], spin).into() };
        Self { position: [[to_x, to_y], [low_x, low_y]], angle }
    }
}

/// Replaces non-finite components of slide and spin by zero and limits both to the largest step; each change is flagged.
#[inline(never)]
fn bounded<const P: usize, T: Scalar>([mut x, mut y]: [T; 2], mut spin: T, status: &mut Status) -> ([T; 2], T) {
    let bounded = |s: T, most: f32, status: &mut Status| {
        if !s.is_number() {
            *status = status.with(Status::BAD_INPUT);
            return T::of(0.0);
        }
        let most = T::of(most);
        if s < -most { -most } else { s.at_most(most) }
    };
    let longest = T::of(SLIDE_MAX_MM * SLIDE_MAX_MM);
    if !(x * x + y * y <= longest) {
        if x.is_number() && y.is_number() {
            *status = status.with(Status::LARGE_INCREMENT);
        }
        [x, y] = [x, y].map(|s| bounded(s, 1e6, status));
        let length = x.magnitude() + y.magnitude();
        if length > T::of(SLIDE_MAX_MM) {
            let cut = T::of(SLIDE_MAX_MM) / length;
            [x, y] = [x * cut, y * cut];
        }
    }
    if P == 1 && spin != T::of(0.0) {
        *status = status.with(Status::SPIN_IGNORED);
    } else if P > 1 && !(spin.magnitude() <= T::of(SPIN_MAX_RAD)) {
        if spin.is_number() {
            *status = status.with(Status::LARGE_INCREMENT);
        }
        spin = bounded(spin, SPIN_MAX_RAD, status);
    }
    ([x, y], spin)
}

/// Moves the state's origin to the position of the plane, and its angle to 0. Displacements keep their bits, because the new
/// anchors are the displacements that a step computes from the old ones. Returns the new origin in terms of the old one.
#[inline(always)]
fn move_origin<const M: usize, const N: usize, const P: usize, T: Scalar, R>(
    state: &mut ForceStateOf<M, P, T, R>,
    press_slide: T,
    data: &DataOf<M, N, T>,
) -> [T; 3] {
    let [x, y] = state.position[0];
    let here = [x + press_slide, y, state.angle[0]];
    for (pair, spring) in state.anchor.iter_mut().zip(&data.springs) {
        for (anchor, to) in pair.iter_mut().zip(spring_positions::<P, T>(here, spring)) {
            *anchor = [anchor[0] - to[0], anchor[1] - to[1]];
        }
    }
    state.position[0] = [-press_slide, T::of(-0.0)];
    state.angle[0] = T::of(0.0);
    here
}

/// Starts a contact: the anchors are the positions of the springs, where branches hold no spring.
#[inline(always)]
pub(crate) fn touch<const M: usize, const N: usize, const P: usize, T: Scalar, R: Memory<M, P, T>>(
    state: &mut ForceStateOf<M, P, T, R>,
    here: [T; 3],
    data: &DataOf<M, N, T>,
    weights: &R::Weights,
) {
    for (j, (pair, spring)) in state.anchor.iter_mut().zip(&data.springs).enumerate() {
        *pair = spring_positions::<P, T>(here, spring);
        if let (Some(weights), Some(memory)) = (weights.get(), state.memory.get()) {
            for (k, anchor) in pair.iter_mut().enumerate() {
                let free = memory.hold(weights, j, k).displacement([T::of(0.0); 2]);
                *anchor = [anchor[0] - free[0], anchor[1] - free[1]];
            }
        }
    }
}

/// Position of a spring, or of the two springs of a pair, on the moved plane, mm.
#[inline(always)]
pub(crate) fn spring_positions<const P: usize, T: Scalar>([x, y, angle]: [T; 3], spring: &Spring<T>) -> [[T; 2]; P] {
    if P == 1 {
        return [[x, y]; P];
    }
    let middle = [x, y + spring.centre_mm * angle];
    let [arm_x, arm_y] = spring.arm_mm;
    let turned = [arm_y * angle, arm_x * angle];
    from_fn(|k| {
        if k == 0 {
            [middle[0] - turned[0], middle[1] + turned[1]]
        } else {
            [middle[0] + turned[0], middle[1] - turned[1]]
        }
    })
}
