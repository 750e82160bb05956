//! From the finger's elastic response to the readings of the instruments.
//!
//! Main types: [`Elastic`] (response of the finite elements at a place), [`Surface`] (the response anywhere near the
//! table).

use fingerpad_fe::contact::RubberFriction;

use super::effects::{Parameter, Values};
use crate::LawPoint;

/// Contact area at which pull-off and stiffening are stated, mm² and mm: those of the diagnosis of runs.
const ADHESION_AREA_MM2: f64 = 63.5;
const STIFFENING_DEPTH_MM: f64 = 0.8;

/// Normal force (N), contact area (mm²) and friction (N) of a steady slide.
pub type Elastic = [f64; 3];

/// Elastic response of the finger over depth, law and bone clearance.
pub type Surface<'a> = dyn Fn(&ElasticPlace) -> Elastic + 'a;

/// Place of a requested elastic response, on a finger of stiffness and size 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticPlace {
    /// Depth, mm.
    pub depth_mm: f64,
    /// Law.
    pub law: LawPoint,
    /// Added to the clearance under the bone, mm.
    pub bone_mm: f64,
}

/// Place of a slot, and the factors from the elastic response there to that of the scaled finger.
///
/// With all stiffness times s, the law's strength at s times the pressure is s times that of the unscaled finger; with
/// all lengths times g, depths are g times, areas and forces g² times as large. Both are exact.
pub fn place_of(values: &Values, depth_mm: f64, slot: usize) -> (ElasticPlace, Elastic) {
    let depth_mm = values.depth_mm(depth_mm, slot);
    let stiffness = stiffness_at(values, depth_mm);
    let size = values[Parameter::LN_SIZE].exp();
    let law = values.law().friction(&RubberFriction::default()).scaled(1.0, stiffness);
    let place =
        ElasticPlace { depth_mm: depth_mm / size, law: LawPoint::of(&law), bone_mm: values[Parameter::BONE_CLEARANCE] };
    let area = size * size;
    (place, [stiffness * area, area, stiffness * area])
}

/// Factor on every stiffness at a depth, mm.
pub fn stiffness_at(values: &Values, depth_mm: f64) -> f64 {
    let rate = values[Parameter::STRAIN_STIFFENING];
    (values[Parameter::LN_STIFFNESS] + rate * (depth_mm - STIFFENING_DEPTH_MM)).exp()
}

/// Smallest normal reading that a ratio is taken of, N.
const LEAST_READING_N: f64 = 1e-3;

/// Readings of the instruments for a response at a slot: normal force, contact area, friction coefficient.
///
/// * `elastic`: response at the place of the slot
pub fn read(values: &Values, factors: &Elastic, elastic: &Elastic) -> [f64; 3] {
    let [normal_n, area_mm2, friction_n] = [0, 1, 2].map(|q| factors[q] * elastic[q]);
    let (sin, cos) = values[Parameter::TILT].to_radians().sin_cos();
    let pressed = normal_n - pull_n(values, area_mm2);
    let normal = cos * pressed - sin * friction_n + values[Parameter::NORMAL_FORCE_OFFSET];
    let normal = normal.max(LEAST_READING_N);
    [normal, area_mm2, (cos * friction_n + sin * pressed) / normal]
}

fn pull_n(values: &Values, area_mm2: f64) -> f64 {
    values[Parameter::PULL_OFF] * (area_mm2 / ADHESION_AREA_MM2).sqrt()
}

/// Takes the instruments' effects off readings (as [`read`] gives them): normal force (N) that presses the tissue, area,
/// friction coefficient. None if the corrected load is not positive.
pub fn corrected(values: &Values, [normal_n, area_mm2, coefficient]: [f64; 3]) -> Option<[f64; 3]> {
    let (sin, cos) = values[Parameter::TILT].to_radians().sin_cos();
    let (normal, friction) = (normal_n - values[Parameter::NORMAL_FORCE_OFFSET], coefficient * normal_n);
    let elastic = cos * normal + sin * friction + pull_n(values, area_mm2);
    (elastic > 0.0).then(|| [elastic, area_mm2, (cos * friction - sin * normal) / elastic])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The correction inverts the effects of the instruments.
    #[test]
    fn a_corrected_reading_is_the_elastic_one() {
        let law = LawPoint { tau_ref_kpa: 7.0, beta: 0.46, tau0_share: 0.0 };
        let values = Values::without_effects(4, &law);
        for (parameter, value) in
            [(Parameter::PULL_OFF, 0.02), (Parameter::NORMAL_FORCE_OFFSET, -0.05), (Parameter::TILT, 4.0)]
        {
            let values = values.clone().with(parameter, value);
            let readings = read(&values, &[1.0; 3], &[0.21, 60.0, 0.4]);
            assert!((readings[0] - 0.21).abs() > 0.003, "{parameter:?} shows");
            let [back, _, mu] = corrected(&values, readings).unwrap();
            assert!((back - 0.21).abs() < 1e-12 && (mu - 0.4 / 0.21).abs() < 1e-12, "{parameter:?}: {back} {mu}");
        }
        let taken = values.with(Parameter::NORMAL_FORCE_OFFSET, 0.3);
        assert!(corrected(&taken, [0.2, 60.0, 1.0]).is_none());
    }
}
