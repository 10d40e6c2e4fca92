//! `emu debug --scenario`: what a scenario does from outside is queued before the first cycle, so that going through time again does it
//! again. One that expects or waits is played to its end first, on a copy of the machine, since only that tells when its steps are done.

use std::collections::BTreeSet;

use diag::Diagnostic;
use emu_check::{Outside, Rehearsal, Slot, edges};
use emu_core::cpu::Cpu;
use emu_core::pins::{Level, PinId, Time};
use emu_debug::debug::{Action, Goal, Look, Options, Rig, Scope, Session, Target, Why};
use emu_debug::run::run_on;
use emu_debug::scene::{ChipSite, Table, drives};
use emu_debug::stimulus::{Put, can};
use emu_debug::{Board, Clock, Drive, Names, Plan};
use ladder_compile::Special;
use ladder_view::View;
use scenario::{Outcome, Verdict, bind};

use crate::fail::Failure;
use crate::run::scenario::{Cast, Stage};
use crate::scenarios::File;
use crate::snapshots::Shelf;
use crate::{avr, family, output};

/// Machine cycles in which a chip comes to its first scan, besides periods.
const RESET: u64 = 2_000_000;

/// Periods in which it comes to the end of the next one.
const PERIODS: u64 = 4;

/// What is known beside the machine.
pub(super) struct Around<'a> {
    /// The file of the program.
    pub program: &'a str,
    pub names: Names<'a>,
    pub clock: Clock,
    /// Bits per second of what is sent, unless the scenario says another.
    pub baud: u64,
    /// The line to the chip belongs to `--uart-in`.
    pub deaf: bool,
    /// Pins that the command line and devices drive.
    pub driven: Vec<PinId>,
    /// What the command line makes of the supply, in millivolts, and when.
    pub supplies: Vec<(Time, u32)>,
    pub shelf: Shelf,
}

impl Around<'_> {
    /// Why bytes cannot be sent, where they cannot.
    fn taken(&self) -> Option<String> {
        self.deaf.then(|| "--uart-in has the line already".to_owned())
    }
}

/// What is to be queued. How the scenario ends is told.
pub(super) fn staged<C: Cpu + 'static>(
    file: &File,
    view: Option<&View>,
    (cpu, board): (C, Board),
    around: &Around<'_>,
) -> Result<Vec<Drive>, Failure> {
    if let Some(view) = view {
        match Scans::new(file, view, around) {
            Ok(scans) => return scans.play(file, Box::new(Rig::new(cpu, board))),
            // A recording of such a session speaks of pins.
            Err(faults) if faults.iter().any(|fault| fault.code == scenario::NO_NAME) => {
                return of_image(file, (cpu, board), around).map_err(|other| match other {
                    Failure::Refused(all, _) if all.iter().any(|fault| fault.code == scenario::NO_NAME) => {
                        file.refused(faults)
                    }
                    other => other,
                });
            }
            Err(faults) => return Err(file.refused(faults)),
        }
    }
    of_image(file, (cpu, board), around)
}

/// On pins, at clocks, as in `emu run`.
fn of_image<C: Cpu>(file: &File, (mut cpu, mut board): (C, Board), around: &Around<'_>) -> Result<Vec<Drive>, Failure> {
    let (chip, clock) = (cpu.chip(), around.clock);
    let refused = |faults| file.refused(faults);
    let (bound, ahead, table) = {
        let there = |space: &str, addr: u32| cpu.peek(space, addr).is_some();
        let has_pin = |pin: PinId| cpu.has_pin(pin);
        let own = |name: &str| avr::own_name(chip, name);
        let mut site = ChipSite {
            names: around.names,
            clock,
            there: &there,
            has_pin: &has_pin,
            can: &|put| can(&cpu, put),
            own: &own,
            serial: (family::has_uart(chip), family::receive_pin(chip)),
            stateless: Some("a session writes its snapshots by `save`".to_owned()),
            deaf: around.taken(),
            table: Table::default(),
        };
        let bound = bind(&file.scenario, &mut site, Some(around.program), Some(chip.name)).map_err(refused)?;
        bound.outside(&|id| site.table.is_outside(id)).map_err(refused)?;
        let ahead = drives(&file.scenario, &mut site, Some(around.program), around.baud);
        (bound, ahead, site.table)
    };
    if let Ok(drives) = ahead {
        let last = drives.last().map_or(0, |drive| drive.at.cycle);
        let end = format!("up to cycle {last} ({} s)", clock.seconds(last));
        output::tell(&format!("scenario: nothing is expected; queued {} drive(s) {end}\n", drives.len()));
        return Ok(drives);
    }
    let plan = Plan { limit: bound.cycles(clock.clocks_per_cycle), ..Plan::default() };
    let cast = Cast {
        table,
        supplies: around.supplies.clone(),
        main: Some(bound),
        beside: Vec::new(),
        baud: around.baud,
        recorder: None,
        shelf: around.shelf.clone(),
    };
    let mut patience = |_: &[u8]| true;
    let mut stage = Stage::new(chip, clock, cast, &mut patience)?;
    stage.drives = Some(Vec::new());
    stage.start(&mut cpu);
    let ended = run_on(&mut board, &mut cpu, &plan, None, &mut stage);
    if let Some(verdict) = stage.end(&mut cpu, &ended.uart, "the run ended") {
        let cycle = verdict.tick / u64::from(clock.clocks_per_cycle.max(1));
        tell(file, &verdict, (cycle, &format!("{} s", clock.seconds(cycle))));
    }
    let mut queued = stage.drives.take().unwrap_or_default();
    // What it had done up to its end; a byte that has begun goes on.
    let (end, line) = (Time::at(cpu.cycle()), family::receive_pin(chip));
    queued.retain(|drive| drive.at <= end || line.is_some() && drive.pin() == line);
    queued.sort_by_key(|drive| drive.at);
    Ok(queued)
}

/// Runs to a program word; gives the cycle, nothing where it does not come there.
fn arrives(session: &mut Session, word: u32, until: u64) -> Option<u64> {
    let goal = Goal { until: Some(until), words: BTreeSet::from([word]), passes: false };
    (session.run(&goal, &mut || true).why == Why::Done).then(|| session.target().cycle())
}

/// Tells how a scenario ended.
fn tell(file: &File, verdict: &Verdict, (cycle, moment): (u64, &str)) {
    let end = match verdict.outcome {
        Outcome::Passed => {
            output::tell(&format!("scenario: passed, {} step(s), up to cycle {cycle} ({moment})\n", file.steps()));
            return;
        }
        Outcome::Failed => "failed",
        Outcome::NoResult => "had no result",
    };
    let step = verdict.step.map_or_else(String::new, |step| format!("step {step} (line {}) ", verdict.pos.line));
    let why = verdict.why.trim_end_matches(',');
    output::tell(&format!("scenario: {step}{end} at cycle {cycle} ({moment}): {why}\n"));
}

/// A ladder program, scan by scan: the evaluator plays, and the chip runs beside it and says what its symbols are.
struct Scans<'a> {
    play: Rehearsal,
    view: &'a View,
    around: &'a Around<'a>,
    /// What was given up to now.
    last: Outside,
}

impl<'a> Scans<'a> {
    fn new(file: &File, view: &'a View, around: &'a Around<'a>) -> Result<Scans<'a>, Vec<Diagnostic>> {
        let mut play = Rehearsal::new(view.program())?;
        play.site().deaf = around.taken();
        let bound = bind(&file.scenario, play.site(), Some(&view.program().file), Some(around.names.chip.name))?;
        let site = play.site();
        bound.outside(&|id| site.is_outside(id))?;
        play.play(bound);
        let last = Outside { levels: Vec::new(), counts: Vec::new(), byte: None, arrives: 0 };
        Ok(Scans { play, view, around, last })
    }

    /// What was put on, and when: each behind the end of a scan, before the next.
    fn play(mut self, file: &File, target: Box<dyn Target>) -> Result<Vec<Drive>, Failure> {
        let (map, chip) = (self.view.map(), self.around.names.chip);
        let options = Options { clock: self.around.clock, history: 0, follow: None };
        let mut session = Session::new(target, Scope::new(chip), options);
        let places: Vec<_> = self.view.symbols().into_iter().map(|(_, place)| place).collect();
        let period = map.cycle.num / map.cycle.den.max(1);
        let (start, end) = (self.view.scan_start(), map.scan_end / chip.word_bytes.max(1));
        let mut begun: Option<u64> = None;
        let why = loop {
            let read = |symbol: usize| {
                places.get(symbol).and_then(|place| place.value(session.target())).map_or(0, |value| value as i32)
            };
            let goes_on = self.play.scan_beside(Some(&read));
            self.play.told().iter().for_each(|line| output::tell(&format!("{line}\n")));
            if !goes_on {
                break "it was stopped";
            }
            let first = begun.is_none() && session.target().pc() == start;
            self.give(&mut session, begun, (period, start)).map_err(Failure::Usage)?;
            let until = session.target().cycle().saturating_add(PERIODS * period + RESET);
            // A controller begins with its program.
            begun = if first { Some(session.target().cycle()) } else { arrives(&mut session, start, until) };
            // Where a scan ends with its first instruction there is nothing more to run.
            if begun.is_none() || (first || end != start) && arrives(&mut session, end, until).is_none() {
                break "the chip did not come to the end of a scan";
            }
        };
        let verdict = self.play.end(why);
        tell(file, &verdict, (session.target().cycle(), &verdict.moment));
        let drive = |(_, action): (u64, &Action)| match action {
            Action::Drive(drive) => Some(*drive),
            _ => None,
        };
        Ok(session.deeds().filter_map(drive).collect())
    }

    /// Drives what is another now than it was. `begun`: the start of the scan that has ended.
    fn give(&mut self, session: &mut Session, begun: Option<u64>, (period, start): (u64, u32)) -> Result<(), String> {
        let next = self.play.outside();
        let (chip, at) = (self.around.names.chip, Time::at(session.target().cycle()));
        let pin = |name: &str| chip.pin(&self.view.own_pin(name));
        let mut puts = Vec::new();
        // Inputs are low at first.
        for (name, level) in &next.levels {
            let old = self.last.levels.iter().find(|(other, _)| other == name).is_some_and(|(_, level)| *level);
            puts.extend(pin(name).filter(|_| old != *level).map(|pin| Put::Level(pin, Level::of(*level))));
        }
        for (name, count) in &next.counts {
            let old = self.last.counts.iter().find(|(other, _)| other == name).map(|(_, count)| *count);
            let mine = |pin: &PinId| old.is_some() || !self.around.driven.contains(pin);
            puts.extend(pin(name).filter(|_| old != Some(*count)).filter(mine).map(|pin| Put::Counts(pin, *count)));
        }
        for put in puts {
            session.act(Action::Drive(Drive { at, put }))?;
        }
        if let Some(byte) = next.byte {
            self.send(session, byte, next.arrives, begun, (period, start))?;
        }
        self.last = next;
        Ok(())
    }

    /// A byte on its way to the chip, such that it arrives while the chip waits for a scan.
    fn send(
        &self,
        session: &mut Session,
        byte: u8,
        arrives: u64,
        begun: Option<u64>,
        (period, start): (u64, u32),
    ) -> Result<(), String> {
        let line = self.view.map().specials.iter().find_map(|special| match special {
            Special::Receive { pin, baud } => Some((self.around.names.chip.pin(pin)?, *baud)),
            _ => None,
        });
        let Some((pin, baud)) = line else { return Ok(()) };
        // Before the first scan nobody listens yet: a copy of the machine tells when that is.
        let begun = begun.unwrap_or_else(|| {
            let mut copy = session.target().fork();
            copy.set_traps(&BTreeSet::from([start]));
            copy.run(copy.cycle().saturating_add(PERIODS * period + RESET), Look::Nothing, &mut ());
            copy.cycle().saturating_sub(period)
        });
        let clocks = u64::from(self.around.clock.clocks_per_cycle.max(1));
        let busy = u64::from(self.view.map().worst_scan_cycles).saturating_add(self.view.map().poll_cycles.into());
        let slot = Slot {
            hz: self.around.clock.hz,
            baud,
            now: session.target().cycle().max(begun).saturating_add(1).saturating_mul(clocks),
            scan: (begun.saturating_mul(clocks), busy.saturating_mul(clocks)),
            period: period.saturating_mul(clocks),
            after: arrives + 1,
        };
        for (clock, high) in edges(byte, slot) {
            let at = Time { cycle: clock / clocks, phase: (clock % clocks) as u8 };
            session.act(Action::Drive(Drive { at, put: Put::Level(pin, Level::of(high)) }))?;
        }
        Ok(())
    }
}
