//! Runs the chip and the evaluator in lockstep, scan by scan, and defines what is compared when.

use emu_core::cpu::{ProgramError, StopReason};
use emu_core::pins::PinLevel;
use ladder::SymbolKind;
use ladder_eval::Evaluator;

use crate::chip::deviation::Deviation;
use crate::chip::families::CheckedChip;
use crate::chip::pin_behaviour;
use crate::chip::program_places::{ProgramPlaces, ScanPoint};
use crate::chip::runner::{ChipRunner, LostSync, StackChange};
use crate::comparison::peripheral_lines::{PeripheralLines, compare_buses};
use crate::coverage::goals::EvaluatedScan;
use crate::report::check_report::DifferenceKind;
use crate::stimulus::generator::ScanStimulus;
use crate::stimulus::stimulus_symbols::StimulusSymbols;

/// The parts from which a [`LockstepPair`] is made: a source of powered-up chips, and the evaluator at
/// power-up.
pub(crate) struct TestBench<'a, C, F: Fn(u64) -> C> {
    /// Makes a chip in its power-up state with the image loaded and RAM contents from the given seed.
    pub power_up: F,
    /// Where the program's symbols are on the chip.
    pub places: &'a ProgramPlaces,
    /// The symbols that the stimulus sets.
    pub stimulus_symbols: &'a StimulusSymbols,
    /// Machine cycles of the longest scan, as computed by the compiler.
    pub worst_scan_cycles: u64,
    /// Whether the rungs are timed.
    pub time_rungs: bool,
    /// The evaluator at power-up.
    pub eval: &'a Evaluator,
}

/// A symbol whose value differs, with both values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DifferingSymbol {
    /// Index of the symbol in the evaluator.
    pub symbol: usize,
    /// The evaluator's value.
    pub expected: i32,
    /// The chip's value.
    pub found: i32,
}

/// The first difference that was found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Mismatch {
    /// The kind of the difference.
    pub kind: DifferenceKind,
    /// Machine cycle since reset.
    pub cycle: u64,
    /// The differing symbols, if `kind` concerns symbols or pins.
    pub differing: Vec<DifferingSymbol>,
    /// The two sides as text, for all other kinds.
    pub expected: String,
    /// What was found, as text.
    pub found: String,
    /// Program counter of the chip, as a word address, if it lost sync.
    pub pc: Option<u32>,
}

impl Mismatch {
    fn of_values(kind: DifferenceKind, cycle: u64, differing: Vec<DifferingSymbol>) -> Mismatch {
        Mismatch { kind, cycle, differing, expected: String::new(), found: String::new(), pc: None }
    }

    /// A mismatch that is described by text.
    pub(crate) fn of_text(kind: DifferenceKind, cycle: u64, expected: String, found: String) -> Mismatch {
        Mismatch { kind, cycle, differing: Vec::new(), expected, found, pc: None }
    }

    /// A mismatch of which a part of the check has the text.
    pub(crate) fn of_deviation(what: DifferenceKind, cycle: u64, deviation: Deviation) -> Mismatch {
        Mismatch::of_text(what, cycle, deviation.expected, deviation.found)
    }

    /// Returns true if both mismatches are of the same kind and concern the same symbols or pin.
    pub(crate) fn is_same_kind(&self, other: &Mismatch) -> bool {
        let symbols = |m: &Mismatch| m.differing.iter().map(|d| d.symbol).collect::<Vec<_>>();
        let same_pin = self.kind != DifferenceKind::Pin || self.expected == other.expected;
        self.kind == other.kind && symbols(self) == symbols(other) && same_pin
    }
}

/// The results of a scan without a difference.
#[derive(Debug, Clone, Default)]
pub(crate) struct MatchedScan {
    /// Number of values compared.
    pub compared: u64,
    /// Machine cycles from the scan's start until the chip waits again.
    pub cycles: u64,
    /// Rungs by index with their machine cycles; empty if rungs are not timed.
    pub rungs: Vec<(usize, u64)>,
    /// The scan as the evaluator executed it.
    pub evaluated: EvaluatedScan,
}

/// Chip and evaluator, both at the end of a scan or before the first one.
#[derive(Clone)]
pub(crate) struct LockstepPair<'a, C> {
    /// The chip with its program.
    pub runner: ChipRunner<'a, C>,
    /// The evaluator.
    pub eval: Evaluator,
    places: &'a ProgramPlaces,
    stimulus_symbols: &'a StimulusSymbols,
    /// The bytes in flight and the peripherals.
    pub lines: PeripheralLines,
    /// No scan has begun since power-up.
    is_first_scan: bool,
    worst_scan_cycles: u64,
    /// Machine cycles from the end of a scan until the chip waits; measured once.
    tail_cycles: Option<u64>,
}

impl<'a, C: CheckedChip> LockstepPair<'a, C> {
    /// Starts both sides from power-up, with the EEPROM contents of `ram_seed`.
    pub(crate) fn start<F: Fn(u64) -> C>(bench: &TestBench<'a, C, F>, ram_seed: u64) -> Result<Self, Mismatch> {
        LockstepPair::start_with_eeprom(bench, ram_seed, bench.places.peripherals.initial_eeprom(ram_seed))
    }

    /// Starts both sides from power-up, with `cells` in the EEPROM.
    pub(crate) fn start_with_eeprom<F: Fn(u64) -> C>(
        bench: &TestBench<'a, C, F>,
        ram_seed: u64,
        cells: impl IntoIterator<Item = u8>,
    ) -> Result<Self, Mismatch> {
        let (places, stimulus_symbols) = (bench.places, bench.stimulus_symbols);
        let (mut cpu, mut eval) = ((bench.power_up)(ram_seed), bench.eval.clone());
        for (addr, byte) in (0..).zip(cells) {
            cpu.poke("eeprom", addr, byte);
            eval.set_eeprom(addr as usize, byte);
        }
        let mut runner = ChipRunner::start(cpu, places).map_err(|a| lost_sync_mismatch(&a, places))?;
        if bench.time_rungs {
            runner.time_rungs();
        }
        Ok(LockstepPair {
            runner,
            eval,
            places,
            stimulus_symbols,
            lines: PeripheralLines::new(places, bench.worst_scan_cycles),
            is_first_scan: true,
            worst_scan_cycles: bench.worst_scan_cycles,
            tail_cycles: None,
        })
    }

    /// Drives the inputs, runs the chip to the start of the next scan, checks the time of the start and the
    /// state that the last scan left, and applies the inputs and writes of `stimulus` to both sides. Returns
    /// the number of values compared.
    pub(crate) fn begin_scan(&mut self, stimulus: &ScanStimulus) -> Result<u64, Mismatch> {
        self.runner.drive_inputs(stimulus.inputs.iter().copied());
        self.runner.drive_unnamed_pins(stimulus.drivable_levels);
        self.lines.prepare_scan(&mut self.runner, &self.eval, stimulus);
        self.runner.reach_start().map_err(|a| lost_sync_mismatch(&a, self.places))?;
        let cycle = self.runner.cpu.cycle();
        let (window, at) = (self.runner.start_window(), self.runner.cycles_since_start());
        if !window.contains(&at) {
            let expected = format!("{} to {} cycles after the start of the timer", window.start(), window.end());
            return Err(Mismatch::of_text(DifferenceKind::Period, cycle, expected, format!("{at}")));
        }
        if let Some(StackChange { first, now }) = self.runner.stack_change() {
            let (expected, found) = (format!("0x{first:04X}"), format!("0x{now:04X}"));
            return Err(Mismatch::of_text(DifferenceKind::Stack, cycle, expected, found));
        }
        let mut compared = 2 + self.compare_pins()? + self.lines.begin_scan(&mut self.runner, &mut self.eval)?;
        let mut stimulus = stimulus.clone();
        if self.is_first_scan {
            self.is_first_scan = false;
            // AP101 has no code before the first scan. So that scan sets two kinds of values, which are not
            // compared before it: the preset of a TOF in dialect ldmicro-5, and a BOOL that begins with TRUE.
            let (symbols, eval) = (self.eval.symbols(), &self.eval);
            let is_late = |symbol: &usize| {
                self.places.is_self_paced()
                    && symbols.get(*symbol).is_some_and(|s| s.kind == SymbolKind::Timer || s.kind.is_bit())
                    && eval.get(*symbol) != 0
            };
            stimulus.writes.retain(|(symbol, _)| !is_late(symbol));
            let all = self
                .stimulus_symbols
                .bits
                .iter()
                .chain(&self.stimulus_symbols.integers)
                .copied()
                .filter(|symbol| !is_late(symbol));
            compared += self.compare_symbols(DifferenceKind::Reset, all)? + self.check_pin_behaviour(true)?;
        }
        self.lines.choose_answer(&mut self.runner, &mut self.eval);
        stimulus.apply(self.stimulus_symbols, &mut self.eval);
        for &(symbol, value) in &stimulus.writes {
            self.places.write_symbol(&mut self.runner.cpu, symbol, value);
        }
        Ok(compared)
    }

    /// Runs one whole scan on both sides and compares them.
    pub(crate) fn scan(&mut self, stimulus: &ScanStimulus) -> Result<MatchedScan, Mismatch> {
        let is_first_scan = self.is_first_scan;
        let mut compared = self.begin_scan(stimulus)?;
        let start = self.runner.cpu.cycle();
        let evaluated = EvaluatedScan::run(&mut self.eval);
        self.lines.note_evaluated_scan(&mut self.runner, &self.eval);
        let to_mismatch = |a: LostSync| lost_sync_mismatch(&a, self.places);
        // A self-paced machine latches its inputs before the first instruction.
        if self.runner.reach_rungs().map_err(to_mismatch)? || self.places.is_self_paced() {
            self.flip_inputs(stimulus);
        }
        self.runner.reach_end().map_err(to_mismatch)?;
        compared += self.compare_symbols(DifferenceKind::Symbol, 0..self.eval.symbols().len())?
            + self.compare_pins()?
            + self.check_pin_behaviour(is_first_scan)?;
        compared += self.lines.compare_sent(&mut self.runner)? + compare_buses(&mut self.runner, &self.eval)?;
        let end = self.runner.cpu.cycle();
        let cycles = end - start + *self.tail_cycles.get_or_insert_with(|| self.runner.tail_cycles());
        if cycles > self.worst_scan_cycles {
            let expected = format!("a scan of at most {} machine cycles, as the map says", self.worst_scan_cycles);
            return Err(Mismatch::of_text(DifferenceKind::Bound, end, expected, format!("{cycles}")));
        }
        Ok(MatchedScan { compared, cycles, rungs: self.runner.rung_times().collect(), evaluated })
    }

    /// Inverts the inputs that `stimulus` flips; the program has latched them already.
    pub(crate) fn flip_inputs(&mut self, stimulus: &ScanStimulus) {
        if !stimulus.flips.is_empty() {
            self.runner
                .drive_after_latch(stimulus.inputs.iter().zip(&stimulus.flips).map(|(level, flip)| level ^ flip));
        }
    }

    fn compare_symbols(&self, kind: DifferenceKind, symbols: impl Iterator<Item = usize>) -> Result<u64, Mismatch> {
        let mut compared = 0;
        let mut differing = Vec::new();
        for symbol in symbols {
            let (expected, found) = (self.eval.get(symbol), self.places.read_symbol(&self.runner.cpu, symbol));
            compared += 1;
            if expected != found {
                differing.push(DifferingSymbol { symbol, expected, found });
            }
        }
        if differing.is_empty() {
            Ok(compared)
        } else {
            Err(Mismatch::of_values(kind, self.runner.cpu.cycle(), differing))
        }
    }

    /// Checks pull-ups and drivers of the chip's pins: drives each pin from outside and reads its level
    /// ([`pin_behaviour::check_pins`]). With `drive_machine`, a copy of the whole machine is driven instead
    /// of copies of its wires: peripherals that react to an edge are enabled by the code before or in the
    /// first scan.
    fn check_pin_behaviour(&self, drive_machine: bool) -> Result<u64, Mismatch> {
        pin_behaviour::check_pins(&self.runner.cpu, self.places, drive_machine)
            .map_err(|deviation| Mismatch::of_deviation(DifferenceKind::Pin, self.runner.cpu.cycle(), deviation))
    }

    /// Compares the output pins with the current outputs of the evaluator; before the end of the first scan
    /// they are low, also where an output begins with TRUE.
    fn compare_pins(&self) -> Result<u64, Mismatch> {
        let mut differing = Vec::new();
        for &(symbol, pin) in &self.places.outputs {
            let expected = if self.is_first_scan { 0 } else { self.eval.get(symbol) };
            let level = self.runner.cpu.pin_level(pin);
            if level != PinLevel::from_bit(expected != 0) {
                let found = match level {
                    PinLevel::Low => 0,
                    PinLevel::High => 1,
                    PinLevel::Float | PinLevel::PullUp | PinLevel::PullDown => FLOATING_LEVEL,
                };
                differing.push(DifferingSymbol { symbol, expected, found });
            }
        }
        let mut compared = self.places.outputs.len() as u64;
        if differing.is_empty() {
            for port in &self.places.ports {
                let level = |pin| self.runner.cpu.pin_level(pin);
                compared += port.compare(&self.eval, level).map_err(|deviation| {
                    Mismatch::of_deviation(DifferenceKind::Pin, self.runner.cpu.cycle(), deviation)
                })?;
            }
            Ok(compared)
        } else {
            Err(Mismatch::of_values(DifferenceKind::Pin, self.runner.cpu.cycle(), differing))
        }
    }
}

/// The value of [`DifferingSymbol::found`] for a pin that nothing drives.
pub(crate) const FLOATING_LEVEL: i32 = 2;

fn lost_sync_mismatch(lost_sync: &LostSync, places: &ProgramPlaces) -> Mismatch {
    let byte = |pc: u32| pc * places.word_bytes;
    let name = |point: ScanPoint| match point {
        ScanPoint::TimerStart => "the start of the timer",
        ScanPoint::ScanStart => "the start of the scan",
        ScanPoint::FirstRung => "the first rung",
        ScanPoint::ScanEnd => "the end of the scan",
    };
    let at = |pc: u32| format!("0x{:04X}", byte(pc));
    let wanted = places.point_word(lost_sync.wanted).map_or_else(String::new, |pc| format!(" at {}", at(pc)));
    let points = [ScanPoint::TimerStart, ScanPoint::ScanStart, ScanPoint::FirstRung, ScanPoint::ScanEnd];
    let found = match lost_sync.stop {
        StopReason::Limit => format!("not reached within several periods, the program is at {}", at(lost_sync.pc)),
        StopReason::Halted => format!("the chip has halted at {}", at(lost_sync.pc)),
        StopReason::Error(error) => describe_error(error, at),
        StopReason::Breakpoint { pc } => {
            let point = points.into_iter().find(|p| places.point_word(*p) == Some(pc));
            format!("{}, at {}", point.map_or("a place outside the sequence", name), at(pc))
        }
        StopReason::Probe => "a stop without a request".to_owned(),
    };
    let mut mismatch =
        Mismatch::of_text(DifferenceKind::Stop, lost_sync.cycle, format!("{}{wanted}", name(lost_sync.wanted)), found);
    mismatch.pc = Some(lost_sync.pc);
    mismatch
}

/// Runs `stimuli` from reset. Returns the first mismatch and its scan, from 1; a mismatch before the first
/// scan is reported as scan 1.
pub(crate) fn replay<'a, C: CheckedChip, F: Fn(u64) -> C>(
    bench: &TestBench<'a, C, F>,
    ram_seed: u64,
    stimuli: &[ScanStimulus],
) -> Option<(usize, Mismatch)> {
    let mut pair = match LockstepPair::start(bench, ram_seed) {
        Ok(pair) => pair,
        Err(mismatch) => return Some((1, mismatch)),
    };
    stimuli.iter().zip(1..).find_map(|(stimulus, scan)| pair.scan(stimulus).err().map(|mismatch| (scan, mismatch)))
}

/// Describes why a program cannot continue; `at` formats a program word address.
pub(crate) fn describe_error(error: ProgramError, at: impl Fn(u32) -> String) -> String {
    match error {
        ProgramError::Illegal { pc, word } => format!("0x{word:04X} at {} is not an instruction", at(pc)),
        ProgramError::Fault { pc, fault } => format!("{fault}, at {}", at(pc)),
    }
}
