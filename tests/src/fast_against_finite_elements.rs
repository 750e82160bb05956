//! The reduced models along finite-element runs that no fit has seen: the table in `data/reference` and its page.
//!
//! Main types: [`Models`], [`Entry`]. [`chosen_runs`] states which runs the table holds; [`to_csv`] writes it and [`from_csv`] reads
//! its forces; `page` makes the page's tables.

mod page;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad_fe::contact::Outline;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_reduce::pad::{PadModel, replay as replay_pad};
use fingerpad_reduce::{Kind, Run, Sample, replay as replay_springs};

pub use page::{charts, put_tables, with_tables};

/// Why a table cannot be made or read.
pub type Failure = Box<dyn std::error::Error>;

/// The models in the order of the columns, and their files from the root of the repository.
pub const MODELS: [(&str, &str); 3] = [
    ("springs", "data/models/fingertip.fpm"),
    ("pad_24", "data/reference/fingertip-pad-24.fpm"),
    ("pad_37", "data/models/fingertip-pad.fpm"),
];
/// The table, from the root of the repository.
pub const TABLE: &str = "data/reference/fast_against_finite_elements.csv";
/// The page that shows it.
pub const PAGE: &str = "docs/fast-against-finite-elements.md";

/// Held-out runs of each kind that the table holds, the first by name. Of the kind `body` it holds all, since each has another body.
const RUNS_OF_A_KIND: usize = 2;
/// Arm by which friction counts as a moment, mm: about the radius of the contact.
const ARM_MM: f64 = 3.0;
/// Friction law of the finite elements, lambda and beta. Half of its strength under an even pressure is the least friction by which
/// errors are divided: a press or a spin has hardly any.
const LAW: [f64; 2] = [0.086, 0.46];

const RUN_COLUMNS: [&str; 6] = ["run", "kind", "body", "radius_mm", "axis_deg", "angle_deg"];
const MOTION_COLUMNS: [&str; 7] = ["t_s", "depth_mm", "slide_x_mm", "slide_y_mm", "spin_deg", "pitch_deg", "roll_deg"];
const FORCE_COLUMNS: [&str; 5] = ["normal_force_n", "friction_x_n", "friction_y_n", "spin_moment_n_mm", "stick_ratio"];
const ERROR_COLUMNS: [&str; 4] =
    ["normal_error_percent", "friction_error_percent", "moment_error_percent", "stick_ratio_error"];
/// Columns before those of the models: of the run, its motion, and the forces and area of the finite elements.
pub const COLUMNS_OF_RUN: usize = RUN_COLUMNS.len() + MOTION_COLUMNS.len() + FORCE_COLUMNS.len() + 1;

/// Normal force, friction along x and y, N, moment about the normal, N mm, and stick ratio.
pub type Forces = [f64; 5];

/// The shipped models.
pub struct Models {
    springs: ModelFile,
    pads: Vec<PadModel>,
    outline: Outline,
}

/// A run of the table: its motion with the forces of the finite elements, and the forces of every model.
pub struct Entry {
    /// The run.
    pub run: Run,
    /// Forces of each of [`MODELS`] at every sample; None of a model that the motion is not for.
    pub forces: Vec<Option<Vec<Forces>>>,
}

impl Models {
    /// Reads the models below the root of the repository.
    ///
    /// # Errors
    /// A file that is not there or not a model.
    pub fn read(root: &Path) -> Result<Self, Failure> {
        let bytes = |file: &str| std::fs::read(root.join(file)).map_err(|e| format!("{file}: {e}"));
        let [(_, springs), pads @ ..] = MODELS;
        let pad = |file: &str| -> Result<PadModel, Failure> {
            let file = PadModelFile::new(&bytes(file)?).map_err(|e| format!("{file}: {e}"))?;
            Ok(PadModel::of(&file.file().pad))
        };
        let config = Config { mesh_preset: MeshPreset::Medium, ..Config::default() };
        Ok(Self {
            springs: ModelFile::new(&bytes(springs)?)?,
            pads: pads.iter().map(|(_, file)| pad(file)).collect::<Result<_, _>>()?,
            outline: config.finger()?.0.outline.ok_or("the default finger has a smooth surface")?,
        })
    }

    /// Steps every model along a run. The springs are a model of one pose on a plane.
    pub fn entry(&self, run: Run) -> Entry {
        let springs = run.is_representable().then(|| {
            replay_springs(&self.springs.file().model, &run)
                .iter()
                .map(|r| {
                    let [x, y] = r.friction_n;
                    [r.normal_force_n, x, y, r.spin_moment_n_mm, r.stick_ratio].map(f64::from)
                })
                .collect()
        });
        let pad = |model: &PadModel| {
            let forces = |r: &fingerpad::Response<f64>| {
                let [x, y] = r.friction_n;
                [r.normal_force_n, x, y, r.spin_moment_n_mm, r.stick_ratio]
            };
            Some(replay_pad(model, &run, &self.outline).iter().map(forces).collect())
        };
        let forces = std::iter::once(springs).chain(self.pads.iter().map(pad)).collect();
        Entry { forces, run }
    }
}

/// Of all stored runs those of the table: the first two held-out runs of each kind by name, and all held-out runs on bodies.
///
/// # Errors
/// A folder or a run that cannot be read.
pub fn chosen_runs(folder: &Path) -> Result<Vec<Run>, Failure> {
    let mut of_kind: BTreeMap<Kind, Vec<Run>> = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))? {
        let file = entry?.path();
        if file.extension().is_some_and(|e| e == "fprun") {
            let run = Run::from_bytes(&std::fs::read(&file)?, &file)?;
            if run.held_out {
                of_kind.entry(run.kind).or_default().push(run);
            }
        }
    }
    let first = |(kind, mut runs): (Kind, Vec<Run>)| {
        runs.sort_by(|a, b| a.name.cmp(&b.name));
        runs.truncate(if kind == Kind::Body { usize::MAX } else { RUNS_OF_A_KIND });
        runs
    };
    Ok(of_kind.into_iter().flat_map(first).collect())
}

/// Forces of the finite elements, rounded as in the table.
pub fn elements(s: &Sample) -> Forces {
    let [x, y] = s.friction_n;
    [s.normal_force_n, x, y, s.turned.map_or(0.0, |t| t.moment_n_mm[2]), s.stick_ratio].map(|x| rounded(x.into(), 5))
}

/// A number with that many decimals.
fn rounded(x: f64, count: usize) -> f64 {
    decimals(x, count).parse().expect("a number")
}

impl Entry {
    /// The normal force, friction, and moment by which errors of the run are divided: its largest normal force; its largest friction,
    /// at least half of the law's strength under an even pressure; that friction times 3 mm.
    pub fn scale(&self) -> [f64; 3] {
        let [lambda, beta] = LAW;
        let [normal, friction] = self.run.samples.iter().fold([1e-9; 2], |[normal, friction], s| {
            let [n, x, y, ..] = elements(s);
            let even = 0.5 * lambda * n.max(0.0).powf(beta) * rounded(s.contact_area_mm2.into(), 3).powf(1.0 - beta);
            [f64::max(normal, n), friction.max(x.hypot(y)).max(even)]
        });
        [normal, friction, ARM_MM * friction]
    }

    /// Errors of a model at a row: normal force and moment with their signs, %, friction as the length of the difference, %, and the stick
    /// ratio with its sign.
    pub fn errors(&self, model: usize, row: usize) -> Option<[f64; 4]> {
        let [n, x, y, m, stick] = self.forces[model].as_ref()?[row];
        let [fe_n, fe_x, fe_y, fe_m, fe_stick] = elements(&self.run.samples[row]);
        let [normal, friction, moment] = self.scale();
        let [normal, friction, moment] =
            [(n - fe_n) / normal, (x - fe_x).hypot(y - fe_y) / friction, (m - fe_m) / moment].map(|e| 100.0 * e);
        Some([normal, friction, moment, stick - fe_stick])
    }
}

/// Names of the columns.
fn columns() -> Vec<String> {
    let of_run = RUN_COLUMNS.iter().chain(&MOTION_COLUMNS).map(|name| (*name).to_owned());
    let area = ["elements_contact_area_mm2".to_owned()];
    let elements = FORCE_COLUMNS.iter().map(|name| format!("elements_{name}")).chain(area);
    let of_models = MODELS
        .iter()
        .flat_map(|(model, _)| FORCE_COLUMNS.iter().chain(&ERROR_COLUMNS).map(move |name| format!("{model}_{name}")));
    of_run.chain(elements).chain(of_models).collect()
}

/// The table. Motions have all digits of their single precision, so that they lead through the same steps again.
pub fn to_csv(entries: &[Entry]) -> String {
    let mut text = columns().join(",") + "\n";
    for entry in entries {
        let run = &entry.run;
        let body = &run.body;
        let kind = serde_json::to_string(&body.kind).expect("a name").replace('"', "");
        let number = |x: Option<f64>| x.map_or_else(String::new, |x| x.to_string());
        let head = [
            run.name.clone(),
            run.kind.as_str().to_owned(),
            kind,
            number(body.radius_mm),
            number(body.axis_deg),
            number(body.angle_deg),
        ];
        for (row, s) in run.samples.iter().enumerate() {
            let turned = s.turned.unwrap_or_default();
            let [x, y] = s.slide_mm;
            let motion = [s.t_s, s.depth_mm, x, y, turned.spin_deg, turned.pitch_deg, turned.roll_deg];
            let mut cells = head.to_vec();
            cells.extend(motion.map(|x| x.to_string()));
            cells.extend(elements(s).map(|x| decimals(x, 5)));
            cells.push(decimals(s.contact_area_mm2.into(), 3));
            for model in 0..MODELS.len() {
                match (&entry.forces[model], entry.errors(model, row)) {
                    (Some(forces), Some(errors)) => {
                        cells.extend(forces[row].map(|x| decimals(x, 5)));
                        cells.extend(errors.map(|x| decimals(x, 2)));
                    }
                    _ => cells.extend(std::iter::repeat_n(String::new(), FORCE_COLUMNS.len() + ERROR_COLUMNS.len())),
                }
            }
            writeln!(text, "{}", cells.join(",")).expect("writing to a string");
        }
    }
    text
}

/// A number with that many decimals, without a negative zero.
fn decimals(x: f64, count: usize) -> String {
    let text = format!("{x:.count$}");
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') { text.replace('-', "") } else { text }
}

/// The runs with the forces that the table states of each model.
///
/// # Errors
/// A table with other columns or another number of rows, or a force that is not a number.
pub fn from_csv(text: &str, runs: Vec<Run>) -> Result<Vec<Entry>, Failure> {
    let mut lines = text.lines();
    let columns = columns();
    if lines.next() != Some(columns.join(",").as_str()) {
        return Err(format!("the columns are not {columns:?}").into());
    }
    let of_model = FORCE_COLUMNS.len() + ERROR_COLUMNS.len();
    let mut entries = Vec::new();
    for run in runs {
        let mut forces = vec![None; MODELS.len()];
        for _ in &run.samples {
            let cells: Vec<&str> = lines.next().ok_or("too few rows")?.split(',').collect();
            for (model, forces) in forces.iter_mut().enumerate() {
                let at = COLUMNS_OF_RUN + model * of_model;
                let cells = cells.get(at..at + FORCE_COLUMNS.len()).ok_or("too few cells")?;
                if !cells[0].is_empty() {
                    let mut row: Forces = [0.0; 5];
                    for (force, cell) in row.iter_mut().zip(cells) {
                        *force = cell.parse().map_err(|e| format!("`{cell}`: {e}"))?;
                    }
                    forces.get_or_insert_with(Vec::new).push(row);
                }
            }
        }
        entries.push(Entry { run, forces });
    }
    if lines.next().is_some() { Err("too many rows".into()) } else { Ok(entries) }
}
