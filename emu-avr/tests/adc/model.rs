//! A model of the converter that steps cycle by cycle: a 7-bit counter, the converter's clock as one of its
//! bits, and a conversion as the number of clock edges since its start.

use emu_avr::periph::adc::{AdcRegister, AvrAdcKind};

pub struct Model {
    pub kind: AvrAdcKind,
    pub pins: [u32; 9],
    pub aref: u32,
    pub avcc: u32,
    pub enabled: bool,
    pub auto: bool,
    pub flag: bool,
    pub enable_irq: bool,
    pub adps: u8,
    pub admux: u8,
    pub adcsrb: u8,
    pub didr0: u8,
    pub result: u16,
    pub blocked: bool,
    pub clock_on: bool,
    pub flags: [bool; 8],
    counter: u8,
    /// Cycles until the prescaler is reset for a trigger.
    reset_in: u8,
    converting: bool,
    first: bool,
    /// True for a first conversion; then the edges since its start (None while it waits), and the latched
    /// settings.
    this_first: bool,
    edges: Option<u32>,
    locked: u8,
    sampled: u16,
    /// True if ADIF was set at the current edge.
    flag_now: bool,
}

impl Model {
    pub fn new(kind: AvrAdcKind) -> Model {
        Model {
            kind,
            pins: [0, 0, 0, 0, 0, 0, 0, 0, 314],
            aref: 5000,
            avcc: 5000,
            enabled: false,
            auto: false,
            flag: false,
            enable_irq: false,
            adps: 0,
            admux: 0,
            adcsrb: 0,
            didr0: 0,
            result: 0,
            blocked: false,
            clock_on: true,
            flags: [false; 8],
            counter: 0,
            reset_in: 0,
            converting: false,
            first: false,
            this_first: false,
            edges: None,
            locked: 0,
            sampled: 0,
            flag_now: false,
        }
    }

    fn clock(&self) -> bool {
        let bit = [0, 0, 1, 2, 3, 4, 5, 6][usize::from(self.adps)];
        self.reset_in == 0 && self.counter >> bit & 1 == 1
    }

    /// Executes one cycle of the core's clock.
    pub fn tick(&mut self) {
        self.flag_now = false;
        if !self.clock_on || !self.enabled {
            return;
        }
        let before = self.clock();
        self.counter = (self.counter + 1) % 128;
        if self.reset_in > 0 {
            self.reset_in -= 1;
            if self.reset_in == 0 {
                self.counter = 0;
            }
        }
        self.edge(before);
    }

    /// Handles an edge of the converter's clock, if its level is no longer `before`.
    fn edge(&mut self, before: bool) {
        let now = self.clock();
        if now == before || !self.converting {
            return;
        }
        match &mut self.edges {
            None => {
                if now {
                    self.edges = Some(0);
                    self.locked = self.admux;
                    self.this_first = self.first;
                    self.first = false;
                }
            }
            Some(edges) => {
                *edges += 1;
                let edges = *edges;
                // 1.5 and 13 clocks, or 13.5 and 25 for the first conversion, two edges each.
                let (sample, end) = if self.this_first { (27, 50) } else { (3, 26) };
                if edges == sample {
                    self.sampled = self.measure();
                }
                if edges == end {
                    self.end();
                }
            }
        }
    }

    fn end(&mut self) {
        if !self.blocked {
            self.result = self.sampled;
        }
        self.flag = true;
        self.flag_now = true;
        let runs_on = self.auto && (!self.kind.triggers || self.adcsrb & 7 == 0);
        self.converting = runs_on;
        self.edges = None;
        if runs_on {
            self.edges = Some(0);
            self.locked = self.admux;
            self.this_first = false;
        }
    }

    fn measure(&self) -> u16 {
        let reference = match self.locked >> 6 {
            1 => self.avcc,
            3 => self.kind.reference_mv,
            _ => self.aref,
        };
        let input = match self.locked & self.kind.mux {
            mux @ 0..=7 => self.pins[usize::from(mux)],
            8 if self.kind.temperature.is_some() => self.pins[8],
            mux if mux == self.kind.bandgap => self.kind.bandgap_mv,
            _ => 0,
        };
        let volts = f64::from(input);
        if volts == 0.0 { 0 } else { (volts * 1024.0 / f64::from(reference)).floor().min(1023.0) as u16 }
    }

    fn begin(&mut self) {
        if self.enabled && !self.converting {
            self.converting = true;
            self.edges = None;
        }
    }

    pub fn halt(&mut self) {
        self.begin();
    }

    fn by_trigger(&mut self) {
        if self.enabled && self.auto && !self.converting {
            self.begin();
            self.reset_in = 3;
        }
    }

    fn chosen(&self) -> u8 {
        if self.kind.triggers { self.adcsrb & 7 } else { 0 }
    }

    pub fn listens(&self) -> Option<u8> {
        (self.enabled && self.auto && self.chosen() != 0).then(|| self.chosen())
    }

    pub fn set_flag(&mut self, source: u8, set: bool) {
        let rises = set && !self.flags[usize::from(source)];
        self.flags[usize::from(source)] = set;
        if rises && source != 0 && source == self.chosen() {
            self.by_trigger();
        }
    }

    fn signal(&self) -> bool {
        if self.chosen() == 0 { self.flag } else { self.flags[usize::from(self.chosen())] }
    }

    pub fn write(&mut self, reg: AdcRegister, value: u8, mask: u8) {
        let mix = |old: u8, bits: u8| (old & !(mask & bits)) | (value & mask & bits);
        match reg {
            AdcRegister::ADMUX => self.admux = mix(self.admux, 0xE0 | self.kind.mux),
            AdcRegister::ADCSRB => {
                let before = self.signal();
                self.adcsrb = mix(self.adcsrb, if self.kind.triggers { 0x47 } else { 0x40 });
                if self.chosen() != 0 && !before && self.signal() {
                    self.by_trigger();
                }
            }
            AdcRegister::DIDR0 => self.didr0 = mix(self.didr0, self.kind.didr0),
            AdcRegister::ADCSRA => self.write_adcsra(mix(self.adcsra(), 0xEF), value & mask),
            AdcRegister::ADCL | AdcRegister::ADCH => {}
        }
    }

    fn write_adcsra(&mut self, new: u8, ones: u8) {
        let was_on = self.enabled;
        self.enabled = new & 0x80 != 0;
        self.auto = new & 0x20 != 0;
        self.enable_irq = new & 0x08 != 0;
        let before = self.clock();
        self.adps = new & 7;
        if !self.enabled {
            (self.converting, self.edges, self.reset_in) = (false, None, 0);
        } else if !was_on {
            (self.counter, self.first, self.reset_in) = (0, true, 0);
        } else {
            self.edge(before);
        }
        if ones & 0x10 != 0 && !self.flag_now {
            self.flag = false;
        }
        if ones & 0x40 != 0 {
            self.begin();
        }
    }

    pub fn adcsra(&self) -> u8 {
        let bits = [self.enabled, self.converting, self.auto, self.flag, self.enable_irq];
        bits.iter().fold(0, |value, &bit| value << 1 | u8::from(bit)) << 3 | self.adps
    }

    pub fn get(&self, reg: AdcRegister) -> u8 {
        let shown = if self.admux & 0x20 != 0 { self.result * 64 } else { self.result };
        match reg {
            AdcRegister::ADMUX => self.admux,
            AdcRegister::ADCSRA => self.adcsra(),
            AdcRegister::ADCSRB => self.adcsrb,
            AdcRegister::ADCL => (shown % 256) as u8,
            AdcRegister::ADCH => (shown / 256) as u8,
            AdcRegister::DIDR0 => self.didr0,
        }
    }

    pub fn read(&mut self, reg: AdcRegister) -> u8 {
        let value = self.get(reg);
        match reg {
            AdcRegister::ADCL => self.blocked = true,
            AdcRegister::ADCH => self.blocked = false,
            _ => {}
        }
        value
    }

    pub fn reset(&mut self) {
        let (pins, aref, avcc, flags) = (self.pins, self.aref, self.avcc, self.flags);
        *self = Model { pins, aref, avcc, flags, ..Model::new(self.kind) };
    }
}
