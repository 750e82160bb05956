//! A pad in motion on a body, with its balance of work.
//!
//! Main type: [`Ride`]. The same code in single and double precision.

use fingerpad::pad::{Body, Cylinder, Edge, Pad, PadState, Sphere};
use fingerpad::{Elementary, Error, Motion, Response, Status};

use crate::random::Random;

/// Most patches of a pad here.
pub const PATCHES: usize = 64;

/// State of a contact in motion: slide x and y and depth (mm), spin, pitch from the neutral one and roll (rad).
#[derive(Clone)]
pub struct Ride<'a, T> {
    /// The pad.
    pub pad: Pad<'a, T>,
    /// The body that it touches.
    pub body: Body<T>,
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

impl<'a, T: Elementary + Into<f64>> Ride<'a, T> {
    /// A finger in the air over a body.
    ///
    /// # Errors
    /// Those of [`PadState::new`].
    pub fn new(pad: Pad<'a, T>, body: Body<T>) -> Result<Self, Error> {
        // In the neutral pose bodies lie under the origin.
        let state = PadState::new(&pad)?;
        Ok(Self { pad, body, state, at: START, last: Response::default(), work_mj: [0.0; 2], open_steps: 0 })
    }

    fn height_mm(&self, at: &[f64; 6]) -> f64 {
        let normal = [-at[4].sin(), at[4].cos() * at[5].sin(), at[4].cos() * at[5].cos()];
        let first: f64 = self.pad.first_touch_mm(&normal.map(T::near)).into();
        first + at[2]
    }

    /// Force along the plane's axes, and moment about the point about which poses turn, along the axes about which they turn.
    fn wrench(&self, at: &[f64; 6], r: &Response<T>) -> ([f64; 3], [f64; 3]) {
        let [x, y]: [f64; 2] = r.friction_n.map(Into::into);
        let [about_x, about_y]: [f64; 2] = r.tilt_moment_n_mm.map(Into::into);
        let height = self.height_mm(at);
        ([x, y, r.normal_force_n.into()], [about_x - height * y, about_y + height * x, r.spin_moment_n_mm.into()])
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
        // A curved body spins about its apex: the point of it at the foot goes round.
        let [x, y] = [0, 1].map(|k| if self.body == Body::Plane { 0.0 } else { 0.5 * (self.at[k] + next[k]) });
        let parts = [mean(0).0 * (way[0] + way[3] * y), mean(1).0 * (way[1] - way[3] * x), mean(2).0 * rise];
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
    let mut ride = Ride::new(pad, Body::Plane)?;
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

/// Corners of a cycle.
const CORNERS: usize = 5;
/// Ranges of the coordinates of a cycle on both sides of [`DEPTH_MM`] and 0: slides and depth, mm, spin, pitch and roll, rad; last, the
/// exponent of the strength factor.
const RANGES: [f64; 7] = [1.5, 1.5, 1.6, 0.4, 0.34, 0.4, 1.4];
const DEPTH_MM: f64 = 1.75;
/// Least exchanged work that counts, mJ.
const LEAST_MJ: f64 = 0.1;

/// A closed path in six coordinates, along which the strength changes: shares of [`RANGES`].
#[derive(Clone, Copy)]
struct Cycle {
    middle: [f64; 7],
    corners: [[f64; 7]; CORNERS],
    /// Logarithm of the size of the path around its middle.
    size: f64,
}

impl Cycle {
    fn random(random: &mut Random) -> Self {
        let mut list = || std::array::from_fn(|_| random.number());
        let (middle, corners) = (list(), std::array::from_fn(|_| list()));
        Self { middle, corners, size: random.number() }
    }

    fn changed(mut self, random: &mut Random, by: f64) -> Self {
        let numbers = self.corners.as_flattened_mut().iter_mut().chain(&mut self.middle).chain([&mut self.size]);
        for number in numbers {
            *number = (*number + by * random.number()).clamp(-1.0, 1.0);
        }
        self
    }

    /// A corner, and its strength factor.
    fn corner(&self, k: usize) -> ([f64; 6], f64) {
        let size = 10f64.powf(-1.0 - self.size);
        let share = |axis: usize| (self.middle[axis] + size * self.corners[k][axis]).clamp(-1.0, 1.0);
        let mut at: [f64; 6] = std::array::from_fn(|axis| share(axis) * RANGES[axis]);
        at[2] += DEPTH_MM;
        (at, 3f64.powf(share(6) * RANGES[6]))
    }

    /// Least of three rounds: the work of the body less the growth of the stored energy, over the exchanged work. Friction can only
    /// dissipate, so that it is negative where the pad yields work. Infinite where little is exchanged or a step finds no equilibrium.
    fn dissipated<T: Elementary + Into<f64>>(
        &self,
        pad: Pad<'_, T>,
        body: Body<T>,
        steps: usize,
    ) -> Result<f64, Error> {
        let mut ride = Ride::new(pad, body)?;
        let (start, _) = self.corner(CORNERS - 1);
        ride.to([0.0, 0.0, start[2], 0.0, 0.0, 0.0], steps);
        ride.to(start, steps);
        let mut least = f64::INFINITY;
        for _ in 0..3 {
            let energy = |ride: &Ride<'_, T>| -> f64 { ride.pad.energy_mj(&ride.state, &ride.body).into() };
            let before = energy(&ride);
            ride.work_mj = [0.0; 2];
            for k in 0..CORNERS {
                let (at, strength) = self.corner(k);
                ride.state.set_strength_factor(T::near(strength));
                ride.to(at, steps);
            }
            let [work, exchanged] = ride.work_mj;
            if exchanged > LEAST_MJ && ride.open_steps == 0 {
                least = least.min((work - (energy(&ride) - before)) / exchanged);
            }
        }
        Ok(least)
    }
}

/// Least dissipated share of the exchanged work that a search finds: it changes closed paths at random, keeps a change that dissipates
/// less, and starts again where it finds none. The best path of each start is repeated in steps of a sixteenth.
///
/// * `steps`: steps of each of the five legs of a path
fn least_dissipation<T: Elementary + Into<f64>>(
    pad: Pad<'_, T>,
    body: Body<T>,
    paths: usize,
    steps: usize,
) -> Result<f64, Error> {
    let mut random = Random::new(5);
    let mut least = f64::INFINITY;
    let mut tried = 0;
    while tried < paths {
        let mut best = (f64::INFINITY, Cycle::random(&mut random));
        let mut failures = 0;
        while failures < 40 && tried < paths {
            let cycle = best.1.changed(&mut random, 0.3 * 0.5f64.powi(failures / 10));
            let found = cycle.dissipated(pad, body, steps)?;
            tried += 1;
            failures = if found < best.0 { 0 } else { failures + 1 };
            if found < best.0 {
                best = (found, cycle);
            }
        }
        if best.0 < least {
            least = least.min(best.1.dissipated(pad, body, 16 * steps)?);
        }
    }
    Ok(least)
}

fn least_dissipations<T: Elementary + Into<f64>>(
    pad: Pad<'_, T>,
    paths: usize,
    steps: usize,
) -> Result<OnBodies, Error> {
    on_bodies(|body| least_dissipation(pad, body, paths / 4, steps))
}

/// A number of each body.
fn on_bodies<T: Elementary>(number: impl Fn(Body<T>) -> Result<f64, Error>) -> Result<OnBodies, Error> {
    let [eight, ten, two, axis, angle] = [8.0, 10.0, 2.0, 53.0, 106.0].map(T::near);
    Ok([
        ("plane", number(Body::Plane)?),
        ("sphere of 8 mm", number(Body::Sphere(Sphere::new(eight)?))?),
        ("cylinder of 10 mm", number(Body::Cylinder(Cylinder::new(ten, axis)?))?),
        ("edge of 2 mm", number(Body::Edge(Edge::new(two, axis, angle)?))?),
    ])
}

/// A number for each kind of body.
pub type OnBodies = [(&'static str, f64); 4];

/// The least dissipated share of the exchanged work that a search for closed paths finds on each body, in double precision.
///
/// * `paths`: tried on all bodies together
/// * `steps`: of each of the five legs of a path
///
/// # Errors
/// Those of [`PadState::new`].
pub fn least_dissipations_f64(pad: Pad<'_, f64>, paths: usize, steps: usize) -> Result<OnBodies, Error> {
    least_dissipations(pad, paths, steps)
}

/// The same in single precision.
///
/// # Errors
/// Those of [`PadState::new`].
pub fn least_dissipations_f32(pad: Pad<'_>, paths: usize, steps: usize) -> Result<OnBodies, Error> {
    least_dissipations(pad, paths, steps)
}

/// Largest difference between the slopes of the stored energy and the response on each body, over the largest force or moment: at 20
/// places, over all six coordinates of a body on which nothing slips.
///
/// # Errors
/// Those of [`PadState::new`].
pub fn energy_slopes(pad: Pad<'_, f64>) -> Result<OnBodies, Error> {
    on_bodies(|body| slopes_off(pad, body))
}

fn slopes_off(pad: Pad<'_, f64>, body: Body<f64>) -> Result<f64, Error> {
    let mut numbers = *pad.numbers;
    numbers.law.friction[0] *= 200.0;
    let pad = Pad::new(pad.patches, &numbers);
    let mut random = Random::new(3);
    let (mut worst, mut places) = (0.0f64, 0);
    while places < 20 {
        let at: [f64; 6] = std::array::from_fn(|k| [0.4, 0.4, 1.2, 0.2, 0.35, 0.35][k] * random.number());
        // Every other place is near first touch, where a body is shifted; there less holds a patch.
        let (depth, held) = if places % 2 == 0 { (1.7 + at[2], 1.0) } else { (0.3 + 0.2 * at[2], 0.02) };
        let at = [held * at[0], held * at[1], depth, held * at[3], at[4], at[5]];
        let mut ride = Ride::new(pad, body)?;
        ride.to([0.0, 0.0, 0.8 * at[2], 0.0, at[4], at[5]], 60);
        ride.to(at, 120);
        // A round body may lie beside the finger in a pose, or hardly touch it.
        if !(ride.last.normal_force_n > 1e-3) {
            continue;
        }
        places += 1;
        let step = 2e-4;
        let both: [[f64; 2]; 6] = std::array::from_fn(|axis| {
            let [up, down] = [step, -step].map(|by| {
                let mut moved = ride.clone();
                let mut to = at;
                to[axis] += by;
                moved.work_mj = [0.0; 2];
                moved.to(to, 1);
                // Further steps at rest leave less of the error of equilibrium.
                (0..20).for_each(|_| moved.step(to));
                [moved.pad.energy_mj(&moved.state, &moved.body), moved.work_mj[0]]
            });
            [0, 1].map(|k| (up[k] - down[k]) / (2.0 * step))
        });
        let largest = |axes: std::ops::Range<usize>| both[axes].iter().fold(0.0f64, |most, b| most.max(b[1].abs()));
        let (force, moment) = (largest(0..3), largest(0..6));
        for (axis, [stored, done]) in both.iter().enumerate() {
            worst = worst.max((stored - done).abs() / if axis < 3 { force } else { moment });
        }
    }
    Ok(worst)
}
