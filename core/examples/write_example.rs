//! Writes the example model file: `cargo run -p fingerpad --example write_example -- OUT.fpm`.

use fingerpad::{Data, Params};

const META: &str = r#"{"name":"example","fitted":false,"note":"hand-made numbers of realistic size, not a finger"}"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: write_example OUT.fpm")?;
    let data = Params::example().try_build()?;
    let mut file = vec![0; Data::file_length(&[], META)];
    data.write_file(&[], META, &mut file)?;
    std::fs::write(path, file)?;
    Ok(())
}
