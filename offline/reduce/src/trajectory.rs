//! The reduced model along a path of waypoints, driven by displacements or forces.
//!
//! Main types: [`follow`], [`TrajectoryRow`]. Uses `fingerpad` and slide's [`Path`].

use fingerpad::{
    Contact, Drive as CoreDrive, Effects, ModelOf, Motion, Normal, Response, StateOf, Surroundings, Tangential,
};

use fingerpad_fe::load_path::{self, Drive, Path};

/// Longest motion of one step, mm, as in replays.
const STEP_MM: f64 = super::STEP_MM as f64;
/// Largest change of a driven force in one step, N.
const STEP_N: f64 = 0.005;
/// Distance between rows within a segment, steps.
const STEPS_PER_ROW: usize = 5;

/// One row: the quantities of a finite-element response, and those that only the reduced model gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryRow {
    /// Position, forces and moments; the centre of pressure along y is NaN and the moment about x 0: the model knows neither.
    pub response: load_path::Response,
    /// Largest friction in the direction of the present one, N.
    pub friction_limit_n: f64,
    /// 1 − |friction| / limit.
    pub slip_margin: f64,
    /// Half-width of the 95 % band of the normal force, N.
    pub band_normal_n: f64,
    /// Half-width of the 95 % band of each friction component, N.
    pub band_friction_n: f64,
}

fn row(t_s: f64, at: [f64; 4], r: &Response) -> TrajectoryRow {
    TrajectoryRow {
        response: load_path::Response {
            t_s,
            depth_mm: at[0],
            slide_x_mm: at[1],
            slide_y_mm: at[2],
            normal_force_n: r.normal_force_n.into(),
            friction_x_n: r.friction_n[0].into(),
            friction_y_n: r.friction_n[1].into(),
            contact_area_mm2: r.contact_area_mm2.into(),
            stick_ratio: r.stick_ratio.into(),
            regime: r.regime,
            status: r.status,
            centre_of_pressure_mm: r.pressure_centre_mm.map(f64::from),
            spin_deg: at[3],
            moment_n_mm: [
                f64::from(r.pressure_centre_mm[1] * r.normal_force_n),
                -f64::from(r.pressure_centre_mm[0] * r.normal_force_n),
                r.spin_moment_n_mm.into(),
            ],
            ..Default::default()
        },
        friction_limit_n: r.friction_limit_n.into(),
        slip_margin: r.slip_margin.into(),
        band_normal_n: r.band_normal_n.into(),
        band_friction_n: r.band_friction_n.into(),
    }
}

/// Simulates `path` in steps of at most 0.02 mm, 0.4° or 5 mN; returns a row at every waypoint and at every fifth step between.
///
/// Slides driven by force start from 0; a force out of reach leaves the nearest state and its flag. Pitch and roll and a spin
/// driven by its moment are not known to the model ([`crate::is_representable`]) and left out.
pub fn simulate_path<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, path: &Path) -> Vec<TrajectoryRow> {
    if path.turns.spin.is_some() { driven::<M, N, 2>(model, path) } else { driven::<M, N, 1>(model, path) }
}

fn driven<const M: usize, const N: usize, const P: usize>(
    model: &ModelOf<'_, M, N>,
    path: &Path,
) -> Vec<TrajectoryRow> {
    let mut state = StateOf::<M, P>::default();
    let by_force = path.drives.map(|d| d == Drive::Force);
    along(path, &mut |Place { target, dt, .. }: Place, at: &mut [f64; 4]| -> Response {
        let normal = if by_force[0] { Normal::ForceN(target[0] as f32) } else { Normal::DepthMm(target[0] as f32) };
        // Both tangential axes are driven alike by the core; a mixed drive holds the other at its present force.
        let slide = [target[1] - at[1], target[2] - at[2]];
        let tangential = if by_force[1] || by_force[2] {
            Tangential::FrictionN([target[1] as f32, target[2] as f32])
        } else {
            Tangential::SlideIncrementMm(slide.map(|s| s as f32))
        };
        let spin_increment_rad = (target[3] - at[3]).to_radians() as f32;
        let drive = CoreDrive { normal, tangential, spin_increment_rad, dt_s: dt.max(1e-6) as f32 };
        let driven = model.step_driven(&mut state, drive);
        at[0] = driven.motion.depth_mm.into();
        for k in 0..2 {
            at[k + 1] = if by_force[1] || by_force[2] {
                at[k + 1] + f64::from(driven.motion.slide_increment_mm[k])
            } else {
                target[k + 1]
            };
        }
        at[3] = target[3];
        driven.response
    })
}

/// Simulates `path` with the effects of a model file, in surroundings that are constant but for the clock of the
/// series, which starts at theirs, and for columns of the user's own. Forces are the sensor's readings where the file has a
/// tare or cross-talk.
///
/// * `own`: for each of these columns its value at every waypoint, between which it changes evenly over the steps; where there
///   is none, that of the surroundings holds throughout
///
/// `None` for a path that is driven by force or spins: effects know depth and slide alone.
pub fn simulate_path_with_effects<const M: usize, const N: usize>(
    model: &ModelOf<'_, M, N>,
    effects: &Effects<'_>,
    surroundings: Surroundings,
    own: &[Option<Vec<f64>>],
    path: &Path,
) -> Option<Vec<TrajectoryRow>> {
    if path.drives.contains(&Drive::Force) || path.turns.spin.is_some() {
        return None;
    }
    let mut contact = Contact::<M>::default();
    let mut now = surroundings;
    Some(along(path, &mut |Place { target, dt, before, share }: Place, at: &mut [f64; 4]| -> Response {
        now.series_s += dt as f32;
        for (to, values) in now.own.iter_mut().zip(own) {
            let at = |k: usize| values.as_ref().and_then(|v| v.get(k)).copied();
            if let Some(from) = at(before) {
                let next = at(before + 1).unwrap_or(from);
                *to = if share < 1.0 { from + share * (next - from) } else { next } as f32;
            }
        }
        let slide = [target[1] - at[1], target[2] - at[2]].map(|s| s as f32);
        let motion = Motion {
            depth_mm: target[0] as f32,
            slide_increment_mm: slide,
            spin_increment_rad: 0.0,
            dt_s: dt.max(1e-6) as f32,
        };
        *at = target;
        let mut response = effects.step(model, &mut contact, now, motion);
        let [normal, x, y] = effects.reading_under(&response, &contact, &now);
        (response.normal_force_n, response.friction_n) = (normal, [x, y]);
        response
    }))
}

/// Steps that a path takes, as a float since a path may be absurdly long.
pub fn steps(path: &Path) -> f64 {
    (1..path.waypoints.len()).map(|i| steps_between(path, corner(path, i - 1), corner(path, i))).sum()
}

/// Depth or normal force, slides or frictions, and spin (degrees) at a waypoint.
fn corner(path: &Path, index: usize) -> [f64; 4] {
    let w = &path.waypoints[index];
    let spin = path.turns.spin.as_ref().and_then(|turn| turn.values.get(index)).copied().unwrap_or(0.0);
    [w.normal, w.x, w.y, spin]
}

fn steps_between(path: &Path, from: [f64; 4], to: [f64; 4]) -> f64 {
    let longest = |k: usize| match path.drives.get(k) {
        Some(Drive::Force) => STEP_N,
        Some(_) => STEP_MM,
        None => f64::from(super::STEP_RAD).to_degrees(),
    };
    (0..4).map(|k| (to[k] - from[k]).abs() / longest(k)).fold(0.0, f64::max).ceil().max(1.0)
}

/// Where one step leads.
struct Place {
    /// Depth or normal force, slides or frictions, spin.
    target: [f64; 4],
    /// Duration, s.
    dt: f64,
    /// The last waypoint before it.
    before: usize,
    /// Share of the way from there to the next one.
    share: f64,
}

/// One step: from where it leads and the position, which it moves, to the response there.
type Step<'a> = dyn FnMut(Place, &mut [f64; 4]) -> Response + 'a;

/// Steps along a path: `go` makes one step to a target and sets the position to the one reached.
fn along(path: &Path, go: &mut Step) -> Vec<TrajectoryRow> {
    let by_force = |k: usize| path.drives.get(k) == Some(&Drive::Force);
    let start = corner(path, 0);
    let mut at: [f64; 4] = std::array::from_fn(|k| if by_force(k) { 0.0 } else { start[k] });
    let mut rows = Vec::new();
    let response = go(Place { target: start, dt: 1e-3, before: 0, share: 0.0 }, &mut at);
    rows.push(row(path.waypoints[0].t_s, at, &response));
    for (i, pair) in path.waypoints.windows(2).enumerate() {
        let (from, to) = (corner(path, i), corner(path, i + 1));
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
    use fingerpad::{EffectSlot, Params};
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
        let plain = simulate_path(&model, &path).pop().unwrap().response;
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
        assert!(simulate_path_with_effects(&model, &Effects::new(&[]).unwrap(), cold, &[], &forced).is_none());
    }
}
