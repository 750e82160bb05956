//! A mesh in the keyword format of Abaqus and CalculiX.
//!
//! Node and element numbers are our indices plus one, hexahedra first, then tetrahedra of 4 and of 10 nodes, so that
//! results can be read back by number. One element set per region, one node set per named set, the surface
//! `PAD_SURFACE` of the pad faces, one `*EQUATION` per tie and direction. No materials, contact or steps: those are a
//! problem, not a mesh.

use std::collections::{HashMap, HashSet};
use std::io::Write;
use std::path::Path;

use super::{Error, atomic_write};
use crate::mesh::{Mesh, Region, Tie};

/// Name of the element surface made of the pad faces.
pub const PAD_SURFACE: &str = "PAD_SURFACE";

/// Faces of a C3D8, S1 to S6, as corners of the element.
const HEX_FACES: [[usize; 4]; 6] = [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]];

/// Faces of a C3D10, S1 to S4, as its edge nodes.
const TET10_FACES: [[usize; 3]; 4] = [[4, 5, 6], [7, 8, 4], [8, 9, 5], [9, 7, 6]];

/// The written parts of a mesh, and their types.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Element type of hexahedra.
    pub hex_type: String,
    /// Element type of 4-node tetrahedra.
    pub tet_type: String,
    /// Element type of 10-node tetrahedra.
    pub tet10_type: String,
    /// Regions whose elements are left out (rigid bodies whose nodes are held fixed).
    pub omit: Vec<Region>,
    /// Ties of these nodes are left out, because a boundary condition holds them.
    pub held: Vec<u32>,
}

impl Default for Settings {
    /// Nothing left out; `C3D8R`, `C3D4` and `C3D10`.
    fn default() -> Self {
        Self {
            hex_type: "C3D8R".into(),
            tet_type: "C3D4".into(),
            tet10_type: "C3D10".into(),
            omit: Vec::new(),
            held: Vec::new(),
        }
    }
}

/// Writes the mesh alone to a file, whole or not at all.
pub fn write(file: &Path, mesh: &Mesh, settings: &Settings) -> Result<(), Error> {
    let problem = |problem| Error::Content { path: file.to_path_buf(), problem };
    let faces = pad_element_faces(mesh, settings).map_err(problem)?;
    check_names(mesh).map_err(problem)?;
    atomic_write(file, |w| {
        writeln!(w, "*HEADING\nmm, N, s, MPa")?;
        write_parts(w, mesh, settings, &faces)
    })
}

/// The mesh as text for a deck that continues with materials and steps; the error is a sentence.
pub fn to_text(mesh: &Mesh, settings: &Settings) -> Result<String, String> {
    check_names(mesh)?;
    let faces = pad_element_faces(mesh, settings)?;
    let mut text = Vec::new();
    write_parts(&mut text, mesh, settings, &faces).map_err(|e| e.to_string())?;
    String::from_utf8(text).map_err(|e| e.to_string())
}

fn check_names(mesh: &Mesh) -> Result<(), String> {
    let fine = |name: &str| {
        name.len() <= 80
            && name.starts_with(|c: char| c.is_ascii_alphabetic())
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
    };
    match mesh.node_sets.keys().chain(&mesh.soft_regions).find(|name| !fine(name)) {
        None => Ok(()),
        Some(name) => {
            Err(format!("set `{name}`: a set's name is up to 80 letters, digits, `_` or `-`, a letter first"))
        }
    }
}

/// Element number and face number of every pad face.
fn pad_element_faces(mesh: &Mesh, settings: &Settings) -> Result<Vec<(usize, usize)>, String> {
    let mut owners = HashMap::new();
    for (e, hex) in mesh.hexes.iter().enumerate().filter(|(_, hex)| !settings.omit.contains(&hex.region)) {
        for (f, corners) in HEX_FACES.iter().enumerate() {
            owners.insert(sorted(corners.map(|c| hex.nodes[c])), (e + 1, f + 1));
        }
    }
    let mut pad: Vec<(usize, usize)> = mesh
        .pad_faces
        .iter()
        .map(|face| owners.get(&sorted(*face)).copied().ok_or(face))
        .collect::<Result<_, _>>()
        .map_err(|face| format!("pad face {face:?} is not a face of a hexahedron that is written"))?;
    // A face of a 10-node tetrahedron is the pad's if the triangle between its edge nodes is.
    let triangles: HashSet<[u32; 3]> = mesh.pad_triangles.iter().map(|t| sorted(*t)).collect();
    let first = mesh.hexes.len() + mesh.tets.len() + 1;
    for (e, tet) in mesh.tets10.iter().enumerate().filter(|(_, tet)| !settings.omit.contains(&tet.region)) {
        let mine = |(_, edges): &(usize, &[usize; 3])| triangles.contains(&sorted(edges.map(|n| tet.nodes[n])));
        pad.extend(TET10_FACES.iter().enumerate().filter(mine).map(|(f, _)| (first + e, f + 1)));
    }
    Ok(pad)
}

fn sorted<const N: usize>(mut nodes: [u32; N]) -> [u32; N] {
    nodes.sort_unstable();
    nodes
}

fn write_parts(w: &mut dyn Write, mesh: &Mesh, settings: &Settings, pad: &[(usize, usize)]) -> std::io::Result<()> {
    writeln!(w, "*NODE, NSET=ALL_NODES")?;
    for (i, p) in mesh.nodes.iter().enumerate() {
        writeln!(w, "{}, {:.12e}, {:.12e}, {:.12e}", i + 1, p.x, p.y, p.z)?;
    }
    for (region, name) in mesh.regions().into_iter().filter(|(region, _)| !settings.omit.contains(region)) {
        if mesh.hexes.iter().any(|hex| hex.region == region) {
            writeln!(w, "*ELEMENT, TYPE={}, ELSET={name}", settings.hex_type)?;
            for (e, hex) in mesh.hexes.iter().enumerate().filter(|(_, hex)| hex.region == region) {
                write_element(w, e + 1, &hex.nodes)?;
            }
        }
        let tets10 = || mesh.tets10.iter().enumerate().filter(|(_, tet)| tet.region == region);
        if tets10().next().is_some() {
            writeln!(w, "*ELEMENT, TYPE={}, ELSET={name}", settings.tet10_type)?;
            for (e, tet) in tets10() {
                write_element(w, mesh.hexes.len() + mesh.tets.len() + e + 1, &tet.nodes)?;
            }
        }
        if mesh.tets.iter().any(|tet| tet.region == region) {
            writeln!(w, "*ELEMENT, TYPE={}, ELSET={name}", settings.tet_type)?;
            for (e, tet) in mesh.tets.iter().enumerate().filter(|(_, tet)| tet.region == region) {
                write_element(w, mesh.hexes.len() + e + 1, &tet.nodes)?;
            }
        }
    }
    for (name, nodes) in mesh.node_sets.iter().filter(|(_, nodes)| !nodes.is_empty()) {
        write_node_set(w, name, nodes)?;
    }
    if !pad.is_empty() {
        writeln!(w, "*SURFACE, NAME={PAD_SURFACE}, TYPE=ELEMENT")?;
        for (element, face) in pad {
            writeln!(w, "{element}, S{face}")?;
        }
    }
    // A tie has a meaning only if its own elements are written.
    let written = |region: &Region| !settings.omit.contains(region);
    let tets = mesh.tets.iter().filter(|tet| written(&tet.region)).flat_map(|tet| tet.nodes);
    let hexes = mesh.hexes.iter().filter(|hex| written(&hex.region)).flat_map(|hex| hex.nodes);
    let in_elements: HashSet<u32> = tets.chain(hexes).collect();
    let tied = |tie: &&Tie| !settings.held.contains(&tie.slave) && in_elements.contains(&tie.slave);
    for tie in mesh.ties.iter().filter(tied) {
        for dof in 1..=3 {
            writeln!(w, "*EQUATION\n{}", tie.masters.len() + 1)?;
            write!(w, "{}, {dof}, -1.", tie.slave + 1)?;
            for (k, (master, weight)) in tie.masters.iter().enumerate() {
                // Four terms to a line.
                w.write_all(if (k + 1) % 4 == 0 { b",\n" } else { b", " })?;
                write!(w, "{}, {dof}, {weight:.12e}", master + 1)?;
            }
            writeln!(w)?;
        }
    }
    Ok(())
}

fn write_element(w: &mut dyn Write, number: usize, nodes: &[u32]) -> std::io::Result<()> {
    write!(w, "{number}")?;
    for node in nodes {
        write!(w, ", {}", node + 1)?;
    }
    writeln!(w)
}

/// A node set, eight numbers to a line.
pub fn write_node_set(w: &mut dyn Write, name: &str, nodes: &[u32]) -> std::io::Result<()> {
    writeln!(w, "*NSET, NSET={name}")?;
    for line in nodes.chunks(8) {
        let line: Vec<String> = line.iter().map(|n| (n + 1).to_string()).collect();
        writeln!(w, "{},", line.join(", "))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_mesh;

    #[test]
    fn faces_are_numbered_as_the_manual_does() {
        let mesh = test_mesh::hex_and_tet();
        // Every face of the one hexahedron, given in turn as pad face.
        for (f, corners) in HEX_FACES.iter().enumerate() {
            let pad_faces = vec![corners.map(|c| mesh.hexes[0].nodes[c])];
            let mesh = Mesh { pad_faces, ..mesh.clone() };
            assert_eq!(pad_element_faces(&mesh, &Settings::default()).unwrap(), [(1, f + 1)]);
        }
    }

    #[test]
    fn the_text_of_a_small_mesh() {
        let text = to_text(&test_mesh::hex_and_tet(), &Settings::default()).unwrap();
        for part in [
            "*NODE, NSET=ALL_NODES\n1, 0.000000000000e0, ",
            "*ELEMENT, TYPE=C3D8R, ELSET=skin\n1, 1, 2, 3, 4, 5, 6, 7, 8\n",
            "*ELEMENT, TYPE=C3D4, ELSET=nail\n2, 9, 10, 11, 12\n",
            "*NSET, NSET=pad\n1, 2, 3, 4,\n",
            "*SURFACE, NAME=PAD_SURFACE, TYPE=ELEMENT\n1, S1\n",
            "*EQUATION\n5\n9, 2, -1., 5, 2, 2.500000000000e-1, 6, 2, 2.500000000000e-1, 7, 2, 2.500000000000e-1,\n8, 2, ",
        ] {
            assert!(text.contains(part), "{part} not in\n{text}");
        }
        let held = Settings { held: vec![8], ..Settings::default() };
        assert!(!to_text(&test_mesh::hex_and_tet(), &held).unwrap().contains("*EQUATION\n5\n9,"));
    }

    #[test]
    fn what_cannot_be_written_is_named() {
        let mut mesh = test_mesh::hex_and_tet();
        let omit = Settings { omit: vec![Region::Skin], ..Settings::default() };
        assert!(to_text(&mesh, &omit).unwrap_err().starts_with("pad face [0, 3, 2, 1] is not"));
        mesh.node_sets.insert("two words".into(), vec![0]);
        let dir = tempfile::tempdir().unwrap();
        let error = write(&dir.path().join("m.inp"), &mesh, &Settings::default()).unwrap_err().to_string();
        assert!(error.contains("m.inp: set `two words`"), "{error}");
    }
}
