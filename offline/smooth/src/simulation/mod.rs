//! Forward simulation of the smooth model along all runs.
//!
//! Main types: [`SimulationInputs`] (parts of a prediction that do not depend on the model's parameters, computed
//! once), [`ElementHistory`] (the elements' state along the runs). Logarithms and exponentials are those of `wide`,
//! within 3e-16 of the standard ones (`tests::curves`).

mod elements;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use wide::f64x8;

use fingerpad::effects::REFERENCE_AREA_MM2;

use crate::ModelChange;
use crate::model::{ODD_SHAPE, SmoothModel};
use crate::parameter::Parameter;
use crate::trajectory::{BatchedSample, BatchedTrajectory, LANES, Stroke, Substep, Trajectories};
use elements::ElementState;

/// Parts of a prediction that do not depend on the model's parameters: the trajectory, and the changes of the model at
/// each sample.
pub struct SimulationInputs {
    trajectory: Arc<BatchedTrajectory>,
    changes: Vec<ModelChange>,
    /// Factors on strength and stiffness at each batched sample.
    factors: Vec<[f64x8; 2]>,
    /// Whether any change adds to the readings beside the model.
    acts_on_readings: bool,
    /// Number of samples and low-pass of each stroke.
    low_passes: Arc<[(usize, Vec<[f64; 2]>)]>,
}

/// State of the elements at each batched sample: their mean force along x and y over the strength, and the strength, N.
pub struct ElementHistory(Vec<[f64x8; 3]>);

impl SimulationInputs {
    /// Inputs for motions on which these changes act, one a sample, stroke by stroke.
    pub fn new(trajectories: &Trajectories, changes: Vec<ModelChange>) -> Self {
        let trajectory = trajectories.under(&changes);
        let at = |place: Option<u32>| {
            place.map_or((1.0, 1.0), |place| {
                let change = &changes[place as usize];
                (change.strength, change.stiffness)
            })
        };
        let lanes = |sample: &BatchedSample| {
            let pairs = sample.place.map(at);
            [f64x8::new(pairs.map(|p| p.0)), f64x8::new(pairs.map(|p| p.1))]
        };
        let factors = trajectory.samples.iter().map(lanes).collect();
        let acts_on_readings = changes.iter().any(ModelChange::reads);
        Self { trajectory, changes, factors, acts_on_readings, low_passes: trajectories.low_passes() }
    }

    /// Whether a parameter moves the elements; the others act on the readings alone, and a history can be used again.
    pub fn history_depends_on(&self, parameter: Parameter) -> bool {
        match parameter {
            Parameter::LoadExponent => self.changes.iter().any(|c| c.stiffness != 1.0),
            other => !other.acts_on_readings_only(),
        }
    }

    /// The elements along all runs.
    pub fn element_history(&self, model: &SmoothModel) -> ElementHistory {
        let mut out = Vec::with_capacity(self.trajectory.samples.len());
        let elements = model.elements.map(|e| e.map(f64x8::splat));
        for batch in self.trajectory.batches.windows(2) {
            let mut state = ElementState::IN_AIR;
            let samples = batch[0]..batch[1];
            for (sample, factors) in self.trajectory.samples[samples.clone()].iter().zip(&self.factors[samples]) {
                let substeps = &self.trajectory.substeps[sample.substeps.clone()];
                let Some(last) = substeps.last() else {
                    out.push([f64x8::ZERO; 3]);
                    continue;
                };
                let [mut strength, stiffness] = *factors;
                strength *= elements::direction_factor(model, &last.depth, &sample.heading);
                if stiffness != f64x8::ONE {
                    strength *= (stiffness.ln() * f64x8::splat(model.load_exponent)).exp();
                }
                let mut was_in_contact = sample.was_in_contact;
                for substep in substeps {
                    state.advance(model, &elements, substep, sample.slide_mm, (strength, stiffness), was_in_contact);
                    was_in_contact = f64x8::ONE;
                }
                let [x, y] = state.mean_force(&elements);
                out.push([x, y, state.strength_n]);
            }
        }
        ElementHistory(out)
    }

    /// Readings along a history that these inputs gave, three a sample, N: normal, x, y.
    pub fn readings_n(&self, model: &SmoothModel, history: &ElementHistory) -> Vec<f64> {
        let mut out = vec![0.0; 3 * self.trajectory.rows];
        let splat = |v: [f64; 2]| v.map(f64x8::splat);
        let (shear, per_friction) = (splat(model.normal_shear), splat(model.normal_per_friction));
        for ((sample, [mx, my, limit]), factors) in self.trajectory.samples.iter().zip(&history.0).zip(&self.factors) {
            let (mut elastic, mut force, mut depth_mm) = ([0.0; LANES], [[0.0; LANES]; 2], [0.0; LANES]);
            if let Some(Substep { depth, .. }) = self.trajectory.substeps[sample.substeps.clone()].last() {
                let xx = *mx * *mx;
                let odd = f64x8::splat(model.odd_x_per_mm) * depth.mm * (xx - f64x8::splat(ODD_SHAPE) * xx * xx);
                let (fx, fy) = (*limit * (*mx - odd), *limit * *my);
                let normal = depth.curve(&model.ln_normal).exp() * factors[1];
                let sheared = f64x8::ONE + shear[0] * xx + shear[1] * *my * *my;
                elastic = (normal * sheared + per_friction[0] * fx + per_friction[1] * fy).to_array();
                (force, depth_mm) = ([fx.to_array(), fy.to_array()], depth.mm.to_array());
            }
            for (l, place) in sample.place.iter().enumerate() {
                let Some(place) = place.map(|p| p as usize) else { continue };
                let forces = [elastic[l], force[0][l], force[1][l]];
                let reading = self.sensor_reading_n(model, sample, l, place, forces, depth_mm[l]);
                out[3 * place..3 * place + 3].copy_from_slice(&reading);
            }
        }
        let mut left = &mut out[..];
        for (samples, shares) in self.low_passes.iter() {
            let own = left.split_off_mut(..3 * samples).expect("three readings a sample");
            Stroke::filter(shares, own);
        }
        out
    }

    /// Reading of one lane, N: the contact's forces, with the changes that act on the sensor.
    fn sensor_reading_n(
        &self,
        model: &SmoothModel,
        sample: &BatchedSample,
        lane: usize,
        place: usize,
        forces_n: [f64; 3],
        depth_mm: f64,
    ) -> [f64; 3] {
        if !self.acts_on_readings {
            return if sample.in_contact[lane] { forces_n } else { [0.0; 3] };
        }
        let change = &self.changes[place];
        let mut force_n = [0.0; 3];
        if sample.in_contact[lane] {
            let (mut normal, mut drag) = (forces_n[0], 0.0);
            if change.adhesion_n != 0.0 || change.drag_n != 0.0 {
                let area = model.at_depth(depth_mm).area_mm2 / REFERENCE_AREA_MM2;
                normal -= change.adhesion_n * area.sqrt();
                drag = change.drag_n * area;
            }
            force_n[0] = normal;
            for k in 1..3 {
                force_n[k] = forces_n[k] + drag * sample.heading[1 + k].as_array()[lane];
            }
        }
        change.reading(force_n)
    }

    /// Predicted readings, three a sample, N: normal, x, y.
    pub fn predict_n(&self, model: &SmoothModel) -> Vec<f64> {
        self.readings_n(model, &self.element_history(model))
    }
}
