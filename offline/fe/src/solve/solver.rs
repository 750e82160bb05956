//! One increment: from a state in equilibrium to the next for a given motion of the plane.

use nalgebra::Vector3;

use super::{
    contact_system::KeptFactor,
    equilibrium::Increment,
    increment::{Damping, Guess, SolveError, SolverSettings, State, Stats, Target, Watch},
    linear::{Factor, Precision},
};
use crate::assembly::{Body, BodyError, Configuration, TissueStep};
use crate::contact::{ContactState, Friction, Outline, Pad, PenaltySettings, Plane, RigidBody, Surface, Totals};

/// Origin of the factor of the bulk stiffness.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct FactorOrigin {
    pub configuration: Configuration,
    pub last: ContactState,
    pub plane: Plane,
    pub tissue: Option<TissueStep>,
}

/// Record from which the factor of a solver can be made again.
///
/// The factor is kept over many increments, and the last digits of the results depend on the factor in use.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct FactorRecord {
    precision: Precision,
    compliant_from: usize,
    origin: Option<FactorOrigin>,
}

/// Faces that may touch the plane, as mesh nodes counter-clockwise from outside.
#[derive(Clone, Copy, Debug, Default)]
pub struct PadFaces<'a> {
    /// Quadrilaterals.
    pub quads: &'a [[u32; 4]],
    /// Linear triangles.
    pub triangles: &'a [[u32; 3]],
}

impl<'a> From<&'a [[u32; 4]]> for PadFaces<'a> {
    fn from(quads: &'a [[u32; 4]]) -> Self {
        Self { quads, triangles: &[] }
    }
}

impl<'a> From<&'a Vec<[u32; 4]>> for PadFaces<'a> {
    fn from(quads: &'a Vec<[u32; 4]>) -> Self {
        quads.as_slice().into()
    }
}

/// Body, surface, law and the factor that they share from increment to increment.
pub struct Solver<'a> {
    pub(super) body: &'a Body,
    pub(super) surface: Surface,
    pub(super) friction: Friction,
    pub(super) penalty: PenaltySettings,
    pub(super) settings: SolverSettings,
    pub(super) factor: Factor,
    pub(super) factor_is_set: bool,
    /// Origin of the factor, if it is set and without viscous forces.
    pub(super) factor_origin: Option<FactorOrigin>,
    /// Factor of the contact problems of an increment. It is not kept from one increment to the next, so that an
    /// increment's result depends on its start alone.
    pub(super) contact_factor: KeptFactor,
    /// Whether a force or a moment determines the distance of the plane from the finger.
    pub(super) plane_gives_way: bool,
    /// Contact dofs (0 based among them) that move each surface node, with their weights.
    pub(super) slots: Vec<Vec<(usize, f64)>>,
    pub(super) held: Vec<bool>,
    pub(super) shift: Vec<f64>,
    pub(super) viscosity: Vec<f64>,
    /// Rounding error of the residual, N.
    pub(super) rounding_n: f64,
    pub(super) undeformed_stiffness: Vec<f64>,
    pub(super) values: Vec<f64>,
    /// Force on a touching node per penetration, N/mm.
    pub(super) penalty_stiffness: f64,
    /// Stress of the present step, if the tissue relaxes.
    pub(super) tissue: Option<TissueStep>,
}

impl<'a> Solver<'a> {
    /// Solver of `body` whose `faces` may touch the plane.
    pub fn new(
        body: &'a Body,
        faces: impl Into<PadFaces<'a>>,
        friction: Friction,
        penalty: PenaltySettings,
        settings: SolverSettings,
    ) -> Self {
        let PadFaces { quads, triangles } = faces.into();
        let modulus_mpa = body.plane_strain_moduli_mpa();
        let moved_by = |node: u32| body.dofs.contact_parts(node);
        let can_carry = |node: u32| moved_by(node).is_some();
        let pad = Pad {
            quads,
            triangles,
            undeformed: &body.undeformed().x,
            modulus_mpa: &modulus_mpa,
            can_carry: &can_carry,
        };
        let surface = Surface::new(&pad, &penalty);
        let penalty_stiffness = surface.penalty_stiffness();
        let first = body.dofs.first_contact_dof;
        let slots = surface.nodes.iter().map(|&node| moved_by(node).unwrap_or_default()).collect();
        let contact = body.dofs.count - first;
        let mut held = vec![false; contact];
        for &dof in &body.dofs.held {
            if dof >= first {
                held[dof - first] = true;
            }
        }
        let factor = Factor::analyse(&body.dofs.pattern, contact);
        Self {
            body,
            surface,
            friction,
            penalty,
            settings,
            factor,
            factor_is_set: false,
            factor_origin: None,
            contact_factor: KeptFactor::default(),
            plane_gives_way: false,
            slots,
            held,
            shift: vec![0.0; contact],
            viscosity: Vec::new(),
            rounding_n: 0.0,
            undeformed_stiffness: Vec::new(),
            values: Vec::new(),
            penalty_stiffness,
            tissue: None,
        }
    }

    /// The soft body.
    pub fn body(&self) -> &'a Body {
        self.body
    }

    /// The surface with its faces.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// The law in force.
    pub fn friction(&self) -> &Friction {
        &self.friction
    }

    /// Has the finger touch `body`, which starts at `start`, in place of a plane.
    ///
    /// * `outline`: the undeformed surface, from which depth counts; None for the nodes that may touch
    pub fn set_rigid_body(&mut self, body: RigidBody, outline: Option<Outline>, start: &Plane) {
        self.surface.set_rigid_body(body, outline, start);
    }

    /// Changes the law for later increments; the elastic slip of contact points is kept.
    pub fn set_friction(&mut self, friction: Friction) {
        self.friction = friction;
    }

    /// Sets the stress of the tissue in later increments.
    pub fn set_tissue(&mut self, step: Option<TissueStep>) {
        self.surface.set_stiffening(step.as_ref().map_or(1.0, TissueStep::stiffening));
        self.tissue = step;
    }

    /// Energy whose derivative is the force of the body in the present increment, mJ.
    pub fn energy_mj(&self, at: &Configuration) -> f64 {
        self.body.energy((at, self.tissue.as_ref())).0
    }

    /// Entries of the bulk factor.
    pub fn factor_entries(&self) -> usize {
        self.factor.entries()
    }

    /// The undeformed body before contact, the plane at `plane`.
    pub fn initial_state(&self, plane: impl Into<Plane>) -> State {
        let configuration = self.body.undeformed().clone();
        let contact = self.surface.initial_state(&self.surface_positions(&configuration), plane.into());
        State { configuration, contact, totals: Totals::default() }
    }

    /// A guess of a state: the body at `configuration` and its touching nodes, without contact history.
    pub fn guessed_state(&self, configuration: Configuration, plane: impl Into<Plane>) -> State {
        let plane = plane.into();
        let positions = self.surface_positions(&configuration);
        let start = self.surface.initial_state(&positions, plane);
        let areas = self.surface.areas(&start, &positions, &plane);
        let (contact, _) = self.surface.commit(&self.friction, &start, &areas, &positions, plane);
        State { configuration, contact, totals: Totals::default() }
    }

    pub(super) fn surface_positions(&self, configuration: &Configuration) -> Vec<Vector3<f64>> {
        self.surface.nodes.iter().map(|&n| configuration.x[n as usize]).collect()
    }

    /// Record of the factor for [`Self::restore_factor`].
    pub fn factor_record(&self) -> FactorRecord {
        FactorRecord {
            precision: self.factor.precision(),
            compliant_from: self.factor.compliant_from(),
            origin: self.factor_origin.clone().filter(|_| self.factor_is_set),
        }
    }

    /// Makes the factor of `record` again, bit for bit, under the law in force then.
    ///
    /// # Errors
    /// [`SolveError`] if the record is not of this body.
    pub fn restore_factor(&mut self, record: &FactorRecord, watch: Watch) -> Result<(), SolveError> {
        self.factor.set_precision(record.precision);
        if let Some(FactorOrigin { configuration, last, plane, tissue }) = &record.origin {
            let mut stats = Stats::default();
            self.set_tissue(tissue.clone());
            self.refresh(configuration, last, plane, None, &mut stats, watch)?;
            if record.compliant_from < self.factor.compliant_from() {
                self.factor.make_compliance_from(record.compliant_from);
            }
        }
        Ok(())
    }

    /// The next state under viscous forces: not yet in equilibrium, but nearer to it.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn damped_step(
        &mut self,
        last: &State,
        target: impl Into<Target>,
        coefficient: f64,
        stats: &mut Stats,
        watch: Watch,
    ) -> Result<State, SolveError> {
        let damping = Damping { coefficient, from: &last.configuration };
        let guess = Guess::at(last);
        self.diagonal_of_undeformed();
        self.factor_is_set = false;
        let increment = Increment::new(&last.contact, target.into(), Some(damping));
        let result = self.equilibrium(&increment, guess, stats, watch);
        self.factor_is_set = false;
        result
    }

    /// Motion of the free nodes between two configurations, dof order; zero for the rigid body.
    fn motion(&self, to: &Configuration, from: &Configuration) -> Vec<f64> {
        let mut out = vec![0.0; self.body.dofs.count];
        for (node, (a, b)) in to.x.iter().zip(&from.x).enumerate() {
            if let Some(dof) = self.body.dofs.node_dof(node as u32) {
                for k in 0..3 {
                    out[dof + k] = a[k] - b[k];
                }
            }
        }
        out
    }

    pub(super) fn internal_forces(
        &self,
        at: &Configuration,
        damping: Option<Damping>,
        out: &mut Vec<f64>,
    ) -> Result<(), BodyError> {
        self.body.residual((at, self.tissue.as_ref()), out)?;
        if let Some(damping) = damping {
            for ((out, du), k) in out.iter_mut().zip(self.motion(at, damping.from)).zip(&self.viscosity) {
                *out += damping.coefficient * k * du;
            }
        }
        Ok(())
    }

    /// The next state in equilibrium.
    ///
    /// `watch` receives the effort so far before every iteration and may stop the search.
    ///
    /// # Errors
    /// [`SolveError`]; `last` is untouched and the increment can be tried again with a smaller step.
    pub fn step(
        &mut self,
        last: &State,
        target: impl Into<Target>,
        guess: Guess,
        stats: &mut Stats,
        watch: Watch,
    ) -> Result<State, SolveError> {
        let target = target.into();
        self.diagonal_of_undeformed();
        let mut reference = last.contact.clone();
        let mut state = self.equilibrium(&Increment::new(&reference, target, None), guess, stats, watch)?;
        if self.penalty.augment {
            for _ in 0..self.settings.max_augmentations {
                if state.totals.penetration <= self.penalty.penetration_tolerance_mm {
                    break;
                }
                self.surface.augment(&mut reference, &state.contact);
                let plane = state.contact.plane;
                let guess = Guess { configuration: state.configuration, plane, follows_plane: true };
                state = self.equilibrium(&Increment::new(&reference, target, None), guess, stats, watch)?;
            }
        }
        Ok(state)
    }
}
