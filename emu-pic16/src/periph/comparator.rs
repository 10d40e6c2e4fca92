//! Comparators and their voltage reference (DS39582 sections 12 and 13; DS40044 sections 9 and 10; DS30487
//! sections 13 and 14).
//!
//! An output follows its inputs without delay: the response time of the data sheets (150 ns typical, 400 ns
//! maximum) is about one clock. There is no hysteresis and no offset; equal inputs give 0.

use emu_core::NEVER;

use super::map::{InterruptFlag, Pic16Line, Sfr};
use super::{Device, Pic16Drive, Pic16Outbox, Pic16Signal};
use crate::chips;

const C1OUT: u8 = 1 << 6;
const C2OUT: u8 = 1 << 7;
const CIS: u8 = 1 << 3;
const CVREN: u8 = 1 << 7;
const CVROE: u8 = 1 << 6;
const CVRR: u8 = 1 << 5;
const CMCON_MASK: u8 = 0x3F;
const CVRCON_MASK: u8 = 0xEF;

/// Input number of the reference; 0 to 3 are RA0 to RA3.
const CVREF: u8 = 4;

/// Inputs of one comparator: the pin at VIN- if CIS is 0, the pin at VIN- if CIS is 1, and the pin at VIN+.
type ComparatorInputs = Option<[u8; 3]>;

/// One of the eight modes of the comparators.
#[derive(Debug)]
struct ComparatorMode {
    inputs: [ComparatorInputs; 2],
    /// Whether the output of each comparator drives a pin.
    outputs: [bool; 2],
    /// Mask of the pins RA0 to RA3 that stay digital.
    digital: u8,
}

const fn mode(c1: ComparatorInputs, c2: ComparatorInputs, outputs: [bool; 2], digital: u8) -> ComparatorMode {
    ComparatorMode { inputs: [c1, c2], outputs, digital }
}

/// Modes of the 16F62x (DS40044 figure 10-1); the 16F87 and 16F88 have the same (DS30487 figure 13-1).
#[rustfmt::skip]
const F62X: [ComparatorMode; 8] = [
    mode(None,                None,                [false, false], 0b0000),
    mode(Some([0, 3, 2]),     Some([1, 1, 2]),     [false, false], 0b0000),
    mode(Some([0, 3, CVREF]), Some([1, 2, CVREF]), [false, false], 0b0000),
    mode(Some([0, 0, 2]),     Some([1, 1, 2]),     [false, false], 0b1000),
    mode(Some([0, 0, 3]),     Some([1, 1, 2]),     [false, false], 0b0000),
    mode(None,                Some([1, 1, 2]),     [false, false], 0b1001),
    mode(Some([0, 0, 2]),     Some([1, 1, 2]),     [true,  true],  0b1000),
    mode(None,                None,                [false, false], 0b1111),
];

/// Modes of the 16F87xA (DS39582 figure 12-1).
#[rustfmt::skip]
const F87XA: [ComparatorMode; 8] = [
    mode(None,                None,                [false, false], 0b0000),
    mode(Some([0, 0, 3]),     None,                [true,  false], 0b0110),
    mode(Some([0, 0, 3]),     Some([1, 1, 2]),     [false, false], 0b0000),
    mode(Some([0, 0, 3]),     Some([1, 1, 2]),     [true,  true],  0b0000),
    mode(Some([0, 0, 3]),     Some([1, 1, 3]),     [false, false], 0b0100),
    mode(Some([0, 0, 3]),     Some([1, 1, 3]),     [true,  true],  0b0100),
    mode(Some([0, 3, CVREF]), Some([1, 2, CVREF]), [false, false], 0b0000),
    mode(None,                None,                [false, false], 0b1111),
];

/// No comparators: all pins stay digital.
const ABSENT: ComparatorMode = mode(None, None, [false, false], 0b1111);

/// The comparators. Voltages are in millivolts above VSS.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pic16Comparators {
    kind: chips::ComparatorKind,
    /// Bits 5 to 0.
    cmcon: u8,
    cvrcon: u8,
    inputs: [u32; 4],
    supply: u32,
    /// Current C2OUT and C1OUT, then their values when CMCON was last read or written.
    outputs: u8,
    seen: u8,
    driven: [Pic16Drive; 2],
}

emu_core::state! { Pic16Comparators { cmcon, cvrcon, inputs, supply, outputs, seen, driven } stays { kind } }

impl Pic16Comparators {
    /// Returns the comparators after power-up, with a supply of 5 V and all inputs at 0 V.
    #[must_use]
    pub fn new(kind: chips::ComparatorKind) -> Pic16Comparators {
        Pic16Comparators {
            kind,
            cmcon: reset_cmcon(kind),
            cvrcon: 0,
            inputs: [0; 4],
            supply: 5_000,
            outputs: 0,
            seen: 0,
            driven: [Pic16Drive::Port; 2],
        }
    }

    /// Sets the voltage on RA`pin`, 0 to 3, from `t` on; other pins are ignored. If RA2 carries the reference
    /// ([`Pic16Comparators::reference_out`]), the caller must pass its voltage.
    pub fn set_input(&mut self, pin: u8, millivolts: u32, t: u64, out: &mut Pic16Outbox) {
        if let Some(input) = self.inputs.get_mut(usize::from(pin)) {
            *input = millivolts;
            self.update_outputs(t, out);
        }
    }

    /// Sets VDD from `t` on.
    pub fn set_supply(&mut self, millivolts: u32, t: u64, out: &mut Pic16Outbox) {
        self.supply = millivolts;
        self.update_outputs(t, out);
    }

    /// Returns a mask of the pins RA0 to RA3 that stay digital, RA0 in bit 0; the others read 0.
    #[must_use]
    pub fn digital_pins(&self) -> u8 {
        self.mode().digital
    }

    /// Reports whether an output differs from its value when CMCON was last read or written. While it does,
    /// CMIF cannot be cleared: it is set again at once (DS39582 section 12.6).
    #[must_use]
    pub const fn has_mismatch(&self) -> bool {
        self.outputs != self.seen
    }

    /// Returns CVREF (VREF) in millivolts, rounded down; 0 while the reference is off.
    #[must_use]
    pub fn reference(&self) -> u32 {
        (self.reference_96ths() / 96).try_into().unwrap_or(u32::MAX)
    }

    /// Returns the voltage that the reference drives onto RA2 in millivolts; None if CVROE or CVREN is clear.
    #[must_use]
    pub fn reference_out(&self) -> Option<u32> {
        (self.cvrcon & (CVREN | CVROE) == CVREN | CVROE).then(|| self.reference())
    }

    fn mode(&self) -> &'static ComparatorMode {
        let cm = usize::from(self.cmcon & 7);
        match self.kind {
            chips::ComparatorKind::None => &ABSENT,
            chips::ComparatorKind::F62x | chips::ComparatorKind::F88 => &F62X[cm],
            chips::ComparatorKind::F87xA => &F87XA[cm],
        }
    }

    /// Returns CVREF in 96ths of a millivolt, in which both ranges are exact: VDD CVR / 24, and VDD / 4 + VDD
    /// CVR / 32.
    fn reference_96ths(&self) -> u64 {
        let (vdd, cvr) = (u64::from(self.supply), u64::from(self.cvrcon & 15));
        match (self.cvrcon & CVREN != 0, self.cvrcon & CVRR != 0) {
            (false, _) => 0,
            (true, true) => vdd * cvr * 4,
            (true, false) => vdd * (8 + cvr) * 3,
        }
    }

    fn level(&self, input: u8) -> u64 {
        self.inputs.get(usize::from(input)).map_or_else(|| self.reference_96ths(), |&mv| u64::from(mv) * 96)
    }

    /// Recomputes the outputs and sends signals for what has changed.
    fn update_outputs(&mut self, t: u64, out: &mut Pic16Outbox) {
        let mode = self.mode();
        let mut outputs = 0;
        for (inputs, (bit, inverted)) in mode.inputs.iter().zip([(C1OUT, 1 << 4), (C2OUT, 1 << 5)]) {
            if let Some([minus, minus_cis, plus]) = *inputs {
                let minus = if self.cmcon & CIS != 0 { minus_cis } else { minus };
                if (self.level(plus) > self.level(minus)) != (self.cmcon & inverted != 0) {
                    outputs |= bit;
                }
            }
        }
        if outputs != self.outputs {
            self.outputs = outputs;
            if self.has_mismatch() {
                out.push(Pic16Signal::Flag { t, flag: InterruptFlag::CMIF });
            }
        }
        for (n, (line, bit)) in [(Pic16Line::C1out, C1OUT), (Pic16Line::C2out, C2OUT)].into_iter().enumerate() {
            let drive = if mode.outputs[n] { Pic16Drive::from_bit(outputs & bit != 0) } else { Pic16Drive::Port };
            if self.driven[n] != drive {
                self.driven[n] = drive;
                out.push(Pic16Signal::Drive { t, line, drive });
            }
        }
    }
}

/// CMCON after a reset.
fn reset_cmcon(kind: chips::ComparatorKind) -> u8 {
    match kind {
        chips::ComparatorKind::None | chips::ComparatorKind::F62x => 0,
        chips::ComparatorKind::F87xA | chips::ComparatorKind::F88 => 7,
    }
}

impl Device<Pic16Signal> for Pic16Comparators {
    type Reg = Sfr;

    fn read(&mut self, reg: Sfr, t: u64, _out: &mut Pic16Outbox) -> u8 {
        if reg == Sfr::CMCON {
            self.seen = self.outputs;
        }
        self.peek(reg, t)
    }

    fn peek(&self, reg: Sfr, _t: u64) -> u8 {
        match reg {
            Sfr::CMCON => self.outputs | self.cmcon,
            Sfr::CVRCON => self.cvrcon,
            _ => 0,
        }
    }

    fn write(&mut self, reg: Sfr, value: u8, _mask: u8, t: u64, out: &mut Pic16Outbox) {
        match reg {
            _ if self.kind == chips::ComparatorKind::None => {}
            Sfr::CMCON => {
                // The write ends an old mismatch; a change that the write itself causes is a new one (DS39582
                // section 12.6 and the note on changes of mode in section 12.1).
                self.seen = self.outputs;
                self.cmcon = value & CMCON_MASK;
                self.update_outputs(t, out);
            }
            Sfr::CVRCON => {
                self.cvrcon = value & CVRCON_MASK;
                self.update_outputs(t, out);
            }
            _ => {}
        }
    }

    // Neither comparators nor reference need the oscillator: they continue in sleep (DS39582 section 12.7).
    /// Resets the module at `t` for any cause (DS39582 section 12.8, DS40044 section 10.8).
    fn reset(&mut self, _power_on: bool, t: u64, out: &mut Pic16Outbox) {
        (self.cmcon, self.cvrcon) = (reset_cmcon(self.kind), 0);
        (self.outputs, self.seen) = (0, 0);
        self.update_outputs(t, out);
    }

    fn steady_until(&self, _reg: Sfr, _t: u64) -> u64 {
        NEVER
    }
}
