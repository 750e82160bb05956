//! Figures of the law's search: the simplex on its error surface, the region of the constants.

use super::super::axes::{Axis, Legend, Panel, Sample};
use super::super::canvas::{Canvas, Figure, Line, Marker, Text};
use super::super::colour::{ESTIMATE, GREY, INK, MODEL, PAIR, SERIES, WHITE, mix, rgb};
use super::super::numbers::{fixed, significant};
use fingerpad_identify::{
    outcome::{LawOutcome, Surface},
    simplex::SimplexRun,
};

/// Lambda of the published constants.
const PUBLISHED: [f64; 2] = [0.086, 0.46];

/// Paths of the downhill simplex over the sum of squares.
pub struct SimplexPaths<'a> {
    pub surface: &'a Surface,
    pub runs: &'a [SimplexRun],
    pub refined: Option<&'a SimplexRun>,
    pub law: &'a LawOutcome,
}

impl Figure for SimplexPaths<'_> {
    fn size(&self) -> (u32, u32) {
        (760, 540)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let s = self.surface;
        let (first, last) = (s.ln_lambda[0].exp(), s.ln_lambda[s.ln_lambda.len() - 1].exp());
        let plot = Panel {
            left: 60.0,
            top: 44.0,
            width: 530.0,
            height: 440.0,
            x: Axis::log("λ, MPa^(1−β)", [first, last]),
            y: Axis::between("β", [s.beta[0], s.beta[s.beta.len() - 1]], 6),
        };
        let least = s.sum_of_squares.iter().flatten().copied().filter(|v| *v > 0.0).fold(f64::INFINITY, f64::min);
        let (low, high) = (least.log10(), 3.0f64.max(least.log10() + 2.0));
        let shade = |v: f64| {
            let share = ((v.log10() - low) / (high - low)).clamp(0.0, 1.0);
            mix(rgb(0xcfe3f1), WHITE, share.sqrt())
        };
        for j in 1..s.beta.len() {
            for i in 1..s.ln_lambda.len() {
                let value = s.sum_of_squares[j][i];
                let (x0, y0) = plot.at(s.ln_lambda[i - 1].exp(), s.beta[j]);
                let (x1, y1) = plot.at(s.ln_lambda[i].exp(), s.beta[j - 1]);
                canvas.rect(x0, y0, x1 - x0 + 0.3, y1 - y0 + 0.3, shade(value));
            }
        }
        plot.draw(canvas);
        for power in (low.ceil() as i32)..=2 {
            let level = 10f64.powi(power);
            let mut lowest: Option<(f64, f64)> = None;
            for piece in contour(&s.ln_lambda, &s.beta, &s.sum_of_squares, level) {
                let piece = piece.map(|(x, y)| plot.at(x.exp(), y));
                canvas.line(&piece, Line::solid(PAIR, 1.0));
                let end = piece[0];
                // The side of stronger laws, where lines part.
                if lowest.is_none_or(|(x, y)| end.0 + 1.2 * end.1 > x + 1.2 * y)
                    && end.0 < plot.left + plot.width - 30.0
                {
                    lowest = Some(end);
                }
            }
            if let Some((x, y)) = lowest {
                let text = if power < 0 { fixed(level, (-power) as usize) } else { fixed(level, 0) };
                canvas.text(&text, (x + 4.0, y - 7.0), Text { em: 10.5, colour: GREY, ..Text::BODY });
            }
        }
        let (x, mut y) = (plot.left + plot.width + 16.0, plot.top + 10.0);
        for (i, run) in self.runs.iter().enumerate() {
            let colour = SERIES[(i + 1) % SERIES.len()];
            let marker = Marker::SERIES[i % Marker::SERIES.len()];
            plot.line(canvas, run.path.iter().map(|p| (p[0], p[1])), Line::solid(colour, 1.8));
            for p in run.path.iter().filter(|p| plot.holds(p[0], p[1])) {
                canvas.marker(Marker::Circle, plot.at(p[0], p[1]), 1.6, colour, true);
            }
            canvas.marker(marker, plot.at(run.start[0], run.start[1]), 5.0, colour, false);
            canvas.marker(marker, plot.at(run.end[0], run.end[1]), 4.2, colour, true);
            canvas.marker(marker, (x + 6.0, y), 4.4, colour, false);
            let text = format!("start {}, {}", significant(run.start[0], 3), fixed(run.start[1], 2));
            canvas.text(&text, (x + 18.0, y), Text::BODY);
            let note = Text { em: 11.0, colour: GREY, ..Text::BODY };
            canvas.text(&format!("{} evaluations", run.visits.len()), (x + 18.0, y + 16.0), note);
            canvas.text(
                &format!("ends {}, {}", significant(run.end[0], 3), fixed(run.end[1], 3)),
                (x + 18.0, y + 31.0),
                note,
            );
            y += 54.0;
        }
        for path in [self.refined].into_iter().flatten() {
            plot.line(
                canvas,
                path.path.iter().map(|p| (p[0], p[1])),
                Line { colour: INK, width: 1.2, dash: Some((5.0, 3.0)) },
            );
        }
        cross(canvas, plot.at(self.law.lambda, self.law.law.beta));
        cross(canvas, (x + 6.0, y));
        canvas.text("fast route", (x + 18.0, y), Text::BODY);
        y += 24.0;
        if self.refined.is_some() {
            canvas.line(&[(x, y), (x + 12.0, y)], Line { colour: INK, width: 1.2, dash: Some((5.0, 3.0)) });
            canvas.text("best end continued", (x + 18.0, y), Text::BODY);
            y += 24.0;
        }
        canvas.line(&[(x, y), (x + 12.0, y)], Line::solid(PAIR, 1.4));
        canvas.text("sum of squares", (x + 18.0, y), Text::BODY);
    }
}

fn cross(canvas: &mut Canvas, (x, y): (f64, f64)) {
    for (dx, dy) in [(6.0, 0.0), (0.0, 6.0)] {
        canvas.line(&[(x - dx, y - dy), (x + dx, y + dy)], Line::solid(INK, 2.0));
    }
}

/// Confidence region of strength and exponent.
pub struct Region<'a> {
    pub law: &'a LawOutcome,
}

impl Figure for Region<'_> {
    fn size(&self) -> (u32, u32) {
        (560, 500)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let Some(map) = &self.law.map else { return };
        let ends = |v: &[f64]| [v[0], v[v.len() - 1]];
        let plot = Panel {
            left: 60.0,
            top: 84.0,
            width: 470.0,
            height: 360.0,
            x: Axis::between("strength at 5 kPa, kPa", ends(&map.tau_ref_kpa), 6),
            y: Axis::between("β", ends(&map.beta), 6),
        };
        for j in 1..map.beta.len() {
            for i in 1..map.tau_ref_kpa.len() {
                let v = map.growth[j - 1..=j].iter().flat_map(|r| &r[i - 1..=i]).sum::<f64>() / 4.0;
                if v > 1.0 {
                    continue;
                }
                let (x0, y0) = plot.at(map.tau_ref_kpa[i - 1], map.beta[j]);
                let (x1, y1) = plot.at(map.tau_ref_kpa[i], map.beta[j - 1]);
                canvas.rect(x0, y0, x1 - x0 + 0.3, y1 - y0 + 0.3, mix(rgb(0x9cc9e6), rgb(0xe3f0f8), v));
            }
        }
        plot.draw(canvas);
        let entries = vec![
            (Sample::Point(Marker::Circle, true), "best", INK),
            (Sample::Line, "interval of each alone", INK),
            (Sample::Area, "region of both", rgb(0xc5dff0)),
            (Sample::Point(Marker::Diamond, true), "published pair", ESTIMATE),
        ];
        Legend { width: 560.0, entries }.draw(canvas);
        for piece in contour(&map.tau_ref_kpa, &map.beta, &map.growth, 1.0) {
            canvas.line(&piece.map(|(x, y)| plot.at(x, y)), Line::solid(MODEL, 1.8));
        }
        let best = (self.law.law.tau_ref_kpa, self.law.law.beta);
        let bars = self.law.constants.iter().take(2).map(|c| c.interval.as_ref());
        for (k, interval) in bars.enumerate() {
            let Some(i) = interval else { continue };
            let ends = if k == 0 { [(i.low, best.1), (i.high, best.1)] } else { [(best.0, i.low), (best.0, i.high)] };
            canvas.line(&ends.map(|(x, y)| plot.at(x, y)), Line::solid(INK, 1.2));
        }
        canvas.marker(Marker::Circle, plot.at(best.0, best.1), 4.5, INK, true);
        let published = (1e3 * PUBLISHED[0] * fingerpad_identify::REFERENCE_MPA.powf(PUBLISHED[1]), PUBLISHED[1]);
        if plot.holds(published.0, published.1) {
            canvas.marker(Marker::Diamond, plot.at(published.0, published.1), 5.0, ESTIMATE, true);
        }
    }
}

/// Pieces of the line where a grid's values pass `level`; shape of `values` (y, x). Cells with a value that is not
/// finite are left out.
fn contour(xs: &[f64], ys: &[f64], values: &[Vec<f64>], level: f64) -> Vec<[(f64, f64); 2]> {
    let mut pieces = Vec::new();
    for j in 1..ys.len() {
        for i in 1..xs.len() {
            let corner = |a: usize, b: usize| (xs[i - 1 + a], ys[j - 1 + b], values[j - 1 + b][i - 1 + a] - level);
            let ring = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            if ring.iter().any(|c| !c.2.is_finite()) {
                continue;
            }
            let mut crossings = Vec::new();
            for k in 0..4 {
                let (a, b) = (ring[k], ring[(k + 1) % 4]);
                if (a.2 < 0.0) != (b.2 < 0.0) {
                    let s = a.2 / (a.2 - b.2);
                    crossings.push((a.0 + s * (b.0 - a.0), a.1 + s * (b.1 - a.1)));
                }
            }
            pieces.extend(crossings.chunks_exact(2).map(|c| [c[0], c[1]]));
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contour_of_a_cone_is_a_circle() {
        let along: Vec<f64> = (0..41).map(|i| -1.0 + f64::from(i) / 20.0).collect();
        let values: Vec<Vec<f64>> = along.iter().map(|y| along.iter().map(|x: &f64| x.hypot(*y)).collect()).collect();
        let pieces = contour(&along, &along, &values, 0.7);
        let length: f64 = pieces.iter().map(|[a, b]| (a.0 - b.0).hypot(a.1 - b.1)).sum();
        assert!((length / (2.0 * std::f64::consts::PI * 0.7) - 1.0).abs() < 0.01, "{length}");
    }
}
