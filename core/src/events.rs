//! What happened to a contact and when, from a control interrupt to a main loop.
//!
//! Main types: [`Watch`] (in the interrupt), [`Event`], [`Queue`]. Uses heapless only.

use heapless::spsc::Producer;

use crate::{Regime, Response};

/// A queue of `N - 1` events; split it into a producer for the interrupt and a consumer for the main loop.
pub type Queue<const N: usize> = heapless::spsc::Queue<Event, N>;

/// A change of what the contact does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Change {
    /// The finger touches.
    Touch,
    /// The stick ratio falls below 0.99.
    FirstSlip,
    /// The stick ratio falls to 0.01.
    FullSlip,
    /// Part or all of a contact that slipped sticks again.
    Restick,
    /// The finger leaves the plane.
    LiftOff,
}

/// A change and its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Event {
    /// The step at which it was seen, counted by [`Watch`] from 0.
    pub tick: u32,
    /// Number of the finger, as given to [`Watch::new`].
    pub finger: u8,
    /// What changed.
    pub change: Change,
}

/// Sees changes from one response to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Watch {
    finger: u8,
    regime: Regime,
    tick: u32,
    lost: u32,
}

impl Watch {
    /// A watch for one finger, which starts in the air.
    pub fn new(finger: u8) -> Self {
        Self { finger, ..Self::default() }
    }

    /// Events that found the queue full.
    pub fn lost(&self) -> u32 {
        self.lost
    }

    /// Looks at one step's response and queues what changed: nothing, or up to three events (a finger that lands
    /// slipping). Never waits. Ticks wrap after 2^32 steps.
    pub fn look(&mut self, response: &Response, queue: &mut Producer<'_, Event>) {
        use Regime::{NoContact, PartialSlip, Slip, Stick};
        let (before, now) = (self.regime, response.regime);
        if before != now {
            let changes: &[Change] = match (before, now) {
                (NoContact, Stick) => &[Change::Touch],
                (NoContact, PartialSlip) => &[Change::Touch, Change::FirstSlip],
                (NoContact, Slip) => &[Change::Touch, Change::FirstSlip, Change::FullSlip],
                (_, NoContact) => &[Change::LiftOff],
                (Stick, PartialSlip) => &[Change::FirstSlip],
                (Stick, Slip) => &[Change::FirstSlip, Change::FullSlip],
                (PartialSlip, Slip) => &[Change::FullSlip],
                _ => &[Change::Restick],
            };
            for &change in changes {
                let event = Event { tick: self.tick, finger: self.finger, change };
                if queue.enqueue(event).is_err() {
                    self.lost = self.lost.saturating_add(1);
                }
            }
            self.regime = now;
        }
        self.tick = self.tick.wrapping_add(1);
    }
}
