//! Files that no text can hold: model files with effects and tables, and long paths.

use fingerpad::build::{Data, EffectSlot, Sections, TableColumn};
use fingerpad::effects::tables::{Axis, FIRST_OWN, TABLE, Target};
use fingerpad::host::{ModelFile, PadModelFile};
use fingerpad::pad;

use crate::common::{MEASURED, changed};

pub const SHIPPED: &[u8] = include_bytes!("../../data/models/fingertip.fpm");
pub const PAD: &[u8] = include_bytes!("../../data/models/fingertip-pad.fpm");

/// The file of this name.
pub fn made(name: &str) -> Vec<u8> {
    match name {
        "charged.fpm" => charged(),
        // 3 % less strength for each degree below 32.
        "warm.fpm" => with_effect(EffectSlot { kind: 17, reserved: 0, values: [0.03, 0.0, 0.0, 0.0, 0.0, 0.0] }),
        "relaxing_effect.fpm" => {
            with_effect(EffectSlot { kind: 6, reserved: 0, values: [0.2, 1.4, 0.0, 0.0, 0.0, 0.0] })
        }
        "moist.fpm" => with_effect(EffectSlot { kind: 1, reserved: 0, values: [0.2, 25.0, 10.0, 0.0, 0.0, 0.0] }),
        "narrow.fpm" => narrow(),
        "soft.fpm" => soft(),
        "damaged.fpm" => PAD.iter().enumerate().map(|(k, byte)| byte ^ u8::from(k == 4000)).collect(),
        "millinewtons.csv" => {
            changed(MEASURED, &["normal_force_n", "friction_x_n", "friction_y_n"], |v| 1e3 * v).into_bytes()
        }
        "back_and_forth.csv" => {
            let row = |t| format!("{t},1,{},0\n", if t == 0 { 0 } else { 900 - 1800 * ((t + 1) % 2) });
            ("t_s,depth_mm,slide_x_mm,slide_y_mm\n".to_owned() + &(0..60).map(row).collect::<String>()).into_bytes()
        }
        _ => panic!("no file {name} is made"),
    }
}

/// The shipped model with an effect.
fn with_effect(effect: EffectSlot) -> Vec<u8> {
    let shipped = ModelFile::new(SHIPPED).unwrap();
    let mut bytes = vec![0; Data::file_length(&[effect], "{}")];
    shipped.file().model.data().write_file(&[effect], "{}", &mut bytes).unwrap();
    bytes
}

/// The shipped bed with tissue that relaxes.
fn soft() -> Vec<u8> {
    let shipped = ModelFile::new(SHIPPED).unwrap();
    let sections = Sections { relaxation: Some(&fingerpad::Relaxation::HUMAN_ASSUMED), ..Sections::default() };
    let mut bytes = vec![0; Data::file_length_with(&[], sections, "{}")];
    shipped.file().model.data().write_file_with(&[], sections, "{}", &mut bytes).unwrap();
    bytes
}

/// The shipped pad with a smaller range of pitches: 20 to 40 degrees.
fn narrow() -> Vec<u8> {
    let pad = PadModelFile::new(PAD).unwrap();
    let numbers = pad::Numbers { pitch_range_deg: [20.0, 40.0], ..*pad.file().pad.numbers };
    let narrow = pad::Pad::new(pad.file().pad.patches, &numbers);
    let mut bytes = vec![0; narrow.file_length("{}")];
    narrow.write_file("{}", &mut bytes).unwrap();
    bytes
}

/// The shipped model with a strength that grows with a voltage, 0 to 200 V, 20 V in the calibration.
fn charged() -> Vec<u8> {
    let shipped = ModelFile::new(SHIPPED).unwrap();
    let voltage = Axis { driver: FIRST_OWN, nodes: 9, low: 0.0, per_unit: 0.04 };
    let mut numbers: Vec<f32> = [voltage, Axis::NONE].iter().flat_map(Axis::numbers).collect();
    numbers.extend((0..9).map(|k| 0.005 * (k * k) as f32));
    let slot =
        EffectSlot { kind: TABLE, reserved: 0, values: [Target::Strength as u32 as f32, 0.0, 0.0, 0.0, 0.0, 0.0] };
    let columns = [TableColumn::new("voltage_v", "V", [0.0, 200.0], 20.0).unwrap()];
    let tables = Sections { tables: &numbers, columns: &columns, ..Sections::default() };
    let mut bytes = vec![0; Data::file_length_with(&[slot], tables, "{}")];
    shipped.file().model.data().write_file_with(&[slot], tables, "{}", &mut bytes).unwrap();
    bytes
}
