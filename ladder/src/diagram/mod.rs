//! Drawn ladder diagrams as instructions: elements joined by wires, in any shape.
//!
//! A reader of a graphical notation fills a [`PowerGraph`]; [`lower`] makes networks of it. Series and
//! parallel groups become the logic of one network. Where the shape is neither (a bridge, or a point that
//! feeds several outputs), a BOOL holds the power of that point, so that no path is lost and none is written
//! twice.

mod graph;
mod lower;
mod names;
mod paths;

pub(crate) use graph::{DrawnCall, DrawnFunction, NodeId, OutputAction, PowerGraph};
pub(crate) use lower::{MAX_DRAWN, lower};
pub(crate) use names::NameMaker;
