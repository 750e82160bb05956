//! `fingerpad diagnose runs --confirm-fe`: strokes re-run by the finite elements; each finished one is a file of its own.

use std::path::{Path, PathBuf};

use fingerpad_diagnose::Evidence;
use fingerpad_diagnose::confirm::{Confirmation, FeRow, FeStroke, Prepared, Ran};
use fingerpad_fe::experiment::press_to;
use fingerpad_fe::load_path::{Clearance, LoadPathError, Problem};
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_formats as formats;
use fingerpad_smooth::ReferenceCurves;
use sha2::{Digest, Sha256};

use super::progress::counter;
use super::{Bar, Failure, Model, go_on, keeping, make_finger_for};

/// Strokes of the finite elements with their folder.
struct Runner<'a> {
    problem: Problem<'a>,
    settings: String,
    folder: PathBuf,
    bar: Bar,
    threads: usize,
}

/// Runs the strokes of a diagnosis that claims an effect.
///
/// * `folder`: folder of finished strokes; those of an earlier, interrupted run are reused
pub fn confirm(
    model: &Model,
    reference: &ReferenceCurves,
    evidence: &Evidence,
    strokes: usize,
    folder: &Path,
) -> Result<Confirmation, Failure> {
    let mut config = model.config()?;
    if model.mesh_preset.is_none() && model.config.is_none() {
        config.mesh_preset = MeshPreset::Coarse;
    }
    let prepared = Prepared::new(reference, evidence, config.friction, strokes);
    let depth = prepared.depth_mm();
    let (finger, _) = make_finger_for(&config, &[&press_to(depth)])?;
    let room = Clearance::of(&finger).depth_mm;
    if !(depth < room) {
        return Err(Failure::Input(anyhow::anyhow!(
            "--confirm-fe: a stroke is {depth:.2} mm deep, and the bone or the held section of shape {} lies {room:.2} mm above first \
             touch: give the finger's own geometry by --shape or --config",
            config.geometry_name()
        )));
    }
    std::fs::create_dir_all(folder).map_err(|source| formats::Error::File { path: folder.to_path_buf(), source })?;
    let [least, _] = prepared.strokes();
    let runner = Runner {
        problem: config.problem(&finger),
        settings: config.hash()?,
        folder: folder.to_path_buf(),
        bar: counter("finite elements", least, "strokes"),
        threads: std::thread::available_parallelism().map_or(1, usize::from),
    };
    let mesh = serde_json::to_value(config.mesh_preset).ok().and_then(|v| v.as_str().map(str::to_owned));
    let _keeping = keeping();
    let done = prepared.confirm(&mesh.unwrap_or_default(), &config.geometry_name(), &mut |what, list| {
        runner.bar.say(what.to_owned());
        runner.run(list)
    });
    runner.bar.finish_and_clear();
    done
}

impl Runner<'_> {
    fn run(&self, strokes: &[FeStroke<'_>]) -> Result<Ran, Failure> {
        self.bar.expect(strokes.len());
        formats::in_threads(strokes, self.threads.min(strokes.len()), |stroke| {
            let rows = self.one(stroke);
            self.bar.count();
            rows
        })
    }

    /// A stroke from its file or from the finite elements; `None` if they find no equilibrium.
    fn one(&self, stroke: &FeStroke<'_>) -> Result<Option<Vec<FeRow>>, Failure> {
        let file = self.folder.join(format!("{}.json", self.key(stroke)));
        if let Some(rows) = std::fs::read(&file).ok().and_then(|b| serde_json::from_slice(&b).ok()) {
            return Ok(rows);
        }
        let rows = stroke.follow(&self.problem, &mut |_| go_on()).map_err(|error| match error {
            LoadPathError::Interrupted { .. } => self.interrupted(),
            error => Failure::Input(error.into()),
        })?;
        let text = serde_json::to_vec(&rows).map_err(|e| Failure::Numerics(e.into()))?;
        formats::atomic_write(&file, |w| w.write_all(&text))?;
        if go_on().is_break() {
            return Err(self.interrupted());
        }
        // The numbers as a later run reads them, to the last bit: the choice of the next strokes depends on them.
        serde_json::from_slice(&text).map_err(|e| Failure::Numerics(e.into()))
    }

    fn interrupted(&self) -> Failure {
        Failure::Interrupted(format!(
            "the report is written without it; finished strokes are kept in {}",
            self.folder.display()
        ))
    }

    /// Digest of everything that decides a stroke: settings, path, and the law of friction along it.
    fn key(&self, stroke: &FeStroke<'_>) -> String {
        let mut digest = Sha256::new();
        digest.update(self.settings.as_bytes());
        let mut last = None;
        for w in &stroke.path.waypoints {
            for v in [w.t_s, w.normal, w.x, w.y] {
                digest.update(v.to_le_bytes());
            }
            for t_s in last.map(|t: f64| 0.5 * (t + w.t_s)).into_iter().chain([w.t_s]) {
                let law = stroke.law_at(t_s);
                digest.update(law.lambda.to_le_bytes());
                digest.update(law.tau0_mpa.to_le_bytes());
            }
            last = Some(w.t_s);
        }
        digest.finalize().iter().take(12).map(|b| format!("{b:02x}")).collect()
    }
}
