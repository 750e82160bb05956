//! NIfTI-1 label volumes, `.nii` and `.nii.gz`; read by the `nifti` crate, header written here.

use std::io::Write;
use std::path::Path;

use flate2::{Compression, write::GzEncoder};
use nalgebra::{Matrix3, Quaternion, Vector3};
use nifti::{
    DataElement, InMemNiftiVolume, NiftiError, NiftiHeader, NiftiObject, NiftiType, NiftiVolume, ReaderOptions, Unit,
};

use super::{Error, atomic_write, volume};
use crate::label_volume::LabelVolume;

/// Reads a label volume. A fourth axis of length 1 is ignored.
///
/// # Errors
/// [`Error::File`] or [`Error::Content`], with the value.
pub fn read(path: &Path) -> Result<LabelVolume, Error> {
    let problem = |problem: String| Error::Content { path: path.to_path_buf(), problem };
    let object = ReaderOptions::new().read_file(path).map_err(|error| match error {
        NiftiError::Io(source) if source.kind() == std::io::ErrorKind::UnexpectedEof => {
            problem("the file ends before its data do".into())
        }
        NiftiError::Io(source) => Error::File { path: path.to_path_buf(), source },
        other => problem(other.to_string()),
    })?;
    let header = object.header().clone();
    let dims: Vec<usize> = object.volume().dim().iter().map(|n| usize::from(*n)).collect();
    let size = match dims.as_slice() {
        [i, j, k, rest @ ..] if rest.iter().all(|n| *n == 1) => [*i, *j, *k],
        _ => return Err(problem(format!("dimensions {dims:?}: a label volume has three axes, one label per voxel"))),
    };
    let unit_mm = match header.xyzt_to_space() {
        Ok(Unit::Meter) => 1000.0,
        Ok(Unit::Micron) => 1e-3,
        Ok(_) | Err(_) => 1.0,
    };
    let steps_mm = steps(&header).map_err(problem)?.map(|step| step * unit_mm);
    volume::check_steps(&steps_mm).map_err(problem)?;
    let values = values(object.into_volume(), &header).map_err(problem)?;
    let labels = volume::labels(values.into_iter(), size).map_err(problem)?;
    Ok(LabelVolume { size, steps_mm, labels })
}

/// The voxels' values, scaled by the header's factors.
fn values(volume: InMemNiftiVolume, header: &NiftiHeader) -> Result<Vec<f64>, String> {
    fn typed<T: DataElement + Copy>(volume: InMemNiftiVolume, number: fn(T) -> f64) -> Result<Vec<f64>, NiftiError> {
        Ok(volume.into_nifti_typed_data::<T>()?.into_iter().map(number).collect())
    }
    let kind = volume.data_type();
    let raw = match kind {
        NiftiType::Uint8 => typed::<u8>(volume, f64::from),
        NiftiType::Int8 => typed::<i8>(volume, f64::from),
        NiftiType::Uint16 => typed::<u16>(volume, f64::from),
        NiftiType::Int16 => typed::<i16>(volume, f64::from),
        NiftiType::Uint32 => typed::<u32>(volume, f64::from),
        NiftiType::Int32 => typed::<i32>(volume, f64::from),
        NiftiType::Float32 => typed::<f32>(volume, f64::from),
        NiftiType::Float64 => typed::<f64>(volume, |v| v),
        _ => return Err(format!("values of type {kind:?}: labels are whole numbers")),
    };
    let (slope, shift) = (f64::from(header.scl_slope), f64::from(header.scl_inter));
    let scaled = slope.is_finite() && shift.is_finite() && slope != 0.0;
    let scale = |v: f64| if scaled { v * slope + shift } else { v };
    Ok(raw.map_err(|e| e.to_string())?.into_iter().map(scale).collect())
}

/// Steps of the voxels: of the sform if there is one, else of the qform, else the bare spacings.
fn steps(header: &NiftiHeader) -> Result<[Vector3<f64>; 3], String> {
    let pixdim = [1, 2, 3].map(|axis| f64::from(header.pixdim[axis]));
    if header.sform_code > 0 {
        let rows = [header.srow_x, header.srow_y, header.srow_z];
        return Ok([0, 1, 2].map(|axis| Vector3::from(rows.map(|row| f64::from(row[axis])))));
    }
    if !pixdim.iter().all(|s| s.is_finite() && *s > 0.0) {
        return Err(format!("spacings {pixdim:?}: they must be positive numbers of mm"));
    }
    let turn = if header.qform_code > 0 {
        let [b, c, d] = [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from);
        let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
        let turn = nalgebra::UnitQuaternion::from_quaternion(Quaternion::new(a, b, c, d));
        let mirror = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
        turn.to_rotation_matrix().matrix() * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, mirror))
    } else {
        Matrix3::identity()
    };
    Ok([0, 1, 2].map(|axis| turn.column(axis) * pixdim[axis]))
}

/// Writes a volume with 8-bit labels, gzip if the name ends in `.gz`; whole or not at all.
///
/// # Errors
/// A label above 255, an axis of more than 32767 voxels, or the disk's.
pub fn write(path: &Path, volume: &LabelVolume) -> Result<(), Error> {
    let bytes = volume::bytes(path, volume)?;
    if let Some(n) = volume.size.iter().find(|n| **n > i16::MAX as usize) {
        let problem = format!("{n} voxels along an axis: NIfTI-1 holds up to {}", i16::MAX);
        return Err(Error::Content { path: path.to_path_buf(), problem });
    }
    let header = header(volume);
    let gz = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
    atomic_write(path, |w| {
        if gz {
            let mut zip = GzEncoder::new(w, Compression::default());
            zip.write_all(&header)?;
            zip.write_all(&bytes)?;
            return zip.finish().map(drop);
        }
        w.write_all(&header)?;
        w.write_all(&bytes)
    })
}

/// The 348 bytes of the header and 4 that mark the absence of an extension.
fn header(volume: &LabelVolume) -> Vec<u8> {
    let mut h = vec![0; 352];
    let mut put = |at: usize, bytes: &[u8]| h[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, &348i32.to_le_bytes());
    put(40, &3i16.to_le_bytes());
    for axis in 0..3 {
        put(42 + 2 * axis, &(volume.size[axis] as i16).to_le_bytes());
        put(80 + 4 * axis, &(volume.steps_mm[axis].norm() as f32).to_le_bytes());
        let row: [f32; 3] = [0, 1, 2].map(|step| volume.steps_mm[step][axis] as f32);
        (0..3).for_each(|step| put(280 + 16 * axis + 4 * step, &row[step].to_le_bytes()));
    }
    (3..7).for_each(|axis| put(42 + 2 * axis, &1i16.to_le_bytes()));
    put(70, &2i16.to_le_bytes()); // uint8
    put(72, &8i16.to_le_bytes()); // bits
    put(76, &1f32.to_le_bytes());
    put(108, &352f32.to_le_bytes());
    put(112, &1f32.to_le_bytes()); // slope of the values
    put(123, &[2]); // mm
    put(148, b"fingerpad labels: 0 outside, 1 soft tissue, 2 bone, 3 nail");
    put(254, &1i16.to_le_bytes()); // sform: scanner
    put(344, b"n+1\0");
    h
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patched(change: impl Fn(&mut Vec<u8>)) -> Result<LabelVolume, String> {
        let volume = LabelVolume::new([2, 3, 2], [0.25, 0.5, 1.0], (0..12).collect());
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.nii");
        write(&path, &volume).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        change(&mut bytes);
        std::fs::write(&path, bytes).unwrap();
        read(&path).map_err(|e| e.to_string())
    }

    #[test]
    fn quaternion_gives_the_steps() {
        // 90° about z, sform off: axis 0 points along y, axis 1 along -x.
        let turned = patched(|b| {
            b[254] = 0;
            b[252] = 1;
            b[264..268].copy_from_slice(&0.5f32.sqrt().to_le_bytes());
        });
        let steps = turned.unwrap().steps_mm;
        assert!((steps[0] - Vector3::new(0.0, 0.25, 0.0)).norm() < 1e-6);
        assert!((steps[1] - Vector3::new(-0.5, 0.0, 0.0)).norm() < 1e-6);
    }

    #[test]
    fn big_endian_16_bit() {
        let read = patched(|b| {
            let data: Vec<u8> = b[352..].to_vec();
            b[70] = 4;
            b[72] = 16;
            let halves = |b: &mut [u8]| b.chunks_exact_mut(2).for_each(<[u8]>::reverse);
            let words = |b: &mut [u8]| b.chunks_exact_mut(4).for_each(<[u8]>::reverse);
            words(&mut b[0..4]);
            halves(&mut b[40..56]);
            halves(&mut b[68..76]);
            words(&mut b[76..120]);
            halves(&mut b[252..256]);
            words(&mut b[256..328]);
            b.truncate(352);
            b.extend(data.iter().flat_map(|d| [0, *d]));
        });
        let read = read.unwrap();
        assert_eq!(read.labels, (0..12).collect::<Vec<u16>>());
        assert_eq!(read.steps_mm[1], Vector3::new(0.0, 0.5, 0.0));
    }

    #[test]
    fn bad_headers_are_refused() {
        let no_spacing = patched(|b| {
            b[254] = 0;
            b[84..88].copy_from_slice(&f32::NAN.to_le_bytes());
        });
        assert!(no_spacing.unwrap_err().contains("spacings [0.25, NaN, 1.0]"));
        let sheared = patched(|b| b[288..292].copy_from_slice(&0.4f32.to_le_bytes()));
        assert!(sheared.unwrap_err().contains("axes 0 and 2"));
        let four = patched(|b| {
            b[40] = 4;
            b[46] = 1;
            b[48] = 2;
        });
        assert!(four.unwrap_err().contains("dimensions [2, 3, 1, 2]"));
        assert!(patched(|b| b[344] = b'x').is_err());
    }
}
