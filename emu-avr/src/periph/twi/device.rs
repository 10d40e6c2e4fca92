//! The registers, and what the chip says to the part.

use emu_core::NEVER;

use super::super::{Device, Line, Outbox};
use super::{NOTHING, Reg, TWEN, TWIE, TWINT, TWWC, Twi};

impl Device for Twi {
    type Reg = Reg;

    fn run(&mut self, t: u64, out: &mut Outbox) {
        loop {
            let due = self.due();
            if due > t {
                return;
            }
            self.step(due, out);
        }
    }

    fn next(&self) -> u64 {
        if self.has(TWEN) { self.due() } else { NEVER }
    }

    /// 0 TWI.
    fn requests(&self) -> u8 {
        u8::from(self.has(TWINT) && self.has(TWIE))
    }

    fn peek(&self, reg: Reg, t: u64) -> u8 {
        if self.due() <= t {
            let mut then = self.clone();
            then.run(t, &mut Outbox::new());
            return then.peek(reg, t);
        }
        match reg {
            Reg::TWBR => self.rate,
            Reg::TWSR => self.status | self.prescaler,
            Reg::TWAR => self.address,
            Reg::TWDR => self.data,
            Reg::TWCR => self.control,
            Reg::TWAMR => self.mask,
        }
    }

    fn write(&mut self, reg: Reg, value: u8, mask: u8, t: u64, out: &mut Outbox) {
        self.run(t, out);
        if self.asleep.is_some() {
            return;
        }
        let merge = |old: u8| old & !mask | value & mask;
        match reg {
            Reg::TWBR => self.rate = merge(self.rate),
            Reg::TWSR => self.prescaler = merge(self.prescaler) & 3,
            Reg::TWAR => self.address = merge(self.address),
            Reg::TWAMR => self.mask = merge(self.mask) & 0xFE,
            Reg::TWDR if self.has(TWINT) => {
                self.data = merge(self.data);
                self.control &= !TWWC;
            }
            Reg::TWDR => self.control |= TWWC,
            Reg::TWCR => {
                let kept = self.control & (TWINT | TWWC);
                self.control = merge(self.control) & !(TWINT | TWWC | 2) | kept;
                let clear = value & mask & kept & TWINT != 0 && self.flagged != t;
                if clear {
                    self.control &= !TWINT;
                    self.status = NOTHING;
                }
                self.command(clear, t);
            }
        }
        self.settle(t, out);
    }

    fn line(&mut self, line: Line, high: bool, t: u64, out: &mut Outbox) {
        self.run(t, out);
        let wire = match line {
            Line::Scl => &mut self.scl,
            Line::Sda => &mut self.sda,
            _ => return,
        };
        wire.change(high, t);
        if self.asleep.is_some() {
            self.see_all(t, out);
        }
    }

    fn reset(&mut self, t: u64, out: &mut Outbox) {
        self.wake(t, out);
        self.run(t, out);
        let Twi { scl, sda, drives, .. } = *self;
        *self = Twi { scl, sda, drives, ..Twi::new() };
        self.settle(t, out);
    }

    /// An address is recognised without a clock (section 22.9.2, table 10-1): SCL itself is the clock then, and the wires are seen
    /// at once.
    fn sleep(&mut self, t: u64, out: &mut Outbox) {
        self.run(t, out);
        if self.asleep.is_none() {
            self.asleep = Some(t);
            self.see_all(t, out);
        }
    }

    fn wake(&mut self, t: u64, out: &mut Outbox) {
        let Some(from) = self.asleep.take() else { return };
        // What was begun in sleep has its time from then on.
        self.timer = self.timer.saturating_add(t.saturating_sub(from));
        self.settle(t, out);
    }

    fn steady(&self, reg: Reg, t: u64) -> u64 {
        match reg {
            Reg::TWSR | Reg::TWDR | Reg::TWCR if self.has(TWEN) => self.due().max(t),
            _ => NEVER,
        }
    }
}

impl Twi {
    /// The clock stands: whatever is in the synchronisers comes out.
    fn see_all(&mut self, t: u64, out: &mut Outbox) {
        loop {
            let due = self.scl.next().min(self.sda.next());
            if due == NEVER {
                return;
            }
            let timer = self.timer;
            self.wires(due);
            // A timer that is set now begins as the clock stops.
            if self.timer != timer && self.timer != NEVER {
                let from = self.asleep.unwrap_or(t);
                self.timer = self.timer.saturating_sub(due.saturating_sub(from));
            }
            if self.flagged == due {
                self.flagged = t;
            }
            self.settle(t, out);
        }
    }
}
