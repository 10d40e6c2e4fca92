//! Byte names used as bits, and bit names used as bytes: `cpl P1`, `mov a,TI`.
//!
//! as31 and sdas8051 take the address as it is; AX51 and ASEM-51 refuse it (A51, "Type mismatch"). This
//! assembler takes it with a warning; in sources for sdas8051, whose names have no class, without one.

use std::collections::BTreeMap;

use super::super::common::constant;
use super::segment;
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::AsmRefusal;
use crate::symbols::AsmSymbolKind;

/// What an address refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AddressClass {
    Byte,
    Bit,
}

/// Names defined by `bit`, `data` and similar directives, in lower case.
pub(super) type Classes = BTreeMap<String, AddressClass>;

/// `name bit address` and `name data address`. Without a name, as in Raisonance's assembler, `data at 30h`
/// begins a section.
pub(super) fn typed(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, class: AddressClass) {
    let section = if class == AddressClass::Bit { "bit" } else { "idata" };
    if segment::begins(asm, call, section) {
        return;
    }
    if let Some(label) = call.label.clone() {
        asm.family_state.mcs51.classes.insert(call.get(label).to_ascii_lowercase(), class);
    }
    constant(asm, call, AsmSymbolKind::Equ);
}

/// Returns the class of a name, and a description of it.
fn class_of(asm: &Assembler<'_>, name: &str) -> Option<(Option<AddressClass>, String)> {
    if let Some(symbol) = asm.symbols.get(name, asm.dialect.ignores_case) {
        return match symbol.kind {
            AsmSymbolKind::Label { space: "bit", .. } => Some((Some(AddressClass::Bit), format!("`{name}` is a bit"))),
            AsmSymbolKind::Label { space: "xdata", .. } => {
                Some((None, format!("`{name}` is an address of external RAM")))
            }
            AsmSymbolKind::Label { space, .. } if space == asm.chip.code_space => {
                Some((None, format!("`{name}` is an address of the program")))
            }
            AsmSymbolKind::Label { .. } => Some((Some(AddressClass::Byte), format!("`{name}` is a byte"))),
            AsmSymbolKind::Equ => match asm.family_state.mcs51.classes.get(&name.to_ascii_lowercase())? {
                AddressClass::Bit => Some((Some(AddressClass::Bit), format!("`{name}` is a bit"))),
                AddressClass::Byte => Some((Some(AddressClass::Byte), format!("`{name}` is a byte"))),
            },
            _ => None,
        };
    }
    if asm.chip_names.get(name)?.is_register {
        return Some((Some(AddressClass::Byte), format!("`{name}` is a register of 8 bits")));
    }
    let is_bit = asm.chip.bits.iter().any(|bit| bit.name.eq_ignore_ascii_case(name));
    is_bit.then(|| (Some(AddressClass::Bit), format!("`{name}` is a bit")))
}

/// Returns the warning for a name used as an operand of the other class.
pub(super) fn mismatch(asm: &Assembler<'_>, name: &str, kind: &str, n: i32) -> Option<AsmRefusal> {
    let wanted = match kind {
        _ if asm.dialect.hooks.is_sdas => return None,
        "bit address" => AddressClass::Bit,
        "direct address" => AddressClass::Byte,
        _ => return None,
    };
    let (class, what) = class_of(asm, name).filter(|(class, _)| *class != Some(wanted))?;
    let (cause, hint) = match (wanted, class) {
        (AddressClass::Bit, Some(_)) => {
            let byte = if n < 0x80 { 0x20 + n / 8 } else { n & 0xF8 };
            let bit = n % 8;
            (
                format!("{what}, but a bit is needed: bit {bit} of the byte 0x{byte:02X} is used"),
                format!("write `{name}.{bit}`, or the right bit"),
            )
        }
        (AddressClass::Byte, Some(_)) => {
            let hint = "use the byte that contains the bit, or an instruction for bits, as `mov c,bit`";
            (format!("{what}, but a byte is needed: the byte 0x{n:02X} is used"), hint.to_owned())
        }
        _ => (
            format!("{what}, and 0x{n:02X} of the internal RAM is used"),
            format!("write `#{name}` for the address as a number"),
        ),
    };
    Some(AsmRefusal::new("ASM039", cause, hint))
}
