//! Paths and models for the property tests.
#![allow(dead_code)]

use fingerpad::{Data, Motion, Params, Response, State, step};
use proptest::prelude::*;

/// A path as absolute positions of the plane: depth, slide x, slide y.
#[derive(Clone)]
pub struct Path(pub Vec<[f64; 3]>);

impl core::fmt::Debug for Path {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} positions, first {:?}", self.0.len(), &self.0[..self.0.len().min(4)])
    }
}

impl core::ops::Deref for Path {
    type Target = [[f64; 3]];
    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

/// Corners of a path that starts and ends in the air at the same place, with the length of the steps between them.
pub fn closed_path() -> impl Strategy<Value = Path> {
    let corner = (-0.2f64..2.5, -4.0f64..4.0, -4.0f64..4.0);
    (prop::collection::vec(corner, 2..8), 0.004f64..0.15).prop_map(|(corners, length)| {
        let mut path = Path(vec![[-0.05, 0.0, 0.0]]);
        let mut here = path[0];
        for (d, x, y) in corners {
            walk(&mut path, here, [d, x, y], length);
            here = [d, x, y];
        }
        walk(&mut path, here, [-0.05, 0.0, 0.0], length);
        path
    })
}

/// Appends the straight way from `from` to `to` in steps of about `length`, without `from`.
pub fn walk(path: &mut Path, from: [f64; 3], to: [f64; 3], length: f64) {
    let span = (0..3).map(|i| (to[i] - from[i]).abs()).fold(0.0, f64::max);
    let n = (span / length).ceil().max(1.0) as usize;
    for k in 1..=n {
        let s = k as f64 / n as f64;
        path.0.push(core::array::from_fn(|i| from[i] + s * (to[i] - from[i])));
    }
}

/// A model that prints briefly.
#[derive(Clone)]
pub struct AnyModel(pub Data);

impl core::fmt::Debug for AnyModel {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let row = &self.0.rows[10];
        write!(f, "{:?} {row:?}", self.0.elements)
    }
}

impl core::ops::Deref for AnyModel {
    type Target = Data;
    fn deref(&self) -> &Data {
        &self.0
    }
}

/// Runs a path and calls `each` with the step's displacement and response.
pub fn run(data: &Data, path: &[[f64; 3]], each: impl FnMut([f64; 3], &Response)) -> State {
    run_with(data, 1.0, path, each)
}

/// The same with a strength factor.
pub fn run_with(data: &Data, strength: f32, path: &[[f64; 3]], mut each: impl FnMut([f64; 3], &Response)) -> State {
    let model = data.model().unwrap();
    let mut state = State::default();
    state.set_strength_factor(strength);
    for pair in path.windows(2) {
        let by: [f64; 3] = core::array::from_fn(|i| pair[1][i] - pair[0][i]);
        let motion = Motion {
            depth_mm: pair[1][0] as f32,
            slide_increment_mm: [by[1] as f32, by[2] as f32],
            spin_increment_rad: 0.0,
            dt_s: 1e-3,
        };
        let response = step(&model, &mut state, motion);
        each(by, &response);
    }
    state
}

/// Models of all kinds that pass the check: the example with its freedoms drawn up to the limits, tables wavy over depth.
pub fn any_model() -> impl Strategy<Value = AnyModel> {
    let tables = (0.3f32..1.5, 0.6f32..1.5, -0.04f32..0.04, -0.15f32..0.15, -0.15f32..0.15, -0.1f32..0.1);
    let shape = (0.0f32..=0.5, -1.0f32..1.0, 0.8f32..1.19, 0.0f32..0.3, 0.0f32..6.0);
    let sliders = prop::array::uniform2((0.3f32..1.0, 0.1f32..1.0));
    (tables, shape, sliders).prop_filter_map("passive", |((ratio, strength, press, bx, by, tilt), shape, sliders)| {
        let mut params = Params::example();
        let (wave, phase) = (shape.3, shape.4);
        (params.turn_slip, params.full_slip) = (shape.0, shape.2);
        if let Some(deepest) = params.nodes.last() {
            params.odd_compliance_mm_n2 =
                0.249 * shape.1 / (deepest.tangential_stiffness_n_mm * deepest.friction_limit_n);
        }
        for (i, node) in params.nodes.iter_mut().enumerate() {
            let up = |by: f32| 1.0 + wave * (phase + by + 0.4 * i as f32).sin();
            node.stiffness_ratio = ratio * up(0.0);
            node.strength_ratio = strength * up(1.0);
            node.press_coupling = press;
            node.normal_shear_x_n = bx * node.normal_force_n * up(2.0);
            node.normal_shear_y_n = by * node.normal_force_n * up(3.0);
            node.tilt_x *= tilt / 0.08;
        }
        let total: f32 = sliders.iter().map(|s| s.1).sum();
        let mut position = 0.1;
        for (slider, (gap, share)) in params.sliders.iter_mut().zip(sliders) {
            position += gap;
            slider.yield_position = position;
            slider.strength_share = share / total;
        }
        params.try_build().ok().map(AnyModel)
    })
}
