//! The template's surface grid, refined to about a voxel, measured and smoothed.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::super::grid::{CappedBox, Point};
use super::super::mapping::Mapping;
use super::super::surface::Body;
use super::super::{Divisions, FirstTouch};
use super::SurfaceReport;
use super::error::VolumeError;
use super::rays::{Crossing, Rays};
use super::smooth::{SurfaceGrid, normals};
use super::template::Template;
use super::tissue::{Kind, Tissue};

/// The template's surface grid, each cell divided into `factor` by `factor`; the mesh's own points are among its.
pub(super) struct FineGrid {
    factor: usize,
    /// Cells of the mesh's refined zone on an edge of an unrefined one; divides `factor`.
    refinement: usize,
    grid: CappedBox,
    mapping: Mapping,
    quads: Vec<[usize; 4]>,
    first_ring: Vec<bool>,
}

/// A surface at the points of the fine grid.
pub(super) struct Sheet {
    pub(super) positions: Vec<Vector3<f64>>,
    normals: Vec<Vector3<f64>>,
    template: Vec<Vector3<f64>>,
}

impl Sheet {
    /// Position and outward normal of a point.
    pub(super) fn at(&self, place: usize) -> [Vector3<f64>; 2] {
        [self.positions[place], self.normals[place]]
    }

    /// Distance of a point from the template.
    pub(super) fn shift(&self, place: usize) -> Vector3<f64> {
        self.positions[place] - self.template[place]
    }
}

impl FineGrid {
    pub(super) fn new(template: &Template, divisions: &Divisions, tissue: &Tissue) -> Self {
        let shape = &template.shape;
        let touch = FirstTouch::of(shape);
        // Cells of the pad: as fine as voxels.
        let coarse = Mapping::new(shape, divisions, &touch);
        let middle = [divisions.proximal_rings + divisions.joint_rings + divisions.distal_rings / 2, 0, 0];
        let next = [middle[0] + 1, 0, 0];
        let cell = (coarse.outer_position(next) - coarse.outer_position(middle)).norm();
        let refinement = divisions.refinement_factor();
        let factor = ((cell / voxel_mm(tissue)).ceil() as usize).clamp(2, 8).next_multiple_of(refinement);
        let times = |n: usize| n * factor;
        let fine = Divisions {
            columns: times(divisions.columns),
            rows: times(divisions.rows),
            proximal_rings: times(divisions.proximal_rings),
            joint_rings: times(divisions.joint_rings),
            distal_rings: times(divisions.distal_rings),
            ..*divisions
        };
        let grid = CappedBox::new(&fine);
        let base = grid.node(grid.surface()[0], grid.outer_level());
        let quads = grid.outer_faces().iter().map(|face| face.map(|n| (n - base) as usize)).collect();
        let first_ring = grid.surface().iter().map(|p| p[0] == 0).collect();
        Self { factor, refinement, mapping: Mapping::new(shape, &fine, &touch), grid, quads, first_ring }
    }

    /// Place in the fine grid of a surface point of the mesh before its refinement.
    pub(super) fn place(&self, point: Point) -> usize {
        self.place_refined(point.map(|n| n * self.refinement))
    }

    /// Place in the fine grid of a surface point of the mesh refined everywhere.
    pub(super) fn place_refined(&self, point: Point) -> usize {
        let base = self.grid.node(self.grid.surface()[0], 1);
        (self.grid.node(point.map(|n| n * self.factor / self.refinement), 1) - base) as usize
    }

    /// The skin's outside.
    pub(super) fn skin(
        &self,
        template: &Template,
        tissue: &Tissue,
        noise: f64,
    ) -> Result<(Sheet, SurfaceReport), VolumeError> {
        let body = Body::outer(&template.shape);
        let rays = Rays {
            tissue,
            pose: template.pose,
            body: &body,
            surface: "the skin",
            inside: Kind::is_inside,
            // A fold of skin over the nail hides the skin under it.
            between: |kind| kind != Kind::Outside,
            noise,
            length_mm: template.shape.length_mm,
        };
        let points = self.grid.surface().iter().map(|p| self.mapping.outer_position(*p)).collect();
        self.sheet(points, &rays, &|_| true)
    }

    /// The bones' outside, bridged over the joint.
    pub(super) fn bone(
        &self,
        template: &Template,
        tissue: &Tissue,
        noise: f64,
    ) -> Result<(Sheet, SurfaceReport), VolumeError> {
        let (body, shape) = (Body::bone(&template.shape), &template.shape);
        let rays = Rays {
            tissue,
            pose: template.pose,
            body: &body,
            surface: "the bone",
            inside: Kind::is_bone,
            between: Kind::is_bone,
            noise,
            length_mm: shape.length_mm,
        };
        let points = self.grid.surface().iter().map(|p| self.mapping.bone_position(*p)).collect();
        let room = 2.0 * tissue.spacing_mm[0];
        let gap = shape.joint_start_mm - room..shape.joint_end_mm + room;
        self.sheet(points, &rays, &|p: &Vector3<f64>| !gap.contains(&p.x))
    }

    fn sheet(
        &self,
        template: Vec<Vector3<f64>>,
        rays: &Rays,
        measurable: &(dyn Fn(&Vector3<f64>) -> bool + Sync),
    ) -> Result<(Sheet, SurfaceReport), VolumeError> {
        let measure = |p: &Vector3<f64>| if measurable(p) { rays.crossing(p) } else { Ok(rays.unknown(p)) };
        let crossings: Vec<Crossing> = template.par_iter().map(measure).collect::<Result<_, _>>()?;
        let measured: Vec<_> = crossings.iter().map(|c| c.offset_mm.map(|t| (t, c.slack_mm))).collect();
        let offsets = SurfaceGrid::new(&template, &self.quads).smooth(&measured, voxel_mm(rays.tissue));
        let positions: Vec<_> =
            (0..template.len()).map(|n| template[n] + offsets[n] * crossings[n].direction).collect();
        let mut normals = normals(&positions, &self.quads);
        for (normal, first) in normals.iter_mut().zip(&self.first_ring) {
            // The skin's inner nodes are kept in the cut.
            if *first {
                normal.x = 0.0;
                normal.normalize_mut();
            }
        }
        let mut report = SurfaceReport { offset_mm: [f64::INFINITY, f64::NEG_INFINITY], ..Default::default() };
        for (d, (t, slack)) in offsets.iter().zip(&measured).filter_map(|(d, m)| Some((d, (*m)?))) {
            report.rays += 1;
            report.offset_mm = [report.offset_mm[0].min(*d), report.offset_mm[1].max(*d)];
            report.border_rms_mm += (d - t).powi(2);
            report.beyond_voxels_mm = report.beyond_voxels_mm.max((d - t).abs() - slack);
        }
        report.border_rms_mm = (report.border_rms_mm / report.rays.max(1) as f64).sqrt();
        report.beyond_voxels_mm = report.beyond_voxels_mm.max(0.0);
        Ok((Sheet { positions, normals, template }, report))
    }
}

/// Size of a voxel: the cube root of its volume, mm.
fn voxel_mm(tissue: &Tissue) -> f64 {
    tissue.spacing_mm.iter().product::<f64>().cbrt()
}
