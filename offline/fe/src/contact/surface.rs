//! Contact forces of all faces and their tangent, integrated at face quadrature points.
//!
//! Virtual work is `int t . du dA` over the current area projected on the plane, `t` the traction that the
//! plane exerts on the finger: pressure along +z, friction in x and y.

use nalgebra::Vector3;

use super::{ContactState, Friction, PenaltySettings, Plane, PointState, Totals};
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

struct RulePoint {
    shape: [f64; 4],
    gradient: [[f64; 2]; 4],
    weight: f64,
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
        friction: &Friction,
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
        let plane_step = [plane[0] - last.plane[0], plane[1] - last.plane[1]];
        for (f, face) in self.faces.iter().enumerate() {
            let x = face.map(|n| position[n]);
            let states = &last.points[f * self.rule.len()..][..self.rule.len()];
            if self.is_clear(&x, plane[2], states) {
                continue;
            }
            let moved = face.map(|n| position[n] - last.position[n]);
            let mut force = [Vector3::zeros(); 4];
            let mut block: Option<Box<[[f64; 12]; 12]>> = None;
            for (rule, state) in self.rule.iter().zip(states) {
                let z = interpolate(&rule.shape, &x, 2);
                let pressure = state.multiplier + self.penalty * (plane[2] - z);
                if !(pressure > 0.0) {
                    continue;
                }
                let (tangent_xi, tangent_eta) = tangents(&rule.gradient, &x);
                let jacobian = tangent_xi.y * tangent_eta.x - tangent_xi.x * tangent_eta.y;
                if !(jacobian > 0.0) {
                    continue;
                }
                let area = jacobian * rule.weight;
                let mut t = Vector3::new(0.0, 0.0, pressure);
                let mut stiffness = [[0.0; 2]; 2];
                let mut over_pressure = [0.0; 2];
                let mut over_share = [0.0; 2];
                let mut share_per_advance = 0.0;
                if let Friction::On(law) = friction {
                    let step = [0, 1].map(|k| plane_step[k] - interpolate(&rule.shape, &moved, k));
                    let touch = Touch::of(state, gap_before(rule, face, last), plane[2] - last.plane[2]);
                    let trial = [0, 1].map(|k| state.elastic_slip[k] + touch.share * step[k]);
                    let (strength, slope) = law.strength(pressure);
                    let force_stick = predict_stick && state.stuck;
                    let (traction, elastic, stuck) = law.return_map(trial, strength, force_stick);
                    t.x = traction[0];
                    t.y = traction[1];
                    if tangent {
                        stiffness = law.slip_stiffness(trial, strength, stuck);
                        over_pressure = elastic.map(|g| g / law.gamma_crit_mm * slope);
                        over_share = [0, 1].map(|k| stiffness[k][0] * step[0] + stiffness[k][1] * step[1]);
                        share_per_advance = touch.share_per_advance;
                        stiffness = stiffness.map(|row| row.map(|s| s * touch.share));
                    }
                }
                for a in 0..4 {
                    force[a] += t * (rule.shape[a] * area);
                }
                if !tangent {
                    continue;
                }
                let block = block.get_or_insert_with(|| Box::new([[0.0; 12]; 12]));
                for b in 0..4 {
                    // dt/dx_b, columns x, y, z; the area changes with x and y alone.
                    let n = rule.shape[b];
                    let [b_xi, b_eta] = rule.gradient[b];
                    let dt = [
                        Vector3::new(-stiffness[0][0], -stiffness[1][0], 0.0) * (n * area),
                        Vector3::new(-stiffness[0][1], -stiffness[1][1], 0.0) * (n * area),
                        Vector3::new(over_pressure[0], over_pressure[1], 1.0) * (-self.penalty * n * area),
                    ];
                    let d_area = [
                        (tangent_xi.y * b_eta - b_xi * tangent_eta.y) * rule.weight,
                        (b_xi * tangent_eta.x - tangent_xi.x * b_eta) * rule.weight,
                        0.0,
                    ];
                    for k in 0..3 {
                        let column = dt[k] + t * d_area[k];
                        for a in 0..4 {
                            let value = column * (-rule.shape[a]);
                            let target = &mut block[3 * b + k];
                            target[3 * a] += value.x;
                            target[3 * a + 1] += value.y;
                            target[3 * a + 2] += value.z;
                        }
                    }
                }
                let by_plane = [
                    Vector3::new(stiffness[0][0], stiffness[1][0], 0.0) * area,
                    Vector3::new(stiffness[0][1], stiffness[1][1], 0.0) * area,
                    Vector3::new(over_pressure[0], over_pressure[1], 1.0) * (self.penalty * area)
                        + Vector3::new(over_share[0], over_share[1], 0.0) * (share_per_advance * area),
                ];
                for a in 0..4 {
                    for k in 0..3 {
                        out.plane_columns[face[a]][k] -= by_plane[k] * rule.shape[a];
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
        friction: &Friction,
        last: &ContactState,
        position: &[Vector3<f64>],
        plane: Plane,
    ) -> (ContactState, Totals) {
        let mut points = vec![PointState::default(); last.points.len()];
        let mut totals = Totals { min_dissipation_density: f64::INFINITY, ..Default::default() };
        let plane_step = [plane[0] - last.plane[0], plane[1] - last.plane[1]];
        for (f, face) in self.faces.iter().enumerate() {
            let x = face.map(|n| position[n]);
            let range = f * self.rule.len()..(f + 1) * self.rule.len();
            let states = &last.points[range.clone()];
            if self.is_clear(&x, plane[2], states) {
                continue;
            }
            let moved = face.map(|n| position[n] - last.position[n]);
            for ((rule, state), new) in self.rule.iter().zip(states).zip(&mut points[range]) {
                let z = interpolate(&rule.shape, &x, 2);
                let pressure = state.multiplier + self.penalty * (plane[2] - z);
                let (tangent_xi, tangent_eta) = tangents(&rule.gradient, &x);
                let jacobian = tangent_xi.y * tangent_eta.x - tangent_xi.x * tangent_eta.y;
                if !(pressure > 0.0) || !(jacobian > 0.0) {
                    continue;
                }
                let area = jacobian * rule.weight;
                totals.penetration = totals.penetration.max(plane[2] - z);
                *new = PointState { multiplier: state.multiplier, pressure, area, stuck: true, ..*new };
                let touch = Touch::of(state, gap_before(rule, face, last), plane[2] - last.plane[2]);
                let step = [0, 1].map(|k| touch.share * (plane_step[k] - interpolate(&rule.shape, &moved, k)));
                new.slip = [0, 1].map(|k| state.slip[k] + step[k]);
                if let Friction::On(law) = friction {
                    let trial = [0, 1].map(|k| state.elastic_slip[k] + step[k]);
                    let (strength, _) = law.strength(pressure);
                    let (traction, elastic, _) = law.return_map(trial, strength, false);
                    new.traction = traction;
                    new.elastic_slip = elastic;
                    // A point that is held at its limit has not come to rest.
                    new.stuck = elastic[0].hypot(elastic[1]) < law.gamma_crit_mm * (1.0 - 1e-6);
                    let plastic = (0..2).map(|k| traction[k] * (trial[k] - elastic[k])).sum::<f64>();
                    totals.min_dissipation_density = totals.min_dissipation_density.min(plastic);
                    totals.dissipation += plastic * area;
                    let stored = (0..2).map(|k| traction[k] * elastic[k]).sum::<f64>();
                    totals.elastic_energy += 0.5 * stored * area;
                }
                totals.force += Vector3::new(new.traction[0], new.traction[1], pressure) * area;
                for k in 0..2 {
                    totals.pressure_moment[k] += pressure * area * interpolate(&rule.shape, &x, k);
                }
                totals.area += area;
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
    fn is_clear(&self, x: &[Vector3<f64>; 4], height: f64, states: &[PointState]) -> bool {
        x.iter().all(|x| x.z > height) && states.iter().all(|s| s.multiplier == 0.0)
    }
}

/// Gap of a contact point at the start of the increment, mm.
fn gap_before(rule: &RulePoint, face: &[usize; 4], last: &ContactState) -> f64 {
    (0..4).map(|a| rule.shape[a] * last.position[face[a]].z).sum::<f64>() - last.plane[2]
}

/// How much of an increment's motion a contact point sees: all of it, or what is left after the plane reached it.
struct Touch {
    /// 0 to 1.
    share: f64,
    /// Derivative of `share` over the plane's advance, 1/mm.
    share_per_advance: f64,
}

impl Touch {
    /// * `gap`, mm: at the start of the increment
    /// * `advance`, mm: of the plane toward the finger in the increment
    fn of(state: &PointState, gap: f64, advance: f64) -> Self {
        if state.pressure > 0.0 || !(gap > 0.0) || !(advance > 0.0) {
            return Self { share: 1.0, share_per_advance: 0.0 };
        }
        if gap >= advance {
            // The skin came to the plane rather than the plane to the skin: the less the plane advanced, the less does
            // its advance say of when. Smooth to the whole motion of a slide at fixed depth.
            let part = advance / gap;
            return Self { share: 1.0 - part * part, share_per_advance: -2.0 * part / gap };
        }
        Self { share: 1.0 - gap / advance, share_per_advance: gap / (advance * advance) }
    }
}

fn interpolate(shape: &[f64; 4], values: &[Vector3<f64>; 4], k: usize) -> f64 {
    shape[0] * values[0][k] + shape[1] * values[1][k] + shape[2] * values[2][k] + shape[3] * values[3][k]
}

fn tangents(gradient: &[[f64; 2]; 4], x: &[Vector3<f64>; 4]) -> (Vector3<f64>, Vector3<f64>) {
    let mut sums = (Vector3::zeros(), Vector3::zeros());
    for a in 0..4 {
        sums.0 += x[a] * gradient[a][0];
        sums.1 += x[a] * gradient[a][1];
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Quadrature, RubberFriction};

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
