//! Runs of a finger, numbers beside published ones, and lines through results.

use std::error::Error;
use std::ops::ControlFlow;

use fingerpad_fe::experiment::{Config, RigidBodySettings};
use fingerpad_fe::load_path::{
    Finger, LoadPathError, Observed, Path, PressLimit, Problem, Response, Trajectory, follow_path, press_limits, probes,
};
use fingerpad_fe::mesh::{MeshPreset, below_skin, set};
use fingerpad_report::{Trace, TraceChart};
use fingerpad_tests::problems::fingers::placed;

/// Why an experiment could not be run.
pub type Failure = Box<dyn Error + Send + Sync>;

/// Factors on the pad's height, tried in turn if skin beside the pad reaches the body.
const PADS: [f64; 3] = [1.0, 1.5, 2.5];

/// One number of an experiment beside the band that its publication leaves.
pub struct Line {
    /// The quantity, with its unit.
    pub name: String,
    /// Result of the finite elements; NaN where it was not reached.
    pub found: f64,
    /// Least and largest value that agrees with the publication.
    pub band: [f64; 2],
    /// Digits after the point.
    pub digits: usize,
    /// Whether the parameters of the second finger were fitted to it.
    pub fitted: bool,
}

impl Line {
    /// A number that no fit uses.
    pub fn new(name: impl Into<String>, digits: usize, found: f64, band: [f64; 2]) -> Self {
        Self { name: name.into(), found, band, digits, fitted: false }
    }

    /// The same as a number that the fit uses.
    pub fn fitted(self) -> Self {
        Self { fitted: true, ..self }
    }

    /// Distance of the result from the band: 0 inside it, infinite if the finite elements have no result.
    pub fn gap(&self) -> f64 {
        if self.found.is_nan() {
            return f64::INFINITY;
        }
        (self.band[0] - self.found).max(self.found - self.band[1]).max(0.0)
    }

    /// The number for the page; bold outside the band.
    pub fn text(&self) -> String {
        let number = if self.found.is_nan() { "-".into() } else { format!("{:.*}", self.digits, self.found) };
        if self.gap() > 0.0 { format!("**{number}**") } else { number }
    }
}

/// A finger in the laboratory.
pub struct Lab {
    config: Config,
}

impl Lab {
    /// A finger on a mesh.
    pub fn new(config: Config, mesh_preset: MeshPreset) -> Self {
        Self { config: Config { mesh_preset, ..config } }
    }

    /// The same finger with other settings.
    pub fn with(&self, change: impl FnOnce(&mut Config)) -> Self {
        let mut config = self.config.clone();
        change(&mut config);
        Self { config }
    }

    /// Name of the mesh.
    pub fn mesh_name(&self) -> &'static str {
        if self.config.mesh_preset == MeshPreset::Coarse { "coarse" } else { "medium" }
    }

    /// Its friction law's factor and exponent.
    pub fn law(&self) -> [f64; 2] {
        [self.config.friction.lambda, self.config.friction.beta]
    }

    /// A run along a path on the plane.
    pub fn follow(&self, path: &Path) -> Result<Trajectory, Failure> {
        self.observe(path, &[]).map(|(trajectory, _)| trajectory)
    }

    /// A run with probes on the skin at these places (x, y), mm; also returns those of them that lie on the pad.
    pub fn observe(&self, path: &Path, places: &[[f64; 2]]) -> Result<(Trajectory, Vec<[f64; 2]>), Failure> {
        // Probes are for a heavy press, which needs the largest pad.
        let first = if places.is_empty() { 0 } else { PADS.len() - 1 };
        for (trial, reach) in PADS.into_iter().enumerate().skip(first) {
            let finger = self.config.finger_reaching(&[path], reach)?.0;
            let on_pad: Vec<[f64; 2]> =
                places.iter().copied().filter(|&place| below_skin(&finger.mesh, place, 0.0).is_some()).collect();
            let point = |place: &[f64; 2]| below_skin(&finger.mesh, *place, 1e-6).map(|x| (String::new(), x));
            let points: Vec<_> = on_pad.iter().filter_map(point).collect();
            let observed = Observed::new(&finger.mesh, false, probes(&finger.mesh, &finger.body, &points)?);
            let problem = Problem { observed: Some(&observed), ..self.config.problem(&finger) };
            match follow_path(&problem, path, &[], &mut |_| ControlFlow::Continue(())) {
                Err(LoadPathError::BesidePad { .. }) if trial + 1 < PADS.len() => {}
                result => return Ok((result?, on_pad)),
            }
        }
        unreachable!("the last pad returns")
    }

    /// Frictionless presses of a body to these depths, mm, with the integral of the friction law over their pressure.
    pub fn press(&self, body: &RigidBodySettings, depths_mm: &[f64]) -> Result<Vec<PressLimit>, Failure> {
        let config = Config { rigid_body: body.clone(), ..self.config.clone() };
        let path = placed(&[[0.0; 3], [depths_mm[depths_mm.len() - 1], 0.0, 0.0]]);
        for (trial, reach) in PADS.into_iter().enumerate() {
            let finger: Finger = config.finger_reaching(&[&path], reach)?.0;
            let problem = config.problem(&finger);
            match press_limits(&problem, &config.friction, depths_mm, None, &mut |_| ControlFlow::Continue(())) {
                Err(LoadPathError::BesidePad { .. }) if trial + 1 < PADS.len() => {}
                result => return Ok(result?),
            }
        }
        unreachable!("the last pad returns")
    }
}

/// Shares of the height of the undeformed bone to which a press leads, tried in turn while the plane meets the bone.
const ALMOST: [f64; 7] = [0.92, 0.88, 0.84, 0.8, 0.72, 0.64, 0.56];

impl Lab {
    /// A press without friction on the plane, almost to the bone.
    pub fn deep_press(&self) -> Result<Vec<PressLimit>, Failure> {
        let finger = self.config.finger()?.0;
        let bone = finger.mesh.node_set(set::DISTAL_BONE).iter().map(|&n| finger.mesh.nodes[n as usize].z);
        let bone_mm = bone.fold(f64::INFINITY, f64::min);
        let mut last = Err("no depth".into());
        for share in ALMOST {
            last = self.press(&RigidBodySettings::default(), &depths_mm(share * bone_mm, 40));
            if last.is_ok() {
                break;
            }
        }
        last
    }
}

/// Length of the friction of a response, N.
pub fn friction_n(r: &Response) -> f64 {
    r.friction_x_n.hypot(r.friction_y_n)
}

/// Depths at which a press is taken, mm, closer where it is light.
pub fn depths_mm(deepest: f64, count: usize) -> Vec<f64> {
    (1..=count).map(|k| deepest * (k as f64 / count as f64).powf(1.5)).collect()
}

/// The value of `y` where `x`, which rises, reaches `at`; straight in logarithms between points, NaN outside.
pub fn at(points: &[[f64; 2]], at: f64) -> f64 {
    let after = points.partition_point(|p| p[0] < at);
    if after == 0 || after == points.len() {
        return f64::NAN;
    }
    let ([x0, y0], [x1, y1]) = (points[after - 1], points[after]);
    let share = (at / x0).ln() / (x1 / x0).ln();
    y0 * (y1 / y0).powf(share)
}

/// Exponent of `y` in `x` between two values of `x`.
pub fn exponent(points: &[[f64; 2]], [from, to]: [f64; 2]) -> f64 {
    (at(points, to) / at(points, from)).ln() / (to / from).ln()
}

/// A line of a chart.
pub fn line(name: impl Into<String>, points: Vec<[f64; 2]>) -> Trace {
    Trace { name: name.into(), points, ..Trace::default() }
}

/// Dots of a chart.
pub fn dots(name: impl Into<String>, points: Vec<[f64; 2]>) -> Trace {
    Trace { name: name.into(), points, is_dots: true, ..Trace::default() }
}

/// A chart from zero.
pub fn chart(title: &str, labels: [&str; 2], traces: Vec<Trace>) -> TraceChart {
    TraceChart { title: title.into(), labels: labels.map(str::to_owned), traces, ..TraceChart::default() }
}
