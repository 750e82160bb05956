//! Reads a Gmsh `.msh` 4.1 file, ASCII.
//!
//! Physical volumes become element sets; physical surfaces become surfaces of quadrilaterals and, like physical curves
//! and points, node sets. A group without a name has its tag as name. Binary files and versions other than 4.1 are
//! refused with the Gmsh option that avoids them.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Vector3;

use super::Error;
use crate::raw_mesh::{RawElement, RawKind, RawMesh};

/// Reads a mesh.
///
/// # Errors
/// [`Error::Field`] with line, section and value.
pub fn read(path: &Path) -> Result<RawMesh, Error> {
    let bytes = std::fs::read(path).map_err(|source| Error::File { path: path.to_path_buf(), source })?;
    let text = String::from_utf8_lossy(&bytes);
    let mut reader = Reader { path, lines: text.lines().enumerate(), line: 0, section: "file".into() };
    reader.file()
}

struct Reader<'a> {
    path: &'a Path,
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    line: usize,
    section: String,
}

/// Physical tags of each entity (dimension, tag).
type Entities = BTreeMap<(usize, i64), Vec<i64>>;
/// Names of physical groups (dimension, tag).
type Names = BTreeMap<(usize, i64), String>;

impl<'a> Reader<'a> {
    fn fail(&self, value: impl Into<String>, problem: impl Into<String>) -> Error {
        Error::Field {
            path: self.path.to_path_buf(),
            line: self.line,
            field: self.section.clone(),
            value: value.into(),
            problem: problem.into(),
        }
    }

    fn next(&mut self) -> Result<&'a str, Error> {
        match self.lines.next() {
            Some((index, line)) => {
                self.line = index + 1;
                Ok(line.trim())
            }
            None => Err(self.fail("", "the file ends within the section")),
        }
    }

    /// The numbers of the next line, at least `least`.
    fn numbers<T: std::str::FromStr>(&mut self, least: usize) -> Result<Vec<T>, Error> {
        let line = self.next()?;
        let number = |s: &str| s.parse().map_err(|_| self.fail(s, "is not such a number"));
        let found: Vec<T> = line.split_ascii_whitespace().map(number).collect::<Result<_, _>>()?;
        if found.len() < least { Err(self.fail(line, format!("has less than {least} numbers"))) } else { Ok(found) }
    }

    fn end(&mut self) -> Result<(), Error> {
        let line = self.next()?;
        let expected = format!("$End{}", &self.section[1..]);
        if line == expected { Ok(()) } else { Err(self.fail(line, format!("stands where {expected} should"))) }
    }

    fn file(&mut self) -> Result<RawMesh, Error> {
        let mut mesh = RawMesh::new();
        let (mut names, mut entities) = (Names::new(), Entities::new());
        let mut seen = Vec::new();
        while let Some((index, line)) = self.lines.next() {
            self.line = index + 1;
            let line = line.trim();
            if line.is_empty() {
                continue;
            }
            if !line.starts_with('$') {
                return Err(self.fail(line.chars().take(40).collect::<String>(), "stands outside of a section"));
            }
            self.section = line.to_owned();
            if seen.is_empty() && line != "$MeshFormat" {
                return Err(self.fail(line, "is not $MeshFormat, with which a .msh file begins"));
            }
            seen.push(line);
            match line {
                "$MeshFormat" => self.format()?,
                "$PhysicalNames" => self.names(&mut names)?,
                "$Entities" => self.entities(&mut entities)?,
                "$Nodes" => self.nodes(&mut mesh)?,
                "$Elements" => self.elements(&mut mesh, &names, &entities)?,
                "$PartitionedEntities" => {
                    return Err(self.fail(
                        line,
                        "partitioned meshes are not read: set Mesh.PartitionOldStyleMsh2 = 0, \
                         Mesh.NbPartitions = 0",
                    ));
                }
                _ => {
                    mesh.ignored.push(line.to_owned());
                    let end = format!("$End{}", &line[1..]);
                    while self.next()? != end {}
                    continue;
                }
            }
            self.end()?;
        }
        for needed in ["$Nodes", "$Elements"] {
            if !seen.contains(&needed) {
                self.section = "file".into();
                return Err(self.fail(needed, "is missing; the file is cut off or no mesh"));
            }
        }
        Ok(mesh)
    }

    fn format(&mut self) -> Result<(), Error> {
        let line = self.next()?;
        let cells: Vec<&str> = line.split_ascii_whitespace().collect();
        match cells.as_slice() {
            ["4.1", "0", ..] => Ok(()),
            ["4.1", "1", ..] => Err(self.fail(line, "is a binary file: write it with Mesh.Binary = 0")),
            _ => Err(self.fail(line, "is not version 4.1: write it with Mesh.MshFileVersion = 4.1")),
        }
    }

    fn names(&mut self, names: &mut Names) -> Result<(), Error> {
        let count = self.numbers::<usize>(1)?[0];
        for _ in 0..count {
            let line = self.next()?;
            let mut parts = line.splitn(3, ' ');
            let mut part = || parts.next().unwrap_or("");
            let (dim, tag, name) = (part().parse(), part().parse(), part());
            let (Ok(dim), Ok(tag), true) = (dim, tag, name.starts_with('"') && name.ends_with('"')) else {
                return Err(self.fail(line, "is not `dimension tag \"name\"`"));
            };
            names.insert((dim, tag), name.trim_matches('"').to_owned());
        }
        Ok(())
    }

    fn entities(&mut self, entities: &mut Entities) -> Result<(), Error> {
        let counts: Vec<usize> = self.numbers(4)?;
        for (dim, count) in counts.into_iter().take(4).enumerate() {
            for _ in 0..count {
                let numbers: Vec<f64> = self.numbers(5)?;
                // A point has a position, all else a box.
                let at = if dim == 0 { 4 } else { 7 };
                let physicals = numbers.get(at).map_or(0, |n| *n as usize);
                let tags = numbers.get(at + 1..at + 1 + physicals);
                let Some(tags) = tags else {
                    return Err(self.fail(numbers[0].to_string(), "is an entity with too few numbers"));
                };
                entities.insert((dim, numbers[0] as i64), tags.iter().map(|t| t.abs() as i64).collect());
            }
        }
        Ok(())
    }

    fn nodes(&mut self, mesh: &mut RawMesh) -> Result<(), Error> {
        let head: Vec<usize> = self.numbers(4)?;
        for _ in 0..head[0] {
            let block: Vec<i64> = self.numbers(4)?;
            let count = usize::try_from(block[3]).map_err(|_| self.fail(block[3].to_string(), "is no count"))?;
            let mut tags = Vec::new();
            for _ in 0..count {
                tags.push(self.numbers::<u64>(1)?[0]);
            }
            for tag in tags {
                let p: Vec<f64> = self.numbers(3)?;
                if !p[..3].iter().all(|c| c.is_finite()) {
                    return Err(self.fail(format!("node {tag}"), "is not at a finite place"));
                }
                mesh.nodes.push((tag, Vector3::new(p[0], p[1], p[2])));
            }
        }
        if mesh.nodes.len() == head[1] {
            Ok(())
        } else {
            Err(self.fail(head[1].to_string(), format!("nodes are announced, {} are there", mesh.nodes.len())))
        }
    }

    fn elements(&mut self, mesh: &mut RawMesh, names: &Names, entities: &Entities) -> Result<(), Error> {
        let head: Vec<usize> = self.numbers(4)?;
        for _ in 0..head[0] {
            let block: Vec<i64> = self.numbers(4)?;
            let (dim, entity, kind) = (block[0] as usize, block[1], block[2]);
            let kind = match kind {
                5 => Some((RawKind::Hex, 8)),
                4 => Some((RawKind::Tet, 4)),
                3 => Some((RawKind::Quad, 4)),
                1 | 2 | 15 => None,
                other => {
                    let problem = "is not read: 8-node hexahedra (5) and 4-node tetrahedra (4) are; second order and \
                        other shapes are not";
                    return Err(self.fail(format!("element type {other}"), problem));
                }
            };
            let corners = kind.map_or(1, |k| k.1);
            let tags = entities.get(&(dim, entity)).map_or(&[][..], Vec::as_slice);
            let groups: Vec<String> =
                tags.iter().map(|t| names.get(&(dim, *t)).cloned().unwrap_or_else(|| t.to_string())).collect();
            for _ in 0..block[3] {
                let mut numbers: Vec<u64> = self.numbers(1 + corners)?;
                let label = numbers.remove(0);
                if kind.is_some_and(|k| numbers.len() != k.1) {
                    return Err(self.fail(format!("element {label}"), format!("has {} nodes", numbers.len())));
                }
                for group in &groups {
                    if dim == 3 {
                        mesh.element_sets.entry(group.clone()).or_default().push(label);
                    } else {
                        mesh.node_sets.entry(group.clone()).or_default().extend(&numbers);
                    }
                    if dim == 2 {
                        mesh.surfaces.entry(group.clone()).or_default().push(numbers.clone());
                    }
                }
                if let Some((kind, _)) = kind.filter(|_| dim == 3) {
                    mesh.elements.push(RawElement { label, kind, nodes: numbers });
                }
            }
        }
        for set in mesh.node_sets.values_mut() {
            set.sort_unstable();
            set.dedup();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<RawMesh, String> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("m.msh");
        std::fs::write(&path, text).unwrap();
        read(&path).map_err(|e| e.to_string())
    }

    const TET: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 7 \"the pad\"\n3 1 \"skin\"\n\
        $EndPhysicalNames\n$Entities\n0 0 1 1\n3 0 0 0 1 1 1 1 7 0\n9 0 0 0 1 1 1 1 1 0\n$EndEntities\n$Nodes\n1 4 1 4\n\
        3 9 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n$Elements\n2 2 1 2\n2 3 2 1\n1 1 3 2\n3 9 4 1\n\
        2 1 2 3 4\n$EndElements\n";

    #[test]
    fn a_tetrahedron_with_groups() {
        let mesh = parse(TET).unwrap();
        assert_eq!(mesh.elements, [RawElement { label: 2, kind: RawKind::Tet, nodes: vec![1, 2, 3, 4] }]);
        assert_eq!(mesh.element_sets["skin"], [2]);
        assert_eq!(mesh.node_sets["the pad"], [1, 2, 3]);
        assert_eq!(mesh.surfaces["the pad"], [[1, 3, 2]]);
    }

    #[test]
    fn errors_name_line_section_and_value() {
        let cut = TET.find("$EndNodes").unwrap();
        for (text, expected) in [
            (TET.replace("4.1 0 8", "4.1 1 8"), ":2: $MeshFormat: `4.1 1 8` is a binary file"),
            (TET.replace("4.1 0 8", "2.2 0 8"), "Mesh.MshFileVersion"),
            (TET.replace("3 9 4 1\n2 1", "3 9 11 1\n2 1"), "$Elements: `element type 11` is not read"),
            (TET.replace("1 0 0\n0 1 0", "1 x 0\n0 1 0"), "$Nodes: `x` is not such a number"),
            (TET.replace("1 0 0\n0 1 0", "1 nan 0\n0 1 0"), "`node 2` is not at a finite place"),
            (TET.replace("2 1 2 3 4\n", "2 1 2 3\n"), "has less than 5 numbers"),
            (TET[..cut].to_owned(), "the file ends within the section"),
            (TET[..cut].to_owned() + "$EndNodes\n", "`$Elements` is missing"),
            (TET.replace("$Nodes\n1 4", "$Nodes\n1 5"), "`5` nodes are announced, 4"),
            ("solid\n".into(), "stands outside of a section"),
        ] {
            let error = parse(&text).unwrap_err();
            assert!(error.contains(expected), "{error}\nshould say: {expected}");
        }
    }
}
