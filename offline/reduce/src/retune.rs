//! The model file of another finger: size, stiffness and friction changed by a change of units.
//!
//! Main functions: [`retuned_bed`], [`retuned_pad`]. The core converts the same units at run time ([`fingerpad::ModelOf::tuned`],
//! [`fingerpad::pad::Pad::tuned`]). A retuned file is for programs that only read a model file.

use fingerpad::Tuning;
use fingerpad::build::Data;
use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad::pad::{Law, Patch};
use serde_json::{Map, Value, json};

use crate::ReduceError;
use crate::pad::PadModel;

/// Key of the provenance for the factors relative to the fitted finger.
const KEY: &str = "retuned";
const FACTORS: [&str; 3] = ["size", "stiffness", "lambda"];

/// Factors of the quantities of a model file.
struct Units {
    length: f64,
    pressure: f64,
    /// Factor of the strength at a corresponding point, where the pressure is `pressure` times that of the fitted finger, over `pressure`.
    friction: f64,
}

impl Units {
    fn new([size, stiffness, lambda]: [f32; 3], beta: f64) -> Self {
        let pressure = f64::from(stiffness);
        Self { length: size.into(), pressure, friction: f64::from(lambda) * pressure.powf(beta - 1.0) }
    }
    fn area(&self) -> f64 {
        self.length.powi(2)
    }
    fn force(&self) -> f64 {
        self.pressure * self.area()
    }
    fn energy(&self) -> f64 {
        self.force() * self.length
    }
}

/// The model file of a bed of springs for another finger.
///
/// # Errors
/// [`ReduceError::Model`] for a factor outside its range, [`ReduceError::Retune`] for a file with effects.
pub fn retuned_bed(file: &ModelFile, tuning: &Tuning) -> Result<Vec<u8>, ReduceError> {
    let file = file.file();
    // The core checks the ranges of the factors.
    file.model.tuned(*tuning)?;
    if !file.effects.is_empty() {
        return Err(ReduceError::Retune(format!(
            "the model has {} effects, which were fitted to one finger: retune the model without them",
            file.effects.len()
        )));
    }
    let factors = [tuning.size, tuning.stiffness, tuning.lambda];
    let data = bed_in(*file.model.data(), &Units::new(factors, file.model.data().pressure_exponent.into()));
    data.check()?;
    let meta = with_factors(file.meta, factors);
    let mut bytes = vec![0; Data::file_length(&[], &meta)];
    data.write_file(&[], &meta, &mut bytes)?;
    Ok(bytes)
}

fn bed_in(mut data: Data, units: &Units) -> Data {
    let grow = |x: &mut f32, factor: f64| *x = (f64::from(*x) * factor) as f32;
    let [length, area, force] = [units.length, units.area(), units.force()];
    let stiffness = force / length;
    let strength = units.friction * force;
    // Slides at which springs slip.
    let slide = strength / stiffness;
    grow(&mut data.depth_max, length);
    grow(&mut data.cells_per_mm, 1.0 / length);
    grow(&mut data.odd, 1.0 / slide);
    data.pressure_centre_per_n.iter_mut().for_each(|x| grow(x, length / force));
    grow(&mut data.gyration, length);
    for spring in &mut data.springs {
        [&mut spring.centre_mm].into_iter().chain(&mut spring.arm_mm).for_each(|x| grow(x, length));
    }
    for row in &mut data.rows {
        let lines = [
            (&mut row.normal, force),
            (&mut row.area, area),
            (&mut row.limit, strength),
            (&mut row.spin_limit, strength * length),
            (&mut row.friction_centre, length),
            (&mut row.pressure_centre, length),
            (&mut row.band_normal, force),
        ];
        for (line, factor) in lines.into_iter().chain(row.radius.iter_mut().map(|radius| (radius, slide))) {
            [&mut line.value, &mut line.change].into_iter().for_each(|x| grow(x, factor));
        }
        let curves =
            [(&mut row.stiffness_x, stiffness), (&mut row.stiffness_y, stiffness), (&mut row.press_slide, length)];
        for (curve, factor) in curves {
            [&mut curve.value, &mut curve.slope, &mut curve.bend].into_iter().for_each(|x| grow(x, factor));
        }
    }
    data
}

/// The model file of a pad for another finger. Forces, moments, areas and the states of all patches agree with
/// [`fingerpad::pad::Pad::tuned`]. Bands differ a little, because they grow above the same depth in mm in every model.
///
/// # Errors
/// [`ReduceError::Model`] for a factor outside its range; [`ReduceError::Retune`] for orthotropic friction.
pub fn retuned_pad(file: &PadModelFile, tuning: &Tuning) -> Result<Vec<u8>, ReduceError> {
    let file = file.file();
    if file.pad.orthotropy().is_some() {
        return Err(ReduceError::Retune("a pad with orthotropic friction (section ORTH) cannot be retuned".into()));
    }
    file.pad.tuned(*tuning)?;
    let factors = [tuning.size, tuning.stiffness, tuning.lambda];
    let [_, beta] = file.pad.numbers.law.friction;
    let model = pad_in(PadModel::of(&file.pad), &Units::new(factors, beta.into()));
    model.file(file.pad.relaxation(), &with_factors(file.meta, factors))
}

/// Whether each of the three coordinates whose products `Law::lift` multiplies is a length.
const LIFTED: [[bool; 3]; 2] = [[true, true, false], [true, false, false]];
/// The products of three coordinates in the order of `Law::lift`.
const PRODUCTS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [0, 2], [1, 2]];

fn pad_in(mut model: PadModel, units: &Units) -> PadModel {
    let [length, area, force] = [units.length, units.area(), units.force()];
    // Coordinates of the bulk are square roots of an energy.
    let turn = 1.0 / units.energy().sqrt();
    let mode = length * turn;
    let grow = |x: &mut f64, factor: f64| *x *= factor;
    for Patch { middle_mm, area_mm2, spread_mm, modes, compliance_mm_per_n } in &mut model.patches {
        middle_mm.iter_mut().chain(spread_mm).for_each(|x| grow(x, length));
        grow(area_mm2, area);
        modes.iter_mut().flatten().for_each(|x| grow(x, mode));
        compliance_mm_per_n.iter_mut().for_each(|x| grow(x, length / force));
    }
    let n = &mut model.numbers;
    for (k, row) in n.rigid.iter_mut().enumerate() {
        row.iter_mut().for_each(|x| grow(x, if k < 3 { mode } else { turn }));
    }
    n.squash.iter_mut().for_each(|x| grow(x, mode * mode));
    grow(&mut n.reach, mode);
    n.middle_mm.iter_mut().chain(&mut n.first_touch_mm).for_each(|x| grow(x, length));
    grow(&mut n.depth_max_mm, length);
    // The slope of a body is always taken 2 mm from its apex, so that a body that is scaled down with the finger has a larger slope.
    n.band_body.iter_mut().for_each(|x| grow(x, length));
    n.band_deep.iter_mut().for_each(|x| grow(x, 1.0 / length));
    n.band_light_n.iter_mut().flatten().for_each(|x| grow(x, force));
    scale_law(&mut n.law, length, units.pressure);
    // lambda sigma^beta at sigma in the new unit of pressure.
    let beta = n.law.friction[1];
    grow(&mut n.law.friction[0], units.friction * units.pressure.powf(1.0 - beta));
    model
}

/// Changes the units of length and pressure of the numbers of a law but friction.
pub(crate) fn scale_law(law: &mut Law<f64>, length: f64, pressure: f64) {
    // rate q³ exp(growth q²) is an energy, and q a length.
    law.stiffening[0] *= pressure;
    law.stiffening[1] /= length.powi(2);
    law.flattening_mpa.iter_mut().for_each(|x| *x *= pressure);
    law.lift.iter_mut().for_each(|axis| axis.iter_mut().zip(lift_units(length)).for_each(|(x, unit)| *x *= unit));
}

/// The units of the numbers of a lift for this unit of length.
pub(crate) fn lift_units(length: f64) -> impl Iterator<Item = f64> {
    let places = LIFTED.into_iter().flat_map(|is_length| PRODUCTS.map(|pair| pair.map(|k| is_length[k])));
    // The result is a length.
    places.map(move |[first, second]| length.powi(1 - i32::from(first) - i32::from(second)))
}

/// A file's provenance with the factors relative to the fitted finger: the given ones times those of the file.
fn with_factors(meta: &str, factors: [f32; 3]) -> String {
    let mut meta: Map<String, Value> = serde_json::from_str(meta).unwrap_or_default();
    let before = |name: &str| meta.get(KEY).and_then(|all| all.get(name)).and_then(Value::as_f64).unwrap_or(1.0);
    let all: Map<String, Value> =
        FACTORS.iter().zip(factors).map(|(name, x)| ((*name).to_owned(), json!(before(name) * f64::from(x)))).collect();
    meta.insert(KEY.to_owned(), Value::Object(all));
    Value::Object(meta).to_string()
}

/// Whether a model file was retuned, according to its provenance.
pub fn is_retuned(meta: &str) -> bool {
    serde_json::from_str::<Map<String, Value>>(meta).is_ok_and(|meta| meta.contains_key(KEY))
}

#[cfg(test)]
mod tests {
    use fingerpad::pad::{PadState, Plane, Sphere, Surface};
    use fingerpad::{Error, Motion, Response, SpinState};

    use super::*;

    const BED: &[u8] = include_bytes!("../data/models/fingertip.fpm");
    const PAD: &[u8] = include_bytes!("../data/models/fingertip-pad.fpm");
    const FINGERS: [[f32; 3]; 3] = [[1.3, 1.0, 1.0], [0.7, 2.5, 0.4], [1.0, 0.8, 0.8]];

    /// A press, a slide with a turn, a reversal with a change of depth, of a finger of a size; and a spin.
    fn motions(size: f32) -> impl Iterator<Item = Motion> {
        (0..300).map(move |k| {
            let t = k as f32 / 100.0;
            let back = if k < 200 { 1.0 } else { -1.0 };
            Motion {
                depth_mm: size * (1.2 * t).min(1.1 + 0.3 * (3.0 * t).sin()),
                slide_increment_mm: [
                    if k < 80 { 0.0 } else { 0.02 * back * size },
                    0.01 * back * size * (2.0 * t).cos(),
                ],
                spin_increment_rad: 0.003 * (5.0 * t).sin(),
                dt_s: 1e-3,
            }
        })
    }

    fn values(r: &Response) -> [f32; 8] {
        let ([fx, fy], [cx, cy]) = (r.friction_n, r.pressure_centre_mm);
        [r.normal_force_n, fx, fy, r.friction_limit_n, r.spin_moment_n_mm, cx, cy, r.contact_area_mm2]
    }

    /// Largest difference of each value over its largest.
    fn compare(found: &[Response], wanted: &[Response], most: f32) {
        for k in 0..8 {
            let largest = wanted.iter().map(|r| values(r)[k].abs()).fold(0.0, f32::max);
            assert!(largest > 0.0);
            for (step, (found, wanted)) in found.iter().zip(wanted).enumerate() {
                let [found, wanted] = [found, wanted].map(|r| values(r)[k]);
                assert!((found - wanted).abs() < most * largest, "value {k}, step {step}: {found} {wanted}");
            }
        }
    }

    #[test]
    fn a_bed_s_file_steps_as_the_core_retunes() {
        for [size, stiffness, lambda] in FINGERS {
            let tuning = Tuning { size, stiffness, lambda };
            let fitted = ModelFile::new(BED).unwrap();
            let other = ModelFile::new(&retuned_bed(&fitted, &tuning).unwrap()).unwrap();
            let tuned = fitted.file().model.tuned(tuning).unwrap();
            let (mut a, mut b) = (SpinState::default(), SpinState::default());
            let found: Vec<Response> = motions(size).map(|m| other.file().model.step(&mut a, m)).collect();
            let wanted: Vec<Response> = motions(size).map(|m| tuned.step(&mut b, m)).collect();
            compare(&found, &wanted, 2e-5);
            let depths = [other.file().model.depth_max_mm(), tuned.depth_max_mm()];
            assert!((depths[0] / depths[1] - 1.0).abs() < 1e-6);
        }
    }

    fn on_body(size: f32, stiffness: f32, lambda: f32, body: &impl Surface<f32>) {
        let tuning = Tuning { size, stiffness, lambda };
        let fitted = PadModelFile::new(PAD).unwrap();
        let other = PadModelFile::new(&retuned_pad(&fitted, &tuning).unwrap()).unwrap();
        let tuned = fitted.file().pad.tuned(tuning).unwrap();
        let pose = |k: usize| [40.0 + 0.05 * k as f32, 0.03 * k as f32];
        let mut a: PadState<64> = PadState::over(&other.file().pad, pose(0)).unwrap();
        let mut b = PadState::<64>::over(&tuned, pose(0)).unwrap();
        let (mut found, mut wanted) = (Vec::new(), Vec::new());
        for (k, motion) in motions(size).enumerate() {
            found.push(other.file().pad.step(&mut a, body, motion, pose(k)));
            wanted.push(tuned.step(&mut b, body, motion, pose(k)));
        }
        compare(&found, &wanted, 2.5e-3);
    }

    #[test]
    fn a_pad_s_file_steps_as_the_core_retunes() {
        for [size, stiffness, lambda] in FINGERS {
            on_body(size, stiffness, lambda, &Plane);
            on_body(size, stiffness, lambda, &Sphere::new(12.0).unwrap());
        }
    }

    #[test]
    fn factors_multiply_and_return() {
        let fitted = PadModelFile::new(PAD).unwrap();
        let there = Tuning { size: 1.25, stiffness: 2.0, lambda: 0.5 };
        let back = Tuning { size: 0.8, stiffness: 0.5, lambda: 2.0 };
        let other = PadModelFile::new(&retuned_pad(&fitted, &there).unwrap()).unwrap();
        let again = PadModelFile::new(&retuned_pad(&other, &back).unwrap()).unwrap();
        let meta: Value = serde_json::from_str(other.file().meta).unwrap();
        assert_eq!(meta[KEY], json!({"size": 1.25, "stiffness": 2.0, "lambda": 0.5}));
        assert!(is_retuned(other.file().meta) && !is_retuned(fitted.file().meta));
        let meta: Value = serde_json::from_str(again.file().meta).unwrap();
        assert!((meta[KEY]["size"].as_f64().unwrap() - 1.0).abs() < 1e-7, "{meta}");
        let (found, wanted) = (again.file().pad, fitted.file().pad);
        let numbers = |pad: &fingerpad::pad::Pad<'_>| -> Vec<f32> {
            let patches = pad.patches.iter().flat_map(|p| bytemuck::cast_slice::<Patch, f32>(std::slice::from_ref(p)));
            let rest = bytemuck::cast_slice::<_, f32>(std::slice::from_ref(pad.numbers)).to_vec();
            patches.copied().chain(rest).collect()
        };
        for (a, b) in numbers(&found).into_iter().zip(numbers(&wanted)) {
            assert!((a - b).abs() <= 1e-5 * b.abs(), "{a} {b}");
        }
    }

    #[test]
    fn effects_and_factors_out_of_range_are_refused() {
        let (bed, pad) = (ModelFile::new(BED).unwrap(), PadModelFile::new(PAD).unwrap());
        let wide = retuned_pad(&pad, &Tuning { size: 2.5, ..Tuning::default() }).unwrap_err();
        assert!(matches!(wide, ReduceError::Model(Error::Range { .. })), "{wide}");
        // So much friction on so soft a finger would not be passive; the core's check of the file refuses it.
        let soft = retuned_bed(&bed, &Tuning { stiffness: 0.3, lambda: 1.5, ..Tuning::default() }).unwrap_err();
        assert!(matches!(soft, ReduceError::Model(Error::NotPassive { .. })), "{soft}");
    }
}
