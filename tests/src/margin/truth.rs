//! Finite-element runs on surfaces of several strengths, and what sensors measure of them.
//!
//! Main types: [`Truth`], [`Sensors`], [`Measured`]. Uses the core.

use fingerpad::margin::Reading;
use fingerpad::{Drive, Model, Normal, State, Tangential};

use crate::synthetic_truth::Random;

/// A row of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Row {
    /// Normal force, N.
    pub normal_n: f64,
    /// Slide along x and y, mm.
    pub slide_mm: [f64; 2],
    /// Friction along x and y, N.
    pub friction_n: [f64; 2],
    /// Stick ratio.
    pub stick: f64,
    /// Slip margin: friction over that of full slip at the same normal force.
    pub margin: f64,
}

/// A run of finite elements and the strength of its surface in units of the bed.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Name of the run.
    pub name: String,
    /// Factor on lambda of the finite elements.
    pub lambda: f64,
    /// Strength factor with which the bed has the friction of full slip at the end of the run.
    pub strength: f64,
    /// Row at which the press ends.
    pub pressed: usize,
    /// The run itself.
    pub rows: Vec<Row>,
}

/// Friction of the bed in full slip along `direction` at a strength factor of 1, N.
pub fn limit_n(model: &Model<'_>, normal_n: f64, direction: [f64; 2]) -> f64 {
    let mut state = State::default();
    let mut limit = 0.0;
    let drive = |by: [f32; 2]| Drive {
        normal: Normal::ForceN(normal_n as f32),
        tangential: Tangential::SlideIncrementMm(by),
        spin_increment_rad: 0.0,
        dt_s: 1e-3,
    };
    let length = direction[0].hypot(direction[1]).max(1e-9);
    for k in 0..120 {
        let by = if k == 0 { [0.0; 2] } else { direction.map(|d| (0.2 * d / length) as f32) };
        let [x, y] = model.step_driven(&mut state, drive(by)).response.friction_n;
        limit = f64::from(x).hypot(f64::from(y));
    }
    limit
}

impl Truth {
    /// Reads the runs of a table.
    /// Columns: run, lambda, normal force, slide along x and y, friction along x and y, stick ratio.
    pub fn read(model: &Model<'_>, csv: &str) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        for line in csv.lines().skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            let number = |k: usize| cells[k].parse::<f64>().expect("a number");
            if all.last().is_none_or(|run| run.name != cells[0]) {
                let rows = Vec::new();
                all.push(Self { name: cells[0].into(), lambda: number(1), strength: 1.0, pressed: 0, rows });
            }
            let rows = &mut all.last_mut().expect("a run").rows;
            rows.push(Row {
                normal_n: number(2),
                slide_mm: [number(3), number(4)],
                friction_n: [number(5), number(6)],
                stick: number(7),
                margin: 1.0,
            });
        }
        for run in &mut all {
            run.complete(model);
        }
        all
    }

    /// The run as a table; see [`Truth::read`].
    pub fn to_csv(&self) -> String {
        let line = |r: &Row| {
            let ([x, y], [u, v]) = (r.slide_mm, r.friction_n);
            format!("{},{},{:.5},{x:.5},{y:.5},{u:.5},{v:.5},{:.5}\n", self.name, self.lambda, r.normal_n, r.stick)
        };
        self.rows.iter().map(line).collect()
    }

    /// Margins and strength from the end of the run, where everything slips.
    pub fn complete(&mut self, model: &Model<'_>) {
        let last = *self.rows.last().expect("rows");
        let size = |row: &Row| row.friction_n[0].hypot(row.friction_n[1]);
        let start = self.rows.iter().position(|row| row.slide_mm != [0.0; 2]).unwrap_or(1);
        let limit = |normal: f64| limit_n(model, normal, last.friction_n);
        let end = limit(last.normal_n);
        self.pressed = start - 1;
        self.strength = size(&last) / end;
        let mut known = (f64::NAN, 0.0);
        for row in &mut self.rows {
            if (row.normal_n - known.0).abs() > 1e-4 || known.0.is_nan() {
                known = (row.normal_n, limit(row.normal_n.max(1e-3)));
            }
            let there = known.1 * self.strength;
            row.margin = (1.0 - size(row) / there).max(0.0);
        }
    }

    /// The same motion of a finger whose tissue is stiffer by a factor: all forces grow by it.
    pub fn stiffened(&self, model: &Model<'_>, factor: f64) -> Self {
        let mut run = self.clone();
        for row in &mut run.rows {
            row.normal_n *= factor;
            row.friction_n = row.friction_n.map(|f| f * factor);
        }
        run.complete(model);
        run
    }

    /// The run on a surface of another strength, by the similarity of a small slide: at the same normal force, friction beyond that of the
    /// press and the slide grow by the same factor. Finite elements of lambda times 0.4 differ from it by up to 3.4 % of the limit.
    pub fn strengthened(&self, model: &Model<'_>, factor: f64) -> Self {
        let mut run = self.clone();
        let start = self.rows[self.pressed].friction_n;
        for row in &mut run.rows[self.pressed..] {
            row.slide_mm = row.slide_mm.map(|x| x * factor);
            row.friction_n = core::array::from_fn(|k| start[k] + factor * (row.friction_n[k] - start[k]));
        }
        run.lambda *= factor;
        run.complete(model);
        run
    }

    /// The run with a test motion after the press: 0.2 mm ahead and back. Friction of the motion back is twice that of half of the way
    /// (Masing's rule), which holds for a contact that hardly slips.
    pub fn with_test_motion(&self) -> Self {
        let mut run = self.clone();
        let start = self.rows[self.pressed];
        let ahead = self.rows[self.pressed + 1].slide_mm;
        let length = (ahead[0] - start.slide_mm[0]).hypot(ahead[1] - start.slide_mm[1]);
        let at = |way: f64| self.between(self.pressed as f64 + way / length);
        let top = at(TEST_MM);
        let mix = |way: f64, friction_n: [f64; 2]| Row { friction_n, ..at(way) };
        let back = |way: f64| {
            let half = at(0.5 * (TEST_MM - way));
            core::array::from_fn(|k| top.friction_n[k] - 2.0 * (half.friction_n[k] - start.friction_n[k]))
        };
        let again = |way: f64| {
            let half = at(0.5 * way);
            let low: [f64; 2] = back(0.0);
            core::array::from_fn(|k| low[k] + 2.0 * (half.friction_n[k] - start.friction_n[k]))
        };
        let ways = [0.25, 0.5, 0.75, 1.0].map(|share| share * TEST_MM);
        let mut motion: Vec<Row> = ways.iter().map(|&w| at(w)).collect();
        motion.extend(ways.iter().rev().skip(1).chain(&[0.0]).map(|&w| mix(w, back(w))));
        motion.extend(ways.iter().map(|&w| mix(w, again(w))));
        let rest = self.pressed + 1 + (TEST_MM / length) as usize;
        run.rows.splice(self.pressed + 1..rest, motion);
        run
    }

    /// First row in full slip.
    pub fn slips_at(&self) -> Option<usize> {
        (self.pressed + 1..self.rows.len()).find(|&k| self.rows[k].stick < SLIPS)
    }
}

/// Stick ratio below which everything slips.
pub const SLIPS: f64 = 5e-3;
/// Way of the test motion, mm.
const TEST_MM: f64 = 0.2;

/// Errors of the sensors.
#[derive(Clone, Copy, Debug)]
pub struct Sensors {
    /// Noise of each force, standard deviation, N.
    pub force_n: f64,
    /// Noise of each position, standard deviation, mm.
    pub encoder_mm: f64,
    /// Play of the drive, mm.
    pub play_mm: f64,
    /// Share of the slide.
    pub drift: f64,
    /// Lag of the forces behind the positions, s.
    pub lag_s: f64,
    /// Offset of each force, standard deviation, N.
    pub tare_n: f64,
    /// Noise of the stick ratio, standard deviation; 0 where it is not measured.
    pub stick: f64,
}

impl Sensors {
    /// Sensors by their noise, in mN and um; play is twice the noise of the encoders.
    pub const fn of(force_mn: f64, encoder_um: f64) -> Self {
        Self {
            force_n: 1e-3 * force_mn,
            encoder_mm: 1e-3 * encoder_um,
            play_mm: 2e-3 * encoder_um,
            drift: 0.005,
            lag_s: 0.005,
            tare_n: 2e-3,
            stick: 0.0,
        }
    }

    /// The same with a tactile skin that measures the stick ratio.
    pub const fn with_stick(self, noise: f64) -> Self {
        Self { stick: noise, ..self }
    }
}

/// A reading with its truth.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// What the observer gets.
    pub reading: Reading,
    /// The run at this instant.
    pub truth: Row,
    /// Way of the slide, mm.
    pub way_mm: f64,
}

/// How a run is traversed: 1 kHz; press in 0.3 s, slide at a speed up to row `until` (a fraction is between rows), then hold.
#[derive(Clone, Copy, Debug)]
pub struct Ride {
    /// Speed of the slide, mm/s.
    pub speed_mm_s: f64,
    /// Row at which the slide ends.
    pub until: f64,
    /// Hold at its end, s.
    pub hold_s: f64,
}

/// Time between two readings, s.
pub const DT_S: f64 = 1e-3;

/// The readings of a ride.
pub fn measure(run: &Truth, ride: Ride, sensors: &Sensors, random: &mut Random) -> Vec<Measured> {
    let tare: [f64; 3] = core::array::from_fn(|_| sensors.tare_n * random.normal());
    let drift: [f64; 2] = core::array::from_fn(|_| sensors.drift * random.normal());
    let mut places = vec![0.0; 50];
    let press = run.pressed as f64;
    places.extend((1..=300).map(|k| press * f64::from(k) / 300.0));
    let mut at = press;
    while at < ride.until {
        let k = (at as usize).min(run.rows.len() - 2);
        let [a, b] = [run.rows[k].slide_mm, run.rows[k + 1].slide_mm];
        let way = (b[0] - a[0]).hypot(b[1] - a[1]).max(0.02);
        // The speed changes by a third, three times a second.
        let speed = ride.speed_mm_s * (1.0 + 0.33 * (18.8 * DT_S * places.len() as f64).sin());
        at = (at + speed * DT_S / way).min(ride.until);
        places.push(at);
    }
    places.extend(core::iter::repeat_n(ride.until, (ride.hold_s / DT_S) as usize));

    let (mut felt, mut played, mut before) = ([0.0f64; 3], [0.0f64; 2], None::<[f64; 2]>);
    let (mut way, mut last) = (0.0, [0.0f64; 2]);
    let variance = |sd: f64| (sd * sd) as f32;
    (places.into_iter())
        .map(|place| {
            let truth = run.between(place);
            let share = DT_S / (sensors.lag_s + DT_S);
            let now = [truth.normal_n, truth.friction_n[0], truth.friction_n[1]];
            for (felt, now) in felt.iter_mut().zip(now) {
                *felt += share * (now - *felt);
            }
            way += (truth.slide_mm[0] - last[0]).hypot(truth.slide_mm[1] - last[1]);
            last = truth.slide_mm;
            let position: [f64; 2] = core::array::from_fn(|k| {
                // Play: the measured position follows once the gap is closed.
                let gap = truth.slide_mm[k] - played[k];
                let half = 0.5 * sensors.play_mm;
                played[k] += if gap > half {
                    gap - half
                } else if gap < -half {
                    gap + half
                } else {
                    0.0
                };
                played[k] * (1.0 + drift[k]) + sensors.encoder_mm * random.normal()
            });
            let from = before.replace(position).unwrap_or(position);
            let [normal, x, y] =
                core::array::from_fn(|k| (felt[k] + tare[k] + sensors.force_n * random.normal()) as f32);
            // Only where it is measured, so that the noise of the others is the same without it.
            let stick = if sensors.stick > 0.0 { truth.stick + sensors.stick * random.normal() } else { 0.0 };
            let (force, slide) = (variance(sensors.force_n), variance(sensors.encoder_mm));
            let reading = Reading {
                normal_force_n: normal,
                friction_n: [x, y],
                slide_increment_mm: [(position[0] - from[0]) as f32, (position[1] - from[1]) as f32],
                normal_variance_n2: force,
                friction_covariance_n2: [force, force, 0.0],
                slide_covariance_mm2: [slide, slide, 0.0],
                stick_ratio: stick as f32,
                stick_variance: variance(sensors.stick),
                dt_s: DT_S as f32,
                ..Reading::default()
            };
            Measured { reading, truth, way_mm: way }
        })
        .collect()
}

impl Truth {
    /// The state between two rows.
    pub fn between(&self, place: f64) -> Row {
        let k = (place as usize).min(self.rows.len() - 2);
        let t = (place - k as f64).clamp(0.0, 1.0);
        let (a, b) = (&self.rows[k], &self.rows[k + 1]);
        let mix = |a: f64, b: f64| a + t * (b - a);
        let both = |a: [f64; 2], b: [f64; 2]| [mix(a[0], b[0]), mix(a[1], b[1])];
        Row {
            normal_n: mix(a.normal_n, b.normal_n),
            slide_mm: both(a.slide_mm, b.slide_mm),
            friction_n: both(a.friction_n, b.friction_n),
            stick: mix(a.stick, b.stick),
            margin: mix(a.margin, b.margin),
        }
    }

    /// The place of a margin on the way to slip, in rows.
    pub fn place_of(&self, margin: f64) -> f64 {
        let last = self.slips_at().unwrap_or(self.rows.len() - 1);
        let k = (self.pressed..last).rev().find(|&k| self.rows[k].margin > margin).unwrap_or(self.pressed);
        let (a, b) = (self.rows[k].margin, self.rows[k + 1].margin);
        k as f64 + ((a - margin) / (a - b).max(1e-9)).clamp(0.0, 1.0)
    }
}
