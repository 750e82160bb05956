//! Progress of work that takes longer than two seconds: a bar on a terminal, a plain line on standard error every few
//! seconds if that is a file or a pipe.

use std::{
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
        mpsc::{self, RecvTimeoutError},
    },
    thread,
    time::Duration,
};

use fingerpad_fe::load_path::Progress;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

/// When the first plain line is written, ms from the start.
static FIRST_LINE_MS: AtomicU64 = AtomicU64::new(2000);
/// Time between plain lines, ms.
static BETWEEN_LINES_MS: AtomicU64 = AtomicU64::new(5000);

/// Sets the time to the first plain line and between plain lines, for a program that reads them.
pub fn line_every(period: Duration) {
    let period_ms = period.as_millis() as u64;
    FIRST_LINE_MS.store(period_ms, Ordering::Relaxed);
    BETWEEN_LINES_MS.store(period_ms, Ordering::Relaxed);
}

/// Progress bars of concurrent work, one below the other.
#[derive(Default)]
pub struct Bars(MultiProgress);

impl Bars {
    /// Puts a bar below the others.
    pub fn add(&self, bar: Bar) -> Bar {
        Bar { bar: self.0.add(bar.bar), ..bar }
    }

    /// Writes a permanent line.
    pub fn line(&self, text: &str) {
        self.0.suspend(|| eprintln!("{text}"));
    }
}

/// Progress of a piece of work.
pub struct Bar {
    bar: ProgressBar,
    /// When the next plain line is due, ms from the start.
    next_line_ms: AtomicU64,
}

/// A bar for a run of the finite elements, or for other work that reports its share.
pub fn bar(name: String) -> Bar {
    Bar::new(name, 1000, "{prefix:>16} {bar:30} {percent:>3} %  {msg}  {eta} left")
}

/// A bar that counts pieces, whose name is put behind the numbers.
pub fn counter(name: &str, pieces: usize, what: &str) -> Bar {
    let template = format!("{{prefix:>16}} {{bar:30}} {{pos}}/{{len}} {what}  {{msg}}  {{eta}} left");
    Bar::new(name.to_owned(), pieces as u64, &template)
}

/// Shows the progress of a run of the finite elements.
pub fn show(bar: &Bar, progress: &Progress) {
    let cost = &progress.cost;
    bar.bar.set_message(format!(
        "increment {}, {} iterations, {} cut back",
        cost.increments, cost.iterations, cost.cutbacks
    ));
    bar.set_share(progress.share);
}

impl Bar {
    fn new(name: String, length: u64, template: &str) -> Self {
        let style = ProgressStyle::with_template(template).expect("a valid template");
        let bar = ProgressBar::new(length).with_style(style).with_prefix(name);
        Self { bar, next_line_ms: AtomicU64::new(FIRST_LINE_MS.load(Ordering::Relaxed)) }
    }

    /// Sets the share that is done, 0 to 1.
    pub fn set_share(&self, share: f64) {
        let length = self.bar.length().unwrap_or(0);
        self.bar.set_position((share * length as f64) as u64);
        self.line();
    }

    /// Counts one piece more.
    pub fn count(&self) {
        self.bar.inc(1);
        self.line();
    }

    /// Sets the number of finished pieces, the number of all, and the current activity.
    pub fn set(&self, done: usize, all: usize, message: String) {
        self.bar.set_length(all as u64);
        self.bar.set_position(done as u64);
        self.say(message);
    }

    /// Expects `more` further pieces, if that is more than expected so far.
    pub fn expect(&self, more: usize) {
        let ahead = self.bar.position() + more as u64;
        self.bar.set_length(self.bar.length().unwrap_or(0).max(ahead));
    }

    /// Sets the current activity.
    pub fn say(&self, message: String) {
        self.bar.set_message(message);
        self.line();
    }

    /// Takes the bar away.
    pub fn finish_and_clear(&self) {
        self.bar.finish_and_clear();
    }

    /// Writes a plain line if the bar is hidden and a line is due.
    fn line(&self) {
        if !self.bar.is_hidden() {
            return;
        }
        let now = self.bar.elapsed().as_millis() as u64;
        let due = self.next_line_ms.load(Ordering::Relaxed);
        let next = now + BETWEEN_LINES_MS.load(Ordering::Relaxed);
        // Only one thread writes the line that is due.
        if now >= due && self.next_line_ms.compare_exchange(due, next, Ordering::Relaxed, Ordering::Relaxed).is_ok() {
            let length = self.bar.length().unwrap_or(0).max(1);
            let percent = 100 * self.bar.position() / length;
            let message = self.bar.message();
            let separator = if message.is_empty() { "" } else { ", " };
            eprintln!("{}: {percent} %{separator}{message}", self.bar.prefix());
        }
    }
}

/// Does `work` of unknown length beside a spinner or plain lines with its name and time. `work` receives a function
/// that sets the text of the current activity.
pub fn during<T>(what: &str, work: impl FnOnce(&dyn Fn(&str)) -> T) -> T {
    let spinner = ProgressBar::new_spinner().with_message(what.to_owned());
    if !spinner.is_hidden() {
        spinner.enable_steady_tick(Duration::from_millis(100));
        let done = work(&|stage| spinner.set_message(stage.to_owned()));
        spinner.finish_and_clear();
        return done;
    }
    let stage = Mutex::new(what.to_owned());
    let (stage, spinner) = (&stage, &spinner);
    let (sender, ended) = mpsc::channel::<()>();
    thread::scope(|scope| {
        scope.spawn(move || {
            let mut wait = Duration::from_millis(FIRST_LINE_MS.load(Ordering::Relaxed));
            while ended.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
                eprintln!("{}: {:.0} s", stage.lock().expect("no panic while locked"), spinner.elapsed().as_secs_f64());
                wait = Duration::from_millis(BETWEEN_LINES_MS.load(Ordering::Relaxed));
            }
        });
        // The sender is dropped at the end of the work, which ends the lines.
        let _sender = sender;
        work(&|text| text.clone_into(&mut stage.lock().expect("no panic while locked")))
    })
}
