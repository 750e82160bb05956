//! Slides of a finger that go on until all of the contact slips: they judge the models, and the page shows their contact.

use fingerpad::Motion;
use fingerpad::pad::{Pad, PadState, PatchState, Plane};
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{Drive, Path, Snapshot, Waypoint};
use fingerpad_fe::mesh::Mesh;
use fingerpad_reduce::pad::MOST_PATCHES;
use fingerpad_reduce::{Kind, Run, Sample};
use fingerpad_report::StickMap;

use super::runs::follow;
use crate::{Bars, Failure, LARGER_PADS, make_finger_for};

/// Stick ratios of the finite elements at which the contact is shown.
const SHOWN: [f64; 4] = [0.9, 0.6, 0.3, 0.02];
/// Length of the slides over that of the middle slide of the runs, so that they end in full slip, and their parts whose ends are rows.
const LONGER: f64 = 2.5;
const PARTS: usize = 40;
/// Iterations after which a slide ends early.
const MOST_ITERATIONS: u32 = 400;
/// Longest step of the pad, mm.
const STEP_MM: f64 = 0.05;

/// Slides of a finger along x and y from rest.
pub(super) struct FullSlips {
    /// The mesh of the snapshots.
    pub mesh: Mesh,
    /// The slides, which no fit sees.
    pub runs: Vec<Run>,
    /// The slide along x, and its contact at each part that was reached.
    along_x: Option<(Path, Vec<Snapshot>)>,
}

impl FullSlips {
    /// Follows slides as deep as the middle one of the straight slides of the runs, as far as the finite elements can.
    pub fn of(config: &Config, runs: &[Run]) -> Result<Self, Failure> {
        let end = |run: &Run| {
            run.samples.last().map_or([0.0; 2], |s| [s.depth_mm, s.slide_mm[0].hypot(s.slide_mm[1])].map(f64::from))
        };
        let is_straight =
            |run: &&Run| run.kind == Kind::Straight && run.is_representable() && run.ended_early.is_none();
        let mut straight: Vec<&Run> = runs.iter().filter(is_straight).collect();
        straight.sort_by(|a, b| end(a)[0].total_cmp(&end(b)[0]));
        let Some(&middle) = straight.get(straight.len() / 2) else {
            return Ok(Self { mesh: make_finger_for(config, &[])?.0.mesh, runs: Vec::new(), along_x: None });
        };
        let paths = [[1.0, 0.0], [0.0, 1.0]].map(|direction| slide(end(middle), direction));
        let (finger, _) = config.finger_reaching(&paths.each_ref(), LARGER_PADS[0])?;
        let (mut slides, mut along_x) = (Vec::new(), None);
        for (axis, path) in ["x", "y"].into_iter().zip(paths) {
            let rows: Vec<usize> = if axis == "x" { (2..path.waypoints.len()).collect() } else { Vec::new() };
            let mut problem = config.problem(&finger);
            problem.half = problem.half.filter(|_| path.is_symmetric());
            let name = format!("slide along {axis}");
            let found = follow(&problem, (&name, &path), &rows, None, &Bars::default(), MOST_ITERATIONS)?;
            if found.trajectory.responses.iter().all(|r| r.slide_x_mm.hypot(r.slide_y_mm) == 0.0) {
                continue;
            }
            slides.push(Run {
                name,
                held_out: true,
                ended_early: found.ended_early,
                samples: found.trajectory.responses.iter().map(Sample::from).collect(),
                path: path.clone(),
                ..middle.clone()
            });
            if axis == "x" {
                along_x = Some((path, found.trajectory.snapshots));
            }
        }
        Ok(Self { mesh: finger.mesh, runs: slides, along_x })
    }

    /// The contact of finite elements and pad along the slide along x at a few stick ratios.
    pub fn maps(&self, pad: Option<&Pad<'_>>) -> Vec<StickMap> {
        let Some((path, snapshots)) = &self.along_x else { return Vec::new() };
        let patches = pad.map(|pad| patches_along(pad, path)).unwrap_or_default();
        let far = |k: usize, stick: f64| (snapshots[k].response.stick_ratio - stick).abs();
        let nearest = |stick| (0..snapshots.len()).min_by(|a, b| far(*a, stick).total_cmp(&far(*b, stick)));
        let mut shown: Vec<usize> = SHOWN.into_iter().filter_map(nearest).collect();
        shown.dedup();
        let map = |k: usize| StickMap {
            elements: snapshots[k].clone(),
            patches: patches.get(k).cloned().unwrap_or_default(),
        };
        shown.into_iter().map(map).collect()
    }
}

/// A press, and a slide from rest in short parts.
fn slide([depth_mm, slide_mm]: [f64; 2], [x, y]: [f64; 2]) -> Path {
    let at = |part: usize| LONGER * slide_mm * part as f64 / PARTS as f64;
    let place =
        |t_s: usize, normal: f64, slide_mm: f64| Waypoint { t_s: t_s as f64, normal, x: x * slide_mm, y: y * slide_mm };
    let parts = (1..=PARTS).map(|part| place(1 + part, depth_mm, at(part)));
    let waypoints = [place(0, 0.0, 0.0), place(1, depth_mm, 0.0)].into_iter().chain(parts).collect();
    Path::new([Drive::Displacement; 3], waypoints)
}

/// The patches of a pad at each slide of a path.
fn patches_along(pad: &Pad<'_>, path: &Path) -> Vec<Vec<PatchState>> {
    let Ok(mut state) = PadState::<MOST_PATCHES>::new(pad) else { return Vec::new() };
    let pose = [pad.numbers.neutral_pitch_deg, 0.0];
    let mut maps = Vec::new();
    for pair in path.waypoints.windows(2) {
        let (deeper, further) = (pair[1].normal - pair[0].normal, pair[1].x - pair[0].x);
        let steps = (deeper.max(further) / STEP_MM).ceil().max(1.0) as usize;
        for step in 1..=steps {
            let depth_mm = (pair[0].normal + deeper * step as f64 / steps as f64) as f32;
            let slide_increment_mm = [(further / steps as f64) as f32, 0.0];
            pad.step(
                &mut state,
                &Plane,
                Motion { depth_mm, slide_increment_mm, dt_s: 1e-3, ..Motion::default() },
                pose,
            );
        }
        if further > 0.0 {
            maps.push(pad.patch_states(&state, &Plane)[..pad.patches.len()].to_vec());
        }
    }
    maps
}
