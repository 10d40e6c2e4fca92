//! From the model to the flat form: names become indices, meanings are chosen, what has none is refused.

use std::collections::HashMap;

use ladder::{CounterKind, Dialect, Element, ElementId, Node, Operand, Program, Symbol, TimerKind};

use crate::Unsupported;
use crate::exec::{Op, Step, Value};

/// A flattened program and the sizes of the state that it needs.
pub(crate) struct Flat {
    pub steps: Vec<Step>,
    /// Number of memory bits of elements.
    pub memories: usize,
    /// Deepest nesting of parallel groups.
    pub depth: usize,
}

/// Flattens all rungs; the first element without a meaning ends it.
pub(crate) fn flatten(
    program: &Program,
    symbols: &[Symbol],
    by_name: &HashMap<String, usize>,
) -> Result<Flat, Unsupported> {
    let flat = Flat { steps: Vec::new(), memories: 0, depth: 0 };
    let mut builder = Builder { program, symbols, by_name, flat, next: ElementId { rung: 0, index: 0 } };
    for (number, rung) in (0..).zip(&program.rungs) {
        builder.next = ElementId { rung: number, index: 0 };
        builder.flat.steps.push(Step::Rung);
        builder.series(&rung.series, 0)?;
    }
    Ok(builder.flat)
}

struct Builder<'a> {
    program: &'a Program,
    symbols: &'a [Symbol],
    by_name: &'a HashMap<String, usize>,
    flat: Flat,
    /// Identity of the leaf that comes next in text order.
    next: ElementId,
}

impl Builder<'_> {
    fn series(&mut self, series: &[Node], depth: usize) -> Result<(), Unsupported> {
        for node in series {
            match node {
                Node::Leaf(element, _) => self.leaf(element)?,
                Node::Parallel(branches, _) => {
                    self.flat.depth = self.flat.depth.max(depth + 1);
                    self.flat.steps.push(Step::Split(depth));
                    for (i, branch) in branches.iter().enumerate() {
                        if i > 0 {
                            self.flat.steps.push(Step::Branch(depth));
                        }
                        self.series(branch, depth + 1)?;
                    }
                    self.flat.steps.push(Step::Join(depth));
                }
            }
        }
        Ok(())
    }

    fn leaf(&mut self, element: &Element) -> Result<(), Unsupported> {
        let id = self.next;
        self.next.index += 1;
        match self.op(element) {
            Ok(Some(op)) => self.flat.steps.push(Step::Do(id, op)),
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
                let preset = self.preset(delay, adjust.as_ref())?;
                match kind {
                    TimerKind::Ton => Op::Ton { var, preset },
                    TimerKind::Tof => Op::Tof { var, preset, first: self.memory() },
                    TimerKind::Rto => Op::Rto { var, preset },
                }
            }
            Element::Counter { kind, name, max, init, input } => {
                let var = self.integer(name)?;
                let max = constant("the limit of a counter", max)?;
                if let Some(init) = init
                    && constant("the start value of a counter", init)? != 0
                {
                    return Err("a start value other than 0 belongs to dialect ldmicro-5".to_owned());
                }
                if let Some(kind) = input.filter(|c| *c != '/') {
                    return Err(format!(
                        "input kind `{kind}` belongs to dialect ldmicro-5; counters here count rising edges, `/`"
                    ));
                }
                let memory = self.memory();
                match kind {
                    CounterKind::Ctu => Op::Ctu { var, max, memory },
                    CounterKind::Ctd => Op::Ctd { var, max, memory },
                    CounterKind::Ctc => Op::Ctc { var, max, memory },
                }
            }
            // RES stores 0 when the rung is true, for timers and counters alike.
            Element::Res { name } => Op::Move { dest: self.integer(name)?, src: Value::Const(0) },
            Element::Move { dest, src } => Op::Move { dest: self.integer(dest)?, src: self.value(src)? },
            Element::Math { op, dest, op1, op2 } => {
                Op::Math { op: *op, dest: self.integer(dest)?, a: self.value(op1)?, b: self.value(op2)? }
            }
            Element::Compare { op, op1, op2 } => {
                self.sixteen_bits()?;
                Op::Compare { op: *op, a: self.value(op1)?, b: self.value(op2)? }
            }
            Element::Placeholder => return Err("an empty place: the rung is not complete".to_owned()),
            Element::ShiftRegister { .. }
            | Element::LookUpTable { .. }
            | Element::PiecewiseLinear { .. }
            | Element::ReadAdc { .. }
            | Element::SetPwm { .. }
            | Element::UartRecv { .. }
            | Element::UartSend { .. }
            | Element::Persist { .. }
            | Element::FormattedString { .. } => return Err("this element has no meaning here yet".to_owned()),
        };
        Ok(Some(op))
    }

    /// A new memory bit, 0 at power-up.
    fn memory(&mut self) -> usize {
        self.flat.memories += 1;
        self.flat.memories - 1
    }

    fn bit(&self, name: &str) -> Result<usize, String> {
        match self.find(name)? {
            (index, true) => Ok(index),
            (_, false) => Err(format!("`{name}` is not a bit: bits are named X, Y or R and are no integers elsewhere")),
        }
    }

    fn integer(&self, name: &str) -> Result<usize, String> {
        self.sixteen_bits()?;
        match self.find(name)? {
            (index, false) => Ok(index),
            (_, true) => Err(format!("`{name}` is a bit (a contact, a coil or a pin) and is used as an integer")),
        }
    }

    /// Index of a symbol, and whether it is a bit.
    fn find(&self, name: &str) -> Result<(usize, bool), String> {
        let index = self.by_name.get(name).copied();
        let symbol = index.and_then(|i| Some((i, self.symbols.get(i)?.kind.is_bit())));
        symbol.ok_or_else(|| format!("`{name}` is no symbol of the program"))
    }

    fn value(&self, operand: &Operand) -> Result<Value, String> {
        match operand {
            Operand::Var(name) => self.integer(name).map(Value::Var),
            Operand::Const { .. } => constant("an operand", operand).map(Value::Const),
        }
    }

    /// Whether an integer is what this crate takes it for. Dialect ldmicro-5 chooses a width per variable.
    fn sixteen_bits(&self) -> Result<(), String> {
        match self.program.dialect {
            Dialect::Ldmicro23 => Ok(()),
            Dialect::Ldmicro5 => Err("integers, timers and counters of dialect ldmicro-5 have no meaning here yet; \
                     dialect ldmicro-2.3 has 16 bits everywhere"
                .to_owned()),
        }
    }

    /// P of 2.3: whole cycles in the delay, less one.
    fn preset(&self, delay: &Operand, adjust: Option<&Operand>) -> Result<i16, String> {
        if let Some(adjust) = adjust
            && constant("the adjust of a timer", adjust)? != -1
        {
            return Err("an adjust other than -1 belongs to dialect ldmicro-5".to_owned());
        }
        let Operand::Const { value, .. } = delay else {
            return Err("a delay held in a variable belongs to dialect ldmicro-5".to_owned());
        };
        let cycle = self.program.settings.cycle_us;
        if cycle == 0 {
            return Err("a timer needs a cycle time, and CYCLE is 0 (free running)".to_owned());
        }
        let count = i128::from(*value) / i128::from(cycle) - 1;
        i16::try_from(count)
            .ok()
            .filter(|p| *p >= 1)
            .ok_or_else(|| format!("the timer counts {value} us / {cycle} us - 1 = {count} scans, wanted 1 to 32767"))
    }
}

/// A constant of 16 bits; `what` names it in the refusal.
fn constant(what: &str, operand: &Operand) -> Result<i16, String> {
    match operand {
        Operand::Const { value, text } => {
            i16::try_from(*value).map_err(|_| format!("{what} is {text}, wanted -32768 to 32767"))
        }
        Operand::Var(name) => Err(format!("{what} is the variable `{name}`, which belongs to dialect ldmicro-5")),
    }
}

/// An argument that only dialect ldmicro-5 gives a meaning must be absent or 0.
fn only_zero(what: &str, found: Option<u32>) -> Result<(), String> {
    match found {
        None | Some(0) => Ok(()),
        Some(n) => Err(format!("its {what} is {n}, which has a meaning only in dialect ldmicro-5; wanted 0")),
    }
}
