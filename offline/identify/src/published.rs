//! Published findings that were not fitted, beside this model's.

use std::ops::ControlFlow;

use super::{
    FingerPoint, Hooks, IdentifyError, Table,
    outcome::{Curve, CurvePoint, Published},
    table::line,
};
use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::experiment::{Config, press_and_slide};
use fingerpad_fe::load_path::{Finger, LoadPathError};
use fingerpad_fe::mesh;

/// Published findings that were not fitted, beside this model's.
pub fn checks(
    config: &Config,
    finger: &FingerPoint,
    law: &RubberFriction,
    table: &Table,
    curve: &Curve,
    hooks: &Hooks,
) -> Result<Vec<Published>, IdentifyError> {
    let mut out = Vec::new();
    let (first, last) = (curve.points.first(), curve.points.last());
    if let (Some(first), Some(last)) = (first, last) {
        let range = format!("{:.2} to {:.2} N", first.normal_force_n, last.normal_force_n);
        let at = |n: f64, of: fn(&CurvePoint) -> f64| -> Option<f64> {
            let upper = curve.points.iter().position(|p| p.normal_force_n >= n).filter(|&i| i > 0)?;
            let (a, b) = (&curve.points[upper - 1], &curve.points[upper]);
            let share = (n / a.normal_force_n).ln() / (b.normal_force_n / a.normal_force_n).ln();
            Some((of(a).ln() + share * (of(b) / of(a)).ln()).exp())
        };
        let top = last.normal_force_n;
        if top > 1.2 {
            // Their ratio over a decade, converted to the range here as a power.
            let exponent = 0.60f64.ln() / 0.1f64.ln();
            if let Some(one) = at(1.0, |p| p.contact_area_mm2) {
                out.push(Published {
                    finding: format!("contact area at 1 N over that at {top:.2} N"),
                    source: "Serina et al. 1998: A(1 N)/A(10 N) = 0.60, as a power brought to our range".into(),
                    published: (1.0 / top).powf(exponent),
                    ours: one / last.contact_area_mm2,
                    conditions: format!("steady slide, finite elements reach {top:.2} N"),
                });
            }
            if let Some(one) = at(1.0, |p| p.friction_coefficient) {
                out.push(Published {
                    finding: format!("fall of the friction coefficient from 1 to {top:.2} N, %"),
                    source: "Seo et al. 2009: -46 % from 1 to 20 N, as a power brought to our range".into(),
                    published: 100.0 * (top.powf(0.54f64.ln() / 20f64.ln()) - 1.0),
                    ours: 100.0 * (last.friction_coefficient / one - 1.0),
                    conditions: format!("steady slide, finite elements reach {top:.2} N"),
                });
            }
        }
        let logs: Vec<[f64; 2]> = curve
            .points
            .iter()
            .map(|p| [p.normal_force_n.ln(), (p.friction_coefficient * p.normal_force_n).ln()])
            .collect();
        let within: Vec<[f64; 2]> = {
            let forces = || table.points.iter().map(|p| p.normal_force_n);
            let (low, high) = (forces().fold(f64::INFINITY, f64::min), forces().fold(0.0, f64::max));
            logs.iter().copied().filter(|l| l[0].exp() > 0.7 * low && l[0].exp() < 1.4 * high).collect()
        };
        let measured: Vec<[f64; 2]> =
            table.points.iter().map(|p| [p.normal_force_n.ln(), p.friction_n().ln()]).collect();
        for (logs, where_) in [(&within, "over the loads of the table".to_owned()), (&logs, format!("over {range}"))] {
            if let (Some((ours, _)), Some((table, _))) = (line(logs), line(&measured)) {
                out.push(Published {
                    finding: "power n of friction over normal force, F ~ N^n".into(),
                    source: "the table itself (Yoshida et al. 2011 state 2/3 for theirs)".into(),
                    published: table,
                    ours,
                    conditions: format!("steady slide, {where_}"),
                });
            }
        }
    }
    if let Some(check) = stick_line(config, finger, law, table, hooks)? {
        out.extend(check);
    }
    Ok(out)
}

/// Stick ratio over tangential load during one press and slide: distance from the observed straight line.
fn stick_line(
    config: &Config,
    finger: &FingerPoint,
    law: &RubberFriction,
    table: &Table,
    hooks: &Hooks,
) -> Result<Option<Vec<Published>>, IdentifyError> {
    let mut config = config.clone();
    config.friction = *law;
    finger.apply(&mut config);
    let fingertip = {
        let made = mesh::fingertip(&finger.shape, &config.mesh_preset.divisions())?;
        Finger::new(made, &config.tissue)?
    };
    let depth_mm = table.depths_mm[table.depths_mm.len() / 2] + finger.depth_offset_mm;
    (hooks.report_progress)("stick ratio over load", &format!("slide at depth {depth_mm:.3} mm"));
    let result = press_and_slide(&config, &fingertip, depth_mm, None, None, &mut |_| {
        if (hooks.go_on)() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    let trajectory = match result {
        Ok(trajectory) => trajectory,
        Err(LoadPathError::Interrupted { .. }) => return Err(IdentifyError::Interrupted),
        Err(_) => return Ok(None),
    };
    let slide: Vec<_> = trajectory.responses.iter().filter(|r| r.slide_x_mm > 0.0).collect();
    let limit = slide.iter().map(|r| r.friction_x_n / r.normal_force_n).fold(0.0, f64::max);
    // The line runs from 1 without load to 0 at the limit.
    let points: Vec<[f64; 2]> = slide
        .iter()
        .map(|r| [r.friction_x_n / r.normal_force_n / limit, r.stick_ratio])
        .take_while(|p| p[1] > 0.0)
        .filter(|p| p[0] > 0.05)
        .collect();
    if points.len() < 4 {
        return Ok(None);
    }
    let worst = points.iter().map(|p| (p[1] - (1.0 - p[0])).abs()).fold(0.0, f64::max);
    let source = "André, Lévesque, Hayward, Lefèvre & Thonnard 2011: the ratio falls in a straight line with load";
    let conditions = format!("press and slide at depth {depth_mm:.2} mm, load over its largest");
    let half = at_half(&points);
    Ok(Some(vec![
        Published {
            finding: "largest distance of the stick ratio from the straight line 1 - F/F_limit".into(),
            source: source.into(),
            published: 0.0,
            ours: worst,
            conditions: conditions.clone(),
        },
        Published {
            finding: "stick ratio at half of the largest load".into(),
            source: source.into(),
            published: 0.5,
            ours: half,
            conditions,
        },
    ]))
}

fn at_half(points: &[[f64; 2]]) -> f64 {
    let Some(i) = points.iter().position(|p| p[0] >= 0.5).filter(|&i| i > 0) else { return f64::NAN };
    let ([x0, y0], [x1, y1]) = (points[i - 1], points[i]);
    y0 + (y1 - y0) * (0.5 - x0) / (x1 - x0)
}
