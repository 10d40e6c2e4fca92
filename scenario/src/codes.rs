//! Diagnostic codes SCN0xx of scenarios and waveforms.

use diag::DiagnosticCode;

/// The file is not valid TOML.
pub const NOT_TOML: &str = "SCN001";
/// The key does not exist in scenarios.
pub const UNKNOWN_KEY: &str = "SCN002";
/// The value has the wrong type for its key.
pub const WRONG_VALUE: &str = "SCN003";
/// The text is not a valid time.
pub const NOT_A_TIME: &str = "SCN004";
/// The step does nothing, has several actions, or lacks a key.
pub const WRONG_STEP: &str = "SCN005";
/// The machine does not have the name.
pub const UNKNOWN_NAME: &str = "SCN006";
/// The named item cannot have the value.
pub const IMPOSSIBLE_VALUE: &str = "SCN007";
/// The scenario is for another program or chip.
pub const OTHER_PROGRAM_OR_CHIP: &str = "SCN008";
/// The machine cannot do the step.
pub const UNSUPPORTED_STEP: &str = "SCN009";
/// The waveform cannot be parsed.
pub const NOT_VCD: &str = "SCN010";
/// Wires of the waveform do not name anything of the machine.
pub const UNKNOWN_WIRES: &str = "SCN011";
/// The step is not a stimulus at a fixed time, and only those are supported here.
pub const NOT_TIMED: &str = "SCN012";
/// Several wires of the waveform have the same name, so the intended one is not known.
pub const AMBIGUOUS_WIRES: &str = "SCN013";
/// An expectation was not met.
pub const FAILED: &str = "SCN020";
/// The limit was reached before the scenario ended.
pub const LIMIT: &str = "SCN021";
/// Evaluator and chip give different verdicts.
pub const VERDICTS_DIFFER: &str = "SCN022";

/// All codes of scenarios and waveforms.
#[rustfmt::skip]
pub const CODES: &[DiagnosticCode] = &[
    DiagnosticCode { code: NOT_TOML, title: "a scenario is no TOML",
        explain: "A scenario is a TOML file (toml.io): `key = value` lines, and `[[step]]` before each step. The place is the first that \
                  cannot be read. Text values stand in double quotes." },
    DiagnosticCode { code: UNKNOWN_KEY, title: "a key that no scenario has",
        explain: "The keys stand in docs/scenario.md and docs/scenario.schema.json. Names of symbols, pins and memory places are keys only \
                  within braces: set = { Xstart = 1 }." },
    DiagnosticCode { code: WRONG_VALUE, title: "a value of the wrong kind",
        explain: "Each key takes values of one kind: a time is text such as \"10ms\", what is set or expected stands in braces, a count is a \
                  whole number. docs/scenario.md has an example of each." },
    DiagnosticCode { code: NOT_A_TIME, title: "a time that is none",
        explain: "A time is a number and a unit in double quotes: \"2s\", \"10ms\", \"2.5us\", \"1000 cycles\", \"5 scans\". A cycle is one of the \
                  machine, and for a ladder program a period of its CRYSTAL=, so that it is the same on every chip. Only ladder programs have scans." },
    DiagnosticCode { code: WRONG_STEP, title: "a step that does not hold together",
        explain: "A step has one verb (set, pulse, toggle, ramp, uart-send, expect, expect-uart, wait, never, repeat, snapshot, log, power-cycle), \
                  or none and only a time, which is a pause. pulse needs for, ramp needs over, repeat needs steps; at and after exclude each other." },
    DiagnosticCode { code: UNKNOWN_NAME, title: "a name that the machine does not have",
        explain: "For ladder programs names are those of symbols (Xstart, Ymotor, Rflag, Tdelay, Cparts). For images they are pins (PB5, P1.0, \
                  RC3, E7), the supply (VDD, VCC), memory places (data:0x100, idata:0x30) and symbols of the image." },
    DiagnosticCode { code: IMPOSSIBLE_VALUE, title: "a value that the named thing cannot have",
        explain: "A pin takes 0, 1, \"z\", \"pullup\", \"pulldown\", a voltage (\"1.25V\") or a reading of a converter (\"512counts\"), a symbol what its \
                  width holds, an analog input of a ladder program 0 to 1023. What a program writes itself in every scan cannot be set." },
    DiagnosticCode { code: OTHER_PROGRAM_OR_CHIP, title: "a scenario for another program or chip",
        explain: "The scenario says with program = or mcu = what it is for, and that is not what it was given to. Names are compared without \
                  folders. Mend: give it the right program, or remove that line if it is meant for several." },
    DiagnosticCode { code: UNSUPPORTED_STEP, title: "a step that cannot be done on this machine",
        explain: "Only chips and programs with a serial line have uart-send and expect-uart; snapshots are of chips; scans are of ladder programs. \
                  Mend: remove the step, or play the scenario where it can be done." },
    DiagnosticCode { code: NOT_VCD, title: "a waveform that cannot be read",
        explain: "The file is no value change dump (IEEE 1364, section 18), or is damaged. The place is the line that cannot be read." },
    DiagnosticCode { code: UNKNOWN_WIRES, title: "wires of a waveform that are passed over",
        explain: "A warning: a waveform given as stimulus drives what has the name of one of its wires. Wires that name nothing that can be driven \
                  are passed over, as are strings, and x is no level: the wire then keeps the one before." },
    DiagnosticCode { code: NOT_TIMED, title: "a step that the debugger cannot queue",
        explain: "The debugger takes what a scenario does from outside as drives at fixed times, so that going back in time does it again. Writes \
                  of memory and of inner symbols, and power cycles, are no such drives. Mend: leave those steps out, or use `emu run --scenario`." },
    DiagnosticCode { code: AMBIGUOUS_WIRES, title: "two wires of a waveform with one name",
        explain: "A wire of a waveform drives what has its name, whatever scope it is of. Here two that are not the same signal have a name that \
                  is to be driven. Mend: rename the one that is not meant, or take it out." },
    DiagnosticCode { code: FAILED, title: "an expectation of a scenario was not met",
        explain: "The step named found another value than it expected, what it waited for did not come within its time, something came that \
                  never should, or its time had passed when it was its turn. The message says what was found and when." },
    DiagnosticCode { code: LIMIT, title: "a scenario was still waiting at the limit",
        explain: "A wait without `within` goes on until the scenario's limit (60 s of the machine's time, or limit =, or --for). Mend: give the \
                  wait a `within`, so that it fails, or raise the limit." },
    DiagnosticCode { code: VERDICTS_DIFFER, title: "evaluator and chip do not give the same verdict",
        explain: "The scenario was played on the reference evaluator and on the chip, and the two say different things: the program does \
                  not do on the chip what it means. Please report this with the program." },
];
