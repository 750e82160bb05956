//! Pressure and stick/slip on the pad faces at several slides of one depth, seen along the plane's normal.

use plotters_backend::DrawingBackend;

use super::axes::Axis;
use super::canvas::{Canvas, Drawn, Figure, HPos, Line, Text, VPos};
use super::colour::{FAINT, GREY, INK, SLIPPING, STUCK, WHITE, mix, rgb, viridis};
use super::font;
use super::numbers::{DepthNumbers, Numbers, fixed, map_snapshots};
use super::{BuildReport, DepthResult};
use fingerpad_fe::load_path::{FaceState, Snapshot};
use fingerpad_fe::mesh::Mesh;

/// What all depths share, so that their maps can be compared.
#[derive(Clone, Debug)]
pub struct Scale {
    /// Pressure of the brightest colour, kPa.
    pub pressure: Axis,
    /// Part of the plane that is shown, mm: least x, least y, width, height.
    pub window_mm: [f64; 4],
}

/// The face's outline on the plane, mm, and its state.
type Face = (Vec<(f64, f64)>, FaceState);

/// One column: the slide and the faces.
pub struct Map {
    slide_mm: f64,
    along_x: bool,
    faces: Vec<Face>,
}

/// The maps of one depth.
pub struct ContactMaps {
    /// Shared scale.
    pub scale: Scale,
    /// Columns.
    pub maps: Vec<Map>,
}

/// Maps of every depth that has any, on one scale.
pub fn per_depth<'a>(
    report: &BuildReport,
    numbers: &'a Numbers,
    mesh: &Mesh,
) -> Vec<(Scale, Vec<Map>, &'a DepthNumbers)> {
    let maps_of = |d: &DepthResult| map_snapshots(d).into_iter().map(|s| Map::of(s, mesh)).collect::<Vec<_>>();
    let all: Vec<Vec<Map>> = report.depths.iter().map(maps_of).collect();
    let faces = || all.iter().flatten().flat_map(|m| &m.faces).filter(|f| touches(&f.1));
    let mut window = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    for (x, y) in faces().flat_map(|f| f.0.iter()).filter(|p| p.0.is_finite() && p.1.is_finite()) {
        window = [window[0].min(*x), window[1].min(*y), window[2].max(*x), window[3].max(*y)];
    }
    if !(window[0] < window[2] && window[1] < window[3]) {
        return Vec::new();
    }
    let margin = 0.8;
    let window_mm = [
        window[0] - margin,
        window[1] - margin,
        window[2] - window[0] + 2.0 * margin,
        window[3] - window[1] + 2.0 * margin,
    ];
    let pressure = Axis::covering("", [0.0, 0.0], faces().map(|f| 1e3 * f.1.pressure_mpa), 4);
    let scale = Scale { pressure, window_mm };
    let pairs = all.into_iter().zip(&numbers.depths).filter(|(maps, _)| !maps.is_empty());
    pairs.map(|(maps, depth)| (scale.clone(), maps, depth)).collect()
}

fn touches(face: &FaceState) -> bool {
    face.contact_fraction > 0.0 || face.pressure_mpa > 0.0
}

impl Map {
    fn of(snapshot: &Snapshot, mesh: &Mesh) -> Self {
        let corner = |node: &u32| {
            let p = mesh.nodes[*node as usize] + snapshot.displacement_mm[*node as usize];
            (p.x, p.y)
        };
        let outline = |face: &[u32]| face.iter().map(corner).collect::<Vec<_>>();
        let quads = mesh.pad_faces.iter().map(|face| outline(face));
        let outlines = quads.chain(mesh.pad_triangles.iter().map(|face| outline(face)));
        let faces = outlines.zip(snapshot.faces.iter().copied()).collect();
        let (x, y) = (snapshot.response.slide_x_mm, snapshot.response.slide_y_mm);
        Self { slide_mm: x.hypot(y), along_x: x >= 0.0 && y.abs() <= 1e-6 * x, faces }
    }
}

const LEFT: f64 = 58.0;
const RIGHT: f64 = 118.0;
const TOP: f64 = 44.0;
const GAP: f64 = 12.0;
const BELOW: f64 = 52.0;
const WIDTH: f64 = 940.0;
const UNTOUCHED: plotters_backend::BackendColor = rgb(0xf3f4f6);

impl ContactMaps {
    /// Width and height of one map, px: the window's own proportions, at most 5 columns wide and 260 px high.
    fn cell(&self) -> (f64, f64, f64) {
        let [_, _, w, h] = self.scale.window_mm;
        let scale = ((WIDTH - LEFT - RIGHT + GAP) / 5.0 - GAP) / w;
        let scale = scale.min(260.0 / h);
        (w * scale, h * scale, scale)
    }

    fn map<DB: DrawingBackend>(
        &self,
        canvas: &mut Canvas<'_, DB>,
        map: &Map,
        (left, top): (f64, f64),
        fill: impl Fn(&FaceState) -> plotters_backend::BackendColor,
    ) -> Drawn<DB> {
        let (width, height, scale) = self.cell();
        let [x0, y0, w, h] = self.scale.window_mm;
        let at = |(x, y): &(f64, f64)| (left + (x - x0) * scale, top + height - (y - y0) * scale);
        let inside = |(x, y): &(f64, f64)| *x >= x0 && *x <= x0 + w && *y >= y0 && *y <= y0 + h;
        canvas.rect(left, top, width, height, WHITE)?;
        for touching in [false, true] {
            for (outline, state) in map.faces.iter().filter(|f| touches(&f.1) == touching) {
                if outline.iter().all(inside) {
                    let points: Vec<_> = outline.iter().map(at).collect();
                    canvas.area(&points, fill(state))?;
                    let edge = if touching { fill(state) } else { FAINT };
                    canvas.outline(&points, Line::solid(edge, if touching { 0.3 } else { 0.5 }))?;
                }
            }
        }
        let corners = [(left, top), (left + width, top), (left + width, top + height), (left, top + height)];
        canvas.outline(&corners, Line::solid(FAINT, 1.0))
    }

    fn ticks<DB: DrawingBackend>(
        &self,
        canvas: &mut Canvas<'_, DB>,
        left: f64,
        top: f64,
        x: bool,
        y: bool,
    ) -> Drawn<DB> {
        let (_, height, scale) = self.cell();
        let [x0, y0, w, h] = self.scale.window_mm;
        let fives = |from: f64, length: f64| {
            ((from / 5.0).ceil() as i64..=((from + length) / 5.0).floor() as i64).map(|i| 5.0 * i as f64)
        };
        let small = Text { em: 11.0, colour: GREY, ..Text::BODY };
        let bottom = top + height;
        for v in fives(x0, w).filter(|_| x) {
            let px = left + (v - x0) * scale;
            canvas.line(&[(px, bottom), (px, bottom + 4.0)], Line::solid(GREY, 1.0))?;
            canvas.text(&fixed(v, 0), (px, bottom + 6.0), Text { h: HPos::Center, v: VPos::Top, ..small })?;
        }
        for v in fives(y0, h).filter(|_| y) {
            let py = bottom - (v - y0) * scale;
            canvas.line(&[(left - 4.0, py), (left, py)], Line::solid(GREY, 1.0))?;
            canvas.text(&fixed(v, 0), (left - 7.0, py), Text { h: HPos::Right, ..small })?;
        }
        Ok(())
    }

    fn colour_bar<DB: DrawingBackend>(
        &self,
        canvas: &mut Canvas<'_, DB>,
        left: f64,
        top: f64,
        height: f64,
    ) -> Drawn<DB> {
        let axis = &self.scale.pressure;
        canvas.text("Pressure, kPa", (left, top - 13.0), Text { bold: true, ..Text::BODY })?;
        let strips = 64;
        for i in 0..strips {
            let share = f64::from(i) / f64::from(strips);
            let step = height / f64::from(strips);
            canvas.rect(left, top + height - (share * height) - step, 16.0, step + 0.5, viridis(share + 0.5 / 64.0))?;
        }
        for tick in &axis.ticks {
            let y = top + height * (1.0 - tick / axis.max());
            canvas.line(&[(left + 16.0, y), (left + 20.0, y)], Line::solid(GREY, 1.0))?;
            canvas.text(
                &fixed(*tick, axis.decimals),
                (left + 24.0, y),
                Text { em: 11.5, colour: GREY, ..Text::BODY },
            )?;
        }
        Ok(())
    }
}

impl Figure for ContactMaps {
    fn size(&self) -> (u32, u32) {
        let (_, height, _) = self.cell();
        (WIDTH as u32, (TOP + 2.0 * height + GAP + BELOW).ceil() as u32)
    }

    fn draw<DB: DrawingBackend>(&self, canvas: &mut Canvas<'_, DB>) -> Drawn<DB> {
        let (width, height, _) = self.cell();
        let full = self.scale.pressure.max();
        let second = TOP + height + GAP;
        for (i, map) in self.maps.iter().enumerate() {
            let left = LEFT + i as f64 * (width + GAP);
            let title = format!("slide {} mm", fixed(map.slide_mm, 2).trim_end_matches('0').trim_end_matches('.'));
            let style = Text { bold: true, h: HPos::Center, em: 12.5, ..Text::BODY };
            canvas.text(&title, (left + width / 2.0, TOP - 13.0), style)?;
            // A face that touches in part is as pale as the part is small.
            let shade = |f: &FaceState, colour| mix(UNTOUCHED, colour, f.contact_fraction);
            self.map(canvas, map, (left, TOP), |f| shade(f, viridis(1e3 * f.pressure_mpa / full)))?;
            self.map(canvas, map, (left, second), |f| shade(f, mix(SLIPPING, STUCK, f.stick_fraction)))?;
            self.ticks(canvas, left, TOP, false, i == 0)?;
            self.ticks(canvas, left, second, true, i == 0)?;
        }
        let all = self.maps.len() as f64 * (width + GAP) - GAP;
        let bottom = second + height;
        let label = match self.maps.iter().all(|m| m.along_x) {
            true => "x, mm (the plane moves to the right, from proximal to distal)",
            false => "x, mm",
        };
        let left = LEFT + (all / 2.0 - font::width(label, Text::BODY.em, false) / 2.0).max(0.0);
        canvas.text(label, (left, bottom + 26.0), Text { v: VPos::Top, ..Text::BODY })?;
        canvas.text("y, mm", (8.0, TOP - 13.0), Text::BODY)?;

        let left = LEFT + self.maps.len() as f64 * (width + GAP) + 6.0;
        self.colour_bar(canvas, left, TOP, height)?;
        canvas.text("Contact", (left, second + 8.0), Text { bold: true, ..Text::BODY })?;
        let entries = [
            (STUCK, "stuck"),
            (mix(SLIPPING, STUCK, 0.5), "partly stuck"),
            (SLIPPING, "slipping"),
            (UNTOUCHED, "no contact"),
        ];
        for (i, (colour, name)) in entries.into_iter().enumerate() {
            let y = second + 30.0 + 21.0 * i as f64;
            canvas.rect(left, y - 6.0, 16.0, 12.0, colour)?;
            let corners = [(left, y - 6.0), (left + 16.0, y - 6.0), (left + 16.0, y + 6.0), (left, y + 6.0)];
            canvas.outline(&corners, Line::solid(GREY, 0.5))?;
            canvas.text(name, (left + 24.0, y), Text { colour: INK, ..Text::BODY })?;
        }
        Ok(())
    }
}
