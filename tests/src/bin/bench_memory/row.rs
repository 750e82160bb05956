//! A row of the table, and the inputs of its rows.

use fingerpad::{Model, Motion, Response, State, step};

/// A value against its marks.
pub struct Row {
    pub what: String,
    pub value: f64,
    /// Required mark.
    pub pass: f64,
    /// Desired mark.
    pub reach: f64,
    pub unit: &'static str,
}

impl Row {
    pub fn new(what: impl Into<String>, value: f64, [pass, reach]: [f64; 2], unit: &'static str) -> Self {
        Self { what: what.into(), value, pass, reach, unit }
    }

    /// Whether the mark is met; a value that is not finite does not meet it.
    pub fn passes(&self) -> bool {
        self.value <= self.pass
    }
}

impl std::fmt::Display for Row {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let verdict = match self.value {
            v if v <= self.reach => "reached",
            v if v <= self.pass => "passed",
            _ => "MISSED",
        };
        let Self { what, value, pass, reach, unit } = self;
        write!(f, "{what:<78} {value:>10.3e} {pass:>10} {reach:>10}  {unit}, {verdict}")
    }
}

/// Numbers that look random and are the same for the same seed.
#[derive(Clone)]
pub struct Noise(u64);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15))
    }

    /// Uniform in −1 to 1.
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Normally distributed with variance 1 (Box and Muller 1958).
    pub fn gaussian(&mut self) -> f64 {
        let (radius, angle) = (0.5 * (self.uniform() + 1.0), std::f64::consts::PI * self.uniform());
        (-2.0 * radius.max(1e-300).ln()).sqrt() * angle.cos()
    }
}

pub fn motion(depth_mm: f64, slide_mm: [f64; 2]) -> Motion {
    Motion {
        depth_mm: depth_mm as f32,
        slide_increment_mm: slide_mm.map(|s| s as f32),
        spin_increment_rad: 0.0,
        dt_s: 1e-3,
    }
}

/// Directions in which loads are held: along x, against it, along y.
pub const DIRECTIONS: [(&str, [f64; 2]); 3] = [("x", [1.0, 0.0]), ("-x", [-1.0, 0.0]), ("y", [0.0, 1.0])];
/// Shares of the slide to full slip: all but sticks, partial slip, full slip.
pub const LOADS: [(&str, f64); 3] = [("stick", 0.05), ("partial", 0.4), ("full", 1.6)];

/// Slide at which a fresh contact is in full slip, mm.
pub fn full_slip_slide_mm(model: &Model<'_>, depth: f64, along: [f64; 2]) -> f64 {
    let mut state = State::default();
    step(model, &mut state, motion(depth, [0.0; 2]));
    for i in 1..100_000 {
        let r = step(model, &mut state, motion(depth, along.map(|a| 2e-3 * a)));
        if r.slip_margin < 0.01 {
            return 2e-3 * f64::from(i);
        }
    }
    f64::NAN
}

/// A contact pressed to `depth` and slid by `slide` mm along a direction, in steps of 1 % of each.
pub fn held(model: &Model<'_>, depth: f64, along: [f64; 2], slide: f64) -> (State, Response) {
    let mut state = State::default();
    for i in 1..=100 {
        step(model, &mut state, motion(0.01 * f64::from(i) * depth, [0.0; 2]));
    }
    let mut response = Response::default();
    for _ in 0..100 {
        response = step(model, &mut state, motion(depth, along.map(|a| 0.01 * slide * a)));
    }
    (state, response)
}

/// Difference of friction in % of the limit.
pub fn apart(a: &Response, b: &Response) -> f64 {
    let [x, y] = [0, 1].map(|i| f64::from(a.friction_n[i]) - f64::from(b.friction_n[i]));
    100.0 * x.hypot(y) / f64::from(a.friction_limit_n)
}
