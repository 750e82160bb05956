//! Elements of one material in batches of eight, with the places of their forces and stiffness.

use nalgebra::Vector3;
use wide::f64x8;

use super::{
    BodyError, Deformed, DofMap, TissueStep,
    constitutive::{BatchLaw, law},
    relaxing::PointSteps,
};
use crate::element::{Batch, ElementStress, Forces, Tangent};
use crate::material::Material;

pub(super) struct Group<const N: usize, const Q: usize> {
    pub material: Material,
    pub batch: Batch<N, Q>,
    /// Dof of each node and lane (usize::MAX: none), for batches without constrained nodes.
    pub plain: Option<Scatter<N>>,
    /// Mesh element of each lane.
    pub elements: Vec<u32>,
    /// Place of its first point in the memory of the tissue, if its material relaxes.
    pub first_point: Option<usize>,
}

pub(super) struct Scatter<const N: usize> {
    pub dof: [[usize; 8]; N],
    /// Per lane and pair (a, b <= a): place of the block's top entry in each of its three columns.
    pub place: Vec<[BlockPlace; 8]>,
}

#[derive(Clone, Copy)]
pub(super) enum BlockPlace {
    None,
    /// Rows of a below columns of b.
    Straight([u32; 3]),
    /// Rows of b below columns of a.
    Transposed([u32; 3]),
    Diagonal([u32; 3]),
}

impl<const N: usize, const Q: usize> Group<N, Q> {
    /// Gives its points their places in the memory of the tissue, from `points` on.
    pub fn take_points(&mut self, points: &mut usize) {
        if !matches!(self.material, Material::Linear(_)) {
            self.first_point = Some(*points);
            *points += Q;
        }
    }

    fn steps<'a>(&self, step: Option<&'a TissueStep>) -> Option<PointSteps<'a>> {
        Some(step?.of(self.first_point?, Q))
    }

    /// Adds the stress of the undeformed frame at every point of a material that relaxes, MPa.
    pub fn add_relaxed(&self, x: &[Vector3<f64>], out: &mut Vec<[[f64; 8]; 6]>) {
        if self.first_point.is_some() {
            law(&self.material).add_relaxed(&self.batch, x, out);
        }
    }

    /// Forces and smallest det F of the elements.
    pub fn forces(&self, Deformed { at, step }: Deformed) -> Forces<N> {
        law(&self.material).forces(&self.batch, &at.x, self.steps(step))
    }

    /// Derivative of the forces over positions.
    pub fn tangent(&self, Deformed { at, step }: Deformed, out: &mut Tangent<N>) {
        law(&self.material).tangent(&self.batch, &at.x, self.steps(step), out);
    }

    /// Energy of each element, mJ.
    pub fn energies(&self, Deformed { at, step }: Deformed) -> [f64; 8] {
        law(&self.material).energies(&self.batch, &at.x, self.steps(step))
    }

    /// Plane-strain modulus of the undeformed material, MPa.
    pub fn plane_strain_modulus_mpa(&self) -> f64 {
        BatchLaw::<N, Q>::plane_strain_modulus_mpa(law(&self.material))
    }

    /// Mean stress and strain of each element.
    pub fn stresses(&self, Deformed { at, step }: Deformed) -> [ElementStress; 8] {
        law(&self.material).stresses(&self.batch, &at.x, self.steps(step))
    }

    /// Adds the forces to those of all nodes, N.
    pub fn accumulate(&self, forces: &Forces<N>, out: &mut [Vector3<f64>]) {
        for a in 0..N {
            let lanes = forces.force[a].map(f64x8::to_array);
            for lane in 0..self.batch.len {
                out[self.batch.nodes[a][lane] as usize] += Vector3::new(lanes[0][lane], lanes[1][lane], lanes[2][lane]);
            }
        }
    }
}

/// Batches of eight elements of one material, those without constrained nodes apart.
pub(super) fn group<const N: usize, const Q: usize>(
    elements: &[(usize, Material)],
    dofs: &DofMap,
    nodes: impl Fn(usize) -> [u32; N],
    batch: impl Fn(&[[u32; N]]) -> Option<Batch<N, Q>>,
    inverted: impl Fn(usize) -> BodyError,
) -> Result<Vec<Group<N, Q>>, BodyError> {
    let mut open: Vec<(Material, bool, Vec<u32>)> = Vec::new();
    let mut full = Vec::new();
    for &(e, material) in elements {
        let plain = nodes(e).iter().all(|&n| dofs.is_plain(n));
        let slot = match open.iter().position(|(m, p, _)| *m == material && *p == plain) {
            Some(slot) => slot,
            None => {
                open.push((material, plain, Vec::new()));
                open.len() - 1
            }
        };
        open[slot].2.push(e as u32);
        if open[slot].2.len() == 8 {
            full.push((material, plain, std::mem::take(&mut open[slot].2)));
        }
    }
    full.extend(open.into_iter().filter(|(_, _, list)| !list.is_empty()));
    full.into_iter()
        .map(|(material, plain, list)| {
            let connectivity: Vec<[u32; N]> = list.iter().map(|&e| nodes(e as usize)).collect();
            let Some(made) = batch(&connectivity) else {
                let culprit = list.iter().zip(&connectivity).find(|(_, c)| batch(&[**c]).is_none());
                return Err(inverted(*culprit.expect("one of them").0 as usize));
            };
            let scatter = plain.then(|| scatter(&made, dofs));
            Ok(Group { material, batch: made, plain: scatter, elements: list, first_point: None })
        })
        .collect()
}

fn scatter<const N: usize, const Q: usize>(batch: &Batch<N, Q>, dofs: &DofMap) -> Scatter<N> {
    let dof: [[usize; 8]; N] =
        std::array::from_fn(|a| std::array::from_fn(|lane| dofs.node_dof(batch.nodes[a][lane]).unwrap_or(usize::MAX)));
    let mut place = Vec::new();
    for a in 0..N {
        for b in 0..=a {
            place.push(std::array::from_fn(|lane| {
                let (p, q) = (dof[a][lane], dof[b][lane]);
                let columns = |row: usize, column: usize| {
                    std::array::from_fn(|c| dofs.entry(row.max(column + c), column + c) as u32)
                };
                if p == usize::MAX || q == usize::MAX {
                    BlockPlace::None
                } else if p == q {
                    BlockPlace::Diagonal(columns(p, p))
                } else if p > q {
                    BlockPlace::Straight(columns(p, q))
                } else {
                    BlockPlace::Transposed(columns(q, p))
                }
            }));
        }
    }
    Scatter { dof, place }
}
