//! The bytes of a stored run.
//!
//! Eight bytes `FPRUN002`, then a DEFLATE stream of a postcard record. The rows stand by column, so that columns that do not
//! change take no room. Files that begin with `FPRUN001` hold no turns and no moments, and their rows stand one by one.

use std::io::{Read, Write};

use flate2::{Compression, read::DeflateDecoder, write::DeflateEncoder};
use serde::{Deserialize, Serialize};

use super::Kind;
use super::runs::{Run, Sample, Turned};
use fingerpad::Regime;
use fingerpad_fe::load_path::{Drive, Path, Waypoint};

const MAGIC: &[u8; 8] = b"FPRUN002";
const MAGIC_WITHOUT_TURNS: &[u8; 8] = b"FPRUN001";
/// A run is at most some thousand rows; more is damage, not data.
const LARGEST_BYTES: u64 = 64 << 20;
/// Numbers of a row: those of depth, slide and contact, and those of pose and moments.
const OF_CONTACT: usize = 9;
const OF_POSE: usize = 6;

/// The record of a file.
#[derive(Serialize, Deserialize)]
struct Stored {
    name: String,
    kind: Kind,
    held_out: bool,
    settings_hash: String,
    path: Path,
    columns: Vec<Vec<f32>>,
    regimes: Vec<Regime>,
    ended_early: Option<String>,
    cpu_s: f64,
}

/// The record of a file without turns and moments.
#[derive(Deserialize)]
struct StoredWithoutTurns {
    name: String,
    kind: Kind,
    held_out: bool,
    settings_hash: String,
    drives: [Drive; 3],
    waypoints: Vec<Waypoint>,
    samples: Vec<SampleWithoutTurns>,
    ended_early: Option<String>,
    cpu_s: f64,
}

/// A row of such a file.
#[derive(Deserialize)]
struct SampleWithoutTurns {
    t_s: f32,
    depth_mm: f32,
    slide_mm: [f32; 2],
    normal_force_n: f32,
    friction_n: [f32; 2],
    contact_area_mm2: f32,
    stick_ratio: f32,
    regime: Regime,
}

/// The bytes of a run's file.
pub(super) fn to_bytes(run: &Run) -> Vec<u8> {
    let stored = Stored {
        name: run.name.clone(),
        kind: run.kind,
        held_out: run.held_out,
        settings_hash: run.settings_hash.clone(),
        path: run.path.clone(),
        columns: columns(&run.samples),
        regimes: run.samples.iter().map(|s| s.regime).collect(),
        ended_early: run.ended_early.clone(),
        cpu_s: run.cpu_s,
    };
    let plain = postcard::to_stdvec(&stored).expect("plain data");
    let mut encoder = DeflateEncoder::new(MAGIC.to_vec(), Compression::best());
    encoder.write_all(&plain).expect("writing to memory");
    encoder.finish().expect("writing to memory")
}

/// The run of a file.
///
/// # Errors
/// What is wrong with the bytes.
pub(super) fn from_bytes(bytes: &[u8]) -> Result<Run, String> {
    match bytes.get(..MAGIC.len()) {
        Some(magic) if magic == MAGIC => with_turns(read(&bytes[MAGIC.len()..])?),
        Some(magic) if magic == MAGIC_WITHOUT_TURNS => Ok(without_turns(read(&bytes[MAGIC.len()..])?)),
        _ => Err("not a stored run (no FPRUN002 or FPRUN001)".into()),
    }
}

fn read<T: serde::de::DeserializeOwned>(body: &[u8]) -> Result<T, String> {
    let mut plain = Vec::new();
    DeflateDecoder::new(body).take(LARGEST_BYTES).read_to_end(&mut plain).map_err(|e| format!("damaged: {e}"))?;
    postcard::from_bytes(&plain).map_err(|e| format!("damaged: {e}"))
}

fn with_turns(stored: Stored) -> Result<Run, String> {
    let rows = stored.regimes.len();
    let has_pose = stored.columns.len() == OF_CONTACT + OF_POSE;
    if !(has_pose || stored.columns.len() == OF_CONTACT) || stored.columns.iter().any(|c| c.len() != rows) {
        return Err("damaged: columns are missing or of different length".into());
    }
    let row = |(row, &regime): (usize, &Regime)| sample(&|k| stored.columns[k][row], has_pose, regime);
    Ok(Run {
        samples: stored.regimes.iter().enumerate().map(row).collect(),
        name: stored.name,
        kind: stored.kind,
        held_out: stored.held_out,
        settings_hash: stored.settings_hash,
        path: stored.path,
        ended_early: stored.ended_early,
        cpu_s: stored.cpu_s,
    })
}

fn without_turns(stored: StoredWithoutTurns) -> Run {
    let row = |s: SampleWithoutTurns| Sample {
        t_s: s.t_s,
        depth_mm: s.depth_mm,
        slide_mm: s.slide_mm,
        normal_force_n: s.normal_force_n,
        friction_n: s.friction_n,
        contact_area_mm2: s.contact_area_mm2,
        stick_ratio: s.stick_ratio,
        regime: s.regime,
        turned: None,
    };
    Run {
        name: stored.name,
        kind: stored.kind,
        held_out: stored.held_out,
        settings_hash: stored.settings_hash,
        path: Path::new(stored.drives, stored.waypoints),
        samples: stored.samples.into_iter().map(row).collect(),
        ended_early: stored.ended_early,
        cpu_s: stored.cpu_s,
    }
}

/// The numbers of a row that every row has.
fn of_contact(s: &Sample) -> [f32; OF_CONTACT] {
    let ([sx, sy], [fx, fy]) = (s.slide_mm, s.friction_n);
    [s.t_s, s.depth_mm, sx, sy, s.normal_force_n, fx, fy, s.contact_area_mm2, s.stick_ratio]
}

fn of_pose(turned: &Turned) -> [f32; OF_POSE] {
    let [mx, my, mz] = turned.moment_n_mm;
    [turned.spin_deg, turned.pitch_deg, turned.roll_deg, mx, my, mz]
}

fn sample(number: &dyn Fn(usize) -> f32, has_pose: bool, regime: Regime) -> Sample {
    Sample {
        t_s: number(0),
        depth_mm: number(1),
        slide_mm: [number(2), number(3)],
        normal_force_n: number(4),
        friction_n: [number(5), number(6)],
        contact_area_mm2: number(7),
        stick_ratio: number(8),
        regime,
        turned: has_pose.then(|| Turned {
            spin_deg: number(9),
            pitch_deg: number(10),
            roll_deg: number(11),
            moment_n_mm: [number(12), number(13), number(14)],
        }),
    }
}

/// The columns of all rows; those of the pose only if all rows have it.
fn columns(samples: &[Sample]) -> Vec<Vec<f32>> {
    let turned: Option<Vec<Turned>> = samples.iter().map(|s| s.turned).collect();
    let contact = (0..OF_CONTACT).map(|k| samples.iter().map(|s| of_contact(s)[k]).collect());
    let pose = turned.iter().flat_map(|rows| (0..OF_POSE).map(|k| rows.iter().map(|t| of_pose(t)[k]).collect()));
    contact.chain(pose).collect()
}
