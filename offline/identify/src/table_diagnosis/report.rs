//! Report of the fits of a table: cells, steps, candidates, sentences, corrected tables.
//!
//! Main type: [`Results`]. Computes only differences and root mean squares of its inputs.

use fingerpad_diagnose::{
    CandidateLaw, Diagnosis, EffectFound, FittedParameter, INDISTINGUISHABLE, LawTest, Verdict, reduced_report,
};
use fingerpad_fe::mesh::FingertipShape;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::corrected::CorrectedFinger;
use super::effects::{EFFECTS, Effect, Parameter, Values};
use super::fit::{Fitted, Task, rms_percent};
use super::measured::{Measured, MeasuredTable, QUANTITIES};
use super::plan::{experiments, next_experiment};
use super::procedure::{Finding, Input};
use super::reading::corrected;
use super::search::Candidate;
use super::section::{CellGap, FiniteElementsUsed, Step, TableReport, TableSection};

/// Values of a model before any effect is added, and its readings per slot.
pub type Before = (Values, Vec<[f64; 3]>);

/// What the report is made of.
pub struct Results<'a> {
    pub input: &'a Input<'a>,
    /// The table on the regression.
    pub task: &'a Task<'a>,
    /// All candidates, the one without effects first.
    pub candidates: Vec<Candidate>,
    pub verdict: Verdict,
    /// Indices of those that contend, the best one first.
    pub contenders: Vec<usize>,
    /// The finger as given.
    pub published: Before,
    pub calibrated: Before,
    /// Effects that could not be tested, and why.
    pub untested: Vec<(&'static Effect, String)>,
}

impl Results<'_> {
    /// Report, sentences, corrected finger (of shape `shape`) and tables.
    pub fn finding(mut self, used: FiniteElementsUsed, shape: &FingertipShape) -> Finding {
        self.compare();
        let config = self.input.config;
        let (contenders, best) = (self.contenders(), &self.best().values);
        let [given, after] = [&self.published.0, best].map(|values| values.law().friction(&config.friction));
        let section = TableSection {
            finite_elements: used,
            published: given,
            calibrated_stiffness: self.calibrated.0[Parameter::LN_STIFFNESS].exp(),
            calibrated_depth_offset_mm: self.calibrated.0[Parameter::DEPTH_OFFSET],
            corrected: after,
            corrected_stiffness: best[Parameter::LN_STIFFNESS].exp(),
            corrected_depth_offset_mm: best[Parameter::DEPTH_OFFSET],
            steps: self.steps(),
            cells: self.cells(),
            candidates: self.candidates.clone(),
            contenders: contenders.iter().map(|c| c.name.clone()).collect(),
            noise_factor: self.best().noise,
            spread_given: self.input.table.has_spread(),
            cannot_tell: self.undetermined(),
            decides: experiments(&contenders),
        };
        let mut diagnosis = self.diagnosis();
        if self.verdict == Verdict::Ambiguous {
            diagnosis.next_experiment = next_experiment(self.task, &contenders);
        }
        diagnosis.title = title(self.verdict, &section, self.best().rms_percent);
        Finding {
            sentences: self.sentences(&section),
            corrected: CorrectedFinger::new(config, shape, best, &self.input.table.depths_mm),
            corrected_csv: corrected_csv(&section.cells),
            side_by_side_csv: side_by_side_csv(&section.cells),
            report: TableReport { diagnosis, table: section },
        }
    }

    fn contenders(&self) -> Vec<&Candidate> {
        self.contenders.iter().map(|k| &self.candidates[*k]).collect()
    }

    fn best(&self) -> &Fitted {
        &self.contenders()[0].fitted
    }

    /// Completes the candidates by their comparison with each other.
    fn compare(&mut self) {
        let least = self.best().cost;
        let costs: Vec<(String, f64)> = self.candidates.iter().map(|c| (c.name.clone(), c.fitted.cost)).collect();
        for candidate in &mut self.candidates {
            let own = candidate.fitted.cost;
            let like = costs.iter().filter(|(name, c)| *name != candidate.name && (c - own).abs() < INDISTINGUISHABLE);
            candidate.explains_as_much = like.map(|(name, _)| name.clone()).collect();
            candidate.delta_2le = own - least;
        }
    }

    /// Every number of the table beside the models.
    fn cells(&self) -> Vec<CellGap> {
        let (table, best) = (&self.input.table, self.best());
        let cell = |m: &Measured| {
            let models = [&self.published.1, &self.calibrated.1, &best.readings];
            let [as_given, calibrated, corrected] = models.map(|readings| readings[m.slot][m.quantity]);
            let percent = |model: f64| 100.0 * (model / m.value - 1.0);
            CellGap {
                row: m.row + 1,
                depth_mm: table.depths_mm[m.slot],
                corrected_depth_mm: best.values.depth_mm(table.depths_mm[m.slot], m.slot),
                quantity: QUANTITIES[m.quantity],
                measured: m.value,
                relative_sd: m.relative_sd,
                as_given,
                as_given_percent: percent(as_given),
                calibrated,
                calibrated_percent: percent(calibrated),
                corrected,
                corrected_percent: percent(corrected),
                measured_corrected: self.without_instruments(m),
            }
        };
        table.numbers.iter().map(cell).collect()
    }

    /// A measured number without the effects of the instruments; what its row lacks is taken from the model.
    fn without_instruments(&self, m: &Measured) -> f64 {
        let measured = MeasuredTable::cells(&self.input.table.rows[m.row]);
        let readings = std::array::from_fn(|q| measured[q].map_or(self.best().readings[m.slot][q], |cell| cell.value));
        corrected(&self.best().values, readings).map_or(m.value, |without| without[m.quantity])
    }

    /// The gap from the finger as given to the corrected model.
    fn steps(&self) -> Vec<Step> {
        let gap = |(_, readings): &Before| rms_percent(&self.input.table.numbers, readings);
        let fit = |name, words: &str, fit: &Fitted| (name, words.to_owned(), fit.freedoms, fit.rms_percent);
        let calibrated = "published constants, stiffness and touch point calibrated on normal force and area";
        let mut out = vec![
            ("as_given", "published constants, finger as given".to_owned(), 0, gap(&self.published)),
            ("calibrated", calibrated.to_owned(), 2, gap(&self.calibrated)),
            fit("constants", "stiffness, touch point and strength refitted to all numbers", &self.candidates[0].fitted),
        ];
        let four = self.candidates.iter().find(|c| c.name == "exponent");
        out.extend(four.map(|c| fit("four_constants", "the exponent as well", &c.fitted)));
        let best = self.contenders()[0];
        if !best.fitted.effects.is_empty() {
            out.push(fit("corrected", &format!("{} beside the three constants", in_words(&best.name)), &best.fitted));
        }
        let step = |(name, words, freedoms, rms_percent)| Step { name, words, freedoms, rms_percent };
        out.into_iter().map(step).collect()
    }

    /// The fields that every diagnosis has.
    fn diagnosis(&self) -> Diagnosis {
        let (table, best, verdict) = (&self.input.table, self.best(), self.verdict);
        let numbers = &table.numbers;
        // Of normal force and friction, N; friction is the coefficient at the modelled load.
        let rms_n = |readings: &[[f64; 3]], of: &dyn Fn(&Measured) -> f64| {
            let [normal, friction] = [0, 2].map(|quantity| {
                let own = numbers.iter().filter(|m| m.quantity == quantity);
                let load_n = |m: &Measured| if quantity == 0 { 1.0 } else { readings[m.slot][0] };
                let squares: Vec<f64> = own.map(|m| (of(m) * load_n(m)).powi(2)).collect();
                (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
            });
            [normal, friction, 0.0]
        };
        let gap_n = |readings: &[[f64; 3]]| rms_n(readings, &|m| readings[m.slot][m.quantity] - m.value);
        let before = gap_n(&self.calibrated.1);
        let mut report = reduced_report(
            verdict,
            "finite elements with the published constants, finger calibrated",
            [before, if verdict.is_claim() { gap_n(&best.readings) } else { before }],
            rms_n(&best.readings, &|m| m.relative_sd * m.value),
            "none: each depth left out and predicted, in section table",
            table.rows.len(),
        );
        report.noise.multiplicative = numbers.iter().map(|m| m.relative_sd).sum::<f64>() / numbers.len() as f64;
        report.noise.source = if table.has_spread() { "repeats" } else { "assumed" }.into();
        report.baseline.rescale.stiffness = best.values[Parameter::LN_STIFFNESS].exp();
        let ln_strength = |values: &Values| values[Parameter::LN_STRENGTH];
        report.baseline.rescale.strength = (ln_strength(&best.values) - ln_strength(&self.published.0)).exp();
        report.tests = EFFECTS.iter().map(|effect| self.test(effect)).collect();
        if verdict.is_claim() {
            report.effects = best.effects.iter().map(|effect| self.effect(effect)).collect();
            report.corrected_model = Some("corrected.toml".into());
        }
        report
    }

    /// The test of an effect beside the finger's constants.
    fn test(&self, effect: &Effect) -> LawTest {
        let single = self.candidates.iter().find(|c| c.name == effect.name);
        let gain = single.map_or(0.0, |c| self.candidates[0].fitted.cost - c.fitted.cost);
        let reason = match self.untested.iter().find(|(e, _)| *e == effect) {
            Some((_, reason)) => reason.clone(),
            None if effect.is_constant() => "fitted in every model: a constant of the finger".into(),
            None => String::new(),
        };
        LawTest {
            law: effect.name.into(),
            family: effect.name.into(),
            gain_2ll: gain,
            p_model: p_of(gain),
            p_runs: 1.0,
            significant: gain > INDISTINGUISHABLE,
            testable: reason.is_empty(),
            reason,
        }
    }

    /// An effect of the best explanation, with the alternatives to that.
    fn effect(&self, effect: &Effect) -> EffectFound {
        let (best, none) = (self.best(), &self.candidates[0].fitted);
        let gain = none.cost - best.cost;
        let candidate = |Candidate { name, delta_2le, .. }: &Candidate| {
            let (law, family) = (name.clone(), name.clone());
            CandidateLaw { law, family, delta_2ll: *delta_2le, lambda_rival: delta_2le.abs() }
        };
        let pairs = best.readings.iter().flatten().zip(none.readings.iter().flatten()).enumerate();
        let changes = pairs.filter(|(i, _)| i % 3 != 1).map(|(_, (a, b))| (a / b - 1.0).abs());
        let own: Vec<_> = effect.parameters(best.readings.len()).into_iter().map(Parameter::name).collect();
        EffectFound {
            law: effect.name.into(),
            family: effect.name.into(),
            parameters: best.parameters.iter().filter(|p| own.contains(&p.name)).cloned().collect(),
            size_p90_relative: changes.fold(0.0, f64::max),
            gain_2ll: gain,
            p: p_of(gain),
            p_model: p_of(gain),
            p_runs: 1.0,
            against_calibration: true,
            lambda_detect: gain,
            candidates: self.contenders().into_iter().map(candidate).collect(),
            ..EffectFound::default()
        }
    }

    /// Constants and effects that the table does not determine.
    fn undetermined(&self) -> Vec<String> {
        let table = &self.input.table;
        let (numbers, depths) = (table.numbers.len(), table.depths_mm.len());
        let fitted = self.best().freedoms;
        let mut out = vec![format!(
            "{numbers} numbers at {depths} depths against {fitted} fitted ones: they allow an explanation, no proof."
        )];
        let names: Vec<&str> = self.contenders().iter().map(|c| c.name.as_str()).collect();
        if names.len() > 1 {
            out.push(format!("{} cannot be distinguished from {}.", names[0], names[1..].join(", ")));
        }
        if !table.has_spread() {
            let assumed = "columns ..._sd): 5 % is assumed there, and its error is fitted too";
            out.push(format!("Not every cell has its own spread ({assumed}."));
        }
        out.extend(self.untested.iter().map(|(effect, reason)| format!("{} was not tested: {reason}.", effect.name)));
        out.push(
            "Stiffness, touch point and strength are fitted in every model: that a finger is softer or moister than the \
             simulated one is no effect, and an equal error of all depths cannot be distinguished from another touch point."
                .into(),
        );
        out
    }

    fn sentences(&self, section: &TableSection) -> Vec<String> {
        let step = |s: &Step| format!("{:.1} % with {} ({} fitted)", s.rms_percent, s.words, s.freedoms);
        let steps: Vec<String> = section.steps.iter().map(step).collect();
        let mut out = vec![format!("Root mean square gap of all numbers: {}.", steps.join("; "))];
        for candidate in self.contenders().iter().filter(|c| !c.fitted.effects.is_empty()) {
            let value = |FittedParameter { name, value, unit, ci95: [low, high] }: &FittedParameter| {
                format!("{name} {value:.4} {unit} ({low:.4} to {high:.4})")
            };
            let found: Vec<String> = candidate.fitted.parameters.iter().map(value).collect();
            out.push(format!("{}: {}.", candidate.name, found.join("; ")));
        }
        let TableSection { corrected: law, corrected_stiffness, corrected_depth_offset_mm: offset_mm, .. } = section;
        let (lambda, beta, tau0_kpa) = (law.lambda, law.beta, 1e3 * law.tau0_mpa);
        out.push(format!(
            "lambda {lambda:.4}, beta {beta:.3}, tau_0 {tau0_kpa:.2} kPa, stiffness factor {corrected_stiffness:.3}, depth offset \
             {offset_mm:+.3} mm."
        ));
        out.extend(section.cannot_tell.iter().chain(&section.decides).cloned());
        out
    }
}

/// p of a gain of one parameter.
fn p_of(gain: f64) -> f64 {
    ChiSquared::new(1.0).map_or(1.0, |chi| chi.sf(gain.max(0.0)))
}

fn in_words(name: &str) -> String {
    name.replace('_', " ").replace('+', " and ")
}

/// The verdict in words, with the gap before and `after`, %.
fn title(verdict: Verdict, section: &TableSection, after: f64) -> String {
    let names: Vec<String> = section.contenders.iter().take(2).map(|name| in_words(name)).collect();
    let more = if section.contenders.len() > 2 { " or another" } else { "" };
    let finding = match verdict {
        Verdict::None => "Nothing is missing: the finger's constants explain the table".into(),
        Verdict::Named => format!("Missing: {}", names[0]),
        Verdict::Ambiguous => format!("Missing: {}{more}, and this table cannot tell which", names.join(" or ")),
        Verdict::UnexplainedStructure => "Unexplained: no candidate brings the gap down to the errors".into(),
    };
    let given = section.steps[0].rms_percent;
    format!("{finding}. The gap falls from {given:.1} to {after:.1} %.")
}

/// The corrected table, for `identify` and `build`.
fn corrected_csv(cells: &[CellGap]) -> String {
    let order = [QUANTITIES[0], QUANTITIES[2], QUANTITIES[1]];
    let columns: Vec<&str> = order.into_iter().filter(|q| cells.iter().any(|c| c.quantity == *q)).collect();
    let mut out = format!("depth_mm,{}\n", columns.join(","));
    for row in cells.chunk_by(|a, b| a.row == b.row) {
        out += &format!("{:.4}", row[0].corrected_depth_mm);
        for column in &columns {
            let cell = row.iter().find(|c| c.quantity == *column);
            out += &cell.map_or_else(|| ",".to_owned(), |c| format!(",{:.5}", c.measured_corrected));
        }
        out.push('\n');
    }
    out
}

/// Measured and modelled numbers side by side.
fn side_by_side_csv(cells: &[CellGap]) -> String {
    let names =
        "measured,published,published_gap_percent,calibrated,calibrated_gap_percent,corrected,corrected_gap_percent";
    let mut out = format!("depth_mm,quantity,{names},measured_corrected\n");
    for c in cells {
        let before = [c.measured, c.as_given, c.as_given_percent, c.calibrated, c.calibrated_percent];
        let after = [c.corrected, c.corrected_percent, c.measured_corrected];
        let numbers: Vec<String> = before.iter().chain(&after).map(|v| format!("{v:.5}")).collect();
        out += &format!("{},{},{}\n", c.depth_mm, c.quantity, numbers.join(","));
    }
    out
}
