//! What every instruction does: cases written by hand, and all operands of the arithmetic against plain integers.

#[path = "isa/exhaustive.rs"]
mod exhaustive;
#[path = "isa/table.rs"]
mod table;
