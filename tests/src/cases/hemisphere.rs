//! The silicone fingertip by both routes: structured hexahedra, and the tetrahedra that Gmsh made of its CAD file.

use std::ops::ControlFlow;
use std::path::Path as FilePath;

use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{Drive, Finger, Path, Response, Turn, Turns, Waypoint, follow_path};
use fingerpad_fe::mesh::{Divisions, MeshPreset, fingertip};

use super::{Effort, Failure};
use crate::Check;

/// Time, depth, slides along x and y (mm), spin (degrees): a press, a slide, a reversal of 1 um and the slide back;
/// then a spin and a slide across.
const CORNERS: [[f64; 5]; 7] = [
    [0.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 1.0, 0.0, 0.0, 0.0],
    [3.0, 1.0, 2.0, 0.0, 0.0],
    [3.1, 1.0, 1.999, 0.0, 0.0],
    [4.0, 1.0, 1.5, 0.0, 0.0],
    [5.0, 1.0, 1.5, 0.0, 10.0],
    [6.0, 1.0, 1.5, 0.5, 10.0],
];
/// Bounds on the difference of the two, shares; friction's over that of full slip.
struct Bounds {
    force: f64,
    area: f64,
    moment: f64,
}

/// The hexahedra's mesh `default` has larger contact areas than `fine`, by 1.5 % at 1 mm.
const AS_SHIPPED: Bounds = Bounds { force: 0.01, area: 0.015, moment: 0.025 };
const FINER: Bounds = Bounds { force: 0.01, area: 0.01, moment: 0.01 };

/// Normal force, friction, area and moment of the two along one path; friction and moment as shares of their values in
/// full slip.
///
/// Quick: without the spin, so that half of the hexahedra suffices. In full also with the hexahedra's pad halved once
/// more and more tetrahedra.
pub fn hemisphere(effort: Effort) -> Result<Vec<Check>, Failure> {
    let corners = if effort == Effort::Quick { &CORNERS[..5] } else { &CORNERS };
    let path = path(corners);
    let data = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("../data");
    let by_hexes = Config { mesh_preset: MeshPreset::Default, ..Config::read(&data.join("silicone.toml"))? };
    let by_tets = |file: &str| Config::read(&data.join("geometry/hemisphere").join(file));
    let hexes = along(&by_hexes, &by_hexes.finger_for(&[&path])?.0, &path)?;
    let coarse = by_tets("tets.toml")?;
    let tets = along(&coarse, &coarse.finger_for(&[&path])?.0, &path)?;
    let mut checks = compared("hemisphere", &hexes, &tets, &AS_SHIPPED);
    if effort == Effort::Full {
        let divisions = Divisions { pad_refinement: 2, ..MeshPreset::Default.divisions() };
        let finger = Finger::new(fingertip(&by_hexes.fingertip_shape()?, &divisions)?, &by_hexes.tissue)?;
        let hexes = along(&by_hexes, &finger, &path)?;
        let fine = by_tets("tets-fine.toml")?;
        let tets = along(&fine, &fine.finger_for(&[&path])?.0, &path)?;
        checks.extend(compared("finer hemisphere", &hexes, &tets, &FINER));
    }
    Ok(checks)
}

/// Responses at the corners, compared.
fn compared(name: &str, hexes: &[Response], tets: &[Response], bounds: &Bounds) -> Vec<Check> {
    let mut checks = Vec::new();
    let slip_n = hexes[2].friction_x_n;
    for (corner, (hexes, tets)) in hexes.iter().zip(tets).enumerate().skip(1) {
        let at = |what: &str| format!("{name}, corner {corner}: {what} by tetrahedra, by hexahedra");
        let relative = |what: &str, tets, hexes, bound| Check::relative(at(what), tets, hexes, bound);
        checks.push(relative("normal force (N)", tets.normal_force_n, hexes.normal_force_n, bounds.force));
        checks.push(relative("contact area (mm2)", tets.contact_area_mm2, hexes.contact_area_mm2, bounds.area));
        let absolute = |what: &str, tets, hexes, bound| Check::absolute(at(what), tets, hexes, bound);
        checks.push(absolute("friction x (N)", tets.friction_x_n, hexes.friction_x_n, bounds.force * slip_n));
        checks.push(absolute("friction y (N)", tets.friction_y_n, hexes.friction_y_n, bounds.force * slip_n));
        if corner > 4 {
            let [tets, hexes] = [tets, hexes].map(|r| r.moment_n_mm[2]);
            checks.push(relative("spin moment (N mm)", tets, hexes, bounds.moment));
        }
    }
    checks
}

fn path(corners: &[[f64; 5]]) -> Path {
    let waypoints = corners.iter().map(|&[t_s, normal, x, y, _]| Waypoint { t_s, normal, x, y }).collect();
    let mut path = Path::new([Drive::Displacement; 3], waypoints);
    if corners.iter().any(|corner| corner[4] != 0.0) {
        let values = corners.iter().map(|corner| corner[4]).collect();
        path.turns = Turns { spin: Some(Turn { drive: Drive::Displacement, values }), ..Turns::default() };
    }
    path
}

/// Responses at the corners of `path`.
fn along(config: &Config, finger: &Finger, path: &Path) -> Result<Vec<Response>, Failure> {
    let run = follow_path(&config.problem(finger), path, &[], &mut |_| ControlFlow::Continue(()))?;
    let at = |corner: &Waypoint| run.responses.iter().rfind(|r| r.t_s <= corner.t_s + 1e-9).copied();
    Ok(path.waypoints.iter().map(|corner| at(corner).expect("the start is recorded")).collect())
}
