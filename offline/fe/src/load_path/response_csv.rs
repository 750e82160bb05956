//! Responses along a path as CSV, one row per increment.

use std::io::{self, Write};
use std::path::Path;

use fingerpad::Status;

use crate::load_path::Response;
use fingerpad_formats::Columns;
use fingerpad_formats::{Error, atomic_write, number};

/// Columns of every response file, in the order of writing.
pub const COLUMNS: [&str; 11] = [
    "t_s",
    "depth_mm",
    "slide_x_mm",
    "slide_y_mm",
    "normal_force_n",
    "friction_x_n",
    "friction_y_n",
    "contact_area_mm2",
    "stick_ratio",
    "regime",
    "status",
];

/// Columns that a run in six degrees of freedom adds.
pub const POSE_COLUMNS: [&str; 8] =
    ["spin_deg", "pitch_deg", "roll_deg", "spin_moment_n_mm", "moment_x_n_mm", "moment_y_n_mm", "cop_x_mm", "cop_y_mm"];

/// Columns that the reduced model adds; [`read`] accepts and skips them.
pub const EXTRA_COLUMNS: [&str; 7] = [
    "friction_limit_n",
    "slip_margin",
    "band_normal_n",
    "band_friction_n",
    "tangential_friction_x_n",
    "tangential_friction_y_n",
    "slip_margin_relaxed",
];

fn numbers(r: &Response) -> [f64; 9] {
    [
        r.t_s,
        r.depth_mm,
        r.slide_x_mm,
        r.slide_y_mm,
        r.normal_force_n,
        r.friction_x_n,
        r.friction_y_n,
        r.contact_area_mm2,
        r.stick_ratio,
    ]
}

fn pose_numbers(r: &Response) -> [f64; 8] {
    let [x, y, z] = r.moment_n_mm;
    let [cop_x, cop_y] = r.centre_of_pressure_mm;
    [r.spin_deg, r.pitch_deg, r.roll_deg, z, x, y, cop_x, cop_y]
}

/// Writes responses with the columns of [`POSE_COLUMNS`] after the others; numbers read back as the same f64. Without
/// contact the centre of pressure has empty cells.
///
/// # Errors
/// A value that is not finite is refused before anything is written; disk errors carry the path.
pub fn write(file: &Path, responses: &[Response]) -> Result<(), Error> {
    check(file, responses)?;
    atomic_write(file, |w| write_to(w, responses, None))
}

/// Refuses responses with a value that is not finite.
///
/// * `file`: for the message
///
/// # Errors
/// [`Error::Value`] with line and column.
pub fn check(file: &Path, responses: &[Response]) -> Result<(), Error> {
    let names = || COLUMNS[..9].iter().chain(&POSE_COLUMNS[..6]);
    for (i, response) in responses.iter().enumerate() {
        let values = || numbers(response).into_iter().chain(pose_numbers(response).into_iter().take(6));
        if let Some((column, value)) = names().zip(values()).find(|(_, value)| !value.is_finite()) {
            return Err(Error::Value {
                path: file.to_path_buf(),
                line: i + 2,
                column: (*column).to_owned(),
                value: value.to_string(),
                problem: "is not finite and was not written".to_owned(),
            });
        }
    }
    Ok(())
}

/// First line of a response file.
pub fn header(has_extra: bool) -> String {
    let extra: &[&str] = if has_extra { &EXTRA_COLUMNS } else { &[] };
    [&COLUMNS, &POSE_COLUMNS[..], extra].concat().join(",")
}

/// Writes the text of a response file.
///
/// * `extra`: values of [`EXTRA_COLUMNS`] for every response
///
/// # Errors
/// Those of `w`.
pub fn write_to(
    w: &mut dyn Write,
    responses: &[Response],
    extra: Option<&[[f64; EXTRA_COLUMNS.len()]]>,
) -> io::Result<()> {
    writeln!(w, "{}", header(extra.is_some()))?;
    let cell = |x: f64| if x.is_nan() { String::new() } else { number(x).to_string() };
    for (i, response) in responses.iter().enumerate() {
        for x in numbers(response) {
            write!(w, "{},", number(x))?;
        }
        write!(w, "{},{}", response.regime, response.status)?;
        for x in pose_numbers(response).into_iter().chain(extra.and_then(|e| e.get(i)).copied().into_iter().flatten()) {
            write!(w, ",{}", cell(x))?;
        }
        writeln!(w)?;
    }
    Ok(())
}

/// Reads a response file of `simulate` or `eval`; the centre of pressure is NaN if it has no cell, moments and turns are
/// zero where they have no column.
pub fn read(file: &Path) -> Result<Vec<Response>, Error> {
    let known: Vec<&str> = COLUMNS.into_iter().chain(POSE_COLUMNS).chain(EXTRA_COLUMNS).collect();
    let table = Columns::read(file, &known)?;
    let mut columns = [0; COLUMNS.len()];
    for (column, name) in columns.iter_mut().zip(COLUMNS) {
        *column = table.need(name)?;
    }
    let [regime, status] = [columns[9], columns[10]];
    table
        .rows
        .iter()
        .map(|row| {
            let value = |c: usize| table.number(row, columns[c]);
            let pose = |name: &str, absent: f64| match table.find(name) {
                Some(column) if !row.cells[column].is_empty() => table.number(row, column),
                _ => Ok(absent),
            };
            Ok(Response {
                t_s: value(0)?,
                depth_mm: value(1)?,
                slide_x_mm: value(2)?,
                slide_y_mm: value(3)?,
                normal_force_n: value(4)?,
                friction_x_n: value(5)?,
                friction_y_n: value(6)?,
                contact_area_mm2: value(7)?,
                stick_ratio: value(8)?,
                regime: row.cells[regime]
                    .parse()
                    .map_err(|()| table.refuse(row, regime, "is not one of no_contact, stick, partial_slip, slip"))?,
                status: parse_status(&row.cells[status])
                    .ok_or_else(|| table.refuse(row, status, "is neither `ok` nor flags joined by `+`"))?,
                centre_of_pressure_mm: [pose("cop_x_mm", f64::NAN)?, pose("cop_y_mm", f64::NAN)?],
                spin_deg: pose("spin_deg", 0.0)?,
                pitch_deg: pose("pitch_deg", 0.0)?,
                roll_deg: pose("roll_deg", 0.0)?,
                moment_n_mm: [pose("moment_x_n_mm", 0.0)?, pose("moment_y_n_mm", 0.0)?, pose("spin_moment_n_mm", 0.0)?],
            })
        })
        .collect()
}

/// The flags, parsed by the names that `Status` prints, so that this file needs no list of them.
fn parse_status(text: &str) -> Option<Status> {
    if text == Status::OK.to_string() {
        return Some(Status::OK);
    }
    text.split('+').try_fold(Status::OK, |sum, name| {
        let flag =
            (0..u32::BITS).map(|bit| Status(1 << bit)).find(|flag| !name.is_empty() && flag.to_string() == name)?;
        Some(sum.with(flag))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use fingerpad::Regime;

    fn sample() -> Response {
        Response {
            t_s: 0.1 + 0.2,
            depth_mm: 1.0 / 3.0,
            slide_x_mm: -1e-17,
            normal_force_n: 0.454,
            stick_ratio: 0.999_999_999_999_999_9,
            regime: Regime::PartialSlip,
            status: Status::STABILISED,
            centre_of_pressure_mm: [f64::NAN; 2],
            spin_deg: 7.5,
            pitch_deg: 41.0,
            roll_deg: -3.0,
            moment_n_mm: [1.25, -2.0, 0.5],
            ..Response::default()
        }
    }

    #[test]
    fn what_was_written_reads_back_bit_for_bit() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("r.csv");
        let rows = [Response { centre_of_pressure_mm: [f64::NAN; 2], ..Response::default() }, sample()];
        write(&file, &rows).unwrap();
        let back = read(&file).unwrap();
        // NaN differs from itself, so the printed texts are compared.
        assert_eq!(format!("{back:?}"), format!("{rows:?}"));
        let text = std::fs::read_to_string(&file).unwrap();
        assert!(text.lines().nth(2).unwrap().ends_with(",partial_slip,stabilised,7.5,41,-3,0.5,1.25,-2,,"), "{text}");
        assert!(text.lines().nth(1).unwrap().ends_with(",no_contact,ok,0,0,0,0,0,0,,"), "{text}");
    }

    #[test]
    fn what_is_not_finite_is_not_written() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("r.csv");
        let error = write(&file, &[sample(), Response { friction_y_n: f64::NAN, ..sample() }]).unwrap_err();
        assert!(error.to_string().ends_with("r.csv:3: column `friction_y_n`: `NaN` is not finite and was not written"));
        assert!(!file.exists());
    }

    #[test]
    fn reads_the_columns_of_eval_and_refuses_unknown_words() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("r.csv");
        let head = header(true) + "\n";
        let pose = "0,30,0,0.1,0,0,,,1,2,3,4,5,6,7";
        std::fs::write(&file, format!("{head}0,1,0,0,0.2,0.1,0,50,0.5,slip,ok,{pose}\n")).unwrap();
        assert_eq!(read(&file).unwrap()[0].regime, Regime::Slip);
        for (regime, status) in [("sliding", "ok"), ("slip", "bad"), ("slip", ""), ("slip", "stabilised+")] {
            std::fs::write(&file, format!("{head}0,1,0,0,0.2,0.1,0,50,0.5,{regime},{status},{pose}\n")).unwrap();
            assert!(read(&file).unwrap_err().to_string().contains("r.csv:2: column `"));
        }
    }
}
