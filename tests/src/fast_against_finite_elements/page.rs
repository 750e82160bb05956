//! The tables and charts of the page.
//!
//! Main functions: [`with_tables`], [`charts`].

use std::collections::BTreeMap;
use std::fmt::Write as _;

use fingerpad_reduce::{Kind, Sample};
use fingerpad_report::{Trace, TraceChart};

use super::{Entry, Failure, MODELS, PAGE, elements};

/// A quantity: its name and unit, its column among the errors, and the decimals of its value.
struct Quantity {
    name: &'static str,
    value: fn(&super::Forces) -> f64,
    decimals: usize,
}

const QUANTITIES: [Quantity; 3] = [
    Quantity { name: "normal force, N", value: |f| f[0], decimals: 3 },
    Quantity { name: "friction, N", value: |f| f[1].hypot(f[2]), decimals: 3 },
    Quantity { name: "moment, N mm", value: |f| f[3], decimals: 2 },
];
const NORMAL: usize = 0;
const FRICTION: usize = 1;
const MOMENT: usize = 2;

const HEADINGS: &str = "springs | pad, 24 patches | pad, 37 patches |";

/// The page with its tables replaced by those of the entries.
///
/// # Errors
/// A page without the place of a table.
pub fn with_tables(page: &str, entries: &[Entry]) -> Result<String, Failure> {
    put_tables(page, PAGE, tables(entries))
}

/// A page, whose file is `file`, with these tables in their places.
///
/// # Errors
/// A page without the place of a table.
pub fn put_tables(page: &str, file: &str, tables: Vec<(&'static str, String)>) -> Result<String, Failure> {
    let mut page = page.to_owned();
    for (name, table) in tables {
        let (from, to) = (format!("<!-- table: {name} -->\n\n"), "\n<!-- end of the table -->");
        let start = page.find(&from).ok_or_else(|| format!("{file}: no `{}`", from.trim()))? + from.len();
        let end = page[start..].find(to).ok_or_else(|| format!("{file}: no `{}` after {name}", to.trim()))? + start;
        page.replace_range(start..end, &table);
    }
    Ok(page)
}

/// The tables of the page, by the names of their places in it.
fn tables(entries: &[Entry]) -> Vec<(&'static str, String)> {
    let over = |kind, by: &dyn Fn(&Sample) -> f64, name, quantities: &[usize]| {
        let entry = first(entries, kind);
        let rows = spread(entry, by);
        let head = format!("| {name} | quantity | finite elements | {HEADINGS}\n|---|---|---|---|---|---|\n");
        let label = |row: usize| format!("{:.2}", by(&entry.run.samples[row]));
        head + &rows.iter().map(|row| lines(entry, *row, &label(*row), quantities)).collect::<String>()
    };
    let state = |kinds: &[Kind], label: fn(&Entry) -> String| {
        let head = format!("| run | quantity | finite elements | {HEADINGS}\n|---|---|---|---|---|---|\n");
        let wanted = entries.iter().filter(|entry| kinds.contains(&entry.run.kind));
        let line = |entry: &Entry| lines(entry, most_friction(entry), &label(entry), &[NORMAL, FRICTION, MOMENT]);
        head + &wanted.map(line).collect::<String>()
    };
    vec![
        ("kinds", kinds(entries)),
        ("slide", over(Kind::Straight, &slide_mm, "slide, mm", &[NORMAL, FRICTION])),
        ("spin", over(Kind::Spin, &spin_deg, "spin, degrees", &[NORMAL, MOMENT])),
        ("pose", state(&[Kind::Pose, Kind::WidePose], pose_label)),
        ("depth", state(&[Kind::Deep], pose_label)),
        ("body", state(&[Kind::Body], body_label)),
    ]
}

/// The first entry of a kind.
fn first(entries: &[Entry], kind: Kind) -> &Entry {
    entries.iter().find(|entry| entry.run.kind == kind).expect("the table holds runs of every kind")
}

fn slide_mm(s: &Sample) -> f64 {
    f64::from(s.slide_mm[0]).hypot(s.slide_mm[1].into())
}

fn spin_deg(s: &Sample) -> f64 {
    s.turned.map_or(0.0, |t| t.spin_deg.into())
}

/// Shares of the largest slide or spin of a run at which its table has rows.
const SHARES: [f64; 5] = [0.1, 0.2, 0.4, 0.7, 1.0];

/// The rows at which a coordinate first comes to these shares of its largest.
fn spread(entry: &Entry, by: &dyn Fn(&Sample) -> f64) -> Vec<usize> {
    let values: Vec<f64> = entry.run.samples.iter().map(|s| by(s).abs()).collect();
    let most = values.iter().copied().fold(0.0, f64::max);
    let mut rows: Vec<usize> =
        SHARES.iter().filter_map(|share| values.iter().position(|v| *v >= share * most - 1e-9)).collect();
    rows.dedup();
    rows
}

/// The row at which the friction of the finite elements is largest.
fn most_friction(entry: &Entry) -> usize {
    let friction = |row: &usize| (QUANTITIES[FRICTION].value)(&elements(&entry.run.samples[*row]));
    (0..entry.run.samples.len()).max_by(|a, b| friction(a).total_cmp(&friction(b))).unwrap_or(0)
}

/// A line for each quantity at a row.
fn lines(entry: &Entry, row: usize, label: &str, quantities: &[usize]) -> String {
    let mut text = String::new();
    for (k, &quantity) in quantities.iter().enumerate() {
        let Quantity { name, value, decimals } = &QUANTITIES[quantity];
        let sample = &entry.run.samples[row];
        write!(
            text,
            "| {} | {name} | {}",
            if k == 0 { label } else { "" },
            number(value(&elements(sample)), *decimals)
        )
        .expect("writing to a string");
        for (model, forces) in entry.forces.iter().enumerate() {
            let cell = forces.as_ref().zip(entry.errors(model, row)).map_or_else(String::new, |(forces, errors)| {
                let error = number(errors[quantity], 1);
                let sign = if quantity != FRICTION && !error.starts_with('−') { "+" } else { "" };
                format!("{} ({sign}{error})", number(value(&forces[row]), *decimals))
            });
            write!(text, " | {cell}").expect("writing to a string");
        }
        text.push_str(" |\n");
    }
    text
}

fn number(x: f64, decimals: usize) -> String {
    super::decimals(x, decimals).replace('-', "−")
}

fn pose_label(entry: &Entry) -> String {
    let sample = &entry.run.samples[most_friction(entry)];
    let turned = sample.turned.unwrap_or_default();
    let [pitch, roll] = [turned.pitch_deg, turned.roll_deg].map(|deg| number(deg.into(), 0));
    format!("{}: {:.2} mm deep, pitch {pitch}°, roll {roll}°", entry.run.name, sample.depth_mm)
}

fn body_label(entry: &Entry) -> String {
    let body = &entry.run.body;
    let kind = serde_json::to_string(&body.kind).expect("a name").replace('"', "");
    let radius = body.radius_mm.map_or_else(String::new, |r| format!(", radius {r:.1} mm"));
    format!("{}: {kind}{radius}", entry.run.name)
}

/// Root mean square and largest errors by kind, one table for each quantity.
fn kinds(entries: &[Entry]) -> String {
    let mut by_kind: BTreeMap<Kind, Vec<&Entry>> = BTreeMap::new();
    for entry in entries {
        by_kind.entry(entry.run.kind).or_default().push(entry);
    }
    let mut text = String::new();
    for (quantity, Quantity { name, .. }) in QUANTITIES.iter().enumerate() {
        let (title, _) = name.split_once(',').expect("a name with its unit");
        let capital = title[..1].to_uppercase() + &title[1..];
        write!(text, "{capital}, %:\n\n| kind | runs, rows | {HEADINGS}\n|---|---|---|---|---|\n")
            .expect("writing to a string");
        for (kind, own) in &by_kind {
            let rows: usize = own.iter().map(|entry| entry.run.samples.len()).sum();
            write!(text, "| {} | {}, {rows}", kind.as_str().replace('_', " "), own.len()).expect("writing to a string");
            for model in 0..MODELS.len() {
                let errors: Vec<f64> = own
                    .iter()
                    .flat_map(|entry| (0..entry.run.samples.len()).filter_map(|row| entry.errors(model, row)))
                    .map(|errors| errors[quantity])
                    .collect();
                let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64).sqrt();
                let worst = errors.iter().fold(0.0, |most: f64, e| most.max(e.abs()));
                let cell = if errors.is_empty() { String::new() } else { format!("{rms:.1}; {worst:.1}") };
                write!(text, " | {cell}").expect("writing to a string");
            }
            text.push_str(" |\n");
        }
        text.push('\n');
    }
    text.trim_end().to_owned() + "\n"
}

/// Friction over slide, moment over spin, friction in another pose: the first run of the table of each kind.
pub fn charts(entries: &[Entry]) -> [TraceChart; 3] {
    let time: &dyn Fn(&Sample) -> f64 = &|s| f64::from(s.t_s);
    let chart = |kind, title: &str, over: &str, up: &str, by: &dyn Fn(&Sample) -> f64, quantity: usize| {
        let entry = first(entries, kind);
        let value = QUANTITIES[quantity].value;
        let points = |forces: &dyn Fn(usize) -> super::Forces| {
            entry.run.samples.iter().enumerate().map(|(row, s)| [by(s), value(&forces(row))]).collect()
        };
        let mut traces = Vec::new();
        // The springs last, so that pads have the same colours where there are none.
        let names: Vec<&str> = HEADINGS.trim_end_matches(" |").split(" | ").collect();
        for model in (1..MODELS.len()).chain([0]) {
            if let Some(forces) = &entry.forces[model] {
                let points = points(&|row| forces[row]);
                traces.push(Trace { name: names[model].to_owned(), points, ..Trace::default() });
            }
        }
        let of_elements = points(&|row| elements(&entry.run.samples[row]));
        traces.push(Trace { name: "finite elements".into(), points: of_elements, is_dots: true, ..Trace::default() });
        TraceChart {
            title: format!("{title} ({})", entry.run.name),
            labels: [over.to_owned(), up.to_owned()],
            traces,
            ..TraceChart::default()
        }
    };
    [
        chart(Kind::Straight, "A slide", "Slide, mm", "Friction F, newton", &slide_mm, FRICTION),
        chart(Kind::Spin, "A spin", "Spin, degrees", "Moment M, newton millimetre", &spin_deg, MOMENT),
        chart(Kind::WidePose, "Another pose", "Time t, s", "Friction F, newton", time, FRICTION),
    ]
}
