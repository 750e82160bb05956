//! The report as a whole, from made-up runs.

use super::*;

fn rendered() -> Rendered {
    let mesh = synthetic::mesh();
    render(&synthetic::report(&mesh, false), &mesh).unwrap()
}

/// The page without its fonts.
pub fn words(html: &str) -> String {
    let html = html.replace('\u{a0}', " ");
    let mut pieces = html.split(";base64,");
    let first = pieces.next().unwrap_or_default().to_owned();
    pieces.fold(first, |out, piece| out + &piece[piece.find(['"', ')']).unwrap()..])
}

/// Runs of which much is missing.
fn gappy(mesh: &Mesh) -> BuildReport {
    let mut report = synthetic::report(mesh, false);
    report.depths[0].trajectory = Trajectory::default();
    report.depths[1].measured = None;
    report.depths[2].frictionless_friction_coefficient = None;
    let nan = f64::NAN;
    report.depths[2].kinetic = Steady { normal_force_n: nan, friction_coefficient: nan, contact_area_mm2: nan };
    report.depths[2].trajectory.snapshots.truncate(1);
    for r in &mut report.depths[3].trajectory.responses {
        (r.normal_force_n, r.stick_ratio, r.friction_x_n) = (nan, nan, f64::INFINITY);
    }
    for s in &mut report.depths[3].trajectory.snapshots {
        s.displacement_mm.iter_mut().for_each(|u| u.x = nan);
    }
    report.provenance.quality[0].value = nan;
    report
}

/// `REPORT_LOOK=DIR cargo test report::tests::look` writes the reports there for inspection.
#[test]
fn look() {
    let Some(dir) = std::env::var_os("REPORT_LOOK").map(std::path::PathBuf::from) else { return };
    let mesh = synthetic::mesh();
    for (name, report) in [("whole", synthetic::report(&mesh, false)), ("gappy", gappy(&mesh))] {
        let (dir, rendered) = (dir.join(name), render(&report, &mesh).unwrap());
        std::fs::create_dir_all(&dir).unwrap();
        std::fs::write(dir.join("report.html"), &rendered.html).unwrap();
        std::fs::write(dir.join("report.json"), &rendered.json).unwrap();
        for (name, svg) in rendered.figures.iter().map(Picture::file) {
            std::fs::write(dir.join(name), svg).unwrap();
        }
    }
}

#[test]
fn every_figure_is_a_file_and_stands_in_the_page() {
    let rendered = rendered();
    let names: Vec<_> = rendered.figures.iter().map(|f| f.name.as_str()).collect();
    let wanted = [
        "figure2",
        "normal_area",
        "travel",
        "contact_0.75mm",
        "contact_1.00mm",
        "contact_1.25mm",
        "contact_1.50mm",
        "mesh",
    ];
    assert_eq!(names, wanted);
    for name in names {
        assert!(rendered.html.contains(&format!("<figure id=\"{name}\">")), "{name}");
    }
    for (name, svg) in rendered.figures.iter().map(Picture::file) {
        assert!(
            svg.starts_with(b"<svg xmlns=\"http://www.w3.org/2000/svg\" width=") && svg.ends_with(b"</svg>\n"),
            "{name}"
        );
    }
    assert_eq!(rendered.html.matches("<figcaption>").count(), wanted.len());
    // Each once for wide and once for narrow pages.
    assert_eq!(rendered.html.matches("<svg ").count(), 2 * wanted.len());
    assert!(!rendered.html.contains("<img "));
}

#[test]
fn page_needs_nothing_from_outside() {
    let html = words(&rendered().html);
    for word in ["http:", "https:", "<script", "<link", "@import", "NaN", "inf "] {
        assert!(!html.contains(word), "{word}");
    }
    let outside = |(i, _): (usize, &str)| !html[i..].starts_with("url(data:");
    assert!(!html.match_indices("url(").any(outside));
}

#[test]
fn page_closes_what_it_opens_and_escapes_what_it_is_given() {
    let html = rendered().html;
    assert!(html.contains("This &lt;test&gt; invents its &quot;numbers&quot;."));
    closes_what_it_opens(&html);
}

/// Every tag of a page is closed where it should be.
pub fn closes_what_it_opens(html: &str) {
    let body = &html[html.find("</style>").unwrap() + 8..];
    let mut open: Vec<&str> = vec!["html", "head"];
    for tag in body.split('<').skip(1) {
        let tag = &tag[..tag.find('>').expect("a tag ends")];
        let name = tag.split([' ', '/']).find(|s| !s.is_empty()).unwrap();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') && !["meta", "img", "br"].contains(&name) {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn json_holds_every_number_of_the_tables() {
    let rendered = rendered();
    let json: serde_json::Value = serde_json::from_str(&rendered.json).unwrap();
    let mut numbers = Vec::new();
    let mut stack = vec![&json];
    while let Some(value) = stack.pop() {
        match value {
            serde_json::Value::Number(n) => numbers.extend(n.as_f64()),
            serde_json::Value::Array(a) => stack.extend(a),
            serde_json::Value::Object(o) => stack.extend(o.values()),
            _ => {}
        }
    }
    let mut seen = 0;
    for shown in rendered.html.split("<td class=\"num").skip(1) {
        let shown = shown[shown.find('>').unwrap() + 1..].split('<').next().unwrap();
        let plain = shown.replace('−', "-");
        let Ok(value) = plain.trim_start_matches('+').parse::<f64>() else {
            assert!(["–", "not reached"].contains(&shown), "{shown}");
            continue;
        };
        let (mantissa, exponent) = plain.split_once('e').unwrap_or((&plain, "0"));
        let decimals = mantissa.split_once('.').map_or(0, |(_, d)| d.len()) as i32;
        let unit = 10f64.powi(exponent.parse::<i32>().unwrap() - decimals);
        assert!(numbers.iter().any(|n| (n - value).abs() <= 0.5001 * unit), "{shown}");
        seen += 1;
    }
    assert!(seen > 100, "{seen}");
}

#[test]
fn captions_say_what_happened() {
    let html = words(&rendered().html);
    assert!(html.contains("Full slip is reached after 2.00 mm at depth 0.75 mm"), "{html}");
    assert!(html.contains("At depth 1.50 mm no full slip is reached within 6.00 mm of slide"));
    assert!(html.contains("Full slip was not reached at 1.50 mm: the friction there is not kinetic."));
    assert!(html.contains("friction coefficient −26.8 to +1.4 %"));
    assert!(html.contains("the measured force rises by 0.31, 0.74 and 0.28 N/mm"));
    assert!(html.contains("1 of 3 numerical checks of this run failed."));
    let mesh = synthetic::mesh();
    let slipping = words(&render(&synthetic::report(&mesh, true), &mesh).unwrap().html);
    assert!(!slipping.contains("not reached") && !slipping.contains("no full slip"));
}

#[test]
fn what_is_missing_is_left_out() {
    let mesh = synthetic::mesh();
    let empty = render(&BuildReport::default(), &Mesh::default()).unwrap();
    assert_eq!(empty.figures.len(), 4);
    assert!(empty.html.contains("nothing to compare"));

    let html = words(&render(&gappy(&mesh), &mesh).unwrap().html);
    assert!(!html.contains("NaN") && !html.contains(">inf"));
    assert!(html.contains("there is no slide to show"));
}

#[test]
fn a_snapshot_of_another_mesh_is_refused() {
    let mesh = synthetic::mesh();
    let mut report = synthetic::report(&mesh, true);
    report.depths[1].trajectory.snapshots[2].faces.pop();
    let error = render(&report, &mesh).unwrap_err();
    assert!(matches!(error, ReportError::OtherMesh { depth_mm: 1.0, slide_mm: 1.0, .. }), "{error}");
}
