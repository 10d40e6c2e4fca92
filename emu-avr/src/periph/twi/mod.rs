//! Two-wire interface (section 22), simulated bit by bit on a shared bus.
//!
//! The interface pulls a line low ([`AvrDrive::Output`] with false) or releases it ([`AvrDrive::Input`]). The
//! level of each line arrives by [`on_line_changed`](super::Device::on_line_changed), at the same edge if
//! the interface itself caused it; the interface detects it two cycles later. Both halves of an SCL period
//! are counted from edges on the line, so several masters and devices that stretch the clock stay
//! synchronized.

mod bus;
mod device;

use emu_core::NEVER;
use emu_core::state;

use super::edges::SynchronizedPin;
use super::{AvrDrive, AvrLine, AvrOutbox, AvrSignal};

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

/// Status in TWSR while TWINT is 0.
const NO_STATUS: u8 = 0xF8;
/// Cycles from an edge on a line to its detection.
const SYNC_CYCLES: u64 = 2;
/// Cycles from the change of SDA by a slave to the release of SCL.
const SETUP_CYCLES: u64 = 2;

/// The registers of the TWI.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TwiRegister {
    TWBR,
    TWSR,
    TWAR,
    TWDR,
    TWCR,
    TWAMR,
}

/// State of the master.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MasterState {
    /// Inactive.
    Off,
    /// START is on the bus; `again` for a repeated START.
    Start { again: bool },
    /// Waits until both lines are high, to send a repeated START.
    Again,
    /// Sends a byte, the address or data.
    Send { address: bool },
    /// Receives a byte.
    Receive,
    /// TWINT is set; the master waits for a command.
    Hold(AfterHold),
    /// SDA is low for a STOP.
    Stop,
}

state! {
    enum MasterState { 0 = Off, 1 = Start { again }, 2 = Again, 3 = Send { address }, 4 = Receive, 5 = Hold(next), 6 = Stop }
}

/// Next action of a waiting master, unless the command is START or STOP.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum AfterHold {
    #[default]
    Address,
    Send,
    Receive,
}

state! { enum AfterHold { 0 = Address, 1 = Send, 2 = Receive } }

/// State of the slave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SlaveState {
    /// Not addressed.
    Off,
    /// Receiver, addressed by its own address or by the general call.
    Receive { general: bool },
    /// Transmitter.
    Send,
}

state! { enum SlaveState { 0 = Off, 1 = Receive { general }, 2 = Send } }

/// Action at the end of the timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TwiAction {
    PullScl,
    FreeScl,
    /// Pulls SDA low: START.
    Start,
    /// Releases SDA: STOP.
    Stop,
}

state! { enum TwiAction { 0 = PullScl, 1 = FreeScl, 2 = Start, 3 = Stop } }

/// The two-wire interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AvrTwi {
    rate: u8,
    /// TWSR<7:3>; [`NO_STATUS`] while TWINT is 0.
    status: u8,
    prescaler: u8,
    address: u8,
    mask: u8,
    /// TWDR: the last complete byte on the bus.
    data: u8,
    shift: u8,
    control: u8,
    /// Cycle at which TWINT was last set.
    flagged: u64,
    master: MasterState,
    slave: SlaveState,
    /// True between START and STOP.
    busy: bool,
    /// True if the byte is the first one after a START.
    first: bool,
    /// True if the arbitration was lost in this byte.
    lost: bool,
    /// Number of rising edges of SCL in this byte; then whether the ninth bit was an acknowledge.
    count: u8,
    acknowledged: bool,
    timer: u64,
    act: TwiAction,
    scl: SynchronizedPin,
    sda: SynchronizedPin,
    pull_scl: bool,
    pull_sda: bool,
    /// Overrides of SCL and SDA.
    drives: [AvrDrive; 2],
    /// Cycle at which the clock was stopped; None while it runs.
    asleep: Option<u64>,
}

state! {
    AvrTwi {
        rate, status, prescaler, address, mask, data, shift, control, flagged, master, slave, busy, first, lost, count, acknowledged,
        timer, act, scl, sda, pull_scl, pull_sda, drives, asleep,
    } if |twi, _now| twi.count <= 9 && twi.prescaler < 4 && twi.asleep != Some(NEVER)
}

impl AvrTwi {
    /// Returns the interface after power-on, with both lines low.
    #[must_use]
    pub fn new() -> AvrTwi {
        AvrTwi {
            rate: 0,
            status: NO_STATUS,
            prescaler: 0,
            address: 0xFE,
            mask: 0,
            data: 0xFF,
            shift: 0xFF,
            control: 0,
            flagged: NEVER,
            master: MasterState::Off,
            slave: SlaveState::Off,
            busy: false,
            first: false,
            lost: false,
            count: 0,
            acknowledged: false,
            timer: NEVER,
            act: TwiAction::FreeScl,
            scl: SynchronizedPin::new(false),
            sda: SynchronizedPin::new(false),
            pull_scl: false,
            pull_sda: false,
            drives: [AvrDrive::Port; 2],
            asleep: None,
        }
    }

    fn has(&self, bit: u8) -> bool {
        self.control & bit != 0
    }

    /// Returns half a period of SCL in cycles; the frequency is f / (16 + 2 TWBR 4^TWPS) (section 22.5.2).
    fn half(&self) -> u64 {
        8 + (u64::from(self.rate) << (2 * self.prescaler))
    }

    fn due(&self) -> u64 {
        match self.asleep {
            Some(_) => NEVER,
            None => self.timer.min(self.scl.next()).min(self.sda.next()),
        }
    }

    fn step(&mut self, t: u64, out: &mut AvrOutbox) {
        self.sample_bus(t);
        if self.timer <= t {
            self.timer = NEVER;
            match self.act {
                TwiAction::PullScl => self.pull_scl = true,
                TwiAction::FreeScl => self.pull_scl = false,
                // Another master sends a bit instead of the repeated START: the arbitration is lost.
                TwiAction::Start if !self.sda.synchronized_level() => {
                    self.release_bus();
                    self.flag(0x38, t);
                }
                TwiAction::Start => self.pull_start(t),
                TwiAction::Stop => self.pull_sda = false,
            }
        }
        self.drive_lines(t, out);
    }

    /// Handles the line changes that leave the synchronizers at `t`.
    fn sample_bus(&mut self, t: u64) {
        let high = self.scl.synchronized_level();
        let scl = self.scl.pop(t);
        let sda = self.sda.pop(t);
        if !self.has(TWEN) {
            return;
        }
        match (scl, sda) {
            (Some(true), _) => self.on_scl_rise(t),
            (Some(false), _) => self.on_scl_fall(t),
            (None, Some(level)) if high => self.on_condition(!level, t),
            _ => {}
        }
    }

    fn schedule(&mut self, cycles: u64, t: u64, act: TwiAction) {
        (self.timer, self.act) = (t.saturating_add(cycles), act);
    }

    /// Sets TWINT with a status.
    fn flag(&mut self, status: u8, t: u64) {
        self.control |= TWINT;
        self.flagged = t;
        self.status = status;
        // While TWINT is set, the low period of SCL is stretched.
        self.pull_scl |= !self.scl.synchronized_level();
    }

    /// Releases the bus, because TWEN is 0 or a STOP resets a slave.
    fn release_bus(&mut self) {
        (self.master, self.slave, self.lost, self.first) = (MasterState::Off, SlaveState::Off, false, false);
        (self.timer, self.pull_scl, self.pull_sda) = (NEVER, false, false);
    }

    /// Handles a write of TWCR; `clear` is true if it clears TWINT.
    fn command(&mut self, clear: bool, t: u64) {
        if !self.has(TWEN) {
            self.release_bus();
            (self.busy, self.count) = (false, 0);
            return;
        }
        if self.act == TwiAction::Start && !self.has(TWSTA) {
            self.timer = NEVER;
        }
        let MasterState::Hold(next) = self.master else {
            if self.has(TWSTO) && self.master == MasterState::Off {
                // A slave sends no STOP; it leaves its current transfer (section 22.9.2, TWSTO).
                self.control &= !TWSTO;
                self.release_bus();
            } else if clear {
                if self.slave == SlaveState::Send {
                    self.begin_sending();
                }
                if self.pull_scl {
                    self.schedule(SETUP_CYCLES, t, TwiAction::FreeScl);
                }
            }
            return;
        };
        if !clear {
            return;
        }
        self.master = match next {
            _ if self.has(TWSTO) => MasterState::Stop,
            _ if self.has(TWSTA) => MasterState::Again,
            AfterHold::Address => MasterState::Send { address: true },
            AfterHold::Send => MasterState::Send { address: false },
            AfterHold::Receive => MasterState::Receive,
        };
        self.pull_sda = self.master == MasterState::Stop;
        if let MasterState::Send { .. } = self.master {
            self.begin_sending();
        }
        self.schedule(self.half(), t, TwiAction::FreeScl);
    }

    /// Puts the first bit of TWDR on SDA.
    fn begin_sending(&mut self) {
        (self.shift, self.count) = (self.data, 0);
        self.put();
    }

    /// Puts the next bit on SDA.
    fn put(&mut self) {
        self.pull_sda = self.shift & 0x80 == 0;
    }

    /// Schedules a START, to be sent when the bus has been free for half a period.
    fn request_start(&mut self, t: u64) {
        let idle =
            self.master == MasterState::Off && self.slave == SlaveState::Off && !self.busy && self.timer == NEVER;
        let wanted = self.control & (TWEN | TWSTA | TWINT) == TWEN | TWSTA;
        if idle && wanted && self.scl.synchronized_level() && self.sda.synchronized_level() && self.asleep.is_none() {
            self.schedule(self.half(), t, TwiAction::Start);
        }
    }

    /// Sends the overrides of the lines that have changed (table 14-8).
    fn drive_lines(&mut self, t: u64, out: &mut AvrOutbox) {
        self.request_start(t);
        let drive = |pull| match (self.has(TWEN), pull) {
            (false, _) => AvrDrive::Port,
            (true, true) => AvrDrive::Output(false),
            (true, false) => AvrDrive::Input,
        };
        let drives = [drive(self.pull_scl), drive(self.pull_sda)];
        for ((line, drive), held) in [AvrLine::Scl, AvrLine::Sda].into_iter().zip(drives).zip(&mut self.drives) {
            if std::mem::replace(held, drive) != drive {
                out.push(AvrSignal::Drive { t, line, drive });
            }
        }
    }
}

impl Default for AvrTwi {
    fn default() -> AvrTwi {
        AvrTwi::new()
    }
}
