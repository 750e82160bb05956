//! NRRD label volumes and height fields (format of the Teem library, versions 1 to 5): raw, gzip and text encodings, both byte
//! orders, attached or detached data.
//!
//! Used of the header: type, dimension (3, of height fields 2), sizes, encoding, endian, spacings or space directions, space units, data
//! file. The place and the turn of the volume in the scanner are of no use to a mesh and are only checked.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;

use flate2::{Compression, read::MultiGzDecoder, write::GzEncoder};
use nalgebra::Vector3;

use super::{Error, atomic_write, volume};
use crate::label_volume::LabelVolume;

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Raw,
    Gzip,
    Text,
}

/// A scalar type: bytes, and how to read one from little-endian bytes.
type Scalar = (usize, fn(&[u8]) -> f64);

fn scalar(name: &str) -> Option<Scalar> {
    macro_rules! of {
        ($t:ty) => {
            (size_of::<$t>(), |b| <$t>::from_le_bytes(b.try_into().expect("as many bytes as the type has")) as f64)
        };
    }
    Some(match name {
        "signed char" | "int8" | "int8_t" => of!(i8),
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => of!(u8),
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => of!(i16),
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => of!(u16),
        "int" | "signed int" | "int32" | "int32_t" => of!(i32),
        "uint" | "unsigned int" | "uint32" | "uint32_t" => of!(u32),
        "longlong" | "long long" | "long long int" | "signed long long" | "int64" | "int64_t" => of!(i64),
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => of!(u64),
        "float" => of!(f32),
        "double" => of!(f64),
        _ => return None,
    })
}

/// Contents of the header.
#[derive(Default)]
struct Header {
    /// Number of axes to read: 3, or 2, to which a third of one node is added.
    axes: usize,
    scalar: Option<Scalar>,
    size: Option<[usize; 3]>,
    steps_mm: Option<[Vector3<f64>; 3]>,
    encoding: Option<Encoding>,
    big_endian: Option<bool>,
    data_file: Option<String>,
    unit_mm: f64,
}

/// Reads a label volume.
///
/// # Errors
/// [`Error::Field`] with line and value for the header; [`Error::Content`] for data that are too short or no labels.
pub fn read(path: &Path) -> Result<LabelVolume, Error> {
    let (size, steps_mm, values) = read_values(path, 3)?;
    let labels = volume::labels(values.into_iter(), size);
    let labels = labels.map_err(|problem| Error::Content { path: path.to_path_buf(), problem })?;
    Ok(LabelVolume { size, steps_mm, labels })
}

/// Sizes, steps along the axes (mm) and values of a file with so many axes; of two the third has size 1.
pub(crate) fn read_values(path: &Path, axes: usize) -> Result<([usize; 3], [Vector3<f64>; 3], Vec<f64>), Error> {
    let file = |source| Error::File { path: path.to_path_buf(), source };
    let mut input = BufReader::new(std::fs::File::open(path).map_err(file)?);
    let header = read_header(path, axes, &mut input)?;
    let problem = |problem: String| Error::Content { path: path.to_path_buf(), problem };
    let missing = |field: &str| problem(format!("the header has no `{field}`"));
    let (bytes, convert) = header.scalar.ok_or_else(|| missing("type"))?;
    let size = header.size.ok_or_else(|| missing("sizes"))?;
    let encoding = header.encoding.ok_or_else(|| missing("encoding"))?;
    let steps_mm = header.steps_mm.ok_or_else(|| missing("spacings` or `space directions"))?;
    let steps_mm = steps_mm.map(|step| step * header.unit_mm);
    volume::check_steps(&steps_mm).map_err(problem)?;

    let mut data: Box<dyn Read> = match &header.data_file {
        None => Box::new(input),
        Some(name) => {
            let beside = path.parent().unwrap_or(Path::new("")).join(name);
            let opened = std::fs::File::open(&beside).map_err(|source| Error::File { path: beside, source })?;
            Box::new(BufReader::new(opened))
        }
    };
    let count: usize = size.iter().product();
    let values: Vec<f64> = match encoding {
        Encoding::Text => {
            let mut text = String::new();
            data.read_to_string(&mut text).map_err(file)?;
            let number = |s: &str| s.parse().map_err(|_| problem(format!("data: `{s}` is not a number")));
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            if words.len() > count {
                let found = words.len();
                return Err(problem(format!(
                    "the data have {found} numbers, but {size:?} are {count}: the sizes are wrong"
                )));
            }
            words.into_iter().map(number).collect::<Result<_, _>>()?
        }
        Encoding::Raw | Encoding::Gzip => {
            if encoding == Encoding::Gzip {
                data = Box::new(MultiGzDecoder::new(data));
            }
            let big = match (bytes, header.big_endian) {
                (1, _) => false,
                (_, Some(big)) => big,
                (_, None) => return Err(missing("endian")),
            };
            let (mut raw, needed) = (Vec::new(), count * bytes);
            let cut = |source| problem(format!("the data are cut off or damaged: {source}"));
            data.by_ref().take(needed as u64).read_to_end(&mut raw).map_err(cut)?;
            // Reading on makes the decoder check its sum.
            let more = std::io::copy(&mut data, &mut std::io::sink()).map_err(cut)? as usize;
            if more > 0 {
                return Err(problem(volume::too_long(needed + more, needed, size)));
            }
            if big {
                raw.chunks_exact_mut(bytes).for_each(<[u8]>::reverse);
            }
            raw.chunks_exact(bytes).map(convert).collect()
        }
    };
    if values.len() != count {
        return Err(problem(format!("the data end after {} of {count} voxels ({size:?})", values.len())));
    }
    Ok((size, steps_mm, values))
}

fn read_header(path: &Path, axes: usize, input: &mut impl BufRead) -> Result<Header, Error> {
    let mut header = Header { axes, unit_mm: 1.0, ..Header::default() };
    let mut number = 0;
    loop {
        number += 1;
        let mut bytes = Vec::new();
        let read = input.by_ref().take(100_000).read_until(b'\n', &mut bytes);
        read.map_err(|source| Error::File { path: path.to_path_buf(), source })?;
        let ended = bytes.is_empty();
        let line = String::from_utf8(bytes).map_err(|_| Error::NotText { path: path.to_path_buf(), line: number })?;
        let line = line.trim_end();
        let fail = |field: &str, value: &str, problem: &str| Error::Field {
            path: path.to_path_buf(),
            line: number,
            field: field.into(),
            value: value.into(),
            problem: problem.into(),
        };
        if number == 1 {
            let version = line.strip_prefix("NRRD000").and_then(|v| v.parse::<u8>().ok());
            if !version.is_some_and(|v| (1..=5).contains(&v)) {
                let shown: String = line.chars().take(16).collect();
                return Err(fail("magic", &shown, "is not NRRD0001 to NRRD0005"));
            }
            continue;
        }
        if line.is_empty() {
            // A detached header may end with its file.
            if ended && header.data_file.is_none() {
                return Err(fail("header", "", "ends without the blank line that stands before the data"));
            }
            return Ok(header);
        }
        if line.starts_with('#') || line.contains(":=") {
            continue;
        }
        let Some((field, value)) = line.split_once(':') else {
            return Err(fail("header", line, "is neither `field: value` nor a comment"));
        };
        let (field, value) = (field.trim().to_lowercase(), value.trim());
        set_field(&mut header, &field, value).map_err(|problem| fail(&field, value, &problem))?;
    }
}

/// Adds one field to the header; an error is the end of a sentence.
fn set_field(header: &mut Header, field: &str, value: &str) -> Result<(), String> {
    match field {
        "type" => {
            let found = scalar(&value.to_lowercase());
            header.scalar = Some(found.ok_or("is not a type of numbers (uint8, int16, float, ...)")?);
        }
        "dimension" if value != header.axes.to_string() => {
            let is_not = if header.axes == 3 {
                "is not 3: a label volume has three axes, one label per voxel"
            } else {
                "is not 2: a height field has two axes, one height per node"
            };
            return Err(is_not.into());
        }
        "sizes" => {
            let mut sizes: Vec<usize> = numbers(value)?;
            if header.axes == 2 && sizes.len() == 2 {
                sizes.push(1);
            }
            let size: [usize; 3] = sizes.try_into().map_err(|_| "are not three sizes (of a height field two)")?;
            let count = size.iter().try_fold(1usize, |n, s| n.checked_mul(*s));
            if size.contains(&0) || count.is_none_or(|n| n > 4_000_000_000) {
                return Err("are no sizes of a volume that fits in memory".into());
            }
            header.size = Some(size);
        }
        "encoding" => {
            header.encoding = Some(match value.to_lowercase().as_str() {
                "raw" => Encoding::Raw,
                "gzip" | "gz" => Encoding::Gzip,
                "ascii" | "text" | "txt" => Encoding::Text,
                _ => return Err("is not supported; raw, gzip and ascii are".into()),
            });
        }
        "endian" => {
            header.big_endian = Some(match value.to_lowercase().as_str() {
                "little" => false,
                "big" => true,
                _ => return Err("is neither little nor big".into()),
            });
        }
        "spacings" => {
            let mut spacings: Vec<f64> = numbers(value)?;
            if header.axes == 2 && spacings.len() == 2 {
                spacings.push(1.0);
            }
            let spacings: [f64; 3] =
                spacings.try_into().map_err(|_| "are not three spacings (of a height field two)")?;
            if !spacings.iter().all(|s| s.is_finite() && *s > 0.0) {
                return Err("are not three positive numbers of mm".into());
            }
            header.steps_mm.get_or_insert([0, 1, 2].map(|axis| Vector3::ith(axis, spacings[axis])));
        }
        "space directions" if header.axes == 2 => return Err("are not read of a height field; give spacings".into()),
        "space directions" => header.steps_mm = Some(directions(value)?),
        "space units" => {
            let units: Vec<&str> = value.split('"').map(str::trim).filter(|s| !s.is_empty()).collect();
            header.unit_mm = match units.as_slice() {
                [a, rest @ ..] if rest.len() + 1 == header.axes && rest.iter().all(|b| b == a) => match *a {
                    "mm" => 1.0,
                    "cm" => 10.0,
                    "m" => 1000.0,
                    "um" | "µm" => 1e-3,
                    _ => return Err("are not supported; mm, cm, m and um are".into()),
                },
                _ => return Err("are not the same unit for every axis".into()),
            };
        }
        "data file" | "datafile" => {
            if value.starts_with("LIST") || value.contains('%') {
                return Err("is more than one file; join them first (`unu save`)".into());
            }
            header.data_file = Some(value.into());
        }
        "line skip" | "lineskip" | "byte skip" | "byteskip" if value != "0" => {
            return Err("is not supported; only 0 is".into());
        }
        // Orientation, contents, ranges: nothing that a mesh needs.
        _ => {}
    }
    Ok(())
}

fn numbers<T: std::str::FromStr>(value: &str) -> Result<Vec<T>, String> {
    let number = |s: &str| s.parse().map_err(|_| format!("has `{s}`, which is not such a number"));
    value.split_ascii_whitespace().map(number).collect()
}

/// `(x,y,z) (x,y,z) (x,y,z)`.
fn directions(value: &str) -> Result<[Vector3<f64>; 3], String> {
    let mut found = Vec::new();
    for part in value.split('(').skip(1) {
        let inside = part.split_once(')').ok_or("has an open parenthesis")?.0;
        let vector: [f64; 3] =
            numbers(&inside.replace(',', " "))?.try_into().map_err(|_| "does not have three numbers in parentheses")?;
        found.push(Vector3::from(vector));
    }
    found.try_into().map_err(|_| "are not three vectors (x,y,z)".into())
}

/// Writes a volume with 8-bit labels, gzip; whole or not at all.
///
/// # Errors
/// A label above 255, a name of a detached header, or the disk's.
pub fn write(path: &Path, volume: &LabelVolume) -> Result<(), Error> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("nhdr")) {
        let problem = "detached headers are read, not written: let the name end in .nrrd".into();
        return Err(Error::Content { path: path.to_path_buf(), problem });
    }
    let bytes = volume::bytes(path, volume)?;
    let [i, j, k] = volume.size;
    let steps = volume.steps_mm.map(|s| format!("({},{},{})", s.x, s.y, s.z)).join(" ");
    atomic_write(path, |w| {
        writeln!(w, "NRRD0005\n# labels: 0 outside, 1 soft tissue, 2 bone, 3 nail")?;
        writeln!(w, "type: uint8\ndimension: 3\nspace dimension: 3\nsizes: {i} {j} {k}")?;
        writeln!(w, "space directions: {steps}\nspace units: \"mm\" \"mm\" \"mm\"\nkinds: domain domain domain")?;
        writeln!(w, "encoding: gzip\n")?;
        let mut zip = GzEncoder::new(w, Compression::default());
        zip.write_all(&bytes)?;
        zip.finish().map(drop)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(header: &str, data: &[u8]) -> Result<LabelVolume, String> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.nrrd");
        let mut all = header.as_bytes().to_vec();
        all.extend_from_slice(data);
        std::fs::write(&path, all).unwrap();
        read(&path).map_err(|e| e.to_string())
    }

    const HEAD: &str = "NRRD0004\ntype: short\ndimension: 3\nsizes: 2 1 2\nspacings: 0.5 0.5 1\n";

    #[test]
    fn byte_orders_and_text() {
        let little = parse(&format!("{HEAD}endian: little\nencoding: raw\n\n"), &[1, 0, 2, 0, 3, 0, 0, 1]).unwrap();
        assert_eq!(little.labels, [1, 2, 3, 256]);
        assert_eq!(little.steps_mm[2], Vector3::new(0.0, 0.0, 1.0));
        let big = parse(&format!("{HEAD}endian: big\nencoding: raw\n\n"), &[0, 1, 0, 2, 0, 3, 1, 0]).unwrap();
        let text = parse(&format!("# c\n{HEAD}encoding: ascii\nkey:=value\n\n")[4..], b"1 2 3\n256").unwrap();
        assert_eq!((&big, &text), (&little, &little));
    }

    #[test]
    fn turned_directions_and_units() {
        let head = "NRRD0005\ntype: uchar\ndimension: 3\nsizes: 1 1 1\nencoding: raw\n";
        let turned = "space directions: (0,0.03,0.04) (0.05,0,0) (0,-0.04,0.03)\nspace units: \"cm\" \"cm\" \"cm\"\n\n";
        let volume = parse(&format!("{head}{turned}"), &[7]).unwrap();
        assert!(volume.steps_mm.iter().all(|s| (s.norm() - 0.5).abs() < 1e-12));
    }

    #[test]
    fn errors_name_line_field_and_value() {
        let raw = "encoding: raw\nendian: little\n\n";
        for (header, expected) in [
            ("NRRD0009\n".into(), ":1: magic: `NRRD0009`"),
            (HEAD.replace("dimension: 3", "dimension: 4") + raw, ":3: dimension: `4` is not 3"),
            (HEAD.replace("2 1 2", "2 1") + raw, ":4: sizes: `2 1` are not three"),
            (HEAD.replace("0.5 0.5 1", "0.5 nan 1") + raw, ":5: spacings: `0.5 nan 1`"),
            (HEAD.replace("short", "block") + raw, ":2: type: `block`"),
            (format!("{HEAD}encoding: bzip2\n\n"), ":6: encoding: `bzip2`"),
            (format!("{HEAD}encoding: raw\n\n"), "no `endian`"),
            (HEAD.replace("spacings: 0.5 0.5 1\n", "") + raw, "no `spacings` or"),
            (format!("{HEAD}{raw}"), "the data end after 3 of 4 voxels"),
            (format!("{HEAD}space directions: (1,0,0) (0,1,0) (0,0.3,1)\n{raw}"), "axes 1 and 2"),
            (format!("{HEAD}space directions: none (1,0,0) (0,1,0)\n{raw}"), "are not three vectors"),
            (format!("{HEAD}data file: LIST\n{raw}"), "more than one file"),
        ] {
            let error = parse(&header, &[0; 6]).unwrap_err();
            assert!(error.contains(expected), "{error}\nshould contain: {expected}");
        }
        assert!(parse(HEAD, &[]).unwrap_err().contains("ends without the blank line"));
    }

    #[test]
    fn data_longer_than_the_sizes_are_refused_with_both_lengths() {
        let gzip = |data: &[u8]| {
            let mut zip = GzEncoder::new(Vec::new(), Compression::default());
            zip.write_all(data).unwrap();
            zip.finish().unwrap()
        };
        let bytes = [1, 0, 2, 0, 3, 0, 0, 1, 9, 9, 9, 9];
        let expected = "the data have 12 bytes, 4 more than the 8 of [2, 1, 2] voxels";
        for (encoding, data) in [("raw", bytes.to_vec()), ("gzip", gzip(&bytes))] {
            let header = format!("{HEAD}endian: little\nencoding: {encoding}\n");
            let error = parse(&format!("{header}\n"), &data).unwrap_err();
            assert!(error.contains(expected), "{error}");
            // Detached data.
            let dir = tempfile::tempdir().unwrap();
            std::fs::write(dir.path().join("data"), &data).unwrap();
            let path = dir.path().join("t.nhdr");
            std::fs::write(&path, format!("{header}data file: data\n")).unwrap();
            let error = read(&path).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
        let error = parse(&format!("{HEAD}encoding: ascii\n\n"), b"1 2 3 4 5\n").unwrap_err();
        assert!(error.contains("the data have 5 numbers, but [2, 1, 2] are 4"), "{error}");
    }
}
