//! The comparison: evaluator and chip in lockstep, the element that causes a difference, and one program in
//! two dialects.

pub(crate) mod check_run;
pub(crate) mod dialect_comparison;
pub(crate) mod fault_location;
pub(crate) mod lockstep;
pub(crate) mod peripheral_lines;
pub(crate) mod symbol_trace;
