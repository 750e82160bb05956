//! A smooth Iwan model of fingertip friction over depth, differentiable by perturbation, which the diagnosis uses for
//! inference.
//!
//! Ten elasto-slip elements in parallel [Iwan 1967] carry the friction; normal force, strength and tangential stiffness
//! are a power of the depth times an exponential instead of tables, everything is f64 and infinitely smooth in its 31 parameters
//! between yields, so that differences of predictions are derivatives. It is simpler than `fingerpad`'s own step: its elements
//! change their stiffness with depth, whereas the core's springs engage progressively, the normal force follows
//! friction by shares instead of by the energy, and there is no stick ratio. Fits need some thousand predictions, for
//! which eight runs are simulated at once.
//!
//! The difference to the core's step is measured by `tests/difference_from_core.rs` (the shipped model, presses to 0.4 to
//! 1.9 mm, slides of 3 mm in eight directions, with a reversal each). Over all samples in contact, root mean square and largest,
//! the normal force against its own maximum, friction against the strength at its depth:
//!
//! | | normal force | friction |
//! |---|---|---|
//! | [`export_to_core`] of the model, against the model | 0.09 %, 0.6 % | 1.8 %, 9.0 % |
//! | the model at the file's own [`ReferenceCurves::mean`], against the file | 0.85 %, 3.9 % | 2.3 %, 6.8 % |
//!
//! The largest differences of friction lie in the onset of sliding, where the core has four springs and the smooth
//! model ten elements. A diagnosis fits the parameters to measured runs, so the second line is its starting point.
//!
//! Main types: [`ReferenceCurves`] (a model file's curves), [`Parameters`], [`SmoothModel`], [`SimulationInputs`]; main
//! functions: [`simulate`], [`export_to_core`], [`replay_stroke`]. May use: `fingerpad` (model files and their step).

mod core_export;
mod core_replay;
mod model;
mod parameter;
mod reference;
mod simulation;
mod trajectory;

pub use core_export::{CoreExport, export_to_core};
pub use core_replay::replay_stroke;
pub use model::{DepthValues, ELEMENTS, MIDDLE_MM, SmoothModel, U_RANGE};
pub use parameter::{Parameter, ParameterInfo, Parameters};
pub use reference::ReferenceCurves;
pub use simulation::{ElementHistory, SimulationInputs};
pub use trajectory::{LANES, Sample, Stroke, Trajectories};

/// Change of the model at one sample by effects, random effects and perturbations; `default` changes nothing.
pub type ModelChange = fingerpad::effects::Change<f64>;

/// Readings of the model alone along strokes, three a sample, N: normal, x, y.
pub fn simulate(model: &SmoothModel, strokes: &[Stroke]) -> Vec<f64> {
    let samples = strokes.iter().map(|s| s.samples.len()).sum();
    SimulationInputs::new(&Trajectories::new(strokes.to_vec()), vec![ModelChange::default(); samples]).predict_n(model)
}
