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
    DiagnosticCode { code: NOT_TOML, title: "a scenario is not valid TOML",
        explain: "A scenario is a TOML file (toml.io): `key = value` lines, and `[[step]]` before each step. The place is the first \
                  error. Text values are in double quotes." },
    DiagnosticCode { code: UNKNOWN_KEY, title: "an unknown key",
        explain: "docs/scenario.md and docs/scenario.schema.json list the keys. Names of symbols, pins and memory places are keys only \
                  within braces: set = { Xstart = 1 }." },
    DiagnosticCode { code: WRONG_VALUE, title: "a value of the wrong type",
        explain: "Each key takes values of one type: a time is a text such as \"10ms\", the values of set and expect are in braces, a count is an \
                  integer. docs/scenario.md has an example of each." },
    DiagnosticCode { code: NOT_A_TIME, title: "an invalid time",
        explain: "A time is a number and a unit in double quotes: \"2s\", \"10ms\", \"2.5us\", \"1000 cycles\", \"5 scans\". A cycle is a cycle of the \
                  machine. For a ladder program it is a period of its CRYSTAL=, so that it is the same on every chip. Only ladder programs have scans." },
    DiagnosticCode { code: WRONG_STEP, title: "a step with wrong keys",
        explain: "A step has one verb (set, pulse, toggle, ramp, uart-send, expect, expect-uart, wait, never, repeat, snapshot, log, power-cycle), \
                  or only a time, which is a pause. pulse needs for, ramp needs over, repeat needs steps. at and after exclude each other." },
    DiagnosticCode { code: UNKNOWN_NAME, title: "a name that the machine does not have",
        explain: "For ladder programs names are those of symbols (Xstart, Ymotor, Rflag, Tdelay, Cparts). For images they are pins (PB5, P1.0, \
                  RC3, E7), the supply (VDD, VCC), memory places (data:0x100, idata:0x30) and symbols of the image." },
    DiagnosticCode { code: IMPOSSIBLE_VALUE, title: "an impossible value",
        explain: "A pin takes 0, 1, \"z\", \"pullup\", \"pulldown\", a voltage (\"1.25V\") or a reading of a converter (\"512counts\"). A symbol takes \
                  the values of its width, an analog input of a ladder program 0 to 1023. A scenario cannot set a symbol that the program \
                  writes in every scan." },
    DiagnosticCode { code: OTHER_PROGRAM_OR_CHIP, title: "a scenario for another program or chip",
        explain: "The keys program = or mcu = of the scenario name another program or chip than the one that it runs with. The comparison of \
                  names ignores folders. Fix: give it the right program, or remove the key if the scenario is for several." },
    DiagnosticCode { code: UNSUPPORTED_STEP, title: "a step that this machine does not support",
        explain: "Only chips and programs with a serial line have uart-send and expect-uart. Only chips have snapshots. Only ladder programs \
                  have scans. Fix: remove the step, or play the scenario on a machine that supports it." },
    DiagnosticCode { code: NOT_VCD, title: "a waveform that cannot be read",
        explain: "The file is not a value change dump (IEEE 1364, section 18), or is damaged. The place is the first line with an error." },
    DiagnosticCode { code: UNKNOWN_WIRES, title: "ignored wires of a waveform",
        explain: "A warning: each wire of a stimulus waveform drives the pin or symbol with its name. Wires without such a pin or symbol \
                  are ignored, and so are strings. The value x is not a level: the wire keeps the previous level." },
    DiagnosticCode { code: NOT_TIMED, title: "a step that the debugger cannot queue",
        explain: "The debugger queues the external actions of a scenario as drives at fixed times, so that it can repeat them after it goes back in \
                  time. Writes to memory and to internal symbols, and power cycles, are not drives. Fix: remove these steps, or use `emu run --scenario`." },
    DiagnosticCode { code: AMBIGUOUS_WIRES, title: "two wires of a waveform with one name",
        explain: "A wire of a waveform drives the pin or symbol with its name, in any scope. Here two different signals have the same \
                  name. Fix: rename or remove the one that is not meant." },
    DiagnosticCode { code: FAILED, title: "an expectation of a scenario was not met",
        explain: "The step found another value than expected, its wait timed out, a `never` condition occurred, or its time had already passed \
                  when it started. The message gives the value and the time." },
    DiagnosticCode { code: LIMIT, title: "a scenario was still waiting at the limit",
        explain: "A wait without `within` continues until the limit of the scenario (60 s of the machine's time, or limit =, or --for). Fix: give \
                  the wait a `within`, so that it fails, or raise the limit." },
    DiagnosticCode { code: VERDICTS_DIFFER, title: "evaluator and chip do not give the same verdict",
        explain: "The scenario ran on the reference evaluator and on the chip, and the two verdicts differ: the program behaves differently on \
                  the chip than the language defines. Please report this with the program." },
];
