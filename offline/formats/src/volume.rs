//! Label volumes by the ending of their file's name.

use std::path::Path;

use nalgebra::Vector3;

use super::{Error, nifti, nrrd};
use crate::label_volume::LabelVolume;
use crate::significant;

/// Accepted endings, for messages.
const ENDINGS: &str = ".nrrd, .nhdr, .nii or .nii.gz";

enum Format {
    Nrrd,
    Nifti,
}

fn format(path: &Path) -> Result<Format, Error> {
    let name = path.to_string_lossy().to_lowercase();
    match () {
        () if name.ends_with(".nrrd") || name.ends_with(".nhdr") => Ok(Format::Nrrd),
        () if name.ends_with(".nii") || name.ends_with(".nii.gz") => Ok(Format::Nifti),
        () => Err(Error::Content {
            path: path.to_path_buf(),
            problem: format!("the name of a label volume ends in {ENDINGS}"),
        }),
    }
}

/// Reads a label volume, NRRD or NIfTI by its ending.
///
/// # Errors
/// [`Error`] with file and, in a text header, line, field and value.
pub fn read(path: &Path) -> Result<LabelVolume, Error> {
    match format(path)? {
        Format::Nrrd => nrrd::read(path),
        Format::Nifti => nifti::read(path),
    }
}

/// Writes a label volume with 8-bit labels, NRRD (gzip) or NIfTI by its ending; whole or not at all.
///
/// # Errors
/// A detached header's ending, labels above 255, or the disk's.
pub fn write(path: &Path, volume: &LabelVolume) -> Result<(), Error> {
    match format(path)? {
        Format::Nrrd => nrrd::write(path, volume),
        Format::Nifti => nifti::write(path, volume),
    }
}

/// Refuses a name with an ending that no label volume has, before the work of making one.
///
/// # Errors
/// [`Error::Content`] with the endings understood.
pub fn check_name(path: &Path) -> Result<(), Error> {
    format(path).map(drop)
}

/// Labels as bytes, for writing.
pub(super) fn bytes(path: &Path, volume: &LabelVolume) -> Result<Vec<u8>, Error> {
    let byte = |&label: &u16| {
        u8::try_from(label).map_err(|_| Error::Content {
            path: path.to_path_buf(),
            problem: format!("label {label}: labels up to 255 can be written"),
        })
    };
    volume.labels.iter().map(byte).collect()
}

/// Labels from numbers: whole, 0 to 65535; the problem as a sentence with the voxel otherwise.
pub(super) fn labels(values: impl Iterator<Item = f64>, size: [usize; 3]) -> Result<Vec<u16>, String> {
    let label = |(index, value): (usize, f64)| {
        let label = value as u16;
        if f64::from(label) == value {
            return Ok(label);
        }
        let voxel = [index % size[0], index / size[0] % size[1], index / size[0] / size[1]];
        Err(format!("voxel {voxel:?} is {value}: labels are whole numbers from 0 to 65535"))
    };
    values.enumerate().map(label).collect()
}

/// The sentence that refuses data longer than the header says: which of them the voxels are is unknown.
pub(super) fn too_long(found: usize, needed: usize, size: [usize; 3]) -> String {
    format!(
        "the data have {found} bytes, {} more than the {needed} of {size:?} voxels: the sizes or the type of the header are wrong, or \
         something stands before or behind the voxels",
        found - needed
    )
}

/// Refuses voxel steps that are not finite, have no length or are not at right angles (to 0.1°).
pub(super) fn check_steps(steps_mm: &[Vector3<f64>; 3]) -> Result<(), String> {
    for (axis, step) in steps_mm.iter().enumerate() {
        let length = step.norm();
        if !(length.is_finite() && length > 0.0) {
            return Err(format!(
                "the voxels' step along axis {axis} is {} mm; it must be a positive number",
                significant(length, 6)
            ));
        }
    }
    for [a, b] in [[0, 1], [0, 2], [1, 2]] {
        let angle_deg = steps_mm[a].angle(&steps_mm[b]).to_degrees();
        if !((angle_deg - 90.0).abs() < 0.1) {
            return Err(format!(
                "axes {a} and {b} of the voxels are at {angle_deg:.2}°: sheared (gantry-tilted) volumes have to be \
                 resampled to right angles first; a rotated volume is fine"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    pub fn sample() -> LabelVolume {
        let labels = (0..24).map(|i| [0, 1, 2, 3][i % 4]).collect();
        LabelVolume::new([2, 3, 4], [0.25, 0.5, 1.0], labels)
    }

    #[test]
    fn both_formats_give_the_volume_back() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["v.nrrd", "v.nii", "v.nii.gz"] {
            let path = dir.path().join(name);
            write(&path, &sample()).unwrap();
            assert_eq!(read(&path).unwrap(), sample(), "{name}");
        }
        let error = read(Path::new("finger.dcm")).unwrap_err().to_string();
        assert!(error.contains("finger.dcm") && error.contains(".nii.gz"), "{error}");
    }

    #[test]
    fn a_truncated_file_is_an_error_in_both_formats() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["v.nrrd", "v.nii", "v.nii.gz"] {
            let path = dir.path().join(name);
            write(&path, &sample()).unwrap();
            let whole = std::fs::read(&path).unwrap();
            // The last 8 bytes of gzip are its own check sum and length.
            for kept in [0, 3, 100, whole.len() - 12] {
                std::fs::write(&path, &whole[..kept.min(whole.len())]).unwrap();
                let error = read(&path).expect_err("a part of a file was taken for the whole").to_string();
                assert!(error.contains(name), "{error}");
            }
        }
    }

    #[test]
    fn labels_and_steps_are_checked() {
        let error = labels([0.0, 1.0, 2.5, 0.0].into_iter(), [2, 2, 1]).unwrap_err();
        assert!(error.contains("voxel [0, 1, 0] is 2.5"), "{error}");
        assert!(labels([-1.0].into_iter(), [1, 1, 1]).is_err() && labels([f64::NAN].into_iter(), [1, 1, 1]).is_err());
        let mut steps = [Vector3::x(), Vector3::y(), Vector3::z() * 0.5];
        check_steps(&steps).unwrap();
        steps[2].x = 0.2;
        assert!(check_steps(&steps).unwrap_err().contains("axes 0 and 2"));
        steps[1].y = f64::NAN;
        assert!(check_steps(&steps).unwrap_err().contains("NaN"));
    }
}
