//! A model of the interface that steps cycle by cycle: two flip-flops per line, one counter for the halves of
//! SCL, and the protocol as a list of what has been on the bus since the last START.

use emu_avr::periph::twi::TwiRegister;
use emu_avr::periph::{AvrDrive, AvrLine, AvrSignal};

/// State of the interface.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Role {
    Nobody,
    /// START, repeated if true, is on the bus; SCL will be pulled low next.
    Started(bool),
    Restarting,
    Stopping,
    /// Sends SLA, sends data, receives, as a master.
    Sla,
    Mt,
    Mr,
    /// The same states, waiting for software.
    ReadySla,
    ReadyMt,
    ReadyMr,
    /// Slave receiver (true for the general call), slave transmitter.
    Sr(bool),
    St,
}
use Role::*;

/// Action at the end of the counter.
#[derive(Clone, Copy, PartialEq)]
enum Then {
    ScLow,
    ScFree,
    Start,
    Stop,
}

pub struct Model {
    pub out: Vec<AvrSignal>,
    pub scl: bool,
    pub sda: bool,
    ff_scl: [bool; 2],
    ff_sda: [bool; 2],
    twbr: u8,
    twps: u8,
    status: u8,
    twar: u8,
    twamr: u8,
    twdr: u8,
    twint: bool,
    just: bool,
    twwc: bool,
    /// TWEA, TWSTA, TWSTO, TWEN and TWIE.
    bits: u8,
    role: Role,
    busy: bool,
    after_start: bool,
    lost: bool,
    /// Levels of SDA at the rising edges of SCL in this byte.
    byte: Vec<bool>,
    /// Byte to send.
    send: u8,
    counter: Option<(u64, Then)>,
    low_scl: bool,
    low_sda: bool,
    drives: [AvrDrive; 2],
    asleep: bool,
}

impl Model {
    pub fn new() -> Model {
        Model {
            out: Vec::new(),
            scl: false,
            sda: false,
            ff_scl: [false; 2],
            ff_sda: [false; 2],
            twbr: 0,
            twps: 0,
            status: 0xF8,
            twar: 0xFE,
            twamr: 0,
            twdr: 0xFF,
            twint: false,
            just: false,
            twwc: false,
            bits: 0,
            role: Nobody,
            busy: false,
            after_start: false,
            lost: false,
            byte: Vec::new(),
            send: 0xFF,
            counter: None,
            low_scl: false,
            low_sda: false,
            drives: [AvrDrive::Port; 2],
            asleep: false,
        }
    }

    fn on(&self) -> bool {
        self.bits & 4 != 0
    }

    fn twea(&self) -> bool {
        self.bits & 0x40 != 0
    }

    fn half(&self) -> u64 {
        let prescaler = [1, 4, 16, 64][usize::from(self.twps)];
        (16 + 2 * u64::from(self.twbr) * prescaler) / 2
    }

    fn count(&mut self, cycles: u64, then: Then) {
        self.counter = Some((cycles, then));
    }

    pub fn tick(&mut self, t: u64) {
        if self.asleep {
            return;
        }
        self.just = false;
        if let Some((left, _)) = &mut self.counter {
            *left -= 1;
        }
        let was = (self.ff_scl[1], self.ff_sda[1]);
        self.ff_scl = [self.scl, self.ff_scl[0]];
        self.ff_sda = [self.sda, self.ff_sda[0]];
        self.look(was);
        let over = self.counter.take_if(|(left, _)| *left == 0);
        match over.map(|(_, then)| then) {
            Some(Then::ScLow) => self.low_scl = true,
            Some(Then::ScFree) => self.low_scl = false,
            Some(Then::Stop) => self.low_sda = false,
            Some(Then::Start) if self.ff_sda[1] => self.start(),
            Some(Then::Start) => {
                self.release();
                self.flag(0x38);
            }
            None => {}
        }
        self.pins(t);
    }

    /// Processes the lines after the flip-flops; this may stop the counter at its last cycle.
    fn look(&mut self, was: (bool, bool)) {
        let (scl, sda) = (self.ff_scl[1], self.ff_sda[1]);
        if !self.on() {
            return;
        }
        if scl != was.0 {
            if scl { self.rise(sda) } else { self.fall() }
        } else if scl && sda != was.1 {
            self.condition(!sda);
        }
    }

    fn start(&mut self) {
        self.low_sda = true;
        self.role = Started(self.role == Restarting);
        self.count(self.half(), Then::ScLow);
    }

    fn release(&mut self) {
        (self.role, self.lost, self.after_start) = (Nobody, false, false);
        (self.low_scl, self.low_sda) = (false, false);
        self.counter = None;
    }

    fn flag(&mut self, status: u8) {
        (self.twint, self.just, self.status) = (true, true, status);
        if !self.ff_scl[1] {
            self.low_scl = true;
        }
    }

    fn rise(&mut self, sda: bool) {
        if self.busy {
            self.byte.push(sda);
            if self.byte.len() == 8 {
                self.twdr = self.byte.iter().fold(0, |byte, &bit| byte << 1 | u8::from(bit));
            }
        }
        let acknowledge = self.byte.len() >= 9;
        let mine = match self.role {
            Sla | Mt => !acknowledge,
            Mr => acknowledge,
            _ => false,
        };
        if mine && !self.low_sda && !sda {
            self.role = Nobody;
            self.lost = true;
            self.counter = None;
            return;
        }
        match self.role {
            Sla | Mt | Mr => self.count(self.half() - 2, Then::ScLow),
            Restarting => self.count(self.half() - 2, Then::Start),
            Stopping => self.count(self.half() - 2, Then::Stop),
            _ => {}
        }
    }

    fn fall(&mut self) {
        if self.counter.is_some_and(|(_, then)| then != Then::ScFree) {
            self.counter = None;
        }
        if self.twint {
            self.low_scl = true;
            return;
        }
        if let Started(again) = self.role {
            (self.role, self.low_scl) = (ReadySla, true);
            (self.busy, self.after_start) = (true, true);
            self.byte.clear();
            return self.flag(if again { 0x10 } else { 0x08 });
        }
        match self.byte.len() {
            0 => {}
            n @ 1..8 => {
                if matches!(self.role, Sla | Mt | St) {
                    self.low_sda = self.send >> (7 - n) & 1 == 0;
                }
            }
            8 => {
                if self.role == Nobody && self.after_start && self.twea() {
                    let unlike = (self.twdr >> 1 ^ self.twar >> 1) & !(self.twamr >> 1) & 0x7F;
                    if self.twdr == 0 && self.twar & 1 == 1 {
                        self.role = Sr(true);
                    } else if unlike == 0 {
                        self.role = if self.twdr & 1 == 1 { St } else { Sr(false) };
                    }
                    self.low_sda = self.role != Nobody;
                } else {
                    self.low_sda = matches!(self.role, Mr | Sr(_)) && self.twea();
                }
            }
            _ => return self.whole_byte(),
        }
        if matches!(self.role, Sla | Mt | Mr) {
            self.low_scl = true;
            self.count(self.half() - 2, Then::ScFree);
        }
    }

    fn whole_byte(&mut self) {
        let ack = self.byte.last() == Some(&false);
        let (first, lost) = (self.after_start, self.lost);
        (self.after_start, self.lost, self.low_sda) = (false, false, false);
        self.byte.clear();
        let read = self.twdr & 1 == 1;
        let (role, status) = match (self.role, ack, first) {
            (Sla, true, _) if read => (ReadyMr, 0x40),
            (Sla, false, _) if read => (ReadyMr, 0x48),
            (Sla, true, _) => (ReadyMt, 0x18),
            (Sla, false, _) => (ReadyMt, 0x20),
            (Mt, true, _) => (ReadyMt, 0x28),
            (Mt, false, _) => (ReadyMt, 0x30),
            (Mr, true, _) => (ReadyMr, 0x50),
            (Mr, false, _) => (ReadyMr, 0x58),
            (St, _, true) => (St, if lost { 0xB0 } else { 0xA8 }),
            (St, true, false) if self.twea() => (St, 0xB8),
            (St, true, false) => (Nobody, 0xC8),
            (St, false, false) => (Nobody, 0xC0),
            (Sr(false), _, true) => (Sr(false), if lost { 0x68 } else { 0x60 }),
            (Sr(true), _, true) => (Sr(true), if lost { 0x78 } else { 0x70 }),
            (Sr(false), true, _) => (Sr(false), 0x80),
            (Sr(false), false, _) => (Nobody, 0x88),
            (Sr(true), true, _) => (Sr(true), 0x90),
            (Sr(true), false, _) => (Nobody, 0x98),
            _ if lost => (Nobody, 0x38),
            _ => return,
        };
        self.role = role;
        self.low_scl = true;
        self.counter = None;
        self.flag(status);
    }

    fn condition(&mut self, start: bool) {
        if self.role == Nobody && self.counter.is_some_and(|(_, then)| then == Then::Start) {
            self.counter = None;
        }
        let bits = self.byte.len();
        self.byte.clear();
        let lost = std::mem::take(&mut self.lost);
        let slave = matches!(self.role, Sr(_) | St);
        let follows = slave || lost || self.after_start;
        (self.busy, self.after_start) = (start, start);
        match self.role {
            Started(_) => {}
            Restarting if start => self.start(),
            Restarting => self.busy = true,
            Stopping if !start => {
                self.role = Nobody;
                self.bits &= !0x10;
            }
            Sla | Mt | Mr => self.error(start),
            _ if follows && bits > 1 => self.error(start),
            _ if slave => {
                (self.role, self.low_sda) = (Nobody, false);
                self.flag(0xA0);
            }
            _ if lost => self.flag(0x38),
            _ => {}
        }
    }

    fn error(&mut self, start: bool) {
        self.release();
        self.after_start = start;
        self.flag(0);
    }

    // Inputs from the chip.

    pub fn line(&mut self, line: AvrLine, high: bool, t: u64) {
        match line {
            AvrLine::Scl => self.scl = high,
            _ => self.sda = high,
        }
        if self.asleep {
            self.seen_at_once(t);
        }
    }

    pub fn peek(&self, reg: TwiRegister) -> u8 {
        match reg {
            TwiRegister::TWBR => self.twbr,
            TwiRegister::TWSR => self.twps | if self.twint { self.status } else { 0xF8 },
            TwiRegister::TWAR => self.twar,
            TwiRegister::TWDR => self.twdr,
            TwiRegister::TWCR => self.bits | u8::from(self.twint) << 7 | u8::from(self.twwc) << 3,
            TwiRegister::TWAMR => self.twamr,
        }
    }

    pub fn requests(&self) -> u8 {
        u8::from(self.twint) & self.bits & 1
    }

    pub fn write(&mut self, reg: TwiRegister, value: u8, t: u64) {
        if self.asleep {
            return;
        }
        match reg {
            TwiRegister::TWBR => self.twbr = value,
            TwiRegister::TWSR => self.twps = value & 3,
            TwiRegister::TWAR => self.twar = value,
            TwiRegister::TWAMR => self.twamr = value & 0xFE,
            TwiRegister::TWDR => {
                if self.twint {
                    self.twdr = value;
                }
                self.twwc = !self.twint;
            }
            TwiRegister::TWCR => {
                self.bits = value & 0x75;
                let go = value & 0x80 != 0 && self.twint && !self.just;
                self.twint &= !go;
                self.control(go);
            }
        }
        self.pins(t);
    }

    fn control(&mut self, go: bool) {
        let (sto, sta) = (self.bits & 0x10 != 0, self.bits & 0x20 != 0);
        if !self.on() {
            self.release();
            self.busy = false;
            self.byte.clear();
            return;
        }
        if !sta && self.counter.is_some_and(|(_, then)| then == Then::Start) {
            self.counter = None;
        }
        let ready = matches!(self.role, ReadySla | ReadyMt | ReadyMr);
        if ready && go {
            self.role = match self.role {
                _ if sto => Stopping,
                _ if sta => Restarting,
                ReadySla => Sla,
                ReadyMt => Mt,
                _ => Mr,
            };
            self.send = self.twdr;
            if matches!(self.role, Sla | Mt) {
                self.byte.clear();
            }
            self.low_sda = match self.role {
                Stopping => true,
                Sla | Mt => self.send & 0x80 == 0,
                _ => false,
            };
            self.count(self.half(), Then::ScFree);
        } else if !ready && sto && matches!(self.role, Nobody | Sr(_) | St) {
            self.bits &= !0x10;
            self.release();
        } else if !ready && go {
            self.send = self.twdr;
            if self.role == St {
                self.byte.clear();
                self.low_sda = self.send & 0x80 == 0;
            }
            if self.low_scl {
                self.count(2, Then::ScFree);
            }
        }
    }

    /// Stops the clock: the pending changes in the flip-flops are processed, and from now on SCL and SDA take
    /// effect at once.
    pub fn sleep(&mut self, t: u64) {
        self.asleep = true;
        self.seen_at_once(t);
    }

    pub fn wake(&mut self, t: u64) {
        self.asleep = false;
        self.pins(t);
    }

    fn seen_at_once(&mut self, t: u64) {
        for _ in 0..2 {
            let was = (self.ff_scl[1], self.ff_sda[1]);
            self.ff_scl = [self.scl, self.ff_scl[0]];
            self.ff_sda = [self.sda, self.ff_sda[0]];
            self.look(was);
            self.pins(t);
        }
    }

    pub fn reset(&mut self, t: u64) {
        let old = std::mem::replace(self, Model::new());
        (self.scl, self.sda, self.ff_scl, self.ff_sda) = (old.scl, old.sda, old.ff_scl, old.ff_sda);
        (self.out, self.drives) = (old.out, old.drives);
        self.pins(t);
    }

    fn pins(&mut self, t: u64) {
        let wanted = self.on() && self.bits & 0x20 != 0 && !self.twint;
        let free = self.role == Nobody && !self.busy && self.ff_scl[1] && self.ff_sda[1];
        if wanted && free && self.counter.is_none() && !self.asleep {
            self.count(self.half(), Then::Start);
        }
        let level = |low: bool| match (self.on(), low) {
            (false, _) => AvrDrive::Port,
            (true, true) => AvrDrive::Output(false),
            (true, false) => AvrDrive::Input,
        };
        let drives = [level(self.low_scl), level(self.low_sda)];
        for (n, line) in [AvrLine::Scl, AvrLine::Sda].into_iter().enumerate() {
            if self.drives[n] != drives[n] {
                self.out.push(AvrSignal::Drive { t, line, drive: drives[n] });
            }
        }
        self.drives = drives;
    }
}
