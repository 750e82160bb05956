//! Conditions that the formula of an effect may read.

/// Largest number of user-defined columns of a model file.
pub const OWN: usize = 4;

/// State of contact and skin at one instant, in the precision of the formula.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Conditions<T> {
    /// Clock of the series, s.
    pub t_s: T,
    /// Depth, mm.
    pub depth_mm: T,
    /// Time since touch, s; negative before it.
    pub contact_time_s: T,
    /// Speed of the plate, mm/s; 0 while it does not move.
    pub speed_mm_s: T,
    /// Cosine and sine of twice the direction of motion.
    pub double_angle: [T; 2],
    /// Unit vector of the present motion; 0 before the first one.
    pub along: [T; 2],
    /// Path of the plate since touch, mm.
    pub path_mm: T,
    /// Path since touch or the last turn, mm.
    pub turn_mm: T,
    /// Hold before sliding, s.
    pub dwell_s: T,
    /// Contact time accumulated since the last rest, s.
    pub occlusion_s: T,
    /// Corneometer reading, a.u.
    pub hydration_au: T,
    /// Skin temperature, °C.
    pub temperature_c: T,
    /// Width of the finger, mm.
    pub width_mm: T,
    /// User-defined columns, in the order and the units of the file that has their laws.
    pub own: [T; OWN],
}
