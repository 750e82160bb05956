//! Events: what happened to a contact and when.

use fingerpad::events::{Change, Watch, WatchSettings};

use crate::codes::{FINGERPAD_NOT_SET_UP, FINGERPAD_RANGE, answer};
use crate::pointer::{check, exclusive, shared, write};
use crate::types::{fingerpad_response, read_back};

/// The finger touches: the value of `change` in an event.
pub const FINGERPAD_TOUCH: u8 = 0;
/// The stick ratio falls below `first_slip`.
pub const FINGERPAD_FIRST_SLIP: u8 = 1;
/// The stick ratio falls to `full_slip`.
pub const FINGERPAD_FULL_SLIP: u8 = 2;
/// Part or all of a contact that slipped sticks again.
pub const FINGERPAD_RESTICK: u8 = 3;
/// The finger leaves the plane.
pub const FINGERPAD_LIFT_OFF: u8 = 4;

/// Most events that one look can report: a finger that lands slipping.
pub const FINGERPAD_EVENTS_A_LOOK: usize = 3;

/// Sees changes from one response to the next, through noise. Set it up with `fingerpad_watch_init`.
#[repr(C)]
pub struct fingerpad_watch {
    opaque: [u32; 10],
}

/// A change and its time.
#[repr(C)]
pub struct fingerpad_event {
    /// The look at which it was seen, counted from 0.
    pub tick: u32,
    /// Number of the finger.
    pub finger: u8,
    /// FINGERPAD_TOUCH, FINGERPAD_FIRST_SLIP, FINGERPAD_FULL_SLIP, FINGERPAD_RESTICK or FINGERPAD_LIFT_OFF.
    pub change: u8,
}

/// When a watch reports a change: thresholds that differ by direction (hysteresis), and the number of looks that must
/// show it (debounce). `fingerpad_watch_settings_default` gives the usual ones.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct fingerpad_watch_settings {
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
    /// Looks that show slip or stick, less those that do not, before it is reported; 0 counts as 1.
    pub looks: u8,
    /// The same before touch or lift-off is reported; 0 counts as 1.
    pub contact_looks: u8,
}

/// Mark of a watch that was set up.
const SET_UP: u32 = 0x4650_5721;

/// What is inside of a `fingerpad_watch`.
#[repr(C)]
struct Marked {
    mark: u32,
    watch: Watch,
}

const _: () = {
    assert!(size_of::<Marked>() <= size_of::<fingerpad_watch>());
    assert!(align_of::<Marked>() <= align_of::<fingerpad_watch>());
};

unsafe fn marked<'a>(watch: *mut fingerpad_watch) -> Result<&'a mut Watch, i32> {
    // SAFETY: the caller's promise; the mark is a number whatever lies there.
    if *unsafe { shared(watch.cast::<u32>()) }? != SET_UP {
        return Err(FINGERPAD_NOT_SET_UP);
    }
    // SAFETY: the mark stands only where `fingerpad_watch_init` has written, or in a copy of that.
    Ok(&mut unsafe { exclusive(watch.cast::<Marked>()) }?.watch)
}

/// First slip below 0.99 for eight looks or below 0.95 at once, full slip at 0.03, restick above 0.3 and above 0.995, each for
/// eight looks; touch and lift-off after two looks.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_watch_settings_default(settings: *mut fingerpad_watch_settings) -> i32 {
    let WatchSettings { first_slip, sure_slip, full_slip, partial_restick, restick, looks, contact_looks } =
        WatchSettings::default();
    let usual =
        fingerpad_watch_settings { first_slip, sure_slip, full_slip, partial_restick, restick, looks, contact_looks };
    // SAFETY: the caller's promise.
    answer(unsafe { write(settings, usual) })
}

/// A watch for one finger, which starts in the air. Returns FINGERPAD_OK, or FINGERPAD_RANGE for a threshold that is not a
/// number from 0 to 1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_watch_init(
    watch: *mut fingerpad_watch,
    finger: u8,
    settings: fingerpad_watch_settings,
) -> i32 {
    let fingerpad_watch_settings { first_slip, sure_slip, full_slip, partial_restick, restick, looks, contact_looks } =
        settings;
    if [first_slip, sure_slip, full_slip, partial_restick, restick].iter().any(|t| !(0.0..=1.0).contains(t)) {
        return FINGERPAD_RANGE;
    }
    let settings = WatchSettings { first_slip, sure_slip, full_slip, partial_restick, restick, looks, contact_looks };
    // SAFETY: the caller's promise; size and alignment were checked above.
    answer(unsafe { write(watch.cast(), Marked { mark: SET_UP, watch: Watch::with_settings(finger, settings) }) })
}

/// Looks at one step's response and writes what changed into `events`, room for FINGERPAD_EVENTS_A_LOOK of them, and their
/// number into `count`: mostly 0.
///
/// Returns FINGERPAD_OK, or FINGERPAD_RANGE for a response whose regime is none, FINGERPAD_NULL, FINGERPAD_ALIGNMENT or
/// FINGERPAD_NOT_SET_UP; then nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fingerpad_watch_look(
    watch: *mut fingerpad_watch,
    response: *const fingerpad_response,
    events: *mut fingerpad_event,
    count: *mut u32,
) -> i32 {
    let looked = || {
        // SAFETY: the caller's promise.
        let (watch, response) = unsafe { (marked(watch)?, shared(response)?) };
        let response = read_back(response).ok_or(FINGERPAD_RANGE)?;
        check(events)?;
        check(count)?;
        let mut seen = 0;
        for event in watch.see(&response).take(FINGERPAD_EVENTS_A_LOOK) {
            let change = match event.change {
                Change::Touch => FINGERPAD_TOUCH,
                Change::FirstSlip => FINGERPAD_FIRST_SLIP,
                Change::FullSlip => FINGERPAD_FULL_SLIP,
                Change::Restick => FINGERPAD_RESTICK,
                Change::LiftOff => FINGERPAD_LIFT_OFF,
            };
            // SAFETY: the caller's promise: there is room for as many.
            unsafe { write(events.add(seen), fingerpad_event { tick: event.tick, finger: event.finger, change }) }?;
            seen += 1;
        }
        // SAFETY: the caller's promise.
        unsafe { write(count, seen as u32) }
    };
    answer(looked())
}
