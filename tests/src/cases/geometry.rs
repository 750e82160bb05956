//! From a labelled volume, and from another program's file, to N(depth) and area(depth).

use std::{fs, ops::ControlFlow, path::Path};

use fingerpad_fe::experiment::{Config, frictionless};
use fingerpad_fe::load_path::PressLimit;
use fingerpad_fe::mesh::{
    FingertipShape, MeshPreset,
    imported::ImportedGeometry,
    quality, set,
    volume::{PhantomSettings, VolumeGeometry, phantom},
};
use fingerpad_formats as formats;

use super::{Effort, Failure};
use crate::Check;

fn press(config: &Config) -> Result<Vec<PressLimit>, Failure> {
    let (finger, _) = config.finger()?;
    Ok(frictionless(config, &finger, None, &mut |_| ControlFlow::Continue(()))?)
}

/// Normal force and area at each depth against those of `reference`.
fn compare(name: &str, found: &[PressLimit], reference: &[PressLimit], bounds: [f64; 2]) -> Vec<Check> {
    let pair = |(a, b): (&PressLimit, &PressLimit)| {
        let at = format!("{name}, {} mm", b.depth_mm);
        [
            Check::relative(format!("{at}: normal force, N"), a.normal_force_n, b.normal_force_n, bounds[0]),
            Check::relative(format!("{at}: contact area, mm2"), a.contact_area_mm2, b.contact_area_mm2, bounds[1]),
        ]
    };
    found.iter().zip(reference).flat_map(pair).collect()
}

/// Phantom, file, mesh, press; bounds of 5 % on force and area.
///
/// Quick: voxels of 0.4 mm near the tip, coarse mesh. Full: 512 x 128 x 128 over 120 x 30 x 30 mm and voxels of
/// 0.4 x 0.3 x 0.25 mm, default mesh, shapes E and A.
pub fn volume(effort: Effort) -> Result<Vec<Check>, Failure> {
    let folder = tempfile::tempdir()?;
    let near = |voxels: [usize; 3]| PhantomSettings { voxels, extent_mm: [32.0, 24.0, 24.0], ..Default::default() };
    let (preset, runs) = match effort {
        Effort::Quick => (MeshPreset::Coarse, vec![("e", near([80, 60, 60]), "v.nrrd")]),
        Effort::Full => (
            MeshPreset::Default,
            vec![
                ("e", PhantomSettings::default(), "v.nrrd"),
                ("a", PhantomSettings::default(), "v.nii.gz"),
                ("e", near([80, 80, 96]), "v.nii"),
            ],
        ),
    };
    let mut checks = Vec::new();
    for (name, settings, file) in runs {
        let mut config = Config { mesh_preset: preset, ..Config::default() };
        config.shape.0 = name.into();
        let reference = press(&config)?;
        let file = folder.path().join(file);
        formats::volume::write(&file, &phantom(&FingertipShape::named(name)?, &settings)?)?;
        config.volume = Some(VolumeGeometry {
            file,
            skin_thickness_mm: FingertipShape::named(name)?.skin_thickness_mm,
            ..VolumeGeometry::default()
        });
        let (fingertip, _) = config.fingertip()?;
        let report = quality(&fingertip.mesh);
        let [x, y, z] = settings.spacing_mm();
        let title = format!("{name}, voxels {x:.2} x {y:.2} x {z:.2} mm");
        let worst = report.worst_hex_scaled_jacobian;
        checks.push(Check::at_least(format!("{title}: worst scaled Jacobian"), worst, 0.3));
        checks.extend(compare(&title, &press(&config)?, &reference, [0.05, 0.05]));
    }
    Ok(checks)
}

/// Our own files read back give the same press; a mesh that Gmsh made can be pressed.
pub fn imported(_: Effort) -> Result<Vec<Check>, Failure> {
    let folder = tempfile::tempdir()?;
    let mut config = Config { mesh_preset: MeshPreset::Coarse, ..Config::default() };
    let (finger, _) = config.finger()?;
    let reference = press(&config)?;
    let (inp, msh) = (folder.path().join("finger.inp"), folder.path().join("finger.msh"));
    formats::inp::write(&inp, &finger.mesh, &Default::default())?;
    formats::msh::write(&msh, &finger.mesh)?;
    let mut checks = Vec::new();
    for (name, file) in [("finger.inp", inp), ("finger.msh", msh)] {
        config.imported = Some(ImportedGeometry { file, ..ImportedGeometry::default() });
        checks.extend(compare(name, &press(&config)?, &reference, [1e-6, 1e-6]));
    }

    let toml = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/meshes/cushion.toml");
    fs::metadata(&toml)?;
    let config = Config::read(&toml)?;
    let (finger, touch) = config.finger()?;
    checks.push(Check::absolute("cushion.msh: middle over first touch, mm", -touch.point_mm.norm(), -6.0, 0.03));
    let fixed = finger.mesh.node_set(set::NAIL_FIX).len();
    checks.push(Check::at_least("cushion.msh: nodes held by the nail", fixed as f64, 9.0));
    let pressed = press(&config)?;
    // Facets of 1.5 mm on a radius of 6 mm touch late: only between bounds, the section's area being 2 pi R d.
    for point in &pressed {
        let section = 2.0 * std::f64::consts::PI * 6.0 * point.depth_mm;
        let name = format!("cushion.msh, {} mm: contact area below that of the section, mm2", point.depth_mm);
        checks.push(Check::at_most(name, point.contact_area_mm2, section));
        let name = format!("cushion.msh, {} mm: contact area above a tenth of it, mm2", point.depth_mm);
        checks.push(Check::at_least(name, point.contact_area_mm2, 0.1 * section));
    }
    let rising = pressed.windows(2).all(|w| w[1].normal_force_n > w[0].normal_force_n && w[0].normal_force_n > 0.0);
    checks.push(Check::at_least("cushion.msh: force rises with depth", f64::from(u8::from(rising)), 1.0));
    Ok(checks)
}
