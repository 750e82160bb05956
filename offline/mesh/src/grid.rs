//! Topology of the capped box: a structured box and layers around five of its faces. No geometry.

use super::{Divisions, Hex, Region};

/// Index of a grid point of the box: ring (x), column (y), row (z).
pub(super) type Point = [usize; 3];

/// A cell of the five faces.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceCell {
    /// Counter-clockwise seen from outside.
    pub(super) corners: [Point; 4],
    /// The ring interval that decides the bone (the last one for the tip).
    pub(super) ring: usize,
}

/// The box of `rings` x `columns` x `rows` cells and `layers` layers of cells around its palmar, dorsal, lateral and
/// tip faces; the proximal face is open.
#[derive(Clone, Debug)]
pub(super) struct CappedBox {
    rings: usize,
    columns: usize,
    rows: usize,
    layers: usize,
    divisions: Divisions,
    /// Grid points on the five faces, in order of their core node.
    surface: Vec<Point>,
    /// Place in `surface` of each core node, or `u32::MAX`.
    place: Vec<u32>,
}

impl CappedBox {
    pub(super) fn new(divisions: &Divisions) -> Self {
        let (rings, columns, rows) = (divisions.rings(), divisions.columns, divisions.rows);
        let (mut surface, mut place) = (Vec::new(), Vec::new());
        for i in 0..=rings {
            for j in 0..=columns {
                for k in 0..=rows {
                    let inside = i < rings && j > 0 && j < columns && k > 0 && k < rows;
                    place.push(if inside { u32::MAX } else { surface.len() as u32 });
                    if !inside {
                        surface.push([i, j, k]);
                    }
                }
            }
        }
        let layers = divisions.bone_layers + divisions.subcutaneous_layers + divisions.skin_layers;
        Self { rings, columns, rows, layers, divisions: *divisions, surface, place }
    }

    /// Number of nodes.
    pub(super) fn node_count(&self) -> usize {
        self.place.len() + self.layers * self.surface.len()
    }

    /// Grid points on the five faces.
    pub(super) fn surface(&self) -> &[Point] {
        &self.surface
    }

    /// Node of a grid point at a level: 0 in the box, up to the number of layers for a surface point.
    pub(super) fn node(&self, [i, j, k]: Point, level: usize) -> u32 {
        let core = (i * (self.columns + 1) + j) * (self.rows + 1) + k;
        if level == 0 {
            return core as u32;
        }
        (self.place.len() + (level - 1) * self.surface.len()) as u32 + self.place[core]
    }

    /// Level of the outside of the skin.
    pub(super) fn outer_level(&self) -> usize {
        self.layers
    }

    /// Cells of the five faces.
    pub(super) fn surface_cells(&self) -> Vec<SurfaceCell> {
        let mut cells = Vec::new();
        let mut push = |corners, ring| cells.push(SurfaceCell { corners, ring });
        let (columns, rows) = (self.columns, self.rows);
        for i in 0..self.rings {
            for j in 0..columns {
                push([[i, j, 0], [i, j + 1, 0], [i + 1, j + 1, 0], [i + 1, j, 0]], i);
                push([[i, j, rows], [i + 1, j, rows], [i + 1, j + 1, rows], [i, j + 1, rows]], i);
            }
            for k in 0..rows {
                push([[i, 0, k], [i + 1, 0, k], [i + 1, 0, k + 1], [i, 0, k + 1]], i);
                push([[i, columns, k], [i, columns, k + 1], [i + 1, columns, k + 1], [i + 1, columns, k]], i);
            }
        }
        let i = self.rings;
        for j in 0..columns {
            for k in 0..rows {
                push([[i, j, k], [i, j + 1, k], [i, j + 1, k + 1], [i, j, k + 1]], i - 1);
            }
        }
        cells
    }

    /// Region of a layer's cell between a level and the next.
    pub(super) fn region(&self, level: usize, ring: usize) -> Region {
        let skin_begins = self.layers - self.divisions.skin_layers;
        match level {
            _ if level < self.divisions.bone_layers => self.bone_region(ring),
            _ if level < skin_begins => Region::Subcutaneous,
            _ => Region::Skin,
        }
    }

    /// Region inside the bone's surface, by ring interval.
    fn bone_region(&self, ring: usize) -> Region {
        let gap = self.divisions.proximal_rings;
        match ring {
            _ if ring < gap => Region::ProximalBone,
            _ if ring < gap + self.divisions.joint_rings => Region::Subcutaneous,
            _ => Region::DistalBone,
        }
    }

    /// Hexahedra of the box.
    pub(super) fn core_hexes(&self) -> Vec<Hex> {
        let mut hexes = Vec::new();
        for i in 0..self.rings {
            for j in 0..self.columns {
                for k in 0..self.rows {
                    let lower = [[i, j, k], [i + 1, j, k], [i + 1, j + 1, k], [i, j + 1, k]];
                    let [a, b, c, d] = lower.map(|p| self.node(p, 0));
                    let [e, f, g, h] = lower.map(|[i, j, k]| self.node([i, j, k + 1], 0));
                    hexes.push(Hex { nodes: [a, b, c, d, e, f, g, h], region: self.bone_region(i) });
                }
            }
        }
        hexes
    }

    /// Faces of the skin's outside before any refinement, counter-clockwise seen from outside.
    pub(super) fn outer_faces(&self) -> Vec<[u32; 4]> {
        let level = self.outer_level();
        self.surface_cells().iter().map(|cell| cell.corners.map(|p| self.node(p, level))).collect()
    }

    /// Those of [`Self::outer_faces`] that lie on the back.
    pub(super) fn dorsal_faces(&self) -> Vec<[u32; 4]> {
        let level = self.outer_level();
        let on_back = |cell: &SurfaceCell| cell.corners.iter().all(|p| p[2] == self.rows);
        let cells = self.surface_cells().into_iter().filter(on_back);
        cells.map(|cell| cell.corners.map(|p| self.node(p, level))).collect()
    }

    /// Nodes of the proximal section, sorted.
    pub(super) fn proximal_nodes(&self) -> Vec<u32> {
        let mut nodes = Vec::new();
        for j in 0..=self.columns {
            for k in 0..=self.rows {
                let edge = j == 0 || j == self.columns || k == 0 || k == self.rows;
                let levels = if edge { self.layers } else { 0 };
                nodes.extend((0..=levels).map(|level| self.node([0, j, k], level)));
            }
        }
        nodes.sort_unstable();
        nodes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts() {
        let d = Divisions::default();
        let grid = CappedBox::new(&d);
        let around = 2 * (d.columns + d.rows) * (d.rings() + 1) + (d.columns - 1) * (d.rows - 1);
        let layers = d.bone_layers + d.subcutaneous_layers + d.skin_layers;
        assert_eq!(grid.surface().len(), around);
        assert_eq!(grid.node_count(), (d.columns + 1) * (d.rows + 1) * (d.rings() + 1) + layers * around);
        let cells = 2 * (d.columns + d.rows) * d.rings() + d.columns * d.rows;
        assert_eq!(grid.core_hexes().len(), d.columns * d.rows * d.rings());
        assert_eq!(grid.outer_faces().len(), cells);
    }
}
