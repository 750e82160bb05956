//! Any bytes as a model file, and the shipped file with bytes changed: refused, or a model whose steps keep their promises. The
//! checksum is made right, so that the fuzzer gets past it. `cargo +nightly fuzz run file -- -max_total_time=60`
#![no_main]

use fingerpad::{File, Motion, State, step};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let _ = aligned(input, |bytes| File::from_bytes(bytes).is_ok());
    let example = include_bytes!("../../../data/models/fingertip.fpm");
    let mut file = example.to_vec();
    // Input: pairs of a place and a byte that goes there.
    for patch in input.chunks_exact(3) {
        let at = usize::from(u16::from_le_bytes([patch[0], patch[1]])) % file.len();
        if at >= 16 {
            file[at] = patch[2];
        }
    }
    let checksum = crc32(&file[16..]);
    file[12..16].copy_from_slice(&checksum.to_le_bytes());
    aligned(&file, |bytes| {
        let Ok(file) = File::from_bytes(bytes) else { return };
        let mut state = State::default();
        for i in 0..40 {
            let motion = Motion {
                depth_mm: 0.1 * i as f32,
                slide_increment_mm: [0.3, -0.2],
                spin_increment_rad: 0.0,
                dt_s: 1e-3,
            };
            let r = step(&file.model, &mut state, motion);
            let [x, y] = r.friction_n;
            assert!(r.normal_force_n.is_finite() && r.normal_force_n >= 0.0, "{r:?}");
            assert!(x.hypot(y) <= r.friction_limit_n * (1.0 + 1e-6), "{r:?}");
            assert!((0.0..=1.0).contains(&r.stick_ratio), "{r:?}");
        }
    });
});

fn aligned<T>(bytes: &[u8], then: impl FnOnce(&[u8]) -> T) -> T {
    let mut room = vec![0u8; bytes.len() + 8];
    let start = room.as_ptr().align_offset(8);
    room[start..start + bytes.len()].copy_from_slice(bytes);
    then(&room[start..start + bytes.len()])
}

fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = !0u32;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { 0xEDB8_8320 ^ (crc >> 1) } else { crc >> 1 };
        }
    }
    !crc
}
