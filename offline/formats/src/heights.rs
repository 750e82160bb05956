//! Height fields: a CSV file of places on a regular grid, or a 2-D NRRD file.

use std::path::Path;

use super::{Columns, Error, nrrd};
use crate::unit;

/// Heights at the nodes of a regular grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Heights {
    /// Nodes along x and along y.
    pub nodes: [usize; 2],
    /// Distance of the nodes along x and along y, mm.
    pub spacing_mm: [f64; 2],
    /// Place of the first node, mm.
    pub origin_mm: [f64; 2],
    /// Heights, mm; x runs fastest.
    pub heights_mm: Vec<f64>,
}

/// Largest distance of a node from the grid, share of the spacing.
const OFF_GRID: f64 = 1e-3;
/// Units that a column may have, by the ending of its name.
const UNITS: [&str; 5] = ["mm", "m", "cm", "um", "nm"];

/// Reads a height field: columns `x_mm`, `y_mm`, `height_mm` in any order of rows, each also in m, cm, um or nm (`height_um`), or, of a
/// name that ends in `.nrrd` or `.nhdr`, two axes of heights in mm, whose middle is the origin.
///
/// # Errors
/// [`Error`] that names line and value: a node that is off the grid, occurs twice or is missing.
pub fn read(path: &Path) -> Result<Heights, Error> {
    let is_nrrd = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("nrrd") || e.eq_ignore_ascii_case("nhdr"));
    if is_nrrd {
        let ([nx, ny, _], steps, heights_mm) = nrrd::read_values(path, 2)?;
        let spacing_mm = [steps[0].norm(), steps[1].norm()];
        let origin_mm = [-0.5 * spacing_mm[0] * (nx - 1) as f64, -0.5 * spacing_mm[1] * (ny - 1) as f64];
        return Ok(Heights { nodes: [nx, ny], spacing_mm, origin_mm, heights_mm });
    }
    let names: Vec<String> =
        ["x", "y", "height"].iter().flat_map(|name| UNITS.map(|unit| format!("{name}_{unit}"))).collect();
    let columns = Columns::read(path, &names.iter().map(String::as_str).collect::<Vec<_>>())?;
    columns.need_rows(16)?;
    // Each column, and the length of its unit.
    let column = |k: usize| {
        let names = &names[k * UNITS.len()..][..UNITS.len()];
        let mut found = names.iter().zip(UNITS).filter(|(name, _)| columns.find(name).is_some());
        let (name, unit) = found.next().unwrap_or((&names[0], UNITS[0]));
        if let Some((other, _)) = found.next() {
            let (column, other) = (other.clone(), name.clone());
            return Err(Error::Conflict { path: path.to_path_buf(), line: columns.header_line(), column, other });
        }
        Ok((columns.need(name)?, unit::find(&names[0], unit).map_or(1.0, |unit| unit.factor)))
    };
    let of = [column(0)?, column(1)?, column(2)?];
    let mut rows = Vec::with_capacity(columns.rows.len());
    for row in &columns.rows {
        let number = |k: usize| columns.number(row, of[k].0).map(|value| value * of[k].1);
        rows.push([number(0)?, number(1)?, number(2)?]);
    }
    let of = of.map(|(place, _)| place);
    let axis = |k: usize| {
        let mut places: Vec<f64> = rows.iter().map(|row| row[k]).collect();
        places.sort_by(f64::total_cmp);
        let (first, last) = (places[0], places[places.len() - 1]);
        // Places that differ by less than a ten thousandth of the whole are the same.
        let apart = 1e-4 * (last - first);
        let count = 1 + places.windows(2).filter(|pair| pair[1] - pair[0] > apart).count();
        (first, count, if count > 1 { (last - first) / (count - 1) as f64 } else { 0.0 })
    };
    let (x, y) = (axis(0), axis(1));
    let mut heights_mm = vec![f64::NAN; x.1 * y.1];
    for (row, [px, py, height]) in columns.rows.iter().zip(&rows) {
        let place = |axis: (f64, usize, f64), value: f64, column: usize| {
            let raw = if axis.2 > 0.0 { (value - axis.0) / axis.2 } else { 0.0 };
            if (raw - raw.round()).abs() > OFF_GRID {
                let problem = format!("is not on a grid of {} places {} apart from {}", axis.1, axis.2, axis.0);
                return Err(columns.refuse(row, column, problem));
            }
            Ok(raw.round() as usize)
        };
        let node = place(x, *px, of[0])? + x.1 * place(y, *py, of[1])?;
        if !heights_mm[node].is_nan() {
            return Err(columns.refuse(row, of[2], "is a second height at this place"));
        }
        heights_mm[node] = *height;
    }
    if let Some(node) = heights_mm.iter().position(|height| height.is_nan()) {
        let (px, py) = (x.0 + x.2 * (node % x.1) as f64, y.0 + y.2 * (node / x.1) as f64);
        let problem = format!("no height at x = {px} mm, y = {py} mm: the grid has {} x {} nodes", x.1, y.1);
        return Err(Error::Content { path: path.to_path_buf(), problem });
    }
    Ok(Heights { nodes: [x.1, y.1], spacing_mm: [x.2, y.2], origin_mm: [x.0, y.0], heights_mm })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(name: &str, text: &[u8]) -> Result<Heights, String> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(name);
        std::fs::write(&path, text).unwrap();
        read(&path).map_err(|e| e.to_string())
    }

    fn table(skip: usize) -> String {
        let rows =
            (0..20).filter(|k| *k != skip).map(|k| format!("{},{},{}\n", 0.5 * f64::from(k as u8 % 5), k / 5, k));
        "x_mm,y_mm,height_mm\n".to_owned() + &rows.collect::<String>()
    }

    #[test]
    fn a_table_and_a_volume_of_two_axes_are_the_same_field() {
        let field = parse("h.csv", table(99).as_bytes()).unwrap();
        assert_eq!((field.nodes, field.spacing_mm, field.origin_mm), ([5, 4], [0.5, 1.0], [0.0, 0.0]));
        assert_eq!(field.heights_mm[7], 7.0);
        let head = "NRRD0004\ntype: float\ndimension: 2\nsizes: 5 4\nspacings: 0.5 1\nencoding: ascii\n\n";
        let numbers: String = (0..20).map(|k| format!("{k} ")).collect();
        let volume = parse("h.nrrd", (head.to_owned() + &numbers).as_bytes()).unwrap();
        assert_eq!((volume.origin_mm, &volume.heights_mm), ([-1.0, -1.5], &field.heights_mm));
    }

    #[test]
    fn a_table_that_is_no_grid_is_refused_with_its_place() {
        assert!(parse("h.csv", table(7).as_bytes()).unwrap_err().contains("no height at x = 1 mm, y = 1 mm"));
        let twice = table(99) + "0,0,1\n";
        let error = parse("h.csv", twice.as_bytes()).unwrap_err();
        assert!(error.contains(":22") && error.contains("second height"), "{error}");
        let off = table(99).replace("\n0.5,1,", "\n0.6,1,");
        assert!(parse("h.csv", off.as_bytes()).is_err());
        let head = "NRRD0004\ntype: float\ndimension: 3\nsizes: 5 4 1\nspacings: 1 1 1\nencoding: ascii\n\n";
        assert!(parse("h.nrrd", head.as_bytes()).unwrap_err().contains("is not 2"));
    }

    #[test]
    fn every_column_has_a_unit_of_its_own() {
        let field = parse("h.csv", table(99).as_bytes()).unwrap();
        for (header, factors) in [("x_m,y_um,height_nm", [1e-3, 1e3, 1e6]), ("x_cm,y_mm,height_um", [0.1, 1.0, 1e3])] {
            let row = |line: &str| {
                let cells =
                    line.split(',').zip(factors).map(|(cell, f)| (cell.parse::<f64>().unwrap() * f).to_string());
                cells.collect::<Vec<_>>().join(",")
            };
            let rows: Vec<String> = table(99).lines().skip(1).map(row).collect();
            let other = parse("h.csv", format!("{header}\n{}\n", rows.join("\n")).as_bytes()).unwrap();
            assert_eq!(other.nodes, field.nodes);
            let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
            assert!(
                same(&other.spacing_mm, &field.spacing_mm) && same(&other.heights_mm, &field.heights_mm),
                "{other:?}"
            );
        }
        let twice = parse("h.csv", table(99).replace("x_mm,y_mm", "x_mm,x_um").as_bytes()).unwrap_err();
        assert!(twice.contains("`x_um`") && twice.contains("`x_mm`"), "{twice}");
        assert!(parse("h.csv", b"x_mm,y_mm,z\n").unwrap_err().contains("unknown column `z`"));
    }
}
