//! Plants faults in a copy of the sources, one at a time, and checks that a quick test fails for each.
//!
//! `planted_faults [--list] [name...]`. Needs git and cargo; every fault is a build of its own. Exit code 1 if a fault
//! survives, if a test fails without it, or if the place of a fault is no longer found.

use std::fs;
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};

use fingerpad_tests::Failure;

/// A change of one place of the sources that a test must notice.
struct Fault {
    name: &'static str,
    file: &'static str,
    sound: &'static str,
    faulty: &'static str,
    /// Arguments of `cargo test --release` that name the test.
    test: &'static [&'static str],
}

const CONTACT: &[&str] = &["-p", "fingerpad-fe", "--lib", "contact::"];
const MINDLIN: &[&str] = &["-p", "fingerpad-tests", "--test", "all", "cases::mindlin"];
const HERTZ: &[&str] = &["-p", "fingerpad-tests", "--test", "all", "cases::hertz"];
const HYPERELASTIC: &[&str] = &["-p", "fingerpad-tests", "--test", "all", "verification::hyperelastic::"];
const HERTZ_CURVED: &[&str] = &["-p", "fingerpad-tests", "--test", "all", "cases::hertz_curved"];
const POSES: &[&str] = &["-p", "fingerpad-tests", "--test", "all", "verification::poses::"];
const STICK: &[&str] = &["-p", "fingerpad-tests", "--test", "all", "verification::stick::"];
const BALANCE: &[&str] = &["-p", "fingerpad-tests", "--test", "all", "balance"];

const SURFACE: &str = "offline/fe/src/contact/surface.rs";
const RETURN_MAP: &str = "law.return_map(trial, pressure, sticks).turned(trial, turn_rad * turn_share)";
/// Friction along the slip since first contact instead of the elastic slip.
const ALONG_TOTAL_SLIP: &str = "let mut sliding = law.return_map(trial, pressure, sticks);
                let slip = before.slip - before.elastic_slip;
                let total = [0, 1].map(|k| slip.dot(&tangents[k]) + trial[k]);
                let length = total[0].hypot(total[1]);
                if !sliding.stuck && length > 0.0 {
                    for vector in [&mut sliding.traction, &mut sliding.elastic_slip] {
                        *vector = total.map(|s| s / length * vector[0].hypot(vector[1]));
                    }
                }
                sliding.turned(trial, turn_rad * turn_share)";
const AREA: &str = "offline/fe/src/contact/area.rs";
/// Of the stick area alone: the contact area has its own.
const STUCK_AREA: &str = "let Corners { place, level, .. } = Corners::of(facet, spots, level);
            facet.shares(&place, &level).iter().sum()";

/// The pad's own tests.
const PAD: &[&str] = &["-p", "fingerpad", "--features", "std", "--lib", "pad::tests::"];
const PAD_STEP: &str = "core/src/pad/step.rs";

const FAULTS: &[Fault] = &[
    Fault {
        name: "pad: couple of a spread patch turned round",
        file: PAD_STEP,
        sound: "let moment = plus(&sums.moment, &[-turning[1], turning[0], zero]);",
        faulty: "let moment = plus(&sums.moment, &[turning[1], -turning[0], zero]);",
        test: PAD,
    },
    Fault {
        name: "pad: moment of a curved body about the patch's middle",
        file: PAD_STEP,
        sound: "&times(&mean_moment, contact.force)",
        faulty: "&times(&mean_moment, zero)",
        test: PAD,
    },
    Fault {
        name: "pad: half of the bulk's second order in the force",
        file: "core/src/pad/equilibrium.rs",
        sound: "*on += turn * half_turn;",
        faulty: "*on += T::of(0.5) * turn * half_turn;",
        test: PAD,
    },
    Fault {
        name: "pad: slipping patch held above its place",
        file: PAD_STEP,
        sound: "*anchor = closest_place(equations.body, &plus(&contact.place, &to_anchor));",
        faulty: "*anchor = [contact.place[0] + to_anchor[0], contact.place[1] + to_anchor[1]];",
        test: &["-p", "fingerpad-tests", "--test", "all", "pads::closed_paths"],
    },
    Fault {
        name: "direction from total slip",
        file: SURFACE,
        sound: RETURN_MAP,
        faulty: ALONG_TOTAL_SLIP,
        test: MINDLIN,
    },
    Fault {
        name: "direction from total slip, contact alone",
        file: SURFACE,
        sound: RETURN_MAP,
        faulty: ALONG_TOTAL_SLIP,
        test: CONTACT,
    },
    Fault {
        name: "friction half of an increment's spin behind",
        file: SURFACE,
        sound: RETURN_MAP,
        faulty: "let _ = (turn_rad, turn_share);
                law.return_map(trial, pressure, sticks)",
        test: CONTACT,
    },
    Fault {
        name: "contact weights +3 %",
        file: "offline/fe/src/contact/contour.rs",
        sound: "0.5 * (c - a).perp(&(b - a))",
        faulty: "0.515 * (c - a).perp(&(b - a))",
        test: HERTZ,
    },
    Fault {
        name: "volumetric stiffness -2 %",
        file: "offline/fe/src/material/hyperelastic.rs",
        sound: "f64x8::splat(2.0 / self.d_per_mpa())",
        faulty: "f64x8::splat(1.96 / self.d_per_mpa())",
        test: HYPERELASTIC,
    },
    Fault {
        name: "a face sticks where any node does",
        file: AREA,
        sound: STUCK_AREA,
        faulty: "let Corners { place, level, .. } = Corners::of(facet, spots, level);
            let highest = level.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            facet.shares(&place, &vec![highest; level.len()]).iter().sum()",
        test: MINDLIN,
    },
    Fault {
        name: "a face sticks where the last node does",
        file: AREA,
        sound: STUCK_AREA,
        faulty: "let Corners { place, level, .. } = Corners::of(facet, spots, level);
            let lowest = level.iter().copied().fold(f64::INFINITY, f64::min);
            facet.shares(&place, &vec![lowest; level.len()]).iter().sum()",
        test: MINDLIN,
    },
    Fault {
        name: "joint's translation +20 %",
        file: "offline/fe/src/assembly/body.rs",
        sound: "* self.joint.translation_n_per_mm;\n            let turned",
        faulty: "* (1.2 * self.joint.translation_n_per_mm);\n            let turned",
        test: BALANCE,
    },
    Fault {
        name: "joint's rotation +20 %",
        file: "offline/fe/src/assembly/body.rs",
        sound: "* self.joint.rotation_nmm_per_rad;\n            for",
        faulty: "* (1.2 * self.joint.rotation_nmm_per_rad);\n            for",
        test: BALANCE,
    },
    Fault {
        name: "depth from the mesh's lowest node",
        file: "offline/fe/src/load_path/finger.rs",
        sound: "let outline = smooth_outline(&fingertip);",
        faulty: "let outline = None;",
        test: POSES,
    },
    Fault {
        name: "slip of before a reversal counts on",
        file: SURFACE,
        sound: " || before.direction.dot(&passed) < 0.0;",
        faulty: ";",
        test: STICK,
    },
    Fault {
        name: "a sphere's normal turns a tenth less",
        file: "offline/fe/src/contact/rigid.rs",
        sound: "bend: across * (side / distance)",
        faulty: "bend: across * (0.9 * side / distance)",
        test: CONTACT,
    },
    Fault {
        name: "curvature of a cylinder +3 %",
        file: "offline/fe/src/contact/rigid.rs",
        sound: "radius_mm: radius_mm.abs(), side",
        faulty: "radius_mm: 0.97 * radius_mm.abs(), side",
        test: HERTZ_CURVED,
    },
    Fault {
        name: "centre of pressure x 0.9",
        file: "offline/fe/src/load_path/response.rs",
        sound: "moment / totals.force.z",
        faulty: "0.9 * moment / totals.force.z",
        test: BALANCE,
    },
];

fn main() -> ExitCode {
    let names: Vec<String> = std::env::args().skip(1).collect();
    if names.iter().any(|name| name == "--list") {
        FAULTS.iter().for_each(|fault| println!("{:<45} cargo test --release {}", fault.name, fault.test.join(" ")));
        return ExitCode::SUCCESS;
    }
    let wanted: Vec<&Fault> =
        FAULTS.iter().filter(|f| names.is_empty() || names.iter().any(|n| f.name.contains(n.as_str()))).collect();
    match plant(&wanted) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(survivors) => {
            println!("{survivors} faults survive");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Number of faults that no test notices.
fn plant(faults: &[&Fault]) -> Result<usize, Failure> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize()?;
    let folder = tempfile::tempdir()?;
    copy_tracked(&root, folder.path())?;
    let mut survivors = 0;
    for fault in faults {
        let file = folder.path().join(fault.file);
        let text = fs::read_to_string(&file)?;
        if text.matches(fault.sound).count() != 1 {
            return Err(format!("{}: {} has not one place that reads `{}`", fault.name, fault.file, fault.sound).into());
        }
        if !test(&root, folder.path(), fault.test, &[])? {
            return Err(format!("{}: the test fails without the fault", fault.name).into());
        }
        fs::write(&file, text.replace(fault.sound, fault.faulty))?;
        if !test(&root, folder.path(), fault.test, &["--no-run"])? {
            return Err(format!("{}: the fault does not compile", fault.name).into());
        }
        let noticed = !test(&root, folder.path(), fault.test, &[])?;
        println!("{:<45} {}", fault.name, if noticed { "noticed" } else { "SURVIVES" });
        survivors += usize::from(!noticed);
        fs::write(&file, text)?;
    }
    Ok(survivors)
}

/// Copies the files and links that git tracks, as they are in the working tree.
fn copy_tracked(root: &Path, to: &Path) -> Result<(), Failure> {
    let list = Command::new("git").current_dir(root).args(["ls-files", "-z"]).output()?;
    if !list.status.success() {
        return Err("git ls-files failed".into());
    }
    for name in String::from_utf8(list.stdout)?.split('\0').filter(|name| !name.is_empty()) {
        let target = to.join(name);
        fs::create_dir_all(target.parent().ok_or("a file in a folder")?)?;
        let from = root.join(name);
        if from.is_symlink() {
            std::os::unix::fs::symlink(fs::read_link(from)?, target)?;
        } else {
            fs::copy(from, target)?;
        }
    }
    Ok(())
}

/// Whether `cargo test --release` with these arguments succeeds on the copy; its builds are kept apart from the sound ones,
/// whose names they share.
fn test(root: &Path, copy: &Path, arguments: &[&str], options: &[&str]) -> Result<bool, Failure> {
    let status = Command::new(env!("CARGO"))
        .current_dir(copy)
        .env("CARGO_TARGET_DIR", root.join("target/planted_faults"))
        .args(["test", "--release"])
        .args(options)
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()?;
    Ok(status.success())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_has_its_one_place_in_the_sources() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        for fault in FAULTS {
            let text = fs::read_to_string(root.join(fault.file)).unwrap();
            assert_eq!(text.matches(fault.sound).count(), 1, "{}: `{}` in {}", fault.name, fault.sound, fault.file);
        }
    }
}
