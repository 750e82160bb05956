//! Lines, areas, markers and text in fractional pixels, as SVG; [resvg](https://docs.rs/resvg) paints it as PNG.

use std::convert::Infallible;
use std::sync::{Arc, OnceLock};

use plotters_backend::text_anchor::Pos;
pub use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind, FontFamily, FontStyle,
};
use plotters_svg::SVGBackend;
use resvg::usvg::{self, Transform, fontdb};
use resvg::{render, tiny_skia};

use super::colour::{INK, WHITE};
use super::{ReportError, font};

/// Result of a drawing call.
pub type Drawn = Result<(), DrawingErrorKind<std::io::Error>>;

/// Backend coordinates are whole numbers; this many of them make a pixel of a figure.
const UNITS_PER_PIXEL: u32 = 10;
/// Image pixels per pixel of a figure, so that PNG files stay sharp in print.
const IMAGE_SCALE: f32 = 2.0;

/// A picture.
pub trait Figure {
    /// Width and height, pixels.
    fn size(&self) -> (u32, u32);
    /// Draws it.
    fn draw(&self, canvas: &mut Canvas<'_>) -> Drawn;
}

/// The figure as a PNG file, on white.
pub fn png<F: Figure>(figure: &F) -> Result<Vec<u8>, ReportError> {
    let (width, height) = figure.size();
    let failed = |e: String| ReportError::Draw(e);
    let [columns, rows] = [width, height].map(|n| (n as f32 * IMAGE_SCALE).round() as u32);
    let mut image = tiny_skia::Pixmap::new(columns, rows)
        .ok_or_else(|| failed(format!("no image of {width} x {height} pixels")))?;
    image.fill(tiny_skia::Color::WHITE);
    let scale = IMAGE_SCALE / UNITS_PER_PIXEL as f32;
    render(&tree(figure)?, Transform::from_scale(scale, scale), &mut image.as_mut());
    image.encode_png().map_err(|e| failed(e.to_string()))
}

/// The figure, its text set in the embedded typeface.
pub(crate) fn tree<F: Figure>(figure: &F) -> Result<usvg::Tree, ReportError> {
    static FONTS: OnceLock<Arc<fontdb::Database>> = OnceLock::new();
    let fonts = FONTS.get_or_init(|| {
        let mut fonts = fontdb::Database::new();
        fonts.load_font_data(font::REGULAR.to_vec());
        fonts.load_font_data(font::BOLD.to_vec());
        Arc::new(fonts)
    });
    let options = usvg::Options { fontdb: fonts.clone(), ..usvg::Options::default() };
    let text = svg(figure)?.replacen("<svg ", "<svg xmlns=\"http://www.w3.org/2000/svg\" ", 1);
    usvg::Tree::from_str(&text, &options).map_err(|e| ReportError::Draw(e.to_string()))
}

/// The figure as an `<svg>` element of a page.
pub fn svg<F: Figure>(figure: &F) -> Result<String, ReportError> {
    let size = figure.size();
    let [width, height] = [size.0, size.1].map(|n| n * UNITS_PER_PIXEL);
    let mut text = String::new();
    {
        let mut canvas = Canvas { backend: SVGBackend::with_string(&mut text, (width, height)) };
        let drawn = figure.draw(&mut canvas).and_then(|()| canvas.backend.present());
        drawn.map_err(|e| ReportError::Draw(e.to_string()))?;
    }
    let body = text.find(">\n").map_or("", |i| &text[i + 2..]);
    let root = format!("<svg viewBox=\"0 0 {width} {height}\" role=\"img\" stroke-linejoin=\"round\">\n");
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

/// Drawing in fractional pixels; the origin is the top left corner, y downwards.
/// Points that are not finite are left out, and break a line.
pub struct Canvas<'a> {
    backend: SVGBackend<'a>,
}

const SCALE: f64 = UNITS_PER_PIXEL as f64;

struct Style(BackendColor, u32);

impl BackendStyle for Style {
    fn color(&self) -> BackendColor {
        self.0
    }
    fn stroke_width(&self) -> u32 {
        self.1
    }
}

fn at((x, y): (f64, f64)) -> BackendCoord {
    ((x * SCALE).round() as i32, (y * SCALE).round() as i32)
}

impl Canvas<'_> {
    /// Fills an area.
    pub fn area(&mut self, points: &[(f64, f64)], fill: BackendColor) -> Drawn {
        if points.len() < 3 || points.iter().any(|p| !finite(p)) {
            return Ok(());
        }
        let points: Vec<_> = points.iter().map(|p| at(*p)).collect();
        self.backend.fill_polygon(points, &Style(fill, 0))
    }

    /// Fills an upright rectangle.
    pub fn rect(&mut self, x: f64, y: f64, width: f64, height: f64, fill: BackendColor) -> Drawn {
        self.area(&[(x, y), (x + width, y), (x + width, y + height), (x, y + height)], fill)
    }

    /// Draws the outline of an area.
    pub fn outline(&mut self, points: &[(f64, f64)], line: Line) -> Drawn {
        let closed: Vec<_> = points.iter().chain(points.first()).copied().collect();
        self.line(&closed, line)
    }

    /// Draws a line through the points.
    pub fn line(&mut self, points: &[(f64, f64)], line: Line) -> Drawn {
        let style = Style(line.colour, (line.width * SCALE).round().max(1.0) as u32);
        for run in points.split(|p| !finite(p)) {
            for piece in line.dash.map_or_else(|| vec![run.to_vec()], |dash| dashes(run, dash)) {
                if piece.len() > 1 {
                    let mut piece: Vec<_> = piece.iter().map(|p| at(*p)).collect();
                    piece.dedup();
                    self.backend.draw_path(piece, &style)?;
                }
            }
        }
        Ok(())
    }

    /// Draws a data point of radius `r`: filled, or white with a rim.
    pub fn marker(&mut self, marker: Marker, at: (f64, f64), r: f64, colour: BackendColor, filled: bool) -> Drawn {
        if !finite(&at) {
            return Ok(());
        }
        let fill = if filled { colour } else { WHITE };
        let corners: &[(f64, f64)] = match marker {
            Marker::Circle => {
                let (centre, radius) = (self::at(at), (r * SCALE).round() as u32);
                self.backend.draw_circle(centre, radius, &Style(fill, 1), true)?;
                let rim = Style(colour, (1.4 * SCALE).round().max(1.0) as u32);
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
    pub fn arrow_head(&mut self, tip: (f64, f64), direction: (f64, f64), length: f64, colour: BackendColor) -> Drawn {
        let norm = direction.0.hypot(direction.1);
        let (dx, dy) = (length * direction.0 / norm, length * direction.1 / norm);
        let back = (tip.0 - dx, tip.1 - dy);
        let half = 0.42;
        self.area(&[tip, (back.0 - half * dy, back.1 + half * dx), (back.0 + half * dy, back.1 - half * dx)], colour)
    }

    /// Sets a line of text.
    pub fn text(&mut self, text: &str, at: (f64, f64), style: Text) -> Drawn {
        if !finite(&at) || text.is_empty() {
            return Ok(());
        }
        let at = self::at(at);
        self.backend.draw_text(text, &ScaledText(style, style.em * SCALE), at)
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
        _: &str,
        _: BackendCoord,
        _: F,
    ) -> Result<Result<(), E>, Infallible> {
        // SVG has text of its own.
        Ok(Ok(()))
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

    /// Text centred in a picture.
    struct Centred;

    impl Figure for Centred {
        fn size(&self) -> (u32, u32) {
            (100, 50)
        }
        fn draw(&self, canvas: &mut Canvas<'_>) -> Drawn {
            canvas.text("0.75 mm", (50.0, 25.0), Text { h: HPos::Center, bold: true, ..Text::BODY })
        }
    }

    #[test]
    fn text_is_painted_where_it_is_placed() {
        let image = tiny_skia::Pixmap::decode_png(&png(&Centred).unwrap()).unwrap();
        let dark = |x: u32, y: u32| image.pixel(x, y).is_some_and(|p| p.red() < 128);
        let (xs, ys): (Vec<_>, Vec<_>) =
            (0..100).flat_map(|y| (0..200).map(move |x| (x, y))).filter(|&(x, y)| dark(x, y)).unzip();
        let (left, right) = (xs.iter().min().unwrap(), xs.iter().max().unwrap());
        assert!((left + right).abs_diff(200) < 8, "{left} {right}");
        let width = 2.0 * font::width("0.75 mm", 12.0, true);
        assert!((f64::from(right - left) - width).abs() < 6.0, "{left} {right} {width}");
        assert!(ys.iter().all(|y| (30..70).contains(y)), "{ys:?}");
    }
}
