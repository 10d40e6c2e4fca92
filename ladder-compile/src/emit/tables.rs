//! Constant tables in program memory, where a chip has one of its own.

use std::fmt::Write;

use super::body::{Spelling, literal};
use crate::ir::{Ir, Table};

/// What an element of a table is kept as.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Element {
    Byte,
    Signed,
    Short,
    Long,
}

impl Element {
    /// The macro that reads one.
    pub(super) fn read(self) -> &'static str {
        match self {
            Element::Byte => "PLC_BYTE",
            Element::Signed => "PLC_SIGNED",
            Element::Short => "PLC_SHORT",
            Element::Long => "PLC_LONG",
        }
    }

    fn kind(self) -> &'static str {
        match self {
            Element::Byte => "unsigned char",
            Element::Signed => "plc8",
            Element::Short => "plc16",
            Element::Long => "plc32",
        }
    }

    /// Bytes with sign that hold what is read.
    pub(super) fn needs(self) -> u8 {
        match self {
            Element::Signed => 1,
            Element::Byte | Element::Short => 2,
            Element::Long => 4,
        }
    }
}

/// One byte is without sign where a value asks for it.
pub(super) fn element(table: &Table) -> Element {
    match table.bytes {
        1 if table.values.iter().any(|&value| value > 127) => Element::Byte,
        1 => Element::Signed,
        2 => Element::Short,
        _ => Element::Long,
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

/// The tables that `scan` reads, twelve values a line; nothing where there are none.
pub(super) fn tables(ir: &Ir, names: &Spelling, scan: &str) -> String {
    let mut text = String::new();
    for (table, name) in ir.tables.iter().zip(&names.tables) {
        if !scan.contains(&format!("({name}, ")) {
            continue;
        }
        if text.is_empty() {
            text += MACROS;
        }
        let _ = write!(text, "static PLC_TABLE {} {name}[{}] = {{", element(table).kind(), table.values.len());
        for (n, value) in table.values.iter().enumerate() {
            let comma = if n == 0 { "" } else { "," };
            let space = if n % 12 == 0 { "\n    " } else { " " };
            let _ = write!(text, "{comma}{space}{}", literal(*value));
        }
        text += "\n};\n";
    }
    text
}
