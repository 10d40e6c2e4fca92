//! The pieces that silicon repeats, as plain values that are asked instead of ticked: "what are you at cycle t?" and
//! "when is your next event?".

pub mod counter;
pub mod prescaler;
pub mod uart;
