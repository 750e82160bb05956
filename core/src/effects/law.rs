//! The description of an effect, and the interface of an effect's file.
//!
//! Main types: [`Effect`] (the formula as code, with its [`Law`]), [`Law`] (name, parameters, source, drivers). Uses
//! conditions, change, math.

use super::{Change, Conditions};
use crate::math::{Real, double};

/// Numbers of a slot in a model file: the largest number of parameters of an effect.
pub const VALUES: usize = 6;

/// An effect: a formula that changes the model, and its description.
pub trait Effect {
    /// Its description.
    const LAW: Law;

    /// The formula, written once for both precisions.
    ///
    /// * `values`: parameters as they are fitted and as a slot holds them, in the order of [`Law::parameters`]; 0 beyond
    /// * `at`: state of contact and skin
    /// * `change`: changes by the effects before it, to which this one adds
    fn act<T: Real>(values: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>);
}

/// Description of an effect.
pub struct Law {
    /// Its name in reports and model files.
    pub name: &'static str,
    /// Laws of one family share a mechanism.
    pub family: &'static str,
    /// Its formula as reports print it, with its parameters by their names.
    pub formula: &'static str,
    /// Number in the effect slots of a model file; 32 and 33 are those of [`super::baseline`].
    pub kind: u32,
    /// Where it enters the model.
    pub place: Place,
    /// Its parameters: first those in which it is (nearly) linear, then those of its shape. At most [`VALUES`].
    pub parameters: &'static [Parameter],
    /// How many of them are linear.
    pub linear: usize,
    /// How a report shows the fitted parameters.
    pub reported: Reported,
    /// Columns of the measured runs that it reads.
    pub drivers: &'static [Column],
    /// Axes of a protocol along which it changes the readings.
    pub axes: &'static [Axis],
    /// Names of laws that a poor protocol cannot distinguish from it.
    pub confused_with: &'static [&'static str],
    /// Where the sizes come from.
    pub source: &'static str,
    /// Starting values of the shape parameters; one empty set where there are none.
    pub shapes: &'static [&'static [f64]],
    /// [`Effect::act`] in double precision, for callers that have the law and not the type; [`Law::apply`] calls it. A host program may
    /// compile it from a formula in a file.
    pub act: &'static Act,
}

/// Function of a law in double precision: sizes and shape parameters, conditions, and the change that it writes.
pub type Act = dyn Fn(&[f64; VALUES], &Conditions<f64>, &mut Change<f64>) + Sync;

/// A parameter of a law.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Parameter {
    /// Name; ends in its unit where it has one.
    pub name: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Least value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Expected size, from the law's source.
    pub typical: f64,
    /// Whether it is a divisor, such as a time or a length of decay. A slot then needs a positive value, and the fit varies the logarithm of
    /// the parameter.
    pub positive: bool,
}

/// Where a law enters the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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

/// How the parameters of a law are reported, where this differs from the fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reported {
    /// As they are fitted.
    AsFitted,
    /// Fitted as the pair a cos 2 axis and a sin 2 axis, in which the law is linear; reported as the amplitude a and the axis,
    /// 0 to 180 degrees. Both of the pair have the amplitude's bounds.
    AmplitudeAndAxis,
}

/// An axis along which a protocol varies. Of two laws that change the readings along one axis, the second is more likely
/// an error of the first one's form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Axis {
    /// Time and path within a stroke.
    Stroke,
    /// Depth.
    Depth,
    /// Speed of the plane.
    Speed,
    /// Direction of motion.
    Direction,
    /// Time in contact before and between slides.
    Hold,
}

/// A column of the measured runs that can drive an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
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
    /// A user-defined column, which laws read from [`Conditions::own`].
    #[cfg_attr(feature = "serde", serde(skip))]
    Own {
        /// Place in [`Conditions::own`].
        place: u8,
        /// Name of the column.
        #[cfg_attr(feature = "serde", serde(skip))]
        name: &'static str,
    },
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
            Self::Own { name, .. } => name,
        }
    }
}

impl Law {
    /// The law's effect in one row of a run.
    ///
    /// * `values`: its parameters as they are fitted, at most [`VALUES`]
    pub fn apply(&self, values: &[f64], at: &Conditions<f64>, change: &mut Change<f64>) {
        (self.act)(&padded(values), at, change);
    }

    /// The parameters as they are reported, from those that are fitted; 0 beyond them.
    pub fn report(&self, fitted: &[f64]) -> [f64; VALUES] {
        let mut out = padded(fitted);
        if self.reported == Reported::AmplitudeAndAxis {
            let [x, y, ..] = out;
            let axis = 0.5 * double::atan2(y, x).to_degrees();
            out[0] = double::hypot(x, y);
            out[1] = if axis < 0.0 { axis + 180.0 } else { axis };
        }
        out
    }

    /// The parameters as they are fitted and as a slot of a model file holds them, from those that are reported; 0 beyond
    /// them.
    pub fn fitted(&self, reported: &[f64]) -> [f64; VALUES] {
        let mut out = padded(reported);
        if self.reported == Reported::AmplitudeAndAxis {
            let [amplitude, axis, ..] = out;
            let (sin, cos) = double::sincos(2.0 * axis.to_radians());
            (out[0], out[1]) = (amplitude * cos, amplitude * sin);
        }
        out
    }
}

impl core::fmt::Debug for Law {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Law {
    fn eq(&self, other: &Self) -> bool {
        self.kind == other.kind
    }
}

/// As many values as there are, then 0.
fn padded(values: &[f64]) -> [f64; VALUES] {
    let mut out = [0.0; VALUES];
    out.iter_mut().zip(values).for_each(|(to, from)| *to = *from);
    out
}
