//! Tables in program memory, and the serial line.

use emu_8051::isa::Kind;

use super::arch::Jump;
use super::bytes::Alu;
use super::regs::{B, DPL};
use super::select::{Line, Select};
use super::state::{Acc, Byte, State};
use crate::code::Label;
use crate::ir::{Value, Word};

impl Select<'_> {
    /// dst := table[index]. Each byte of the values is a table of its own, but where it is always the same.
    pub(super) fn lookup(&mut self, dst: Word, index: Word, table: u32, live: bool) {
        let Some(table) = self.ir.tables.get(table as usize) else { return };
        let (at, from) = (self.layout.word(dst), self.layout.word(index));
        let long = table.values.len() > 256;
        if long {
            self.lose_carry(live);
            // The destination may be the index: its high byte is read before any is written.
            let high = if self.ir.bytes(index) > 1 { Byte::At(from + 1) } else { Byte::Imm(0) };
            self.copy_sfr(B, high);
        }
        let mut constants = Vec::new();
        // From the top: the low byte, which is the index, comes last.
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
            self.out.push(Line::Jump(Jump::Point, label));
            self.load(Byte::At(from));
            if long {
                for (half, index) in [(DPL, None), (DPL + 1, Some(Byte::Sfr(B)))] {
                    index.into_iter().for_each(|index| self.load(index));
                    self.alu(if index.is_some() { Alu::Addc } else { Alu::Add }, Byte::Sfr(half));
                    self.emit(Kind::MovDirA, &[half]);
                }
                self.load(Byte::Imm(0));
            }
            self.emit(Kind::MovcDptr, &[]);
            self.now.a = None;
            self.save(at + n);
        }
        for (at, value) in constants {
            self.copy(at, Byte::Imm(value));
        }
    }

    /// The label of a table; tables of the same bytes are one.
    fn table(&mut self, bytes: Vec<u8>) -> Label {
        if let Some((label, _)) = self.tables.iter().find(|(_, known)| *known == bytes) {
            return *label;
        }
        let label = self.asm.label();
        self.tables.push((label, bytes));
        label
    }

    /// The low byte goes to the transmitter, once that is free.
    pub(super) fn send(&mut self, value: Value) {
        let here = self.asm.label();
        self.place(here);
        self.sends.push(here);
        if self.waits {
            let sent = self.regs.bit("TI");
            self.out.push(Line::Repeat(Jump::when(Kind::Jnb, &[sent]), here, 1));
            self.emit(Kind::ClrBit, &[sent]);
        }
        let byte = match value {
            Value::Cell(word) => Byte::At(self.layout.word(word)),
            Value::Const(value) => Byte::Imm(value as u8),
        };
        let line = self.regs.byte("SBUF");
        self.copy_sfr(line, byte);
    }

    /// acc := a byte had arrived when the scan began; it goes to dst, and is taken.
    pub(super) fn receive(&mut self, dst: Word) {
        let (arrived, none) = (i32::from(self.layout.arrived.unwrap_or(0)), self.asm.label());
        self.emit(Kind::MovCBit, &[arrived]);
        self.jump(Kind::Jnc, &[], none);
        self.emit(Kind::ClrBit, &[arrived]);
        let (flag, line) = (self.regs.bit("RI"), self.regs.byte("SBUF"));
        self.emit(Kind::ClrBit, &[flag]);
        let at = self.layout.word(dst);
        self.copy(at, Byte::Sfr(line));
        for n in 1..self.ir.bytes(dst) {
            self.copy(at + n, Byte::Imm(0));
        }
        self.place(none);
        self.now = State { acc: Acc { carry: Some(false), ..Acc::default() }, ..State::default() };
    }
}
