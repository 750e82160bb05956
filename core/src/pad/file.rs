//! The model file of a pad: checked once, then used in place.
//!
//! Main type: [`PadFile`]. Uses data and the envelope of model files.

use crate::build::{MAGIC, VERSION};
use crate::error::Field;
use crate::model_file::{Writer, check_envelope, check_start, section, word};
use crate::sections::RELAXATION;
use crate::{Error, Relaxation};

use super::{MODES, Numbers, Orthotropy, Pad, Patch};

const NUMBERS: [u8; 4] = *b"PADN";
const PATCHES: [u8; 4] = *b"PADP";
const META: [u8; 4] = *b"META";
/// Orthotropic friction; only in files of a finger that has it.
const ORTHOTROPY: [u8; 4] = *b"ORTH";
/// Largest magnitude of a number of a pad; far above those of any finger.
const LARGEST: f32 = 1e6;

/// Contents of a pad's model file, read in place.
#[derive(Clone, Copy, Debug)]
pub struct PadFile<'a> {
    /// The pad.
    pub pad: Pad<'a>,
    /// Provenance: JSON with ranges, hash of the settings, and versions.
    pub meta: &'a str,
}

impl<'a> PadFile<'a> {
    /// Checks a pad's model file and uses it in place, without a copy.
    ///
    /// The bytes must start at an address divisible by 4, see [`crate::include_fpm`]. Costs about 20 instructions per byte, once.
    ///
    /// # Errors
    /// As [`crate::FileOf::from_bytes`]; [`Error::Section`] with `PADN` for the model file of a bed.
    pub fn from_bytes(bytes: &'a [u8]) -> Result<Self, Error> {
        check_start(bytes)?;
        check_envelope(bytes)?;
        let numbers = section(bytes, NUMBERS)?;
        let modes = word(numbers, 0).unwrap_or(0);
        if modes as usize != MODES {
            return Err(Error::Shape { elements: modes, nodes: 0 });
        }
        let numbers: &Numbers =
            bytemuck::try_from_bytes(numbers.get(4..).unwrap_or(&[])).map_err(|_| Error::Section { id: NUMBERS })?;
        let patches: &[Patch] =
            bytemuck::try_cast_slice(section(bytes, PATCHES)?).map_err(|_| Error::Section { id: PATCHES })?;
        let meta = core::str::from_utf8(section(bytes, META)?).map_err(|_| Error::Section { id: META })?;
        let relaxation = optional(bytes, RELAXATION)?.unwrap_or_else(Relaxation::none).check()?;
        let orthotropy = optional(bytes, ORTHOTROPY)?.unwrap_or_else(Orthotropy::isotropic).check()?;
        let pad = Pad::new(patches, numbers).with_relaxation(relaxation).with_orthotropy(orthotropy);
        pad.check()?;
        Ok(Self { pad, meta })
    }
}

const MODES_WORD: [u8; 4] = (MODES as u32).to_le_bytes();

/// Whether a section enters the file.
fn is_written((id, [head, _]): &([u8; 4], [&[u8]; 2])) -> bool {
    !head.is_empty() || !matches!(*id, RELAXATION | ORTHOTROPY)
}

/// The numbers of a section that a file may lack.
fn optional<N: bytemuck::Pod>(bytes: &[u8], id: [u8; 4]) -> Result<Option<N>, Error> {
    match section(bytes, id) {
        Err(Error::Section { .. }) => Ok(None),
        found => bytemuck::try_pod_read_unaligned(found?).map(Some).map_err(|_| Error::Section { id }),
    }
}

impl Pad<'_> {
    /// The sections of a file, each in two parts. Those that a finger may lack are empty where it does.
    fn sections<'a>(&'a self, modes: &'a [u8], meta: &'a str) -> [([u8; 4], [&'a [u8]; 2]); 5] {
        let relaxation = if self.relaxation.is_some() { bytemuck::bytes_of(&self.relaxation) } else { &[] };
        let orthotropy = if self.orthotropy.is_some() { bytemuck::bytes_of(&self.orthotropy) } else { &[] };
        [
            (NUMBERS, [modes, bytemuck::bytes_of(self.numbers)]),
            (PATCHES, [bytemuck::cast_slice(self.patches), &[]]),
            (RELAXATION, [relaxation, &[]]),
            (ORTHOTROPY, [orthotropy, &[]]),
            (META, [meta.as_bytes(), &[]]),
        ]
    }

    /// Length of the file that [`Pad::write_file`] writes, bytes.
    pub fn file_length(&self, meta: &str) -> usize {
        let written = self.sections(&MODES_WORD, meta).into_iter().filter(is_written);
        written.fold(20, |sum, (_, [head, rest])| sum + 12 + head.len() + rest.len())
    }

    /// Writes a model file into `out` and returns its length.
    ///
    /// # Errors
    /// [`Error::Buffer`] if `out` is shorter than [`Pad::file_length`].
    pub fn write_file(&self, meta: &str, out: &mut [u8]) -> Result<usize, Error> {
        let needed = self.file_length(meta);
        if out.len() < needed {
            return Err(Error::Buffer { needed: needed as u32 });
        }
        let sections = self.sections(&MODES_WORD, meta);
        let count = sections.iter().filter(|section| is_written(section)).count();
        let mut w = Writer::new(out);
        w.put(&MAGIC);
        for value in [VERSION, needed as u32, 0, count as u32] {
            w.word(value);
        }
        let mut at = 20 + count * 12;
        for (id, [head, rest]) in sections.into_iter().filter(is_written) {
            let length = head.len() + rest.len();
            w.put(&id);
            w.word(at as u32);
            w.word(length as u32);
            at += length;
        }
        sections.iter().flat_map(|(_, parts)| parts).for_each(|part| w.put(part));
        Ok(w.seal(needed))
    }

    /// Refuses numbers outside their ranges: with them a pad could yield work or return values that are not finite.
    ///
    /// # Errors
    /// [`Error::Range`] with the number.
    pub fn check(&self) -> Result<(), Error> {
        let refuse = |what, index: usize, value| Err(Error::Range { what, index: index as u16, value });
        let all = |what, values: &mut dyn Iterator<Item = f32>, [least, most]: [f32; 2]| {
            for (index, value) in values.enumerate() {
                if !(value >= least && value <= most) {
                    return refuse(what, index, value);
                }
            }
            Ok(())
        };
        let (signed, positive) = ([-LARGEST, LARGEST], [1e-9, LARGEST]);
        let Numbers { law, .. } = self.numbers;
        let bounded = |rows: &[[f32; MODES]]| rows.iter().flatten().all(|x| x.abs() <= LARGEST);
        for (index, patch) in self.patches.iter().enumerate() {
            let place = patch.middle_mm.iter().all(|x| x.abs() <= LARGEST);
            let spread = patch.spread_mm.iter().all(|x| x.abs() <= LARGEST);
            if !(patch.area_mm2 >= 1e-4 && patch.area_mm2 <= LARGEST) {
                return refuse(Field::PatchArea, index, patch.area_mm2);
            }
            if !place || !spread {
                return refuse(Field::PatchPlace, index, patch.middle_mm[0]);
            }
            for compliance in patch.compliance_mm_per_n {
                if !(1e-4..=LARGEST).contains(&compliance) {
                    return refuse(Field::PatchCompliance, index, compliance);
                }
            }
            // A step leaves out patches that this bound keeps out of contact.
            if !bounded(&patch.modes) || !(patch.reach() <= self.numbers.reach * 1.001) {
                return refuse(Field::BulkMode, index, f32::NAN);
            }
        }
        if self.patches.is_empty() {
            return Err(Error::Section { id: PATCHES });
        }
        if !bounded(&self.numbers.rigid) {
            return refuse(Field::BulkMode, self.patches.len(), f32::NAN);
        }
        all(Field::BulkMode, &mut core::iter::once(self.numbers.reach), positive)?;
        all(Field::BulkStiffening, &mut self.numbers.squash.iter().copied(), signed)?;
        all(
            Field::BulkStiffening,
            &mut (0..MODES).map(|k| self.numbers.squash.get(k * (k + 3) / 2).copied().unwrap_or(f32::NAN)),
            [0.0, LARGEST],
        )?;
        all(
            Field::FirstTouch,
            &mut self.numbers.first_touch_mm.iter().chain(&self.numbers.middle_mm).copied(),
            signed,
        )?;
        all(Field::BulkStiffness, &mut law.softness.iter().copied(), [0.05, 20.0])?;
        all(Field::BulkStiffening, &mut law.stiffening.iter().copied(), [0.0, LARGEST])?;
        all(Field::Flattening, &mut law.flattening_mpa.iter().copied(), positive)?;
        all(Field::ContactArea, &mut law.area.iter().copied(), [1e-3, 1e3])?;
        all(Field::Lambda, &mut law.friction[..1].iter().copied(), positive)?;
        all(Field::PressureExponent, &mut law.friction[1..].iter().copied(), [1e-3, 1.0])?;
        all(Field::Sharpness, &mut core::iter::once(law.onset), [1e-3, 1e3])?;
        all(Field::Lift, &mut law.lift.iter().flatten().copied().chain([law.turn]), signed)?;
        let Numbers { band_normal, band_friction, band_body, band_deep, band_light_n, .. } = self.numbers;
        let added = |k: usize| [band_body[k], band_deep[k], band_light_n[0][k], band_light_n[1][k]];
        all(Field::BandNormal, &mut band_normal.iter().flatten().copied().chain(added(0)), signed)?;
        all(Field::BandFriction, &mut band_friction.iter().flatten().copied().chain(added(1)), signed)?;
        let [least, most] = self.numbers.pitch_range_deg;
        all(Field::Pose, &mut [least, most, self.numbers.neutral_pitch_deg].into_iter(), [-90.0, 90.0])?;
        all(Field::Pose, &mut core::iter::once(self.numbers.roll_max_deg), [0.0, 60.0])?;
        if !(least <= most) {
            return refuse(Field::Pose, 0, least);
        }
        all(Field::DepthMax, &mut core::iter::once(self.numbers.depth_max_mm), positive)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pad::ExamplePad;

    #[repr(C, align(8))]
    struct Aligned([u8; 16384]);

    fn written(example: &ExamplePad) -> (std::boxed::Box<Aligned>, usize) {
        let mut buffer = std::boxed::Box::new(Aligned([0; 16384]));
        let length = example.pad().write_file("{\"example\":true}", &mut buffer.0).unwrap();
        assert_eq!(length, example.pad().file_length("{\"example\":true}"));
        (buffer, length)
    }

    #[test]
    fn round_trip() {
        let example = ExamplePad::new();
        let (buffer, length) = written(&example);
        let file = PadFile::from_bytes(&buffer.0[..length]).unwrap();
        assert_eq!(file.pad.patches, example.patches);
        assert_eq!(*file.pad.numbers, example.numbers);
        assert_eq!(file.meta, "{\"example\":true}");
        // The reader of a bed's file names the section that is missing.
        assert_eq!(crate::File::from_bytes(&buffer.0[..length]).map(|_| ()), Err(Error::Section { id: *b"DATA" }));
    }

    #[test]
    fn orthotropic_friction_is_a_section_of_its_own_and_its_numbers_are_checked() {
        let example = ExamplePad::new();
        let isotropic = example.pad().file_length("{}");
        for (ratio, axis_deg, refused) in
            [(0.7, 30.0, None), (0.05, 30.0, Some((0, 0.05))), (f32::NAN, 0.0, None), (0.7, 181.0, Some((1, 181.0)))]
        {
            let made = Orthotropy::new(ratio, axis_deg);
            let Ok(orthotropy) = made else {
                let Err(Error::Range { what: Field::Orthotropy, index, value }) = made else { panic!("{made:?}") };
                assert!(ratio.is_nan() && index == 0 && value.is_nan() || refused == Some((index, value)));
                continue;
            };
            let mut buffer = std::boxed::Box::new(Aligned([0; 16384]));
            let length = example.pad().with_orthotropy(orthotropy).write_file("{}", &mut buffer.0).unwrap();
            assert!(length == isotropic + 12 + 8 && refused.is_none());
            assert_eq!(*PadFile::from_bytes(&buffer.0[..length]).unwrap().pad.orthotropy(), orthotropy);
        }
    }

    #[test]
    fn every_truncation_and_flipped_byte_is_refused() {
        let (mut buffer, length) = written(&ExamplePad::new());
        for short in (0..length).step_by(7) {
            assert!(PadFile::from_bytes(&buffer.0[..short]).is_err(), "{short}");
        }
        for at in (0..length).step_by(3) {
            buffer.0[at] ^= 0x41;
            assert!(PadFile::from_bytes(&buffer.0[..length]).is_err(), "{at}");
            buffer.0[at] ^= 0x41;
        }
        assert!(PadFile::from_bytes(&buffer.0[..length]).is_ok());
    }

    #[test]
    fn numbers_out_of_range_are_refused_by_name() {
        let refused = |change: &dyn Fn(&mut ExamplePad)| {
            let mut example = ExamplePad::new();
            change(&mut example);
            let (buffer, length) = written(&example);
            match PadFile::from_bytes(&buffer.0[..length]) {
                Err(Error::Range { what, index, .. }) => (what, index),
                other => panic!("{:?}", other.map(|_| ())),
            }
        };
        assert_eq!(refused(&|e| e.patches[3].area_mm2 = -1.0), (Field::PatchArea, 3));
        assert_eq!(refused(&|e| e.patches[2].compliance_mm_per_n[1] = 0.0), (Field::PatchCompliance, 2));
        assert_eq!(refused(&|e| e.patches[5].modes[1][4] = f32::NAN), (Field::BulkMode, 5));
        assert_eq!(refused(&|e| e.numbers.reach *= 0.9), (Field::BulkMode, 0));
        assert_eq!(refused(&|e| e.patches[1].spread_mm[3] = f32::NEG_INFINITY), (Field::PatchPlace, 1));
        assert_eq!(refused(&|e| e.numbers.law.friction[1] = 1.5), (Field::PressureExponent, 0));
        assert_eq!(refused(&|e| e.numbers.law.softness[1] = f32::INFINITY), (Field::BulkStiffness, 1));
        assert_eq!(refused(&|e| e.numbers.squash[2] = -0.1), (Field::BulkStiffening, 1));
        assert_eq!(refused(&|e| e.numbers.pitch_range_deg = [60.0, 10.0]), (Field::Pose, 0));
    }
}
