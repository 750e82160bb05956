//! Which effect does the paper's finger lack? Each candidate is fitted to five numbers of a press, with its own
//! parameters and the stiffness of the whole finger.

use std::fmt::Write as _;
use std::path::Path;

use fingerpad_fe::experiment::{Config, Shape};
use fingerpad_fe::load_path::{PressLimit, Tissue};
use fingerpad_fe::material::{Material, Ogden};
use fingerpad_fe::mesh::{FingertipShape, MeshPreset};
use fingerpad_formats::in_threads;
use fingerpad_least_squares::{LevenbergMarquardt, Problem, minimise};

use super::lab::{Failure, Lab, Line};
use super::press::{area_lines, depth_lines};

/// A parameter of a candidate: name with unit, published or shipped value, least and largest value.
struct Parameter {
    name: &'static str,
    shipped: f64,
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
const STIFFNESS: Parameter = Parameter { name: "stiffness factor", shipped: 1.0, bounds: [0.1, 10.0] };

/// The effects; the bounds of exponents are those published for pig skin (12: Shergold, Fleck and Radford 2006) and fat
/// (some 20: Comley and Fleck 2012).
const CANDIDATES: [Candidate; 6] = [
    Candidate {
        name: "tissue that stiffens",
        parameters: &[
            Parameter { name: "exponent of the skin", shipped: 1.4, bounds: [1.4, 12.0] },
            Parameter { name: "exponent of the tissue below", shipped: 1.4, bounds: [1.4, 23.0] },
        ],
        finger: |p, _| Ok(with_tissue(|skin, below| (skin.alpha, below.alpha) = (p[0], p[1]))),
    },
    Candidate { name: "stiffness alone", parameters: &[], finger: |_, _| Ok(Config::default()) },
    Candidate {
        name: "size of the finger",
        parameters: &[Parameter { name: "factor on every length", shipped: 1.0, bounds: [0.75, 1.3] }],
        finger: |p, folder| with_shape(folder, |shape| *shape = shape.scaled(p[0])),
    },
    Candidate {
        name: "tissue under the bone",
        parameters: &[Parameter { name: "dorsal offset of the bone, mm", shipped: 3.2, bounds: [1.0, 3.8] }],
        finger: |p, folder| with_shape(folder, |shape| shape.bone_dorsal_offset_mm = p[0]),
    },
    Candidate {
        name: "compressibility",
        parameters: &[Parameter { name: "factor on D", shipped: 1.0, bounds: [0.02, 10.0] }],
        finger: |p, _| Ok(with_tissue(|skin, below| [skin, below].into_iter().for_each(|law| law.d_per_mpa *= p[0]))),
    },
    Candidate {
        name: "stiffness of the skin",
        parameters: &[Parameter { name: "factor on the skin's stiffness", shipped: 1.0, bounds: [0.1, 10.0] }],
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

/// Half of a band counts as two standard deviations.
fn residual(line: &Line) -> f64 {
    let [low, high] = line.band;
    let found = (line.found - 0.5 * (low + high)) / (0.25 * (high - low));
    // A finger that does not reach the load in front of its bone is as bad as any.
    if found.is_finite() { found } else { UNREACHED }
}

/// Residual of a number that is not reached.
const UNREACHED: f64 = 30.0;

/// Fit of a candidate.
struct Fit<'a> {
    candidate: &'a Candidate,
    folder: &'a Path,
    /// Presses so far, by the candidate's own parameters.
    known: Vec<(Vec<f64>, Vec<PressLimit>)>,
    error: Option<Failure>,
}

/// Result of a fit: values with standard errors, lines, sum of squared residuals.
struct Fitted {
    values: Vec<[f64; 2]>,
    lines: Vec<Line>,
    sum: f64,
}

impl Fit<'_> {
    fn parameters(&self) -> impl Iterator<Item = &Parameter> {
        std::iter::once(&STIFFNESS).chain(self.candidate.parameters)
    }

    /// The unbounded variable of a parameter, and back: a logistic curve between the logarithms of its bounds.
    fn free(parameter: &Parameter) -> f64 {
        let [low, high] = parameter.bounds.map(f64::ln);
        let share = ((parameter.shipped.ln() - low) / (high - low)).clamp(0.25, 0.75);
        (share / (1.0 - share)).ln()
    }

    fn value(parameter: &Parameter, free: f64) -> f64 {
        let [low, high] = parameter.bounds.map(f64::ln);
        (low + (high - low) / (1.0 + (-free).exp())).exp()
    }

    /// The five numbers. A stiffer finger gives the same press with larger forces.
    fn lines(&mut self, free: &[f64]) -> Result<Vec<Line>, Failure> {
        let values: Vec<f64> = self.parameters().zip(free).map(|(p, &x)| Self::value(p, x)).collect();
        let (stiffness, own) = (values[0], &values[1..]);
        let at = match self.known.iter().position(|(known, _)| known == own) {
            Some(at) => at,
            None => {
                let config = (self.candidate.finger)(own, self.folder)?;
                self.known.push((own.to_vec(), Lab::new(config, MeshPreset::Coarse).deep_press()?));
                self.known.len() - 1
            }
        };
        let stiffer = |p: &PressLimit| PressLimit { normal_force_n: stiffness * p.normal_force_n, ..*p };
        let presses: Vec<PressLimit> = self.known[at].1.iter().map(stiffer).collect();
        Ok(area_lines(&presses).into_iter().chain(depth_lines(&presses)).collect())
    }

    fn run(mut self) -> Result<Fitted, Failure> {
        let start: Vec<f64> = self.parameters().map(Self::free).collect();
        // A press has an error of some per mille: derivatives over less would be its noise.
        let minimiser = LevenbergMarquardt::new().with_tol(1e-2).with_patience(4);
        let (end, _) = minimise(&mut self, &start, &minimiser);
        if let Some(error) = self.error.take() {
            return Err(error);
        }
        let lines = self.lines(&end)?;
        let columns = self.jacobian(&end).ok_or("a press near the fit failed")?;
        let errors = standard_errors(&columns);
        let values = self.parameters().zip(end.iter().zip(errors)).map(|(parameter, (&free, error))| {
            let value = Self::value(parameter, free);
            [value, 0.5 * (Self::value(parameter, free + error) - Self::value(parameter, free - error))]
        });
        let values = values.collect();
        let sum = lines.iter().map(|line| residual(line).powi(2)).sum();
        Ok(Fitted { values, lines, sum })
    }
}

impl Problem for Fit<'_> {
    fn residuals(&mut self, at: &[f64]) -> Option<Vec<f64>> {
        match self.lines(at) {
            Ok(lines) => Some(lines.iter().map(residual).collect()),
            Err(error) => {
                self.error = Some(error);
                None
            }
        }
    }

    fn jacobian(&mut self, at: &[f64]) -> Option<Vec<Vec<f64>>> {
        const STEP: f64 = 0.15;
        let mut moved = at.to_vec();
        let mut columns = Vec::new();
        for k in 0..at.len() {
            let sides = [STEP, -STEP].map(|step| {
                moved[k] = at[k] + step;
                self.residuals(&moved)
            });
            moved[k] = at[k];
            let [Some(up), Some(down)] = sides else { return None };
            columns.push(up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * STEP)).collect());
        }
        Some(columns)
    }
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
pub fn section(folder: &Path, jobs: usize) -> Result<String, Failure> {
    let mut fits = in_threads(&CANDIDATES, jobs, |candidate| -> Result<_, String> {
        let fitted = Fit { candidate, folder, known: Vec::new(), error: None }
            .run()
            .map_err(|e| format!("{}: {e}", candidate.name))?;
        eprintln!("{}: chi² {:.1}; {}", candidate.name, fitted.sum, all_said(candidate, &fitted));
        Ok((candidate, fitted))
    })?;
    fits.sort_by(|(_, a), (_, b)| a.sum.total_cmp(&b.sum));
    let mut text = String::from(
        "\n## Which effect is missing\n\nEach candidate is fitted to the five numbers marked `fitted`, in presses without friction on \
         the mesh `coarse`. The stiffness of the whole finger is free in each. Half of a band counts as two standard deviations; \
         chi² is the sum of the squares of five residuals. Friction changes none of the five.\n\n| candidate | chi² |",
    );
    for line in &fits[0].1.lines {
        write!(text, " {} |", line.name)?;
    }
    text += " parameters (standard error) |\n|---|---|---|---|---|---|---|---|\n";
    for (candidate, fit) in &fits {
        write!(text, "| {} | {:.1} |", candidate.name, fit.sum)?;
        for line in &fit.lines {
            write!(text, " {} |", line.text())?;
        }
        writeln!(text, " {} |", all_said(candidate, fit))?;
    }
    let (best, second) = (&fits[0], &fits[1]);
    write!(
        text,
        "\n**Named: {}.** Its chi² of {:.1} compares with {:.1} of the next, {}.\n",
        best.0.name, best.1.sum, second.1.sum, second.0.name
    )?;
    Ok(text)
}

/// The fitted parameters in words.
fn all_said(candidate: &Candidate, fit: &Fitted) -> String {
    let parameters = std::iter::once(&STIFFNESS).chain(candidate.parameters).zip(&fit.values);
    parameters.map(|(parameter, value)| said(parameter, *value)).collect::<Vec<_>>().join("; ")
}

/// A fitted parameter in words.
fn said(parameter: &Parameter, [value, error]: [f64; 2]) -> String {
    let [low, high] = parameter.bounds;
    let at = |bound: f64| (value / bound).ln().abs() < 0.03 * (high / low).ln();
    let bound = if at(low) || at(high) { ", at its bound" } else { "" };
    format!("{} {value:.2} (±{error:.2}{bound})", parameter.name)
}
