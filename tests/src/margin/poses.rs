//! The observer with a pad in the finger's own pose, and with the bed, whose pose is another one, on finite elements that no fit has seen.
//!
//! Main functions: [`errors_in_poses`], [`table`]. Uses stored runs, truth and score.

use std::path::Path;

use fingerpad::margin::{MarginObserver, Observable, Observer, PadObserver, Settings};
use fingerpad::pad::{Pad, PadOn, PadState, Plane};
use fingerpad::{FingerModel, Model, Motion, Tuning};
use fingerpad_reduce::{Run, Sample};

use super::Failure;
use super::score::{Errors, MARGINS, settings};
use super::truth::{Measured, Ride, Row, Sensors, Truth, measure};
use crate::synthetic_truth::Random;

/// Lambdas that the observer expects, over that of the finite elements: the strength that it has to find is about one over them.
const LAMBDAS: [f32; 5] = [0.5, 0.7, 1.0, 1.5, 2.2];
/// Most patches of the pad.
const PATCHES: usize = 64;
/// Stick ratio below which a pull counts as in full slip, and the least normal force, N.
const SLIPS: f64 = 0.06;
const LEAST_N: f64 = 0.08;
/// Largest change of direction (cosine) and of the normal force along a pull.
const STRAIGHT: f64 = 0.97;
const STEADY: [f64; 2] = [0.7, 1.4];
/// About the exponent of the limit in the normal force.
const EXPONENT: f64 = 0.9;
/// Steps of the pad between two rows of a run, and speed of the pull, mm/s.
const STEPS: u32 = 5;
const SPEED_MM_S: f64 = 4.0;

/// The first straight pull of a run in one pose, from the air on.
struct Pull {
    pose_deg: [f32; 2],
    depths_mm: Vec<f64>,
    truth: Truth,
}

/// The pull of a run, if it has one that ends in full slip.
fn pull(run: &Run) -> Option<Pull> {
    let pose =
        |s: &Sample| s.turned.filter(|turned| turned.spin_deg == 0.0).map(|turned| [turned.pitch_deg, turned.roll_deg]);
    let pose_deg = pose(run.samples.first()?)?;
    let still = |s: &Sample| pose(s).is_some_and(|now| (0..2).all(|k| (now[k] - pose_deg[k]).abs() < 0.01));
    if !run.body.is_plane() || !run.samples.iter().all(still) {
        return None;
    }
    let row = |s: &Sample| Row {
        normal_n: s.normal_force_n.into(),
        slide_mm: s.slide_mm.map(f64::from),
        friction_n: s.friction_n.map(f64::from),
        stick: s.stick_ratio.into(),
        margin: 1.0,
    };
    let rows: Vec<Row> = run.samples.iter().map(row).collect();
    let pressed = rows.iter().position(|row| row.slide_mm != [0.0; 2])?.checked_sub(1)?;
    let way = |k: usize| [0, 1].map(|i| rows[k + 1].slide_mm[i] - rows[k].slide_mm[i]);
    let [x, y] = way(pressed);
    let goes_on = |k: &usize| {
        let [u, v] = way(*k);
        let load = rows[k + 1].normal_n / rows[pressed].normal_n;
        x * u + y * v > STRAIGHT * x.hypot(y) * u.hypot(v) && load > STEADY[0] && load < STEADY[1]
    };
    let end = (pressed + 1..rows.len() - 1).take_while(goes_on).last()? + 1;
    let (last, depths_mm) = (rows[end], run.samples[..=end].iter().map(|s| s.depth_mm.into()).collect());
    let is_pull = pressed >= 3 && end >= pressed + 6 && rows[pressed].normal_n >= LEAST_N && last.stick <= SLIPS;
    let truth = Truth { name: run.name.clone(), lambda: 1.0, strength: 1.0, pressed, rows: rows[..=end].to_vec() };
    is_pull.then_some(Pull { pose_deg, depths_mm, truth })
}

impl Pull {
    /// The pull as an observer with this finger has to see it: the strength is that with which the finger has its last friction.
    fn seen_by(&self, finger: &PadOn<'_, Plane>) -> Option<Truth> {
        let mut state: PadState<PATCHES> = finger.fresh().ok()?;
        let (mut before, mut size, mut normal) = ((0.0, [0.0; 2]), 0.0, 0.0);
        for (row, depth) in self.truth.rows.iter().zip(&self.depths_mm) {
            let by = [0, 1].map(|k| ((row.slide_mm[k] - before.1[k]) / f64::from(STEPS)) as f32);
            for step in 1..=STEPS {
                let depth_mm = before.0 + (depth - before.0) * f64::from(step) / f64::from(STEPS);
                let motion =
                    Motion { depth_mm: depth_mm as f32, slide_increment_mm: by, spin_increment_rad: 0.0, dt_s: 1e-3 };
                let r = FingerModel::step(finger, &mut state, motion);
                (size, normal) = (f64::from(r.friction_n[0].hypot(r.friction_n[1])), f64::from(r.normal_force_n));
            }
            before = (*depth, row.slide_mm);
        }
        let mut truth = self.truth.clone();
        let last = *truth.rows.last()?;
        let friction = |row: &Row| row.friction_n[0].hypot(row.friction_n[1]);
        let limit = |row: &Row| friction(&last) * (row.normal_n.max(1e-3) / last.normal_n).powf(EXPONENT);
        truth.strength = friction(&last) / size * (normal / last.normal_n).powf(EXPONENT);
        for row in &mut truth.rows {
            row.margin = (1.0 - friction(row) / limit(row)).max(0.0);
        }
        Some(truth)
    }
}

/// What an observer makes of readings, and whether it announces slip.
fn judge<F: Observable<S>, S: Copy, const TWINS: usize>(
    mut observer: Observer<F, S, TWINS>,
    truth: &Truth,
    readings: &[Measured],
    into: &mut ([Errors; 6], [u32; 2]),
) {
    let (mut next, mut announced) = (0, false);
    for m in readings {
        let answer = observer.step(m.reading);
        if m.way_mm <= 0.01 {
            continue;
        }
        announced |= answer.margin_low == 0.0 && m.truth.margin > 0.0;
        while next < MARGINS.len() && m.truth.margin < MARGINS[next] {
            into.0[next].add(truth.strength, m.truth.margin, &answer);
            next += 1;
        }
    }
    into.1 = [into.1[0] + u32::from(announced), into.1[1] + 1];
}

/// Errors at [`MARGINS`] with the pad and with the bed, and how many slips each announced, of how many.
///
/// # Errors
/// A file that is not a run.
pub fn errors_in_poses(
    bed: &Model<'_>,
    pad: &Pad<'_>,
    folder: &Path,
    sensors: &Sensors,
) -> Result<[([Errors; 6], [u32; 2]); 2], Failure> {
    let mut files: Vec<_> = std::fs::read_dir(folder)?.collect::<Result<Vec<_>, _>>()?;
    files.sort_by_key(|entry| entry.file_name());
    let mut found = [([Errors::default(); 6], [0; 2]); 2];
    let mut random = Random::new(5);
    for path in files.iter().map(std::fs::DirEntry::path).filter(|path| path.extension().is_some_and(|e| e == "fprun"))
    {
        let run = Run::from_bytes(&std::fs::read(&path)?, &path)?;
        let Some(pull) = Some(&run).filter(|run| run.held_out).and_then(pull) else { continue };
        for lambda in LAMBDAS {
            let tuning = Tuning { lambda, ..Tuning::default() };
            let finger = PadOn { pad: pad.tuned(tuning)?, body: &Plane, pose_deg: pull.pose_deg };
            let Some(truth) = pull.seen_by(&finger) else { continue };
            let ride = Ride { speed_mm_s: SPEED_MM_S, until: (truth.rows.len() - 1) as f64, hold_s: 0.0 };
            let readings = measure(&truth, ride, sensors, &mut random);
            let of_pad = PadObserver::<_, PATCHES>::new(&finger, settings(sensors, Settings::for_pad()))?;
            judge(of_pad, &truth, &readings, &mut found[0]);
            let of_bed = MarginObserver::new(&bed.tuned(tuning)?, settings(sensors, Settings::default()))?;
            judge(of_bed, &truth, &readings, &mut found[1]);
        }
    }
    Ok(found)
}

/// The table of the page, at the margins from 0.5 on.
///
/// # Errors
/// Those of [`errors_in_poses`].
pub fn table(bed: &Model<'_>, pad: &Pad<'_>, folder: &Path) -> Result<String, Failure> {
    let mut table =
        String::from("| observer, noise | | 0.5 | 0.35 | 0.25 | 0.15 | 0.05 |\n|---|---|---|---|---|---|---|\n");
    for noise in [2.0, 5.0] {
        let found = errors_in_poses(bed, pad, folder, &Sensors::of(noise, noise))?;
        for (name, (errors, [announced, slips])) in
            ["pad in the pose of the finger", "bed of another pose"].iter().zip(&found)
        {
            let mut line = |name: &str, of: fn(&Errors) -> f64| {
                let numbers: Vec<String> = errors[1..].iter().map(|e| format!("{:.0}", 100.0 * of(e))).collect();
                table += &format!("| {name} | {} |\n", numbers.join(" | "));
            };
            line(&format!("{name}, {noise} mN, {noise} µm | bias, %"), Errors::bias);
            line("| bias and scatter, %", Errors::rms);
            line("| band of the strength covers, %", |e| e.covered[0] / e.number);
            line("| band of the margin covers, %", |e| e.covered[1] / e.number);
            table += &format!("| | slips announced | {announced} of {slips} | | | | |\n");
        }
    }
    Ok(table)
}
