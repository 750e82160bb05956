//! A labelled volume (outside, soft tissue, bone, nail) becomes the mesh of a fingertip.
//!
//! Main types: [`LabelVolume`], [`VolumeGeometry`]; [`volume_fingertip`] makes a [`VolumeFingertip`] with its
//! [`VolumeReport`]; [`phantom`] makes the test volume. Method: a parametric template is fitted to the labels' borders;
//! its grid is carried along rays from the axis onto the smoothest surfaces that the labels allow; skin, layers, nail
//! and sets are made as for the parametric fingertip. May use: the rest of mesh.

mod core_box;
mod error;
mod fit;
mod grid;
mod nail;
mod phantom;
mod rays;
mod settings;
mod smooth;
mod template;
mod tissue;

use nalgebra::Vector3;

pub use error::VolumeError;
pub use fingerpad_formats::label_volume::LabelVolume;
pub use phantom::{PhantomSettings, label, phantom};
pub use settings::{Labels, VolumeGeometry, VoxelAxis};

use super::first_touch_of_points;
use super::grid::{CappedBox, Point};
use super::mapping::Mapping;
use super::parametric::finish;
use super::{Divisions, Fingertip, FingertipShape, FirstTouch};
use core_box::Core;
use grid::FineGrid;
use template::Template;
use tissue::Tissue;

/// A fingertip from a volume.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeFingertip {
    /// Mesh, first touch of the smooth surface, outer faces.
    pub fingertip: Fingertip,
    /// The parametric shape nearest to the labels, from which the grid was taken.
    pub template: FingertipShape,
    /// Quality of the import.
    pub report: VolumeReport,
}

/// Errors of the mesh against the volume.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct VolumeReport {
    /// Spacing of the voxels, distal, lateral, dorsal, mm.
    pub voxel_mm: [f64; 3],
    /// Turn about the dorsal axis, given or found, degrees.
    pub yaw_deg: f64,
    /// The skin's surface.
    pub skin: SurfaceReport,
    /// The bones' surface.
    pub bone: SurfaceReport,
    /// Whether the nail's place and thickness were measured from labels.
    pub nail_measured: bool,
    /// Voxels of air enclosed by tissue, taken as tissue.
    pub filled_voxels: usize,
    /// Voxels apart from the finger, and loose bits of bone, left out.
    pub dropped_voxels: usize,
}

/// Errors of a surface against the labels.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct SurfaceReport {
    /// Rays that measured it.
    pub rays: usize,
    /// Root mean square distance of the labels' border from the template, mm; about 0.3 voxels when it fits.
    pub template_rms_mm: f64,
    /// Least and greatest offset of the surface from the template, along rays, mm.
    pub offset_mm: [f64; 2],
    /// Root mean square distance of the surface from the labels' border, along rays, mm.
    pub border_rms_mm: f64,
    /// Greatest distance beyond the resolution of the voxels, along rays, mm.
    pub beyond_voxels_mm: f64,
}

/// Makes and checks the mesh of a labelled finger.
///
/// # Errors
/// [`VolumeError`] names the place: unknown or missing labels, a finger that is too short, no joint gap, a surface that
/// is not star-shaped about its axis, an inverted element.
pub fn volume_fingertip(
    volume: &LabelVolume,
    settings: &VolumeGeometry,
    divisions: &Divisions,
) -> Result<VolumeFingertip, VolumeError> {
    settings.validate()?;
    divisions.validate()?;
    let mut tissue = Tissue::new(volume, settings)?;
    let template = Template::of(&mut tissue, settings)?;
    let shape = &template.shape;
    let grid = CappedBox::new(divisions);
    let mapping = Mapping::new(shape, divisions, &FirstTouch::of(shape));

    let fine = FineGrid::new(&template, divisions, &tissue);
    let (skin, bone) =
        rayon::join(|| fine.skin(&template, &tissue, settings.noise), || fine.bone(&template, &tissue, settings.noise));
    let ((skin, skin_report), (bone, bone_report)) = (skin?, bone?);
    let touch = first_touch_of_points::lowest(&skin.positions, settings.inclination_deg, 2.0)
        .ok_or_else(|| VolumeError::Fit("the pad has no lowest point before the cut: check the axes".into()))?;

    let mut nodes = vec![Vector3::zeros(); grid.node_count()];
    let core = Core::new(&template, divisions, &fine, &bone);
    for point in box_points(divisions) {
        nodes[grid.node(point, 0) as usize] = core.place(point, mapping.core(point), &fine, &bone);
    }
    for &point in grid.surface() {
        let place = fine.place(point);
        let core = nodes[grid.node(point, 0) as usize];
        let line = mapping.line_between(core, bone.at(place), skin.at(place));
        for (level, position) in line.into_iter().enumerate() {
            nodes[grid.node(point, level + 1) as usize] = position;
        }
    }
    let refined = Mapping::new(shape, &divisions.refined_everywhere(), &FirstTouch::of(shape));
    let fine_line = |point: Point| {
        let place = fine.place_refined(point);
        // The refined zone ends above the bone: positions under the bone's surface are not used.
        refined.line_between(bone.at(place)[0], bone.at(place), skin.at(place))
    };
    let fingertip = finish(shape, divisions, &grid, nodes, touch, fine_line)?;
    let report = VolumeReport {
        voxel_mm: tissue.spacing_mm,
        yaw_deg: template.yaw_deg,
        skin: SurfaceReport { template_rms_mm: template.skin_rms_mm, ..skin_report },
        bone: SurfaceReport { template_rms_mm: template.bone_rms_mm, ..bone_report },
        nail_measured: template.nail_measured,
        filled_voxels: tissue.filled,
        dropped_voxels: tissue.dropped,
    };
    Ok(VolumeFingertip { fingertip, template: template.shape, report })
}

fn box_points(divisions: &Divisions) -> impl Iterator<Item = Point> + '_ {
    let (rings, columns, rows) = (divisions.rings(), divisions.columns, divisions.rows);
    (0..=rings).flat_map(move |i| (0..=columns).flat_map(move |j| (0..=rows).map(move |k| [i, j, k])))
}

#[cfg(test)]
mod tests;
