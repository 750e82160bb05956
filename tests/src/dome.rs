//! dome
