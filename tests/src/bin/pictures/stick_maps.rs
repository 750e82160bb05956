//! Maps of stick and slip: the core of the contact that sticks shrinks while the plane slides, and while it turns under the finite
//! elements and under the pad.

use std::fmt::Write as _;
use std::ops::ControlFlow;

use fingerpad::Motion;
use fingerpad::pad::{PadState, PatchState, Plane};
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{Drive, Path, Snapshot, Turn, Turns, Waypoint, follow_path};
use fingerpad_fe::mesh::{Mesh, MeshPreset};
use fingerpad_reduce::pad::PadModel;
use fingerpad_tests::pads::PATCHES;
use nalgebra::Vector3;

use crate::Failure;

const DEPTH_MM: f64 = 1.0;
const SLIDES_MM: [f64; 6] = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0];
/// The last one turns back.
const SPINS_DEG: [f64; 6] = [0.0, 4.0, 8.0, 14.0, 24.0, 18.0];
/// The part of the plane that a map shows, mm: least and largest x, least and largest y.
const WINDOW_MM: [f64; 4] = [-6.5, 8.0, -6.0, 6.0];
const PX_PER_MM: f64 = 10.0;
const GAP_PX: f64 = 10.0;
const HEAD_PX: f64 = 42.0;
const STUCK: [f64; 3] = [11.0, 83.0, 148.0];
const SLIPPING: [f64; 3] = [242.0, 193.0, 78.0];
const UNTOUCHED: [f64; 3] = [243.0, 244.0, 246.0];

/// One face of the pad, viewed from the plane.
struct Face {
    corners_mm: Vec<[f64; 2]>,
    /// Share of the face that touches, and of that share which sticks.
    contact: f64,
    stick: f64,
}

struct Map {
    title: String,
    faces: Vec<Face>,
    stick_ratio: f64,
}

/// The default finger (shape E, default mesh, published friction), pressed to 1 mm and slid along +x.
pub fn slide() -> Result<String, Failure> {
    let config = Config::default();
    let (finger, _) = config.finger()?;
    let mut waypoints = vec![Waypoint { t_s: 0.0, normal: 0.0, x: 0.0, y: 0.0 }];
    for x in SLIDES_MM {
        waypoints.push(Waypoint { t_s: 0.5 + 0.5 * x, normal: DEPTH_MM, x, y: 0.0 });
    }
    let path = Path::new([Drive::Displacement; 3], waypoints);
    let rows: Vec<usize> = (1..=SLIDES_MM.len()).collect();
    let run = follow_path(&config.problem(&finger), &path, &rows, &mut |_| ControlFlow::Continue(()))?;
    let maps = run.snapshots.iter().zip(SLIDES_MM).map(|(s, x)| of_elements(format!("slide {x} mm"), s, &finger.mesh));
    Ok(picture(&[maps.collect()], "5 mm; the plane moves to the right"))
}

/// The finger of the pad's runs (medium mesh), pressed to 1 mm while the plane turns under it; below, the pad on the same path.
pub fn spin(model: &PadModel) -> Result<String, Failure> {
    let config = Config { mesh_preset: MeshPreset::Medium, ..Config::default() };
    let (finger, _) = config.finger()?;
    let spins: Vec<f64> = [0.0].into_iter().chain(SPINS_DEG).collect();
    let corner =
        |row: usize| Waypoint { t_s: 0.5 * row as f64, normal: if row == 0 { 0.0 } else { DEPTH_MM }, x: 0.0, y: 0.0 };
    let mut path = Path::new([Drive::Displacement; 3], (0..spins.len()).map(corner).collect());
    let turn = Turn { drive: Drive::Displacement, values: spins };
    path.turns = Turns { spin: Some(turn), ..Turns::default() };
    let rows: Vec<usize> = (1..=SPINS_DEG.len()).collect();
    let run = follow_path(&config.problem(&finger), &path, &rows, &mut |_| ControlFlow::Continue(()))?;
    let of_pad = pad_states(model)?;
    let columns = run.snapshots.iter().zip(SPINS_DEG).zip(&of_pad);
    let (above, below): (Vec<Map>, Vec<Map>) = columns
        .map(|((snapshot, spin), (patches, stick_ratio))| {
            let above = of_elements(format!("turn {spin}°"), snapshot, &finger.mesh);
            let faces = on_patches(snapshot, &finger.mesh, model, patches);
            (above, Map { title: "pad".to_owned(), faces, stick_ratio: *stick_ratio })
        })
        .unzip();
    Ok(picture(&[above, below], "5 mm; above the finite elements, below the pad; the plane turns, at last back"))
}

/// The patches and the stick ratio of a pad in each column.
fn pad_states(model: &PadModel) -> Result<Vec<([PatchState<f64>; PATCHES], f64)>, Failure> {
    let pad = model.pad();
    let pose = [pad.numbers.neutral_pitch_deg, 0.0];
    let mut state = PadState::<PATCHES, f64>::new(&pad)?;
    let mut step = |depth_mm: f64, spin_deg: f64| {
        let spin_increment_rad = spin_deg.to_radians();
        let motion = Motion { depth_mm, slide_increment_mm: [0.0; 2], spin_increment_rad, dt_s: 0.01 };
        let response = pad.step(&mut state, &Plane, motion, pose);
        (pad.patch_states(&state, &Plane), response.stick_ratio)
    };
    const STEPS: usize = 40;
    for k in 1..STEPS {
        step(DEPTH_MM * k as f64 / STEPS as f64, 0.0);
    }
    let mut at = 0.0;
    let columns = SPINS_DEG.map(|spin| {
        let by = (spin - at) / STEPS as f64;
        at = spin;
        for _ in 1..STEPS {
            step(DEPTH_MM, by);
        }
        step(DEPTH_MM, by)
    });
    Ok(columns.into())
}

fn of_elements(title: String, snapshot: &Snapshot, mesh: &Mesh) -> Map {
    let faces = mesh.pad_faces.iter().zip(&snapshot.faces).map(|(face, state)| Face {
        corners_mm: corners(face, snapshot, mesh),
        contact: state.contact_fraction,
        stick: state.stick_fraction,
    });
    Map { title, faces: faces.collect(), stick_ratio: snapshot.response.stick_ratio }
}

/// The same faces, each with the state of the patch nearest to it on the undeformed finger.
fn on_patches(snapshot: &Snapshot, mesh: &Mesh, model: &PadModel, states: &[PatchState<f64>]) -> Vec<Face> {
    let face = |face: &[u32; 4]| {
        let middle: Vector3<f64> = face.iter().map(|node| mesh.nodes[*node as usize]).sum::<Vector3<f64>>() / 4.0;
        let distance = |middle_mm: &[f64; 3]| (middle - Vector3::from(*middle_mm)).norm();
        let nearest = model
            .patches
            .iter()
            .zip(states)
            .min_by(|(a, _), (b, _)| distance(&a.middle_mm).total_cmp(&distance(&b.middle_mm)));
        let (contact, stick) = nearest.map_or((0.0, 0.0), |(patch, state)| {
            ((state.contact_area_mm2 / patch.area_mm2).min(1.0), state.stick_ratio)
        });
        Face { corners_mm: corners(face, snapshot, mesh), contact, stick }
    };
    mesh.pad_faces.iter().map(face).collect()
}

fn corners(face: &[u32; 4], snapshot: &Snapshot, mesh: &Mesh) -> Vec<[f64; 2]> {
    let place = |node: &u32| mesh.nodes[*node as usize] + snapshot.displacement_mm[*node as usize];
    face.iter().map(place).map(|p| [p.x, p.y]).collect()
}

/// Rows of maps side by side, with a legend, as SVG.
fn picture(rows: &[Vec<Map>], note: &str) -> String {
    let [left, right, low, high] = WINDOW_MM;
    let (width, height) = ((right - left) * PX_PER_MM, (high - low) * PX_PER_MM);
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let all = columns as f64 * (width + GAP_PX) + GAP_PX;
    let tall = rows.len() as f64 * (HEAD_PX + height) + 40.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {all} {tall}\" font-family=\"sans-serif\" \
         font-size=\"13\" fill=\"#1f2328\">\n<rect width=\"{all}\" height=\"{tall}\" fill=\"white\"/>\n"
    );
    for (r, row) in rows.iter().enumerate() {
        let top = r as f64 * (HEAD_PX + height);
        for (i, map) in row.iter().enumerate() {
            let x = GAP_PX + i as f64 * (width + GAP_PX);
            let middle = x + width / 2.0;
            let sticks = 100.0 * map.stick_ratio;
            let _ = writeln!(
                svg,
                "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\" font-weight=\"bold\">{}</text>\n\
                 <text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{sticks:.0} % sticks</text>",
                top + 16.0,
                map.title,
                top + 33.0
            );
            let y = top + HEAD_PX;
            let _ = writeln!(svg, "<svg x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\">");
            svg += &drawn(&map.faces);
            let frame = "fill=\"none\" stroke=\"#dde1e6\"";
            let _ = writeln!(svg, "<rect width=\"{width}\" height=\"{height}\" {frame}/>\n</svg>");
        }
    }
    let y = tall - 12.0;
    for (i, (name, colour)) in
        [("sticks", STUCK), ("slips", SLIPPING), ("no contact", UNTOUCHED)].into_iter().enumerate()
    {
        let x = GAP_PX + 90.0 * i as f64;
        let _ =
            writeln!(svg, "<rect x=\"{x}\" y=\"{}\" width=\"16\" height=\"12\" fill=\"{}\"/>", y - 11.0, hex(colour));
        let _ = writeln!(svg, "<text x=\"{}\" y=\"{y}\">{name}</text>", x + 22.0);
    }
    let scale = GAP_PX + 320.0;
    let end = scale + 5.0 * PX_PER_MM;
    let _ = writeln!(svg, "<path d=\"M{scale} {0}H{end}\" stroke=\"#1f2328\" stroke-width=\"2\"/>", y - 5.0);
    let _ = writeln!(svg, "<text x=\"{}\" y=\"{y}\">{note}</text>", end + 8.0);
    svg + "</svg>\n"
}

/// The faces, those that touch on top.
fn drawn(faces: &[Face]) -> String {
    let [left, right, low, high] = WINDOW_MM;
    let mut out = String::new();
    for (touching, stroke) in [(false, "stroke=\"#dde1e6\""), (true, "stroke-opacity=\"0.2\" stroke=\"white\"")] {
        let _ = writeln!(out, "<g stroke-width=\"0.4\" fill=\"{}\" {stroke}>", hex(UNTOUCHED));
        for face in faces.iter().filter(|face| (face.contact > 0.0) == touching) {
            if !face.corners_mm.iter().any(|[x, y]| left < *x && *x < right && low < *y && *y < high) {
                continue;
            }
            let point = |[x, y]: &[f64; 2]| format!("{:.1},{:.1}", (x - left) * PX_PER_MM, (high - y) * PX_PER_MM);
            let points: Vec<String> = face.corners_mm.iter().map(point).collect();
            // A face that touches in part is as pale as the part is small.
            let contact = mix(SLIPPING, STUCK, face.stick);
            let fill = match touching {
                true => format!(" fill=\"{}\"", hex(mix(UNTOUCHED, contact, face.contact))),
                false => String::new(),
            };
            let _ = writeln!(out, "<polygon points=\"{}\"{fill}/>", points.join(" "));
        }
        out += "</g>\n";
    }
    out
}

fn mix(from: [f64; 3], to: [f64; 3], share: f64) -> [f64; 3] {
    std::array::from_fn(|k| from[k] + share * (to[k] - from[k]))
}

fn hex(colour: [f64; 3]) -> String {
    let [r, g, b] = colour.map(|c| c.round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}
