//! The compiled part of the Python package: beds and pads, contacts of them over numpy arrays, and the program `fingerpad`.
//!
//! The public names and shapes are in `python/fingerpad`; arrays arrive here checked and contiguous.

// A wheel must run on every processor of its architecture, and the same bits come from all of them.
#[cfg(all(target_arch = "x86_64", target_feature = "avx"))]
compile_error!(
    "built for this machine's processor alone: build in bindings/python, or set RUSTFLAGS=-Ctarget-cpu=generic"
);

mod bed;
mod contacts;
mod error;
mod finger;
mod frames;
mod group;
mod margin;
mod model;
mod pad;
mod relaxation;
mod shipped;

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the program `fingerpad` in this process, whose signals it takes, and returns its exit code; help and bad usage end
/// the process. Raises InputError in a wheel without the program.
///
/// * `words`: the command line, the program's name first
/// * `line_every_s`: time between lines of progress, s; by default that of the program
#[pyfunction]
#[pyo3(signature = (words, line_every_s=None))]
fn run_program(py: Python<'_>, words: Vec<OsString>, line_every_s: Option<f64>) -> PyResult<u8> {
    py.detach(|| program::run(words, line_every_s))
}

/// The names of the flags in `bits`, joined by `+`; `ok` for none.
#[pyfunction]
fn status_words(bits: u32) -> String {
    fingerpad::Status(bits).to_string()
}

/// The compiled part of the package `fingerpad`.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("HAS_PROGRAM", cfg!(feature = "program"))?;
    module.add_class::<model::Model>()?;
    module.add_class::<pad::Pad>()?;
    module.add_function(wrap_pyfunction!(model::load, module)?)?;
    module.add_class::<contacts::Contacts>()?;
    module.add_class::<finger::Finger>()?;
    module.add_class::<finger::Response>()?;
    module.add_class::<margin::MarginObserver>()?;
    module.add_class::<margin::Margin>()?;
    module.add_function(wrap_pyfunction!(run_program, module)?)?;
    module.add_function(wrap_pyfunction!(status_words, module)?)
}

#[cfg(feature = "program")]
mod program {
    use std::ffi::OsString;
    use std::time::Duration;

    use pyo3::PyResult;

    pub fn run(words: Vec<OsString>, line_every_s: Option<f64>) -> PyResult<u8> {
        if let Some(period) = line_every_s.and_then(|s| Duration::try_from_secs_f64(s).ok()) {
            fingerpad_cli::line_every(period);
        }
        Ok(fingerpad_cli::run(words))
    }
}

#[cfg(not(feature = "program"))]
mod program {
    use std::ffi::OsString;

    use pyo3::PyResult;

    pub fn run(_: Vec<OsString>, _: Option<f64>) -> PyResult<u8> {
        Err(crate::error::input("run_program: this wheel was built without the program"))
    }
}
