//! Draws the pictures of README, of the page of the pad and of the reduced model's history.
//!
//! `cargo run --release -p fingerpad-tests --bin pictures -- docs/pictures`

mod history;
mod pad;
mod stick_maps;

use std::path::PathBuf;

use clap::Parser;
use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad_reduce::pad::PadModel;

#[derive(Parser)]
#[command(about = "Draw the pictures of README and of the pages of both models (about two minutes)", name = "pictures")]
struct Args {
    /// Folder to draw into
    folder: PathBuf,
    /// Folder of finite-element runs
    #[arg(long, default_value = "data/runs")]
    runs: PathBuf,
    /// Model file of a pad
    #[arg(long, default_value = "data/models/fingertip-pad.fpm")]
    model: PathBuf,
    /// Model file of a bed of springs
    #[arg(long, default_value = "data/models/fingertip.fpm")]
    bed: PathBuf,
}

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let args = Args::parse();
    let file = PadModelFile::new(&std::fs::read(&args.model)?)?;
    let model = PadModel::of(&file.file().pad);
    std::fs::create_dir_all(&args.folder)?;
    let write = |name: &str, svg: &str| -> Result<(), Failure> {
        let file = args.folder.join(name);
        std::fs::write(&file, svg).map_err(|e| format!("{}: {e}", file.display()))?;
        println!("{}", file.display());
        Ok(())
    };
    let bed = ModelFile::new(&std::fs::read(&args.bed)?)?;
    let history = history::pictures(&bed.file().model, &args.runs)?;
    for (name, svg) in pad::along_runs(&model, &args.runs)?.into_iter().chain(history) {
        write(name, &svg)?;
    }
    write("stick-core.svg", &stick_maps::slide()?)?;
    write("pad-stick.svg", &stick_maps::spin(&model)?)
}
