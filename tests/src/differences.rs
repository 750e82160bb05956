//! The one finite-difference checker for all derivatives.

/// Derivative of `f` at 0: central differences with steps `h` and `h/2`, extrapolated, error of order h⁴.
pub fn derivative(h: f64, f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let central = |h: f64| -> Vec<f64> { f(h).iter().zip(f(-h)).map(|(up, down)| (up - down) / (2.0 * h)).collect() };
    central(h).iter().zip(central(0.5 * h)).map(|(coarse, fine)| (4.0 * fine - coarse) / 3.0).collect()
}

/// Largest error of the product `exact(d)` of a derivative with directions `d`, each against differences of
/// `along(d, s)` over `s` at 0 with step `h`, relative to the largest entry that belongs to the direction.
pub fn worst_error(
    h: f64,
    directions: &[Vec<f64>],
    along: impl Fn(&[f64], f64) -> Vec<f64>,
    exact: impl Fn(&[f64]) -> Vec<f64>,
) -> f64 {
    let mut worst = 0.0f64;
    for direction in directions {
        let numeric = derivative(h, |s| along(direction, s));
        worst = worst.max(relative_error(&exact(direction), &numeric));
    }
    worst
}

/// Largest difference over the largest entry of `reference`; NaN if anything is.
pub fn relative_error(values: &[f64], reference: &[f64]) -> f64 {
    assert_eq!(values.len(), reference.len());
    let scale = reference.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    assert!(scale > 0.0, "nothing to compare with");
    let bad = values.iter().chain(reference).any(|v| v.is_nan());
    let worst = values.iter().zip(reference).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
    if bad { f64::NAN } else { worst / scale }
}

/// The unit vectors of `n` dimensions.
pub fn unit_directions(n: usize) -> Vec<Vec<f64>> {
    (0..n).map(|k| (0..n).map(|i| f64::from(u8::from(i == k))).collect()).collect()
}
