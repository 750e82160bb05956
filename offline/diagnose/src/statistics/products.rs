//! Products of long columns: eight numbers at a time, four columns against four.

use nalgebra::DMatrix;
use wide::f64x8;

/// Columns that are multiplied at once.
const TILE: usize = 4;

fn eight(chunk: &[f64]) -> f64x8 {
    f64x8::new(chunk.try_into().expect("chunks of eight"))
}

/// Sum of products.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [f64x8::ZERO; 2];
    let (mut x, mut y) = (a.chunks_exact(8), b.chunks_exact(8));
    for (i, (x, y)) in (&mut x).zip(&mut y).enumerate() {
        sums[i % 2] = eight(x).mul_add(eight(y), sums[i % 2]);
    }
    let rest: f64 = x.remainder().iter().zip(y.remainder()).map(|(x, y)| x * y).sum();
    (sums[0] + sums[1]).reduce_add() + rest
}

/// Products of one column with some others of its length; for short ones.
pub fn against<const K: usize>(column: &[f64], others: [&[f64]; K]) -> [f64; K] {
    let n = column.len();
    let others = others.map(|c| &c[..n]);
    let mut sums = [f64x8::ZERO; K];
    for at in (0..n & !7).step_by(8) {
        let x = eight(&column[at..at + 8]);
        for (sum, other) in sums.iter_mut().zip(others) {
            *sum = x.mul_add(eight(&other[at..at + 8]), *sum);
        }
    }
    if !n.is_multiple_of(8) {
        let rest = |c: &[f64]| {
            let mut last = [0.0; 8];
            last[..n % 8].copy_from_slice(&c[n & !7..]);
            f64x8::new(last)
        };
        let x = rest(column);
        for (sum, other) in sums.iter_mut().zip(others) {
            *sum = x.mul_add(rest(other), *sum);
        }
    }
    sums.map(|sum| sum.reduce_add())
}

/// Products of each of four columns with each of four others, all of one length.
fn tile(a: [&[f64]; TILE], b: [&[f64]; TILE]) -> [[f64; TILE]; TILE] {
    let n = a[0].len();
    let (a, b) = (a.map(|c| &c[..n]), b.map(|c| &c[..n]));
    let mut sums = [[f64x8::ZERO; TILE]; TILE];
    for at in (0..n & !7).step_by(8) {
        let mut y = [f64x8::ZERO; TILE];
        for (y, b) in y.iter_mut().zip(&b) {
            *y = eight(&b[at..at + 8]);
        }
        for (sums, a) in sums.iter_mut().zip(&a) {
            let x = eight(&a[at..at + 8]);
            for (sum, y) in sums.iter_mut().zip(&y) {
                *sum = x.mul_add(*y, *sum);
            }
        }
    }
    let mut out = sums.map(|row| row.map(|sum| sum.reduce_add()));
    for at in n & !7..n {
        for (row, a) in out.iter_mut().zip(a) {
            for (sum, b) in row.iter_mut().zip(b) {
                *sum += a[at] * b[at];
            }
        }
    }
    out
}

fn tiles<'a>(columns: &[&'a [f64]]) -> impl Iterator<Item = (usize, [&'a [f64]; TILE])> {
    (0..columns.len()).step_by(TILE).map(|at| {
        // The last tile repeats its last column.
        (at, std::array::from_fn(|k| columns[(at + k).min(columns.len() - 1)]))
    })
}

/// Products of all columns of one list with all of another, all of one length: rows as the first, columns as the second.
pub fn products(a: &[&[f64]], b: &[&[f64]]) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(a.len(), b.len());
    for (i, x) in tiles(a) {
        for (j, y) in tiles(b) {
            put(&mut out, (i, j), &tile(x, y));
        }
    }
    out
}

/// Products of columns with one another.
pub fn gram(columns: &[&[f64]]) -> DMatrix<f64> {
    let n = columns.len();
    let mut out = DMatrix::zeros(n, n);
    for (i, x) in tiles(columns) {
        for (j, y) in tiles(columns).filter(|(j, _)| *j <= i) {
            put(&mut out, (i, j), &tile(x, y));
        }
    }
    out.fill_upper_triangle_with_lower_triangle();
    out
}

/// Takes columns times `x` off another column of their length.
pub fn take_off(columns: &[&[f64]], x: &[f64], from: &mut [f64]) {
    let n = from.len();
    for (columns, x) in columns.chunks(TILE).zip(x.chunks(TILE)) {
        if let (&[a, b, c, d], &[p, q, r, s]) = (columns, x) {
            let (a, b, c, d) = (&a[..n], &b[..n], &c[..n], &d[..n]);
            for (i, from) in from.iter_mut().enumerate() {
                *from -= (a[i] * p + b[i] * q) + (c[i] * r + d[i] * s);
            }
        } else {
            for (column, x) in columns.iter().zip(x) {
                from.iter_mut().zip(*column).for_each(|(from, c)| *from -= c * x);
            }
        }
    }
}

fn put(out: &mut DMatrix<f64>, (i, j): (usize, usize), tile: &[[f64; TILE]; TILE]) {
    let (rows, columns) = out.shape();
    for (k, row) in tile.iter().enumerate().take(rows - i) {
        for (l, value) in row.iter().enumerate().take(columns - j) {
            out[(i + k, j + l)] = *value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_give_every_product() {
        for (n, m, length) in [(1, 1, 3), (4, 5, 16), (7, 3, 29), (9, 9, 101)] {
            let column = |k: usize| -> Vec<f64> { (0..length).map(|i| ((i * i + 7 * k) % 23) as f64 - 11.0).collect() };
            let all: Vec<Vec<f64>> = (0..n + m).map(column).collect();
            let list: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
            let (a, b) = list.split_at(n);
            let plain = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
            // Sums of whole numbers are exact in any order.
            assert_eq!(products(a, b), DMatrix::from_fn(n, m, |i, j| plain(a[i], b[j])));
            assert_eq!(gram(a), DMatrix::from_fn(n, n, |i, j| plain(a[i], a[j])));
            assert_eq!(dot(a[0], b[0]), plain(a[0], b[0]));
            assert_eq!(against(a[0], [b[0], a[0]]), [plain(a[0], b[0]), plain(a[0], a[0])]);
            let x: Vec<f64> = (0..n).map(|k| 3.0 - k as f64).collect();
            let mut left = b[0].to_vec();
            take_off(a, &x, &mut left);
            let expected = |i: usize| b[0][i] - (0..n).map(|k| a[k][i] * x[k]).sum::<f64>();
            assert_eq!(left, (0..length).map(expected).collect::<Vec<f64>>());
        }
    }
}
