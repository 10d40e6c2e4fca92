//! Analog-to-digital converter (section 24).
//!
//! The clock of the converter is a tap of a counter that runs while ADEN is set. Its first rising edge comes
//! half a period after the counter was zero. A conversion starts at a rising edge. Its sample and its end are
//! a fixed number of half clocks later, so both edges are known as long as ADPS does not change. While the
//! clock of the peripheral is stopped, its local time is stopped too.

mod kind;

use emu_core::NEVER;
use emu_core::state;

pub use self::kind::{AdcRegister, AvrAdcKind};
use super::{AvrOutbox, AvrSignal, Device};

const ADEN: u8 = 1 << 7;
const ADSC: u8 = 1 << 6;
/// Auto trigger enable; free running select (ADFR) on chips without trigger sources.
const ADATE: u8 = 1 << 5;
const ADIF: u8 = 1 << 4;
const ADIE: u8 = 1 << 3;
const ADPS: u8 = 7;
const ADLAR: u8 = 1 << 5;
const ACME: u8 = 1 << 6;
const ADTS: u8 = 7;

/// Cycles from the edge of a trigger to the reset of the prescaler (24.4: three cycles of synchronization).
const SYNC_CYCLES: u64 = 3;
/// Half clocks from the start of a conversion to its sample and end (table 24-1); index 1: first after ADEN.
const HALF_CLOCKS: [(u64, u64); 2] = [(3, 26), (27, 50)];

/// A conversion in progress, or one that waits for its first clock edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct AdcConversion {
    /// Cycle up to which half clocks have been counted.
    from: u64,
    /// Half clocks from the start to `from`; `None` before the start.
    halves: Option<u64>,
    /// True for the first conversion after ADEN.
    first: bool,
    /// ADMUX, latched at the start (24.5).
    admux: u8,
    /// Result, once the input was sampled.
    code: Option<u16>,
}

state! { AdcConversion { from, halves, first, admux, code } if |of, _now| of.from != NEVER && of.halves != Some(NEVER) }

/// Half a period of the converter's clock in cycles, by ADPS (table 24-5).
const fn half_period(adcsra: u8) -> u64 {
    1 << (adcsra & ADPS).saturating_sub(1)
}

/// The analog-to-digital converter. Voltages are in millivolts above GND.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AvrAdc {
    kind: AvrAdcKind,
    /// Voltages on ADC0 to ADC7 and of the temperature sensor, in millivolts.
    levels: [u32; 9],
    aref: u32,
    avcc: u32,
    admux: u8,
    /// ADCSRA without ADSC.
    adcsra: u8,
    adcsrb: u8,
    didr0: u8,
    data: u16,
    /// True after a read of ADCL until ADCH is read: results are lost meanwhile (24.9.3).
    locked: bool,
    /// True if the next conversion is the first one after ADEN.
    fresh: bool,
    /// Local time at which the prescaler was zero.
    origin: u64,
    conversion: Option<AdcConversion>,
    /// Cycle at which ADIF was last set.
    flagged: u64,
    /// Flags of the trigger sources as reported by [`AvrAdc::trigger`]; bit `n` is for ADTS = `n`.
    sources: u8,
    /// Cycle at which the clock of the peripheral was stopped; None while it runs.
    stopped: Option<u64>,
}

state! {
    AvrAdc {
        levels, aref, avcc, admux, adcsra, adcsrb, didr0, data, locked, fresh, origin, conversion, flagged, sources, stopped,
    } stays { kind } if |adc, _now| adc.origin != NEVER && adc.stopped != Some(NEVER)
}

impl AvrAdc {
    /// Returns the converter after power-on: AVCC and AREF 5 V, pins 0 V, 25 °C (314 mV, table 24-2).
    #[must_use]
    pub fn new(kind: AvrAdcKind) -> AvrAdc {
        AvrAdc {
            kind,
            levels: [0, 0, 0, 0, 0, 0, 0, 0, 314],
            aref: 5_000,
            avcc: 5_000,
            admux: 0,
            adcsra: 0,
            adcsrb: 0,
            didr0: 0,
            data: 0,
            locked: false,
            fresh: false,
            origin: 0,
            conversion: None,
            flagged: 0,
            sources: 0,
            stopped: None,
        }
    }

    /// Sets the voltage on ADC`channel` (0 to 7) or of the temperature sensor (8), from the edge `t` on.
    pub fn set_millivolts(&mut self, channel: u8, millivolts: u32, t: u64) {
        self.advance(t);
        if let Some(level) = self.levels.get_mut(usize::from(channel)) {
            *level = millivolts;
        }
    }

    /// Sets the voltage on AREF from the edge `t` on, used if REFS = 0.
    pub fn set_aref(&mut self, millivolts: u32, t: u64) {
        self.advance(t);
        self.aref = millivolts;
    }

    /// Sets the voltage on AVCC from the edge `t` on, used if REFS = 1.
    pub fn set_avcc(&mut self, millivolts: u32, t: u64) {
        self.advance(t);
        self.avcc = millivolts;
    }

    /// Returns the trigger source of conversions: ADTS, if ADEN, ADATE and ADTS are set (table 24-6).
    #[must_use]
    pub fn listened_trigger(&self) -> Option<u8> {
        (self.adcsra & (ADEN | ADATE) == ADEN | ADATE && self.source() != 0).then_some(self.source())
    }

    /// Sets the flag of the trigger source `source` (1 to 7) from the edge `t` on. The chip calls this when
    /// the flag of the source in [`AvrAdc::listened_trigger`] changes, and for all sources before a write of
    /// ADCSRA or ADCSRB.
    pub fn trigger(&mut self, source: u8, set: bool, t: u64) {
        self.advance(t);
        let bit = 1u8.checked_shl(source.into()).unwrap_or(0);
        let rises = set && self.sources & bit == 0;
        self.sources = if set { self.sources | bit } else { self.sources & !bit };
        if rises && self.listened_trigger() == Some(source) {
            self.start_triggered(t);
        }
    }

    /// Starts a conversion on entry to idle or ADC noise reduction sleep at the edge `t` (10.3, 10.4).
    pub fn on_core_halted(&mut self, t: u64) {
        self.advance(t);
        self.start_conversion(self.to_adc_time(t));
    }

    /// Returns the channel that replaces AIN1 at the comparator: if ACME is set and ADEN clear (table 23-1).
    #[must_use]
    pub fn comparator_channel(&self) -> Option<u8> {
        (self.adcsrb & ACME != 0 && !self.enabled()).then_some(self.admux & 7)
    }

    /// Reports whether ADEN is set. It also keeps the bandgap reference on (11.7.1).
    #[must_use]
    pub fn enabled(&self) -> bool {
        self.adcsra & ADEN != 0
    }

    /// Returns DIDR0: a mask of the channels whose digital input is off; their pins read 0.
    #[must_use]
    pub fn digital_off(&self) -> u8 {
        self.didr0
    }

    /// Returns the local time at the edge `t`: it does not advance while the clock is stopped.
    fn to_adc_time(&self, t: u64) -> u64 {
        self.stopped.unwrap_or(t)
    }

    /// The trigger source that ADTS selects; 0 on chips without trigger sources.
    fn source(&self) -> u8 {
        if self.kind.triggers { self.adcsrb & ADTS } else { 0 }
    }

    fn free_running(&self) -> bool {
        self.adcsra & ADATE != 0 && self.source() == 0
    }

    /// Returns the level of the signal that ADTS selects.
    fn source_level(&self) -> bool {
        match self.source() {
            0 => self.adcsra & ADIF != 0,
            source => self.sources >> source & 1 != 0,
        }
    }

    fn half_period(&self) -> u64 {
        half_period(self.adcsra)
    }

    /// Number of edges of the converter's clock from the origin up to `t`; odd edges rise.
    fn edges(&self, t: u64) -> u64 {
        t.saturating_sub(self.origin) / self.half_period()
    }

    /// Returns the time `n` edges of the clock after `from`.
    fn after(&self, from: u64, n: u64) -> u64 {
        if n == 0 {
            return from;
        }
        let edges = self.edges(from).saturating_add(n);
        self.origin.saturating_add(edges.saturating_mul(self.half_period()))
    }

    /// Returns the time of the first rising edge after `from`.
    fn next_rising_edge(&self, from: u64) -> u64 {
        self.after(from, 1 + self.edges(from) % 2)
    }

    /// Returns the time of the conversion's next step: its start, its sample or its end.
    fn step_at(&self, conversion: &AdcConversion) -> u64 {
        let (sample, end) = HALF_CLOCKS[usize::from(conversion.first)];
        match conversion.halves {
            None => self.next_rising_edge(conversion.from),
            Some(halves) => {
                let target = if conversion.code.is_none() { sample } else { end };
                self.after(conversion.from, target.saturating_sub(halves))
            }
        }
    }

    /// Returns the time at which ADIF is set next, if nothing is written.
    fn end_at(&self) -> u64 {
        match (&self.conversion, self.stopped) {
            (Some(conversion), None) => {
                let end = HALF_CLOCKS[usize::from(conversion.first)].1;
                match conversion.halves {
                    Some(halves) => self.after(conversion.from, end.saturating_sub(halves)),
                    None => self.after(self.next_rising_edge(conversion.from), end),
                }
            }
            _ => NEVER,
        }
    }

    /// Executes everything that is due at or before `t`.
    fn advance(&mut self, t: u64) {
        let now = self.to_adc_time(t);
        while let Some(mut conversion) = self.conversion {
            let at = self.step_at(&conversion);
            if at > now {
                break;
            }
            if conversion.halves.is_none() {
                (conversion.from, conversion.halves, conversion.admux) = (at, Some(0), self.admux);
            } else if conversion.code.is_none() {
                conversion.code = Some(self.code(conversion.admux));
            } else {
                self.finish(conversion.code.unwrap_or(0), at, now);
                // While the clock is stopped, only a write can cause the end, at the edge of that write.
                self.flagged = at.saturating_add(t.saturating_sub(now));
                continue;
            }
            self.conversion = Some(conversion);
        }
    }

    /// Finishes a conversion at `at` with the result `code`. In free running mode the next conversion starts
    /// at the same edge. Conversions that end by `now` have equal results, so all but the last are skipped.
    fn finish(&mut self, code: u16, at: u64, now: u64) {
        if !self.locked {
            self.data = code;
        }
        self.adcsra |= ADIF;
        self.conversion = self.free_running().then(|| {
            let period = HALF_CLOCKS[0].1 * self.half_period();
            let skip = (now.saturating_sub(at) / period).saturating_sub(1);
            AdcConversion {
                from: at.saturating_add(skip.saturating_mul(period)),
                halves: Some(0),
                first: false,
                admux: self.admux,
                code: None,
            }
        });
    }

    /// Returns the result for `admux` (24.7). A reserved reference acts as AREF, a missing input is at 0 V.
    fn code(&self, admux: u8) -> u16 {
        let reference = match admux >> 6 {
            1 => self.avcc,
            2 => self.kind.low_reference_mv.unwrap_or(self.aref),
            3 => self.kind.reference_mv,
            _ => self.aref,
        };
        let mux = admux & self.kind.mux;
        let input = if self.kind.temperature == Some(mux) {
            self.levels[8]
        } else if mux == self.kind.bandgap {
            self.kind.bandgap_mv
        } else if mux < 8 {
            self.levels[usize::from(mux)]
        } else {
            0
        };
        match (input, reference) {
            (0, _) => 0,
            (_, 0) => 1023,
            _ => (u64::from(input) * 1024 / u64::from(reference)).min(1023) as u16,
        }
    }

    /// Requests a conversion at the local time `t`, if the converter is on and idle.
    fn start_conversion(&mut self, t: u64) {
        if self.enabled() && self.conversion.is_none() {
            let first = std::mem::take(&mut self.fresh);
            self.conversion = Some(AdcConversion { from: t, halves: None, first, admux: 0, code: None });
        }
    }

    /// Starts a conversion because the trigger signal rose at the edge `t`.
    fn start_triggered(&mut self, t: u64) {
        if self.enabled() && self.conversion.is_none() {
            self.origin = self.to_adc_time(t).saturating_add(SYNC_CYCLES);
            self.start_conversion(self.origin);
        }
    }

    /// Counts the clock edges until `t`, then changes ADPS. If the clock level differs between the old and
    /// the new tap, the change itself is an edge and is counted.
    fn switch_clock(&mut self, adcsra: u8, t: u64) {
        let local = self.to_adc_time(t);
        let (edges, level) = (self.edges(local), self.edges(local) % 2);
        self.conversion = self.conversion.map(|conversion| AdcConversion {
            from: local,
            halves: conversion.halves.map(|halves| halves + edges.saturating_sub(self.edges(conversion.from))),
            ..conversion
        });
        self.adcsra = adcsra;
        let now = self.edges(local) % 2;
        let admux = self.admux;
        if let Some(conversion) = self.conversion.as_mut().filter(|_| now != level) {
            match &mut conversion.halves {
                Some(halves) => *halves += 1,
                None if now == 1 => (conversion.halves, conversion.admux) = (Some(0), admux),
                None => {}
            }
        }
        self.advance(t);
    }

    fn write_adcsra(&mut self, value: u8, mask: u8, t: u64) {
        let local = self.to_adc_time(t);
        let kept = mask & (ADEN | ADATE | ADIE | ADPS);
        let new = self.adcsra & !kept | value & kept;
        let was_on = self.enabled();
        if new & ADEN == 0 {
            self.adcsra = new;
            self.conversion = None;
        } else if !was_on {
            self.adcsra = new;
            (self.origin, self.fresh) = (local, true);
        } else if half_period(new) != half_period(self.adcsra) {
            self.switch_clock(new, t);
        } else {
            self.adcsra = new;
        }
        if value & mask & ADIF != 0 && self.flagged != t {
            self.adcsra &= !ADIF;
        }
        if value & mask & ADSC != 0 {
            self.start_conversion(local);
        }
    }

    fn register_value(&self, reg: AdcRegister) -> u8 {
        let [high, low] = (if self.admux & ADLAR != 0 { self.data << 6 } else { self.data }).to_be_bytes();
        match reg {
            AdcRegister::ADMUX => self.admux,
            AdcRegister::ADCSRA => self.adcsra | if self.conversion.is_some() { ADSC } else { 0 },
            AdcRegister::ADCSRB => self.adcsrb,
            AdcRegister::ADCL => low,
            AdcRegister::ADCH => high,
            AdcRegister::DIDR0 => self.didr0,
        }
    }

    /// Returns the state at `t`, after everything that is due.
    fn advanced_to(&self, t: u64) -> AvrAdc {
        let mut adc = self.clone();
        adc.advance(t);
        adc
    }
}

impl Device<AvrSignal> for AvrAdc {
    type Reg = AdcRegister;

    fn run_due(&mut self, t: u64, _out: &mut AvrOutbox) {
        self.advance(t);
    }

    fn next_deadline(&self) -> u64 {
        if self.adcsra & (ADIE | ADIF) == ADIE { self.end_at() } else { NEVER }
    }

    /// Interrupt 0: conversion complete.
    fn interrupt_requests(&self) -> u8 {
        u8::from(self.adcsra & (ADIE | ADIF) == ADIE | ADIF)
    }

    fn on_interrupt_taken(&mut self, irq: u8, t: u64, _out: &mut AvrOutbox) {
        self.advance(t);
        if irq == 0 {
            self.adcsra &= !ADIF;
        }
    }

    fn read(&mut self, reg: AdcRegister, t: u64, _out: &mut AvrOutbox) -> u8 {
        self.advance(t);
        match reg {
            AdcRegister::ADCL => self.locked = true,
            AdcRegister::ADCH => self.locked = false,
            _ => {}
        }
        self.register_value(reg)
    }

    fn peek(&self, reg: AdcRegister, t: u64) -> u8 {
        match &self.conversion {
            Some(conversion) if self.step_at(conversion) <= self.to_adc_time(t) => {
                self.advanced_to(t).register_value(reg)
            }
            _ => self.register_value(reg),
        }
    }

    fn write(&mut self, reg: AdcRegister, value: u8, mask: u8, t: u64, _out: &mut AvrOutbox) {
        self.advance(t);
        let merge = |old: u8, bits: u8| old & !(mask & bits) | value & mask & bits;
        match reg {
            AdcRegister::ADMUX => self.admux = merge(self.admux, 0xE0 | self.kind.mux),
            AdcRegister::ADCSRA => self.write_adcsra(value, mask, t),
            AdcRegister::ADCSRB => {
                let before = self.source_level();
                self.adcsrb = merge(self.adcsrb, if self.kind.triggers { ACME | ADTS } else { ACME });
                // The switch from one source to another can itself be a rising edge (24.9.4).
                if !before && self.source_level() && self.listened_trigger().is_some() {
                    self.start_triggered(t);
                }
            }
            AdcRegister::DIDR0 => self.didr0 = merge(self.didr0, self.kind.didr0),
            AdcRegister::ADCL | AdcRegister::ADCH => {}
        }
    }

    fn reset(&mut self, _power_on: bool, t: u64, _out: &mut AvrOutbox) {
        self.advance(t);
        let AvrAdc { kind, levels, aref, avcc, sources, .. } = *self;
        *self = AvrAdc { levels, aref, avcc, sources, ..AvrAdc::new(kind) };
    }

    fn stop_clock(&mut self, t: u64, _out: &mut AvrOutbox) {
        self.advance(t);
        self.stopped = Some(self.to_adc_time(t));
    }

    fn restart_clock(&mut self, t: u64, _out: &mut AvrOutbox) {
        let Some(stopped) = self.stopped.take() else { return };
        let slept = t.saturating_sub(stopped);
        self.origin = self.origin.saturating_add(slept);
        if let Some(conversion) = &mut self.conversion {
            conversion.from = conversion.from.saturating_add(slept);
        }
    }

    fn steady_until(&self, reg: AdcRegister, t: u64) -> u64 {
        let now = self.advanced_to(t);
        match reg {
            // A read that changes the lock has a side effect.
            AdcRegister::ADCL if now.locked => NEVER,
            AdcRegister::ADCH if !now.locked => now.end_at(),
            AdcRegister::ADCL | AdcRegister::ADCH => t,
            AdcRegister::ADCSRA if now.free_running() && now.adcsra & ADIF != 0 => NEVER,
            AdcRegister::ADCSRA => now.end_at(),
            _ => NEVER,
        }
    }
}
