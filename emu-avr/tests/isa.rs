//! Tests of each instruction: hand-written cases, and all operands of the arithmetic compared with plain
//! integers.

#[path = "isa/exhaustive.rs"]
mod exhaustive;
#[path = "isa/reference.rs"]
mod reference;
#[path = "isa/table.rs"]
mod table;
