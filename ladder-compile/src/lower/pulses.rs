//! Lowers PULSER, NPULSE, STEPPER and QUAD_ENCOD.

use ladder::{CompareOp, Element, LadderOperand, ProgramElement, stepper_counters};

use super::{Lowering, if_accumulator, step_word};
use crate::ir::{ArithmeticOp, BitId, BitRole, BranchCondition, IrOp, WordId, WordOperand, WordRole, min_bytes};

/// dst := src.
fn copy(dst: WordId, src: WordOperand) -> IrOp {
    IrOp::Move { dst, src }
}

/// Executes `ops` if the bit is `value`.
fn if_bit(bit: BitId, value: bool, ops: Vec<IrOp>) -> IrOp {
    let (if_true, if_false) = if value { (ops, Vec::new()) } else { (Vec::new(), ops) };
    IrOp::If { cond: BranchCondition::Bit(bit), if_true, if_false }
}

/// dst := src, for bits, without the accumulator.
fn copy_bit(dst: BitId, src: BitId) -> IrOp {
    let set = |value| vec![IrOp::SetBit { bit: dst, value }];
    IrOp::If { cond: BranchCondition::Bit(src), if_true: set(true), if_false: set(false) }
}

impl Lowering<'_> {
    /// Lowers the elements that make pulses.
    pub(super) fn pulse_element(&mut self, element: &Element) {
        match element {
            Element::Pulser { high, low, accel, count, coil } => self.pulser([high, low, accel, count], coil),
            Element::Npulse { hertz, coil, count } => self.npulse(count, hertz, coil),
            Element::Stepper { name, max, period, coil, .. } => self.stepper(name, max, period, coil),
            Element::QuadEncod { .. } => self.encoder(element),
            // The caller passes only the elements above.
            _ => {}
        }
    }

    fn memory_word(&mut self, what: &str, bytes: u8) -> WordId {
        self.new_word_cell(self.element_name(what), WordRole::Memory, bytes, 0)
    }

    fn pulser(&mut self, [high, low, accel, count]: [&LadderOperand; 4], coil: &str) {
        use CompareOp::{Grt, Les};
        let [left, long, short, ones, zeros] =
            ["pulses left", "ones", "zeros", "ones left", "zeros left"].map(|what| self.memory_word(what, 2));
        let bit = self.symbol_bit(coil);
        let [high, low, accel, count] = [high, low, accel, count].map(|operand| self.value(operand));
        let constant = WordOperand::Const;
        let begin_pulse = [copy(ones, long.into()), copy(zeros, short.into())];
        let mut start = vec![
            copy(left, count),
            IrOp::Math { op: ArithmeticOp::Mul, dst: long, a: high, b: accel },
            IrOp::Math { op: ArithmeticOp::Mul, dst: short, a: low, b: accel },
        ];
        start.extend(begin_pulse.clone());
        let start = self.if_comparison(Les, left.into(), constant(1), start, Vec::new());
        self.push(if_accumulator(start));
        let mut next = vec![step_word(left, ArithmeticOp::Sub)];
        for (length, least) in [(long, high), (short, low)] {
            let longer = vec![step_word(length, ArithmeticOp::Add)];
            next.extend(self.if_comparison(Grt, length.into(), least, longer, Vec::new()));
        }
        next.extend(begin_pulse);
        let one_less = |word| vec![step_word(word, ArithmeticOp::Sub)];
        let mut low = vec![IrOp::SetBit { bit, value: false }];
        low.extend(self.if_comparison(Grt, zeros.into(), constant(1), one_less(zeros), next));
        let mut high = one_less(ones);
        high.push(IrOp::SetBit { bit, value: true });
        let mut run = self.if_comparison(Grt, ones.into(), constant(0), high, low);
        run.push(IrOp::SetAccumulator(true));
        let rest = vec![IrOp::SetBit { bit, value: false }, IrOp::SetAccumulator(false)];
        let ops = self.if_comparison(Les, left.into(), constant(1), rest, run);
        self.push_all(ops);
    }

    /// Gives each NPULSE its word of pulses that are left, which every NPULSE_OFF clears.
    pub(super) fn plan_pulse_trains(&mut self) {
        let program = self.program;
        for ProgramElement { id, element, .. } in program.elements() {
            if let Element::Npulse { count, .. } = element {
                self.element = id;
                let bytes = match self.value(count) {
                    WordOperand::Cell(word) => self.ir.bytes(word),
                    WordOperand::Const(constant) => min_bytes(constant),
                };
                let left = self.memory_word("pulses left", bytes);
                self.trains.insert(id, left);
            }
        }
    }

    fn npulse(&mut self, count: &LadderOperand, hertz: &LadderOperand, coil: &str) {
        let (Some(&left), LadderOperand::Const { value: hertz, .. }) = (self.trains.get(&self.element), hertz) else {
            return;
        };
        let (one, zero) = (WordOperand::Const(1), WordOperand::Const(0));
        // The checks refuse a frequency whose half is no scan.
        let pair = u64::try_from(*hertz).unwrap_or(1).max(1).saturating_mul(self.program.settings.cycle_us.max(1));
        let half = i32::try_from(500_000 / pair).unwrap_or(1).max(1);
        let rest = self.memory_word("scans left", min_bytes(2 * half));
        let (bit, count) = (self.symbol_bit(coil), self.value(count));
        let begin = copy(rest, WordOperand::Const(2 * half));
        let start = vec![copy(left, count), begin.clone()];
        let start = self.if_comparison(CompareOp::Les, left.into(), one, start, Vec::new());
        self.push(if_accumulator(start));
        let set = |value| vec![IrOp::SetBit { bit, value }];
        let mut run = self.if_comparison(CompareOp::Grt, rest.into(), WordOperand::Const(half), set(true), set(false));
        run.push(step_word(rest, ArithmeticOp::Sub));
        let next = vec![step_word(left, ArithmeticOp::Sub), begin];
        run.extend(self.if_comparison(CompareOp::Equ, rest.into(), zero, next, Vec::new()));
        run.push(IrOp::SetAccumulator(true));
        let idle = vec![IrOp::SetBit { bit, value: false }, IrOp::SetAccumulator(false)];
        let ops = self.if_comparison(CompareOp::Les, left.into(), one, idle, run);
        self.push_all(ops);
    }

    /// Lowers NPULSE_OFF.
    pub(super) fn stop_pulses(&mut self) {
        let mut words: Vec<WordId> = self.trains.values().copied().collect();
        words.sort_unstable();
        self.push(if_accumulator(words.into_iter().map(|word| copy(word, WordOperand::Const(0))).collect()));
    }

    fn stepper(&mut self, name: &str, max: &LadderOperand, period: &LadderOperand, coil: &str) {
        let [left, scans] = stepper_counters(name).map(|counter| self.word(&counter));
        let (memory, bit) = (self.new_memory(), self.symbol_bit(coil));
        let each = matches!(period, LadderOperand::Const { value: 1, .. });
        let (max, period) = (self.value(max), self.value(period));
        let one = WordOperand::Const(1);
        let mut start = vec![copy(left, max)];
        if !each {
            start.push(copy(scans, one));
        }
        let mut rise = vec![IrOp::SetBit { bit: memory, value: true }];
        rise.extend(self.if_comparison(CompareOp::Les, left.into(), one, start, Vec::new()));
        self.push(IrOp::If {
            cond: BranchCondition::Acc,
            if_true: vec![if_bit(memory, false, rise)],
            if_false: vec![IrOp::SetBit { bit: memory, value: false }],
        });
        // The pulse ends at once.
        let mut step = vec![IrOp::SetBit { bit, value: false }, step_word(left, ArithmeticOp::Sub)];
        let mut run = Vec::new();
        if each {
            run.extend(step);
        } else {
            step.push(copy(scans, period));
            run.push(step_word(scans, ArithmeticOp::Sub));
            run.extend(self.if_comparison(CompareOp::Les, scans.into(), one, step, Vec::new()));
        }
        run.push(IrOp::SetAccumulator(true));
        let rest = vec![IrOp::SetAccumulator(false)];
        let ops = self.if_comparison(CompareOp::Les, left.into(), one, rest, run);
        self.push_all(ops);
    }

    fn encoder(&mut self, element: &Element) {
        let Element::QuadEncod { counter, inputs: [a, b], zero, dir, zero_kind, turn, .. } = element else { return };
        let counter = self.word(counter);
        let (a, b, dir) = (self.symbol_bit(a), self.symbol_bit(b), dir.as_ref().map(|name| self.symbol_bit(name)));
        let [old_a, old_b] = ["A", "B"].map(|what| self.new_bit(self.element_name(what), BitRole::Memory));
        let turn = i32::try_from(*turn).unwrap_or(i32::MAX);
        let ticks = (zero.is_some() && turn > 0).then(|| self.memory_word("ticks", min_bytes(turn)));
        let step = |up: bool| {
            let op = if up { ArithmeticOp::Add } else { ArithmeticOp::Sub };
            let mut ops: Vec<IrOp> =
                [Some(counter), ticks].into_iter().flatten().map(|word| step_word(word, op)).collect();
            ops.extend(dir.map(|bit| IrOp::SetBit { bit, value: up }));
            ops.push(IrOp::SetAccumulator(true));
            ops
        };
        // B has changed and A has not: up where they differ now.
        let when_b = |value: bool| IrOp::If {
            cond: BranchCondition::Bit(a),
            if_true: vec![if_bit(old_a, true, step(!value))],
            if_false: vec![if_bit(old_a, false, step(value))],
        };
        let mut ops = vec![
            IrOp::SetAccumulator(false),
            IrOp::If {
                cond: BranchCondition::Bit(b),
                if_true: vec![if_bit(old_b, false, vec![when_b(true)])],
                if_false: vec![if_bit(old_b, true, vec![when_b(false)])],
            },
            copy_bit(old_a, a),
            copy_bit(old_b, b),
        ];
        if let Some(zero) = zero {
            let zero = self.symbol_bit(zero);
            let old = self.new_bit(self.element_name("Z"), BitRole::Memory);
            let pass = self.pass_zero(counter, turn, ticks);
            ops.push(match zero_kind {
                '/' => if_bit(zero, true, vec![if_bit(old, false, pass)]),
                '\\' => if_bit(zero, false, vec![if_bit(old, true, pass)]),
                '-' => if_bit(zero, true, pass),
                _ => if_bit(zero, false, pass),
            });
            ops.push(copy_bit(old, zero));
        }
        self.push(if_accumulator(ops));
    }

    /// What the zero mark does: clears the counter, or sets it to whole turns after at least half a turn.
    fn pass_zero(&mut self, counter: WordId, turn: i32, ticks: Option<WordId>) -> Vec<IrOp> {
        let mut ops = vec![IrOp::SetAccumulator(true)];
        let Some(ticks) = ticks else {
            ops.push(copy(counter, WordOperand::Const(0)));
            return ops;
        };
        let turns = self.memory_word("turns", self.ir.bytes(counter));
        let round = |op| {
            let (a, b) = (WordOperand::Cell(turns), WordOperand::Const(turn));
            let product = IrOp::Math { op: ArithmeticOp::Mul, dst: counter, a, b };
            vec![step_word(turns, op), product, copy(ticks, WordOperand::Const(0))]
        };
        let half = WordOperand::Const(turn / 2);
        let back = self.if_comparison(
            CompareOp::Les,
            ticks.into(),
            WordOperand::Const(-(turn / 2)),
            round(ArithmeticOp::Sub),
            Vec::new(),
        );
        ops.extend(self.if_comparison(CompareOp::Grt, ticks.into(), half, round(ArithmeticOp::Add), back));
        ops
    }
}
