//! Diagnostic codes of checks of foreign images.

use diag::DiagnosticCode;

macro_rules! codes {
    ($($name:ident $code:literal $title:literal $explain:literal;)*) => {
        $(pub(crate) const $name: &str = $code;)*
        /// Codes of foreign images, in order of their numbers.
        pub const FOREIGN_CODES: &[DiagnosticCode] = &[$(DiagnosticCode { code: $code, title: $title, explain: $explain }),*];
    };
}

codes! {
    NO_PACE "EC050" "no pacing is found in the image"
        "The check finds where scans begin by watching the flags of the timers: a flag that the program polls and clears once every CYCLE. The image clears none with that period (to a tenth), does not poll it more than once before it is set, or what seems to be the start of a scan does not come once for each time that the flag is cleared; the message gives the figures. The image may be for another chip or clock, be no ladder program, count several matches of a timer for one scan, or leave no time to wait.";
    NO_PIN "EC051" "the pin of a symbol is not known"
        "Outputs of a foreign image are compared at pins, so each input, output and analog input needs one: from the IO LIST of the program (for the chip that MICRO= names), by --pin, or from the map.";
    NO_FOREIGN "EC052" "images of others are not checked on this chip"
        "Foreign images are checked on AVR, 8051 and PIC16. An AP101 paces itself and its programs come from one compiler only.";
    FINDING_PERIOD "EC053" "the scans of the image have another period than CYCLE"
        "The starts of all scans of the longest run were timed. Their mean differs from CYCLE by more than the timer's tick and the waiting loop explain, so all times of the program are off by that share.";
    FINDING_PULL_UP "EC054" "an input has no pull-up"
        "Inputs of a ladder program have the chip's pull-up on, where it has one. This one floats when nothing drives it.";
    FINDING_GLITCH "EC055" "an output goes high before the first scan"
        "From reset to the end of the first scan outputs are low. This one went high while the program set itself up, which a valve or a motor may notice.";
    FINDING_EARLY_BYTE "EC056" "a byte is sent that nothing asked for"
        "The image sends on the serial line though no element has had a true rung yet since power-up.";
    NO_MAP "EC057" "a file is no map"
        "The map of an image is JSON as `emu compile --map` writes it (docs/compile.md). With it the symbols inside a foreign image are compared as well; without it its pins are.";
}
