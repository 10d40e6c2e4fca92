//! The targets. What is no panic, no hang and no excess of memory is an answer; where a property holds for all inputs, it is asserted.

pub(crate) mod code;
pub(crate) mod debug;
pub(crate) mod image;
pub(crate) mod ladder;
pub(crate) mod machine;
pub(crate) mod text;
