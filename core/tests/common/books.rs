//! The energy of a contact, in double precision and from the formula alone: what the plane's work is booked against.

use fingerpad::build::{Data, Parabola};
use fingerpad::{SPRINGS, StateOf, Tuning, state_bytes, step};

use super::Disturbed;

/// Energy U = ∫ N0 + kx Φx + ky Φy of a contact (see `DataOf::check`), mJ, from the numbers of a saved state.
pub fn energy<const P: usize>(data: &Data, tuning: &Tuning, state: &StateOf<SPRINGS, P>) -> f64 {
    let mut bytes = [0; state_bytes(SPRINGS, 2)];
    let length = state.write_bytes(0, &mut bytes).unwrap();
    // After the words of version and model.
    let numbers: Vec<f64> =
        bytes[8..length - 4].chunks(4).map(|c| f64::from(f32::from_le_bytes(c.try_into().unwrap()))).collect();
    let (anchors, rest) = numbers.split_at(2 * SPRINGS * P);
    let [x, y, _, _, angle] = rest[..5].try_into().unwrap();
    let [depth, factor] = rest[rest.len() - 2..].try_into().unwrap();
    if depth <= 0.0 {
        return 0.0;
    }
    // Numbers of the state are in the units of the fitted finger, but for the depth.
    let Tuning { size, stiffness: e, lambda } = *tuning;
    let [size, e, lambda] = [size, e, lambda].map(f64::from);
    let cell = f64::from(data.depth_max) / (data.rows.len() - 1) as f64;
    let place = depth / size / cell;
    let index = (place as usize).min(data.rows.len() - 1);
    let t = if index == data.rows.len() - 1 { 0.0 } else { place - index as f64 };
    let row = &data.rows[index];
    let parabola = |p: &Parabola| f64::from(p.value) + t * (f64::from(p.slope) + t * f64::from(p.bend));

    let below: f64 =
        data.rows[..index].iter().map(|r| f64::from(r.normal.value) + 0.5 * f64::from(r.normal.change)).sum();
    let here = t * (f64::from(row.normal.value) + 0.5 * t * f64::from(row.normal.change));
    let pressed = (below + here) * cell;

    let q = f64::from(data.odd) / (lambda * e.powf(f64::from(data.pressure_exponent) - 1.0) * factor);
    let (x, [kx, ky]) = (x + parabola(&row.press_slide), [&row.stiffness_x, &row.stiffness_y].map(parabola));
    let mut sheared = 0.0;
    for (j, spring) in data.springs.iter().enumerate() {
        let share = f64::from(spring.stiffness) / P as f64;
        for k in 0..P {
            let sign = if P == 1 { 0.0 } else { 1.0 - 2.0 * k as f64 };
            let at_x = f64::from(spring.centre_mm) + sign * f64::from(spring.arm_mm[0]);
            let at_y = sign * f64::from(spring.arm_mm[1]);
            let anchor = &anchors[2 * (j * P + k)..];
            let (ux, uy) = (x - at_y * angle - anchor[0], y + at_x * angle - anchor[1]);
            sheared += share * (kx * along(q, ux) + ky * 0.5 * uy * uy);
        }
    }
    e * size * size * size * (pressed + sheared)
}

/// Energy along x over the stiffness, mm²: u²/2 − q u³/3. Beyond |q u| = 0.4, where a fall of strength may leave a spring until
/// the next step returns it to its limit, the force goes on with the slope that it has there.
fn along(q: f64, u: f64) -> f64 {
    let cubic = |u: f64| 0.5 * u * u - q * u * u * u / 3.0;
    if q * u <= 0.4 {
        return cubic(u);
    }
    let end = 0.4 / q;
    let beyond = u - end;
    cubic(end) + (end - q * end * end) * beyond + 0.5 * 0.2 * beyond * beyond
}

/// What a path leaves over.
#[derive(Clone, Copy, Debug, Default)]
pub struct Books {
    /// Energy from nothing, mJ: the sum over all steps in which the contact gained more than the plane's work and that of the
    /// change before the step. What other steps lose does not make up for it.
    pub from_nothing: f64,
    /// What has gone back and forth, mJ.
    pub turnover: f64,
}

/// Follows a disturbed path and books every step: N dd + F · dx + Mz dtheta, each with the force at the step's end, and the
/// energy that a change of strength or tuning adds at rest.
pub fn keep<const P: usize>(data: &Data, path: &[Disturbed]) -> Books {
    let plain = data.model().unwrap();
    let mut state = StateOf::<SPRINGS, P>::default();
    let mut books = Books::default();
    let (mut tuning, mut held) = (Tuning::default(), 0.0);
    for step_of in path {
        let before = held;
        tuning = if state.depth_mm() > 0.0 && step_of.tuning.size != tuning.size {
            // Another size is another finger; in contact only its tissue and its skin change.
            Tuning { size: tuning.size, ..step_of.tuning }
        } else {
            step_of.tuning
        };
        // Friction over stiffness up to twice the fitted finger's.
        let over = tuning.stiffness.powf(data.pressure_exponent - 1.0) * step_of.factor.clamp(0.1, 5.0);
        tuning.lambda = tuning.lambda.min(2.0 / over).max(0.1);
        state.set_strength_factor(step_of.factor.min(2.0 / (over / step_of.factor.clamp(0.1, 5.0) * tuning.lambda)));
        let changed = energy(data, &tuning, &state) - before;
        let (model, motion) = (plain.tuned(tuning).unwrap(), step_of.motion);
        let depth = f64::from(state.depth_mm());
        let r = step(&model, &mut state, motion);
        let [x, y] = motion.slide_increment_mm.map(f64::from);
        let [fx, fy] = r.friction_n.map(f64::from);
        let works = [
            f64::from(r.normal_force_n) * (f64::from(state.depth_mm()) - depth),
            fx * x,
            fy * y,
            if P == 1 { 0.0 } else { f64::from(r.spin_moment_n_mm) * f64::from(motion.spin_increment_rad) },
            changed,
        ];
        held = energy(data, &tuning, &state);
        books.from_nothing += (held - before - works.iter().sum::<f64>()).max(0.0);
        books.turnover += works.iter().map(|w| w.abs()).sum::<f64>();
    }
    books
}
