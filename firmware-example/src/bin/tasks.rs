//! The step in a real-time framework (RTIC 2): a timer's task steps the model at 1 kHz, a task of lower priority takes forces and
//! events from it through queues of heapless and reports them. Ends with status 0 if nothing was lost and every step was in time.
#![no_std]
#![no_main]

// The vector table is in there.
use cortex_m_rt as _;

/// What RTIC wants to know of a device: mps2-an386 has three bits of priority. All tasks here are the processor's own exceptions.
pub mod device {
    /// Bits of priority.
    pub const NVIC_PRIO_BITS: u8 = 3;
}

#[rtic::app(device = crate::device, peripherals = false)]
mod app {
    use cortex_m::peripheral::SCB;
    use fingerpad::events::{Change, Event, Queue as Events, Watch};
    use fingerpad::{Model, Motion, State, step};
    use fingerpad_firmware::{CORE_CLOCK_HZ, exit, model, start_tick, ticks_since_exception};
    use heapless::spsc::{Consumer, Producer, Queue};

    const RATE_HZ: u32 = 1_000;
    const DT_S: f32 = 1.0 / RATE_HZ as f32;
    const STEPS: u32 = 3_000;
    /// Core clocks per step.
    const PERIOD: u32 = CORE_CLOCK_HZ / RATE_HZ;

    /// What the stepping task hands over.
    pub struct Forces {
        tick: u32,
        newton: [f32; 3],
        margin: f32,
        took_ticks: u32,
    }

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        finger: Model<'static>,
        state: State,
        watch: Watch,
        tick: u32,
        forces_in: Producer<'static, Forces>,
        events_in: Producer<'static, Event>,
        forces_out: Consumer<'static, Forces>,
        events_out: Consumer<'static, Event>,
        seen: u32,
        changes: u32,
        worst_ticks: u32,
    }

    #[init(local = [forces: Queue<Forces, 16> = Queue::new(), events: Events<16> = Events::new()])]
    fn init(cx: init::Context) -> (Shared, Local) {
        let (forces_in, forces_out) = cx.local.forces.split();
        let (events_in, events_out) = cx.local.events.split();
        let Ok(finger) = model() else { exit(Err(())) };
        let mut core = cx.core;
        start_tick(&mut core.SYST, RATE_HZ);
        let local = Local {
            finger,
            state: State::default(),
            watch: Watch::new(0),
            tick: 0,
            forces_in,
            events_in,
            forces_out,
            events_out,
            seen: 0,
            changes: 0,
            worst_ticks: 0,
        };
        (Shared {}, local)
    }

    /// Presses to 1 mm, slides 3 mm, lifts: a second each.
    fn motion(tick: u32) -> Motion {
        let time = tick as f32 * DT_S;
        let depth_mm = if time < 2.0 { time.min(1.0) } else { 1.0 - 1.2 * (time - 2.0) };
        let slide = if (1.0..2.0).contains(&time) { 3.0 * DT_S } else { 0.0 };
        Motion { depth_mm, slide_increment_mm: [slide, 0.0], spin_increment_rad: 0.0, dt_s: DT_S }
    }

    /// The step, from the timer: nothing here waits.
    #[task(binds = SysTick, priority = 2, local = [finger, state, watch, tick, forces_in, events_in])]
    fn control(cx: control::Context) {
        let entered = ticks_since_exception();
        let l = cx.local;
        let r = step(l.finger, l.state, motion(*l.tick));
        l.watch.look(&r, l.events_in);
        let [x, y] = r.friction_n;
        let took_ticks = (ticks_since_exception() + PERIOD - entered) % PERIOD;
        let forces = Forces { tick: *l.tick, newton: [r.normal_force_n, x, y], margin: r.slip_margin, took_ticks };
        // A full queue loses this one; the reader misses its tick.
        let _ = l.forces_in.enqueue(forces);
        *l.tick += 1;
        SCB::set_pendsv();
    }

    /// Everything that may take its time, interrupted by the step whenever that is due.
    #[task(binds = PendSV, priority = 1, local = [forces_out, events_out, seen, changes, worst_ticks])]
    fn report(cx: report::Context) {
        let l = cx.local;
        while let Some(event) = l.events_out.dequeue() {
            defmt::println!("{=u32} ms: {}", event.tick, event.change);
            *l.changes += u32::from(!matches!(event.change, Change::Restick));
        }
        while let Some(Forces { tick, newton, margin, took_ticks }) = l.forces_out.dequeue() {
            *l.seen += 1;
            *l.worst_ticks = took_ticks.max(*l.worst_ticks);
            if tick % 500 == 499 {
                defmt::println!("{=u32} ms: N, Fx, Fy {} N, margin {=f32}", tick, newton, margin);
            }
            if tick + 1 == STEPS {
                let in_time = *l.worst_ticks < PERIOD / 2;
                defmt::println!(
                    "tasks: {=u32} of {=u32} steps seen, {=u32} changes, worst {=u32} of {=u32} ticks",
                    *l.seen,
                    STEPS,
                    *l.changes,
                    *l.worst_ticks,
                    PERIOD
                );
                // Touch, first slip, full slip, lift-off.
                exit(if *l.seen == STEPS && *l.changes == 4 && in_time { Ok(()) } else { Err(()) })
            }
        }
    }

    #[idle]
    fn idle(_: idle::Context) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }
}
