//! `fingerpad export`: a model as source text, as a co-simulation unit, its limit surface, or an engine's own contact nearest to it.

use std::path::PathBuf;

use anyhow::anyhow;
use clap::ValueEnum;
use fingerpad::host::ModelFile;
use fingerpad_fmu as fmu;
use fingerpad_reduce as reduce;
use fingerpad_reduce::{DrakeContact, LimitSurface, MujocoContact, NewtonContact, engine_contact, limit_surface};

use super::model::Loaded;
use super::{Failure, Mark, Outputs, model, outputs};

/// Write a model as a Rust constant, a C array, JSON or an FMI 3.0 co-simulation unit (FMU), its limit surface, or the contact of MuJoCo, Newton or Drake nearest to it
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  fingerpad export --model model.fpm --format rust --out src/model.rs   `MODEL.model()?` steps it
  fingerpad export --model model.fpm --format c --out model.h           for the C library
  fingerpad export --model model.fpm --format json --out model.json     all numbers with their names
  fingerpad export --model model.fpm --format fmu --out finger.fmu      for Modelica, FMPy
  fingerpad export --format limit-surface --depth-mm 0.8 --out limit.csv
  fingerpad export --model pad.fpm --format limit-surface-obj --pitch-deg 45 --roll-deg 10 --out limit.obj
  fingerpad export --format mujoco-contact --load-n 1 --out contact.xml   for models that do without the plugin
  fingerpad export --format newton-contact --load-n 1 --out contact.py
  fingerpad export --format drake-hydroelastic --load-n 1 --out contact.sdf

The limit surface holds friction along x and y and the moment about the normal in full slip, for 642 motions of the plane: slides
along x and y, and turns, which count as travel by an arm of 3 mm. The surface of a bed is that of long slides at constant
depth, during which the normal force changes. The surface of a pad is that of slip of all its patches at the pressures of the press.
limit-surface writes a table, limit-surface-obj a mesh with friction along x and y and the moment over 3 mm as coordinates.
Both take a bed or a pad; without --model the shipped bed, or the shipped pad where --pitch-deg or --roll-deg is given.

mujoco-contact (MJCF) and mujoco-contact-json hold solref, solimp, friction and condim of a sphere in MuJoCo's own contact, which
comes nearest to a pad (without --model the shipped one) at a load, and the errors from 0.5 to 1.5 of it. newton-contact (Python) holds
ke, kd, kf and mu of a ShapeConfig, for SolverSemiImplicit and SolverFeatherstone, drake-hydroelastic (SDF) radius, hydroelastic modulus,
dissipation and mu of a compliant sphere; newton-contact-json and drake-hydroelastic-json have the errors at each load.")]
pub struct Args {
    /// Model file; without it the one that ships with the program
    #[arg(long, value_name = "MODEL.fpm")]
    model: Option<PathBuf>,
    /// What to write
    #[arg(long, value_name = "FORMAT")]
    format: Format,
    /// File to write; - for standard output
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Depth of a limit surface, mm [default: 1]
    #[arg(long, value_name = "D", allow_negative_numbers = true)]
    depth_mm: Option<f64>,
    /// Load at which an engine's contact has the depth of the pad, N [default: 1]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    load_n: Option<f64>,
    /// 1 over the mass that moves against an engine's contact, 1/kg; in MuJoCo the sum of body_invweight0 of both bodies [default: 20]
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    inverse_mass_per_kg: Option<f64>,
    /// Pitch of the finger in a limit surface or a contact, degrees [default: that of a bed, or the neutral one of a pad]
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    pitch_deg: Option<f64>,
    /// Roll of the finger in a limit surface or a contact, degrees [default: 0]
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    roll_deg: Option<f64>,
    /// Replace a file at --out that this command did not write
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// A `static` of the package `fingerpad`
    Rust,
    /// The file's bytes as an aligned array
    C,
    /// Numbers, tables, provenance, effects
    Json,
    /// An FMI 3.0 co-simulation unit with its sources, for this kind of machine
    Fmu,
    /// A table of friction and moment in full slip (CSV), of a bed or a pad
    LimitSurface,
    /// The same as a mesh (Wavefront OBJ)
    LimitSurfaceObj,
    /// MuJoCo's own contact nearest to a pad, as a class of geoms (MJCF)
    MujocoContact,
    /// The same with the errors at each load (JSON)
    MujocoContactJson,
    /// Newton's own contact nearest to a pad, as a configuration of shapes (Python)
    NewtonContact,
    /// The same with the errors at each load (JSON)
    NewtonContactJson,
    /// Drake's hydroelastic contact nearest to a pad, as a collision geometry (SDF)
    DrakeHydroelastic,
    /// The same with the errors at each load (JSON)
    DrakeHydroelasticJson,
}

impl Format {
    fn is_limit_surface(self) -> bool {
        matches!(self, Self::LimitSurface | Self::LimitSurfaceObj)
    }

    fn is_contact(self) -> bool {
        use Format::{
            DrakeHydroelastic, DrakeHydroelasticJson, MujocoContact, MujocoContactJson, NewtonContact,
            NewtonContactJson,
        };
        matches!(
            self,
            MujocoContact
                | MujocoContactJson
                | NewtonContact
                | NewtonContactJson
                | DrakeHydroelastic
                | DrakeHydroelasticJson
        )
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let turned = args.pitch_deg.is_some() || args.roll_deg.is_some();
    let (is_surface, is_contact) = (args.format.is_limit_surface(), args.format.is_contact());
    for (flag, value, is_taken, by) in [
        ("--depth-mm", args.depth_mm, is_surface, "limit-surface and limit-surface-obj"),
        ("--load-n", args.load_n, is_contact, "mujoco-contact, newton-contact and drake-hydroelastic"),
        (
            "--inverse-mass-per-kg",
            args.inverse_mass_per_kg,
            is_contact,
            "mujoco-contact, newton-contact and drake-hydroelastic",
        ),
        ("--pitch-deg", args.pitch_deg, is_surface || is_contact, "a limit surface and a contact"),
        ("--roll-deg", args.roll_deg, is_surface || is_contact, "a limit surface and a contact"),
    ] {
        if let (Some(value), false) = (value, is_taken) {
            return Err(Failure::Input(anyhow!("{flag} {value}: only --format {by} take it")));
        }
    }
    let (file, name) = match (&args.model, is_surface || is_contact) {
        (None, true) if turned || is_contact => model::shipped_pad().map(|(pad, name)| (Loaded::Pad(pad), name))?,
        (path, true) => model::load_any(path.as_deref())?,
        (path, false) => model::load(path.as_deref()).map(|(bed, name)| (Loaded::Bed(bed), name))?,
    };
    let marks = vec![match args.format {
        Format::Rust => Mark::beginning("// A fingerpad model; made by `fingerpad export`."),
        Format::C => Mark::beginning("/* A fingerpad model; made by `fingerpad export`."),
        Format::Json => Mark::beginning("{\n  \"depth_mm\": ["),
        Format::Fmu => Mark::holding("PK", "resources/model.fpm"),
        Format::LimitSurface => Mark::beginning(limit_surface::COLUMNS),
        Format::LimitSurfaceObj => Mark::beginning(limit_surface::MESH_HEAD),
        Format::MujocoContact => Mark::beginning(engine_contact::MJCF_HEAD),
        Format::NewtonContact => Mark::beginning(engine_contact::PYTHON_HEAD),
        Format::DrakeHydroelastic => Mark::beginning(engine_contact::SDF_HEAD),
        Format::MujocoContactJson | Format::NewtonContactJson | Format::DrakeHydroelasticJson => {
            Mark::beginning(engine_contact::JSON_HEAD)
        }
    }];
    let inputs = [("--model", args.model.as_deref())];
    Outputs::beside(inputs).stream("--out", &args.out, marks).force(args.force).prepare()?;
    let bytes = match (args.format, &file) {
        (Format::LimitSurface, file) => limit_surface(args, file, &name)?.csv().into_bytes(),
        (Format::LimitSurfaceObj, file) => limit_surface(args, file, &name)?.obj().into_bytes(),
        (format, file) if is_contact => contact(format, args, file, &name)?.into_bytes(),
        (format, Loaded::Bed(bed)) => of_bed(format, bed, &name)?,
        (_, Loaded::Pad(_)) => {
            return Err(Failure::Input(anyhow!("{name}: a pad; this format takes a bed of springs")));
        }
    };
    outputs::write(&args.out, |w| w.write_all(&bytes))?;
    outputs::say(&args.out, &format!("{}: {} bytes", args.out.display(), bytes.len()));
    Ok(())
}

/// A bed as source text or as a co-simulation unit.
fn of_bed(format: Format, bed: &ModelFile, name: &str) -> Result<Vec<u8>, Failure> {
    let text = |format| Ok(reduce::export(bed, format).into_bytes());
    match format {
        Format::Rust => text(reduce::Format::Rust),
        Format::C => text(reduce::Format::C),
        Format::Json => text(reduce::Format::Json),
        _ => fmu::pack(bed, name).map_err(|e| Failure::Input(e.into())),
    }
}

/// The limit surface at the depth and in the pose of the flags.
fn limit_surface(args: &Args, file: &Loaded, name: &str) -> Result<LimitSurface, Failure> {
    const DEPTH_MM: f64 = 1.0;
    let depth_mm = args.depth_mm.unwrap_or(DEPTH_MM);
    let surface = match file {
        Loaded::Bed(bed) => {
            let bed = bed.file();
            let own = bed.model.data().pose_deg;
            for ((flag, given), own) in
                [("--pitch-deg", args.pitch_deg), ("--roll-deg", args.roll_deg)].into_iter().zip(own)
            {
                if let Some(value) = given.filter(|value| !((value - f64::from(own)).abs() < 1e-3)) {
                    return Err(Failure::Input(anyhow!(
                        "{flag} {value}: {name} is a bed of springs of one pose, {flag} {own}; a pad takes other poses"
                    )));
                }
            }
            LimitSurface::of_bed(&bed, depth_mm)
        }
        Loaded::Pad(file) => {
            let pad = file.file().pad;
            let pitch_deg = args.pitch_deg.unwrap_or(f64::from(pad.numbers.neutral_pitch_deg));
            LimitSurface::of_pad(&pad, depth_mm, [pitch_deg, args.roll_deg.unwrap_or(0.0)])
        }
    };
    surface.map_err(|e| Failure::Input(anyhow!("{name}: {e}")))
}

/// The text of an engine's contact nearest to a pad at the load and in the pose of the flags.
fn contact(format: Format, args: &Args, file: &Loaded, name: &str) -> Result<String, Failure> {
    const LOAD_N: f64 = 1.0;
    const INVERSE_MASS_PER_KG: f64 = 20.0;
    let Loaded::Pad(file) = file else {
        return Err(Failure::Input(anyhow!("{name}: a bed of springs; this format takes a pad")));
    };
    let pad = &file.file().pad;
    let pitch_deg = args.pitch_deg.unwrap_or(f64::from(pad.numbers.neutral_pitch_deg));
    let (load_n, mass) = (args.load_n.unwrap_or(LOAD_N), args.inverse_mass_per_kg.unwrap_or(INVERSE_MASS_PER_KG));
    let pose_deg = [pitch_deg, args.roll_deg.unwrap_or(0.0)];
    let text = match format {
        Format::NewtonContact => NewtonContact::of_pad(pad, load_n, mass, pose_deg).map(|c| c.python()),
        Format::NewtonContactJson => NewtonContact::of_pad(pad, load_n, mass, pose_deg).map(|c| c.json()),
        Format::DrakeHydroelastic => DrakeContact::of_pad(pad, load_n, mass, pose_deg).map(|c| c.sdf()),
        Format::DrakeHydroelasticJson => DrakeContact::of_pad(pad, load_n, mass, pose_deg).map(|c| c.json()),
        Format::MujocoContactJson => MujocoContact::of_pad(pad, load_n, mass, pose_deg).map(|c| c.json()),
        _ => MujocoContact::of_pad(pad, load_n, mass, pose_deg).map(|c| c.mjcf()),
    };
    text.map_err(|e| Failure::Input(anyhow!("{name}: {e}")))
}
