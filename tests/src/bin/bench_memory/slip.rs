//! First slip through noise, and the stick ratio after a growth of depth.

use fingerpad::events::{Change, Queue, Watch};
use fingerpad::{Model, State, step};

use crate::row::{DIRECTIONS, Noise, Row, full_slip_slide_mm, held, motion};

/// Slide at which a watch reports first slip, mm, and the number of changes between slip and stick until full slip.
fn first_slip_and_changes(
    model: &Model<'_>,
    depth: f64,
    along: [f64; 2],
    steps: u32,
    noise_mm: f64,
    seed: u64,
) -> (f64, usize) {
    let mut queue: Queue<256> = Queue::new();
    let (mut producer, mut consumer) = queue.split();
    let (mut watch, mut state, mut random) = (Watch::new(0), State::default(), Noise::new(seed));
    let length = 1.3 * full_slip_slide_mm(model, depth, along) / f64::from(steps);
    let mut there = [0.0; 2];
    for i in 0..steps + 20 {
        let slid = length * f64::from(i.saturating_sub(20));
        let to = along.map(|a| slid * a + noise_mm * random.uniform());
        let by = [to[0] - there[0], to[1] - there[1]];
        there = to;
        let response = step(model, &mut state, motion(depth + noise_mm * random.uniform(), by));
        watch.look(&response, &mut producer);
    }
    let (mut first, mut changes) = (f64::NAN, watch.lost() as usize);
    while let Some(event) = consumer.dequeue() {
        if event.change == Change::FirstSlip && first.is_nan() {
            first = length * f64::from(event.tick.saturating_sub(20));
        }
        changes += usize::from(!matches!(event.change, Change::Touch | Change::LiftOff));
    }
    (first, changes)
}

/// Straight slides with 1 um of noise on depth and slide.
pub fn first_slip(model: &Model<'_>, seed: u64) -> Vec<Row> {
    let mut rows = vec![];
    for steps in [300, 3000] {
        let (mut apart, mut most) = (0.0f64, 0);
        for (i, depth) in [0.3, 0.5, 0.8, 1.2, 1.6, 2.0].into_iter().enumerate() {
            for (k, (_, along)) in DIRECTIONS.into_iter().enumerate() {
                let (still, _) = first_slip_and_changes(model, depth, along, steps, 0.0, 0);
                for repeat in 0..5 {
                    let (noisy, changes) = first_slip_and_changes(
                        model,
                        depth,
                        along,
                        steps,
                        0.001,
                        seed + 1000 * i as u64 + 100 * k as u64 + repeat,
                    );
                    let off = 100.0 * (noisy / still - 1.0).abs();
                    apart = if off.is_nan() { f64::INFINITY } else { apart.max(off) };
                    most = most.max(changes);
                }
            }
        }
        let what = format!("slides of {steps} steps with 1 um noise on depth and slide");
        rows.push(Row::new(format!("{what}: first slip against the noise-free"), apart, [10.0, 5.0], "% of the slide"));
        rows.push(Row::new(format!("{what}: changes reported"), most as f64, [4.0, 2.0], "changes"));
    }
    rows
}

/// A contact in partial slip grows and slides on by 50 um: its stick ratio against that of a slide at the final depth.
pub fn growth(model: &Model<'_>) -> Vec<Row> {
    let mut rows = vec![];
    for (what, growth) in [("the last bit", 1.2e-7), ("1 um", 1e-3), ("10 um", 1e-2)] {
        let mut apart = 0.0f64;
        for depth in [0.5, 1.0, 1.5] {
            for (_, along) in DIRECTIONS {
                let full = full_slip_slide_mm(model, depth, along);
                for share in [0.3, 0.5, 0.7] {
                    let (mut state, _) = held(model, depth, along, share * full);
                    let (mut plain, _) = held(model, depth + growth, along, share * full);
                    let mut ratios = [0.0; 2];
                    for _ in 0..10 {
                        let on = motion(depth + growth, along.map(|a| 0.005 * a));
                        ratios = [step(model, &mut state, on), step(model, &mut plain, on)]
                            .map(|r| f64::from(r.stick_ratio));
                    }
                    apart = apart.max((ratios[0] - ratios[1]).abs());
                }
            }
        }
        rows.push(Row::new(
            format!("depth grows by {what} while slipping: stick ratio 50 um of slide later"),
            apart,
            [0.05, 0.02],
            "",
        ));
    }
    rows
}
