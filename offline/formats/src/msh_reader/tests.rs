use super::*;

fn parse(text: impl AsRef<[u8]>) -> Result<RawMesh, String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("m.msh");
    std::fs::write(&path, text).unwrap();
    read(&path).map_err(|e| e.to_string())
}

const TET: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 7 \"the pad\"\n3 1 \"skin\"\n\
    $EndPhysicalNames\n$Entities\n0 0 1 1\n3 0 0 0 1 1 1 1 7 0\n9 0 0 0 1 1 1 1 1 0\n$EndEntities\n$Nodes\n1 4 1 4\n\
    3 9 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n$Elements\n2 2 1 2\n2 3 2 1\n1 1 3 2\n3 9 4 1\n\
    2 1 2 3 4\n$EndElements\n";

#[test]
fn a_tetrahedron_with_groups() {
    let mesh = parse(TET).unwrap();
    assert_eq!(mesh.elements, [RawElement { label: 2, kind: RawKind::Tet, nodes: vec![1, 2, 3, 4] }]);
    assert_eq!(mesh.element_sets["skin"], [2]);
    assert_eq!(mesh.node_sets["the pad"], [1, 2, 3]);
    assert_eq!(mesh.surfaces["the pad"], [[1, 3, 2]]);
}

/// The mesh of second order in each of Gmsh's four formats.
fn written_by_gmsh(name: &str) -> RawMesh {
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/meshes").join(name)).unwrap()
}

#[test]
fn both_versions_in_text_and_binary_say_the_same() {
    let text = written_by_gmsh("wedge_41.msh");
    assert!(text.elements.len() > 10 && text.elements.iter().all(|e| e.kind == RawKind::Tet10), "{text:?}");
    // Every edge node lies in the middle of its edge, so that the order of nodes is right.
    let places: BTreeMap<u64, Vector3<f64>> = text.nodes.iter().copied().collect();
    for element in &text.elements {
        for (edge, [a, b]) in [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]].into_iter().enumerate() {
            let middle = (places[&element.nodes[a]] + places[&element.nodes[b]]) / 2.0;
            assert!((places[&element.nodes[4 + edge]] - middle).norm() < 1e-9, "{element:?}");
        }
    }
    for name in ["wedge_41_binary.msh", "wedge_22.msh", "wedge_22_binary.msh"] {
        let other = written_by_gmsh(name);
        assert_eq!((text.nodes.len(), text.elements.len()), (other.nodes.len(), other.elements.len()), "{name}");
        assert_eq!((&text.element_sets, &text.node_sets), (&other.element_sets, &other.node_sets), "{name}");
        let in_order = |mesh: &RawMesh| {
            let mut elements: Vec<(u64, Vec<u64>)> = mesh.elements.iter().map(|e| (e.label, e.nodes.clone())).collect();
            elements.sort();
            (elements, mesh.surfaces.clone())
        };
        assert_eq!(in_order(&text), in_order(&other), "{name}");
        for (tag, place) in &other.nodes {
            assert!((places[tag] - place).norm() < 1e-12, "{name}: node {tag}");
        }
    }
}

#[test]
fn a_binary_file_that_is_cut_or_damaged_is_refused_with_its_place() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/meshes/wedge_41_binary.msh");
    let whole = std::fs::read(&path).unwrap();
    let place = |what: &[u8]| whole.windows(what.len()).position(|w| w == what).unwrap();
    let cut = parse(&whole[..place(b"$EndNodes") - 100]).unwrap_err();
    assert!(cut.contains("$Nodes at byte") && cut.contains("the file ends within the section"), "{cut}");
    let mut damaged = whole.clone();
    // The last coordinate before the line break that ends the section.
    let last = place(b"$EndNodes") - 9;
    damaged[last..last + 8].copy_from_slice(&f64::NAN.to_le_bytes());
    let damaged = parse(damaged).unwrap_err();
    assert!(damaged.contains("is not at a finite place"), "{damaged}");
    let mut swapped = whole.clone();
    let one = place(b"$EndMeshFormat") - 5;
    swapped[one..one + 4].reverse();
    let swapped = parse(swapped).unwrap_err();
    assert!(swapped.contains("$MeshFormat at byte") && swapped.contains("big-endian"), "{swapped}");
}

#[test]
fn errors_name_line_section_and_value() {
    let cut = TET.find("$EndNodes").unwrap();
    for (text, expected) in [
        (TET.replace("4.1 0 8", "4.0 0 8"), ":2: $MeshFormat: `4.0 0 8` is not version 4.1 or 2.2"),
        (TET.replace("3 9 4 1\n2 1", "3 9 18 1\n2 1"), ":30: $Elements: `element type 18` is not read"),
        (TET.replace("1 0 0\n0 1 0", "1 x 0\n0 1 0"), ":22: $Nodes: `x` is not such a number"),
        (TET.replace("1 0 0\n0 1 0", "1 nan 0\n0 1 0"), "`node 2` is not at a finite place"),
        (TET.replace("2 1 2 3 4\n", "2 1 2 3\n"), "the line has too few numbers"),
        (TET.replace("2 1 2 3 4\n", "2 1 2 3 4 5\n"), ":31: $Elements: `5` is more than the line should hold"),
        (TET[..cut].to_owned(), "the file ends within the section"),
        (TET[..cut].to_owned() + "$EndNodes\n", "`$Elements` is missing"),
        (TET.replace("$Nodes\n1 4", "$Nodes\n1 5"), "`5` nodes are announced, 4"),
        (TET.replace("$Elements\n2 2", "$Elements\n2 3"), "`3` elements are announced, 2"),
        ("solid\n".into(), "is outside of a section"),
    ] {
        let error = parse(text).unwrap_err();
        assert!(error.contains(expected), "{error}\nshould contain: {expected}");
    }
}
