//! Raw counts to millimetres.

/// The recording: depth, slide x, slide y in micrometres (counts of a 1 um encoder), one row every 10 ms.
///
/// Synthetic: press, a growing load that turns, a jolt, putting down, lift-off.
pub const RECORDING: &[[i16; 3]] = include!(concat!(env!("OUT_DIR"), "/recording.rs"));

/// Rows of the recording per second.
pub const ROWS_HZ: u32 = 100;

/// Millimetres per count.
const MM: f32 = 1e-3;

/// Position (depth, slide x, slide y) in mm at step `tick` of `rate_hz`, straight between rows; `None` after the end.
pub fn position_mm(tick: u32, rate_hz: u32) -> Option<[f32; 3]> {
    let per_row = rate_hz / ROWS_HZ;
    let row = (tick / per_row) as usize;
    let (a, b) = (RECORDING.get(row)?, RECORDING.get(row + 1)?);
    let s = (tick % per_row) as f32 / per_row as f32;
    Some(core::array::from_fn(|i| MM * (f32::from(a[i]) + s * f32::from(b[i] - a[i]))))
}
