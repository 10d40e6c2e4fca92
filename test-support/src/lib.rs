//! What the tests of several crates share.
//!
//! ```text
//!   text_cases.rs     tables of cases, one per line
//!   expected_file.rs  files that a test compares, and writes if EMU_BLESS is set
//!   slices.rs         a run may be cut anywhere without a change of its result
//!   cut_tests.rs      a state may be saved and restored anywhere
//!   peers.rs          programs of other projects: folders, exit codes, seeds
//! ```
//!
//! Crates use it as a dev-dependency.

#![forbid(unsafe_code)]

pub mod cut_tests;
pub mod expected_file;
pub mod peers;
pub mod slices;
pub mod text_cases;

pub use expected_file::assert_file;
pub use peers::{random_seed, run_tool, tool_text};
pub use text_cases::case_lines;
