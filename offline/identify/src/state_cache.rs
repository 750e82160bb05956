//! Cache of computed steady states, in a file that survives a kill of the program.
//!
//! The file is a row of records: length (u32, little-endian), key, state. A record cut short by a kill is dropped.

use std::{
    collections::HashMap,
    fs::{File, OpenOptions},
    io::{Read, Seek, SeekFrom, Write},
    path::Path,
    sync::Mutex,
};

use sha2::{Digest, Sha256};

use super::{IdentifyError, Steady};

/// Hash of everything that a state depends on.
pub type Key = [u8; 16];

/// Hash of anything that can be written down.
pub fn key_of(what: &impl serde::Serialize) -> Key {
    let text = postcard::to_stdvec(what).expect("plain values");
    Sha256::digest(text)[..16].try_into().expect("16 of 32 bytes")
}

/// States by key.
#[derive(Default)]
pub struct StateCache {
    known: Mutex<HashMap<Key, Steady>>,
    file: Option<Mutex<File>>,
    name: String,
}

impl StateCache {
    /// A cache in the file `path`, with the states that it holds already.
    ///
    /// # Errors
    /// [`IdentifyError::Cache`] if the file cannot be read or written.
    pub fn open(path: &Path) -> Result<Self, IdentifyError> {
        let name = path.display().to_string();
        let failed = |source| IdentifyError::Cache { path: name.clone(), source };
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(failed)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let mut known = HashMap::new();
        let mut rest = bytes.as_slice();
        while let Some((length, tail)) = rest.split_first_chunk::<4>() {
            let length = u32::from_le_bytes(*length) as usize;
            let Some(record) = tail.get(..length) else { break };
            let Ok((key, state)) = postcard::from_bytes::<(Key, Steady)>(record) else { break };
            known.insert(key, state);
            rest = &tail[length..];
        }
        let good = (bytes.len() - rest.len()) as u64;
        file.set_len(good).and_then(|()| file.seek(SeekFrom::End(0))).map_err(failed)?;
        Ok(Self { known: Mutex::new(known), file: Some(Mutex::new(file)), name })
    }

    /// Number of states in the cache.
    pub fn len(&self) -> usize {
        self.known.lock().expect("no panic while locked").len()
    }

    /// Whether the cache holds no state.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The state of a key.
    pub fn get(&self, key: &Key) -> Option<Steady> {
        self.known.lock().expect("no panic while locked").get(key).cloned()
    }

    /// Adds a state and appends it to the file.
    ///
    /// # Errors
    /// [`IdentifyError::Cache`] if it cannot be written.
    pub fn put(&self, key: Key, state: &Steady) -> Result<(), IdentifyError> {
        if let Some(file) = &self.file {
            let record = postcard::to_stdvec(&(key, state)).expect("plain values");
            let mut bytes = (record.len() as u32).to_le_bytes().to_vec();
            bytes.extend(record);
            let failed = |source| IdentifyError::Cache { path: self.name.clone(), source };
            file.lock().expect("no panic while locked").write_all(&bytes).map_err(failed)?;
        }
        self.known.lock().expect("no panic while locked").insert(key, state.clone());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_cut_short_is_dropped_and_the_file_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("states.bin");
        let state = |n: f64| Steady { normal_force_n: n, pressure: vec![[0.1, n]], ..Default::default() };
        let cache = StateCache::open(&path).unwrap();
        cache.put(key_of(&1), &state(1.0)).unwrap();
        cache.put(key_of(&2), &state(2.0)).unwrap();
        drop(cache);
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 3]).unwrap();
        let cache = StateCache::open(&path).unwrap();
        assert_eq!((cache.get(&key_of(&1)), cache.get(&key_of(&2))), (Some(state(1.0)), None));
        cache.put(key_of(&3), &state(3.0)).unwrap();
        drop(cache);
        let cache = StateCache::open(&path).unwrap();
        assert_eq!((cache.len(), cache.get(&key_of(&3))), (2, Some(state(3.0))));
    }
}
