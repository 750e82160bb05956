//! Eight contacts side by side, in the vector registers of a host.
//!
//! Main types: [`Lanes`], [`LaneBatch`]. Uses step, table and math.

use core::array::from_fn;
use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use bytemuck::{Pod, Zeroable};
use wide::{f32x8, i32x8};

use crate::at_depth::AtDepth;
use crate::math::{Arithmetic, sealed::Sealed};
use crate::rescaling::SimdScaling;
use crate::springs::{check_sum, step_springs};
use crate::step::{StepInput, finish, response_of};
use crate::stick_ratio::{SlipPath, regime_of};
use crate::table::Row;
use crate::{DataOf, Forces, ModelOf, StateOf, Status};

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
        // Without a branch: some of eight nearly always slip, and which springs do cannot be foretold.
        let above = self.0.simd_gt(f32x8::ZERO);
        for (place, to) in places.into_iter().zip(to()) {
            place.0 = above.select(to.0, place.0);
        }
    }
}

/// Numbers of a step's input that [`LaneBatch`] keeps side by side.
const NUMBERS: usize = 14;

/// Inputs of up to eight steps, which wait until their springs move together.
pub(crate) struct LaneBatch<'a, const M: usize, const N: usize, S: SimdScaling> {
    model: ModelOf<'a, M, N, S>,
    scale: S::InLanes,
    data: DataOf<M, 0, Lanes>,
    count: usize,
    contact: [usize; LANES],
    row: [&'a Row<M>; LANES],
    status: [Status; LANES],
    numbers: [[f32; LANES]; NUMBERS],
}

impl<'a, const M: usize, const N: usize, S: SimdScaling> LaneBatch<'a, M, N, S> {
    pub(crate) fn new(model: &ModelOf<'a, M, N, S>) -> Self {
        Self {
            model: *model,
            scale: model.scale.in_lanes(),
            data: model.data.with_rows([]),
            count: 0,
            contact: [0; LANES],
            row: [&model.data.rows[0]; LANES],
            status: [Status::OK; LANES],
            numbers: [[0.0; LANES]; NUMBERS],
        }
    }

    /// Stores the input of a step of the state number `contact`; with the eighth, all move.
    #[inline(always)]
    pub(crate) fn push<const P: usize>(
        &mut self,
        contact: usize,
        input: StepInput<'a, M, f32>,
        states: &mut [StateOf<M, P>],
        forces: &mut Forces<'_>,
    ) {
        let k = self.count % LANES;
        (self.contact[k], self.row[k], self.status[k]) = (contact, input.at.row, input.status);
        for (numbers, number) in self.numbers.iter_mut().zip(numbers_of(&input)) {
            numbers[k] = number;
        }
        self.count = k + 1;
        if self.count == LANES {
            if !self.end_together(states, forces) {
                self.end_each(states, forces);
            }
            self.count = 0;
        }
    }

    /// Ends the waiting steps one by one.
    #[inline(never)]
    pub(crate) fn end_each<const P: usize>(&self, states: &mut [StateOf<M, P>], forces: &mut Forces<'_>) {
        for (k, &contact) in self.contact.iter().enumerate().take(self.count) {
            let input = input_of(self.row[k], self.status[k], self.numbers.map(|numbers| numbers[k]));
            forces.set(contact, &finish(&self.model, &mut states[contact], &input));
        }
    }

    /// Ends eight steps at once, unless one of them gives a value that is not a number; nothing has changed then.
    #[inline(never)]
    fn end_together<const P: usize>(&self, states: &mut [StateOf<M, P>], forces: &mut Forces<'_>) -> bool {
        let model = ModelOf { data: &self.data, scale: self.scale };
        let mut row = Row::<M, Lanes>::zeroed();
        let rows = self.row.map(|row| bytemuck::cast_slice(core::slice::from_ref(row)));
        side_by_side(rows, bytemuck::cast_slice_mut(core::slice::from_mut(&mut row)));
        let input = input_of(&row, Status::OK, self.numbers.map(|numbers| Lanes(f32x8::new(numbers))));
        let mut anchor = [[[Lanes::of(0.0); 2]; P]; M];
        let anchors = self.contact.map(|contact| states[contact].anchor.as_flattened().as_flattened());
        side_by_side(anchors, anchor.as_flattened_mut().as_flattened_mut());

        let load = step_springs(&model, &mut anchor, &input.at, input.here, &input.slip_path);
        if !check_sum::<P, Lanes>(&load, &input.slip_path).are_numbers() {
            return false;
        }
        // A batch returns no bands.
        let response = response_of::<M, 0, P, Lanes, _>(&model, &input.at, &load);
        let [friction_x, friction_y] = response.friction_n;
        let numbers =
            [response.normal_force_n, friction_x, friction_y, response.spin_moment_n_mm, response.slip_margin];
        let [normal, friction_x, friction_y, moment, margin] = numbers.map(|number| number.0.to_array());
        let stick_ratio = response.stick_ratio.0.to_array();
        for (k, &contact) in self.contact.iter().enumerate() {
            forces.normal_force_n[contact] = normal[k];
            forces.friction_x_n[contact] = friction_x[k];
            forces.friction_y_n[contact] = friction_y[k];
            forces.spin_moment_n_mm[contact] = moment[k];
            forces.slip_margin[contact] = margin[k];
            forces.stick_ratio[contact] = stick_ratio[k];
            forces.regime[contact] = regime_of(stick_ratio[k]);
            forces.status[contact] = self.status[k];
        }
        apart(anchor.as_flattened().as_flattened(), |k, first, numbers| {
            let anchor = states[self.contact[k]].anchor.as_flattened_mut().as_flattened_mut();
            anchor[first..first + numbers.len()].copy_from_slice(numbers);
        });
        true
    }
}

/// Numbers of the input on which the rest of the step depends.
#[inline(always)]
fn numbers_of<const M: usize>(input: &StepInput<'_, M, f32>) -> [f32; NUMBERS] {
    let StepInput { at, here, slip_path, .. } = input;
    let ([kx, ky], [x, y, z], SlipPath([a, b, c])) = (at.stiffness, *here, slip_path);
    [at.t, at.cells, at.depth, at.radius, at.growth, at.limit, kx, ky, x, y, z, *a, *b, *c]
}

/// The step of these numbers.
#[inline(always)]
fn input_of<T: Arithmetic, const M: usize>(row: &Row<M, T>, status: Status, of: [T; NUMBERS]) -> StepInput<'_, M, T> {
    let [t, cells, depth, radius, growth, limit, kx, ky, x, y, z, a, b, c] = of;
    let at = AtDepth { row, t, cells, depth, radius, growth, limit, stiffness: [kx, ky] };
    StepInput { at, here: [x, y, z], slip_path: SlipPath([a, b, c]), status }
}

/// Numbers of eight contacts, brought side by side.
#[inline(always)]
fn side_by_side(of: [&[f32]; LANES], to: &mut [Lanes]) {
    let mut eights = to.chunks_exact_mut(LANES);
    let mut first = 0;
    for eight in &mut eights {
        let columns = f32x8::transpose(of.map(|numbers| f32x8::from(&numbers[first..first + LANES])));
        for (to, column) in eight.iter_mut().zip(columns) {
            *to = Lanes(column);
        }
        first += LANES;
    }
    for (i, to) in eights.into_remainder().iter_mut().enumerate() {
        *to = Lanes::each(|k| of[k][first + i]);
    }
}

/// Passes numbers that lie side by side to `pass`, contact by contact: the contact, the index of the first number, the numbers.
#[inline(always)]
fn apart(of: &[Lanes], mut pass: impl FnMut(usize, usize, &[f32])) {
    for (i, eight) in of.chunks(LANES).enumerate() {
        let mut columns = [f32x8::ZERO; LANES];
        for (column, lanes) in columns.iter_mut().zip(eight) {
            *column = lanes.0;
        }
        for (k, numbers) in f32x8::transpose(columns).iter().enumerate() {
            pass(k, LANES * i, &numbers.as_array()[..eight.len()]);
        }
    }
}
