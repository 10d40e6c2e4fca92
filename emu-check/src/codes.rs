//! Diagnostic codes of this crate. Each row has a name, a code, a title and the text of `emu explain`.

use diag::DiagnosticCode;

macro_rules! codes {
    ($($name:ident $code:literal $title:literal $explain:literal;)*) => {
        $(pub(crate) const $name: &str = $code;)*
        /// Every code of this crate, in order of its number.
        pub const CODES: &[DiagnosticCode] = &[$(DiagnosticCode { code: $code, title: $title, explain: $explain }),*];
    };
}

codes! {
    NOTHING "EC001" "a check of no scans"
        "--scans 0 compares nothing, and agreement over nothing would say nothing. Leave the option out for 2,000 scans, or give at least 1. A cycle time or a clock of zero makes no scans either.";
    NO_MEANING "EC002" "the reference evaluator does not know an element"
        "Check compares the chip with a reference evaluator, and that refuses programs with an element (or an argument of one) that it has no meaning for. The message names the element. docs/semantics.md lists what has a meaning.";
    NO_CHIP "EC003" "there are no images for the chip"
        "Ladder programs are not compiled for this chip, though there may be an emulator for it. The message lists those that \
         there are compilers for.";
    BAD_IMAGE "EC004" "the image does not fit the emulated chip"
        "The HEX text of the compiled program was refused by the loader. The faults follow; they point at the compiler, not at the program.";
    BAD_MAP "EC005" "the map does not describe the image"
        "Check finds every symbol, pin and moment of a scan through the map that the compiler wrote. A symbol of the program without a place, or a pin that the chip does not have, makes comparing impossible.";
    NOT_COVERED "EC006" "something of the program was never exercised"
        "The stimulus did not bring an element into one of the states that count (a contact that passes and blocks, a timer that expires and is reset, a counter that wraps). The report names it. More scans (--scans) or another seed (--seed) may reach it; if not, look whether the program can ever get there. States that provably cannot occur are listed with the reason and are not counted.";
    DIFFERS_SYMBOL "EC010" "a relay, output, timer, counter or variable differs"
        "At the end of a scan the chip holds another value than the language gives it. The report names the first element in order of execution whose result differs, both values, and a command that replays the run up to that scan.";
    DIFFERS_PIN "EC011" "the level of a pin differs"
        "An output pin does not show what the program's output is: at the end of a scan its new value, until then its last one, and low from reset to the end of the first scan. Or a pin does not do by itself what it should: an input reads low when pulled low and high by its pull-up when left alone, an output holds against the outside, a pin that the program does not name floats.";
    DIFFERS_PERIOD "EC012" "a scan starts too early or too late"
        "The k-th scan must start between the k-th match of the pacing timer, floor(k P) cycles after the timer was started (one tick of the timer early at most), and one turn of the loop that waits for it. Both bounds are absolute, so a drift of a single cycle per scan is found as soon as it has added up.";
    DIFFERS_STOP "EC013" "the chip stopped, hung or left the course of a scan"
        "Each scan passes its start, its first rung and its end once, in this order, in less than a few periods. The chip ran an illegal instruction, halted, or did not get there in time.";
    DIFFERS_STACK "EC014" "the stack pointer differs from scan to scan"
        "At the start of every scan the stack must be as deep as at the first. A stack that grows or shrinks by a byte each scan ends in the data after some minutes.";
    DIFFERS_RESET "EC015" "a value is not zero after reset"
        "RAM and registers hold random bytes at power-up. Before the first scan every relay, output, timer, counter and variable must have been cleared.";
    DIFFERS_MAP "EC016" "the compiler's map says otherwise than the program"
        "Check works out from the program and the command line which chip it is, its clock, the machine cycles of a scan, the tick of the pacing timer, how long noticing a match may take, and the pins that --pin and the IO LIST give; each input and output must have one pin of its own in its direction. The map was compared with that, before anything ran. A compiler that gets one of these wrong and tells it in its map would otherwise agree with itself. The message gives what was asked for and what the map says.";
    DIFFERS_SERIAL "EC017" "a byte on the serial line differs"
        "A receiver of the checker's own hears the transmitter's pin at the program's BAUD, to 2 %. Each byte that the program sends must begin there in the scan that sends it (within a bit and a half, or behind a byte that is still on the line), in order, and nothing else may be there; between bytes the line is high.";
    DIFFERS_PWM "EC018" "the PWM output differs"
        "From two periods after a new duty on, every period at the pin is measured: its length is the one that the map tells, which must lie within 5 % of the program's frequency, and its high share is the duty within one step of the timer. 0 % is constantly low, 100 % constantly high, and until the first SET_PWM acts the pin stays low.";
    DIFFERS_EEPROM "EC019" "a cell of the EEPROM differs"
        "Once the time for a write is over, the cells of all PERSIST elements must hold on the chip what the language gives them: two cells an element (as many as the variable has bytes), in text order from address 0, lowest byte first. At power-up both sides hold the same, erased or random.";
    DIFFERS_BOUND "EC020" "a scan takes longer than the compiler says"
        "The map tells the longest scan, from its start until the chip waits again, and a program is refused where that does not fit the period. A scan on the emulated chip took longer, so the compiler's reckoning is wrong.";
}
