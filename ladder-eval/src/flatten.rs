//! From the model to the flat form: names become indices, meanings are chosen, what has none is refused.

use std::borrow::Cow;
use std::collections::HashMap;

use ladder::{
    CounterKind, Element, ElementId, LadderDialect, LadderOperand, LadderProgram, LadderSymbol, LdFormat, RungNode,
    TimerKind,
};

use crate::flat_program::{CountInput, CountMode, ElementOp, FlatProgram, FlatStep, ValueSource, truncate};
use crate::peripheral_ops::{self, DeviceSettings};
use crate::{UnsupportedElement, UnsupportedReason};

/// Flattens all rungs; the first element without a meaning ends it.
pub(crate) fn flatten(
    program: &LadderProgram,
    symbols: &[LadderSymbol],
    by_name: &HashMap<String, usize>,
) -> Result<FlatProgram, UnsupportedElement> {
    let widths = symbols.iter().map(|s| if s.kind.is_bit() { 0 } else { 32 - 8 * s.bytes }).collect();
    let code = FlatProgram { cut_bits: widths, initial_values: vec![0; symbols.len()], ..FlatProgram::default() };
    let mut builder = FlatBuilder {
        program,
        symbols,
        by_name,
        code,
        next: ElementId { rung: 0, index: 0 },
        counter_starts: HashMap::new(),
        devices: DeviceSettings::default(),
    };
    builder.collect_devices_and_starts();
    for (number, rung) in (0..).zip(&program.rungs) {
        builder.next = ElementId { rung: number, index: 0 };
        builder.code.steps.push(FlatStep::Rung);
        builder.flatten_series(&rung.series, 0)?;
    }
    Ok(builder.code)
}

/// Builds the flat form of one program.
pub(crate) struct FlatBuilder<'a> {
    pub program: &'a LadderProgram,
    symbols: &'a [LadderSymbol],
    by_name: &'a HashMap<String, usize>,
    pub code: FlatProgram,
    /// Identity of the leaf that comes next in text order.
    next: ElementId,
    /// Per counter: its start value, which the first element of its name says.
    counter_starts: HashMap<&'a str, i32>,
    /// What the elements so far said about the parts that all of them share.
    pub devices: DeviceSettings,
}

impl FlatBuilder<'_> {
    /// What must be known before the first element: start values and analog inputs.
    fn collect_devices_and_starts(&mut self) {
        for (_, element, _) in self.program.elements() {
            match element {
                Element::Counter { name, init, .. } => {
                    let restart = match init {
                        Some(LadderOperand::Const { value, .. }) => *value,
                        _ => 0,
                    };
                    let Some(&at) = self.by_name.get(name) else { continue };
                    let (Some(width), Some(start)) = (self.code.cut_bits.get(at), self.code.initial_values.get_mut(at))
                    else {
                        continue;
                    };
                    let restart = truncate(restart, *width);
                    *start = *self.counter_starts.entry(name).or_insert(restart);
                }
                Element::ReadAdc { name, .. } => {
                    self.code.adc_symbols.extend(self.by_name.get(name).and_then(|at| u32::try_from(*at).ok()));
                }
                // No other element says anything about its symbols before it is executed.
                _ => {}
            }
        }
        self.code.adc_symbols.sort_unstable();
        self.code.adc_symbols.dedup();
    }

    fn flatten_series(&mut self, series: &[RungNode], depth: usize) -> Result<(), UnsupportedElement> {
        for node in series {
            match node {
                RungNode::Leaf(element, _) => self.flatten_leaf(element)?,
                RungNode::Parallel(branches, _) => {
                    self.code.max_depth = self.code.max_depth.max(depth + 1);
                    self.code.steps.push(FlatStep::Split(depth));
                    for (i, branch) in branches.iter().enumerate() {
                        if i > 0 {
                            self.code.steps.push(FlatStep::Branch(depth));
                        }
                        self.flatten_series(branch, depth + 1)?;
                    }
                    self.code.steps.push(FlatStep::Join(depth));
                }
            }
        }
        Ok(())
    }

    fn flatten_leaf(&mut self, element: &Element) -> Result<(), UnsupportedElement> {
        let id = self.next;
        self.next.index += 1;
        match self.element_op(element) {
            Ok(Some(op)) => self.code.steps.push(FlatStep::Do(id, op)),
            Ok(None) => {}
            Err(why) => return Err(UnsupportedElement { element: id, text: ladder::element_text(element), why }),
        }
        Ok(())
    }

    /// The meaning of one element, nothing for a comment, or why it has none.
    fn element_op(&mut self, element: &Element) -> Result<Option<ElementOp>, UnsupportedReason> {
        let facts = element.facts();
        if facts.needs_ldmicro5 {
            self.require_dialect_5(facts.keyword)?;
        }
        let op = match element {
            Element::Comment(_) => return Ok(None),
            Element::Short => ElementOp::Short,
            Element::Open => ElementOp::Open,
            Element::MasterRelay => ElementOp::MasterRelay,
            Element::Osr => ElementOp::Osr { memory: self.new_memory() },
            Element::Osf => ElementOp::Osf { memory: self.new_memory() },
            Element::Contacts { name, negated, set1 } => {
                require_absent_or_zero("third argument", *set1)?;
                ElementOp::Contact { bit: self.bit_index(name)?, negated: *negated }
            }
            Element::Coil { name, negated, set, reset, ttrigger } => {
                require_absent_or_zero("fourth flag", *ttrigger)?;
                if name.starts_with('X') {
                    return Err(UnsupportedReason::CoilOfInput { name: name.clone() });
                }
                let bit = self.bit_index(name)?;
                match (negated, set, reset) {
                    (_, false, false) => ElementOp::Coil { bit, negated: *negated },
                    (false, true, false) => ElementOp::SetCoil { bit },
                    (false, false, true) => ElementOp::ClearCoil { bit },
                    _ => return Err(UnsupportedReason::ConflictingCoilModes),
                }
            }
            Element::Timer { kind, name, delay, adjust } => {
                let var = self.integer_index(name)?;
                let preset = self.timer_preset(var, delay, adjust.as_ref())?;
                match kind {
                    TimerKind::Ton => ElementOp::Ton { var, preset },
                    TimerKind::Tof => ElementOp::Tof { var, preset, first: self.new_memory() },
                    TimerKind::Rto => ElementOp::Rto { var, preset },
                }
            }
            Element::Counter { kind, name, max, init, input } => {
                self.counter_op(*kind, name, max, init.as_ref(), *input)?
            }
            Element::Res { name } => {
                let src = ValueSource::Const(self.counter_starts.get(name.as_str()).copied().unwrap_or(0));
                ElementOp::Move { dest: self.integer_index(name)?, src }
            }
            Element::Move { dest, src } => {
                ElementOp::Move { dest: self.integer_index(dest)?, src: self.operand_source(src)? }
            }
            Element::Math { op, dest, op1, op2 } => ElementOp::Math {
                op: *op,
                dest: self.integer_index(dest)?,
                a: self.operand_source(op1)?,
                b: self.operand_source(op2)?,
            },
            Element::Unary { op, dest, src } => {
                let (dest, bits) = (self.integer_index(dest)?, self.operand_bits(src)?);
                ElementOp::Unary { op: *op, dest, src: self.operand_source(src)?, bits }
            }
            Element::Shift { op, dest, src, count } => {
                let (dest, bits) = (self.integer_index(dest)?, self.operand_bits(src)?);
                if let LadderOperand::Const { value, .. } = count
                    && !(0..=i64::from(bits)).contains(value)
                {
                    return Err(UnsupportedReason::ShiftOutOfRange { count: *value, bits });
                }
                let (src, count) = (self.operand_source(src)?, self.operand_source(count)?);
                ElementOp::ShiftBits { op: *op, dest, src, bits, count }
            }
            Element::BitWrite { name, bit, value } => {
                ElementOp::WriteBit { var: self.integer_index(name)?, bit: self.operand_source(bit)?, value: *value }
            }
            Element::BitTest { name, bit, value } => {
                ElementOp::TestBit { var: self.integer_index(name)?, bit: self.operand_source(bit)?, value: *value }
            }
            Element::Bus { dest, src, targets } => {
                // With every bit in its own place all bytes are moved.
                let (dest, src) = (self.integer_index(dest)?, self.operand_source(src)?);
                match targets {
                    [0, 1, 2, 3, 4, 5, 6, 7] => ElementOp::Move { dest, src },
                    _ => ElementOp::Bus { dest, src, targets: *targets },
                }
            }
            Element::Compare { op, op1, op2 } => {
                ElementOp::Compare { op: *op, a: self.operand_source(op1)?, b: self.operand_source(op2)? }
            }
            Element::Placeholder => return Err(UnsupportedReason::EmptyPlace),
            Element::ShiftRegister { .. }
            | Element::LookUpTable { .. }
            | Element::PiecewiseLinear { .. }
            | Element::ReadAdc { .. }
            | Element::SetPwm { .. }
            | Element::UartRecv { .. }
            | Element::UartSend { .. }
            | Element::Persist { .. }
            | Element::FormattedString { .. } => peripheral_ops::peripheral_op(self, element)?,
        };
        Ok(Some(op))
    }

    /// A new memory bit, 0 at power-up.
    pub(crate) fn new_memory(&mut self) -> u32 {
        self.code.memories += 1;
        self.code.memories - 1
    }

    fn bit_index(&self, name: &str) -> Result<u32, UnsupportedReason> {
        match self.find_symbol(name)? {
            (index, true) => Ok(index),
            (_, false) => Err(UnsupportedReason::NotABit { name: name.to_owned() }),
        }
    }

    /// The index of an integer.
    pub(crate) fn integer_index(&self, name: &str) -> Result<u32, UnsupportedReason> {
        match self.find_symbol(name)? {
            (index, false) => Ok(index),
            (_, true) => Err(UnsupportedReason::NotAnInteger { name: name.to_owned() }),
        }
    }

    /// Width of an integer in bytes.
    pub(crate) fn integer_bytes(&self, symbol: u32) -> u8 {
        self.symbols.get(symbol as usize).map_or(0, |s| s.bytes)
    }

    /// Index of a symbol, and whether it is a bit.
    fn find_symbol(&self, name: &str) -> Result<(u32, bool), UnsupportedReason> {
        let index = self.by_name.get(name).copied();
        let symbol = index.and_then(|i| Some((u32::try_from(i).ok()?, self.symbols.get(i)?.kind.is_bit())));
        symbol.ok_or_else(|| UnsupportedReason::UnknownSymbol { name: name.to_owned() })
    }

    /// An operand.
    pub(crate) fn operand_source(&self, operand: &LadderOperand) -> Result<ValueSource, UnsupportedReason> {
        match operand {
            LadderOperand::Var(name) => self.integer_index(name).map(ValueSource::Var),
            LadderOperand::Const { value, .. } => self.checked_constant("an operand", *value).map(ValueSource::Const),
        }
    }

    /// The width of an operand in bits: a constant has the fewest bytes that hold it.
    fn operand_bits(&self, operand: &LadderOperand) -> Result<u32, UnsupportedReason> {
        match operand {
            LadderOperand::Var(name) => Ok(8 * u32::from(self.integer_bytes(self.integer_index(name)?))),
            LadderOperand::Const { value, .. } => {
                let holds = |bits: &u32| (-(1 << (bits - 1))..1_i64 << (bits - 1)).contains(value);
                Ok([8, 16, 24].into_iter().find(holds).unwrap_or(32))
            }
        }
    }

    /// A constant in the range of the dialect; `what` names it in the refusal.
    pub(crate) fn checked_constant(&self, what: &'static str, value: i64) -> Result<i32, UnsupportedReason> {
        let range = match self.program.dialect {
            LadderDialect::Ldmicro23 => i64::from(i16::MIN)..=i64::from(i16::MAX),
            LadderDialect::Ldmicro5 => i64::from(i32::MIN)..=i64::from(i32::MAX),
        };
        i32::try_from(value).ok().filter(|_| range.contains(&value)).ok_or_else(|| {
            UnsupportedReason::ConstantOutOfRange { what, value, low: *range.start(), high: *range.end() }
        })
    }

    /// Refuses what only dialect ldmicro-5 gives a meaning.
    fn require_dialect_5(&self, feature: impl Into<Cow<'static, str>>) -> Result<(), UnsupportedReason> {
        match self.program.dialect {
            LadderDialect::Ldmicro23 => Err(UnsupportedReason::NeedsDialect5 { feature: feature.into() }),
            LadderDialect::Ldmicro5 => Ok(()),
        }
    }

    fn counter_op(
        &mut self,
        kind: CounterKind,
        name: &str,
        max: &LadderOperand,
        init: Option<&LadderOperand>,
        input: Option<char>,
    ) -> Result<ElementOp, UnsupportedReason> {
        let var = self.integer_index(name)?;
        let max = match max {
            LadderOperand::Const { value, .. } => {
                ValueSource::Const(self.checked_constant("the limit of a counter", *value)?)
            }
            LadderOperand::Var(name) => {
                self.require_dialect_5(format!("the variable `{name}` as the limit of a counter"))?;
                ValueSource::Var(self.integer_index(name)?)
            }
        };
        let restart = match init {
            None => 0,
            Some(LadderOperand::Const { value, .. }) => {
                self.checked_constant("the start value of a counter", *value)?
            }
            Some(LadderOperand::Var(name)) => {
                return Err(UnsupportedReason::VariableAs { name: name.clone(), role: "a start value" });
            }
        };
        if restart != 0 {
            self.require_dialect_5("a start value other than 0")?;
        }
        let kind_of_input = input.unwrap_or('/');
        if kind_of_input != '/' {
            self.require_dialect_5(format!("input kind `{kind_of_input}`"))?;
        }
        let input = match kind_of_input {
            '/' => CountInput::Rising,
            '\\' => CountInput::Falling,
            '-' => CountInput::High,
            'o' => CountInput::Low,
            other => return Err(UnsupportedReason::UnknownInputKind { kind: other }),
        };
        let kind = match (kind, self.program.dialect) {
            (CounterKind::Ctu, LadderDialect::Ldmicro23) => CountMode::Up,
            (CounterKind::Ctd, LadderDialect::Ldmicro23) => CountMode::Down,
            (CounterKind::Ctu, LadderDialect::Ldmicro5) => CountMode::UpTo,
            (CounterKind::Ctd, LadderDialect::Ldmicro5) => CountMode::DownTo,
            (CounterKind::Ctc, _) => CountMode::Circular,
        };
        Ok(ElementOp::Count { kind, input, var, max, restart, memory: self.new_memory() })
    }

    /// P: whole cycles in the delay, and the adjust.
    fn timer_preset(
        &self,
        timer: u32,
        delay: &LadderOperand,
        adjust: Option<&LadderOperand>,
    ) -> Result<i32, UnsupportedReason> {
        // Release 2.3 takes one scan off, and LDmicro 5 does so for files of that release.
        let short = self.program.dialect == LadderDialect::Ldmicro23 || self.program.format == LdFormat::V01;
        let adjust = match adjust {
            None => -i128::from(short),
            Some(LadderOperand::Const { value, .. }) => i128::from(*value),
            Some(LadderOperand::Var(name)) => {
                return Err(UnsupportedReason::VariableAs { name: name.clone(), role: "an adjust" });
            }
        };
        if adjust != -1 {
            self.require_dialect_5("an adjust other than -1")?;
        }
        let LadderOperand::Const { value, .. } = delay else {
            return Err(UnsupportedReason::DelayInVariable);
        };
        let cycle = self.cycle_us()?;
        let count = i128::from(*value) / i128::from(cycle) + adjust;
        let most = (1_i128 << (8 * u32::from(self.integer_bytes(timer))).saturating_sub(1)) - 1;
        i32::try_from(count).ok().filter(|_| (1..=most).contains(&count)).ok_or(UnsupportedReason::TimerOutOfRange {
            delay_us: *value,
            cycle_us: cycle,
            adjust,
            scans: count,
            most,
        })
    }

    /// The time of a scan in microseconds, for what counts scans.
    pub(crate) fn cycle_us(&self) -> Result<u64, UnsupportedReason> {
        match self.program.settings.cycle_us {
            0 => Err(UnsupportedReason::NoCycleTime),
            cycle => Ok(cycle),
        }
    }
}

/// An argument that has a meaning nowhere here must be absent or 0.
pub(crate) fn require_absent_or_zero(what: &'static str, found: Option<u32>) -> Result<(), UnsupportedReason> {
    match found {
        None | Some(0) => Ok(()),
        Some(value) => Err(UnsupportedReason::ArgumentNotZero { what, value }),
    }
}
