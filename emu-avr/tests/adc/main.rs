//! The converter: hand-made cases from DS40002061 as text, and random programs compared with a model that
//! steps cycle by cycle.

mod cases;
mod chips;
mod model;
mod random;
