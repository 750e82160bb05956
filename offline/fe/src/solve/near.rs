//! Contact dofs that may touch before the search for equilibrium selects them again: only their compliance is needed.

use super::Solver;
use crate::assembly::Configuration;
use crate::contact::{ContactState, Plane};

/// Gap to the rigid body up to which nodes must have a compliance, mm.
const NEAR_MM: f64 = 0.1;

/// The same for a factor that is made, and used for several increments.
const NEAR_AHEAD_MM: f64 = 0.4;

impl Solver<'_> {
    /// First contact dof of the nodes that touch or have a gap of less than `height_mm` (than the least and that, where nothing
    /// touches), and of the nodes of their faces; 0 where a force moves the plane away from or to the finger, however far.
    fn near_from(&self, at: &Configuration, last: &ContactState, plane: &Plane, height_mm: f64) -> usize {
        if self.plane_gives_way {
            return 0;
        }
        let frame = self.surface.frame(plane);
        let body = self.surface.body();
        let gaps: Vec<f64> = self.surface_positions(at).iter().map(|x| body.spot(&frame.to_plane(x)).gap_mm).collect();
        let limit = gaps.iter().copied().fold(f64::INFINITY, f64::min).max(0.0) + height_mm;
        let is_near = |node: usize| last.nodes[node].normal_force_n > 0.0 || gaps[node] < limit;
        let facets = self.surface.facets.iter().map(|facet| facet.corners());
        let nodes = facets.filter(|corners| corners.iter().any(|&node| is_near(node))).flatten();
        nodes.flat_map(|&node| &self.slots[node]).map(|&(slot, _)| slot).min().unwrap_or(self.shift.len())
    }

    /// Has the next factor made with the compliance that it will need.
    pub(super) fn look_ahead(&mut self, at: &Configuration, last: &ContactState, plane: &Plane) {
        let first = self.near_from(at, last, plane, NEAR_AHEAD_MM);
        self.factor.set_compliant_from(first);
    }

    /// Completes the compliance of all dofs that may touch.
    pub(super) fn complete_compliance(&mut self, at: &Configuration, last: &ContactState, plane: &Plane) {
        if self.near_from(at, last, plane, NEAR_MM) < self.factor.compliant_from() {
            let first = self.near_from(at, last, plane, NEAR_AHEAD_MM);
            self.factor.make_compliance_from(first);
        }
    }
}
