//! The library of effects: one law per file, with formula, parameters, drivers, source and what it is confused with.
//!
//! Main types: [`Law`], [`Change`] (what a law does to the model in one row), [`Row`] (what a law may read).
//! A law changes the model's strength, stiffness, depth or reading; none adds a free function to a force.
//! May use nothing but this room's row type.

mod adhesion;
mod anisotropy;
mod contact_ageing;
mod cross_talk;
mod depth_zero_offset;
mod hydration_bell;
mod normal_relaxation;
mod occlusion_growth;
mod speed_log;
mod speed_stribeck;
mod static_peak;
mod stiffness_drift;
mod strain_stiffening;
mod subject_size;
mod tare_bias;
mod temperature;
#[cfg(test)]
mod tests;
mod viscous_drag;

/// A column of the measured runs that can drive an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Column {
    /// Clock of the series.
    Time,
    /// Depth.
    Depth,
    /// Time since touch.
    ContactTime,
    /// Nominal speed of the plate.
    Speed,
    /// Direction of the present motion.
    Direction,
    /// Hold before sliding.
    Dwell,
    /// Contact time accumulated since the last rest.
    Occlusion,
    /// Reading of a corneometer.
    Hydration,
    /// Temperature of the skin.
    Temperature,
    /// Width of the finger.
    Width,
    /// Path of the plate since touch.
    Slide,
}

impl Column {
    /// Name of the column, as in the file where it is one of the file's.
    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "t_s",
            Self::Depth => "depth_mm",
            Self::ContactTime => "contact_time_s",
            Self::Speed => "speed_mm_s",
            Self::Direction => "direction_deg",
            Self::Dwell => "dwell_s",
            Self::Occlusion => "occlusion_time_s",
            Self::Hydration => "hydration_au",
            Self::Temperature => "temperature_c",
            Self::Width => "finger_width_mm",
            Self::Slide => "slide",
        }
    }
}

/// What a law may read in one row of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Row {
    /// Clock of the series, s.
    pub t_s: f64,
    /// Depth, mm.
    pub depth_mm: f64,
    /// Time since touch, s; negative before it.
    pub contact_time_s: f64,
    /// Speed of the plate, mm/s; 0 while it does not move.
    pub speed_mm_s: f64,
    /// Cosine and sine of twice the direction of motion.
    pub double_angle: [f64; 2],
    /// Unit vector of the present motion; 0 before the first one.
    pub along: [f64; 2],
    /// Path of the plate since touch, mm.
    pub path_mm: f64,
    /// Path since touch or the last turn, mm.
    pub turn_mm: f64,
    /// Hold before sliding, s.
    pub dwell_s: f64,
    /// Contact time accumulated since the last rest, s.
    pub occlusion_s: f64,
    /// Corneometer reading, a.u.
    pub hydration_au: f64,
    /// Skin temperature, °C.
    pub temperature_c: f64,
    /// Width of the finger, mm.
    pub width_mm: f64,
}

/// What the laws in force do to the model in one row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Factor on tau_crit.
    pub strength: f64,
    /// Factor on the tissue's stiffness.
    pub stiffness: f64,
    /// Added to the depth, mm, where the depth is positive.
    pub depth_mm: f64,
    /// Added to the reading, N: normal, x, y.
    pub reading_n: [f64; 3],
    /// Share of the normal force that appears in x and y.
    pub cross: [f64; 2],
    /// Force along the motion at the reference area, N.
    pub drag_n: f64,
    /// Line tension at the rim, as pull-off at the reference area, N.
    pub adhesion_n: f64,
}

impl Default for Change {
    fn default() -> Self {
        Self {
            strength: 1.0,
            stiffness: 1.0,
            depth_mm: 0.0,
            reading_n: [0.0; 3],
            cross: [0.0; 2],
            drag_n: 0.0,
            adhesion_n: 0.0,
        }
    }
}

impl Change {
    /// Factors on strength and stiffness.
    pub fn factors(&self) -> (f64, f64) {
        (self.strength, self.stiffness)
    }

    /// Whether it acts on the readings beside the model.
    pub fn reads(&self) -> bool {
        let forces = [self.cross[0], self.cross[1], self.drag_n, self.adhesion_n];
        self.reading_n.iter().chain(&forces).any(|f| *f != 0.0)
    }

    fn strengthen(&mut self, factor: f64) {
        self.strength *= factor.max(LEAST_FACTOR);
    }

    fn stiffen(&mut self, factor: f64) {
        self.stiffness *= factor.max(LEAST_FACTOR);
    }
}

/// Every factor is held at or above this.
pub const LEAST_FACTOR: f64 = 0.1;
/// Contact area at which adhesion and drag are given, mm².
pub const REFERENCE_AREA_MM2: f64 = 63.5;
/// Path over which viscous drag builds up, mm.
pub const DRAG_PATH_MM: f64 = 0.2;

/// Where a law enters the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// tau_crit, and with it every element's strength.
    Strength,
    /// The tissue's stiffness: normal elastic load and tangential stiffness.
    Stiffness,
    /// The depth, before anything else.
    Depth,
    /// A line tension at the rim.
    Rim,
    /// A force along the motion.
    Drag,
    /// The sensor's output, in air too.
    Reading,
}

/// A parameter of a law.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Name; ends in its unit where it has one.
    pub name: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Least value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Size to be expected, from the law's source.
    pub typical: f64,
}

/// One physical effect.
pub struct Law {
    /// Its name in reports and model files.
    pub name: &'static str,
    /// Laws of one family share a mechanism.
    pub family: &'static str,
    /// Number in the effect slots of a model file.
    pub kind: u32,
    /// Where it enters.
    pub place: Place,
    /// Its parameters: first those in which it is (nearly) linear, then those of its shape.
    pub parameters: &'static [Parameter],
    /// How many of them are linear.
    pub linear: usize,
    /// Columns it needs.
    pub drivers: &'static [Column],
    /// Laws that look alike on a poor protocol.
    pub confused_with: &'static [&'static str],
    /// Where the sizes come from.
    pub source: &'static str,
    /// Starting values of the shape parameters.
    pub shapes: &'static [&'static [f64]],
    /// Its effect in one row, given its parameters as they are fitted.
    pub apply: fn(&[f64], &Row, &mut Change),
    /// The parameters as they are reported, from those that are fitted.
    pub report: fn(&[f64]) -> Vec<f64>,
}

impl std::fmt::Debug for Law {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Law {
    fn eq(&self, other: &Self) -> bool {
        self.kind == other.kind
    }
}

fn as_fitted(values: &[f64]) -> Vec<f64> {
    values.to_vec()
}

/// All laws; new ones go to the end.
pub static LAWS: [&Law; 17] = [
    &hydration_bell::LAW,
    &speed_log::LAW,
    &speed_stribeck::LAW,
    &viscous_drag::LAW,
    &anisotropy::LAW,
    &normal_relaxation::LAW,
    &contact_ageing::LAW,
    &static_peak::LAW,
    &occlusion_growth::LAW,
    &adhesion::LAW,
    &depth_zero_offset::LAW,
    &tare_bias::LAW,
    &cross_talk::LAW,
    &stiffness_drift::LAW,
    &subject_size::LAW,
    &strain_stiffening::LAW,
    &temperature::LAW,
];

/// The law of a name.
pub fn find(name: &str) -> Option<&'static Law> {
    LAWS.iter().copied().find(|law| law.name == name)
}
