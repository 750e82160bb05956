//! Colours that survive colour blindness and a grey printer.

use plotters_backend::BackendColor;

/// An opaque colour from 0xRRGGBB.
pub const fn rgb(hex: u32) -> BackendColor {
    BackendColor { alpha: 1.0, rgb: ((hex >> 16) as u8, (hex >> 8) as u8, hex as u8) }
}

/// Text and the measured points.
pub const INK: BackendColor = rgb(0x1f2328);
/// Axes, ticks, secondary text.
pub const GREY: BackendColor = rgb(0x5f6770);
/// Grid and mesh lines that carry no data.
pub const FAINT: BackendColor = rgb(0xdde1e6);
/// Ties between points that belong together.
pub const PAIR: BackendColor = rgb(0xb4bbc3);
/// Paper.
pub const WHITE: BackendColor = rgb(0xffffff);
/// Results of the model in figures with one such series.
pub const MODEL: BackendColor = rgb(0x0072b2);
/// A second estimate beside the model's.
pub const ESTIMATE: BackendColor = rgb(0xd55e00);
/// Contact that sticks.
pub const STUCK: BackendColor = rgb(0x0b5394);
/// Contact that slips.
pub const SLIPPING: BackendColor = rgb(0xf2c14e);

/// Okabe and Ito's palette without black and yellow, in the order in which series take it.
pub const SERIES: [BackendColor; 6] =
    [rgb(0x0072b2), rgb(0xd55e00), rgb(0x009e73), rgb(0xcc79a7), rgb(0xe69f00), rgb(0x56b4e9)];

/// Matplotlib's viridis at 0, 0.1, ... 1 (CC0).
const VIRIDIS: [BackendColor; 11] = [
    rgb(0x440154),
    rgb(0x482475),
    rgb(0x414487),
    rgb(0x355f8d),
    rgb(0x2a788e),
    rgb(0x21918c),
    rgb(0x22a884),
    rgb(0x44bf70),
    rgb(0x7ad151),
    rgb(0xbddf26),
    rgb(0xfde725),
];

/// The colour at the share `s` between `a` and `b`; `s` is clamped to 0..1, NaN is 0.
pub fn mix(a: BackendColor, b: BackendColor, s: f64) -> BackendColor {
    let s = if s > 0.0 { s.min(1.0) } else { 0.0 };
    let channel = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * s).round() as u8;
    BackendColor {
        alpha: a.alpha + (b.alpha - a.alpha) * s,
        rgb: (channel(a.rgb.0, b.rgb.0), channel(a.rgb.1, b.rgb.1), channel(a.rgb.2, b.rgb.2)),
    }
}

/// Perceptually uniform colour of a value from 0 (dark violet) to 1 (yellow); held outside, NaN is 0.
pub fn viridis(s: f64) -> BackendColor {
    let s = if s > 0.0 { s.min(1.0) * 10.0 } else { 0.0 };
    let i = (s as usize).min(9);
    mix(VIRIDIS[i], VIRIDIS[i + 1], s - i as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viridis_brightens_throughout_and_holds_outside() {
        let luma = |s| {
            let (r, g, b) = viridis(s).rgb;
            0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
        };
        assert!((0..100).all(|i| luma(f64::from(i) / 100.0) < luma(f64::from(i + 1) / 100.0)));
        assert_eq!(viridis(f64::NAN).rgb, viridis(-1.0).rgb);
        assert_eq!(viridis(2.0).rgb, (0xfd, 0xe7, 0x25));
    }
}
