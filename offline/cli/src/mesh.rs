//! `fingerpad mesh`: the fingertip's mesh for other programs.

use std::path::PathBuf;

use fingerpad_fe::experiment::{Config, ConfigError, Origin};
use fingerpad_fe::load_path::Finger;
use fingerpad_fe::mesh;
use fingerpad_fe::mesh::{Fingertip, QualityReport, Region, imported::ImportReport, volume::VolumeReport};
use fingerpad_formats as formats;
use fingerpad_report as report;

use super::plausibility::warn_of_size;
use super::{Failure, Mark, Model, Outputs, bar, go_on, progress, run_failure, show};

/// Write the fingertip's mesh, or the whole problem for another program.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad mesh --out finger.vtu                       ParaView
  fingerpad mesh --shape a --out finger.msh             Gmsh 4.1
  fingerpad mesh --mesh-preset coarse --out finger.inp  Abaqus, CalculiX: mesh and sets
  fingerpad mesh --out press.inp --deck                 CalculiX: the whole frictionless press
  fingerpad mesh --out press.inp --deck --mesh-preset coarse --deck-element c3d8r  and its forces by this program
  fingerpad mesh --volume scan.nii.gz --out scan.vtu    of a labelled volume
  fingerpad mesh --imported theirs.msh --out ours.vtu   of another program's mesh
  fingerpad mesh --out finger.vtu --picture finger.svg  and a picture

`ccx press` (without the ending) runs a deck; press.dat has the normal force at each depth: the totals of PLANE_NODES
along z. CalculiX's hexahedra are C3D8R, which are stiffer on coarse meshes than the mean dilatation of `build` and
`simulate`: 6 to 8 % on the coarse mesh. --deck-element prints the forces of the deck's problem as this program
computes them, with C3D8R (like for like) or with mean dilatation.")]
pub struct Args {
    #[command(flatten)]
    model: Model,
    /// File to write; its ending decides the format: .vtu, .msh or .inp
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// With .inp: materials, supports, contact and steps as well
    #[arg(long)]
    deck: bool,
    /// With --deck: solve the same problem here with these hexahedra and print the normal forces
    #[arg(long, value_enum, value_name = "ELEMENT", requires = "deck")]
    deck_element: Option<DeckElement>,
    /// Picture to write as well (SVG): cut open at y = 0, and from below
    #[arg(long, value_name = "F.svg")]
    picture: Option<PathBuf>,
    /// Replace files at --out and --picture that this command did not write
    #[arg(long)]
    force: bool,
    /// Print the quality report as JSON
    #[arg(long)]
    json: bool,
}

/// Hexahedra of this program for the problem of a deck.
#[derive(Clone, Copy, clap::ValueEnum)]
enum DeckElement {
    /// CalculiX's: one point with hourglass control
    C3d8r,
    /// This program's own
    MeanDilatation,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let config = args.model.config()?;
    let ending = args.out.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if !["vtu", "msh", "inp"].contains(&ending.as_str()) {
        let out = args.out.display();
        return Err(Failure::Input(anyhow::anyhow!("--out {out}: the ending must be .vtu, .msh or .inp")));
    }
    if let Some(picture) = args.picture.as_ref().filter(|file| file.extension().is_none_or(|e| e != "svg")) {
        let picture = picture.display();
        return Err(Failure::Input(anyhow::anyhow!("--picture {picture}: pictures are SVG, the ending must be .svg")));
    }
    if args.deck && ending != "inp" {
        return Err(Failure::Input(anyhow::anyhow!("--deck: needs an --out that ends in .inp")));
    }
    let marks = vec![
        Mark::holding("<VTKFile", "Name=\"region_skin\""),
        Mark::holding("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames", "\"pad\""),
        Mark::beginning("*HEADING\nmm, N, s, MPa"),
    ];
    Outputs::beside(args.model.inputs(&config))
        .file("--out", Some(&args.out), marks)
        .file("--picture", args.picture.as_deref(), Vec::new())
        .force(args.force)
        .prepare()?;
    let (fingertip, origin) = progress::during("mesh", |_| config.fingertip())?;
    warn_of_size(&config, &fingertip.mesh);
    let touch = fingertip.touch;
    let pressed = args.deck_element.map(|element| press_of_deck(&config, fingertip.clone(), element)).transpose()?;
    let finger = Finger::new(fingertip, &config.tissue).map_err(ConfigError::from)?;
    write_files(args, &ending, &config, &finger)?;
    let quality = mesh::quality(&finger.mesh);
    if args.json {
        let value = json_summary(&finger, &quality, &origin, touch.curvature_radius_mm, pressed.as_deref());
        println!("{value:#}");
        return Ok(());
    }
    println!(
        "{}: {} nodes, {} hexes, {} tets, {} pad faces, {} free dofs",
        args.out.display(),
        quality.nodes,
        quality.hexes,
        quality.tets,
        quality.pad_faces,
        finger.body.dofs.count
    );
    print_quality(&finger, &quality, touch.curvature_radius_mm);
    if let Some(pressed) = pressed {
        println!("normal force of the deck's problem by this program, bones fixed:");
        pressed.iter().for_each(|[depth_mm, force_n]| println!("{depth_mm:>8.2} mm {force_n:>10.5} N"));
    }
    if args.deck {
        println!("to compare: ccx {}", args.out.with_extension("").display());
    }
    match &origin {
        Origin::Shape(_) => {}
        Origin::Volume(_, report) => print_volume(report),
        Origin::Imported(report) => print_import(report),
    }
    Ok(())
}

/// Writes the mesh and its picture.
fn write_files(args: &Args, ending: &str, config: &Config, finger: &Finger) -> Result<(), Failure> {
    match ending {
        "vtu" => fingerpad_fe::load_path::vtu::write_mesh(&args.out, &finger.mesh)?,
        "msh" => formats::msh::write(&args.out, &finger.mesh)?,
        "inp" if args.deck => {
            let text = deck(config, &finger.mesh)?;
            formats::atomic_write(&args.out, |w| w.write_all(text.as_bytes()))?;
        }
        _ => formats::inp::write(&args.out, &finger.mesh, &Default::default())?,
    }
    if let Some(path) = &args.picture {
        formats::atomic_write(path, |w| w.write_all(report::mesh_picture(&finger.mesh).as_bytes()))?;
    }
    Ok(())
}

/// Geometry, mesh and quality, for `--json`.
fn json_summary(
    finger: &Finger,
    quality: &QualityReport,
    origin: &Origin,
    curvature_radius_mm: f64,
    pressed: Option<&[[f64; 2]]>,
) -> serde_json::Value {
    let regions: serde_json::Map<String, serde_json::Value> = quality
        .regions
        .iter()
        .map(|(region, q)| {
            let value = serde_json::json!({
                "hexes": q.hexes, "tets": q.tets, "volume_mm3": q.volume_mm3,
                "worst_scaled_jacobian": q.worst_scaled_jacobian,
            });
            let name = match region {
                Region::Soft(_) => finger.mesh.region_name(*region).to_owned(),
                shared => format!("{shared:?}"),
            };
            (name, value)
        })
        .collect();
    let origin = match origin {
        Origin::Shape(shape) => serde_json::json!({ "shape": shape }),
        Origin::Volume(template, report) => serde_json::json!({ "volume": report, "template": template }),
        Origin::Imported(report) => serde_json::json!({ "imported": report }),
    };
    serde_json::json!({
        "geometry": origin,
        "nodes": quality.nodes, "hexes": quality.hexes, "tets": quality.tets,
        "pad_faces": quality.pad_faces, "free_dofs": finger.body.dofs.count,
        "worst_hex_scaled_jacobian": quality.worst_hex_scaled_jacobian,
        "worst_tet_scaled_jacobian": quality.worst_tet_scaled_jacobian,
        "min_edge_mm": quality.min_edge_mm, "max_edge_mm": quality.max_edge_mm,
        "curvature_radius_mm": curvature_radius_mm,
        "regions": regions,
        "deck_depth_mm_and_normal_force_n": pressed,
    })
}

/// Prints the quality of the mesh and its regions.
fn print_quality(finger: &Finger, quality: &QualityReport, curvature_radius_mm: f64) {
    println!(
        "worst scaled Jacobian: hexes {:.3}, nail tets {:.3}; edges {:.2} to {:.2} mm; pad radius along the finger {:.1} mm",
        quality.worst_hex_scaled_jacobian,
        quality.worst_tet_scaled_jacobian,
        quality.min_edge_mm,
        quality.max_edge_mm,
        curvature_radius_mm
    );
    for (region, q) in &quality.regions {
        let name = finger.mesh.region_label(*region);
        println!("{name:>19}: {:>6} elements, {:>8.1} mm³", q.hexes + q.tets, q.volume_mm3);
    }
}

fn print_volume(report: &VolumeReport) {
    let [x, y, z] = report.voxel_mm;
    println!(
        "voxels {x:.4} x {y:.4} x {z:.4} mm; the finger is turned by {:.2}° about its dorsal axis",
        report.yaw_deg
    );
    for (name, s) in [("skin", &report.skin), ("bone", &report.bone)] {
        let [low, high] = s.offset_mm;
        println!(
            "{name:>14}: surface {low:+.3} to {high:+.3} mm off the parametric template (labels {:.3} mm rms off it); \
             labels' border {:.3} mm rms off the surface, {:.3} mm at most beyond the voxels' own room",
            s.template_rms_mm, s.border_rms_mm, s.beyond_voxels_mm
        );
    }
    if report.filled_voxels + report.dropped_voxels > 0 {
        println!("{} voxels filled, {} dropped", report.filled_voxels, report.dropped_voxels);
    }
    if !report.nail_measured {
        println!("no nail in the labels: its position is that of the settings");
    }
}

fn print_import(report: &ImportReport) {
    println!(
        "mended: {} elements turned, {} nodes merged, {} unused nodes dropped, {} nodes tied (moved {:.1e} mm at most), \
         {} attached to bone",
        report.turned_elements,
        report.merged_nodes,
        report.unused_nodes,
        report.tied_nodes,
        report.tie_moved_mm,
        report.attached_nodes
    );
    report.renumbered.iter().for_each(|change| println!("{change}"));
    if !report.ignored.is_empty() {
        println!("not read: {}", report.ignored.join(", "));
    }
}

/// Depth (mm) and normal force (N) at every depth of the deck.
#[cfg(unix)]
fn press_of_deck(config: &Config, tip: Fingertip, element: DeckElement) -> Result<Vec<[f64; 2]>, Failure> {
    use fingerpad_fe::compare_ccx::like_for_like::{self, Element};
    use fingerpad_fe::load_path::{Drive, Path, Waypoint, follow_path};

    let element = match element {
        DeckElement::C3d8r => Element::C3d8r,
        DeckElement::MeanDilatation => Element::MeanDilatation,
    };
    let finger = like_for_like::finger(tip, &config.tissue, element).map_err(ConfigError::from)?;
    let problem = like_for_like::problem(&finger, None, config.numerics.contact.penalty_mpa_per_mm);
    let depths = [0.0].into_iter().chain(config.experiment.depths_mm.iter().copied());
    let waypoints = depths.map(|depth| Waypoint { t_s: depth, normal: depth, x: 0.0, y: 0.0 }).collect();
    let path = Path::new([Drive::Displacement; 3], waypoints);
    let rows: Vec<usize> = (0..path.waypoints.len()).collect();
    let bar = bar("press".into());
    let pressed = follow_path(&problem, &path, &rows, &mut |progress| {
        show(&bar, &progress);
        go_on()
    });
    bar.finish_and_clear();
    let pressed = pressed.map_err(|e| run_failure(e, "the press of the deck", "nothing was written".into()))?;
    let reached = pressed.snapshots.iter().skip(1).map(|s| [s.response.depth_mm, s.response.normal_force_n]);
    Ok(reached.collect())
}

#[cfg(not(unix))]
fn press_of_deck(_: &Config, _: Fingertip, _: DeckElement) -> Result<Vec<[f64; 2]>, Failure> {
    Err(Failure::Input(anyhow::anyhow!("--deck-element needs a Unix system")))
}

#[cfg(unix)]
fn deck(config: &Config, mesh: &mesh::Mesh) -> Result<String, Failure> {
    use fingerpad_fe::compare_ccx::{Contact, Deck, Step};
    let contact = Contact { penalty_mpa_mm: config.numerics.contact.penalty_mpa_per_mm, friction: None };
    let steps = vec![Step::press(&config.experiment.depths_mm)];
    let deck = Deck::finger(mesh, |region| config.tissue.material(mesh, region), contact, steps);
    deck.to_text().map_err(|e| Failure::Input(e.into()))
}

#[cfg(not(unix))]
fn deck(_: &Config, _: &mesh::Mesh) -> Result<String, Failure> {
    Err(Failure::Input(anyhow::anyhow!("--deck needs a Unix system")))
}
