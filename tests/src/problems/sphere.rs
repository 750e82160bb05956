//! A paraboloid on the plane in a graded block with the exact far field of the half-space on its outer boundary.
//!
//! The contact radius is 1 mm, the curvature hundreds of them, so that everything is linear; symmetry planes reduce it
//! to a quarter (normal load), a half (tangential load along x) or not at all (spin).

use fingerpad_fe::assembly::{Body, BodyError, Configuration, Joint, Material, Supports};
use fingerpad_fe::contact::{Coordinates, Friction, PenaltySettings};
use fingerpad_fe::material::Ogden;
use fingerpad_fe::mesh::{
    Mesh,
    block::{block, coordinates, into_second_order, into_tets},
};
use fingerpad_fe::solve::{Guess, PadFaces, SolveError, Solver, SolverSettings, State, Stats, Target, unwatched};
use nalgebra::Vector3;

use crate::half_space::{HalfSpace, Hertz, PointLoads};

/// Which part of the body is meshed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// x >= 0, y >= 0.
    Quarter,
    /// y >= 0.
    Half,
    /// All of it: spin has no plane of symmetry.
    Whole,
}

/// Elements of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Elements {
    /// Hexahedra.
    Hexes,
    /// 10-node tetrahedra, six in the place of eight hexahedra, with the same nodes.
    Tets,
}

/// Size and mesh of the block; lengths in contact radii.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// The meshed part.
    pub part: Part,
    /// Elements.
    pub elements: Elements,
    /// Distances between nodes per contact radius under the contact.
    pub per_radius: usize,
    /// Half width and height of the block.
    pub extent: f64,
    /// Growth of the elements outward.
    pub growth: f64,
}

/// The body with its analytic contact.
pub struct Sphere {
    /// Analytic contact.
    pub hertz: Hertz,
    /// Mesh.
    pub mesh: Mesh,
    /// Body.
    pub body: Body,
    /// Quadrilaterals that may touch.
    quads: Vec<[u32; 4]>,
    /// Triangles that may touch.
    triangles: Vec<[u32; 3]>,
    /// Nodes of the outer boundary with their places in the half-space.
    boundary: Vec<(u32, Vector3<f64>)>,
    /// Number of meshed parts in the whole.
    pub copies: f64,
}

/// Half-width, in contact radii, of the evenly meshed zone.
const EVEN: f64 = 1.2;

impl Sphere {
    /// A sphere of `poisson`, shear modulus 1 MPa, contact radius 1 mm and curvature `curvature_mm`.
    ///
    /// # Errors
    /// [`BodyError`] for an inverted mesh.
    pub fn new(layout: &Layout, poisson: f64, curvature_mm: f64) -> Result<Self, BodyError> {
        Self::sharing(layout, poisson, curvature_mm, [1.0; 2])
    }

    /// The same with a body that has only `share` of the curvature along x and along y; the rigid body has the rest.
    ///
    /// # Errors
    /// [`BodyError`] for an inverted mesh.
    pub fn sharing(layout: &Layout, poisson: f64, curvature_mm: f64, share: [f64; 2]) -> Result<Self, BodyError> {
        let half_space = HalfSpace { shear_mpa: 1.0, poisson };
        let hertz = Hertz { half_space, curvature_mm, radius_mm: 1.0 };
        // A cell of six tetrahedra has nodes half-way.
        let h = if layout.elements == Elements::Hexes { 1.0 } else { 2.0 } / layout.per_radius as f64;
        let even = (EVEN / h).round() as usize;
        let mut arm = coordinates(0.0, even as f64 * h, even, 1.0);
        arm.extend(outward(even as f64 * h, layout.extent, h, layout.growth).into_iter().skip(1));
        let mut whole: Vec<f64> = arm.iter().skip(1).rev().map(|x| -x).collect();
        whole.extend(&arm);
        let up = outward(0.0, layout.extent, h, layout.growth);
        let (xs, ys) = match layout.part {
            Part::Quarter => (&arm, &arm),
            Part::Half => (&whole, &arm),
            Part::Whole => (&whole, &whole),
        };
        let height = layout.extent;
        let flat = match layout.elements {
            Elements::Hexes => block(xs, ys, &up),
            Elements::Tets => into_second_order(&into_tets(&block(xs, ys, &up))),
        };
        let mut mesh = flat.clone();
        for p in &mut mesh.nodes {
            p.z += (share[0] * p.x * p.x + share[1] * p.y * p.y) / (2.0 * curvature_mm) * (1.0 - p.z / height);
        }
        let (cut, outer): (&[(&str, usize)], &[&str]) = match layout.part {
            Part::Quarter => (&[("y0", 1), ("x0", 0)], &["x1", "y1", "z1"]),
            Part::Half => (&[("y0", 1)], &["x0", "x1", "y1", "z1"]),
            Part::Whole => (&[], &["x0", "x1", "y0", "y1", "z1"]),
        };
        let mut fixed: Vec<u32> = outer.iter().flat_map(|name| mesh.node_set(name)).copied().collect();
        fixed.sort_unstable();
        fixed.dedup();
        let held =
            |&(name, axis): &(&str, usize)| mesh.node_set(name).iter().map(move |&n| (n, axis)).collect::<Vec<_>>();
        let fixed_components: Vec<(u32, usize)> = cut.iter().flat_map(held).collect();
        let near = |face: &[u32]| {
            face.iter().any(|&n| mesh.nodes[n as usize].xy().norm() < 0.5 * (1.0 + EVEN))
                && face.iter().all(|&n| mesh.nodes[n as usize].xy().amax() < EVEN + 0.5 * h)
        };
        let quads: Vec<[u32; 4]> = mesh.pad_faces.iter().filter(|f| near(&f[..])).copied().collect();
        let triangles: Vec<[u32; 3]> = mesh.pad_triangles.iter().filter(|f| near(&f[..])).copied().collect();
        let mut contact: Vec<u32> = quads.iter().flatten().chain(triangles.iter().flatten()).copied().collect();
        contact.sort_unstable();
        contact.dedup();
        let bulk = 2.0 * half_space.shear_mpa * (1.0 + poisson) / (3.0 * (1.0 - 2.0 * poisson));
        let law = Ogden { mu_mpa: half_space.shear_mpa, alpha: 2.0, d_per_mpa: 2.0 / bulk };
        let boundary = fixed.iter().map(|&n| (n, flat.nodes[n as usize])).collect();
        let supports = Supports { fixed, fixed_components, contact, ..Default::default() };
        let body = Body::new(&mesh, |_| Some(Material::Ogden(law)), &supports, Vector3::zeros(), Joint::default())?;
        let copies = f64::from(1u8 << cut.len());
        Ok(Self { hertz, mesh, body, quads, triangles, boundary, copies })
    }

    /// A penalty whose largest penetration is `share` of the approach.
    pub fn penalty(&self, share: f64) -> PenaltySettings {
        PenaltySettings {
            penalty_mpa_per_mm: self.hertz.peak_mpa() / (share * self.hertz.approach_mm()),
            augment: false,
            ..Default::default()
        }
    }

    /// Solver without friction.
    pub fn solver(&self, penalty: PenaltySettings) -> Solver<'_> {
        let pad = PadFaces { quads: &self.quads, triangles: &self.triangles };
        Solver::new(&self.body, pad, Friction::Off, penalty, SolverSettings::default())
    }

    /// `from` with the boundary displaced by `loads`.
    pub fn placed(&self, from: &Configuration, loads: &PointLoads) -> Configuration {
        let mut next = from.clone();
        for &(node, place) in &self.boundary {
            let n = node as usize;
            next.x[n] = self.mesh.nodes[n] + loads.displacement_mm(&self.hertz.half_space, place);
        }
        next
    }

    /// The Hertz contact, pressed in one increment.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn press(&self, solver: &mut Solver) -> Result<State, SolveError> {
        let start = solver.initial_state([0.0; 3]);
        self.step(solver, &start, [0.0, 0.0, self.hertz.approach_mm(), 0.0, 0.0, 0.0], &PointLoads::hertz(&self.hertz))
    }

    /// One increment to the plane's coordinates `to` under the far field of `loads`.
    ///
    /// # Errors
    /// [`SolveError`].
    pub fn step(
        &self,
        solver: &mut Solver,
        from: &State,
        to: Coordinates,
        loads: &PointLoads,
    ) -> Result<State, SolveError> {
        let plane = from.contact.plane.moved_to(to);
        let guess = Guess { configuration: self.placed(&from.configuration, loads), plane, follows_plane: false };
        solver.step(from, Target::place(to), guess, &mut Stats::default(), &mut unwatched)
    }

    /// Radius of a disc of the contact's area, mm.
    pub fn area_radius_mm(&self, solver: &Solver, state: &State) -> f64 {
        let area: f64 = solver.surface().contact_areas(&state.contact).iter().map(|a| a[0]).sum();
        (self.copies * area / std::f64::consts::PI).sqrt()
    }

    /// Radius of a disc of the stuck area, mm.
    pub fn stick_radius_mm(&self, state: &State) -> f64 {
        (self.copies * state.totals.stuck_area / std::f64::consts::PI).sqrt()
    }
}

/// Coordinates from `from` to `to`, the first step about `h`, each about `growth` times the one before.
pub(crate) fn outward(from: f64, to: f64, h: f64, growth: f64) -> Vec<f64> {
    let count = ((1.0 + (to - from) * (growth - 1.0) / h).ln() / growth.ln()).ceil() as usize;
    // Growth at which the first step is h exactly.
    let length = |g: f64| h * (g.powi(count as i32) - 1.0) / (g - 1.0);
    let (mut low, mut high) = (1.0 + 1e-9, growth);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if length(middle) < to - from { low = middle } else { high = middle }
    }
    coordinates(from, to, count, 0.5 * (low + high))
}
