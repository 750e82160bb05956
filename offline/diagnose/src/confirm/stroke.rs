//! A measured run as a path of the finite-element plane, with the laws of friction and stiffness along it.

use std::ops::ControlFlow;

use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::load_path::{Drive, LoadPathError, Path, Problem, Progress, Response, RunOptions, Waypoint, follow};

use crate::confirm::scale::{FingerScale, Refit};
use crate::data::runs::Run;
use crate::laws::{Change, REFERENCE_AREA_MM2, Row};
use crate::model::active_law::ActiveLaw;

/// Most rows of a run at which the finite elements are evaluated; longer runs are thinned.
const MOST_ROWS: usize = 40;

/// Forces and contact of the finite elements at one row.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FeRow {
    /// Forces of the unchanged tissue: normal, x, y, N.
    pub force_n: [f64; 3],
    /// Contact area, mm².
    pub area_mm2: f64,
    /// Stuck area over contact area.
    pub stick_ratio: f64,
}

impl From<&Response> for FeRow {
    fn from(r: &Response) -> Self {
        Self {
            force_n: [r.normal_force_n, r.friction_x_n, r.friction_y_n],
            area_mm2: r.contact_area_mm2,
            stick_ratio: r.stick_ratio,
        }
    }
}

/// A stroke for the finite elements.
pub struct FeStroke<'a> {
    /// Its path: the plane's depth is the measured one, with the laws' offset where there is contact.
    pub path: Path,
    /// Index among the path's corners of the first row.
    pub first_row: usize,
    /// Indices of the evaluated rows of the run, rising.
    pub kept: &'a [usize],
    run: &'a Run,
    laws: &'a [ActiveLaw],
    scale: &'a FingerScale,
    refit: Option<&'a Refit>,
    law: RubberFriction,
}

/// Numbers of the rows that a stroke keeps: at most about forty, the turns and the last row among them.
pub fn kept_rows(run: &Run) -> Vec<usize> {
    let n = run.rows.len();
    let stride = n.div_ceil(MOST_ROWS).max(1);
    let turns = |i: usize| i + 1 < n && run.rows[i + 1].turn_mm < run.rows[i].turn_mm && run.rows[i].turn_mm > 0.0;
    (0..n).filter(|&i| i % stride == 0 || i + 1 == n || (stride > 1 && turns(i))).collect()
}

impl<'a> FeStroke<'a> {
    /// The stroke of a run with laws in force. `law`: that of the finite-element finger.
    pub fn new(
        run: &'a Run,
        kept: &'a [usize],
        laws: &'a [ActiveLaw],
        scale: &'a FingerScale,
        refit: Option<&'a Refit>,
        law: RubberFriction,
    ) -> Self {
        let mut waypoints = Vec::with_capacity(kept.len() + 1);
        let first = &run.rows[0];
        if first.depth_mm > 0.0 {
            // A run that was recorded from within contact starts with the press to there.
            let before = first.contact_time_s.max(1e-3);
            waypoints.push(Waypoint { t_s: first.t_s - before, normal: 0.0, x: 0.0, y: 0.0 });
        }
        let first_row = waypoints.len();
        for &i in kept {
            let (row, [x, y]) = (&run.rows[i], run.slide_mm[i]);
            waypoints.push(Waypoint { t_s: row.t_s, normal: with_offset(row, &change(laws, row)), x, y });
        }
        let path = Path::new([Drive::Displacement; 3], waypoints);
        Self { path, first_row, kept, run, laws, scale, refit, law }
    }

    /// Factors on strength and stiffness in a row.
    fn factors(&self, row: &Row) -> [f64; 2] {
        let c = change(self.laws, row);
        let depth = with_offset(row, &c).max(1e-3);
        let mut out = [c.strength * self.scale.strength(depth, row), c.stiffness * self.scale.stiffness(depth)];
        if let Some(refit) = self.refit {
            out[0] *= refit.strength(depth, row);
            out[1] *= refit.stiffness(depth);
        }
        out
    }

    /// The law of friction at a time, as it acts on the unchanged tissue.
    pub fn law_at(&self, t_s: f64) -> RubberFriction {
        let [strength, stiffness] = self.factors(&between(&self.run.rows, t_s));
        self.law.scaled(strength, stiffness)
    }

    /// Follows the stroke; `None` if no equilibrium is found.
    ///
    /// # Errors
    /// [`LoadPathError`], but not [`LoadPathError::NoEquilibrium`].
    pub fn follow(
        &self,
        problem: &Problem<'_>,
        progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<Option<Vec<FeRow>>, LoadPathError> {
        let law_at = |t_s: f64| self.law_at(t_s);
        let options = RunOptions { law_at: Some(&law_at), ..RunOptions::default() };
        match follow(problem, &self.path, options, progress) {
            Ok(end) => {
                let at = |t_s: f64| end.responses().iter().rfind(|r| r.t_s == t_s).map(FeRow::from);
                Ok(self.path.waypoints[self.first_row..].iter().map(|w| at(w.t_s)).collect())
            }
            Err(LoadPathError::NoEquilibrium { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Readings at the kept rows, N: the forces of the finite elements times the stiffness, then rim, drag and sensor.
    ///
    /// * `area`: area of the baseline under which the laws were fitted, over that of the finite elements
    pub fn readings(&self, found: &[FeRow], area: f64) -> Vec<[f64; 3]> {
        let mut out = Vec::with_capacity(found.len());
        for (&i, fe) in self.kept.iter().zip(found) {
            let row = &self.run.rows[i];
            let c = change(self.laws, row);
            let [_, stiffness] = self.factors(row);
            let share = area * fe.area_mm2 / REFERENCE_AREA_MM2;
            let force = fe.force_n.map(|f| f * stiffness);
            let normal = force[0] - c.adhesion_n * share.sqrt();
            let drag = c.drag_n * share;
            out.push(c.reading([normal, force[1] + drag * row.along[0], force[2] + drag * row.along[1]]));
        }
        out
    }
}

fn change(laws: &[ActiveLaw], row: &Row) -> Change {
    let mut change = Change::default();
    laws.iter().for_each(|a| a.law.apply(&a.values, row, &mut change));
    change
}

fn with_offset(row: &Row, change: &Change) -> f64 {
    if row.depth_mm > 0.0 { row.depth_mm + change.depth_mm } else { row.depth_mm }
}

/// The state between two rows; values of a motion are those of the row at its end.
fn between(rows: &[Row], t_s: f64) -> Row {
    if rows.len() < 2 {
        return rows[0];
    }
    let next = rows.partition_point(|r| r.t_s < t_s).clamp(1, rows.len() - 1);
    let (a, b) = (&rows[next - 1], &rows[next]);
    let share = ((t_s - a.t_s) / (b.t_s - a.t_s)).clamp(0.0, 1.0);
    let mix = |from: f64, to: f64| from + share * (to - from);
    let to_go = (1.0 - share) * (b.path_mm - a.path_mm).max(0.0);
    Row {
        t_s,
        depth_mm: mix(a.depth_mm, b.depth_mm),
        contact_time_s: mix(a.contact_time_s, b.contact_time_s),
        path_mm: b.path_mm - to_go,
        turn_mm: (b.turn_mm - to_go).max(0.0),
        occlusion_s: mix(a.occlusion_s, b.occlusion_s),
        ..*b
    }
}

#[cfg(test)]
mod tests {
    use fingerpad_smooth::SmoothModel;

    use super::*;
    use crate::data::runs::{Labels, RawRow, RunSet};

    /// A finger of unit curves but for the normal force and the strength.
    fn model(normal: f64, strength: f64) -> SmoothModel {
        SmoothModel {
            ln_normal: [normal.ln(), 0.0, 0.0, 0.0],
            ln_strength: [strength.ln(), 0.0, 0.0, 0.0],
            ln_tangential: [0.0; 4],
            ln_area: [0.0; 4],
            elements: [[0.0; 2]; fingerpad_smooth::ELEMENTS],
            ln_stiffness_ratio_y: [0.0; 2],
            press_coupling: [0.0; 2],
            press_coupling_y: 0.0,
            normal_per_friction: [0.0; 2],
            normal_shear: [0.0; 2],
            odd_x_per_mm: 0.0,
            load_exponent: 0.0,
            even_direction: [0.0; 2],
            even_direction_slope: 0.0,
            odd_direction: [0.0; 2],
        }
    }

    /// A finger that a refit makes twice as stiff, with three times the friction in full slip, has the law of that finger.
    #[test]
    fn a_refit_scales_the_law_of_friction() {
        let rows = (0..10).map(|i| RawRow::bare(2, f64::from(i), 0.1 * f64::from(i), [0.0; 2], [0.1; 3])).collect();
        let set = RunSet::from_rows("runs.csv".into(), vec![(Labels::default(), rows)]).unwrap();
        let law = RubberFriction { beta: 0.5, ..RubberFriction::default() };
        let refit = Refit { from: model(1.0, 1.0), to: model(2.0, 3.0), beta: 0.5 };
        let (kept, scale) = (kept_rows(&set.runs[0]), FingerScale::default());
        let stroke = |refit| FeStroke::new(&set.runs[0], &kept, &[], &scale, refit, law).law_at(5.0);
        assert_eq!(stroke(None), law);
        let (found, wanted) = (stroke(Some(&refit)), law.scaled(3.0 / 2f64.sqrt(), 2.0));
        assert!((found.lambda - wanted.lambda).abs() < 1e-9 * wanted.lambda, "{found:?} {wanted:?}");
        assert_eq!(found.regular_pressure_mpa, wanted.regular_pressure_mpa);
    }
}
