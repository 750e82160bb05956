//! Conditions that effects depend on and a motion does not contain.

use super::OWN;

/// Conditions that an effect may depend on and the motion does not contain. `Default` is the reference state.
///
/// A time or a speed that is `None` is computed from the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Surroundings {
    /// Moisture of the skin, corneometer units.
    pub hydration_au: f32,
    /// Temperature of the skin, °C.
    pub temperature_c: f32,
    /// Width of the finger, mm.
    pub finger_width_mm: f32,
    /// Clock of the series in which the tissue drifts, s.
    pub series_s: f32,
    /// Hold before sliding, s.
    pub dwell_s: Option<f32>,
    /// Contact time since the last rest, s.
    pub occlusion_s: Option<f32>,
    /// Nominal speed of the plane where it moves, mm/s.
    pub speed_mm_s: Option<f32>,
    /// User-defined columns (a voltage, a humidity) that tables of the model file read, in the order of the file.
    #[cfg_attr(feature = "serde", serde(default))]
    pub own: [f32; OWN],
}

impl Default for Surroundings {
    fn default() -> Self {
        Self {
            hydration_au: 35.0,
            temperature_c: 32.0,
            finger_width_mm: 16.0,
            series_s: 0.0,
            dwell_s: None,
            occlusion_s: None,
            speed_mm_s: None,
            own: [0.0; OWN],
        }
    }
}
