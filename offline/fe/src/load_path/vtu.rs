//! Snapshots for ParaView.
//!
//! Each snapshot has two files, parts 0 and 1 of a collection: the body with all its elements, and the pad faces alone
//! with their contact fields.

use std::path::{Path, PathBuf};

use fingerpad_formats::Error;
use fingerpad_formats::vtu::{Entry, Field, Grid, Values, regions, write, write_collection};
use nalgebra::Vector3;

use super::{FaceState, Snapshot};
use crate::element::ElementStress;
use crate::mesh::Mesh;

/// Writes `FOLDER/NAME.pvd` with `NAME_0000.vtu`, `NAME_pad_0000.vtu` and so on beside it; returns the `.pvd`'s path.
///
/// Body: point data `displacement_mm`; cell data, means over the element and 0 in rigid bones:
/// * `region`: a number; the field data `region_skin` and so on list the numbers
/// * `cauchy_stress_mpa`: XX, YY, ZZ, XY, YZ, XZ (VTK's order) in the frame of the plane; tension positive
/// * `von_mises_stress_mpa`, and `mean_pressure_mpa`, a third of minus the trace: compression positive
/// * `green_lagrange_strain`: `(F^T F - I)/2`, XX, YY, ZZ, XY, YZ, XZ in the undeformed frame, shear of the tensor
/// * `strain_energy_density_mpa`: per undeformed volume
///
/// Pad: point data `displacement_mm`; cell data `pressure_mpa`, `traction_mpa`, `slip_mm` (x, y, 0), `stick_fraction`,
/// `contact_fraction`. Points are undeformed: "warp by vector" shows the deformed body. The `.pvd` is written last, so
/// it never names a file that is not there. Time is the response's `t_s`.
///
/// # Errors
/// A snapshot whose lengths do not fit the mesh; disk errors carry the path.
pub fn write_series(folder: &Path, name: &str, mesh: &Mesh, snapshots: &[Snapshot]) -> Result<PathBuf, Error> {
    let mut entries = Vec::new();
    for (i, snapshot) in snapshots.iter().enumerate() {
        let (body, pad) = (format!("{name}_{i:04}.vtu"), format!("{name}_pad_{i:04}.vtu"));
        write_body(&folder.join(&body), mesh, snapshot)?;
        write_pad(&folder.join(&pad), mesh, snapshot)?;
        let t_s = snapshot.response.t_s;
        entries.extend([Entry { t_s, part: 0, file: body }, Entry { t_s, part: 1, file: pad }]);
    }
    let path = folder.join(format!("{name}.pvd"));
    write_collection(&path, &entries)?;
    Ok(path)
}

/// Writes the mesh alone, with its regions.
pub fn write_mesh(file: &Path, mesh: &Mesh) -> Result<(), Error> {
    write(file, Grid::of_body(mesh), Vec::new(), vec![regions(mesh)])
}

fn write_body(file: &Path, mesh: &Mesh, snapshot: &Snapshot) -> Result<(), Error> {
    let elements = mesh.elements().count();
    check(file, "displacements", snapshot.displacement_mm.len(), mesh.nodes.len())?;
    check(file, "strain energy densities", snapshot.strain_energy_density_mpa.len(), elements)?;
    check(file, "stresses", snapshot.stresses.len(), elements)?;
    let energy = snapshot.strain_energy_density_mpa.clone();
    let scalars = |of: fn(&ElementStress) -> f64| Values::Scalars(snapshot.stresses.iter().map(of).collect());
    let tensors =
        |of: fn(&ElementStress) -> [f64; 6]| Values::SymmetricTensors(snapshot.stresses.iter().map(of).collect());
    let cell = vec![
        regions(mesh),
        Field::new("cauchy_stress_mpa", tensors(|s| s.cauchy_mpa)),
        Field::new("von_mises_stress_mpa", scalars(ElementStress::von_mises_mpa)),
        Field::new("mean_pressure_mpa", scalars(ElementStress::mean_pressure_mpa)),
        Field::new("green_lagrange_strain", tensors(|s| s.green_lagrange)),
        Field::new("strain_energy_density_mpa", Values::Scalars(energy)),
    ];
    let point = vec![Field::new("displacement_mm", Values::Vectors(snapshot.displacement_mm.clone()))];
    write(file, Grid::of_body(mesh), point, cell)
}

fn write_pad(file: &Path, mesh: &Mesh, snapshot: &Snapshot) -> Result<(), Error> {
    check(file, "displacements", snapshot.displacement_mm.len(), mesh.nodes.len())?;
    check(file, "face states", snapshot.faces.len(), mesh.pad_faces.len() + mesh.pad_triangles.len())?;
    let (grid, nodes) = Grid::of_pad(mesh);
    let scalars = |of: fn(&FaceState) -> f64| Values::Scalars(snapshot.faces.iter().map(of).collect());
    let in_plane = |of: fn(&FaceState) -> [f64; 2]| {
        let vector = |[x, y]: [f64; 2]| Vector3::new(x, y, 0.0);
        Values::Vectors(snapshot.faces.iter().map(|face| vector(of(face))).collect())
    };
    let cell = vec![
        Field::new("pressure_mpa", scalars(|f| f.pressure_mpa)),
        Field::new("traction_mpa", in_plane(|f| f.traction_mpa)),
        Field::new("slip_mm", in_plane(|f| f.slip_mm)),
        Field::new("stick_fraction", scalars(|f| f.stick_fraction)),
        Field::new("contact_fraction", scalars(|f| f.contact_fraction)),
    ];
    let displacement = nodes.iter().map(|n| snapshot.displacement_mm[*n as usize]).collect();
    write(file, grid, vec![Field::new("displacement_mm", Values::Vectors(displacement))], cell)
}

fn check(file: &Path, what: &str, found: usize, expected: usize) -> Result<(), Error> {
    if found == expected {
        return Ok(());
    }
    let problem = format!("the snapshot has {found} {what} but the mesh needs {expected}");
    Err(Error::Content { path: file.to_path_buf(), problem })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load_path::Response;
    use crate::mesh::{Hex, Region, Tet};

    /// A cube of skin whose lower face is the pad, with a nail tetrahedron on its top.
    fn hex_and_tet() -> Mesh {
        let corner = |k: usize| Vector3::new((k.div_ceil(2) % 2) as f64, (k / 2 % 2) as f64, (k / 4) as f64);
        let mut nodes: Vec<_> = (0..8).map(corner).collect();
        nodes.extend([[0.5, 0.5, 1.0], [0.9, 0.5, 1.3], [0.5, 0.9, 1.3], [0.5, 0.5, 1.6]].map(Vector3::from));
        Mesh {
            nodes,
            hexes: vec![Hex { nodes: [0, 1, 2, 3, 4, 5, 6, 7], region: Region::Skin }],
            tets: vec![Tet { nodes: [8, 9, 10, 11], region: Region::Nail }],
            pad_faces: vec![[0, 3, 2, 1]],
            ..Mesh::default()
        }
    }

    fn snapshot(mesh: &Mesh) -> Snapshot {
        Snapshot {
            response: Response { t_s: 0.5, ..Response::default() },
            displacement_mm: (0..mesh.nodes.len()).map(|i| Vector3::new(i as f64, 0.1, -0.2)).collect(),
            faces: vec![FaceState { pressure_mpa: 0.004, slip_mm: [0.1, -0.2], ..FaceState::default() }],
            strain_energy_density_mpa: vec![1e-4, 0.0],
            stresses: vec![ElementStress::default(); 2],
        }
    }

    #[test]
    fn a_series_is_complete() {
        let mesh = hex_and_tet();
        let dir = tempfile::tempdir().unwrap();
        let pvd = write_series(dir.path(), "press", &mesh, &[snapshot(&mesh), snapshot(&mesh)]).unwrap();
        let text = std::fs::read_to_string(pvd).unwrap();
        for file in ["press_0000.vtu", "press_pad_0000.vtu", "press_0001.vtu", "press_pad_0001.vtu"] {
            assert!(text.contains(file));
            let written = std::fs::read_to_string(dir.path().join(file)).unwrap();
            let (points, cells) = if file.contains("pad") { (4, 1) } else { (12, 2) };
            assert!(written.contains(&format!("NumberOfPoints=\"{points}\"")), "{file}");
            assert!(written.contains(&format!("NumberOfCells=\"{cells}\"")), "{file}");
        }
    }

    #[test]
    fn a_snapshot_of_another_mesh_is_refused() {
        let mesh = hex_and_tet();
        let dir = tempfile::tempdir().unwrap();
        let good = snapshot(&mesh);
        for (bad, message) in [
            (Snapshot { faces: Vec::new(), ..good.clone() }, "press_pad_0000.vtu: the snapshot has 0 face states"),
            (Snapshot { stresses: Vec::new(), ..good.clone() }, "press_0000.vtu: the snapshot has 0 stresses"),
            (Snapshot { displacement_mm: Vec::new(), ..good }, "press_0000.vtu: the snapshot has 0 displacements"),
        ] {
            let error = write_series(dir.path(), "press", &mesh, &[bad]).unwrap_err().to_string();
            assert!(error.contains(message) && error.contains(" but the mesh needs "), "{error}");
            assert!(!dir.path().join("press.pvd").exists());
        }
    }
}
