//! A finger as a grid of cells on a tissue that carries pressure sideways and relaxes, in every file, the calibration's too.
//!
//! An ellipsoid with ridges along x is pressed into a plate. The displacement of a cell is the sum of what the pressure on all cells makes of a
//! half-space, screened by the bone [Boussinesq; Johnson 1985, 3.2], and of its own skin. Pressures that are nowhere negative follow from projected
//! Gauss–Seidel sweeps. Each cell holds on by a shear spring up to tau_0 p/(p + p_0) + alpha p; all cells hang on one spring of the bulk, which
//! two Prony terms relax, as they relax the load.
//!
//! Main types: [`ContinuumFinger`], [`Contact`] (pressures over depth).

use std::f64::consts::PI;
use std::sync::Arc;

use super::Random;
use super::effects::{Effect, Influence};
use super::laboratory::Scatter;
use super::protocol::Stroke;
use super::simulator::{Simulator, Step, Stepped, readings};

/// Families of the laws that this finger and its instrument follow without any planted effect.
pub const OWN_FAMILIES: [&str; 3] = ["normal_relaxation", "cross_talk", "tare"];

/// Cells along x and y, and their sides, mm.
const CELLS: [usize; 2] = [16, 20];
const SIDE_MM: [f64; 2] = [0.95, 0.62];
/// Number of depths at which pressures are solved, and the largest, mm.
const DEPTHS: usize = 33;
const DEEPEST_MM: f64 = 1.8;
/// Largest change of a pressure in the last sweep, share of the largest pressure.
const SETTLED: f64 = 1e-6;
/// Longest motion in one step, mm.
const STEP_MM: f64 = 0.05;
/// Imbalance of the bulk's spring and the cells at which a step ends, N.
const BALANCED_N: f64 = 1e-9;

/// Shape and layers of a finger.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Radii along x and y, mm.
    pub radius_mm: [f64; 2],
    /// Distance beyond which the bone screens a pressure, mm.
    pub layer_mm: f64,
    /// Displacement of a cell by its own skin, as a share of that by the half-space.
    pub skin: f64,
    /// Height of every second row of cells, mm.
    pub ridge_mm: f64,
}

/// Pressures of all cells over depth, for a plane-strain modulus of 1 MPa.
#[derive(Debug)]
pub struct Contact {
    /// Pressures at each depth, MPa.
    pressures: Vec<Vec<f64>>,
    loads_n: Vec<f64>,
    areas_mm2: Vec<f64>,
}

/// Depth of a place in the table, mm: closer where the load curves more.
fn table_depth(place: f64) -> f64 {
    DEEPEST_MM * (place / (DEPTHS - 1) as f64).powi(2)
}

impl Contact {
    /// Solves the contact of a shape at all depths.
    pub fn new(shape: &Shape) -> Self {
        let area = SIDE_MM[0] * SIDE_MM[1];
        let n = CELLS[0] * CELLS[1];
        let at = |i: usize| {
            let place = [i % CELLS[0], i / CELLS[0]];
            [0, 1].map(|c| (place[c] as f64 - 0.5 * (CELLS[c] - 1) as f64) * SIDE_MM[c])
        };
        let gap = |i: usize| {
            let ([x, y], raised) = (at(i), (i / CELLS[0]).is_multiple_of(2));
            let round = x * x / shape.radius_mm[0] + y * y / shape.radius_mm[1];
            0.5 * round + if raised { 0.0 } else { shape.ridge_mm }
        };
        // Distance at which a point force moves the surface as an even pressure on a square does its middle.
        let near = area.sqrt() / (4.0 * 1f64.asinh());
        let compliance = |i: usize, j: usize| {
            let ([x, y], [u, v]) = (at(i), at(j));
            let r = (x - u).hypot(y - v);
            let own = if i == j { 1.0 + shape.skin } else { 1.0 };
            own * area / (PI * r.hypot(near)) * (-r / shape.layer_mm).exp()
        };
        let matrix: Vec<f64> = (0..n * n).map(|k| compliance(k / n, k % n)).collect();
        let mut pressure = vec![0.0f64; n];
        let mut out = Self { pressures: Vec::new(), loads_n: Vec::new(), areas_mm2: Vec::new() };
        for k in 0..DEPTHS {
            let depth_mm = table_depth(k as f64);
            loop {
                let (mut change, mut largest) = (0.0f64, 1e-12f64);
                for i in 0..n {
                    let row = &matrix[i * n..(i + 1) * n];
                    let moved: f64 = row.iter().zip(&pressure).map(|(c, p)| c * p).sum();
                    let new = (pressure[i] + (depth_mm - gap(i) - moved) / row[i]).max(0.0);
                    change = change.max((new - pressure[i]).abs());
                    largest = largest.max(new);
                    pressure[i] = new;
                }
                if change <= SETTLED * largest {
                    break;
                }
            }
            out.loads_n.push(area * pressure.iter().sum::<f64>());
            out.areas_mm2.push(area * pressure.iter().filter(|p| **p > 0.0).count() as f64);
            out.pressures.push(pressure.clone());
        }
        out
    }

    /// Place in the table of a depth above 0: the entry below and the share of the next.
    fn place(depth_mm: f64) -> (usize, f64) {
        let place = (depth_mm / DEEPEST_MM).sqrt() * (DEPTHS - 1) as f64;
        let below = (place as usize).min(DEPTHS - 2);
        let [low, high] = [0, 1].map(|k| table_depth((below + k) as f64));
        (below, (depth_mm - low) / (high - low))
    }

    fn between(list: &[f64], depth_mm: f64) -> f64 {
        let (k, share) = Self::place(depth_mm.max(0.0));
        list[k] + share * (list[k + 1] - list[k])
    }
}

/// Geometry, material and habits of one finger.
#[derive(Clone, Debug)]
pub struct ContinuumFinger {
    /// Pressures over depth.
    pub contact: Arc<Contact>,
    /// Plane-strain modulus, MPa.
    pub modulus_mpa: f64,
    /// Change of the load's exponent over depth.
    pub exponent: f64,
    /// Traction per stretch of a cell, MPa/mm.
    pub shear_mpa_mm: f64,
    /// Spring of the bulk along x and y, N/mm.
    pub bulk_n_mm: [f64; 2],
    /// Strength of a cell that is pressed hard, MPa.
    pub tau0_mpa: f64,
    /// Pressure at which half of it is there, MPa.
    pub half_mpa: f64,
    /// Strength per pressure.
    pub alpha: f64,
    /// Slide per depth while pressing, x and y.
    pub press: [f64; 2],
    /// Normal force per friction along x and y.
    pub incline: [f64; 2],
    /// Shares of the stiffness that relax.
    pub relaxing: [f64; 2],
    /// Times of relaxation, s.
    pub relaxation_s: [f64; 2],
}

/// How far [`Simulator::vary`] may move each number.
const FREEDOMS: [f64; 12] = [1.0, 1.0, 0.10, 0.02, 0.02, 0.02, 0.02, 0.002, 0.002, 0.004, 0.004, 0.05];

impl ContinuumFinger {
    /// A finger of a seed.
    pub fn random(random: &mut Random) -> Self {
        let across = random.between(10.0, 12.5);
        let shape = Shape {
            radius_mm: [across * random.between(1.0, 1.5), across],
            layer_mm: random.between(2.0, 5.0),
            skin: random.between(0.5, 2.0),
            ridge_mm: random.between(0.01, 0.04),
        };
        let contact = Arc::new(Contact::new(&shape));
        let load_n = random.between(0.20, 0.42);
        let bulk = random.between(0.8, 2.0);
        Self {
            modulus_mpa: load_n / Contact::between(&contact.loads_n, 1.0),
            contact,
            exponent: 0.0,
            shear_mpa_mm: random.between(0.03, 0.08),
            bulk_n_mm: [bulk, bulk * random.between(0.7, 1.1)],
            tau0_mpa: random.between(0.0020, 0.0045),
            half_mpa: random.between(0.0003, 0.0012),
            alpha: random.between(0.3, 0.7),
            press: [random.between(-0.04, 0.04), random.between(-0.03, 0.03)],
            incline: [random.between(-0.04, 0.04), random.between(-0.02, 0.02)],
            relaxing: [random.between(0.02, 0.06), random.between(0.02, 0.06)],
            relaxation_s: [random.between(0.1, 0.5), random.between(1.0, 5.0)],
        }
    }

    /// Share of the stiffness that stays.
    fn rest(&self) -> f64 {
        1.0 - self.relaxing.iter().sum::<f64>()
    }

    /// Strength of a cell under a pressure, MPa.
    fn strength_mpa(&self, pressure_mpa: f64) -> f64 {
        self.tau0_mpa * pressure_mpa / (pressure_mpa + self.half_mpa) + self.alpha * pressure_mpa
    }
}

/// What the finger remembers.
#[derive(Default)]
pub struct Memory {
    plate_mm: [f64; 2],
    /// Plate position, less the bulk's motion, at which each cell's spring is slack, mm; none out of contact.
    slack_mm: Vec<Option<[f64; 2]>>,
    /// How far the bulk has gone along, mm.
    bulk_mm: [f64; 2],
    /// Forces of the bulk that are still to relax, N.
    bulk_arms_n: [[f64; 2]; 2],
    friction_n: [f64; 2],
    /// Load at the last step before it relaxes, N.
    elastic_n: f64,
    /// Load that is still to relax, N.
    relaxing_n: [f64; 2],
}

/// How much of an arm is left after a time, and the mean of that over the time.
fn decay(time_s: f64, over_s: f64) -> (f64, f64) {
    let x = time_s / over_s;
    if x < 1e-9 { (1.0, 1.0) } else { ((-x).exp(), -(-x).exp_m1() / x) }
}

/// A cell in contact: place, slack position, and limit of its traction.
struct Cell {
    place: usize,
    slack_mm: [f64; 2],
    limit_mpa: f64,
}

impl Memory {
    /// The relaxed load, N.
    fn load_n(&self, finger: &ContinuumFinger) -> f64 {
        finger.rest() * self.elastic_n + self.relaxing_n.iter().sum::<f64>()
    }

    /// The cells in contact at a depth; those that come into contact are slack.
    fn cells(&self, finger: &ContinuumFinger, step: &Step<'_>) -> Vec<Cell> {
        let (k, share) = Contact::place(step.depth_mm);
        let [low, high] = [0, 1].map(|more| &finger.contact.pressures[k + more]);
        let elastic = Contact::between(&finger.contact.loads_n, step.depth_mm);
        let scale = self.load_n(finger) * step.influence.stiffness / elastic;
        let fresh = [0, 1].map(|c| self.plate_mm[c] - self.bulk_mm[c]);
        (0..low.len())
            .filter_map(|place| {
                let pressure = scale * (low[place] + share * (high[place] - low[place]));
                let slack_mm = self.slack_mm.get(place).copied().flatten().unwrap_or(fresh);
                let limit_mpa = step.influence.strength * finger.strength_mpa(pressure);
                (pressure > 0.0).then_some(Cell { place, slack_mm, limit_mpa })
            })
            .collect()
    }

    /// A step to a depth with a motion of the plate: the bulk goes to where its spring balances all cells, by Newton's steps.
    fn step(&mut self, finger: &ContinuumFinger, step: &Step<'_>) {
        let left = finger.relaxation_s.map(|over| decay(step.time_s, over));
        let elastic = finger.load(step.depth_mm);
        for m in 0..2 {
            let new = finger.relaxing[m] * (elastic - self.elastic_n) * left[m].1;
            self.relaxing_n[m] = self.relaxing_n[m] * left[m].0 + new;
        }
        self.elastic_n = elastic;
        let cells = self.cells(finger, step);
        self.plate_mm = [0, 1].map(|c| self.plate_mm[c] + step.slide_mm[c]);
        let area = SIDE_MM[0] * SIDE_MM[1];
        let shear = finger.shear_mpa_mm * step.influence.stiffness;
        let bulk = finger.bulk_n_mm.map(|k| k * step.influence.stiffness);
        let before = self.bulk_mm;
        let slope =
            [0, 1].map(|c| bulk[c] * (finger.rest() + (0..2).map(|m| finger.relaxing[m] * left[m].1).sum::<f64>()));
        let arms = self.bulk_arms_n;
        let held = |c: usize, at: f64| {
            let arm = |m: usize| arms[m][c] * left[m].0 + bulk[c] * finger.relaxing[m] * left[m].1 * (at - before[c]);
            bulk[c] * finger.rest() * at + arm(0) + arm(1)
        };
        let traction = |cell: &Cell, at: [f64; 2]| {
            let trial = [0, 1].map(|c| shear * (self.plate_mm[c] - at[c] - cell.slack_mm[c]));
            let size = trial[0].hypot(trial[1]);
            (trial.map(|t| if size > cell.limit_mpa { t * cell.limit_mpa / size } else { t }), trial, size)
        };
        let mut at = self.bulk_mm;
        for _ in 0..40 {
            let mut excess = [0, 1].map(|c| -held(c, at[c]));
            let mut tangent = [[slope[0], 0.0], [0.0, slope[1]]];
            for cell in &cells {
                let (kept, trial, size) = traction(cell, at);
                let slips = size > cell.limit_mpa;
                let stiffness = area * shear * if slips { cell.limit_mpa / size } else { 1.0 };
                for c in 0..2 {
                    excess[c] += area * kept[c];
                    for d in 0..2 {
                        let along = if slips { trial[c] * trial[d] / (size * size) } else { 0.0 };
                        tangent[c][d] += stiffness * (f64::from(u8::from(c == d)) - along);
                    }
                }
            }
            self.friction_n = [0, 1].map(|c| held(c, at[c]));
            if excess[0].hypot(excess[1]) < BALANCED_N {
                break;
            }
            let [[a, b], [c, d]] = tangent;
            let det = a * d - b * c;
            at = [at[0] + (d * excess[0] - b * excess[1]) / det, at[1] + (a * excess[1] - c * excess[0]) / det];
        }
        self.slack_mm = vec![None; CELLS[0] * CELLS[1]];
        for cell in &cells {
            let (kept, ..) = traction(cell, at);
            self.slack_mm[cell.place] = Some([0, 1].map(|c| self.plate_mm[c] - at[c] - kept[c] / shear));
        }
        for m in 0..2 {
            self.bulk_arms_n[m] =
                [0, 1].map(|c| arms[m][c] * left[m].0 + bulk[c] * finger.relaxing[m] * left[m].1 * (at[c] - before[c]));
        }
        self.bulk_mm = at;
    }
}

impl Stepped for ContinuumFinger {
    type State = Memory;

    fn in_the_air(&self) -> Memory {
        Memory::default()
    }

    /// Load before it relaxes, N.
    fn load(&self, depth_mm: f64) -> f64 {
        if depth_mm <= 0.0 {
            return 0.0;
        }
        self.modulus_mpa * Contact::between(&self.contact.loads_n, depth_mm) * depth_mm.powf(self.exponent)
    }

    fn area(&self, depth_mm: f64) -> f64 {
        Contact::between(&self.contact.areas_mm2, depth_mm)
    }

    fn press(&self) -> [f64; 2] {
        self.press
    }

    fn steps(&self, sunk_mm: f64, slide_mm: f64) -> f64 {
        (sunk_mm.max(slide_mm) / STEP_MM).ceil()
    }

    fn step(&self, state: &mut Memory, step: &Step<'_>) {
        state.step(self, step);
    }

    fn forces(&self, state: &Memory, _: f64, influence: &Influence) -> (f64, [f64; 2]) {
        let force = state.friction_n;
        let inclined = self.incline[0] * force[0] + self.incline[1] * force[1];
        (state.load_n(self) * influence.stiffness + inclined, force)
    }
}

impl Simulator for ContinuumFinger {
    fn freedoms(&self) -> &'static [f64] {
        &FREEDOMS
    }

    fn own_families(&self) -> &'static [&'static str] {
        &OWN_FAMILIES
    }

    fn vary(&self, freedom: usize, by: f64) -> Box<dyn Simulator> {
        let mut f = self.clone();
        match freedom {
            0 => f.modulus_mpa *= 1.0 + by,
            1 => {
                f.tau0_mpa *= 1.0 + by;
                f.alpha *= 1.0 + by;
            }
            2 => f.bulk_n_mm = f.bulk_n_mm.map(|k| k * (1.0 + by)),
            3 => f.exponent += by,
            4 => f.bulk_n_mm[1] *= 1.0 + by,
            5 => f.alpha *= 1.0 + by,
            6 => f.half_mpa *= 1.0 + by,
            7 => f.press[0] += by,
            8 => f.press[1] += by,
            9 => f.incline[0] += by,
            10 => f.incline[1] += by,
            _ => f.relaxing[1] += by,
        }
        Box::new(f)
    }

    fn readings(&self, stroke: &Stroke, effects: &[Effect], scatter: &Scatter) -> Vec<[f64; 3]> {
        readings(self, stroke, effects, scatter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic_truth::protocol::{Plan, StrokeRow};

    const SPHERE: Shape = Shape { radius_mm: [12.0; 2], layer_mm: 1e9, skin: 0.0, ridge_mm: 0.0 };

    /// Presses to a depth at once, then follows the places along x at these times.
    fn slide(finger: &ContinuumFinger, depth_mm: f64, rows: &[(f64, f64)]) -> Vec<[f64; 3]> {
        let row = |t_s: f64, depth_mm: f64, x: f64| StrokeRow {
            t_s,
            depth_mm,
            slide_mm: [x, 0.0],
            contact_s: t_s,
            occlusion_s: t_s,
        };
        let mut all = vec![row(-1e-9, -0.2, 0.0), row(0.0, depth_mm, 0.0)];
        all.extend(rows.iter().map(|(t, x)| row(*t, depth_mm, *x)));
        let stroke = Stroke { plan: Plan { depth_mm, ..Plan::reference() }, rows: all };
        finger.readings(&stroke, &[], &Scatter::default()).split_off(1)
    }

    fn plain(seed: u64) -> ContinuumFinger {
        let finger = ContinuumFinger::random(&mut Random::new(seed));
        ContinuumFinger { press: [0.0; 2], incline: [0.0; 2], ..finger }
    }

    /// Hertz: 4/3 E √R d^1.5 on a circle of π R d.
    #[test]
    fn a_ball_on_a_half_space_presses_as_hertz_says() {
        let contact = Contact::new(&SPHERE);
        for depth_mm in [0.5, 1.0, 1.6] {
            let load = Contact::between(&contact.loads_n, depth_mm) / (4.0 / 3.0 * 12f64.sqrt() * depth_mm.powf(1.5));
            let area = Contact::between(&contact.areas_mm2, depth_mm) / (PI * 12.0 * depth_mm);
            println!("{depth_mm}: {load} {area}");
            assert!((load - 1.0).abs() < 0.03 && (area - 1.0).abs() < 0.12, "{depth_mm}: {load} {area}");
        }
        let ridged = Contact::new(&Shape { ridge_mm: 0.03, ..SPHERE });
        assert!(ridged.loads_n[16] < contact.loads_n[16] && ridged.areas_mm2[4] < contact.areas_mm2[4]);
    }

    #[test]
    fn a_held_load_relaxes_by_its_two_terms() {
        let finger = plain(3);
        let rows = slide(&finger, 1.0, &[(0.2, 0.0), (3.0, 0.0), (60.0, 0.0)]);
        for (row, t_s) in rows.iter().zip([0.0, 0.2, 3.0, 60.0]) {
            let gone = |m: usize| finger.relaxing[m] * (1.0 - f64::exp(-t_s / finger.relaxation_s[m]));
            let expected = finger.load(1.0) * (1.0 - gone(0) - gone(1));
            assert!((row[0] / expected - 1.0).abs() < 1e-6, "{t_s}: {} {expected}", row[0]);
        }
    }

    /// A small slide stretches the cells and the bulk in series; a long one gives the sum of all strengths. Without relaxation.
    #[test]
    fn friction_begins_with_two_springs_and_ends_with_the_strength_of_all_cells() {
        let finger = ContinuumFinger { relaxing: [0.0; 2], ..plain(5) };
        let rows = slide(&finger, 1.0, &[(1.0, 1e-4), (2.0, 6.0)]);
        let pressures = {
            let (k, share) = Contact::place(1.0);
            let [low, high] = [0, 1].map(|more| finger.contact.pressures[k + more].iter());
            low.zip(high)
                .map(|(a, b)| finger.modulus_mpa * (a + share * (b - a)))
                .filter(|p| *p > 0.0)
                .collect::<Vec<_>>()
        };
        let area = SIDE_MM[0] * SIDE_MM[1];
        let cells = area * pressures.len() as f64 * finger.shear_mpa_mm;
        let stiffness = 1.0 / (1.0 / cells + 1.0 / finger.bulk_n_mm[0]);
        // Cells at the rim slip at once.
        assert!((rows[1][1] / 1e-4 / stiffness - 1.0).abs() < 0.02, "{} {stiffness}", rows[1][1] / 1e-4);
        let strength: f64 = pressures.iter().map(|p| area * finger.strength_mpa(*p)).sum();
        assert!((rows[2][1] / strength - 1.0).abs() < 1e-6, "{} {strength}", rows[2][1]);
    }
}
