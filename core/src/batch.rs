//! Many contacts of one model in one call, numbers of a kind side by side.
//!
//! Main types: [`Motions`], [`Forces`]. Uses step.

use crate::math::Scalar;
use crate::rescaling::Scaling;
use crate::{ModelOf, Motion, Regime, StateOf, Status, step};

/// Motions of many contacts, each slice as long as there are contacts; see [`Motion`].
#[derive(Clone, Copy, Debug)]
pub struct Motions<'a, T = f32> {
    /// Depths at the end of the step, mm.
    pub depth_mm: &'a [T],
    /// Slides along x during the step, mm.
    pub slide_x_mm: &'a [T],
    /// Slides along y, mm.
    pub slide_y_mm: &'a [T],
    /// Turns about the normal, rad; empty for none.
    pub spin_rad: &'a [T],
    /// Length of the step, s, the same for all.
    pub dt_s: T,
}

/// What many contacts answer, each slice as long as there are contacts; see [`crate::Response`].
#[derive(Debug)]
pub struct Forces<'a, T = f32> {
    /// Normal forces, N.
    pub normal_force_n: &'a mut [T],
    /// Friction along x, N.
    pub friction_x_n: &'a mut [T],
    /// Friction along y, N.
    pub friction_y_n: &'a mut [T],
    /// Moments about the normal, N mm.
    pub spin_moment_n_mm: &'a mut [T],
    /// Slip margins.
    pub slip_margin: &'a mut [T],
    /// Stick ratios.
    pub stick_ratio: &'a mut [T],
    /// Regimes.
    pub regime: &'a mut [Regime],
    /// Remarks.
    pub status: &'a mut [Status],
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

impl<const M: usize, const N: usize, T: Scalar, S: Scaling<T>> ModelOf<'_, M, N, S, T> {
    /// Advances many contacts by one step each: the same bits as [`step()`] one by one. To use several cores, divide the
    /// slices.
    ///
    /// Errors: [`BatchLength`], before any contact moves.
    pub fn step_batch<const P: usize>(
        &self,
        states: &mut [StateOf<M, P, T>],
        motions: Motions<'_, T>,
        forces: &mut Forces<'_, T>,
    ) -> Result<(), BatchLength> {
        let expected = states.len();
        let Motions { depth_mm, slide_x_mm, slide_y_mm, spin_rad, dt_s } = motions;
        let lengths = [
            depth_mm.len(),
            slide_x_mm.len(),
            slide_y_mm.len(),
            if spin_rad.is_empty() { expected } else { spin_rad.len() },
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
            let motion = Motion {
                depth_mm: depth_mm[i],
                slide_increment_mm: [slide_x_mm[i], slide_y_mm[i]],
                spin_increment_rad: spin_rad.get(i).copied().unwrap_or_default(),
                dt_s,
            };
            let r = step(self, state, motion);
            forces.normal_force_n[i] = r.normal_force_n;
            [forces.friction_x_n[i], forces.friction_y_n[i]] = r.friction_n;
            forces.spin_moment_n_mm[i] = r.spin_moment_n_mm;
            forces.slip_margin[i] = r.slip_margin;
            forces.stick_ratio[i] = r.stick_ratio;
            forces.regime[i] = r.regime;
            forces.status[i] = r.status;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Params, State};

    /// A batch gives the bits of steps one by one; slices of another length are refused and nothing moves.
    #[test]
    fn a_batch_is_its_contacts_one_by_one() {
        const COUNT: usize = 64;
        let data = Params::example().try_build().unwrap();
        let model = data.model().unwrap();
        let mut states = [State::default(); COUNT];
        let mut alone = states;
        let (mut numbers, mut regime, mut status) =
            ([[0.0f32; COUNT]; 6], [Regime::NoContact; COUNT], [Status::OK; COUNT]);
        for k in 0..200 {
            let depth: [f32; COUNT] = core::array::from_fn(|i| 0.03 * i as f32 + if k % 7 < 3 { 0.01 } else { 0.0 });
            let x: [f32; COUNT] = core::array::from_fn(|i| if (k + i) % 50 < 30 { 0.02 } else { -0.03 });
            let y = [0.004; COUNT];
            let motions = Motions { depth_mm: &depth, slide_x_mm: &x, slide_y_mm: &y, spin_rad: &[], dt_s: 1e-3 };
            let [normal, fx, fy, moment, margin, stick] = &mut numbers;
            let mut forces = Forces {
                normal_force_n: normal,
                friction_x_n: fx,
                friction_y_n: fy,
                spin_moment_n_mm: moment,
                slip_margin: margin,
                stick_ratio: stick,
                regime: &mut regime,
                status: &mut status,
            };
            let short = Motions { slide_x_mm: &x[1..], ..motions };
            let refused = model.step_batch(&mut states, short, &mut forces);
            assert_eq!(refused, Err(BatchLength { expected: COUNT, found: COUNT - 1 }));
            model.step_batch(&mut states, motions, &mut forces).unwrap();
            for i in 0..COUNT {
                let slide_increment_mm = [x[i], y[i]];
                let motion = Motion { depth_mm: depth[i], slide_increment_mm, spin_increment_rad: 0.0, dt_s: 1e-3 };
                let r = step(&model, &mut alone[i], motion);
                let found = numbers.map(|n| n[i]);
                let [fx, fy] = r.friction_n;
                assert_eq!(found, [r.normal_force_n, fx, fy, r.spin_moment_n_mm, r.slip_margin, r.stick_ratio]);
                assert_eq!((regime[i], status[i]), (r.regime, r.status));
            }
        }
        assert_eq!(states, alone);
    }
}
