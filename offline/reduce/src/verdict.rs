//! How good a reduced model is: its errors along held-out runs beside limits.
//!
//! Main types: [`Verdict`], [`Errors`], [`Grade`]. Uses runs, replay and pad.

use std::collections::BTreeMap;

use fingerpad::{ModelOf, Response};
use fingerpad_fe::contact::Outline;

use super::pad::{self, PadModel};
use super::{Kind, Run, replay};

/// Groups of runs with a verdict each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Group {
    /// The pose of the mesh, on a plane.
    Neutral,
    /// Slides in the pose of the mesh that go on until all of the contact slips.
    FullSlip,
    /// Other poses, and changes of the pose.
    Poses,
    /// Several coordinates at once.
    Combined,
    /// Large forces.
    Deep,
    /// Bodies other than a plane.
    Bodies,
}

impl Group {
    /// All groups.
    pub const ALL: [Self; 6] = [Self::Neutral, Self::FullSlip, Self::Poses, Self::Combined, Self::Deep, Self::Bodies];

    /// The group of a kind of motion.
    pub fn of(kind: Kind) -> Self {
        match kind {
            Kind::Deep => Self::Deep,
            Kind::Combined => Self::Combined,
            Kind::Body => Self::Bodies,
            kind if kind.is_in_pose() || kind.changes_pose() => Self::Poses,
            _ => Self::Neutral,
        }
    }

    /// Its name in print.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Neutral => "neutral pose",
            Self::FullSlip => "full slip",
            Self::Poses => "poses",
            Self::Combined => "combined",
            Self::Deep => "deep",
            Self::Bodies => "bodies",
        }
    }
}

/// A verdict.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Grade {
    /// All errors are within [`GOOD`].
    Good,
    /// All errors are within twice that.
    Usable,
    /// An error is larger.
    NotUsable,
}

impl Grade {
    /// Its name in print.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Usable => "usable",
            Self::NotUsable => "not usable",
        }
    }
}

/// Largest errors of a good model: normal force, friction, stick ratio. Those of a usable model are twice as large.
pub const GOOD: [f64; 3] = [0.05, 0.05, 0.1];

/// Errors along the held-out runs of a group, root mean square over their rows in contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Number of runs.
    pub runs: usize,
    /// Normal force over the run's largest.
    pub normal: f64,
    /// Friction over the run's largest, which is at least half of the law's strength under an even pressure.
    pub friction: f64,
    /// Stick ratio.
    pub stick: f64,
    /// Spin moment over that friction times the radius of the largest contact.
    pub moment: f64,
    /// Centre of pressure, mm, where the normal force is above a tenth of the run's largest.
    pub centre_mm: f64,
}

impl Errors {
    /// The verdict.
    pub fn grade(&self) -> Grade {
        let worst = [self.normal, self.friction, self.stick].into_iter().zip(GOOD).map(|(x, good)| x / good);
        match worst.fold(0.0, |a: f64, b| if b.is_nan() { f64::INFINITY } else { a.max(b) }) {
            x if x <= 1.0 => Grade::Good,
            x if x <= 2.0 => Grade::Usable,
            _ => Grade::NotUsable,
        }
    }
}

/// The errors of a model by group; groups without held-out runs are absent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict(pub BTreeMap<Group, Errors>);

/// The numbers of a response that are compared: normal force, friction x and y, stick ratio, centre x and y, spin moment.
type Answer = [f64; 7];

fn answer<T: Into<f64> + Copy>(r: &Response<T>) -> Answer {
    let ([x, y], [centre_x, centre_y]) = (r.friction_n, r.pressure_centre_mm);
    [r.normal_force_n, x, y, r.stick_ratio, centre_x, centre_y, r.spin_moment_n_mm].map(Into::into)
}

/// Sums of squares, and numbers of rows: all, and those with a pose.
#[derive(Default)]
struct Sums {
    runs: usize,
    squares: [f64; 5],
    rows: f64,
    posed: f64,
}

impl Sums {
    fn add(&mut self, run: &Run, answers: &[Answer], law: [f64; 2]) {
        let [normal, friction, area] = pad::largest(run, law);
        let radius_mm = (area / std::f64::consts::PI).sqrt();
        self.runs += 1;
        for (s, a) in run.samples.iter().zip(answers) {
            let of_fe = f64::from(s.normal_force_n);
            if of_fe <= 0.0 && a[0] <= 0.0 {
                continue;
            }
            let [x, y] = [0, 1].map(|k| a[1 + k] - f64::from(s.friction_n[k]));
            self.rows += 1.0;
            self.squares[0] += ((a[0] - of_fe) / normal).powi(2);
            self.squares[1] += (x * x + y * y) / (friction * friction);
            self.squares[2] += (a[3] - f64::from(s.stick_ratio)).powi(2);
            let Some(turned) = s.turned.filter(|_| of_fe > 0.1 * normal) else { continue };
            let [about_x, about_y, spin] = turned.moment_n_mm.map(f64::from);
            self.posed += 1.0;
            self.squares[3] += ((a[6] - spin) / (friction * radius_mm)).powi(2);
            self.squares[4] += (a[4] + about_y / of_fe).powi(2) + (a[5] - about_x / of_fe).powi(2);
        }
    }

    fn errors(&self) -> Errors {
        let rms = |k: usize, rows: f64| if rows > 0.0 { (self.squares[k] / rows).sqrt() } else { 0.0 };
        let [normal, friction, stick] = [0, 1, 2].map(|k| rms(k, self.rows));
        Errors { runs: self.runs, normal, friction, stick, moment: rms(3, self.posed), centre_mm: rms(4, self.posed) }
    }
}

impl Verdict {
    fn from(runs: &[Run], law: [f64; 2], answers: impl Fn(&Run) -> Vec<Answer>) -> Self {
        let mut sums: BTreeMap<Group, Sums> = BTreeMap::new();
        for run in runs.iter().filter(|run| run.held_out) {
            sums.entry(Group::of(run.kind)).or_default().add(run, &answers(run), law);
        }
        Self(sums.into_iter().map(|(group, sums)| (group, sums.errors())).collect())
    }

    /// The verdict on a pad.
    ///
    /// * `law`: lambda and beta of the runs
    pub fn of_pad(model: &PadModel, runs: &[Run], outline: &Outline, law: [f64; 2]) -> Self {
        Self::from(runs, law, |run| pad::replay(model, run, outline).iter().map(answer).collect())
    }

    /// The verdict on a bed, along the runs that it represents.
    ///
    /// * `law`: lambda and beta of the runs
    pub fn of_bed<const M: usize, const N: usize>(model: &ModelOf<'_, M, N>, runs: &[Run], law: [f64; 2]) -> Self {
        let runs: Vec<Run> = runs.iter().filter(|run| run.is_representable()).cloned().collect();
        Self::from(&runs, law, |run| replay(model, run).iter().map(answer).collect())
    }

    /// Adds the errors along slides to full slip.
    ///
    /// * `slides`: the verdict on those alone
    pub fn with_full_slip(mut self, slides: &Self) -> Self {
        self.0.extend(slides.0.get(&Group::Neutral).map(|errors| (Group::FullSlip, *errors)));
        self
    }

    /// The worst grade of the groups for which `which` is true; good without such a group.
    pub fn worst(&self, which: impl Fn(Group) -> bool) -> Grade {
        let grades = self.0.iter().filter(|(group, _)| which(**group)).map(|(_, errors)| errors.grade());
        grades.max().unwrap_or(Grade::Good)
    }

    /// The verdict in words: the grade in the neutral pose with its errors, and the grades of the other motions.
    ///
    /// * `name`: of the model
    pub fn sentence(&self, name: &str) -> String {
        let Some(neutral) = self.0.get(&Group::Neutral) else {
            return format!("The {name} could not be checked: no path in the neutral pose is held out.");
        };
        let grade = neutral.grade();
        let mut text = format!(
            "The {name} is {} in the neutral pose: normal force {:.1} %, friction {:.1} %, stick ratio {:.3}.",
            grade.as_str(),
            100.0 * neutral.normal,
            100.0 * neutral.friction,
            neutral.stick
        );
        let others = self.0.iter().filter(|(group, _)| **group != Group::Neutral);
        let others: Vec<String> =
            others.map(|(group, e)| format!("{} {}", group.as_str(), e.grade().as_str())).collect();
        if !others.is_empty() {
            text += &format!(" Other motions: {}.", others.join(", "));
        }
        text
    }

    /// Rows of a table with the columns [`COLUMNS`].
    pub fn rows(&self, name: &str) -> Vec<Vec<String>> {
        let row = |(group, e): (&Group, &Errors)| {
            let percent = |x: f64| format!("{:.1} %", 100.0 * x);
            let numbers = [percent(e.normal), percent(e.friction), format!("{:.3}", e.stick), percent(e.moment)];
            let ends = [format!("{:.2} mm", e.centre_mm), e.grade().as_str().to_owned()];
            let starts = [name.to_owned(), group.as_str().to_owned(), e.runs.to_string()];
            starts.into_iter().chain(numbers).chain(ends).collect()
        };
        self.0.iter().map(row).collect()
    }
}

/// Columns of the table of verdicts.
pub const COLUMNS: [&str; 9] =
    ["model", "motions", "runs", "normal force", "friction", "stick ratio", "moment", "centre", "verdict"];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_error_decides() {
        let grade = |normal, friction, stick| Errors { normal, friction, stick, ..Errors::default() }.grade();
        assert_eq!(grade(0.05, 0.01, 0.1), Grade::Good);
        assert_eq!(grade(0.01, 0.051, 0.0), Grade::Usable);
        assert_eq!(grade(0.0, 0.0, 0.21), Grade::NotUsable);
        assert_eq!(grade(f64::NAN, 0.0, 0.0), Grade::NotUsable);
        let group = |kind| Group::of(kind);
        assert_eq!([Kind::Press, Kind::SpinSlide, Kind::ForceStep].map(group), [Group::Neutral; 3]);
        assert_eq!([Kind::Pose, Kind::WidePoseChange].map(group), [Group::Poses; 2]);
    }
}
