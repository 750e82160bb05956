//! The verification cases at the effort of a test; `verify` runs them in full.

use fingerpad_tests::{CASES, Effort, table};

fn passes(name: &str) {
    let case = CASES.iter().find(|case| case.name == name).expect("a case of this name");
    let checks = (case.run)(Effort::Quick).unwrap_or_else(|error| panic!("{name}: {error}"));
    let table = table(name, &checks);
    println!("{table}");
    assert!(checks.iter().all(|check| check.passes()), "\n{table}");
}

macro_rules! tests {
    (@ gate $name:ident) => {
        #[test]
        fn $name() {
            super::passes(stringify!($name));
        }
    };
    (@ nightly $name:ident) => {
        #[test]
        #[ignore = "nightly"]
        fn $name() {
            super::passes(stringify!($name));
        }
    };
    (@ full $name:ident) => {};
    ($($module:ident $what:literal { $($tier:ident $name:ident $($about:literal)?),* $(,)? })*) => {
        $(mod $module {
            $(tests!(@ $tier $name);)*
        })*
    };
}

fingerpad_tests::for_each_case!(tests);
