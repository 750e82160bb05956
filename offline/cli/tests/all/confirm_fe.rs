//! `diagnose --confirm-fe` that is stopped, by Ctrl-C and hard: finished strokes are not run again, and the report is
//! that of a run in one go.

#![cfg(unix)]

use std::collections::BTreeMap;
use std::process::Child;
use std::time::{Duration, Instant, SystemTime};
use std::{fs, thread};

use serde_json::Value;

use crate::common::{Folder, ended, fe_set, signal};

fn diagnose(folder: &Folder, out: &str) -> Child {
    let line = "diagnose --calibration c.csv --measured m.csv --confirm-fe --fe-strokes 2 --shape d --out";
    folder.command(&format!("{line} {out}")).spawn().unwrap()
}

/// Finished strokes with the time of their writing.
fn strokes(folder: &Folder, out: &str) -> BTreeMap<String, SystemTime> {
    let names = folder.names(&format!("{out}/fe")).into_iter().filter(|name| name.ends_with(".json"));
    let written = |name: &str| fs::metadata(folder.path(&format!("{out}/fe/{name}"))).unwrap().modified().unwrap();
    names.map(|name| (name.clone(), written(&name))).collect()
}

fn wait_for(child: &mut Child, folder: &Folder, least: usize) {
    let start = Instant::now();
    while strokes(folder, "half").len() < least {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself before {least} strokes");
        assert!(start.elapsed() < Duration::from_secs(900), "no stroke is finished");
        thread::park_timeout(Duration::from_millis(5));
    }
}

fn report(folder: &Folder, out: &str) -> Value {
    let mut report = folder.json(&format!("{out}/report.json"));
    report.as_object_mut().unwrap().remove("elapsed_s").expect("a time");
    report
}

#[test]
#[ignore = "nightly"]
fn a_stopped_confirmation_goes_on_where_it_was() {
    let folder = Folder::with(&[("c.csv", &fe_set("calibration_d")), ("m.csv", &fe_set("set_17"))]);
    let mut child = diagnose(&folder, "half");
    wait_for(&mut child, &folder, 1);
    signal(&child, "-INT");
    let (code, _, stderr) = ended(child);
    assert_eq!(code, Some(130), "{stderr}");
    assert!(stderr.contains("finished strokes are kept in half/fe"), "{stderr}");
    let first = strokes(&folder, "half");
    assert!(report(&folder, "half")["fe_confirmation"].is_null(), "the report is written without the confirmation");
    assert!(folder.exists("half/report.html") && folder.exists("half/corrected.fpm"));

    let mut child = diagnose(&folder, "half");
    wait_for(&mut child, &folder, first.len() + 1);
    child.kill().unwrap();
    child.wait().unwrap();
    let second = strokes(&folder, "half");
    let (code, _, stderr) = ended(diagnose(&folder, "half"));
    assert_eq!(code, Some(0), "{stderr}");
    let last = strokes(&folder, "half");
    for (file, written) in first.iter().chain(&second) {
        assert_eq!(last.get(file), Some(written), "{file} was run again");
    }

    let (code, _, stderr) = ended(diagnose(&folder, "whole"));
    assert_eq!(code, Some(0), "{stderr}");
    assert!(strokes(&folder, "half").keys().eq(strokes(&folder, "whole").keys()));
    assert!(last.len() > second.len() && second.len() > first.len());
    assert!(report(&folder, "whole")["fe_confirmation"]["runs"].is_array());
    assert_eq!(report(&folder, "half"), report(&folder, "whole"));
}
