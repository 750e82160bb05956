//! `fingerpad mesh`: the fingertip's mesh for other programs.

use std::path::PathBuf;

use fingerpad_offline::{io, mesh, mesh::Region};

use super::{Failure, Model};

/// Write the fingertip's mesh, or the whole problem for another program.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad mesh --out finger.vtu                       ParaView
  fingerpad mesh --shape a --out finger.msh             Gmsh 4.1
  fingerpad mesh --mesh-preset coarse --out finger.inp  Abaqus, CalculiX: mesh and sets
  fingerpad mesh --out press.inp --deck                 CalculiX: the frictionless press with fixed bones, whole")]
pub struct Args {
    #[command(flatten)]
    model: Model,
    /// File to write; its ending decides the format: .vtu, .msh or .inp
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// With .inp: materials, supports, contact and steps as well
    #[arg(long)]
    deck: bool,
    /// Print the quality report as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let config = args.model.config()?;
    let (finger, touch) = config.finger()?;
    let ending = args.out.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    match ending.as_str() {
        "vtu" => io::vtu::write_mesh(&args.out, &finger.mesh)?,
        "msh" => io::msh::write(&args.out, &finger.mesh)?,
        "inp" if args.deck => {
            let text = deck(&config, &finger.mesh)?;
            io::atomic_write(&args.out, |w| w.write_all(text.as_bytes()))?;
        }
        "inp" => io::inp::write(&args.out, &finger.mesh, &Default::default())?,
        _ => {
            return Err(Failure::Input(anyhow::anyhow!(
                "--out {}: the ending must be .vtu, .msh or .inp",
                args.out.display()
            )));
        }
    }
    let quality = mesh::quality(&finger.mesh);
    if args.json {
        let regions: serde_json::Map<String, serde_json::Value> = quality
            .regions
            .iter()
            .map(|(region, q)| {
                let value = serde_json::json!({
                    "hexes": q.hexes, "tets": q.tets, "volume_mm3": q.volume_mm3,
                    "worst_scaled_jacobian": q.worst_scaled_jacobian,
                });
                (format!("{region:?}"), value)
            })
            .collect();
        let value = serde_json::json!({
            "nodes": quality.nodes, "hexes": quality.hexes, "tets": quality.tets,
            "pad_faces": finger.mesh.pad_faces.len(), "free_dofs": finger.body.dofs.count,
            "worst_hex_scaled_jacobian": quality.worst_hex_scaled_jacobian,
            "worst_tet_scaled_jacobian": quality.worst_tet_scaled_jacobian,
            "min_edge_mm": quality.min_edge_mm, "max_edge_mm": quality.max_edge_mm,
            "curvature_radius_mm": touch.curvature_radius_mm,
            "regions": regions,
        });
        println!("{value:#}");
        return Ok(());
    }
    println!(
        "{}: {} nodes, {} hexes, {} tets, {} pad faces, {} free dofs",
        args.out.display(),
        quality.nodes,
        quality.hexes,
        quality.tets,
        finger.mesh.pad_faces.len(),
        finger.body.dofs.count
    );
    println!(
        "worst scaled Jacobian: hexes {:.3}, nail tets {:.3}; edges {:.2} to {:.2} mm; pad radius along the finger {:.1} mm",
        quality.worst_hex_scaled_jacobian,
        quality.worst_tet_scaled_jacobian,
        quality.min_edge_mm,
        quality.max_edge_mm,
        touch.curvature_radius_mm
    );
    for (region, q) in &quality.regions {
        let name = match region {
            Region::Skin => "skin",
            Region::Subcutaneous => "subcutaneous",
            Region::DistalBone => "distal bone",
            Region::ProximalBone => "proximal bone",
            Region::Nail => "nail",
        };
        println!("{name:>14}: {:>6} elements, {:>8.1} mm³", q.hexes + q.tets, q.volume_mm3);
    }
    Ok(())
}

#[cfg(unix)]
fn deck(config: &fingerpad_offline::experiment::Config, mesh: &mesh::Mesh) -> Result<String, Failure> {
    use fingerpad_offline::peer::{Contact, Deck, Material, Step};
    let ogden = |law: fingerpad_offline::material::Ogden| Material::Ogden {
        mu_mpa: law.mu_mpa,
        alpha: law.alpha,
        d_per_mpa: law.d_per_mpa,
    };
    let nail = Material::Elastic { young_mpa: config.tissue.nail.young_mpa, poisson: config.tissue.nail.poisson };
    let contact = Contact { penalty_mpa_mm: config.numerics.contact.penalty_mpa_per_mm, friction: None };
    let steps = vec![Step::press(&config.experiment.depths_mm)];
    let deck = Deck::finger(mesh, ogden(config.tissue.skin), ogden(config.tissue.subcutaneous), nail, contact, steps);
    deck.to_text().map_err(|e| Failure::Input(e.into()))
}

#[cfg(not(unix))]
fn deck(_: &fingerpad_offline::experiment::Config, _: &mesh::Mesh) -> Result<String, Failure> {
    Err(Failure::Input(anyhow::anyhow!("--deck needs a Unix system")))
}
