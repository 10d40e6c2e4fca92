//! Scenarios on ladder programs: binds names to inputs and symbols, and plays a scenario on the reference
//! evaluator.
//!
//! A tick is the moment between two scans: tick n is after scan n and before scan n + 1. An input that is set
//! in a tick takes effect in the scan after it; a value that is read is what the scan before it left. The
//! same holds on the chip (`on_chip.rs`), so the verdicts must be the same.

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;

use diag::Diagnostic;
use ladder::{LadderProgram, LadderSymbol, SymbolKind};
use ladder_eval::Evaluator;
use scenario::{
    BoundScenario, NameResolver, OutputReading, PlayerState, ScenarioError, ScenarioInput, ScenarioOutput,
    ScenarioPlayer, ScenarioValue, ScenarioVerdict, ScenarioWorld, TimeScale,
};

use crate::CheckError;
use crate::chip::peripherals::{SerialUse, serial_use};
use crate::comparison::check_run::unsupported_diagnostic;
use crate::stimulus::generator::ScanStimulus;
use crate::stimulus::stimulus_symbols::StimulusSymbols;

/// Bits of a byte on the line: start, data, stop.
const BYTE_BITS: u64 = 10;
/// Bits of a sent byte, including the time that the transmitter may wait before it.
const SENT_BYTE_BITS: u64 = 12;

/// A stimulus for a ladder program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum LadderStimulus {
    /// A level at an input, identified by its index among the inputs.
    Level(usize, bool),
    /// The result of converting an analog input, identified by its index among the analog inputs.
    Analog(usize, u16),
    /// A value for any other symbol, identified by its index.
    Write(usize, i32),
}

/// Resolves the names in a scenario for a ladder program.
#[derive(Debug, Clone)]
pub struct LadderResolver {
    symbols: Vec<LadderSymbol>,
    stimulus_symbols: Arc<StimulusSymbols>,
    inputs: Vec<LadderStimulus>,
    /// The index of each stimulus in `inputs`.
    known_inputs: HashMap<LadderStimulus, usize>,
    /// Why bytes cannot be sent, apart from reasons in the program.
    pub cannot_send_reason: Option<String>,
    scale: TimeScale,
    cycle_us: u64,
    serial: SerialUse,
    /// Scans until a byte that the scenario sends has arrived.
    scans_to_arrive: u64,
    /// Scans until a byte that the program sends has been received.
    scans_to_be_received: u64,
}

impl LadderResolver {
    /// A resolver for the names of a program.
    #[must_use]
    pub fn new(program: &LadderProgram, eval: &Evaluator) -> LadderResolver {
        let settings = &program.settings;
        let cycle_us = settings.cycle_us.max(1);
        let baud = settings.baud.unwrap_or(0).max(1);
        let scans = |bits: u64| (bits * 1_000_000).div_ceil(baud.saturating_mul(cycle_us));
        LadderResolver {
            symbols: eval.symbols().to_vec(),
            stimulus_symbols: Arc::new(StimulusSymbols::new(program, eval)),
            inputs: Vec::new(),
            known_inputs: HashMap::new(),
            cannot_send_reason: None,
            scale: TimeScale::for_scans(cycle_us, settings.crystal_hz),
            cycle_us,
            serial: serial_use(program),
            scans_to_arrive: scans(BYTE_BITS),
            scans_to_be_received: scans(SENT_BYTE_BITS) + 1,
        }
    }

    fn find_symbol(&self, name: &str) -> Result<(usize, &LadderSymbol), CheckError> {
        let found = ladder::find_symbol(&self.symbols, name);
        let found = found.and_then(|index| Some((index, self.symbols.get(index)?)));
        found.ok_or_else(|| CheckError::UnknownSymbol { name: name.to_owned(), of_chip: is_chip_name(name) })
    }

    /// Returns true if this input identifier belongs to an external input, not to a symbol that is written.
    #[must_use]
    pub fn is_external_input(&self, input: usize) -> bool {
        !matches!(self.inputs.get(input), Some(LadderStimulus::Write(..)))
    }

    /// Scans from the start of a byte until it has arrived.
    pub(crate) fn arrival_scans(&self) -> u64 {
        self.scans_to_arrive
    }
}

/// Returns true if a name has the form of a pin or a memory location: `PD2`, `P1.0`, `RA0`, `data:0x20`.
fn is_chip_name(name: &str) -> bool {
    let rest = name.trim_start_matches(|c: char| c.is_ascii_uppercase());
    let letters = name.get(..name.len() - rest.len()).unwrap_or_default();
    let pin = matches!(letters, "P") || letters.len() == 2 && letters.starts_with(['P', 'R']);
    name.contains(':') || pin && rest.starts_with(|c: char| c.is_ascii_digit())
}

fn refused(error: CheckError) -> ScenarioError {
    ScenarioError::Refused(error.into())
}

impl NameResolver for LadderResolver {
    fn time_scale(&self) -> TimeScale {
        self.scale
    }

    fn resolve_input(&mut self, name: &str, value: &ScenarioValue) -> Result<ScenarioInput, ScenarioError> {
        let (index, symbol) = self.find_symbol(name).map_err(|error| ScenarioError::UnknownName(error.into()))?;
        let analog = self.stimulus_symbols.analog.iter().position(|adc| *adc == index);
        let (low, high) = if analog.is_some() { (0, 1023) } else { symbol.range().into_inner() };
        let number = match value {
            ScenarioValue::Number(number) => Some(*number),
            ScenarioValue::Text(text) => text.trim().parse().ok(),
        };
        let number = number.filter(|number| (low..=high).contains(number));
        let number = number.ok_or_else(|| {
            let value = value.to_string();
            ScenarioError::ImpossibleValue(
                CheckError::ValueOutOfRange { name: name.to_owned(), low, high, value }.into(),
            )
        })?;
        let stimulus = match (analog, symbol.kind) {
            (Some(at), _) => LadderStimulus::Analog(at, number as u16),
            (None, SymbolKind::Input) => match self.stimulus_symbols.inputs.iter().position(|input| *input == index) {
                Some(at) => LadderStimulus::Level(at, number != 0),
                None => {
                    let error = CheckError::NotAnInput { name: name.to_owned() };
                    return Err(ScenarioError::ImpossibleValue(error.into()));
                }
            },
            (None, _) => LadderStimulus::Write(index, number as i32),
        };
        let id = *self.known_inputs.entry(stimulus).or_insert(self.inputs.len());
        if id == self.inputs.len() {
            self.inputs.push(stimulus);
        }
        Ok(ScenarioInput { id, can_be_queued: false })
    }

    fn resolve_output(&mut self, name: &str) -> Result<ScenarioOutput, ScenarioError> {
        let (id, symbol) = self.find_symbol(name).map_err(|error| ScenarioError::UnknownName(error.into()))?;
        Ok(ScenarioOutput { id, range: symbol.range().into_inner(), can_float: false })
    }

    fn known_names(&self) -> Vec<String> {
        self.symbols.iter().map(|symbol| symbol.name.clone()).collect()
    }

    fn check_can_send(&mut self) -> Result<(), ScenarioError> {
        match &self.cannot_send_reason {
            Some(why) => Err(refused(CheckError::CannotSend { reason: why.clone() })),
            None if self.serial.receives => Ok(()),
            None => Err(refused(CheckError::NoReceiver)),
        }
    }

    fn check_can_receive(&mut self) -> Result<(), ScenarioError> {
        if self.serial.sends { Ok(()) } else { Err(refused(CheckError::NoSender)) }
    }

    fn check_can_snapshot(&mut self) -> Result<(), ScenarioError> {
        Err(refused(CheckError::NoSnapshots))
    }

    fn check_can_power_cycle(&mut self) -> Result<(), ScenarioError> {
        Ok(())
    }
}

/// The inputs and outputs as scenarios have set and read them, with the bytes in flight.
#[derive(Debug, Clone, Default)]
pub(crate) struct ScenarioIo {
    /// Number of scans run, which is also the current tick.
    pub scan: u64,
    inputs: Vec<bool>,
    analog: Vec<u16>,
    writes: Vec<(usize, i32)>,
    /// Bytes that wait to be sent to the program.
    send_queue: VecDeque<u8>,
    /// Bytes that the program has sent, each with the tick from which on it counts as received.
    bytes_on_line: VecDeque<(u64, u8)>,
    received: Vec<u8>,
    /// True if the supply is switched off and on before the next scan.
    pub power_cycle_requested: bool,
    /// Lines that the scenarios logged.
    pub log: Vec<String>,
}

impl ScenarioIo {
    /// The state before the first scan: an input has the value of its symbol at power-up, 0 if none is
    /// declared.
    pub(crate) fn new(resolver: &LadderResolver, power_up: &Evaluator) -> ScenarioIo {
        let inputs = resolver.stimulus_symbols.inputs.iter().map(|symbol| power_up.get(*symbol) != 0).collect();
        let analog = vec![0; resolver.stimulus_symbols.analog.len()];
        ScenarioIo { inputs, analog, ..ScenarioIo::default() }
    }

    /// The stimulus of the next scan. With `can_begin_byte`, a byte to the program can begin.
    pub(crate) fn next_stimulus(&mut self, can_begin_byte: bool) -> ScanStimulus {
        let byte = if can_begin_byte { self.send_queue.pop_front() } else { None };
        let writes = std::mem::take(&mut self.writes);
        ScanStimulus {
            inputs: self.inputs.clone(),
            analog: self.analog.clone(),
            byte,
            writes,
            ..ScanStimulus::default()
        }
    }

    /// Records the end of a scan, with the byte that the program sent in it.
    pub(crate) fn end_scan(&mut self, resolver: &LadderResolver, sent: &[u8]) {
        self.scan += 1;
        self.bytes_on_line.extend(sent.iter().map(|byte| (self.scan + resolver.scans_to_be_received, *byte)));
        self.deliver_sent_bytes();
    }

    /// Records that a byte was sent in scan `scan`.
    pub(crate) fn note_sent_byte(&mut self, resolver: &LadderResolver, scan: u64, byte: u8) {
        self.bytes_on_line.push_back((scan + resolver.scans_to_be_received, byte));
        self.deliver_sent_bytes();
    }

    fn deliver_sent_bytes(&mut self) {
        while let Some(&(_, byte)) = self.bytes_on_line.front().filter(|(due, _)| *due <= self.scan) {
            self.bytes_on_line.pop_front();
            self.received.push(byte);
        }
    }

    /// Polls all players and returns the verdict of the first one that has ended. `read` gives the value of a
    /// symbol after the last scan. Before the first scan after power-up, values come from `power_up`, because
    /// a chip has not started then.
    pub(crate) fn poll_players(
        &mut self,
        resolver: &LadderResolver,
        players: &mut [ScenarioPlayer],
        power_up: &Evaluator,
        read: &dyn Fn(usize) -> i32,
    ) -> Option<ScenarioVerdict> {
        let mut world = LadderWorld { io: self, resolver, power_up, read };
        let mut verdict = None;
        for player in players {
            if let PlayerState::Done(reached) = player.poll(&mut world) {
                verdict.get_or_insert(reached);
            }
        }
        verdict
    }
}

/// A ladder program as a [`ScenarioWorld`], between two scans.
struct LadderWorld<'a> {
    io: &'a mut ScenarioIo,
    resolver: &'a LadderResolver,
    power_up: &'a Evaluator,
    read: &'a dyn Fn(usize) -> i32,
}

impl ScenarioWorld for LadderWorld<'_> {
    fn now(&self) -> u64 {
        self.io.scan
    }

    fn set_input(&mut self, input: usize, _: u64) -> Result<(), ScenarioError> {
        match self.resolver.inputs.get(input) {
            Some(&LadderStimulus::Level(at, level)) => {
                self.io.inputs.get_mut(at).into_iter().for_each(|slot| *slot = level)
            }
            Some(&LadderStimulus::Analog(at, value)) => {
                self.io.analog.get_mut(at).into_iter().for_each(|slot| *slot = value)
            }
            Some(&LadderStimulus::Write(symbol, value)) => self.io.writes.push((symbol, value)),
            None => {}
        }
        Ok(())
    }

    fn read_output(&self, output: usize) -> OutputReading {
        let has_started = self.io.scan > 0 && !self.io.power_cycle_requested;
        let value = if has_started { (self.read)(output) } else { self.power_up.get(output) };
        let symbol = self.resolver.symbols.get(output);
        OutputReading::Value(symbol.map_or(value.into(), |symbol| symbol.shown_value(value)))
    }

    fn send(&mut self, bytes: &[u8], _: u64) -> Result<(), ScenarioError> {
        self.io.send_queue.extend(bytes);
        Ok(())
    }

    fn received(&self) -> &[u8] {
        &self.io.received
    }

    fn power_cycle(&mut self) -> Result<(), ScenarioError> {
        self.io.power_cycle_requested = true;
        self.io.writes.clear();
        self.io.send_queue.clear();
        // A byte that the program is sending is lost.
        self.io.bytes_on_line.clear();
        Ok(())
    }

    fn snapshot(&mut self, _: &str) -> Result<(), ScenarioError> {
        self.resolver.clone().check_can_snapshot()
    }

    fn log(&mut self, line: &str) {
        self.io.log.push(format!("{}: {line}", self.describe_tick(self.io.scan)));
    }

    fn describe_tick(&self, tick: u64) -> String {
        format!("scan {tick} ({})", time_text(tick.saturating_mul(self.resolver.cycle_us)))
    }
}

/// A time in microseconds as text, in the largest unit without a fraction.
fn time_text(us: u64) -> String {
    match us {
        0 => "0 s".to_owned(),
        us if us.is_multiple_of(1_000_000) => format!("{} s", us / 1_000_000),
        us if us.is_multiple_of(1_000) => format!("{} ms", us / 1_000),
        us => format!("{us} us"),
    }
}

/// Plays scenarios on the evaluator, scan by scan.
pub struct EvaluatorPlay {
    resolver: LadderResolver,
    io: ScenarioIo,
    power_up: Evaluator,
    /// The evaluator in its state after the last scan.
    pub eval: Evaluator,
    players: Vec<ScenarioPlayer>,
    /// Players of stimuli whose end does not end the whole.
    side_players: Vec<ScenarioPlayer>,
    /// A byte in flight: the tick at which it has arrived, and the byte.
    incoming: Option<(u64, u8)>,
    /// The stimulus of the last scan.
    last_stimulus: ScanStimulus,
    verdict: Option<ScenarioVerdict>,
}

/// The external inputs of a program for one scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScanInputs {
    /// Levels of all inputs, by symbol name.
    pub levels: Vec<(String, bool)>,
    /// Results of converting the analog inputs, 0 to 1023, by symbol name.
    pub conversions: Vec<(String, u16)>,
    /// A byte to the program that begins in this scan.
    pub byte: Option<u8>,
    /// Scans from its start until it has arrived.
    pub arrival_scans: u64,
}

impl EvaluatorPlay {
    /// A program at power-up with an erased EEPROM. With several scenarios, the first one that ends gives the
    /// verdict.
    ///
    /// # Errors
    /// The evaluator refuses the program.
    pub fn new(program: &LadderProgram) -> Result<EvaluatorPlay, Vec<Diagnostic>> {
        let eval = Evaluator::new(program).map_err(|refusal| vec![unsupported_diagnostic(program, &refusal)])?;
        let resolver = LadderResolver::new(program, &eval);
        let io = ScenarioIo::new(&resolver, &eval);
        Ok(EvaluatorPlay {
            resolver,
            io,
            power_up: eval.clone(),
            eval,
            players: Vec::new(),
            side_players: Vec::new(),
            incoming: None,
            last_stimulus: ScanStimulus::default(),
            verdict: None,
        })
    }

    /// The resolver that scenarios are bound with.
    pub fn resolver(&mut self) -> &mut LadderResolver {
        &mut self.resolver
    }

    /// Adds a scenario.
    pub fn add_scenario(&mut self, bound: BoundScenario) {
        self.players.push(ScenarioPlayer::new(Arc::new(bound)));
    }

    /// Adds stimuli that run next to the scenario; with `ends`, the play ends when they end.
    pub fn add_stimuli(&mut self, bound: BoundScenario, ends: bool) {
        let player = ScenarioPlayer::new(Arc::new(bound));
        if ends { self.players.push(player) } else { self.side_players.push(player) }
    }

    /// Applies what is due and runs one scan; returns false when the play is over.
    pub fn scan(&mut self) -> bool {
        self.scan_with_chip(None)
    }

    /// Executes one scan, as [`EvaluatorPlay::scan`] does, next to a chip that the caller runs: symbol
    /// values, by evaluator index, are read from `chip`.
    pub fn scan_with_chip(&mut self, chip: Option<&dyn Fn(usize) -> i32>) -> bool {
        let eval = &self.eval;
        let read = |symbol: usize| chip.map_or_else(|| eval.get(symbol), |read| read(symbol));
        self.io.poll_players(&self.resolver, &mut self.side_players, &self.power_up, &read);
        self.verdict = self.io.poll_players(&self.resolver, &mut self.players, &self.power_up, &read);
        if self.verdict.is_some() {
            return false;
        }
        if std::mem::take(&mut self.io.power_cycle_requested) {
            let cells = self.eval.eeprom().to_vec();
            self.eval = self.power_up.clone();
            (0..).zip(cells).for_each(|(addr, byte)| self.eval.set_eeprom(addr, byte));
            self.incoming = None;
        }
        let stimulus = self.io.next_stimulus(self.incoming.is_none() && !self.eval.has_received_byte());
        if let Some(byte) = stimulus.byte {
            self.incoming = Some((self.io.scan + self.resolver.scans_to_arrive, byte));
        }
        if let Some((_, byte)) = self.incoming.take_if(|(due, _)| *due <= self.io.scan) {
            self.eval.receive(byte);
        }
        stimulus.apply(&self.resolver.stimulus_symbols, &mut self.eval);
        self.eval.scan();
        self.io.end_scan(&self.resolver, self.eval.sent_bytes());
        self.last_stimulus = stimulus;
        true
    }

    /// The external inputs of the last scan.
    #[must_use]
    pub fn scan_inputs(&self) -> ScanInputs {
        let name = |symbol: usize| self.eval.symbols().get(symbol).map_or_else(String::new, |s| s.name.clone());
        let (inputs, analog) = (&self.resolver.stimulus_symbols.inputs, &self.resolver.stimulus_symbols.analog);
        ScanInputs {
            levels: inputs
                .iter()
                .zip(&self.last_stimulus.inputs)
                .map(|(&symbol, &level)| (name(symbol), level))
                .collect(),
            conversions: analog
                .iter()
                .zip(&self.last_stimulus.analog)
                .map(|(&symbol, &count)| (name(symbol), count))
                .collect(),
            byte: self.last_stimulus.byte,
            arrival_scans: self.resolver.arrival_scans(),
        }
    }

    /// Number of scans run.
    #[must_use]
    pub fn scans(&self) -> u64 {
        self.io.scan
    }

    /// The verdict; if no scenario has ended, the first one is aborted with the reason `why`.
    pub fn finish(&mut self, why: &str) -> ScenarioVerdict {
        let eval = &self.eval;
        let read = |symbol: usize| eval.get(symbol);
        let world = LadderWorld { io: &mut self.io, resolver: &self.resolver, power_up: &self.power_up, read: &read };
        let aborted = self.players.first_mut().map(|player| player.abort(&world, why));
        self.verdict.clone().or(aborted).unwrap_or_else(ScenarioVerdict::without_scenario)
    }

    /// Takes the lines that were logged since the last call.
    pub fn take_log(&mut self) -> Vec<String> {
        std::mem::take(&mut self.io.log)
    }
}
