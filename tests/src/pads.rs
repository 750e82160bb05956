//! A pad in motion on a body, with its balance of work.
//!
//! Main type: [`Ride`]. The same code in single and double precision.

use fingerpad::pad::{Cylinder, Edge, Pad, PadState, Plane, Sphere, Surface};
use fingerpad::{Elementary, Error, Motion, Response, Status};

use crate::random::Random;

/// Most patches of a pad here.
pub const PATCHES: usize = 64;

/// State of a contact in motion: slide x and y and depth (mm), spin, pitch from the neutral one and roll (rad).
#[derive(Clone)]
pub struct Ride<'a, T, B> {
    /// The pad.
    pub pad: Pad<'a, T>,
    /// The body that it touches.
    pub body: B,
    /// Its memory.
    pub state: PadState<PATCHES, T>,
    /// Its pose.
    pub at: [f64; 6],
    /// Its last response.
    pub last: Response<T>,
    /// Work of the body on the finger, and the sum of its magnitudes, mJ.
    pub work_mj: [f64; 2],
    /// Steps without equilibrium.
    pub open_steps: usize,
}

/// Half a millimetre above the finger.
pub const START: [f64; 6] = [0.0, 0.0, -0.5, 0.0, 0.0, 0.0];

/// To the scalar of the core.
pub trait Scalar: Elementary {
    /// The nearest number.
    fn near(x: f64) -> Self;
}

impl Scalar for f32 {
    fn near(x: f64) -> Self {
        x as Self
    }
}

impl Scalar for f64 {
    fn near(x: f64) -> Self {
        x
    }
}

impl<'a, T: Scalar + Into<f64>, B: Surface<T>> Ride<'a, T, B> {
    /// A finger in the air over a body.
    ///
    /// # Errors
    /// Those of [`PadState::new`].
    pub fn new(pad: Pad<'a, T>, body: B) -> Result<Self, Error> {
        // In the neutral pose bodies lie under the origin.
        let state = PadState::new(&pad)?;
        Ok(Self { pad, body, state, at: START, last: Response::default(), work_mj: [0.0; 2], open_steps: 0 })
    }

    fn height_mm(&self, at: &[f64; 6]) -> f64 {
        let normal = [-at[4].sin(), at[4].cos() * at[5].sin(), at[4].cos() * at[5].cos()];
        let first: f64 = self.pad.first_touch_mm(&normal.map(T::near)).into();
        first + at[2]
    }

    /// Force along the plane's axes and moment about the point about which poses turn.
    fn wrench(&self, at: &[f64; 6], r: &Response<T>) -> ([f64; 3], [f64; 3]) {
        let n: f64 = r.normal_force_n.into();
        let [x, y]: [f64; 2] = r.friction_n.map(Into::into);
        let [cx, cy]: [f64; 2] = r.pressure_centre_mm.map(Into::into);
        let height = self.height_mm(at);
        ([x, y, n], [n * cy - height * y, -n * cx + height * x, r.spin_moment_n_mm.into()])
    }

    /// One step to a place.
    pub fn step(&mut self, next: [f64; 6]) {
        let way: [f64; 6] = std::array::from_fn(|k| next[k] - self.at[k]);
        let motion = Motion {
            depth_mm: T::near(next[2]),
            slide_increment_mm: [T::near(way[0]), T::near(way[1])],
            spin_increment_rad: T::near(way[3]),
            dt_s: T::near(1e-3),
        };
        let neutral: f64 = self.pad.numbers.neutral_pitch_deg.into();
        let pose = [T::near(neutral + next[4].to_degrees()), T::near(next[5].to_degrees())];
        let answer = self.pad.step(&mut self.state, &self.body, motion, pose);
        let (before, after) = (self.wrench(&self.at, &self.last), self.wrench(&next, &answer));
        let mean = |k: usize| (0.5 * (before.0[k] + after.0[k]), 0.5 * (before.1[k] + after.1[k]));
        // The plane turns against the finger when the finger is pitched and rolled.
        let pitch = 0.5 * (self.at[4] + next[4]);
        let rise = self.height_mm(&next) - self.height_mm(&self.at);
        let turned = [-way[5] * pitch.cos(), -way[4], way[3] + way[5] * pitch.sin()];
        let parts = [mean(0).0 * way[0], mean(1).0 * way[1], mean(2).0 * rise];
        let turning = (0..3).map(|k| mean(k).1 * turned[k]);
        let done: f64 = parts.into_iter().chain(turning).sum();
        self.work_mj[0] += done;
        self.work_mj[1] += done.abs();
        self.open_steps += usize::from(answer.status.contains(Status::NOT_CONVERGED));
        self.last = answer;
        self.at = next;
    }

    /// Straight to a place.
    pub fn to(&mut self, to: [f64; 6], steps: usize) {
        let from = self.at;
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            self.step(std::array::from_fn(|k| if step == steps { to[k] } else { from[k] + share * (to[k] - from[k]) }));
        }
    }
}

/// Depth, slides, spin, pitch and roll of a vibration about a held place, mm and rad, one step of eight of a cycle. Depth and roll lag a
/// quarter behind, so that they go in circles. Slides and spin do not: the plane would creep on by the area of their loop.
fn phase(size: &[f64; 6], held: &[f64; 6], k: u32) -> [f64; 6] {
    let angle = f64::from(k) * std::f64::consts::FRAC_PI_4;
    std::array::from_fn(|axis| {
        let phase = if axis == 2 || axis == 5 { 1.0 - angle.cos() } else { angle.sin() };
        held[axis] + size[axis] * phase
    })
}

/// Friction of a load held at 1 mm after every cycle of a vibration, N, before the first one as well, and the limit at the end.
///
/// * `size`: amplitudes of slides, depth, spin, pitch and roll, mm and rad
///
/// # Errors
/// Those of [`PadState::new`].
pub fn held_load(pad: Pad<'_>, size: [f64; 6], cycles: usize) -> Result<(Vec<[f64; 2]>, f64), Error> {
    let mut ride = Ride::new(pad, fingerpad::pad::Plane)?;
    ride.to([0.0, 0.0, 1.0, 0.0, 0.0, 0.0], 50);
    ride.to([0.4, 0.2, 1.0, 0.0, 0.0, 0.0], 50);
    let held = ride.at;
    let mut after = vec![ride.last.friction_n.map(f64::from)];
    for _ in 0..cycles {
        (1..=8).for_each(|k| ride.step(phase(&size, &held, k)));
        after.push(ride.last.friction_n.map(f64::from));
    }
    Ok((after, ride.last.friction_limit_n.into()))
}

/// Least work of the body over the exchanged work, along random closed paths in all six coordinates with a strength
/// that changes.
///
/// * `steps`: steps of each of the eight legs of a path
///
/// # Errors
/// Those of [`PadState::new`].
pub fn least_work<B: Surface<f64> + Clone>(
    pad: Pad<'_, f64>,
    body: &B,
    paths: usize,
    steps: usize,
) -> Result<f64, Error> {
    let mut random = Random::new(5);
    let mut least = f64::INFINITY;
    for _ in 0..paths {
        let mut ride = Ride::new(pad, body.clone())?;
        ride.to([0.0, 0.0, 0.8 + 0.6 * random.number(), 0.0, 0.0, 0.0], steps);
        for _ in 0..5 {
            ride.state.set_strength_factor(1.0 + 0.5 * random.number());
            let n = random.list(6);
            ride.to([n[0], n[1], 0.8 + 0.7 * n[2], 0.3 * n[3], 0.2 * n[4], 0.2 * n[5]], steps);
        }
        ride.to([0.0, 0.0, ride.at[2], 0.0, 0.0, 0.0], steps);
        ride.to(START, steps);
        let [work, exchanged] = ride.work_mj;
        least = least.min(work / exchanged);
    }
    Ok(least)
}

/// [`least_work`] on each kind of body.
///
/// # Errors
/// Those of [`PadState::new`].
pub fn least_work_on_bodies(pad: Pad<'_, f64>, paths: usize) -> Result<[(&'static str, f64); 4], Error> {
    Ok([
        ("plane", least_work(pad, &Plane, paths, 300)?),
        ("sphere of 8 mm", least_work(pad, &Sphere { radius_mm: 8.0 }, paths, 300)?),
        ("cylinder of 10 mm", least_work(pad, &Cylinder::new(10.0, 53.0), paths, 300)?),
        ("edge of 2 mm", least_work(pad, &Edge::new(2.0, 53.0, 106.0), 4 * paths, 300)?),
    ])
}
