//! A pad as a tactile skin: the patches carry the whole of the wrench, wherever the finger goes.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use crate::common::{Noise, shipped_pad};
use fingerpad::frames::{FrameContact, FramePatch, Shape, Wrench};
use fingerpad::host::PadModelFile;
use fingerpad::nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use fingerpad::pad::{Memory, Pad, PadMemory, PadState};
use fingerpad::{Regime, Relaxation, Status, Tuning};

const P: usize = 64;

/// The human finger, and the silicone tip where the sources are at hand.
fn pads() -> Vec<(&'static str, PadModelFile)> {
    let silicone = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/models/silicone-dome-pad.fpm");
    let silicone = std::fs::read(silicone).ok().map(|bytes| ("silicone", PadModelFile::new(&bytes).unwrap()));
    [("human", shipped_pad())].into_iter().chain(silicone).collect()
}

/// Shapes, and the pose of the shape in a frame on its surface with z out of the body.
fn shapes() -> [(Shape, Isometry3<f64>); 5] {
    let below = |z: f64| Isometry3::translation(0.0, 0.0, -z);
    let lying = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2);
    [
        (Shape::plane(), below(0.0)),
        (Shape::edge(4.0, 100.0).unwrap(), below(0.0)),
        (Shape::sphere(12.0).unwrap(), below(12.0)),
        (Shape::cylinder(10.0, 60.0).unwrap(), Isometry3::from_parts(Translation3::new(0.0, 0.0, -10.0), lying)),
        (Shape::cuboid([20.0, 20.0, 10.0], 2.0).unwrap(), below(10.0)),
    ]
}

/// A body in the finger's frame: from the pose in which it just touches a level plane, shifted by x and y and lifted by `depth`, turned by
/// a pitch, a roll and a spin, rad.
fn placed(neutral_deg: f64, [x, y, depth, pitch, roll, spin]: [f64; 6], shape: &Isometry3<f64>) -> Isometry3<f64> {
    let level = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -neutral_deg.to_radians());
    let turn = UnitQuaternion::from_euler_angles(roll, -pitch, spin);
    let at = level * Vector3::new(x, y, depth);
    Isometry3::from_parts(Translation3::from(at), level * turn) * shape
}

fn sum(patches: &[FramePatch]) -> [Vector3<f64>; 2] {
    let wide = |v: [f32; 3]| Vector3::from(v).map(f64::from);
    patches.iter().fold([Vector3::zeros(); 2], |[force, moment], patch| {
        let own = wide(patch.force_n);
        [force + own, moment + wide(patch.place_mm).cross(&own) + wide(patch.moment_n_mm)]
    })
}

/// Largest difference of the sum over the patches from the wrench on the finger: of forces over a newton's scale, of moments over 10 mm of
/// it.
fn missing(patches: &[FramePatch], on_finger: &Wrench) -> f64 {
    let [force, moment] = sum(patches);
    let size = f64::from(Vector3::from(on_finger.force_n).norm()).max(0.05);
    let off = |sum: Vector3<f64>, whole: [f32; 3]| (sum - Vector3::from(whole).map(f64::from)).amax();
    (off(force, on_finger.force_n) / size).max(off(moment, on_finger.moment_n_mm) / (10.0 * size))
}

/// Random motions from the air and back. Returns the largest part of a wrench that the patches miss, in motion and after three steps at rest,
/// and the number of steps in contact and in partial slip.
fn wander<M: Memory<P, f32> + Copy>(
    pad: &Pad<'_>,
    shape: Shape,
    on_top: &Isometry3<f64>,
    seed: u64,
) -> ([f64; 2], [usize; 2])
where
    PadState<P, f32, M>: Copy,
{
    let neutral_deg = f64::from(pad.numbers.neutral_pitch_deg);
    let mut contact = FrameContact::<PadState<P, f32, M>>::new(pad, shape).unwrap();
    let mut random = Noise(seed);
    let mut at = [0.0, 0.0, -0.3, 0.0, 0.0, 0.0];
    let (mut missed, mut seen) = ([0.0_f64; 2], [0_usize; 2]);
    for leg in 0..5 {
        let mut draw = |size: f64| size * f64::from(random.next());
        let to = match leg {
            0 => [0.0, 0.0, 0.8, 0.0, 0.0, 0.0],
            4 => [0.0, 0.0, -0.3, 0.0, 0.0, 0.0],
            _ => [draw(1.2), draw(1.2), 1.0 + draw(0.6), draw(0.15), draw(0.15), draw(0.4)],
        };
        let from = at;
        for k in 1..=40 {
            at = core::array::from_fn(|i| from[i] + f64::from(k) / 40.0 * (to[i] - from[i]));
            let felt = contact.step(pad, &placed(neutral_deg, at, on_top), 1e-3);
            let patches = contact.patches(pad);
            let patches = &patches[..pad.patches.len()];
            if felt.response.regime == Regime::NoContact {
                assert!(patches.iter().all(is_unloaded), "{felt:?}");
                continue;
            }
            seen[0] += 1;
            seen[1] += usize::from(felt.response.regime == Regime::PartialSlip);
            missed[0] = missed[0].max(missing(patches, &felt.on_finger));
            let mut rests = contact;
            let [.., rested] = [(); 3].map(|()| rests.step(pad, &placed(neutral_deg, at, on_top), 1e-3));
            missed[1] = missed[1].max(missing(&rests.patches(pad)[..pad.patches.len()], &rested.on_finger));
            let sum = |of: fn(&FramePatch) -> f32| patches.iter().map(of).sum::<f32>();
            let (area, stuck) = (sum(|p| p.contact_area_mm2), sum(|p| p.contact_area_mm2 * p.stick_ratio));
            let off = [area / felt.response.contact_area_mm2 - 1.0, stuck / area - felt.response.stick_ratio];
            assert!(off.iter().all(|x| x.abs() < 0.05), "{off:?} {felt:?}");
            if on_top.translation.vector.norm() == 0.0 && shape.is_flat() {
                // On a plane pressure and shear over the own areas are the force.
                let pressed = sum(|p| p.pressure_mpa * p.area_mm2) / felt.response.normal_force_n;
                let [x, y] = [sum(|p| p.shear_mpa[0] * p.area_mm2), sum(|p| p.shear_mpa[1] * p.area_mm2)];
                let [along, across] = felt.response.friction_n;
                let off = [pressed - 1.0, x - along, y - across].map(f32::abs);
                assert!(off.iter().all(|off| *off < 1e-5 * (1.0 + felt.response.normal_force_n)), "{off:?} {felt:?}");
            }
        }
    }
    (missed, seen)
}

fn is_unloaded(patch: &FramePatch) -> bool {
    let FramePatch { force_n, moment_n_mm, pressure_mpa, shear_mpa, contact_area_mm2, stick_ratio, used, .. } = *patch;
    (force_n, moment_n_mm, shear_mpa) == ([0.0; 3], [0.0; 3], [0.0; 2])
        && [pressure_mpa, contact_area_mm2, stick_ratio, used] == [0.0; 4]
}

/// On a flat face to rounding; on a curved one too once what slipped has come to rest.
#[test]
fn patches_add_up_to_the_wrench() {
    for (name, file) in pads() {
        let pad = file.file().pad;
        let small = pad.tuned(Tuning { size: 0.8, stiffness: 3.0, lambda: 0.6 }).unwrap();
        let relaxing = pad.with_relaxation(Relaxation::HUMAN_ASSUMED);
        for (k, (shape, on_top)) in shapes().into_iter().enumerate() {
            for seed in 0..3 {
                let (missed, [touched, slipped]) = match seed {
                    0 => wander::<()>(&pad, shape, &on_top, k as u64),
                    1 => wander::<()>(&small, shape, &on_top, 10 + k as u64),
                    _ => wander::<PadMemory<P>>(&relaxing, shape, &on_top, 20 + k as u64),
                };
                let most = [if shape.is_flat() { 1e-5 } else { 2e-2 }, 2e-5];
                assert!(missed[0] < most[0] && missed[1] < most[1], "{name} shape {k} {seed}: {missed:?}");
                assert!(touched > 150 && slipped > 30, "{name} shape {k}: {touched} {slipped}");
            }
        }
    }
}

/// A pose that is none is flagged, and the skin stays as it was; a finger that is lifted off, and one whose memory was overwritten, has none.
#[test]
fn a_pose_that_is_none_leaves_the_patches() {
    let file = shipped_pad();
    let pad = file.file().pad;
    let press = |depth: f64| placed(30.0, [0.0, 0.0, depth, 0.0, 0.0, 0.0], &Isometry3::identity());
    let mut contact = FrameContact::<PadState<P>>::new(&pad, Shape::plane()).unwrap();
    let in_the_air = contact.patches(&pad);
    assert!(in_the_air.iter().all(is_unloaded));
    // The skin of a finger in the air lies where it was fitted: no lower than the place that touches first.
    let lowest = in_the_air[..pad.patches.len()].iter().map(|patch| {
        let level = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -30.0_f64.to_radians());
        (level.inverse() * Vector3::from(patch.place_mm).map(f64::from)).z
    });
    assert!(lowest.fold(f64::INFINITY, f64::min).abs() < 0.3);
    contact.step(&pad, &press(1.0), 1e-3);
    let pressed = contact.patches(&pad);
    assert!(pressed.iter().filter(|patch| patch.pressure_mpa > 0.0).count() > 5);
    for none in [Translation3::new(f64::NAN, 0.0, 0.0), Translation3::new(0.0, f64::INFINITY, 0.0)] {
        let felt = contact.step(&pad, &(none * press(1.0)), 1e-3);
        assert!(felt.response.status.contains(Status::BAD_INPUT) && felt.response.normal_force_n > 0.1);
        assert_eq!(contact.patches(&pad), pressed);
    }
    let felt = contact.step(&pad, &press(1.0), f32::NAN);
    assert!(felt.response.status.contains(Status::BAD_TIME_STEP));
    assert_eq!(contact.patches(&pad), pressed);
    // A pad of fewer patches is none of this state.
    let few = Pad::new(&pad.patches[..5], pad.numbers);
    assert!(contact.patches(&few).iter().all(is_unloaded));
    contact.step(&pad, &press(-1.0), 1e-3);
    assert_eq!(contact.patches(&pad), in_the_air);
}
