//! How a run went, for people and as JSON.

use emu_avr::{Avr, isa};
use emu_core::cpu::{Cpu, Fault};
use emu_core::pins::Level;
use emu_debug::text::escape;
use emu_debug::{Clock, Ended, Names, Plan, Range, Reason};
use serde_json::{Map, Value, json};

use crate::output;

/// Everything that is told about a run.
pub struct Story<'a> {
    /// The chip at the end.
    pub cpu: &'a Avr,
    /// Names of addresses.
    pub names: Names<'a>,
    /// Seconds.
    pub clock: Clock,
    /// What was waited for.
    pub plan: &'a Plan,
    /// How it ended.
    pub ended: &'a Ended,
    /// Memory to show, as typed.
    pub peek: &'a [(String, Range)],
}

impl Story<'_> {
    /// One word for the end.
    fn reason(&self) -> &'static str {
        match self.ended.reason {
            Reason::Limit => "limit",
            Reason::Halted => "halted",
            Reason::Until(..) => "until",
            Reason::Expected => "expect-uart",
            Reason::Failed => "fail-uart",
            Reason::Illegal { .. } => "illegal",
            Reason::Fault { .. } => "fault",
            Reason::Host => "timeout",
        }
    }

    /// Byte address at which the run ended: of the instruction that did it, else of the next one.
    fn pc(&self) -> u32 {
        let word = match self.ended.reason {
            Reason::Illegal { pc, .. } | Reason::Fault { pc, .. } => pc,
            _ => self.cpu.pc(),
        };
        word * self.names.chip.word_bytes
    }

    /// More about the end, where there is more.
    fn detail(&self) -> Option<String> {
        match self.ended.reason {
            Reason::Until(i, access) => {
                let condition = self.plan.until.get(i)?.describe(&self.names);
                Some(match access {
                    Some(a) => {
                        let pc = a.pc * self.names.chip.word_bytes;
                        format!("{condition}: 0x{:02x} at {}:0x{:x}, pc 0x{pc:04x}", a.value, a.space, a.addr)
                    }
                    None => condition,
                })
            }
            Reason::Expected => self.plan.expect.as_deref().map(escape),
            Reason::Failed => self.plan.fail.as_deref().map(escape),
            Reason::Illegal { .. } => Some(self.instruction()),
            Reason::Fault { fault, .. } => Some(format!("{}: {fault}", self.instruction())),
            Reason::Limit | Reason::Halted | Reason::Host => None,
        }
    }

    /// The instruction at the end, as text.
    fn instruction(&self) -> String {
        let byte = |addr| self.cpu.peek("flash", addr % self.names.chip.flash).unwrap_or(0xFF);
        let word = |addr| u16::from_le_bytes([byte(addr), byte(addr + 1)]);
        isa::disassemble(&[word(self.pc()), word(self.pc() + 2)], self.pc() / 2).text
    }

    /// `0x0086 (main+0x4)`.
    fn place(&self) -> String {
        let near = self.names.near(self.pc()).map_or(String::new(), |near| format!(" ({near})"));
        format!("0x{:04x}{near}", self.pc())
    }

    fn bytes(&self, range: &Range) -> Vec<u8> {
        (range.start..range.end).filter_map(|addr| self.cpu.peek(range.space, addr)).collect()
    }

    /// Name and level of the pins that the package has.
    fn pins(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        self.names.chip.pins.iter().zip(0u8..).filter(|(def, _)| def.dip != 0).map(|(def, id)| {
            let level = match self.cpu.level(id) {
                Level::Low => "0",
                Level::High => "1",
                Level::Float => "z",
            };
            (def.name, level)
        })
    }

    fn register(&self, name: &str) -> u32 {
        match (name, self.cpu.reg(name)) {
            ("PC", _) => self.cpu.pc() * self.names.chip.word_bytes,
            (_, value) => value.unwrap_or(0),
        }
    }
}

/// Says on standard error what the program did wrong, if it did.
pub fn complain(story: &Story<'_>) {
    let (what, hint) = match story.ended.reason {
        Reason::Illegal { word: 0xFFFF, .. } => {
            ("no instruction", "0xffff is erased memory: the program ran or jumped out of its code")
        }
        Reason::Illegal { .. } => ("no instruction", "is the image built for this chip?"),
        Reason::Fault { fault: Fault::SelfProgramming, .. } => {
            ("a fault of the program", "boot loaders and other programs that write flash do not run yet")
        }
        Reason::Fault { fault: Fault::UninitialisedRead { .. }, .. } => {
            ("a fault of the program", "write the cell first; after power-up RAM holds anything")
        }
        _ => return,
    };
    let detail = story.detail().unwrap_or_default();
    let (place, cycle) = (story.place(), story.cpu.cycle());
    output::tell(&format!("error: {what} at {place}, cycle {cycle}: {detail}\n  hint: {hint}\n"));
}

/// The JSON document.
pub fn document(story: &Story<'_>) -> Value {
    let cpu = story.cpu;
    let mut stop = json!({ "reason": story.reason(), "pc": story.pc() });
    if let Some(detail) = story.detail() {
        stop["detail"] = json!(detail);
    }
    let registers = story.names.chip.cpu_regs.iter().map(|name| ((*name).to_owned(), json!(story.register(name))));
    let pins = story.pins().map(|(name, level)| (name.to_owned(), json!(level)));
    let hex = |range: &Range| story.bytes(range).iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let peek = story.peek.iter().map(|(text, range)| (text.clone(), json!(hex(range))));
    json!({
        "schema": 1,
        "mcu": story.names.chip.name,
        "clock_hz": story.clock.hz,
        "cycles": cpu.cycle(),
        "instructions": cpu.instructions(),
        "time_s": story.clock.seconds(cpu.cycle()),
        "stop": stop,
        "registers": Value::Object(registers.collect::<Map<_, _>>()),
        "pins": Value::Object(pins.collect::<Map<_, _>>()),
        "uart": story.ended.uart.iter().map(|&byte| char::from(byte)).collect::<String>(),
        "peek": Value::Object(peek.collect::<Map<_, _>>()),
    })
}

/// The summary for people.
pub fn text(story: &Story<'_>) -> String {
    let cpu = story.cpu;
    let mut out = format!("stop       {}", story.reason());
    if let Some(detail) = story.detail() {
        out.push_str(&format!(": {detail}"));
    }
    out.push_str(&format!("\npc         {}\n", story.place()));
    out.push_str(&format!(
        "time       {} s, {} cycles at {} Hz, {} instructions\n",
        story.clock.seconds(cpu.cycle()),
        cpu.cycle(),
        story.clock.hz,
        cpu.instructions()
    ));
    let (general, special): (Vec<&str>, Vec<&str>) =
        story.names.chip.cpu_regs.iter().copied().filter(|name| *name != "PC").partition(|name| name.starts_with('r'));
    for (row, chunk) in general.chunks(16).enumerate() {
        let values: Vec<String> = chunk.iter().map(|name| format!("{:02x}", story.register(name))).collect();
        out.push_str(&format!("r{:<10}{}\n", row * 16, values.join(" ")));
    }
    let special: Vec<String> = special.iter().map(|name| format!("{name}=0x{:02x}", story.register(name))).collect();
    out.push_str(&format!("registers  {}\n", special.join(" ")));
    let mut ports: Vec<(&str, String)> = Vec::new();
    for (name, level) in story.pins() {
        let (port, _) = name.split_at(name.len().saturating_sub(1));
        match ports.last_mut() {
            Some((last, levels)) if *last == port => levels.insert_str(0, level),
            _ => ports.push((port, level.to_owned())),
        }
    }
    let ports: Vec<String> = ports.iter().map(|(port, levels)| format!("{port}={levels}")).collect();
    out.push_str(&format!("pins 7..0  {}\n", ports.join(" ")));
    if !story.ended.uart.is_empty() {
        out.push_str(&format!("uart       {}\n", escape(&story.ended.uart)));
    }
    for (text, range) in story.peek {
        let bytes: Vec<String> = story.bytes(range).iter().map(|byte| format!("{byte:02x}")).collect();
        for (row, chunk) in bytes.chunks(16).enumerate() {
            let head = if row == 0 { text.clone() } else { format!("  0x{:04x}", range.start as usize + row * 16) };
            out.push_str(&format!("{head:<10} {}\n", chunk.join(" ")));
        }
    }
    out
}
