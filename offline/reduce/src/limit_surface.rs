//! The limit surface of a model: friction and moment in steady slip, for slides and turns in all directions.
//!
//! Main type: [`LimitSurface`]. For a bed, a point is its friction at the end of a long slide. For a pad, it is the sum of the strengths of
//! its patches, each along its own slip, at the pressures of the press ([`Pad::full_slip`]). A slide of a pad about a point of the contact
//! would not become steady: the patch at that point turns with the plane. Uses the package `fingerpad` only.

use std::fmt::Write as _;

use fingerpad::pad::{Pad, PadState, Plane};
use fingerpad::{File, ModelOf, Motion, Response, StateOf};
use rayon::prelude::*;

use crate::pad::MOST_PATCHES;

/// Arm that converts a rotation to a travel and a moment to a force, mm: about the limit of the moment over that of friction.
pub const ARM_MM: f64 = 3.0;
/// First line of a table.
pub const COLUMNS: &str =
    "direction_x,direction_y,direction_spin,friction_x_n,friction_y_n,spin_moment_n_mm,normal_force_n";
/// First line of a mesh.
pub const MESH_HEAD: &str = "# A limit surface; made by `fingerpad export`.";

/// Number of subdivisions of an icosahedron of directions: 642 directions.
const HALVINGS: usize = 3;
/// Steps of the press.
const PRESS_STEPS: usize = 50;
/// Travel of a step, mm, and number of steps: short steps first, then long ones for a plane that turns about a point of the contact. A
/// spring near that point moves little and slips late.
const STAGES: [(f64, usize); 2] = [(0.05, 1200), (0.5, 8000)];
/// A slide is steady when its load has changed by at most this share of its magnitude over this many steps.
const STEADY: f64 = 1e-4;
const STEADY_STEPS: usize = 40;

/// Why a limit surface cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LimitSurfaceError {
    /// A depth or an angle outside the range in which the model was fitted.
    #[error("{what} {value}: the allowed range is {least} to {most}")]
    Range {
        /// Name and unit.
        what: &'static str,
        /// The value given.
        value: f64,
        /// Ends of the range.
        least: f64,
        /// See `least`.
        most: f64,
    },
    /// A depth and pose without contact.
    #[error("no contact at depth {depth_mm} mm in this pose")]
    NoContact {
        /// The depth.
        depth_mm: f64,
    },
    /// A slide that does not become steady.
    #[error("the slide along ({}, {}, {}) changes by {change} of its load over 20 mm after 4 m, more than {STEADY}",
        direction[0], direction[1], direction[2])]
    NotSteady {
        /// Slide along x and y, and turn times [`ARM_MM`].
        direction: [f64; 3],
        /// Change of the load over its size.
        change: f64,
    },
}

/// Friction and moment of one direction in steady slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitPoint {
    /// Motion of the plane: slides along x and y, and its rotation times [`ARM_MM`]; a unit vector.
    pub direction: [f64; 3],
    /// Friction along x and y, N.
    pub friction_n: [f64; 2],
    /// Moment about the normal through the point under first touch, N mm.
    pub spin_moment_n_mm: f64,
    /// Normal force, N. The depth is constant, so that the slide of a bed changes it. For a pad it is the normal force of the press.
    pub normal_force_n: f64,
}

/// The limit surface at one depth and pose, on a plane.
#[derive(Clone, Debug, PartialEq)]
pub struct LimitSurface {
    /// A point for each direction.
    pub points: Vec<LimitPoint>,
    /// Triangles over the points, counter-clockwise seen from outside.
    pub triangles: Vec<[usize; 3]>,
}

/// Points of the limit surface of a bed of springs, in its pose, along `directions` as in [`LimitPoint::direction`].
///
/// # Errors
/// [`LimitSurfaceError`] for a depth that is not above 0 or not within the model's range, and for a slide that does not become steady.
pub fn limit_points_of_bed<const M: usize, const N: usize>(
    model: &ModelOf<'_, M, N>,
    depth_mm: f64,
    directions: &[[f64; 3]],
) -> Result<Vec<LimitPoint>, LimitSurfaceError> {
    check_depth(depth_mm, f64::from(model.depth_max_mm()))?;
    let step = |state: &mut StateOf<M, 2>, motion: Motion| model.step(state, motion);
    let (contact, _) = press(StateOf::<M, 2>::default(), step, depth_mm);
    directions.par_iter().map(|&direction| slide(contact, step, depth_mm as f32, direction)).collect()
}

/// Points of the limit surface of a pad in a pose (pitch and roll, degrees), along `directions` as in [`LimitPoint::direction`].
///
/// # Errors
/// [`LimitSurfaceError`] for a depth or a pose outside the pad's range.
pub fn limit_points_of_pad(
    pad: &Pad<'_>,
    depth_mm: f64,
    [pitch_deg, roll_deg]: [f64; 2],
    directions: &[[f64; 3]],
) -> Result<Vec<LimitPoint>, LimitSurfaceError> {
    let n = pad.numbers;
    check_depth(depth_mm, f64::from(n.depth_max_mm))?;
    let [least, most] = n.pitch_range_deg.map(f64::from);
    check_range("pitch in degrees", pitch_deg, least, most)?;
    check_range("roll in degrees", roll_deg, -f64::from(n.roll_max_deg), f64::from(n.roll_max_deg))?;
    let pose_deg = [pitch_deg as f32, roll_deg as f32];
    let state = PadState::<MOST_PATCHES>::over(pad, pose_deg).expect("a checked pad has at most so many patches");
    let (contact, pressed) = press(state, |state, motion| pad.step(state, &Plane, motion, pose_deg), depth_mm);
    if !(pressed.normal_force_n > 0.0) {
        return Err(LimitSurfaceError::NoContact { depth_mm });
    }
    let point = |&direction: &[f64; 3]| {
        let [x, y, turn_mm] = direction.map(|part| part as f32);
        let [fx, fy, moment] = pad.full_slip(&contact, &Plane, [x, y, turn_mm / ARM_MM as f32]).map(f64::from);
        LimitPoint {
            direction,
            friction_n: [fx, fy],
            spin_moment_n_mm: moment,
            normal_force_n: f64::from(pressed.normal_force_n),
        }
    };
    Ok(directions.iter().map(point).collect())
}

impl LimitSurface {
    /// The limit surface of a bed of springs, in its pose.
    ///
    /// # Errors
    /// As [`limit_points_of_bed`].
    pub fn of_bed(file: &File<'_>, depth_mm: f64) -> Result<Self, LimitSurfaceError> {
        let (directions, triangles) = sphere(HALVINGS);
        Ok(Self { points: limit_points_of_bed(&file.model, depth_mm, &directions)?, triangles })
    }

    /// The limit surface of a pad in a pose (pitch and roll, degrees).
    ///
    /// # Errors
    /// As [`limit_points_of_pad`].
    pub fn of_pad(pad: &Pad<'_>, depth_mm: f64, pose_deg: [f64; 2]) -> Result<Self, LimitSurfaceError> {
        let (directions, triangles) = sphere(HALVINGS);
        Ok(Self { points: limit_points_of_pad(pad, depth_mm, pose_deg, &directions)?, triangles })
    }

    /// A table with [`COLUMNS`] and one row per point.
    pub fn csv(&self) -> String {
        let mut text = format!("{COLUMNS}\n");
        for point in &self.points {
            let ([dx, dy, dspin], [fx, fy]) = (point.direction, point.friction_n);
            let (moment, normal) = (point.spin_moment_n_mm, point.normal_force_n);
            let _ = writeln!(text, "{dx:.6},{dy:.6},{dspin:.6},{fx:.6e},{fy:.6e},{moment:.6e},{normal:.6e}");
        }
        text
    }

    /// A mesh in Wavefront's OBJ: friction along x and y, and the moment over [`ARM_MM`], all in N.
    pub fn obj(&self) -> String {
        let mut text = format!("{MESH_HEAD}\n# x, y: friction, N; z: moment about the normal over {ARM_MM} mm, N\n");
        for point in &self.points {
            let [x, y] = point.friction_n;
            let _ = writeln!(text, "v {x:.6} {y:.6} {:.6}", point.spin_moment_n_mm / ARM_MM);
        }
        for [a, b, c] in &self.triangles {
            let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
        }
        text
    }
}

fn check_depth(depth_mm: f64, most: f64) -> Result<(), LimitSurfaceError> {
    const LEAST_MM: f64 = 0.1;
    check_range("depth in mm", depth_mm, LEAST_MM, most)
}

fn check_range(what: &'static str, value: f64, least: f64, most: f64) -> Result<(), LimitSurfaceError> {
    // The ranges of a model have single precision.
    let slack = 1e-6 * most.abs();
    if value >= least - slack && value <= most + slack {
        return Ok(());
    }
    Err(LimitSurfaceError::Range { what, value, least, most: (most * 1e4).round() / 1e4 })
}

/// Presses a contact; returns it with its response.
fn press<S>(mut contact: S, step: impl Fn(&mut S, Motion) -> Response, depth_mm: f64) -> (S, Response) {
    let mut last = Response::default();
    for i in 1..=PRESS_STEPS {
        let depth_mm = (depth_mm * i as f64 / PRESS_STEPS as f64) as f32;
        last = step(&mut contact, Motion { depth_mm, dt_s: 1e-3, ..Motion::default() });
    }
    (contact, last)
}

/// Slides until the load is steady.
fn slide<S>(
    mut contact: S,
    step: impl Fn(&mut S, Motion) -> Response,
    depth_mm: f32,
    direction: [f64; 3],
) -> Result<LimitPoint, LimitSurfaceError> {
    let mut earlier = [f64::INFINITY; 3];
    let mut change = f64::INFINITY;
    for (step_mm, count) in STAGES {
        let [x, y, turn_mm] = direction.map(|part| (part * step_mm) as f32);
        let spin_increment_rad = turn_mm / ARM_MM as f32;
        let motion = Motion { depth_mm, slide_increment_mm: [x, y], spin_increment_rad, dt_s: 1e-3 };
        for i in 1..=count {
            let r = step(&mut contact, motion);
            if i % STEADY_STEPS > 0 {
                continue;
            }
            let load = [r.friction_n[0], r.friction_n[1], r.spin_moment_n_mm / ARM_MM as f32].map(f64::from);
            let size = load.iter().map(|part| part * part).sum::<f64>().sqrt();
            change = (0..3).map(|k| (load[k] - earlier[k]).abs()).fold(0.0, f64::max) / size;
            if change <= STEADY {
                return Ok(LimitPoint {
                    direction,
                    friction_n: [load[0], load[1]],
                    spin_moment_n_mm: f64::from(r.spin_moment_n_mm),
                    normal_force_n: f64::from(r.normal_force_n),
                });
            }
            earlier = load;
        }
    }
    Err(LimitSurfaceError::NotSteady { direction, change })
}

/// Points on the unit sphere and triangles over them: an icosahedron whose edges are halved `halvings` times.
fn sphere(halvings: usize) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut points: Vec<[f64; 3]> = Vec::new();
    for (a, b) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
        points.push(unit([a, b, 0.0]));
    }
    for (a, b) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
        points.push(unit([0.0, a, b]));
    }
    for (a, b) in [(golden, -1.0), (golden, 1.0), (-golden, -1.0), (-golden, 1.0)] {
        points.push(unit([a, 0.0, b]));
    }
    #[rustfmt::skip]
    let mut triangles = vec![
        [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6], [7, 1, 8],
        [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1],
    ];
    for _ in 0..halvings {
        let mut middles = std::collections::BTreeMap::new();
        let mut middle = |a: usize, b: usize, points: &mut Vec<[f64; 3]>| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push(unit(std::array::from_fn(|k| points[a][k] + points[b][k])));
                points.len() - 1
            })
        };
        let halve = |[a, b, c]: [usize; 3]| {
            let [ab, bc, ca] = [middle(a, b, &mut points), middle(b, c, &mut points), middle(c, a, &mut points)];
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(halve).collect();
    }
    (points, triangles)
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = v.iter().map(|part| part * part).sum::<f64>().sqrt();
    v.map(|part| part / length)
}

#[cfg(test)]
mod tests {
    use fingerpad::host::{ModelFile, PadModelFile};

    use super::*;

    const BED: &[u8] = include_bytes!("../data/models/fingertip.fpm");
    const PAD: &[u8] = include_bytes!("../data/models/fingertip-pad.fpm");

    fn bed() -> LimitSurface {
        LimitSurface::of_bed(&ModelFile::new(BED).unwrap().file(), 1.0).unwrap()
    }

    fn pad(pose_deg: [f64; 2]) -> LimitSurface {
        LimitSurface::of_pad(&PadModelFile::new(PAD).unwrap().file().pad, 1.0, pose_deg).unwrap()
    }

    fn power(load: &LimitPoint, direction: [f64; 3]) -> f64 {
        let [x, y] = load.friction_n;
        x * direction[0] + y * direction[1] + load.spin_moment_n_mm / ARM_MM * direction[2]
    }

    /// Each triangle's normal points away from the centre, and the triangles form a closed surface.
    #[test]
    fn directions_close_a_sphere() {
        let (points, triangles) = sphere(HALVINGS);
        assert_eq!((points.len(), triangles.len()), (642, 1280));
        let mut edges = std::collections::BTreeSet::new();
        let mut volume = 0.0;
        for t in &triangles {
            let [a, b, c] = t.map(|i| points[i]);
            volume += (a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0]))
                / 6.0;
            for k in 0..3 {
                assert!(edges.insert((t[k], t[(k + 1) % 3])), "an edge has two triangles, in opposite directions");
            }
        }
        assert!(edges.iter().all(|&(a, b)| edges.contains(&(b, a))));
        assert!((volume - 4.0 / 3.0 * std::f64::consts::PI).abs() < 0.05, "{volume}");
    }

    /// Steady slip dissipates, the mirrored finger has the mirrored load, and no other point has a larger power along a direction than the
    /// point of that direction, within the error of the model's steps.
    #[test]
    fn bed_and_pad_dissipate_most_and_are_symmetric() {
        for (surface, slack) in [(bed(), 0.02), (pad([30.0, 0.0]), 1e-3)] {
            let find = |d: [f64; 3]| {
                surface.points.iter().find(|p| (0..3).all(|k| (p.direction[k] - d[k]).abs() < 1e-9)).unwrap()
            };
            for point in &surface.points {
                let own = power(point, point.direction);
                assert!(own > 0.0, "{point:?}");
                let [dx, dy, spin] = point.direction;
                let mirrored = find([dx, -dy, -spin]);
                let size = point.friction_n[0].hypot(point.friction_n[1]).hypot(point.spin_moment_n_mm / ARM_MM);
                let difference = (point.friction_n[0] - mirrored.friction_n[0]).abs()
                    + (point.friction_n[1] + mirrored.friction_n[1]).abs()
                    + (point.spin_moment_n_mm + mirrored.spin_moment_n_mm).abs() / ARM_MM;
                assert!(difference < 0.02 * size, "{point:?} {mirrored:?}");
                for other in &surface.points {
                    // Depth is held: the normal force differs from slide to slide.
                    let scale = point.normal_force_n / other.normal_force_n;
                    assert!(power(other, point.direction) * scale < own + slack * size, "{point:?} {other:?}");
                }
            }
        }
    }

    /// The point of a direction is the model's own friction after a slide by itself.
    #[test]
    fn a_point_is_the_friction_of_a_slide() {
        let file = ModelFile::new(BED).unwrap();
        let mut state = fingerpad::SpinState::default();
        let mut last = Response::default();
        let point = bed().points.iter().copied().min_by(|a, b| b.direction[0].total_cmp(&a.direction[0])).unwrap();
        let [x, y, spin] = point.direction.map(|part| (0.02 * part) as f32);
        for _ in 0..2000 {
            last = file.file().model.step(
                &mut state,
                Motion {
                    depth_mm: 1.0,
                    slide_increment_mm: [x, y],
                    spin_increment_rad: spin / ARM_MM as f32,
                    dt_s: 1e-3,
                },
            );
        }
        for k in 0..2 {
            assert!((f64::from(last.friction_n[k]) - point.friction_n[k]).abs() < 2e-3, "{point:?} {last:?}");
        }
    }

    #[test]
    fn texts_hold_all_points() {
        let surface = bed();
        let (csv, obj) = (surface.csv(), surface.obj());
        assert_eq!(csv.lines().count(), 643);
        assert!(csv.starts_with(COLUMNS) && csv.lines().all(|line| line.split(',').count() == 7));
        assert_eq!(obj.lines().filter(|line| line.starts_with("v ")).count(), 642);
        assert_eq!(obj.lines().filter(|line| line.starts_with("f ")).count(), 1280);
    }

    #[test]
    fn ranges_are_named() {
        let (bed, pad) = (ModelFile::new(BED).unwrap(), PadModelFile::new(PAD).unwrap());
        let pad = pad.file().pad;
        for depth in [0.0, -1.0, 9.0, f64::NAN] {
            for error in [
                LimitSurface::of_bed(&bed.file(), depth).unwrap_err(),
                LimitSurface::of_pad(&pad, depth, [30.0, 0.0]).unwrap_err(),
            ] {
                assert!(error.to_string().starts_with(&format!("depth in mm {depth}: the allowed range is 0.1 to ")));
            }
        }
        let refused = |pose| LimitSurface::of_pad(&pad, 1.0, pose).unwrap_err().to_string();
        assert_eq!(refused([5.0, 0.0]), "pitch in degrees 5: the allowed range is 10 to 70");
        assert_eq!(refused([30.0, -31.0]), "roll in degrees -31: the allowed range is -30 to 30");
    }
}
