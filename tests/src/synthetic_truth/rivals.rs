//! What else could stand in a hidden effect's place: laws of the library, alone or two together, with numbers that move.
//!
//! Main types: [`Rival`], [`Knob`]; main function: [`rivals`].

use super::effects::{Effect, LIBRARY};

/// A number of a rival that a fit moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Knob {
    /// Amplitude of an effect, in typical small ones.
    Amplitude(usize),
    /// A shape number of an effect: its logarithm, or for ratios and angles (rad) itself.
    Shape(usize, usize),
    /// Logarithm of the exponent by which an effect's form is off.
    Form(usize),
}

/// Effects that a fit moves.
#[derive(Clone, Debug)]
pub struct Rival {
    /// The effects.
    pub effects: Vec<Effect>,
    /// What is moved.
    pub knobs: Vec<Knob>,
}

/// Range of the exponents by which the forms of hidden laws are off.
const FORMS: [f64; 2] = [0.85, 1.18];

/// A small amplitude of a law, in its unit.
fn small(name: &str) -> f64 {
    match name {
        "viscous_drag" => 2e-4,
        "adhesion" | "tare_bias" | "depth_zero_offset" | "cross_talk" => 2e-3,
        "speed_log" | "temperature" => 3e-3,
        "subject_size" => 0.05,
        _ => 0.01,
    }
}

/// Number of shape numbers of a law that are times, lengths, speeds or moistures.
fn positive_shapes(name: &str) -> usize {
    match name {
        "hydration_bell" | "contact_ageing" => 2,
        "speed_stribeck" | "normal_relaxation" | "static_peak" | "occlusion_growth" => 1,
        _ => 0,
    }
}

/// Number of shape numbers of a hidden law that are ratios or angles.
fn other_shapes(name: &str) -> usize {
    match name {
        "tare_bias" => 2,
        "cross_talk" | "anisotropy" => 1,
        _ => 0,
    }
}

/// Shapes from which a law starts.
fn shapes(name: &str, truth: &Effect) -> Vec<[f64; 2]> {
    // Laws that fade along the stroke are tried with the truth's own length.
    let slip = match truth.name {
        "static_peak" => truth.shape[0],
        "contact_ageing" => truth.shape[1],
        _ => 0.8,
    };
    match name {
        "hydration_bell" => vec![[35.0, 18.0], [52.0, 15.0], [65.0, 20.0]],
        "speed_stribeck" => vec![[2.0, 0.0], [8.0, 0.0]],
        "normal_relaxation" => vec![[0.5, 0.0], [1.5, 0.0], [5.0, 0.0]],
        "contact_ageing" => vec![[0.3, 0.5], [0.3, 1.2], [0.3, slip]],
        "static_peak" => vec![[0.3, 0.0], [0.6, 0.0], [1.3, 0.0], [slip, 0.0]],
        "occlusion_growth" => vec![[10.0, 0.0], [40.0, 0.0]],
        "anisotropy" => vec![[0.0, 0.0], [45.0, 0.0]],
        _ => vec![[0.0, 0.0]],
    }
}

impl Rival {
    /// No effect at all.
    pub fn nothing() -> Self {
        Self { effects: Vec::new(), knobs: Vec::new() }
    }

    /// Effects with amplitudes and positive shapes free, and their forms if `free_form`.
    fn of(effects: Vec<Effect>, free_form: bool) -> Self {
        let mut knobs: Vec<Knob> = (0..effects.len()).map(Knob::Amplitude).collect();
        for (i, effect) in effects.iter().enumerate() {
            let shapes = positive_shapes(effect.name);
            knobs.extend((0..shapes).map(|k| Knob::Shape(i, k)));
            knobs.extend((free_form && shapes > 0).then_some(Knob::Form(i)));
        }
        Self { effects, knobs }
    }

    /// A hidden law with all of its numbers free, its amplitude first.
    pub fn truth(effect: &Effect) -> Self {
        let mut out = Self::of(vec![effect.clone()], false);
        out.knobs.extend((0..other_shapes(effect.name)).map(|k| Knob::Shape(0, k)));
        out
    }

    /// Both together.
    pub fn and(&self, other: &Self) -> Self {
        let (mut out, first) = (self.clone(), self.effects.len());
        out.effects.extend(other.effects.iter().cloned());
        out.knobs.extend(other.knobs.iter().map(|knob| match *knob {
            Knob::Amplitude(i) => Knob::Amplitude(first + i),
            Knob::Shape(i, k) => Knob::Shape(first + i, k),
            Knob::Form(i) => Knob::Form(first + i),
        }));
        out
    }

    /// The value of the first amplitude, on the scale on which it is moved.
    pub fn amplitude(&self) -> f64 {
        self.effects[0].amplitude / small(self.effects[0].name)
    }

    /// Sets the amplitudes, given in typical small ones.
    pub fn set_amplitudes(&mut self, values: &[f64]) {
        for (effect, value) in self.effects.iter_mut().zip(values) {
            effect.amplitude = value * small(effect.name);
        }
    }

    /// With the knobs moved by these amounts, within what the library's laws can be.
    pub fn moved(&self, by: &[f64]) -> Self {
        let mut out = self.clone();
        for (knob, by) in self.knobs.iter().zip(by) {
            match *knob {
                Knob::Amplitude(i) => out.effects[i].amplitude += by * small(out.effects[i].name),
                Knob::Form(i) => out.effects[i].form = (out.effects[i].form * by.exp()).clamp(FORMS[0], FORMS[1]),
                Knob::Shape(i, k) => {
                    let effect = &mut out.effects[i];
                    let shape = &mut effect.shape[k];
                    match effect.name {
                        "anisotropy" => *shape += by.to_degrees(),
                        "tare_bias" | "cross_talk" => *shape += by,
                        "hydration_bell" => *shape = (*shape * by.exp()).clamp(5.0, 90.0),
                        _ => *shape = (*shape * by.exp()).clamp(0.1, 100.0),
                    }
                }
            }
        }
        out
    }
}

/// Rivals of a hidden effect: each law of the other families with some shapes to start from.
///
/// * `free_form`: the laws' forms may be off as far as those of hidden laws are
pub fn rivals(truth: &Effect, free_form: bool) -> Vec<Rival> {
    let family = |name: &str| LIBRARY.iter().find(|l| l.0 == name).map(|l| l.1);
    let mut out = Vec::new();
    for (name, own) in LIBRARY {
        if Some(own) == family(truth.name) {
            continue;
        }
        let effect = |shape: [f64; 2]| Effect { name, amplitude: small(name), shape, form: truth.form };
        let linear = |shapes: &[[f64; 2]]| Rival::of(shapes.iter().copied().map(effect).collect(), free_form);
        match name {
            "tare_bias" => out.push(linear(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])),
            "cross_talk" => out.push(linear(&[[0.0, 0.0], [1.0, 0.0]])),
            "anisotropy" => out.push(linear(&shapes(name, truth))),
            _ => out.extend(shapes(name, truth).into_iter().map(|s| linear(&[s]))),
        }
    }
    out
}
