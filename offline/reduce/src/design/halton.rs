//! Halton's sequence (Halton 1960, Numer. Math. 2:84-90): a few points fill many ranges evenly.

const PRIMES: [usize; 30] = [
    2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, 89, 97, 101, 103, 107, 109,
    113,
];

/// The `index`-th number of Halton's sequence of that base, 0 to 1.
pub fn halton(mut index: usize, base: usize) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0);
    while index > 0 {
        digit /= base as f64;
        value += digit * (index % base) as f64;
        index /= base;
    }
    value
}

/// One point of Halton's sequence: the parameters of one path, each in a prime base of its own.
pub(super) struct HaltonPoint {
    index: usize,
    next: usize,
}

impl HaltonPoint {
    /// The point of that number, from 1.
    pub(super) fn new(index: usize) -> Self {
        Self { index, next: 0 }
    }

    /// The next coordinate, within these bounds.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        let base = PRIMES[self.next % PRIMES.len()];
        self.next += 1;
        // Sequences of large bases start with many small steps; a stride that is coprime to all bases spreads their points.
        low + (high - low) * halton(self.index * 127 + 1, base)
    }

    /// A direction in the plane, rad.
    pub(super) fn angle(&mut self) -> f64 {
        self.between(0.0, std::f64::consts::TAU)
    }

    /// 1 or -1.
    pub(super) fn sign(&mut self) -> f64 {
        if self.between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 }
    }
}
