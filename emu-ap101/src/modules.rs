//! Modules that time and count: R 0 to 127.
//!
//! A module is written like an output and read like an input. In units of time nothing is counted: a module keeps the machine cycle
//! from which it measures and says what it is at any other. In the unit *program cycle*, and in counters, it is the element of the
//! same name of ladder diagrams (docs/semantics.md, dialect `ldmicro-2.3`) with the preset as P: numbers of 16 bits with a sign.

use emu_core::NEVER;
use emu_core::state::{Damaged, State, Tape};

/// What a module is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Nothing.
    None,
    /// On-delay.
    Ton,
    /// Off-delay.
    Tof,
    /// On-delay that keeps what it has timed.
    Rto,
    /// Pulse.
    Tp,
    /// Counter up.
    Ctu,
    /// Counter down.
    Ctd,
    /// Counter that begins anew behind its preset.
    Ctc,
}

impl Kind {
    /// By the numbers that the configuration has for them.
    pub const ALL: [Kind; 8] = [Kind::None, Kind::Ton, Kind::Tof, Kind::Rto, Kind::Tp, Kind::Ctu, Kind::Ctd, Kind::Ctc];

    /// It counts rising edges of what is written.
    #[must_use]
    pub const fn counts(self) -> bool {
        matches!(self, Kind::Ctu | Kind::Ctd | Kind::Ctc)
    }
}

/// In what a module times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Program cycles in which it is written.
    Cycle,
    /// 1 ms.
    Ms1,
    /// 10 ms.
    Ms10,
    /// 100 ms.
    Ms100,
}

impl Unit {
    /// By the numbers that the configuration has for them.
    pub const ALL: [Unit; 4] = [Unit::Cycle, Unit::Ms1, Unit::Ms10, Unit::Ms100];

    /// Milliseconds; 0 for program cycles.
    #[must_use]
    pub const fn ms(self) -> u64 {
        match self {
            Unit::Cycle => 0,
            Unit::Ms1 => 1,
            Unit::Ms10 => 10,
            Unit::Ms100 => 100,
        }
    }
}

/// How a module is configured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// What it is.
    pub kind: Kind,
    /// In what it times; of no meaning to counters.
    pub unit: Unit,
    /// Units, or the count, at which it switches.
    pub preset: u16,
}

impl Settings {
    /// No module.
    pub const NONE: Settings = Settings { kind: Kind::None, unit: Unit::Cycle, preset: 0 };
}

/// A thousand clocks are this many machine cycles: a machine cycle has two.
const CYCLES_PER_1000_CLOCKS: u64 = 500;

/// A module. Times are machine cycles.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Module {
    settings: Settings,
    hz: u64,
    preset: u16,
    /// What was written last: its enable, or the input of a counter.
    level: bool,
    /// TOF: it has fallen and not risen since. TP: a pulse was begun.
    begun: bool,
    /// The cycle from which it measures.
    since: u64,
    /// RTO: cycles measured before that.
    kept: u64,
    /// Program cycles or edges.
    count: i16,
    /// Q as the last write left it, where that decides.
    out: bool,
    /// TOF in program cycles: it has been written before.
    ran: bool,
    /// The program cycle in which it advanced last, by its first machine cycle.
    advanced: Option<u64>,
}

/// That it has advanced counts only in the program cycle that has begun at [`Tape::now`].
impl State for Module {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        let Module { settings: _, hz: _, preset, level, begun, since, kept, count, out, ran, advanced } = self;
        let mut word = *count as u16;
        preset.state(tape)?;
        level.state(tape)?;
        begun.state(tape)?;
        since.state(tape)?;
        kept.state(tape)?;
        word.state(tape)?;
        out.state(tape)?;
        ran.state(tape)?;
        let this = tape.flag(*advanced == Some(tape.now()))?;
        *advanced = this.then_some(tape.now());
        *count = word as i16;
        tape.demand(*since != NEVER && *kept != NEVER)
    }
}

impl Module {
    /// A module at zero, on a machine with a clock of `hz`.
    #[must_use]
    pub const fn new(settings: Settings, hz: u64) -> Module {
        Module {
            settings,
            hz,
            preset: settings.preset,
            level: false,
            begun: false,
            since: 0,
            kept: 0,
            count: 0,
            out: false,
            ran: false,
            advanced: None,
        }
    }

    /// There is one.
    #[must_use]
    pub fn exists(&self) -> bool {
        self.settings.kind != Kind::None
    }

    /// The preset as it stands.
    #[must_use]
    pub const fn preset(&self) -> u16 {
        self.preset
    }

    /// Changes the preset, which does not touch what it has timed or counted.
    pub const fn set_preset(&mut self, preset: u16) {
        self.preset = preset;
    }

    /// It measures time.
    fn timed(&self) -> bool {
        !self.settings.kind.counts() && self.settings.unit != Unit::Cycle
    }

    /// Machine cycles that it has measured by `cycle`.
    fn elapsed(&self, cycle: u64) -> u64 {
        let measured = cycle.saturating_sub(self.since);
        match self.settings.kind {
            Kind::Ton if self.level => measured,
            Kind::Tof | Kind::Tp if self.begun => measured,
            Kind::Rto => self.kept + if self.level { measured } else { 0 },
            _ => 0,
        }
    }

    /// As many units have passed as the preset has: elapsed clocks / hz >= preset * unit.
    fn reached(&self, cycle: u64) -> bool {
        let wanted = u64::from(self.preset) * self.settings.unit.ms() * self.hz;
        self.elapsed(cycle) >= wanted.div_ceil(1_000_000 / CYCLES_PER_1000_CLOCKS)
    }

    /// Q at a machine cycle.
    #[must_use]
    pub fn q(&self, cycle: u64) -> bool {
        if !self.timed() {
            return self.out;
        }
        match self.settings.kind {
            Kind::Ton => self.level && self.reached(cycle),
            Kind::Tof => self.level || self.begun && !self.reached(cycle),
            Kind::Rto => self.reached(cycle),
            Kind::Tp => self.begun && !self.reached(cycle),
            _ => false,
        }
    }

    /// It is timing, or has a count that is not 0.
    #[must_use]
    pub fn running(&self, cycle: u64) -> bool {
        match self.settings.kind {
            Kind::Ton | Kind::Rto => self.level && !self.q(cycle),
            Kind::Tof => !self.level && self.q(cycle),
            Kind::Tp => self.q(cycle),
            Kind::Ctu | Kind::Ctd | Kind::Ctc => self.count != 0,
            Kind::None => false,
        }
    }

    /// Whole units that it has measured, at most 65,535; the count.
    #[must_use]
    pub fn value(&self, cycle: u64) -> u16 {
        if !self.timed() {
            return self.count as u16;
        }
        let unit = u128::from(self.settings.unit.ms()) * u128::from(self.hz);
        let clocks = u128::from(self.elapsed(cycle)) * (1_000_000 / u128::from(CYCLES_PER_1000_CLOCKS));
        u16::try_from(clocks / unit.max(1)).unwrap_or(u16::MAX)
    }

    /// From the machine cycle `now` on it does what `before`, itself as it was then, did from the earlier cycle `then` on, if presets
    /// stay and it is written alike: it began to measure anew on the way, or has no more to wait for.
    pub(crate) fn goes_on_as(&self, now: u64, before: &Module, then: u64) -> bool {
        let since = |since| Module { since, advanced: self.advanced, ..before.clone() };
        let waits = self.timed() && !before.reached(then) && self.elapsed(now) != before.elapsed(then);
        *self == since(before.since + (now - then)) || !waits && *self == since(before.since)
    }

    /// It has done for `cycles` more, round by round, what it did in a round that began at the cycle `then`.
    pub(crate) const fn repeat(&mut self, then: u64, cycles: u64) {
        if self.since > then {
            self.since += cycles;
        }
    }

    /// It is written; the new level holds from the machine cycle `cycle` on, in the program cycle that began at `begun`.
    pub fn write(&mut self, level: bool, cycle: u64, begun: u64) {
        let (rises, falls) = (level && !self.level, !level && self.level);
        if self.settings.kind.counts() {
            self.count(level, rises);
        } else if self.timed() {
            self.time(rises, falls, cycle);
        } else if self.advanced.replace(begun) != Some(begun) {
            self.advance(level, rises);
        }
        self.level = level;
    }

    fn time(&mut self, rises: bool, falls: bool, cycle: u64) {
        match self.settings.kind {
            Kind::Ton | Kind::Rto if rises => self.since = cycle,
            Kind::Rto if falls => self.kept = self.elapsed(cycle),
            Kind::Tof if rises || falls => (self.begun, self.since) = (falls, cycle),
            Kind::Tp if rises && !self.q(cycle) => (self.begun, self.since) = (true, cycle),
            _ => {}
        }
    }

    /// The preset of the ladder elements.
    const fn limit(&self) -> i16 {
        self.preset as i16
    }

    fn count(&mut self, level: bool, rises: bool) {
        let n = self.count;
        self.count = match self.settings.kind {
            Kind::Ctu if rises => n.wrapping_add(1),
            Kind::Ctd if rises => n.wrapping_sub(1),
            Kind::Ctc if rises && n >= self.limit() => 0,
            Kind::Ctc if rises => n + 1,
            _ => n,
        };
        self.out = if self.settings.kind == Kind::Ctc { level } else { self.count >= self.limit() };
    }

    /// One program cycle of a timer.
    fn advance(&mut self, level: bool, rises: bool) {
        let limit = self.limit();
        // The first time that a TOF runs it has run out already.
        if !std::mem::replace(&mut self.ran, true) && self.settings.kind == Kind::Tof {
            self.count = limit;
        }
        let full = self.count >= limit;
        let busy = match self.settings.kind {
            Kind::Ton => {
                self.out = level && full;
                level && !full
            }
            Kind::Tof => {
                self.out = level || !full;
                !level && !full
            }
            Kind::Rto => {
                self.out = full;
                level && !full
            }
            Kind::Tp => {
                let again = rises && (full || !self.begun);
                self.count = if again { 0 } else { self.count };
                self.begun = if again { 0 < limit } else { self.begun && !full };
                self.out = self.begun;
                self.begun
            }
            _ => false,
        };
        let cleared = self.settings.kind == Kind::Ton && !level || self.settings.kind == Kind::Tof && level;
        self.count = if cleared { 0 } else { self.count + i16::from(busy) };
    }

    /// A 1 was written to its running bit: from the machine cycle `cycle` on it has measured and counted nothing.
    pub fn clear(&mut self, cycle: u64) {
        (self.since, self.kept) = (cycle, 0);
        self.set_count(0);
        if self.settings.kind == Kind::Tp {
            (self.begun, self.out) = (false, false);
        }
    }

    /// Changes what it has counted, program cycles or edges, and Q to what that makes of it. A module in a unit of time counts nothing:
    /// then nothing changes, and it is false.
    pub fn poke(&mut self, count: i16) -> bool {
        if !self.timed() {
            self.set_count(count);
        }
        !self.timed()
    }

    fn set_count(&mut self, count: i16) {
        self.count = count;
        let full = count >= self.limit();
        match self.settings.kind {
            Kind::Ton => self.out = self.level && full,
            Kind::Tof => self.out = self.ran && (self.level || !full),
            Kind::Rto | Kind::Ctu | Kind::Ctd => self.out = full,
            Kind::Tp | Kind::Ctc | Kind::None => {}
        }
    }
}
