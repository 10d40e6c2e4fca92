//! The listing: address, words, line and source, then the names.

use std::fmt::{self, Write};

use diag::text::{into_printable, to_display_text};

use crate::files::SourceTexts;
use crate::output::ListedLine;
use crate::symbols::AsmSymbolKind;

/// A listing, formatted on demand.
#[derive(Debug, Clone, Default)]
pub struct AsmListing {
    /// The lines of the sources with what they emitted, in the order of assembly.
    pub(crate) rows: Vec<ListingRow>,
    /// The symbols for the end of the listing.
    pub(crate) symbols: Vec<(String, i64, String)>,
    /// The number of hexadecimal digits of an address.
    pub(crate) digits: usize,
}

/// A line of the listing.
#[derive(Debug, Clone)]
pub(crate) struct ListingRow {
    pub addr: i64,
    pub words: Vec<u16>,
    pub value: Option<i64>,
    pub number: u32,
    pub text: String,
    pub depth: u32,
    pub wide: bool,
}

impl ListingRow {
    /// Returns the row of a line and its bytes. A line of a file is listed as it is in the file, a macro line
    /// with its arguments substituted.
    pub(crate) fn of(listed: &ListedLine, bytes: &[u8], texts: &SourceTexts) -> ListingRow {
        let line = &listed.line;
        let written = if listed.depth == 0 { texts.line(line.file, line.number) } else { &line.text };
        let bytes = bytes.get(listed.bytes.clone()).unwrap_or_default();
        let size = listed.unit.clamp(1, 2) as usize;
        let words = bytes.chunks(size).map(|word| word.iter().rev().fold(0, |high, &low| high << 8 | u16::from(low)));
        ListingRow {
            addr: listed.addr,
            words: words.collect(),
            value: listed.value,
            number: listed.line.number,
            text: into_printable(to_display_text(written.trim_end()).into_owned()),
            depth: listed.depth,
            wide: size == 2,
        }
    }
}

/// Words in a row of the listing.
const WORDS_PER_ROW: usize = 4;
const BYTES_PER_ROW: usize = 6;

impl fmt::Display for AsmListing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = BYTES_PER_ROW * 3;
        // The text after the last line end is not a line, and lines that a dialect adds at the end have the
        // number of an earlier line.
        let mut rows = &self.rows[..];
        while let [above @ .., before, last] = rows
            && last.words.is_empty()
            && (last.text.is_empty() || last.number < before.number)
        {
            rows = &rows[..=above.len()];
        }
        for row in rows {
            let (per, digits) = if row.wide { (WORDS_PER_ROW, 4) } else { (BYTES_PER_ROW, 2) };
            let mut chunks = row.words.chunks(per);
            let words = |chunk: &[u16]| {
                let mut out = String::new();
                chunk.iter().for_each(|word| {
                    let _ = write!(out, "{word:0digits$X} ");
                });
                out
            };
            let first = words(chunks.next().unwrap_or_default());
            let place = match (row.value, row.words.is_empty()) {
                (_, false) => format!("{:0d$X}  {first:<width$}", row.addr, d = self.digits),
                (Some(value), _) => format!("{:d$}= {:<width$}", "", format!("{:04X}", value as u32), d = self.digits),
                _ => format!("{:d$}  {:width$}", "", "", d = self.digits),
            };
            let mark = "+".repeat(row.depth.min(3) as usize);
            writeln!(f, "{place} {:>5}{mark:<2}{}", row.number, row.text.trim_end()).map(|()| ())?;
            let mut addr = row.addr + per as i64;
            for chunk in chunks {
                writeln!(f, "{:0d$X}  {}", addr, words(chunk).trim_end(), d = self.digits)?;
                addr += per as i64;
            }
        }
        if !self.symbols.is_empty() {
            writeln!(f, "\nSymbols")?;
        }
        for (name, value, kind) in &self.symbols {
            writeln!(f, "{name:<24} {:04X}  {kind}", *value as u32)?;
        }
        Ok(())
    }
}

/// Returns the kind of a symbol for the listing.
pub(crate) fn kind_name(kind: &AsmSymbolKind) -> String {
    match kind {
        AsmSymbolKind::Label { space, .. } => (*space).to_owned(),
        AsmSymbolKind::Equ => "equ".to_owned(),
        AsmSymbolKind::Set => "set".to_owned(),
        AsmSymbolKind::Alias { of: register, .. } => format!("register {register}"),
    }
}
