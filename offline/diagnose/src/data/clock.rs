//! Clocks that are coarser than the rows: rows of one time stamp are spread evenly over the clock's step.
//!
//! Main function: [`spread_equal_stamps`].

use crate::data::runs::RawRow;

/// Number of rows whose stamp is that of the row before.
pub fn equal_stamps(raw: &[RawRow]) -> usize {
    raw.windows(2).filter(|pair| pair[1].t_s == pair[0].t_s).count()
}

/// Step of the clock where rows share stamps, s; 0 where none do.
pub fn clock_step_s(raw: &[RawRow]) -> f64 {
    if equal_stamps(raw) == 0 {
        return 0.0;
    }
    let steps = raw.windows(2).map(|pair| pair[1].t_s - pair[0].t_s).filter(|step| *step > 0.0);
    // A run of one stamp only has no clock; any order serves.
    steps.min_by(f64::total_cmp).unwrap_or(1.0)
}

/// The rows with rising clocks: those that share a stamp lie evenly between it and the next one, at most one step of the
/// clock (the least difference of two stamps of the run) apart from their first.
pub fn spread_equal_stamps(raw: &[RawRow]) -> Vec<RawRow> {
    let mut rows = raw.to_vec();
    if equal_stamps(raw) == 0 {
        return rows;
    }
    let step_s = clock_step_s(raw);
    let mut first = 0;
    while first < raw.len() {
        let stamp = raw[first].t_s;
        let count = raw[first..].iter().take_while(|r| r.t_s == stamp).count();
        for (k, row) in rows[first..first + count].iter_mut().enumerate() {
            row.t_s = stamp + step_s * k as f64 / count as f64;
        }
        first += count;
    }
    rows
}

/// What a report says of rows with equal stamps.
pub fn note(rows: usize) -> Option<String> {
    (rows > 0).then(|| {
        format!(
            "column t_s: {rows} rows have the time of the row before; rows of one time were spread evenly over the \
             clock's step, so that speeds below are as coarse as it (a column speed_mm_s would be used instead)"
        )
    })
}
