//! Runs intermediate code as an image on an emulated chip, and compares it with the interpreter scan by scan.
//!
//! The bench compares every lasting cell, every output pin, the bytes sent and the content of the EEPROM.
//!
//! ```ignore
//! let ir = random_ir(&mut Rng::new(seed), IrLimits::WORDS);
//! ImageBench { target, clock_hz: 16_000_000, cycle_us: 50_000, baud: None }
//!     .run(&ir, seed, 30, Avr::new)
//!     .unwrap_or_else(|why| panic!("seed {seed}: {why}"));
//! ```

use emu_core::image::Image;
use emu_core::rng::Rng;
use emu_core::{ChipEvent, Cpu, CycleTime, PinId, PinLevel, Probe, RamInit, StopReason};
use ladder_compile::CellLocation;
use ladder_compile::ir::{BitRole, Ir, WordRole};
use ladder_compile::pins::AssignedPin;
use ladder_compile::target::{BuildRefusal, BuiltImage, CodeMark, CompileJob, CompileTarget};

use super::ir::interp::{IrInterpreter, boundary_value, truncate_to_bytes};

/// A target chip with clock in Hz, cycle in microseconds and baud rate.
#[derive(Debug, Clone, Copy)]
pub struct ImageBench {
    pub target: &'static CompileTarget,
    pub clock_hz: u64,
    pub cycle_us: u64,
    pub baud: Option<u64>,
}

/// Reason for which a run fails.
#[derive(Debug)]
pub enum RunFailure {
    /// There is no image, which is not necessarily an error.
    Refused(BuildRefusal),
    /// The chip behaves differently from the intermediate code.
    Differs(String),
}

impl From<String> for RunFailure {
    fn from(how: String) -> RunFailure {
        RunFailure::Differs(how)
    }
}

impl std::fmt::Display for RunFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            RunFailure::Refused(refusal) => write!(f, "refused: {refusal:?}"),
            RunFailure::Differs(how) => write!(f, "{how}"),
        }
    }
}

/// Bytes that the first serial port has sent.
#[derive(Default)]
struct SentBytes(Vec<u8>);

impl Probe for SentBytes {
    const EVENTS: bool = true;

    fn on_event(&mut self, event: ChipEvent) -> bool {
        if let ChipEvent::Sent { byte, .. } = event {
            self.0.push(byte);
        }
        false
    }
}

/// Pins of the inputs, outputs and analog inputs of a program: analog ones first, then in the order of the
/// target.
pub fn pins(ir: &Ir, target: &'static CompileTarget) -> Vec<AssignedPin> {
    let mut taken: Vec<&str> = Vec::new();
    taken.extend(target.uart.filter(|_| ir.uart.send).map(|(transmit, _)| transmit));
    taken.extend(target.uart.filter(|_| ir.uart.receive).map(|(_, receive)| receive));
    taken.extend(target.pwm.first().filter(|_| !ir.pwms.is_empty()).map(|at| at.pin));
    let mut pins = Vec::new();
    for name in &ir.adcs {
        let pin = target.adc.iter().map(|&(pin, _)| pin).find(|pin| !taken.contains(pin)).expect("an analog pin");
        taken.push(pin);
        pins.push(AssignedPin { name: name.clone(), pin, output: false, analog: true });
    }
    for cell in ir.bits.iter().filter(|cell| matches!(cell.role, BitRole::Input | BitRole::Output)) {
        let output = cell.role == BitRole::Output;
        let usable = |pin: &&str| !taken.contains(pin) && target.can_use_pin(pin, output);
        let pin = target.pins.iter().copied().find(usable).expect("a pin");
        taken.push(pin);
        pins.push(AssignedPin { name: cell.name.clone(), pin, output, analog: false });
    }
    pins
}

impl ImageBench {
    /// Builds an image of `ir`.
    pub fn build(&self, ir: &Ir) -> Result<BuiltImage, BuildRefusal> {
        let ImageBench { target, clock_hz, cycle_us, baud } = *self;
        let pins = pins(ir, target);
        (target.build)(&CompileJob { ir, target, pins: &pins, pwm_pins: &[], clock_hz, cycle_us, baud })
    }

    /// Builds `ir` and runs `scans` scans with inputs and cells drawn from `seed`.
    ///
    /// Returns the longest scan in machine cycles, from its first instruction back to the poll loop.
    pub fn run<C: Cpu>(
        &self,
        ir: &Ir,
        seed: u64,
        scans: u32,
        power_up: impl FnOnce(&'static emu_core::Chip, &Image, RamInit) -> C,
    ) -> Result<u64, RunFailure> {
        let built = self.build(ir).map_err(RunFailure::Refused)?;
        let differs = |how: String| Err(RunFailure::Differs(how));
        if built.worst_scan_cycles + built.poll_cycles > built.shortest_period_cycles {
            return differs(format!(
                "a scan of up to {} cycles in {}",
                built.worst_scan_cycles + built.poll_cycles,
                built.shortest_period_cycles
            ));
        }
        let segments: Vec<_> =
            built.segments.iter().map(|(at, bytes)| emu_core::image::HexSegment { addr: *at, bytes }).collect();
        let hex = emu_core::image::write_hex(&segments);
        let chip = self.target.chip;
        let image = emu_core::image::load_hex("image", hex.as_bytes(), chip.hex_spaces).expect("a sound image").image;
        let mut run = BenchRun {
            cpu: power_up(chip, &image, RamInit::Random(seed)),
            line: SentBytes::default(),
            built: &built,
            pins: pins(ir, self.target),
        };
        let mut model = IrInterpreter::new(ir);
        let mut rng = Rng::new(seed ^ 0x5CA9);
        let cells = chip.space("eeprom").map_or(0, |space| space.size);
        for addr in 0..u32::from(ir.eeprom_bytes) {
            if !run.cpu.poke("eeprom", addr, 0xFF) {
                return differs(format!("no EEPROM cell {addr} of {cells}"));
            }
        }
        let mut longest = 0;
        let mut sent: Vec<u8> = Vec::new();
        for scan in 1..=scans {
            run.inputs(ir, &mut model, &mut rng);
            run.run_to_mark(CodeMark::ScanStart)?;
            let start = run.cpu.cycle();
            run.outputs(ir, &model).map_err(|how| format!("before scan {scan}: {how}"))?;
            if scan > 1 || rng.one_in(2) {
                run.cells(ir, &mut model, &mut rng);
            }
            let before = model.clone();
            model.scan();
            run.run_to_mark(CodeMark::ScanEnd)?;
            run.compare(ir, &model)
                .map_err(|how| format!("scan {scan}: {how}\nbefore: {:?}\n{:?}\n{ir}", before.bits, before.words))?;
            if built.marks.iter().any(|(mark, _)| *mark == CodeMark::PollLoop) {
                run.run_to_mark(CodeMark::PollLoop)?;
            }
            let took = run.cpu.cycle() - start;
            if took > built.worst_scan_cycles {
                return differs(format!(
                    "scan {scan} took {took} cycles, the longest is said to take {}\n{ir}",
                    built.worst_scan_cycles
                ));
            }
            longest = longest.max(took);
            sent.append(&mut model.sent);
        }
        // The last byte may still be in transmission.
        let late = run.cpu.cycle() + 2 * built.shortest_period_cycles;
        run.cpu.run(late, &mut run.line);
        if !run.line.0.starts_with(&sent) {
            return differs(format!("sent {:?}, wanted {sent:?}\n{ir}", run.line.0));
        }
        for (addr, byte) in model.eeprom.iter().enumerate() {
            let found = run.cpu.peek("eeprom", addr as u32);
            if scans > 0 && found != Some(*byte) && model.word_is_free(ir) {
                return differs(format!("EEPROM cell {addr} is {found:?}, wanted {byte}\n{ir}"));
            }
        }
        Ok(longest)
    }
}

impl IrInterpreter<'_> {
    /// True if no EEPROM write is in progress.
    fn word_is_free(&self, ir: &Ir) -> bool {
        ir.words.iter().position(|cell| cell.name == "eebusy").is_none_or(|n| self.words[n] == 0)
    }
}

struct BenchRun<'a, C> {
    cpu: C,
    line: SentBytes,
    built: &'a BuiltImage,
    pins: Vec<AssignedPin>,
}

impl<C: Cpu> BenchRun<'_, C> {
    /// Runs until the instruction at a mark is next.
    fn run_to_mark(&mut self, mark: CodeMark) -> Result<(), String> {
        let at = self.built.marks.iter().find(|(m, _)| *m == mark).map(|&(_, at)| at);
        let at = at.ok_or_else(|| format!("no mark {mark:?}"))?;
        self.cpu.set_breakpoint(at, true);
        let limit = self.cpu.cycle() + 4 * self.built.shortest_period_cycles + 1_000_000;
        let stop = loop {
            let stop = self.cpu.run(limit, &mut self.line);
            // A run that starts on the breakpoint may stop without moving; others stop because of the probe.
            if self.cpu.pc() == at
                || self.cpu.cycle() >= limit
                || !matches!(stop, StopReason::Breakpoint { .. } | StopReason::Probe)
            {
                break stop;
            }
        };
        self.cpu.set_breakpoint(at, false);
        if self.cpu.pc() == at { Ok(()) } else { Err(format!("{stop:?} before {mark:?}")) }
    }

    fn pin(&self, name: &str) -> PinId {
        let pin = self.pins.iter().find(|pin| pin.name == name).expect("a pin of the program");
        self.cpu.chip().pin(pin.pin).expect("a pin of the chip")
    }

    /// Draws the inputs of the next scan and drives them.
    fn inputs(&mut self, ir: &Ir, model: &mut IrInterpreter<'_>, rng: &mut Rng) {
        for (n, cell) in ir.bits.iter().enumerate().filter(|(_, cell)| cell.role == BitRole::Input) {
            model.bits[n] = rng.one_in(2);
            let now = CycleTime::at(self.cpu.cycle());
            let pin = self.pin(&cell.name);
            self.cpu.drive(now, pin, PinLevel::from_bit(model.bits[n]));
        }
        for (n, name) in ir.adcs.iter().enumerate() {
            model.adc[n] = match rng.below(4) {
                0 => 0,
                1 => 1023,
                _ => rng.below(1024) as u16,
            };
            // The middle of the step, with 5 V as reference.
            let millivolts = (u32::from(model.adc[n]) * 2 + 1) * 5000 / 2048;
            let now = CycleTime::at(self.cpu.cycle());
            let pin = self.pin(name);
            assert!(self.cpu.drive_volts(now, pin, millivolts), "{name} takes a voltage");
        }
    }

    /// Writes random cells between scans, as the checker does.
    fn cells(&mut self, ir: &Ir, model: &mut IrInterpreter<'_>, rng: &mut Rng) {
        for (n, cell) in ir.bits.iter().enumerate() {
            if matches!(cell.role, BitRole::Relay | BitRole::Memory | BitRole::Output) && rng.one_in(3) {
                model.bits[n] = rng.one_in(2);
                let value = model.bits[n];
                self.poke(&self.built.bit_places[n], value.into());
            }
        }
        for (n, cell) in ir.words.iter().enumerate() {
            if matches!(cell.role, WordRole::Symbol(_)) && rng.one_in(3) {
                model.words[n] = boundary_value(rng, cell.bytes);
                self.poke(&self.built.word_places[n], model.words[n]);
            }
        }
    }

    fn poke(&mut self, place: &CellLocation, value: i32) {
        match place {
            CellLocation::Bit { space, addr, bit } => {
                let old = self.cpu.peek(space, *addr).expect("a place in memory");
                assert!(self.cpu.poke(space, *addr, old & !(1 << bit) | (value as u8 & 1) << bit));
            }
            CellLocation::Word { space, addr, bytes } => {
                for (addr, byte) in (*addr..).zip(value.to_le_bytes()).take((*bytes).into()) {
                    assert!(self.cpu.poke(space, addr, byte), "{space} {addr:#x}");
                }
            }
        }
    }

    fn peek(&self, place: &CellLocation) -> i32 {
        match place {
            CellLocation::Bit { space, addr, bit } => {
                i32::from(self.cpu.peek(space, *addr).expect("a place") >> bit & 1)
            }
            CellLocation::Word { space, addr, bytes } => {
                let byte = |n: u8| i64::from(self.cpu.peek(space, addr + u32::from(n)).expect("a place"));
                truncate_to_bytes((0..*bytes).rev().fold(0, |value, n| value << 8 | byte(n)), *bytes)
            }
        }
    }

    /// Compares the lasting cells with those of the interpreter.
    fn compare(&self, ir: &Ir, model: &IrInterpreter<'_>) -> Result<(), String> {
        let bits = ir.bits.iter().zip(&self.built.bit_places).zip(model.bits.iter().map(|bit| i32::from(*bit)));
        let lasting = bits.filter(|((cell, _), _)| cell.role != BitRole::Temporary).map(|((c, p), v)| (&c.name, p, v));
        let words = ir.words.iter().zip(&self.built.word_places).zip(model.words.iter().copied());
        let words = words.filter(|((cell, _), _)| cell.role != WordRole::Temporary).map(|((c, p), v)| (&c.name, p, v));
        for (name, place, wanted) in lasting.chain(words) {
            let found = self.peek(place);
            if found != wanted {
                return Err(format!("{name} is {found}, wanted {wanted}"));
            }
        }
        Ok(())
    }

    /// Compares the output pins with the last scan. A high output must only not be low, because of open
    /// drains.
    fn outputs(&self, ir: &Ir, model: &IrInterpreter<'_>) -> Result<(), String> {
        for (n, cell) in ir.bits.iter().enumerate().filter(|(_, cell)| cell.role == BitRole::Output) {
            let level = self.cpu.pin_level(self.pin(&cell.name));
            let wrong = if model.bits[n] { level == PinLevel::Low } else { level != PinLevel::Low };
            if wrong {
                return Err(format!("pin of {} is {level:?}, wanted {}", cell.name, u8::from(model.bits[n])));
            }
        }
        Ok(())
    }
}
