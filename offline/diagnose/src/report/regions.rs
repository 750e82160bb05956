//! Residual map: where simulation and measurement disagree, in bins of every column, with the run as the unit.
//!
//! Main type: [`Maps`].

use crate::data::runs::RunSet;
use crate::laws::run_columns;
use crate::laws::{Column, LawsFile, Row};
use crate::report::driver_plot::FULL_SLIP_MM;
use crate::schema::{Region, Verdict};
use crate::verdict::selected::Selected;

/// Where simulation and measurement disagree.
pub struct Maps {
    /// Without the claimed effects, and with them. The finger is the one that was refitted with them: a refit without them spreads their
    /// residual over columns that have nothing to do with it.
    pub before: Vec<Region>,
    /// With them.
    pub after: Vec<Region>,
    /// Columns that drive the claimed laws; they come first in both.
    pub named: Vec<&'static str>,
}

impl Maps {
    /// The maps of a verdict; a lag that is an effect has no law to be left out, so that the refit without it is shown.
    pub fn of(selected: &Selected<'_, '_>, verdict: Verdict, own: &LawsFile) -> Self {
        let Selected { decision, before, lag_effect, .. } = *selected;
        let full = selected.fit(verdict);
        let accepted = &full.laws[decision.selection.finger_laws.min(full.laws.len())..];
        let mut named: Vec<&'static str> = Vec::new();
        for driver in accepted.iter().flat_map(|active| active.law.drivers) {
            named.extend((!named.contains(&driver.name())).then(|| driver.name()));
        }
        let own_laws = &full.laws[..full.laws.len() - accepted.len()];
        let without = match lag_effect {
            Some(_) => {
                residual_map(before.set, own, &before.task.residual_without_random_effects_n(&before.selection.null))
            }
            None => {
                let predicted = decision.task.predict(&full.parameters, own_laws);
                let residual_n: Vec<f64> =
                    decision.task.readings_n.iter().zip(&predicted).map(|(y, p)| y - p).collect();
                residual_map(decision.set, own, &residual_n)
            }
        };
        let with = residual_map(decision.set, own, &decision.task.residual_without_random_effects_n(full));
        let first = |mut map: Vec<Region>| {
            map.sort_by_key(|r| named.iter().position(|name| *name == r.column).unwrap_or(named.len()));
            map
        };
        Self { before: first(without), after: first(with), named }
    }

    /// The least and the largest residual without the effects along the first named column, in the channel where they differ most.
    pub fn along_driver(&self) -> Option<[Region; 2]> {
        let column = self.named.first()?;
        let ends = |channel: &str| {
            let mut list: Vec<&Region> =
                self.before.iter().filter(|r| r.column == *column && r.channel == channel).collect();
            list.sort_by(|a, b| a.mean_relative.total_cmp(&b.mean_relative));
            Some([(*list.first()?).clone(), (*list.last()?).clone()])
        };
        let range = |ends: &[Region; 2]| ends[1].mean_relative - ends[0].mean_relative;
        CHANNELS[..2].iter().filter_map(|channel| ends(channel)).max_by(|a, b| range(a).total_cmp(&range(b)))
    }
}

/// Channels of a residual map.
pub const CHANNELS: [&str; 3] = ["normal", "friction", "across"];
/// Bins of a column.
pub const BINS: usize = 6;

/// Residual and prediction of a row in a channel; `None` where nothing is to be compared.
type Pair = Option<[f64; 2]>;

/// Each row's residual and size of its prediction in each channel, N. Friction counts where it resists the motion: after a turn it first
/// passes zero.
fn pairs(set: &RunSet, residual_n: &[f64]) -> Vec<[Pair; 3]> {
    let rows = set.runs.iter().flat_map(|run| run.rows.iter().zip(&run.force_n));
    rows.zip(residual_n.chunks_exact(3))
        .map(|((row, y), r)| {
            let p = [y[0] - r[0], y[1] - r[1], y[2] - r[2]];
            let [c, s] = row.along;
            let in_contact = row.depth_mm > 0.0 && p[0] > 0.01;
            let resists = in_contact && row.path_mm > 0.0 && p[1] * c + p[2] * s > 0.02;
            let friction = p[1].hypot(p[2]);
            let pick = |yes: bool, r: f64, p: f64| (yes && r.is_finite() && p.is_finite()).then_some([r, p]);
            [
                pick(in_contact, r[0], p[0]),
                pick(resists, r[1] * c + r[2] * s, friction),
                pick(resists, r[2] * c - r[1] * s, friction),
            ]
        })
        .collect()
}

/// Value of a column in a row; none of the motion where there is none.
fn value(column: Column, run: &crate::data::runs::Run, row: usize) -> f64 {
    let row = &run.rows[row];
    match column {
        Column::Speed if !(row.speed_mm_s > 0.0) => f64::NAN,
        Column::Direction if row.along == [0.0; 2] => f64::NAN,
        _ => run_columns::value(column, row),
    }
}

/// The residual map: every bin of every column that is recorded and varies, those of the user's own last.
///
/// `residual_n`: three per row, N
pub fn residual_map(set: &RunSet, own: &LawsFile, residual_n: &[f64]) -> Vec<Region> {
    let pairs = pairs(set, residual_n);
    let mut out = Vec::new();
    let of_own = own.own_columns().into_iter().zip(own.columns.iter().map(|c| c.unit.as_str()));
    for (column, unit) in
        run_columns::law_columns().map(|(c, known)| (c, known.unit)).chain(of_own).filter(|(c, _)| set.has(*c))
    {
        let Some(edges) = bin_edges(set, column, &pairs) else { continue };
        for bin in 0..edges.len().saturating_sub(1) {
            let range = [edges[bin], edges[bin + 1]];
            let last = bin + 2 == edges.len();
            let regions = (0..CHANNELS.len()).filter_map(|channel| {
                let means = run_means(set, column, &pairs, channel, range, last);
                region(column, unit, channel, range, &means)
            });
            out.extend(regions);
        }
    }
    out
}

/// Edges of a column's bins at quantiles of its contact rows; `None` where it does not vary.
fn bin_edges(set: &RunSet, column: Column, pairs: &[[Pair; 3]]) -> Option<Vec<f64>> {
    let rows = set.runs.iter().flat_map(|run| (0..run.rows.len()).map(move |i| value(column, run, i)));
    let mut values: Vec<f64> =
        rows.zip(pairs).filter(|(v, r)| v.is_finite() && r[0].is_some()).map(|(v, _)| v).collect();
    values.sort_by(f64::total_cmp);
    if values.len() < 2 * BINS || !(values[values.len() - 1] > values[0]) {
        return None;
    }
    let mut edges: Vec<f64> = (0..=BINS).map(|k| values[(k * (values.len() - 1)) / BINS]).collect();
    edges.dedup();
    Some(edges)
}

/// Whether a row shows what a column does to a channel: friction in full slip, and over the slide from touch to the first turn as well.
fn shows(column: Column, channel: usize, row: &Row) -> bool {
    channel == 0 || row.turn_mm > FULL_SLIP_MM || (column == Column::Slide && row.turn_mm >= row.path_mm)
}

/// Relative residual of each run that has rows in a bin, by the sums over these rows; a bin's upper end belongs to it if it is the last one.
fn run_means(
    set: &RunSet,
    column: Column,
    pairs: &[[Pair; 3]],
    channel: usize,
    [from, to]: [f64; 2],
    last: bool,
) -> Vec<f64> {
    let mut means: Vec<f64> = Vec::new();
    let mut at = 0;
    for run in &set.runs {
        let (mut residual, mut size) = (0.0, 0.0);
        for (i, row) in run.rows.iter().enumerate() {
            let v = value(column, run, i);
            let inside = v >= from && (v < to || (last && v <= to)) && shows(column, channel, row);
            if let Some([r, p]) = pairs[at][channel].filter(|_| inside) {
                residual += r;
                size += p;
            }
            at += 1;
        }
        if size > 0.0 {
            means.push(residual / size);
        }
    }
    means
}

/// A region from its runs' means; `None` with fewer than three runs.
fn region(column: Column, unit: &str, channel: usize, [from, to]: [f64; 2], means: &[f64]) -> Option<Region> {
    let n = means.len() as f64;
    if n < 3.0 {
        return None;
    }
    let mean = means.iter().sum::<f64>() / n;
    let sd = (means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    Some(Region {
        column: column.name().to_owned(),
        unit: unit.to_owned(),
        from,
        to,
        channel: CHANNELS[channel].to_owned(),
        mean_relative: mean,
        z: mean / (sd / n.sqrt()).max(1e-9),
        runs: means.len(),
        outside_calibration: false,
    })
}

/// The regions whose mean lies more than 3.5 standard errors from zero: those of the columns of named laws, then the others, strongest
/// first.
pub fn strongest(map: &[Region], named: &[&str], most: usize) -> Vec<Region> {
    let mut list: Vec<Region> =
        map.iter().filter(|r| r.z.abs() > 3.5 && r.mean_relative.abs() > 0.003).cloned().collect();
    let other = |r: &Region| !named.contains(&r.column.as_str());
    list.sort_by(|a, b| other(a).cmp(&other(b)).then(b.z.abs().total_cmp(&a.z.abs())));
    list.truncate(most);
    list
}
