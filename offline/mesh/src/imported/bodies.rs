//! Which parts hang together, and whether their boundaries are closed.

use std::collections::{BTreeMap, HashMap, HashSet};

use nalgebra::Vector3;

use super::super::boundary::{Hanging, faces_of};
use super::super::closest_point::nearest_on_faces;
use super::super::{Mesh, Region, TET_FACES, TET10_FACES, set};
use super::{Draft, Faces, ImportError, ImportedGeometry, Near, sorted};

/// Faces of the hexahedra that belong to one of them only, counter-clockwise seen from outside.
pub(super) fn outer_hex_faces(mesh: &Mesh) -> Vec<[u32; 4]> {
    once(hanging(mesh).faces_of_hexes(&mesh.hexes)).map_or(vec![], |faces| faces)
}

/// Nodes that hang between hexahedra of two sizes.
fn hanging(mesh: &Mesh) -> Hanging {
    let of_hexes: HashSet<u32> = mesh.hexes.iter().flat_map(|h| h.nodes).collect();
    Hanging::of(mesh.ties.iter().filter(|tie| of_hexes.contains(&tie.slave)))
}

/// Those of the elements' faces that belong to one element only; the nodes of a face of more than two otherwise.
fn once<const F: usize>(faces: Vec<[u32; F]>) -> Result<Vec<[u32; F]>, [u32; F]> {
    let mut all: BTreeMap<[u32; F], ([u32; F], usize)> = BTreeMap::new();
    for face in faces {
        let mut key = face;
        key.sort_unstable();
        all.entry(key).or_insert((face, 0)).1 += 1;
    }
    match all.values().find(|(_, count)| *count > 2) {
        Some((face, _)) => Err(*face),
        None => Ok(all.into_values().filter(|(_, count)| *count == 1).map(|(face, _)| face).collect()),
    }
}

/// Sets of things that were found to hang together.
struct Union(Vec<u32>);

impl Union {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, mut n: u32) -> u32 {
        while self.0[n as usize] != n {
            self.0[n as usize] = self.0[self.0[n as usize] as usize];
            n = self.0[n as usize];
        }
        n
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    fn join_all(&mut self, nodes: &[u32]) {
        nodes.windows(2).for_each(|pair| self.join(pair[0], pair[1]));
    }
}

/// Nodes by the part that they belong to.
fn parts(mesh: &Mesh, with_ties: bool, with_bones: bool) -> Union {
    let mut union = Union::new(mesh.nodes.len());
    mesh.elements().for_each(|(nodes, _)| union.join_all(nodes));
    if with_ties {
        for tie in &mesh.ties {
            tie.masters.iter().for_each(|(m, _)| union.join(tie.slave, *m));
        }
    }
    if with_bones {
        union.join_all(mesh.node_set(set::DISTAL_BONE));
        union.join_all(mesh.node_set(set::PROXIMAL_BONE));
    }
    union
}

fn is_bone(region: Region) -> bool {
    matches!(region, Region::DistalBone | Region::ProximalBone)
}

/// Puts nodes of soft tissue that lie on a bone meshed apart into that bone's set, so that they move with it.
pub(super) fn attach_bones(draft: &mut Draft, settings: &ImportedGeometry) {
    let mesh = &draft.mesh;
    let mut union = parts(mesh, true, false);
    let soft: HashSet<u32> =
        mesh.hexes.iter().filter(|h| !is_bone(h.region)).map(|h| h.nodes[0]).map(|n| union.root(n)).collect();
    let outer = outer_hex_faces(mesh);
    let mut region_of: HashMap<u32, Region> = HashMap::new();
    mesh.hexes.iter().filter(|h| is_bone(h.region)).for_each(|h| {
        h.nodes.iter().for_each(|n| _ = region_of.insert(*n, h.region));
    });
    let apart: Vec<[u32; 4]> = outer.iter().filter(|f| !soft.contains(&union.root(f[0]))).copied().collect();
    if apart.is_empty() {
        return;
    }
    let size = |f: &[u32; 4]| (mesh.nodes[f[0] as usize] - mesh.nodes[f[2] as usize]).norm();
    let mut near = Near::new(apart.iter().map(size).fold(0.0, f64::max) + settings.tie_mm);
    for (n, face) in apart.iter().enumerate() {
        let middle = face.iter().map(|c| mesh.nodes[*c as usize]).sum::<Vector3<f64>>() / 4.0;
        near.insert(&middle, n as u32);
    }
    let tissue = sorted(outer.iter().filter(|f| soft.contains(&union.root(f[0]))).flatten().copied().collect());
    let mut found: Vec<(Region, u32)> = Vec::new();
    for node in tissue {
        let place = mesh.nodes[node as usize];
        let around: Vec<[u32; 4]> = near.around(&place).map(|n| apart[n as usize]).collect();
        if around.is_empty() {
            continue;
        }
        let closest = nearest_on_faces(&place, &around, &mesh.nodes);
        if (closest.position - place).norm() <= settings.tie_mm {
            found.push((region_of[&closest.masters[0].0], node));
        }
    }
    draft.report.attached_nodes = found.len();
    for (region, name) in [(Region::DistalBone, set::DISTAL_BONE), (Region::ProximalBone, set::PROXIMAL_BONE)] {
        let more = found.iter().filter(|(r, _)| *r == region).map(|(_, n)| *n);
        let all = draft.mesh.node_set(name).iter().copied().chain(more).collect();
        draft.mesh.node_sets.insert(name.into(), sorted(all));
    }
}

/// Refuses parts that are joined to nothing, open or pinched boundaries, tunnels, and voids that no bone fills. Returns
/// the outer faces, without those of bones, of the elements that can touch.
pub(super) fn check(draft: &Draft) -> Result<Faces, ImportError> {
    joined(draft)?;
    let mesh = &draft.mesh;
    let refuse =
        |kind, problem: String, node: u32| Err(ImportError::Boundary { kind, problem, node: draft.label(node) });
    let three = |kind, node| refuse(kind, "a face belongs to three elements".into(), node);
    let hanging = hanging(mesh);
    let quads = match once(hanging.faces_of_hexes(&mesh.hexes)) {
        Ok(faces) => faces,
        Err(face) => return three("hexahedra", face[0]).map(|()| Faces::default()),
    };
    if let Err((problem, node)) = closed(mesh, &quads, &hanging) {
        refuse("hexahedra", problem, node)?;
    }
    match once(faces_of(mesh.tets.iter().map(|t| t.nodes), &TET_FACES)) {
        Err(face) => three("tetrahedra", face[0])?,
        Ok(faces) => {
            if let Err((problem, node)) = closed(mesh, &faces, &Hanging::default()) {
                refuse("tetrahedra", problem, node)?;
            }
        }
    }
    let triangles = match once(faces_of(mesh.tets10.iter().map(|t| t.nodes), &TET10_FACES)) {
        Ok(faces) => faces,
        Err(face) => return three("10-node tetrahedra", face[0]).map(|()| Faces::default()),
    };
    // Elements with a face in common have its edge nodes in common too, or their corners would meet twice here.
    let corners: Vec<[u32; 3]> = triangles.iter().map(|f| [f[0], f[1], f[2]]).collect();
    if let Err((problem, node)) = closed(mesh, &corners, &Hanging::default()) {
        refuse("10-node tetrahedra", problem, node)?;
    }
    let bones: HashSet<u32> =
        [set::DISTAL_BONE, set::PROXIMAL_BONE].iter().flat_map(|name| mesh.node_set(name)).copied().collect();
    let off_bone = |nodes: &[u32]| !nodes.iter().all(|n| bones.contains(n));
    Ok(Faces {
        quads: quads.into_iter().filter(|f| off_bone(f)).collect(),
        triangles: triangles.into_iter().filter(|f| off_bone(f)).collect(),
    })
}

/// Every part must hang on the rest by nodes, ties or a bone.
fn joined(draft: &Draft) -> Result<(), ImportError> {
    let mesh = &draft.mesh;
    let mut union = parts(mesh, true, true);
    let mut sizes: BTreeMap<u32, (usize, usize)> = BTreeMap::new();
    for (element, (nodes, _)) in mesh.elements().enumerate() {
        let entry = sizes.entry(union.root(nodes[0])).or_insert((0, element));
        entry.0 += 1;
    }
    let Some((&largest, _)) = sizes.iter().max_by_key(|(_, (count, _))| *count) else { return Ok(()) };
    let Some((&part, &(elements, first))) = sizes.iter().find(|(root, _)| **root != largest) else { return Ok(()) };
    let mine: Vec<bool> = (0..mesh.nodes.len() as u32).map(|n| union.root(n) == part).collect();
    let gap = (0..mesh.nodes.len()).filter(|n| mine[*n]).flat_map(|a| {
        let mine = &mine;
        (0..mesh.nodes.len()).filter(move |b| !mine[*b]).map(move |b| (mesh.nodes[a] - mesh.nodes[b]).norm())
    });
    let region = mesh.elements().nth(first).map_or(Region::Skin, |(_, region)| region);
    Err(ImportError::Apart {
        what: format!("a part of {}", mesh.region_name(region)),
        elements,
        first: draft.element_labels[first],
        gap_mm: gap.fold(f64::INFINITY, f64::min),
    })
}

/// Every edge between two faces; every closed surface a sphere; inward ones (voids) only where all nodes are bone's.
fn closed<const F: usize>(mesh: &Mesh, faces: &[[u32; F]], hanging: &Hanging) -> Result<(), (String, u32)> {
    let mut edges: HashMap<[u32; 2], usize> = HashMap::new();
    let mut union = Union::new(mesh.nodes.len());
    for face in faces {
        union.join_all(face);
        for c in 0..F {
            for [a, b] in hanging.parts([face[c], face[(c + 1) % F]]) {
                *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
    }
    if let Some((edge, count)) = edges.iter().filter(|(_, n)| **n != 2).min() {
        let problem = format!("an edge belongs to {count} outer faces, not 2: elements touch in an edge only");
        return Err((problem, edge[0]));
    }
    let bones: HashSet<u32> =
        [set::DISTAL_BONE, set::PROXIMAL_BONE].iter().flat_map(|name| mesh.node_set(name)).copied().collect();
    // Euler characteristic, volume, and a node off the bones.
    let mut surfaces: BTreeMap<u32, (i64, f64, Option<u32>)> = BTreeMap::new();
    for face in faces {
        let entry = surfaces.entry(union.root(face[0])).or_default();
        entry.0 += 1;
        let p: Vec<Vector3<f64>> = face.iter().map(|n| mesh.nodes[*n as usize]).collect();
        entry.1 += (2..F).map(|c| p[0].dot(&p[c - 1].cross(&p[c]))).sum::<f64>();
        entry.2 = entry.2.or_else(|| face.iter().find(|n| !bones.contains(n)).copied());
    }
    edges.keys().for_each(|edge| surfaces.entry(union.root(edge[0])).or_default().0 -= 1);
    for node in sorted(faces.iter().flatten().copied().collect()) {
        surfaces.entry(union.root(node)).or_default().0 += 1;
    }
    for (root, (euler, volume, off_bone)) in surfaces {
        if euler != 2 {
            return Err((
                format!(
                    "a tunnel or a pinched node (Euler characteristic {euler}, not 2); meshes that match in \
                 some nodes only have to stay apart: merge_mm = 0"
                ),
                root,
            ));
        }
        if let Some(node) = off_bone.filter(|_| volume < 0.0) {
            let problem = "a hole inside: missing elements, or the wall of a bone that is in no bone set".to_owned();
            return Err((problem, node));
        }
    }
    Ok(())
}
