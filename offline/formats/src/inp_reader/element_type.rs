//! Element types of Abaqus and CalculiX by their names.

use crate::raw_mesh::RawKind;

/// What is made of an element type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ElementType {
    /// An element: its kind, its nodes in the file, and how many of them are kept.
    Read { kind: RawKind, nodes: usize, kept: usize },
    /// A line, which holds nothing up.
    Line,
}

/// Families of surface elements; one that begins another's name stands after it.
const FACES: [&str; 13] =
    ["CPEG", "CPS", "CPE", "CGAX", "CAX", "DC2D", "DCAX", "DS", "SFM3D", "STRI", "M3D", "R3D", "S"];
/// Families of lines.
const LINES: [&str; 10] = ["T3D", "T2D", "B3", "B2", "C1D", "DC1D", "PIPE3", "PIPE2", "RB3D", "RB2D"];

/// The element type of a name in capitals, with any suffix (R, H, I, T, ...); None for one that is not read.
pub(super) fn element_type(name: &str) -> Option<ElementType> {
    // A number of nodes, then letters that choose the formulation.
    let solid = |nodes: &str| {
        let rest = name.strip_prefix("C3D")?.strip_prefix(nodes)?;
        rest.chars().all(|c| c.is_ascii_alphabetic()).then_some(())
    };
    for (digits, kind, nodes, kept) in [
        ("8", RawKind::Hex, 8, 8),
        ("20", RawKind::Hex, 20, 8),
        ("27", RawKind::Hex, 27, 8),
        ("4", RawKind::Tet, 4, 4),
        ("10", RawKind::Tet10, 10, 10),
    ] {
        if solid(digits).is_some() {
            return Some(ElementType::Read { kind, nodes, kept });
        }
    }
    let digit = |rest: &str| rest.starts_with(|c: char| c.is_ascii_digit());
    if LINES.iter().any(|family| name.strip_prefix(family).is_some_and(digit)) {
        return Some(ElementType::Line);
    }
    let rest = FACES.iter().find_map(|family| name.strip_prefix(family).filter(|rest| digit(rest)))?;
    // A triangle may name its degrees of freedom too: STRI65 has 6 nodes and 5 of them; S8R5.
    let (kind, nodes) = match rest.as_bytes()[0] {
        b'3' => (RawKind::Tri, 3),
        b'6' => (RawKind::Tri, 6),
        b'4' => (RawKind::Quad, 4),
        b'8' => (RawKind::Quad, 8),
        b'9' => (RawKind::Quad, 9),
        _ => return None,
    };
    Some(ElementType::Read { kind, nodes, kept: nodes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_abaqus_calculix_and_gmsh() {
        let read = |kind, nodes, kept| Some(ElementType::Read { kind, nodes, kept });
        for (names, expected) in [
            (&["C3D8", "C3D8R", "C3D8RH", "C3D8I", "C3D8IH"][..], read(RawKind::Hex, 8, 8)),
            (&["C3D20", "C3D20R"], read(RawKind::Hex, 20, 8)),
            (&["C3D27", "C3D27RH"], read(RawKind::Hex, 27, 8)),
            (&["C3D4", "C3D4H"], read(RawKind::Tet, 4, 4)),
            (&["C3D10", "C3D10M", "C3D10HS", "C3D10MHT"], read(RawKind::Tet10, 10, 10)),
            (
                &["CPS3", "CPE3H", "S3", "S3R", "STRI3", "M3D3", "SFM3D3", "R3D3", "CAX3", "DC2D3", "DS3"],
                read(RawKind::Tri, 3, 3),
            ),
            (
                &["CPS6", "CPS6M", "CPE6", "S6", "STRI65", "M3D6", "SFM3D6", "R3D6", "CAX6", "DC2D6"],
                read(RawKind::Tri, 6, 6),
            ),
            (&["CPS4", "CPEG4R", "S4R", "S4R5", "M3D4R", "SFM3D4R", "R3D4"], read(RawKind::Quad, 4, 4)),
            (&["CPS8", "CPE8R", "S8R", "S8R5", "M3D8", "SFM3D8R", "DS8"], read(RawKind::Quad, 8, 8)),
            (&["M3D9", "M3D9R", "S9R5"], read(RawKind::Quad, 9, 9)),
            (&["T3D2", "T3D3", "T2D3", "B31", "B32R", "B33", "B21", "B22", "C1D3"], Some(ElementType::Line)),
            (&["C3D6", "C3D15", "C3D5", "C3D13", "SC8R", "MASS", "SPRINGA", "CONN3D2", "S", "C3D", ""], None),
        ] {
            names.iter().for_each(|name| assert_eq!(element_type(name), expected, "{name}"));
        }
    }
}
