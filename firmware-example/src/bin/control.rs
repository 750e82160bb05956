//! Five fingertips at 10 kHz: the interrupt steps the models and grips harder when a finger is about to slip, the
//! main loop reports. Ends with status 0 if no finger slipped fully and every step was in time.
#![no_std]
#![no_main]

use core::cell::{Cell, RefCell};

use cortex_m::interrupt::Mutex;
use cortex_m_rt::{entry, exception};
use fingerpad::events::{Change, Event, Queue, Watch};
use fingerpad::{Model, Motion, Regime, Response, State, Tuning, step};
use fingerpad_firmware::convert::position_mm;
use fingerpad_firmware::grip::GripControl;
use fingerpad_firmware::{exit, model, start_tick, ticks_since_exception};
use heapless::spsc::{Consumer, Producer};

const RATE_HZ: u32 = 10_000;
/// Core clocks per step.
const PERIOD: u32 = fingerpad_firmware::CORE_CLOCK_HZ / RATE_HZ;
const FINGERS: usize = 5;
/// Thumb to little finger, as factors on size.
const SIZES: [f32; FINGERS] = [1.2, 1.0, 1.05, 1.0, 0.85];

struct Finger {
    model: Model<'static>,
    state: State,
    watch: Watch,
    control: GripControl,
    depth_extra: f32,
    /// The same finger without the controller, for comparison.
    left_alone: State,
}

/// What the interrupt owns.
struct Loop {
    fingers: [Finger; FINGERS],
    events: Producer<'static, Event>,
    last: [f32; 3],
}

/// What the main loop sees of it.
#[derive(Clone, Copy)]
struct Telemetry {
    tick: u32,
    responses: [Response; FINGERS],
    worst_ticks: u32,
    least_margin: f32,
    least_margin_alone: f32,
    done: bool,
}

static LOOP: Mutex<RefCell<Option<Loop>>> = Mutex::new(RefCell::new(None));
static TELEMETRY: Mutex<Cell<Telemetry>> = Mutex::new(Cell::new(Telemetry {
    tick: 0,
    responses: [Response::IN_THE_AIR; FINGERS],
    worst_ticks: 0,
    least_margin: 1.0,
    least_margin_alone: 1.0,
    done: false,
}));

#[exception]
fn SysTick() {
    cortex_m::interrupt::free(|key| {
        let mut inner = LOOP.borrow(key).borrow_mut();
        let Some(control) = inner.as_mut() else { return };
        let entered = ticks_since_exception();
        let mut telemetry = TELEMETRY.borrow(key).get();
        let Some(position) = position_mm(telemetry.tick, RATE_HZ) else {
            telemetry.done = true;
            TELEMETRY.borrow(key).set(telemetry);
            return;
        };
        let dt_s = 1.0 / RATE_HZ as f32;
        for (index, (finger, response)) in control.fingers.iter_mut().zip(&mut telemetry.responses).enumerate() {
            let motion = Motion {
                depth_mm: position[0] + finger.depth_extra,
                slide_increment_mm: [position[1] - control.last[1], position[2] - control.last[2]],
                spin_increment_rad: 0.0,
                dt_s,
            };
            *response = step(&finger.model, &mut finger.state, motion);
            if index == 1 {
                let alone = step(&finger.model, &mut finger.left_alone, Motion { depth_mm: position[0], ..motion });
                if alone.regime != Regime::NoContact {
                    telemetry.least_margin_alone = telemetry.least_margin_alone.min(alone.slip_margin);
                }
            }
            if response.regime != Regime::NoContact {
                telemetry.least_margin = telemetry.least_margin.min(response.slip_margin);
            }
            // Without contact the margin is 0, so that the finger closes; a commanded depth of 0 or less keeps it off.
            finger.depth_extra =
                if position[0] <= 0.0 { 0.0 } else { finger.control.update(response.slip_margin, dt_s) };
            finger.watch.look(response, &mut control.events);
        }
        control.last = position;
        telemetry.tick += 1;
        telemetry.worst_ticks = telemetry.worst_ticks.max((ticks_since_exception() + PERIOD - entered) % PERIOD);
        TELEMETRY.borrow(key).set(telemetry);
    });
}

fn start(events: Producer<'static, Event>) -> Result<Loop, fingerpad::Error> {
    let base = model()?;
    let mut fingers: [Finger; FINGERS] = core::array::from_fn(|i| Finger {
        model: base,
        state: State::default(),
        watch: Watch::new(i as u8),
        control: GripControl::default(),
        depth_extra: 0.0,
        left_alone: State::default(),
    });
    for (finger, size) in fingers.iter_mut().zip(SIZES) {
        finger.model = base.tuned(Tuning { size, ..Tuning::default() })?;
    }
    Ok(Loop { fingers, events, last: [0.0; 3] })
}

/// Reports until the recording ends. Returns the number of times a finger slipped fully while it was pressed.
fn report(events: &mut Consumer<'static, Event>) -> (u32, Telemetry) {
    let mut slips = 0;
    let mut next = 0;
    loop {
        cortex_m::asm::wfi();
        let now = cortex_m::interrupt::free(|key| TELEMETRY.borrow(key).get());
        while let Some(event) = events.dequeue() {
            defmt::info!("{=f32} s finger {=u8}: {}", event.tick as f32 / RATE_HZ as f32, event.finger, event.change);
            if event.change == Change::FullSlip {
                slips += 1;
            }
        }
        if now.done {
            return (slips, now);
        }
        if now.tick >= next {
            next += RATE_HZ / 5;
            let r = now.responses[1];
            defmt::info!(
                "{=f32} s index finger: N {=f32} F {} margin {=f32} stick {=f32} {}",
                now.tick as f32 / RATE_HZ as f32,
                r.normal_force_n,
                r.friction_n,
                r.slip_margin,
                r.stick_ratio,
                r.regime
            );
        }
    }
}

#[entry]
fn main() -> ! {
    static mut QUEUE: Queue<64> = Queue::new();
    let (producer, mut consumer) = QUEUE.split();
    let Some(mut peripherals) = cortex_m::Peripherals::take() else { exit(Err(())) };
    match start(producer) {
        Ok(control) => cortex_m::interrupt::free(|key| LOOP.borrow(key).replace(Some(control))),
        Err(error) => {
            defmt::error!("model: {}", error);
            exit(Err(()))
        }
    };
    start_tick(&mut peripherals.SYST, RATE_HZ);
    let (slips, end) = report(&mut consumer);
    let lost = cortex_m::interrupt::free(|key| {
        LOOP.borrow(key).borrow().as_ref().map_or(0, |l| l.fingers.iter().map(|f| f.watch.lost()).sum::<u32>())
    });
    defmt::println!(
        "control: {=u32} steps of {=usize} fingers, {=u32} full slips, least margin {=f32} (index finger without the controller {=f32}), {=u32} events lost, worst {=u32} of {=u32} ticks",
        end.tick,
        FINGERS,
        slips,
        end.least_margin,
        end.least_margin_alone,
        lost,
        end.worst_ticks,
        PERIOD
    );
    let in_time = end.worst_ticks < PERIOD / 2;
    let gripped = end.least_margin > 0.1 && end.least_margin_alone < 0.1;
    exit(if slips == 0 && lost == 0 && in_time && gripped && end.tick == 20_000 { Ok(()) } else { Err(()) })
}
