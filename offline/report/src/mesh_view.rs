//! Pictures of the mesh: cut open at y = 0, before and after the run, and the pad from below.

use std::collections::{BTreeMap, HashSet};

use nalgebra::Vector3;

use super::canvas::{Canvas, Figure, Line, Text};
use super::colour::{Colour, GREY, INK, WHITE, mix, rgb};
use super::numbers::fixed;
use fingerpad_fe::load_path::Snapshot;
use fingerpad_fe::mesh::{FACE_TRIANGLES, Mesh, Region, TET10_FACES};

const HEX_FACES: [[usize; 4]; 6] = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
const TET_FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
const HEX_EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
const TET_EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
/// The cut lies this far beside y = 0, so that it does not run along faces, mm.
const BESIDE: f64 = 1e-6;
const PAD: Colour = rgb(0xe07b4f);
const PLANE: Colour = rgb(0xe9eef4);

fn colour(region: Region) -> Colour {
    match region {
        Region::Skin => rgb(0xe5b08f),
        Region::Subcutaneous => rgb(0xf8e6b8),
        Region::DistalBone => rgb(0xb9c6d2),
        Region::ProximalBone => rgb(0x8797a8),
        Region::Nail => rgb(0x8d6aa8),
        Region::Soft(k) => SOFT[usize::from(k) % SOFT.len()],
    }
}

/// Colours of named soft regions, in turn.
const SOFT: [Colour; 4] = [rgb(0x9ec7a5), rgb(0xd9a5b3), rgb(0xa3b8dc), rgb(0xd8cf8e)];

type Point = Vector3<f64>;

struct Polygon {
    corners: Vec<Point>,
    fill: Colour,
}

/// View of a scene: directions to the right, up, and toward the viewer.
#[derive(Clone, Copy)]
struct View {
    right: Point,
    up: Point,
    toward: Point,
}

impl View {
    /// From the side of -y, turned toward the tip by `azimuth` and raised by `elevation`, degrees.
    fn side(azimuth: f64, elevation: f64) -> Self {
        let (a, e) = (azimuth.to_radians(), elevation.to_radians());
        let toward = Point::new(a.sin() * e.cos(), -a.cos() * e.cos(), e.sin());
        let right = Point::new(a.cos(), a.sin(), 0.0);
        Self { right, up: toward.cross(&right), toward }
    }

    fn below() -> Self {
        Self { right: Point::x(), up: -Point::y(), toward: -Point::z() }
    }

    fn flat(&self, p: &Point) -> (f64, f64) {
        (p.dot(&self.right), p.dot(&self.up))
    }
}

struct Scene {
    view: View,
    behind: Vec<Polygon>,
    section: Vec<Polygon>,
    plane: Option<(f64, [f64; 4])>,
    title: String,
}

/// The pictures of the mesh.
pub struct MeshView {
    scenes: Vec<Scene>,
    regions: Vec<(Colour, String)>,
    /// Depth and slide of the deformed picture, mm.
    pub deformed: Option<(f64, f64)>,
}

impl MeshView {
    /// Arranges the pictures: the mesh, the end of the deepest run, the pad.
    pub fn of<'a>(snapshots: impl Iterator<Item = &'a Snapshot>, mesh: &Mesh) -> Self {
        let side = View::side(24.0, 14.0);
        let whole = |s: &&Snapshot| s.displacement_mm.iter().all(|u| u.iter().all(|v| v.is_finite()));
        // The last of the deepest.
        let last = snapshots.filter(whole).max_by(|a, b| a.response.depth_mm.total_cmp(&b.response.depth_mm));
        let first_touch = "cut open at y = 0, at first touch".to_owned();
        let faces = surface(mesh);
        let mut scenes = vec![Scene::cut(mesh, &faces, &mesh.nodes, side, 0.0, first_touch)];
        let mut deformed = None;
        if let Some(snapshot) = last {
            let moved: Vec<_> = mesh.nodes.iter().zip(&snapshot.displacement_mm).map(|(x, u)| x + u).collect();
            let (depth, slide) =
                (snapshot.response.depth_mm, snapshot.response.slide_x_mm.hypot(snapshot.response.slide_y_mm));
            let title = format!("the same at depth {} mm, after {} mm of slide", fixed(depth, 2), fixed(slide, 1));
            scenes.push(Scene::cut(mesh, &faces, &moved, side, depth, title));
            deformed = Some((depth, slide));
        }
        scenes.push(Scene::from_below(mesh, &faces));
        let shared = [Region::Skin, Region::Subcutaneous, Region::DistalBone, Region::ProximalBone, Region::Nail];
        let has = |region: &Region| mesh.elements().any(|(_, of)| of == *region);
        let named = mesh.regions().into_iter().map(|(region, _)| region);
        let soft = named.filter(|region| matches!(region, Region::Soft(_)));
        let regions = shared.into_iter().chain(soft).filter(has);
        let mut regions: Vec<_> =
            regions.map(|region| (colour(region), mesh.region_label(region).to_owned())).collect();
        regions.push((PAD, "pad: faces that may touch the plane".into()));
        regions.push((PLANE, "plane, grid of 5 mm".into()));
        Self { scenes, regions, deformed }
    }
}

impl Scene {
    fn cut(mesh: &Mesh, faces: &[Face], nodes: &[Point], view: View, plane_z: f64, title: String) -> Self {
        let mut behind = Vec::new();
        for (face, fill) in faces {
            let corners = clip(face, &mesh.nodes, nodes);
            behind.extend(lit(corners, *fill, nodes, face, view));
        }
        sort(&mut behind, view);
        let hexes = mesh.hexes.iter().map(|h| (section(&h.nodes, &HEX_EDGES, &mesh.nodes, nodes), h.region));
        let tets = mesh.tets.iter().map(|t| (section(&t.nodes, &TET_EDGES, &mesh.nodes, nodes), t.region));
        // A plane cuts the twelve parts of a 10-node tetrahedron as it cuts its corners' tetrahedron, but for its curves.
        let tets10 = mesh.tets10.iter().map(|t| (section(&t.nodes, &TET_EDGES, &mesh.nodes, nodes), t.region));
        let section = hexes
            .chain(tets)
            .chain(tets10)
            .filter(|(corners, _)| corners.len() > 2)
            .map(|(corners, region)| Polygon { corners, fill: colour(region) })
            .collect();
        let least = |f: fn(&Point) -> f64| nodes.iter().map(f).fold(f64::INFINITY, f64::min);
        let most = |f: fn(&Point) -> f64| nodes.iter().map(f).fold(f64::NEG_INFINITY, f64::max);
        let fives = |v: f64, up: bool| 5.0 * if up { (v / 5.0).ceil() } else { (v / 5.0).floor() };
        let bounds = [fives(least(|p| p.x), false), -5.0, fives(most(|p| p.x), true), fives(most(|p| p.y), true)];
        Self { view, behind, section, plane: Some((plane_z, bounds)), title }
    }

    fn from_below(mesh: &Mesh, faces: &[Face]) -> Self {
        let view = View::below();
        let mut behind = Vec::new();
        for (face, fill) in faces {
            let corners: Vec<_> = face.iter().map(|n| mesh.nodes[*n as usize]).collect();
            behind.extend(lit(corners, *fill, &mesh.nodes, face, view));
        }
        sort(&mut behind, view);
        let title = "seen from below, through the plane".to_owned();
        Self { view, behind, section: Vec::new(), plane: None, title }
    }

    fn corners(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let plane = self.plane.into_iter().flat_map(|(z, [x0, y0, x1, y1])| {
            [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| Point::new(x, y, z))
        });
        let solids = self.behind.iter().chain(&self.section).flat_map(|p| p.corners.iter().copied());
        solids.chain(plane).map(|p| self.view.flat(&p)).filter(|p| p.0.is_finite() && p.1.is_finite())
    }

    /// Least x, least y, width, height of the flat picture, mm.
    fn extent(&self) -> [f64; 4] {
        let start = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        let e = self.corners().fold(start, |e, (x, y)| [e[0].min(x), e[1].min(y), e[2].max(x), e[3].max(y)]);
        if e[0] < e[2] && e[1] < e[3] { [e[0], e[1], e[2] - e[0], e[3] - e[1]] } else { [0.0, 0.0, 1.0, 1.0] }
    }

    /// Draws the picture with its lower left corner at `origin`, `scale` px per mm.
    fn draw(&self, canvas: &mut Canvas, origin: (f64, f64), scale: f64) {
        let [x0, y0, ..] = self.extent();
        let at = |p: &Point| {
            let (x, y) = self.view.flat(p);
            (origin.0 + (x - x0) * scale, origin.1 - (y - y0) * scale)
        };
        if let Some((z, [x0, y0, x1, y1])) = self.plane {
            let grid = Line::solid(rgb(0xc3ccd6), 0.7);
            let corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| at(&Point::new(x, y, z)));
            canvas.area(&corners, PLANE);
            for i in 0..=((x1 - x0) / 5.0) as i32 {
                let x = x0 + 5.0 * f64::from(i);
                canvas.line(&[at(&Point::new(x, y0, z)), at(&Point::new(x, y1, z))], grid);
            }
            for i in 0..=((y1 - y0) / 5.0) as i32 {
                let y = y0 + 5.0 * f64::from(i);
                canvas.line(&[at(&Point::new(x0, y, z)), at(&Point::new(x1, y, z))], grid);
            }
            let (tail, head) = (at(&Point::new(x0 + 1.0, y0 + 1.5, z)), at(&Point::new(x0 + 7.0, y0 + 1.5, z)));
            let barbs = [Point::new(x0 + 6.0, y0 + 0.8, z), Point::new(x0 + 6.0, y0 + 2.2, z)].map(|p| at(&p));
            canvas.line(&[tail, head], Line::solid(INK, 1.3));
            canvas.line(&[barbs[0], head, barbs[1]], Line::solid(INK, 1.3));
            canvas.text("x", (head.0 + 6.0, head.1), Text { em: 11.5, ..Text::BODY });
        }
        for polygon in self.behind.iter().chain(&self.section) {
            let corners: Vec<_> = polygon.corners.iter().map(at).collect();
            canvas.face(&corners, polygon.fill, Line::solid(mix(polygon.fill, INK, 0.38), 0.45));
        }
    }
}

/// Nodes of an outer face and its colour.
type Face = (Vec<u32>, Colour);

/// The faces that belong to one element only, of hexes and of tets, in the colour of the pad or of their element.
fn surface(mesh: &Mesh) -> Vec<Face> {
    let triangles = mesh.pad_triangles.iter().map(|t| sorted(t));
    let pads: HashSet<_> = mesh.pad_faces.iter().map(|f| sorted(f)).chain(triangles).collect();
    let hexes = mesh.hexes.iter().flat_map(|h| HEX_FACES.map(|f| (f.map(|i| h.nodes[i]).to_vec(), h.region)));
    let tets = mesh.tets.iter().flat_map(|t| TET_FACES.map(|f| (f.map(|i| t.nodes[i]).to_vec(), t.region)));
    let linear = |f: [usize; 6]| FACE_TRIANGLES.map(|t| t.map(|i| f[i]));
    let tets10 = mesh
        .tets10
        .iter()
        .flat_map(|t| TET10_FACES.into_iter().flat_map(linear).map(|f| (f.map(|i| t.nodes[i]).to_vec(), t.region)));
    let outer = |faces: &mut dyn Iterator<Item = (Vec<u32>, Region)>| {
        let mut once: BTreeMap<Vec<u32>, Option<(Vec<u32>, Region)>> = BTreeMap::new();
        for (face, region) in faces {
            once.entry(sorted(&face)).and_modify(|e| *e = None).or_insert(Some((face, region)));
        }
        once.into_values().flatten().collect::<Vec<_>>()
    };
    let mut all = outer(&mut hexes.into_iter());
    all.extend(outer(&mut tets.into_iter()));
    all.extend(outer(&mut tets10.into_iter()));
    let paint = |(face, region): (Vec<u32>, Region)| {
        let fill = if pads.contains(&sorted(&face)) { PAD } else { colour(region) };
        (face, fill)
    };
    all.into_iter().map(paint).collect()
}

fn sorted(face: &[u32]) -> Vec<u32> {
    let mut key = face.to_vec();
    key.sort_unstable();
    key
}

/// The part of a face at y > 0 of the undeformed mesh, at the current positions.
fn clip(face: &[u32], reference: &[Point], current: &[Point]) -> Vec<Point> {
    let height = |n: u32| reference[n as usize].y - BESIDE;
    let mut kept = Vec::new();
    for (i, a) in face.iter().enumerate() {
        let b = face[(i + 1) % face.len()];
        let (ya, yb) = (height(*a), height(b));
        if ya >= 0.0 {
            kept.push(current[*a as usize]);
        }
        if (ya >= 0.0) != (yb >= 0.0) {
            kept.push(current[*a as usize].lerp(&current[b as usize], ya / (ya - yb)));
        }
    }
    kept
}

/// The polygon in which an element meets the cut, at the current positions.
fn section(nodes: &[u32], edges: &[[usize; 2]], reference: &[Point], current: &[Point]) -> Vec<Point> {
    let height = |n: u32| reference[n as usize].y - BESIDE;
    let meets = edges.iter().map(|[i, j]| (nodes[*i], nodes[*j])).filter_map(|(a, b)| {
        let (ya, yb) = (height(a), height(b));
        let s = ya / (ya - yb);
        let cut = |x: &[Point]| x[a as usize].lerp(&x[b as usize], s);
        ((ya >= 0.0) != (yb >= 0.0)).then(|| (cut(reference), cut(current)))
    });
    let mut corners: Vec<_> = meets.collect();
    let centre = corners.iter().map(|c| c.0).sum::<Point>() / corners.len().max(1) as f64;
    let angle = |p: &Point| (p.z - centre.z).atan2(p.x - centre.x);
    corners.sort_by(|a, b| angle(&a.0).total_cmp(&angle(&b.0)));
    corners.into_iter().map(|c| c.1).collect()
}

/// The polygon in the light of its face; None if the face is turned away.
fn lit(corners: Vec<Point>, fill: Colour, nodes: &[Point], face: &[u32], view: View) -> Option<Polygon> {
    let corner = |i: usize| nodes[face[i % face.len()] as usize];
    let normal = match face.len() {
        4 => (corner(2) - corner(0)).cross(&(corner(3) - corner(1))),
        _ => (corner(1) - corner(0)).cross(&(corner(2) - corner(0))),
    };
    let normal = normal.try_normalize(0.0)?;
    if corners.len() < 3 || normal.dot(&view.toward) <= 0.0 {
        return None;
    }
    let light = (view.toward + 0.5 * view.up - 0.35 * view.right).normalize();
    let bright = normal.dot(&light).max(0.0);
    let fill = mix(mix(fill, INK, 0.42), mix(fill, WHITE, 0.12), 0.15 + 0.85 * bright);
    Some(Polygon { corners, fill })
}

/// Painter's order: the farthest first.
fn sort(polygons: &mut [Polygon], view: View) {
    let near = |p: &Polygon| p.corners.iter().map(|c| c.dot(&view.toward)).sum::<f64>() / p.corners.len() as f64;
    polygons.sort_by(|a, b| near(a).total_cmp(&near(b)));
}

/// Width of a picture and its part of the figure, px; height of its title.
const CELL: f64 = 470.0;
const MARGIN: f64 = 14.0;
const TITLE: f64 = 34.0;
/// Height of a line of the legend, px.
const LINE: f64 = 22.0;

impl MeshView {
    /// The same with so many pictures in a row.
    pub fn in_columns(&self, columns: usize) -> InColumns<'_> {
        InColumns { view: self, columns }
    }
}

/// The pictures in rows, then the legend.
pub struct InColumns<'a> {
    view: &'a MeshView,
    columns: usize,
}

impl InColumns<'_> {
    /// Scale, px per mm, that all pictures share.
    fn scale(&self) -> f64 {
        let wide = self.view.scenes.iter().map(|s| s.extent()[2]).fold(0.0, f64::max);
        ((CELL - 2.0 * MARGIN) / wide).min(16.0)
    }

    /// Heights of the rows of pictures and legend, px.
    fn rows(&self) -> Vec<f64> {
        let scale = self.scale();
        let heights = self.view.scenes.iter().map(|s| s.extent()[3] * scale);
        let heights: Vec<f64> = heights.chain([LINE * (self.view.regions.len() + 1) as f64]).collect();
        heights.chunks(self.columns).map(|row| row.iter().copied().fold(0.0, f64::max) + TITLE + MARGIN).collect()
    }

    fn legend(&self, canvas: &mut Canvas, (left, top): (f64, f64)) {
        for (i, (fill, name)) in self.view.regions.iter().enumerate() {
            let y = top + LINE * i as f64;
            canvas.framed_rect(left, y - 7.0, 20.0, 14.0, *fill, Line::solid(GREY, 0.5));
            canvas.text(name, (left + 30.0, y), Text::BODY);
        }
        let y = top + LINE * self.view.regions.len() as f64 + 4.0;
        let bar = 5.0 * self.scale();
        canvas.line(&[(left, y - 4.0), (left, y), (left + bar, y), (left + bar, y - 4.0)], Line::solid(INK, 1.3));
        let text = "5 mm, all pictures; arrow: the plane's motion";
        canvas.text(text, (left + bar + 10.0, y - 2.0), Text::BODY);
    }
}

impl Figure for InColumns<'_> {
    fn size(&self) -> (u32, u32) {
        ((CELL * self.columns as f64) as u32, self.rows().iter().sum::<f64>().ceil() as u32)
    }

    fn draw(&self, canvas: &mut Canvas) {
        let rows = self.rows();
        let left = |cell: usize| MARGIN + CELL * (cell % self.columns) as f64;
        let top = |cell: usize| rows[..cell / self.columns].iter().sum::<f64>();
        for (i, scene) in self.view.scenes.iter().enumerate() {
            canvas.text(&scene.title, (left(i), top(i) + 16.0), Text { bold: true, em: 12.5, ..Text::BODY });
            scene.draw(canvas, (left(i), top(i) + rows[i / self.columns] - MARGIN), self.scale());
        }
        let last = self.view.scenes.len();
        self.legend(canvas, (left(last), top(last) + TITLE + 8.0));
    }
}
