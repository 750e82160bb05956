//! What a perfect analyst could tell: separations by the simulator's own tangents and true noise.
//!
//! It knows the finger's shape up to two per cent, its scales not, the noise, the scatter between runs, and
//! the formulas of all laws. The diagnosis is not asked.

use nalgebra::{DMatrix, DVector};

use super::effects::{Effect, LIBRARY};
use super::laboratory::Scatter;
use super::sets::Case;
use super::simulator::all_readings;

/// Separations of a case with one hidden law.
#[derive(Clone, Copy, Debug)]
pub struct Separation {
    /// Of the truth from nothing.
    pub detect: f64,
    /// Of the truth from the nearest other family.
    pub rival: f64,
}

impl Separation {
    /// Whether a perfect analyst could name it alone.
    pub fn required(&self) -> bool {
        self.detect > 40.0 && self.rival > 25.0
    }

    /// Whether nobody could tell it from another family.
    pub fn indistinguishable(&self) -> bool {
        self.detect > 40.0 && self.rival < 4.0
    }
}

/// Shapes at which a rival is tried.
fn shapes(name: &str, truth: &Effect) -> Vec<[f64; 2]> {
    // Laws that fade along the stroke are tried with the truth's own length.
    let slip = match truth.name {
        "static_peak" => truth.shape[0],
        "contact_ageing" => truth.shape[1],
        _ => 0.8,
    };
    match name {
        "hydration_bell" => vec![[35.0, 18.0], [52.0, 15.0], [65.0, 20.0]],
        "speed_stribeck" => vec![[2.0, 0.0], [8.0, 0.0]],
        "normal_relaxation" => vec![[0.5, 0.0], [1.5, 0.0], [5.0, 0.0]],
        "contact_ageing" => vec![[0.3, 0.5], [0.3, 1.2], [0.3, slip]],
        "static_peak" => vec![[0.3, 0.0], [0.6, 0.0], [1.3, 0.0], [slip, 0.0]],
        "occlusion_growth" => vec![[10.0, 0.0], [40.0, 0.0]],
        "anisotropy" => vec![[0.0, 0.0], [45.0, 0.0]],
        _ => vec![[0.0, 0.0]],
    }
}

fn small(name: &str) -> f64 {
    match name {
        "viscous_drag" => 2e-4,
        "adhesion" | "tare_bias" | "depth_zero_offset" | "cross_talk" => 2e-3,
        "speed_log" | "temperature" => 3e-3,
        "subject_size" => 0.05,
        _ => 0.01,
    }
}

/// Columns of a law, per shape: one group of columns each.
fn groups(name: &'static str, truth: &Effect) -> Vec<Vec<Effect>> {
    let effect = |shape: [f64; 2]| Effect { name, amplitude: small(name), shape, form: truth.form };
    match name {
        "tare_bias" => vec![vec![effect([0.0, 0.0]), effect([1.0, 0.0]), effect([0.0, 1.0])]],
        "cross_talk" => vec![vec![effect([0.0, 0.0]), effect([1.0, 0.0])]],
        "anisotropy" => vec![shapes(name, truth).into_iter().map(effect).collect()],
        _ => shapes(name, truth).into_iter().map(|s| vec![effect(s)]).collect(),
    }
}

/// Separations of the case's first effect.
pub fn separation(case: &Case) -> Separation {
    let flat = |r: Vec<Vec<[f64; 3]>>| -> Vec<f64> { r.into_iter().flatten().flatten().collect() };
    let (strokes, freedoms) = (&case.strokes, case.finger.freedoms());
    let plain = flat(all_readings(&*case.finger, strokes, &[]));
    let truth = &case.truth[0];
    let family = |name: &str| LIBRARY.iter().find(|l| l.0 == name).map(|l| l.1);
    let difference =
        |a: Vec<f64>, step: f64| -> Vec<f64> { a.iter().zip(&plain).map(|(a, p)| (a - p) / step).collect() };

    // Whitener per run: row noise and what a run draws once.
    let scattered = |s: Scatter, step: f64| {
        difference(flat(strokes.iter().map(|k| case.finger.readings(k, &[], &s)).collect()), step)
    };
    let none = Scatter::default();
    let mut random = vec![
        (scattered(Scatter { stiffness: 1.01, ..none }, 0.01), case.noise.gain[0]),
        (scattered(Scatter { strength: 1.01, ..none }, 0.01), case.noise.gain[1]),
        (scattered(Scatter { depth_mm: 2e-3, ..none }, 2e-3), case.noise.depth_mm),
    ];
    for channel in 0..3 {
        let column = (0..plain.len()).map(|i| f64::from(u8::from(i % 3 == channel))).collect();
        random.push((column, case.noise.offset_n));
    }
    let mut factors = Vec::new();
    let mut at = 0;
    for stroke in strokes {
        let n = 3 * stroke.rows.len();
        let mut s = DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| {
            case.noise.additive_n.powi(2) + (case.noise.multiplicative * plain[at + i]).powi(2)
        }));
        for (column, sd) in &random {
            let z = DVector::from_column_slice(&column[at..at + n]) * *sd;
            s += &z * z.transpose();
        }
        factors.push((at, n, s.cholesky().expect("noise has a floor")));
        at += n;
    }
    let whiten = |column: &[f64], prior: &[f64]| -> DVector<f64> {
        let mut out = Vec::with_capacity(column.len() + prior.len());
        for (at, n, factor) in &factors {
            let part = DVector::from_column_slice(&column[*at..at + n]);
            out.extend(factor.l_dirty().solve_lower_triangular(&part).expect("positive diagonal").iter());
        }
        out.extend_from_slice(prior);
        DVector::from_vec(out)
    };
    let no_prior = vec![0.0; freedoms.len()];
    let nuisance: Vec<DVector<f64>> = (0..freedoms.len())
        .map(|k| {
            let moved = flat(all_readings(&*case.finger.vary(k, 0.01), strokes, &[]));
            let mut prior = no_prior.clone();
            prior[k] = 1.0 / freedoms[k];
            whiten(&difference(moved, 0.01), &prior)
        })
        .collect();
    let basis = DMatrix::from_columns(&nuisance);
    let solver = (basis.transpose() * &basis).cholesky().expect("prior rows");
    let clean = |v: DVector<f64>| &v - &basis * solver.solve(&(basis.transpose() * &v));

    let effect = clean(whiten(&difference(flat(all_readings(&*case.finger, strokes, &case.truth)), 1.0), &no_prior));
    let detect = effect.norm_squared();
    let mut rival = detect;
    for (name, other) in LIBRARY {
        if Some(other) == family(truth.name) {
            continue;
        }
        for group in groups(name, truth) {
            let columns: Vec<DVector<f64>> = group
                .iter()
                .map(|e| {
                    clean(whiten(
                        &difference(flat(all_readings(&*case.finger, strokes, std::slice::from_ref(e))), e.amplitude),
                        &no_prior,
                    ))
                })
                .collect();
            let x = DMatrix::from_columns(&columns);
            let mut gram = x.transpose() * &x;
            for k in 0..gram.nrows() {
                gram[(k, k)] = gram[(k, k)] * (1.0 + 1e-6) + 1e-9;
            }
            let product = x.transpose() * &effect;
            if let Some(c) = gram.cholesky() {
                rival = rival.min(detect - product.dot(&c.solve(&product)));
            }
        }
    }
    Separation { detect, rival: rival.max(0.0) }
}
