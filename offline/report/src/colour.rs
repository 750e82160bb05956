//! Colours that survive colour blindness and a grey printer.

/// Red, green and blue; prints as `#rrggbb`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour(pub [u8; 3]);

impl std::fmt::Display for Colour {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [r, g, b] = self.0;
        write!(f, "#{r:02x}{g:02x}{b:02x}")
    }
}

/// A colour from 0xRRGGBB.
pub const fn rgb(hex: u32) -> Colour {
    Colour([(hex >> 16) as u8, (hex >> 8) as u8, hex as u8])
}

/// Text and the measured points.
pub const INK: Colour = rgb(0x1f2328);
/// Axes, ticks, secondary text.
pub const GREY: Colour = rgb(0x5f6770);
/// Grid and mesh lines that carry no data.
pub const FAINT: Colour = rgb(0xdde1e6);
/// Ties between points that belong together.
pub const PAIR: Colour = rgb(0xb4bbc3);
/// Paper.
pub const WHITE: Colour = rgb(0xffffff);
/// Results of the model in figures with one such series.
pub const MODEL: Colour = rgb(0x0072b2);
/// A second estimate beside the model's.
pub const ESTIMATE: Colour = rgb(0xd55e00);
/// Contact that sticks.
pub const STUCK: Colour = rgb(0x0b5394);
/// Contact that slips.
pub const SLIPPING: Colour = rgb(0xf2c14e);

/// Okabe and Ito's palette without black and yellow, in the order in which series take it.
pub const SERIES: [Colour; 6] =
    [rgb(0x0072b2), rgb(0xd55e00), rgb(0x009e73), rgb(0xcc79a7), rgb(0xe69f00), rgb(0x56b4e9)];

/// Matplotlib's viridis at 0, 0.1, ... 1 (CC0).
const VIRIDIS: [Colour; 11] = [
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
pub fn mix(a: Colour, b: Colour, s: f64) -> Colour {
    let s = if s > 0.0 { s.min(1.0) } else { 0.0 };
    let channel = |k: usize| (f64::from(a.0[k]) + (f64::from(b.0[k]) - f64::from(a.0[k])) * s).round() as u8;
    Colour([0, 1, 2].map(channel))
}

/// Perceptually uniform colour of a value from 0 (dark violet) to 1 (yellow); held outside, NaN is 0.
pub fn viridis(s: f64) -> Colour {
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
            let [r, g, b] = viridis(s).0;
            0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
        };
        assert!((0..100).all(|i| luma(f64::from(i) / 100.0) < luma(f64::from(i + 1) / 100.0)));
        assert_eq!(viridis(f64::NAN), viridis(-1.0));
        assert_eq!(viridis(2.0), rgb(0xfde725));
    }
}
