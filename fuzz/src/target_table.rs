//! The table of fuzz targets.

use crate::FuzzError;
use crate::seeds::SeedSource::{self, Files, Generated};
use crate::seeds::{self as made};
use crate::targets::{code, debug, image, ladder, machine, text};
use crate::{omf51, text_seeds};

/// A fuzz target.
pub struct FuzzTarget {
    /// Name of the target.
    pub name: &'static str,
    /// What the target checks, in one line.
    pub description: &'static str,
    /// Executes one input.
    pub function: fn(&[u8]),
    /// Sources of the initial inputs.
    pub seeds: &'static [SeedSource],
    /// Words that inputs are likely to need.
    pub dictionary: fn() -> Vec<String>,
    /// Maximum length of an input in bytes.
    pub max_input_bytes: usize,
}

impl FuzzTarget {
    /// Executes an input; a longer one than the target accepts is truncated.
    ///
    /// # Panics
    /// The input is a finding.
    pub fn run(&self, data: &[u8]) {
        (self.function)(data.get(..self.max_input_bytes).unwrap_or(data));
    }
}

/// The target of this name.
///
/// # Errors
/// There is no such target.
pub fn find_target(name: &str) -> Result<&'static FuzzTarget, FuzzError> {
    TARGETS
        .iter()
        .chain(FAULTY_TARGETS)
        .find(|target| target.name == name)
        .ok_or_else(|| FuzzError::UnknownTarget { name: name.to_owned() })
}

const fn target_row(
    name: &'static str,
    function: fn(&[u8]),
    longest: usize,
    seeds: &'static [SeedSource],
    words: fn() -> Vec<String>,
    about: &'static str,
) -> FuzzTarget {
    FuzzTarget { name, description: about, function, seeds, dictionary: words, max_input_bytes: longest }
}

/// Targets that always fail, for tests of the driver.
const FAULTY_TARGETS: &[FuzzTarget] = &[
    target_row("faulty-panic", |_| panic!("on purpose"), 8, &[], made::no_words, "panics"),
    target_row("faulty-hang", loop_forever, 8, &[], made::no_words, "hangs"),
    target_row(
        "faulty-memory",
        |_| drop(std::hint::black_box(vec![1u8; 2 << 30])),
        8,
        &[],
        made::no_words,
        "takes 2 GB",
    ),
];

/// An endless loop.
fn loop_forever(_: &[u8]) {
    let mut number = 0u64;
    while std::hint::black_box(number) < u64::MAX {
        number += 1;
    }
}

/// All targets.
#[rustfmt::skip]
pub const TARGETS: &[FuzzTarget] = &[
    target_row("hex",             image::hex,             4096, &[Files("emu-core/tests/image", ".hex"), Files("examples", ".hex")], made::no_words, "Intel HEX on a chip of each family; what is written is read back"),
    target_row("elf",             image::elf,            65536, &[Files("examples", ".elf"), Files("tests/cli/in", "stabs.elf")], made::no_words, "ELF with symbols, notes, DWARF and stabs"),
    target_row("symbols-sdcc",    image::symbols_sdcc,   16384, &[Files("emu-core/tests/symbols", ".cdb"), Files("emu-core/tests/symbols", ".map"), Files("emu-core/tests/symbols", ".rst"), Files("emu-core/tests/symbols", ".lst")], text_seeds::sdcc, "maps, debugging records and listings of SDCC"),
    target_row("symbols-gputils", image::symbols_gputils, 16384, &[Files("emu-core/tests/gputils", ".cod"), Files("emu-core/tests/gputils", ".map"), Files("emu-core/tests/gputils", ".lst")], made::no_words, "symbol files, maps and listings of gputils"),
    target_row("symbols-keil",    image::symbols_keil,   16384, &[Files("emu-core/tests/keil", ".m51"), Files("emu-core/tests/keil", ".map")], text_seeds::keil, "maps of Keil's linkers; no name has a control character"),
    target_row("omf51",           image::omf51,          16384, &[Generated(omf51::seeds)], made::no_words, "object files of MCS-51, as they are and with right check sums; the same of names"),
    target_row("cod-messages",    image::cod_messages,   16384, &[Files("emu-debug/tests/cod", ".cod")], text_seeds::cod, "the commands that gpsim's programs carry, read and run"),
    target_row("ld",              ladder::ld,            16384, &[Files("examples", ".ld"), Files("emu-check/tests", ".ld"), Files("tests/cli/in", ".ld")], text_seeds::ladder, "ladder programs: read, checked, drawn; what is written is read back"),
    target_row("grid",            ladder::grid,            4096, &[Files("examples", ".grid")], text_seeds::grids, "grids of CSLadder: read, written, read back, executed"),
    target_row("convert",         ladder::convert,         6144, &[Files("examples", ".ld"), Files("emu-check/tests", ".ld")], text_seeds::ladder, "ladder programs converted to Instruction List and back"),
    target_row("compile",         ladder::compile,        6144, &[Files("examples", ".ld"), Files("emu-check/tests", ".ld")], text_seeds::ladder, "ladder programs compiled for a chip of each family and evaluated"),
    target_row("asm-avr",         code::asm_avr,          8192, &[Files("tests/peers/asm", ".s"), Generated(made::cases_avr)], made::asm_avr, "assembler of AVR; the source includes itself"),
    target_row("asm-8051",        code::asm_8051,         8192, &[Files("examples/8051", ".s"), Generated(made::cases_8051)], made::asm_8051, "assembler of the 8051 family"),
    target_row("asm-pic16",       code::asm_pic16,        8192, &[Files("examples/pic16", ".asm"), Generated(made::cases_pic16)], made::asm_pic16, "assembler of the PIC16"),
    target_row("asm-ap101",       code::asm_ap101,        8192, &[Files("examples", ".asm"), Generated(made::cases_ap101)], made::asm_ap101, "assembler of AP101"),
    target_row("disasm-avr",      code::disasm_avr,         64, &[Generated(made::words_avr)], made::no_words, "two words: disassembled, assembled, the same words"),
    target_row("disasm-8051",     code::disasm_8051,        64, &[Generated(made::words_8051)], made::no_words, "the same on the 8051"),
    target_row("disasm-pic16",    code::disasm_pic16,       64, &[Generated(made::words_pic16)], made::no_words, "the same on the PIC16"),
    target_row("disasm-ap101",    code::disasm_ap101,       64, &[Generated(made::words_ap101)], made::no_words, "the same on AP101, where a source can say it"),
    target_row("run-avr",         machine::run_avr,       4096, &[Generated(made::code_avr), Files("examples/avr", ".hex")], made::no_words, "bytes as a program with edges at the pins; one run equals two halves"),
    target_row("run-8051",        machine::run_8051,      4096, &[Generated(made::code_8051)], made::no_words, "the same on the 8051"),
    target_row("run-pic16",       machine::run_pic16,     4096, &[Generated(made::code_pic16)], made::no_words, "the same on the PIC16"),
    target_row("run-ap101",       machine::run_ap101,     4096, &[Generated(made::code_ap101)], made::no_words, "the same on AP101"),
    target_row("snapshot",        machine::snapshot,      8192, &[Generated(made::snapshot_files)], made::no_words, "files of snapshots; what is read is written back"),
    target_row("state-avr",       machine::state_avr,     8192, &[Generated(made::state_avr)], made::no_words, "forged states of an AVR: refused, or saved alike and run on"),
    target_row("state-8051",      machine::state_8051,    8192, &[Generated(made::state_8051)], made::no_words, "the same of an 8051"),
    target_row("state-pic16",     machine::state_pic16,  32768, &[Generated(made::state_pic16)], made::no_words, "the same of a PIC16"),
    target_row("state-ap101",     machine::state_ap101,  32768, &[Generated(made::state_ap101)], made::no_words, "the same of an AP101"),
    target_row("scenario",        text::scenario,         8192, &[Files("examples", ".toml"), Files("tests/cli/in", ".toml")], text_seeds::scenario, "scenarios: read, and their names and times bound to a chip of each family"),
    target_row("record",          text::record,           1024, &[Generated(text_seeds::records)], made::no_words, "what was done, recorded as a scenario, is read back"),
    target_row("vcd",             text::vcd,              8192, &[Files("tests/cli/in", ".vcd"), Generated(text_seeds::waves)], text_seeds::vcd, "waveforms, as a stimulus and as a drawing"),
    target_row("trace",           text::trace,            8192, &[Generated(text_seeds::traces)], text_seeds::trace, "traces of instructions, as text and as JSON"),
    target_row("expression",      text::expression,       1024, &[Generated(text_seeds::expressions)], text_seeds::expressions_words, "expressions, conditions, places, times, stimuli and escapes on a chip of each family"),
    target_row("arguments",       text::arguments,        1024, &[Generated(text_seeds::arguments)], text_seeds::arguments_words, "the command line's own arguments, one a line; nothing is carried out"),
    target_row("repl",            debug::debug_commands,            1024, &[Generated(text_seeds::commands)], text_seeds::commands_words, "lines of the debugger on a chip of each family and on ladder programs"),
    target_row("gdb",             debug::gdb,             4096, &[Generated(text_seeds::packets)], text_seeds::packets_words, "packets of gdb's remote protocol, over a socket"),
    target_row("dap",             debug::dap,             8192, &[Generated(text_seeds::requests)], text_seeds::requests_words, "messages of the Debug Adapter Protocol, one a line"),
    target_row("dap-frames",      debug::dap_frames,      4096, &[Generated(text_seeds::frames)], text_seeds::frames_words, "the frames around those messages"),
];
