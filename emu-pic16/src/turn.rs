//! The hot loop: what one instruction does to the machine.
//!
//! [`Turn`] holds the hot state as plain locals whose address never escapes, so that it lives in host registers; RAM lies
//! beside it. Everything a body calls is inlined; slow paths get scalars.

use emu_core::cpu::{Bus, Probe, Wake};
use emu_core::dispatch;
use emu_core::machine::{Byte, Machine, Pair};
use emu_core::table::{InRam, Operand};

#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::hot::{BANK, Hot, PD, TO};
use crate::isa::{Kind, Pic16Op, SPAN, pic16_table};
use crate::lint::Lints;
use crate::operands::{B, F, K, Place, Ram, Target};
use crate::periph::map::Sfr;
use crate::soc::Soc;

/// Addresses of data memory.
pub(crate) const DATA: usize = 0x200;

/// Ops of all banks: every bank has its own, since an address means something else in each. Half of the places are behind the
/// end of program memory.
pub(crate) const OPS: usize = 0x1_0000;

/// Data memory in the list of a chip's memories.
const DATA_SPACE: u8 = 1;

/// One turn of the loop: hot state by value, everything else borrowed.
pub(crate) struct Turn<'a, P: Probe> {
    pub hot: Hot,
    /// By the address under which a byte is kept. A slice, whose length is checked in one compare.
    pub ram: &'a mut [u8],
    pub stack: &'a mut [u16; 8],
    /// Where every address of data memory lies.
    pub places: &'a [Place; DATA],
    /// The lowest address of what lies at each address.
    pub lowest: &'a [u16; DATA],
    pub words: &'a [u16; SPAN],
    pub lints: &'a mut Lints,
    pub bus: &'a mut Soc,
    pub probe: &'a mut P,
}

const INDF: u16 = Place::sfr(Sfr::INDF).0;
const STATUS: u16 = Place::sfr(Sfr::STATUS).0;
const FSR: u16 = Place::sfr(Sfr::FSR).0;
const PCL: u16 = Place::sfr(Sfr::PCL).0;
pub(crate) const PCLATH: u16 = Place::sfr(Sfr::PCLATH).0;
const NOWHERE: u16 = Place::NONE.0;
/// Bits of STATUS.
const C: u8 = 0x01;
const Z: u8 = 0x04;
const RP0: u8 = 0x20;
const RP1: u8 = 0x40;
/// The first register of the chip among places.
pub(crate) const REGISTERS: u16 = INDF;

impl<P: Probe> Turn<'_, P> {
    /// The cycle in which the running instruction reads and writes: its first. Only instructions that do neither have had more
    /// than one charged by now.
    #[inline(always)]
    pub(crate) const fn cycle(&self) -> u64 {
        self.hot.time.now().wrapping_sub(1)
    }

    #[inline(always)]
    fn wake(&mut self, wake: Wake) {
        if wake != Wake::NONE {
            self.hot.time.force();
        }
    }

    /// Tells the probe of an access to data memory.
    #[inline(always)]
    fn saw(&mut self, value: u8, write: bool) {
        if P::DATA && (write || P::READS) {
            let at = self.cycle();
            let addr = self.address();
            if self.probe.data(at, DATA_SPACE, addr, value, write) {
                self.hot.stop = true;
                self.hot.time.force();
            }
        }
    }

    /// The running instruction.
    #[inline(always)]
    pub(crate) const fn running(&self) -> (u32, u16) {
        let pc = self.hot.at.wrapping_sub(1) % SPAN as u32;
        (pc, self.words[pc as usize])
    }

    /// The address of data memory that the running instruction reaches, of several for one byte the lowest.
    #[inline(always)]
    pub(crate) const fn address(&self) -> u16 {
        let word = self.running().1;
        let addr = match word {
            0x62 => 0x81,
            0x65..=0x67 => word & 7 | 0x80,
            _ if word & 0x7F == 0 => self.hot.pointer as u16,
            _ => ((self.hot.at & BANK) >> 7) as u16 | word & 0x7F,
        };
        self.lowest[addr as usize % DATA]
    }

    /// The instruction goes on elsewhere than behind it.
    #[inline(always)]
    fn goes(&mut self, target: u32) {
        let next = self.hot.pc();
        self.hot.set_pc(target);
        if P::FLOW {
            self.probe.goes(next, self.hot.pc(), true);
        }
    }

    #[inline(always)]
    fn push_pc(&mut self) {
        self.stack[self.hot.sp as usize % 8] = self.hot.pc() as u16;
        self.hot.sp = (self.hot.sp + 1) % 8;
    }

    #[inline(always)]
    fn keep(&mut self, addr: u16, value: u8) {
        if let Some(byte) = self.ram.get_mut(usize::from(addr)) {
            *byte = value;
        }
    }

    /// Writes what is no RAM and no flag.
    #[inline(always)]
    fn put_register(&mut self, place: u16, value: u8) {
        if P::LINT {
            self.lint_write(place, value);
        }
        match place {
            FSR => self.hot.pointer = self.hot.pointer & 0x100 | u32::from(value),
            PCLATH => self.hot.pclath = u32::from(value) & 0x1F,
            PCL => {
                self.goes(self.hot.pclath << 8 | u32::from(value));
                self.hot.time.charge(1);
            }
            INDF | NOWHERE => {}
            _ => {
                let at = self.cycle();
                let wake = write_bus(self.bus, place, value, at);
                self.wake(wake);
            }
        }
    }
}

/// A register of the chip is read.
#[inline(never)]
fn read_bus(bus: &mut Soc, place: u16, at: u64) -> (u8, Wake) {
    bus.read(place - REGISTERS, at)
}

/// A register of the chip is written.
#[inline(never)]
fn write_bus(bus: &mut Soc, place: u16, value: u8, at: u64) -> Wake {
    bus.write(place - REGISTERS, value, at)
}

impl<P: Probe> Machine for Turn<'_, P> {
    type Bit = bool;
    type Word = Byte;
    type Wide = Pair;

    #[inline(always)]
    fn begin(&mut self, words: u32, cycles: u32) {
        self.advance(words);
        // What skips takes a cycle, and one more when it does.
        self.charge(if cycles == 0 { 1 } else { cycles });
    }
    #[inline(always)]
    fn advance(&mut self, words: u32) {
        self.hot.at = self.hot.at.wrapping_add(words);
        self.hot.time.count();
    }
    #[inline(always)]
    fn charge(&mut self, cycles: u32) {
        self.hot.time.charge(cycles);
    }
    #[inline(always)]
    fn jump(&mut self, target: u32) {
        self.goes(target);
    }
    #[inline(always)]
    fn goto(&mut self, target: Pair) {
        self.goes(target.0.into());
    }
    #[inline(always)]
    fn branch_if(&mut self, condition: bool, target: u32) {
        if condition {
            self.goes(target);
        }
    }
    #[inline(always)]
    fn skip_if(&mut self, condition: bool, words: u32) {
        let skipped = if condition { words } else { 0 };
        let next = self.hot.pc();
        self.hot.at = self.hot.at.wrapping_add(skipped);
        // Whether it skips is hard to foresee: no branch here.
        if P::FLOW {
            self.probe.goes(next, self.hot.pc(), condition);
        }
        self.hot.time.charge(skipped);
    }
}

impl<P: Probe> Pic16Machine for Turn<'_, P> {
    #[inline(always)]
    fn w(&self) -> Byte {
        Byte(self.hot.w as u8)
    }
    #[inline(always)]
    fn set_w(&mut self, value: Byte) {
        self.hot.w = value.0.into();
    }
    #[inline(always)]
    fn carry(&self) -> bool {
        self.hot.c != 0
    }
    #[inline(always)]
    fn set_carry(&mut self, value: bool) {
        self.hot.c = value.into();
    }
    #[inline(always)]
    fn set_z(&mut self, value: Byte) {
        self.hot.z = value.0.into();
    }
    #[inline(always)]
    fn set_carries(&mut self, carries: Byte) {
        let carries = u32::from(carries.0);
        (self.hot.c, self.hot.dc) = (carries >> 7, carries & 8);
    }
    #[inline(always)]
    fn word(bit: bool) -> Byte {
        Byte(bit.into())
    }
    #[inline(always)]
    fn resolve(&mut self, place: Place) -> Place {
        if place.0 == INDF { self.places[self.hot.pointer as usize % DATA] } else { place }
    }
    #[inline(always)]
    fn file(&mut self, place: Place) -> Byte {
        let value = match place.0 {
            ..REGISTERS => self.ram.get(usize::from(place.0)).copied().unwrap_or(0),
            STATUS => self.hot.status(),
            FSR => self.hot.pointer as u8,
            PCL => self.hot.at as u8,
            PCLATH => self.hot.pclath as u8,
            INDF | NOWHERE => 0,
            register => {
                let at = self.cycle();
                if P::LINT {
                    self.lint_read(register);
                }
                let (value, wake) = read_bus(self.bus, register, at);
                self.wake(wake);
                value
            }
        };
        self.saw(value, false);
        Byte(value)
    }
    #[inline(always)]
    fn put(&mut self, place: Place, value: Byte) {
        self.saw(value.0, true);
        match place.0 {
            ..REGISTERS => self.keep(place.0, value.0),
            STATUS => self.hot.set_status(value.0.into()),
            other => self.put_register(other, value.0),
        }
    }
    #[inline(always)]
    fn put_alu(&mut self, place: Place, value: Byte) {
        self.saw(value.0, true);
        match place.0 {
            ..REGISTERS => self.keep(place.0, value.0),
            STATUS => self.hot.set_banks(value.0.into()),
            other => self.put_register(other, value.0),
        }
    }
    // The bits of STATUS that programs live by, without packing all of it.
    #[inline(always)]
    fn file_bit(&mut self, place: Place, mask: u8) -> bool {
        match (place.0, mask) {
            (STATUS, C) if !P::DATA => self.hot.c != 0,
            (STATUS, Z) if !P::DATA => self.hot.z as u8 == 0,
            _ => Self::masked(self.file(place), mask),
        }
    }
    #[inline(always)]
    fn put_bit(&mut self, place: Place, mask: u8, on: bool) {
        match (place.0, mask) {
            (STATUS, C) if !P::DATA => self.hot.c = on.into(),
            (STATUS, RP0 | RP1) if !P::DATA => {
                let bank = u32::from(mask) << 9;
                self.hot.at = if on { self.hot.at | bank } else { self.hot.at & !bank };
            }
            _ => {
                let value = self.file(place).0;
                self.put(place, Byte(if on { value | mask } else { value & !mask }));
            }
        }
    }
    #[inline(always)]
    fn ram(&mut self, addr: u16) -> Byte {
        let value = self.ram.get(usize::from(addr)).copied().unwrap_or(0);
        self.saw(value, false);
        Byte(value)
    }
    #[inline(always)]
    fn put_ram(&mut self, addr: u16, value: Byte) {
        self.saw(value.0, true);
        self.keep(addr, value.0);
    }
    #[inline(always)]
    fn masked(value: Byte, mask: u8) -> bool {
        value.0 & mask != 0
    }
    #[inline(always)]
    fn skip(&mut self, condition: bool) {
        self.skip_if(condition, 1);
    }
    #[inline(always)]
    fn go(&mut self, target: u16) {
        let target = (self.hot.pclath & 0x18) << 8 | u32::from(target);
        if P::LINT {
            self.lint_go(target);
        }
        self.goes(target);
    }
    #[inline(always)]
    fn push(&mut self) {
        if P::LINT {
            let pc = self.running().0;
            self.lint_push(pc);
        }
        self.push_pc();
    }
    #[inline(always)]
    fn pop(&mut self) {
        if P::LINT {
            self.lint_pop();
        }
        self.hot.sp = self.hot.sp.wrapping_sub(1) % 8;
        self.goes(self.stack[self.hot.sp as usize % 8].into());
    }
    #[inline(always)]
    fn interrupt_ended(&mut self) {
        if P::LINT {
            self.lint_interrupt_ended();
        }
        let first = self.cycle().wrapping_sub(1);
        self.bus.interrupt_ended(first);
        self.hot.time.force();
    }
    #[inline(always)]
    fn clear_watchdog(&mut self) {
        self.hot.to_pd = TO | PD;
        let at = self.cycle();
        self.bus.clear_watchdog(at);
        self.hot.time.force();
    }
    #[inline(always)]
    fn standby(&mut self) {
        let at = self.cycle();
        if self.bus.sleep(at) {
            self.hot.to_pd = TO;
        } else if P::LINT {
            self.lint_no_sleep();
        }
        self.hot.time.force();
    }
}

/// Executes `$op` on `$m`; `$other` is for kinds without a row.
macro_rules! execute {
    ($m:ident, $op:ident, $other:expr) => {
        pic16_table!(dispatch { ($m, $op, $op.kind, $other) })
    };
}

/// Fetches and executes the instruction at the program counter.
macro_rules! turn {
    ($turn:ident, $ops:ident) => {{
        let m = &mut $turn;
        let op: &Pic16Op = &$ops[m.hot.at as u16 as usize];
        if P::INSN && op.kind as u8 != Kind::Trap as u8 && m.probe.insn(m.hot.time.now(), m.hot.pc()) {
            m.hot.stop = true;
            m.hot.time.force();
            break;
        }
        execute!(
            m,
            op,
            match op.kind {
                Kind::BtfscGoto => and_goto!(m, $ops, skip_bit(m, ram_of(op), bit_of(op), false)),
                Kind::BtfssGoto => and_goto!(m, $ops, skip_bit(m, ram_of(op), bit_of(op), true)),
                Kind::DecfszGoto => and_goto!(m, $ops, decfsz(m, ram_of(op), false)),
                Kind::IncfszGoto => and_goto!(m, $ops, incfsz(m, ram_of(op), false)),
                Kind::BtfscSfrGoto => and_goto!(m, $ops, skip_bit(m, file_of(op), bit_of(op), false)),
                Kind::BtfssSfrGoto => and_goto!(m, $ops, skip_bit(m, file_of(op), bit_of(op), true)),
                _ => {
                    m.hot.escape = true;
                    m.hot.time.force();
                }
            }
        );
    }};
}

/// A test, and unless it skips the GOTO behind it, if there is time left for that.
macro_rules! and_goto {
    ($m:ident, $ops:ident, $test:expr) => {{
        let next = $m.hot.at.wrapping_add(1);
        $m.begin(1, 0);
        $test;
        if !P::INSN && $m.hot.at == next && $m.hot.time.goes_on() {
            let target = Target::take(&$ops[next as u16 as usize], &mut 0);
            $m.begin(1, 2);
            goto($m, target);
        }
    }};
}

/// Operands of the op of a test.
#[inline(always)]
fn ram_of(op: &Pic16Op) -> Ram {
    F::take_in_ram(op, &mut 0)
}
#[inline(always)]
fn file_of(op: &Pic16Op) -> F {
    F::take(op, &mut 0)
}
#[inline(always)]
fn bit_of(op: &Pic16Op) -> B {
    B::take(op, &mut 2)
}

impl<P: Probe> Turn<'_, P> {
    /// Runs to the deadline; returns the hot state. The turn is written twice so that there are two indirect jumps.
    #[inline(never)]
    pub(crate) fn burst(self, ops: &[Pic16Op; OPS]) -> Hot {
        let mut turn = self;
        while turn.hot.time.goes_on() {
            turn!(turn, ops);
            if !turn.hot.time.goes_on() {
                break;
            }
            turn!(turn, ops);
        }
        turn.hot
    }

    /// Executes one given op, whatever stands in the op array; a kind without a row does nothing.
    #[inline(never)]
    pub(crate) fn single(self, op: Pic16Op) -> Hot {
        let mut turn = self;
        let m = &mut turn;
        let op = &op;
        execute!(m, op, ());
        turn.hot
    }

    /// Goes to the interrupt vector: the return address on the stack, `cycles` without an instruction.
    #[inline(never)]
    pub(crate) fn interrupt(self, cycles: u32) -> Hot {
        let mut turn = self;
        let m = &mut turn;
        m.charge(cycles);
        if P::LINT {
            m.lint_interrupt();
        }
        m.push_pc();
        m.hot.set_pc(4);
        turn.hot
    }
}
