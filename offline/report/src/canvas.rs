//! Lines, areas, markers and text, placed in pixels and written as SVG.

use std::fmt::Write as _;

use super::colour::{Colour, INK, WHITE};
use super::{font, html};

/// Coordinates in the SVG are whole numbers; this many of them make a pixel of a figure.
const UNITS_PER_PIXEL: f64 = 10.0;

/// A picture.
pub trait Figure {
    /// Width and height, pixels.
    fn size(&self) -> (u32, u32);
    /// Draws it.
    fn draw(&self, canvas: &mut Canvas);
}

/// The figure on white as an `<svg>` element.
pub fn svg(figure: &impl Figure) -> String {
    let (width, height) = figure.size();
    let (right, bottom) = units((f64::from(width), f64::from(height)));
    let mut canvas = Canvas::default();
    figure.draw(&mut canvas);
    format!(
        "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {right} {bottom}\" role=\"img\" fill=\"none\" \
         stroke-linejoin=\"round\" font-family=\"{}, Open Sans, DejaVu Sans, sans-serif\">\n\
         <path fill=\"{WHITE}\" d=\"M0 0h{right}v{bottom}h-{right}z\"/>\n{}</svg>\n",
        font::FAMILY,
        canvas.svg
    )
}

/// How a line is drawn; lengths in pixels.
#[derive(Clone, Copy)]
pub struct Line {
    /// Colour.
    pub colour: Colour,
    /// Thickness.
    pub width: f64,
    /// Lengths of dash and gap; none if solid.
    pub dash: Option<(f64, f64)>,
}

impl Line {
    /// A solid line.
    pub const fn solid(colour: Colour, width: f64) -> Self {
        Self { colour, width, dash: None }
    }
}

/// The point of a text that is placed, along the text.
#[derive(Clone, Copy)]
pub enum HPos {
    /// Its beginning.
    Left,
    /// Its middle.
    Center,
    /// Its end.
    Right,
}

/// The same across the text.
#[derive(Clone, Copy)]
pub enum VPos {
    /// The top of capitals.
    Top,
    /// Half the height of small letters.
    Center,
}

/// How text is set.
#[derive(Clone, Copy)]
pub struct Text {
    /// One em, pixels.
    pub em: f64,
    /// Weight.
    pub bold: bool,
    /// Colour.
    pub colour: Colour,
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

    /// Distance from the anchor down to the base line, px.
    fn base(&self) -> f64 {
        self.em
            * match self.v {
                VPos::Top => 0.76,
                VPos::Center => 0.27,
            }
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
#[derive(Default)]
pub struct Canvas {
    svg: String,
    /// Left, top, right and bottom edge of everything that was drawn, px; texts have their words.
    #[cfg(test)]
    pub boxes: Vec<([f64; 4], String)>,
}

fn units((x, y): (f64, f64)) -> (i64, i64) {
    let unit = |v: f64| (v * UNITS_PER_PIXEL).round() as i64;
    (unit(x), unit(y))
}

impl Canvas {
    /// Fills an area.
    pub fn area(&mut self, points: &[(f64, f64)], fill: Colour) {
        self.face(points, fill, Line::solid(fill, 0.0));
    }

    /// Fills an area and draws its edge.
    pub fn face(&mut self, points: &[(f64, f64)], fill: Colour, edge: Line) {
        if points.len() > 2 && points.iter().all(finite) {
            self.path(points, Some(fill), edge);
        }
    }

    /// Fills an upright rectangle.
    pub fn rect(&mut self, x: f64, y: f64, width: f64, height: f64, fill: Colour) {
        self.framed_rect(x, y, width, height, fill, Line::solid(fill, 0.0));
    }

    /// Fills an upright rectangle and draws its edge.
    pub fn framed_rect(&mut self, x: f64, y: f64, width: f64, height: f64, fill: Colour, edge: Line) {
        self.face(&[(x, y), (x + width, y), (x + width, y + height), (x, y + height)], fill, edge);
    }

    /// Draws a line through the points.
    pub fn line(&mut self, points: &[(f64, f64)], line: Line) {
        for run in points.split(|p| !finite(p)).filter(|run| run.len() > 1) {
            self.path(run, None, line);
        }
    }

    /// Writes a path: closed if it is filled.
    fn path(&mut self, points: &[(f64, f64)], fill: Option<Colour>, line: Line) {
        #[cfg(test)]
        points.iter().for_each(|p| self.record(*p, [0.5 * line.width; 4], ""));
        self.svg += "<path";
        if let Some(fill) = fill {
            let _ = write!(self.svg, " fill=\"{fill}\"");
        }
        if line.width > 0.0 {
            let width = (line.width * UNITS_PER_PIXEL).round().max(1.0);
            let _ = write!(self.svg, " stroke=\"{}\" stroke-width=\"{width}\"", line.colour);
        }
        if let Some((on, off)) = line.dash {
            let _ = write!(self.svg, " stroke-dasharray=\"{} {}\"", on * UNITS_PER_PIXEL, off * UNITS_PER_PIXEL);
        }
        self.svg += " d=\"";
        let (mut at, mut step) = ((0, 0), 'M');
        for to in points.iter().map(|p| units(*p)) {
            // Points that fall together are written once.
            if step == 'M' || to != at {
                let _ = write!(self.svg, "{step}{} {}", to.0 - at.0, to.1 - at.1);
            }
            (at, step) = (to, 'l');
        }
        self.svg += if fill.is_some() { "z\"/>\n" } else { "\"/>\n" };
    }

    /// Draws a data point of radius `r`: filled, or white with a rim.
    pub fn marker(&mut self, marker: Marker, at: (f64, f64), r: f64, colour: Colour, filled: bool) {
        if !finite(&at) {
            return;
        }
        let (fill, rim) = (if filled { colour } else { WHITE }, Line::solid(colour, 1.4));
        let corners: &[(f64, f64)] = match marker {
            Marker::Circle => {
                #[cfg(test)]
                self.record(at, [r + 0.7; 4], "");
                let (x, y) = units(at);
                let _ = writeln!(
                    self.svg,
                    "<circle cx=\"{x}\" cy=\"{y}\" r=\"{}\" fill=\"{fill}\" stroke=\"{colour}\" stroke-width=\"14\"/>",
                    (r * UNITS_PER_PIXEL).round()
                );
                return;
            }
            Marker::Square => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
            Marker::Triangle => &[(0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)],
            Marker::Diamond => &[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)],
        };
        let points: Vec<_> = corners.iter().map(|c| (at.0 + r * c.0, at.1 + r * c.1)).collect();
        self.face(&points, fill, rim);
    }

    /// Fills the head of an arrow with its tip at `tip`, pointing along `direction` (y downwards), `length` px long.
    pub fn arrow_head(&mut self, tip: (f64, f64), direction: (f64, f64), length: f64, colour: Colour) {
        let norm = direction.0.hypot(direction.1);
        let (dx, dy) = (length * direction.0 / norm, length * direction.1 / norm);
        let back = (tip.0 - dx, tip.1 - dy);
        let half = 0.42;
        self.area(&[tip, (back.0 - half * dy, back.1 + half * dx), (back.0 + half * dy, back.1 - half * dx)], colour);
    }

    /// Sets a line of text.
    pub fn text(&mut self, text: &str, at: (f64, f64), style: Text) {
        if !finite(&at) || text.is_empty() {
            return;
        }
        let base = at.1 + style.base();
        #[cfg(test)]
        {
            let width = font::width(text, style.em, style.bold);
            let before = match style.h {
                HPos::Left => 0.0,
                HPos::Center => 0.5 * width,
                HPos::Right => width,
            };
            self.record((at.0, base), [before, 0.76 * style.em, width - before, 0.22 * style.em], text);
        }
        let (x, y) = units((at.0, base));
        let anchor = match style.h {
            HPos::Left => "",
            HPos::Center => " text-anchor=\"middle\"",
            HPos::Right => " text-anchor=\"end\"",
        };
        let weight = if style.bold { " font-weight=\"bold\"" } else { "" };
        let size = (style.em * UNITS_PER_PIXEL).round();
        let _ = writeln!(
            self.svg,
            "<text x=\"{x}\" y=\"{y}\"{anchor}{weight} font-size=\"{size}\" fill=\"{}\">{}</text>",
            style.colour,
            html::escape(text)
        );
    }

    /// Draws something that shows a text under the pointer.
    pub fn titled(&mut self, title: &str, draw: impl FnOnce(&mut Self)) {
        let _ = write!(self.svg, "<g><title>{}</title>", html::escape(title));
        draw(self);
        self.svg += "</g>\n";
    }

    /// Keeps the box that reaches so far to the left, up, to the right and down of a point.
    #[cfg(test)]
    fn record(&mut self, (x, y): (f64, f64), [left, up, right, down]: [f64; 4], text: &str) {
        self.boxes.push(([x - left, y - up, x + right, y + down], text.to_owned()));
    }
}

fn finite(p: &(f64, f64)) -> bool {
    p.0.is_finite() && p.1.is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Text centred in a picture.
    struct Centred;

    impl Figure for Centred {
        fn size(&self) -> (u32, u32) {
            (100, 50)
        }
        fn draw(&self, canvas: &mut Canvas) {
            canvas.text("< 0.75 mm", (50.0, 25.0), Text { h: HPos::Center, bold: true, ..Text::BODY });
        }
    }

    #[test]
    fn text_is_placed_by_its_anchor_and_its_box_is_where_it_is_written() {
        let mut canvas = Canvas::default();
        Centred.draw(&mut canvas);
        let ([left, top, right, bottom], _) = canvas.boxes[0];
        let width = font::width("< 0.75 mm", 12.0, true);
        assert!((left + right - 100.0).abs() < 1e-9 && (right - left - width).abs() < 1e-9, "{left} {right} {width}");
        assert!(15.0 < top && top < 25.0 && 25.0 < bottom && bottom < 35.0, "{top} {bottom}");
        let text = "<text x=\"500\" y=\"282\" text-anchor=\"middle\" font-weight=\"bold\" font-size=\"120\" fill=\"#1f2328\">\
                    &lt; 0.75 mm</text>";
        assert!(svg(&Centred).contains(text), "{}", svg(&Centred));
    }

    #[test]
    fn a_gap_breaks_a_line_and_points_that_fall_together_are_written_once() {
        let mut canvas = Canvas::default();
        let points =
            [(0.0, 1.0), (2.0, 1.0), (2.01, 1.0), (f64::NAN, 0.0), (5.0, 5.0), (f64::NAN, 0.0), (3.0, 3.0), (4.0, 2.5)];
        canvas.line(&points, Line { dash: Some((3.0, 1.5)), ..Line::solid(INK, 1.4) });
        let line =
            |d: &str| format!("<path stroke=\"#1f2328\" stroke-width=\"14\" stroke-dasharray=\"30 15\" d=\"{d}\"/>\n");
        assert_eq!(canvas.svg, line("M0 10l20 0") + &line("M30 30l10 -5"));
    }
}
