//! Analog-to-digital converter (DS33023 section 23, DS30292 section 11, DS39582 section 11; 8 bits: DS31021).
//!
//! A conversion has two events, both known when it starts: the holding capacitor is disconnected from its
//! input at the end of the first segment of figure 11-3, and the result is loaded when the last bit is
//! decided. The converter's clock starts with GO. The first segment is one TAD, but not shorter than an
//! instruction cycle. With the converter's own oscillator one instruction cycle passes first (parameter 134,
//! note 1), so that a SLEEP can execute.

mod control;
mod hold;

use emu_core::NEVER;

use self::hold::{HoldCapacitor, HoldNetwork};
use super::map::{InterruptFlag, Sfr};
use super::{Device, Pic16Outbox, Pic16Signal};
use crate::chips;

const ADON: u8 = 1;
/// Mask of ADIF in ADCON0 of the 16C71.
const ADIF: u8 = 1 << 1;
const GO: u8 = 1 << 2;
const ADFM: u8 = 1 << 7;
const ADCS2: u8 = 1 << 6;

/// A conversion in progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct AdcConversion {
    /// Clock at which the capacitor is disconnected from the input.
    sample: u64,
    /// Clock at which the result is loaded.
    done: u64,
    /// Clocks after the end before the capacitor is connected again.
    wait: u64,
    /// True if the conversion uses the converter's own oscillator.
    own_clock: bool,
    /// Result, once the input was sampled.
    code: Option<u16>,
}

emu_core::state! { AdcConversion { sample, done, wait, own_clock, code } }

/// A time as a fraction of clocks of the oscillator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockFraction {
    /// Numerator, in clocks.
    pub num: u64,
    /// Denominator.
    pub den: u64,
}

/// The analog-to-digital converter. Voltages are in millivolts above VSS.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pic16Adc {
    kind: chips::Pic16AdcKind,
    channels: u8,
    rc: ClockFraction,
    inputs: [u32; 8],
    supply: u32,
    adcon0: u8,
    adcon1: u8,
    ansel: u8,
    adresh: u8,
    adresl: u8,
    conversion: Option<AdcConversion>,
    hold: HoldCapacitor,
    /// True if the capacitor charges at once.
    ideal: bool,
    asleep: bool,
}

emu_core::state! {
    Pic16Adc { inputs, supply, adcon0, adcon1, ansel, adresh, adresl, conversion, hold, asleep } stays { kind, channels, rc, ideal }
}

impl Pic16Adc {
    /// Returns the converter after power-up with `channels` inputs (1 to 8). `rc_clocks` is TAD of its own
    /// oscillator as a fraction of clocks, `hz` the frequency of the oscillator, for the acquisition time.
    /// Sources have 10 kilohms, the supply is 5 V, all inputs are at 0 V.
    #[must_use]
    pub fn new(kind: chips::Pic16AdcKind, channels: u8, rc_clocks: ClockFraction, hz: u64) -> Pic16Adc {
        // DS30292 equation 11-1 (120 pF), and the acquisition requirements of DS31021 for 8 bits (51.2 pF).
        let network = if kind == chips::Pic16AdcKind::Bits8 {
            HoldNetwork { capacity_ff: 51_200, inner_ohms: 8_000, settle_ns: 6_250, constants_e6: 6_236_370 }
        } else {
            HoldNetwork { capacity_ff: 120_000, inner_ohms: 8_000, settle_ns: 3_250, constants_e6: 7_624_131 }
        };
        Pic16Adc {
            kind,
            channels: channels.min(8),
            rc: ClockFraction { den: rc_clocks.den.max(1), ..rc_clocks },
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

    /// Returns the converter with a capacitor that charges at once, if `ideal` is true.
    #[must_use]
    pub fn with_ideal_acquisition(mut self, ideal: bool) -> Pic16Adc {
        self.ideal = ideal;
        self
    }

    /// Sets the voltage on AN`channel` from `t` on; channels that the chip does not have are ignored.
    pub fn set_input(&mut self, channel: u8, millivolts: u32, t: u64) {
        if channel < self.channels && self.inputs[usize::from(channel & 7)] != millivolts {
            self.sample_by(t);
            self.hold.inject_charge(t, self.source());
            self.inputs[usize::from(channel & 7)] = millivolts;
        }
    }

    /// Sets VDD from `t` on.
    pub fn set_supply(&mut self, millivolts: u32, t: u64) {
        self.sample_by(t);
        self.supply = millivolts;
    }

    /// Sets the impedance of the sources in ohms, from `t` on.
    pub fn set_source_ohms(&mut self, ohms: u32, t: u64) {
        self.sample_by(t);
        self.hold.set_ohms(ohms, t, self.source());
    }

    /// Returns a mask of the digital channels, AN0 in bit 0; the pins of the others read 0 (DS30292 section
    /// 11.3). Channels that the chip does not have count as digital.
    #[must_use]
    pub fn digital_pins(&self) -> u8 {
        let digital = control::digital(self.kind, self.adcon1, self.ansel);
        digital | !(((1u16 << self.channels) - 1) as u8)
    }

    /// Reports whether, at `t`, the selected channel has been connected for the time of equation 11-1, so
    /// that a conversion can start.
    #[must_use]
    pub fn is_acquired(&self, t: u64) -> bool {
        (self.ideal || self.hold.is_acquired(t)) && self.conversion.is_none()
    }

    /// Returns the channel on which a write of `value` to ADCON0 at `t` would start a conversion before the
    /// acquisition is complete, if any.
    #[must_use]
    pub fn acquisition_error_channel(&self, value: u8, t: u64) -> Option<u8> {
        let mut adc = self.clone();
        adc.run_due(t, &mut Pic16Outbox::new());
        let converts = adc.conversion.is_some();
        adc.write_adcon0(value, t);
        let begins = !converts && adc.conversion.is_some();
        (begins && !self.ideal && !adc.hold.is_acquired(t)).then(|| control::chs(adc.kind, adc.adcon0) as u8)
    }

    /// Starts a conversion at `t` by the special event of a CCP module, if the module is on and idle (DS30292
    /// section 8.2.4).
    pub fn start(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        if self.powered() && self.conversion.is_none() {
            self.adcon0 |= GO;
            self.begin(t);
        }
    }

    /// Reports whether ADCS selects the converter's own oscillator.
    fn uses_rc_clock(&self) -> bool {
        self.adcon0 >> 6 == 3
    }

    /// Returns TAD by ADCS.
    fn tad(&self) -> ClockFraction {
        let fast = if self.adcon1 & ADCS2 != 0 { 2 } else { 1 };
        let clocks = match self.adcon0 >> 6 {
            0 => 2,
            1 => 8,
            2 => 32,
            _ => return self.rc,
        };
        ClockFraction { num: clocks * fast, den: 1 }
    }

    fn powered(&self) -> bool {
        self.adcon0 & ADON != 0 && (!self.asleep || self.uses_rc_clock())
    }

    /// Returns the voltage of the selected channel in microvolts.
    fn source(&self) -> u64 {
        // A channel that the chip does not have is always at 0 V, and CHS has at most three bits.
        u64::from(self.inputs[control::chs(self.kind, self.adcon0)]) * 1_000
    }

    fn begin(&mut self, t: u64) {
        let ClockFraction { num, den } = self.tad();
        let halves = |n: u64| (u128::from(num) * u128::from(n)).div_ceil(2 * u128::from(den)) as u64;
        // Half periods of TAD: until the sample, and in total (parameter 131).
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

    /// Aborts the conversion without a result. The capacitor waits as after a complete conversion (DS30292
    /// section 11.4).
    fn abort(&mut self, t: u64) {
        if let Some(conversion) = self.conversion.take() {
            self.adcon0 &= !GO;
            self.hold.open(t, self.source());
            self.hold.connect(t.saturating_add(conversion.wait));
        }
    }

    /// Samples the input if the sample is due by `t`.
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

    /// Returns the result by the ideal transfer function: the first step is reached at the voltage of one
    /// step (DS33023 section 23, transfer function).
    fn code(&self, microvolts: u64) -> u16 {
        let references = control::references(self.kind, self.adcon1);
        let high = u64::from(if references.plus_is_an3 { self.inputs[3] } else { self.supply }) * 1_000;
        let low = if references.minus_is_an2 { u64::from(self.inputs[2]) * 1_000 } else { 0 };
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
        // The source must be read before the channel changes.
        let source = self.source();
        // GO set together with ADON starts no conversion and is not stored (note under DS30292 figure 11-3).
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

impl Device<Pic16Signal> for Pic16Adc {
    type Reg = Sfr;

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

    fn next_deadline(&self) -> u64 {
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

    fn write(&mut self, reg: Sfr, value: u8, _mask: u8, t: u64, out: &mut Pic16Outbox) {
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

    /// Resets the module at `t` for any cause: it is off, all pins are analog; ADRES keeps its value (DS30292
    /// table 12-6).
    fn reset(&mut self, _power_on: bool, t: u64, _out: &mut Pic16Outbox) {
        self.sample_by(t);
        self.hold.open(t, self.source());
        (self.adcon0, self.adcon1, self.ansel) = (0, 0, control::ansel_mask(self.kind));
        (self.conversion, self.asleep) = (None, false);
    }

    fn stop_clock(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        self.asleep = true;
        // Without its own clock the module aborts, and is off until the chip wakes (DS30292 section 11.5).
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
            Sfr::ADCON0 | Sfr::ADRESH | Sfr::ADRESL => self.next_deadline(),
            _ => NEVER,
        }
    }
}
