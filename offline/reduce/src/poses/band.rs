//! What another pose adds to the error band, and how many rows lie within.
//!
//! Main functions: [`pose_band`], [`crossed_coverage`]. Uses the replay of this room.

use fingerpad::{DataOf, Regime, Response};

use super::{LEAST_DEPTH_MM, replay_with_pose};
use crate::{Coverage, Run, Sample};

/// Share of the rows whose errors a band holds.
const COVERED: f64 = 0.955;
/// Stick ratios up to which everything slips and from which on everything sticks.
const SLIPS: f64 = 0.01;
const STICKS: f64 = 0.99;
const REGIMES: [Regime; 3] = [Regime::Stick, Regime::PartialSlip, Regime::Slip];

/// Rows of a run that a band is held against, with the model's responses.
fn rows<'a, const M: usize, const N: usize>(
    data: &DataOf<M, N, f64>,
    run: &'a Run,
) -> impl Iterator<Item = (&'a Sample, Response<f64>)> {
    let replayed = run.samples.iter().zip(replay_with_pose(data, run));
    replayed.filter(|(sample, r)| sample.depth_mm > LEAST_DEPTH_MM && r.normal_force_n > 0.0)
}

/// Errors of a row: of the normal force and of friction along x and y, N.
fn row_errors(sample: &Sample, r: &Response<f64>) -> [f64; 3] {
    [
        (r.normal_force_n - f64::from(sample.normal_force_n)).abs(),
        (r.friction_n[0] - f64::from(sample.friction_n[0])).abs(),
        (r.friction_n[1] - f64::from(sample.friction_n[1])).abs(),
    ]
}

/// Stick ratio and error beyond the fitted pose's band, over the normal force or the friction limit, of a row.
type Excess = [f64; 2];

/// What a pose has to add to the bands so that they hold the errors of 95.5 % of the rows in stick, in partial slip and in slip, and what
/// a change of pose in contact adds to that: shares of the normal force and of the friction limit, as parabolas in the stick ratio.
///
/// The first is made from rows of contacts that have rolled over less than half of the range that counts in full, the second from the
/// others; without such rows it is 0.
pub fn pose_band<const M: usize, const N: usize>(data: &DataOf<M, N, f64>, runs: &[&Run]) -> [[[f64; 3]; 2]; 2] {
    let mut without = *data;
    (without.pose.band, without.pose.band_rolled) = ([[0.0; 3]; 2], [[0.0; 3]; 2]);
    // A band that tells the share in which a change of pose counts.
    let mut telling = without;
    telling.pose.band_rolled = [[1.0, 0.0, 0.0]; 2];
    let mut excesses: [[Vec<Excess>; 2]; 2] = Default::default();
    for run in runs {
        for ((sample, r), (_, told)) in rows(&without, run).zip(rows(&telling, run)) {
            let [normal, x, y] = row_errors(sample, &r);
            let share = (told.band_normal_n - r.band_normal_n) / r.normal_force_n;
            let [of_normal, of_friction] = &mut excesses[usize::from(share >= 0.5)];
            of_normal.push([r.stick_ratio, (normal - r.band_normal_n) / r.normal_force_n]);
            let limit = (r.band_friction_n / friction_share(&without, r.stick_ratio)).max(1e-6);
            of_friction.extend([x, y].map(|error| [r.stick_ratio, (error - r.band_friction_n) / limit]));
        }
    }
    let [stays, rolled] =
        excesses.map(|of_class| of_class.map(|excesses| (!excesses.is_empty()).then(|| parabola(&excesses))));
    let more = |i: usize| match (stays[i], rolled[i]) {
        (Some(stays), Some(rolled)) => std::array::from_fn(|k| rolled[k] - stays[k]),
        _ => [0.0; 3],
    };
    [[0, 1].map(|i| stays[i].or(rolled[i]).unwrap_or_default()), [more(0), more(1)]]
}

/// Half-width of the fitted pose's band of friction over the limit that it counts from.
fn friction_share<const M: usize, const N: usize>(data: &DataOf<M, N, f64>, stick: f64) -> f64 {
    let [slip, rate, bend] = data.band_friction;
    (slip + stick * (rate + stick * bend)).max(1e-9)
}

/// The parabola in the stick ratio that holds the same share of rows in slip, partial slip and stick.
fn parabola(excesses: &[Excess]) -> [f64; 3] {
    let part = |least: f64, most: f64| excesses.iter().filter(move |[stick, _]| (least..=most).contains(stick));
    let [slip, stick] = [quantile(part(0.0, SLIPS).map(|[_, x]| *x)), quantile(part(STICKS, 1.0).map(|[_, x]| *x))];
    // The middle as low as the rows in partial slip allow, and so that the parabola stays above half of its lower end.
    let through = |middle: f64| [slip, 4.0 * middle - 3.0 * slip - stick, 2.0 * (slip + stick) - 4.0 * middle];
    let at = |[a, b, c]: [f64; 3], x: f64| a + x * (b + x * c);
    let holds = |parabola: [f64; 3]| {
        let all = part(SLIPS, STICKS).count();
        let within = part(SLIPS, STICKS).filter(|[x, excess]| *excess <= at(parabola, *x)).count();
        let is_high = (0..=20).all(|i| at(parabola, 0.05 * f64::from(i)) >= 0.5 * slip.min(stick));
        is_high && within as f64 >= COVERED * all as f64
    };
    (0..=400).map(|i| through(0.005 * f64::from(i))).find(|parabola| holds(*parabola)).unwrap_or(through(2.0))
}

/// The share of which [`COVERED`] are below; 0 of nothing.
fn quantile(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get((COVERED * values.len() as f64) as usize).map_or(0.0, |x| x.clamp(0.0, 5.0))
}

/// Shares of the rows of `runs` within the model's band, over all and in stick, partial slip, slip.
fn coverage<const M: usize, const N: usize>(data: &DataOf<M, N, f64>, runs: &[&Run]) -> [Coverage; 4] {
    let mut counts = [[0usize; 3]; 4];
    for run in runs {
        for (sample, r) in rows(data, run) {
            let [normal, x, y] = row_errors(sample, &r);
            let within = [x, y].into_iter().filter(|error| *error <= r.band_friction_n).count();
            for place in
                [Some(0), REGIMES.iter().position(|regime| *regime == r.regime).map(|k| k + 1)].into_iter().flatten()
            {
                let [rows, normals, frictions] = &mut counts[place];
                *rows += 1;
                *normals += usize::from(normal <= r.band_normal_n);
                *frictions += within;
            }
        }
    }
    counts.map(|[rows, normal, friction]| {
        let share = |k: usize, of: usize| if of > 0 { k as f64 / of as f64 } else { 0.0 };
        Coverage { rows, normal: share(normal, rows), friction: share(friction, 2 * rows) }
    })
}

/// Shares of the rows of those `runs` for which `which` holds within a band that never saw them: each half of the runs, every second
/// one by name, is held against the band from the other half. Over all and in stick, partial slip, slip.
pub fn crossed_coverage<const M: usize, const N: usize>(
    data: &DataOf<M, N, f64>,
    runs: &[&Run],
    which: impl Fn(&Run) -> bool,
) -> [Coverage; 4] {
    let halves: [Vec<&Run>; 2] =
        [0, 1].map(|half| runs.iter().enumerate().filter(|(i, _)| i % 2 == half).map(|(_, run)| *run).collect());
    let [a, b] = [(0, 1), (1, 0)].map(|(from, on)| {
        let mut banded = *data;
        [banded.pose.band, banded.pose.band_rolled] = pose_band(data, &halves[from]);
        coverage(&banded, &halves[on].iter().copied().filter(|run| which(run)).collect::<Vec<_>>())
    });
    std::array::from_fn(|k| a[k].together(b[k]))
}
