use super::*;

fn parse(text: &str) -> Result<RawMesh, String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("m.inp");
    std::fs::write(&path, text).unwrap();
    std::fs::write(dir.path().join("more.inc"), "*Nset, nset=Top\n 5, 6,\n 7, 8\n").unwrap();
    read(&path).map_err(|e| e.to_string())
}

const NODES: &str = "*Heading\n a cube, made by hand\n** comment\n*Node, nset=ALL\n1, 0, 0, 0\n2, 1., 0, 0\n\
    3, 1, 1.0D0, 0\n4, 0, 1\n5, 0, 0, 1\n6, 1, 0, 1\n7, 1, 1, 1\n8, 0, 1, 1\n";

#[test]
fn sets_lines_that_go_on_includes_and_cases() {
    let text = format!(
        "{NODES}*ELEMENT, type=c3d8rh,\n ELSET=Skin\n10, 1, 2, 3, 4,\n 5, 6, 7, 8\n*NSET, NSET=even, generate\n2, 8, 2\n\
         *INCLUDE, INPUT=more.inc\n*NSET, nset=both\nTOP, even\n*Surface, name=Pad, type=element\nSKIN, s1\n\
         *Material, name=x\n*Elastic\n1, 0.3\n"
    );
    let mesh = parse(&text).unwrap();
    assert_eq!(mesh.nodes.len(), 8);
    assert_eq!(mesh.nodes[2].1, Vector3::new(1.0, 1.0, 0.0));
    assert_eq!(mesh.elements[0].nodes, [1, 2, 3, 4, 5, 6, 7, 8]);
    assert_eq!(mesh.element_sets["Skin"], [10]);
    assert_eq!(mesh.node_sets["both"], [2, 4, 5, 6, 7, 8]);
    assert_eq!(mesh.surfaces["Pad"], [[1, 2, 3, 4]]);
    assert_eq!(mesh.ignored, ["*HEADING", "*MATERIAL", "*ELASTIC"]);
}

#[test]
fn equations_are_ties() {
    let equation = |dof| format!("3\n9, {dof}, -2., 1, {dof}, 1.5,\n2, {dof}, 0.5\n");
    let mesh = parse(&format!("{NODES}*EQUATION\n{}{}{}", equation(1), equation(2), equation(3))).unwrap();
    assert_eq!(mesh.ties, [RawTie { slave: 9, masters: vec![(1, 0.75), (2, 0.25)] }]);
    let error = parse(&format!("{NODES}*EQUATION\n{}{}", equation(1), equation(2))).unwrap_err();
    assert!(error.contains("node 9"), "{error}");
}

#[test]
fn errors_name_line_and_value() {
    for (more, expected) in [
        ("*NODE\n9, 1, x, 0\n", ":14: *NODE: `x` is not a finite number (column 3)"),
        ("*ELEMENT, TYPE=C3D8\n1, 1, 2, 3, 4, 5, 6, 7\n", ":14: *ELEMENT: `1, 1, 2, 3, 4, 5, 6, 7` has 7 of 8"),
        ("*ELEMENT, TYPE=C3D8\n1, 1, 2, 3, 4,\n", ":14: *ELEMENT: `1,1,2,3,4` is cut off"),
        ("*ELEMENT, TYPE=C3D15H\n", ":13: *ELEMENT TYPE: `C3D15H` is not read"),
        ("*ELEMENT\n", ":13: *ELEMENT: `TYPE` is missing"),
        ("*NSET, NSET=a, GENERATE\n5, 1\n", ":14: *NSET: `5, 1` is not `from, to, step`"),
        ("*NSET, NSET=a\nb\n", ":14: set: `b` is used here but never defined"),
        ("*NSET, NSET=a\n1.5\n", ":14: *NSET: `1.5` is neither"),
        ("*NGEN\n1, 3\n", ":13: keyword: `*NGEN` makes or moves"),
        ("*SURFACE, NAME=p\n1, S7\n", ":14: *SURFACE: `1, S7` is not"),
        ("*INCLUDE, INPUT=nowhere\n", "nowhere"),
        ("*INCLUDE, INPUT=m.inp\n", "includes itself"),
    ] {
        let error = parse(&format!("{NODES}{more}")).unwrap_err();
        assert!(error.contains(expected), "{error}\nshould contain: {expected}");
    }
    assert!(parse("1, 2\n").unwrap_err().contains("no keyword"));
}

/// A file with other files beside it.
fn parse_with(files: &[(&str, &str)]) -> Result<RawMesh, String> {
    let dir = tempfile::tempdir().unwrap();
    files.iter().for_each(|(name, text)| std::fs::write(dir.path().join(name), text).unwrap());
    read(&dir.path().join(files[0].0)).map_err(|e| e.to_string())
}

#[test]
fn data_lines_in_another_file() {
    let whole =
        parse(&format!("{NODES}*ELEMENT, TYPE=C3D8, ELSET=skin\n10, 1,2,3,4,5,6,7,8\n*NSET, NSET=a\n1, 2\n")).unwrap();
    let nodes = NODES.split_once("*Node, nset=ALL\n").unwrap().1;
    let main = "*Heading\n*Node, nset=ALL, input=nodes.dat\n*Element, type=C3D8, elset=skin, INPUT = \"elements.dat\"\n\
        *Nset, nset=a, input=a.dat\n2\n";
    let files =
        [("m.inp", main), ("nodes.dat", nodes), ("elements.dat", "** one\n10, 1,2,3,4,\n5,6,7,8\n"), ("a.dat", "1\n")];
    let apart = parse_with(&files).unwrap();
    assert_eq!((&apart.nodes, &apart.elements), (&whole.nodes, &whole.elements));
    assert_eq!((&apart.node_sets, &apart.element_sets), (&whole.node_sets, &whole.element_sets));
    assert!(parse_with(&files[..1]).unwrap_err().contains("nodes.dat"));
    let wrong = [("m.inp", main), ("nodes.dat", "1, 0, 0, 0\n2, 0, x\n")];
    assert!(parse_with(&wrong).unwrap_err().contains("nodes.dat:2: *NODE: `x` is not a finite number"));
    let keyword = [("m.inp", main), ("nodes.dat", "*Node\n1, 0, 0, 0\n")];
    assert!(
        parse_with(&keyword).unwrap_err().contains("nodes.dat:1: *NODE: `*Node` is a keyword in a file of data lines")
    );
}

#[test]
fn faces_and_hexahedra_of_second_order() {
    let more = (9..=27).map(|n| format!("{n}, 0.5, 0.5, 0.{n}\n")).collect::<String>();
    let list = |count: u64| (1..=count).map(|n| format!(", {n}")).collect::<String>();
    for (hexes, hex_nodes, faces, face_nodes) in [("C3D20R", 20, "CPS8", 8), ("C3D27", 27, "M3D9", 9)] {
        let mesh = parse(&format!(
            "{NODES}{more}*ELEMENT, TYPE={hexes}, ELSET=skin\n10{}\n*ELEMENT, TYPE={faces}, ELSET=pad\n11{}\n\
             *ELEMENT, TYPE=CPS6, ELSET=fix\n12, 1, 2, 3, 9, 10, 11\n*ELEMENT, TYPE=T3D3, ELSET=edge\n13, 1, 2, 9\n\
             *SURFACE, NAME=up\npad, SPOS\nfix, SNEG\n",
            list(hex_nodes),
            list(face_nodes)
        ))
        .unwrap();
        let kinds: Vec<_> = mesh.elements.iter().map(|e| (e.kind, e.nodes.len())).collect();
        assert_eq!(kinds, [(RawKind::Hex, 8), (RawKind::Quad, face_nodes as usize), (RawKind::Tri, 6)]);
        assert_eq!(mesh.surfaces["up"], [vec![1, 2, 3, 4], vec![1, 2, 3]]);
        assert_eq!(
            mesh.ignored[1..],
            [format!("nodes of {hexes} but for its corners"), "elements of type T3D3".into()]
        );
    }
}

/// Two parts of one cube each, numbered from 1, the upper one twice, and points of the assembly.
fn assembly(instances: &str) -> String {
    let cube = NODES.split_once("*Node, nset=ALL\n").unwrap().1;
    format!(
        "*Heading\n*Part, name=Low\n*Node\n{cube}*Element, type=C3D8H\n1, 1,2,3,4,5,6,7,8\n*Nset, nset=Set-1\n5, 6, 7, 8\n\
         *Elset, elset=Set-1\n1\n*Surface, name=under, type=element\nSet-1, S1\n*End Part\n\
         *Part, name=\"Up per\"\n*Node\n{cube}*Element, type=C3D8H, elset=gel\n1, 1,2,3,4,5,6,7,8\n*Elset, elset=Set-1\ngel\n\
         *End Part\n*Assembly, name=Assembly\n{instances}*Node\n1, 9., 9., 9.\n*Nset, nset=Ref\n1\n\
         *Nset, nset=Set-1, instance=Up-1\n5, 6\n*Nset, nset=Set-1, instance=UP-2\n7\n*Elset, elset=all, instance=Low-1, generate\n1, 1\n\
         *Elset, elset=all\nUp-1.gel, Up-2.1\n*Elset, elset=_top_S2, internal, instance=Up-2\n1\n*Surface, name=top\n_top_S2, S2\n\
         Low-1.1, S1\n*Equation\n2\nUp-1.1, 1, -1., Low-1.5, 1, 1.\n2\nUp-1.1, 2, -1., Low-1.5, 2, 1.\n2\nUp-1.1, 3, -1., Low-1.5, 3, 1.\n\
         *End Assembly\n"
    )
}

const INSTANCES: &str = "*Instance, name=Low-1, part=Low\n*End Instance\n*Instance, name=Up-1, part=\"Up per\"\n0., 0., 1.\n*End Instance\n\
    *Instance, name=Up-2, part=\"UP PER\"\n1., 0., 0.\n1., 0., 0., 1., 1., 0., 90.\n*End Instance\n";

#[test]
fn parts_and_placed_instances() {
    let mesh = parse(&assembly(INSTANCES)).unwrap();
    let place = |label: u64| mesh.nodes.iter().find(|n| n.0 == label).unwrap().1;
    // The first instance keeps its numbers; the second is moved along z.
    let labels: Vec<u64> = mesh.elements.iter().map(|e| e.label).collect();
    assert_eq!(labels, [1, 11, 21]);
    assert_eq!((place(7), place(17)), (Vector3::new(1.0, 1.0, 1.0), Vector3::new(1.0, 1.0, 2.0)));
    // Moved by 1 along x, then turned by 90 degrees about the line x = 1 along y: x goes to -z, z to x.
    for (label, expected) in
        [(21, [1.0, 0.0, 0.0]), (22, [1.0, 0.0, -1.0]), (25, [2.0, 0.0, 0.0]), (27, [2.0, 1.0, -1.0])]
    {
        assert!((place(label) - Vector3::from(expected)).norm() < 1e-12, "{label}: {}", place(label));
    }
    assert_eq!(place(31), Vector3::new(9.0, 9.0, 9.0));
    assert_eq!(mesh.element_sets["all"], [1, 11, 21]);
    assert_eq!((&mesh.element_sets["Up-1"], &mesh.element_sets["Up per"]), (&vec![11], &vec![11, 21]));
    // The assembly's own set hides those of its parts, which keep their whole names; the parts' elements have no rival.
    assert_eq!(mesh.node_sets["Set-1"], [15, 16, 27]);
    assert_eq!((&mesh.node_sets["Low-1.Set-1"], &mesh.element_sets["Set-1"]), (&vec![5, 6, 7, 8], &vec![1, 11, 21]));
    assert_eq!((&mesh.element_sets["gel"], &mesh.node_sets["Ref"]), (&vec![11, 21], &vec![31]));
    assert_eq!(mesh.surfaces["top"], [[25, 28, 27, 26], [1, 2, 3, 4]]);
    assert_eq!(
        (&mesh.surfaces["under"], &mesh.surfaces["Low-1.under"]),
        (&vec![vec![1, 2, 3, 4]], &vec![vec![1, 2, 3, 4]])
    );
    assert_eq!(mesh.ties, [RawTie { slave: 11, masters: vec![(5, 1.0)] }]);
    assert_eq!(
        mesh.renumbered,
        ["10 was added to the numbers of instance Up-1", "20 was added to the numbers of instance Up-2"]
    );
    assert_eq!(mesh.ignored, ["*HEADING"]);
}

#[test]
fn instances_with_a_mesh_of_their_own_and_parts_without_instance() {
    // An independent instance holds the mesh; a part that nothing places is no part of the model.
    let cube = NODES.split_once("*Node, nset=ALL\n").unwrap().1;
    let element = "*Element, type=C3D8, elset=gel\n7, 1,2,3,4,5,6,7,8\n";
    let parts = format!("*Part, name=A\n*End Part\n*Part, name=B\n*Node\n{cube}{element}*End Part\n");
    let mesh = parse(&format!(
        "{parts}*Assembly, name=x\n*Instance, name=A-1, part=A\n0, 0, 5\n*Node\n{cube}{element}*End Instance\n*End Assembly\n"
    ))
    .unwrap();
    assert_eq!((mesh.elements.len(), mesh.nodes[0].1), (1, Vector3::new(0.0, 0.0, 5.0)));
    assert_eq!((&mesh.element_sets["gel"], &mesh.element_sets["A-1"]), (&vec![7], &vec![7]));
    assert_eq!(mesh.ignored, ["part B, of which there is no instance"]);
    // Without an assembly the parts are the model.
    let mesh = parse(&parts).unwrap();
    assert_eq!((mesh.elements.len(), &mesh.element_sets["B"], mesh.renumbered.len()), (1, &vec![7], 0));
}

#[test]
fn errors_of_instances_name_line_and_value() {
    for (instances, expected) in [
        (INSTANCES.replace("part=Low", "part=Other"), "*INSTANCE: `Other` is no part of the file"),
        (INSTANCES.replace("name=Up-1", "name=low-1"), "*INSTANCE: `low-1` is a second instance of this name"),
        (INSTANCES.replace("0., 0., 1.\n", "0., 0., x\n"), "*INSTANCE: `x` is not a finite number (column 3)"),
        (INSTANCES.replace("1., 1., 0., 90.", "1., 0., 0., 90."), "turns about an axis of two equal points"),
        (INSTANCES.replace("0., 0., 1.\n", "0., 0., 1.\n0,0,0,0,0,1,9\n1\n"), "*INSTANCE: `1` is a third line"),
        (INSTANCES.replacen("*End Instance\n", "", 1), "`*INSTANCE` stands inside of a part or an instance"),
        (INSTANCES.replace("Up-1", "Up-7"), "*NSET: `Up-1` is no instance"),
        (INSTANCES.replace("part=Low", "part=Low, library=x"), "LIBRARY` is the result of another analysis"),
    ] {
        let error = parse(&assembly(&instances)).unwrap_err();
        assert!(error.contains(expected), "{error}\nshould contain: {expected}");
    }
    assert!(parse("*Part, name=A\n").unwrap_err().contains("`A` has no *END PART"));
}
