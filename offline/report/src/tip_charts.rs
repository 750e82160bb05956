//! Charts of a fingertip: loads, slides, limits and unseen paths of its reduced models beside its finite elements.
//!
//! Main functions: [`tip_charts`], [`bed_table`]. May use reduce.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use fingerpad::pad::Pad;
use fingerpad::{Model, Response};
use fingerpad_fe::contact::Outline;
use fingerpad_reduce::pad::{PadModel, replay as replay_on_pad};
use fingerpad_reduce::{
    CurvePoint, Group, Kind, LimitPoint, Reduced, Run, Sample, Scores, limit_points_of_bed, limit_points_of_pad, replay,
};

use super::numbers::fixed;
use super::tip::ChartGroup;
use super::traces::{Hue, Trace, TraceChart};

/// The models of a tip.
#[derive(Clone, Copy)]
pub struct TipModels<'a> {
    /// The pad, and the undeformed surface of the finger.
    pub pad: Option<(&'a Pad<'a>, &'a Outline)>,
    /// The bed of springs.
    pub bed: Option<&'a Model<'a>>,
}

/// Normal force, friction along x and y, N, spin moment, N mm.
type Load = [f64; 4];

/// Largest stick ratio of full slip.
const SLIPS: f32 = 0.02;
/// Depths of the curves of friction over load, and directions of a limit.
const DEPTHS: usize = 16;
const DIRECTIONS: usize = 48;

fn of_sample(s: &Sample) -> Load {
    let [x, y] = s.friction_n.map(f64::from);
    [s.normal_force_n.into(), x, y, s.turned.map_or(f64::NAN, |turned| turned.moment_n_mm[2].into())]
}

fn of_response<T: Into<f64> + Copy>(r: &Response<T>) -> Load {
    let [x, y] = r.friction_n.map(Into::into);
    [r.normal_force_n.into(), x, y, r.spin_moment_n_mm.into()]
}

fn of_limit(p: &LimitPoint) -> Load {
    [p.normal_force_n, p.friction_n[0], p.friction_n[1], p.spin_moment_n_mm]
}

fn friction([_, x, y, _]: Load) -> f64 {
    x.hypot(y)
}

/// A run by the finite elements and by the models that represent it.
struct Answered<'a> {
    run: &'a Run,
    elements: Vec<Load>,
    /// Pad and bed; empty without an answer.
    models: [Vec<Load>; 2],
}

impl<'a> Answered<'a> {
    fn of(run: &'a Run, models: TipModels<'_>) -> Self {
        let pad = models.pad.map(|(pad, outline)| {
            replay_on_pad(&PadModel::of(pad), run, outline).iter().map(of_response).collect::<Vec<_>>()
        });
        let bed = models.bed.filter(|_| run.is_representable() && !run.spins());
        let bed = bed.map(|bed| replay(bed, run).iter().map(of_response).collect::<Vec<_>>());
        let elements = run.samples.iter().map(of_sample).collect();
        Self { run, elements, models: [pad, bed].map(Option::unwrap_or_default) }
    }

    /// Dots of the finite elements, a solid line of the pad, a dashed one of the bed, of a quantity over another one of a row.
    fn traces(&self, hue: Hue, end: &str, x: impl Fn(usize) -> f64, y: impl Fn(Load) -> f64) -> Vec<Trace> {
        let points = |loads: &[Load]| loads.iter().enumerate().map(|(row, load)| [x(row), y(*load)]).collect();
        let trace = |loads: &[Load], is_dots, is_dashed| Trace {
            points: points(loads),
            is_dots,
            is_dashed,
            hue,
            ..Trace::default()
        };
        let [pad, bed] = &self.models;
        let dots = Trace { end: end.to_owned(), ..trace(&self.elements, true, false) };
        let lines = [(pad, false), (bed, true)].into_iter().filter(|(loads, _)| !loads.is_empty());
        lines.map(|(loads, dashed)| trace(loads, false, dashed)).chain([dots]).collect()
    }

    /// The largest error of friction of a model, root mean square over the rows and over the largest friction.
    fn error(&self) -> f64 {
        let largest = self.elements.iter().map(|load| friction(*load)).fold(1e-9, f64::max);
        let of = |loads: &Vec<Load>| {
            let squares = loads.iter().zip(&self.elements).map(|(a, b)| (a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2));
            (squares.sum::<f64>() / loads.len().max(1) as f64).sqrt() / largest
        };
        self.models.iter().map(of).fold(0.0, f64::max)
    }
}

/// The names of finite elements and models, in ink, for a legend.
fn legend(models: TipModels<'_>) -> Vec<Trace> {
    let entry = |name: &str, is_dots, is_dashed| Trace {
        name: name.to_owned(),
        is_dots,
        is_dashed,
        hue: Hue::Ink,
        ..Trace::default()
    };
    let mut entries = vec![entry("finite elements", true, false)];
    entries.extend(models.pad.map(|_| entry("pad", false, false)));
    entries.extend(models.bed.map(|_| entry("bed of springs", false, true)));
    entries
}

fn chart(title: &str, labels: [&str; 2], traces: Vec<Trace>) -> TraceChart {
    TraceChart { title: title.to_owned(), labels: labels.map(str::to_owned), traces, ..TraceChart::default() }
}

/// All charts.
///
/// * `sizes`: beds of other sizes; may be empty
pub fn tip_charts(runs: &[Run], models: TipModels<'_>, sizes: &[CurvePoint]) -> Vec<ChartGroup> {
    let neutral = |run: &&Run| run.is_representable() && run.body.is_plane();
    let (mut straight, mut presses, mut spins) = (Vec::new(), Vec::new(), Vec::new());
    for run in runs.iter().filter(neutral) {
        match run.kind {
            Kind::Straight if !run.spins() => straight.push(Answered::of(run, models)),
            Kind::Press => presses.push(Answered::of(run, models)),
            Kind::Spin | Kind::SpinSlide => spins.push(Answered::of(run, models)),
            _ => {}
        }
    }
    let group = |name, title, caption: &str, charts| ChartGroup { name, title, caption: caption.to_owned(), charts };
    vec![
        group(
            "tip_loads",
            "Normal force, and friction over it",
            "Left: a press. Right: friction over normal force in full slip along x and y; dots are the ends of single slides.",
            vec![press_chart(&presses, models), coefficient_chart(&straight, models)],
        ),
        group(
            "tip_slides",
            "Straight slides",
            "Friction over slide from rest, each colour a depth.",
            [0, 1].into_iter().filter_map(|axis| slide_chart(&straight, axis, models)).collect(),
        ),
        group(
            "tip_limits",
            "The limit of friction",
            "Full slip in all directions, over the normal force of each depth: of slides along x and y, and of slides along x with spin.",
            limit_charts(&straight, &spins, models),
        ),
        group(
            "tip_unseen",
            "The worst paths that no fit has seen",
            "For each kind of motion the held-out path with the largest error of friction.",
            worst_charts(runs, models),
        ),
        group(
            "tip_sizes",
            "Accuracy and size of the bed",
            "Errors along held-out paths of beds with other numbers of springs.",
            if sizes.is_empty() { Vec::new() } else { vec![size_chart(sizes)] },
        ),
    ]
}

/// The deepest press, until it lifts.
fn press_chart(presses: &[Answered<'_>], models: TipModels<'_>) -> TraceChart {
    let deepest = |a: &&Answered<'_>| a.run.samples.iter().map(|s| f64::from(s.depth_mm)).fold(0.0, f64::max);
    let mut traces = legend(models);
    if let Some(press) = presses.iter().max_by(|a, b| deepest(a).total_cmp(&deepest(b))) {
        let depth = |row: usize| f64::from(press.run.samples[row].depth_mm);
        let last = (0..press.run.samples.len()).max_by(|a, b| depth(*a).total_cmp(&depth(*b))).unwrap_or(0);
        let loading = press.traces(Hue::Series(0), "", depth, |load| load[0]).into_iter().map(|mut trace| {
            trace.points.truncate(last + 1);
            trace.points.retain(|[depth_mm, _]| *depth_mm >= 0.0);
            trace
        });
        traces.extend(loading);
    }
    chart("Press", ["Depth, mm", "Normal force, N"], traces)
}

/// Whether a slide ends in full slip.
fn slips(a: &Answered<'_>) -> bool {
    a.run.samples.last().is_some_and(|s| s.stick_ratio < SLIPS && s.normal_force_n > 0.0)
}

/// The axis of a slide along +x or +y from rest.
fn axis_of(run: &Run) -> Option<usize> {
    let [x, y] = run.samples.last()?.slide_mm;
    match (x, y) {
        (x, y) if x > 0.0 && y.abs() < 1e-3 * x => Some(0),
        (x, y) if y > 0.0 && x.abs() < 1e-3 * y => Some(1),
        _ => None,
    }
}

/// Full slip of pad and bed at a depth.
fn limits(models: TipModels<'_>, depth_mm: f64, directions: &[[f64; 3]]) -> [Vec<Load>; 2] {
    let pad = models.pad.and_then(|(pad, _)| {
        let pose = [f64::from(pad.numbers.neutral_pitch_deg), 0.0];
        limit_points_of_pad(pad, depth_mm, pose, directions).ok()
    });
    let bed = models.bed.and_then(|bed| limit_points_of_bed(bed, depth_mm, directions).ok());
    [pad, bed].map(|points| points.unwrap_or_default().iter().map(of_limit).collect())
}

fn coefficient_chart(straight: &[Answered<'_>], models: TipModels<'_>) -> TraceChart {
    let mut traces = legend(models);
    let coefficient = |load: Load| [load[0], friction(load) / load[0]];
    let deepest = straight.iter().flat_map(|a| a.run.samples.last()).map(|s| f64::from(s.depth_mm)).fold(0.0, f64::max);
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        let direction = [1.0 - axis as f64, axis as f64, 0.0];
        let mut curves: [Vec<[f64; 2]>; 2] = Default::default();
        for k in 1..=DEPTHS {
            let at_depth = limits(models, deepest * k as f64 / DEPTHS as f64, &[direction]);
            for (curve, loads) in curves.iter_mut().zip(at_depth) {
                curve.extend(loads.into_iter().map(coefficient));
            }
        }
        let hue = Hue::Series(axis);
        for (points, is_dashed) in curves.into_iter().zip([false, true]) {
            let end = if is_dashed { String::new() } else { format!("along {name}") };
            traces.push(Trace { points, is_dashed, hue, end, ..Trace::default() });
        }
        let ends = straight.iter().filter(|a| slips(a) && axis_of(a.run) == Some(axis));
        let points = ends.filter_map(|a| a.elements.last().copied().map(coefficient)).collect();
        traces.push(Trace { points, is_dots: true, hue, ..Trace::default() });
    }
    chart("Full slip", ["Normal force, N", "Friction over normal force"], traces)
}

/// Name of a depth.
fn depth_name(depth_mm: f64) -> String {
    format!("{} mm", fixed(depth_mm, 2))
}

fn slide_chart(straight: &[Answered<'_>], axis: usize, models: TipModels<'_>) -> Option<TraceChart> {
    let mut along: Vec<&Answered<'_>> = straight.iter().filter(|a| axis_of(a.run) == Some(axis)).collect();
    let depth = |a: &Answered<'_>| a.run.samples.last().map_or(0.0, |s| f64::from(s.depth_mm));
    along.sort_by(|a, b| depth(a).total_cmp(&depth(b)));
    along.dedup_by(|a, b| (depth(a) - depth(b)).abs() < 1e-3);
    let mut traces = legend(models);
    for (k, a) in along.iter().enumerate() {
        let slide = |row: usize| f64::from(a.run.samples[row].slide_mm[axis]);
        traces.extend(a.traces(Hue::Series(k), &depth_name(depth(a)), slide, |load| load[1 + axis]));
    }
    let name = ["x", "y"][axis];
    (!along.is_empty())
        .then(|| chart(&format!("Slides along {name}"), [&format!("Slide along {name}, mm"), "Friction, N"], traces))
}

fn limit_charts(straight: &[Answered<'_>], spins: &[Answered<'_>], models: TipModels<'_>) -> Vec<TraceChart> {
    let depth = |a: &Answered<'_>| a.run.samples.last().map_or(0.0, |s| f64::from(s.depth_mm));
    let mut depths: Vec<f64> = straight.iter().filter(|a| axis_of(a.run).is_some() && slips(a)).map(depth).collect();
    depths.sort_by(f64::total_cmp);
    depths.dedup_by(|a, b| (*a - *b).abs() < 1e-3);
    let shown = match depths.as_slice() {
        [] => return Vec::new(),
        [first, .., last] => vec![*first, depths[depths.len() / 2], *last],
        [only] => vec![*only],
    };
    let [mut plane, mut spin] = [legend(models), legend(models)];
    let around = |third: usize| -> Vec<[f64; 3]> {
        let direction = |k: usize| {
            let (sin, cos) = (k as f64 / DIRECTIONS as f64 * TAU).sin_cos();
            let mut direction = [cos, 0.0, 0.0];
            direction[third] = sin;
            direction
        };
        (0..=DIRECTIONS).map(direction).collect()
    };
    let over_normal = |load: Load, k: usize| load[k] / load[0];
    for (k, at) in shown.iter().enumerate() {
        let hue = Hue::Series(k);
        for (third, traces, ends) in [(1, &mut plane, straight), (2, &mut spin, spins)] {
            let of = |load: &Load| [over_normal(*load, 1), over_normal(*load, third + 1)];
            for (loads, is_dashed) in limits(models, *at, &around(third)).iter().zip([false, true]) {
                let end = if is_dashed { String::new() } else { depth_name(*at) };
                traces.push(Trace { points: loads.iter().map(of).collect(), is_dashed, hue, end, ..Trace::default() });
            }
            let here = ends.iter().filter(|a| slips(a) && (depth(a) - at).abs() < 1e-3);
            let points = here.filter_map(|a| a.elements.last().map(of)).collect();
            traces.push(Trace { points, is_dots: true, hue, ..Trace::default() });
        }
    }
    let over = "Friction x over normal force";
    vec![
        TraceChart { is_round: true, ..chart("Slides", [over, "Friction y over normal force"], plane) },
        chart("Slides with spin", [over, "Spin moment over normal force, mm"], spin),
    ]
}

/// Friction and normal force along the worst held-out path of each kind of motion.
fn worst_charts(runs: &[Run], models: TipModels<'_>) -> Vec<TraceChart> {
    let mut worst: BTreeMap<Group, Answered<'_>> = BTreeMap::new();
    for run in runs.iter().filter(|run| run.held_out) {
        let answered = Answered::of(run, models);
        let group = Group::of(run.kind);
        if worst.get(&group).is_none_or(|known| answered.error() > known.error()) {
            worst.insert(group, answered);
        }
    }
    let chart = |(group, a): (Group, Answered<'_>)| {
        let time = |row: usize| f64::from(a.run.samples[row].t_s);
        let mut traces = legend(models);
        traces.extend(a.traces(Hue::Series(0), "normal", time, |load| load[0]));
        traces.extend(a.traces(Hue::Series(1), "friction", time, friction));
        chart(&format!("{}: {}", group.as_str(), a.run.name), ["Time of the path, s", "Force, N"], traces)
    };
    worst.into_iter().map(chart).collect()
}

fn size_chart(sizes: &[CurvePoint]) -> TraceChart {
    let mut line: Vec<&CurvePoint> = sizes.iter().filter(|p| p.nodes == fingerpad::NODES).collect();
    line.sort_by_key(|p| p.springs);
    let trace = |name: &str, of: fn(&Scores) -> f64| Trace {
        name: name.to_owned(),
        points: line.iter().map(|p| [p.springs as f64, 100.0 * of(&p.held_out)]).collect(),
        ..Trace::default()
    };
    let traces = vec![
        trace("friction, of the limit", |s| s.friction_of_limit),
        trace("normal force, of the range", |s| s.normal_of_range),
        trace("stick ratio after turns", |s| s.stick_turned),
    ];
    chart("Beds of other sizes", ["Springs", "Root mean square error, %"], traces)
}

/// Errors of a bed by kind of motion: heading and rows.
pub fn bed_table(reduced: &Reduced) -> Vec<Vec<String>> {
    let head = [
        "paths",
        "number",
        "normal force, of its range",
        "friction, of the limit",
        "stick, straight",
        "stick, after turns",
        "regime right",
    ];
    let row = |name: &str, s: &Scores| {
        let percent = |share: f64, digits: usize| format!("{} %", fixed(100.0 * share, digits));
        vec![
            name.to_owned(),
            s.paths.to_string(),
            percent(s.normal_of_range, 2),
            percent(s.friction_of_limit, 2),
            fixed(s.stick_straight, 3),
            fixed(s.stick_turned, 3),
            percent(s.regime_right, 1),
        ]
    };
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    rows.push(row("fit", &Scores::of(&reduced.scores, |s| !s.held_out)));
    rows.push(row("held out", &reduced.meta.held_out));
    for kind in Kind::ALL {
        let scores = Scores::of(&reduced.scores, |s| s.held_out && s.kind == kind);
        if scores.paths > 0 {
            rows.push(row(&format!("held out, {}", kind.as_str()), &scores));
        }
    }
    rows
}
