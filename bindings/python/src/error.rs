//! Exceptions of the package, which its Python part defines.

use std::path::Path;

use pyo3::prelude::*;

/// An exception of `fingerpad._errors` by its name.
fn raise(class: &str, text: String) -> PyErr {
    Python::attach(|py| {
        let made = py.import("fingerpad._errors").and_then(|module| module.getattr(class)?.call1((text,)));
        match made {
            Ok(exception) => PyErr::from_value(exception),
            Err(error) => error,
        }
    })
}

/// Input that is refused.
pub fn input(text: impl Into<String>) -> PyErr {
    raise("InputError", text.into())
}

/// A model or a state that is refused.
pub fn model(error: fingerpad::Error) -> PyErr {
    model_text(error.to_string())
}

/// The same in other words.
pub fn model_text(text: String) -> PyErr {
    raise("ModelError", text)
}

/// Arrays whose lengths do not fit.
pub fn wrong_length(expected: usize, found: usize) -> PyErr {
    input(format!("{found} numbers where {expected} are needed"))
}

/// The bytes of a file.
pub fn read(path: &Path) -> PyResult<Vec<u8>> {
    std::fs::read(path).map_err(|e| input(format!("{}: {e}", path.display())))
}

/// Refuses a factor of a tuning that is out of range by its name.
pub fn check_tuning(size: f32, stiffness: f32, lambda_factor: f32) -> PyResult<()> {
    let ranges =
        [("size", size, 0.5, 2.0), ("stiffness", stiffness, 0.2, 5.0), ("lambda_factor", lambda_factor, 0.1, 10.0)];
    for (name, value, low, high) in ranges {
        if !(value >= low && value <= high) {
            return Err(model_text(format!("{name}: {value} is not between {low} and {high}")));
        }
    }
    Ok(())
}
