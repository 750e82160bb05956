//! The experiment that would tell candidates of a table apart.

use fingerpad_diagnose::{NextExperiment, PlannedRun, minutes};

use super::effects::{EFFECTS, Effect, Parameter, Values};
use super::fit::Task;
use super::reading::{place_of, read};
use super::search::Candidate;

/// Depths from which the plan chooses, as shares of the table's least and largest, and their number.
const RANGE: [f64; 2] = [0.6, 1.15];
const DEPTHS: usize = 12;
/// Depths of the plan, and the number of approaches to each.
const CHOSEN: usize = 3;
const REPEATS: usize = 3;
/// Error of a reading in the plan, as a share, and of an unloaded reading, N.
const READING: f64 = 0.03;
const UNLOADED_N: f64 = 0.003;

/// Separation of two sets of readings in units of the plan's error, squared.
fn separation(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|q| ((a[q] / b[q]).ln() / READING).powi(2)).sum()
}

/// Strokes at the depths where the first candidate and its nearest rival differ most, each several times and in blocks of
/// their own; none without rivals.
pub fn next_experiment(task: &Task, contenders: &[&Candidate]) -> Option<NextExperiment> {
    let (best, rivals) = contenders.split_first().filter(|(_, rivals)| !rivals.is_empty())?;
    let depths = &task.table.depths_mm;
    let [least, most] = [depths[0] * RANGE[0], depths[depths.len() - 1] * RANGE[1]];
    let depth_mm = |k: usize| least * (most / least).powf(k as f64 / (DEPTHS - 1) as f64);
    let readings = |candidate: &Candidate| -> Vec<[f64; 3]> {
        // Another experiment does not repeat the errors of single depths.
        let errors = (0..depths.len()).map(Parameter::depth_error);
        let values: Values = errors.fold(candidate.fitted.values.clone(), |values, p| values.with(p, 0.0));
        let reading = |k: usize| {
            let (place, factors) = place_of(&values, depth_mm(k), 0);
            read(&values, &factors, &(task.surface)(&place))
        };
        (0..DEPTHS).map(reading).collect()
    };
    let own = readings(best);
    let others: Vec<_> = rivals.iter().map(|r| readings(r)).collect();
    // The least separation from any rival counts at each depth.
    let apart = |k: usize| others.iter().map(|o| separation(&own[k], &o[k])).fold(f64::INFINITY, f64::min);
    let mut order: Vec<usize> = (0..DEPTHS).collect();
    order.sort_by(|a, b| apart(*b).total_cmp(&apart(*a)));
    let mut chosen: Vec<usize> = Vec::new();
    for k in order {
        // Neighbours give the same information.
        if chosen.len() < CHOSEN && chosen.iter().all(|c| c.abs_diff(k) > 2) {
            chosen.push(k);
        }
    }
    let offset_n = |candidate: &Candidate| candidate.fitted.values[Parameter::NORMAL_FORCE_OFFSET];
    let expected = |(rival, readings): (&&Candidate, &Vec<[f64; 3]>)| {
        let strokes: f64 = chosen.iter().map(|k| separation(&own[*k], &readings[*k])).sum();
        REPEATS as f64 * (strokes + ((offset_n(best) - offset_n(rival)) / UNLOADED_N).powi(2))
    };
    let stroke = |k: &usize| PlannedRun {
        depth_mm: Some((20.0 * depth_mm(*k)).round() / 20.0),
        rest_before_s: Some(60.0),
        new_block: Some(true),
        ..PlannedRun::default()
    };
    let runs: Vec<PlannedRun> = (0..REPEATS).flat_map(|_| chosen.iter().map(stroke)).collect();
    Some(NextExperiment {
        separates: rivals.iter().map(|r| [best.name.clone(), r.name.clone()]).collect(),
        factor: if contenders.iter().any(|c| offset_n(c) != 0.0) { "unloaded_reading" } else { "depth_mm" }.into(),
        lambda_rival_expected: rivals.iter().zip(&others).map(expected).fold(f64::INFINITY, f64::min),
        minutes: minutes(&runs),
        prices: Vec::new(),
        runs,
    })
}

/// The experiment in sentences, one for each effect in question.
pub fn experiments(contenders: &[&Candidate]) -> Vec<String> {
    let in_question = |e: &&Effect| contenders.iter().any(|c| c.fitted.effects.contains(e));
    let sentence = |e: &Effect| format!("For {}: {}.", e.name, e.experiment);
    let mut out: Vec<String> = EFFECTS.iter().filter(in_question).map(sentence).collect();
    if out.is_empty() {
        out.push(
            "A table with the spread of every cell, and each depth approached three times, would show smaller effects."
                .into(),
        );
    }
    out
}
