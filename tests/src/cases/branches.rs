//! Slides that branch off one press, and longer steps in steady slip.

use std::ops::ControlFlow;
use std::time::Duration;

use crate::problems::fingers::placed;
use fingerpad_fe::experiment::{Config, Experiment, press, press_and_slide};
use fingerpad_fe::load_path::{
    Checkpoint, LoadPathError, PathEnd, Progress, RunOptions, Trajectory, follow, follow_path,
};
use fingerpad_fe::mesh::MeshPreset;

fn go_on(_: Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn config(slide_mm: f64) -> Config {
    let experiment = Experiment { depths_mm: vec![0.3, 0.5], slide_mm, ..Experiment::default() };
    Config { mesh_preset: MeshPreset::Coarse, experiment, ..Config::default() }
}

/// All numbers of a trajectory but its times, as text that also compares NaN.
fn numbers(trajectory: &Trajectory) -> String {
    format!("{:?} {:?} {:?}", trajectory.responses, trajectory.snapshots, trajectory.work)
}

pub fn slides_that_branch_off_one_press_are_the_slides_after_presses_of_their_own_to_the_last_bit() {
    let config = config(0.4);
    let (finger, _) = config.finger().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.checkpoint");
    let checkpoint = Checkpoint { file: &file, period: Duration::ZERO, key: "settings" };
    let mut from: Option<PathEnd> = None;
    for depth in [0.3, 0.5] {
        let end = press(&config, &finger, depth, from.as_ref(), None, &mut go_on).unwrap();
        let alone = press_and_slide(&config, &finger, depth, None, None, &mut go_on).unwrap();
        let branched = press_and_slide(&config, &finger, depth, Some(&end), None, &mut go_on).unwrap();
        assert_eq!(numbers(&alone), numbers(&branched), "{depth} mm");
        // An interrupted branch resumes from its own checkpoint.
        let stopped = press_and_slide(&config, &finger, depth, Some(&end), Some(checkpoint), &mut |progress| {
            let is_enough = progress.cost.increments > end.cost().increments + 1;
            if is_enough { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        assert!(matches!(stopped, Err(LoadPathError::Interrupted { .. })));
        let mut least = u32::MAX;
        let resumed = press_and_slide(&config, &finger, depth, Some(&end), Some(checkpoint), &mut |progress| {
            least = least.min(progress.cost.increments);
            ControlFlow::Continue(())
        });
        assert_eq!(numbers(&alone), numbers(&resumed.unwrap()), "{depth} mm, resumed");
        assert!(least > end.cost().increments);
        from = Some(end);
    }
}

pub fn a_run_goes_on_only_from_the_beginning_of_its_path() {
    let config = config(0.4);
    let (finger, _) = config.finger().unwrap();
    let problem = config.problem(&finger);
    let start = placed(&[[0.0; 3], [0.2, 0.0, 0.0]]);
    let end = follow(&problem, &start, RunOptions::default(), &mut go_on).unwrap();
    let refused = |corners: &[[f64; 3]], snapshots: &[usize]| {
        let options = RunOptions { snapshots, from: Some(&end), ..RunOptions::default() };
        follow(&problem, &placed(corners), options, &mut go_on).map(drop).unwrap_err().to_string()
    };
    let other = refused(&[[0.0; 3], [0.3, 0.0, 0.0], [0.3, 0.1, 0.0]], &[]);
    assert!(other.contains("is not the beginning of this path"), "{other}");
    let passed = refused(&[[0.0; 3], [0.2, 0.0, 0.0], [0.2, 0.1, 0.0]], &[0]);
    assert!(passed.contains("has passed rows whose field is requested"), "{passed}");
    // The half of the finger was pressed, and a slide along y needs the whole.
    let whole = refused(&[[0.0; 3], [0.2, 0.0, 0.0], [0.2, 0.0, 0.1]], &[]);
    assert!(whole.contains("differ in the use of symmetry"), "{whole}");
}

pub fn longer_steps_in_steady_slip_change_friction_by_less_than_a_thousandth() {
    let config = config(6.0);
    let (finger, _) = config.finger().unwrap();
    let problem = config.problem(&finger);
    let mut small = problem.clone();
    small.load_steps.max_steady_slide_step_mm = small.load_steps.max_slide_step_mm;
    let path = placed(&[[0.0; 3], [0.8, 0.0, 0.0], [0.8, 4.0, 0.0], [0.8, 6.0, 0.0], [0.8, 5.0, 0.0]]);
    let [long, small] =
        [&problem, &small].map(|p| follow_path(p, &path, &[], &mut go_on).unwrap_or_else(|error| panic!("{error}")));
    let at = |run: &Trajectory, t: f64| *run.responses.iter().find(|r| r.t_s == t).expect("a row at every corner");
    for corner in [2.0, 3.0, 4.0] {
        let (a, b) = (at(&long, corner), at(&small, corner));
        for (a, b) in [
            (a.friction_x_n, b.friction_x_n),
            (a.normal_force_n, b.normal_force_n),
            (a.contact_area_mm2, b.contact_area_mm2),
        ] {
            println!("{corner} s: {a} {b}, {:.1e}", a / b - 1.0);
            assert!((a / b - 1.0).abs() < 1e-3, "{corner} s: {a} {b}");
        }
        assert!((a.stick_ratio - b.stick_ratio).abs() < 1e-4, "{corner} s");
    }
    println!("{} increments, {} in small steps", long.cost.increments, small.cost.increments);
    assert!(long.cost.increments + 4 < small.cost.increments);
    // A reversal is resolved as usual.
    let after = |run: &Trajectory| run.responses.iter().find(|r| r.t_s > 3.0).unwrap().slide_x_mm;
    assert!(6.0 - after(&long) <= problem.load_steps.max_slide_step_mm + 1e-9);
}
