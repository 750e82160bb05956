//! The text of branches of relaxing tissue, in settings files and on the command line.
//!
//! Main functions: [`parse`], [`text`]. May use: nothing of this crate.

use fingerpad::{BRANCHES, Branch, Error, Field, Relaxation};
use serde::{Deserialize, Deserializer, Serializer, de};

/// Name of [`Relaxation::HUMAN_ASSUMED`].
const HUMAN_ASSUMED: &str = "human-assumed";

/// Branches from their text: `human-assumed`, `none`, or SHARE:TIME_S of each.
///
/// # Errors
/// A sentence with the part or value that is wrong.
pub fn parse(text: &str) -> Result<Relaxation, String> {
    match text {
        "none" => return Ok(Relaxation::none()),
        HUMAN_ASSUMED => return Ok(Relaxation::HUMAN_ASSUMED),
        _ => {}
    }
    let mut list = Vec::new();
    for part in text.split(',') {
        let expected = || format!("`{part}`: expected human-assumed, none or SHARE:TIME_S, as in 1:0.004,0.6:0.07");
        let (share, time_s) = part.split_once(':').ok_or_else(expected)?;
        let [share, time_s] = [share, time_s].map(|number| number.trim().parse::<f32>().map_err(|_| expected()));
        list.push(Branch { share: share?, time_s: time_s? });
    }
    Relaxation::new(&list).map_err(|e| match e {
        Error::Range { what: Field::RelaxationShare, index, value } => {
            format!("share {value} of branch {} is outside 0 to 100", index + 1)
        }
        Error::Range { index, value, .. } => {
            format!("time {value} s of branch {} is outside 10 us to 100 000 s", index + 1)
        }
        _ => format!("{} branches, at most {BRANCHES}", list.len()),
    })
}

/// The text that [`parse`] reads.
pub fn text(relaxation: &Relaxation) -> String {
    if *relaxation == Relaxation::HUMAN_ASSUMED {
        return HUMAN_ASSUMED.into();
    }
    let used = relaxation.branches().iter().filter(|branch| branch.share != 0.0);
    let parts: Vec<String> = used.map(|branch| format!("{}:{}", branch.share, branch.time_s)).collect();
    if parts.is_empty() { "none".into() } else { parts.join(",") }
}

/// A sentence about shares that nobody measured, if these are such.
pub fn assumption(relaxation: &Relaxation) -> Option<&'static str> {
    (*relaxation == Relaxation::HUMAN_ASSUMED).then_some(
        "relaxation human-assumed: the times are those of Pawluk and Howe (1999); the shares 1, 0.6, 0.6 are assumed",
    )
}

/// Whether the tissue does not relax.
pub(crate) fn is_none(relaxation: &Relaxation) -> bool {
    !relaxation.is_some()
}

pub(crate) fn serialize<S: Serializer>(relaxation: &Relaxation, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(&text(relaxation))
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Relaxation>, D::Error> {
    parse(&String::deserialize(from)?).map(Some).map_err(de::Error::custom)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_of_branches_is_read_back() {
        for given in ["none", "human-assumed", "1:0.004", "0.25:0.07,3:1.4"] {
            assert_eq!(text(&parse(given).unwrap()), given);
        }
        assert_eq!(text(&parse("1:0.004,0.6:0.07,0.6:1.4").unwrap()), "human-assumed");
        for (given, named) in [("1", "`1`"), ("-1:2", "share -1"), ("1:0", "time 0"), ("1:1,1:2,1:3,1:4", "4 branches")]
        {
            let error = parse(given).unwrap_err();
            assert!(error.contains(named), "{error}");
        }
    }
}
