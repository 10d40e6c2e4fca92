//! Summary of a run, as text and as JSON.

use emu_core::chip::PinDef;
use emu_core::cpu::{Cpu, ProgramError, ProgramFault};
use emu_core::pins::{PinId, PinLevel};
use emu_debug::text_escapes::escape;
use emu_debug::{AddressRange, CycleClock, ProgramSource, RunEnd, RunPlan, RunResult};
use serde_json::{Map, Value, json};

use crate::shared::{family, output};

/// Maximum number of pins of a chip for which all levels are listed.
const MAX_PINS_LISTED: usize = 100;

/// Words of the longest instruction of any family.
const MAX_INSTRUCTION_WORDS: u32 = 3;

/// All data of a run's summary.
pub struct RunSummary<'a, C> {
    /// The chip at the end of the run.
    pub cpu: &'a C,
    /// Names and source lines of addresses.
    pub source: ProgramSource<'a>,
    /// Converts cycles to seconds.
    pub clock: CycleClock,
    /// The plan, with the conditions of the run.
    pub plan: &'a RunPlan,
    /// The result of the run.
    pub result: &'a RunResult,
    /// Memory ranges to show, as typed.
    pub peek: &'a [(String, AddressRange)],
    /// Why the chip can never continue, if it is held in reset.
    pub reset_hold: Option<String>,
}

/// Returns the reason for the end of a run as one word.
pub fn reason_word(reason: RunEnd) -> &'static str {
    match reason {
        RunEnd::Limit => "limit",
        RunEnd::Halted => "halted",
        RunEnd::Until(..) => "until",
        RunEnd::Expected => "expect-uart",
        RunEnd::Failed => "fail-uart",
        RunEnd::Error(ProgramError::Illegal { .. }) => "illegal",
        RunEnd::Error(ProgramError::Fault { .. }) => "fault",
        RunEnd::StoppedWaiting => "timeout",
        RunEnd::Interrupted => "interrupted",
        RunEnd::Finished => "scenario",
    }
}

/// A pin and its level as text.
#[derive(Debug, Clone, Copy)]
struct PinText {
    /// The name of the pin.
    name: &'static str,
    /// The level: `0`, `1` or `z`.
    level: &'static str,
}

impl<C: Cpu> RunSummary<'_, C> {
    /// Returns the reason for the end of the run as one word.
    fn reason(&self) -> &'static str {
        reason_word(self.result.reason)
    }

    /// Returns the program word at which the run ended: that of the instruction that ended it, otherwise the
    /// next one.
    fn end_word(&self) -> u32 {
        match self.result.reason {
            RunEnd::Error(ProgramError::Illegal { pc, .. } | ProgramError::Fault { pc, .. }) => pc,
            _ => self.cpu.pc(),
        }
    }

    /// Returns the address of [`RunSummary::end_word`] in the unit that the chip uses.
    fn end_address(&self) -> u32 {
        self.source.names.chip.code_address(self.end_word())
    }

    /// Returns the byte address of a program word, for lookups of symbols and lines.
    fn byte_address(&self, word: u32) -> u32 {
        word * self.source.names.chip.word_bytes
    }

    /// Returns details about the end of the run, if there are any.
    fn detail(&self) -> Option<String> {
        match self.result.reason {
            RunEnd::Until(i, access) => {
                let condition = self.plan.until.get(i)?.describe(&self.source.names);
                Some(match access {
                    Some(a) => {
                        let object_suffix = self.object_suffix(a.space, a.addr.into());
                        let (at, pc) =
                            (format!("{}:0x{:x}{object_suffix}", a.space, a.addr), self.source.describe_word(a.pc));
                        format!("{condition}: 0x{:02x} at {at}, pc {pc}", a.value)
                    }
                    None => condition,
                })
            }
            RunEnd::Expected => self.plan.expect.as_deref().map(escape),
            RunEnd::Failed => self.plan.fail.as_deref().map(escape),
            RunEnd::Error(ProgramError::Illegal { .. }) => Some(self.instruction()),
            RunEnd::Error(ProgramError::Fault { fault: ProgramFault::UnwrittenRead { space, addr }, .. }) => {
                let (instruction, object_suffix) = (self.instruction(), self.object_suffix(space, addr.into()));
                Some(format!("{instruction}: {space}:0x{addr:04x}{object_suffix} was read before it was written"))
            }
            RunEnd::Error(ProgramError::Fault { fault, .. }) => Some(format!("{}: {fault}", self.instruction())),
            RunEnd::Halted => self.reset_hold.clone(),
            RunEnd::Limit | RunEnd::StoppedWaiting | RunEnd::Interrupted | RunEnd::Finished => None,
        }
    }

    /// Returns the symbol that contains an address of data memory, or the register at that address, as `
    /// (buf+0x2)`. Empty if there is none.
    fn object_suffix(&self, space: &str, addr: u32) -> String {
        let chip = self.source.names.chip;
        let register = || chip.regs.iter().find(|reg| space == chip.reg_space && u32::from(reg.addr) == addr);
        let object = self.source.names.containing_symbol(space, addr).or_else(|| Some(register()?.name.to_owned()));
        object.map_or(String::new(), |object| format!(" ({object})"))
    }

    /// Returns the instruction at the end of the run, as text.
    fn instruction(&self) -> String {
        let (chip, size) = (self.source.names.chip, self.source.names.chip.word_bytes);
        let byte = |addr: u32| u16::from(self.cpu.peek(chip.code_space, addr % chip.flash_bytes).unwrap_or(0xFF));
        let word = |start: u32| (0..size).rev().fold(0, |high, i| high << 8 | byte(start + i));
        let words: Vec<u16> =
            (0..MAX_INSTRUCTION_WORDS).map(|i| word(self.byte_address(self.end_word()) + i * size)).collect();
        (chip.isa.disassemble)(&words, self.end_word()).text
    }

    /// Returns the contents of a range in hexadecimal: bytes, or words if the memory has word addresses (low
    /// byte first in memory).
    fn cells(&self, range: &AddressRange) -> Vec<String> {
        let width = self.source.names.chip.bytes_per_address(range.space);
        let byte = |addr: u32| self.cpu.peek(range.space, addr).map(|byte| format!("{byte:02x}"));
        let cell = |addr: u32| (0..width).rev().map(|i| byte(addr * width + i)).collect();
        (range.start..range.end).filter_map(cell).collect()
    }

    /// Returns name and level of the pins to show: those of [`Cpu::pins_to_show`] and those that are high. Of
    /// purely analog pins, only the driven ones.
    fn pins(&self) -> impl Iterator<Item = PinText> {
        let pins = self.source.names.chip.pins.iter().zip(0..);
        let all = self.cpu.pins_to_show();
        let is_high = |id: PinId| self.cpu.has_pin(id) && self.cpu.pin_level(id) == PinLevel::High;
        let shown = move |(def, id): &(&PinDef, PinId)| {
            (all.binary_search(id).is_ok() || is_high(*id)) && def.is_level_meaningful(self.cpu.pin_level(*id))
        };
        pins.filter(shown).map(|(def, id)| {
            let level = match self.cpu.pin_level(id) {
                PinLevel::Low => "0",
                PinLevel::High => "1",
                PinLevel::Float | PinLevel::PullUp | PinLevel::PullDown => "z",
            };
            PinText { name: def.name, level }
        })
    }

    /// Returns the pins that chip and environment drove to opposite levels, with the first cycle of each
    /// conflict.
    fn contention(&self) -> impl Iterator<Item = (&'static str, u64)> {
        let name = |pin: PinId| self.source.names.chip.pins.get(usize::from(pin)).map_or("?", |def| def.name);
        self.result.contention.iter().map(move |&(pin, cycle)| (name(pin), cycle))
    }

    fn register(&self, name: &str) -> u32 {
        match (name, self.cpu.reg(name)) {
            ("PC", _) => self.source.names.chip.code_address(self.cpu.pc()),
            (_, value) => value.unwrap_or(0),
        }
    }
}

/// Prints pin conflicts and faults of the program on standard error. `out_of_code` is added to the hint about
/// erased memory.
pub fn report_faults<C: Cpu>(summary: &RunSummary<'_, C>, out_of_code: &str) {
    for (pin, cycle) in summary.contention() {
        output::print_to_stderr(&format!(
            "warning: the chip and a stimulus drive {pin} to opposite levels from cycle {cycle} on; the chip wins\n  \
             hint: release the pin with --set {pin}=z or --at TIME:{pin}=z while the chip drives it\n"
        ));
    }
    let erased = summary.source.names.chip.isa.erased_word;
    let erased_hint = format!("0x{erased:x} is erased memory: the program ran or jumped out of its code{out_of_code}");
    let (problem, hint) = match summary.result.reason {
        RunEnd::Error(ProgramError::Illegal { word, .. }) if word == erased => ("no instruction", erased_hint.as_str()),
        RunEnd::Error(ProgramError::Illegal { .. }) => ("no instruction", "is the image built for this chip?"),
        RunEnd::Error(ProgramError::Fault { fault: ProgramFault::UnwrittenRead { .. }, .. }) => {
            ("a fault of the program", "write the cell first; after power-up RAM is undefined")
        }
        RunEnd::Error(ProgramError::Fault { fault: ProgramFault::JumpOutOfProgram { .. }, .. }) => (
            "a fault of the program",
            "jump only to words of the same program: from its first to its last word in the program table",
        ),
        RunEnd::Error(ProgramError::Fault { fault: ProgramFault::CycleTooLong, .. }) => {
            ("a fault of the program", "let NA pass the last word of the program, or jump to its first one")
        }
        _ => return,
    };
    let detail = summary.detail().unwrap_or_default();
    let (place, cycle) = (summary.source.describe_word(summary.end_word()), summary.cpu.cycle());
    output::print_to_stderr(&format!("error: {problem} at {place}, cycle {cycle}: {detail}\n  hint: {hint}\n"));
}

/// Returns the summary as JSON.
pub fn json_document<C: Cpu>(summary: &RunSummary<'_, C>) -> Value {
    let cpu = summary.cpu;
    let mut stop = json!({ "reason": summary.reason(), "pc": summary.end_address() });
    if let Some(detail) = summary.detail() {
        stop["detail"] = json!(detail);
    }
    let symbol = summary.source.names.nearest_symbol(summary.byte_address(summary.end_word()));
    for (key, value) in [("symbol", symbol), ("line", summary.source.line_text(summary.end_word()))] {
        if let Some(value) = value {
            stop[key] = json!(value);
        }
    }
    let registers =
        summary.source.names.chip.cpu_regs.iter().map(|name| ((*name).to_owned(), json!(summary.register(name))));
    let pins = summary.pins().map(|PinText { name, level }| (name.to_owned(), json!(level)));
    let peek = summary.peek.iter().map(|(text, range)| (text.clone(), json!(summary.cells(range).concat())));
    let contention: Vec<Value> =
        summary.contention().map(|(pin, cycle)| json!({ "pin": pin, "cycle": cycle })).collect();
    let mut document = json!({
        "schema": 1,
        "mcu": summary.source.names.chip.name,
        "clock_hz": summary.clock.hz,
        "cycles": cpu.cycle(),
        "instructions": cpu.instructions(),
        "time_s": summary.clock.seconds(cpu.cycle()),
        "stop": stop,
        "registers": Value::Object(registers.collect::<Map<_, _>>()),
        "pins": Value::Object(pins.collect::<Map<_, _>>()),
    });
    if family::has_uart(summary.source.names.chip) {
        document["uart"] = json!(summary.result.uart.iter().map(|&byte| char::from(byte)).collect::<String>());
    }
    document["peek"] = Value::Object(peek.collect::<Map<_, _>>());
    if !summary.peek.is_empty() {
        let width = |(text, range): &(String, AddressRange)| {
            (text.clone(), json!(summary.source.names.chip.bytes_per_address(range.space)))
        };
        document["peek_width"] = Value::Object(summary.peek.iter().map(width).collect());
    }
    if !contention.is_empty() {
        document["contention"] = Value::Array(contention);
    }
    document
}

/// Returns the summary as text.
pub fn summary_text<C: Cpu>(summary: &RunSummary<'_, C>) -> String {
    let cpu = summary.cpu;
    let mut out = format!("stop       {}", summary.reason());
    if let Some(detail) = summary.detail() {
        out.push_str(&format!(": {detail}"));
    }
    out.push_str(&format!("\npc         {}\n", summary.source.describe_word(summary.end_word())));
    out.push_str(&format!(
        "time       {} s, {} cycles at {} Hz, {} instructions\n",
        summary.clock.seconds(cpu.cycle()),
        cpu.cycle(),
        summary.clock.hz,
        cpu.instructions()
    ));
    let (general, special): (Vec<&str>, Vec<&str>) = summary
        .source
        .names
        .chip
        .cpu_regs
        .iter()
        .copied()
        .filter(|name| *name != "PC")
        .partition(|name| name.starts_with('r'));
    for (row, chunk) in general.chunks(16).enumerate() {
        let values: Vec<String> = chunk.iter().map(|name| format!("{:02x}", summary.register(name))).collect();
        out.push_str(&format!("r{:<10}{}\n", row * 16, values.join(" ")));
    }
    let special: Vec<String> = special.iter().map(|name| format!("{name}=0x{:02x}", summary.register(name))).collect();
    out.push_str(&format!("registers  {}\n", special.join(" ")));
    let (heading, pins) = if summary.cpu.chip().pins.len() > MAX_PINS_LISTED {
        ("pins at 1", high_pins_text(summary.pins()))
    } else {
        ("pins 7..0", pin_levels_text(summary.pins()))
    };
    out.push_str(&format!("{heading:<10} {pins}\n"));
    if !summary.result.uart.is_empty() {
        out.push_str(&format!("uart       {}\n", escape(&summary.result.uart)));
    }
    for (text, range) in summary.peek {
        let columns = 16 / summary.source.names.chip.bytes_per_address(range.space).clamp(1, 16) as usize;
        for (row, chunk) in summary.cells(range).chunks(columns).enumerate() {
            let heading =
                if row == 0 { text.clone() } else { format!("  0x{:04x}", range.start as usize + row * columns) };
            out.push_str(&format!("{heading:<10} {}\n", chunk.join(" ")));
        }
    }
    out
}

/// Returns the names of the pins that are high, for chips with too many pins to show all.
fn high_pins_text(pins: impl Iterator<Item = PinText>) -> String {
    let high: Vec<&str> = pins.filter(|PinText { level, .. }| *level == "1").map(|PinText { name, .. }| name).collect();
    if high.is_empty() { "none".to_owned() } else { high.join(" ") }
}

/// Returns ports with their pins from bit 7 down, `PB=zz1zzzzz P1=zzzz1111`, with `-` for a missing pin in
/// between; then the other pins.
fn pin_levels_text(pins: impl Iterator<Item = PinText>) -> String {
    let (mut ports, mut others): (Vec<(&str, String)>, _) = (Vec::new(), Vec::new());
    for PinText { name, level } in pins {
        let Some((port, bit)) = port_and_bit(name) else {
            others.push(format!("{name}={level}"));
            continue;
        };
        let i = ports.iter().position(|(other, _)| *other == port).unwrap_or(ports.len());
        if i == ports.len() {
            ports.push((port, String::new()));
        }
        let levels = &mut ports[i].1;
        *levels = format!("{level}{levels:->bit$}");
    }
    ports.iter().map(|(port, levels)| format!("{port}={levels}")).chain(others).collect::<Vec<_>>().join(" ")
}

/// Splits a pin name into port and bit: `PB5` is bit 5 of `PB`, `P1.0` bit 0 of `P1`. `None` for pins outside
/// ports.
fn port_and_bit(name: &str) -> Option<(&str, usize)> {
    let (port, bit) = name.split_at_checked(2)?;
    match bit.strip_prefix('.').unwrap_or(bit).as_bytes() {
        [bit @ b'0'..=b'7'] => Some((port, usize::from(bit - b'0'))),
        _ => None,
    }
}
