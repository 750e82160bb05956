//! Eight contacts side by side, in the vector registers of a host.
//!
//! Main types: [`Lanes`], [`Together`]. Uses step, table and math.

use core::array::from_fn;
use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use bytemuck::{Pod, Zeroable};
use wide::{f32x8, i32x8};

use crate::math::{Arithmetic, sealed::Sealed};
use crate::rescaling::Wide;
use crate::step::{AtDepth, Begun, answer, carry, end};
use crate::stick_ratio::{Way, regime_of};
use crate::table::Row;
use crate::{DataOf, Forces, ModelOf, Response, StateOf};

/// Contacts that are ended together.
pub(crate) const LANES: usize = 8;

/// A number of each of eight contacts. Every operation gives each the bits that `f32` gives it alone.
#[derive(Clone, Copy, Debug, Zeroable, Pod)]
#[repr(transparent)]
pub struct Lanes(f32x8);

impl Lanes {
    /// The number of each contact.
    #[inline(always)]
    fn each(number: impl FnMut(usize) -> f32) -> Self {
        Self(f32x8::new(from_fn(number)))
    }

    /// Whether each is a number.
    #[inline(always)]
    fn are_numbers(self) -> bool {
        self.0.abs().simd_le(f32x8::splat(f32::MAX)).all()
    }
}

macro_rules! lane_by_lane {
    ($($operation:ident $function:ident $assign:ident $assigned:ident),*) => {$(
        impl $operation for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self($operation::$function(self.0, other.0))
            }
        }
        impl $assign for Lanes {
            #[inline(always)]
            fn $assigned(&mut self, other: Self) {
                self.0 = $operation::$function(self.0, other.0);
            }
        }
    )*};
}
lane_by_lane!(Add add AddAssign add_assign, Sub sub SubAssign sub_assign, Mul mul MulAssign mul_assign);

impl Div for Lanes {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(self.0 / other.0)
    }
}

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // The sign alone, as of a single number: of 0 as well.
        Self(self.0 ^ f32x8::splat(-0.0))
    }
}

impl Sealed for Lanes {}

impl Arithmetic for Lanes {
    #[inline(always)]
    fn of(constant: f32) -> Self {
        Self(f32x8::splat(constant))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }
    #[inline(always)]
    fn magnitude(self) -> Self {
        Self(self.0.abs())
    }
    #[inline(always)]
    fn not_negative(self) -> Self {
        let bits: i32x8 = bytemuck::cast(self);
        bytemuck::cast(bits.max(i32x8::ZERO))
    }
    #[inline(always)]
    fn at_most(self, most: Self) -> Self {
        Self(self.0.simd_gt(most.0).select(most.0, self.0))
    }
    #[inline(always)]
    fn where_positive<const K: usize>(self, places: [&mut Self; K], to: impl FnOnce() -> [Self; K]) {
        let above = self.0.simd_gt(f32x8::ZERO);
        if above.any() {
            for (place, to) in places.into_iter().zip(to()) {
                place.0 = above.select(to.0, place.0);
            }
        }
    }
}

/// Steps of up to eight contacts, begun and waiting for their springs to move together.
pub(crate) struct Together<'a, const M: usize, const N: usize, S: Wide> {
    model: ModelOf<'a, M, N, S>,
    scale: S::InLanes,
    data: DataOf<M, 0, Lanes>,
    waiting: heapless::Vec<(usize, Begun<'a, M, f32>), LANES>,
}

impl<'a, const M: usize, const N: usize, S: Wide> Together<'a, M, N, S> {
    pub(crate) fn new(model: &ModelOf<'a, M, N, S>) -> Self {
        let (scale, data) = (model.scale.in_lanes(), model.data.with_rows([]));
        Self { model: *model, scale, data, waiting: heapless::Vec::new() }
    }

    /// Takes note of a begun step of the state number `contact`; with the eighth, all move.
    #[inline(always)]
    pub(crate) fn push<const P: usize>(
        &mut self,
        contact: usize,
        begun: Begun<'a, M, f32>,
        states: &mut [StateOf<M, P>],
        forces: &mut Forces<'_>,
    ) {
        // There is room: a full list is ended at once.
        let _ = self.waiting.push((contact, begun));
        if let Ok(all) = self.waiting.as_slice().try_into() {
            if !self.end_together(all, states, forces) {
                self.end_each(states, forces);
            }
            self.waiting.clear();
        }
    }

    /// Ends the waiting steps one by one.
    #[inline(never)]
    pub(crate) fn end_each<const P: usize>(&self, states: &mut [StateOf<M, P>], forces: &mut Forces<'_>) {
        for (contact, begun) in &self.waiting {
            forces.set(*contact, &end(&self.model, &mut states[*contact], begun));
        }
    }

    /// Ends eight steps at once, unless one of them gives what is no number: then nothing has changed.
    #[inline(never)]
    fn end_together<const P: usize>(
        &self,
        all: &[(usize, Begun<'a, M, f32>); LANES],
        states: &mut [StateOf<M, P>],
        forces: &mut Forces<'_>,
    ) -> bool {
        let model = ModelOf { data: &self.data, scale: self.scale };
        let of = |number: fn(&Begun<'a, M, f32>) -> f32| Lanes::each(|k| number(&all[k].1));
        let both = |number: fn(&Begun<'a, M, f32>) -> [f32; 2]| [0, 1].map(|i| Lanes::each(|k| number(&all[k].1)[i]));
        let place =
            |number: fn(&Begun<'a, M, f32>) -> [f32; 3]| [0, 1, 2].map(|i| Lanes::each(|k| number(&all[k].1)[i]));
        let row = side_by_side(from_fn(|k| all[k].1.at.row));
        let at = AtDepth {
            row: &row,
            t: of(|b| b.at.t),
            depth: of(|b| b.at.depth),
            area: of(|b| b.at.area),
            radius: of(|b| b.at.radius),
            growth: of(|b| b.at.growth),
            limit: of(|b| b.at.limit),
            stiffness: both(|b| b.at.stiffness),
            stiffness_slope: both(|b| b.at.stiffness_slope),
            press_coupling: both(|b| b.at.press_coupling),
            press_slide: both(|b| b.at.press_slide),
        };
        let mut anchor: [[[Lanes; 2]; P]; M] =
            from_fn(|j| from_fn(|p| from_fn(|i| Lanes::each(|k| states[all[k].0].anchor[j][p][i]))));
        let load = carry(&model, &mut anchor, &at, place(|b| b.here), &Way(place(|b| b.way.0)));
        if !(load.normal + load.friction[1]).are_numbers() {
            return false;
        }
        let answer = answer::<M, 0, P, Lanes, _>(&model, &at, &load);
        let anchor = anchor.map(|pair| pair.map(|place| place.map(|mm| mm.0.to_array())));
        let numbers = [
            answer.normal_force_n,
            answer.friction_n[0],
            answer.friction_n[1],
            answer.spin_moment_n_mm,
            answer.slip_margin,
            answer.stick_ratio,
        ];
        let numbers = numbers.map(|number| number.0.to_array());
        for (k, (contact, begun)) in all.iter().enumerate() {
            let [normal_force_n, friction_x_n, friction_y_n, spin_moment_n_mm, slip_margin, stick_ratio] =
                numbers.map(|number| number[k]);
            states[*contact].anchor = from_fn(|j| from_fn(|p| from_fn(|i| anchor[j][p][i][k])));
            forces.set(
                *contact,
                &Response {
                    normal_force_n,
                    friction_n: [friction_x_n, friction_y_n],
                    spin_moment_n_mm,
                    slip_margin,
                    stick_ratio,
                    regime: regime_of(stick_ratio),
                    status: begun.status.with(self.model.scale.status()),
                    ..Response::IN_THE_AIR
                },
            );
        }
        true
    }
}

/// Eight rows as one row of lanes.
#[inline(always)]
fn side_by_side<const M: usize>(rows: [&Row<M>; LANES]) -> Row<M, Lanes> {
    let rows: [&[f32]; LANES] = rows.map(|row| bytemuck::cast_slice(core::slice::from_ref(row)));
    let mut together = Row::<M, Lanes>::zeroed();
    let numbers: &mut [Lanes] = bytemuck::cast_slice_mut(core::slice::from_mut(&mut together));
    let mut eights = numbers.chunks_exact_mut(LANES);
    let mut first = 0;
    for eight in &mut eights {
        let columns = f32x8::transpose(rows.map(|row| f32x8::from(&row[first..first + LANES])));
        for (to, column) in eight.iter_mut().zip(columns) {
            *to = Lanes(column);
        }
        first += LANES;
    }
    for (i, to) in eights.into_remainder().iter_mut().enumerate() {
        *to = Lanes::each(|k| rows[k][first + i]);
    }
    together
}
