//! Reads the table of messages in a `.cod` file, which gpasm's `.direct` writes for a simulator.
//!
//! ```text
//!   program address (4 bytes, high byte first), kind (a letter), length, text
//! ```
//! The last 8 bytes of a block contain no message; a kind of 0 ends the messages of a block.

use crate::image::symbols::gputils::cod::CodBlock;
use diag::Diagnostic;
use diag::text::into_printable;

use super::super::{FaultList, MORE_CODE, SymbolFile};
use super::cod::{BLOCK_BYTES, CodFile, MESSAGES, long, report_damaged, text};
use crate::image::Image;

/// A message for a simulator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SimulatorMessage {
    /// Program word address to which it belongs.
    pub addr: u32,
    /// Kind of the message: `A` or `a` is an assertion, `C` or `c` a command when the address is reached, `E`
    /// or `e` a command at the start. Others are for other tools.
    pub kind: char,
    /// The text.
    pub text: String,
}

/// Reads the messages of a `.cod` file in their order; empty if it has no such table.
///
/// # Errors
/// All faults of the file, with the codes of [`load_symbols`](crate::image::load_symbols).
pub fn load_messages(file: &SymbolFile) -> Result<Vec<SimulatorMessage>, Vec<Diagnostic>> {
    let mut faults = FaultList::new(file.name, MORE_CODE);
    let mut messages = Vec::new();
    if let Some(cod) = CodFile::new(file.bytes, &mut faults) {
        for CodBlock { number, bytes: block } in cod.main_table(MESSAGES, "messages", &mut faults) {
            read_messages(number, block, &mut messages, &mut faults);
        }
    }
    faults.finish(Image::default()).map(|_| messages)
}

fn read_messages(number: usize, block: &[u8], messages: &mut Vec<SimulatorMessage>, faults: &mut FaultList) {
    let mut at = 0;
    while at < BLOCK_BYTES - 8 {
        let Some(kind) = block.get(at + 4).copied().filter(|kind| *kind != 0) else { return };
        let (Some(addr), Some(text)) = (long(block, at), text(block, at + 5)) else {
            return report_damaged(number, at, "the message", faults);
        };
        at += 6 + usize::from(block.get(at + 5).copied().unwrap_or(0));
        messages.push(SimulatorMessage { addr, kind: char::from(kind), text: into_printable(text) });
    }
}
