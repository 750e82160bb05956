//! Chores of the project; each prints what it does.

mod elf;
mod thumb;

use clap::Parser;

#[derive(Parser)]
#[command(about = "Chores: test, verify, bench", name = "cargo xtask")]
enum Chore {
    /// Firmware: prepare the toolchain, build, run under QEMU, check the gates
    Thumb(thumb::Args),
}

fn main() -> anyhow::Result<()> {
    match Chore::parse() {
        Chore::Thumb(args) => thumb::main(&args),
    }
}
