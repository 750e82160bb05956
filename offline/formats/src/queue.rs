//! A queue of pieces of work on some threads.
//!
//! Main function: [`in_threads`]. A caller that keeps each result in a file (see [`crate::atomic_write`]) and puts only the missing ones
//! into the queue resumes where it was.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Calls `work` for each item, on `threads` threads, which take the items in their order. Returns the results in that order.
///
/// # Errors
/// The failure of the first item that failed, in the order of the items. After a failure no further item is begun; those that were begun
/// are finished.
///
/// # Panics
/// As `work` does.
pub fn in_threads<T: Send, R: Send, E: Send>(
    items: impl IntoIterator<Item = T, IntoIter: Send>,
    threads: usize,
    work: impl Fn(T) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let items = Mutex::new(items.into_iter().enumerate());
    let done = Mutex::new(Vec::new());
    let has_failed = AtomicBool::new(false);
    let run = || {
        while !has_failed.load(Ordering::Relaxed) {
            let Some((number, item)) = items.lock().expect("no panic while locked").next() else { return };
            let result = work(item);
            has_failed.fetch_or(result.is_err(), Ordering::Relaxed);
            done.lock().expect("no panic while locked").push((number, result));
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(run);
        }
        run();
    });
    let mut done = done.into_inner().expect("threads have ended");
    done.sort_by_key(|(number, _)| *number);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;

    use super::*;

    #[test]
    fn results_keep_the_order_of_the_items_and_run_side_by_side() {
        // Ends only if three items are under way at once.
        let together = Barrier::new(3);
        let squares = in_threads(0..3, 3, |i: u32| {
            together.wait();
            Ok::<_, ()>(i * i)
        });
        assert_eq!(squares, Ok(vec![0, 1, 4]));
        assert_eq!(in_threads(0..100, 4, |i: u32| Ok::<_, ()>(i)), Ok((0..100).collect()));
        assert_eq!(in_threads(Vec::<u8>::new(), 4, |_| Err::<(), _>("none")), Ok(vec![]));
    }

    #[test]
    fn a_failure_ends_the_queue() {
        let begun = Mutex::new(0);
        let fails = |i: u32| {
            *begun.lock().unwrap() += 1;
            if i < 5 { Ok(i) } else { Err(i) }
        };
        assert_eq!(in_threads(0.., 1, fails), Err(5));
        assert_eq!(*begun.lock().unwrap(), 6);
        assert_eq!(in_threads(0.., 4, |i: u32| if i < 5 { Ok(i) } else { Err(i) }), Err(5));
    }
}
