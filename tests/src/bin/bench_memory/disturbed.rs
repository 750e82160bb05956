//! Everything changed in every step.

use fingerpad::{Model, Motion, SPRINGS, StateOf, Status, Tuning, step};

use crate::row::{Noise, Row};

/// Strength factor, tuning, depth, slide and spin at random in every step: counts responses that are not finite, beyond
/// the limit or flagged without cause.
pub fn rows(model: &Model<'_>, steps: u32, seed: u64) -> Vec<Row> {
    let bad = broken::<1>(model, steps, seed) + broken::<2>(model, steps, seed + 1);
    vec![Row::new(
        "strength, tuning, depth, slide and spin change in every step: bad responses",
        f64::from(bad),
        [0.0; 2],
        "steps",
    )]
}

fn broken<const P: usize>(plain: &Model<'_>, steps: u32, seed: u64) -> u32 {
    let (mut random, mut state, mut bad) = (Noise::new(seed), StateOf::<SPRINGS, P>::default(), 0);
    for i in 0..steps {
        let mut between = |low: f64, high: f64| low + (high - low) * 0.5 * (random.uniform() + 1.0);
        state.set_strength_factor(between(-2.3, 1.6).exp() as f32);
        let tuning = Tuning {
            size: between(0.5, 2.0) as f32,
            stiffness: between(0.2, 5.0) as f32,
            lambda: between(0.1, 10.0) as f32,
        };
        let Ok(model) = plain.tuned(tuning) else { return steps };
        let deepest = f64::from(model.depth_max_mm());
        let depth = if i % 97 == 0 { between(-0.1, 0.0) } else { between(1e-4, 0.999 * deepest) };
        let motion = Motion {
            depth_mm: depth as f32,
            slide_increment_mm: [between(-1.0, 1.0) as f32, between(-1.0, 1.0) as f32],
            spin_increment_rad: if P == 1 { 0.0 } else { between(-0.2, 0.2) as f32 },
            dt_s: 1e-3,
        };
        let r = step(&model, &mut state, motion);
        let [x, y] = r.friction_n;
        let within = x.hypot(y) <= r.friction_limit_n * (1.0 + 1e-6)
            && r.normal_force_n >= 0.0
            && r.normal_force_n.is_finite()
            && r.spin_moment_n_mm.is_finite()
            && (0.0..=1.0).contains(&r.slip_margin)
            && (0.0..=1.0).contains(&r.stick_ratio);
        bad += u32::from(!within || r.status != Status::OK);
    }
    bad
}
