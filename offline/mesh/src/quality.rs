//! Measures of a mesh: element shapes, volumes, sizes.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use super::{Hex, Mesh, Region, Tet, Tet10};
use crate::HEX_CORNERS;

/// Edges of a hexahedron.
pub(super) const HEX_EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];

/// Elements and nodes of one region.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RegionQuality {
    /// Number of hexahedra.
    pub hexes: usize,
    /// Number of tetrahedra, of 4 and of 10 nodes.
    pub tets: usize,
    /// Volume, mm³.
    pub volume_mm3: f64,
    /// Least scaled Jacobian of its elements.
    pub worst_scaled_jacobian: f64,
}

/// Measures of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct QualityReport {
    /// Number of nodes.
    pub nodes: usize,
    /// Number of hexahedra.
    pub hexes: usize,
    /// Number of tetrahedra, of 4 and of 10 nodes.
    pub tets: usize,
    /// Regions that the mesh has.
    pub regions: BTreeMap<Region, RegionQuality>,
    /// Least scaled Jacobian of the hexahedra, over their corners and 2x2x2 Gauss points: det J over the
    /// product of the lengths of its columns; 1 is a box. 1 if there are none.
    pub worst_hex_scaled_jacobian: f64,
    /// Index of that hexahedron.
    pub worst_hex: Option<usize>,
    /// Least scaled Jacobian of the tetrahedra: sqrt(2) 6 V over the greatest product of three edges at a corner; 1 is
    /// regular. For 10-node ones, that of the corners times the least ratio of the volume of one of their twelve parts
    /// to its volume with straight edges. 1 if there are none.
    pub worst_tet_scaled_jacobian: f64,
    /// Shortest edge, mm.
    pub min_edge_mm: f64,
    /// Longest edge, mm.
    pub max_edge_mm: f64,
    /// Number of pad faces, quadrilaterals and triangles.
    pub pad_faces: usize,
    /// Number of pad nodes.
    pub pad_nodes: usize,
    /// Area of the pad faces, mm².
    pub pad_area_mm2: f64,
    /// Root of the area of the smallest and of the largest pad face, mm.
    pub pad_face_size_mm: [f64; 2],
    /// The same of the pad faces within 3 mm of first touch (the origin); zeros if there are none.
    pub touch_face_size_mm: [f64; 2],
    /// Hexahedra and tetrahedra with a scaled Jacobian <= 0.
    pub inverted_hexes: Vec<usize>,
    /// Tetrahedra without positive volume; 10-node ones count on after those of 4 nodes.
    pub inverted_tets: Vec<usize>,
}

/// Measures a mesh.
pub fn quality(mesh: &Mesh) -> QualityReport {
    let mut report = QualityReport {
        nodes: mesh.nodes.len(),
        hexes: mesh.hexes.len(),
        tets: mesh.tets.len() + mesh.tets10.len(),
        regions: BTreeMap::new(),
        worst_hex_scaled_jacobian: 1.0,
        worst_hex: None,
        worst_tet_scaled_jacobian: 1.0,
        min_edge_mm: f64::INFINITY,
        max_edge_mm: 0.0,
        pad_faces: mesh.pad_faces.len() + mesh.pad_triangles.len(),
        pad_nodes: mesh.pad_nodes().len(),
        pad_area_mm2: 0.0,
        pad_face_size_mm: [f64::INFINITY, 0.0],
        touch_face_size_mm: [f64::INFINITY, 0.0],
        inverted_hexes: vec![],
        inverted_tets: vec![],
    };
    for (index, hex) in mesh.hexes.iter().enumerate() {
        let scaled = hex_scaled_jacobian(mesh, hex);
        if !(scaled > 0.0) {
            report.inverted_hexes.push(index);
        }
        if !(scaled >= report.worst_hex_scaled_jacobian) {
            report.worst_hex_scaled_jacobian = scaled;
            report.worst_hex = Some(index);
        }
        let region = region_entry(&mut report.regions, hex.region, scaled);
        region.hexes += 1;
        region.volume_mm3 += hex_volume_mm3(mesh, hex);
        report.edges(mesh, HEX_EDGES.iter().map(|e| e.map(|n| hex.nodes[n])));
    }
    let first_order = mesh.tets.iter().map(|tet| {
        let volume = tet_volume_mm3(&tet.nodes.map(|n| mesh.nodes[n as usize]));
        (tet.region, tet_scaled_jacobian(mesh, tet), volume, [0, 1, 2, 3].map(|n| tet.nodes[n]))
    });
    let second_order = mesh.tets10.iter().map(|tet| {
        let volume = tet.parts(&mesh.nodes).iter().map(tet_volume_mm3).sum();
        (tet.region, tet10_scaled_jacobian(mesh, tet), volume, [0, 1, 2, 3].map(|n| tet.nodes[n]))
    });
    for (index, (region, scaled, volume, n)) in first_order.chain(second_order).enumerate() {
        if !(scaled > 0.0) {
            report.inverted_tets.push(index);
        }
        report.worst_tet_scaled_jacobian = report.worst_tet_scaled_jacobian.min(scaled);
        let region = region_entry(&mut report.regions, region, scaled);
        region.tets += 1;
        region.volume_mm3 += volume;
        report.edges(mesh, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]].into_iter().map(|e| e.map(|i| n[i])));
    }
    // A triangle is a quadrilateral whose last two corners are one.
    let triangles = mesh.pad_triangles.iter().map(|&[a, b, c]| [a, b, c, c]);
    for face in mesh.pad_faces.iter().copied().chain(triangles) {
        let p = face.map(|n| mesh.nodes[n as usize]);
        let area = 0.5 * (p[2] - p[0]).cross(&(p[3] - p[1])).norm();
        report.pad_area_mm2 += area;
        let widen = |[low, high]: [f64; 2]| [low.min(area.sqrt()), high.max(area.sqrt())];
        report.pad_face_size_mm = widen(report.pad_face_size_mm);
        if (p[0] + p[1] + p[2] + p[3]).norm() < 4.0 * 3.0 {
            report.touch_face_size_mm = widen(report.touch_face_size_mm);
        }
    }
    for range in [&mut report.pad_face_size_mm, &mut report.touch_face_size_mm] {
        if range[1] == 0.0 {
            *range = [0.0; 2];
        }
    }
    report
}

impl QualityReport {
    /// Volume of all regions, mm³.
    pub fn volume_mm3(&self) -> f64 {
        self.regions.values().map(|r| r.volume_mm3).sum()
    }

    fn edges(&mut self, mesh: &Mesh, edges: impl Iterator<Item = [u32; 2]>) {
        for [a, b] in edges {
            let length = (mesh.nodes[a as usize] - mesh.nodes[b as usize]).norm();
            self.min_edge_mm = self.min_edge_mm.min(length);
            self.max_edge_mm = self.max_edge_mm.max(length);
        }
    }
}

fn region_entry(regions: &mut BTreeMap<Region, RegionQuality>, region: Region, scaled: f64) -> &mut RegionQuality {
    let fresh = RegionQuality { worst_scaled_jacobian: 1.0, ..RegionQuality::default() };
    let entry = regions.entry(region).or_insert(fresh);
    entry.worst_scaled_jacobian = entry.worst_scaled_jacobian.min(scaled);
    entry
}

/// Jacobian of the trilinear map at a reference point.
fn jacobian(corners: &[Vector3<f64>; 8], at: [f64; 3]) -> Matrix3<f64> {
    let mut columns = [Vector3::zeros(); 3];
    for (position, corner) in corners.iter().zip(HEX_CORNERS) {
        let factor = |c: usize| 0.5 * (1.0 + at[c] * corner[c]);
        for c in 0..3 {
            let weight = 0.5 * corner[c] * factor((c + 1) % 3) * factor((c + 2) % 3);
            columns[c] += position * weight;
        }
    }
    Matrix3::from_columns(&columns)
}

fn corners(mesh: &Mesh, hex: &Hex) -> [Vector3<f64>; 8] {
    hex.nodes.map(|n| mesh.nodes[n as usize])
}

fn gauss_points() -> impl Iterator<Item = [f64; 3]> {
    HEX_CORNERS.into_iter().map(|corner| corner.map(|c| c / 3f64.sqrt()))
}

/// Least det J over the product of the lengths of its columns, over corners and 2x2x2 Gauss points; 0 where
/// an edge has no length.
pub(super) fn hex_scaled_jacobian(mesh: &Mesh, hex: &Hex) -> f64 {
    let corners = corners(mesh, hex);
    HEX_CORNERS.into_iter().chain(gauss_points()).fold(1.0, |worst, at| {
        let j = jacobian(&corners, at);
        let lengths: f64 = j.column_iter().map(|c| c.norm()).product();
        let scaled = if lengths > 0.0 { j.determinant() / lengths } else { 0.0 };
        if scaled >= worst { worst } else { scaled }
    })
}

/// Volume of a hexahedron, mm³ (2x2x2 Gauss points are exact).
fn hex_volume_mm3(mesh: &Mesh, hex: &Hex) -> f64 {
    let corners = corners(mesh, hex);
    gauss_points().map(|at| jacobian(&corners, at).determinant()).sum()
}

fn tet_volume_mm3(&[a, b, c, d]: &[Vector3<f64>; 4]) -> f64 {
    (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0
}

/// sqrt(2) 6 V over the greatest product of the three edges at a corner; 0 where that is 0.
pub(super) fn tet_scaled_jacobian(mesh: &Mesh, tet: &Tet) -> f64 {
    tet_shape(&tet.nodes.map(|n| mesh.nodes[n as usize]))
}

/// That of the corners times the least ratio of a part's volume to the same with the edge nodes in the middles.
pub(super) fn tet10_scaled_jacobian(mesh: &Mesh, tet: &Tet10) -> f64 {
    let corners = [0, 1, 2, 3].map(|n| mesh.nodes[tet.nodes[n] as usize]);
    let whole = tet_volume_mm3(&corners);
    let shares = tet.parts(&mesh.nodes).map(|part| tet_volume_mm3(&part) / whole);
    let least = (0..12).map(|n| shares[n] * if n < 4 { 8.0 } else { 16.0 }).fold(1.0, f64::min);
    // Two negative volumes are no positive one.
    if whole > 0.0 { tet_shape(&corners) * least } else { -tet_shape(&corners).abs() * least.abs() }
}

fn tet_shape(p: &[Vector3<f64>; 4]) -> f64 {
    let product = |i: usize| -> f64 { (0..4).filter(|&j| j != i).map(|j| (p[j] - p[i]).norm()).product() };
    let greatest = (0..4).map(product).fold(0.0, f64::max);
    if greatest > 0.0 { 2f64.sqrt() * 6.0 * tet_volume_mm3(p) / greatest } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::{block, into_tets};

    #[test]
    fn box_and_sheared_box() {
        let mut mesh = block(&[0.0, 2.0], &[0.0, 1.0], &[0.0, 3.0]);
        let report = quality(&mesh);
        assert!((report.volume_mm3() - 6.0).abs() < 1e-12 && (report.worst_hex_scaled_jacobian - 1.0).abs() < 1e-12);
        assert_eq!((report.min_edge_mm, report.max_edge_mm), (1.0, 3.0));
        mesh.nodes.iter_mut().for_each(|p| p.x += p.z);
        let report = quality(&mesh);
        assert!((report.volume_mm3() - 6.0).abs() < 1e-12);
        assert!((report.worst_hex_scaled_jacobian - 0.5f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn inverted_elements_are_listed() {
        let mut mesh = block(&[0.0, 1.0, 2.0], &[0.0, 1.0], &[0.0, 1.0]);
        mesh.hexes[1].nodes.swap(0, 6);
        assert_eq!(quality(&mesh).inverted_hexes, [1]);
        let mut tets = into_tets(&block(&[0.0, 1.0], &[0.0, 1.0], &[0.0, 1.0]));
        tets.tets[4].nodes.swap(1, 2);
        assert_eq!(quality(&tets).inverted_tets, [4]);
    }

    #[test]
    fn regular_tetrahedron() {
        let corners = [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]];
        let mesh = Mesh {
            nodes: corners.map(|c: [f64; 3]| c.into()).to_vec(),
            tets: vec![Tet { nodes: [0, 1, 2, 3], region: Region::Nail }],
            ..Mesh::default()
        };
        let report = quality(&mesh);
        assert!((report.worst_tet_scaled_jacobian - 1.0).abs() < 1e-12);
        assert!((report.volume_mm3() - 8.0 / 3.0).abs() < 1e-12);
    }
}
