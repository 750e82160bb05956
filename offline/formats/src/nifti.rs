//! NIfTI label volumes of versions 1 and 2, `.nii` and `.nii.gz`.

use std::io::{Read, Write};
use std::path::Path;

use flate2::{Compression, read::MultiGzDecoder, write::GzEncoder};
use nalgebra::{Matrix3, Quaternion, Vector3};

use super::{Error, atomic_write, volume};
use crate::label_volume::LabelVolume;
use crate::significant;

/// Share by which two lengths of one voxel may differ: header fields are rounded.
const SAME_LENGTH: f64 = 1e-3;

/// Reads a label volume. A fourth axis of length 1 is ignored.
///
/// # Errors
/// [`Error::File`] or [`Error::Content`], with the value.
pub fn read(path: &Path) -> Result<LabelVolume, Error> {
    let bytes = std::fs::read(path).map_err(|source| Error::File { path: path.to_path_buf(), source })?;
    parse(bytes).map_err(|problem| Error::Content { path: path.to_path_buf(), problem })
}

/// The volume; an error is a sentence.
fn parse(mut bytes: Vec<u8>) -> Result<LabelVolume, String> {
    if bytes.starts_with(&[0x1f, 0x8b]) {
        let mut raw = Vec::new();
        let unzipped = MultiGzDecoder::new(bytes.as_slice()).read_to_end(&mut raw);
        unzipped.map_err(|error| format!("the file ends before its data do, or is damaged: {error}"))?;
        bytes = raw;
    }
    let header = Header::parse(&bytes)?;
    let size = match header.dims.as_slice() {
        [i, j, k, rest @ ..] if rest.iter().all(|n| *n == 1) => [*i, *j, *k],
        dims => return Err(format!("dimensions {dims:?}: a label volume has three axes, one label per voxel")),
    };
    let steps_mm = header.steps()?.map(|step| step * header.unit_mm);
    volume::check_steps(&steps_mm)?;
    let (scalar, number) = header.scalar()?;
    let count = size.iter().try_fold(scalar, |n, s| n.checked_mul(*s)).ok_or("the sizes do not fit in memory")?;
    let data = bytes.get(header.data_from..).unwrap_or_default();
    if data.len() < count {
        return Err(format!("the file ends before its data do: {} of {count} bytes", data.len()));
    }
    if data.len() > count {
        return Err(volume::too_long(data.len(), count, size));
    }
    let scaled = header.slope.is_finite() && header.shift.is_finite() && header.slope != 0.0;
    let scale = |v: f64| if scaled { v * header.slope + header.shift } else { v };
    let value = |chunk: &[u8]| {
        let mut little = [0; 8];
        little[..scalar].copy_from_slice(chunk);
        if header.big_endian {
            little[..scalar].reverse();
        }
        scale(number(little))
    };
    let labels = volume::labels(data.chunks_exact(scalar).map(value), size)?;
    Ok(LabelVolume { size, steps_mm, labels })
}

/// Fields of the header that a volume needs.
struct Header {
    big_endian: bool,
    dims: Vec<usize>,
    datatype: i64,
    pixdim: [f64; 4],
    data_from: usize,
    slope: f64,
    shift: f64,
    unit_mm: f64,
    has_qform: bool,
    has_sform: bool,
    /// Parts b, c, d of the quaternion.
    quaternion: [f64; 3],
    rows: [[f64; 3]; 3],
}

/// Numbers of a header in its byte order.
struct Fields<'a> {
    bytes: &'a [u8],
    big_endian: bool,
}

impl Fields<'_> {
    /// `N` bytes, the lowest first. The header is there in full.
    fn at<const N: usize>(&self, from: usize) -> [u8; N] {
        let mut found = [0; N];
        found.copy_from_slice(&self.bytes[from..from + N]);
        if self.big_endian {
            found.reverse();
        }
        found
    }

    fn i16(&self, from: usize) -> i64 {
        i16::from_le_bytes(self.at(from)).into()
    }

    fn i32(&self, from: usize) -> i64 {
        i32::from_le_bytes(self.at(from)).into()
    }

    fn i64(&self, from: usize) -> i64 {
        i64::from_le_bytes(self.at(from))
    }

    fn f32(&self, from: usize) -> f64 {
        f32::from_le_bytes(self.at(from)).into()
    }

    fn f64(&self, from: usize) -> f64 {
        f64::from_le_bytes(self.at(from))
    }
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Self, String> {
        let Some(first) = bytes.first_chunk::<4>() else { return Err("the file ends before its data do".into()) };
        let (length, big_endian) = match (i32::from_le_bytes(*first), i32::from_be_bytes(*first)) {
            (length @ (348 | 540), _) => (length as usize, false),
            (_, length @ (348 | 540)) => (length as usize, true),
            _ => return Err("is no NIfTI file: it does not begin with the length of a header, 348 or 540".into()),
        };
        if bytes.len() < length {
            return Err("the file ends before its data do".into());
        }
        let is_first = length == 348;
        let magic = if is_first { &bytes[344..348] } else { &bytes[4..8] };
        match magic {
            [b'n', b'+', ..] => {}
            [b'n', b'i', ..] => {
                return Err("has its data in another file (.img): convert it to one file, .nii".into());
            }
            _ => return Err(format!("is no NIfTI file: its mark is {:?}", String::from_utf8_lossy(magic))),
        }
        let fields = Fields { bytes, big_endian };
        let real = |at: usize, then: usize| if is_first { fields.f32(at) } else { fields.f64(then) };
        let dim = |k: usize| if is_first { fields.i16(40 + 2 * k) } else { fields.i64(16 + 8 * k) };
        let code = |at: usize, then: usize| if is_first { fields.i16(at) } else { fields.i32(then) };
        let axes = dim(0);
        let dims = (1..=axes.clamp(0, 7) as usize).map(|k| usize::try_from(dim(k)).ok().filter(|n| *n > 0));
        let dims: Option<Vec<usize>> = dims.collect();
        let dims = dims.filter(|_| (1..=7).contains(&axes));
        let dims = dims.ok_or_else(|| format!("dimensions {:?}: they must be positive", [0, 1, 2, 3].map(dim)))?;
        // 3 bits for space, 3 for time.
        let unit_mm = match if is_first { i64::from(bytes[123]) } else { fields.i32(500) } & 7 {
            1 => 1000.0,
            3 => 1e-3,
            _ => 1.0,
        };
        let offset = if is_first { fields.f32(108) } else { fields.i64(168) as f64 };
        // Some writers leave it out.
        let data_from = if offset >= length as f64 { offset as usize } else { length + 4 };
        Ok(Self {
            big_endian,
            dims,
            datatype: fields.i16(if is_first { 70 } else { 12 }),
            pixdim: [0, 1, 2, 3].map(|k| real(76 + 4 * k, 104 + 8 * k)),
            data_from,
            slope: real(112, 176),
            shift: real(116, 184),
            unit_mm,
            has_qform: code(252, 344) > 0,
            has_sform: code(254, 348) > 0,
            quaternion: [0, 1, 2].map(|k| real(256 + 4 * k, 352 + 8 * k)),
            rows: [0, 1, 2].map(|row| [0, 1, 2].map(|k| real(280 + 16 * row + 4 * k, 400 + 32 * row + 8 * k))),
        })
    }

    /// Bytes of a value, and how to read one from its bytes, the lowest first.
    fn scalar(&self) -> Result<(usize, fn([u8; 8]) -> f64), String> {
        macro_rules! of {
            ($t:ty) => {
                (size_of::<$t>(), |b: [u8; 8]| <$t>::from_le_bytes(*b.first_chunk().expect("at most 8")) as f64)
            };
        }
        Ok(match self.datatype {
            2 => of!(u8),
            4 => of!(i16),
            8 => of!(i32),
            16 => of!(f32),
            64 => of!(f64),
            256 => of!(i8),
            512 => of!(u16),
            768 => of!(u32),
            1024 => of!(i64),
            1280 => of!(u64),
            other => {
                return Err(format!(
                    "values of type {other} (a colour, a complex number, ...): labels are whole numbers"
                ));
            }
        })
    }

    /// Steps of the voxels: of the sform if there is one, else of the qform, else the bare spacings.
    fn steps(&self) -> Result<[Vector3<f64>; 3], String> {
        let pixdim = [self.pixdim[1], self.pixdim[2], self.pixdim[3]];
        let has_spacings = pixdim.iter().all(|s| s.is_finite() && *s > 0.0);
        if self.has_sform {
            let steps = [0, 1, 2].map(|axis| Vector3::from(self.rows.map(|row| row[axis])));
            let lengths = steps.map(|step| step.norm());
            let differ = |(a, b): (&f64, &f64)| !((a / b - 1.0).abs() < SAME_LENGTH);
            if has_spacings && lengths.iter().zip(&pixdim).any(differ) {
                let size = |s: [f64; 3]| s.map(|s| significant(s * self.unit_mm, 4)).join(" x ");
                return Err(format!(
                    "the header has two sizes of a voxel: {} mm of the sform, {} mm of pixdim{}. Correct the wrong one \
                     (nibabel: img.set_sform(img.get_qform()), or img.header.set_zooms)",
                    size(lengths),
                    size(pixdim),
                    if self.has_qform { " and the qform" } else { "" }
                ));
            }
            return Ok(steps);
        }
        if !has_spacings {
            return Err(format!("spacings {pixdim:?}: they must be positive numbers of mm"));
        }
        let turn = if self.has_qform {
            let [b, c, d] = self.quaternion;
            let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
            let turn = nalgebra::UnitQuaternion::from_quaternion(Quaternion::new(a, b, c, d));
            let mirror = if self.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
            turn.to_rotation_matrix().matrix() * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, mirror))
        } else {
            Matrix3::identity()
        };
        Ok([0, 1, 2].map(|axis| turn.column(axis) * pixdim[axis]))
    }
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
        let sheared = patched(|b| {
            b[288..292].copy_from_slice(&0.4f32.to_le_bytes());
            b[88..92].copy_from_slice(&1.077f32.to_le_bytes());
        });
        assert!(sheared.unwrap_err().contains("axes 0 and 2"));
        let four = patched(|b| {
            b[40] = 4;
            b[46] = 1;
            b[48] = 2;
        });
        assert!(four.unwrap_err().contains("dimensions [2, 3, 1, 2]"));
        assert!(patched(|b| b[344] = b'x').is_err());
    }

    #[test]
    fn a_voxel_of_two_sizes_is_refused_with_both() {
        // The sform of the written file has 0.25, 0.5 and 1 mm.
        for (change, expected) in [
            ([0.25f32, 0.5, 0.6], "0.25 x 0.5 x 1 mm of the sform, 0.25 x 0.5 x 0.6 mm of pixdim"),
            ([0.5, 1.0, 2.0], "0.25 x 0.5 x 1 mm of the sform, 0.5 x 1 x 2 mm of pixdim and the qform"),
            ([1.0, 1.0, 1.0], "0.25 x 0.5 x 1 mm of the sform, 1 x 1 x 1 mm of pixdim"),
        ] {
            let error = patched(|b| {
                (0..3).for_each(|k| b[80 + 4 * k..84 + 4 * k].copy_from_slice(&change[k].to_le_bytes()));
                b[252] = u8::from(expected.ends_with("qform"));
            });
            let error = error.unwrap_err();
            assert!(error.contains(expected), "{error}");
        }
        // Spacings that are rounded, or that the writer left at 0, are none.
        for spacing in [0.25001f32, 0.0] {
            patched(|b| b[80..84].copy_from_slice(&spacing.to_le_bytes())).unwrap();
        }
    }

    #[test]
    fn data_longer_than_the_sizes_are_refused() {
        let error = patched(|b| b.extend([0; 5])).unwrap_err();
        assert!(error.contains("the data have 17 bytes, 5 more than the 12 of [2, 3, 2] voxels"), "{error}");
        let error = patched(|b| b[108..112].copy_from_slice(&348f32.to_le_bytes())).unwrap_err();
        assert!(error.contains("4 more than the 12"), "{error}");
    }

    /// The header of version 2, with an sform.
    fn second(datatype: i16, big: bool) -> Vec<u8> {
        let mut h = vec![0; 544];
        let mut put = |at: usize, bytes: &[u8]| {
            h[at..at + bytes.len()].copy_from_slice(bytes);
            if big {
                h[at..at + bytes.len()].reverse();
            }
        };
        put(0, &540i32.to_le_bytes());
        put(12, &datatype.to_le_bytes());
        [3i64, 2, 3, 2, 1, 1, 1, 1].iter().enumerate().for_each(|(k, n)| put(16 + 8 * k, &n.to_le_bytes()));
        [1.0, 0.25, 0.5, 1.0].iter().enumerate().for_each(|(k, s)| put(104 + 8 * k, &f64::to_le_bytes(*s)));
        put(168, &544i64.to_le_bytes());
        put(176, &1f64.to_le_bytes());
        put(348, &1i32.to_le_bytes());
        [0.25f64, 0.5, 1.0].iter().enumerate().for_each(|(k, s)| put(400 + 40 * k, &s.to_le_bytes()));
        put(500, &2i32.to_le_bytes());
        h[4..12].copy_from_slice(b"n+2\0\r\n\x1a\n");
        h
    }

    #[test]
    fn version_2_in_both_byte_orders_and_all_types() {
        let expected = LabelVolume::new([2, 3, 2], [0.25, 0.5, 1.0], (0..12).collect());
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.nii");
        macro_rules! check {
            ($($code:literal $t:ty),*) => {$(
                for big in [false, true] {
                    let mut bytes = second($code, big);
                    bytes.extend((0u8..12).flat_map(|n| if big { (n as $t).to_be_bytes() } else { (n as $t).to_le_bytes() }));
                    std::fs::write(&path, &bytes).unwrap();
                    assert_eq!(read(&path).unwrap(), expected, "{} {big}", $code);
                    // Compressed, whatever the name says.
                    let mut zip = GzEncoder::new(Vec::new(), Compression::default());
                    zip.write_all(&bytes).unwrap();
                    std::fs::write(&path, zip.finish().unwrap()).unwrap();
                    assert_eq!(read(&path).unwrap(), expected);
                }
            )*};
        }
        check!(2 u8, 256 i8, 4 i16, 512 u16, 8 i32, 768 u32, 1024 i64, 1280 u64, 16 f32, 64 f64);
        let refused = |bytes: Vec<u8>| {
            std::fs::write(&path, bytes).unwrap();
            read(&path).unwrap_err().to_string()
        };
        assert!(refused(second(128, false)).contains("values of type 128"));
        assert!(refused(second(2, false)[..400].to_vec()).contains("ends before"));
        let mut halved = second(2, false);
        halved[400..408].copy_from_slice(&0.125f64.to_le_bytes());
        assert!(refused(halved).contains("0.125 x 0.5 x 1 mm of the sform, 0.25 x 0.5 x 1 mm of pixdim"));
        let mut apart = second(2, true);
        apart[5] = b'i';
        assert!(refused(apart).contains("another file (.img)"));
    }
}
