//! Internal force and consistent tangent of eight elements at a time.
//!
//! Kinematics and element by the mean-dilatation method (Q1P0: Nagtegaal, Parks & Rice 1974; Simo, Taylor &
//! Pister 1985): the volumetric energy of an element is `V U(v/V)` with `V` its undeformed and `v` its
//! deformed volume, the isochoric part is integrated with full quadrature. Both derive from an energy, so
//! the tangent is symmetric.

use nalgebra::Vector3;
use wide::f64x8;

use super::shape::{GAUSS_1D_2, hex8_gradient};

/// The constitutive functions that an element evaluates at eight points.
pub trait Constitutive: Copy + Sync {
    /// Energy per undeformed volume at a point, MPa, without the volumetric part that the element averages.
    fn energy(&self, b: &[f64x8; 6], j: f64x8) -> f64x8;
    /// Kirchhoff stress (xx, yy, zz, xy, yz, xz), MPa, without the averaged volumetric part.
    fn stress(&self, b: &[f64x8; 6], j: f64x8) -> [f64x8; 6];
    /// The same with its spatial moduli.
    fn moduli(&self, b: &[f64x8; 6], j: f64x8) -> ([f64x8; 6], [[f64x8; 6]; 6]);
    /// Volumetric law of the element: energy, slope and curvature over v/V, MPa; zero for laws that are whole at
    /// the point.
    fn volumetric(&self, ratio: f64x8) -> (f64x8, f64x8, f64x8);

    /// Energy at quadrature point `q` with the deformation gradient `f`, for laws with a state of each point.
    #[inline(always)]
    fn energy_at(&self, _q: usize, _f: &Gradient, b: &[f64x8; 6], j: f64x8) -> f64x8 {
        self.energy(b, j)
    }
    /// Stress there.
    #[inline(always)]
    fn stress_at(&self, _q: usize, _f: &Gradient, b: &[f64x8; 6], j: f64x8) -> [f64x8; 6] {
        self.stress(b, j)
    }
    /// Stress and moduli there.
    #[inline(always)]
    fn moduli_at(&self, _q: usize, _f: &Gradient, b: &[f64x8; 6], j: f64x8) -> ([f64x8; 6], [[f64x8; 6]; 6]) {
        self.moduli(b, j)
    }
}

/// Deformation gradient, rows over the current frame.
pub type Gradient = [[f64x8; 3]; 3];

/// A batch of up to eight elements of one material with `N` nodes and `Q` quadrature points.
pub struct Batch<const N: usize, const Q: usize> {
    /// Number of elements, 1 to 8; the other lanes repeat the last one and are to be ignored.
    pub len: usize,
    /// Node indices, per local node and lane.
    pub nodes: [[u32; 8]; N],
    /// Undeformed volume per quadrature point, mm³.
    pub(super) weight: [f64x8; Q],
    /// Shape gradients over undeformed coordinates, 1/mm.
    gradient: Box<[[[f64x8; 3]; N]; Q]>,
    pub(super) volume: f64x8,
    /// Triangles that enclose the deformed volume, local nodes counter-clockwise from outside; none if it is the
    /// integral of det F.
    pub(super) surface: &'static [[usize; 3]],
    hourglass: Option<Box<Hourglass<N>>>,
}

/// Stiffness against the modes without uniform strain: `scale C_1111 gamma_k (gamma_k . u)`.
struct Hourglass<const N: usize> {
    /// Hourglass vectors.
    gamma: [[f64x8; N]; 4],
    /// Length (mm) that makes a stiffness of the modulus.
    scale: f64x8,
    /// Undeformed positions, mm.
    rest: [[f64x8; 3]; N],
}

/// Volume and shape gradients of an element's quadrature points; None if it is inverted.
pub(super) type PointsOf<const N: usize, const Q: usize> = Option<([f64; Q], [[[f64; 3]; N]; Q])>;

/// 8-node hexahedra with 2x2x2 points.
pub type Hex8 = Batch<8, 8>;
/// 4-node tetrahedra with one point.
pub type Tet4 = Batch<4, 1>;

/// Internal forces, shape (node, component) with a lane per element.
pub struct Forces<const N: usize> {
    /// Force that the element exerts against motion of its nodes, N.
    pub force: [[f64x8; 3]; N],
    /// Smallest det F over the quadrature points.
    pub min_j: f64x8,
}

/// Tangent blocks of node pairs.
pub struct Tangent<const N: usize> {
    /// `block[a][b][i][j] = d force_ai / d x_bj`, N/mm, for b <= a only.
    pub block: Box<[[[[f64x8; 3]; 3]; N]; N]>,
}

impl<const N: usize> Tangent<N> {
    /// All zero.
    pub fn new() -> Self {
        let zeros = vec![[[[f64x8::ZERO; 3]; 3]; N]; N].into_boxed_slice();
        let Ok(block) = zeros.try_into() else { unreachable!("length is N") };
        Self { block }
    }
}

impl<const N: usize> Default for Tangent<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl Hex8 {
    /// Batch of hexahedra (VTK order); None if a Jacobian is not positive at a quadrature point.
    pub fn new(elements: &[[u32; 8]], positions: &[Vector3<f64>]) -> Option<Self> {
        let corner = |k: usize| if k == 0 { -GAUSS_1D_2 } else { GAUSS_1D_2 };
        let points: [[f64; 3]; 8] = std::array::from_fn(|q| [corner(q & 1), corner((q >> 1) & 1), corner(q >> 2)]);
        Self::with_rule(elements, positions, points.map(hex8_gradient), 1.0)
    }

    /// The element that CalculiX 2.20 calls C3D8R, for comparisons with CalculiX only: uniform strain with hourglass
    /// control after Flanagan & Belytschko (1981).
    ///
    /// Shape gradients `B_a` are the means over the undeformed element. The hourglass force is `s C_1111 sum_k gamma_k
    /// (gamma_k . u)`, `s = 0.0005 V sum_a |B_a|²`, with the current Lagrangian modulus, which is mostly the bulk
    /// modulus: nearly incompressible tissue gets a lot of it. The paper's hourglass vectors are `gamma_k = Gamma_k −
    /// sum_i (Gamma_k . X_i) B_i`; CalculiX keeps the term i = z alone, so that its vectors respond to homogeneous
    /// strains too unless the element is a parallelepiped. The vectors here do the same. With the whole sum the normal
    /// force of the coarse fingertips is 0.2 to 1 % below CalculiX's, as it is here within 0.05 %.
    ///
    /// The hourglass force is left out of the energy, and its modulus's derivative out of the tangent.
    pub fn uniform_strain(elements: &[[u32; 8]], positions: &[Vector3<f64>]) -> Option<Self> {
        let mut batch = Self::new(elements, positions)?;
        let mut mean = [[f64x8::ZERO; 3]; 8];
        for q in 0..8 {
            for a in 0..8 {
                for i in 0..3 {
                    mean[a][i] += batch.gradient[q][a][i] * batch.weight[q];
                }
            }
        }
        let squares: f64x8 = mean.iter().flatten().fold(f64x8::ZERO, |sum, m| sum + *m * *m);
        let mean = mean.map(|node| node.map(|m| m / batch.volume));
        let x = batch.gather(positions);
        let sign = |a: usize, k: usize| {
            let [r, s, t] = [[-1, 1, 1, -1, -1, 1, 1, -1], [-1, -1, 1, 1, -1, -1, 1, 1], [-1, -1, -1, -1, 1, 1, 1, 1]]
                .map(|corners: [i32; 8]| corners[a]);
            f64x8::splat(f64::from([s * t, r * t, r * s, r * s * t][k]))
        };
        let gamma: [[f64x8; 8]; 4] = std::array::from_fn(|k| {
            let along_z = (0..8).fold(f64x8::ZERO, |sum, b| sum + x[b][2] * sign(b, k));
            std::array::from_fn(|a| sign(a, k) - mean[a][2] * along_z)
        });
        let scale = f64x8::splat(0.0005) * squares / batch.volume;
        batch.hourglass = Some(Box::new(Hourglass { gamma, scale, rest: x }));
        *batch.gradient = [mean; 8];
        batch.weight = [batch.volume * f64x8::splat(0.125); 8];
        Some(batch)
    }
}

impl Tet4 {
    /// Batch of tetrahedra; None if a volume is not positive.
    pub fn new(elements: &[[u32; 4]], positions: &[Vector3<f64>]) -> Option<Self> {
        let gradient = [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Self::with_rule(elements, positions, [gradient], 1.0 / 6.0)
    }
}

impl<const N: usize, const Q: usize> Batch<N, Q> {
    /// Batch of elements whose shape gradients at the reference points are `reference`.
    fn with_rule(
        elements: &[[u32; N]],
        positions: &[Vector3<f64>],
        reference: [[[f64; 3]; N]; Q],
        reference_weight: f64,
    ) -> Option<Self> {
        Self::with_points(elements, |nodes| {
            let (mut weights, mut gradients) = ([0.0; Q], [[[0.0; 3]; N]; Q]);
            for q in 0..Q {
                let mut jacobian = nalgebra::Matrix3::zeros();
                for (a, node) in nodes.iter().enumerate() {
                    jacobian += positions[*node as usize] * nalgebra::RowVector3::from(reference[q][a]);
                }
                let det = jacobian.determinant();
                if !(det > 0.0) {
                    return None;
                }
                let inverse = jacobian.try_inverse()?;
                weights[q] = det * reference_weight;
                gradients[q] = reference[q].map(|g| (nalgebra::RowVector3::from(g) * inverse).into());
            }
            Some((weights, gradients))
        })
    }

    /// Batch of elements of whose nodes `points` makes the volume (mm³) and the shape gradients (1/mm) of every
    /// quadrature point; None if it gives None for any of them.
    pub(super) fn with_points(elements: &[[u32; N]], points: impl Fn(&[u32; N]) -> PointsOf<N, Q>) -> Option<Self> {
        assert!((1..=8).contains(&elements.len()));
        let lane_of = |lane: usize| &elements[lane.min(elements.len() - 1)];
        let nodes: [[u32; 8]; N] = std::array::from_fn(|a| std::array::from_fn(|lane| lane_of(lane)[a]));
        let mut weight = [[0.0; 8]; Q];
        let mut gradient = vec![[[[0.0; 8]; 3]; N]; Q];
        for lane in 0..8 {
            let (weights, gradients) = points(lane_of(lane))?;
            for q in 0..Q {
                weight[q][lane] = weights[q];
                for a in 0..N {
                    for i in 0..3 {
                        gradient[q][a][i][lane] = gradients[q][a][i];
                    }
                }
            }
        }
        let gradient: Vec<[[f64x8; 3]; N]> =
            gradient.into_iter().map(|point| point.map(|node| node.map(f64x8::new))).collect();
        let Ok(gradient) = gradient.into_boxed_slice().try_into() else { unreachable!("length is Q") };
        let weight = weight.map(f64x8::new);
        let volume = weight.into_iter().fold(f64x8::ZERO, |sum, w| sum + w);
        Some(Self { len: elements.len(), nodes, weight, gradient, volume, surface: &[], hourglass: None })
    }

    /// Undeformed volumes, mm³.
    pub fn volumes(&self) -> [f64; 8] {
        self.volume.to_array()
    }

    pub(super) fn gather(&self, positions: &[Vector3<f64>]) -> [[f64x8; 3]; N] {
        std::array::from_fn(|a| {
            let mut lanes = [[0.0; 8]; 3];
            for (lane, node) in self.nodes[a].iter().enumerate() {
                let x = &positions[*node as usize];
                for i in 0..3 {
                    lanes[i][lane] = x[i];
                }
            }
            lanes.map(f64x8::new)
        })
    }

    /// Deformation at a point: F, det F and the spatial shape gradients `F^-T dN/dX`.
    #[inline(always)]
    pub(super) fn kinematics(&self, q: usize, x: &[[f64x8; 3]; N]) -> ([[f64x8; 3]; 3], f64x8, [[f64x8; 3]; N]) {
        let mut f = [[f64x8::ZERO; 3]; 3];
        for a in 0..N {
            for i in 0..3 {
                for k in 0..3 {
                    f[i][k] = x[a][i].mul_add(self.gradient[q][a][k], f[i][k]);
                }
            }
        }
        let cofactor = |i: usize, k: usize| {
            let (i1, i2, k1, k2) = ((i + 1) % 3, (i + 2) % 3, (k + 1) % 3, (k + 2) % 3);
            f[i1][k1] * f[i2][k2] - f[i1][k2] * f[i2][k1]
        };
        let co: [[f64x8; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|k| cofactor(i, k)));
        let j = f[0][0] * co[0][0] + f[0][1] * co[0][1] + f[0][2] * co[0][2];
        let inv_j = f64x8::ONE / j;
        let mut spatial = [[f64x8::ZERO; 3]; N];
        for a in 0..N {
            for i in 0..3 {
                let g = &self.gradient[q][a];
                spatial[a][i] = (co[i][0] * g[0] + co[i][1] * g[1] + co[i][2] * g[2]) * inv_j;
            }
        }
        (f, j, spatial)
    }

    /// Internal forces at current `positions` (mm, all nodes of the mesh).
    ///
    /// A lane whose `min_j` is not positive has meaningless forces.
    pub fn forces(&self, law: &impl Constitutive, positions: &[Vector3<f64>]) -> Forces<N> {
        let x = self.gather(positions);
        let mut force = [[f64x8::ZERO; 3]; N];
        let mut volume_slope = [[f64x8::ZERO; 3]; N];
        let (mut v, mut min_j) = (f64x8::ZERO, f64x8::splat(f64::INFINITY));
        for q in 0..Q {
            let (f, j, g) = self.kinematics(q, &x);
            min_j = min_j.fast_min(j);
            let tau = law.stress_at(q, &f, &left_cauchy_green(&f), j);
            let w = self.weight[q];
            let wj = w * j;
            v += wj;
            for a in 0..N {
                for i in 0..3 {
                    let t = tau[INDEX[i][0]] * g[a][0] + tau[INDEX[i][1]] * g[a][1] + tau[INDEX[i][2]] * g[a][2];
                    force[a][i] = t.mul_add(w, force[a][i]);
                    volume_slope[a][i] = g[a][i].mul_add(wj, volume_slope[a][i]);
                }
            }
        }
        if !self.surface.is_empty() {
            (v, volume_slope) = self.enclosed(&x);
        }
        let (_, p, _) = law.volumetric(v / self.volume);
        for a in 0..N {
            for i in 0..3 {
                force[a][i] = volume_slope[a][i].mul_add(p, force[a][i]);
            }
        }
        if let Some(hourglass) = &self.hourglass {
            let stiffness = self.hourglass_stiffness(law, hourglass, &x);
            for gamma in &hourglass.gamma {
                for i in 0..3 {
                    let mode = (0..N).fold(f64x8::ZERO, |sum, a| sum + gamma[a] * (x[a][i] - hourglass.rest[a][i]))
                        * stiffness;
                    for a in 0..N {
                        force[a][i] = gamma[a].mul_add(mode, force[a][i]);
                    }
                }
            }
        }
        Forces { force, min_j }
    }

    /// `scale C_1111`, N/mm, with the current derivative of the second Piola-Kirchhoff stress over Green's strain.
    fn hourglass_stiffness(&self, law: &impl Constitutive, hourglass: &Hourglass<N>, x: &[[f64x8; 3]; N]) -> f64x8 {
        let (f, j, _) = self.kinematics(0, x);
        let (_, c) = law.moduli(&left_cauchy_green(&f), j);
        // First row of the inverse of F, and with it the pull-back of the moduli.
        let v: [f64x8; 3] = std::array::from_fn(|k| {
            let (k1, k2) = ((k + 1) % 3, (k + 2) % 3);
            (f[k1][1] * f[k2][2] - f[k1][2] * f[k2][1]) / j
        });
        let two = f64x8::splat(2.0);
        let d = [v[0] * v[0], v[1] * v[1], v[2] * v[2], two * v[0] * v[1], two * v[1] * v[2], two * v[0] * v[2]];
        let mut modulus = f64x8::ZERO;
        for r in 0..6 {
            for s in 0..6 {
                modulus += d[r] * c[r][s] * d[s];
            }
        }
        // The volumetric part: (p J + J² U'' − 2 p J) (C^-1_11)².
        let (_, p, curvature) = law.volumetric(j);
        let length = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        (modulus + (j * j * curvature - p * j) * length * length) * hourglass.scale
    }

    /// Calls `visit` with the number of every quadrature point, F, `F F^T` and det F.
    pub fn for_points(&self, positions: &[Vector3<f64>], mut visit: impl FnMut(usize, &Gradient, &[f64x8; 6], f64x8)) {
        let x = self.gather(positions);
        for q in 0..Q {
            let (f, j, _) = self.kinematics(q, &x);
            visit(q, &f, &left_cauchy_green(&f), j);
        }
    }

    /// Strain energy of each element, mJ.
    pub fn energies(&self, law: &impl Constitutive, positions: &[Vector3<f64>]) -> [f64; 8] {
        let x = self.gather(positions);
        let (mut energy, mut v) = (f64x8::ZERO, f64x8::ZERO);
        for q in 0..Q {
            let (f, j, _) = self.kinematics(q, &x);
            energy += self.weight[q] * law.energy_at(q, &f, &left_cauchy_green(&f), j);
            v += self.weight[q] * j;
        }
        if !self.surface.is_empty() {
            v = self.enclosed(&x).0;
        }
        (energy + law.volumetric(v / self.volume).0 * self.volume).to_array()
    }

    /// Consistent tangent at current `positions`; overwrites `out`.
    pub fn tangent(&self, law: &impl Constitutive, positions: &[Vector3<f64>], out: &mut Tangent<N>) {
        let x = self.gather(positions);
        let mut volume_slope = [[f64x8::ZERO; 3]; N];
        let mut v = f64x8::ZERO;
        for q in 0..Q {
            let (_, j, g) = self.kinematics(q, &x);
            let wj = self.weight[q] * j;
            v += wj;
            for a in 0..N {
                for i in 0..3 {
                    volume_slope[a][i] = g[a][i].mul_add(wj, volume_slope[a][i]);
                }
            }
        }
        if !self.surface.is_empty() {
            (v, volume_slope) = self.enclosed(&x);
        }
        let (_, p, curvature) = law.volumetric(v / self.volume);
        let curvature = curvature / self.volume;
        for a in 0..N {
            let left = volume_slope[a].map(|s| s * curvature);
            for b in 0..=a {
                for i in 0..3 {
                    for k in 0..3 {
                        out.block[a][b][i][k] = left[i] * volume_slope[b][k];
                    }
                }
            }
        }
        let point_pressure = if self.surface.is_empty() { p } else { f64x8::ZERO };
        self.add_curvature_of_enclosed(&x, p, out);
        for q in 0..Q {
            let (f, j, g) = self.kinematics(q, &x);
            let (mut tau, mut c) = law.moduli_at(q, &f, &left_cauchy_green(&f), j);
            // The averaged pressure as a Kirchhoff stress p J I with moduli p J (I x I - 2 sym).
            let pj = point_pressure * j;
            for i in 0..3 {
                tau[i] += pj;
                for k in 0..3 {
                    if i == k {
                        c[i][k] -= pj;
                    } else {
                        c[i][k] += pj;
                    }
                }
                c[3 + i][3 + i] -= pj;
            }
            let w = self.weight[q];
            let tau = tau.map(|t| t * w);
            for row in &mut c {
                for entry in row {
                    *entry *= w;
                }
            }
            for b in 0..N {
                let gb = &g[b];
                // c : (shape gradient of b), six components by three directions.
                let mut cb = [[f64x8::ZERO; 3]; 6];
                for row in 0..6 {
                    for k in 0..3 {
                        cb[row][k] =
                            c[row][INDEX[k][0]] * gb[0] + c[row][INDEX[k][1]] * gb[1] + c[row][INDEX[k][2]] * gb[2];
                    }
                }
                let tb: [f64x8; 3] = std::array::from_fn(|i| {
                    tau[INDEX[i][0]] * gb[0] + tau[INDEX[i][1]] * gb[1] + tau[INDEX[i][2]] * gb[2]
                });
                for a in b..N {
                    let ga = &g[a];
                    let geometric = ga[0] * tb[0] + ga[1] * tb[1] + ga[2] * tb[2];
                    let block = &mut out.block[a][b];
                    for i in 0..3 {
                        for k in 0..3 {
                            let mut sum = block[i][k];
                            sum = ga[0].mul_add(cb[INDEX[i][0]][k], sum);
                            sum = ga[1].mul_add(cb[INDEX[i][1]][k], sum);
                            sum = ga[2].mul_add(cb[INDEX[i][2]][k], sum);
                            if i == k {
                                sum += geometric;
                            }
                            block[i][k] = sum;
                        }
                    }
                }
            }
        }
        if let Some(hourglass) = &self.hourglass {
            let stiffness = self.hourglass_stiffness(law, hourglass, &x);
            for a in 0..N {
                for b in 0..=a {
                    let sum = hourglass.gamma.iter().fold(f64x8::ZERO, |sum, g| sum + g[a] * g[b]) * stiffness;
                    for i in 0..3 {
                        out.block[a][b][i][i] += sum;
                    }
                }
            }
        }
    }
}

/// Place of component (i, j) in the six-component order.
const INDEX: [[usize; 3]; 3] = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];

#[inline(always)]
pub(super) fn left_cauchy_green(f: &[[f64x8; 3]; 3]) -> [f64x8; 6] {
    let dot = |i: usize, j: usize| f[i][0] * f[j][0] + f[i][1] * f[j][1] + f[i][2] * f[j][2];
    [dot(0, 0), dot(1, 1), dot(2, 2), dot(0, 1), dot(1, 2), dot(0, 2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Ogden;

    const LAW: Ogden = Ogden { mu_mpa: 0.034, alpha: 1.4, d_per_mpa: 1.0 };
    const SIDES: [f64; 3] = [1.0, 1.5, 0.5];

    fn brick() -> Vec<Vector3<f64>> {
        let corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
        corners.iter().map(|c| Vector3::from_fn(|i, _| f64::from(c[i]) * SIDES[i])).collect()
    }

    fn lane(forces: &Forces<8>) -> Vec<f64> {
        forces.force.iter().flatten().map(|f| f.to_array()[0]).collect()
    }

    #[test]
    fn uniform_strain_is_mean_dilatation_where_the_strain_is_uniform() {
        let nodes = brick();
        let connectivity = [[0, 1, 2, 3, 4, 5, 6, 7]];
        let shear = nalgebra::Matrix3::new(1.2, 0.1, 0.0, -0.2, 0.9, 0.3, 0.1, 0.0, 0.8);
        let moved: Vec<_> = nodes.iter().map(|x| shear * x).collect();
        let [one, other] = [Hex8::new(&connectivity, &nodes), Hex8::uniform_strain(&connectivity, &nodes)]
            .map(|batch| lane(&batch.unwrap().forces(&LAW, &moved)));
        for (a, b) in one.iter().zip(&other) {
            assert!((a - b).abs() < 1e-14, "{a} {b}");
        }
    }

    #[test]
    fn an_hourglass_mode_meets_the_published_stiffness_and_its_tangent() {
        let nodes = brick();
        let batch = Hex8::uniform_strain(&[[0, 1, 2, 3, 4, 5, 6, 7]], &nodes).unwrap();
        // Gamma = xi eta in x.
        let mode = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0];
        let amplitude = 1e-2;
        let mut moved = nodes.clone();
        for (x, sign) in moved.iter_mut().zip(mode) {
            x.x += amplitude * sign;
        }
        let force = lane(&batch.forces(&LAW, &moved));
        let volume: f64 = SIDES.iter().product();
        let gradients: f64 = SIDES.iter().map(|side| 0.5 / (side * side)).sum();
        let modulus = 2.0 / LAW.d_per_mpa + 4.0 / 3.0 * LAW.mu_mpa;
        let expected = 0.0005 * volume * gradients * modulus * 8.0 * amplitude;
        let mut tangent = Tangent::new();
        batch.tangent(&LAW, &nodes, &mut tangent);
        for a in 0..8 {
            assert!((force[3 * a] - expected * mode[a]).abs() < 1e-9 * expected, "{} {expected}", force[3 * a]);
            let row: f64 =
                (0..8).map(|b| tangent.block[a.max(b)][a.min(b)][0][0].to_array()[0] * mode[b] * amplitude).sum();
            assert!((row - expected * mode[a]).abs() < 1e-9 * expected, "{row} {expected}");
        }
    }
}
