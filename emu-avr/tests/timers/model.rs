//! A timer stepped cycle by cycle, written from the text and figures of sections 15 to 18.

use emu_avr::periph::timers::{ClockTap, TimerRegister, TimerShape};

use crate::cells::{Crystal, Divider, Sampler};

/// Slope of a mode, from a row of tables 15-8 and 16-4.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    Up,
    Ctc,
    Fast,
    PhaseCorrect,
    PhaseFrequencyCorrect,
}

#[derive(Debug, Clone, Copy, Default)]
pub struct Unit {
    pub temporary: u16,
    pub buffer: u16,
    pub compare: u16,
    pub pin: bool,
}

#[derive(Debug, Clone)]
pub struct Model {
    pub shape: TimerShape,
    pub tccra: u8,
    pub tccrb: u8,
    pub acting: [u8; 2],
    pub timsk: u8,
    pub tifr: u8,
    pub assr: u8,
    pub temp: u8,
    pub icr: u16,
    pub units: [Unit; 3],
    pub tcnt: u16,
    pub down: bool,
    pub blocked: bool,
    pub divider: Divider,
    pub toscs: Divider,
    pub t: Sampler,
    pub icp: Sampler,
    pub crystal: Crystal,
    pub asleep: bool,
    /// Edges of TOSC1 until each temporary register is latched: TCNT, OCRA, OCRB, TCCRA, TCCRB.
    pub wait: [u8; 5],
    pub tcnt_next: u16,
    pub strobe: u8,
    late: Vec<(u8, u64)>,
    pub stale: Option<u16>,
    /// Flags that changed from 0 to 1 at the last edge.
    pub rose: u8,
}

impl Model {
    pub fn new(shape: TimerShape, rate: u64) -> Model {
        Model {
            shape,
            tccra: 0,
            tccrb: 0,
            acting: [0; 2],
            timsk: 0,
            tifr: 0,
            assr: 0,
            temp: 0,
            icr: 0,
            units: [Unit::default(); 3],
            tcnt: 0,
            down: false,
            blocked: false,
            divider: Divider::default(),
            toscs: Divider::default(),
            t: Sampler::default(),
            icp: Sampler::default(),
            crystal: Crystal::new(rate),
            asleep: false,
            wait: [0; 5],
            tcnt_next: 0,
            strobe: 0,
            late: Vec::new(),
            stale: None,
            rose: 0,
        }
    }

    pub fn reset(&mut self) {
        let old = self.clone();
        *self = Model::new(self.shape, 1);
        (self.t, self.icp, self.crystal, self.divider) = (old.t, old.icp, old.crystal, old.divider);
        self.crystal.stopped = false;
    }

    pub fn is_async(&self) -> bool {
        self.assr & 0x20 != 0
    }

    pub fn mode(&self) -> (Kind, Option<u16>) {
        use Kind::{Ctc, Fast, PhaseCorrect, PhaseFrequencyCorrect, Up};
        let icr = Some(self.icr);
        let ocra = Some(self.units[0].compare);
        let [a, b] = self.acting;
        if self.shape.channels == 0 {
            return (Up, None);
        }
        if self.shape.wide {
            match (b >> 3 & 3) << 2 | a & 3 {
                1 => (PhaseCorrect, Some(0xFF)),
                2 => (PhaseCorrect, Some(0x1FF)),
                3 => (PhaseCorrect, Some(0x3FF)),
                4 => (Ctc, ocra),
                5 => (Fast, Some(0xFF)),
                6 => (Fast, Some(0x1FF)),
                7 => (Fast, Some(0x3FF)),
                8 => (PhaseFrequencyCorrect, icr),
                9 => (PhaseFrequencyCorrect, ocra),
                10 => (PhaseCorrect, icr),
                11 => (PhaseCorrect, ocra),
                12 => (Ctc, icr),
                14 => (Fast, icr),
                15 => (Fast, ocra),
                _ => (Up, None),
            }
        } else {
            match (b >> 3 & 1) << 2 | a & 3 {
                1 => (PhaseCorrect, Some(0xFF)),
                2 => (Ctc, ocra),
                3 => (Fast, Some(0xFF)),
                5 => (PhaseCorrect, ocra),
                7 => (Fast, ocra),
                _ => (Up, None),
            }
        }
    }

    fn wgm(&self) -> u8 {
        let [a, b] = self.acting;
        a & 3 | if self.shape.wide { b >> 1 & 12 } else { b >> 1 & 4 }
    }

    /// Returns the writable bits of OCRH: modes of 8, 9 and 10 bits have only these bits (16.9.3, 16.9.4).
    pub fn high_byte_of_ocr(&self) -> u8 {
        match self.wgm() {
            1 | 5 => 0x00,
            2 | 6 => 0x01,
            3 | 7 => 0x03,
            _ => 0xFF,
        }
    }

    pub fn top_is_icr(&self) -> bool {
        self.shape.wide && [8, 10, 12, 14].contains(&self.wgm())
    }

    fn top_is_ocra(&self) -> bool {
        self.shape.channels > 0
            && if self.shape.wide { [4, 9, 11, 15].contains(&self.wgm()) } else { [2, 5, 7].contains(&self.wgm()) }
    }

    /// Returns the effective COM bits of a channel: 0 if the port controls the pin.
    pub fn com(&self, unit: usize) -> u8 {
        if unit >= usize::from(self.shape.channels) {
            return 0;
        }
        let com = self.acting[0] >> (6 - 2 * unit) & 3;
        let pwm = !matches!(self.mode().0, Kind::Up | Kind::Ctc);
        let toggles = if self.shape.wide { [9, 11, 14, 15].as_slice() } else { &[5, 7] };
        let allowed = unit == 0 && toggles.contains(&self.wgm());
        if pwm && com == 1 && !allowed { 0 } else { com }
    }

    /// Returns the level that drives the pin of a channel, if it does.
    pub fn drive(&self, unit: usize) -> Option<bool> {
        (self.com(unit) != 0).then_some(self.units[unit].pin)
    }

    fn flag(&mut self, bit: u8, t: u64) {
        if self.is_async() {
            if !self.late.iter().any(|(b, _)| *b == bit) {
                self.late.push((bit, t + 3));
            }
        } else {
            self.raise(bit);
        }
    }

    fn raise(&mut self, bit: u8) {
        if self.tifr & bit == 0 {
            self.rose |= bit;
        }
        self.tifr |= bit;
    }

    /// Executes one edge of the timer clock.
    fn step(&mut self, t: u64) {
        let (kind, top) = self.mode();
        let max = if self.shape.wide { 0xFFFF } else { 0xFF };
        let old = self.tcnt;
        let hidden = std::mem::take(&mut self.blocked) || self.wait[0] > 0;
        let mut hit = [false; 3];
        for (unit, hit) in hit.iter_mut().enumerate().take(usize::from(self.shape.channels)) {
            let off = hidden || unit < 2 && self.wait[unit + 1] > 0;
            *hit = self.units[unit].compare == old && !off;
            if *hit {
                self.flag(2 << unit, t);
            }
        }
        let mut turn = top == Some(old);
        if self.top_is_ocra() {
            turn = hit[0];
        }
        if self.top_is_icr() {
            turn &= !hidden;
            if turn {
                self.flag(0x20, t);
            }
        }
        let slopes = matches!(kind, Kind::PhaseCorrect | Kind::PhaseFrequencyCorrect);
        if !slopes {
            self.tcnt = if turn || old == max { 0 } else { old + 1 };
            self.down = false;
        } else if old == 0 {
            self.down = false;
            self.tcnt = if turn { 0 } else { 1 };
        } else {
            if turn {
                self.down = true;
            }
            self.tcnt = if self.down {
                old - 1
            } else if old == max {
                0
            } else {
                old + 1
            };
        }
        let went_down = slopes && self.down;
        if self.tcnt == 0 {
            self.down = false;
        }
        if match kind {
            Kind::Up | Kind::Ctc => old == max,
            Kind::Fast => turn,
            _ => old == 0,
        } {
            self.flag(1, t);
        }
        let renew = match kind {
            Kind::Up | Kind::Ctc => false,
            Kind::Fast => self.tcnt == 0,
            Kind::PhaseCorrect => turn,
            Kind::PhaseFrequencyCorrect => old == 0,
        };
        for (unit, hit) in hit.into_iter().enumerate().take(usize::from(self.shape.channels)) {
            let com = self.com(unit);
            if renew {
                self.units[unit].compare = self.units[unit].buffer;
            }
            let now = self.units[unit].compare;
            let pin = &mut self.units[unit].pin;
            // Non-inverting: `on` is low, the level after a match upwards.
            let on = com == 3;
            match (com, kind) {
                (0, _) => {}
                (1, _) => *pin ^= hit,
                (_, Kind::Up | Kind::Ctc) => *pin = if hit { on } else { *pin },
                (_, Kind::Fast) => {
                    if hit {
                        *pin = on;
                    }
                    // The step from TOP to BOTTOM, but not the one from MAX to 0.
                    if turn {
                        *pin = !on;
                    }
                }
                (_, kind) => {
                    if hit {
                        *pin = if went_down { !on } else { on };
                    }
                    if kind == Kind::PhaseCorrect && turn && now < old {
                        *pin = on;
                    }
                    if kind == Kind::PhaseCorrect && turn && now == old {
                        *pin = !on;
                    }
                }
            }
        }
    }

    /// Handles a rising edge of TOSC1.
    fn tosc(&mut self, t: u64) {
        if !self.asleep {
            self.stale = None;
        }
        self.toscs.held = self.divider.held;
        let divided = match self.shape.taps[usize::from(self.acting[1] & 7)] {
            ClockTap::Div(div) => self.toscs.tick(div),
            _ => {
                self.toscs.tick(1);
                false
            }
        };
        if divided && self.is_async() {
            self.step(t);
        }
        if !self.asleep {
            for i in 0..5 {
                if self.wait[i] > 0 {
                    self.wait[i] -= 1;
                    if self.wait[i] == 0 {
                        self.land(i);
                    }
                }
            }
        }
    }

    /// Executes the clock edge `t`, with the register written at it. `divider` is true if the prescaler is
    /// clocked.
    pub fn tick(&mut self, t: u64, divider: bool, write: Option<(TimerRegister, u8, u8)>) {
        self.rose = 0;
        let was = self.tifr;
        if let Some((TimerRegister::TIFR, value, mask)) = write {
            self.tifr &= !(value & mask);
        }
        let due: Vec<u8> = self.late.iter().filter(|(_, at)| *at == t).map(|(bit, _)| *bit).collect();
        self.late.retain(|(_, at)| *at > t);
        due.into_iter().for_each(|bit| self.raise(bit));
        let mut edges = [[None; 2]; 2];
        if !self.asleep {
            edges = [self.t.tick(), self.icp.tick()];
        }
        let noise = self.tccrb & 0x80 != 0;
        if let Some(rising) = edges[1][usize::from(noise)]
            && self.shape.capture
            && rising == (self.tccrb & 0x40 != 0)
            && !self.top_is_icr()
        {
            self.icr = self.tcnt;
            self.raise(0x20);
        }
        let tap = self.shape.taps[usize::from(self.acting[1] & 7)];
        let divided = match tap {
            ClockTap::Div(div) if divider => self.divider.tick(div),
            _ if divider => {
                self.divider.tick(1);
                false
            }
            _ => false,
        };
        if !self.is_async() && !self.asleep {
            let external = edges[0][0];
            let wanted = match tap {
                ClockTap::Falling => Some(false),
                ClockTap::Rising => Some(true),
                _ => None,
            };
            if divided || wanted.is_some() && external == wanted {
                self.step(t);
            }
        }
        if self.assr & 0x40 == 0 {
            for _ in 0..self.crystal.tick() {
                self.tosc(t);
            }
        }
        // A flag that was cleared and set at one edge was never 0.
        self.rose &= !was;
        if let Some((reg, value, mask)) = write {
            self.write(reg, value, mask);
        }
    }

    /// Handles a rising edge of an external clock at TOSC1.
    pub fn pulse(&mut self, t: u64) {
        if self.assr & 0x40 != 0 && !self.crystal.stopped {
            self.tosc(t);
        }
    }

    pub fn sleep(&mut self) {
        self.stale = Some(self.shown());
        self.asleep = true;
    }

    pub fn wake(&mut self) {
        self.asleep = false;
        if !self.is_async() {
            self.stale = None;
        }
        for wait in &mut self.wait {
            *wait = if *wait > 0 { 2 } else { 0 };
        }
    }

    /// Handles a write of GTCCR.
    pub fn clear_divider(&mut self, held: bool) {
        self.divider = Divider { count: 0, held };
        self.toscs.count = 0;
    }

    pub fn shown(&self) -> u16 {
        if self.is_async() { self.stale.unwrap_or(self.tcnt) } else { self.tcnt }
    }

    pub fn assr(&self) -> u8 {
        let busy = (0..5).map(|i| u8::from(self.wait[i] > 0) << (4 - i)).sum::<u8>();
        self.assr | busy
    }
}
