//! Everything that is stored and was computed: how it is made again, and what is stale.
//!
//! Main function: [`main`]. `data/made.toml` holds for each entry of [`MADE`] a checksum of what it was made from and of what was made;
//! the gate compares them.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::model;
use crate::shell::{root, run, sh};
use crate::weekly;

#[derive(clap::Args)]
pub struct Args {
    /// Which; without a name all that is stale
    names: Vec<String>,
    /// Only list the entries and whether they are stale
    #[arg(long)]
    list: bool,
    /// Make nothing: take the present files as made from the present sources
    #[arg(long, conflicts_with = "list")]
    accept: bool,
}

/// Files that are computed from others.
struct Made {
    name: &'static str,
    /// Files and folders that it is made from.
    from: &'static [&'static str],
    /// What is made.
    files: &'static [&'static str],
    how: How,
}

enum How {
    /// The bed of springs of the human finger, from its stored runs, with the documents that hold its bytes.
    Bed,
    /// Its pad, from the same runs; with other options.
    Pad(&'static str),
    /// Tables and pictures beside held-out runs.
    Reference,
    /// Pad and bed of another fingertip, with these flags of `fingerpad finger`.
    Tip(&'static str),
}

/// The gallery and the models of the human finger.
const MADE: &[Made] = &[
    Made { name: "bed", from: &["data/runs"], files: &["data/models/fingertip.fpm"], how: How::Bed },
    Made { name: "pad", from: &["data/runs"], files: &["data/models/fingertip-pad.fpm"], how: How::Pad("") },
    Made {
        name: "small-pad",
        from: &["data/runs"],
        files: &["data/reference/fingertip-pad-24.fpm"],
        how: How::Pad("--patches 24 --fit-runs 171"),
    },
    Made {
        name: "reference",
        from: &[
            "data/runs",
            "data/models/fingertip.fpm",
            "data/models/fingertip-pad.fpm",
            "data/reference/fingertip-pad-24.fpm",
        ],
        files: &["data/reference/fast_against_finite_elements.csv"],
        how: How::Reference,
    },
    Made {
        name: "human-stiffening",
        from: &["offline/fe/src/experiment/human-stiffening.toml"],
        files: &["data/models/human-stiffening-pad.fpm", "data/models/human-stiffening.fpm"],
        how: How::Tip("--config human-stiffening --mesh-preset medium --restarts 4"),
    },
    Made {
        name: "silicone-dome",
        from: &[],
        files: &["data/models/silicone-dome-pad.fpm", "data/models/silicone-dome.fpm"],
        how: How::Tip("--dome 8 --core 4 --material dragon-skin-10 --mu 0.8 --mesh-preset medium"),
    },
    Made {
        name: "allegro-tip",
        from: &[],
        files: &["data/models/allegro-tip-pad.fpm", "data/models/allegro-tip.fpm"],
        how: How::Tip("--dome 12 --core 8 --length-mm 32 --material dragon-skin-30 --mu 0.8 --mesh-preset medium"),
    },
    Made {
        name: "leap-tip",
        from: &[],
        files: &["data/models/leap-tip-pad.fpm", "data/models/leap-tip.fpm"],
        how: How::Tip("--dome 9 --core 5.5 --material dragon-skin-30 --mu 0.8 --mesh-preset medium"),
    },
];

/// Where the checksums stand.
const STAMPS: &str = "data/made.toml";

/// Runs the chore.
pub fn main(args: &Args) -> Result<()> {
    if let Some(name) = args.names.iter().find(|name| MADE.iter().all(|made| made.name != name.as_str())) {
        bail!("no entry `{name}`; there are {}", MADE.iter().map(|made| made.name).collect::<Vec<_>>().join(", "));
    }
    let mut stamps = stamps()?;
    for made in MADE {
        let is_stale = stamps.get(made.name) != Some(&made.stamp()?);
        if args.list {
            println!("{:<18}{}", made.name, if is_stale { "stale" } else { "as made" });
            continue;
        }
        let is_wanted = if args.names.is_empty() { is_stale } else { args.names.iter().any(|name| name == made.name) };
        if !is_wanted {
            continue;
        }
        if !args.accept {
            println!("{}", made.name);
            made.make()?;
        }
        stamps.insert(made.name.to_owned(), made.stamp()?);
        // After each entry, so that an interrupted run goes on.
        let head =
            "# Checksums by `cargo xtask regenerate`: of what each stored file was made from, and of the file.\n";
        fs::write(root().join(STAMPS), format!("{head}{}", toml::to_string(&stamps)?))?;
    }
    Ok(())
}

fn stamps() -> Result<BTreeMap<String, String>> {
    let text = fs::read_to_string(root().join(STAMPS)).unwrap_or_default();
    toml::from_str(&text).context(STAMPS)
}

impl Made {
    /// Checksum of the sources and of what was made.
    fn stamp(&self) -> Result<String> {
        let flags = match self.how {
            How::Pad(flags) | How::Tip(flags) => flags,
            How::Bed | How::Reference => "",
        };
        let mut files = Vec::new();
        for place in self.from.iter().chain(self.files) {
            collect(Path::new(place), &mut files)?;
        }
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(flags.as_bytes());
        for file in files {
            hasher.update(file.to_string_lossy().as_bytes());
            hasher.update(&fs::read(root().join(&file)).unwrap_or_default());
        }
        Ok(format!("{:08x}", hasher.finalize()))
    }

    fn make(&self) -> Result<()> {
        let at = format!("target/regenerate/{}", self.name);
        let finger = |flags: &str| sh(".", &format!("{} finger {flags} --out {at}", model::PROGRAM));
        let take = |made: &str, to: &str| -> Result<()> {
            let from = root().join(&at).join(made);
            if !from.exists() {
                bail!("{}: not made", from.display());
            }
            fs::copy(from, root().join(to)).map(|_| ()).context(to.to_owned())
        };
        match self.how {
            How::Bed => {
                finger("--design stored --only bed --restarts 12")?;
                take("model.fpm", self.files[0])?;
                model::document()?;
                model::corrected()
            }
            How::Pad(flags) => {
                finger(&format!("--design stored --only pad {flags}"))?;
                take("pad.fpm", self.files[0])
            }
            How::Reference => reference(),
            How::Tip(flags) => {
                finger(flags)?;
                take("pad.fpm", self.files[0])?;
                take("model.fpm", self.files[1])
            }
        }
    }
}

/// The reduced models along held-out finite-element runs: the table in `data/reference`, the tables and the pictures of
/// `docs/fast-against-finite-elements.md` and `docs/unknown-friction.md`.
pub fn reference() -> Result<()> {
    run(&mut weekly::program("fast_against_finite_elements"))?;
    run(&mut weekly::program("margin"))
}

/// The files of a place relative to the root, in order.
fn collect(place: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    let at = root().join(place);
    if !at.is_dir() {
        files.push(place.to_owned());
        return Ok(());
    }
    let mut inside = fs::read_dir(&at)?.map(|entry| Ok(place.join(entry?.file_name()))).collect::<Result<Vec<_>>>()?;
    inside.sort();
    inside.iter().try_for_each(|place| collect(place, files))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stored file that was changed by hand, or whose source changed, is stale.
    #[test]
    fn nothing_that_is_stored_is_stale() {
        let stamps = stamps().unwrap();
        let stale: Vec<_> = MADE
            .iter()
            .filter(|made| stamps.get(made.name) != Some(&made.stamp().unwrap()))
            .map(|made| made.name)
            .collect();
        assert!(stale.is_empty(), "stale: {stale:?}; `cargo xtask regenerate` makes them again");
    }
}
