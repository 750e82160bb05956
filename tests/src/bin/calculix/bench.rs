//! CPU time of ours against CalculiX: frictionless press, and press and slide.
//!
//! CPU, not clock: user and system time of the whole job. Ours counts from the mesh on (mesh, ordering, symbolic
//! analysis, run); CalculiX's is that of its process, reading the deck included. One thread each.

use std::time::Duration;

use fingerpad_fe::compare_ccx::{Friction, Run, Runner, Step};
use fingerpad_fe::contact::PenaltySettings;
use fingerpad_fe::load_path::{Problem, Trajectory};
use fingerpad_fe::mesh::MeshPreset;
use fingerpad_tests::calculix::{
    Case, Law, MU, cpu, press_and_slide, problem, run_calculix, run_calculix_with, short_press,
};

/// Depth of both benchmarks, mm.
const DEPTH_MM: f64 = 1.5;
/// Slide of ours, mm.
const SLIDE_MM: f64 = 6.0;
/// Slide after which CalculiX's run ends, mm.
const CALCULIX_SLIDE_MM: f64 = 0.5;
/// Elastic slip of our Coulomb run, mm, and stick slope of CalculiX's, MPa/mm.
const STICK: (f64, f64) = (1e-3, 5.0);

/// Whether both comparisons meet their marks.
pub fn run(preset: MeshPreset, limit: Duration) -> bool {
    let case = Case::new("a", preset);
    println!("{}", case.line(&case.finger()));
    let press = bench_press(&case, limit);
    bench_slide(&case, limit) && press
}

/// Model of the finger in this program.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    /// The whole, as CalculiX does.
    Whole,
    /// The half that represents it on a straight path, as the program does by itself.
    Half,
}

/// CPU seconds of one of our runs, mesh and set-up included.
fn time_ours(case: &Case, part: Part, law: Law, slides_mm: &[f64], change: impl Fn(&mut Problem)) -> (f64, Trajectory) {
    cpu(|| {
        let finger = case.finger();
        let mut problem = problem(&finger, law);
        if part == Part::Half {
            problem.half = finger.half.as_ref();
        }
        change(&mut problem);
        fingerpad_tests::calculix::run(&problem, &press_and_slide(&[DEPTH_MM], slides_mm))
    })
}

fn print_ours(what: &str, cpu_s: f64, trajectory: &Trajectory) {
    let (cost, last) = (&trajectory.cost, trajectory.responses.last().expect("a run has responses"));
    println!(
        "  ours  {cpu_s:>8.2} CPU s  {:>3} increments, {:>2} cut, {:>4} iterations, {:>3} factorisations, N {:.4} N, F {:.4} N  ({what})",
        cost.increments, cost.cutbacks, cost.iterations, cost.factorisations, last.normal_force_n, last.friction_x_n
    );
}

fn print_calculix(what: &str, run: &Run) {
    let n = run.points.last().map_or(f64::NAN, |p| p.force_n.z);
    println!(
        "  CalculiX  {:>8.2} CPU s  {:>3} increments, {:>2} cut, {:>4} iterations, N {n:.4} N  ({what})",
        run.cpu_s, run.increments, run.failed_attempts, run.iterations
    );
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) }
}

fn minimum(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

fn verdict(ratio: f64, pass: f64, reach: f64) -> bool {
    let word = if ratio >= reach {
        "reached"
    } else if ratio >= pass {
        "pass"
    } else {
        "FAIL"
    };
    println!("  {word}: {ratio:.1}x (pass {pass}x, reach for {reach}x)");
    ratio >= pass
}

/// Largest increments of the press that are tried for either program, mm.
const INCREMENTS_MM: [f64; 3] = [0.75, 0.5, 0.25];

/// Frictionless press; both programs with their fastest largest increment.
fn bench_press(case: &Case, limit: Duration) -> bool {
    println!(
        "\n(a) frictionless press to {DEPTH_MM} mm, ours without augmentation (residual tolerance 1e-5; CalculiX's is 5e-3)"
    );
    let finger = case.finger();
    let ours = |increment_mm: f64| {
        let (cpu_s, trajectory) = time_ours(case, Part::Whole, Law::Frictionless, &[], |problem| {
            problem.load_steps.max_depth_step_mm = increment_mm;
        });
        print_ours(&format!("increments up to {increment_mm} mm"), cpu_s, &trajectory);
        cpu_s
    };
    let calculix = |increment_mm: f64| {
        let step =
            Step { first_increment_mm: increment_mm, max_increment_mm: increment_mm, ..Step::press(&[DEPTH_MM]) };
        let (run, stopped) = run_calculix(&case.deck(&finger, None, vec![step]), limit);
        let how = stopped.as_ref().map_or("finished".to_owned(), |reason| format!("STOPPED: {reason}"));
        print_calculix(&format!("increments up to {increment_mm} mm, {how}"), &run);
        stopped.is_none().then_some(run.cpu_s)
    };
    let mut best: Option<(f64, f64)> = None;
    let mut our_best: Option<(f64, f64)> = None;
    for increment in INCREMENTS_MM {
        let cpu_s = ours(increment);
        if our_best.is_none_or(|(_, least)| cpu_s < least) {
            our_best = Some((increment, cpu_s));
        }
        if let Some(cpu_s) = calculix(increment)
            && best.is_none_or(|(_, least)| cpu_s < least)
        {
            best = Some((increment, cpu_s));
        }
    }
    let (Some((our_increment, our_first)), Some((increment, first))) = (our_best, best) else {
        println!("  FAIL: CalculiX finished with none of its increments");
        return false;
    };
    let (mut our_times, mut calculix_times, mut halves) = (vec![our_first], vec![first], Vec::new());
    for _ in 0..2 {
        our_times.push(ours(our_increment));
        let (cpu_s, trajectory) = time_ours(case, Part::Half, Law::Frictionless, &[], |_| ());
        print_ours("half of the finger, as the program does", cpu_s, &trajectory);
        halves.push(cpu_s);
        calculix_times.extend(calculix(increment));
    }
    let (cpu_s, trajectory) =
        time_ours(case, Part::Whole, Law::Frictionless, &[], |problem| problem.penalty = PenaltySettings::default());
    print_ours("all settings default: with augmentation", cpu_s, &trajectory);
    let (cpu_s, trajectory) =
        time_ours(case, Part::Whole, Law::Frictionless, &[], |problem| problem.settings.tolerance = 1e-3);
    print_ours("residual tolerance 1e-3, nearer to CalculiX's", cpu_s, &trajectory);
    let (least, middle) =
        (minimum(&calculix_times) / minimum(&our_times), median(calculix_times.clone()) / median(our_times.clone()));
    println!(
        "  CalculiX at its best ({increment} mm) over ours at its ({our_increment} mm): {middle:.1}x of medians, {least:.1}x of minima"
    );
    let half = median(calculix_times) / median(halves);
    let whole = verdict(middle.min(least), 8.0, 15.0);
    println!("  and over ours with half of the finger: {half:.1}x of medians");
    verdict(half, 30.0, 50.0) && whole
}

/// One depth of the experiment.
fn bench_slide(case: &Case, limit: Duration) -> bool {
    println!(
        "\n(b) press to {DEPTH_MM} mm with friction, then slide: ours {SLIDE_MM} mm, CalculiX {CALCULIX_SLIDE_MM} mm"
    );
    let law = Law::Coulomb { gamma_crit_mm: STICK.0 };
    let (rubber, trajectory) =
        time_ours(case, Part::Whole, Law::Rubber, &[SLIDE_MM], |problem| problem.penalty = PenaltySettings::default());
    print_ours("rubber law, all settings default", rubber, &trajectory);
    let (half, trajectory) = time_ours(case, Part::Half, Law::Rubber, &[SLIDE_MM], |problem| {
        problem.penalty = PenaltySettings::default();
    });
    print_ours("the same, half of the finger, as the program does", half, &trajectory);
    let (coulomb, trajectory) = time_ours(case, Part::Whole, law, &[SLIDE_MM], |_| ());
    print_ours(&format!("Coulomb mu {MU}, gamma_crit {} mm, no augmentation", STICK.0), coulomb, &trajectory);
    let finger = case.finger();
    let friction = Friction { mu: MU, stick_slope_mpa_mm: STICK.1 };
    let steps = vec![short_press(&[DEPTH_MM]), Step::slide_x(DEPTH_MM, &[CALCULIX_SLIDE_MM])];
    let what = format!("Coulomb mu {MU}, stick slope {} MPa/mm", STICK.1);
    // The folder is kept to read the progress of a slide that the time limit ended.
    let folder = tempfile::tempdir().expect("a temporary folder");
    let runner = Runner { timeout: limit, folder: Some(folder.path().to_owned()), ..Runner::default() };
    let (whole, stopped) = run_calculix_with(&runner, &case.deck(&finger, Some(friction), steps));
    let how = stopped.as_ref().map_or("finished".to_owned(), |reason| format!("stopped: {reason}"));
    print_calculix(&format!("{what}, press and slide, {how}"), &whole);
    let sta = std::fs::read_to_string(folder.path().join("job.sta")).unwrap_or_default();
    let Some(progress) = SlideProgress::parse(&sta) else {
        println!("  FAIL: CalculiX did not reach its slide");
        return false;
    };
    // All its iterations cost the same: the same matrix is factorised in each.
    let per_iteration = whole.cpu_s / f64::from(whole.iterations);
    let slide_s = per_iteration * f64::from(progress.iterations);
    println!(
        "  CalculiX: {per_iteration:.2} CPU s per iteration; press {:.1} CPU s, {} iterations; slide {:.1} CPU s, {} iterations for {:.3} mm: {:.0} CPU s per mm",
        whole.cpu_s - slide_s,
        whole.iterations - progress.iterations,
        slide_s,
        progress.iterations,
        progress.reached_mm,
        slide_s / progress.reached_mm
    );
    // The start of a slide is its most expensive part. The rest is counted at the largest increment and with as many
    // iterations as the last increment took, without one failure: a lower bound of its cost.
    let largest = Step::slide_x(DEPTH_MM, &[SLIDE_MM]).max_increment_mm;
    let left = ((SLIDE_MM - progress.reached_mm) / largest).ceil() * f64::from(progress.last_iterations);
    let extrapolated = whole.cpu_s + left * per_iteration;
    let linear = whole.cpu_s + (SLIDE_MM - progress.reached_mm) * slide_s / progress.reached_mm;
    println!(
        "  CalculiX extrapolated to {SLIDE_MM} mm: at least {extrapolated:.0} CPU s (increments of {largest} mm, {} iterations each), {linear:.0} CPU s at its cost per mm so far",
        progress.last_iterations
    );
    for (name, ours) in [("rubber law", rubber), ("rubber law, half of the finger", half), ("Coulomb", coulomb)] {
        println!(
            "  over ours, {name}: {:.1}x as stopped ({:.2} mm against {SLIDE_MM} mm), {:.1}x at least, {:.1}x by its cost per mm",
            whole.cpu_s / ours,
            progress.reached_mm,
            extrapolated / ours,
            linear / ours
        );
    }
    println!("  at least, rubber law, the whole finger, then its half:");
    let whole = verdict(extrapolated / rubber, 20.0, 50.0);
    verdict(extrapolated / half, 100.0, 200.0) && whole
}

/// Progress of the second step of a run of CalculiX.
struct SlideProgress {
    iterations: u32,
    last_iterations: u32,
    reached_mm: f64,
}

impl SlideProgress {
    /// From the lines of a `.sta` file: step, increment, attempt, iterations, total time, step time, increment.
    fn parse(sta: &str) -> Option<Self> {
        let mut progress = Self { iterations: 0, last_iterations: 0, reached_mm: 0.0 };
        for line in sta.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            if let ["2", _, attempt, iterations, _, time, _] = words[..] {
                let iterations: u32 = iterations.parse().ok()?;
                progress.iterations += iterations;
                if !attempt.ends_with('U') {
                    progress.last_iterations = iterations;
                    progress.reached_mm = time.parse().ok()?;
                }
            }
        }
        (progress.reached_mm > 0.0).then_some(progress)
    }
}
