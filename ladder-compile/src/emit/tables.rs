//! Emits constant tables, in program memory on chips that have a separate one.

use std::fmt::Write;

use super::body::{CellSpelling, literal};
use crate::ir::{ConstantTable, Ir};

/// C type of the elements of a table.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum TableElement {
    Byte,
    Signed,
    Short,
    Long,
}

impl TableElement {
    /// Name of the macro that reads an element.
    pub(super) fn read(self) -> &'static str {
        match self {
            TableElement::Byte => "PLC_BYTE",
            TableElement::Signed => "PLC_SIGNED",
            TableElement::Short => "PLC_SHORT",
            TableElement::Long => "PLC_LONG",
        }
    }

    fn kind(self) -> &'static str {
        match self {
            TableElement::Byte => "unsigned char",
            TableElement::Signed => "plc8",
            TableElement::Short => "plc16",
            TableElement::Long => "plc32",
        }
    }

    /// Width in bytes of a signed integer that holds every element.
    pub(super) fn signed_bytes(self) -> u8 {
        match self {
            TableElement::Signed => 1,
            TableElement::Byte | TableElement::Short => 2,
            TableElement::Long => 4,
        }
    }
}

/// Chooses the type of the elements; one byte is unsigned if a value exceeds 127.
pub(super) fn table_element(table: &ConstantTable) -> TableElement {
    match table.bytes {
        1 if table.values.iter().any(|&value| value > 127) => TableElement::Byte,
        1 => TableElement::Signed,
        2 => TableElement::Short,
        _ => TableElement::Long,
    }
}

const MACROS: &str = "
/* Tables stay in program memory where a chip has one of its own. */
#if defined(__AVR__)
#include <avr/pgmspace.h>
#define PLC_TABLE const PROGMEM
#define PLC_BYTE(t, i) pgm_read_byte(&(t)[i])
#define PLC_SIGNED(t, i) ((plc8)pgm_read_byte(&(t)[i]))
#define PLC_SHORT(t, i) ((plc16)pgm_read_word(&(t)[i]))
#define PLC_LONG(t, i) ((plc32)pgm_read_dword(&(t)[i]))
#else
#if defined(__SDCC)
#define PLC_TABLE __code const
#else
#define PLC_TABLE const
#endif
#define PLC_BYTE(t, i) ((t)[i])
#define PLC_SIGNED(t, i) ((t)[i])
#define PLC_SHORT(t, i) ((t)[i])
#define PLC_LONG(t, i) ((t)[i])
#endif
";

/// Defines the tables that `scan` reads, with twelve values per line; empty if there are none.
pub(super) fn table_definitions(ir: &Ir, names: &CellSpelling, scan: &str) -> String {
    let mut text = String::new();
    for (table, name) in ir.tables.iter().zip(&names.tables) {
        if !scan.contains(&format!("({name}, ")) {
            continue;
        }
        if text.is_empty() {
            text += MACROS;
        }
        let _ = write!(text, "static PLC_TABLE {} {name}[{}] = {{", table_element(table).kind(), table.values.len());
        for (n, value) in table.values.iter().enumerate() {
            let comma = if n == 0 { "" } else { "," };
            let space = if n % 12 == 0 { "\n    " } else { " " };
            let _ = write!(text, "{comma}{space}{}", literal(*value));
        }
        text += "\n};\n";
    }
    text
}
