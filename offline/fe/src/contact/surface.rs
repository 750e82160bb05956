//! Contact forces of all faces and their tangent, integrated at face quadrature points.
//!
//! Virtual work is `int t . du dA` over the current area projected on the plane, `t` the traction that the
//! plane exerts on the finger: pressure along +z, friction in x and y.

use nalgebra::Vector3;

use super::point::{FaceMotion, RulePoint, TractionChange, contact_point, interpolate};
use super::{ContactState, FrictionLaw, PenaltySettings, Plane, PointState, Totals};
use crate::element::{quad4, quad4_gradient};

/// Tangent of one face: derivative of the residual forces of its nodes over their positions.
pub struct FaceTangent {
    /// Face index.
    pub face: usize,
    /// Column-major, shape (12, 12).
    pub block: Box<[[f64; 12]; 12]>,
}

/// Contact residual at trial positions.
#[derive(Default)]
pub struct Evaluation {
    /// Residual force of each surface node (minus what the plane exerts), N.
    pub residual: Vec<Vector3<f64>>,
    /// Tangents of the faces in contact, if asked for.
    pub tangents: Vec<FaceTangent>,
    /// Derivative of the residual over the plane's x, y and z, per surface node, if asked for.
    pub plane_columns: Vec<[Vector3<f64>; 3]>,
    /// Force that the plane exerts, N.
    pub force: Vector3<f64>,
}

/// Share of the mean pressure from which on a point counts wholly as area.
const FULL_SHARE: f64 = 0.05;

/// Faces of a body that may touch the plane.
pub struct Surface {
    /// Mesh node of each surface node.
    pub nodes: Vec<u32>,
    /// Faces as surface node indices, counter-clockwise from outside.
    pub faces: Vec<[usize; 4]>,
    rule: Vec<RulePoint>,
    penalty: f64,
}

impl Surface {
    /// Surface of mesh faces (mesh node numbers, counter-clockwise from outside).
    pub fn new(faces: &[[u32; 4]], settings: &PenaltySettings) -> Self {
        let mut nodes: Vec<u32> = faces.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let place = |node: u32| nodes.binary_search(&node).expect("listed above");
        let faces = faces.iter().map(|face| face.map(place)).collect();
        let rule_1d = settings.quadrature.rule();
        let rule = rule_1d
            .iter()
            .flat_map(|&(eta, w_eta)| {
                rule_1d.iter().map(move |&(xi, w_xi)| RulePoint {
                    shape: quad4(xi, eta),
                    gradient: quad4_gradient(xi, eta),
                    weight: w_xi * w_eta,
                })
            })
            .collect();
        Self { nodes, faces, rule, penalty: settings.penalty_mpa_per_mm }
    }

    /// Quadrature points per face.
    pub fn points_per_face(&self) -> usize {
        self.rule.len()
    }

    /// State before any contact.
    pub fn initial_state(&self, position: Vec<Vector3<f64>>, plane: Plane) -> ContactState {
        ContactState { points: vec![PointState::default(); self.faces.len() * self.rule.len()], position, plane }
    }

    /// Residual forces and, if `tangent`, their derivatives at trial `position` and `plane`.
    ///
    /// With `predict_stick` points that stuck at the end of the last increment are not let slip.
    pub fn evaluate(
        &self,
        law: &dyn FrictionLaw,
        last: &ContactState,
        position: &[Vector3<f64>],
        plane: Plane,
        predict_stick: bool,
        tangent: bool,
    ) -> Evaluation {
        let mut out = Evaluation {
            residual: vec![Vector3::zeros(); self.nodes.len()],
            plane_columns: if tangent { vec![[Vector3::zeros(); 3]; self.nodes.len()] } else { Vec::new() },
            ..Default::default()
        };
        for (f, face) in self.faces.iter().enumerate() {
            let motion = FaceMotion::new(face, last, position, plane);
            let states = &last.points[f * self.rule.len()..][..self.rule.len()];
            if self.is_clear(&motion, states) {
                continue;
            }
            let mut force = [Vector3::zeros(); 4];
            let mut block: Option<Box<[[f64; 12]; 12]>> = None;
            for (rule, state) in self.rule.iter().zip(states) {
                let Some(point) = contact_point(rule, state, &motion, self.penalty) else { continue };
                let sliding = law.return_map(point.trial_slip(state), point.pressure, predict_stick && state.stuck);
                let traction = Vector3::new(sliding.traction[0], sliding.traction[1], point.pressure);
                for a in 0..4 {
                    force[a] += traction * (rule.shape[a] * point.area);
                }
                if tangent {
                    let change = TractionChange::of(&point, &sliding);
                    let block = block.get_or_insert_with(|| Box::new([[0.0; 12]; 12]));
                    point.add_tangent(rule, traction, &change, block);
                    let by_plane = point.change_with_plane(&change);
                    for a in 0..4 {
                        for k in 0..3 {
                            out.plane_columns[face[a]][k] -= by_plane[k] * rule.shape[a];
                        }
                    }
                }
            }
            for a in 0..4 {
                out.residual[face[a]] -= force[a];
                out.force += force[a];
            }
            if let Some(block) = block {
                out.tangents.push(FaceTangent { face: f, block });
            }
        }
        out
    }

    /// New state of every point at `position` and `plane`, and the sums over them.
    pub fn commit(
        &self,
        law: &dyn FrictionLaw,
        last: &ContactState,
        position: &[Vector3<f64>],
        plane: Plane,
    ) -> (ContactState, Totals) {
        let mut points = vec![PointState::default(); last.points.len()];
        let mut totals = Totals { min_dissipation_density: f64::INFINITY, ..Default::default() };
        for (f, face) in self.faces.iter().enumerate() {
            let motion = FaceMotion::new(face, last, position, plane);
            let range = f * self.rule.len()..(f + 1) * self.rule.len();
            let states = &last.points[range.clone()];
            if self.is_clear(&motion, states) {
                continue;
            }
            for ((rule, state), new) in self.rule.iter().zip(states).zip(&mut points[range]) {
                let Some(point) = contact_point(rule, state, &motion, self.penalty) else { continue };
                let trial = point.trial_slip(state);
                let sliding = law.return_map(trial, point.pressure, false);
                let step = point.slip_step();
                *new = PointState {
                    elastic_slip: sliding.elastic_slip,
                    slip: [0, 1].map(|k| state.slip[k] + step[k]),
                    multiplier: state.multiplier,
                    pressure: point.pressure,
                    traction: sliding.traction,
                    area: point.area,
                    stuck: sliding.at_rest,
                };
                totals.add(&point, &sliding, trial);
                for k in 0..2 {
                    totals.pressure_moment[k] += point.pressure * point.area * interpolate(&rule.shape, &motion.x, k);
                }
            }
        }
        totals.stuck_area = self.stuck_area(&points);
        (ContactState { points, position: position.to_vec(), plane }, totals)
    }

    /// Area that sticks, mm², interpolated from the nodes.
    ///
    /// Between a node that sticks and one that slips the slip is bilinear, so that hardly a point of the faces between
    /// them sticks, though the field's own boundary lies half-way in the mean: counting points would lose half a face
    /// all around. A node sticks if any of the points next to it does.
    fn stuck_area(&self, points: &[PointState]) -> f64 {
        #[derive(Clone, Copy, Default)]
        struct Node {
            touches: bool,
            sticks: bool,
        }
        let mut nodes = vec![Node::default(); self.nodes.len()];
        let of_faces = || self.faces.iter().zip(points.chunks(self.rule.len()));
        let touching = |points| self.rule.iter().zip(points).filter(|(_, point): &(_, &PointState)| point.area > 0.0);
        for (face, points) in of_faces() {
            for (rule, point) in touching(points) {
                // Points half-way between nodes are next to none.
                if let Some(node) = (0..4).find(|&a| rule.shape[a] > 0.5) {
                    nodes[face[node]].touches = true;
                    nodes[face[node]].sticks |= point.stuck;
                }
            }
        }
        let mut area = 0.0;
        for (face, points) in of_faces() {
            for (rule, point) in touching(points) {
                let share_of = |has: fn(&Node) -> bool| -> f64 {
                    (0..4).filter(|&a| has(&nodes[face[a]])).map(|a| rule.shape[a]).sum()
                };
                let touches = share_of(|n| n.touches);
                let sticks =
                    if touches > 0.0 { share_of(|n| n.sticks) / touches } else { f64::from(u8::from(point.stuck)) };
                area += point.area * sticks;
            }
        }
        area
    }

    /// Moves the pressure of `converged` into the multipliers of `state` (one step of Uzawa's method).
    pub fn augment(&self, state: &mut ContactState, converged: &ContactState) {
        for (point, new) in state.points.iter_mut().zip(&converged.points) {
            point.multiplier = new.pressure;
        }
    }

    /// Current area in contact of each face and area of each whole face, projected on the plane, mm².
    ///
    /// Area of the points in contact; one that bears less than 5 % of the mean pressure counts in proportion to what it
    /// bears, so that the area follows the path without jumps.
    pub fn contact_areas(&self, state: &ContactState) -> Vec<[f64; 2]> {
        let (force, area) = state.points.iter().fold((0.0, 0.0), |(f, a), p| (f + p.pressure * p.area, a + p.area));
        let full = if area > 0.0 { FULL_SHARE * force / area } else { f64::INFINITY };
        let inside = |points: &[PointState]| points.iter().map(|p| p.area * (p.pressure / full).min(1.0)).sum();
        let whole = |face: &[usize; 4]| {
            let x = face.map(|n| state.position[n]);
            let (a, b) = (x[2] - x[0], x[3] - x[1]);
            0.5 * (a.y * b.x - a.x * b.y)
        };
        let faces = self.faces.iter().zip(state.points.chunks(self.rule.len()));
        faces.map(|(face, points)| [inside(points), whole(face)]).collect()
    }

    /// Whether no point of the face can be in contact.
    fn is_clear(&self, motion: &FaceMotion, states: &[PointState]) -> bool {
        motion.x.iter().all(|x| x.z > motion.plane[2]) && states.iter().all(|s| s.multiplier == 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Friction, Quadrature, RubberFriction};

    fn surface(quadrature: Quadrature) -> (Surface, Vec<Vector3<f64>>) {
        // Two faces side by side, normals toward -z (counter-clockwise from below), somewhat uneven.
        let faces = [[0, 3, 4, 1], [1, 4, 5, 2]];
        let positions = vec![
            Vector3::new(0.0, 0.0, 0.02),
            Vector3::new(1.1, 0.0, -0.01),
            Vector3::new(2.0, 0.1, 0.05),
            Vector3::new(0.0, 1.0, -0.02),
            Vector3::new(0.9, 1.1, 0.0),
            Vector3::new(2.1, 0.9, 0.03),
        ];
        (Surface::new(&faces, &PenaltySettings { quadrature, ..Default::default() }), positions)
    }

    /// A state with elastic slip, some points stuck, some at their limit.
    fn slid_state(surface: &Surface, x: &[Vector3<f64>], friction: &Friction) -> ContactState {
        let start = surface.initial_state(x.to_vec(), [0.0, 0.0, -1.0]);
        let plane = [0.004, -0.003, 0.03];
        surface.commit(friction, &start, x, plane).0
    }

    #[test]
    fn tangent_is_the_derivative_in_stick_slip_and_without_friction() {
        for (quadrature, friction, step) in [
            (Quadrature::Lobatto, Friction::On(RubberFriction::default()), [0.0005, 0.0002]),
            (Quadrature::Gauss, Friction::On(RubberFriction::default()), [0.1, -0.06]),
            (Quadrature::Lobatto, Friction::On(RubberFriction::coulomb(0.7, 0.002)), [0.003, 0.002]),
            (Quadrature::Gauss, Friction::Off, [0.1, 0.0]),
        ] {
            let (surface, x) = surface(quadrature);
            let last = slid_state(&surface, &x, &friction);
            let plane = [last.plane[0] + step[0], last.plane[1] + step[1], 0.035];
            let exact = surface.evaluate(&friction, &last, &x, plane, false, true);
            assert!(!exact.tangents.is_empty());
            let scale =
                exact.tangents.iter().flat_map(|t| t.block.iter().flatten()).fold(0.0f64, |m, v| m.max(v.abs()));
            let h = 1e-7;
            for node in 0..x.len() {
                for k in 0..3 {
                    let moved = |sign: f64| {
                        let mut y = x.clone();
                        y[node][k] += sign * h;
                        surface.evaluate(&friction, &last, &y, plane, false, false).residual
                    };
                    let (up, down) = (moved(1.0), moved(-1.0));
                    let mut assembled = vec![Vector3::zeros(); x.len()];
                    for t in &exact.tangents {
                        let face = surface.faces[t.face];
                        for b in 0..4 {
                            if face[b] == node {
                                for a in 0..4 {
                                    for i in 0..3 {
                                        assembled[face[a]][i] += t.block[3 * b + k][3 * a + i];
                                    }
                                }
                            }
                        }
                    }
                    for a in 0..x.len() {
                        let numeric = (up[a] - down[a]) / (2.0 * h);
                        assert!((numeric - assembled[a]).norm() < 1e-6 * scale, "{friction:?} node {node} axis {k}");
                    }
                }
            }
            for k in 0..3 {
                let moved = |sign: f64| {
                    let mut p = plane;
                    p[k] += sign * h;
                    surface.evaluate(&friction, &last, &x, p, false, false).residual
                };
                let (up, down) = (moved(1.0), moved(-1.0));
                for a in 0..x.len() {
                    let numeric = (up[a] - down[a]) / (2.0 * h);
                    assert!((numeric - exact.plane_columns[a][k]).norm() < 1e-6 * scale);
                }
            }
        }
    }

    #[test]
    fn flat_face_carries_pressure_times_area_and_friction_at_its_strength() {
        let faces = [[0, 3, 2, 1]];
        let x = vec![
            Vector3::new(0.0, 0.0, 0.0),
            Vector3::new(2.0, 0.0, 0.0),
            Vector3::new(2.0, 3.0, 0.0),
            Vector3::new(0.0, 3.0, 0.0),
        ];
        let surface = Surface::new(&faces, &PenaltySettings::default());
        let law = RubberFriction::default();
        let friction = Friction::On(law);
        let start = surface.initial_state(x.clone(), [0.0; 3]);
        let (state, totals) = surface.commit(&friction, &start, &x, [0.5, 0.0, 0.001]);
        let pressure = PenaltySettings::default().penalty_mpa_per_mm * 0.001;
        assert!((totals.force.z - 6.0 * pressure).abs() < 1e-12);
        assert!((totals.force.x - 6.0 * law.strength(pressure).0).abs() < 1e-12);
        assert_eq!(totals.stuck_area, 0.0);
        assert!((totals.area - 6.0).abs() < 1e-12);
        assert!((surface.contact_areas(&state)[0][0] - 6.0).abs() < 1e-12);
        let exact = 6.0 * law.strength(pressure).0 * (0.5 - law.gamma_crit_mm);
        assert!((totals.dissipation - exact).abs() < 1e-12);
    }
}
