//! A mesh of another program becomes a fingertip.
//!
//! Main types: [`RawMesh`] (contents of a file), [`ImportedGeometry`] (roles of the sets); [`imported_fingertip`] makes
//! an [`ImportedFingertip`] and reports its repairs in its [`ImportReport`]. Every number in a message is the file's
//! own. May use: the rest of mesh.

mod bodies;
mod edge_order;
mod error;
mod join;
mod sets;
mod settings;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_second_order;

use std::collections::{BTreeMap, HashMap};

use nalgebra::{Matrix3, Vector3};

pub use error::ImportError;
pub use fingerpad_formats::raw_mesh::{RawElement, RawKind, RawMesh, RawTie};
use fingerpad_formats::significant;
pub use settings::{ImportFrame, ImportedGeometry, RegionNames, SetNames};

use super::quality::{hex_scaled_jacobian, tet_scaled_jacobian, tet10_scaled_jacobian};
use super::{FACE_TRIANGLES, Fingertip, FirstTouch, Hex, Mesh, Tet, Tet10, first_touch_of_points, set};

/// A fingertip from another program's mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedFingertip {
    /// Mesh, first touch, outer faces.
    pub fingertip: Fingertip,
    /// The repairs.
    pub report: ImportReport,
}

/// Repairs and omissions of the import.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct ImportReport {
    /// Nodes of no element, dropped.
    pub unused_nodes: usize,
    /// Nodes that lay on another and became one with it.
    pub merged_nodes: usize,
    /// Elements that were numbered inside out and were turned.
    pub turned_elements: usize,
    /// Nodes of tetrahedra tied to hexahedra here (not by the file).
    pub tied_nodes: usize,
    /// Greatest displacement of a tied node by the import, mm.
    pub tie_moved_mm: f64,
    /// Nodes of soft tissue attached to a rigid bone that was meshed apart.
    pub attached_nodes: usize,
    /// Keywords and sections of the file that were skipped.
    pub ignored: Vec<String>,
    /// Numbers of the file that were changed, as sentences: messages name the changed ones.
    pub renumbered: Vec<String>,
}

/// The mesh under construction, with the file's numbers of everything.
struct Draft {
    mesh: Mesh,
    /// Number of each node.
    node_labels: Vec<u64>,
    /// Index of each number; merged nodes share one.
    index: HashMap<u64, u32>,
    /// Numbers of the hexahedra, then of the tetrahedra of 4 and of 10 nodes.
    element_labels: Vec<u64>,
    report: ImportReport,
}

impl Draft {
    fn label(&self, node: u32) -> u64 {
        self.node_labels[node as usize]
    }
}

/// Makes and checks the mesh of a fingertip out of a file's content.
///
/// `soft_regions` are the soft regions that have a law of their own; they consist of the file's element sets or
/// physical volumes of these names.
///
/// # Errors
/// [`ImportError`] with the file's numbers and names.
pub fn imported_fingertip(
    raw: &RawMesh,
    settings: &ImportedGeometry,
    soft_regions: &[String],
) -> Result<ImportedFingertip, ImportError> {
    settings.validate()?;
    let mut draft = join::elements(raw, settings, soft_regions)?;
    size(&draft.mesh, settings)?;
    orient(&mut draft, raw)?;
    join::ties(&mut draft, raw, settings)?;
    sets::named_sets(&mut draft, raw, settings)?;
    bodies::attach_bones(&mut draft, settings);
    let outer = bodies::check(&draft)?;
    sets::supports(&draft)?;
    let found = place(&mut draft, &outer, settings)?;
    let pad = sets::pad(&draft, raw, settings, &outer)?;
    draft.mesh.pad_triangles = pad.linear_triangles();
    draft.mesh.pad_faces = pad.quads;
    let touch = match found {
        Some(touch) => touch,
        None => touch_at_origin(&draft.mesh, settings)?,
    };
    draft.mesh.node_sets.insert(set::PAD.into(), draft.mesh.pad_nodes());
    let Faces { quads: outer_faces, triangles: outer_triangles } = outer;
    let fingertip = Fingertip { mesh: draft.mesh, touch, skin: None, outer_faces, outer_triangles };
    Ok(ImportedFingertip { fingertip, report: draft.report })
}

/// Faces of hexahedra and of 10-node tetrahedra, counter-clockwise seen from outside.
#[derive(Default)]
struct Faces {
    quads: Vec<[u32; 4]>,
    /// Corners, then edge nodes as of `TET10_FACES`.
    triangles: Vec<[u32; 6]>,
}

impl Faces {
    fn nodes(&self) -> Vec<u32> {
        sorted(self.quads.iter().flatten().chain(self.triangles.iter().flatten()).copied().collect())
    }

    /// The four linear triangles of each triangle.
    fn linear_triangles(&self) -> Vec<[u32; 3]> {
        self.triangles.iter().flat_map(|face| FACE_TRIANGLES.map(|t| t.map(|n| face[n]))).collect()
    }
}

impl ImportedGeometry {
    fn validate(&self) -> Result<(), ImportError> {
        let positive = [("unit_mm", self.unit_mm), ("pad_height_mm", self.pad_height_mm)];
        let not_negative = [("merge_mm", self.merge_mm), ("tie_mm", self.tie_mm)];
        let refuse = |field, value: f64, rule| Err(ImportError::Setting { field, value: value.to_string(), rule });
        for (field, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return refuse(field, value, "must be a positive number");
            }
        }
        for (field, value) in not_negative {
            if !(value >= 0.0 && value.is_finite()) {
                return refuse(field, value, "must be a number from 0");
            }
        }
        if !(0.0..=85.0).contains(&self.inclination_deg) {
            return refuse("inclination_deg", self.inclination_deg, "must be in 0..=85");
        }
        Ok(())
    }
}

/// Longest side of the box around a fingertip, mm; a mesh outside of it is in another unit.
const PLAUSIBLE_MM: [f64; 2] = [0.3, 3000.0];
/// Units of files and the range of lengths that a fingertip has in them.
const UNITS: [(&str, f64); 4] = [("metres", 1000.0), ("micrometres", 1e-3), ("nanometres", 1e-6), ("kilometres", 1e6)];
/// Longest side of a fingertip from which a unit is guessed, mm.
const USUAL_MM: [f64; 2] = [2.0, 300.0];

/// Refuses a mesh of a size that only another unit explains.
fn size(mesh: &Mesh, settings: &ImportedGeometry) -> Result<(), ImportError> {
    let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for place in &mesh.nodes {
        (low, high) = (low.inf(place), high.sup(place));
    }
    let sides = high - low;
    let longest = sides.max();
    if !(longest > 0.0) || (PLAUSIBLE_MM[0]..=PLAUSIBLE_MM[1]).contains(&longest) {
        return Ok(());
    }
    let explains = |factor: &f64| (USUAL_MM[0]..=USUAL_MM[1]).contains(&(longest * factor));
    let Some((name, factor)) = UNITS.into_iter().find(|(_, factor)| explains(factor)) else { return Ok(()) };
    let size = sides.map(|side| significant(side, 3));
    Err(ImportError::Unit {
        size: format!("{} x {} x {}", size[0], size[1], size[2]),
        unit_mm: settings.unit_mm,
        name,
        proposed: settings.unit_mm * factor,
    })
}

/// Turns elements that are inside out as a whole; refuses twisted ones.
fn orient(draft: &mut Draft, raw: &RawMesh) -> Result<(), ImportError> {
    let mut turned = 0;
    for e in 0..draft.mesh.hexes.len() {
        let hex = draft.mesh.hexes[e];
        let scaled = hex_scaled_jacobian(&draft.mesh, &hex);
        if scaled > 1e-9 {
            continue;
        }
        let [a, b, c, d, f, g, h, i] = hex.nodes;
        let mirror = Hex { nodes: [f, g, h, i, a, b, c, d], ..hex };
        let better = hex_scaled_jacobian(&draft.mesh, &mirror);
        if !(better > 1e-9) {
            let element = draft.element_labels[e];
            return Err(ImportError::Twisted { element, scaled_jacobian: scaled.max(better) });
        }
        draft.mesh.hexes[e] = mirror;
        turned += 1;
    }
    for e in 0..draft.mesh.tets.len() {
        let tet = draft.mesh.tets[e];
        let scaled = tet_scaled_jacobian(&draft.mesh, &tet);
        if scaled > 1e-9 {
            continue;
        }
        let [a, b, c, d] = tet.nodes;
        let mirror = Tet { nodes: [a, c, b, d], ..tet };
        if !(-scaled > 1e-9) {
            let element = draft.element_labels[draft.mesh.hexes.len() + e];
            return Err(ImportError::Twisted { element, scaled_jacobian: -scaled });
        }
        draft.mesh.tets[e] = mirror;
        turned += 1;
    }
    let first = draft.mesh.hexes.len() + draft.mesh.tets.len();
    for e in 0..draft.mesh.tets10.len() {
        let tet = draft.mesh.tets10[e];
        let scaled = tet10_scaled_jacobian(&draft.mesh, &tet);
        if scaled > 1e-9 {
            continue;
        }
        let n = tet.nodes;
        let mirror = Tet10 { nodes: [n[0], n[2], n[1], n[3], n[6], n[5], n[4], n[7], n[9], n[8]], ..tet };
        let better = tet10_scaled_jacobian(&draft.mesh, &mirror);
        if !(better > 1e-9) {
            let (element, scaled_jacobian) = (draft.element_labels[first + e], scaled.max(better));
            return Err(edge_order::refused(draft, e, raw.gmsh_edges)
                .unwrap_or(ImportError::Twisted { element, scaled_jacobian }));
        }
        draft.mesh.tets10[e] = mirror;
        turned += 1;
    }
    draft.report.turned_elements = turned;
    Ok(())
}

/// Turns the mesh from the frame of the finger to that of the plane, first touch at the origin; None if it is there.
fn place(draft: &mut Draft, outer: &Faces, settings: &ImportedGeometry) -> Result<Option<FirstTouch>, ImportError> {
    if settings.frame == ImportFrame::Plane {
        return Ok(None);
    }
    let points: Vec<Vector3<f64>> = outer.nodes().iter().map(|n| draft.mesh.nodes[*n as usize]).collect();
    let touch = lowest(&points, settings.inclination_deg)?;
    for node in &mut draft.mesh.nodes {
        *node = touch.to_plane(node);
    }
    Ok(Some(touch))
}

/// First touch of points of the finger's frame.
fn lowest(points: &[Vector3<f64>], inclination_deg: f64) -> Result<FirstTouch, ImportError> {
    // As far as enough points for a paraboloid lie.
    [2.0, 2.5, 3.0, 3.5, 4.0, 4.5]
        .into_iter()
        .find_map(|reach| first_touch_of_points::lowest(points, inclination_deg, reach))
        .ok_or_else(|| {
            ImportError::Touch(
                "the outer faces have no rounded lowest point: check frame, axes and inclination_deg".into(),
            )
        })
}

/// First touch in the frame of the plane, which must be at z = 0.
fn touch_at_origin(mesh: &Mesh, settings: &ImportedGeometry) -> Result<FirstTouch, ImportError> {
    let points: Vec<Vector3<f64>> = mesh.pad_nodes().iter().map(|n| mesh.nodes[*n as usize]).collect();
    let low = points.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    // Room for the sag of a facet under its nodes.
    let edges = mesh.pad_faces.iter().map(|f| [f[0], f[1]]).chain(mesh.pad_triangles.iter().map(|t| [t[0], t[1]]));
    let edge = edges.map(|e| e.map(|n| mesh.nodes[n as usize])).map(|[a, b]| (a - b).norm()).fold(0.0, f64::max);
    if !(-1e-6..0.05 + 0.1 * edge).contains(&low) {
        return Err(ImportError::NotAtTouch { lowest_mm: low });
    }
    let (sin, cos) = settings.inclination_deg.to_radians().sin_cos();
    let rotation = Matrix3::new(cos, 0.0, sin, 0.0, 1.0, 0.0, -sin, 0.0, cos);
    let finger: Vec<Vector3<f64>> = points.iter().map(|p| rotation.transpose() * p).collect();
    // A flat pad has no radius of curvature.
    let curvature_radius_mm =
        lowest(&finger, settings.inclination_deg).map_or(f64::INFINITY, |t| t.curvature_radius_mm);
    Ok(FirstTouch { point_mm: Vector3::zeros(), rotation, curvature_radius_mm })
}

fn sorted(mut nodes: Vec<u32>) -> Vec<u32> {
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// Places by a coarse grid, to find near ones.
struct Near {
    cell_mm: f64,
    cells: BTreeMap<[i64; 3], Vec<u32>>,
}

impl Near {
    fn new(cell_mm: f64) -> Self {
        Self { cell_mm, cells: BTreeMap::new() }
    }

    fn cell(&self, p: &Vector3<f64>) -> [i64; 3] {
        [p.x, p.y, p.z].map(|c| (c / self.cell_mm).floor() as i64)
    }

    fn insert(&mut self, p: &Vector3<f64>, what: u32) {
        self.cells.entry(self.cell(p)).or_default().push(what);
    }

    /// All within a cell's size, and some beyond.
    fn around(&self, p: &Vector3<f64>) -> impl Iterator<Item = u32> + '_ {
        let [x, y, z] = self.cell(p);
        let span = |c: i64| c - 1..=c + 1;
        span(x)
            .flat_map(move |x| span(y).flat_map(move |y| span(z).map(move |z| [x, y, z])))
            .filter_map(|cell| self.cells.get(&cell))
            .flatten()
            .copied()
    }
}

/// The entry of a name, by exact spelling or else without regard to case.
fn named<'a, T>(map: &'a BTreeMap<String, T>, name: &str) -> Option<&'a T> {
    map.get(name).or_else(|| map.iter().find(|(key, _)| key.eq_ignore_ascii_case(name)).map(|(_, value)| value))
}
