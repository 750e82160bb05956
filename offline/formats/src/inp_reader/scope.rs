//! Parts, and the instances of them that are placed in the assembly.

use std::collections::BTreeMap;

use nalgebra::{Rotation3, Unit, Vector3};

use super::{Card, Error, Place, cells, real};
use crate::raw_mesh::RawElement;

/// Members of a set: numbers, and other sets named before or after.
#[derive(Clone, Default)]
pub(super) struct Members {
    pub(super) numbers: Vec<u64>,
    pub(super) names: Vec<(String, Place)>,
}

/// An element or a set, and the number of a face; 0 of an element that is a face itself.
pub(super) type Faces = Vec<(String, usize, Place)>;

/// Terms of an equation: number of a node, direction, weight.
pub(super) type Terms = Vec<(u64, usize, f64)>;

/// Nodes, elements and sets of a part, of an instance or of the whole model.
#[derive(Clone, Default)]
pub(super) struct Scope {
    pub(super) nodes: Vec<(u64, Vector3<f64>)>,
    pub(super) elements: Vec<RawElement>,
    pub(super) node_sets: BTreeMap<String, Members>,
    pub(super) element_sets: BTreeMap<String, Members>,
    pub(super) surfaces: BTreeMap<String, Faces>,
    pub(super) equations: Vec<(Terms, Place)>,
}

impl Scope {
    /// The highest number of a node or an element, 0 without any.
    pub(super) fn highest(&self) -> u64 {
        self.nodes.iter().map(|n| n.0).chain(self.elements.iter().map(|e| e.label)).max().unwrap_or(0)
    }

    /// Whether both have a node or an element of the same number.
    pub(super) fn collides_with(&self, other: &Self) -> bool {
        let shared = |mut a: Vec<u64>, mut b: Vec<u64>| {
            a.sort_unstable();
            b.sort_unstable();
            a.iter().any(|label| b.binary_search(label).is_ok())
        };
        let nodes = |scope: &Self| scope.nodes.iter().map(|n| n.0).collect::<Vec<_>>();
        let elements = |scope: &Self| scope.elements.iter().map(|e| e.label).collect::<Vec<_>>();
        shared(nodes(self), nodes(other)) || shared(elements(self), elements(other))
    }

    /// Takes another's content in as that of an instance: places moved, numbers increased by `offset`, sets and surfaces under
    /// `instance.name`. Returns the bare names of its node sets, element sets and surfaces.
    pub(super) fn take(&mut self, other: Self, instance: &str, offset: u64, placement: &Placement) -> [Vec<String>; 3] {
        let qualified = |name: &str| format!("{instance}.{name}");
        let members = |members: Members| Members {
            numbers: members.numbers.iter().map(|n| n + offset).collect(),
            names: members.names.into_iter().map(|(name, place)| (qualified(&name), place)).collect(),
        };
        let what = |what: String| match what.parse::<u64>() {
            Ok(label) => (label + offset).to_string(),
            Err(_) => qualified(&what),
        };
        let names = [
            other.node_sets.keys().cloned().collect(),
            other.element_sets.keys().cloned().collect(),
            other.surfaces.keys().cloned().collect(),
        ];
        self.nodes.extend(other.nodes.into_iter().map(|(n, place)| (n + offset, placement.apply(place))));
        self.elements.extend(other.elements.into_iter().map(|e| RawElement {
            label: e.label + offset,
            nodes: e.nodes.iter().map(|n| n + offset).collect(),
            ..e
        }));
        self.node_sets.extend(other.node_sets.into_iter().map(|(name, set)| (qualified(&name), members(set))));
        self.element_sets.extend(other.element_sets.into_iter().map(|(name, set)| (qualified(&name), members(set))));
        self.surfaces.extend(other.surfaces.into_iter().map(|(name, faces)| {
            (qualified(&name), faces.into_iter().map(|(of, face, place)| (what(of), face, place)).collect())
        }));
        let shifted = |terms: Terms| terms.into_iter().map(|(n, dof, weight)| (n + offset, dof, weight)).collect();
        self.equations.extend(other.equations.into_iter().map(|(terms, place)| (shifted(terms), place)));
        names
    }
}

/// Where an instance is: a translation, then a turn about an axis.
#[derive(Clone, Default)]
pub(super) struct Placement {
    translation: Vector3<f64>,
    /// A point of the axis, and the turn.
    turn: Option<(Vector3<f64>, Rotation3<f64>)>,
}

impl Placement {
    /// The data lines of `*INSTANCE`.
    pub(super) fn read(card: &Card, data: &[(String, Place)]) -> Result<Self, Error> {
        let numbers = |count: usize, (line, place): &(String, Place)| -> Result<Vec<f64>, Error> {
            let mut cells = cells(line);
            cells.resize(cells.len().max(count), String::new());
            if cells[count..].iter().any(|cell| !cell.is_empty()) {
                return Err(place.fail("*INSTANCE", line, format!("has more than {count} numbers")));
            }
            // Trailing numbers that are left out are 0.
            let number = |at: usize| if cells[at].is_empty() { Ok(0.0) } else { real(&cells, at, "*INSTANCE", place) };
            (0..count).map(number).collect()
        };
        if let Some((line, place)) = data.get(2) {
            return Err(place.fail(
                "*INSTANCE",
                line,
                "is a third line: a translation and a turn about an axis are read",
            ));
        }
        let mut placement = Self::default();
        if let Some(line) = data.first() {
            placement.translation = Vector3::from_row_slice(&numbers(3, line)?);
        }
        if let Some(line) = data.get(1) {
            let numbers = numbers(7, line)?;
            let (from, to) = (Vector3::from_row_slice(&numbers[..3]), Vector3::from_row_slice(&numbers[3..6]));
            let Some(axis) = Unit::try_new(to - from, 1e-12) else {
                return Err(card.place.fail("*INSTANCE", &line.0, "turns about an axis of two equal points"));
            };
            placement.turn = Some((from, Rotation3::from_axis_angle(&axis, numbers[6].to_radians())));
        }
        Ok(placement)
    }

    fn apply(&self, place: Vector3<f64>) -> Vector3<f64> {
        let moved = place + self.translation;
        self.turn.map_or(moved, |(point, turn)| point + turn * (moved - point))
    }
}
