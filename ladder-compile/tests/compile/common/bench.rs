//! Intermediate code as an image on an emulated chip, scan by scan against the interpreter: every cell that lasts, every
//! output pin, what is sent, what the EEPROM holds.
//!
//! ```ignore
//! let ir = random(&mut Rng::new(seed), Wish::WORDS);
//! Bench { target, clock_hz: 16_000_000, cycle_us: 50_000, baud: None }
//!     .run(&ir, seed, 30, Avr::new)
//!     .unwrap_or_else(|why| panic!("seed {seed}: {why}"));
//! ```

use emu_core::image::Image;
use emu_core::rng::Rng;
use emu_core::{Cpu, Event, Level, PinId, Probe, RamInit, Stop, Time};
use ladder_compile::Place;
use ladder_compile::ir::{BitRole, Ir, WordRole};
use ladder_compile::pins::Pin;
use ladder_compile::target::{Built, Job, Mark, Refusal, Target};

use super::ir::interp::{Machine, boundary, keep};

/// A chip and its times.
#[derive(Debug, Clone, Copy)]
pub struct Bench {
    pub target: &'static Target,
    pub clock_hz: u64,
    pub cycle_us: u64,
    pub baud: Option<u64>,
}

/// Why a run is no success.
#[derive(Debug)]
pub enum Failed {
    /// There is no image: not a fault by itself.
    Refused(Refusal),
    /// The chip does otherwise than the code says.
    Differs(String),
}

impl From<String> for Failed {
    fn from(how: String) -> Failed {
        Failed::Differs(how)
    }
}

impl std::fmt::Display for Failed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Failed::Refused(refusal) => write!(f, "refused: {refusal:?}"),
            Failed::Differs(how) => write!(f, "{how}"),
        }
    }
}

/// Bytes that the first serial port has sent.
#[derive(Default)]
struct Line(Vec<u8>);

impl Probe for Line {
    const EVENTS: bool = true;

    fn event(&mut self, event: Event) -> bool {
        if let Event::Sent { byte, .. } = event {
            self.0.push(byte);
        }
        false
    }
}

/// Pins for the inputs, outputs and analog inputs of a program: those of the converter first, then in the target's order.
pub fn pins(ir: &Ir, target: &'static Target) -> Vec<Pin> {
    let mut taken: Vec<&str> = Vec::new();
    taken.extend(target.uart.filter(|_| ir.uart.send).map(|(transmit, _)| transmit));
    taken.extend(target.uart.filter(|_| ir.uart.receive).map(|(_, receive)| receive));
    taken.extend(target.pwm.filter(|_| ir.pwm_hz.is_some()));
    let mut pins = Vec::new();
    for name in &ir.adcs {
        let pin = target.adc.iter().map(|&(pin, _)| pin).find(|pin| !taken.contains(pin)).expect("an analog pin");
        taken.push(pin);
        pins.push(Pin { name: name.clone(), pin, output: false, analog: true });
    }
    for cell in ir.bits.iter().filter(|cell| matches!(cell.role, BitRole::Input | BitRole::Output)) {
        let output = cell.role == BitRole::Output;
        let usable = |pin: &&str| !taken.contains(pin) && target.can_be(pin, output);
        let pin = target.pins.iter().copied().find(usable).expect("a pin");
        taken.push(pin);
        pins.push(Pin { name: cell.name.clone(), pin, output, analog: false });
    }
    pins
}

impl Bench {
    /// Builds `ir`.
    pub fn build(&self, ir: &Ir) -> Result<Built, Refusal> {
        let Bench { target, clock_hz, cycle_us, baud } = *self;
        let pins = pins(ir, target);
        (target.build)(&Job { ir, target, pins: &pins, clock_hz, cycle_us, baud })
    }

    /// Builds `ir` and runs it for `scans` scans with inputs and cells drawn from `seed`. Returns the longest scan seen, in
    /// machine cycles from its first instruction back to the wait.
    pub fn run<C: Cpu>(
        &self,
        ir: &Ir,
        seed: u64,
        scans: u32,
        power_up: impl FnOnce(&'static emu_core::Chip, &Image, RamInit) -> C,
    ) -> Result<u64, Failed> {
        let built = self.build(ir).map_err(Failed::Refused)?;
        let differs = |how: String| Err(Failed::Differs(how));
        if built.worst + built.poll > built.shortest {
            return differs(format!("a scan of up to {} cycles in {}", built.worst + built.poll, built.shortest));
        }
        let segments: Vec<(u32, &[u8])> = built.segments.iter().map(|(at, bytes)| (*at, &bytes[..])).collect();
        let hex = emu_core::image::write_hex(&segments);
        let chip = self.target.chip;
        let image = emu_core::image::load_hex("image", hex.as_bytes(), chip.hex).expect("a sound image").image;
        let mut run = Run {
            cpu: power_up(chip, &image, RamInit::Random(seed)),
            line: Line::default(),
            built: &built,
            pins: pins(ir, self.target),
        };
        let mut model = Machine::new(ir);
        let mut rng = Rng::new(seed ^ 0x5CA9);
        let cells = chip.spaces.iter().find(|(name, ..)| *name == "eeprom").map_or(0, |&(_, cells, _)| cells);
        for addr in 0..u32::from(ir.eeprom) {
            if !run.cpu.poke("eeprom", addr, 0xFF) {
                return differs(format!("no EEPROM cell {addr} of {cells}"));
            }
        }
        let mut longest = 0;
        let mut sent: Vec<u8> = Vec::new();
        for scan in 1..=scans {
            run.inputs(ir, &mut model, &mut rng);
            run.to(Mark::ScanStart)?;
            let start = run.cpu.cycle();
            run.outputs(ir, &model).map_err(|how| format!("before scan {scan}: {how}"))?;
            if scan > 1 || rng.one_in(2) {
                run.cells(ir, &mut model, &mut rng);
            }
            let before = model.clone();
            model.scan();
            run.to(Mark::ScanEnd)?;
            run.compare(ir, &model)
                .map_err(|how| format!("scan {scan}: {how}\nbefore: {:?}\n{:?}\n{ir}", before.bits, before.words))?;
            if built.marks.iter().any(|(mark, _)| *mark == Mark::Poll) {
                run.to(Mark::Poll)?;
            }
            let took = run.cpu.cycle() - start;
            if took > built.worst {
                return differs(format!(
                    "scan {scan} took {took} cycles, the longest is said to take {}\n{ir}",
                    built.worst
                ));
            }
            longest = longest.max(took);
            sent.append(&mut model.sent);
        }
        // What was sent last is still on its way.
        let late = run.cpu.cycle() + 2 * built.shortest;
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

impl Machine<'_> {
    /// No write of the EEPROM is under way.
    fn word_is_free(&self, ir: &Ir) -> bool {
        ir.words.iter().position(|cell| cell.name == "eebusy").is_none_or(|n| self.words[n] == 0)
    }
}

struct Run<'a, C> {
    cpu: C,
    line: Line,
    built: &'a Built,
    pins: Vec<Pin>,
}

impl<C: Cpu> Run<'_, C> {
    /// Runs until the instruction at a mark is next.
    fn to(&mut self, mark: Mark) -> Result<(), String> {
        let at = self.built.marks.iter().find(|(m, _)| *m == mark).map(|&(_, at)| at);
        let at = at.ok_or_else(|| format!("no mark {mark:?}"))?;
        self.cpu.trap(at, true);
        let limit = self.cpu.cycle() + 4 * self.built.shortest + 1_000_000;
        let stop = loop {
            let stop = self.cpu.run(limit, &mut self.line);
            // A run that has not moved yet may stop at the trap under it; others stop for the test's probe.
            if self.cpu.pc() == at || self.cpu.cycle() >= limit || !matches!(stop, Stop::Trap { .. } | Stop::Probe) {
                break stop;
            }
        };
        self.cpu.trap(at, false);
        if self.cpu.pc() == at { Ok(()) } else { Err(format!("{stop:?} before {mark:?}")) }
    }

    fn pin(&self, name: &str) -> PinId {
        let pin = self.pins.iter().find(|pin| pin.name == name).expect("a pin of the program");
        self.cpu.chip().pin(pin.pin).expect("a pin of the chip")
    }

    /// Draws the inputs of the next scan and drives them.
    fn inputs(&mut self, ir: &Ir, model: &mut Machine<'_>, rng: &mut Rng) {
        for (n, cell) in ir.bits.iter().enumerate().filter(|(_, cell)| cell.role == BitRole::Input) {
            model.bits[n] = rng.one_in(2);
            let now = Time::at(self.cpu.cycle());
            let pin = self.pin(&cell.name);
            self.cpu.drive(now, pin, Level::of(model.bits[n]));
        }
        for (n, name) in ir.adcs.iter().enumerate() {
            model.adc[n] = match rng.below(4) {
                0 => 0,
                1 => 1023,
                _ => rng.below(1024) as u16,
            };
            // The middle of the step, with 5 V as reference.
            let millivolts = (u32::from(model.adc[n]) * 2 + 1) * 5000 / 2048;
            let now = Time::at(self.cpu.cycle());
            let pin = self.pin(name);
            assert!(self.cpu.drive_volts(now, pin, millivolts), "{name} takes a voltage");
        }
    }

    /// Writes cells at random, as a checker does between scans.
    fn cells(&mut self, ir: &Ir, model: &mut Machine<'_>, rng: &mut Rng) {
        for (n, cell) in ir.bits.iter().enumerate() {
            if matches!(cell.role, BitRole::Relay | BitRole::Memory | BitRole::Output) && rng.one_in(3) {
                model.bits[n] = rng.one_in(2);
                let value = model.bits[n];
                self.poke(&self.built.bits[n], value.into());
            }
        }
        for (n, cell) in ir.words.iter().enumerate() {
            if matches!(cell.role, WordRole::Symbol(_)) && rng.one_in(3) {
                model.words[n] = boundary(rng, cell.bytes);
                self.poke(&self.built.words[n], model.words[n]);
            }
        }
    }

    fn poke(&mut self, place: &Place, value: i32) {
        match place {
            Place::Bit { space, addr, bit } => {
                let old = self.cpu.peek(space, *addr).expect("a place in memory");
                assert!(self.cpu.poke(space, *addr, old & !(1 << bit) | (value as u8 & 1) << bit));
            }
            Place::Word { space, addr, bytes } => {
                for (addr, byte) in (*addr..).zip(value.to_le_bytes()).take((*bytes).into()) {
                    assert!(self.cpu.poke(space, addr, byte), "{space} {addr:#x}");
                }
            }
        }
    }

    fn peek(&self, place: &Place) -> i32 {
        match place {
            Place::Bit { space, addr, bit } => i32::from(self.cpu.peek(space, *addr).expect("a place") >> bit & 1),
            Place::Word { space, addr, bytes } => {
                let byte = |n: u8| i64::from(self.cpu.peek(space, addr + u32::from(n)).expect("a place"));
                keep((0..*bytes).rev().fold(0, |value, n| value << 8 | byte(n)), *bytes)
            }
        }
    }

    /// The cells that last are those of the model.
    fn compare(&self, ir: &Ir, model: &Machine<'_>) -> Result<(), String> {
        let bits = ir.bits.iter().zip(&self.built.bits).zip(model.bits.iter().map(|bit| i32::from(*bit)));
        let lasting = bits.filter(|((cell, _), _)| cell.role != BitRole::Temporary).map(|((c, p), v)| (&c.name, p, v));
        let words = ir.words.iter().zip(&self.built.words).zip(model.words.iter().copied());
        let words = words.filter(|((cell, _), _)| cell.role != WordRole::Temporary).map(|((c, p), v)| (&c.name, p, v));
        for (name, place, wanted) in lasting.chain(words) {
            let found = self.peek(place);
            if found != wanted {
                return Err(format!("{name} is {found}, wanted {wanted}"));
            }
        }
        Ok(())
    }

    /// The output pins are those of the last scan. An open drain that is high is held by a resistor outside.
    fn outputs(&self, ir: &Ir, model: &Machine<'_>) -> Result<(), String> {
        for (n, cell) in ir.bits.iter().enumerate().filter(|(_, cell)| cell.role == BitRole::Output) {
            let level = self.cpu.level(self.pin(&cell.name));
            let wrong = if model.bits[n] { level == Level::Low } else { level != Level::Low };
            if wrong {
                return Err(format!("pin of {} is {level:?}, wanted {}", cell.name, u8::from(model.bits[n])));
            }
        }
        Ok(())
    }
}
