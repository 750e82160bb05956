//! Every number that the report shows, in the form in which `report.json` holds it.

use serde::Serialize;

use super::{BuildReport, Check, DepthResult, FrictionPoint, Provenance};
use fingerpad_fe::load_path::{Cost, Response, Snapshot, Work};
use fingerpad_reduce::Agreement;

/// Slides whose maps are shown, mm.
pub const MAP_SLIDES_MM: [f64; 5] = [0.0, 0.5, 1.0, 2.0, 6.0];
/// Stick ratio up to which the contact as a whole slips.
pub const FULL_SLIP: f64 = 0.01;

/// Numbers of the page. Those that do not exist are null.
#[derive(Clone, Debug, Serialize)]
pub struct Numbers {
    /// Settings, program and duration of the run.
    pub provenance: Provenance,
    /// Sum of the stages' wall times, s.
    pub total_wall_s: f64,
    /// Sum of the stages' CPU times, s.
    pub total_cpu_s: f64,
    /// The paper's fit of its measured points.
    pub paper_fit: PaperFit,
    /// Differences over the depths, percent of the measured value.
    pub difference_percent: Differences,
    /// Slopes of the normal force from each depth to the next.
    pub force_secants: Vec<Secant>,
    /// One entry per depth.
    pub depths: Vec<DepthNumbers>,
    /// Friction coefficient between and beyond the depths.
    pub continuous: Vec<FrictionPoint>,
    /// Checks on the numerics.
    pub checks: Vec<Check>,
    /// Limits of the model in addition to those of every report.
    pub left_out: Vec<String>,
    /// A reduced model along the same motions.
    pub reduced: Option<ReducedNumbers>,
}

/// A reduced model against the runs.
#[derive(Clone, Debug, Serialize)]
pub struct ReducedNumbers {
    /// Name of its file.
    pub model: String,
    /// One entry per depth.
    pub depths: Vec<ReducedDepth>,
}

/// A reduced model against the run at one depth: root mean square and largest difference over all rows.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ReducedDepth {
    /// Depth, mm.
    pub depth_mm: f64,
    /// Of the normal force, N.
    pub normal_n: [Option<f64>; 2],
    /// Of the normal force, percent of its largest value.
    pub normal_percent: [Option<f64>; 2],
    /// Of friction, N.
    pub friction_n: [Option<f64>; 2],
    /// Of friction, percent of its largest value.
    pub friction_percent: [Option<f64>; 2],
}

impl ReducedNumbers {
    fn of(report: &BuildReport) -> Option<Self> {
        let reduced = report.reduced.as_ref()?;
        let depths =
            report.depths.iter().zip(&reduced.depths).map(|(depth, Agreement { normal, friction })| ReducedDepth {
                depth_mm: depth.depth_mm,
                normal_n: [normal.rms_n, normal.largest_n].map(finite),
                normal_percent: normal.percent().map(finite),
                friction_n: [friction.rms_n, friction.largest_n].map(finite),
                friction_percent: friction.percent().map(finite),
            });
        Some(Self { model: reduced.name.clone(), depths: depths.collect() })
    }
}

/// F/N = coefficient * N^exponent, N in newtons.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PaperFit {
    /// Friction coefficient at 1 N.
    pub coefficient: f64,
    /// Exponent of the normal force.
    pub exponent: f64,
}

/// Smallest and largest of the depths' values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Range {
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
}

/// Slope of the normal force between two depths.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Secant {
    /// Lower depth, mm.
    pub from_mm: f64,
    /// Higher depth, mm.
    pub to_mm: f64,
    /// In Table 1, N/mm.
    pub measured_n_mm: Option<f64>,
    /// In the model, N/mm.
    pub model_n_mm: Option<f64>,
}

impl Secant {
    fn of(pair: &[DepthNumbers]) -> Self {
        let (a, b) = (&pair[0], &pair[1]);
        let slope = |of: fn(&DepthNumbers) -> Option<f64>| {
            of(a).zip(of(b)).and_then(|(fa, fb)| finite((fb - fa) / (b.depth_mm - a.depth_mm)))
        };
        Self {
            from_mm: a.depth_mm,
            to_mm: b.depth_mm,
            measured_n_mm: slope(|d| d.normal_force_n.measured),
            model_n_mm: slope(|d| d.normal_force_n.model),
        }
    }
}

/// Ranges of the model's differences from Table 1, percent; null without a comparison.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Differences {
    /// Of the normal force.
    pub normal_force: Option<Range>,
    /// Of the contact area.
    pub contact_area: Option<Range>,
    /// Of the friction coefficient.
    pub friction_coefficient: Option<Range>,
}

/// One quantity: measured, computed, and the difference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Table 1.
    pub measured: Option<f64>,
    /// Computed.
    pub model: Option<f64>,
    /// (model - measured) / measured, percent.
    pub difference_percent: Option<f64>,
}

impl Comparison {
    fn of(measured: Option<f64>, model: f64) -> Self {
        let measured = measured.and_then(finite);
        let model = finite(model);
        let difference_percent = measured.zip(model).and_then(|(e, m)| finite(100.0 * (m - e) / e));
        Self { measured, model, difference_percent }
    }
}

/// One depth.
#[derive(Clone, Debug, Serialize)]
pub struct DepthNumbers {
    /// Depth, mm.
    pub depth_mm: f64,
    /// Normal force, N: kinetic.
    pub normal_force_n: Comparison,
    /// Contact area, mm²: kinetic.
    pub contact_area_mm2: Comparison,
    /// Kinetic friction over normal force.
    pub friction_coefficient: Comparison,
    /// The friction law integrated over the frictionless pressure, over the normal force.
    pub frictionless_friction_coefficient: Option<f64>,
    /// (kinetic - frictionless estimate) / frictionless estimate, percent.
    pub frictionless_difference_percent: Option<f64>,
    /// Normal force at the end of the press, before any slide, N.
    pub pressed_normal_force_n: Option<f64>,
    /// Slide of the last row, mm.
    pub travel_mm: Option<f64>,
    /// Slide above which the contact slips as a whole, to the last row, mm; null if it never does.
    pub full_slip_travel_mm: Option<f64>,
    /// Stick ratio of the last row.
    pub final_stick_ratio: Option<f64>,
    /// Friction of the last row over its normal force.
    pub final_friction_coefficient: Option<f64>,
    /// Largest friction along the slide, N.
    pub peak_friction_n: Option<f64>,
    /// Cost of the run.
    pub cost: Cost,
    /// Work of the run.
    pub work: Work,
    /// The maps that are shown.
    pub maps: Vec<MapNumbers>,
    /// The press, as drawn.
    pub press: Vec<PressPoint>,
    /// The slide, as drawn.
    pub slide: Vec<SlidePoint>,
}

/// One row of the press.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PressPoint {
    /// Depth, mm.
    pub depth_mm: f64,
    /// Normal force, N.
    pub normal_force_n: Option<f64>,
    /// Contact area, mm².
    pub contact_area_mm2: Option<f64>,
}

/// One row of the slide.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SlidePoint {
    /// Distance from the start of the slide, mm.
    pub travel_mm: f64,
    /// Friction along the slide, N.
    pub friction_n: Option<f64>,
    /// Friction over normal force.
    pub friction_coefficient: Option<f64>,
    /// Normal force, N.
    pub normal_force_n: Option<f64>,
    /// Stuck area over contact area.
    pub stick_ratio: Option<f64>,
    /// Contact area, mm².
    pub contact_area_mm2: Option<f64>,
}

/// One column of the maps.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct MapNumbers {
    /// Slide, mm.
    pub travel_mm: f64,
    /// Largest face pressure, kPa.
    pub peak_pressure_kpa: Option<f64>,
    /// Normal force over contact area, kPa.
    pub mean_pressure_kpa: Option<f64>,
    /// Contact area, mm².
    pub contact_area_mm2: Option<f64>,
    /// Stuck area over contact area.
    pub stick_ratio: Option<f64>,
}

impl Numbers {
    /// Reads them off the results.
    pub fn of(report: &BuildReport) -> Self {
        let depths: Vec<_> = report.depths.iter().map(DepthNumbers::of).collect();
        let range =
            |of: fn(&DepthNumbers) -> &Comparison| range(depths.iter().filter_map(|d| of(d).difference_percent));
        Self {
            total_wall_s: report.provenance.stages.iter().map(|s| s.wall_s).sum(),
            total_cpu_s: report.provenance.stages.iter().map(|s| s.cpu_s).sum(),
            provenance: report.provenance.clone(),
            paper_fit: PaperFit { coefficient: 1.13, exponent: -1.0 / 3.0 },
            difference_percent: Differences {
                normal_force: range(|d| &d.normal_force_n),
                contact_area: range(|d| &d.contact_area_mm2),
                friction_coefficient: range(|d| &d.friction_coefficient),
            },
            force_secants: depths.windows(2).map(Secant::of).collect(),
            depths,
            continuous: report.continuous.clone(),
            checks: report.checks.clone(),
            left_out: report.left_out.clone(),
            reduced: ReducedNumbers::of(report),
        }
    }
}

impl DepthNumbers {
    fn of(result: &DepthResult) -> Self {
        let (press, slide) = split(&result.trajectory.responses);
        let slide = slide_points(slide);
        let measured = result.measured;
        let friction = result.kinetic.friction_coefficient;
        let estimate = result.frictionless_friction_coefficient.and_then(finite);
        let last = slide.last();
        Self {
            depth_mm: result.depth_mm,
            normal_force_n: Comparison::of(measured.map(|m| m.normal_force_n), result.kinetic.normal_force_n),
            contact_area_mm2: Comparison::of(measured.map(|m| m.contact_area_mm2), result.kinetic.contact_area_mm2),
            friction_coefficient: Comparison::of(measured.map(|m| m.friction_coefficient), friction),
            frictionless_friction_coefficient: estimate,
            frictionless_difference_percent: estimate.and_then(|e| finite(100.0 * (friction - e) / e)),
            pressed_normal_force_n: press.last().and_then(|r| finite(r.normal_force_n)),
            travel_mm: last.map(|p| p.travel_mm),
            full_slip_travel_mm: full_slip(&slide),
            final_stick_ratio: last.and_then(|p| p.stick_ratio),
            final_friction_coefficient: last.and_then(|p| p.friction_coefficient),
            peak_friction_n: range(slide.iter().filter_map(|p| p.friction_n)).map(|r| r.max),
            cost: result.trajectory.cost,
            work: result.trajectory.work,
            maps: map_snapshots(result).into_iter().map(MapNumbers::of).collect(),
            press: press.iter().filter(|r| r.depth_mm.is_finite()).map(PressPoint::of).collect(),
            slide,
        }
    }
}

impl PressPoint {
    fn of(r: &Response) -> Self {
        Self {
            depth_mm: r.depth_mm,
            normal_force_n: finite(r.normal_force_n),
            contact_area_mm2: finite(r.contact_area_mm2),
        }
    }
}

impl MapNumbers {
    fn of(snapshot: &Snapshot) -> Self {
        let r = &snapshot.response;
        let peak = range(snapshot.faces.iter().map(|f| f.pressure_mpa)).map(|r| 1e3 * r.max);
        Self {
            travel_mm: r.slide_x_mm.hypot(r.slide_y_mm),
            peak_pressure_kpa: peak,
            mean_pressure_kpa: finite(1e3 * r.normal_force_n / r.contact_area_mm2),
            contact_area_mm2: finite(r.contact_area_mm2),
            stick_ratio: finite(r.stick_ratio),
        }
    }
}

/// The snapshots of the slide whose maps are shown, in the order of their slide.
pub fn map_snapshots(result: &DepthResult) -> Vec<&Snapshot> {
    let travel = |s: &Snapshot| s.response.slide_x_mm.hypot(s.response.slide_y_mm);
    let at_depth = |s: &&Snapshot| (s.response.depth_mm - result.depth_mm).abs() < 0.02 && travel(s).is_finite();
    let mut all: Vec<_> = result.trajectory.snapshots.iter().filter(at_depth).collect();
    all.sort_by(|a, b| travel(a).total_cmp(&travel(b)));
    if all.len() <= MAP_SLIDES_MM.len() {
        return all;
    }
    let off = |s: &Snapshot, slide: f64| (travel(s) - slide).abs();
    let nearest =
        |slide: f64| (0..all.len()).min_by(|i, j| off(all[*i], slide).total_cmp(&off(all[*j], slide))).unwrap_or(0);
    let mut picked: Vec<_> = MAP_SLIDES_MM.iter().map(|slide| nearest(*slide)).collect();
    picked.dedup();
    picked.into_iter().map(|i| all[i]).collect()
}

/// The rows up to the first slide, and the rest (the last row of the press starts the slide).
fn split(responses: &[Response]) -> (&[Response], &[Response]) {
    match responses.iter().position(|r| r.slide_x_mm.hypot(r.slide_y_mm) > 1e-9) {
        Some(i) => (&responses[..i], &responses[i.saturating_sub(1)..]),
        None => (responses, &[]),
    }
}

fn slide_points(rows: &[Response]) -> Vec<SlidePoint> {
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return Vec::new() };
    let (dx, dy) = (last.slide_x_mm - first.slide_x_mm, last.slide_y_mm - first.slide_y_mm);
    let length = dx.hypot(dy);
    let (dx, dy) = if length > 0.0 { (dx / length, dy / length) } else { (1.0, 0.0) };
    let point = |r: &Response| {
        let friction = r.friction_x_n * dx + r.friction_y_n * dy;
        SlidePoint {
            travel_mm: (r.slide_x_mm - first.slide_x_mm).hypot(r.slide_y_mm - first.slide_y_mm),
            friction_n: finite(friction),
            friction_coefficient: finite(friction / r.normal_force_n),
            normal_force_n: finite(r.normal_force_n),
            stick_ratio: finite(r.stick_ratio),
            contact_area_mm2: finite(r.contact_area_mm2),
        }
    };
    rows.iter().map(point).filter(|p| p.travel_mm.is_finite()).collect()
}

/// Travel of the first of the rows at the end that all slip; none if the last row still sticks somewhere.
fn full_slip(slide: &[SlidePoint]) -> Option<f64> {
    let slips = |p: &&SlidePoint| p.stick_ratio.is_some_and(|s| s <= FULL_SLIP) && p.contact_area_mm2 > Some(0.0);
    slide.iter().rev().take_while(slips).last().map(|p| p.travel_mm)
}

/// Smallest and largest finite value.
pub fn range(values: impl Iterator<Item = f64>) -> Option<Range> {
    values.filter(|v| v.is_finite()).fold(None, |range: Option<Range>, v| {
        Some(range.map_or(Range { min: v, max: v }, |r| Range { min: r.min.min(v), max: r.max.max(v) }))
    })
}

fn finite(v: f64) -> Option<f64> {
    v.is_finite().then_some(v)
}

/// A number with so many decimals and a real minus sign; a dash if it is not finite.
pub fn fixed(v: f64, decimals: usize) -> String {
    if !v.is_finite() {
        return "–".to_owned();
    }
    let text = format!("{v:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.bytes().all(|b| matches!(b, b'0' | b'.')) => digits.to_owned(),
        Some(digits) => format!("−{digits}"),
        None => text,
    }
}

/// As [`fixed`], with a sign in front of positive numbers too.
pub fn signed(v: f64, decimals: usize) -> String {
    let text = fixed(v, decimals);
    if v > 0.0 && text.bytes().any(|b| matches!(b, b'1'..=b'9')) { format!("+{text}") } else { text }
}

/// A number with so many significant digits, in powers of ten where plain digits would be many.
pub fn significant(v: f64, digits: usize) -> String {
    if !v.is_finite() {
        return "–".to_owned();
    }
    if v == 0.0 {
        return "0".to_owned();
    }
    let exponent = v.abs().log10().floor() as i32;
    if exponent >= -3 && v.abs() < 1e6 {
        return fixed(v, (digits as i32 - 1 - exponent).max(0) as usize);
    }
    format!("{:.*e}", digits.saturating_sub(1), v).replace("e-", "e−").replacen('-', "−", 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_for_readers() {
        assert_eq!(fixed(-1.26, 1), "−1.3");
        assert_eq!(fixed(-0.01, 1), "0.0");
        assert_eq!(fixed(f64::NAN, 1), "–");
        assert_eq!(signed(3.21, 1), "+3.2");
        assert_eq!(signed(0.01, 1), "0.0");
        assert_eq!(significant(0.086, 3), "0.0860");
        assert_eq!(significant(12345.6, 3), "12346");
        assert_eq!(significant(-2.5e-8, 2), "−2.5e−8");
        assert_eq!(significant(0.0, 3), "0");
    }

    #[test]
    fn full_slip_needs_every_row_to_the_end() {
        let point = |travel_mm, stick: f64| SlidePoint {
            travel_mm,
            friction_n: None,
            friction_coefficient: None,
            normal_force_n: None,
            stick_ratio: finite(stick),
            contact_area_mm2: Some(1.0),
        };
        let slips = [point(0.0, 1.0), point(1.0, 0.0), point(2.0, 0.3), point(3.0, 0.01), point(4.0, 0.0)];
        assert_eq!(full_slip(&slips), Some(3.0));
        assert_eq!(full_slip(&slips[..3]), None);
        assert_eq!(full_slip(&[]), None);
        assert_eq!(full_slip(&[point(0.0, f64::NAN)]), None);
    }
}
