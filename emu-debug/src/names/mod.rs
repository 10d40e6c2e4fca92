//! Addresses as words: names of symbols, registers and bits, and source lines, for addresses and back.

pub mod address_names;
pub mod bit_space;
pub mod program_source;
