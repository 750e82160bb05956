//! fingers
