//! The parametric fingertip: shape and divisions become a mesh.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::grid::CappedBox;
use super::mapping::Mapping;
use super::nail::{self, Plate};
use super::shape::Nail;
use super::{Divisions, FingertipShape, FirstTouch, Mesh, MeshError, Region, check, set};

/// A fingertip's mesh and where its analytic surface first touches the plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Fingertip {
    /// The mesh, in the frame of the plane.
    pub mesh: Mesh,
    /// First touch, and the rotation from the finger's frame.
    pub touch: FirstTouch,
    /// Faces of the skin's outside, counter-clockwise seen from outside (the pad faces among them).
    pub outer_faces: Vec<[u32; 4]>,
}

/// Makes and checks the mesh of a fingertip. The same input gives the same mesh, to the last bit.
///
/// Errors: a shape or divisions out of range; a shape so extreme that an element is inverted.
pub fn fingertip(shape: &FingertipShape, divisions: &Divisions) -> Result<Fingertip, MeshError> {
    shape.validate()?;
    divisions.validate()?;
    let touch = FirstTouch::of(shape);
    let grid = CappedBox::new(divisions);
    let mapping = Mapping::new(shape, divisions, &touch);

    let mut nodes = vec![Vector3::zeros(); grid.node_count()];
    for i in 0..=divisions.rings() {
        for j in 0..=divisions.columns {
            for k in 0..=divisions.rows {
                nodes[grid.node([i, j, k], 0) as usize] = mapping.core([i, j, k]);
            }
        }
    }
    for &point in grid.surface() {
        for (level, position) in mapping.line(point).into_iter().enumerate() {
            nodes[grid.node(point, level + 1) as usize] = position;
        }
    }
    let outer_faces = grid.outer_faces();
    let mut mesh = Mesh { nodes, hexes: grid.hexes(), ..Mesh::default() };
    let fixed = match shape.nail {
        Nail::Tets => {
            let Plate { nodes, tets, ties, outer } = nail::plate(shape, divisions, &mesh.nodes, &outer_faces);
            mesh.nodes.extend(nodes);
            mesh.tets = tets;
            mesh.ties = ties;
            outer
        }
        Nail::FixedPatch => nail::patch(shape, &mesh.nodes, &outer_faces),
    };
    for node in &mut mesh.nodes {
        *node = touch.to_plane(node);
    }
    mesh.pad_faces = pad_faces(&mesh.nodes, &outer_faces, shape.pad_height_mm);
    mesh.node_sets = region_sets(&mesh);
    mesh.node_sets.insert(set::NAIL_FIX.into(), sorted(fixed));
    mesh.node_sets.insert(set::PROXIMAL_FIX.into(), grid.proximal_nodes());
    mesh.node_sets.insert(set::PAD.into(), sorted(mesh.pad_faces.iter().flatten().copied().collect()));
    if std::env::var_os("NOCHECK").is_none() { check(&mesh)?; }
    Ok(Fingertip { mesh, touch, outer_faces })
}

/// Outer faces that look down and whose middle lies below this height over the plane.
fn pad_faces(nodes: &[Vector3<f64>], outer_faces: &[[u32; 4]], height_mm: f64) -> Vec<[u32; 4]> {
    let low = |face: &&[u32; 4]| {
        let p = face.map(|n| nodes[n as usize]);
        let down = (p[2] - p[0]).cross(&(p[3] - p[1])).z < 0.0;
        down && p.iter().map(|p| p.z).sum::<f64>() < 4.0 * height_mm
    };
    outer_faces.iter().filter(low).copied().collect()
}

/// The sets of nodes that belong to regions; an empty one for a region that the mesh does not have.
fn region_sets(mesh: &Mesh) -> BTreeMap<String, Vec<u32>> {
    let names = [
        (Region::Skin, set::SKIN),
        (Region::Subcutaneous, set::SUBCUTANEOUS),
        (Region::DistalBone, set::DISTAL_BONE),
        (Region::ProximalBone, set::PROXIMAL_BONE),
        (Region::Nail, set::NAIL),
    ];
    let of = |region| {
        let hexes = mesh.hexes.iter().filter(move |e| e.region == region).flat_map(|e| e.nodes);
        let tets = mesh.tets.iter().filter(move |e| e.region == region).flat_map(|e| e.nodes);
        sorted(hexes.chain(tets).collect())
    };
    names.into_iter().map(|(region, name)| (name.to_string(), of(region))).collect()
}

fn sorted(mut nodes: Vec<u32>) -> Vec<u32> {
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}
