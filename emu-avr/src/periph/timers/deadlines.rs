//! When a timer does what, asked of it as it stands.

use emu_core::NEVER;

use super::counting_cycle::CountingCycle;
use super::mode::{CountingSlope, MatchAction, TopSource};
use super::{AvrTimer, CompareChannel, ICF, OCFA, OCFB, OCFC, TOV, TimerClock, TimerRegister, regs};

/// The next thing that is done one at a time. Of several at one cycle the first kind goes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum TimerStepKind {
    /// Something comes out of the capture pin's edge detector.
    Capture,
    /// An edge of the timer's clock, so many edges on.
    Edge(u64),
    /// An edge of T.
    PinEdge,
    /// Temporary registers of the asynchronous timer are latched.
    Latch,
    /// A flag of the asynchronous timer comes.
    DelayedFlag,
}

/// When, and what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct TimerStep {
    pub t: u64,
    pub what: TimerStepKind,
}

impl AvrTimer {
    /// The next thing that is not plain counting.
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

    /// Edges of the clock up to and including the cycle `t`.
    pub(super) fn edges(&self, t: u64) -> u64 {
        match self.clock {
            TimerClock::Io(ticks) => ticks.ticks_between(ticks.origin, t),
            TimerClock::Tosc { div, base } => self.tosc.index(t).saturating_sub(base) / div.max(1),
            TimerClock::Stopped | TimerClock::Pin { .. } => 0,
        }
    }

    /// The cycle of the edge that is `steps` edges on.
    pub(super) fn edge_time(&self, steps: u64) -> u64 {
        let n = self.edges_counted.saturating_add(steps);
        match self.clock {
            TimerClock::Io(ticks) => ticks.nth_after(ticks.origin, n),
            TimerClock::Tosc { div, base } => self.tosc.time(n.saturating_mul(div).saturating_add(base)),
            TimerClock::Stopped | TimerClock::Pin { .. } => NEVER,
        }
    }

    /// When one of the flags `among` that is clear is set, if nothing of the plan comes before.
    pub(super) fn flag_time(&self, among: u8) -> u64 {
        let orbit = self.orbit();
        let steps = self.shape.flags_in(among & !self.tifr).filter_map(|flag| self.flag_steps(&orbit, flag)).min();
        steps.map_or(NEVER, |steps| self.edge_time(steps))
    }

    /// Steps to the edge that sets a flag by plain counting.
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

    /// The way of the counter, if there is nothing special.
    pub(super) fn orbit(&self) -> CountingCycle {
        let dual = self.mode.is_dual_slope();
        CountingCycle { value: self.value, down: self.down, top: self.top(), max: self.shape.max(), dual }
    }

    pub(super) const fn top(&self) -> u16 {
        match self.mode.top {
            TopSource::Fixed(top) => top,
            TopSource::OcrA => self.channels[0].compare,
            TopSource::Icr => self.icr,
        }
    }

    /// Steps to the next edge that does more than count and set flags.
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
        // Signals of flags must have their own cycles, and the flags of the asynchronous timer come later than their edges.
        let told = if self.is_asynchronous() { self.shape.flags() } else { self.listened_interrupts & !self.tifr };
        let told = self.shape.flags_in(told).filter_map(|flag| self.flag_steps(&orbit, flag)).min();
        let pins = channels.iter().filter_map(|channel| self.pin_steps(&orbit, channel)).min();
        [update, told, pins].into_iter().flatten().min()
    }

    /// Steps to the edge that may move the pin of a channel.
    fn pin_steps(&self, orbit: &CountingCycle, channel: &CompareChannel) -> Option<u64> {
        let CompareChannel { compare, level, .. } = *channel;
        let dual = orbit.dual;
        match channel.action {
            MatchAction::None => None,
            MatchAction::Level(to) if level == to => None,
            MatchAction::Toggle | MatchAction::Level(_) => orbit.steps_to_leave(compare),
            // At TOP the return to BOTTOM has the last word, or the match downwards gives what there is already. If TOP is
            // BOTTOM the match is one upwards.
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

    /// When the next temporary register is latched.
    fn latch_time(&self) -> u64 {
        self.pending_registers()
            .map(|i| self.due.get(i).copied().unwrap_or(NEVER))
            .min()
            .map_or(NEVER, |edge| self.tosc.time(edge))
    }

    /// The temporary registers that are not latched yet, by their numbers in `due`.
    pub(super) fn pending_registers(&self) -> impl Iterator<Item = usize> + use<> {
        let busy = self.busy;
        (0..5).filter(move |i| busy & regs::BUSY[*i] != 0)
    }

    /// Up to when a register that changes by itself keeps its value, everything at `t` being done.
    pub(super) fn register_steady_until(&self, reg: TimerRegister, t: u64) -> u64 {
        let plan = self.next_step().t;
        let until = match reg {
            TimerRegister::TIFR => plan.min(self.flag_time(self.shape.flags())),
            // Reading the low byte copies the high one to TEMP: without effect when that is there already.
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
