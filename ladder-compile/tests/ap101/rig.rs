//! A program on the machine and on the evaluator, side by side.

use emu_ap101::Ap101;
use emu_core::{Cpu, Event, Level, PinId, Probe, Stop, Time};
use ladder::{Dialect, Program, SymbolKind};
use ladder_compile::ap101::TARGETS;
use ladder_compile::ir::{BitRole, Ir};
use ladder_compile::pins::Pin;
use ladder_compile::target::{Built, Job, Mark, Refusal, Target};
use ladder_compile::{Place, intermediate};
use ladder_eval::Evaluator;

pub const TARGET: &Target = &TARGETS[0];

/// What stands before the rungs of a program: 10 ms, 1 MHz.
pub const HEAD: &str = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=1000000\nIO LIST\nEND\nPROGRAM\n";

/// A program of these rungs, in the dialect of its header. A text that begins with a header is taken as it is.
pub fn program(text: &str) -> Program {
    parsed(text, None)
}

/// The same in a dialect.
pub fn program_in(text: &str, dialect: Dialect) -> Program {
    parsed(text, Some(dialect))
}

fn parsed(text: &str, dialect: Option<Dialect>) -> Program {
    let text = if text.starts_with("LDmicro") { text.to_owned() } else { format!("{HEAD}{text}\n") };
    match ladder::parse_with("test.ld", &text, ladder::Options { dialect }) {
        Ok(parsed) => parsed.program,
        Err(errors) => panic!("{}\n{text}", errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")),
    }
}

/// The code of a program for this machine.
pub fn code(program: &Program) -> Ir {
    intermediate(program, TARGET, true)
}

/// Channels in the order of the bits, from 0.
pub fn pins(ir: &Ir) -> Vec<Pin> {
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
            Pin { name: cell.name.clone(), pin: next(output), output, analog: false }
        })
        .collect()
}

/// An image of `ir` with the times of `program`.
pub fn build(program: &Program, ir: &Ir) -> Result<Built, Refusal> {
    let pins = pins(ir);
    let (clock_hz, cycle_us) = (program.settings.crystal_hz, program.settings.cycle_us);
    (TARGET.build)(&Job { ir, target: TARGET, pins: &pins, clock_hz, cycle_us, baud: None })
}

/// Counts the changes of each pin.
#[derive(Default)]
pub struct Edges(Vec<PinId>);

impl Probe for Edges {
    const EVENTS: bool = true;

    fn event(&mut self, event: Event) -> bool {
        if let Event::Edge { pin, .. } = event {
            self.0.push(pin);
        }
        false
    }
}

/// Both sides.
pub struct Pair {
    pub cpu: Ap101,
    pub eval: Evaluator,
    pub built: Built,
    ir: Ir,
    pins: Vec<Pin>,
    scans: u64,
    first: u64,
}

impl Pair {
    /// Both at power-up, or why there is no image.
    pub fn new(program: &Program) -> Result<Pair, Refusal> {
        Pair::of(program, code(program))
    }

    /// The same with code that was made otherwise.
    pub fn of(program: &Program, ir: Ir) -> Result<Pair, Refusal> {
        let built = build(program, &ir)?;
        let segments: Vec<(u32, &[u8])> = built.segments.iter().map(|(at, bytes)| (*at, &bytes[..])).collect();
        let hex = emu_core::image::write_hex(&segments);
        let image = emu_core::image::load_hex("image", hex.as_bytes(), TARGET.chip.hex).expect("a sound image").image;
        emu_ap101::Config::of(&image).expect("a sound configuration");
        let mut cpu = Ap101::new(&image);
        for mark in [Mark::ScanStart, Mark::ScanEnd] {
            cpu.trap(Pair::at(&built, mark), true);
        }
        let eval = Evaluator::new(program).expect("the evaluator knows it");
        let pins = pins(&ir);
        Ok(Pair { cpu, eval, built, ir, pins, scans: 0, first: 0 })
    }

    fn at(built: &Built, mark: Mark) -> u32 {
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
            let now = Time::at(self.cpu.cycle());
            self.cpu.drive(now, pin, Level::of(level));
        }
    }

    fn place(&self, name: &str) -> &Place {
        let bit = self.ir.bits.iter().position(|cell| cell.name == name).and_then(|n| self.built.bits.get(n));
        let word = || self.ir.words.iter().position(|cell| cell.name == name).and_then(|n| self.built.words.get(n));
        bit.or_else(word).unwrap_or_else(|| panic!("a place of {name}"))
    }

    /// Gives a symbol a value on both sides.
    pub fn set(&mut self, name: &str, value: i32) {
        let index = self.eval.index(name).expect("a symbol");
        self.eval.set(index, value);
        let (space, addr, bytes) = match self.place(name) {
            Place::Bit { space, addr, .. } => (space.clone(), *addr, 1),
            Place::Word { space, addr, bytes } => (space.clone(), *addr, *bytes),
        };
        for (addr, byte) in (addr..).zip(value.to_le_bytes()).take(bytes.into()) {
            assert!(self.cpu.poke(&space, addr, byte), "{space} {addr}");
        }
    }

    /// The value of a symbol on the machine.
    pub fn get(&self, name: &str) -> i32 {
        let peek = |space: &str, addr: u32| self.cpu.peek(space, addr).expect("a place in memory");
        match self.place(name) {
            Place::Bit { space, addr, .. } => peek(space, *addr).into(),
            Place::Word { space, addr, .. } => i16::from_le_bytes([peek(space, *addr), peek(space, addr + 1)]).into(),
        }
    }

    fn run_to(&mut self, mark: Mark, edges: &mut Edges) -> Result<(), String> {
        let at = Pair::at(&self.built, mark);
        loop {
            let limit = self.cpu.cycle() + 2 * self.built.period.num + 2000;
            match self.cpu.run(limit, edges) {
                Stop::Trap { pc } if pc == at => return Ok(()),
                // A machine that has settled halts where nothing is to come; but more is.
                Stop::Halted => self.cpu.drive(Time::at(limit), emu_ap101::chips::POWER, Level::High),
                stop => return Err(format!("{stop:?} at {}, wanted {mark:?}", self.cpu.pc())),
            }
        }
    }

    /// To the start of the next scan: it must come at its cycle, and pins must be as they were.
    pub fn begin(&mut self) -> Result<(), String> {
        let mut edges = Edges::default();
        self.run_to(Mark::ScanStart, &mut edges)?;
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

    /// The scan that has begun, to its end, and all that is compared then.
    pub fn end(&mut self) -> Result<(), String> {
        let start = self.cpu.cycle();
        self.eval.scan();
        let mut edges = Edges::default();
        self.run_to(Mark::ScanEnd, &mut edges)?;
        for pin in self.outputs() {
            if edges.0.iter().filter(|edge| **edge == pin).count() > 1 {
                return Err(format!("{} has changed more than once", TARGET.chip.pins[usize::from(pin)].name));
            }
        }
        let outputs = self.pins.iter().filter(|pin| pin.output).count() as u64;
        let took = self.cpu.cycle() + 1 + outputs - start;
        if took > self.built.worst {
            return Err(format!("a scan of {took} cycles, the longest is said to take {}", self.built.worst));
        }
        for (n, symbol) in self.eval.symbols().iter().enumerate() {
            let (wanted, found) = (self.eval.get(n), self.get(&symbol.name));
            if wanted != found {
                return Err(format!("{} is {found}, wanted {wanted}", symbol.name));
            }
            if symbol.kind == SymbolKind::Output {
                let pin = self.pin(&symbol.name).expect("an output has a channel");
                let level = self.cpu.level(pin);
                if level != Level::of(wanted != 0) {
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

    /// The instructions, a line each.
    pub fn listing(&self) -> String {
        self.built.lines.iter().map(|line| format!("{:4} {}\n", line.addr, line.text)).collect()
    }
}
