//! What every page of a diagnosis has: the verdict in words first, formulas, curves over time, short numbers.

use crate::common::{Folder, fe_set, packaged};

/// A page as it is read: texts without tags, a line each, and no style.
fn shown(html: &str) -> String {
    let body = &html[html.find("<body>").unwrap()..];
    let mut out = String::new();
    for piece in body.split('<').skip(1) {
        // Code is part of a line.
        out += if piece.starts_with("code") || piece.starts_with("/code") { "" } else { "\n" };
        out += piece.split_once('>').unwrap().1;
    }
    out.replace('\u{a0}', " ").replace("&lt;", "<")
}

/// Digits of a number from its first that is not 0 on; those of a whole number up to its last such one.
fn digits(number: &str) -> usize {
    let shown = number.trim_start_matches(['0', '.']).replace('.', "");
    if number.contains('.') { shown.len() } else { shown.trim_end_matches('0').len() }
}

/// Every number of a text with its digits.
fn numbers(text: &str) -> Vec<(&str, usize)> {
    let words = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '.' || c == '_'));
    let numbers = words.map(|word| word.trim_matches('.')).filter(|word| word.parse::<f64>().is_ok());
    numbers.map(|word| (word, digits(word.split(['e', 'E']).next().unwrap()))).collect()
}

fn check(what: &str, html: &str) -> String {
    let text = shown(html);
    for (number, digits) in numbers(&text) {
        let most = if number.contains('.') { 4 } else { 6 };
        assert!(digits <= most, "{what}: {number} has {digits} digits");
    }
    assert!(!text.contains("row of the run") && !text.contains("NaN") && !text.contains("inf "), "{what}");
    let headline = html.split("<h1>").nth(1).unwrap().split("</h1>").next().unwrap().replace('\u{a0}', " ");
    assert!(headline.ends_with(" times the noise floor."), "{what}: {headline}");
    assert_eq!(html.matches("<h1>").count(), 1, "{what}");
    // Each figure is drawn for narrow pages too, and fits them.
    for figure in html.split("<figure ").skip(1) {
        let narrow = figure.split("class=\"narrow\"").nth(1).unwrap_or_else(|| panic!("{what}: {}", &figure[..40]));
        let width = narrow.split(" width=\"").nth(1).unwrap().split('"').next().unwrap();
        assert!(width.parse::<u32>().unwrap() <= 380, "{what}: {width} px, {}", &figure[..40]);
    }
    headline
}

/// Names of the figures in their order.
fn figures(html: &str) -> Vec<&str> {
    html.split("<figure id=\"").skip(1).map(|rest| rest.split('"').next().unwrap()).collect()
}

/// Diagnoses a stored set after a calibration: the page, and what the report says.
fn diagnosed(calibration: &str, measured: &str, options: &str) -> (String, serde_json::Value) {
    let folder = Folder::with(&[("c.csv", calibration), ("m.csv", measured)]);
    folder.done(&format!("diagnose --calibration c.csv --measured m.csv {options} --out d"));
    let json = folder.text("d/report.json");
    let longest = json.split(|c: char| !(c.is_ascii_digit() || c == '.')).map(digits).max().unwrap();
    // The whole precision of a number; hashes have letters between their digits.
    assert!(longest <= 17, "{longest} digits");
    (folder.text("d/report.html"), serde_json::from_str(&json).unwrap())
}

#[test]
fn a_named_effect_comes_with_size_gap_formula_and_its_driver_first() {
    let text = |name: &str| String::from_utf8(packaged(&format!("data/examples/finger/{name}.csv"))).unwrap();
    let (html, report) = diagnosed(&text("calibration"), &text("measured"), "");
    let headline = check("named", &html);
    assert!(headline.starts_with("Missing: hydration bell, 22 % of the force. The gap falls from "), "{headline}");
    assert_eq!(report["title"], headline.as_str());
    assert_eq!(figures(&html)[..5], ["driver_1", "map_before", "heldout", "evidence", "map_after"]);
    let text = shown(&html);
    let formula = report["effects"][0]["formula"].as_str().unwrap();
    assert!(formula.starts_with("strength × (1 + amplitude [g(h) − g(35)])") && text.contains(formula), "{formula}");
    assert!(text.contains("Fitted: strength × (1 + 0.56"), "the formula with its numbers");
    assert!(text.contains("time since the run's first row, s") && text.contains("left with it in the model, %"));
    assert!(!text.contains("separation λ"), "one candidate is no table");
    // The first row of the map is the named driver.
    let map = html.split("<figure id=\"map_before\"").nth(1).unwrap();
    let rows = shown(&format!("<body>{}", map.split("</figure>").next().unwrap()));
    let first = rows.lines().map(str::trim).filter(|line| !line.is_empty()).nth(2);
    assert_eq!(first, Some("hydration, a.u."), "{rows}");
}

#[test]
fn every_verdict_has_its_headline_and_short_numbers() {
    let calibration = fe_set("calibration_d");
    for (set, verdict, start, first) in [
        ("set_09", "none", "Nothing is missing that these runs could show. The gap is ", "heldout"),
        ("set_08", "ambiguous", "Missing: ageing or static peak (these runs cannot tell which), ", "driver_1"),
        ("set_19", "unexplained_structure", "Unexplained: the normal force scatters between runs by ", "map_before"),
        ("set_12", "named", "Missing: depth zero offset, ", "driver_1"),
    ] {
        let (html, report) = diagnosed(&calibration, &fe_set(set), "--stability-groups 3");
        let headline = check(set, &html);
        assert_eq!(report["verdict"], verdict, "{set}: {headline}");
        assert!(headline.starts_with(start), "{set}: {headline}");
        assert_eq!(figures(&html)[0], first, "{set}");
        if verdict == "ambiguous" {
            assert!(shown(&html).contains("separation λ") && html.contains("These strokes vary "), "{set}");
        }
        if verdict == "unexplained_structure" {
            assert!(headline.contains(" mN (") && headline.contains(" %)"), "{headline}");
        }
    }
}

#[test]
fn forces_alone_have_the_same_page() {
    let folder = Folder::new();
    folder.write("t.csv", packaged("data/human_texture_exploration/July3_2_force_data_1.csv"));
    folder.done("diagnose --force-only --measured t.csv --out d --map normal=-Fz,x=Fx,y=Fy,t=Timestamp");
    let html = folder.text("d/report.html");
    let headline = check("forces", &html);
    assert!(headline.starts_with("Missing: tare bias, ") && headline.contains(" % of the force"), "{headline}");
    assert_eq!(folder.json("d/report.json")["title"], headline.as_str());
    assert!(shown(&html).contains("Fitted: normal += 0.2"));
}
