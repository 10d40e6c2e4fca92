//! Counting: one edge with all that it does, or many in which nothing else happens.

use std::cmp::Ordering;

use emu_core::NEVER;

use super::mode::{Action, Slope, Top};
use super::pins::Edge;
use super::plan::What;
use super::{Clock, ICF, OCFA, Outbox, Signal, TOV, Timer, regs};

impl Timer {
    /// Does everything up to and including the cycle `now`.
    pub(super) fn advance(&mut self, now: u64, out: &mut Outbox) {
        while now >= self.quiet {
            let plan = self.plan();
            if plan.t > now || plan.t == NEVER {
                self.quiet = plan.t;
                break;
            }
            match plan.what {
                What::Capture => {
                    // The counter is copied as it stands before the edge.
                    self.count(plan.t.saturating_sub(1));
                    if let Some(edge) = self.icp.take() {
                        self.capture(edge, plan.t, out);
                    }
                }
                What::Edge(steps) => {
                    let before = steps.saturating_sub(1);
                    self.mark(before);
                    self.skip(before);
                    self.edge(plan.t, out);
                    self.done += 1;
                }
                What::Pin => {
                    let rising = self.pin.take();
                    if matches!(self.clock, Clock::Pin { rising: wanted } if wanted == rising) {
                        self.edge(plan.t, out);
                    }
                }
                What::Latch => {
                    self.count(plan.t);
                    self.latch(plan.t, out);
                }
                What::Late => {
                    for i in 0..3 {
                        if self.late[i] <= plan.t {
                            self.late[i] = NEVER;
                            self.set(1 << i, plan.t, out);
                        }
                    }
                }
            }
            self.calm = 0;
        }
        self.count(now);
    }

    /// Counts the edges up to `now`, none of which is special.
    fn count(&mut self, now: u64) {
        let steps = self.edges(now).saturating_sub(self.done);
        if now >= self.calm {
            self.calm = self.mark(steps);
        }
        self.skip(steps);
    }

    /// Sets the flags of so many edges, and gives the cycle of the first after them that sets one. The asynchronous timer's
    /// flags come later, each by an edge of its own.
    fn mark(&mut self, steps: u64) -> u64 {
        let orbit = self.orbit();
        let mut next = None;
        for flag in self.shape.each(!self.tifr) {
            match self.flag_steps(&orbit, flag) {
                Some(n) if n <= steps && !self.asynchronous() => self.tifr |= flag,
                Some(n) => next = Some(next.map_or(n, |next: u64| next.min(n))),
                None => {}
            }
        }
        next.map_or(NEVER, |steps| self.edge_time(steps))
    }

    /// Counts so many edges, whose flags are set.
    fn skip(&mut self, steps: u64) {
        if steps != 0 {
            (self.value, self.down) = self.orbit().after(steps);
            self.done += steps;
        }
    }

    /// One edge of the timer's clock at the cycle `t`.
    fn edge(&mut self, t: u64, out: &mut Outbox) {
        let (value, slope) = (self.value, self.mode.slope);
        // Writing TCNT hides the match, and so does a write on its way to TCNT or OCR of the asynchronous timer.
        let hidden = self.blocked || self.busy & regs::BUSY[0] != 0;
        self.blocked = false;
        let mut matches = [false; 3];
        let mut flags = 0;
        for (i, channel) in self.channels.iter().take(usize::from(self.shape.channels)).enumerate() {
            let disabled = hidden || (1..=2).contains(&(i + 1)) && self.busy & regs::BUSY[i + 1] != 0;
            matches[i] = !disabled && channel.compare == value;
            flags |= u8::from(matches[i]) * (OCFA << i);
        }
        let at_top = match self.mode.top {
            Top::Fixed(top) => value == top,
            Top::OcrA => matches[0],
            Top::Icr => !hidden && value == self.icr,
        };
        if at_top && self.mode.top == Top::Icr {
            flags |= ICF;
        }
        let over = match slope {
            Slope::Normal | Slope::Ctc => value == self.shape.max(),
            Slope::Fast => at_top,
            Slope::Phase | Slope::Frequency => value == 0,
        };
        flags |= u8::from(over) * TOV;
        let down = self.mode.dual() && value != 0 && (at_top || self.down);
        self.value = match (self.mode.dual(), at_top) {
            (false, true) => 0,
            (true, true) if value == 0 => 0,
            _ if down => value - 1,
            _ => value.wrapping_add(1) & self.shape.max(),
        };
        self.down = down && self.value != 0;
        let update = match slope {
            Slope::Normal | Slope::Ctc => false,
            Slope::Fast => self.value == 0,
            Slope::Phase => at_top,
            Slope::Frequency => value == 0,
        };
        for (channel, matched) in self.channels.iter_mut().zip(matches) {
            if update {
                channel.compare = channel.buffer;
            }
            match channel.action {
                Action::Toggle if matched => channel.level = !channel.level,
                Action::Level(to) if matched => channel.level = to,
                Action::Wave(up) => {
                    if matched {
                        channel.level = up != down;
                    }
                    // From TOP to BOTTOM, and not by the wrap at MAX, as measured on silicon.
                    if slope == Slope::Fast && at_top {
                        channel.level = !up;
                    }
                    // 15.7.4: a match that was missed on the way up, or will not come by a new OCR, is made up for at TOP.
                    if slope == Slope::Phase && at_top {
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
        self.show(t, out);
        if self.asynchronous() {
            for i in 0..3 {
                if flags >> i & 1 != 0 {
                    self.late[i] = self.late[i].min(t.saturating_add(regs::LATE));
                }
            }
        } else {
            self.set(flags, t, out);
        }
    }

    /// Sets flags at the cycle `t`.
    fn set(&mut self, flags: u8, t: u64, out: &mut Outbox) {
        let flags = flags & self.shape.flags();
        let told = flags & !self.tifr & self.listened;
        self.tifr |= flags;
        for flag in self.shape.each(told) {
            out.push(Signal::Flag { t, irq: self.shape.irq(flag) });
        }
    }

    /// An edge of the capture pin counts if it is of the kind that is asked for now (16.6).
    fn capture(&mut self, edge: Edge, t: u64, out: &mut Outbox) {
        let wanted = Edge { rising: self.tccrb & regs::ICES != 0, filtered: self.tccrb & regs::ICNC != 0 };
        if edge == wanted && self.shape.capture && !self.icr_is_top() {
            self.icr = self.value;
            self.set(ICF, t, out);
        }
    }
}
