//! Viscous drag, built up over a path after touch or a turn.

use super::{Axis, Change, Column, Conditions, Effect, Law, Parameter, Place, Real, Reported, VALUES};

/// Path over which the drag builds up after touch or a turn, mm.
const DRAG_PATH_MM: f64 = 0.2;

/// Viscous drag.
pub struct ViscousDrag;

impl Effect for ViscousDrag {
    const LAW: Law = Law {
        name: "viscous_drag",
        family: "speed",
        formula: "force += coefficient_n_s_per_mm v A/A0 (1 − e^(−s_turn/0.2)) along the motion, v the speed in mm/s",
        kind: 4,
        place: Place::Drag,
        parameters: &[Parameter {
            name: "coefficient_n_s_per_mm",
            unit: "N s/mm",
            low: 0.0,
            high: 1.0,
            typical: 0.002,
            positive: false,
        }],
        linear: 1,
        reported: Reported::AsFitted,
        drivers: &[Column::Speed],
        axes: &[Axis::Stroke, Axis::Speed],
        confused_with: &["speed_log"],
        source: "a viscous pad along the plane above about 100 Hz: Wiertlewski & Hayward 2012; the size is of the order of theirs",
        shapes: &[&[]],
        act: &Self::act::<f64>,
    };

    fn act<T: Real>(&[coefficient, ..]: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        let built_up = -(-at.turn_mm / T::of(DRAG_PATH_MM)).exp_m1();
        change.drag_n += coefficient * at.speed_mm_s * built_up;
    }
}
