//! Stick and slip of the finite elements' faces and of a pad's patches, side by side.
//!
//! Main type: [`StickMap`].

use fingerpad::pad::PatchState;
use fingerpad_fe::load_path::{FaceState, Snapshot};
use fingerpad_fe::mesh::Mesh;

use super::canvas::{Canvas, Figure, Line, Text};
use super::colour::{GREY, SLIPPING, STUCK, mix};
use super::numbers::fixed;
use super::pad_view::{self, Face, PadView, UNTOUCHED, faces, touches};

/// The contact of both models at one place of a slide.
#[derive(Clone, Debug)]
pub struct StickMap {
    /// The finite elements.
    pub elements: Snapshot,
    /// The patches of the pad; empty without a pad.
    pub patches: Vec<PatchState>,
}

/// The maps of a slide.
#[derive(Clone)]
pub(super) struct StickMaps {
    window_mm: [f64; 4],
    columns: usize,
    /// Title, faces, patches.
    maps: Vec<(String, Vec<Face>, Vec<Face>)>,
}

/// A patch as a disc of its area in contact; None without contact.
fn disc(patch: &PatchState) -> Option<Face> {
    const CORNERS: usize = 24;
    let radius_mm = (f64::from(patch.contact_area_mm2) / std::f64::consts::PI).sqrt();
    let [x, y, _] = patch.place_mm.map(f64::from);
    let corner = |k: usize| {
        let (sin, cos) = (k as f64 / CORNERS as f64 * std::f64::consts::TAU).sin_cos();
        (x + radius_mm * cos, y + radius_mm * sin)
    };
    let state = FaceState {
        pressure_mpa: patch.pressure_mpa.into(),
        traction_mpa: patch.traction_mpa.map(f64::from),
        slip_mm: [0.0; 2],
        contact_fraction: 1.0,
        stick_fraction: patch.stick_ratio.into(),
    };
    (radius_mm > 0.0).then(|| ((0..CORNERS).map(corner).collect(), state))
}

const WIDTH: f64 = 940.0;
const LEFT: f64 = 40.0;
const TOP: f64 = 46.0;
const GAP: f64 = 12.0;
const BELOW: f64 = 30.0;

impl StickMaps {
    /// None if nothing touches.
    pub fn of(maps: &[StickMap], mesh: &Mesh) -> Option<Self> {
        let map = |map: &StickMap| {
            let r = &map.elements.response;
            let title = format!("slide {} mm, {} % stick", fixed(r.slide_x_mm, 2), fixed(100.0 * r.stick_ratio, 0));
            (title, faces(&map.elements, mesh), map.patches.iter().filter_map(disc).collect())
        };
        let maps: Vec<(String, Vec<Face>, Vec<Face>)> = maps.iter().map(map).collect();
        let window_mm = pad_view::window(maps.iter().flat_map(|(_, faces, patches)| faces.iter().chain(patches)))?;
        Some(Self { window_mm, columns: 4, maps })
    }

    /// The same in rows of so many.
    pub fn in_columns(&self, columns: usize) -> Self {
        Self { columns, ..self.clone() }
    }

    fn width(&self) -> f64 {
        WIDTH * self.columns as f64 / 4.0
    }

    fn view(&self) -> PadView {
        PadView::within(self.window_mm, (self.width() - LEFT) / self.columns as f64 - GAP, 260.0)
    }

    /// Height of the maps of the finite elements and of the pad below each other, px.
    fn row_height(&self) -> f64 {
        let (_, height) = self.view().size();
        TOP + 2.0 * (height + GAP) + BELOW
    }
}

impl Figure for StickMaps {
    fn size(&self) -> (u32, u32) {
        let rows = self.maps.len().div_ceil(self.columns);
        (self.width() as u32, (self.row_height() * rows as f64) as u32 + 30)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let view = self.view();
        let (width, height) = view.size();
        for (k, name) in ["stuck", "slipping", "no contact"].into_iter().enumerate() {
            let left = LEFT + 110.0 * k as f64;
            canvas.framed_rect(left, 6.0, 16.0, 12.0, [STUCK, SLIPPING, UNTOUCHED][k], Line::solid(GREY, 0.5));
            canvas.text(name, (left + 22.0, 12.0), Text::BODY);
        }
        for (k, (title, elements, patches)) in self.maps.iter().enumerate() {
            let left = LEFT + (width + GAP) * (k % self.columns) as f64;
            let top = 30.0 + self.row_height() * (k / self.columns) as f64;
            canvas.text(title, (left, top + 12.0), Text { bold: true, ..Text::BODY }.within(title, width));
            for (row, (name, faces)) in [("finite elements", elements), ("pad", patches)].into_iter().enumerate() {
                let corner = (left, top + TOP + row as f64 * (height + GAP));
                let shade = |f: &FaceState| {
                    mix(
                        UNTOUCHED,
                        mix(SLIPPING, STUCK, f.stick_fraction),
                        if touches(f) { f.contact_fraction } else { 0.0 },
                    )
                };
                view.draw(canvas, corner, faces, shade);
                view.ticks(canvas, corner, row == 1, k % self.columns == 0);
                canvas.text(name, (left + 6.0, corner.1 + 10.0), Text { em: 11.0, colour: GREY, ..Text::BODY });
            }
        }
    }
}
