//! Lowers serial line, strings, converter and EEPROM.

use ladder::format::{StringPiece, split_format_string};
use ladder::{ChipPart, CompareOp, Element, LadderProgram, ProgramElement, SerialTransfer};

use super::flow::HeldScan;
use super::{Lowering, if_accumulator, step_word};
use crate::ir::{
    ArithmeticOp, BitId, BitRole, BranchCondition, IrOp, JumpKind, RelationOp, WordComparison, WordId, WordOperand,
    WordRole, min_bytes,
};

/// Time in microseconds to write a byte to the EEPROM, including all overhead of a chip.
const EEPROM_US: u64 = 10_000;

/// Bits on the line per byte, times microseconds per second.
const BYTE_US: u64 = 10_000_000;

/// How the program knows that the transmitter is busy: a bit if a byte takes one scan, else the number of
/// remaining scans.
#[derive(Debug, Clone, Copy)]
pub(super) enum TransmitterBusy {
    /// This bit is 1 after a byte was sent in this scan.
    Bit(BitId),
    /// This word counts the remaining scans; a byte takes the given number of scans.
    Scans(WordId, i32),
}

/// EEPROM cells of every PERSIST, in text order: address and number of bytes. They are contiguous.
#[must_use]
pub fn eeprom_cells(program: &LadderProgram) -> Vec<(u16, u8)> {
    let symbols = program.symbols();
    let mut next = 0u16;
    let mut cells = Vec::new();
    for ProgramElement { element, .. } in program.elements() {
        if let Element::Persist { name } = element {
            let bytes = symbols.iter().find(|s| s.name == *name).map_or(2, |s| s.bytes);
            cells.push((next, bytes));
            next = next.saturating_add(bytes.into());
        }
    }
    cells
}

impl Lowering<'_> {
    /// Determines which peripherals the program uses, and adds their operations before and after the rungs.
    pub(super) fn set_up_peripherals(&mut self) {
        let program = self.program;
        let settings = &program.settings;
        let cycle = settings.cycle_us.max(1);
        self.ir.uart.send = program.uses_part(ChipPart::Transmitter);
        self.ir.uart.receive = program.uses_part(ChipPart::Receiver);
        if program.elements().any(|ProgramElement { element, .. }| matches!(element, Element::UartRecvAvail)) {
            let word = self.new_word_cell("received".to_owned(), WordRole::Memory, 2, 0);
            let waits = self.new_bit("byte waits".to_owned(), BitRole::Memory);
            let take = vec![IrOp::Receive { dst: word }, IrOp::Store { bit: waits, negated: false }];
            let cond = BranchCondition::Bit(waits);
            self.ir.prologue.push(IrOp::If { cond, if_true: Vec::new(), if_false: take });
            self.received = Some((word, waits));
        }
        self.set_up_buses();
        self.set_up_pwm();
        if self.ir.uart.send {
            // The checks refuse a program without a baud rate or a cycle.
            let bits = settings.baud.unwrap_or(1).max(1).saturating_mul(cycle);
            let scans = i32::try_from(BYTE_US.div_ceil(bits)).unwrap_or(i32::MAX).max(1);
            self.transmitter_busy = Some(if scans == 1 {
                let bit = self.new_bit("busy".to_owned(), BitRole::Temporary);
                self.ir.prologue.push(IrOp::SetBit { bit, value: false });
                TransmitterBusy::Bit(bit)
            } else {
                let word = self.new_word_cell("busy".to_owned(), WordRole::Memory, min_bytes(scans), 0);
                self.ir.prologue.push(count_down(word));
                TransmitterBusy::Scans(word, scans)
            });
        }
        if let Some(&(addr, bytes)) = eeprom_cells(program).last() {
            self.ir.eeprom_bytes = addr.saturating_add(bytes.into());
            let scans = i32::try_from(EEPROM_US.div_ceil(cycle)).unwrap_or(i32::MAX).max(1);
            let role = if scans == 1 { WordRole::Temporary } else { WordRole::Memory };
            let word = self.new_word_cell("writing".to_owned(), role, min_bytes(scans), 0);
            self.ir.prologue.push(match scans {
                1 => IrOp::Move { dst: word, src: WordOperand::Const(0) },
                _ => count_down(word),
            });
            self.eeprom_busy = Some((word, scans));
        }
    }

    /// Lowers READ_ADC.
    pub(super) fn read_adc(&mut self, name: &str, reference: u8) {
        let dst = self.word(name);
        let known = self.ir.adcs.iter().position(|other| other == name);
        let input = known.unwrap_or_else(|| {
            self.ir.adcs.push(name.to_owned());
            self.ir.adc_references.push(reference);
            self.ir.adcs.len() - 1
        });
        self.push(if_accumulator(vec![IrOp::ReadAdc { dst, input: input as u32 }]));
    }

    /// Executes `then`, which ends with a byte for the transmitter, if the transmitter is free.
    fn if_transmitter_free(&self, mut then: Vec<IrOp>) -> Vec<IrOp> {
        match self.transmitter_busy {
            Some(TransmitterBusy::Bit(bit)) => {
                then.push(IrOp::SetBit { bit, value: true });
                vec![IrOp::If { cond: BranchCondition::Bit(bit), if_true: Vec::new(), if_false: then }]
            }
            Some(TransmitterBusy::Scans(word, scans)) => {
                then.push(IrOp::Move { dst: word, src: WordOperand::Const(scans) });
                vec![IrOp::If { cond: is_zero(word), if_true: then, if_false: Vec::new() }]
            }
            None => Vec::new(),
        }
    }

    /// Lowers UART_SEND.
    pub(super) fn send(&mut self, name: &str, SerialTransfer { bytes, wait }: SerialTransfer) {
        let word = self.word(name);
        if wait != 0 {
            return self.send_at_once(word, bytes as i32);
        }
        if bytes > 1 {
            self.send_bytes(word, bytes as i32);
        } else {
            let ops = self.if_transmitter_free(vec![IrOp::Send { value: WordOperand::Cell(word) }]);
            self.push(if_accumulator(ops));
        }
        self.load_busy();
    }

    /// acc := the transmitter is busy.
    fn load_busy(&mut self) {
        match self.transmitter_busy {
            Some(TransmitterBusy::Bit(bit)) => self.push(IrOp::Load { bit, negated: false }),
            Some(TransmitterBusy::Scans(word, _)) => {
                self.push(IrOp::SetAccumulator(true));
                self.push(IrOp::AndCompare(not_zero(word)));
            }
            None => {}
        }
    }

    /// Sends all bytes of a word in this scan, the lowest first, and for a single byte waits until it has
    /// gone.
    fn send_at_once(&mut self, word: WordId, bytes: i32) {
        self.ir.uart.waits = true;
        let (is_busy, set_busy) = match self.transmitter_busy {
            Some(TransmitterBusy::Bit(bit)) => (BranchCondition::Bit(bit), IrOp::SetBit { bit, value: bytes > 1 }),
            Some(TransmitterBusy::Scans(dst, scans)) => {
                let src = WordOperand::Const(if bytes > 1 { scans } else { 0 });
                (BranchCondition::Compare(not_zero(dst)), IrOp::Move { dst, src })
            }
            None => return,
        };
        let wait = IrOp::If { cond: is_busy, if_true: vec![IrOp::WaitSent], if_false: Vec::new() };
        if bytes == 1 {
            self.push(wait);
            let send = IrOp::Send { value: WordOperand::Cell(word) };
            self.push(if_accumulator(vec![send, IrOp::WaitSent]));
            self.push(set_busy);
            return self.push(IrOp::SetAccumulator(false));
        }
        let rest = self.temporary("sent", self.ir.bytes(word));
        let mut ops = vec![wait, IrOp::Move { dst: rest, src: WordOperand::Cell(word) }];
        for n in 0..bytes {
            if n > 0 {
                let (a, b) = (WordOperand::Cell(rest), WordOperand::Const(8));
                ops.extend([IrOp::WaitSent, IrOp::Math { op: ArithmeticOp::Shr, dst: rest, a, b }]);
            }
            ops.push(IrOp::Send { value: WordOperand::Cell(rest) });
        }
        ops.push(set_busy);
        self.push(if_accumulator(ops));
        self.load_busy();
    }

    /// Sends the bytes of a word one by one, the lowest first, each as it is when its turn comes.
    fn send_bytes(&mut self, word: WordId, bytes: i32) {
        let pending = self.new_bit(self.element_name("sends"), BitRole::Memory);
        let number = self.new_word_cell(self.element_name("byte"), WordRole::Memory, 1, 0);
        let value = self.temporary("sent", self.ir.bytes(word));
        let mut shift = Vec::new();
        for n in (1..bytes).rev() {
            let mut down = vec![IrOp::Math {
                op: ArithmeticOp::Shr,
                dst: value,
                a: WordOperand::Cell(value),
                b: WordOperand::Const(8),
            }];
            down.append(&mut shift);
            shift = self.if_comparison(CompareOp::Geq, number.into(), WordOperand::Const(n), down, Vec::new());
        }
        let mut turn = vec![IrOp::Move { dst: value, src: WordOperand::Cell(word) }];
        turn.append(&mut shift);
        turn.push(IrOp::Send { value: WordOperand::Cell(value) });
        turn.push(step_word(number, ArithmeticOp::Add));
        let end =
            vec![IrOp::Move { dst: number, src: WordOperand::Const(0) }, IrOp::SetBit { bit: pending, value: false }];
        turn.extend(self.if_comparison(CompareOp::Geq, number.into(), WordOperand::Const(bytes), end, Vec::new()));
        self.push(if_accumulator(vec![IrOp::SetBit { bit: pending, value: true }]));
        let if_true = self.if_transmitter_free(turn);
        self.push(IrOp::If { cond: BranchCondition::Bit(pending), if_true, if_false: Vec::new() });
    }

    /// Lowers UART_RECV.
    pub(super) fn receive(&mut self, name: &str, SerialTransfer { bytes, .. }: SerialTransfer) {
        let name = self.word(name);
        if let Some(held) = self.held_scan() {
            return self.receive_all(name, bytes, held);
        }
        let dst = if bytes > 1 { self.temporary("received", bytes as u8) } else { name };
        let mut ops = self.take_byte(dst);
        if bytes > 1 {
            let word = self.new_word_cell(self.element_name("joined"), WordRole::Memory, bytes as u8, 0);
            ops.push(if_accumulator(self.join_byte(name, dst, (word, bytes))));
        }
        self.push(if_accumulator(ops));
    }

    /// acc := a byte waits; dst := the byte. A program that tests whether a byte waits has taken it from the
    /// receiver before the rungs.
    fn take_byte(&self, dst: WordId) -> Vec<IrOp> {
        match self.received {
            None => vec![IrOp::Receive { dst }],
            Some((byte, bit)) => vec![IrOp::If {
                cond: BranchCondition::Bit(bit),
                if_true: vec![IrOp::Move { dst, src: WordOperand::Cell(byte) }, IrOp::SetBit { bit, value: false }],
                if_false: vec![IrOp::SetAccumulator(false)],
            }],
        }
    }

    /// Lowers UART_RECV that holds the scan: with its first byte the scan ends, the following ones only take
    /// bytes, and the one with the last goes on behind the element.
    fn receive_all(&mut self, name: WordId, bytes: u32, held: HeldScan) {
        // One byte more, so that the number has no sign.
        let width = (bytes as u8 + 1).min(4);
        let byte = self.temporary("received", width);
        let joined = self.new_word_cell(self.element_name("joined"), WordRole::Memory, width, 0);
        let took = self.new_bit(self.element_name("took"), BitRole::Memory);
        let end = IrOp::Jump { to: held.end, kind: JumpKind::Forward };
        self.push(if_accumulator(self.take_byte(byte)));
        self.push(IrOp::Store { bit: took, negated: false });
        let join = self.join_byte(name, byte, (joined, bytes));
        let mut first = join.clone();
        first.extend([IrOp::SetBit { bit: held.bit, value: true }, end.clone()]);
        self.push(IrOp::If { cond: BranchCondition::Bit(took), if_true: first, if_false: Vec::new() });
        self.push(IrOp::Jump { to: held.behind, kind: JumpKind::Forward });
        self.push(IrOp::Label(held.resume));
        self.push(IrOp::SetAccumulator(true));
        self.take_byte(byte).into_iter().for_each(|op| self.push(op));
        self.push(if_accumulator(join));
        self.push(IrOp::Store { bit: took, negated: false });
        self.push(IrOp::If { cond: BranchCondition::Bit(took), if_true: Vec::new(), if_false: vec![end] });
        self.push(IrOp::SetBit { bit: held.bit, value: false });
        self.push(IrOp::Label(held.behind));
        self.push(IrOp::Load { bit: took, negated: false });
    }

    /// Puts a byte on top of those that came before it; the word gets them once all have come.
    fn join_byte(&mut self, word: WordId, byte: WordId, (joined, bytes): (WordId, u32)) -> Vec<IrOp> {
        let number = self.new_word_cell(self.element_name("byte"), WordRole::Memory, 1, 0);
        let math = |op, dst, a, b| IrOp::Math { op, dst, a: WordOperand::Cell(a), b };
        let mut ops = vec![
            math(ArithmeticOp::Shr, joined, joined, WordOperand::Const(8)),
            math(ArithmeticOp::Mul, byte, byte, WordOperand::Const(1 << (8 * (bytes - 1)))),
            math(ArithmeticOp::Or, joined, joined, WordOperand::Cell(byte)),
            step_word(number, ArithmeticOp::Add),
        ];
        let whole = vec![
            IrOp::Move { dst: word, src: WordOperand::Cell(joined) },
            IrOp::Move { dst: number, src: WordOperand::Const(0) },
        ];
        let parts = vec![IrOp::SetAccumulator(false)];
        let count = WordOperand::Const(bytes as i32);
        ops.extend(self.if_comparison(CompareOp::Geq, number.into(), count, whole, parts));
        ops
    }

    /// Lowers UART_RECV_AVAIL.
    pub(super) fn test_received(&mut self) {
        if let Some((_, bit)) = self.received {
            self.push(IrOp::And { bit, negated: false });
        }
    }

    /// Lowers UART_SEND_READY.
    pub(super) fn test_transmitter(&mut self) {
        match self.transmitter_busy {
            Some(TransmitterBusy::Bit(bit)) => self.push(IrOp::And { bit, negated: true }),
            Some(TransmitterBusy::Scans(a, _)) => {
                let free = WordComparison { a, rel: RelationOp::Eq, b: WordOperand::Const(0) };
                self.push(IrOp::AndCompare(free));
            }
            None => {}
        }
    }

    /// Lowers FORMATTED_STRING: one character in every scan in which the transmitter is free.
    ///
    /// `left` counts the remaining characters, so it is also the index into a table that holds them in
    /// reverse order.
    pub(super) fn send_string(&mut self, var: Option<&str>, text: &str, quoted: bool) {
        // The checks refuse texts with invalid escapes.
        let pieces = split_format_string(text, quoted).unwrap_or_default();
        let count = pieces.len() as i32;
        if pieces.is_empty() {
            return self.push(IrOp::SetAccumulator(false));
        }
        let memory = self.new_memory();
        let left = self.new_word_cell(self.element_name("left"), WordRole::Memory, min_bytes(count), 0);
        let byte = self.temporary("byte", 1);
        let plain: Vec<i32> =
            pieces.iter().rev().map(|piece| if let StringPiece::Byte(b) = piece { (*b).into() } else { 32 }).collect();
        let name = self.element_name("text");
        let table = self.table(name, plain);
        let mut start = vec![IrOp::Move { dst: left, src: WordOperand::Const(count) }];
        let mut next = vec![step_word(left, ArithmeticOp::Sub), IrOp::Lookup { dst: byte, index: left, table }];
        if let Some(var) = var {
            next.extend(self.send_number(&pieces, (left, byte), var, &mut start));
        }
        next.push(IrOp::Send { value: WordOperand::Cell(byte) });
        let mut sending = self.if_transmitter_free(next);
        let more = IrOp::AndCompare(not_zero(left));
        if let Some(IrOp::If { if_true: then, if_false: otherwise, .. }) = sending.first_mut() {
            if otherwise.is_empty() { then } else { otherwise }.push(more.clone());
        }
        self.push(IrOp::Rising(memory));
        self.push(if_accumulator(start));
        self.push(IrOp::SetAccumulator(true));
        self.push(more);
        self.push(if_accumulator(sending));
    }

    /// Lowers the digits of a number in the text: sets `byte` to the character of a digit, if it is not the
    /// space of the table.
    ///
    /// Adds to `start` the operations that begin a new transmission.
    fn send_number(
        &mut self,
        pieces: &[StringPiece],
        (left, byte): (WordId, WordId),
        var: &str,
        start: &mut Vec<IrOp>,
    ) -> Vec<IrOp> {
        let places: Vec<i32> = (0..)
            .zip(pieces.iter().rev())
            .filter(|(_, p)| matches!(p, StringPiece::Digit { .. }))
            .map(|(n, _)| n)
            .collect();
        let (Some(&last), Some(&first)) = (places.first(), places.last()) else { return Vec::new() };
        let signed = pieces.contains(&StringPiece::Sign);
        let var = self.word(var);
        let bytes = self.ir.bytes(var);
        let rest = if first == last && !signed {
            var
        } else {
            self.new_word_cell(self.element_name("rest"), WordRole::Memory, bytes, 0)
        };
        let at = |op, place: i32| {
            move |lower: &Self, then, otherwise| {
                lower.if_comparison(op, WordOperand::Cell(left), WordOperand::Const(place), then, otherwise)
            }
        };
        let character = |from: WordId| IrOp::Math {
            op: ArithmeticOp::Add,
            dst: byte,
            a: WordOperand::Cell(from),
            b: WordOperand::Const(48),
        };
        let ones = vec![character(rest)];
        let mut digits = ones;
        if first != last {
            let leading = self.new_bit(self.element_name("leading"), BitRole::Memory);
            start.push(IrOp::SetBit { bit: leading, value: true });
            let powers = self.table("powers of ten".to_owned(), vec![10, 100, 1000, 10_000]);
            let (place, power) = (self.temporary("place", min_bytes(first)), self.temporary("power", 2));
            let quotient = self.temporary("quotient", bytes);
            let product = self.temporary("product", bytes);
            let math = |op, dst, a, b| IrOp::Math { op, dst, a: WordOperand::Cell(a), b };
            let tens = vec![
                math(ArithmeticOp::Sub, place, left, WordOperand::Const(last + 1)),
                IrOp::Lookup { dst: power, index: place, table: powers },
                math(ArithmeticOp::Div, quotient, rest, WordOperand::Cell(power)),
                math(ArithmeticOp::Mul, product, quotient, WordOperand::Cell(power)),
                math(ArithmeticOp::Sub, rest, rest, WordOperand::Cell(product)),
                IrOp::If {
                    cond: is_zero(quotient),
                    if_true: Vec::new(),
                    if_false: vec![IrOp::SetBit { bit: leading, value: false }],
                },
                IrOp::If {
                    cond: BranchCondition::Bit(leading),
                    if_true: Vec::new(),
                    if_false: vec![character(quotient)],
                },
            ];
            digits = at(CompareOp::Equ, last)(self, digits, tens);
            if !signed {
                let take = IrOp::Move { dst: rest, src: WordOperand::Cell(var) };
                digits.splice(0..0, at(CompareOp::Equ, first)(self, vec![take], Vec::new()));
            }
        }
        let mut out = digits;
        if last > 0 {
            out = at(CompareOp::Geq, last)(self, out, Vec::new());
        }
        let top = if signed { first + 1 } else { first };
        if signed {
            let minus =
                IrOp::Math { op: ArithmeticOp::Sub, dst: rest, a: WordOperand::Const(0), b: WordOperand::Cell(rest) };
            let sign = vec![
                IrOp::Move { dst: rest, src: WordOperand::Cell(var) },
                IrOp::If {
                    cond: BranchCondition::Compare(WordComparison {
                        a: rest,
                        rel: RelationOp::Lt,
                        b: WordOperand::Const(0),
                    }),
                    if_true: vec![minus, IrOp::Move { dst: byte, src: WordOperand::Const(b'-'.into()) }],
                    if_false: Vec::new(),
                },
            ];
            out = at(CompareOp::Equ, top)(self, sign, out);
        }
        // Characters before the number skip these operations.
        if top + 1 < pieces.len() as i32 { at(CompareOp::Leq, top)(self, out, Vec::new()) } else { out }
    }

    /// Lowers PERSIST.
    pub(super) fn persist(&mut self, name: &str) {
        let src = self.word(name);
        let (Some((addr, _)), Some((busy, scans))) = (self.eeprom_cells.next(), self.eeprom_busy) else { return };
        let loaded = self.new_bit(self.element_name("loaded"), BitRole::Memory);
        let either = IrOp::If {
            cond: BranchCondition::Bit(loaded),
            if_true: vec![IrOp::WriteEeprom { src, addr, busy, scans }],
            if_false: vec![IrOp::ReadEeprom { dst: src, addr }, IrOp::SetBit { bit: loaded, value: true }],
        };
        self.push(if_accumulator(vec![IrOp::If { cond: is_zero(busy), if_true: vec![either], if_false: Vec::new() }]));
    }
}

fn compare_zero(word: WordId, rel: RelationOp) -> WordComparison {
    WordComparison { a: word, rel, b: WordOperand::Const(0) }
}

fn is_zero(word: WordId) -> BranchCondition {
    BranchCondition::Compare(compare_zero(word, RelationOp::Eq))
}

fn not_zero(word: WordId) -> WordComparison {
    compare_zero(word, RelationOp::Ne)
}

/// Decrements a word, down to 0.
fn count_down(word: WordId) -> IrOp {
    IrOp::If {
        cond: BranchCondition::Compare(not_zero(word)),
        if_true: vec![step_word(word, ArithmeticOp::Sub)],
        if_false: Vec::new(),
    }
}
