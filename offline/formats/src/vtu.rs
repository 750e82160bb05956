//! Fields on unstructured grids for ParaView: `.vtu` files, and a `.pvd` that strings them along time.

use std::path::Path;

use nalgebra::Vector3;
use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataArray, DataSet, IOBuffer, Piece, UnstructuredGridPiece,
    Version, VertexNumbers, Vtk,
};

use super::{Error, atomic_write, number, region_index};
use crate::mesh::Mesh;

/// Values of a field, one a point or one a cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Whole numbers.
    Integers(Vec<i32>),
    /// Numbers.
    Scalars(Vec<f64>),
    /// Vectors; x, y, z.
    Vectors(Vec<Vector3<f64>>),
    /// Symmetric tensors; xx, yy, zz, xy, yz, xz, the order in which ParaView names six components.
    SymmetricTensors(Vec<[f64; 6]>),
}

impl Values {
    fn len(&self) -> usize {
        match self {
            Self::Integers(v) => v.len(),
            Self::Scalars(v) => v.len(),
            Self::Vectors(v) => v.len(),
            Self::SymmetricTensors(v) => v.len(),
        }
    }
}

/// A field by its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Name; ends in its unit.
    pub name: &'static str,
    /// Values.
    pub values: Values,
}

impl Field {
    /// A field.
    pub fn new(name: &'static str, values: Values) -> Self {
        Self { name, values }
    }
}

/// Points and cells; cells are triangles, quadrilaterals, tetrahedra of 4 or 10 nodes or hexahedra in VTK order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grid {
    points: Vec<Vector3<f64>>,
    connectivity: Vec<u64>,
    offsets: Vec<u64>,
    types: Vec<CellType>,
    /// Numbers that belong to the grid as a whole, by their names.
    numbers: Vec<(String, usize)>,
}

impl Grid {
    /// All elements of a mesh, hexahedra first; points are undeformed, mm. The field data `region_skin` and so on hold the
    /// number by which [`regions`] calls that region.
    pub fn of_body(mesh: &Mesh) -> Self {
        let numbers =
            mesh.regions().into_iter().enumerate().map(|(i, (_, name))| (format!("region_{name}"), i)).collect();
        let mut grid = Self { points: mesh.nodes.clone(), numbers, ..Self::default() };
        mesh.hexes.iter().for_each(|h| grid.push(CellType::Hexahedron, &h.nodes));
        mesh.tets.iter().for_each(|t| grid.push(CellType::Tetra, &t.nodes));
        mesh.tets10.iter().for_each(|t| grid.push(CellType::QuadraticTetra, &t.nodes));
        grid
    }

    /// The pad faces alone, and the numbers of the mesh's nodes that are its points.
    pub fn of_pad(mesh: &Mesh) -> (Self, Vec<u32>) {
        let nodes = mesh.pad_nodes();
        let place = |node: u32| nodes.partition_point(|n| *n < node) as u32;
        let mut grid = Self { points: nodes.iter().map(|n| mesh.nodes[*n as usize]).collect(), ..Self::default() };
        for face in &mesh.pad_faces {
            grid.push(CellType::Quad, &face.map(place));
        }
        for triangle in &mesh.pad_triangles {
            grid.push(CellType::Triangle, &triangle.map(place));
        }
        (grid, nodes)
    }

    fn push(&mut self, kind: CellType, nodes: &[u32]) {
        self.connectivity.extend(nodes.iter().map(|n| u64::from(*n)));
        self.offsets.push(self.connectivity.len() as u64);
        self.types.push(kind);
    }
}

/// Region of every element of [`Grid::of_body`], as its place in [`Mesh::regions`].
pub fn regions(mesh: &Mesh) -> Field {
    Field::new("region", Values::Integers(mesh.elements().map(|(_, region)| region_index(region) as i32).collect()))
}

/// Writes a grid with its fields, whole or not at all.
///
/// # Errors
/// A field whose length does not fit the grid; disk errors carry the path.
pub fn write(file: &Path, grid: Grid, point: Vec<Field>, cell: Vec<Field>) -> Result<(), Error> {
    let (points, cells) = (grid.points.len(), grid.types.len());
    let fields = [(points, "points", &point), (cells, "cells", &cell)];
    for (needed, places, fields) in fields {
        if let Some(field) = fields.iter().find(|field| field.values.len() != needed) {
            let found = field.values.len();
            let problem = format!("`{}` has {found} values where the grid has {needed} {places}", field.name);
            return Err(Error::Content { path: file.to_path_buf(), problem });
        }
    }
    let piece = UnstructuredGridPiece {
        points: IOBuffer::F64(coordinates(&grid.points)),
        cells: Cells {
            cell_verts: VertexNumbers::XML { connectivity: grid.connectivity, offsets: grid.offsets },
            types: grid.types,
        },
        data: Attributes {
            point: point.into_iter().map(attribute).collect(),
            cell: cell.into_iter().map(attribute).collect(),
        },
    };
    let numbers = field_data(&grid.numbers);
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
    let text = String::from_utf8_lossy(&bytes).replacen(GRID_OPENS, &format!("{GRID_OPENS}{numbers}"), 1);
    atomic_write(file, |w| w.write_all(text.as_bytes()))
}

/// Where a grid begins in a file.
const GRID_OPENS: &str = "<UnstructuredGrid>";

/// Numbers as VTK's field data, which the `vtkio` crate does not write. Words would be refused by meshio.
fn field_data(numbers: &[(String, usize)]) -> String {
    let array = |(name, number): &(String, usize)| {
        format!("<DataArray type=\"Int32\" Name=\"{name}\" NumberOfTuples=\"1\" format=\"ascii\">{number}</DataArray>")
    };
    let arrays: String = numbers.iter().map(array).collect();
    if arrays.is_empty() { arrays } else { format!("<FieldData>{arrays}</FieldData>") }
}

/// A file of a collection.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Time that ParaView shows.
    pub t_s: f64,
    /// Part of the collection.
    pub part: usize,
    /// Name of the file, beside the collection's.
    pub file: String,
}

/// Writes the `.pvd` that strings files along time.
pub fn write_collection(file: &Path, entries: &[Entry]) -> Result<(), Error> {
    atomic_write(file, |w| {
        write!(
            w,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
        )?;
        writeln!(w, "  <Collection>")?;
        for Entry { t_s, part, file } in entries {
            let file = file.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
            writeln!(w, "    <DataSet timestep=\"{}\" part=\"{part}\" file=\"{file}\"/>", number(*t_s))?;
        }
        write!(w, "  </Collection>\n</VTKFile>\n")
    })
}

fn attribute(field: Field) -> Attribute {
    Attribute::DataArray(match field.values {
        Values::Integers(values) => DataArray::scalars(field.name, 1).with_data(values),
        Values::Scalars(values) => DataArray::scalars(field.name, 1).with_data(values),
        Values::Vectors(values) => DataArray::vectors(field.name).with_data(coordinates(&values)),
        Values::SymmetricTensors(values) => DataArray::new(field.name, 6).with_data(values.into_flattened()),
    })
}

fn coordinates(points: &[Vector3<f64>]) -> Vec<f64> {
    points.iter().flat_map(|p| [p.x, p.y, p.z]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_mesh;

    #[test]
    fn a_grid_reads_back_and_a_field_that_does_not_fit_is_refused() {
        let mesh = test_mesh::hex_and_tet();
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("body.vtu");
        let stress = vec![[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], [-1.0, 0.0, 0.0, 0.0, 0.0, 0.5]];
        let stress_field = Field::new("cauchy_stress_mpa", Values::SymmetricTensors(stress.clone()));
        write(&file, Grid::of_body(&mesh), Vec::new(), vec![regions(&mesh), stress_field]).unwrap();
        let text = std::fs::read_to_string(&file).unwrap();
        let (_, field_data) = text.split_once("<FieldData>").unwrap();
        for (i, (region, name)) in crate::REGIONS.into_iter().enumerate() {
            assert_eq!(i, region_index(region));
            let array = format!("Name=\"region_{name}\" NumberOfTuples=\"1\" format=\"ascii\">{i}</DataArray>");
            assert!(field_data.contains(&array), "{array}");
        }
        let DataSet::UnstructuredGrid { pieces, .. } = Vtk::import(&file).unwrap().data else { panic!() };
        let piece = pieces.into_iter().next().unwrap().into_loaded_piece_data(None).unwrap();
        assert_eq!((piece.num_points(), piece.cells.num_cells()), (12, 2));
        let Attribute::DataArray(back) = &piece.data.cell[1] else { panic!() };
        assert_eq!((back.name.as_str(), back.elem.num_comp()), ("cauchy_stress_mpa", 6));
        assert_eq!(back.data.clone().into_vec::<f64>().unwrap(), stress.into_flattened());
        let (pad, nodes) = Grid::of_pad(&mesh);
        assert_eq!(nodes, [0, 1, 2, 3]);
        let short = vec![Field::new("pressure_mpa", Values::Scalars(vec![]))];
        let error = write(&dir.path().join("pad.vtu"), pad, Vec::new(), short).unwrap_err().to_string();
        assert!(error.contains("pad.vtu: `pressure_mpa` has 0 values where the grid has 1 cells"), "{error}");
    }
}
