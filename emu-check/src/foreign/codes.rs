//! Diagnostic codes of checks of foreign images.

diag::codes! {
    /// Codes of foreign images, in order of their numbers.
    FOREIGN_CODES;

    NO_PACE "EC050" "no pacing is found in the image"
        "The check watches the flags of the timers to find the start of each scan: a flag that the program polls and clears once every CYCLE. The image clears no flag with that period (within 10 %), does not poll it more than once before it is set, or the apparent start of a scan does not occur once for each time that the flag is cleared. The message gives the figures. The image may be for another chip or clock, may not be a ladder program, may count several matches of a timer for one scan, or may leave no time to wait.";
    NO_PIN "EC051" "the pin of a symbol is not known"
        "The check compares outputs of a foreign image at pins, so each input, output and analog input needs one: from the IO LIST of the program (for the chip of MICRO=), from --pin, or from the map.";
    NO_FOREIGN "EC052" "no checks of foreign images on this chip"
        "emu checks foreign images on AVR, 8051 and PIC16. An AP101 has its own pacing, and its programs come from only one compiler.";
    FINDING_PERIOD "EC053" "the scans of the image have another period than CYCLE"
        "The check measured the starts of all scans of the longest run. Their mean differs from CYCLE by more than the timer's tick and the waiting loop explain, so all times of the program are wrong by that ratio.";
    FINDING_PULL_UP "EC054" "an input has no pull-up"
        "Inputs of a ladder program have the pull-up of the chip on, if it has one. This one floats when nothing drives it.";
    FINDING_GLITCH "EC055" "an output goes high before the first scan"
        "From reset to the end of the first scan outputs are low. This output went high during the initialization of the program, which can operate a valve or a motor for a moment.";
    FINDING_EARLY_BYTE "EC056" "a byte is sent without cause"
        "The image sends on the serial line although no element has had a true rung since power-up.";
    NO_MAP "EC057" "a file is not a map"
        "The map of an image is JSON in the format of `emu compile --map` (docs/compile.md). With a map the check also compares the symbols inside a foreign image, without it only the pins.";
}
