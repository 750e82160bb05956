//! From the finger's elastic response to the readings of the instruments.
//!
//! Main types: [`Elastic`] (response of the finite elements at a place), [`Surface`] (the response anywhere near the
//! table).

use fingerpad_fe::contact::RubberFriction;

use super::parameters::{Parameter, Values};
use crate::LawPoint;

/// Contact area at which pull-off and stiffening are stated, mm² and mm: those of the diagnosis of runs.
const ADHESION_AREA_MM2: f64 = 63.5;
const STIFFENING_DEPTH_MM: f64 = 0.8;

/// Steady slide of a finger of stiffness and size 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastic {
    /// Normal force, N.
    pub normal_n: f64,
    /// Contact area, mm².
    pub area_mm2: f64,
    /// Friction, N.
    pub friction_n: f64,
}

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

/// Elastic response of the finger over depth, law and bone clearance.
pub trait Surface {
    /// The response at a place.
    fn at(&self, place: &ElasticPlace) -> Elastic;
}

/// Factors from an elastic response at a place to that of the scaled finger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaling {
    /// Factor on stresses.
    pub stiffness: f64,
    /// Factor on lengths.
    pub size: f64,
}

/// Place and scaling of a slot.
///
/// With all stiffness times s, the law's strength at s times the pressure is s times that of the unscaled finger; with
/// all lengths times g, depths are g times, areas and forces g² times as large. Both are exact.
pub fn place_of(values: &Values, depth_mm: f64, slot: usize) -> (ElasticPlace, Scaling) {
    let get = |p| values.get(p);
    let depth_mm = depth_mm + get(Parameter::DepthOffset) + get(Parameter::DepthError(slot));
    let rate = get(Parameter::StrainStiffening);
    let stiffness = (get(Parameter::LnStiffness) + rate * (depth_mm - STIFFENING_DEPTH_MM)).exp();
    let size = get(Parameter::LnSize).exp();
    let place = ElasticPlace {
        depth_mm: depth_mm / size,
        law: unscaled(&law_of(values), stiffness),
        bone_mm: get(Parameter::BoneClearance),
    };
    (place, Scaling { stiffness, size })
}

/// The friction law of the values.
pub fn law_of(values: &Values) -> LawPoint {
    LawPoint {
        tau_ref_kpa: values.get(Parameter::LnStrength).exp(),
        beta: values.get(Parameter::Exponent),
        tau0_share: values.get(Parameter::Tau0Share),
    }
}

/// The law on a finger of stiffness 1 that gives the response of `law` on a finger of stiffness `stiffness`.
fn unscaled(law: &LawPoint, stiffness: f64) -> LawPoint {
    let law = law.friction(&RubberFriction::default());
    LawPoint::of(&RubberFriction {
        lambda: law.lambda * stiffness.powf(law.beta - 1.0),
        tau0_mpa: law.tau0_mpa / stiffness,
        ..law
    })
}

impl Scaling {
    /// The response of the scaled finger.
    pub fn apply(&self, elastic: &Elastic) -> Elastic {
        let area = self.size * self.size;
        Elastic {
            normal_n: self.stiffness * area * elastic.normal_n,
            area_mm2: area * elastic.area_mm2,
            friction_n: self.stiffness * area * elastic.friction_n,
        }
    }
}

/// Smallest normal reading that a ratio is taken of, N.
const LEAST_READING_N: f64 = 1e-3;

/// Readings of the instruments for a response: normal force, contact area, friction coefficient.
pub fn read(values: &Values, finger: &Elastic) -> [f64; 3] {
    let pull = values.get(Parameter::PullOff) * (finger.area_mm2 / ADHESION_AREA_MM2).sqrt();
    let (sin, cos) = values.get(Parameter::Tilt).to_radians().sin_cos();
    let pressed = finger.normal_n - pull;
    let normal = cos * pressed - sin * finger.friction_n + values.get(Parameter::NormalForceOffset);
    let friction = cos * finger.friction_n + sin * pressed;
    let normal = normal.max(LEAST_READING_N);
    [normal, finger.area_mm2, friction / normal]
}

/// Takes the instruments' effects off a reading: normal force (N) that presses the tissue, and friction coefficient.
///
/// * `area_mm2`: contact area, for the pull-off
///
/// None if the corrected load is not positive.
pub fn corrected(values: &Values, normal_n: f64, coefficient: f64, area_mm2: f64) -> Option<[f64; 2]> {
    let (sin, cos) = values.get(Parameter::Tilt).to_radians().sin_cos();
    let (normal, friction) = (normal_n - values.get(Parameter::NormalForceOffset), coefficient * normal_n);
    let (pressed, friction) = (cos * normal + sin * friction, cos * friction - sin * normal);
    let elastic = pressed + values.get(Parameter::PullOff) * (area_mm2 / ADHESION_AREA_MM2).sqrt();
    (elastic > 0.0).then(|| [elastic, friction / elastic])
}

/// Readings of all slots.
pub fn predict(surface: &dyn Surface, values: &Values, depths_mm: &[f64]) -> Vec<[f64; 3]> {
    (depths_mm.iter().enumerate())
        .map(|(slot, &depth_mm)| {
            let (place, scaling) = place_of(values, depth_mm, slot);
            read(values, &scaling.apply(&surface.at(&place)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fingerpad_fe::contact::FrictionLaw;

    /// A finger of stiffness s is one of stiffness 1 under s times smaller pressures.
    #[test]
    fn the_law_of_the_unscaled_finger_is_the_same_law() {
        let law = LawPoint { tau_ref_kpa: 7.0, beta: 0.4, tau0_share: 0.3 };
        let base = RubberFriction::default();
        for s in [0.6, 1.0, 1.7] {
            let (scaled, own) = (law.friction(&base), unscaled(&law, s).friction(&base));
            for p in [0.003, 0.006, 0.012] {
                let (a, b) = (scaled.strength(s * p).0, s * own.strength(p).0);
                assert!((a / b - 1.0).abs() < 1e-10, "{s} {p}: {a} {b}");
            }
        }
    }

    /// The correction inverts the effects of the instruments.
    #[test]
    fn a_corrected_reading_is_the_elastic_one() {
        let finger = Elastic { normal_n: 0.21, area_mm2: 60.0, friction_n: 0.4 };
        let values = Values::without_effects(4, 7.0, 0.46, 0.0);
        for (parameter, value) in
            [(Parameter::PullOff, 0.02), (Parameter::NormalForceOffset, -0.05), (Parameter::Tilt, 4.0)]
        {
            let values = values.clone().with(parameter, value);
            let [normal, area, coefficient] = read(&values, &finger);
            assert!((normal - 0.21).abs() > 0.003, "{parameter:?} shows");
            let [back, mu] = corrected(&values, normal, coefficient, area).unwrap();
            assert!((back - 0.21).abs() < 1e-12 && (mu - 0.4 / 0.21).abs() < 1e-12, "{parameter:?}: {back} {mu}");
        }
        let taken = values.with(Parameter::NormalForceOffset, 0.3);
        assert!(corrected(&taken, 0.2, 1.0, 60.0).is_none());
    }
}
