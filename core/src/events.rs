//! Changes of a contact and their times, for a queue from a control interrupt to a main loop.
//!
//! Main types: [`Watch`] (in the interrupt) with its [`WatchSettings`], [`Event`], [`Queue`]. Uses heapless only.

use heapless::spsc::Producer;

use crate::{Regime, Response};

/// A queue of `N - 1` events; split it into a producer for the interrupt and a consumer for the main loop.
pub type Queue<const N: usize> = heapless::spsc::Queue<Event, N>;

/// A change of the regime of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Change {
    /// The finger touches.
    Touch,
    /// The stick ratio falls below [`WatchSettings::first_slip`].
    FirstSlip,
    /// The stick ratio falls to [`WatchSettings::full_slip`].
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
    /// The change.
    pub change: Change,
}

/// When a [`Watch`] reports a change: thresholds that differ by direction (hysteresis), and the number of responses that must show it
/// (debounce).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WatchSettings {
    /// First slip: the stick ratio is below this for `looks` looks.
    pub first_slip: f32,
    /// First slip at once: the stick ratio is below this.
    pub sure_slip: f32,
    /// Full slip: the stick ratio is at most this for `looks` looks.
    pub full_slip: f32,
    /// A contact in full slip sticks again in part: the stick ratio is above this for `looks` looks.
    pub partial_restick: f32,
    /// A contact sticks again as a whole: the stick ratio is above this for `looks` looks.
    pub restick: f32,
    /// Responses that show slip or stick, less those that do not, before it is reported; 0 counts as 1.
    pub looks: u8,
    /// The same before touch or lift-off is reported; 0 counts as 1.
    pub contact_looks: u8,
}

impl Default for WatchSettings {
    /// First slip below 0.99 for eight looks or below 0.95 at once, full slip at 0.1, restick above 0.3 and above 0.995,
    /// each for eight looks; touch and lift-off after two looks. Noise of ±10 µm on depth and slide passes these gaps in no direction
    /// twice (`tests/all/watch.rs`).
    fn default() -> Self {
        Self {
            first_slip: 0.99,
            sure_slip: 0.95,
            full_slip: 0.1,
            partial_restick: 0.3,
            restick: 0.995,
            looks: 8,
            contact_looks: 2,
        }
    }
}

/// Reports changes of the regime from successive responses, with tolerance to noise.
///
/// The last event decides which change is looked for: a contact in stick slips first below [`WatchSettings::first_slip`], and one in
/// slip sticks only above [`WatchSettings::restick`]; between the two there is no event. A change must also last: looks that show it, less
/// those that do not, must be some, so that one noisy reading causes no event. With the default settings an event comes up to seven looks
/// late; [`Event::tick`] is the look at which it is reported. A watch takes 36 bytes.
///
/// Uniform noise of ±10 µm on depth and slide, in steps of 0.1 to 1 µm and at depths of 0.3 to 2.2 mm, causes no event at rest and one
/// first slip in each slide, within 10.2 % of the noise-free slide. Where a spring has just touched, first slip comes within the noise
/// itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Watch {
    settings: WatchSettings,
    finger: u8,
    /// The regime of the events reported so far.
    regime: Regime,
    /// Number of looks with another regime, less those with the reported one since.
    seen: u8,
    tick: u32,
    lost: u32,
}

impl Watch {
    /// A watch for one finger, which starts without contact.
    pub fn new(finger: u8) -> Self {
        Self { finger, ..Self::default() }
    }

    /// The same with other settings.
    pub fn with_settings(finger: u8, settings: WatchSettings) -> Self {
        Self { finger, settings, ..Self::default() }
    }

    /// The regime by the events reported so far.
    pub fn regime(&self) -> Regime {
        self.regime
    }

    /// Events that found the queue full.
    pub fn lost(&self) -> u32 {
        self.lost
    }

    /// Processes one step's response and queues the events: none, or up to three (a finger that touches and slips at once). Never waits.
    /// Ticks wrap after 2^32 steps.
    pub fn look(&mut self, response: &Response, queue: &mut Producer<'_, Event>) {
        for event in self.see(response) {
            if queue.enqueue(event).is_err() {
                self.lost = self.lost.saturating_add(1);
            }
        }
    }

    /// The same without a queue: returns the events of this look, in their order.
    pub fn see(&mut self, response: &Response) -> impl ExactSizeIterator<Item = Event> + use<> {
        let now = self.classify(response);
        let mut seen: &'static [Change] = &[];
        if now == self.regime {
            self.seen = self.seen.saturating_sub(1);
        } else {
            self.seen = self.seen.saturating_add(1);
            if self.seen >= self.looks_needed(now, response.stick_ratio) {
                seen = changes(self.regime, now);
                self.regime = now;
                self.seen = 0;
            }
        }
        let (tick, finger) = (self.tick, self.finger);
        self.tick = self.tick.wrapping_add(1);
        seen.iter().map(move |&change| Event { tick, finger, change })
    }

    /// The regime of a response, with thresholds that depend on the last reported regime.
    fn classify(&self, response: &Response) -> Regime {
        let (reported, ratio, settings) = (self.regime, response.stick_ratio, &self.settings);
        if response.regime == Regime::NoContact {
            return Regime::NoContact;
        }
        let slides = if reported == Regime::Slip { settings.partial_restick } else { settings.full_slip };
        let slips = matches!(reported, Regime::PartialSlip | Regime::Slip);
        if ratio <= slides {
            Regime::Slip
        } else if ratio > settings.restick || (!slips && ratio >= settings.first_slip) {
            Regime::Stick
        } else {
            Regime::PartialSlip
        }
    }

    /// Responses after which the regime `now` is reported.
    fn looks_needed(&self, now: Regime, stick_ratio: f32) -> u8 {
        if self.regime == Regime::NoContact || now == Regime::NoContact {
            self.settings.contact_looks
        } else if self.regime == Regime::Stick && stick_ratio < self.settings.sure_slip {
            1
        } else {
            self.settings.looks
        }
    }
}

/// The events between two regimes, in their order.
fn changes(before: Regime, now: Regime) -> &'static [Change] {
    use Regime::{NoContact, PartialSlip, Slip, Stick};
    match (before, now) {
        (NoContact, Stick) => &[Change::Touch],
        (NoContact, PartialSlip) => &[Change::Touch, Change::FirstSlip],
        (NoContact, Slip) => &[Change::Touch, Change::FirstSlip, Change::FullSlip],
        (_, NoContact) => &[Change::LiftOff],
        (Stick, PartialSlip) => &[Change::FirstSlip],
        (Stick, Slip) => &[Change::FirstSlip, Change::FullSlip],
        (PartialSlip, Slip) => &[Change::FullSlip],
        _ => &[Change::Restick],
    }
}
