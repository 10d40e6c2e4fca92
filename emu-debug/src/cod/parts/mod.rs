//! Parts around the chip: the modules of gpsim's library that self-checking programs use.

pub mod usart;
pub mod wave;

use super::value::CodValue;
use crate::devices::eeprom24::{self, Eeprom24};
use usart::CodUsart;
use wave::StimulusWave;

/// A voltage source with a series resistance, as a pin of a part drives its net.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VoltageSource {
    /// Voltage without load, in millivolts.
    pub millivolts: i64,
    /// Conductance in nanosiemens: 1,000,000,000 / ohms.
    pub conductance: i64,
}

/// Supply voltage in millivolts.
pub const SUPPLY_MILLIVOLTS: i64 = 5000;

impl VoltageSource {
    /// Returns an output of a part: 250 ohms, as in gpsim.
    #[must_use]
    pub fn output(millivolts: i64) -> VoltageSource {
        VoltageSource { millivolts, conductance: conductance(250.0) }
    }
}

/// Returns the conductance in nanosiemens of a resistance in ohms, at least 1.
#[must_use]
pub fn conductance(ohms: f64) -> i64 {
    // The conversion saturates, so an absurd resistance gives a finite conductance.
    ((1e9 / ohms.max(1e-3)) as i64).max(1)
}

/// A part.
#[derive(Debug, Clone, PartialEq)]
pub struct CodPart {
    /// The name that the program gave it.
    pub name: String,
    /// The kind of the part.
    pub kind: CodPartKind,
    /// Levels of its pins as it sees them.
    pub pin_levels: Vec<bool>,
}

/// The kind of a part.
#[derive(Debug, Clone, PartialEq)]
#[rustfmt::skip]
pub enum CodPartKind {
    /// A resistor to a voltage (`pullup`, `pulldown`): millivolts, ohms.
    Resistor { millivolts: i64, ohms: f64 },
    /// `not`, `and2`, `or2`, `xor2`: pins in0, in1, out.
    Gate(LogicGate),
    /// `switch`: pins A, B.
    Switch { closed: bool, ohms_closed: f64, ohms_open: f64 },
    /// `pulsegen`, or an asynchronous stimulus.
    Wave(StimulusWave),
    /// `usart`: pins TXPIN, RXPIN, CTS, RTS.
    Usart(CodUsart),
    /// `e24xx..`.
    Eeprom(Eeprom24),
}

/// A gate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum LogicGate {
    Not,
    And,
    Or,
    Xor,
}

impl CodPart {
    /// Returns a part by the name of its module; `None` if there is no such module.
    #[must_use]
    pub fn new(module: &str, name: &str) -> Option<CodPart> {
        let kind = match module {
            "pullup" | "pu" => CodPartKind::Resistor { millivolts: SUPPLY_MILLIVOLTS, ohms: 10e3 },
            "pulldown" | "pd" => CodPartKind::Resistor { millivolts: 0, ohms: 10e3 },
            "not" => CodPartKind::Gate(LogicGate::Not),
            "and2" => CodPartKind::Gate(LogicGate::And),
            "or2" => CodPartKind::Gate(LogicGate::Or),
            "xor2" => CodPartKind::Gate(LogicGate::Xor),
            "switch" | "sw" => CodPartKind::Switch { closed: false, ohms_closed: 10.0, ohms_open: 100e6 },
            "pulsegen" | "pg" => CodPartKind::Wave(StimulusWave::default()),
            "usart" => CodPartKind::Usart(CodUsart::default()),
            _ => CodPartKind::Eeprom(Eeprom24::module(module)?),
        };
        Some(CodPart::of(name, kind))
    }

    /// Returns a part of a kind.
    #[must_use]
    pub fn of(name: &str, kind: CodPartKind) -> CodPart {
        let mut part = CodPart { name: name.to_owned(), kind, pin_levels: Vec::new() };
        // Buses and serial lines are high when idle.
        let rest = matches!(part.kind, CodPartKind::Usart(_) | CodPartKind::Eeprom(_));
        part.pin_levels = part.pins().iter().enumerate().map(|(pin, _)| rest && pin < 2).collect();
        part
    }

    /// Returns the names of its pins.
    #[must_use]
    pub fn pins(&self) -> &'static [&'static str] {
        match self.kind {
            CodPartKind::Resistor { .. } | CodPartKind::Wave(_) => &["pin"],
            CodPartKind::Gate(LogicGate::Not) => &["in0", "out"],
            CodPartKind::Gate(_) => &["in0", "in1", "out"],
            CodPartKind::Switch { .. } => &["A", "B"],
            CodPartKind::Usart(_) => &["TXPIN", "RXPIN", "CTS", "RTS"],
            CodPartKind::Eeprom(_) => &eeprom24::PINS,
        }
    }

    /// Returns the source at a pin at a clock; `None` if the pin is only an input. `cycle` is the number of
    /// clocks per machine cycle, `hz` the clocks per second.
    #[must_use]
    pub fn source_of_pin(&self, pin: usize, t: u64, cycle: u64, hz: u64) -> Option<VoltageSource> {
        let level = |high: bool| if high { SUPPLY_MILLIVOLTS } else { 0 };
        match &self.kind {
            CodPartKind::Resistor { millivolts, ohms } => {
                Some(VoltageSource { millivolts: *millivolts, conductance: conductance(*ohms) })
            }
            CodPartKind::Gate(gate) if pin + 1 == self.pins().len() => {
                Some(VoltageSource::output(level(self.gate(*gate))))
            }
            CodPartKind::Wave(wave) => Some(VoltageSource::output(wave.at(t / cycle.max(1)))),
            CodPartKind::Usart(usart) if pin == 0 => Some(VoltageSource::output(level(usart.tx_level(t, hz)))),
            // An input with a pull-up of 10 kilohms.
            CodPartKind::Usart(_) if pin > 1 => {
                Some(VoltageSource { millivolts: SUPPLY_MILLIVOLTS, conductance: conductance(10e3) })
            }
            CodPartKind::Eeprom(eeprom) if pin == 0 && eeprom.pulls_sda => Some(VoltageSource::output(0)),
            _ => None,
        }
    }

    fn gate(&self, gate: LogicGate) -> bool {
        let input = |pin: usize| self.pin_levels.get(pin).copied().unwrap_or(false);
        match gate {
            LogicGate::Not => !input(0),
            LogicGate::And => input(0) && input(1),
            LogicGate::Or => input(0) || input(1),
            LogicGate::Xor => input(0) != input(1),
        }
    }

    /// Reports a new level of a pin at a clock.
    pub fn on_pin_change(&mut self, pin: usize, high: bool, t: u64, hz: u64) {
        if let Some(seen) = self.pin_levels.get_mut(pin) {
            *seen = high;
        }
        match &mut self.kind {
            CodPartKind::Usart(usart) if pin == 1 => usart.on_rx_change(high, t, hz),
            CodPartKind::Eeprom(eeprom) => eeprom.on_pin_change(pin, high, t, hz),
            _ => {}
        }
    }

    /// Returns the next clock after `t` at which the part changes an output by itself.
    #[must_use]
    pub fn next_drive(&self, t: u64, cycle: u64, hz: u64) -> Option<u64> {
        match &self.kind {
            CodPartKind::Wave(wave) => wave.next(t / cycle.max(1))?.checked_mul(cycle),
            CodPartKind::Usart(usart) => usart.next_drive(t, hz),
            _ => None,
        }
    }

    /// Returns the next clock at which the part samples a line by itself.
    #[must_use]
    pub fn next_sample(&self, hz: u64) -> Option<u64> {
        match &self.kind {
            CodPartKind::Usart(usart) => usart.next_sample(hz),
            _ => None,
        }
    }

    /// Takes all samples that are due up to `t`.
    pub fn sample(&mut self, t: u64, hz: u64) {
        if let CodPartKind::Usart(usart) = &mut self.kind {
            usart.sample(t, hz);
        }
    }

    /// Advances the outputs that the part drives by itself to `t`.
    pub fn advance(&mut self, t: u64, hz: u64) {
        if let CodPartKind::Usart(usart) = &mut self.kind {
            usart.advance(t, hz);
        }
    }

    /// Returns the value of an attribute; `None` if there is no such attribute.
    #[must_use]
    pub fn attribute(&self, name: &str) -> Option<CodValue> {
        let whole = |value: u64| CodValue::Int(i64::try_from(value).unwrap_or(i64::MAX));
        Some(match (&self.kind, name) {
            (CodPartKind::Resistor { millivolts, .. }, "voltage") => CodValue::Real(*millivolts as f64 / 1000.0),
            (CodPartKind::Resistor { ohms, .. }, "resistance") => CodValue::Real(*ohms),
            (CodPartKind::Switch { closed, .. }, "state") => CodValue::Bool(*closed),
            (CodPartKind::Switch { ohms_closed, .. }, "Rclosed") => CodValue::Real(*ohms_closed),
            (CodPartKind::Switch { ohms_open, .. }, "Ropen") => CodValue::Real(*ohms_open),
            (CodPartKind::Wave(wave), "period") => whole(wave.period),
            (CodPartKind::Usart(usart), "rx") => CodValue::Int(usart.rx.into()),
            (CodPartKind::Usart(usart), "txbaud") => whole(usart.txbaud),
            (CodPartKind::Usart(usart), "rxbaud") => whole(usart.rxbaud),
            (CodPartKind::Usart(usart), "loop") => CodValue::Bool(usart.echo),
            _ => return None,
        })
    }

    /// Sets an attribute at a clock; returns false if there is no such attribute or the value does not fit.
    pub fn assign(&mut self, name: &str, value: &CodValue, t: u64, hz: u64) -> bool {
        if matches!(name, "xpos" | "ypos" | "capacitance") && value.to_real().is_some() {
            // Positions in the drawing, and capacitances, which are not modelled.
            return true;
        }
        match (&mut self.kind, name, value.to_real()) {
            (CodPartKind::Resistor { millivolts, .. }, "voltage", Some(volts)) => *millivolts = (volts * 1000.0) as i64,
            (CodPartKind::Resistor { ohms, .. }, "resistance", Some(value)) => *ohms = value,
            (CodPartKind::Switch { closed, .. }, "state", Some(on)) => *closed = on != 0.0,
            (CodPartKind::Switch { ohms_closed, .. }, "Rclosed", Some(value)) => *ohms_closed = value,
            (CodPartKind::Switch { ohms_open, .. }, "Ropen", Some(value)) => *ohms_open = value,
            (CodPartKind::Wave(wave), ..) => return wave.assign(name, value),
            (CodPartKind::Usart(usart), ..) => return usart.assign(name, value, t, hz),
            _ => return false,
        }
        true
    }
}
