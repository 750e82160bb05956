//! Lists of effects, and the rules of a list for the slots of a model file.
//!
//! Main types: [`Library`] (a list), `Standard` (the list of this crate, made by `effects!` in `mod.rs`).

use super::{Change, Conditions, Effect, Law, Place, VALUES};
use crate::math::Real;

/// Rules for a slot of a model file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SlotRules {
    /// Where its law enters the model.
    pub place: Place,
    /// Which values must be positive.
    pub positive: [bool; VALUES],
}

impl SlotRules {
    const fn of(law: &Law) -> Self {
        let mut positive = [false; VALUES];
        let mut k = 0;
        while k < law.parameters.len() {
            positive[k] = law.parameters[k].positive;
            k += 1;
        }
        Self { place: law.place, positive }
    }
}

/// A list of effects, chosen at compile time: effects that are not in the list are not linked.
///
/// An [`Effect`] is a library of one, a pair is the library of both. `(Standard, Mine)` has one effect more than this
/// crate; `(StaticPeak, Adhesion)` has two.
pub trait Library {
    /// The rules for slots of this number; `None` if no effect in the list has it.
    fn rules(kind: u32) -> Option<SlotRules>;

    /// Lets the effect of this number act; nothing if there is none. See [`Effect::act`].
    fn apply<T: Real>(kind: u32, values: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>);
}

// The constants are evaluated when compiling, so that a program for a microcontroller holds no text of a law.
impl<E: Effect> Library for E {
    #[inline]
    fn rules(kind: u32) -> Option<SlotRules> {
        (kind == const { E::LAW.kind }).then_some(const { SlotRules::of(&E::LAW) })
    }

    #[inline(always)]
    fn apply<T: Real>(kind: u32, values: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        if kind == const { E::LAW.kind } {
            E::act(values, at, change);
        }
    }
}

impl<A: Library, B: Library> Library for (A, B) {
    #[inline]
    fn rules(kind: u32) -> Option<SlotRules> {
        A::rules(kind).or_else(|| B::rules(kind))
    }

    #[inline(always)]
    fn apply<T: Real>(kind: u32, values: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
        if A::rules(kind).is_some() {
            A::apply(kind, values, at, change);
        } else {
            B::apply(kind, values, at, change);
        }
    }
}

/// Makes the modules of a list's files, its [`Library`] `Standard` and the list of its laws.
macro_rules! effects {
    ($($module:ident::$effect:ident,)*) => {
        $(pub mod $module;)*

        /// The effects of this crate.
        pub struct Standard;

        impl Library for Standard {
            fn rules(kind: u32) -> Option<SlotRules> {
                None$(.or_else(|| $module::$effect::rules(kind)))*
            }

            #[inline(always)]
            fn apply<T: Real>(kind: u32, values: &[T; VALUES], at: &Conditions<T>, change: &mut Change<T>) {
                match kind {
                    $(k if k == const { $module::$effect::LAW.kind } => $module::$effect::act(values, at, change),)*
                    _ => {}
                }
            }
        }

        /// Descriptions of the effects of this crate, in the order of the list.
        pub static LAWS: &[&Law] = &[$(&$module::$effect::LAW),*];
    };
}
pub(super) use effects;
