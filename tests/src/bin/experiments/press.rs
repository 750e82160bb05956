//! Experiments with a press: area and friction over the load, force over the depth, Table 1 of Yoshida et al.

use fingerpad_fe::experiment::RigidBodySettings;
use fingerpad_tests::problems::fingers::{at_corner, placed};

use super::Finding;
use super::lab::{Failure, Lab, at, chart, depths_mm, dots, exponent, friction_n, line};

/// Deepest press of the finger that ships, mm: 14 N, just before the bone.
const DEEPEST_MM: f64 = 6.3;

/// Area and friction up to 10 N.
pub fn load(lab: &Lab) -> Result<Finding, Failure> {
    let presses = lab.press(&RigidBodySettings::default(), &depths_mm(DEEPEST_MM, 40))?;
    let area: Vec<[f64; 2]> = presses.iter().map(|p| [p.normal_force_n, p.contact_area_mm2]).collect();
    let coefficient: Vec<[f64; 2]> =
        presses.iter().map(|p| [p.normal_force_n, p.friction_limit_n / p.normal_force_n]).collect();
    let ratio = at(&area, 1.0) / at(&area, 10.0);
    let (light, heavy) = (exponent(&area, [0.1, 0.5]), exponent(&area, [1.0, 10.0]));
    let falls = exponent(&coefficient, [1.0, 10.0]);
    let log = |points: &[[f64; 2]]| points.iter().map(|p| p.map(f64::log10)).collect::<Vec<_>>();
    let published = |n: f64| (at(&area, 1.0) * n.powf(0.222)).log10();
    let mut charts = vec![
        chart(
            "Contact area",
            ["log10 of normal force (N)", "log10 of area (mm²)"],
            vec![
                line("finite elements", log(&area)),
                line("published ratio, through 1 N", vec![[0.0, published(1.0)], [1.0, published(10.0)]]),
            ],
        ),
        chart(
            "Coefficient of friction",
            ["log10 of normal force (N)", "log10 of F/N"],
            vec![line("finite elements", log(&coefficient))],
        ),
    ];
    charts.iter_mut().for_each(|chart| chart.least = [f64::NAN; 2]);
    Ok(Finding {
        title: "Area and friction against load to 10 N",
        source: "Serina et al. 1997/98, as quoted in later literature (area); Seo et al. 2009, Ergonomics 52:609 (friction)",
        published: "area at 1 N over that at 10 N: 0.60, that is an exponent of 0.22 between; the coefficient of friction falls by \
                    46 % from 1 to 20 N, that is with an exponent of -0.21",
        found: format!(
            "area at 1 N over that at 10 N: {ratio:.2}; exponents of the area {light:.2} from 0.1 to 0.5 N and {heavy:.2} from 1 to \
             10 N; exponent of the coefficient of friction {falls:.2} from 1 to 10 N"
        ),
        verdict: format!(
            "area ratio {} by {:+.2}; exponent of friction off by {:+.2}",
            if (ratio - 0.60).abs() < 0.05 { "inside" } else { "outside" },
            ratio - 0.60,
            falls + 0.206
        ),
        remark: "Friction is the integral of the published law over the pressure of a press without friction. Tissue that stiffens \
                 more would limit the area at 10 N.".into(),
        charts,
    })
}

/// Force against indentation to 5 N.
pub fn indentation(lab: &Lab) -> Result<Finding, Failure> {
    let presses = lab.press(&RigidBodySettings::default(), &depths_mm(DEEPEST_MM, 40))?;
    let force: Vec<[f64; 2]> = presses.iter().map(|p| [p.depth_mm, p.normal_force_n]).collect();
    let depth: Vec<[f64; 2]> = force.iter().map(|&[d, n]| [n, d]).collect();
    let used = at(&depth, 1.0) / at(&depth, 5.2);
    // The exponential of Pawluk and Howe, fitted from 0 to 2 N.
    let light: Vec<[f64; 2]> = force.iter().copied().filter(|p| p[1] <= 2.0).collect();
    let (scale, rate, worst) = exponential(&light);
    let stiffness = |n: f64| {
        let d = [0.95, 1.05].map(|f| at(&depth, f * n));
        0.1 * n / (d[1] - d[0])
    };
    Ok(Finding {
        title: "Force against indentation to 5 N",
        source: "Serina, Mote and Rempel 1997, J. Biomech. 30:1035, as quoted in later literature; Pawluk and Howe 1999, \
                 J. Biomech. Eng. 121:178 and 605",
        published: "about 82 % of the displacement at 5.2 N is used below 1 N; from 0 to 2 N the force is exponential in the \
                    displacement; 2 N displace the pulp by more than 3 mm",
        found: format!(
            "{:.0} % of the displacement at 5.2 N is used below 1 N; the best exponential from 0 to 2 N deviates by up to {:.0} % of 2 N; 2 N \
             at {:.1} mm; stiffness {:.2} N/mm at 1 N and {:.1} N/mm at 4 N",
            100.0 * used,
            100.0 * worst / 2.0,
            at(&depth, 2.0),
            stiffness(1.0),
            stiffness(4.0)
        ),
        verdict: format!(
            "shape of the first 2 N inside (exponential within {:.0} %); stiffening outside: the displacement below 1 N is {:.0} \
             percentage points too small",
            100.0 * worst / 2.0,
            82.0 - 100.0 * used
        ),
        remark: "The Ogden constants were published for 0.1 to 0.5 N. An exponent of 1.4 hardly stiffens. The stiffening here is \
                 geometric: the pulp is compressed against the bone.".into(),
        charts: vec![chart(
            "Force against indentation",
            ["depth (mm)", "normal force (N)"],
            vec![
                line("finite elements", force.clone()),
                line(
                    "exponential, fitted to 2 N",
                    light.iter().map(|p| [p[0], scale * ((rate * p[0]).exp() - 1.0)]).collect(),
                ),
            ],
        )],
    })
}

/// Scale and rate of the best `scale (exp(rate d) - 1)`, and its largest error.
fn exponential(points: &[[f64; 2]]) -> (f64, f64, f64) {
    let of_rate = |rate: f64| {
        let shape = |d: f64| (rate * d).exp() - 1.0;
        let scale = points.iter().map(|p| p[1] * shape(p[0])).sum::<f64>()
            / points.iter().map(|p| shape(p[0]).powi(2)).sum::<f64>();
        let worst = points.iter().map(|p| (p[1] - scale * shape(p[0])).abs()).fold(0.0, f64::max);
        (scale, rate, worst)
    };
    let rates = (1..=300).map(|k| f64::from(k) * 0.01);
    rates.map(of_rate).min_by(|a, b| a.2.total_cmp(&b.2)).expect("there are rates")
}

/// Table 1: depth, mm; normal force, N; coefficient of friction; area, mm².
const TABLE: [[f64; 4]; 4] =
    [[0.75, 0.120, 2.46, 49.4], [1.00, 0.198, 2.00, 62.8], [1.25, 0.384, 1.53, 83.2], [1.50, 0.454, 1.42, 97.7]];

/// Table 1 of Yoshida et al.
pub fn table(lab: &Lab) -> Result<Finding, Failure> {
    let [lambda, beta] = lab.law();
    let mut rows = Vec::new();
    for [depth, ..] in TABLE {
        let run = lab.follow(&placed(&[[0.0; 3], [depth, 0.0, 0.0], [depth, 6.0, 0.0]]))?;
        let end = at_corner(&run, 2);
        rows.push([depth, end.normal_force_n, friction_n(end) / end.normal_force_n, end.contact_area_mm2]);
    }
    // Jensen's inequality: the strength is concave in the pressure, so that no distribution of it carries more than the
    // uniform one.
    let bound = TABLE.map(|[_, n, mu, area]| (lambda * (n / area).powf(beta - 1.0), mu));
    let above = bound.map(|(bound, mu)| 100.0 * (mu / bound - 1.0));
    let smooth = smooth_press();
    let worst = smooth.iter().map(|e| e.abs()).fold(0.0, f64::max);
    let percent = |values: Vec<f64>| values.iter().map(|v| format!("{v:+.0}")).collect::<Vec<_>>().join(", ");
    let off = |k: usize| percent((0..4).map(|row| 100.0 * (rows[row][k] / TABLE[row][k] - 1.0)).collect());
    let rms = {
        let off: Vec<f64> = (0..4).flat_map(|row| [1, 2, 3].map(|k| rows[row][k] / TABLE[row][k] - 1.0)).collect();
        100.0 * (off.iter().map(|e| e * e).sum::<f64>() / off.len() as f64).sqrt()
    };
    let pick = |table: &[[f64; 4]], k: usize| table.iter().map(|row| [row[0], row[k]]).collect::<Vec<_>>();
    let both = |title: &str, label: &str, k: usize| {
        let traces = vec![line("finite elements", pick(&rows, k)), dots("Table 1", pick(&TABLE, k))];
        chart(title, ["depth (mm)", label], traces)
    };
    Ok(Finding {
        title: "Table 1 of the paper that this project follows",
        source: "Yoshida, Tada and Mochimaru 2011, Mol. Cell. Biomech. 8(1):61-72",
        published: "normal force 0.120, 0.198, 0.384, 0.454 N; F/N 2.46, 2.00, 1.53, 1.42; area 49.4, 62.8, 83.2, 97.7 mm² at 0.75, 1.00, \
                    1.25, 1.50 mm",
        found: format!(
            "normal force {} %, F/N {} %, area {} % off; RMS of all twelve {rms:.0} %",
            off(1),
            off(2),
            off(3)
        ),
        verdict: format!("outside by {rms:.0} % RMS; two of the causes are in the table, see below"),
        remark: format!(
            "Two facts do not depend on the finite elements. First, the strength of the published law is concave in the pressure. By \
             Jensen's inequality no distribution of pressure gives more than F/N = lambda (N/A)^(beta - 1). With the measured N and A this \
             bound is {}; the measured values differ from it by {} %. Second, no smooth finger fits the normal forces: the best \
             c (depth - d0)^n deviates by {} %, so the table itself contains an error of {worst:.0} %.",
            bound.map(|(bound, _)| format!("{bound:.2}")).join(", "),
            percent(above.to_vec()),
            percent(smooth.to_vec()),
        ),
        charts: vec![
            both("Normal force", "N", 1),
            both("Coefficient of friction", "F/N", 2),
            both("Contact area", "mm²", 3),
        ],
    })
}

/// Relative errors of the best `c (depth - d0)^n` in the normal forces of Table 1, percent: that with the least sum of squares.
fn smooth_press() -> [f64; 4] {
    let mut best = (f64::INFINITY, [0.0; 4]);
    for zero in (-300..70).map(|k| f64::from(k) * 0.01) {
        // A straight line in logarithms.
        let points = TABLE.map(|[d, n, ..]| [(d - zero).ln(), n.ln()]);
        let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / 4.0);
        let slope = points.iter().map(|p| (p[0] - mean[0]) * (p[1] - mean[1])).sum::<f64>()
            / points.iter().map(|p| (p[0] - mean[0]).powi(2)).sum::<f64>();
        let errors = points.map(|p| 100.0 * ((mean[1] + slope * (p[0] - mean[0]) - p[1]).exp() - 1.0));
        let sum = errors.iter().map(|e| e * e).sum::<f64>();
        if sum < best.0 {
            best = (sum, errors);
        }
    }
    best.1
}
