//! Contact forces of all surface nodes and their tangent.
//!
//! Contact acts at the nodes. A node carries the normal force `N = eps D max(-g, 0)`, `D` its part of the reference
//! surface, g its gap to the rigid body, along the body's normal at the closest point. It carries friction through one
//! elastic slip of its own. There are as many tangential conditions as displacements, so that sticking nodes stick
//! exactly.
//!
//! The edge of the contact runs inside faces. It is the zero contour of a field that is the nominal pressure `N/D` at
//! nodes that touch and `-c E* g/h` at nodes that are open by g (E* plane-strain modulus, h size of the faces there).
//! Near the edge of any smooth contact the pressure falls as `K sqrt(s)` and the gap opens as `4 K s^1.5/(3 E*)` [K. L.
//! Johnson, Contact Mechanics, 1985, sections 4.2 and 5.1]. A contour that is right in the mean over all places of the
//! edge between two nodes has c = 1.5, which on a half-space gives the area of a Hertz contact of four faces' radius to
//! 0.5 %. The part of a face inside the contour belongs to the corners that touch, in proportion to their shape
//! functions there: the strip beyond the last node that touches carries friction too. A node's friction is bounded by
//! `S = W tau_crit(N/W)`, W its part of the area.
//!
//! The elastic slip is a vector along the rigid body's surface in the body's material frame, so that turning body and
//! finger together changes nothing. If a node has moved along a curved surface, its earlier elastic slip is projected
//! on the new tangent plane: the angle between the two is that of one increment, and for a node that sticks only that
//! of its elastic slip.

use nalgebra::{Matrix3, Vector3};

use super::area::{Parts, reference_shares};
use super::contour::Facet;
use super::orthotropy::{LineElement, SkinAxis, line_elements};
use super::plane::{Frame, SPIN, Twist};
use super::{
    ContactState, FrictionLaw, NodeState, Outline, PenaltySettings, Plane, Reach, RigidBody, Sliding, Spot, Totals,
};

/// Tangential over normal constant of the edge: slip opens behind a stick front with 4 G in mode II and 2 G in mode III,
/// 3 G in the mean, where a gap opens with 4 G (of an incompressible body, on a rigid plane).
const SHEAR_EDGE: f64 = 0.75;

/// Slip since stick that still counts as stick, share of the elastic slip at the strength: 0.3 µm of 6 µm.
const STICK_SLIP_SHARE: f64 = 0.05;

/// Motion of the plane along itself above which it has a direction, mm.
const LEAST_MOTION_MM: f64 = 1e-9;

/// Derivative of a node's residual force over a position, N/mm, finger's frame.
pub struct NodeTangent {
    /// Surface node whose force it is.
    pub node: usize,
    /// Surface node that moves: the same, or another corner of its faces where parts of the area follow.
    pub by: usize,
    /// Derivative.
    pub block: Matrix3<f64>,
}

/// Contact residual at trial positions.
#[derive(Default)]
pub struct Evaluation {
    /// Residual force of each surface node (minus what the plane exerts), N, finger's frame.
    pub residual: Vec<Vector3<f64>>,
    /// Tangents of the nodes in contact, if requested; several may be of the same two nodes.
    pub tangents: Vec<NodeTangent>,
    /// Derivative of the residual of nodes in contact over the spin of the increment, in addition to the rotation with
    /// the plane, N/rad, if requested.
    pub by_spin: Vec<(usize, Vector3<f64>)>,
    /// Force that the plane exerts along its unspun axes, N, and its moment about the foot, N mm.
    pub wrench: [f64; 6],
}

/// The surface that may touch the plane: faces of a mesh.
pub struct Pad<'a> {
    /// Quadrilaterals, mesh nodes counter-clockwise from outside.
    pub quads: &'a [[u32; 4]],
    /// Linear triangles, likewise.
    pub triangles: &'a [[u32; 3]],
    /// Undeformed positions of all mesh nodes, mm.
    pub undeformed: &'a [Vector3<f64>],
    /// Plane-strain modulus `E/(1 - nu²)` of the undeformed body at each mesh node, MPa.
    pub modulus_mpa: &'a [f64],
    /// Whether a mesh node can carry contact.
    pub can_carry: &'a dyn Fn(u32) -> bool,
}

/// Faces of a body that may touch the plane.
pub struct Surface {
    /// Mesh node of each surface node.
    pub nodes: Vec<u32>,
    /// Faces as surface nodes, counter-clockwise from outside.
    pub facets: Vec<Facet>,
    /// First touch in any pose.
    pub reach: Reach,
    /// Part of the reference surface of each surface node, mm².
    pub(super) reference_area: Vec<f64>,
    /// Negative pressure per gap of relaxed tissue, MPa/mm.
    per_gap: Vec<f64>,
    /// Stress of the tissue over that of relaxed tissue in the same place.
    stiffening: f64,
    pub(super) penalty: f64,
    line_elements: Vec<LineElement>,
}

/// Treatment of the tangential forces in a search for equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tangential {
    /// They follow the friction law.
    Law,
    /// The same, but that nodes do not slip that stuck at the end of the last increment.
    Stick,
    /// They keep their values of the end of the last increment, so that the normal forces can converge first.
    Held,
}

/// The state at the start of an increment, with its motion.
struct Increment<'a> {
    law: &'a dyn FrictionLaw,
    last: &'a ContactState,
    /// Turn of the slip's direction at a place relative to the plane's material, rad.
    turn_rad: f64,
}

impl<'a> Increment<'a> {
    /// The increment from the end of the `last` to `plane`: a plane that slides and spins at even rates passes a place in one
    /// direction, against which its material turns.
    fn new(law: &'a dyn FrictionLaw, last: &'a ContactState, plane: &Plane) -> Self {
        Self { law, last, turn_rad: last.plane.at[SPIN] - plane.at[SPIN] }
    }
}

/// A node in contact. Pairs of numbers are along the two tangents.
struct Touch {
    normal_force: f64,
    spot: Spot,
    tangents: [Vector3<f64>; 2],
    /// Earlier elastic slip plus the displacement since, before it is projected on the tangents, along the normal, mm.
    off_surface: f64,
    /// Elastic slip before the return map, mm.
    trial: [f64; 2],
    sliding: Sliding,
    /// Axis of the skin, if friction is orthotropic.
    axis: Option<SkinAxis>,
    /// Turn of the slip's direction in the increment, rad, over that about the body's axis z.
    turn_share: f64,
    /// Area on which the law acts, mm².
    area: f64,
}

impl Touch {
    /// A vector along the surface.
    fn along(&self, v: [f64; 2]) -> Vector3<f64> {
        self.tangents[0] * v[0] + self.tangents[1] * v[1]
    }

    /// Friction on the finger, N.
    fn friction(&self) -> Vector3<f64> {
        self.along(self.sliding.traction) * self.area
    }

    /// Force on the finger in the body's frame, N.
    fn force(&self) -> Vector3<f64> {
        self.friction() + self.spot.normal * self.normal_force
    }

    /// Derivative of the friction `area * traction(N / area)` over the area, MPa.
    fn force_per_area(&self) -> [f64; 2] {
        let Sliding { traction, by_pressure, .. } = &self.sliding;
        let pressure = if self.area > 0.0 { self.normal_force / self.area } else { 0.0 };
        [0, 1].map(|k| traction[k] - pressure * by_pressure[k])
    }
}

impl Surface {
    /// Surface of a pad.
    pub fn new(pad: &Pad, settings: &PenaltySettings) -> Self {
        let corners = || pad.quads.iter().flatten().chain(pad.triangles.iter().flatten());
        let mut nodes: Vec<u32> = corners().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let place = |node: u32| nodes.binary_search(&node).expect("listed above");
        let quads = pad.quads.iter().map(|face| Facet::Quad(face.map(place)));
        let facets: Vec<Facet> =
            quads.chain(pad.triangles.iter().map(|face| Facet::Triangle(face.map(place)))).collect();
        let undeformed: Vec<Vector3<f64>> = nodes.iter().map(|&n| pad.undeformed[n as usize]).collect();
        let mut reference_area = vec![0.0; nodes.len()];
        let mut face_area = vec![(0.0, 0); nodes.len()];
        for facet in &facets {
            let shares = reference_shares(facet, &undeformed);
            let whole: f64 = shares.iter().sum();
            for (&node, share) in facet.corners().iter().zip(shares) {
                reference_area[node] += share;
                face_area[node].0 += whole;
                face_area[node].1 += 1;
            }
        }
        for (area, &node) in reference_area.iter_mut().zip(&nodes) {
            if !(pad.can_carry)(node) {
                *area = 0.0;
            }
        }
        let modulus = nodes.iter().map(|&n| pad.modulus_mpa[n as usize]);
        let per_gap = face_area
            .iter()
            .zip(modulus)
            .map(|(&(sum, count), modulus)| settings.edge_constant * modulus / (sum / f64::from(count)).sqrt())
            .collect();
        Self {
            line_elements: line_elements(&facets, &undeformed),
            nodes,
            facets,
            reach: Reach::of_plane(Outline::of_points(undeformed, pad.undeformed)),
            reference_area,
            per_gap,
            stiffening: 1.0,
            penalty: settings.penalty_mpa_per_mm,
        }
    }

    /// Sets the rigid body to `body`, which starts at `start`; the `outline` is that of the present reach if there is
    /// none.
    pub fn set_rigid_body(&mut self, body: RigidBody, outline: Option<Outline>, start: &Plane) {
        self.reach = Reach::new(outline.unwrap_or_else(|| self.reach.outline().clone()), body, start);
    }

    /// The rigid body that it touches.
    pub fn body(&self) -> &RigidBody {
        self.reach.body()
    }

    /// Depth inside the body of the deepest node that cannot carry contact, mm; 0 if there is none.
    pub fn penetration_beside_pad_mm(&self, state: &ContactState) -> f64 {
        let beside_pad = state.position.iter().zip(&self.reference_area).filter(|(_, area)| **area == 0.0);
        beside_pad.map(|(y, _)| -self.body().spot(y).gap_mm).fold(0.0, f64::max)
    }

    /// Local geometry of the body at places of its frame.
    pub(super) fn spots(&self, place: &[Vector3<f64>]) -> Vec<Spot> {
        place.iter().map(|y| self.body().spot(y)).collect()
    }

    /// Half the side of a square of the surface's area, mm: a length for moments.
    pub fn size_mm(&self) -> f64 {
        0.5 * self.reference_area.iter().sum::<f64>().sqrt()
    }

    /// Sets the stress of the tissue over that of relaxed tissue in the same place.
    pub fn set_stiffening(&mut self, stiffening: f64) {
        self.stiffening = stiffening;
    }

    /// Negative pressure of an open node per gap, MPa/mm.
    pub(super) fn per_gap(&self, node: usize) -> f64 {
        self.stiffening * self.per_gap[node]
    }

    /// The frame of a place of the plane.
    pub fn frame(&self, plane: &Plane) -> Frame {
        plane.frame(&self.reach)
    }

    /// Force on a touching node per penetration, in the mean, N/mm.
    pub fn penalty_stiffness(&self) -> f64 {
        self.penalty * self.reference_area.iter().sum::<f64>() / self.nodes.len() as f64
    }

    /// State before any contact; `position` in the finger's frame.
    pub fn initial_state(&self, position: &[Vector3<f64>], plane: Plane) -> ContactState {
        let frame = self.frame(&plane);
        let position: Vec<Vector3<f64>> = position.iter().map(|x| frame.to_plane(x)).collect();
        let point = self.spots(&position).iter().map(|spot| spot.point).collect();
        ContactState { nodes: vec![NodeState::default(); self.nodes.len()], position, point, plane }
    }

    /// Residual forces and, if `tangent`, their derivatives at trial `position` and `plane`.
    ///
    #[expect(clippy::too_many_arguments, reason = "the state of an increment, spelled out")]
    pub fn evaluate(
        &self,
        law: &dyn FrictionLaw,
        last: &ContactState,
        parts: Parts,
        position: &[Vector3<f64>],
        plane: &Plane,
        tangential: Tangential,
        tangent: bool,
    ) -> Evaluation {
        let frame = self.frame(plane);
        let foot = frame.foot();
        let spots: Vec<Spot> = position.iter().map(|x| self.body().spot(&frame.to_plane(x))).collect();
        let followed = match parts {
            Parts::Followed => self.areas_at(last, &spots),
            Parts::Held(_) => Vec::new(),
        };
        let areas = if let Parts::Held(held) = parts { held } else { &followed };
        // Friction per part of the area, MPa.
        let mut per_area = vec![[0.0; 2]; if tangent { followed.len() } else { 0 }];
        let mut out = Evaluation { residual: vec![Vector3::zeros(); self.nodes.len()], ..Default::default() };
        let (mut sum, mut moment) = (Vector3::zeros(), Vector3::zeros());
        let increment = Increment::new(law, last, plane);
        for (node, x) in position.iter().enumerate() {
            let Some(touch) = self.touch(&increment, node, &spots, areas[node], tangential) else { continue };
            let force = frame.to_finger(&touch.force());
            out.residual[node] = -force;
            sum += force;
            moment += (x - foot).cross(&force);
            if tangent {
                let block = -frame.map_to_finger(&self.force_change(node, increment.turn_rad, &touch));
                out.tangents.push(NodeTangent { node, by: node, block });
                if let (Some(axis), Some(orthotropy)) = (&touch.axis, law.orthotropy()) {
                    let by_axis = touch.along(touch.sliding.by_axis) * -touch.area;
                    let turns = axis.turns(orthotropy, &self.line_elements[node], node, &touch.spot);
                    out.tangents.extend(turns.map(|(by, turn)| {
                        let block = frame.map_to_finger(&(by_axis * turn.transpose()));
                        NodeTangent { node, by, block }
                    }));
                }
                let by_spin = touch.along(touch.sliding.by_turn) * (touch.area * touch.turn_share);
                out.by_spin.push((node, frame.to_finger(&by_spin)));
                if let Some(per_area) = per_area.get_mut(node) {
                    *per_area = touch.force_per_area();
                }
            }
        }
        if per_area.iter().any(|q| *q != [0.0; 2]) {
            let changes = self.area_changes(last, &spots).into_iter();
            out.tangents.extend(changes.filter(|c| per_area[c.node] != [0.0; 2]).map(|change| {
                let [x, y] = per_area[change.node];
                let [s, t] = spots[change.node].tangents();
                let of_force = (s * x + t * y) * change.gradient.transpose();
                NodeTangent { node: change.node, by: change.by, block: -frame.map_to_finger(&of_force) }
            }));
        }
        let (sum, moment) = (frame.along_axes(&sum), frame.along_axes(&moment));
        out.wrench = [sum.x, sum.y, sum.z, moment.x, moment.y, moment.z];
        out
    }

    /// Derivative of the residual over a coordinate of the plane whose motion is `twist`.
    pub fn change_with_plane(
        &self,
        evaluation: &Evaluation,
        position: &[Vector3<f64>],
        foot: &Vector3<f64>,
        twist: &Twist,
    ) -> Vec<Vector3<f64>> {
        let mut out = vec![Vector3::zeros(); self.nodes.len()];
        for (out, residual) in out.iter_mut().zip(&evaluation.residual) {
            *out = twist.turn.cross(residual);
        }
        for NodeTangent { node, by, block } in &evaluation.tangents {
            out[*node] -= block * twist.velocity(&(position[*by] - foot));
        }
        for (node, by_spin) in &evaluation.by_spin {
            out[*node] += by_spin * twist.spin;
        }
        out
    }

    /// New state of every node at `position` and `plane`, and the sums over them; `areas` as in [`Self::evaluate`].
    pub fn commit(
        &self,
        law: &dyn FrictionLaw,
        last: &ContactState,
        areas: &[f64],
        position: &[Vector3<f64>],
        plane: Plane,
    ) -> (ContactState, Totals) {
        let (frame, frame_before) = (self.frame(&plane), self.frame(&last.plane));
        let foot = frame.foot();
        let mut nodes = vec![NodeState::default(); self.nodes.len()];
        let mut totals = Totals { min_dissipation_mj: f64::INFINITY, ..Default::default() };
        let place: Vec<Vector3<f64>> = position.iter().map(|x| frame.to_plane(x)).collect();
        let increment = Increment::new(law, last, &plane);
        let spots = self.spots(&place);
        for (node, (y, spot)) in place.iter().zip(&spots).enumerate() {
            let before = &last.nodes[node];
            let passed = y - frame.to_plane(&(frame_before.from_plane(y)));
            let passed = passed - spot.normal * spot.normal.dot(&passed);
            let way = passed.norm();
            let direction = if way > LEAST_MOTION_MM { passed / way } else { before.direction };
            let Some(touch) = self.touch(&increment, node, &spots, areas[node], Tangential::Law) else {
                totals.leave(before, &last.point[node], &spot.point);
                nodes[node].direction = direction;
                continue;
            };
            let force = touch.force();
            let trial = touch.along(touch.trial);
            let new = NodeState {
                elastic_slip: touch.along(touch.sliding.elastic_slip),
                slip: before.slip + trial - before.elastic_slip,
                slip_since_stick_mm: 0.0,
                direction,
                multiplier: before.multiplier,
                normal_force_n: touch.normal_force,
                tangential_force_n: touch.friction(),
                area: areas[node],
                stuck: touch.sliding.at_rest,
            };
            let plastic = trial - new.elastic_slip;
            totals.add(before, &new, &plastic);
            totals.penetration = totals.penetration.max(-spot.gap_mm);
            let force = frame.to_finger(&force);
            totals.force += force;
            totals.moment += (position[node] - foot).cross(&force);
            nodes[node] = new;
            if !new.stuck {
                // A node whose slip changes its sense stuck in between. So did a node past which the body now moves in
                // the opposite sense and that slips on a little, since it lost pressure faster than shear.
                let turned_back = before.elastic_slip.dot(&plastic) < 0.0 || before.direction.dot(&passed) < 0.0;
                let since = if turned_back { 0.0 } else { before.slip_since_stick_mm };
                nodes[node].slip_since_stick_mm = since + plastic.norm();
            }
        }
        totals.force = frame.along_axes(&totals.force);
        totals.moment = frame.along_axes(&totals.moment);
        let point = spots.iter().map(|spot| spot.point).collect();
        let state = ContactState { nodes, position: place, point, plane };
        totals.area = self.contact_areas(&state).iter().map(|a| a[0]).sum();
        totals.stuck_area = self.stuck_areas(law, &state).iter().sum();
        (state, totals)
    }

    /// Force or moment of the plane on the finger that does work in each coordinate, N or N mm.
    pub fn generalised_forces(&self, plane: &Plane, totals: &Totals) -> [f64; 6] {
        let frame = self.frame(plane);
        let along = |v: &Vector3<f64>| frame.axis(0) * v.x + frame.axis(1) * v.y + frame.axis(2) * v.z;
        let (force, moment) = (along(&totals.force), along(&totals.moment));
        std::array::from_fn(|k| {
            let twist = plane.twist(k, &self.reach);
            force.dot(&twist.motion) + moment.dot(&twist.turn)
        })
    }

    /// Moves the pressure of `converged` into the multipliers of `state` (one step of Uzawa's method).
    pub fn augment(&self, state: &mut ContactState, converged: &ContactState) {
        for ((node, new), area) in state.nodes.iter_mut().zip(&converged.nodes).zip(&self.reference_area) {
            node.multiplier = if *area > 0.0 { new.normal_force_n / area } else { 0.0 };
        }
    }

    /// Stuck area of each face, mm², by the contour between nodes that stick and nodes that slip.
    ///
    /// The contour is that of a signed field. A node that sticks enters with the rest of its strength along the plane's
    /// last motion; one that slips enters with its slip since it last stuck as a negative traction, in the same way as
    /// a gap becomes a negative pressure. Slip by a small share of the elastic slip still counts as stick: where the
    /// body reverses, nodes at the rim lose pressure faster than shear and slip on by up to a tenth of a micrometre.
    pub fn stuck_areas(&self, law: &dyn FrictionLaw, state: &ContactState) -> Vec<f64> {
        let force: Vec<f64> = state.nodes.iter().map(|n| n.normal_force_n).collect();
        let spots = self.spots(&state.position);
        let contact = self.contact_level(&spots, &force);
        if state.nodes.iter().all(|n| n.stuck || !(n.normal_force_n > 0.0)) {
            return self.face_areas(&spots, &contact);
        }
        let strengths: Vec<f64> = state.nodes.iter().map(|n| law.strength(n.pressure_mpa()).0 * n.area).collect();
        let (strength, normal): (f64, f64) = (strengths.iter().sum(), force.iter().sum());
        let ratio = strength / normal;
        let level: Vec<f64> = state
            .nodes
            .iter()
            .enumerate()
            .map(|(k, node)| {
                if !(node.normal_force_n > 0.0) {
                    return ratio * contact[k];
                }
                let stick_limit_mm = STICK_SLIP_SHARE * node.elastic_slip.norm();
                let stick_share = if node.stuck { 1.0 } else { 1.0 - node.slip_since_stick_mm / stick_limit_mm };
                // Without elastic slip there is no stick_share part: NaN.
                if !(stick_share > 0.0) {
                    return -SHEAR_EDGE * self.per_gap(k) * (node.slip_since_stick_mm - stick_limit_mm);
                }
                stick_share
                    * (law.strength(node.pressure_mpa()).0 * reserve(law, node, self.axis(law, k, &spots).as_ref()))
                        .min(ratio * contact[k])
            })
            .collect();
        self.face_areas(&spots, &level)
    }

    /// Force with which the body presses on a node, N.
    pub(super) fn normal_force(&self, node: usize, gap_mm: f64, last: &ContactState) -> f64 {
        (self.reference_area[node] * (last.nodes[node].multiplier - self.penalty * gap_mm)).max(0.0)
    }

    /// Gap below which the body presses on a node, mm.
    pub fn touching_gap_mm(&self, node: usize, last: &ContactState) -> f64 {
        last.nodes[node].multiplier / self.penalty
    }

    /// The node `node` at `spot` of the body; None if it does not touch.
    fn touch(
        &self,
        increment: &Increment,
        node: usize,
        spots: &[Spot],
        area: f64,
        tangential: Tangential,
    ) -> Option<Touch> {
        let spot = &spots[node];
        let Increment { law, last, turn_rad } = *increment;
        let normal_force = self.normal_force(node, spot.gap_mm, last);
        if !(normal_force > 0.0) {
            return None;
        }
        let before = &last.nodes[node];
        // The body's material moves past the skin in the direction opposite to the skin's motion in the body's frame.
        let way = before.elastic_slip + last.point[node] - spot.point;
        let tangents = spot.tangents();
        let trial = tangents.map(|t| t.dot(&way));
        let pressure = if area > 0.0 { normal_force / area } else { 0.0 };
        let turn_share = spot.normal.z;
        let axis = self.axis(law, node, spots);
        let sliding = match tangential {
            Tangential::Held => {
                let force = before.tangential_force_n;
                let traction = tangents.map(|t| if area > 0.0 { t.dot(&force) / area } else { 0.0 });
                Sliding { traction, ..Sliding::FRICTIONLESS }
            }
            _ => {
                let sticks = tangential == Tangential::Stick && before.stuck;
                let turn_rad = turn_rad * turn_share;
                match &axis {
                    None => law.return_map(trial, pressure, sticks).turned(trial, turn_rad),
                    Some(axis) => axis.return_map(law, trial, pressure, sticks, turn_rad),
                }
            }
        };
        let off_surface = spot.normal.dot(&way);
        Some(Touch { normal_force, spot: *spot, tangents, off_surface, trial, sliding, axis, turn_share, area })
    }

    /// The axis of the skin at a node, if friction is orthotropic.
    fn axis(&self, law: &dyn FrictionLaw, node: usize, spots: &[Spot]) -> Option<SkinAxis> {
        law.orthotropy()?.axis(&self.line_elements[node], node, spots)
    }

    /// Derivative of a node's force over its place in the body's frame, N/mm.
    fn force_change(&self, node: usize, turn_rad: f64, touch: &Touch) -> Matrix3<f64> {
        let Touch { spot: Spot { gap_mm, normal, bend, .. }, tangents: [s, t], area, .. } = touch;
        let Sliding { by_slip, by_pressure, by_turn, .. } = &touch.sliding;
        let per_gap = -self.penalty * self.reference_area[node];
        // The force is area times traction(N / area): per normal force the traction's own slope is left.
        let by_force = if *area > 0.0 { touch.along(*by_pressure) } else { Vector3::zeros() };
        // Change of the slip before the return map, without its part along the normal, which is orthogonal to the
        // tangents.
        let slip = bend * (gap_mm - touch.off_surface) - Matrix3::identity();
        let (over_s, over_t) = (s.transpose() * slip, t.transpose() * slip);
        let friction =
            (s * by_slip[0][0] + t * by_slip[1][0]) * over_s + (s * by_slip[0][1] + t * by_slip[1][1]) * over_t;
        let turned = touch.along(*by_turn) * turn_rad * bend.row(2);
        (normal + by_force) * normal.transpose() * per_gap + bend * touch.normal_force + (friction + turned) * *area
            - normal * (touch.friction().transpose() * bend)
    }
}

/// The rest of a stuck node's strength along the plane's last motion, as a share of it: the further elastic slip in
/// that direction up to the limit.
fn reserve(law: &dyn FrictionLaw, node: &NodeState, axis: Option<&SkinAxis>) -> f64 {
    let strength = law.strength(node.pressure_mpa()).0 * node.area;
    if !(strength > 0.0) {
        return 1.0;
    }
    let used = node.tangential_force_n / strength;
    let [used, direction] = axis.map_or([used, node.direction], |axis| axis.scaled_use(&used, &node.direction));
    if direction == Vector3::zeros() {
        return 1.0 - used.norm();
    }
    let along = used.dot(&direction);
    let across = (used - direction * along).norm_squared();
    (1.0 - across).max(0.0).sqrt() - along
}

impl Totals {
    /// Subtracts the elastic slip energy of a node that lost contact, and adds the work of its force along the motion
    /// `from` `to`.
    fn leave(&mut self, before: &NodeState, from: &Vector3<f64>, to: &Vector3<f64>) {
        let end = before.elastic_slip + from - to;
        self.elastic_energy_by_pressure -= 0.5 * before.tangential_force_n.dot(&end);
    }

    /// Adds the energies of a node whose plastic slip in the increment was `plastic`, mm.
    ///
    /// Forces act with their mean over the increment, as they do in the body's work.
    fn add(&mut self, before: &NodeState, new: &NodeState, plastic: &Vector3<f64>) {
        self.dissipation += 0.5 * (before.tangential_force_n + new.tangential_force_n).dot(plastic);
        self.elastic_energy += 0.5 * new.tangential_force_n.dot(&new.elastic_slip);
        let by_old = new.tangential_force_n.dot(&before.elastic_slip);
        self.elastic_energy_by_pressure += 0.5 * (by_old - before.tangential_force_n.dot(&new.elastic_slip));
        self.min_dissipation_mj = self.min_dissipation_mj.min(new.tangential_force_n.dot(plastic));
    }
}

#[cfg(test)]
mod tests;
