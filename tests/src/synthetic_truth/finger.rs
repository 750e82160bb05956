//! A finger as bristles on an elastic bulk.
//!
//! Material points on a fixed grid carry a shear traction while they lie in the contact ellipse; the bulk between
//! them and the nail is one spring for all. Pressure is a tilted, flattened bell; strength is a power of it.

use super::Random;
use super::effects::{Effect, Influence};
use super::laboratory::Scatter;
use super::protocol::Stroke;
use super::simulator::{Simulator, Step, Stepped, readings};

/// Geometry and material of one finger.
#[derive(Clone, Debug)]
pub struct Finger {
    /// Normal force at 1 mm, N.
    pub normal_n: f64,
    /// Exponent of the normal force in depth.
    pub normal_exponent: f64,
    /// Exponential part of the normal force, 1/mm.
    pub normal_rate: f64,
    /// Contact area at 1 mm, mm².
    pub area_mm2: f64,
    /// Exponent of the area in depth.
    pub area_exponent: f64,
    /// Long over short semi-axis of the contact.
    pub aspect: f64,
    /// Exponent of the pressure bell.
    pub bell: f64,
    /// Tilt of the pressure along x.
    pub tilt: f64,
    /// lambda, MPa^(1 − beta).
    pub lambda: f64,
    /// beta.
    pub beta: f64,
    /// Bulk stiffness along x at 1 mm, N/mm.
    pub bulk_n_mm: f64,
    /// Bulk stiffness along y over x.
    pub bulk_ratio: f64,
    /// Exponent of the bulk stiffness in depth.
    pub bulk_exponent: f64,
    /// Traction per bristle displacement, MPa/mm.
    pub bristle_mpa_mm: f64,
    /// Slide along x per depth while pressing.
    pub press: f64,
    /// Normal force per friction along x.
    pub lean: f64,
    /// Normal force that full shear adds, share.
    pub heave: f64,
    /// Excess of friction towards −x, share.
    pub odd: f64,
}

/// The sizes of what `vary` changes, in its order.
const VARIED: [f64; 14] = [1.0, 1.0, 0.10, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.002, 0.004, 0.006, 0.004];

impl Finger {
    /// A finger of a seed, away from the shipped model's geometry.
    pub fn random(random: &mut Random) -> Self {
        Self {
            normal_n: random.between(0.18, 0.40),
            normal_exponent: random.between(1.5, 1.9),
            normal_rate: random.between(0.0, 0.5),
            area_mm2: random.between(58.0, 74.0),
            area_exponent: random.between(0.85, 1.1),
            aspect: random.between(1.0, 1.4),
            bell: random.between(0.4, 1.0),
            tilt: random.between(0.0, 0.3),
            lambda: random.between(0.06, 0.11),
            beta: random.between(0.40, 0.55),
            bulk_n_mm: random.between(0.35, 0.8),
            bulk_ratio: random.between(0.7, 1.1),
            bulk_exponent: random.between(0.35, 0.7),
            bristle_mpa_mm: random.between(0.03, 0.09),
            press: random.between(-0.04, 0.04),
            lean: random.between(-0.04, 0.04),
            heave: random.between(0.0, 0.05),
            odd: random.between(-0.012, 0.012),
        }
    }

    /// Bristles and bulk in balance at a depth and the state's plate position.
    fn relax(&self, state: &mut Pressed, depth: f64, stiff: f64, strength: f64) {
        let Pressed { bristles, bulk, plate, .. } = state;
        let plate = *plate;
        let area = self.area(depth);
        let (ax, ay) =
            ((area * self.aspect / std::f64::consts::PI).sqrt(), (area / self.aspect / std::f64::consts::PI).sqrt());
        let peak = self.load(depth) * stiff / area * (self.bell + 1.0);
        let (mut covered, mut inside) = (0.0, Vec::with_capacity(bristles.len()));
        for (i, b) in bristles.iter_mut().enumerate() {
            let r2 = (b.at[0] / ax).powi(2) + (b.at[1] / ay).powi(2);
            // Part of a cell at the rim is in contact.
            let cover = ((1.0 - r2.sqrt()) * ax.min(ay) + 0.5).clamp(0.0, 1.0);
            if cover <= 0.0 {
                b.stretch = [plate[0] - bulk[0], plate[1] - bulk[1]];
                continue;
            }
            let p = peak * (1.0 - r2).max(0.02).powf(self.bell) * (1.0 + self.tilt * b.at[0] / ax);
            covered += cover;
            inside.push((i, cover, strength * self.lambda * p.max(1e-6).powf(self.beta)));
        }
        if inside.is_empty() {
            (state.force, state.ceiling) = ([0.0; 2], 0.0);
            return;
        }
        let cell = area / covered;
        let k = self.bristle_mpa_mm * stiff;
        let bulk_x = self.bulk_n_mm * stiff * depth.powf(self.bulk_exponent);
        let bulk_k = [bulk_x, bulk_x * self.bulk_ratio];
        // The balance is the minimum of a convex energy (springs and Huber's function), so Newton's steps that lower it
        // arrive.
        let evaluate = |bulk: [f64; 2]| {
            let mut balance = Balance {
                energy: 0.5 * (bulk_k[0] * bulk[0] * bulk[0] + bulk_k[1] * bulk[1] * bulk[1]),
                force: [0.0; 2],
                ceiling: 0.0,
                stiffness: [bulk_k[0], 0.0, bulk_k[1]],
            };
            for &(i, cover, tau) in &inside {
                // stretch holds the plate position at which the bristle is slack.
                let s = bristles[i].stretch;
                let q = [k * (plate[0] - bulk[0] - s[0]), k * (plate[1] - bulk[1] - s[1])];
                let a = cover * cell;
                balance.add(q, a, tau, k);
            }
            balance
        };
        let mut here = evaluate(*bulk);
        for _ in 0..100 {
            let lack = [here.force[0] - bulk_k[0] * bulk[0], here.force[1] - bulk_k[1] * bulk[1]];
            if lack[0].abs() + lack[1].abs() < 1e-9 {
                break;
            }
            let [xx, xy, yy] = here.stiffness;
            let det = xx * yy - xy * xy;
            let by = [(yy * lack[0] - xy * lack[1]) / det, (xx * lack[1] - xy * lack[0]) / det];
            let slope = by[0] * lack[0] + by[1] * lack[1];
            let mut share = 1.0;
            loop {
                let next = [bulk[0] + share * by[0], bulk[1] + share * by[1]];
                let there = evaluate(next);
                // The last digits of the energy mean nothing near the minimum.
                if there.energy <= here.energy - 1e-4 * share * slope + 1e-15 || share < 1e-9 {
                    *bulk = next;
                    here = there;
                    break;
                }
                share *= 0.5;
            }
        }
        let (force, ceiling) = (here.force, here.ceiling);
        for &(i, _, tau) in &inside {
            let s = bristles[i].stretch;
            let q = [k * (plate[0] - bulk[0] - s[0]), k * (plate[1] - bulk[1] - s[1])];
            let size = q[0].hypot(q[1]);
            if size > tau {
                let over = 1.0 - tau / size;
                bristles[i].stretch = [s[0] + q[0] / k * over, s[1] + q[1] / k * over];
            }
        }
        (state.force, state.ceiling) = (force, ceiling);
    }
}

impl Stepped for Finger {
    type State = Pressed;

    fn in_the_air(&self) -> Pressed {
        const GRID: f64 = 1.0;
        let places = (-7..=7).flat_map(|i| (-7..=7).map(move |j| (f64::from(i), f64::from(j))));
        let at = |(i, j)| Bristle { at: [GRID * (i + 0.13), GRID * (j - 0.21)], stretch: [0.0; 2] };
        let bristles = places.map(at).collect();
        Pressed { bristles, bulk: [0.0; 2], plate: [0.0; 2], force: [0.0; 2], ceiling: 0.0 }
    }

    fn load(&self, depth: f64) -> f64 {
        self.normal_n * depth.powf(self.normal_exponent) * (self.normal_rate * (depth - 1.0)).exp()
    }

    fn area(&self, depth: f64) -> f64 {
        self.area_mm2 * depth.powf(self.area_exponent)
    }

    fn press(&self) -> [f64; 2] {
        [self.press, 0.0]
    }

    fn steps(&self, sunk_mm: f64, slide_mm: f64) -> f64 {
        (sunk_mm / 0.1).ceil().max(slide_mm / 0.25).clamp(1.0, 14.0).floor()
    }

    fn step(&self, state: &mut Pressed, step: &Step<'_>) {
        let Step { depth_mm, slide_mm, moment, influence, .. } = *step;
        let odd = if moment.path_mm > 0.0 { 1.0 - self.odd * moment.direction.cos() } else { 1.0 };
        state.plate = [0, 1].map(|k| state.plate[k] + slide_mm[k]);
        self.relax(state, depth_mm, influence.stiffness, influence.strength * odd);
    }

    fn forces(&self, state: &Pressed, depth_mm: f64, influence: &Influence) -> (f64, [f64; 2]) {
        let [x, y] = state.force;
        let share = if state.ceiling > 0.0 { x.hypot(y) / state.ceiling } else { 0.0 };
        let heaved = self.load(depth_mm) * influence.stiffness * (1.0 + self.heave * share * share);
        (heaved + self.lean * x, state.force)
    }
}

impl Simulator for Finger {
    fn freedoms(&self) -> &'static [f64] {
        &VARIED
    }

    fn vary(&self, k: usize, by: f64) -> Box<dyn Simulator> {
        let mut f = self.clone();
        match k {
            0 => f.normal_n *= 1.0 + by,
            1 => f.lambda *= 1.0 + by,
            2 => {
                f.bulk_n_mm *= 1.0 + by;
                f.bristle_mpa_mm *= 1.0 + by;
            }
            3 => f.normal_exponent += by,
            4 => f.normal_rate += by,
            5 => f.area_exponent += by,
            6 => f.bulk_exponent += by,
            7 => f.bulk_ratio *= 1.0 + by,
            8 => f.bristle_mpa_mm *= 1.0 + 2.0 * by,
            9 => f.bell *= 1.0 + by,
            10 => f.press += by,
            11 => f.lean += by,
            12 => f.heave += by,
            _ => f.odd += by,
        }
        Box::new(f)
    }

    fn readings(&self, stroke: &Stroke, effects: &[Effect], scatter: &Scatter) -> Vec<[f64; 3]> {
        readings(self, stroke, effects, scatter)
    }
}

/// A finger in contact.
pub struct Pressed {
    bristles: Vec<Bristle>,
    bulk: [f64; 2],
    plate: [f64; 2],
    /// Friction, N.
    force: [f64; 2],
    /// Its largest possible size, N.
    ceiling: f64,
}

struct Bristle {
    at: [f64; 2],
    stretch: [f64; 2],
}

/// Bristles and bulk at a position of the bulk.
struct Balance {
    energy: f64,
    force: [f64; 2],
    ceiling: f64,
    /// Second derivative of the energy: xx, xy, yy.
    stiffness: [f64; 3],
}

impl Balance {
    /// A patch of area `a` whose bristles would carry the traction `q` if they stuck.
    fn add(&mut self, q: [f64; 2], a: f64, tau: f64, k: f64) {
        let size = q[0].hypot(q[1]);
        let (mut back, mut across) = (1.0, 0.0);
        if size > tau {
            self.energy += a * tau * (size - 0.5 * tau) / k;
            back = tau / size;
            across = back;
        } else {
            self.energy += 0.5 * a * size * size / k;
        }
        // Along the traction a slipping patch yields, across it is held by its own tension.
        let n = if across > 0.0 { [q[0] / size, q[1] / size] } else { [0.0; 2] };
        self.stiffness[0] += a * k * (back - across * n[0] * n[0]);
        self.stiffness[1] -= a * k * across * n[0] * n[1];
        self.stiffness[2] += a * k * (back - across * n[1] * n[1]);
        self.force[0] += a * q[0] * back;
        self.force[1] += a * q[1] * back;
        self.ceiling += a * tau;
    }
}
