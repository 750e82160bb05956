//! A mesh as Gmsh `.msh` 4.1, ASCII.
//!
//! Regions are physical volumes, the pad faces the physical surface `pad`, and every node set a physical point group
//! (one-node elements). Node tags are our indices plus one; element tags run hexahedra, tetrahedra of 4 and of 10 nodes,
//! pad faces, pad triangles, points.
//! The format has no multi-point constraints: ties are not written.

use std::io::Write;
use std::path::Path;

use nalgebra::Vector3;

use super::{Error, atomic_write};
use crate::mesh::Mesh;

const HEX: u8 = 5;
const TET: u8 = 4;
const TET10: u8 = 11;
const TRIANGLE: u8 = 2;
const QUAD: u8 = 3;
const POINT: u8 = 15;

/// One block of `$Elements`: all elements of one kind on one entity.
struct Block<'a> {
    dim: u8,
    entity: usize,
    kind: u8,
    elements: Vec<(usize, &'a [u32])>,
}

/// Writes the mesh, whole or not at all.
///
/// # Errors
/// A node index beyond the nodes, or a set name with a quote; disk errors carry the path.
pub fn write(file: &Path, mesh: &Mesh) -> Result<(), Error> {
    let problem = |problem| Error::Content { path: file.to_path_buf(), problem };
    let mut names = mesh.node_sets.keys().chain(&mesh.soft_regions);
    if let Some(name) = names.find(|name| name.contains(['"', '\n'])) {
        return Err(problem(format!("set `{name}`: a quote or line break is not allowed in a name")));
    }
    let blocks = blocks(mesh);
    let used = blocks.iter().flat_map(|b| &b.elements).flat_map(|(_, nodes)| nodes.iter());
    if let Some(node) = used.copied().find(|n| *n as usize >= mesh.nodes.len()) {
        return Err(problem(format!("node {node} of an element or set does not exist ({} nodes)", mesh.nodes.len())));
    }
    atomic_write(file, |w| {
        writeln!(w, "$MeshFormat\n4.1 0 8\n$EndMeshFormat")?;
        write_names(w, mesh, &blocks)?;
        write_entities(w, mesh, &blocks)?;
        write_nodes(w, mesh, &blocks)?;
        write_elements(w, &blocks)
    })
}

fn blocks(mesh: &Mesh) -> Vec<Block<'_>> {
    let mut blocks = Vec::new();
    for (i, (region, _)) in mesh.regions().into_iter().enumerate() {
        for (kind, corners) in [(HEX, 8), (TET, 4), (TET10, 10)] {
            let numbered = mesh.elements().zip(1..);
            let mine = numbered.filter(|((nodes, of), _)| *of == region && nodes.len() == corners);
            let elements = mine.map(|((nodes, _), tag)| (tag, nodes)).collect();
            blocks.push(Block { dim: 3, entity: i + 1, kind, elements });
        }
    }
    let mut tag = mesh.elements().count() + 1;
    let quads = mesh.pad_faces.iter().map(|nodes| &nodes[..]).zip(tag..).map(|(n, t)| (t, n)).collect();
    blocks.push(Block { dim: 2, entity: 1, kind: QUAD, elements: quads });
    tag += mesh.pad_faces.len();
    let triangles = mesh.pad_triangles.iter().map(|nodes| &nodes[..]).zip(tag..).map(|(n, t)| (t, n)).collect();
    blocks.push(Block { dim: 2, entity: 1, kind: TRIANGLE, elements: triangles });
    tag += mesh.pad_triangles.len();
    for (i, nodes) in mesh.node_sets.values().enumerate() {
        let points = nodes.chunks(1).enumerate().map(|(k, node)| (tag + k, node)).collect();
        blocks.push(Block { dim: 0, entity: i + 1, kind: POINT, elements: points });
        tag += nodes.len();
    }
    blocks.retain(|block| !block.elements.is_empty());
    blocks
}

/// Entities in use as (dimension, tag), points first.
fn entities(blocks: &[Block]) -> Vec<(u8, usize)> {
    let mut entities: Vec<_> = blocks.iter().map(|b| (b.dim, b.entity)).collect();
    entities.sort_unstable();
    entities.dedup();
    entities
}

fn write_names(w: &mut dyn Write, mesh: &Mesh, blocks: &[Block]) -> std::io::Result<()> {
    let entities = entities(blocks);
    writeln!(w, "$PhysicalNames\n{}", entities.len())?;
    for (dim, tag) in entities {
        let name = match dim {
            0 => mesh.node_sets.keys().nth(tag - 1).map_or("", String::as_str),
            2 => "pad",
            _ => mesh.regions()[tag - 1].1,
        };
        writeln!(w, "{dim} {tag} \"{name}\"")?;
    }
    writeln!(w, "$EndPhysicalNames")
}

fn write_entities(w: &mut dyn Write, mesh: &Mesh, blocks: &[Block]) -> std::io::Result<()> {
    let entities = entities(blocks);
    let count = |dim| entities.iter().filter(|(d, _)| *d == dim).count();
    writeln!(w, "$Entities\n{} 0 {} {}", count(0), count(2), count(3))?;
    for &(dim, tag) in &entities {
        let nodes = blocks
            .iter()
            .filter(|b| (b.dim, b.entity) == (dim, tag))
            .flat_map(|b| &b.elements)
            .flat_map(|(_, nodes)| nodes.iter())
            .map(|n| mesh.nodes[*n as usize]);
        let (low, high) = nodes
            .fold((Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)), |(low, high), p| {
                (low.inf(&p), high.sup(&p))
            });
        write!(w, "{tag} {:e} {:e} {:e} ", low.x, low.y, low.z)?;
        if dim > 0 {
            write!(w, "{:e} {:e} {:e} ", high.x, high.y, high.z)?;
        }
        // One physical group with the entity's own tag; no bounding entities.
        writeln!(w, "1 {tag}{}", if dim > 0 { " 0" } else { "" })?;
    }
    writeln!(w, "$EndEntities")
}

fn write_nodes(w: &mut dyn Write, mesh: &Mesh, blocks: &[Block]) -> std::io::Result<()> {
    // Each node occurs once, on the first volume that uses it; nodes of no element on the first entity.
    let fallback = blocks.first().map_or((3, 1), |b| (b.dim, b.entity));
    let mut home = vec![None; mesh.nodes.len()];
    for block in blocks.iter().filter(|b| b.dim == 3) {
        for node in block.elements.iter().flat_map(|(_, nodes)| nodes.iter()) {
            home[*node as usize].get_or_insert((block.dim, block.entity));
        }
    }
    let home: Vec<_> = home.into_iter().map(|h| h.unwrap_or(fallback)).collect();
    let mut homes = home.clone();
    homes.sort_unstable();
    homes.dedup();
    let n = mesh.nodes.len();
    writeln!(w, "$Nodes\n{} {n} {} {n}", homes.len(), n.min(1))?;
    for here in homes {
        let mine: Vec<usize> = (0..n).filter(|i| home[*i] == here).collect();
        writeln!(w, "{} {} 0 {}", here.0, here.1, mine.len())?;
        for i in &mine {
            writeln!(w, "{}", i + 1)?;
        }
        for p in mine.iter().map(|i| mesh.nodes[*i]) {
            writeln!(w, "{:e} {:e} {:e}", p.x, p.y, p.z)?;
        }
    }
    writeln!(w, "$EndNodes")
}

fn write_elements(w: &mut dyn Write, blocks: &[Block]) -> std::io::Result<()> {
    let n: usize = blocks.iter().map(|b| b.elements.len()).sum();
    writeln!(w, "$Elements\n{} {n} {} {n}", blocks.len(), n.min(1))?;
    for block in blocks {
        writeln!(w, "{} {} {} {}", block.dim, block.entity, block.kind, block.elements.len())?;
        for (tag, nodes) in &block.elements {
            write!(w, "{tag}")?;
            for n in 0..nodes.len() {
                // Gmsh has the last two edges of a tetrahedron in the other order.
                let place = if block.kind == TET10 && n >= 8 { 17 - n } else { n };
                write!(w, " {}", nodes[place] + 1)?;
            }
            writeln!(w)?;
        }
    }
    writeln!(w, "$EndElements")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_mesh;

    #[test]
    fn counts_and_groups_of_a_small_mesh() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("m.msh");
        write(&file, &test_mesh::hex_and_tet()).unwrap();
        let text = std::fs::read_to_string(&file).unwrap();
        for part in [
            "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n0 1 \"nail\"\n0 2 \"pad\"\n2 1 \"pad\"\n3 1 \"skin\"\n3 5 \"nail\"\n",
            "$Entities\n2 0 1 2\n",
            "$Nodes\n2 12 1 12\n3 1 0 8\n",
            "$Elements\n5 11 1 11\n3 1 5 1\n1 1 2 3 4 5 6 7 8\n3 5 4 1\n2 9 10 11 12\n2 1 3 1\n3 1 4 3 2\n0 1 15 4\n",
        ] {
            assert!(text.contains(part), "{part} not in\n{text}");
        }
    }

    #[test]
    fn a_node_that_does_not_exist_is_named() {
        let mut mesh = test_mesh::hex_and_tet();
        mesh.node_sets.insert("far".into(), vec![99]);
        let error = write(Path::new("none.msh"), &mesh).unwrap_err().to_string();
        assert!(error.contains("node 99 "), "{error}");
    }
}
