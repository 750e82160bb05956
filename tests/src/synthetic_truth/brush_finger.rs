//! A finger as a brush of bristles, which ages, relaxes and slides by a weak law of speed in every file, the calibration's too.
//!
//! Bristles stand side by side in an ellipse that grows with depth. Each carries a traction of its own: an elastic spring and a Maxwell arm,
//! stiffer along one axis. It slips where the traction reaches tau_0 + alpha p, times a factor that grows with the logarithm of the bristle's
//! age; slip renews the age [Dieterich 1979; Ruina 1983]. The normal force relaxes by a sum of exponentials of its own history
//! [quasi-linear viscoelasticity: Fung 1981]. There is no elastic coupling between bristles.
//!
//! Main type: [`BrushFinger`].

use std::f64::consts::PI;

use super::Random;
use super::effects::{Effect, Influence};
use super::laboratory::Scatter;
use super::protocol::Stroke;
use super::simulator::{Simulator, Step, Stepped, readings};

/// Families of the laws that this finger follows without any planted effect.
pub const OWN_FAMILIES: [&str; 3] = ["speed", "normal_relaxation", "ageing"];

/// Geometry, material and habits of one finger.
#[derive(Clone, Debug)]
pub struct BrushFinger {
    /// Number of bristles.
    pub bristles: usize,
    /// Normal force at 1 mm, before it relaxes, N.
    pub load_n: f64,
    /// Exponent of the load over depth.
    pub load_exponent: f64,
    /// Rate of the load's exponential factor, 1/mm.
    pub load_rate: f64,
    /// Contact area at 1 mm, mm².
    pub area_mm2: f64,
    /// Exponent of the area over depth.
    pub area_exponent: f64,
    /// Long (x) over short semi-axis.
    pub aspect: f64,
    /// Exponent of the pressure's bell; 0.5 is Hertz's.
    pub bell: f64,
    /// Tilt of the pressure along x and y, share at the rim.
    pub tilt: [f64; 2],
    /// Traction per stretch along x and y, MPa/mm.
    pub stiffness_mpa_mm: [f64; 2],
    /// Strength at no pressure, MPa.
    pub tau0_mpa: f64,
    /// Strength per pressure.
    pub alpha: f64,
    /// Slide per depth while pressing, x and y.
    pub press: [f64; 2],
    /// Normal force per friction along x and y.
    pub incline: [f64; 2],
    /// Growth of the strength per e-fold of age.
    pub ageing: f64,
    /// Age from which on the strength grows, s.
    pub age_s: f64,
    /// Slip that renews a bristle, mm.
    pub renewal_mm: f64,
    /// Growth of the strength per e-fold of speed.
    pub speed: f64,
    /// Shares of the stiffness that relax.
    pub relaxing: [f64; 2],
    /// Times of relaxation, s.
    pub relaxation_s: [f64; 2],
}

/// How far [`Simulator::vary`] may move each number; the last three are the habits, which one speed and one hold leave open.
const FREEDOMS: [f64; 18] =
    [1.0, 1.0, 0.10, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.002, 0.002, 0.004, 0.004, 0.05, 0.05, 0.05];

/// Contact area at which all bristles touch, mm².
const LARGEST_AREA_MM2: f64 = 160.0;
/// Longest motion in one step, mm.
const STEP_MM: f64 = 0.05;

impl BrushFinger {
    /// A finger of a seed.
    pub fn random(random: &mut Random) -> Self {
        let stiffness = random.between(0.020, 0.045);
        Self {
            bristles: 220 + random.pick(131),
            load_n: random.between(0.20, 0.42),
            load_exponent: random.between(1.4, 1.8),
            load_rate: random.between(0.0, 0.4),
            area_mm2: random.between(58.0, 74.0),
            area_exponent: random.between(0.8, 1.05),
            aspect: random.between(1.0, 1.5),
            bell: random.between(0.4, 0.9),
            tilt: [random.between(-0.25, 0.25), random.between(-0.1, 0.1)],
            stiffness_mpa_mm: [stiffness, stiffness * random.between(0.7, 1.1)],
            tau0_mpa: random.between(0.0020, 0.0045),
            alpha: random.between(0.3, 0.7),
            press: [random.between(-0.04, 0.04), random.between(-0.03, 0.03)],
            incline: [random.between(-0.04, 0.04), random.between(-0.02, 0.02)],
            ageing: random.between(0.01, 0.03),
            age_s: random.between(0.05, 0.3),
            renewal_mm: random.between(0.1, 0.4),
            speed: random.between(-0.02, 0.02),
            relaxing: [random.between(0.01, 0.04), random.between(0.01, 0.05)],
            relaxation_s: [random.between(0.1, 0.5), random.between(1.0, 5.0)],
        }
    }

    /// The finger without habits: it neither ages nor relaxes, and its friction does not depend on speed.
    pub fn without_habits(&self) -> Self {
        Self { ageing: 0.0, speed: 0.0, relaxing: [0.0; 2], ..self.clone() }
    }

    /// The bristles, from the middle outwards: places on a spiral that fills the ellipse evenly [Vogel 1979], mm.
    fn places(&self) -> Vec<[f64; 2]> {
        let turn = PI * (3.0 - 5f64.sqrt());
        let radius = |i: usize| ((i as f64 + 0.5) / self.bristles as f64 * LARGEST_AREA_MM2 / PI).sqrt();
        let root = self.aspect.sqrt();
        (0..self.bristles)
            .map(|i| {
                let (sin, cos) = (turn * i as f64).sin_cos();
                [radius(i) * root * cos, radius(i) / root * sin]
            })
            .collect()
    }

    /// Covered area, mm², and share of the load of each bristle in contact.
    fn footprint(&self, places: &[[f64; 2]], area_mm2: f64) -> Vec<(f64, f64)> {
        let cell = LARGEST_AREA_MM2 / self.bristles as f64;
        let semi = [(area_mm2 * self.aspect / PI).sqrt(), (area_mm2 / self.aspect / PI).sqrt()];
        let outside = |a: f64| (1.0 - (a / area_mm2).min(1.0)).powf(self.bell + 1.0);
        let touching = (area_mm2 / cell).ceil() as usize;
        let mut out: Vec<(f64, f64)> = places
            .iter()
            .take(touching)
            .enumerate()
            .map(|(i, at)| {
                let inner = cell * i as f64;
                let leaning = 1.0 + self.tilt[0] * at[0] / semi[0] + self.tilt[1] * at[1] / semi[1];
                ((area_mm2 - inner).min(cell), (outside(inner) - outside(inner + cell)) * leaning.max(0.0))
            })
            .collect();
        let all: f64 = out.iter().map(|o| o.1).sum();
        out.iter_mut().for_each(|o| o.1 /= all);
        out
    }
}

/// A bristle in contact.
#[derive(Clone, Copy, Default)]
struct Bristle {
    /// Plate position at which the spring is slack, mm.
    foot_mm: [f64; 2],
    /// Tractions of its Maxwell arms along x and y, MPa.
    arms_mpa: [[f64; 2]; 2],
    /// Time since it touched, renewed by slip, s.
    age_s: f64,
    /// Force, N.
    force_n: [f64; 2],
}

/// What the finger remembers.
#[derive(Default)]
pub struct Memory {
    /// Where the bristles stand, mm.
    places: Vec<[f64; 2]>,
    plate_mm: [f64; 2],
    /// Bristles in contact, from the middle outwards.
    bristles: Vec<Bristle>,
    /// Load at the last step before it relaxes, N.
    elastic_n: f64,
    /// Load that is still to relax, N.
    relaxing_n: [f64; 2],
    /// Covered area and share of the load of each bristle, and the depth that they belong to.
    footprint: (f64, Vec<(f64, f64)>),
}

/// How much of an arm is left after a time, and the mean of that over the time.
fn decay(time_s: f64, over_s: f64) -> (f64, f64) {
    let x = time_s / over_s;
    if x < 1e-9 { (1.0, 1.0) } else { ((-x).exp(), -(-x).exp_m1() / x) }
}

/// Traction after slip, of the given size and along the slip: t = q / (1 + m k) with the multiplier m by Newton's steps, which
/// a convex falling function lets converge from 0. The traction scaled back to its limit would be along the slip for equal
/// slopes only.
///
/// * `traction`: q, without slip; `slope`: k, traction per slip; `limit`: below the size of q, otherwise q is returned
fn slipped(traction: [f64; 2], slope: [f64; 2], limit: f64) -> [f64; 2] {
    let mut multiplier = 0.0;
    let at = |multiplier: f64| [0, 1].map(|c| traction[c] / (1.0 + multiplier * slope[c]));
    for _ in 0..30 {
        let t = at(multiplier);
        let excess = t[0] * t[0] + t[1] * t[1] - limit * limit;
        if !(excess > 1e-12 * limit * limit) {
            break;
        }
        let fall: f64 = (0..2).map(|c| 2.0 * t[c] * t[c] * slope[c] / (1.0 + multiplier * slope[c])).sum();
        multiplier += excess / fall;
    }
    at(multiplier)
}

impl Memory {
    /// A step to a depth with a motion of the plate.
    fn step(&mut self, finger: &BrushFinger, step: &Step<'_>) {
        let Step { depth_mm, slide_mm, time_s, moment, influence } = *step;
        let speed = if moment.speed_mm_s > 0.0 { 1.0 + finger.speed * (moment.speed_mm_s / 2.0).ln() } else { 1.0 };
        let strength = influence.strength * speed;
        let elastic = finger.load(depth_mm);
        let left = finger.relaxation_s.map(|over| decay(time_s, over));
        for k in 0..2 {
            let new = finger.relaxing[k] * (elastic - self.elastic_n) * left[k].1;
            self.relaxing_n[k] = self.relaxing_n[k] * left[k].0 + new;
        }
        self.elastic_n = elastic;
        self.plate_mm = [0, 1].map(|c| self.plate_mm[c] + slide_mm[c]);
        let load = self.load_n(finger) * influence.stiffness;
        if self.footprint.0 != depth_mm {
            self.footprint = (depth_mm, finger.footprint(&self.places, finger.area(depth_mm)));
        }
        let fresh = Bristle { foot_mm: self.plate_mm, ..Bristle::default() };
        self.bristles.resize(self.footprint.1.len(), fresh);
        let rest = 1.0 - finger.relaxing.iter().sum::<f64>();
        for (bristle, &(area, share)) in self.bristles.iter_mut().zip(&self.footprint.1) {
            let unaged = strength * (finger.tau0_mpa + finger.alpha * load * share / area);
            let mut traction = [0.0; 2];
            // Traction per motion of the plate in this step.
            let mut slope = [0.0; 2];
            for c in 0..2 {
                let k = finger.stiffness_mpa_mm[c];
                let moved = if bristle.foot_mm == self.plate_mm { 0.0 } else { slide_mm[c] };
                slope[c] = rest * k;
                traction[c] = rest * k * (self.plate_mm[c] - bristle.foot_mm[c]);
                for m in 0..2 {
                    let arm = &mut bristle.arms_mpa[m][c];
                    *arm = *arm * left[m].0 + finger.relaxing[m] * k * moved * left[m].1;
                    traction[c] += *arm;
                    slope[c] += finger.relaxing[m] * k * left[m].1;
                }
                traction[c] *= influence.stiffness;
                slope[c] *= influence.stiffness;
            }
            let size = (traction[0] * traction[0] + traction[1] * traction[1]).sqrt();
            if size <= unaged {
                bristle.force_n = traction.map(|t| area * t);
                bristle.age_s += time_s;
                continue;
            }
            let aged = 1.0 + finger.ageing * (1.0 + bristle.age_s / finger.age_s).ln();
            let kept = slipped(traction, slope, unaged * aged);
            let slip = [0, 1].map(|c| (traction[c] - kept[c]) / slope[c]);
            for c in 0..2 {
                bristle.foot_mm[c] += slip[c];
                for m in 0..2 {
                    bristle.arms_mpa[m][c] -= finger.relaxing[m] * finger.stiffness_mpa_mm[c] * left[m].1 * slip[c];
                }
                bristle.force_n[c] = area * kept[c];
            }
            let path = slip[0].hypot(slip[1]);
            // The age grows with time and is forgotten along the slip: exact for an even slip.
            let (kept, mean) = decay(path, finger.renewal_mm);
            bristle.age_s = bristle.age_s * kept + time_s * mean;
        }
    }

    /// The relaxed load, N.
    fn load_n(&self, finger: &BrushFinger) -> f64 {
        let rest = 1.0 - finger.relaxing.iter().sum::<f64>();
        rest * self.elastic_n + self.relaxing_n.iter().sum::<f64>()
    }

    /// Friction, N.
    fn friction_n(&self) -> [f64; 2] {
        [0, 1].map(|c| self.bristles.iter().map(|b| b.force_n[c]).sum())
    }
}

impl Stepped for BrushFinger {
    type State = Memory;

    fn in_the_air(&self) -> Memory {
        Memory { places: self.places(), ..Memory::default() }
    }

    /// Load before it relaxes, N.
    fn load(&self, depth_mm: f64) -> f64 {
        self.load_n * depth_mm.powf(self.load_exponent) * (self.load_rate * (depth_mm - 1.0)).exp()
    }

    fn area(&self, depth_mm: f64) -> f64 {
        (self.area_mm2 * depth_mm.powf(self.area_exponent)).min(LARGEST_AREA_MM2)
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
        let force = state.friction_n();
        let inclined = self.incline[0] * force[0] + self.incline[1] * force[1];
        (state.load_n(self) * influence.stiffness + inclined, force)
    }
}

impl Simulator for BrushFinger {
    fn freedoms(&self) -> &'static [f64] {
        &FREEDOMS
    }

    fn own_families(&self) -> &'static [&'static str] {
        &OWN_FAMILIES
    }

    fn vary(&self, freedom: usize, by: f64) -> Box<dyn Simulator> {
        let mut f = self.clone();
        match freedom {
            0 => f.load_n *= 1.0 + by,
            1 => {
                f.tau0_mpa *= 1.0 + by;
                f.alpha *= 1.0 + by;
            }
            2 => f.stiffness_mpa_mm = f.stiffness_mpa_mm.map(|k| k * (1.0 + by)),
            3 => f.load_exponent += by,
            4 => f.load_rate += by,
            5 => f.area_exponent += by,
            6 => f.stiffness_mpa_mm[1] *= 1.0 + by,
            7 => f.alpha *= 1.0 + by,
            8 => f.bell *= 1.0 + by,
            9 => f.tilt[0] += by,
            10 => f.tilt[1] += by,
            11 => f.press[0] += by,
            12 => f.press[1] += by,
            13 => f.incline[0] += by,
            14 => f.incline[1] += by,
            15 => f.ageing += by,
            16 => f.speed += by,
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
    use crate::synthetic_truth::protocol::{Plan, StrokeRow, strokes};

    fn finger(seed: u64) -> BrushFinger {
        BrushFinger::random(&mut Random::new(seed))
    }

    fn readings(finger: &BrushFinger, stroke: &Stroke) -> Vec<[f64; 3]> {
        finger.readings(stroke, &[], &Scatter::default())
    }

    /// Presses to a depth at once, then follows the places along x at these times.
    fn slide(depth_mm: f64, rows: &[(f64, f64)]) -> Stroke {
        let row = |t_s: f64, depth_mm: f64, x: f64| StrokeRow {
            t_s,
            depth_mm,
            slide_mm: [x, 0.0],
            contact_s: t_s,
            occlusion_s: t_s,
        };
        let mut all = vec![row(-1e-9, -0.2, 0.0), row(0.0, depth_mm, 0.0)];
        all.extend(rows.iter().map(|(t, x)| row(*t, depth_mm, *x)));
        Stroke { plan: Plan { depth_mm, ..Plan::reference() }, rows: all }
    }

    /// Sliding freely, friction is tau_0 A + alpha N along the motion for any form of the pressure, at all depths and directions,
    /// although the bristles are stiffer along one axis.
    #[test]
    fn full_slip_carries_the_integral_of_the_law() {
        for seed in 0..4 {
            let mut finger = finger(seed).without_habits();
            finger.incline = [0.0; 2];
            for (depth_mm, direction) in [(0.3, 0.4), (0.9, 2.0), (1.5, 4.0)] {
                let plan = Plan { depth_mm, direction, length_mm: 12.0, ..Plan::reference() };
                let last = *readings(&finger, &strokes(&[plan], 30)[0]).last().unwrap();
                let wanted = finger.tau0_mpa * finger.area(depth_mm) + finger.alpha * finger.load(depth_mm);
                let found = last[1].hypot(last[2]);
                assert!((found / wanted - 1.0).abs() < 1e-9, "seed {seed}: {found} {wanted}");
                let (sin, cos) = direction.sin_cos();
                let across = (last[2] * cos - last[1] * sin) / found;
                assert!(across.abs() < 1e-4, "seed {seed}: {across}");
                assert!((last[0] / finger.load(depth_mm) - 1.0).abs() < 1e-12);
            }
        }
    }

    /// While all bristles stick, friction is stiffness times area times slide. With every bristle of one strength and one stiffness, it is the
    /// smaller of that and of the limit.
    #[test]
    fn an_even_brush_is_elastic_up_to_its_limit() {
        let mut finger = finger(7).without_habits();
        (finger.alpha, finger.press, finger.tau0_mpa) = (0.0, [0.0; 2], 0.004);
        let rows: Vec<(f64, f64)> = (1..=40).map(|k| (f64::from(k), 0.01 * f64::from(k))).collect();
        let found = readings(&finger, &slide(1.0, &rows));
        for (reading, (_, x)) in found[2..].iter().zip(&rows) {
            let wanted = (finger.stiffness_mpa_mm[0] * x).min(finger.tau0_mpa) * finger.area(1.0);
            assert!((reading[1] - wanted).abs() < 1e-9, "{x}: {} {wanted}", reading[1]);
        }
    }

    /// After a sudden press the load is that of the relaxation's exponentials, and so is the friction after a sudden slide that sticks.
    #[test]
    fn load_and_stretch_relax_by_their_exponentials() {
        let mut finger = finger(8);
        (finger.ageing, finger.speed, finger.tau0_mpa, finger.press) = (0.0, 0.0, 1.0, [0.0; 2]);
        finger.incline = [0.0; 2];
        let slides_s = 5.0;
        let times = [slides_s + 1e-9, 5.2, 6.0, 9.0, 30.0];
        let found = readings(&finger, &slide(1.0, &times.map(|t| (t, 0.1))));
        let left = |t: f64| {
            1.0 - (0..2).map(|k| finger.relaxing[k] * (1.0 - (-t / finger.relaxation_s[k]).exp())).sum::<f64>()
        };
        let stiffness = finger.stiffness_mpa_mm[0] * finger.area(1.0) * 0.1;
        for (reading, t) in found[3..].iter().zip(&times[1..]) {
            assert!((reading[0] / (finger.load(1.0) * left(*t)) - 1.0).abs() < 1e-6, "{t}: {reading:?}");
            // The slide takes the five seconds before its first row.
            assert!(reading[1] / stiffness < 1.0 && reading[1] / stiffness > left(*t) - 0.05, "{t}: {reading:?}");
        }
        assert!(found[6][1] < found[3][1]);
    }

    /// The longer a contact rests, the higher its first peak of friction, by `ageing` an e-fold; far on, the hold is forgotten.
    #[test]
    fn rest_strengthens_and_slip_renews() {
        let mut finger = finger(9).without_habits();
        (finger.ageing, finger.age_s, finger.renewal_mm, finger.press) = (0.03, 0.1, 0.5, [0.0; 2]);
        let (mut peak, mut end) = (Vec::new(), Vec::new());
        for hold_s in [1.0, 100.0] {
            let rows: Vec<(f64, f64)> =
                (0..=300).map(|k| (hold_s + 0.02 * f64::from(k), 0.04 * f64::from(k))).collect();
            let friction: Vec<f64> = readings(&finger, &slide(1.0, &rows)).iter().map(|r| r[1]).collect();
            peak.push(friction.iter().copied().fold(0.0, f64::max));
            end.push(friction[friction.len() - 1]);
        }
        let limit = finger.tau0_mpa * finger.area(1.0) + finger.alpha * finger.load(1.0);
        let gained = (peak[1] - peak[0]) / limit;
        assert!(gained > 0.4 * 0.03 * 100f64.ln() && gained < 0.03 * 100f64.ln(), "{gained}");
        assert!((end[1] / end[0] - 1.0).abs() < 1e-3, "{end:?}");
    }

    /// Close rows give what wide ones give: the steps are fine enough.
    #[test]
    fn forces_do_not_depend_on_the_rows() {
        let finger = finger(10);
        let rows = |parts: usize| -> Vec<(f64, f64)> {
            (0..=20 * parts).map(|k| (1.0 + k as f64 / parts as f64 * 0.1, k as f64 / parts as f64 * 0.2)).collect()
        };
        let (wide, close) = (readings(&finger, &slide(1.0, &rows(1))), readings(&finger, &slide(1.0, &rows(10))));
        let limit = wide.last().unwrap()[1];
        for k in 0..=20 {
            let off = (wide[2 + k][1] - close[2 + 10 * k][1]) / limit;
            assert!(off.abs() < 0.005, "row {k}: {off}");
        }
    }
}
