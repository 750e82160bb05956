//! A plotters backend that paints anti-aliased PNG images.

use std::convert::Infallible;

use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind, FontStyle,
};
use tiny_skia::{Color, FillRule, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};

use super::font;

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

/// An image under way. The backend's own coordinates are finer than its pixels.
pub struct Raster {
    pixmap: Pixmap,
    units: (u32, u32),
    pixels_per_unit: f32,
}

impl Raster {
    /// A white image of `units` coordinates; none if it would have no pixels or too many.
    pub fn try_new(units: (u32, u32), pixels_per_unit: f32) -> Option<Self> {
        let pixels = |n: u32| (n as f32 * pixels_per_unit).round() as u32;
        let mut pixmap = Pixmap::new(pixels(units.0), pixels(units.1))?;
        pixmap.fill(Color::WHITE);
        Some(Self { pixmap, units, pixels_per_unit })
    }

    /// The image as a PNG file. On its white ground nothing is transparent.
    pub fn into_png(self) -> Result<Vec<u8>, String> {
        let (pixels, _) = self.pixmap.data().as_chunks::<4>();
        let mut colours = vec![0; 3 * pixels.len()];
        let places = colours.as_chunks_mut::<3>().0;
        places.iter_mut().zip(pixels).for_each(|(to, &[r, g, b, _])| *to = [r, g, b]);
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, self.pixmap.width(), self.pixmap.height());
        encoder.set_color(png::ColorType::Rgb);
        // A quarter to a third larger than the usual level's, in a fifth of the time.
        encoder.set_deflate_compression(png::DeflateCompression::Level(1));
        encoder.set_filter(png::Filter::Up);
        let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&colours));
        written.map(|()| out).map_err(|e| e.to_string())
    }

    fn point(&self, (x, y): BackendCoord) -> (f32, f32) {
        (x as f32 * self.pixels_per_unit, y as f32 * self.pixels_per_unit)
    }

    fn polyline<I: IntoIterator<Item = BackendCoord>>(&self, points: I, close: bool) -> Option<Path> {
        let mut path = PathBuilder::new();
        for (i, (x, y)) in points.into_iter().map(|p| self.point(p)).enumerate() {
            if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        if close {
            path.close();
        }
        path.finish()
    }

    fn paint<S: BackendStyle>(&mut self, path: Option<Path>, style: &S, fill: bool) {
        let (Some(path), Some(paint)) = (path, paint(style.color())) else { return };
        if fill {
            self.pixmap.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
        } else {
            let width = style.stroke_width() as f32 * self.pixels_per_unit;
            let stroke = Stroke { width, line_join: LineJoin::Round, ..Stroke::default() };
            self.pixmap.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
        }
    }
}

fn paint(color: BackendColor) -> Option<Paint<'static>> {
    let visible = color.alpha > 0.0;
    if !visible {
        return None;
    }
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    let alpha = (color.alpha.min(1.0) * 255.0).round() as u8;
    paint.set_color_rgba8(color.rgb.0, color.rgb.1, color.rgb.2, alpha);
    Some(paint)
}

impl DrawingBackend for Raster {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.units
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, color: BackendColor) -> Drawn {
        self.draw_rect((x, y), (x + 1, y + 1), &color, true)
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        self.draw_path([from, to], style)
    }

    fn draw_rect<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S, fill: bool) -> Drawn {
        let path = self.polyline([from, (to.0, from.1), to, (from.0, to.1)], true);
        self.paint(path, style, fill);
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, points: I, style: &S) -> Drawn {
        let path = self.polyline(points, false);
        self.paint(path, style, false);
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(&mut self, centre: BackendCoord, radius: u32, style: &S, fill: bool) -> Drawn {
        let (x, y) = self.point(centre);
        self.paint(PathBuilder::from_circle(x, y, radius as f32 * self.pixels_per_unit), style, fill);
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, points: I, style: &S) -> Drawn {
        let path = self.polyline(points, true);
        self.paint(path, style, true);
        Ok(())
    }

    /// Text stands where plotters' SVG backend puts it; transforms are not supported.
    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Drawn {
        let em = style.size() / font::SIZE_PER_EM;
        let bold = matches!(style.style(), FontStyle::Bold);
        let x = match style.anchor().h_pos {
            HPos::Left => 0.0,
            HPos::Center => -font::width(text, em, bold) / 2.0,
            HPos::Right => -font::width(text, em, bold),
        };
        let y = match style.anchor().v_pos {
            VPos::Top => 0.76 * em,
            VPos::Center => 0.5 * font::EX_PER_EM * em,
            VPos::Bottom => -0.5 * font::EX_PER_EM * em,
        };
        let k = self.pixels_per_unit;
        let (px, py) = (k * (f64::from(at.0) + x) as f32, k * (f64::from(at.1) + y) as f32);
        self.paint(font::outline(text, k * em as f32, bold, px, py), &style.color(), true);
        Ok(())
    }
}
