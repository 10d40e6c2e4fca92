//! PLCopen XML (TC6, versions 1.0 to 2.01; IEC 61131-10): programs of ladder diagrams or Instruction List.

mod body;
mod functions;
mod project;

pub(crate) use body::read_ladder;
pub(crate) use project::read;
