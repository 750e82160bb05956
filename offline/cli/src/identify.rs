//! `fingerpad identify`: from a measured table to the finger and the friction law.

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use anyhow::{Context, anyhow, bail};
use fingerpad_fe::experiment::Config;
use fingerpad_formats::atomic_write;
use fingerpad_identify::{
    self as identify, Hooks, IdentifyError, Input, Outcome, Point, Settings, StateCache, population,
};
use fingerpad_reduce::DesignSettings;
use fingerpad_report as report;
use indicatif::{ProgressBar, ProgressStyle};
use serde::{Deserialize, Serialize};

use super::config::ConfigFile;
use super::{Failure, Model, Outputs, go_on, keeping, results};

/// Calibrate the finger on a measured table and identify lambda and beta of its friction.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad identify                                       Table 1 of Yoshida et al. 2011
  fingerpad identify --mesh-preset coarse --out trial      a first look, not for constants
  fingerpad identify --data my.csv --joint --out mine      finger, depths and law at once as well
  fingerpad identify --fast --no-prediction --force-zero --out zero   beta, zero of the force
  fingerpad identify --published --out published           no search: the published constants
  fingerpad identify --data subjects/ --out study          a folder of tables, then the population
  fingerpad identify --data subjects/ --out study --task 2/8   the second of eight shares
  fingerpad identify --data subjects/ --out study --collect    merges the results of the shares
  fingerpad identify --hold hold.csv                       shares and times of relaxing tissue from a ramp and hold
  fingerpad identify --print-config                        all settings

--hold takes a press that begins in the air, rises and is held, at best for 20 s: forces within 5 mN at 1 kHz during the
ramp determine a branch of 4 ms only if the ramp takes 10 ms, or if a vibration of some 40 Hz follows the hold. It prints
shares and times with intervals of 95 %, marks a value whose interval is wider than 10 % to each side as poorly determined,
and ends with the text that `eval --relaxation` takes.

A table has the columns depth_mm, normal_force_n, friction_coefficient and, if measured, contact_area_mm2. Computed
states are kept in DIR/states.bin: a run that was killed, or is run again with more options, resumes from there.
DIR/files.txt lists the results; those of a run with other options are removed before new ones are written.")]
pub struct Args {
    #[command(flatten)]
    model: Model,
    /// Measured table, or a folder of tables [default: Table 1 of Yoshida et al. 2011]
    #[arg(long, value_name = "TABLE.csv|DIR")]
    data: Option<PathBuf>,
    /// Ramp and hold of a finger (CSV with t_s, depth_mm, normal_force_n): print shares and times of the branches of its
    /// tissue, and stop
    #[arg(long, value_name = "HOLD.csv", conflicts_with_all = ["data", "published", "collect", "task"])]
    hold: Option<PathBuf>,
    /// Most branches of --hold
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..=3), requires = "hold")]
    branches: u8,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "identify_out")]
    out: PathBuf,
    /// Run the published constants only, before and after the calibration of the finger; search for nothing
    #[arg(long)]
    published: bool,
    /// Also fit finger, depths (within their error) and law at once
    #[arg(long)]
    joint: bool,
    /// Search for tau_0 as well
    #[arg(long)]
    free_tau0: bool,
    /// Also fit finger and law to the table without a zero of the normal force, for several zeros: beta against the zero
    #[arg(long)]
    force_zero: bool,
    /// Leave out the paper's simplex; the fast route remains
    #[arg(long)]
    fast: bool,
    /// Leave out the F/N curve, the published checks and the sensitivities
    #[arg(long)]
    no_prediction: bool,
    /// With a folder: do the K-th of N shares of its tables, and do not collect
    #[arg(long, value_name = "K/N", conflicts_with = "collect")]
    task: Option<population::Share>,
    /// With a folder: merge the stored results without running anything
    #[arg(long)]
    collect: bool,
    /// Run everything again, finished runs included
    #[arg(long)]
    full: bool,
    /// Threads [default: the machine's]
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Print the configuration in force as TOML and stop
    #[arg(long)]
    print_config: bool,
}

/// Files in the folder of results that could be given as an input.
const NAMES: &[&str] = &["run.json", "states.bin", "finger.toml", "calibrated.toml", "report.json", "report.html"];

const TABLE_1: &str = include_str!("../data/yoshida2011.csv");

impl From<IdentifyError> for Failure {
    fn from(error: IdentifyError) -> Self {
        match error {
            IdentifyError::Interrupted => Self::Interrupted("finished states are kept".into()),
            IdentifyError::Steady { .. }
            | IdentifyError::BesidePad { .. }
            | IdentifyError::TooFewSlides(_)
            | IdentifyError::Fit { .. } => Self::Numerics(error.into()),
            other => Self::Input(other.into()),
        }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(file) = &args.hold {
        return super::hold::run(file, args.branches);
    }
    let (config, mut settings, design) = args.model.settings()?;
    settings.joint.enabled |= args.joint;
    settings.free_tau0 |= args.free_tau0;
    settings.force_zero |= args.force_zero;
    settings.simplex.enabled &= !args.fast;
    settings.prediction.curve &= !args.no_prediction;
    settings.prediction.sensitivities &= !args.no_prediction;
    if args.print_config {
        let text =
            toml::to_string(&ConfigFile::of(&config, &settings, &design)).map_err(|e| Failure::Input(e.into()))?;
        print!("{text}");
        return Ok(());
    }
    if args.jobs == Some(0) {
        return Err(Failure::Input(anyhow!("--jobs 0: at least one thread is needed")));
    }
    match &args.data {
        Some(folder) if folder.is_dir() => study(args, (&config, &settings, &design), folder),
        _ if args.collect || args.task.is_some() => {
            Err(Failure::Input(anyhow!("--task and --collect need --data with a folder of tables")))
        }
        data => {
            let (name, points) = table(data.as_deref(), config.tissue.stiffness())?;
            prepare(args, &config, data.as_deref(), &[&args.out])?;
            subject(args, (&config, &settings, &design), &name, points, &args.out).map(|_| ())
        }
    }
}

/// Sections of the configuration: the last is for the files that are written, nothing here reads it.
type Sections<'a> = (&'a Config, &'a Settings, &'a DesignSettings);

/// Checks the folders of results against the files that are read, and makes them.
fn prepare(args: &Args, config: &Config, table: Option<&Path>, folders: &[&Path]) -> Result<(), Failure> {
    let inputs = args.model.inputs(config).into_iter().chain([("--data", table)]);
    let outputs = Outputs::beside(inputs);
    folders.iter().fold(outputs, |outputs, folder| outputs.folder("--out", folder, NAMES)).prepare()
}

/// Rows of a table and its name.
fn table(path: Option<&Path>, stiffness: f64) -> Result<(String, Vec<Point>), Failure> {
    let rows = match path {
        Some(path) => {
            let rows = fingerpad_identify::table_csv::read(path, stiffness)?;
            let notes = fingerpad_identify::table_csv::notes(path, &fingerpad_formats::ColumnNames::default());
            notes.iter().for_each(|note| eprintln!("note: {}: {note}", path.display()));
            rows
        }
        None => fingerpad_identify::table_csv::parse(Path::new("Table 1 of Yoshida et al. 2011"), TABLE_1)?,
    };
    let point = |row: &fingerpad_identify::table_csv::Row| Point {
        depth_mm: row.depth_mm,
        normal_force_n: row.normal_force_n,
        friction_coefficient: row.friction_coefficient,
        contact_area_mm2: row.contact_area_mm2,
    };
    let name = path.map_or("Table 1 of Yoshida et al. 2011".into(), |p| p.display().to_string());
    Ok((name, rows.iter().map(point).collect()))
}

/// Contents of `OUT/run.json`: the command that owns the folder.
#[derive(Serialize, Deserialize)]
struct Identity {
    settings_hash: String,
    program_version: String,
    config: serde_json::Value,
}

/// Takes the folder; a folder that this command did not make is refused.
fn claim(out: &Path, config: &ConfigFile, hash: &str, full: bool) -> anyhow::Result<()> {
    fs::create_dir_all(out).with_context(|| format!("{}", out.display()))?;
    let identity_file = out.join("run.json");
    let is_ours = || -> anyhow::Result<bool> {
        let text = fs::read_to_string(&identity_file).with_context(|| format!("{}", identity_file.display()))?;
        let found: Identity = serde_json::from_str(&text).with_context(|| format!("{}", identity_file.display()))?;
        // A folder of `build` has the same file; the section is this command's alone.
        Ok(found.config.get("identify").is_some())
    };
    if fs::read_dir(out)?.next().is_some() && !(identity_file.exists() && is_ours()?) {
        bail!("{} is not empty and not a folder of this command: give another --out", out.display());
    }
    if full && out.join("states.bin").exists() {
        fs::remove_file(out.join("states.bin"))?;
    }
    let identity = Identity {
        settings_hash: hash.to_owned(),
        program_version: env!("CARGO_PKG_VERSION").to_owned(),
        config: serde_json::to_value(config)?,
    };
    let text = serde_json::to_string_pretty(&identity)? + "\n";
    Ok(atomic_write(&identity_file, |w| w.write_all(text.as_bytes()))?)
}

/// A finished outcome of these settings, if the folder has one.
fn finished(out: &Path, hash: &str) -> Option<Outcome> {
    let outcome: Outcome = serde_json::from_str(&fs::read_to_string(out.join("report.json")).ok()?).ok()?;
    (outcome.provenance.settings_hash == hash).then_some(outcome)
}

/// One table into one folder.
fn subject(
    args: &Args,
    (config, settings, design): Sections,
    name: &str,
    points: Vec<Point>,
    out: &Path,
) -> Result<Outcome, Failure> {
    let start = Instant::now();
    let jobs = args.jobs.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    let input = Input { config, settings, table_name: name.to_owned(), points, published: args.published, jobs };
    let hash = identify::settings_hash(&input)?;
    if !args.full
        && let Some(outcome) = finished(out, &hash)
    {
        println!("{}: finished before", out.display());
        summary(&outcome);
        return Ok(outcome);
    }
    claim(out, &ConfigFile::of(config, settings, design), &hash, args.full).map_err(Failure::Input)?;
    let _keeping = keeping();
    let cache = StateCache::open(&out.join("states.bin"))?;
    if !cache.is_empty() {
        println!("{} steady states were found before", cache.len());
    }
    let style = ProgressStyle::with_template("{spinner} {prefix}: {msg} [{elapsed}]").expect("a valid template");
    let bar = ProgressBar::new_spinner().with_style(style);
    bar.enable_steady_tick(Duration::from_millis(200));
    let hooks = Hooks {
        go_on: &|| go_on().is_continue(),
        report_progress: &|stage, line| {
            // Without a terminal the bar is silent; progress is then printed as lines for a log.
            if bar.is_hidden() {
                eprintln!("{:8.1} s  {stage} {line}", start.elapsed().as_secs_f64());
            }
            bar.set_prefix(stage.to_owned());
            bar.set_message(line.to_owned());
        },
    };
    let result = identify::identify(&input, cache, &hooks);
    bar.finish_and_clear();
    let outcome = result.map_err(|error| match error {
        IdentifyError::Interrupted => {
            Failure::Interrupted(format!("finished states are kept in {}", out.join("states.bin").display()))
        }
        other => other.into(),
    })?;
    write_results((config, settings, design), &outcome, out)?;
    summary(&outcome);
    println!("{:.1} s; see {}", start.elapsed().as_secs_f64(), out.join("report.html").display());
    Ok(outcome)
}

/// Writes everything, the page last.
fn write_results((config, settings, design): Sections, outcome: &Outcome, out: &Path) -> Result<(), Failure> {
    let rendered = report::identify::render(outcome).map_err(|e| Failure::Input(e.into()))?;
    let mut files = Vec::new();
    if let Some(calibration) = &outcome.calibration {
        let text = toml::to_string(&calibration.finger.shape).map_err(|e| Failure::Input(e.into()))?;
        let text = format!("# Shape found by the calibration on {}.\n{text}", outcome.provenance.table);
        files.push(("finger.toml".to_owned(), text.into_bytes()));
        let mut config = config.clone();
        calibration.finger.apply(&mut config);
        config.shape.0 = "finger.toml".into();
        if let Some(law) = &outcome.law {
            config.friction = law.law.friction(&config.friction);
        }
        config.experiment.depths_mm = outcome.calibrated_depths_mm();
        let text = toml::to_string(&ConfigFile::of(&config, settings, design)).map_err(|e| Failure::Input(e.into()))?;
        let text = format!(
            "# Finger and law identified from {}; depths with the calibration's offset.\n{text}",
            outcome.provenance.table
        );
        files.push(("calibrated.toml".to_owned(), text.into_bytes()));
    }
    files.extend(rendered.files("figures/", "report"));
    results::write(out, &files)
}

/// Tables of a folder, by name.
fn tables(folder: &Path) -> anyhow::Result<Vec<(String, PathBuf)>> {
    let mut tables = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| format!("{}", folder.display()))? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
            let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
            tables.push((stem, path));
        }
    }
    if tables.is_empty() {
        bail!("{}: no table (*.csv) in this folder", folder.display());
    }
    tables.sort();
    Ok(tables)
}

/// A folder of tables.
fn study(args: &Args, config: Sections, folder: &Path) -> Result<(), Failure> {
    let tables = tables(folder).map_err(Failure::Input)?;
    let share = args.task.unwrap_or(population::Share::ALL);
    if !args.collect {
        let own: Vec<PathBuf> = (tables.iter().enumerate())
            .filter(|(i, _)| share.has(*i))
            .map(|(_, (stem, _))| args.out.join(stem))
            .collect();
        prepare(args, config.0, None, &own.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
        let mut failed: Option<Failure> = None;
        for (i, (stem, path)) in tables.iter().enumerate() {
            if !share.has(i) {
                continue;
            }
            println!("{stem} ({} of {})", i + 1, tables.len());
            let result = table(Some(path), config.0.tissue.stiffness())
                .and_then(|(name, points)| subject(args, config, &name, points, &args.out.join(stem)));
            match result {
                Ok(_) => {}
                Err(interrupted @ Failure::Interrupted(_)) => return Err(interrupted),
                // The others are independent of this one.
                Err(error) => {
                    let (Failure::Input(inner) | Failure::Numerics(inner)) = &error else { continue };
                    eprintln!("error: {stem}: {inner:#}");
                    failed = Some(error);
                }
            }
        }
        if let Some(failed) = failed {
            return Err(failed);
        }
        if args.task.is_some() {
            return Ok(());
        }
    }
    collect(args, &tables)
}

/// Merges the results stored in the folder.
fn collect(args: &Args, tables: &[(String, PathBuf)]) -> Result<(), Failure> {
    let (mut subjects, mut missing) = (Vec::new(), Vec::new());
    for (stem, _) in tables {
        let file = args.out.join(stem).join("report.json");
        let outcome = fs::read_to_string(&file).ok().map(|text| {
            serde_json::from_str::<Outcome>(&text)
                .with_context(|| format!("{}", file.display()))
                .map_err(Failure::Input)
        });
        match outcome.transpose()? {
            Some(outcome) => subjects.push(population::Subject::of(stem, &outcome)),
            None => missing.push(stem.clone()),
        }
    }
    if subjects.is_empty() {
        return Err(Failure::Input(anyhow!("{}: no finished subject to collect", args.out.display())));
    }
    let population = population::Population::of(subjects, missing);
    let rendered = report::identify::render_population(&population).map_err(|e| Failure::Input(e.into()))?;
    results::write(&args.out, &rendered.files("figures/", "population"))?;
    println!("\n{} subjects, {} without a result", population.subjects.len(), population.missing.len());
    for spread in &population.spreads {
        println!(
            "{:<34} mean {:>9.4}  standard deviation {:>8}  between subjects {:>8}  {:.4} to {:.4}",
            spread.name,
            spread.mean,
            optional(spread.deviation, 4),
            optional(spread.between_subjects, 4),
            spread.least,
            spread.most
        );
    }
    println!("{}", population.correlation_statement());
    println!("see {}", args.out.join("population.html").display());
    if population.missing.is_empty() {
        return Ok(());
    }
    Err(Failure::Input(anyhow!("without a result: {}", population.missing.join(", "))))
}

fn optional(value: Option<f64>, decimals: usize) -> String {
    value.map_or("-".into(), |v| format!("{v:.decimals$}"))
}

fn rows(title: &str, outcome: &Outcome, comparison: &identify::outcome::ModelDataComparison) {
    println!(
        "\n{title}: lambda {:.4e}, beta {:.4}, tau_0 {:.2e} MPa",
        comparison.lambda, comparison.beta, comparison.tau0_mpa
    );
    println!("  depth        normal force, N         contact area, mm²        friction coefficient F/N");
    println!("              measured model  diff    measured model  diff    measured  model   diff");
    for (row, point) in comparison.rows.iter().zip(&outcome.table) {
        println!(
            "  {:4.2} mm {:10.3} {:7.3} {:+5.1} % {:8.1} {:7.1} {:>5} % {:8.3} {:8.4} {:+6.1} %",
            point.depth_mm,
            point.normal_force_n,
            row.normal_force_n,
            row.normal_force_difference_percent,
            point.contact_area_mm2.unwrap_or(f64::NAN),
            row.contact_area_mm2,
            row.contact_area_difference_percent.map_or("-".into(), |d| format!("{d:+.1}")),
            point.friction_coefficient,
            row.friction_coefficient,
            row.friction_coefficient_difference_percent
        );
    }
}

/// Prints the results.
fn summary(outcome: &Outcome) {
    rows("published constants, finger as given", outcome, &outcome.published_before);
    if let Some(calibration) = &outcome.calibration {
        finger("calibration", calibration);
        rows("published constants, finger calibrated", outcome, &outcome.published);
    }
    if let Some(law) = &outcome.law {
        rows("identified law", outcome, &law.comparison);
        print_law(law);
    }
    if let Some(tau0) = &outcome.tau0 {
        println!("  {}", tau0.sentence);
    }
    if let Some(zero) = &outcome.force_zero {
        print_force_zero(zero);
    }
    print_searches(outcome);
    if let Some(joint) = &outcome.joint {
        finger("joint fit", joint);
        rows("joint fit", outcome, &joint.comparison);
    }
    if !outcome.left_out.is_empty() {
        print_left_out(&outcome.left_out);
    }
    for check in &outcome.checks {
        println!("{}: {:.3}; {} ({:.3})", check.finding, check.ours, check.source, check.published);
    }
    println!();
    for stage in &outcome.stages {
        println!(
            "  {:<42} {:>6.1} s wall {:>6.1} s CPU, {} states",
            stage.name, stage.wall_s, stage.cpu_s, stage.states
        );
    }
}

/// Constants of the law with their intervals, and remarks on them.
fn print_law(law: &identify::outcome::LawOutcome) {
    println!("\n{:.0} % intervals by profile likelihood:", 100.0 * law.confidence);
    for c in &law.constants {
        let interval = c.interval.as_ref().map_or("no interval".into(), |i| {
            let end = |v: f64, bounded: bool| {
                if bounded { format!("{v:.4}") } else { format!("({v:.4}: the search's bound)") }
            };
            format!("{} to {}", end(i.low, i.bounded[0]), end(i.high, i.bounded[1]))
        });
        println!(
            "  {:<18} {:>9.4} {:<4} standard error {:>8}, {interval}",
            c.name,
            c.value,
            c.unit,
            optional(c.standard_error, 4)
        );
    }
    println!(
        "  lambda (derived)   {:.4e} MPa^(1-beta); correlation with beta {}; of ln strength with beta {:.3}",
        law.lambda,
        optional(law.correlation_of_lambda, 4),
        law.correlation
    );
    let r = &law.regularisation;
    println!("  regularised below {:.3} kPa; with {}", 1e3 * r.pressure_mpa, r.effect());
    for remark in &law.remarks {
        println!("  {remark}");
    }
}

/// The exponent over the assumed zero of the normal force.
fn print_force_zero(zero: &identify::outcome::ForceZeroOutcome) {
    println!("  {}", zero.sentence);
    for p in &zero.points {
        println!(
            "  zero {:+6.1} mN: lambda {:.4e}, beta {:+.3}, stiffness factor {:.3}, depth offset {:+.3} mm; all numbers \
             within {:.1} %",
            1e3 * p.normal_force_offset_n,
            p.lambda,
            p.beta,
            p.stiffness,
            p.depth_offset_mm,
            p.rms_percent
        );
    }
}

/// The searches for the law: the paper's and the fast route.
fn print_searches(outcome: &Outcome) {
    for run in &outcome.simplex {
        println!(
            "simplex from lambda {}, beta {}: stops at lambda {:.5e}, beta {:.5}, sum of squares {:.4e}; {} evaluations, {} turned back",
            run.start[0],
            run.start[1],
            run.end[0],
            run.end[1],
            run.sum_of_squares,
            run.visits.len(),
            run.turned_back
        );
        if let Some(reason) = run.visits.iter().find_map(|v| v.turned_back.as_ref()) {
            println!("  first turned back: {reason}");
        }
    }
    if let Some(fast) = &outcome.fast {
        println!(
            "fast route: {} space mappings, {} Gauss–Newton evaluations (sum of squares {:.4e}), {} of a direct search; strength \
             {:.5} kPa, beta {:.5}, sum of squares {:.4e}",
            fast.mappings.len(),
            fast.gauss_newton_evaluations,
            fast.gauss_newton.sum_of_squares,
            fast.direct_evaluations,
            fast.law.tau_ref_kpa,
            fast.law.beta,
            fast.sum_of_squares
        );
    }
    if let (Some(run), Some([strength, beta])) = (&outcome.refined, outcome.routes_differ) {
        println!(
            "simplex continued from the best end: {} evaluations, sum of squares {:.4e}; less fast route: strength \
             {strength:+.2e} relative, beta {beta:+.2e}",
            run.visits.len(),
            run.sum_of_squares
        );
    }
}

/// Predictions of depths that were left out.
fn print_left_out(left_out: &[identify::outcome::LeftOut]) {
    println!("\nleft out and predicted F/N: at its depth, at its force; F = c N^(2/3), F = c N^n fitted to the same");
    for l in left_out {
        let pairs = l.predicted.iter().zip(l.differences_percent);
        let texts: Vec<String> =
            pairs.map(|(v, d)| v.zip(d).map_or("no slide".into(), |(v, d)| format!("{v:.3} ({d:+.1} %)"))).collect();
        println!("  {:4.2} mm measured {:.3}: {}", l.depth_mm, l.measured, texts.join("; "));
    }
}

fn finger(title: &str, fit: &identify::outcome::FingerOutcome) {
    println!(
        "\n{title}: root mean square of the weighted residuals {:.2} (before {:.2}), {} evaluations, {}",
        fit.rms, fit.rms_before, fit.evaluations, fit.ended
    );
    for f in &fit.fitted {
        println!(
            "  {:<34} {:>9.4} {:<3} from {:.4}; standard error {}{}",
            f.name,
            f.value,
            f.unit,
            f.start,
            optional(f.standard_error, 4),
            if f.at_bound { "; at its bound" } else { "" }
        );
    }
}
