//! The measured table as input of the fits.

use serde::{Deserialize, Serialize};

use super::{IdentifyError, LawPoint, Region};
use fingerpad_fe::contact::RubberFriction;

/// One row of a measured table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Travel of the plane from first touch, mm, > 0.
    pub depth_mm: f64,
    /// Normal force, N, > 0.
    pub normal_force_n: f64,
    /// Kinetic friction force over normal force, >= 0.
    pub friction_coefficient: f64,
    /// Contact area, mm², if it was measured.
    pub contact_area_mm2: Option<f64>,
}

impl Point {
    /// Friction force, N.
    pub fn friction_n(&self) -> f64 {
        self.friction_coefficient * self.normal_force_n
    }
}

/// A table of at least two depths; rows of one depth (repeats) share a slot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Rows, in their order.
    pub points: Vec<Point>,
    /// Depths, mm, rising, each once.
    pub depths_mm: Vec<f64>,
    /// Index of each row's depth.
    pub slot: Vec<usize>,
}

impl Table {
    /// Refuses a table that cannot distinguish two constants.
    ///
    /// # Errors
    /// [`IdentifyError::Table`].
    pub fn new(name: &str, points: Vec<Point>) -> Result<Self, IdentifyError> {
        let (depths_mm, slot) = slots(points.iter().map(|p| p.depth_mm));
        if depths_mm.len() < 2 {
            let depth = depths_mm.first().map_or("no depth".into(), |d| format!("one depth, {d} mm"));
            return Err(IdentifyError::Table(format!(
                "{name}: {} row(s) at {depth}: strength and exponent are two constants and need two depths at least",
                points.len()
            )));
        }
        if points.iter().all(|p| p.friction_coefficient == 0.0) {
            return Err(IdentifyError::Table(format!("{name}: every friction_coefficient is 0: nothing to identify")));
        }
        Ok(Self { points, depths_mm, slot })
    }

    /// The rows but those of one slot.
    pub fn without(&self, left_out: usize) -> Vec<usize> {
        (0..self.points.len()).filter(|&i| self.slot[i] != left_out).collect()
    }

    /// Power law through mean shear stress F/A over mean pressure N/A, inside `region`; none without areas.
    pub fn mean_field(&self, region: &Region, base: &RubberFriction) -> Option<LawPoint> {
        let stresses: Vec<[f64; 2]> = self
            .points
            .iter()
            .filter_map(|p| p.contact_area_mm2.map(|a| [(p.normal_force_n / a).ln(), (p.friction_n() / a).ln()]))
            .filter(|s| s.iter().all(|v| v.is_finite()))
            .collect();
        let (beta, constant) = line(&stresses)?;
        let [low, high] = region.beta;
        let beta = beta.clamp(low, high);
        let mean = |k: usize| stresses.iter().map(|s| s[k]).sum::<f64>() / stresses.len() as f64;
        let constant = if (low..=high).contains(&beta) { constant } else { mean(1) - beta * mean(0) };
        let law = RubberFriction { lambda: constant.exp(), beta, tau0_mpa: 0.0, ..*base };
        let mut point = LawPoint::of(&law);
        point.tau_ref_kpa = point.tau_ref_kpa.clamp(region.tau_ref_kpa[0], region.tau_ref_kpa[1]);
        Some(point)
    }
}

/// Depths in rising order, each once, and the index among them of each given depth.
pub fn slots(depths_mm: impl Iterator<Item = f64> + Clone) -> (Vec<f64>, Vec<usize>) {
    let mut rising: Vec<f64> = depths_mm.clone().collect();
    rising.sort_by(f64::total_cmp);
    rising.dedup();
    let slot = depths_mm.map(|depth| rising.partition_point(|d| *d < depth)).collect();
    (rising, slot)
}

/// Slope and constant of the least-squares line through points; none if they do not spread along x.
pub fn line(points: &[[f64; 2]]) -> Option<(f64, f64)> {
    let n = points.len() as f64;
    let mean = |k: usize| points.iter().map(|p| p[k]).sum::<f64>() / n;
    let (x, y) = (mean(0), mean(1));
    let spread: f64 = points.iter().map(|p| (p[0] - x).powi(2)).sum();
    let slope = points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum::<f64>() / spread;
    (points.len() > 1 && spread > 1e-12 && slope.is_finite()).then_some((slope, y - slope * x))
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// Table 1 of Yoshida et al. 2011.
    pub fn table_1() -> Table {
        let point = |[depth_mm, normal_force_n, friction_coefficient, area]: [f64; 4]| Point {
            depth_mm,
            normal_force_n,
            friction_coefficient,
            contact_area_mm2: Some(area),
        };
        let rows =
            [[0.75, 0.12, 2.46, 49.4], [1.0, 0.198, 2.0, 62.8], [1.25, 0.384, 1.53, 83.2], [1.5, 0.454, 1.42, 97.7]];
        Table::new("Table 1", rows.map(point).to_vec()).unwrap()
    }

    #[test]
    fn mean_field_of_table_1() {
        // tau = 4.98 kPa (p/kPa)^0.205 by hand.
        let law = table_1().mean_field(&Region::default(), &RubberFriction::default()).unwrap();
        assert!((law.beta - 0.205).abs() < 1e-3, "{law:?}");
        assert!((law.tau_ref_kpa - 4.98 * 5f64.powf(0.205)).abs() < 0.02, "{law:?}");
    }

    #[test]
    fn repeats_share_a_slot_and_one_depth_is_refused() {
        let point =
            |depth_mm| Point { depth_mm, normal_force_n: 0.2, friction_coefficient: 1.5, contact_area_mm2: None };
        let table = Table::new("t", vec![point(1.0), point(0.5), point(1.0)]).unwrap();
        assert_eq!((table.depths_mm.as_slice(), table.slot.as_slice()), (&[0.5, 1.0][..], &[1, 0, 1][..]));
        assert_eq!(table.without(1), [1]);
        let message = Table::new("t.csv", vec![point(1.0), point(1.0)]).unwrap_err().to_string();
        assert!(message.contains("t.csv: 2 row(s) at one depth, 1 mm"), "{message}");
        assert!(table.mean_field(&Region::default(), &RubberFriction::default()).is_none());
    }
}
