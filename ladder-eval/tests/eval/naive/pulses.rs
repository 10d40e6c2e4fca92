//! PULSER, NPULSE, STEPPER and QUAD_ENCOD of the naive interpreter.

use super::*;

/// A PULSER: pulses left, lengths of ones and zeros, scans since this pulse began.
#[derive(Clone, Copy, Default)]
pub(super) struct NaivePulser {
    left: i64,
    long: i64,
    short: i64,
    elapsed: i64,
}

/// A QUAD_ENCOD: A and B as a number, the zero mark, steps since it, turns.
#[derive(Clone, Copy, Default)]
pub(super) struct NaiveEncoder {
    position: usize,
    zero: bool,
    ticks: i64,
    turns: i64,
}

/// Steps by old and new position, each A + 2 B.
const STEPS: [i64; 16] = [0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, 0, 0, 1, 0, 0];

impl NaiveInterpreter {
    pub(super) fn pulser(&mut self, operands: [&LadderOperand; 4], coil: &str, power: bool) -> bool {
        let [high, low, accel, count] = operands.map(|operand| self.operand_value(operand));
        let mut now = self.pulsers.get(&self.current_element).copied().unwrap_or_default();
        if now.left < 1 && power {
            let length = |scans: i64| wrap_to_bits(scans * accel, 16);
            now = NaivePulser { left: wrap_to_bits(count, 16), long: length(high), short: length(low), elapsed: 0 };
        }
        let runs = now.left > 0;
        self.bits.insert(coil.to_owned(), runs && now.elapsed < now.long);
        if runs {
            now.elapsed += 1;
            if now.elapsed >= now.long.max(0) + now.short.max(1) {
                let longer = |scans: i64, least: i64| if scans > least { wrap_to_bits(scans + 1, 16) } else { scans };
                let (long, short) = (longer(now.long, high), longer(now.short, low));
                now = NaivePulser { left: now.left - 1, long, short, elapsed: 0 };
            }
        }
        self.pulsers.insert(self.current_element, now);
        runs
    }

    pub(super) fn npulse(
        &mut self,
        count: &LadderOperand,
        hertz: &LadderOperand,
        coil: &str,
        (power, program): (bool, &LadderProgram),
    ) -> bool {
        let half = 500_000 / self.operand_value(hertz) / program.settings.cycle_us as i64;
        let mut left = self.trains.remove(&self.current_element).unwrap_or(0);
        if left == 0 && power {
            left = self.operand_value(count).max(0) * 2 * half;
        }
        self.bits.insert(coil.to_owned(), left > 0 && (left - 1) / half % 2 == 1);
        if left > 1 {
            self.trains.insert(self.current_element, left - 1);
        }
        left > 0
    }

    pub(super) fn stepper(
        &mut self,
        name: &str,
        [max, period]: [&LadderOperand; 2],
        coil: &str,
        (power, before): (bool, bool),
    ) -> bool {
        let (left, scans) = (format!("C{name}Dec"), format!("C{name}P"));
        let each = matches!(period, LadderOperand::Const { value: 1, .. });
        self.remembered.insert(self.current_element, power);
        if power && !before && self.integer(&left) <= 0 {
            self.store(&left, self.operand_value(max));
            if !each {
                self.store(&scans, 1);
            }
        }
        let runs = self.integer(&left) > 0;
        if runs {
            if !each {
                self.store(&scans, self.integer(&scans) - 1);
            }
            if each || self.integer(&scans) <= 0 {
                self.bits.insert(coil.to_owned(), false);
                self.store(&left, self.integer(&left) - 1);
                if !each {
                    self.store(&scans, self.operand_value(period));
                }
            }
        }
        runs
    }

    pub(super) fn encoder(&mut self, element: &Element) -> bool {
        let Element::QuadEncod { counter, inputs: [a, b], zero, dir, zero_kind, turn, .. } = element else {
            panic!("no encoder")
        };
        let turn = i64::from(*turn);
        let mut now = self.encoders.get(&self.current_element).copied().unwrap_or_default();
        let position = usize::from(self.bit(a)) + 2 * usize::from(self.bit(b));
        let step = STEPS[4 * now.position + position];
        now.position = position;
        if step != 0 {
            self.store(counter, self.integer(counter) + step);
            now.ticks = wrap_to_bits(now.ticks + step, if turn < 128 { 8 } else { 16 });
            dir.iter().for_each(|name| _ = self.bits.insert(name.clone(), step == 1));
        }
        let mut marked = false;
        if let Some(name) = zero {
            let level = self.bit(name);
            marked = matches!(
                (zero_kind, now.zero, level),
                ('/', false, true) | ('\\', true, false) | ('-', _, true) | ('o', _, false)
            );
            now.zero = level;
        }
        if marked && turn == 0 {
            self.store(counter, 0);
        } else if marked && now.ticks.abs() > turn / 2 {
            now.turns = wrap_to_bits(now.turns + now.ticks.signum(), 8 * self.widths[counter]);
            now.ticks = 0;
            self.store(counter, now.turns * turn);
        }
        self.encoders.insert(self.current_element, now);
        step != 0 || marked
    }
}
