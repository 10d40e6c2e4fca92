//! Lowers the registers of ports: integers whose bits are the outputs at the pins, and the levels of the
//! pins.

use ladder::Element;
use ladder::registers::{self, PortRegister, RegisterFamily, RegisterKind, SharedPin};

use super::Lowering;
use crate::ir::{ArithmeticOp, BranchCondition, IrOp, PortCells, RelationOp, WordComparison, WordId, WordOperand};

/// dst := dst op constant, in one byte.
fn change(op: ArithmeticOp, dst: WordId, mask: u8) -> IrOp {
    let b = WordOperand::Const(i32::from(mask as i8));
    IrOp::Math { op, dst, a: WordOperand::Cell(dst), b }
}

impl Lowering<'_> {
    /// Lists the ports of the program, and adds the operations that take the levels of their pins.
    pub(super) fn set_up_ports(&mut self) {
        let program = self.program;
        self.shared_pins = registers::shared_pins(program);
        for register in registers::port_registers(program) {
            let PortRegister { port: letter, kind } = register;
            if self.ir.ports.last().is_none_or(|last| last.letter != letter) {
                self.ir.ports.push(PortCells { letter, latch: None, direction: None });
            }
            let word = self.word(&register.name());
            let Some(cells) = self.ir.ports.last_mut() else { continue };
            match kind {
                RegisterKind::Latch => cells.latch = Some(word),
                RegisterKind::Direction => cells.direction = Some(word),
                RegisterKind::Level => {}
            }
        }
        let levels = registers::port_registers(program).into_iter().filter(|r| r.kind == RegisterKind::Level);
        for register in levels.collect::<Vec<_>>() {
            self.take_levels(register);
        }
    }

    fn take_levels(&mut self, register: PortRegister) {
        let levels = self.word(&register.name());
        let cells = self.ir.ports.iter().find(|cells| cells.letter == register.port).copied();
        let family = self.program.settings.micro.as_deref().and_then(registers::register_family);
        let mut ops = Vec::new();
        if let Some(PortCells { latch: Some(latch), direction: Some(direction), .. }) = cells {
            ops.push(IrOp::Move { dst: levels, src: WordOperand::Cell(direction) });
            if family == Some(RegisterFamily::Pic16) {
                ops.push(change(ArithmeticOp::Xor, levels, 0xFF));
            }
            let (a, b) = (WordOperand::Cell(levels), WordOperand::Cell(latch));
            ops.push(IrOp::Math { op: ArithmeticOp::And, dst: levels, a, b });
        } else {
            ops.push(IrOp::Move { dst: levels, src: WordOperand::Const(0) });
        }
        for pin in self.shared_pins.clone().iter().filter(|pin| pin.port == register.port) {
            ops.push(self.copy_bit(levels, pin));
        }
        self.ir.prologue.extend(ops);
    }

    /// The bit of the word at the pin's place := the bit of its symbol.
    fn copy_bit(&mut self, word: WordId, pin: &SharedPin) -> IrOp {
        let mask = 1 << pin.bit;
        IrOp::If {
            cond: BranchCondition::Bit(self.symbol_bit(&pin.name)),
            if_true: vec![change(ArithmeticOp::Or, word, mask)],
            if_false: vec![change(ArithmeticOp::And, word, !mask)],
        }
    }

    /// After an element that wrote a latch or an output at its pins: makes the other of both equal.
    pub(super) fn share_outputs(&mut self, element: &Element) {
        if !self.shared_pins.iter().any(|pin| pin.output) {
            return;
        }
        let facts = element.facts();
        for name in facts.written() {
            let latch = PortRegister::from_name(name).filter(|register| register.kind == RegisterKind::Latch);
            for pin in self.shared_pins.clone().iter().filter(|pin| pin.output) {
                if latch.is_some_and(|latch| latch.port == pin.port) {
                    let (word, bit) = (self.word(name), self.symbol_bit(&pin.name));
                    let held = self.temporary("port bit", 1);
                    let mask = WordOperand::Const(i32::from((1_u8 << pin.bit) as i8));
                    self.push(IrOp::Math { op: ArithmeticOp::And, dst: held, a: WordOperand::Cell(word), b: mask });
                    let is_set = WordComparison { a: held, rel: RelationOp::Ne, b: WordOperand::Const(0) };
                    self.push(IrOp::If {
                        cond: BranchCondition::Compare(is_set),
                        if_true: vec![IrOp::SetBit { bit, value: true }],
                        if_false: vec![IrOp::SetBit { bit, value: false }],
                    });
                } else if pin.name == name {
                    let latch = self.ir.ports.iter().find(|cells| cells.letter == pin.port);
                    if let Some(word) = latch.and_then(|cells| cells.latch) {
                        let op = self.copy_bit(word, pin);
                        self.push(op);
                    }
                }
            }
        }
    }
}
