//! Experiments with a slide: stick, area, strain.

use std::f64::consts::FRAC_PI_2;

use fingerpad_fe::load_path::{Drive, Path, Response};
use fingerpad_tests::problems::fingers::path;

use super::Finding;
use super::lab::{Failure, Lab, Line, chart, friction_n, line};

/// Longest slide of a run under constant force, mm: by then a contact of 2 N slips as a whole.
const SLIDE_MM: f64 = 8.0;

/// A press to a force, N, and a slide under it, mm.
fn slide(force_n: f64, angle: f64, length_mm: f64) -> Path {
    let drives = [Drive::Force, Drive::Displacement, Drive::Displacement];
    let [x, y] = [length_mm * angle.cos(), length_mm * angle.sin()];
    path(drives, &[[0.0; 3], [force_n, 0.0, 0.0], [force_n, x, y]])
}

/// Rows from the end of the press on.
fn sliding(responses: &[Response]) -> &[Response] {
    let from = responses.partition_point(|r| r.t_s < 1.0);
    &responses[from..]
}

/// Stick ratio over the tangential force.
pub fn stick(lab: &Lab) -> Result<Finding, Failure> {
    let (mut traces, mut off, mut slopes) = (Vec::new(), Vec::new(), Vec::new());
    for force_n in [0.5, 1.0, 2.0] {
        let run = lab.follow(&slide(force_n, 0.0, SLIDE_MM))?;
        let rows = sliding(&run.responses);
        let most = rows.iter().map(friction_n).fold(0.0, f64::max);
        let to_peak = rows.iter().position(|r| friction_n(r) > 0.999 * most).unwrap_or(rows.len() - 1);
        let points: Vec<[f64; 2]> = rows[..=to_peak].iter().map(|r| [friction_n(r) / most, r.stick_ratio]).collect();
        // By length along the load, so that close rows do not count more.
        let sum: f64 = points.windows(2).map(|p| (p[1][0] - p[0][0]) * (p[1][1] - 1.0 + p[1][0]).powi(2)).sum();
        off.push(sum.sqrt());
        slopes.push(1.0 / most);
        traces.push(line(format!("{force_n} N"), points));
    }
    traces.push(line("measured: straight", vec![[0.0, 1.0], [1.0, 0.0]]));
    let mindlin = (0..=50).map(|k| f64::from(k) / 50.0).map(|q| [q, (1.0 - q).powf(2.0 / 3.0)]).collect();
    traces.push(line("Mindlin 1949, Coulomb friction", mindlin));
    let rms = off.iter().copied().fold(0.0, f64::max);
    let lines = vec![
        Line::new("distance from the straight line at 0.5, 1, 2 N, largest (RMS)", 2, rms, [0.0, 0.10]),
        Line::new("slope at 2 N over that at 0.5 N", 2, slopes[2] / slopes[0], [0.0, 0.9]),
    ];
    Ok(Finding {
        title: "Stick ratio against tangential load",
        source: "André, Lévesque, Hayward, Lefèvre and Thonnard 2011, J. R. Soc. Interface 8:1574",
        published: "the ratio of the stuck area to the area falls linearly from 1 to 0 as the tangential force grows from 0 to its maximum; \
                    the slope of this line is inversely correlated to the normal force",
        lines,
        remark: String::new(),
        charts: vec![chart("Stick ratio", ["tangential force over its maximum", "stuck area over area"], traces)],
    })
}

/// Directions of the slides under which the area is followed, with their angles; the last one is fitted.
const DIRECTIONS: [(&str, f64); 3] = [("+x", 0.0), ("-x", 2.0 * FRAC_PI_2), ("+y (and -y, by symmetry)", FRAC_PI_2)];

/// Tangential force, N, and area over that of the press, along a slide; and the change of the area in the end.
fn area_along(lab: &Lab, force_n: f64, direction: usize) -> Result<(Vec<[f64; 2]>, Line), Failure> {
    let (name, angle) = DIRECTIONS[direction];
    let run = lab.follow(&slide(force_n, angle, SLIDE_MM))?;
    let rows = sliding(&run.responses);
    let first = rows[0].contact_area_mm2;
    let points: Vec<[f64; 2]> = rows.iter().map(|r| [friction_n(r), r.contact_area_mm2 / first]).collect();
    let last = points[points.len() - 1][1];
    let line = Line::new(format!("change of the area, {force_n} N, {name}, %"), 0, 100.0 * (last - 1.0), [-30.0, -1.0]);
    Ok((points, if direction == 2 { line.fitted() } else { line }))
}

/// Change of the area by slides across the finger.
pub fn across_lines(lab: &Lab) -> Result<Vec<Line>, Failure> {
    [1.0, 2.0].into_iter().map(|force_n| Ok(area_along(lab, force_n, 2)?.1)).collect()
}

/// Contact area under tangential force.
pub fn area(lab: &Lab) -> Result<Finding, Failure> {
    let (mut charts, mut lines) = (Vec::new(), Vec::new());
    for force_n in [1.0, 2.0] {
        let mut traces = Vec::new();
        for (direction, (name, _)) in DIRECTIONS.iter().enumerate() {
            let (points, change) = area_along(lab, force_n, direction)?;
            lines.push(change);
            traces.push(line(*name, points));
        }
        let title = format!("Contact area, {force_n} N");
        charts.push(chart(&title, ["tangential force (N)", "area over that of the press"], traces));
    }
    Ok(Finding {
        title: "Contact area under tangential force in four directions",
        source: "Delhaye, Lefèvre and Thonnard 2014, J. R. Soc. Interface 11:20140698",
        published: "the contact area falls while the tangential force grows (directions proximal, distal, radial, ulnar); shape and size \
                    of the deformation depend highly on the direction",
        lines,
        remark: "The band is a fall of 1 to 30 %, the largest that Sahli et al. 2018 report. Delhaye et al. attribute the fall to \
                 stiffening of the skin. A slide of 8 mm in +x moves the surface from the root of the finger to its tip."
            .into(),
        charts,
    })
}

/// Strain of the skin under tangential force at 5 N.
pub fn strain(lab: &Lab) -> Result<Finding, Failure> {
    const STEP_MM: f64 = 0.75;
    // The contact at 5 N slips as a whole later than lighter ones.
    const LONG_MM: f64 = 12.0;
    // A strain that has arrived.
    const SEEN: f64 = 0.02;
    let places: Vec<[f64; 2]> = (-12..=12).map(|k| [f64::from(k) * STEP_MM, 0.0]).collect();
    let (run, on_pad) = lab.observe(&slide(5.0, 0.0, LONG_MM), &places)?;
    let from = run.responses.partition_point(|r| r.t_s < 1.0);
    let (rows, readings) = (&run.responses[from..], &run.readings[from..]);
    let depth = |k: usize, row: usize| readings[row].probes[k].place_mm[2];
    // Touching skin lies in the plane, to a hundredth of a millimetre.
    let touches: Vec<usize> = (0..on_pad.len()).filter(|&k| (depth(k, 0) - rows[0].depth_mm).abs() < 0.02).collect();
    if touches.len() < 6 {
        return Err(format!("{} of {} points touch", touches.len(), on_pad.len()).into());
    }
    let place = |k: usize, row: usize| readings[row].probes[k].place_mm[0];
    // Stretch of the piece of skin between two neighbours, against the end of the press.
    let stretch = |pair: &[usize], row: usize| {
        // Skin that has left the surface is not visible through the glass.
        if pair.iter().any(|&k| (depth(k, row) - rows[row].depth_mm).abs() > 0.02) {
            return f64::NAN;
        }
        (place(pair[1], row) - place(pair[0], row)) / (place(pair[1], 0) - place(pair[0], 0)) - 1.0
    };
    let pieces: Vec<[usize; 2]> = touches.windows(2).map(|pair| [pair[0], pair[1]]).collect();
    let last = rows.len() - 1;
    let peak = pieces
        .iter()
        .flat_map(|pair| (0..=last).map(move |row| (pair, row)))
        .map(|(pair, row)| stretch(pair, row).abs())
        .fold(0.0, f64::max);
    // The slide at which the strain arrives at a piece, against its distance from the middle of the contact.
    let middle = 0.5 * (place(touches[0], 0) + place(touches[touches.len() - 1], 0));
    let arrival: Vec<[f64; 2]> = pieces
        .iter()
        .filter_map(|pair| {
            let row = (0..=last).find(|&row| stretch(pair, row).abs() >= SEEN)?;
            let at = 0.5 * (place(pair[0], 0) + place(pair[1], 0));
            Some([(at - middle).abs(), rows[row].slide_x_mm - rows[0].slide_x_mm])
        })
        .collect();
    let correlation = correlation(&arrival);
    let profile = |row: usize| {
        pieces.iter().map(|pair| [0.5 * (place(pair[0], 0) + place(pair[1], 0)) - middle, stretch(pair, row)]).collect()
    };
    let at_slide = |mm: f64| rows.partition_point(|r| r.slide_x_mm < mm).min(last);
    let profiles = [1.0, 2.0, 4.0, 8.0, LONG_MM].map(|mm| line(format!("slide {mm} mm"), profile(at_slide(mm))));
    let mut charts = vec![
        chart("Strain along the slide", ["place in the contact (mm)", "strain since the press"], profiles.into()),
        chart(
            "Arrival of the strain",
            ["distance from the middle of the contact (mm)", "slide (mm)"],
            vec![super::lab::dots("strain of 2 %", arrival.clone())],
        ),
    ];
    charts[0].least = [0.0; 2];
    Ok(Finding {
        title: "Strain of the skin under tangential force",
        source: "Delhaye, Barrea, Edin, Lefèvre and Thonnard 2016, J. R. Soc. Interface 13:20150874",
        published: "strain waves go from the rim to the middle of the contact; peak strains of 50 % with a normal force of 5 N",
        lines: vec![
            Line::new("largest strain at 5 N, %", 0, 100.0 * peak, [40.0, 60.0]),
            Line::new("correlation of arrival and distance from the middle", 2, correlation, [-1.0, -0.3]),
        ],
        remark: format!(
            "The strain is that of pieces of skin of {STEP_MM} mm on a line through the middle of the contact, along a slide in +x, \
             relative to the end of the press. It arrives where it reaches 2 %; a negative correlation means that the rim is first."
        ),
        charts,
    })
}

/// Coefficient of correlation of pairs.
fn correlation(points: &[[f64; 2]]) -> f64 {
    let count = points.len() as f64;
    let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / count);
    let product = |a: usize, b: usize| points.iter().map(|p| (p[a] - mean[a]) * (p[b] - mean[b])).sum::<f64>();
    product(0, 1) / (product(0, 0) * product(1, 1)).sqrt()
}
