//! The design of experiments: which paths the finite-element model is run along, and which of them the fit never sees.
//!
//! Parameters of the paths come from Halton's sequence (Halton 1960, Numer. Math. 2:84-90), so that a few paths fill
//! depth, direction and slide evenly and the design is the same on every machine.

use fingerpad_fe::load_path::{Drive, Path, Waypoint};

/// Largest depth of the design, mm.
pub const DEPTH_MAX_MM: f64 = 2.5;
/// Speed of the plane, mm/s; sets the time column only.
const SPEED_MM_S: f64 = 2.0;
/// Depth at which the plane starts and ends in the air, mm.
const AIR_MM: f64 = -0.02;

/// Kind of a path's motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Press and lift, no slide.
    Press,
    /// Press, slide straight until everything slips.
    Straight,
    /// Press, slide there and back, some nested.
    Reversal,
    /// Press, slide round corners.
    Turn,
    /// Press, slide, change the depth at fixed slide, slide on, lift.
    Depth,
    /// Depth and slide change together.
    Oblique,
    /// Random corners in the plane and in depth.
    Random,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 7] =
        [Self::Press, Self::Straight, Self::Reversal, Self::Turn, Self::Depth, Self::Oblique, Self::Random];

    /// The spelling used in files.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Press => "press",
            Self::Straight => "straight",
            Self::Reversal => "reversal",
            Self::Turn => "turn",
            Self::Depth => "depth",
            Self::Oblique => "oblique",
            Self::Random => "random",
        }
    }
}

/// One path of the design.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Unique name, `straight-07`; held-out ones end in `h`.
    pub name: String,
    /// Kind of motion.
    pub kind: Kind,
    /// Whether the fit must not see it.
    pub held_out: bool,
    /// The motion of the plane.
    pub path: Path,
}

impl Experiment {
    /// Whether the fit's initial guess is read from this path.
    pub fn is_for_initial_guess(&self) -> bool {
        !self.held_out && matches!(self.kind, Kind::Press | Kind::Straight)
    }
}

/// Slide after which a contact at that depth slips as a whole, mm, roughly and rather too long.
fn slip_slide(depth_mm: f64) -> f64 {
    0.3 + 2.9 * depth_mm.powf(0.75)
}

/// The `index`-th number of Halton's sequence of that base, 0 to 1.
pub fn halton(mut index: usize, base: usize) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0);
    while index > 0 {
        digit /= base as f64;
        value += digit * (index % base) as f64;
        index /= base;
    }
    value
}

/// One point of Halton's sequence: the parameters of one path, each in a prime base of its own.
struct HaltonPoint {
    index: usize,
    next: usize,
}

const PRIMES: [usize; 30] = [
    2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, 89, 97, 101, 103, 107, 109,
    113,
];

impl HaltonPoint {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        let base = PRIMES[self.next % PRIMES.len()];
        self.next += 1;
        // Large bases start with runs of small steps; a stride coprime to them all spreads these.
        low + (high - low) * halton(self.index * 127 + 1, base)
    }

    fn angle(&mut self) -> f64 {
        self.between(0.0, std::f64::consts::TAU)
    }

    /// Depths in which the square root is even: shallow ones are not over-represented, deep ones not rare.
    fn depth(&mut self) -> f64 {
        self.between(0.35f64.sqrt(), 2.45f64.sqrt()).powi(2)
    }
}

/// A path under construction.
struct PathBuilder(Vec<Waypoint>);

impl PathBuilder {
    fn new() -> Self {
        Self(vec![Waypoint { t_s: 0.0, normal: AIR_MM, x: 0.0, y: 0.0 }])
    }

    fn here(&self) -> Waypoint {
        self.0[self.0.len() - 1]
    }

    fn to(&mut self, depth: f64, x: f64, y: f64) {
        let from = self.here();
        // Micrometres are enough and keep the files readable.
        let [depth, x, y] = [depth.min(DEPTH_MAX_MM), x, y].map(|v| (v * 1e3).round() / 1e3);
        let length = (depth - from.normal).hypot((x - from.x).hypot(y - from.y));
        if length > 0.0 {
            let t_s = ((from.t_s + length / SPEED_MM_S) * 1e6).round() / 1e6;
            self.0.push(Waypoint { t_s, normal: depth, x, y });
        }
    }

    fn press(&mut self, depth: f64) {
        let Waypoint { x, y, .. } = self.here();
        self.to(depth, x, y);
    }

    fn slide(&mut self, angle: f64, length: f64) {
        let here = self.here();
        self.to(here.normal, here.x + length * angle.cos(), here.y + length * angle.sin());
    }

    fn lift(&mut self) {
        self.press(AIR_MM);
    }

    fn finish(self) -> Path {
        Path::new([Drive::Displacement; 3], self.0)
    }
}

/// All paths, those for the fit and those held out, marked.
pub fn design() -> Vec<Experiment> {
    let mut all = Vec::new();
    let mut add = |kind: Kind, held_out: bool, path: Path| {
        let number = all.iter().filter(|e: &&Experiment| e.kind == kind && e.held_out == held_out).count();
        let name = format!("{}-{number:02}{}", kind.as_str(), if held_out { "h" } else { "" });
        all.push(Experiment { name, kind, held_out, path });
    };
    for depth in [0.3, 0.6, 1.0, 1.5, 2.0, 2.5] {
        for quarter in 0..4 {
            add(Kind::Straight, false, straight(depth, f64::from(quarter) * std::f64::consts::FRAC_PI_2));
        }
    }
    for (kind, fit, held_out) in [
        (Kind::Press, 3, 3),
        (Kind::Straight, 8, 12),
        (Kind::Reversal, 12, 12),
        (Kind::Turn, 10, 12),
        (Kind::Depth, 12, 12),
        (Kind::Oblique, 8, 10),
        (Kind::Random, 10, 12),
    ] {
        for i in 0..fit + held_out {
            // Fit and held-out paths alternate along the sequence, so both fill the ranges.
            let late = i * held_out / (fit + held_out) != (i + 1) * held_out / (fit + held_out);
            let mut point = HaltonPoint { index: 1 + i + 50 * kind as usize, next: 0 };
            add(kind, late, one(kind, &mut point));
        }
    }
    all
}

fn straight(depth: f64, angle: f64) -> Path {
    let mut path = PathBuilder::new();
    path.press(depth);
    path.slide(angle, 1.15 * slip_slide(depth));
    path.finish()
}

fn one(kind: Kind, point: &mut HaltonPoint) -> Path {
    let depth = point.depth();
    let full = slip_slide(depth);
    let mut path = PathBuilder::new();
    match kind {
        Kind::Press => {
            path.press(depth);
            path.press(depth * point.between(0.3, 0.8));
            path.press(point.depth().max(depth));
            path.lift();
        }
        Kind::Straight => return straight(depth, point.angle()),
        Kind::Reversal => {
            path.press(depth);
            let angle = point.angle();
            let mut length = full * point.between(0.4, 1.1);
            path.slide(angle, length);
            let shrink = point.between(0.55, 1.0);
            for turn in 1..4 {
                length *= if turn == 1 { point.between(0.4, 1.6) } else { shrink };
                path.slide(angle + f64::from(turn % 2) * std::f64::consts::PI, length);
            }
        }
        Kind::Turn => {
            path.press(depth);
            let mut angle = point.angle();
            let corner = point.between(0.6, 2.6);
            let corner = if point.between(0.0, 1.0) < 0.5 { -corner } else { corner };
            for _ in 0..4 {
                path.slide(angle, full * point.between(0.25, 0.75));
                angle += corner;
            }
        }
        Kind::Depth => {
            path.press(depth);
            let angle = point.angle();
            path.slide(angle, full * point.between(0.1, 1.0));
            let other = point.depth();
            path.press(other);
            path.press(depth);
            path.slide(angle + point.between(-1.6, 1.6), full * point.between(0.1, 0.4));
            path.press(point.depth().min(other));
            path.lift();
        }
        Kind::Oblique => {
            path.press(0.3 * depth);
            let angle = point.angle();
            for _ in 0..3 {
                let here = path.here();
                let turn = angle + point.between(-1.0, 1.0);
                let length = full * point.between(0.15, 0.6);
                path.to(point.depth(), here.x + length * turn.cos(), here.y + length * turn.sin());
            }
            path.lift();
        }
        Kind::Random => {
            path.press(depth);
            for corner in 0..6 {
                let here = path.here();
                let (angle, length) = (point.angle(), full * point.between(0.1, 0.6));
                let to = if corner % 2 == 0 { here.normal } else { point.depth() };
                path.to(to, here.x + length * angle.cos(), here.y + length * angle.sin());
            }
        }
    }
    path.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::{BTreeMap, BTreeSet};

    #[test]
    fn enough_is_held_out_and_no_path_is_on_both_sides() {
        let all = design();
        let names: BTreeSet<_> = all.iter().map(|e| e.name.clone()).collect();
        assert_eq!(names.len(), all.len());
        let mut held_out = BTreeMap::new();
        for e in all.iter().filter(|e| e.held_out) {
            *held_out.entry(e.kind).or_insert(0) += 1;
            assert!(all.iter().all(|other| other.held_out || other.path != e.path), "{}", e.name);
        }
        assert!(held_out.values().sum::<i32>() >= 60 && held_out.len() >= 4, "{held_out:?}");
    }

    #[test]
    fn ranges_are_filled() {
        let all = design();
        for held_out in [false, true] {
            let points: Vec<_> =
                all.iter().filter(|e| e.held_out == held_out).flat_map(|e| &e.path.waypoints).collect();
            let deepest = points.iter().map(|p| p.normal).fold(0.0, f64::max);
            assert!(deepest > 2.3 && deepest <= DEPTH_MAX_MM);
            let mut quadrants = [0; 4];
            for e in all.iter().filter(|e| e.held_out == held_out && e.kind == Kind::Straight) {
                let end = e.path.waypoints[e.path.waypoints.len() - 1];
                quadrants[usize::from(end.x < 0.0) + 2 * usize::from(end.y < 0.0)] += 1;
            }
            assert!(quadrants.iter().all(|&n| n >= 2), "{quadrants:?}");
        }
        for e in &all {
            for pair in e.path.waypoints.windows(2) {
                assert!(pair[1].t_s > pair[0].t_s, "{}", e.name);
            }
        }
    }
}
