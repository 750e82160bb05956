//! Reduction of finite-element responses to the reduced model that runs on a microcontroller.
//!
//! [`design`] lists the paths ([`Experiment`]) that the finite elements are run along, [`share`] divides them; each response is stored as a
//! [`Run`]. [`reduce`] fits the model's parameters to the runs that are not held out, replays every run through the
//! package `fingerpad` itself, and returns a [`Reduced`] model with its error band, [`Scores`] and the bytes of its
//! model file. [`simulate_path`] runs a finished model along any path, [`export`] writes it as source text, [`LimitSurface`] holds
//! its friction in full slip, [`MujocoContact`], [`NewtonContact`] and [`DrakeContact`] the contact of an engine's own nearest to a pad, [`retuned_bed`] and [`retuned_pad`] make the model file of another finger.
//! May use: the packages fe (paths, responses, settings), least-squares and `fingerpad`.

mod agreement;
mod band;
mod curve;
mod design;
pub mod engine_contact;
mod error;
mod export;
mod fit;
mod full_slip;
mod initial_guess;
pub mod limit_surface;
mod model;
pub mod pad;
mod parameterisation;
mod progress;
mod replay;
mod residuals;
mod retune;
mod runs;
mod score;
mod spin_limit;
mod stored_run;
mod tables;
mod trajectory;
mod verdict;

pub use agreement::{Agreement, Difference, agreement};
pub use band::{Band, Coverage};
pub use curve::{CurvePoint, curve};
pub use design::{
    Batch, DesignSettings, Experiment, Kind, PathNumbers, Tip, batches, design, halton, is_representable, outline,
    share,
};
pub use engine_contact::{DrakeContact, EngineContactError, MujocoContact, NewtonContact};
pub use error::ReduceError;
pub use export::{Format, export};
pub use fit::{Fitted, Settings, fit};
pub use limit_surface::{LimitPoint, LimitSurface, LimitSurfaceError, limit_points_of_bed, limit_points_of_pad};
pub use model::{KindScores, Meta, Ranges, Reduced, reduce};
pub use progress::{FitProgress, FitStage};
pub use replay::{STEP_MM, STEP_RAD, pressure_centre, replay, replay_steps, spin_moment};
pub use retune::{is_retuned, retuned_bed, retuned_pad};
pub use runs::{Run, Sample, Turned, settings_hash};
pub use score::{RunScore, Scores, score, score_run, strength};
pub use spin_limit::{FullSlip, SpinLimit, in_full_slip};
pub use trajectory::{
    PathError, TrajectoryRow, check_path, simulate_path, simulate_path_with_effects, steps_between_rows,
};
pub use verdict::{COLUMNS, Errors, GOOD, Grade, Group, Verdict};
