//! Parameterisation of the reduced model: the vector of numbers that the fit varies, and the model's parameters as functions of it.
//!
//! Main type: [`Parameterisation`]. Rising tables are sums of exponentials, shares are normalised exponentials and bounded
//! numbers are hyperbolic tangents; quantities with a bound of passivity are clamped to it. Uses tables and `fingerpad`.

use std::ops::Range;

use fingerpad::build::{Node, ParamsOf, SpringParams};

use super::tables::Knots;

/// Layout of the parameter vector.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameterisation {
    /// Depth of the last node, mm.
    pub depth_max_mm: f64,
    /// Knots of the quantities that rise with depth.
    pub rising: Knots,
    /// Knots of the others.
    pub gentle: Knots,
    /// Bit mask of the springs whose pairs lie along y; the others lie along x.
    pub along_y: usize,
    /// Exponent of the local friction law, for retuning.
    pub pressure_exponent: f64,
}

/// Initial guess of the fit in physical quantities: power laws `factor d^exponent` of the depth d in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InitialGuess {
    /// Normal force, N.
    pub normal: [f64; 2],
    /// Contact area, mm².
    pub area: [f64; 2],
    /// Friction limit, N.
    pub limit: [f64; 2],
    /// Tangential stiffness along x, N/mm.
    pub stiffness: [f64; 2],
    /// Stiffness along y over that along x.
    pub ratio: f64,
}

/// Largest value in the fit over the bound of passivity; the rest is a margin for rounding.
pub(crate) const ALLOWED: f64 = 0.97;
/// Largest |q| times the displacement of a spring on its tilted limit, and that displacement over the yield slide.
pub(crate) const ODD_MAX: f64 = 0.4;
pub(crate) const REACH: f64 = 1.29;
/// Largest tilt of a limit.
const TILT_MAX: f64 = 0.249;
/// Change of the stiffness per mm of depth for a slope parameter of 1, share of the stiffness at depth 0.
const SLOPE: f64 = 0.2;
/// Yield slide in place of an unknown one, mm.
pub(crate) const YIELD_MAX_MM: f64 = 9.9;
/// Stiffness of the spring that touches first and of each of the others at the start of a fit, in proportion.
const FIRST_SHARES: [f64; 2] = [1.5, 0.6];
/// Unit of the arms of pairs, mm, and largest distance of the centre of a pair from the point under first touch, mm.
const ARM_MM: f64 = 3.0;
const CENTRE_MAX_MM: f64 = 6.0;

/// Reads a parameter vector from start to end.
struct Cursor<'a>(&'a [f64]);

impl<'a> Cursor<'a> {
    fn take(&mut self, n: usize) -> &'a [f64] {
        let (head, tail) = self.0.split_at(n);
        self.0 = tail;
        head
    }

    fn one(&mut self) -> f64 {
        self.take(1)[0]
    }
}

fn rising(theta: &[f64]) -> Vec<f64> {
    theta
        .iter()
        .scan(0.0, |sum, t| {
            *sum += t.clamp(-40.0, 10.0).exp();
            Some(*sum)
        })
        .collect()
}

fn shares(theta: &[f64]) -> Vec<f64> {
    let parts: Vec<f64> = theta.iter().map(|t| t.clamp(-12.0, 12.0).exp()).collect();
    let sum: f64 = parts.iter().sum();
    parts.iter().map(|p| p / sum).collect()
}

/// A spring's yield slide over depth: `factor (d − touch)^exponent`, times the exponential of a table.
struct YieldLaw<'a> {
    touch_mm: f64,
    factor_mm: f64,
    exponent: f64,
    bend: &'a [f64],
}

impl Parameterisation {
    /// A parameterisation with `rising` and `gentle` knots over depth.
    pub fn new(rising: usize, gentle: usize, depth_max_mm: f64, pressure_exponent: f64) -> Self {
        Self {
            depth_max_mm,
            rising: Knots::graded(rising, depth_max_mm),
            gentle: Knots::graded(gentle, depth_max_mm),
            along_y: 0,
            pressure_exponent,
        }
    }

    /// Range of the parameters on which normal force and friction depend.
    pub fn of_forces(&self, springs: usize) -> Range<usize> {
        let gentle = self.gentle.0.len();
        // Normal force; touch, factor, exponent and bend of the yield slides; shares; stiffness; four tables; odd stiffness.
        let of_springs = springs * (4 + gentle);
        0..self.rising.0.len() + of_springs + 2 + 2 * gentle + gentle + 2 * (gentle + 1) + 1
    }

    /// Ranges of the bends of each spring's yield slide.
    pub fn of_bends(&self, springs: usize) -> Vec<Range<usize>> {
        let gentle = self.gentle.0.len();
        (0..springs).map(|j| self.rising.0.len() + j * (3 + gentle) + 3).map(|start| start..start + gentle).collect()
    }

    /// Range of the parameters on which only area and stick ratio depend.
    pub fn of_contact(&self, springs: usize) -> Range<usize> {
        let start = self.of_forces(springs).end;
        start..start + self.rising.0.len() + 1 + springs * (self.gentle.0.len() + 1) + 2
    }

    /// Range of the parameters on which only responses to spin, the spin moment and the centre of pressure depend.
    pub fn of_spin(&self, springs: usize) -> Range<usize> {
        let start = self.of_contact(springs).end;
        start..start + 2 * springs + self.gentle.0.len() + 2
    }

    /// The vector of an initial guess.
    ///
    /// * `touch_mm`: depth at which each spring touches, mm; that of the first spring is always 0
    pub fn start(&self, touch_mm: &[f64], start: &InitialGuess) -> Vec<f64> {
        let springs = touch_mm.len();
        let gentle = self.gentle.0.len();
        let table = |[factor, exponent]: [f64; 2]| {
            let mut last = 0.0;
            let step = |d: &f64| {
                let value = factor * d.powf(exponent.max(0.2));
                let step = (value - last).ln();
                last = value;
                step
            };
            self.rising.0.iter().map(step).collect::<Vec<f64>>()
        };
        let mut theta = table(start.normal);
        // The stiffness depends little on depth; this is its value in the middle of the range.
        let stiffness = start.stiffness[0] * (0.5 * self.depth_max_mm).powf(start.stiffness[1]);
        // Springs of a body that touches with depth slip after a slide that grows as their own depth (Popov and Heß 2015), here
        // with one factor for all that makes the limit right in the middle of the range.
        let middle = 0.5 * self.depth_max_mm;
        let mean = |j: usize| FIRST_SHARES[j.min(1)] * (middle - touch_mm[j]).max(0.0);
        let all: f64 = (0..springs).map(|j| FIRST_SHARES[j.min(1)]).sum();
        let limit = start.limit[0] * middle.powf(start.limit[1]);
        let factor = limit / stiffness * all / (0..springs).map(mean).sum::<f64>();
        for &touch in touch_mm {
            theta.extend([touch.max(1e-3).ln(), factor.ln(), 0.0]);
            theta.extend(vec![0.0; gentle]);
        }
        theta.extend((0..springs).map(|j| FIRST_SHARES[j.min(1)].ln()));
        theta.extend([stiffness.ln(), start.ratio.ln()]);
        // Slopes of both stiffnesses, strength ratio, tilt, press coupling, odd stiffness.
        theta.extend(vec![0.0; 2 * gentle + gentle + 2 * (gentle + 1) + 1]);
        theta.extend(table(start.area));
        // Area tilt, area shares, sharpness, lead of slip.
        theta.extend(vec![0.0; 1 + springs * gentle]);
        theta.extend(vec![-1.0; springs]);
        theta.extend([0.0; 2]);
        // Springs that touch later are farther from the centre.
        theta.extend((0..springs).flat_map(|j| [0.0, (1.0 + 2.0 * j as f64 / springs as f64).ln()]));
        theta.extend(vec![0.0; gentle + 2]);
        theta
    }

    /// The arm of a spring's pair, mm, along x or along y; other directions would break the symmetry of the finger.
    fn arm(&self, spring: usize, length_mm: f64) -> [f64; 2] {
        if self.along_y >> spring & 1 == 1 { [0.0, length_mm] } else { [length_mm, 0.0] }
    }

    /// The parameters of a model with bands of 0.
    pub fn params<const M: usize, const N: usize>(&self, theta: &[f64]) -> ParamsOf<M, N, f64> {
        let gentle = self.gentle.0.len();
        let mut cursor = Cursor(theta);
        let normal = rising(cursor.take(self.rising.0.len()));
        let laws: [YieldLaw<'_>; M] = std::array::from_fn(|j| {
            let head = cursor.take(3);
            YieldLaw {
                touch_mm: if j == 0 { 0.0 } else { head[0].exp().min(0.8 * self.depth_max_mm) },
                factor_mm: head[1].clamp(-20.0, 5.0).exp(),
                exponent: head[2].exp().clamp(0.2, 4.0),
                bend: cursor.take(gentle),
            }
        });
        let stiffness_share = shares(cursor.take(M));
        let stiffness_x = cursor.one().exp();
        let stiffness_n_mm = [stiffness_x, stiffness_x * cursor.one().exp().clamp(0.3, 3.0)];
        let slopes =
            [0, 1].map(|k| -> Vec<f64> { cursor.take(gentle).iter().map(|t| t * SLOPE * stiffness_n_mm[k]).collect() });
        let strength_ratio: Vec<f64> = cursor.take(gentle).iter().map(|t| t.exp().clamp(0.51, 1.95)).collect();
        let signed = |cursor: &mut Cursor, bound: f64| {
            let start = bound * cursor.one().tanh();
            (start, cursor.take(gentle).iter().map(|t| bound * t.tanh()).collect::<Vec<f64>>())
        };
        let tilt = signed(&mut cursor, TILT_MAX);
        let press = signed(&mut cursor, 0.99);
        let odd = cursor.one().tanh();
        let area = rising(cursor.take(self.rising.0.len()));
        let area_tilt = 0.5 * cursor.one().tanh();
        let area_shares: Vec<&[f64]> = (0..M).map(|_| cursor.take(gentle)).collect();
        let sharpness = cursor.take(M);
        let slip_lead = [0, 1].map(|_| ALLOWED * cursor.one().tanh());
        let places: Vec<&[f64]> = (0..M).map(|_| cursor.take(2)).collect();
        let centre: Vec<f64> = cursor.take(gentle).to_vec();
        let centre_per_n = [cursor.one(), cursor.one()];

        let mut nodes: [Node<M, f64>; N] = [Node::default(); N];
        let cell = self.depth_max_mm / (N - 1) as f64;
        let mut last = [0.0; M];
        for (i, node) in nodes.iter_mut().enumerate() {
            let d = cell * i as f64;
            let gentle = |start: f64, values: &[f64]| self.gentle.value(start, values, d);
            for (law, last) in laws.iter().zip(&mut last) {
                let depth = (d - law.touch_mm).max(0.0);
                let bend = gentle(law.bend[0], law.bend).clamp(-20.0, 10.0).exp();
                let slide = law.factor_mm * depth.powf(law.exponent) * bend;
                *last = slide.min(YIELD_MAX_MM).max(*last);
            }
            let all: Vec<f64> = area_shares.iter().map(|t| gentle(t[0], t)).collect();
            let area_share = shares(&all);
            *node = Node {
                normal_force_n: self.rising.value(0.0, &normal, d).max(0.0),
                contact_area_mm2: self.rising.value(0.0, &area, d).max(0.0),
                stiffness_slope_n_mm2: [0, 1].map(|k| gentle(slopes[k][0], &slopes[k])),
                yield_slide_mm: last,
                strength_ratio: gentle(strength_ratio[0], &strength_ratio),
                tilt_x: gentle(tilt.0, &tilt.1),
                press_coupling: gentle(press.0, &press.1),
                area_share: std::array::from_fn(|j| area_share[j]),
                pressure_centre_mm: gentle(centre[0], &centre),
                spin_limit_share: 1.0,
                band_normal_n: 0.0,
            };
        }
        let longest = last.iter().fold(1e-6, |a: f64, b| a.max(*b));
        ParamsOf {
            depth_max_mm: self.depth_max_mm,
            stiffness_n_mm,
            springs: std::array::from_fn(|j| SpringParams {
                stiffness_share: stiffness_share[j],
                sharpness: 1.0 / (1.0 + (-sharpness[j]).exp()),
                centre_mm: CENTRE_MAX_MM * places[j][0].tanh(),
                arm_mm: self.arm(j, ARM_MM * places[j][1].clamp(-3.0, 1.4).exp()),
            }),
            nodes,
            odd_per_mm: (ALLOWED * ODD_MAX / (REACH * longest) * odd).clamp(-1.99, 1.99),
            area_tilt,
            pressure_centre_per_n: centre_per_n,
            spin_cross: 0.0,
            slip_lead,
            band_normal_middle: 1.0,
            band_normal_slip: 1.0,
            band_friction_stick: 0.0,
            band_friction_middle: 0.0,
            band_friction_slip: 0.0,
            pressure_exponent: self.pressure_exponent,
            pose_deg: [30.0, 0.0],
        }
    }
}

/// The same parameters in single precision.
pub fn rounded<const M: usize, const N: usize>(p: &ParamsOf<M, N, f64>) -> ParamsOf<M, N> {
    let node = |n: &Node<M, f64>| Node {
        normal_force_n: n.normal_force_n as f32,
        contact_area_mm2: n.contact_area_mm2 as f32,
        stiffness_slope_n_mm2: n.stiffness_slope_n_mm2.map(|v| v as f32),
        yield_slide_mm: n.yield_slide_mm.map(|v| v as f32),
        strength_ratio: n.strength_ratio as f32,
        tilt_x: n.tilt_x as f32,
        press_coupling: n.press_coupling as f32,
        area_share: n.area_share.map(|v| v as f32),
        pressure_centre_mm: n.pressure_centre_mm as f32,
        spin_limit_share: n.spin_limit_share as f32,
        band_normal_n: n.band_normal_n as f32,
    };
    ParamsOf {
        depth_max_mm: p.depth_max_mm as f32,
        stiffness_n_mm: p.stiffness_n_mm.map(|v| v as f32),
        springs: p.springs.map(|s| SpringParams {
            stiffness_share: s.stiffness_share as f32,
            sharpness: s.sharpness as f32,
            centre_mm: s.centre_mm as f32,
            arm_mm: s.arm_mm.map(|v| v as f32),
        }),
        nodes: std::array::from_fn(|i| node(&p.nodes[i])),
        odd_per_mm: p.odd_per_mm as f32,
        area_tilt: p.area_tilt as f32,
        pressure_centre_per_n: p.pressure_centre_per_n.map(|v| v as f32),
        spin_cross: p.spin_cross as f32,
        slip_lead: p.slip_lead.map(|v| v as f32),
        band_normal_middle: p.band_normal_middle as f32,
        band_normal_slip: p.band_normal_slip as f32,
        band_friction_stick: p.band_friction_stick as f32,
        band_friction_middle: p.band_friction_middle as f32,
        band_friction_slip: p.band_friction_slip as f32,
        pressure_exponent: p.pressure_exponent as f32,
        pose_deg: p.pose_deg.map(|v| v as f32),
    }
}

#[cfg(test)]
impl InitialGuess {
    /// Values near those of the default finger, for tests.
    pub(crate) fn of_a_finger() -> Self {
        Self { normal: [0.33, 1.6], area: [65.0, 1.0], limit: [0.5, 1.3], stiffness: [0.3, 0.2], ratio: 0.65 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The initial guess is a valid model. Vectors around it violate at most the inequalities of passivity, which the fit enforces by a
    /// residual.
    #[test]
    fn vectors_are_models() {
        let layout = Parameterisation::new(12, 4, 2.5, 0.46);
        let start = layout.start(&[0.0, 0.1, 0.8], &InitialGuess::of_a_finger());
        assert_eq!(start.len(), layout.of_spin(3).end);
        assert!(layout.params::<3, 37>(&start).try_build().is_ok());
        let mut seed = 7u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 40) as f64 / (1u64 << 24) as f64 - 0.5
        };
        let mut accepted = 0;
        for case in 0..2000 {
            let theta: Vec<f64> = start.iter().map(|t| t + 0.3 * next()).collect();
            match layout.params::<3, 37>(&theta).try_build() {
                Ok(_) => accepted += 1,
                Err(fingerpad::Error::NotPassive { .. }) => {}
                Err(error) => panic!("seed 7, case {case}: {error}"),
            }
        }
        assert!(accepted > 500, "{accepted}");
    }
}
