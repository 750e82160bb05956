//! The requests of a story and how a line tells them.
//!
//! | line | what it asks |
//! |---|---|
//! | `model K` | go on with model file K; a fresh contact without and with spin, with effects, and a watch of finger K |
//! | `tune SIZE STIFFNESS LAMBDA TAU0` | another finger; answer: 0, or 8 where out of range |
//! | `pose PITCH ROLL` | another pose; the same |
//! | `factor F` | strength factor of all three contacts; the same |
//! | `around ELEVEN` | surroundings: hydration, temperature, width, clock, dwell, occlusion, speed (NaN is counted from the motion), own columns |
//! | `step DEPTH X Y SPIN DT` | a step of all three; answer: three responses, the sensor's reading without and with the surroundings, the events of the first |
//! | `driven BY_NORMAL BY_FRICTION DEPTH NORMAL X Y FX FY SPIN DT` | a driven step without and with spin: response and motion |
//! | `gradient DEPTH X Y` | nine derivatives without and with spin |
//! | `grip X Y MARGIN F` | the least grip |
//! | `save` | both states as bytes, from which they are then restored |

use std::fmt;

/// One line of a story.
#[derive(Clone, Copy)]
pub enum Request {
    Model(usize),
    Tune([f32; 4]),
    Pose([f32; 2]),
    Factor(f32),
    Around([f32; 11]),
    Step([f32; 5]),
    Driven { by_normal_force: bool, by_friction: bool, numbers: [f32; 8] },
    Gradient([f32; 3]),
    Grip([f32; 4]),
    Save,
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
            Self::Pose(numbers) => write!(f, "pose{}", words(numbers)),
            Self::Factor(factor) => write!(f, "factor{}", words(&[*factor])),
            Self::Around(numbers) => write!(f, "around{}", words(numbers)),
            Self::Step(numbers) => write!(f, "step{}", words(numbers)),
            Self::Driven { by_normal_force, by_friction, numbers } => {
                write!(f, "driven {} {}{}", u8::from(*by_normal_force), u8::from(*by_friction), words(numbers))
            }
            Self::Gradient(numbers) => write!(f, "gradient{}", words(numbers)),
            Self::Grip(numbers) => write!(f, "grip{}", words(numbers)),
            Self::Save => write!(f, "save"),
        }
    }
}
