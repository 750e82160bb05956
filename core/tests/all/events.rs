//! Events of series of stick ratios: hysteresis and debounce.

use fingerpad::events::{Change, Queue, Watch, WatchSettings};
use fingerpad::{Regime, Response};

/// Events of a series of stick ratios; a negative one is the air.
fn events(settings: WatchSettings, ratios: impl IntoIterator<Item = f32>) -> Vec<(u32, Change)> {
    let mut queue: Queue<64> = Queue::new();
    let (mut producer, mut consumer) = queue.split();
    let mut watch = Watch::with_settings(0, settings);
    for stick_ratio in ratios {
        let regime = Regime::classify(stick_ratio >= 0.0, stick_ratio);
        let mut response = Response::default();
        (response.stick_ratio, response.regime) = (stick_ratio, regime);
        watch.look(&response, &mut producer);
    }
    assert_eq!(watch.lost(), 0);
    std::iter::from_fn(|| consumer.dequeue()).map(|e| (e.tick, e.change)).collect()
}

/// A ratio that falls from 1 to 0 and comes back, and noise on it.
fn there_and_back(noise: f32) -> impl Iterator<Item = f32> {
    let mut seed = 7u32;
    (0..4000).map(move |i| {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let unit = (seed >> 8) as f32 / (1 << 23) as f32 - 1.0;
        (1.02 - 1.04 * (i as f32 / 2000.0).min((4000 - i) as f32 / 2000.0) + noise * unit).clamp(0.0, 1.0)
    })
}

#[test]
fn a_watch_is_small() {
    assert_eq!(size_of::<Watch>(), 36);
}

#[test]
fn one_look_is_not_enough_and_a_sure_slip_is() {
    use Change::{FirstSlip, LiftOff, Touch};
    let settings = WatchSettings::default();
    // The finger bounces before it rests.
    assert_eq!(events(settings, [-1.0, 1.0, -1.0, 1.0, 1.0]), [(4, Touch)]);
    // Seven readings just below the threshold, one above, which takes one back, then two.
    let (above, below) = ([1.0, 1.0].into_iter(), std::iter::repeat(0.98));
    let close = above.chain(below.clone().take(7)).chain([1.0]).chain(below.take(2));
    assert_eq!(events(settings, close), [(1, Touch), (11, FirstSlip)]);
    assert_eq!(events(settings, [1.0, 1.0, 0.94]), [(1, Touch), (2, FirstSlip)]);
    assert_eq!(events(settings, [1.0, 1.0, -1.0, 1.0, -1.0, -1.0]), [(1, Touch), (5, LiftOff)]);
}

#[test]
fn noise_tells_each_change_once() {
    use Change::{FirstSlip, FullSlip, Restick, Touch};
    let plain = WatchSettings { looks: 1, contact_looks: 1, sure_slip: 0.0, ..WatchSettings::default() };
    let naive = WatchSettings { partial_restick: plain.full_slip, restick: 0.99, ..plain };
    let changes_of = |settings, noise| -> Vec<Change> {
        events(settings, there_and_back(noise)).into_iter().map(|(_, change)| change).collect()
    };
    let once = [Touch, FirstSlip, FullSlip, Restick, Restick];
    assert_eq!(changes_of(naive, 0.0), once);
    assert_eq!(changes_of(WatchSettings::default(), 0.0), once);
    assert_eq!(changes_of(WatchSettings::default(), 0.01), once);
    // Without hysteresis and debounce the same noise causes many.
    assert!(changes_of(naive, 0.01).len() > 20);
}
