//! The capped box with the elements of the pad halved: the refined elements, the added nodes, and the hanging nodes
//! among them.
//!
//! A face between elements of two sizes has nodes that the larger element does not have. They hang: each follows the
//! middle of the edge or face of the larger element that it lies on, so that displacements are continuous. Elements
//! that meet in a node differ by one halving at most; so no node hangs on one that hangs itself.

use std::collections::BTreeMap;

use super::grid::{CappedBox, Point, SurfaceCell};
use super::quality::HEX_EDGES;
use super::{Divisions, HEX_FACES, Hex, Tie};

/// Corner of a hexahedron in the unit cube.
const CORNERS: [[usize; 3]; 8] =
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];

/// A place in the finest grid: point of its surface, and level.
type Place = (Point, usize);

/// Elements and hanging nodes of a capped box that is refined near the pad.
pub(super) struct Refinement {
    /// All hexahedra, those of a halved element in its place.
    pub(super) hexes: Vec<Hex>,
    /// Faces of the skin's outside, counter-clockwise seen from outside.
    pub(super) outer_faces: Vec<[u32; 4]>,
    /// Places in the finest grid of the nodes that follow those of the unrefined grid.
    pub(super) added: Vec<Place>,
    /// Hanging nodes.
    pub(super) ties: Vec<Tie>,
}

impl Refinement {
    /// Refines the elements under the outer faces (in the order of [`CappedBox::outer_faces`]) that are `wanted`.
    pub(super) fn new(grid: &CappedBox, divisions: &Divisions, wanted: &[bool]) -> Self {
        let cells = grid.surface_cells();
        let halvings = halvings(&cells, grid, divisions, wanted);
        let mut nodes = Nodes { grid, factor: divisions.refinement_factor(), added: BTreeMap::new() };
        let mut hexes = grid.core_hexes();
        let mut outer_faces = Vec::new();
        let mut larger = Vec::new();
        for level in 0..grid.outer_level() {
            for (cell, halved) in cells.iter().zip(&halvings) {
                let element = Element { corners: cell.corners, level, factor: nodes.factor };
                let region = grid.region(level, cell.ring);
                for part in element.parts(halved[level]) {
                    let corners = part.corners();
                    let hex = Hex { nodes: corners.map(|c| nodes.node(element.place(c))), region };
                    hexes.push(hex);
                    if level + 1 == grid.outer_level() && corners[4][2] == nodes.factor {
                        outer_faces.push([4, 5, 6, 7].map(|c| hex.nodes[c]));
                    }
                    if part.size > 1 {
                        larger.push((element, part, hex.nodes));
                    }
                }
            }
        }
        let ties = hanging(&nodes, &larger);
        let mut added: Vec<(u32, Place)> = nodes.added.into_iter().map(|(place, node)| (node, place)).collect();
        added.sort_unstable();
        Self { hexes, outer_faces, added: added.into_iter().map(|(_, place)| place).collect(), ties }
    }
}

/// Number of halvings of the element of each surface cell and level.
fn halvings(cells: &[SurfaceCell], grid: &CappedBox, divisions: &Divisions, wanted: &[bool]) -> Vec<Vec<usize>> {
    let levels = grid.outer_level();
    let mut halvings = vec![vec![0; levels]; cells.len()];
    for (of_cell, _) in halvings.iter_mut().zip(wanted).filter(|(_, wanted)| **wanted) {
        of_cell[levels - divisions.refined_layers.min(levels)..].fill(divisions.pad_refinement);
    }
    let mut around: BTreeMap<Point, Vec<usize>> = BTreeMap::new();
    for (c, cell) in cells.iter().enumerate() {
        cell.corners.iter().for_each(|point| around.entry(*point).or_default().push(c));
    }
    for halved in (2..=divisions.pad_refinement).rev() {
        let inside = halvings.clone();
        for (c, cell) in cells.iter().enumerate() {
            for level in (0..levels).filter(|&level| inside[c][level] == halved) {
                for &neighbour in cell.corners.iter().flat_map(|point| &around[point]) {
                    for beside in &mut halvings[neighbour][level.saturating_sub(1)..(level + 2).min(levels)] {
                        *beside = (*beside).max(halved - 1);
                    }
                }
            }
        }
    }
    halvings
}

/// Nodes by place: those of the unrefined grid, then the others as they are met.
struct Nodes<'a> {
    grid: &'a CappedBox,
    /// Cells of the finest grid on an edge of an unrefined one.
    factor: usize,
    added: BTreeMap<Place, u32>,
}

impl Nodes<'_> {
    fn node(&mut self, (point, level): Place) -> u32 {
        let whole = |n: &usize| n.is_multiple_of(self.factor);
        if point.iter().all(whole) && whole(&level) {
            return self.grid.node(point.map(|n| n / self.factor), level / self.factor);
        }
        let next = (self.grid.node_count() + self.added.len()) as u32;
        *self.added.entry((point, level)).or_insert(next)
    }
}

/// An element of the unrefined grid outside the box; its inside has coordinates 0 to `factor`.
#[derive(Clone, Copy)]
struct Element {
    /// Corners of its surface cell.
    corners: [Point; 4],
    level: usize,
    factor: usize,
}

impl Element {
    /// Place in the finest grid of a point of its inside: along the cell's first and last edge, and outward.
    fn place(&self, [along, across, out]: [usize; 3]) -> Place {
        let [from, next, _, last] = self.corners;
        let point = std::array::from_fn(|k| {
            // Neighbouring corners differ by one in one index.
            let step = |to: usize, by: usize| to * by + from[k] * (self.factor - by);
            step(next[k], along) + step(last[k], across) - from[k] * self.factor
        });
        (point, self.level * self.factor + out)
    }

    /// Its parts when it is halved that often.
    fn parts(&self, halved: usize) -> impl Iterator<Item = Part> + use<> {
        let (count, size) = (1 << halved, self.factor >> halved);
        let at = move |n: usize| [n / (count * count), n / count % count, n % count].map(|i| i * size);
        (0..count * count * count).map(move |n| Part { from: at(n), size })
    }
}

/// A part of an element: a cube of its inside.
#[derive(Clone, Copy)]
struct Part {
    from: [usize; 3],
    size: usize,
}

impl Part {
    /// Corners in VTK_HEXAHEDRON order.
    fn corners(&self) -> [[usize; 3]; 8] {
        CORNERS.map(|corner| std::array::from_fn(|k| self.from[k] + corner[k] * self.size))
    }
}

/// Ties of the nodes in the middle of edges and faces of larger elements, in the order of the nodes.
fn hanging(nodes: &Nodes, larger: &[(Element, Part, [u32; 8])]) -> Vec<Tie> {
    let mut ties = BTreeMap::new();
    for (element, part, hex) in larger {
        let corners = part.corners();
        let mut tie = |ends: &[usize]| {
            let middle = std::array::from_fn(|k| ends.iter().map(|&c| corners[c][k]).sum::<usize>() / ends.len());
            if let Some(&slave) = nodes.added.get(&element.place(middle)) {
                let mut masters: Vec<u32> = ends.iter().map(|&c| hex[c]).collect();
                masters.sort_unstable();
                ties.insert(slave, masters);
            }
        };
        HEX_EDGES.iter().for_each(|edge| tie(edge));
        HEX_FACES.iter().for_each(|face| tie(face));
    }
    let tie = |(slave, masters): (u32, Vec<u32>)| {
        let weight = 1.0 / masters.len() as f64;
        Tie { slave, masters: masters.into_iter().map(|master| (master, weight)).collect() }
    };
    ties.into_iter().map(tie).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::surface::Body;
    use crate::{Fingertip, FingertipShape, Mesh, MeshError, MeshPreset, Region, check, fingertip, quality, set};

    /// The finger on the coarse mesh, its pad halved this often.
    fn coarse(pad_refinement: usize) -> (FingertipShape, Fingertip) {
        let shape = FingertipShape::default();
        let divisions = Divisions { pad_refinement, ..MeshPreset::Coarse.divisions() };
        let tip = fingertip(&shape, &divisions).unwrap();
        (shape, tip)
    }

    fn hanging(mesh: &Mesh) -> Vec<&Tie> {
        mesh.ties.iter().filter(|tie| mesh.node_set(set::NAIL).binary_search(&tie.slave).is_err()).collect()
    }

    /// Root of a face's area, mm.
    fn size(mesh: &Mesh, face: &[u32; 4]) -> f64 {
        let p = face.map(|n| mesh.nodes[n as usize]);
        (0.5 * (p[2] - p[0]).cross(&(p[3] - p[1])).norm()).sqrt()
    }

    #[test]
    fn nodes_of_the_unrefined_mesh_stay() {
        let (_, plain) = coarse(0);
        for halved in [1, 2] {
            let (_, refined) = coarse(halved);
            let grid = CappedBox::new(&MeshPreset::Coarse.divisions()).node_count();
            assert_eq!(plain.mesh.nodes[..grid], refined.mesh.nodes[..grid]);
            let nails = |tip: &Fingertip| -> Vec<Vector3<f64>> {
                tip.mesh.node_set(set::NAIL).iter().map(|&n| tip.mesh.nodes[n as usize]).collect()
            };
            assert_eq!(nails(&plain), nails(&refined));
            assert!(refined.mesh.nodes.len() > plain.mesh.nodes.len() + 300 * halved);
        }
        assert!(hanging(&plain.mesh).is_empty());
    }

    #[test]
    fn free_nodes_of_the_skin_lie_on_the_analytic_surface() {
        for halved in [1, 2] {
            let (shape, Fingertip { mesh, touch, outer_faces, .. }) = coarse(halved);
            let body = Body::outer(&shape);
            let slaves: Vec<u32> = hanging(&mesh).iter().map(|tie| tie.slave).collect();
            let off = |n: u32| {
                let finger = touch.rotation.transpose() * mesh.nodes[n as usize] + touch.point_mm;
                body.distance(&finger)
            };
            let (hang, free): (Vec<u32>, Vec<u32>) =
                outer_faces.iter().flatten().partition(|n| slaves.binary_search(n).is_ok());
            assert!(free.iter().all(|&n| off(n).abs() < 1e-9));
            // In the middle of a facet's edge, under the surface by its sagitta.
            assert!(!hang.is_empty() && hang.iter().all(|&n| off(n) < 1e-9 && off(n) > -0.3));
        }
    }

    #[test]
    fn hanging_nodes_follow_free_ones_and_carry_no_contact() {
        for halved in [1, 2] {
            let (_, Fingertip { mesh, .. }) = coarse(halved);
            let ties = hanging(&mesh);
            let slaves: Vec<u32> = ties.iter().map(|tie| tie.slave).collect();
            assert!(slaves.len() > 50 && slaves.is_sorted());
            for tie in &ties {
                assert!(tie.masters.iter().all(|(n, _)| slaves.binary_search(n).is_err()), "node {}", tie.slave);
                let middle: Vector3<f64> = tie.masters.iter().map(|&(n, w)| mesh.nodes[n as usize] * w).sum();
                assert!((middle - mesh.nodes[tie.slave as usize]).norm() < 1e-12);
                let bones = [set::DISTAL_BONE, set::PROXIMAL_BONE].map(|name| mesh.node_set(name));
                assert!(tie.masters.iter().all(|(n, _)| bones.iter().all(|bone| bone.binary_search(n).is_err())));
            }
            let on_pad = mesh.pad_faces.iter().flatten().filter(|n| slaves.binary_search(n).is_ok()).count();
            assert!(on_pad > 0);
            assert!(mesh.node_set(set::PAD).iter().all(|n| slaves.binary_search(n).is_err()));
        }
    }

    #[test]
    fn the_zone_has_the_requested_height_and_depth() {
        let (_, plain) = coarse(0);
        for halved in [1, 2] {
            let (_, Fingertip { mesh, .. }) = coarse(halved);
            let divisions = MeshPreset::Coarse.divisions();
            let middle = |face: &[u32; 4]| face.iter().map(|&n| mesh.nodes[n as usize].z).sum::<f64>() / 4.0;
            let sizes = |within: &dyn Fn(f64) -> bool| -> Vec<f64> {
                mesh.pad_faces.iter().filter(|f| within(middle(f))).map(|f| size(&mesh, f)).collect()
            };
            let largest = sizes(&|z| z < 0.5 * divisions.refined_height_mm).into_iter().fold(0.0, f64::max);
            let before = plain.mesh.pad_faces.iter().map(|f| size(&plain.mesh, f)).fold(0.0, f64::max);
            let factor = f64::powi(2.0, halved as i32);
            assert!(largest * factor < before, "{largest} {before}");
            // Layers through the skin under first touch: it was one.
            let skin: Vec<f64> = {
                let near = |n: &&u32| mesh.nodes[**n as usize].xy().norm() < 0.6 && mesh.nodes[**n as usize].z < 1.0;
                mesh.node_set(set::SKIN).iter().filter(near).map(|&n| mesh.nodes[n as usize].z).collect()
            };
            let thickness = skin.iter().copied().fold(0.0, f64::max);
            let mut layers: Vec<i64> = skin.iter().map(|z| (z / thickness * factor).round() as i64).collect();
            layers.sort_unstable();
            layers.dedup();
            assert_eq!(layers, (0..=factor as i64).collect::<Vec<_>>());
        }
    }

    #[test]
    fn volumes_and_shapes_of_elements() {
        for name in FingertipShape::NAMES {
            let shape = FingertipShape::named(name).unwrap();
            let volumes: Vec<f64> = (0..=2)
                .map(|pad_refinement| {
                    let divisions = Divisions { pad_refinement, ..MeshPreset::Medium.divisions() };
                    let report = quality(&fingertip(&shape, &divisions).unwrap().mesh);
                    println!("{name} halved {pad_refinement} times: {report:#?}");
                    assert!(report.worst_hex_scaled_jacobian > 0.35, "{name} halved {pad_refinement} times");
                    report.volume_mm3() - report.regions[&Region::Nail].volume_mm3
                })
                .collect();
            // The refined facets of the pad are nearer to the convex surface.
            let missing = volumes.iter().map(|v| shape.volume_mm3() - v).collect::<Vec<_>>();
            assert!(missing.is_sorted_by(|a, b| a > b) && missing[2] > 0.0, "{name}: {missing:?}");
        }
    }

    #[test]
    fn a_border_without_its_ties_is_refused() {
        let (_, Fingertip { mesh, .. }) = coarse(1);
        for lost in [2, 4] {
            let mut mesh = mesh.clone();
            let place = mesh.ties.iter().rposition(|tie| tie.masters.len() == lost).unwrap();
            mesh.ties.remove(place);
            let error = check(&mesh).unwrap_err();
            assert!(matches!(error, MeshError::OpenBoundary { .. } | MeshError::Hole { .. }), "{error}");
        }
        let mut mesh = mesh;
        let [a, b] = [mesh.ties.len() - 2, mesh.ties.len() - 1];
        mesh.ties[a].masters[0].0 = mesh.ties[b].slave;
        assert!(check(&mesh).is_err());
    }
}
