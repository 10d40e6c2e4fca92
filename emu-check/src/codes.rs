//! Diagnostic codes of this crate.

diag::codes! {
    /// Codes EC001 to EC021, of checks of compiled ladder programs. `via/codes.rs` and `foreign/codes.rs`
    /// have the others.
    CODES;

    NOTHING "EC001" "a check of no scans"
        "--scans 0 compares nothing, so its agreement would mean nothing. Omit the option for 2,000 scans, or give at least 1. A cycle time or a clock of zero gives no scans either.";
    NO_MEANING "EC002" "the reference evaluator does not know an element"
        "A check compares the chip with a reference evaluator, which refuses programs with an element (or an argument of one) without a defined meaning. The message names the element. docs/semantics.md lists the supported elements.";
    NO_CHIP "EC003" "there are no images for the chip"
        "There is no ladder compiler for this chip, although there may be an emulator. The message lists the chips with a compiler.";
    BAD_IMAGE "EC004" "the image does not fit the emulated chip"
        "The loader refused the HEX text of the compiled program. The following errors show a fault of the compiler, not of the program.";
    BAD_MAP "EC005" "the map does not describe the image"
        "The check finds every symbol, pin and event of a scan with the map of the compiler. It cannot compare a symbol of the program without a place, or a pin that the chip does not have.";
    NOT_COVERED "EC006" "a part of the program was never exercised"
        "The stimulus did not bring an element into one of the states that count (a contact that passes and blocks, a timer that expires and is reset, a counter that wraps). The report names it. More scans (--scans) or another seed (--seed) may reach it. Otherwise check whether the program can ever reach that state. States that provably cannot occur are listed with the reason and do not count.";
    DIFFERS_SYMBOL "EC010" "a relay, output, timer, counter or variable differs"
        "At the end of a scan the value on the chip differs from the value that the language defines. The report names the first element in order of execution whose result differs, both values, and a command that replays the run up to that scan.";
    DIFFERS_PIN "EC011" "the level of a pin differs"
        "An output pin does not have the level of the program's output: at the end of a scan its new value, until then its previous one, and low from reset to the end of the first scan. Or a pin does not behave correctly by itself: an input reads low when pulled low and high by its pull-up when nothing drives it, an output keeps its level against the outside, and a pin that the program does not name floats.";
    DIFFERS_PERIOD "EC012" "a scan starts too early or too late"
        "The k-th scan must start after the k-th match of the pacing timer, floor(k P) cycles after the start of the timer (at most one tick of the timer early), and at most one iteration of the waiting loop later. Both bounds are absolute, so the check finds a drift of a single cycle per scan as soon as it has accumulated.";
    DIFFERS_STOP "EC013" "the chip stopped, hung or left the sequence of a scan"
        "Each scan executes its start, its first rung and its end once, in this order, in less than a few periods. The chip executed an illegal instruction, halted, or did not reach the next point in time.";
    DIFFERS_STACK "EC014" "the stack pointer differs from scan to scan"
        "At the start of every scan the stack must be as deep as at the first. A stack that grows or shrinks by a byte each scan overwrites the data after some minutes.";
    DIFFERS_RESET "EC015" "a value is not zero after reset"
        "At power-up RAM and registers contain random bytes. Before the first scan the program must have cleared every relay, output, timer, counter and variable, and given those of Instruction List that have an initial value this value.";
    DIFFERS_MAP "EC016" "the compiler's map contradicts the program"
        "From the program and the command line the check computes the chip, its clock, the machine cycles of a scan, the tick of the pacing timer, the maximum time to detect a match, and the pins of --pin and the IO LIST. Each input and output must have its own pin in its direction. The check compares the map with these before it runs anything. Otherwise a compiler with an error in both image and map would agree with itself. The message gives the required value and the value in the map.";
    DIFFERS_SERIAL "EC017" "a byte on the serial line differs"
        "An independent receiver of the checker reads the transmitter's pin at the BAUD of the program, within 2 %. Each byte that the program sends must begin in the scan that sends it (within a bit and a half, or after a byte that is still on the line), in order, and the line must carry nothing else. Between bytes the line is high.";
    DIFFERS_PWM "EC018" "the PWM output differs"
        "From two periods after a new duty, the check measures every period at the pin: its length is the one in the map, which must be within 5 % of the program's frequency, and its high part is the duty within one step of the timer. 0 % is constantly low, 100 % constantly high, and the pin stays low until the first SET_PWM acts.";
    DIFFERS_EEPROM "EC019" "a cell of the EEPROM differs"
        "After the write time, the cells of all PERSIST elements on the chip must contain the values that the language defines: two cells per element (as many as the variable has bytes), in text order from address 0, lowest byte first. At power-up both sides contain the same, erased or random.";
    DIFFERS_BOUND "EC020" "a scan takes longer than the compiler computed"
        "The map gives the longest scan, from its start until the chip waits again. The compiler refuses a program whose longest scan does not fit the period. A scan on the emulated chip took longer, so the computation of the compiler is wrong.";
    DIFFERS_BUS "EC021" "a transfer on a bus differs"
        "Devices of the checker are at the pins of the I2C and SPI bus. They read addresses, registers and bytes from the edges of the chip, and answer reads with a byte that changes from scan to scan. At the end of a scan the transfers must be those of its elements SPI, SPI_WR, I2C_RD and I2C_WR, in order and complete.";
}
