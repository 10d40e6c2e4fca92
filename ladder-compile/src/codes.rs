//! The codes of this crate: LC00x refuse elements, LC01x pins, LC02x time, LC03x size; LC04x are notes. One row is name,
//! code, title and the text of `emu explain`.

use diag::Code;

macro_rules! codes {
    ($($name:ident $code:literal $title:literal $explain:literal;)*) => {
        $(#[doc = $title] pub const $name: &str = $code;)*
        /// Every code of this crate, in order of its number.
        pub const CODES: &[Code] = &[$(Code { code: $code, title: $title, explain: $explain }),*];
    };
}

codes! {
    UNKNOWN_CHIP "LC001" "no such target chip"
        "The chip named with --mcu is none that programs are compiled for. `emu chips` lists the chips that are emulated; the message lists those with a compiler.";
    NOT_COMPILED "LC002" "an element is not compiled yet"
        "The program is well-formed, but the compiler has no code for one of its elements. Every such element is named with its rung; no image is written, because an image without one of its elements would be a wrong one.";
    WIDE_CONSTANT "LC003" "a constant does not fit 16 bits"
        "Integers have 16 bits with sign: -32768 to 32767.";
    MIXED_NAME "LC004" "a name is used as a bit and as a number"
        "A symbol is either one bit (contacts and coils) or one integer. Rename one of the two.";
    DRIVEN_INPUT "LC005" "a coil drives something that is no output and no relay"
        "Coils write outputs (Y..) and internal relays (R..). An input is latched from its pin and cannot be written.";
    TIMER_RANGE "LC006" "a timer counts less than 1 or more than 32767 scans"
        "A timer counts P = delay / cycle - 1 scans, the quotient truncated, and P must lie in 1..32767: the delay must be at least two cycles. Choose a shorter cycle, or a longer delay.";
    UNKNOWN_PIN "LC010" "no such pin"
        "A pin is written as port and bit, such as PD2. In IO LIST it is the number of a package pin that carries a port; 0 means not assigned.";
    PIN_TWICE "LC011" "a pin is used twice"
        "Two symbols were given the same pin, which cannot serve both.";
    PIN_TAKEN "LC012" "the pin cannot be used"
        "PC6 is the reset pin and PB6 and PB7 carry the crystal that the image relies on. Every other pin of ports B, C and D can be used.";
    PIN_SYMBOL "LC013" "--pin names a symbol that has no pin"
        "--pin gives a pin to an input (X..) or output (Y..) of the program, as in --pin Xstart=PD2. The name must be written as in the program.";
    TOO_MANY_PINS "LC014" "more inputs and outputs than pins"
        "Every input and output needs a pin of its own. An ATmega328P with a crystal and a reset pin has 20.";
    PIN_GIVEN_TWICE "LC015" "--pin gives a symbol two pins"
        "A symbol has one pin. Remove one of the two.";
    NO_CYCLE "LC020" "the cycle time is zero"
        "CYCLE=0 is LDmicro 5's free-running scan. Scans here are always paced by a timer, because delays are counted in scans.";
    CYCLE_LONG "LC021" "the cycle time is longer than the timer can pace"
        "Timer 1 counts up to 65,536 ticks, the slowest of 1,024 clocks each, and one period of it is one scan. The message gives the longest cycle at this clock.";
    CYCLE_SHORT "LC022" "a scan does not fit the cycle time"
        "The longest path through the scan takes more machine cycles than there are between two matches of the timer, so a scan could start late, or be lost. Choose a longer cycle or a faster clock.";
    CLOCK "LC023" "the clock is impossible"
        "The clock (CRYSTAL= in Hz, or --clock) must be above zero and no more than the chip's highest.";
    FLASH_FULL "LC030" "the code does not fit the chip"
        "The message gives the bytes needed and the bytes of program memory. Whole images only are written.";
    RAM_FULL "LC031" "the variables do not fit the chip"
        "Every integer takes two bytes of RAM; bits that find no place in registers take one eighth. The stack needs some bytes too.";
    PINS_NOTE "LC040" "pins were assigned in order"
        "The program names no pins for this chip, so its inputs, then its outputs, each sorted by name, were given PD2 to PD7, PB0 to PB5, PC0 to PC5, PD0, PD1 in this order. Use --pin to choose.";
    FUSES_NOTE "LC041" "fuses that the image relies on"
        "The image counts clocks, so the chip must run at the clock it was compiled for: from the crystal, with the divider CKDIV8 off.";
    INTERNAL "LC099" "the compiler contradicted itself"
        "An instruction could not be encoded or a place was missing. This is a fault of the compiler, never of the program; please report it with the program. No image was written.";
}
