//! A model file with more effects beside its own: relaxation, and tables over a column of the user's own (strength over a voltage, and a
//! reading over voltage and temperature).

use fingerpad::Error;
use fingerpad::build::{Data, EffectSlot, Sections, TableColumn};
use fingerpad::effects::tables::{Axis, FIRST_OWN, TABLE, Target};
use fingerpad::host::ModelFile;

/// Number of the law of relaxation, and its fraction and time, s.
const RELAXATION: (u32, [f32; 2]) = (6, [0.2, 1.4]);
/// Number of the temperature among the drivers of tables.
const TEMPERATURE: usize = 11;

/// The file with relaxation and the tables added.
pub fn charged(file: &ModelFile) -> Result<ModelFile, Error> {
    let file = file.file();
    let column = TableColumn::new("voltage_v", "V", [0.0, 200.0], 20.0)?;
    let voltage = |nodes: usize| Axis {
        driver: FIRST_OWN,
        nodes,
        low: column.low,
        per_unit: (nodes - 1) as f32 / (column.high - column.low),
    };
    let temperature = Axis { driver: TEMPERATURE, nodes: 3, low: 28.0, per_unit: 0.25 };
    let mut numbers = Vec::new();
    let mut slots = file.effects.to_vec();
    let (kind, [fraction, time_s]) = RELAXATION;
    slots.push(EffectSlot { kind, reserved: 0, values: [fraction, time_s, 0.0, 0.0, 0.0, 0.0] });
    let mut add = |target: Target, axes: [Axis; 2], value: fn(f32, f32) -> f32| {
        slots.push(EffectSlot {
            kind: TABLE,
            reserved: 0,
            values: [target as u32 as f32, numbers.len() as f32, 0.0, 0.0, 0.0, 0.0],
        });
        numbers.extend(axes.iter().flat_map(Axis::numbers));
        let place = |axis: Axis, k: usize| k as f32 / (axis.nodes.max(2) - 1) as f32;
        for i in 0..axes[0].nodes {
            numbers.extend((0..axes[1].nodes).map(|k| value(place(axes[0], i), place(axes[1], k))));
        }
    };
    add(Target::Strength, [voltage(17), Axis::NONE], |v, _| 0.4 * v * v);
    add(Target::ReadingNormal, [voltage(5), temperature], |v, t| 0.05 * v - 0.02 * t);
    let tables = Sections { tables: &numbers, columns: &[column], ..Sections::default() };
    let mut bytes = vec![0; Data::file_length_with(&slots, tables, file.meta)];
    file.model.data().write_file_with(&slots, tables, file.meta, &mut bytes)?;
    ModelFile::new(&bytes)
}
