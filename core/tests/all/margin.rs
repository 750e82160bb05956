//! The observer of the margin: surfaces of the bed's own, a surface that changes, readings that are unsound.
//! Finite elements as truth are in the repository's tests (`margin`).

use crate::common::{Noise, shipped};
use fingerpad::margin::{Known, Margin, MarginObserver, Observable, Observer as Core, Reading, Settings};
use fingerpad::{Drivable, Drive, Error, Model, Normal, State, Status, Tangential, Tuning};
use proptest::prelude::*;

/// Of [`the_bits_of_a_story`].
const DIGEST: u32 = 0xDEBB_CAD0;

type Observer<'a> = MarginObserver<'a, 4, 37>;

pub const AIR: Reading = Reading {
    normal_force_n: 0.0,
    friction_n: [0.0; 2],
    slide_increment_mm: [0.0; 2],
    normal_variance_n2: 25e-6,
    friction_covariance_n2: [25e-6, 25e-6, 0.0],
    slide_covariance_mm2: [25e-6, 25e-6, 0.0],
    stick_ratio: 0.0,
    stick_variance: 0.0,
    spin_increment_rad: 0.0,
    spin_moment_n_mm: 0.0,
    spin_variance_n2_mm2: 0.0,
    dt_s: 1e-3,
};

fn observer<'a>(model: &Model<'a>) -> Observer<'a> {
    Observer::new(model, Settings { curve: [0.0; 5], ..Settings::default() }).unwrap()
}

/// A finger and the sensors: 5 mN, 5 um.
pub struct Rig<F, S> {
    finger: F,
    pub state: S,
    noise: Noise,
    before: [f32; 2],
    place: [f32; 2],
    /// True margin after the last reading.
    pub margin: f32,
    /// Standard deviation of the measured stick ratio; 0: not measured.
    stick_noise: f32,
}

impl<S: Clone, F: Drivable<S>> Rig<F, S> {
    pub fn new(model: &F, stiffness: f32, strength: f32) -> Self {
        let finger = model.tuned(Tuning { stiffness, ..Tuning::default() }).unwrap();
        let mut state = finger.fresh().unwrap();
        finger.set_strength_factor(&mut state, strength);
        Self { finger, state, noise: Noise(5), before: [0.0; 2], place: [0.0; 2], margin: 1.0, stick_noise: 0.0 }
    }

    pub fn read(&mut self, normal_n: f32, by: [f32; 2]) -> Reading {
        self.read_turned(normal_n, by, 0.0, 0.0)
    }

    /// A reading with a turn, rad.
    ///
    /// * `moment_noise`: standard deviation of the measured moment, N mm; 0: not measured
    pub fn read_turned(&mut self, normal_n: f32, by: [f32; 2], spin_increment_rad: f32, moment_noise: f32) -> Reading {
        let drive = Drive {
            normal: Normal::ForceN(normal_n),
            tangential: Tangential::SlideIncrementMm(by),
            spin_increment_rad,
            dt_s: 1e-3,
        };
        let r = self.finger.step_driven(&mut self.state, drive).response;
        self.margin = r.slip_margin;
        self.place = [self.place[0] + by[0], self.place[1] + by[1]];
        // Uniform noise of the standard deviation that the reading states.
        let mut noise = |size: f32| 3.0f32.sqrt() * size * self.noise.next();
        let seen = self.place.map(|x| x + noise(5e-3));
        let increment = [seen[0] - self.before[0], seen[1] - self.before[1]];
        self.before = seen;
        Reading {
            normal_force_n: r.normal_force_n + noise(5e-3),
            friction_n: r.friction_n.map(|f| f + noise(5e-3)),
            slide_increment_mm: increment,
            stick_ratio: r.stick_ratio + noise(self.stick_noise),
            stick_variance: self.stick_noise * self.stick_noise,
            spin_increment_rad,
            spin_moment_n_mm: if moment_noise > 0.0 { r.spin_moment_n_mm + noise(moment_noise) } else { 0.0 },
            spin_variance_n2_mm2: moment_noise * moment_noise,
            ..AIR
        }
    }

    /// Presses, then slides until the true margin has come down to `margin`; the last answer.
    pub fn pull<O: Observable<T>, T: Copy, const N: usize>(
        &mut self,
        observer: &mut Core<O, T, N>,
        margin: f32,
    ) -> Margin {
        for k in 0..300 {
            observer.step(self.read(0.8 * (k as f32 / 300.0), [0.0; 2]));
        }
        self.slide(observer, margin)
    }

    pub fn slide<O: Observable<T>, T: Copy, const N: usize>(
        &mut self,
        observer: &mut Core<O, T, N>,
        margin: f32,
    ) -> Margin {
        let mut last = observer.step(self.read(0.8, [0.0; 2]));
        for _ in 0..6000 {
            if self.margin <= margin {
                break;
            }
            last = observer.step(self.read(0.8, [4e-3, -2e-3]));
        }
        last
    }
}

#[test]
fn the_strength_of_a_surface_is_found_before_it_slips() {
    let data = shipped();
    let model = data.model().unwrap();
    for (stiffness, strength) in [(1.0, 0.5), (0.87, 0.7), (1.15, 1.0), (1.0, 1.5), (0.9, 2.0)] {
        let (mut rig, mut observer) = (Rig::<_, State>::new(&model, stiffness, strength), observer(&model));
        let stuck = rig.pull(&mut observer, 0.97);
        assert_eq!(stuck.known, Known::Prior, "{strength}: {stuck:?}");
        assert!(stuck.strength_high / stuck.strength_low > 3.0, "{strength}: {stuck:?}");
        let late = rig.slide(&mut observer, 0.15);
        assert!(late.strength_low < strength && strength < late.strength_high, "{strength}: {late:?}");
        assert!((late.strength_factor / strength).ln().abs() < 0.25, "{strength}: {late:?}");
        assert!(late.margin_low < rig.margin && rig.margin < late.margin_high, "{strength}: {late:?}");
        assert!(late.information > 0.5 && late.margin_high < 0.5, "{strength}: {late:?}");
        let slipping = rig.slide(&mut observer, 0.0);
        assert!(slipping.margin_low == 0.0 && slipping.slip_chance > 0.1, "{strength}: {slipping:?}");
    }
}

#[test]
fn the_share_that_sticks_tells_the_strength_early() {
    let data = shipped();
    let model = data.model().unwrap();
    for (stiffness, strength) in [(1.0, 0.5), (0.87, 0.7), (1.15, 1.0), (1.0, 1.5), (0.9, 2.0)] {
        let [blind, seeing] = [0.0, 0.05].map(|stick_noise| {
            let (mut rig, mut observer) = (Rig::<_, State>::new(&model, stiffness, strength), observer(&model));
            rig.stick_noise = stick_noise;
            let early = rig.pull(&mut observer, 0.4);
            assert!((rig.margin - early.slip_margin).abs() < 0.2 || stick_noise == 0.0, "{strength}: {early:?}");
            early
        });
        let width = |m: &Margin| (m.strength_high / m.strength_low).ln();
        assert!(width(&seeing) < 0.85 * width(&blind), "{strength}: {blind:?} {seeing:?}");
        assert!(seeing.strength_low < strength && strength < seeing.strength_high, "{strength}: {seeing:?}");
        assert!((seeing.strength_factor / strength).ln().abs() < 0.25, "{strength}: {seeing:?}");
    }
}

#[test]
fn a_skin_that_always_says_stick_does_not_hide_slip() {
    let data = shipped();
    let model = data.model().unwrap();
    for strength in [0.5, 1.0, 2.0] {
        let (mut rig, mut observer) = (Rig::<_, State>::new(&model, 1.0, strength), observer(&model));
        for k in 0..300 {
            observer.step(rig.read(0.8 * (k as f32 / 300.0), [0.0; 2]));
        }
        let mut last = Margin::default();
        for _ in 0..3000 {
            last = observer.step(Reading { stick_ratio: 1.0, stick_variance: 1e-4, ..rig.read(0.8, [4e-3, -2e-3]) });
        }
        assert!(rig.margin == 0.0 && last.margin_low < 0.05, "{strength}: {last:?}");
    }
}

/// To and fro, and in a circle, with the share that sticks: after a turn all sticks under a large friction.
#[test]
fn the_share_that_sticks_does_not_deceive_after_a_turn() {
    let data = shipped();
    let model = data.model().unwrap();
    for (stiffness, strength) in [(1.0, 0.5), (1.15, 1.0), (0.9, 2.0)] {
        for circle in [false, true] {
            let (mut rig, mut observer) = (Rig::<_, State>::new(&model, stiffness, strength), observer(&model));
            rig.stick_noise = 0.05;
            rig.pull(&mut observer, 0.3);
            let mut worst = 0.0f32;
            for k in 0..2000u16 {
                let turn = f32::from(k) * core::f32::consts::TAU / 500.0;
                let by = match (circle, k / 250 % 2) {
                    (true, _) => [4e-3 * turn.cos(), 4e-3 * turn.sin()],
                    (false, 0) => [-4e-3, 2e-3],
                    (false, _) => [4e-3, -2e-3],
                };
                let m = observer.step(rig.read(0.8, by));
                worst = worst.max(m.margin_low - rig.margin);
                assert!(m.strength_low < 1.05 * strength, "{strength} {circle} {k}: {m:?}");
            }
            println!("{strength} {circle}: {worst}");
            assert!(worst < 0.1, "{strength} {circle}: {worst}");
        }
    }
}

#[test]
fn a_surface_that_changes_reopens_the_prior() {
    let data = shipped();
    let model = data.model().unwrap();
    let (mut rig, mut observer) = (Rig::<_, State>::new(&model, 1.0, 1.5), observer(&model));
    let before = rig.pull(&mut observer, 0.1);
    assert!(before.strength_low > 1.1, "{before:?}");
    // Water.
    rig.state.set_strength_factor(0.7);
    let mut seen = false;
    let mut after = before;
    for _ in 0..300 {
        after = observer.step(rig.read(0.8, [4e-3, -2e-3]));
        seen |= after.surface_changed;
    }
    assert!(seen, "{after:?}");
    assert!((after.strength_factor / 0.7).ln().abs() < 0.2 && after.margin_low == 0.0, "{after:?}");
}

#[test]
fn another_object_starts_from_the_prior_with_the_stiffness_that_was_learned() {
    let data = shipped();
    let model = data.model().unwrap();
    let (mut rig, mut observer) = (Rig::<_, State>::new(&model, 1.3, 1.0), observer(&model));
    let first = rig.pull(&mut observer, 0.1);
    for _ in 0..200 {
        observer.step(rig.read(-1.0, [0.0; 2]));
    }
    let air = observer.step(AIR);
    assert_eq!((air.known, air.slip_margin, air.slip_chance), (Known::NoContact, 0.0, 0.0));
    assert!(air.strength_high / air.strength_low > 5.0 && first.strength_high / first.strength_low < 2.0);
    assert!((air.stiffness_factor - first.stiffness_factor).abs() < 0.06 && air.stiffness_factor > 1.08, "{air:?}");
}

/// Whether all that `after` bounds is at least as wide as in `before`.
fn is_wider(before: &Margin, after: &Margin) -> bool {
    after.strength_low <= before.strength_low
        && after.strength_high >= before.strength_high
        && after.margin_low <= before.margin_low
        && after.margin_high >= before.margin_high
        && after.slip_chance >= before.slip_chance
}

#[test]
fn unsound_readings_are_flagged_and_widen_the_bounds() {
    let data = shipped();
    let model = data.model().unwrap();
    let (mut rig, mut knowing) = (Rig::<_, State>::new(&model, 1.0, 1.0), observer(&model));
    let known = rig.pull(&mut knowing, 0.3);
    let sound = rig.read(0.8, [0.0; 2]);
    let infinite = f32::INFINITY;
    let cases = [
        (Status::BAD_INPUT, Reading { friction_covariance_n2: [0.0; 3], ..sound }),
        (Status::BAD_INPUT, Reading { friction_covariance_n2: [1e-6, 1e-6, 2e-6], ..sound }),
        (Status::BAD_INPUT, Reading { slide_covariance_mm2: [f32::NAN, 1.0, 0.0], ..sound }),
        (Status::BAD_INPUT, Reading { slide_covariance_mm2: [-1.0, -1.0, 0.0], ..sound }),
        (Status::BAD_INPUT, Reading { normal_variance_n2: 0.0, ..sound }),
        (Status::BAD_INPUT, Reading { normal_variance_n2: infinite, ..sound }),
        (Status::BAD_INPUT, Reading { normal_force_n: f32::NAN, ..sound }),
        (Status::BAD_INPUT, Reading { friction_n: [infinite, 0.0], ..sound }),
        (Status::BAD_INPUT, Reading { slide_increment_mm: [0.0, 1e9], ..sound }),
        (Status::BAD_INPUT, Reading { stick_variance: -1.0, ..sound }),
        (Status::BAD_INPUT, Reading { stick_ratio: f32::NAN, stick_variance: 0.01, ..sound }),
        (Status::BAD_TIME_STEP, Reading { dt_s: 0.0, ..sound }),
        (Status::BAD_TIME_STEP, Reading { dt_s: -1e-3, ..sound }),
        (Status::BAD_TIME_STEP, Reading { dt_s: f32::NAN, ..sound }),
        (Status::BAD_INPUT | Status::BAD_TIME_STEP, Reading { dt_s: 0.0, normal_force_n: f32::NAN, ..sound }),
    ];
    for (status, reading) in cases {
        let mut observer = knowing.clone();
        let mut before = known;
        for _ in 0..200 {
            let after = observer.step(reading);
            assert_eq!(after.status, status, "{reading:?}");
            assert!(is_wider(&before, &after), "{reading:?}: {before:?} {after:?}");
            before = after;
        }
        assert!(before.strength_high / before.strength_low > 1.05 * known.strength_high / known.strength_low);
    }
    // Beyond the range of the model: flagged, and the band of the strength does not narrow.
    let mut before = known;
    let mut flagged = false;
    for _ in 0..500 {
        let after = knowing.step(Reading { normal_force_n: 50.0, friction_n: [2.0, 0.0], ..sound });
        flagged |= after.status == Status::DEPTH_ABOVE_RANGE;
        if flagged {
            assert!(after.strength_low <= before.strength_low && after.strength_high >= before.strength_high);
        }
        before = after;
    }
    assert!(flagged);
}

#[test]
fn settings_out_of_range_are_refused() {
    let data = shipped();
    let model = data.model().unwrap();
    for settings in [
        Settings { strength: 0.0, ..Settings::default() },
        Settings { stiffness: f32::NAN, ..Settings::default() },
        Settings { stick_error: 0.0, ..Settings::default() },
        Settings { confidence: 1.0, ..Settings::default() },
        Settings { ahead_s: -1.0, ..Settings::default() },
    ] {
        assert!(matches!(Observer::new(&model, settings), Err(Error::Range { .. })), "{settings:?}");
    }
}

/// The answers along readings that C and Python repeat (`bindings/c/consumer/misuse.c`, `bindings/python/tests/test_margin.py`), as one
/// number: all of them have the bits of the core.
#[test]
fn the_bits_of_a_story() {
    let data = shipped();
    let mut observer = Observer::new(&data.model().unwrap(), Settings::default()).unwrap();
    let (mut seed, mut digest) = (7u32, 0u32);
    let mut noise = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((seed >> 8) as f32 / (1 << 24) as f32 - 0.5) / 64.0
    };
    for k in 0..600u16 {
        let [press, pull] = [k.min(256), k.saturating_sub(300)].map(f32::from);
        let reading = Reading {
            normal_force_n: press / 512.0 + noise(),
            friction_n: [pull / 1024.0 + noise(), noise()],
            slide_increment_mm: [if k > 300 { 1.0 / 128.0 } else { 0.0 } + noise(), noise()],
            dt_s: if k % 97 == 96 { 0.0 } else { 1.0 / 1024.0 },
            normal_variance_n2: 1.0 / 32768.0,
            friction_covariance_n2: [1.0 / 32768.0, 1.0 / 32768.0, 0.0],
            slide_covariance_mm2: [1.0 / 32768.0, 1.0 / 32768.0, 0.0],
            stick_ratio: 1.0 - pull / 512.0 + noise(),
            stick_variance: if k % 128 >= 64 { 1.0 / 256.0 } else { 0.0 },
            ..Reading::default()
        };
        let m = observer.step(reading);
        let bits = [
            m.strength_factor,
            m.strength_low,
            m.strength_high,
            m.slip_margin,
            m.margin_low,
            m.margin_high,
            m.slip_chance,
            m.stiffness_factor,
            m.information,
        ];
        for word in bits.map(f32::to_bits).into_iter().chain([m.known as u32, m.surface_changed.into(), m.status.0]) {
            digest = digest.rotate_left(5) ^ word;
        }
    }
    assert_eq!(digest, DIGEST, "{digest:#010x}");
}

/// Answers along readings of any bits are bounded. Some of the numbers are sensible, so that all is reached.
pub fn any_bits<O: Observable<T>, T: Copy, const N: usize>(
    mut observer: Core<O, T, N>,
    readings: &[[u32; 18]],
    tame: u64,
) -> Result<(), TestCaseError> {
    for (k, bits) in readings.iter().enumerate() {
        let of =
            |i: usize, usual: f32| if tame >> ((k * 7 + i) % 64) & 1 == 0 { usual } else { f32::from_bits(bits[i]) };
        let m = observer.step(Reading {
            normal_force_n: of(0, 0.9),
            friction_n: [of(1, 0.5), of(2, -0.1)],
            slide_increment_mm: [of(3, 0.03), of(4, 0.01)],
            normal_variance_n2: of(5, 1e-5),
            friction_covariance_n2: [of(6, 1e-5), of(7, 1e-5), of(8, 0.0)],
            slide_covariance_mm2: [of(9, 1e-5), of(10, 1e-5), of(11, 0.0)],
            dt_s: of(12, 0.01),
            stick_ratio: of(13, 0.8),
            stick_variance: of(14, 0.01),
            spin_increment_rad: of(15, 0.01),
            spin_moment_n_mm: of(16, 0.3),
            spin_variance_n2_mm2: of(17, 1e-3),
        });
        prop_assert!(0.0 < m.strength_low && m.strength_low <= m.strength_factor, "{m:?}");
        prop_assert!(m.strength_factor <= m.strength_high && m.strength_high <= 10.0, "{m:?}");
        prop_assert!(0.0 <= m.margin_low && m.margin_low <= m.slip_margin, "{m:?}");
        prop_assert!(m.slip_margin <= m.margin_high && m.margin_high <= 1.0, "{m:?}");
        prop_assert!((0.0..=1.0).contains(&m.slip_chance) && (0.0..=1.0).contains(&m.information), "{m:?}");
        prop_assert!((0.1..=4.0).contains(&m.stiffness_factor), "{m:?}");
    }
    Ok(())
}

proptest! {
    #[test]
    fn any_bits_give_bounded_answers(readings in prop::collection::vec(prop::array::uniform18(any::<u32>()), 1..60), tame in any::<u64>()) {
        let data = shipped();
        any_bits(observer(&data.model().unwrap()), &readings, tame)?;
    }
}
