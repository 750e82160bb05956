//! Packs a model: `cargo run -p fingerpad-fmu --example pack -- MODEL.fpm OUT.fmu`; the program's `export --format fmu` does the same.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, out] = &arguments[..] else { return Err("usage: pack MODEL.fpm OUT.fmu".into()) };
    let file = fingerpad::host::ModelFile::new(&std::fs::read(model)?)?;
    std::fs::write(out, fingerpad_fmu::pack(&file, model)?)?;
    Ok(())
}
