//! Equilibrium of a body without contact, by Newton's method with the exact tangent.

use fingerpad_fe::assembly::{Body, Configuration, Pattern};
use fingerpad_fe::solve::linear::Factor;

/// Solution with its cost.
pub struct Equilibrium {
    /// Where the body rests.
    pub at: Configuration,
    /// Newton iterations.
    pub iterations: usize,
    /// Largest entry of the residual at the end, N or N mm.
    pub residual: f64,
}

/// Equilibrium of `body` under `load` (dof order, N); fixed nodes keep their places of `start`.
///
/// Iterates until a step moves no dof by more than `tolerance` (mm or rad) and then once more.
///
/// # Panics
/// If 50 iterations are not enough, the tangent is not positive definite or an element remains inverted.
pub fn equilibrium(body: &Body, start: Configuration, load: &[f64], tolerance: f64) -> Equilibrium {
    let mut at = start;
    body.follow(&mut at);
    let mut factor = Factor::analyse(&body.dofs.pattern, 0);
    let (mut residual, mut values) = (Vec::new(), Vec::new());
    let unbalanced = |at: &Configuration, residual: &mut Vec<f64>| {
        body.residual(at, residual)?;
        residual.iter_mut().zip(load).for_each(|(r, l)| *r -= l);
        body.dofs.held.iter().for_each(|&dof| residual[dof] = 0.0);
        Ok::<f64, fingerpad_fe::assembly::BodyError>(residual.iter().map(|r| r * r).sum::<f64>().sqrt())
    };
    let mut norm = unbalanced(&at, &mut residual).expect("a start without inverted elements");
    let mut last = false;
    for iterations in 1..=50 {
        body.tangent(&at, &mut values);
        factor.factorise(&body.dofs.pattern, &values).expect("a positive definite tangent");
        let mut step = residual.clone();
        factor.forward(&mut step);
        factor.backward(&mut step);
        let mut scale = -1.0;
        let small = largest(&step) <= tolerance;
        loop {
            let trial = body.advance(&at, &step, scale);
            match unbalanced(&trial, &mut residual) {
                Ok(new) if small || new < 2.0 * norm || scale > -1e-2 => {
                    (at, norm) = (trial, new);
                    break;
                }
                _ => scale *= 0.5,
            }
            assert!(scale < -1e-4, "an element remains inverted");
        }
        if last {
            return Equilibrium { at, iterations, residual: largest(&residual) };
        }
        last = small;
    }
    panic!("no equilibrium: residual {norm:e}");
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, v| m.max(v.abs()))
}

/// `K x` of a symmetric matrix given by its lower triangle.
pub fn multiply_symmetric(pattern: &Pattern, values: &[f64], x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; x.len()];
    for column in 0..pattern.size() {
        for k in pattern.column_start[column]..pattern.column_start[column + 1] {
            let row = pattern.row[k];
            y[row] += values[k] * x[column];
            if row != column {
                y[column] += values[k] * x[row];
            }
        }
    }
    y
}
