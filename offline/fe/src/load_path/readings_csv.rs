//! Readings along a path as CSV: reactions one row an increment, probes one row an increment and probe.

use std::io::{self, Write};
use std::path::Path;

use fingerpad_formats::{Columns, Error, number};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use super::observed::SUPPORTS;
use super::{Finger, Probe, ProbeReading, Trajectory};

const AXES: [&str; 3] = ["x", "y", "z"];
const COMPONENTS: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];

/// First line of a file of reactions.
pub fn reactions_header() -> String {
    let of = |holder: &str| {
        let force = AXES.map(|axis| format!(",{holder}_force_{axis}_n")).concat();
        force + &AXES.map(|axis| format!(",{holder}_moment_{axis}_n_mm")).concat()
    };
    format!("t_s{}", SUPPORTS.map(of).concat())
}

/// Writes the reactions of a trajectory.
///
/// # Errors
/// Those of the writer.
pub fn write_reactions(w: &mut dyn Write, trajectory: &Trajectory) -> io::Result<()> {
    writeln!(w, "{}", reactions_header())?;
    for (response, reading) in trajectory.responses.iter().zip(&trajectory.readings) {
        write!(w, "{}", number(response.t_s))?;
        for reaction in &reading.reactions {
            for value in reaction.force_n.iter().chain(&reaction.moment_n_mm) {
                write!(w, ",{}", number(*value))?;
            }
        }
        writeln!(w)?;
    }
    Ok(())
}

/// Points of probes from a file: columns `probe` (may be absent), `x_mm`, `y_mm`, and `z_mm` or `below_skin_mm`.
///
/// # Errors
/// [`Error`] with line and value: no pad above a point, a name that is missing or occurs twice.
pub fn read_points(file: &Path, finger: &Finger) -> Result<Vec<(String, Vector3<f64>)>, Error> {
    let table = Columns::read(file, &["probe", "x_mm", "y_mm", "z_mm", "below_skin_mm"])?;
    table.need_rows(1)?;
    let (name, x, y) = (table.find("probe"), table.need("x_mm")?, table.need("y_mm")?);
    let (z, is_below) = table.either("z_mm", "below_skin_mm")?;
    let mut points: Vec<(String, Vector3<f64>)> = Vec::with_capacity(table.rows.len());
    for (k, row) in table.rows.iter().enumerate() {
        let name = name.map_or_else(|| format!("p{k:03}"), |column| row.cells[column].clone());
        if name.is_empty() || points.iter().any(|(other, _)| *other == name) {
            let problem = format!("probe `{name}`: each needs a name of its own");
            return Err(Error::Line { path: file.to_path_buf(), line: row.line, problem });
        }
        let [at_x, at_y, at_z] = [table.number(row, x)?, table.number(row, y)?, table.number(row, z)?];
        let point = if is_below {
            if at_z < 0.0 {
                return Err(table.refuse(row, z, "must not be negative"));
            }
            finger
                .below_skin([at_x, at_y], at_z)
                .ok_or_else(|| table.refuse(row, x, format!("there is no pad above ({at_x}, {at_y}) mm")))?
        } else {
            Vector3::new(at_x, at_y, at_z)
        };
        points.push((name, point));
    }
    Ok(points)
}

/// First line of a file of probes.
pub fn probes_header() -> String {
    let place = AXES.map(|axis| format!(",{axis}_mm")).concat();
    let strain = COMPONENTS.map(|c| format!(",strain_{c}")).concat();
    let rate = COMPONENTS.map(|c| format!(",strain_{c}_rate_per_s")).concat();
    format!(
        "t_s,probe{place}{strain},strain_largest,strain_least,strain_energy_density_mpa{rate},\
         strain_energy_density_rate_mpa_per_s"
    )
}

/// Writes the probes of a trajectory. A rate is the change since the row before over the time between; 0 in the first row.
///
/// # Errors
/// Those of the writer.
pub fn write_probes(w: &mut dyn Write, probes: &[Probe], trajectory: &Trajectory) -> io::Result<()> {
    writeln!(w, "{}", probes_header())?;
    let rows = || trajectory.responses.iter().zip(&trajectory.readings);
    let mut before: Option<(f64, &[ProbeReading])> = None;
    for (response, reading) in rows() {
        for (k, (probe, r)) in probes.iter().zip(&reading.probes).enumerate() {
            let rate = |of: &dyn Fn(&ProbeReading) -> f64| match before {
                Some((t_s, readings)) if response.t_s > t_s => (of(r) - of(&readings[k])) / (response.t_s - t_s),
                _ => 0.0,
            };
            let [largest, least] = principal(&r.strain);
            write!(w, "{},{}", number(response.t_s), probe.name)?;
            let values = r.place_mm.into_iter().chain(r.strain).chain([largest, least, r.strain_energy_density_mpa]);
            let rates = (0..6).map(|c| rate(&move |r: &ProbeReading| r.strain[c]));
            let energy_rate = rate(&|r: &ProbeReading| r.strain_energy_density_mpa);
            for value in values.chain(rates).chain([energy_rate]) {
                write!(w, ",{}", number(value))?;
            }
            writeln!(w)?;
        }
        before = Some((response.t_s, &reading.probes));
    }
    Ok(())
}

/// Largest and least principal strain.
fn principal(&[xx, yy, zz, xy, yz, xz]: &[f64; 6]) -> [f64; 2] {
    let values = SymmetricEigen::new(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)).eigenvalues;
    [values.max(), values.min()]
}
