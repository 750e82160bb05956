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
pub use runs::{Labels, RawRow, Run, RunSet, recorded, run_of};
pub use base::{FREEDOM, Reference};
pub use calibrate::{Calibration, calibrate};
mod chance;
mod check;
mod covariates;
mod verdict;
mod omnibus;
mod rivals;
mod scan;
mod select;
mod space;

/// dev
pub fn dev(calibration: &RunSet, measured: &RunSet) -> (Verdict, Vec<Vec<&'static str>>, Vec<Vec<f64>>, String) {
    use std::fmt::Write;
    let mut out = String::new();
    let reference = Reference::of(&fingerpad::Params::example().try_build().unwrap(), false);
    let t = std::time::Instant::now();
    let c = calibrate(calibration, &reference);
    let _ = write!(out, "cal {:.2}s misfit {:.2?}", t.elapsed().as_secs_f64(), c.misfit);
    let fixes = verdict::corrections(measured, &[covariates::CovariateError { column: laws::Column::Hydration, sd: 2.0 }]);
    let mut set = measured.clone();
    for f in &fixes {
        f.apply(&mut set);
    }
    let j = verdict::judge(&set, calibration, &reference, &c, &fixes, &select::Settings::default());
    let u = &j.unexplained;
    let _ = write!(out, " {:?} un {} {} {:.1} pm {:.1e} pr {:.3} ratio {:.1?}", j.verdict, u.column, u.channel, u.gain, u.p_model, u.p_runs, u.scatter_ratio);
    for ((a, e), k) in j.selection.fit.laws.iter().zip(&j.selection.evidence).zip(&j.contests) {
        let _ = write!(out, "\n    ** {} {:.4?} gain {:.1} pm {:.1e} pr {:.3} ld {:.1}", a.law.name, (a.law.report)(&a.values), e.gain_2ll, e.p_model, e.p_runs, k.lambda_detect);
        for r in &k.candidates[1..] {
            let _ = write!(out, " | {} {:.1} lr {:.1}", r.active.law.name, r.delta_2ll, r.lambda_rival);
        }
    }
    let fams = j.contests.iter().map(|c| verdict::families(c)).collect();
    let values = j.selection.fit.laws.iter().map(|a| (a.law.report)(&a.values)).collect();
    (j.verdict, fams, values, out)
}
pub use verdict::Verdict;
