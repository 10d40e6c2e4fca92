//! From the model to the flat form: names become indices, meanings are chosen, what has none is refused.

use std::collections::HashMap;

use ladder::{CounterKind, Dialect, Element, ElementId, Format, Node, Operand, Program, Symbol, TimerKind};

use crate::Unsupported;
use crate::devices::{self, Devices};
use crate::exec::{Code, Count, Input, Op, Step, Value, cut};

/// Flattens all rungs; the first element without a meaning ends it.
pub(crate) fn flatten(
    program: &Program,
    symbols: &[Symbol],
    by_name: &HashMap<String, usize>,
) -> Result<Code, Unsupported> {
    let widths = symbols.iter().map(|s| if s.kind.is_bit() { 0 } else { 32 - 8 * s.bytes }).collect();
    let code = Code { cut: widths, start: vec![0; symbols.len()], ..Code::default() };
    let mut builder = Builder {
        program,
        symbols,
        by_name,
        code,
        next: ElementId { rung: 0, index: 0 },
        restarts: HashMap::new(),
        devices: Devices::default(),
    };
    builder.devices_and_starts();
    for (number, rung) in (0..).zip(&program.rungs) {
        builder.next = ElementId { rung: number, index: 0 };
        builder.code.steps.push(Step::Rung);
        builder.series(&rung.series, 0)?;
    }
    Ok(builder.code)
}

/// Builds the flat form of one program.
pub(crate) struct Builder<'a> {
    pub program: &'a Program,
    symbols: &'a [Symbol],
    by_name: &'a HashMap<String, usize>,
    pub code: Code,
    /// Identity of the leaf that comes next in text order.
    next: ElementId,
    /// Per counter: its start value, which the first element of its name says.
    restarts: HashMap<&'a str, i32>,
    /// What the elements so far said about the parts that all of them share.
    pub devices: Devices,
}

impl Builder<'_> {
    /// What must be known before the first element: start values and analog inputs.
    fn devices_and_starts(&mut self) {
        for (_, element, _) in self.program.elements() {
            match element {
                Element::Counter { name, init, .. } => {
                    let restart = match init {
                        Some(Operand::Const { value, .. }) => *value,
                        _ => 0,
                    };
                    let Some(&at) = self.by_name.get(name) else { continue };
                    let (Some(width), Some(start)) = (self.code.cut.get(at), self.code.start.get_mut(at)) else {
                        continue;
                    };
                    let restart = cut(restart, *width);
                    *start = *self.restarts.entry(name).or_insert(restart);
                }
                Element::ReadAdc { name, .. } => {
                    self.code.adc.extend(self.by_name.get(name).and_then(|at| u32::try_from(*at).ok()));
                }
                _ => {}
            }
        }
        self.code.adc.sort_unstable();
        self.code.adc.dedup();
    }

    fn series(&mut self, series: &[Node], depth: usize) -> Result<(), Unsupported> {
        for node in series {
            match node {
                Node::Leaf(element, _) => self.leaf(element)?,
                Node::Parallel(branches, _) => {
                    self.code.depth = self.code.depth.max(depth + 1);
                    self.code.steps.push(Step::Split(depth));
                    for (i, branch) in branches.iter().enumerate() {
                        if i > 0 {
                            self.code.steps.push(Step::Branch(depth));
                        }
                        self.series(branch, depth + 1)?;
                    }
                    self.code.steps.push(Step::Join(depth));
                }
            }
        }
        Ok(())
    }

    fn leaf(&mut self, element: &Element) -> Result<(), Unsupported> {
        let id = self.next;
        self.next.index += 1;
        match self.op(element) {
            Ok(Some(op)) => self.code.steps.push(Step::Do(id, op)),
            Ok(None) => {}
            Err(why) => return Err(Unsupported { element: id, text: ladder::element_text(element), why }),
        }
        Ok(())
    }

    /// The meaning of one element, nothing for a comment, or why it has none.
    fn op(&mut self, element: &Element) -> Result<Option<Op>, String> {
        let op = match element {
            Element::Comment(_) => return Ok(None),
            Element::Short => Op::Short,
            Element::Open => Op::Open,
            Element::MasterRelay => Op::MasterRelay,
            Element::Osr => Op::Osr { memory: self.memory() },
            Element::Osf => Op::Osf { memory: self.memory() },
            Element::Contacts { name, negated, set1 } => {
                only_zero("third argument", *set1)?;
                Op::Contact { bit: self.bit(name)?, negated: *negated }
            }
            Element::Coil { name, negated, set, reset, ttrigger } => {
                only_zero("fourth flag", *ttrigger)?;
                if name.starts_with('X') {
                    return Err(format!("a coil drives an output Y or a relay R, and `{name}` is an input"));
                }
                let bit = self.bit(name)?;
                match (negated, set, reset) {
                    (_, false, false) => Op::Coil { bit, negated: *negated },
                    (false, true, false) => Op::SetCoil { bit },
                    (false, false, true) => Op::ClearCoil { bit },
                    _ => return Err("a coil is at most one of negated, set and reset".to_owned()),
                }
            }
            Element::Timer { kind, name, delay, adjust } => {
                let var = self.integer(name)?;
                let preset = self.preset(var, delay, adjust.as_ref())?;
                match kind {
                    TimerKind::Ton => Op::Ton { var, preset },
                    TimerKind::Tof => Op::Tof { var, preset, first: self.memory() },
                    TimerKind::Rto => Op::Rto { var, preset },
                }
            }
            Element::Counter { kind, name, max, init, input } => {
                self.counter(*kind, name, max, init.as_ref(), *input)?
            }
            Element::Res { name } => {
                let src = Value::Const(self.restarts.get(name.as_str()).copied().unwrap_or(0));
                Op::Move { dest: self.integer(name)?, src }
            }
            Element::Move { dest, src } => Op::Move { dest: self.integer(dest)?, src: self.value(src)? },
            Element::Math { op, dest, op1, op2 } => {
                Op::Math { op: *op, dest: self.integer(dest)?, a: self.value(op1)?, b: self.value(op2)? }
            }
            Element::Compare { op, op1, op2 } => Op::Compare { op: *op, a: self.value(op1)?, b: self.value(op2)? },
            Element::Placeholder => return Err("an empty place: the rung is not complete".to_owned()),
            _ => devices::op(self, element)?,
        };
        Ok(Some(op))
    }

    /// A new memory bit, 0 at power-up.
    pub(crate) fn memory(&mut self) -> u32 {
        self.code.memories += 1;
        self.code.memories - 1
    }

    fn bit(&self, name: &str) -> Result<u32, String> {
        match self.find(name)? {
            (index, true) => Ok(index),
            (_, false) => Err(format!("`{name}` is not a bit: bits are named X, Y or R and are no integers elsewhere")),
        }
    }

    /// The index of an integer.
    pub(crate) fn integer(&self, name: &str) -> Result<u32, String> {
        match self.find(name)? {
            (index, false) => Ok(index),
            (_, true) => Err(format!("`{name}` is a bit (a contact, a coil or a pin) and is used as an integer")),
        }
    }

    /// Width of an integer in bytes.
    pub(crate) fn bytes(&self, symbol: u32) -> u8 {
        self.symbols.get(symbol as usize).map_or(0, |s| s.bytes)
    }

    /// Index of a symbol, and whether it is a bit.
    fn find(&self, name: &str) -> Result<(u32, bool), String> {
        let index = self.by_name.get(name).copied();
        let symbol = index.and_then(|i| Some((u32::try_from(i).ok()?, self.symbols.get(i)?.kind.is_bit())));
        symbol.ok_or_else(|| format!("`{name}` is no symbol of the program"))
    }

    /// An operand.
    pub(crate) fn value(&self, operand: &Operand) -> Result<Value, String> {
        match operand {
            Operand::Var(name) => self.integer(name).map(Value::Var),
            Operand::Const { value, .. } => self.constant("an operand", *value).map(Value::Const),
        }
    }

    /// A constant in the range of the dialect; `what` names it in the refusal.
    pub(crate) fn constant(&self, what: &str, value: i64) -> Result<i32, String> {
        let range = match self.program.dialect {
            Dialect::Ldmicro23 => i64::from(i16::MIN)..=i64::from(i16::MAX),
            Dialect::Ldmicro5 => i64::from(i32::MIN)..=i64::from(i32::MAX),
        };
        i32::try_from(value)
            .ok()
            .filter(|_| range.contains(&value))
            .ok_or_else(|| format!("{what} is {value}, wanted {} to {}", range.start(), range.end()))
    }

    /// Refuses what only dialect ldmicro-5 gives a meaning.
    fn only_5(&self, what: &str) -> Result<(), String> {
        match self.program.dialect {
            Dialect::Ldmicro23 => Err(format!("{what} belongs to dialect ldmicro-5")),
            Dialect::Ldmicro5 => Ok(()),
        }
    }

    fn counter(
        &mut self,
        kind: CounterKind,
        name: &str,
        max: &Operand,
        init: Option<&Operand>,
        input: Option<char>,
    ) -> Result<Op, String> {
        let var = self.integer(name)?;
        let max = match max {
            Operand::Const { value, .. } => Value::Const(self.constant("the limit of a counter", *value)?),
            Operand::Var(name) => {
                self.only_5(&format!("the variable `{name}` as the limit of a counter"))?;
                Value::Var(self.integer(name)?)
            }
        };
        let restart = match init {
            None => 0,
            Some(Operand::Const { value, .. }) => self.constant("the start value of a counter", *value)?,
            Some(Operand::Var(name)) => return Err(format!("the variable `{name}` as a start value has no meaning")),
        };
        if restart != 0 {
            self.only_5("a start value other than 0")?;
        }
        let kind_of_input = input.unwrap_or('/');
        if kind_of_input != '/' {
            self.only_5(&format!("input kind `{kind_of_input}`"))?;
        }
        let input = match kind_of_input {
            '/' => Input::Rising,
            '\\' => Input::Falling,
            '-' => Input::High,
            'o' => Input::Low,
            other => return Err(format!("input kind `{other}` has no meaning")),
        };
        let kind = match (kind, self.program.dialect) {
            (CounterKind::Ctu, Dialect::Ldmicro23) => Count::Up,
            (CounterKind::Ctd, Dialect::Ldmicro23) => Count::Down,
            (CounterKind::Ctu, Dialect::Ldmicro5) => Count::UpTo,
            (CounterKind::Ctd, Dialect::Ldmicro5) => Count::DownTo,
            (CounterKind::Ctc, _) => Count::Circular,
        };
        Ok(Op::Count { kind, input, var, max, restart, memory: self.memory() })
    }

    /// P: whole cycles in the delay, and the adjust.
    fn preset(&self, timer: u32, delay: &Operand, adjust: Option<&Operand>) -> Result<i32, String> {
        // Release 2.3 takes one scan off, and LDmicro 5 does so for files of that release.
        let short = self.program.dialect == Dialect::Ldmicro23 || self.program.format == Format::V01;
        let adjust = match adjust {
            None => -i128::from(short),
            Some(Operand::Const { value, .. }) => i128::from(*value),
            Some(Operand::Var(name)) => return Err(format!("the variable `{name}` as an adjust has no meaning")),
        };
        if adjust != -1 {
            self.only_5("an adjust other than -1")?;
        }
        let Operand::Const { value, .. } = delay else {
            return Err("a delay held in a variable has no meaning".to_owned());
        };
        let cycle = self.cycle()?;
        let count = i128::from(*value) / i128::from(cycle) + adjust;
        let most = (1_i128 << (8 * u32::from(self.bytes(timer))).saturating_sub(1)) - 1;
        i32::try_from(count).ok().filter(|_| (1..=most).contains(&count)).ok_or_else(|| {
            let sign = if adjust < 0 { '-' } else { '+' };
            let adjust = adjust.unsigned_abs();
            format!("the timer counts {value} us / {cycle} us {sign} {adjust} = {count} scans, wanted 1 to {most}")
        })
    }

    /// The time of a scan in microseconds, for what counts scans.
    pub(crate) fn cycle(&self) -> Result<u64, String> {
        match self.program.settings.cycle_us {
            0 => Err("it needs a cycle time, and CYCLE is 0 (free running)".to_owned()),
            cycle => Ok(cycle),
        }
    }
}

/// An argument that has a meaning nowhere here must be absent or 0.
pub(crate) fn only_zero(what: &str, found: Option<u32>) -> Result<(), String> {
    match found {
        None | Some(0) => Ok(()),
        Some(n) => Err(format!("its {what} is {n}, which has no meaning here; wanted 0")),
    }
}
