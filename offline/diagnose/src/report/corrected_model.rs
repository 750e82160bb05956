//! The model file with the effect switched on: the refitted baseline, effect slots, provenance.

use fingerpad::build::{Data, EffectSlot, Sections};
use fingerpad::{Branch, Effects, Error, Relaxation};
use fingerpad_smooth::{CoreExport, MIDDLE_MM, ReferenceCurves, SmoothModel, export_to_core};

use crate::error::DiagnoseError;
use crate::laws::tabulation::tabulate;
use crate::laws::{OwnColumn, Place, TableSummary};
use crate::model::active_law::ActiveLaw;
use crate::model::core_replay::replay_all;
use crate::model::prediction::strokes_of;
use crate::model::relaxation::branch_of;
use crate::report::evidence::Evidence;

/// A model file with what it leaves of the held-out runs.
pub struct CorrectedModel {
    /// The file.
    pub bytes: Vec<u8>,
    /// Root mean square residual of the core with this file along the held-out runs (the measured ones where there are
    /// none), N: normal, x, y.
    pub rms_n: [f64; 3],
    /// How laws of the user's own stand in the file.
    pub tables: Vec<TableSummary>,
}

/// The finger with its one law of relaxation as a branch of the tissue, and its tables those of relaxed tissue.
///
/// # Errors
/// The core's reason for refusing tables or branch.
fn relaxing(
    [fraction, time_s]: [f64; 2],
    smooth: &SmoothModel,
    export: impl Fn(&SmoothModel) -> Result<CoreExport, Error>,
) -> Result<(CoreExport, Relaxation), Error> {
    let relaxed = 1.0 - fraction;
    let mut smooth = smooth.clone();
    smooth.ln_normal[0] += relaxed.ln();
    smooth.ln_tangential[0] += relaxed.ln();
    smooth.ln_strength[0] += smooth.load_exponent * relaxed.ln();
    let branches = Relaxation::new(&[Branch { share: (fraction / relaxed) as f32, time_s: time_s as f32 }])?;
    let export = export(&smooth)?;
    export.data.model()?.with_relaxation(&branches)?;
    Ok((export, branches))
}

/// Makes `corrected.fpm`.
///
/// A law of relaxation becomes a branch of the tissue, which also knows slow presses and retractions. Two of them, and one that the core
/// refuses as a branch, stay effect slots, which know the time since touch.
///
/// The tables are those of the refitted baseline. Where the core refuses them (not passive, out of range) the file is
/// not made.
///
/// Laws of the user's own become tables, over the ranges of their drivers in the file of laws or in the sets.
///
/// # Errors
/// [`DiagnoseError::Model`] with the core's reason, and for a law of more than two drivers.
pub fn corrected_model(
    data: &Data,
    reference: &ReferenceCurves,
    evidence: &Evidence,
) -> Result<CorrectedModel, DiagnoseError> {
    let refuse = |e: fingerpad::Error| DiagnoseError::Model(e.to_string());
    let smooth = reference.model(&evidence.parameters);
    let strokes = strokes_of(&evidence.calibration_set.runs);
    let export = |smooth: &SmoothModel| export_to_core(data, smooth, &strokes);
    let branches: Vec<_> = evidence.laws.iter().filter_map(branch_of).collect();
    let as_branch = match branches[..] {
        [branch] => relaxing(branch, &smooth, export).ok(),
        _ => None,
    };
    let is_branch = as_branch.is_some();
    let (finger, branches) = match as_branch {
        Some(made) => made,
        None => (export(&smooth).map_err(refuse)?, Relaxation::none()),
    };
    let CoreExport { data: tables, slots: of_model } = finger;
    let model = tables.model().and_then(|model| model.with_relaxation(&branches)).map_err(refuse)?;
    let (mut slots, mut section, mut summary) = (Vec::new(), Vec::new(), Vec::new());
    for active in evidence.laws.iter().filter(|active| !is_branch || branch_of(active).is_none()) {
        let Some(own) = evidence.own.find(active.law) else {
            slots.push(slot(active, &tables, reference, evidence));
            continue;
        };
        let table = tabulate(own, &active.values, |driver| own.drivers[driver].range).map_err(DiagnoseError::Model)?;
        slots.push(table.append(own, &mut section));
        summary.push(table.summary(own));
    }
    slots.extend(of_model);
    let effects = Effects::with_tables(&slots, &section).map_err(refuse)?;
    let (rms_n, _) = replay_all(&model, &effects, &evidence.checked_set);
    let laws: Vec<serde_json::Value> = evidence
        .laws
        .iter()
        .map(|a| {
            let names = a.law.parameters.iter().map(|p| p.name.to_owned());
            let values = names.zip(a.law.report(&a.values)).map(|(n, v)| (n, v.into()));
            let values = values.collect::<serde_json::Map<_, _>>();
            let mut out = serde_json::json!({ "law": a.law.name, "parameters": values });
            if let Some(own) = evidence.own.find(a.law) {
                out["acts_on"] = own.target.name().into();
                out["formula"] = own.text.clone().into();
            }
            out
        })
        .collect();
    let mut meta = serde_json::json!({
        "name": "corrected by fingerpad diagnose",
        "version": env!("CARGO_PKG_VERSION"),
        "effects": laws,
        "depth_max_mm": tables.depth_max,
        "column_corrections": evidence.corrections,
        "checked_on": evidence.checked,
        "rms_n": rms_n,
    });
    let mut columns = Vec::new();
    if !summary.is_empty() {
        meta["tables"] = serde_json::json!(summary);
        let of_file = evidence.own.columns.iter().map(OwnColumn::in_model_file);
        columns = of_file.collect::<Result<_, _>>().map_err(refuse)?;
    }
    let meta = meta.to_string();
    let of_laws = Sections { tables: &section, columns: &columns, relaxation: is_branch.then_some(&branches) };
    let mut bytes = vec![0; Data::file_length_with(&slots, of_laws, &meta)];
    tables.write_file_with(&slots, of_laws, &meta, &mut bytes).map_err(refuse)?;
    Ok(CorrectedModel { bytes, rms_n, tables: summary })
}

/// The effect slot of a law. Forces do not determine the area: where the file's area is not the one under which adhesion and drag
/// were fitted, their force at 0.9 mm is kept.
fn slot(active: &ActiveLaw, data: &Data, reference: &ReferenceCurves, evidence: &Evidence) -> EffectSlot {
    let mut values = [0.0f32; 6];
    for (slot, value) in values.iter_mut().zip(&active.values) {
        *slot = *value as f32;
    }
    let node = (MIDDLE_MM * f64::from(data.cells_per_mm)).round() as usize;
    let area = reference.model(&evidence.parameters).at_depth(node as f64 / f64::from(data.cells_per_mm)).area_mm2;
    let share = area / f64::from(data.rows[node.min(data.rows.len() - 1)].area.value);
    match active.law.place {
        Place::Rim => values[0] *= share.sqrt() as f32,
        Place::Drag => values[0] *= share as f32,
        _ => {}
    }
    EffectSlot { kind: active.law.kind, reserved: 0, values }
}
