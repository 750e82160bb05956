//! Exceptions of the package, which its Python part defines.

use pyo3::prelude::*;

/// An exception of `fingerpad._errors` by its name.
pub fn raise(py: Python<'_>, class: &str, text: String) -> PyErr {
    let made = py.import("fingerpad._errors").and_then(|module| module.getattr(class)?.call1((text,)));
    match made {
        Ok(exception) => PyErr::from_value(exception),
        Err(error) => error,
    }
}

/// Input that is refused.
pub fn input(text: impl Into<String>) -> PyErr {
    Python::attach(|py| raise(py, "InputError", text.into()))
}

/// A model, a state or a pose that is refused.
pub fn model(error: fingerpad::Error) -> PyErr {
    Python::attach(|py| raise(py, "ModelError", error.to_string()))
}
