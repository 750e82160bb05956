//! Lines of `data/law-vectors.csv` against formulas in both precisions.

use std::collections::BTreeMap;

use fingerpad::effects::{Change, Conditions, Law, Library, REFERENCE_AREA_MM2, Real, VALUES};

/// Names and numbers of a cell, `name=number` joined by `;`.
fn pairs(cell: &str) -> BTreeMap<&str, f64> {
    cell.split(';')
        .filter(|p| !p.is_empty())
        .map(|p| p.split_once('=').unwrap())
        .map(|(k, v)| (k, v.parse().unwrap()))
        .collect()
}

/// Checks lines against a library in f64 and f32; every law must have one.
pub fn check<L: Library>(laws: &[&Law], lines: &str) {
    let mut seen = Vec::new();
    for line in lines.lines() {
        let name = line.split(',').next().unwrap();
        let law = laws.iter().find(|law| law.name == name).unwrap_or_else(|| panic!("{name} is no law"));
        seen.push(law.name);
        // The vectors have nine digits; f32 has seven, of which the power of subject_size keeps six.
        agrees::<f64>(line, law, 6e-9, &L::apply::<f64>, |x| x);
        agrees::<f64>(line, law, 6e-9, &|_, values, at, change| law.apply(values, at, change), |x| x);
        agrees::<f32>(line, law, 1e-6, &L::apply::<f32>, f64::from);
    }
    for law in laws {
        assert!(seen.contains(&law.name), "{} has no line in data/law-vectors.csv", law.name);
    }
}

type Apply<'a, T> = &'a dyn Fn(u32, &[T; VALUES], &Conditions<T>, &mut Change<T>);

/// Checks a line in one precision.
fn agrees<T: Real>(line: &str, law: &Law, tolerance: f64, apply: Apply<'_, T>, wide: fn(T) -> f64) {
    let cells: Vec<&str> = line.split(',').collect();
    let (given, inputs, wanted) = (pairs(cells[1]), pairs(cells[2]), pairs(cells[3]));
    let reported: Vec<f64> = law.parameters.iter().map(|p| given[p.name]).collect();
    let values = law.fitted(&reported).map(T::of);
    let input = |name: &str| inputs.get(name).copied().unwrap_or(0.0);
    let angle = 2.0 * input("direction_deg").to_radians();
    let at = Conditions {
        t_s: input("t_s"),
        depth_mm: input("depth_mm"),
        contact_time_s: input("contact_time_s"),
        speed_mm_s: input("speed_mm_s"),
        double_angle: [angle.cos(), angle.sin()],
        along: [1.0, 0.0],
        path_mm: input("path_since_touch_mm"),
        turn_mm: input("path_since_turn_mm"),
        dwell_s: input("dwell_s"),
        occlusion_s: input("occlusion_time_s"),
        hydration_au: input("hydration_au"),
        temperature_c: input("temperature_c"),
        width_mm: input("finger_width_mm"),
        own: [0.0; 4],
    };
    let mut change = Change::default();
    apply(law.kind, &values, &in_precision(&at), &mut change);
    let area = inputs.get("area_mm2").copied().unwrap_or(REFERENCE_AREA_MM2) / REFERENCE_AREA_MM2;
    let force = [input("normal_force_n"), input("friction_x_n"), input("friction_y_n")];
    let reading = change.reading(force.map(T::of)).map(wide);
    for (name, wanted) in wanted {
        let found = match name {
            "strength" => wide(change.strength),
            "stiffness" => wide(change.stiffness),
            "force_along_motion_n" => wide(change.drag_n) * area,
            "depth_mm" => at.depth_mm + wide(change.depth_mm),
            "normal_force_n" => reading[0] - wide(change.adhesion_n) * area.sqrt(),
            "friction_x_n" => reading[1],
            "friction_y_n" => reading[2],
            other => panic!("{other}"),
        };
        assert!((found - wanted).abs() < tolerance * wanted.abs().max(1.0), "{line}: {found}");
    }
}

fn in_precision<T: Real>(at: &Conditions<f64>) -> Conditions<T> {
    Conditions {
        t_s: T::of(at.t_s),
        depth_mm: T::of(at.depth_mm),
        contact_time_s: T::of(at.contact_time_s),
        speed_mm_s: T::of(at.speed_mm_s),
        double_angle: at.double_angle.map(T::of),
        along: at.along.map(T::of),
        path_mm: T::of(at.path_mm),
        turn_mm: T::of(at.turn_mm),
        dwell_s: T::of(at.dwell_s),
        occlusion_s: T::of(at.occlusion_s),
        hydration_au: T::of(at.hydration_au),
        temperature_c: T::of(at.temperature_c),
        width_mm: T::of(at.width_mm),
        own: at.own.map(T::of),
    }
}
