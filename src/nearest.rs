//! The name that was probably meant.

pub use diag::{distance, nearest};
