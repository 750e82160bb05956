//! Effects beyond the plain model, switched on by the slots of a model file.
//!
//! Main types: [`Effects`] (the slots of a file, checked), [`Surroundings`] (what they depend on), [`Contact`] (state
//! of the contact and of its effects). The plain step is not touched by them. Uses model, model_file, math.

use crate::error::Field;
use crate::math::{exp, ln, pow, sqrt};
use crate::model_file::EffectSlot;
use crate::rescaling::Scaling;
use crate::{Error, ModelOf, Motion, Response, StateOf, step};

/// What an effect may depend on and the motion does not tell. `Default` is the reference state.
///
/// Where a time or a speed is `None` it is counted from the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Surroundings {
    /// Moisture of the skin, corneometer units.
    pub hydration_au: f32,
    /// Temperature of the skin, °C.
    pub temperature_c: f32,
    /// Width of the finger, mm.
    pub finger_width_mm: f32,
    /// Clock of the series in which the tissue drifts, s.
    pub series_s: f32,
    /// Hold before sliding, s.
    pub dwell_s: Option<f32>,
    /// Contact time since the last rest, s.
    pub occlusion_s: Option<f32>,
    /// Nominal speed of the plane where it moves, mm/s.
    pub speed_mm_s: Option<f32>,
}

impl Default for Surroundings {
    fn default() -> Self {
        Self {
            hydration_au: 35.0,
            temperature_c: 32.0,
            finger_width_mm: 16.0,
            series_s: 0.0,
            dwell_s: None,
            occlusion_s: None,
            speed_mm_s: None,
        }
    }
}

/// A contact with its effects: the plain state and the clocks that the laws read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact<const M: usize> {
    /// The plain state. Its strength factor is the caller's; the laws' comes on top of it.
    pub state: StateOf<M>,
    contact_s: f32,
    dwell_s: f32,
    occlusion_s: f32,
    path_mm: f32,
    turn_mm: f32,
    /// Direction of the last motion.
    along: [f32; 2],
}

impl<const M: usize> Default for Contact<M> {
    fn default() -> Self {
        Self {
            state: StateOf::default(),
            contact_s: 0.0,
            dwell_s: 0.0,
            occlusion_s: 0.0,
            path_mm: 0.0,
            turn_mm: 0.0,
            along: [0.0; 2],
        }
    }
}

impl<const M: usize> Contact<M> {
    /// Counts times and path up to the end of a motion; returns whether the plane slides, and how fast, mm/s.
    fn advance(&mut self, surroundings: &Surroundings, motion: &Motion) -> (bool, f32) {
        let [x, y] = motion.slide_increment_mm;
        let moved = sqrt(x * x + y * y);
        let dt = if motion.dt_s > 0.0 && motion.dt_s < 1e3 { motion.dt_s } else { 0.0 };
        if !(motion.depth_mm > 0.0) {
            (self.contact_s, self.dwell_s, self.path_mm, self.turn_mm) = (0.0, 0.0, 0.0, 0.0);
            self.along = [0.0; 2];
            return (false, 0.0);
        }
        self.contact_s += dt;
        self.occlusion_s += dt;
        let slides = moved > LEAST_MM && moved < 1e3;
        if slides {
            let along = [x / moved, y / moved];
            if along[0] * self.along[0] + along[1] * self.along[1] < 0.0 {
                self.turn_mm = 0.0;
            }
            self.along = along;
            self.path_mm += moved;
            self.turn_mm += moved;
        } else if self.path_mm <= 0.0 && motion.depth_mm <= self.state.depth_mm() {
            self.dwell_s += dt;
        }
        let counted = if dt > 0.0 { moved / dt } else { 0.0 };
        (slides, if slides { surroundings.speed_mm_s.unwrap_or(counted) } else { 0.0 })
    }
}

/// Laws that are evaluated here, by the slots' numbers (docs/fpm-format.md).
const RUNS_HERE: [u32; 19] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, DIRECTION, SHEAR];
/// Not a law but a freedom of a refitted baseline: strength over direction.
const DIRECTION: u32 = 32;
/// The same: normal force that comes with friction.
const SHEAR: u32 = 33;
/// Contact area at which adhesion and drag are given, mm².
const AREA_MM2: f32 = 63.5;
/// One over the path over which drag builds up, 1/mm.
const PER_DRAG_MM: f32 = 5.0;
/// Shorter motions are none, mm.
const LEAST_MM: f32 = 1e-6;

/// The effects of a model file.
#[derive(Clone, Copy, Debug)]
pub struct Effects<'a> {
    slots: &'a [EffectSlot],
}

impl<'a> Effects<'a> {
    /// Checks the slots: known laws, finite parameters.
    ///
    /// Errors: [`Error::Section`] for a law that the core does not evaluate, [`Error::Range`] for a scale that is not
    /// positive.
    pub fn new(slots: &'a [EffectSlot]) -> Result<Self, Error> {
        for slot in slots {
            if !RUNS_HERE.contains(&slot.kind) {
                return Err(Error::Section { id: *b"EFFX" });
            }
            let scales: &[usize] = match slot.kind {
                1 => &[2],
                3 | 6 | 8 | 9 => &[1],
                7 => &[1, 2],
                _ => &[],
            };
            for &k in scales {
                let value = slot.values.get(k).copied().unwrap_or(0.0);
                if !(value > 1e-6) {
                    return Err(Error::Range { what: Field::StrengthFactor, index: k as u16, value });
                }
            }
        }
        Ok(Self { slots })
    }

    /// Advances a contact by one step with the effects. Cannot fail, panic or allocate, whatever the input.
    ///
    /// Strength laws multiply the strength factor of `contact.state`, stiffness laws the stiffness of the model as it is
    /// tuned, the depth offset is added where there is contact, adhesion is taken off the normal force, drag added along
    /// the motion. Every factor is held at 0.1 or above. Bad surroundings (NaN) leave the law out. The laws of the
    /// sensor are not in the response, which is the force on the finger; see [`Effects::reading`].
    pub fn step<const M: usize, const N: usize, S: Scaling>(
        &self,
        model: &ModelOf<'_, M, N, S>,
        contact: &mut Contact<M>,
        surroundings: Surroundings,
        motion: Motion,
    ) -> Response {
        let touches = motion.depth_mm > 0.0;
        let (slides, speed) = contact.advance(&surroundings, &motion);
        let [cos, sin] = contact.along;
        let double = [cos * cos - sin * sin, 2.0 * cos * sin];
        let dwell_s = surroundings.dwell_s.unwrap_or(contact.dwell_s);
        let occlusion_s = surroundings.occlusion_s.unwrap_or(contact.occlusion_s);

        let (mut strength, mut stiffness, mut motion) = (1.0f32, 1.0f32, motion);
        let (mut adhesion, mut drag, mut shear) = (0.0f32, 0.0f32, [0.0f32; 5]);
        for slot in self.slots {
            let [a, b, c, d, e, _] = slot.values;
            let mut factor = 1.0;
            match slot.kind {
                1 => {
                    let bell = |h: f32| exp(-0.5 * ((h - b) / c) * ((h - b) / c));
                    factor += a * (bell(surroundings.hydration_au) - bell(35.0));
                }
                2 if speed > 0.0 => factor += a * ln(0.5 * speed),
                3 if speed > 0.0 => factor += a * (exp(-speed / b) - exp(-2.0 / b)),
                4 if slides => drag += a * speed * (1.0 - exp(-contact.turn_mm * PER_DRAG_MM)),
                5 => factor += a * double[0] + b * double[1],
                6 => stiffness *= at_least(1.0 - a * (1.0 - exp(-contact.contact_s / b))),
                7 => factor += a * ln(1.0 + dwell_s / b) * exp(-contact.path_mm / c),
                8 => factor += a * exp(-contact.path_mm / b),
                9 => factor += a * (1.0 - exp(-occlusion_s / b)),
                10 => adhesion += a,
                11 if touches => motion.depth_mm += a,
                14 => stiffness *= at_least(1.0 + a * (surroundings.series_s * (1.0 / 3600.0))),
                15 => stiffness *= at_least(pow(surroundings.finger_width_mm * (1.0 / 16.0), a)),
                16 if touches => stiffness *= at_least(exp(a * (motion.depth_mm - 0.8))),
                17 => factor += a * (surroundings.temperature_c - 32.0),
                DIRECTION => {
                    factor += a * double[0] + b * double[1] + c * cos + d * sin;
                    if e != 0.0 && touches {
                        factor += e * ln(motion.depth_mm * (1.0 / 0.9)).clamp(-1.6, 1.1) * double[0];
                    }
                }
                SHEAR => shear = [a, b, c, d, e],
                _ => {}
            }
            strength *= at_least(factor);
        }
        let own = contact.state.strength_factor();
        contact.state.set_strength_factor(own * strength);
        let mut response = step(&model.stiffened(stiffness), &mut contact.state, motion);
        contact.state.set_strength_factor(own);
        if touches && !self.slots.is_empty() {
            let [fx, fy] = response.friction_n;
            let limit = contact.state.limit;
            if limit > 0.0 {
                let [px, px_per_mm, py, sx, sy] = shear;
                let (mx, my) = (fx / limit, fy / limit);
                response.normal_force_n *= 1.0 + sx * mx * mx + sy * my * my;
                response.normal_force_n += (px + px_per_mm * contact.state.depth_mm()) * fx + py * fy;
            }
            let area = response.contact_area_mm2.abs() * (1.0 / AREA_MM2);
            response.normal_force_n -= adhesion * sqrt(area);
            response.friction_n = [fx + drag * area * cos, fy + drag * area * sin];
        }
        response
    }

    /// What a sensor with the file's tare and cross-talk reads of a response: normal, x, y, N; in the air too.
    pub fn reading(&self, response: &Response) -> [f32; 3] {
        let [x, y] = response.friction_n;
        let mut out = [response.normal_force_n, x, y];
        for slot in self.slots {
            let [a, b, c, ..] = slot.values;
            let add = match slot.kind {
                12 => [a, b, c],
                13 => [0.0, a * response.normal_force_n, b * response.normal_force_n],
                _ => [0.0; 3],
            };
            for (out, add) in out.iter_mut().zip(add) {
                *out += add;
            }
        }
        out
    }

    /// The finger has rested in the air: what builds up under occlusion starts anew.
    pub fn rested<const M: usize>(contact: &mut Contact<M>) {
        contact.occlusion_s = 0.0;
    }
}

/// A factor held at 0.1 or above; NaN counts as 1.
fn at_least(factor: f32) -> f32 {
    if factor.is_nan() { 1.0 } else { factor.max(0.1) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Params, State};

    fn run(slots: &[EffectSlot], surroundings: Surroundings) -> [Response; 2] {
        let data = Params::example().try_build().unwrap();
        let model = data.model().unwrap();
        let effects = Effects::new(slots).unwrap();
        let mut contact = Contact::default();
        let mut go = |depth_mm, x| {
            let motion = Motion { depth_mm, slide_increment_mm: [x, 0.0], dt_s: 0.01 };
            effects.step(&model, &mut contact, surroundings, motion)
        };
        for i in 1..=50 {
            go(0.02 * i as f32, 0.0);
        }
        let held = go(1.0, 0.0);
        let mut last = held;
        for _ in 0..1000 {
            last = go(1.0, 0.02);
        }
        [held, last]
    }

    #[test]
    fn without_slots_it_is_the_plain_step() {
        let data = Params::example().try_build().unwrap();
        let model = data.model().unwrap();
        let (mut contact, mut state) = (Contact::default(), State::default());
        for i in 0..500 {
            let motion = Motion { depth_mm: 0.003 * i as f32, slide_increment_mm: [0.01, -0.004], dt_s: 0.01 };
            let effects = Effects::new(&[]).unwrap();
            let a = effects.step(&model, &mut contact, Surroundings::default(), motion);
            assert_eq!(a, step(&model, &mut state, motion));
        }
    }

    #[test]
    fn strength_laws_scale_the_friction_of_full_slip() {
        let plain = run(&[], Surroundings::default())[1].friction_n[0];
        let slot = |kind, a, b, c| EffectSlot { kind, reserved: 0, values: [a, b, c, 0.0, 0.0, 0.0] };
        // Numbers of data/law-vectors.csv.
        let moist = Surroundings { hydration_au: 60.0, ..Surroundings::default() };
        let cold = Surroundings { temperature_c: 29.0, ..Surroundings::default() };
        for (slot, surroundings, factor) in [
            (slot(1, 0.3, 55.0, 15.0), moist, 1.160_454_2),
            (slot(2, 0.05, 0.0, 0.0), Surroundings::default(), 1.0),
            (slot(17, 0.03, 0.0, 0.0), cold, 0.91),
            (slot(5, 0.075, 0.129_903_81, 0.0), Surroundings::default(), 1.075),
        ] {
            let found = run(&[slot], surroundings)[1].friction_n[0] / plain;
            assert!((found - factor).abs() < 2e-3 * factor, "{} {found} {factor}", slot.kind);
        }
    }

    #[test]
    fn relaxation_softens_and_adhesion_pulls() {
        let slot = |kind, a, b| EffectSlot { kind, reserved: 0, values: [a, b, 0.0, 0.0, 0.0, 0.0] };
        let [plain, _] = run(&[], Surroundings::default());
        let [held, late] = run(&[slot(6, 0.2, 1.4)], Surroundings::default());
        assert!(held.normal_force_n < plain.normal_force_n && late.normal_force_n < 0.85 * plain.normal_force_n);
        let [sticky, _] = run(&[slot(10, 0.015, 0.0)], Surroundings::default());
        let pull = plain.normal_force_n - sticky.normal_force_n;
        assert!((pull - 0.015 * (plain.contact_area_mm2 / 63.5).sqrt()).abs() < 1e-5, "{pull}");
    }

    #[test]
    fn laws_of_finger_series_and_motion() {
        let slot = |kind, a, b| EffectSlot { kind, reserved: 0, values: [a, b, 0.0, 0.0, 0.0, 0.0] };
        let [plain, slid] = run(&[], Surroundings::default());
        // Numbers of data/law-vectors.csv.
        let wide = Surroundings { finger_width_mm: 18.0, ..Surroundings::default() };
        let late = Surroundings { series_s: 1800.0, ..Surroundings::default() };
        for (slot, surroundings, factor) in [(slot(15, -1.5, 0.0), wide, 0.838_052_5), (slot(14, -0.2, 0.0), late, 0.9)]
        {
            let found = run(&[slot], surroundings)[0].normal_force_n / plain.normal_force_n;
            assert!((found - factor).abs() < 2e-3 * factor, "{} {found} {factor}", slot.kind);
        }
        // 0.02 mm in 0.01 s, far beyond the 0.2 mm over which drag builds up.
        let found = run(&[slot(4, 0.01, 0.0)], Surroundings::default())[1].friction_n[0] - slid.friction_n[0];
        let wanted = 0.01 * 2.0 * slid.contact_area_mm2 / 63.5;
        assert!((found - wanted).abs() < 1e-4 * wanted, "{found} {wanted}");
    }

    #[test]
    fn the_sensors_laws_are_in_its_readings_alone() {
        let tare = EffectSlot { kind: 12, reserved: 0, values: [0.01, -0.02, 0.03, 0.0, 0.0, 0.0] };
        let cross = EffectSlot { kind: 13, reserved: 0, values: [0.02, -0.01, 0.0, 0.0, 0.0, 0.0] };
        let [_, plain] = run(&[], Surroundings::default());
        let [_, found] = run(&[tare, cross], Surroundings::default());
        assert_eq!(found, plain);
        let slots = [tare, cross];
        let [n, x, y] = Effects::new(&slots).unwrap().reading(&found);
        let normal = plain.normal_force_n;
        assert!((n - normal - 0.01).abs() < 1e-6);
        assert!((x - plain.friction_n[0] - 0.02 * normal + 0.02).abs() < 1e-6);
        assert!((y - plain.friction_n[1] + 0.01 * normal - 0.03).abs() < 1e-6);
        assert_eq!(Effects::new(&slots).unwrap().reading(&Response::default()), [0.01, -0.02, 0.03]);
    }

    #[test]
    fn the_callers_strength_and_tuning_stay() {
        let data = Params::example().try_build().unwrap();
        let model = data.model().unwrap();
        let tuning = crate::Tuning { size: 1.1, stiffness: 1.5, lambda: 1.2, tau0_mpa: 0.0 };
        let tuned = model.tuned(tuning).unwrap();
        let softened = model.tuned(crate::Tuning { stiffness: 1.5 * 0.8, ..tuning }).unwrap();
        let slot = |kind, a, b| EffectSlot { kind, reserved: 0, values: [a, b, 0.0, 0.0, 0.0, 0.0] };
        // Relaxed to 0.8 within a millisecond, and 0.91 of the strength for the cold.
        let slots = [slot(6, 0.2, 1e-5), slot(17, 0.03, 0.0)];
        let effects = Effects::new(&slots).unwrap();
        let cold = Surroundings { temperature_c: 29.0, ..Surroundings::default() };
        let (mut contact, mut state) = (Contact::default(), State::default());
        contact.state.set_strength_factor(1.3);
        state.set_strength_factor(1.3 * 0.91);
        for i in 0..800 {
            let depth_mm = (0.01 * i as f32).min(1.0);
            let slide = if i < 200 { 0.0 } else { 0.02 };
            let motion = Motion { depth_mm, slide_increment_mm: [slide, 0.0], dt_s: 0.01 };
            let a = effects.step(&tuned, &mut contact, cold, motion);
            let b = step(&softened, &mut state, motion);
            assert_eq!(contact.state.strength_factor(), 1.3);
            for (a, b) in [(a.normal_force_n, b.normal_force_n), (a.friction_n[0], b.friction_n[0])] {
                assert!((a - b).abs() <= 1e-5 * b.abs() + 1e-7, "step {i}: {a} {b}");
            }
        }
    }

    #[test]
    fn laws_without_a_place_here_and_bad_scales_are_refused() {
        for (kind, b) in [(18, 1.0), (99, 1.0), (6, 0.0), (3, -1.0), (3, f32::NAN)] {
            let slot = EffectSlot { kind, reserved: 0, values: [0.1, b, 1.0, 0.0, 0.0, 0.0] };
            assert!(Effects::new(&[slot]).is_err(), "{kind} {b}");
        }
    }
}
