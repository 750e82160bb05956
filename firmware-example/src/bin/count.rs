//! Instructions per call of the model's step and of what one would compose instead.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use fingerpad::{DataOf, Motion, ParamsOf, Response, Slider, StateOf, step};
use fingerpad_firmware::count::{count, known_loop, start};

struct Ours<const M: usize> {
    data: DataOf<M, 25>,
    state: StateOf<M>,
    response: Response,
    checked: bool,
}

impl<const M: usize> Ours<M> {
    fn new() -> Self {
        let mut sliders = [Slider::default(); M];
        for (j, slider) in sliders.iter_mut().enumerate() {
            *slider = Slider {
                yield_position: 3.0 * (j as f32 + 0.3) / M as f32,
                strength_share: 1.0 / M as f32,
                area_share: 1.0 / M as f32,
            };
        }
        let data = ParamsOf::example_with(sliders).try_build().unwrap_or_else(|_| panic!("the example builds"));
        Self { data, state: StateOf::default(), response: Response::default(), checked: false }
    }
}

struct Bench<'a, const M: usize> {
    model: fingerpad::ModelOf<'a, M, 25>,
    state: StateOf<M>,
    response: Response,
}

extern "C" fn ours<const M: usize>(b: &mut Bench<'_, M>, s: &[f32; 4]) {
    b.response = step(&b.model, &mut b.state, Motion { depth_mm: s[0], slide_increment_mm: [s[1], s[2]], dt_s: s[3] });
}

/// 512 steps: stick, slip, reversals, turns, depth up and down, always in contact.
fn samples() -> [[f32; 4]; 512] {
    let mut seed = 7u32;
    let mut next = move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1 << 24) as f32
    };
    let mut out = [[0.0; 4]; 512];
    let (mut depth, mut vx, mut vy) = (1.0, 0.0, 0.0);
    for (i, s) in out.iter_mut().enumerate() {
        if i % 32 == 0 {
            (vx, vy) = (1.2 * (next() - 0.5), 1.2 * (next() - 0.5));
            depth = 0.2 + 2.2 * next();
        }
        if i % 64 < 8 {
            (vx, vy) = (0.02 * vx, 0.02 * vy);
        }
        *s = [depth + 0.02 * next(), vx, vy, 1e-4];
    }
    out
}

fn row<const M: usize>(samples: &[[f32; 4]]) {
    let ours_m = Ours::<M>::new();
    let Ok(model) = ours_m.data.model() else { return };
    let mut bench = Bench { model, state: StateOf::default(), response: Response::default() };
    let c = count(ours::<M>, &mut bench, samples);
    black_box(&bench.response);
    defmt::println!("count step M={=usize} least {} mean {} most {}", M, c.least, c.mean, c.most);
    let _ = (ours_m.checked, ours_m.state, ours_m.response);
}

#[entry]
fn main() -> ! {
    let Some(mut p) = cortex_m::Peripherals::take() else { fingerpad_firmware::exit(Err(())) };
    start(&mut p.SYST);
    let base = known_loop(1) - 3;
    let mut sound = true;
    for n in [1, 10, 100, 1000, 100_000] {
        sound &= known_loop(n) - base == 2 * n + 1;
    }
    defmt::println!("counter {=str}", if sound { "sound" } else { "unsound" });
    let samples = samples();
    row::<2>(&samples);
    row::<4>(&samples);
    row::<5>(&samples);
    row::<6>(&samples);
    row::<8>(&samples);
    row::<16>(&samples);
    fingerpad_firmware::exit(if sound { Ok(()) } else { Err(()) })
}
