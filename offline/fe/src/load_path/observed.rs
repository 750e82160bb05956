//! Quantities inside the finger at every increment: reactions of the supports, and probes in the tissue.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::{Finger, Model};
use crate::assembly::{Body, Configuration, Deformed};
use crate::mesh::{Mesh, element_corners, locate, set};

/// Distance of the receptors that [`papillae`] puts under the pad, mm.
const PITCH_MM: f64 = 1.0;
/// Distance of the points from first touch, mm.
const REACH_MM: f64 = 12.0;

/// Spread of a patch in a direction, share of the largest singular value, below which a field is taken as constant there.
const FLAT: f64 = 0.1;

/// Weight of a node in the fit of displacements: 1 over this number plus its squared distance, in units of the mean one.
const NEAR: f64 = 0.5;
/// Least over largest singular value below which a quadratic field is not determined.
const UNDETERMINED: f64 = 0.06;
/// Nodes per element above which a patch is one layer of hexahedra: of 9 elements, one layer has 3.6 and two have 2.7.
const ONE_LAYER: f64 = 3.5;

/// Supports of the finger, in the order of [`Reading::reactions`].
pub const SUPPORTS: [&str; 3] = ["nail", "bone", "section"];

/// Force and moment that one holder exerts on the finger, along the axes of the mesh; moments about its origin, the point of first
/// touch in the neutral pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Reaction {
    /// Force, N.
    pub force_n: [f64; 3],
    /// Moment, N mm.
    pub moment_n_mm: [f64; 3],
}

/// Values of a probe; components xx, yy, zz, xy, yz, xz along the undeformed axes of the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ProbeReading {
    /// Present place of its point of the tissue, mm.
    pub place_mm: [f64; 3],
    /// Green-Lagrange strain; shear of the tensor.
    pub strain: [f64; 6],
    /// Strain energy density, MPa, per undeformed volume.
    pub strain_energy_density_mpa: f64,
}

/// Observed quantities of one increment; lists of quantities that were not requested are empty.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Reading {
    /// Reactions of [`SUPPORTS`].
    pub reactions: Vec<Reaction>,
    /// One for each probe.
    pub probes: Vec<ProbeReading>,
}

/// A point of the tissue whose strain is read.
///
/// Strain comes from a quadratic field of displacements, fitted to the nodes of all elements of the same region that touch the probe's
/// element (polynomial preserving recovery, Zhang and Naga 2005, SIAM J. Sci. Comput. 26:1192-1213). Energy, and strain where a region
/// has too few layers of elements for such a field, come from means over elements: at each corner of the probe's element a linear
/// field is fitted to the means of the elements of the same region around that corner, and the values of these fields at the corners
/// are interpolated (superconvergent patch recovery, Zienkiewicz and Zhu 1992, Int. J. Numer. Methods Eng. 33:1331-1364).
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// Its name in files.
    pub name: String,
    corners: Vec<(u32, f64)>,
    undeformed: Vector3<f64>,
    slopes: Option<Vec<(u32, Vector3<f64>)>>,
    elements: Vec<(usize, f64)>,
}

/// Points that no probe can be put at.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProbeError {
    /// Outside the mesh.
    #[error("probe `{name}` at ({}, {}, {}) mm lies outside the finger", at_mm[0], at_mm[1], at_mm[2])]
    Outside {
        /// The probe's name.
        name: String,
        /// Its place, mm.
        at_mm: [f64; 3],
    },
    /// In a part that does not deform.
    #[error("probe `{name}` at ({}, {}, {}) mm lies in {region}, which is rigid", at_mm[0], at_mm[1], at_mm[2])]
    Rigid {
        /// The probe's name.
        name: String,
        /// Its place, mm.
        at_mm: [f64; 3],
        /// Its place.
        region: String,
    },
}

/// Quantities that a run observes.
#[derive(Clone, Debug, Default)]
pub struct Observed {
    /// Nodes of each support; empty without reactions.
    supports: Vec<Vec<u32>>,
    probes: Vec<Probe>,
}

/// Points of a grid of 1 mm at this depth under the pad, mm, as receptors lie in the papillae of the dermis; named by number.
pub fn papillae(finger: &Finger, depth_mm: f64) -> Vec<(String, Vector3<f64>)> {
    let half = (REACH_MM / PITCH_MM) as i32;
    let places = (-half..=half).flat_map(|i| (-half..=half).map(move |j| [i, j].map(|k| f64::from(k) * PITCH_MM)));
    let points = places.filter_map(|place| finger.below_skin(place, depth_mm));
    points.enumerate().map(|(k, point)| (format!("p{k:03}"), point)).collect()
}

/// Probes at undeformed points, mm, by name.
///
/// # Errors
/// [`ProbeError`] for the first point at which there can be none.
pub fn probes(mesh: &Mesh, body: &Body, points: &[(String, Vector3<f64>)]) -> Result<Vec<Probe>, ProbeError> {
    let volumes = body.element_volumes_mm3();
    let mut around: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    let (mut regions, mut middles, mut corners) = (Vec::new(), Vec::new(), Vec::new());
    for (element, (nodes, region)) in element_corners(mesh).enumerate() {
        regions.push(region);
        corners.push(nodes);
        middles.push(nodes.iter().map(|&n| mesh.nodes[n as usize]).sum::<Vector3<f64>>() / nodes.len() as f64);
        nodes.iter().for_each(|&n| around.entry(n).or_default().push(element));
    }
    let probe = |(name, point): &(String, Vector3<f64>)| {
        let (name, at_mm) = (name.clone(), [point.x, point.y, point.z]);
        let found = locate(mesh, point).ok_or_else(|| ProbeError::Outside { name: name.clone(), at_mm })?;
        if volumes[found.element] == 0.0 {
            let region = mesh.region_name(found.region).to_owned();
            return Err(ProbeError::Rigid { name, at_mm, region });
        }
        let beside = |node: &u32| {
            let all = around[node].iter().copied();
            all.filter(|&e| regions[e] == found.region && volumes[e] > 0.0)
        };
        let near: BTreeSet<usize> = found.corners.iter().flat_map(|(node, _)| beside(node)).collect();
        let nodes: BTreeSet<u32> = near.iter().flat_map(|&e| corners[e]).copied().collect();
        let nodes: Vec<u32> = nodes.into_iter().collect();
        let places: Vec<_> = nodes.iter().map(|&n| mesh.nodes[n as usize] - point).collect();
        let is_deep = nodes.len() as f64 <= ONE_LAYER * near.len() as f64;
        let slopes = if is_deep { slopes_at_origin(&places) } else { None };
        let slopes = slopes.map(|slopes| nodes.into_iter().zip(slopes).collect());
        let mut elements: BTreeMap<usize, f64> = BTreeMap::new();
        for (corner, weight) in &found.corners {
            let patch: Vec<usize> = beside(corner).collect();
            let places: Vec<_> = patch.iter().map(|&e| middles[e] - mesh.nodes[*corner as usize]).collect();
            patch
                .iter()
                .zip(weights_at_origin(&places))
                .for_each(|(&e, w)| *elements.entry(e).or_default() += weight * w);
        }
        let elements = elements.into_iter().collect();
        Ok(Probe { name, corners: found.corners, undeformed: *point, slopes, elements })
    };
    points.iter().map(probe).collect()
}

/// Weights with which values at `places` make the value at the origin of the linear field of least squares through them. Directions in
/// which the places hardly differ are taken as constant.
fn weights_at_origin(places: &[Vector3<f64>]) -> Vec<f64> {
    let nearness: Vec<f64> = places.iter().map(|place| 1.0 / place.norm_squared()).collect();
    let all: f64 = nearness.iter().sum();
    let middle = places.iter().zip(&nearness).map(|(place, w)| place * *w).sum::<Vector3<f64>>() / all;
    let rows = DMatrix::from_fn(places.len(), 3, |row, k| nearness[row].sqrt() * (places[row][k] - middle[k]));
    let svd = rows.svd(true, true);
    let least = FLAT * svd.singular_values.max();
    let slopes = svd.pseudo_inverse(least).expect("both factors are there and the bound is not negative");
    let slope = |row: usize| (0..3).map(|k| middle[k] * slopes[(k, row)]).sum::<f64>() * nearness[row].sqrt();
    (0..places.len()).map(|row| nearness[row] / all - slope(row)).collect()
}

/// Weights with which values at `places` make the gradient at the origin of the quadratic field of least squares through them, 1/mm;
/// None if the places do not determine one.
fn slopes_at_origin(places: &[Vector3<f64>]) -> Option<Vec<Vector3<f64>>> {
    let size = (places.iter().map(|p| p.norm_squared()).sum::<f64>() / places.len() as f64).sqrt();
    let nearness: Vec<f64> = places.iter().map(|p| 1.0 / (NEAR + (p / size).norm_squared())).collect();
    let mut rows = DMatrix::from_fn(places.len(), 10, |row, k| {
        let p = places[row] / size;
        let term = match k {
            0 => 1.0,
            1..4 => p[k - 1],
            4..7 => p[k - 4] * p[k - 4],
            _ => p[k - 7] * p[(k - 6) % 3],
        };
        nearness[row] * term
    });
    let norms: Vec<f64> = rows.column_iter().map(|column| column.norm()).collect();
    rows.column_iter_mut().zip(&norms).for_each(|(mut column, norm)| column /= *norm);
    let svd = rows.svd(true, true);
    if places.len() < 10 || svd.singular_values.min() < UNDETERMINED * svd.singular_values.max() {
        return None;
    }
    let fit = svd.pseudo_inverse(0.0).ok()?;
    let slopes = |row| Vector3::from_fn(|k, _| fit[(k + 1, row)] * nearness[row] / (size * norms[k + 1]));
    Some((0..places.len()).map(slopes).collect())
}

impl Observed {
    /// Probes, and reactions if requested.
    pub fn new(mesh: &Mesh, reactions: bool, probes: Vec<Probe>) -> Self {
        let supports = if reactions { supports(mesh).to_vec() } else { Vec::new() };
        Self { supports, probes }
    }

    /// Whether nothing is observed.
    pub fn is_empty(&self) -> bool {
        self.supports.is_empty() && self.probes.is_empty()
    }

    /// The probes.
    pub fn probes(&self) -> &[Probe] {
        &self.probes
    }

    /// Observed quantities of a state of `model`.
    pub fn read<'a>(&self, model: &Model, at: impl Into<Deformed<'a>>) -> Reading {
        let at = at.into();
        let reactions = if self.supports.is_empty() { Vec::new() } else { self.reactions(model, at) };
        let probes = if self.probes.is_empty() { Vec::new() } else { self.read_probes(model, at.at) };
        Reading { reactions, probes }
    }

    fn reactions(&self, model: &Model, deformed: Deformed) -> Vec<Reaction> {
        let forces = model.body.support_forces(deformed);
        let at = deformed.at;
        let copies = model.copies();
        // Forces along y, and moments about x and z, of the two halves cancel.
        let across = |whole: f64| if model.half.is_some() { 0.0 } else { whole };
        let of = |nodes: &Vec<u32>| {
            let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
            for &node in nodes {
                let (x, f) = (at.x[node as usize], forces[node as usize]);
                force += f;
                moment += x.cross(&f);
            }
            Reaction {
                force_n: [copies * force.x, across(force.y), copies * force.z],
                moment_n_mm: [across(moment.x), copies * moment.y, across(moment.z)],
            }
        };
        self.supports.iter().map(of).collect()
    }

    fn read_probes(&self, model: &Model, at: &Configuration) -> Vec<ProbeReading> {
        let undeformed = &model.body.undeformed().x;
        let moved: Vec<Vector3<f64>> = at.x.iter().zip(undeformed).map(|(x, x0)| x - x0).collect();
        let (density, stresses) = (model.body.energy(at).1, model.body.stresses(at));
        let moved = model.half.map_or_else(|| moved.clone(), |half| half.displacements(&moved));
        let elements = model.half.map(|half| half.elements());
        let element = |e: usize| {
            let (from, is_mirrored) = elements.as_ref().map_or((e, false), |elements| elements[e]);
            (stresses[from].mirrored_if(is_mirrored).green_lagrange, density[from])
        };
        let read = |probe: &Probe| {
            let shift: Vector3<f64> = probe.corners.iter().map(|&(n, w)| moved[n as usize] * w).sum();
            let mut reading = ProbeReading { place_mm: (probe.undeformed + shift).into(), ..ProbeReading::default() };
            for &(e, weight) in &probe.elements {
                let (strain, density) = element(e);
                reading.strain.iter_mut().zip(strain).for_each(|(sum, s)| *sum += weight * s);
                reading.strain_energy_density_mpa += weight * density;
            }
            if let Some(slopes) = &probe.slopes {
                let of_node = |sum, &(n, g): &(u32, Vector3<f64>)| sum + moved[n as usize] * g.transpose();
                let slope: Matrix3<f64> = slopes.iter().fold(Matrix3::zeros(), of_node);
                let strain = 0.5 * (slope + slope.transpose() + slope.transpose() * slope);
                reading.strain = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(|at| strain[at]);
            }
            reading
        };
        self.probes.iter().map(read).collect()
    }
}

/// The nodes of each of [`SUPPORTS`]: the fixed face of the nail, the distal phalanx on its joint, and the proximal section with the
/// second bone. A deformable bone is held at the section alone, so that its own reaction is zero.
fn supports(mesh: &Mesh) -> [Vec<u32>; 3] {
    let nail = mesh.node_set(set::NAIL_FIX).to_vec();
    let mut section = mesh.node_set(set::PROXIMAL_FIX).to_vec();
    section.extend(mesh.node_set(set::PROXIMAL_BONE));
    section.sort_unstable();
    section.dedup();
    section.retain(|n| nail.binary_search(n).is_err());
    let mut bone = mesh.node_set(set::DISTAL_BONE).to_vec();
    bone.retain(|n| nail.binary_search(n).is_err() && section.binary_search(n).is_err());
    [nail, bone, section]
}
