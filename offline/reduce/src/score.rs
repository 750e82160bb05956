//! Errors of a model's replay against the finite-element runs: the numbers of the accuracy table.
//!
//! Main types: [`RunScore`] (one path), [`Scores`] (all of them). Uses runs, replay.

use fingerpad::{ModelOf, Regime, Response};
use serde::{Deserialize, Serialize};

use super::replay::{replay, spin_moment};
use super::{Kind, Run, Sample};

/// Errors along one path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunScore {
    /// Name of the experiment.
    pub name: String,
    /// Kind of the path's motion.
    pub kind: Kind,
    /// Whether the path is held out of the fit.
    pub held_out: bool,
    /// Rows in contact.
    pub rows: usize,
    /// RMS of the normal force's error over the range of the normal force along the path.
    pub normal_of_range: f64,
    /// RMS of the length of friction's error over the friction limit at the row's depth.
    pub friction_of_limit: f64,
    /// RMS of the spin moment's error over its limit at the row's depth; of paths that spin.
    pub moment_of_limit: Option<f64>,
    /// RMS and largest error of the change of friction since a vibration of the depth started, over the friction limit at the depth of that
    /// start. Only for vibrations at a constant slide.
    pub vibration_of_limit: Option<[f64; 2]>,
    /// RMS of the stick ratio's error before the first turn or change of depth.
    pub stick_straight: Option<f64>,
    /// RMS of the stick ratio's error from there on.
    pub stick_turned: Option<f64>,
    /// RMS of the area's error over the largest area of the path.
    pub area_of_largest: f64,
    /// Rows outside the band of break-away.
    pub regime_rows: usize,
    /// Those with the wrong regime.
    pub regime_wrong: usize,
}

/// Errors over many paths. RMS values are means over all rows of all paths.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Paths.
    pub paths: usize,
    /// Normal force, RMS of its range.
    pub normal_of_range: f64,
    /// Friction, RMS of the limit at the depth.
    pub friction_of_limit: f64,
    /// Spin moment, RMS of its limit at the depth; 0 without spins.
    pub moment_of_limit: f64,
    /// Change of friction since a vibration began, RMS and largest of the limit there; 0 without vibrations.
    pub vibration_of_limit: [f64; 2],
    /// Stick ratio in straight slides, absolute RMS.
    pub stick_straight: f64,
    /// Stick ratio after turns and depth changes, absolute RMS.
    pub stick_turned: f64,
    /// Area, RMS of the largest of its path.
    pub area_of_largest: f64,
    /// Share of rows with the right regime outside the band of break-away.
    pub regime_right: f64,
    /// Largest errors of friction of any path: its RMS and its name.
    pub worst_friction: (f64, String),
}

/// Half-width of the band of break-away, in stick ratio. The score of the regime leaves out rows whose finite-element stick ratio is closer
/// than this to a threshold between regimes.
const BAND: f32 = 0.02;

/// Whether the regime of a row with this stick ratio is certain.
pub(super) fn outside_band(stick_ratio: f32) -> bool {
    // Stick ratios of exactly 0 and 1 are certain, although they are within the bands of both thresholds.
    let near_slip = stick_ratio > 0.0 && stick_ratio < 0.01 + BAND;
    let near_stick = stick_ratio < 1.0 && stick_ratio > 0.99 - BAND;
    !(near_slip || near_stick)
}

/// Row at which `run` first turns or changes depth after the start of the slide; the number of rows if it never does.
pub fn first_turn(run: &Run) -> usize {
    let mut heading: Option<[f32; 2]> = None;
    for (i, pair) in run.samples.windows(2).enumerate() {
        let by = [0, 1].map(|k| pair[1].slide_mm[k] - pair[0].slide_mm[k]);
        let length = by[0].hypot(by[1]);
        let deeper = pair[1].depth_mm - pair[0].depth_mm;
        match heading {
            None if length > 1e-6 && deeper.abs() > 1e-6 => return i + 1,
            None if length > 1e-6 => heading = Some(by.map(|b| b / length)),
            None if deeper < -1e-6 => return i + 1,
            None => {}
            Some(_) if deeper.abs() > 1e-6 => return i + 1,
            Some(h) if length > 1e-6 && (h[0] * by[0] + h[1] * by[1]) / length < 0.9999 => return i + 1,
            Some(_) => {}
        }
    }
    run.samples.len()
}

fn rms(sum: f64, n: usize) -> f64 {
    (sum / n as f64).sqrt()
}

/// Sum of squares and number of errors.
#[derive(Clone, Copy, Default)]
struct Errors {
    sum: f64,
    n: usize,
}

impl Errors {
    fn push(&mut self, error: f64) {
        self.sum += error * error;
        self.n += 1;
    }

    fn rms(self) -> Option<f64> {
        (self.n > 0).then(|| rms(self.sum, self.n))
    }
}

/// Length of the error of friction.
fn friction_error(r: &Response, s: &Sample) -> f64 {
    f64::from((r.friction_n[0] - s.friction_n[0]).hypot(r.friction_n[1] - s.friction_n[1]))
}

/// Errors of `responses`, the model's at the samples of `run`.
///
/// * `limits`: friction and spin moment in full slip at a depth, N and N mm
pub fn score_run(run: &Run, responses: &[Response], limits: impl Fn(f32) -> [f64; 2]) -> RunScore {
    let limit = |depth_mm: f32| limits(depth_mm)[0];
    let turn = first_turn(run);
    let (mut normal, mut friction, mut moment, mut area) = Default::default();
    let (mut stick, mut regime_rows, mut regime_wrong) = ([Errors::default(); 2], 0, 0);
    let (mut least, mut most, mut largest) = (0.0f32, 0.0f32, 1.0f32);
    let push = |errors: &mut Errors, error: f64| errors.push(error);
    for (i, (s, r)) in run.samples.iter().zip(responses).enumerate() {
        if s.regime == Regime::NoContact && r.regime == Regime::NoContact {
            continue;
        }
        least = least.min(s.normal_force_n);
        most = most.max(s.normal_force_n);
        largest = largest.max(s.contact_area_mm2);
        push(&mut normal, (r.normal_force_n - s.normal_force_n).into());
        push(&mut friction, friction_error(r, s) / limit(s.depth_mm));
        push(&mut area, (r.contact_area_mm2 - s.contact_area_mm2).into());
        push(&mut stick[usize::from(i >= turn)], (r.stick_ratio - s.stick_ratio).into());
        if let (true, Some(there)) = (run.spins(), spin_moment(s)) {
            push(&mut moment, (f64::from(r.spin_moment_n_mm) - there) / limits(s.depth_mm)[1]);
        }
        if outside_band(s.stick_ratio) {
            regime_rows += 1;
            regime_wrong += usize::from(r.regime != s.regime);
        }
    }
    RunScore {
        name: run.name.clone(),
        kind: run.kind,
        held_out: run.held_out,
        rows: friction.n,
        normal_of_range: normal.rms().unwrap_or(0.0) / f64::from(most - least).max(1e-6),
        friction_of_limit: friction.rms().unwrap_or(0.0),
        moment_of_limit: moment.rms(),
        vibration_of_limit: (run.kind == Kind::Vibration).then(|| vibration_errors(run, responses, limit)).flatten(),
        stick_straight: stick[0].rms(),
        stick_turned: stick[1].rms(),
        area_of_largest: area.rms().unwrap_or(0.0) / f64::from(largest),
        regime_rows,
        regime_wrong,
    }
}

/// RMS and largest error of the change of friction while the depth of `run` vibrates, which is between the first slide and the next.
fn vibration_errors(run: &Run, responses: &[Response], limit: impl Fn(f32) -> f64) -> Option<[f64; 2]> {
    let slides = |from: usize| {
        (from..run.samples.len()).find(|&i| i > 0 && run.samples[i].slide_mm != run.samples[i - 1].slide_mm)
    };
    let start = slides(0)?;
    let held = (start..run.samples.len() - 1).find(|&i| run.samples[i].slide_mm == run.samples[i + 1].slide_mm)?;
    let end = slides(held + 1).unwrap_or(run.samples.len());
    let (s0, r0) = (&run.samples[held], &responses[held]);
    let (mut errors, mut largest) = (Errors::default(), 0.0f64);
    for (s, r) in run.samples[held + 1..end].iter().zip(&responses[held + 1..end]) {
        let change = |k: usize| (r.friction_n[k] - r0.friction_n[k]) - (s.friction_n[k] - s0.friction_n[k]);
        let error = f64::from(change(0).hypot(change(1))) / limit(s0.depth_mm);
        errors.push(error);
        largest = largest.max(error);
    }
    Some([errors.rms()?, largest])
}

/// Errors of a model along every run.
pub fn score<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, runs: &[Run]) -> Vec<RunScore> {
    runs.iter().map(|run| score_run(run, &replay(model, run), |depth| limits(model, depth))).collect()
}

/// Friction in full slip along x, the mean of both directions, at `depth_mm`, N.
pub fn strength<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, depth_mm: f32) -> f64 {
    limits(model, depth_mm)[0]
}

/// [`strength`], N, and the moment in full slip under spin, N mm.
fn limits<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, depth_mm: f32) -> [f64; 2] {
    let data = model.data();
    let x = (depth_mm.max(0.05) / data.depth_max * (N - 1) as f32).min((N - 1) as f32);
    let row = &data.rows[x as usize];
    [&row.limit, &row.spin_limit].map(|line| f64::from(line.value + line.change * (x - x.floor())))
}

impl Scores {
    /// Errors over the paths of `scores` for which `which` is true.
    pub fn of<'a>(scores: impl IntoIterator<Item = &'a RunScore>, which: impl Fn(&RunScore) -> bool) -> Self {
        let chosen: Vec<&RunScore> = scores.into_iter().filter(|s| which(s)).collect();
        let mean = |of: &dyn Fn(&RunScore) -> Option<f64>| {
            let (sum, n) = chosen
                .iter()
                .filter_map(|s| of(s).map(|v| (v * v * s.rows as f64, s.rows)))
                .fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
            if n > 0 { rms(sum, n) } else { 0.0 }
        };
        let vibrations = |k: usize| chosen.iter().filter_map(move |s: &&RunScore| s.vibration_of_limit.map(|v| v[k]));
        let (rows, wrong) = chosen.iter().fold((0, 0), |a, s| (a.0 + s.regime_rows, a.1 + s.regime_wrong));
        let worst = chosen.iter().max_by(|a, b| a.friction_of_limit.total_cmp(&b.friction_of_limit));
        Self {
            paths: chosen.len(),
            normal_of_range: mean(&|s| Some(s.normal_of_range)),
            friction_of_limit: mean(&|s| Some(s.friction_of_limit)),
            moment_of_limit: mean(&|s| s.moment_of_limit),
            vibration_of_limit: [mean(&|s| s.vibration_of_limit.map(|v| v[0])), vibrations(1).fold(0.0, f64::max)],
            stick_straight: mean(&|s| s.stick_straight),
            stick_turned: mean(&|s| s.stick_turned),
            area_of_largest: mean(&|s| Some(s.area_of_largest)),
            regime_right: if rows > 0 { 1.0 - wrong as f64 / rows as f64 } else { 1.0 },
            worst_friction: worst.map_or((0.0, String::new()), |s| (s.friction_of_limit, s.name.clone())),
        }
    }
}
