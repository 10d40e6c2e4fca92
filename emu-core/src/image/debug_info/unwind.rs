//! Computes the frames of callers from `.debug_frame` (DWARF 5, section 6.4).

use gimli::{BaseAddresses, CfaRule, DebugFrame, LittleEndian as Le, RegisterRule, UnwindContext, UnwindSection as _};

use super::place::{FrameView, register_pair};
use super::{AVR_DATA, DebugInfo};

/// What is known about the frame of a caller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnwoundFrame {
    /// The canonical frame address in data memory: the value of SP after the function has returned.
    pub cfa: u32,
    /// Registers that the function has saved: number, and address in data memory.
    pub saved: Vec<(u16, u32)>,
}

impl DebugInfo {
    /// Computes the frame of the caller of `frame`, or returns `None` if the file does not describe it.
    #[must_use]
    pub fn unwind(&self, frame: &dyn FrameView) -> Option<UnwoundFrame> {
        if self.frames.is_empty() {
            return None;
        }
        let mut section = DebugFrame::new(&self.frames, Le);
        section.set_address_size(4);
        let (bases, mut context) = (BaseAddresses::default(), UnwindContext::new());
        let byte = u64::from(frame.pc_byte());
        let row = section.unwind_info_for_address(&bases, &mut context, byte, DebugFrame::cie_from_offset).ok()?;
        let &CfaRule::RegisterAndOffset { register, offset } = row.cfa() else { return None };
        let cfa = register_pair(frame, register.0)?.checked_add_signed(i32::try_from(offset).ok()?)? & !AVR_DATA;
        let saved = row.registers().filter_map(|(register, rule)| match rule {
            RegisterRule::Offset(offset) => Some((register.0, cfa.checked_add_signed(i32::try_from(*offset).ok()?)?)),
            _ => None,
        });
        Some(UnwoundFrame { cfa, saved: saved.collect() })
    }
}
