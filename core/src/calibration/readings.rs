//! Averaging of readings to blocks.
//!
//! Main types: [`Reading`], [`Gathering`]. Uses math.

use crate::math::sqrt;

/// Largest number of readings of a block; it is reached while the plane rests.
const READINGS_MAX: f32 = 4096.0;
/// Depth at which a finger has no contact for any zero of the depth, mm.
const AIR_MM: f32 = -1.0;

/// Position of the plane and measured forces. For a block, the position of its end and the mean of the forces along its travel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reading {
    pub(super) depth_mm: f32,
    /// Since touch.
    pub(super) slide_mm: [f32; 2],
    pub(super) normal_n: f32,
    pub(super) friction_n: [f32; 2],
}

impl Reading {
    pub(super) const AIR: Self = Self { depth_mm: AIR_MM, slide_mm: [0.0; 2], normal_n: 0.0, friction_n: [0.0; 2] };

    pub(super) fn is_air(&self) -> bool {
        self.depth_mm <= AIR_MM
    }

    /// Motion from another position, mm: depth, slide.
    pub(super) fn way_from(&self, other: &Self) -> [f32; 3] {
        let [x, y] = [self.slide_mm[0] - other.slide_mm[0], self.slide_mm[1] - other.slide_mm[1]];
        [self.depth_mm - other.depth_mm, x, y]
    }

    /// Its square, mm².
    pub(super) fn square_from(&self, other: &Self) -> f32 {
        let [deeper, x, y] = self.way_from(other);
        x * x + y * y + deeper * deeper
    }

    /// This block and the next joined, if both are in contact and the plane does not turn between them.
    pub(super) fn with(&self, before: &Self, next: &Self) -> Option<Self> {
        let (came, goes) = (self.way_from(before), next.way_from(self));
        let ahead: f32 = came.iter().zip(goes).map(|(a, b)| a * b).sum();
        let straight = ahead > 0.0 && ahead * ahead > 0.8 * self.square_from(before) * next.square_from(self);
        let mean = |a: f32, b: f32| 0.5 * (a + b);
        let friction_n = [0, 1].map(|i| mean(self.friction_n[i], next.friction_n[i]));
        let together = Self { normal_n: mean(self.normal_n, next.normal_n), friction_n, ..*next };
        (straight && !self.is_air() && !next.is_air()).then_some(together)
    }
}

/// Readings of the block under construction.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gathering {
    /// The last two readings.
    pub(super) last: [Reading; 2],
    /// Number of readings since touch; at most 2.
    pub(super) seen: u8,
    /// Slide since touch, mm.
    pub(super) slide_mm: [f32; 2],
    /// The block's first reading, its sum and number.
    pub(super) first: Reading,
    pub(super) sum: Reading,
    pub(super) readings: f32,
    /// Largest squared distance from the first reading, mm², and the block up to there.
    pub(super) farthest: f32,
    pub(super) block: Reading,
}

impl Gathering {
    /// Adds a reading. Returns a block if the plane has moved by `way_mm` since its first reading, or has turned back by half of it.
    pub(super) fn take(&mut self, reading: Reading, way_mm: f32) -> Option<Reading> {
        let [before, last] = self.last;
        self.last = [last, reading];
        if self.seen < 2 {
            self.seen += 1;
            self.first = reading;
            return None;
        }
        // The median of three removes single spikes; the position is that of the middle reading.
        let median = |a: f32, b: f32, c: f32| a.max(b).min(c.max(a.min(b)));
        let normal_n = median(before.normal_n, last.normal_n, reading.normal_n);
        let friction_n = [0, 1].map(|i| median(before.friction_n[i], last.friction_n[i], reading.friction_n[i]));
        if self.readings < READINGS_MAX {
            self.sum.normal_n += normal_n;
            self.sum.friction_n = [0, 1].map(|i| self.sum.friction_n[i] + friction_n[i]);
            self.readings += 1.0;
        }
        let square = last.square_from(&self.first);
        if square >= self.farthest {
            self.farthest = square;
            let mean = |sum: f32| sum / self.readings;
            self.block =
                Reading { normal_n: mean(self.sum.normal_n), friction_n: self.sum.friction_n.map(mean), ..last };
        }
        let back = sqrt(self.farthest.abs()) - 0.5 * way_mm;
        if self.farthest < way_mm * way_mm && !(back > 0.0 && square < back * back) {
            return None;
        }
        (self.first, self.sum) = (self.block, Reading::default());
        (self.readings, self.farthest) = (0.0, 0.0);
        Some(self.block)
    }
}
