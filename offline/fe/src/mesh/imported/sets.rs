//! Named sets and the pad.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::super::set;
use super::named;
use super::{Draft, ImportError, ImportedGeometry, RawMesh, sorted};

/// Node sets of the regions and of the supports.
pub(super) fn named_sets(draft: &mut Draft, raw: &RawMesh, settings: &ImportedGeometry) -> Result<(), ImportError> {
    let mut sets = BTreeMap::new();
    for (region, name) in draft.mesh.regions() {
        let hexes = draft.mesh.hexes.iter().filter(|e| e.region == region).flat_map(|e| e.nodes);
        let tets = draft.mesh.tets.iter().filter(|e| e.region == region).flat_map(|e| e.nodes);
        sets.insert(name.to_owned(), sorted(hexes.chain(tets).collect()));
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
        // A bone that has no elements, as in a deck where it is held, is known by its nodes.
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
    outer_faces: &[[u32; 4]],
) -> Result<Vec<[u32; 4]>, ImportError> {
    let default = ["PAD_SURFACE", set::PAD].into_iter().find(|name| has(raw, name));
    let Some(name) = settings.sets.pad.as_deref().or(default) else {
        return low(draft, settings, outer_faces);
    };
    let outer: BTreeMap<[u32; 4], [u32; 4]> = outer_faces.iter().map(|f| (key(*f), *f)).collect();
    let mut pad = Vec::new();
    if let Some(faces) = named(&raw.surfaces, name) {
        for face in faces {
            let corners: Option<Vec<u32>> = face.iter().map(|n| draft.index.get(n).copied()).collect();
            let corners: Option<[u32; 4]> = corners.and_then(|c| c.try_into().ok());
            match corners.and_then(|c| outer.get(&key(c))) {
                Some(outward) => pad.push(*outward),
                None => {
                    let problem = "is not an outer face of a hexahedron (triangles cannot touch)";
                    return Err(ImportError::Pad(format!("face {face:?} of `{name}` {problem}")));
                }
            }
        }
    } else {
        let nodes: HashSet<u32> = nodes_of(draft, raw, "pad", name)?.into_iter().collect();
        pad = outer_faces.iter().filter(|f| f.iter().all(|n| nodes.contains(n))).copied().collect();
    }
    let mut once: HashMap<[u32; 4], ()> = HashMap::new();
    pad.retain(|face| once.insert(key(*face), ()).is_none());
    if pad.is_empty() {
        return Err(ImportError::Pad(format!("`{name}` holds no outer face of a hexahedron")));
    }
    Ok(pad)
}

/// Outer faces that look down and lie low.
fn low(draft: &Draft, settings: &ImportedGeometry, outer_faces: &[[u32; 4]]) -> Result<Vec<[u32; 4]>, ImportError> {
    let looks_down = |face: &&[u32; 4]| {
        let p = face.map(|n| draft.mesh.nodes[n as usize]);
        let down = (p[2] - p[0]).cross(&(p[3] - p[1])).z < 0.0;
        down && p.iter().map(|p| p.z).sum::<f64>() < 4.0 * settings.pad_height_mm
    };
    let pad: Vec<[u32; 4]> = outer_faces.iter().filter(looks_down).copied().collect();
    if pad.is_empty() {
        return Err(ImportError::Pad(format!(
            "no outer face of a hexahedron looks down below z = {} mm",
            settings.pad_height_mm
        )));
    }
    Ok(pad)
}

fn key(mut face: [u32; 4]) -> [u32; 4] {
    face.sort_unstable();
    face
}
