//! A model of the timers and CCP modules as flip-flops that every clock of the oscillator clocks. It is
//! written for clarity, from the block diagrams of DS30292 (figures 6-2, 7-1, 8-1 to 8-3).

use emu_pic16::periph::map::{InterruptFlag, Pic16Line, Sfr};
use emu_pic16::periph::{Pic16Drive, Pic16Signal};

#[derive(Clone, Default)]
pub struct Module {
    pub con: u8,
    pub low: u8,
    pub high: u8,
    two: u8,
    output: bool,
    pin: bool,
    prescaler: u32,
    pub drive: Pic16Drive,
}

#[derive(Clone)]
pub struct Model {
    t: u64,
    asleep: bool,
    pub tmr1: u16,
    pub t1con: u8,
    prescaler1: u32,
    t1cki: bool,
    /// True if counting has started and no falling edge has come.
    wait_fall: bool,
    /// True if an edge has left the prescaler and the synchronizer has not sampled it.
    caught: bool,
    /// True if the synchronizer has sampled an edge, which counts at the end of the cycle.
    pass: bool,
    osc: u64,
    hz: u64,
    swings: u64,
    toggles: u64,
    pub tmr2: u8,
    pub t2con: u8,
    pub pr2: u8,
    /// Clocks within a count of timer 2.
    prescaler2: u32,
    post: u8,
    pub listener: bool,
    pub modules: Vec<Module>,
    pub said: Vec<Pic16Signal>,
}

const FLAGS: [InterruptFlag; 2] = [InterruptFlag::CCP1IF, InterruptFlag::CCP2IF];
const LINES: [Pic16Line; 2] = [Pic16Line::Ccp1, Pic16Line::Ccp2];

impl Model {
    pub fn new(ccps: u8, crystal: Option<(u64, u64)>) -> Model {
        let (osc, hz) = crystal.unwrap_or((1, 0));
        Model {
            t: 0,
            asleep: false,
            tmr1: 0,
            t1con: 0,
            prescaler1: 0,
            t1cki: false,
            wait_fall: false,
            caught: false,
            pass: false,
            osc,
            hz,
            swings: 0,
            toggles: 0,
            tmr2: 0,
            t2con: 0,
            pr2: 0xFF,
            prescaler2: 0,
            post: 0,
            listener: false,
            modules: vec![Module::default(); usize::from(ccps)],
            said: Vec::new(),
        }
    }

    fn flag(&mut self, flag: InterruptFlag) {
        self.said.push(Pic16Signal::Flag { t: self.t, flag });
    }

    fn mode(&self, i: usize) -> u8 {
        self.modules[i].con & 15
    }

    fn external(&self) -> bool {
        self.t1con & 2 != 0
    }

    fn crystal_is_clock(&self) -> bool {
        self.t1con & 0b1010 == 0b1010
    }

    fn synchronous(&self) -> bool {
        self.t1con & 0b110 == 0b010
    }

    fn crystal_high(&self) -> bool {
        self.toggles & 1 == 0
    }

    /// Sets timer 1 to a new value for any reason; modules that compare with it check it.
    fn new_tmr1(&mut self, value: u16, ccpr: &[Option<u16>]) {
        let old = self.tmr1;
        self.tmr1 = value;
        for (i, before) in ccpr.iter().enumerate() {
            let was = *before == Some(old);
            self.look(i, was);
        }
    }

    /// Checks whether a module is equal now and was not before.
    fn look(&mut self, i: usize, was: bool) {
        let now = self.compares()[i] == Some(self.tmr1);
        if now && !was {
            self.flag(FLAGS[i]);
            match self.mode(i) {
                8 => self.modules[i].output = true,
                9 => self.modules[i].output = false,
                11 if i + 1 == self.modules.len() => self.said.push(Pic16Signal::Convert { t: self.t }),
                _ => {}
            }
        }
    }

    fn compares(&self) -> Vec<Option<u16>> {
        let one = |m: &Module| matches!(m.con & 15, 8..=11).then(|| u16::from(m.high) * 256 + u16::from(m.low));
        self.modules.iter().map(one).collect()
    }

    fn count1(&mut self) {
        let special = (0..self.modules.len()).any(|i| self.mode(i) == 11 && self.compares()[i] == Some(self.tmr1));
        let next = if special { 0 } else { self.tmr1.wrapping_add(1) };
        if self.tmr1 == 0xFFFF && !special {
            self.flag(InterruptFlag::TMR1IF);
        }
        let compares = self.compares();
        self.new_tmr1(next, &compares);
    }

    /// Handles a rising edge at the input of timer 1; returns true if the counter counts at once.
    fn edge1(&mut self) -> bool {
        self.prescaler1 += 1;
        let out = self.prescaler1.is_multiple_of(1 << (self.t1con >> 4 & 3));
        let waits = self.external() && self.wait_fall;
        if !out || waits || self.t1con & 1 == 0 {
            return false;
        }
        if !self.synchronous() {
            return true;
        }
        if !self.asleep {
            self.caught = true;
        }
        false
    }

    /// Executes clock `t`, with the write of an instruction that ends at it.
    pub fn tick(&mut self, t: u64, write: Option<(Sfr, u8)>) {
        self.t = t;
        let writes1 = matches!(write, Some((Sfr::TMR1L | Sfr::TMR1H, _)));
        let writes2 = matches!(write, Some((Sfr::TMR2, _)));
        if t % 4 == 2 && !self.asleep {
            self.pass |= std::mem::take(&mut self.caught);
        }
        // Clocks timer 1.
        let mut counts = false;
        if t.is_multiple_of(4) && !self.asleep {
            counts |= std::mem::take(&mut self.pass);
            if !self.external() {
                counts |= self.edge1();
            }
        }
        if self.t1con & 8 != 0 {
            // A half period has passed whenever twice the time contains another whole number of periods.
            while self.hz > 0 && 2 * (t - self.swings) * self.hz >= (self.toggles + 1) * self.osc {
                self.toggles += 1;
                if !self.crystal_high() {
                    if self.crystal_is_clock() {
                        self.wait_fall = false;
                    }
                } else if self.crystal_is_clock() {
                    counts |= self.edge1();
                }
            }
        }
        if counts && !writes1 {
            self.count1();
        }
        // Clocks timer 2.
        if self.t2con & 4 != 0 && !self.asleep {
            let scale = [1, 4, 16, 16][usize::from(self.t2con & 3)];
            if !writes2 {
                self.prescaler2 += 1;
                if self.prescaler2 == 4 * scale {
                    self.prescaler2 = 0;
                    self.count2();
                }
                self.pulses();
            }
        }
        if let Some((reg, value)) = write {
            self.write(reg, value);
        }
        self.show();
    }

    fn count2(&mut self) {
        if self.tmr2 != self.pr2 {
            self.tmr2 = self.tmr2.wrapping_add(1);
            return;
        }
        self.tmr2 = 0;
        if self.listener {
            self.said.push(Pic16Signal::Timer2 { t: self.t });
        }
        self.post += 1;
        if self.post == (self.t2con >> 3 & 15) + 1 {
            self.post = 0;
            self.flag(InterruptFlag::TMR2IF);
        }
        for m in &mut self.modules {
            if m.con & 12 == 12 {
                m.high = m.low;
                m.two = m.con >> 4 & 3;
                m.output = true;
            }
        }
    }

    /// Compares the pulse width; a match overrides the start of a period.
    fn pulses(&mut self) {
        let scale = [1, 4, 16, 16][usize::from(self.t2con & 3)];
        let base = u32::from(self.tmr2) * 4 + self.prescaler2 / scale;
        for m in &mut self.modules {
            if m.con & 12 == 12 && base == u32::from(m.high) * 4 + u32::from(m.two) {
                m.output = false;
            }
        }
    }

    fn show(&mut self) {
        for (m, line) in self.modules.iter_mut().zip(LINES) {
            let drive = match (m.con & 15, m.output) {
                (8 | 9 | 12..=15, false) => Pic16Drive::Low,
                (8 | 9 | 12..=15, true) => Pic16Drive::High,
                _ => Pic16Drive::Port,
            };
            if drive != m.drive {
                m.drive = drive;
                self.said.push(Pic16Signal::Drive { t: self.t, line, drive });
            }
        }
    }

    fn write(&mut self, reg: Sfr, value: u8) {
        let word = [(self.tmr1 >> 8) as u8, self.tmr1 as u8];
        let compares = self.compares();
        match reg {
            Sfr::TMR1L => {
                self.prescaler1 = 0;
                self.new_tmr1(u16::from_be_bytes([word[0], value]), &compares);
            }
            Sfr::TMR1H => {
                self.prescaler1 = 0;
                self.new_tmr1(u16::from_be_bytes([value, word[1]]), &compares);
            }
            Sfr::T1CON => self.write_t1con(value & 0x3F),
            Sfr::TMR2 => {
                self.tmr2 = value;
                (self.prescaler2, self.post) = (0, 0);
                self.pulses();
            }
            Sfr::T2CON => {
                self.t2con = value & 0x7F;
                (self.prescaler2, self.post) = (0, 0);
                self.pulses();
            }
            Sfr::PR2 => self.pr2 = value,
            Sfr::CCPR1L | Sfr::CCPR1H | Sfr::CCP1CON if !self.modules.is_empty() => self.write_module(0, reg, value),
            Sfr::CCPR2L | Sfr::CCPR2H | Sfr::CCP2CON if self.modules.len() > 1 => self.write_module(1, reg, value),
            _ => {}
        }
    }

    fn write_t1con(&mut self, value: u8) {
        let changed = self.t1con ^ value;
        self.t1con = value;
        if changed & 8 != 0 {
            (self.swings, self.toggles) = (self.t, 0);
        }
        if changed & 0b1111 != 0 {
            (self.caught, self.pass) = (false, false);
        }
        if changed & 0b1011 != 0 {
            let high = if self.t1con & 8 != 0 { self.crystal_high() } else { self.t1cki };
            // An input that is high will fall before it rises.
            self.wait_fall = !high;
        }
    }

    fn write_module(&mut self, i: usize, reg: Sfr, value: u8) {
        let was = self.compares()[i] == Some(self.tmr1);
        match reg {
            Sfr::CCPR1L | Sfr::CCPR2L => self.modules[i].low = value,
            Sfr::CCPR1H | Sfr::CCPR2H => {
                if self.mode(i) < 12 {
                    self.modules[i].high = value;
                }
            }
            _ => {
                let old = self.mode(i);
                let nets = self.nets(i);
                self.modules[i].con = value & 0x3F;
                let new = self.mode(i);
                if !(4..8).contains(&new) {
                    self.modules[i].prescaler = 0;
                } else if (4..8).contains(&old) {
                    self.nets_changed(i, nets);
                }
                let pwm = old >= 12 && new >= 12;
                if old != new && !pwm {
                    self.modules[i].output = new == 9;
                }
            }
        }
        self.look(i, was);
    }

    /// Returns the input of the prescaler in capture mode, and of the latch enable.
    fn nets(&self, i: usize) -> (bool, bool) {
        let m = &self.modules[i];
        let input = if m.con & 15 == 4 { !m.pin } else { m.pin };
        let enable = match m.con & 15 {
            6 => m.prescaler % 4 < 2,
            7 => m.prescaler % 16 < 8,
            _ => input,
        };
        (input, enable)
    }

    fn nets_changed(&mut self, i: usize, old: (bool, bool)) {
        if !old.0 && self.nets(i).0 {
            self.modules[i].prescaler += 1;
        }
        if !old.1 && self.nets(i).1 {
            let m = &mut self.modules[i];
            (m.low, m.high) = (self.tmr1 as u8, (self.tmr1 >> 8) as u8);
            self.flag(FLAGS[i]);
        }
    }

    pub fn line(&mut self, line: Pic16Line, high: bool) {
        match line {
            Pic16Line::T1cki => {
                let rises = high && !self.t1cki;
                let falls = !high && self.t1cki;
                self.t1cki = high;
                if self.t1con & 0b1010 == 0b0010 {
                    if falls {
                        self.wait_fall = false;
                    }
                    if rises && self.edge1() {
                        self.count1();
                    }
                }
            }
            Pic16Line::Ccp1 | Pic16Line::Ccp2 => {
                let i = usize::from(line == Pic16Line::Ccp2);
                if i < self.modules.len() {
                    let nets = self.nets(i);
                    self.modules[i].pin = high;
                    if (4..8).contains(&self.mode(i)) {
                        self.nets_changed(i, nets);
                    }
                }
            }
            _ => {}
        }
        self.show();
    }

    pub fn sleep(&mut self) {
        self.asleep = true;
        (self.caught, self.pass) = (false, false);
    }

    pub fn wake(&mut self) {
        self.asleep = false;
    }

    pub fn reset(&mut self, power_on: bool) {
        self.asleep = false;
        (self.tmr2, self.t2con, self.pr2, self.prescaler2, self.post) = (0, 0, 0xFF, 0, 0);
        if power_on {
            (self.tmr1, self.t1con, self.prescaler1) = (0, 0, 0);
            (self.caught, self.pass) = (false, false);
        }
        for m in &mut self.modules {
            let kept = if power_on { (0, 0) } else { (m.low, m.high) };
            *m = Module { low: kept.0, high: kept.1, pin: m.pin, drive: m.drive, ..Module::default() };
        }
        self.show();
    }

    pub fn read(&self, reg: Sfr) -> u8 {
        let module = |i: usize| self.modules.get(i).cloned().unwrap_or_default();
        match reg {
            Sfr::TMR1L => self.tmr1 as u8,
            Sfr::TMR1H => (self.tmr1 >> 8) as u8,
            Sfr::T1CON => self.t1con,
            Sfr::TMR2 => self.tmr2,
            Sfr::T2CON => self.t2con,
            Sfr::PR2 => self.pr2,
            Sfr::CCPR1L => module(0).low,
            Sfr::CCPR1H => module(0).high,
            Sfr::CCP1CON => module(0).con,
            Sfr::CCPR2L => module(1).low,
            Sfr::CCPR2H => module(1).high,
            Sfr::CCP2CON => module(1).con,
            _ => 0,
        }
    }
}
