//! Motions of the plane, and eight of them side by side for the vector unit.
//!
//! Main types: [`Stroke`] (one run's motion), [`Trajectories`] (all runs), [`BatchedTrajectory`] (eight at once),
//! [`BatchedSample`] (one sample of eight runs), [`Substep`] (one step of depth within it).
//!
//! A lane of the vector unit is a run. Runs with equally many substeps share a batch. A lane that has arrived while
//! another is still moving takes substeps without motion; one in the air or beyond its last sample takes arbitrary
//! substeps, whose result is discarded at touch. No lane reads another one: a run's readings do not depend on those
//! beside it.

use std::sync::{Arc, Mutex};

use fingerpad::Surroundings;
use wide::f64x8;

use crate::ModelChange;
use crate::model::{DEEPEST_MM, LEAST_EXPONENT, MIDDLE_MM, U_RANGE};

/// Runs that are simulated at once.
pub const LANES: usize = 8;

/// Largest change of depth in one substep, mm.
const DEPTH_STEP_MM: f64 = 0.08;

/// One sample of a stroke.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Clock, s.
    pub t_s: f64,
    /// Depth of the plane, mm; at or below 0 in the air.
    pub depth_mm: f64,
    /// Displacement of the plane since the sample before, mm.
    pub slide_mm: [f64; 2],
    /// Cosine and sine of twice the direction of motion.
    pub double_angle: [f64; 2],
    /// Cosine and sine of the direction of motion; 0 before the first motion.
    pub direction: [f64; 2],
    /// State of skin and room, for the core's effects.
    pub surroundings: Surroundings,
}

/// The motion of one run.
#[derive(Clone, Debug)]
pub struct Stroke {
    /// Clock at which the motion to the first sample begins, s.
    pub start_s: f64,
    /// The samples in time order.
    pub samples: Vec<Sample>,
    /// Time constant of the first-order low-pass through which the sensor reads the forces, s; 0 without one.
    pub time_constant_s: f64,
}

impl Stroke {
    /// For each step of the samples, how much of a change before it and of a ramp within it has come through the low-pass of the sensor at
    /// its end; empty without a low-pass.
    pub fn low_pass(&self) -> Vec<[f64; 2]> {
        if !(self.time_constant_s > 0.0) {
            return Vec::new();
        }
        let shares = |pair: &[Sample]| {
            let over = ((pair[1].t_s - pair[0].t_s) / self.time_constant_s).max(1e-9);
            let arrived = -(-over).exp_m1();
            [arrived, 1.0 - arrived / over]
        };
        self.samples.windows(2).map(shares).collect()
    }

    /// Passes readings, three per sample, through the low-pass of the sensor: exact if the force between two samples is
    /// linear in time. The filter starts settled.
    ///
    /// * `shares`: those of the low-pass
    pub fn filter(shares: &[[f64; 2]], readings: &mut [f64]) {
        let Some(first) = readings.first_chunk::<3>() else { return };
        let (mut before, mut filtered) = (*first, *first);
        for (reading, [arrived, of_ramp]) in readings.chunks_exact_mut(3).skip(1).zip(shares) {
            for k in 0..3 {
                let now = reading[k];
                filtered[k] += arrived * (before[k] - filtered[k]) + of_ramp * (now - before[k]);
                before[k] = now;
                reading[k] = filtered[k];
            }
        }
    }
}

/// Eight depths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthLanes {
    /// Depths, mm.
    pub mm: f64x8,
    /// u = ln(depth / 0.9 mm), held within [`U_RANGE`].
    pub inside: f64x8,
    /// The parts of u below and above that range.
    outside: [f64x8; 2],
}

impl DepthLanes {
    /// From depths > 0, mm.
    fn new(mm: f64x8) -> Self {
        let u = (mm / f64x8::splat(MIDDLE_MM)).ln();
        let inside = u.fast_max(f64x8::splat(U_RANGE[0])).fast_min(f64x8::splat(U_RANGE[1]));
        let outside = [(u - inside).fast_min(f64x8::ZERO), (u - inside).fast_max(f64x8::ZERO)];
        Self { mm, inside, outside }
    }

    /// Logarithm of a curve of the [model](crate::SmoothModel).
    pub fn curve(&self, c: &[f64; 4]) -> f64x8 {
        let [constant, exponent, slope, half_curvature] = c.map(f64x8::splat);
        let mm = self.mm.fast_min(f64x8::splat(DEEPEST_MM));
        let from_middle = mm - f64x8::splat(MIDDLE_MM);
        let value =
            exponent.mul_add(self.inside, from_middle.mul_add(half_curvature, slope).mul_add(from_middle, constant));
        let least = f64x8::splat(LEAST_EXPONENT);
        let above = mm.mul_add((half_curvature + half_curvature).mul_add(from_middle, slope), exponent);
        let [below_u, above_u] = self.outside;
        exponent.fast_max(least).mul_add(below_u, above.fast_max(least).mul_add(above_u, value))
    }
}

/// One step of depth of eight runs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Substep {
    /// Depths at its end.
    pub depth: DepthLanes,
    /// Share of the sample's slide that it takes; 0 in lanes that have arrived.
    pub slide_share: f64x8,
}

/// One sample of eight runs.
#[derive(Clone, Debug)]
pub(crate) struct BatchedSample {
    /// Place of the sample in the order of the runs, for lanes that have one.
    pub place: [Option<u32>; LANES],
    /// Whether the finger touches.
    pub in_contact: [bool; LANES],
    /// 0 if the finger was in the air at the sample before, else 1.
    pub was_in_contact: f64x8,
    /// Displacement since the sample before, mm.
    pub slide_mm: [f64x8; 2],
    /// Cosine and sine of twice the direction, then of the direction.
    pub heading: [f64x8; 4],
    /// Its substeps; none if all lanes are in the air.
    pub substeps: std::ops::Range<usize>,
}

/// The motions of all runs, eight at once.
#[derive(Clone, Debug, Default)]
pub(crate) struct BatchedTrajectory {
    /// Samples of all batches.
    pub(crate) samples: Vec<BatchedSample>,
    /// First sample of each batch, then the number of all.
    pub(crate) batches: Vec<usize>,
    /// Substeps of all samples.
    pub(crate) substeps: Vec<Substep>,
    /// Number of samples of all runs.
    pub(crate) rows: usize,
}

/// Number of substeps from one depth to another.
fn substeps_between(from_mm: f64, to_mm: f64) -> usize {
    ((to_mm - from_mm).abs() / DEPTH_STEP_MM).ceil().clamp(1.0, 12.0) as usize
}

/// One run with the depths at which it is simulated.
struct Lane<'a> {
    stroke: &'a Stroke,
    /// Place of its first sample in the order of the runs.
    first: usize,
    depth_mm: &'a [f64],
}

impl Lane<'_> {
    /// Depth at a sample, mm; 0 in the air, before the first and after the last sample.
    fn depth(&self, row: usize) -> f64 {
        self.depth_mm.get(row).map_or(0.0, |d| d.max(0.0))
    }

    fn depth_before(&self, row: usize) -> f64 {
        if row == 0 { 0.0 } else { self.depth(row - 1) }
    }

    fn substeps(&self, row: usize) -> usize {
        if self.depth(row) > 0.0 { substeps_between(self.depth_before(row), self.depth(row)) } else { 0 }
    }
}

/// The motions of all runs, at their own depths and at those to which changes moved them last: predictions that follow
/// each other mostly share their depths.
pub struct Trajectories {
    strokes: Arc<[Stroke]>,
    /// Number of samples and low-pass of each stroke.
    low_passes: Arc<[(usize, Vec<[f64; 2]>)]>,
    own: Arc<BatchedTrajectory>,
    /// Depths of all samples, mm, and the trajectory there.
    moved: Mutex<Option<(Vec<f64>, Arc<BatchedTrajectory>)>>,
}

impl Trajectories {
    /// The motions of strokes.
    pub fn new(strokes: Vec<Stroke>) -> Self {
        let depth_mm: Vec<f64> = strokes.iter().flat_map(|s| &s.samples).map(|s| s.depth_mm).collect();
        let own = Arc::new(BatchedTrajectory::at_depths(&strokes, &depth_mm));
        let low_passes = strokes.iter().map(|s| (s.samples.len(), s.low_pass())).collect();
        Self { strokes: strokes.into(), low_passes, own, moved: Mutex::new(None) }
    }

    /// Number of samples and low-pass of each stroke.
    pub(crate) fn low_passes(&self) -> Arc<[(usize, Vec<[f64; 2]>)]> {
        self.low_passes.clone()
    }

    /// The trajectory at the depths after the changes, one a sample, stroke by stroke.
    pub(crate) fn under(&self, changes: &[ModelChange]) -> Arc<BatchedTrajectory> {
        if changes.iter().all(|c| c.depth_mm == 0.0) {
            return self.own.clone();
        }
        let samples = self.strokes.iter().flat_map(|s| &s.samples).zip(changes);
        let depth_mm: Vec<f64> =
            samples.map(|(s, c)| if s.depth_mm > 0.0 { s.depth_mm + c.depth_mm } else { s.depth_mm }).collect();
        let mut moved = self.moved.lock().expect("no thread panics with it");
        match &*moved {
            Some((known_mm, trajectory)) if *known_mm == depth_mm => trajectory.clone(),
            _ => {
                let trajectory = Arc::new(BatchedTrajectory::at_depths(&self.strokes, &depth_mm));
                *moved = Some((depth_mm, trajectory.clone()));
                trajectory
            }
        }
    }
}

impl BatchedTrajectory {
    /// The trajectory of strokes whose samples lie at these depths, mm, stroke by stroke.
    fn at_depths(strokes: &[Stroke], depth_mm: &[f64]) -> Self {
        let mut first = 0;
        let mut lanes: Vec<Lane<'_>> = strokes
            .iter()
            .map(|stroke| {
                let from = first;
                first += stroke.samples.len();
                Lane { stroke, first: from, depth_mm: &depth_mm[from..first] }
            })
            .collect();
        lanes.sort_by_cached_key(|lane| (0..lane.stroke.samples.len()).map(|row| lane.substeps(row)).sum::<usize>());
        let mut trajectory = Self { rows: first, batches: vec![0], ..Self::default() };
        for batch in lanes.chunks(LANES) {
            let rows = batch.iter().map(|l| l.stroke.samples.len()).max().unwrap_or(0);
            (0..rows).for_each(|row| trajectory.push(batch, row));
            trajectory.batches.push(trajectory.samples.len());
        }
        trajectory
    }

    /// Appends one sample of a batch with its substeps.
    fn push(&mut self, batch: &[Lane<'_>], row: usize) {
        let from = self.substeps.len();
        let mut sample = BatchedSample {
            place: [None; LANES],
            in_contact: [false; LANES],
            was_in_contact: f64x8::ZERO,
            slide_mm: [f64x8::ZERO; 2],
            heading: [f64x8::ZERO; 4],
            substeps: from..from,
        };
        let (mut before, mut depth, mut steps) = ([MIDDLE_MM; LANES], [MIDDLE_MM; LANES], [1.0; LANES]);
        let (mut was_in_contact, mut slide, mut heading) = ([0.0; LANES], [[0.0; LANES]; 2], [[0.0; LANES]; 4]);
        let mut most = 0;
        for (l, lane) in batch.iter().enumerate().filter(|(_, lane)| row < lane.stroke.samples.len()) {
            sample.place[l] = Some((lane.first + row) as u32);
            if !(lane.depth(row) > 0.0) {
                continue;
            }
            sample.in_contact[l] = true;
            (before[l], depth[l]) = (lane.depth_before(row), lane.depth(row));
            let n = lane.substeps(row);
            (steps[l], most) = (n as f64, most.max(n));
            was_in_contact[l] = f64::from(u8::from(before[l] > 0.0));
            let own = &lane.stroke.samples[row];
            (slide[0][l], slide[1][l]) = (own.slide_mm[0], own.slide_mm[1]);
            for (to, from) in heading.iter_mut().zip(own.double_angle.iter().chain(&own.direction)) {
                to[l] = *from;
            }
        }
        sample.was_in_contact = f64x8::new(was_in_contact);
        (sample.slide_mm, sample.heading) = (slide.map(f64x8::new), heading.map(f64x8::new));
        self.push_substeps([before, depth, steps].map(f64x8::new), most);
        sample.substeps.end = self.substeps.len();
        self.samples.push(sample);
    }

    /// Appends the substeps from depths to depths, mm, of which each lane takes its own number and the slowest `most`.
    fn push_substeps(&mut self, [before, depth, steps]: [f64x8; 3], most: usize) {
        let share = f64x8::ONE / steps;
        for k in 1..=most {
            let k = f64x8::splat(k as f64);
            let under_way = steps.simd_gt(k);
            let mm = under_way.select(before + (depth - before) * k * share, depth);
            let slide_share = k.simd_gt(steps).select(f64x8::ZERO, share);
            self.substeps.push(Substep { depth: DepthLanes::new(mm), slide_share });
        }
    }
}
