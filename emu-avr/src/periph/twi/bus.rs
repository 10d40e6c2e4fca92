//! What the edges of the wires make of master and slave (sections 22.3 to 22.8, tables 22-2 to 22-6).

use emu_core::NEVER;

use super::{Act, Master, Next, SEEN, Slave, TWEA, TWINT, TWSTO, Twi};

impl Twi {
    fn moves_bits(&self) -> bool {
        matches!(self.master, Master::Send { .. } | Master::Receive)
    }

    /// SCL has risen: a bit is on the bus.
    pub(super) fn rise(&mut self, t: u64) {
        let bit = self.sda.seen();
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
            Master::Send { .. } | Master::Receive => {
                // Who sends a 1 and finds a 0 has lost (section 22.5.1).
                let sends = matches!(self.master, Master::Send { .. }) == (self.count < 9);
                if sends && !self.pull_sda && !bit {
                    self.master = Master::Off;
                    self.lost = true;
                    self.timer = NEVER;
                } else {
                    self.after(self.half() - SEEN, t, Act::PullScl);
                }
            }
            Master::Again => self.after(self.half() - SEEN, t, Act::Start),
            Master::Stop => self.after(self.half() - SEEN, t, Act::Stop),
            _ => {}
        }
    }

    /// SCL has fallen, by whomever.
    pub(super) fn fall(&mut self, t: u64) {
        if matches!(self.act, Act::PullScl | Act::Start | Act::Stop) {
            self.timer = NEVER;
        }
        if self.control & TWINT != 0 {
            self.pull_scl = true;
            return;
        }
        if let Master::Start { again } = self.master {
            // Noise may have hidden the edge of SDA from this part.
            (self.busy, self.first, self.count) = (true, true, 0);
            self.pull_scl = true;
            self.master = Master::Hold(Next::Address);
            self.flag(if again { 0x10 } else { 0x08 }, t);
            return;
        }
        match self.count {
            0 => {}
            1..8 => {
                if matches!(self.master, Master::Send { .. }) || self.slave == Slave::Send {
                    self.put();
                }
            }
            8 => self.pull_sda = self.acknowledges(),
            _ => return self.byte(t),
        }
        if self.moves_bits() {
            self.pull_scl = true;
            self.after(self.half() - SEEN, t, Act::FreeScl);
        }
    }

    /// Eight bits are over: is it for this part to acknowledge them?
    fn acknowledges(&mut self) -> bool {
        let wants = self.has(TWEA);
        match (self.master, self.slave) {
            (Master::Receive, _) | (Master::Off, Slave::Receive { .. }) => wants,
            (Master::Off, Slave::Off) if self.first && wants => {
                let general = self.data == 0 && self.address & 1 != 0;
                let own = (self.data ^ self.address) & 0xFE & !self.mask == 0;
                self.slave = match (general, own) {
                    (true, _) => Slave::Receive { general },
                    (false, true) if self.data & 1 != 0 => Slave::Send,
                    (false, true) => Slave::Receive { general },
                    (false, false) => Slave::Off,
                };
                self.slave != Slave::Off
            }
            _ => false,
        }
    }

    /// The ninth bit is over.
    fn byte(&mut self, t: u64) {
        let acknowledged = self.acknowledged;
        let choose = |yes: u8, no: u8| if acknowledged { yes } else { no };
        let lost = std::mem::take(&mut self.lost);
        let first = std::mem::take(&mut self.first);
        self.count = 0;
        self.pull_sda = false;
        let status = match (self.master, self.slave) {
            (Master::Send { address: true }, _) if self.data & 1 != 0 => {
                self.master = Master::Hold(Next::Receive);
                choose(0x40, 0x48)
            }
            (Master::Send { address }, _) => {
                self.master = Master::Hold(Next::Send);
                if address { choose(0x18, 0x20) } else { choose(0x28, 0x30) }
            }
            (Master::Receive, _) => {
                self.master = Master::Hold(Next::Receive);
                choose(0x50, 0x58)
            }
            (_, Slave::Off) if lost => 0x38,
            (_, Slave::Off) => return,
            (_, Slave::Send) if first => 0xA8 + 8 * u8::from(lost),
            (_, Slave::Send) if acknowledged && self.has(TWEA) => 0xB8,
            (_, Slave::Send) => choose(0xC8, 0xC0),
            (_, Slave::Receive { general }) => {
                let offset = 0x10 * u8::from(general);
                offset + if first { 0x60 + 8 * u8::from(lost) } else { choose(0x80, 0x88) }
            }
        };
        if matches!(status, 0x88 | 0x98 | 0xC0 | 0xC8) {
            self.slave = Slave::Off;
        }
        self.pull_scl = true;
        self.timer = NEVER;
        self.flag(status, t);
    }

    /// START or STOP is on the bus.
    pub(super) fn condition(&mut self, start: bool, t: u64) {
        if self.act == Act::Start && self.master == Master::Off {
            self.timer = NEVER;
        }
        let count = std::mem::replace(&mut self.count, 0);
        let lost = std::mem::take(&mut self.lost);
        let listens = self.first || lost || self.slave != Slave::Off;
        (self.first, self.busy) = (start, start);
        match self.master {
            Master::Start { .. } => return,
            Master::Again if start => return self.pull_start(t),
            Master::Again => {
                // The bus has become free in between: what is sent is START all the same.
                self.busy = true;
                return;
            }
            Master::Stop if !start => {
                self.master = Master::Off;
                self.control &= !TWSTO;
                return;
            }
            _ => {}
        }
        // The first clock after a byte is where conditions belong (section 22.8.3).
        if self.moves_bits() || listens && count > 1 {
            self.leave();
            self.first = start;
            self.flag(0x00, t);
        } else if self.slave != Slave::Off {
            self.slave = Slave::Off;
            self.pull_sda = false;
            self.flag(0xA0, t);
        } else if lost {
            self.flag(0x38, t);
        }
    }

    /// SDA is pulled while SCL is high.
    pub(super) fn pull_start(&mut self, t: u64) {
        let again = self.master == Master::Again;
        self.pull_sda = true;
        self.master = Master::Start { again };
        self.after(self.half(), t, Act::PullScl);
    }
}
