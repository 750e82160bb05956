//! Reads a Gmsh `.msh` file of version 2.2 or 4.1, text or binary, of first or second order.
//!
//! Physical volumes become element sets; physical surfaces become surfaces of quadrilaterals and triangles (by their
//! corners) and, like physical curves and points, node sets. A group without a name has its tag as name. Of second order
//! are 10-node tetrahedra with their faces and edges; hexahedra are read by their corners. Other versions, other shapes and partitioned files are refused with
//! the Gmsh option that avoids them.

mod cursor;

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Vector3;

use super::Error;
use crate::raw_mesh::{RawElement, RawKind, RawMesh};
use cursor::{Coding, Cursor};

/// Reads a mesh.
///
/// # Errors
/// [`Error::Field`] with line (in a binary section, the section's line and the byte), section and value.
pub fn read(path: &Path) -> Result<RawMesh, Error> {
    let bytes = std::fs::read(path).map_err(|source| Error::File { path: path.to_path_buf(), source })?;
    let mut reader = Reader {
        at: Cursor::new(path, &bytes),
        version: Version::V41,
        coding: Coding::Text,
        names: Names::new(),
        entities: Entities::new(),
        mesh: RawMesh { gmsh_edges: true, ..RawMesh::new() },
    };
    reader.file()?;
    Ok(reader.mesh)
}

/// Physical tags of each entity (dimension, tag).
type Entities = BTreeMap<(usize, i64), Vec<i64>>;
/// Names of physical groups (dimension, tag).
type Names = BTreeMap<(usize, i64), String>;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Version {
    V22,
    V41,
}

struct Reader<'a> {
    at: Cursor<'a>,
    version: Version,
    coding: Coding,
    names: Names,
    entities: Entities,
    mesh: RawMesh,
}

/// An element type of Gmsh.
struct Shape {
    dimension: usize,
    nodes: usize,
    /// Element kind that a solid becomes.
    solid: Option<RawKind>,
    /// Corners of a face.
    corners: usize,
}

impl Shape {
    fn of(number: i64) -> Option<Self> {
        let (dimension, nodes, solid, corners) = match number {
            15 => (0, 1, None, 0),
            1 => (1, 2, None, 0),
            8 => (1, 3, None, 0),
            2 => (2, 3, None, 3),
            3 => (2, 4, None, 4),
            9 => (2, 6, None, 3),
            10 => (2, 9, None, 4),
            16 => (2, 8, None, 4),
            4 => (3, 4, Some(RawKind::Tet), 0),
            5 => (3, 8, Some(RawKind::Hex), 0),
            11 => (3, 10, Some(RawKind::Tet10), 0),
            12 => (3, 27, Some(RawKind::Hex), 0),
            17 => (3, 20, Some(RawKind::Hex), 0),
            _ => return None,
        };
        Some(Self { dimension, nodes, solid, corners })
    }
}

impl Reader<'_> {
    fn file(&mut self) -> Result<(), Error> {
        let mut seen = Vec::new();
        while let Some(line) = self.at.line() {
            if !line.starts_with('$') {
                return Err(self.at.fail(line.chars().take(40).collect::<String>(), "is outside of a section"));
            }
            let coding = if line == "$PhysicalNames" { Coding::Text } else { self.coding };
            self.at.begin(line.clone(), Coding::Text);
            if seen.is_empty() && line != "$MeshFormat" {
                return Err(self.at.fail(line, "is not $MeshFormat, with which a .msh file begins"));
            }
            match (line.as_str(), self.version) {
                ("$MeshFormat", _) => self.format()?,
                ("$PhysicalNames", _) => self.physical_names()?,
                ("$Entities", Version::V41) => {
                    self.at.coding = coding;
                    self.physical_groups_of_entities()?;
                }
                // Version 2.2 writes counts as text even in binary files.
                ("$Nodes", Version::V22) => self.nodes_22()?,
                ("$Elements", Version::V22) => self.elements_22()?,
                ("$Nodes", Version::V41) => {
                    self.at.coding = coding;
                    self.nodes_41()?;
                }
                ("$Elements", Version::V41) => {
                    self.at.coding = coding;
                    self.elements_41()?;
                }
                ("$PartitionedEntities", _) => {
                    let problem = "partitioned meshes are not read: set Mesh.NbPartitions = 0";
                    return Err(self.at.fail(line, problem));
                }
                _ => {
                    self.at.skip()?;
                    self.mesh.ignored.push(line);
                    continue;
                }
            }
            self.at.end()?;
            seen.push(line);
        }
        for needed in ["$Nodes", "$Elements"] {
            if !seen.iter().any(|s| s == needed) {
                self.at.begin("file".into(), Coding::Text);
                return Err(self.at.fail(needed, "is missing; the file is cut off or no mesh"));
            }
        }
        for set in self.mesh.node_sets.values_mut() {
            set.sort_unstable();
            set.dedup();
        }
        Ok(())
    }

    fn format(&mut self) -> Result<(), Error> {
        let line = self.at.needed_line()?;
        let cells: Vec<&str> = line.split_ascii_whitespace().collect();
        self.version = match cells.first() {
            Some(&"4.1") => Version::V41,
            Some(&"2.2") => Version::V22,
            _ => return Err(self.at.fail(&line, "is not version 4.1 or 2.2: write it with Mesh.MshFileVersion = 4.1")),
        };
        match cells[1..] {
            ["0", ..] => return Ok(()),
            ["1", "8", ..] => self.coding = Coding::Binary,
            _ => return Err(self.at.fail(&line, "is neither text (0) nor binary (1) with 8-byte numbers")),
        }
        self.at.coding = Coding::Binary;
        match self.at.int()? {
            1 => Ok(()),
            other => Err(self.at.fail(other.to_string(), "is not 1: the file is big-endian or damaged")),
        }
    }

    fn physical_names(&mut self) -> Result<(), Error> {
        self.at.record()?;
        let count = self.at.size()?;
        self.at.record_is_whole()?;
        for _ in 0..count {
            self.at.record()?;
            let line = self.at.needed_line()?;
            let mut parts = line.splitn(3, ' ');
            let mut part = || parts.next().unwrap_or("").trim();
            let (dim, tag, name) = (part().parse(), part().parse(), part());
            let (Ok(dim), Ok(tag), true) = (dim, tag, name.starts_with('"') && name.ends_with('"')) else {
                return Err(self.at.fail(line, "is not `dimension tag \"name\"`"));
            };
            self.names.insert((dim, tag), name.trim_matches('"').to_owned());
        }
        Ok(())
    }

    fn physical_groups_of_entities(&mut self) -> Result<(), Error> {
        self.at.record()?;
        let counts = [self.at.size()?, self.at.size()?, self.at.size()?, self.at.size()?];
        for (dimension, count) in counts.into_iter().enumerate() {
            for _ in 0..count {
                self.at.record()?;
                let entity = self.at.int()?;
                // A point has a position, all else a box.
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    self.at.double()?;
                }
                let physicals = self.at.size()?;
                let tags = (0..physicals).map(|_| Ok(self.at.int()?.abs())).collect::<Result<_, Error>>()?;
                if dimension > 0 {
                    for _ in 0..self.at.size()? {
                        self.at.int()?;
                    }
                }
                self.entities.insert((dimension, entity), tags);
            }
        }
        Ok(())
    }

    fn nodes_41(&mut self) -> Result<(), Error> {
        self.at.record()?;
        let (blocks, announced) = (self.at.size()?, self.at.size()?);
        let _range = (self.at.size()?, self.at.size()?);
        for _ in 0..blocks {
            self.at.record()?;
            let (dimension, _entity, parametric) = (self.at.int()?, self.at.int()?, self.at.int()?);
            let count = self.at.size()?;
            let mut tags = Vec::new();
            for _ in 0..count {
                self.at.record()?;
                tags.push(self.at.size()?);
            }
            for tag in tags {
                self.at.record()?;
                self.node(tag)?;
                for _ in 0..if parametric == 0 { 0 } else { dimension } {
                    self.at.double()?;
                }
            }
        }
        self.counted("nodes", announced, self.mesh.nodes.len())
    }

    fn nodes_22(&mut self) -> Result<(), Error> {
        let announced = self.count_22()?;
        for _ in 0..announced {
            self.at.record()?;
            let tag = self.at.int()?;
            self.node(tag as u64)?;
        }
        Ok(())
    }

    /// The count with which a section of version 2.2 begins, in text.
    fn count_22(&mut self) -> Result<u64, Error> {
        let line = self.at.needed_line()?;
        let count = line.parse().map_err(|_| self.at.fail(line, "is not a count"))?;
        self.at.coding = self.coding;
        Ok(count)
    }

    fn node(&mut self, tag: u64) -> Result<(), Error> {
        let place = Vector3::new(self.at.double()?, self.at.double()?, self.at.double()?);
        if !place.iter().all(|c| c.is_finite()) {
            return Err(self.at.fail(format!("node {tag}"), "is not at a finite place"));
        }
        self.mesh.nodes.push((tag, place));
        Ok(())
    }

    fn counted(&self, what: &str, announced: u64, found: usize) -> Result<(), Error> {
        if announced == found as u64 {
            return Ok(());
        }
        Err(self.at.fail(announced.to_string(), format!("{what} are announced, {found} are there")))
    }

    fn elements_41(&mut self) -> Result<(), Error> {
        self.at.record()?;
        let (blocks, announced) = (self.at.size()?, self.at.size()?);
        let _range = (self.at.size()?, self.at.size()?);
        let mut found = 0;
        for _ in 0..blocks {
            self.at.record()?;
            let (dimension, entity, kind) = (self.at.int()?, self.at.int()?, self.at.int()?);
            let count = self.at.size()?;
            let shape = self.shape(kind)?;
            let tags = self.entities.get(&(dimension as usize, entity)).cloned().unwrap_or_default();
            for _ in 0..count {
                self.at.record()?;
                let label = self.at.size()?;
                let nodes = (0..shape.nodes).map(|_| self.at.size()).collect::<Result<_, _>>()?;
                self.at.record_is_whole()?;
                self.element(&shape, label, nodes, &tags);
                found += 1;
            }
        }
        self.counted("elements", announced, found)
    }

    fn elements_22(&mut self) -> Result<(), Error> {
        let announced = self.count_22()?;
        let mut found = 0;
        while found < announced {
            self.at.record()?;
            // A binary block has one label for all its elements; in text every line has its own.
            let mut label = if self.coding == Coding::Text { self.at.int()? } else { 0 };
            let kind = self.at.int()?;
            let count = if self.coding == Coding::Text { 1 } else { self.at.int()? };
            let tag_count = self.at.int()?;
            let shape = self.shape(kind)?;
            for _ in 0..count {
                if self.coding == Coding::Binary {
                    label = self.at.int()?;
                }
                let tags: Vec<i64> = (0..tag_count).map(|_| self.at.int()).collect::<Result<_, _>>()?;
                let nodes = (0..shape.nodes).map(|_| Ok(self.at.int()? as u64)).collect::<Result<_, Error>>()?;
                self.at.record_is_whole()?;
                // The first tag is the physical group; 0 is none.
                let groups: Vec<i64> = tags.first().filter(|t| **t != 0).map(|t| t.abs()).into_iter().collect();
                self.element(&shape, label as u64, nodes, &groups);
                found += 1;
            }
            if count < 1 {
                return Err(self.at.fail(count.to_string(), "is not a number of elements"));
            }
        }
        self.counted("elements", announced, found as usize)
    }

    fn shape(&self, number: i64) -> Result<Shape, Error> {
        Shape::of(number).ok_or_else(|| {
            let problem = "is not read: hexahedra (5, 12, 17) and tetrahedra of 4 and 10 nodes (4, 11) are; write the \
                mesh with Mesh.ElementOrder = 1 (hexahedra) or 2 (tetrahedra), without prisms and pyramids";
            self.at.fail(format!("element type {number}"), problem)
        })
    }

    fn element(&mut self, shape: &Shape, label: u64, mut nodes: Vec<u64>, tags: &[i64]) {
        if shape.solid == Some(RawKind::Tet10) {
            // Gmsh has the last two edges in the other order.
            nodes.swap(8, 9);
        }
        for tag in tags {
            let key = (shape.dimension, *tag);
            let group = self.names.get(&key).cloned().unwrap_or_else(|| tag.to_string());
            if shape.dimension == 2 {
                let corners = nodes[..shape.corners].to_vec();
                self.mesh.surfaces.entry(group.clone()).or_default().push(corners);
            }
            if shape.solid.is_some() {
                self.mesh.element_sets.entry(group).or_default().push(label);
            } else {
                self.mesh.node_sets.entry(group).or_default().extend(&nodes);
            }
        }
        if let Some(kind) = shape.solid {
            if kind == RawKind::Hex && nodes.len() > 8 {
                nodes.truncate(8);
                let remark = "nodes of second-order hexahedra but for their corners";
                if !self.mesh.ignored.iter().any(|of| of == remark) {
                    self.mesh.ignored.push(remark.into());
                }
            }
            self.mesh.elements.push(RawElement { label, kind, nodes });
        }
    }
}

#[cfg(test)]
mod tests;
