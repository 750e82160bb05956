//! Verification cases by name: one list, of which the tests run each case with [`Effort::Quick`] and the binary `verify` with
//! [`Effort::Full`].
//!
//! The list is [`for_each_case`](crate::for_each_case). A case is a function in one of the modules: of the effort, with its checks as
//! result, or without arguments, which asserts and records its numbers by [`verify`](crate::verify).

mod arch;
mod balance;
mod bodies;
mod branches;
mod compliance;
mod cook;
mod energy;
mod fingertip_meshes;
mod geometry;
mod hanging_nodes;
mod hemisphere;
mod hyperelastic;
mod identify;
mod law;
mod limit_surface;
mod long_runs;
mod meshes;
mod numerics;
mod patch;
mod paths;
mod poses;
mod readings;
mod relaxing;
mod retuned;
mod rolling;
mod rotation;
mod soft_regions;
mod sphere;
mod spin;
mod stick;
mod stress;
mod symmetry;
mod tangents;
mod tie;

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

/// A function that is a case; `Form` is the form of its signature.
trait Function<Form> {
    fn checks(self, effort: Effort) -> Result<Vec<Check>, Failure>;
}

impl<F: Fn(Effort) -> Result<Vec<Check>, Failure>> Function<Effort> for F {
    fn checks(self, effort: Effort) -> Result<Vec<Check>, Failure> {
        self(effort)
    }
}

impl<F: Fn()> Function<()> for F {
    fn checks(self, _: Effort) -> Result<Vec<Check>, Failure> {
        crate::check::RECORDED.take();
        self();
        Ok(crate::check::RECORDED.take())
    }
}

/// Calls a macro with all cases: module, purpose, and in braces tier, name and purpose of each. In the tier `gate` every test run has it,
/// in `nightly` the nightly one, in `full` the binary `verify` alone.
#[macro_export]
macro_rules! for_each_case {
    ($call:ident) => {
        $call! {
            sphere "paraboloid with the exact far field" {
                gate hertz "frictionless on the plane",
                gate hertz_curved "half-space and sphere on a rigid sphere or bowl, crossed cylinders, frictionless",
                gate mindlin "Cattaneo-Mindlin and back and forth, Coulomb, nu 0.499",
                gate full_slip "lambda sigma^beta on the Hertz pressure in full slip",
            }
            spin "sphere that spins, exact far field" { gate spin "Reissner-Sagoci, Lubkin, full spin" }
            limit_surface "medium mesh of E" {
                nightly limit_surface "0.5 to 2 mm: friction and moment in full slip, every direction",
                full twist "0.1 to 1 N: the largest moment, alone and with friction, against measurements",
            }
            geometry "other geometries" {
                nightly volume "a phantom volume's mesh against the parametric one, E and A",
                gate imported "files read back, a mesh by Gmsh: the press",
            }
            hemisphere "the silicone fingertip" {
                nightly hemisphere "default mesh of hexahedra, 10-node tetrahedra of its CAD file: slide, reversal, spin",
            }
            law "dome" {
                gate creep "held normal and tangential force at 0.8 of the limit",
                nightly elastic_slip "Coulomb 0.2: gamma_crit is a length of the law",
            }
            numerics "coarse shape A, fixed bone" {
                nightly step_size "1 mm, slide 3 mm: x4 finer",
                nightly penalty "the same: penalty x10, penetration",
                nightly regularisation "the same: regular pressure x0.1",
                nightly loops "energy of closed paths",
                gate scales "coarse shape E: tissue 100 times softer, 25 times stiffer; tolerance 1e-7 over a lift",
                nightly mesh_errors "presses and slides on plane, ball and cylinder: errors by the mesh within what is printed",
            }
            paths "long paths" {
                nightly hard_paths "coarse shape E, floating bone: turns, lifts, forces",
                nightly turn_in_full_slip "medium shape E: friction is not lost where a slide turns",
                gate depth_cycles "E and A, depth 1 - 0.9 - 1 mm after a slide of 0.5 mm: friction shakes down",
                full deep "default mesh: A fixed and E floating 2.5 mm, B at half stiffness",
            }
            arch "shallow arch under a growing force" { nightly arch "past its limit point" }
            meshes "influence of the mesh" {
                full convergence "three meshes, A fixed and E floating, 1 mm: N, area, F/N",
                full finer "default mesh of E and A against three finer ones, 0.75 to 1.5 mm: F/N and area in full slip",
                full slides "default mesh against faces halved, 1 mm: stick ratio and F(s) over 3 mm and back",
                full elements "three meshes of A, frictionless: mean dilatation against C3D8R",
                full variants "default mesh of E, 1 mm: bones, joint, nail",
                full growth "three meshes of E, 1.5 mm and 6 mm of slide: time and memory",
            }
            identify "identification on data of the model itself" {
                gate direct_slip "coarse shape E, floating bone: steady slide solved directly, and reached along the path",
                gate twin "coarse shape A, fixed bone: every route recovers the planted lambda and beta",
                gate noise "the same with 1 % noise: coverage of the 95 % region, by finite elements in full",
            }
            relaxing "tissue that relaxes" {
                gate a_step_and_hold_relaxes_as_the_sum_of_the_branches,
                gate a_ramp_has_an_error_of_second_order_in_the_time_step,
                gate no_closed_path_yields_work_at_any_pace,
                gate tangent_and_forces_of_a_step_are_derivatives,
                gate without_branches_and_after_a_long_time_the_finger_is_as_ever,
                gate a_finger_pressed_and_held_relaxes_as_its_tissue,
                gate a_closed_path_of_the_plane_takes_work_at_any_pace,
                nightly the_reduced_models_follow_the_finite_elements_in_time,
            }
            retuned "shipped reduced model" {
                full retuned "retuned, against fresh fingers of other size, stiffness, lambda: mesh of its runs",
            }
            balance "the joint and the pad carry the contact force and its centre of pressure" {
                gate the_joint_carries_the_load_of_the_tissue_on_the_bone,
                gate contact_force_and_centre_of_pressure_are_those_of_the_tissue_on_the_plane,
            }
            bodies "curved rigid bodies: limits that are the plane, spins, work of closed paths" {
                gate a_huge_sphere_is_the_plane,
                gate a_turned_axis_is_a_spin,
                gate a_cylinder_that_turns_in_place_slides,
                nightly the_work_of_closed_paths_is_dissipated,
                gate bodies_without_their_numbers_are_refused,
                gate forces_find_the_places_of_a_ball_and_of_the_plane,
                nightly forces_find_the_places_of_every_body,
                gate loads_beyond_friction_are_refused_on_every_body,
                gate bodies_too_sharp_or_too_small_are_flagged,
                gate a_flat_pad_is_pressed_and_turned_by_force,
            }
            branches "runs that branch off and go on, long steps in steady slip" {
                gate slides_that_branch_off_one_press_are_the_slides_after_presses_of_their_own_to_the_last_bit,
                gate a_run_goes_on_only_from_the_beginning_of_its_path,
                gate longer_steps_in_steady_slip_change_friction_by_less_than_a_thousandth,
            }
            compliance "a small press moves the skin by the compliance at rest" {
                gate a_small_press_moves_the_skin_by_the_compliance,
                nightly a_small_press_moves_the_skin_by_the_compliance_on_a_medium_mesh,
            }
            cook "Cook's membrane, nearly incompressible: no locking" {
                nightly cooks_membrane_does_not_lock,
                gate small_strain_agrees_with_a_published_limit,
                gate full_integration_would_lock,
            }
            energy "the residual is the derivative of the energy, the work of the plane is stored or dissipated" {
                gate residual_is_the_derivative_of_the_energy,
                gate work_of_the_plane_is_stored_or_dissipated,
                nightly work_of_the_plane_is_stored_or_dissipated_under_coulombs_law,
            }
            fingertip_meshes "meshes of the named shapes" { gate named_shapes_pass_the_check }
            hanging_nodes "hexahedra of two sizes side by side" {
                gate linear_fields_pass_hanging_nodes,
                nightly linear_fields_pass_hanging_nodes_of_three_sizes,
            }
            hyperelastic "soft laws against closed forms" {
                gate uniaxial_stretch,
                gate equibiaxial_stretch,
                gate simple_shear_with_dilatation,
                gate alpha_two_is_neo_hookean,
                gate textbook_forms_in_invariants,
                gate small_strain_moduli_are_those_reported,
                gate elastic_constants_are_those_of_a_pulled_bar,
                gate saint_venant_kirchhoff_uniaxial,
            }
            long_runs "runs that are stopped, limits of driven forces, depth in every pose, loads that are refused" {
                nightly a_run_that_was_stopped_and_resumed_finds_the_same_numbers_to_the_last_bit,
                gate a_checkpoint_of_another_run_is_not_used,
                gate progress_is_reported_and_an_interruption_acts_within_an_increment,
                gate a_driven_friction_beyond_the_limit_ends_soon_with_the_number,
                nightly a_driven_moment_beyond_the_limit_ends_soon_with_the_number,
                gate a_force_driven_press_in_a_tilted_pose_has_the_pad_of_that_pose,
                gate depth_counts_from_first_touch_in_every_pose_whatever_the_pad,
                gate the_plane_stays_clear_of_what_is_held,
                gate impossible_loads_are_refused_before_the_run,
            }
            patch "linear fields on distorted blocks" {
                gate linear_fields_are_exact_on_distorted_meshes,
                gate uniform_pressure_on_the_pad_gives_uniform_stress,
            }
            poses "the normal force over the pitch is smooth" {
                gate the_normal_force_is_smooth_over_the_pitch_on_a_coarse_mesh,
                nightly the_normal_force_is_smooth_over_the_pitch,
            }
            readings "reactions and probes" {
                gate reactions_balance_the_plane,
                gate probes_read_a_uniform_strain,
                gate papillae_are_the_same_points_on_every_mesh,
                nightly strain_at_papillae_has_converged_on_the_default_mesh,
                nightly probes_read_the_strain_under_a_hertz_contact,
            }
            rolling "a rigid cylinder that rolls with creep" {
                nightly a_cylinder_that_rolls_creeps_as_carter_found,
            }
            rotation "objectivity: body, plane and path turned together" {
                gate forces_turn_with_the_body,
                gate body_plane_and_path_turned_together_give_the_same_contact,
            }
            soft_regions "named regions with a law of their own" {
                gate a_named_region_presses_as_the_tissue_with_its_law,
                gate a_geometry_without_named_regions_refuses_them,
            }
            stick "everything sticks after a reversal" {
                nightly everything_that_keeps_its_pressure_sticks_after_a_reversal,
                nightly everything_that_keeps_its_pressure_sticks_after_a_reversal_on_a_medium_mesh,
                nightly everything_sticks_after_a_reversal_on_curved_bodies,
            }
            stress "stress of blocks and of the finger" {
                gate a_block_under_uniaxial_load,
                gate a_block_in_simple_shear,
                gate mean_stress_follows_from_the_forces,
                nightly stress_over_the_held_section_balances_the_contact_force,
            }
            symmetry "half of the finger against the whole" {
                gate the_half_finger_gives_what_the_whole_does,
                nightly in_the_same_increments_the_half_finger_gives_the_same_to_the_tolerance,
                gate a_path_along_y_is_followed_with_the_whole,
            }
            tangents "all tangents against finite differences" {
                gate material_tangents,
                gate element_tangents,
                gate body_tangents,
                gate contact_tangents,
            }
            tie "tied meshes" {
                gate column_of_tied_blocks,
                nightly nail_of_the_finger,
            }
        }
    };
}

macro_rules! list {
    ($($module:ident $what:literal { $($tier:ident $name:ident $($about:literal)?),* $(,)? })*) => {
        /// All cases.
        pub const CASES: &[Case] = &[$($(Case {
            name: stringify!($name),
            about: concat!($what $(, ": ", $about)?),
            run: |effort| $module::$name.checks(effort),
        },)*)*];
    };
}

for_each_case!(list);
