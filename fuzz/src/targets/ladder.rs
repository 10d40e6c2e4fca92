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

/// Reads grids; written and read again, they must give the same text and paths. Converts them to LDmicro.
pub(crate) fn grid(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let Ok(ladder::grid::ParsedGridProgram { program: grids, .. }) = ladder::grid::read("fuzz.grid", &text) else {
        return;
    };
    let written = ladder::grid::write(&grids);
    let again = ladder::grid::read("fuzz.grid", &written).ok();
    assert_eq!(
        again.map(|again| ladder::grid::write(&again.program)).as_ref(),
        Some(&written),
        "it comes back as it was written"
    );
    let settings = ladder::il::il_settings(ladder::IL_CYCLE_US);
    let resolved = ladder::il::to_ladder(&ladder::grid::to_instruction_list(&grids), settings);
    let program = resolved.expect("sound grids are sound instructions").program;
    _ = ladder::convert::to_ldmicro(&program);
    if let Ok(mut evaluator) = Evaluator::new(&program) {
        (0..SCANS).for_each(|_| evaluator.scan());
    }
}

/// Converts a program of LDmicro to Instruction List and back.
pub(crate) fn convert(data: &[u8]) {
    let Some(program) = read(data).filter(|program| !check(program).iter().any(|fault| fault.is_error())) else {
        return;
    };
    let Ok(converted) = ladder::convert::to_instruction_list(&program) else { return };
    let cycle_us = program.settings.cycle_us;
    let resolved = ladder::il::to_ladder(&converted.program, ladder::il::il_settings(cycle_us));
    if let Ok(resolved) = resolved {
        _ = ladder::convert::to_ldmicro(&resolved.program);
    }
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
