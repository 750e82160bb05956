//! A soft paraboloid under a fixed top, half of it by symmetry (y >= 0): small enough for long histories.

use fingerpad_fe::assembly::{Body, BodyError, Joint, Material, Supports};
use fingerpad_fe::material::Ogden;
use fingerpad_fe::mesh::{
    Mesh,
    block::{coordinates, curved_block},
};
use nalgebra::Vector3;

use super::sphere::outward;

/// Radius of curvature, mm.
const CURVATURE_MM: f64 = 8.0;
/// Half width and height, mm.
const EXTENT_MM: f64 = 5.0;
/// Half width of the evenly meshed zone, mm.
const EVEN_MM: f64 = 2.4;

/// Mesh and body.
pub struct Dome {
    /// Mesh.
    pub mesh: Mesh,
    /// Body.
    pub body: Body,
}

impl Dome {
    /// A dome with elements of `size_mm` under the contact; shear modulus 0.02 MPa, nu 0.49.
    ///
    /// # Errors
    /// [`BodyError`] for an inverted mesh.
    pub fn new(size_mm: f64) -> Result<Self, BodyError> {
        let even = (EVEN_MM / size_mm).round() as usize;
        let mut arm = coordinates(0.0, EVEN_MM, even, 1.0);
        arm.extend(outward(EVEN_MM, EXTENT_MM, size_mm, 1.4).into_iter().skip(1));
        let mut xs: Vec<f64> = arm.iter().skip(1).rev().map(|x| -x).collect();
        xs.extend(&arm);
        let up = outward(0.0, EXTENT_MM, size_mm, 1.3);
        let mut mesh = curved_block(&xs, &arm, &up, |p| {
            p + Vector3::z() * ((p.x * p.x + p.y * p.y) / (2.0 * CURVATURE_MM) * (1.0 - p.z / EXTENT_MM))
        });
        mesh.pad_faces.retain(|face| {
            face.iter().all(|&n| {
                let x = mesh.nodes[n as usize];
                x.xy().norm() < 1.7 * EVEN_MM
            })
        });
        let mut contact: Vec<u32> = mesh.pad_faces.iter().flatten().copied().collect();
        contact.sort_unstable();
        contact.dedup();
        let supports = Supports {
            fixed: mesh.node_set("z1").to_vec(),
            fixed_components: mesh.node_set("y0").iter().map(|&n| (n, 1)).collect(),
            contact,
            ..Default::default()
        };
        let law = Ogden { mu_mpa: 0.02, alpha: 2.0, d_per_mpa: 2.0 };
        let body = Body::new(&mesh, |_| Some(Material::Ogden(law)), &supports, Vector3::zeros(), Joint::default())?;
        Ok(Self { mesh, body })
    }
}
