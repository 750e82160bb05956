//! Difference of the smooth model from the core's own step along strokes like those of a measured set.

use fingerpad::host::ModelFile;
use fingerpad::{Effects, Surroundings};
use fingerpad_smooth::{ReferenceCurves, Sample, SmoothModel, Stroke, export_to_core, replay_stroke, simulate};

/// A press to a depth, a slide of 3 mm in a direction, and half of it back.
fn stroke(depth_mm: f64, angle_deg: f64) -> Stroke {
    let (s, c) = angle_deg.to_radians().sin_cos();
    let mut samples = Vec::new();
    let mut t_s = 0.0;
    let mut push = |depth_mm: f64, way_mm: f64, sign: f64| {
        t_s += 0.05;
        let (x, y) = (sign * c, sign * s);
        samples.push(Sample {
            t_s,
            depth_mm,
            slide_mm: [way_mm * x, way_mm * y],
            double_angle: [x * x - y * y, 2.0 * x * y],
            direction: [x, y],
            surroundings: Surroundings::default(),
        });
    };
    (1..=8).for_each(|k| push(depth_mm * f64::from(k) / 8.0, 0.0, 1.0));
    (0..40).for_each(|_| push(depth_mm, 0.075, 1.0));
    (0..40).for_each(|_| push(depth_mm, 0.0375, -1.0));
    Stroke { start_s: 0.0, samples, time_constant_s: 0.0 }
}

/// Root mean square and largest difference over all samples, per cent: normal force over its own largest value, friction
/// over the strength at the depth.
fn difference_percent(model: &SmoothModel, strokes: &[Stroke], other: &[f64]) -> [[f64; 2]; 2] {
    let smooth = simulate(model, strokes);
    let largest = smooth.iter().step_by(3).fold(0.0, |a: f64, n| a.max(*n));
    let samples: Vec<&Sample> = strokes.iter().flat_map(|s| &s.samples).collect();
    let mut out = [[0.0f64; 2]; 2];
    for (i, sample) in samples.iter().enumerate() {
        let d = |k: usize| smooth[3 * i + k] - other[3 * i + k];
        let strength = model.at_depth(sample.depth_mm).strength_n;
        for (sums, e) in out.iter_mut().zip([100.0 * d(0) / largest, 100.0 * d(1).hypot(d(2)) / strength]) {
            sums[0] += e * e / samples.len() as f64;
            sums[1] = sums[1].max(e.abs());
        }
    }
    out.map(|[square, most]| [square.sqrt(), most])
}

#[test]
fn the_smooth_model_stays_near_the_core() {
    let file = ModelFile::new(include_bytes!("../data/models/fingertip.fpm")).unwrap();
    let file = file.file();
    let reference = ReferenceCurves::from_model_data(file.model.data(), true);
    let model = reference.model(&reference.mean);
    let strokes: Vec<Stroke> = [0.4, 0.7, 1.0, 1.3, 1.6, 1.9]
        .into_iter()
        .flat_map(|depth_mm| (0..8).map(move |k| stroke(depth_mm, 45.0 * f64::from(k))))
        .collect();
    let through = |model: &fingerpad::Model<'_>, effects: &Effects<'_>| {
        let mut out = Vec::new();
        strokes.iter().for_each(|stroke| replay_stroke(model, effects, stroke, &mut out));
        out
    };

    let exported = export_to_core(file.model.data(), &model, &strokes).unwrap();
    let exported_model = exported.data.model().unwrap();
    let [normal, friction] =
        difference_percent(&model, &strokes, &through(&exported_model, &Effects::new(&exported.slots).unwrap()));
    println!("exported: normal {normal:.2?} %, friction {friction:.2?} % (root mean square, largest)");
    assert!(normal[0] < 0.11 && normal[1] < 0.7 && friction[0] < 3.0 && friction[1] < 11.5);

    let [normal, friction] = difference_percent(&model, &strokes, &through(&file.model, &Effects::new(&[]).unwrap()));
    println!("file itself: normal {normal:.2?} %, friction {friction:.2?} % (root mean square, largest)");
    assert!(normal[0] < 1.1 && normal[1] < 4.5 && friction[0] < 6.5 && friction[1] < 18.5);
}
