//! Vectors and matrices of three, and the bulk's symmetric matrices, packed.
//!
//! Plain arrays: every operation has one order on host and target, so that both get the same bits.

use crate::math::Arithmetic;

use super::{MODES, PACKED};

pub(crate) type Vec3<T> = [T; 3];
/// Rows.
pub(crate) type Mat3<T> = [[T; 3]; 3];
/// Coordinates of the bulk.
pub(crate) type Bulk<T> = [T; MODES];
/// Lower triangle of a symmetric matrix over the bulk, row by row.
pub(crate) type Packed<T> = [T; PACKED];

#[inline(always)]
pub(crate) fn zeros<T: Arithmetic, const K: usize>() -> [T; K] {
    [T::of(0.0); K]
}

#[inline(always)]
pub(crate) fn dot<T: Arithmetic>(a: &Vec3<T>, b: &Vec3<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn cross<T: Arithmetic>(a: &Vec3<T>, b: &Vec3<T>) -> Vec3<T> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
pub(crate) fn plus<T: Arithmetic>(a: &Vec3<T>, b: &Vec3<T>) -> Vec3<T> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(crate) fn minus<T: Arithmetic>(a: &Vec3<T>, b: &Vec3<T>) -> Vec3<T> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn times<T: Arithmetic>(a: &Vec3<T>, s: T) -> Vec3<T> {
    a.map(|x| x * s)
}

/// Matrix times vector.
#[inline(always)]
pub(crate) fn turned<T: Arithmetic>(m: &Mat3<T>, v: &Vec3<T>) -> Vec3<T> {
    [dot(&m[0], v), dot(&m[1], v), dot(&m[2], v)]
}

/// Transposed matrix times vector.
#[inline(always)]
pub(crate) fn turned_back<T: Arithmetic>(m: &Mat3<T>, v: &Vec3<T>) -> Vec3<T> {
    [0, 1, 2].map(|k| m[0][k] * v[0] + m[1][k] * v[1] + m[2][k] * v[2])
}

/// Sum of products over the bulk's coordinates.
#[inline(always)]
pub(crate) fn along<T: Arithmetic>(a: &Bulk<T>, b: &Bulk<T>) -> T {
    let mut sum = a[0] * b[0];
    for k in 1..MODES {
        sum += a[k] * b[k];
    }
    sum
}

/// The rows of a lower triangle, the diagonal in the last place of each.
#[inline(always)]
fn rows<T>(m: &Packed<T>) -> impl DoubleEndedIterator<Item = &[T]> + ExactSizeIterator {
    (0..MODES).map(|row| m.get(row * (row + 1) / 2..(row + 1) * (row + 2) / 2).unwrap_or(&[]))
}

/// A symmetric matrix times a vector.
pub(crate) fn symmetric<T: Arithmetic>(m: &Packed<T>, v: &Bulk<T>) -> Bulk<T> {
    let mut out: Bulk<T> = zeros();
    for (row, line) in rows(m).enumerate() {
        let (by, mut sum) = (v[row], T::of(0.0));
        // The diagonal goes into the sum alone.
        for ((x, v), out) in line.iter().zip(v).zip(&mut out).take(row) {
            sum += *x * *v;
            *out += *x * by;
        }
        if let Some(diagonal) = line.last() {
            sum += *diagonal * by;
        }
        out[row] += sum;
    }
    out
}

/// Adds `scale` times v v'.
#[inline(always)]
pub(crate) fn add_square<T: Arithmetic>(m: &mut Packed<T>, v: &Bulk<T>, scale: T) {
    let mut rest: &mut [T] = m;
    for (row, x) in v.iter().enumerate() {
        let (line, others) = rest.split_at_mut((row + 1).min(rest.len()));
        let left = *x * scale;
        for (to, x) in line.iter_mut().zip(v) {
            *to += left * *x;
        }
        rest = others;
    }
}

/// Least pivot of a factor, of a matrix that is at least about 1: none below it is met but by rounding.
const LEAST_PIVOT: f32 = 0.25;

/// Replaces a symmetric matrix by its factor: L D L' with ones on the diagonal of L, 1/D in their place.
pub(crate) fn factor<T: Arithmetic + PartialOrd>(m: &mut Packed<T>) {
    let start = |row: usize| row * (row + 1) / 2;
    for row in 0..MODES {
        let own = start(row);
        let mut pivot = m[own + row];
        for column in 0..row {
            let other = start(column);
            // m[own + column] holds (L D) so far.
            let mut x = m[own + column];
            for k in 0..column {
                x -= m[own + k] * m[other + k];
            }
            m[own + column] = x;
        }
        for column in 0..row {
            let scaled = m[own + column];
            let l = scaled * m[start(column) + column];
            pivot -= scaled * l;
            m[own + column] = l;
        }
        let pivot = if pivot > T::of(LEAST_PIVOT) { pivot } else { T::of(1.0) };
        m[own + row] = T::of(1.0) / pivot;
    }
}

/// Solution with a factor of [`factor`].
pub(crate) fn solve<T: Arithmetic>(m: &Packed<T>, right: &Bulk<T>) -> Bulk<T> {
    let mut x = *right;
    for (row, line) in rows(m).enumerate() {
        let mut sum = x[row];
        for (l, x) in line.iter().zip(&x).take(row) {
            sum -= *l * *x;
        }
        x[row] = sum;
    }
    for (x, line) in x.iter_mut().zip(rows(m)) {
        *x *= line.last().map_or(T::of(1.0), |inverse| *inverse);
    }
    for (row, line) in (0..MODES).zip(rows(m)).rev() {
        let value = x[row];
        for (l, x) in line.iter().zip(&mut x).take(row) {
            *x -= *l * value;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solution_solves() {
        let mut m: Packed<f64> = zeros();
        for k in 0..MODES {
            m[k * (k + 3) / 2] = 1.0;
        }
        for seed in 0..5 {
            let v: Bulk<f64> = core::array::from_fn(|k| libm::sin((1 + k * (seed + 2) + seed) as f64));
            add_square(&mut m, &v, 0.5 + seed as f64);
        }
        let right: Bulk<f64> = core::array::from_fn(|k| libm::cos(k as f64));
        let mut f = m;
        factor(&mut f);
        let back = symmetric(&m, &solve(&f, &right));
        for (a, b) in back.iter().zip(&right) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }
}
