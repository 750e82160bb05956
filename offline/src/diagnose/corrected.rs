//! The model file with the effect switched on: tables of the refitted baseline, effect slots, provenance.

use fingerpad::{Data, EffectSlot, Effects, Line};

use super::base::{AtDepth, Reference};
use super::diagnosis::Evidence;
use super::error::DiagnoseError;

/// Bytes of `corrected.fpm`.
///
/// Tables of normal force, strength and stiffness are those of `data` times what the refit changed. Where that would
/// not be passive the tables stay as they were, and the file's JSON says so.
///
/// Errors: [`DiagnoseError::Model`] if the file cannot be made.
pub fn corrected(data: &Data, reference: &Reference, evidence: &Evidence) -> Result<Vec<u8>, DiagnoseError> {
    let refitted = rescaled(data, reference, evidence);
    let (tables, adapted) = match refitted.check() {
        Ok(()) => (refitted, true),
        Err(_) => (*data, false),
    };
    let mut slots = Vec::new();
    for active in &evidence.laws {
        let mut slot = EffectSlot { kind: active.law.kind, reserved: 0, values: [0.0; 6] };
        for (slot, value) in slot.values.iter_mut().zip(&active.values) {
            *slot = *value as f32;
        }
        if Effects::new(std::slice::from_ref(&slot)).is_ok() {
            slots.push(slot);
        }
    }
    let effects: Vec<serde_json::Value> = evidence
        .laws
        .iter()
        .map(|a| {
            let reported = (a.law.report)(&a.values);
            let names = a.law.parameters.iter().map(|p| p.name.to_owned());
            let in_core = slots.iter().any(|s| s.kind == a.law.kind);
            serde_json::json!({
                "law": a.law.name,
                "evaluated_by_core": in_core,
                "parameters": names.zip(reported).map(|(n, v)| (n, v.into())).collect::<serde_json::Map<_, _>>(),
            })
        })
        .collect();
    let meta = serde_json::json!({
        "name": "corrected by fingerpad diagnose",
        "version": env!("CARGO_PKG_VERSION"),
        "effects": effects,
        "tables_refitted": adapted,
        "depth_max_mm": tables.depth_max,
    })
    .to_string();
    let mut out = vec![0; Data::file_length(&slots, &meta)];
    tables.write_file(&slots, &meta, &mut out).map_err(|e| DiagnoseError::Model(e.to_string()))?;
    Ok(out)
}

fn rescaled(data: &Data, reference: &Reference, evidence: &Evidence) -> Data {
    let (before, after) = (reference.with(&reference.mean), reference.with(&evidence.theta));
    let n = data.rows.len();
    let cell = f64::from(data.depth_max) / (n - 1) as f64;
    let mut out = *data;
    let factor = |i: usize, of: fn(&AtDepth) -> f64| {
        let depth = cell * (i as f64).max(0.5);
        of(&after.at(depth)) / of(&before.at(depth))
    };
    let node = |i: usize| {
        let i = i.min(n - 1);
        let row = &data.rows[i];
        [
            row.normal.value * factor(i, |a| a.normal_n) as f32,
            row.limit.value * factor(i, |a| a.strength_n) as f32,
            row.stiffness.value * factor(i, |a| a.tangential_n_mm) as f32,
        ]
    };
    for i in 0..n {
        let (here, next) = (node(i), node(i + 1));
        let row = &mut out.rows[i];
        row.normal = line(here[0], next[0]);
        row.limit = line(here[1], next[1]);
        row.stiffness = line(here[2], next[2]);
    }
    out
}

/// A line that reaches its right end without overshooting it.
fn line(value: f32, next: f32) -> Line {
    let mut change = next - value;
    while change > 0.0 && value + change > next {
        change = change.next_down();
    }
    Line { value, change }
}
