//! Rows before touch with which a trace of forces begins: what they read is the sensor's tare.
//!
//! Main type: [`RowsInAir`].

use crate::data::trace_csv::TraceRow;

/// Fewest rows that make a level.
const FEWEST: usize = 3;
/// Least noise of a reading that is allowed for, N: the resolution of a force plate.
const LEAST_NOISE_N: f64 = 0.03;
/// Distance from the level, in standard deviations, at which the touch begins.
const TOUCH: f64 = 3.0;
/// Share of the way from the level to the usual load by which a row before touch may lie off zero load.
const AT_REST: f64 = 0.15;

/// The rows before touch.
#[derive(Clone, Debug)]
pub struct RowsInAir {
    /// How many.
    pub rows: usize,
    /// Their mean: normal, x, y, N.
    pub mean_n: [f64; 3],
    /// Half-width of the mean's 95 % interval, N.
    pub half_n: [f64; 3],
}

impl RowsInAir {
    /// The level rows with which a trace begins; `None` where it begins in contact.
    pub fn of(trace: &[TraceRow]) -> Option<Self> {
        let mut rows = FEWEST;
        if trace.len() < 2 * FEWEST || !Self::is_level(&trace[..FEWEST]) {
            return None;
        }
        while rows < trace.len() {
            let here = Self::level(&trace[..rows]);
            let noise = |k: usize| here.spread_n[k].max(LEAST_NOISE_N);
            if (0..3).any(|k| (trace[rows].force_n[k] - here.mean_n[k]).abs() > TOUCH * noise(k)) {
                break;
            }
            rows += 1;
        }
        let level = Self::level(&trace[..rows]);
        let [low, usual] = low_and_usual_load(trace);
        let lightest = level.mean_n[0] - low < AT_REST * (usual - low) + LEAST_NOISE_N;
        (lightest && rows < trace.len()).then(|| Self {
            rows,
            mean_n: level.mean_n,
            half_n: level.spread_n.map(|s| 2.0 * s.max(LEAST_NOISE_N) / (rows as f64).sqrt()),
        })
    }

    fn is_level(rows: &[TraceRow]) -> bool {
        Self::level(rows).spread_n.iter().all(|s| *s < 3.0 * LEAST_NOISE_N)
    }

    fn level(rows: &[TraceRow]) -> Level {
        let n = rows.len() as f64;
        let mean_n: [f64; 3] = std::array::from_fn(|k| rows.iter().map(|r| r.force_n[k]).sum::<f64>() / n);
        let square = |k: usize| rows.iter().map(|r| (r.force_n[k] - mean_n[k]).powi(2)).sum::<f64>();
        Level { mean_n, spread_n: std::array::from_fn(|k| (square(k) / (n - 1.0)).sqrt()) }
    }
}

struct Level {
    mean_n: [f64; 3],
    spread_n: [f64; 3],
}

/// Normal forces of the lightest rows and of the usual one: quantiles at 2 and 60 %, N.
pub fn low_and_usual_load(trace: &[TraceRow]) -> [f64; 2] {
    let mut loads: Vec<f64> = trace.iter().map(|r| r.force_n[0]).collect();
    loads.sort_by(f64::total_cmp);
    [0.02, 0.6].map(|share| loads[(share * (loads.len() - 1) as f64) as usize])
}
