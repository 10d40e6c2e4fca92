//! When a timer does what, asked of it as it stands.

use emu_core::NEVER;

use super::mode::{Action, Slope, Top};
use super::orbit::Orbit;
use super::{Channel, Clock, ICF, OCFA, OCFB, OCFC, Reg, TOV, Timer, regs};

/// The next thing that is done one at a time. Of several at one cycle the first kind goes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum What {
    /// Something comes out of the capture pin's edge detector.
    Capture,
    /// An edge of the timer's clock, so many edges on.
    Edge(u64),
    /// An edge of T.
    Pin,
    /// Temporary registers of the asynchronous timer are latched.
    Latch,
    /// A flag of the asynchronous timer comes.
    Late,
}

/// When, and what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Plan {
    pub t: u64,
    pub what: What,
}

impl Timer {
    /// The next thing that is not plain counting.
    pub(super) fn plan(&self) -> Plan {
        let mut plan = Plan { t: NEVER, what: What::Late };
        if let Some(steps) = self.special() {
            plan = plan.min(Plan { t: self.edge_time(steps), what: What::Edge(steps) });
        }
        if self.asleep.is_none() {
            plan = plan.min(Plan { t: self.icp.due(), what: What::Capture });
            plan = plan.min(Plan { t: self.pin.due(), what: What::Pin });
        }
        if self.shape.asynchronous {
            if self.busy != 0 && self.asleep.is_none() {
                plan = plan.min(Plan { t: self.latch_time(), what: What::Latch });
            }
            let late = self.late.iter().fold(NEVER, |first, &t| first.min(t));
            plan = plan.min(Plan { t: late, what: What::Late });
        }
        plan
    }

    /// Edges of the clock up to and including the cycle `t`.
    pub(super) fn edges(&self, t: u64) -> u64 {
        match self.clock {
            Clock::Io(ticks) => ticks.count(ticks.origin, t),
            Clock::Tosc { div, base } => self.tosc.index(t).saturating_sub(base) / div.max(1),
            Clock::Stopped | Clock::Pin { .. } => 0,
        }
    }

    /// The cycle of the edge that is `steps` edges on.
    pub(super) fn edge_time(&self, steps: u64) -> u64 {
        let n = self.done.saturating_add(steps);
        match self.clock {
            Clock::Io(ticks) => ticks.nth(ticks.origin, n),
            Clock::Tosc { div, base } => self.tosc.time(n.saturating_mul(div).saturating_add(base)),
            Clock::Stopped | Clock::Pin { .. } => NEVER,
        }
    }

    /// When one of the flags `among` that is clear is set, if nothing of the plan comes before.
    pub(super) fn flag_time(&self, among: u8) -> u64 {
        let orbit = self.orbit();
        let steps = self.shape.each(among & !self.tifr).filter_map(|flag| self.flag_steps(&orbit, flag)).min();
        steps.map_or(NEVER, |steps| self.edge_time(steps))
    }

    /// Steps to the edge that sets a flag by plain counting.
    pub(super) fn flag_steps(&self, orbit: &Orbit, flag: u8) -> Option<u64> {
        match flag {
            TOV => orbit.leaves(match self.mode.slope {
                Slope::Normal | Slope::Ctc => orbit.max,
                Slope::Fast => orbit.top,
                Slope::Phase | Slope::Frequency => 0,
            }),
            ICF if self.mode.top == Top::Icr => orbit.leaves(self.icr),
            OCFA => orbit.leaves(self.channels[0].compare),
            OCFB => orbit.leaves(self.channels[1].compare),
            OCFC => orbit.leaves(self.channels[2].compare),
            _ => None,
        }
    }

    /// The way of the counter, if there is nothing special.
    pub(super) fn orbit(&self) -> Orbit {
        let dual = self.mode.dual();
        Orbit { value: self.value, down: self.down, top: self.top(), max: self.shape.max(), dual }
    }

    pub(super) const fn top(&self) -> u16 {
        match self.mode.top {
            Top::Fixed(top) => top,
            Top::OcrA => self.channels[0].compare,
            Top::Icr => self.icr,
        }
    }

    /// Steps to the next edge that does more than count and set flags.
    fn special(&self) -> Option<u64> {
        if matches!(self.clock, Clock::Stopped | Clock::Pin { .. }) {
            return None;
        }
        if self.blocked || self.busy & regs::COMPARE_BUSY != 0 {
            return Some(1);
        }
        let orbit = self.orbit();
        let channels = &self.channels;
        let update = self.mode.buffered() && channels.iter().any(|channel| channel.buffer != channel.compare);
        let update = match self.mode.slope {
            _ if !update => None,
            Slope::Fast => Some(orbit.bottom()),
            Slope::Phase => orbit.leaves(orbit.top),
            _ => orbit.leaves(0),
        };
        // Signals of flags must have their own cycles, and the flags of the asynchronous timer come later than their edges.
        let told = if self.asynchronous() { self.shape.flags() } else { self.listened & !self.tifr };
        let told = self.shape.each(told).filter_map(|flag| self.flag_steps(&orbit, flag)).min();
        let pins = channels.iter().filter_map(|channel| self.pin_steps(&orbit, channel)).min();
        [update, told, pins].into_iter().flatten().min()
    }

    /// Steps to the edge that may move the pin of a channel.
    fn pin_steps(&self, orbit: &Orbit, channel: &Channel) -> Option<u64> {
        let Channel { compare, level, .. } = *channel;
        let dual = orbit.dual;
        match channel.action {
            Action::None => None,
            Action::Level(to) if level == to => None,
            Action::Toggle | Action::Level(_) => orbit.leaves(compare),
            // At TOP the return to BOTTOM has the last word, or the match downwards gives what there is already. If TOP is
            // BOTTOM the match is one upwards.
            Action::Wave(up) if level != up && compare == orbit.top && !(dual && orbit.top == 0) => None,
            Action::Wave(up) if !dual && level != up => orbit.leaves(compare),
            Action::Wave(_) if !dual => orbit.leaves(orbit.top),
            // A match at BOTTOM is one upwards.
            Action::Wave(up) if level == up && compare == 0 && orbit.top != 0 => None,
            Action::Wave(up) => {
                let late = self.mode.slope == Slope::Phase && level != up && compare < orbit.top;
                let top = if late { orbit.leaves(orbit.top) } else { None };
                [orbit.leaves(compare), top].into_iter().flatten().min()
            }
        }
    }

    /// When the next temporary register is latched.
    fn latch_time(&self) -> u64 {
        self.pending()
            .map(|i| self.due.get(i).copied().unwrap_or(NEVER))
            .min()
            .map_or(NEVER, |edge| self.tosc.time(edge))
    }

    /// The temporary registers that are not latched yet, by their numbers in `due`.
    pub(super) fn pending(&self) -> impl Iterator<Item = usize> + use<> {
        let busy = self.busy;
        (0..5).filter(move |i| busy & regs::BUSY[*i] != 0)
    }

    /// Up to when a register that changes by itself keeps its value, everything at `t` being done.
    pub(super) fn keeps(&self, reg: Reg, t: u64) -> u64 {
        let plan = self.plan().t;
        let until = match reg {
            Reg::TIFR => plan.min(self.flag_time(self.shape.flags())),
            // Reading the low byte copies the high one to TEMP: without effect when that is there already.
            Reg::TCNTL if self.shape.wide && self.temp != (self.value >> 8) as u8 => t,
            Reg::ICRL if self.shape.wide && self.temp != (self.icr >> 8) as u8 => t,
            Reg::TCNTL if self.asynchronous() => plan.min(self.tosc.time(self.tosc.index(t).saturating_add(1))),
            Reg::TCNTL => plan.min(self.edge_time(1)),
            _ => plan,
        };
        until.max(t)
    }
}
