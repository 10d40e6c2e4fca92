//! Targets of ladder programs.

use emu_core::image::load_hex;
use ladder::{LadderProgram, ParseOptions, check, draw, parse_bytes, write};
use ladder_compile::compile as compiled;
use ladder_eval::Evaluator;

use crate::machines::family_chips;

/// Number of scans of the evaluator.
const SCANS: usize = 20;

fn read(data: &[u8]) -> Option<LadderProgram> {
    parse_bytes("fuzz.ld", data, ParseOptions::default()).ok().map(|parsed| parsed.program)
}

/// Reads a program; written and read again, it must give the same text.
pub(crate) fn ld(data: &[u8]) {
    let Some(program) = read(data) else { return };
    _ = check(&program);
    _ = draw(&program);
    let text = write(&program);
    let again = read(text.as_bytes());
    assert_eq!(again.as_ref().map(write).as_deref(), Some(text.as_str()), "it comes back as it was written");
}

/// Evaluates a program without faults, and compiles it for a chip of each family.
pub(crate) fn compile(data: &[u8]) {
    let Some(program) = read(data) else { return };
    if check(&program).iter().any(|fault| fault.is_error()) {
        return;
    }
    if let Ok(mut evaluator) = Evaluator::new(&program) {
        (0..SCANS).for_each(|_| evaluator.scan());
    }
    for chip in family_chips() {
        let options =
            ladder_compile::CompileOptions { mcu: chip.name.to_owned(), ..ladder_compile::CompileOptions::default() };
        match compiled(&program, &options) {
            Ok(done) => assert!(load_hex("fuzz.hex", done.hex.as_bytes(), chip.hex_spaces).is_ok(), "{}", chip.name),
            Err(faults) => assert!(faults.iter().any(|fault| fault.is_error()), "{}: refused for a reason", chip.name),
        }
    }
}
