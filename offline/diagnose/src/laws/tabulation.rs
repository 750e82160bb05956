//! A law of the user's own as a table of a model file, with the error of interpolation.
//!
//! Main type: [`LawTable`]; main function: [`tabulate`].

use fingerpad::build::EffectSlot;
use fingerpad::effects::tables::{Axis, HEAD, MOST_NODES, MOST_VALUES, TABLE};

use super::own_law::OwnLaw;

/// Share of the largest change that an interpolation may be wrong by without more nodes being taken.
const FINE: f64 = 1e-3;
/// Numbers of nodes of an axis that are tried.
const NODES: [usize; 9] = [2, 3, 5, 9, 17, 33, 65, 129, 257];
/// Places between two nodes at which the error of interpolation is looked for.
const BETWEEN: usize = 5;

/// A law as a table.
#[derive(Clone, Debug)]
pub struct LawTable {
    /// Its axes.
    pub axes: [Axis; 2],
    /// Changes at the nodes, the second axis running fastest.
    pub values: Vec<f32>,
    /// Largest difference between table and formula within the axes, in the unit of the change.
    pub largest_error: f64,
    /// Largest change.
    pub largest_change: f64,
}

/// The description of a table in the report.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TableSummary {
    /// The law.
    pub law: String,
    /// Its drivers.
    pub drivers: Vec<String>,
    /// Least and largest value of each.
    pub ranges: Vec<[f64; 2]>,
    /// Nodes along each.
    pub nodes: Vec<usize>,
    /// Largest difference between table and formula.
    pub largest_error: f64,
    /// Largest change.
    pub largest_change: f64,
    /// Bytes in the model file, the slot among them.
    pub bytes: usize,
}

/// Samples a law with parameters; `range_of` gives the range of the n-th driver.
///
/// # Errors
/// A sentence where the law has more drivers than a table has axes.
pub fn tabulate(law: &OwnLaw, parameters: &[f64], range_of: impl Fn(usize) -> [f64; 2]) -> Result<LawTable, String> {
    let ranges: Vec<[f64; 2]> = (0..law.drivers.len()).map(&range_of).collect();
    if ranges.len() > 2 {
        return Err(format!(
            "{}: its formula reads {} drivers; a table of a model file has two axes",
            law.law.name,
            ranges.len()
        ));
    }
    let mut sizes: Vec<Vec<usize>> = match ranges.len() {
        1 => NODES.map(|n| vec![n]).to_vec(),
        _ => NODES.into_iter().flat_map(|one| NODES.map(|two| vec![one, two])).collect(),
    };
    sizes.retain(|n| n.iter().all(|n| *n <= MOST_NODES) && n.iter().product::<usize>() <= MOST_VALUES);
    sizes.sort_by_key(|n| n.iter().product::<usize>());
    let mut best: Option<LawTable> = None;
    for nodes in &sizes {
        let table = sample(law, parameters, &ranges, nodes);
        if table.largest_error <= FINE * table.largest_change {
            return Ok(table);
        }
        if best.as_ref().is_none_or(|b| table.largest_error < b.largest_error) {
            best = Some(table);
        }
    }
    best.ok_or_else(|| format!("{}: its formula reads no driver", law.law.name))
}

fn sample(law: &OwnLaw, parameters: &[f64], ranges: &[[f64; 2]], nodes: &[usize]) -> LawTable {
    let axis = |k: usize| {
        let Some([low, high]) = ranges.get(k) else { return Axis::NONE };
        let per_unit = (nodes[k] - 1) as f64 / (high - low);
        Axis { driver: law.drivers[k].number, nodes: nodes[k], low: *low as f32, per_unit: per_unit as f32 }
    };
    let axes = [axis(0), axis(1)];
    let [least, most] = law.target.0.range().map(f64::from);
    let at = |cells: [f64; 2]| {
        let place = |k: usize| f64::from(axes[k].low) + cells[k] / f64::from(axes[k].per_unit);
        let drivers: Vec<f64> = (0..ranges.len()).map(place).collect();
        law.value(parameters, &drivers).clamp(least, most)
    };
    let [one, two] = axes.map(|a| a.nodes);
    let nodes = (0..one * two).map(|i| at([(i / two) as f64, (i % two) as f64]) as f32);
    let values: Vec<f32> = nodes.collect();
    let largest_change = values.iter().map(|v| f64::from(v.abs())).fold(0.0, f64::max);
    let mut largest_error = 0.0f64;
    let steps = |n: usize| (n - 1) * (BETWEEN + 1) + 1;
    for i in 0..steps(one) {
        for k in 0..steps(two) {
            let cells = [i, k].map(|n| n as f64 / (BETWEEN + 1) as f64);
            largest_error = largest_error.max((between(&values, [one, two], cells) - at(cells)).abs());
        }
    }
    LawTable { axes, values, largest_error, largest_change }
}

/// The table's value at a place, in cells.
fn between(values: &[f32], [one, two]: [usize; 2], [x, y]: [f64; 2]) -> f64 {
    let cell = |x: f64, n: usize| (x as usize).min(n.saturating_sub(2));
    let (i, k) = (cell(x, one), cell(y, two));
    let (s, t) = (x - i as f64, y - k as f64);
    let node = |i: usize, k: usize| f64::from(values[i.min(one - 1) * two + k.min(two - 1)]);
    let along = |i: usize| node(i, k) + t * (node(i, k + 1) - node(i, k));
    along(i) + s * (along(i + 1) - along(i))
}

impl LawTable {
    /// Puts the table behind those of a section, and gives its slot.
    pub fn append(&self, law: &OwnLaw, section: &mut Vec<f32>) -> EffectSlot {
        let start = section.len();
        section.extend(self.axes.iter().flat_map(Axis::numbers));
        section.extend(&self.values);
        let values = [law.target.0 as u32 as f32, start as f32, 0.0, 0.0, 0.0, 0.0];
        EffectSlot { kind: TABLE, reserved: 0, values }
    }

    /// Its description in the report.
    pub fn summary(&self, law: &OwnLaw) -> TableSummary {
        let axes = &self.axes[..law.drivers.len()];
        let end = |a: &Axis| f64::from(a.low) + (a.nodes - 1) as f64 / f64::from(a.per_unit);
        TableSummary {
            law: law.law.name.to_owned(),
            drivers: law.drivers.iter().map(|d| d.name.clone()).collect(),
            ranges: axes.iter().map(|a| [f64::from(a.low), end(a)]).collect(),
            nodes: axes.iter().map(|a| a.nodes).collect(),
            largest_error: self.largest_error,
            largest_change: self.largest_change,
            bytes: size_of::<EffectSlot>() + size_of::<f32>() * (HEAD + self.values.len()),
        }
    }
}

impl std::fmt::Display for TableSummary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let axes = self.drivers.iter().zip(&self.ranges).zip(&self.nodes);
        let axes: Vec<String> = axes
            .map(|((name, [low, high]), nodes)| format!("{nodes} nodes over {name} {low:.4} to {high:.4}"))
            .collect();
        write!(
            f,
            "{}: a table of {}, within {:.2e} of the formula, whose largest change is {:.4}; {} bytes",
            self.law,
            axes.join(" and "),
            self.largest_error,
            self.largest_change,
            self.bytes
        )
    }
}
