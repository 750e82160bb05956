//! Forces against the motion that makes them, with the sense in which each loop is run through.

use super::Marks;
use super::along::WIDE;
use super::series::{LOOPS, Loop};
use crate::axes::{Axis, Panel};
use crate::canvas::{Canvas, Figure, HPos, Line, Marker, Text};
use crate::colour::{GREY, INK, MODEL};
use crate::font;
use fingerpad_fe::load_path::Response;

/// Motions that are smaller than this, mm or degrees, make no panel.
const LEAST_MOTION: f64 = 1e-6;
/// Distance between two heads of arrows along a curve, px.
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

    fn draw(&self, canvas: &mut Canvas) {
        for (k, of) in self.present().into_iter().enumerate() {
            let panel = self.place(k, of);
            panel.draw(canvas);
            if panel.y.min() < 0.0 && panel.y.max() > 0.0 {
                let zero = [panel.at(panel.x.min(), 0.0), panel.at(panel.x.max(), 0.0)];
                canvas.line(&zero, Line::solid(GREY, 1.0));
            }
            let at = |r: &Response| panel.at((of.motion)(r), (of.answer)(r));
            let line: Vec<_> = self.responses.iter().map(at).collect();
            canvas.line(&line, Line::solid(MODEL, 1.8));
            for (tip, direction) in arrows(&line) {
                canvas.arrow_head(tip, direction, 9.0, MODEL);
            }
            self.letters(canvas, &panel, &line, &at);
        }
    }
}

impl Loops<'_> {
    /// Marks with their letters, those of one place together, where the curve has most room.
    fn letters(&self, canvas: &mut Canvas, panel: &Panel, line: &[(f64, f64)], at: &dyn Fn(&Response) -> (f64, f64)) {
        let style = Text { bold: true, h: HPos::Center, ..Text::BODY };
        let mut labels: Vec<((f64, f64), String)> = Vec::new();
        for (letter, response) in &self.marks.0 {
            let point = at(response);
            canvas.marker(Marker::Circle, point, 3.0, INK, true);
            match labels.iter_mut().find(|label| distance(label.0, point) < 14.0) {
                Some((_, letters)) => letters.push(*letter),
                None => labels.push((point, letter.to_string())),
            }
        }
        let points: Vec<_> = labels.iter().map(|label| label.0).collect();
        for (point, letters) in &labels {
            let half = 0.5 * font::width(letters, style.em, true);
            let side = half + 7.0;
            let places = [(0.0, -14.0), (side, 10.0), (-side, -10.0), (side, -10.0), (-side, 10.0), (0.0, 15.0)]
                .map(|s| (point.0 + s.0, point.1 + s.1));
            let room = |place: &(f64, f64)| {
                let inside = place.0 - half > panel.left && place.0 + half < panel.left + panel.width + 18.0;
                let above_axis = place.1 > panel.top - 8.0 && place.1 < panel.top + panel.height - 6.0;
                let ends = [-half, 0.0, half].map(|dx| (place.0 + dx, place.1));
                let to_line = ends.map(|end| clearance(line, end)).into_iter().fold(f64::INFINITY, f64::min);
                let others = points.iter().filter(|p| *p != point).map(|p| distance(*p, *place) - half);
                if inside && above_axis { others.fold(to_line, f64::min) } else { f64::NEG_INFINITY }
            };
            let place = places.into_iter().max_by(|a, b| room(a).total_cmp(&room(b))).unwrap_or(*point);
            canvas.text(letters, place, style);
        }
    }
}

fn distance(a: (f64, f64), b: (f64, f64)) -> f64 {
    (a.0 - b.0).hypot(a.1 - b.1)
}

/// Distance of a point to a line, px; points that are not finite are no part of the line.
fn clearance(line: &[(f64, f64)], point: (f64, f64)) -> f64 {
    let to_piece = |pair: &[(f64, f64)]| {
        let (a, b) = (pair[0], pair[1]);
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let along = ((point.0 - a.0) * dx + (point.1 - a.1) * dy) / (dx * dx + dy * dy);
        let share = if along.is_finite() { along.clamp(0.0, 1.0) } else { 0.0 };
        distance(point, (a.0 + share * dx, a.1 + share * dy))
    };
    line.windows(2).map(to_piece).filter(|d| d.is_finite()).fold(f64::INFINITY, f64::min)
}
