//! Rows before touch with which a trace of forces begins: what they read is the sensor's tare.
//!
//! Such rows scatter as the sensor does, are the lightest of the trace, and no row as light as they are has friction.
//!
//! Main type: [`RowsInAir`].

use crate::data::median::noise_from_neighbours;
use crate::data::trace_csv::TraceRow;

/// Fewest rows that make a level.
const FEWEST: usize = 3;
/// Noise of a reading of a force plate with few rows, N.
const LEAST_NOISE_N: f64 = 0.03;
/// Wander of a sensor in the air, in standard deviations of [`TOUCH`] and as a share of the usual load.
const WANDER: f64 = 0.007;
/// Distance from the level, in standard deviations, at which the touch begins.
const TOUCH: f64 = 3.0;
/// Share of the way from the lightest to the usual load by which a row before touch may lie off the lightest.
const AT_REST: f64 = 0.05;
/// Share of the usual load below which a row is as light as those before touch.
const LIGHT: f64 = 0.1;
/// Largest friction over normal force of a light touch.
const LARGEST_FRICTION: f64 = 3.0;
/// Largest share of the light rows that may have more friction.
const MOST_WITH_FRICTION: f64 = 0.1;

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
        if trace.len() < 2 * FEWEST {
            return None;
        }
        let [low, usual] = low_and_usual_load(trace);
        let sensor_n = [0, 1, 2].map(|k| {
            let off = trace.windows(3).map(|w| w[1].force_n[k] - 0.5 * (w[0].force_n[k] + w[2].force_n[k]));
            noise_from_neighbours(off.map(f64::abs)).max(WANDER * (usual - low))
        });
        // Few rows may agree by chance, and neighbours of a slow log differ by the motion.
        let noise = |level: &Level, k: usize| level.spread_n[k].max(LEAST_NOISE_N).min(sensor_n[k]);
        let mut rows = FEWEST;
        let mut level = Self::level(&trace[..rows]);
        if (0..3).any(|k| level.spread_n[k] > TOUCH * noise(&level, k)) {
            return None;
        }
        let stays = |level: &Level, row: &TraceRow| {
            (0..3).all(|k| (row.force_n[k] - level.mean_n[k]).abs() <= TOUCH * noise(level, k))
        };
        while rows < trace.len() && stays(&level, &trace[rows]) {
            rows += 1;
            level = Self::level(&trace[..rows]);
        }
        let noise_n = [0, 1, 2].map(|k| noise(&level, k));
        let lightest = level.mean_n[0] - low < AT_REST * (usual - low) + TOUCH * noise_n[0];
        let is_air = lightest && rows < trace.len() && !level.has_friction(trace, LIGHT * (usual - low), noise_n);
        is_air.then(|| Self {
            rows,
            mean_n: level.mean_n,
            half_n: level.spread_n.map(|s| 2.0 * s.max(LEAST_NOISE_N) / (rows as f64).sqrt()),
        })
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

impl Level {
    /// Whether rows of no more than the load `light_n` above this level have friction all the same: then a finger is on the sensor
    /// in them and, as they are no heavier, at this level too.
    fn has_friction(&self, trace: &[TraceRow], light_n: f64, noise_n: [f64; 3]) -> bool {
        let off = |row: &TraceRow| -> [f64; 3] { std::array::from_fn(|k| row.force_n[k] - self.mean_n[k]) };
        let light: Vec<[f64; 3]> = trace.iter().map(off).filter(|f| f[0] < light_n + TOUCH * noise_n[0]).collect();
        let beyond = |f: &&[f64; 3]| {
            f[1].hypot(f[2]) > LARGEST_FRICTION * f[0].max(0.0) + 2.0 * TOUCH * noise_n[1].max(noise_n[2])
        };
        light.iter().filter(beyond).count() as f64 > MOST_WITH_FRICTION * light.len() as f64
    }
}

/// Normal forces of the lightest rows and of the usual one: quantiles at 2 and 60 %, N.
pub fn low_and_usual_load(trace: &[TraceRow]) -> [f64; 2] {
    let mut loads: Vec<f64> = trace.iter().map(|r| r.force_n[0]).collect();
    loads.sort_by(f64::total_cmp);
    [0.02, 0.6].map(|share| loads[(share * (loads.len() - 1) as f64) as usize])
}
