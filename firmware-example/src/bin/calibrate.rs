//! A finger is calibrated on the device at 1 kHz: three presses and a slide, noise of 2 % and a spike now and then on the forces, 1 um
//! on the depth, a finger that touches 0.06 mm late. Ends with status 0 if what is found is the finger.
//!
//! The finger to be found is the shipped model of another tuning; finite elements of other fingers are in the core's tests.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use fingerpad::calibration::{Calibrated, Calibration, Measured, NotCalibrated, Settings};
use fingerpad::{Model, Motion, NODES, SPRINGS, State, Tuning, step};
use fingerpad_firmware::count::{self, instructions_in};
use fingerpad_firmware::noise::Noise;
use fingerpad_firmware::{exit, model};

const FINGER: Tuning = Tuning { size: 1.15, stiffness: 1.6, lambda: 0.7 };
const LATE_MM: f32 = 0.06;
const DT_S: f32 = 1e-3;
/// Depth and slide along x that the plane goes to, mm, at 2 mm/s.
const CORNERS: [[f32; 2]; 8] =
    [[0.6, 0.0], [-0.2, 0.0], [1.8, 0.0], [-0.2, 0.0], [1.0, 0.0], [1.0, 5.0], [1.0, 3.0], [-0.2, 3.0]];
const MM_PER_STEP: f32 = 2.0 * DT_S;
/// Rounds of idle time after the motions.
const ROUNDS_MAX: u32 = 40;

type Calibrator<'a> = Calibration<'a, SPRINGS, NODES>;

/// What the calibration cost and found.
struct Outcome {
    steps: u32,
    idle: u32,
    least: u32,
    sum: u32,
    most: u32,
    found: Result<Calibrated, NotCalibrated>,
}

/// The finger and the device's sensors.
struct Rig<'a> {
    finger: fingerpad::Model<'a>,
    state: State,
    noise: Noise,
    ticks: u32,
}

impl Rig<'_> {
    /// One step of the plane: the motion and the forces as the device reads them.
    fn read(&mut self, motion: Motion) -> (Motion, Measured) {
        let r = step(&self.finger, &mut self.state, Motion { depth_mm: motion.depth_mm - LATE_MM, ..motion });
        self.ticks += 1;
        let spike = if self.ticks.is_multiple_of(97) { 2.0 * self.noise.uniform() } else { 0.0 };
        let mut reading = |force: f32| force * (1.0 + 0.035 * self.noise.uniform()) + spike;
        let measured =
            Measured { normal_force_n: reading(r.normal_force_n), friction_n: r.friction_n.map(&mut reading) };
        (Motion { depth_mm: motion.depth_mm + 0.001 * self.noise.uniform(), ..motion }, measured)
    }
}

fn calibrate(model: &Model<'_>) -> Result<Outcome, fingerpad::Error> {
    let mut rig = Rig { finger: model.tuned(FINGER)?, state: State::default(), noise: Noise(7), ticks: 0 };
    let mut calibration = Calibrator::new(model, Settings::default());
    let mut o = Outcome { steps: 0, idle: 0, least: u32::MAX, sum: 0, most: 0, found: Err(NotCalibrated::NoContact) };
    let mut here = [-0.2f32, 0.0];
    for to in CORNERS {
        let way = [to[0] - here[0], to[1] - here[1]];
        let n = (way[0].abs().max(way[1].abs()) / MM_PER_STEP) as u32;
        for i in 1..=n {
            let depth_mm = here[0] + way[0] * i as f32 / n as f32;
            let slide_increment_mm = [way[1] / n as f32, 0.0];
            let motion = Motion { depth_mm, slide_increment_mm, spin_increment_rad: 0.0, dt_s: DT_S };
            let (seen, measured) = rig.read(motion);
            let took = instructions_in(|| calibration.step(seen, measured));
            o = Outcome {
                steps: o.steps + 1,
                sum: o.sum + took,
                least: o.least.min(took),
                most: o.most.max(took),
                ..o
            };
        }
        here = to;
    }
    o.found = calibration.result();
    while o.found == Err(NotCalibrated::Unsettled) && o.idle < ROUNDS_MAX * fingerpad::calibration::BLOCKS as u32 {
        calibration.work();
        o.idle += 1;
        o.found = calibration.result();
    }
    Ok(o)
}

/// Whether what was found is the finger: shares and mm.
fn is_right(found: &Calibrated) -> bool {
    let t = &found.tuning;
    let factors = [t.size / FINGER.size, t.stiffness / FINGER.stiffness, t.lambda / FINGER.lambda];
    factors.iter().all(|f| (f - 1.0).abs() < 0.05) && (found.depth_offset_mm + LATE_MM).abs() < 0.015
}

#[entry]
fn main() -> ! {
    let Some(mut p) = cortex_m::Peripherals::take() else { exit(Err(())) };
    count::start(&mut p.SYST);
    let Ok(Ok(o)) = model().map(|model| calibrate(&model)) else { exit(Err(())) };
    defmt::println!(
        "calibrate: {=u32} steps and {=u32} of idle time; a step takes {=u32} to {=u32} instructions, mean {=u32}; {=usize} bytes",
        o.steps,
        o.idle,
        o.least,
        o.most,
        o.sum / o.steps,
        size_of::<Calibrator<'_>>()
    );
    match o.found {
        Ok(found) => {
            defmt::println!(
                "calibrate: size {=f32} stiffness {=f32} lambda {=f32} (standard errors {} of them), depth {=f32} mm ({=f32} mm); it is {=f32}, {=f32}, {=f32}, {=f32} mm",
                found.tuning.size,
                found.tuning.stiffness,
                found.tuning.lambda,
                found.tuning_error,
                found.depth_offset_mm,
                found.depth_offset_error_mm,
                FINGER.size,
                FINGER.stiffness,
                FINGER.lambda,
                -LATE_MM
            );
            exit(if is_right(&found) { Ok(()) } else { Err(()) })
        }
        Err(missing) => {
            defmt::error!("calibrate: {}", missing);
            exit(Err(()))
        }
    }
}
