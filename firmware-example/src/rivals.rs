//! What one would compose instead of the model's step, from the usual crates, for the instruction counts.
//!
//! Inputs of all: depth (mm), slide increment x and y (mm), dt (s). Each gives a normal force, friction x and y and a
//! slip margin; none has flags, bands, a policy for NaN or a strength factor.

use nalgebra::Vector2;

/// Square root as the core takes it: one VSQRT.
fn sqrt(x: f32) -> f32 {
    unsafe extern "C" {
        fn sqrtf(x: f32) -> f32;
    }
    // SAFETY: a number in, a number out; provided by `compiler_builtins`.
    unsafe { sqrtf(x) }
}

const ROWS: usize = 16;
const COLUMNS: usize = 32;

/// Memory of all rivals, and what they answer.
pub struct Rivals {
    table: [f32; ROWS * COLUMNS],
    bristle: [f32; 2],
    sliders: [Vector2<f32>; 8],
    slide: f32,
    weights: [f32; 371],
    pub out: [f32; 4],
}

impl Default for Rivals {
    fn default() -> Self {
        let mut table = [0.0; ROWS * COLUMNS];
        for (i, value) in table.iter_mut().enumerate() {
            let (d, s) = ((i / COLUMNS) as f32 * 0.2, (i % COLUMNS) as f32 * 0.1);
            *value = 0.05 + 0.66 * d * s / (0.5 + s);
        }
        let mut weights = [0.0; 371];
        for (i, w) in weights.iter_mut().enumerate() {
            *w = ((i * 37 % 101) as f32 - 50.0) * 0.01;
        }
        Self { table, bristle: [0.0; 2], sliders: [Vector2::zeros(); 8], slide: 0.0, weights, out: [0.0; 4] }
    }
}

/// Bilinear lookup with indices held inside the table.
fn bilinear(table: &[f32; ROWS * COLUMNS], depth: f32, slide: f32) -> f32 {
    let x = (depth * 5.0).clamp(0.0, (ROWS - 1) as f32 - 0.001);
    let y = (slide * 10.0).clamp(0.0, (COLUMNS - 1) as f32 - 0.001);
    let (i, j) = ((x as usize).min(ROWS - 2), (y as usize).min(COLUMNS - 2));
    let (u, v) = (x - i as f32, y - j as f32);
    let at = i * COLUMNS + j;
    let low = table[at] + v * (table[at + 1] - table[at]);
    let high = table[at + COLUMNS] + v * (table[at + COLUMNS + 1] - table[at + COLUMNS]);
    low + u * (high - low)
}

/// LuGre in two dimensions, limit from a table over depth and slide, normal force from a power of depth.
pub extern "C" fn lugre(r: &mut Rivals, s: &[f32; 4]) {
    let [depth, dx, dy, dt] = *s;
    let normal = 0.52 * libm::powf(depth, 1.9);
    r.slide = (r.slide + dx).clamp(0.0, 3.0);
    let limit = bilinear(&r.table, depth, r.slide);
    let (vx, vy) = (dx / dt, dy / dt);
    let speed = sqrt(vx * vx + vy * vy);
    let ratio = speed / 10.0;
    let stribeck = limit * (1.0 + 0.2 * libm::expf(-ratio * ratio));
    const STIFFNESS: f32 = 0.22;
    const DAMPING: f32 = 0.001;
    let decay = STIFFNESS * speed / stribeck;
    let (zx, zy) = (vx - decay * r.bristle[0], vy - decay * r.bristle[1]);
    r.bristle[0] += zx * dt;
    r.bristle[1] += zy * dt;
    let fx = STIFFNESS * r.bristle[0] + DAMPING * zx;
    let fy = STIFFNESS * r.bristle[1] + DAMPING * zy;
    r.out = [normal, fx, fy, 1.0 - sqrt(fx * fx + fy * fy) / limit];
}

/// Eight elasto-slip elements on nalgebra vectors, limit from interpn's cubic table, normal force from libm's power.
pub extern "C" fn crates(r: &mut Rivals, s: &[f32; 4]) {
    let [depth, dx, dy, _] = *s;
    let normal = 0.52 * libm::powf(depth, 1.9);
    r.slide = (r.slide + dx).clamp(0.0, 3.0);
    let mut limit = [0.0];
    let known = interpn::MulticubicRegular::new([ROWS, COLUMNS], [0.0, 0.0], [0.2, 0.1], &r.table, false)
        .and_then(|t| t.interp(&[&[depth], &[r.slide]], &mut limit));
    if known.is_err() {
        return;
    }
    let mut total = Vector2::zeros();
    let step = Vector2::new(dx, dy);
    for (j, u) in r.sliders.iter_mut().enumerate() {
        *u += step;
        let yields = 0.3 + 0.4 * j as f32;
        let length = u.norm();
        if length > yields {
            *u *= yields / length;
        }
        total += *u * (0.125 * limit[0] / yields);
    }
    r.out = [normal, total.x, total.y, 1.0 - total.norm() / limit[0]];
}

/// A network 3-16-16-3 with rectifiers: no memory of where it has been.
pub extern "C" fn network(r: &mut Rivals, s: &[f32; 4]) {
    let input = [s[0], s[1], s[2]];
    let (w, rest) = r.weights.split_at(48);
    let (b, rest) = rest.split_at(16);
    let mut first = [0.0f32; 16];
    for (i, y) in first.iter_mut().enumerate() {
        let mut sum = b[i];
        for (j, x) in input.iter().enumerate() {
            sum += w[i * 3 + j] * x;
        }
        *y = if sum > 0.0 { sum } else { 0.0 };
    }
    let (w, rest) = rest.split_at(256);
    let (b, rest) = rest.split_at(16);
    let mut second = [0.0f32; 16];
    for (i, y) in second.iter_mut().enumerate() {
        let mut sum = b[i];
        for (j, x) in first.iter().enumerate() {
            sum += w[i * 16 + j] * x;
        }
        *y = if sum > 0.0 { sum } else { 0.0 };
    }
    let mut out = [0.0f32; 4];
    for i in 0..2 {
        let mut sum = 0.0;
        for (j, x) in second.iter().enumerate() {
            sum += rest[i * 16 + j] * x;
        }
        out[i] = sum;
    }
    let mut sum = rest[34];
    for (j, x) in second.iter().enumerate() {
        sum += rest[(2 * 16 + j).min(34)] * x;
    }
    out[2] = sum;
    r.out = out;
}
