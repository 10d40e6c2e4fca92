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
        explain: "The file does not exist, is a folder, is not permitted, or is larger than 64 MB. The message gives the \
                  reason that the system gave. Mend: check the path; - stands for standard input." },
    DiagnosticCode { code: UNWRITABLE, title: "a result cannot be written",
        explain: "The folder does not exist, is not permitted, or the disk is full. Results are written to a temporary \
                  file beside their place and then renamed, so an old file there is still whole. Mend: check the path \
                  and the room on the disk." },
    DiagnosticCode { code: UNSUPPORTED_ELEMENT, title: "an element has no meaning in the reference evaluator",
        explain: "The reference evaluator knows the elements listed in docs/semantics.md. A program with any other \
                  element is refused as a whole, because running a part of it would show wrong results. Mend: remove \
                  the element, or read the program in the dialect that it was written for (--dialect)." },
    DiagnosticCode { code: OTHER_CHIP, title: "the image looks like a program for another chip",
        explain: "An ELF file says for which AVR it was linked: its name (avr-gcc 5 and later, or in .mmcu to simavr), its signature, or at least its core. A HEX file may name its chip in a comment, as CCS C writes it, and one that avr-objcopy made may have the signature of an AVR. Another process or package of that \
                  chip (atmega328, atmega328p) and a larger chip with the same registers and vectors fit as well. Else it is a guess of a HEX file, from what it has: data beyond the memories of the chip that was named, the device ID of \
                  another one, a second configuration word, program words of 14 bits and a configuration word where \
                  PIC16 chips have it, or a first instruction as only AVR or the 8051 has it. The message names chips \
                  that can hold the file. It changes nothing by itself. Mend: name the chip that the program was built \
                  for with --mcu." },
    DiagnosticCode { code: COD_MESSAGE, title: "a message of a self-checking program cannot be carried out",
        explain: "The .cod file holds a command or an assertion that names something unknown, or asks for a part that has \
                  no model. docs/formats/cod.md lists what is carried out. Mend: write the message otherwise, or leave \
                  it out and assemble the program again." },
    DiagnosticCode { code: OTHER_PROCESSOR, title: "a .cod file of a program for another chip",
        explain: "A .cod file names the chip that its program was assembled for, and it is not the one that was named with \
                  --mcu. As a file of symbols it is used, with a warning, since names are addresses all the same. With \
                  --cod it is refused: what its messages check holds for its own chip. Mend: name that chip with --mcu, \
                  or assemble the program for the chip on which it is to run." },
    DiagnosticCode { code: OTHER_PROGRAM, title: "symbols that have nothing to do with the image",
        explain: "A warning: no name and no source line of the files given with --symbols or --cod lies in the program \
                  memory that the image fills. Most often they are of another program. Mend: give the files that were \
                  written together with the image." },
    DiagnosticCode { code: MEMORY_SIZE, title: "the content of a memory does not fit into it",
        explain: "A file of --eeprom or --attach holds plain bytes, from address 0 of the memory on, and has more of them than the \
                  memory has cells. A shorter file is taken; the rest is erased. Mend: give the file that was made for this \
                  memory; a file in Intel HEX needs a name that ends in .hex or .eep." },
    DiagnosticCode { code: NO_LINES, title: "there are no source lines",
        explain: "A warning: --source was asked for, and neither the image nor a file of symbols tells which line an instruction \
                  was made of. A HEX file never does, an ELF file only when it was compiled with debugging information and \
                  not stripped. Mend: compile with -g or -gdwarf-4 and give the ELF file; for the \
                  8051 and PIC16 families give the files of symbols with --symbols." },
    DiagnosticCode { code: NOT_IN_HEX, title: "bytes that are not in the HEX file",
        explain: "The source gives bytes for a memory that programmers take from a file of its own: EEPROM, fuses or lock bits of an \
                  AVR, whose HEX file is the flash alone. Mend: `emu asm --eeprom FILE.eep` writes the EEPROM; fuses and lock bits \
                  are given to `emu run` by --fuse and --lock, or by the source itself." },
    DiagnosticCode { code: SOURCE_AS_IMAGE, title: "a source where an image is wanted",
        explain: "A note beside the faults of a file that is no Intel HEX: it looks like assembly source. Sources are assembled on the \
                  fly only where the name ends in .asm, .s, .a51 or .src. Mend: rename the file, or assemble it with `emu asm`." },
    DiagnosticCode { code: INPUT_TABLE, title: "a file of inputs by scan is malformed",
        explain: "A file of `emu sim --inputs` has a head line `scan,NAME,..` and then a line for each scan at which something \
                  changes: its number, rising from 1 on, and a value for every column, or nothing between the commas. Columns of inputs X.. and of analog \
                  inputs count, others are passed over, so that what --csv wrote can be given again. Mend: see the place named." },
    DiagnosticCode { code: SLOWED, title: "a chip is slower than the program's clock",
        explain: "With --mcu all a chip whose highest clock is below CRYSTAL= runs at its highest: the program is checked with the same cycle time and fewer machine cycles in it. Name the chip alone to have it refused, or give --clock for all." },
    DiagnosticCode { code: CAMPAIGN_RECORD, title: "a record of a campaign cannot be used",
        explain: "A file of `emu fuzz --out` is JSON and belongs to one campaign: seed, number of programs, scans and chips. With --resume \
                  it must be the record of the same shard, and --merge takes each shard of one campaign once. Mend: give the \
                  flags with which it was begun, or another file." },
    DiagnosticCode { code: PROTOCOL, title: "what came in is not the Debug Adapter Protocol",
        explain: "`emu dap` reads messages of an editor, each with a head that gives its length. What came in has no such head, a length \
                  that cannot be, or ends in the middle of a message, so that nobody knows where the next one begins. Mend: let the \
                  editor start it, as docs/dap.md shows; nothing is typed by hand." },
    DiagnosticCode { code: NOT_A_MAP, title: "a file is no map of the image",
        explain: "--map takes the JSON that `emu compile PROGRAM.ld --map FILE` writes beside the image: where rungs and symbols of a ladder \
                  program are. It is refused when it is something else, of another version, or for another chip than --mcu. Mend: \
                  compile the program again and give both files." },
    DiagnosticCode { code: NOT_A_TRACE, title: "a file is no trace",
        explain: "`emu diff` compares files that `emu run --trace` wrote. Their first line says so: `emu-trace 1 mcu=.. hz=..`, or the same \
                  as a JSON document. Another number is a version that this emu does not read. Mend: record both again." },
    DiagnosticCode { code: TRACE_LINE, title: "a line of a trace is malformed",
        explain: "Each line of a trace begins with a machine cycle and holds an instruction, an interrupt or the end; in JSON lines each is a \
                  document with `cycle`. The line named is none of these: most often the file was cut off or changed by hand. \
                  docs/trace.md has both shapes. Mend: record it again." },
    DiagnosticCode { code: MALFORMED_WAVE, title: "a waveform is malformed",
        explain: "`emu wave` reads VCD files (IEEE 1364-2005, section 18): a head of declarations that ends with $enddefinitions, then moments \
                  (#100) and changes (1!, b101 !). The line named is none of these, or the file ends within one. Mend: write the \
                  file again with the tool that it comes from, and let that end by itself." },
    DiagnosticCode { code: CONTRADICTORY_WAVE, title: "a waveform contradicts itself",
        explain: "A moment lies before the one in front of it, a signal changes that was not declared, a value has more bits than its \
                  signal, or there is no signal at all. Mend: write the file again with the tool that it comes from." },
    DiagnosticCode { code: TOO_LARGE_WAVE, title: "a waveform is too large to be drawn",
        explain: "Up to 4,000,000 changes of the signals that are drawn are kept, and 100,000 signals. Mend: name fewer signals with \
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
