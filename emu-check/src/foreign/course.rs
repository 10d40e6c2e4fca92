//! A foreign image and the evaluator side by side, from one wait for the timer to the next.

use std::collections::VecDeque;

use emu_core::cpu::Stop;
use emu_core::pins::{Level, Time};
use ladder_eval::Evaluator;

use crate::family::{High, PullUp, Target, nature};
use crate::goals::Seen;
use crate::hints::Hints;
use crate::report::What;
use crate::stimulus::Step;
use crate::wire::{Arrival, Frame, arrival};

use super::board::Board;
use super::codes;
use super::ear::Ear;
use super::pace::Found;
use super::{Finding, Wrong};

/// Cycles allowed from reset to the first scan, on top of some periods.
const RESET: u64 = 200_000;

/// Periods allowed from one moment to the next.
const PERIODS: u64 = 3;

/// The starts of a run's scans, in machine cycles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Starts {
    pub first: u64,
    pub last: u64,
    /// Scans that have started.
    pub scans: u64,
}

/// Chip and evaluator in a run from reset.
pub(crate) struct Course<'a, C> {
    cpu: C,
    pub eval: Evaluator,
    board: &'a Board,
    hints: &'a Hints,
    found: Found,
    ear: Ear,
    pub starts: Starts,
    /// Bytes that the evaluator has sent and the line has not, with the scan; and the other way round.
    awaited: VecDeque<(u64, u8)>,
    heard: VecDeque<(u64, Frame)>,
    sent: bool,
    incoming: Option<(u64, u8)>,
    /// Most machine cycles of a scan so far.
    pub longest: u64,
    pub compared: u64,
    pub findings: Vec<Finding>,
}

impl<'a, C: Target> Course<'a, C> {
    /// Both sides at power-up. Cells that the image does not fill are erased.
    pub(super) fn start(mut cpu: C, eval: &Evaluator, board: &'a Board, hints: &'a Hints, found: Found) -> Self {
        let mut eval = eval.clone();
        for addr in 0..board.peripherals.cells {
            eval.set_eeprom(addr as usize, cpu.peek("eeprom", addr).unwrap_or(0xFF));
        }
        wire(&mut cpu, board);
        cpu.trap(found.start, true);
        Course {
            cpu,
            eval,
            board,
            hints,
            found,
            ear: Ear::new(board),
            starts: Starts::default(),
            awaited: VecDeque::new(),
            heard: VecDeque::new(),
            sent: false,
            incoming: None,
            longest: 0,
            compared: 0,
            findings: Vec::new(),
        }
    }

    /// Machine cycles since power-up.
    pub(super) fn cycle(&self) -> u64 {
        self.cpu.cycle()
    }

    /// While the chip waits: the outside of the next scan. Then that scan on both sides, until the chip waits again.
    pub(super) fn scan(&mut self, step: &Step) -> Result<Seen, Wrong> {
        self.outside(step);
        let extra = if self.starts.scans == 0 { RESET } else { 0 };
        self.go(self.found.start, extra, "the start of the scan")?;
        let at = self.cpu.cycle();
        if self.starts.scans == 0 {
            self.starts.first = at;
            self.power_up();
        }
        self.starts.scans += 1;
        self.starts.last = at;
        self.pins()?;
        if let Some((_, byte)) = self.incoming.filter(|(scan, _)| *scan <= self.starts.scans) {
            self.eval.receive(byte);
            self.incoming = None;
        }
        step.apply(self.hints, &mut self.eval);
        let seen = Seen::scan(&mut self.eval);
        if let Some(byte) = self.eval.sent() {
            self.sent = true;
            self.awaited.push_back((self.starts.scans, byte));
        }
        self.cpu.trap(self.found.wait, true);
        let over = self.go(self.found.wait, 0, "the end of the scan");
        self.cpu.trap(self.found.wait, false);
        over?;
        self.longest = self.longest.max(self.cpu.cycle() - at);
        self.pins()?;
        self.symbols()?;
        self.lines()?;
        Ok(seen)
    }

    /// Drives inputs, and begins a byte to the receiver.
    fn outside(&mut self, step: &Step) {
        let of = &self.board.peripherals;
        let now = Time::at(self.cpu.cycle());
        for (&pin, &level) in self.board.inputs.iter().zip(&step.inputs) {
            self.cpu.drive(now, pin, Level::of(level));
        }
        for (&(_, pin), &value) in of.analog.iter().zip(&step.analog) {
            of.put(&mut self.cpu, pin, value);
        }
        let Some(byte) = step.byte.filter(|_| self.incoming.is_none() && !self.eval.waiting()) else { return };
        let scans = self.starts.scans;
        if of.receive.is_none() || scans == 0 {
            return;
        }
        let (last, period, gap) = (self.starts.last, self.found.period, self.found.gap);
        let starts = |scan: u64| {
            let ahead = scan.saturating_sub(scans).saturating_mul(period);
            // Each of them may be up to a gap between polls earlier or later.
            let at = last.saturating_sub(scans.saturating_sub(scan).saturating_mul(period)).saturating_add(ahead);
            at.saturating_sub(gap) * of.clocks
        };
        // A scan may take longer than those that were seen.
        let busy = (self.longest + self.longest / 2 + 20 + 2 * gap) * of.clocks;
        let clock = of.clock(Time::at(self.cpu.cycle() + 1));
        if let Some(Arrival { start, scan }) = arrival(of.bit, clock, scans + 1, busy, starts) {
            of.send(&mut self.cpu, start, byte);
            self.incoming = Some((scan, byte));
        }
    }

    /// At the first scan's start: what the chip did while it set itself up, and its pull-ups.
    fn power_up(&mut self) {
        self.ear.early = false;
        for &(pin, rose) in &self.ear.outputs {
            if let Some(clock) = rose {
                let name = self.board.pin_name(pin);
                let says = format!("the output {name} goes high in clock {clock}, before the first scan");
                self.findings.push(Finding { code: codes::FINDING_GLITCH, says });
            }
        }
        let mut cpu = self.cpu.clone();
        for &pin in &self.board.inputs {
            let pulled =
                nature(self.board.chip, pin).is_some_and(|n| matches!(n.pull_up, PullUp::Inputs | PullUp::Always));
            if !pulled {
                continue;
            }
            let now = Time::at(cpu.cycle());
            cpu.drive(now, pin, Level::Low);
            cpu.drive(now, pin, Level::Float);
            if cpu.level(pin) != Level::High {
                let says = format!("the input {} floats when nothing drives it", self.board.pin_name(pin));
                self.findings.push(Finding { code: codes::FINDING_PULL_UP, says });
            }
        }
    }

    fn go(&mut self, to: u32, extra: u64, what: &str) -> Result<(), Wrong> {
        let until = self.cpu.cycle().saturating_add(self.found.period * PERIODS).saturating_add(extra);
        let word = self.board.chip.word_bytes.max(1);
        let at = |pc: u32| format!("0x{:04X}", pc * word);
        let found = loop {
            match self.cpu.run(until, &mut self.ear) {
                Stop::Trap { pc } if pc == to => return Ok(()),
                // A scan that lasts longer than a period leaves no time to wait.
                Stop::Trap { pc } if pc == self.found.start && to == self.found.wait => {
                    break "the next scan begins at once, nothing waits for the timer".to_owned();
                }
                Stop::Trap { .. } => {}
                Stop::Limit => {
                    break format!("no sign of it for several periods, the program is at {}", at(self.cpu.pc()));
                }
                Stop::Halted => break format!("the chip has halted at {}", at(self.cpu.pc())),
                Stop::Illegal { pc, word } => break format!("0x{word:04X} at {} is no instruction", at(pc)),
                Stop::Fault { pc, fault } => break format!("{fault}, at {}", at(pc)),
                Stop::Probe => break "a stop that nobody asked for".to_owned(),
            }
        };
        Err(Wrong::words(What::Stop, what.to_owned(), found))
    }

    fn pins(&mut self) -> Result<(), Wrong> {
        for &(symbol, pin) in &self.board.outputs {
            if self.board.loose.get(symbol) == Some(&true) {
                continue;
            }
            self.compared += 1;
            let expected = Level::of(self.eval.get(symbol) != 0);
            let level = self.cpu.level(pin);
            if level != expected {
                return Err(Wrong::of(What::Pin, symbol, words(expected), words(level)));
            }
        }
        Ok(())
    }

    /// Symbols inside, where a map tells their places.
    fn symbols(&mut self) -> Result<(), Wrong> {
        let Some(places) = &self.board.places else { return Ok(()) };
        for (symbol, loose) in self.board.loose.iter().enumerate() {
            let is_input = self.hints.inputs.contains(&symbol);
            if *loose || is_input {
                continue;
            }
            self.compared += 1;
            let (expected, found) = (self.eval.get(symbol), places.read(&self.cpu, symbol));
            if expected != found {
                return Err(Wrong::of(What::Symbol, symbol, expected.to_string(), found.to_string()));
            }
        }
        Ok(())
    }

    /// The serial line, the PWM output, and the cells of the EEPROM.
    fn lines(&mut self) -> Result<(), Wrong> {
        let (scan, clock) = (self.starts.scans, self.board.peripherals.clock(Time::at(self.cpu.cycle())));
        if let Some((_, listener)) = &mut self.ear.serial {
            listener.pass(clock);
            while let Some(frame) = listener.take() {
                self.heard.push_back((scan, frame));
            }
        }
        while let (Some(&(_, byte)), Some((_, frame))) = (self.awaited.front(), self.heard.front()) {
            self.compared += 1;
            if frame.fault.is_some() || self.board.bytes && frame.byte != byte {
                let fault = frame.fault.as_ref().map_or_else(String::new, |fault| format!(", {fault}"));
                return Err(Wrong::words(What::Serial, named(byte), named(frame.byte) + &fault));
            }
            self.awaited.pop_front();
            self.heard.pop_front();
        }
        // Both sides may wait for the transmitter in their own way.
        let late = |since: u64| scan > since + 2 * self.board.lasts + 2;
        if let Some((since, frame)) = self.heard.front() {
            if !self.sent {
                let says = format!(
                    "{} in clock {} since power-up, before anything asks for it",
                    named(frame.byte),
                    frame.start
                );
                if !self.findings.iter().any(|finding| finding.code == codes::FINDING_EARLY_BYTE) {
                    self.findings.push(Finding { code: codes::FINDING_EARLY_BYTE, says });
                }
                return Err(Wrong::words(What::Serial, "nothing sent".to_owned(), named(frame.byte)));
            }
            if late(*since) {
                return Err(Wrong::words(What::Serial, "nothing sent".to_owned(), named(frame.byte)));
            }
        }
        if let Some(&(_, byte)) = self.awaited.front().filter(|(since, _)| late(*since)) {
            return Err(Wrong::words(What::Serial, named(byte), "nothing sent".to_owned()));
        }
        if let Some((_, pulses)) = &mut self.ear.pwm {
            self.compared += 1;
            if let Some((expected, found)) = pulses.judge(clock) {
                return Err(Wrong::words(What::Pwm, expected, found));
            }
            pulses.set(clock, self.eval.pwm());
        }
        self.cells()
    }

    /// Cells of variables that the language has written whole, once that has had its time.
    fn cells(&mut self) -> Result<(), Wrong> {
        if self.eval.eeprom_busy() > 0 {
            return Ok(());
        }
        for kept in &self.board.kept {
            let value = self.eval.get(kept.symbol).to_le_bytes();
            let cells: Vec<u8> =
                self.eval.eeprom().iter().skip(kept.addr as usize).take(kept.bytes as usize).copied().collect();
            if !value.starts_with(&cells) {
                continue;
            }
            for (addr, &expected) in (kept.addr..).zip(&cells) {
                self.compared += 1;
                let found = self.cpu.peek("eeprom", addr);
                if found != Some(expected) {
                    let found = found.map_or_else(|| "no cell".to_owned(), |found| format!("0x{found:02X}"));
                    let expected = format!("0x{expected:02X} in cell {addr} of the EEPROM");
                    return Err(Wrong::words(What::Eeprom, expected, found));
                }
            }
        }
        Ok(())
    }
}

/// The board around a chip that has just got its power.
pub(crate) fn wire<C: Target>(cpu: &mut C, board: &Board) {
    let now = Time::at(0);
    for &pin in &board.inputs {
        cpu.drive(now, pin, Level::Low);
    }
    let open = |pin| nature(board.chip, pin).is_some_and(|nature| nature.high == High::Open);
    for &(_, pin) in board.outputs.iter().filter(|output| open(output.1)) {
        cpu.drive(now, pin, Level::PullUp);
    }
    for &(_, pin) in &board.peripherals.analog {
        board.peripherals.put(cpu, pin, 0);
    }
    if let Some(pin) = board.peripherals.receive {
        cpu.drive(now, pin, Level::High);
    }
}

fn words(level: Level) -> String {
    match level {
        Level::Low => "low",
        Level::High => "high",
        Level::Float | Level::PullUp | Level::PullDown => "floating",
    }
    .to_owned()
}

fn named(byte: u8) -> String {
    let shown = if byte.is_ascii_graphic() { format!(" `{}`", char::from(byte)) } else { String::new() };
    format!("byte 0x{byte:02X}{shown} sent")
}
