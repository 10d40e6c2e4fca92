//! Scenarios on ladder programs: what the steps do to inputs and symbols, and the scenario played on the reference evaluator.
//!
//! A tick is a moment between two scans: moment n lies behind scan n and before scan n + 1. What is given in a moment counts in the
//! scan behind it, what is read is what the scan before it has left. The same holds on the chip (`play_chip.rs`), which is why the
//! verdicts must be the same.

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;

use diag::Diagnostic;
use ladder::{Program, Symbol, SymbolKind};
use ladder_eval::Evaluator;
use scenario::{Bound, Input, Next, Output, Player, Reading, Scale, Site, Value, Verdict, World};

use crate::hints::Hints;
use crate::peripherals::serial;
use crate::run::no_meaning;
use crate::stimulus::Step;

/// Bits of a byte on the line, and of one that is sent with what the transmitter may wait before it.
const BYTE: u64 = 10;
const SENT: u64 = 12;

/// Something that can be given to a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Given {
    /// A level at an input, by its position among the inputs.
    Level(usize, bool),
    /// What a conversion of an analog input gives, by its position among them.
    Analog(usize, u16),
    /// A value for any other symbol, by its index.
    Write(usize, i32),
}

/// What a program offers to a scenario.
#[derive(Debug, Clone)]
pub struct LadderSite {
    symbols: Vec<Symbol>,
    hints: Arc<Hints>,
    inputs: Vec<Given>,
    /// Their positions.
    known: HashMap<Given, usize>,
    /// Why bytes cannot be sent, besides what the program says.
    pub deaf: Option<String>,
    scale: Scale,
    cycle_us: u64,
    serial: (bool, bool),
    /// Scans in which a byte arrives, and after which one that was sent has been received.
    byte: (u64, u64),
}

impl LadderSite {
    /// The names of a program.
    #[must_use]
    pub fn new(program: &Program, eval: &Evaluator) -> LadderSite {
        let settings = &program.settings;
        let cycle_us = settings.cycle_us.max(1);
        let baud = settings.baud.unwrap_or(0).max(1);
        let scans = |bits: u64| (bits * 1_000_000).div_ceil(baud.saturating_mul(cycle_us));
        LadderSite {
            symbols: eval.symbols().to_vec(),
            hints: Arc::new(Hints::new(program, eval)),
            inputs: Vec::new(),
            known: HashMap::new(),
            deaf: None,
            scale: Scale::scans(cycle_us, settings.crystal_hz),
            cycle_us,
            serial: serial(program),
            byte: (scans(BYTE), scans(SENT) + 1),
        }
    }

    fn symbol(&self, name: &str) -> Result<(usize, &Symbol), String> {
        let found = self.symbols.iter().enumerate().find(|(_, symbol)| symbol.name == name);
        found.ok_or_else(|| {
            let more =
                if is_of_chip(name) { "; pins and memories are for `emu run` of what it compiles to" } else { "" };
            format!("the program has no symbol `{name}`{more}")
        })
    }

    /// The least and the most that it holds.
    fn range(symbol: &Symbol) -> (i64, i64) {
        match symbol.bytes {
            0 => (0, 1),
            bytes => (-1_i64 << (8 * bytes - 1), (1_i64 << (8 * bytes - 1)) - 1),
        }
    }

    /// What this identifier of an input stands for comes in from outside: it is no symbol that is written.
    #[must_use]
    pub fn is_outside(&self, input: usize) -> bool {
        !matches!(self.inputs.get(input), Some(Given::Write(..)))
    }

    /// Scans from the begin of a byte to where it has arrived.
    pub(crate) fn arrives(&self) -> u64 {
        self.byte.0
    }
}

/// A name as those of pins and places in memory are: `PD2`, `P1.0`, `RA0`, `data:0x20`.
fn is_of_chip(name: &str) -> bool {
    let rest = name.trim_start_matches(|c: char| c.is_ascii_uppercase());
    let letters = name.get(..name.len() - rest.len()).unwrap_or_default();
    let pin = matches!(letters, "P") || letters.len() == 2 && letters.starts_with(['P', 'R']);
    name.contains(':') || pin && rest.starts_with(|c: char| c.is_ascii_digit())
}

impl Site for LadderSite {
    fn scale(&self) -> Scale {
        self.scale
    }

    fn input(&mut self, name: &str, value: &Value) -> Result<Input, (String, bool)> {
        let (index, symbol) = self.symbol(name).map_err(|why| (why, true))?;
        let analog = self.hints.analog.iter().position(|adc| *adc == index);
        let (low, high) = if analog.is_some() { (0, 1023) } else { LadderSite::range(symbol) };
        let number = match value {
            Value::Number(number) => Some(*number),
            Value::Text(text) => text.trim().parse().ok(),
        };
        let number = number.filter(|number| (low..=high).contains(number));
        let number = number.ok_or_else(|| (format!("`{name}` takes {low} to {high}, not `{value}`"), false))?;
        let given = match (analog, symbol.kind) {
            (Some(at), _) => Given::Analog(at, number as u16),
            (None, SymbolKind::Input) => match self.hints.inputs.iter().position(|input| *input == index) {
                Some(at) => Given::Level(at, number != 0),
                None => return Err((format!("`{name}` is no input of the program"), false)),
            },
            (None, _) => Given::Write(index, number as i32),
        };
        let id = *self.known.entry(given).or_insert(self.inputs.len());
        if id == self.inputs.len() {
            self.inputs.push(given);
        }
        Ok(Input { id, ahead: false })
    }

    fn output(&mut self, name: &str) -> Result<Output, String> {
        let (id, symbol) = self.symbol(name)?;
        Ok(Output { id, range: LadderSite::range(symbol), floats: false })
    }

    fn names(&self) -> Vec<String> {
        self.symbols.iter().map(|symbol| symbol.name.clone()).collect()
    }

    fn sends(&mut self) -> Result<(), String> {
        match &self.deaf {
            Some(why) => Err(why.clone()),
            None if self.serial.1 => Ok(()),
            None => Err("the program has no UART_RECV that would take bytes".to_owned()),
        }
    }

    fn receives(&mut self) -> Result<(), String> {
        if self.serial.0 { Ok(()) } else { Err("the program has no element that sends bytes".to_owned()) }
    }

    fn snapshots(&mut self) -> Result<(), String> {
        Err("snapshots are of images on chips; a ladder program is played scan by scan".to_owned())
    }

    fn power_cycles(&mut self) -> Result<(), String> {
        Ok(())
    }
}

/// What scenarios have in their hands: the inputs as they are, and what is on its way.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hand {
    pub moment: u64,
    inputs: Vec<bool>,
    analog: Vec<u16>,
    writes: Vec<(usize, i32)>,
    /// Bytes that wait for the line, and those that the program has sent, each with the moment from which on it counts.
    queue: VecDeque<u8>,
    air: VecDeque<(u64, u8)>,
    received: Vec<u8>,
    /// The supply goes off and on before the next scan.
    pub power: bool,
    pub log: Vec<String>,
}

impl Hand {
    pub(crate) fn new(site: &LadderSite) -> Hand {
        let (inputs, analog) = (vec![false; site.hints.inputs.len()], vec![0; site.hints.analog.len()]);
        Hand { inputs, analog, ..Hand::default() }
    }

    /// What the next scan gets. `free`: a byte can begin on its way.
    pub(crate) fn step(&mut self, free: bool) -> Step {
        let byte = if free { self.queue.pop_front() } else { None };
        let writes = std::mem::take(&mut self.writes);
        Step { inputs: self.inputs.clone(), analog: self.analog.clone(), byte, writes, ..Step::default() }
    }

    /// A scan has run: in this one, a byte was sent or not.
    pub(crate) fn scanned(&mut self, site: &LadderSite, sent: Option<u8>) {
        self.moment += 1;
        self.air.extend(sent.map(|byte| (self.moment + site.byte.1, byte)));
        self.land();
    }

    /// A byte was sent in scan `scan`.
    pub(crate) fn heard(&mut self, site: &LadderSite, scan: u64, byte: u8) {
        self.air.push_back((scan + site.byte.1, byte));
        self.land();
    }

    fn land(&mut self) {
        while let Some(&(_, byte)) = self.air.front().filter(|(due, _)| *due <= self.moment) {
            self.air.pop_front();
            self.received.push(byte);
        }
    }

    /// Lets all players look; the first that has ended tells how. `read`: what the last scan has left of a symbol; before the first
    /// scan behind power-up it is what `fresh` says, for a chip has not begun then.
    pub(crate) fn look(
        &mut self,
        site: &LadderSite,
        players: &mut [Player],
        fresh: &Evaluator,
        read: &dyn Fn(usize) -> i32,
    ) -> Option<Verdict> {
        let mut table = Table { hand: self, site, fresh, read };
        let mut verdict = None;
        for player in players {
            if let Next::Done(done) = player.look(&mut table) {
                verdict.get_or_insert(done);
            }
        }
        verdict
    }
}

/// A program as its scenario sees it between two scans.
struct Table<'a> {
    hand: &'a mut Hand,
    site: &'a LadderSite,
    fresh: &'a Evaluator,
    read: &'a dyn Fn(usize) -> i32,
}

impl World for Table<'_> {
    fn now(&self) -> u64 {
        self.hand.moment
    }

    fn put(&mut self, input: usize, _: u64) -> Result<(), String> {
        match self.site.inputs.get(input) {
            Some(&Given::Level(at, level)) => self.hand.inputs.get_mut(at).into_iter().for_each(|slot| *slot = level),
            Some(&Given::Analog(at, value)) => self.hand.analog.get_mut(at).into_iter().for_each(|slot| *slot = value),
            Some(&Given::Write(symbol, value)) => self.hand.writes.push((symbol, value)),
            None => {}
        }
        Ok(())
    }

    fn read(&self, output: usize) -> Reading {
        let begun = self.hand.moment > 0 && !self.hand.power;
        Reading::Value(if begun { (self.read)(output) } else { self.fresh.get(output) }.into())
    }

    fn send(&mut self, bytes: &[u8], _: u64) -> Result<(), String> {
        self.hand.queue.extend(bytes);
        Ok(())
    }

    fn received(&self) -> &[u8] {
        &self.hand.received
    }

    fn power_cycle(&mut self) -> Result<(), String> {
        self.hand.power = true;
        self.hand.writes.clear();
        self.hand.queue.clear();
        // What the program was sending is lost with it.
        self.hand.air.clear();
        Ok(())
    }

    fn snapshot(&mut self, _: &str) -> Result<(), String> {
        self.site.clone().snapshots()
    }

    fn log(&mut self, line: &str) {
        self.hand.log.push(format!("{}: {line}", self.moment(self.hand.moment)));
    }

    fn moment(&self, tick: u64) -> String {
        format!("scan {tick} ({})", time(tick.saturating_mul(self.site.cycle_us)))
    }
}

/// Microseconds as people write them.
fn time(us: u64) -> String {
    match us {
        0 => "0 s".to_owned(),
        us if us.is_multiple_of(1_000_000) => format!("{} s", us / 1_000_000),
        us if us.is_multiple_of(1_000) => format!("{} ms", us / 1_000),
        us => format!("{us} us"),
    }
}

/// A scenario played on the evaluator, scan by scan.
pub struct Rehearsal {
    site: LadderSite,
    hand: Hand,
    fresh: Evaluator,
    /// The program as the last scan left it.
    pub eval: Evaluator,
    players: Vec<Player>,
    /// Stimuli whose end is not that of the whole.
    beside: Vec<Player>,
    /// A byte on its way, and the moment in which it has arrived.
    incoming: Option<(u64, u8)>,
    /// What the last scan got.
    last: Step,
    verdict: Option<Verdict>,
}

/// What a program gets from outside for a scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outside {
    /// Levels of all inputs, by name.
    pub levels: Vec<(String, bool)>,
    /// What conversions of the analog inputs give, 0 to 1023, by name.
    pub counts: Vec<(String, u16)>,
    /// A byte that begins on its way.
    pub byte: Option<u8>,
    /// Scans from there to where it has arrived.
    pub arrives: u64,
}

impl Rehearsal {
    /// At power-up, with its EEPROM erased. The first of several scenarios that ends tells the verdict.
    ///
    /// # Errors
    /// The evaluator refuses the program.
    pub fn new(program: &Program) -> Result<Rehearsal, Vec<Diagnostic>> {
        let eval = Evaluator::new(program).map_err(|refusal| vec![no_meaning(program, &refusal)])?;
        let site = LadderSite::new(program, &eval);
        let hand = Hand::new(&site);
        Ok(Rehearsal {
            site,
            hand,
            fresh: eval.clone(),
            eval,
            players: Vec::new(),
            beside: Vec::new(),
            incoming: None,
            last: Step::default(),
            verdict: None,
        })
    }

    /// What scenarios are bound to.
    pub fn site(&mut self) -> &mut LadderSite {
        &mut self.site
    }

    /// One more scenario.
    pub fn play(&mut self, bound: Bound) {
        self.players.push(Player::new(Arc::new(bound)));
    }

    /// Stimuli beside it; with `ends` it is over when they are.
    pub fn accompany(&mut self, bound: Bound, ends: bool) {
        let player = Player::new(Arc::new(bound));
        if ends { self.players.push(player) } else { self.beside.push(player) }
    }

    /// Does what is due and runs a scan; false when it is over.
    pub fn scan(&mut self) -> bool {
        self.scan_beside(None)
    }

    /// [`Rehearsal::scan`] beside a chip that somebody else runs: symbols, by their position in the evaluator, are what `chip` says.
    pub fn scan_beside(&mut self, chip: Option<&dyn Fn(usize) -> i32>) -> bool {
        let eval = &self.eval;
        let read = |symbol: usize| chip.map_or_else(|| eval.get(symbol), |read| read(symbol));
        self.hand.look(&self.site, &mut self.beside, &self.fresh, &read);
        self.verdict = self.hand.look(&self.site, &mut self.players, &self.fresh, &read);
        if self.verdict.is_some() {
            return false;
        }
        if std::mem::take(&mut self.hand.power) {
            let cells = self.eval.eeprom().to_vec();
            self.eval = self.fresh.clone();
            (0..).zip(cells).for_each(|(addr, byte)| self.eval.set_eeprom(addr, byte));
            self.incoming = None;
        }
        let step = self.hand.step(self.incoming.is_none() && !self.eval.waiting());
        if let Some(byte) = step.byte {
            self.incoming = Some((self.hand.moment + self.site.byte.0, byte));
        }
        if let Some((_, byte)) = self.incoming.take_if(|(due, _)| *due <= self.hand.moment) {
            self.eval.receive(byte);
        }
        step.apply(&self.site.hints, &mut self.eval);
        self.eval.scan();
        self.hand.scanned(&self.site, self.eval.sent());
        self.last = step;
        true
    }

    /// What the last scan got from outside.
    #[must_use]
    pub fn outside(&self) -> Outside {
        let name = |symbol: usize| self.eval.symbols().get(symbol).map_or_else(String::new, |s| s.name.clone());
        let (inputs, analog) = (&self.site.hints.inputs, &self.site.hints.analog);
        Outside {
            levels: inputs.iter().zip(&self.last.inputs).map(|(&symbol, &level)| (name(symbol), level)).collect(),
            counts: analog.iter().zip(&self.last.analog).map(|(&symbol, &count)| (name(symbol), count)).collect(),
            byte: self.last.byte,
            arrives: self.site.arrives(),
        }
    }

    /// Scans run.
    #[must_use]
    pub fn scans(&self) -> u64 {
        self.hand.moment
    }

    /// How it ended; where it has not, with this sentence.
    pub fn end(&mut self, why: &str) -> Verdict {
        let eval = &self.eval;
        let read = |symbol: usize| eval.get(symbol);
        let table = Table { hand: &mut self.hand, site: &self.site, fresh: &self.fresh, read: &read };
        let given_up = self.players.first_mut().map(|player| player.give_up(&table, why));
        self.verdict.clone().or(given_up).unwrap_or_else(Verdict::nothing)
    }

    /// Lines that were told since the last time.
    pub fn told(&mut self) -> Vec<String> {
        std::mem::take(&mut self.hand.log)
    }
}
