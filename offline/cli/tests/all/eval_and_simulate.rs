//! `eval` and `simulate` follow the same paths and write the same columns; an output replaces only its own kind of file.

use std::fs;

use crate::common::{COARSE, Folder, MEASURED};
use crate::models::SHIPPED;
use fingerpad::host::ModelFile;
use fingerpad_fe::load_path::{self, Drive, Turn};
use fingerpad_reduce::{Kind, Run, Sample, replay};

const HEAD: &str = "t_s,depth_mm,slide_x_mm,slide_y_mm";
/// `eval` along `p.csv`.
const EVAL: &str = "eval --path p.csv --out r.csv";

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
    let folder = crate::common::package().join("data/runs");
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
    let folder = Folder::new();
    let file = ModelFile::new(SHIPPED).unwrap();
    let precise = file.file().model.data().cast::<f64>();
    let mut compared = 0;
    let mut from_finite_elements = Vec::new();
    for kind in [Kind::Spin, Kind::SpinSlide, Kind::SpinReversal] {
        let runs = stored(kind);
        for stored in runs.iter().take(5) {
            let (fine, corners) = finely(stored);
            let replayed = replay(&precise.model().unwrap(), &fine);
            folder.write("p.csv", path_csv(&stored.path));
            folder.done(EVAL);
            let column = |name| folder.column("r.csv", name);
            let found = |name, row: usize| column(name)[row];
            let friction = |[x, y]: [f64; 2]| x.hypot(y);
            let largest = replayed.iter().map(|r| friction(r.friction_n)).fold(0.0, f64::max);
            let largest_normal = replayed.iter().map(|r| r.normal_force_n).fold(0.0, f64::max);
            let scale = largest.max(0.3 * largest_normal);
            for (w, corner) in stored.path.waypoints.iter().zip(corners) {
                let row = column("t_s").iter().position(|t| *t == w.t_s).unwrap();
                let r = &replayed[corner];
                let [x, y] = r.friction_n;
                for (name, wanted, scale) in [
                    ("normal_force_n", r.normal_force_n, largest_normal),
                    ("friction_x_n", x, scale),
                    ("friction_y_n", y, scale),
                    ("spin_moment_n_mm", r.spin_moment_n_mm, 3.0 * scale),
                ] {
                    let found = found(name, row);
                    let apart = (found - wanted).abs() / scale;
                    assert!(apart < 2e-3, "{} t {}: {name} {found}, replay {wanted}", stored.name, w.t_s);
                    compared += 1;
                }
                let pose = fine.samples[corner].turned.unwrap();
                for (name, wanted) in
                    [("spin_deg", pose.spin_deg), ("pitch_deg", pose.pitch_deg), ("roll_deg", pose.roll_deg)]
                {
                    assert!((found(name, row) - f64::from(wanted)).abs() < 1e-3, "{}: {name}", stored.name);
                }
                // The finite elements' row at the same time.
                let sample = stored.samples.iter().find(|s| (f64::from(s.t_s) - w.t_s).abs() < 1e-5).unwrap();
                let [x, y] = sample.friction_n.map(f64::from);
                let apart = (found("friction_x_n", row) - x).hypot(found("friction_y_n", row) - y);
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
    let folder = Folder::new();
    let last = |name: &str| folder.last("r.csv", name);
    let mut forces = Vec::new();
    for pitch in [12.0, 20.0, 30.0, 40.0, 50.0] {
        folder.write("p.csv", press_and_slide(1.0, &[("pitch_deg", pitch)]));
        let (_, printed) = folder.done(EVAL);
        let by_pad = printed.contains("fingertip-pad.fpm (shipped): the path leaves the pose");
        assert_eq!((by_pad, printed.lines().count()), (pitch != 30.0, usize::from(by_pad)), "{printed}");
        assert_eq!((last("pitch_deg"), last("roll_deg")), (pitch, 0.0));
        forces.push([last("normal_force_n"), last("friction_x_n")]);
    }
    for pair in forces.windows(2) {
        assert!((pair[0][1] / pair[1][1] - 1.0).abs() > 0.002, "{forces:?}");
    }
    // The pose that the model was fitted in changes nothing.
    folder.write("p.csv", press_and_slide(1.0, &[]));
    folder.done(EVAL);
    assert!((last("friction_x_n") / forces[2][1] - 1.0).abs() < 1e-4, "{forces:?}");
    assert_eq!(last("pitch_deg"), 30.0);

    folder.write("p.csv", format!("{HEAD},spin_deg\n0,0,0,0,0\n0.5,1,0,0,0\n1,1,0,0,6\n"));
    folder.done(EVAL);
    assert!(last("spin_moment_n_mm") > 0.1);
}

/// Pressed fast and held: the force falls as its branches do, along the path and on a ball; bad branches are refused by value.
#[test]
fn tissue_that_relaxes_is_followed_in_time() {
    let folder = Folder::with(&[("p.csv", &format!("{HEAD}\n0,0,0,0\n0.002,1,0,0\n20,1,0,0\n"))]);
    for body in ["", " --body sphere --radius-mm 15"] {
        let (_, printed) = folder.done(&format!("{EVAL} --force --relaxation 1:0.07,0.5:1.4{body}"));
        assert_eq!(printed.contains("requires a pad"), !body.is_empty(), "{printed}");
        let [time, force] = ["t_s", "normal_force_n"].map(|name| folder.column("r.csv", name));
        let last = force.last().unwrap();
        for t_s in [0.002, 0.02, 0.1, 0.5, 2.0, 8.0] {
            let row = time.iter().position(|t| *t >= t_s).unwrap();
            let since = time[row] - 0.001;
            let exact = 1.0 + (-since / 0.07).exp() + 0.5 * (-since / 1.4).exp();
            assert!(
                (force[row] / last / exact - 1.0).abs() < 0.02,
                "{body}: {} s: {} {exact}",
                time[row],
                force[row] / last
            );
        }
    }
    let (_, printed) = folder.done(&format!("{EVAL} --force --relaxation human-assumed"));
    assert!(printed.contains("shares 1, 0.6, 0.6 are assumed"), "{printed}");
    // A bed's file with branches, in the place of others or of none; commands that do not follow the tissue refuse it by the section's name.
    folder.write("soft.fpm", crate::models::made("soft.fpm"));
    folder.write("effect.fpm", crate::models::made("relaxing_effect.fpm"));
    let soft = EVAL.to_owned() + " --force --model soft.fpm";
    let (_, printed) = folder.done(&soft);
    assert!(printed.contains("shares 1, 0.6, 0.6 are assumed"), "{printed}");
    let force = folder.column("r.csv", "normal_force_n");
    let peak = force.iter().copied().fold(0.0, f64::max);
    assert!(peak > 2.5 * force.last().unwrap(), "{peak}");
    folder.done(&format!("{soft} --relaxation none"));
    let relaxed = folder.column("r.csv", "normal_force_n");
    assert!((relaxed.last().unwrap() / force.last().unwrap() - 1.0).abs() < 1e-4);
    folder.write("log.csv", "t_s,normal_force_n,friction_x_n,friction_y_n,slide_x_mm,slide_y_mm\n0,0,0,0,0,0\n");
    folder.write("c.csv", crate::common::CALIBRATION);
    folder.write("m.csv", crate::common::MEASURED);
    // Measured runs, as the corrected model of a diagnosis predicts them: pressed within a second, half of the stiffness has not relaxed.
    let predicted = |model: &str| {
        folder.done(&format!("eval {model} --runs m.csv --out o.csv --force"));
        folder.column("o.csv", "normal_force_n").into_iter().fold(0.0, f64::max)
    };
    let (stiff, relaxed) = (predicted("--model soft.fpm"), predicted(""));
    assert!(stiff > 1.3 * relaxed, "{stiff} {relaxed}");
    for line in [
        "eval --model soft.fpm --observe log.csv --out o.csv",
        "export --model soft.fpm --format c --out w.h",
        "export --model soft.fpm --format fmu --out w.fmu",
        "diagnose runs --calibration c.csv --measured m.csv --model soft.fpm --out d",
    ] {
        folder.refused(line, &["RELX"]);
    }
    let effect = EVAL.to_owned() + " --force --model effect.fpm --relaxation human-assumed";
    folder.refused(&effect, &["relax twice", "normal_relaxation"]);
    for (branches, words) in [
        ("1:0", "time 0 s of branch 1"),
        ("1:1,-0.5:1", "share -0.5 of branch 2"),
        ("1", "`1`: expected"),
        ("1:1,1:1,1:1,1:1", "4 branches, at most 3"),
    ] {
        folder.refused(&format!("{EVAL} --force --relaxation={branches}"), &[words]);
    }
}

/// A ball off the middle of the finger spins about its own apex, in both programs. One that went round the finger would be on the other
/// side after half a turn, and the centre of pressure with it: by more than 2 mm.
#[test]
fn a_ball_spins_about_its_own_apex() {
    let path = format!("{HEAD},spin_deg\n0,0,0,0,0\n1,0.8,0,0,0\n2,0.8,1.2,0,0\n3,0.8,1.2,0,90\n4,0.8,1.2,0,180\n");
    let folder = Folder::with(&[("p.csv", &path)]);
    let body = "--path p.csv --out r.csv --force --body sphere --radius-mm 10";
    let centres = ["simulate --mesh-preset coarse", "eval"].map(|program| {
        folder.done(&format!("{program} {body}"));
        let (time, force, centre) = (
            folder.column("r.csv", "t_s"),
            folder.column("r.csv", "normal_force_n"),
            folder.column("r.csv", "cop_x_mm"),
        );
        let [slid, half, turned] = [2.0, 3.0, 4.0].map(|t| time.iter().position(|x| *x == t).unwrap());
        for row in [half, turned] {
            assert!((force[row] / force[slid] - 1.0).abs() < 0.05, "{program}: {} N, {} N", force[slid], force[row]);
            assert!((centre[row] - centre[slid]).abs() < 0.8, "{program}: {} mm, {} mm", centre[slid], centre[row]);
        }
        assert!(folder.last("r.csv", "spin_moment_n_mm") > 0.1);
        centre[turned]
    });
    assert!((centres[0] - centres[1]).abs() < 0.8, "{centres:?}");
}

#[test]
fn the_columns_are_those_of_simulate_and_seven_more() {
    let folder = Folder::with(&[("c.toml", COARSE)]);
    folder.write("p.csv", format!("{HEAD},pitch_deg\n0,0,0,0,35\n1,0.2,0,0,35\n"));
    folder.done("simulate --path p.csv --config c.toml --out s.csv");
    folder.done(EVAL);
    let head = |name: &str| folder.text(name).lines().next().unwrap().to_owned();
    assert_eq!(
        head("r.csv"),
        head("s.csv")
            + ",friction_limit_n,slip_margin,band_normal_n,band_friction_n,tangential_friction_x_n,tangential_friction_y_n,\
               slip_margin_relaxed"
    );
}

/// Temperature: 3 % less strength for each degree below 32.
#[test]
fn effects_act_under_a_spin() {
    let folder = Folder::with(&[("p.csv", &press_and_slide(1.0, &[("spin_deg", 0.0)]))]);
    folder.write("warm.fpm", crate::models::made("warm.fpm"));
    let [plain, warm, cold] = ["", "--model warm.fpm", "--model warm.fpm --temperature-c 29"].map(|options| {
        folder.done(&format!("{EVAL} --force {options}"));
        folder.last("r.csv", "friction_x_n")
    });
    assert!((warm / plain - 1.0).abs() < 1e-4 && (cold / plain - 0.91).abs() < 5e-3, "{plain} {warm} {cold}");
}

#[test]
fn an_output_replaces_only_what_the_same_command_wrote() {
    replaces_only_its_own(&[
        ("r.csv", "eval --path p.csv"),
        ("s.csv", SIMULATE),
        ("m.rs", "export --format rust"),
        ("m.json", "export --format json"),
        ("", "finger bed"),
    ]);
}

/// The gate compiles no co-simulation unit.
#[test]
#[ignore = "nightly"]
fn a_unit_replaces_only_a_unit() {
    replaces_only_its_own(&[("m.fmu", "export --format fmu")]);
}

const SIMULATE: &str = "simulate --path p.csv --config c.toml";

fn replaces_only_its_own(commands: &[(&str, &str)]) {
    let folder = Folder::with(&[
        ("p.csv", &press_and_slide(0.2, &[])),
        ("c.toml", COARSE),
        ("README.md", "mine\n"),
        ("measured.csv", "run_id,t_s\na,0\n"),
    ]);
    folder.write("model.fpm", SHIPPED);
    for &(own, command) in commands {
        for foreign in ["model.fpm", "README.md", "measured.csv", "p.csv"] {
            let before = folder.bytes(foreign);
            folder.refused(&format!("{command} --out {foreign}"), &[&format!("--out {foreign}")]);
            assert_eq!(folder.bytes(foreign), before, "{command} {foreign}");
        }
        if own.is_empty() {
            continue;
        }
        // Its own file, an empty one, and, with --force, a file of another command.
        for (content, more) in [(None, ""), (None, ""), (Some(""), ""), (Some("mine\n"), "--force")] {
            content.into_iter().for_each(|content| folder.write(own, content));
            folder.done(&format!("{command} --out {own} {more}"));
            assert!(folder.bytes(own).len() > 100, "{own}");
        }
        // The input is never overwritten.
        if command.contains("p.csv") {
            folder.refused(&format!("{command} --out p.csv --force"), &["would overwrite p.csv"]);
        }
    }
}

#[test]
fn a_file_of_another_finger_or_of_a_slower_command_stays() {
    let folder = Folder::with(&[("p.csv", &press_and_slide(0.2, &[])), ("c.toml", COARSE)]);
    folder.write("model.fpm", SHIPPED);
    let finger = "finger --mesh-preset coarse --estimate --out .";
    folder.refused(finger, &["model.fpm", "not a model of this finger"]);
    assert_eq!(folder.bytes("model.fpm"), SHIPPED);
    // A response of the finite elements took longer than eval's.
    folder.done(&format!("{SIMULATE} --out s.csv"));
    folder.refused("eval --path p.csv --out s.csv", &["--out s.csv", "--force"]);
    for kept in ["kept.partial.csv", "kept.checkpoint"] {
        folder.write(kept, "mine\n");
        folder.refused(&format!("{SIMULATE} --out kept.csv"), &[kept]);
        fs::remove_file(folder.path(kept)).unwrap();
    }
}

#[test]
fn meshes_and_volumes_replace_only_their_like() {
    let folder = Folder::new();
    let theirs = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 0\n$EndEntities\n";
    let (mesh, phantom) = ("mesh --mesh-preset coarse", "phantom --voxels 64 24 24");
    for (own, foreign, command) in [
        ("m.vtu", "<VTKFile type=\"UnstructuredGrid\">\n", mesh),
        ("m.msh", theirs, mesh),
        ("m.inp", "*HEADING\ntheirs\n", mesh),
        ("v.nrrd", "NRRD0004\n# a scan\n", phantom),
        ("v.nii", "\\\u{1}\0\0 a scan", phantom),
        ("v.nii.gz", "a scan", phantom),
    ] {
        let line = format!("{command} --out {own}");
        folder.write(own, foreign);
        folder.refused(&line, &[&format!("--out {own}"), "--force"]);
        assert_eq!(folder.text(own), foreign);
        folder.done(&format!("{line} --force"));
        folder.done(&line);
    }
}

#[test]
#[cfg(unix)]
fn a_dash_stands_for_standard_input_and_output() {
    let path = press_and_slide(0.2, &[]);
    let folder = Folder::with(&[("p.csv", &path), ("c.toml", COARSE)]);
    for command in ["eval", "simulate --config c.toml"] {
        folder.done(&format!("{command} --path p.csv --out r.csv --force"));
        let before = folder.names("");
        let (code, stdout, stderr) = folder.piped(&format!("{command} --path - --out -"), &path);
        assert_eq!(code, Some(0), "{stderr}");
        assert!(stdout == folder.text("r.csv") && stderr.contains("-: "), "{stdout}{stderr}");
        assert_eq!(folder.names(""), before, "a file for the dash, or one kept of the run");
    }
    let (code, stdout, stderr) = folder.piped("eval --runs - --out -", MEASURED);
    assert!(code == Some(0) && stdout.starts_with("run_id,"), "{stderr}");
}

/// Rows of a logger at 1 kHz cost a step each, also over many minutes; only motion between rows is limited.
#[test]
#[ignore = "nightly"]
fn a_path_of_many_rows_is_followed() {
    let rows = (1..1_100_000).map(|k| f64::from(k) / 1e3).map(|t| format!("{t},{},0,0\n", t.min(1.0)));
    let folder = Folder::with(&[("p.csv", &(format!("{HEAD}\n0,0,0,0\n") + &rows.collect::<String>()))]);
    folder.done(EVAL);
    assert_eq!(folder.text("r.csv").lines().count(), 1_100_001);
}

#[test]
fn a_log_with_the_share_that_sticks_tells_more() {
    let folder = Folder::new();
    let log = fs::read_to_string(crate::common::package().join("data/examples/margin-log.csv")).unwrap();
    let with = |cell: &dyn Fn(f64) -> f64| {
        let mut lines = log.lines();
        let first = format!("{},stick_ratio\n", lines.next().unwrap());
        let t_s = |line: &str| line.split(',').next().unwrap().parse().unwrap();
        lines.fold(first, |text, line| text + line + &format!(",{}\n", cell(t_s(line))))
    };
    // The log is a pull from 0.2 s on, near full slip at its end.
    let falls = |t_s: f64| 1.0 - 0.9 * ((t_s - 0.2).max(0.0) / 1.2).powf(1.3);
    folder.write("log.csv", &log);
    folder.write("skin.csv", with(&falls));
    folder.write("broken.csv", with(&|_| f64::NAN));
    folder.done("eval --observe log.csv --out without.csv");
    folder.done("eval --observe skin.csv --out with.csv");
    folder.done("eval --observe skin.csv --stick-noise 10 --out hardly.csv");
    let width = |file: &str| {
        let [low, high] = ["strength_low", "strength_high"].map(|name| folder.column(file, name)[160]);
        assert!(low < 1.0 && 1.0 < high, "{file}: {low} to {high}");
        (high / low).ln()
    };
    assert!(width("with.csv") < 0.7 * width("without.csv"), "{} {}", width("with.csv"), width("without.csv"));
    assert!((width("hardly.csv") / width("without.csv") - 1.0).abs() < 0.05);
    folder.refused("eval --observe broken.csv --out o.csv", &["stick_ratio", "NaN"]);
    folder.refused("eval --observe skin.csv --stick-noise 0 --out o.csv", &["--stick-noise 0"]);
}
