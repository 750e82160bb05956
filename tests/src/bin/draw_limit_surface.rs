//! Draws the limit surface of the default finger: friction and moment in full slip, by the finite elements, by the shipped
//! reduced model, and an ellipsoid.
//!
//! `cargo run --release -p fingerpad-tests --bin draw_limit_surface -- docs/pictures/limit-surface.svg [coarse]`

use std::fmt::Write as _;

use fingerpad::{ModelFile, Motion, SpinState};
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_tests::{
    Failure,
    cases::limit_surface::{ARM_MM, limit_points},
};
use nalgebra::Vector3;

const DEPTH_MM: f64 = 1.0;
/// Directions of the finite elements' slides and of the reduced model's over half a circle.
const SLIDES: usize = 12;
const CURVE: usize = 90;
/// Travel of the reduced model to full slip, mm, and its steps.
const TRAVEL_MM: f64 = 8.0;
const STEPS: usize = 400;
const PANEL_PX: [f64; 2] = [380.0, 330.0];
const FE: &str = "#0b5394";
const REDUCED: &str = "#c0392b";
const ELLIPSE: &str = "#8a8f98";

/// One plane through the surface: two components of the load, those of the motion.
struct Cut {
    title: &'static str,
    labels: [&'static str; 2],
    components: [usize; 2],
}

const CUTS: [Cut; 2] = [
    Cut { title: "slide along x with spin", labels: ["friction along x, N", "moment, N mm"], components: [0, 2] },
    Cut { title: "slide without spin", labels: ["friction along x, N", "friction along y, N"], components: [0, 1] },
];

fn main() -> Result<(), Failure> {
    println!("motion | load | a tenth earlier | over the pressure | over the press | reduced model | N, stick ratio");
    let file = std::env::args().nth(1).ok_or("usage: draw_limit_surface FILE.svg")?;
    let mesh = match std::env::args().nth(2).as_deref() {
        Some("coarse") => MeshPreset::Coarse,
        _ => MeshPreset::Medium,
    };
    let model = ModelFile::new(&std::fs::read("data/models/fingertip.fpm")?).map_err(|e| e.to_string())?;
    let mut svg = String::new();
    let [width, height] = PANEL_PX;
    let (all, tall) = (2.0 * width + 30.0, height + 76.0);
    write!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {all} {tall}\" font-family=\"sans-serif\" font-size=\"13\" \
         fill=\"#1f2328\">\n<rect width=\"{all}\" height=\"{tall}\" fill=\"white\"/>\n"
    )?;
    for (k, cut) in CUTS.iter().enumerate() {
        let motion = |share: f64| {
            let (sin, cos) = (std::f64::consts::PI * share).sin_cos();
            let mut motion = Vector3::zeros();
            (motion[cut.components[0]], motion[cut.components[1]]) = (cos, sin);
            motion
        };
        let motions: Vec<_> = (0..=SLIDES).map(|i| motion(i as f64 / SLIDES as f64)).collect();
        let found = limit_points(mesh, &[DEPTH_MM], &motions)?;
        let seen = |load: &Vector3<f64>| cut.components.map(|c| load[c]);
        let points: Vec<[f64; 2]> = found.iter().map(|p| seen(&p.load)).collect();
        let curve: Vec<[f64; 2]> =
            (0..=CURVE).map(|i| seen(&reduced(&model, &motion(i as f64 / CURVE as f64)))).collect();
        for point in &found {
            let row =
                [point.load, point.earlier, point.over_pressure, point.over_press, reduced(&model, &point.direction)];
            let numbers = row.map(|load| format!("{:.4} {:.4} {:.4}", load.x, load.y, load.z)).join(" | ");
            println!(
                "{:.3?} | {numbers} | {:.4} N, {:.4}",
                point.direction.as_slice(),
                point.normal_force_n,
                point.stick_ratio
            );
        }
        panel(&mut svg, cut, 10.0 + k as f64 * (width + 10.0), &points, &curve)?;
    }
    let y = tall - 12.0;
    for (x, colour, text) in [
        (20.0, FE, "finite elements"),
        (170.0, REDUCED, "reduced model"),
        (310.0, ELLIPSE, "ellipse through the finite elements' largest"),
    ] {
        writeln!(
            svg,
            "<rect x=\"{x}\" y=\"{}\" width=\"14\" height=\"4\" fill=\"{colour}\"/><text x=\"{}\" y=\"{y}\">{text}</text>",
            y - 6.0,
            x + 20.0
        )?;
    }
    std::fs::write(file, svg + "</svg>\n")?;
    Ok(())
}

/// The reduced model's load in full slip along a motion (N, N, N mm).
fn reduced(model: &ModelFile, motion: &Vector3<f64>) -> Vector3<f64> {
    let file = model.file();
    let mut state = SpinState::default();
    let step = motion * (TRAVEL_MM / STEPS as f64);
    let mut moved = Motion { depth_mm: DEPTH_MM as f32, dt_s: 0.01, ..Motion::default() };
    file.model.step(&mut state, moved);
    moved.slide_increment_mm = [step.x as f32, step.y as f32];
    moved.spin_increment_rad = (step.z / ARM_MM) as f32;
    let mut end = fingerpad::Response::default();
    for _ in 0..STEPS {
        end = file.model.step(&mut state, moved);
    }
    Vector3::new(end.friction_n[0].into(), end.friction_n[1].into(), end.spin_moment_n_mm.into())
}

/// A panel at `left`, px: axes through zero, ellipse, curve and points.
fn panel(svg: &mut String, cut: &Cut, left: f64, points: &[[f64; 2]], curve: &[[f64; 2]]) -> std::fmt::Result {
    let [width, height] = PANEL_PX;
    let all = || points.iter().chain(curve);
    let largest = |k: usize| all().map(|p| p[k].abs()).fold(0.0, f64::max) * 1.12;
    let (sx, sy) = (0.5 * (width - 40.0) / largest(0), (height - 60.0) / largest(1));
    let (x0, y0) = (left + 0.5 * width, 30.0 + height - 40.0);
    let at = |[x, y]: [f64; 2]| [x0 + sx * x, y0 - sy * y];
    let line = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        points.map(|p| at(p).map(|v| format!("{v:.1}")).join(",")).collect::<Vec<_>>().join(" ")
    };
    writeln!(svg, "<text x=\"{}\" y=\"20\" font-weight=\"bold\">{}</text>", left + 10.0, cut.title)?;
    writeln!(
        svg,
        "<path d=\"M{} {y0}H{}M{x0} {y0}V34\" stroke=\"#d0d4da\" fill=\"none\"/>",
        left + 10.0,
        left + width - 10.0
    )?;
    for k in 0..2 {
        let step = tick(largest(k));
        for i in if k == 0 { -8..=8 } else { 1..=8 } {
            let value = f64::from(i) * step;
            if i == 0 || value.abs() > largest(k) {
                continue;
            }
            let ([x, y], anchor) = if k == 0 { (at([value, 0.0]), "middle") } else { (at([0.0, value]), "end") };
            let (x, y) = if k == 0 { (x, y + 16.0) } else { (x - 5.0, y + 4.0) };
            writeln!(
                svg,
                "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"11\" text-anchor=\"{anchor}\">{value:.3}</text>"
            )?;
        }
    }
    writeln!(
        svg,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"end\" font-size=\"11\">{}</text>",
        left + width - 8.0,
        y0 + 32.0,
        cut.labels[0]
    )?;
    writeln!(svg, "<text x=\"{}\" y=\"40\" font-size=\"11\">{}</text>", x0 + 6.0, cut.labels[1])?;
    let ends = [0, points.len() - 1].map(|i| points[i][0].abs());
    let top = points.iter().map(|p| p[1]).fold(0.0, f64::max);
    let mut ellipse = (0..=60).map(|i| {
        let (sin, cos) = (std::f64::consts::PI * f64::from(i) / 60.0).sin_cos();
        [cos * if cos > 0.0 { ends[0] } else { ends[1] }, sin * top]
    });
    writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{ELLIPSE}\" stroke-width=\"1.5\" stroke-dasharray=\"5 4\"/>",
        line(&mut ellipse)
    )?;
    writeln!(
        svg,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{REDUCED}\" stroke-width=\"2\"/>",
        line(&mut curve.iter().copied())
    )?;
    for [x, y] in points.iter().copied().map(at) {
        writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{FE}\"/>")?;
    }
    Ok(())
}

/// A round step with three to six of it in `range`.
fn tick(range: f64) -> f64 {
    let power = 10f64.powf((range / 3.0).log10().floor());
    [5.0, 2.0, 1.0].map(|f| f * power).into_iter().find(|step| range / step >= 3.0).unwrap_or(power)
}
