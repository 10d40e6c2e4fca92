//! Frames of callers, by `.debug_frame` (DWARF 5, section 6.4).

use gimli::{BaseAddresses, CfaRule, DebugFrame, LittleEndian as Le, RegisterRule, UnwindContext, UnwindSection as _};

use super::place::{FrameView, register_pair};
use super::{AVR_DATA, DebugInfo};

/// What is known of the frame around one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnwoundFrame {
    /// The canonical frame address, in data memory: what SP is again when the function has returned.
    pub cfa: u32,
    /// Registers that the function has saved, by their numbers, and the addresses in data memory where they lie.
    pub saved: Vec<(u16, u32)>,
}

impl DebugInfo {
    /// How to get from a frame to the one around it; nothing where the file does not tell.
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
