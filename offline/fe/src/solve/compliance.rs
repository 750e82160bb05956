//! The compliance of the skin at rest: how nodes that may touch move under forces on each other, to first order.

use nalgebra::DMatrix;

use super::linear::{Factor, NotPositiveDefinite};
use crate::assembly::Body;

/// Linear compliance of a body about its undeformed shape.
///
/// It gives a surrogate of the pad: one factorisation in place of many runs.
#[derive(Clone, Debug)]
pub struct RestCompliance {
    /// Mesh nodes that may touch and are free, in the order of the rows.
    pub nodes: Vec<u32>,
    /// Symmetric matrix: displacements (mm) of these nodes along x, y and z over the forces (N) on them and, in the
    /// last six rows and columns if [`Self::bone_is_free`], translation (mm) and rotation vector (rad) of the free bone
    /// about its reference point over the force (N) and moment (N mm) on it.
    pub matrix: DMatrix<f64>,
    /// Whether a rigid bone moves; without one there are no rows for it.
    pub bone_is_free: bool,
}

impl RestCompliance {
    /// The compliance of `body`, in double precision: one factorisation, and a solve of the dense contact part for each dof.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] for a body that nothing holds.
    pub fn of(body: &Body) -> Result<Self, NotPositiveDefinite> {
        let dofs = &body.dofs;
        let (first, count) = (dofs.first_contact_dof, dofs.count);
        let contact = count - first;
        let mut values = Vec::new();
        body.tangent(body.undeformed(), &mut values);
        let mut factor = Factor::analyse(&dofs.pattern, contact);
        factor.use_double_precision();
        // No dense compliance beside this one.
        factor.set_compliant_from(contact);
        factor.factorise(&dofs.pattern, &values)?;
        let bone = dofs.rigid_dof();
        let size = contact + if bone.is_some() { 6 } else { 0 };
        let mut matrix = DMatrix::zeros(size, size);
        for k in 0..contact {
            let mut column = vec![0.0; contact];
            column[k] = 1.0;
            factor.contact_forward(&mut column);
            factor.contact_backward(&mut column);
            matrix.view_mut((0, k), (contact, 1)).copy_from_slice(&column);
        }
        for (k, dof) in bone.iter().flat_map(|bone| *bone..*bone + 6).enumerate() {
            let mut moved = vec![0.0; count];
            moved[dof] = 1.0;
            factor.forward(&mut moved);
            factor.backward(&mut moved);
            let of_bone = dof - k;
            for row in 0..contact {
                matrix[(row, contact + k)] = moved[first + row];
                matrix[(contact + k, row)] = moved[first + row];
            }
            for row in 0..6 {
                matrix[(contact + row, contact + k)] = moved[of_bone + row];
            }
        }
        // Held dofs do not move, whatever the factor has in their place.
        for &dof in &dofs.held {
            let row = if dof >= first {
                Some(dof - first)
            } else {
                bone.filter(|b| (*b..*b + 6).contains(&dof)).map(|b| contact + dof - b)
            };
            if let Some(row) = row {
                matrix.row_mut(row).fill(0.0);
                matrix.column_mut(row).fill(0.0);
            }
        }
        let matrix = 0.5 * (&matrix + matrix.transpose());
        Ok(Self { nodes: dofs.contact_nodes.clone(), matrix, bone_is_free: bone.is_some() })
    }
}
