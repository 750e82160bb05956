//! Prints the digest of a million steps of the example model; the firmware of the same name must print the same.

#[path = "../../firmware-example/src/golden.rs"]
mod golden;

fn main() -> Result<(), fingerpad::Error> {
    let data = fingerpad::Params::example().try_build()?;
    println!("golden: {:x}", golden::digest(&data.model()?, 1_000_000));
    Ok(())
}
