//! Diagnostic codes of conversions between notations: CV0xx.

diag::codes! {
    /// All diagnostic codes of conversions, in order of their numbers.
    CONVERT_CODES;

    NOT_CONVERTED "CV001" "the other notation cannot express this"
        "emu convert leaves nothing out. An element without an equal in the other notation is an error at its place: the serial line, converters, pulse width, EEPROM and subprograms of LDmicro, for example, have none in Instruction List. Fix: keep the program in its notation, or remove the element.";
    RENAMED "CV002" "a name is changed"
        "A note: the other notation does not take the name. Names of Instruction List consist of letters, digits and `_`, are no keywords and differ in more than case; names of LDmicro begin with X, Y or R by what they are.";
    LEFT_BEHIND "CV003" "settings have no place in the other notation"
        "A note: Instruction List has no chip, clock, pins and time of a scan. Give them to the verbs that need them: --mcu, --clock, --cycle and --pins.";
    NO_EFFECT "CV004" "an element without effect is not converted"
        "A note: DELAY, SLEEP, CLRWDT and STRING do nothing here (LD158), so the other notation has a comment in their place. Conditions at the end of a rung or branch, with nothing behind them, are left out.";
}
