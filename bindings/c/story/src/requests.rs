//! The requests of a story and their form as a line.
//!
//! | line | request |
//! |---|---|
//! | `model K` | go on with model file K; a fresh contact without and with spin, with effects, and a watch of finger K |
//! | `tune SIZE STIFFNESS LAMBDA TAU0` | another finger; answer: 0, or 8 where out of range |
//! | `factor F` | strength factor of all three contacts; the same |
//! | `around ELEVEN` | surroundings: hydration, temperature, width, clock, dwell, occlusion, speed (NaN is counted from the motion), own columns |
//! | `step DEPTH X Y SPIN DT` | a step of all three; answer: three responses, the sensor's reading without and with the surroundings, the events of the first |
//! | `driven BY_NORMAL BY_FRICTION DEPTH NORMAL X Y FX FY SPIN DT` | a driven step without and with spin: response and motion |
//! | `gradient DEPTH X Y` | nine derivatives without and with spin |
//! | `grip X Y MARGIN F` | the least grip |
//! | `bed-shape KIND THREE-SIZES EDGE ANGLE` | two contacts in frames with a shape, of the model and of the one that relaxes; as `shape` |
//! | `bed-pose X Y Z W I J K DT` | a step of both; as `pose` |
//! | `save` | both states as bytes, from which they are then restored |
//! | `pad-words UP-TO-ELEVEN` | the next words of a pad's file |
//! | `pad-load` | go on with the pad of the words so far; a fresh contact over a plane; answer: the number of patches |
//! | `pad SIZE STIFFNESS LAMBDA` | the pad of another finger; answer: 0, or 8 where out of range. Initialise the state again |
//! | `body KIND RADIUS AXIS ANGLE PITCH ROLL` | a fresh contact of the pad over a body (0 plane, 1 sphere, 2 cylinder, 3 edge); the same |
//! | `pad-factor F` | strength factor of the pad's contact; the same |
//! | `pad-step DEPTH X Y SPIN PITCH ROLL DT` | a step of the pad: a response |
//! | `patches` | the load of each patch, nine numbers each |
//! | `shape KIND THREE-SIZES EDGE ANGLE` | a contact of the pad in frames with a shape (kinds as in `fingerpad.h`); answer: 0, or 8 where out of range |
//! | `pose X Y Z W I J K DT` | a step of that contact to a pose of the body: both wrenches, depth, pitch, roll, face, the response |
//! | `pad-save` | the pad's state as bytes, from which it is then restored |

use std::fmt;

/// One line of a story.
#[derive(Clone, Copy)]
pub enum Request {
    Model(usize),
    Tune([f32; 3]),
    Factor(f32),
    Around([f32; 11]),
    Step([f32; 5]),
    Driven { by_normal_force: bool, by_friction: bool, numbers: [f32; 8] },
    Gradient([f32; 3]),
    Grip([f32; 4]),
    BedShape { kind: u32, numbers: [f32; 5] },
    BedPose([f32; 8]),
    Save,
    PadWords { words: [u32; 11], count: usize },
    PadLoad(usize),
    Pad([f32; 3]),
    Body { kind: u32, numbers: [f32; 5] },
    PadFactor(f32),
    PadStep([f32; 7]),
    Patches,
    Shape { kind: u32, numbers: [f32; 5] },
    Pose([f32; 8]),
    PadSave,
}

/// Numbers as their bits.
pub fn words(numbers: &[f32]) -> String {
    numbers.iter().map(|x| format!(" {:08x}", x.to_bits())).collect()
}

impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Model(k) => write!(f, "model {k}"),
            Self::Tune(numbers) => write!(f, "tune{}", words(numbers)),
            Self::Factor(factor) => write!(f, "factor{}", words(&[*factor])),
            Self::Around(numbers) => write!(f, "around{}", words(numbers)),
            Self::Step(numbers) => write!(f, "step{}", words(numbers)),
            Self::Driven { by_normal_force, by_friction, numbers } => {
                write!(f, "driven {} {}{}", u8::from(*by_normal_force), u8::from(*by_friction), words(numbers))
            }
            Self::Gradient(numbers) => write!(f, "gradient{}", words(numbers)),
            Self::Grip(numbers) => write!(f, "grip{}", words(numbers)),
            Self::BedShape { kind, numbers } => write!(f, "bed-shape {kind:x}{}", words(numbers)),
            Self::BedPose(numbers) => write!(f, "bed-pose{}", words(numbers)),
            Self::Save => write!(f, "save"),
            Self::PadWords { words, count } => {
                write!(f, "pad-words")?;
                words.iter().take(*count).try_for_each(|word| write!(f, " {word:08x}"))
            }
            Self::PadLoad(_) => write!(f, "pad-load"),
            Self::Pad(numbers) => write!(f, "pad{}", words(numbers)),
            Self::Body { kind, numbers } => write!(f, "body {kind:x}{}", words(numbers)),
            Self::PadFactor(factor) => write!(f, "pad-factor{}", words(&[*factor])),
            Self::PadStep(numbers) => write!(f, "pad-step{}", words(numbers)),
            Self::Patches => write!(f, "patches"),
            Self::Shape { kind, numbers } => write!(f, "shape {kind:x}{}", words(numbers)),
            Self::Pose(numbers) => write!(f, "pose{}", words(numbers)),
            Self::PadSave => write!(f, "pad-save"),
        }
    }
}
