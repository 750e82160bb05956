//! Files of laws: the ten of `docs/laws-of-your-own.md`, each parsed, tried and run by the core as a table, and files that are
//! refused.

use fingerpad::build::{EffectSlot, Params};
use fingerpad::effects::{Change, Conditions, tables};
use fingerpad::host::ModelFile;
use fingerpad::{Contact, Effects, Error, Motion, SPRINGS, Status, Surroundings};
use fingerpad_diagnose::laws::own_law::OwnLaw;
use fingerpad_diagnose::laws::tabulation::tabulate;
use fingerpad_diagnose::{LawsFile, OwnColumn};

const PAGE: &str = include_str!("../../../docs/laws-of-your-own.md");

fn parse(text: &str) -> Result<LawsFile, String> {
    LawsFile::parse("mine.toml".as_ref(), text).map_err(|e| e.to_string())
}

/// The page's laws behind its heading.
fn ten_laws() -> Vec<LawsFile> {
    let (_, of_ten) = PAGE.split_once("## Ten laws").unwrap();
    of_ten.split("```toml\n").skip(1).map(|block| parse(block.split_once("```").unwrap().0).unwrap()).collect()
}

/// Name, drivers with their values and result of each line of the page's table.
fn vectors() -> Vec<(&'static str, Vec<(&'static str, f64)>, f64)> {
    let (_, table) = PAGE.split_once("|---|---|---|\n| electroadhesion").unwrap();
    let lines = std::iter::once("| electroadhesion".to_owned() + table);
    let text: &'static str = lines.collect::<String>().leak();
    text.lines()
        .take_while(|line| line.starts_with('|'))
        .map(|line| {
            let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
            let pair = |p: &'static str| p.split_once('=').map(|(k, v)| (k, v.parse().unwrap())).unwrap();
            (cells[0], cells[1].split(';').map(pair).collect(), cells[2].parse().unwrap())
        })
        .collect()
}

fn typical(law: &OwnLaw) -> Vec<f64> {
    law.parameters.iter().map(|p| p.typical).collect()
}

/// Conditions in which a driver has a value.
fn set(at: &mut Conditions<f64>, driver: usize, value: f64) {
    match driver {
        3 => at.speed_mm_s = value,
        10 => at.hydration_au = value,
        11 => at.temperature_c = value,
        own => at.own[own - tables::FIRST_OWN] = value,
    }
}

fn found(law: &OwnLaw, change: &Change<f64>) -> f64 {
    use fingerpad::effects::tables::Target;
    match law.target.0 {
        Target::Strength => change.strength - 1.0,
        Target::Stiffness => change.stiffness - 1.0,
        Target::Depth => change.depth_mm,
        Target::ReadingNormal => change.reading_n[0],
        Target::ReadingX => change.reading_n[1],
        Target::ReadingY => change.reading_n[2],
    }
}

#[test]
fn the_pages_ten_laws_give_what_the_page_says() {
    let files = ten_laws();
    let vectors = vectors();
    assert_eq!((files.len(), vectors.len()), (10, 10));
    for (file, (name, drivers, wanted)) in files.iter().zip(&vectors) {
        let [own] = &file.laws[..] else { panic!("{name}: one law a block") };
        assert_eq!(own.law.name, *name);
        let mut at = Conditions::default();
        for (driver, value) in drivers {
            let number = own.drivers.iter().find(|d| d.name == *driver).unwrap().number;
            set(&mut at, number, *value);
        }
        let mut change = Change::default();
        own.law.apply(&typical(own), &at, &mut change);
        let value = found(own, &change);
        assert!((value - wanted).abs() < 1e-8, "{name}: {value} {wanted}");
        // Without its size, or with an unknown driver, it does nothing.
        let mut none = Change::default();
        let mut zero = typical(own);
        zero[0] = 0.0;
        own.law.apply(&zero, &at, &mut none);
        set(&mut at, own.drivers[0].number, f64::NAN);
        own.law.apply(&typical(own), &at, &mut none);
        assert_eq!(none, Change::default(), "{name}");
        assert_eq!(own.law.linear, 1, "{name}");
    }
}

/// A model file with one law as a table.
fn file_with(own: &OwnLaw, columns: &[OwnColumn]) -> ModelFile {
    let table = tabulate(own, &typical(own), |driver| own.drivers[driver].range).unwrap();
    let summary = table.summary(own);
    println!("{summary}");
    assert!(summary.largest_error <= 0.01 * summary.largest_change, "{summary}");
    let mut section = vec![0.0; 3];
    let slot = table.append(own, &mut section);
    let data = Params::example().try_build().unwrap();
    let columns: Vec<_> = columns.iter().map(|c| c.in_model_file().unwrap()).collect();
    let tables = fingerpad::build::Sections { tables: &section, columns: &columns, ..Default::default() };
    let mut bytes = vec![0; fingerpad::build::Data::file_length_with(&[slot], tables, "{}")];
    data.write_file_with(&[slot], tables, "{}", &mut bytes).unwrap();
    let plain = fingerpad::build::Data::file_length(&[], "{}");
    let of_columns = size_of_val(&columns[..]);
    assert!(
        bytes.len() <= plain + summary.bytes + of_columns + 4 * 3 + 2 * 12 + 8,
        "{} {plain} {}",
        bytes.len(),
        summary.bytes
    );
    ModelFile::new(&bytes).unwrap()
}

#[test]
fn the_core_runs_each_of_them_as_a_table_within_the_reported_error() {
    for file in ten_laws() {
        let own = &file.laws[0];
        let written = file_with(own, &file.columns);
        assert_eq!(written.file().columns.len(), file.columns.len());
        for (there, here) in written.file().columns.iter().zip(&file.columns) {
            assert_eq!((there.name(), there.unit()), (here.name.as_str(), here.unit.as_str()));
        }
        let file = written.file();
        let effects = Effects::of_file(&file).unwrap();
        let table = tabulate(own, &typical(own), |driver| own.drivers[driver].range).unwrap();
        for share in [0.0, 0.013, 0.31, 0.5, 0.77, 1.0] {
            let mut around = Surroundings { own: [0.0; 4], ..Surroundings::default() };
            let mut at = Conditions::default();
            for driver in &own.drivers {
                let value = driver.range[0] + share * (driver.range[1] - driver.range[0]);
                set(&mut at, driver.number, value);
            }
            (around.own, around.hydration_au) = (at.own.map(|v| v as f32), at.hydration_au as f32);
            around.temperature_c = at.temperature_c as f32;
            around.speed_mm_s = Some(at.speed_mm_s as f32);
            let mut wanted = Change::default();
            own.law.apply(&typical(own), &at, &mut wanted);
            let [with, plain] = [&effects, &Effects::new(&[]).unwrap()].map(|effects| slid(&file, effects, around));
            let of = match own.target.name() {
                "strength" => with.1[1] / plain.1[1] - 1.0,
                "stiffness" => with.1[0] / plain.1[0] - 1.0,
                "reading_normal" => with.1[0] - plain.1[0],
                _ => continue,
            };
            // A factor on the tissue's stiffness is not quite one on the normal force of a sheared finger.
            let bound = 1.01 * table.largest_error + 0.02 * table.largest_change + 1e-4;
            let value = found(own, &wanted);
            assert!((f64::from(of) - value).abs() <= bound, "{} {share}: {of} {value} {bound}", own.law.name);
            assert!(!with.0.contains(Status::EFFECT_HELD), "{} {share}", own.law.name);
        }
    }
}

/// Status and the sensor's readings after a press to 1 mm and a slide.
fn slid(file: &fingerpad::File<'_>, effects: &Effects<'_>, around: Surroundings) -> (Status, [f32; 3]) {
    let mut contact = Contact::<SPRINGS>::default();
    let mut last = fingerpad::Response::default();
    for i in 1..=500 {
        let slide = if i < 100 { 0.0 } else { 0.02 };
        let motion = Motion {
            depth_mm: (0.01 * i as f32).min(1.0),
            slide_increment_mm: [slide, 0.0],
            spin_increment_rad: 0.0,
            dt_s: 0.01,
        };
        last = effects.step(&file.model, &mut contact, around, motion);
    }
    (last.status, effects.reading_under(&last, &contact, &around))
}

/// Work that the plane does on the finger in a press, a slide and a release, mJ: with a table of stiffness over the path,
/// which the file of laws refuses, and one of strength, which it takes.
#[test]
fn stiffness_over_the_path_yields_work_and_strength_over_it_does_not() {
    let refused = |acts_on: &str, gain: f64| {
        let text = LAW
            .replace("strength", acts_on)
            .replace("voltage_v / 100)^2", "path_mm / 50)")
            .replace("0.05", &gain.to_string());
        parse(&text).map(|file| file.laws[0].clone())
    };
    let message = refused("stiffness", 0.5).unwrap_err();
    assert!(
        message.contains("mine.toml: line 10")
            && message.contains("free energy")
            && message.contains("50.0 % more work"),
        "{message}"
    );
    assert!(refused("strength", 0.5).is_ok());
    let data = Params::example().try_build().unwrap();
    let model = data.model().unwrap();
    let work = |slots: &[EffectSlot], tables: &[f32]| {
        let effects: Effects<'_> = Effects::with_tables(slots, tables).unwrap();
        let mut contact = Contact::<SPRINGS>::default();
        let (mut work_mj, mut before) = (0.0f64, (0.0f32, [0.0f32; 2]));
        let mut go = |depth_mm: f32, x: f32| {
            let motion = Motion { depth_mm, slide_increment_mm: [x, 0.0], spin_increment_rad: 0.0, dt_s: 0.01 };
            let r = effects.step(&model, &mut contact, Surroundings::default(), motion);
            let now = (r.normal_force_n, r.friction_n);
            (now, depth_mm, x)
        };
        let mut depth = 0.0f32;
        let path = (1..=400)
            .map(|i| (0.0025 * i as f32, 0.0))
            .chain((0..1000).map(|i| (1.0, if i < 500 { 0.001 } else { -0.001 })))
            .chain((0..=400).rev().map(|i| (0.0025 * i as f32, 0.0)));
        for (to, x) in path {
            let (now, _, _) = go(to, x);
            work_mj += 0.5 * f64::from(before.0 + now.0) * f64::from(to - depth)
                + 0.5 * f64::from(before.1[0] + now.1[0]) * f64::from(x);
            (before, depth) = (now, to);
        }
        work_mj
    };
    // A path of 1 mm there and back takes the stiffness from 1 to 1.5.
    let head = [6.0, 2.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.5];
    let slot = |target: f32| EffectSlot { kind: tables::TABLE, reserved: 0, values: [target, 0.0, 0.0, 0.0, 0.0, 0.0] };
    let [plain, stiff, strong] = [work(&[], &[]), work(&[slot(1.0)], &head), work(&[slot(0.0)], &head)];
    println!("work taken: plain {plain:.5}, stiffness {stiff:.5}, strength {strong:.5} mJ");
    // The slide sticks, so that nothing is lost; the springs' odd stiffness follows the strength and gives the
    // remainder.
    assert!(plain.abs() < 1e-6 && strong > 1e-3 * stiff && stiff < -0.01, "{plain} {strong} {stiff}");
}

const LAW: &str = r#"
[[column]]
name = "voltage_v"
unit = "V"
range = [0, 200]

[[law]]
name = "mine"
acts_on = "strength"
formula = "gain * (voltage_v / 100)^2"
parameter = [{ name = "gain", unit = "", range = [0, 1], typical = 0.05 }]
"#;

#[test]
fn bad_files_are_refused_with_file_line_and_value() {
    assert!(parse(LAW).is_ok());
    let formula = "gain * (voltage_v / 100)^2";
    for (from, to, words) in [
        ("[[law]]", "[[laws]]", &["line 7", "laws"][..]),
        (
            formula,
            "gain * 10 / voltage_v",
            &["line 10", "law `mine`", "character 11", "divided by zero", "voltage_v = 0 V"],
        ),
        (formula, "gain * ln(voltage_v / 100)", &["line 10", "character 8", "ln(0)", "-inf", "max("]),
        (formula, "gain * exp(voltage_v * 10)", &["line 10", "character 8", "exp(", "inf"]),
        (formula, "gain * volts", &["line 10", "character 8", "`volts`", "no column"]),
        (formula, "gain * sqrt(voltage_v", &["line 10", "character 22", "ends"]),
        (formula, "gain * system(1)", &["line 10", "character 8", "`system` is no function"]),
        (formula, "gain * exp(voltage_v)", &["contradictory units", "exp of V", "character 8"]),
        (formula, "gain * (voltage_v - path_mm)", &["contradictory units", "V and mm"]),
        (formula, "1 + gain * (voltage_v / 100)", &["line 10", "proportional", "gain = 0 it is"]),
        (formula, "gain * 2", &["reads no driver"]),
        (formula, "0.2 * voltage_v / 100", &["`gain` is not in it"]),
        (formula, "gain * (voltage_v - 150) / 1", &["line 10", "at its typical size", "-7.5000", "voltage_v = 0 V"]),
        ("acts_on = \"strength\"", "acts_on = \"friction\"", &["line 9", "`friction`", "stiffness"]),
        ("name = \"voltage_v\"", "name = \"voltage_mm\"", &["line 2", "`voltage_mm`", "says mm", "V"]),
        ("name = \"voltage_v\"", "name = \"depth_mm\"", &["line 2", "says mm; its unit is V"]),
        ("name = \"voltage_v\"", "name = \"direction_x\"", &["contradictory units", "not V"]),
        ("name = \"voltage_v\"", "name = \"friction_x_n\"", &["line 2", "friction_x_n"]),
        ("range = [0, 200]", "range = [200, 0]", &["line 2", "[200.0, 0.0]"]),
        ("range = [0, 200]", "range = [0, 200]\nreference = -3", &["reference -3"]),
        ("unit = \"V\"", "unit = \"V$\"", &["`V$` is no unit"]),
        ("typical = 0.05", "typical = 5", &["line 11", "`gain`", "typical 5"]),
        ("range = [0, 1]", "range = [1, 0]", &["line 11", "[1.0, 0.0]"]),
        ("name = \"mine\"", "name = \"temperature\"", &["line 7", "temperature", "library"]),
        ("name = \"mine\"", "name = \"mine\"\nconfused_with = [\"unknown\"]", &["line 9", "`unknown`"]),
        ("name = \"gain\"", "name = \"path_mm\"", &["line 11", "`path_mm`", "taken"]),
        ("name = \"gain\"", "name = \"gain_s\"", &["contradictory units", "gain_s"]),
    ] {
        assert!(LAW.contains(from), "{from}");
        let text = LAW.replacen(from, to, 1);
        let message = parse(&text).map(|_| ()).expect_err(to);
        assert!(message.starts_with("mine.toml: line "), "{to}: {message}");
        for word in words {
            assert!(message.contains(word), "{to}: `{word}` in {message}");
        }
    }
    assert!(parse("").unwrap_err().contains("0 laws"));
    // Laws that create energy.
    for (acts_on, formula, word) in [
        ("stiffness", "gain * (turn_mm / 10)", "turn_mm"),
        ("stiffness", "gain * (speed_mm_s / 20)", "speed_mm_s"),
        ("stiffness", "gain * direction_x", "direction_x"),
        ("stiffness", "gain * (contact_time_s / 60)", "contact_time_s"),
        ("depth", "gain * (path_mm / 10)", "deeper"),
    ] {
        let text = LAW.replacen("strength", acts_on, 1).replacen("gain * (voltage_v / 100)^2", formula, 1);
        let message = parse(&text).map(|_| ()).expect_err(formula);
        assert!(message.contains("free energy") && message.contains(word) && message.contains("line 10"), "{message}");
    }
    // A fall with time in contact is a relaxation.
    let text = LAW.replacen("strength", "stiffness", 1).replacen(
        "gain * (voltage_v / 100)^2",
        "-gain * (contact_time_s / 120)",
        1,
    );
    parse(&text).unwrap();
}

#[test]
fn a_file_without_its_tables_and_slots_of_other_versions_are_refused() {
    let laws = &ten_laws()[0];
    let written = file_with(&laws.laws[0], &laws.columns);
    let file = written.file();
    assert_eq!(Effects::new(file.effects).unwrap_err(), Error::Section { id: *b"TABL" });
    assert!(Effects::of_file(&file).is_ok());
}
