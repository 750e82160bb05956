//! The pad: patches of the fingertip's skin, coupled by the finger's own linear compliance, on a rigid body.
//!
//! Main types: [`Pad`] (patches and bulk modes, [`patches::pad`] makes them from a finger), [`Law`] (the few numbers that are
//! fitted), [`Contact`] (state and step), [`replay`]. One stored energy gives all forces; friction dissipates. Uses fe and runs.

mod contact;
mod fit;
mod patches;
mod replay;
mod score;

pub use contact::{Answer, Contact, Place};
pub use fit::{FitLimits, fit};
pub use patches::{PadSize, pad};
pub use replay::replay;
pub use score::{PadScores, score_runs};

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Bulk modes of a pad.
pub const MODES: usize = 16;

/// The displacement of a patch per bulk mode, mm.
pub type Modes = SMatrix<f64, 3, MODES>;

/// One patch of skin.
#[derive(Clone, Debug)]
pub struct Patch {
    /// Its middle in the undeformed finger, mm.
    pub middle: Vector3<f64>,
    /// Its area, mm².
    pub area: f64,
    /// Second moment of its points about the middle, over its area, mm².
    pub spread: Matrix3<f64>,
    /// Inner normal of the skin.
    pub normal: Vector3<f64>,
    /// How it moves with the bulk.
    pub modes: Modes,
    /// What the bulk modes leave of its compliance along the normal and across, mm/N.
    pub compliance: [f64; 2],
}

/// Patches and bulk of a finger. The bulk's energy is half the sum of the squares of its coordinates (mJ): the modes carry the stiffness.
#[derive(Clone, Debug)]
pub struct Pad {
    /// The patches.
    pub patches: Vec<Patch>,
    /// Translation (mm) and rotation vector (rad) of the rigid motion nearest to that of the bulk, per mode.
    pub rigid: SMatrix<f64, 6, MODES>,
    /// Point about which that rotation is taken, mm.
    pub middle: Vector3<f64>,
    /// Height of the plane at first touch, mm, as a polynomial of the normal's x and y in the finger's frame: see [`Pad::height`].
    pub reach: [f64; REACH_TERMS],
}

/// Terms of the height of first touch.
pub const REACH_TERMS: usize = 20;

/// Powers of the normal's x and y (y appears with even powers alone) of each term.
fn reach_terms(nx: f64, ny: f64) -> [f64; REACH_TERMS] {
    let (x, y) = (nx, ny * ny);
    let (x2, y2) = (x * x, y * y);
    [
        1.0,
        x,
        x2,
        x2 * x,
        x2 * x2,
        x2 * x2 * x,
        x2 * x2 * x2,
        y,
        y * x,
        y * x2,
        y * x2 * x,
        y * x2 * x2,
        y2,
        y2 * x,
        y2 * x2,
        y2 * y,
        y2 * y * x,
        x2 * x2 * x2 * x,
        y2 * x2 * x,
        y2 * y2,
    ]
}

impl Pad {
    /// Height of the plane over the origin at first touch, along its normal, mm.
    pub fn height(&self, normal: &Vector3<f64>) -> f64 {
        reach_terms(normal.x, normal.y).iter().zip(&self.reach).map(|(a, b)| a * b).sum()
    }
}

/// What is fitted to nonlinear runs.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Law {
    /// Stiffness of the bulk across and along the body's normal, over that at rest.
    pub bulk: [f64; 2],
    /// Stiffening: pressure of the bulk's energy that grows with the cube of the mean squash, mJ/mm³, and the squash at which that growth
    /// ends, mm.
    pub stiffening: [f64; 2],
    /// Local compliance along the normal and across, over what the modes leave.
    pub local: [f64; 2],
    /// Pressure at which a patch touches as a whole: constant, MPa, and per spread over size, MPa.
    pub flattening: [f64; 2],
    /// Spread of the gaps within a patch, over that of its points.
    pub spread: f64,
    /// Area in contact: over the patch's at full contact, force at full contact over [`Self::flattening`]'s, exponent.
    pub area: [f64; 3],
    /// Friction law: factor, MPa^(1 - beta), and exponent.
    pub friction: [f64; 2],
    /// Exponent of the slipping share of a patch.
    pub onset: f64,
    /// What the rigid motion of the bulk adds in second order to the place of every patch along z and along x: of the products of
    /// (t_x, t_z, r_y) and of (t_y, r_x, r_z), the six of each.
    pub lift: [[f64; 12]; 2],
    /// Share of the second order of the bulk's rotation that patches follow.
    pub turn: f64,
}

/// Products of two of three numbers.
const PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [0, 2], [1, 2]];
/// Places in a rigid motion of those that a mirror image about y = 0 leaves, and of those that it turns round.
const EVEN: [usize; 3] = [0, 2, 4];
const ODD: [usize; 3] = [1, 3, 5];

impl Law {
    /// Second-order motion of a patch at `arm` from the middle, mm, under a rigid motion of the bulk, and its derivative.
    fn lift(&self, motion: &SVector<f64, 6>, arm: &Vector3<f64>) -> (Vector3<f64>, SMatrix<f64, 3, 6>) {
        let (mut lift, mut slope) = (Vector3::zeros(), SMatrix::<f64, 3, 6>::zeros());
        for (axis, numbers) in [2, 0].into_iter().zip(&self.lift) {
            for (set, numbers) in [EVEN, ODD].iter().zip([&numbers[..6], &numbers[6..]]) {
                for ([a, b], number) in PAIRS.iter().zip(numbers) {
                    let (a, b) = (set[*a], set[*b]);
                    lift[axis] += number * motion[a] * motion[b];
                    slope[(axis, a)] += number * motion[b];
                    slope[(axis, b)] += number * motion[a];
                }
            }
        }
        let turn = Vector3::new(motion[3], motion[4], motion[5]);
        let share = 0.5 * self.turn;
        lift += turn.cross(&turn.cross(arm)) * share;
        // d/dr of r x (r x a) = (r a') + (r.a) I - 2 a r'.
        let by_turn = turn * arm.transpose() + Matrix3::identity() * turn.dot(arm) - arm * turn.transpose() * 2.0;
        let mut rotation = slope.fixed_view_mut::<3, 3>(0, 3);
        rotation += by_turn * share;
        (lift, slope)
    }
}

impl Default for Law {
    fn default() -> Self {
        Self {
            bulk: [1.0, 0.92],
            stiffening: [0.3, 3.0],
            local: [1.0, 1.0],
            flattening: [0.0004, 0.027],
            spread: 1.07,
            area: [1.06, 1.8, 0.9],
            friction: [0.084, 0.46],
            onset: 6.5,
            lift: [[0.0; 12]; 2],
            turn: 1.0,
        }
    }
}

#[cfg(test)]
mod tests;
