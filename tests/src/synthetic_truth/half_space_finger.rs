//! A finger as an elastic half-space on an elliptic contact.
//!
//! Patches of an elliptic grid slip where their traction reaches tau_0 + alpha p; the displacement of each follows from the
//! tractions of all [Cerruti 1882; Johnson 1985, section 3.6]. The load grows exponentially with depth; the pressure is
//! Hertz's and leans with the friction.
//!
//! Main type: [`HalfSpaceFinger`].

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use super::Random;
use super::effects::{Effect, Influence};
use super::laboratory::Scatter;
use super::protocol::Stroke;
use super::simulator::{Simulator, Step, Stepped, readings};

/// Poisson's ratio: soft tissue keeps its volume, and pressure then shears nothing.
pub const POISSON: f64 = 0.5;

/// Geometry and material of one finger.
#[derive(Clone)]
pub struct HalfSpaceFinger {
    /// Normal force at 1 mm, N.
    pub load_n: f64,
    /// Rate of the exponential load curve, 1/mm.
    pub load_rate: f64,
    /// Contact area at 1 mm, mm².
    pub area_mm2: f64,
    /// Rate at which the area saturates over depth, 1/mm.
    pub area_rate: f64,
    /// Pressure's tilt along x and y, share at the rim.
    pub tilt: [f64; 2],
    /// Pressure's lean along the friction in full slip, share at the rim.
    pub lean: f64,
    /// Shear modulus along x, MPa.
    pub shear_mpa: f64,
    /// Shear modulus along y over that along x.
    pub shear_ratio: f64,
    /// Strength at no pressure, MPa.
    pub tau0_mpa: f64,
    /// Strength per pressure.
    pub alpha: f64,
    /// Slide per depth while pressing, x and y.
    pub press: [f64; 2],
    /// Normal force per friction along x and y.
    pub incline: [f64; 2],
    /// Normal force that full slip adds, share.
    pub rise: f64,
    grid: Arc<Grid>,
}

const FREEDOMS: [f64; 15] =
    [1.0, 1.0, 0.10, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.002, 0.002, 0.004, 0.004, 0.006, 0.02];

impl HalfSpaceFinger {
    /// A finger of a seed.
    pub fn random(random: &mut Random) -> Self {
        Self {
            load_n: random.between(0.18, 0.40),
            load_rate: random.between(0.7, 1.5),
            area_mm2: random.between(58.0, 74.0),
            area_rate: random.between(0.03, 0.25),
            tilt: [random.between(-0.25, 0.25), random.between(-0.1, 0.1)],
            lean: random.between(0.0, 0.4),
            shear_mpa: random.between(0.012, 0.026),
            shear_ratio: random.between(0.75, 1.1),
            tau0_mpa: random.between(0.0025, 0.0050),
            alpha: random.between(0.3, 0.7),
            press: [random.between(-0.04, 0.04), random.between(-0.03, 0.03)],
            incline: [random.between(-0.04, 0.04), random.between(-0.02, 0.02)],
            rise: random.between(0.0, 0.05),
            grid: Arc::new(Grid::new(random.between(1.0, 1.5))),
        }
    }

    /// The finger with a round contact, an even pressure, and no coupling of normal force and shear.
    pub fn round(&self) -> Self {
        Self {
            tilt: [0.0; 2],
            lean: 0.0,
            shear_ratio: 1.0,
            press: [0.0; 2],
            incline: [0.0; 2],
            rise: 0.0,
            grid: Arc::new(Grid::new(1.0)),
            ..self.clone()
        }
    }

    /// Largest force of each patch, N; 0 out of contact.
    fn limits(&self, depth_mm: f64, influence: &Influence, shear: &Shear) -> Vec<f64> {
        let area = self.area(depth_mm);
        let load = self.load(depth_mm) * influence.stiffness;
        let total = shear.total();
        let share = if shear.ceiling_n > 0.0 { total[0].hypot(total[1]) / shear.ceiling_n } else { 0.0 };
        let size = total[0].hypot(total[1]).max(1e-12);
        let slope = [0, 1].map(|k| self.tilt[k] + self.lean * share * total[k] / size);
        let semi = self.grid.semi_axes(area);
        let weights: Vec<f64> = self
            .grid
            .patches
            .iter()
            .map(|p| {
                let leaning = 1.0 + slope[0] * p.at_mm[0] / semi[0] + slope[1] * p.at_mm[1] / semi[1];
                p.hertz_share(area) * leaning.max(0.0)
            })
            .collect();
        let all: f64 = weights.iter().sum();
        let strength = |(p, w): (&Patch, &f64)| {
            influence.strength * (self.tau0_mpa * p.covered_mm2(area) + self.alpha * load * w / all)
        };
        self.grid.patches.iter().zip(&weights).map(strength).collect()
    }
}

impl Simulator for HalfSpaceFinger {
    fn freedoms(&self) -> &'static [f64] {
        &FREEDOMS
    }

    fn vary(&self, freedom: usize, by: f64) -> Box<dyn Simulator> {
        let mut f = self.clone();
        match freedom {
            0 => f.load_n *= 1.0 + by,
            1 => {
                f.tau0_mpa *= 1.0 + by;
                f.alpha *= 1.0 + by;
            }
            2 => f.shear_mpa *= 1.0 + by,
            3 => f.load_rate += by,
            4 => f.area_rate += by,
            5 => f.shear_ratio *= 1.0 + by,
            6 => f.alpha *= 1.0 + by,
            7 => f.tilt[0] += by,
            8 => f.lean += by,
            9 => f.press[0] += by,
            10 => f.press[1] += by,
            11 => f.incline[0] += by,
            12 => f.incline[1] += by,
            13 => f.rise += by,
            _ => f.tilt[1] += by,
        }
        Box::new(f)
    }

    fn readings(&self, stroke: &Stroke, effects: &[Effect], scatter: &Scatter) -> Vec<[f64; 3]> {
        readings(self, stroke, effects, scatter)
    }
}

impl Stepped for HalfSpaceFinger {
    type State = Shear;

    fn in_the_air(&self) -> Shear {
        Shear::new(&self.grid)
    }

    fn load(&self, depth_mm: f64) -> f64 {
        self.load_n * (self.load_rate * depth_mm).exp_m1() / self.load_rate.exp_m1()
    }

    fn area(&self, depth_mm: f64) -> f64 {
        let area = self.area_mm2 * (-self.area_rate * depth_mm).exp_m1() / (-self.area_rate).exp_m1();
        area.min(LARGEST_AREA_MM2)
    }

    fn press(&self) -> [f64; 2] {
        self.press
    }

    fn steps(&self, sunk_mm: f64, slide_mm: f64) -> f64 {
        (sunk_mm / 0.1).max(slide_mm / 0.3).ceil()
    }

    fn step(&self, state: &mut Shear, step: &Step<'_>) {
        let limits = self.limits(step.depth_mm, step.influence, state);
        let shear_mpa = self.shear_mpa * step.influence.stiffness;
        state.follow(&self.grid, step.slide_mm, &limits, [shear_mpa, shear_mpa * self.shear_ratio]);
    }

    fn forces(&self, state: &Shear, depth_mm: f64, influence: &Influence) -> (f64, [f64; 2]) {
        let force = state.total();
        let share = force[0].hypot(force[1]) / state.ceiling_n.max(1e-12);
        let risen = self.load(depth_mm) * influence.stiffness * (1.0 + self.rise * share * share);
        (risen + self.incline[0] * force[0] + self.incline[1] * force[1], force)
    }
}

/// Contact area that the grid covers, mm².
const LARGEST_AREA_MM2: f64 = 160.0;
/// Patches of each elliptic ring, from the middle outwards.
const SECTORS: [usize; 6] = [4, 8, 8, 12, 12, 16];

/// A sector of an elliptic ring of the skin.
struct Patch {
    /// Its centre, mm.
    at_mm: [f64; 2],
    /// Contact areas at which the ring begins and ends to touch, mm².
    ring_mm2: [f64; 2],
    /// How many patches the ring has.
    sectors: f64,
    /// Points that stand for equal parts of it, mm.
    points_mm: Vec<[f64; 2]>,
}

impl Patch {
    /// Its area in contact, mm².
    fn covered_mm2(&self, area: f64) -> f64 {
        (area.min(self.ring_mm2[1]) - self.ring_mm2[0]).max(0.0) / self.sectors
    }

    /// Its share of the load under Hertz's pressure sqrt(1 − r²): exact over the ring.
    fn hertz_share(&self, area: f64) -> f64 {
        let outside = |a: f64| (1.0 - (a / area).min(1.0)).powf(1.5);
        (outside(self.ring_mm2[0]) - outside(self.ring_mm2[1])) / self.sectors
    }
}

/// The skin's patches, fixed to the finger, and what they do to each other.
struct Grid {
    aspect: f64,
    patches: Vec<Patch>,
    /// Displacement of a patch per force on another for a shear modulus of 1 MPa, mm/N: xx, xy, yy; row after row.
    compliance: [Vec<f64>; 3],
}

impl Grid {
    /// Elliptic rings of equal width; `aspect`: long (x) over short semi-axis.
    fn new(aspect: f64) -> Self {
        const PARTS: usize = 3;
        let rings = SECTORS.len() as f64;
        let largest = (LARGEST_AREA_MM2 / PI).sqrt();
        let place = |r: f64, angle: f64| [r * aspect.sqrt() * angle.cos(), r / aspect.sqrt() * angle.sin()];
        let mut patches = Vec::new();
        for (ring, sectors) in SECTORS.into_iter().enumerate() {
            let [inner, outer] = [ring, ring + 1].map(|k| (k as f64 / rings * largest).powi(2));
            for sector in 0..sectors {
                let angle = |share: f64| TAU * (sector as f64 + share) / sectors as f64;
                let mut points_mm = Vec::new();
                for i in 0..PARTS {
                    let r = (inner + (outer - inner) * (i as f64 + 0.5) / PARTS as f64).sqrt();
                    for j in 0..PARTS {
                        points_mm.push(place(r, angle((j as f64 + 0.5) / PARTS as f64)));
                    }
                }
                let mean = |k: usize| points_mm.iter().map(|p| p[k]).sum::<f64>() / points_mm.len() as f64;
                patches.push(Patch {
                    at_mm: [mean(0), mean(1)],
                    ring_mm2: [PI * inner, PI * outer],
                    sectors: sectors as f64,
                    points_mm,
                });
            }
        }
        let n = patches.len();
        let mut compliance = [0, 1, 2].map(|_| vec![0.0; n * n]);
        for (i, a) in patches.iter().enumerate() {
            for (j, b) in patches.iter().enumerate() {
                let between = mean_compliance(a, b);
                (0..3).for_each(|k| compliance[k][i * n + j] = between[k]);
            }
        }
        Self { aspect, patches, compliance }
    }

    fn semi_axes(&self, area: f64) -> [f64; 2] {
        [(area * self.aspect / PI).sqrt(), (area / self.aspect / PI).sqrt()]
    }
}

/// Mean displacement of a patch per force spread evenly over another, shear modulus 1 MPa: xx, xy, yy.
fn mean_compliance(a: &Patch, b: &Patch) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for p in &a.points_mm {
        for q in &b.points_mm {
            let [x, y] = [p[0] - q[0], p[1] - q[1]];
            let r = x.hypot(y);
            if r == 0.0 {
                // Mean displacement of a disc as large as the part, under an even traction.
                let part = (a.ring_mm2[1] - a.ring_mm2[0]) / a.sectors / a.points_mm.len() as f64;
                let own = (2.0 - POISSON) / (2.0 * PI * (part / PI).sqrt()) * 8.0 / (3.0 * PI);
                sum = [sum[0] + own, sum[1], sum[2] + own];
            } else {
                let plain = (1.0 - POISSON) / r;
                let along = POISSON / r.powi(3);
                sum = [
                    sum[0] + (plain + along * x * x) / TAU,
                    sum[1] + along * x * y / TAU,
                    sum[2] + (plain + along * y * y) / TAU,
                ];
            }
        }
    }
    sum.map(|s| s / (a.points_mm.len() * b.points_mm.len()) as f64)
}

/// Forces of the patches and where each has slipped to.
pub struct Shear {
    plate_mm: [f64; 2],
    /// Forces along x and y, N.
    force_n: [Vec<f64>; 2],
    /// Plate position at which each patch would carry nothing if it were alone, mm.
    anchor_mm: Vec<[f64; 2]>,
    touching: Vec<bool>,
    /// Sum of the largest forces, N.
    ceiling_n: f64,
}

impl Shear {
    fn new(grid: &Grid) -> Self {
        let n = grid.patches.len();
        Self {
            plate_mm: [0.0; 2],
            force_n: [vec![0.0; n], vec![0.0; n]],
            anchor_mm: vec![[0.0; 2]; n],
            touching: vec![false; n],
            ceiling_n: 0.0,
        }
    }

    /// Friction, N.
    fn total(&self) -> [f64; 2] {
        [0, 1].map(|k| self.force_n[k].iter().sum())
    }

    /// Slides the plate: the forces that minimise the complementary energy within their limits, patch by patch until nothing
    /// moves.
    fn follow(&mut self, grid: &Grid, slide_mm: [f64; 2], limits: &[f64], moduli: [f64; 2]) {
        let n = grid.patches.len();
        let plate = [0, 1].map(|k| self.plate_mm[k] + slide_mm[k]);
        self.plate_mm = plate;
        self.ceiling_n = limits.iter().sum();
        for i in 0..n {
            let touches = limits[i] > 0.0;
            if touches && !self.touching[i] {
                // Skin that comes to touch is not stretched against the plate.
                let u = self.displacement(grid, i, moduli);
                self.anchor_mm[i] = [plate[0] - u[0], plate[1] - u[1]];
            }
            if !touches {
                (self.force_n[0][i], self.force_n[1][i]) = (0.0, 0.0);
            }
            self.touching[i] = touches;
        }
        let active: Vec<usize> = (0..n).filter(|i| self.touching[*i]).collect();
        for _ in 0..2000 {
            let mut moved = 0.0f64;
            for &i in &active {
                let gap = self.gap(grid, i, plate, moduli);
                let own = i * n + i;
                let stiff = moduli[0].min(moduli[1]) / grid.compliance[0][own].max(grid.compliance[2][own]);
                let [x, y] = [self.force_n[0][i] + stiff * gap[0], self.force_n[1][i] + stiff * gap[1]];
                let back = (limits[i] / x.hypot(y).max(1e-300)).min(1.0);
                moved = moved.max((back * x - self.force_n[0][i]).abs()).max((back * y - self.force_n[1][i]).abs());
                (self.force_n[0][i], self.force_n[1][i]) = (back * x, back * y);
            }
            if moved < 1e-8 {
                break;
            }
        }
        for i in active {
            let gap = self.gap(grid, i, plate, moduli);
            self.anchor_mm[i] = [self.anchor_mm[i][0] + gap[0], self.anchor_mm[i][1] + gap[1]];
        }
    }

    /// How far the plate has moved beyond the skin of a patch, mm.
    fn gap(&self, grid: &Grid, i: usize, plate: [f64; 2], moduli: [f64; 2]) -> [f64; 2] {
        let u = self.displacement(grid, i, moduli);
        [0, 1].map(|k| plate[k] - self.anchor_mm[i][k] - u[k])
    }

    /// Displacement of the skin at a patch under all forces, mm.
    fn displacement(&self, grid: &Grid, i: usize, [gx, gy]: [f64; 2]) -> [f64; 2] {
        let n = grid.patches.len();
        let [xx, xy, yy] = [0, 1, 2].map(|k| &grid.compliance[k][i * n..(i + 1) * n]);
        let [fx, fy] = [&self.force_n[0], &self.force_n[1]];
        let across = (gx * gy).sqrt();
        [product(xx, fx) / gx + product(xy, fy) / across, product(xy, fx) / across + product(yy, fy) / gy]
    }
}

/// Sum of products, four at a time.
fn product(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    for (a, b) in a.chunks_exact(4).zip(b.chunks_exact(4)) {
        (0..4).for_each(|k| sums[k] += a[k] * b[k]);
    }
    sums.iter().sum()
}
