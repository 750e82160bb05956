//! Experiments with a press: area and friction over the load, force over the depth, Table 1 of Yoshida et al.

use fingerpad_fe::load_path::PressLimit;
use fingerpad_tests::problems::fingers::{at_corner, placed};

use super::Finding;
use super::lab::{Failure, Lab, Line, at, chart, dots, exponent, friction_n, line};

/// Area at 1, 2 and 5 N over that at 10 N; the published ratio at 1 N is 0.60, an exponent of 0.22.
pub fn area_lines(presses: &[PressLimit]) -> Vec<Line> {
    let area: Vec<[f64; 2]> = presses.iter().map(|p| [p.normal_force_n, p.contact_area_mm2]).collect();
    let ratio = |force_n: f64| {
        let published = (0.1 * force_n).powf(0.22);
        let name = format!("area at {force_n} N over that at 10 N");
        Line::new(name, 2, at(&area, force_n) / at(&area, 10.0), [published - 0.05, published + 0.05]).fitted()
    };
    [1.0, 2.0, 5.0].map(ratio).into()
}

/// Where the force rises along the depth.
pub fn depth_lines(presses: &[PressLimit]) -> Vec<Line> {
    let depth: Vec<[f64; 2]> = presses.iter().map(|p| [p.normal_force_n, p.depth_mm]).collect();
    let share = 100.0 * at(&depth, 1.0) / at(&depth, 5.2);
    vec![
        Line::new("displacement at 1 N over that at 5.2 N, %", 0, share, [72.0, 92.0]).fitted(),
        Line::new("displacement at 2 N, mm", 2, at(&depth, 2.0), [3.0, 5.0]).fitted(),
    ]
}

/// How the coefficient of friction falls with the load.
pub fn friction_line(presses: &[PressLimit]) -> Line {
    let points = coefficient(presses);
    Line::new("exponent of F/N from 1 to 10 N", 2, exponent(&points, [1.0, 10.0]), [-0.26, -0.16]).fitted()
}

/// Coefficient of friction over the normal force, N.
fn coefficient(presses: &[PressLimit]) -> Vec<[f64; 2]> {
    presses.iter().map(|p| [p.normal_force_n, p.friction_limit_n / p.normal_force_n]).collect()
}

/// Area and friction up to 10 N.
pub fn load(lab: &Lab) -> Result<Finding, Failure> {
    let presses = lab.deep_press()?;
    let area: Vec<[f64; 2]> = presses.iter().map(|p| [p.normal_force_n, p.contact_area_mm2]).collect();
    let mut lines = area_lines(&presses);
    lines.push(friction_line(&presses));
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
            vec![line("finite elements", log(&coefficient(&presses)))],
        ),
    ];
    charts.iter_mut().for_each(|chart| chart.least = [f64::NAN; 2]);
    Ok(Finding {
        title: "Area and friction against load to 10 N",
        source: "Serina et al. 1997/98, as quoted in later literature (area); Seo et al. 2009, Ergonomics 52:609 (friction)",
        published: "area at 1 N over that at 10 N: 0.60, that is an exponent of 0.22 between; the coefficient of friction falls by \
                    46 % from 1 to 20 N, that is with an exponent of -0.21",
        lines,
        remark: "Friction is the integral of the published law over the pressure of a press without friction. Tissue that stiffens \
                 more would limit the area at 10 N.".into(),
        charts,
    })
}

/// Force against indentation to 5 N.
pub fn indentation(lab: &Lab) -> Result<Finding, Failure> {
    let presses = lab.deep_press()?;
    let force: Vec<[f64; 2]> = presses.iter().map(|p| [p.depth_mm, p.normal_force_n]).collect();
    // The exponential of Pawluk and Howe, fitted from 0 to 2 N.
    let light: Vec<[f64; 2]> = force.iter().copied().filter(|p| p[1] <= 2.0).collect();
    let (scale, rate, worst) = exponential(&light);
    let mut lines = depth_lines(&presses);
    lines.push(Line::new("distance from the best exponential up to 2 N, % of 2 N", 0, 50.0 * worst, [0.0, 5.0]));
    Ok(Finding {
        title: "Force against indentation to 5 N",
        source: "Serina, Mote and Rempel 1997, J. Biomech. 30:1035, as quoted in later literature; Pawluk and Howe 1999, \
                 J. Biomech. Eng. 121:178 and 605",
        published: "about 82 % of the displacement at 5.2 N is used below 1 N; from 0 to 2 N the force is exponential in the \
                    displacement; 2 N displace the pulp by more than 3 mm",
        lines,
        remark: "The paper's Ogden constants were published for 0.1 to 0.5 N. With its exponent of 1.4 stiffening is geometric: the \
                 pulp is compressed against the bone.".into(),
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
    let rms = |k: usize| {
        let squares = (0..4).map(|row| (rows[row][k] / TABLE[row][k] - 1.0).powi(2));
        100.0 * (squares.sum::<f64>() / 4.0).sqrt()
    };
    let lines = [("normal force", 1), ("F/N", 2), ("area", 3)]
        .map(|(name, k)| Line::new(format!("{name}, % off (RMS of four)"), 0, rms(k), [0.0, 12.0]));
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
        lines: lines.into(),
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
