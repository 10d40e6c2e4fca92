//! LDmicro 5's characters of segments, times as numbers, and pseudo-random numbers.

use ladder::{CompareOp, LadderOperand, SegmentDisplay};

use super::{Lowering, if_accumulator};
use crate::ir::{ArithmeticOp, IrOp, WordId, WordOperand, WordRole};

/// dst := a op b.
fn math(op: ArithmeticOp, dst: WordId, a: WordId, b: WordOperand) -> IrOp {
    IrOp::Math { op, dst, a: WordOperand::Cell(a), b }
}

impl Lowering<'_> {
    /// A character as segments; a variable that is no character becomes one.
    pub(super) fn segments(&mut self, display: SegmentDisplay, dest: &str, src: &LadderOperand, inverted: bool) {
        use ladder::segments::{DEGREE_CODE, SEGMENT_CHARACTERS};
        let (dst, at) = (self.word(dest), self.value(src));
        let (degree, characters) = (DEGREE_CODE as i32, SEGMENT_CHARACTERS as i32);
        let values: Vec<i32> = display.characters().iter().map(|&lit| lit as i32).collect();
        let mut ops = Vec::new();
        match at {
            WordOperand::Const(code) => {
                let code = if code == degree { characters - 1 } else { code };
                let found = usize::try_from(code).ok().and_then(|code| values.get(code)).or(values.get(32));
                let lit = found.copied().unwrap_or(0);
                ops.push(IrOp::Move { dst, src: WordOperand::Const(if inverted { !lit } else { lit }) });
            }
            WordOperand::Cell(index) => {
                let put = |code: i32| vec![IrOp::Move { dst: index, src: WordOperand::Const(code) }];
                let constant = WordOperand::Const;
                let negative = self.if_comparison(CompareOp::Les, at, constant(0), put(32), Vec::new());
                let above = self.if_comparison(CompareOp::Geq, at, constant(characters), put(32), negative);
                ops.extend(self.if_comparison(CompareOp::Equ, at, constant(degree), put(characters - 1), above));
                let name = self.element_name("characters");
                let table = self.table(name, values);
                ops.push(IrOp::Lookup { dst, index, table });
                if inverted {
                    ops.push(math(ArithmeticOp::Xor, dst, dst, constant(-1)));
                }
            }
        }
        self.push(if_accumulator(ops));
    }

    /// A time in scans, or in clocks of the crystal.
    pub(super) fn time_value(&mut self, is_scans: bool, dest: &str, time: &LadderOperand) {
        let LadderOperand::Const { value: time, .. } = time else { return };
        let settings = &self.program.settings;
        let value = if is_scans {
            i128::from(*time) / i128::from(settings.cycle_us.max(1))
        } else {
            i128::from(*time) * i128::from(settings.crystal_hz) / 1_000_000
        };
        let dst = self.word(dest);
        self.push(if_accumulator(vec![IrOp::Move { dst, src: WordOperand::Const(value as i32) }]));
    }

    /// The state of a sequence, which begins with 1.
    fn sequence(&mut self, name: &str) -> WordId {
        if let Some(&seed) = self.seeds.get(name) {
            return seed;
        }
        let seed = self.new_word_cell(format!("random {name}"), WordRole::Memory, 4, 1);
        self.seeds.insert(name.to_owned(), seed);
        seed
    }

    /// The next number of a sequence: its state with the upper half first.
    pub(super) fn random(&mut self, dest: &str) {
        let (dst, state) = (self.word(dest), self.sequence(dest));
        let high = self.temporary("high", 4);
        let constant = WordOperand::Const;
        let mut ops = vec![
            math(ArithmeticOp::Mul, state, state, constant(1_103_515_245)),
            math(ArithmeticOp::Add, state, state, constant(12_345)),
            math(ArithmeticOp::Shr, high, state, constant(16)),
        ];
        if self.ir.bytes(dst) > 2 {
            let low = self.temporary("low", 4);
            ops.push(math(ArithmeticOp::Mul, low, state, constant(0x1_0000)));
            ops.push(math(ArithmeticOp::Or, high, high, WordOperand::Cell(low)));
        }
        ops.push(IrOp::Move { dst, src: WordOperand::Cell(high) });
        self.push(if_accumulator(ops));
    }

    /// Lowers SEED_RANDOM: starts a sequence of random numbers, while it has power.
    pub(super) fn seed_random(&mut self, dest: &str, src: &LadderOperand) {
        let (dst, src) = (self.sequence(dest), self.value(src));
        self.push(if_accumulator(vec![IrOp::Move { dst, src }]));
    }
}
