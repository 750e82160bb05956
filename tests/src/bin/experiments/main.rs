//! Two fingers of finite elements against published experiments: one page with a table and a figure each.
//!
//! The finger of the paper has the published constants, with no tuning. The tissue of the other one stiffens, with constants
//! of a fit. `--fit` fits each effect that the paper's finger may lack to five numbers of a press.

mod fit;
mod grip;
mod lab;
mod press;
mod slide;
mod time;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use clap::Parser;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_formats::in_threads;
use fingerpad_report::{TraceChart, traces_svg};

use lab::{Failure, Lab, Line};

#[derive(Parser)]
#[command(about = "The finite elements against nine groups of published experiments", name = "experiments")]
struct Args {
    /// Folder of the page and its figures
    #[arg(long, default_value = "target/experiments")]
    out: PathBuf,
    /// Names of experiments; all without any
    names: Vec<String>,
    /// Coarse mesh: minutes in place of half an hour, and coarser numbers
    #[arg(long)]
    coarse: bool,
    /// Threads; an experiment runs on one
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// First fits each effect that the paper's finger may lack, on the coarse mesh: some ten minutes
    #[arg(long)]
    fit: bool,
}

/// Result of an experiment.
struct Finding {
    /// The measured quantity, in a few words.
    title: &'static str,
    /// Authors, year, journal.
    source: &'static str,
    /// The published result.
    published: &'static str,
    /// Numbers beside their bands, which were fixed before any fit.
    lines: Vec<Line>,
    /// Further remarks for the reader.
    remark: String,
    charts: Vec<TraceChart>,
}

type Experiment = fn(&Lab) -> Result<Finding, Failure>;

/// Name of each experiment, which also names its figure.
const EXPERIMENTS: [(&str, Experiment); 9] = [
    ("stick", slide::stick),
    ("area", slide::area),
    ("strain", slide::strain),
    ("torque", grip::torque),
    ("curvature", grip::curvature),
    ("load", press::load),
    ("indentation", press::indentation),
    ("table", press::table),
    ("time", time::time),
];

/// The fingers by name, in the order of the page's columns.
const FINGERS: [&str; 2] = ["paper", "stiffening"];

/// Name of the second finger's configuration.
const STIFFENING: &str = "human-stiffening";

fn main() -> Result<(), Failure> {
    let args = Args::parse();
    if let Some(unknown) = args.names.iter().find(|name| EXPERIMENTS.iter().all(|(known, _)| known != name)) {
        let known: Vec<&str> = EXPERIMENTS.iter().map(|(name, _)| *name).collect();
        return Err(format!("{unknown}: no such experiment; there are {}", known.join(", ")).into());
    }
    let pictures = args.out.join("pictures");
    std::fs::create_dir_all(&pictures).map_err(|e| format!("{}: {e}", pictures.display()))?;
    let preset = if args.coarse { MeshPreset::Coarse } else { MeshPreset::Medium };
    let fitted = if args.fit { fit::section(&args.out, preset, args.jobs)? } else { String::new() };
    let stiffening = Config::read(Path::new(STIFFENING))?;
    let labs = [Config::default(), stiffening].map(|config| Lab::new(config, preset));
    let wanted: Vec<_> = (0..EXPERIMENTS.len())
        .filter(|&k| args.names.is_empty() || args.names.iter().any(|wanted| wanted == EXPERIMENTS[k].0))
        .flat_map(|k| (0..labs.len()).map(move |finger| (k, finger)))
        .collect();
    let found = Mutex::new(Vec::new());
    in_threads(&wanted, args.jobs, |&(k, finger)| {
        let (name, experiment) = EXPERIMENTS[k];
        let finding = experiment(&labs[finger]).map_err(|e| format!("{name}, {}: {e}", FINGERS[finger]))?;
        eprintln!("{name}, {}: {}", FINGERS[finger], inside(&finding.lines));
        let mut found = found.lock().expect("no panic while locked");
        found.push(((k, finger), finding));
        // An interrupted program keeps its results.
        write_page(&args.out, &labs[0], &fitted, &mut found).map_err(|e| e.to_string())
    })?;
    println!("{}", args.out.join(PAGE).display());
    Ok(())
}

/// Name of the page.
const PAGE: &str = "experiments.md";

/// A finding of an experiment (its place in the list) with a finger (likewise).
type Found = ((usize, usize), Finding);

/// Writes the page of the results so far, in the order of the list, and its figures.
fn write_page(folder: &Path, lab: &Lab, fitted: &str, found: &mut [Found]) -> Result<(), Failure> {
    found.sort_by_key(|(place, _)| *place);
    let experiments: Vec<&[Found]> = found.chunk_by(|a, b| a.0.0 == b.0.0).collect();
    let mut page = page_head(lab);
    page += "\n| experiment | lines inside: paper | stiffening |\n|---|---|---|\n";
    for of_one in &experiments {
        let cell = |finger| {
            let lines = of_one.iter().find(|((_, f), _)| *f == finger).map(|(_, finding)| &finding.lines);
            lines.map_or(String::new(), |lines| inside(lines))
        };
        writeln!(page, "| {} | {} | {} |", of_one[0].1.title, cell(0), cell(1))?;
    }
    page += fitted;
    page += &moved(&experiments);
    for of_one in experiments {
        write_finding(folder, &mut page, of_one)?;
    }
    Ok(std::fs::write(folder.join(PAGE), page)?)
}

/// How many lines are inside their bands.
fn inside(lines: &[Line]) -> String {
    format!("{} of {}", lines.iter().filter(|line| line.gap() == 0.0).count(), lines.len())
}

/// What became of the numbers that the paper's finger has outside their bands, and of those inside.
fn moved(experiments: &[&[Found]]) -> String {
    let both = experiments.iter().filter_map(|of_one| match of_one {
        [(_, paper), (_, other)] => Some((paper.title, paper.lines.iter().zip(&other.lines))),
        _ => None,
    });
    let mut text = String::from(
        "\n## What moved\n\nThe numbers that the paper's finger has outside their bands. The last column is the change of the distance \
         from the band; -100 % is inside.\n\n| experiment | number | band | paper | stiffening | distance, % |\n|---|---|---|---|---|---|\n",
    );
    let (mut left, mut half, mut half_unfitted, mut outside) = (Vec::new(), 0, 0, 0);
    for (title, lines) in both {
        for (paper, other) in lines {
            if paper.gap() == 0.0 {
                left.extend(
                    (other.gap() > 0.0).then(|| format!("{} ({})", paper.name, other.text().replace("**", ""))),
                );
                continue;
            }
            let change = 100.0 * (other.gap() / paper.gap() - 1.0);
            outside += 1;
            half += usize::from(change <= -50.0);
            half_unfitted += usize::from(change <= -50.0 && !paper.fitted);
            let [low, high] = paper.band.map(|edge| format!("{edge:.*}", paper.digits));
            let (name, fitted) = (&paper.name, if paper.fitted { " (fitted)" } else { "" });
            let numbers = [paper, other].map(Line::text).join(" | ");
            text += &format!("| {title} | {name}{fitted} | {low} to {high} | {numbers} | {change:+.0} |\n");
        }
    }
    let left = if left.is_empty() { "none".into() } else { left.join("; ") };
    text += &format!(
        "\n{half} of {outside} came nearer by half or more, {half_unfitted} of them not fitted. Left their bands: {left}.\n"
    );
    text
}

fn page_head(lab: &Lab) -> String {
    format!(
        "# What the published finger lacks: nine experiments\n\nThis page compares two fingers of finite elements with nine groups of published \
         experiments, which other groups made with other fingers.\n\n- **paper**: shape E with the material constants and the friction \
         law that Yoshida, Tada and Mochimaru published in 2011 for one subject. Nothing is tuned. It is the default of every \
         command.\n- **stiffening**: the same finger with tissue that stiffens and friction nearer to \
         proportional (`--config {STIFFENING}`). Its constants are those of the fit below. Its pad and bed are in the gallery.\n\nEach number has a band with two sides, taken from its publication before \
         any fit. Where a paper gives words only, the band is our reading of them. Where only its abstract was accessible, the \
         comparison is with the abstract. A number outside its band is bold. Mesh `{}`.\n\n`cargo xtask experiments` computes all numbers \
         and figures; with `--fit` it also finds the missing effect and its constants again.\n",
        lab.mesh_name()
    )
}

fn write_finding(folder: &Path, page: &mut String, of_one: &[Found]) -> Result<(), Failure> {
    let Finding { title, source, published, remark, lines, .. } = &of_one[0].1;
    write!(page, "\n## {title}\n\n{source}\n\nPublished: {published}\n\n| | band |")?;
    for ((_, finger), _) in of_one {
        write!(page, " {} |", FINGERS[*finger])?;
    }
    page.push_str(&format!("\n|---|---|{}\n", "---|".repeat(of_one.len())));
    for (row, line) in lines.iter().enumerate() {
        let [low, high] = line.band;
        let digits = line.digits;
        let fitted = if line.fitted { " (fitted)" } else { "" };
        write!(page, "| {}{fitted} | {low:.digits$} to {high:.digits$} |", line.name)?;
        for (_, finding) in of_one {
            write!(page, " {} |", finding.lines[row].text())?;
        }
        page.push('\n');
    }
    if !remark.is_empty() {
        write!(page, "\n{remark}\n")?;
    }
    for ((k, finger), finding) in of_one {
        let name = FINGERS[*finger];
        let named = |chart: &TraceChart| TraceChart { title: format!("{name}: {}", chart.title), ..chart.clone() };
        let figure = format!("pictures/experiment_{}_{name}.svg", EXPERIMENTS[*k].0);
        std::fs::write(folder.join(&figure), traces_svg(&finding.charts.iter().map(named).collect::<Vec<_>>()))?;
        write!(page, "\n![{title}: {name}]({figure})\n")?;
    }
    Ok(())
}
