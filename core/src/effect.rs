//! Effects beyond the plain model, switched on by the slots of a model file.
//!
//! Main types: [`Effects`] (the slots of a file, checked), [`Surroundings`] (what they depend on), [`Contact`] (state
//! of the contact and of its effects). The plain step is not touched by them. Uses model, blob, math.

use crate::blob::EffectSlot;
use crate::error::Field;
use crate::math::{exp, ln, sqrt};
use crate::tune::Scaling;
use crate::{Error, ModelOf, Motion, Response, StateOf, step};

/// What an effect may depend on and the motion does not tell. `Default` is the reference state.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Surroundings {
    /// Moisture of the skin, corneometer units.
    pub hydration_au: f32,
    /// Temperature of the skin, °C.
    pub temperature_c: f32,
}

impl Default for Surroundings {
    fn default() -> Self {
        Self { hydration_au: 35.0, temperature_c: 32.0 }
    }
}

/// A contact with its effects: the plain state and the clocks that the laws read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact<const M: usize> {
    /// The plain state.
    pub state: StateOf<M>,
    contact_s: f32,
    dwell_s: f32,
    occlusion_s: f32,
    path_mm: f32,
    /// Cosine and sine of twice the direction of the last motion.
    double: [f32; 2],
}

impl<const M: usize> Default for Contact<M> {
    fn default() -> Self {
        Self {
            state: StateOf::default(),
            contact_s: 0.0,
            dwell_s: 0.0,
            occlusion_s: 0.0,
            path_mm: 0.0,
            double: [0.0; 2],
        }
    }
}

/// Laws that a controller can evaluate, by the slots' numbers (docs/fpm-format.md). A drift of a series, a subject's
/// size, a sensor's tare or cross-talk are corrected where they arise.
const RUNS_HERE: [u32; 12] = [1, 2, 3, 5, 6, 7, 8, 9, 10, 11, 16, 17];
/// Contact area at which adhesion is given, mm².
const AREA_MM2: f32 = 63.5;

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
    /// Strength laws multiply the strength factor, stiffness laws the tissue's stiffness, the depth offset is added
    /// where there is contact, adhesion is taken off the normal force. Every factor is held at 0.1 or above. Bad
    /// surroundings (NaN) leave the law out. Speed is the slide over the time step, 0 below 1e-6 mm.
    pub fn step<const M: usize, const N: usize, S: Scaling>(
        &self,
        model: &ModelOf<'_, M, N, S>,
        contact: &mut Contact<M>,
        surroundings: Surroundings,
        motion: Motion,
    ) -> Response {
        let [x, y] = motion.slide_increment_mm;
        let moved = sqrt(x * x + y * y);
        let dt = if motion.dt_s > 0.0 && motion.dt_s < 1e3 { motion.dt_s } else { 0.0 };
        let touches = motion.depth_mm > 0.0;
        let slides = touches && moved > 1e-6;
        if touches {
            contact.contact_s += dt;
            contact.occlusion_s += dt;
            if moved < 1e3 {
                contact.path_mm += moved;
            }
            if contact.path_mm <= 0.0 {
                contact.dwell_s += dt;
            }
        } else {
            (contact.contact_s, contact.dwell_s, contact.path_mm) = (0.0, 0.0, 0.0);
        }
        let speed = if slides && dt > 0.0 { moved / dt } else { 0.0 };
        if slides {
            contact.double = [(x * x - y * y) / (moved * moved), 2.0 * x * y / (moved * moved)];
        }

        let (mut strength, mut stiffness, mut motion, mut adhesion) = (1.0f32, 1.0f32, motion, 0.0f32);
        for slot in self.slots {
            let [a, b, c, ..] = slot.values;
            let factor = match slot.kind {
                1 => {
                    let bell = |h: f32| exp(-0.5 * ((h - b) / c) * ((h - b) / c));
                    1.0 + a * (bell(surroundings.hydration_au) - bell(35.0))
                }
                2 if speed > 0.0 => 1.0 + a * ln(0.5 * speed),
                3 if speed > 0.0 => 1.0 + a * (exp(-speed / b) - exp(-2.0 / b)),
                5 => 1.0 + a * contact.double[0] + b * contact.double[1],
                7 => 1.0 + a * ln(1.0 + contact.dwell_s / b) * exp(-contact.path_mm / c),
                8 => 1.0 + a * exp(-contact.path_mm / b),
                9 => 1.0 + a * (1.0 - exp(-contact.occlusion_s / b)),
                17 => 1.0 + a * (surroundings.temperature_c - 32.0),
                6 => {
                    stiffness *= at_least(1.0 - a * (1.0 - exp(-contact.contact_s / b)));
                    1.0
                }
                16 if touches => {
                    stiffness *= at_least(exp(a * (motion.depth_mm - 0.8)));
                    1.0
                }
                10 => {
                    adhesion += a;
                    1.0
                }
                11 if touches => {
                    motion.depth_mm += a;
                    1.0
                }
                _ => 1.0,
            };
            strength *= at_least(factor);
        }
        contact.state.set_strength_factor(strength);
        let mut response = step(&model.stiffened(stiffness), &mut contact.state, motion);
        if adhesion != 0.0 && touches {
            response.normal_force_n -= adhesion * sqrt(response.contact_area_mm2.abs() * (1.0 / AREA_MM2));
        }
        response
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
    fn laws_without_a_place_here_and_bad_scales_are_refused() {
        for (kind, b) in [(12, 1.0), (99, 1.0), (6, 0.0), (3, -1.0), (3, f32::NAN)] {
            let slot = EffectSlot { kind, reserved: 0, values: [0.1, b, 1.0, 0.0, 0.0, 0.0] };
            assert!(Effects::new(&[slot]).is_err(), "{kind} {b}");
        }
    }
}
