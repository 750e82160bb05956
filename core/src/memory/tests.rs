//! Work and energy of a bed that relaxes.

use super::*;
use crate::build::{Data, DataOf, Parabola};
use crate::host::ModelFile;
use crate::plane::spring_positions;
use crate::{Branch, ModelOf, Motion, NODES, RelaxingStateOf, SPRINGS};

/// Uniform between two numbers, the same every time.
struct Random(u64);

impl Random {
    fn between(&mut self, least: f64, most: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        least + (most - least) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

type State<const P: usize, T> = RelaxingStateOf<SPRINGS, P, T>;

/// Energy of the tissue, mJ: of skin that does not touch with its branches in balance. In double precision and from the formulas alone.
fn stored<const P: usize, T: Elementary>(model: &ModelOf<'_, SPRINGS, NODES, T>, state: &State<P, T>) -> f64 {
    let (data, memory) = (model.data, &state.forces.memory);
    let shares = memory.clock.shares_left(model.relaxation.unwrap()).map(T::to_f64);
    let stiff = shares.iter().fold(1.0, |sum, share| sum + share);
    let h = |memory: [T; BRANCHES]| shares.iter().zip(memory).map(|(g, x)| g * x.to_f64()).sum::<f64>();
    // The depth of a relaxed force, and the energy to a depth.
    let cell = 1.0 / data.cells_per_mm.to_f64();
    let lines = || data.rows[..NODES - 1].iter().map(|r| [r.normal.value, r.normal.change].map(T::to_f64));
    let depth_of = |force: f64| {
        let t = |[value, change]: [f64; 2]| ((force - value) / change).clamp(0.0, 1.0);
        lines().map(t).sum::<f64>() * cell
    };
    let pressed = |depth: f64| {
        let parts = lines().enumerate().map(|(i, [value, change])| {
            let t = (depth / cell - i as f64).clamp(0.0, 1.0);
            t * (value + 0.5 * t * change)
        });
        parts.sum::<f64>() * cell
    };
    let touches = state.in_contact();
    let depth = if touches { state.depth_mm().to_f64() } else { depth_of(h(memory.normal) / stiff) };
    let mut energy = pressed(depth);
    for (share, nu) in shares.iter().zip(memory.normal.map(T::to_f64)) {
        let before = depth_of(nu);
        energy += share * (pressed(depth) - pressed(before) - nu * (depth - before));
    }
    let (row, t) = model.cell(T::near(depth));
    let at = |p: &Parabola<T>| p.at(t).to_f64();
    let q = data.odd.to_f64() / state.strength_factor().to_f64();
    let [x, y] = state.forces.position[0];
    let here = [x + row.press_slide.at(t), y, state.forces.angle[0]];
    for (j, spring) in data.springs.iter().enumerate() {
        let to = spring_positions::<P, T>(here, spring);
        for (k, to) in to.iter().enumerate() {
            for axis in 0..2 {
                let w = memory.stretch[j][k].map(|stretch| stretch[axis]);
                let h = h(w);
                let u = if touches { (to[axis] - state.forces.anchor[j][k][axis]).to_f64() } else { h / stiff };
                let branches = shares.iter().zip(w).map(|(g, w)| 0.5 * g * (u - w.to_f64()).powi(2));
                let mut of_spring = 0.5 * u * u + branches.sum::<f64>();
                if axis == 0 {
                    let (v, more) = (stiff * u - h, stiff - 1.0);
                    of_spring -= q / 3.0 / stiff * (v.powi(3) + h.powi(3) / (more * more));
                }
                let stiffness = at(if axis == 0 { &row.stiffness_x } else { &row.stiffness_y });
                energy += spring.stiffness.to_f64() / P as f64 * stiffness * of_spring;
            }
        }
    }
    energy
}

/// A closed path of depth, slide and spin, from the air into the air.
#[derive(Clone, Copy)]
struct Cycle {
    branches: [Branch<f64>; BRANCHES],
    /// x, y, angle, depth; the time of each step to there, s; and the strength factor on the way.
    corners: [([f64; 4], f64, f64); 8],
    seed: u64,
}

/// Work of a cycle less what is stored after it, and the least of a single step, in double precision; over what is exchanged, mJ.
struct Balance {
    work: f64,
    kept: f64,
    of_step: f64,
    exchanged: f64,
}

const AIR: [f64; 4] = [0.0, 0.0, 0.0, -0.1];

impl Cycle {
    /// * `strengths`: whether the strength changes on the way
    fn any<const P: usize>(random: &mut Random, strengths: bool) -> Self {
        let most = if strengths { [2.0, 1.0, 3.0] } else { [1.0, 0.6, 0.6] };
        let branches = core::array::from_fn(|i| Branch {
            share: random.between(0.0, most[i]),
            time_s: [1e-4, 1e-2, 1.0][i] * 100f64.powf(random.between(0.0, 1.0)),
        });
        let first = random.between(0.5, 1.5);
        let corners = core::array::from_fn(|corner| {
            let reach = [0.1, 1.0, 6.0][corner % 3];
            let to = [
                random.between(-reach, reach),
                random.between(-reach, reach),
                if P == 1 { 0.0 } else { random.between(-0.3, 0.3) },
                random.between(-0.2, 2.4),
            ];
            let strength = if strengths { random.between(0.5, 1.5) } else { first };
            (if corner == 7 { AIR } else { to }, 10f64.powf(random.between(-5.0, -1.0)), strength)
        });
        Self { branches, corners, seed: random.0 }
    }

    /// The cycle with one corner, its pace or a branch changed.
    fn varied<const P: usize>(&self, random: &mut Random, amount: f64) -> Self {
        let mut this = *self;
        let mut by = |size: f64| amount * random.between(-size, size);
        let branch = &mut this.branches[(self.seed % 3) as usize];
        branch.share = (branch.share + by(1.0)).clamp(0.01, 3.0);
        branch.time_s = (branch.time_s * by(2.0).exp()).clamp(1e-4, 100.0);
        let (to, pace, _) = &mut this.corners[(self.seed % 7) as usize];
        let [x, y, angle, depth] = *to;
        let turn = if P == 1 { 0.0 } else { angle + by(0.3) };
        *to = [x + by(1.0), y + by(1.0), turn, (depth + by(1.0)).clamp(-0.2, 2.4)];
        *pace = (*pace * by(3.0).exp()).clamp(1e-5, 0.1);
        this.seed = random.0;
        this
    }

    /// Follows the cycle in steps over four decades of time, a few of no time, none or a very long one. None for branches that the bed
    /// refuses.
    fn follow<const P: usize, T: Elementary>(&self, data: &DataOf<SPRINGS, NODES, T>) -> Option<Balance> {
        let mut random = Random(self.seed);
        let relaxation = Relaxation {
            branches: self.branches.map(|b| Branch { share: T::near(b.share), time_s: T::near(b.time_s) }),
        };
        let model = data.model_unchecked().with_relaxation(&relaxation).ok()?;
        let mut state = State::<P, T>::relaxing();
        let (mut from, mut at) = (AIR, AIR.map(T::near));
        let (mut before, mut balance) = (0.0, Balance { work: 0.0, kept: f64::INFINITY, of_step: 0.0, exchanged: 0.0 });
        for (to, pace, strength) in self.corners {
            state.set_strength_factor(T::near(strength));
            for step in 1..=100 {
                let share = f64::from(step) / 100.0;
                let next: [T; 4] = core::array::from_fn(|k| T::near(from[k] + share * (to[k] - from[k])));
                let by: [T; 4] = core::array::from_fn(|k| next[k] - at[k]);
                let dt_s = match random.between(0.0, 40.0) as usize {
                    0 => 0.0,
                    1 => f64::NAN,
                    2 => -1.0,
                    3 => 1e8,
                    _ => pace,
                };
                let motion = Motion {
                    depth_mm: next[3],
                    slide_increment_mm: [by[0], by[1]],
                    spin_increment_rad: by[2],
                    dt_s: T::near(dt_s),
                };
                let r = model.step(&mut state, motion);
                let turned = if P == 1 { T::of(0.0) } else { r.spin_moment_n_mm };
                let forces = [r.friction_n[0], r.friction_n[1], turned, r.normal_force_n];
                let parts = forces.iter().zip(by).map(|(force, by)| force.to_f64() * by.to_f64());
                let (done, moved) = parts.fold((0.0, 0.0), |(sum, all), part| (sum + part, all + part.abs()));
                (balance.work, balance.exchanged) = (balance.work + done, balance.exchanged + moved);
                at = next;
                if size_of::<T>() == 8 {
                    let now = stored(&model, &state);
                    balance.of_step = balance.of_step.min(done - (now - before));
                    before = now;
                }
            }
            if balance.exchanged > 0.01 {
                balance.kept = balance.kept.min((balance.work - stored(&model, &state)) / balance.exchanged);
            }
            from = to;
        }
        balance.of_step /= balance.exchanged.max(0.01);
        Some(balance)
    }
}

/// The numbers of a bed; where the strength changes without the odd term of its springs, since a change of that does work.
fn numbers<T: Elementary>(data: &Data, strengths: bool) -> DataOf<SPRINGS, NODES, T> {
    Data { odd: if strengths { 0.0 } else { data.odd }, ..*data }.cast()
}

/// The least work less what is stored of many cycles, over what is exchanged.
///
/// In double precision checks each step as well. Without the odd term the energy is exact, and no step returns more than rounding. With it
/// and several branches it is not.
fn least_loss<const P: usize, T: Elementary>(data: &Data, strengths: bool, paths: u32) -> f64 {
    let data = numbers::<T>(data, strengths);
    let mut random = Random(17);
    let (mut least, mut lost, mut worst) = (f64::INFINITY, 0.0, 0.0f64);
    for _ in 0..paths {
        let balance = Cycle::any::<P>(&mut random, strengths).follow::<P, T>(&data).unwrap();
        (least, worst) = (least.min(balance.kept), worst.min(balance.of_step));
        lost += balance.work / balance.exchanged.max(1e-9) / f64::from(paths);
    }
    std::println!(
        "P {P}, {} bits, strengths {strengths}: least {least:+.2e}, mean {lost:.3}, step {worst:+.1e}",
        8 * size_of::<T>()
    );
    assert!(lost > 0.1, "the mean loss is {lost}");
    assert!(worst >= if strengths { -1e-9 } else { -2e-4 }, "a step: {worst:e}");
    least
}

/// Climbs from many cycles towards one that gains work. Returns the least loss that is found.
fn climbed<const P: usize>(data: &Data, strengths: bool, climbs: u32, steps: u32) -> f64 {
    let data = numbers::<f64>(data, strengths);
    let mut random = Random(29);
    let loss = |cycle: &Cycle| {
        let balance = cycle.follow::<P, f64>(&data).filter(|balance| balance.exchanged > 0.1);
        balance.map_or(f64::INFINITY, |balance| balance.kept)
    };
    let mut least = f64::INFINITY;
    for _ in 0..climbs {
        let mut best = Cycle::any::<P>(&mut random, strengths);
        let mut of_best = loss(&best);
        for k in 0..steps {
            let amount = 0.5 * 0.02f64.powf(f64::from(k) / f64::from(steps));
            let next = best.varied::<P>(&mut random, amount);
            let of_next = loss(&next);
            if of_next < of_best {
                (best, of_best) = (next, of_next);
            }
        }
        least = least.min(of_best);
    }
    std::println!("P {P}, strengths {strengths}: climbed to {least:+.2e}");
    least
}

/// A sheared contact that has relaxed in part: without time its normal force is the slope of the stored energy over the depth.
#[test]
fn the_normal_force_is_the_slope_of_the_stored_energy() {
    let data: DataOf<SPRINGS, NODES, f64> =
        Data { odd: 0.0, ..crate::build::Params::example().try_build().unwrap() }.cast();
    let relaxation = Relaxation::HUMAN_ASSUMED.cast();
    let model = data.model_unchecked().with_relaxation(&relaxation).unwrap();
    let mut state = State::<2, f64>::relaxing();
    state.set_strength_factor(5.0);
    let mut go = |depth_mm: f64, by: f64, dt_s: f64| {
        let slide_increment_mm = [by, -0.7 * by];
        let r = model.step(&mut state, Motion { depth_mm, slide_increment_mm, spin_increment_rad: 0.1 * by, dt_s });
        (r.normal_force_n, stored(&model, &state))
    };
    for k in 1..=20 {
        go(0.05 * f64::from(k), 0.1, 5e-3);
    }
    let ([before, low], deeper) = (go(1.0, 0.0, 0.0).into(), 1e-4);
    let (after, high) = go(1.0 + deeper, 0.0, 0.0);
    let slope = (high - low) / deeper;
    assert!((0.5 * (before + after) / slope - 1.0).abs() < 1e-5, "{before} {after} {slope}");
}

fn beds() -> [Data; 2] {
    let shipped = ModelFile::new(include_bytes!("../../tests/data/fingertip.fpm")).unwrap();
    [*shipped.file().model.data(), crate::build::Params::example().try_build().unwrap()]
}

fn no_path_yields_work(paths: u32) {
    for (data, strengths) in beds().iter().flat_map(|data| [(data, false), (data, true)]) {
        let double = [least_loss::<1, f64>(data, strengths, paths), least_loss::<2, f64>(data, strengths, paths)];
        assert!(double.iter().all(|least| *least > -1e-5), "{double:?}");
        let single = [least_loss::<1, f32>(data, strengths, paths), least_loss::<2, f32>(data, strengths, paths)];
        assert!(single.iter().all(|least| *least > -3e-4), "{single:?}");
    }
}

#[test]
#[ignore = "nightly"]
fn no_cycle_that_a_search_climbs_to_yields_work() {
    for (data, strengths) in beds().iter().flat_map(|data| [(data, false), (data, true)]) {
        let least = [climbed::<1>(data, strengths, 4, 1000), climbed::<2>(data, strengths, 4, 1000)];
        assert!(least.iter().all(|least| *least > -1e-5), "{least:?}");
    }
}

/// A plane that leaves quickly is far from the skin, which comes back as its branches let go. It forgets nothing on the way.
#[test]
fn a_quick_retraction_forgets_nothing() {
    let [data, _] = beds();
    let model = data.model_unchecked().with_relaxation(&Relaxation::HUMAN_ASSUMED).unwrap();
    let mut state = RelaxingStateOf::<SPRINGS>::relaxing();
    let mut step = |depth_mm: f32, dt_s: f32| {
        let r = model.step(&mut state, Motion { depth_mm, dt_s, ..Motion::default() });
        assert_eq!(r.status, crate::Status::OK, "{depth_mm} mm");
        r.normal_force_n
    };
    let held = (0..100).map(|_| step(2.0, 0.1)).last().unwrap();
    assert!(held > 0.5, "{held}");
    let left: f32 = (1..=400).map(|k| step(2.0 - 0.004_975 * k as f32, 1e-5)).skip(100).sum();
    assert_eq!(left, 0.0);
    // Shallower than the skin that lags behind: it returns, and later than in the time of the quickest branch.
    let returns = (1..).find(|_| step(0.01, 1e-3) > 0.0).unwrap();
    assert!((10..20_000).contains(&returns), "{returns} ms");
}

#[test]
fn relaxing_tissue_yields_no_work_at_any_pace() {
    no_path_yields_work(12);
}

#[test]
#[ignore = "nightly"]
fn relaxing_tissue_yields_no_work_on_many_paths() {
    no_path_yields_work(3000);
}
