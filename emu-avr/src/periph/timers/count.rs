//! Counting of a timer: single clock edges with all their effects, and many plain edges at once.

use crate::periph::timers::counting_cycle::CounterPosition;
use std::cmp::Ordering;

use emu_core::NEVER;

use super::deadlines::TimerStepKind;
use super::mode::{CountingSlope, MatchAction, TopSource};
use super::pins::CaptureEdge;
use super::{AvrOutbox, AvrSignal, AvrTimer, ICF, OCFA, TOV, TimerClock, regs};

impl AvrTimer {
    /// Executes everything up to and including the cycle `now`.
    pub(super) fn advance_to(&mut self, now: u64, out: &mut AvrOutbox) {
        while now >= self.next_event {
            let plan = self.next_step();
            if plan.t > now || plan.t == NEVER {
                self.next_event = plan.t;
                break;
            }
            match plan.what {
                TimerStepKind::Capture => {
                    // The value before the edge is captured.
                    self.count_steps_until(plan.t.saturating_sub(1));
                    if let Some(edge) = self.icp.take() {
                        self.capture(edge, plan.t, out);
                    }
                }
                TimerStepKind::Edge(steps) => {
                    let before = steps.saturating_sub(1);
                    self.set_flags_for_steps(before);
                    self.skip_steps(before);
                    self.step_clock(plan.t, out);
                    self.edges_counted += 1;
                }
                TimerStepKind::PinEdge => {
                    let rising = self.pin.take();
                    if matches!(self.clock, TimerClock::Pin { rising: wanted } if wanted == rising) {
                        self.step_clock(plan.t, out);
                    }
                }
                TimerStepKind::Latch => {
                    self.count_steps_until(plan.t);
                    self.latch(plan.t, out);
                }
                TimerStepKind::DelayedFlag => {
                    for i in 0..3 {
                        if self.pending_flags[i] <= plan.t {
                            self.pending_flags[i] = NEVER;
                            self.set_flags(1 << i, plan.t, out);
                        }
                    }
                }
            }
            self.next_flag = 0;
        }
        self.count_steps_until(now);
    }

    /// Counts the edges up to `now`, none of which is special.
    fn count_steps_until(&mut self, now: u64) {
        let steps = self.edges(now).saturating_sub(self.edges_counted);
        if now >= self.next_flag {
            self.next_flag = self.set_flags_for_steps(steps);
        }
        self.skip_steps(steps);
    }

    /// Sets the flags of the next `steps` edges, and returns the cycle of the first later edge that sets one.
    /// Flags of the asynchronous timer are delayed, and set by separate steps.
    fn set_flags_for_steps(&mut self, steps: u64) -> u64 {
        let orbit = self.orbit();
        let mut next = None;
        for flag in self.shape.flags_in(!self.tifr) {
            match self.flag_steps(&orbit, flag) {
                Some(n) if n <= steps && !self.is_asynchronous() => self.tifr |= flag,
                Some(n) => next = Some(next.map_or(n, |next: u64| next.min(n))),
                None => {}
            }
        }
        next.map_or(NEVER, |steps| self.edge_time(steps))
    }

    /// Counts `steps` edges whose flags are already set.
    fn skip_steps(&mut self, steps: u64) {
        if steps != 0 {
            CounterPosition { value: self.value, down: self.down } = self.orbit().value_after(steps);
            self.edges_counted += steps;
        }
    }

    /// Executes one edge of the timer's clock at the cycle `t`.
    fn step_clock(&mut self, t: u64, out: &mut AvrOutbox) {
        let (value, slope) = (self.value, self.mode.slope);
        // A write of TCNT blocks the match at the next edge. So does a pending write of TCNT or OCR of the
        // asynchronous timer.
        let hidden = self.match_blocked || self.busy & regs::BUSY[0] != 0;
        self.match_blocked = false;
        let mut matches = [false; 3];
        let mut flags = 0;
        for (i, channel) in self.channels.iter().take(usize::from(self.shape.channels)).enumerate() {
            let disabled = hidden || (1..=2).contains(&(i + 1)) && self.busy & regs::BUSY[i + 1] != 0;
            matches[i] = !disabled && channel.compare == value;
            flags |= u8::from(matches[i]) * (OCFA << i);
        }
        let at_top = match self.mode.top {
            TopSource::Fixed(top) => value == top,
            TopSource::OcrA => matches[0],
            TopSource::Icr => !hidden && value == self.icr,
        };
        if at_top && self.mode.top == TopSource::Icr {
            flags |= ICF;
        }
        let over = match slope {
            CountingSlope::Normal | CountingSlope::Ctc => value == self.shape.max(),
            CountingSlope::Fast => at_top,
            CountingSlope::Phase | CountingSlope::Frequency => value == 0,
        };
        flags |= u8::from(over) * TOV;
        let down = self.mode.is_dual_slope() && value != 0 && (at_top || self.down);
        self.value = match (self.mode.is_dual_slope(), at_top) {
            (false, true) => 0,
            (true, true) if value == 0 => 0,
            _ if down => value - 1,
            _ => value.wrapping_add(1) & self.shape.max(),
        };
        self.down = down && self.value != 0;
        let update = match slope {
            CountingSlope::Normal | CountingSlope::Ctc => false,
            CountingSlope::Fast => self.value == 0,
            CountingSlope::Phase => at_top,
            CountingSlope::Frequency => value == 0,
        };
        for (channel, matched) in self.channels.iter_mut().zip(matches) {
            if update {
                channel.compare = channel.buffer;
            }
            match channel.action {
                MatchAction::Toggle if matched => channel.level = !channel.level,
                MatchAction::Level(to) if matched => channel.level = to,
                MatchAction::Wave(up) => {
                    if matched {
                        channel.level = up != down;
                    }
                    // At the return from TOP to BOTTOM, but not at the wrap at MAX, as measured on silicon.
                    if slope == CountingSlope::Fast && at_top {
                        channel.level = !up;
                    }
                    // 15.7.4: a match on the way up that was missed, or that a new OCR prevents, is corrected
                    // at TOP.
                    if slope == CountingSlope::Phase && at_top {
                        match channel.compare.cmp(&value) {
                            Ordering::Less => channel.level = up,
                            Ordering::Equal => channel.level = !up,
                            Ordering::Greater => {}
                        }
                    }
                }
                _ => {}
            }
        }
        self.drive_outputs(t, out);
        if self.is_asynchronous() {
            for i in 0..3 {
                if flags >> i & 1 != 0 {
                    self.pending_flags[i] = self.pending_flags[i].min(t.saturating_add(regs::FLAG_DELAY));
                }
            }
        } else {
            self.set_flags(flags, t, out);
        }
    }

    /// Sets flags at the cycle `t`.
    fn set_flags(&mut self, flags: u8, t: u64, out: &mut AvrOutbox) {
        let flags = flags & self.shape.flags();
        let raised = flags & !self.tifr & self.listened_interrupts;
        self.tifr |= flags;
        for flag in self.shape.flags_in(raised) {
            out.push(AvrSignal::Flag { t, irq: self.shape.irq(flag) });
        }
    }

    /// Captures the counter if the edge of the capture pin is of the selected kind (16.6).
    fn capture(&mut self, edge: CaptureEdge, t: u64, out: &mut AvrOutbox) {
        let wanted = CaptureEdge { rising: self.tccrb & regs::ICES != 0, filtered: self.tccrb & regs::ICNC != 0 };
        if edge == wanted && self.shape.capture && !self.icr_is_top() {
            self.icr = self.value;
            self.set_flags(ICF, t, out);
        }
    }
}
