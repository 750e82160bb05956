//! A model file that reads a column of the user's own.

use std::fs;
use std::path::Path;

use fingerpad::build::{Data, EffectSlot, TableColumn, Tables};
use fingerpad::effects::tables::{Axis, FIRST_OWN, TABLE, Target};
use fingerpad::host::ModelFile;

/// Writes the shipped model with a strength that grows with a voltage, 0 to 200 V, 20 V in the calibration.
pub fn charged(path: &Path) {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/models/fingertip.fpm");
    let shipped = ModelFile::new(&fs::read(shipped).unwrap()).unwrap();
    let voltage = Axis { driver: FIRST_OWN, nodes: 9, low: 0.0, per_unit: 0.04 };
    let mut numbers: Vec<f32> = [voltage, Axis::NONE].iter().flat_map(Axis::numbers).collect();
    numbers.extend((0..9).map(|k| 0.005 * (k * k) as f32));
    let slot =
        EffectSlot { kind: TABLE, reserved: 0, values: [Target::Strength as u32 as f32, 0.0, 0.0, 0.0, 0.0, 0.0] };
    let columns = [TableColumn::new("voltage_v", "V", [0.0, 200.0], 20.0).unwrap()];
    let tables = Tables { numbers: &numbers, columns: &columns };
    let mut bytes = vec![0; Data::file_length_with_tables(&[slot], tables, "{}")];
    shipped.file().model.data().write_file_with_tables(&[slot], tables, "{}", &mut bytes).unwrap();
    fs::write(path, bytes).unwrap();
}
