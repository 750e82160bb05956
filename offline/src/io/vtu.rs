//! Fields for ParaView: `.vtu` files per snapshot and a `.pvd` that strings them along time.
//!
//! Each snapshot has two files, parts 0 and 1 of the collection: the body with all its elements, and the pad faces
//! alone with what happens on them.

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataArray, DataSet, IOBuffer, Piece, UnstructuredGridPiece,
    Version, VertexNumbers, Vtk,
};

use super::{Error, atomic_write, region_index};
use crate::mesh::Mesh;
use crate::slide::Snapshot;

/// Writes `FOLDER/NAME.pvd` with `NAME_0000.vtu`, `NAME_pad_0000.vtu` and so on beside it; returns the `.pvd`'s path.
///
/// Body: point data `displacement_mm`; cell data `region` (0 skin, 1 subcutaneous, 2 bone, 3 proximal bone, 4 nail)
/// and `strain_energy_density_mpa` (0 in tetrahedra, which snapshots do not carry).
/// Pad: point data `displacement_mm`; cell data `pressure_mpa`, `traction_mpa`, `slip_mm` (x, y, 0),
/// `stick_fraction`, `contact_fraction`. Points are undeformed: "warp by vector" shows the deformed body.
/// The `.pvd` is written last, so it never names a file that is not there. Time is the response's `t_s`.
///
/// Errors: a snapshot whose lengths do not fit the mesh; disk errors carry the path.
pub fn write_series(folder: &Path, name: &str, mesh: &Mesh, snapshots: &[Snapshot]) -> Result<PathBuf, Error> {
    let mut entries = String::new();
    for (i, snapshot) in snapshots.iter().enumerate() {
        for (part, label) in ["", "_pad"].into_iter().enumerate() {
            let file = format!("{name}{label}_{i:04}.vtu");
            let path = folder.join(&file);
            if part == 0 {
                write_body(&path, mesh, snapshot)?
            } else {
                write_pad(&path, mesh, snapshot)?
            }
            let t = super::number(snapshot.response.t_s);
            let file = file.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
            entries += &format!("    <DataSet timestep=\"{t}\" part=\"{part}\" file=\"{file}\"/>\n");
        }
    }
    let path = folder.join(format!("{name}.pvd"));
    atomic_write(&path, |w| {
        write!(
            w,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
        )?;
        write!(w, "  <Collection>\n{entries}  </Collection>\n</VTKFile>\n")
    })?;
    Ok(path)
}

/// Writes the mesh alone, with its regions.
pub fn write_mesh(file: &Path, mesh: &Mesh) -> Result<(), Error> {
    write_grid(file, body(mesh, Vec::new(), vec![scalars("region", regions(mesh))]))
}

fn write_body(file: &Path, mesh: &Mesh, snapshot: &Snapshot) -> Result<(), Error> {
    check(file, "displacements", snapshot.displacement_mm.len(), mesh.nodes.len())?;
    check(file, "strain energy densities", snapshot.strain_energy_density_mpa.len(), mesh.hexes.len())?;
    let mut energy = snapshot.strain_energy_density_mpa.clone();
    energy.resize(mesh.hexes.len() + mesh.tets.len(), 0.0);
    let cell = vec![scalars("region", regions(mesh)), scalars("strain_energy_density_mpa", energy)];
    let point = vec![vectors("displacement_mm", snapshot.displacement_mm.iter())];
    write_grid(file, body(mesh, point, cell))
}

fn write_pad(file: &Path, mesh: &Mesh, snapshot: &Snapshot) -> Result<(), Error> {
    check(file, "displacements", snapshot.displacement_mm.len(), mesh.nodes.len())?;
    check(file, "face states", snapshot.faces.len(), mesh.pad_faces.len())?;
    let mut nodes: Vec<u32> = mesh.pad_faces.iter().flatten().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    let local = |node: &u32| nodes.partition_point(|n| n < node) as u64;
    let faces = &snapshot.faces;
    let flat = |pair: [f64; 2]| Vector3::new(pair[0], pair[1], 0.0);
    let traction: Vec<_> = faces.iter().map(|f| flat(f.traction_mpa)).collect();
    let slip: Vec<_> = faces.iter().map(|f| flat(f.slip_mm)).collect();
    let cell = vec![
        scalars("pressure_mpa", faces.iter().map(|f| f.pressure_mpa).collect()),
        vectors("traction_mpa", traction.iter()),
        vectors("slip_mm", slip.iter()),
        scalars("stick_fraction", faces.iter().map(|f| f.stick_fraction).collect()),
        scalars("contact_fraction", faces.iter().map(|f| f.contact_fraction).collect()),
    ];
    let displacement = nodes.iter().map(|n| &snapshot.displacement_mm[*n as usize]);
    let piece = UnstructuredGridPiece {
        points: IOBuffer::F64(coordinates(nodes.iter().map(|n| &mesh.nodes[*n as usize]))),
        cells: Cells {
            cell_verts: VertexNumbers::XML {
                connectivity: mesh.pad_faces.iter().flatten().map(local).collect(),
                offsets: (1..=mesh.pad_faces.len() as u64).map(|i| 4 * i).collect(),
            },
            types: vec![CellType::Quad; mesh.pad_faces.len()],
        },
        data: Attributes { point: vec![vectors("displacement_mm", displacement)], cell },
    };
    write_grid(file, piece)
}

fn body(mesh: &Mesh, point: Vec<Attribute>, cell: Vec<Attribute>) -> UnstructuredGridPiece {
    let hexes = mesh.hexes.iter().map(|h| (&h.nodes[..], CellType::Hexahedron));
    let tets = mesh.tets.iter().map(|t| (&t.nodes[..], CellType::Tetra));
    let (mut connectivity, mut offsets, mut types) = (Vec::new(), Vec::new(), Vec::new());
    for (nodes, kind) in hexes.chain(tets) {
        connectivity.extend(nodes.iter().map(|n| u64::from(*n)));
        offsets.push(connectivity.len() as u64);
        types.push(kind);
    }
    UnstructuredGridPiece {
        points: IOBuffer::F64(coordinates(mesh.nodes.iter())),
        cells: Cells { cell_verts: VertexNumbers::XML { connectivity, offsets }, types },
        data: Attributes { point, cell },
    }
}

fn write_grid(file: &Path, piece: UnstructuredGridPiece) -> Result<(), Error> {
    let grid = Vtk {
        version: Version::new_xml(1, 0),
        title: String::new(),
        byte_order: ByteOrder::LittleEndian,
        data: DataSet::UnstructuredGrid { meta: None, pieces: vec![Piece::Inline(Box::new(piece))] },
        file_path: None,
    };
    let mut bytes = Vec::new();
    grid.write_xml(&mut bytes)
        .map_err(|e| Error::Content { path: file.to_path_buf(), problem: format!("VTK: {e}") })?;
    atomic_write(file, |w| w.write_all(&bytes))
}

fn check(file: &Path, what: &str, found: usize, expected: usize) -> Result<(), Error> {
    if found == expected {
        return Ok(());
    }
    let problem = format!("the snapshot has {found} {what} where the mesh needs {expected}");
    Err(Error::Content { path: file.to_path_buf(), problem })
}

fn regions(mesh: &Mesh) -> Vec<i32> {
    let regions = mesh.hexes.iter().map(|h| h.region).chain(mesh.tets.iter().map(|t| t.region));
    regions.map(|region| region_index(region) as i32).collect()
}

fn coordinates<'a>(points: impl Iterator<Item = &'a Vector3<f64>>) -> Vec<f64> {
    points.flat_map(|p| [p.x, p.y, p.z]).collect()
}

fn scalars<T>(name: &str, values: Vec<T>) -> Attribute
where
    IOBuffer: From<Vec<T>>,
{
    Attribute::DataArray(DataArray::scalars(name, 1).with_data(values))
}

fn vectors<'a>(name: &str, values: impl Iterator<Item = &'a Vector3<f64>>) -> Attribute {
    Attribute::DataArray(DataArray::vectors(name).with_data(coordinates(values)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::test_mesh;
    use crate::slide::{FaceState, Response};

    fn snapshot(mesh: &Mesh) -> Snapshot {
        Snapshot {
            response: Response { t_s: 0.5, ..Response::default() },
            displacement_mm: (0..mesh.nodes.len()).map(|i| Vector3::new(i as f64, 0.1, -0.2)).collect(),
            faces: vec![FaceState { pressure_mpa: 0.004, slip_mm: [0.1, -0.2], ..FaceState::default() }],
            strain_energy_density_mpa: vec![1e-4],
        }
    }

    #[test]
    fn a_series_is_complete_and_reads_back() {
        let mesh = test_mesh::hex_and_tet();
        let dir = tempfile::tempdir().unwrap();
        let pvd = write_series(dir.path(), "press", &mesh, &[snapshot(&mesh), snapshot(&mesh)]).unwrap();
        let text = std::fs::read_to_string(pvd).unwrap();
        for file in ["press_0000.vtu", "press_pad_0000.vtu", "press_0001.vtu", "press_pad_0001.vtu"] {
            assert!(text.contains(file));
            let back = Vtk::import(dir.path().join(file)).unwrap();
            let DataSet::UnstructuredGrid { pieces, .. } = back.data else { panic!("{file}") };
            let piece = pieces.into_iter().next().unwrap().into_loaded_piece_data(None).unwrap();
            let (points, cells) = if file.contains("pad") { (4, 1) } else { (12, 2) };
            assert_eq!((piece.num_points(), piece.cells.num_cells()), (points, cells), "{file}");
        }
    }

    #[test]
    fn a_snapshot_of_another_mesh_is_refused() {
        let mesh = test_mesh::hex_and_tet();
        let dir = tempfile::tempdir().unwrap();
        let bad = Snapshot { faces: Vec::new(), ..snapshot(&mesh) };
        let error = write_series(dir.path(), "press", &mesh, &[bad]).unwrap_err().to_string();
        assert!(error.contains("press_pad_0000.vtu: the snapshot has 0 face states where the mesh needs 1"), "{error}");
        assert!(!dir.path().join("press.pvd").exists());
    }
}
