//! Table of the properties of each element: keyword, symbols, constants, power, memory and chip part.
//!
//! Tools read this table. It does not define what an element computes: the evaluator and the compiler each do
//! that, independently of this table and of each other.

use std::borrow::Cow;

use crate::model::{CounterKind, Element, FlowOp, LadderOperand, MathOp, SymbolKind, TimerKind};
use crate::symbols::kind_by_letter;
use crate::write;

/// Properties of one element of a program: a row of the table, filled in with its arguments.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ElementFacts<'a> {
    /// LDmicro's keyword, such as `CTU`.
    pub keyword: &'static str,
    /// Symbols that the element reads or writes, in the order of its arguments.
    pub symbols: Vec<SymbolUse<'a>>,
    /// Constants that must fit the integers of the program; delays and frequencies are not among them.
    pub constants: Vec<i64>,
    /// What the element does to the power of its rung.
    pub power: PowerEffect,
    /// True if the element keeps state of its own from scan to scan, so that its output depends on earlier
    /// scans.
    pub has_memory: bool,
    /// Part of the chip that the element uses.
    pub part: Option<ChipPart>,
    /// True if the element exists in LDmicro 5 only.
    pub needs_ldmicro5: bool,
}

/// One use of a symbol by an element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SymbolUse<'a> {
    /// Name of the symbol.
    pub name: Cow<'a, str>,
    /// Kind that this use implies for the symbol.
    pub kind: SymbolKind,
    /// True if the element reads the value.
    pub is_read: bool,
    /// When the element writes the value; `None` if it does not.
    pub write: Option<WriteMoment>,
}

/// When an element writes a symbol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WriteMoment {
    /// In every scan, with or without power.
    Always,
    /// Only in scans in which the element has power.
    Powered,
    /// Only in scans in which the element passes power on.
    Passing,
}

/// What an element does to the power of its rung.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PowerEffect {
    /// Not part of the circuit.
    NoWire,
    /// Passes on its input and does nothing else.
    Wire,
    /// Passes on its input or blocks it, and changes nothing.
    Narrows,
    /// Its output is not simply its input.
    Decides,
    /// Passes on its input and performs an action; such an element usually ends a path to the right rail.
    Acts,
}

/// A part of the chip that an element uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChipPart {
    /// Transmitter of the serial line.
    Transmitter,
    /// Receiver of the serial line.
    Receiver,
    /// Analog-to-digital converter.
    Converter,
    /// PWM output.
    Pwm,
    /// Data EEPROM.
    Eeprom,
    /// Two-wire bus.
    I2c,
    /// SPI bus.
    Spi,
}

impl ChipPart {
    /// Name of the part for messages such as "the chip has no ..".
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            ChipPart::Transmitter | ChipPart::Receiver => "serial line",
            ChipPart::Converter => "converter",
            ChipPart::Pwm => "PWM output",
            ChipPart::Eeprom => "EEPROM",
            ChipPart::I2c => "I2C bus",
            ChipPart::Spi => "SPI bus",
        }
    }
}

impl<'a> ElementFacts<'a> {
    /// True if LDmicro's editor draws the element only as the last one on its path to the right rail.
    #[must_use]
    pub fn is_drawn_last(&self) -> bool {
        self.power == PowerEffect::Acts
    }

    /// Names of the symbols that the element writes.
    pub fn written(&self) -> impl Iterator<Item = &str> {
        self.symbols.iter().filter(|symbol| symbol.write.is_some()).map(|symbol| &*symbol.name)
    }

    /// When the element writes the symbol `name`; `None` if it does not write it.
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

    /// Adds an accumulator, which the element reads and writes in every scan.
    fn counts(self, name: &'a str, kind: SymbolKind) -> Self {
        self.symbol(name, kind, true, Some(WriteMoment::Always))
    }

    /// Adds an operand whose constant must fit the program's integers.
    fn operand(mut self, operand: &'a LadderOperand) -> Self {
        if let LadderOperand::Const { value, .. } = operand {
            self.constants.push(*value);
        }
        self.argument(operand)
    }

    /// Adds an operand whose constant has a range of its own.
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
    /// Whether only LDmicro 5 can have written the element: release 2.3 lacks it, or one of its arguments.
    #[must_use]
    pub fn only_ldmicro5_writes(&self) -> bool {
        let is_variable = |operand: &LadderOperand| matches!(operand, LadderOperand::Var(_));
        // Release 2.3 has no hexadecimal numbers, and a mistyped decimal number is no sign of LDmicro 5.
        let is_wide_hex = |operand: &LadderOperand| matches!(operand, LadderOperand::Const { value, text } if text.contains("0x") && i16::try_from(*value).is_err());
        if self.facts().needs_ldmicro5 {
            return true;
        }
        match self {
            Element::Contacts { set1, .. } => set1.is_some(),
            Element::Coil { ttrigger, .. } => ttrigger.is_some(),
            Element::Timer { delay, adjust, .. } => is_variable(delay) || adjust.is_some(),
            Element::Counter { max, init, input, .. } => is_variable(max) || init.is_some() || input.is_some(),
            Element::ReadAdc { refs, .. } => refs.is_some(),
            Element::SetPwm { output, .. } => output.is_some(),
            Element::UartRecv { rest, .. } | Element::UartSend { rest, .. } => rest.is_some(),
            Element::FormattedString { quoted, .. } => *quoted,
            Element::LookUpTable { name, .. } | Element::PiecewiseLinear { name, .. } => name.is_some(),
            Element::Move { src, .. } => is_wide_hex(src),
            Element::Math { op1, op2, .. } | Element::Compare { op1, op2, .. } => is_wide_hex(op1) || is_wide_hex(op2),
            // Release 2.3 writes all arguments of the others.
            _ => false,
        }
    }

    /// What the element is: its row of the table. An operand that is a register of a port exists in LDmicro 5
    /// only.
    #[must_use]
    pub fn facts(&self) -> ElementFacts<'_> {
        let row = self.row();
        if row.symbols.iter().any(|symbol| symbol.name.starts_with('#')) { row.ldmicro5() } else { row }
    }

    /// Operands whose constants are integers of the program; delays and frequencies are not among them.
    pub fn operands_mut(&mut self) -> Vec<&mut LadderOperand> {
        match self {
            Element::Math { op1: a, op2: b, .. }
            | Element::Compare { op1: a, op2: b, .. }
            | Element::Shift { src: a, count: b, .. }
            | Element::Stepper { max: a, period: b, .. } => vec![a, b],
            Element::Counter { max, init, .. } => std::iter::once(max).chain(init).collect(),
            Element::Move { src: operand, .. }
            | Element::Unary { src: operand, .. }
            | Element::Bus { src: operand, .. }
            | Element::Segments { src: operand, .. }
            | Element::SeedRandom { src: operand, .. }
            | Element::BitWrite { bit: operand, .. }
            | Element::BitTest { bit: operand, .. }
            | Element::Delay { time: operand }
            | Element::LookUpTable { index: operand, .. }
            | Element::PiecewiseLinear { index: operand, .. }
            | Element::SetPwm { duty: operand, .. }
            | Element::Npulse { count: operand, .. } => vec![operand],
            Element::Pulser { high, low, accel, count, coil: _ } => vec![high, low, accel, count],
            // Device and register are addresses.
            Element::BusTransfer(transfer) => transfer.send.iter_mut().collect(),
            Element::Comment(_) | Element::Contacts { .. } | Element::Coil { .. } | Element::Short | Element::Open => {
                Vec::new()
            }
            Element::Placeholder | Element::MasterRelay | Element::Osr | Element::Osf | Element::Odr | Element::Odf => {
                Vec::new()
            }
            Element::Osl | Element::Osc | Element::Timer { .. } | Element::Res { .. } | Element::Flow { .. } => {
                Vec::new()
            }
            Element::Return | Element::TimeValue { .. } | Element::Random { .. } | Element::Sleep | Element::Lock => {
                Vec::new()
            }
            Element::ClearWatchdog | Element::ShiftRegister { .. } | Element::ReadAdc { .. } => Vec::new(),
            Element::UartRecv { .. } | Element::UartSend { .. } | Element::UartRecvAvail | Element::UartSendReady => {
                Vec::new()
            }
            Element::NpulseOff
            | Element::QuadEncod { .. }
            | Element::Persist { .. }
            | Element::Text { .. }
            | Element::FormattedString { .. }
            | Element::Instruction(_) => Vec::new(),
        }
    }

    fn row(&self) -> ElementFacts<'_> {
        use PowerEffect::{Acts, Decides, Narrows, NoWire, Wire};
        use SymbolKind::{Adc, Counter, Timer, Variable};
        use WriteMoment::{Always, Passing, Powered};
        let row = ElementFacts::new;
        match self {
            Element::Comment(_) => row("COMMENT", NoWire),
            Element::Contacts { name, negated: _, set1: _ } => {
                row("CONTACTS", Narrows).reads(name, kind_by_letter(name))
            }
            // Of several flags the first one counts.
            Element::Coil { name, negated, set, reset, ttrigger } => {
                let latches = !negated && (*set || *reset || *ttrigger == Some(1));
                row("COIL", Acts).writes(name, kind_by_letter(name), if latches { Powered } else { Always })
            }
            Element::Short => row("SHORT", Wire),
            Element::Open => row("OPEN", Narrows),
            Element::Placeholder => row("PLACEHOLDER", Wire),
            Element::MasterRelay => row("MASTER_RELAY", Acts),
            Element::Osr => row("OSR", Decides).with_memory(),
            Element::Osf => row("OSF", Decides).with_memory(),
            Element::Odr => row("ODR", Decides).with_memory().ldmicro5(),
            Element::Odf => row("ODF", Decides).with_memory().ldmicro5(),
            Element::Osl => row("OSL", Decides).with_memory().ldmicro5(),
            Element::Osc => row("OSC", Decides).with_memory().ldmicro5(),
            Element::Timer { kind, name, delay, adjust } => {
                let row = row(write::timer_keyword(*kind), Decides).with_memory().counts(name, Timer).argument(delay);
                let row = match kind {
                    TimerKind::Ton | TimerKind::Tof | TimerKind::Rto => row,
                    TimerKind::Rtl | TimerKind::Tcy | TimerKind::Thi | TimerKind::Tlo => row.ldmicro5(),
                };
                adjust.iter().fold(row, ElementFacts::argument)
            }
            Element::Counter { kind, name, max, init, input: _ } => {
                let row = row(write::counter_keyword(*kind), Decides).with_memory().counts(name, Counter).operand(max);
                let row = if *kind == CounterKind::Ctr { row.ldmicro5() } else { row };
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
            Element::Flow { op, label: _ } => {
                let power = match op {
                    FlowOp::Label => Wire,
                    // A jump back is not taken when the scan has taken all that it may.
                    FlowOp::Goto => Narrows,
                    FlowOp::Gosub | FlowOp::Subprogram | FlowOp::EndSubprogram => Acts,
                };
                row(write::flow_keyword(*op), power).ldmicro5()
            }
            Element::Return => row("RETURN", Acts).ldmicro5(),
            Element::Segments { display, dest, src, common: _ } => {
                let row = row(write::segments_keyword(*display), Acts).writes(dest, Variable, Powered).ldmicro5();
                match src {
                    LadderOperand::Var(name) => row.symbol(name, Variable, true, Some(Powered)),
                    LadderOperand::Const { .. } => row.operand(src),
                }
            }
            // A variable as the time is refused.
            Element::TimeValue { is_scans, dest, time: _ } => {
                row(write::time_value_keyword(*is_scans), Acts).writes(dest, Variable, Powered).ldmicro5()
            }
            Element::Random { dest } => row("RANDOM", Acts).writes(dest, Variable, Powered).with_memory().ldmicro5(),
            Element::SeedRandom { dest: _, src } => row("SEED_RANDOM", Acts).operand(src).ldmicro5(),
            Element::Delay { time } => row("DELAY", Acts).operand(time).ldmicro5(),
            Element::Sleep => row("SLEEP", Acts).ldmicro5(),
            Element::ClearWatchdog => row("CLRWDT", Acts).ldmicro5(),
            Element::Lock => row("LOCK", Acts).ldmicro5(),
            Element::Compare { op, op1, op2 } => row(write::compare_keyword(*op), Narrows).operand(op1).operand(op2),
            // The first stage is the input of the shift register, so it is never written; the last one is
            // never read.
            Element::ShiftRegister { name, stages } => (0..*stages).fold(row("SHIFT_REGISTER", Acts), |row, stage| {
                row.symbol(format!("{name}{stage}"), Variable, stage + 1 < *stages, (stage > 0).then_some(Powered))
            }),
            Element::LookUpTable { dest, index, as_string: _, values, name: _ } => row("LOOK_UP_TABLE", Acts)
                .writes(dest, Variable, Powered)
                .operand(index)
                .constants(values.iter().copied()),
            Element::PiecewiseLinear { dest, index, points, name: _ } => row("PIECEWISE_LINEAR", Acts)
                .writes(dest, Variable, Powered)
                .operand(index)
                .constants(points.iter().flat_map(|point| [point.x, point.y])),
            Element::ReadAdc { name, refs: _ } => {
                row("READ_ADC", Acts).writes(name, Adc, Powered).uses_part(ChipPart::Converter)
            }
            Element::SetPwm { duty, hertz, output: _ } => {
                row("SET_PWM", Acts).operand(duty).argument(hertz).uses_part(ChipPart::Pwm)
            }
            Element::UartRecv { name, rest } => {
                let row = row("UART_RECV", Decides).writes(name, Variable, Passing).uses_part(ChipPart::Receiver);
                if rest.is_some_and(|rest| rest.bytes > 1) { row.with_memory() } else { row }
            }
            Element::UartSend { name, rest: _ } => {
                row("UART_SEND", Decides).with_memory().reads(name, Variable).uses_part(ChipPart::Transmitter)
            }
            Element::UartRecvAvail => row("UART_RECV_AVAIL", Narrows).uses_part(ChipPart::Receiver).ldmicro5(),
            Element::UartSendReady => row("UART_SEND_READY", Narrows).uses_part(ChipPart::Transmitter).ldmicro5(),
            Element::Pulser { high, low, accel, count, coil } => {
                let row = row("PULSER", Decides).with_memory().ldmicro5();
                let row = [high, low, accel, count].into_iter().fold(row, ElementFacts::operand);
                row.writes(coil, kind_by_letter(coil), Always)
            }
            Element::Npulse { count, hertz, coil } => row("NPULSE", Decides)
                .with_memory()
                .ldmicro5()
                .operand(count)
                .argument(hertz)
                .writes(coil, kind_by_letter(coil), Always),
            Element::NpulseOff => row("NPULSE_OFF", Acts).ldmicro5(),
            Element::Stepper { name, max, period, size: _, graph: _, coil } => {
                let [left, scans] = crate::pulse_elements::stepper_counters(name);
                row("STEPPER", Decides)
                    .with_memory()
                    .ldmicro5()
                    .symbol(left, Counter, true, Some(Always))
                    .symbol(scans, Counter, true, Some(Always))
                    .operand(max)
                    .operand(period)
                    .writes(coil, kind_by_letter(coil), Always)
            }
            Element::QuadEncod { counter, interrupt: _, inputs, zero, dir, zero_kind: _, turn: _ } => {
                let row = row("QUAD_ENCOD", Decides).with_memory().ldmicro5();
                let row = row.symbol(counter, Variable, true, Some(Powered));
                let row = inputs.iter().chain(zero).fold(row, |row, name| row.reads(name, kind_by_letter(name)));
                dir.iter().fold(row, |row, name| row.writes(name, kind_by_letter(name), Powered))
            }
            Element::BusTransfer(transfer) => {
                let row = row(transfer.op.keyword(), Acts).uses_part(transfer.op.part()).ldmicro5();
                let row = transfer.send.iter().fold(row, ElementFacts::operand);
                let row = if transfer.op.is_i2c() { row.argument(&transfer.register) } else { row };
                transfer.recv.iter().fold(row, |row, name| row.writes(name, Variable, Powered))
            }
            // PERSIST loads the variable from the EEPROM the first time that it has power.
            Element::Persist { name } => {
                row("PERSIST", Acts).symbol(name, Variable, true, Some(Powered)).uses_part(ChipPart::Eeprom)
            }
            Element::Text { dest: _, var, text: _, quoted: _ } => {
                var.iter().fold(row("STRING", Acts).ldmicro5(), |row, name| row.reads(name, Variable))
            }
            Element::FormattedString { var, text: _, quoted: _ } => {
                let row = row("FORMATTED_STRING", Decides).with_memory().uses_part(ChipPart::Transmitter);
                var.iter().fold(row, |row, name| row.reads(name, Variable))
            }
            Element::Instruction(step) => crate::il::instruction_facts(step),
        }
    }
}
