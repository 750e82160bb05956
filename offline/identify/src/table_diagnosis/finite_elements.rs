//! Steady slides of the finite elements, for the regression surface and for checks of it.
//!
//! Main type: [`FiniteElements`].

use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::mesh::FingertipShape;

use super::TableError;
use super::reading::{Elastic, ElasticPlace};
use super::surface::FittedSurface;
use crate::{CalibrationParameter, Evaluator, FeModel, IdentifyError, Key, LawPoint, Query, Steady, key_of};

/// Depths of the surface: from this share of the table's least to that of its largest.
const DEPTH_RANGE: [f64; 2] = [0.8, 1.12];
/// Depths of the surface.
const DEPTHS: usize = 6;
/// Slots of the surface's depths, away from those of the table.
const FIRST_SLOT: usize = 100;
/// Laws of the surface: ln strength, beta, share of tau_0, each less that of the middle; neighbours follow one another,
/// because a slide starts from the last ones.
const LAWS: [[f64; 3]; 15] = [
    [0.0, 0.0, 0.0],
    [0.3, 0.0, 0.0],
    [-0.3, 0.0, 0.0],
    [-0.25, 0.25, 0.0],
    [0.0, 0.25, 0.0],
    [0.0, 0.25, 0.4],
    [0.0, 0.0, 0.25],
    [0.0, 0.0, 0.5],
    [-0.25, 0.0, 0.45],
    [-0.3, -0.2, 0.0],
    [0.0, -0.2, 0.4],
    [0.0, -0.2, 0.0],
    [0.25, -0.2, 0.0],
    [0.0, -0.4, 0.0],
    [-0.25, -0.4, 0.0],
];
/// Changes of the bone clearance, mm.
const BONE_MM: [f64; 2] = [-0.5, 0.5];

/// The finite elements of one finger, stiffness 1.
pub struct FiniteElements<'e, 'm> {
    /// Settings, cache and threads.
    pub evaluator: &'e Evaluator<'e>,
    /// The finger as it was given.
    pub fe_model: FeModel<'m>,
    /// Its shape.
    pub shape: FingertipShape,
    /// Elastic slip and regularisation of the law.
    pub base: RubberFriction,
    /// Deepest place that the finger has room for, mm.
    pub deepest_mm: f64,
    /// Expected number of further steady slides.
    pub expected: usize,
    /// Number of requested slides.
    pub requested: usize,
}

impl FiniteElements<'_, '_> {
    /// The response at places that share law and bone clearance; none if no steady slide is found.
    ///
    /// # Errors
    /// [`TableError::Fe`] that is not of one place.
    pub fn at(&mut self, first_slot: usize, places: &[ElasticPlace]) -> Result<Vec<Option<Elastic>>, TableError> {
        let queries: Vec<(usize, Vec<Query>)> = places
            .iter()
            .enumerate()
            .map(|(k, place)| {
                let law = place.law.friction(&self.base);
                (first_slot + k, vec![Query { depth_mm: place.depth_mm, law, stiffness: 1.0 }])
            })
            .collect();
        let bone_mm = places.first().map_or(0.0, |p| p.bone_mm);
        let mut left = queries;
        left.retain(|(_, query)| self.evaluator.cache.get(&self.failure(bone_mm, &query[0])).is_none());
        let mut answers = vec![None; places.len()];
        loop {
            match self.run(bone_mm, &left) {
                Ok(states) => {
                    for ((slot, _), states) in left.iter().zip(&states) {
                        answers[slot - first_slot] = states.first().map(elastic);
                    }
                    break;
                }
                // A slide that is not found is not searched again; the others are kept. The move fails from the slot's
                // last law, whose depth is the same or near.
                Err(IdentifyError::Steady { depth_mm, .. } | IdentifyError::BesidePad { depth_mm, .. })
                    if left.len() > 1 =>
                {
                    let away = |q: &Query| (q.depth_mm - depth_mm).abs();
                    let failed = (0..left.len()).min_by(|a, b| away(&left[*a].1[0]).total_cmp(&away(&left[*b].1[0])));
                    let (_, query) = left.remove(failed.expect("at least two are left"));
                    self.remember_failure(bone_mm, &query[0])?;
                }
                Err(error) if error.is_local() => {
                    for (_, query) in &left {
                        self.remember_failure(bone_mm, &query[0])?;
                    }
                    break;
                }
                Err(error) => return Err(error.into()),
            }
        }
        self.requested += places.len();
        (self.evaluator.hooks.report_progress)(
            "finite elements",
            &format!("{}/{}", self.requested, self.expected.max(self.requested)),
        );
        Ok(answers)
    }

    /// Key under which the cache records that a slide is not found, so that a resumed run gives the same result.
    fn failure(&self, bone_mm: f64, query: &Query) -> Key {
        let (config, tolerance) = (self.evaluator.config, self.evaluator.settings.tolerance);
        let finger = (&self.shape, bone_mm.to_bits(), config.mesh_preset, &config.tissue, config.numerics);
        key_of(&("no steady slide", env!("CARGO_PKG_VERSION"), finger, tolerance.to_bits(), query))
    }

    fn remember_failure(&self, bone_mm: f64, query: &Query) -> Result<(), TableError> {
        Ok(self.evaluator.cache.put(self.failure(bone_mm, query), &Steady::default())?)
    }

    fn run(&mut self, bone_mm: f64, queries: &[(usize, Vec<Query>)]) -> Result<Vec<Vec<Steady>>, IdentifyError> {
        if bone_mm == 0.0 {
            return self.fe_model.steady(queries);
        }
        let mut shape = self.shape.clone();
        let offset = CalibrationParameter::BoneDorsalOffsetMm;
        *offset.of_shape(&mut shape).expect("of the shape") += bone_mm;
        self.evaluator.on_shape(&shape, queries)
    }

    /// The surface around a law.
    ///
    /// * `middle`: law on the finger of stiffness 1
    /// * `depths_mm`: the table's
    /// * `with_bone`: whether the bone clearance is varied too
    ///
    /// # Errors
    /// [`TableError`].
    pub fn surface(
        &mut self,
        middle: &LawPoint,
        depths_mm: &[f64],
        with_bone: bool,
    ) -> Result<FittedSurface, TableError> {
        let [least, most] = [depths_mm[0] * DEPTH_RANGE[0], depths_mm[depths_mm.len() - 1] * DEPTH_RANGE[1]];
        let most = most.min(self.deepest_mm);
        let ratio = (most / least).powf(1.0 / (DEPTHS - 1) as f64);
        let depths: Vec<f64> = (0..DEPTHS).map(|k| least * ratio.powi(k as i32)).collect();
        self.expected += DEPTHS * (LAWS.len() + if with_bone { BONE_MM.len() } else { 0 });
        let law = |[u, b, s]: [f64; 3]| LawPoint {
            tau_ref_kpa: middle.tau_ref_kpa * f64::exp(u),
            beta: middle.beta + b,
            tau0_share: s,
        };
        let mut answers = Vec::new();
        let bones = if with_bone { &BONE_MM[..] } else { &[] };
        let laws = LAWS.iter().map(|away| (law(*away), 0.0));
        for (law, bone_mm) in laws.chain(bones.iter().map(|bone_mm| (law(LAWS[0]), *bone_mm))) {
            let places: Vec<ElasticPlace> =
                depths.iter().map(|&depth_mm| ElasticPlace { depth_mm, law, bone_mm }).collect();
            let found = self.at(FIRST_SLOT, &places)?;
            answers.extend(places.into_iter().zip(found).filter_map(|(place, found)| Some((place, found?))));
        }
        let count = answers.len();
        FittedSurface::through(&answers, self.base).ok_or(TableError::TooFewSlides { found: count })
    }
}

fn elastic(steady: &Steady) -> Elastic {
    Elastic { normal_n: steady.normal_force_n, area_mm2: steady.contact_area_mm2, friction_n: steady.friction_x_n }
}
