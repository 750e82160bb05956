//! The parametric fingertip: shape and divisions become a mesh.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use super::grid::{CappedBox, Point};
use super::mapping::Mapping;
use super::nail::{self, Plate};
use super::refinement::Refinement;
use super::shape::Nail;
use super::{Divisions, FingertipShape, FirstTouch, Mesh, MeshError, Region, Skin, Tie, check, set};

/// A fingertip's mesh and where its analytic surface first touches the plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Fingertip {
    /// The mesh, in the frame of the plane.
    pub mesh: Mesh,
    /// First touch, and the rotation from the finger's frame.
    pub touch: FirstTouch,
    /// The analytic surface of the skin, if it has one.
    pub skin: Option<Skin>,
    /// Faces of the skin's outside, counter-clockwise seen from outside (the pad faces among them).
    pub outer_faces: Vec<[u32; 4]>,
    /// The same of 10-node tetrahedra, nodes in the order of [`super::TET10_FACES`].
    pub outer_triangles: Vec<[u32; 6]>,
}

/// Makes and checks the mesh of a fingertip. The same input gives the same mesh, to the last bit.
///
/// # Errors
/// A shape or divisions out of range; a shape so extreme that an element is inverted.
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
    let fine = Mapping::new(shape, &divisions.refined_everywhere(), &touch);
    let tip = finish(shape, divisions, &grid, nodes, touch, |point| fine.line(point))?;
    Ok(Fingertip { skin: Some(Skin::of(shape, touch)), ..tip })
}

/// Hexahedra, nail, pad and sets on the nodes of a capped box, given in the frame of the finger; checked.
///
/// `fine_line` gives the positions on the line of a surface point of the grid that is refined everywhere, as
/// [`Mapping::line`] does.
pub(super) fn finish(
    shape: &FingertipShape,
    divisions: &Divisions,
    grid: &CappedBox,
    nodes: Vec<Vector3<f64>>,
    touch: FirstTouch,
    fine_line: impl Fn(Point) -> Vec<Vector3<f64>>,
) -> Result<Fingertip, MeshError> {
    let in_plane: Vec<Vector3<f64>> = nodes.iter().map(|p| touch.to_plane(p)).collect();
    let low = |face: &[u32; 4]| is_low(&in_plane, face, divisions.refined_height_mm);
    let wanted: Vec<bool> = grid.outer_faces().iter().map(low).collect();
    let Refinement { hexes, outer_faces, added, ties } = Refinement::new(grid, divisions, &wanted);
    let mut mesh = Mesh { nodes, hexes, ..Mesh::default() };
    mesh.nodes.extend(added.iter().map(|&(point, level)| fine_line(point)[level - 1]));
    for tie in &ties {
        mesh.nodes[tie.slave as usize] = tie.masters.iter().map(|&(n, weight)| mesh.nodes[n as usize] * weight).sum();
    }
    let fixed = match shape.nail {
        Nail::Tets => {
            let Plate { nodes, tets, ties, outer } = nail::plate(shape, divisions, &mesh.nodes, &grid.dorsal_faces());
            mesh.nodes.extend(nodes);
            mesh.tets = tets;
            mesh.ties = ties;
            outer
        }
        Nail::FixedPatch => nail::patch(shape, &mesh.nodes, &outer_faces),
        Nail::None => Vec::new(),
    };
    for node in &mut mesh.nodes {
        *node = touch.to_plane(node);
    }
    let low = |face: &&[u32; 4]| is_low(&mesh.nodes, face, shape.pad_height_mm);
    mesh.pad_faces = outer_faces.iter().filter(low).copied().collect();
    mesh.node_sets = region_sets(&mesh);
    mesh.node_sets.insert(set::NAIL_FIX.into(), sorted(fixed));
    let first = grid.node_count() as u32;
    let proximal = (first..).zip(&added).filter(|(_, (point, _))| point[0] == 0).map(|(node, _)| node);
    mesh.node_sets.insert(set::PROXIMAL_FIX.into(), grid.proximal_nodes().into_iter().chain(proximal).collect());
    mesh.node_sets.insert(set::PAD.into(), free_pad_nodes(&mesh, &ties));
    mesh.ties.extend(ties);
    check(&mesh)?;
    Ok(Fingertip { mesh, touch, skin: None, outer_faces, outer_triangles: Vec::new() })
}

/// Whether an outer face looks down and its middle lies below this height over the plane.
fn is_low(nodes: &[Vector3<f64>], face: &[u32; 4], height_mm: f64) -> bool {
    let p = face.map(|n| nodes[n as usize]);
    let down = (p[2] - p[0]).cross(&(p[3] - p[1])).z < 0.0;
    down && p.iter().map(|p| p.z).sum::<f64>() < 4.0 * height_mm
}

/// Nodes of the pad faces that do not hang.
fn free_pad_nodes(mesh: &Mesh, hanging: &[Tie]) -> Vec<u32> {
    let slaves: BTreeSet<u32> = hanging.iter().map(|tie| tie.slave).collect();
    sorted(mesh.pad_faces.iter().flatten().copied().filter(|node| !slaves.contains(node)).collect())
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Body;
    use crate::{MeshPreset, QualityReport, quality};

    fn named(name: &str, preset: MeshPreset) -> (FingertipShape, Fingertip, QualityReport) {
        let shape = FingertipShape::named(name).unwrap();
        let tip = fingertip(&shape, &preset.divisions()).unwrap();
        let report = quality(&tip.mesh);
        (shape, tip, report)
    }

    #[test]
    fn all_shapes_and_presets() {
        use MeshPreset::{Coarse, Default, Fine, Medium};
        for name in FingertipShape::NAMES {
            for (preset, nodes, most_pad) in [
                (Coarse, 2200..3000, 150),
                (Medium, 9000..12_000, 500),
                (Default, 12_000..16_000, 1300),
                (Fine, 55_000..62_000, 1700),
            ] {
                let (_, _, report) = named(name, preset);
                println!("{name} {preset:?}: {report:#?}");
                assert!(nodes.contains(&report.nodes), "{name} {preset:?}: {} nodes", report.nodes);
                assert!(report.pad_nodes <= most_pad, "{name} {preset:?}: {} pad nodes", report.pad_nodes);
                assert!(
                    report.worst_hex_scaled_jacobian > 0.35,
                    "{name} {preset:?}: {}",
                    report.worst_hex_scaled_jacobian
                );
                assert!(
                    report.worst_tet_scaled_jacobian > 0.05,
                    "{name} {preset:?}: {}",
                    report.worst_tet_scaled_jacobian
                );
            }
        }
    }

    #[test]
    fn pad_is_fine_near_first_touch() {
        for name in ["a", "e"] {
            for (preset, halved) in [(MeshPreset::Medium, 1.0), (MeshPreset::Default, 0.5)] {
                let (_, _, report) = named(name, preset);
                let [low, high] = report.touch_face_size_mm;
                assert!(low > 0.55 * halved && high < 0.85 * halved, "{name} {preset:?}: {low}..{high} mm");
            }
        }
    }

    #[test]
    fn volumes_approach_the_analytic_ones() {
        for name in FingertipShape::NAMES {
            let mut last = f64::INFINITY;
            for (preset, most) in [(MeshPreset::Coarse, 0.05), (MeshPreset::Medium, 0.02), (MeshPreset::Fine, 0.006)] {
                let (shape, _, report) = named(name, preset);
                let hexes = report.volume_mm3() - report.regions[&Region::Nail].volume_mm3;
                let missing = 1.0 - hexes / shape.volume_mm3();
                println!("{name} {preset:?}: {:.3} % of the volume missing", 100.0 * missing);
                assert!(missing > 0.0 && missing < most && missing < 0.6 * last, "{name} {preset:?}: {missing}");
                last = missing;
            }
            // Bones without the gap: the shaft's part of it is exact but for facets.
            let (shape, _, report) = named(name, MeshPreset::Fine);
            let bone = Body::bone(&shape);
            let section = bone.volume() - Body { tip_x: bone.tip_x - 1.0, ..bone }.volume();
            let gap = section * (shape.joint_end_mm - shape.joint_start_mm);
            let bones =
                report.regions[&Region::DistalBone].volume_mm3 + report.regions[&Region::ProximalBone].volume_mm3;
            assert!((bones / (bone.volume() - gap) - 1.0).abs() < 0.02);
        }
    }

    #[test]
    fn frame_and_sets() {
        let (shape, Fingertip { mesh, touch, outer_faces, .. }, _) = named("e", MeshPreset::Default);
        let finger = |n: &u32| touch.rotation.transpose() * mesh.nodes[*n as usize] + touch.point_mm;
        assert!(mesh.nodes.iter().all(|p| p.z > -1e-9));
        let lowest = outer_faces.iter().flatten().map(|&n| mesh.nodes[n as usize].z).fold(f64::INFINITY, f64::min);
        assert!(lowest < 0.01);
        let at_start = (0..mesh.nodes.len() as u32).filter(|n| finger(n).x.abs() < 1e-9).count();
        assert_eq!(mesh.node_set(set::PROXIMAL_FIX).len(), at_start);
        assert!(mesh.node_set(set::PROXIMAL_FIX).iter().all(|n| finger(n).x.abs() < 1e-9));
        assert!(mesh.node_set(set::PROXIMAL_BONE).iter().all(|n| finger(n).x < shape.joint_start_mm + 1e-9));
        assert!(mesh.node_set(set::DISTAL_BONE).iter().all(|n| finger(n).x > shape.joint_end_mm - 1e-9));
        let bone = Body::bone(&shape);
        assert!(mesh.node_set(set::DISTAL_BONE).iter().all(|n| bone.level(&finger(n)) < 1.0 + 1e-9));
        let on_bone = mesh.node_set(set::DISTAL_BONE).iter().filter(|n| bone.level(&finger(n)) > 1.0 - 1e-9).count();
        assert!(on_bone > 700);
        let of_nail = |n: &u32| mesh.node_set(set::NAIL).binary_search(n).is_ok();
        assert_eq!(mesh.node_set(set::NAIL_FIX).len(), mesh.ties.iter().filter(|tie| of_nail(&tie.slave)).count());
        assert!(mesh.node_set(set::NAIL_FIX).iter().all(|n| mesh.node_set(set::NAIL).binary_search(n).is_ok()));
        assert!(mesh.node_set(set::PAD).iter().all(|n| mesh.node_set(set::SKIN).binary_search(n).is_ok()));
        // Everything that can touch at 2.5 mm is a candidate.
        let pad: std::collections::BTreeSet<_> = mesh.pad_faces.iter().collect();
        for face in &outer_faces {
            let low = face.iter().any(|&n| mesh.nodes[n as usize].z < 2.5);
            assert!(!low || pad.contains(face), "face {face:?} is missing from the pad");
        }
    }

    #[test]
    fn skin_has_its_thickness() {
        let (shape, Fingertip { mesh, outer_faces, touch, .. }, _) = named("base", MeshPreset::Coarse);
        let body = Body::outer(&shape);
        let finger = |n: u32| touch.rotation.transpose() * mesh.nodes[n as usize] + touch.point_mm;
        let mut seen = 0;
        for hex in mesh.hexes.iter().filter(|h| h.region == Region::Skin) {
            let outer: [u32; 4] = hex.nodes[4..].try_into().unwrap();
            assert!(outer_faces.contains(&outer));
            for i in 0..4 {
                let (inner, outer) = (finger(hex.nodes[i]), finger(outer[i]));
                assert!((body.level(&outer) - 1.0).abs() < 1e-9);
                assert!((outer - inner - shape.skin_thickness_mm * body.normal(&outer)).norm() < 1e-9);
                seen += 1;
            }
        }
        assert_eq!(seen, 4 * outer_faces.len());
    }

    #[test]
    fn fixed_patch_has_no_plate() {
        let shape = FingertipShape { nail: Nail::FixedPatch, ..FingertipShape::default() };
        let Fingertip { mesh, .. } = fingertip(&shape, &MeshPreset::Coarse.divisions()).unwrap();
        assert!(mesh.tets.is_empty() && mesh.ties.is_empty() && mesh.node_set(set::NAIL).is_empty());
        let fixed = mesh.node_set(set::NAIL_FIX);
        assert!(fixed.len() > 10 && fixed.iter().all(|n| mesh.node_set(set::SKIN).binary_search(n).is_ok()));
    }

    /// The silicone fingertip: half a sphere of 8 mm before its core, without a nail.
    #[test]
    fn a_fingertip_of_a_robot_is_round_and_has_no_nail() {
        let shape = FingertipShape::named("dome:8,4").unwrap();
        let Fingertip { mesh, outer_faces, touch, .. } = fingertip(&shape, &MeshPreset::Medium.divisions()).unwrap();
        assert!(mesh.tets.is_empty() && mesh.node_set(set::NAIL_FIX).is_empty());
        let middle = Vector3::new(shape.length_mm - shape.cap_length_mm, 0.0, 0.0);
        let mut of_cap = 0;
        for node in outer_faces.iter().flatten() {
            let place = touch.rotation.transpose() * mesh.nodes[*node as usize] + touch.point_mm;
            if place.x > middle.x {
                assert!(((place - middle).norm() - 8.0).abs() < 0.01, "{place:?}");
                of_cap += 1;
            }
        }
        assert!(of_cap > 1000, "{of_cap}");
    }

    #[test]
    fn other_divisions_and_repetition() {
        let odd = Divisions {
            pad_refinement: 2,
            columns: 11,
            rows: 4,
            bone_layers: 2,
            nail_layers: 3,
            ..MeshPreset::Coarse.divisions()
        };
        let first = fingertip(&FingertipShape::default(), &odd).unwrap();
        assert_eq!(first, fingertip(&FingertipShape::default(), &odd).unwrap());
        let least = MeshPreset::Coarse.divisions().scaled(0.5);
        fingertip(&FingertipShape::default(), &least).unwrap();
        let zero = Divisions { rows: 0, ..odd };
        assert!(matches!(
            fingertip(&FingertipShape::default(), &zero),
            Err(MeshError::Divisions { field: "rows", .. })
        ));
    }
}
