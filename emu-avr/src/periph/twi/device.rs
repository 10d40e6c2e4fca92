//! [`Device`] for the TWI: registers, lines and clocks.

use emu_core::NEVER;

use super::super::{AvrLine, AvrOutbox, AvrSignal, Device};
use super::{AvrTwi, NO_STATUS, TWEN, TWIE, TWINT, TWWC, TwiRegister};

impl Device<AvrSignal> for AvrTwi {
    type Reg = TwiRegister;

    fn run_due(&mut self, t: u64, out: &mut AvrOutbox) {
        loop {
            let due = self.due();
            if due > t {
                return;
            }
            self.step(due, out);
        }
    }

    fn next_deadline(&self) -> u64 {
        if self.has(TWEN) { self.due() } else { NEVER }
    }

    /// Interrupt 0: TWI.
    fn interrupt_requests(&self) -> u8 {
        u8::from(self.has(TWINT) && self.has(TWIE))
    }

    fn peek(&self, reg: TwiRegister, t: u64) -> u8 {
        if self.due() <= t {
            let mut then = self.clone();
            then.run_due(t, &mut AvrOutbox::new());
            return then.peek(reg, t);
        }
        match reg {
            TwiRegister::TWBR => self.rate,
            TwiRegister::TWSR => self.status | self.prescaler,
            TwiRegister::TWAR => self.address,
            TwiRegister::TWDR => self.data,
            TwiRegister::TWCR => self.control,
            TwiRegister::TWAMR => self.mask,
        }
    }

    fn write(&mut self, reg: TwiRegister, value: u8, mask: u8, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        if self.asleep.is_some() {
            return;
        }
        let merge = |old: u8| old & !mask | value & mask;
        match reg {
            TwiRegister::TWBR => self.rate = merge(self.rate),
            TwiRegister::TWSR => self.prescaler = merge(self.prescaler) & 3,
            TwiRegister::TWAR => self.address = merge(self.address),
            TwiRegister::TWAMR => self.mask = merge(self.mask) & 0xFE,
            TwiRegister::TWDR if self.has(TWINT) => {
                self.data = merge(self.data);
                self.control &= !TWWC;
            }
            TwiRegister::TWDR => self.control |= TWWC,
            TwiRegister::TWCR => {
                let kept = self.control & (TWINT | TWWC);
                self.control = merge(self.control) & !(TWINT | TWWC | 2) | kept;
                let clear = value & mask & kept & TWINT != 0 && self.flagged != t;
                if clear {
                    self.control &= !TWINT;
                    self.status = NO_STATUS;
                }
                self.command(clear, t);
            }
        }
        self.drive_lines(t, out);
    }

    fn on_line_changed(&mut self, line: AvrLine, high: bool, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        let wire = match line {
            AvrLine::Scl => &mut self.scl,
            AvrLine::Sda => &mut self.sda,
            _ => return,
        };
        wire.change(high, t);
        if self.asleep.is_some() {
            self.sample_lines(t, out);
        }
    }

    fn reset(&mut self, _power_on: bool, t: u64, out: &mut AvrOutbox) {
        self.restart_clock(t, out);
        self.run_due(t, out);
        let AvrTwi { scl, sda, drives, .. } = *self;
        *self = AvrTwi { scl, sda, drives, ..AvrTwi::new() };
        self.drive_lines(t, out);
    }

    /// An address is recognized without a clock (section 22.9.2, table 10-1): SCL itself is the clock then,
    /// and line changes take effect at once.
    fn stop_clock(&mut self, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        if self.asleep.is_none() {
            self.asleep = Some(t);
            self.sample_lines(t, out);
        }
    }

    fn restart_clock(&mut self, t: u64, out: &mut AvrOutbox) {
        let Some(from) = self.asleep.take() else { return };
        // A delay that started in sleep counts from the restart on.
        self.timer = self.timer.saturating_add(t.saturating_sub(from));
        self.drive_lines(t, out);
    }

    fn steady_until(&self, reg: TwiRegister, t: u64) -> u64 {
        match reg {
            TwiRegister::TWSR | TwiRegister::TWDR | TwiRegister::TWCR if self.has(TWEN) => self.due().max(t),
            _ => NEVER,
        }
    }
}

impl AvrTwi {
    /// Applies all changes in the synchronizers at once, because the clock is stopped.
    fn sample_lines(&mut self, t: u64, out: &mut AvrOutbox) {
        loop {
            let due = self.scl.next().min(self.sda.next());
            if due == NEVER {
                return;
            }
            let timer = self.timer;
            self.sample_bus(due);
            // A delay that is set now starts when the clock stops.
            if self.timer != timer && self.timer != NEVER {
                let from = self.asleep.unwrap_or(t);
                self.timer = self.timer.saturating_sub(due.saturating_sub(from));
            }
            if self.flagged == due {
                self.flagged = t;
            }
            self.drive_lines(t, out);
        }
    }
}
