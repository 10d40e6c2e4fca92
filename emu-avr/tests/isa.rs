//! What every instruction does: cases written by hand, and all operands of the arithmetic against plain integers.

#[path = "isa/exhaustive.rs"]
mod exhaustive;
#[path = "isa/reference.rs"]
mod reference;
#[path = "isa/table.rs"]
mod table;
