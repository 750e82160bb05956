//! The silicone fingertip by both routes: structured hexahedra, and the tetrahedra that Gmsh made of its CAD file.

use std::ops::ControlFlow;
use std::path::Path as FilePath;

use fingerpad_fe::experiment::Config;
use fingerpad_fe::load_path::{Drive, Path, Response, Turn, Turns, Waypoint, follow_path};
use fingerpad_fe::mesh::MeshPreset;

use super::{Effort, Failure};
use crate::Check;

/// Time, depth, slides along x and y (mm), spin (degrees): a press, a slide, a reversal of 1 um and the way back; then a
/// spin and a slide across.
const CORNERS: [[f64; 5]; 7] = [
    [0.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 1.0, 0.0, 0.0, 0.0],
    [3.0, 1.0, 2.0, 0.0, 0.0],
    [3.1, 1.0, 1.999, 0.0, 0.0],
    [4.0, 1.0, 1.5, 0.0, 0.0],
    [5.0, 1.0, 1.5, 0.0, 10.0],
    [6.0, 1.0, 1.5, 0.5, 10.0],
];
/// The hexahedra's mesh `default` has larger contact areas than `fine`, by 1.5 % at 1 mm.
const FORCE_BOUND: f64 = 0.01;
const AREA_BOUND: f64 = 0.015;
const MOMENT_BOUND: f64 = 0.025;

/// Normal force, friction, area and moment of the two along one path; friction and moment as shares of what full slip has.
///
/// Quick: without the spin, so that half of the hexahedra does.
pub fn hemisphere(effort: Effort) -> Result<Vec<Check>, Failure> {
    let corners = if effort == Effort::Quick { &CORNERS[..5] } else { &CORNERS };
    let path = path(corners);
    let data = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("../data");
    let by_hexes = Config { mesh_preset: MeshPreset::Default, ..Config::read(&data.join("silicone.toml"))? };
    let hexes = along(&by_hexes, &path)?;
    let tets = along(&Config::read(&data.join("geometry/hemisphere/tets.toml"))?, &path)?;
    let mut checks = Vec::new();
    let slip_n = hexes[2].friction_x_n;
    for (corner, (hexes, tets)) in hexes.iter().zip(&tets).enumerate().skip(1) {
        let at = |what: &str| format!("hemisphere, corner {corner}: {what} by tetrahedra, by hexahedra");
        let relative = |what: &str, tets, hexes, bound| Check::relative(at(what), tets, hexes, bound);
        checks.push(relative("normal force (N)", tets.normal_force_n, hexes.normal_force_n, FORCE_BOUND));
        checks.push(relative("contact area (mm2)", tets.contact_area_mm2, hexes.contact_area_mm2, AREA_BOUND));
        let absolute = |what: &str, tets, hexes, bound| Check::absolute(at(what), tets, hexes, bound);
        checks.push(absolute("friction x (N)", tets.friction_x_n, hexes.friction_x_n, FORCE_BOUND * slip_n));
        checks.push(absolute("friction y (N)", tets.friction_y_n, hexes.friction_y_n, FORCE_BOUND * slip_n));
        if corner > 4 {
            let [tets, hexes] = [tets, hexes].map(|r| r.moment_n_mm[2]);
            checks.push(relative("spin moment (N mm)", tets, hexes, MOMENT_BOUND));
        }
    }
    Ok(checks)
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
fn along(config: &Config, path: &Path) -> Result<Vec<Response>, Failure> {
    let (finger, _) = config.finger_for(&[path])?;
    let run = follow_path(&config.problem(&finger), path, &[], &mut |_| ControlFlow::Continue(()))?;
    let at = |corner: &Waypoint| run.responses.iter().rfind(|r| r.t_s <= corner.t_s + 1e-9).copied();
    Ok(path.waypoints.iter().map(|corner| at(corner).expect("the start is recorded")).collect())
}
