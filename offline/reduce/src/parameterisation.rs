//! Parameterisation of the reduced model: the vector of numbers that the fit varies, and the model's parameters from it.
//!
//! Main type: [`Parameterisation`]. Monotone tables are sums of exponentials and shares are normalised exponentials, so that
//! every vector is a model; what passivity allows at most is cut off at its bound. Uses tables and `fingerpad`.

use fingerpad::{Node, ParamsOf, Slider};

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

/// Share of what passivity allows that the fit may use; the rest is for rounding.
const ALLOWED: f64 = 0.97;
/// Largest odd part of the elastic displacement at the limit, slip lengths.
const ODD_MAX: f64 = 0.249;
/// Largest share of the normal force that full shear may add or take off.
const SHEAR_MAX: f64 = 0.5;
/// Largest tilt of the limit.
const TILT_MAX: f64 = 0.249;

/// Reads the vector piece by piece.
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

impl Parameterisation {
    /// A parameterisation with `rising` and `gentle` knots over depth.
    pub fn new(rising: usize, gentle: usize, depth_max_mm: f64, pressure_exponent: f64) -> Self {
        Self {
            depth_max_mm,
            rising: Knots::graded(rising, depth_max_mm),
            gentle: Knots::graded(gentle, depth_max_mm),
            pressure_exponent,
        }
    }

    /// Length of the vector for `elements` elements.
    pub fn len(&self, elements: usize) -> usize {
        4 * self.rising.0.len() + 6 * self.gentle.0.len() + 2 + 2 * elements + 4
    }

    /// The vector of an initial guess.
    pub fn start(&self, elements: usize, start: &InitialGuess) -> Vec<f64> {
        let mut theta = Vec::with_capacity(self.len(elements));
        for [factor, exponent] in [start.normal, start.area, start.limit, start.stiffness] {
            let mut last = 0.0;
            for d in &self.rising.0 {
                let value = factor * d.powf(exponent.max(0.2));
                theta.push((value - last).ln());
                last = value;
            }
        }
        let gentle = self.gentle.0.len();
        theta.extend(vec![start.ratio.ln(); gentle]);
        // Strength ratio.
        theta.extend(vec![0.0; gentle]);
        // Press coupling and tilt, each with its value at depth 0.
        theta.extend(vec![0.0; 2 * (gentle + 1)]);
        // Normal force on shear: small.
        theta.extend(vec![0.1; 2 * gentle]);
        // Yield positions from near 0 to twice the mean, even shares.
        theta.extend((0..elements).map(|_| (2.2 / elements as f64).ln()));
        theta.extend(vec![0.0; elements]);
        theta.extend([-1.0, 0.0, 0.0, 0.0]);
        theta
    }

    /// The parameters of a model with bands of 0.
    pub fn params<const M: usize, const N: usize>(&self, theta: &[f64]) -> ParamsOf<M, N> {
        let mut cursor = Cursor(theta);
        let tables: [Vec<f64>; 4] = std::array::from_fn(|_| rising(cursor.take(self.rising.0.len())));
        let gentle = self.gentle.0.len();
        let ratio: Vec<f64> = cursor.take(gentle).iter().map(|t| t.exp().clamp(0.26, 3.9)).collect();
        let strength_ratio: Vec<f64> = cursor.take(gentle).iter().map(|t| t.exp().clamp(0.51, 1.95)).collect();
        let signed = |cursor: &mut Cursor, bound: f64| {
            let start = bound * cursor.one().tanh();
            (start, cursor.take(gentle).iter().map(|t| bound * t.tanh()).collect::<Vec<f64>>())
        };
        let press = signed(&mut cursor, 0.99);
        let tilt = signed(&mut cursor, TILT_MAX);
        let shear: [Vec<f64>; 2] =
            std::array::from_fn(|_| cursor.take(gentle).iter().map(|t| SHEAR_MAX * t.tanh()).collect());
        let positions = rising(cursor.take(M));
        let strength = shares(cursor.take(M));
        let between = |t: f64| 1.0 / (1.0 + (-t).exp());
        let turn_slip = 0.5 * between(cursor.one());
        let full_slip = 0.8 + 0.399 * between(cursor.one());
        let odd = ODD_MAX * cursor.one().tanh();
        let area_tilt = 0.5 * cursor.one().tanh();
        // Positions and shares as the core normalises them.
        let softness: f64 = (0..M).map(|j| strength[j] / positions[j]).sum();
        let energy: f64 = (0..M).map(|j| strength[j] * positions[j] * softness).sum();

        let mut nodes = [Node::default(); N];
        let cell = self.depth_max_mm / (N - 1) as f64;
        for (i, node) in nodes.iter_mut().enumerate() {
            let d = cell * i as f64;
            let [normal, area, limit, stiffness] =
                std::array::from_fn(|k| self.rising.value(0.0, &tables[k], d).max(0.0));
            *node = Node {
                normal_force_n: normal as f32,
                contact_area_mm2: area as f32,
                friction_limit_n: limit as f32,
                tangential_stiffness_n_mm: stiffness as f32,
                stiffness_ratio: self.gentle.value(ratio[0], &ratio, d) as f32,
                strength_ratio: self.gentle.value(strength_ratio[0], &strength_ratio, d) as f32,
                press_coupling: self.gentle.value(press.0, &press.1, d) as f32,
                normal_shear_x_n: (normal * self.gentle.value(shear[0][0], &shear[0], d)) as f32,
                normal_shear_y_n: (normal * self.gentle.value(shear[1][0], &shear[1], d)) as f32,
                tilt_x: self.gentle.value(tilt.0, &tilt.1, d) as f32,
                band_normal_n: 0.0,
            };
        }
        make_passive(&mut nodes, cell, energy);
        let deepest = f64::from(nodes[N - 1].friction_limit_n) * f64::from(nodes[N - 1].tangential_stiffness_n_mm);
        ParamsOf {
            depth_max_mm: self.depth_max_mm as f32,
            sliders: std::array::from_fn(|j| Slider {
                yield_position: positions[j] as f32,
                strength_share: strength[j] as f32,
            }),
            nodes,
            turn_slip: turn_slip as f32,
            full_slip: full_slip as f32,
            odd_compliance_mm_n2: (odd / deepest) as f32,
            area_tilt: area_tilt as f32,
            band_normal_middle: 1.0,
            band_normal_slip: 1.0,
            band_friction_stick: 0.0,
            band_friction_middle: 0.0,
            band_friction_slip: 0.0,
            pressure_exponent: self.pressure_exponent as f32,
        }
    }
}

/// Cuts off what `DataOf::check` would refuse; its inequalities, node by node. `energy` is Σ w y.
fn make_passive<const N: usize>(nodes: &mut [Node; N], cell: f64, energy: f64) {
    let at = |n: &Node| [n.normal_force_n, n.friction_limit_n, n.tangential_stiffness_n_mm].map(f64::from);
    // Press coupling: |C'| within `most`, its change from node to node within `change`; `most` is lowered from the deep
    // end so that the next node's can be reached.
    let change = |nodes: &[Node; N], i: usize| {
        let ([n0, ..], [n1, limit, _]) = (at(&nodes[i - 1]), at(&nodes[i]));
        ALLOWED * (n1 - n0) / (1.3 * limit)
    };
    let mut most = [f64::INFINITY; N];
    for i in (1..N).rev() {
        let [normal, limit, _] = at(&nodes[i]);
        most[i] = ALLOWED * normal / (1.3 * limit);
        if i + 1 < N {
            most[i] = most[i].min(most[i + 1] + change(nodes, i + 1));
        }
    }
    for i in 1..N {
        let wanted = f64::from(nodes[i].press_coupling).clamp(-most[i], most[i]);
        let before = f64::from(nodes[i - 1].press_coupling);
        let change = change(nodes, i);
        let reached = if i == 1 { wanted } else { before + (wanted - before).clamp(-change, change) };
        nodes[i].press_coupling = reached as f32;
    }
    nodes[0].press_coupling = nodes[1].press_coupling;
    // Normal force from shear: little against the stiffness, and never more taken off than there is.
    let depth_max = cell * (N - 1) as f64;
    for node in nodes.iter_mut().skip(1) {
        let [normal, limit, stiffness] = at(node);
        let round = f64::from(node.stiffness_ratio).sqrt() / f64::from(node.strength_ratio);
        let bound = ALLOWED * 0.5 / (stiffness * depth_max) * limit * limit * energy;
        let left = ALLOWED * normal - 1.3 * limit * f64::from(node.press_coupling).abs();
        let taken_x = bound.min(left.max(0.0) / 1.7);
        let taken_y = (bound / (round * round)).min(left.max(0.0) / 1.1);
        node.normal_shear_x_n = f64::from(node.normal_shear_x_n).clamp(-taken_x, bound) as f32;
        node.normal_shear_y_n = f64::from(node.normal_shear_y_n).clamp(-taken_y, bound / (round * round)) as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every vector is a model that the core accepts: the fit cannot leave the passive ones.
    #[test]
    fn any_vector_is_a_passive_model() {
        let parameterisation = Parameterisation::new(12, 6, 2.5, 0.46);
        let start = InitialGuess {
            normal: [0.33, 1.6],
            area: [65.0, 1.0],
            limit: [0.5, 1.3],
            stiffness: [0.3, 0.5],
            ratio: 0.65,
        };
        let mut seed = 7u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 40) as f64 / (1u64 << 24) as f64 - 0.5
        };
        let mut accepted = 0;
        for case in 0..2000 {
            let mut theta = parameterisation.start(3, &start);
            for t in &mut theta {
                *t += 1.5 * next();
            }
            match parameterisation.params::<3, 37>(&theta).try_build() {
                Ok(_) => accepted += 1,
                // Yield positions may leave their range; nothing else may be refused.
                Err(fingerpad::Error::Range { .. }) => {}
                Err(error) => panic!("case {case}: {error}"),
            }
        }
        assert!(accepted > 1000, "{accepted}");
    }
}
