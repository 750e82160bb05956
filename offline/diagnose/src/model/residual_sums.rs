//! Root mean squares of residuals per channel.

/// Sums of squared residuals of normal, x and y.
#[derive(Clone, Copy, Default)]
pub struct ResidualSums {
    sum: [f64; 3],
    rows: [f64; 3],
}

impl ResidualSums {
    /// Adds residuals, three per row, N; NaN is none.
    pub fn add(&mut self, values: impl Iterator<Item = f64>) {
        for (i, v) in values.enumerate().filter(|(_, v)| !v.is_nan()) {
            self.sum[i % 3] += v * v;
            self.rows[i % 3] += 1.0;
        }
    }

    /// Root mean squares, N.
    pub fn rms(&self) -> [f64; 3] {
        std::array::from_fn(|k| (self.sum[k] / self.rows[k].max(1.0)).sqrt())
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn each_channel_has_its_own_root_mean_square() {
        let mut sums = super::ResidualSums::default();
        sums.add([3.0, 1.0, f64::NAN, -4.0, 1.0, f64::NAN].into_iter());
        assert_eq!(sums.rms(), [12.5f64.sqrt(), 1.0, 0.0]);
    }
}
