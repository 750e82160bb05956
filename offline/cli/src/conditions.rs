//! Conditions of the skin, and columns along a path of `eval`, for the model's effects.
//!
//! Main types: [`Conditions`] (the flags), [`read_by`] (the conditions that a model reads).

use anyhow::anyhow;
use fingerpad::effects::{Column, LAWS, OWN, tables};
use fingerpad::{File, Surroundings};
use fingerpad_diagnose::laws::drivers::DRIVERS;

use super::Failure;

/// Conditions that hold along the whole path.
#[derive(clap::Args)]
pub struct Conditions {
    /// Moisture of the skin along the path, corneometer units, if the model reads it [default: 35]
    #[arg(long, allow_negative_numbers = true, conflicts_with = "runs")]
    hydration_au: Option<f32>,
    /// Temperature of the skin along the path, °C, if the model reads it [default: 32]
    #[arg(long, allow_negative_numbers = true, conflicts_with = "runs")]
    temperature_c: Option<f32>,
    /// Width of the finger, mm, if the model reads it [default: 16]
    #[arg(long, allow_negative_numbers = true, conflicts_with = "runs")]
    finger_width_mm: Option<f32>,
    /// Clock of the series at the start of the path, s, if the model has a drift [default: 0]
    #[arg(long, allow_negative_numbers = true, conflicts_with = "runs")]
    series_s: Option<f32>,
    /// Contact time since the last rest along the path, s, if the model reads it [default: counted along the path]
    #[arg(long, allow_negative_numbers = true, conflicts_with = "runs")]
    occlusion_s: Option<f32>,
}

/// Columns that the effects of a model file read.
pub fn read_by(file: &File<'_>) -> Vec<Column> {
    let mut columns = Vec::new();
    for slot in file.effects {
        if slot.kind == tables::TABLE {
            let axes = file.tables.get(slot.values[1] as usize..).unwrap_or_default();
            // Driver and number of nodes of either axis; an axis with one node is not there.
            let drivers = axes.chunks_exact(tables::HEAD / 2).take(2).filter(|axis| axis[1] > 1.0);
            columns.extend(drivers.filter_map(|axis| DRIVERS.get(axis[0] as usize)).map(|driver| driver.column));
        } else if let Some(law) = LAWS.iter().find(|law| law.kind == slot.kind) {
            columns.extend(law.drivers);
        }
    }
    columns
}

impl Conditions {
    /// Flags with their columns and values.
    fn each(&self) -> [(&'static str, Column, Option<f32>); 5] {
        [
            ("--hydration-au", Column::Hydration, self.hydration_au),
            ("--temperature-c", Column::Temperature, self.temperature_c),
            ("--finger-width-mm", Column::Width, self.finger_width_mm),
            ("--series-s", Column::Time, self.series_s),
            ("--occlusion-s", Column::Occlusion, self.occlusion_s),
        ]
    }

    /// Refuses every condition for a model without effects.
    ///
    /// # Errors
    /// [`Failure::Input`] with the first flag that is given.
    pub fn refuse_for_pad(&self, model_name: &str) -> Result<(), Failure> {
        match self.each().into_iter().find_map(|(flag, _, value)| value.map(|value| (flag, value))) {
            Some((flag, value)) => {
                Err(Failure::Input(anyhow!("{flag} {value}: {model_name} is a pad, which has no effects that read it")))
            }
            None => Ok(()),
        }
    }

    /// Refuses a condition that the model does not read, and a value out of range.
    ///
    /// # Errors
    /// [`Failure::Input`] with flag, value, and the allowed range.
    pub fn check(&self, file: &File<'_>, model_name: &str) -> Result<(), Failure> {
        let read = read_by(file);
        for (flag, column, value) in self.each() {
            let Some(value) = value else { continue };
            let refuse = |problem: String| Err(Failure::Input(anyhow!("{flag} {value}: {problem}")));
            if !read.contains(&column) {
                let flags: Vec<&str> = self.each().iter().filter(|f| read.contains(&f.1)).map(|f| f.0).collect();
                let flags = if flags.is_empty() { "none of these conditions".into() } else { flags.join(", ") };
                return refuse(format!("{model_name} does not read that condition; it reads {flags}"));
            }
            let Some(driver) = DRIVERS.iter().find(|driver| driver.column == column) else { continue };
            let [low, high] = driver.range;
            if !(low..=high).contains(&f64::from(value)) {
                return refuse(format!("must be from {low} to {high} {}", driver.unit));
            }
        }
        Ok(())
    }

    /// The surroundings of a path, with the columns of the user's own.
    pub fn surroundings(&self, own: [f32; OWN]) -> Surroundings {
        let usual = Surroundings::default();
        Surroundings {
            hydration_au: self.hydration_au.unwrap_or(usual.hydration_au),
            temperature_c: self.temperature_c.unwrap_or(usual.temperature_c),
            finger_width_mm: self.finger_width_mm.unwrap_or(usual.finger_width_mm),
            series_s: self.series_s.unwrap_or(usual.series_s),
            occlusion_s: self.occlusion_s,
            own,
            ..usual
        }
    }
}
