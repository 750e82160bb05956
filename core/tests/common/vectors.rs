//! What the documented test vectors are made of; the example that prints them uses it as well.

use fingerpad::Response;

/// The bytes at an aligned address.
pub fn aligned(bytes: &[u8]) -> Vec<u64> {
    bytes.chunks(8).map(|c| u64::from_le_bytes(core::array::from_fn(|i| c.get(i).copied().unwrap_or(0)))).collect()
}

/// The numbers of a response in the order of the document, as bits.
pub fn words(r: &Response) -> [u32; 9] {
    [
        r.normal_force_n,
        r.friction_n[0],
        r.friction_n[1],
        r.stick_ratio,
        r.friction_limit_n,
        r.slip_margin,
        r.contact_area_mm2,
        r.band_normal_n,
        r.band_friction_n,
    ]
    .map(f32::to_bits)
}
