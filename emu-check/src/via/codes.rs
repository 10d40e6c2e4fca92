//! Diagnostic codes of checks of emitted sources. Each row has a name, a code, a title and the text of `emu
//! explain`.

use diag::DiagnosticCode;

macro_rules! codes {
    ($($name:ident $code:literal $title:literal $explain:literal;)*) => {
        $(pub(crate) const $name: &str = $code;)*
        /// Every code of checks by way of a source, in order of its number.
        pub const CODES: &[DiagnosticCode] = &[$(DiagnosticCode { code: $code, title: $title, explain: $explain }),*];
    };
}

codes! {
    NO_TOOL "EC040" "a compiler for the emitted source is not installed"
        "--via compiles what --emit writes with a compiler from outside, found on the PATH: native and bytecode with gcc, c with avr-gcc or sdcc, arduino with avr-g++ and Debian's arduino-core-avr. The message names what was looked for and the package that has it.";
    TOOL_FAILED "EC041" "a compiler refuses an emitted source"
        "What --emit writes must compile without a warning. The message gives the compiler's first words. The fault is the emitter's: please report it with the program.";
    NO_FILE "EC042" "a file for a compiler could not be written or read"
        "Checks by way of a source put the source, the program made of it and what that tells into a folder of their own below the system's folder for temporary files. The message says which file failed and why.";
    NO_WAY "EC043" "there is no such way to this chip"
        "--via c compiles for ATmega48 to 328 with avr-gcc and for the 8051 family with sdcc, --via bytecode for the former, --via arduino for the ATmega328P, the chip of the boards. --via native runs on the computer itself, whatever chip is named.";
    STOPPED "EC044" "a program made of an emitted source stopped early"
        "The program was to tell the state after every scan and told less: it crashed, ran into no instruction, or took too long. The message says where it stopped. The fault is the emitter's: please report it with the program.";
}
