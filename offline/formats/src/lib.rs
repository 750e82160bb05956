//! Files in and out, as plain arrays: atomic writes, columns of numbers, Abaqus/CalculiX `.inp`, Gmsh `.msh`, VTU,
//! label volumes (NRRD, NIfTI), height fields (CSV, NRRD).
//!
//! Main types: [`Error`] (names file, line and value), [`Columns`] (a CSV file of numbers; [`ColumnNames`]: with names
//! and units of its own; [`dialect`]: separators and decimals), [`mesh::Mesh`], [`raw_mesh::RawMesh`] and
//! [`label_volume::LabelVolume`] (contents of the files). Everything is written through [`atomic_write`], so that no
//! partial file has the final name. [`units`] checks numbers where they are read. Contains no physics. May use no other
//! crate of this repository.

mod atomic;
mod column_names;
mod columns;
pub mod dialect;
mod error;
pub mod heights;
pub mod inp;
pub mod inp_reader;
pub mod label_volume;
pub mod mesh;
pub mod msh;
pub mod msh_reader;
pub mod nifti;
pub mod nrrd;
mod queue;
pub mod raw_mesh;
pub mod unit;
pub mod units;
pub mod volume;
pub mod vtu;

pub use atomic::{atomic_write, discard_unfinished};
pub use column_names::ColumnNames;
pub use columns::{Columns, Row};
pub use error::Error;
pub use queue::in_threads;

use mesh::Region;

/// The regions of every fingertip with the spelling of their element sets, in the order of file output; a mesh may
/// name further soft ones, [`mesh::Mesh::regions`].
pub const REGIONS: [(Region, &str); 5] = [
    (Region::Skin, "skin"),
    (Region::Subcutaneous, "subcutaneous"),
    (Region::DistalBone, "bone"),
    (Region::ProximalBone, "proximal_bone"),
    (Region::Nail, "nail"),
];

/// Position of a region in [`mesh::Mesh::regions`]; the cell value `region` of VTU files.
fn region_index(region: Region) -> usize {
    match region {
        Region::Skin => 0,
        Region::Subcutaneous => 1,
        Region::DistalBone => 2,
        Region::ProximalBone => 3,
        Region::Nail => 4,
        Region::Soft(k) => REGIONS.len() + usize::from(k),
    }
}

/// The shortest decimal that reads back as the same f64.
pub fn number(value: f64) -> String {
    if value == 0.0 || (1e-5..1e15).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
}

/// A number for a message: some significant digits, without zeros at its end.
pub fn significant(value: f64, digits: usize) -> String {
    let exponent = if value == 0.0 { 0.0 } else { value.abs().log10().floor() };
    if !(-5.0..12.0).contains(&exponent) {
        return format!("{value:.*e}", digits.saturating_sub(1));
    }
    let decimals = (digits as f64 - 1.0 - exponent).max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    let trimmed = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    trimmed.to_owned()
}

#[cfg(test)]
mod test_mesh {
    use crate::mesh::{Hex, Mesh, Region, Tet, Tie};
    use nalgebra::Vector3;

    /// A unit cube of skin with a nail tetrahedron standing on its top, tied by one corner.
    pub fn hex_and_tet() -> Mesh {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let corner = |k: usize| Vector3::new(square[k % 4][0], square[k % 4][1], (k / 4) as f64);
        let mut nodes: Vec<_> = (0..8).map(corner).collect();
        nodes.extend([[0.5, 0.5, 1.0], [0.9, 0.5, 1.3], [0.5, 0.9, 1.3], [0.5, 0.5, 1.6]].map(Vector3::from));
        let sets = [("pad".to_owned(), vec![0, 1, 2, 3]), ("nail".to_owned(), vec![8, 9, 10, 11])];
        Mesh {
            nodes,
            hexes: vec![Hex { nodes: [0, 1, 2, 3, 4, 5, 6, 7], region: Region::Skin }],
            tets: vec![Tet { nodes: [8, 9, 10, 11], region: Region::Nail }],
            node_sets: sets.into(),
            pad_faces: vec![[0, 3, 2, 1]],
            ties: vec![Tie { slave: 8, masters: (4..8).map(|m| (m, 0.25)).collect() }],
            ..Mesh::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_round_trip() {
        for x in [0.0, 0.1, -1.0 / 3.0, 1e-300, 5e-324, f64::MAX, 1e15, 123_456.789, f64::EPSILON] {
            assert_eq!(number(x).parse::<f64>().unwrap(), x);
            assert!(number(x).len() < 26, "{}", number(x));
        }
    }

    #[test]
    fn numbers_of_messages_have_the_digits_that_matter() {
        for (value, digits, wanted) in [
            (1_518.399_999_999_999_9, 4, "1518"),
            (0.1 + 0.2, 4, "0.3"),
            (-0.012_345_6, 4, "-0.01235"),
            (123_456.7, 4, "123457"),
            (0.0, 4, "0"),
            (1.5e-9, 4, "1.500e-9"),
            (80.1, 12, "80.1"),
        ] {
            assert_eq!(significant(value, digits), wanted);
        }
        assert_eq!(significant(f64::NAN, 4), "NaN");
    }

    #[test]
    fn region_index_is_its_place_in_the_list() {
        let soft_regions = vec!["core".to_owned(), "gel".to_owned()];
        let mesh = mesh::Mesh { soft_regions, ..test_mesh::hex_and_tet() };
        assert_eq!(mesh.regions().len(), REGIONS.len() + 2);
        for (i, (region, name)) in mesh.regions().into_iter().enumerate() {
            assert_eq!((region_index(region), mesh.region_name(region)), (i, name));
        }
    }
}
