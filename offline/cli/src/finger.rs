//! `fingerpad finger`: the models of a finger, made from finite-element runs, from a pad or from another model.

mod bed;
mod full_slips;
mod make;
mod pad;
mod page;
mod retune;
mod runs;
mod springs;

use clap::Subcommand;

use super::Failure;

/// Make the model files of your finger: runs of a design of experiments, fits, report
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_help = "\
Examples:
  fingerpad finger --shape b --mesh-preset medium --out b      a shipped shape: some minutes
  fingerpad finger --dome 12 --core 7 --material dragon-skin-10 --mu 0.8 --mesh-preset coarse --out dome
                                                               a fingertip of a robot by its dimensions
  fingerpad finger --flat 20,16,4 --young 0.3 --mu 0.8 --mesh-preset coarse --out gel
                                                               a flat pad of gel on a plate
  fingerpad finger --config mine.toml --out model              your finger on the default mesh
  fingerpad finger --config mine.toml --out model --estimate   only print the number of runs and their time
  fingerpad finger --config mine.toml --out model --design full
                                                               every kind of motion, hours
  fingerpad finger --config mine.toml --out model --design full --task 2/8
                                                               the runs of the second of eight shares only
  fingerpad finger --design stored --only pad --patches 24 --out small
                                                               a small pad from the runs that ship
  fingerpad finger bed --pitch-deg 40 --out steep.fpm          a bed in another pose, from a pad
  fingerpad finger retune --stiffness 1.2 --out stiffer.fpm    another stiffness, without runs

The folder holds runs/ (a file for each finished path), pad.fpm, model.fpm and a report. pad.fpm is the pad, for every
pose, other rigid bodies and the forces of a hand; model.fpm is the bed of springs for firmware, in the pose of the
mesh on a plane. An interrupted run resumes when the command is started again. Runs of other settings are kept apart by the
hash in their names.

The pad is patches of the skin on the finger's own compliance, from one factorisation of its stiffness; its other parameters are
fitted to the runs of the quick design: a press, slides, a reversal, changes of depth, spins, poses and one deep path. The bed is
fitted to the runs in its pose and, where they are few, to some hundred paths of the pad. The printed errors are those along the
other half of the runs, which are left out of every fit. --design full runs the design of the shipped files; a section [design] in
--config sets the size of either. Without one, depths, slides and forces follow from the tip: its soft layer, its curvature, its
stiffness and its friction.

--relaxation gives the models tissue that relaxes. All runs are of relaxed tissue. A further press for each branch tells which share
of the finger's force relaxes with it. The program prints these shares and writes them into the model files.

The last lines are the verdict on pad and bed, for each kind of motion; reduced.html shows it with the tip and its curves. Exit
code 4: a model is not usable in the neutral pose. Then its file is written only with --accept.")]
pub struct Args {
    #[command(subcommand)]
    verb: Option<Verb>,
    #[command(flatten)]
    make: make::Args,
}

#[derive(Subcommand)]
enum Verb {
    /// Make pad and bed from finite-element runs; this is what `finger` without a verb does
    Make(Box<make::Args>),
    /// Make a bed of springs from a pad, in any pose
    Bed(bed::Args),
    /// Write a model for another finger: its size, stiffness and friction over those of the fitted one
    Retune(retune::Args),
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    match &args.verb {
        None => make::run(&args.make),
        Some(Verb::Make(args)) => make::run(args),
        Some(Verb::Bed(args)) => bed::run(args),
        Some(Verb::Retune(args)) => retune::run(args),
    }
}
