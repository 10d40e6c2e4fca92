//! `emu run --scenario`, `--stimulus` and `--record`: scenarios on a chip with an image.
//!
//! A tick is a clock of the oscillator. Drives are queued ahead of their time, so that each acts in its own clock; conditions are
//! looked at between two instructions: after each edge of a pin that they name, and after every instruction where they name memory.

mod stimuli;

use std::sync::Arc;

use emu_core::chip::Chip;
use emu_core::cpu::{Cpu, Reset};
use emu_core::pins::{Level, Time};
use emu_debug::scene::{Given, Seen, Table};
use emu_debug::stimulus::{FIRST_SUPPLY, Put, apply};
use emu_debug::{Clock, Drive, Going, Host, Sender, Watched};
use scenario::{Bound, Done, Next, Player, Reading, Recorder, Value, Verdict, World};

pub use stimuli::Asked;

use crate::fail::Failure;
use crate::family;
use crate::output;
use crate::snapshots::Shelf;

/// Machine cycles by which drives are queued ahead of their time.
const AHEAD: u64 = 1 << 10;

/// Scenarios on one machine.
pub struct Stage<'a> {
    chip: &'static Chip,
    clock: Clock,
    table: Table,
    /// The one that decides, and stimuli beside it.
    main: Option<Player>,
    beside: Vec<Player>,
    /// What sends to the chip's receiver.
    line: Option<Sender>,
    /// What the supply is set to, in millivolts, and when.
    supplies: Vec<(Time, u32)>,
    /// The tick up to which the machine need not be asked.
    next: u64,
    started: bool,
    pub verdict: Option<Verdict>,
    pub recorder: Option<Recorder>,
    shelf: Shelf,
    /// What was done to the pins and the supply, where somebody wants to do it again.
    pub drives: Option<Vec<Drive>>,
    /// Whether the user wants to wait any longer; told what was sent.
    pub patience: &'a mut dyn FnMut(&[u8]) -> bool,
}

/// What a stage is made of.
pub struct Cast {
    pub table: Table,
    /// What the supply is set to beside it, in millivolts, and when.
    pub supplies: Vec<(Time, u32)>,
    pub main: Option<Bound>,
    pub beside: Vec<Bound>,
    pub baud: u64,
    pub recorder: Option<Recorder>,
    pub shelf: Shelf,
}

impl<'a> Stage<'a> {
    /// Nothing has happened yet.
    ///
    /// # Errors
    /// `--baud` is a rate that no line has; that of a scenario was looked at as it was bound.
    pub fn new(
        chip: &'static Chip,
        clock: Clock,
        cast: Cast,
        patience: &'a mut dyn FnMut(&[u8]) -> bool,
    ) -> Result<Stage<'a>, Failure> {
        let Cast { table, supplies, main, beside, baud, recorder, shelf } = cast;
        let sends = main.iter().chain(&beside).any(|bound| bound.sends);
        let baud = main.iter().find_map(|bound| bound.baud).unwrap_or(baud);
        let line = family::receive_pin(chip).filter(|_| sends).map(|pin| Sender::new(pin, baud)).transpose();
        let line = line.map_err(|why| Failure::value("--baud <RATE>", &baud.to_string(), &why))?;
        let player = |bound: Bound| Player::new(Arc::new(bound));
        Ok(Stage {
            chip,
            clock,
            table,
            main: main.map(player),
            beside: beside.into_iter().map(player).collect(),
            line,
            supplies,
            next: 0,
            started: false,
            verdict: None,
            recorder: recorder.map(|mut recorder| {
                recorder.baud = recorder.baud.or(sends.then_some(baud));
                recorder
            }),
            shelf,
            drives: None,
            patience,
        })
    }

    /// What is done before the first cycle.
    pub fn start<C: Cpu>(&mut self, cpu: &mut C) {
        if let Some(sender) = &self.line {
            let (at, pin) = (Time::at(cpu.cycle()), sender.pin);
            cpu.drive(at, pin, Level::High);
            self.note(Drive { at, put: Put::Level(pin, Level::High) });
            let tick = cpu.cycle().saturating_mul(self.clocks());
            let name = self.chip.pins.get(usize::from(pin)).map_or("", |pin| pin.name);
            self.record(tick, || Done::Set(name.to_owned(), Value::Number(1)));
        }
        self.started = true;
        self.look(cpu, &[]);
    }

    fn clocks(&self) -> u64 {
        u64::from(self.clock.clocks_per_cycle.max(1))
    }

    /// Lets all players look; sets when to look next, and the verdict at the end.
    fn look<C: Cpu>(&mut self, cpu: &mut C, sent: &[u8]) {
        let (mut main, mut beside) = (self.main.take(), std::mem::take(&mut self.beside));
        let mut next = u64::MAX;
        let mut floor = Floor { stage: self, cpu, sent };
        let mut verdict = None;
        for player in &mut beside {
            if let Next::At(tick) = player.look(&mut floor) {
                next = next.min(tick);
            }
        }
        if let Some(player) = &mut main {
            match player.look(&mut floor) {
                Next::At(tick) => next = next.min(tick),
                Next::Done(done) => verdict = Some(done),
            }
        }
        (self.main, self.beside, self.next) = (main, beside, next);
        self.verdict = self.verdict.take().or(verdict);
    }

    /// The verdict, where the run ended before the scenario did.
    pub fn end<C: Cpu>(&mut self, cpu: &mut C, sent: &[u8], why: &str) -> Option<Verdict> {
        if self.verdict.is_none() {
            self.look(cpu, sent);
        }
        if let (None, Some(mut player)) = (&self.verdict, self.main.take()) {
            let floor = Floor { stage: self, cpu, sent };
            self.verdict = Some(player.give_up(&floor, why));
        }
        self.verdict.clone()
    }

    /// The recording, which lasts up to now.
    pub fn recording<C: Cpu>(&self, cpu: &C) -> Option<String> {
        self.recorder.as_ref().map(|recorder| recorder.write(cpu.cycle().saturating_mul(self.clocks())))
    }

    /// What the supply is at, in millivolts.
    fn supply(&self, time: Time) -> u32 {
        let before = self.supplies.iter().filter(|(at, _)| *at <= time);
        before.max_by_key(|(at, _)| *at).map_or(FIRST_SUPPLY, |(_, millivolts)| *millivolts)
    }

    fn note(&mut self, drive: Drive) {
        if let Some(drives) = &mut self.drives {
            drives.push(drive);
        }
    }

    fn record(&mut self, tick: u64, done: impl FnOnce() -> Done) {
        if let Some(recorder) = &mut self.recorder {
            recorder.push(tick, done());
        }
    }
}

impl<C: Cpu> Host<C> for Stage<'_> {
    fn going(&mut self, cpu: &mut C, sent: &[u8], watched: &mut Watched) -> Going {
        if !(self.patience)(sent) {
            return Going::Stop;
        }
        self.look(cpu, sent);
        if self.verdict.is_some() {
            return Going::Over;
        }
        // Somebody still wants time to pass.
        cpu.insist(self.main.is_some() || self.next != u64::MAX);
        let now = cpu.cycle();
        watched.pins.clear();
        watched.bytes = false;
        let mut until = self.next.div_ceil(self.clocks());
        if let Some(player) = &self.main {
            watched.bytes = player.listens();
            for output in player.watched() {
                match self.table.seen.get(output) {
                    Some(Seen::Pin(pin)) => watched.pins.push(*pin),
                    // Registers of the chip change by themselves.
                    Some(Seen::Memory(..)) => until = now + 1,
                    None => {}
                }
            }
        }
        Going::Until(until.max(now + 1))
    }

    fn waits(&self) -> bool {
        self.main.is_some() && self.verdict.is_none()
    }

    fn over(&mut self, _: &mut C, sent: &[u8]) {
        (self.patience)(sent);
    }
}

/// A chip as its scenario sees it between two instructions.
struct Floor<'f, 'a, C> {
    stage: &'f mut Stage<'a>,
    cpu: &'f mut C,
    sent: &'f [u8],
}

impl<C: Cpu> Floor<'_, '_, C> {
    /// When something is done that is asked for at a tick: what stands behind a look at the machine comes behind its instruction.
    fn when(&self, tick: u64) -> (u64, Time) {
        let (tick, clocks) = (tick.max(self.now()), self.stage.clocks());
        (tick, Time { cycle: tick / clocks, phase: (tick % clocks) as u8 })
    }
}

impl<C: Cpu> World for Floor<'_, '_, C> {
    fn now(&self) -> u64 {
        self.cpu.cycle().saturating_mul(self.stage.clocks())
    }

    fn ahead(&self) -> u64 {
        AHEAD * self.stage.clocks()
    }

    fn put(&mut self, input: usize, at: u64) -> Result<(), String> {
        let Some((given, name, value)) = self.stage.table.given.get(input).cloned() else { return Ok(()) };
        let (tick, time) = self.when(at);
        match given {
            Given::Put(put) => {
                if let Put::Supply(millivolts) = put {
                    self.stage.supplies.push((time, millivolts));
                }
                apply(self.cpu, Drive { at: time, put }, &mut self.stage.supply(time))?;
                self.stage.note(Drive { at: time, put });
            }
            Given::Poke(space, addr, bytes) => {
                for (addr, byte) in (addr..).zip(bytes) {
                    self.cpu.poke(space, addr, byte);
                }
            }
        }
        self.stage.record(tick, || Done::Set(name, value));
        Ok(())
    }

    fn read(&self, output: usize) -> Reading {
        self.stage.table.seen.get(output).map_or(Reading::Floating, |seen| seen.read(self.cpu))
    }

    fn send(&mut self, bytes: &[u8], at: u64) -> Result<(), String> {
        let ((tick, time), clock) = (self.when(at), self.stage.clock);
        let Some(sender) = &mut self.stage.line else { return Ok(()) };
        for drive in sender.send(clock, time, bytes)? {
            apply(self.cpu, drive, &mut self.stage.supply(time))?;
            self.stage.note(drive);
        }
        self.stage.record(tick, || Done::Send(bytes.to_vec()));
        Ok(())
    }

    fn received(&self) -> &[u8] {
        self.sent
    }

    fn power_cycle(&mut self) -> Result<(), String> {
        self.cpu.reset(Reset::PowerOn);
        let now = self.now();
        self.stage.record(now, || Done::PowerCycle);
        Ok(())
    }

    fn snapshot(&mut self, file: &str) -> Result<(), String> {
        let written = self.stage.shelf.write_within(file, self.cpu.cycle(), &self.cpu.save());
        written.map_err(|failure| format!("no snapshot was written: {}", failure.sentence()))
    }

    fn log(&mut self, line: &str) {
        let moment = self.moment(self.now());
        output::tell(&format!("{moment}: {line}\n"));
    }

    fn moment(&self, tick: u64) -> String {
        let cycle = tick / self.stage.clocks();
        format!("cycle {cycle} ({} s)", self.stage.clock.seconds(cycle))
    }
}
