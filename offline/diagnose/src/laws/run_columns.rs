//! The columns of measured runs that the program reads: their one list.

/// Names of the columns, each with the short one of `--map`; the first eight must be there.
pub const RUN_COLUMNS: [(&str, &str); 19] = [
    ("run_id", "run"),
    ("t_s", "t"),
    ("depth_mm", "depth"),
    ("slide_x_mm", "slide_x"),
    ("slide_y_mm", "slide_y"),
    ("normal_force_n", "normal"),
    ("friction_x_n", "x"),
    ("friction_y_n", "y"),
    ("contact_time_s", "contact_time"),
    ("speed_mm_s", "speed"),
    ("direction_deg", "direction"),
    ("dwell_s", "dwell"),
    ("occlusion_time_s", "occlusion_time"),
    ("hydration_au", "hydration"),
    ("temperature_c", "temperature"),
    ("finger_width_mm", "finger_width"),
    ("condition_id", "condition"),
    ("block_id", "block"),
    ("subject_id", "subject"),
];

/// Columns that must be there.
pub const REQUIRED: [&str; 8] = names(0);
/// Columns that may be there.
pub const OPTIONAL: [&str; RUN_COLUMNS.len() - REQUIRED.len()] = names(REQUIRED.len());

const fn names<const N: usize>(from: usize) -> [&'static str; N] {
    let mut out = [""; N];
    let mut k = 0;
    while k < N {
        out[k] = RUN_COLUMNS[from + k].0;
        k += 1;
    }
    out
}

/// Two rows of a run with all columns.
const EXAMPLE: &str = "\
stroke1,0.00,-0.20,0,0,0.001,-0.002,0.000,-0.20,2,0,1.0,0,35.2,32.1,16.0,reference,block1,subject1
stroke1,0.35,0.30,0,0,0.062,0.001,0.000,0.15,2,0,1.0,0.15,35.2,32.1,16.0,reference,block1,subject1
";

/// A file with all columns and the first two rows of a run.
pub fn template() -> String {
    RUN_COLUMNS.map(|(name, _)| name).join(",") + "\n" + EXAMPLE
}
