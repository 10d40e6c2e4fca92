//! An R module, stepped from one machine cycle to the next (rule 11).

use super::config::Record;

/// Kinds by their numbers in the block (rule 17).
const TON: u8 = 1;
const TOF: u8 = 2;
const RTO: u8 = 3;
const TP: u8 = 4;
const CTU: u8 = 5;
const CTD: u8 = 6;
const CTC: u8 = 7;

/// The state of a module.
#[derive(Debug, Clone)]
pub struct Module {
    record: Record,
    hz: u64,
    pub preset: u16,
    /// The last value written.
    enable: bool,
    /// Number of machine cycles that have been timed.
    elapsed: u64,
    /// TOF: the input has fallen and not risen since; TP: a pulse has started.
    begun: bool,
    /// Cycle unit and counters: the count, Q, and whether the module has been written at all, or in this
    /// program cycle.
    count: i16,
    out: bool,
    ran: bool,
    advanced: bool,
}

impl Module {
    pub fn new(record: Record, hz: u64) -> Module {
        let preset = record.preset;
        let (elapsed, count) = (0, 0);
        let (enable, begun, out, ran, advanced) = (false, false, false, false, false);
        Module { record, hz, preset, enable, elapsed, begun, count, out, ran, advanced }
    }

    pub fn exists(&self) -> bool {
        self.record.kind != 0
    }

    /// Kind and unit.
    pub fn sort(&self) -> (u8, u8) {
        (self.record.kind, self.record.unit)
    }

    fn counter(&self) -> bool {
        matches!(self.record.kind, CTU | CTD | CTC)
    }

    fn timed(&self) -> bool {
        !self.counter() && self.record.unit != 0
    }

    /// A time unit in clocks times 1000, so that nothing is rounded.
    fn unit(&self) -> u128 {
        let ms = [0, 1, 10, 100][usize::from(self.record.unit)];
        ms * u128::from(self.hz)
    }

    /// The measured time in clocks times 1000; a machine cycle has two clocks (rule 4).
    fn clocks(&self) -> u128 {
        u128::from(self.elapsed) * 2 * 1000
    }

    fn reached(&self) -> bool {
        self.clocks() >= u128::from(self.preset) * self.unit()
    }

    /// P of the ladder element.
    fn limit(&self) -> i16 {
        self.preset as i16
    }

    pub fn q(&self) -> bool {
        if !self.timed() {
            return self.out;
        }
        match self.record.kind {
            TON => self.enable && self.reached(),
            TOF => self.enable || self.begun && !self.reached(),
            RTO => self.reached(),
            TP => self.begun && !self.reached(),
            _ => false,
        }
    }

    /// The bit at n + 128.
    pub fn running(&self) -> bool {
        match self.record.kind {
            TON | RTO => self.enable && !self.q(),
            TOF => !self.enable && self.q(),
            TP => self.q(),
            CTU | CTD | CTC => self.count != 0,
            _ => false,
        }
    }

    /// The measured time in whole units, or the count.
    pub fn value(&self) -> u16 {
        if self.timed() { (self.clocks() / self.unit()).min(65535) as u16 } else { self.count as u16 }
    }

    /// One machine cycle passes.
    pub fn pass(&mut self) {
        let timing = match self.record.kind {
            TON | RTO => self.enable,
            TOF | TP => self.begun,
            _ => false,
        };
        if timing && self.timed() {
            self.elapsed += 1;
        }
    }

    /// A program cycle begins: modules in its unit can advance again.
    pub fn program_cycle(&mut self) {
        self.advanced = false;
    }

    /// The program has written the module.
    pub fn write(&mut self, level: bool) {
        let rising = level && !self.enable;
        let falling = !level && self.enable;
        if self.counter() {
            self.count_edge(level, rising);
        } else if self.timed() {
            self.time_edge(rising, falling);
        } else if !self.advanced {
            self.advanced = true;
            self.turn(level, rising);
        }
        self.enable = level;
    }

    fn time_edge(&mut self, rising: bool, falling: bool) {
        match self.record.kind {
            TON if falling => self.elapsed = 0,
            TOF if rising => (self.begun, self.elapsed) = (false, 0),
            TOF if falling => (self.begun, self.elapsed) = (true, 0),
            TP if rising && !self.q() => (self.begun, self.elapsed) = (true, 0),
            _ => {}
        }
    }

    /// The ladder's counters (docs/semantics.md, 2.3).
    fn count_edge(&mut self, level: bool, rising: bool) {
        let limit = self.limit();
        match self.record.kind {
            CTU if rising => self.count = self.count.wrapping_add(1),
            CTD if rising => self.count = self.count.wrapping_sub(1),
            CTC if rising && self.count >= limit => self.count = 0,
            CTC if rising => self.count += 1,
            _ => {}
        }
        self.out = if self.record.kind == CTC { level } else { self.count >= limit };
    }

    /// The ladder's timers, with a program cycle in place of a scan (docs/semantics.md, 2.3). TP is not one
    /// of its elements.
    fn turn(&mut self, level: bool, rising: bool) {
        let limit = self.limit();
        if self.record.kind == TOF && !self.ran {
            self.count = limit;
        }
        self.ran = true;
        let below = self.count < limit;
        match (self.record.kind, level) {
            (TON, false) => (self.count, self.out) = (0, false),
            (TOF, true) => (self.count, self.out) = (0, true),
            (TON | RTO, true) if below => (self.count, self.out) = (self.count + 1, false),
            (TON | RTO, true) => self.out = true,
            (RTO, false) => self.out = !below,
            (TOF, false) if below => (self.count, self.out) = (self.count + 1, true),
            (TOF, false) => self.out = false,
            (TP, _) => {
                if rising && !(self.begun && below) {
                    (self.begun, self.count) = (true, 0);
                }
                self.out = self.begun && self.count < limit;
                self.begun = self.out;
                if self.out {
                    self.count += 1;
                }
            }
            _ => {}
        }
    }

    /// A 1 was written to n + 128.
    pub fn reset(&mut self) {
        let limit = self.limit();
        (self.elapsed, self.count) = (0, 0);
        match self.record.kind {
            TON => self.out = self.enable && 0 >= limit,
            TOF => self.out = self.ran && (self.enable || 0 < limit),
            RTO => self.out = 0 >= limit,
            TP => (self.begun, self.out) = (false, false),
            CTU | CTD => self.out = 0 >= limit,
            _ => {}
        }
    }
}
