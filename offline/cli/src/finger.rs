//! `fingerpad finger`: from a geometry to the model files of a pad and of a bed of springs, in one command.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::ValueEnum;
use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad_fe::experiment::Config;
use fingerpad_identify::population::Share;
use fingerpad_reduce::pad::{FitLimits, MadePad, PadMeta, PadSettings, runs_for_bed};
use fingerpad_reduce::{
    self as reduce, COLUMNS, DesignSettings, GOOD, Grade, Group, ReduceError, Reduced, Run, Settings, Tip, Verdict,
};

use super::build_model::meta_of;
use super::reduce::{fit, read_runs, representable, write_report};
use super::{Failure, Model, Outputs, design, make_finger, pad};

/// Make the model files of your finger: a few finite-element runs, a pad, a bed of springs, a report
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad finger --shape b --mesh-preset medium --out b      a shipped shape: some minutes
  fingerpad finger --config mine.toml --out model              your finger on the default mesh
  fingerpad finger --config mine.toml --out model --estimate   only print the number of runs and their time
  fingerpad finger --config mine.toml --out model --design full
                                                               every kind of motion, hours

The folder holds runs/ (a file for each finished path), pad.fpm, model.fpm and a report. pad.fpm is the pad, for every
pose, other rigid bodies and the forces of a hand; model.fpm is the bed of springs for firmware, in the pose of the
mesh on a plane. An interrupted run resumes when the command is started again.

The pad follows from one factorisation of the finger's stiffness; its other parameters are fitted to the runs of the
quick design: a press, slides, a reversal, changes of depth, spins, poses and one deep path. The bed is fitted to the
runs in its pose and to some hundred paths of the pad. The printed errors are those along the other half of the runs, which are
left out of every fit. --design full runs the design of the shipped files; a section [design] in --config sets the
size of either. Without one, depths, slides and forces follow from the tip: its soft layer, its curvature, its stiffness and
its friction.

The last lines are the verdict on pad and bed, for each kind of motion. Exit code 4: the models are not usable in the
neutral pose. Then their files are written only with --accept.")]
pub struct Args {
    /// Folder for runs, pad.fpm, model.fpm and report
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Which motions are run
    #[arg(long, value_name = "DESIGN", default_value = "quick")]
    design: Design,
    /// Write the models also if they are not usable in the neutral pose
    #[arg(long)]
    accept: bool,
    /// Print the number of runs and an estimate of their time, and stop
    #[arg(long)]
    estimate: bool,
    #[command(flatten)]
    model: Model,
    /// Threads; each path runs on one [default: the machine's]
    #[arg(long, value_name = "N", value_parser = super::jobs)]
    jobs: Option<usize>,
}

/// Size of the design.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Design {
    /// Some twenty paths
    Quick,
    /// All paths of the default design
    Full,
}

/// CPU time of an increment of a contact 1 mm deep, per node of the mesh to the power of [`NODES_EXPONENT`], s: the shipped
/// finger's design.
const INCREMENT_S: f64 = 1.0e-5;
/// Growth of the time with the number of nodes.
const NODES_EXPONENT: f64 = 1.1;

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (config, _, ranges) = args.model.settings()?;
    let hash = reduce::settings_hash(&config)?;
    let (pad_file, model_file) = (args.out.join("pad.fpm"), args.out.join("model.fpm"));
    check(&model_file, "model", &hash, hash_of_bed).map_err(Failure::Input)?;
    check(&pad_file, "pad", &hash, hash_of_pad).map_err(Failure::Input)?;
    let (finger, _) = make_finger(&config)?;
    let ranges = ranges.for_tip(Tip::of(&finger, &config.tissue, &config.friction)?);
    let settings = match args.design {
        Design::Quick if ranges.paths == DesignSettings::default().paths => ranges.clone().quick(),
        Design::Quick => ranges.clone(),
        Design::Full => ranges.clone().beyond_springs(),
    };
    let experiments = reduce::design(&settings)?;
    design::check_paths(&config, &experiments)?;
    let costs: Vec<f64> = reduce::batches(&experiments).iter().map(reduce::Batch::cost).collect();
    // More threads than cores or batches of paths make nothing faster, and no thread ends before the longest batch.
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = args.jobs.unwrap_or(cores).min(cores).min(costs.len()).max(1);
    let unit_s = INCREMENT_S * (finger.mesh.nodes.len() as f64).powf(NODES_EXPONENT);
    let cpu_s = unit_s * costs.iter().sum::<f64>();
    let longest_s = unit_s * costs.iter().copied().fold(0.0, f64::max);
    println!(
        "{} paths on {} nodes: about {} of CPU, {} on {threads} of {cores} cores",
        experiments.len(),
        finger.mesh.nodes.len(),
        duration(cpu_s),
        duration((cpu_s / threads as f64).max(longest_s)),
    );
    if args.estimate {
        return Ok(());
    }
    let runs_folder = args.out.join("runs");
    Outputs::beside(args.model.inputs(&config)).folder("--out", &args.out, &[]).prepare()?;
    design::run(&config, &settings, &runs_folder, Share::ALL, args.jobs)?;
    let is_quick = args.design == Design::Quick;
    let models = models(&config, &runs_folder, &ranges, is_quick)?;
    let grade = models.grade();
    let is_kept = grade != Grade::NotUsable || args.accept;
    if is_kept {
        models.write([&pad_file, &model_file])?;
    }
    write_report(&args.out, &models.runs, &models.bed, &config.friction, None, &models.verdicts())?;
    models.print();
    let worst = models.pad_verdict.worst(|_| true).max(models.bed_verdict.worst(|_| true));
    match grade {
        Grade::NotUsable if !is_kept => {
            return Err(Failure::NotGoodEnough(format!(
                "the models are not usable in the neutral pose and are not written; the runs are kept in {}. A finer mesh \
                 (--mesh-preset), --design full, or a smaller largest depth in [design] may help; --accept writes them",
                runs_folder.display()
            )));
        }
        Grade::NotUsable => {
            eprintln!("warning: the models are not usable in the neutral pose; written because of --accept")
        }
        _ if worst == Grade::NotUsable => {
            eprintln!("warning: the models are {} in the neutral pose and not usable for some motions", grade.as_str());
        }
        _ if worst == Grade::Usable => eprintln!("warning: the models are usable, not good: see their errors"),
        _ => {}
    }
    Ok(())
}

/// The sizes that a design of experiments follows.
pub(super) fn with_tip(config: &Config, design: &DesignSettings) -> Result<DesignSettings, Failure> {
    let (finger, _) = make_finger(config)?;
    Ok(design.clone().for_tip(Tip::of(&finger, &config.tissue, &config.friction)?))
}

/// Pad and bed of a finger, and their errors.
pub(super) struct Models {
    /// The runs that the bed is scored along.
    runs: Vec<Run>,
    pad: MadePad,
    bed: Reduced,
    pad_verdict: Verdict,
    bed_verdict: Verdict,
}

impl Models {
    /// The grade in the neutral pose, which decides whether the files are written.
    pub fn grade(&self) -> Grade {
        let is_neutral = |group| group == Group::Neutral;
        self.pad_verdict.worst(is_neutral).max(self.bed_verdict.worst(is_neutral))
    }

    /// Writes pad and bed.
    pub fn write(&self, [pad_file, model_file]: [&Path; 2]) -> Result<(), Failure> {
        pad::write(&self.pad, pad_file)?;
        super::reduce::write(&self.bed, &self.runs, model_file)
    }

    /// Rows of the table of verdicts.
    fn verdicts(&self) -> Vec<Vec<String>> {
        [self.pad_verdict.rows("pad"), self.bed_verdict.rows("bed")].concat()
    }

    /// Prints the table of verdicts.
    pub fn print(&self) {
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

/// Makes the pad and the bed of a finger from its runs in a folder.
///
/// * `ranges`: of the paths of the pad beside which the bed is fitted
/// * `is_quick`: whether the runs are few, so that the bed is fitted beside paths of the pad
pub(super) fn models(
    config: &Config,
    folder: &Path,
    ranges: &DesignSettings,
    is_quick: bool,
) -> Result<Models, Failure> {
    let hash = reduce::settings_hash(config)?;
    let mut runs = read_runs(Some(folder))?;
    runs.retain(|run| run.settings_hash == hash);
    let limits = FitLimits { patience: 20, hold: is_quick };
    let (made, outline) = pad::make(config, &runs, PadSettings { limits, ..PadSettings::default() })?;
    let law = [config.friction.lambda, config.friction.beta];
    let pad_verdict = Verdict::of_pad(&made.model, &runs, &outline, law);
    let pad = PadModelFile::new(&made.file()?).map_err(ReduceError::from)?;
    let beside = if is_quick {
        let paths = DesignSettings { paths: DesignSettings::default().paths, ..ranges.clone() };
        runs_for_bed(&pad.file().pad, &runs, &paths, &hash)?
    } else {
        Vec::new()
    };
    let runs = representable(runs);
    // Runs of the pad leave one minimum; a further start would cost a third of the time.
    let settings = Settings { restarts: usize::from(!is_quick), ..Settings::default() };
    let bed = fit(&runs, &beside, &config.friction, &settings)?;
    let bed_verdict = Verdict::of_bed(&bed.data.model().map_err(ReduceError::from)?, &runs, law);
    Ok(Models { runs, pad: made, bed, pad_verdict, bed_verdict })
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
    meta_of(&ModelFile::new(bytes).ok()?).map(|meta| meta.settings_hash)
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
