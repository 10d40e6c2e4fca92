//! The targets. What is no panic, no hang and no excess of memory is an answer; where a property holds for all inputs, it is asserted.

pub mod code;
pub mod debug;
pub mod image;
pub mod ladder;
pub mod machine;
pub mod text;
