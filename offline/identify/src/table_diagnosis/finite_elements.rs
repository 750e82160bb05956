//! Steady slides of the finite elements, for the regression surface and for checks of it.
//!
//! Main type: [`FiniteElements`].

use fingerpad_fe::mesh::FingertipShape;

use super::effects::Values;
use super::reading::{Elastic, ElasticPlace, place_of};
use super::surface::FittedSurface;
use crate::evaluator::Missing;
use crate::{Evaluator, FeModel, IdentifyError, Key, LawPoint, Query, Steady, key_of};

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
    /// Deepest place that the finger has room for, mm.
    pub deepest_mm: f64,
    /// Number of steady slides that are expected in all, and that were requested.
    pub expected: usize,
    pub requested: usize,
}

impl FiniteElements<'_, '_> {
    /// The response at places that share law and bone clearance; none if no steady slide is found. The cache records the
    /// slides that are not found, so that a resumed run gives the same result.
    pub fn at(&mut self, first_slot: usize, places: &[ElasticPlace]) -> Result<Vec<Option<Elastic>>, IdentifyError> {
        let bone_mm = places.first().map_or(0.0, |p| p.bone_mm);
        let query = |(k, place): (usize, &ElasticPlace)| {
            let law = place.law.friction(&self.evaluator.config.friction);
            (first_slot + k, vec![Query { depth_mm: place.depth_mm, law, stiffness: 1.0 }])
        };
        let mut open: Vec<(usize, Vec<Query>)> = places.iter().enumerate().map(query).collect();
        open.retain(|(_, query)| self.evaluator.cache.get(&self.failure(bone_mm, &query[0])).is_none());
        let mut answers = vec![None; places.len()];
        for ((slot, query), found) in open.iter().zip(self.found(bone_mm, &open)?) {
            match found {
                Some(s) => answers[slot - first_slot] = Some([s.normal_force_n, s.contact_area_mm2, s.friction_x_n]),
                None => self.evaluator.cache.put(self.failure(bone_mm, &query[0]), &Steady::default())?,
            }
        }
        self.requested += places.len();
        let line = format!("{}/{}", self.requested, self.expected.max(self.requested));
        (self.evaluator.hooks.report_progress)("finite elements", &line);
        Ok(answers)
    }

    /// Key under which the cache records that a slide is not found.
    fn failure(&self, bone_mm: f64, query: &Query) -> Key {
        key_of(&("no steady slide", self.evaluator.key(&with_bone(self.fe_model.shape(), bone_mm)), query))
    }

    /// The slides, or each by itself where the common press or the mesh fails.
    fn found(&mut self, bone_mm: f64, open: &[(usize, Vec<Query>)]) -> Result<Vec<Option<Steady>>, IdentifyError> {
        let found = if bone_mm == 0.0 {
            self.fe_model.slides(open, Missing::Sought)
        } else {
            self.evaluator.slides_on(&with_bone(self.fe_model.shape(), bone_mm), open, Missing::Sought)
        };
        match found {
            Err(error) if error.is_local() && open.len() > 1 => {
                let each: Result<Vec<_>, _> = open.chunks(1).map(|one| self.found(bone_mm, one)).collect();
                each.map(|found| found.concat())
            }
            Err(error) if error.is_local() => Ok(vec![None; open.len()]),
            found => Ok(found?.concat()),
        }
    }

    /// The surface around the law `middle` and the depths of a table, with the bone clearance.
    pub fn surface(&mut self, middle: &LawPoint, depths_mm: &[f64]) -> Result<FittedSurface, IdentifyError> {
        let [least, most] = [depths_mm[0] * DEPTH_RANGE[0], depths_mm[depths_mm.len() - 1] * DEPTH_RANGE[1]];
        let ratio = (most.min(self.deepest_mm) / least).powf(1.0 / (DEPTHS - 1) as f64);
        self.expected += DEPTHS * (LAWS.len() + BONE_MM.len());
        let law = |[u, b, s]: [f64; 3]| LawPoint {
            tau_ref_kpa: middle.tau_ref_kpa * f64::exp(u),
            beta: middle.beta + b,
            tau0_share: s,
        };
        let mut answers = Vec::new();
        let laws = LAWS.iter().map(|away| (law(*away), 0.0));
        for (law, bone_mm) in laws.chain(BONE_MM.map(|bone_mm| (law(LAWS[0]), bone_mm))) {
            let place = |k: usize| ElasticPlace { depth_mm: least * ratio.powi(k as i32), law, bone_mm };
            let places: Vec<ElasticPlace> = (0..DEPTHS).map(place).collect();
            let found = self.at(FIRST_SLOT, &places)?;
            answers.extend(places.into_iter().zip(found).filter_map(|(place, found)| Some((place, found?))));
        }
        let found = answers.len();
        FittedSurface::through(&answers, self.evaluator.config.friction).ok_or(IdentifyError::TooFewSlides(found))
    }

    /// The responses at the places of values; `None` if one of the slides is not found.
    pub fn at_values(&mut self, depths_mm: &[f64], values: &Values) -> Result<Option<Vec<Elastic>>, IdentifyError> {
        let places: Vec<_> = (0..depths_mm.len()).map(|k| place_of(values, depths_mm[k], k).0).collect();
        if places.iter().any(|p| p.depth_mm > self.deepest_mm || !(p.depth_mm > 0.1)) {
            return Ok(None);
        }
        Ok(self.at(0, &places)?.into_iter().collect())
    }
}

/// A shape with another clearance under the bone.
pub fn with_bone(shape: &FingertipShape, bone_mm: f64) -> FingertipShape {
    FingertipShape { bone_dorsal_offset_mm: shape.bone_dorsal_offset_mm + bone_mm, ..shape.clone() }
}
