//! Runs a program on the emulated machine and on the evaluator in parallel, and compares them.

use emu_ap101::Ap101;
use emu_core::{ChipEvent, Cpu, CycleTime, PinId, PinLevel, Probe, StopReason};
use ladder::{LadderDialect, LadderProgram, SymbolKind};
use ladder_compile::ap101::TARGETS;
use ladder_compile::ir::{BitRole, Ir};
use ladder_compile::pins::AssignedPin;
use ladder_compile::target::{BuildRefusal, BuiltImage, CodeMark, CompileJob, CompileTarget};
use ladder_compile::{CellLocation, lower_for_target};
use ladder_eval::Evaluator;

#[path = "../../../tests/ladder/parse.rs"]
mod parse;

pub const TARGET: &CompileTarget = &TARGETS[0];

/// Program head: a cycle of 10 ms, a clock of 1 MHz.
pub const HEAD: &str = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=1000000\nIO LIST\nEND\nPROGRAM\n";

/// Parses rungs in the dialect of the standard head. A text that begins with a header is used unchanged.
pub fn program(text: &str) -> LadderProgram {
    parse::parse("test.ld", &with_head(text))
}

/// Parses rungs in a given dialect, as [`program`] does.
pub fn program_in(text: &str, dialect: LadderDialect) -> LadderProgram {
    let text = with_head(text);
    match ladder::parse_with("test.ld", &text, ladder::ParseOptions { dialect: Some(dialect) }) {
        Ok(parsed) => parsed.program,
        Err(errors) => panic!("{}\n{text}", errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")),
    }
}

fn with_head(text: &str) -> String {
    if text.starts_with("LDmicro") { text.to_owned() } else { format!("{HEAD}{text}\n") }
}

/// Lowers a program for this machine.
pub fn lower_program(program: &LadderProgram) -> Ir {
    lower_for_target(program, TARGET, true)
}

/// Assigns channels in the order of the bits, from 0.
pub fn channel_pins(ir: &Ir) -> Vec<AssignedPin> {
    let (mut inputs, mut outputs) = (0, 0);
    let mut next = |output: bool| {
        let number = if output { &mut outputs } else { &mut inputs };
        *number += 1;
        let name = format!("{}{}", if output { 'E' } else { 'I' }, *number - 1);
        TARGET.pins.iter().copied().find(|pin| *pin == name).expect("a channel")
    };
    let cells = ir.bits.iter().filter(|cell| matches!(cell.role, BitRole::Input | BitRole::Output));
    cells
        .map(|cell| {
            let output = cell.role == BitRole::Output;
            AssignedPin { name: cell.name.clone(), pin: next(output), output, analog: false }
        })
        .collect()
}

/// Builds an image of `ir` with the clock and cycle of `program`.
pub fn build(program: &LadderProgram, ir: &Ir) -> Result<BuiltImage, BuildRefusal> {
    let pins = channel_pins(ir);
    let (clock_hz, cycle_us) = (program.settings.crystal_hz, program.settings.cycle_us);
    (TARGET.build)(&CompileJob { ir, target: TARGET, pins: &pins, pwm_pins: &[], clock_hz, cycle_us, baud: None })
}

/// Collects the pins that change, one entry per change.
#[derive(Default)]
pub struct EdgeCounter(Vec<PinId>);

impl Probe for EdgeCounter {
    const EVENTS: bool = true;

    fn on_event(&mut self, event: ChipEvent) -> bool {
        if let ChipEvent::Edge { pin, .. } = event {
            self.0.push(pin);
        }
        false
    }
}

/// The machine and the evaluator, with what is needed to compare them.
pub struct MachinePair {
    pub cpu: Ap101,
    pub eval: Evaluator,
    pub built: BuiltImage,
    ir: Ir,
    pins: Vec<AssignedPin>,
    scans: u64,
    first: u64,
}

impl MachinePair {
    /// Creates both at power-up; fails if there is no image.
    pub fn new(program: &LadderProgram) -> Result<MachinePair, BuildRefusal> {
        MachinePair::of(program, lower_program(program))
    }

    /// Creates both with given intermediate code.
    pub fn of(program: &LadderProgram, ir: Ir) -> Result<MachinePair, BuildRefusal> {
        let built = build(program, &ir)?;
        let segments: Vec<_> =
            built.segments.iter().map(|(at, bytes)| emu_core::image::HexSegment { addr: *at, bytes }).collect();
        let hex = emu_core::image::write_hex(&segments);
        let image =
            emu_core::image::load_hex("image", hex.as_bytes(), TARGET.chip.hex_spaces).expect("a sound image").image;
        emu_ap101::Ap101Config::read_config(&image).expect("a sound configuration");
        let mut cpu = Ap101::new(&image);
        for mark in [CodeMark::ScanStart, CodeMark::ScanEnd] {
            cpu.set_breakpoint(MachinePair::at(&built, mark), true);
        }
        let eval = Evaluator::new(program).expect("the evaluator knows it");
        let pins = channel_pins(&ir);
        Ok(MachinePair { cpu, eval, built, ir, pins, scans: 0, first: 0 })
    }

    fn at(built: &BuiltImage, mark: CodeMark) -> u32 {
        built.marks.iter().find(|(m, _)| *m == mark).map(|&(_, at)| at).expect("a mark")
    }

    fn pin(&self, name: &str) -> Option<PinId> {
        let pin = self.pins.iter().find(|pin| pin.name == name)?;
        TARGET.chip.pin(pin.pin)
    }

    /// Drives an input on both sides.
    pub fn drive(&mut self, name: &str, level: bool) {
        let index = self.eval.index(name).expect("a symbol");
        self.eval.set(index, level.into());
        if let Some(pin) = self.pin(name) {
            let now = CycleTime::at(self.cpu.cycle());
            self.cpu.drive(now, pin, PinLevel::from_bit(level));
        }
    }

    fn place(&self, name: &str) -> &CellLocation {
        let bit = self.ir.bits.iter().position(|cell| cell.name == name).and_then(|n| self.built.bit_places.get(n));
        let word =
            || self.ir.words.iter().position(|cell| cell.name == name).and_then(|n| self.built.word_places.get(n));
        bit.or_else(word).unwrap_or_else(|| panic!("a place of {name}"))
    }

    /// Sets a symbol on both sides.
    pub fn set(&mut self, name: &str, value: i32) {
        let index = self.eval.index(name).expect("a symbol");
        self.eval.set(index, value);
        let (space, addr, bytes) = match self.place(name) {
            CellLocation::Bit { space, addr, .. } => (space.clone(), *addr, 1),
            CellLocation::Word { space, addr, bytes } => (space.clone(), *addr, *bytes),
        };
        for (addr, byte) in (addr..).zip(value.to_le_bytes()).take(bytes.into()) {
            assert!(self.cpu.poke(&space, addr, byte), "{space} {addr}");
        }
    }

    /// Value of a symbol on the machine.
    pub fn get(&self, name: &str) -> i32 {
        let peek = |space: &str, addr: u32| self.cpu.peek(space, addr).expect("a place in memory");
        match self.place(name) {
            CellLocation::Bit { space, addr, .. } => peek(space, *addr).into(),
            CellLocation::Word { space, addr, .. } => {
                i16::from_le_bytes([peek(space, *addr), peek(space, addr + 1)]).into()
            }
        }
    }

    fn run_to(&mut self, mark: CodeMark, edges: &mut EdgeCounter) -> Result<(), String> {
        let at = MachinePair::at(&self.built, mark);
        loop {
            let limit = self.cpu.cycle() + 2 * self.built.period.num + 2000;
            match self.cpu.run(limit, edges) {
                StopReason::Breakpoint { pc } if pc == at => return Ok(()),
                // A machine in a steady state halts if nothing else is scheduled, so schedule an event.
                StopReason::Halted => self.cpu.drive(CycleTime::at(limit), emu_ap101::chips::POWER_PIN, PinLevel::High),
                stop => return Err(format!("{stop:?} at {}, wanted {mark:?}", self.cpu.pc())),
            }
        }
    }

    /// Runs to the start of the next scan, which must come at its exact cycle with no pin changed before.
    pub fn begin(&mut self) -> Result<(), String> {
        let mut edges = EdgeCounter::default();
        self.run_to(CodeMark::ScanStart, &mut edges)?;
        let outputs = |pins: &[PinId]| pins.iter().filter(|pin| self.outputs().contains(pin)).count();
        if outputs(&edges.0) > 0 {
            return Err("an output has changed behind a scan".to_owned());
        }
        if self.scans == 0 {
            self.first = self.cpu.cycle();
        }
        let wanted = self.first + self.scans * self.built.period.num;
        self.scans += 1;
        if self.cpu.cycle() == wanted {
            Ok(())
        } else {
            Err(format!("scan {} starts in cycle {}, wanted {wanted}", self.scans, self.cpu.cycle()))
        }
    }

    fn outputs(&self) -> Vec<PinId> {
        self.pins.iter().filter(|pin| pin.output).filter_map(|pin| TARGET.chip.pin(pin.pin)).collect()
    }

    /// Runs to the end of the current scan and compares both sides.
    pub fn end(&mut self) -> Result<(), String> {
        let start = self.cpu.cycle();
        self.eval.scan();
        let mut edges = EdgeCounter::default();
        self.run_to(CodeMark::ScanEnd, &mut edges)?;
        for pin in self.outputs() {
            if edges.0.iter().filter(|edge| **edge == pin).count() > 1 {
                return Err(format!("{} has changed more than once", TARGET.chip.pins[usize::from(pin)].name));
            }
        }
        let outputs = self.pins.iter().filter(|pin| pin.output).count() as u64;
        let took = self.cpu.cycle() + 1 + outputs - start;
        if took > self.built.worst_scan_cycles {
            return Err(format!(
                "a scan of {took} cycles, the longest is said to take {}",
                self.built.worst_scan_cycles
            ));
        }
        for (n, symbol) in self.eval.symbols().iter().enumerate() {
            let (wanted, found) = (self.eval.get(n), self.get(&symbol.name));
            if wanted != found {
                return Err(format!("{} is {found}, wanted {wanted}", symbol.name));
            }
            if symbol.kind == SymbolKind::Output {
                let pin = self.pin(&symbol.name).expect("an output has a channel");
                let level = self.cpu.pin_level(pin);
                if level != PinLevel::from_bit(wanted != 0) {
                    return Err(format!("the pin of {} is {level:?}, wanted {wanted}", symbol.name));
                }
            }
        }
        Ok(())
    }

    pub fn scan(&mut self) -> Result<(), String> {
        self.begin()?;
        self.end()
    }

    /// The instructions, one per line.
    pub fn listing(&self) -> String {
        self.built.lines.iter().map(|line| format!("{:4} {}\n", line.addr, line.text)).collect()
    }
}
