//! A pad on a body in a pose as the finger of the observer: a press and pulls give its tables over depth.
//!
//! Main type: [`PadTwin`]. Uses stick and the pad.

use super::finger::{Observable, TwinForces};
use super::stick::{Curves, stick_ratios};
use crate::math::{Elementary, Scalar, sqrt};
use crate::pad::{PadOn, PadState, Surface};
use crate::{Error, FingerModel, Motion, Response};

/// Cells of the tables over depth.
const CELLS: usize = 12;
/// Steps of the press in a cell.
const PRESSES: u32 = 2;
/// A strength factor at which everything sticks, and a slide in that state, mm.
const STICKS: f32 = 5.0;
const SMALL_MM: f32 = 2e-3;
/// About the exponent of normal force and limit over depth. Between the nodes their roots are straight.
const EXPONENT: f32 = 1.7;
/// Bounds of a twin's limit over that of the tables, and the least normal force at which it counts, N.
const RATIOS: [f32; 2] = [0.25, 4.0];
const LEAST_N: f32 = 1e-3;
const DT_S: f32 = 1e-3;

/// A pad of the bank, with the part of its last forces that gives the margin.
#[derive(Clone, Copy, Debug)]
pub struct PadTwin<const P: usize> {
    state: PadState<P>,
    normal_n: f32,
    /// Largest friction in the direction of the present one, at a strength factor of 1, N.
    limit_n: f32,
    /// Force along x and y by pressure on the slopes of a curved body, N.
    slope_n: [f32; 2],
    /// Share of the limit that the moment of friction uses.
    turning: f32,
}

/// Forces of a press and stiffness at a depth.
#[derive(Clone, Copy, Debug, Default)]
pub struct Node {
    /// Roots of the normal force and of the limit at a strength factor of 1.
    normal: f32,
    limit: f32,
    stiffness_n_mm: f32,
}

/// The tables of a pad.
#[derive(Clone, Copy, Debug)]
pub struct PadTables {
    nodes: [Node; CELLS + 1],
    sticks: Curves,
}

fn root(force_n: f32) -> f32 {
    Elementary::exp(Elementary::ln(force_n.max(1e-12)) * (1.0 / EXPONENT))
}

/// The force of a root, N.
fn force(root: f32) -> f32 {
    Elementary::exp(Elementary::ln(root.max(1e-8)) * EXPONENT)
}

impl PadTables {
    /// A value at a depth over the largest one.
    fn at(&self, share: f32, value: impl Fn(&Node) -> f32) -> f32 {
        let place = share.not_negative().at_most(1.0) * CELLS as f32;
        let cell = (place as usize).min(CELLS - 1);
        let [a, b] = [value(&self.nodes[cell]), value(&self.nodes[cell + 1])];
        a + (place - cell as f32) * (b - a)
    }

    /// The depth over the largest one at which a press has a normal force.
    fn share_for(&self, force_n: f32) -> f32 {
        let sought = root(force_n);
        let cell = self.nodes.iter().skip(1).take(CELLS - 1).take_while(|node| node.normal <= sought).count();
        let cell = cell.min(CELLS - 1);
        let [a, b] = [self.nodes[cell].normal, self.nodes[cell + 1].normal];
        (cell as f32 + ((sought - a) / (b - a)).not_negative().at_most(1.0)) * (1.0 / CELLS as f32)
    }

    fn limit_at(&self, share: f32) -> f32 {
        force(self.at(share, |node| node.limit))
    }

    fn limit_for(&self, force_n: f32) -> f32 {
        self.limit_at(self.share_for(force_n))
    }
}

/// A step along x.
fn slide<B: Surface<f32>, const P: usize>(
    finger: &PadOn<'_, B>,
    state: &mut PadState<P>,
    depth_mm: f32,
    by: f32,
) -> Response {
    let slide_increment_mm = [by, 0.0];
    finger.step(state, Motion { depth_mm, slide_increment_mm, spin_increment_rad: 0.0, dt_s: DT_S })
}

/// Presses by so many cells of the tables. Returns the depth, mm, and the contact.
///
/// * `seen`: called at each node with its number, its depth, the contact and its response
fn press<B: Surface<f32>, const P: usize>(
    finger: &PadOn<'_, B>,
    cells: usize,
    mut seen: impl FnMut(usize, f32, &PadState<P>, &Response),
) -> Result<(f32, PadState<P>), Error> {
    let mut state: PadState<P> = finger.fresh()?;
    let cell_mm = finger.pad.depth_max_mm() / CELLS as f32;
    let mut depth_mm = 0.0;
    for node in 1..=cells {
        let mut response = Response::default();
        for part in 1..=PRESSES {
            depth_mm = cell_mm * ((node - 1) as f32 + part as f32 / PRESSES as f32);
            response = slide(finger, &mut state, depth_mm, 0.0);
        }
        seen(node, depth_mm, &state, &response);
    }
    Ok((depth_mm, state))
}

impl<B: Surface<f32> + Copy, const P: usize> Observable<PadTwin<P>> for PadOn<'_, B> {
    const TURNS: bool = true;
    type Tables = PadTables;

    fn tables(&self) -> Result<PadTables, Error> {
        let mut nodes = [Node::default(); CELLS + 1];
        let mut least = 0.0f32;
        press::<B, P>(self, CELLS, |k, depth_mm, state, pressed| {
            let mut stuck = *state;
            stuck.set_strength_factor(STICKS);
            let before = slide(self, &mut stuck, depth_mm, 0.0).friction_n[0];
            let after = slide(self, &mut stuck, depth_mm, SMALL_MM).friction_n[0];
            // The normal force rises from node to node.
            least = root(pressed.normal_force_n).max(least + 1e-6);
            let Some(node) = nodes.get_mut(k) else { return };
            *node = Node {
                normal: least,
                limit: root(pressed.friction_limit_n),
                stiffness_n_mm: ((after - before) / SMALL_MM).max(1e-3),
            };
        })?;
        let mut tables = PadTables { nodes, sticks: Curves::STICKS };
        tables.sticks = Curves::of(|share| {
            let Ok((depth_mm, mut state)) = press::<B, P>(self, (share * CELLS as f32) as usize, |_, _, _, _| ())
            else {
                return [1.0; 5];
            };
            let (limit_n, stiffness_n_mm) = (tables.limit_at(share), tables.at(share, |node| node.stiffness_n_mm));
            stick_ratios(limit_n, stiffness_n_mm, |by| slide(self, &mut state, depth_mm, by))
        });
        Ok(tables)
    }
    /// A pad of more patches than there is room for, which [`Self::tables`] refuses, never touches.
    fn twin(&self, strength_factor: f32) -> PadTwin<P> {
        let mut state = FingerModel::fresh(self).unwrap_or(PadState::without_contact(0));
        state.set_strength_factor(strength_factor);
        PadTwin { state, normal_n: 0.0, limit_n: 0.0, slope_n: [0.0; 2], turning: 0.0 }
    }
    fn strength_factor(twin: &PadTwin<P>) -> f32 {
        twin.state.strength_factor()
    }
    fn step_twin(&self, twin: &mut PadTwin<P>, motion: Motion) -> TwinForces {
        let r = self.step(&mut twin.state, motion);
        let ([x, y], strength) = (r.tangential_friction_n, twin.state.strength_factor());
        let square = (x * x + y * y) / (r.friction_limit_n * r.friction_limit_n + 1e-12);
        let used = 1.0 - r.slip_margin;
        twin.turning = sqrt((used * used - square).not_negative().magnitude());
        twin.normal_n = r.normal_force_n;
        twin.limit_n = r.friction_limit_n / strength;
        twin.slope_n = [0, 1].map(|k| r.friction_n[k] - r.tangential_friction_n[k]);
        TwinForces {
            normal_force_n: r.normal_force_n,
            friction_n: r.friction_n,
            spin_moment_n_mm: r.spin_moment_n_mm,
            slip_margin: r.slip_margin,
        }
    }
    fn depth_max_mm(&self) -> f32 {
        self.pad.depth_max_mm()
    }
    fn normal_at(&self, tables: &PadTables, depth_mm: f32) -> f32 {
        force(tables.at(depth_mm / self.pad.depth_max_mm(), |node| node.normal))
    }
    fn depth_for_normal(&self, tables: &PadTables, force_n: f32) -> f32 {
        (tables.share_for(force_n) * self.pad.depth_max_mm()).max(1e-6)
    }
    fn limit_at(&self, tables: &PadTables, depth_mm: f32) -> f32 {
        tables.limit_at(depth_mm / self.pad.depth_max_mm())
    }
    fn stiffness_at(&self, tables: &PadTables, depth_mm: f32) -> f32 {
        tables.at(depth_mm / self.pad.depth_max_mm(), |node| node.stiffness_n_mm)
    }
    /// The limit follows the normal force, with and without shear. The twin gives its dependence on the direction and on the place on a
    /// curved body, and the share of the moment.
    fn used(&self, tables: &PadTables, twin: Option<(&PadTwin<P>, f32)>, [normal, x, y]: [f32; 3], _: f32) -> f32 {
        let normal = normal.max(1e-6);
        let (mut ratio, mut slope, mut turning) = (1.0, [0.0; 2], 0.0);
        if let Some((twin, strength)) = twin
            && twin.normal_n > LEAST_N
        {
            ratio = (twin.limit_n / tables.limit_for(twin.normal_n)).max(RATIOS[0]).at_most(RATIOS[1]);
            slope = twin.slope_n.map(|force| force / twin.normal_n);
            turning = twin.turning * strength;
        }
        let [x, y] = [x - slope[0] * normal, y - slope[1] * normal];
        let limit = (ratio * tables.limit_for(normal)).max(1e-6);
        sqrt(((x * x + y * y) / (limit * limit) + turning * turning).magnitude())
    }
    fn stick_ratios_at(&self, tables: &PadTables, depth_mm: f32) -> [f32; 5] {
        tables.sticks.at(depth_mm / self.pad.depth_max_mm())
    }
}
