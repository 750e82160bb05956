//! Draws README's picture: the core of the contact that sticks shrinks while the plane slides.
//!
//! `cargo run --release -p fingerpad-fe --example stick_core -- docs/pictures/stick-core.svg`
//!
//! The default finger (shape E, default mesh, published friction) is pressed to 1 mm and slid along +x; each map shows
//! the faces of the pad on the plane, coloured by the part of their contact area that sticks.

use std::fmt::Write as _;
use std::ops::ControlFlow;

use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{Drive, Path, Snapshot, Waypoint, follow_path};
use fingerpad_fe::mesh::Mesh;
use nalgebra::Vector3;

const DEPTH_MM: f64 = 1.0;
const SLIDES_MM: [f64; 6] = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0];
/// The part of the plane that a map shows, mm: least and largest x, least and largest y.
const WINDOW_MM: [f64; 4] = [-6.5, 8.0, -6.0, 6.0];
const PX_PER_MM: f64 = 10.0;
const GAP_PX: f64 = 10.0;
const HEAD_PX: f64 = 42.0;
const STUCK: [f64; 3] = [11.0, 83.0, 148.0];
const SLIPPING: [f64; 3] = [242.0, 193.0, 78.0];
const UNTOUCHED: [f64; 3] = [243.0, 244.0, 246.0];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = std::env::args().nth(1).ok_or("usage: stick_core FILE.svg")?;
    let config = Config::default();
    let (finger, _) = config.finger()?;
    let mut waypoints = vec![Waypoint { t_s: 0.0, normal: 0.0, x: 0.0, y: 0.0 }];
    for x in SLIDES_MM {
        waypoints.push(Waypoint { t_s: 0.5 + 0.5 * x, normal: DEPTH_MM, x, y: 0.0 });
    }
    let path = Path::new([Drive::Displacement; 3], waypoints);
    let pressed_and_slid: Vec<usize> = (1..=SLIDES_MM.len()).collect();
    let run = follow_path(&config.problem(&finger), &path, &pressed_and_slid, &mut |_| ControlFlow::Continue(()))?;
    std::fs::write(&file, picture(&run.snapshots, &finger.mesh))?;
    for Snapshot { response: r, .. } in &run.snapshots {
        println!(
            "slide {:.1} mm: stick ratio {:.2}, F/N {:.2}",
            r.slide_x_mm,
            r.stick_ratio,
            r.friction_x_n / r.normal_force_n
        );
    }
    Ok(())
}

/// The maps side by side, with a legend, as SVG.
fn picture(snapshots: &[Snapshot], mesh: &Mesh) -> String {
    let [left, right, low, high] = WINDOW_MM;
    let (width, height) = ((right - left) * PX_PER_MM, (high - low) * PX_PER_MM);
    let all = snapshots.len() as f64 * (width + GAP_PX) + GAP_PX;
    let tall = HEAD_PX + height + 40.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {all} {tall}\" font-family=\"sans-serif\" \
         font-size=\"13\" fill=\"#1f2328\">\n<rect width=\"{all}\" height=\"{tall}\" fill=\"white\"/>\n"
    );
    for (i, snapshot) in snapshots.iter().enumerate() {
        let x = GAP_PX + i as f64 * (width + GAP_PX);
        let r = &snapshot.response;
        let middle = x + width / 2.0;
        let sticks = 100.0 * r.stick_ratio;
        let _ = writeln!(
            svg,
            "<text x=\"{middle}\" y=\"16\" text-anchor=\"middle\" font-weight=\"bold\">slide {} mm</text>\n\
             <text x=\"{middle}\" y=\"33\" text-anchor=\"middle\">{sticks:.0} % sticks</text>",
            r.slide_x_mm
        );
        let _ = writeln!(svg, "<svg x=\"{x}\" y=\"{HEAD_PX}\" width=\"{width}\" height=\"{height}\">");
        svg += &map(snapshot, mesh);
        let _ = writeln!(svg, "<rect width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"#dde1e6\"/>\n</svg>");
    }
    let y = HEAD_PX + height + 28.0;
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
    let _ = writeln!(svg, "<text x=\"{}\" y=\"{y}\">5 mm; the plane moves to the right</text>", end + 8.0);
    svg + "</svg>\n"
}

/// The faces of the pad as the plane sees them, those that touch on top.
fn map(snapshot: &Snapshot, mesh: &Mesh) -> String {
    let [left, right, low, high] = WINDOW_MM;
    let mut out = String::new();
    for (touching, stroke) in [(false, "stroke=\"#dde1e6\""), (true, "stroke-opacity=\"0.2\" stroke=\"white\"")] {
        let _ = writeln!(out, "<g stroke-width=\"0.4\" fill=\"{}\" {stroke}>", hex(UNTOUCHED));
        for (face, state) in mesh.pad_faces.iter().zip(&snapshot.faces) {
            let corners = face.map(|node| mesh.nodes[node as usize] + snapshot.displacement_mm[node as usize]);
            let seen = corners.iter().any(|p| left < p.x && p.x < right && low < p.y && p.y < high);
            if (state.contact_fraction > 0.0) != touching || !seen {
                continue;
            }
            let point = |p: Vector3<f64>| format!("{:.1},{:.1}", (p.x - left) * PX_PER_MM, (high - p.y) * PX_PER_MM);
            let points = corners.map(point).join(" ");
            // A face that touches in part is as pale as the part is small.
            let contact = mix(SLIPPING, STUCK, state.stick_fraction);
            let fill = match touching {
                true => format!(" fill=\"{}\"", hex(mix(UNTOUCHED, contact, state.contact_fraction))),
                false => String::new(),
            };
            let _ = writeln!(out, "<polygon points=\"{points}\"{fill}/>");
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
