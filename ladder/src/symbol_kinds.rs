//! Symbols of a program, and their kinds.

use serde::Serialize;

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
    /// counts (the largest, if several elements share the name); all other integers have 2.
    pub bytes: u8,
}
