//! The linear system of a contact subproblem's Newton step, and its solution.
//!
//! The matrix `1 + G K` (G compliance, K contact tangent) is dense in the active dofs, and its factor costs as much as
//! tens of its products. Few nodes start to slip, stick, touch or open from one step to the next, so that one factor,
//! in single precision, preconditions the steps of a whole increment.

use nalgebra::{RealField, convert};

use super::linear::{DenseLu, Factor, KrylovSolution, gmres, solve_dense};

/// Iterations that a kept factor may take before a new one is made.
const KEPT_ITERATIONS: usize = 30;

/// Iterations with a kept factor above which the next step gets a new one.
const GOOD_ITERATIONS: usize = 15;

/// Iterations with a new factor; the subproblem's next step corrects the remaining error.
const NEW_ITERATIONS: usize = 15;

/// Share of the active dofs that may be missing from a kept factor.
const MISSING_SHARE: f64 = 0.05;

/// The linear system of a Newton step: the active contact dofs' displacements, then the driven coordinates.
pub(super) struct ContactSystem {
    /// Active contact dofs.
    pub active: Vec<usize>,
    /// Compliance of the active dofs, column-major.
    compliance: Vec<f32>,
    /// Derivative of the force on the dofs over their places: first entry of each column, rows, values, N/mm.
    column_start: Vec<usize>,
    row: Vec<u32>,
    value: Vec<f64>,
    /// Derivative of the force on the active dofs over each driven coordinate.
    driven: Vec<Vec<f64>>,
    /// Derivatives of each balance over the active dofs, then over the driven coordinates.
    balances: Vec<Vec<f64>>,
}

impl ContactSystem {
    /// The system of these active dofs, whose forces change by the sum of `entries` (row, column, value), and of driven
    /// coordinates with their derivatives as in the fields.
    pub fn new(
        factor: &Factor,
        active: Vec<usize>,
        entries: &[(u32, u32, f64)],
        driven: Vec<Vec<f64>>,
        balances: Vec<Vec<f64>>,
    ) -> Self {
        let size = active.len();
        let mut of_column = vec![Vec::new(); size];
        for &(row, column, value) in entries {
            of_column[column as usize].push((row, value));
        }
        let (mut column_start, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        let mut sum = vec![0.0; size];
        let mut is_met = vec![false; size];
        for entries in of_column {
            let first = rows.len();
            for (row, value) in entries {
                if !std::mem::replace(&mut is_met[row as usize], true) {
                    rows.push(row);
                }
                sum[row as usize] += value;
            }
            for &row in &rows[first..] {
                values.push(std::mem::take(&mut sum[row as usize]));
                is_met[row as usize] = false;
            }
            column_start.push(rows.len());
        }
        let compliance = factor.compliance_among(&active);
        Self { active, compliance, column_start, row: rows, value: values, driven, balances }
    }

    fn size(&self) -> usize {
        self.active.len() + self.driven.len()
    }

    /// Change of the force on the active dofs as the unknowns change.
    pub fn force_change(&self, unknowns: &[f64]) -> Vec<f64> {
        let na = self.active.len();
        let mut force = vec![0.0; na];
        for (c, &moved) in unknowns[..na].iter().enumerate() {
            let entries = self.column_start[c]..self.column_start[c + 1];
            for (&row, value) in self.row[entries.clone()].iter().zip(&self.value[entries]) {
                force[row as usize] += value * moved;
            }
        }
        for (column, &moved) in self.driven.iter().zip(&unknowns[na..]) {
            force.iter_mut().zip(column).for_each(|(force, by)| *force += by * moved);
        }
        force
    }

    /// Columns of the compliance.
    fn columns(&self) -> std::slice::ChunksExact<'_, f32> {
        self.compliance.chunks_exact(self.active.len().max(1))
    }

    /// `out = matrix unknowns`.
    fn apply(&self, unknowns: &[f64], out: &mut [f64]) {
        let na = self.active.len();
        let force = self.force_change(unknowns);
        out[..na].copy_from_slice(&unknowns[..na]);
        let mut columns = self.columns();
        let (fours, rest) = force.as_chunks::<4>();
        for f in fours {
            let [a, b, c, d] = std::array::from_fn(|_| columns.next().expect("one a dof"));
            for i in 0..na {
                let ab = f64::from(a[i]) * f[0] + f64::from(b[i]) * f[1];
                out[i] += ab + (f64::from(c[i]) * f[2] + f64::from(d[i]) * f[3]);
            }
        }
        for (f, column) in rest.iter().zip(columns) {
            out[..na].iter_mut().zip(column).for_each(|(out, g)| *out += f64::from(*g) * f);
        }
        for (out, balance) in out[na..].iter_mut().zip(&self.balances) {
            *out = balance.iter().zip(unknowns).map(|(by, moved)| by * moved).sum();
        }
    }

    /// The matrix, column-major.
    fn matrix<T: RealField + Copy>(&self) -> Vec<T> {
        let (na, size) = (self.active.len(), self.size());
        let mut matrix = vec![T::zero(); size * size];
        let compliance: Vec<&[f32]> = self.columns().collect();
        for (c, target) in matrix.chunks_exact_mut(size.max(1)).enumerate() {
            let (top, bottom) = target.split_at_mut(na);
            let mut add = |row: usize, value: f64| {
                let value: T = convert(value);
                top.iter_mut().zip(compliance[row]).for_each(|(t, &g)| *t += convert::<f64, T>(f64::from(g)) * value);
            };
            if c < na {
                for entry in self.column_start[c]..self.column_start[c + 1] {
                    add(self.row[entry] as usize, self.value[entry]);
                }
                top[c] += T::one();
            } else {
                self.driven[c - na].iter().enumerate().filter(|(_, v)| **v != 0.0).for_each(|(row, &v)| add(row, v));
            }
            bottom.iter_mut().zip(&self.balances).for_each(|(b, balance)| *b = convert(balance[c]));
        }
        matrix
    }
}

/// A factor of the matrix of a Newton step, kept to precondition the steps after it.
#[derive(Default)]
pub(super) struct KeptFactor(Option<Kept>);

struct Kept {
    lu: DenseLu,
    /// Row of each contact dof; usize::MAX if it was not active.
    row: Vec<usize>,
    active: usize,
    driven: usize,
    /// A right-hand side of the factor.
    work: Vec<f64>,
}

impl KeptFactor {
    /// Solves until the residual is at most `tolerance` of the right-hand side, or as small as possible.
    ///
    /// If a force determines the position of the plane, the matrix is nearly singular before a limit point, and the
    /// residual is a poor measure of the error: then the system is solved directly, in double precision.
    pub fn solve(&mut self, system: &ContactSystem, contact: usize, rhs: &[f64], tolerance: f64) -> Vec<f64> {
        if !system.driven.is_empty() {
            return solve_dense(&system.matrix(), rhs);
        }
        if let Some(kept) = self.0.as_mut().filter(|kept| kept.serves(system)) {
            let KrylovSolution { x, iterations, residual } = kept.solve(system, rhs, tolerance, KEPT_ITERATIONS);
            if residual <= tolerance {
                if iterations > GOOD_ITERATIONS {
                    self.0 = None;
                }
                return x;
            }
        }
        let kept = self.0.insert(Kept::new(system, contact));
        kept.solve(system, rhs, tolerance, NEW_ITERATIONS).x
    }
}

impl Kept {
    fn new(system: &ContactSystem, contact: usize) -> Self {
        let mut row = vec![usize::MAX; contact];
        system.active.iter().enumerate().for_each(|(r, &dof)| row[dof] = r);
        let lu = DenseLu::new(system.matrix(), system.size());
        Self { lu, row, active: system.active.len(), driven: system.driven.len(), work: Vec::new() }
    }

    /// Whether few dofs became active since.
    fn serves(&self, system: &ContactSystem) -> bool {
        let missing = system.active.iter().filter(|&&dof| self.row[dof] == usize::MAX).count();
        self.driven == system.driven.len() && missing as f64 <= MISSING_SHARE * system.active.len() as f64
    }

    fn solve(&mut self, system: &ContactSystem, rhs: &[f64], tolerance: f64, most: usize) -> KrylovSolution {
        let apply = |x: &[f64], out: &mut [f64]| system.apply(x, out);
        gmres(apply, |x| self.precondition(system, x), rhs, tolerance, most)
    }

    /// Dofs that the factor does not contain are not changed.
    fn precondition(&mut self, system: &ContactSystem, x: &mut [f64]) {
        let na = system.active.len();
        self.work.clear();
        self.work.resize(self.active + self.driven, 0.0);
        for (&dof, x) in system.active.iter().zip(&*x) {
            if let Some(work) = self.work.get_mut(self.row[dof]) {
                *work = *x;
            }
        }
        self.work[self.active..].copy_from_slice(&x[na..]);
        self.lu.solve(&mut self.work);
        for (&dof, x) in system.active.iter().zip(&mut *x) {
            if let Some(work) = self.work.get(self.row[dof]) {
                *x = *work;
            }
        }
        x[na..].copy_from_slice(&self.work[self.active..]);
    }
}
