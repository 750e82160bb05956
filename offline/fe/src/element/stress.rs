//! Mean stress and strain of elements, for output.

use nalgebra::Vector3;
use wide::f64x8;

use super::kernel::{Batch, Constitutive, left_cauchy_green};

/// Mean stress and strain of one element; components xx, yy, zz, xy, yz, xz (VTK's order of symmetric tensors).
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ElementStress {
    /// Cauchy stress, MPa, tension positive, in the current frame: mean over the deformed volume.
    pub cauchy_mpa: [f64; 6],
    /// Green-Lagrange strain `(F^T F - I)/2`, in the undeformed frame: mean over the undeformed volume. Shear components
    /// are those of the tensor, half the engineering shear.
    pub green_lagrange: [f64; 6],
}

impl ElementStress {
    /// The stress, or that of the mirror image about y = 0.
    #[must_use]
    pub fn mirrored_if(self, is_mirrored: bool) -> Self {
        if is_mirrored { self.mirrored() } else { self }
    }

    /// The stress of the mirror image about y = 0.
    fn mirrored(self) -> Self {
        let mirror = |[xx, yy, zz, xy, yz, xz]: [f64; 6]| [xx, yy, zz, -xy, -yz, xz];
        Self { cauchy_mpa: mirror(self.cauchy_mpa), green_lagrange: mirror(self.green_lagrange) }
    }

    /// Equivalent stress after von Mises, MPa: the axial stress of a bar that has the same distortion.
    pub fn von_mises_mpa(&self) -> f64 {
        let [xx, yy, zz, xy, yz, xz] = self.cauchy_mpa;
        let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
        (0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
    }

    /// Minus the mean normal stress, MPa: compression positive.
    pub fn mean_pressure_mpa(&self) -> f64 {
        -(self.cauchy_mpa[0] + self.cauchy_mpa[1] + self.cauchy_mpa[2]) / 3.0
    }
}

impl<const N: usize, const Q: usize> Batch<N, Q> {
    /// Mean stress and strain of each element at current `positions` (mm, all nodes of the mesh).
    ///
    /// The stress is that which makes the nodal forces, the averaged volumetric part included, so that
    /// `v sigma = sum_a f_a x_a^T` with the deformed volume `v` (theorem of the mean stress, Chadwick 1976). Hourglass
    /// forces are left out.
    pub fn stresses(&self, law: &impl Constitutive, positions: &[Vector3<f64>]) -> [ElementStress; 8] {
        let x = self.gather(positions);
        let mut stress = [f64x8::ZERO; 6];
        let mut strain = [f64x8::ZERO; 6];
        let mut deformed_volume = f64x8::ZERO;
        for q in 0..Q {
            let (f, j, _) = self.kinematics(q, &x);
            let weight = self.weight[q];
            deformed_volume += weight * j;
            let tau = law.stress_at(q, &f, &left_cauchy_green(&f), j);
            // The right Cauchy-Green tensor is the left one of the transpose.
            let transpose: [[f64x8; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|k| f[k][i]));
            let c = left_cauchy_green(&transpose);
            for k in 0..6 {
                let identity = if k < 3 { f64x8::ONE } else { f64x8::ZERO };
                stress[k] += tau[k] * weight;
                strain[k] += (c[k] - identity) * f64x8::HALF * weight;
            }
        }
        if !self.surface.is_empty() {
            deformed_volume = self.enclosed(&x).0;
        }
        let (_, pressure, _) = law.volumetric(deformed_volume / self.volume);
        let cauchy: [[f64; 8]; 6] = std::array::from_fn(|k| {
            let volumetric = if k < 3 { pressure } else { f64x8::ZERO };
            (stress[k] / deformed_volume + volumetric).to_array()
        });
        let green_lagrange = strain.map(|e| (e / self.volume).to_array());
        std::array::from_fn(|lane| ElementStress {
            cauchy_mpa: cauchy.map(|lanes| lanes[lane]),
            green_lagrange: green_lagrange.map(|lanes| lanes[lane]),
        })
    }
}
