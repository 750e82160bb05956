//! The laws against the numbers of `data/law-vectors.csv`.

use std::collections::BTreeMap;

use super::{Change, DRAG_PATH_MM, LAWS, REFERENCE_AREA_MM2, Row, find};

fn pairs(cell: &str) -> BTreeMap<&str, f64> {
    cell.split(';')
        .filter(|p| !p.is_empty())
        .map(|p| p.split_once('=').unwrap())
        .map(|(k, v)| (k, v.parse().unwrap()))
        .collect()
}

#[test]
fn laws_agree_with_the_vectors() {
    let text = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../data/law-vectors.csv"));
    let mut seen = Vec::new();
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let law = find(cells[0]).unwrap();
        seen.push(law.name);
        let (given, inputs, wanted) = (pairs(cells[1]), pairs(cells[2]), pairs(cells[3]));
        let mut values: Vec<f64> = law.parameters.iter().map(|p| given[p.name]).collect();
        if law.name == "anisotropy" {
            let (s, c) = (2.0 * values[1].to_radians()).sin_cos();
            values = vec![values[0] * c, values[0] * s];
        }
        let input = |name: &str| inputs.get(name).copied().unwrap_or(0.0);
        let angle = 2.0 * input("direction_deg").to_radians();
        let row = Row {
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
        };
        let mut change = Change::default();
        (law.apply)(&values, &row, &mut change);
        let area = inputs.get("area_mm2").copied().unwrap_or(REFERENCE_AREA_MM2) / REFERENCE_AREA_MM2;
        let normal = input("normal_force_n");
        for (name, wanted) in wanted {
            let found = match name {
                "strength" => change.strength,
                "stiffness" => change.stiffness,
                "force_along_motion_n" => change.drag_n * area,
                "depth_mm" => row.depth_mm + change.depth_mm,
                "normal_force_n" => change.reading_n[0] - change.adhesion_n * area.sqrt(),
                "friction_x_n" => change.reading_n[1] + change.cross[0] * normal,
                "friction_y_n" => change.reading_n[2] + change.cross[1] * normal,
                other => panic!("{other}"),
            };
            // The vectors have nine digits.
            assert!((found - wanted).abs() < 6e-9 * wanted.abs().max(1.0), "{line}: {found}");
        }
    }
    for law in LAWS {
        assert!(seen.contains(&law.name), "{} has no vector", law.name);
    }
    assert!(DRAG_PATH_MM > 0.0);
}

#[test]
fn the_library_is_consistent() {
    for (i, law) in LAWS.iter().enumerate() {
        assert_eq!(law.kind as usize, i + 1);
        assert!(law.linear >= 1 && law.linear <= law.parameters.len());
        assert!(!law.source.is_empty() && !law.shapes.is_empty());
        for shape in law.shapes {
            assert_eq!(shape.len(), law.parameters.len() - law.linear, "{}", law.name);
            for (p, v) in law.parameters[law.linear..].iter().zip(*shape) {
                assert!(p.low <= *v && *v <= p.high, "{} {} {v}", law.name, p.name);
            }
        }
        for other in law.confused_with {
            assert!(find(other).is_some(), "{} names {other}", law.name);
        }
        // No size, no effect; and no factor below the floor.
        let row = Row {
            depth_mm: 1.2,
            contact_time_s: 3.0,
            speed_mm_s: 7.0,
            path_mm: 0.4,
            turn_mm: 0.4,
            dwell_s: 2.0,
            occlusion_s: 9.0,
            hydration_au: 60.0,
            temperature_c: 29.0,
            width_mm: 18.0,
            t_s: 900.0,
            ..Row::default()
        };
        let mut values = vec![0.0; law.linear];
        values.extend_from_slice(law.shapes[0]);
        let mut change = Change::default();
        (law.apply)(&values, &row, &mut change);
        assert_eq!(change, Change::default(), "{}", law.name);
        values[0] = -1e3;
        (law.apply)(&values, &row, &mut change);
        assert!(change.strength >= 0.1 && change.stiffness >= 0.1, "{}", law.name);
    }
}
