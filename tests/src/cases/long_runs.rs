//! Runs that are interrupted, saved, resumed, or driven beyond the limits of the model.

use std::ops::ControlFlow;
use std::time::Duration;

use crate::problems::fingers::{finger, path, placed, problem};
use fingerpad_fe::experiment::{Config, Experiment, press_to};
use fingerpad_fe::load_path::{
    BoneKind, Checkpoint, Clearance, Drive, Finger, LoadPathError, Obstacle, Path, Problem, RunOptions, Tissue,
    Trajectory, Turn, Turns, follow, follow_path,
};
use fingerpad_fe::mesh::{FingertipShape, MeshPreset, fingertip};

const D: Drive = Drive::Displacement;
const F: Drive = Drive::Force;

fn coarse() -> Finger {
    finger("e", MeshPreset::Coarse, BoneKind::Floating, 1.0).unwrap()
}

/// All numbers of a trajectory but its times, as text that also compares NaN.
fn numbers(trajectory: &Trajectory) -> String {
    let cost = &trajectory.cost;
    let counts = (cost.increments, cost.cutbacks, cost.iterations, cost.factorisations);
    format!("{:?} {:?} {counts:?} {:?}", trajectory.responses, trajectory.snapshots, trajectory.work)
}

/// Follows `path`, interrupted every so many calls of progress, that is at an increment's end or within one, and
/// resumed from the saved state.
fn in_pieces(problem: &Problem, path: &Path, file: &std::path::Path, calls: usize) -> (Trajectory, usize) {
    let checkpoint = Checkpoint { file, period: Duration::from_secs(1), key: "settings" };
    for stops in 0..500 {
        let mut left = calls;
        let options = RunOptions { snapshots: &[1, 2], checkpoint: Some(checkpoint), ..RunOptions::default() };
        let result = follow(problem, path, options, &mut |_| {
            left -= 1;
            if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        match result {
            Ok(end) => return (end.into_trajectory(), stops),
            Err(LoadPathError::Interrupted { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
    panic!("stopped 500 times and not at the end: it does not resume from the saved state")
}

pub fn a_run_that_was_stopped_and_resumed_finds_the_same_numbers_to_the_last_bit() {
    let finger = coarse();
    let problem = problem(&finger.body, &finger.mesh.pad_faces);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.checkpoint");
    for path in [
        placed(&[[0.0; 3], [0.8, 0.0, 0.0], [0.8, 1.0, 0.2], [0.4, 0.8, 0.2]]),
        path([F, F, D], &[[0.0; 3], [0.4, 0.0, 0.0], [0.4, 0.2, 0.0], [0.3, -0.1, 0.1]]),
    ] {
        // Calls within an increment: the number for the longest depends on the processor's rounding.
        let (mut increments, mut calls, mut longest) = (0, 0, 0);
        let whole = follow_path(&problem, &path, &[1, 2], &mut |progress| {
            calls = if progress.cost.increments == increments { calls + 1 } else { 1 };
            (increments, longest) = (progress.cost.increments, longest.max(calls));
            ControlFlow::Continue(())
        });
        let whole = whole.unwrap();
        // A piece must be longer than the longest increment, or the run does not go on.
        for calls in [longest + 2, 3 * longest / 2] {
            let (pieces, stops) = in_pieces(&problem, &path, &file, calls);
            assert!(stops >= 1);
            assert_eq!(numbers(&pieces), numbers(&whole));
            assert!(!file.exists(), "a run that has ended leaves no checkpoint");
        }
    }
}

pub fn a_checkpoint_of_another_run_is_not_used() {
    let finger = coarse();
    let problem = problem(&finger.body, &finger.mesh.pad_faces);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.checkpoint");
    let path = placed(&[[0.0; 3], [0.4, 0.0, 0.0]]);
    let until = |key, stop_at: u32| {
        let checkpoint = Checkpoint { file: &file, period: Duration::ZERO, key };
        let mut least = u32::MAX;
        let options = RunOptions { checkpoint: Some(checkpoint), ..RunOptions::default() };
        let result = follow(&problem, &path, options, &mut |progress| {
            least = least.min(progress.cost.increments);
            if progress.cost.increments >= stop_at { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        (result.is_ok(), least)
    };
    assert_eq!(until("a", 3), (false, 0));
    assert!(file.exists());
    assert_eq!(until("b", 1), (false, 0));
    assert_eq!(until("b", 2), (false, 1));
    std::fs::write(&file, b"cut off").unwrap();
    assert_eq!(until("b", 99), (true, 0));
}

pub fn progress_is_reported_and_an_interruption_acts_within_an_increment() {
    let finger = coarse();
    let problem = problem(&finger.body, &finger.mesh.pad_faces);
    let path = placed(&[[0.0; 3], [0.8, 0.0, 0.0]]);
    for stop_at in [1, 7, 40] {
        let mut calls = 0;
        let result = follow_path(&problem, &path, &[], &mut |_| {
            calls += 1;
            if calls >= stop_at { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let Err(LoadPathError::Interrupted { reached }) = result else { panic!("not stopped") };
        assert_eq!(calls, stop_at, "nothing is computed after a stop");
        // Many calls to an increment: an increment of the coarse mesh takes some tenths of a second.
        assert!(reached.responses.len() <= 1 + stop_at / 4, "{} rows", reached.responses.len());
    }
}

pub fn a_driven_friction_beyond_the_limit_ends_soon_with_the_number() {
    let finger = coarse();
    let problem = problem(&finger.body, &finger.mesh.pad_faces);
    for path in [
        path([F, F, F], &[[0.0; 3], [0.3, 0.0, 0.0], [0.3, 5.0, 0.0]]),
        path([D, D, F], &[[0.0; 3], [0.8, 0.0, 0.0], [0.8, 0.0, -5.0]]),
    ] {
        let result = follow_path(&problem, &path, &[], &mut |_| ControlFlow::Continue(()));
        let error = result.unwrap_err();
        let text = error.to_string();
        let LoadPathError::BeyondFriction { wanted_n, holds_n, normal_force_n, reached, .. } = error else {
            panic!("{text}")
        };
        assert!(text.contains(&format!("beyond what friction holds here ({holds_n:.4} N at this load")), "{text}");
        assert!((wanted_n - 5.0).abs() < 0.01 && holds_n > normal_force_n && holds_n < 2.0 * normal_force_n, "{text}");
        let last = reached.responses.last().unwrap();
        let held = last.friction_x_n.hypot(last.friction_y_n);
        assert!(held > 0.9 * holds_n && held < 1.001 * holds_n, "{held} of {holds_n} N");
        assert!(reached.cost.iterations < 400, "{} iterations", reached.cost.iterations);
    }
}

pub fn a_driven_moment_beyond_the_limit_ends_soon_with_the_number() {
    let config = Config { mesh_preset: MeshPreset::Coarse, ..Config::default() };
    let (finger, _) = config.finger_for(&[&press_to(0.8)]).unwrap();
    let problem = config.problem(&finger);
    let with_moment = |drives, corners: &[[f64; 3]], moments: [f64; 3]| {
        let spin = Some(Turn { drive: F, values: moments.to_vec() });
        Path { turns: Turns { spin, ..Turns::default() }, ..path(drives, corners) }
    };
    let held = [[0.0; 3], [0.8, 0.0, 0.0], [0.8, 0.0, 0.0]];
    let mut limits = Vec::new();
    for (path, with_n) in [
        (with_moment([D, D, D], &held, [0.0, 0.0, 20.0]), 0.0),
        (with_moment([D, D, D], &held, [0.0, 0.0, -20.0]), 0.0),
        (with_moment([D, F, F], &held, [0.0, 0.0, 20.0]), 0.0),
        (with_moment([D, F, F], &[[0.0; 3], [0.8, 0.0, 0.0], [0.8, 3.0, -4.0]], [0.0, 0.0, 20.0]), 5.0),
    ] {
        let error = follow_path(&problem, &path, &[], &mut |_| ControlFlow::Continue(())).unwrap_err();
        let text = error.to_string();
        let LoadPathError::BeyondFrictionMoment { row: 2, wanted_n_mm, with_n: with, holds_n_mm, reached, .. } = error
        else {
            panic!("{text}")
        };
        assert_eq!((wanted_n_mm.abs(), with), (20.0, with_n), "{text}");
        assert!(
            text.contains(&format!("beyond what friction holds here ({holds_n_mm:.4} N mm at this load")),
            "{text}"
        );
        let last = reached.responses.last().unwrap();
        let reached_n_mm = last.moment_n_mm[2];
        assert!(
            reached_n_mm / holds_n_mm > 0.85 && reached_n_mm / holds_n_mm < 1.001,
            "{reached_n_mm} of {holds_n_mm} N mm"
        );
        assert!(
            reached.responses.len() > 10 && last.t_s > 1.0 && reached.cost.iterations < 800,
            "{}",
            reached.cost.iterations
        );
        limits.push(holds_n_mm);
    }
    // The same either way by symmetry; free to move aside the plane turns about the friction's own centre, on less moment;
    // a force takes some of it.
    assert!((limits[0] / limits[1] + 1.0).abs() < 0.02 && limits[2] < limits[0], "{limits:?}");
    assert!(limits[3] > 0.5 * limits[2] && limits[3] < 0.95 * limits[2], "{limits:?}");
}

pub fn a_force_driven_press_in_a_tilted_pose_has_the_pad_of_that_pose() {
    let config = Config { mesh_preset: MeshPreset::Coarse, ..Config::default() };
    for (pitch, roll, force_n) in [(60.0, 0.0, 1.0), (10.0, 0.0, 0.5)] {
        let turn = |value: f64| Some(Turn { drive: D, values: vec![value; 2] });
        let turns = Turns { pitch: turn(pitch), roll: turn(roll), spin: None };
        let path = Path { turns, ..path([F, D, D], &[[0.0; 3], [force_n, 0.0, 0.0]]) };
        let [of_neutral, of_pose] = [config.finger().unwrap().0, config.finger_for(&[&path]).unwrap().0];
        let run =
            |finger: &Finger| follow_path(&config.problem(finger), &path, &[], &mut |_| ControlFlow::Continue(()));
        let end = run(&of_pose).unwrap_or_else(|error| panic!("{pitch}, {roll}: {error}"));
        assert!((end.responses.last().unwrap().normal_force_n - force_n).abs() < 1e-4);
        let error = run(&of_neutral).unwrap_err();
        assert!(matches!(error, LoadPathError::BesidePad { .. }), "{error}");
        assert!(!error.to_string().contains("pad_height_mm"), "{error}");
    }
}

pub fn depth_counts_from_first_touch_in_every_pose_whatever_the_pad() {
    let config = Config { mesh_preset: MeshPreset::Coarse, ..Config::default() };
    let pressed = |pitch: f64, roll: f64| {
        let turn = |value: f64| Some(Turn { drive: D, values: vec![value; 2] });
        let turns = Turns { pitch: turn(pitch), roll: turn(roll), spin: None };
        Path { turns, ..path([D; 3], &[[0.0; 3], [0.4, 0.0, 0.0]]) }
    };
    let neutral = pressed(30.0, 0.0);
    for (pitch, roll) in [(65.0, 0.0), (40.0, 28.0), (12.0, -20.0)] {
        let tilted = pressed(pitch, roll);
        // The pad of this pose alone leaves out the point that the plane of the neutral pose touches first.
        let alone = config.finger_for(&[&tilted]).unwrap().0;
        let with_neutral = config.finger_for(&[&tilted, &neutral]).unwrap().0;
        let [force_n, other_n] = [&alone, &with_neutral].map(|finger| {
            // Without friction nothing depends on where increments end.
            let problem = Problem { friction: None, ..config.problem(finger) };
            let end = follow_path(&problem, &tilted, &[], &mut |_| ControlFlow::Continue(())).unwrap();
            end.responses.last().unwrap().normal_force_n
        });
        assert!(force_n > 0.02, "pitch {pitch}, roll {roll}: {force_n} N");
        assert!((force_n / other_n - 1.0).abs() < 1e-4, "pitch {pitch}, roll {roll}: {force_n} N, {other_n} N");
    }
}

pub fn the_plane_stays_clear_of_what_is_held() {
    let flat = FingertipShape { inclination_deg: 10.0, ..FingertipShape::named("e").unwrap() };
    let tip = fingertip(&flat, &MeshPreset::Coarse.divisions()).unwrap();
    let finger = Finger::new(tip, &Tissue::default()).unwrap();
    let clearance = Clearance::of(&finger);
    assert!(clearance.obstacle == Obstacle::HeldSection && (clearance.depth_mm - 1.63).abs() < 0.02, "{clearance:?}");

    let config = Config::default();
    config.check_depths(&[1.0, 1.5], &finger).unwrap();
    for refused in [
        config.check_depths(&[1.0, 1.8], &finger).unwrap_err().to_string(),
        config.check_path(&placed(&[[0.0; 3], [1.8, 0.0, 0.0]]), &finger).unwrap_err().to_string(),
    ] {
        assert!(refused.contains("1.8 mm reaches the held section") && refused.contains("1.63 mm"), "{refused}");
    }

    // Driven by force, the depth is not known beforehand.
    let pressed = path([F, D, D], &[[0.0; 3], [20.0, 0.0, 0.0]]);
    config.check_path(&pressed, &finger).unwrap();
    let mut problem = config.problem(&finger);
    problem.load_steps.max_force_step_n = 0.5;
    let error = follow_path(&problem, &pressed, &[], &mut |_| ControlFlow::Continue(())).unwrap_err();
    let LoadPathError::NotClear { clearance_mm, reached, .. } = error else { panic!("{error}") };
    assert_eq!(clearance_mm, clearance.depth_mm);
    assert!(reached.responses.len() > 2 && reached.responses.iter().all(|r| r.depth_mm < clearance_mm));
}

pub fn impossible_loads_are_refused_before_the_run() {
    let config = Config { experiment: Experiment::default(), ..Config::default() };
    let finger = coarse();
    for (drives, corner, what) in [
        ([F, D, D], [300.0, 0.0, 0.0], "data row 2: normal_force_n 300 N"),
        ([D, F, D], [0.5, -300.0, 0.0], "data row 2: friction_x_n -300 N"),
        ([D, D, D], [0.5, 1e6, 0.0], "data row 2: slide_x_mm 1000000 mm"),
        ([D, D, D], [50.0, 0.0, 0.0], "data row 2: depth_mm 50 mm reaches the"),
    ] {
        let message = config.check_path(&path(drives, &[[0.0; 3], corner]), &finger).unwrap_err().to_string();
        assert!(message.starts_with(what), "{message}");
    }
    for (lambda, beta) in [(50.0, 0.46), (1e9, 0.46), (0.086, -5.0)] {
        let mut config = Config::default();
        (config.friction.lambda, config.friction.beta) = (lambda, beta);
        assert!(config.finger().is_err_and(|error| error.to_string().starts_with("friction: ")));
    }
}
