//! Timer 2 in closed form (8052 manual, "Timer 2"; AT89S52 data sheet, "Programmable Clock Out", for T2MOD).
//!
//! As a baud generator and as a clock generator it counts states (six per cycle), unless it counts edges of
//! T2. Otherwise it counts cycles. Where the documents are silent, the model decides:
//!
//! - The first state that is counted after a write in cycle w is S1 of cycle w+1, number 6(w+1). The count of
//!   S6 comes between the reads and the writes of a program in a cycle: advancing to cycle c ends with S5
//!   (state 6c+4).
//! - T2OE set and C/T2 clear make a clock generator, regardless of CP/RL2 and DCEN: every overflow reloads
//!   from RCAP2 and sets no TF2, and an edge of T2EX only sets EXF2.
//! - The flip-flop of the clock is high after reset. It keeps its level while TR2 is clear and while the
//!   output is off.
//! - An edge of T2EX acts at S5P2 of the cycle of the low sample, after the count of that cycle, and
//!   regardless of TR2. The captured value is the one that a program reads in that cycle; a reloaded timer
//!   counts on from RCAP2 in the next cycle.
//! - The counting direction (DCEN) is the sample of T2EX in the cycle of the count. When counting down, the
//!   count that finds the timer equal to RCAP2 is the underflow and leaves FFFFh, so the period has the same
//!   number of counts in both directions. EXEN2 has no effect then. DCEN has an effect in auto-reload mode
//!   only.
//! - Edges of T2 as a baud clock are counted at S3, where the manual lets a new count appear.
//! - A flag that is already set is not set again: its time stays that of the first event. If TF2 is written
//!   in the cycle before an overflow, it is polled as that of the overflow, a cycle earlier than the written
//!   flag would be.

use super::map::{pin, sfr};
use super::ticks::Ticks;
use super::timer::{InputPin, OverflowCounts, overflows_in};
use super::{Device, Mcs51Outbox, Mcs51Signal};
use emu_core::NEVER;
use emu_core::pins::{CycleTime, PinId};
use emu_core::state;

const TF2: u8 = 0x80;
const EXF2: u8 = 0x40;
const RCLK: u8 = 0x20;
const TCLK: u8 = 0x10;
const EXEN2: u8 = 0x08;
const TR2: u8 = 0x04;
const COUNTER: u8 = 0x02;
const CAPTURE: u8 = 0x01;
const T2OE: u8 = 2;
const DCEN: u8 = 1;

/// Index of S3 among the states of a cycle.
const S3: u64 = 2;
/// Maximum number of cycles per step; more would overflow the number of states.
const MAX_STRIDE: u64 = 1 << 60;

/// What the timer counts.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Timer2Feed {
    Off,
    /// Every cycle.
    Cycles,
    /// Every state.
    States,
    /// An edge, counted in this cycle.
    OneEdge(u64),
}

/// The state that counting changes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Timer2Counts {
    synced: u64,
    /// Number of states of the present cycle that are not counted yet: 1 (S6) until something is written.
    states_behind: u64,
    value: u16,
    rcap: u16,
    tf2: bool,
    exf2: bool,
    tf2_since: u64,
    /// An overflow has set TF2, which is then polled in the cycle of the overflow.
    tf2_early: bool,
    exf2_since: u64,
    overflows: u64,
    clock: bool,
}

state! {
    Timer2Counts { synced, states_behind, value, rcap, tf2, exf2, tf2_since, tf2_early, exf2_since, overflows, clock }
    if |of, now| of.synced <= now && of.states_behind <= 1 && of.overflows != NEVER
}

impl Timer2Counts {
    /// The first state that is not counted yet.
    const fn next_state(&self) -> u64 {
        self.synced.saturating_add(1).saturating_mul(6).saturating_sub(self.states_behind)
    }
}

/// The configuration that follows from T2CON, T2MOD and the pins.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Timer2Setup {
    feed: Timer2Feed,
    /// Baud or clock generator.
    is_generator: bool,
    clock: bool,
    reload: bool,
    /// Auto-reload with DCEN: EXF2 is the seventeenth bit and requests no interrupt.
    counts_up_down: bool,
    down: bool,
    /// The cycle of an edge of T2EX that counts as an event, in the past or the future.
    edge: u64,
}

/// Timer 2 as of the cycle to which it is advanced. A write takes effect in the cycle after that. On a chip
/// without T2MOD that register stays 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Mcs51Timer2 {
    /// T2CON without its flags.
    control: u8,
    mode: u8,
    t2: InputPin,
    t2ex: InputPin,
    setup: Timer2Setup,
    counts: Timer2Counts,
    /// Number of overflows up to which toggles of pin T2 were signalled.
    toggles_shown: u64,
    /// The counts at the last write or pin change, restored if another one falls into a counted cycle.
    counts_before: Timer2Counts,
}

// The setup is derived from the other fields.
state! {
    Mcs51Timer2 { control, mode, t2, t2ex, counts, toggles_shown, counts_before } stays { setup }
    if |timer, now| timer.counts.synced + 1 >= now && timer.toggles_shown != NEVER,
    then Mcs51Timer2::update_setup
}

/// A write at the end of cycle `t` acts from cycle `t + 1` on, a level at S5P2 of cycle `t` from `t` on. The
/// last level of a cycle wins. The clock output shows all toggles of a cycle at once, including that of S6.
impl Device<Mcs51Signal> for Mcs51Timer2 {
    /// A direct address.
    type Reg = u8;

    /// Signals the toggles of the clock output up to the end of cycle `t`.
    fn run_due(&mut self, t: u64, out: &mut Mcs51Outbox) {
        while self.next_deadline() <= t {
            let state = self.next_toggle();
            self.toggles_shown += 1;
            let behind = self.toggles_shown.wrapping_sub(self.counts.overflows) & 1 != 0;
            let at = CycleTime { cycle: state / 6, phase: (state % 6 * 2) as u8 };
            out.push(Mcs51Signal::ClockOut { at, high: self.counts.clock ^ behind });
        }
    }

    fn next_deadline(&self) -> u64 {
        match self.next_toggle() {
            NEVER => NEVER,
            state => state / 6,
        }
    }

    fn interrupt_requests(&self) -> u8 {
        u8::from(self.flags_set_since() != NEVER)
    }

    fn peek(&self, reg: u8, t: u64) -> u8 {
        if t > self.counts.synced {
            let mut timer = self.clone();
            timer.advance_to(t);
            return timer.peek(reg, t);
        }
        let ([high, low], [rcaph, rcapl]) = (self.counts.value.to_be_bytes(), self.counts.rcap.to_be_bytes());
        match reg {
            sfr::T2CON => self.t2con(),
            sfr::T2MOD => self.mode,
            sfr::RCAP2L => rcapl,
            sfr::RCAP2H => rcaph,
            sfr::TL2 => low,
            sfr::TH2 => high,
            _ => 0,
        }
    }

    fn write(&mut self, reg: u8, value: u8, mask: u8, t: u64, out: &mut Mcs51Outbox) {
        self.advance_to(t);
        let had_clock = self.setup.clock;
        let value = self.peek(reg, t) & !mask | value & mask;
        let (low, high) = (u16::from(value), u16::from(value) << 8);
        match reg {
            sfr::T2CON => self.change(|timer| timer.set_t2con(value)),
            sfr::T2MOD => self.change(|timer| timer.mode = value & (T2OE | DCEN)),
            sfr::RCAP2L => self.change(|timer| timer.counts.rcap = timer.counts.rcap & 0xFF00 | low),
            sfr::RCAP2H => self.change(|timer| timer.counts.rcap = timer.counts.rcap & 0xFF | high),
            sfr::TL2 => self.change(|timer| timer.counts.value = timer.counts.value & 0xFF00 | low),
            sfr::TH2 => self.change(|timer| timer.counts.value = timer.counts.value & 0xFF | high),
            _ => {}
        }
        if had_clock || self.setup.clock {
            self.show_clock(t, out);
        }
    }

    /// The timer must be advanced to the cycle before `t`, or to `t` itself if a pin change of that cycle was
    /// already reported.
    fn on_line_changed(&mut self, line: PinId, high: bool, t: u64, _out: &mut Mcs51Outbox) {
        match line {
            pin::T2 => self.drive(t, |timer, cycle| timer.t2.drive(high, cycle)),
            pin::T2EX => self.drive(t, |timer, cycle| timer.t2ex.drive(high, cycle)),
            _ => {}
        }
    }

    fn reset(&mut self, _power_on: bool, t: u64, _out: &mut Mcs51Outbox) {
        *self = Mcs51Timer2::new(t);
    }

    fn steady_until(&self, reg: u8, t: u64) -> u64 {
        match reg {
            sfr::T2CON => self.next_flag(),
            sfr::T2MOD => NEVER,
            _ => t,
        }
    }
}

impl Default for Mcs51Timer2 {
    fn default() -> Mcs51Timer2 {
        Mcs51Timer2::new(0)
    }
}

impl Mcs51Timer2 {
    /// The state after reset, advanced to cycle `now`: registers 0, pins high.
    #[must_use]
    pub fn new(now: u64) -> Mcs51Timer2 {
        let counts = Timer2Counts {
            synced: now,
            states_behind: 0,
            value: 0,
            rcap: 0,
            tf2: false,
            exf2: false,
            tf2_since: NEVER,
            tf2_early: false,
            exf2_since: NEVER,
            overflows: 0,
            clock: true,
        };
        let (t2, t2ex) = (InputPin::HIGH, InputPin::HIGH);
        let setup = setup_for(0, 0, &t2, &t2ex);
        Mcs51Timer2 { control: 0, mode: 0, t2, t2ex, setup, counts, toggles_shown: 0, counts_before: counts }
    }

    /// Drops the counts kept for restoring if no change can need them any more, because cycle `t` has begun.
    pub fn normalize(&mut self, t: u64) {
        self.advance_to(t.saturating_sub(1));
        if self.counts_before.synced.saturating_add(1) < t {
            self.counts_before = self.counts;
        }
    }

    /// As [`Mcs51Timer2::advance_to`], but at a boundary: pins can still change in cycle `now`, which is then
    /// counted again.
    pub fn advance_before(&mut self, now: u64) {
        self.advance_to(now.saturating_sub(1));
        if self.counts.synced < now {
            self.counts_before = self.counts;
        }
        self.advance_to(now);
    }

    /// Advances the timer to S5P2 of cycle `now`, unless that is already done.
    #[inline]
    pub fn advance_to(&mut self, now: u64) {
        if now <= self.counts.synced {
            return;
        }
        let edge = self.setup.edge;
        if edge == NEVER && self.setup.feed == Timer2Feed::Off {
            (self.counts.synced, self.counts.states_behind) = (now, 1);
            return;
        }
        if edge > self.counts.synced && edge <= now && edge != NEVER {
            self.advance(edge);
            self.edge(edge);
        }
        self.advance(now);
    }

    /// T2CON with TF2 and EXF2.
    #[must_use]
    pub fn t2con(&self) -> u8 {
        self.control | if self.counts.tf2 { TF2 } else { 0 } | if self.counts.exf2 { EXF2 } else { 0 }
    }

    /// The cycle x since which the timer has requested its interrupt, which is polled from x+1 on, or
    /// [`NEVER`]: the earlier one of TF2 (the cycle before the overflow, as it is set and polled in one)
    /// and EXF2 (the cycle of the edge); w+1 for a flag written in cycle w. EXF2 requests no interrupt while
    /// it toggles as the seventeenth bit of an up/down counter.
    #[must_use]
    pub fn flags_set_since(&self) -> u64 {
        self.counts.tf2_since.min(self.counts.exf2_since)
    }

    /// The first cycle at whose S5P2 the request was present: as [`Mcs51Timer2::flags_set_since`], but the
    /// cycle of the overflow if that set TF2.
    #[must_use]
    pub fn request_active_since(&self) -> u64 {
        self.counts.tf2_since.saturating_add(u64::from(self.counts.tf2_early)).min(self.counts.exf2_since)
    }

    /// The next x, as in [`Mcs51Timer2::flags_set_since`], at which hardware sets TF2 or a requesting EXF2 if
    /// no register or pin changes, even if it is already set; [`NEVER`] if there is none.
    #[must_use]
    pub fn next_flag(&self) -> u64 {
        let Timer2Counts { synced, .. } = self.counts;
        let OverflowCounts { first, .. } = self.counts_to_overflow(&self.counts);
        let overflow = match self.setup.feed {
            Timer2Feed::Cycles => synced.saturating_add(first),
            Timer2Feed::OneEdge(cycle) if first == 1 && cycle > synced && !self.setup.is_generator => cycle,
            _ => NEVER,
        };
        let flag = if overflow == NEVER { NEVER } else { overflow - 1 };
        if self.setup.edge > synced { flag.min(self.setup.edge) } else { flag }
    }

    /// Overflows as a generator since power-up; exact from the last write, pin change or boundary on.
    #[must_use]
    pub fn ticks(&self) -> Ticks {
        self.ticks_from(&self.counts_before)
    }

    /// Whether the counts are what those of the last change foresaw, unlike in a damaged snapshot.
    pub(crate) fn is_sound(&self) -> bool {
        self.ticks().continues_as(&self.ticks_from(&self.counts), self.counts.synced)
    }

    fn ticks_from(&self, counts: &Timer2Counts) -> Ticks {
        let OverflowCounts { first, period } = self.counts_to_overflow(counts);
        let (next, period) = match self.setup.feed {
            Timer2Feed::States => (counts.next_state().saturating_add(first - 1), period),
            Timer2Feed::OneEdge(cycle) if first == 1 && cycle > counts.synced && self.setup.is_generator => {
                (cycle.saturating_mul(6).saturating_add(S3), NEVER)
            }
            _ => (NEVER, NEVER),
        };
        Ticks { count: counts.overflows, next, period, in_states: true }
    }

    /// Whether the timer clocks the transmitter (TCLK) and the receiver (RCLK) of the serial port.
    #[must_use]
    pub const fn clocks_serial(&self) -> [bool; 2] {
        [self.control & TCLK != 0, self.control & RCLK != 0]
    }

    /// The level that the clock generator drives on pin T2; `None` while it does not drive it: T2OE clear or
    /// C/T2 set.
    #[must_use]
    pub fn clock_out(&self) -> Option<bool> {
        self.setup.clock.then_some(self.counts.clock)
    }

    /// The state of the next toggle of pin T2 that was not signalled; [`NEVER`] while the clock generator is
    /// off or stopped.
    #[must_use]
    pub fn next_toggle(&self) -> u64 {
        if self.setup.clock { self.ticks().time_of(self.toggles_shown.saturating_add(1)) } else { NEVER }
    }

    /// Signals the level of the clock output after a write at the end of cycle `t`.
    fn show_clock(&mut self, t: u64, out: &mut Mcs51Outbox) {
        self.toggles_shown = self.counts.overflows;
        out.push(Mcs51Signal::ClockOut { at: CycleTime::at(t + 1), high: self.clock_out() != Some(false) });
    }

    /// Counts until the next overflow, and from one overflow to the next.
    fn counts_to_overflow(&self, counts: &Timer2Counts) -> OverflowCounts {
        let Timer2Counts { value, rcap, .. } = *counts;
        let period = 0x1_0000 - if self.setup.reload { u64::from(rcap) } else { 0 };
        let first = if self.setup.down { 1 + u64::from(value.wrapping_sub(rcap)) } else { 0x1_0000 - u64::from(value) };
        OverflowCounts { first, period }
    }

    /// Advances everything except edges of T2EX to S5P2 of cycle `now`.
    fn advance(&mut self, now: u64) {
        while self.counts.synced < now {
            let from = self.counts.synced;
            let to = now.min(from.saturating_add(MAX_STRIDE));
            match self.setup.feed {
                Timer2Feed::Off => {}
                Timer2Feed::Cycles => self.count(to - from, from),
                Timer2Feed::States => self.count((to - from) * 6 + self.counts.states_behind - 1, from),
                Timer2Feed::OneEdge(cycle) if from < cycle && cycle <= to => self.count(1, cycle - 1),
                Timer2Feed::OneEdge(_) => {}
            }
            self.counts.synced = to;
            self.counts.states_behind = 1;
        }
    }

    /// Adds `counts` counts. If each takes a cycle, `from` is the cycle before the first.
    fn count(&mut self, counts: u64, from: u64) {
        let OverflowCounts { first, period } = self.counts_to_overflow(&self.counts);
        let Timer2Setup { is_generator: generator, clock, reload, counts_up_down: updown, down, .. } = self.setup;
        let state = &mut self.counts;
        if counts < first {
            let step = counts as u16;
            state.value = if down { state.value.wrapping_sub(step) } else { state.value.wrapping_add(step) };
            return;
        }
        let rest = ((counts - first) % period) as u16;
        let rounds = overflows_in(counts, first, period);
        let start = if reload { state.rcap } else { 0 };
        state.value = if down { 0xFFFF - rest } else { start.wrapping_add(rest) };
        if generator {
            state.overflows += rounds;
            state.clock ^= clock && rounds & 1 != 0;
        } else {
            state.tf2 = true;
            if from + first - 1 < state.tf2_since {
                (state.tf2_since, state.tf2_early) = (from + first - 1, true);
            }
            state.exf2 ^= updown && rounds & 1 != 0;
        }
    }

    /// Applies a falling edge of T2EX in `cycle`, whose count has already been applied.
    fn edge(&mut self, cycle: u64) {
        if !self.setup.is_generator {
            if self.setup.reload {
                self.counts.value = self.counts.rcap;
            } else {
                self.counts.rcap = self.counts.value;
            }
        }
        self.counts.exf2 = true;
        self.counts.exf2_since = self.counts.exf2_since.min(cycle);
    }

    /// Sets T2CON, including TF2 and EXF2.
    fn set_t2con(&mut self, value: u8) {
        let next = self.counts.synced.saturating_add(1);
        let counts = &mut self.counts;
        counts.tf2 = value & TF2 != 0;
        if !counts.tf2 {
            (counts.tf2_since, counts.tf2_early) = (NEVER, false);
        } else if next < counts.tf2_since {
            (counts.tf2_since, counts.tf2_early) = (next, false);
        }
        counts.exf2 = value & EXF2 != 0;
        self.control = value & !(TF2 | EXF2);
    }

    /// Applies a write at the end of the cycle to which the timer is advanced.
    fn change(&mut self, change: impl FnOnce(&mut Mcs51Timer2)) {
        if self.setup.feed == Timer2Feed::States {
            self.count(self.counts.states_behind, self.counts.synced);
        }
        self.counts.states_behind = 0;
        change(self);
        self.update_setup();
        let counts = &mut self.counts;
        let requests = counts.exf2 && !self.setup.counts_up_down;
        counts.exf2_since = if requests { counts.exf2_since.min(counts.synced.saturating_add(1)) } else { NEVER };
        self.counts_before = self.counts;
    }

    fn drive(&mut self, cycle: u64, change: impl FnOnce(&mut Mcs51Timer2, u64)) {
        self.advance_to(cycle.saturating_sub(1));
        let synced = self.counts.synced;
        if synced == cycle && self.counts_before.synced == cycle.wrapping_sub(1) {
            self.counts = self.counts_before;
        } else {
            self.counts_before = self.counts;
        }
        change(self, cycle.max(synced));
        self.update_setup();
        self.advance_to(synced);
    }

    fn update_setup(&mut self) {
        self.setup = setup_for(self.control, self.mode, &self.t2, &self.t2ex);
    }
}

fn setup_for(control: u8, mode: u8, t2: &InputPin, t2ex: &InputPin) -> Timer2Setup {
    let counter = control & COUNTER != 0;
    let clock = mode & T2OE != 0 && !counter;
    let generator = control & (RCLK | TCLK) != 0 || clock;
    let reload = generator || control & CAPTURE == 0;
    let updown = reload && !generator && mode & DCEN != 0;
    let feed = match (control & TR2 != 0, counter) {
        (true, true) if t2.fell_cycle != NEVER => Timer2Feed::OneEdge(t2.counted_cycle()),
        (true, false) if generator => Timer2Feed::States,
        (true, false) => Timer2Feed::Cycles,
        _ => Timer2Feed::Off,
    };
    let edge = if control & EXEN2 != 0 && !updown { t2ex.fell_cycle } else { NEVER };
    Timer2Setup {
        feed,
        is_generator: generator,
        clock,
        reload,
        counts_up_down: updown,
        down: updown && !t2ex.level,
        edge,
    }
}
