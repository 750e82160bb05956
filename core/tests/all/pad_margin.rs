//! The observer of the margin with the shipped pad: in another pose than the bed's, and on curved bodies. Truth is the pad with another
//! strength and stiffness, so that its own errors are not in these tests.

use crate::common::{shipped, shipped_pad};
use crate::margin::{AIR, Rig, any_bits};
use fingerpad::margin::{Margin, MarginObserver, Observable, Observer, PadObserver, Settings};
use fingerpad::pad::{Body, Cylinder, Pad, PadOn, PadState, Plane, Sphere, Surface};
use fingerpad::{Error, Relaxation};
use proptest::prelude::*;

const P: usize = 40;
/// Stiffness and strength of fingers and surfaces.
const TRUTHS: [(f32, f32); 4] = [(1.1, 0.4), (0.9, 0.7), (1.1, 1.5), (0.9, 2.0)];
/// True margins at which an answer is compared.
const BENT: [f32; 3] = [0.35, 0.25, 0.15];

type PlainRig<'a, B> = Rig<PadOn<'a, B>, PadState<P>>;

fn places() -> [(Body, [f32; 2]); 3] {
    [
        (Body::Plane, [45.0, 10.0]),
        (Body::Sphere(Sphere::new(12.0).unwrap()), [30.0, 0.0]),
        (Body::Cylinder(Cylinder::new(15.0, 20.0).unwrap()), [30.0, 0.0]),
    ]
}

/// Here the model does not err.
fn settings() -> Settings {
    Settings { curve: [0.0; 5], ..Settings::for_pad() }
}

fn observer<'a, B: Surface<f32> + Copy>(finger: &PadOn<'a, B>) -> PadObserver<'a, B, P> {
    PadObserver::new(finger, settings()).unwrap()
}

/// Answers of a pull at [`BENT`], and whether slip was announced before full slip.
fn pull<O: Observable<T>, T: Copy, const N: usize>(
    mut observer: Observer<O, T, N>,
    mut rig: PlainRig<'_, Body>,
) -> ([(f32, Margin); 3], bool) {
    rig.pull(&mut observer, 0.9);
    let answers = BENT.map(|margin| {
        let answer = rig.slide(&mut observer, margin);
        (rig.margin, answer)
    });
    let mut announced = false;
    for margin in [0.1, 0.08, 0.06, 0.04, 0.02] {
        announced |= rig.slide(&mut observer, margin).margin_low == 0.0;
    }
    (answers, announced)
}

#[test]
fn the_strength_is_found_in_other_poses_and_on_curved_bodies() {
    let file = shipped_pad();
    let pad = file.file().pad;
    assert!(size_of::<PadObserver<'_, Body, P>>() < 25_000);
    let mut worst = 0.0f32;
    for (body, pose_deg) in &places() {
        let finger = PadOn { pad, body, pose_deg: *pose_deg };
        for (stiffness, strength) in TRUTHS {
            let (answers, announced) = pull(observer(&finger), Rig::new(&finger, stiffness, strength));
            for (margin, m) in &answers {
                let text = format!("{body:?} {strength} {margin}: {m:?}");
                assert!(m.strength_low < strength && strength < m.strength_high, "{text}");
                assert!(m.margin_low < *margin && *margin < m.margin_high, "{text}");
                let off = (m.strength_factor / strength).ln().abs();
                worst = worst.max(if *margin < 0.2 { off } else { 0.0 });
            }
            assert!(announced, "{body:?} {strength}: {answers:?}");
        }
    }
    println!("largest error of the strength's logarithm at a margin of 0.15: {worst}");
    assert!(worst < 0.4, "{worst}");
}

/// The bed that ships is of the neutral pose: in another one its band misses the strength.
#[test]
fn a_pad_in_the_pose_of_the_finger_knows_more_than_a_bed_of_another_one() {
    let (file, data) = (shipped_pad(), shipped());
    let (pad, bed) = (file.file().pad, data.model().unwrap());
    let finger = PadOn { pad, body: &Body::Plane, pose_deg: [45.0, 0.0] };
    let mut errors = [[0.0f32; 2]; 2];
    for (stiffness, strength) in TRUTHS {
        let rig = || Rig::new(&finger, stiffness, strength);
        let of_both =
            [pull(observer(&finger), rig()), pull(MarginObserver::new(&bed, Settings::default()).unwrap(), rig())];
        for ((answers, _), [square, covered]) in of_both.iter().zip(&mut errors) {
            for (margin, m) in answers {
                *square += (m.strength_factor / strength).ln().powi(2) / 12.0;
                *covered += f32::from(u8::from(m.margin_low < *margin && *margin < m.margin_high));
            }
        }
    }
    println!(
        "pad and bed: mean square error of the strength's logarithm, answers of 12 that cover the margin {errors:?}"
    );
    let [[pad, pad_covers], [bed, bed_covers]] = errors;
    assert!(pad < 0.4 * bed && pad_covers >= 11.0 && bed_covers <= 7.0, "{errors:?}");
}

/// In the neutral pose, where a press shears the skin little.
#[test]
fn a_contact_that_sticks_shows_the_prior() {
    let file = shipped_pad();
    let finger = PadOn { pad: file.file().pad, body: &Plane, pose_deg: [30.0, 0.0] };
    for (stiffness, strength) in TRUTHS {
        let mut observer = observer(&finger);
        let m = PlainRig::new(&finger, stiffness, strength).pull(&mut observer, 0.95);
        assert!(m.strength_high / m.strength_low > 3.0, "{strength}: {m:?}");
    }
}

/// A turn on the spot to full slip, with and without the moment. A bed does not use it.
#[test]
fn the_moment_of_a_turn_tells_the_strength() {
    let file = shipped_pad();
    let finger = PadOn { pad: file.file().pad, body: &Plane, pose_deg: [30.0, 0.0] };
    for (stiffness, strength) in TRUTHS {
        let [blind, seeing] = [0.0, 0.1].map(|moment_noise| {
            let (mut observer, mut rig) = (observer(&finger), PlainRig::new(&finger, stiffness, strength));
            for k in 0..400u16 {
                observer.step(rig.read_turned(0.8 * (f32::from(k) / 300.0).min(1.0), [0.0; 2], 0.0, moment_noise));
            }
            let mut m = Margin::default();
            for _ in 0..3000 {
                if rig.margin < 0.2 {
                    break;
                }
                m = observer.step(rig.read_turned(0.8, [0.0; 2], 1e-3, moment_noise));
            }
            m
        });
        let width = |m: &Margin| m.strength_high / m.strength_low;
        let found = seeing.strength_factor;
        println!(
            "{strength}: {found}, ends of the band: quotient {} without the moment, {} with it",
            width(&blind),
            width(&seeing)
        );
        assert!(width(&seeing) < 0.4 * width(&blind), "{strength}: {blind:?} {seeing:?}");
        assert!(seeing.strength_low < strength && strength < seeing.strength_high, "{strength}: {seeing:?}");
    }
}

#[test]
fn what_does_not_fit_is_refused_or_follows_relaxed_tissue() {
    let file = shipped_pad();
    let finger = PadOn { pad: file.file().pad, body: &Plane, pose_deg: [30.0, 0.0] };
    let small = PadObserver::<'_, Plane, 8>::new(&finger, settings());
    assert!(matches!(small, Err(Error::Shape { elements: 37, nodes: 8 })), "{:?}", small.err());
    let relaxing = PadOn { pad: finger.pad.with_relaxation(Relaxation::HUMAN_ASSUMED), ..finger };
    let mut rig = PlainRig::new(&finger, 1.0, 1.5);
    let (mut plain, mut relaxed) = (observer(&finger), observer(&relaxing));
    for k in 0..200u16 {
        let reading = rig.read(f32::from(k.min(100)) * 0.008, [if k > 100 { 5e-3 } else { 0.0 }, 0.0]);
        assert_eq!(plain.step(reading), relaxed.step(reading));
    }
    assert_eq!(plain.step(AIR).status, relaxed.step(AIR).status);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_bits_give_bounded_answers(readings in prop::collection::vec(prop::array::uniform18(any::<u32>()), 1..60), tame in any::<u64>(), place in 0..3usize) {
        let file = shipped_pad();
        let (body, pose_deg) = places()[place];
        let pad: Pad<'_> = file.file().pad;
        any_bits(observer(&PadOn { pad, body: &body, pose_deg }), &readings, tame)?;
    }
}
