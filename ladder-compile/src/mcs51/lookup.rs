//! Selects table look-ups and operations of the serial line.

use emu_8051::isa::Mcs51OpKind;

use super::arch::Mcs51Jump;
use super::byte_ops::AluOp;
use super::known_state::{AccumulatorState, ByteOperand, SelectorState};
use super::registers::{B, DPL};
use super::select::{Mcs51Selector, PendingCode};
use crate::code::CodeLabel;
use crate::ir::{WordId, WordOperand};

impl Mcs51Selector<'_> {
    /// dst := `table[index]`. Each byte of the values is a separate table, unless that byte is constant.
    pub(super) fn lookup(&mut self, dst: WordId, index: WordId, table: u32, live: bool) {
        let Some(table) = self.ir.tables.get(table as usize) else { return };
        let (at, from) = (self.layout.word(dst), self.layout.word(index));
        let long = table.values.len() > 256;
        if long {
            self.save_carry(live);
            // The destination may be the index, so read its high byte before writing any byte.
            let high = if self.ir.bytes(index) > 1 { ByteOperand::At(from + 1) } else { ByteOperand::Imm(0) };
            self.copy_sfr(B, high);
        }
        let mut constants = Vec::new();
        // Start at the highest byte: the low byte, which is the index, must be written last.
        for n in (0..self.ir.bytes(dst)).rev() {
            let column: Vec<u8> =
                table.values.iter().filter_map(|value| value.to_le_bytes().get(usize::from(n)).copied()).collect();
            if let Some(&first) = column.first()
                && column.iter().all(|byte| *byte == first)
            {
                constants.push((at + n, first));
                continue;
            }
            let label = self.table(column);
            self.pending.push(PendingCode::Jump(Mcs51Jump::LoadAddress, label));
            self.load(ByteOperand::At(from));
            if long {
                for (half, index) in [(DPL, None), (DPL + 1, Some(ByteOperand::Sfr(B)))] {
                    index.into_iter().for_each(|index| self.load(index));
                    self.alu(if index.is_some() { AluOp::Addc } else { AluOp::Add }, ByteOperand::Sfr(half));
                    self.emit(Mcs51OpKind::MovDirA, &[half]);
                }
                self.load(ByteOperand::Imm(0));
            }
            self.emit(Mcs51OpKind::MovcDptr, &[]);
            self.state.a = None;
            self.save(at + n);
        }
        for (at, value) in constants {
            self.copy(at, ByteOperand::Imm(value));
        }
    }

    /// Returns the label of a table; tables with equal bytes are shared.
    fn table(&mut self, bytes: Vec<u8>) -> CodeLabel {
        if let Some((label, _)) = self.tables.iter().find(|(_, known)| *known == bytes) {
            return *label;
        }
        let label = self.asm.new_label();
        self.tables.push((label, bytes));
        label
    }

    /// Writes the low byte of a value to the transmitter, after waiting until it is free if necessary.
    pub(super) fn send(&mut self, value: WordOperand) {
        let here = self.asm.new_label();
        self.place(here);
        self.send_labels.push(here);
        if self.must_wait_for_transmitter {
            let sent = self.regs.bit("TI");
            self.pending.push(PendingCode::Repeat(Mcs51Jump::conditional(Mcs51OpKind::Jnb, &[sent]), here, 1));
            self.emit(Mcs51OpKind::ClrBit, &[sent]);
        }
        let byte = match value {
            WordOperand::Cell(word) => ByteOperand::At(self.layout.word(word)),
            WordOperand::Const(value) => ByteOperand::Imm(value as u8),
        };
        let line = self.regs.byte("SBUF");
        self.copy_sfr(line, byte);
    }

    /// Waits until the transmitter has sent its byte; the next write to it clears the flag.
    pub(super) fn wait_sent(&mut self) {
        let (here, sent) = (self.asm.new_label(), self.regs.bit("TI"));
        self.place(here);
        self.pending.push(PendingCode::Repeat(
            Mcs51Jump::conditional(Mcs51OpKind::Jnb, &[sent]),
            here,
            self.sent_iterations,
        ));
    }

    /// acc := a byte had been received when the scan began; if so, moves it to dst.
    pub(super) fn receive(&mut self, dst: WordId) {
        let (arrived, none) = (i32::from(self.layout.byte_received_flag.unwrap_or(0)), self.asm.new_label());
        self.emit(Mcs51OpKind::MovCBit, &[arrived]);
        self.jump(Mcs51OpKind::Jnc, &[], none);
        self.emit(Mcs51OpKind::ClrBit, &[arrived]);
        let (flag, line) = (self.regs.bit("RI"), self.regs.byte("SBUF"));
        self.emit(Mcs51OpKind::ClrBit, &[flag]);
        let at = self.layout.word(dst);
        self.copy(at, ByteOperand::Sfr(line));
        for n in 1..self.ir.bytes(dst) {
            self.copy(at + n, ByteOperand::Imm(0));
        }
        self.place(none);
        self.state = SelectorState {
            acc: AccumulatorState { carry: Some(false), ..AccumulatorState::default() },
            ..SelectorState::default()
        };
    }
}
