//! The bodies of the instructions: one function for all rows with the same operation, generic over a machine.

use emu_core::machine::BitOps;

use crate::operands::{A, BitAddress, CellOperand, D, JumpTarget, X};

/// A machine on which instruction bodies run.
pub(crate) trait Ap101Machine {
    /// A bit.
    type Bit: BitOps;

    /// Begins an instruction of `words` program words that takes `cycles` machine cycles: advances NA and the
    /// time.
    fn begin(&mut self, words: u32, cycles: u32);
    /// Makes a known bit.
    fn bit(value: bool) -> Self::Bit;
    /// Reads the accumulator A.
    fn a(&self) -> Self::Bit;
    /// Sets A.
    fn set_a(&mut self, bit: Self::Bit);
    /// Reads a bit of memory.
    fn cell(&self, cell: u16) -> Self::Bit;
    /// Writes a bit of memory.
    fn set_cell(&mut self, cell: u16, bit: Self::Bit);
    /// Reads the bit at a location.
    fn read_bit(&mut self, place: BitAddress) -> Self::Bit;
    /// Writes the bit at a location if `condition` is true; otherwise nothing is written.
    fn write_bit_if(&mut self, condition: Self::Bit, place: BitAddress, bit: Self::Bit);
    /// Writes the bit at a location. With `orders`, a write to a preset port takes the preset from the next
    /// word.
    fn store_bit(&mut self, place: BitAddress, bit: Self::Bit, orders: bool);
    /// Sets NA to `target` if `condition` is true.
    fn jump_if(&mut self, condition: Self::Bit, target: u16);
}

/// An address, in any of the forms that an op can have.
pub(crate) trait BitOperand: Copy {
    /// Reads the bit.
    fn read<M: Ap101Machine>(self, m: &mut M) -> M::Bit;
    /// Stores a bit; `orders` as in [`Ap101Machine::store_bit`].
    fn store<M: Ap101Machine>(self, m: &mut M, bit: M::Bit, orders: bool);
    /// Writes a bit if `condition` is true.
    fn write_if<M: Ap101Machine>(self, m: &mut M, condition: M::Bit, bit: M::Bit);
}

macro_rules! addresses {
    ($($name:ident)*) => { $(
        impl BitOperand for $name {
            #[inline(always)]
            fn read<M: Ap101Machine>(self, m: &mut M) -> M::Bit {
                m.read_bit(self.0)
            }
            #[inline(always)]
            fn store<M: Ap101Machine>(self, m: &mut M, bit: M::Bit, orders: bool) {
                m.store_bit(self.0, bit, orders);
            }
            #[inline(always)]
            fn write_if<M: Ap101Machine>(self, m: &mut M, condition: M::Bit, bit: M::Bit) {
                m.write_bit_if(condition, self.0, bit);
            }
        }
    )* };
}
addresses! { A X }

impl BitOperand for CellOperand {
    #[inline(always)]
    fn read<M: Ap101Machine>(self, m: &mut M) -> M::Bit {
        m.cell(self.0)
    }
    #[inline(always)]
    fn store<M: Ap101Machine>(self, m: &mut M, bit: M::Bit, _: bool) {
        m.set_cell(self.0, bit);
    }
    #[inline(always)]
    fn write_if<M: Ap101Machine>(self, m: &mut M, condition: M::Bit, bit: M::Bit) {
        let old = m.cell(self.0);
        m.set_cell(self.0, (old & !condition) | (bit & condition));
    }
}

/// A := operand.
#[inline(always)]
pub(crate) fn load<M: Ap101Machine>(m: &mut M, a: impl BitOperand) {
    let bit = a.read(m);
    m.set_a(bit);
}

/// A := not operand.
#[inline(always)]
pub(crate) fn load_not<M: Ap101Machine>(m: &mut M, a: impl BitOperand) {
    let bit = a.read(m);
    m.set_a(!bit);
}

/// operand := A.
#[inline(always)]
pub(crate) fn store<M: Ap101Machine>(m: &mut M, a: impl BitOperand) {
    let bit = m.a();
    a.store(m, bit, true);
}

/// operand := not A.
#[inline(always)]
pub(crate) fn store_not<M: Ap101Machine>(m: &mut M, a: impl BitOperand) {
    let bit = !m.a();
    a.store(m, bit, false);
}

/// operand := `value`, if A is 1 (set and reset).
#[inline(always)]
pub(crate) fn store_if<M: Ap101Machine>(m: &mut M, a: impl BitOperand, value: bool) {
    let condition = m.a();
    a.write_if(m, condition, M::bit(value));
}

/// A := A and operand.
#[inline(always)]
pub(crate) fn and<M: Ap101Machine>(m: &mut M, a: impl BitOperand) {
    let bit = a.read(m);
    m.set_a(m.a() & bit);
}

/// A := A and not operand.
#[inline(always)]
pub(crate) fn and_not<M: Ap101Machine>(m: &mut M, a: impl BitOperand) {
    let bit = a.read(m);
    m.set_a(m.a() & !bit);
}

/// A := A or operand.
#[inline(always)]
pub(crate) fn or<M: Ap101Machine>(m: &mut M, a: impl BitOperand) {
    let bit = a.read(m);
    m.set_a(m.a() | bit);
}

/// A := A or not operand.
#[inline(always)]
pub(crate) fn or_not<M: Ap101Machine>(m: &mut M, a: impl BitOperand) {
    let bit = a.read(m);
    m.set_a(m.a() | !bit);
}

/// A := A xor operand.
#[inline(always)]
pub(crate) fn xor<M: Ap101Machine>(m: &mut M, a: impl BitOperand) {
    let bit = a.read(m);
    m.set_a(m.a() ^ bit);
}

/// A := not A.
#[inline(always)]
pub(crate) fn not<M: Ap101Machine>(m: &mut M) {
    m.set_a(!m.a());
}

/// A := 0.
#[inline(always)]
pub(crate) fn clear<M: Ap101Machine>(m: &mut M) {
    m.set_a(M::bit(false));
}

/// Jumps to a target.
#[inline(always)]
pub(crate) fn jump<M: Ap101Machine>(m: &mut M, t: JumpTarget) {
    m.jump_if(M::bit(true), t.0);
}

/// Jumps to a target if A is 1.
#[inline(always)]
pub(crate) fn jump_if<M: Ap101Machine>(m: &mut M, t: JumpTarget) {
    m.jump_if(m.a(), t.0);
}

/// Does nothing.
#[inline(always)]
pub(crate) fn nop<M: Ap101Machine>(_: &mut M) {}

/// A word that is no instruction: does nothing.
#[inline(always)]
pub(crate) fn data<M: Ap101Machine>(_: &mut M, _: D) {}
