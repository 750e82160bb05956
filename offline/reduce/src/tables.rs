//! Tables over depth from a few numbers each: monotone cubics through knots.
//!
//! Interpolation of Fritsch & Carlson 1980, SIAM J. Numer. Anal. 17:238-246, with the slopes of Fritsch & Butland:
//! no value between two knots lies beyond them.

/// Depths of the knots, mm, rising, the first above 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Knots(pub Vec<f64>);

impl Knots {
    /// `count` knots to `depth_max_mm`, closer to each other where the contact is small.
    pub fn graded(count: usize, depth_max_mm: f64) -> Self {
        Self((1..=count).map(|k| depth_max_mm * (k as f64 / count as f64).powf(1.5)).collect())
    }

    /// Value at `depth_mm` of the monotone cubic that starts with `start` at depth 0 and takes `values` at the knots.
    pub fn value(&self, start: f64, values: &[f64], depth_mm: f64) -> f64 {
        let n = self.0.len();
        let x = |i: usize| if i == 0 { 0.0 } else { self.0[i - 1] };
        let y = |i: usize| if i == 0 { start } else { values[i - 1] };
        let secant = |i: usize| (y(i + 1) - y(i)) / (x(i + 1) - x(i));
        let slope = |i: usize| -> f64 {
            if i == 0 {
                return secant(0);
            }
            if i == n {
                return secant(n - 1);
            }
            let (a, b) = (secant(i - 1), secant(i));
            if a * b <= 0.0 {
                return 0.0;
            }
            let (h0, h1) = (x(i) - x(i - 1), x(i + 1) - x(i));
            let (w0, w1) = (2.0 * h1 + h0, h1 + 2.0 * h0);
            (w0 + w1) / (w0 / a + w1 / b)
        };
        let d = depth_mm.clamp(0.0, x(n));
        let i = (0..n).find(|&i| d <= x(i + 1)).unwrap_or(n - 1);
        let h = x(i + 1) - x(i);
        let t = (d - x(i)) / h;
        let (t2, t3) = (t * t, t * t * t);
        (2.0 * t3 - 3.0 * t2 + 1.0) * y(i)
            + (t3 - 2.0 * t2 + t) * h * slope(i)
            + (3.0 * t2 - 2.0 * t3) * y(i + 1)
            + (t3 - t2) * h * slope(i + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_through_the_knots_and_never_beyond_them() {
        let knots = Knots::graded(6, 2.5);
        assert!((knots.0[5] - 2.5).abs() < 1e-12);
        let values = [0.1, 0.1, 0.7, 0.8, 2.0, 2.1];
        for (d, v) in knots.0.iter().zip(values) {
            assert!((knots.value(0.0, &values, *d) - v).abs() < 1e-12);
        }
        let mut last = 0.0;
        for i in 0..=2600 {
            let v = knots.value(0.0, &values, i as f64 * 1e-3);
            assert!(v >= last - 1e-12 && v <= 2.1 + 1e-12, "{i}: {v} after {last}");
            last = v;
        }
    }

    #[test]
    fn a_straight_line_stays_straight() {
        let knots = Knots::graded(5, 2.0);
        let values: Vec<f64> = knots.0.iter().map(|d| 0.5 - 0.3 * d).collect();
        for i in 0..=200 {
            let d = i as f64 * 0.01;
            assert!((knots.value(0.5, &values, d) - (0.5 - 0.3 * d)).abs() < 1e-12);
        }
    }
}
