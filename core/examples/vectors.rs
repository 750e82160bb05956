//! Prints the test vectors of `docs/fpm-format.md`: motions and the bits of the responses of the example model.

use fingerpad::{Motion, Params, Regime, State, step};

fn main() -> Result<(), fingerpad::Error> {
    let data = Params::example().try_build()?;
    let model = data.model()?;
    let mut state = State::default();
    for (depth_mm, x, y) in [
        (0.5, 0.0, 0.0),
        (1.0, 0.0, 0.0),
        (1.0, 1.5, 0.0),
        (1.0, 0.0, 2.0),
        (0.7, -0.25, 0.0),
        (3.0, 0.0, 0.0),
        (1.0, f32::NAN, 0.125),
        (0.0, 0.0, 0.0),
    ] {
        let r = step(&model, &mut state, Motion { depth_mm, slide_increment_mm: [x, y], dt_s: 1e-3 });
        let words = [
            r.normal_force_n,
            r.friction_n[0],
            r.friction_n[1],
            r.stick_ratio,
            r.friction_limit_n,
            r.slip_margin,
            r.contact_area_mm2,
            r.band_normal_n,
            r.band_friction_n,
        ];
        let bits: Vec<String> = words.iter().map(|w| format!("{:08x}", w.to_bits())).collect();
        let regime = [Regime::NoContact, Regime::Stick, Regime::PartialSlip, Regime::Slip]
            .iter()
            .position(|k| *k == r.regime)
            .unwrap_or(9);
        println!("{depth_mm} {x} {y} | {} {regime} {}", bits.join(" "), r.status.0);
    }
    Ok(())
}
