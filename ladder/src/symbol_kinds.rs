//! Symbols of a program, and their kinds.

use std::ops::RangeInclusive;

use serde::Serialize;

use crate::il::IecType;

/// Kind of a symbol, derived from its first letter and its use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SymbolKind {
    /// `X..`, one bit, at a pin.
    Input,
    /// `Y..`, one bit, at a pin.
    Output,
    /// `R..`, one bit without a pin.
    Relay,
    /// Accumulator of a TON, TOF or RTO, in scans.
    Timer,
    /// Accumulator of a CTU, CTD or CTC.
    Counter,
    /// `A..`, an integer that READ_ADC stores.
    Adc,
    /// Any other integer.
    Variable,
}

impl SymbolKind {
    /// True for kinds that hold one bit.
    #[must_use]
    pub const fn is_bit(self) -> bool {
        matches!(self, SymbolKind::Input | SymbolKind::Output | SymbolKind::Relay)
    }
}

/// A symbol of a program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LadderSymbol {
    /// Full name with its first letter.
    pub name: String,
    /// Kind of the symbol.
    pub kind: SymbolKind,
    /// Package pin from `IO LIST`; 0 if not assigned or not a pin.
    pub pin: u32,
    /// Width in bytes, 1 to 4; 0 for a bit.
    ///
    /// Always 2 in dialect 2.3. In ldmicro-5, the width in `VAR LIST`. Without one, a counter has the fewest
    /// bytes that hold its limit and its start value, and a timer the fewest that hold the scans that it
    /// counts (the largest, if several elements share the name); all other integers have 2. In an IEC program
    /// the width of the type.
    pub bytes: u8,
    /// Type in an IEC program; `None` in the dialects of LDmicro, whose integers have a sign.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iec_type: Option<IecType>,
    /// True if the value comes from outside: an input, or a number of VAR_INPUT or at %I.
    #[serde(skip)]
    pub is_given: bool,
}

impl LadderSymbol {
    /// Returns a value as the type shows it: of an unsigned type, the number without sign that has the same
    /// bits.
    #[must_use]
    pub fn shown_value(&self, value: i32) -> i64 {
        self.iec_type.as_ref().map_or(i64::from(value), |iec_type| iec_type.wrap(value.into()))
    }

    /// Returns the smallest and the largest value of the symbol.
    #[must_use]
    pub fn range(&self) -> RangeInclusive<i64> {
        let bits = 8 * u32::from(self.bytes);
        match &self.iec_type {
            _ if bits == 0 => 0..=1,
            Some(iec_type) if !iec_type.is_signed() => 0..=(1_i64 << bits) - 1,
            _ => -1_i64 << (bits - 1)..=(1_i64 << (bits - 1)) - 1,
        }
    }
}

/// Returns the index of the symbol that a user names.
///
/// In an IEC program case has no meaning, and the size letter X of an address may be absent: `%i0.0` is
/// `%IX0.0`.
#[must_use]
pub fn find_symbol(symbols: &[LadderSymbol], name: &str) -> Option<usize> {
    let exact = symbols.iter().position(|symbol| symbol.name == name);
    exact.or_else(|| {
        let key = iec_key(name);
        symbols.iter().position(|symbol| symbol.iec_type.is_some() && iec_key(&symbol.name) == key)
    })
}

/// A name as IEC 61131-3 compares it.
fn iec_key(name: &str) -> String {
    let upper = name.to_ascii_uppercase();
    match (upper.get(..2), upper.get(2..).and_then(|rest| rest.strip_prefix('X'))) {
        (Some(area @ ("%I" | "%Q" | "%M")), Some(path)) => format!("{area}{path}"),
        _ => upper,
    }
}
