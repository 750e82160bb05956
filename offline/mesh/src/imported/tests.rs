use super::*;
use crate::{FingertipShape, MeshPreset, Region, fingertip, quality};
use fingerpad_formats::inp;
use fingerpad_formats::inp_reader;
use fingerpad_formats::msh;
use fingerpad_formats::msh_reader;

pub(super) fn data(name: &str) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("data/meshes").join(name)
}

/// Sets of the cushion that Gmsh made, as a configuration file has them.
fn cushion() -> ImportedGeometry {
    toml::from_str(
        "frame = 'finger'\n[regions]\nskin = ['epidermis']\nsubcutaneous = ['pulp']\nbone = ['phalanx']\nnail = ['plate']\n\
         [sets]\npad = 'pad'\nproximal_fix = 'cut'\nnail_fix = 'nail top'\n",
    )
    .unwrap()
}

fn check_cushion(made: &ImportedFingertip) {
    let mesh = &made.fingertip.mesh;
    // The core, and five sides of three layers of pulp and one of skin.
    assert_eq!((mesh.hexes.len(), mesh.pad_faces.len()), (216 + 5 * 36 * 4, 36));
    assert!(mesh.tets.len() > 80 && made.report.tied_nodes > 9 && made.report.turned_elements == 0);
    // The middle of the spheres is the origin of the file: 6 mm over the plane at any inclination.
    let touch = made.fingertip.touch;
    let height = touch.to_plane(&Vector3::zeros()).z;
    println!("middle at {height:.4} mm, radius {:.3} mm; {:?}", touch.curvature_radius_mm, made.report);
    assert!((height - 6.0).abs() < 0.03, "{height}");
    let report = quality(mesh);
    let half_ball = 2.0 / 3.0 * std::f64::consts::PI * 216.0;
    let hexes = report.volume_mm3() - report.regions[&Region::Nail].volume_mm3;
    assert!(hexes < half_ball && hexes > 0.93 * half_ball, "{hexes} {half_ball}");
    assert_eq!(mesh.node_set(set::PROXIMAL_FIX).len(), 49);
    assert!(mesh.node_set(set::NAIL_FIX).len() > 8);
}

#[test]
fn gmsh_wrote_it() {
    let raw = msh_reader::read(&data("cushion.msh")).unwrap();
    let made = imported_fingertip(&raw, &cushion(), &[]).unwrap();
    check_cushion(&made);
    // The same through Gmsh's .inp, whose names have no blanks.
    let mut settings = cushion();
    settings.sets.nail_fix = Some("nail_top".into());
    let other = imported_fingertip(&inp_reader::read(&data("cushion_gmsh.inp")).unwrap(), &settings, &[]).unwrap();
    check_cushion(&other);
}

#[test]
fn our_own_files_come_back() {
    let tip = fingertip(&FingertipShape::default(), &MeshPreset::Coarse.divisions()).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let (a, b) = (dir.path().join("f.inp"), dir.path().join("f.msh"));
    inp::write(&a, &tip.mesh, &Default::default()).unwrap();
    msh::write(&b, &tip.mesh).unwrap();
    let made = imported_fingertip(&inp_reader::read(&a).unwrap(), &ImportedGeometry::default(), &[]).unwrap();
    let mesh = &made.fingertip.mesh;
    let apart = mesh.nodes.iter().zip(&tip.mesh.nodes).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(apart < 1e-9, "{apart}");
    assert_eq!((&mesh.hexes.len(), &mesh.tets.len()), (&tip.mesh.hexes.len(), &tip.mesh.tets.len()));
    assert_eq!(mesh.node_sets, tip.mesh.node_sets);
    let faces = |m: &Mesh| m.pad_faces.iter().map(|f| sorted(f.to_vec())).collect::<std::collections::BTreeSet<_>>();
    assert_eq!(faces(mesh), faces(&tip.mesh));
    assert_eq!(mesh.ties.len(), tip.mesh.ties.len());
    assert_eq!((made.report.merged_nodes, made.report.turned_elements, made.report.unused_nodes), (0, 0, 0));
    crate::check(mesh).unwrap();
    let radius = made.fingertip.touch.curvature_radius_mm;
    assert!((radius / tip.touch.curvature_radius_mm - 1.0).abs() < 0.2, "{radius}");

    // A .msh file has no ties: the nail's nodes become the skin's, on which they lie.
    let made = imported_fingertip(&msh_reader::read(&b).unwrap(), &ImportedGeometry::default(), &[]).unwrap();
    let mesh = &made.fingertip.mesh;
    assert_eq!(made.report.merged_nodes, tip.mesh.ties.len());
    assert_eq!(mesh.nodes.len() + tip.mesh.ties.len(), tip.mesh.nodes.len());
    assert_eq!((mesh.hexes.len(), mesh.tets.len()), (tip.mesh.hexes.len(), tip.mesh.tets.len()));
    assert_eq!(mesh.pad_faces.len(), tip.mesh.pad_faces.len());
    assert!(mesh.ties.is_empty());
    crate::check(mesh).unwrap();
}

/// 3 x 3 x 3 cubes of skin over z = 0, elements numbered from 101, nodes from 1.
fn cubes() -> RawMesh {
    let mut raw = RawMesh::new();
    let node = |i: u64, j: u64, k: u64| 1 + (k * 4 + j) * 4 + i;
    for k in 0..4 {
        for j in 0..4 {
            for i in 0..4 {
                raw.nodes.push((node(i, j, k), Vector3::new(i as f64 - 1.5, j as f64 - 1.5, k as f64)));
                if k == 3 {
                    raw.node_sets.entry("top".into()).or_default().push(node(i, j, k));
                }
            }
        }
    }
    for k in 0..3 {
        for j in 0..3 {
            for i in 0..3 {
                let level = |k| [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)];
                let label = 101 + raw.elements.len() as u64;
                let nodes = [level(k), level(k + 1)].concat();
                raw.elements.push(RawElement { label, kind: RawKind::Hex, nodes });
                raw.element_sets.entry("skin".into()).or_default().push(label);
            }
        }
    }
    raw
}

pub(super) fn held() -> ImportedGeometry {
    let sets = SetNames { proximal_fix: Some("top".into()), ..SetNames::default() };
    ImportedGeometry { sets, ..ImportedGeometry::default() }
}

/// The error of the cubes after a change.
fn refused(change: impl Fn(&mut RawMesh), settings: &ImportedGeometry) -> String {
    let mut raw = cubes();
    change(&mut raw);
    imported_fingertip(&raw, settings, &[]).unwrap_err().to_string()
}

#[test]
fn cubes_are_accepted_and_mended() {
    let made = imported_fingertip(&cubes(), &held(), &[]).unwrap();
    assert_eq!(made.fingertip.mesh.pad_faces.len(), 9);
    let mut raw = cubes();
    raw.elements[4].nodes.rotate_left(4);
    raw.nodes.push((900, Vector3::zeros()));
    // The upper layer on nodes of its own, at the same places.
    let copies: Vec<_> = raw.nodes.iter().filter(|(_, p)| p.z == 2.0).map(|(n, p)| (n + 500, *p)).collect();
    let numbers: Vec<u64> = copies.iter().map(|(n, _)| n - 500).collect();
    raw.nodes.extend(copies);
    for element in &mut raw.elements[18..] {
        element.nodes.iter_mut().filter(|n| numbers.contains(n)).for_each(|n| *n += 500);
    }
    let mended = imported_fingertip(&raw, &held(), &[]).unwrap();
    let report = &mended.report;
    assert_eq!((report.turned_elements, report.unused_nodes, report.merged_nodes), (1, 1, 16));
    assert_eq!(mended.fingertip.mesh.nodes, made.fingertip.mesh.nodes);
    // Without merging the layer is loose, and the message contains the gap.
    for (_, place) in raw.nodes.iter_mut().filter(|(n, _)| *n > 500 && *n < 900) {
        place.z += 0.01;
    }
    let error = imported_fingertip(&raw, &held(), &[]).unwrap_err();
    assert!(
        matches!(&error, ImportError::Apart { elements: 9, first: 119, gap_mm, .. } if (gap_mm - 0.01).abs() < 1e-9)
    );
    let wide = ImportedGeometry { merge_mm: 0.02, ..held() };
    assert_eq!(imported_fingertip(&raw, &wide, &[]).unwrap().report.merged_nodes, 16);
}

#[test]
fn refusals_name_the_files_numbers() {
    let settings = held();
    for (expected, text) in [
        ("element 105 is twisted", refused(|r| r.elements[4].nodes.swap(0, 2), &settings)),
        ("nodes 7 and 7: the number is given twice", refused(|r| r.nodes.push((7, Vector3::zeros())), &settings)),
        (
            "elements 103 and 999: they have the same nodes",
            refused(
                |r| {
                    let nodes = r.elements[2].nodes.clone();
                    r.elements.push(RawElement { label: 999, kind: RawKind::Hex, nodes });
                    r.element_sets.get_mut("skin").unwrap().push(999);
                },
                &settings,
            ),
        ),
        ("element 101 refers to node 777", refused(|r| r.elements[0].nodes[3] = 777, &settings)),
        ("element 127 is in no region", refused(|r| _ = r.element_sets.get_mut("skin").unwrap().pop(), &settings)),
        (
            "element 101 is in skin and nail",
            refused(|r| _ = r.element_sets.insert("nail".into(), vec![101]), &settings),
        ),
        ("a hole inside", refused(|r| _ = r.elements.remove(13), &settings)),
        ("a tunnel", refused(|r| [22, 13, 4].into_iter().for_each(|e| _ = r.elements.remove(e)), &settings)),
        ("set `top` refers to node 555", refused(|r| r.node_sets.get_mut("top").unwrap().push(555), &settings)),
        (
            "the lowest point of the pad must lie at z = 0, but it lies at z = 1.5000",
            refused(|r| r.nodes.iter_mut().for_each(|n| n.1.z += 1.5), &settings),
        ),
        ("first touch", refused(|_| {}, &ImportedGeometry { frame: ImportFrame::Finger, ..held() })),
        ("nothing holds the finger", refused(|_| {}, &ImportedGeometry::default())),
    ] {
        println!("{text}");
        assert!(text.contains(expected), "{text}\nshould contain: {expected}");
    }
    let mut other = held();
    other.sets.pad = Some("belly".into());
    let text = refused(|_| {}, &other);
    assert!(text.contains("imported.sets.pad: the file has no `belly`; element sets: skin; node sets: top"), "{text}");
    other.sets.pad = Some("top".into());
    assert!(refused(|_| {}, &other).contains("z = 0"));
    let mut other = held();
    other.regions.bone = vec!["os".into()];
    assert!(refused(|_| {}, &other).contains("imported.regions.bone: the file has no `os`"));
    let bad = ImportedGeometry { unit_mm: 0.0, ..held() };
    assert!(refused(|_| {}, &bad).contains("imported.unit_mm = 0"));
}

#[test]
fn a_mesh_in_another_unit_is_refused_with_the_unit() {
    for (factor, name, proposed) in [(1e-3, "metres", 1000.0), (1e3, "micrometres", 1e-3)] {
        let scaled = |raw: &mut RawMesh| raw.nodes.iter_mut().for_each(|node| node.1 *= factor * 5.0);
        let text = refused(scaled, &held());
        assert!(text.contains(&format!("is the file in {name}? Set unit_mm = {proposed}")), "{text}");
        let mut raw = cubes();
        scaled(&mut raw);
        let made = imported_fingertip(&raw, &ImportedGeometry { unit_mm: proposed, ..held() }, &[]).unwrap();
        assert!((quality(&made.fingertip.mesh).volume_mm3() - 27.0 * 125.0).abs() < 1e-6);
        // A file in mm with the unit of another.
        let text = refused(
            |raw| raw.nodes.iter_mut().for_each(|n| n.1 *= 5.0),
            &ImportedGeometry { unit_mm: factor, ..held() },
        );
        assert!(text.contains("Set unit_mm = 1"), "{text}");
    }
}

#[test]
fn two_parts_placed_on_each_other_are_one_finger() {
    // Two blocks, each numbered from 1, as CAE writes them: the upper one is moved on the lower one.
    let mut part = String::from("*Node\n");
    let node = |i: u64, j: u64, k: u64| 1 + (k * 3 + j) * 3 + i;
    let all = |n: u64| (0..n).flat_map(move |k| (0..n).flat_map(move |j| (0..n).map(move |i| (i, j, k))));
    all(3).for_each(|(i, j, k)| part += &format!("{}, {}., {}., {}.\n", node(i, j, k), i, j, k));
    part += "*Element, type=C3D8RH\n";
    for (n, (i, j, k)) in all(2).enumerate() {
        let level = |k| [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)];
        let nodes = [level(k), level(k + 1)].concat().iter().map(u64::to_string).collect::<Vec<_>>().join(", ");
        part += &format!("{}, {nodes}\n", n + 1);
    }
    part += "*Nset, nset=Set-1, generate\n1, 27, 1\n*Elset, elset=Set-1, generate\n1, 8, 1\n*Solid Section, elset=Set-1, material=m\n,\n";
    let text = format!(
        "*Heading\n*Part, name=Shell\n{part}*End Part\n*Part, name=Core\n{part}*End Part\n*Assembly, name=Assembly\n\
         *Instance, name=Shell-1, part=Shell\n*End Instance\n*Instance, name=Core-1, part=Core\n0., 0., 2.\n*End Instance\n\
         *Nset, nset=proximal_fix, instance=Core-1, generate\n19, 27, 1\n*Elset, elset=_pad_S1, internal, instance=Shell-1\n1, 2, 3, 4\n\
         *Surface, type=ELEMENT, name=pad\n_pad_S1, S1\n*End Assembly\n"
    );
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("m.inp");
    std::fs::write(&path, text).unwrap();
    let raw = inp_reader::read(&path).unwrap();
    for (skin, subcutaneous) in [("Shell", "Core"), ("Shell-1", "Core-1"), ("Shell-1.Set-1", "core-1.set-1")] {
        let settings = ImportedGeometry {
            regions: RegionNames {
                skin: vec![skin.into()],
                subcutaneous: vec![subcutaneous.into()],
                ..RegionNames::default()
            },
            ..ImportedGeometry::default()
        };
        let made = imported_fingertip(&raw, &settings, &[]).unwrap();
        let mesh = &made.fingertip.mesh;
        assert_eq!((mesh.hexes.len(), mesh.nodes.len(), mesh.pad_faces.len()), (16, 45, 4));
        assert_eq!((made.report.merged_nodes, made.report.renumbered.len()), (9, 1));
        assert!((quality(mesh).volume_mm3() - 16.0).abs() < 1e-12);
        assert!(mesh.node_set(set::PROXIMAL_FIX).iter().all(|n| mesh.nodes[*n as usize].z == 4.0));
        assert_eq!(mesh.hexes.iter().filter(|h| h.region == Region::Skin).count(), 8);
    }
}

#[test]
fn bones_left_out_or_meshed_apart() {
    // The middle cube left out, its wall named as bone: a finger with a rigid core.
    let mut raw = cubes();
    let wall = raw.elements.remove(13).nodes;
    raw.node_sets.insert("wall".into(), wall.clone());
    let mut settings = held();
    settings.sets.bone = Some("wall".into());
    let made = imported_fingertip(&raw, &settings, &[]).unwrap();
    assert_eq!(made.fingertip.mesh.node_set(set::DISTAL_BONE).len(), 8);
    assert_eq!(made.fingertip.outer_faces.len(), 54);
    // The same core as a cube of its own, with other nodes that do not match: two cells high and wide.
    let place: HashMap<u64, Vector3<f64>> = raw.nodes.iter().copied().collect();
    let corners: Vec<Vector3<f64>> = wall.iter().map(|n| place[n]).collect();
    let (low, mut label) = (corners[0], 2000);
    let mut number = HashMap::new();
    for k in 0..3u64 {
        for j in 0..3 {
            for i in 0..3 {
                label += 1;
                number.insert([i, j, k], label);
                let step = Vector3::new(i as f64, j as f64, k as f64) * 0.5;
                raw.nodes.push((label, low + step));
            }
        }
    }
    for n in 0..8u64 {
        let [i, j, k] = [n % 2, n / 2 % 2, n / 4];
        let at = |i, j, k| number[&[i, j, k]];
        let level = |k| [at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)];
        let nodes = [level(k), level(k + 1)].concat();
        raw.elements.push(RawElement { label: 5000 + n, kind: RawKind::Hex, nodes });
        raw.element_sets.entry("bone".into()).or_default().push(5000 + n);
    }
    let apart = ImportedGeometry { merge_mm: 0.0, ..held() };
    let made = imported_fingertip(&raw, &apart, &[]).unwrap();
    assert_eq!(made.report.attached_nodes, 8);
    assert_eq!(made.fingertip.mesh.node_set(set::DISTAL_BONE).len(), 27 + 8);
    let loose = ImportedGeometry { tie_mm: 0.0, merge_mm: 0.0, ..held() };
    let touching = imported_fingertip(&raw, &held(), &[]).unwrap_err().to_string();
    assert!(touching.contains("merge_mm = 0"), "{touching}");
    let middle = low + Vector3::repeat(0.5);
    raw.nodes.iter_mut().filter(|(n, _)| *n > 2000).for_each(|(_, p)| *p = middle + (*p - middle) * 0.9);
    let error = imported_fingertip(&raw, &loose, &[]).unwrap_err().to_string();
    assert!(error.contains("a part of bone (8 elements, first 5000)"), "{error}");
}

#[test]
fn named_soft_regions_keep_their_names_through_files() {
    let raw = msh_reader::read(&data("cushion.msh")).unwrap();
    let mut settings = cushion();
    settings.regions.subcutaneous = RegionNames::default().subcutaneous;
    let error = imported_fingertip(&raw, &settings, &[]).unwrap_err();
    assert!(matches!(&error, ImportError::Region { regions, .. } if regions == "no region"), "{error}");
    let error = imported_fingertip(&raw, &settings, &["gel".into()]).unwrap_err().to_string();
    assert!(error.starts_with("tissue.regions.gel: the file has no `gel`; "), "{error}");
    let both = imported_fingertip(&raw, &cushion(), &["pulp".into()]).unwrap_err().to_string();
    assert!(both.contains("subcutaneous and pulp"), "{both}");

    let made = imported_fingertip(&raw, &settings, &["pulp".into()]).unwrap();
    check_cushion(&made);
    let mesh = &made.fingertip.mesh;
    let pulp = |mesh: &Mesh| mesh.hexes.iter().filter(|h| h.region == Region::Soft(0)).count();
    assert_eq!(pulp(mesh), 5 * 36 * 3);
    assert_eq!(mesh.region_name(Region::Soft(0)), "pulp");
    assert!(mesh.node_set("pulp").len() > 100);
    let dir = tempfile::tempdir().unwrap();
    let (a, b) = (dir.path().join("f.inp"), dir.path().join("f.msh"));
    inp::write(&a, mesh, &Default::default()).unwrap();
    msh::write(&b, mesh).unwrap();
    for raw in [inp_reader::read(&a).unwrap(), msh_reader::read(&b).unwrap()] {
        let back = imported_fingertip(&raw, &ImportedGeometry::default(), &["pulp".into()]).unwrap();
        assert_eq!(pulp(&back.fingertip.mesh), 5 * 36 * 3);
        assert!(imported_fingertip(&raw, &ImportedGeometry::default(), &[]).is_err());
    }
}
