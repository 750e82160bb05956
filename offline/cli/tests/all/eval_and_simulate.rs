//! `fingerpad eval` and `fingerpad simulate` follow the same paths, refuse the same ones and print the same warnings.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use crate::common::{refused, run, write};
use fingerpad::build::{Data, EffectSlot};
use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad::pad;
use fingerpad_fe::load_path::{self, Drive, Turn};
use fingerpad_reduce::{Kind, Run, Sample, replay};

const HEAD: &str = "t_s,depth_mm,slide_x_mm,slide_y_mm";
const SHIPPED: &[u8] = include_bytes!("../../data/models/fingertip.fpm");
const PAD: &[u8] = include_bytes!("../../data/models/fingertip-pad.fpm");

/// Runs `eval`, which must succeed; standard error.
fn eval(arguments: &[&str], at: &Path) -> String {
    let (code, stdout, stderr) = run(&[&["eval"], arguments].concat(), at);
    assert_eq!(code, Some(0), "{arguments:?}: {stdout}{stderr}");
    stderr
}

/// Columns of a response by name; empty cells are NaN.
fn columns(file: &Path) -> HashMap<String, Vec<f64>> {
    let text = fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut columns: HashMap<String, Vec<f64>> = HashMap::new();
    for line in lines {
        for (name, cell) in names.iter().zip(line.split(',')) {
            columns.entry((*name).to_owned()).or_default().push(cell.parse().unwrap_or(f64::NAN));
        }
    }
    columns
}

/// The path as a file.
fn path_csv(path: &load_path::Path) -> String {
    assert_eq!(path.drives, [Drive::Displacement; 3]);
    let turns = [("spin_deg", &path.turns.spin), ("pitch_deg", &path.turns.pitch), ("roll_deg", &path.turns.roll)];
    let turns: Vec<(&str, &Turn)> = turns.into_iter().filter_map(|(name, t)| Some((name, t.as_ref()?))).collect();
    let mut text = HEAD.to_owned() + &turns.iter().map(|(name, _)| format!(",{name}")).collect::<String>() + "\n";
    for (k, w) in path.waypoints.iter().enumerate() {
        text += &format!("{},{},{},{}", w.t_s, w.normal, w.x, w.y);
        text += &turns.iter().map(|(_, t)| format!(",{}", t.values[k])).collect::<String>();
        text += "\n";
    }
    text
}

/// Stored finite-element runs of a kind that reached the end of their path.
fn stored(kind: Kind) -> Vec<Run> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/runs");
    let files = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    let mut runs: Vec<Run> = files
        .filter(|f| f.extension().is_some_and(|e| e == "fprun"))
        .map(|f| Run::from_bytes(&fs::read(&f).unwrap(), &f).unwrap())
        .filter(|r| r.kind == kind && r.ended_early.is_none())
        .filter(|r| r.path.turns.spin.as_ref().is_none_or(|spin| spin.drive == Drive::Displacement))
        .collect();
    runs.sort_by(|a, b| a.name.cmp(&b.name));
    runs
}

/// The motion of a path in steps as short as those of `eval`, the first row of the path and the ends of its segments included.
fn finely(run: &Run) -> (Run, Vec<usize>) {
    let first = run.samples[0].turned.unwrap();
    let at = |k: usize| {
        let w = &run.path.waypoints[k];
        let angle = |turn: &Option<Turn>, fitted: f32| turn.as_ref().map_or(f64::from(fitted), |t| t.values[k]);
        let turns = &run.path.turns;
        let pose = [angle(&turns.spin, 0.0), angle(&turns.pitch, first.pitch_deg), angle(&turns.roll, 0.0)];
        [w.normal, w.x, w.y, pose[0], pose[1], pose[2]]
    };
    let sample = |[depth, x, y, spin, pitch, roll]: [f64; 6]| {
        let mut turned = first;
        (turned.spin_deg, turned.pitch_deg, turned.roll_deg) = (spin as f32, pitch as f32, roll as f32);
        Sample { depth_mm: depth as f32, slide_mm: [x as f32, y as f32], turned: Some(turned), ..run.samples[0] }
    };
    let mut fine = Run { samples: vec![sample(at(0))], ..run.clone() };
    let mut corners = vec![0];
    for k in 1..run.path.waypoints.len() {
        let (from, to) = (at(k - 1), at(k));
        let way = |i: usize| (to[i] - from[i]).abs() / if i < 3 { 0.02 } else { 0.4 };
        let steps = (0..6).map(way).fold(1.0, f64::max).ceil();
        for s in 1..=steps as usize {
            let share = s as f64 / steps;
            fine.samples.push(sample(std::array::from_fn(|i| from[i] + share * (to[i] - from[i]))));
        }
        corners.push(fine.samples.len() - 1);
    }
    (fine, corners)
}

#[test]
fn a_spin_along_a_path_gives_the_numbers_of_the_replay_of_the_stored_runs() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let file = ModelFile::new(SHIPPED).unwrap();
    let precise = file.file().model.data().cast::<f64>();
    let mut compared = 0;
    let mut from_finite_elements = Vec::new();
    for kind in [Kind::Spin, Kind::SpinSlide, Kind::SpinReversal] {
        let runs = stored(kind);
        for stored in runs.iter().take(5) {
            let (fine, corners) = finely(stored);
            let replayed = replay(&precise.model().unwrap(), &fine);
            write(at, "path.csv", &path_csv(&stored.path));
            eval(&["--path", "path.csv", "--out", "response.csv"], at);
            let found = columns(&at.join("response.csv"));
            let friction = |[x, y]: [f64; 2]| x.hypot(y);
            let largest = replayed.iter().map(|r| friction(r.friction_n)).fold(0.0, f64::max);
            let largest_normal = replayed.iter().map(|r| r.normal_force_n).fold(0.0, f64::max);
            let scale = largest.max(0.3 * largest_normal);
            for (w, corner) in stored.path.waypoints.iter().zip(corners) {
                let row = found["t_s"].iter().position(|t| *t == w.t_s).unwrap();
                let r = &replayed[corner];
                let [x, y] = r.friction_n;
                for (name, wanted, scale) in [
                    ("normal_force_n", r.normal_force_n, largest_normal),
                    ("friction_x_n", x, scale),
                    ("friction_y_n", y, scale),
                    ("spin_moment_n_mm", r.spin_moment_n_mm, 3.0 * scale),
                ] {
                    let found = found[name][row];
                    let apart = (found - wanted).abs() / scale;
                    assert!(apart < 2e-3, "{} t {}: {name} {found}, replay {wanted}", stored.name, w.t_s);
                    compared += 1;
                }
                let pose = fine.samples[corner].turned.unwrap();
                for (name, wanted) in
                    [("spin_deg", pose.spin_deg), ("pitch_deg", pose.pitch_deg), ("roll_deg", pose.roll_deg)]
                {
                    assert!((found[name][row] - f64::from(wanted)).abs() < 1e-3, "{}: {name}", stored.name);
                }
                // The finite elements' row at the same time.
                let sample = stored.samples.iter().find(|s| (f64::from(s.t_s) - w.t_s).abs() < 1e-5).unwrap();
                let [x, y] = sample.friction_n.map(f64::from);
                let apart = (found["friction_x_n"][row] - x).hypot(found["friction_y_n"][row] - y);
                from_finite_elements.push(apart / scale);
            }
        }
    }
    assert!(compared > 250, "{compared}");
    let rms = (from_finite_elements.iter().map(|e| e * e).sum::<f64>() / from_finite_elements.len() as f64).sqrt();
    assert!(rms < 0.12, "{rms}");
}

/// A press of 1 mm and a slide of 3 mm, with further columns that hold one value.
fn press_and_slide(depth_mm: f64, more: &[(&str, f64)]) -> String {
    let names: String = more.iter().map(|(name, _)| format!(",{name}")).collect();
    let values: String = more.iter().map(|(_, value)| format!(",{value}")).collect();
    format!("{HEAD}{names}\n0,0,0,0{values}\n0.5,{depth_mm},0,0{values}\n2,{depth_mm},3,0{values}\n")
}

#[test]
fn each_pitch_gives_forces_of_its_own_and_a_spin_its_moment() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut forces = Vec::new();
    for pitch in [12.0, 20.0, 30.0, 40.0, 50.0] {
        write(at, "p.csv", &press_and_slide(1.0, &[("pitch_deg", pitch)]));
        let printed = eval(&["--path", "p.csv", "--out", "r.csv"], at);
        let by_pad = printed.contains("fingertip-pad.fpm (shipped): the path leaves the pose");
        assert_eq!((by_pad, printed.lines().count()), (pitch != 30.0, usize::from(by_pad)), "{printed}");
        let found = columns(&at.join("r.csv"));
        let last = |name: &str| *found[name].last().unwrap();
        assert_eq!((last("pitch_deg"), last("roll_deg")), (pitch, 0.0));
        forces.push([last("normal_force_n"), last("friction_x_n")]);
    }
    for pair in forces.windows(2) {
        assert!((pair[0][1] / pair[1][1] - 1.0).abs() > 0.002, "{forces:?}");
    }
    // The pose that the model was fitted in changes nothing.
    write(at, "p.csv", &press_and_slide(1.0, &[]));
    eval(&["--path", "p.csv", "--out", "r.csv"], at);
    let plain = columns(&at.join("r.csv"));
    assert!((plain["friction_x_n"].last().unwrap() / forces[2][1] - 1.0).abs() < 1e-4, "{forces:?}");
    assert_eq!(plain["pitch_deg"].last(), Some(&30.0));

    write(at, "p.csv", &format!("{HEAD},spin_deg\n0,0,0,0,0\n0.5,1,0,0,0\n1,1,0,0,6\n"));
    eval(&["--path", "p.csv", "--out", "r.csv"], at);
    assert!(*columns(&at.join("r.csv"))["spin_moment_n_mm"].last().unwrap() > 0.1);
}

#[test]
fn the_columns_are_those_of_simulate_and_four_more() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "c.toml", "shape = \"a\"\nmesh_preset = \"coarse\"\n[tissue.bone]\nkind = \"fixed\"\n");
    write(at, "p.csv", &format!("{HEAD},pitch_deg\n0,0,0,0,35\n1,0.2,0,0,35\n"));
    let (code, _, stderr) = run(&["simulate", "--path", "p.csv", "--config", "c.toml", "--out", "s.csv"], at);
    assert_eq!(code, Some(0), "{stderr}");
    eval(&["--path", "p.csv", "--out", "e.csv"], at);
    let head = |name: &str| fs::read_to_string(at.join(name)).unwrap().lines().next().unwrap().to_owned();
    assert_eq!(head("e.csv"), head("s.csv") + ",friction_limit_n,slip_margin,band_normal_n,band_friction_n");
}

#[test]
fn poses_and_moments_that_cannot_be_followed_are_refused_by_name_in_both_commands() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "c.toml", "shape = \"a\"\nmesh_preset = \"coarse\"\n[tissue.bone]\nkind = \"fixed\"\n");
    for (column, value, expected) in [
        ("pitch_deg", 85.0, "pitch_deg 85: must be from 10 to 70"),
        ("roll_deg", 60.0, "roll_deg 60: must be from -30 to 30"),
        // Radians.
        ("pitch_deg", 0.52, "pitch_deg 0.52: must be from 10 to 70"),
    ] {
        write(at, "p.csv", &press_and_slide(1.0, &[(column, value)]));
        let expected = ["p.csv", "data row 1", expected];
        refused(&["simulate", "--path", "p.csv", "--config", "c.toml", "--out", "r.csv"], at, &expected);
        refused(&["eval", "--path", "p.csv", "--out", "r.csv"], at, &expected);
    }
    for (moment, angle) in
        [("spin_moment_n_mm", "spin_deg"), ("moment_y_n_mm", "pitch_deg"), ("moment_x_n_mm", "roll_deg")]
    {
        write(at, "p.csv", &press_and_slide(1.0, &[(moment, 0.0)]));
        refused(&["eval", "--path", "p.csv", "--out", "r.csv"], at, &["p.csv", moment, angle]);
    }
    assert!(!at.join("r.csv").exists());
}

/// Writes the shipped model with some of its numbers changed and with effects.
fn model(file: &Path, change: impl Fn(&mut Data), effects: &[EffectSlot]) {
    let shipped = ModelFile::new(SHIPPED).unwrap();
    let mut data = *shipped.file().model.data();
    change(&mut data);
    let mut bytes = vec![0; Data::file_length(effects, "{}")];
    data.write_file(effects, "{}", &mut bytes).unwrap();
    fs::write(file, bytes).unwrap();
}

fn effect(kind: u32, values: [f32; 6]) -> EffectSlot {
    EffectSlot { kind, reserved: 0, values }
}

#[test]
fn a_pose_beyond_those_of_the_fit_is_flagged_and_one_that_no_model_has_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let pad = PadModelFile::new(PAD).unwrap();
    let numbers = pad::Numbers { pitch_range_deg: [20.0, 40.0], ..*pad.file().pad.numbers };
    let narrow = pad::Pad::new(pad.file().pad.patches, &numbers);
    let mut bytes = vec![0; narrow.file_length("{}")];
    narrow.write_file("{}", &mut bytes).unwrap();
    fs::write(at.join("narrow.fpm"), bytes).unwrap();
    write(at, "p.csv", &press_and_slide(1.0, &[("pitch_deg", 55.0)]));
    let stderr = eval(&["--model", "narrow.fpm", "--path", "p.csv", "--out", "r.csv"], at);
    assert!(stderr.contains("pose_out_of_range in") && stderr.contains("20 to 40"), "{stderr}");
    assert!(fs::read_to_string(at.join("r.csv")).unwrap().contains(",pose_out_of_range,"));
    model(&at.join("one.fpm"), |_| {}, &[]);
    let one = ["eval", "--model", "one.fpm", "--path", "p.csv", "--out", "r.csv", "--force"];
    refused(&one, at, &["p.csv", "pitch_deg", "one.fpm", "one pose", "30"]);
    // Its own pose is one that it has.
    write(at, "p.csv", &press_and_slide(1.0, &[("pitch_deg", 30.0), ("roll_deg", 0.0)]));
    eval(&one[1..], at);
}

#[test]
fn effects_act_under_a_spin() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // Temperature: 3 % less strength a degree below 32.
    model(&at.join("warm.fpm"), |_| {}, &[effect(17, [0.03, 0.0, 0.0, 0.0, 0.0, 0.0])]);
    write(at, "p.csv", &press_and_slide(1.0, &[("spin_deg", 0.0)]));
    let last = |out: &str, arguments: &[&str]| {
        eval(&[&["--path", "p.csv", "--out", out][..], arguments].concat(), at);
        *columns(&at.join(out))["friction_x_n"].last().unwrap()
    };
    let plain = last("a.csv", &[]);
    let warm = last("b.csv", &["--model", "warm.fpm"]);
    let cold = last("c.csv", &["--model", "warm.fpm", "--temperature-c", "29"]);
    assert!((warm / plain - 1.0).abs() < 1e-4 && (cold / plain - 0.91).abs() < 5e-3, "{plain} {warm} {cold}");
}

#[test]
fn conditions_that_a_model_does_not_read_and_values_out_of_range_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    model(&at.join("warm.fpm"), |_| {}, &[effect(17, [0.03, 0.0, 0.0, 0.0, 0.0, 0.0])]);
    write(at, "p.csv", &press_and_slide(1.0, &[]));
    let eval = ["eval", "--path", "p.csv", "--out", "r.csv"];
    for (flag, value) in [
        ("--hydration-au", "50"),
        ("--temperature-c", "30"),
        ("--finger-width-mm", "17"),
        ("--series-s", "5"),
        ("--occlusion-s", "5"),
    ] {
        refused(&[&eval[..], &[flag, value]].concat(), at, &[flag, value, "fingertip.fpm", "reads none"]);
    }
    let warm = [&eval[..], &["--model", "warm.fpm"]].concat();
    refused(&[&warm[..], &["--hydration-au", "50"]].concat(), at, &["--hydration-au 50", "it reads --temperature-c"]);
    for value in ["nan", "5000", "-5", "302.15"] {
        let expected = [format!("--temperature-c {value}").replace("nan", "NaN"), "20 to 40 °C".to_owned()];
        refused(&[&warm[..], &["--temperature-c", value]].concat(), at, &expected.each_ref().map(String::as_str));
    }
    assert!(!at.join("r.csv").exists());
    assert_eq!(run(&[&warm[..], &["--temperature-c", "30"]].concat(), at).0, Some(0));
    crate::common::charged::charged(&at.join("charged.fpm"));
    let charged = ["--model", "charged.fpm", "--column", "voltage_v=20", "--temperature-c", "30", "--force"];
    refused(&[&eval[..], &charged].concat(), at, &["--temperature-c 30", "reads none"]);
}

#[test]
fn runs_that_lack_a_column_of_an_effect_are_refused_and_those_in_millinewtons_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let measured = include_str!("../../data/examples/measured.csv");
    let slot = effect(1, [0.2, 25.0, 10.0, 0.0, 0.0, 0.0]);
    model(&at.join("moist.fpm"), |_| {}, &[slot]);
    write(at, "m.csv", measured);
    write(at, "bare.csv", &measured.replacen("hydration_au", "note", 1));
    write(at, "mn.csv", &in_millinewtons(measured));
    let moist = ["eval", "--model", "moist.fpm", "--out", "r.csv"];
    refused(&[&moist[..], &["--runs", "bare.csv"]].concat(), at, &["bare.csv", "`hydration_au`", "moist.fpm"]);
    // Conditions of runs are in their file.
    refused(&[&moist[..], &["--runs", "m.csv", "--hydration-au", "30"]].concat(), at, &["--hydration-au", "--runs"]);
    let (code, _, stderr) = run(&[&moist[..], &["--runs", "m.csv"]].concat(), at);
    assert_eq!((code, stderr.as_str()), (Some(0), ""));
    let (code, _, stderr) = run(&[&moist[..], &["--runs", "mn.csv"]].concat(), at);
    assert_eq!(code, Some(0), "{stderr}");
    assert!(stderr.contains("normal_force_n") && stderr.contains("millinewtons"), "{stderr}");
}

/// Measured runs with forces times 1000.
fn in_millinewtons(text: &str) -> String {
    let mut out = String::new();
    for (k, line) in text.lines().enumerate() {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if k > 0 {
            cells[5..8].iter_mut().for_each(|c| *c = (1e3 * c.parse::<f64>().unwrap()).to_string());
        }
        out += &(cells.join(",") + "\n");
    }
    out
}

#[test]
fn simulate_warns_of_the_units_that_eval_warns_of() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "c.toml", "shape = \"a\"\nmesh_preset = \"coarse\"\n[tissue.bone]\nkind = \"fixed\"\n");
    for (path, expected) in [
        (press_and_slide(0.001, &[]), &["0.001", "in metres"][..]),
        (press_and_slide(-1.0, &[]), &["no row touches", "sign"]),
        (press_and_slide(1000.0, &[]), &["1000", "in micrometres"]),
    ] {
        write(at, "p.csv", &path);
        let simulate = ["simulate", "--path", "p.csv", "--config", "c.toml", "--out", "s.csv"];
        for arguments in [&simulate[..], &["eval", "--path", "p.csv", "--out", "e.csv"]] {
            let (_, _, stderr) = run(arguments, at);
            for part in expected {
                assert!(stderr.contains(part), "{arguments:?}: no `{part}` in: {stderr}");
            }
        }
    }
}

const COARSE: &str = "shape = \"a\"\nmesh_preset = \"coarse\"\n[tissue.bone]\nkind = \"fixed\"\n";

#[test]
fn an_output_replaces_only_what_the_same_command_wrote() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "p.csv", &press_and_slide(0.2, &[]));
    write(at, "c.toml", COARSE);
    fs::write(at.join("model.fpm"), SHIPPED).unwrap();
    write(at, "README.md", "mine\n");
    write(at, "measured.csv", "run_id,t_s\na,0\n");
    let commands: [(&str, &[&str]); 6] = [
        ("r.csv", &["eval", "--path", "p.csv"]),
        ("s.csv", &["simulate", "--path", "p.csv", "--config", "c.toml"]),
        ("m.rs", &["export", "--format", "rust"]),
        ("m.json", &["export", "--format", "json"]),
        ("m.fmu", &["export", "--format", "fmu"]),
        ("f.csv", &["reduce", "--restarts", "0"]),
    ];
    for (own, command) in commands {
        for foreign in ["model.fpm", "README.md", "measured.csv", "p.csv"] {
            let before = fs::read(at.join(foreign)).unwrap();
            let (code, _, stderr) = run(&[command, &["--out", foreign]].concat(), at);
            assert_eq!(code, Some(2), "{command:?} {foreign}: {stderr}");
            assert!(stderr.contains(&format!("--out {foreign}")), "{stderr}");
            assert_eq!(fs::read(at.join(foreign)).unwrap(), before, "{command:?} {foreign}");
        }
        if command[0] == "reduce" {
            continue;
        }
        // Its own file, an empty one, and, with --force, a file of another command.
        for (content, more) in [(None, &[][..]), (None, &[]), (Some(""), &[]), (Some("mine\n"), &["--force"][..])] {
            if let Some(content) = content {
                write(at, own, content);
            }
            let (code, _, stderr) = run(&[command, &["--out", own], more].concat(), at);
            assert_eq!(code, Some(0), "{command:?} {content:?}: {stderr}");
            assert!(fs::metadata(at.join(own)).unwrap().len() > 100, "{own}");
        }
        // The input is never overwritten.
        if command.contains(&"p.csv") {
            refused(&[command, &["--out", "p.csv", "--force"]].concat(), at, &["would overwrite p.csv"]);
        }
    }
    let finger = ["finger", "--mesh-preset", "coarse", "--estimate", "--out", "."];
    refused(&finger, at, &["model.fpm", "not a model of this finger"]);
    assert_eq!(fs::read(at.join("model.fpm")).unwrap(), SHIPPED);
    // A response of the finite elements took longer than eval's.
    refused(&["eval", "--path", "p.csv", "--out", "s.csv"], at, &["--out s.csv", "--force"]);
    write(at, "kept.partial.csv", "mine\n");
    refused(&[commands[1].1, &["--out", "kept.csv"]].concat(), at, &["kept.partial.csv"]);
    write(at, "kept.checkpoint", "mine\n");
    fs::remove_file(at.join("kept.partial.csv")).unwrap();
    refused(&[commands[1].1, &["--out", "kept.csv"]].concat(), at, &["kept.checkpoint"]);
}

#[test]
fn meshes_and_volumes_replace_only_their_like() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let theirs = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 0\n$EndEntities\n";
    for (own, foreign, command) in [
        ("m.vtu", "<VTKFile type=\"UnstructuredGrid\">\n", &["mesh", "--mesh-preset", "coarse"][..]),
        ("m.msh", theirs, &["mesh", "--mesh-preset", "coarse"]),
        ("m.inp", "*HEADING\ntheirs\n", &["mesh", "--mesh-preset", "coarse"]),
        ("v.nrrd", "NRRD0004\n# a scan\n", &["phantom", "--voxels", "64", "24", "24"]),
        ("v.nii", "\\\u{1}\0\0 a scan", &["phantom", "--voxels", "64", "24", "24"]),
        ("v.nii.gz", "a scan", &["phantom", "--voxels", "64", "24", "24"]),
    ] {
        let all = [command, &["--out", own]].concat();
        write(at, own, foreign);
        refused(&all, at, &[&format!("--out {own}"), "--force"]);
        assert_eq!(fs::read_to_string(at.join(own)).unwrap(), foreign);
        for more in [&["--force"][..], &[]] {
            let (code, _, stderr) = run(&[&all[..], more].concat(), at);
            assert_eq!(code, Some(0), "{own}: {stderr}");
        }
    }
}

/// Runs with a text on standard input.
fn piped(arguments: &[&str], at: &Path, text: &str) -> (Option<i32>, String, String) {
    let mut child = crate::common::fingerpad(arguments, at).stdin(std::process::Stdio::piped()).spawn().unwrap();
    std::io::Write::write_all(&mut child.stdin.take().unwrap(), text.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    let [stdout, stderr] = [output.stdout, output.stderr].map(|b| String::from_utf8(b).unwrap());
    (output.status.code(), stdout, stderr)
}

#[test]
#[cfg(unix)]
fn a_dash_stands_for_standard_input_and_output() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let path = press_and_slide(0.2, &[]);
    write(at, "p.csv", &path);
    write(at, "c.toml", COARSE);
    let names = || {
        let mut names: Vec<_> = fs::read_dir(at).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        names
    };
    for command in [&["eval"][..], &["simulate", "--config", "c.toml"]] {
        assert_eq!(run(&[command, &["--path", "p.csv", "--out", "r.csv", "--force"]].concat(), at).0, Some(0));
        let wanted = fs::read_to_string(at.join("r.csv")).unwrap();
        let before = names();
        let (code, stdout, stderr) = piped(&[command, &["--path", "-", "--out", "-"]].concat(), at, &path);
        assert_eq!(code, Some(0), "{stderr}");
        assert!(stdout == wanted && stderr.contains("-: "), "{stdout}{stderr}");
        assert_eq!(names(), before, "a file for the dash, or one kept of the run");
    }
    let (code, stdout, _) = run(&["export", "--format", "c", "--out", "-"], at);
    assert!(code == Some(0) && stdout.starts_with("/* A fingerpad model"), "{stdout}");
    let measured = include_str!("../../data/examples/measured.csv");
    let (code, stdout, stderr) = piped(&["eval", "--runs", "-", "--out", "-"], at, measured);
    assert!(code == Some(0) && stdout.starts_with("run_id,"), "{stderr}");
    refused(&["reduce", "--out", "-"], at, &["--out -", "standard output"]);
}

#[test]
fn rows_kept_of_a_failed_run_go_once_a_run_reaches_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, "c.toml", COARSE);
    write(at, "hard.toml", &(COARSE.to_owned() + "[numerics.solver]\nmax_iterations = 1\n"));
    write(at, "p.csv", &press_and_slide(0.2, &[]));
    let simulate = |config| run(&["simulate", "--path", "p.csv", "--config", config, "--out", "r.csv"], at).0;
    assert_eq!(simulate("hard.toml"), Some(3));
    assert!(at.join("r.partial.csv").exists());
    assert_eq!(simulate("c.toml"), Some(0));
    assert!(at.join("r.csv").exists() && !at.join("r.partial.csv").exists());
}

/// Rows of a logger at 1 kHz cost a step each, also over many minutes; only motion between rows is limited.
#[test]
fn a_path_of_many_rows_is_followed() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut text = format!("{HEAD}\n0,0,0,0\n");
    for k in 1..1_100_000 {
        let depth = (f64::from(k) / 1e3).min(1.0);
        text += &format!("{},{depth},0,0\n", f64::from(k) / 1e3);
    }
    write(at, "p.csv", &text);
    eval(&["--path", "p.csv", "--out", "r.csv"], at);
    assert_eq!(fs::read_to_string(at.join("r.csv")).unwrap().lines().count(), 1_100_001);
}
