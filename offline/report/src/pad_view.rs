//! View of the pad from the plane: faces at their current places, x from proximal to distal to the right.

use super::canvas::{Canvas, HPos, Line, Text, VPos};
use super::colour::{Colour, FAINT, GREY, WHITE, rgb};
use super::numbers::fixed;
use fingerpad_fe::load_path::{FaceState, Snapshot};
use fingerpad_fe::mesh::Mesh;

/// A face of the pad: its outline on the plane, mm, and its state.
pub type Face = (Vec<(f64, f64)>, FaceState);

/// Colour of faces without contact.
pub const UNTOUCHED: Colour = rgb(0xf3f4f6);
/// Margin around the touching faces, mm.
const MARGIN_MM: f64 = 0.8;

/// The faces of a snapshot on its mesh.
pub fn faces(snapshot: &Snapshot, mesh: &Mesh) -> Vec<Face> {
    let corner = |node: &u32| {
        let p = mesh.nodes[*node as usize] + snapshot.displacement_mm[*node as usize];
        (p.x, p.y)
    };
    let outline = |face: &[u32]| face.iter().map(corner).collect::<Vec<_>>();
    let quads = mesh.pad_faces.iter().map(|face| outline(face));
    let outlines = quads.chain(mesh.pad_triangles.iter().map(|face| outline(face)));
    outlines.zip(snapshot.faces.iter().copied()).collect()
}

/// Whether any of a face touches.
pub fn touches(face: &FaceState) -> bool {
    face.contact_fraction > 0.0 || face.pressure_mpa > 0.0
}

/// The part of the plane around all faces that touch: least x, least y, width, height, mm. None if nothing touches.
pub fn window<'a>(faces: impl Iterator<Item = &'a Face>) -> Option<[f64; 4]> {
    let mut window = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    let corners = faces.filter(|f| touches(&f.1)).flat_map(|f| f.0.iter());
    for (x, y) in corners.filter(|p| p.0.is_finite() && p.1.is_finite()) {
        window = [window[0].min(*x), window[1].min(*y), window[2].max(*x), window[3].max(*y)];
    }
    let [x0, y0, x1, y1] = window;
    let margin = MARGIN_MM;
    (x0 < x1 && y0 < y1).then_some([x0 - margin, y0 - margin, x1 - x0 + 2.0 * margin, y1 - y0 + 2.0 * margin])
}

/// A window on the plane in a picture.
#[derive(Clone, Copy, Debug)]
pub struct PadView {
    /// Least x, least y, width, height, mm.
    pub window_mm: [f64; 4],
    /// Pixels per mm.
    pub scale: f64,
}

impl PadView {
    /// The largest view of a window within so many pixels of width and height.
    pub fn within(window_mm: [f64; 4], width: f64, height: f64) -> Self {
        Self { window_mm, scale: (width / window_mm[2]).min(height / window_mm[3]) }
    }

    /// Width and height, px.
    pub fn size(&self) -> (f64, f64) {
        (self.window_mm[2] * self.scale, self.window_mm[3] * self.scale)
    }

    /// Position of a point of the plane in the view whose upper left corner is (`left`, `top`).
    pub fn at(&self, (left, top): (f64, f64), (x, y): (f64, f64)) -> (f64, f64) {
        let [x0, y0, _, h] = self.window_mm;
        (left + (x - x0) * self.scale, top + (h - (y - y0)) * self.scale)
    }

    /// Draws the faces that lie within the window, those that touch last.
    pub fn draw(&self, canvas: &mut Canvas, corner: (f64, f64), faces: &[Face], fill: impl Fn(&FaceState) -> Colour) {
        let (width, height) = self.size();
        let [x0, y0, w, h] = self.window_mm;
        let inside = |(x, y): &(f64, f64)| *x >= x0 && *x <= x0 + w && *y >= y0 && *y <= y0 + h;
        canvas.framed_rect(corner.0, corner.1, width, height, WHITE, Line::solid(FAINT, 1.0));
        for touching in [false, true] {
            for (outline, state) in faces.iter().filter(|f| touches(&f.1) == touching) {
                if outline.iter().all(inside) {
                    let points: Vec<_> = outline.iter().map(|p| self.at(corner, *p)).collect();
                    let fill = fill(state);
                    canvas.face(&points, fill, if touching { Line::solid(fill, 0.3) } else { Line::solid(FAINT, 0.5) });
                }
            }
        }
    }

    /// Draws ticks every 5 mm below (`x`) and left (`y`) of the view.
    pub fn ticks(&self, canvas: &mut Canvas, (left, top): (f64, f64), x: bool, y: bool) {
        let (_, height) = self.size();
        let [x0, y0, w, h] = self.window_mm;
        let fives = |from: f64, length: f64| {
            ((from / 5.0).ceil() as i64..=((from + length) / 5.0).floor() as i64).map(|i| 5.0 * i as f64)
        };
        let small = Text { em: 11.0, colour: GREY, ..Text::BODY };
        let bottom = top + height;
        for v in fives(x0, w).filter(|_| x) {
            let px = left + (v - x0) * self.scale;
            canvas.line(&[(px, bottom), (px, bottom + 4.0)], Line::solid(GREY, 1.0));
            canvas.text(&fixed(v, 0), (px, bottom + 6.0), Text { h: HPos::Center, v: VPos::Top, ..small });
        }
        for v in fives(y0, h).filter(|_| y) {
            let py = bottom - (v - y0) * self.scale;
            canvas.line(&[(left - 4.0, py), (left, py)], Line::solid(GREY, 1.0));
            canvas.text(&fixed(v, 0), (left - 7.0, py), Text { h: HPos::Right, ..small });
        }
    }
}
