//! Verification cases by name.

mod arch;
mod geometry;
mod hemisphere;
mod identify;
mod law;
pub mod limit_surface;
mod meshes;
mod numerics;
pub mod paths;
mod retuned;
mod sphere;
mod spin;

use crate::Check;

/// Allowed cost of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Seconds; for tests.
    Quick,
    /// Up to minutes; for `verify`.
    Full,
}

/// Reason why a case has no numbers.
pub type Failure = Box<dyn std::error::Error>;

/// A verification case.
pub struct Case {
    /// Name of the case on the command line.
    pub name: &'static str,
    /// Purpose, with shape, mesh and settings.
    pub about: &'static str,
    /// The case itself.
    pub run: fn(Effort) -> Result<Vec<Check>, Failure>,
}

/// All cases.
pub const CASES: &[Case] = &[
    Case { name: "hertz", about: "paraboloid on the plane, frictionless, exact far field", run: sphere::hertz },
    Case {
        name: "hertz_curved",
        about: "half-space and sphere on a rigid sphere or bowl, crossed cylinders, frictionless, exact far field",
        run: sphere::hertz_curved,
    },
    Case {
        name: "mindlin",
        about: "Cattaneo-Mindlin and back and forth, Coulomb, nu 0.499, exact far field",
        run: sphere::mindlin,
    },
    Case {
        name: "spin",
        about: "sphere that spins: Reissner-Sagoci, Lubkin, full spin, exact far field",
        run: spin::spin,
    },
    Case {
        name: "limit_surface",
        about: "medium mesh of E, 0.5 to 2 mm: friction and moment in full slip, every direction",
        run: limit_surface::limit_surface,
    },
    Case {
        name: "twist",
        about: "medium mesh of E, 0.1 to 1 N: the largest moment, alone and with friction, against measurements",
        run: limit_surface::twist,
    },
    Case { name: "full_slip", about: "lambda sigma^beta on the Hertz pressure in full slip", run: sphere::full_slip },
    Case {
        name: "volume",
        about: "a phantom volume's mesh against the parametric one, E and A",
        run: geometry::volume,
    },
    Case { name: "imported", about: "files read back, a mesh by Gmsh: the press", run: geometry::imported },
    Case {
        name: "hemisphere",
        about: "the silicone fingertip, default mesh of hexahedra and 10-node tetrahedra of its CAD file: slide, reversal, spin",
        run: hemisphere::hemisphere,
    },
    Case { name: "creep", about: "dome, held normal and tangential force at 0.8 of the limit", run: law::creep },
    Case {
        name: "elastic_slip",
        about: "dome, Coulomb 0.2: gamma_crit is a length of the law",
        run: law::elastic_slip,
    },
    Case {
        name: "step_size",
        about: "coarse shape A, fixed bone, 1 mm, slide 3 mm: x4 finer",
        run: numerics::step_size,
    },
    Case { name: "penalty", about: "the same: penalty x10, penetration", run: numerics::penalty },
    Case { name: "regularisation", about: "the same: regular pressure x0.1", run: numerics::regularisation },
    Case { name: "loops", about: "coarse shape A, fixed bone: energy of closed paths", run: numerics::loops },
    Case { name: "hard_paths", about: "coarse shape E, floating bone: turns, lifts, forces", run: paths::hard_paths },
    Case {
        name: "turn_in_full_slip",
        about: "medium shape E: friction is not lost where a slide turns",
        run: paths::turn_in_full_slip,
    },
    Case {
        name: "depth_cycles",
        about: "default mesh of E and A, depth 1 - 0.9 - 1 mm after a slide of 0.5 mm: friction shakes down",
        run: paths::depth_cycles,
    },
    Case { name: "arch", about: "shallow arch under a growing force: past its limit point", run: arch::arch },
    Case {
        name: "convergence",
        about: "three meshes, A fixed and E floating, 1 mm: N, area, F/N",
        run: meshes::convergence,
    },
    Case {
        name: "finer",
        about: "default mesh of E and A against the mean of three finer ones, 0.75 to 1.5 mm: F/N and area in full slip",
        run: meshes::finer,
    },
    Case {
        name: "slides",
        about: "default mesh against faces halved, 1 mm: stick ratio and F(s) over 3 mm and back",
        run: meshes::slides,
    },
    Case {
        name: "elements",
        about: "three meshes of A, frictionless: mean dilatation against C3D8R",
        run: meshes::elements,
    },
    Case { name: "variants", about: "default mesh of E, 1 mm: bones, joint, nail", run: meshes::variants },
    Case { name: "growth", about: "three meshes of E, 1.5 mm and 6 mm of slide: time and memory", run: meshes::growth },
    Case { name: "deep", about: "default mesh: A fixed and E floating 2.5 mm, B at half stiffness", run: paths::deep },
    Case {
        name: "direct_slip",
        about: "coarse shape E, floating bone: steady slide solved directly, and reached along the path",
        run: identify::direct_slip,
    },
    Case {
        name: "twin",
        about: "coarse shape A, fixed bone: every route recovers the planted lambda and beta",
        run: identify::twin,
    },
    Case {
        name: "retuned",
        about: "shipped reduced model, retuned, against fresh fingers of other size, stiffness, lambda: mesh of its runs",
        run: retuned::retuned,
    },
    Case {
        name: "noise",
        about: "the same with 1 % noise: coverage of the 95 % region, by finite elements in full",
        run: identify::noise,
    },
];
