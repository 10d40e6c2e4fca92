//! Reactions of TWI master and slave to edges on the bus (sections 22.3 to 22.8, tables 22-2 to 22-6).

use emu_core::NEVER;

use super::{AfterHold, AvrTwi, MasterState, SYNC_CYCLES, SlaveState, TWEA, TWINT, TWSTO, TwiAction};

impl AvrTwi {
    fn is_transferring(&self) -> bool {
        matches!(self.master, MasterState::Send { .. } | MasterState::Receive)
    }

    /// Handles a rising edge of SCL: a bit is on the bus.
    pub(super) fn on_scl_rise(&mut self, t: u64) {
        let bit = self.sda.synchronized_level();
        if self.busy {
            self.count = (self.count + 1).min(9);
            match self.count {
                9 => self.acknowledged = !bit,
                _ => self.shift = self.shift << 1 | u8::from(bit),
            }
            if self.count == 8 {
                self.data = self.shift;
            }
        }
        match self.master {
            MasterState::Send { .. } | MasterState::Receive => {
                // A transmitter that sends a 1 and reads a 0 has lost the arbitration (section 22.5.1).
                let sends = matches!(self.master, MasterState::Send { .. }) == (self.count < 9);
                if sends && !self.pull_sda && !bit {
                    self.master = MasterState::Off;
                    self.lost = true;
                    self.timer = NEVER;
                } else {
                    self.schedule(self.half() - SYNC_CYCLES, t, TwiAction::PullScl);
                }
            }
            MasterState::Again => self.schedule(self.half() - SYNC_CYCLES, t, TwiAction::Start),
            MasterState::Stop => self.schedule(self.half() - SYNC_CYCLES, t, TwiAction::Stop),
            _ => {}
        }
    }

    /// Handles a falling edge of SCL, whichever device causes it.
    pub(super) fn on_scl_fall(&mut self, t: u64) {
        if matches!(self.act, TwiAction::PullScl | TwiAction::Start | TwiAction::Stop) {
            self.timer = NEVER;
        }
        if self.control & TWINT != 0 {
            self.pull_scl = true;
            return;
        }
        if let MasterState::Start { again } = self.master {
            // Noise may have hidden the edge of SDA from this interface.
            (self.busy, self.first, self.count) = (true, true, 0);
            self.pull_scl = true;
            self.master = MasterState::Hold(AfterHold::Address);
            self.flag(if again { 0x10 } else { 0x08 }, t);
            return;
        }
        match self.count {
            0 => {}
            1..8 => {
                if matches!(self.master, MasterState::Send { .. }) || self.slave == SlaveState::Send {
                    self.put();
                }
            }
            8 => self.pull_sda = self.acknowledges(),
            _ => return self.on_byte_received(t),
        }
        if self.is_transferring() {
            self.pull_scl = true;
            self.schedule(self.half() - SYNC_CYCLES, t, TwiAction::FreeScl);
        }
    }

    /// Decides, after eight bits, whether this interface acknowledges them.
    fn acknowledges(&mut self) -> bool {
        let wants = self.has(TWEA);
        match (self.master, self.slave) {
            (MasterState::Receive, _) | (MasterState::Off, SlaveState::Receive { .. }) => wants,
            (MasterState::Off, SlaveState::Off) if self.first && wants => {
                let general = self.data == 0 && self.address & 1 != 0;
                let own = (self.data ^ self.address) & 0xFE & !self.mask == 0;
                self.slave = match (general, own) {
                    (true, _) => SlaveState::Receive { general },
                    (false, true) if self.data & 1 != 0 => SlaveState::Send,
                    (false, true) => SlaveState::Receive { general },
                    (false, false) => SlaveState::Off,
                };
                self.slave != SlaveState::Off
            }
            _ => false,
        }
    }

    /// Handles the end of the ninth bit: sets status and next state.
    fn on_byte_received(&mut self, t: u64) {
        let acknowledged = self.acknowledged;
        let choose = |yes: u8, no: u8| if acknowledged { yes } else { no };
        let lost = std::mem::take(&mut self.lost);
        let first = std::mem::take(&mut self.first);
        self.count = 0;
        self.pull_sda = false;
        let status = match (self.master, self.slave) {
            (MasterState::Send { address: true }, _) if self.data & 1 != 0 => {
                self.master = MasterState::Hold(AfterHold::Receive);
                choose(0x40, 0x48)
            }
            (MasterState::Send { address }, _) => {
                self.master = MasterState::Hold(AfterHold::Send);
                if address { choose(0x18, 0x20) } else { choose(0x28, 0x30) }
            }
            (MasterState::Receive, _) => {
                self.master = MasterState::Hold(AfterHold::Receive);
                choose(0x50, 0x58)
            }
            (_, SlaveState::Off) if lost => 0x38,
            (_, SlaveState::Off) => return,
            (_, SlaveState::Send) if first => 0xA8 + 8 * u8::from(lost),
            (_, SlaveState::Send) if acknowledged && self.has(TWEA) => 0xB8,
            (_, SlaveState::Send) => choose(0xC8, 0xC0),
            (_, SlaveState::Receive { general }) => {
                let offset = 0x10 * u8::from(general);
                offset + if first { 0x60 + 8 * u8::from(lost) } else { choose(0x80, 0x88) }
            }
        };
        if matches!(status, 0x88 | 0x98 | 0xC0 | 0xC8) {
            self.slave = SlaveState::Off;
        }
        self.pull_scl = true;
        self.timer = NEVER;
        self.flag(status, t);
    }

    /// Handles a START or STOP condition on the bus.
    pub(super) fn on_condition(&mut self, start: bool, t: u64) {
        if self.act == TwiAction::Start && self.master == MasterState::Off {
            self.timer = NEVER;
        }
        let count = std::mem::replace(&mut self.count, 0);
        let lost = std::mem::take(&mut self.lost);
        let listens = self.first || lost || self.slave != SlaveState::Off;
        (self.first, self.busy) = (start, start);
        match self.master {
            MasterState::Start { .. } => return,
            MasterState::Again if start => return self.pull_start(t),
            MasterState::Again => {
                // The bus has become free in between; the master sends START nevertheless.
                self.busy = true;
                return;
            }
            MasterState::Stop if !start => {
                self.master = MasterState::Off;
                self.control &= !TWSTO;
                return;
            }
            _ => {}
        }
        // Conditions are allowed only in the first clock after a byte (section 22.8.3).
        if self.is_transferring() || listens && count > 1 {
            self.release_bus();
            self.first = start;
            self.flag(0x00, t);
        } else if self.slave != SlaveState::Off {
            self.slave = SlaveState::Off;
            self.pull_sda = false;
            self.flag(0xA0, t);
        } else if lost {
            self.flag(0x38, t);
        }
    }

    /// Sends START: pulls SDA low while SCL is high.
    pub(super) fn pull_start(&mut self, t: u64) {
        let again = self.master == MasterState::Again;
        self.pull_sda = true;
        self.master = MasterState::Start { again };
        self.schedule(self.half(), t, TwiAction::PullScl);
    }
}
