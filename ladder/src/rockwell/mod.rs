//! Ladder of Allen-Bradley as neutral text (`XIC(a)[XIC(b),XIO(c)]OTE(d);`, `BST XIC a NXB XIC b BND OTE c`),
//! and the exports of RSLogix 5000 and Studio 5000 that have it (L5X).

mod export;
mod lower;
mod outputs;
mod tags;
mod text;

pub(crate) use export::read;
pub(crate) use text::is_neutral_text;
