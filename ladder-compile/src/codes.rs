//! Diagnostic codes of this crate: LC00x for elements, LC01x for pins, LC02x for time, LC03x for size; LC04x
//! are notes.

diag::codes! {
    /// All diagnostic codes of this crate, in order of their numbers.
    CODES;

    UNKNOWN_CHIP "LC001" "no such target chip"
        "There is no compiler for the chip of --mcu. `emu chips` lists the emulated chips. The message lists those with a compiler.";
    NOT_COMPILED "LC002" "an element is a placeholder"
        "PLACEHOLDER is an empty place of the editor. No image is written, because an image without one of the program's elements would be wrong.";
    WIDE_CONSTANT "LC003" "a constant is too large"
        "Integers are 16 bits with sign, -32768 to 32767, in dialect ldmicro-2.3, and up to 32 bits in ldmicro-5.";
    MIXED_NAME "LC004" "a name is used as a bit and as a number"
        "A symbol is either one bit (contacts and coils) or one integer. Rename one of the two.";
    DRIVEN_INPUT "LC005" "a coil drives a symbol that is not an output or relay"
        "Coils write outputs (Y..) and internal relays (R..). An input is latched from its pin and cannot be written.";
    TIMER_RANGE "LC006" "a timer counts less than 1 or more than 32767 scans"
        "A timer counts P = delay / cycle - 1 scans, with the quotient rounded down, and P must be 1 to 32767: the delay must be at least two cycles. Choose a shorter cycle, or a longer delay.";
    LACKS "LC007" "the chip lacks what an element needs"
        "Not every chip has a converter (READ_ADC), a PWM output (SET_PWM), an EEPROM (PERSIST) or a serial line (UART_SEND, UART_RECV, FORMATTED_STRING), and a controller of single bits has no arithmetic. The messages name every such element with its rung. No image is written. Choose another chip, or remove the element.";
    UNKNOWN_PIN "LC010" "no such pin"
        "A pin is a port and a bit, such as PD2. In IO LIST it is the number of a package pin that belongs to a port; 0 means not assigned.";
    PIN_TWICE "LC011" "a pin is used twice"
        "Two symbols have the same pin, which cannot serve both.";
    PIN_TAKEN "LC012" "the pin cannot be used"
        "The reset pin and the crystal pins of the image are not available. Analog inputs need a pin of the converter. The PWM output and the serial line have fixed pins. The message lists the available pins.";
    PIN_SYMBOL "LC013" "--pin names a symbol that has no pin"
        "--pin gives a pin to an input (X..), output (Y..) or analog input (A..) of the program, as in --pin Xstart=PD2. The name must be spelt as in the program.";
    TOO_MANY_PINS "LC014" "more inputs and outputs than pins"
        "Every input and output needs its own pin, and so do the peripherals that the program uses. An ATmega328P with a crystal and a reset pin has 20.";
    PIN_GIVEN_TWICE "LC015" "--pin gives a symbol two pins"
        "A symbol has one pin. Remove one of the two.";
    NO_CYCLE "LC020" "the cycle time is zero"
        "CYCLE=0 is the free-running scan of LDmicro 5. Here a timer always paces the scans, because delays are counted in scans.";
    CYCLE_LONG "LC021" "the cycle time is longer than the timer can pace"
        "One period of a timer is one scan. On an AVR it counts up to 65,536 ticks, the slowest of 1,024 clocks each; other chips reach less. The message gives the longest cycle at this clock.";
    CYCLE_SHORT "LC022" "a scan does not fit the cycle time"
        "The longest path through the scan takes more machine cycles than there are between two matches of the timer, so a scan could start late or be lost. Choose a longer cycle or a faster clock.";
    CLOCK "LC023" "the clock is impossible"
        "The clock (CRYSTAL= in Hz, or --clock) must be above zero and at most the highest clock of the chip.";
    BAUD "LC024" "the serial line cannot have this rate"
        "The chip divides its clock by integers, and no divisor is within 2 % of BAUD=. The message gives the nearest rate. Crystals of 7.3728 or 11.0592 MHz divide exactly into serial rates.";
    PWM "LC025" "the PWM output cannot have this frequency"
        "The timer of the chip divides its clock by a few fixed steps, and none is within 5 % of the frequency of SET_PWM. The message gives the nearest.";
    FLASH_FULL "LC030" "the code does not fit the chip"
        "The message gives the required bytes, the bytes of program memory and the largest rungs. emu writes only complete images.";
    RAM_FULL "LC031" "the variables do not fit the chip"
        "Every integer takes two bytes of RAM. Bits that do not fit into registers take one eighth of a byte. The stack needs some bytes too.";
    PINS_NOTE "LC040" "pins were assigned in order"
        "The program names no pins for this chip, so the compiler assigned the pins of the chip in a fixed order: first to the inputs, then to the outputs, each sorted by name. On an ATmega328P the order is PD2 to PD7, PB0 to PB5, PC0 to PC5, PD0, PD1. Use --pin to choose.";
    FUSES_NOTE "LC041" "fuses that the image requires"
        "The image counts clocks, so the chip must run at the clock of the compilation: from the crystal, with the divider CKDIV8 off.";
    OUTSIDE "LC042" "a pin needs an external part"
        "Some pins cannot do the whole job of an output: an open drain never drives high, and a port without pull-ups needs resistors, at inputs too, because an input that nothing drives floats. The image is complete. Add the part of the message to the circuit, or give the symbol another pin.";
    INTERNAL "LC099" "the compiler contradicted itself"
        "The compiler could not encode an instruction, or a place was missing. This is a fault of the compiler, not of the program. Please report it with the program. No image was written.";
}
