//! `fingerpad simulate --probe` and `--reactions`: quantities inside the finger during a run.

use std::path::{Path, PathBuf};

use anyhow::bail;
use fingerpad_fe::load_path::{self, Finger, Observed, Trajectory, readings_csv};

use super::{Failure, Mark, Outputs, outputs};

/// Quantities to observe inside the finger.
#[derive(clap::Args)]
pub struct ProbeArgs {
    /// Points of the tissue to read (CSV), or papillae:DEPTH_MM for a grid below the pad
    #[arg(long, value_name = "POINTS", requires = "probe_out")]
    probe: Option<String>,
    /// Strain and energy at these points over time (CSV)
    #[arg(long, value_name = "SERIES.csv", requires = "probe")]
    probe_out: Option<PathBuf>,
    /// Reactions of the supports of nail, bone and the cut end over time (CSV)
    #[arg(long, value_name = "REACTIONS.csv")]
    reactions: Option<PathBuf>,
}

/// File of the rows of a run that did not reach its end.
fn partial(file: &Path) -> PathBuf {
    file.with_extension("partial.csv")
}

/// Placement of the probes.
enum Points {
    /// A grid at this depth under the pad, mm.
    Papillae(f64),
    /// Those of a file.
    File(PathBuf),
}

impl ProbeArgs {
    fn points(&self) -> anyhow::Result<Option<Points>> {
        let Some(text) = &self.probe else { return Ok(None) };
        let Some(depth) = text.strip_prefix("papillae:") else { return Ok(Some(Points::File(text.into()))) };
        match depth.parse() {
            Ok(depth) if (0.0..=5.0).contains(&depth) => Ok(Some(Points::Papillae(depth))),
            _ => bail!("--probe {text}: the depth under the skin must be a number from 0 to 5 mm"),
        }
    }

    /// The file of points, if there is one.
    pub fn input(&self) -> (&'static str, Option<&Path>) {
        ("--probe", self.probe.as_deref().filter(|text| !text.starts_with("papillae:")).map(Path::new))
    }

    /// Declares the outputs.
    pub fn declare(&self, outputs: Outputs) -> Outputs {
        let probes = || vec![Mark::beginning(readings_csv::probes_header() + "\n")];
        let reactions = || vec![Mark::beginning(readings_csv::reactions_header() + "\n")];
        let [probe_part, reactions_part] = [&self.probe_out, &self.reactions].map(|file| file.as_deref().map(partial));
        outputs
            .file("--probe-out", self.probe_out.as_deref(), probes())
            .file("--probe-out", probe_part.as_deref(), probes())
            .file("--reactions", self.reactions.as_deref(), reactions())
            .file("--reactions", reactions_part.as_deref(), reactions())
    }

    /// The quantities that a run on this finger observes; None without any.
    pub fn observed(&self, finger: &Finger) -> Result<Option<Observed>, Failure> {
        let points = match self.points().map_err(Failure::Input)? {
            None => Vec::new(),
            Some(Points::Papillae(depth)) => load_path::papillae(finger, depth),
            Some(Points::File(file)) => readings_csv::read_points(&file, finger)?,
        };
        let of_probe = |e| Failure::Input(anyhow::Error::new(e).context("--probe"));
        let probes = load_path::probes(&finger.mesh, &finger.body, &points).map_err(of_probe)?;
        let observed = Observed::new(&finger.mesh, self.reactions.is_some(), probes);
        Ok((!observed.is_empty()).then_some(observed))
    }

    /// Writes the observed quantities; those of a run that ended early get another file name.
    pub fn save(&self, observed: &Observed, trajectory: &Trajectory, is_partial: bool) -> Result<(), Failure> {
        let name = |file: &PathBuf| if is_partial { partial(file) } else { file.clone() };
        if let Some(file) = &self.probe_out {
            outputs::write(&name(file), |w| readings_csv::write_probes(w, observed.probes(), trajectory))?;
        }
        if let Some(file) = &self.reactions {
            outputs::write(&name(file), |w| readings_csv::write_reactions(w, trajectory))?;
        }
        Ok(())
    }
}
