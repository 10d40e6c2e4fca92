//! Diagnostic codes of the command line itself, with their explanations, and the table of all codes.

use diag::{Diagnostic, DiagnosticCode, Pos, Severity};

diag::codes! {
    /// All codes of the command line, with title and explanation.
    CODES;

    UNREADABLE "CLI001" "a file cannot be read"
        "The file does not exist, is a folder, has no read permission, or is larger than 64 MB. The message gives the \
         reason of the operating system. Fix: check the path. The path - is standard input.";
    UNWRITABLE "CLI002" "a result cannot be written"
        "The folder does not exist, has no write permission, or the disk is full. emu writes results to a temporary \
         file in the same folder and then renames it, so an older file is still complete. Fix: check the path \
         and the free space of the disk.";
    UNSUPPORTED_ELEMENT "CLI003" "an element has no meaning in the reference evaluator"
        "The reference evaluator supports the elements that docs/semantics.md lists. It refuses a program with any other \
         element as a whole, because the results of only a part would be wrong. Fix: remove \
         the element, or read the program in the dialect that it was written for (--dialect).";
    OTHER_CHIP "CLI004" "the image looks like a program for another chip"
        "An ELF file names the AVR for which it was linked: by name (avr-gcc 5 and later, or in .mmcu for simavr), by signature, or \
         at least by core. A HEX file may name its chip in a comment, as CCS C writes it, and a HEX file of avr-objcopy may \
         contain the signature of an AVR. Another process or package of that chip (atmega328, atmega328p) and a larger chip \
         with the same registers and vectors match too. For other HEX files emu guesses from the contents: data beyond the \
         memories of the chosen chip, the device ID of another chip, a second configuration word, program words of 14 bits \
         and a configuration word at the addresses of PIC16 chips, or a first instruction that only AVR or the 8051 \
         has. The message names chips that match the file. The guess has no other effect. Fix: name the chip that the \
         program was built for with --mcu.";
    COD_MESSAGE "CLI005" "a message of a self-checking program cannot be executed"
        "The .cod file contains a command or an assertion with an unknown name, or it needs a part that has \
         no model. docs/formats/cod.md lists the supported ones. Fix: change or remove the message, \
         and assemble the program again.";
    OTHER_PROCESSOR "CLI006" "a .cod file of a program for another chip"
        "A .cod file names the chip that its program was assembled for, and --mcu names another one. \
         As a symbol file it is used with a warning, because names are still addresses. With \
         --cod it is refused, because its messages check properties of its own chip. Fix: name that chip with --mcu, \
         or assemble the program for the chip of --mcu.";
    OTHER_PROGRAM "CLI007" "symbols that do not belong to the image"
        "A warning: no name and no source line of the files given with --symbols or --cod is in the program \
         memory that the image fills. Usually the files belong to another program. Fix: give the files that were \
         written together with the image.";
    MEMORY_SIZE "CLI008" "the contents of a file do not fit into the memory"
        "A file of --eeprom or --attach contains plain bytes, from address 0 of the memory, and has more of them than the \
         memory has cells. A shorter file is accepted, and the rest of the memory is erased. Fix: give the file for this \
         memory. The name of a file in Intel HEX must end in .hex or .eep.";
    NO_LINES "CLI009" "there are no source lines"
        "A warning: --source was given, but neither the image nor a symbol file has the source lines of the \
         instructions. A HEX file never has them. An ELF file has them only if it was compiled with debugging information and \
         not stripped. Fix: compile with -g or -gdwarf-4 and give the ELF file. For the \
         8051 and PIC16 families give the symbol files with --symbols.";
    NOT_IN_HEX "CLI010" "bytes that are not in the HEX file"
        "The source gives bytes for the EEPROM, fuses or lock bits of an AVR. Programmers take these from separate files; \
         the HEX file contains only the flash. Fix: `emu asm --eeprom FILE.eep` writes the EEPROM. For `emu run` give fuses \
         and lock bits with --fuse and --lock, or give it the source itself.";
    SOURCE_AS_IMAGE "CLI011" "a source instead of an image"
        "A note in addition to the errors of a file that is not Intel HEX: it looks like assembly source. emu assembles a source \
         automatically only if its name ends in .asm, .s, .a51 or .src. Fix: rename the file, or assemble it with `emu asm`.";
    INPUT_TABLE "CLI012" "a file of inputs by scan is malformed"
        "A file of `emu sim --inputs` has a first line `scan,NAME,..` and then a line for each scan at which an input \
         changes: its number, increasing from 1, and a value for every column, or nothing between the commas. Columns of \
         inputs X.. and of analog inputs are used. Other columns are ignored, so that the output of --csv is a valid input. \
         Fix: correct the place that the message names.";
    SLOWED "CLI013" "a chip is slower than the program's clock"
        "With --mcu all a chip whose highest clock is below CRYSTAL= runs at its highest clock. The program is checked with the \
         same cycle time, which then has fewer machine cycles. If you name the chip alone, emu refuses it instead. --clock \
         sets one clock for all chips.";
    CAMPAIGN_RECORD "CLI014" "a record of a campaign cannot be used"
        "A file of `emu fuzz --out` is JSON and belongs to one campaign: seed, number of programs, scans and chips. With --resume \
         it must be the record of the same shard. --merge needs each shard of one campaign once. Fix: give the \
         flags with which the campaign began, or another file.";
    NO_MODEL "CLI015" "the chip of MICRO= has no model"
        "The program is drawn for a chip that emu does not have, or MICRO= is no name of LDmicro's list. Fix: --mcu CHIP runs it \
         on another chip, or choose one of `emu chips` in MICRO=.";
    MANIFEST "CLI016" "emu.toml is malformed"
        "emu.toml lists the tests of a project: [[test]] with run, sim or check and the flags of that command as keys, and \
         [run], [sim] and [check] with flags for all of their tests. docs/test.md describes it. Fix: correct the line that \
         the message names.";
    NO_PROGRAM "CLI017" "a scenario has no program"
        "`emu test` found a scenario and no program for it: neither the file that `program` names, in the folder of the \
         scenario, nor a program or image with the name of the scenario. Fix: name the program in the first lines of \
         the scenario, or put it beside the scenario.";
    PROTOCOL "CLI040" "the input is not the Debug Adapter Protocol"
        "`emu dap` reads messages of an editor, each with a header that gives its length. The input has no such header, an \
         impossible length, or ends in the middle of a message, so that the start of the next one is unknown. Fix: start \
         `emu dap` from the editor, as docs/dap.md shows, and not by hand.";
    NOT_A_MAP "TRC001" "a file is not a map of the image"
        "--map takes the JSON that `emu compile PROGRAM.ld --map FILE` writes together with the image. It has the locations of \
         rungs and symbols of a ladder program. emu refuses another kind of file, another version, and a map for another chip \
         than --mcu. Fix: compile the program again and give both files.";
    NOT_A_TRACE "TRC002" "a file is not a trace"
        "`emu diff` compares files that `emu run --trace` wrote. Their first line is `emu-trace 1 mcu=.. hz=..`, or the same \
         as a JSON document. Another number is a version that this emu does not support. Fix: record both again.";
    TRACE_LINE "TRC003" "a line of a trace is malformed"
        "Each line of a trace begins with a machine cycle and contains an instruction, an interrupt or the end. In JSON lines each is a \
         document with `cycle`. The line in the message is none of these. Usually the file was cut off or changed by hand. \
         docs/trace.md describes both formats. Fix: record it again.";
    MALFORMED_WAVE "WAV001" "a waveform is malformed"
        "`emu wave` reads VCD files (IEEE 1364-2005, section 18): declarations up to $enddefinitions, then times \
         (#100) and changes (1!, b101 !). The line in the message is none of these, or the file ends inside one. Fix: write the \
         file again with the tool that made it, and let that tool finish.";
    CONTRADICTORY_WAVE "WAV002" "a waveform contradicts itself"
        "A time is before the previous one, a signal changes that was not declared, a value has more bits than its \
         signal, or there is no signal at all. Fix: write the file again with the tool that made it.";
    TOO_LARGE_WAVE "WAV003" "a waveform is too large to be drawn"
        "The limits are 4,000,000 changes of the drawn signals, and 100,000 signals. Fix: select fewer signals with \
         --only, or record a shorter time.";
    OTHER_LADDER "COV001" "a ladder program that does not belong to the map"
        "The file of --ladder has other elements than the program of --map, so the report would assign code to wrong \
         lines. Nothing was run. Fix: give the program that was compiled, or compile it again.";
    PEER_FAILED "LCK001" "the other simulator of a lockstep run fails"
        "`emu lockstep` started s51, gpsim or simavr. The simulator has ended, or its answers differ from those of the \
         versions in Debian. simavr listens at port 1234, which must be free. Fix: start the simulator by hand with the same \
         image, and read its messages.";
    PEER_LACKS_CHIP "LCK002" "the other simulator of a lockstep run does not have the chip"
        "gpsim and simavr support a list of chips. It has neither the chip of --mcu nor an equal chip with \
         another name. docs/lockstep.md lists the chips of each peer. Fix: choose another chip of the family, if the program \
         uses only what the two have in common, or a version of the simulator that has the chip (--peer FILE).";
    PEER_TIMED_OUT "LCK003" "the other simulator of a lockstep run does not answer in time"
        "An answer of s51, gpsim or simavr did not come within the time of --timeout (default 10 s), and emu ended the \
         simulator. It hangs, its answers differ from those of the versions in Debian, or it is in a sleep from which it \
         never wakes. Fix: give more time, or start the simulator by hand with the same image, and read its messages.";
}

/// Returns every diagnostic code of `emu`, sorted.
pub fn all_codes() -> Vec<&'static DiagnosticCode> {
    let tables = [
        CODES,
        emu_core::image::IMAGE_CODES,
        emu_core::image::OMF_CODES,
        emu_core::image::LINE_CODES,
        emu_core::image::SYMBOL_CODES,
        emu_asm::CODES,
        emu_core::lint::LINT_CODES,
        emu_ap101::config::CONFIG_CODES,
        ladder::CODES,
        ladder::il::IL_CODES,
        ladder::convert::CONVERT_CODES,
        ladder::grid::GRID_CODES,
        ladder_compile::CODES,
        ladder_view::CODES,
        emu_check::via::CODES,
        emu_debug::snapshot::CODES,
        emu_check::CODES,
        emu_check::FOREIGN_CODES,
        scenario::CODES,
    ];
    let mut all: Vec<&DiagnosticCode> = tables.into_iter().flatten().collect();
    all.sort_by_key(|c| c.code);
    all
}

/// Finds the table row of a code.
pub fn find_code(code: &str) -> Option<&'static DiagnosticCode> {
    all_codes().into_iter().find(|c| c.code == code)
}

/// Builds an error about a whole file.
pub fn file_error(code: &'static str, file: &str, cause: String, hint: &str) -> Diagnostic {
    Diagnostic::new(Severity::Error, code, file, Pos::default(), cause, hint)
}

/// Returns the text of a system error without its number.
pub fn system_message(error: &std::io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or_default().to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_in_order_once_and_explained() {
        let all = all_codes();
        let wrong: Vec<&str> = all
            .windows(2)
            .filter(|pair| pair[0].code >= pair[1].code)
            .map(|pair| pair[1].code)
            .chain(all.iter().filter(|code| code.title.is_empty() || code.explain.len() <= 40).map(|code| code.code))
            .collect();
        assert!(all.len() > 200 && wrong.is_empty(), "twice, or without title or explanation: {wrong:?}");
        for table in [emu_asm::CODES, ladder::CODES, ladder::il::IL_CODES, ladder_compile::CODES, emu_check::CODES] {
            assert!(
                table.is_sorted_by(|a, b| a.code < b.code),
                "not in order: {:?}",
                table.first().map(|code| code.code)
            );
        }
    }
}
