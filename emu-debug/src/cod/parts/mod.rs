//! The parts that a program may have around the chip: gpsim's library modules, as far as programs use them to check themselves.

pub mod usart;
pub mod wave;

use super::value::Value;
use crate::devices::eeprom24::{self, Eeprom};
use usart::Usart;
use wave::Wave;

/// A source behind a resistance, as one pin of a part shows it to the net.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Source {
    /// Voltage without load, in millivolts.
    pub millivolts: i64,
    /// Conductance in nanosiemens: 1,000,000,000 / ohms.
    pub conductance: i64,
}

/// Supply voltage in millivolts.
pub const SUPPLY: i64 = 5000;

impl Source {
    /// An output of a part: 250 ohms, as gpsim's.
    #[must_use]
    pub fn output(millivolts: i64) -> Source {
        Source { millivolts, conductance: conductance(250.0) }
    }
}

/// Conductance in nanosiemens of a resistance in ohms, at least 1.
#[must_use]
pub fn conductance(ohms: f64) -> i64 {
    // The conversion saturates, so an absurd resistance gives an absurd but whole conductance.
    ((1e9 / ohms.max(1e-3)) as i64).max(1)
}

/// A part.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// The name that the program gave it.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// Levels of its pins as it sees them.
    pub seen: Vec<bool>,
}

/// What a part is.
#[derive(Debug, Clone, PartialEq)]
#[rustfmt::skip]
pub enum Kind {
    /// A resistor to a voltage (`pullup`, `pulldown`): millivolts, ohms.
    Resistor { millivolts: i64, ohms: f64 },
    /// `not`, `and2`, `or2`, `xor2`: pins in0, in1, out.
    Gate(Gate),
    /// `switch`: pins A, B.
    Switch { closed: bool, ohms_closed: f64, ohms_open: f64 },
    /// `pulsegen`, or an asynchronous stimulus.
    Wave(Wave),
    /// `usart`: pins TXPIN, RXPIN, CTS, RTS.
    Usart(Usart),
    /// `e24xx..`.
    Eeprom(Eeprom),
}

/// A gate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Gate {
    Not,
    And,
    Or,
    Xor,
}

impl Part {
    /// A part by the name of its module; nothing where there is none of that name.
    #[must_use]
    pub fn new(module: &str, name: &str) -> Option<Part> {
        let kind = match module {
            "pullup" | "pu" => Kind::Resistor { millivolts: SUPPLY, ohms: 10e3 },
            "pulldown" | "pd" => Kind::Resistor { millivolts: 0, ohms: 10e3 },
            "not" => Kind::Gate(Gate::Not),
            "and2" => Kind::Gate(Gate::And),
            "or2" => Kind::Gate(Gate::Or),
            "xor2" => Kind::Gate(Gate::Xor),
            "switch" | "sw" => Kind::Switch { closed: false, ohms_closed: 10.0, ohms_open: 100e6 },
            "pulsegen" | "pg" => Kind::Wave(Wave::default()),
            "usart" => Kind::Usart(Usart::default()),
            _ => Kind::Eeprom(Eeprom::module(module)?),
        };
        Some(Part::of(name, kind))
    }

    /// A part of a kind.
    #[must_use]
    pub fn of(name: &str, kind: Kind) -> Part {
        let mut part = Part { name: name.to_owned(), kind, seen: Vec::new() };
        // Buses and serial lines rest high.
        let rest = matches!(part.kind, Kind::Usart(_) | Kind::Eeprom(_));
        part.seen = part.pins().iter().enumerate().map(|(pin, _)| rest && pin < 2).collect();
        part
    }

    /// Names of its pins.
    #[must_use]
    pub fn pins(&self) -> &'static [&'static str] {
        match self.kind {
            Kind::Resistor { .. } | Kind::Wave(_) => &["pin"],
            Kind::Gate(Gate::Not) => &["in0", "out"],
            Kind::Gate(_) => &["in0", "in1", "out"],
            Kind::Switch { .. } => &["A", "B"],
            Kind::Usart(_) => &["TXPIN", "RXPIN", "CTS", "RTS"],
            Kind::Eeprom(_) => &eeprom24::PINS,
        }
    }

    /// What it puts on a pin at a clock; nothing where it only listens. `cycle` is the clocks of a machine cycle, `hz` those of
    /// a second.
    #[must_use]
    pub fn drives(&self, pin: usize, t: u64, cycle: u64, hz: u64) -> Option<Source> {
        let level = |high: bool| if high { SUPPLY } else { 0 };
        match &self.kind {
            Kind::Resistor { millivolts, ohms } => {
                Some(Source { millivolts: *millivolts, conductance: conductance(*ohms) })
            }
            Kind::Gate(gate) if pin + 1 == self.pins().len() => Some(Source::output(level(self.gate(*gate)))),
            Kind::Wave(wave) => Some(Source::output(wave.at(t / cycle.max(1)))),
            Kind::Usart(usart) if pin == 0 => Some(Source::output(level(usart.tx(t, hz)))),
            // An input with a pull-up of 10 kilohms.
            Kind::Usart(_) if pin > 1 => Some(Source { millivolts: SUPPLY, conductance: conductance(10e3) }),
            Kind::Eeprom(eeprom) if pin == 0 && eeprom.pulls => Some(Source::output(0)),
            _ => None,
        }
    }

    fn gate(&self, gate: Gate) -> bool {
        let input = |pin: usize| self.seen.get(pin).copied().unwrap_or(false);
        match gate {
            Gate::Not => !input(0),
            Gate::And => input(0) && input(1),
            Gate::Or => input(0) || input(1),
            Gate::Xor => input(0) != input(1),
        }
    }

    /// A pin has another level at a clock.
    pub fn line(&mut self, pin: usize, high: bool, t: u64, hz: u64) {
        if let Some(seen) = self.seen.get_mut(pin) {
            *seen = high;
        }
        match &mut self.kind {
            Kind::Usart(usart) if pin == 1 => usart.line(high, t, hz),
            Kind::Eeprom(eeprom) => eeprom.line(pin, high, t, hz),
            _ => {}
        }
    }

    /// The next clock after `t` at which it drives something by itself.
    #[must_use]
    pub fn next_drive(&self, t: u64, cycle: u64, hz: u64) -> Option<u64> {
        match &self.kind {
            Kind::Wave(wave) => wave.next(t / cycle.max(1))?.checked_mul(cycle),
            Kind::Usart(usart) => usart.next_drive(t, hz),
            _ => None,
        }
    }

    /// The next clock at which it looks at a line by itself.
    #[must_use]
    pub fn next_look(&self, hz: u64) -> Option<u64> {
        match &self.kind {
            Kind::Usart(usart) => usart.next_look(hz),
            _ => None,
        }
    }

    /// Looks wherever that is due up to `t`.
    pub fn look(&mut self, t: u64, hz: u64) {
        if let Kind::Usart(usart) = &mut self.kind {
            usart.look(t, hz);
        }
    }

    /// Is at `t` now, as far as it drives by itself.
    pub fn advance(&mut self, t: u64, hz: u64) {
        if let Kind::Usart(usart) = &mut self.kind {
            usart.advance(t, hz);
        }
    }

    /// The value of an attribute; nothing where it has none of that name.
    #[must_use]
    pub fn attribute(&self, name: &str) -> Option<Value> {
        let whole = |value: u64| Value::Int(i64::try_from(value).unwrap_or(i64::MAX));
        Some(match (&self.kind, name) {
            (Kind::Resistor { millivolts, .. }, "voltage") => Value::Real(*millivolts as f64 / 1000.0),
            (Kind::Resistor { ohms, .. }, "resistance") => Value::Real(*ohms),
            (Kind::Switch { closed, .. }, "state") => Value::Bool(*closed),
            (Kind::Switch { ohms_closed, .. }, "Rclosed") => Value::Real(*ohms_closed),
            (Kind::Switch { ohms_open, .. }, "Ropen") => Value::Real(*ohms_open),
            (Kind::Wave(wave), "period") => whole(wave.period),
            (Kind::Usart(usart), "rx") => Value::Int(usart.rx.into()),
            (Kind::Usart(usart), "txbaud") => whole(usart.txbaud),
            (Kind::Usart(usart), "rxbaud") => whole(usart.rxbaud),
            (Kind::Usart(usart), "loop") => Value::Bool(usart.echo),
            _ => return None,
        })
    }

    /// Sets an attribute at a clock. False where it has none of that name, or not of such values.
    pub fn assign(&mut self, name: &str, value: &Value, t: u64, hz: u64) -> bool {
        if matches!(name, "xpos" | "ypos" | "capacitance") && value.real().is_some() {
            // Where it is drawn; and charges, which are not modelled.
            return true;
        }
        match (&mut self.kind, name, value.real()) {
            (Kind::Resistor { millivolts, .. }, "voltage", Some(volts)) => *millivolts = (volts * 1000.0) as i64,
            (Kind::Resistor { ohms, .. }, "resistance", Some(value)) => *ohms = value,
            (Kind::Switch { closed, .. }, "state", Some(on)) => *closed = on != 0.0,
            (Kind::Switch { ohms_closed, .. }, "Rclosed", Some(value)) => *ohms_closed = value,
            (Kind::Switch { ohms_open, .. }, "Ropen", Some(value)) => *ohms_open = value,
            (Kind::Wave(wave), ..) => return wave.assign(name, value),
            (Kind::Usart(usart), ..) => return usart.assign(name, value, t, hz),
            _ => return false,
        }
        true
    }
}
