//! The columns of measured runs that the program reads: their one list.

/// A column of measured runs.
#[derive(Clone, Copy, Debug)]
pub struct RunColumn {
    /// Its name.
    pub name: &'static str,
    /// The short name of `--map` and `--unit`.
    pub short: &'static str,
    /// Names under which loggers write it, in lower case without units.
    pub usual: &'static [&'static str],
    /// Whether it holds text.
    pub is_text: bool,
}

const fn number(name: &'static str, short: &'static str, usual: &'static [&'static str]) -> RunColumn {
    RunColumn { name, short, usual, is_text: false }
}

const fn text(name: &'static str, short: &'static str, usual: &'static [&'static str]) -> RunColumn {
    RunColumn { name, short, usual, is_text: true }
}

/// The columns; the first eight must be there.
pub const RUN_COLUMNS: [RunColumn; 19] = [
    text("run_id", "run", &["run", "trial", "stroke", "test_no", "versuch", "lauf"]),
    number("t_s", "t", &["t", "time", "zeit", "timestamp", "x_value"]),
    number("depth_mm", "depth", &["depth", "z", "indentation", "eindringtiefe", "tiefe"]),
    number("slide_x_mm", "slide_x", &["slide", "slide_x", "x", "pos", "position", "displacement", "weg"]),
    number("slide_y_mm", "slide_y", &["slide_y", "y"]),
    number("normal_force_n", "normal", &["fn", "fz", "normal", "normal_force", "normalkraft", "load", "last"]),
    number(
        "friction_x_n",
        "x",
        &["fx", "ft", "friction", "friction_force", "tangential_force", "reibkraft", "reibungskraft"],
    ),
    number("friction_y_n", "y", &["fy"]),
    number("contact_time_s", "contact_time", &[]),
    number("speed_mm_s", "speed", &[]),
    number("direction_deg", "direction", &[]),
    number("dwell_s", "dwell", &[]),
    number("occlusion_time_s", "occlusion_time", &[]),
    number("hydration_au", "hydration", &["hydration", "moisture", "feuchte"]),
    number("temperature_c", "temperature", &["temperature", "temp", "temperatur"]),
    number("finger_width_mm", "finger_width", &[]),
    text("condition_id", "condition", &[]),
    text("block_id", "block", &[]),
    text("subject_id", "subject", &[]),
];

/// Columns that must be there.
pub const REQUIRED: [&str; 8] = names(0);
/// Columns that may be there.
pub const OPTIONAL: [&str; RUN_COLUMNS.len() - REQUIRED.len()] = names(REQUIRED.len());

const fn names<const N: usize>(from: usize) -> [&'static str; N] {
    let mut out = [""; N];
    let mut k = 0;
    while k < N {
        out[k] = RUN_COLUMNS[from + k].name;
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
    RUN_COLUMNS.map(|column| column.name).join(",") + "\n" + EXAMPLE
}
