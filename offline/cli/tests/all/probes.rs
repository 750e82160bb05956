//! `simulate --probe` and `--reactions`: a row for every row of the response, consistent numbers, and refusal of
//! invalid probe files.

use std::path::Path;
use std::process::{Command, Output};

fn simulate(folder: &Path, more: &[&str]) -> Output {
    let path = "t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0,0\n1,0.6,0,0\n2,0.6,0.4,0\n3,0.6,0.2,0\n";
    std::fs::write(folder.join("path.csv"), path).unwrap();
    let fixed = ["simulate", "--path", "path.csv", "--mesh-preset", "coarse", "--out", "out.csv", "--force"];
    Command::new(env!("CARGO_BIN_EXE_fingerpad")).current_dir(folder).args(fixed).args(more).output().unwrap()
}

/// A column of a file by its name.
fn column(folder: &Path, file: &str, name: &str) -> Vec<String> {
    let text = std::fs::read_to_string(folder.join(file)).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let at = header.iter().position(|h| h == name).unwrap_or_else(|| panic!("{file}: no {name} in {header:?}"));
    lines.map(|cells| cells[at].clone()).collect()
}

fn numbers(folder: &Path, file: &str, name: &str) -> Vec<f64> {
    column(folder, file, name).iter().map(|cell| cell.parse().unwrap()).collect()
}

#[test]
fn probes_and_reactions_go_with_the_response() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    std::fs::write(folder.join("points.csv"), "probe,x_mm,y_mm,below_skin_mm\nmiddle,0,0,0.7\nside,0,6,0.7\n").unwrap();
    let output = simulate(folder, &["--probe", "points.csv", "--probe-out", "strain.csv", "--reactions", "held.csv"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let times = numbers(folder, "out.csv", "t_s");
    assert_eq!(numbers(folder, "held.csv", "t_s"), times);
    let normal = numbers(folder, "out.csv", "normal_force_n");
    let held = ["nail", "bone", "section"].map(|h| numbers(folder, "held.csv", &format!("{h}_force_z_n")));
    for (row, normal) in normal.iter().enumerate() {
        let held: f64 = held.iter().map(|column| column[row]).sum();
        assert!((held + normal).abs() < 2e-3 * normal.max(0.01), "row {row}: {held} for {normal}");
    }
    let names = column(folder, "strain.csv", "probe");
    assert_eq!(names.len(), 2 * times.len());
    assert!(names.chunks(2).all(|pair| pair == ["middle", "side"]));
    // The press squeezes the tissue above the contact more than that at its side; rates are slopes.
    let least = numbers(folder, "strain.csv", "strain_least");
    let end = least.len() - 2;
    assert!(least[end] < -0.05 && least[end] < 1.5 * least[end + 1], "{} {}", least[end], least[end + 1]);
    let energy = numbers(folder, "strain.csv", "strain_energy_density_mpa");
    let rate = numbers(folder, "strain.csv", "strain_energy_density_rate_mpa_per_s");
    let t = numbers(folder, "strain.csv", "t_s");
    for row in 2..t.len() {
        let slope = (energy[row] - energy[row - 2]) / (t[row] - t[row - 2]);
        assert!((rate[row] - slope).abs() <= 1e-9 * slope.abs().max(1e-6), "row {row}: {} for {slope}", rate[row]);
    }

    let output = simulate(folder, &["--probe", "papillae:0.7", "--probe-out", "strain.csv"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let probes = column(folder, "strain.csv", "probe").len() / times.len();
    assert!((50..500).contains(&probes), "{probes}");
}

#[test]
fn points_that_cannot_be_read_are_refused_with_their_line() {
    let dir = tempfile::tempdir().unwrap();
    for (points, named) in [
        ("x_mm,y_mm,below_skin_mm\n0,0,0.7\n0,60,0.7\n", "points.csv:3: column `x_mm`"),
        ("x_mm,y_mm,below_skin_mm\n0,0,-1\n", "points.csv:2: column `below_skin_mm`"),
        ("x_mm,y_mm,z_mm\n0,0,-3\n", "probe `p000` at (0, 0, -3) mm lies outside"),
        ("x_mm,y_mm\n0,0\n", "`z_mm` or `below_skin_mm`"),
        ("probe,x_mm,y_mm,z_mm\na,0,0,1\na,0,0,2\n", "points.csv:3: probe `a`"),
        ("x_mm,y_mm,z_mm\n0,zero,1\n", "points.csv:2: column `y_mm`"),
    ] {
        std::fs::write(dir.path().join("points.csv"), points).unwrap();
        let output = simulate(dir.path(), &["--probe", "points.csv", "--probe-out", "strain.csv"]);
        let printed = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{points}: {printed}");
        assert!(printed.contains(named), "{points}: {printed}");
    }
    let output = simulate(dir.path(), &["--probe", "papillae:deep", "--probe-out", "strain.csv"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("--probe papillae:deep"));
    let output = simulate(dir.path(), &["--probe", "papillae:0.7"]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("--probe-out"));
}

/// A run that ends early writes its rows under other names and leaves the files of the complete run unchanged.
#[test]
fn a_run_that_ends_early_does_not_replace_a_whole_series() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    let asked = ["--probe", "papillae:0.7", "--probe-out", "strain.csv", "--reactions", "held.csv"];
    assert!(simulate(folder, &asked).status.success());
    let whole = ["strain.csv", "held.csv"].map(|file| std::fs::read(folder.join(file)).unwrap());
    // A sideways force beyond friction ends the run.
    let path = "t_s,depth_mm,friction_x_n,slide_y_mm\n0,0,0,0\n1,0.6,0,0\n2,0.6,5,0\n";
    std::fs::write(folder.join("pulled.csv"), path).unwrap();
    let fixed = ["simulate", "--path", "pulled.csv", "--mesh-preset", "coarse", "--out", "out.csv", "--force"];
    let program = env!("CARGO_BIN_EXE_fingerpad");
    let output = Command::new(program).current_dir(folder).args(fixed).args(asked).output().unwrap();
    assert!(!output.status.success());
    assert_eq!(["strain.csv", "held.csv"].map(|file| std::fs::read(folder.join(file)).unwrap()), whole);
    let rows = numbers(folder, "out.partial.csv", "t_s");
    assert_eq!(numbers(folder, "held.partial.csv", "t_s"), rows);
    assert!(folder.join("strain.partial.csv").exists());
}
