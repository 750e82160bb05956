//! The program `fingerpad`: parse, call one library function, print. The only home of anyhow; exit codes are set here.
//!
//! Main function: [`run`], which the program and the Python package call.

/// Prints as the standard library's macro does, but a closed pipe (`| head`) does not end the work.
macro_rules! print {
    ($($what:tt)*) => { $crate::say(&mut std::io::stdout(), format_args!($($what)*)) };
}

/// As `print`, with the line's end.
macro_rules! println {
    () => { print!("\n") };
    ($($what:tt)*) => { print!("{}\n", format_args!($($what)*)) };
}

/// As `println`, to standard error.
macro_rules! eprintln {
    ($($what:tt)*) => { $crate::say(&mut std::io::stderr(), format_args!("{}\n", format_args!($($what)*))) };
}

mod against_shipped;
mod build;
mod conditions;
mod config;
mod confirm;
mod diagnose;
mod eval;
mod export;
mod finger;
mod help;
mod hold;
mod identify;
mod interrupt;
mod mesh;
mod model;
mod observe;
mod outputs;
mod phantom;
mod plausibility;
mod probes;
mod progress;
mod provenance;
mod results;
mod rigid_body;
mod simulate;
mod tip_flags;

use std::{
    ffi::OsString,
    fmt,
    io::{self, Write as _},
    path::{Path, PathBuf},
};

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand, ValueEnum};
use config::ConfigFile;
use fingerpad_fe::experiment::{Config, ConfigError};
use fingerpad_fe::load_path::{self, Finger, LoadPathError};
use fingerpad_fe::mesh::{FirstTouch, MeshPreset};
use interrupt::{go_on, keeping};
use outputs::{Mark, Outputs};
use progress::{Bar, Bars, bar, show};

/// Fingertip friction: finite-element contact of a soft finger on a rigid plane, with the rubber friction law
/// tau_crit = tau_0 + lambda sigma^beta. Units: mm, N, s, MPa.
#[derive(Parser)]
#[command(name = "fingerpad", version, max_term_width = 110)]
#[command(
    after_help = "Exit codes: 0 done, 2 bad usage or input, 3 the numerics failed, 4 a model was made and is not good enough, \
                  130 interrupted."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// The main job: mesh, press and slide at the measured depths, report
    Build(Box<build::Args>),
    /// Calibrate the finger on a measured table and identify the friction law
    Identify(Box<identify::Args>),
    /// Follow a path of the plane with the finite-element model
    Simulate(Box<simulate::Args>),
    /// Name the physical effect that measured runs show and the model does not contain
    Diagnose(Box<diagnose::Args>),
    /// Write the fingertip's mesh, or the whole problem for another program
    Mesh(mesh::Args),
    /// Make the models of your finger: runs, fits, report; a bed in another pose; another size or stiffness
    Finger(Box<finger::Args>),
    /// Follow a path of the plane with the reduced model
    Eval(eval::Args),
    /// Write a model as a Rust constant, a C array or JSON
    Export(export::Args),
    /// Write the parametric fingertip as a labelled volume, to test the import of a scan
    Phantom(phantom::Args),
}

/// Settings that every command with a finite-element model takes.
#[derive(clap::Args)]
struct Model {
    /// Configuration file (TOML); absent keys have their defaults. Or a finger that ships: human (the default), human-stiffening
    #[arg(long, value_name = "NAME|F.toml")]
    config: Option<PathBuf>,
    /// Shape: a, b, d, e, base, a geometry file, or dimensions in mm (dome:RADIUS,CORE, flat:LENGTH,WIDTH,THICKNESS)
    #[arg(long, value_name = "NAME|F.toml")]
    shape: Option<String>,
    /// Labelled volume (.nrrd, .nii, .nii.gz) in place of a shape; its settings are under [volume] in --config
    #[arg(long, value_name = "FILE", conflicts_with = "shape")]
    volume: Option<PathBuf>,
    /// Mesh of another program (.inp, .msh) in place of a shape; its settings are under [imported] in --config
    #[arg(long, value_name = "FILE", conflicts_with_all = ["shape", "volume"])]
    imported: Option<PathBuf>,
    /// Resolution of the mesh
    #[arg(long, value_name = "PRESET")]
    mesh_preset: Option<Preset>,
    #[command(flatten)]
    tip: tip_flags::TipFlags,
}

#[derive(Clone, Copy, ValueEnum)]
enum Preset {
    /// About 2 300 nodes
    Coarse,
    /// About 11 000 nodes
    Medium,
    /// The medium mesh with the faces of the pad halved
    Default,
    /// About 58 000 nodes
    Fine,
}

impl Model {
    /// The files that a configuration names, with the flags that replace them.
    fn inputs<'a>(&'a self, config: &'a Config) -> [(&'static str, Option<&'a Path>); 4] {
        [
            ("--config", self.config.as_deref()),
            ("--shape", Some(Path::new(&config.shape.0))),
            ("--volume", config.volume.as_ref().map(|v| v.file.as_path())),
            ("--imported", config.imported.as_ref().map(|i| i.file.as_path())),
        ]
    }

    /// Settings of the finite elements, on a plane.
    fn config(&self) -> Result<Config, Failure> {
        Ok(self.settings()?.0)
    }

    /// Settings of the finite elements, the identification and the design of experiments, on a plane.
    fn settings(&self) -> Result<config::Sections, Failure> {
        let sections = self.settings_of_relaxing()?;
        if sections.0.tissue.relaxation.is_some() {
            return Err(Failure::Input(anyhow::anyhow!(
                "tissue.relaxation: this command takes relaxed tissue only (\"none\"); `simulate`, `finger` and, with a model, \
                 `eval` follow tissue that relaxes"
            )));
        }
        Ok(sections)
    }

    /// The same with tissue that may relax.
    fn settings_of_relaxing(&self) -> Result<config::Sections, Failure> {
        let sections = self.settings_on_any_body()?;
        if !sections.0.rigid_body.is_plane() {
            let file = self.config.as_deref().unwrap_or(Path::new("")).display();
            return Err(Failure::Input(anyhow::anyhow!(
                "{file}: rigid_body: this command supports the plane only; `simulate` supports other bodies"
            )));
        }
        let ratio = sections.0.friction.across_over_along;
        if ratio != 1.0 {
            return Err(Failure::Input(anyhow::anyhow!(
                "friction.across_over_along = {ratio}: this command supports isotropic friction only (1); `simulate` and, with a \
                 pad, `eval` support orthotropic friction"
            )));
        }
        Ok(sections)
    }

    /// The same on any rigid body, with any friction.
    fn settings_on_any_body(&self) -> Result<config::Sections, Failure> {
        let (mut config, identify, design) = match &self.config {
            Some(path) => ConfigFile::read(path)?,
            None => Default::default(),
        };
        if let Some(shape) = &self.shape {
            config.shape.0 = shape.clone();
            (config.volume, config.imported) = (None, None);
        }
        if let Some(file) = &self.volume {
            config.volume.get_or_insert_default().file = file.clone();
            config.imported = None;
        }
        if let Some(file) = &self.imported {
            config.imported.get_or_insert_default().file = file.clone();
            config.volume = None;
        }
        match self.mesh_preset {
            Some(Preset::Coarse) => config.mesh_preset = MeshPreset::Coarse,
            Some(Preset::Medium) => config.mesh_preset = MeshPreset::Medium,
            Some(Preset::Default) => config.mesh_preset = MeshPreset::Default,
            Some(Preset::Fine) => config.mesh_preset = MeshPreset::Fine,
            None => {}
        }
        self.tip.put(&mut config, self.config.is_some())?;
        plausibility::warn_of_stiffness(&config.tissue);
        Ok((config, identify, design))
    }
}

/// Most threads that `--jobs` takes: more than any machine has that this program was made for.
const MOST_JOBS: usize = 1024;

/// A number of threads.
fn jobs(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(jobs @ 1..=MOST_JOBS) => Ok(jobs),
        _ => Err(format!("must be a whole number from 1 to {MOST_JOBS}")),
    }
}

/// Why a command ended, as an exit code.
#[derive(Debug)]
enum Failure {
    /// Bad usage or input: 2.
    Input(anyhow::Error),
    /// The numerics failed: 3.
    Numerics(anyhow::Error),
    /// A model was made and is not good enough: 4.
    NotGoodEnough(String),
    /// Ctrl-C: 130.
    Interrupted(String),
}

impl From<ConfigError> for Failure {
    fn from(error: ConfigError) -> Self {
        Self::Input(error.into())
    }
}

impl From<fingerpad_formats::Error> for Failure {
    fn from(error: fingerpad_formats::Error) -> Self {
        Self::Input(error.into())
    }
}

pub use progress::line_every;

/// Runs the program in this process, whose signals it takes from then on; returns the exit code.
///
/// * `words`: the command line, the program's name first
///
/// Help, bad usage and a second Ctrl-C end the process.
pub fn run(words: impl IntoIterator<Item = OsString>) -> u8 {
    let words = diagnose::with_subcommand(words.into_iter().collect());
    let matches = help::laid_out(Cli::command()).get_matches_from(words);
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    interrupt::handle_signals();
    let result = match cli.command {
        Command::Build(args) => build::run(&args),
        Command::Identify(args) => identify::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Diagnose(args) => diagnose::run(&args),
        Command::Mesh(args) => mesh::run(&args),
        Command::Finger(args) => finger::run(&args),
        Command::Eval(args) => eval::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Phantom(args) => phantom::run(&args),
    };
    match result {
        Ok(()) => 0,
        Err(Failure::Input(error)) => {
            eprintln!("error: {}", with_causes(&error));
            2
        }
        Err(Failure::Numerics(error)) => {
            eprintln!("error: {}", with_causes(&error));
            3
        }
        Err(Failure::NotGoodEnough(what)) => {
            eprintln!("error: {what}");
            4
        }
        Err(Failure::Interrupted(kept)) => {
            eprintln!("interrupted: {kept}");
            interrupt::EXIT_CODE
        }
    }
}

/// An error with its causes, each printed once: the text of many errors already contains their cause.
fn with_causes(error: &anyhow::Error) -> String {
    let mut text = error.to_string().trim_end().to_owned();
    for cause in error.chain().skip(1) {
        let cause = cause.to_string();
        if !text.contains(cause.trim_end()) {
            text = format!("{text}: {}", cause.trim_end());
        }
    }
    text
}

/// Writes to a standard stream. A closed pipe is ignored; any other error, such as a full disk behind a redirection,
/// ends the program with exit code 2.
fn say(stream: &mut dyn io::Write, text: fmt::Arguments) {
    if let Err(error) = stream.write_fmt(text).and_then(|()| stream.flush())
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        // Standard error may be the stream that failed.
        let _ = writeln!(io::stderr(), "error: standard output: {error}");
        std::process::exit(2);
    }
}

/// Mesh and body of a configuration; a volume takes some seconds.
fn make_finger(config: &Config) -> Result<(Finger, FirstTouch), ConfigError> {
    progress::during("mesh", |_| config.finger())
}

/// The same with a pad of the surface that these paths may touch.
fn make_finger_for(config: &Config, paths: &[&load_path::Path]) -> Result<(Finger, FirstTouch), ConfigError> {
    progress::during("mesh", |_| config.finger_for(paths))
}

/// Factors on the pad's height, tried in turn if skin beside the pad reached the plane.
const LARGER_PADS: [f64; 2] = [1.5, 2.5];

/// As [`make_finger_for`] one path, with a pad that reaches `factor` times as high.
fn make_finger_reaching(config: &Config, path: &load_path::Path, factor: f64) -> Result<Finger, ConfigError> {
    Ok(progress::during("mesh", |_| config.finger_reaching(&[path], factor))?.0)
}

/// A failed run as a failure; `kept` names the saved results.
fn run_failure(error: LoadPathError, what: &str, kept: String) -> Failure {
    match error {
        LoadPathError::Interrupted { .. } => Failure::Interrupted(kept),
        LoadPathError::Path(_) | LoadPathError::Checkpoint(_) => {
            Failure::Input(anyhow::Error::new(error).context(what.to_owned()))
        }
        LoadPathError::NoEquilibrium { .. }
        | LoadPathError::BeyondFriction { .. }
        | LoadPathError::BeyondFrictionMoment { .. }
        | LoadPathError::NotClear { .. }
        | LoadPathError::InsideOut { .. }
        | LoadPathError::BesidePad { .. } => {
            Failure::Numerics(anyhow::Error::new(error).context(format!("{what} ({kept})")))
        }
    }
}
