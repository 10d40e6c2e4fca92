//! Times of a timer's next events, computed from its current state.

use emu_core::NEVER;

use super::counting_cycle::CountingCycle;
use super::mode::{CountingSlope, MatchAction, TopSource};
use super::{AvrTimer, CompareChannel, ICF, OCFA, OCFB, OCFC, TOV, TimerClock, TimerRegister, regs};

/// Kind of the next step that is executed on its own. If several are due in one cycle, the first kind in this
/// list comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum TimerStepKind {
    /// An edge leaves the edge detector of the capture pin.
    Capture,
    /// An edge of the timer's clock, this number of edges ahead.
    Edge(u64),
    /// An edge of the pin T.
    PinEdge,
    /// Temporary registers of the asynchronous timer are latched.
    Latch,
    /// A delayed flag of the asynchronous timer is set.
    DelayedFlag,
}

/// The next step, with its cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct TimerStep {
    pub t: u64,
    pub what: TimerStepKind,
}

impl AvrTimer {
    /// Returns the next step that is more than plain counting.
    pub(super) fn next_step(&self) -> TimerStep {
        let mut plan = TimerStep { t: NEVER, what: TimerStepKind::DelayedFlag };
        if let Some(steps) = self.steps_to_special() {
            plan = plan.min(TimerStep { t: self.edge_time(steps), what: TimerStepKind::Edge(steps) });
        }
        if self.asleep.is_none() {
            plan = plan.min(TimerStep { t: self.icp.due(), what: TimerStepKind::Capture });
            plan = plan.min(TimerStep { t: self.pin.due(), what: TimerStepKind::PinEdge });
        }
        if self.shape.asynchronous {
            if self.busy != 0 && self.asleep.is_none() {
                plan = plan.min(TimerStep { t: self.latch_time(), what: TimerStepKind::Latch });
            }
            let late = self.pending_flags.iter().fold(NEVER, |first, &t| first.min(t));
            plan = plan.min(TimerStep { t: late, what: TimerStepKind::DelayedFlag });
        }
        plan
    }

    /// Returns the number of clock edges up to and including the cycle `t`.
    pub(super) fn edges(&self, t: u64) -> u64 {
        match self.clock {
            TimerClock::Io(ticks) => ticks.ticks_between(ticks.origin, t),
            TimerClock::Tosc { div, base } => self.tosc.index(t).saturating_sub(base) / div.max(1),
            TimerClock::Stopped | TimerClock::Pin { .. } => 0,
        }
    }

    /// Returns the cycle of the clock edge that is `steps` edges ahead.
    pub(super) fn edge_time(&self, steps: u64) -> u64 {
        let n = self.edges_counted.saturating_add(steps);
        match self.clock {
            TimerClock::Io(ticks) => ticks.nth_after(ticks.origin, n),
            TimerClock::Tosc { div, base } => self.tosc.time(n.saturating_mul(div).saturating_add(base)),
            TimerClock::Stopped | TimerClock::Pin { .. } => NEVER,
        }
    }

    /// Returns the cycle at which the first clear flag of `among` is set, if no other step comes before.
    pub(super) fn flag_time(&self, among: u8) -> u64 {
        let orbit = self.orbit();
        let steps = self.shape.flags_in(among & !self.tifr).filter_map(|flag| self.flag_steps(&orbit, flag)).min();
        steps.map_or(NEVER, |steps| self.edge_time(steps))
    }

    /// Returns the number of steps to the edge that sets a flag by plain counting.
    pub(super) fn flag_steps(&self, orbit: &CountingCycle, flag: u8) -> Option<u64> {
        match flag {
            TOV => orbit.steps_to_leave(match self.mode.slope {
                CountingSlope::Normal | CountingSlope::Ctc => orbit.max,
                CountingSlope::Fast => orbit.top,
                CountingSlope::Phase | CountingSlope::Frequency => 0,
            }),
            ICF if self.mode.top == TopSource::Icr => orbit.steps_to_leave(self.icr),
            OCFA => orbit.steps_to_leave(self.channels[0].compare),
            OCFB => orbit.steps_to_leave(self.channels[1].compare),
            OCFC => orbit.steps_to_leave(self.channels[2].compare),
            _ => None,
        }
    }

    /// Returns the course of the counter, if nothing special happens.
    pub(super) fn orbit(&self) -> CountingCycle {
        let dual = self.mode.is_dual_slope();
        CountingCycle { value: self.value, down: self.down, top: self.top(), max: self.shape.max(), dual }
    }

    /// Returns the current TOP value.
    pub(super) const fn top(&self) -> u16 {
        match self.mode.top {
            TopSource::Fixed(top) => top,
            TopSource::OcrA => self.channels[0].compare,
            TopSource::Icr => self.icr,
        }
    }

    /// Returns the number of steps to the next edge that does more than count and set flags.
    fn steps_to_special(&self) -> Option<u64> {
        if matches!(self.clock, TimerClock::Stopped | TimerClock::Pin { .. }) {
            return None;
        }
        if self.match_blocked || self.busy & regs::COMPARE_BUSY != 0 {
            return Some(1);
        }
        let orbit = self.orbit();
        let channels = &self.channels;
        let update = self.mode.is_buffered() && channels.iter().any(|channel| channel.buffer != channel.compare);
        let update = match self.mode.slope {
            _ if !update => None,
            CountingSlope::Fast => Some(orbit.steps_to_bottom()),
            CountingSlope::Phase => orbit.steps_to_leave(orbit.top),
            _ => orbit.steps_to_leave(0),
        };
        // Each signal of a flag needs its own cycle, and flags of the asynchronous timer are set later than
        // their edges.
        let flag_due = if self.is_asynchronous() { self.shape.flags() } else { self.listened_interrupts & !self.tifr };
        let flag_due = self.shape.flags_in(flag_due).filter_map(|flag| self.flag_steps(&orbit, flag)).min();
        let pins = channels.iter().filter_map(|channel| self.pin_steps(&orbit, channel)).min();
        [update, flag_due, pins].into_iter().flatten().min()
    }

    /// Returns the number of steps to the edge that may change the pin of a channel.
    fn pin_steps(&self, orbit: &CountingCycle, channel: &CompareChannel) -> Option<u64> {
        let CompareChannel { compare, level, .. } = *channel;
        let dual = orbit.dual;
        match channel.action {
            MatchAction::None => None,
            MatchAction::Level(to) if level == to => None,
            MatchAction::Toggle | MatchAction::Level(_) => orbit.steps_to_leave(compare),
            // At TOP the return to BOTTOM overrides the match, or the match downwards sets the level that the
            // pin already has. If TOP is BOTTOM, the match is one upwards.
            MatchAction::Wave(up) if level != up && compare == orbit.top && !(dual && orbit.top == 0) => None,
            MatchAction::Wave(up) if !dual && level != up => orbit.steps_to_leave(compare),
            MatchAction::Wave(_) if !dual => orbit.steps_to_leave(orbit.top),
            // A match at BOTTOM is one upwards.
            MatchAction::Wave(up) if level == up && compare == 0 && orbit.top != 0 => None,
            MatchAction::Wave(up) => {
                let late = self.mode.slope == CountingSlope::Phase && level != up && compare < orbit.top;
                let top = if late { orbit.steps_to_leave(orbit.top) } else { None };
                [orbit.steps_to_leave(compare), top].into_iter().flatten().min()
            }
        }
    }

    /// Returns the cycle at which the next temporary register is latched.
    fn latch_time(&self) -> u64 {
        self.pending_registers()
            .map(|i| self.due.get(i).copied().unwrap_or(NEVER))
            .min()
            .map_or(NEVER, |edge| self.tosc.time(edge))
    }

    /// Yields the temporary registers that are not latched yet, by their index in `due`.
    pub(super) fn pending_registers(&self) -> impl Iterator<Item = usize> + use<> {
        let busy = self.busy;
        (0..5).filter(move |i| busy & regs::BUSY[*i] != 0)
    }

    /// Returns the cycle up to which a register that changes on its own keeps its value; everything due at
    /// `t` has been done.
    pub(super) fn register_steady_until(&self, reg: TimerRegister, t: u64) -> u64 {
        let plan = self.next_step().t;
        let until = match reg {
            TimerRegister::TIFR => plan.min(self.flag_time(self.shape.flags())),
            // A read of the low byte copies the high byte to TEMP. It has no effect if TEMP already has that
            // value.
            TimerRegister::TCNTL if self.shape.wide && self.temp != (self.value >> 8) as u8 => t,
            TimerRegister::ICRL if self.shape.wide && self.temp != (self.icr >> 8) as u8 => t,
            TimerRegister::TCNTL if self.is_asynchronous() => {
                plan.min(self.tosc.time(self.tosc.index(t).saturating_add(1)))
            }
            TimerRegister::TCNTL => plan.min(self.edge_time(1)),
            _ => plan,
        };
        until.max(t)
    }
}
