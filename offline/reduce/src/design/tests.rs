use std::collections::{BTreeMap, BTreeSet};

use fingerpad_fe::contact::RubberFriction;
use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{BoneKind, Finger, Tissue};
use fingerpad_fe::mesh::{self, FingertipShape, MeshPreset};

use super::*;

fn default_design() -> Vec<Experiment> {
    design(&DesignSettings::default().beyond_springs()).unwrap()
}

#[test]
fn enough_is_held_out_and_no_path_is_on_both_sides() {
    let all = default_design();
    let names: BTreeSet<_> = all.iter().map(|e| e.name.clone()).collect();
    assert_eq!(names.len(), all.len());
    let mut held_out = BTreeMap::new();
    for e in all.iter().filter(|e| e.held_out) {
        *held_out.entry(e.kind).or_insert(0) += 1;
        assert!(all.iter().all(|other| other.held_out || other.path != e.path), "{}", e.name);
    }
    assert!(held_out.values().sum::<i32>() >= 60 && held_out.len() == Kind::ALL.len(), "{held_out:?}");
}

#[test]
fn ranges_are_filled() {
    let settings = DesignSettings::default();
    let all = default_design();
    for held_out in [false, true] {
        let half = || all.iter().filter(move |e| e.held_out == held_out && e.kind.is_for_springs());
        let by_depth = half().filter(|e| e.path.drives[0] == Drive::Displacement);
        let deepest = by_depth.flat_map(|e| &e.path.waypoints).map(|p| p.normal).fold(0.0, f64::max);
        let most = settings.depth_mm[1];
        assert!(deepest > 0.92 * most && deepest <= 1.1 * most, "{deepest}");
        let deep = all.iter().filter(|e| e.kind == Kind::Deep && e.held_out == held_out);
        let deepest = |e: &Experiment| e.path.waypoints.iter().map(|p| p.normal).fold(0.0, f64::max);
        let deepest: Vec<f64> = deep.map(deepest).collect();
        assert!(deepest.iter().any(|&d| d > 4.5) && deepest.iter().all(|&d| d > 1.0), "{deepest:?}");
        let mut quadrants = [0; 4];
        for e in half().filter(|e| e.kind == Kind::Straight) {
            let end = e.path.waypoints[e.path.waypoints.len() - 1];
            quadrants[usize::from(end.x < 0.0) + 2 * usize::from(end.y < 0.0)] += 1;
        }
        assert!(quadrants.iter().all(|&n| n >= 2), "{quadrants:?}");
        let spread = |what: &str, values: Vec<f64>, [least, most]: [f64; 2]| {
            let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(l, h), &v| (l.min(v), h.max(v)));
            assert!(low >= least && high <= most, "{what}: {low} to {high}");
            assert!(high - low > 0.7 * (most - least), "{what}: {low} to {high} of {least} to {most}");
        };
        let turn = |of: &dyn Fn(&Path) -> Option<Vec<f64>>| half().filter_map(|e| of(&e.path)).flatten().collect();
        spread("pitch", turn(&|p| Some(p.turns.pitch.as_ref()?.values.clone())), settings.wide_pitch_deg);
        spread("roll", turn(&|p| Some(p.turns.roll.as_ref()?.values.clone())), settings.wide_roll_deg);
        let by_force = half().filter(|e| e.path.drives[0] == Drive::Force);
        let forces = by_force.flat_map(|e| &e.path.waypoints[1..]).map(|p| p.normal).collect();
        spread("normal force", forces, settings.normal_force_n);
        let spins: Vec<f64> = turn(&|p| Some(p.turns.spin.as_ref()?.values.clone()));
        assert!(spins.iter().any(|&s| s > 15.0) && spins.iter().any(|&s| s < -15.0), "{spins:?}");
    }
    for e in &all {
        assert!(e.path.waypoints.windows(2).all(|pair| pair[1].t_s > pair[0].t_s), "{}", e.name);
    }
}

/// On each path of combined motion two or more coordinates change after the press. Each body is touched in a constant and in changing
/// poses.
#[test]
fn combined_motions_and_bodies_are_varied() {
    let all = default_design();
    for e in all.iter().filter(|e| e.kind == Kind::Combined) {
        let rows = || 1..e.path.waypoints.len();
        let at = |row| e.path.coordinates(row, 30.0);
        let changes = |k: usize| rows().any(|row| at(row)[k] != at(1)[k]);
        assert!((0..6).filter(|&k| changes(k)).count() >= 2, "{}", e.name);
    }
    let mut poses = BTreeMap::new();
    for e in all.iter().filter(|e| e.kind == Kind::Body) {
        assert!(e.held_out && !e.body.is_plane() && e.body.read().is_ok(), "{}", e.name);
        poses.entry(format!("{:?}", e.body)).or_insert_with(Vec::new).push(e.path.turns.pitch.is_some());
    }
    assert_eq!(poses.len(), 6);
    assert!(poses.values().all(|has_pose| *has_pose == [false, true]), "{poses:?}");
}

/// Every amplitude is combined with every slide, in both halves, and shares press and slide with the other three amplitudes.
#[test]
fn vibrations_combine_amplitudes_and_slides() {
    let all = default_design();
    for held_out in [false, true] {
        let mut met = BTreeSet::new();
        for e in all.iter().filter(|e| e.kind == Kind::Vibration && e.held_out == held_out) {
            let [held, up] = [2, 3].map(|k| e.path.waypoints[k]);
            let share = held.x.hypot(held.y) / DesignSettings::default().slip_slide_mm(held.normal);
            let state = if share < 0.1 {
                "stick"
            } else if share < 0.9 {
                "partial slip"
            } else {
                "slip"
            };
            let amplitude_um = (1e3 * (up.normal - held.normal)).round() as i32;
            let of_depth = (100.0 * (up.normal - held.normal) / held.normal).round() as i32;
            let amplitude = [1, 10, 100].into_iter().find(|&a| a == amplitude_um).unwrap_or(-of_depth);
            assert!(amplitude > 0 || amplitude == -10, "{}: {amplitude_um} um", e.name);
            met.insert((state, amplitude));
        }
        assert_eq!(met.len(), 12, "{met:?}");
    }
    let batches = batches(&all);
    let vibrating = batches.iter().filter(|b| b.experiments[0].kind == Kind::Vibration);
    assert!(vibrating.clone().all(|b| b.experiments.len() == 4 && b.common == 3));
    assert_eq!(vibrating.count(), 12);
}

#[test]
fn the_design_follows_from_its_seed() {
    let of_seed = |seed| design(&DesignSettings { seed, ..DesignSettings::default() }).unwrap();
    assert_eq!(of_seed(7), of_seed(7));
    let (a, b) = (of_seed(7), of_seed(8));
    assert_eq!(a.len(), b.len());
    let drawn = |e: &&Experiment| e.kind != Kind::Straight;
    for e in a.iter().filter(drawn) {
        assert!(b.iter().filter(drawn).all(|other| other.path != e.path), "{}", e.name);
    }
}

/// The paths of the stored runs agree with the default design, so that the program finds these runs.
#[test]
fn stored_runs_are_of_this_design() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("data/runs");
    let mut all = default_design();
    // Runs on bodies and of combined motion for the pad, from another part of the sequence.
    let mut settings = DesignSettings { seed: 1, ..DesignSettings::default() };
    (settings.paths.combined, settings.paths.body) = ([12, 0], [18, 0]);
    let more = design(&settings).unwrap();
    all.extend(more.into_iter().filter(|e| matches!(e.kind, Kind::Combined | Kind::Body)));
    let mut found = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let file = entry.unwrap().path();
        if file.extension().is_none_or(|e| e != "fprun") {
            continue;
        }
        let run = crate::Run::from_bytes(&std::fs::read(&file).unwrap(), &file).unwrap();
        let experiment = all.iter().find(|e| e.name == run.name).unwrap();
        assert_eq!(experiment.path, run.path, "{}", run.name);
        assert!(!all.iter().any(|e| e.held_out != run.held_out && e.path == run.path), "{}", run.name);
        found += 1;
    }
    assert!(found >= 160, "{found}");
}

#[test]
fn the_finger_that_ships_can_follow_every_path() {
    let config = Config { mesh_preset: MeshPreset::Coarse, ..Config::default() };
    let (finger, _) = config.finger().unwrap();
    for seed in 0..5 {
        for e in design(&DesignSettings { seed, ..DesignSettings::default().beyond_springs() }).unwrap() {
            config.check_path(&e.path, &finger).unwrap_or_else(|error| panic!("seed {seed}: {}: {error}", e.name));
        }
    }
}

/// A dome on a fixed core.
fn dome(radius_mm: f64, core_mm: f64) -> Finger {
    let shape = FingertipShape::dome(radius_mm, core_mm, 2.0 * radius_mm).unwrap();
    Finger::new(mesh::fingertip(&shape, &MeshPreset::Coarse.divisions()).unwrap(), &fixed_core()).unwrap()
}

fn fixed_core() -> Tissue {
    let mut tissue = Tissue::default();
    tissue.bone.kind = BoneKind::Fixed;
    tissue
}

/// The paths follow the tip: none leads to a support, and the deepest uses a good part of the layer.
#[test]
fn every_tip_can_follow_its_paths() {
    for [radius_mm, core_mm] in [[5.0, 2.5], [12.0, 7.0], [20.0, 12.0]] {
        let finger = dome(radius_mm, core_mm);
        let tip = Tip::of(&finger, &fixed_core(), &RubberFriction::coulomb(0.5, 0.006)).unwrap();
        let deepest = tip.deepest_mm / (radius_mm - core_mm);
        assert!((0.1..=0.56).contains(&deepest), "{radius_mm} {core_mm}: {deepest}");
        let config = Config { mesh_preset: MeshPreset::Coarse, ..Config::default() };
        let all = design(&DesignSettings::default().for_tip(tip.clone()).beyond_springs()).unwrap();
        let mut pressed: f64 = 0.0;
        for e in &all {
            config.check_path(&e.path, &finger).unwrap_or_else(|error| panic!("{radius_mm} {}: {error}", e.name));
            if e.path.drives[0] == Drive::Displacement {
                pressed = e.path.waypoints.iter().map(|p| p.normal).fold(pressed, f64::max);
            }
        }
        assert!(pressed > 0.8 * tip.deepest_mm && pressed <= tip.deepest_mm + 1e-9, "{pressed} of {}", tip.deepest_mm);
    }
}

/// The design of the shipped finger, whose runs are stored, is that of its own tip. Lengths that a file states are kept.
#[test]
fn the_finger_that_ships_has_the_default_design() {
    let config = Config { mesh_preset: MeshPreset::Coarse, ..Config::default() };
    let tip = Tip::of(&config.finger().unwrap().0, &config.tissue, &config.friction).unwrap();
    let settings = DesignSettings::default().beyond_springs();
    let (own, default) = (design(&settings.clone().for_tip(tip.clone())).unwrap(), design(&settings).unwrap());
    own.iter().zip(&default).for_each(|(own, default)| assert_eq!(own, default, "{tip:?}"));
    let mut small = tip;
    small.length = 0.5;
    assert_ne!(design(&settings.clone().for_tip(small.clone())).unwrap(), design(&settings).unwrap());
    let stated = DesignSettings { deep_mm: [2.6, 4.0], ..settings };
    assert_eq!(design(&stated.clone().for_tip(small)).unwrap(), design(&stated).unwrap());
}

#[test]
fn settings_that_make_no_design_are_refused_by_name_and_value() {
    let refused = |change: &dyn Fn(&mut DesignSettings), parts: [&str; 2]| {
        let mut settings = DesignSettings::default();
        change(&mut settings);
        let message = design(&settings).expect_err(parts[0]).to_string();
        assert!(message.starts_with(parts[0]) && message.contains(parts[1]), "{message}");
    };
    refused(&|s| s.depth_mm = [0.05, 2.5], ["design.depth_mm = [0.05, 2.5]: ", "0.15"]);
    refused(&|s| s.depth_mm = [1.0, f64::NAN], ["design.depth_mm = [1.0, NaN]: ", "finite"]);
    refused(&|s| s.depth_mm = [2.0, 1.0], ["design.depth_mm = [2.0, 1.0]: ", "[least, largest]"]);
    refused(&|s| s.depth_mm = [0.3, 2.0], ["design.axis_depths_mm = [0.3, ", "depth_mm [0.3, 2.0]"]);
    refused(&|s| s.axis_depths_mm = vec![f64::NAN], ["design.axis_depths_mm = [NaN]", "depth_mm"]);
    refused(&|s| s.slide_mm = 0.0, ["design.slide_mm = 0: ", "above 0"]);
    refused(&|s| s.spin_deg = f64::INFINITY, ["design.spin_deg = inf: ", "finite"]);
    refused(&|s| s.pitch_deg = [5.0, 50.0], ["design.pitch_deg = [5.0, 50.0]: ", "10 and 70"]);
    refused(&|s| s.roll_deg = [-15.0, 31.0], ["design.roll_deg = [-15.0, 31.0]: ", "-30 and 30"]);
    refused(&|s| s.normal_force_n = [0.0, 1.0], ["design.normal_force_n = [0.0, 1.0]: ", "above 0"]);
    refused(&|s| s.pose_depth_max_mm = 3.0, ["design.pose_depth_max_mm = 3: ", "depth_mm"]);
    refused(&|s| s.seed = 1 << 40, ["design.seed = 1099511627776: ", "4294967295"]);
    refused(&|s| s.paths.spin = [4, 2000], ["design.paths.spin = [4, 2000]: ", "at most 1000"]);
}
