//! What a laboratory does: strokes with their conditions, randomised, moderately confounded or careless.

use std::f64::consts::TAU;

use super::Random;
use super::effects::{At, Effect, Influence};

/// Conditions of a stroke.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Depth, mm.
    pub depth_mm: f64,
    /// Speed, mm/s.
    pub speed_mm_s: f64,
    /// Direction, rad.
    pub direction: f64,
    /// Hold before sliding, s.
    pub dwell_s: f64,
    /// True moisture.
    pub hydration_au: f64,
    /// Temperature, °C.
    pub temperature_c: f64,
    /// Width of the finger, mm.
    pub width_mm: f64,
    /// Length of the stroke, mm.
    pub length_mm: f64,
    /// Goes back half of the way at the end.
    pub reverse: bool,
    /// Rest before it, s.
    pub rest_s: f64,
}

/// One row of a stroke.
#[derive(Clone, Debug)]
pub struct StrokeRow {
    /// Clock, s.
    pub t_s: f64,
    /// Depth, mm.
    pub depth_mm: f64,
    /// Plate, mm.
    pub slide_mm: [f64; 2],
    /// Since touch, s.
    pub contact_s: f64,
    /// Since the last rest, s.
    pub occlusion_s: f64,
}

/// A stroke with its rows.
#[derive(Clone, Debug)]
pub struct Stroke {
    /// Conditions.
    pub plan: Plan,
    /// Rows.
    pub rows: Vec<StrokeRow>,
}

/// State of a stroke at a time.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Clock, s.
    pub t_s: f64,
    /// Since touch, s.
    pub contact_s: f64,
    /// Since the last rest, s.
    pub occlusion_s: f64,
    /// Depth, mm.
    pub depth_mm: f64,
    /// Speed, mm/s; 0 at rest.
    pub speed_mm_s: f64,
    /// Direction of motion, rad.
    pub direction: f64,
    /// Path since touch, mm.
    pub path_mm: f64,
    /// Path since the last turn, mm.
    pub turn_mm: f64,
    /// Position of the plate, mm.
    pub position_mm: [f64; 2],
}

impl Moment {
    /// What effects do at this moment, where the elastic load is `normal_n`.
    pub fn influence(&self, stroke: &Stroke, effects: &[Effect], normal_n: f64) -> Influence {
        let at = At { stroke, moment: self, normal_n };
        let mut out = Influence::default();
        effects.iter().for_each(|e| e.act(&at, &mut out));
        out
    }
}

/// Exponent of the load over depth by which a relaxing finger weighs its past: about that of every simulated finger.
const LOAD_EXPONENT: f64 = 1.7;

impl Stroke {
    /// The part of the load at a time that has not relaxed, if each increase of it fades as `fade` of the time since.
    pub fn unrelaxed(&self, t_s: f64, fade: impl Fn(f64) -> f64) -> f64 {
        let load = |row: &StrokeRow| row.depth_mm.max(0.0).powf(LOAD_EXPONENT);
        let (mut left, mut whole) = (0.0, 0.0);
        for pair in self.rows.windows(2) {
            let (from, to) = (&pair[0], &pair[1]);
            let share = ((t_s - from.t_s) / (to.t_s - from.t_s)).clamp(0.0, 1.0);
            let (gain, parts) = (load(to) - load(from), ((to.t_s - from.t_s) / 0.02).clamp(1.0, 8.0) as u32);
            if gain == 0.0 {
                continue;
            }
            for k in 0..parts {
                let place = share * (f64::from(k) + 0.5) / f64::from(parts);
                let since_s = t_s - from.t_s - place * (to.t_s - from.t_s);
                left += gain * share * fade(since_s) / f64::from(parts);
            }
            whole += gain * share;
        }
        if whole > 1e-9 { left / whole } else { 1.0 }
    }

    /// Rows with what follows from the slide: direction, path, path since the turn; one entry per row.
    pub fn moments(&self) -> Vec<Moment> {
        let (mut path_mm, mut turn_mm, mut heading) = (0.0, 0.0, [0.0f64; 2]);
        let mut before = [0.0; 2];
        self.rows
            .iter()
            .map(|row| {
                let step = [row.slide_mm[0] - before[0], row.slide_mm[1] - before[1]];
                before = row.slide_mm;
                let length = f64::hypot(step[0], step[1]);
                let moving = length > 1e-9;
                if moving {
                    let now = step.map(|s| s / length);
                    if now[0] * heading[0] + now[1] * heading[1] < 0.0 {
                        turn_mm = 0.0;
                    }
                    heading = now;
                    path_mm += length;
                    turn_mm += length;
                }
                Moment {
                    t_s: row.t_s,
                    contact_s: row.contact_s,
                    occlusion_s: row.occlusion_s,
                    depth_mm: row.depth_mm,
                    speed_mm_s: if moving { self.plan.speed_mm_s } else { 0.0 },
                    direction: heading[1].atan2(heading[0]),
                    path_mm,
                    turn_mm,
                    position_mm: row.slide_mm,
                }
            })
            .collect()
    }
}

impl Plan {
    /// The conditions under which calibration runs are taken.
    pub fn reference() -> Self {
        Self {
            depth_mm: 1.0,
            speed_mm_s: 2.0,
            direction: 0.0,
            dwell_s: 1.0,
            hydration_au: 35.0,
            temperature_c: 32.0,
            width_mm: 16.0,
            length_mm: 5.0,
            reverse: false,
            rest_s: 60.0,
        }
    }
}

/// Calibration strokes: reference conditions, all depths and directions.
pub fn calibration(n: usize, random: &mut Random) -> Vec<Plan> {
    (0..n)
        .map(|i| Plan {
            depth_mm: 0.45 + 1.1 * ((i % 6) as f64 + random.unit()) / 6.0,
            direction: TAU / 8.0 * (random.pick(8) as f64),
            hydration_au: 35.0 + random.normal(),
            reverse: random.unit() < 0.3,
            length_mm: random.between(4.0, 6.0),
            ..Plan::reference()
        })
        .collect()
}

/// Measured strokes at a level of confounding: 0 randomised, 1 correlations of 0.7, 2 careless.
pub fn measured(n: usize, level: usize, random: &mut Random) -> Vec<Plan> {
    let tie = [0.0, 0.7, 0.97][level];
    let mut plans = Vec::with_capacity(n);
    for i in 0..n {
        // Standard normals that share a cause: the clock for the finger's state, speed for the protocol.
        let clock = 3.4 * ((i as f64 + 0.5) / n as f64 - 0.5);
        let mut tied = |to: f64| tie * to + f64::sqrt(1.0 - tie * tie) * random.normal();
        let hydration = tied(clock);
        let temperature = tied(clock);
        let speed = tied(0.0) / f64::sqrt(1.0 - tie * tie);
        let dwell = tied(-speed);
        let depth = if level == 0 { tied(0.0) } else { tied(if level == 2 { speed } else { 0.5 * speed }) };
        let width = tied(clock);
        let uniform = |z: f64, low: f64, high: f64| {
            // Logistic approximation of the normal's distribution function.
            low + (high - low) / (1.0 + (-1.702 * z).exp())
        };
        let depth_mm = uniform(depth, 0.45, 1.55);
        plans.push(Plan {
            depth_mm,
            speed_mm_s: 0.5 * 40f64.powf(uniform(speed, 0.0, 1.0)),
            direction: match level {
                0 => TAU * random.unit(),
                1 => TAU / 4.0 * random.pick(4) as f64,
                _ => TAU / 2.0 * random.pick(2) as f64,
            },
            dwell_s: if level == 2 { 1.0 } else { 0.3 * 60f64.powf(uniform(dwell, 0.0, 1.0)) },
            hydration_au: uniform(hydration, 15.0, 78.0),
            temperature_c: uniform(temperature, 27.0, 36.0),
            width_mm: uniform(width, 14.0, 19.0),
            length_mm: random.between(4.0, 6.0),
            reverse: random.unit() < 0.3,
            rest_s: if i % 6 == 0 { 60.0 } else { 2.0 },
        });
    }
    plans
}

/// Rows of the strokes, one after the other on one clock.
pub fn strokes(plans: &[Plan], rows: usize) -> Vec<Stroke> {
    let (mut clock, mut occluded) = (0.0, 0.0);
    plans
        .iter()
        .map(|plan| {
            clock += plan.rest_s.max(10.0) + 20.0;
            if plan.rest_s >= 30.0 {
                occluded = 0.0;
            }
            let press_rows = rows / 5;
            let slide_rows = rows - press_rows - 4;
            let press_s = plan.depth_mm / 2.0;
            let start = clock + 0.2;
            let mut out = vec![(clock, -0.2, 0.0), (clock + 0.1, -0.05, 0.0)];
            for k in 1..=press_rows {
                let share = k as f64 / press_rows as f64;
                out.push((start + press_s * share, plan.depth_mm * share, 0.0));
            }
            let held = start + press_s;
            out.push((held + 0.5 * plan.dwell_s, plan.depth_mm, 0.0));
            out.push((held + plan.dwell_s, plan.depth_mm, 0.0));
            let total = if plan.reverse { 1.5 } else { 1.0 } * plan.length_mm;
            // Closer rows where friction builds up, and one at the turn.
            let mut ways: Vec<f64> =
                (1..=slide_rows).map(|k| total * (k as f64 / slide_rows as f64).powf(1.3)).collect();
            let from_turn = |way: &f64| (*way - plan.length_mm).abs();
            if let Some(nearest) = ways.iter_mut().min_by(|a, b| from_turn(a).total_cmp(&from_turn(b))) {
                *nearest = plan.length_mm;
            }
            for way in ways {
                let place = if way > plan.length_mm { 2.0 * plan.length_mm - way } else { way };
                out.push((held + plan.dwell_s + way / plan.speed_mm_s, plan.depth_mm, place));
            }
            let (s, c) = plan.direction.sin_cos();
            let made: Vec<StrokeRow> = out
                .iter()
                .map(|&(t_s, depth_mm, way)| StrokeRow {
                    t_s,
                    depth_mm,
                    slide_mm: [way * c, way * s],
                    contact_s: t_s - start,
                    occlusion_s: occluded + (t_s - start).max(0.0),
                })
                .collect();
            let end = out[out.len() - 1].0;
            occluded += end - start;
            clock = end;
            Stroke { plan: plan.clone(), rows: made }
        })
        .collect()
}

/// A stroke as it goes on, and the rows of it at which a logger of a constant rate reads.
pub struct Logged {
    /// Close rows, those of the corners of the motion among them.
    pub stroke: Stroke,
    /// Rows that the logger reads.
    pub read: Vec<usize>,
}

/// Longest motion between close rows, mm.
const CLOSE_MM: f64 = 0.04;

/// The strokes of [`strokes`] at close rows, read at a constant rate. The logger's clock does not depend on the corners of the motion, so
/// that a turn lies between two of its rows.
///
/// * `lifts`: whether a run goes on until the finger has left the plate, as fast as it was pressed
pub fn logged_strokes(plans: &[Plan], rate_hz: f64, lifts: bool, random: &mut Random) -> Vec<Logged> {
    strokes(plans, 30)
        .iter()
        .map(|corners| {
            let plan = &corners.plan;
            let from_s = corners.rows[0].t_s;
            // Touch, end of the press, start of the slide, turn, end.
            let touch = from_s + 0.2;
            let held = touch + plan.depth_mm / 2.0;
            let slides = held + plan.dwell_s;
            let turn = slides + plan.length_mm / plan.speed_mm_s;
            let stops = slides + if plan.reverse { 1.5 } else { 1.0 } * plan.length_mm / plan.speed_mm_s;
            let end = if lifts { stops + 0.5 * plan.depth_mm + 0.1 } else { stops };
            let close = (CLOSE_MM / plan.speed_mm_s).min(CLOSE_MM / 2.0);
            let mut times: Vec<(f64, bool)> =
                [from_s, touch, held, slides, turn, stops, end].map(|t| (t, false)).into();
            times.extend((1..((end - from_s) / close) as usize).map(|k| (from_s + close * k as f64, false)));
            let phase = random.unit();
            let count = ((end - from_s) * rate_hz - phase) as usize;
            times.extend((0..=count).map(|k| (from_s + (k as f64 + phase) / rate_hz, true)));
            times.retain(|(t, _)| *t <= end);
            times.sort_by(|a, b| a.0.total_cmp(&b.0));
            // A row that the logger reads takes the place of a close one at the same time.
            times.dedup_by(|b, a| {
                let same = b.0 - a.0 < 1e-9;
                a.1 |= same && b.1;
                same
            });
            let occluded = corners.rows[0].occlusion_s;
            let (sin, cos) = plan.direction.sin_cos();
            let row = |t_s: f64| {
                let lifted = (2.0 * (t_s - stops)).max(0.0);
                let depth_mm = (2.0 * (t_s - touch)).clamp(-0.2, plan.depth_mm) - lifted;
                let way = ((t_s.min(stops) - slides) * plan.speed_mm_s).max(0.0);
                let place = if way > plan.length_mm { 2.0 * plan.length_mm - way } else { way };
                let contact_s = t_s - touch;
                let slide_mm = [place * cos, place * sin];
                StrokeRow { t_s, depth_mm, slide_mm, contact_s, occlusion_s: occluded + contact_s.max(0.0) }
            };
            let read = times.iter().enumerate().filter(|(_, (_, read))| *read).map(|(i, _)| i).collect();
            let rows = times.iter().map(|(t_s, _)| row(*t_s)).collect();
            Logged { stroke: Stroke { plan: plan.clone(), rows }, read }
        })
        .collect()
}
