//! `fingerpad build`: the main job.

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use anyhow::Context;
use fingerpad_fe::experiment::{self, Config};
use fingerpad_fe::load_path::{Checkpoint, Finger, LoadPathError, OnProgress, PathEnd, PressLimit, Trajectory};
use fingerpad_fe::mesh;
use fingerpad_formats::{atomic_write, in_threads};
use fingerpad_report::{self as report, BuildReport, Check, DepthResult, Provenance, Quantity, Stage, Steady};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::against_shipped::{compare_shipped, print_reduced};
use super::config::ConfigFile;
use super::{
    Bars, Failure, Model, Outputs, bar, go_on, keeping, make_finger_for, progress, provenance, results, run_failure,
    show,
};

/// The main job: mesh, press and slide at the measured depths, report.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad build                                   everything with its defaults, into out/
  fingerpad build --mesh-preset coarse --out quick  in seconds
  fingerpad build --shape a --config fixed.toml --out a_fixed
  fingerpad build --print-config > my.toml          all settings with their defaults

The forces at the four depths are compared with the measured table. If shape, tissue and friction law are those of the
shipped reduced model, they are also compared with that model. A build that was killed resumes: finished depths are
not run again, and an unfinished one repeats some seconds. A folder with the settings of another run is refused.")]
pub struct Args {
    #[command(flatten)]
    model: Model,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Threads; each depth runs on one [default: the machine's]
    #[arg(long, value_name = "N", value_parser = super::jobs)]
    jobs: Option<usize>,
    /// Measured table to compare with (CSV) [default: Table 1 of Yoshida et al. 2011]
    #[arg(long, value_name = "TABLE.csv")]
    table: Option<PathBuf>,
    /// Print the configuration in force as TOML and stop
    #[arg(long)]
    print_config: bool,
}

/// Contents of `out/run.json`: the command that owns the folder.
#[derive(Serialize, Deserialize)]
struct Identity {
    settings_hash: String,
    program_version: String,
    config: serde_json::Value,
}

/// A finished piece, with the settings that made it.
#[derive(Clone, Serialize, Deserialize)]
struct Stored<T> {
    settings_hash: String,
    wall_s: f64,
    cpu_s: f64,
    result: T,
}

/// Names of the files in the folder of results.
const NAMES: &[&str] =
    &["run.json", "report.json", "report.html", "mesh.vtu", "runs/", "figures/", "responses/", "fields/"];

const TABLE_1: &str = include_str!("../data/yoshida2011.csv");

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (config, identify, design) = args.model.settings()?;
    if args.print_config {
        let text =
            toml::to_string(&ConfigFile::of(&config, &identify, &design)).map_err(|e| Failure::Input(e.into()))?;
        print!("{text}");
        return Ok(());
    }
    let start = Instant::now();
    let table = read_table(args.table.as_deref(), config.tissue.stiffness())?;
    let inputs = args.model.inputs(&config).into_iter().chain([("--table", args.table.as_deref())]);
    Outputs::beside(inputs).folder("--out", &args.out, NAMES).prepare()?;
    let (finger, touch) = make_finger_for(&config, &[&config.experiment.deepest_press()])?;
    let quality = mesh::quality(&finger.mesh);
    config.check_depths(&config.experiment.depths_mm, &finger)?;
    let hash = config.hash()?;
    let folder = claim(&args.out, &config, &hash)?;
    let mesh_s = start.elapsed().as_secs_f64();
    println!(
        "shape {}, {} bones, {} nodes, {} hexes, {} free dofs; settings {hash}",
        config.geometry_name(),
        provenance::bones(&config),
        finger.mesh.nodes.len(),
        finger.mesh.hexes.len(),
        finger.body.dofs.count
    );

    let runs = all_runs(args, &config, &finger, &hash, &folder)?;

    let mut report = assemble(&config, &finger, &quality, touch.curvature_radius_mm, &hash, &table, &runs, mesh_s);
    report.reduced = compare_shipped(&config, &report.depths)?;
    progress::during("report", |_| write_results(&args.out, &finger, &report))?;
    print_summary(&report);
    match &report.reduced {
        Some(reduced) => print_reduced(&report.depths, reduced),
        None => println!(
            "the reduced model that ships is of another finger; `fingerpad finger` with these settings makes one of this finger"
        ),
    }
    println!("{:.1} s; see {}", start.elapsed().as_secs_f64(), args.out.join("report.html").display());
    Ok(())
}

fn read_table(path: Option<&Path>, stiffness: f64) -> Result<Vec<fingerpad_identify::table_csv::Row>, Failure> {
    Ok(match path {
        Some(path) => fingerpad_identify::table_csv::read(path, stiffness)?,
        None => fingerpad_identify::table_csv::parse(Path::new("Table 1 of Yoshida et al. 2011"), TABLE_1)?,
    })
}

/// Takes the folder for these settings; returns the folder of the finished pieces.
fn claim(out: &Path, config: &Config, hash: &str) -> Result<PathBuf, Failure> {
    let runs = out.join("runs");
    let claimed = || -> anyhow::Result<()> {
        fs::create_dir_all(&runs).with_context(|| format!("{}", runs.display()))?;
        let identity_file = out.join("run.json");
        if identity_file.exists() {
            let text = fs::read_to_string(&identity_file).with_context(|| format!("{}", identity_file.display()))?;
            let found: Identity =
                serde_json::from_str(&text).with_context(|| format!("{}", identity_file.display()))?;
            if found.settings_hash != hash {
                anyhow::bail!(
                    "{} holds the results of other settings ({}, these are {hash}): give another --out, or remove it",
                    out.display(),
                    found.settings_hash
                );
            }
        } else if fs::read_dir(out).with_context(|| format!("{}", out.display()))?.count() > 1 {
            anyhow::bail!("{} is not empty and not a folder of this program: give another --out", out.display());
        }
        let identity = Identity {
            settings_hash: hash.to_owned(),
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            config: serde_json::to_value(config)?,
        };
        let text = serde_json::to_string_pretty(&identity)? + "\n";
        atomic_write(&identity_file, |w| w.write_all(text.as_bytes()))?;
        Ok(())
    };
    claimed().map_err(Failure::Input)?;
    Ok(runs)
}

/// Time between two saves of an unfinished piece.
const CHECKPOINT_PERIOD: Duration = Duration::from_secs(5);

/// All pieces of the experiment.
struct Runs {
    frictionless: Stored<Vec<PressLimit>>,
    depths: Vec<Stored<Trajectory>>,
}

/// Runs the pieces and stores their results.
struct Pieces<'a> {
    config: &'a Config,
    finger: &'a Finger,
    hash: &'a str,
    folder: &'a Path,
    bars: Bars,
}

/// A piece of the first part: the presses to all depths, one from the end of the other, or the frictionless press.
enum First {
    Pressed(Vec<(usize, Stored<PathEnd>)>, Option<Failure>),
    Frictionless(Stored<Vec<PressLimit>>),
}

/// Runs the pieces that are not finished yet: the presses, then the slides from each depth.
fn all_runs(args: &Args, config: &Config, finger: &Finger, hash: &str, folder: &Path) -> Result<Runs, Failure> {
    let pieces = Pieces { config, finger, hash, folder, bars: Bars::default() };
    let depths = &config.experiment.depths_mm;
    let mut frictionless = read_stored(&pieces.frictionless_file(), hash);
    let mut done: Vec<Option<Stored<Trajectory>>> =
        depths.iter().map(|&d| read_stored(&pieces.file(d), hash)).collect();

    let finished = done.iter().flatten().count() + usize::from(frictionless.is_some());
    if finished > 0 {
        println!("{finished} of {} pieces were finished before", depths.len() + 1);
    }
    let missing: Vec<usize> = (0..depths.len()).filter(|&k| done[k].is_none()).collect();
    let threads = args.jobs.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    let _keeping = keeping();
    let is_pressed = [true, false].into_iter().filter(|&is_pressed| is_pressed || frictionless.is_none());
    let first = in_threads(is_pressed, threads, |is_pressed| match is_pressed {
        true => {
            let (reached, failure) = pieces.press(&missing);
            Ok(First::Pressed(reached, failure))
        }
        false => pieces.frictionless().map(First::Frictionless),
    })?;
    for piece in first {
        match piece {
            First::Frictionless(limits) => frictionless = Some(limits),
            First::Pressed(pressed, failure) => {
                let slid =
                    in_threads(pressed, threads, |(k, pressed)| Ok::<_, Failure>((k, pieces.slides(k, pressed)?)))?;
                slid.into_iter().for_each(|(k, stored)| done[k] = Some(stored));
                failure.map_or(Ok(()), Err)?;
            }
        }
    }
    match (frictionless, done.into_iter().collect::<Option<Vec<_>>>()) {
        (Some(frictionless), Some(depths)) => Ok(Runs { frictionless, depths }),
        _ => Err(Failure::Interrupted(format!("finished depths are kept in {}", folder.display()))),
    }
}

impl Pieces<'_> {
    fn file(&self, depth_mm: f64) -> PathBuf {
        self.folder.join(format!("depth_{depth_mm:.4}mm.bin"))
    }

    /// State of the press at a depth.
    fn pressed_file(&self, depth_mm: f64) -> PathBuf {
        self.folder.join(format!("pressed_{depth_mm:.4}mm.state"))
    }

    fn frictionless_file(&self) -> PathBuf {
        self.folder.join("frictionless.bin")
    }

    /// Presses through the depths to each of the `missing` ones (rising); returns those that it reached, and why it ended before.
    fn press(&self, missing: &[usize]) -> (Vec<(usize, Stored<PathEnd>)>, Option<Failure>) {
        let mut reached: Vec<(usize, Stored<PathEnd>)> = Vec::new();
        let mut failure = None;
        for k in 0..missing.last().map_or(0, |last| last + 1) {
            let file = self.pressed_file(self.config.experiment.depths_mm[k]);
            let from = reached.last().map(|(_, from)| &from.result);
            match read_stored(&file, self.hash).map_or_else(|| self.press_on(k, from, &file), Ok) {
                Ok(pressed) => reached.push((k, pressed)),
                Err(error) => {
                    failure = Some(error);
                    break;
                }
            }
        }
        reached.retain(|(k, _)| missing.contains(k));
        (reached, failure)
    }

    /// Presses from one depth to the next.
    fn press_on(&self, k: usize, from: Option<&PathEnd>, file: &Path) -> Result<Stored<PathEnd>, Failure> {
        let depth_mm = self.config.experiment.depths_mm[k];
        self.run(&format!("press to {depth_mm:.2} mm"), file, |checkpoint, progress| {
            let end = experiment::press(self.config, self.finger, depth_mm, from, Some(checkpoint), progress)?;
            let cpu_s = end.cost().cpu_s - from.map_or(0.0, |from| from.cost().cpu_s);
            Ok((end, cpu_s))
        })
    }

    /// The slides at a depth; their time includes that of the press from the depth before.
    fn slides(&self, k: usize, pressed: Stored<PathEnd>) -> Result<Stored<Trajectory>, Failure> {
        let depth_mm = self.config.experiment.depths_mm[k];
        let Stored { wall_s, cpu_s, result: from, .. } = pressed;
        let file = self.file(depth_mm);
        let mut stored = self.run(&format!("depth {depth_mm:.2} mm"), &file, |checkpoint, progress| {
            let (config, finger) = (self.config, self.finger);
            let slid = experiment::press_and_slide(config, finger, depth_mm, Some(&from), Some(checkpoint), progress)?;
            let slide_s = slid.cost.cpu_s - from.cost().cpu_s;
            Ok((slid, cpu_s + slide_s))
        })?;
        stored.wall_s += wall_s;
        let cost = &stored.result.cost;
        println!(
            "depth {depth_mm:.2} mm: {} increments, {} iterations, {} cut back, {:.1} s CPU",
            cost.increments, cost.iterations, cost.cutbacks, stored.cpu_s
        );
        Ok(stored)
    }

    fn frictionless(&self) -> Result<Stored<Vec<PressLimit>>, Failure> {
        self.run("frictionless", &self.frictionless_file(), |checkpoint, progress| {
            let mut cpu_s = 0.0;
            let limits = experiment::frictionless(self.config, self.finger, Some(checkpoint), &mut |now| {
                cpu_s = now.cost.cpu_s;
                progress(now)
            })?;
            Ok((limits, cpu_s))
        })
    }

    /// Runs a piece under its own progress bar and stores its result; `run` returns the result and its CPU time, s.
    fn run<T: Serialize>(
        &self,
        what: &str,
        file: &Path,
        run: impl FnOnce(Checkpoint, OnProgress) -> Result<(T, f64), LoadPathError>,
    ) -> Result<Stored<T>, Failure> {
        let start = Instant::now();
        let bar = self.bars.add(bar(what.into()));
        let checkpoint_file = file.with_extension("checkpoint");
        let checkpoint = Checkpoint { file: &checkpoint_file, period: CHECKPOINT_PERIOD, key: self.hash };
        let result = run(checkpoint, &mut |progress| {
            show(&bar, &progress);
            go_on()
        });
        bar.finish_and_clear();
        let kept = || format!("finished depths are kept in {}", self.folder.display());
        let (result, cpu_s) = result.map_err(|error| run_failure(error, what, kept()))?;
        let stored =
            Stored { settings_hash: self.hash.to_owned(), wall_s: start.elapsed().as_secs_f64(), cpu_s, result };
        let bytes = postcard::to_stdvec(&stored).map_err(|e| Failure::Input(e.into()))?;
        atomic_write(file, |w| w.write_all(&bytes))?;
        Ok(stored)
    }
}

/// A finished piece of the same settings; any other file counts as missing.
fn read_stored<T: DeserializeOwned>(file: &Path, hash: &str) -> Option<Stored<T>> {
    let stored: Stored<T> = postcard::from_bytes(&fs::read(file).ok()?).ok()?;
    (stored.settings_hash == hash).then_some(stored)
}

#[expect(clippy::too_many_arguments, reason = "each is a finished result")]
fn assemble(
    config: &Config,
    finger: &Finger,
    quality: &mesh::QualityReport,
    curvature_radius_mm: f64,
    hash: &str,
    table: &[fingerpad_identify::table_csv::Row],
    runs: &Runs,
    mesh_s: f64,
) -> BuildReport {
    let quantity = |name: &str, value: f64, unit: &str| Quantity { name: name.into(), value, unit: unit.into() };
    let mut stages = vec![Stage { name: "mesh".into(), wall_s: mesh_s, cpu_s: mesh_s }];
    let mut depths = Vec::new();
    for ((stored, &depth_mm), limit) in
        runs.depths.iter().zip(&config.experiment.depths_mm).zip(&runs.frictionless.result)
    {
        let trajectory = &stored.result;
        stages.push(Stage { name: format!("depth {depth_mm:.2} mm"), wall_s: stored.wall_s, cpu_s: stored.cpu_s });
        let measured = table.iter().find(|row| (row.depth_mm - depth_mm).abs() < 1e-6).map(|row| Steady {
            normal_force_n: row.normal_force_n,
            friction_coefficient: row.friction_coefficient,
            contact_area_mm2: row.contact_area_mm2.unwrap_or(f64::NAN),
        });
        depths.push(DepthResult {
            depth_mm,
            kinetic: kinetic(trajectory),
            trajectory: trajectory.clone(),
            frictionless_friction_coefficient: Some(limit.friction_limit_n / limit.normal_force_n),
            measured,
        });
    }
    BuildReport {
        provenance: Provenance {
            quality: vec![
                quantity("worst scaled Jacobian, hexahedra", quality.worst_hex_scaled_jacobian, ""),
                quantity("worst scaled Jacobian, nail tetrahedra", quality.worst_tet_scaled_jacobian, ""),
                quantity("volume", quality.volume_mm3(), "mm³"),
                quantity("shortest edge", quality.min_edge_mm, "mm"),
                quantity("longest edge", quality.max_edge_mm, "mm"),
                quantity("pad radius along the finger at first touch", curvature_radius_mm, "mm"),
            ],
            stages,
            ..provenance::provenance(config, finger, hash)
        },
        checks: checks(config, &depths),
        depths,
        continuous: Vec::new(),
        left_out: Vec::new(),
        reduced: None,
    }
}

/// The state at the end of the slide if the whole contact slips there; NaN if not.
fn kinetic(trajectory: &Trajectory) -> Steady {
    match trajectory.responses.last() {
        Some(end) if end.stick_ratio <= 0.01 && end.normal_force_n > 0.0 => Steady {
            normal_force_n: end.normal_force_n,
            friction_coefficient: end.friction_x_n / end.normal_force_n,
            contact_area_mm2: end.contact_area_mm2,
        },
        _ => Steady { normal_force_n: f64::NAN, friction_coefficient: f64::NAN, contact_area_mm2: f64::NAN },
    }
}

fn checks(config: &Config, depths: &[DepthResult]) -> Vec<Check> {
    // Change of the friction over the last tenth of the slide.
    let drift = depths
        .iter()
        .filter_map(|depth| {
            let rows = &depth.trajectory.responses;
            let end = rows.last()?;
            let before = rows.iter().rfind(|r| r.slide_x_mm <= 0.9 * end.slide_x_mm)?;
            Some((before.friction_x_n / end.friction_x_n - 1.0).abs() * 100.0)
        })
        .fold(0.0, f64::max);
    let all: Vec<&Trajectory> = depths.iter().map(|depth| &depth.trajectory).collect();
    let mut checks = provenance::checks(config, &all);
    let change = "friction's change over the last tenth of the slide";
    checks.push(provenance::check(change, drift, "%", 1.0, drift <= 1.0));
    checks
}

/// Writes everything, the page last.
fn write_results(out: &Path, finger: &Finger, report: &BuildReport) -> Result<(), Failure> {
    let rendered = report::render(report, &finger.mesh).map_err(|e| Failure::Input(e.into()))?;
    for folder in ["responses", "fields"] {
        let folder = out.join(folder);
        fs::create_dir_all(&folder).with_context(|| format!("{}", folder.display())).map_err(Failure::Input)?;
    }
    fingerpad_fe::load_path::vtu::write_mesh(&out.join("mesh.vtu"), &finger.mesh)?;
    for depth in &report.depths {
        let name = format!("depth_{:.2}mm", depth.depth_mm);
        fingerpad_fe::load_path::response_csv::write(
            &out.join("responses").join(format!("{name}.csv")),
            &depth.trajectory.responses,
        )?;
        fingerpad_fe::load_path::vtu::write_series(
            &out.join("fields"),
            &name,
            &finger.mesh,
            &depth.trajectory.snapshots,
        )?;
    }
    results::write(out, &rendered.files("figures/", "report"))
}

/// A measured value, the model's and their difference; dashes without a measurement at that depth.
fn beside((measured, model): (Option<f64>, f64), width: [usize; 2], digits: [usize; 2]) -> String {
    let [wide, narrow] = width;
    let model_text = format!("{model:narrow$.0$}", digits[1]);
    match measured {
        Some(m) => format!("{m:wide$.0$} {model_text} {1:+5.0} %", digits[0], 100.0 * (model / m - 1.0)),
        None => format!("{:>wide$} {model_text} {:>5}  ", "-", "-"),
    }
}

fn print_summary(report: &BuildReport) {
    println!("\n          normal force, N        contact area, mm²       friction coefficient F/N");
    println!(
        "depth   measured  model  diff    measured  model  diff    measured  model  diff   law over frictionless p"
    );
    for depth in &report.depths {
        let model = &depth.kinetic;
        let [force, area, coefficient] =
            [|s: &Steady| s.normal_force_n, |s: &Steady| s.contact_area_mm2, |s: &Steady| s.friction_coefficient]
                .map(|of| (depth.measured.as_ref().map(of), of(model)));
        let percent = |a: f64, b: f64| 100.0 * (a / b - 1.0);
        println!(
            "{:4.2} mm {} {} {} {}",
            depth.depth_mm,
            beside(force, [8, 7], [3, 3]),
            beside(area, [8, 7], [1, 1]),
            beside(coefficient, [8, 7], [2, 3]),
            depth.frictionless_friction_coefficient.map_or(String::new(), |law| {
                format!("{law:10.3} ({:+.1} %)", percent(law, model.friction_coefficient))
            }),
        );
    }
    for check in report.checks.iter().filter(|c| !c.passed) {
        println!(
            "check failed: {}: {:.3} {} (bound {} {})",
            check.name, check.value, check.unit, check.bound, check.unit
        );
    }
}
