//! The model file: checked once, then used in place.
//!
//! The layout is described in `core/docs/fpm-format.md` with test vectors. Uses model, check, error.

use crate::build::DataOf;
use crate::effects::normal_relaxation::NormalRelaxation;
use crate::effects::{Effect, OWN};
use crate::sections::{COLUMNS, EffectSlot, RELAXATION, Sections, TableColumn};
use crate::{Error, ModelOf, Relaxation};

/// First four bytes of a model file.
pub const MAGIC: [u8; 4] = *b"FPM1";
/// Format version that this library reads and writes.
pub const VERSION: u32 = 10;

const HEADER: usize = 20;
const ENTRY: usize = 12;
const DATA: [u8; 4] = *b"DATA";
const EFFECTS: [u8; 4] = *b"EFFX";
const META: [u8; 4] = *b"META";
const TABLES: [u8; 4] = *b"TABL";
/// Sections of a file without optional ones.
const SECTIONS: usize = 3;

/// Contents of a model file, read in place.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FileOf<'a, const M: usize, const N: usize> {
    /// The model.
    pub model: ModelOf<'a, M, N>,
    /// Effects beyond it.
    pub effects: &'a [EffectSlot],
    /// Tables that some of them read, see [`crate::effects::tables`]; none in most files.
    pub tables: &'a [f32],
    /// User-defined columns that the tables read, in the order of [`crate::Surroundings::own`].
    pub columns: &'a [TableColumn],
    /// Provenance: JSON with ranges, hash of the settings, and versions.
    pub meta: &'a str,
}

/// The default model's file.
pub type File<'a> = FileOf<'a, { crate::SPRINGS }, { crate::NODES }>;

/// CRC-32 as in zlib and Ethernet (reflected, polynomial 0xEDB88320), four bits at a time.
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
    crc32_on(0, bytes)
}

/// The same, continued from the checksum of the preceding bytes.
fn crc32_on(before: u32, bytes: &[u8]) -> u32 {
    const TABLE: [u32; 16] = {
        let mut table = [0; 16];
        let mut i = 0;
        while i < 16 {
            let mut c = i as u32;
            let mut k = 0;
            while k < 4 {
                c = if c & 1 == 1 { 0xEDB8_8320 ^ (c >> 1) } else { c >> 1 };
                k += 1;
            }
            table[i] = c;
            i += 1;
        }
        table
    };
    let mut crc = !before;
    for byte in bytes {
        crc ^= u32::from(*byte);
        crc = (crc >> 4) ^ TABLE[(crc & 15) as usize];
        crc = (crc >> 4) ^ TABLE[(crc & 15) as usize];
    }
    !crc
}

pub(crate) fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let four = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(four.try_into().ok()?))
}

fn too_short(bytes: &[u8], expected: usize) -> Error {
    Error::Length { expected: expected as u32, found: bytes.len() as u32 }
}

/// Refuses bytes that cannot be used in place.
pub(crate) fn check_start(bytes: &[u8]) -> Result<(), Error> {
    const { assert!(cfg!(target_endian = "little"), "model files are little-endian") };
    if bytes.as_ptr().align_offset(4) != 0 {
        return Err(Error::Alignment);
    }
    Ok(())
}

/// Checks header and checksum.
pub(crate) fn check_envelope(bytes: &[u8]) -> Result<(), Error> {
    let short = too_short(bytes, HEADER);
    if bytes.get(..4).ok_or(short)? != MAGIC {
        return Err(Error::Magic);
    }
    let found = word(bytes, 4).ok_or(short)?;
    if found != VERSION {
        return Err(Error::Version { found });
    }
    let expected = word(bytes, 8).ok_or(short)?;
    if expected as usize != bytes.len() {
        return Err(Error::Length { expected, found: bytes.len() as u32 });
    }
    let checksum = word(bytes, 12).ok_or(short)?;
    if crc32(bytes.get(16..).ok_or(short)?) != checksum {
        return Err(Error::Checksum);
    }
    Ok(())
}

/// The bytes of section `id`.
pub(crate) fn section(bytes: &[u8], id: [u8; 4]) -> Result<&[u8], Error> {
    let count = word(bytes, 16).unwrap_or(0) as usize;
    for i in 0..count.min(16) {
        let at = HEADER + i * ENTRY;
        if bytes.get(at..at + 4) != Some(&id[..]) {
            continue;
        }
        let (Some(offset), Some(length)) = (word(bytes, at + 4), word(bytes, at + 8)) else { break };
        let end = (offset as usize).saturating_add(length as usize);
        return bytes.get(offset as usize..end).ok_or(too_short(bytes, end));
    }
    Err(Error::Section { id })
}

/// The numbers of a section that a file may lack, in place; none there.
fn optional<T: bytemuck::AnyBitPattern>(bytes: &[u8], id: [u8; 4]) -> Result<&[T], Error> {
    match section(bytes, id) {
        Err(Error::Section { .. }) => Ok(&[]),
        found => bytemuck::try_cast_slice(found?).map_err(|_| Error::Section { id }),
    }
}

impl<'a, const M: usize, const N: usize> FileOf<'a, M, N> {
    /// Checks a model file and uses it in place, without a copy.
    ///
    /// The bytes must start at an address divisible by 4, see [`crate::include_fpm`]. Costs about 20 instructions
    /// per byte, once.
    ///
    /// # Errors
    /// [`Error::Section`] with `RELX` for a file of tissue that relaxes, which [`Self::relaxing`] reads.
    pub fn from_bytes(bytes: &'a [u8]) -> Result<Self, Error> {
        let file = Self::relaxing(bytes)?;
        if file.model.relaxation().is_some() { Err(Error::Section { id: RELAXATION }) } else { Ok(file) }
    }

    /// The same for those that follow the tissue in time, with a state that relaxes. Also reads files of tissue that does not relax.
    ///
    /// # Errors
    /// Those of [`Self::with_relaxation`] besides.
    pub fn relaxing(bytes: &'a [u8]) -> Result<Self, Error> {
        check_start(bytes)?;
        check_envelope(bytes)?;
        let data = section(bytes, DATA)?;
        let (elements, nodes) = (word(data, 0).unwrap_or(0), word(data, 4).unwrap_or(0));
        if elements as usize != M || nodes as usize != N {
            return Err(Error::Shape { elements, nodes });
        }
        let numbers = data.get(8..).unwrap_or(&[]);
        let data: &DataOf<M, N> = match bytemuck::try_from_bytes(numbers) {
            Ok(data) => data,
            Err(bytemuck::PodCastError::TargetAlignmentGreaterAndInputNotAligned) => return Err(Error::Alignment),
            Err(_) => return Err(too_short(numbers, size_of::<DataOf<M, N>>())),
        };
        let effects = section(bytes, EFFECTS)?;
        let effects: &[EffectSlot] = bytemuck::try_cast_slice(effects).map_err(|_| Error::Section { id: EFFECTS })?;
        for (index, slot) in effects.iter().enumerate() {
            slot.check(index)?;
        }
        let (tables, columns) = (optional(bytes, TABLES)?, optional::<TableColumn>(bytes, COLUMNS)?);
        if columns.len() > OWN {
            return Err(Error::Section { id: COLUMNS });
        }
        columns.iter().try_for_each(TableColumn::check)?;
        let meta = core::str::from_utf8(section(bytes, META)?).map_err(|_| Error::Section { id: META })?;
        let file = Self { model: data.model()?, effects, tables, columns, meta };
        match optional::<Relaxation>(bytes, RELAXATION)? {
            [] => Ok(file),
            [relaxation] => {
                relaxation.check()?;
                file.with_relaxation(relaxation)
            }
            _ => Err(Error::Section { id: RELAXATION }),
        }
    }

    /// The same file with these branches of the tissue; see [`ModelOf::with_relaxation`].
    ///
    /// # Errors
    /// Those of [`ModelOf::with_relaxation`]; [`Error::RelaxesTwice`] for a file with the effect `normal_relaxation`.
    pub fn with_relaxation(self, relaxation: &'a Relaxation) -> Result<Self, Error> {
        let model = self.model.with_relaxation(relaxation)?;
        let has_effect = self.effects.iter().any(|slot| slot.kind == NormalRelaxation::LAW.kind);
        if has_effect && model.relaxation.is_some() { Err(Error::RelaxesTwice) } else { Ok(Self { model, ..self }) }
    }
}

impl<'a, const M: usize, const N: usize> ModelOf<'a, M, N> {
    /// The model of a file, in place; see [`FileOf::from_bytes`].
    pub fn from_bytes(bytes: &'a [u8]) -> Result<Self, Error> {
        Ok(FileOf::from_bytes(bytes)?.model)
    }

    /// Checksum of the numbers and the branches; a saved state contains it. Costs about 20 instructions a byte.
    pub fn checksum(&self) -> u32 {
        let branches = self.relaxation.map_or(0, |relaxation| crc32(bytemuck::bytes_of(relaxation)).rotate_left(2));
        self.data.checksum() ^ branches
    }
}

impl<'a> Sections<'a> {
    /// Letters and bytes of those that a file has.
    fn written(&self) -> impl Iterator<Item = ([u8; 4], &'a [u8])> {
        let relaxation: &[u8] = self.relaxation.map_or(&[], bytemuck::bytes_of);
        let (tables, columns) = (bytemuck::cast_slice(self.tables), bytemuck::cast_slice(self.columns));
        [(TABLES, tables), (COLUMNS, columns), (RELAXATION, relaxation)]
            .into_iter()
            .filter(|(_, bytes)| !bytes.is_empty())
    }
}

/// Writes one piece after another into a buffer.
pub(crate) struct Writer<'a> {
    out: &'a mut [u8],
    at: usize,
}

impl<'a> Writer<'a> {
    pub fn new(out: &'a mut [u8]) -> Self {
        Self { out, at: 0 }
    }

    /// Puts the checksum of a file of this length in its place.
    pub fn seal(self, length: usize) -> usize {
        let checksum = crc32(self.out.get(16..length).unwrap_or(&[]));
        if let Some(slot) = self.out.get_mut(12..16) {
            slot.copy_from_slice(&checksum.to_le_bytes());
        }
        length
    }

    pub fn put(&mut self, bytes: &[u8]) {
        for byte in bytes {
            if let Some(slot) = self.out.get_mut(self.at) {
                *slot = *byte;
            }
            self.at += 1;
        }
    }

    pub fn word(&mut self, value: u32) {
        self.put(&value.to_le_bytes());
    }

    fn float(&mut self, value: f32) {
        self.word(value.to_bits());
    }

    fn align(&mut self) {
        while !self.at.is_multiple_of(8) {
            self.put(&[0]);
        }
    }
}

impl<const M: usize, const N: usize> DataOf<M, N> {
    /// Length of the file that [`DataOf::write_file`] writes, bytes.
    pub fn file_length(effects: &[EffectSlot], meta: &str) -> usize {
        Self::file_length_with(effects, Sections::default(), meta)
    }

    /// Length of the file that [`DataOf::write_file_with`] writes, bytes.
    pub fn file_length_with(effects: &[EffectSlot], sections: Sections<'_>, meta: &str) -> usize {
        let start = (HEADER + (SECTIONS + sections.written().count()) * ENTRY).next_multiple_of(8);
        let data = (8 + size_of::<Self>()).next_multiple_of(8);
        let optional = sections.written().fold(0, |sum, (_, bytes)| sum + bytes.len());
        start + data + size_of_val(effects) + optional + meta.len()
    }

    /// Writes a model file into `out` and returns its length.
    pub fn write_file(&self, effects: &[EffectSlot], meta: &str, out: &mut [u8]) -> Result<usize, Error> {
        self.write_file_with(effects, Sections::default(), meta, out)
    }

    /// The same with optional sections: the tables that slots of the number [`crate::effects::tables::TABLE`] name, their columns, and branches
    /// of the tissue.
    pub fn write_file_with(
        &self,
        effects: &[EffectSlot],
        sections: Sections<'_>,
        meta: &str,
        out: &mut [u8],
    ) -> Result<usize, Error> {
        let needed = Self::file_length_with(effects, sections, meta);
        if out.len() < needed {
            return Err(Error::Buffer { needed: needed as u32 });
        }
        let count = SECTIONS + sections.written().count();
        let start = (HEADER + count * ENTRY).next_multiple_of(8);
        let data_length = 8 + size_of::<Self>();
        let effects_at = start + data_length.next_multiple_of(8);
        let mut w = Writer::new(out);
        w.put(&MAGIC);
        for value in [VERSION, needed as u32, 0, count as u32] {
            w.word(value);
        }
        let mut entry = |id: [u8; 4], at: usize, length: usize| {
            w.put(&id);
            w.word(at as u32);
            w.word(length as u32);
            at + length
        };
        entry(DATA, start, data_length);
        let mut at = entry(EFFECTS, effects_at, size_of_val(effects));
        for (id, bytes) in sections.written() {
            at = entry(id, at, bytes.len());
        }
        entry(META, at, meta.len());
        w.align();
        w.word(M as u32);
        w.word(N as u32);
        for value in self.numbers() {
            w.float(value);
        }
        w.align();
        w.put(bytemuck::cast_slice(effects));
        sections.written().for_each(|(_, bytes)| w.put(bytes));
        w.put(meta.as_bytes());
        Ok(w.seal(needed))
    }

    /// All numbers, in the file's order.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f32> + '_ {
        let head = [
            self.depth_max,
            self.cells_per_mm,
            self.odd,
            self.area_tilt,
            self.pressure_centre_per_n[0],
            self.pressure_centre_per_n[1],
            self.spin_cross,
            self.slip_lead[0],
            self.slip_lead[1],
            self.gyration,
        ];
        let bands =
            self.band_normal.into_iter().chain(self.band_friction).chain([self.pressure_exponent]).chain(self.pose_deg);
        let springs = self.springs.iter().flat_map(|s| {
            let [x, y] = s.arm_mm;
            [s.stiffness, s.sharpness, s.centre_mm, x, y]
        });
        head.into_iter().chain(bands).chain(springs).chain(self.rows.iter().flat_map(crate::build::Row::numbers))
    }

    /// Checksum of the numbers; a saved state of a model without branches contains it. Costs about 20 instructions a byte.
    pub fn checksum(&self) -> u32 {
        self.numbers().fold(0, |sum, x| crc32_on(sum, &x.to_bits().to_le_bytes()))
    }
}

/// The bytes of a model file as a `&'static [u8]` aligned as [`crate::Model::from_bytes`] needs them.
#[macro_export]
macro_rules! include_fpm {
    ($path:expr) => {{
        #[repr(C, align(8))]
        struct Aligned<B: ?Sized>(B);
        static FILE: &Aligned<[u8]> = &Aligned(*include_bytes!($path));
        &FILE.0
    }};
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::{Data, Params};
    use crate::data::NODES;

    #[repr(C, align(8))]
    struct Aligned([u8; 16384]);

    fn example() -> (Aligned, usize) {
        let data = Params::example().try_build().unwrap();
        let mut buffer = Aligned([0; 16384]);
        let effects = [EffectSlot { kind: 1, reserved: 0, values: [0.5; 6] }];
        let n = data.write_file(&effects, "{\"example\":true}", &mut buffer.0).unwrap();
        assert_eq!(n, Data::file_length(&effects, "{\"example\":true}"));
        (buffer, n)
    }

    #[test]
    fn checksum_of_the_standard_test_string() {
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn round_trip() {
        let (buffer, n) = example();
        let file = File::from_bytes(&buffer.0[..n]).unwrap();
        assert_eq!(*file.model.data(), Params::example().try_build().unwrap());
        assert_eq!(file.effects[0].values, [0.5; 6]);
        assert_eq!(file.meta, "{\"example\":true}");
    }

    #[test]
    fn every_truncation_and_every_flipped_byte_is_refused() {
        let (mut buffer, n) = example();
        for length in 0..n {
            assert!(File::from_bytes(&buffer.0[..length]).is_err(), "{length}");
        }
        assert!(File::from_bytes(&buffer.0[..n + 1]).is_err());
        for i in 0..n {
            for flip in [0x01, 0x80, 0xff] {
                buffer.0[i] ^= flip;
                assert!(File::from_bytes(&buffer.0[..n]).is_err(), "{i}");
                buffer.0[i] ^= flip;
            }
        }
        assert!(File::from_bytes(&buffer.0[..n]).is_ok());
    }

    #[test]
    fn columns_come_back_and_those_that_are_not_whole_are_refused() {
        let data = Params::example().try_build().unwrap();
        let columns = [
            TableColumn::new("voltage_v", "V", [0.0, 200.0], 0.0).unwrap(),
            TableColumn::new("frame_temperature_c", "°C", [10.0, 40.0], 22.0).unwrap(),
        ];
        let written = |columns: &[TableColumn]| {
            let mut buffer = Aligned([0; 16384]);
            let sections = Sections { tables: &[1.0, 2.0], columns, ..Sections::default() };
            let n = data.write_file_with(&[], sections, "{}", &mut buffer.0).unwrap();
            assert_eq!(n, Data::file_length_with(&[], sections, "{}"));
            (buffer, n)
        };
        let (buffer, n) = written(&columns);
        let file = File::from_bytes(&buffer.0[..n]).unwrap();
        assert_eq!((file.columns, file.tables), (&columns[..], &[1.0, 2.0][..]));
        assert_eq!((file.columns[1].name(), file.columns[1].unit()), ("frame_temperature_c", "°C"));
        let refused = Err(Error::Section { id: COLUMNS });
        let five = [columns[0]; OWN + 1];
        let (buffer, n) = written(&five);
        assert_eq!(File::from_bytes(&buffer.0[..n]).map(|_| ()), refused);
        let long = core::str::from_utf8(&[b'a'; 32]).unwrap();
        let range = [0.0, 1.0];
        assert!(TableColumn::new(&long[..31], &long[..15], range, 0.0).is_ok());
        for (name, unit, range, reference) in [
            (long, "", range, 0.0),
            ("", "", range, 0.0),
            ("a", &long[..16], range, 0.0),
            ("a\0b", "", range, 0.0),
            ("a", "", [1.0, 0.0], 0.5),
            ("a", "", [0.0, f32::NAN], 0.5),
            ("a", "", range, 2.0),
            ("a", "", range, f32::NAN),
        ] {
            assert_eq!(TableColumn::new(name, unit, range, reference).map(|_| ()), refused, "{name} {unit} {range:?}");
        }
    }

    #[test]
    fn another_shape_is_named() {
        let (buffer, n) = example();
        let error = FileOf::<7, NODES>::from_bytes(&buffer.0[..n]).unwrap_err();
        assert_eq!(error, Error::Shape { elements: crate::SPRINGS as u32, nodes: NODES as u32 });
    }
}
