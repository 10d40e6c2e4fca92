//! Diagnostic codes SCN0xx of scenarios and waveforms.

diag::codes! {
    /// All codes of scenarios and waveforms.
    CODES;

    NOT_TOML "SCN001" "a scenario is not valid TOML"
        "A scenario is a TOML file (toml.io): `key = value` lines, and `[[step]]` before each step. The place is the first \
         error. Text values are in double quotes.";
    UNKNOWN_KEY "SCN002" "an unknown key"
        "docs/scenario.md and docs/scenario.schema.json list the keys. Names of symbols, pins and memory places are keys only \
         within braces: set = { Xstart = 1 }.";
    WRONG_VALUE "SCN003" "a value of the wrong type"
        "Each key takes values of one type: a time is a text such as \"10ms\", the values of set and expect are in braces, a count is an \
         integer. docs/scenario.md has an example of each.";
    NOT_A_TIME "SCN004" "an invalid time"
        "A time is a number and a unit in double quotes: \"2s\", \"10ms\", \"2.5us\", \"1000 cycles\", \"5 scans\". A cycle is a cycle of the \
         machine. For a ladder program it is a period of its CRYSTAL=, so that it is the same on every chip. Only ladder programs have scans.";
    WRONG_STEP "SCN005" "a step with wrong keys"
        "A step has one verb (set, pulse, toggle, ramp, uart-send, expect, expect-uart, wait, never, repeat, snapshot, log, power-cycle), \
         or only a time, which is a pause. pulse needs for, ramp needs over, repeat needs steps. at and after exclude each other.";
    UNKNOWN_NAME "SCN006" "a name that the machine does not have"
        "For ladder programs names are those of symbols (Xstart, Ymotor, Rflag, Tdelay, Cparts). For images they are pins (PB5, P1.0, \
         RC3, E7), the supply (VDD, VCC), memory places (data:0x100, idata:0x30) and symbols of the image.";
    IMPOSSIBLE_VALUE "SCN007" "an impossible value"
        "A pin takes 0, 1, \"z\", \"pullup\", \"pulldown\", a voltage (\"1.25V\") or a reading of a converter (\"512counts\"). A symbol takes \
         the values of its width, an analog input of a ladder program 0 to 1023. A scenario cannot set a symbol that the program \
         writes in every scan.";
    OTHER_PROGRAM_OR_CHIP "SCN008" "a scenario for another program or chip"
        "The keys program = or mcu = of the scenario name another program or chip than the one that it runs with. The comparison of \
         names ignores folders. Fix: give it the right program, or remove the key if the scenario is for several.";
    UNSUPPORTED_STEP "SCN009" "a step that this machine does not support"
        "Only chips and programs with a serial line have uart-send and expect-uart. Only chips have snapshots. Only ladder programs \
         have scans. Fix: remove the step, or play the scenario on a machine that supports it.";
    NOT_VCD "SCN010" "a waveform that cannot be read"
        "The file is not a value change dump (IEEE 1364, section 18), or is damaged. The place is the first line with an error.";
    UNKNOWN_WIRES "SCN011" "ignored wires of a waveform"
        "A warning: each wire of a stimulus waveform drives the pin or symbol with its name. Wires without such a pin or symbol \
         are ignored, and so are strings. The value x is not a level: the wire keeps the previous level.";
    NOT_TIMED "SCN012" "a step that the debugger cannot queue"
        "The debugger queues the external actions of a scenario as drives at fixed times, so that it can repeat them after it goes back in \
         time. Writes to memory and to internal symbols, and power cycles, are not drives. Fix: remove these steps, or use `emu run --scenario`.";
    AMBIGUOUS_WIRES "SCN013" "two wires of a waveform with one name"
        "A wire of a waveform drives the pin or symbol with its name, in any scope. Here two different signals have the same \
         name. Fix: rename or remove the one that is not meant.";
    FAILED "SCN020" "an expectation of a scenario was not met"
        "The step found another value than expected, its wait timed out, a `never` condition occurred, or its time had already passed \
         when it started. The message gives the value and the time.";
    LIMIT "SCN021" "a scenario was still waiting at the limit"
        "A wait without `within` continues until the limit of the scenario (60 s of the machine's time, or limit =, or --for). Fix: give \
         the wait a `within`, so that it fails, or raise the limit.";
    VERDICTS_DIFFER "SCN022" "evaluator and chip do not give the same verdict"
        "The scenario ran on the reference evaluator and on the chip, and the two verdicts differ: the program behaves differently on \
         the chip than the language defines. Please report this with the program.";
}
