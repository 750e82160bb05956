//! The response over time: panels one above the other, regimes as shades behind them.

use fingerpad::Regime;

use super::Marks;
use super::series::{ALONG, Panel as PanelOf, Series};
use crate::axes::{Axis, Legend, Panel, Sample};
use crate::canvas::{Canvas, Figure, HPos, Line, Text};
use crate::colour::{Colour, GREY, INK, SERIES, SLIPPING, STUCK, WHITE, mix, rgb};
use crate::font;
use fingerpad_fe::load_path::Response;

/// Widths of figures on wide and on narrow pages, px.
pub const WIDE: f64 = 900.0;
/// As [`WIDE`].
pub const NARROW: f64 = 380.0;

/// Dashes that distinguish the series of a panel without colour.
const DASHES: [Option<(f64, f64)>; 3] = [None, Some((7.0, 3.0)), Some((2.0, 3.0))];
const LEFT: f64 = 52.0;
const RIGHT: f64 = 16.0;
/// Height of a panel's name and legend, of the panel, and of the numbers below it, px.
const ABOVE: f64 = 38.0;
const HEIGHT: f64 = 124.0;
const BELOW: f64 = 26.0;

/// Everything along the path.
pub struct Along<'a> {
    /// Rows.
    pub responses: &'a [Response],
    /// Rows whose contact is drawn.
    pub marks: &'a Marks,
    /// Width, px.
    pub width: f64,
}

/// Shade of a regime.
fn shade(regime: Regime) -> Colour {
    match regime {
        Regime::NoContact => rgb(0xe9ebee),
        Regime::Stick => mix(WHITE, STUCK, 0.18),
        Regime::PartialSlip => mix(WHITE, rgb(0x009e73), 0.14),
        Regime::Slip => mix(WHITE, SLIPPING, 0.38),
    }
}

/// Regimes with the times, s, from and to which they are shaded: from the first row of a regime to the first of the next, so
/// that a shade begins at the time that the page's text gives.
pub(super) fn regimes(responses: &[Response]) -> Vec<(Regime, [f64; 2])> {
    let mut shades: Vec<(Regime, [f64; 2])> = Vec::new();
    for r in responses {
        match shades.last_mut() {
            Some((regime, times)) if *regime == r.regime => times[1] = r.t_s,
            last => {
                last.into_iter().for_each(|(_, times)| times[1] = r.t_s);
                shades.push((r.regime, [r.t_s; 2]));
            }
        }
    }
    shades
}

/// Series of a panel that have any value.
fn present(panel: &PanelOf, responses: &[Response]) -> Vec<Series> {
    panel.series.iter().filter(|s| responses.iter().any(|r| (s.of)(r).is_finite())).copied().collect()
}

impl Along<'_> {
    fn panels(&self) -> Vec<(&'static PanelOf, Vec<Series>)> {
        let all = ALONG.iter().map(|panel| (panel, present(panel, self.responses)));
        let changes = |series: &Series| {
            let mut values = self.responses.iter().map(series.of).filter(|v| v.is_finite());
            values.next().is_some_and(|first| values.any(|v| v != first))
        };
        all.filter(|(_, series)| series.iter().any(changes)).collect()
    }

    fn legend(&self) -> Legend<'static> {
        let regimes = [
            (Regime::NoContact, "no contact"),
            (Regime::Stick, "stick"),
            (Regime::PartialSlip, "partial slip"),
            (Regime::Slip, "full slip"),
        ];
        Legend { width: self.width, entries: regimes.map(|(regime, name)| (Sample::Area, name, shade(regime))).into() }
    }

    fn top(&self) -> f64 {
        self.legend().height() + 6.0 + if self.marks.0.is_empty() { 0.0 } else { 34.0 }
    }

    fn place(&self, k: usize, x: &Axis, y: Axis) -> Panel {
        let top = self.top() + ABOVE + k as f64 * (ABOVE + HEIGHT + BELOW);
        Panel { left: LEFT, top, width: self.width - LEFT - RIGHT, height: HEIGHT, x: x.clone(), y }
    }

    fn regimes(&self, canvas: &mut Canvas, panel: &Panel) {
        for (regime, [start, end]) in regimes(self.responses) {
            let [left, right] = [start, end].map(|t_s| panel.at(t_s, panel.y.max()).0);
            canvas.rect(left, panel.top, right - left, panel.height, shade(regime));
        }
    }

    /// Letters above the first panel.
    fn letters(&self, canvas: &mut Canvas, first: &Panel) {
        let [upper, lower] = [8.0, 23.0].map(|y| self.legend().height() + 6.0 + y);
        let mut last = (f64::NEG_INFINITY, lower);
        for (letter, response) in &self.marks.0 {
            let at = first.at(response.t_s, first.y.min()).0;
            // A letter that would overlap the one before is drawn above it.
            let y = if at - last.0 < 13.0 && last.1 == lower { upper } else { lower };
            let style = Text { bold: true, h: HPos::Center, ..Text::BODY };
            canvas.text(&letter.to_string(), (at, y), style);
            last = (at, y);
        }
    }

    /// A line through a panel at every mark.
    fn marks(&self, canvas: &mut Canvas, panel: &Panel) {
        let dash = Line { colour: GREY, width: 0.8, dash: Some((3.0, 3.0)) };
        for (_, response) in &self.marks.0 {
            let at = |y| panel.at(response.t_s, y);
            canvas.line(&[at(panel.y.max()), at(panel.y.min())], dash);
        }
    }

    fn curves(&self, canvas: &mut Canvas, panel: &Panel, label: &str, series: &[Series]) {
        let name_at = (LEFT - 34.0, panel.top - 27.0);
        canvas.text(label, name_at, Text { bold: true, em: 12.5, ..Text::BODY });
        let mut at = match self.width < WIDE {
            true => (LEFT, panel.top - 10.0),
            false => (name_at.0 + font::width(label, 12.5, true) + 28.0, name_at.1),
        };
        for (k, one) in series.iter().enumerate() {
            let line = Line { colour: SERIES[k % SERIES.len()], width: 2.0, dash: DASHES[k % DASHES.len()] };
            let points = panel.path(self.responses.iter().map(|r| (r.t_s, Some((one.of)(r)))));
            canvas.line(&points, line);
            if series.len() > 1 {
                canvas.line(&[at, (at.0 + 24.0, at.1)], line);
                canvas.text(one.name, (at.0 + 30.0, at.1), Text { colour: INK, ..Text::BODY });
                at.0 += 48.0 + font::width(one.name, Text::BODY.em, false);
            }
        }
    }
}

impl Figure for Along<'_> {
    fn size(&self) -> (u32, u32) {
        let panels = self.panels().len() as f64;
        (self.width as u32, (self.top() + panels * (ABOVE + HEIGHT + BELOW) + 22.0) as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let panels = self.panels();
        let times = || self.responses.iter().map(|r| r.t_s);
        let start = times().next().unwrap_or(0.0);
        let count = if self.width < WIDE { 7 } else { 14 };
        let mut x = Axis::covering("", [start, start], times(), count);
        self.legend().draw(canvas);
        for (k, (of, series)) in panels.iter().enumerate() {
            let values = series.iter().flat_map(|s| self.responses.iter().map(s.of));
            let y = Axis::covering("", of.least_or(values.clone()), values, 4);
            if k + 1 == panels.len() {
                x.label = "Time of the path, s".to_owned();
            }
            let panel = self.place(k, &x, y);
            self.regimes(canvas, &panel);
            panel.draw(canvas);
            self.marks(canvas, &panel);
            self.curves(canvas, &panel, of.label, series);
            if k == 0 {
                self.letters(canvas, &panel);
            }
        }
    }
}

impl PanelOf {
    /// Values that the axis covers at least; the first value if there are none.
    fn least_or(&self, mut values: impl Iterator<Item = f64>) -> [f64; 2] {
        if self.least[0] < self.least[1] {
            return self.least;
        }
        let first = values.find(|v| v.is_finite()).unwrap_or(0.0);
        [first, first]
    }
}
