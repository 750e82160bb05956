//! The model file as documented: the document's vectors are run.

use crate::common::vectors::{aligned, words};
use fingerpad::build::{Data, Params};
use fingerpad::{Error, File, Motion, State, step};

const DOCUMENT: &str = include_str!("../../docs/fpm-format.md");
const SHIPPED: &[u8] = include_bytes!("../data/fingertip.fpm");

/// The text of the document's block of that kind.
fn block(kind: &str) -> &'static str {
    let start = DOCUMENT.find(&format!("```{kind}\n")).unwrap() + kind.len() + 4;
    &DOCUMENT[start..start + DOCUMENT[start..].find("```").unwrap()]
}

#[test]
fn the_shipped_file_reads_and_writes_back() {
    let file = aligned(SHIPPED);
    let bytes = &bytemuck::cast_slice::<u64, u8>(&file)[..SHIPPED.len()];
    let read = File::from_bytes(bytes).unwrap();
    let data = *read.model.data();
    let mut again = vec![0; Data::file_length(read.effects, read.meta)];
    data.write_file(read.effects, read.meta, &mut again).unwrap();
    assert_eq!(again, SHIPPED);
    let hex: String = block("hex").split_whitespace().collect();
    let start: String = SHIPPED[..64].iter().map(|b| format!("{b:02x}")).collect();
    assert_eq!(hex, start);
    assert_eq!(File::from_bytes(&bytes[1..]).unwrap_err(), Error::Alignment);
    let mut old = aligned(SHIPPED);
    bytemuck::cast_slice_mut::<u64, u8>(&mut old)[4] = 3;
    let old = File::from_bytes(&bytemuck::cast_slice::<u64, u8>(&old)[..SHIPPED.len()]).unwrap_err();
    assert_eq!(old, Error::Version { found: 3 });
    assert!(old.to_string().contains("version 3; this library reads version 10"), "{old}");
}

#[test]
fn the_documents_vectors() {
    let file = aligned(SHIPPED);
    let model = File::from_bytes(&bytemuck::cast_slice::<u64, u8>(&file)[..SHIPPED.len()]).unwrap().model;
    let mut state = State::default();
    let mut lines = 0;
    for line in block("vectors").lines() {
        let (input, output) = line.split_once(" | ").unwrap();
        let input: Vec<f32> = input.split(' ').map(|w| w.parse().unwrap()).collect();
        let output: Vec<&str> = output.split(' ').collect();
        let motion = Motion {
            depth_mm: input[0],
            slide_increment_mm: [input[1], input[2]],
            spin_increment_rad: 0.0,
            dt_s: 1e-3,
        };
        let r = step(&model, &mut state, motion);
        let expected: Vec<u32> = output[..9].iter().map(|w| u32::from_str_radix(w, 16).unwrap()).collect();
        assert_eq!(words(&r)[..], expected[..], "{line}");
        assert_eq!(r.regime as u32, output[9].parse::<u32>().unwrap());
        assert_eq!(r.status.0, output[10].parse::<u32>().unwrap());
        lines += 1;
    }
    assert_eq!(lines, 8);
}

#[test]
fn the_documents_digest() {
    let file = aligned(SHIPPED);
    let model = File::from_bytes(&bytemuck::cast_slice::<u64, u8>(&file)[..SHIPPED.len()]).unwrap().model;
    let digest = format!("have the digest `{:x}`", crate::common::golden::digest(&model, 1_000_000));
    assert!(DOCUMENT.contains(&digest), "the steps {digest}, the document has another");
}

/// A file whose numbers were changed and whose checksum was made right again is still looked at.
#[test]
fn a_forged_file_is_checked() {
    let mut data = Params::example().try_build().unwrap();
    data.rows[7].limit.value = -1.0;
    let mut bytes = vec![0; Data::file_length(&[], "")];
    data.write_file(&[], "", &mut bytes).unwrap();
    let file = aligned(&bytes);
    let bytes = &bytemuck::cast_slice::<u64, u8>(&file)[..bytes.len()];
    assert!(matches!(File::from_bytes(bytes), Err(Error::Range { .. })), "{:?}", File::from_bytes(bytes).err());
    data.rows[7].limit.value = f32::NAN;
    assert!(data.check().is_err());
}
