//! Comparison of model and measurement, row by row of the table.

use super::{
    LawPoint, Point, Steady, Table,
    outcome::{ModelDataComparison, Modelled},
};
use fingerpad_fe::contact::RubberFriction;

/// Compares the states of all slots (depths) with the table's rows.
pub fn compare(table: &Table, law: &LawPoint, base: &RubberFriction, states: &[Steady]) -> ModelDataComparison {
    let percent = |model: f64, measured: f64| 100.0 * (model / measured - 1.0);
    let rows: Vec<Modelled> = table
        .points
        .iter()
        .zip(&table.slot)
        .map(|(point, &slot)| {
            let state = &states[slot];
            let mu = state.friction_coefficient();
            Modelled {
                depth_mm: point.depth_mm,
                model_depth_mm: state.depth_mm,
                normal_force_n: state.normal_force_n,
                contact_area_mm2: state.contact_area_mm2,
                friction_coefficient: mu,
                normal_force_difference_percent: percent(state.normal_force_n, point.normal_force_n),
                contact_area_difference_percent: point.contact_area_mm2.map(|a| percent(state.contact_area_mm2, a)),
                friction_coefficient_difference_percent: percent(mu, point.friction_coefficient),
            }
        })
        .collect();
    let difference = |(row, point): (&Modelled, &Point)| row.friction_coefficient - point.friction_coefficient;
    let sum_of_squares = rows.iter().zip(&table.points).map(difference).map(|d| d * d).sum();
    let friction = law.friction(base);
    ModelDataComparison {
        lambda: friction.lambda,
        beta: friction.beta,
        tau0_mpa: friction.tau0_mpa,
        rows,
        sum_of_squares,
    }
}
