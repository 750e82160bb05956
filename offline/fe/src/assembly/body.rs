//! Residual and tangent of the body: elements of all materials, constraints condensed.

mod scatter;

use fingerpad::Relaxation;
use nalgebra::{Rotation3, Vector3};

use super::{
    Configuration, Deformed, DofMap, Material, Supports, TissueMemory,
    configuration::rotation_vector,
    dofs::Role,
    group::{Group, group},
};
use crate::element::{ElementStress, Hex8, Tangent, Tet4, Tet10};
use crate::mesh::{Mesh, Region};

/// Spring between the rigid bone and the ground, at the bone's reference point.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Joint {
    /// Stiffness against translation of the reference point, N/mm, >= 0.
    #[serde(deserialize_with = "fingerpad_formats::units::non_negative")]
    pub translation_n_per_mm: f64,
    /// Stiffness against rotation, N mm/rad, >= 0.
    #[serde(deserialize_with = "fingerpad_formats::units::non_negative")]
    pub rotation_nmm_per_rad: f64,
}

impl Default for Joint {
    /// 1 N/mm and 50 N mm/rad: soft beside the bone, stiff enough that the phalanx does not drift; an assumption.
    fn default() -> Self {
        Self { translation_n_per_mm: 1.0, rotation_nmm_per_rad: 50.0 }
    }
}

/// Why residual or body could not be made.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// An element is inverted in the undeformed mesh.
    #[error("element {element} of {region:?} is inverted or has no volume in the undeformed mesh")]
    InvertedMesh {
        /// Index in the mesh (4-node tetrahedra count on after the hexahedra, 10-node ones after these).
        element: usize,
        /// Its region.
        region: Region,
    },
    /// A soft region of the mesh without a law.
    #[error("the mesh names a soft region (number {number}, from 0) that has no law in tissue.regions")]
    NoLaw {
        /// Its place in the mesh's list of soft regions.
        number: usize,
    },
    /// An element turned inside out under load.
    #[error("an element turned inside out (det F = {det_f:.3e})")]
    Inverted {
        /// Smallest det F met.
        det_f: f64,
    },
}

/// A deformable body with its supports.
pub struct Body {
    undeformed: Configuration,
    hexes: Vec<Group<8, 8>>,
    tets: Vec<Group<4, 1>>,
    tets10: Vec<Group<10, 4>>,
    /// Numbers of hexahedra, 4-node and 10-node tetrahedra of the mesh, those left out included.
    element_counts: [usize; 3],
    rigid_arms: Vec<(u32, Vector3<f64>)>,
    tied: Vec<(u32, usize)>,
    joint: Joint,
    /// Groups of eight points of materials that may relax.
    points: usize,
    /// Degrees of freedom.
    pub dofs: DofMap,
}

impl Body {
    /// [`Self::with_hexes`] of mean-dilatation elements.
    ///
    /// # Errors
    /// [`BodyError::InvertedMesh`] names the first element whose Jacobian is not positive.
    pub fn new(
        mesh: &Mesh,
        material: impl Fn(Region) -> Option<Material>,
        supports: &Supports,
        rigid_reference: Vector3<f64>,
        joint: Joint,
    ) -> Result<Self, BodyError> {
        Self::with_hexes(Hex8::new, mesh, material, supports, rigid_reference, joint)
    }

    /// Assembles a body of hexahedra that `hex` makes, [`Hex8::new`] or, to compare with CalculiX,
    /// [`Hex8::uniform_strain`]; `material` gives the law of a region, or None to leave its elements out (rigid).
    ///
    /// `rigid_reference` is the point about which the rigid body turns and where `joint` acts, mm; both are unused
    /// without rigid nodes. Elements all of whose nodes are fixed, or all rigid, are left out; one between a fixed bone
    /// and a rigid one is kept.
    ///
    /// # Errors
    /// [`BodyError::InvertedMesh`] names the first element whose Jacobian is not positive.
    pub fn with_hexes(
        hex: impl Fn(&[[u32; 8]], &[Vector3<f64>]) -> Option<Hex8>,
        mesh: &Mesh,
        material: impl Fn(Region) -> Option<Material>,
        supports: &Supports,
        rigid_reference: Vector3<f64>,
        joint: Joint,
    ) -> Result<Self, BodyError> {
        let among = |set: &[u32]| {
            let mut inside = vec![false; mesh.nodes.len()];
            for &node in set {
                inside[node as usize] = true;
            }
            inside
        };
        let (fixed, rigid) = (among(&supports.fixed), among(&supports.rigid));
        let active = |nodes: &[u32], region: Region| {
            let all = |inside: &[bool]| nodes.iter().all(|&n| inside[n as usize]);
            material(region).filter(|_| !all(&fixed) && !all(&rigid))
        };
        let hexes: Vec<(usize, Material)> = (0..mesh.hexes.len())
            .filter_map(|e| active(&mesh.hexes[e].nodes, mesh.hexes[e].region).map(|m| (e, m)))
            .collect();
        let tets: Vec<(usize, Material)> = (0..mesh.tets.len())
            .filter_map(|e| active(&mesh.tets[e].nodes, mesh.tets[e].region).map(|m| (e, m)))
            .collect();
        let tets10: Vec<(usize, Material)> = (0..mesh.tets10.len())
            .filter_map(|e| active(&mesh.tets10[e].nodes, mesh.tets10[e].region).map(|m| (e, m)))
            .collect();
        let mut elements: Vec<Vec<u32>> = hexes.iter().map(|&(e, _)| mesh.hexes[e].nodes.to_vec()).collect();
        elements.extend(tets.iter().map(|&(e, _)| mesh.tets[e].nodes.to_vec()));
        elements.extend(tets10.iter().map(|&(e, _)| mesh.tets10[e].nodes.to_vec()));
        let dofs = DofMap::new(mesh, supports, &elements);

        let mut hexes = group(
            &hexes,
            &dofs,
            |e| mesh.hexes[e].nodes,
            |nodes| hex(nodes, &mesh.nodes),
            |e| BodyError::InvertedMesh { element: e, region: mesh.hexes[e].region },
        )?;
        let mut tets = group(
            &tets,
            &dofs,
            |e| mesh.tets[e].nodes,
            |nodes| Tet4::new(nodes, &mesh.nodes),
            |e| BodyError::InvertedMesh { element: mesh.hexes.len() + e, region: mesh.tets[e].region },
        )?;
        let first = mesh.hexes.len() + mesh.tets.len();
        let mut tets10 = group(
            &tets10,
            &dofs,
            |e| mesh.tets10[e].nodes,
            |nodes| Tet10::new(nodes, &mesh.nodes),
            |e| BodyError::InvertedMesh { element: first + e, region: mesh.tets10[e].region },
        )?;
        let mut points = 0;
        hexes.iter_mut().for_each(|group| group.take_points(&mut points));
        tets.iter_mut().for_each(|group| group.take_points(&mut points));
        tets10.iter_mut().for_each(|group| group.take_points(&mut points));
        let nodes_with = |wanted: fn(&Role) -> bool| {
            (0..mesh.nodes.len() as u32).filter(|&n| wanted(&dofs.role[n as usize])).collect::<Vec<_>>()
        };
        let rigid_arms = nodes_with(|r| *r == Role::Rigid)
            .into_iter()
            .map(|n| (n, mesh.nodes[n as usize] - rigid_reference))
            .collect();
        let tied = nodes_with(|r| matches!(r, Role::Tied { .. }))
            .into_iter()
            .map(|n| match dofs.role[n as usize] {
                Role::Tied { tie } => (n, tie),
                _ => unreachable!(),
            })
            .collect();
        Ok(Self {
            undeformed: Configuration {
                x: mesh.nodes.clone(),
                rigid_centre: rigid_reference,
                rigid_rotation: Rotation3::identity(),
            },
            hexes,
            tets,
            tets10,
            element_counts: [mesh.hexes.len(), mesh.tets.len(), mesh.tets10.len()],
            rigid_arms,
            tied,
            joint,
            points,
            dofs,
        })
    }

    /// The undeformed configuration.
    pub fn undeformed(&self) -> &Configuration {
        &self.undeformed
    }

    /// Plane-strain modulus of the undeformed body at every node, the mean of its elements', MPa; 0 without elements.
    pub fn plane_strain_moduli_mpa(&self) -> Vec<f64> {
        let mut sums = vec![(0.0, 0u32); self.undeformed.x.len()];
        let mut add = |nodes: &[[u32; 8]], len: usize, modulus: f64| {
            for node in nodes.iter().flat_map(|lanes| &lanes[..len]) {
                sums[*node as usize].0 += modulus;
                sums[*node as usize].1 += 1;
            }
        };
        for group in &self.hexes {
            add(&group.batch.nodes, group.batch.len, group.plane_strain_modulus_mpa());
        }
        for group in &self.tets {
            add(&group.batch.nodes, group.batch.len, group.plane_strain_modulus_mpa());
        }
        for group in &self.tets10 {
            add(&group.batch.nodes, group.batch.len, group.plane_strain_modulus_mpa());
        }
        sums.into_iter().map(|(sum, count)| if count > 0 { sum / f64::from(count) } else { 0.0 }).collect()
    }

    /// `configuration` moved by `scale * step` (dof order; rotations are spatial rotation vectors).
    pub fn advance(&self, configuration: &Configuration, step: &[f64], scale: f64) -> Configuration {
        let mut next = configuration.clone();
        let part = |dof: usize| Vector3::new(step[dof], step[dof + 1], step[dof + 2]) * scale;
        for (node, role) in self.dofs.role.iter().enumerate() {
            if let Role::Free { dof } = role {
                next.x[node] += part(*dof);
            }
        }
        if let Some(dof) = self.dofs.rigid_dof {
            next.rigid_centre += part(dof);
            next.rigid_rotation = Rotation3::new(part(dof + 3)) * configuration.rigid_rotation;
        }
        self.follow(&mut next);
        next
    }

    /// Moves rigid nodes with the pose and tied nodes with their masters.
    pub fn follow(&self, configuration: &mut Configuration) {
        for (node, arm) in &self.rigid_arms {
            configuration.x[*node as usize] = configuration.rigid_centre + configuration.rigid_rotation * arm;
        }
        for &(node, tie) in &self.tied {
            let undeformed = &self.undeformed.x;
            let moved = self.dofs.masters(tie).iter().fold(Vector3::zeros(), |sum, &(master, weight)| {
                sum + (configuration.x[master as usize] - undeformed[master as usize]) * weight
            });
            configuration.x[node as usize] = undeformed[node as usize] + moved;
        }
    }

    /// Internal forces in dof order, N (N mm for rotations): the external forces that equilibrium requires. Held dofs
    /// are zero.
    ///
    /// # Errors
    /// [`BodyError::Inverted`] if det F <= 0 at any quadrature point.
    pub fn residual<'a>(&self, at: impl Into<Deformed<'a>>, out: &mut Vec<f64>) -> Result<(), BodyError> {
        let deformed = at.into();
        let at = deformed.at;
        out.clear();
        out.resize(self.dofs.count, 0.0);
        let mut min_j = f64::INFINITY;
        for group in &self.hexes {
            min_j = min_j.min(self.add_forces(group, deformed, out));
        }
        for group in &self.tets {
            min_j = min_j.min(self.add_forces(group, deformed, out));
        }
        for group in &self.tets10 {
            min_j = min_j.min(self.add_forces(group, deformed, out));
        }
        if !(min_j > 0.0) {
            return Err(BodyError::Inverted { det_f: min_j });
        }
        if let Some(dof) = self.dofs.rigid_dof {
            let moved = (at.rigid_centre - self.undeformed.rigid_centre) * self.joint.translation_n_per_mm;
            let turned = rotation_vector(&at.rigid_rotation) * self.joint.rotation_nmm_per_rad;
            for i in 0..3 {
                out[dof + i] += moved[i];
                out[dof + 3 + i] += turned[i];
            }
        }
        for &dof in &self.dofs.held {
            out[dof] = 0.0;
        }
        Ok(())
    }

    /// Tangent of [`Self::residual`] on the pattern of the dofs, symmetric; held dofs are identity rows.
    ///
    /// With a rigid body it is the Hessian of the energy along rotation vectors, that is the symmetric part of
    /// the residual's derivative; the skew part vanishes at equilibrium of the moments.
    pub fn tangent<'a>(&self, at: impl Into<Deformed<'a>>, values: &mut Vec<f64>) {
        let deformed = at.into();
        let at = deformed.at;
        values.clear();
        values.resize(self.dofs.pattern.row.len(), 0.0);
        let mut hex = Tangent::new();
        for group in &self.hexes {
            group.tangent(deformed, &mut hex);
            self.add_tangent(group, at, &hex, values);
        }
        let mut tet = Tangent::new();
        for group in &self.tets {
            group.tangent(deformed, &mut tet);
            self.add_tangent(group, at, &tet, values);
        }
        let mut tet10 = Tangent::new();
        for group in &self.tets10 {
            group.tangent(deformed, &mut tet10);
            self.add_tangent(group, at, &tet10, values);
        }
        if self.dofs.rigid_dof.is_some() {
            self.add_rigid_geometry(deformed, values);
        }
        for &dof in &self.dofs.held {
            let (start, end) = (self.dofs.pattern.column_start[dof], self.dofs.pattern.column_start[dof + 1]);
            values[start..end].fill(0.0);
            values[start] = 1.0;
        }
        if !self.dofs.held.is_empty() {
            let mut held = vec![false; self.dofs.count];
            for &dof in &self.dofs.held {
                held[dof] = true;
            }
            for column in 0..self.dofs.count {
                for k in self.dofs.pattern.column_start[column] + 1..self.dofs.pattern.column_start[column + 1] {
                    if held[self.dofs.pattern.row[k]] {
                        values[k] = 0.0;
                    }
                }
            }
        }
    }

    /// Memory of undeformed tissue; None if it does not relax.
    pub fn memory(&self, relaxation: &Relaxation) -> Option<TissueMemory> {
        TissueMemory::new(relaxation, self.points)
    }

    /// Moves the memory of the tissue on by a step of `dt_s` (>= 0) that ends at `at`.
    pub fn remember(&self, memory: &mut TissueMemory, dt_s: f64, at: &Configuration) {
        let mut relaxed = Vec::with_capacity(self.points);
        self.hexes.iter().for_each(|group| group.add_relaxed(&at.x, &mut relaxed));
        self.tets.iter().for_each(|group| group.add_relaxed(&at.x, &mut relaxed));
        self.tets10.iter().for_each(|group| group.add_relaxed(&at.x, &mut relaxed));
        memory.move_on(dt_s, relaxed);
    }

    /// Total strain energy, mJ (the joint's included), of relaxed tissue, or whose derivative is the stress of a step; and the mean energy density of each element, MPa, hexahedra
    /// first, then tetrahedra of 4 and of 10 nodes (0 for elements left out).
    pub fn energy<'a>(&self, at: impl Into<Deformed<'a>>) -> (f64, Vec<f64>) {
        let deformed = at.into();
        let at = deformed.at;
        let [hex_count, tet_count, tet10_count] = self.element_counts;
        let mut density = vec![0.0; hex_count + tet_count + tet10_count];
        let mut total = 0.0;
        for group in &self.hexes {
            let energies = group.energies(deformed);
            let volumes = group.batch.volumes();
            for (lane, &e) in group.elements.iter().enumerate() {
                total += energies[lane];
                density[e as usize] = energies[lane] / volumes[lane];
            }
        }
        for group in &self.tets {
            let energies = group.energies(deformed);
            let volumes = group.batch.volumes();
            for (lane, &e) in group.elements.iter().enumerate() {
                total += energies[lane];
                density[hex_count + e as usize] = energies[lane] / volumes[lane];
            }
        }
        for group in &self.tets10 {
            let energies = group.energies(deformed);
            let volumes = group.batch.volumes();
            for (lane, &e) in group.elements.iter().enumerate() {
                total += energies[lane];
                density[hex_count + tet_count + e as usize] = energies[lane] / volumes[lane];
            }
        }
        if self.dofs.rigid_dof.is_some() {
            let moved = (at.rigid_centre - self.undeformed.rigid_centre).norm_squared();
            total += 0.5 * self.joint.translation_n_per_mm * moved;
            total += 0.5 * self.joint.rotation_nmm_per_rad * rotation_vector(&at.rigid_rotation).norm_squared();
        }
        (total, density)
    }

    /// Undeformed volume of every element, mm³, hexahedra first, then tetrahedra of 4 and of 10 nodes (0 for elements left out).
    pub fn element_volumes_mm3(&self) -> Vec<f64> {
        let [hex_count, tet_count, tet10_count] = self.element_counts;
        let mut all = vec![0.0; hex_count + tet_count + tet10_count];
        let mut put = |first: usize, elements: &[u32], volumes: [f64; 8]| {
            elements.iter().zip(volumes).for_each(|(&e, volume)| all[first + e as usize] = volume);
        };
        self.hexes.iter().for_each(|g| put(0, &g.elements, g.batch.volumes()));
        self.tets.iter().for_each(|g| put(hex_count, &g.elements, g.batch.volumes()));
        self.tets10.iter().for_each(|g| put(hex_count + tet_count, &g.elements, g.batch.volumes()));
        all
    }

    /// Mean stress and strain of every element, hexahedra first, then tetrahedra of 4 and of 10 nodes (0 for elements
    /// left out).
    pub fn stresses<'a>(&self, at: impl Into<Deformed<'a>>) -> Vec<ElementStress> {
        let at = at.into();
        let [hex_count, tet_count, tet10_count] = self.element_counts;
        let mut all = vec![ElementStress::default(); hex_count + tet_count + tet10_count];
        for group in &self.hexes {
            for (&e, stress) in group.elements.iter().zip(group.stresses(at)) {
                all[e as usize] = stress;
            }
        }
        for group in &self.tets {
            for (&e, stress) in group.elements.iter().zip(group.stresses(at)) {
                all[hex_count + e as usize] = stress;
            }
        }
        for group in &self.tets10 {
            for (&e, stress) in group.elements.iter().zip(group.stresses(at)) {
                all[hex_count + tet_count + e as usize] = stress;
            }
        }
        all
    }

    /// External forces on the nodes that are not free, N, as equilibrium requires them; 0 on free and on tied nodes,
    /// whose forces act on their masters.
    pub fn support_forces<'a>(&self, at: impl Into<Deformed<'a>>) -> Vec<Vector3<f64>> {
        let mut forces = self.nodal_forces(at);
        for &(node, tie) in &self.tied {
            let force = std::mem::take(&mut forces[node as usize]);
            for &(master, weight) in self.dofs.masters(tie) {
                forces[master as usize] += force * weight;
            }
        }
        for (force, role) in forces.iter_mut().zip(&self.dofs.role) {
            if matches!(role, Role::Free { .. }) {
                *force = Vector3::zeros();
            }
        }
        forces
    }

    /// Forces that supports must exert on every node, N: the internal force before constraints are applied.
    pub fn nodal_forces<'a>(&self, at: impl Into<Deformed<'a>>) -> Vec<Vector3<f64>> {
        let at = at.into();
        let mut out = vec![Vector3::zeros(); at.at.x.len()];
        for group in &self.hexes {
            group.accumulate(&group.forces(at), &mut out);
        }
        for group in &self.tets {
            group.accumulate(&group.forces(at), &mut out);
        }
        for group in &self.tets10 {
            group.accumulate(&group.forces(at), &mut out);
        }
        out
    }
}
