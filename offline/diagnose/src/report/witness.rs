//! A witness without a model: regressions of what the runs are like as a whole on their drivers, beside the verdict of the mixed model.
//!
//! Of each run it takes the median friction over load in full slip, and the normal force at the end of the press. The calibration gives how they
//! depend on load or depth and on direction. A column is seen where taking it out of the regression of all columns costs more than chance
//! allows (partial F test). Where the form of the model is wrong, this keeps its specificity; it misses what one number a run does not show.
//!
//! Main function: [`witness`].

use crate::data::median::median;
use crate::data::runs::{Run, RunSet};
use crate::laws::run_columns;
use crate::laws::{Change, Column, Law, Place};
use crate::model::active_law::ActiveLaw;
use crate::report::driver_plot::FULL_SLIP_MM;
use crate::schema::{Confidence, Diagnosis, Seen, Verdict, Witness};
use crate::statistics::products::dot;
use crate::statistics::tails::f_tail;

/// p of a column that is seen, over the number of columns.
const LEVEL: f64 = 1e-3;
/// Least load of a row whose friction counts, N.
const LEAST_LOAD_N: f64 = 0.02;
/// Fewest runs beyond the columns of a regression.
const LEAST_DEGREES: usize = 8;
/// Standard deviations by which an effect of the claimed size must be expected to show before its absence speaks against it.
const EXPECTED: f64 = 5.0;

/// A run as the regressions see it: the logarithm of its statistic, what belongs to the finger, and the row that it stands for.
struct Summary<'a> {
    run: &'a Run,
    value: f64,
    own: Vec<f64>,
    row: usize,
}

/// Median friction over load in full slip.
fn friction(run: &Run) -> Option<Summary<'_>> {
    let slips = |i: &usize| {
        let row = &run.rows[*i];
        row.speed_mm_s > 0.0 && row.path_mm.min(row.turn_mm) > FULL_SLIP_MM && run.force_n[*i][0] > LEAST_LOAD_N
    };
    let rows: Vec<usize> = (0..run.rows.len()).filter(slips).collect();
    let along = |i: &usize| {
        let ([n, x, y], [c, s]) = (run.force_n[*i], run.rows[*i].along);
        (x * c + y * s) / n
    };
    let value = median(rows.iter().map(along).filter(|v| v.is_finite()))?;
    let load = median(rows.iter().map(|i| run.force_n[*i][0]))?;
    let row = *rows.last()?;
    let [c, s] = run.rows[row].along;
    let [c2, s2] = run.rows[row].double_angle;
    (value > 0.0).then(|| Summary { run, value: value.ln(), own: vec![load.ln(), c, s, c2, s2], row })
}

/// Normal force of the deepest row before the slide.
fn normal(run: &Run) -> Option<Summary<'_>> {
    let pressed =
        |i: &usize| run.rows[*i].path_mm < 0.05 && run.force_n[*i][0] > LEAST_LOAD_N && run.rows[*i].depth_mm > 0.0;
    let deepest = |a: &usize, b: &usize| run.rows[*a].depth_mm.total_cmp(&run.rows[*b].depth_mm);
    let row = (0..run.rows.len()).filter(pressed).max_by(deepest)?;
    let depth_mm = run.rows[row].depth_mm;
    Some(Summary { run, value: run.force_n[row][0].ln(), own: vec![depth_mm.ln(), depth_mm], row })
}

/// Terms of a column in a regression: moisture has an optimum, speed acts by its logarithm.
fn terms(column: Column, of: &Summary<'_>) -> Vec<f64> {
    let value = of.run.value(column);
    match column {
        Column::Direction => of.run.rows[of.row].double_angle.to_vec(),
        Column::Hydration => vec![value, value * value],
        Column::Speed | Column::Dwell => vec![value.max(1e-3).ln()],
        _ => vec![value],
    }
}

/// An orthonormal basis of the space that the columns span (Gram-Schmidt). A column that depends on earlier ones adds nothing.
fn basis(columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut out: Vec<Vec<f64>> = Vec::new();
    for column in columns {
        let size = dot(column, column).sqrt();
        let mut left = without(&out, column);
        left = without(&out, &left);
        let length = dot(&left, &left).sqrt();
        if length > 1e-6 * size && size > 0.0 {
            left.iter_mut().for_each(|v| *v /= length);
            out.push(left);
        }
    }
    out
}

/// A column less its projection on orthonormal ones.
fn without(basis: &[Vec<f64>], column: &[f64]) -> Vec<f64> {
    let mut out = column.to_vec();
    for q in basis {
        let share = dot(q, &out);
        out.iter_mut().zip(q).for_each(|(v, q)| *v -= share * q);
    }
    out
}

/// A regression of one statistic over the runs of both sets.
struct Regression {
    channel: &'static str,
    values: Vec<f64>,
    /// Columns of the finger, then those of each driver.
    own: Vec<Vec<f64>>,
    drivers: Vec<(Column, Vec<Vec<f64>>)>,
    /// What a claimed law of this channel changes, by the logarithm.
    claimed: Vec<(&'static Law, Vec<f64>)>,
}

impl Regression {
    fn new<'a>(
        channel: &'static str,
        sets: [&'a RunSet; 2],
        of: impl Fn(&'a Run) -> Option<Summary<'a>>,
        claims: &[ActiveLaw],
    ) -> Option<Self> {
        let [free, measured] = sets.map(|set| set.runs.iter().filter_map(&of).collect::<Vec<_>>());
        let both = || free.iter().chain(&measured);
        let is_measured = |i: usize| f64::from(u8::from(i >= free.len()));
        let n = free.len() + measured.len();
        let column = |value: &dyn Fn(&Summary<'_>) -> f64| both().map(value).collect::<Vec<f64>>();
        let mut own = vec![vec![1.0; n], (0..n).map(is_measured).collect()];
        own.extend((0..both().next()?.own.len()).map(|k| column(&|s| s.own[k])));
        // A driver counts by its differences between the measured runs.
        let centred = |values: Vec<f64>| -> Vec<f64> {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            std::iter::repeat_n(0.0, free.len()).chain(values.iter().map(|v| v - mean)).collect()
        };
        let set = sets[1];
        let of_driver = |c: Column| {
            let list: Vec<Vec<f64>> = measured.iter().map(|s| terms(c, s)).collect();
            (0..list[0].len()).map(|k| centred(list.iter().map(|t| t[k]).collect())).collect::<Vec<_>>()
        };
        if measured.is_empty() {
            return None;
        }
        let varied =
            run_columns::of_runs().chain([Column::Direction]).filter(|c| set.has(*c)).map(|c| (c, of_driver(c)));
        let drivers: Vec<_> = varied.filter(|(_, terms)| basis(terms).len() == terms.len()).collect();
        let place = if channel == "friction" { Place::Strength } else { Place::Stiffness };
        let change = |active: &ActiveLaw, s: &Summary<'_>| {
            let mut change = Change::default();
            active.law.apply(&active.values, &s.run.rows[s.row], &mut change);
            if place == Place::Strength { change.strength.ln() } else { change.stiffness.ln() }
        };
        let claims = claims.iter().filter(|active| active.law.place == place);
        let claimed = claims.map(|a| (a.law, centred(measured.iter().map(|s| change(a, s)).collect()))).collect();
        let out = Self { channel, values: column(&|s| s.value), own, drivers, claimed };
        (n >= out.spanned(None).len() + LEAST_DEGREES).then_some(out)
    }

    /// The basis of all columns but those of one driver.
    fn spanned(&self, but: Option<Column>) -> Vec<Vec<f64>> {
        let drivers = self.drivers.iter().filter(|(column, _)| Some(*column) != but).flat_map(|(_, terms)| terms);
        basis(&self.own.iter().chain(drivers).cloned().collect::<Vec<_>>())
    }

    /// Degrees of freedom and variance that all columns leave.
    fn left(&self) -> (f64, f64) {
        let all = self.spanned(None);
        let left = without(&all, &self.values);
        let degrees = (self.values.len() - all.len()) as f64;
        (degrees, dot(&left, &left) / degrees)
    }

    /// The test of each driver.
    fn tests(&self) -> Vec<Seen> {
        let (degrees, variance) = self.left();
        let test = |(column, terms): &(Column, Vec<Vec<f64>>)| {
            let others = self.spanned(Some(*column));
            let left = without(&others, &self.values);
            let sum = dot(&left, &left) - degrees * variance;
            let p = f_tail(sum / terms.len() as f64 / variance, terms.len() as f64, degrees);
            let size = (sum.max(0.0) / self.values.len() as f64).sqrt();
            Seen { channel: self.channel.into(), column: column.name().into(), p, size_relative: size }
        };
        self.drivers.iter().map(test).collect()
    }

    /// Claimed laws that this regression would be expected to see and does not.
    fn unseen(&self) -> impl Iterator<Item = &'static Law> {
        let (_, variance) = self.left();
        self.claimed.iter().filter_map(move |(law, change)| {
            let driver = law.drivers.iter().find(|d| self.drivers.iter().any(|(column, _)| column == *d))?;
            let others = self.spanned(Some(*driver));
            let alone = without(&others, change);
            let information = dot(&alone, &alone) / variance;
            let share = dot(&alone, &self.values) / dot(&alone, &alone);
            (information > EXPECTED * EXPECTED && share < 1.0 / 3.0).then_some(*law)
        })
    }
}

/// What the regressions say beside a verdict, and how far it can be relied on.
///
/// * `claims`: the laws that the verdict claims, as fitted
/// * `report`: verdict, effects with their candidates, and the finger's own laws
/// * `laws`: the library
pub fn witness(
    sets: [&RunSet; 2],
    claims: &[ActiveLaw],
    report: &Diagnosis,
    laws: &[&'static Law],
) -> (Witness, Confidence) {
    let of_both =
        [Regression::new("friction", sets, friction, claims), Regression::new("normal", sets, normal, claims)];
    let regressions: Vec<Regression> = of_both.into_iter().flatten().collect();
    let tests: Vec<Seen> = regressions.iter().flat_map(Regression::tests).collect();
    let level = LEVEL / tests.len().max(1) as f64;
    let seen = || tests.iter().filter(|t| t.p < level);
    let columns = |names: &mut dyn Iterator<Item = &String>| -> Vec<&str> {
        let drivers =
            names.flat_map(|name| laws.iter().filter(move |law| law.name == *name)).flat_map(|law| law.drivers);
        drivers.map(|column| column.name()).collect()
    };
    let of_claims = columns(&mut report.effects.iter().flat_map(|e| &e.candidates).map(|c| &c.law));
    // What the finger follows in every file is no surprise.
    let of_finger = columns(&mut report.finger_laws.iter().map(|law| &law.law));
    let known = |t: &&Seen| of_claims.iter().chain(&of_finger).any(|column| *column == t.column);
    let surprise =
        |t: &Seen| format!("it sees that {} depends on {}", t.channel.replace("normal", "the normal force"), t.column);
    let surprising = seen().filter(|t| report.verdict != Verdict::UnexplainedStructure && !known(t)).map(surprise);
    let unseen = regressions.iter().flat_map(Regression::unseen);
    let unseen = unseen.map(|law| format!("it does not see {}", law.name.replace('_', " ")));
    let disagrees: Vec<String> = surprising.chain(unseen).collect();
    let is_seen = |column: &&str| seen().any(|t| t.column == **column);
    let confidence = if !disagrees.is_empty() || report.implausible().is_some() {
        Confidence::Low
    } else if !tests.is_empty() && (report.verdict == Verdict::None || of_claims.iter().any(is_seen)) {
        Confidence::High
    } else {
        Confidence::Moderate
    };
    (Witness { level, disagrees, tests }, confidence)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::runs::{Labels, RawRow};
    use crate::laws::{LAWS, find};
    use crate::reduced_report;

    /// Runs with a friction of half the load that follows temperature, and with noise.
    fn set(slope: f64, varied: f64) -> RunSet {
        let run = |k: usize| {
            let temperature = 32.0 + varied * (k as f64 * 2.3).sin();
            let depth = 0.6 + 0.02 * k as f64;
            let strength = 0.5 * (1.0 + slope * (temperature - 32.0)) * (1.0 + 0.01 * (k as f64 * 7.1).sin());
            let row = |i: usize| {
                let slide = (0.1 * (i as f64 - 5.0)).max(0.0);
                let load = depth * depth;
                let friction = load * strength * (1.0 - (-5.0 * slide).exp());
                let force = [load * (1.0 + 0.01 * (k as f64 * 3.7).sin()), friction, 0.0];
                RawRow {
                    temperature_c: temperature,
                    ..RawRow::bare(i + 2, 100.0 * k as f64 + 0.1 * i as f64, depth, [slide, 0.0], force)
                }
            };
            (Labels { run: format!("r{k}"), ..Labels::default() }, (0..40).map(row).collect())
        };
        RunSet::from_rows("m.csv".into(), (0..24).map(run).collect()).unwrap()
    }

    #[test]
    fn a_verdict_that_the_runs_contradict_has_a_low_confidence() {
        let report = |verdict| reduced_report(verdict, "", [[0.01; 3]; 2], [0.01; 3], "file", 24);
        let temperature = find("temperature").unwrap();
        let claim = |slope: f64| [ActiveLaw { law: temperature, values: vec![slope] }];
        let free = set(0.0, 0.0);
        for (slope, verdict, claims, confidence, says) in [
            (0.03, Verdict::None, vec![], Confidence::Low, "it sees that friction depends on temperature_c"),
            (0.0, Verdict::None, vec![], Confidence::High, ""),
            (0.0, Verdict::Named, claim(0.03).to_vec(), Confidence::Low, "it does not see temperature"),
            (0.0, Verdict::Named, claim(0.0005).to_vec(), Confidence::Moderate, ""),
        ] {
            let (found, level) = witness([&free, &set(slope, 3.0)], &claims, &report(verdict), LAWS);
            assert_eq!(
                (level, found.disagrees.join("; ").as_str()),
                (confidence, says),
                "{slope} {verdict:?}: {found:?}"
            );
        }
    }
}
