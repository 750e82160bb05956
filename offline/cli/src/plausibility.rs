//! Warnings about inputs that are valid numbers and probably in another unit or of another sign; on standard error.

use fingerpad::Regime;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{Drive, Path, Response, Tissue};
use fingerpad_fe::mesh::Mesh;

/// Depths beyond which a path's column is probably in another unit, mm.
const IN_METRES_MM: f64 = 0.02;
const IN_MICROMETRES_MM: f64 = 10.0;

/// Warns of depths that are probably in metres or micrometres, or of the other sign.
pub fn warn_of_depths(path: &Path) {
    if path.drives[0] != Drive::Displacement {
        return;
    }
    let deepest = path.waypoints.iter().map(|w| w.normal).fold(f64::NEG_INFINITY, f64::max);
    if deepest <= 0.0 {
        eprintln!(
            "warning: no row touches: depth_mm is {deepest} at most and counts from first touch into the finger; is its \
             sign reversed?"
        );
    } else if deepest < IN_METRES_MM {
        eprintln!("warning: depth_mm is {deepest} at most; is the column in metres?");
    } else if deepest > IN_MICROMETRES_MM {
        eprintln!("warning: depth_mm reaches {deepest} mm into a fingertip; is the column in micrometres?");
    }
}

/// Warns of a path that presses without ever touching.
pub fn warn_of_no_contact(path: &Path, responses: &[Response]) {
    let presses = path.waypoints.iter().any(|w| w.normal > 0.0);
    if presses && responses.iter().all(|r| r.regime == Regime::NoContact) {
        eprintln!("warning: there is no contact along the whole path");
    }
}

/// Warns of stiffnesses that are probably in another unit; those that nothing can be computed with are refused with the mesh.
pub fn warn_of_stiffness(tissue: &Tissue) {
    for (section, doubt) in tissue.doubts().into_iter().filter(|(_, doubt)| !doubt.is_refused) {
        eprintln!("warning: {section}: {}", doubt.sentence);
    }
}

/// Longest side of the box around a fingertip's mesh, mm.
const FINGERTIP_MM: [f64; 2] = [3.0, 300.0];
/// Units of length, mm.
const LENGTH_UNITS: [(&str, f64); 4] = [("cm", 10.0), ("inches", 25.4), ("m", 1e3), ("um", 1e-3)];

/// Warns of an imported mesh that is small or large for a fingertip.
pub fn warn_of_size(config: &Config, mesh: &Mesh) {
    let Some(imported) = &config.imported else { return };
    let extent = |axis: usize| {
        let (low, high) = mesh.nodes.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| {
            (low.min(place[axis]), high.max(place[axis]))
        });
        high - low
    };
    let longest_mm = (0..3).map(extent).fold(0.0, f64::max);
    let [least, most] = FINGERTIP_MM;
    if (least..=most).contains(&longest_mm) {
        return;
    }
    let guesses: Vec<String> = LENGTH_UNITS
        .iter()
        .filter(|(_, factor)| (least..=most).contains(&(longest_mm * factor)))
        .map(|(unit, factor)| format!("{unit} (unit_mm = {})", imported.unit_mm * factor))
        .collect();
    if !guesses.is_empty() {
        eprintln!("warning: the imported mesh is {longest_mm:.3} mm long; is the file in {}?", guesses.join(" or "));
    }
}

/// Units of force, in N.
const FORCE_UNITS: [(&str, f64); 4] =
    [("millinewtons", 1e3), ("grams-force", 102.0), ("kilonewtons", 1e-3), ("kilograms-force", 0.102)];
/// Ratio of reading and prediction that no finger explains.
const IMPLAUSIBLE: f64 = 8.0;

/// Warns of normal forces that differ from the predicted ones by about the factor between two units.
///
/// * `pairs`: reading and prediction of every row, N
pub fn warn_of_force_unit(pairs: impl Iterator<Item = (f64, f64)>) {
    let (mut read, mut predicted) = (0.0, 0.0);
    for (reading, prediction) in pairs.filter(|(reading, _)| reading.is_finite()) {
        read += reading * reading;
        predicted += prediction * prediction;
    }
    let ratio = f64::sqrt(read / predicted);
    if !(ratio > 0.0 && ratio.is_finite()) || (1.0 / IMPLAUSIBLE..IMPLAUSIBLE).contains(&ratio) {
        return;
    }
    let away = |factor: f64| (ratio / factor).ln().abs();
    let (unit, _) = FORCE_UNITS.into_iter().min_by(|a, b| away(a.1).total_cmp(&away(b.1))).expect("four units");
    eprintln!(
        "warning: normal_force_n is {ratio:.3} times the prediction (root mean square over all rows); is the column in \
         {unit}?"
    );
}
