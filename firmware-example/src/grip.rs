//! A grip controller: presses deeper when the slip margin falls, comes back when there is plenty.

/// Adds depth to what was commanded.
#[derive(Clone, Copy, Default)]
pub struct GripControl {
    extra_mm: f32,
}

/// Slip margin that is to be kept.
pub const MARGIN: f32 = 0.3;
/// Most that is added, mm.
const EXTRA_MAX_MM: f32 = 1.2;
/// Speed of pressing per missing margin, mm/s, and of coming back, mm/s.
const PRESS_MM_S: f32 = 60.0;
const BACK_MM_S: f32 = 0.5;

impl GripControl {
    /// The depth to add in the next step. Without contact the margin is 0, and the grip closes.
    pub fn update(&mut self, slip_margin: f32, dt_s: f32) -> f32 {
        let lack = MARGIN - slip_margin;
        let speed = if lack > 0.0 { PRESS_MM_S * lack } else { -BACK_MM_S };
        self.extra_mm = (self.extra_mm + speed * dt_s).clamp(0.0, EXTRA_MAX_MM);
        self.extra_mm
    }
}
