//! Fingers of 10-node tetrahedra.

use super::tests::{data, held};
use super::*;
use crate::block::{block, coordinates, into_second_order, into_tets};
use crate::{check, quality};
use fingerpad_formats::{inp, inp_reader, msh, msh_reader};

/// A block of skin of 2 x 3 x 1 mm whose upper face is held.
fn tets() -> Mesh {
    let mut hexes =
        block(&coordinates(0.0, 2.0, 2, 1.0), &coordinates(0.0, 3.0, 3, 1.0), &coordinates(0.0, 1.0, 2, 1.0));
    let top = hexes.node_set("z1").to_vec();
    hexes.node_sets.insert("top".into(), top);
    into_second_order(&into_tets(&hexes))
}

/// The same as the content of a file: elements from 101, nodes from 1, the pad by its lowest nodes.
fn raw() -> RawMesh {
    let mesh = tets();
    let numbers = |nodes: &[u32]| nodes.iter().map(|n| u64::from(*n) + 1).collect::<Vec<_>>();
    let mut raw = RawMesh::new();
    raw.nodes = mesh.nodes.iter().enumerate().map(|(n, p)| (n as u64 + 1, *p)).collect();
    raw.node_sets.insert("top".into(), numbers(mesh.node_set("top")));
    for (n, tet) in mesh.tets10.iter().enumerate() {
        raw.elements.push(RawElement { label: 101 + n as u64, kind: RawKind::Tet10, nodes: numbers(&tet.nodes) });
        raw.element_sets.entry("skin".into()).or_default().push(101 + n as u64);
    }
    raw
}

fn refused(change: impl Fn(&mut RawMesh)) -> String {
    let mut raw = raw();
    change(&mut raw);
    imported_fingertip(&raw, &held(), &[]).unwrap_err().to_string()
}

#[test]
fn our_own_files_come_back() {
    let mesh = tets();
    let dir = tempfile::tempdir().unwrap();
    let (a, b) = (dir.path().join("f.inp"), dir.path().join("f.msh"));
    inp::write(&a, &mesh, &Default::default()).unwrap();
    msh::write(&b, &mesh).unwrap();
    for (name, raw) in [("inp", inp_reader::read(&a).unwrap()), ("msh", msh_reader::read(&b).unwrap())] {
        let made = imported_fingertip(&raw, &held(), &[]).unwrap().fingertip.mesh;
        check(&made).unwrap();
        assert_eq!(made.nodes.len(), mesh.nodes.len(), "{name}");
        assert_eq!((&made.tets10, made.pad_nodes()), (&mesh.tets10, mesh.pad_nodes()), "{name}");
        assert_eq!(made.pad_triangles.len(), mesh.pad_triangles.len(), "{name}");
        assert!((quality(&made).pad_area_mm2 - 6.0).abs() < 1e-12, "{name}");
    }
}

#[test]
fn what_gmsh_wrote_has_its_volume_and_pad() {
    let made =
        imported_fingertip(&msh_reader::read(&data("wedge_41_binary.msh")).unwrap(), &ImportedGeometry::default(), &[])
            .unwrap();
    let mesh = &made.fingertip.mesh;
    check(mesh).unwrap();
    let report = quality(mesh);
    // A wedge of 2 x 1 mm below, 1 x 1 mm above, 1 mm high.
    println!("{report:?}");
    assert!((report.volume_mm3() - 1.5).abs() < 1e-12 && report.worst_tet_scaled_jacobian > 0.1, "{report:?}");
}

#[test]
fn the_pad_is_found_without_a_name_and_inside_out_elements_are_turned() {
    let mut raw = raw();
    // Corners 1 and 2 changed, and with them edges 01 and 02, 13 and 23.
    let nodes = &mut raw.elements[5].nodes;
    [(1, 2), (4, 6), (8, 9)].into_iter().for_each(|(a, b)| nodes.swap(a, b));
    let made = imported_fingertip(&raw, &held(), &[]).unwrap();
    assert_eq!(made.report.turned_elements, 1);
    assert_eq!(made.fingertip.mesh.tets10, tets().tets10);
    let triangles = |mesh: &Mesh| mesh.pad_triangles.iter().copied().collect::<std::collections::BTreeSet<_>>();
    assert_eq!(triangles(&made.fingertip.mesh), triangles(&tets()));
}

#[test]
fn refusals_name_the_files_numbers() {
    let first_order = |raw: &mut RawMesh, e: usize| {
        raw.elements[e].kind = RawKind::Tet;
        raw.elements[e].nodes.truncate(4);
    };
    for (expected, text) in [
        ("element 106 is twisted", refused(|r| r.elements[5].nodes.swap(0, 9))),
        ("element 107 (skin) is a 4-node tetrahedron, which locks", refused(|r| first_order(r, 6))),
        (
            "of 10 nodes and element 107 of first order share node",
            refused(|r| {
                first_order(r, 6);
                r.element_sets.get_mut("skin").unwrap().retain(|e| *e != 107);
                r.element_sets.insert("nail".into(), vec![107]);
            }),
        ),
        (
            "an edge belongs to 4 outer faces",
            refused(|r| {
                // The edge nodes of the last element's faces are its own.
                let last = r.elements.len() - 1;
                for n in 4..10 {
                    let place = r.nodes[r.elements[last].nodes[n] as usize - 1].1;
                    r.nodes.push((9000 + n as u64, place + Vector3::x() * 0.01));
                    r.elements[last].nodes[n] = 9000 + n as u64;
                }
            }),
        ),
        ("a hole inside", {
            let mut mesh =
                into_second_order(&into_tets(&block(&[0., 1., 2., 3.], &[0., 1., 2., 3.], &[0., 1., 2., 3.])));
            mesh.tets10.drain(13 * 6..14 * 6);
            let dir = tempfile::tempdir().unwrap();
            let path = dir.path().join("m.msh");
            msh::write(&path, &mesh).unwrap();
            let mut settings = held();
            settings.sets.proximal_fix = Some("z1".into());
            imported_fingertip(&msh_reader::read(&path).unwrap(), &settings, &[]).unwrap_err().to_string()
        }),
    ] {
        println!("{text}");
        assert!(text.contains(expected), "{text}\nshould contain: {expected}");
    }
}

#[test]
fn edge_nodes_in_the_order_of_another_format_are_named() {
    for (order, found, expected) in [
        // Gmsh's order in an .inp, and Abaqus' in a .msh, which the reader has put into the other.
        ([4, 5, 6, 7, 9, 8], "1-2, 2-3, 3-1, 1-4, 3-4, 2-4", "1-2, 2-3, 3-1, 1-4, 2-4, 3-4"),
        ([4, 6, 5, 7, 8, 9], "1-2, 3-1, 2-3, 1-4, 2-4, 3-4", "1-2, 2-3, 3-1, 1-4, 2-4, 3-4"),
        ([6, 4, 5, 8, 9, 7], "3-1, 1-2, 2-3, 2-4, 3-4, 1-4", "1-2, 2-3, 3-1, 1-4, 2-4, 3-4"),
    ] {
        let change = |raw: &mut RawMesh| {
            for element in &mut raw.elements {
                let nodes = element.nodes.clone();
                (0..6).for_each(|k| element.nodes[4 + k] = nodes[order[k]]);
            }
        };
        let text = refused(change);
        let count = raw().elements.len();
        assert!(
            text.contains(&format!("edges {found} of its corners, and the format has {expected}; {count} elements")),
            "{text}"
        );
    }
    let text = refused(|raw| {
        raw.gmsh_edges = true;
        raw.elements.iter_mut().for_each(|element| element.nodes.swap(8, 9));
    });
    assert!(
        text.contains(
            "edges 1-2, 2-3, 3-1, 1-4, 2-4, 3-4 of its corners, and the format has 1-2, 2-3, 3-1, 1-4, 3-4, 2-4"
        ),
        "{text}"
    );
    // Two corners that are exchanged are no matter of the edges' order alone, and one element is counted alone.
    let text = refused(|raw| raw.elements[3].nodes.swap(8, 9));
    assert!(text.contains("element 104: its mid-side nodes") && text.contains("; 1 elements of the file"), "{text}");
}

#[test]
fn faces_of_second_order_hold_all_their_nodes() {
    let mut raw = raw();
    let top: Vec<u64> = raw.node_sets.remove("top").unwrap();
    // The held surface as 6-node triangles, as Gmsh writes physical surfaces.
    let made = imported_fingertip(&self::raw(), &held(), &[]).unwrap().fingertip;
    let mut label = 5000;
    for face in &made.outer_triangles {
        let nodes: Vec<u64> = face.iter().map(|n| u64::from(*n) + 1).collect();
        if nodes.iter().all(|n| top.contains(n)) {
            label += 1;
            raw.elements.push(RawElement { label, kind: RawKind::Tri, nodes });
            raw.element_sets.entry("top".into()).or_default().push(label);
        }
    }
    let found = imported_fingertip(&raw, &held(), &[]).unwrap().fingertip.mesh;
    let mut expected: Vec<u32> = top.iter().map(|n| *n as u32 - 1).collect();
    expected.sort_unstable();
    assert_eq!(found.node_set(set::PROXIMAL_FIX), expected);
}
