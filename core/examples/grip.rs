//! A grip at 1 kHz that sees slip begin from measured forces alone. `cargo run --release -p fingerpad --example grip`
//!
//! Two fingers hold an object whose weight grows fivefold. The gripper has the depth that it commands and the forces that it
//! measures, with 1 % of noise; it does not see the object move. Its model, driven by the measured forces, returns the share of the
//! contact that still sticks. When slip begins, or the margin falls, the grip grows to the force that the load needs. The fingers really have a
//! tenth less friction than the model, and the grip shakes by 5 um.
//!
//! Then a finger whose tissue relaxes squeezes until the load has a margin, and holds that depth for a minute. Chosen by the margin of the
//! moment the load slips; chosen by the one that will be left it holds.

use fingerpad::build::Params;
use fingerpad::events::{Change, Watch};
use fingerpad::pad::{EXAMPLE_PATCHES, ExamplePad, PadOn, Plane, RelaxingPadState};
use fingerpad::{Drivable, Drive, Model, Motion, Normal, Relaxation, Response, State, Tangential, Tuning, step};

const DT_S: f32 = 1e-3;
/// Margin that the grip is to leave beyond the model's band, and the one below which it grows.
const MARGIN: f32 = 0.35;
const LEAST_MARGIN: f32 = 0.2;
/// Speed of the gripper, mm/s.
const SPEED_MM_S: f32 = 20.0;

/// The gripper's controller.
struct Controller<'a> {
    model: Model<'a>,
    state: State,
    watch: Watch,
    wanted_mm: f32,
    /// Times that slip began.
    slips: u32,
}

impl Controller<'_> {
    /// Depth to press to next, mm, from the forces measured at one finger, N.
    fn update(&mut self, normal_n: f32, friction_n: [f32; 2]) -> f32 {
        let measured = Drive {
            normal: Normal::ForceN(normal_n),
            tangential: Tangential::FrictionN(friction_n),
            spin_increment_rad: 0.0,
            dt_s: DT_S,
        };
        let seen = self.model.step_driven(&mut self.state, measured).response;
        let begins = self.watch.see(&seen).any(|event| matches!(event.change, Change::FirstSlip | Change::FullSlip));
        self.slips += u32::from(begins);
        if begins || seen.slip_margin < LEAST_MARGIN {
            let grip = self.model.least_grip(friction_n, MARGIN, 1.0);
            self.wanted_mm = self.wanted_mm.max(grip.depth_mm);
        }
        self.wanted_mm
    }
}

/// What became of the object.
#[derive(Debug)]
struct Outcome {
    fell_mm: f32,
    least_margin: f32,
    slips: u32,
    depth_mm: f32,
}

/// Four seconds: the weight grows from the second on; `controlled` or with the first grip left as it is.
fn hold(model: &Model<'_>, finger: &Model<'_>, controlled: bool) -> Outcome {
    let first = model.least_grip([0.1, 0.0], MARGIN, 1.0).depth_mm;
    let mut gripper =
        Controller { model: *model, state: State::default(), watch: Watch::new(0), wanted_mm: first, slips: 0 };
    let (mut pad, mut depth, mut place, mut speed, mut load) = (State::default(), 0.0f32, 0.0f32, 0.0f32, 0.0f32);
    let (mass_t, damping) = (40e-6, 8e-3);
    let mut seed = 1u32;
    let mut noise = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1 << 23) as f32 - 1.0
    };
    let mut outcome = Outcome { fell_mm: 0.0, least_margin: 1.0, slips: 0, depth_mm: 0.0 };
    for i in 0..4000 {
        let time = i as f32 * DT_S;
        let weight = 0.2 * ((time - 0.3) / 0.3).clamp(0.0, 1.0) * (1.0 + 4.0 * ((time - 1.0) / 2.0).clamp(0.0, 1.0));
        speed += (weight - 2.0 * load - damping * speed) / mass_t * DT_S;
        let before = place;
        place += speed * DT_S;
        depth += (gripper.wanted_mm - depth).clamp(-SPEED_MM_S * DT_S, SPEED_MM_S * DT_S);
        let motion = Motion {
            depth_mm: depth + 0.005 * noise(),
            slide_increment_mm: [place - before, 0.0],
            spin_increment_rad: 0.0,
            dt_s: DT_S,
        };
        let r = step(finger, &mut pad, motion);
        load = r.friction_n[0];
        let mut reading = |force: f32| force * (1.0 + 0.01 * noise());
        let measured = (reading(r.normal_force_n), r.friction_n.map(&mut reading));
        if controlled {
            gripper.update(measured.0, measured.1);
        }
        if time > 0.3 {
            outcome.least_margin = outcome.least_margin.min(r.slip_margin);
        }
    }
    outcome.fell_mm = place;
    (outcome.slips, outcome.depth_mm) = (gripper.slips, depth);
    outcome
}

/// With the controller and without it.
fn both() -> Result<[Outcome; 2], fingerpad::Error> {
    // Hand-made numbers; a gripper takes `Model::from_bytes(include_fpm!("fingertip.fpm"))`.
    let data = Params::example().try_build()?;
    let model = data.model()?;
    let finger = model.tuned(Tuning { lambda: 0.9, ..Tuning::default() })?;
    Ok([true, false].map(|controlled| hold(&model, &finger, controlled)))
}

/// A margin of a response, by which a grip may be chosen.
type Margin = fn(&Response) -> f32;
const MARGINS: [(&str, Margin); 2] =
    [("slip_margin", |r| r.slip_margin), ("slip_margin_relaxed", |r| r.slip_margin_relaxed)];
/// Load on a finger that relaxes, N, margin that the squeeze is to leave, and the part of the load below which it has slipped.
const LOAD_N: f32 = 0.1;
const KEPT: f32 = 0.15;
const SLIPPED: f32 = 0.95;

/// A squeeze under a load until a margin of its responses is [`KEPT`], then a minute at that depth: the depth, mm, and the time at which the load
/// slips, s.
fn squeezed(margin: Margin) -> Result<(f32, Option<f32>), fingerpad::Error> {
    // Hand-made numbers, and times of a human finger with assumed shares.
    let example = ExamplePad::new();
    let pad = example.pad().with_relaxation(Relaxation::HUMAN_ASSUMED);
    let finger = PadOn { pad, body: &Plane, pose_deg: [pad.numbers.neutral_pitch_deg, 0.0] };
    let mut state = RelaxingPadState::<EXAMPLE_PATCHES>::relaxing(&pad)?;
    let mut drive = Drive {
        normal: Normal::DepthMm(0.0),
        tangential: Tangential::FrictionN([LOAD_N, 0.0]),
        spin_increment_rad: 0.0,
        dt_s: DT_S,
    };
    let mut depth = 0.0;
    loop {
        depth += SPEED_MM_S * DT_S;
        drive.normal = Normal::DepthMm(depth);
        let seen = finger.step_driven(&mut state, drive).response;
        if (margin(&seen) >= KEPT && seen.friction_n[0] > SLIPPED * LOAD_N) || depth > pad.depth_max_mm() {
            break;
        }
    }
    let mut time = 0.0;
    while time < 60.0 {
        let held = finger.step_driven(&mut state, drive).response;
        time += drive.dt_s;
        drive.dt_s = (1.05 * drive.dt_s).min(0.1);
        if held.friction_n[0] < SLIPPED * LOAD_N {
            return Ok((depth, Some(time)));
        }
    }
    Ok((depth, None))
}

fn main() -> Result<(), fingerpad::Error> {
    for (name, margin) in MARGINS {
        let (depth, slips) = squeezed(margin)?;
        println!("tissue that relaxes, grip by {name}: {depth:.2} mm, slips at {slips:?} s");
    }
    let [held, dropped] = both()?;
    println!("controlled: {held:?}");
    println!("left alone: {dropped:?}");
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_object_is_held_by_what_slip_tells_and_falls_without() {
        let [held, dropped] = super::both().unwrap();
        assert!(held.slips > 0 && held.least_margin > 0.05 && held.fell_mm < 3.0, "{held:?}");
        assert!(dropped.fell_mm > 50.0, "{dropped:?}");
    }

    #[test]
    fn a_grip_by_the_margin_that_is_left_holds_and_one_by_that_of_the_moment_slips() {
        let [now, later] = super::MARGINS.map(|(_, margin)| super::squeezed(margin).unwrap());
        assert!(now.1.is_some_and(|time| time > 0.05) && later.1.is_none() && later.0 > now.0, "{now:?} {later:?}");
    }
}
