//! Diagnostic codes of the command line itself, with their explanations.

use diag::{Diagnostic, DiagnosticCode, Pos, Severity};

/// A file cannot be read.
pub const UNREADABLE: &str = "CLI001";
/// A file cannot be written.
pub const UNWRITABLE: &str = "CLI002";
/// An element has no meaning in the evaluator.
pub const UNSUPPORTED_ELEMENT: &str = "CLI003";
/// The image looks like a program for another chip.
pub const OTHER_CHIP: &str = "CLI004";
/// A message of a self-checking program cannot be carried out.
pub const COD_MESSAGE: &str = "CLI005";

/// Symbols or messages belong to a program for another chip.
pub const OTHER_PROCESSOR: &str = "CLI006";
/// Symbols belong to another program.
pub const OTHER_PROGRAM: &str = "CLI007";

/// The contents of a file do not fit into the memory.
pub const MEMORY_SIZE: &str = "CLI008";

/// Source lines are requested but not available.
pub const NO_LINES: &str = "CLI009";

/// A source gives bytes that its HEX file does not hold.
pub const NOT_IN_HEX: &str = "CLI010";

/// A source is given where an image is expected.
pub const SOURCE_AS_IMAGE: &str = "CLI011";

/// A table of inputs by scan is malformed.
pub const INPUT_TABLE: &str = "CLI012";

/// A chip is checked at its highest clock, which is below the clock of the program.
pub const SLOWED: &str = "CLI013";

/// A record of a fuzz campaign cannot be used.
pub const CAMPAIGN_RECORD: &str = "CLI014";

/// The messages of an editor do not follow the Debug Adapter Protocol.
pub const PROTOCOL: &str = "CLI040";
/// A file is not a map of the image.
pub const NOT_A_MAP: &str = "TRC001";

/// A file is not a trace.
pub const NOT_A_TRACE: &str = "TRC002";

/// A line of a trace is malformed.
pub const TRACE_LINE: &str = "TRC003";

/// A waveform is malformed.
pub const MALFORMED_WAVE: &str = "WAV001";

/// A waveform contradicts itself.
pub const CONTRADICTORY_WAVE: &str = "WAV002";

/// A waveform is too large to be drawn.
pub const TOO_LARGE_WAVE: &str = "WAV003";

/// All codes of the command line, with title and explanation.
#[rustfmt::skip]
pub const CODES: &[DiagnosticCode] = &[
    DiagnosticCode { code: UNREADABLE, title: "a file cannot be read",
        explain: "The file does not exist, is a folder, has no read permission, or is larger than 64 MB. The message gives the \
                  reason of the operating system. Fix: check the path. The path - is standard input." },
    DiagnosticCode { code: UNWRITABLE, title: "a result cannot be written",
        explain: "The folder does not exist, has no write permission, or the disk is full. emu writes results to a temporary \
                  file in the same folder and then renames it, so an older file is still complete. Fix: check the path \
                  and the free space of the disk." },
    DiagnosticCode { code: UNSUPPORTED_ELEMENT, title: "an element has no meaning in the reference evaluator",
        explain: "The reference evaluator supports the elements that docs/semantics.md lists. It refuses a program with any other \
                  element as a whole, because the results of only a part would be wrong. Fix: remove \
                  the element, or read the program in the dialect that it was written for (--dialect)." },
    DiagnosticCode { code: OTHER_CHIP, title: "the image looks like a program for another chip",
        explain: "An ELF file names the AVR for which it was linked: by name (avr-gcc 5 and later, or in .mmcu for simavr), by signature, or \
                  at least by core. A HEX file may name its chip in a comment, as CCS C writes it, and a HEX file of avr-objcopy may \
                  contain the signature of an AVR. Another process or package of that chip (atmega328, atmega328p) and a larger chip \
                  with the same registers and vectors match too. For other HEX files emu guesses from the contents: data beyond the \
                  memories of the chosen chip, the device ID of another chip, a second configuration word, program words of 14 bits \
                  and a configuration word at the addresses of PIC16 chips, or a first instruction that only AVR or the 8051 \
                  has. The message names chips that match the file. The guess has no other effect. Fix: name the chip that the \
                  program was built for with --mcu." },
    DiagnosticCode { code: COD_MESSAGE, title: "a message of a self-checking program cannot be executed",
        explain: "The .cod file contains a command or an assertion with an unknown name, or it needs a part that has \
                  no model. docs/formats/cod.md lists the supported ones. Fix: change or remove the message, \
                  and assemble the program again." },
    DiagnosticCode { code: OTHER_PROCESSOR, title: "a .cod file of a program for another chip",
        explain: "A .cod file names the chip that its program was assembled for, and --mcu names another one. \
                  As a symbol file it is used with a warning, because names are still addresses. With \
                  --cod it is refused, because its messages check properties of its own chip. Fix: name that chip with --mcu, \
                  or assemble the program for the chip of --mcu." },
    DiagnosticCode { code: OTHER_PROGRAM, title: "symbols that do not belong to the image",
        explain: "A warning: no name and no source line of the files given with --symbols or --cod is in the program \
                  memory that the image fills. Usually the files belong to another program. Fix: give the files that were \
                  written together with the image." },
    DiagnosticCode { code: MEMORY_SIZE, title: "the contents of a file do not fit into the memory",
        explain: "A file of --eeprom or --attach contains plain bytes, from address 0 of the memory, and has more of them than the \
                  memory has cells. A shorter file is accepted, and the rest of the memory is erased. Fix: give the file for this \
                  memory. The name of a file in Intel HEX must end in .hex or .eep." },
    DiagnosticCode { code: NO_LINES, title: "there are no source lines",
        explain: "A warning: --source was given, but neither the image nor a symbol file has the source lines of the \
                  instructions. A HEX file never has them. An ELF file has them only if it was compiled with debugging information and \
                  not stripped. Fix: compile with -g or -gdwarf-4 and give the ELF file. For the \
                  8051 and PIC16 families give the symbol files with --symbols." },
    DiagnosticCode { code: NOT_IN_HEX, title: "bytes that are not in the HEX file",
        explain: "The source gives bytes for the EEPROM, fuses or lock bits of an AVR. Programmers take these from separate files; \
                  the HEX file contains only the flash. Fix: `emu asm --eeprom FILE.eep` writes the EEPROM. For `emu run` give fuses \
                  and lock bits with --fuse and --lock, or give it the source itself." },
    DiagnosticCode { code: SOURCE_AS_IMAGE, title: "a source instead of an image",
        explain: "A note in addition to the errors of a file that is not Intel HEX: it looks like assembly source. emu assembles a source \
                  automatically only if its name ends in .asm, .s, .a51 or .src. Fix: rename the file, or assemble it with `emu asm`." },
    DiagnosticCode { code: INPUT_TABLE, title: "a file of inputs by scan is malformed",
        explain: "A file of `emu sim --inputs` has a first line `scan,NAME,..` and then a line for each scan at which an input \
                  changes: its number, increasing from 1, and a value for every column, or nothing between the commas. Columns of \
                  inputs X.. and of analog inputs are used. Other columns are ignored, so that the output of --csv is a valid input. \
                  Fix: correct the place that the message names." },
    DiagnosticCode { code: SLOWED, title: "a chip is slower than the program's clock",
        explain: "With --mcu all a chip whose highest clock is below CRYSTAL= runs at its highest clock. The program is checked with the \
                  same cycle time, which then has fewer machine cycles. If you name the chip alone, emu refuses it instead. --clock \
                  sets one clock for all chips." },
    DiagnosticCode { code: CAMPAIGN_RECORD, title: "a record of a campaign cannot be used",
        explain: "A file of `emu fuzz --out` is JSON and belongs to one campaign: seed, number of programs, scans and chips. With --resume \
                  it must be the record of the same shard. --merge needs each shard of one campaign once. Fix: give the \
                  flags with which the campaign began, or another file." },
    DiagnosticCode { code: PROTOCOL, title: "the input is not the Debug Adapter Protocol",
        explain: "`emu dap` reads messages of an editor, each with a header that gives its length. The input has no such header, an \
                  impossible length, or ends in the middle of a message, so that the start of the next one is unknown. Fix: start \
                  `emu dap` from the editor, as docs/dap.md shows, and not by hand." },
    DiagnosticCode { code: NOT_A_MAP, title: "a file is not a map of the image",
        explain: "--map takes the JSON that `emu compile PROGRAM.ld --map FILE` writes together with the image. It has the locations of \
                  rungs and symbols of a ladder program. emu refuses another kind of file, another version, and a map for another chip \
                  than --mcu. Fix: compile the program again and give both files." },
    DiagnosticCode { code: NOT_A_TRACE, title: "a file is not a trace",
        explain: "`emu diff` compares files that `emu run --trace` wrote. Their first line is `emu-trace 1 mcu=.. hz=..`, or the same \
                  as a JSON document. Another number is a version that this emu does not support. Fix: record both again." },
    DiagnosticCode { code: TRACE_LINE, title: "a line of a trace is malformed",
        explain: "Each line of a trace begins with a machine cycle and contains an instruction, an interrupt or the end. In JSON lines each is a \
                  document with `cycle`. The line in the message is none of these. Usually the file was cut off or changed by hand. \
                  docs/trace.md describes both formats. Fix: record it again." },
    DiagnosticCode { code: MALFORMED_WAVE, title: "a waveform is malformed",
        explain: "`emu wave` reads VCD files (IEEE 1364-2005, section 18): declarations up to $enddefinitions, then times \
                  (#100) and changes (1!, b101 !). The line in the message is none of these, or the file ends inside one. Fix: write the \
                  file again with the tool that made it, and let that tool finish." },
    DiagnosticCode { code: CONTRADICTORY_WAVE, title: "a waveform contradicts itself",
        explain: "A time is before the previous one, a signal changes that was not declared, a value has more bits than its \
                  signal, or there is no signal at all. Fix: write the file again with the tool that made it." },
    DiagnosticCode { code: TOO_LARGE_WAVE, title: "a waveform is too large to be drawn",
        explain: "The limits are 4,000,000 changes of the drawn signals, and 100,000 signals. Fix: select fewer signals with \
                  --only, or record a shorter time." },
];

/// Builds an error about a whole file.
pub fn file_error(code: &'static str, file: &str, cause: String, hint: &str) -> Diagnostic {
    Diagnostic::new(Severity::Error, code, file, Pos::default(), cause, hint)
}

/// Returns the text of a system error without its number.
pub fn system_message(error: &std::io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or_default().to_lowercase()
}
