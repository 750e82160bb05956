//! Captions: the finding of each figure, with the figure's own numbers.

use super::mesh_view::MeshView;
use super::numbers::{DepthNumbers, Numbers, Range, Secant, fixed, signed};

fn percent_range(r: Range) -> String {
    if signed(r.min, 1) == signed(r.max, 1) {
        format!("{} %", signed(r.min, 1))
    } else {
        format!("{} to {} %", signed(r.min, 1), signed(r.max, 1))
    }
}

fn list(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} and {last}", most.join(", ")),
    }
}

fn mm(v: f64) -> String {
    format!("{} mm", fixed(v, 2))
}

/// The first sentences of the page: errors of the model against Table 1.
pub fn verdict(numbers: &Numbers) -> String {
    let d = &numbers.difference_percent;
    let named = [
        ("friction coefficient", d.friction_coefficient),
        ("normal force", d.normal_force),
        ("contact area", d.contact_area),
    ];
    let parts: Vec<_> = named.iter().filter_map(|(n, r)| r.map(|r| format!("{n} {}", percent_range(r)))).collect();
    let compared = numbers.depths.iter().filter(|d| d.friction_coefficient.difference_percent.is_some()).count();
    let mut text = if parts.is_empty() {
        "There is nothing to compare with Table 1 in this run.".to_owned()
    } else {
        let depths = numbers.depths.len();
        format!("Against Table 1, {compared} of {depths} depths compared, the model is off by: {}.", parts.join("; "))
    };
    let failed = numbers.checks.iter().filter(|c| !c.passed).count();
    text += &match (numbers.checks.len(), failed) {
        (0, _) => String::new(),
        (n, 0) => format!(" All {n} numerical checks of this run passed."),
        (n, failed) => format!(" {failed} of {n} numerical checks of this run failed."),
    };
    text + &slip_warning(numbers)
}

fn slip_warning(numbers: &Numbers) -> String {
    let short = |d: &&DepthNumbers| d.full_slip_travel_mm.is_none();
    let short: Vec<_> = numbers.depths.iter().filter(short).map(|d| mm(d.depth_mm)).collect();
    if short.is_empty() {
        return String::new();
    }
    format!(" Full slip was not reached at {}: the friction there is not kinetic.", list(&short))
}

/// Friction coefficient against normal force.
pub fn figure2(numbers: &Numbers) -> String {
    let mut text =
        "The measured friction coefficient falls with normal force, roughly as one over its cube root. A grey tie joins what \
         was measured and what this model gives at the same depth: the shorter the better; its sideways part is the error of \
         the normal force."
            .to_owned();
    let pair = |d: &DepthNumbers| {
        let c = d.friction_coefficient;
        c.measured
            .zip(c.model)
            .map(|(e, m)| format!("{} against {} measured at {}", fixed(m, 2), fixed(e, 2), mm(d.depth_mm)))
    };
    let pairs: Vec<_> = numbers.depths.iter().filter_map(pair).collect();
    if !pairs.is_empty() {
        text += &format!(" This model gives {}.", list(&pairs));
    }
    let estimates = numbers.depths.iter().filter_map(|d| d.frictionless_difference_percent);
    if let Some(range) = super::numbers::range(estimates) {
        let range = percent_range(range);
        text += &format!(
            " Triangles: the friction law integrated over the pressure of the frictionless press; the full computation \
             differs from that by {range}."
        );
    }
    text + &slip_warning(numbers)
}

/// Normal force and contact area against depth.
pub fn normal_area(numbers: &Numbers) -> String {
    let d = &numbers.difference_percent;
    let range = |r: Option<Range>| r.map_or_else(|| "not compared".to_owned(), percent_range);
    let mut text = format!(
        "Normal force and contact area at the measured depths (difference of the force {}, of the area {}).",
        range(d.normal_force),
        range(d.contact_area)
    );
    let slopes = |of: fn(&Secant) -> Option<f64>| {
        let slopes: Vec<_> = numbers.force_secants.iter().filter_map(of).map(|s| fixed(s, 2)).collect();
        (!slopes.is_empty()).then(|| list(&slopes))
    };
    if let Some(measured) = slopes(|s| s.measured_n_mm) {
        text += &format!(" From depth to depth the measured force rises by {measured} N/mm");
        text +=
            &slopes(|s| s.model_n_mm).map_or_else(|| ".".to_owned(), |ours| format!(", the model's by {ours} N/mm."));
        text += " Where the measured slope rises and falls again, no smooth model can follow.";
    }
    text
}

/// Curves along the path.
pub fn travel(numbers: &Numbers) -> String {
    let mut text =
        "Friction rises while the contact sticks, then levels out where all of it slips; it is kinetic only there. The stick ratio \
                    is the part of the contact that still sticks."
            .to_owned();
    let slips = |d: &DepthNumbers| d.full_slip_travel_mm.map(|s| format!("{} at depth {}", mm(s), mm(d.depth_mm)));
    let slips: Vec<_> = numbers.depths.iter().filter_map(slips).collect();
    if !slips.is_empty() {
        text += &format!(" Full slip is reached after {}.", list(&slips));
    }
    for d in numbers.depths.iter().filter(|d| d.full_slip_travel_mm.is_none()) {
        text += &match (d.final_stick_ratio, d.travel_mm) {
            (Some(ratio), Some(travel)) => format!(
                " At depth {} no full slip is reached within {} of slide: the stick ratio there is still {}.",
                mm(d.depth_mm),
                mm(travel),
                fixed(ratio, 2)
            ),
            _ => format!(" At depth {} there is no slide to show.", mm(d.depth_mm)),
        };
    }
    text + " The presses of all depths lie one on the other where they agree; open symbols are their ends, filled circles \
            Table 1."
}

/// Maps of one depth.
pub fn contact(depth: &DepthNumbers) -> String {
    let mut text =
        "Top: pressure on the faces of the pad, bottom: where they stick, at the skin's current position, seen along \
                    the plane's normal; a face that touches in part is paler. The scales are those of all depths."
            .to_owned();
    if let (Some(first), Some(last)) = (depth.maps.first(), depth.maps.last()) {
        if let (Some(a), Some(b)) = (first.peak_pressure_kpa, last.peak_pressure_kpa) {
            let (a, b) = (fixed(a, 1), fixed(b, 1));
            let (from, to) = (mm(first.travel_mm), mm(last.travel_mm));
            text += &format!(" The largest pressure is {a} kPa after {from} of slide and {b} kPa after {to}.");
        }
        if let (Some(a), Some(b)) = (first.contact_area_mm2, last.contact_area_mm2) {
            text += &format!(" The contact area changes from {} to {} mm².", fixed(a, 1), fixed(b, 1));
        }
        let ratios: Vec<_> = depth
            .maps
            .iter()
            .filter_map(|m| m.stick_ratio.map(|s| format!("{} after {}", fixed(s, 2), mm(m.travel_mm))))
            .collect();
        if !ratios.is_empty() {
            text += &format!(" Stick ratios: {}.", ratios.join(", "));
        }
    }
    text + &match depth.full_slip_travel_mm {
        Some(slide) => format!(" All of it slips from {} on.", mm(slide)),
        None => " Full slip is not reached in this run.".to_owned(),
    }
}

/// Pictures of the mesh.
pub fn mesh(numbers: &Numbers, view: &MeshView) -> String {
    let m = &numbers.provenance.mesh;
    let mut text = format!(
        "{} nodes, {} hexahedra, {} tetrahedra (nail); {} faces of the pad may touch the plane, and elements should be finest \
         there.",
        m.nodes, m.hexes, m.tets, m.pad_faces
    );
    text += &match view.deformed {
        Some((depth, slide)) => format!(
            " The deformed picture is true to scale, at depth {} after {} of slide: where it touches, the pad should lie flat \
             on the plane, and the tissue between plane and bone should lean the way the plane went.",
            mm(depth),
            mm(slide)
        ),
        None => " There is no deformed state to show in this run.".to_owned(),
    };
    text
}
