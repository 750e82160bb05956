//! The contact at chosen rows: pressure, stick and slip, accumulated slip, traction on the faces of the pad.

use super::{MapNumbers, SimulationReport};
use crate::Picture;
use crate::axes::Axis;
use crate::canvas::{Canvas, Figure, HPos, Line, Text, VPos};
use crate::colour::{Colour, GREY, INK, MODEL, SLIPPING, STUCK, mix, rgb, viridis};
use crate::numbers::range;
use crate::pad_view::{self, Face, PadView, UNTOUCHED, faces, touches};
use fingerpad_fe::load_path::{FaceState, Trajectory};
use fingerpad_fe::mesh::Mesh;

/// The maps of one row.
pub struct MapSet {
    /// Its numbers.
    pub numbers: MapNumbers,
    /// Its pictures.
    pub pictures: Vec<Picture>,
}

/// Numbers of the sets of maps; the snapshots are in the order of the rows.
pub fn numbers(report: &SimulationReport) -> Vec<MapNumbers> {
    let snapshots = report.trajectory.snapshots.iter().zip(&report.map_rows).zip('A'..);
    let one = |((snapshot, row), letter): ((&fingerpad_fe::load_path::Snapshot, &usize), char)| {
        let largest = |of: fn(&FaceState) -> f64| range(snapshot.faces.iter().map(of)).map_or(0.0, |r| r.max);
        MapNumbers {
            letter,
            row: row + 1,
            peak_pressure_kpa: 1e3 * largest(|f| f.pressure_mpa),
            peak_traction_kpa: 1e3 * largest(|f| length(f.traction_mpa)),
            largest_slip_mm: largest(|f| length(f.slip_mm)),
            response: snapshot.response,
        }
    };
    snapshots.map(one).collect()
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

/// The mapped quantity of a face.
#[derive(Clone, Copy)]
enum Shown {
    /// A number, from dark to bright.
    Scalar(fn(&FaceState) -> f64),
    /// A vector: its size as colour, and arrows.
    Vector(fn(&FaceState) -> [f64; 2]),
    /// Stuck or slipping.
    Stick,
}

/// Name, title and content of every map of a set.
const MAPS: [(&str, &str, Shown); 4] = [
    ("pressure", "Pressure, kPa", Shown::Scalar(|f| 1e3 * f.pressure_mpa)),
    ("stick", "Stick and slip", Shown::Stick),
    ("slip", "Slip since first contact, mm", Shown::Vector(|f| f.slip_mm)),
    ("traction", "Traction on the skin, kPa", Shown::Vector(|f| f.traction_mpa.map(|t| 1e3 * t))),
];

/// Draws the maps of all snapshots on common scales; none if there is never contact.
pub fn draw(trajectory: &Trajectory, mesh: &Mesh, numbers: &[MapNumbers]) -> Vec<MapSet> {
    let all: Vec<Vec<Face>> = trajectory.snapshots.iter().map(|s| faces(s, mesh)).collect();
    let Some(window_mm) = pad_view::window(all.iter().flatten()) else { return Vec::new() };
    let view = PadView::within(window_mm, WIDTH - LEFT - RIGHT, MOST_HEIGHT);
    let scales = MAPS.map(|(_, _, shown)| {
        let touching = all.iter().flatten().filter(|f| touches(&f.1));
        Axis::covering("", [0.0, 0.0], touching.map(|f| shown.size(&f.1)), 4)
    });
    let mut sets = Vec::new();
    for (numbers, faces) in numbers.iter().zip(&all) {
        let mut pictures = Vec::new();
        for ((name, title, shown), scale) in MAPS.into_iter().zip(&scales) {
            let figure = ContactMap { view, faces, title, shown, scale };
            let (file, title) = (format!("contact_{}_{name}", numbers.letter), format!("{title}, {}", numbers.letter));
            pictures.push(Picture::new(&file, title, "", &figure));
        }
        sets.push(MapSet { numbers: numbers.clone(), pictures });
    }
    sets
}

impl Shown {
    fn size(&self, face: &FaceState) -> f64 {
        match self {
            Self::Scalar(of) => of(face),
            Self::Vector(of) => length(of(face)),
            Self::Stick => face.stick_fraction,
        }
    }

    /// Colour of a value from 0 to 1.
    fn colour(&self, share: f64) -> Colour {
        match self {
            Self::Scalar(_) => viridis(share),
            // Pale, so that arrows are visible on it.
            Self::Vector(_) => mix(rgb(0xe6eff6), mix(MODEL, rgb(0xffffff), 0.25), share),
            Self::Stick => mix(SLIPPING, STUCK, share),
        }
    }
}

const WIDTH: f64 = 300.0;
const LEFT: f64 = 34.0;
const RIGHT: f64 = 8.0;
const TOP: f64 = 30.0;
const BELOW: f64 = 84.0;
const MOST_HEIGHT: f64 = 300.0;
/// Distance of arrows on the plane, px, and length of the longest.
const ARROW_EVERY: f64 = 17.0;
const LONGEST_ARROW: f64 = 25.0;

/// One map.
struct ContactMap<'a> {
    view: PadView,
    faces: &'a [Face],
    title: &'static str,
    shown: Shown,
    scale: &'a Axis,
}

impl ContactMap<'_> {
    /// Upper left corner of the view.
    fn corner(&self) -> (f64, f64) {
        (LEFT + 0.5 * (WIDTH - LEFT - RIGHT - self.view.size().0), TOP)
    }

    /// Arrows of the faces that lie nearest to the points of a square grid.
    fn arrows(&self, canvas: &mut Canvas, of: fn(&FaceState) -> [f64; 2]) {
        let mut nearest: std::collections::BTreeMap<(i64, i64), (f64, (f64, f64), [f64; 2])> = Default::default();
        for (outline, state) in self.faces.iter().filter(|f| touches(&f.1)) {
            let corners = outline.len() as f64;
            let sum = outline.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
            let centre = self.view.at(self.corner(), (sum.0 / corners, sum.1 / corners));
            let cell = |v: f64| (v / ARROW_EVERY).floor();
            let off = |v: f64| v - (cell(v) + 0.5) * ARROW_EVERY;
            let distance = off(centre.0).hypot(off(centre.1));
            let key = (cell(centre.0) as i64, cell(centre.1) as i64);
            if distance.is_finite() && nearest.get(&key).is_none_or(|n| distance < n.0) {
                nearest.insert(key, (distance, centre, of(state)));
            }
        }
        for (_, (x, y), vector) in nearest.into_values() {
            // Upwards on the plane is upwards in the picture.
            let arrow = vector.map(|v| v / self.scale.max() * LONGEST_ARROW);
            let (dx, dy) = (arrow[0], -arrow[1]);
            let long = dx.hypot(dy);
            if long > 1.5 {
                let (tail, tip) = ((x - 0.5 * dx, y - 0.5 * dy), (x + 0.5 * dx, y + 0.5 * dy));
                let head = (0.45 * long).clamp(3.0, 7.0).min(long);
                let neck = (tip.0 - dx / long * 0.8 * head, tip.1 - dy / long * 0.8 * head);
                canvas.line(&[tail, neck], Line::solid(INK, 1.1));
                canvas.arrow_head(tip, (dx, dy), head, INK);
            }
        }
    }

    fn colour_bar(&self, canvas: &mut Canvas, top: f64) {
        let (left, width) = (LEFT + 10.0, WIDTH - LEFT - RIGHT - 30.0);
        let strips = 60;
        let step = width / f64::from(strips);
        for i in 0..strips {
            let share = (f64::from(i) + 0.5) / f64::from(strips);
            canvas.rect(left + f64::from(i) * step, top, step + 0.5, 11.0, self.shown.colour(share));
        }
        let small = Text { em: 11.0, colour: GREY, h: HPos::Center, v: VPos::Top, ..Text::BODY };
        for (tick, number) in &self.scale.ticks {
            let x = left + width * tick / self.scale.max();
            canvas.line(&[(x, top + 11.0), (x, top + 15.0)], Line::solid(GREY, 1.0));
            canvas.text(number, (x, top + 16.0), small);
        }
    }

    fn stick_legend(&self, canvas: &mut Canvas, top: f64) {
        let partly = mix(SLIPPING, STUCK, 0.5);
        let entries = [(STUCK, "stuck"), (partly, "partly"), (SLIPPING, "slipping"), (UNTOUCHED, "none")];
        for (i, (colour, name)) in entries.into_iter().enumerate() {
            let left = LEFT - 16.0 + [0.0, 64.0, 130.0, 208.0][i];
            canvas.framed_rect(left, top, 14.0, 12.0, colour, Line::solid(GREY, 0.5));
            canvas.text(name, (left + 19.0, top + 6.0), Text::BODY);
        }
    }
}

impl Figure for ContactMap<'_> {
    fn size(&self) -> (u32, u32) {
        (WIDTH as u32, (TOP + self.view.size().1 + BELOW).ceil() as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let corner = self.corner();
        let (width, height) = self.view.size();
        canvas.text(self.title, (LEFT - 16.0, 13.0), Text { bold: true, em: 12.5, ..Text::BODY });
        // A face that touches in part is as pale as the part is small.
        let fill = |f: &FaceState| {
            mix(UNTOUCHED, self.shown.colour(self.shown.size(f) / self.scale.max()), f.contact_fraction)
        };
        self.view.draw(canvas, corner, self.faces, fill);
        self.view.ticks(canvas, corner, true, true);
        if let Shown::Vector(of) = self.shown {
            self.arrows(canvas, of);
        }
        let bottom = corner.1 + height;
        let name = Text { em: 11.0, colour: GREY, h: HPos::Center, v: VPos::Top, ..Text::BODY };
        canvas.text("x to the right, y upwards, mm", (corner.0 + width / 2.0, bottom + 21.0), name);
        match self.shown {
            Shown::Stick => self.stick_legend(canvas, bottom + 46.0),
            _ => self.colour_bar(canvas, bottom + 44.0),
        }
    }
}
