//! Writes a story of a contact twice: `story.txt`, one request a line, and `answers.txt`, the answers of the core. A
//! binding reads the first and must write the second, bit for bit. `places_*.txt` have the same by places (`places.rs`).
//!
//! `fingerpad-story MODEL.fpm CORRECTED.fpm FOLDER`. The second model is CORRECTED with tables over a voltage, which the folder
//! gets as `charged.fpm`. Beside it lie the first model with tissue that relaxes, `relaxing-bed.fpm`, the pad that ships, `fingertip-pad.fpm`, one of more patches, `halved-pad.fpm`, and both with tissue that relaxes. All numbers
//! are 32-bit words in hexadecimal; `requests.rs` has the requests.

mod answers;
mod charged;
mod pad;
mod paths;
mod places;
mod requests;

use std::fs;
use std::path::Path;

use fingerpad::Relaxation;
use fingerpad::build::{Data, Sections};
use fingerpad::host::{ModelFile, PadModelFile};

use answers::Teller;

/// The pad that ships.
const PAD: &[u8] = include_bytes!("../../../../data/models/fingertip-pad.fpm");
/// Names of the pads beside the other models.
const PAD_NAMES: [&str; 4] = ["fingertip-pad.fpm", "halved-pad.fpm", "relaxing-pad.fpm", "relaxing-halved-pad.fpm"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [shipped, corrected, folder] = &arguments[..] else {
        return Err("usage: fingerpad-story MODEL.fpm CORRECTED.fpm FOLDER".into());
    };
    let read = |path: &String| -> Result<ModelFile, Box<dyn std::error::Error>> {
        ModelFile::new(&fs::read(path)?).map_err(|e| format!("{path}: {e}").into())
    };
    let charged = charged::charged(&read(corrected)?).map_err(|e| format!("{corrected} with tables: {e}"))?;
    fs::write(Path::new(folder).join("charged.fpm"), charged.bytes())?;
    let shipped_pad = PadModelFile::new(PAD).map_err(|e| format!("{}: {e}", PAD_NAMES[0]))?;
    let halved = pad::halved(&shipped_pad).map_err(|e| format!("{}: {e}", PAD_NAMES[1]))?;
    let relaxing = [&shipped_pad, &halved].map(|pad| pad::relaxing(pad).expect("branches within their ranges"));
    let [relaxing_shipped, relaxing_halved] = relaxing;
    let pads = [shipped_pad, halved, relaxing_shipped, relaxing_halved];
    for (name, pad) in PAD_NAMES.iter().zip(&pads) {
        fs::write(Path::new(folder).join(name), pad.bytes())?;
    }
    let files = [read(shipped)?, charged];
    let (file, relaxation) = (files[0].file(), Relaxation::HUMAN_ASSUMED);
    let sections = Sections { relaxation: Some(&relaxation), ..Sections::default() };
    let mut bytes = vec![0; Data::file_length_with(file.effects, sections, file.meta)];
    file.model.data().write_file_with(file.effects, sections, file.meta, &mut bytes)?;
    fs::write(Path::new(folder).join("relaxing-bed.fpm"), bytes)?;
    let story = paths::story(&pads);
    let mut teller = Teller::new(&files, &pads);
    let answers: Vec<String> = story.iter().map(|request| teller.answer(request)).collect();
    let lines: Vec<String> = story.iter().map(ToString::to_string).collect();
    fs::write(Path::new(folder).join("story.txt"), lines.join("\n") + "\n")?;
    fs::write(Path::new(folder).join("answers.txt"), answers.join("\n") + "\n")?;
    for (file, name) in files.iter().zip(["shipped", "charged"]) {
        let clean = places::rows(&paths::clean_story(), file);
        let disturbed = places::rows(&paths::disturbed_story(), file);
        fs::write(Path::new(folder).join(format!("places_clean_{name}.txt")), clean.join("\n") + "\n")?;
        fs::write(Path::new(folder).join(format!("places_disturbed_{name}.txt")), disturbed.join("\n") + "\n")?;
    }
    println!("{} requests, disturbed by the seed {}", story.len(), paths::SEED);
    Ok(())
}
