//! Eight runs at once against one run at a time, written down as plainly as it can be.

use super::*;
use crate::base::{AtDepth, FREEDOMS, Reference};
use crate::chance::Signs;
use crate::laws::{LAWS, find};
use crate::runs::{Labels, RawRow, run_of};

/// One run, row by row and element by element.
fn alone(base: &Base, laws: &[Active], nudge: Nudge, run: &Run, out: &mut Vec<f64>) {
    struct Memory {
        force: [[f64; 2]; ELEMENTS],
        at: AtDepth,
        depth: f64,
    }
    let air = || Memory { force: [[0.0; 2]; ELEMENTS], at: AtDepth::default(), depth: 0.0 };
    let mut memory = air();
    for (i, row) in run.rows.iter().enumerate() {
        let mut change = Change {
            strength: nudge.strength,
            stiffness: nudge.stiffness,
            depth_mm: nudge.depth_mm,
            ..Change::default()
        };
        laws.iter().for_each(|a| a.law.apply(&a.values, row, &mut change));
        let depth = if row.depth_mm > 0.0 { row.depth_mm + change.depth_mm } else { row.depth_mm };
        let [b_n, b_x, b_y] = change.reading_n;
        if depth <= 0.0 {
            memory = air();
            out.extend([b_n, b_x, b_y]);
            continue;
        }
        let strength = change.strength
            * (1.0 + base.turned(depth, row.double_angle, row.along))
            * change.stiffness.powf(base.load_exponent);
        let slide = run.increment(i);
        let steps = ((depth - memory.depth).abs() / 0.08).ceil().clamp(1.0, 12.0);
        let from = memory.depth;
        for k in 1..=steps as usize {
            let d = if k == steps as usize { depth } else { from + (depth - from) * k as f64 / steps };
            let mut at = base.at(d);
            at.strength_n *= strength;
            at.tangential_n_mm *= change.stiffness;
            let mut keep = memory.at.strength_n / at.strength_n;
            if at.tangential_n_mm < memory.at.tangential_n_mm {
                keep *= at.tangential_n_mm / memory.at.tangential_n_mm;
            }
            let per_slip = at.tangential_n_mm / at.strength_n;
            let x = (slide[0] / steps + at.pressed_mm - memory.at.pressed_mm) * per_slip;
            let y = slide[1] / steps * per_slip * at.ratio;
            for (u, [inverse_yield, _]) in memory.force.iter_mut().zip(&base.elements) {
                let [mut ux, mut uy] = [u[0] * keep + x * inverse_yield, u[1] * keep + y * inverse_yield];
                let square = ux * ux + uy * uy;
                if square > 1.0 {
                    // Back to the limit along the slip of an element whose stiffness along y is `ratio` times that along x.
                    let lack = 1.0 - at.ratio;
                    let along_y = square * square + square - 2.0 * lack * uy * uy;
                    ux *= along_y - lack * (square * square - square);
                    uy *= along_y;
                    let length = ux.hypot(uy);
                    (ux, uy) = (ux / length, uy / length);
                }
                *u = [ux, uy];
            }
            (memory.at, memory.depth) = (at, d);
        }
        let mean = |k: usize| memory.force.iter().zip(&base.elements).map(|(u, e)| e[1] * u[k]).sum::<f64>();
        let (mx, my) = (mean(0), mean(1));
        let fx = memory.at.strength_n * (mx - base.odd * depth * (mx.powi(2) - ODD_SHAPE * mx.powi(4)));
        let fy = memory.at.strength_n * my;
        let area = memory.at.area_mm2 / REFERENCE_AREA_MM2;
        let [s, p] = [base.normal_shear, base.normal_per_friction];
        let normal =
            memory.at.normal_n * change.stiffness * (1.0 + s[0] * mx * mx + s[1] * my * my) + p[0] * fx + p[1] * fy
                - change.adhesion_n * area.sqrt();
        let drag = change.drag_n * area;
        out.push(normal + b_n);
        out.push(fx + drag * row.along[0] + change.cross[0] * normal + b_x);
        out.push(fy + drag * row.along[1] + change.cross[1] * normal + b_y);
    }
}

/// Numbers from 0 to 1.
fn draws(seed: u64) -> impl FnMut() -> f64 {
    let mut signs = Signs::new(seed);
    move || (signs.bits() >> 11) as f64 / (1u64 << 53) as f64
}

/// Runs of any length, some of which leave the skin on the way or begin in contact.
fn runs(next: &mut impl FnMut() -> f64, n: usize) -> Vec<Run> {
    let mut one = |i: usize| {
        let rows = 3 + (27.0 * next()) as usize;
        let (mut t_s, mut depth_mm, mut slide_mm) = (0.0, if i % 4 == 0 { 0.5 } else { -0.2 }, [0.0; 2]);
        let raw: Vec<RawRow> = (0..rows)
            .map(|line| {
                t_s += 0.01 + next();
                depth_mm = if next() < 0.06 { -0.1 } else { (depth_mm + 0.8 * (next() - 0.3)).clamp(-0.2, 2.6) };
                slide_mm = [slide_mm[0] + 0.6 * (next() - 0.5), slide_mm[1] + 0.6 * (next() - 0.5)];
                RawRow {
                    line,
                    t_s,
                    depth_mm,
                    slide_mm,
                    force_n: [0.0; 3],
                    contact_time_s: f64::NAN,
                    speed_mm_s: 0.5 + 5.0 * next(),
                    direction_deg: f64::NAN,
                    dwell_s: 3.0 * next(),
                    occlusion_time_s: 60.0 * next(),
                    hydration_au: 80.0 * next(),
                    temperature_c: 25.0 + 10.0 * next(),
                    finger_width_mm: 14.0 + 4.0 * next(),
                }
            })
            .collect();
        run_of(std::path::Path::new("random"), Labels::default(), &raw).unwrap()
    };
    (0..n).map(&mut one).collect()
}

fn reference() -> Reference {
    let file = include_bytes!("../../../../data/models/fingertip.fpm");
    let file = fingerpad::ModelFile::new(file).unwrap();
    Reference::of(file.file().model.data(), true)
}

#[test]
fn eight_runs_at_once_give_what_each_gives_alone() {
    let reference = reference();
    for seed in 1..=24 {
        let mut next = draws(seed);
        let n = 1 + (20.0 * next()) as usize;
        let runs = runs(&mut next, n);
        let mut theta = reference.mean;
        for k in 0..FREEDOMS {
            theta[k] += 0.2 * crate::base::FREEDOM[k].between * (next() - 0.5);
        }
        let base = reference.with(&theta);
        let law = LAWS[seed as usize % LAWS.len()];
        let mut values: Vec<f64> = law.parameters[..law.linear].iter().map(|p| p.typical).collect();
        values.extend(law.shapes[0]);
        let more = Active { law: find("normal_relaxation").unwrap(), values: vec![0.2, 1.0] };
        let laws = [Active { law, values }, more];
        let laws = &laws[..seed as usize % 3];
        let modes: Modes = if seed % 2 == 0 {
            Vec::new()
        } else {
            (0..n).map(|_| [0.2 * (next() - 0.5), 0.2 * (next() - 0.5), 0.1 * (next() - 0.5)]).collect()
        };
        let nudge = Nudge { strength: 1.001, depth_mm: if seed % 3 == 0 { 2e-4 } else { 0.0 }, ..Nudge::default() };
        let found = walk_all(&base, laws, &modes, nudge, &runs);
        let mut expected = Vec::new();
        for (i, run) in runs.iter().enumerate() {
            let u = modes.get(i).copied().unwrap_or_default();
            let own = Nudge {
                stiffness: nudge.stiffness * u[0].exp(),
                strength: nudge.strength * u[1].exp(),
                depth_mm: nudge.depth_mm + u[2],
            };
            alone(&base, laws, own, run, &mut expected);
        }
        assert_eq!(found.len(), expected.len());
        let scale = expected.iter().fold(0.0f64, |a, b| a.max(b.abs()));
        assert!(scale > 0.1, "seed {seed}: nothing happens");
        for (i, (a, b)) in found.iter().zip(&expected).enumerate() {
            assert!((a - b).abs() <= 1e-12 * scale, "seed {seed}, observation {i}: {a} against {b}");
        }
        // Whom a run is walked with does not matter at all.
        let mut first = 0;
        for (i, run) in runs.iter().enumerate() {
            let own = modes.get(i).map_or_else(Modes::new, |u| vec![*u]);
            let single = walk_all(&base, laws, &own, nudge, std::slice::from_ref(run));
            assert_eq!(single, found[first..first + single.len()], "seed {seed}, run {i}");
            first += single.len();
        }
    }
}

#[test]
fn freedoms_that_only_read_leave_the_path_as_it_is() {
    let reference = reference();
    let mut next = draws(99);
    let runs = runs(&mut next, 11);
    let course = Course::of(&runs);
    let plan = Plan::new(&course, &[], &Modes::new(), Nudge::default(), &runs);
    let path = plan.path(&reference.with(&reference.mean));
    for k in 0..FREEDOMS {
        let mut theta = reference.mean;
        theta[k] += 0.01;
        let base = reference.with(&theta);
        let same = plan.readings(&base, &path) == plan.predict(&base);
        assert_eq!(same, !plan.path_depends_on(k), "{}", crate::base::FREEDOM[k].name);
    }
}

#[test]
fn curves() {
    let mut next = draws(5);
    let (mut exp, mut ln, mut root) = (0.0f64, 0.0f64, 0.0f64);
    for _ in 0..100_000 {
        let (x, d) = (60.0 * (next() - 0.5), 1e-3 + 3.0 * next());
        let found = f64x8::splat(x).exp().to_array()[0];
        exp = exp.max((found / x.exp() - 1.0).abs());
        let found = inverse_root(f64x8::splat(x.exp())).to_array()[0];
        root = root.max((found * (0.5 * x).exp() - 1.0).abs());
        let found = f64x8::splat(d).ln().to_array()[0];
        ln = ln.max((found - d.ln()).abs() / d.ln().abs().max(1e-3));
    }
    println!("exp {exp:e}, ln {ln:e}, inverse root {root:e}");
    assert!(exp < 1e-15 && ln < 1e-15 && root < 1e-15, "{exp:e} {ln:e} {root:e}");
}
