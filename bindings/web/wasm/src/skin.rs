//! What moisture, temperature and speed do to the skin's strength, and a refused file in numbers.
//!
//! Main function: [`strength`]. All formulas are the core's.

use fingerpad::effects::hydration_bell::HydrationBell;
use fingerpad::effects::speed_log::SpeedLog;
use fingerpad::effects::temperature::Temperature;
use fingerpad::effects::{Change, Conditions, Effect, Law, VALUES};
use fingerpad::{Error, Field};

/// Sizes of the laws, those that their sources give as typical.
const MOISTURE: [f32; VALUES] = typical(&HydrationBell::LAW);
const SPEED: [f32; VALUES] = typical(&SpeedLog::LAW);
const TEMPERATURE: [f32; VALUES] = typical(&Temperature::LAW);

/// The typical parameters of a law. Evaluated when compiling, so that the module holds no text of a law.
const fn typical(law: &Law) -> [f32; VALUES] {
    let mut values = [0.0; VALUES];
    let mut k = 0;
    while k < law.parameters.len() {
        values[k] = law.parameters[k].typical as f32;
        k += 1;
    }
    values
}

/// A parameter of the law of this number; 0 if there is none.
pub fn value(kind: u32, index: usize) -> f32 {
    let values = match kind {
        _ if kind == HydrationBell::LAW.kind => &MOISTURE,
        _ if kind == SpeedLog::LAW.kind => &SPEED,
        _ if kind == Temperature::LAW.kind => &TEMPERATURE,
        _ => return 0.0,
    };
    values.get(index).copied().unwrap_or(0.0)
}

/// Factor on the strength. NaN leaves it unchanged.
///
/// * `hydration_au`: moisture, corneometer units
/// * `temperature_c`: of the skin, °C
/// * `speed_mm_s`: of the body over the skin, 0 at rest
pub fn strength(hydration_au: f32, temperature_c: f32, speed_mm_s: f32) -> f32 {
    let at = Conditions { hydration_au, temperature_c, speed_mm_s, ..Conditions::default() };
    let mut change = Change::default();
    HydrationBell::act(&MOISTURE, &at, &mut change);
    SpeedLog::act(&SPEED, &at, &mut change);
    Temperature::act(&TEMPERATURE, &at, &mut change);
    change.strength
}

/// Why a file was refused, for the page to put into words: reason, then up to four numbers.
pub fn words(error: Error) -> [u32; 5] {
    let field = |what: Field| what as u32;
    match error {
        Error::Magic => [1, 0, 0, 0, 0],
        Error::Version { found } => [2, found, fingerpad::build::VERSION, 0, 0],
        Error::Length { expected, found } => [3, expected, found, 0, 0],
        Error::Checksum => [4, 0, 0, 0, 0],
        Error::Alignment => [5, 0, 0, 0, 0],
        Error::Shape { elements, nodes } => [6, elements, nodes, 0, 0],
        Error::Section { id } => [7, u32::from_le_bytes(id), 0, 0, 0],
        Error::Range { what, index, value } => [8, field(what), u32::from(index), value.to_bits(), 0],
        Error::Buffer { needed } => [11, needed, 0, 0, 0],
        // What only beds and saved states are refused for, and errors of a later version of the core.
        _ => [13, 0, 0, 0, 0],
    }
}
