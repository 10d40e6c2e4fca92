//! The AP101 dialect: its instructions, and directives for the block that configures the machine.

mod clock_and_period;
mod configuration_checks;

use std::ops::Range;

use emu_core::table::InstructionRow;

use clock_and_period::{clock, period};

use super::common::{self, ignore_directive, required_arguments, value_of};
use super::{AsmDialect, AsmDirective, DialectHooks, NumberForm, ProvidedInclude, SectionContent, SectionRow};
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::{AsmRefusal, LineFault};
use crate::lines::{AsmLine, cut, trim};
use crate::symbols::AsmSymbolKind;

/// What the directives have set in this pass. Times keep the units in which they are written.
#[derive(Debug, Default)]
pub(crate) struct Ap101PassState {
    /// The line of the first directive.
    line: Option<AsmLine>,
    clock: u32,
    live_inputs: bool,
    reconfigurable: bool,
    period: Option<TimeLength>,
    channels: Option<(u16, u16)>,
    programs: Vec<[u16; 4]>,
    /// The lines that gave the last words of the programs.
    program_ends: Vec<(AsmLine, Range<usize>)>,
    modules: Vec<Option<(u8, u8, u16)>>,
    /// Listing lines of `org`, and whether each sets an address beyond program memory: then the source gives
    /// the words of the block itself, and words there are not an overrun.
    orgs: Vec<(usize, bool)>,
    /// Directives and modules that were given, with file and line.
    given_directives: Vec<(String, (u32, u32))>,
}

/// A length of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TimeLength {
    /// Machine cycles.
    Cycles(u64),
    /// Nanoseconds.
    Nanoseconds(u64),
}

/// Length of the block in bytes.
const BLOCK_BYTES: usize = 0x300;
/// The clock if no directive gives one, in Hz.
const DEFAULT_HZ: u32 = 1_000_000;
/// Types of modules, by number from 1.
const MODULE_TYPES: [&str; 7] = ["TON", "TOF", "RTO", "TP", "CTU", "CTD", "CTC"];
/// Index of the first type that counts.
const FIRST_COUNTER_TYPE: usize = 4;
/// Limits: programs, modules, channels.
const MAX_PROGRAMS: usize = 8;
const MAX_MODULES: usize = 128;
const MAX_INPUTS: i64 = 512;
const MAX_OUTPUTS: i64 = 256;
const PROGRAM_WORDS: i64 = 2048;

/// The dialect.
#[rustfmt::skip]
pub(super) const AP101: AsmDialect = AsmDialect {
    comments: &[";"],
    line_comments: &[],
    separators: b"",
    block_comments: false,
    labels_in_column_one: true,
    warns_in_column_one: false,
    numbers: &[NumberForm::Hex0x, NumberForm::HexH, NumberForm::BinaryB, NumberForm::OctalOQ, NumberForm::DecimalD, NumberForm::HexDollar, NumberForm::Binary0b, NumberForm::Quoted,
               NumberForm::Plain],
    radix: 10,
    dot_is_bit: false,
    location_counter_names: &["$", "."],
    counter_at_line_start: true,
    counter_after_instruction: false,
    operators: super::C_OPERATORS,
    unary: super::C_UNARY,
    true_value: 1,
    arithmetic: super::AsmArithmetic::Signed,
    controls: false,
    numbered_labels: false,
    dollar_labels: false,
    ignores_case: true,
    plain_arguments: true,
    big_endian: false,
    org_fills: None,
    spaced_arguments: false,
    space_fills: false,
    zones: true,
    literals: &[],
    hooks: DialectHooks { check, ..DialectHooks::NONE },
    directives: &[
        AsmDirective::run("org", org),
        AsmDirective::run("dw", words),
        AsmDirective::run("word", words),
        AsmDirective::run("clock", clock),
        AsmDirective::run("inputs", |asm, call| choice(asm, call, ["scan", "live"], |state, live| state.live_inputs = live)),
        AsmDirective::run("mode", |asm, call| choice(asm, call, ["fixed", "reconfigurable"], |state, on| state.reconfigurable = on)),
        AsmDirective::run("period", period),
        AsmDirective::run("channels", channels),
        AsmDirective::run("program", program),
        AsmDirective::run("module", module),
        AsmDirective::run("tim", tim),
        AsmDirective::run("title", ignore_directive),
    ],
    include_provided: |_, _| ProvidedInclude::NotProvided,
    predefined: |_| Vec::new(),
    refuse_instruction: refuses,
    finish_pass: finish,
    sections: &[
        SectionRow { name: "code", space: "", content: SectionContent::Image, align_after_previous: None },
        SectionRow { name: "config", space: "config", content: SectionContent::Memory, align_after_previous: None },
    ],
};

/// Zones: the letter, and the last address that a machine can have.
const ZONES: [(char, i64); 6] =
    [('I', MAX_INPUTS - 1), ('E', MAX_OUTPUTS - 1), ('O', MAX_OUTPUTS - 1), ('R', 383), ('T', 383), ('M', 511)];

/// Refuses addresses that no machine has, instructions that write, and letters of read-only zones.
fn refuses(mnemonic: &str, operands: &str) -> Option<AsmRefusal> {
    let writes = matches!(mnemonic, "sto" | "stoc" | "stc" | "rtc");
    let letter = operands.chars().next()?.to_ascii_uppercase();
    let numbered = operands.get(1..)?.trim_start().starts_with(|c: char| !c.is_ascii_alphabetic());
    if !matches!(mnemonic, "jmp" | "jmpc")
        && let Some((_, most)) = ZONES.iter().find(|(known, _)| *known == letter)
        && let Some((n, decimal)) = offset(operands)
        && (n > *most || !decimal)
    {
        let range = format!("{letter} has addresses from 0 to {most}");
        return Some(if n > *most {
            AsmRefusal::new("ASM003", format!("there is no {letter}{n}"), range)
        } else {
            let cause = format!("the number after {letter} is decimal");
            AsmRefusal::new("ASM003", cause, format!("{range}; this one is {letter}{n}"))
        });
    }
    if !writes || !numbered {
        return None;
    }
    let (what, hint) = match letter {
        'O' => ("O is what an output channel reads as, and cannot be written", "write E for the channel"),
        'T' => ("T is what a module reads as, and cannot be written", "write R for the module"),
        'I' if matches!(mnemonic, "stc" | "rtc") => {
            ("an input channel is not set or cleared", "sto writes its latch, M is memory")
        }
        _ => return None,
    };
    Some(AsmRefusal::new("ASM002", what, hint))
}

/// Returns the number after the letter of a zone, and whether it is decimal: `I512`, `I_512,X`, `M0x1F`.
fn offset(operands: &str) -> Option<(i64, bool)> {
    let number = operands.split(',').next()?.get(1..)?.trim_end();
    let number = number.strip_prefix('_').unwrap_or(number).to_ascii_lowercase();
    match number.strip_prefix("0x") {
        Some(hex) => Some((i64::from_str_radix(hex, 16).ok()?, false)),
        None => Some((number.parse().ok()?, true)),
    }
}

/// Refuses addresses that no machine has, in any notation.
fn check(row: &InstructionRow, values: &[(i32, Range<usize>)]) -> Option<LineFault> {
    let (value, at) = values.first().filter(|_| row.operands.iter().any(|slot| slot.kind.name.starts_with("bit")))?;
    let letter = *['I', 'E', 'R', 'M'].get(usize::try_from(value / 512).ok()?)?;
    let (n, (_, most)) = (i64::from(value % 512), ZONES.iter().find(|(known, _)| *known == letter)?);
    let hint = format!("{letter} has addresses from 0 to {most}");
    (n > *most).then(|| LineFault::new("ASM003", at.clone(), format!("there is no {letter}{n}"), hint))
}

/// `org ADDRESS`: sets the address, and records whether words of the block follow.
fn org(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    common::org(asm, call);
    let row = (asm.out.list.len(), asm.out.next_address() >= PROGRAM_WORDS);
    asm.family_state.ap101.orgs.push(row);
}

/// Emits one program word for each value.
fn words(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    for part in required_arguments(asm, call) {
        let value = value_of(asm, call.text, part.clone(), 16) as u16;
        asm.emit_words(&[value], part);
    }
}

/// Returns the pass state and marks that the block is to be written.
fn state<'s>(asm: &'s mut Assembler<'_>) -> &'s mut Ap101PassState {
    let line = asm.line.clone();
    let state = &mut asm.family_state.ap101;
    state.line = state.line.take().or(line);
    state
}

/// Returns a number within `range`; reports any other value and returns 0.
fn number_in_range(
    asm: &mut Assembler<'_>,
    call: &DirectiveCall<'_>,
    part: Range<usize>,
    range: Range<i64>,
    what: &str,
) -> i64 {
    let Some(n) = asm.evaluate_number(call.text, part.clone()) else { return 0 };
    if range.contains(&n) {
        return n;
    }
    let cause = format!("{what} {n} is not in {}..={}", range.start, range.end - 1);
    asm.report(LineFault::new("ASM003", part, cause, "use a value in range"));
    0
}

fn report_bad_argument(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, cause: String, hint: &str) {
    let rest = trim(call.text, call.rest.clone());
    let at = if rest.is_empty() { call.word.clone() } else { rest };
    asm.report(LineFault::new("ASM060", at, cause, hint));
}

/// Reports that `what` was given before, and where.
fn check_given_once(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, what: &str) {
    let what = what.trim_start_matches('.');
    let Some(line) = &asm.line else { return };
    let here = (line.file, line.number);
    let said = &mut asm.family_state.ap101.given_directives;
    match said.iter().find(|(known, _)| known.eq_ignore_ascii_case(what)).map(|(_, place)| *place) {
        Some((file, line)) => {
            let cause = format!("`{what}` was given already at {}:{line}", asm.texts.name(file));
            report_bad_argument(asm, call, cause, "give it once");
        }
        None => said.push((what.to_owned(), here)),
    }
}

/// Reads one of two words.
fn choice(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, words: [&str; 2], set: fn(&mut Ap101PassState, bool)) {
    check_given_once(asm, call, call.get(call.word.clone()));
    let text = call.get(trim(call.text, call.rest.clone()));
    match words.iter().position(|word| word.eq_ignore_ascii_case(text)) {
        Some(i) => set(state(asm), i == 1),
        None => report_bad_argument(
            asm,
            call,
            format!("`{text}` is not one of {} and {}", words[0], words[1]),
            "write one of the two words",
        ),
    }
}

/// `channels INPUTS, OUTPUTS`.
fn channels(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    check_given_once(asm, call, call.get(call.word.clone()));
    let [inputs, outputs] = &cut(asm.dialect, call.text, call.rest.clone())[..] else {
        return report_bad_argument(
            asm,
            call,
            "two numbers are wanted".to_owned(),
            "write the input channels and the output channels: channels 16, 8",
        );
    };
    let inputs = number_in_range(asm, call, inputs.clone(), 0..MAX_INPUTS + 1, "input channels") as u16;
    let outputs = number_in_range(asm, call, outputs.clone(), 0..MAX_OUTPUTS + 1, "output channels") as u16;
    state(asm).channels = Some((inputs, outputs));
}

/// `program FIRST, LAST`, `program FIRST, LAST, RX, off`.
fn program(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let parts = cut(asm.dialect, call.text, call.rest.clone());
    let (Some(first), Some(last), true) = (parts.first(), parts.get(1), parts.len() <= 4) else {
        let hint = "write its first and last word, its RX, and `off` where it does not run from the start";
        return report_bad_argument(asm, call, "a program needs two addresses".to_owned(), hint);
    };
    let start = number_in_range(asm, call, first.clone(), 0..PROGRAM_WORDS, "first word");
    let end = number_in_range(asm, call, last.clone(), 0..PROGRAM_WORDS, "last word");
    // RX may be left out before `off`.
    let is_word =
        |part: &&Range<usize>| matches!(call.get((*part).clone()).to_ascii_lowercase().as_str(), "on" | "off");
    let index = parts.get(2).filter(|part| parts.len() > 3 || !is_word(part));
    let rx = index.map_or(0, |part| number_in_range(asm, call, part.clone(), 0..PROGRAM_WORDS, "RX"));
    let word = parts.get(3).or(parts.get(2).filter(is_word)).map_or("on", |part| call.get(part.clone()));
    let on = word.eq_ignore_ascii_case("on");
    if !on && !word.eq_ignore_ascii_case("off") {
        report_bad_argument(
            asm,
            call,
            format!("`{word}` is not one of on and off"),
            "a program with `off` runs once its bit in M is set",
        );
    }
    if start > end {
        report_bad_argument(
            asm,
            call,
            format!("the program ends at 0x{end:03X}, before its first word 0x{start:03X}"),
            "give its first and its last word",
        );
    }
    let full = state(asm).programs.len() >= MAX_PROGRAMS;
    if full {
        return report_bad_argument(
            asm,
            call,
            format!("there are {MAX_PROGRAMS} programs already"),
            "put two of them together",
        );
    }
    if let Some(line) = asm.line.clone() {
        state(asm).program_ends.push((line, last.clone()));
    }
    state(asm).programs.push([start as u16, end as u16, rx as u16, 1 | u16::from(on) << 1]);
}

/// Returns the number of a module: `R5`, `R(expression)`, or a name of one.
fn module_number(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, part: Range<usize>) -> Option<usize> {
    let text = call.get(part.clone());
    let own = asm.symbols.get(text, asm.dialect.ignores_case).map(|symbol| symbol.kind.clone());
    let name: &str = match &own {
        Some(AsmSymbolKind::Alias { of, .. }) => of,
        _ => text,
    };
    // A name that is defined further down is known in the next pass.
    asm.has_forward_reference |= own.is_none() && asm.pass == 1;
    let inner = name.strip_prefix(['R', 'r']).map(|inner| inner.strip_prefix('_').unwrap_or(inner));
    let n = match inner {
        Some(inner) if inner.starts_with('(') => asm.evaluate_number(call.text, part.start + 1..part.end)?,
        Some(inner) if inner.parse::<i64>().is_ok() => inner.parse().unwrap_or(0),
        _ => {
            let hint = "modules are R0 to R127; equ gives them names";
            report_bad_argument(asm, call, format!("`{text}` is not a module"), hint);
            return None;
        }
    };
    if !(0..MAX_MODULES as i64).contains(&n) {
        let cause = format!("module R{n} is not in 0..={}", MAX_MODULES - 1);
        asm.report(LineFault::new("ASM003", part, cause, "use a value in range"));
        return Some(0);
    }
    Some(n as usize)
}

/// `module R1, TON, 100ms, 50`, `module R2, CTU, 10`.
fn module(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let parts = cut(asm.dialect, call.text, call.rest.clone());
    let (Some(which), Some(kind)) = (parts.first(), parts.get(1)) else {
        let hint = "write `module R1, TON, 100ms, 50` or `module R2, CTU, 10`";
        return report_bad_argument(asm, call, "a module, its type and its preset are wanted".to_owned(), hint);
    };
    let Some(n) = module_number(asm, call, which.clone()) else { return };
    check_given_once(asm, call, &format!("module R{n}"));
    let name = call.get(kind.clone());
    let Some(kind) = MODULE_TYPES.iter().position(|known| known.eq_ignore_ascii_case(name)) else {
        return report_bad_argument(
            asm,
            call,
            format!("`{name}` is not a type of module"),
            "types are TON, TOF, RTO, TP, CTU, CTD and CTC",
        );
    };
    let (unit, preset) = match (kind >= FIRST_COUNTER_TYPE, parts.get(2), parts.get(3), parts.len()) {
        (true, Some(preset), None, 3) => (0, preset.clone()),
        (false, Some(unit), Some(preset), 4) => {
            let text = call.get(unit.clone());
            let units = ["cycle", "1ms", "10ms", "100ms"];
            let Some(unit) = units.iter().position(|known| known.eq_ignore_ascii_case(text)) else {
                return report_bad_argument(
                    asm,
                    call,
                    format!("`{text}` is not a unit of time"),
                    "units are cycle, 1ms, 10ms and 100ms",
                );
            };
            (unit, preset.clone())
        }
        _ => {
            let hint = "a timer has a unit and a preset: `module R1, TON, 100ms, 50`; a counter a preset: `module R2, CTU, 10`";
            return report_bad_argument(asm, call, format!("these are not what a {name} needs"), hint);
        }
    };
    let preset = number_in_range(asm, call, preset, 0..0x1_0000, "preset") as u16;
    let modules = &mut state(asm).modules;
    if modules.len() <= n {
        modules.resize(n + 1, None);
    }
    if let Some(place) = modules.get_mut(n) {
        *place = Some((kind as u8 + 1, unit as u8, preset));
    }
}

/// `TIM R1,#50`: the program sets the preset of a module.
fn tim(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let parts = cut(asm.dialect, call.text, call.rest.clone());
    let [which, value] = parts.as_slice() else {
        return report_bad_argument(asm, call, "a module and a preset are wanted".to_owned(), "write `TIM R1,#50`");
    };
    let n = module_number(asm, call, which.clone()).unwrap_or(0);
    let hash = usize::from(call.get(value.clone()).starts_with('#'));
    let preset = number_in_range(asm, call, value.start + hash..value.end, 0..PROGRAM_WORDS, "preset");
    // STO to the port of the module, then a NOP that carries the value.
    let port = format!("R{}", 256 + n);
    let Some(mut words) = asm.assemble_instruction(&port, "sto", 0..0, 0..port.len()) else { return };
    words.push(0xF000 | preset as u16);
    asm.emit_words(&words, call.word.clone());
}

/// Emits the block, if a directive has asked for one.
fn finish(asm: &mut Assembler<'_>) {
    let state = std::mem::take(&mut asm.family_state.ap101);
    if configuration_checks::report_overrun(asm, &state.orgs) {
        return;
    }
    configuration_checks::warn_beyond_configuration(asm, &state);
    let Some(line) = state.line else {
        asm.line = None;
        return;
    };
    asm.line = Some(line.clone());
    let hz = if state.clock == 0 { DEFAULT_HZ } else { state.clock };
    let cycles = match state.period {
        None => 0,
        Some(TimeLength::Cycles(n)) => u128::from(n),
        Some(TimeLength::Nanoseconds(ns)) => u128::from(ns) * u128::from(hz) / 2 / 1_000_000_000,
    };
    let cycles = u32::try_from(cycles).unwrap_or(0);
    if state.period.is_some() && cycles == 0 {
        let hint = "a period has from one machine cycle to 4294967295; a machine cycle is two clocks";
        asm.report(LineFault::new("ASM060", 0..line.text.len(), "the period is out of range at this clock", hint));
    }
    let (inputs, outputs) = state.channels.unwrap_or((MAX_INPUTS as u16, MAX_OUTPUTS as u16));
    let mut block = Vec::with_capacity(BLOCK_BYTES);
    block.extend(*b"AP");
    block.extend([1, u8::from(state.live_inputs), u8::from(state.reconfigurable), 0]);
    block.extend(outputs.to_le_bytes());
    block.extend(inputs.to_le_bytes());
    block.extend([0; 2]);
    block.extend(state.clock.to_le_bytes());
    block.extend(cycles.to_le_bytes());
    block.resize(0x20, 0);
    block.extend(state.programs.iter().flatten().flat_map(|field| field.to_le_bytes()));
    block.resize(0x100, 0);
    for module in &state.modules {
        let (kind, unit, preset) = module.unwrap_or_default();
        block.extend([kind, unit]);
        block.extend(preset.to_le_bytes());
    }
    block.resize(BLOCK_BYTES, 0);
    let now = asm.out.current;
    if asm.out.enter_named("config").is_some() {
        asm.out.set_address(0);
        asm.begin_listing_line(&line);
        asm.emit(&block, 0..line.text.len());
    }
    asm.out.current = now;
    asm.line = None;
}

const _: () = assert!(BLOCK_BYTES == 0x100 + MAX_MODULES * 4);
