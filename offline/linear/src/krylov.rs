//! Krylov solution of a linear system whose matrix is only applied.

/// Result of [`gmres`].
pub struct KrylovSolution {
    /// The solution.
    pub x: Vec<f64>,
    /// Applications of the matrix.
    pub iterations: usize,
    /// Norm of the residual.
    pub residual: f64,
}

/// Solves `A x = b` by GMRES (Saad & Schultz 1986) with the preconditioner on the right, from x = 0, until the norm of
/// the residual is at most `tolerance` or after `most` iterations.
///
/// `apply` overwrites its second argument by A times the first; `precondition` overwrites its argument by an
/// approximate solution for it.
pub fn gmres(
    mut apply: impl FnMut(&[f64], &mut [f64]),
    mut precondition: impl FnMut(&mut [f64]),
    b: &[f64],
    tolerance: f64,
    most: usize,
) -> KrylovSolution {
    let mut residual = norm(b);
    let mut x = vec![0.0; b.len()];
    if !(residual > tolerance) {
        return KrylovSolution { x, iterations: 0, residual };
    }
    let mut basis: Vec<Vec<f64>> = vec![b.iter().map(|v| v / residual).collect()];
    let mut preconditioned: Vec<Vec<f64>> = Vec::new();
    // Columns of the triangle that Givens' rotations make of Hessenberg's matrix, the rotations, the right-hand side.
    let mut triangle: Vec<Vec<f64>> = Vec::new();
    let mut rotations: Vec<(f64, f64)> = Vec::new();
    let mut rhs = vec![residual];
    while residual > tolerance && triangle.len() < most {
        let k = triangle.len();
        let mut z = basis[k].clone();
        precondition(&mut z);
        let mut w = vec![0.0; b.len()];
        apply(&z, &mut w);
        preconditioned.push(z);
        let mut column = Vec::with_capacity(k + 1);
        for v in &basis {
            let along = dot(v, &w);
            w.iter_mut().zip(v).for_each(|(w, v)| *w -= along * v);
            column.push(along);
        }
        let rest = norm(&w);
        for (i, &(c, s)) in rotations.iter().enumerate() {
            (column[i], column[i + 1]) = (c * column[i] + s * column[i + 1], c * column[i + 1] - s * column[i]);
        }
        let length = column[k].hypot(rest);
        if !(length > 0.0 && length.is_finite()) {
            preconditioned.pop();
            break;
        }
        let (c, s) = (column[k] / length, rest / length);
        column[k] = length;
        rotations.push((c, s));
        triangle.push(column);
        rhs.push(-s * rhs[k]);
        rhs[k] *= c;
        residual = rhs[k + 1].abs();
        w.iter_mut().for_each(|w| *w /= rest);
        basis.push(w);
    }
    let size = triangle.len();
    for k in (0..size).rev() {
        rhs[k] /= triangle[k][k];
        for i in 0..k {
            rhs[i] -= triangle[k][i] * rhs[k];
        }
    }
    for (z, weight) in preconditioned.iter().zip(&rhs) {
        x.iter_mut().zip(z).for_each(|(x, z)| *x += weight * z);
    }
    KrylovSolution { x, iterations: size, residual }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}
