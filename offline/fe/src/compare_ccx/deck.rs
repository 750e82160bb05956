//! One problem (mesh, materials, contact with a rigid plane or sphere, steps) as a CalculiX deck.
//!
//! CalculiX takes numbers of up to 20 characters, hence `{:.12e}` throughout.

use std::collections::BTreeMap;
use std::fmt::Write;

use nalgebra::Vector3;

use super::Error;
use crate::contact::RigidBody;
use crate::material::{Hyperelastic, Material};
use crate::mesh::{Mesh, Region, set};
use fingerpad_formats::inp;

/// Distance of the nodes of a curved rigid body, mm: it bulges by 1 µm between them at a radius of 8 mm.
const BODY_STEP_MM: f64 = 0.25;
/// Half-width of a sphere's meshed cap over its radius.
const CAP: f64 = 0.65;

/// Node set of the plane in the deck.
pub(super) const PLANE_NODES: &str = "PLANE_NODES";
/// Node set of the pad in the deck.
pub(super) const PAD_NODES: &str = "PEER_PAD";

/// The lines of a law after `*MATERIAL`; its constants mean the same in CalculiX, checked by
/// `one_element_has_our_laws`.
///
/// CalculiX has a volumetric constant for each power or term, and assumes Poisson's ratio 0.475 for a constant that is
/// left out: all but the first get a compressibility that makes their volumetric part vanish.
///
/// # Errors
/// An Ogden law of more terms than CalculiX has.
pub(super) fn law_lines(law: &Material) -> Result<String, String> {
    const NO_PART: f64 = 1e20;
    let (name, numbers) = match law {
        Material::NeoHooke(law) => ("*HYPERELASTIC, NEO HOOKE".into(), vec![0.5 * law.mu_mpa, law.d_per_mpa]),
        Material::MooneyRivlin(law) => {
            ("*HYPERELASTIC, MOONEY-RIVLIN".into(), vec![law.c10_mpa, law.c01_mpa, law.d_per_mpa])
        }
        Material::Yeoh(law) => {
            let constants = vec![law.c10_mpa, law.c20_mpa, law.c30_mpa, law.d_per_mpa, NO_PART, NO_PART];
            ("*HYPERELASTIC, YEOH".into(), constants)
        }
        Material::OgdenSeries(law) => {
            let terms = law.terms();
            if terms.len() > MOST_CALCULIX_TERMS {
                let count = terms.len();
                return Err(format!("an Ogden law of {count} terms; CalculiX has {MOST_CALCULIX_TERMS} at most"));
            }
            let mut numbers: Vec<f64> = terms.iter().flat_map(|term| [term.mu_mpa, term.alpha]).collect();
            numbers.push(law.d_per_mpa());
            numbers.resize(3 * terms.len(), NO_PART);
            (format!("*HYPERELASTIC, OGDEN, N={}", terms.len()), numbers)
        }
        Material::Linear(law) => ("*ELASTIC".into(), vec![law.young_mpa, law.poisson]),
        Material::Ogden(law) => ("*HYPERELASTIC, OGDEN, N=1".to_owned(), vec![law.mu_mpa, law.alpha, law.d_per_mpa]),
    };
    let words: Vec<String> = numbers.iter().map(|number| format!("{number:.12e}")).collect();
    let lines: Vec<String> = words.chunks(8).map(|line| line.join(", ")).collect();
    Ok(format!("{name}\n{}\n", lines.join("\n")))
}

/// Most terms of CalculiX's Ogden law.
const MOST_CALCULIX_TERMS: usize = 3;

/// Coulomb friction of CalculiX.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Friction coefficient.
    pub mu: f64,
    /// Tangential stiffness of a sticking point, MPa/mm: its elastic slip is mu p over this.
    pub stick_slope_mpa_mm: f64,
}

/// Penalty contact of pad and plane, integrated over faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Pressure per penetration, MPa/mm.
    pub penalty_mpa_mm: f64,
    /// `None` without friction.
    pub friction: Option<Friction>,
}

/// A straight motion of the plane. CalculiX's time runs as travel in mm, so that increments are lengths.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Slide along x and y, and depth, at the end of the step, mm.
    pub end_mm: Vector3<f64>,
    /// Travels from the step's start at which forces and displacements are written, mm, increasing; the last one is the
    /// length of the step.
    pub output_at_mm: Vec<f64>,
    /// First increment, mm.
    pub first_increment_mm: f64,
    /// Largest increment, mm.
    pub max_increment_mm: f64,
}

impl Step {
    /// Press from first touch, with outputs at these depths (mm, increasing).
    ///
    /// One step for all depths: CalculiX discards its extrapolation at the start of a step, which costs iterations (864
    /// hexahedra to 1.5 mm: 59 with a step per depth, 31 with one). Increments as long as the outputs allow are its
    /// fastest (2048 hexahedra: 26 iterations from 0.75 mm, 30 from 0.5 mm, 35 from 0.25 mm, 88 from 0.125 mm).
    pub fn press(depths_mm: &[f64]) -> Self {
        let end = depths_mm.last().copied().unwrap_or(0.0);
        Self {
            end_mm: Vector3::new(0.0, 0.0, end),
            output_at_mm: depths_mm.to_vec(),
            first_increment_mm: 0.75_f64.min(end),
            max_increment_mm: 0.75_f64.min(end),
        }
    }

    /// Slide along +x at constant depth from slide 0, with outputs at these slides (mm, increasing).
    ///
    /// The first increment is short: a long one costs CalculiX an attempt that it then cuts anyway. Largest
    /// increments of 0.1, 0.25 and 0.5 mm differ by 0.1 % in the force after 2 mm (2048 hexahedra, mu 1.5).
    pub fn slide_x(depth_mm: f64, slides_mm: &[f64]) -> Self {
        let end = slides_mm.last().copied().unwrap_or(0.0);
        Self {
            end_mm: Vector3::new(end, 0.0, depth_mm),
            output_at_mm: slides_mm.to_vec(),
            first_increment_mm: 0.005_f64.min(end),
            max_increment_mm: 0.25_f64.min(end),
        }
    }

    /// Length of the step, mm.
    pub(super) fn length_mm(&self) -> f64 {
        self.output_at_mm.last().copied().unwrap_or(0.0)
    }
}

/// Choices that concern CalculiX alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Element type of hexahedra; C3D8 locks at the tissue's Poisson ratio.
    pub hex_type: String,
    /// Iterations after which an increment in contact is abandoned and cut. CalculiX's own default is 60. Nearly all
    /// attempts beyond 20 iterations failed (one converged, in 21), and a limit of 20 saved a fifth of the iterations
    /// of a slide.
    pub contact_iterations: u32,
    /// Smallest increment, mm.
    pub min_increment_mm: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { hex_type: "C3D8R".into(), contact_iterations: 20, min_increment_mm: 1e-6 }
    }
}

/// One problem for CalculiX.
#[derive(Clone, Debug)]
pub struct Deck<'a> {
    /// Mesh in the frame of the plane.
    pub mesh: &'a Mesh,
    /// The law of every region that the mesh has; None for one that is fixed in space: its elements are left out, its
    /// nodes held.
    pub materials: BTreeMap<Region, Option<Material>>,
    /// Names of node sets that are held fixed.
    pub fixed_sets: Vec<String>,
    /// The rigid body: a plane, or a sphere that touches the finger from outside.
    pub rigid_body: RigidBody,
    /// Contact of the pad faces with it.
    pub contact: Contact,
    /// Motions of the plane, from first touch.
    pub steps: Vec<Step>,
    /// CalculiX's own settings.
    pub settings: Settings,
}

impl Deck<'_> {
    /// The deck as text.
    ///
    /// The plane is one C3D8 block below z = 0 with all nodes driven, large enough for the slides; a sphere is a cap of
    /// such blocks with its highest point at the origin.
    ///
    /// # Errors
    /// [`Error::Deck`] for a region without a law, an empty set, a fixed region with ties, a step without length or
    /// with outputs out of order, a mesh that cannot be written.
    pub fn to_text(&self) -> Result<String, Error> {
        let used = self.check()?;
        let held = self.held_nodes(&used);
        let omit: Vec<Region> = self.materials.iter().filter(|(_, law)| law.is_none()).map(|(r, _)| *r).collect();
        let parts = inp::Settings { hex_type: self.settings.hex_type.clone(), omit, held, ..inp::Settings::default() };
        let mut text = String::from("*HEADING\nmm, N, s, MPa; the time of a step is the plane's travel in mm\n");
        text += &inp::to_text(self.mesh, &parts).map_err(Error::Deck)?;
        let mut sets = Vec::new();
        let pad: Vec<u32> = self.pad_nodes();
        for (name, nodes) in [("PEER_HELD", &parts.held), (PAD_NODES, &pad)] {
            inp::write_node_set(&mut sets, name, nodes).map_err(|e| Error::Deck(e.to_string()))?;
        }
        text += &String::from_utf8_lossy(&sets);
        text += &self.rigid_body()?;
        for (region, name) in self.mesh.regions() {
            if let Some(Some(law)) = self.materials.get(&region).filter(|_| self.has_elements(region)) {
                let lines = law_lines(law).map_err(|problem| Error::Deck(format!("region `{name}`: {problem}")))?;
                text += &format!("*MATERIAL, NAME=LAW_{name}\n{lines}");
                text += &format!("*SOLID SECTION, ELSET={name}, MATERIAL=LAW_{name}\n");
            }
        }
        let Contact { penalty_mpa_mm, friction } = self.contact;
        text += "*SURFACE INTERACTION, NAME=TOUCH\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n";
        text += &format!("{penalty_mpa_mm:.12e}\n");
        if let Some(Friction { mu, stick_slope_mpa_mm }) = friction {
            text += &format!("*FRICTION\n{mu:.12e}, {stick_slope_mpa_mm:.12e}\n");
        }
        text += "*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE\n";
        text += &format!("{}, PLANE_SURFACE\n*BOUNDARY\nPEER_HELD, 1, 3\n", inp::PAD_SURFACE);
        for (i, step) in self.steps.iter().enumerate() {
            let points: Vec<String> = step.output_at_mm.iter().map(|t| format!("{t:.12e}")).collect();
            text += &format!("*TIME POINTS, NAME=OUT{i}\n{}\n", points.join(",\n"));
        }
        for (i, step) in self.steps.iter().enumerate() {
            self.write_step(&mut text, i, step);
        }
        Ok(text)
    }

    /// Pad nodes in the order of [`super::Point::pad_displacement_mm`].
    pub fn pad_nodes(&self) -> Vec<u32> {
        let mut nodes: Vec<u32> = self.mesh.pad_faces.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Number of outputs of a complete run.
    pub(super) fn outputs(&self) -> usize {
        self.steps.iter().map(|step| step.output_at_mm.len()).sum()
    }

    /// Checks the problem and returns, per node, whether a deformable element uses it.
    fn check(&self) -> Result<Vec<bool>, Error> {
        let refuse = |problem: String| Err(Error::Deck(problem));
        if !self.mesh.tets10.is_empty() {
            return refuse("a mesh of 10-node tetrahedra, whose element is not one of CalculiX's".into());
        }
        for (region, name) in self.mesh.regions() {
            if self.has_elements(region) && !self.materials.contains_key(&region) {
                return refuse(format!("region `{name}` has elements but no material"));
            }
        }
        if self.mesh.pad_faces.is_empty() {
            return refuse("the mesh has no pad faces".into());
        }
        if let Some(name) = self.fixed_sets.iter().find(|name| self.mesh.node_set(name).is_empty()) {
            return refuse(format!("the fixed node set `{name}` is empty or missing"));
        }
        let fixed = |region: &Region| self.materials.get(region) == Some(&None);
        let mut used = vec![false; self.mesh.nodes.len()];
        let hexes = self.mesh.hexes.iter().map(|h| (h.region, &h.nodes[..]));
        let tets = self.mesh.tets.iter().map(|t| (t.region, &t.nodes[..]));
        for node in hexes.chain(tets).filter(|(region, _)| !fixed(region)).flat_map(|(_, nodes)| nodes) {
            used[*node as usize] = true;
        }
        if let Some(tie) = self.mesh.ties.iter().find(|tie| !used[tie.slave as usize]) {
            return refuse(format!("node {} is tied but belongs to a fixed region: give its region a law", tie.slave));
        }
        for (i, step) in self.steps.iter().enumerate() {
            let rising = step.output_at_mm.windows(2).all(|w| w[0] < w[1]);
            if !(rising && step.output_at_mm.first().is_some_and(|t| *t > 0.0)) {
                return refuse(format!(
                    "step {i}: outputs must be increasing travels above 0, not {:?}",
                    step.output_at_mm
                ));
            }
            let from = if i == 0 { Vector3::zeros() } else { self.steps[i - 1].end_mm };
            let travel = (step.end_mm - from).norm();
            if (travel - step.length_mm()).abs() > 1e-9 {
                return refuse(format!("step {i} moves {travel} mm but its last output is at {} mm", step.length_mm()));
            }
            if !(step.first_increment_mm > 0.0 && step.max_increment_mm >= step.first_increment_mm) {
                return refuse(format!("step {i}: increments must be above 0, the first not above the largest"));
            }
        }
        Ok(used)
    }

    fn has_elements(&self, region: Region) -> bool {
        self.mesh.hexes.iter().any(|h| h.region == region) || self.mesh.tets.iter().any(|t| t.region == region)
    }

    /// Nodes of fixed sets and fixed regions, as far as deformable elements use them.
    fn held_nodes(&self, used: &[bool]) -> Vec<u32> {
        let fixed = |region: &Region| self.materials.get(region) == Some(&None);
        let sets = self.fixed_sets.iter().flat_map(|name| self.mesh.node_set(name)).copied();
        let hexes = self.mesh.hexes.iter().filter(|h| fixed(&h.region)).flat_map(|h| h.nodes);
        let tets = self.mesh.tets.iter().filter(|t| fixed(&t.region)).flat_map(|t| t.nodes);
        let mut held: Vec<u32> = sets.chain(hexes).chain(tets).filter(|n| used[*n as usize]).collect();
        held.sort_unstable();
        held.dedup();
        held
    }

    fn rigid_body(&self) -> Result<String, Error> {
        let pad = self.pad_nodes();
        let reach = |axis: usize| {
            let slides = self.steps.iter().map(|step| step.end_mm[axis].abs()).fold(0.0, f64::max);
            let widest = pad.iter().map(|n| self.mesh.nodes[*n as usize][axis].abs()).fold(0.0, f64::max);
            // The pad bulges while it is pressed and is dragged along: the margin is half its width.
            1.5 * widest + slides + 5.0
        };
        let ends = |half: f64, cells: usize| -> Vec<f64> {
            (0..=cells).map(|k| half * (2.0 * k as f64 / cells as f64 - 1.0)).collect()
        };
        let (xs, ys, radius) = match self.rigid_body {
            RigidBody::Plane => (ends(reach(0), 1), ends(reach(1), 1), f64::INFINITY),
            RigidBody::Sphere { radius_mm } if radius_mm > 0.0 => {
                let half = CAP * radius_mm;
                let cells = (2.0 * half / BODY_STEP_MM).ceil() as usize;
                (ends(half, cells), ends(half, cells), radius_mm)
            }
            ref other => return Err(Error::Deck(format!("a rigid body that is no plane and no sphere: {other:?}"))),
        };
        let height = |x: f64, y: f64| {
            let squared = x * x + y * y;
            if radius.is_finite() { (radius * radius - squared).sqrt() - radius } else { 0.0 }
        };
        let first = self.mesh.nodes.len() + 1;
        let node = |i: usize, j: usize, k: usize| first + 2 * (i * ys.len() + j) + k;
        let mut text = format!("*NODE, NSET={PLANE_NODES}\n");
        for (i, &x) in xs.iter().enumerate() {
            for (j, &y) in ys.iter().enumerate() {
                let top = height(x, y);
                for (k, z) in [top - 5.0, top].into_iter().enumerate() {
                    let _ = writeln!(text, "{}, {x:.12e}, {y:.12e}, {z:.12e}", node(i, j, k));
                }
            }
        }
        text += "*ELEMENT, TYPE=C3D8, ELSET=PLANE\n";
        let mut element = self.mesh.hexes.len() + self.mesh.tets.len();
        let mut faces = String::new();
        for i in 0..xs.len() - 1 {
            for j in 0..ys.len() - 1 {
                element += 1;
                let corners = [(0, 0), (1, 0), (1, 1), (0, 1)];
                let nodes = [0, 1].map(|k| corners.map(|(a, b)| node(i + a, j + b, k).to_string()).join(", "));
                let _ = writeln!(text, "{element}, {}", nodes.join(", "));
                let _ = writeln!(faces, "{element}, S2");
            }
        }
        let _ = write!(
            text,
            "*SURFACE, NAME=PLANE_SURFACE, TYPE=ELEMENT\n{faces}*MATERIAL, NAME=PLANE_LAW\n*ELASTIC\n1., 0.3\n\
             *SOLID SECTION, ELSET=PLANE, MATERIAL=PLANE_LAW\n"
        );
        Ok(text)
    }

    fn write_step(&self, text: &mut String, i: usize, step: &Step) {
        let length = step.length_mm();
        let max = step.max_increment_mm.min(length);
        let first = step.first_increment_mm.min(max);
        // 0.001, 0.1 and 100 are CalculiX's own defaults of the fields before.
        let _ = write!(
            text,
            "*STEP, NLGEOM, INC=10000\n*CONTROLS, PARAMETERS=CONTACT\n0.001, 0.1, 100, {}\n\
             *STATIC\n{first:.12e}, {length:.12e}, {:.12e}, {max:.12e}\n*BOUNDARY\n",
            self.settings.contact_iterations, self.settings.min_increment_mm
        );
        for axis in 0..3 {
            let _ = writeln!(text, "{PLANE_NODES}, {0}, {0}, {1:.12e}", axis + 1, step.end_mm[axis]);
        }
        let _ = write!(
            text,
            "*NODE PRINT, NSET={PLANE_NODES}, TOTALS=ONLY, TIME POINTS=OUT{i}\nRF\n\
             *NODE PRINT, NSET={PAD_NODES}, TIME POINTS=OUT{i}\nU\n*END STEP\n"
        );
    }
}

impl<'a> Deck<'a> {
    /// A finger on a plane: the law of `material` for each region but the bones, which are fixed, and the mesh's own
    /// fixed sets.
    ///
    /// Sets that the mesh does not have are left out.
    pub fn finger(
        mesh: &'a Mesh,
        material: impl Fn(Region) -> Option<Material>,
        contact: Contact,
        steps: Vec<Step>,
    ) -> Self {
        let fixed_sets = [set::NAIL_FIX, set::PROXIMAL_FIX];
        let deformable = |region: &Region| !matches!(region, Region::DistalBone | Region::ProximalBone);
        let law = |(region, _)| (region, Some(region).filter(deformable).and_then(&material));
        Self {
            mesh,
            rigid_body: RigidBody::Plane,
            materials: mesh.regions().into_iter().map(law).collect(),
            fixed_sets: fixed_sets.into_iter().filter(|s| !mesh.node_set(s).is_empty()).map(str::to_owned).collect(),
            contact,
            steps,
            settings: Settings::default(),
        }
    }
}
