//! `simulate`: the body of the flags is the body of the run; probes and reactions have a row for every row of the response.

use crate::common::Folder;

const PRESS: &str = "t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0,0\n1,0.8,0,0\n";

#[test]
fn rounder_bodies_press_less_and_a_hollow_more() {
    let folder = Folder::with(&[("p.csv", PRESS)]);
    let end = |body: &str| {
        folder.done(&format!("simulate --path p.csv --mesh-preset coarse --out r.csv --force {body}"));
        ["normal_force_n", "contact_area_mm2"].map(|name| folder.last("r.csv", name))
    };
    let plane = end("");
    let sphere = end("--body sphere --radius-mm 10");
    let cylinder = end("--body cylinder --radius-mm 10 --axis-deg 90");
    let bowl = end("--body sphere --radius-mm -80");
    for k in 0..2 {
        assert!(
            [sphere, cylinder, plane, bowl].is_sorted_by(|a, b| a[k] < b[k]),
            "{sphere:?} {cylinder:?} {plane:?} {bowl:?}"
        );
    }
    // A flat field of heights is the plane; the section of a configuration is the flag.
    let flat: String = (0..25).map(|k| format!("{},{},0\n", 10 * (k % 5) - 20, 10 * (k / 5) - 20)).collect();
    folder.write("flat.csv", "x_mm,y_mm,height_mm\n".to_owned() + &flat);
    let heights = end("--body flat.csv");
    assert!((0..2).all(|k| (heights[k] / plane[k] - 1.0).abs() < 1e-4), "{heights:?}");
    folder.write("c.toml", "[rigid_body]\nkind = \"sphere\"\nradius_mm = 10.0\n");
    assert_eq!(end("--config c.toml"), sphere);
}

#[test]
fn probes_and_reactions_go_with_the_response() {
    let path = "t_s,depth_mm,slide_x_mm,slide_y_mm\n0,0,0,0\n1,0.6,0,0\n2,0.6,0.4,0\n3,0.6,0.2,0\n";
    let points = "probe,x_mm,y_mm,below_skin_mm\nmiddle,0,0,0.7\nside,0,6,0.7\n";
    // A sideways force beyond friction ends the run.
    let pulled = "t_s,depth_mm,friction_x_n,slide_y_mm\n0,0,0,0\n1,0.6,0,0\n2,0.6,5,0\n";
    let folder = Folder::with(&[("p.csv", path), ("points.csv", points), ("pulled.csv", pulled)]);
    let line = |path: &str, probe: &str| {
        format!(
            "simulate --path {path} --mesh-preset coarse --out out.csv --force --probe {probe} --probe-out strain.csv --reactions held.csv"
        )
    };
    folder.done(&line("p.csv", "points.csv"));
    let times = folder.column("out.csv", "t_s");
    assert_eq!(folder.column("held.csv", "t_s"), times);
    let normal = folder.column("out.csv", "normal_force_n");
    let held = ["nail", "bone", "section"].map(|h| folder.column("held.csv", &format!("{h}_force_z_n")));
    for (row, normal) in normal.iter().enumerate() {
        let held: f64 = held.iter().map(|column| column[row]).sum();
        assert!((held + normal).abs() < 2e-3 * normal.max(0.01), "row {row}: {held} for {normal}");
    }
    let names = folder.cells("strain.csv", "probe");
    assert_eq!(names.len(), 2 * times.len());
    assert!(names.chunks(2).all(|pair| pair == ["middle", "side"]));
    // The press squeezes the tissue above the contact more than that at its side; rates are slopes.
    let least = folder.column("strain.csv", "strain_least");
    let end = least.len() - 2;
    assert!(least[end] < -0.05 && least[end] < 1.5 * least[end + 1], "{} {}", least[end], least[end + 1]);
    let energy = folder.column("strain.csv", "strain_energy_density_mpa");
    let rate = folder.column("strain.csv", "strain_energy_density_rate_mpa_per_s");
    let t = folder.column("strain.csv", "t_s");
    for row in 2..t.len() {
        let slope = (energy[row] - energy[row - 2]) / (t[row] - t[row - 2]);
        assert!((rate[row] - slope).abs() <= 1e-9 * slope.abs().max(1e-6), "row {row}: {} for {slope}", rate[row]);
    }

    folder.done(&line("p.csv", "papillae:0.7"));
    let probes = folder.cells("strain.csv", "probe").len() / times.len();
    assert!((50..500).contains(&probes), "{probes}");

    // A run that ends early writes its rows under other names and leaves the files of the complete run unchanged.
    let whole = ["strain.csv", "held.csv"].map(|file| folder.bytes(file));
    assert_ne!(folder.run(&line("pulled.csv", "papillae:0.7")).0, Some(0));
    assert_eq!(["strain.csv", "held.csv"].map(|file| folder.bytes(file)), whole);
    assert_eq!(folder.column("held.partial.csv", "t_s"), folder.column("out.partial.csv", "t_s"));
    assert!(folder.exists("strain.partial.csv"));
}
