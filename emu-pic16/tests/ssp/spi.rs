//! A model of the SPI that steps clock by clock. The master follows figure 9-3: the position of a clock in
//! its bit determines the pins.

use emu_pic16::periph::Pic16Drive;
use emu_pic16::periph::map::{InterruptFlag, Pic16Line};

use crate::model::Chip;
use crate::rig::TestBench;

#[derive(Default)]
pub struct Spi {
    /// Bits in SSPSR, the first to be sent at the front.
    sr: Vec<bool>,
    /// Master: clocks since the write.
    age: Option<u64>,
    /// Master on timer 2: half bits started.
    halves: Option<u64>,
    /// True while the clock is at its active level.
    active: bool,
    sdo: bool,
    /// Slave: number of bits received.
    bits: u32,
    /// Slave: true after an edge of this byte.
    begun: bool,
    /// Set when all bits are received; true once the end of a Q2 has detected it.
    complete: Option<bool>,
    byte: u8,
}

impl Spi {
    pub fn busy(&self) -> bool {
        self.age.is_some() || self.halves.is_some() || self.begun || self.complete.is_some()
    }

    pub fn active(&self) -> bool {
        self.active
    }

    pub fn sdo(&self) -> bool {
        self.sdo
    }

    fn first(&self) -> bool {
        self.sr.first().copied().unwrap_or(false)
    }

    fn shift_in(&mut self, bit: bool) {
        self.sr.resize(8, false);
        self.sr.remove(0);
        self.sr.push(bit);
    }

    pub fn load(&mut self, chip: &Chip) {
        self.sr = bits_of(chip);
        match chip.con & 15 {
            0..=2 => self.age = Some(0),
            3 => self.halves = Some(0),
            _ => self.show(chip),
        }
    }

    fn show(&mut self, chip: &Chip) {
        if chip.cke() {
            self.sdo = self.first();
        }
    }

    fn finish_shift(&mut self) {
        self.byte = self.sr.iter().fold(0, |byte, &bit| byte << 1 | u8::from(bit));
        self.complete = Some(false);
    }

    /// Starts half bit `n` of 16; number 16 is the end.
    fn at_half(&mut self, chip: &Chip, n: u64) {
        let middle = n % 2 == 1;
        if middle && !chip.smp() || !middle && n > 0 && chip.smp() {
            self.shift_in(chip.sda);
        }
        if n == 16 {
            self.active = false;
            self.finish_shift();
            return;
        }
        if !middle {
            self.sdo = self.first();
        }
        self.active = if chip.cke() { middle } else { !middle };
    }

    pub fn half_bit(&mut self, chip: &mut Chip, _: u64) {
        if let Some(n) = self.halves {
            self.at_half(chip, n);
            self.halves = (n < 16).then_some(n + 1);
        }
    }

    pub fn tick(&mut self, chip: &mut Chip, t: u64) {
        match self.complete {
            Some(true) if t.is_multiple_of(4) => self.deliver(chip, t),
            _ => {}
        }
        if let Some(age) = self.age {
            let age = age + 1;
            self.age = Some(age);
            let half = [2, 8, 32][usize::from(chip.con & 3)];
            if age >= 2 && (age - 2).is_multiple_of(half) {
                let n = (age - 2) / half;
                self.at_half(chip, n);
                if n == 16 {
                    self.age = None;
                }
            }
        }
        self.see(t);
    }

    /// Detects complete bytes at the end of Q2.
    fn see(&mut self, t: u64) {
        if self.complete.is_some() && t % 4 == 2 {
            self.complete = Some(true);
        }
    }

    /// Moves SSPSR to SSPBUF, if it is complete.
    pub fn deliver(&mut self, chip: &mut Chip, t: u64) {
        if self.complete.take().is_none() {
            return;
        }
        if chip.con & 15 >= 4 && chip.bf {
            chip.set_sspov();
        } else {
            chip.buf = self.byte;
            chip.bf = true;
        }
        chip.flag(InterruptFlag::SSPIF, t);
    }

    /// Handles a change of the slave's clock.
    pub fn edge(&mut self, chip: &mut Chip, t: u64, asleep: bool) {
        if chip.con & 15 == 4 && chip.ss {
            return;
        }
        self.begun = true;
        let to_active = chip.scl != chip.ckp();
        // Figures 9-5 and 9-6: in one half of the figure SCK leads the data by half a bit, in the other half
        // it does not.
        match (to_active, chip.cke()) {
            (true, false) | (false, true) => self.sdo = self.first(),
            (true, true) | (false, false) => self.shift_in(chip.sda),
        }
        if !to_active {
            self.bits += 1;
        }
        if self.bits == 8 {
            self.bits = 0;
            self.begun = false;
            self.finish_shift();
            self.see(t);
            if asleep {
                self.deliver(chip, t);
            }
        }
    }

    pub fn select(&mut self, chip: &Chip) {
        if self.begun {
            self.sr = bits_of(chip);
        }
        (self.bits, self.begun) = (0, false);
        if !chip.ss {
            self.show(chip);
        }
    }
}

/// Returns the bits of SSPBUF, the first to be sent at the front.
fn bits_of(chip: &Chip) -> Vec<bool> {
    (0..8).rev().map(|bit| chip.buf >> bit & 1 == 1).collect()
}

/// Connects SCK and SDO of the first rig to the second one, and SDO back.
pub fn wire(rigs: &mut [TestBench; 2], t: u64) {
    let high = |drive| drive == Pic16Drive::High;
    let [master, slave] = rigs;
    slave.line(Pic16Line::Sck, high(master.drives[0]), t);
    slave.line(Pic16Line::Sdi, high(master.drives[2]), t);
    master.line(Pic16Line::Sdi, high(slave.drives[2]), t);
}
