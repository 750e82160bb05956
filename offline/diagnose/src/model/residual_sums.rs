//! Root mean squares of residuals per channel.

/// Sums of squared residuals of normal, x and y.
#[derive(Clone, Copy, Default)]
pub struct ResidualSums {
    sum: [f64; 3],
    rows: f64,
}

impl ResidualSums {
    /// Adds residuals, three per row, N.
    pub fn add(&mut self, values: impl Iterator<Item = f64>) {
        for (i, v) in values.enumerate() {
            self.sum[i % 3] += v * v;
            self.rows += 1.0 / 3.0;
        }
    }

    /// Root mean squares, N.
    pub fn rms(&self) -> [f64; 3] {
        self.sum.map(|s| (s / self.rows.max(1.0)).sqrt())
    }
}
