//! Elements out of the file's numbers; nodes that should be one; ties.

use std::collections::{BTreeMap, HashMap, HashSet};

use nalgebra::Vector3;

use super::super::closest_point::nearest_on_faces;
use super::super::{Hex, Mesh, Region, Tet, Tet10, Tie};
use super::named;
use super::{Draft, ImportError, ImportReport, ImportedGeometry, Near, RawElement, RawKind, RawMesh, bodies, sorted};

/// Nodes and elements with their regions; unused nodes dropped, coinciding ones merged.
pub(super) fn elements(
    raw: &RawMesh,
    settings: &ImportedGeometry,
    soft_regions: &[String],
) -> Result<Draft, ImportError> {
    let regions = regions(raw, settings, soft_regions)?;
    let places = places(raw, settings.unit_mm)?;
    let plane = plane(raw, &regions);
    let solids = || raw.elements.iter().filter(|e| e.kind.is_solid() && !plane.contains(&e.label));
    let mut used: Vec<u64> = solids().flat_map(|e| e.nodes.iter().copied()).collect();
    used.sort_unstable();
    used.dedup();
    for element in solids() {
        if let Some(node) = element.nodes.iter().find(|n| !places.contains_key(n)) {
            return Err(ImportError::NoSuchNode { what: format!("element {}", element.label), node: *node });
        }
    }
    let mut report = ImportReport {
        unused_nodes: raw.nodes.len() - used.len(),
        ignored: raw.ignored.clone(),
        renumbered: raw.renumbered.clone(),
        ..ImportReport::default()
    };
    let (index, node_labels, nodes) = merged(&used, &places, &tied_slaves(raw), settings.merge_mm);
    if !plane.is_empty() {
        report.ignored.push(format!("the plane ({} element(s) of the set {PLANE})", plane.len()));
    }
    report.merged_nodes = used.len() - nodes.len();

    let mut mesh = Mesh { nodes, soft_regions: soft_regions.to_vec(), ..Mesh::default() };
    let (mut hex_labels, mut tet_labels, mut tet10_labels) = (Vec::new(), Vec::new(), Vec::new());
    let mut seen: HashMap<Vec<u32>, u64> = HashMap::new();
    let mut labels: HashMap<u64, ()> = HashMap::new();
    for element in solids() {
        let region = region_of(element, &regions, &mesh, raw)?;
        if labels.insert(element.label, ()).is_some() {
            return Err(ImportError::Duplicate {
                kind: "elements",
                first: element.label,
                second: element.label,
                problem: "the number is given twice",
            });
        }
        let nodes: Vec<u32> = element.nodes.iter().map(|n| index[n]).collect();
        if let Some(first) = seen.insert(sorted(nodes.clone()), element.label) {
            return Err(ImportError::Duplicate {
                kind: "elements",
                first,
                second: element.label,
                problem: "they have the same nodes",
            });
        }
        match element.kind {
            RawKind::Hex => {
                mesh.hexes.push(Hex { nodes: nodes.try_into().expect("8 nodes"), region });
                hex_labels.push(element.label);
            }
            RawKind::Tet10 => {
                mesh.tets10.push(Tet10 { nodes: nodes.try_into().expect("10 nodes"), region });
                tet10_labels.push(element.label);
            }
            _ if matches!(region, Region::Skin | Region::Subcutaneous | Region::Soft(_)) => {
                let region = mesh.region_name(region).to_owned();
                return Err(ImportError::Locking { element: element.label, region });
            }
            _ => {
                mesh.tets.push(Tet { nodes: nodes.try_into().expect("4 nodes"), region });
                tet_labels.push(element.label);
            }
        }
    }
    if mesh.hexes.is_empty() && mesh.tets10.is_empty() {
        return Err(ImportError::Support(
            "the file has neither hexahedra nor 10-node tetrahedra; the tissue under the pad has to be of them".into(),
        ));
    }
    hex_labels.extend(tet_labels);
    hex_labels.extend(tet10_labels);
    one_order(&mesh, &node_labels, &hex_labels)?;
    Ok(Draft { mesh, node_labels, index, element_labels: hex_labels, report })
}

/// Places of the nodes by their numbers, mm.
fn places(raw: &RawMesh, unit_mm: f64) -> Result<HashMap<u64, Vector3<f64>>, ImportError> {
    let mut places = HashMap::with_capacity(raw.nodes.len());
    for (label, place) in &raw.nodes {
        if places.insert(*label, place * unit_mm).is_some() {
            return Err(ImportError::Duplicate {
                kind: "nodes",
                first: *label,
                second: *label,
                problem: "the number is given twice (several parts in one file have to be numbered through)",
            });
        }
    }
    Ok(places)
}

/// The one region of an element.
fn region_of(
    element: &RawElement,
    regions: &BTreeMap<u64, Vec<Region>>,
    mesh: &Mesh,
    raw: &RawMesh,
) -> Result<Region, ImportError> {
    let regions = match regions.get(&element.label).map(Vec::as_slice) {
        Some([region]) => return Ok(*region),
        Some(several) => several.iter().map(|r| mesh.region_name(*r)).collect::<Vec<_>>().join(" and "),
        None => "no region".into(),
    };
    Err(ImportError::Region { element: element.label, regions, known: raw.names() })
}

/// Refuses nodes that elements of first and of second order share.
fn one_order(mesh: &Mesh, node_labels: &[u64], element_labels: &[u64]) -> Result<(), ImportError> {
    let mut first_order: Vec<Option<usize>> = vec![None; mesh.nodes.len()];
    let second = mesh.hexes.len() + mesh.tets.len();
    for (element, (nodes, _)) in mesh.elements().enumerate() {
        for &node in nodes {
            match first_order[node as usize] {
                Some(other) if element >= second => {
                    return Err(ImportError::MixedOrders {
                        second_order: element_labels[element],
                        first_order: element_labels[other],
                        node: node_labels[node as usize],
                    });
                }
                _ if element < second => first_order[node as usize] = Some(element),
                _ => {}
            }
        }
    }
    Ok(())
}

/// Element set of the plane that presses the finger in a whole contact problem, as the decks for CalculiX name it.
const PLANE: &str = "PLANE";

/// Elements of the plane, which is a body beside the finger.
fn plane(raw: &RawMesh, regions: &BTreeMap<u64, Vec<Region>>) -> HashSet<u64> {
    let members = named(&raw.element_sets, PLANE).into_iter().flatten().copied();
    members.filter(|label| !regions.contains_key(label)).collect()
}

/// Regions of each element.
fn regions(
    raw: &RawMesh,
    settings: &ImportedGeometry,
    soft_regions: &[String],
) -> Result<BTreeMap<u64, Vec<Region>>, ImportError> {
    let mut regions: BTreeMap<u64, Vec<Region>> = BTreeMap::new();
    let mut add = |members: &[u64], region: Region| {
        for label in members {
            let of = regions.entry(*label).or_default();
            if !of.contains(&region) {
                of.push(region);
            }
        }
    };
    let no_such = |key, name: &String| ImportError::NoSuchSet { key, name: name.clone(), known: raw.names() };
    let (names, defaults) = (&settings.regions, super::RegionNames::default());
    for (region, key, names, usual) in [
        (Region::Skin, "skin", &names.skin, &defaults.skin),
        (Region::Subcutaneous, "subcutaneous", &names.subcutaneous, &defaults.subcutaneous),
        (Region::DistalBone, "bone", &names.bone, &defaults.bone),
        (Region::ProximalBone, "proximal_bone", &names.proximal_bone, &defaults.proximal_bone),
        (Region::Nail, "nail", &names.nail, &defaults.nail),
    ] {
        for name in names {
            match named(&raw.element_sets, name) {
                Some(members) => add(members, region),
                // A set that the settings do not name may be missing.
                None if names == usual => {}
                None => return Err(no_such(format!("imported.regions.{key}"), name)),
            }
        }
    }
    for (k, name) in soft_regions.iter().enumerate() {
        let members = named(&raw.element_sets, name).ok_or_else(|| no_such(format!("tissue.regions.{name}"), name))?;
        add(members, Region::Soft(k as u16));
    }
    Ok(regions)
}

/// Slaves of the file's ties: they may lie on their masters.
fn tied_slaves(raw: &RawMesh) -> Vec<u64> {
    let mut slaves: Vec<u64> = raw.ties.iter().map(|t| t.slave).collect();
    slaves.sort_unstable();
    slaves
}

type Merged = (HashMap<u64, u32>, Vec<u64>, Vec<Vector3<f64>>);

/// Index, number and place of each node after nodes within `merge_mm` are merged; the lowest number is kept. Nodes that
/// the file ties are not merged.
fn merged(used: &[u64], places: &HashMap<u64, Vector3<f64>>, slaves: &[u64], merge_mm: f64) -> Merged {
    let mut near = Near::new(merge_mm.max(1e-9));
    let (mut index, mut labels, mut nodes) =
        (HashMap::with_capacity(used.len()), Vec::new(), Vec::<Vector3<f64>>::new());
    for &label in used {
        let place = places[&label];
        let tied = slaves.binary_search(&label).is_ok();
        let twin =
            near.around(&place).find(|&n| merge_mm > 0.0 && !tied && (nodes[n as usize] - place).norm() <= merge_mm);
        let node = twin.unwrap_or_else(|| {
            let node = nodes.len() as u32;
            nodes.push(place);
            labels.push(label);
            if !tied {
                near.insert(&place, node);
            }
            node
        });
        index.insert(label, node);
    }
    (index, labels, nodes)
}

/// The file's ties, and ties of the tetrahedra's nodes that lie near the hexahedra's outer faces.
pub(super) fn ties(draft: &mut Draft, raw: &RawMesh, settings: &ImportedGeometry) -> Result<(), ImportError> {
    let node = |n: &u64, draft: &Draft| {
        let what = || format!("a tie (*EQUATION) of node {n}");
        draft.index.get(n).copied().ok_or_else(|| ImportError::NoSuchNode { what: what(), node: *n })
    };
    for tie in &raw.ties {
        let slave = node(&tie.slave, draft)?;
        let masters =
            tie.masters.iter().map(|(n, w)| Ok((node(n, draft)?, *w))).collect::<Result<Vec<_>, ImportError>>()?;
        // Numbers in the file are rounded; weights that sum to 1 keep rigid motions free of stress.
        let sum: f64 = masters.iter().map(|m| m.1).sum();
        if !((sum - 1.0).abs() < 1e-6) {
            let what = format!("tie of node {}: its weights sum to {sum}, not 1", tie.slave);
            return Err(ImportError::Support(what));
        }
        let masters: Vec<(u32, f64)> = masters.into_iter().map(|(n, w)| (n, w / sum)).collect();
        let closest: Vector3<f64> = masters.iter().map(|(n, w)| draft.mesh.nodes[*n as usize] * *w).sum();
        let off = (closest - draft.mesh.nodes[slave as usize]).norm();
        if off > settings.tie_mm {
            let what = format!("tie of node {}: it lies {off:.3e} mm off its masters (tie_mm)", tie.slave);
            return Err(ImportError::Support(what));
        }
        draft.report.tie_moved_mm = draft.report.tie_moved_mm.max(off);
        draft.mesh.nodes[slave as usize] = closest;
        draft.mesh.ties.push(Tie { slave, masters });
    }
    tie_tets(draft, settings.tie_mm);
    Ok(())
}

/// Ties nodes of tetrahedra that share none with hexahedra and lie near these's outer faces.
fn tie_tets(draft: &mut Draft, tie_mm: f64) {
    let mesh = &draft.mesh;
    let mut of_hex = vec![false; mesh.nodes.len()];
    mesh.hexes.iter().flat_map(|h| h.nodes).for_each(|n| of_hex[n as usize] = true);
    let mut tied = vec![false; mesh.nodes.len()];
    mesh.ties.iter().for_each(|t| tied[t.slave as usize] = true);
    let free = |n: &u32| !of_hex[*n as usize] && !tied[*n as usize];
    let of_tets = mesh.elements().skip(mesh.hexes.len()).flat_map(|(nodes, _)| nodes).copied();
    let slaves = sorted(of_tets.filter(free).collect());
    if slaves.is_empty() {
        return;
    }
    let faces = bodies::outer_hex_faces(mesh);
    let size = |f: &[u32; 4]| (mesh.nodes[f[0] as usize] - mesh.nodes[f[2] as usize]).norm();
    let mut near = Near::new(faces.iter().map(size).fold(0.0, f64::max) + tie_mm);
    for (n, face) in faces.iter().enumerate() {
        let middle = face.iter().map(|c| mesh.nodes[*c as usize]).sum::<Vector3<f64>>() / 4.0;
        near.insert(&middle, n as u32);
    }
    let mut found = Vec::new();
    for slave in slaves {
        let place = mesh.nodes[slave as usize];
        let around: Vec<[u32; 4]> = near.around(&place).map(|n| faces[n as usize]).collect();
        if around.is_empty() {
            continue;
        }
        let closest = nearest_on_faces(&place, &around, &mesh.nodes);
        let off = (closest.position - place).norm();
        if off <= tie_mm {
            found.push((slave, closest, off));
        }
    }
    for (slave, closest, off) in found {
        draft.mesh.nodes[slave as usize] = closest.position;
        draft.mesh.ties.push(Tie { slave, masters: closest.masters });
        draft.report.tied_nodes += 1;
        draft.report.tie_moved_mm = draft.report.tie_moved_mm.max(off);
    }
}
