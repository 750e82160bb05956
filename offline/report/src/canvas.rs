//! Lines, areas, markers and text in fractional pixels, on any plotters backend.

use std::convert::Infallible;

use plotters_backend::text_anchor::Pos;
pub use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind, FontFamily, FontStyle,
};
use plotters_svg::SVGBackend;

use super::colour::{INK, WHITE};
use super::raster::Raster;
use super::{ReportError, font};

/// Result of a drawing call.
pub type Drawn<DB> = Result<(), DrawingErrorKind<<DB as DrawingBackend>::ErrorType>>;

/// Backend coordinates are whole numbers; this many of them make a pixel of a figure.
const UNITS_PER_PIXEL: u32 = 10;
/// Image pixels per pixel of a figure, so that PNG files stay sharp in print.
const IMAGE_SCALE: f32 = 2.0;

/// A picture that can be drawn on any backend.
pub trait Figure {
    /// Width and height, pixels.
    fn size(&self) -> (u32, u32);
    /// Draws it.
    fn draw<DB: DrawingBackend>(&self, canvas: &mut Canvas<'_, DB>) -> Drawn<DB>;
}

/// The figure as a PNG file.
pub fn png<F: Figure>(figure: &F) -> Result<Vec<u8>, ReportError> {
    let size = figure.size();
    let units = (size.0 * UNITS_PER_PIXEL, size.1 * UNITS_PER_PIXEL);
    let failed = |e: String| ReportError::Draw(e);
    let mut raster = Raster::try_new(units, IMAGE_SCALE / UNITS_PER_PIXEL as f32)
        .ok_or_else(|| failed(format!("no image of {} x {} pixels", size.0, size.1)))?;
    figure.draw(&mut Canvas::new(&mut raster, size)).map_err(|e| failed(e.to_string()))?;
    raster.into_png().map_err(failed)
}

/// The figure as an `<svg>` element of a page.
pub fn svg<F: Figure>(figure: &F) -> Result<String, ReportError> {
    let size = figure.size();
    let units = (size.0 * UNITS_PER_PIXEL, size.1 * UNITS_PER_PIXEL);
    let mut text = String::new();
    {
        let mut backend = SVGBackend::with_string(&mut text, units);
        figure.draw(&mut Canvas::new(&mut backend, size)).map_err(|e| ReportError::Draw(e.to_string()))?;
        backend.present().map_err(|e| ReportError::Draw(e.to_string()))?;
    }
    let body = text.find(">\n").map_or("", |i| &text[i + 2..]);
    let root = format!("<svg viewBox=\"0 0 {} {}\" role=\"img\" stroke-linejoin=\"round\">\n", units.0, units.1);
    Ok(root + &body.replace(" opacity=\"1\"", "").replace(" \"", "\"").replace("\n</text>", "</text>"))
}

/// How a line is drawn; lengths in pixels.
#[derive(Clone, Copy)]
pub struct Line {
    /// Colour.
    pub colour: BackendColor,
    /// Thickness.
    pub width: f64,
    /// Lengths of dash and gap; none if solid.
    pub dash: Option<(f64, f64)>,
}

impl Line {
    /// A solid line.
    pub const fn solid(colour: BackendColor, width: f64) -> Self {
        Self { colour, width, dash: None }
    }
}

/// How text is set.
#[derive(Clone, Copy)]
pub struct Text {
    /// One em, pixels.
    pub em: f64,
    /// Weight.
    pub bold: bool,
    /// Colour.
    pub colour: BackendColor,
    /// Horizontal anchor of the text.
    pub h: HPos,
    /// Vertical anchor of the text.
    pub v: VPos,
}

impl Text {
    /// Ink at 12 px, starting at the point, centred on its height.
    pub const BODY: Self = Self { em: 12.0, bold: false, colour: INK, h: HPos::Left, v: VPos::Center };

    /// The same so small that a text is at most `most` pixels wide.
    pub fn within(self, text: &str, most: f64) -> Self {
        let width = font::width(text, self.em, self.bold);
        Self { em: self.em * (most / width.max(1e-9)).min(1.0), ..self }
    }
}

/// Shapes of data points, distinguishable without colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Marker {
    /// Disc.
    Circle,
    /// Square.
    Square,
    /// Triangle, tip up.
    Triangle,
    /// Square on its corner.
    Diamond,
}

impl Marker {
    /// In the order in which series take them.
    pub const SERIES: [Self; 4] = [Self::Circle, Self::Square, Self::Triangle, Self::Diamond];
}

/// A backend with fractional pixels; the origin is the top left corner, y downwards.
/// Points that are not finite are left out, and break a line.
pub struct Canvas<'a, DB: DrawingBackend> {
    backend: &'a mut DB,
    scale: f64,
}

struct Style(BackendColor, u32);

impl BackendStyle for Style {
    fn color(&self) -> BackendColor {
        self.0
    }
    fn stroke_width(&self) -> u32 {
        self.1
    }
}

impl<'a, DB: DrawingBackend> Canvas<'a, DB> {
    /// A canvas of `size` pixels that covers the whole backend.
    pub fn new(backend: &'a mut DB, size: (u32, u32)) -> Self {
        let scale = f64::from(backend.get_size().0) / f64::from(size.0.max(1));
        Self { backend, scale }
    }

    fn at(&self, (x, y): (f64, f64)) -> BackendCoord {
        ((x * self.scale).round() as i32, (y * self.scale).round() as i32)
    }

    /// Fills an area.
    pub fn area(&mut self, points: &[(f64, f64)], fill: BackendColor) -> Drawn<DB> {
        if points.len() < 3 || points.iter().any(|p| !finite(p)) {
            return Ok(());
        }
        let points: Vec<_> = points.iter().map(|p| self.at(*p)).collect();
        self.backend.fill_polygon(points, &Style(fill, 0))
    }

    /// Fills an upright rectangle.
    pub fn rect(&mut self, x: f64, y: f64, width: f64, height: f64, fill: BackendColor) -> Drawn<DB> {
        self.area(&[(x, y), (x + width, y), (x + width, y + height), (x, y + height)], fill)
    }

    /// Draws the outline of an area.
    pub fn outline(&mut self, points: &[(f64, f64)], line: Line) -> Drawn<DB> {
        let closed: Vec<_> = points.iter().chain(points.first()).copied().collect();
        self.line(&closed, line)
    }

    /// Draws a line through the points.
    pub fn line(&mut self, points: &[(f64, f64)], line: Line) -> Drawn<DB> {
        let style = Style(line.colour, (line.width * self.scale).round().max(1.0) as u32);
        for run in points.split(|p| !finite(p)) {
            for piece in line.dash.map_or_else(|| vec![run.to_vec()], |dash| dashes(run, dash)) {
                if piece.len() > 1 {
                    let mut piece: Vec<_> = piece.iter().map(|p| self.at(*p)).collect();
                    piece.dedup();
                    self.backend.draw_path(piece, &style)?;
                }
            }
        }
        Ok(())
    }

    /// Draws a data point of radius `r`: filled, or white with a rim.
    pub fn marker(&mut self, marker: Marker, at: (f64, f64), r: f64, colour: BackendColor, filled: bool) -> Drawn<DB> {
        if !finite(&at) {
            return Ok(());
        }
        let fill = if filled { colour } else { WHITE };
        let corners: &[(f64, f64)] = match marker {
            Marker::Circle => {
                let (centre, radius) = (self.at(at), (r * self.scale).round() as u32);
                self.backend.draw_circle(centre, radius, &Style(fill, 1), true)?;
                let rim = Style(colour, (1.4 * self.scale).round().max(1.0) as u32);
                return self.backend.draw_circle(centre, radius, &rim, false);
            }
            Marker::Square => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
            Marker::Triangle => &[(0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)],
            Marker::Diamond => &[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)],
        };
        let points: Vec<_> = corners.iter().map(|c| (at.0 + r * c.0, at.1 + r * c.1)).collect();
        self.area(&points, fill)?;
        self.outline(&points, Line::solid(colour, 1.4))
    }

    /// Fills the head of an arrow with its tip at `tip`, pointing along `direction` (y downwards), `length` px long.
    pub fn arrow_head(
        &mut self,
        tip: (f64, f64),
        direction: (f64, f64),
        length: f64,
        colour: BackendColor,
    ) -> Drawn<DB> {
        let norm = direction.0.hypot(direction.1);
        let (dx, dy) = (length * direction.0 / norm, length * direction.1 / norm);
        let back = (tip.0 - dx, tip.1 - dy);
        let half = 0.42;
        self.area(&[tip, (back.0 - half * dy, back.1 + half * dx), (back.0 + half * dy, back.1 - half * dx)], colour)
    }

    /// Sets a line of text.
    pub fn text(&mut self, text: &str, at: (f64, f64), style: Text) -> Drawn<DB> {
        if !finite(&at) || text.is_empty() {
            return Ok(());
        }
        let at = self.at(at);
        self.backend.draw_text(text, &ScaledText(style, style.em * self.scale), at)
    }
}

fn finite(p: &(f64, f64)) -> bool {
    p.0.is_finite() && p.1.is_finite()
}

fn dashes(points: &[(f64, f64)], (on, off): (f64, f64)) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = Vec::new();
    let mut piece: Vec<_> = points.first().copied().into_iter().collect();
    let (mut drawing, mut left) = (true, on);
    for pair in points.windows(2) {
        let (mut from, to) = (pair[0], pair[1]);
        loop {
            let length = (to.0 - from.0).hypot(to.1 - from.1);
            if length <= left {
                left -= length;
                if drawing {
                    piece.push(to);
                }
                break;
            }
            let s = left / length;
            from = (from.0 + s * (to.0 - from.0), from.1 + s * (to.1 - from.1));
            if drawing {
                piece.push(from);
                pieces.push(std::mem::take(&mut piece));
            } else {
                piece = vec![from];
            }
            drawing = !drawing;
            left = if drawing { on } else { off };
        }
    }
    if drawing {
        pieces.push(piece);
    }
    pieces
}

struct ScaledText(Text, f64);

impl BackendTextStyle for ScaledText {
    type FontError = Infallible;

    fn color(&self) -> BackendColor {
        self.0.colour
    }
    fn size(&self) -> f64 {
        self.1 * font::SIZE_PER_EM
    }
    fn style(&self) -> FontStyle {
        if self.0.bold { FontStyle::Bold } else { FontStyle::Normal }
    }
    fn anchor(&self) -> Pos {
        Pos::new(self.0.h, self.0.v)
    }
    fn family(&self) -> FontFamily<'_> {
        FontFamily::Name(font::FAMILY)
    }
    fn layout_box(&self, text: &str) -> Result<((i32, i32), (i32, i32)), Infallible> {
        let width = font::width(text, self.1, self.0.bold);
        Ok(((0, 0), (width.round() as i32, self.size().round() as i32)))
    }
    fn draw<E, F: FnMut(i32, i32, BackendColor) -> Result<(), E>>(
        &self,
        text: &str,
        (x, y): BackendCoord,
        mut draw: F,
    ) -> Result<Result<(), E>, Infallible> {
        let mut pixels = font::pixels(text, self.1, self.0.bold).into_iter();
        Ok(pixels.try_for_each(|((dx, dy), alpha)| draw(x + dx, y + dy, self.0.colour.mix(alpha))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_cover_their_share_of_a_bent_line() {
        let length = |p: &Vec<(f64, f64)>| p.windows(2).map(|w| (w[1].0 - w[0].0).hypot(w[1].1 - w[0].1)).sum::<f64>();
        let total: f64 = dashes(&[(0.0, 0.0), (30.0, 0.0), (30.0, 30.0)], (4.0, 2.0)).iter().map(length).sum();
        assert!((total - 40.0).abs() < 1e-9, "{total}");
        assert!(dashes(&[], (4.0, 2.0)).iter().all(Vec::is_empty));
    }
    /// A backend with the required methods only.
    struct Pixels(Vec<BackendCoord>);

    impl DrawingBackend for Pixels {
        type ErrorType = Infallible;
        fn get_size(&self) -> (u32, u32) {
            (200, 100)
        }
        fn ensure_prepared(&mut self) -> Drawn<Self> {
            Ok(())
        }
        fn present(&mut self) -> Drawn<Self> {
            Ok(())
        }
        fn draw_pixel(&mut self, point: BackendCoord, _: BackendColor) -> Drawn<Self> {
            self.0.push(point);
            Ok(())
        }
    }

    #[test]
    fn any_backend_gets_text_and_markers() {
        let mut backend = Pixels(Vec::new());
        let mut canvas = Canvas::new(&mut backend, (100, 50));
        canvas.text("0.75 mm", (50.0, 25.0), Text { h: HPos::Center, ..Text::BODY }).unwrap();
        let (xs, ys): (Vec<_>, Vec<_>) = backend.0.iter().copied().unzip();
        let (left, right) = (xs.iter().min().unwrap(), xs.iter().max().unwrap());
        assert!((left + right - 200).abs() < 8 && right - left > 60, "{left} {right}");
        assert!(ys.iter().all(|y| (30..70).contains(y)), "{ys:?}");
        backend.0.clear();
        for marker in Marker::SERIES {
            Canvas::new(&mut backend, (100, 50)).marker(marker, (50.0, 25.0), 4.0, INK, true).unwrap();
        }
        assert!(backend.0.len() > 500);
    }
}
