//! Where runs go, eight side by side: the depths and slides of their rows, whatever the freedoms are.
//!
//! Main types: [`Course`], [`Stop`] (one row of eight runs), [`Leg`] (one step of depth on the way to it).
//!
//! A lane is a run. Runs with equally many steps share a group; a lane that has arrived while another is on its way takes
//! steps of no length, one in the air or beyond its last row any steps at all, which are forgotten at touch. No lane
//! looks at another: a run's readings do not depend on those beside it.

use wide::f64x8;

use super::base::{MIDDLE_MM, U};
use super::runs::Run;

/// Runs that are walked at once.
pub const LANES: usize = 8;

/// Largest change of depth in one step, mm.
const DEPTH_STEP_MM: f64 = 0.08;

/// Eight depths.
#[derive(Clone, Copy, Debug)]
pub struct Depths {
    /// mm.
    pub mm: f64x8,
    /// u = ln(depth / 0.9 mm) within [`U`].
    pub inside: f64x8,
    /// What of u lies outside.
    pub beyond: f64x8,
}

impl Depths {
    /// Depths > 0, mm.
    pub fn new(mm: f64x8) -> Self {
        let u = (mm / f64x8::splat(MIDDLE_MM)).ln();
        let inside = u.fast_max(f64x8::splat(U[0])).fast_min(f64x8::splat(U[1]));
        Self { mm, inside, beyond: u - inside }
    }

    /// A cubic over u, which goes on as a straight line that rises.
    pub fn cubic(&self, c: &[f64; 4]) -> f64x8 {
        let c = c.map(f64x8::splat);
        let u = self.inside;
        let value = u.mul_add(u.mul_add(u.mul_add(c[3], c[2]), c[1]), c[0]);
        let slope = u.mul_add(u.mul_add(f64x8::splat(3.0) * c[3], c[2] + c[2]), c[1]);
        slope.fast_max(f64x8::splat(0.1)).mul_add(self.beyond, value)
    }
}

/// One step of eight runs.
#[derive(Clone, Copy, Debug)]
pub struct Leg {
    /// Where it ends.
    pub depth: Depths,
    /// Share of the row's slide; 0 in lanes that have arrived.
    pub share: f64x8,
}

/// One row of eight runs.
#[derive(Clone, Debug)]
pub struct Stop {
    /// Row in the order of the runs, for lanes that have one.
    pub row: [Option<u32>; LANES],
    /// Whether the finger touches.
    pub contact: [bool; LANES],
    /// 0 where the finger was in the air before, else 1.
    pub held: f64x8,
    /// Slide from the row before, mm.
    pub slide_mm: [f64x8; 2],
    /// Cosine and sine of twice the direction, then of the direction.
    pub heading: [f64x8; 4],
    /// Its legs; none where all lanes are in the air.
    pub legs: std::ops::Range<usize>,
}

/// Where runs go.
#[derive(Clone, Debug, Default)]
pub struct Course {
    /// Rows of all groups.
    pub stops: Vec<Stop>,
    /// First stop of each group, then the number of all.
    pub groups: Vec<usize>,
    /// Steps of all stops.
    pub legs: Vec<Leg>,
    /// Number of rows.
    pub rows: usize,
}

/// Steps from one depth to another.
fn steps(from_mm: f64, to_mm: f64) -> usize {
    ((to_mm - from_mm).abs() / DEPTH_STEP_MM).ceil().clamp(1.0, 12.0) as usize
}

/// One lane's run, with the depths at which it is walked.
struct Lane<'a> {
    run: &'a Run,
    first: usize,
    depth_mm: &'a [f64],
}

impl Lane<'_> {
    /// Depth at a row, mm; 0 in the air, before the first and after the last row.
    fn depth(&self, row: usize) -> f64 {
        self.depth_mm.get(row).map_or(0.0, |d| d.max(0.0))
    }

    fn before(&self, row: usize) -> f64 {
        if row == 0 { 0.0 } else { self.depth(row - 1) }
    }

    fn steps(&self, row: usize) -> usize {
        if self.depth(row) > 0.0 { steps(self.before(row), self.depth(row)) } else { 0 }
    }
}

impl Course {
    /// The course of runs whose rows lie at these depths, mm, run by run.
    pub fn new(runs: &[Run], depth_mm: &[f64]) -> Self {
        let mut first = 0;
        let mut lanes: Vec<Lane<'_>> = runs
            .iter()
            .map(|run| {
                let from = first;
                first += run.rows.len();
                Lane { run, first: from, depth_mm: &depth_mm[from..first] }
            })
            .collect();
        lanes.sort_by_cached_key(|lane| (0..lane.run.rows.len()).map(|row| lane.steps(row)).sum::<usize>());
        let mut course = Self { rows: first, groups: vec![0], ..Self::default() };
        for group in lanes.chunks(LANES) {
            let rows = group.iter().map(|l| l.run.rows.len()).max().unwrap_or(0);
            (0..rows).for_each(|row| course.add(group, row));
            course.groups.push(course.stops.len());
        }
        course
    }

    /// The course of runs at their own depths.
    pub fn of(runs: &[Run]) -> Self {
        let depth_mm: Vec<f64> = runs.iter().flat_map(|r| &r.rows).map(|r| r.depth_mm).collect();
        Self::new(runs, &depth_mm)
    }

    fn add(&mut self, group: &[Lane<'_>], row: usize) {
        let from = self.legs.len();
        let mut stop = Stop {
            row: [None; LANES],
            contact: [false; LANES],
            held: f64x8::ZERO,
            slide_mm: [f64x8::ZERO; 2],
            heading: [f64x8::ZERO; 4],
            legs: from..from,
        };
        let (mut before, mut depth, mut steps) = ([MIDDLE_MM; LANES], [MIDDLE_MM; LANES], [1.0; LANES]);
        let (mut held, mut slide, mut heading) = ([0.0; LANES], [[0.0; LANES]; 2], [[0.0; LANES]; 4]);
        let mut most = 0;
        for (l, lane) in group.iter().enumerate().filter(|(_, lane)| row < lane.run.rows.len()) {
            stop.row[l] = Some((lane.first + row) as u32);
            if !(lane.depth(row) > 0.0) {
                continue;
            }
            stop.contact[l] = true;
            (before[l], depth[l]) = (lane.before(row), lane.depth(row));
            let n = lane.steps(row);
            (steps[l], most) = (n as f64, most.max(n));
            held[l] = f64::from(u8::from(before[l] > 0.0));
            let by = lane.run.increment(row);
            let at = &lane.run.rows[row];
            (slide[0][l], slide[1][l]) = (by[0], by[1]);
            for (to, from) in heading.iter_mut().zip(at.double_angle.iter().chain(&at.along)) {
                to[l] = *from;
            }
        }
        (stop.held, stop.slide_mm, stop.heading) = (f64x8::new(held), slide.map(f64x8::new), heading.map(f64x8::new));
        let (before, depth, steps) = (f64x8::new(before), f64x8::new(depth), f64x8::new(steps));
        let share = f64x8::ONE / steps;
        for k in 1..=most {
            let k = f64x8::splat(k as f64);
            let under_way = steps.simd_gt(k);
            let mm = under_way.select(before + (depth - before) * k * share, depth);
            let share = k.simd_gt(steps).select(f64x8::ZERO, share);
            self.legs.push(Leg { depth: Depths::new(mm), share });
        }
        stop.legs.end = self.legs.len();
        self.stops.push(stop);
    }
}
