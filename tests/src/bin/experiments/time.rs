//! Experiments with time: speed of a press, relaxation and hysteresis in shear, a tap.

use fingerpad::Relaxation;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{Drive, Path, Response, Waypoint};

use super::Finding;
use super::lab::{Failure, Lab, Line, chart, line};

/// Depth of the presses, mm, and the slide of the shear, mm.
const DEPTH_MM: f64 = 1.5;
const SLIDE_MM: f64 = 1.0;
/// Factor on the friction of skin that is glued.
const GLUED: f64 = 15.0;

/// A path through corners of time, s, depth and slide, mm.
fn timed(corners: &[[f64; 3]]) -> Path {
    let corner = |&[t_s, normal, x]: &[f64; 3]| Waypoint { t_s, normal, x, y: 0.0 };
    Path::new([Drive::Displacement; 3], corners.iter().map(corner).collect())
}

/// Work of `force` along `place`, split into what goes in and what comes back, mJ.
fn work_mj(rows: &[Response], force: fn(&Response) -> f64, place: fn(&Response) -> f64) -> [f64; 2] {
    let parts = rows.windows(2).map(|pair| {
        let [a, b] = [&pair[0], &pair[1]];
        0.5 * (force(a) + force(b)) * (place(b) - place(a))
    });
    parts.fold([0.0; 2], |[to, back], work| [to + work.max(0.0), back - work.min(0.0)])
}

/// Share that does not come back, percent.
fn lost(rows: &[Response], force: fn(&Response) -> f64, place: fn(&Response) -> f64) -> f64 {
    let [to, back] = work_mj(rows, force, place);
    100.0 * (1.0 - back / to)
}

fn friction(r: &Response) -> f64 {
    r.friction_x_n
}

fn slide(r: &Response) -> f64 {
    r.slide_x_mm
}

/// The time after which 99 % of the fall of friction has happened, s.
fn duration_s(rows: &[Response]) -> f64 {
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    let left = |r: &Response| (friction(r) - friction(last)) / (friction(first) - friction(last));
    let after = rows.partition_point(|r| left(r) > 0.01).clamp(1, rows.len() - 1);
    let [a, b] = [&rows[after - 1], &rows[after]];
    let share = (left(a) - 0.01) / (left(a) - left(b));
    a.t_s + share * (b.t_s - a.t_s) - first.t_s
}

/// Four facts about tissue that relaxes.
pub fn time(lab: &Lab) -> Result<Finding, Failure> {
    let relaxing = lab.with(|config: &mut Config| config.tissue.relaxation = Relaxation::HUMAN_ASSUMED);
    let glued = relaxing.with(|config: &mut Config| config.friction.lambda *= GLUED);
    let start = [0.0; 3];
    let press = |mm_per_s: f64| relaxing.follow(&timed(&[start, [DEPTH_MM / mm_per_s, DEPTH_MM, 0.0]]));
    let (fast, slow) = (press(1000.0)?.responses, press(1.0)?.responses);
    let last = |rows: &[Response]| rows[rows.len() - 1].normal_force_n;
    // The tissue of the press relaxes before the shear.
    let [pressed, sheared] = [20.0, 20.1];
    let to = [start, [1.0, DEPTH_MM, 0.0], [pressed, DEPTH_MM, 0.0]];
    let held =
        glued.follow(&timed(&[&to[..], &[[sheared, DEPTH_MM, SLIDE_MM], [60.0, DEPTH_MM, SLIDE_MM]]].concat()))?;
    let hold = &held.responses[held.responses.partition_point(|r| r.t_s < sheared)..];
    let cycle = |half_s: f64| -> Result<Vec<Response>, Failure> {
        let back = [[pressed + half_s, DEPTH_MM, SLIDE_MM], [pressed + 2.0 * half_s, DEPTH_MM, 0.0]];
        let run = glued.follow(&timed(&[&to[..], &back].concat()))?.responses;
        Ok(run[run.partition_point(|r| r.t_s < pressed)..].to_vec())
    };
    let sheared = cycle(1.0)?;
    let tap = relaxing.follow(&timed(&[start, [5e-3, DEPTH_MM, 0.0], [10e-3, 0.0, 0.0]]))?.responses;
    let normal: fn(&Response) -> f64 = |r| r.normal_force_n;
    let depth: fn(&Response) -> f64 = |r| r.depth_mm;
    let lines = vec![
        Line::new("force at 1.5 mm, 1 m/s over 1 mm/s", 2, last(&fast) / last(&slow), [2.0, 2.75]),
        Line::new("duration of the relaxation of shear (99 %), s", 1, duration_s(hold), [8.0, 15.0]),
        Line::new(
            "hysteresis of glued skin in shear, 1 s to and 1 s back, %",
            0,
            lost(&sheared, friction, slide),
            [70.0, 90.0],
        ),
        Line::new("energy lost in a tap of 10 ms, %", 0, lost(&tap, normal, depth), [76.0, 86.0]),
    ];
    let points = |rows: &[Response], y: fn(&Response) -> f64, x: fn(&Response) -> f64| {
        rows.iter().map(|r| [x(r), y(r)]).collect::<Vec<_>>()
    };
    Ok(Finding {
        title: "Speed, relaxation, hysteresis and a tap",
        source: "Abstracts only: Spartacus et al. 2021 (palm, force at high over low rate); Pataky et al. 2005 (shear); Wang and Hayward \
                 2007 (shear of glued skin); Jindrich et al. 2003 (taps of a finger)",
        published: "the palm's force is 2 to 2.75 times as large at a high rate; relaxation of shear lasts 11.8 s and looks like a \
                    logarithm; the hysteresis of skin in shear is 80 %; a tap loses 81 % of its energy",
        lines,
        remark: "The tissue has the branches `human-assumed`: the times are those of Pawluk and Howe (1999), **the shares 1, 0.6, 0.6 are \
                 assumed**. Speeds, depths and slides are our choice, because the abstracts state none. The bands around 11.8 s, 80 % and 81 % are ours."
            .into(),
        charts: vec![
            chart(
                "Press",
                ["depth (mm)", "normal force (N)"],
                vec![
                    line("1 m/s", points(&fast, normal, depth)),
                    line("1 mm/s", points(&slow, normal, depth)),
                    line("tap of 10 ms", points(&tap, normal, depth)),
                ],
            ),
            chart(
                "Shear of glued skin",
                ["slide (mm)", "tangential force (N)"],
                vec![line("1 s to and 1 s back", points(&sheared, friction, slide))],
            ),
            chart(
                "Shear, held",
                ["time (s)", "tangential force (N)"],
                vec![line("after a slide of 1 mm in 0.1 s", hold.iter().map(|r| [r.t_s - hold[0].t_s, friction(r)]).collect())],
            ),
        ],
    })
}
