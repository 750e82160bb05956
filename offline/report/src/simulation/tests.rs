//! The report of a run along a path, from made-up runs.

use super::*;
use crate::synthetic;
use fingerpad::{Regime, Status};

fn run(mesh: &Mesh) -> SimulationReport {
    let built = synthetic::report(mesh, true);
    let trajectory = built.depths[1].trajectory.clone();
    let times: Vec<f64> = trajectory.snapshots.iter().map(|s| s.response.t_s).collect();
    SimulationReport {
        path_name: "turn & lift.csv".to_owned(),
        row_times_s: [&[0.0], &times[..]].concat(),
        response_link: Some("../my runs/response.csv".to_owned()),
        provenance: built.provenance,
        settings: "mesh_preset = \"coarse\"\n".to_owned(),
        trajectory,
        map_rows: vec![1, 2, 3, 4, 5],
        checks: built.checks,
        ended_early: None,
    }
}

fn words_of(html: &str) -> String {
    crate::tests::words(html)
}

#[test]
fn the_page_holds_figures_maps_rows_link_and_settings() {
    let mesh = synthetic::mesh();
    let rendered = render(&run(&mesh), &mesh).unwrap();
    let html = words_of(&rendered.html);
    assert_eq!(rendered.figures.len(), 2 + 5 * 4);
    // The two figures of the path have a wide and a narrow form.
    assert_eq!((html.matches("<svg ").count(), html.matches("<img ").count()), (4 + 20, 0));
    for part in [
        "A finger along turn &amp; lift.csv",
        "href=\"../my%20runs/response.csv\"",
        "mesh_preset = &quot;coarse&quot;",
        "A check failed: finer contact quadrature",
        "<b>E.</b> Row 6 of the path",
        "largest penetration",
    ] {
        assert!(html.contains(part), "{part}");
    }
    for word in ["http:", "https:", "<script", "<link", "@import", "NaN", "inf "] {
        assert!(!html.contains(word), "{word}");
    }
    crate::tests::closes_what_it_opens(&rendered.html);
    let json: serde_json::Value = serde_json::from_str(&rendered.json).unwrap();
    assert_eq!(json["responses"].as_array().unwrap().len(), 61);
    assert_eq!(json["maps"][4]["letter"], "E");
}

/// The picture shades full slip from the time that the text gives.
#[test]
fn a_regime_is_shaded_from_its_first_row() {
    let row = |t_s: f64, regime, stick_ratio| Response { t_s, regime, stick_ratio, ..Response::default() };
    let rows = [
        row(0.0, Regime::NoContact, 0.0),
        row(1.6, Regime::PartialSlip, 0.4),
        row(1.7, Regime::PartialSlip, 0.13),
        row(1.8, Regime::Slip, 0.0),
        row(2.0, Regime::Slip, 0.0),
    ];
    let shades = along::regimes(&rows);
    let expected = [(Regime::NoContact, [0.0, 1.6]), (Regime::PartialSlip, [1.6, 1.8]), (Regime::Slip, [1.8, 2.0])];
    assert_eq!(shades, expected);
    assert!(words::verdict(&rows).contains("slips first at 1.80 s"));
}

#[test]
fn what_was_not_recorded_is_left_out() {
    let mesh = synthetic::mesh();
    let mut report = run(&mesh);
    let no_contact = |r: &mut Response| {
        (r.regime, r.stick_ratio, r.contact_area_mm2) = (Regime::NoContact, 0.0, 0.0);
        (r.normal_force_n, r.friction_x_n) = (0.0, 0.0);
        r.centre_of_pressure_mm = [f64::NAN; 2];
    };
    report.trajectory.responses.iter_mut().for_each(no_contact);
    report.trajectory.snapshots.clear();
    let rendered = render(&report, &mesh).unwrap();
    let html = words_of(&rendered.html);
    assert!(html.contains("The body never touches the finger") && html.contains("No row touches."), "{html}");
    assert!(!html.contains("Centre of pressure") && !html.contains("The contact") && !html.contains("NaN"));
    let empty = render(&SimulationReport::default(), &Mesh::default()).unwrap();
    assert_eq!(empty.figures.len(), 1);
}

#[test]
fn what_went_wrong_stands_above_the_figures() {
    let mesh = synthetic::mesh();
    let mut report = run(&mesh);
    report.ended_early = Some("no equilibrium beyond t = 2 s".to_owned());
    report.provenance.mesh_preset = "coarse".to_owned();
    report.trajectory.responses[7].status = Status::STABILISED;
    let html = words_of(&render(&report, &mesh).unwrap().html);
    let figure = html.find("<figure").unwrap();
    for part in ["no equilibrium beyond t = 2 s", "1 of 61 rows", "coarse mesh is for trying", "A check failed"] {
        assert!(html.find(part).is_some_and(|at| at < figure), "{part}");
    }
}

#[test]
fn a_snapshot_of_another_mesh_is_refused() {
    let mesh = synthetic::mesh();
    let mut report = run(&mesh);
    report.trajectory.snapshots[2].displacement_mm.pop();
    assert!(matches!(render(&report, &mesh), Err(ReportError::OtherMesh { depth_mm: 1.0, slide_mm: 1.0, .. })));
}
