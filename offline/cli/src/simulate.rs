//! `fingerpad simulate`: the finite-element model along a path.

use std::{
    fs,
    path::{Component, Path, PathBuf},
    time::Duration,
};

use anyhow::{Context, anyhow, bail};
use fingerpad::Relaxation;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{
    Checkpoint, Finger, LoadPathError, Observed, Path as PlanePath, PathEnd, Problem, RunOptions, Trajectory, follow,
    path_csv, response_csv, vtu,
};
use fingerpad_fe::material::relaxation;
use fingerpad_report::simulation::{self, SimulationReport};

use super::config::ConfigFile;
use super::plausibility::{warn_of_depths, warn_of_no_contact, warn_of_size};
use super::probes::ProbeArgs;
use super::rigid_body::{BodyArgs, print_mesh_error, warn_of_contact_beyond, warn_of_fine_body};
use super::{
    Failure, LARGER_PADS, Mark, Model, Outputs, bar, go_on, keeping, make_finger_reaching, outputs, provenance,
    results, run_failure, show,
};

/// Follow a path of a rigid body with the finite-element model.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  printf 't_s,depth_mm,slide_x_mm,slide_y_mm\\n0,0,0,0\\n1,1,0,0\\n3,1,4,0\\n' > path.csv
  fingerpad simulate --path path.csv --mesh-preset coarse --out response.csv
  printf 't_s,depth_mm,slide_x_mm,slide_y_mm,spin_deg\\n' > s.csv
  printf '0,0,0,0,0\\n1,1,0,0,0\\n2,1,0,0,9\\n' >> s.csv
  fingerpad simulate --path s.csv --mesh-preset coarse --out twist.csv
  fingerpad simulate --path path.csv --mesh-preset coarse --out response.csv --report drawn
  fingerpad simulate --path path.csv --mesh-preset coarse --body cylinder --radius-mm 10 --axis-deg 90 --out pen.csv
  fingerpad simulate --path path.csv --mesh-preset coarse --reactions held.csv --out response.csv
  fingerpad simulate --path path.csv --mesh-preset coarse --probe papillae:0.7 --probe-out strain.csv --out response.csv
  fingerpad simulate --path path.csv --mesh-preset coarse --relaxation human-assumed --out relaxing.csv
  fingerpad simulate --path path.csv --shape a --lambda 1.5 --beta 1 --out coulomb.csv --vtu fields

The path has the columns t_s, depth_mm, slide_x_mm, slide_y_mm, linear between rows; normal_force_n in place of
depth_mm, friction_x_n and friction_y_n in place of the slides, drive by force. spin_deg (turn of the plane about its
normal, counter-clockwise from above), pitch_deg (angle of the finger to the plane, 10 to 70) and roll_deg (-30 to 30)
may follow, or spin_moment_n_mm, moment_y_n_mm and moment_x_n_mm in their place; without them the finger keeps the
pose of its shape. The response has a row at least at every row of the path.

--body sets another rigid body than the plane: a sphere, a cylinder or an edge, whose highest point is under first
touch of the pose at the start of the path; a hollow of a negative radius or a groove, whose lowest point is there; or
a file of heights. Depth counts along z from the place where finger and body first touch in each pose without a slide.
Slides and spin move the body as a whole, so that a slide on a sphere moves the finger off its top; pitch and roll
turn it about that point, to which moments and the centre of pressure refer. The contact area is that on the body.

--report draws the response and the contact, with the settings, the costs and warnings, into DIR/report.html; its
numbers are in report.json and its figures in figures/. The contact is drawn at the end of the first press, where the
plane turns and at the last row that presses, or at the rows of --map-rows.

--probe reads the tissue at points of a CSV file with the columns x_mm, y_mm and z_mm, or below_skin_mm for a depth
under the pad's skin, and a name in the column probe; papillae:0.7 puts a grid of 1 mm at 0.7 mm under the pad. The
file of --probe-out has a row for each row of the response and each probe: place, Green-Lagrange strain, its largest
and least principal value, strain energy density, and the rates of strain and energy since the row before. --reactions
writes force and moment of the supports at the nail, the bone and the cut end, along the axes of the mesh and about
the point of first touch in the neutral pose.

--relaxation lets the soft tissue relax: held, its shear stress falls as 1 plus the sum of the shares times
exp(-t/time). The pressure in the tissue, the nail and the bone with its joint stay elastic. The time column then counts,
and a hold has more rows. human-assumed has published times (4 ms, 70 ms, 1.4 s) and assumed shares (1, 0.6, 0.6). A
settings file has the same text as tissue.relaxation.

The files of --vtu contain displacement, Cauchy stress (MPa, tension positive; XX YY ZZ XY YZ XZ), von Mises stress,
pressure, Green-Lagrange strain, strain energy density and region of every element, and pressure, traction, slip and
stick of the faces of the pad.

The folders of --out, --vtu and --report are made if they are missing. Files of an earlier series of the same name in
the folder of --vtu are removed. An earlier response of simulate at --out is replaced, any other file only with
--force. A run that is interrupted or finds no equilibrium keeps the rows before in RESPONSE.partial.csv, which the
next run that reaches its end removes; an interrupted run resumes from RESPONSE.checkpoint. With --out - the rows up
to the end of the run are written to standard output and messages to standard error, and an interrupted run starts
again from the beginning; --path - reads standard input.")]
pub struct Args {
    /// Path of the plane (CSV); - for standard input
    #[arg(long, value_name = "PATH.csv")]
    path: PathBuf,
    /// Response to write (CSV); - for standard output
    #[arg(long, value_name = "RESPONSE.csv")]
    out: PathBuf,
    /// Replace a file at --out that this command did not write
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    model: Model,
    #[command(flatten)]
    body: BodyArgs,
    #[command(flatten)]
    probes: ProbeArgs,
    /// Factor of the friction law, MPa^(1-beta)
    #[arg(long, value_name = "L")]
    lambda: Option<f64>,
    /// Exponent of the friction law
    #[arg(long, value_name = "B", allow_negative_numbers = true)]
    beta: Option<f64>,
    /// Pressure-independent strength, MPa
    #[arg(long, value_name = "T")]
    tau0_mpa: Option<f64>,
    /// Elastic slip at the strength, mm
    #[arg(long, value_name = "G")]
    gamma_crit_mm: Option<f64>,
    /// Strength across an axis of the skin over the strength along it; 1 is isotropic friction
    #[arg(long, value_name = "R")]
    across_over_along: Option<f64>,
    /// Angle of that axis from x towards y in the undeformed finger, degrees
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    skin_axis_deg: Option<f64>,
    /// Branches of the soft tissue in place of tissue.relaxation: `human-assumed`, `none`, or SHARE:TIME_S of up to three
    /// branches, shares over the relaxed stiffness
    #[arg(long, value_name = "BRANCHES", value_parser = relaxation::parse)]
    relaxation: Option<Relaxation>,
    /// Folder for ParaView files, two per row of the path, with a .pvd
    #[arg(long, value_name = "DIR")]
    vtu: Option<PathBuf>,
    /// Folder for a page that draws the response
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Rows of the path, the first is 1, at which the report draws the contact
    #[arg(long, value_name = "ROW,...", value_delimiter = ',', requires = "report")]
    map_rows: Option<Vec<usize>>,
    /// Press without friction until the first row that slides
    #[arg(long)]
    frictionless_press: bool,
}

/// Most rows whose contact is drawn: as many as there are letters.
const MOST_MAP_ROWS: usize = 26;
/// Time between two saves of an unfinished run.
const CHECKPOINT_PERIOD: Duration = Duration::from_secs(5);

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let config = configuration(args)?;
    let path = path_csv::read(outputs::input(&args.path))?;
    let map_rows = map_rows(args, &path).map_err(Failure::Input)?;
    // The rows of an incomplete run are written beside the output, under another name.
    let partial =
        if outputs::is_standard(&args.out) { args.out.clone() } else { args.out.with_extension("partial.csv") };
    prepare_outputs(args, &config, &partial)?;
    warn_of_depths(&path);
    let hash = config.hash()?;
    for (trial, reach) in std::iter::once(1.0).chain(LARGER_PADS).enumerate() {
        let finger = make_finger_reaching(&config, &path, reach)?;
        if trial == 0 {
            config.check_path(&path, &finger).map_err(|e| Failure::Input(anyhow!("{}: {e}", args.path.display())))?;
            warn_of_fine_body(&finger);
            warn_of_size(&config, &finger.mesh);
        }
        let observed = args.probes.observed(&finger)?;
        let run = Run {
            args,
            config: &config,
            path: &path,
            finger: &finger,
            observed: observed.as_ref(),
            map_rows: map_rows.clone(),
            hash: if trial == 0 { hash.clone() } else { format!("{hash} {reach}") },
        };
        match run.follow() {
            Err(LoadPathError::BesidePad { t_s, .. }) if trial < LARGER_PADS.len() => eprintln!(
                "skin beside the pad reaches the plane at t = {t_s:.3} s: again with a pad that reaches {} times as high",
                LARGER_PADS[trial]
            ),
            result => return run.finish(result, &partial),
        }
    }
    unreachable!("the largest pad returns")
}

/// The configuration with the constants of the command line.
fn configuration(args: &Args) -> Result<Config, Failure> {
    let mut config = args.model.settings_on_any_body()?.0;
    args.body.apply(&mut config).map_err(Failure::Input)?;
    let law = &mut config.friction;
    for (flag, value, target, least) in [
        ("lambda", args.lambda, &mut law.lambda, 0.0),
        ("beta", args.beta, &mut law.beta, f64::NEG_INFINITY),
        ("tau0-mpa", args.tau0_mpa, &mut law.tau0_mpa, 0.0),
        ("gamma-crit-mm", args.gamma_crit_mm, &mut law.gamma_crit_mm, f64::MIN_POSITIVE),
        ("across-over-along", args.across_over_along, &mut law.across_over_along, f64::MIN_POSITIVE),
        ("skin-axis-deg", args.skin_axis_deg, &mut law.skin_axis_deg, f64::NEG_INFINITY),
    ] {
        if let Some(value) = value {
            if !(value.is_finite() && value >= least) {
                return Err(Failure::Input(anyhow!("--{flag} {value}: not a valid value")));
            }
            *target = value;
        }
    }
    config.numerics.load_steps.friction_while_pressing &= !args.frictionless_press;
    if let Some(relaxation) = args.relaxation {
        config.tissue.relaxation = relaxation;
    }
    if let Some(sentence) = relaxation::assumption(&config.tissue.relaxation) {
        eprintln!("{sentence}");
    }
    Ok(config)
}

/// Rows of the path, from 0, whose contact is drawn; none without a report.
fn map_rows(args: &Args, path: &PlanePath) -> anyhow::Result<Vec<usize>> {
    if args.report.is_none() {
        return Ok(Vec::new());
    }
    let Some(wanted) = &args.map_rows else { return Ok(simulation::default_map_rows(path)) };
    let count = path.waypoints.len();
    if let Some(row) = wanted.iter().find(|row| !(1..=count).contains(*row)) {
        bail!("--map-rows {row}: {} has the rows 1 to {count}", args.path.display());
    }
    if wanted.len() > MOST_MAP_ROWS {
        bail!("--map-rows: {} rows; at most {MOST_MAP_ROWS} are drawn", wanted.len());
    }
    let mut rows: Vec<usize> = wanted.iter().map(|row| row - 1).collect();
    rows.sort_unstable();
    rows.dedup();
    Ok(rows)
}

fn prepare_outputs(args: &Args, config: &Config, partial: &Path) -> Result<(), Failure> {
    let inputs = args.model.inputs(config).into_iter();
    let inputs =
        inputs.chain([("--path", Some(args.path.as_path())), ("--body", BodyArgs::input(config)), args.probes.input()]);
    let marks = || vec![Mark::beginning(response_csv::header(false) + "\n")];
    let mut outputs = Outputs::beside(inputs).stream("--out", &args.out, marks()).force(args.force);
    if let Some(checkpoint) = checkpoint_file(&args.out) {
        outputs = outputs.file("--out", Some(partial), marks());
        // The run's key is not known yet, so that any checkpoint is accepted here.
        outputs = outputs.file("--out", Some(&checkpoint), vec![Mark::beginning("@")]);
    }
    if let Some(folder) = &args.vtu {
        outputs = outputs.folder("--vtu", folder, &[]);
    }
    if let Some(folder) = &args.report {
        outputs = outputs.shared_folder("--report", folder, &["report.html", "report.json", "figures/"]);
    }
    args.probes.declare(outputs).prepare()
}

/// A run along a path, and its outputs.
struct Run<'a> {
    args: &'a Args,
    config: &'a Config,
    path: &'a PlanePath,
    finger: &'a Finger,
    observed: Option<&'a Observed>,
    /// Rows of the path, from 0, whose contact is drawn.
    map_rows: Vec<usize>,
    hash: String,
}

impl Run<'_> {
    /// Rows of the path at which the field is kept.
    fn snapshot_rows(&self) -> Vec<usize> {
        if self.args.vtu.is_some() { (0..self.path.waypoints.len()).collect() } else { self.map_rows.clone() }
    }

    fn follow(&self) -> Result<Trajectory, LoadPathError> {
        let bar = bar("simulate".into());
        let _keeping = keeping();
        let problem = Problem { observed: self.observed, ..self.config.problem(self.finger) };
        let rows = self.snapshot_rows();
        let mut progress = |progress| {
            show(&bar, &progress);
            go_on()
        };
        // The state contains the observed quantities.
        let key = format!("{} {:?}", self.hash, self.observed);
        let file = checkpoint_file(&self.args.out);
        let checkpoint = file.as_deref().map(|file| Checkpoint { file, period: CHECKPOINT_PERIOD, key: &key });
        let options = RunOptions { snapshots: &rows, checkpoint, ..RunOptions::default() };
        let result = follow(&problem, self.path, options, &mut progress);
        bar.finish_and_clear();
        result.map(PathEnd::into_trajectory)
    }

    /// Writes the result of the run, complete or not.
    ///
    /// * `partial`: file of the rows of a run that did not reach its end
    fn finish(&self, result: Result<Trajectory, LoadPathError>, partial: &Path) -> Result<(), Failure> {
        let Self { args, config, path, .. } = *self;
        match result {
            Ok(trajectory) => {
                self.save(&trajectory, &args.out, false)?;
                if partial != args.out && partial.exists() {
                    // Rows of an earlier run that did not reach its end; `prepare_outputs` has checked that they are.
                    fs::remove_file(partial).with_context(|| partial.display().to_string()).map_err(Failure::Input)?;
                }
                self.report(&trajectory, &args.out, None)?;
                print_costs(&args.out, &trajectory);
                if config.friction.lambda == 0.0 && config.friction.tau0_mpa == 0.0 {
                    eprintln!(
                        "note: the contact is frictionless: its stick_ratio of 0 and its regime slip have no other meaning"
                    );
                }
                warn_of_no_contact(path, &trajectory.responses);
                print_mesh_error(path, self.finger, &trajectory.responses, &args.out);
                warn_of_contact_beyond(self.finger, &trajectory.responses);
                Ok(())
            }
            Err(mut error) => {
                let mut kept = "nothing was kept".to_owned();
                let reached = error.take_reached();
                if !reached.responses.is_empty() {
                    self.save(&reached, partial, true)?;
                    kept = format!("{} rows kept in {}", reached.responses.len(), partial.display());
                    // An interrupted run resumes when it is started again, and must end at once.
                    if !matches!(error, LoadPathError::Interrupted { .. }) {
                        self.report(&reached, partial, Some(error.to_string()))?;
                    }
                }
                Err(run_failure(error, &args.path.display().to_string(), kept))
            }
        }
    }

    /// Writes the response, and the fields if requested.
    fn save(&self, trajectory: &Trajectory, out: &Path, is_partial: bool) -> Result<(), Failure> {
        response_csv::check(out, &trajectory.responses)?;
        outputs::write(out, |w| response_csv::write_to(w, &trajectory.responses, None))?;
        if let Some(observed) = self.observed {
            self.args.probes.save(observed, trajectory, is_partial)?;
        }
        if let Some(folder) = &self.args.vtu {
            let name = out.file_stem().filter(|_| !outputs::is_standard(out));
            let name = name.map_or("response".into(), |s| s.to_string_lossy());
            remove_series(folder, &name).map_err(Failure::Input)?;
            vtu::write_series(folder, &name, &self.finger.mesh, &trajectory.snapshots)?;
        }
        Ok(())
    }

    /// Writes the report, if requested.
    ///
    /// * `response`: the response's file, which exists
    /// * `ended_early`: reason for an early end of the run
    fn report(&self, trajectory: &Trajectory, response: &Path, ended_early: Option<String>) -> Result<(), Failure> {
        let Some(folder) = &self.args.report else { return Ok(()) };
        let mut trajectory = trajectory.clone();
        let kept = self.snapshot_rows().into_iter().zip(std::mem::take(&mut trajectory.snapshots));
        trajectory.snapshots = kept.filter(|(row, _)| self.map_rows.contains(row)).map(|(_, field)| field).collect();
        let settings = ConfigFile::of(
            self.config,
            &fingerpad_identify::Settings::default(),
            &fingerpad_reduce::DesignSettings::default(),
        );
        let report = SimulationReport {
            path_name: self.args.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            row_times_s: self.path.waypoints.iter().map(|w| w.t_s).collect(),
            response_link: match outputs::is_standard(response) {
                true => None,
                false => Some(link(folder, response).map_err(Failure::Input)?),
            },
            provenance: provenance::provenance(self.config, self.finger, &self.hash),
            settings: toml::to_string(&settings).map_err(|e| Failure::Input(e.into()))?,
            checks: provenance::checks(self.config, &[&trajectory]),
            trajectory,
            map_rows: self.map_rows.clone(),
            ended_early,
        };
        let rendered = simulation::render(&report, &self.finger.mesh).map_err(|e| Failure::Input(e.into()))?;
        results::write(folder, &rendered.files("figures/", "report"))?;
        outputs::say(&self.args.out, &folder.join("report.html").display().to_string());
        Ok(())
    }
}

/// File of the state of an unfinished run; None if the response is written to standard output.
fn checkpoint_file(out: &Path) -> Option<PathBuf> {
    (!outputs::is_standard(out)).then(|| out.with_extension("checkpoint"))
}

/// One line about a run that reached its end.
fn print_costs(out: &Path, trajectory: &Trajectory) {
    let cost = &trajectory.cost;
    let line = format!(
        "{}: {} rows; {} increments, {} iterations, {} cut back, {:.1} s CPU",
        out.display(),
        trajectory.responses.len(),
        cost.increments,
        cost.iterations,
        cost.cutbacks,
        cost.cpu_s
    );
    outputs::say(out, &line);
}

/// The relative path from a folder to a file, which both exist.
fn link(folder: &Path, file: &Path) -> anyhow::Result<String> {
    let whole = |path: &Path| fs::canonicalize(path).with_context(|| path.display().to_string());
    let (from, to) = (whole(folder)?, whole(file)?);
    let common = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(common).map(|_| Component::ParentDir);
    let way: PathBuf = up.chain(to.components().skip(common)).collect();
    Ok(way.to_string_lossy().into_owned())
}

/// Removes the files of an earlier series: `NAME.pvd`, `NAME_0000.vtu`, `NAME_pad_0000.vtu` and so on.
fn remove_series(folder: &Path, name: &str) -> anyhow::Result<()> {
    let of_series = |file: &str| {
        let Some(rest) = file.strip_prefix(name) else { return false };
        let number = rest.strip_suffix(".vtu").map(|r| r.strip_prefix("_pad").unwrap_or(r));
        let digits = number.and_then(|n| n.strip_prefix('_'));
        rest == ".pvd" || digits.is_some_and(|d| d.len() >= 4 && d.bytes().all(|b| b.is_ascii_digit()))
    };
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let file = entry.with_context(|| folder.display().to_string())?.path();
        if file.file_name().is_some_and(|f| of_series(&f.to_string_lossy())) {
            fs::remove_file(&file).with_context(|| file.display().to_string())?;
        }
    }
    Ok(())
}
