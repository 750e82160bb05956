//! The series of the figures, as lists: a new column is one more line.

use fingerpad_fe::load_path::Response;

/// A quantity of a response; NaN if a row does not have it.
#[derive(Clone, Copy)]
pub struct Series {
    /// Its name within its panel.
    pub name: &'static str,
    /// Its value.
    pub of: fn(&Response) -> f64,
}

/// Series with one unit, drawn into one panel. A series without any finite value is left out, a panel in which nothing
/// changes too.
pub struct Panel {
    /// Quantity and unit.
    pub label: &'static str,
    /// Values that the axis covers at least.
    pub least: [f64; 2],
    /// The series.
    pub series: &'static [Series],
}

/// A quantity against the motion that makes it.
pub struct Loop {
    /// The motion, with its unit.
    pub motion_label: &'static str,
    /// Its value.
    pub motion: fn(&Response) -> f64,
    /// The response quantity, with its unit.
    pub answer_label: &'static str,
    /// Its value.
    pub answer: fn(&Response) -> f64,
}

/// Panels of the figure along the path, from above.
pub const ALONG: &[Panel] = &[
    Panel {
        label: "Motion of the body, mm",
        least: [0.0, 0.1],
        series: &[
            Series { name: "depth", of: |r| r.depth_mm },
            Series { name: "slide x", of: |r| r.slide_x_mm },
            Series { name: "slide y", of: |r| r.slide_y_mm },
        ],
    },
    Panel {
        label: "Turns, degrees",
        least: [0.0, 1.0],
        series: &[
            Series { name: "spin", of: |r| r.spin_deg },
            Series { name: "pitch", of: |r| r.pitch_deg },
            Series { name: "roll", of: |r| r.roll_deg },
        ],
    },
    Panel {
        label: "Force on the finger, N",
        least: [0.0, 0.01],
        series: &[
            Series { name: "normal", of: |r| r.normal_force_n },
            Series { name: "friction x", of: |r| r.friction_x_n },
            Series { name: "friction y", of: |r| r.friction_y_n },
        ],
    },
    Panel {
        label: "Moment on the finger about the foot, N mm",
        least: [0.0, 0.1],
        series: &[
            Series { name: "about the normal", of: |r| r.moment_n_mm[2] },
            Series { name: "about x", of: |r| r.moment_n_mm[0] },
            Series { name: "about y", of: |r| r.moment_n_mm[1] },
        ],
    },
    Panel {
        label: "Centre of pressure, mm",
        least: [0.0, 0.0],
        series: &[
            Series { name: "x", of: |r| r.centre_of_pressure_mm[0] },
            Series { name: "y", of: |r| r.centre_of_pressure_mm[1] },
        ],
    },
    Panel {
        label: "Contact area, mm²",
        least: [0.0, 1.0],
        series: &[Series { name: "area", of: |r| r.contact_area_mm2 }],
    },
    Panel {
        label: "Stick ratio (stuck area over contact area)",
        least: [0.0, 1.0],
        series: &[Series { name: "stick ratio", of: |r| r.stick_ratio }],
    },
];

/// Panels of the figure of loops.
pub const LOOPS: &[Loop] = &[
    Loop {
        motion_label: "Depth, mm",
        motion: |r| r.depth_mm,
        answer_label: "Normal force, N",
        answer: |r| r.normal_force_n,
    },
    Loop {
        motion_label: "Slide x, mm",
        motion: |r| r.slide_x_mm,
        answer_label: "Friction x, N",
        answer: |r| r.friction_x_n,
    },
    Loop {
        motion_label: "Spin, degrees",
        motion: |r| r.spin_deg,
        answer_label: "Moment about the normal, N mm",
        answer: |r| r.moment_n_mm[2],
    },
    Loop {
        motion_label: "Slide y, mm",
        motion: |r| r.slide_y_mm,
        answer_label: "Friction y, N",
        answer: |r| r.friction_y_n,
    },
];
