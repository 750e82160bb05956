//! Ctrl-C and termination signals: exit code 130 within a second.
//!
//! A command ends at once unless it holds [`keeping`]. In that case [`go_on`] returns false, and the command saves its
//! results.

use std::{
    ops::ControlFlow,
    process,
    sync::atomic::{AtomicBool, AtomicUsize, Ordering},
};

use fingerpad_formats::discard_unfinished;

/// The exit code of an interrupted command.
pub const EXIT_CODE: u8 = 130;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
/// Number of parts of the program that save results when interrupted.
static KEEPING: AtomicUsize = AtomicUsize::new(0);

/// Whether the run may go on; to be returned by progress callbacks.
pub fn go_on() -> ControlFlow<()> {
    if INTERRUPTED.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// While this value exists, an interruption lets the command finish its increment and save its results.
pub struct Keeping(());

/// Makes interruptions wait for [`go_on`].
pub fn keeping() -> Keeping {
    KEEPING.fetch_add(1, Ordering::Relaxed);
    Keeping(())
}

impl Drop for Keeping {
    fn drop(&mut self) {
        KEEPING.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Takes the signals from now on. A second one ends the program at once.
pub fn handle_signals() {
    let handler = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) || KEEPING.load(Ordering::Relaxed) == 0 {
            discard_unfinished();
            eprintln!("interrupted");
            process::exit(EXIT_CODE.into());
        }
        eprintln!("interrupted: finishing the increment, keeping the results so far (interrupt again to stop at once)");
    });
    if let Err(error) = handler {
        eprintln!("warning: Ctrl-C will not keep unfinished work: {error}");
    }
}
