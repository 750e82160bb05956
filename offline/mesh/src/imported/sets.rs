//! Named sets and the pad.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::super::{FACE_TRIANGLES, set};
use super::named;
use super::{Draft, Faces, ImportError, ImportedGeometry, RawMesh, sorted};

/// Node sets of the regions and of the supports.
pub(super) fn named_sets(draft: &mut Draft, raw: &RawMesh, settings: &ImportedGeometry) -> Result<(), ImportError> {
    let mut sets = BTreeMap::new();
    for (region, name) in draft.mesh.regions() {
        let mine = draft.mesh.elements().filter(|(_, of)| *of == region);
        sets.insert(name.to_owned(), sorted(mine.flat_map(|(nodes, _)| nodes).copied().collect()));
    }
    draft.mesh.node_sets.extend(sets);
    let names = &settings.sets;
    for (key, name, given) in
        [("proximal_fix", set::PROXIMAL_FIX, &names.proximal_fix), ("nail_fix", set::NAIL_FIX, &names.nail_fix)]
    {
        let nodes = match given {
            Some(given) => nodes_of(draft, raw, key, given)?,
            None if has(raw, name) => nodes_of(draft, raw, key, name)?,
            None => vec![],
        };
        draft.mesh.node_sets.insert(name.into(), nodes);
    }
    for (key, name, given) in
        [("bone", set::DISTAL_BONE, &names.bone), ("proximal_bone", set::PROXIMAL_BONE, &names.proximal_bone)]
    {
        // A bone without elements, as in a deck with held nodes, is given by its nodes.
        let usual = (draft.mesh.node_set(name).is_empty() && named(&raw.node_sets, name).is_some()).then_some(name);
        if let Some(given) = given.as_deref().or(usual) {
            let mut nodes = nodes_of(draft, raw, key, given)?;
            nodes.extend(draft.mesh.node_set(name));
            draft.mesh.node_sets.insert(name.into(), sorted(nodes));
        }
    }
    Ok(())
}

fn has(raw: &RawMesh, name: &str) -> bool {
    named(&raw.node_sets, name).is_some()
        || named(&raw.surfaces, name).is_some()
        || named(&raw.element_sets, name).is_some()
}

/// Nodes of a node set, else of a surface, else of an element set; nodes of no solid element are left out.
fn nodes_of(draft: &Draft, raw: &RawMesh, key: &str, name: &str) -> Result<Vec<u32>, ImportError> {
    let labels: Vec<u64> = if let Some(nodes) = named(&raw.node_sets, name) {
        nodes.clone()
    } else if let Some(faces) = named(&raw.surfaces, name) {
        faces.iter().flatten().copied().collect()
    } else if let Some(elements) = named(&raw.element_sets, name) {
        let elements: HashSet<u64> = elements.iter().copied().collect();
        raw.elements.iter().filter(|e| elements.contains(&e.label)).flat_map(|e| e.nodes.iter().copied()).collect()
    } else {
        let key = format!("imported.sets.{key}");
        return Err(ImportError::NoSuchSet { key, name: name.into(), known: raw.names() });
    };
    let known: HashSet<u64> = raw.nodes.iter().map(|n| n.0).collect();
    if let Some(node) = labels.iter().find(|n| !known.contains(n)) {
        return Err(ImportError::NoSuchNode { what: format!("set `{name}`"), node: *node });
    }
    let nodes = sorted(labels.iter().filter_map(|n| draft.index.get(n).copied()).collect());
    if nodes.is_empty() {
        return Err(ImportError::Support(format!("imported.sets.{key}: `{name}` has no node of a solid element")));
    }
    Ok(nodes)
}

/// Refuses a finger that nothing holds.
pub(super) fn supports(draft: &Draft) -> Result<(), ImportError> {
    let held = [set::PROXIMAL_FIX, set::NAIL_FIX, set::PROXIMAL_BONE];
    if held.iter().all(|name| draft.mesh.node_set(name).is_empty()) {
        return Err(ImportError::Support(
            "nothing holds the finger: name sets.proximal_fix (or nail_fix, or a proximal bone)".into(),
        ));
    }
    Ok(())
}

/// The faces that may touch, turned outward.
pub(super) fn pad(
    draft: &Draft,
    raw: &RawMesh,
    settings: &ImportedGeometry,
    outer: &Faces,
) -> Result<Faces, ImportError> {
    let default = ["PAD_SURFACE", set::PAD].into_iter().find(|name| has(raw, name));
    let Some(name) = settings.sets.pad.as_deref().or(default) else {
        return low(draft, settings, outer);
    };
    let pad = match named(&raw.surfaces, name) {
        Some(faces) => faces_of_surface(draft, outer, name, faces)?,
        None => {
            let nodes: HashSet<u32> = nodes_of(draft, raw, "pad", name)?.into_iter().collect();
            outer.only(|corners| corners.iter().all(|n| nodes.contains(n)))
        }
    };
    if pad.quads.is_empty() && pad.triangles.is_empty() {
        return Err(ImportError::Pad(format!("`{name}` holds no outer face of a hexahedron or 10-node tetrahedron")));
    }
    Ok(pad)
}

/// The outer faces that a file's surface names: by their corners, or a triangle by any of its four linear ones.
fn faces_of_surface(draft: &Draft, outer: &Faces, name: &str, faces: &[Vec<u64>]) -> Result<Faces, ImportError> {
    let mut known: HashMap<Vec<u32>, Vec<u32>> = HashMap::new();
    for face in &outer.quads {
        known.insert(sorted(face.to_vec()), face.to_vec());
    }
    for face in &outer.triangles {
        known.insert(sorted(face[..3].to_vec()), face.to_vec());
        for triangle in FACE_TRIANGLES {
            known.insert(sorted(triangle.map(|n| face[n]).to_vec()), face.to_vec());
        }
    }
    let mut wanted: HashSet<&[u32]> = HashSet::new();
    for face in faces {
        let corners: Option<Vec<u32>> = face.iter().map(|n| draft.index.get(n).copied()).collect();
        let Some(found) = corners.and_then(|corners| known.get(&sorted(corners))) else {
            let problem = "is not an outer face of a hexahedron or 10-node tetrahedron";
            return Err(ImportError::Pad(format!("face {face:?} of `{name}` {problem}")));
        };
        wanted.insert(found);
    }
    Ok(outer.only(|face| wanted.contains(face)))
}

/// Outer faces that look down and lie low.
fn low(draft: &Draft, settings: &ImportedGeometry, outer: &Faces) -> Result<Faces, ImportError> {
    let place = |n: u32| draft.mesh.nodes[n as usize];
    let looks_down_low = |face: &[u32]| {
        // Corners alone; those of a triangle are the first three of six.
        let corners = if face.len() == 6 { 3 } else { 4 };
        let p: Vec<_> = face[..corners].iter().map(|n| place(*n)).collect();
        // Along the normal for both: the product of the diagonals, or of two edges.
        let up = (p[2] - p[0]).cross(&(p[corners - 1] - p[1])).z;
        let mean = p.iter().map(|p| p.z).sum::<f64>() / corners as f64;
        up < 0.0 && mean < settings.pad_height_mm
    };
    let pad = outer.only(looks_down_low);
    if pad.quads.is_empty() && pad.triangles.is_empty() {
        return Err(ImportError::Pad(format!(
            "no outer face of a hexahedron or 10-node tetrahedron looks down below z = {} mm",
            settings.pad_height_mm
        )));
    }
    Ok(pad)
}

impl Faces {
    /// Those whose nodes satisfy `wanted`.
    fn only(&self, wanted: impl Fn(&[u32]) -> bool) -> Self {
        Self {
            quads: self.quads.iter().filter(|f| wanted(*f)).copied().collect(),
            triangles: self.triangles.iter().filter(|f| wanted(*f)).copied().collect(),
        }
    }
}
