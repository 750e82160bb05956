//! The reduced model along a path of waypoints, driven by displacements or forces.
//!
//! Main types: [`check_path`], [`simulate_path`], [`TrajectoryRow`]. Uses `fingerpad` and slide's [`Path`].

use fingerpad::{
    BedMemory, Contact, Drivable, Drive as CoreDrive, Effects, Memory, ModelOf, Motion, Normal, Regime,
    RelaxingStateOf, Response, StateOf, Surroundings, Tangential,
};

use fingerpad_fe::load_path::{self, Drive, Path, Turn, Turns, Waypoint};

/// Longest motion of one step, mm, as in replays.
const STEP_MM: f64 = super::STEP_MM as f64;
/// Largest change of a driven force in one step, N.
const STEP_N: f64 = 0.005;
/// Tissue that relaxes: the first interval between rows, s, how much longer each next one is, and the longest one over its segment.
const FIRST_S: f64 = 1e-3;
const LONGER: f64 = 1.1;
const LONGEST_PART: f64 = 5e-3;

/// Distance between rows within a segment, steps.
const STEPS_PER_ROW: usize = 5;
/// Angles of a path, with the columns that drive them by angle and by moment.
const TURNS: [(&str, &str); 3] =
    [("spin_deg", "spin_moment_n_mm"), ("pitch_deg", "moment_y_n_mm"), ("roll_deg", "moment_x_n_mm")];

/// Why the reduced model cannot follow a path.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum PathError {
    /// A row that no finger can follow.
    #[error("data row {row}: {problem}")]
    Row {
        /// Row, from 1.
        row: usize,
        /// The problem with it.
        problem: String,
    },
    /// One slide is driven by displacement and the other by force.
    #[error("one slide is driven by displacement and the other by force; the reduced model needs the same for both")]
    MixedSlides,
    /// A turn that is driven by a moment.
    #[error("column `{moment}`: the reduced model cannot be driven by a moment; prescribe the angle `{angle}`")]
    Moment {
        /// The column.
        moment: &'static str,
        /// The column of the angle.
        angle: &'static str,
    },
    /// Another pose than that of the bed.
    #[error(
        "data row {row}: column `{column}` is {value}, but this bed of springs has one pose (pitch {0}°, roll {1}°); a pad follows \
         every pose",
        pose_deg[0], pose_deg[1]
    )]
    OnePose {
        /// Row, from 1.
        row: usize,
        /// The column.
        column: &'static str,
        /// Its value, degrees.
        value: f64,
        /// Pitch and roll of the model's pose, degrees.
        pose_deg: [f32; 2],
    },
    /// A driven force for a model with effects.
    #[error("column `{column}`: a model with effects cannot be driven by force; prescribe depth and slides")]
    ForceWithEffects {
        /// The column.
        column: &'static str,
    },
}

/// One row: the quantities of a finite-element response, and those that only the reduced model returns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryRow {
    /// Position, pose, forces and moments.
    pub response: load_path::Response,
    /// Friction limit in the direction of the present friction, N.
    pub friction_limit_n: f64,
    /// 1 less the share of its limit that friction uses.
    pub slip_margin: f64,
    /// The same when the tissue has relaxed at the present depth.
    pub slip_margin_relaxed: f64,
    /// Half-width of the 95 % band of the normal force, N.
    pub band_normal_n: f64,
    /// Half-width of the 95 % band of each friction component, N.
    pub band_friction_n: f64,
    /// Friction alone along x and y, N; on a curved body the force along x and y has the pressure on its slopes as well.
    pub tangential_friction_n: [f64; 2],
}

/// Depth or normal force, slides or frictions, then spin, pitch and roll.
pub(crate) type Position = [f64; 6];

fn row(t_s: f64, at: Position, r: &Response) -> TrajectoryRow {
    let [depth_mm, slide_x_mm, slide_y_mm, spin_deg, pitch_deg, roll_deg] = at;
    let centre = r.pressure_centre_mm.map(f64::from);
    TrajectoryRow {
        response: load_path::Response {
            t_s,
            depth_mm,
            slide_x_mm,
            slide_y_mm,
            normal_force_n: r.normal_force_n.into(),
            friction_x_n: r.friction_n[0].into(),
            friction_y_n: r.friction_n[1].into(),
            contact_area_mm2: r.contact_area_mm2.into(),
            stick_ratio: r.stick_ratio.into(),
            regime: r.regime,
            status: r.status,
            centre_of_pressure_mm: if r.regime == Regime::NoContact { [f64::NAN; 2] } else { centre },
            spin_deg,
            pitch_deg,
            roll_deg,
            moment_n_mm: [r.tilt_moment_n_mm[0], r.tilt_moment_n_mm[1], r.spin_moment_n_mm].map(f64::from),
        },
        friction_limit_n: r.friction_limit_n.into(),
        slip_margin: r.slip_margin.into(),
        slip_margin_relaxed: r.slip_margin_relaxed.into(),
        band_normal_n: r.band_normal_n.into(),
        band_friction_n: r.band_friction_n.into(),
        tangential_friction_n: r.tangential_friction_n.map(f64::from),
    }
}

/// Refuses a path that a model cannot follow.
///
/// * `has_effects`: whether the model's effects act along it
///
/// # Errors
/// [`PathError`] for the first problem.
pub fn check_path<const M: usize, const N: usize>(
    model: &ModelOf<'_, M, N>,
    has_effects: bool,
    path: &Path,
) -> Result<(), PathError> {
    check_drives(path)?;
    if has_effects && let Some(axis) = path.drives.iter().position(|drive| *drive == Drive::Force) {
        return Err(PathError::ForceWithEffects { column: ["normal_force_n", "friction_x_n", "friction_y_n"][axis] });
    }
    let pose_deg = model.data().pose_deg;
    for k in 0..path.waypoints.len() {
        if let Some(problem) = path.refused(k) {
            return Err(PathError::Row { row: k + 1, problem });
        }
        let fitted = [0.0, f64::from(pose_deg[0]), f64::from(pose_deg[1])];
        for ((turn, (column, _)), fitted) in turns(path).into_iter().zip(TURNS).zip(fitted).skip(1) {
            let value = turn.map_or(fitted, |turn| turn.values[k]);
            if (value - fitted).abs() > 1e-3 {
                return Err(PathError::OnePose { row: k + 1, column, value, pose_deg });
            }
        }
    }
    Ok(())
}

/// Refuses paths with one slide driven by displacement and the other by force, and paths driven by moments.
pub(crate) fn check_drives(path: &Path) -> Result<(), PathError> {
    if path.drives[1] != path.drives[2] {
        return Err(PathError::MixedSlides);
    }
    for (turn, (angle, moment)) in turns(path).into_iter().zip(TURNS) {
        if turn.is_some_and(|turn| turn.drive == Drive::Force) {
            return Err(PathError::Moment { moment, angle });
        }
    }
    Ok(())
}

/// Spin, pitch and roll of a path.
fn turns(path: &Path) -> [Option<&Turn>; 3] {
    let load_path::Turns { spin, pitch, roll } = &path.turns;
    [spin.as_ref(), pitch.as_ref(), roll.as_ref()]
}

/// Simulates `path` in steps of at most 0.02 mm, 0.4° or 5 mN; returns a row at every waypoint and at every fifth step between.
///
/// Tissue that relaxes has more rows: in each segment they begin 1 ms apart and grow apart to a two-hundredth of it.
///
/// Spin changes linearly between waypoints, as depth and slides do. Slides driven by force start from 0. If a force cannot be reached, the
/// row has the nearest state and a flag.
///
/// # Errors
/// Those of [`check_path`].
pub fn simulate_path<const M: usize, const N: usize>(
    model: &ModelOf<'_, M, N>,
    path: &Path,
) -> Result<Vec<TrajectoryRow>, PathError> {
    check_path(model, false, path)?;
    // A path with any rotation needs pairs of springs for the moment.
    let follow = match (path.turns.is_none(), model.relaxation().is_some()) {
        (true, false) => driven::<M, N, StateOf<M>>,
        (false, false) => driven::<M, N, StateOf<M, 2>>,
        (true, true) => driven::<M, N, RelaxingStateOf<M>>,
        (false, true) => driven::<M, N, RelaxingStateOf<M, 2>>,
    };
    Ok(if model.relaxation().is_some() { follow(model, &in_time(path, &[]).0) } else { follow(model, path) })
}

/// The path with more waypoints on its straight lines, for tissue that relaxes, and the values of the user's own columns there.
pub(crate) fn in_time(path: &Path, own: &[Option<Vec<f64>>]) -> (Path, Vec<Option<Vec<f64>>>) {
    // Segment and share of it.
    let mut places = vec![(0, 0.0)];
    for (k, pair) in path.waypoints.windows(2).enumerate() {
        let whole = pair[1].t_s - pair[0].t_s;
        let (mut t, mut interval) = (0.0, FIRST_S);
        while t + 1.5 * interval < whole {
            t += interval;
            interval = (interval * LONGER).min(LONGEST_PART * whole).max(FIRST_S);
            places.push((k, t / whole));
        }
        places.push((k, 1.0));
    }
    let at = |of: &dyn Fn(usize) -> f64, (k, share): (usize, f64)| match share {
        0.0 => of(k),
        1.0 => of(k + 1),
        _ => of(k) + share * (of(k + 1) - of(k)),
    };
    let corner = |part: fn(&Waypoint) -> f64, place| at(&|k| part(&path.waypoints[k]), place);
    let waypoint = |place: &(usize, f64)| Waypoint {
        t_s: corner(|w| w.t_s, *place),
        normal: corner(|w| w.normal, *place),
        x: corner(|w| w.x, *place),
        y: corner(|w| w.y, *place),
    };
    let along = |values: &Vec<f64>| -> Vec<f64> { places.iter().map(|place| at(&|k| values[k], *place)).collect() };
    let turned =
        |turn: &Option<Turn>| turn.as_ref().map(|Turn { drive, values }| Turn { drive: *drive, values: along(values) });
    let Turns { spin, pitch, roll } = &path.turns;
    let path = Path {
        drives: path.drives,
        waypoints: places.iter().map(waypoint).collect(),
        turns: Turns { spin: turned(spin), pitch: turned(pitch), roll: turned(roll) },
    };
    (path, own.iter().map(|values| values.as_ref().map(&along)).collect())
}

fn driven<'a, const M: usize, const N: usize, S: Clone + Default>(
    model: &ModelOf<'a, M, N>,
    path: &Path,
) -> Vec<TrajectoryRow>
where
    ModelOf<'a, M, N>: Drivable<S>,
{
    let mut state = S::default();
    along(path, model.data().pose_deg[0].into(), &mut |place: Place, at: &mut Position| {
        driven_step(model, &mut state, path.drives, &place, at)
    })
}

fn driven_step<S: Clone>(
    model: &impl Drivable<S>,
    state: &mut S,
    drives: [Drive; 3],
    &Place { target, dt, .. }: &Place,
    at: &mut Position,
) -> Response {
    let by_depth = drives[0] == Drive::Displacement;
    // Both slides are driven by displacement or both by force.
    let by_slide = drives[1] == Drive::Displacement;
    let slide = [1, 2].map(|k| (target[k] - at[k]) as f32);
    let drive = CoreDrive {
        normal: if by_depth { Normal::DepthMm(target[0] as f32) } else { Normal::ForceN(target[0] as f32) },
        tangential: if by_slide {
            Tangential::SlideIncrementMm(slide)
        } else {
            Tangential::FrictionN([target[1] as f32, target[2] as f32])
        },
        spin_increment_rad: (target[3] - at[3]).to_radians() as f32,
        dt_s: dt.max(1e-6) as f32,
    };
    let driven = model.step_driven(state, drive);
    let slid = driven.motion.slide_increment_mm.map(f64::from);
    let [x, y] = if by_slide { [target[1], target[2]] } else { [at[1] + slid[0], at[2] + slid[1]] };
    *at = [driven.motion.depth_mm.into(), x, y, target[3], target[4], target[5]];
    driven.response
}

/// Simulates `path` with the effects of a model file. The surroundings are constant except for the clock, which starts at their value, and
/// for user-defined columns. If the file has a tare or cross-talk, forces are the sensor's readings.
///
/// * `own`: values of each user-defined column at every waypoint, linear over the steps between waypoints; without values, that of the
///   surroundings
///
/// # Errors
/// Those of [`check_path`].
pub fn simulate_path_with_effects<const M: usize, const N: usize>(
    model: &ModelOf<'_, M, N>,
    effects: &Effects<'_>,
    surroundings: Surroundings,
    own: &[Option<Vec<f64>>],
    path: &Path,
) -> Result<Vec<TrajectoryRow>, PathError> {
    check_path(model, true, path)?;
    let follow = match (path.turns.is_none(), model.relaxation().is_some()) {
        (true, false) => with_effects::<M, N, 1, ()>,
        (false, false) => with_effects::<M, N, 2, ()>,
        (true, true) => with_effects::<M, N, 1, BedMemory<M>>,
        (false, true) => with_effects::<M, N, 2, BedMemory<M, 2>>,
    };
    if model.relaxation().is_some() {
        let (path, own) = in_time(path, own);
        return Ok(follow(model, effects, surroundings, &own, &path));
    }
    Ok(follow(model, effects, surroundings, own, path))
}

fn with_effects<const M: usize, const N: usize, const P: usize, R: Memory<M, P, f32>>(
    model: &ModelOf<'_, M, N>,
    effects: &Effects<'_>,
    surroundings: Surroundings,
    own: &[Option<Vec<f64>>],
    path: &Path,
) -> Vec<TrajectoryRow> {
    let mut contact = Contact::<M, P, R>::default();
    let mut now = surroundings;
    along(
        path,
        model.data().pose_deg[0].into(),
        &mut |Place { target, dt, before, share }: Place, at: &mut Position| {
            now.series_s += dt as f32;
            for (to, values) in now.own.iter_mut().zip(own) {
                let at = |k: usize| values.as_ref().and_then(|v| v.get(k)).copied();
                if let Some(from) = at(before) {
                    let next = at(before + 1).unwrap_or(from);
                    *to = if share < 1.0 { from + share * (next - from) } else { next } as f32;
                }
            }
            let motion = Motion {
                depth_mm: target[0] as f32,
                slide_increment_mm: [1, 2].map(|k| (target[k] - at[k]) as f32),
                spin_increment_rad: (target[3] - at[3]).to_radians() as f32,
                dt_s: dt.max(1e-6) as f32,
            };
            *at = target;
            let mut response = effects.step(model, &mut contact, now, motion);
            let [normal, x, y] = effects.reading_under(&response, &contact, &now);
            (response.normal_force_n, response.friction_n) = (normal, [x, y]);
            response
        },
    )
}

/// Number of steps of a path beyond one from each row to the next. A float, because input may be so long that an integer overflows.
pub fn steps_between_rows(path: &Path) -> f64 {
    let corner = |k| corner(path, k, 0.0);
    (1..path.waypoints.len()).map(|k| steps_between(path, corner(k - 1), corner(k)) - 1.0).sum()
}

/// Position of a waypoint. Angles that the path does not have are those of the neutral pose.
fn corner(path: &Path, index: usize, neutral_pitch_deg: f64) -> Position {
    let w = &path.waypoints[index];
    let [spin, pitch, roll] = turns(path).map(|turn| turn.and_then(|turn| turn.values.get(index)).copied());
    [w.normal, w.x, w.y, spin.unwrap_or(0.0), pitch.unwrap_or(neutral_pitch_deg), roll.unwrap_or(0.0)]
}

fn steps_between(path: &Path, from: Position, to: Position) -> f64 {
    let longest = |k: usize| match path.drives.get(k) {
        Some(Drive::Force) => STEP_N,
        Some(_) => STEP_MM,
        None => f64::from(super::STEP_RAD).to_degrees(),
    };
    (0..from.len()).map(|k| (to[k] - from[k]).abs() / longest(k)).fold(0.0, f64::max).ceil().max(1.0)
}

/// Target of one step.
pub(crate) struct Place {
    pub target: Position,
    /// Duration, s.
    pub dt: f64,
    /// The last waypoint before it.
    before: usize,
    /// Share of the segment from there to the next one.
    share: f64,
}

/// One step: from its target and the present position, which it updates, to the response.
pub(crate) type Step<'a> = dyn FnMut(Place, &mut Position) -> Response + 'a;

/// Steps along a path. `go` makes one step to a target and updates the position to the one that it reached.
pub(crate) fn along(path: &Path, neutral_pitch_deg: f64, go: &mut Step) -> Vec<TrajectoryRow> {
    let by_force = |k: usize| path.drives.get(k) == Some(&Drive::Force);
    let start = corner(path, 0, neutral_pitch_deg);
    let mut at: Position = std::array::from_fn(|k| if by_force(k) { 0.0 } else { start[k] });
    let mut rows = Vec::new();
    let response = go(Place { target: start, dt: 1e-3, before: 0, share: 0.0 }, &mut at);
    rows.push(row(path.waypoints[0].t_s, at, &response));
    for (i, pair) in path.waypoints.windows(2).enumerate() {
        let (from, to) = (corner(path, i, neutral_pitch_deg), corner(path, i + 1, neutral_pitch_deg));
        let steps = steps_between(path, from, to) as usize;
        let dt = (pair[1].t_s - pair[0].t_s) / steps as f64;
        for k in 1..=steps {
            let s = k as f64 / steps as f64;
            let target = std::array::from_fn(|i| if k == steps { to[i] } else { from[i] + s * (to[i] - from[i]) });
            let response = go(Place { target, dt, before: i, share: s }, &mut at);
            if k == steps || k % STEPS_PER_ROW == 0 {
                let t_s = if k == steps { pair[1].t_s } else { pair[0].t_s + dt * k as f64 };
                rows.push(row(t_s, at, &response));
            }
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use fingerpad::build::{EffectSlot, Params};
    use fingerpad_fe::load_path::Waypoint;

    use super::*;

    #[test]
    fn a_files_effects_act_along_a_path() {
        let data = Params::example().try_build().unwrap();
        let model = data.model().unwrap();
        let corner = |t_s, normal, x| Waypoint { t_s, normal, x, y: 0.0 };
        let path = Path::new(
            [Drive::Displacement; 3],
            vec![corner(0.0, 0.0, 0.0), corner(0.5, 1.0, 0.0), corner(1.5, 1.0, 0.0), corner(2.5, 1.0, 10.0)],
        );
        let last = |slots: &[EffectSlot], surroundings| {
            let effects = Effects::new(slots).unwrap();
            simulate_path_with_effects(&model, &effects, surroundings, &[], &path).unwrap().pop().unwrap().response
        };
        let plain = simulate_path(&model, &path).unwrap().pop().unwrap().response;
        assert_eq!(last(&[], Surroundings::default()).friction_x_n, plain.friction_x_n);
        let slot = |kind, a, b| EffectSlot { kind, reserved: 0, values: [a, b, 0.0, 0.0, 0.0, 0.0] };
        // Temperature, 3 % per degree, 3 degrees below; speed, 5 % per e-fold, at 10 mm/s instead of 2.
        let cold = Surroundings { temperature_c: 29.0, ..Surroundings::default() };
        let found = last(&[slot(17, 0.03, 0.0)], cold).friction_x_n / plain.friction_x_n;
        assert!((found - 0.91).abs() < 1e-3, "{found}");
        let found = last(&[slot(2, 0.05, 0.0)], Surroundings::default()).friction_x_n / plain.friction_x_n;
        assert!((found - (1.0 + 0.05 * 5f64.ln())).abs() < 2e-3, "{found}");
        // Relaxation reads the clock: 2.5 s after the touch.
        let found = last(&[slot(6, 0.2, 1.4)], Surroundings::default()).normal_force_n / plain.normal_force_n;
        assert!((found - (1.0 - 0.2 * (1.0 - (-2.5f64 / 1.4).exp()))).abs() < 2e-2, "{found}");
        let forced = Path { drives: [Drive::Force, Drive::Displacement, Drive::Displacement], ..path.clone() };
        let refused = simulate_path_with_effects(&model, &Effects::new(&[]).unwrap(), cold, &[], &forced).unwrap_err();
        assert_eq!(refused, PathError::ForceWithEffects { column: "normal_force_n" });
    }
}
