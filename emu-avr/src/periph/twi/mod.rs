//! Two-wire interface (section 22), bit by bit on a bus that others share.
//!
//! The part pulls a line low ([`Drive::Output`] of a 0) or lets it go ([`Drive::Input`]); what the wires are comes back by
//! `Device::line`, at the same edge where it is the part's own doing. It sees them two cycles later. The two halves of a period
//! of SCL count from the edges of the wire, so that several masters and those who stretch the clock agree on it.

mod bus;
mod device;

use emu_core::NEVER;
use emu_core::state;

use super::edges::Edges;
use super::{Drive, Line, Outbox, Signal};

/// TWCR: interrupt flag.
pub const TWINT: u8 = 1 << 7;
/// TWCR: acknowledge.
pub const TWEA: u8 = 1 << 6;
/// TWCR: START.
pub const TWSTA: u8 = 1 << 5;
/// TWCR: STOP.
pub const TWSTO: u8 = 1 << 4;
/// TWCR: write collision.
pub const TWWC: u8 = 1 << 3;
/// TWCR: enable.
pub const TWEN: u8 = 1 << 2;
/// TWCR: interrupt enable.
pub const TWIE: u8 = 1;

/// TWSR while TWINT is 0.
const NOTHING: u8 = 0xF8;
/// Cycles from the edge of a wire to when it is seen.
const SEEN: u64 = 2;
/// Cycles that a slave gives SDA before it lets SCL go.
const SET_UP: u64 = 2;

/// The registers.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reg {
    TWBR,
    TWSR,
    TWAR,
    TWDR,
    TWCR,
    TWAMR,
}

/// What this part does as a master.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Master {
    /// Nothing.
    Off,
    /// START is on the bus, a repeated one or not.
    Start { again: bool },
    /// Both lines are to be high before a repeated START.
    Again,
    /// Sends a byte, the address or data.
    Send { address: bool },
    /// Receives a byte.
    Receive,
    /// TWINT is set.
    Hold(Next),
    /// SDA is low for a STOP.
    Stop,
}

state! {
    enum Master { 0 = Off, 1 = Start { again }, 2 = Again, 3 = Send { address }, 4 = Receive, 5 = Hold(next), 6 = Stop }
}

/// What a master does next, unless it is to be START or STOP.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Next {
    #[default]
    Address,
    Send,
    Receive,
}

state! { enum Next { 0 = Address, 1 = Send, 2 = Receive } }

/// What this part is as a slave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Slave {
    /// Not addressed.
    Off,
    /// Receiver, by its address or by the general call.
    Receive { general: bool },
    /// Transmitter.
    Send,
}

state! { enum Slave { 0 = Off, 1 = Receive { general }, 2 = Send } }

/// What the timer is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Act {
    PullScl,
    FreeScl,
    /// SDA is pulled: START.
    Start,
    /// SDA is let go: STOP.
    Stop,
}

state! { enum Act { 0 = PullScl, 1 = FreeScl, 2 = Start, 3 = Stop } }

/// The two-wire interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Twi {
    rate: u8,
    /// TWSR<7:3>; [`NOTHING`] while TWINT is 0.
    status: u8,
    prescaler: u8,
    address: u8,
    mask: u8,
    /// TWDR: the last whole byte on the bus.
    data: u8,
    shift: u8,
    control: u8,
    /// When TWINT was set last.
    flagged: u64,
    master: Master,
    slave: Slave,
    /// Between START and STOP.
    busy: bool,
    /// The byte is the first one after a START.
    first: bool,
    /// Arbitration was lost in this byte.
    lost: bool,
    /// Rising edges of SCL in this byte, and the bit at the ninth.
    count: u8,
    acknowledged: bool,
    timer: u64,
    act: Act,
    scl: Edges,
    sda: Edges,
    pull_scl: bool,
    pull_sda: bool,
    /// What is done to SCL and SDA.
    drives: [Drive; 2],
    /// Since when the clock stands.
    asleep: Option<u64>,
}

state! {
    Twi {
        rate, status, prescaler, address, mask, data, shift, control, flagged, master, slave, busy, first, lost, count, acknowledged,
        timer, act, scl, sda, pull_scl, pull_sda, drives, asleep,
    } if |twi, _now| twi.count <= 9 && twi.prescaler < 4 && twi.asleep != Some(NEVER)
}

impl Twi {
    /// As after power-on; both wires are low until told otherwise.
    #[must_use]
    pub fn new() -> Twi {
        Twi {
            rate: 0,
            status: NOTHING,
            prescaler: 0,
            address: 0xFE,
            mask: 0,
            data: 0xFF,
            shift: 0xFF,
            control: 0,
            flagged: NEVER,
            master: Master::Off,
            slave: Slave::Off,
            busy: false,
            first: false,
            lost: false,
            count: 0,
            acknowledged: false,
            timer: NEVER,
            act: Act::FreeScl,
            scl: Edges::new(false),
            sda: Edges::new(false),
            pull_scl: false,
            pull_sda: false,
            drives: [Drive::Port; 2],
            asleep: None,
        }
    }

    fn has(&self, bit: u8) -> bool {
        self.control & bit != 0
    }

    /// Half a period of SCL, in cycles: f / (16 + 2 TWBR 4^TWPS) for a whole one (section 22.5.2).
    fn half(&self) -> u64 {
        8 + (u64::from(self.rate) << (2 * self.prescaler))
    }

    fn due(&self) -> u64 {
        match self.asleep {
            Some(_) => NEVER,
            None => self.timer.min(self.scl.next()).min(self.sda.next()),
        }
    }

    fn step(&mut self, t: u64, out: &mut Outbox) {
        self.wires(t);
        if self.timer <= t {
            self.timer = NEVER;
            match self.act {
                Act::PullScl => self.pull_scl = true,
                Act::FreeScl => self.pull_scl = false,
                // Somebody else sends a bit where a repeated START was to be: the arbitration is lost.
                Act::Start if !self.sda.seen() => {
                    self.leave();
                    self.flag(0x38, t);
                }
                Act::Start => self.pull_start(t),
                Act::Stop => self.pull_sda = false,
            }
        }
        self.settle(t, out);
    }

    /// Edges of the wires come out of the synchronisers.
    fn wires(&mut self, t: u64) {
        let high = self.scl.seen();
        let scl = self.scl.pop(t);
        let sda = self.sda.pop(t);
        if !self.has(TWEN) {
            return;
        }
        match (scl, sda) {
            (Some(true), _) => self.rise(t),
            (Some(false), _) => self.fall(t),
            (None, Some(level)) if high => self.condition(!level, t),
            _ => {}
        }
    }

    fn after(&mut self, cycles: u64, t: u64, act: Act) {
        (self.timer, self.act) = (t.saturating_add(cycles), act);
    }

    /// TWINT is set.
    fn flag(&mut self, status: u8, t: u64) {
        self.control |= TWINT;
        self.flagged = t;
        self.status = status;
        // While it is set the low period of SCL is stretched.
        self.pull_scl |= !self.scl.seen();
    }

    /// TWEN is 0, or a STOP frees a slave: the part lets go of the bus.
    fn leave(&mut self) {
        (self.master, self.slave, self.lost, self.first) = (Master::Off, Slave::Off, false, false);
        (self.timer, self.pull_scl, self.pull_sda) = (NEVER, false, false);
    }

    /// TWCR is written; `clear` says that TWINT is cleared by it.
    fn command(&mut self, clear: bool, t: u64) {
        if !self.has(TWEN) {
            self.leave();
            (self.busy, self.count) = (false, 0);
            return;
        }
        if self.act == Act::Start && !self.has(TWSTA) {
            self.timer = NEVER;
        }
        let Master::Hold(next) = self.master else {
            if self.has(TWSTO) && self.master == Master::Off {
                // No STOP is sent by a slave, which is thrown out of what it does (section 22.9.2, TWSTO).
                self.control &= !TWSTO;
                self.leave();
            } else if clear {
                if self.slave == Slave::Send {
                    self.begin_sending();
                }
                if self.pull_scl {
                    self.after(SET_UP, t, Act::FreeScl);
                }
            }
            return;
        };
        if !clear {
            return;
        }
        self.master = match next {
            _ if self.has(TWSTO) => Master::Stop,
            _ if self.has(TWSTA) => Master::Again,
            Next::Address => Master::Send { address: true },
            Next::Send => Master::Send { address: false },
            Next::Receive => Master::Receive,
        };
        self.pull_sda = self.master == Master::Stop;
        if let Master::Send { .. } = self.master {
            self.begin_sending();
        }
        self.after(self.half(), t, Act::FreeScl);
    }

    /// The first bit of TWDR goes out.
    fn begin_sending(&mut self) {
        (self.shift, self.count) = (self.data, 0);
        self.put();
    }

    /// The next bit goes out.
    fn put(&mut self) {
        self.pull_sda = self.shift & 0x80 == 0;
    }

    /// START is sent when the bus has been free for half a period.
    fn want_start(&mut self, t: u64) {
        let idle = self.master == Master::Off && self.slave == Slave::Off && !self.busy && self.timer == NEVER;
        let wanted = self.control & (TWEN | TWSTA | TWINT) == TWEN | TWSTA;
        if idle && wanted && self.scl.seen() && self.sda.seen() && self.asleep.is_none() {
            self.after(self.half(), t, Act::Start);
        }
    }

    /// Says what is done to the lines, where that has changed (table 14-8).
    fn settle(&mut self, t: u64, out: &mut Outbox) {
        self.want_start(t);
        let drive = |pull| match (self.has(TWEN), pull) {
            (false, _) => Drive::Port,
            (true, true) => Drive::Output(false),
            (true, false) => Drive::Input,
        };
        let drives = [drive(self.pull_scl), drive(self.pull_sda)];
        for ((line, drive), held) in [Line::Scl, Line::Sda].into_iter().zip(drives).zip(&mut self.drives) {
            if std::mem::replace(held, drive) != drive {
                out.push(Signal::Drive { t, line, drive });
            }
        }
    }
}

impl Default for Twi {
    fn default() -> Twi {
        Twi::new()
    }
}
