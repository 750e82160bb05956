//! Pressure and stick/slip on the pad faces at several slides of one depth, seen along the plane's normal.

use super::axes::Axis;
use super::canvas::{Canvas, Figure, HPos, Line, Text, VPos};
use super::colour::{GREY, INK, SLIPPING, STUCK, mix, viridis};
use super::font;
use super::numbers::{DepthNumbers, Numbers, fixed, map_snapshots};
use super::pad_view::{self, Face, PadView, UNTOUCHED, faces, touches};
use super::{BuildReport, DepthResult};
use fingerpad_fe::load_path::{FaceState, Snapshot};
use fingerpad_fe::mesh::Mesh;

/// Scales that all depths share, so that their maps can be compared.
#[derive(Clone, Debug)]
pub struct Scale {
    /// Pressure of the brightest colour, kPa.
    pub pressure: Axis,
    /// Part of the plane that is shown, mm: least x, least y, width, height.
    pub window_mm: [f64; 4],
}

/// One column: the slide and the faces.
pub struct Map {
    slide_mm: f64,
    along_x: bool,
    faces: Vec<Face>,
}

/// The maps of one depth.
pub struct ContactMaps<'a> {
    /// Shared scale.
    pub scale: &'a Scale,
    /// Columns.
    pub maps: &'a [Map],
    /// Whether the page is narrow: then the first, the middle and the last column are drawn.
    pub narrow: bool,
}

/// Maps of every depth that has any, on one scale.
pub fn per_depth<'a>(
    report: &BuildReport,
    numbers: &'a Numbers,
    mesh: &Mesh,
) -> Vec<(Scale, Vec<Map>, &'a DepthNumbers)> {
    let maps_of = |d: &DepthResult| map_snapshots(d).into_iter().map(|s| Map::of(s, mesh)).collect::<Vec<_>>();
    let all: Vec<Vec<Map>> = report.depths.iter().map(maps_of).collect();
    let touching = || all.iter().flatten().flat_map(|m| &m.faces).filter(|f| touches(&f.1));
    let Some(window_mm) = pad_view::window(all.iter().flatten().flat_map(|m| &m.faces)) else { return Vec::new() };
    let pressure = Axis::covering("", [0.0, 0.0], touching().map(|f| 1e3 * f.1.pressure_mpa), 4);
    let scale = Scale { pressure, window_mm };
    let pairs = all.into_iter().zip(&numbers.depths).filter(|(maps, _)| !maps.is_empty());
    pairs.map(|(maps, depth)| (scale.clone(), maps, depth)).collect()
}

impl Map {
    fn of(snapshot: &Snapshot, mesh: &Mesh) -> Self {
        let (x, y) = (snapshot.response.slide_x_mm, snapshot.response.slide_y_mm);
        Self { slide_mm: x.hypot(y), along_x: x >= 0.0 && y.abs() <= 1e-6 * x, faces: faces(snapshot, mesh) }
    }
}

const LEFT: f64 = 58.0;
const RIGHT: f64 = 118.0;
const TOP: f64 = 44.0;
const GAP: f64 = 12.0;
const BELOW: f64 = 52.0;
const WIDTH: f64 = 940.0;

impl ContactMaps<'_> {
    fn shown(&self) -> Vec<&Map> {
        let last = self.maps.len().saturating_sub(1);
        let is_shown = |i: usize| !self.narrow || [0, last / 2, last].contains(&i);
        self.maps.iter().enumerate().filter(|(i, _)| is_shown(*i)).map(|(_, map)| map).collect()
    }

    /// One map: the window's own proportions, at most 5 columns wide and 260 px high.
    fn view(&self) -> PadView {
        PadView::within(self.scale.window_mm, (WIDTH - LEFT - RIGHT + GAP) / 5.0 - GAP, 260.0)
    }

    fn colour_bar(&self, canvas: &mut Canvas, left: f64, top: f64, height: f64) {
        let axis = &self.scale.pressure;
        canvas.text("Pressure, kPa", (left, top - 13.0), Text { bold: true, ..Text::BODY });
        let strips = 64;
        for i in 0..strips {
            let share = f64::from(i) / f64::from(strips);
            let step = height / f64::from(strips);
            canvas.rect(left, top + height - (share * height) - step, 16.0, step + 0.5, viridis(share + 0.5 / 64.0));
        }
        for (tick, number) in &axis.ticks {
            let y = top + height * (1.0 - tick / axis.max());
            canvas.line(&[(left + 16.0, y), (left + 20.0, y)], Line::solid(GREY, 1.0));
            canvas.text(number, (left + 24.0, y), Text { em: 11.5, colour: GREY, ..Text::BODY });
        }
    }
}

impl Figure for ContactMaps<'_> {
    fn size(&self) -> (u32, u32) {
        let (width, height) = self.view().size();
        let narrow = LEFT + self.shown().len() as f64 * (width + GAP) + RIGHT;
        let width = if self.narrow { narrow } else { WIDTH };
        (width as u32, (TOP + 2.0 * height + GAP + BELOW).ceil() as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let view = self.view();
        let (width, height) = view.size();
        let full = self.scale.pressure.max();
        let second = TOP + height + GAP;
        let shown = self.shown();
        for (i, map) in shown.iter().enumerate() {
            let left = LEFT + i as f64 * (width + GAP);
            let title = format!("slide {} mm", fixed(map.slide_mm, 2).trim_end_matches('0').trim_end_matches('.'));
            let style = Text { bold: true, h: HPos::Center, em: 12.5, ..Text::BODY };
            canvas.text(&title, (left + width / 2.0, TOP - 13.0), style);
            // A face that touches in part is as pale as the part is small.
            let shade = |f: &FaceState, colour| mix(UNTOUCHED, colour, f.contact_fraction);
            view.draw(canvas, (left, TOP), &map.faces, |f| shade(f, viridis(1e3 * f.pressure_mpa / full)));
            view.draw(canvas, (left, second), &map.faces, |f| shade(f, mix(SLIPPING, STUCK, f.stick_fraction)));
            view.ticks(canvas, (left, TOP), false, i == 0);
            view.ticks(canvas, (left, second), true, i == 0);
        }
        let all = shown.len() as f64 * (width + GAP) - GAP;
        let bottom = second + height;
        let label = match shown.iter().all(|m| m.along_x) && !self.narrow {
            true => "x, mm (the plane moves to the right, from proximal to distal)",
            false => "x, mm",
        };
        let left = LEFT + (all / 2.0 - font::width(label, Text::BODY.em, false) / 2.0).max(0.0);
        canvas.text(label, (left, bottom + 26.0), Text { v: VPos::Top, ..Text::BODY });
        canvas.text("y, mm", (8.0, TOP - 13.0), Text::BODY);

        let left = LEFT + shown.len() as f64 * (width + GAP) + 6.0;
        self.colour_bar(canvas, left, TOP, height);
        canvas.text("Contact", (left, second + 8.0), Text { bold: true, ..Text::BODY });
        let entries = [
            (STUCK, "stuck"),
            (mix(SLIPPING, STUCK, 0.5), "partly stuck"),
            (SLIPPING, "slipping"),
            (UNTOUCHED, "no contact"),
        ];
        for (i, (colour, name)) in entries.into_iter().enumerate() {
            let y = second + 30.0 + 21.0 * i as f64;
            canvas.framed_rect(left, y - 6.0, 16.0, 12.0, colour, Line::solid(GREY, 0.5));
            canvas.text(name, (left + 24.0, y), Text { colour: INK, ..Text::BODY });
        }
    }
}
