//! The typeface of the figures: embedded, so that no machine has to have it.

use std::sync::OnceLock;

use ttf_parser::Face;

/// Family name, as the fonts have it and the style sheet of a page declares it.
pub const FAMILY: &str = "Noto Sans";
/// Regular weight, TrueType.
pub const REGULAR: &[u8] = include_bytes!("fonts/NotoSans-Regular-subset.ttf");
/// Bold weight, TrueType.
pub const BOLD: &[u8] = include_bytes!("fonts/NotoSans-Bold-subset.ttf");

fn face(bold: bool) -> Option<&'static Face<'static>> {
    static FACES: [OnceLock<Option<Face<'static>>>; 2] = [OnceLock::new(), OnceLock::new()];
    FACES[usize::from(bold)].get_or_init(|| Face::parse(if bold { BOLD } else { REGULAR }, 0).ok()).as_ref()
}

/// Width of a line of text, in the unit of `em`. No kerning.
pub fn width(text: &str, em: f64, bold: bool) -> f64 {
    let Some(face) = face(bold) else { return 0.6 * em * text.chars().count() as f64 };
    let advance = |c| f64::from(face.glyph_index(c).and_then(|g| face.glyph_hor_advance(g)).unwrap_or(0));
    text.chars().map(advance).sum::<f64>() * em / f64::from(face.units_per_em())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sign_that_figures_use_is_in_the_subset() {
        for bold in [false, true] {
            let face = face(bold).unwrap();
            for c in "AZaz09 .,:;()/%²³·×±−–°≤≥≈→µγτλβ√∞⅓…".chars() {
                assert!(face.glyph_index(c).is_some(), "{c}");
            }
        }
        assert!(width("0.75 mm", 10.0, false) > 30.0 && width("0.75 mm", 10.0, false) < 60.0);
    }
}
