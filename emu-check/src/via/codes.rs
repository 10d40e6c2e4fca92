//! Diagnostic codes of checks of emitted sources.

diag::codes! {
    /// Every code of checks by way of a source, in order of its number.
    CODES;

    NO_TOOL "EC040" "a compiler for the emitted source is not installed"
        "--via compiles the output of --emit with an external compiler on the PATH: native and bytecode with gcc, c with avr-gcc or sdcc, arduino with avr-g++ and Debian's arduino-core-avr. The message gives the missing program and its package.";
    TOOL_FAILED "EC041" "a compiler refuses an emitted source"
        "The output of --emit must compile without a warning. The message gives the first lines of the compiler. This is a fault of the emitter: please report it with the program.";
    NO_FILE "EC042" "a file for a compiler could not be written or read"
        "A check with --via writes the source, the program made of it and its output to a new folder below the temporary folder of the system. The message gives the file and the reason.";
    NO_WAY "EC043" "--via does not support this chip"
        "--via c compiles for ATmega48 to 328 with avr-gcc and for the 8051 family with sdcc, --via bytecode for ATmega48 to 328, --via arduino for the ATmega328P, the chip of the boards. --via native runs on the computer itself, with any chip.";
    STOPPED "EC044" "a program made of an emitted source stopped early"
        "The program should report the state after every scan, but it stopped earlier: it crashed, executed an illegal instruction, or took too long. The message gives the place. This is a fault of the emitter: please report it with the program.";
}
