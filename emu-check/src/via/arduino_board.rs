//! Runs emitted Arduino sketches on the emulated ATmega328P: inputs are driven at the pins, outputs are read
//! from the pins, and all other state is found by the names of the sketch's objects.

use crate::chip::peripherals::{input_millivolts, reference_millivolts};
use diag::Diagnostic;
use emu_avr::Avr;
use emu_avr::chips::ATMEGA328P;
use emu_core::cpu::{Cpu, Probe, RamInit, StopReason};
use emu_core::image::{ElfMachine, Image};
use emu_core::pins::{ChipEvent, CycleTime, PinId, PinLevel};
use ladder::ChipPart;
use ladder_compile::emit::EmittedSource;
use ladder_compile::emit::arduino::{self, ArduinoSketch};

use super::codes;
use super::external_tools::{ScratchFolder, run_compiler, tool_error};
use super::recorded_stimulus::{RecordedScan, RecordedStimulus, SourceMismatch};
use super::script::ScanRecord;
use super::serve::load_compiled_image;
use crate::CheckError;

/// The script that compiles the Arduino core and a sketch.
const SCRIPT: &str = include_str!("arduino.sh");
/// The folder of the Arduino core in Debian.
const ARDUINO_CORE_FOLDER: &str = "/usr/share/arduino/hardware/arduino/avr";

/// Clock of the board in Hz.
const CLOCK_HZ: u64 = 16_000_000;
/// Tolerance of a scan start in machine cycles: one iteration of the wait, one step of `micros()`, and
/// interrupts.
const MAX_JITTER_CYCLES: u64 = 600;

/// Compiles sketches with the Arduino core.
pub(super) struct ArduinoBoard {
    scratch: ScratchFolder,
}

impl ArduinoBoard {
    /// Fails if the Arduino core is not installed.
    pub(super) fn new() -> Result<ArduinoBoard, Diagnostic> {
        let core = std::env::var("ARDUINO_AVR").unwrap_or_else(|_| ARDUINO_CORE_FOLDER.to_owned());
        if !std::path::Path::new(&core).join("cores/arduino/Arduino.h").exists() {
            let cause = format!("the core of the Arduino is not at {core}");
            let hint = "install it, on Debian with apt-get install arduino-core-avr, or set ARDUINO_AVR to its folder";
            return Err(tool_error(codes::NO_TOOL, cause, hint));
        }
        Ok(ArduinoBoard { scratch: ScratchFolder::new()? })
    }

    /// Compiles a sketch.
    pub(super) fn build(&self, source: &EmittedSource) -> Result<Image, Diagnostic> {
        self.scratch.write("arduino.sh", SCRIPT)?;
        self.scratch.write("sketch.ino", &source.text)?;
        let args = ["arduino.sh", "sketch.ino", "./sketch.elf"].map(str::to_owned);
        run_compiler("bash", "bash gcc-avr avr-libc arduino-core-avr", &args, &self.scratch)?;
        load_compiled_image(&self.scratch, "sketch.elf", &ATMEGA328P, ElfMachine::AVR)
    }
}

/// A probe that stops at the write of the last byte of `due`, and records the bytes sent.
struct DueProbe {
    due: u16,
    sent: Vec<u8>,
}

impl Probe for DueProbe {
    const DATA: bool = true;
    const EVENTS: bool = true;
    fn on_data_access(&mut self, _: u64, space: u8, addr: u16, _: u8, write: bool) -> bool {
        space == 0 && write && addr == self.due + 3
    }
    fn on_event(&mut self, event: ChipEvent) -> bool {
        if let ChipEvent::Sent { byte, .. } = event {
            self.sent.push(byte);
        }
        false
    }
}

/// A probe that adds up the cycles during which a pin is high.
struct HighTimeProbe {
    pin: PinId,
    since: Option<u64>,
    cycles: u64,
}

impl Probe for HighTimeProbe {
    const EVENTS: bool = true;
    fn on_event(&mut self, event: ChipEvent) -> bool {
        if let ChipEvent::Edge { at, pin, level } = event
            && pin == self.pin
        {
            let since = if level == PinLevel::High { self.since.or(Some(at.cycle)) } else { None };
            if let (Some(rising), None) = (self.since, since) {
                self.cycles += at.cycle.saturating_sub(rising);
            }
            self.since = since;
        }
        false
    }
}

/// A board that runs a sketch.
struct RunningSketch<'a> {
    cpu: Avr,
    watch: DueProbe,
    /// Program word of the function `micros`, which the sketch calls while it waits.
    micros: u32,
    /// Machine cycles from one scan to the next.
    period: u64,
    /// Frequency of the PWM output, if there is one.
    hertz: Option<u32>,
    sketch: &'a ArduinoSketch,
    /// Address of each cell in data memory.
    places: Vec<u32>,
}

/// Returns true if a byte on the serial line takes less than half a cycle of the program, so that it arrives
/// between two scans.
pub(super) fn receives_between_scans(program: &ladder::LadderProgram) -> bool {
    let bits = program.settings.baud.filter(|baud| *baud > 0).map(|baud| 10_000_000 / baud);
    bits.is_some_and(|us| us * 2 < program.settings.cycle_us)
}

/// Runs a recorded stimulus on the board. Returns the number of values compared, or the first mismatch.
pub(super) fn run_sketch(
    program: &ladder::LadderProgram,
    sketch: &ArduinoSketch,
    image: &Image,
    stimulus: &RecordedStimulus,
    hertz: Option<u32>,
) -> Result<Result<u64, SourceMismatch>, Diagnostic> {
    let mut compared = 0;
    let mut first = 0;
    for run in split_runs(&stimulus.scans) {
        let part = RecordedStimulus {
            scans: run.to_vec(),
            coverage: stimulus.coverage.clone(),
            names: stimulus.names.clone(),
        };
        let mismatch = |scan: usize, what: &str, expected: String, found: String| {
            Ok(Err(SourceMismatch { scan: first + scan, what: what.to_owned(), expected, found }))
        };
        let mut board = RunningSketch::start(program, sketch, image, run)?;
        board.hertz = hertz;
        let mut records = Vec::new();
        let mut first_start = None;
        for (scan, scan_stimulus) in run.iter().enumerate() {
            let at = match board.scan(program, scan_stimulus) {
                Ok(at) => at,
                Err(stop) => return mismatch(scan, "execution of the sketch", "a scan".to_owned(), stop.to_string()),
            };
            let zero = *first_start.get_or_insert(at);
            let expected = zero + scan as u64 * board.period;
            if at.abs_diff(expected) > MAX_JITTER_CYCLES {
                return mismatch(scan, "start of the scan in cycles", expected.to_string(), at.to_string());
            }
            records.push(board.read_record());
        }
        match part.compare(&sketch.source, &records, true) {
            Ok(more) => compared += more,
            Err(found) => return Ok(Err(SourceMismatch { scan: first + found.scan, ..found })),
        }
        // The last bytes may still be in transmission.
        let sent: Vec<u8> = run.iter().flat_map(|scan_stimulus| scan_stimulus.sent.iter().copied()).collect();
        let limit = board.cpu.cycle() + 3 * board.period + CLOCK_HZ * 30 / program.settings.baud.unwrap_or(9600).max(1);
        while board.cpu.cycle() < limit && board.cpu.run(limit, &mut board.watch) == StopReason::Probe {}
        if !board.watch.sent.starts_with(&sent) {
            return mismatch(run.len() - 1, "sent bytes", format!("{sent:?}"), format!("{:?}", board.watch.sent));
        }
        compared += 1 + run.len() as u64;
        first += run.len();
    }
    Ok(Ok(compared))
}

/// Splits the scans at the starts of runs.
fn split_runs(scans: &[RecordedScan]) -> impl Iterator<Item = &[RecordedScan]> {
    scans.chunk_by(|_, next| next.run_seed.is_none())
}

impl<'a> RunningSketch<'a> {
    /// Starts a board and runs `setup`, until it waits for its first scan.
    fn start(
        program: &ladder::LadderProgram,
        sketch: &'a ArduinoSketch,
        image: &Image,
        scans: &[RecordedScan],
    ) -> Result<RunningSketch<'a>, Diagnostic> {
        let find = |name: &str| {
            let symbol = image.symbols.iter().find(|symbol| symbol.name == name);
            symbol.map(|symbol| symbol.addr).ok_or_else(|| {
                let cause = format!("the sketch's image has no symbol `{name}`");
                tool_error(codes::TOOL_FAILED, cause, "please report this with the program")
            })
        };
        let first = scans.first();
        let seed = first.and_then(|scan_stimulus| scan_stimulus.run_seed).unwrap_or(0);
        let mut cpu = Avr::new(&ATMEGA328P, image, RamInit::Random(seed));
        cpu.set_clock_hz(CLOCK_HZ);
        let cells = first.map_or(&[][..], |scan_stimulus| scan_stimulus.eeprom_before.as_slice());
        (0..).zip(cells).for_each(|(addr, byte)| _ = cpu.poke("eeprom", addr, *byte));
        let object = |text: &str| find(text.split('.').next().unwrap_or(text));
        let places = sketch.source.cells.iter().map(|cell| object(&cell.text)).collect::<Result<_, _>>()?;
        let mut sketch_run = RunningSketch {
            cpu,
            watch: DueProbe { due: find("due")? as u16, sent: Vec::new() },
            micros: find("micros")? / 2,
            period: program.settings.cycle_us * (CLOCK_HZ / 1_000_000),
            hertz: None,
            sketch,
            places,
        };
        sketch_run.idle_receiver(true);
        // `due` is written twice: cleared together with all of RAM, and set from the time that `setup` reads
        // last. Then the first wait begins.
        sketch_run.pull_up_buses(program);
        let reached = sketch_run.run_to_due().and_then(|_| sketch_run.run_to_wait());
        let reached = reached.and_then(|()| sketch_run.run_to_due()).and_then(|_| sketch_run.run_to_wait());
        reached.map_err(|stop| {
            tool_error(codes::STOPPED, format!("`setup` does not end: {stop}"), "report this with the program")
        })?;
        Ok(sketch_run)
    }

    /// Drives the receiver's line to its idle level, unless the sketch uses the pin.
    fn idle_receiver(&mut self, level: bool) {
        let now = CycleTime::at(self.cpu.cycle());
        if let Some(pin) = self.cpu.chip().pin("PD0")
            && !self.sketch.pins.iter().any(|pin| pin.pin == "PD0")
        {
            self.cpu.drive(now, pin, PinLevel::from_bit(level));
        }
    }

    /// Puts resistors at the lines of the buses that the program uses; no device is there.
    fn pull_up_buses(&mut self, program: &ladder::LadderProgram) {
        let uses = |part| program.uses_part(part);
        let lines = [(uses(ChipPart::I2c), "PC4"), (uses(ChipPart::I2c), "PC5"), (uses(ChipPart::Spi), "PB4")];
        for (_, name) in lines.into_iter().filter(|line| line.0) {
            let pin = self.cpu.chip().pin(name);
            pin.into_iter().for_each(|pin| self.cpu.drive(CycleTime::at(0), pin, PinLevel::PullUp));
        }
    }

    fn cycle_limit(&self) -> u64 {
        self.cpu.cycle() + 4 * self.period + CLOCK_HZ / 10
    }

    fn stopped(&self, stop: StopReason) -> CheckError {
        CheckError::SketchStopped { stop, address: 2 * self.cpu.pc() }
    }

    /// Runs until `due` has been written, which is the start of a scan.
    fn run_to_due(&mut self) -> Result<u64, CheckError> {
        match self.cpu.run(self.cycle_limit(), &mut self.watch) {
            StopReason::Probe => Ok(self.cpu.cycle()),
            stop => Err(self.stopped(stop)),
        }
    }

    /// Runs until the sketch reads the time, which it does only between scans.
    fn run_to_wait(&mut self) -> Result<(), CheckError> {
        self.cpu.set_breakpoint(self.micros, true);
        let stop = self.cpu.run(self.cycle_limit(), &mut self.watch);
        self.cpu.set_breakpoint(self.micros, false);
        if stop == (StopReason::Breakpoint { pc: self.micros }) { Ok(()) } else { Err(self.stopped(stop)) }
    }

    fn pin(&self, name: &str) -> Option<PinId> {
        let pin = self.sketch.pins.iter().find(|pin| pin.name == name)?;
        self.cpu.chip().pin(pin.pin)
    }

    /// Runs one scan and returns the cycle in which it began.
    fn scan(&mut self, program: &ladder::LadderProgram, scan_stimulus: &RecordedScan) -> Result<u64, CheckError> {
        let now = CycleTime::at(self.cpu.cycle());
        for (name, on) in &scan_stimulus.inputs {
            self.pin(name).into_iter().for_each(|pin| self.cpu.drive(now, pin, PinLevel::from_bit(*on)));
        }
        for (name, value) in &scan_stimulus.analog {
            let reference = reference_millivolts(program, self.cpu.chip(), name);
            let millivolts = input_millivolts(*value, reference);
            self.pin(name).into_iter().for_each(|pin| _ = self.cpu.drive_volts(now, pin, millivolts));
        }
        if let (Some(byte), Some(pin), Some(baud)) =
            (scan_stimulus.byte, self.cpu.chip().pin("PD0"), program.settings.baud)
        {
            // The line is idle for one bit first: a receiver that has just been enabled must see a high
            // level.
            let frame = u16::from(byte) << 2 | 0x401;
            for bit in 0..11 {
                let at = self.cpu.cycle() + 16 + CLOCK_HZ * bit / baud.max(1);
                self.cpu.drive(CycleTime::at(at), pin, PinLevel::from_bit(frame >> bit & 1 == 1));
            }
        }
        for (name, value) in &scan_stimulus.writes {
            let cell = self.sketch.source.cells.iter().position(|cell| cell.is_symbol && cell.name == *name);
            if let Some((cell, at)) = cell.and_then(|n| Some((self.sketch.source.cells.get(n)?, *self.places.get(n)?)))
            {
                let bytes = cell.bytes.map_or(1, stored_bytes);
                for (at, byte) in (at..).zip(value.to_le_bytes()).take(bytes) {
                    self.cpu.poke("data", at, byte);
                }
            }
        }
        let at = self.run_to_due()?;
        self.run_to_wait()?;
        Ok(at)
    }

    /// The duty cycle at the pin in percent, measured on a copy of the board over the next full period.
    /// `None` without a PWM output, and if two periods do not fit between two scans.
    fn measured_duty(&self) -> Option<u8> {
        let period = CLOCK_HZ / u64::from(self.hertz?).max(1);
        let pin = self.cpu.chip().pin(arduino::ARDUINO_BOARD.pwm.first()?.pin)?;
        if period * 5 > self.period * 2 {
            return None;
        }
        let mut cpu = self.cpu.clone();
        let from = cpu.cycle() + period;
        while cpu.cycle() < from && cpu.run(from, &mut ()) != StopReason::Limit {}
        let mut high =
            HighTimeProbe { pin, since: (cpu.pin_level(pin) == PinLevel::High).then_some(cpu.cycle()), cycles: 0 };
        let (from, to) = (cpu.cycle(), cpu.cycle() + period);
        while cpu.cycle() < to && cpu.run(to, &mut high) != StopReason::Limit {}
        let cycles = high.cycles + high.since.map_or(0, |since| to.saturating_sub(since));
        Some(((cycles * 100 + period / 2) / (to - from)).min(100) as u8)
    }

    /// The state between two scans.
    fn read_record(&self) -> ScanRecord {
        let byte = |at: u32| self.cpu.peek("data", at).unwrap_or(0);
        let source = &self.sketch.source;
        let cell = |(cell, at): (&ladder_compile::emit::SourceCell, &u32)| match cell.bytes.map(stored_bytes) {
            None => i32::from(byte(*at)),
            Some(1) => i32::from(byte(*at) as i8),
            Some(2) => i32::from(i16::from_le_bytes([byte(*at), byte(at + 1)])),
            Some(_) => i32::from_le_bytes([byte(*at), byte(at + 1), byte(at + 2), byte(at + 3)]),
        };
        let level = |name: &String| self.pin(name).is_some_and(|pin| self.cpu.pin_level(pin) == PinLevel::High);
        ScanRecord {
            buses: 0,
            cells: source.cells.iter().zip(&self.places).map(cell).collect(),
            outputs: source.outputs.iter().map(level).collect(),
            sent: (0, 0),
            duty: self.measured_duty(),
            eeprom: (0..u32::from(source.eeprom)).map(|at| self.cpu.peek("eeprom", at).unwrap_or(0)).collect(),
        }
    }
}

/// Bytes that a number of `bytes` bytes takes in memory.
fn stored_bytes(bytes: u8) -> usize {
    match bytes {
        1 => 1,
        2 => 2,
        _ => 4,
    }
}
