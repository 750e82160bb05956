//! How much of a contact sticks: from where friction last turned back.
//!
//! Main type: [`Turn`]. Uses state and math.
//!
//! The stick ratio is (1 − q²) (1 − e v²). p is the way that the resultant m = F/L has gone from where it last turned
//! back, m0, as a share of the way from there to the limit; q goes from 0 at the share where slip begins to 1 where
//! nothing sticks; v is the yield function at m0, which is 1 on the limit, so that e is the slip right after a turn back
//! from full slip. A turn forgets that part of the way which it goes back. Growth of the contact draws m0 to m and v to
//! 0: what is pressed anew sticks.

use crate::math::{not_negative, sqrt};
use crate::step::NOTHING;
use crate::{DataOf, Regime, StateOf};

/// Where the resultant last turned back, seen from the present step.
pub(crate) struct Turn {
    from: [f32; 2],
    /// 1 less the yield function there, at least 0.
    room: f32,
    worn: f32,
}

/// Follows the turning point through a step, before the elements move.
///
/// * `mean`: the resultant after the step before over the limit now
/// * `toward`: where the elements would take the resultant if none yielded, less where it was
/// * `scarcer`: limit before over limit now
#[inline(always)]
pub(crate) fn follow<const M: usize>(
    state: &StateOf<M>,
    [mean_x, mean_y]: [f32; 2],
    [toward_x, toward_y]: [f32; 2],
    scarcer: f32,
    tilt_twice: f32,
) -> Turn {
    let [mut way_x, mut way_y] = state.way;
    let from = |way_x: f32, way_y: f32| {
        let (x, y) = if scarcer < 1.0 {
            let square = scarcer * scarcer;
            (scarcer * (mean_x - square * way_x), scarcer * (mean_y - square * way_y))
        } else {
            (mean_x - way_x, mean_y - way_y)
        };
        ([x, y], (1.0 - (y * y + x * (x - tilt_twice))).abs())
    };
    let ahead = toward_x * way_x + toward_y * way_y;
    if ahead < 0.0 {
        let back = ahead / (NOTHING + toward_x * toward_x + toward_y * toward_y);
        way_x -= back * toward_x;
        way_y -= back * toward_y;
        let (from, room) = from(way_x, way_y);
        let level = 1.0 - room;
        // A square, since inside the limit the yield function may be a little below 0.
        Turn { from, room, worn: level * level }
    } else {
        let (from, room) = from(way_x, way_y);
        let worn = if scarcer < 1.0 { state.worn * (scarcer * scarcer * scarcer) } else { state.worn };
        Turn { from, room, worn }
    }
}

impl Turn {
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
        if slip.to_bits() >= 1.0f32.to_bits() {
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
