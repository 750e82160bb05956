//! Replay of a stored run's motion through the package that runs on the microcontroller.
//!
//! Main function: [`replay`]. In single precision it computes the same as a microcontroller; in double precision it is the forward model
//! of the fit.
//! Uses runs and `fingerpad`.

use fingerpad::{ModelOf, Motion, Response, Scalar, StateOf};

use super::{Run, Sample};

/// Longest motion of one step of a replay, mm; much shorter than any yield slide.
pub const STEP_MM: f32 = 0.02;
/// Largest turn of one step, rad: a spring 3 mm off the middle then moves by [`STEP_MM`].
pub const STEP_RAD: f32 = 0.007;

/// Spin of the plane at a sample, rad.
fn spin_rad(sample: &Sample) -> f32 {
    sample.turned.map_or(0.0, |t| t.spin_deg.to_radians())
}

/// Steps from one sample to the next.
fn steps_between(from: &Sample, to: &Sample, longer: f32) -> u32 {
    let slide = [0, 1].map(|k| to.slide_mm[k] - from.slide_mm[k]);
    let longest = slide[0].hypot(slide[1]).max((to.depth_mm - from.depth_mm).abs()) / STEP_MM;
    let turn = (spin_rad(to) - spin_rad(from)).abs() / STEP_RAD;
    (longest.max(turn) / longer).ceil().max(1.0) as u32
}

/// Steps of a replay.
pub fn replay_steps(run: &Run) -> usize {
    1 + run.samples.windows(2).map(|pair| steps_between(&pair[0], &pair[1], 1.0) as usize).sum::<usize>()
}

/// The model's response at every sample of `run`; the first is the start.
///
/// Between samples depth, slide and spin are linear over time and divided into steps of at most [`STEP_MM`] and [`STEP_RAD`]. The motion
/// of the finite elements is replayed, also where a force drove it.
pub fn replay<const M: usize, const N: usize, T: Scalar>(model: &ModelOf<'_, M, N, T>, run: &Run) -> Vec<Response<T>> {
    replay_coarsely(model, run, 1.0)
}

/// The same in steps that are `longer` times as long.
pub fn replay_coarsely<const M: usize, const N: usize, T: Scalar>(
    model: &ModelOf<'_, M, N, T>,
    run: &Run,
    longer: f32,
) -> Vec<Response<T>> {
    if run.spins() { along::<M, N, 2, T>(model, run, longer) } else { along::<M, N, 1, T>(model, run, longer) }
}

fn along<const M: usize, const N: usize, const P: usize, T: Scalar>(
    model: &ModelOf<'_, M, N, T>,
    run: &Run,
    longer: f32,
) -> Vec<Response<T>> {
    let dt_s = T::of(1e-3);
    let mut state = StateOf::<M, P, T>::default();
    let mut responses = Vec::with_capacity(run.samples.len());
    if let Some(first) = run.samples.first() {
        let motion = Motion { depth_mm: T::of(first.depth_mm), dt_s, ..Motion::default() };
        responses.push(model.step(&mut state, motion));
    }
    for pair in run.samples.windows(2) {
        let (from, to) = (&pair[0], &pair[1]);
        let steps = steps_between(from, to, longer);
        let part = T::of(1.0) / T::of(steps as f32);
        let between = |a: f32, b: f32| (T::of(b) - T::of(a)) * part;
        let (deeper, turn) = (between(from.depth_mm, to.depth_mm), between(spin_rad(from), spin_rad(to)));
        let slide: [T; 2] = std::array::from_fn(|k| between(from.slide_mm[k], to.slide_mm[k]));
        let mut response = Response::default();
        for k in 1..=steps {
            let depth_mm =
                if k == steps { T::of(to.depth_mm) } else { T::of(from.depth_mm) + deeper * T::of(k as f32) };
            let motion = Motion { depth_mm, slide_increment_mm: slide, spin_increment_rad: turn, dt_s };
            response = model.step(&mut state, motion);
        }
        responses.push(response);
    }
    responses
}

/// Moment about the plane's normal, N mm. None where a run stored no moments.
pub fn spin_moment(sample: &Sample) -> Option<f64> {
    sample.turned.map(|t| t.moment_n_mm[2].into())
}

/// Place of the centre of pressure along x and y from the point under first touch, mm. None without contact or moments.
pub fn pressure_centre(sample: &Sample) -> Option<[f64; 2]> {
    let (normal, turned) = (f64::from(sample.normal_force_n), sample.turned?);
    let [mx, my, _] = turned.moment_n_mm.map(f64::from);
    (normal > 1e-3).then(|| [-my / normal, mx / normal])
}
