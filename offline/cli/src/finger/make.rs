//! `fingerpad finger make`: from a geometry to the model files of a pad and of a bed of springs, in one command.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::ValueEnum;
use fingerpad::Relaxation;
use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad_fe::contact::Outline;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::material::relaxation;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_identify::population::Share;
use fingerpad_reduce::pad::{FitLimits, MadePad, PadMeta, PadSettings, PadSize, runs_for_bed};
use fingerpad_reduce::{
    self as reduce, COLUMNS, DesignSettings, Experiment, GOOD, Grade, Group, Kind, ReduceError, Reduced, Run, Settings,
    Tip, Verdict,
};

use super::full_slips::FullSlips;
use super::springs::{fit, read_runs, representable};
use super::{pad, page, runs, springs};
use crate::against_shipped::meta_of;
use crate::progress::during;
use crate::{Failure, Model, Outputs, make_finger};

/// Make the model files of your finger: finite-element runs, a pad, a bed of springs, a report
#[derive(clap::Args)]
#[group(id = "make")]
pub struct Args {
    /// Folder for runs, pad.fpm, model.fpm and report
    #[arg(long, value_name = "DIR", required = true)]
    out: Option<PathBuf>,
    /// Which motions are run
    #[arg(long, value_name = "DESIGN", default_value = "quick")]
    design: Design,
    /// Folder of the runs [default: runs in --out; with --design stored those that ship with the program, on the medium mesh]
    #[arg(long, value_name = "DIR")]
    runs: Option<PathBuf>,
    /// Run the K-th of N shares of the design only, which cost about the same, and stop
    #[arg(long, value_name = "K/N")]
    task: Option<Share>,
    /// Run nothing: list the paths of the design, or of a share, that are missing
    #[arg(long)]
    check: bool,
    /// Print the number of runs and an estimate of their time, and stop
    #[arg(long)]
    estimate: bool,
    /// Make one of the models only
    #[arg(long, value_name = "MODEL")]
    only: Option<Only>,
    /// Write the models also if they are not usable in the neutral pose
    #[arg(long)]
    accept: bool,
    /// Patches of the pad, nearly: they come in mirrored pairs
    #[arg(long, value_name = "N", default_value_t = 37, value_parser = pad::patches)]
    patches: usize,
    /// Runs that the pad is fitted to, shared out over the kinds of motion by their number; each kind gives at least 15 % of
    /// N. All that are not held out give the bands
    #[arg(long, value_name = "N", default_value_t = 80)]
    fit_runs: usize,
    /// Patience of the pad's fit: evaluations for each number at most
    #[arg(long, value_name = "N", default_value_t = 20)]
    patience: usize,
    /// Fits of the bed from beside the best one so far; the best on the paths of the fit is kept [default: 0 for few runs, else 1]
    #[arg(long, value_name = "N")]
    restarts: Option<usize>,
    /// Fit beds of other numbers of elements and table nodes as well, for the report's curve of accuracy against cost
    #[arg(long)]
    curve: bool,
    /// Branches of the soft tissue in place of tissue.relaxation; the models then have those of the finger's force
    #[arg(long, value_name = "BRANCHES", value_parser = relaxation::parse)]
    relaxation: Option<Relaxation>,
    #[command(flatten)]
    model: Model,
    /// Threads; each path runs on one [default: the machine's]
    #[arg(long, value_name = "N", value_parser = crate::jobs)]
    jobs: Option<usize>,
}

/// Size of the design.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Design {
    /// Some twenty paths
    Quick,
    /// Every kind of motion, 483 paths: minutes on the coarse mesh, hours on the default one
    Full,
    /// None: the runs that are there
    Stored,
}

/// Which model is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Only {
    /// The pad
    Pad,
    /// The bed of springs
    Bed,
}

/// CPU time of a design over that which the time of a press gives.
const HARDER: f64 = 1.2;

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    // A verb has its own options.
    let Some(out) = &args.out else { return Err(Failure::Input(anyhow!("--out is missing"))) };
    let (mut config, _, ranges) = args.model.settings_of_relaxing()?;
    // All runs are of relaxed tissue.
    let tissue = std::mem::replace(&mut config.tissue.relaxation, Relaxation::none());
    let tissue = args.relaxation.unwrap_or(tissue);
    let is_shipped = args.design == Design::Stored && args.runs.is_none();
    if is_shipped && args.model.mesh_preset.is_none() {
        // The mesh of the runs that ship.
        config.mesh_preset = MeshPreset::Medium;
    }
    let hash = reduce::settings_hash(&config)?;
    let files = [out.join("pad.fpm"), out.join("model.fpm")];
    check(&files[1], "model", &hash, hash_of_bed).map_err(Failure::Input)?;
    check(&files[0], "pad", &hash, hash_of_pad).map_err(Failure::Input)?;
    let (finger, _) = make_finger(&config)?;
    let ranges = ranges.for_tip(Tip::of(&finger, &config.tissue, &config.friction)?);
    let settings = match args.design {
        Design::Quick if ranges.paths == DesignSettings::default().paths => ranges.clone().quick(),
        Design::Full if ranges.paths == DesignSettings::default().paths => ranges.clone().beyond_springs(),
        _ => ranges.clone(),
    };
    let outputs = || Outputs::beside(args.model.inputs(&config)).folder("--out", out, &[]);
    let folder = if is_shipped { None } else { Some(args.runs.clone().unwrap_or_else(|| out.join("runs"))) };
    let share = args.task.unwrap_or(Share::ALL);
    match (args.design, &folder) {
        (Design::Stored, _) if args.task.is_some() || args.check || args.estimate => {
            return Err(Failure::Input(anyhow!(
                "--design stored runs nothing: leave out --task, --check and --estimate"
            )));
        }
        (Design::Quick | Design::Full, Some(folder)) => {
            if args.check {
                return runs::check(&config, &settings, folder, share);
            }
            runs::check_paths(&config, &reduce::design(&settings)?)?;
            if !args.estimate {
                outputs().folder("--runs", folder, &[]).prepare()?;
            }
            announce(&config, &settings, folder, args.jobs)?;
            if args.estimate {
                return Ok(());
            }
            runs::run(&config, &settings, folder, share, args.jobs)?;
            if args.task.is_some() {
                return Ok(());
            }
        }
        _ => outputs().prepare()?,
    }
    let mut models = Models::make(args, &config, folder.as_deref(), &ranges, &tissue)?;
    let refused = models.write([&files[0], &files[1]], args.accept)?;
    let slides = FullSlips::of(&config, &models.runs)?;
    models.judge(&slides.runs, [config.friction.lambda, config.friction.beta])?;
    models.print();
    let curve = args.curve.then(|| args.bed_settings(false));
    page::write(out, &models, &config, &slides, curve.as_ref())?;
    let [neutral, worst] = [models.worst(|group| group == Group::Neutral), models.worst(|_| true)];
    match (neutral, worst) {
        (Grade::NotUsable, _) if !args.accept => {
            return Err(Failure::NotGoodEnough(format!(
                "not usable in the neutral pose and not written: {}; the runs are kept. A finer mesh (--mesh-preset), --design full, or a \
                 smaller largest depth in [design] may help; --accept writes the file",
                refused.join(", ")
            )));
        }
        (Grade::NotUsable, _) => {
            eprintln!("warning: not usable in the neutral pose: {}; written because of --accept", refused.join(", "))
        }
        (_, Grade::NotUsable) => {
            eprintln!(
                "warning: the models are {} in the neutral pose and not usable for some motions",
                neutral.as_str()
            );
        }
        (_, Grade::Usable) => eprintln!("warning: the models are usable, not good: see their errors"),
        _ => {}
    }
    Ok(())
}

/// Prints the size of a design and an estimate of its time, from the time of its lightest press on this machine.
///
/// * `folder`: of the runs
fn announce(config: &Config, settings: &DesignSettings, folder: &Path, jobs: Option<usize>) -> Result<(), Failure> {
    let experiments = reduce::design(settings)?;
    let batches = reduce::batches(&experiments);
    let cost = |experiment: &Experiment| reduce::batches(std::slice::from_ref(experiment))[0].cost();
    // A press if there is one, else another short path.
    let lightest = |a: &&Experiment, b: &&Experiment| {
        (a.kind != Kind::Press).cmp(&(b.kind != Kind::Press)).then(cost(a).total_cmp(&cost(b)))
    };
    let Some(tried) = experiments.iter().min_by(lightest) else {
        return Err(Failure::Input(anyhow!("[design.paths] has no path")));
    };
    let unit_s = HARDER * runs::time_of(config, tried, folder)? / cost(tried);
    let costs: Vec<f64> = batches.iter().map(reduce::Batch::cost).collect();
    // More threads than cores or batches of paths make nothing faster, and no thread ends before the longest batch.
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = jobs.unwrap_or(cores).min(cores).min(costs.len()).max(1);
    let cpu_s = unit_s * costs.iter().sum::<f64>();
    let longest_s = unit_s * costs.iter().copied().fold(0.0, f64::max);
    println!(
        "{} paths: about {} of CPU, {} on {threads} of {cores} cores",
        experiments.len(),
        duration(cpu_s),
        duration((cpu_s / threads as f64).max(longest_s)),
    );
    Ok(())
}

impl Args {
    /// Settings of the fit of a bed.
    fn bed_settings(&self, is_few: bool) -> Settings {
        // Runs of the pad leave one minimum; a further start would cost a third of the time.
        Settings { restarts: self.restarts.unwrap_or(usize::from(!is_few)), ..Settings::default() }
    }
}

/// Pad and bed of a finger, and their errors.
pub(super) struct Models {
    /// The runs of the finger.
    pub runs: Vec<Run>,
    /// The pad, and the undeformed surface of the finger.
    pub pad: Option<(MadePad, Outline, Verdict)>,
    /// The bed.
    pub bed: Option<(Reduced, Verdict)>,
}

/// Runs of a bed's motions below which it is fitted beside paths of the pad.
const FEW: usize = 60;

impl Models {
    /// Makes the models from the runs of this finger.
    ///
    /// * `folder`: of the runs; None for those that ship
    /// * `ranges`: of the paths of the pad beside which the bed is fitted
    /// * `tissue`: branches of the soft tissue
    fn make(
        args: &Args,
        config: &Config,
        folder: Option<&Path>,
        ranges: &DesignSettings,
        tissue: &Relaxation,
    ) -> Result<Self, Failure> {
        let hash = reduce::settings_hash(config)?;
        let (runs, others): (Vec<Run>, Vec<Run>) =
            read_runs(folder)?.into_iter().partition(|run| run.settings_hash == hash);
        if let (true, Some(other)) = (runs.is_empty(), others.first()) {
            return Err(Failure::Input(anyhow!(
                "run {} is of other settings ({}) than this finger ({hash}): take the --config, --shape and --mesh-preset of its design",
                other.name,
                other.settings_hash
            )));
        }
        let law = [config.friction.lambda, config.friction.beta];
        let relaxation = branches_of_force(config, tissue)?;
        let is_few = runs.iter().filter(|run| run.is_representable()).count() < FEW;
        let (mut pad, mut beside) = (None, Vec::new());
        if args.only != Some(Only::Bed) || is_few {
            let settings = PadSettings {
                size: PadSize { patches: args.patches },
                runs: args.fit_runs,
                limits: FitLimits { patience: args.patience, hold: is_few },
                ..PadSettings::default()
            };
            let (mut made, outline) = pad::make(config, &runs, settings)?;
            if is_few && args.only != Some(Only::Pad) {
                let pad = PadModelFile::new(&made.file()?).map_err(ReduceError::from)?;
                let paths = DesignSettings { paths: DesignSettings::default().paths, ..ranges.clone() };
                beside = runs_for_bed(&pad.file().pad, &runs, &paths, &hash)?;
            }
            made.relaxation = relaxation;
            let verdict = Verdict::of_pad(&made.model, &runs, &outline, law);
            pad = Some((made, outline, verdict)).filter(|_| args.only != Some(Only::Bed));
        }
        let mut bed = None;
        if args.only != Some(Only::Pad) {
            let runs = representable(runs.clone());
            let mut made = fit(&runs, &beside, &config.friction, &args.bed_settings(is_few))?;
            made.relaxation = relaxation;
            let verdict = Verdict::of_bed(&made.data.model().map_err(ReduceError::from)?, &runs, law);
            bed = Some((made, verdict));
        }
        Ok(Self { runs, pad, bed })
    }

    /// The verdicts by the name of their model.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, &Verdict)> {
        let pad = self.pad.iter().map(|(.., verdict)| ("pad", verdict));
        pad.chain(self.bed.iter().map(|(_, verdict)| ("bed", verdict)))
    }

    /// The worst grade of the models for some groups of motions.
    fn worst(&self, of: impl Fn(Group) -> bool + Copy) -> Grade {
        self.named().map(|(_, verdict)| verdict.worst(of)).max().unwrap_or(Grade::NotUsable)
    }

    /// Writes pad and bed, unless they are not usable in the neutral pose; returns the names of the models that are not.
    fn write(&self, [pad_file, model_file]: [&Path; 2], accept: bool) -> Result<Vec<&'static str>, Failure> {
        let is_bad = |verdict: &Verdict| verdict.worst(|group| group == Group::Neutral) == Grade::NotUsable;
        let mut refused = Vec::new();
        if let Some((pad, _, verdict)) = &self.pad {
            refused.extend(is_bad(verdict).then_some("pad"));
            if accept || !is_bad(verdict) {
                pad::write(pad, pad_file)?;
            }
        }
        if let Some((bed, verdict)) = &self.bed {
            refused.extend(is_bad(verdict).then_some("bed"));
            if accept || !is_bad(verdict) {
                springs::write(bed, &self.runs, model_file)?;
            }
        }
        Ok(refused)
    }

    /// Adds the errors along slides to full slip to the verdicts.
    ///
    /// * `law`: lambda and beta of the runs
    fn judge(&mut self, slides: &[Run], law: [f64; 2]) -> Result<(), Failure> {
        if let Some((pad, outline, verdict)) = &mut self.pad {
            *verdict = verdict.clone().with_full_slip(&Verdict::of_pad(&pad.model, slides, outline, law));
        }
        if let Some((bed, verdict)) = &mut self.bed {
            let model = bed.data.model().map_err(ReduceError::from)?;
            *verdict = verdict.clone().with_full_slip(&Verdict::of_bed(&model, slides, law));
        }
        Ok(())
    }

    /// Rows of the table of verdicts.
    pub fn verdicts(&self) -> Vec<Vec<String>> {
        self.named().flat_map(|(name, verdict)| verdict.rows(name)).collect()
    }

    /// Prints the table of verdicts.
    fn print(&self) {
        let [normal, friction, stick] = GOOD;
        println!(
            "\nverdict: errors along paths that no fit has seen, root mean square over the path's largest. Good: normal force {:.0} %, \
             friction {:.0} %, stick ratio {stick:.1}; usable: twice that",
            100.0 * normal,
            100.0 * friction
        );
        let head: Vec<String> = COLUMNS.map(str::to_owned).to_vec();
        for row in std::iter::once(&head).chain(&self.verdicts()) {
            let [model, motions, numbers @ .., grade] = row.as_slice() else { continue };
            let numbers: String = numbers.iter().map(|number| format!("{number:>13}")).collect();
            println!("{model:<6}{motions:<13}{numbers}   {grade}");
        }
    }
}

/// Branches of the finger's force from those of its tissue; prints both.
fn branches_of_force(config: &Config, tissue: &Relaxation) -> Result<Relaxation, Failure> {
    if !tissue.is_some() {
        return Ok(*tissue);
    }
    if let Some(sentence) = relaxation::assumption(tissue) {
        eprintln!("{sentence}");
    }
    let (finger, _) = make_finger(config)?;
    let tip = Tip::of(&finger, &config.tissue, &config.friction)?;
    let of_force = during("presses of tissue that relaxes", |_| {
        reduce::pad::branches_of_force(&config.problem(&finger), &tip, tissue)
    })?;
    println!(
        "the force relaxes with {} (SHARE:TIME_S); the tissue with {}",
        relaxation::text(&of_force),
        relaxation::text(tissue)
    );
    Ok(of_force)
}

/// Refuses to replace a file that is not an earlier model of the same finger.
///
/// * `hash_of`: hash of the settings that a model file of this kind states; None for another file
fn check(file: &Path, what: &str, hash: &str, hash_of: impl Fn(&[u8]) -> Option<String>) -> anyhow::Result<()> {
    let is_ours = |bytes: Vec<u8>| hash_of(&bytes).is_some_and(|found| found == hash);
    if file.exists() && !std::fs::read(file).is_ok_and(is_ours) {
        bail!("{}: exists and is not a {what} of this finger: give another --out, or remove it", file.display());
    }
    Ok(())
}

fn hash_of_bed(bytes: &[u8]) -> Option<String> {
    meta_of(&ModelFile::relaxing(bytes).ok()?).map(|meta| meta.settings_hash)
}

fn hash_of_pad(bytes: &[u8]) -> Option<String> {
    let pad = PadModelFile::new(bytes).ok()?;
    serde_json::from_str::<PadMeta>(pad.file().meta).ok().map(|meta| meta.settings_hash)
}

/// A time with its unit, to two digits.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 9.5 => format!("{s:.1} s"),
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
