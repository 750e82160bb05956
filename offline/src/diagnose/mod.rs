//! Where simulation and measurement disagree, which effect is missing, and how much closer the model comes with it.
//!
//! Main types: [`RunSet`] (measured runs), [`laws::Law`] (the library), [`Diagnosis`] (the verdict with its evidence).
//! The statistical unit is the run; effects are inserted into the model, never added to a force.
//! May use: `fingerpad` (model files) and nalgebra. Reads no files.

mod base;
mod calibrate;
mod error;
mod fit;
pub mod laws;
mod mixed;
mod runs;
mod walk;

pub use error::DiagnoseError;
pub use runs::{Labels, RawRow, Run, RunSet, run_of};
pub use base::{FREEDOM, Reference};
pub use calibrate::{Calibration, calibrate};
mod chance;
mod scan;
mod select;
mod space;

/// dev
pub fn dev(calibration: &RunSet, measured: &RunSet) -> String {
    use std::fmt::Write;
    let mut out = String::new();
    let reference = Reference::of(&fingerpad::Params::example().try_build().unwrap(), false);
    let t = std::time::Instant::now();
    let c = calibrate(calibration, &reference);
    let _ = write!(out, "cal {:.2}s misfit {:.2?} noise {:.4}/{:.3} {:.4}/{:.3} v {:.4?}", t.elapsed().as_secs_f64(), c.misfit, c.noise[0].additive_n, c.noise[0].multiplicative, c.noise[1].additive_n, c.noise[1].multiplicative, c.fit.variances.map(f64::sqrt));
    let base = reference.with(&c.fit.theta);
    let prediction = walk::walk_all(&base, &[], walk::Nudge::default(), &measured.runs);
    let mut task = fit::Task::new(&measured.runs, &reference, c.prior(), calibrate::sigma_of(&c.noise, &prediction), c.fit.variances);
    task.variance_weight = 4.0;
    let s = select::select(&task, measured, &select::Settings::default());
    let _ = write!(out, "\n    => v0 {:.4?} v {:.4?}", s.null.variances.map(f64::sqrt), s.fit.variances.map(f64::sqrt));
    for (a, e) in s.fit.laws.iter().zip(&s.evidence) {
        let _ = write!(out, "\n    ** {} {:.4?} gain {:.1} pm {:.1e} pr {:.3}", a.law.name, (a.law.report)(&a.values), e.gain_2ll, e.p_model, e.p_runs);
    }
    let mut t: Vec<_> = s.tests.iter().collect();
    t.sort_by(|a, b| b.gain_2ll.total_cmp(&a.gain_2ll));
    let _ = write!(out, "\n    ");
    for t in t.iter().take(5) { let _ = write!(out, "{} {:.1} ({:.3}) ", t.law.name, t.gain_2ll, t.p_runs); }
    out
}
