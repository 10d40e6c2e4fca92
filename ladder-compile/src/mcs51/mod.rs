//! The 8051 back end: intermediate code to an image of program memory.

use crate::target::Target;

/// The chips of this back end.
pub const TARGETS: &[Target] = &[];
