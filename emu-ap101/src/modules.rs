//! Modules that time and count: R 0 to 127.
//!
//! A module is written like an output and read like an input. A module with a unit of time counts nothing: it
//! keeps the machine cycle from which it measures, and computes its state at any other cycle. A counter, or a
//! module with the unit *program cycle*, is the ladder element of the same name (docs/semantics.md, dialect
//! `ldmicro-2.3`) with the preset as P; these use signed 16-bit numbers.

use emu_core::NEVER;
use emu_core::device::Device;
use emu_core::state::{SnapshotDamaged, SnapshotState, StateTape};

use crate::config::{Ap101Config, MODULES};
use crate::operands::BitLocation;
use crate::soc::{Ap101Outbox, Ap101Signal};

/// The type of a module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModuleKind {
    /// No module.
    None,
    /// On-delay.
    Ton,
    /// Off-delay.
    Tof,
    /// Retentive on-delay: it keeps the time that it has measured.
    Rto,
    /// Pulse.
    Tp,
    /// Up counter.
    Ctu,
    /// Down counter.
    Ctd,
    /// Counter that restarts at 0 after its preset.
    Ctc,
}

impl ModuleKind {
    /// All types, indexed by their numbers in the configuration.
    pub const ALL: [ModuleKind; 8] = [
        ModuleKind::None,
        ModuleKind::Ton,
        ModuleKind::Tof,
        ModuleKind::Rto,
        ModuleKind::Tp,
        ModuleKind::Ctu,
        ModuleKind::Ctd,
        ModuleKind::Ctc,
    ];

    /// Whether the module counts rising edges of its input.
    #[must_use]
    pub const fn is_counter(self) -> bool {
        matches!(self, ModuleKind::Ctu | ModuleKind::Ctd | ModuleKind::Ctc)
    }
}

/// The unit in which a module times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModuleTimeUnit {
    /// Program cycles in which the module is written.
    Cycle,
    /// 1 ms.
    Ms1,
    /// 10 ms.
    Ms10,
    /// 100 ms.
    Ms100,
}

impl ModuleTimeUnit {
    /// All units, indexed by their numbers in the configuration.
    pub const ALL: [ModuleTimeUnit; 4] =
        [ModuleTimeUnit::Cycle, ModuleTimeUnit::Ms1, ModuleTimeUnit::Ms10, ModuleTimeUnit::Ms100];

    /// The unit in milliseconds; 0 for program cycles.
    #[must_use]
    pub const fn ms(self) -> u64 {
        match self {
            ModuleTimeUnit::Cycle => 0,
            ModuleTimeUnit::Ms1 => 1,
            ModuleTimeUnit::Ms10 => 10,
            ModuleTimeUnit::Ms100 => 100,
        }
    }
}

/// The configuration of a module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModuleSettings {
    /// Type of the module.
    pub kind: ModuleKind,
    /// Unit of time; not used by counters.
    pub unit: ModuleTimeUnit,
    /// Number of units, or count, at which it switches.
    pub preset: u16,
}

impl ModuleSettings {
    /// No module.
    pub const NONE: ModuleSettings = ModuleSettings { kind: ModuleKind::None, unit: ModuleTimeUnit::Cycle, preset: 0 };
}

/// Machine cycles per 1000 clocks: a machine cycle has two clocks.
const CYCLES_PER_1000_CLOCKS: u64 = 500;

/// The state of a module. Times are in machine cycles.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ap101Module {
    settings: ModuleSettings,
    hz: u64,
    preset: u16,
    /// The last value written: its enable, or the input of a counter.
    input: bool,
    /// TOF: the input has fallen and not risen since. TP: a pulse has started.
    has_started: bool,
    /// The cycle from which it measures.
    since: u64,
    /// RTO: cycles measured before `since`.
    accumulated: u64,
    /// Number of program cycles or edges.
    count: i16,
    /// Q after the last write, for counters and the unit program cycle.
    output: bool,
    /// Whether it has been written before; used by TOF in program cycles.
    was_written: bool,
    /// The program cycle in which it last advanced, given by its first machine cycle.
    advanced_in: Option<u64>,
}

/// Whether the module has advanced matters only in the program cycle that began at [`StateTape::now`].
impl SnapshotState for Ap101Module {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        let Ap101Module {
            settings: _,
            hz: _,
            preset,
            input: level,
            has_started,
            since,
            accumulated: kept,
            count,
            output: out,
            was_written: ran,
            advanced_in: advanced,
        } = self;
        let mut word = *count as u16;
        preset.pass_state(tape)?;
        level.pass_state(tape)?;
        has_started.pass_state(tape)?;
        since.pass_state(tape)?;
        kept.pass_state(tape)?;
        word.pass_state(tape)?;
        out.pass_state(tape)?;
        ran.pass_state(tape)?;
        let this = tape.pass_flag(*advanced == Some(tape.now()))?;
        *advanced = this.then_some(tape.now());
        *count = word as i16;
        tape.require(*since != NEVER && *kept != NEVER)
    }
}

impl Ap101Module {
    /// A module in its initial state, on a machine with a clock of `hz`.
    #[must_use]
    pub const fn new(settings: ModuleSettings, hz: u64) -> Ap101Module {
        Ap101Module {
            settings,
            hz,
            preset: settings.preset,
            input: false,
            has_started: false,
            since: 0,
            accumulated: 0,
            count: 0,
            output: false,
            was_written: false,
            advanced_in: None,
        }
    }

    /// Whether the module exists.
    #[must_use]
    pub fn exists(&self) -> bool {
        self.settings.kind != ModuleKind::None
    }

    /// The present preset.
    #[must_use]
    pub const fn preset(&self) -> u16 {
        self.preset
    }

    /// Changes the preset, without a change of the measured time or count.
    pub const fn set_preset(&mut self, preset: u16) {
        self.preset = preset;
    }

    /// Whether the module measures time in milliseconds.
    fn is_timed_in_ms(&self) -> bool {
        !self.settings.kind.is_counter() && self.settings.unit != ModuleTimeUnit::Cycle
    }

    /// Number of machine cycles measured up to `cycle`.
    fn elapsed(&self, cycle: u64) -> u64 {
        let measured = cycle.saturating_sub(self.since);
        match self.settings.kind {
            ModuleKind::Ton if self.input => measured,
            ModuleKind::Tof | ModuleKind::Tp if self.has_started => measured,
            ModuleKind::Rto => self.accumulated + if self.input { measured } else { 0 },
            _ => 0,
        }
    }

    /// Whether the preset has been reached at `cycle`: elapsed clocks / hz >= preset * unit.
    fn has_elapsed(&self, cycle: u64) -> bool {
        let wanted = u64::from(self.preset) * self.settings.unit.ms() * self.hz;
        self.elapsed(cycle) >= wanted.div_ceil(1_000_000 / CYCLES_PER_1000_CLOCKS)
    }

    /// The output Q at a machine cycle.
    #[must_use]
    pub fn q(&self, cycle: u64) -> bool {
        if !self.is_timed_in_ms() {
            return self.output;
        }
        match self.settings.kind {
            ModuleKind::Ton => self.input && self.has_elapsed(cycle),
            ModuleKind::Tof => self.input || self.has_started && !self.has_elapsed(cycle),
            ModuleKind::Rto => self.has_elapsed(cycle),
            ModuleKind::Tp => self.has_started && !self.has_elapsed(cycle),
            _ => false,
        }
    }

    /// Whether the module is timing, or has a count other than 0.
    #[must_use]
    pub fn is_running(&self, cycle: u64) -> bool {
        match self.settings.kind {
            ModuleKind::Ton | ModuleKind::Rto => self.input && !self.q(cycle),
            ModuleKind::Tof => !self.input && self.q(cycle),
            ModuleKind::Tp => self.q(cycle),
            ModuleKind::Ctu | ModuleKind::Ctd | ModuleKind::Ctc => self.count != 0,
            ModuleKind::None => false,
        }
    }

    /// The measured time in whole units, at most 65,535, or the count.
    #[must_use]
    pub fn value(&self, cycle: u64) -> u16 {
        if !self.is_timed_in_ms() {
            return self.count as u16;
        }
        let unit = u128::from(self.settings.unit.ms()) * u128::from(self.hz);
        let clocks = u128::from(self.elapsed(cycle)) * (1_000_000 / u128::from(CYCLES_PER_1000_CLOCKS));
        u16::try_from(clocks / unit.max(1)).unwrap_or(u16::MAX)
    }

    /// Whether from the machine cycle `now` on it behaves as `before`, its copy at the earlier cycle `then`,
    /// did from then on, if presets stay and the same values are written. That is so if its measurement was
    /// restarted in between, or its time has already elapsed.
    pub(crate) fn repeats_as(&self, now: u64, before: &Ap101Module, then: u64) -> bool {
        let since = |since| Ap101Module { since, advanced_in: self.advanced_in, ..before.clone() };
        let waits = self.is_timed_in_ms() && !before.has_elapsed(then) && self.elapsed(now) != before.elapsed(then);
        *self == since(before.since + (now - then)) || !waits && *self == since(before.since)
    }

    /// Shifts its time by `cycles`, after repetitions of a period that began at the cycle `then` were
    /// skipped.
    pub(crate) const fn shift_time(&mut self, then: u64, cycles: u64) {
        if self.since > then {
            self.since += cycles;
        }
    }

    /// The program writes the module. The new level is valid from the machine cycle `cycle` on, in the
    /// program cycle that began at `cycle_start`.
    pub fn write(&mut self, level: bool, cycle: u64, cycle_start: u64) {
        let (rises, falls) = (level && !self.input, !level && self.input);
        if self.settings.kind.is_counter() {
            self.update_counter(level, rises);
        } else if self.is_timed_in_ms() {
            self.update_timer(rises, falls, cycle);
        } else if self.advanced_in.replace(cycle_start) != Some(cycle_start) {
            self.advance(level, rises);
        }
        self.input = level;
    }

    fn update_timer(&mut self, rises: bool, falls: bool, cycle: u64) {
        match self.settings.kind {
            ModuleKind::Ton | ModuleKind::Rto if rises => self.since = cycle,
            ModuleKind::Rto if falls => self.accumulated = self.elapsed(cycle),
            ModuleKind::Tof if rises || falls => (self.has_started, self.since) = (falls, cycle),
            ModuleKind::Tp if rises && !self.q(cycle) => (self.has_started, self.since) = (true, cycle),
            _ => {}
        }
    }

    /// The preset as the signed number of the ladder elements.
    const fn limit(&self) -> i16 {
        self.preset as i16
    }

    fn update_counter(&mut self, level: bool, rises: bool) {
        let n = self.count;
        self.count = match self.settings.kind {
            ModuleKind::Ctu if rises => n.wrapping_add(1),
            ModuleKind::Ctd if rises => n.wrapping_sub(1),
            ModuleKind::Ctc if rises && n >= self.limit() => 0,
            ModuleKind::Ctc if rises => n + 1,
            _ => n,
        };
        self.output = if self.settings.kind == ModuleKind::Ctc { level } else { self.count >= self.limit() };
    }

    /// Advances a timer by one program cycle.
    fn advance(&mut self, level: bool, rises: bool) {
        let limit = self.limit();
        // A TOF that is written for the first time has already elapsed.
        if !std::mem::replace(&mut self.was_written, true) && self.settings.kind == ModuleKind::Tof {
            self.count = limit;
        }
        let full = self.count >= limit;
        let busy = match self.settings.kind {
            ModuleKind::Ton => {
                self.output = level && full;
                level && !full
            }
            ModuleKind::Tof => {
                self.output = level || !full;
                !level && !full
            }
            ModuleKind::Rto => {
                self.output = full;
                level && !full
            }
            ModuleKind::Tp => {
                let again = rises && (full || !self.has_started);
                self.count = if again { 0 } else { self.count };
                self.has_started = if again { 0 < limit } else { self.has_started && !full };
                self.output = self.has_started;
                self.has_started
            }
            _ => false,
        };
        let cleared = self.settings.kind == ModuleKind::Ton && !level || self.settings.kind == ModuleKind::Tof && level;
        self.count = if cleared { 0 } else { self.count + i16::from(busy) };
    }

    /// A 1 was written to the running bit: from the machine cycle `cycle` on the module has measured and
    /// counted nothing.
    pub fn clear(&mut self, cycle: u64) {
        (self.since, self.accumulated) = (cycle, 0);
        self.set_count(0);
        if self.settings.kind == ModuleKind::Tp {
            (self.has_started, self.output) = (false, false);
        }
    }

    /// Sets the count of program cycles or edges, and Q accordingly. A module with a unit of time has no
    /// count; then nothing changes and the result is false.
    pub fn poke(&mut self, count: i16) -> bool {
        if !self.is_timed_in_ms() {
            self.set_count(count);
        }
        !self.is_timed_in_ms()
    }

    fn set_count(&mut self, count: i16) {
        self.count = count;
        let full = count >= self.limit();
        match self.settings.kind {
            ModuleKind::Ton => self.output = self.input && full,
            ModuleKind::Tof => self.output = self.was_written && (self.input || !full),
            ModuleKind::Rto | ModuleKind::Ctu | ModuleKind::Ctd => self.output = full,
            ModuleKind::Tp | ModuleKind::Ctc | ModuleKind::None => {}
        }
    }
}

/// All modules of a machine.
#[derive(Debug, Clone)]
pub(crate) struct Ap101Modules {
    modules: Box<[Ap101Module; MODULES]>,
    /// The first machine cycle of the present program cycle.
    cycle_start: u64,
}

impl SnapshotState for Ap101Modules {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        self.cycle_start = tape.now();
        tape.pass_slice(self.modules.as_mut_slice())
    }
}

impl Ap101Modules {
    /// All modules in their initial states, on a machine with a clock of `hz`.
    pub(crate) fn new(config: &Ap101Config, hz: u64) -> Ap101Modules {
        let modules = Box::new(config.modules.map(|settings| Ap101Module::new(settings, hz)));
        Ap101Modules { modules, cycle_start: 0 }
    }

    /// A program cycle begins at a machine cycle.
    pub(crate) const fn begin(&mut self, cycle: u64) {
        self.cycle_start = cycle;
    }

    /// A module, by number.
    pub(crate) fn module(&self, n: u16) -> &Ap101Module {
        &self.modules[usize::from(n) % MODULES]
    }

    /// A module, by number, for changes.
    pub(crate) fn module_mut(&mut self, n: u16) -> &mut Ap101Module {
        &mut self.modules[usize::from(n) % MODULES]
    }

    /// The modules that exist.
    pub(crate) fn existing(&self) -> impl Iterator<Item = &Ap101Module> {
        self.modules.iter().filter(|module| module.exists())
    }

    /// Shifts the time of all modules, as [`Ap101Module::shift_time`].
    pub(crate) fn shift_time(&mut self, then: u64, cycles: u64) {
        self.modules.iter_mut().for_each(|module| module.shift_time(then, cycles));
    }
}

/// A register is Q or the running bit of a module, and its value is 0 or 1. The time of a write is the
/// machine cycle from which it is visible. Modules compute their states when they are read, so nothing is
/// ever due.
impl Device<Ap101Signal> for Ap101Modules {
    type Reg = BitLocation;

    #[inline(always)]
    fn peek(&self, reg: BitLocation, t: u64) -> u8 {
        match reg {
            BitLocation::Module(n) => self.module(n).q(t).into(),
            BitLocation::Running(n) => self.module(n).is_running(t).into(),
            _ => 0,
        }
    }

    #[inline(always)]
    fn write(&mut self, reg: BitLocation, value: u8, _mask: u8, t: u64, _out: &mut Ap101Outbox) {
        let (bit, cycle_start) = (value & 1 != 0, self.cycle_start);
        match reg {
            BitLocation::Module(n) => self.module_mut(n).write(bit, t, cycle_start),
            BitLocation::Running(n) if bit => self.module_mut(n).clear(t),
            _ => {}
        }
    }

    fn reset(&mut self, _power_on: bool, _t: u64, _out: &mut Ap101Outbox) {
        self.modules.iter_mut().for_each(|module| *module = Ap101Module::new(module.settings, module.hz));
    }
}
