//! What each element is, whatever it means: the one place that lists it. Tools read this table; the evaluator and the compiler
//! tell the meaning of elements independently of it and of each other.

use std::borrow::Cow;

use crate::model::{Element, LadderOperand, MathOp, SymbolKind};
use crate::symbols::kind_by_letter;
use crate::write;

/// What an element is: a row of the table, filled in for one element of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ElementFacts<'a> {
    /// LDmicro's keyword, such as `CTU`.
    pub keyword: &'static str,
    /// The symbols that it reads or writes, in the order of its arguments.
    pub symbols: Vec<SymbolUse<'a>>,
    /// Constants that must fit the integers of the program (a delay or a frequency is none).
    pub constants: Vec<i64>,
    /// What it does to the power of its rung.
    pub power: PowerEffect,
    /// It remembers something of its own from scan to scan, so that power behind it depends on earlier scans.
    pub has_memory: bool,
    /// The part of the chip that it uses.
    pub part: Option<ChipPart>,
    /// It has a meaning in dialect ldmicro-5 only.
    pub needs_ldmicro5: bool,
}

/// A symbol as one element uses it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SymbolUse<'a> {
    /// Its name.
    pub name: Cow<'a, str>,
    /// The kind that this use gives it.
    pub kind: SymbolKind,
    /// Its value is read.
    pub is_read: bool,
    /// When it is written, if at all.
    pub write: Option<WriteMoment>,
}

/// When an element writes a symbol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WriteMoment {
    /// In every scan, whether it has power or not.
    Always,
    /// Only with power.
    Powered,
    /// Only where it gives power on.
    Passing,
}

/// What an element does to the power of its rung.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PowerEffect {
    /// It is no part of the circuit.
    NoWire,
    /// It gives on what it gets and does nothing else.
    Wire,
    /// It gives on what it gets, or nothing, and changes nothing.
    Narrows,
    /// It gives on something else than what it gets.
    Decides,
    /// It gives on what it gets, and acts: what ends a path to the right rail.
    Acts,
}

/// A part of the chip that elements use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChipPart {
    /// The serial line's transmitter.
    Transmitter,
    /// The serial line's receiver.
    Receiver,
    /// The analog-to-digital converter.
    Converter,
    /// The pulse width output.
    Pwm,
    /// The data EEPROM.
    Eeprom,
}

impl ChipPart {
    /// The part in words, as in "the chip has no ..".
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            ChipPart::Transmitter | ChipPart::Receiver => "serial line",
            ChipPart::Converter => "converter",
            ChipPart::Pwm => "PWM output",
            ChipPart::Eeprom => "EEPROM",
        }
    }
}

impl<'a> ElementFacts<'a> {
    /// It may only end its path to the right rail.
    #[must_use]
    pub fn must_be_last(&self) -> bool {
        self.power == PowerEffect::Acts
    }

    /// The names of the symbols that it writes.
    pub fn written(&self) -> impl Iterator<Item = &str> {
        self.symbols.iter().filter(|symbol| symbol.write.is_some()).map(|symbol| &*symbol.name)
    }

    /// When it writes the symbol `name`, if it does.
    #[must_use]
    pub fn write_moment(&self, name: &str) -> Option<WriteMoment> {
        self.symbols.iter().find(|symbol| symbol.write.is_some() && symbol.name == name)?.write
    }

    fn new(keyword: &'static str, power: PowerEffect) -> Self {
        let (symbols, constants) = (Vec::new(), Vec::new());
        ElementFacts { keyword, symbols, constants, power, has_memory: false, part: None, needs_ldmicro5: false }
    }

    fn with_memory(self) -> Self {
        ElementFacts { has_memory: true, ..self }
    }

    fn ldmicro5(self) -> Self {
        ElementFacts { needs_ldmicro5: true, ..self }
    }

    fn uses_part(self, part: ChipPart) -> Self {
        ElementFacts { part: Some(part), ..self }
    }

    fn symbol(
        mut self,
        name: impl Into<Cow<'a, str>>,
        kind: SymbolKind,
        is_read: bool,
        write: Option<WriteMoment>,
    ) -> Self {
        self.symbols.push(SymbolUse { name: name.into(), kind, is_read, write });
        self
    }

    fn reads(self, name: &'a str, kind: SymbolKind) -> Self {
        self.symbol(name, kind, true, None)
    }

    fn writes(self, name: &'a str, kind: SymbolKind, moment: WriteMoment) -> Self {
        self.symbol(name, kind, false, Some(moment))
    }

    /// An accumulator, which it also reads.
    fn counts(self, name: &'a str, kind: SymbolKind) -> Self {
        self.symbol(name, kind, true, Some(WriteMoment::Always))
    }

    /// An operand whose constant must fit the program's integers.
    fn operand(mut self, operand: &'a LadderOperand) -> Self {
        if let LadderOperand::Const { value, .. } = operand {
            self.constants.push(*value);
        }
        self.argument(operand)
    }

    /// An operand with a range of its own.
    fn argument(self, operand: &'a LadderOperand) -> Self {
        match operand {
            LadderOperand::Var(name) => self.reads(name, SymbolKind::Variable),
            LadderOperand::Const { .. } => self,
        }
    }

    fn constants(mut self, values: impl IntoIterator<Item = i64>) -> Self {
        self.constants.extend(values);
        self
    }
}

impl Element {
    /// What the element is: its row of the table.
    #[must_use]
    pub fn facts(&self) -> ElementFacts<'_> {
        use PowerEffect::{Acts, Decides, Narrows, NoWire, Wire};
        use SymbolKind::{Adc, Counter, Timer, Variable};
        use WriteMoment::{Always, Passing, Powered};
        let row = ElementFacts::new;
        match self {
            Element::Comment(_) => row("COMMENT", NoWire),
            Element::Contacts { name, negated: _, set1: _ } => {
                row("CONTACTS", Narrows).reads(name, kind_by_letter(name))
            }
            Element::Coil { name, negated: _, set, reset, ttrigger: _ } => {
                let moment = if *set || *reset { Powered } else { Always };
                row("COIL", Acts).writes(name, kind_by_letter(name), moment)
            }
            Element::Short => row("SHORT", Wire),
            Element::Open => row("OPEN", Narrows),
            Element::Placeholder => row("PLACEHOLDER", Wire),
            Element::MasterRelay => row("MASTER_RELAY", Acts),
            Element::Osr => row("OSR", Decides).with_memory(),
            Element::Osf => row("OSF", Decides).with_memory(),
            Element::Timer { kind, name, delay, adjust } => {
                let row = row(write::timer_keyword(*kind), Decides).with_memory().counts(name, Timer).argument(delay);
                adjust.iter().fold(row, ElementFacts::argument)
            }
            Element::Counter { kind, name, max, init, input: _ } => {
                let row = row(write::counter_keyword(*kind), Decides).with_memory().counts(name, Counter).operand(max);
                init.iter().fold(row, ElementFacts::operand)
            }
            Element::Res { name } => row("RES", Acts).writes(name, Variable, Powered),
            Element::Move { dest, src } => row("MOVE", Acts).writes(dest, Variable, Powered).operand(src),
            Element::Math { op, dest, op1, op2 } => {
                let row = row(write::math_keyword(*op), Acts).writes(dest, Variable, Powered).operand(op1).operand(op2);
                match op {
                    MathOp::Add | MathOp::Sub | MathOp::Mul | MathOp::Div => row,
                    MathOp::Mod | MathOp::And | MathOp::Or | MathOp::Xor => row.ldmicro5(),
                }
            }
            Element::Unary { op, dest, src } => {
                row(write::unary_keyword(*op), Acts).writes(dest, Variable, Powered).operand(src).ldmicro5()
            }
            Element::Shift { op, dest, src, count } => row(write::shift_keyword(*op), Acts)
                .writes(dest, Variable, Powered)
                .operand(src)
                .operand(count)
                .ldmicro5(),
            Element::BitWrite { name, bit, value } => row(write::bit_write_keyword(*value), Acts)
                .symbol(name, Variable, true, Some(Powered))
                .operand(bit)
                .ldmicro5(),
            Element::BitTest { name, bit, value } => {
                row(write::bit_test_keyword(*value), Narrows).reads(name, Variable).operand(bit).ldmicro5()
            }
            Element::Bus { dest, src, targets: _ } => {
                row("BUS", Acts).writes(dest, Variable, Powered).operand(src).ldmicro5()
            }
            Element::Compare { op, op1, op2 } => row(write::compare_keyword(*op), Narrows).operand(op1).operand(op2),
            // The first stage is its input.
            Element::ShiftRegister { name, stages } => (0..*stages).fold(row("SHIFT_REGISTER", Acts), |row, stage| {
                row.symbol(format!("{name}{stage}"), Variable, stage + 1 < *stages, (stage > 0).then_some(Powered))
            }),
            Element::LookUpTable { dest, index, as_string: _, values } => row("LOOK_UP_TABLE", Acts)
                .writes(dest, Variable, Powered)
                .operand(index)
                .constants(values.iter().copied()),
            Element::PiecewiseLinear { dest, index, points } => row("PIECEWISE_LINEAR", Acts)
                .writes(dest, Variable, Powered)
                .operand(index)
                .constants(points.iter().flat_map(|&(x, y)| [x, y])),
            Element::ReadAdc { name, refs: _ } => {
                row("READ_ADC", Acts).writes(name, Adc, Powered).uses_part(ChipPart::Converter)
            }
            Element::SetPwm { duty, hertz, output: _ } => {
                row("SET_PWM", Acts).operand(duty).argument(hertz).uses_part(ChipPart::Pwm)
            }
            Element::UartRecv { name, rest: _ } => {
                row("UART_RECV", Decides).writes(name, Variable, Passing).uses_part(ChipPart::Receiver)
            }
            Element::UartSend { name, rest: _ } => {
                row("UART_SEND", Decides).with_memory().reads(name, Variable).uses_part(ChipPart::Transmitter)
            }
            // It is loaded from the EEPROM the first time that there is power.
            Element::Persist { name } => {
                row("PERSIST", Acts).symbol(name, Variable, true, Some(Powered)).uses_part(ChipPart::Eeprom)
            }
            Element::FormattedString { var, text: _, quoted: _ } => {
                let row = row("FORMATTED_STRING", Decides).with_memory().uses_part(ChipPart::Transmitter);
                var.iter().fold(row, |row, name| row.reads(name, Variable))
            }
        }
    }
}
