//! Registers of the model: what a write does, and when it takes effect.

use emu_avr::periph::timers::TimerRegister;

use crate::model::{Kind, Model};

impl Model {
    pub fn land(&mut self, i: usize) {
        self.wait[i] = 0;
        let buffered = !matches!(self.mode().0, Kind::Up | Kind::Ctc);
        match i {
            0 => {
                (self.tcnt, self.blocked) = (self.tcnt_next, true);
                self.down &= self.tcnt != 0;
            }
            1 | 2 => self.load(i - 1, buffered),
            3 => self.acting[0] = self.tccra,
            _ => self.acting[1] = self.tccrb,
        }
        if i >= 3 {
            let kind = self.mode().0;
            if matches!(kind, Kind::Up | Kind::Ctc) {
                self.units.iter_mut().for_each(|unit| unit.compare = unit.buffer);
            }
            self.down &= matches!(kind, Kind::PhaseCorrect | Kind::PhaseFrequencyCorrect);
        }
        if i == 4 {
            self.force();
        }
    }

    fn load(&mut self, unit: usize, buffered: bool) {
        let unit = &mut self.units[unit];
        unit.buffer = unit.temporary;
        if !buffered {
            unit.compare = unit.buffer;
        }
    }

    fn force(&mut self) {
        let strobe = std::mem::take(&mut self.strobe);
        if matches!(self.mode().0, Kind::Up | Kind::Ctc) {
            for unit in 0..usize::from(self.shape.channels) {
                let com = self.com(unit);
                let pin = &mut self.units[unit].pin;
                if strobe >> (7 - unit) & 1 == 1 {
                    *pin = [*pin, !*pin, false, true][usize::from(com)];
                }
            }
        }
    }

    fn arrive(&mut self, i: usize) {
        if self.is_async() { self.wait[i] = 2 } else { self.land(i) }
    }

    fn ocr(&mut self, unit: usize, word: u16) {
        if unit < usize::from(self.shape.channels) {
            self.units[unit].temporary = word;
            if unit < 2 {
                self.arrive(unit + 1);
            } else {
                let buffered = !matches!(self.mode().0, Kind::Up | Kind::Ctc);
                self.load(unit, buffered);
            }
        }
    }

    pub fn write(&mut self, reg: TimerRegister, value: u8, mask: u8) {
        // Other bits do not change; the random writes touch single bits only of control registers.
        let mix = |old: u8| old & !mask | value & mask;
        let wide = self.shape.wide;
        let word = if wide { u16::from(self.temp) << 8 } else { 0 } | u16::from(value);
        let coms = [0u8, 0xC3, 0xF3, 0xFF][usize::from(self.shape.channels)];
        match reg {
            TimerRegister::TCCRA => {
                self.tccra = mix(self.tccra) & coms;
                self.arrive(3);
            }
            TimerRegister::TCCRB => {
                let bits = match (self.shape.channels, wide) {
                    (0, _) => 7,
                    (_, false) => 0x0F,
                    (_, true) => 0xDF,
                };
                self.tccrb = mix(self.tccrb) & bits;
                if !wide {
                    self.strobe |= value & mask & 0xC0;
                }
                self.arrive(4);
            }
            TimerRegister::TCCRC if wide => {
                self.strobe = value & mask;
                self.force();
            }
            TimerRegister::TCNTL => {
                self.tcnt_next = word;
                self.arrive(0);
            }
            TimerRegister::OCRAL => self.ocr(0, word),
            TimerRegister::OCRBL => self.ocr(1, word),
            TimerRegister::OCRCL => self.ocr(2, word),
            TimerRegister::ICRL if self.top_is_icr() || self.shape.capture && !self.shape.icr_only_as_top => {
                self.icr = word
            }
            TimerRegister::TCNTH | TimerRegister::ICRH if wide => self.temp = value,
            TimerRegister::OCRAH | TimerRegister::OCRBH | TimerRegister::OCRCH if wide => {
                self.temp = value & self.high_byte_of_ocr()
            }
            TimerRegister::TIMSK => {
                let channels = (2u8 << self.shape.channels) - 2;
                let all = 1 | channels | if self.shape.capture { 0x20 } else { 0 };
                self.timsk = mix(self.timsk) & all;
            }
            TimerRegister::ASSR if self.shape.asynchronous => {
                let new = mix(self.assr) & 0x60;
                let switched = (new ^ self.assr) & 0x20 != 0;
                self.assr = new;
                if switched {
                    (0..5).filter(|&i| self.wait[i] > 0).collect::<Vec<_>>().into_iter().for_each(|i| self.land(i));
                    self.toscs.count = 0;
                    self.stale = None;
                }
            }
            _ => {}
        }
    }
}
