//! Constant loads while the depth oscillates: exact cycles, noise, nested cycles.

use fingerpad::{Model, Motion, SpinState, State, step};

use crate::row::{DIRECTIONS, LOADS, Noise, Row, apart, full_slip_slide_mm, held, motion};

const DEPTHS_MM: [f64; 3] = [0.5, 1.0, 2.0];

/// Exactly repeated cycles of depth: contacts whose memory after many is not to the bit that after eight.
pub fn cycles(model: &Model<'_>, steps: u32) -> Vec<Row> {
    let (mut differ, mut all) = (0, 0);
    for depth in DEPTHS_MM {
        for amplitude in [0.001, 0.01, 0.1, 0.02 * depth, 0.1 * depth, 0.3 * depth] {
            for (_, along) in DIRECTIONS {
                let full = full_slip_slide_mm(model, depth, along);
                for (_, load) in LOADS {
                    let (mut state, _) = held(model, depth, along, load * full);
                    let cycle = |state: &mut State| {
                        for phase in [-0.5, -1.0, -0.3, 0.0] {
                            step(model, state, motion(depth + phase * amplitude, [0.0; 2]));
                        }
                    };
                    (0..8).for_each(|_| cycle(&mut state));
                    let after_eight = state;
                    // Cycles of one step a phase; a hundredth of them for each of the contacts.
                    (0..steps / 100).for_each(|_| cycle(&mut state));
                    differ += usize::from(state != after_eight);
                    all += 1;
                }
            }
        }
    }
    let (mut state, _) = held(model, 1.0, [1.0, 0.0], 0.4 * full_slip_slide_mm(model, 1.0, [1.0, 0.0]));
    let cycle = |state: &mut State| {
        step(model, state, motion(0.9, [0.0; 2]));
        step(model, state, motion(1.0, [0.0; 2]));
    };
    (0..8).for_each(|_| cycle(&mut state));
    let after_eight = state;
    (0..steps).for_each(|_| cycle(&mut state));
    differ += usize::from(state != after_eight);
    all += 1;
    vec![Row::new(
        format!("{all} loads under repeated cycles of depth: other bits than after 8"),
        f64::from(differ as u32),
        [0.0; 2],
        "loads",
    )]
}

/// Noise on depth and slide of a held load.
pub fn noise(model: &Model<'_>, steps: u32, seed: u64) -> Vec<Row> {
    let mut rows = vec![];
    for (micrometres, depth_noise) in [("1", 0.001), ("10", 0.01)] {
        let (mut against_least, mut against_still) = (0.0f64, 0.0f64);
        for (i, (_, load)) in LOADS.into_iter().enumerate() {
            for (k, (_, along)) in DIRECTIONS.into_iter().enumerate() {
                let full = full_slip_slide_mm(model, 1.0, along);
                let (start, still) = held(model, 1.0, along, load * full);
                let (mut noisy, mut replay) = (start, start);
                let (mut least, mut there) = (1.0f64, [0.0; 2]);
                let mut random = Noise::new(seed + 100 * i as u64 + 10 * k as u64);
                for _ in 0..steps {
                    let depth = 1.0 + depth_noise * random.uniform();
                    let to = [0.001 * random.uniform(), 0.001 * random.uniform()];
                    let by = [to[0] - there[0], to[1] - there[1]];
                    there = to;
                    least = least.min(depth);
                    step(model, &mut noisy, motion(depth, by));
                    step(model, &mut replay, motion(least, by));
                }
                let back = motion(1.0, there.map(|s| -s));
                let found = step(model, &mut noisy, back);
                against_least = against_least.max(apart(&found, &step(model, &mut replay, back)));
                against_still = against_still.max(apart(&found, &still));
            }
        }
        let what = format!("noise of {micrometres} um on depth, 1 um on slide, held load");
        rows.push(Row::new(
            format!("{what}: against the least depth so far"),
            against_least,
            [0.5, 0.1],
            "% of the limit",
        ));
        if depth_noise == 0.001 {
            rows.push(Row::new(format!("{what}: against the noise-free"), against_still, [0.5, 0.2], "% of the limit"));
        }
    }
    rows
}

/// Cycles within cycles in slide, spin and depth: friction where the outer one is met again (wiping out).
pub fn nested(model: &Model<'_>) -> Vec<Row> {
    let ([mut slide, mut across], mut spin, mut depth) = ([0.0f64; 2], 0.0f64, 0.0f64);
    for at in DEPTHS_MM {
        for (name, along) in DIRECTIONS {
            let full = full_slip_slide_mm(model, at, along);
            let go = |state: &mut State, to: f64| {
                let steps = 50;
                let by = along.map(|a| to * full * a / f64::from(steps));
                (0..steps).map(|_| step(model, state, motion(at, by))).last().unwrap_or_default()
            };
            let (mut state, _) = held(model, at, along, 0.6 * full);
            let outer = go(&mut state, -0.5);
            go(&mut state, 0.3);
            let found = apart(&outer, &go(&mut state, -0.3));
            let most = if name == "y" { &mut across } else { &mut slide };
            *most = most.max(found);

            let mut spun = SpinState::default();
            let turn = |state: &mut SpinState, to: f64| {
                let motion = Motion { spin_increment_rad: (to / 50.0) as f32, ..motion(at, [0.0; 2]) };
                (0..50).map(|_| step(model, state, motion)).last().unwrap_or_default()
            };
            step(model, &mut spun, motion(at, along.map(|a| 0.0 * a)));
            turn(&mut spun, 0.4);
            let outer = turn(&mut spun, -0.3);
            turn(&mut spun, 0.2);
            let again = turn(&mut spun, -0.2);
            let moment = f64::from(again.spin_moment_n_mm - outer.spin_moment_n_mm).abs();
            spin = spin.max(100.0 * moment / (f64::from(outer.friction_limit_n) * f64::from(model.data().gyration)));

            let (mut state, _) = held(model, at, along, 0.5 * full);
            let press = |state: &mut State, to: f64| {
                let from = f64::from(state.depth_mm());
                (1..=50)
                    .map(|i| step(model, state, motion(from + (at * to - from) * 0.02 * f64::from(i), [0.0; 2])))
                    .last()
                    .unwrap_or_default()
            };
            press(&mut state, 0.6);
            let outer = press(&mut state, 0.95);
            press(&mut state, 0.75);
            depth = depth.max(apart(&outer, &press(&mut state, 0.95)));
        }
    }
    vec![
        Row::new("nested cycle in slide along x returns to its start", slide, [1e-4, 1.2e-5], "% of the limit"),
        // The press has moved the contact along x a little; its remainder depends on the path along y.
        Row::new(
            "nested cycle in slide along y, across the slide by pressing",
            across,
            [1e-4, 1.2e-5],
            "% of the limit",
        ),
        Row::new("nested cycle in spin returns to its start, moment", spin, [1e-4, 1.2e-5], "% of limit times arm"),
        Row::new("nested cycle in depth returns to its start", depth, [0.1, 0.01], "% of the limit"),
    ]
}
