//! Forces against the motion that makes them, with the sense in which each loop is run through.

use plotters_backend::DrawingBackend;

use super::Marks;
use super::along::WIDE;
use super::series::{LOOPS, Loop};
use crate::axes::{Axis, Panel};
use crate::canvas::{Canvas, Drawn, Figure, HPos, Line, Marker, Text};
use crate::colour::{GREY, INK, MODEL};
use fingerpad_fe::load_path::Response;

/// Motions that are smaller than this, mm or degrees, make no panel.
const LEAST_MOTION: f64 = 1e-6;
/// Way between two heads of arrows on a curve, px.
const ARROW_EVERY: f64 = 110.0;
const TOP: f64 = 40.0;
const HEIGHT: f64 = 230.0;
const BELOW: f64 = 62.0;

/// All loops of a run.
pub struct Loops<'a> {
    /// Rows.
    pub responses: &'a [Response],
    /// Rows whose contact is drawn.
    pub marks: &'a Marks,
    /// Width, px.
    pub width: f64,
}

impl Loops<'_> {
    /// Whether there is any loop to draw.
    pub fn any(&self) -> bool {
        !self.present().is_empty()
    }

    fn present(&self) -> Vec<&'static Loop> {
        let spread = |of: fn(&Response) -> f64| {
            let range = crate::numbers::range(self.responses.iter().map(of));
            range.map_or(0.0, |r| r.max - r.min)
        };
        let answers = |l: &Loop| self.responses.iter().any(|r| (l.answer)(r).is_finite());
        LOOPS.iter().filter(|l| spread(l.motion) > LEAST_MOTION && answers(l)).collect()
    }

    fn columns(&self) -> usize {
        if self.width < WIDE { 1 } else { self.present().len().clamp(1, 3) }
    }

    fn place(&self, k: usize, of: &Loop) -> Panel {
        let columns = self.columns();
        let cell = self.width / columns as f64;
        let values = |f: fn(&Response) -> f64| self.responses.iter().map(f);
        Panel {
            left: 58.0 + cell * (k % columns) as f64,
            top: TOP + (TOP + HEIGHT + BELOW) * (k / columns) as f64,
            width: (cell - 58.0 - 20.0).min(420.0),
            height: HEIGHT,
            x: Axis::covering(of.motion_label, [0.0, 0.0], values(of.motion), 5),
            y: Axis::covering(of.answer_label, [0.0, 0.0], values(of.answer), 5),
        }
    }
}

/// Tips and directions of arrows along a line, px.
fn arrows(line: &[(f64, f64)]) -> Vec<((f64, f64), (f64, f64))> {
    let mut found = Vec::new();
    let mut way = 0.5 * ARROW_EVERY;
    for pair in line.windows(2) {
        let (dx, dy) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
        let length = dx.hypot(dy);
        if length.is_finite() && length > 0.0 {
            way += length;
            if way >= ARROW_EVERY {
                found.push((pair[1], (dx, dy)));
                way = 0.0;
            }
        }
    }
    found
}

impl Figure for Loops<'_> {
    fn size(&self) -> (u32, u32) {
        let rows = self.present().len().div_ceil(self.columns());
        (self.width as u32, ((TOP + HEIGHT + BELOW) * rows as f64) as u32)
    }

    fn draw<DB: DrawingBackend>(&self, canvas: &mut Canvas<'_, DB>) -> Drawn<DB> {
        for (k, of) in self.present().into_iter().enumerate() {
            let panel = self.place(k, of);
            panel.draw(canvas)?;
            if panel.y.min() < 0.0 && panel.y.max() > 0.0 {
                let zero = [panel.at(panel.x.min(), 0.0), panel.at(panel.x.max(), 0.0)];
                canvas.line(&zero, Line::solid(GREY, 1.0))?;
            }
            let at = |r: &Response| panel.at((of.motion)(r), (of.answer)(r));
            let line: Vec<_> = self.responses.iter().map(at).collect();
            canvas.line(&line, Line::solid(MODEL, 1.8))?;
            for (tip, direction) in arrows(&line) {
                canvas.arrow_head(tip, direction, 9.0, MODEL)?;
            }
            self.letters(canvas, &panel, &at)?;
        }
        Ok(())
    }
}

impl Loops<'_> {
    /// Marks with their letters, on the side of the point where the panel has room.
    fn letters<DB: DrawingBackend>(
        &self,
        canvas: &mut Canvas<'_, DB>,
        panel: &Panel,
        at: &dyn Fn(&Response) -> (f64, f64),
    ) -> Drawn<DB> {
        let mut taken: Vec<(f64, f64)> = Vec::new();
        for (letter, response) in &self.marks.0 {
            let point = at(response);
            canvas.marker(Marker::Circle, point, 3.0, INK, true)?;
            let sides = [(0.0, -12.0), (11.0, 9.0), (-11.0, 9.0), (12.0, -7.0), (-12.0, -7.0), (0.0, 13.0)];
            let free = |p: &(f64, f64)| {
                let apart = |q: &(f64, f64)| (p.0 - q.0).hypot(p.1 - q.1) > 11.0;
                let inside = p.0 > panel.left + 4.0 && p.0 < panel.left + panel.width + 14.0;
                taken.iter().all(apart) && inside && p.1 > panel.top - 6.0 && p.1 < panel.top + panel.height - 6.0
            };
            let places = sides.map(|s| (point.0 + s.0, point.1 + s.1));
            let place = places.into_iter().find(free).unwrap_or(places[0]);
            let style = Text { bold: true, h: HPos::Center, ..Text::BODY };
            canvas.text(&letter.to_string(), place, style)?;
            taken.extend([place, point]);
        }
        Ok(())
    }
}
