//! The bytes of a stored run.
//!
//! Eight bytes `FPRUN004`, then a DEFLATE stream of a postcard record. The rows are stored by column, so that constant columns take no
//! space. The number is also a version of the physics: in files that begin with `FPRUN003` a curved body spins about its foot, from 004
//! on about its apex. Those that begin with `FPRUN002` do not contain the body, which is a plane.

use std::io::{Read, Write};

use flate2::{Compression, read::DeflateDecoder, write::DeflateEncoder};
use serde::{Deserialize, Serialize};

use super::Kind;
use super::runs::{Run, Sample, Turned};
use fingerpad::Regime;
use fingerpad_fe::experiment::{BodyKind, RigidBodySettings};
use fingerpad_fe::load_path::Path;

const MAGIC: &[u8; 8] = b"FPRUN004";
const MAGIC_ABOUT_FOOT: &[u8; 8] = b"FPRUN003";
const MAGIC_WITHOUT_BODY: &[u8; 8] = b"FPRUN002";
/// Largest size of a decompressed record, bytes. A run has at most some thousand rows; a larger record is damaged.
const LARGEST_BYTES: u64 = 64 << 20;
/// Count of numbers in a row: of depth, slide and contact, and of pose and moments.
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

/// The record, then the body as JSON without the optional keys that are not set.
#[derive(Serialize, Deserialize)]
struct StoredWithBody(Stored, String);

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
    let body = serde_json::to_string(&run.body).expect("plain numbers");
    let plain = postcard::to_stdvec(&StoredWithBody(stored, body)).expect("plain data");
    let mut encoder = DeflateEncoder::new(MAGIC.to_vec(), Compression::best());
    encoder.write_all(&plain).expect("writing to memory");
    encoder.finish().expect("writing to memory")
}

/// The run of a file.
///
/// # Errors
/// The problem with the bytes.
pub(super) fn from_bytes(bytes: &[u8]) -> Result<Run, String> {
    match bytes.get(..MAGIC.len()) {
        Some(magic) if magic == MAGIC || magic == MAGIC_ABOUT_FOOT => {
            let StoredWithBody(stored, body) = read(&bytes[MAGIC.len()..])?;
            let run = run(stored, serde_json::from_str(&body).map_err(|e| format!("damaged: body {body}: {e}"))?)?;
            if magic == MAGIC_ABOUT_FOOT && run.body.kind != BodyKind::Plane && spins_aside(&run.samples) {
                return Err(
                    "made by an earlier program, in which a curved body span about another point; run it again".into(),
                );
            }
            Ok(run)
        }
        Some(magic) if magic == MAGIC_WITHOUT_BODY => run(read(&bytes[MAGIC.len()..])?, RigidBodySettings::default()),
        _ => Err("not a stored run (no FPRUN004, FPRUN003 or FPRUN002)".into()),
    }
}

/// Whether the body spins while its apex is not at the foot.
fn spins_aside(samples: &[Sample]) -> bool {
    let spin = |s: &Sample| s.turned.map_or(0.0, |turned| turned.spin_deg);
    samples.windows(2).any(|pair| spin(&pair[0]) != spin(&pair[1]) && pair.iter().any(|s| s.slide_mm != [0.0; 2]))
}

fn read<T: serde::de::DeserializeOwned>(body: &[u8]) -> Result<T, String> {
    let mut plain = Vec::new();
    DeflateDecoder::new(body).take(LARGEST_BYTES).read_to_end(&mut plain).map_err(|e| format!("damaged: {e}"))?;
    postcard::from_bytes(&plain).map_err(|e| format!("damaged: {e}"))
}

fn run(stored: Stored, body: RigidBodySettings) -> Result<Run, String> {
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
        body,
        path: stored.path,
        ended_early: stored.ended_early,
        cpu_s: stored.cpu_s,
    })
}

/// The numbers of depth, slide and contact of a row, which all rows have.
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

/// The columns of all rows; those of pose and moments only if all rows have them.
fn columns(samples: &[Sample]) -> Vec<Vec<f32>> {
    let turned: Option<Vec<Turned>> = samples.iter().map(|s| s.turned).collect();
    let contact = (0..OF_CONTACT).map(|k| samples.iter().map(|s| of_contact(s)[k]).collect());
    let pose = turned.iter().flat_map(|rows| (0..OF_POSE).map(|k| rows.iter().map(|t| of_pose(t)[k]).collect()));
    contact.chain(pose).collect()
}
