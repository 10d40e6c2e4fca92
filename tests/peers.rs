//! Comparisons of the AVR with external tools: simavr, and the GNU assembler, disassembler and compiler.
//!
//! A plain `cargo test` ignores them; `.ci/peers` installs the peers and runs them. Random tests take their
//! seed from the variable EMU_SEED and print it.

use std::path::PathBuf;
use std::sync::OnceLock;

#[path = "peers/avrfacts/table.rs"]
mod avrfacts;
#[path = "peers/binutils.rs"]
mod binutils;
#[path = "peers/lockstep.rs"]
mod lockstep;
#[path = "../emu-avr/tests/isa/states.rs"]
mod states;
#[path = "peers/tools.rs"]
mod tools;
#[path = "peers/uart.rs"]
mod uart;

use emu_test_support::{run_tool, test_folder};
use tools::source;

/// Returns the path of a program that wraps simavr's library. The first test that needs one builds them all.
fn harness(name: &str) -> PathBuf {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    let built = BUILT.get_or_init(|| {
        let out = test_folder!("peers");
        run_tool(source("tests/peers/build.sh"), &[&out.to_string_lossy()], &out);
        out
    });
    built.join(name)
}
