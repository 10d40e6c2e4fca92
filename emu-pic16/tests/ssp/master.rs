//! A model of the I2C master: a list of small operations executed one after another, with a baud rate
//! generator that counts.

use emu_pic16::periph::map::InterruptFlag;

use crate::model::Chip;

#[derive(Clone, Copy, PartialEq, Debug)]
enum Order {
    Sda(bool),
    Scl(bool),
    /// Releases both lines, SDA first.
    Free,
    /// Waits for the line.
    SclIs(bool),
    SdaIs(bool),
    /// Waits for the next end of Q2 or Q4.
    Tick,
    /// Both lines must be high, otherwise it is a collision.
    BothHigh,
    /// SDA must be high, otherwise it is a collision.
    SdaHigh,
    /// SCL is high: a 1 that is sent must be on the line.
    Bit {
        one: bool,
    },
    /// Counts the generator down.
    Count,
    /// Counts while both lines must stay high.
    CountStart,
    /// Counts while SCL must stay high.
    CountStop,
    /// Counts the high time of a bit; ends it when SCL falls.
    CountBit {
        one: bool,
    },
    /// Shifts SDA in.
    Shift,
    /// Clears BF: the byte has been sent.
    Out,
    /// Copies SDA to ACKSTAT.
    Ack,
    /// A byte has been received.
    In,
}

#[derive(Default)]
pub struct Master {
    orders: Vec<Order>,
    /// Remaining counts of the generator, and whether the next tick is that of its loading.
    brg: Option<(u32, bool)>,
    sr: u8,
    conditions: bool,
}

impl Master {
    pub fn busy(&self) -> bool {
        !self.orders.is_empty()
    }

    /// Reports whether a Start or Stop is in progress.
    pub fn makes_condition(&self) -> bool {
        self.busy() && self.conditions
    }

    fn give(&mut self, chip: &mut Chip, orders: Vec<Order>, conditions: bool, t: u64) {
        (self.orders, self.conditions) = (orders, conditions);
        self.go(chip, t);
    }

    fn start() -> Vec<Order> {
        use Order::*;
        vec![BothHigh, CountStart, Sda(false), Count, Scl(false)]
    }

    /// Returns the operations of a bit, from SCL low to SCL low.
    fn bit(level: bool, checked: bool) -> Vec<Order> {
        use Order::*;
        let one = level && checked;
        vec![Sda(level), Count, Scl(true), SclIs(true), Bit { one }, CountBit { one }, Scl(false), SclIs(false)]
    }

    pub fn command(&mut self, chip: &mut Chip, value: u8, t: u64) {
        use Order::*;
        let which = (0..5).find(|bit| value >> bit & 1 == 1);
        chip.con2 = value & !31 | which.map_or(0, |bit| 1 << bit);
        let low = [Scl(false), SclIs(false)];
        let orders = match which {
            Some(0) if chip.pull_scl || chip.pull_sda => [vec![Free, Tick], Master::start()].concat(),
            Some(0) => Master::start(),
            Some(1) => [&low[..], &[Sda(true), Count, Scl(true), SclIs(true)], &Master::start()].concat(),
            Some(2) => {
                vec![Sda(false), SdaIs(false), Count, Scl(true), SclIs(true), CountStop, Sda(true), Count, SdaHigh]
            }
            Some(3) => {
                let mut orders = low.to_vec();
                for _ in 0..8 {
                    orders.extend(Master::bit(true, false));
                    orders.push(Shift);
                }
                orders.push(In);
                orders
            }
            Some(4) => [&low[..], &Master::bit(value & 0x20 != 0, true), &[Sda(true)]].concat(),
            _ => return,
        };
        self.give(chip, orders, matches!(which, Some(0..=2)), t);
    }

    pub fn transmit(&mut self, chip: &mut Chip, t: u64) {
        use Order::*;
        (chip.bf, chip.rw) = (true, true);
        let mut orders = vec![Scl(false), SclIs(false)];
        for bit in (0..8).rev() {
            orders.extend(Master::bit(chip.buf >> bit & 1 == 1, true));
        }
        orders.push(Out);
        orders.extend(Master::bit(true, false));
        orders.push(Ack);
        self.give(chip, orders, false, t);
    }

    fn collision(&mut self, chip: &mut Chip, t: u64) {
        if chip.rw {
            (chip.rw, chip.bf) = (false, false);
        }
        chip.con2 &= !31;
        (chip.pull_scl, chip.pull_sda) = (false, false);
        self.orders.clear();
        self.brg = None;
        chip.flag(InterruptFlag::BCLIF, t);
    }

    /// Executes the end of Q2 or Q4.
    pub fn tick(&mut self, chip: &mut Chip, t: u64) {
        if !t.is_multiple_of(2) || !self.busy() {
            return;
        }
        match &mut self.brg {
            Some((_, late @ true)) => *late = false,
            Some((left, _)) => *left -= 1,
            None => {}
        }
        if self.orders[0] == Order::Tick {
            self.orders.remove(0);
        }
        self.go(chip, t);
    }

    /// Returns true when the generator, which is loaded first, has timed out.
    fn counted(&mut self, chip: &Chip, t: u64) -> bool {
        let brg = self.brg.get_or_insert((u32::from(chip.add & 0x7F) + 1, t % 2 == 1));
        let over = brg.0 == 0;
        if over {
            self.brg = None;
        }
        over
    }

    /// Executes what is possible at once; the response of a line arrives by another call.
    pub fn go(&mut self, chip: &mut Chip, t: u64) {
        while let Some(&order) = self.orders.first() {
            match order {
                Order::Sda(level) => chip.pull_sda = !level,
                Order::Scl(level) => chip.pull_scl = !level,
                Order::Free => (chip.pull_scl, chip.pull_sda) = (false, false),
                Order::SclIs(level) if chip.scl != level => return,
                Order::SdaIs(level) if chip.sda != level => return,
                Order::SclIs(_) | Order::SdaIs(_) => {}
                Order::Tick => return,
                Order::BothHigh if !(chip.scl && chip.sda) => return self.collision(chip, t),
                Order::SdaHigh if !chip.sda => return self.collision(chip, t),
                Order::Bit { one: true } if !chip.sda => return self.collision(chip, t),
                Order::BothHigh | Order::SdaHigh | Order::Bit { .. } => {}
                Order::CountStart if !chip.scl && self.brg.is_some() => return self.collision(chip, t),
                Order::CountStart if !chip.sda => self.brg = None,
                Order::CountStop if !chip.scl => return self.collision(chip, t),
                Order::CountBit { .. } if !chip.scl => self.brg = None,
                Order::CountBit { one: true } if !chip.sda => return self.collision(chip, t),
                Order::Count | Order::CountStart | Order::CountStop | Order::CountBit { .. } => {
                    if !self.counted(chip, t) {
                        return;
                    }
                }
                Order::Shift => self.sr = self.sr << 1 | u8::from(chip.sda),
                Order::Out => chip.bf = false,
                Order::Ack => {
                    chip.con2 = chip.con2 & !0x40 | u8::from(chip.sda) << 6;
                    chip.rw = false;
                }
                Order::In if chip.bf => chip.set_sspov(),
                Order::In => (chip.buf, chip.bf) = (self.sr, true),
            }
            self.orders.remove(0);
            if self.orders.is_empty() {
                chip.con2 &= !31;
                chip.flag(InterruptFlag::SSPIF, t);
            }
        }
    }
}
