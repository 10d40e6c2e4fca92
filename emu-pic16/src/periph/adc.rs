//! Analog-to-digital converter (DS33023 section 23, DS30292 section 11, DS39582 section 11; 8 bits: DS31021).
//!
//! A conversion is two moments, both known when it begins: the holding capacitor leaves its input at the end of the first
//! segment of figure 11-3, and the result is loaded when the last bit is decided. The converter's clock begins with GO; the
//! first segment is a TAD and no shorter than an instruction cycle, and with the converter's own oscillator an instruction
//! cycle passes first (parameter 134, note 1), so that a SLEEP gets in.

mod control;
mod hold;

use emu_core::NEVER;

use self::hold::{HoldCapacitor, HoldNetwork};
use super::map::{InterruptFlag, Sfr};
use super::{Pic16Device, Pic16Outbox, Pic16Signal};
use crate::chips;

const ADON: u8 = 1;
/// ADIF of the 16C71, which has it in ADCON0.
const ADIF: u8 = 1 << 1;
const GO: u8 = 1 << 2;
const ADFM: u8 = 1 << 7;
const ADCS2: u8 = 1 << 6;

/// A conversion on its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct AdcConversion {
    /// Clock at which the capacitor leaves the input.
    sample: u64,
    /// Clock at which the result is loaded.
    done: u64,
    /// Clocks after the end before the capacitor is connected again.
    wait: u64,
    /// It runs on the converter's own oscillator.
    own_clock: bool,
    /// What was sampled, once it was.
    code: Option<u16>,
}

emu_core::state! { AdcConversion { sample, done, wait, own_clock, code } }

/// The converter. Voltages are in millivolts above VSS.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pic16Adc {
    kind: chips::Pic16AdcKind,
    channels: u8,
    rc: (u64, u64),
    inputs: [u32; 8],
    supply: u32,
    adcon0: u8,
    adcon1: u8,
    ansel: u8,
    adresh: u8,
    adresl: u8,
    conversion: Option<AdcConversion>,
    hold: HoldCapacitor,
    /// The capacitor is charged at once.
    ideal: bool,
    asleep: bool,
}

emu_core::state! {
    Pic16Adc { inputs, supply, adcon0, adcon1, ansel, adresh, adresl, conversion, hold, asleep } stays { kind, channels, rc, ideal }
}

impl Pic16Adc {
    /// The converter of a chip after power-up: `channels` inputs (1 to 8), TAD of its own oscillator as numerator and
    /// denominator of clocks, and the frequency of the oscillator for the times of acquisition. Sources have 10 kilohms, the
    /// supply is 5 V, all inputs are at 0 V.
    #[must_use]
    pub fn new(kind: chips::Pic16AdcKind, channels: u8, rc_clocks: (u64, u64), hz: u64) -> Pic16Adc {
        // DS30292 equation 11-1 (120 pF), and the acquisition requirements of DS31021 for 8 bits (51.2 pF).
        let network = if kind == chips::Pic16AdcKind::Bits8 {
            HoldNetwork { capacity_ff: 51_200, inner_ohms: 8_000, settle_ns: 6_250, constants_e6: 6_236_370 }
        } else {
            HoldNetwork { capacity_ff: 120_000, inner_ohms: 8_000, settle_ns: 3_250, constants_e6: 7_624_131 }
        };
        Pic16Adc {
            kind,
            channels: channels.min(8),
            rc: (rc_clocks.0, rc_clocks.1.max(1)),
            inputs: [0; 8],
            supply: 5_000,
            adcon0: 0,
            adcon1: 0,
            ansel: control::ansel_mask(kind),
            adresh: 0,
            adresl: 0,
            conversion: None,
            hold: HoldCapacitor::new(network, 10_000, hz),
            ideal: false,
            asleep: false,
        }
    }

    /// The same with a capacitor that is charged at once, where `ideal` is set.
    #[must_use]
    pub fn with_ideal_acquisition(mut self, ideal: bool) -> Pic16Adc {
        self.ideal = ideal;
        self
    }

    /// Any reset at `t`: the module is off, all pins are analog; ADRES stays (DS30292 table 12-6).
    pub fn reset(&mut self, t: u64) {
        self.sample_by(t);
        self.hold.open(t, self.source());
        (self.adcon0, self.adcon1, self.ansel) = (0, 0, control::ansel_mask(self.kind));
        (self.conversion, self.asleep) = (None, false);
    }

    /// The voltage on AN`channel` from `t` on; a channel that the chip does not have is ignored.
    pub fn set_input(&mut self, channel: u8, millivolts: u32, t: u64) {
        if channel < self.channels && self.inputs[usize::from(channel & 7)] != millivolts {
            self.sample_by(t);
            self.hold.inject_charge(t, self.source());
            self.inputs[usize::from(channel & 7)] = millivolts;
        }
    }

    /// VDD from `t` on.
    pub fn set_supply(&mut self, millivolts: u32, t: u64) {
        self.sample_by(t);
        self.supply = millivolts;
    }

    /// The impedance of the sources in ohms, from `t` on.
    pub fn set_source_ohms(&mut self, ohms: u32, t: u64) {
        self.sample_by(t);
        self.hold.set_ohms(ohms, t, self.source());
    }

    /// The channels that are digital inputs, AN0 in bit 0; the pins of the others read 0 (DS30292 section 11.3). Channels
    /// that the chip does not have are digital.
    #[must_use]
    pub fn digital_pins(&self) -> u8 {
        let digital = control::digital(self.kind, self.adcon1, self.ansel);
        digital | !(((1u16 << self.channels) - 1) as u8)
    }

    /// The selected channel has been connected for the time of equation 11-1 at `t`, so that a conversion may begin.
    #[must_use]
    pub fn is_acquired(&self, t: u64) -> bool {
        (self.ideal || self.hold.is_acquired(t)) && self.conversion.is_none()
    }

    /// The channel on which the write of `value` to ADCON0 at `t` begins a conversion, if it is not acquired
    /// by then.
    #[must_use]
    pub fn acquisition_error_channel(&self, value: u8, t: u64) -> Option<u8> {
        let mut adc = self.clone();
        adc.run_due(t, &mut Pic16Outbox::new());
        let converts = adc.conversion.is_some();
        adc.write_adcon0(value, t);
        let begins = !converts && adc.conversion.is_some();
        (begins && !self.ideal && !adc.hold.is_acquired(t)).then(|| control::chs(adc.kind, adc.adcon0) as u8)
    }

    /// The special event of a CCP module starts a conversion at `t`, if the module is on and none is under way
    /// (DS30292 section 8.2.4).
    pub fn start(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        if self.powered() && self.conversion.is_none() {
            self.adcon0 |= GO;
            self.begin(t);
        }
    }

    /// ADCS selects the converter's own oscillator.
    fn uses_rc_clock(&self) -> bool {
        self.adcon0 >> 6 == 3
    }

    /// TAD by ADCS, in clocks.
    fn tad(&self) -> (u64, u64) {
        let fast = if self.adcon1 & ADCS2 != 0 { 2 } else { 1 };
        match self.adcon0 >> 6 {
            0 => (2 * fast, 1),
            1 => (8 * fast, 1),
            2 => (32 * fast, 1),
            _ => self.rc,
        }
    }

    fn powered(&self) -> bool {
        self.adcon0 & ADON != 0 && (!self.asleep || self.uses_rc_clock())
    }

    /// The input of the selected channel in microvolts.
    fn source(&self) -> u64 {
        // A channel that the chip does not have is at 0 V for ever, and CHS has three bits at most.
        u64::from(self.inputs[control::chs(self.kind, self.adcon0)]) * 1_000
    }

    fn begin(&mut self, t: u64) {
        let (num, den) = self.tad();
        let halves = |n: u64| (u128::from(num) * u128::from(n)).div_ceil(2 * u128::from(den)) as u64;
        // Half periods of TAD: until the sample, and in all (parameter 131).
        let (first, all) = if self.kind == chips::Pic16AdcKind::Bits8 { (3, 19) } else { (2, 24) };
        let lead = if self.uses_rc_clock() { 4 } else { 4u64.saturating_sub(halves(first)) };
        self.conversion = Some(AdcConversion {
            sample: t.saturating_add(lead).saturating_add(halves(first)),
            done: t.saturating_add(lead).saturating_add(halves(all)),
            wait: halves(4),
            own_clock: self.uses_rc_clock(),
            code: None,
        });
    }

    /// Ends the conversion without a result; the capacitor waits as after a whole one (DS30292 section 11.4).
    fn abort(&mut self, t: u64) {
        if let Some(conversion) = self.conversion.take() {
            self.adcon0 &= !GO;
            self.hold.open(t, self.source());
            self.hold.connect(t.saturating_add(conversion.wait));
        }
    }

    /// Takes the sample if its clock has come by `t`.
    fn sample_by(&mut self, t: u64) {
        if let Some(AdcConversion { sample, code: None, .. }) = self.conversion
            && sample <= t
        {
            self.hold.open(sample, self.source());
            let held = if self.ideal { self.source() } else { self.hold.voltage_at(sample, 0) };
            let code = Some(self.code(held));
            self.conversion = self.conversion.map(|c| AdcConversion { code, ..c });
        }
    }

    /// The ideal transfer function: the first step is reached at one step's voltage (DS33023 section 23, transfer function).
    fn code(&self, microvolts: u64) -> u16 {
        let (plus, minus) = control::references(self.kind, self.adcon1);
        let high = u64::from(if plus { self.inputs[3] } else { self.supply }) * 1_000;
        let low = if minus { u64::from(self.inputs[2]) * 1_000 } else { 0 };
        let steps = if self.kind == chips::Pic16AdcKind::Bits8 { 256 } else { 1024 };
        let above = microvolts.saturating_sub(low);
        match high.saturating_sub(low) {
            0 if above == 0 => 0,
            0 => steps as u16 - 1,
            span => (above * steps / span).min(steps - 1) as u16,
        }
    }

    fn load(&mut self, code: u16) {
        let [high, low] = match self.kind {
            chips::Pic16AdcKind::Bits8 => [code as u8, 0],
            _ if self.adcon1 & ADFM != 0 => code.to_be_bytes(),
            _ => (code << 6).to_be_bytes(),
        };
        (self.adresh, self.adresl) = (high, low);
    }

    fn write_adcon0(&mut self, value: u8, t: u64) {
        let value = value & control::adcon0_mask(self.kind);
        let (old, on) = (self.adcon0, value & ADON != 0);
        // The source is asked for before the channel changes.
        let source = self.source();
        // GO set together with ADON starts nothing and is not kept (note under DS30292 figure 11-3).
        let go = value & GO != 0 && on && old & ADON != 0;
        if !go {
            self.abort(t);
        }
        if !on {
            self.hold.open(t, source);
        } else if old & ADON == 0 {
            self.hold.connect(t);
        } else if control::chs(self.kind, old) != control::chs(self.kind, value) {
            self.hold.switch(t, source);
        }
        self.adcon0 = if go { value } else { value & !GO };
        if go && self.conversion.is_none() {
            self.begin(t);
        }
    }
}

impl Pic16Device for Pic16Adc {
    fn run_due(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.sample_by(t);
        if let Some(AdcConversion { done, wait, code: Some(code), .. }) = self.conversion
            && done <= t
        {
            self.conversion = None;
            self.load(code);
            self.adcon0 &= !GO;
            if self.kind == chips::Pic16AdcKind::Bits8 {
                self.adcon0 |= ADIF;
            }
            if self.powered() {
                self.hold.connect(done.saturating_add(wait));
            }
            out.push(Pic16Signal::Flag { t: done, flag: InterruptFlag::ADIF });
        }
    }

    fn next_clock(&self) -> u64 {
        self.conversion.map_or(NEVER, |conversion| conversion.done)
    }

    fn peek(&self, reg: Sfr, _t: u64) -> u8 {
        match reg {
            Sfr::ADCON0 => self.adcon0,
            Sfr::ADCON1 => self.adcon1,
            Sfr::ANSEL => self.ansel,
            Sfr::ADRESH => self.adresh,
            Sfr::ADRESL => self.adresl,
            _ => 0,
        }
    }

    fn write(&mut self, reg: Sfr, value: u8, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        match reg {
            Sfr::ADCON0 => self.write_adcon0(value, t),
            Sfr::ADCON1 => self.adcon1 = value & control::adcon1_mask(self.kind),
            Sfr::ANSEL => self.ansel = value & control::ansel_mask(self.kind),
            Sfr::ADRESH if self.kind != chips::Pic16AdcKind::None => self.adresh = value,
            Sfr::ADRESL if self.kind != chips::Pic16AdcKind::None && self.kind != chips::Pic16AdcKind::Bits8 => {
                self.adresl = value
            }
            _ => {}
        }
    }

    fn stop_clock(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        self.asleep = true;
        // Without its own clock the module aborts and is off until the chip wakes (DS30292 section 11.5).
        let goes_on = self.conversion.map_or(self.powered(), |conversion| conversion.own_clock);
        if !goes_on {
            self.abort(t);
            self.hold.open(t, self.source());
        }
    }

    fn restart_clock(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        self.asleep = false;
        if self.powered() && self.conversion.is_none() && !self.hold.is_connected() {
            self.hold.connect(t);
        }
    }

    fn steady_until(&self, reg: Sfr, _t: u64) -> u64 {
        match reg {
            Sfr::ADCON0 | Sfr::ADRESH | Sfr::ADRESL => self.next_clock(),
            _ => NEVER,
        }
    }
}
