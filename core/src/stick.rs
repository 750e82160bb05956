//! How much of a contact sticks: from where friction last turned back.
//!
//! Main type: [`Turn`]. Uses state and math.
//!
//! The stick ratio is (1 − q²) (1 − e v (1 + v)/2). p is the way that the resultant m = F/L has gone from where it last
//! turned back, m0, as a share of the way from there to the limit; q goes from 0 at the share where slip begins to 1
//! where nothing sticks; v is the yield function at m0, which is 1 on the limit, so that e is the slip right after a turn
//! back from full slip. A turn forgets that part of the way which it goes back. Nothing sticks either once every element
//! yields.
//!
//! A contact that grows adds strength everywhere, and what slipped sticks again unless friction grows faster than about
//! half of the limit: |dF| > k dL. (In the theory of Cattaneo and Mindlin k is the coefficient of friction over its mean
//! value, which is 1 for Coulomb's law: Jäger 1993, Arch. Appl. Mech. 63:156. In a law tau ~ sigma^beta the strength under
//! a pressure that rises grows beta times as fast.) So growth counts as a motion back along the way; it also draws m0 to
//! m, and v to 0: what is pressed anew sticks.

use crate::math::{not_negative, sqrt};
use crate::step::NOTHING;
use crate::{DataOf, Regime, StateOf};

/// Growth of friction over that of the limit up to which a contact that grows sticks: in the finite elements of the
/// shipped model the slip stays away below 0.45 and comes above 0.6.
const GROWTH: f32 = 0.5;
/// Yield function from which on an element counts as one that yields.
const AT_LIMIT: f32 = 0.99;

/// Where the resultant last turned back, seen from the present step.
pub(crate) struct Turn {
    from: [f32; 2],
    /// 1 less the yield function there, at least 0.
    room: f32,
    worn: f32,
    /// The highest bit is set once an element is within its limit.
    within: u32,
}

/// Follows the turning point through a step, before the elements move.
///
/// * `slide`: where the slide would take the resultant if none yielded, less where it was
/// * `keep`: what a change of depth makes of the resultant, share
/// * `scarcer`: limit before over limit now
#[inline(always)]
pub(crate) fn follow<const M: usize>(
    state: &StateOf<M>,
    [slide_x, slide_y]: [f32; 2],
    keep: f32,
    scarcer: f32,
    tilt_twice: f32,
) -> Turn {
    let [mut mean_x, mut mean_y] = state.mean;
    let [mut way_x, mut way_y] = state.way;
    let mut worn = state.worn;
    let growth = 1.0 - scarcer;
    let (to, kept) = if growth > 0.0 {
        worn = not_negative(worn - growth);
        let along = -GROWTH * growth / (sqrt(way_x * way_x + way_y * way_y) + NOTHING);
        let to = [slide_x + along * way_x, slide_y + along * way_y];
        mean_x *= scarcer;
        mean_y *= scarcer;
        (to, scarcer * scarcer)
    } else {
        // A limit that shrinks leaves the resultant nearer to it.
        let along = keep - 1.0;
        ([slide_x + along * mean_x, slide_y + along * mean_y], 1.0)
    };
    let [to_x, to_y] = to;
    let ahead = to_x * way_x + to_y * way_y;
    let turns = ahead < 0.0;
    if turns {
        let back = ahead / (NOTHING + to_x * to_x + to_y * to_y);
        way_x -= back * to_x;
        way_y -= back * to_y;
    }
    let from_x = mean_x - kept * way_x;
    let from_y = mean_y - kept * way_y;
    let room = not_negative(1.0 - (from_y * from_y + from_x * (from_x - tilt_twice)));
    if turns {
        let level = 1.0 - room;
        // Inside the limit the yield function may be a little below 0.
        worn = not_negative(0.5 * (level + level * level));
    }
    Turn { from: [from_x, from_y], room, worn, within: 0 }
}

impl Turn {
    /// Takes note of an element with this value of the yield function.
    #[inline(always)]
    pub(crate) fn note(&mut self, level: f32) {
        // Above 0 numbers order like their bits; below it they have the highest one themselves.
        self.within |= level.to_bits() | level.to_bits().wrapping_sub(AT_LIMIT.to_bits());
    }

    /// The stick ratio with the resultant at `mean`; remembers the way there.
    #[inline(always)]
    pub(crate) fn stick_ratio<const M: usize, const N: usize>(
        self,
        state: &mut StateOf<M>,
        mean: [f32; 2],
        tilt: f32,
        data: &DataOf<M, N>,
    ) -> f32 {
        let [from_x, from_y] = self.from;
        let way = [mean[0] - from_x, mean[1] - from_y];
        let used = used_up(way, [from_x - tilt, from_y], self.room);
        let slip = not_negative(data.slip_start + data.slip_rate * used);
        state.way = way;
        state.worn = self.worn;
        // In whole numbers, which order like the floats.
        if slip.to_bits() >= 1.0f32.to_bits() || self.within >> 31 == 0 {
            state.way = mean;
            return 0.0;
        }
        let stuck = 1.0 - slip * slip;
        stuck - stuck * (data.turn_slip * self.worn)
    }
}

/// How much of the way to the limit a resultant has gone, 0 to 1; at the limit it may be a little off 1.
///
/// p solves |from + way/p| = limit, a circle around the tilt. `from` is counted from there, `room` is 1 less the yield
/// function there.
#[inline(always)]
fn used_up(way: [f32; 2], from: [f32; 2], room: f32) -> f32 {
    let [x, y] = way;
    let square = x * x + y * y;
    let ahead = x * from[0] + y * from[1];
    let root = sqrt(ahead * ahead + square * room);
    square / (root - ahead + NOTHING)
}

/// [`Regime::classify`] of a contact, for a stick ratio within 0 and 1. Without a branch.
#[inline(always)]
pub(crate) fn regime_of(stick_ratio: f32) -> Regime {
    // Whole numbers, which order like the floats; a difference below 0 has the highest bit.
    let below = |threshold: f32| stick_ratio.to_bits().wrapping_sub(threshold.to_bits()) >> 31;
    let number = 1 + below(0.99) + below(0.01f32.next_up());
    bytemuck::checked::try_cast(number as u8).unwrap_or(Regime::NoContact)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regime_is_that_of_the_ratio() {
        for (low, high) in
            [(0.0f32, 1e-30f32), (0.009_999, 0.010_001), (0.4, 0.400_1), (0.989_99, 0.990_01), (0.999_9, 1.0)]
        {
            for bits in low.to_bits()..=high.to_bits().min(low.to_bits() + 100_000) {
                let ratio = f32::from_bits(bits);
                assert_eq!(regime_of(ratio), Regime::classify(true, ratio), "{ratio}");
            }
        }
        for ratio in [0.01, 0.99, 1.0f32] {
            assert_eq!(regime_of(ratio), Regime::classify(true, ratio), "{ratio}");
        }
    }
}
