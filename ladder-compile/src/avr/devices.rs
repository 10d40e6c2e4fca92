//! Operations on the peripherals and on tables.

use emu_avr::isa::Kind;

use super::arch::Jump;
use super::pwm::Pwm;
use super::regs::{self, A, BYTE, SCRATCH, ZERO};
use super::runtime::Routine;
use super::select::Select;
use super::serial::{self, Serial};
use super::words::from;
use crate::code::Label;
use crate::ir::{Value, Word};

/// How the peripherals of a program are set.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Devices {
    /// The serial line.
    pub serial: Option<Serial>,
    /// The PWM output.
    pub pwm: Option<Pwm>,
    /// The converter: ADMUX of each analog input.
    pub inputs: Vec<u8>,
    /// Turns of the loop that waits for a conversion.
    pub turns: u32,
    /// Tables in program memory, by their number in the intermediate code.
    pub tables: Vec<Label>,
}

/// Z.
const POINTER: i32 = 30;

impl Select<'_> {
    /// dst := table[index].
    pub fn look_up(&mut self, dst: Word, index: Word, table: u32) {
        let (ir, devices) = (self.ir, self.devices);
        let found = ir.tables.get(table as usize).zip(devices.tables.get(table as usize));
        let Some((table, &label)) = found else {
            self.fault = Some(format!("there is no table {table}"));
            return;
        };
        let bytes = i32::from(table.bytes);
        let short = table.values.len() * usize::from(table.bytes) <= 256;
        let pointer = from(POINTER);
        let width = if short { 1 } else { 2 };
        self.fill(Value::Cell(index), width, pointer);
        let add = |this: &mut Self, other: i32| {
            this.asm.op(Kind::Add, &[POINTER, other]);
            if !short {
                this.asm.op(Kind::Adc, &[POINTER + 1, other + 1]);
            }
        };
        match bytes {
            2 => add(self, POINTER),
            3 => {
                self.copy(from(BYTE), pointer, width);
                add(self, POINTER);
                add(self, BYTE);
            }
            4 => {
                add(self, POINTER);
                add(self, POINTER);
            }
            _ => {}
        }
        if short {
            self.asm.op(Kind::Ldi, &[POINTER + 1, 0]);
        }
        // Program memory counts bytes here: the sum is a difference with the negated address.
        self.asm.refer_by(Kind::Subi, &[POINTER, 0], 1, label, |word| (2 * word as i32).wrapping_neg() & 0xFF);
        self.asm.refer_by(Kind::Sbci, &[POINTER + 1, 0], 1, label, |word| (2 * word as i32).wrapping_neg() >> 8 & 0xFF);
        let wanted = self.bytes(dst);
        let home = self.home(dst);
        let to = home.unwrap_or(A);
        let have = wanted.min(usize::from(table.bytes));
        for (n, &reg) in to.iter().enumerate().take(have) {
            self.asm.op(if n + 1 < have { Kind::LpmZi } else { Kind::LpmZ }, &[reg]);
        }
        if table.values.iter().any(|&value| value < 0) {
            self.extend(to, have, wanted);
        } else {
            to.iter().take(wanted).skip(have).for_each(|&reg| self.asm.op(Kind::Mov, &[reg, ZERO]));
        }
        if home.is_some() {
            self.forget(dst);
        } else {
            self.known.a = None;
            self.save(dst, A);
        }
    }

    /// dst := the conversion of an input.
    pub fn read_adc(&mut self, dst: Word, input: u32) {
        let devices = self.devices;
        // With one input it is selected for ever.
        if let (Some(&select), true) = (devices.inputs.get(input as usize), devices.inputs.len() > 1) {
            regs::set(self.asm, self.regs.addr(&["ADMUX"]), select.into(), SCRATCH);
        }
        self.routine(Routine::Convert(devices.turns));
        let wanted = self.bytes(dst);
        A.iter().take(wanted).skip(2).for_each(|&reg| self.asm.op(Kind::Mov, &[reg, ZERO]));
        self.save(dst, A);
    }

    /// The duty of the PWM output := a value.
    pub fn set_pwm(&mut self, duty: Value) {
        let Some(pwm) = self.devices.pwm else {
            self.fault = Some("the PWM output has no frequency".to_owned());
            return;
        };
        match duty {
            Value::Const(duty) => pwm.constant(self.asm, self.regs, duty),
            Value::Cell(word) => {
                let bytes = self.bytes(word);
                self.fill(duty, bytes, A);
                pwm.variable(self.asm, self.regs, bytes);
                self.known.a = None;
            }
        }
    }

    /// The low byte goes to the transmitter.
    pub fn send(&mut self, value: Value) {
        let [from, ..] = self.source(value, 1, A);
        regs::write(self.asm, self.regs.addr(serial::DATA), from);
    }

    /// T := a byte has come; it goes to dst.
    pub fn receive(&mut self, dst: Word) {
        let over = self.asm.label();
        let (status, bit) = (self.regs.addr(serial::STATUS), self.regs.bit(serial::RECEIVED));
        self.asm.op(Kind::Clt, &[]);
        if regs::has_bits(status) {
            self.asm.op(Kind::Sbis, &[status - 0x20, bit]);
        } else {
            regs::read(self.asm, BYTE, status);
            self.asm.op(Kind::Sbrs, &[BYTE, bit]);
        }
        self.asm.jump(Jump::To, over);
        let before = self.known.a;
        let wanted = self.bytes(dst);
        let home = self.home(dst);
        let to = home.unwrap_or(A);
        regs::read(self.asm, to[0], self.regs.addr(serial::DATA));
        to.iter().take(wanted).skip(1).for_each(|&reg| self.asm.op(Kind::Mov, &[reg, ZERO]));
        if home.is_none() {
            self.save(dst, A);
        }
        self.asm.op(Kind::Set, &[]);
        self.asm.place(over);
        // A holds dst on one of the two ways, or what it held before, or neither.
        self.known.a = before.filter(|_| home.is_some());
        self.forget(dst);
        self.known.t = None;
    }

    /// The address of a cell of the EEPROM to the routine's register, its high byte to EEARH.
    fn cell_address(&mut self, addr: u16) {
        let [low, high] = addr.to_le_bytes();
        self.asm.op(Kind::Ldi, &[BYTE, low.into()]);
        if self.ir.eeprom > 256 {
            regs::set(self.asm, self.regs.addr(&["EEARH"]), high.into(), SCRATCH);
        }
    }

    /// dst := EEPROM.
    pub fn recall(&mut self, dst: Word, addr: u16) {
        self.cell_address(addr);
        self.routine(Routine::Recall(self.layout.bytes(dst)));
        self.save(dst, A);
    }

    /// EEPROM := src, one byte of it.
    pub fn persist(&mut self, src: Word, addr: u16, busy: Word, scans: i32) {
        let bytes = self.layout.bytes(src);
        self.fill(Value::Cell(src), bytes.into(), A);
        self.cell_address(addr);
        self.routine(Routine::Persist(bytes, busy, scans));
    }
}
