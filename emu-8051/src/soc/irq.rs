//! Interrupts (user's manual, "Interrupts"): requests, their two priority levels, and when they are
//! recognised.
//!
//! A flag that is set at S5P2 of cycle n is polled in cycle n+1. If that is the last cycle of an instruction
//! that is not RETI and does not write IE or IP, the call takes the cycles n+2 and n+3. At an instruction
//! boundary before cycle t, those requests count that were present at S5P2 of t-2.

use emu_core::NEVER;
use emu_core::state;

use super::Mcs51Soc;
use crate::periph::Device;
use crate::periph::map::irq;

/// The EA bit of IE.
const EA: u8 = 0x80;

/// An external interrupt, INT0 or INT1.
#[derive(Debug, Clone, Copy)]
pub(super) struct ExternalInterrupt {
    /// ITn: falling edges are detected; otherwise the level.
    pub edge: bool,
    /// IEn as set by an edge.
    flag: bool,
    /// The cycle at whose S5P2 it was set.
    since: u64,
    /// The first cycle whose sample counts as a level.
    level_since: u64,
    /// The last three sampled levels of the pin, latest first, each with the cycle of its first sample.
    levels: [(u64, bool); 3],
}

state! { ExternalInterrupt { edge, flag, since, level_since, levels } }

impl ExternalInterrupt {
    /// State after reset with the pin at this level.
    pub(super) const fn new(level: bool) -> ExternalInterrupt {
        ExternalInterrupt { edge: false, flag: false, since: 0, level_since: 0, levels: [(0, level); 3] }
    }

    /// Samples this level of the pin from `cycle` on.
    pub(super) fn sample(&mut self, level: bool, cycle: u64) {
        if self.edge && self.levels[0].1 && !level && !self.flag {
            (self.flag, self.since) = (true, cycle);
        }
        self.levels = [(cycle, level), self.levels[0], self.levels[1]];
    }

    /// IEn as a program reads it.
    pub(super) const fn flag(&self) -> bool {
        if self.edge { self.flag } else { !self.levels[0].1 }
    }

    /// A program writes IEn at the end of `cycle`. In level mode the next sample overwrites it.
    pub(super) const fn set_flag(&mut self, on: bool, cycle: u64) {
        if on && !self.flag {
            self.since = cycle + 1;
        }
        self.flag = on;
    }

    /// A program writes ITn at the end of `cycle`.
    pub(super) const fn set_edge(&mut self, on: bool, cycle: u64) {
        if on && !self.edge {
            (self.flag, self.since) = (self.flag(), cycle);
        }
        if !on && self.edge {
            self.level_since = cycle + 1;
        }
        self.edge = on;
    }

    /// Whether the request was present at S5P2 of `cycle`.
    fn was_requested_at(&self, cycle: u64) -> bool {
        if self.edge {
            return self.flag && self.since <= cycle;
        }
        let sample = self.levels.iter().find(|(from, _)| *from <= cycle);
        cycle >= self.level_since && sample.is_some_and(|(_, level)| !level)
    }

    /// False if [`ExternalInterrupt::was_requested_at`] is false for all cycles.
    const fn may_have_been_requested(&self) -> bool {
        let [(_, now), (_, before), (_, first)] = self.levels;
        if self.edge { self.flag } else { !(now & before & first) }
    }

    /// The cycle since which the present request exists.
    fn requested_since(&self) -> u64 {
        if self.edge { self.since } else { self.level_since.max(self.levels[0].0) }
    }

    /// The service routine is called: hardware clears an edge.
    const fn acknowledge(&mut self) {
        self.flag = false;
    }
}

/// The interrupt system, except for the flags of timers and serial port, which these keep themselves.
#[derive(Debug, Clone)]
pub(super) struct InterruptSystem {
    pub ie: u8,
    pub ip: u8,
    pub external: [ExternalInterrupt; 2],
    /// Priority levels in progress: bit 0 low, bit 1 high.
    in_progress: u8,
    /// Requests that count as sampled at the boundaries before these two cycles, although a program has
    /// cleared them since.
    polled: [(u64, u8); 2],
}

state! { InterruptSystem { ie, ip, external, in_progress, polled } }

impl InterruptSystem {
    /// State after reset, with INT0 and INT1 at these levels.
    pub(super) const fn new(levels: [bool; 2]) -> InterruptSystem {
        let external = [ExternalInterrupt::new(levels[0]), ExternalInterrupt::new(levels[1])];
        InterruptSystem { ie: 0, ip: 0, external, in_progress: 0, polled: [(0, 0); 2] }
    }

    /// Enabled sources as bits; the bit is the number of the source minus 1.
    pub(super) const fn enabled(&self) -> u8 {
        if self.ie & EA == 0 { 0 } else { self.ie & !EA }
    }

    /// Remembers that the external interrupt `n` has woken the chip. It is served at the boundary before
    /// cycle `t` although its level has ended.
    pub(super) const fn remember_request(&mut self, n: usize, t: u64) {
        self.polled = [(t, 1 << (2 * n)), (0, 0)];
    }

    /// RETI: ends the interrupt with the highest level in progress.
    pub(super) const fn reti(&mut self) {
        self.in_progress &= if self.in_progress & 2 != 0 { !2 } else { !1 };
    }

    /// Whether no interrupt can be served before the one in progress ends.
    const fn all_in_progress(&self) -> bool {
        self.in_progress & 2 != 0
    }

    /// The source among `requests` that would be served now.
    const fn highest_priority(&self, requests: u8) -> Option<u8> {
        let enabled = requests & self.enabled();
        let high = enabled & self.ip;
        let chosen = match self.in_progress {
            _ if self.in_progress & 2 != 0 => 0,
            _ if high != 0 => high,
            0 => enabled,
            _ => 0,
        };
        if chosen == 0 { None } else { Some(chosen.trailing_zeros() as u8 + 1) }
    }
}

const fn bit(source: u8) -> u8 {
    1 << (source - 1)
}

impl Mcs51Soc {
    /// Enabled sources whose request was present at S5P2 of `cycle`, as bits by number minus 1. Everything
    /// must be executed up to `cycle` or later. Disabled sources can be ignored: a write that enables them
    /// holds interrupts until the sources have been polled again.
    fn requests_at(&self, cycle: u64) -> u8 {
        let [int0, int1] = &self.interrupts.external;
        let set = u8::from(int0.may_have_been_requested())
            | u8::from(self.timers.flag(0)) << 1
            | u8::from(int1.may_have_been_requested()) << 2
            | u8::from(self.timers.flag(1)) << 3
            | u8::from(self.serial.port().scon() & 3 != 0) << 4
            | self.timer2.interrupt_requests() << 5;
        let mut left = self.interrupts.enabled() & set;
        let mut requests = 0;
        while left != 0 {
            let source = left.trailing_zeros() as u8 + 1;
            left &= left - 1;
            let stood = match source {
                irq::INT0 => self.interrupts.external[0].was_requested_at(cycle),
                irq::INT1 => self.interrupts.external[1].was_requested_at(cycle),
                irq::TIMER0 => self.timers.flag_set_since(0) <= cycle,
                irq::TIMER1 => self.timers.flag_set_since(1) <= cycle,
                irq::SERIAL => self.serial.port().flags_set_since() <= cycle,
                _ => self.timer2_since() <= cycle,
            };
            requests |= u8::from(stood) << (source - 1);
        }
        requests
    }

    /// The cycle since which timer 2 requests an interrupt. An overflow is polled in its own cycle in both
    /// readings.
    fn timer2_since(&self) -> u64 {
        if self.readings.samples_interrupt_at_once {
            self.timer2.request_active_since()
        } else {
            self.timer2.flags_set_since()
        }
    }

    /// The cycle whose requests count at a boundary before cycle `t`.
    fn sample_cycle(&self, t: u64) -> u64 {
        t.saturating_sub(if self.readings.samples_interrupt_at_once { 1 } else { 2 })
    }

    /// Requests that count at the boundary before cycle `t`; everything must be executed up to `t`.
    pub(super) fn requests(&self, t: u64) -> u8 {
        let polled = self.interrupts.polled.iter().filter(|polled| polled.0 == t);
        polled.fold(self.requests_at(self.sample_cycle(t)), |requests, polled| requests | polled.1)
    }

    /// Must be called before a program writes flags at the end of cycle `t`. Requests that were sampled in
    /// the cycle before are polled in `t`, those sampled in `t` are polled in `t + 1`.
    pub(super) fn poll(&mut self, t: u64) {
        if !self.readings.samples_interrupt_at_once && self.interrupts.enabled() != 0 {
            self.interrupts.polled = [(t + 1, self.requests(t + 1)), (t + 2, self.requests_at(t))];
        }
    }

    /// The interrupt that is served at the boundary before cycle `t`.
    pub(super) fn interrupt_to_serve(&self, t: u64) -> Option<u8> {
        self.interrupts.highest_priority(self.requests(t))
    }

    /// The first boundary, from the one before cycle `t` on, at which an interrupt can be served; everything
    /// must be executed up to `t`. NEVER if no request comes without external input, or none before the
    /// interrupt in progress ends.
    pub(super) fn next_interrupt(&self, t: u64) -> u64 {
        let enabled = self.interrupts.enabled();
        if enabled == 0 || self.interrupts.all_in_progress() {
            return NEVER;
        }
        if self.interrupt_to_serve(t).is_some() {
            return t;
        }
        let delay = if self.readings.samples_interrupt_at_once { 1 } else { 2 };
        let later = |since: u64| if since.saturating_add(delay) > t { since.saturating_add(delay) } else { NEVER };
        let above = if self.interrupts.in_progress == 0 { 0xFF } else { self.interrupts.ip };
        let is = |source: u8| enabled & above & bit(source) != 0;
        let later_polled = self.interrupts.polled.iter().filter(|polled| polled.0 > t && polled.1 & enabled != 0);
        let mut next = later_polled.map(|polled| polled.0).min().unwrap_or(NEVER);
        for n in 0..2 {
            let external = &self.interrupts.external[n];
            if is(irq::INT0 + 2 * n as u8) {
                if external.flag() {
                    next = next.min(later(external.requested_since()));
                }
                // A level that has already ended can have been sampled for the next boundary.
                if !external.edge && external.was_requested_at(self.sample_cycle(t + 1)) {
                    next = next.min(t + 1);
                }
            }
            if is(irq::TIMER0 + 2 * n as u8) {
                let set = if self.timers.flag(n) { self.timers.flag_set_since(n) } else { self.timers.next_flag(n) };
                next = next.min(later(set));
            }
        }
        if is(irq::SERIAL) && self.serial.port().scon() & 3 != 0 {
            next = next.min(later(self.serial.port().flags_set_since()));
        }
        if is(irq::TIMER2) {
            // An overflow directly after a program has set TF2 is polled a cycle earlier than the value that
            // the program wrote.
            next = next.min(later(self.timer2_since())).min(later(self.timer2.next_flag()));
        }
        next
    }

    /// The service routine of `source` is called: its flag is cleared if hardware does that.
    pub(super) fn enter(&mut self, source: u8) {
        match source {
            irq::INT0 => self.interrupts.external[0].acknowledge(),
            irq::INT1 => self.interrupts.external[1].acknowledge(),
            irq::TIMER0 => self.timers.set_flag(0, false),
            irq::TIMER1 => self.timers.set_flag(1, false),
            _ => {}
        }
        self.interrupts.polled = [(0, 0); 2];
        let high = self.interrupts.ip & bit(source) != 0;
        self.interrupts.in_progress |= if high { 2 } else { 1 };
    }
}
