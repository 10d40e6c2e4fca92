//! The table of targets.

use crate::seeds::Seeds::{self, Files, Made};
use crate::seeds::{self as made};
use crate::targets::{code, debug, image, ladder, machine, text};
use crate::{omf51, texts};

/// A target.
pub struct Target {
    /// Its name.
    pub name: &'static str,
    /// What it checks, in a line.
    pub about: &'static str,
    /// Executes one input.
    pub function: fn(&[u8]),
    /// Inputs to begin with.
    pub seeds: &'static [Seeds],
    /// Words that inputs are likely to need.
    pub words: fn() -> Vec<String>,
    /// Longest input, in bytes.
    pub longest: usize,
}

impl Target {
    /// Executes an input; of a longer one than the target takes, its beginning.
    ///
    /// # Panics
    /// The input is a finding.
    pub fn run(&self, data: &[u8]) {
        (self.function)(data.get(..self.longest).unwrap_or(data));
    }
}

/// The target of that name.
///
/// # Errors
/// There is none: a sentence.
pub fn target(name: &str) -> Result<&'static Target, String> {
    TARGETS.iter().chain(FAULTY).find(|target| target.name == name).ok_or_else(|| {
        let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
        format!("there is no target `{name}`; targets are {}", names.join(", "))
    })
}

const fn row(
    name: &'static str,
    function: fn(&[u8]),
    longest: usize,
    seeds: &'static [Seeds],
    words: fn() -> Vec<String>,
    about: &'static str,
) -> Target {
    Target { name, about, function, seeds, words, longest }
}

/// Targets that are findings whatever the input is: on them the tests try whether the driver sees what it is to see.
const FAULTY: &[Target] = &[
    row("faulty-panic", |_| panic!("on purpose"), 8, &[], made::no_words, "panics"),
    row("faulty-hang", endless, 8, &[], made::no_words, "hangs"),
    row("faulty-memory", |_| drop(std::hint::black_box(vec![1u8; 2 << 30])), 8, &[], made::no_words, "takes 2 GB"),
];

/// Computes without an end.
fn endless(_: &[u8]) {
    let mut number = 0u64;
    while std::hint::black_box(number) < u64::MAX {
        number += 1;
    }
}

/// All targets.
#[rustfmt::skip]
pub const TARGETS: &[Target] = &[
    row("hex",             image::hex,             4096, &[Files("emu-core/tests/image", ".hex"), Files("examples", ".hex")], made::no_words, "Intel HEX on a chip of each family; what is written is read back"),
    row("elf",             image::elf,            65536, &[Files("examples", ".elf")], made::no_words, "ELF with symbols, notes and DWARF lines"),
    row("symbols-sdcc",    image::symbols_sdcc,   16384, &[Files("emu-core/tests/symbols", ".cdb"), Files("emu-core/tests/symbols", ".map"), Files("emu-core/tests/symbols", ".rst"), Files("emu-core/tests/symbols", ".lst")], texts::sdcc, "maps, debugging records and listings of SDCC"),
    row("symbols-gputils", image::symbols_gputils, 16384, &[Files("emu-core/tests/gputils", ".cod"), Files("emu-core/tests/gputils", ".map"), Files("emu-core/tests/gputils", ".lst")], made::no_words, "symbol files, maps and listings of gputils"),
    row("symbols-keil",    image::symbols_keil,   16384, &[Files("emu-core/tests/keil", ".m51"), Files("emu-core/tests/keil", ".map")], texts::keil, "maps of Keil's linkers; no name has a control character"),
    row("omf51",           image::omf51,          16384, &[Made(omf51::seeds)], made::no_words, "object files of MCS-51, as they are and with right check sums; the same of names"),
    row("cod-messages",    image::cod_messages,   16384, &[Files("emu-debug/tests/cod", ".cod")], texts::cod, "the commands that gpsim's programs carry, read and run"),
    row("ld",              ladder::ld,            16384, &[Files("examples", ".ld"), Files("emu-check/tests", ".ld"), Files("tests/cli/in", ".ld")], texts::ladder, "ladder programs: read, checked, drawn; what is written is read back"),
    row("compile",         ladder::compile,        6144, &[Files("examples", ".ld"), Files("emu-check/tests", ".ld")], texts::ladder, "ladder programs compiled for a chip of each family and evaluated"),
    row("asm-avr",         code::asm_avr,          8192, &[Files("tests/peers/asm", ".s"), Made(made::cases_avr)], made::asm_avr, "assembler of AVR; the source includes itself"),
    row("asm-8051",        code::asm_8051,         8192, &[Files("examples/8051", ".s"), Made(made::cases_8051)], made::asm_8051, "assembler of the 8051 family"),
    row("asm-pic16",       code::asm_pic16,        8192, &[Files("examples/pic16", ".asm"), Made(made::cases_pic16)], made::asm_pic16, "assembler of the PIC16"),
    row("asm-ap101",       code::asm_ap101,        8192, &[Files("examples", ".asm"), Made(made::cases_ap101)], made::asm_ap101, "assembler of AP101"),
    row("disasm-avr",      code::disasm_avr,         64, &[Made(made::words_avr)], made::no_words, "two words: disassembled, assembled, the same words"),
    row("disasm-8051",     code::disasm_8051,        64, &[Made(made::words_8051)], made::no_words, "the same on the 8051"),
    row("disasm-pic16",    code::disasm_pic16,       64, &[Made(made::words_pic16)], made::no_words, "the same on the PIC16"),
    row("disasm-ap101",    code::disasm_ap101,       64, &[Made(made::words_ap101)], made::no_words, "the same on AP101, where a source can say it"),
    row("run-avr",         machine::run_avr,       4096, &[Made(made::code_avr), Files("examples/avr", ".hex")], made::no_words, "bytes as a program with edges at the pins; one run equals two halves"),
    row("run-8051",        machine::run_8051,      4096, &[Made(made::code_8051)], made::no_words, "the same on the 8051"),
    row("run-pic16",       machine::run_pic16,     4096, &[Made(made::code_pic16)], made::no_words, "the same on the PIC16"),
    row("run-ap101",       machine::run_ap101,     4096, &[Made(made::code_ap101)], made::no_words, "the same on AP101"),
    row("snapshot",        machine::snapshot,      8192, &[Made(made::snapshots)], made::no_words, "files of snapshots; what is read is written back"),
    row("state-avr",       machine::state_avr,     8192, &[Made(made::state_avr)], made::no_words, "forged states of an AVR: refused, or saved alike and run on"),
    row("state-8051",      machine::state_8051,    8192, &[Made(made::state_8051)], made::no_words, "the same of an 8051"),
    row("state-pic16",     machine::state_pic16,  32768, &[Made(made::state_pic16)], made::no_words, "the same of a PIC16"),
    row("state-ap101",     machine::state_ap101,  32768, &[Made(made::state_ap101)], made::no_words, "the same of an AP101"),
    row("scenario",        text::scenario,         8192, &[Files("examples", ".toml"), Files("tests/cli/in", ".toml")], texts::scenario, "scenarios: read, and their names and times bound to a chip of each family"),
    row("record",          text::record,           1024, &[Made(texts::records)], made::no_words, "what was done, recorded as a scenario, is read back"),
    row("vcd",             text::vcd,              8192, &[Files("tests/cli/in", ".vcd"), Made(texts::waves)], texts::vcd, "waveforms, as a stimulus and as a drawing"),
    row("trace",           text::trace,            8192, &[Made(texts::traces)], texts::trace, "traces of instructions, as text and as JSON"),
    row("expression",      text::expression,       1024, &[Made(texts::expressions)], texts::expressions_words, "expressions, conditions, places, times, stimuli and escapes on a chip of each family"),
    row("arguments",       text::arguments,        1024, &[Made(texts::arguments)], texts::arguments_words, "the command line's own arguments, one a line; nothing is carried out"),
    row("repl",            debug::repl,            1024, &[Made(texts::commands)], texts::commands_words, "lines of the debugger on a chip of each family and on ladder programs"),
    row("gdb",             debug::gdb,             4096, &[Made(texts::packets)], texts::packets_words, "packets of gdb's remote protocol, over a socket"),
    row("dap",             debug::dap,             8192, &[Made(texts::requests)], texts::requests_words, "messages of the Debug Adapter Protocol, one a line"),
    row("dap-frames",      debug::dap_frames,      4096, &[Made(texts::frames)], texts::frames_words, "the frames around those messages"),
];
