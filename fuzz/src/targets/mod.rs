//! The targets. Every result is accepted except a panic, a hang and too much memory; properties that hold for
//! all inputs are asserted.

pub(crate) mod code;
pub(crate) mod debug;
pub(crate) mod image;
pub(crate) mod ladder;
pub(crate) mod machine;
pub(crate) mod text;
