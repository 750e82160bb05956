//! Packed symmetric matrices over the bulk.
//!
//! They are plain arrays: a packed factor takes 272 bytes where a square matrix would take 1024, and half the time. The order of operations
//! is fixed, so that host and target compute the same bits. Vectors in three dimensions are nalgebra's.

use crate::math::Scalar;

use super::{MODES, PACKED};

/// Coordinates of the bulk.
pub(crate) type Bulk<T> = [T; MODES];
/// Lower triangle of a symmetric matrix over the bulk, row by row.
pub(crate) type Packed<T> = [T; PACKED];

#[inline(always)]
pub(crate) fn zeros<T: Scalar, const K: usize>() -> [T; K] {
    [T::of(0.0); K]
}

/// Sum of products over the bulk's coordinates.
#[inline(always)]
pub(crate) fn along<T: Scalar>(a: &Bulk<T>, b: &Bulk<T>) -> T {
    let mut sum = a[0] * b[0];
    for k in 1..MODES {
        sum += a[k] * b[k];
    }
    sum
}

/// Evaluates an expression for each row of a lower triangle, in order or backwards; the diagonal is the last element of a row.
///
/// The rows have lengths that are constant at compile time, so that their loops are unrolled: a third of the instructions.
macro_rules! each_row {
    ($m:expr, $row:ident => $do:expr) => {
        each_row!($m, split_first_chunk, $row => $do, 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16)
    };
    (mut $m:expr, $row:ident => $do:expr) => {
        each_row!($m, split_first_chunk_mut, $row => $do, 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16)
    };
    (backwards $m:expr, $row:ident => $do:expr) => {
        each_row!(back $m, $row => $do, 16 15 14 13 12 11 10 9 8 7 6 5 4 3 2 1)
    };
    ($m:expr, $split:ident, $row:ident => $do:expr, $($length:literal)*) => {
        // No split fails: the lengths add up to that of the matrix.
        let _ = (|| {
            let rest = $m;
            $(
                let ($row, rest) = rest.$split::<$length>()?;
                $do;
            )*
            Some(rest.is_empty())
        })();
    };
    (back $m:expr, $row:ident => $do:expr, $($length:literal)*) => {
        let _ = (|| {
            let rest = $m;
            $(
                let (rest, $row) = rest.split_last_chunk::<$length>()?;
                $do;
            )*
            Some(rest.is_empty())
        })();
    };
}
const _: () = assert!(MODES == 16);

/// A symmetric matrix times a vector.
pub(crate) fn symmetric<T: Scalar>(m: &Packed<T>, v: &Bulk<T>) -> Bulk<T> {
    #[inline(always)]
    fn add<T: Scalar, const N: usize>(row: &[T; N], v: &Bulk<T>, out: &mut Bulk<T>) {
        let (by, mut sum) = (v[N - 1], T::of(0.0));
        // The diagonal contributes to the sum only.
        for k in 0..N - 1 {
            sum += row[k] * v[k];
            out[k] += row[k] * by;
        }
        sum += row[N - 1] * by;
        out[N - 1] += sum;
    }
    let mut out: Bulk<T> = zeros();
    each_row!(m, row => add(row, v, &mut out));
    out
}

/// Adds `scale` times v v'.
pub(crate) fn add_square<T: Scalar>(m: &mut Packed<T>, v: &Bulk<T>, scale: T) {
    add_products(m, [v], [&v.map(|x| x * scale)]);
}

/// Adds the sum of the outer products a b'. The sum must be symmetric; only its lower triangle is computed.
pub(crate) fn add_products<T: Scalar, const K: usize>(m: &mut Packed<T>, a: [&Bulk<T>; K], b: [&Bulk<T>; K]) {
    #[inline(always)]
    fn add<T: Scalar, const N: usize, const K: usize>(row: &mut [T; N], a: &[&Bulk<T>; K], b: &[&Bulk<T>; K]) {
        for k in 0..N {
            for (a, b) in a.iter().zip(b) {
                row[k] += a[N - 1] * b[k];
            }
        }
    }
    each_row!(mut m, row => add(row, &a, &b));
}

/// Least pivot of a factor. The eigenvalues of the tangent stiffness are about 1 or more, so that smaller pivots are rounding errors.
const LEAST_PIVOT: f32 = 0.25;

/// Adds to the diagonal.
pub(crate) fn add_diagonal<T: Scalar>(m: &mut Packed<T>, x: T) {
    #[inline(always)]
    fn add<T: Scalar, const N: usize>(row: &mut [T; N], x: T) {
        row[N - 1] += x;
    }
    each_row!(mut m, row => add(row, x));
}

/// A factor in half the memory: the upper 16 bits of each single-precision number. These two to three digits suffice for Newton's method.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(transparent)]
pub(crate) struct Rounded([u16; PACKED]);

impl Rounded {
    pub const NOTHING: Self = Self([0; PACKED]);

    /// Whether no number is infinite, NaN or larger than `most`.
    pub fn is_within(&self, most: f32) -> bool {
        self.0.iter().all(|upper| number::<f32>(*upper).abs() <= most)
    }

    /// Rounds to nearest.
    pub fn of<T: Scalar>(m: &Packed<T>) -> Self {
        Self(m.map(|x| {
            let bits = x.to_f32().to_bits();
            (bits.wrapping_add(0x7fff + (bits >> 16 & 1)) >> 16) as u16
        }))
    }
}

#[inline(always)]
fn number<T: Scalar>(upper: u16) -> T {
    T::of(f32::from_bits(u32::from(upper) << 16))
}

/// Replaces a symmetric matrix by its factors L D L'. L has ones on its diagonal, which stores 1/D instead.
pub(crate) fn factor<T: Scalar + PartialOrd>(m: &mut Packed<T>) {
    for row in 0..MODES {
        let (before, rest) = m.split_at_mut((row * (row + 1) / 2).min(PACKED));
        let Some((own, diagonal)) = rest.get_mut(..=row).and_then(|own| own.split_last_mut().map(|(d, o)| (o, d)))
        else {
            return;
        };
        let mut others: &[T] = before;
        // Forms the row of L D.
        for column in 0..row {
            let (other, left) = others.split_at((column + 1).min(others.len()));
            let (done, rest) = own.split_at_mut(column.min(own.len()));
            if let Some(x) = rest.first_mut() {
                for (a, b) in done.iter().zip(other) {
                    *x -= *a * *b;
                }
            }
            others = left;
        }
        let mut pivot = *diagonal;
        let mut others: &[T] = before;
        for (column, scaled) in own.iter_mut().enumerate() {
            let (other, left) = others.split_at((column + 1).min(others.len()));
            let inverse = other.last().map_or(T::of(0.0), |inverse| *inverse);
            let l = *scaled * inverse;
            pivot -= *scaled * l;
            *scaled = l;
            others = left;
        }
        let pivot = if pivot > T::of(LEAST_PIVOT) { pivot } else { T::of(1.0) };
        *diagonal = T::of(1.0) / pivot;
    }
}

/// Solution of the linear equations with the factors of [`factor`].
pub(crate) fn solve<T: Scalar>(m: &Rounded, right: &Bulk<T>) -> Bulk<T> {
    #[inline(always)]
    fn down<T: Scalar, const N: usize>(row: &[u16; N], x: &mut Bulk<T>) {
        let mut sum = x[N - 1];
        for k in 0..N - 1 {
            sum -= number::<T>(row[k]) * x[k];
        }
        x[N - 1] = sum;
    }
    #[inline(always)]
    fn up<T: Scalar, const N: usize>(row: &[u16; N], x: &mut Bulk<T>) {
        let value = x[N - 1];
        for k in 0..N - 1 {
            x[k] -= number::<T>(row[k]) * value;
        }
    }
    #[inline(always)]
    fn scale<T: Scalar, const N: usize>(row: &[u16; N], x: &mut Bulk<T>) {
        x[N - 1] *= number(row[N - 1]);
    }
    let (mut x, rows) = (*right, &m.0);
    each_row!(rows, row => down(row, &mut x));
    each_row!(rows, row => scale(row, &mut x));
    each_row!(backwards rows, row => up(row, &mut x));
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solution_solves() {
        let mut m: Packed<f64> = zeros();
        add_diagonal(&mut m, 1.0);
        for seed in 0..5 {
            let v: Bulk<f64> = core::array::from_fn(|k| libm::sin((1 + k * (seed + 2) + seed) as f64));
            add_square(&mut m, &v, 0.5 + seed as f64);
        }
        let right: Bulk<f64> = core::array::from_fn(|k| libm::cos(k as f64));
        let mut f = m;
        factor(&mut f);
        // Iterative refinement: the rounding of the factor determines how much of the residual each iteration leaves.
        let mut x: Bulk<f64> = zeros();
        for _ in 0..12 {
            let back = symmetric(&m, &x);
            let step = solve(&Rounded::of(&f), &core::array::from_fn(|k| right[k] - back[k]));
            x = core::array::from_fn(|k| x[k] + step[k]);
        }
        for (a, b) in symmetric(&m, &x).iter().zip(&right) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }
}
