//! Degrees of freedom: which node moves freely, which follows, and in which order they are eliminated.

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::mesh::Mesh;
use fingerpad_linear::{Pattern, elimination_order};

/// Supports of the body.
#[derive(Clone, Debug, Default)]
pub struct Supports {
    /// Nodes that do not move but by prescription.
    pub fixed: Vec<u32>,
    /// Single components (node, axis 0 to 2) that do not move but by prescription (symmetry planes).
    pub fixed_components: Vec<(u32, usize)>,
    /// Nodes that move as one rigid body with six degrees of freedom.
    pub rigid: Vec<u32>,
    /// Degrees of freedom of the rigid body (0 to 2: translation of its reference point; 3 to 5: rotation) that are held.
    pub held_rigid: Vec<usize>,
    /// Nodes that may come into contact; eliminated last, the lowest at the very end.
    pub contact: Vec<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    Free { dof: usize },
    Fixed,
    Rigid,
    Tied { tie: usize },
}

/// The degrees of freedom of each node.
pub struct DofMap {
    pub(super) role: Vec<Role>,
    ties: Vec<Vec<(u32, f64)>>,
    /// First of the six dofs of the rigid body: translation of its reference point, then rotation.
    pub(super) rigid_dof: Option<usize>,
    /// Number of dofs.
    pub count: usize,
    /// Dofs from this one on belong to [`Self::contact_nodes`], three each.
    pub first_contact_dof: usize,
    /// Free contact nodes in dof order.
    pub contact_nodes: Vec<u32>,
    /// Dofs held at their prescribed value.
    pub held: Vec<usize>,
    /// Sparsity of the tangent.
    pub pattern: Pattern,
}

/// One summand of a node's displacement: `du_node = matrix * dq[dof .. dof + width]`.
pub(super) struct Part {
    pub dof: usize,
    pub width: usize,
    pub matrix: SMatrix<f64, 3, 6>,
}

/// Role of each node; the dofs of free nodes are not numbered yet.
fn roles(mesh: &Mesh, supports: &Supports, elements: &[Vec<u32>]) -> Vec<Role> {
    const NOT_NUMBERED: usize = 0;
    let n = mesh.nodes.len();
    let mut role = vec![Role::Free { dof: NOT_NUMBERED }; n];
    let mut used = vec![false; n];
    for element in elements {
        for &node in element {
            used[node as usize] = true;
        }
    }
    for (tie, t) in mesh.ties.iter().enumerate() {
        role[t.slave as usize] = Role::Tied { tie };
        if used[t.slave as usize] {
            for (master, _) in &t.masters {
                used[*master as usize] = true;
            }
        }
    }
    for &node in &supports.rigid {
        role[node as usize] = Role::Rigid;
    }
    for &node in &supports.fixed {
        role[node as usize] = Role::Fixed;
    }
    for (node, used) in used.iter().enumerate() {
        if !used {
            role[node] = Role::Fixed;
        }
    }
    role
}

/// Which unknowns meet in an element. Its units are the free nodes and, after them, the rigid body.
struct Graph {
    /// Unit of each node; usize::MAX for one that is not free.
    unit_of: Vec<usize>,
    /// Node of each unit but the rigid body.
    node_of: Vec<usize>,
    rigid_unit: usize,
    has_rigid: bool,
    /// Neighbours of each unit, ascending.
    adjacent: Vec<Vec<u32>>,
}

impl Graph {
    fn new(role: &[Role], ties: &[Vec<(u32, f64)>], elements: &[Vec<u32>]) -> Self {
        let is_free = |node: usize| matches!(role[node], Role::Free { .. });
        let node_of: Vec<usize> = (0..role.len()).filter(|&node| is_free(node)).collect();
        let mut unit_of = vec![usize::MAX; role.len()];
        for (unit, &node) in node_of.iter().enumerate() {
            unit_of[node] = unit;
        }
        let rigid_unit = node_of.len();
        let mut has_rigid = false;
        let mut adjacent: Vec<Vec<u32>> = vec![Vec::new(); rigid_unit + 1];
        for element in elements {
            let mut units = Vec::new();
            for &node in element {
                match role[node as usize] {
                    Role::Free { .. } => units.push(unit_of[node as usize] as u32),
                    Role::Fixed => {}
                    Role::Rigid => {
                        has_rigid = true;
                        units.push(rigid_unit as u32);
                    }
                    Role::Tied { tie } => {
                        let masters = ties[tie].iter().map(|(master, _)| *master as usize);
                        units.extend(masters.filter(|&m| is_free(m)).map(|m| unit_of[m] as u32));
                    }
                }
            }
            units.sort_unstable();
            units.dedup();
            for &a in &units {
                adjacent[a as usize].extend(units.iter().filter(|&&b| b != a));
            }
        }
        for list in &mut adjacent {
            list.sort_unstable();
            list.dedup();
        }
        Self { unit_of, node_of, rigid_unit, has_rigid, adjacent }
    }

    /// Dofs of a unit.
    fn width(&self, unit: usize) -> usize {
        if unit == self.rigid_unit { 6 } else { 3 }
    }

    /// Units in elimination order (bulk, rigid body, contact), and those of the `contact` nodes.
    fn elimination(&self, contact: &[u32]) -> (Vec<usize>, Vec<usize>) {
        let mut is_contact = vec![false; self.rigid_unit + 1];
        let mut contact_units = Vec::new();
        for &node in contact {
            let unit = self.unit_of[node as usize];
            if unit != usize::MAX && !std::mem::replace(&mut is_contact[unit], true) {
                contact_units.push(unit);
            }
        }
        let bulk: Vec<usize> = (0..self.rigid_unit).filter(|&unit| !is_contact[unit]).collect();
        let mut bulk_of = vec![u32::MAX; self.rigid_unit + 1];
        for (k, &unit) in bulk.iter().enumerate() {
            bulk_of[unit] = k as u32;
        }
        let neighbours = |&unit: &usize| {
            self.adjacent[unit].iter().map(|&w| bulk_of[w as usize]).filter(|&w| w != u32::MAX).collect()
        };
        let bulk_graph: Vec<Vec<u32>> = bulk.iter().map(neighbours).collect();
        let mut order: Vec<usize> = elimination_order(&bulk_graph).into_iter().map(|k| bulk[k]).collect();
        if self.has_rigid {
            order.push(self.rigid_unit);
        }
        order.extend(&contact_units);
        (order, contact_units)
    }

    /// Sparsity of the tangent with the dofs numbered as given.
    fn pattern(&self, order: &[usize], dof_of_unit: &[usize]) -> Pattern {
        let mut pattern = Pattern { column_start: vec![0], row: Vec::new() };
        for &unit in order {
            let dof = dof_of_unit[unit];
            let mut below: Vec<(usize, usize)> = self.adjacent[unit]
                .iter()
                .map(|&w| (dof_of_unit[w as usize], self.width(w as usize)))
                .filter(|&(other, _)| other != usize::MAX && other > dof)
                .collect();
            below.sort_unstable();
            for column in dof..dof + self.width(unit) {
                pattern.row.extend(column..dof + self.width(unit));
                for &(first, width) in &below {
                    pattern.row.extend(first..first + width);
                }
                pattern.column_start.push(pattern.row.len());
            }
        }
        pattern
    }
}

impl DofMap {
    /// Numbers the dofs in elimination order: bulk by nested dissection, the rigid body, contact last.
    ///
    /// Nodes that belong to no element of `elements` get no dof.
    pub fn new(mesh: &Mesh, supports: &Supports, elements: &[Vec<u32>]) -> Self {
        let ties: Vec<Vec<(u32, f64)>> = mesh.ties.iter().map(|tie| tie.masters.clone()).collect();
        let mut role = roles(mesh, supports, elements);
        let graph = Graph::new(&role, &ties, elements);
        // Those nearest the plane in the pose of the mesh last: a trailing part of the contact dofs touches.
        let mut contact = supports.contact.clone();
        contact.sort_by(|&a, &b| mesh.nodes[b as usize].z.total_cmp(&mesh.nodes[a as usize].z));
        let (order, contact_units) = graph.elimination(&contact);
        let mut dof_of_unit = vec![usize::MAX; graph.rigid_unit + 1];
        let mut count = 0;
        for &unit in &order {
            dof_of_unit[unit] = count;
            count += graph.width(unit);
        }
        for (role, &unit) in role.iter_mut().zip(&graph.unit_of) {
            if unit != usize::MAX {
                *role = Role::Free { dof: dof_of_unit[unit] };
            }
        }
        let mut held: Vec<usize> = supports
            .fixed_components
            .iter()
            .filter_map(|&(node, axis)| match role[node as usize] {
                Role::Free { dof } => Some(dof + axis),
                _ => None,
            })
            .collect();
        let rigid_dof = graph.has_rigid.then(|| dof_of_unit[graph.rigid_unit]);
        held.extend(rigid_dof.iter().flat_map(|first| supports.held_rigid.iter().map(move |k| first + k)));
        Self {
            role,
            ties,
            rigid_dof,
            count,
            first_contact_dof: count - 3 * contact_units.len(),
            contact_nodes: contact_units.iter().map(|&unit| graph.node_of[unit] as u32).collect(),
            held,
            pattern: graph.pattern(&order, &dof_of_unit),
        }
    }

    /// First of the six dofs of the rigid body (translation of its reference point, then rotation), if there is one.
    pub fn rigid_dof(&self) -> Option<usize> {
        self.rigid_dof
    }

    /// Masters of a tied node.
    pub(super) fn masters(&self, tie: usize) -> &[(u32, f64)] {
        &self.ties[tie]
    }

    /// First dof of a free node.
    pub fn node_dof(&self, node: u32) -> Option<usize> {
        match self.role[node as usize] {
            Role::Free { dof } => Some(dof),
            _ => None,
        }
    }

    /// The contact nodes that move a node: dofs (0 based among the contact's) and weights, itself with weight 1 if it
    /// is one; none for a node that is held. None if other dofs move it.
    pub fn contact_parts(&self, node: u32) -> Option<Vec<(usize, f64)>> {
        let of_free = |dof: usize, weight: f64| Some((dof.checked_sub(self.first_contact_dof)?, weight));
        match self.role[node as usize] {
            Role::Free { dof } => Some(vec![of_free(dof, 1.0)?]),
            Role::Fixed => Some(Vec::new()),
            Role::Rigid => None,
            Role::Tied { tie } => self.ties[tie]
                .iter()
                .filter(|(master, _)| self.role[*master as usize] != Role::Fixed)
                .map(|&(master, weight)| match self.role[master as usize] {
                    Role::Free { dof } => of_free(dof, weight),
                    _ => None,
                })
                .collect(),
        }
    }

    /// Whether the node's displacement is its own three dofs, or none.
    pub(super) fn is_plain(&self, node: u32) -> bool {
        matches!(self.role[node as usize], Role::Free { .. } | Role::Fixed)
    }

    /// Summands of a node's displacement; `arm` is its current position from the rigid body's reference point.
    pub(super) fn parts(&self, node: u32, arm: Vector3<f64>) -> Vec<Part> {
        let identity = |weight: f64| {
            let mut matrix = SMatrix::<f64, 3, 6>::zeros();
            matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() * weight));
            matrix
        };
        match self.role[node as usize] {
            Role::Fixed => Vec::new(),
            Role::Free { dof } => vec![Part { dof, width: 3, matrix: identity(1.0) }],
            Role::Rigid => {
                let mut matrix: SMatrix<f64, 3, 6> = identity(1.0);
                matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-arm.cross_matrix()));
                vec![Part { dof: self.rigid_dof.expect("a rigid node has a rigid body"), width: 6, matrix }]
            }
            Role::Tied { tie } => self.ties[tie]
                .iter()
                .filter_map(|&(master, weight)| match self.role[master as usize] {
                    Role::Free { dof } => Some(Part { dof, width: 3, matrix: identity(weight) }),
                    _ => None,
                })
                .collect(),
        }
    }

    /// Place of entry (row, column), row >= column, in the values of the tangent.
    pub(super) fn entry(&self, row: usize, column: usize) -> usize {
        let (start, end) = (self.pattern.column_start[column], self.pattern.column_start[column + 1]);
        start + self.pattern.row[start..end].binary_search(&row).expect("an entry of the pattern")
    }
}
