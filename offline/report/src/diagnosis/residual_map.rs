//! The map of residuals over the columns.

use super::words::axis;
use crate::canvas::{Canvas, Figure, HPos, Marker, Text};
use crate::colour::{Colour, GREY, INK, WHITE, mix, rgb};
use crate::numbers::fixed;
use fingerpad_diagnose::Region;

const MORE: Colour = rgb(0xb2182b);
const LESS: Colour = rgb(0x2166ac);

/// Relative residual at full colour: the map's largest, at least 5 %.
pub fn scale(map: &[Region]) -> f64 {
    map.iter().map(|r| r.mean_relative.abs()).fold(0.05, f64::max).min(0.5)
}

/// Residuals over the parts of every column.
pub struct ResidualMap<'a> {
    /// The map.
    pub map: &'a [Region],
    /// Columns that drive a named effect.
    pub named: &'a [&'a str],
    /// Relative residual at full colour.
    pub scale: f64,
    /// Whether it is for a narrow page: one channel below the other.
    pub narrow: bool,
}

impl ResidualMap<'_> {
    fn columns(&self) -> Vec<&str> {
        let mut list: Vec<&str> = Vec::new();
        for r in self.map {
            if !list.contains(&r.column.as_str()) {
                list.push(&r.column);
            }
        }
        list
    }
}

const ROW: f64 = 34.0;
const CELL: f64 = 46.0;
/// Height of a channel's title and of the space below its rows, px.
const AROUND: f64 = 52.0;
/// Where the rows of the narrow form begin, px.
const NARROW_LEFT: f64 = 98.0;

impl Figure for ResidualMap<'_> {
    fn size(&self) -> (u32, u32) {
        let rows = ROW * self.columns().len().max(1) as f64;
        if self.narrow { (380, (44.0 + 3.0 * (AROUND + rows)) as u32) } else { (1080, (44.0 + AROUND + rows) as u32) }
    }

    fn draw(&self, canvas: &mut Canvas) {
        let height = self.size().1;
        let small = Text { em: 10.5, colour: GREY, ..Text::BODY };
        let channels = [
            ("normal", "normal force, %", 190.0),
            ("friction", "friction along the motion, %", 486.0),
            ("across", "friction across it, %", 782.0),
        ];
        for (k, (channel, title, left)) in channels.into_iter().enumerate() {
            let below = (AROUND + ROW * self.columns().len().max(1) as f64) * k as f64;
            let (left, top) = if self.narrow { (NARROW_LEFT, below) } else { (left, 0.0) };
            canvas.text(title, (left, top + 18.0), Text { bold: true, em: 12.5, ..Text::BODY });
            for (row, column) in self.columns().into_iter().enumerate() {
                let y = top + 36.0 + ROW * row as f64;
                if self.narrow || k == 0 {
                    let unit = self.map.iter().find(|r| r.column == column).map_or("", |r| r.unit.as_str());
                    let name = axis(column, unit);
                    let style = Text { h: HPos::Right, bold: self.named.contains(&column), ..Text::BODY }
                        .within(&name, left - 14.0);
                    canvas.text(&name, (left - 12.0, y + 11.0), style);
                }
                let bins: Vec<&Region> =
                    self.map.iter().filter(|r| r.column == column && r.channel == channel).collect();
                for (k, bin) in bins.iter().enumerate() {
                    let x = left + CELL * k as f64;
                    let s = (bin.mean_relative.abs() / self.scale).min(1.0);
                    let full = if bin.mean_relative > 0.0 { MORE } else { LESS };
                    canvas.rect(x, y, CELL - 2.0, 20.0, mix(rgb(0xf7f7f7), full, s));
                    let ink = if s > 0.55 { WHITE } else { INK };
                    let size = fixed(100.0 * bin.mean_relative.abs(), 1);
                    let sign = match bin.mean_relative {
                        _ if size == "0.0" => "",
                        m if m > 0.0 => "+",
                        _ => "−",
                    };
                    let text = format!("{sign}{size}");
                    canvas.text(
                        &text,
                        (x + 0.5 * CELL - 4.0, y + 10.0),
                        Text { em: 10.5, h: HPos::Center, colour: ink, ..Text::BODY },
                    );
                    if bin.z.abs() > 3.5 {
                        canvas.marker(Marker::Circle, (x + CELL - 7.0, y + 5.0), 1.8, ink, true);
                    }
                    canvas.text(&short(bin.from), (x, y + 26.0), Text { em: 9.0, ..small });
                }
                if let Some(last) = bins.last() {
                    let x = left + CELL * bins.len() as f64 - 4.0;
                    canvas.text(&short(last.to), (x, y + 26.0), Text { em: 9.0, h: HPos::Right, ..small });
                }
            }
        }
        let y = f64::from(height) - 22.0;
        let (less, bar, step) =
            if self.narrow { ("less measured", 92.0, 3.0) } else { ("less measured than predicted", 384.0, 5.0) };
        canvas.text(less, (bar - 12.0, y), Text { h: HPos::Right, ..small });
        for k in 0..40 {
            let s = f64::from(k) / 19.5 - 1.0;
            let full = if s > 0.0 { MORE } else { LESS };
            canvas.rect(bar + step * f64::from(k), y - 6.0, step + 0.2, 12.0, mix(rgb(0xf7f7f7), full, s.abs()));
        }
        let more = format!("more (full colour: {} %)", fixed(100.0 * self.scale, 0));
        canvas.text(&more, (bar + 40.0 * step + 12.0, y), small);
    }
}

/// A number in at most five characters.
fn short(v: f64) -> String {
    let decimals = if v.abs() >= 100.0 {
        0
    } else if v.abs() >= 10.0 {
        1
    } else {
        2
    };
    fixed(v, decimals)
}
