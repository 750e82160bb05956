//! The effect of `core/docs/add-an-effect.md` in the diagnosis: with this additional law in its list, it names the
//! effect that was unexplained.

// Items that a file in `core/src/effects` imports from the module above it.
use fingerpad::effects::{
    Axis, Change, Column, Conditions, Effect, LAWS, Law, Parameter, Place, Real, Reported, VALUES,
};
use fingerpad_diagnose::{
    DiagnoseError, Diagnosis, LawsFile, Options, PlanConstraints, RunSet, SelectionSettings, Verdict, diagnose,
};
use fingerpad_tests::synthetic_truth::Random;
use fingerpad_tests::synthetic_truth::effects::Effect as Hidden;
use fingerpad_tests::synthetic_truth::protocol::Stroke;
use fingerpad_tests::synthetic_truth::score::reference;
use fingerpad_tests::synthetic_truth::sets::{Case, Hide, case, record};

#[path = "../../../core/tests/recipe/sebum_film.rs"]
mod sebum_film;

/// Fraction and time constant, s, of the film that is hidden.
const FILM: [f64; 2] = [0.3, 900.0];

/// The measured runs of a case under the film. The simulator has no film. It is replaced by a strength that falls in
/// proportion to the temperature, which is set to the film's influence at the time of each stroke.
fn under_film(case: &Case) -> RunSet {
    let in_proportion = [Hidden { name: "temperature", amplitude: 1.0, shape: [0.0; 2], form: 1.0 }];
    let readings = &mut |stroke: &Stroke, scatter: &_| {
        let mut filmed = stroke.clone();
        filmed.plan.temperature_c = 32.0 - FILM[0] * (1.0 - (-stroke.rows[0].t_s / FILM[1]).exp());
        case.finger.readings(&filmed, &in_proportion, scatter)
    };
    record(&case.strokes, &case.noise, &mut Random::new(7), "measured", None, readings)
}

fn diagnosed(case: &Case, measured: &RunSet, laws: &'static [&'static Law]) -> Diagnosis {
    let settings = SelectionSettings { laws, ..SelectionSettings::default() };
    let options = Options {
        settings,
        errors: Vec::new(),
        model: "shipped".into(),
        plan: PlanConstraints::default(),
        own: LawsFile::default(),
    };
    let open = || Ok::<_, DiagnoseError>(None);
    diagnose(&case.calibration, measured, &reference(), &options, open, &mut |_| ()).unwrap().0
}

#[test]
fn a_law_more_in_the_list_is_tested_and_named() {
    let case = case(70, Hide::Nothing, 0.0, 0, 60, true);
    let measured = under_film(&case);
    // The library has the film's form under another name; without it the film is a law that is missing.
    let without: Vec<&'static Law> = LAWS.iter().copied().filter(|law| law.family != "strength_drift").collect();
    let with_film: Vec<&'static Law> = without.iter().copied().chain([&sebum_film::SebumFilm::LAW]).collect();
    let report = diagnosed(&case, &measured, with_film.leak());
    assert_eq!(report.verdict, Verdict::Named, "{:?}", report.effects);
    let [found] = &report.effects[..] else { panic!("{:?}", report.effects) };
    assert_eq!((found.law.as_str(), found.family.as_str()), ("sebum_film", "film"));
    for (parameter, truth) in found.parameters.iter().zip(FILM) {
        println!("{} {} {:?}, truth {truth}", parameter.name, parameter.value, parameter.ci95);
        assert!(parameter.ci95[0] < truth && truth < parameter.ci95[1], "{parameter:?}");
    }
    // Without the law in the list something is there that no law covers.
    assert_eq!(diagnosed(&case, &measured, without.leak()).verdict, Verdict::UnexplainedStructure);
    let by_library = diagnosed(&case, &measured, LAWS);
    let laws: Vec<&str> = by_library.effects.iter().map(|effect| effect.law.as_str()).collect();
    assert_eq!((by_library.verdict, laws), (Verdict::Named, vec!["strength_run_in"]));
}
