//! Many contacts of one model in one call, numbers of a kind side by side.
//!
//! Main types: [`Motions`], [`Forces`]. Uses step.

use crate::memory::Memory;
use crate::{ModelOf, Motion, Regime, Response, StateOf, Status};

/// Motions of many contacts, one element per contact in each slice; see [`Motion`].
#[derive(Clone, Copy, Debug)]
pub struct Motions<'a> {
    /// Depths at the end of the step, mm.
    pub depth_mm: &'a [f32],
    /// Slides along x during the step, mm.
    pub slide_x_mm: &'a [f32],
    /// Slides along y, mm.
    pub slide_y_mm: &'a [f32],
    /// Turns about the normal, rad; empty for none.
    pub spin_rad: &'a [f32],
    /// Length of the step, s, the same for all.
    pub dt_s: f32,
}

/// Responses of many contacts, one element per contact in each slice; see [`crate::Response`].
#[derive(Debug)]
pub struct Forces<'a> {
    /// Normal forces, N.
    pub normal_force_n: &'a mut [f32],
    /// Friction along x, N.
    pub friction_x_n: &'a mut [f32],
    /// Friction along y, N.
    pub friction_y_n: &'a mut [f32],
    /// Moments about the normal, N mm.
    pub spin_moment_n_mm: &'a mut [f32],
    /// Slip margins; 0 without contact.
    pub slip_margin: &'a mut [f32],
    /// Stick ratios.
    pub stick_ratio: &'a mut [f32],
    /// Regimes.
    pub regime: &'a mut [Regime],
    /// Flags.
    pub status: &'a mut [Status],
}

impl<'a> Forces<'a> {
    /// From slices for normal force, friction along x and y, moment, slip margin and stick ratio, in this order.
    pub fn of(numbers: [&'a mut [f32]; 6], regime: &'a mut [Regime], status: &'a mut [Status]) -> Self {
        let [normal_force_n, friction_x_n, friction_y_n, spin_moment_n_mm, slip_margin, stick_ratio] = numbers;
        Self { normal_force_n, friction_x_n, friction_y_n, spin_moment_n_mm, slip_margin, stick_ratio, regime, status }
    }
}

/// Slices of a batch are of different length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BatchLength {
    /// Number of states.
    pub expected: usize,
    /// Length of the first slice that differs.
    pub found: usize,
}

impl core::fmt::Display for BatchLength {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "a slice of {} numbers for {} contacts", self.found, self.expected)
    }
}

impl core::error::Error for BatchLength {}

impl Motions<'_> {
    /// The motion of one contact.
    #[inline(always)]
    fn of(&self, i: usize) -> Motion {
        Motion {
            depth_mm: self.depth_mm[i],
            slide_increment_mm: [self.slide_x_mm[i], self.slide_y_mm[i]],
            spin_increment_rad: self.spin_rad.get(i).copied().unwrap_or_default(),
            dt_s: self.dt_s,
        }
    }
}

impl Forces<'_> {
    /// Stores the response of one contact.
    #[inline(always)]
    pub(crate) fn set(&mut self, i: usize, r: &Response) {
        self.normal_force_n[i] = r.normal_force_n;
        [self.friction_x_n[i], self.friction_y_n[i]] = r.friction_n;
        self.spin_moment_n_mm[i] = r.spin_moment_n_mm;
        self.slip_margin[i] = r.slip_margin;
        self.stick_ratio[i] = r.stick_ratio;
        self.regime[i] = r.regime;
        self.status[i] = r.status;
    }
}

impl<const M: usize, const N: usize> ModelOf<'_, M, N> {
    /// Advances many contacts by one step each: the same bits as [`crate::step()`] one by one. To use several cores, divide
    /// the slices.
    ///
    /// # Errors
    /// [`BatchLength`], before any contact moves.
    pub fn step_batch<const P: usize, R: Memory<M, P, f32>>(
        &self,
        states: &mut [StateOf<M, P, f32, R>],
        motions: Motions<'_>,
        forces: &mut Forces<'_>,
    ) -> Result<(), BatchLength> {
        let expected = states.len();
        let spins = if motions.spin_rad.is_empty() { expected } else { motions.spin_rad.len() };
        let lengths = [
            motions.depth_mm.len(),
            motions.slide_x_mm.len(),
            motions.slide_y_mm.len(),
            spins,
            forces.normal_force_n.len(),
            forces.friction_x_n.len(),
            forces.friction_y_n.len(),
            forces.spin_moment_n_mm.len(),
            forces.slip_margin.len(),
            forces.stick_ratio.len(),
            forces.regime.len(),
            forces.status.len(),
        ];
        if let Some(&found) = lengths.iter().find(|&&length| length != expected) {
            return Err(BatchLength { expected, found });
        }
        for (i, state) in states.iter_mut().enumerate() {
            forces.set(i, &self.step(state, motions.of(i)));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::Params;
    use crate::{State, step};

    /// A state with a value that is not a number is reset, as in a single step; the contacts beside it are unaffected.
    #[test]
    fn a_broken_memory_stays_alone() {
        const COUNT: usize = 19;
        let data = Params::example().try_build().unwrap();
        let model = data.model().unwrap();
        let mut alone = [State::default(); COUNT];
        for state in &mut alone {
            model.step(state, Motion { depth_mm: 1.0, dt_s: 1e-3, ..Motion::default() });
        }
        alone[5].forces.anchor[1][0][1] = f32::NAN;
        alone[17].forces.anchor[3][0][0] = f32::INFINITY;
        let mut together = alone;
        let (mut numbers, mut regime, mut status) =
            ([[0.0f32; COUNT]; 6], [Regime::NoContact; COUNT], [Status::OK; COUNT]);
        let mut forces = Forces::of(numbers.each_mut().map(|of_kind| &mut of_kind[..]), &mut regime, &mut status);
        let (depth, x, y) = ([1.1; COUNT], [0.02; COUNT], [-0.01; COUNT]);
        let motions = Motions { depth_mm: &depth, slide_x_mm: &x, slide_y_mm: &y, spin_rad: &[], dt_s: 1e-3 };
        model.step_batch(&mut together, motions, &mut forces).unwrap();
        for i in 0..COUNT {
            let motion =
                Motion { depth_mm: depth[i], slide_increment_mm: [x[i], y[i]], dt_s: 1e-3, ..Motion::default() };
            let r = step(&model, &mut alone[i], motion);
            assert_eq!((numbers[0][i], numbers[1][i], status[i]), (r.normal_force_n, r.friction_n[0], r.status), "{i}");
            assert_eq!(status[i].contains(Status::MEMORY_LOST), i == 5 || i == 17, "{i}");
            assert_eq!(together[i], alone[i], "{i}");
        }
    }
}
