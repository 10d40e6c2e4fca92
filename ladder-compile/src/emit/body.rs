//! Emits operations as C statements, for the scan of a C program or of a sketch.

use std::collections::BTreeSet;

use ladder::ElementId;

use super::names::comment_text;
use super::tables::{TableElement, table_element};
use crate::ir::{
    ArithmeticOp, BitId, BranchCondition, BusAction, Ir, IrOp, LabelId, LogicOp, RelationOp, WordComparison, WordId,
    WordOperand, min_bytes, shift_count,
};

/// How a source spells each cell: as an expression that can be read and assigned.
pub(super) struct CellSpelling {
    pub bits: Vec<String>,
    pub words: Vec<String>,
    pub tables: Vec<String>,
}

/// Statements of a scan, indented by one level, which read and write `rung`.
pub(super) struct ScanStatements {
    /// Operations before the first rung.
    pub begin: String,
    /// Statements of each rung.
    pub rungs: Vec<String>,
    /// Operations after the last rung.
    pub end: String,
}

impl ScanStatements {
    /// Returns all statements as one text.
    pub(super) fn concatenated(&self) -> String {
        let mut text = self.begin.clone();
        for (number, rung) in (1..).zip(&self.rungs) {
            text += &format!("\n    /* Rung {number} */\n{rung}");
        }
        text + if self.end.is_empty() { "" } else { "\n" } + &self.end
    }
}

/// Adds the labels that jumps within `op` reach.
fn add_jump_targets(op: &IrOp, targets: &mut BTreeSet<LabelId>) {
    match op {
        IrOp::Jump { to, .. } => _ = targets.insert(*to),
        IrOp::If { if_true, if_false, .. } => {
            if_true.iter().chain(if_false).for_each(|op| add_jump_targets(op, targets));
        }
        _ => {}
    }
}

/// Writes the statements of a scan.
pub(super) struct StatementWriter<'a> {
    ir: &'a Ir,
    /// Labels that jumps reach.
    targets: BTreeSet<LabelId>,
    names: &'a CellSpelling,
    text: String,
    depth: usize,
}

impl<'a> StatementWriter<'a> {
    /// Creates a writer that uses the given spelling of cells.
    pub(super) fn new(ir: &'a Ir, names: &'a CellSpelling) -> Self {
        let mut targets = BTreeSet::new();
        let steps = ir.rungs.iter().flat_map(|rung| &rung.steps).map(|step| &step.op);
        steps.chain(&ir.prologue).chain(&ir.epilogue).for_each(|op| add_jump_targets(op, &mut targets));
        StatementWriter { ir, targets, names, text: String::new(), depth: 1 }
    }

    /// Writes the scan between the latching of inputs and the writing of outputs, indented by one level.
    pub(super) fn scan(mut self, texts: &[(ElementId, String)]) -> ScanStatements {
        self.ops(&self.ir.prologue);
        let begin = std::mem::take(&mut self.text);
        let mut rungs = Vec::new();
        let mut texts = texts.iter().peekable();
        for (number, rung) in (0..).zip(&self.ir.rungs) {
            let mut steps = rung.steps.iter().peekable();
            // Operations before the first element, such as the start of the rung, belong to the first
            // element.
            while let Some((id, text)) = texts.next_if(|(id, _)| id.rung == number) {
                self.line(&format!("/* {}: {} */", id.index + 1, comment_text(text)));
                while let Some(step) = steps.next_if(|step| step.element.index <= id.index) {
                    self.op(&step.op);
                }
            }
            steps.for_each(|step| self.op(&step.op));
            rungs.push(std::mem::take(&mut self.text));
        }
        self.ops(&self.ir.epilogue);
        ScanStatements { begin, rungs, end: self.text }
    }

    fn line(&mut self, text: &str) {
        if !text.is_empty() {
            self.text += &"    ".repeat(self.depth);
            self.text += text;
        }
        self.text.push('\n');
    }

    fn ops(&mut self, ops: &[IrOp]) {
        ops.iter().for_each(|op| self.op(op));
    }

    fn block(&mut self, head: &str, ops: &[IrOp]) {
        self.line(&format!("{head} {{"));
        self.depth += 1;
        self.ops(ops);
        self.depth -= 1;
    }

    fn op(&mut self, op: &IrOp) {
        match op {
            IrOp::SetAccumulator(value) => self.line(&format!("rung = {};", u8::from(*value))),
            IrOp::Load { bit, negated } => self.line(&format!("rung = {};", self.bit(*bit, *negated))),
            IrOp::And { bit, negated } => self.line(&format!("rung = rung && {};", self.bit(*bit, *negated))),
            IrOp::Or { bit, negated } => self.line(&format!("rung = rung || {};", self.bit(*bit, *negated))),
            IrOp::Store { bit, negated } => {
                let value = if *negated { "!rung" } else { "rung" };
                self.line(&format!("{} = {value};", self.bit(*bit, false)));
            }
            IrOp::SetBit { bit, value } => self.line(&format!("{} = {};", self.bit(*bit, false), u8::from(*value))),
            IrOp::Rising(bit) => self.edge(*bit, "rung && !was"),
            IrOp::Falling(bit) => self.edge(*bit, "!rung && was"),
            IrOp::AndCompare(compare) => self.line(&format!("rung = rung && {};", self.compare(compare))),
            IrOp::Move { dst, src } => {
                let value = self.narrowed(*dst, *src);
                self.line(&format!("{} = {value};", self.word(*dst)));
            }
            IrOp::Math { op, dst, a, b } => {
                let value = self.math(*op, *dst, *a, *b);
                self.line(&format!("{} = {value};", self.word(*dst)));
            }
            IrOp::Logic { dst, function: is } => {
                let value = match is {
                    LogicOp::Copy(a) => self.bit(*a, false),
                    LogicOp::Not(a) => self.bit(*a, true),
                    LogicOp::And(a, b) => format!("{} && {}", self.bit(*a, false), self.bit(*b, false)),
                    LogicOp::Or(a, b) => format!("{} || {}", self.bit(*a, false), self.bit(*b, false)),
                };
                self.line(&format!("{} = {value};", self.bit(*dst, false)));
            }
            IrOp::Lookup { dst, index, table } => {
                let name = self.names.tables.get(*table as usize).map_or("", String::as_str);
                let element = self.ir.tables.get(*table as usize).map_or(TableElement::Long, table_element);
                let read = format!("{}({name}, {})", element.read(), self.word(*index));
                let value = self.fitted_value(*dst, &read, element.signed_bytes(), element.signed_bytes() <= 2);
                self.line(&format!("{} = {value};", self.word(*dst)));
            }
            IrOp::ReadAdc { dst, input } => {
                let value = self.fitted_value(*dst, &format!("PlcReadAdc({input})"), 2, true);
                self.line(&format!("{} = {value};", self.word(*dst)));
            }
            IrOp::SetPwm { output, duty } => {
                let call = match self.ir.pwms.len() {
                    0 | 1 => "PlcSetPwm(".to_owned(),
                    _ => format!("PlcSetPwmOutput({output}, "),
                };
                match duty {
                    WordOperand::Const(duty) => self.line(&format!("{call}{});", (*duty).clamp(0, 100))),
                    WordOperand::Cell(word) => {
                        let duty = self.word(*word);
                        self.line(&format!("{call}(unsigned char)({duty} < 0 ? 0 : {duty} > 100 ? 100 : {duty}));"));
                    }
                }
            }
            IrOp::Send { value } => self.line(&format!("PlcSendByte({});", self.low_byte(*value))),
            IrOp::WaitSent => self.line("PlcWaitSent();"),
            IrOp::Receive { dst } => {
                self.line("{");
                self.depth += 1;
                self.line("int byte = PlcReceiveByte();");
                self.line("rung = byte >= 0;");
                let value = self.fitted_value(*dst, "byte", 2, true);
                self.line(&format!("if (rung) {} = {value};", self.word(*dst)));
                self.depth -= 1;
                self.line("}");
            }
            IrOp::Transfer { action, register, value, dst } => {
                let (register, value) = (self.low_byte(*register), self.low_byte(*value));
                let call = match action {
                    BusAction::I2cWrite(device) => format!("PlcI2cWrite({device}, {register}, {value})"),
                    BusAction::I2cRead(device) => format!("PlcI2cRead({device}, {register})"),
                    BusAction::Spi => format!("PlcSpi({value})"),
                };
                match dst {
                    Some(dst) => {
                        let value = self.fitted_value(*dst, &call, 2, true);
                        self.line(&format!("{} = {value};", self.word(*dst)));
                    }
                    None if *action == BusAction::Spi => self.line(&format!("(void){call};")),
                    None => self.line(&format!("{call};")),
                }
            }
            IrOp::ReadEeprom { dst, addr } => {
                let bytes = self.ir.bytes(*dst);
                let kind = if bytes > 2 { "plcU32" } else { "unsigned" };
                let cell = |n: u8| {
                    let read = format!("PlcReadEeprom({})", u32::from(*addr) + u32::from(n));
                    if n == 0 { format!("({kind}){read}") } else { format!("({kind}){read} << {}", 8 * n) }
                };
                let cells: Vec<String> = (0..bytes).map(cell).collect();
                self.line(&format!("{} = Plc{}({});", self.word(*dst), 8 * bytes, cells.join(" | ")));
            }
            IrOp::WriteEeprom { src, addr, busy, scans } => self.persist(*src, *addr, *busy, *scans),
            // Timers and counters stay modules only for chips that have such modules.
            IrOp::Module { .. } => self.line("#error \"a timer or counter was left whole\""),
            // A label needs a statement behind it.
            IrOp::Label(label) if self.targets.contains(label) => self.line(&format!("plc_label_{}:;", label.0)),
            // Compilers warn about a label that no jump reaches.
            IrOp::Label(_) => {}
            IrOp::Jump { to, .. } => self.line(&format!("goto plc_label_{};", to.0)),
            IrOp::If { cond, if_true: then, if_false: otherwise } => {
                let holds = match cond {
                    BranchCondition::Acc => "rung".to_owned(),
                    BranchCondition::Bit(bit) => self.bit(*bit, false),
                    BranchCondition::Compare(compare) => self.compare(compare),
                };
                match (then.is_empty(), otherwise.is_empty()) {
                    (true, true) => {}
                    (true, false) => {
                        self.block(&format!("if (!({holds}))"), otherwise);
                        self.line("}");
                    }
                    (false, true) => {
                        self.block(&format!("if ({holds})"), then);
                        self.line("}");
                    }
                    (false, false) => {
                        self.block(&format!("if ({holds})"), then);
                        self.block("} else", otherwise);
                        self.line("}");
                    }
                }
            }
        }
    }

    /// The low byte of a value, 0 to 255.
    fn low_byte(&self, value: WordOperand) -> String {
        match value {
            WordOperand::Const(byte) => format!("{}", byte & 0xFF),
            WordOperand::Cell(_) => self.byte(value, 0),
        }
    }

    /// (rung, memory) := (result, rung).
    fn edge(&mut self, memory: BitId, result: &str) {
        let memory = self.bit(memory, false);
        self.line("{");
        self.depth += 1;
        self.line(&format!("unsigned char was = {memory};"));
        self.line(&format!("{memory} = rung;"));
        self.line(&format!("rung = {result};"));
        self.depth -= 1;
        self.line("}");
    }

    fn persist(&mut self, src: WordId, addr: u16, busy: WordId, scans: i32) {
        for n in 0..self.ir.bytes(src) {
            let at = u32::from(addr) + u32::from(n);
            let byte = self.byte(WordOperand::Cell(src), n);
            let head = if n == 0 { "if" } else { "} else if" };
            self.line(&format!("{head} (PlcReadEeprom({at}) != {byte}) {{"));
            self.depth += 1;
            self.line(&format!("PlcWriteEeprom({at}, {byte});"));
            self.line(&format!("{} = {};", self.word(busy), literal(scans)));
            self.depth -= 1;
        }
        self.line("}");
    }

    fn math(&self, op: ArithmeticOp, dst: WordId, a: WordOperand, b: WordOperand) -> String {
        let width = self.ir.bytes(dst);
        // Compilers warn about constants that wrap.
        if let (WordOperand::Const(a), WordOperand::Const(b)) = (a, b) {
            return literal(wrap_constant(fold_constants(op, a, b, width), width));
        }
        // SDCC 4.2 turns a long that it finds to be zero into an int and passes only two of its four bytes.
        let zero = WordOperand::Const(0);
        let is_zero = match op {
            ArithmeticOp::Sub | ArithmeticOp::Xor => a == b,
            ArithmeticOp::Mul | ArithmeticOp::And => a == zero || b == zero,
            ArithmeticOp::Shr => shift_count(b) >= 8 * usize::from(width),
            ArithmeticOp::Add | ArithmeticOp::Div | ArithmeticOp::Or => false,
        };
        if is_zero {
            return literal(0);
        }
        match op {
            ArithmeticOp::Add
            | ArithmeticOp::Sub
            | ArithmeticOp::Mul
            | ArithmeticOp::And
            | ArithmeticOp::Or
            | ArithmeticOp::Xor => {}
            ArithmeticOp::Shr => {
                let mask =
                    ["0u", "0xFFu", "0xFFFFu", "0xFFFFFFUL", "0xFFFFFFFFUL"].get(usize::from(width)).unwrap_or(&"0u");
                let count = shift_count(b);
                return format!("Plc{}(({} & {mask}) >> {count})", 8 * width, self.unsigned(a, width > 2));
            }
            ArithmeticOp::Div => {
                let wide = if self.ir.width(op, dst, a, b) > 2 { 4 } else { 2 };
                let quotient = format!("PlcDiv{}({}, {})", 8 * wide, self.value(a), self.value(b));
                return self.fitted_value(dst, &quotient, wide, wide == 2);
            }
        };
        // Unsigned arithmetic wraps. Products of shorts do not overflow an int, because the operands are at
        // least `unsigned`.
        let wide = width > 2;
        format!("Plc{}({} {} {})", 8 * width, self.unsigned(a, wide), op.sign(), self.unsigned(b, wide))
    }

    /// Converts a value of `bytes` bytes to the width of the destination. With `short` the expression is no
    /// wider than an int.
    fn fitted_value(&self, dst: WordId, value: &str, bytes: u8, short: bool) -> String {
        let width = self.ir.bytes(dst);
        let cast = if width > 2 { "plcU32" } else { "unsigned" };
        match (width < bytes, short) {
            (false, _) => value.to_owned(),
            (true, _) => format!("Plc{}(({cast}){value})", 8 * width),
        }
    }

    /// Converts `value` to the width of the destination of a move.
    fn narrowed(&self, dst: WordId, value: WordOperand) -> String {
        let width = self.ir.bytes(dst);
        match value {
            WordOperand::Const(constant) => literal(wrap_constant(constant, width)),
            WordOperand::Cell(src) => {
                self.fitted_value(dst, &self.word(src), self.ir.bytes(src), self.ir.bytes(src) <= 2)
            }
        }
    }

    /// Converts an operand to unsigned, for arithmetic that wraps.
    fn unsigned(&self, value: WordOperand, wide: bool) -> String {
        let cast = if wide { "(plcU32)" } else { "(unsigned)" };
        match value {
            WordOperand::Cell(word) => format!("{cast}{}", self.word(word)),
            WordOperand::Const(constant @ 0..=0x7FFF) if !wide => format!("{constant}u"),
            WordOperand::Const(constant) if !wide => format!("{cast}{}", literal(wrap_constant(constant, 2))),
            WordOperand::Const(constant) => format!("{cast}{}", literal(constant)),
        }
    }

    /// Byte `n` of a value, counted from the lowest.
    fn byte(&self, value: WordOperand, n: u8) -> String {
        match (n, value) {
            (0, value) => format!("(unsigned char){}", self.value(value)),
            (_, WordOperand::Cell(word)) if self.ir.bytes(word) > 2 => {
                format!("(unsigned char)((plcU32){} >> {})", self.word(word), 8 * n)
            }
            (_, value) => format!("(unsigned char)((unsigned){} >> {})", self.value(value), 8 * n),
        }
    }

    fn bit(&self, bit: BitId, negated: bool) -> String {
        let name = self.names.bits.get(bit.0 as usize).map_or("", String::as_str);
        format!("{}{name}", if negated { "!" } else { "" })
    }

    fn word(&self, word: WordId) -> String {
        self.names.words.get(word.0 as usize).cloned().unwrap_or_default()
    }

    fn value(&self, value: WordOperand) -> String {
        match value {
            WordOperand::Cell(word) => self.word(word),
            WordOperand::Const(constant) => literal(constant),
        }
    }

    fn compare(&self, compare: &WordComparison) -> String {
        let rel = match compare.rel {
            RelationOp::Eq => "==",
            RelationOp::Ne => "!=",
            RelationOp::Lt => "<",
            RelationOp::Ge => ">=",
        };
        // Compilers warn about comparisons with a constant result.
        let decided = match compare.b {
            WordOperand::Cell(b) => (b == compare.a).then_some(matches!(compare.rel, RelationOp::Eq | RelationOp::Ge)),
            WordOperand::Const(b) => constant_comparison(compare.rel, b, self.ir.bytes(compare.a)),
        };
        if let Some(value) = decided {
            return u8::from(value).to_string();
        }
        format!("{} {rel} {}", self.word(compare.a), self.value(compare.b))
    }
}

/// Result of comparing numbers of `bytes` bytes with `b`, if it is the same for all of them.
fn constant_comparison(rel: RelationOp, b: i32, bytes: u8) -> Option<bool> {
    let least = i32::MIN >> (32 - 8 * u32::from(bytes.clamp(1, 4)));
    let (below, above) = (b < least, b > !least);
    match rel {
        RelationOp::Lt if b == least => Some(false),
        RelationOp::Ge if b == least => Some(true),
        _ if !below && !above => None,
        RelationOp::Eq => Some(false),
        RelationOp::Ne => Some(true),
        RelationOp::Lt => Some(above),
        RelationOp::Ge => Some(below),
    }
}

/// C spelling of a signed constant; the lowest ones need an expression.
pub(super) fn literal(constant: i32) -> String {
    match (constant, min_bytes(constant)) {
        (i32::MIN, _) => "(-2147483647L - 1)".to_owned(),
        (-0x8000, _) => "(-32767 - 1)".to_owned(),
        (_, 1 | 2) => constant.to_string(),
        _ => format!("{constant}L"),
    }
}

/// Low four bytes of the result of an operation on constants.
fn fold_constants(op: ArithmeticOp, a: i32, b: i32, width: u8) -> i32 {
    match (op, b) {
        (ArithmeticOp::And, b) => a & b,
        (ArithmeticOp::Or, b) => a | b,
        (ArithmeticOp::Xor, b) => a ^ b,
        (ArithmeticOp::Shr, b) => {
            let bits = u32::MAX >> (32 - 8 * u32::from(width.clamp(1, 4)));
            (a as u32 & bits).checked_shr(shift_count(WordOperand::Const(b)) as u32).unwrap_or(0) as i32
        }
        (ArithmeticOp::Add, b) => a.wrapping_add(b),
        (ArithmeticOp::Sub, b) => a.wrapping_sub(b),
        (ArithmeticOp::Mul, b) => a.wrapping_mul(b),
        (ArithmeticOp::Div, 0) => {
            if a < 0 {
                1
            } else {
                -1
            }
        }
        (ArithmeticOp::Div, b) => a.wrapping_div(b),
    }
}

/// Low `bytes` bytes of a constant, sign-extended.
fn wrap_constant(constant: i32, bytes: u8) -> i32 {
    let unused = 32 - 8 * u32::from(bytes.clamp(1, 4));
    constant.wrapping_shl(unused) >> unused
}
