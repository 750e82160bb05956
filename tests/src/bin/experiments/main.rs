//! The finite elements against published experiments: one page with a figure and a verdict each.
//!
//! The finger is the one that ships (shape E, published constants), with no tuning.

mod grip;
mod lab;
mod press;
mod slide;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::Parser;
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_report::{TraceChart, traces_svg};

use lab::{Failure, Lab};

#[derive(Parser)]
#[command(about = "The finite elements against eight published experiments", name = "experiments")]
struct Args {
    /// Folder of the page and its figures
    #[arg(long, default_value = "target/experiments")]
    out: PathBuf,
    /// Names of experiments; all without any
    names: Vec<String>,
    /// Coarse mesh: minutes in place of a quarter of an hour, and coarser numbers
    #[arg(long)]
    coarse: bool,
    /// Threads; an experiment runs on one
    #[arg(long, default_value_t = 2)]
    jobs: usize,
}

/// Result of an experiment.
struct Finding {
    /// The measured quantity, in a few words.
    title: &'static str,
    /// Authors, year, journal.
    source: &'static str,
    /// The published result.
    published: &'static str,
    /// The result of the finite elements.
    found: String,
    /// Whether that agrees, and the difference if not.
    verdict: String,
    /// Further remarks for the reader.
    remark: String,
    charts: Vec<TraceChart>,
}

type Experiment = fn(&Lab) -> Result<Finding, Failure>;

/// Name of each experiment, which also names its figure.
const EXPERIMENTS: [(&str, Experiment); 8] = [
    ("stick", slide::stick),
    ("area", slide::area),
    ("strain", slide::strain),
    ("torque", grip::torque),
    ("curvature", grip::curvature),
    ("load", press::load),
    ("indentation", press::indentation),
    ("table", press::table),
];

fn main() -> Result<(), Failure> {
    let args = Args::parse();
    if let Some(unknown) = args.names.iter().find(|name| EXPERIMENTS.iter().all(|(known, _)| known != name)) {
        let known: Vec<&str> = EXPERIMENTS.iter().map(|(name, _)| *name).collect();
        return Err(format!("{unknown}: no such experiment; there are {}", known.join(", ")).into());
    }
    let wanted: Vec<_> = (EXPERIMENTS.into_iter())
        .filter(|(name, _)| args.names.is_empty() || args.names.iter().any(|wanted| wanted == name))
        .collect();
    std::fs::create_dir_all(&args.out).map_err(|e| format!("{}: {e}", args.out.display()))?;
    let preset = if args.coarse { MeshPreset::Coarse } else { MeshPreset::Medium };
    let lab = Lab::new(preset);
    let (next, found) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let failed = Mutex::new(None);
    std::thread::scope(|scope| {
        for _ in 0..args.jobs.clamp(1, wanted.len()) {
            scope.spawn(|| {
                while let Some((name, experiment)) = wanted.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let kept = experiment(&lab).and_then(|finding| {
                        eprintln!("{name}: {}", finding.verdict);
                        let mut found = found.lock().expect("no panic while locked");
                        found.push((*name, finding));
                        // An interrupted program keeps its results.
                        write_page(&args.out, &lab, &mut found)
                    });
                    if let Err(error) = kept {
                        *failed.lock().expect("no panic while locked") = Some(format!("{name}: {error}"));
                    }
                }
            });
        }
    });
    if let Some(error) = failed.into_inner().expect("threads have ended") {
        return Err(error.into());
    }
    println!("{}", args.out.join(PAGE).display());
    Ok(())
}

/// Name of the page.
const PAGE: &str = "experiments.md";

/// Writes the page of the results so far, in the order of the list, and its figures.
fn write_page(folder: &Path, lab: &Lab, found: &mut [(&str, Finding)]) -> Result<(), Failure> {
    found.sort_by_key(|(name, _)| EXPERIMENTS.iter().position(|(known, _)| known == name));
    let mut page = page_head(lab);
    for (name, finding) in found {
        let figure = format!("experiment_{name}.svg");
        std::fs::write(folder.join(&figure), traces_svg(&finding.charts))?;
        write_finding(&mut page, finding, &figure)?;
    }
    Ok(std::fs::write(folder.join(PAGE), page)?)
}

fn page_head(lab: &Lab) -> String {
    format!(
        "# The finite elements against published experiments\n\nThis page compares the shipped finger with published experiments. The finger is shape E on the \
         mesh `{}`, with the material constants and the friction law that Yoshida, Tada and Mochimaru published in 2011 for one \
         subject. Nothing is tuned to the experiments, which other groups made with other fingers. A result outside the published \
         range therefore shows how far this finger is from theirs. Where only the abstract of a paper was accessible, the comparison \
         is with the abstract.\n\n`cargo xtask experiments` computes all numbers and figures.\n",
        lab.mesh_name()
    )
}

fn write_finding(page: &mut String, finding: &Finding, figure: &str) -> std::fmt::Result {
    let Finding { title, source, published, found, verdict, remark, .. } = finding;
    write!(page, "\n## {title}\n\n{source}\n\n- Published: {published}\n- Found: {found}\n- Verdict: **{verdict}**\n")?;
    if !remark.is_empty() {
        write!(page, "\n{remark}\n")?;
    }
    write!(page, "\n![{title}]({figure})\n")
}
