//! Report of the fits of a table: cells, steps, candidates, sentences, corrected tables.
//!
//! Main type: [`FindingBuilder`]. Computes only differences and root mean squares of its inputs.

use std::fmt::Write as _;

use fingerpad_diagnose::{CandidateLaw, Diagnosis, EffectFound, FittedParameter, LawTest, Verdict, reduced_report};
use fingerpad_fe::mesh::FingertipShape;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::corrected::CorrectedFinger;
use super::decide::Rivals;
use super::fit::{Fitted, rms_percent};
use super::measured::{MeasuredTable, QUANTITIES};
use super::outcome::*;
use super::parameters::{Effect, Parameter, Values};
use super::procedure::{Finding, Input};
use super::reading::{corrected, law_of};
use super::search::Candidate;
use super::surface::FittedSurface;
use super::verdict::{APART, Answer};

/// Models before any effect is added, with their readings.
pub struct Before {
    /// The finger as given.
    pub published: Values,
    /// The finger calibrated.
    pub calibration: Values,
    /// Readings of the first.
    pub as_given: Vec<[f64; 3]>,
    /// Readings of the second.
    pub calibrated: Vec<[f64; 3]>,
}

/// Inputs of the report.
pub struct FindingBuilder<'a> {
    /// Table and finger.
    pub input: &'a Input<'a>,
    /// Shape of the finger.
    pub shape: &'a FingertipShape,
    /// The regression.
    pub surface: &'a FittedSurface,
    /// All candidates, the one without effects first.
    pub candidates: &'a [Candidate],
    /// The verdict on them.
    pub answer: &'a Answer,
    /// The models before anything is added.
    pub before: &'a Before,
}

impl FindingBuilder<'_> {
    fn best(&self) -> &Fitted {
        &self.candidates[self.answer.best].fitted
    }

    /// Report, sentences, corrected finger and tables.
    ///
    /// * `untested`: effects that could not be tested, and why
    pub fn finding(&self, used: FiniteElementsUsed, untested: &[(Effect, String)]) -> Finding {
        let table = &self.input.table;
        let rivals = Rivals {
            table,
            surface: self.surface,
            fits: self.answer.contenders.iter().map(|k| &self.candidates[*k].fitted).collect(),
        };
        let cells = self.cells();
        let constants = |values: &Values| {
            let law = law_of(values).friction(&self.input.config.friction);
            LawConstants { lambda: law.lambda, beta: law.beta, tau0_mpa: law.tau0_mpa }
        };
        let best = &self.best().values;
        let section = TableSection {
            finite_elements: used,
            published: constants(&self.before.published),
            calibrated_stiffness: self.before.calibration.get(Parameter::LnStiffness).exp(),
            calibrated_depth_offset_mm: self.before.calibration.get(Parameter::DepthOffset),
            corrected: constants(best),
            corrected_stiffness: best.get(Parameter::LnStiffness).exp(),
            corrected_depth_offset_mm: best.get(Parameter::DepthOffset),
            steps: self.steps(),
            candidates: self.candidate_reports(),
            contenders: self.answer.contenders.iter().map(|k| name_of(&self.candidates[*k])).collect(),
            noise_factor: self.best().noise,
            spread_given: table.has_spread(),
            cannot_tell: self.undetermined(untested),
            decides: rivals.sentences(),
            cells,
        };
        let mut diagnosis = self.diagnosis(untested);
        if self.answer.verdict == Verdict::Ambiguous {
            diagnosis.next_experiment = rivals.next_experiment();
        }
        let report = TableReport { diagnosis, table: section };
        Finding {
            sentences: self.sentences(&report.table),
            corrected: CorrectedFinger::new(self.input.config, self.shape, best, &table.depths_mm),
            corrected_csv: self.corrected_csv(&report.table.cells),
            side_by_side_csv: side_by_side_csv(&report.table.cells),
            report,
        }
    }

    /// Every number of the table beside the models.
    fn cells(&self) -> Vec<CellGap> {
        let table = &self.input.table;
        let best = self.best();
        let percent = |model: f64, measured: f64| 100.0 * (model / measured - 1.0);
        let one = |m: &super::measured::Measured| {
            let (given, calibrated, after) = (
                self.before.as_given[m.slot][m.quantity],
                self.before.calibrated[m.slot][m.quantity],
                best.readings[m.slot][m.quantity],
            );
            CellGap {
                row: m.row + 1,
                depth_mm: table.depths_mm[m.slot],
                corrected_depth_mm: table.depths_mm[m.slot]
                    + best.values.get(Parameter::DepthOffset)
                    + best.values.get(Parameter::DepthError(m.slot)),
                quantity: QUANTITIES[m.quantity].into(),
                measured: m.value,
                relative_sd: m.relative_sd,
                as_given: given,
                as_given_percent: percent(given, m.value),
                calibrated,
                calibrated_percent: percent(calibrated, m.value),
                corrected: after,
                corrected_percent: percent(after, m.value),
                measured_corrected: self.without_instruments(m.row, m.quantity).unwrap_or(m.value),
            }
        };
        table.numbers().iter().map(one).collect()
    }

    /// A measured number without the effects of the instruments; needs normal force and friction of its row.
    fn without_instruments(&self, row: usize, quantity: usize) -> Option<f64> {
        let table = &self.input.table;
        let [normal, area, coefficient] = MeasuredTable::cells(&table.rows[row]);
        let modelled = self.best().readings[table.slot[row]];
        let taken = |cell: Option<crate::table_csv::Cell>, q: usize| cell.map_or(modelled[q], |c| c.value);
        let left = corrected(&self.best().values, taken(normal, 0), taken(coefficient, 2), taken(area, 1))?;
        [Some(left[0]), None, Some(left[1])][quantity]
    }

    /// The gap from the finger as given to the corrected model.
    fn steps(&self) -> Vec<Step> {
        let numbers = self.input.table.numbers();
        let step =
            |name: &str, words: String, freedoms, rms_percent| Step { name: name.into(), words, freedoms, rms_percent };
        let mut out = vec![
            step(
                "as_given",
                "published constants, finger as given".into(),
                0,
                rms_percent(&numbers, &self.before.as_given),
            ),
            step(
                "calibrated",
                "published constants, stiffness and touch point calibrated on normal force and area".into(),
                2,
                rms_percent(&numbers, &self.before.calibrated),
            ),
        ];
        let mut add = |name: &str, words: String, candidate: &Candidate| {
            out.push(step(name, words, candidate.fitted.free.len(), candidate.fitted.rms_percent));
        };
        add("constants", "stiffness, touch point and strength refitted to all numbers".into(), &self.candidates[0]);
        if let Some(four) = self.candidates.iter().find(|c| c.fitted.model.effects == [Effect::Exponent]) {
            add("four_constants", "the exponent as well".into(), four);
        }
        if self.answer.best != 0 {
            let best = &self.candidates[self.answer.best];
            let words: Vec<&str> = best.fitted.model.effects.iter().map(|e| e.words()).collect();
            add("corrected", format!("{} beside the three constants", words.join(" and ")), best);
        }
        out
    }

    fn candidate_reports(&self) -> Vec<CandidateReport> {
        let least = self.candidates[self.answer.best].fitted.cost;
        let name = |k: usize| name_of(&self.candidates[k]);
        let like = |k: usize| -> Vec<String> {
            let own = self.candidates[k].fitted.cost;
            let as_good = |other: &usize| *other != k && (self.candidates[*other].fitted.cost - own).abs() < APART;
            (0..self.candidates.len()).filter(as_good).map(name).collect()
        };
        (0..self.candidates.len())
            .map(|k| {
                let c = &self.candidates[k];
                CandidateReport {
                    name: name(k),
                    effects: c.fitted.model.effects.iter().map(|e| e.name().to_owned()).collect(),
                    parameters: parameters(&c.fitted),
                    freedoms: c.fitted.free.len(),
                    rms_percent: c.fitted.rms_percent,
                    alone_rms_percent: c.alone_rms_percent,
                    left_out_rms_percent: c.left_out_rms_percent,
                    delta_2le: c.fitted.cost - least,
                    explains_as_much: like(k),
                    by_finite_elements: c.checked,
                }
            })
            .collect()
    }

    /// The fields that every diagnosis has.
    fn diagnosis(&self, untested: &[(Effect, String)]) -> Diagnosis {
        let table = &self.input.table;
        let numbers = table.numbers();
        let force_rms = |readings: &[[f64; 3]]| -> [f64; 3] {
            let of = |quantity: usize, force: &dyn Fn(&[f64; 3]) -> f64, scale: &dyn Fn(usize) -> f64| {
                let own: Vec<f64> = (numbers.iter().filter(|m| m.quantity == quantity))
                    .map(|m| (force(&readings[m.slot]) - m.value) * scale(m.slot))
                    .collect();
                if own.is_empty() { 0.0 } else { (own.iter().map(|r| r * r).sum::<f64>() / own.len() as f64).sqrt() }
            };
            // Friction as the coefficient's difference at the modelled load.
            [of(0, &|r| r[0], &|_| 1.0), of(2, &|r| r[2], &|slot| readings[slot][0]), 0.0]
        };
        let (before, after) = (force_rms(&self.before.calibrated), force_rms(&self.best().readings));
        let floor = {
            let scale = |quantity: usize| {
                let own = numbers.iter().filter(|m| m.quantity == quantity);
                let forces: Vec<f64> = own
                    .map(|m| {
                        m.relative_sd * if quantity == 0 { m.value } else { m.value * self.best().readings[m.slot][0] }
                    })
                    .collect();
                (forces.iter().map(|f| f * f).sum::<f64>() / forces.len().max(1) as f64).sqrt()
            };
            [scale(0), scale(2), 0.0]
        };
        let claimed = self.answer.verdict.is_claim();
        let mut report = reduced_report(
            self.answer.verdict,
            "finite elements with the published constants, finger calibrated",
            [before, if claimed { after } else { before }],
            floor,
            "each depth left out and predicted: section table",
            table.rows.len(),
        );
        report.noise.multiplicative = numbers.iter().map(|m| m.relative_sd).sum::<f64>() / numbers.len() as f64;
        report.noise.source = if table.has_spread() { "repeats" } else { "assumed" }.into();
        report.baseline.rescale.stiffness = self.best().values.get(Parameter::LnStiffness).exp();
        report.baseline.rescale.strength =
            (self.best().values.get(Parameter::LnStrength) - self.before.published.get(Parameter::LnStrength)).exp();
        report.tests = self.tests(untested);
        if claimed {
            report.effects = self.effects();
            report.corrected_model = Some("corrected.toml".into());
        }
        report
    }

    /// One test for each effect, beside the finger's constants.
    fn tests(&self, untested: &[(Effect, String)]) -> Vec<LawTest> {
        let none = &self.candidates[0].fitted;
        let test = |effect: &Effect| {
            let single = self.candidates.iter().find(|c| c.fitted.model.effects == [*effect]);
            let gain = single.map_or(0.0, |c| none.cost - c.fitted.cost);
            let reason = match untested.iter().find(|(e, _)| e == effect) {
                Some((_, reason)) => reason.clone(),
                None if effect.is_constant() => "fitted in every model: a constant of the finger".into(),
                None => String::new(),
            };
            LawTest {
                law: effect.name().into(),
                family: effect.name().into(),
                gain_2ll: gain,
                p_model: p_of(gain),
                p_runs: 1.0,
                significant: gain > APART,
                testable: reason.is_empty(),
                reason,
            }
        };
        Effect::ALL.iter().map(test).collect()
    }

    /// The effects of the best explanation, each with the alternatives to it.
    fn effects(&self) -> Vec<EffectFound> {
        let best = self.best();
        let none = self.candidates[0].fitted.cost;
        let gain = none - best.cost;
        let candidates: Vec<CandidateLaw> = (self.answer.contenders.iter())
            .map(|k| {
                let fitted = &self.candidates[*k].fitted;
                let (law, delta) = (fitted.model.name(), fitted.cost - best.cost);
                CandidateLaw { family: law.clone(), law, delta_2ll: delta, lambda_rival: delta.abs() }
            })
            .collect();
        let changes: Vec<f64> = (best.readings.iter().zip(&self.candidates[0].fitted.readings))
            .flat_map(|(a, b)| [0, 2].map(|q| (a[q] / b[q] - 1.0).abs()))
            .collect();
        let one = |effect: &Effect| {
            let own = effect.parameters(self.input.table.depths_mm.len());
            EffectFound {
                law: effect.name().into(),
                family: effect.name().into(),
                formula: String::new(),
                parameters: parameters_of(best, |p| own.contains(&p)),
                size_p90_relative: changes.iter().copied().fold(0.0, f64::max),
                gain_2ll: gain,
                p: p_of(gain),
                p_model: p_of(gain),
                p_runs: 1.0,
                against_calibration: true,
                outside_calibration: false,
                own: None,
                lambda_detect: gain,
                candidates: candidates.clone(),
            }
        };
        best.model.effects.iter().map(one).collect()
    }

    /// Constants and effects that the table does not determine.
    fn undetermined(&self, untested: &[(Effect, String)]) -> Vec<String> {
        let table = &self.input.table;
        let mut out = vec![format!(
            "{} numbers at {} depths against {} fitted ones: they allow an explanation, no proof.",
            table.numbers().len(),
            table.depths_mm.len(),
            self.best().free.len()
        )];
        let rivals: Vec<String> =
            self.answer.contenders.iter().skip(1).map(|k| name_of(&self.candidates[*k])).collect();
        if !rivals.is_empty() {
            out.push(format!(
                "{} cannot be distinguished from {}.",
                name_of(&self.candidates[self.answer.best]),
                rivals.join(", ")
            ));
        }
        if !table.has_spread() {
            out.push(
                "Not every cell has its own spread (columns ..._sd): 5 % is assumed there, and its error \
                 is fitted too."
                    .into(),
            );
        }
        out.extend(untested.iter().map(|(effect, reason)| format!("{} was not tested: {reason}.", effect.name())));
        out.push(
            "Stiffness, touch point and strength are fitted in every model: that a finger is softer or moister than the \
             simulated one is no effect, and an equal error of all depths cannot be distinguished from another touch point."
                .into(),
        );
        out
    }

    fn sentences(&self, section: &TableSection) -> Vec<String> {
        let mut out = Vec::new();
        let steps: Vec<String> = section
            .steps
            .iter()
            .map(|s| format!("{:.1} % with {} ({} fitted)", s.rms_percent, s.words, s.freedoms))
            .collect();
        out.push(format!("Root mean square gap of all numbers: {}.", steps.join("; ")));
        let best = &self.candidates[self.answer.best];
        if self.answer.best != 0 {
            let found: Vec<String> = parameters(&best.fitted)
                .iter()
                .map(|p| format!("{} {:.4} {} ({:.4} to {:.4})", p.name, p.value, p.unit, p.ci95[0], p.ci95[1]))
                .collect();
            out.push(format!("{}: {}.", name_of(best), found.join("; ")));
        }
        out.push(format!(
            "lambda {:.4}, beta {:.3}, stiffness factor {:.3}, depth offset {:+.3} mm.",
            section.corrected.lambda,
            section.corrected.beta,
            section.corrected_stiffness,
            section.corrected_depth_offset_mm
        ));
        out.extend(section.cannot_tell.iter().cloned());
        out.extend(section.decides.iter().cloned());
        out
    }

    /// The corrected table, for `identify` and `build`.
    fn corrected_csv(&self, cells: &[CellGap]) -> String {
        let order = ["normal_force_n", "friction_coefficient", "contact_area_mm2"];
        let columns: Vec<&str> = order.iter().filter(|q| cells.iter().any(|c| c.quantity == **q)).copied().collect();
        let mut out = format!("depth_mm,{}\n", columns.join(","));
        for row in 1..=self.input.table.rows.len() {
            let own = || cells.iter().filter(|c| c.row == row);
            let Some(first) = own().next() else { continue };
            let _ = write!(out, "{:.4}", first.corrected_depth_mm);
            for column in &columns {
                let cell = own().find(|c| c.quantity == *column);
                let _ = write!(out, ",{}", cell.map_or_else(String::new, |c| format!("{:.5}", c.measured_corrected)));
            }
            out.push('\n');
        }
        out
    }
}

/// p of a gain of one parameter.
fn p_of(gain: f64) -> f64 {
    ChiSquared::new(1.0).map_or(1.0, |chi| chi.sf(gain.max(0.0)))
}

fn name_of(candidate: &Candidate) -> String {
    let name = candidate.fitted.model.name();
    if name.is_empty() { "constants".into() } else { name }
}

/// Parameters of a fit with their 95 % intervals.
fn parameters(fitted: &Fitted) -> Vec<FittedParameter> {
    parameters_of(fitted, |p| !super::parameters::CONSTANTS.contains(&p))
}

fn parameters_of(fitted: &Fitted, wanted: impl Fn(Parameter) -> bool) -> Vec<FittedParameter> {
    (fitted.free.iter().filter(|(p, _)| wanted(*p)))
        .map(|(parameter, sd)| {
            let value = fitted.values.get(*parameter);
            let name = match parameter {
                Parameter::DepthError(slot) => format!("depth_error_{}_mm", slot + 1),
                other => other.name().to_owned(),
            };
            let ci95 = [value - 1.96 * sd, value + 1.96 * sd];
            FittedParameter { name, value, unit: parameter.unit().into(), ci95 }
        })
        .collect()
}

/// Measured and modelled numbers side by side.
fn side_by_side_csv(cells: &[CellGap]) -> String {
    let mut out =
        "depth_mm,quantity,measured,published,published_gap_percent,calibrated,calibrated_gap_percent,corrected,\
                   corrected_gap_percent,measured_corrected\n"
            .to_owned();
    for c in cells {
        let numbers = [
            c.measured,
            c.as_given,
            c.as_given_percent,
            c.calibrated,
            c.calibrated_percent,
            c.corrected,
            c.corrected_percent,
            c.measured_corrected,
        ];
        let numbers: Vec<String> = numbers.iter().map(|v| format!("{v:.5}")).collect();
        let _ = writeln!(out, "{},{},{}", c.depth_mm, c.quantity, numbers.join(","));
    }
    out
}
