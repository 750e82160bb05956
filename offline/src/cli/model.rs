//! The model file that a command starts from.

use std::path::Path;

use fingerpad::{Data, File, Params};

use super::Failure;

/// The numbers of a model file and its name; without a path those of the example that the core ships.
pub fn load(path: Option<&Path>) -> Result<(Data, String), Failure> {
    let refuse = |path: &Path, e: &dyn std::fmt::Display| Failure::Input(anyhow::anyhow!("{}: {e}", path.display()));
    match path {
        None => {
            let data = Params::example().try_build().map_err(|e| Failure::Numerics(anyhow::anyhow!("{e}")))?;
            Ok((data, "example of the core".into()))
        }
        Some(path) => {
            let bytes = std::fs::read(path).map_err(|e| refuse(path, &e))?;
            let mut buffer = AlignedBytes::default();
            buffer.fill(&bytes);
            let file = File::from_bytes(buffer.bytes()).map_err(|e| refuse(path, &e))?;
            let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
            Ok((*file.model.data(), name))
        }
    }
}

/// A buffer of bytes that starts at a multiple of 8.
#[derive(Default)]
struct AlignedBytes {
    store: Vec<u8>,
    from: usize,
    length: usize,
}

impl AlignedBytes {
    fn fill(&mut self, bytes: &[u8]) {
        self.store = vec![0; bytes.len() + 8];
        self.from = self.store.as_ptr().align_offset(8);
        self.length = bytes.len();
        self.store[self.from..self.from + bytes.len()].copy_from_slice(bytes);
    }

    fn bytes(&self) -> &[u8] {
        &self.store[self.from..self.from + self.length]
    }
}
