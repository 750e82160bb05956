//! Median of a list, and the noise of readings by a median.

/// The median; of an even number of values the upper one of the two in the middle. `None` of nothing.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Noise of readings b by their distances |b − (a + c) / 2| from the neighbours a and c, in the unit of the distances; 0 of
/// nothing. Motion only adds to a distance, so the median is taken.
///
/// Of normal noise the median of a distance is 0.6745 times its standard deviation, which is sqrt(1.5) times that of a reading.
pub fn noise_from_neighbours(distances: impl IntoIterator<Item = f64>) -> f64 {
    median(distances).unwrap_or(0.0) / (0.6745 * 1.5f64.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_upper_middle_value_is_taken() {
        assert_eq!(median([3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([4.0, 1.0, 3.0, 2.0]), Some(3.0));
        assert_eq!(median([]), None);
    }
}
