//! The typeface of the figures: embedded, so that no machine has to have it.

use std::sync::OnceLock;

use plotters_backend::BackendCoord;
use tiny_skia::{Path, PathBuilder};
pub use ttf_parser::GlyphId;
use ttf_parser::{Face, OutlineBuilder};

/// Family name, as the style sheet of the page declares it.
pub const FAMILY: &str = "Noto Sans Subset";
/// Regular weight, TrueType.
pub const REGULAR: &[u8] = include_bytes!("fonts/NotoSans-Regular-subset.ttf");
/// Bold weight, TrueType.
pub const BOLD: &[u8] = include_bytes!("fonts/NotoSans-Bold-subset.ttf");
/// Plotters' text size is a line height; its SVG backend takes this much of it as one em.
pub const SIZE_PER_EM: f64 = 1.24;
/// Height of the letter x, em.
pub const EX_PER_EM: f64 = 0.536;

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

/// Glyphs of a line of text and their distances from its beginning, in the unit of `em`. No kerning.
pub fn glyphs(text: &str, em: f32, bold: bool) -> Vec<(GlyphId, f32)> {
    let Some(face) = face(bold) else { return Vec::new() };
    let scale = em / f32::from(face.units_per_em());
    let mut at = 0.0;
    let place = |glyph| {
        let here = at;
        at += f32::from(face.glyph_hor_advance(glyph).unwrap_or(0)) * scale;
        (glyph, here)
    };
    text.chars().filter_map(|c| face.glyph_index(c)).map(place).collect()
}

/// Outline of glyphs behind each other whose baseline starts at (`x`, `y`), y downwards; none if nothing is visible.
pub fn outline(glyphs: &[(GlyphId, f32)], em: f32, bold: bool, x: f32, y: f32) -> Option<Path> {
    let face = face(bold)?;
    let mut pen = Pen { path: PathBuilder::new(), x, y, scale: em / f32::from(face.units_per_em()) };
    for (glyph, behind) in glyphs {
        pen.x = x + behind;
        face.outline_glyph(*glyph, &mut pen);
    }
    pen.path.finish()
}

/// Coverage of a line of text as pixels from its top left corner, for backends without text of their own.
pub fn pixels(text: &str, em: f64, bold: bool) -> Vec<(BackendCoord, f64)> {
    let size = (width(text, em, bold).ceil().max(1.0) as u32, (em * SIZE_PER_EM).ceil().max(1.0) as u32);
    let (Some(mut mask), Some(path)) = (
        tiny_skia::Mask::new(size.0, size.1),
        outline(&glyphs(text, em as f32, bold), em as f32, bold, 0.0, em as f32),
    ) else {
        return Vec::new();
    };
    mask.fill_path(&path, tiny_skia::FillRule::Winding, true, tiny_skia::Transform::identity());
    let at = |i: usize| ((i as u32 % size.0) as i32, (i as u32 / size.0) as i32);
    mask.data().iter().enumerate().filter(|(_, a)| **a > 0).map(|(i, a)| (at(i), f64::from(*a) / 255.0)).collect()
}

struct Pen {
    path: PathBuilder,
    x: f32,
    y: f32,
    scale: f32,
}

impl Pen {
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        (self.x + x * self.scale, self.y - y * self.scale)
    }
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        let p = self.at(x, y);
        self.path.move_to(p.0, p.1);
    }
    fn line_to(&mut self, x: f32, y: f32) {
        let p = self.at(x, y);
        self.path.line_to(p.0, p.1);
    }
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (c, p) = (self.at(x1, y1), self.at(x, y));
        self.path.quad_to(c.0, c.1, p.0, p.1);
    }
    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let (c, d, p) = (self.at(x1, y1), self.at(x2, y2), self.at(x, y));
        self.path.cubic_to(c.0, c.1, d.0, d.1, p.0, p.1);
    }
    fn close(&mut self) {
        self.path.close();
    }
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
