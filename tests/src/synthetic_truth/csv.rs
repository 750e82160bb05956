//! Cases as the files that a laboratory would hand over.

use std::fmt::Write as _;

use fingerpad_diagnose::{RunSet, laws::Column};

/// A set as a measured-runs CSV file.
pub fn text(set: &RunSet) -> String {
    let state = [
        (Column::Dwell, "dwell_s"),
        (Column::Occlusion, "occlusion_time_s"),
        (Column::Hydration, "hydration_au"),
        (Column::Temperature, "temperature_c"),
        (Column::Width, "finger_width_mm"),
    ];
    let there: Vec<_> = state.into_iter().filter(|(c, _)| set.has(*c)).collect();
    let mut out =
        "run_id,t_s,depth_mm,slide_x_mm,slide_y_mm,normal_force_n,friction_x_n,friction_y_n,contact_time_s".to_owned();
    for (_, name) in &there {
        out += &format!(",{name}");
    }
    out += "\n";
    for run in &set.runs {
        for (i, row) in run.rows.iter().enumerate() {
            let ([x, y], [n, fx, fy]) = (run.slide_mm[i], run.force_n[i]);
            let _ = write!(
                out,
                "{},{},{},{x},{y},{n},{fx},{fy},{}",
                run.labels.run, row.t_s, row.depth_mm, row.contact_time_s
            );
            for (column, _) in &there {
                let v = match column {
                    Column::Dwell => row.dwell_s,
                    Column::Occlusion => row.occlusion_s,
                    Column::Hydration => row.hydration_au,
                    Column::Temperature => row.temperature_c,
                    _ => row.width_mm,
                };
                let _ = write!(out, ",{v}");
            }
            out += "\n";
        }
    }
    out
}
