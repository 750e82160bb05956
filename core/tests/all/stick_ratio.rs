//! The stick ratio after growths, turns and lifts of a contact.

use fingerpad::build::Params;
use fingerpad::{Motion, Regime, Response, State};

/// Steps to a depth and by a slide along x, in steps of 5 µm; the responses on the way.
fn go(state: &mut State, depth_mm: f32, slide_mm: f32) -> Vec<Response> {
    go_along(state, depth_mm, slide_mm, 0.0)
}

/// The same with a slide at an angle to x, degrees.
fn go_along(state: &mut State, depth_mm: f32, slide_mm: f32, degrees: f32) -> Vec<Response> {
    let data = Params::example().try_build().unwrap();
    let model = data.model().unwrap();
    let from = state.depth_mm();
    let steps = ((depth_mm - from).abs().max(slide_mm.abs()) / 0.005).ceil();
    (1..=steps as u32)
        .map(|k| {
            let depth_mm = from + (depth_mm - from) * (k as f32 / steps);
            let (sin, cos) = degrees.to_radians().sin_cos();
            let slide_increment_mm = [slide_mm / steps * cos, slide_mm / steps * sin];
            model.step(state, Motion { depth_mm, slide_increment_mm, dt_s: 1e-3, ..Motion::default() })
        })
        .collect()
}

#[test]
fn a_press_and_a_lift_stick() {
    let mut state = State::default();
    for r in go(&mut state, 1.5, 0.0).into_iter().chain(go(&mut state, 0.05, 0.0)) {
        assert_eq!(r.regime, Regime::Stick, "{r:?}");
    }
}

/// A contact that grows sticks; back where it was the old stick ratio comes back with the next slide, below it at once.
#[test]
fn what_a_growth_hid_comes_back() {
    let mut state = State::default();
    go(&mut state, 1.0, 0.0);
    let before = go(&mut state, 1.0, 1.0).pop().unwrap().stick_ratio;
    assert!(before > 0.2 && before < 0.8, "{before}");
    assert!(go(&mut state, 1.2, 0.0).pop().unwrap().stick_ratio > 0.99);
    assert!(go(&mut state, 1.02, 0.0).pop().unwrap().stick_ratio > 0.95);
    let mut lower = state;
    let after = go(&mut state, 1.0, 0.03).pop().unwrap().stick_ratio;
    assert!((after - before).abs() < 0.04, "{after} after {before}");
    let below = go(&mut lower, 0.98, 0.0).pop().unwrap().stick_ratio;
    assert!((below - before).abs() < 0.06, "{below} after {before}");
}

/// After a small growth the stick ratio is that of a slide at the new depth once friction has grown by as much as the limit
/// (Mindlin and Deresiewicz 1953), before it the contact sticks; also where the depth trembles meanwhile by a micrometre. After a
/// large growth it is not.
#[test]
fn a_slide_brings_back_what_a_small_growth_hid() {
    for (degrees, tremble_mm) in [(0.0, 0.0), (180.0, 0.0), (90.0, 0.0), (0.0, 0.001)] {
        let slide = |state: &mut State, depth_mm: f32, slide_mm: f32| {
            let mut last = 0.0;
            for k in 0..4 {
                let depth_mm = depth_mm + if k % 2 == 0 { tremble_mm } else { -tremble_mm };
                last = go_along(state, depth_mm, 0.25 * slide_mm, degrees).pop().unwrap().stick_ratio;
            }
            last
        };
        let after = |grown_mm: f32, slide_mm: f32| {
            let [mut grown, mut plain] = [State::default(); 2];
            go(&mut grown, 1.0, 0.0);
            go(&mut plain, 1.0 + grown_mm, 0.0);
            let before = slide(&mut grown, 1.0, 0.8);
            assert!(before > 0.05 && before < 0.95, "{degrees}: {before}");
            slide(&mut plain, 1.0 + grown_mm, 0.8);
            let hidden = go_along(&mut grown, 1.0 + grown_mm, 0.0, degrees).pop().unwrap().stick_ratio;
            let [grown, plain] = [&mut grown, &mut plain].map(|state| slide(state, 1.0 + grown_mm, slide_mm));
            (hidden, grown, plain)
        };
        let (hidden, grown, plain) = after(0.03, 0.08);
        assert!(hidden > 0.99 && (grown - plain).abs() < 0.02, "{degrees} {hidden} {grown} {plain}");
        let (_, grown, plain) = after(0.2, 0.08);
        assert!(grown > plain + 0.1, "{degrees} {grown} {plain}");
    }
}

/// Finite-element contacts that turn by 120 degrees or more stick by 0.7 to 1 afterwards, whatever slipped before; by less
/// than 80 degrees they slip on. From full slip the model lets less stick than that up to 140 degrees.
#[test]
fn an_obtuse_turn_sticks_and_an_acute_one_does_not() {
    for (degrees, least, most) in
        [(180.0, 0.97, 1.0), (150.0, 0.8, 1.0), (135.0, 0.5, 1.0), (70.0, 0.0, 0.1), (40.0, 0.0, 0.1)]
    {
        for sign in [1.0, -1.0] {
            let mut state = State::default();
            go(&mut state, 1.0, 0.0);
            assert!(go(&mut state, 1.0, 3.0).pop().unwrap().stick_ratio <= 0.01);
            let after = go_along(&mut state, 1.0, 0.1, sign * degrees).pop().unwrap().stick_ratio;
            assert!((least..=most).contains(&after), "{degrees} degrees: {after}");
        }
    }
}

/// A contact grows while it slides, then shrinks. The parts that stuck during the growth slip over several steps of 5 µm, all of them once
/// friction is at its limit, and before the limit has returned to its value before the growth.
#[test]
fn a_contact_that_shrinks_slips_where_friction_meets_its_limit() {
    let mut state = State::default();
    go(&mut state, 0.6, 0.6);
    let grown = go(&mut state, 1.4, 0.5).pop().unwrap();
    assert!(grown.stick_ratio > 0.9, "{grown:?}");
    let mut last = grown.stick_ratio;
    for r in go(&mut state, 0.3, 0.0) {
        assert!((r.stick_ratio - last).abs() < 0.6, "{last} then {r:?}");
        assert!(r.slip_margin > 1e-3 || r.stick_ratio < 0.1, "{r:?}");
        last = r.stick_ratio;
    }
    assert!(last < 1e-3, "{last}");
}

/// A contact that is lifted while it moves back continues to slip at its rim; one that moves back at constant depth sticks.
#[test]
fn a_contact_that_is_lifted_as_it_turns_slips_on() {
    let mut state = State::default();
    go(&mut state, 1.5, 0.0);
    let before = go(&mut state, 1.5, 1.2).pop().unwrap().stick_ratio;
    assert!(before > 0.2 && before < 0.8, "{before}");
    let mut held = state;
    let lifted = go(&mut state, 1.3, -0.06).pop().unwrap().stick_ratio;
    assert!((lifted - before).abs() < 0.2, "{lifted} after {before}");
    let turned = go(&mut held, 1.5, -0.06).pop().unwrap().stick_ratio;
    assert!(turned > 0.98, "{turned} after {before}");
}
