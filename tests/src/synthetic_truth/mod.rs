//! Measured sets with a hidden effect, from four simulators that share no code and no form with the diagnosis nor with each
//! other.
//!
//! Main types: [`finger::Finger`] (bristles on a bulk, under a pressure that moves with depth),
//! [`half_space_finger::HalfSpaceFinger`] (elastic half-space, elliptic contact, friction linear in pressure),
//! [`brush_finger::BrushFinger`] (bristles that age and relax), [`continuum_finger::ContinuumFinger`] (cells with coupled pressures),
//! [`effects::Effect`], [`protocol::Plan`], [`sets::Case`] (truth and data), [`oracle`] (what a perfect analyst could separate).

pub mod brush_finger;
pub mod continuum_finger;
pub mod csv;
pub mod effects;
pub mod fe;
pub mod fe_sets;
pub mod finger;
pub mod half_space_finger;
pub mod laboratory;
pub mod loggers;
pub mod oracle;
pub mod protocol;
pub mod rivals;
pub mod score;
pub mod score_sets;
pub mod score_table;
pub mod sets;
pub mod simulator;

/// Random numbers of a set.
pub struct Random(u64);

impl Random {
    /// The sequence of a seed.
    pub fn new(seed: u64) -> Self {
        let mut random = Self(seed ^ 0x5DEE_CE66_D1CE_4E5B);
        for _ in 0..4 {
            random.unit();
        }
        random
    }

    /// Uniform in 0 to 1 (splitmix64).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform between two numbers.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Normal, mean 0, standard deviation 1.
    pub fn normal(&mut self) -> f64 {
        let (a, b) = (self.unit().max(1e-300), self.unit());
        (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }

    /// One of so many.
    pub fn pick(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n - 1)
    }
}
