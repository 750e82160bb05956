//! Which effect does the paper's finger lack, and what are its constants?
//!
//! Each candidate is fitted to five numbers of a press, with its own parameters and the stiffness of the whole finger.
//! The constants of the second finger follow from all fitted numbers together.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;

use fingerpad_fe::experiment::{Config, Shape};
use fingerpad_fe::load_path::{PressLimit, Tissue};
use fingerpad_fe::material::{Material, Ogden};
use fingerpad_fe::mesh::{FingertipShape, MeshPreset};
use fingerpad_formats::in_threads;
use fingerpad_least_squares::{LevenbergMarquardt, Problem, minimise};

use super::lab::{Failure, Lab, Line};
use super::press::{area_lines, depth_lines, friction_line};
use super::slide::across_lines;

/// A parameter: name with unit, value where the search starts, least and largest value.
struct Parameter {
    name: &'static str,
    start: f64,
    bounds: [f64; 2],
}

/// An effect that the finger may lack.
struct Candidate {
    name: &'static str,
    parameters: &'static [Parameter],
    /// The finger with these parameters; the stiffness follows by itself.
    finger: fn(&[f64], &Path) -> Result<Config, Failure>,
}

/// Factor on every stiffness, free in each candidate.
const STIFFNESS: Parameter = Parameter { name: "stiffness factor", start: 1.0, bounds: [0.1, 10.0] };

/// The effects; the bounds of exponents are those published for pig skin (12: Shergold, Fleck and Radford 2006) and fat
/// (some 20: Comley and Fleck 2012).
const CANDIDATES: [Candidate; 6] = [
    Candidate {
        name: "tissue that stiffens",
        parameters: &[
            Parameter { name: "exponent of the skin", start: 2.4, bounds: [1.4, 12.0] },
            Parameter { name: "exponent of the tissue below", start: 2.8, bounds: [1.4, 23.0] },
        ],
        finger: |p, _| Ok(with_tissue(|skin, below| (skin.alpha, below.alpha) = (p[0], p[1]))),
    },
    Candidate { name: "stiffness alone", parameters: &[], finger: |_, _| Ok(Config::default()) },
    Candidate {
        name: "size of the finger",
        parameters: &[Parameter { name: "factor on every length", start: 1.0, bounds: [0.75, 1.3] }],
        finger: |p, folder| with_shape(folder, |shape| *shape = shape.scaled(p[0])),
    },
    Candidate {
        name: "tissue under the bone",
        parameters: &[Parameter { name: "dorsal offset of the bone, mm", start: 3.2, bounds: [1.0, 3.8] }],
        finger: |p, folder| with_shape(folder, |shape| shape.bone_dorsal_offset_mm = p[0]),
    },
    Candidate {
        name: "compressibility",
        parameters: &[Parameter { name: "factor on D", start: 1.0, bounds: [0.02, 10.0] }],
        finger: |p, _| Ok(with_tissue(|skin, below| [skin, below].into_iter().for_each(|law| law.d_per_mpa *= p[0]))),
    },
    Candidate {
        name: "stiffness of the skin",
        parameters: &[Parameter { name: "factor on the skin's stiffness", start: 1.0, bounds: [0.1, 10.0] }],
        finger: |p, _| {
            Ok(with_tissue(|skin, _| (skin.mu_mpa, skin.d_per_mpa) = (skin.mu_mpa * p[0], skin.d_per_mpa / p[0])))
        },
    },
];

/// The default finger with other constants of skin and of the tissue below.
fn with_tissue(change: impl FnOnce(&mut Ogden, &mut Ogden)) -> Config {
    let mut config = Config::default();
    let Tissue { skin: Material::Ogden(skin), subcutaneous: Material::Ogden(below), .. } = &mut config.tissue else {
        unreachable!("the default tissue follows Ogden's law")
    };
    change(skin, below);
    config
}

/// The default finger with another shape, which is written to `folder`.
fn with_shape(folder: &Path, change: impl FnOnce(&mut FingertipShape)) -> Result<Config, Failure> {
    let mut shape = FingertipShape::default();
    change(&mut shape);
    // One file a candidate: two of them run at the same time.
    let file = folder.join(format!("shape-{:?}.toml", std::thread::current().id()));
    std::fs::write(&file, toml::to_string(&shape)?)?;
    Ok(Config { shape: Shape(file.display().to_string()), ..Config::default() })
}

/// The paper's mean pressure at 1 N, MPa: the friction laws of all exponents have the paper's strength there.
const PRESSURE_MPA: f64 = 0.008;

/// Parameters of the second finger. The search starts at the best of some forty fingers that were tried.
const SECOND: [Parameter; 4] = [
    Parameter { name: "stiffness factor", start: 0.5, bounds: [0.1, 10.0] },
    Parameter { name: "factor on the skin's stiffness", start: 4.0, bounds: [0.2, 10.0] },
    Parameter { name: "exponent of the tissue below", start: 13.0, bounds: [1.4, 23.0] },
    Parameter { name: "exponent of the friction law", start: 0.7, bounds: [0.3, 1.0] },
];

/// Its exponent of the skin, published for pig skin (Shergold, Fleck and Radford 2006): the search would end at this bound.
const SKIN_EXPONENT: f64 = 12.0;

/// The second finger with these parameters.
fn second(p: &[f64]) -> Config {
    let mut config = with_tissue(|skin, below| {
        (skin.alpha, below.alpha) = (SKIN_EXPONENT, p[2]);
        for (law, factor) in [(skin, p[0] * p[1]), (below, p[0])] {
            (law.mu_mpa, law.d_per_mpa) = (law.mu_mpa * factor, law.d_per_mpa / factor);
        }
    });
    let friction = &mut config.friction;
    friction.lambda *= PRESSURE_MPA.powf(friction.beta - p[3]);
    friction.beta = p[3];
    config
}

/// All fitted numbers of a finger.
fn all_lines(config: Config, preset: MeshPreset) -> Result<Vec<Line>, Failure> {
    let lab = Lab::new(config, preset);
    let presses = lab.deep_press()?;
    let of_press = area_lines(&presses).into_iter().chain([friction_line(&presses)]).chain(depth_lines(&presses));
    Ok(of_press.chain(across_lines(&lab)?).collect())
}

/// Distance from the middle of the band; half of a band counts as two standard deviations.
fn from_middle(line: &Line) -> f64 {
    let [low, high] = line.band;
    let found = (line.found - 0.5 * (low + high)) / (0.25 * (high - low));
    // A finger that does not reach the load in front of its bone is as bad as any.
    if found.is_finite() { found } else { UNREACHED }
}

/// Residual of a number that is not reached.
const UNREACHED: f64 = 30.0;

/// Distance outside the band with a smooth beginning at its edge, so that a search feels the edge before it is there.
fn outside(line: &Line) -> f64 {
    const EDGE: f64 = 2.0;
    const STEEPNESS: f64 = 6.0;
    let found = from_middle(line);
    let beyond = STEEPNESS * (found.abs() - EDGE);
    // ln(1 + exp(beyond)), without overflow.
    found.signum() * (beyond.max(0.0) + (-beyond.abs()).exp().ln_1p()) / STEEPNESS
}

/// Numbers of a finger over the values of the parameters.
type Numbers<'a> = dyn Fn(&[f64]) -> Result<Vec<Line>, Failure> + Sync + 'a;

/// Fit of a finger to numbers.
struct Fit<'a> {
    parameters: Vec<&'a Parameter>,
    numbers: &'a Numbers<'a>,
    /// Residual of a number, by its place.
    residual: &'a (dyn Fn(usize, &Line) -> f64 + Sync),
    jobs: usize,
    /// The least sum of squared residuals so far, and where: steps of the derivatives may be better than those of the search.
    best: Mutex<(f64, Vec<f64>)>,
    error: Option<Failure>,
}

/// Result of a fit: values with standard errors, lines, sum of squared distances from the middles of the bands.
struct Fitted {
    values: Vec<[f64; 2]>,
    lines: Vec<Line>,
    sum: f64,
}

impl Fit<'_> {
    /// The unbounded variable of a parameter, and back: a logistic curve between the logarithms of its bounds.
    fn free(parameter: &Parameter) -> f64 {
        let [low, high] = parameter.bounds.map(f64::ln);
        let share = (parameter.start.ln() - low) / (high - low);
        (share / (1.0 - share)).ln()
    }

    fn value(parameter: &Parameter, free: f64) -> f64 {
        let [low, high] = parameter.bounds.map(f64::ln);
        (low + (high - low) / (1.0 + (-free).exp())).exp()
    }

    fn lines(&self, free: &[f64]) -> Result<Vec<Line>, Failure> {
        let values: Vec<f64> = self.parameters.iter().zip(free).map(|(p, &x)| Self::value(p, x)).collect();
        let lines = (self.numbers)(&values)?;
        let sum = lines.iter().enumerate().map(|(place, line)| (self.residual)(place, line).powi(2)).sum();
        let mut best = self.best.lock().expect("no panic while locked");
        if best.1.is_empty() || sum < best.0 {
            *best = (sum, free.to_vec());
        }
        Ok(lines)
    }

    /// Derivatives of the numbers, one column for each parameter, after `measure`.
    fn columns(&self, at: &[f64], measure: impl Fn(usize, &Line) -> f64 + Sync) -> Result<Vec<Vec<f64>>, String> {
        // A press has an error of some per mille: derivatives over less would be its noise.
        const STEP: f64 = 0.15;
        let sides = in_threads(0..=at.len(), self.jobs, |k| {
            let mut moved = at.to_vec();
            if let Some(moved) = moved.get_mut(k) {
                *moved += STEP;
            }
            let lines = self.lines(&moved).map_err(|e| e.to_string())?;
            Ok::<_, String>(lines.iter().enumerate().map(|(place, line)| measure(place, line)).collect::<Vec<_>>())
        })?;
        let (here, moved) = sides.split_last().expect("one more than parameters");
        let column = |there: &Vec<f64>| there.iter().zip(here).map(|(there, here)| (there - here) / STEP).collect();
        Ok(moved.iter().map(column).collect())
    }

    /// * `step_bound`: bound of the first step, as the minimiser takes it
    fn run(mut self, step_bound: f64) -> Result<Fitted, Failure> {
        let start: Vec<f64> = self.parameters.iter().map(|p| Self::free(p)).collect();
        let minimiser = LevenbergMarquardt::new().with_tol(1e-2).with_patience(4).with_stepbound(step_bound);
        minimise(&mut self, &start, &minimiser);
        if let Some(error) = self.error.take() {
            return Err(error);
        }
        let end = self.best.lock().expect("no panic while locked").1.clone();
        let lines = self.lines(&end)?;
        let errors = standard_errors(&self.columns(&end, |_, line| from_middle(line))?);
        let values = self.parameters.iter().zip(end.iter().zip(errors)).map(|(parameter, (&free, error))| {
            let value = Self::value(parameter, free);
            [value, 0.5 * (Self::value(parameter, free + error) - Self::value(parameter, free - error))]
        });
        let values = values.collect();
        let sum = lines.iter().map(|line| from_middle(line).powi(2)).sum();
        Ok(Fitted { values, lines, sum })
    }
}

impl Problem for Fit<'_> {
    fn residuals(&mut self, at: &[f64]) -> Option<Vec<f64>> {
        match self.lines(at) {
            Ok(lines) => Some(lines.iter().enumerate().map(|(place, line)| (self.residual)(place, line)).collect()),
            Err(error) => {
                self.error = Some(error);
                None
            }
        }
    }

    fn jacobian(&mut self, at: &[f64]) -> Option<Vec<Vec<f64>>> {
        self.columns(at, self.residual).map_err(|error| self.error = Some(error.into())).ok()
    }
}

/// Fit of a candidate to the numbers of a press.
fn of_press(candidate: &Candidate, folder: &Path) -> Result<Fitted, Failure> {
    // A stiffer finger gives the same press with larger forces.
    let known: Mutex<Vec<(Vec<f64>, Vec<PressLimit>)>> = Mutex::default();
    let numbers = |values: &[f64]| {
        let own = &values[1..];
        let mut known = known.lock().expect("no panic while locked");
        let at = match known.iter().position(|(known, _)| known == own) {
            Some(at) => at,
            None => {
                let config = (candidate.finger)(own, folder)?;
                known.push((own.to_vec(), Lab::new(config, MeshPreset::Coarse).deep_press()?));
                known.len() - 1
            }
        };
        let stiffer = |p: &PressLimit| PressLimit { normal_force_n: values[0] * p.normal_force_n, ..*p };
        let presses: Vec<PressLimit> = known[at].1.iter().map(stiffer).collect();
        Ok(area_lines(&presses).into_iter().chain(depth_lines(&presses)).collect())
    };
    let parameters = std::iter::once(&STIFFNESS).chain(candidate.parameters).collect();
    Fit {
        parameters,
        numbers: &numbers,
        residual: &|_, line| from_middle(line),
        jobs: 1,
        best: Mutex::default(),
        error: None,
    }
    .run(100.0)
}

/// Fit of the second finger to all fitted numbers: least distance outside the bands, where a number that the paper's
/// finger has inside counts so often that it stays there.
///
/// The search is on the coarse mesh. Its numbers are moved by what the mesh of `preset` changes where the search starts.
fn of_all(preset: MeshPreset, jobs: usize) -> Result<Fitted, Failure> {
    const INSIDE: f64 = 10.0;
    let start = SECOND.map(|parameter| parameter.start);
    let lines = |config: Config, preset: MeshPreset| all_lines(config, preset).map_err(|e| e.to_string());
    let known = [(Config::default(), preset), (second(&start), preset), (second(&start), MeshPreset::Coarse)];
    let known = in_threads(known, jobs, |(config, preset)| lines(config, preset))?;
    let weights: Vec<f64> = known[0].iter().map(|line| if line.gap() == 0.0 { INSIDE } else { 1.0 }).collect();
    let finer: Vec<f64> = known[1].iter().zip(&known[2]).map(|(fine, coarse)| fine.found - coarse.found).collect();
    let numbers = |values: &[f64]| {
        let mut lines = all_lines(second(values), MeshPreset::Coarse)?;
        lines.iter_mut().zip(&finer).for_each(|(line, finer)| line.found += finer);
        let found: Vec<f64> = lines.iter().map(|line| line.found).collect();
        eprintln!("{values:.3?}: {found:.3?}");
        Ok(lines)
    };
    let residual = |place: usize, line: &Line| weights[place] * outside(line);
    let parameters = SECOND.iter().collect();
    Fit { parameters, numbers: &numbers, residual: &residual, jobs, best: Mutex::default(), error: None }.run(0.3)
}

/// Standard errors of the parameters from the derivatives of the residuals (each of unit variance).
fn standard_errors(columns: &[Vec<f64>]) -> Vec<f64> {
    let n = columns.len();
    let product = |a: usize, b: usize| columns[a].iter().zip(&columns[b]).map(|(x, y)| x * y).sum::<f64>();
    let normal = nalgebra::DMatrix::from_fn(n, n, product);
    let inverse = normal.try_inverse();
    (0..n).map(|k| inverse.as_ref().map_or(f64::INFINITY, |inverse| inverse[(k, k)].sqrt())).collect()
}

/// The page's section on the fit.
pub fn section(folder: &Path, preset: MeshPreset, jobs: usize) -> Result<String, Failure> {
    let mut fits = in_threads(&CANDIDATES, jobs, |candidate| -> Result<_, String> {
        let fitted = of_press(candidate, folder).map_err(|e| format!("{}: {e}", candidate.name))?;
        let said = all_said(std::iter::once(&STIFFNESS).chain(candidate.parameters), &fitted);
        eprintln!("{}: chi² {:.1}; {said}", candidate.name, fitted.sum);
        Ok((candidate, fitted, said))
    })?;
    fits.sort_by(|(_, a, _), (_, b, _)| a.sum.total_cmp(&b.sum));
    let mut text = String::from(
        "\n## Which effect is missing\n\nEach candidate is fitted to five numbers of presses without friction, on the mesh `coarse`. \
         The stiffness of the whole finger is free in each. Half of a band counts as two standard deviations; chi² is the sum of the \
         squares of five residuals.\n\n| candidate | chi² |",
    );
    for line in &fits[0].1.lines {
        write!(text, " {} |", line.name)?;
    }
    text += " parameters (standard error) |\n|---|---|---|---|---|---|---|---|\n";
    for (candidate, fit, said) in &fits {
        write!(text, "| {} | {:.1} |", candidate.name, fit.sum)?;
        for line in &fit.lines {
            write!(text, " {} |", line.text())?;
        }
        writeln!(text, " {said} |")?;
    }
    let (best, next) = (&fits[0], &fits[1]);
    writeln!(
        text,
        "\n**Named: {}.** Its chi² of {:.1} compares with {:.1} of the next, {}.",
        best.0.name, best.1.sum, next.1.sum, next.0.name
    )?;
    let all = of_all(preset, jobs)?;
    writeln!(
        text,
        "\n## Its constants\n\nPresses alone leave the constants open (the standard errors above), and they say nothing of friction. \
         The constants of `stiffening` are those that bring the numbers marked `fitted` nearest to their bands. The search \
         is on the mesh `coarse`, whose numbers are moved by what this mesh changes where the search starts. A number that the paper's finger has inside its band counts ten times, so that it stays there. Friction turns about the mean \
         pressure of the paper's finger at 1 N, {} kPa: there each exponent has the paper's strength. The exponent of the \
         skin is {SKIN_EXPONENT}, as published for pig skin, where the search would end at its bound. The search starts at \
         the best of some forty fingers that were tried by hand, and ends there. Those trials showed all numbers of this page, so what is \
         not marked `fitted` was not fitted, but it was seen.\n\nFound: {}.",
        1e3 * PRESSURE_MPA,
        all_said(&SECOND, &all)
    )?;
    Ok(text)
}

/// The fitted parameters in words.
fn all_said<'a>(parameters: impl IntoIterator<Item = &'a Parameter>, fit: &Fitted) -> String {
    let parameters = parameters.into_iter().zip(&fit.values);
    parameters.map(|(parameter, value)| said(parameter, *value)).collect::<Vec<_>>().join("; ")
}

/// A fitted parameter in words.
fn said(parameter: &Parameter, [value, error]: [f64; 2]) -> String {
    let [low, high] = parameter.bounds;
    let at = |bound: f64| (value / bound).ln().abs() < 0.03 * (high / low).ln();
    let bound = if at(low) || at(high) { ", at its bound" } else { "" };
    format!("{} {value:.2} (±{error:.2}{bound})", parameter.name)
}
