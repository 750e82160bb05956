//! Factors, their compliances and solutions of systems against products with the matrix.

use fingerpad_linear::{DenseLu, Factor, NotPositiveDefinite, Pattern, elimination_order, gmres};

/// Grid Laplacian plus identity on w x h vertices, lower triangle in natural order.
fn grid(w: usize, h: usize) -> (Pattern, Vec<f64>, Vec<Vec<u32>>) {
    let n = w * h;
    let mut neighbours = vec![Vec::new(); n];
    for y in 0..h {
        for x in 0..w {
            let v = y * w + x;
            if x + 1 < w {
                neighbours[v].push((v + 1) as u32);
                neighbours[v + 1].push(v as u32);
            }
            if y + 1 < h {
                neighbours[v].push((v + w) as u32);
                neighbours[v + w].push(v as u32);
            }
        }
    }
    let mut pattern = Pattern { column_start: vec![0], row: Vec::new() };
    let mut values = Vec::new();
    for (v, list) in neighbours.iter().enumerate() {
        pattern.row.push(v);
        values.push(1.0 + list.len() as f64);
        let mut below: Vec<usize> = list.iter().map(|&u| u as usize).filter(|&u| u > v).collect();
        below.sort_unstable();
        for u in below {
            pattern.row.push(u);
            values.push(-1.0);
        }
        pattern.column_start.push(pattern.row.len());
    }
    (pattern, values, neighbours)
}

fn multiply_symmetric(pattern: &Pattern, values: &[f64], x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; x.len()];
    for j in 0..pattern.size() {
        for k in pattern.column_start[j]..pattern.column_start[j + 1] {
            let i = pattern.row[k];
            y[i] += values[k] * x[j];
            if i != j {
                y[j] += values[k] * x[i];
            }
        }
    }
    y
}

#[test]
fn halves_of_a_solve_make_a_solve_and_the_compliance_is_the_inverse_block() {
    let (pattern, values, _) = grid(9, 7);
    let (n, c) = (63, 11);
    let mut factor = Factor::analyse(&pattern, c);
    factor.factorise(&pattern, &values).unwrap();
    let exact: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
    let mut x = multiply_symmetric(&pattern, &values, &exact);
    factor.forward(&mut x);
    let mut tail = x[n - c..].to_vec();
    factor.contact_backward(&mut tail);
    factor.backward(&mut x);
    assert!(factor.is_single());
    for i in 0..n {
        assert!((x[i] - exact[i]).abs() < 1e-5);
    }
    for i in 0..c {
        assert!((tail[i] - exact[n - c + i]).abs() < 1e-5);
    }
    let among = factor.compliance_among(&[7, 2]);
    for j in 0..c {
        let mut unit = vec![0.0; n];
        unit[n - c + j] = 1.0;
        let mut short = unit[n - c..].to_vec();
        factor.contact_forward(&mut short);
        factor.forward(&mut unit);
        for i in 0..c {
            assert!((unit[n - c + i] - short[i]).abs() < 1e-6);
        }
        factor.backward(&mut unit);
        let mut load = vec![0.0; c];
        load[j] = 2.0;
        let mut moved = vec![1.0; c];
        factor.add_compliance_times(&load, &mut moved);
        if j == 2 {
            assert!((among[2] as f64 - unit[n - c + 7]).abs() < 1e-6);
            assert!((among[3] as f64 - unit[n - c + 2]).abs() < 1e-6);
        }
        for i in 0..c {
            assert!((1.0 + 2.0 * unit[n - c + i] - moved[i]).abs() < 1e-6);
        }
    }
}

#[test]
fn the_compliance_of_the_last_dofs_is_that_part_of_the_whole() {
    let (pattern, values, _) = grid(9, 7);
    let (c, first) = (11, 4);
    let mut factor = Factor::analyse(&pattern, c);
    factor.factorise(&pattern, &values).unwrap();
    let load: Vec<f64> = (0..c).map(|j| if j < first { 0.0 } else { 1.0 + j as f64 }).collect();
    let (mut whole, mut part) = (vec![0.0; c], vec![0.0; c]);
    factor.add_compliance_times(&load, &mut whole);
    let among = factor.compliance_among(&[9, 5]);
    factor.make_compliance_from(first);
    factor.add_compliance_times(&load, &mut part);
    assert_eq!(part[..first], vec![0.0; first]);
    for (whole, part) in whole[first..].iter().zip(&part[first..]) {
        assert!((whole - part).abs() < 1e-6 * whole.abs(), "{whole} {part}");
    }
    for (whole, part) in among.iter().zip(factor.compliance_among(&[9, 5])) {
        assert!((whole - part).abs() < 1e-6, "{whole} {part}");
    }
}

/// A stiff square inside a soft sheet, 1e10 apart: single precision cannot solve for a load on the soft edge.
#[test]
fn a_factor_that_single_precision_cannot_hold_is_double() {
    let (w, h) = (9, 7);
    let (pattern, mut values, _) = grid(w, h);
    let stiff = |v: usize| v / w < 3;
    for j in 0..w * h {
        for k in pattern.column_start[j]..pattern.column_start[j + 1] {
            let i = pattern.row[k];
            if i == j {
                // Links without the ground: only the first vertex is held.
                let links = [j % w > 0, j % w + 1 < w, j / w > 0, j / w + 1 < h];
                let weight = |there: usize| if stiff(j) && stiff(there) { 1e10 } else { 1.0 };
                let places = [j.wrapping_sub(1), j + 1, j.wrapping_sub(w), j + w];
                values[k] = links.iter().zip(places).filter(|(l, _)| **l).map(|(_, p)| weight(p)).sum();
                values[k] += if j == 0 { 1.0 } else { 0.0 };
            } else if stiff(i) && stiff(j) {
                values[k] = -1e10;
            }
        }
    }
    let mut factor = Factor::analyse(&pattern, 11);
    factor.factorise(&pattern, &values).unwrap();
    assert!(!factor.is_single());
    let exact: Vec<f64> = (0..w * h).map(|i| if stiff(i) { 1.0 } else { (i as f64 * 0.7).sin() }).collect();
    let mut x = multiply_symmetric(&pattern, &values, &exact);
    factor.forward(&mut x);
    factor.backward(&mut x);
    for (x, exact) in x.iter().zip(&exact) {
        assert!((x - exact).abs() < 1e-3, "{x} {exact}");
    }
}

#[test]
fn an_indefinite_matrix_is_an_error() {
    let (pattern, mut values, _) = grid(4, 4);
    values[0] = -1.0;
    let mut factor = Factor::analyse(&pattern, 2);
    assert_eq!(factor.factorise(&pattern, &values), Err(NotPositiveDefinite { pivot: 0 }));
}

#[test]
fn dense_lu_solves_a_non_symmetric_system() {
    let mut lu = DenseLu::new(vec![0.0, 2.0, 1.0, 1.0], 2);
    let mut x = [3.0, 4.0];
    lu.solve(&mut x);
    assert!((x[0] - 0.5).abs() < 1e-6 && (x[1] - 3.0).abs() < 1e-6);
}

/// Non-symmetric, with the factor of a matrix from which two rows differ and with none.
#[test]
fn a_krylov_solution_is_that_of_the_system() {
    let n = 30;
    let entry = |i: usize, j: usize| {
        let far = (i as f64 - j as f64).abs();
        (if i == j { 3.0 } else { 0.0 }) + (1.0 + 0.3 * (i as f64).sin()) / (1.0 + far)
    };
    let changed = |i: usize, j: usize| if i % 17 == 3 { -2.0 * entry(i, j) } else { entry(i, j) };
    let exact: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
    let apply = |x: &[f64], out: &mut [f64]| {
        for i in 0..n {
            out[i] = (0..n).map(|j| changed(i, j) * x[j]).sum();
        }
    };
    let mut b = vec![0.0; n];
    apply(&exact, &mut b);
    let matrix = (0..n * n).map(|k| entry(k % n, k / n) as f32).collect();
    let mut lu = DenseLu::new(matrix, n);
    let preconditioned = gmres(apply, |x| lu.solve(x), &b, 1e-12, n);
    let plain = gmres(apply, |_| (), &b, 1e-12, n);
    assert!(preconditioned.iterations < 8 && plain.iterations > 12, "{}", plain.iterations);
    for found in [preconditioned, plain] {
        for (x, exact) in found.x.iter().zip(&exact) {
            assert!((x - exact).abs() < 1e-10, "{x} {exact}");
        }
    }
}

#[test]
fn elimination_order_is_a_permutation() {
    let (w, h) = (30usize, 20usize);
    let mut neighbours = vec![Vec::new(); w * h];
    for v in 0..w * h {
        for u in [v + 1, v + w] {
            if u < w * h && (u != v + 1 || u % w != 0) {
                neighbours[v].push(u as u32);
                neighbours[u].push(v as u32);
            }
        }
    }
    let mut order = elimination_order(&neighbours);
    order.sort_unstable();
    assert!(order.into_iter().eq(0..w * h));
    assert!(elimination_order(&[]).is_empty());
}
