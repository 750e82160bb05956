//! Numbers that look random and are the same in every run.

/// A linear congruential generator.
pub struct Noise(pub u32);

impl Noise {
    /// Uniform in −1 to 1.
    pub fn uniform(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / (1 << 23) as f32 - 1.0
    }
}
