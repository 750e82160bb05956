//! Calibration of the finger on normal force and area, and the joint fit of finger, depths and law.

use super::{
    CalibrationParameter, Evaluator, FeModel, FingerPoint, IdentifyError, LawPoint, Query, Steady, Table,
    bounded_least_squares::{Model, Solution, Stop, Variable, minimise},
    settings::{Compared, VariedParameter},
};
use fingerpad_fe::contact::RubberFriction;

/// Standard errors of the measurements: of natural logarithms, or in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Of ln N.
    pub normal_force: f64,
    /// Of ln A.
    pub contact_area: f64,
    /// Of ln(F/N); none leaves friction out.
    pub friction: Option<f64>,
    /// Of a depth, mm; none holds the depths.
    pub depth_mm: Option<f64>,
}

/// A fit of finger parameters, and with friction also of law and depths, to the table.
pub struct FingerFit<'a, 'r> {
    /// Fingers.
    pub evaluator: &'a Evaluator<'a>,
    /// The finger of the start's shape; other shapes are made when first needed.
    pub fe_model: &'a mut FeModel<'r>,
    /// Measured.
    pub table: &'a Table,
    /// Parameters of the finger that vary.
    pub vary: &'a [VariedParameter],
    /// State that normal force and area are compared at: press or slide.
    pub compared: Compared,
    /// Weights.
    pub errors: Errors,
    /// The finger to begin with.
    pub finger: FingerPoint,
    /// The law; searched for as well if friction is compared.
    pub law: LawPoint,
    /// Elastic slip and regularisation.
    pub base: RubberFriction,
    /// Bounds of ln(tau_ref) and beta.
    pub law_bounds: [[f64; 2]; 2],
    /// Largest evaluations.
    pub evaluations: usize,
    stage: &'static str,
    count: usize,
    /// Variables at which derivatives were taken last, and their columns.
    differentiated: Option<(Vec<f64>, Vec<Vec<f64>>)>,
}

/// A point of the fit's space.
#[derive(Clone, Debug, PartialEq)]
pub struct FitPoint {
    /// Finger.
    pub finger: FingerPoint,
    /// Law.
    pub law: LawPoint,
    /// Error of each slot's depth, mm.
    pub shifts_mm: Vec<f64>,
}

impl<'a, 'r> FingerFit<'a, 'r> {
    /// A fit under the name `stage`.
    #[expect(clippy::too_many_arguments, reason = "parameters, data and settings of the fit")]
    pub fn new(
        stage: &'static str,
        evaluator: &'a Evaluator<'a>,
        fe_model: &'a mut FeModel<'r>,
        table: &'a Table,
        vary: &'a [VariedParameter],
        compared: Compared,
        errors: Errors,
        finger: FingerPoint,
        law: LawPoint,
        evaluations: usize,
    ) -> Self {
        let settings = evaluator.settings;
        let base = evaluator.config.friction;
        let law_bounds = [settings.region.tau_ref_kpa.map(f64::ln), settings.region.beta];
        let (count, differentiated) = (0, None);
        Self {
            evaluator,
            fe_model,
            table,
            vary,
            compared,
            errors,
            finger,
            law,
            base,
            law_bounds,
            evaluations,
            stage,
            count,
            differentiated,
        }
    }

    fn with_law(&self) -> bool {
        self.errors.friction.is_some()
    }

    fn with_shifts(&self) -> bool {
        self.errors.depth_mm.is_some()
    }

    fn variables(&self) -> Vec<Variable> {
        let shallowest = self.table.depths_mm[0];
        let parameter = |k: &VariedParameter| {
            let [mut low, high] = k.bounds();
            if k.name == CalibrationParameter::DepthOffsetMm {
                // The shallowest slide must touch.
                low = low.max(0.15 - shallowest);
            }
            Variable { value: self.finger.get(k.name), bounds: [low, high] }
        };
        let mut variables: Vec<Variable> = self.vary.iter().map(parameter).collect();
        if self.with_law() {
            let x = self.law.coordinates(false);
            variables.extend((0..2).map(|k| Variable { value: x[k], bounds: self.law_bounds[k] }));
        }
        if let Some(error) = self.errors.depth_mm {
            let reach = (3.0 * error).min(0.4 * shallowest);
            variables.extend(self.table.depths_mm.iter().map(|_| Variable { value: 0.0, bounds: [-reach, reach] }));
        }
        variables
    }

    /// Variables at the start.
    pub fn start_values(&self) -> Vec<f64> {
        self.variables().iter().map(|v| v.value.clamp(v.bounds[0], v.bounds[1])).collect()
    }

    /// Name, unit and bounds of every variable.
    pub fn names_and_bounds(&self) -> (Vec<(String, String)>, Vec<[f64; 2]>) {
        let mut names: Vec<(String, String)> =
            self.vary.iter().map(|k| (k.name.words().to_owned(), k.name.unit().to_owned())).collect();
        if self.with_law() {
            names.push(("ln of the strength at 5 kPa in kPa".into(), String::new()));
            names.push(("beta".into(), String::new()));
        }
        if self.with_shifts() {
            let shift = |d: &f64| (format!("error of depth {d} mm"), "mm".to_owned());
            names.extend(self.table.depths_mm.iter().map(shift));
        }
        (names, self.variables().iter().map(|v| v.bounds).collect())
    }

    /// Finger, law and depth errors given by the variables.
    pub fn point(&self, x: &[f64]) -> FitPoint {
        let (parameters, rest) = x.split_at(self.vary.len());
        let finger = self.vary.iter().zip(parameters).fold(self.finger.clone(), |f, (p, v)| f.with(p.name, *v));
        let (law, shifts) = if self.with_law() { rest.split_at(2) } else { (&[][..], rest) };
        let law = if law.is_empty() { self.law } else { self.law.at(law) };
        let shifts_mm = if shifts.is_empty() { vec![0.0; self.table.depths_mm.len()] } else { shifts.to_vec() };
        FitPoint { finger, law, shifts_mm }
    }

    fn query(&self, point: &FitPoint, slot: usize) -> Query {
        let sliding = self.sliding(point, slot);
        if self.compared == Compared::Press && !self.with_law() {
            return Query { law: RubberFriction { lambda: 0.0, tau0_mpa: 0.0, ..sliding.law }, ..sliding };
        }
        sliding
    }

    fn sliding(&self, point: &FitPoint, slot: usize) -> Query {
        let law = point.law.friction(&self.base);
        let depth_mm = self.table.depths_mm[slot] + point.finger.depth_offset_mm + point.shifts_mm[slot];
        Query { depth_mm, law, stiffness: point.finger.stiffness }
    }

    /// Steady states per slot as they are compared.
    ///
    /// # Errors
    /// [`IdentifyError`].
    pub fn states(&mut self, point: &FitPoint) -> Result<Vec<Steady>, IdentifyError> {
        let slots = 0..self.table.depths_mm.len();
        let queries = slots.map(|slot| (slot, vec![self.query(point, slot)])).collect::<Vec<_>>();
        Ok(self.run_all(point, &queries)?.into_iter().flatten().collect())
    }

    /// Steady slides per slot.
    ///
    /// # Errors
    /// [`IdentifyError`].
    pub fn slides(&mut self, point: &FitPoint) -> Result<Vec<Steady>, IdentifyError> {
        let slots = 0..self.table.depths_mm.len();
        let queries = slots.map(|slot| (slot, vec![self.sliding(point, slot)])).collect::<Vec<_>>();
        Ok(self.run_all(point, &queries)?.into_iter().flatten().collect())
    }

    fn run_all(
        &mut self,
        point: &FitPoint,
        queries: &[(usize, Vec<Query>)],
    ) -> Result<Vec<Vec<Steady>>, IdentifyError> {
        let shape = &point.finger.shape;
        if shape == self.fe_model.shape() {
            self.fe_model.steady(queries)
        } else {
            self.evaluator.on_shape(shape, queries)
        }
    }

    /// Quantities of one slot in the order of the residuals: ln N, ln A, ln(F/N).
    fn logs(state: &Steady) -> [f64; 3] {
        [state.normal_force_n.ln(), state.contact_area_mm2.ln(), state.friction_coefficient().ln()]
    }

    /// Rows of the residuals: table row, quantity, measured logarithm, weight.
    fn rows(&self) -> Vec<(usize, usize, f64, f64)> {
        let mut rows = Vec::new();
        for (i, point) in self.table.points.iter().enumerate() {
            rows.push((i, 0, point.normal_force_n.ln(), 1.0 / self.errors.normal_force));
            if let Some(area) = point.contact_area_mm2 {
                rows.push((i, 1, area.ln(), 1.0 / self.errors.contact_area));
            }
            if let Some(error) = self.errors.friction
                && point.friction_coefficient > 0.0
            {
                rows.push((i, 2, point.friction_coefficient.ln(), 1.0 / error));
            }
        }
        rows
    }

    /// Fits.
    ///
    /// # Errors
    /// [`IdentifyError`].
    pub fn run(&mut self) -> Result<(FitPoint, Solution), IdentifyError> {
        let variables = self.variables();
        let rows = self.rows().len() + if self.with_shifts() { self.table.depths_mm.len() } else { 0 };
        if rows < variables.len() {
            return Err(IdentifyError::Table(format!(
                "{}: {} variables from {rows} measured values; let less vary",
                self.stage,
                variables.len()
            )));
        }
        let stop = Stop { tolerance: 1e-3, evaluations: self.evaluations };
        let stage = self.stage;
        let solution = minimise(stage, self, &variables, stop)?;
        Ok((self.point(&solution.values), solution))
    }
}

/// Sides of a difference.
const BOTH: &[f64] = &[1.0, -1.0];
/// Step of the law's coordinates.
const LAW_STEP: f64 = 0.03;

impl Model for FingerFit<'_, '_> {
    fn residuals(&mut self, x: &[f64]) -> Result<Vec<f64>, IdentifyError> {
        let point = self.point(x);
        let logs: Vec<_> = self.states(&point)?.iter().map(Self::logs).collect();
        let mut out: Vec<f64> = self
            .rows()
            .iter()
            .map(|&(row, quantity, measured, weight)| weight * (logs[self.table.slot[row]][quantity] - measured))
            .collect();
        if let Some(error) = self.errors.depth_mm {
            out.extend(point.shifts_mm.iter().map(|shift| shift / error));
        }
        self.count += 1;
        let norm = out.iter().map(|r| r * r).sum::<f64>().sqrt();
        (self.evaluator.hooks.report_progress)(
            self.stage,
            &format!("{} evaluations, residual {norm:.3} at {x:.3?}", self.count),
        );
        Ok(out)
    }

    /// Differences. Their values change little over half a step, so that they are not computed again there.
    fn jacobian(&mut self, x: &[f64]) -> Result<Vec<Vec<f64>>, IdentifyError> {
        if let Some((at, columns)) = &self.differentiated
            && at.iter().zip(x).zip(self.steps()).all(|((a, b), step)| (a - b).abs() <= 0.5 * step)
        {
            return Ok(columns.clone());
        }
        let mut columns = self.differences(x, BOTH);
        for side in BOTH {
            match columns {
                Err(error) if error.is_local() => columns = self.differences(x, &[*side]),
                _ => break,
            }
        }
        let columns = columns?;
        self.differentiated = Some((x.to_vec(), columns.clone()));
        Ok(columns)
    }
}

impl FingerFit<'_, '_> {
    /// Step of every variable's difference.
    fn steps(&self) -> Vec<f64> {
        let mut steps: Vec<f64> = self.vary.iter().map(|parameter| parameter.name.step()).collect();
        if self.with_law() {
            steps.extend([LAW_STEP; 2]);
        }
        if self.with_shifts() {
            steps.extend(self.table.depths_mm.iter().map(|_| CalibrationParameter::DepthOffsetMm.step()));
        }
        steps
    }

    /// Columns of the derivatives by differences to the `sides`: up (1), down (-1) or both.
    ///
    /// Numbers that change the shape are moved to one side only: each side is a finger of its own.
    fn differences(&mut self, x: &[f64], sides: &[f64]) -> Result<Vec<Vec<f64>>, IdentifyError> {
        let point = self.point(x);
        let slots = self.table.depths_mm.len();
        // Moves that keep the shape share one finger; a shift of its own slot is a move of the depth.
        let moved = |k: usize, h: f64| {
            let mut moved = point.clone();
            match k {
                0 => {
                    moved.finger =
                        point.finger.with(CalibrationParameter::DepthOffsetMm, point.finger.depth_offset_mm + h)
                }
                1 => moved.finger = point.finger.with(CalibrationParameter::Stiffness, point.finger.stiffness + h),
                _ => {
                    let mut coordinates = point.law.coordinates(false);
                    coordinates[k - 2] += h;
                    moved.law = point.law.at(&coordinates);
                }
            }
            moved
        };
        let steps = [
            CalibrationParameter::DepthOffsetMm.step(),
            CalibrationParameter::Stiffness.step() * point.finger.stiffness,
            LAW_STEP,
            LAW_STEP,
        ];
        let kept = if self.with_law() { 4 } else { 2 };
        let mut same = vec![point.clone()];
        same.extend(
            (0..kept).flat_map(|k| sides.iter().map(move |side| (k, side * steps[k]))).map(|(k, h)| moved(k, h)),
        );
        let queries: Vec<_> =
            (0..slots).map(|slot| (slot, same.iter().map(|p| self.query(p, slot)).collect())).collect();
        let states = self.run_all(&point, &queries)?;
        let base: Vec<[f64; 3]> = states.iter().map(|list| Self::logs(&list[0])).collect();
        let slope = |k: usize| -> Vec<[f64; 3]> {
            let side = |slot: usize, i: usize| Self::logs(&states[slot][1 + k * sides.len() + i]);
            let from = |slot: usize| if sides.len() == 2 { (side(slot, 1), -sides[1]) } else { (base[slot], 0.0) };
            (0..slots)
                .map(|slot| {
                    let (to, (from, back)) = (side(slot, 0), from(slot));
                    [0, 1, 2].map(|q| (to[q] - from[q]) / ((sides[0] + back) * steps[k]))
                })
                .collect()
        };
        let side = sides[0];
        let by_depth = slope(0);
        let mut columns: Vec<Vec<[f64; 3]>> = Vec::new();
        for parameter in self.vary {
            columns.push(match parameter.name {
                CalibrationParameter::DepthOffsetMm => by_depth.clone(),
                CalibrationParameter::Stiffness => slope(1),
                kind => {
                    let value = point.finger.get(kind);
                    let [low, high] = parameter.bounds();
                    let up = if value + kind.step() > high { false } else { side > 0.0 || value - kind.step() < low };
                    let h = if up { kind.step() } else { -kind.step() };
                    let moved = FitPoint { finger: point.finger.with(kind, value + h), ..point.clone() };
                    let logs = self.states(&moved)?.iter().map(Self::logs).collect::<Vec<_>>();
                    logs.iter().zip(&base).map(|(l, b)| [0, 1, 2].map(|q| (l[q] - b[q]) / h)).collect()
                }
            });
        }
        if self.with_law() {
            columns.extend([slope(2), slope(3)]);
        }
        if self.with_shifts() {
            columns.extend((0..slots).map(|own| {
                (0..slots).map(|slot| if slot == own { by_depth[slot] } else { [0.0; 3] }).collect::<Vec<_>>()
            }));
        }
        Ok(self.weighted(&columns))
    }

    /// Columns of the weighted residuals from the slopes of ln N, ln A and ln(F/N) per slot; those of depth errors last.
    fn weighted(&self, columns: &[Vec<[f64; 3]>]) -> Vec<Vec<f64>> {
        let slots = self.table.depths_mm.len();
        let rows = self.rows();
        let first_shift = columns.len() - if self.with_shifts() { slots } else { 0 };
        columns
            .iter()
            .enumerate()
            .map(|(k, column)| {
                let mut out: Vec<f64> =
                    rows.iter().map(|&(row, q, _, weight)| weight * column[self.table.slot[row]][q]).collect();
                if let Some(error) = self.errors.depth_mm {
                    out.extend((0..slots).map(|slot| if k == first_shift + slot { 1.0 / error } else { 0.0 }));
                }
                out
            })
            .collect()
    }
}
