//! PULSER, NPULSE, STEPPER and QUAD_ENCOD (5.13).

use ladder::{Element, LadderOperand, stepper_counters};

use crate::UnsupportedReason;
use crate::flat_program::{ElementOp, FlatProgram, ScanState, ValueSource};
use crate::flatten::{FlatBuilder, require_absent_or_zero};

/// A PULSER: operands, and the symbol of its coil.
#[derive(Debug)]
pub(crate) struct FlatPulser {
    high: ValueSource,
    low: ValueSource,
    accel: ValueSource,
    count: ValueSource,
    coil: u32,
}

/// State of a PULSER, in 16 bits each.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PulserState {
    /// Pulses that are left.
    left: i16,
    /// Scans of this pulse that are 1 and 0.
    lengths: (i16, i16),
    /// Scans that are left of both.
    ones: i16,
    zeros: i16,
}

/// An NPULSE: operand, scans of half a pulse, and the symbol of its coil.
#[derive(Debug)]
pub(crate) struct FlatNpulse {
    count: ValueSource,
    half: u32,
    coil: u32,
}

/// State of an NPULSE.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct NpulseState {
    /// Pulses that are left, with the one that runs.
    left: i32,
    /// Scans of this pulse that have passed.
    passed: u32,
}

/// A STEPPER.
#[derive(Debug)]
pub(crate) struct FlatStepper {
    left: u32,
    scans: u32,
    max: ValueSource,
    period: ValueSource,
    coil: u32,
    memory: u32,
}

/// A QUAD_ENCOD. The memories are those of A, B and Z.
#[derive(Debug)]
pub(crate) struct FlatEncoder {
    counter: u32,
    inputs: [u32; 2],
    zero: Option<u32>,
    dir: Option<u32>,
    zero_kind: char,
    turn: i32,
    memories: [u32; 3],
}

/// State of a QUAD_ENCOD: steps since the last zero mark, and turns.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct EncoderState {
    ticks: i32,
    turns: i32,
}

/// Selects the operation of one of these elements.
pub(crate) fn pulse_op(builder: &mut FlatBuilder<'_>, element: &Element) -> Result<ElementOp, UnsupportedReason> {
    Ok(match element {
        Element::Pulser { high, low, accel, count, coil } => {
            let pulser = FlatPulser {
                high: builder.operand_source(high)?,
                low: builder.operand_source(low)?,
                accel: builder.operand_source(accel)?,
                count: builder.operand_source(count)?,
                coil: builder.bit_index(coil)?,
            };
            builder.code.pulsers.push(pulser);
            ElementOp::Pulser { pulser: builder.code.pulsers.len() as u32 - 1 }
        }
        Element::Npulse { count, hertz, coil } => {
            let cycle_us = builder.cycle_us()?;
            let hertz = match hertz {
                LadderOperand::Const { value, .. } => u64::try_from(*value).unwrap_or(0),
                LadderOperand::Var(_) => 0,
            };
            let half = 500_000_u64.checked_div(hertz.saturating_mul(cycle_us)).filter(|half| *half > 0);
            let half = half.and_then(|half| u32::try_from(half).ok());
            let npulse = FlatNpulse {
                count: builder.operand_source(count)?,
                half: half.ok_or(UnsupportedReason::BadPulseFrequency { cycle_us })?,
                coil: builder.bit_index(coil)?,
            };
            builder.code.npulses.push(npulse);
            ElementOp::Npulse { npulse: builder.code.npulses.len() as u32 - 1 }
        }
        Element::Stepper { name, max, period, graph, coil, .. } => {
            require_absent_or_zero("acceleration", Some(*graph))?;
            let [left, scans] = stepper_counters(name);
            let each = matches!(period, LadderOperand::Const { value: 1, .. });
            let stepper = FlatStepper {
                left: builder.integer_index(&left)?,
                scans: builder.integer_index(&scans)?,
                max: builder.operand_source(max)?,
                period: builder.operand_source(period)?,
                coil: builder.bit_index(coil)?,
                memory: builder.new_memory(),
            };
            builder.code.steppers.push(stepper);
            ElementOp::Stepper { stepper: builder.code.steppers.len() as u32 - 1, each }
        }
        Element::QuadEncod { counter, inputs: [a, b], zero, dir, zero_kind, turn, .. } => {
            let encoder = FlatEncoder {
                counter: builder.integer_index(counter)?,
                inputs: [builder.bit_index(a)?, builder.bit_index(b)?],
                zero: zero.as_deref().map(|name| builder.bit_index(name)).transpose()?,
                dir: dir.as_deref().map(|name| builder.bit_index(name)).transpose()?,
                zero_kind: *zero_kind,
                turn: i32::try_from(*turn).unwrap_or(i32::MAX),
                memories: [builder.new_memory(), builder.new_memory(), builder.new_memory()],
            };
            builder.code.encoders.push(encoder);
            ElementOp::Encoder { encoder: builder.code.encoders.len() as u32 - 1 }
        }
        // The caller passes only the elements above.
        _ => return Err(UnsupportedReason::NoMeaning),
    })
}

impl ScanState {
    /// Executes a PULSER: true while it has pulses left.
    pub(crate) fn pulse(&mut self, code: &FlatProgram, pulser: u32, rung: bool) -> bool {
        let of = &code.pulsers[pulser as usize];
        let mut now = self.pulsers[pulser as usize];
        let [high, low, accel, count] = [of.high, of.low, of.accel, of.count].map(|value| self.read_value(value));
        if rung && now.left < 1 {
            now.left = count as i16;
            now.lengths = (high.wrapping_mul(accel) as i16, low.wrapping_mul(accel) as i16);
            (now.ones, now.zeros) = now.lengths;
        }
        let runs = now.left >= 1;
        let one = runs && now.ones > 0;
        if one {
            now.ones -= 1;
        } else if runs && now.zeros > 1 {
            now.zeros -= 1;
        } else if runs {
            now.left -= 1;
            // The next pulse is one scan longer than this one, where it has been longer than without the
            // multiple.
            let longer = |length: i16, least: i32| length.wrapping_add(i16::from(i32::from(length) > least));
            now.lengths = (longer(now.lengths.0, high), longer(now.lengths.1, low));
            (now.ones, now.zeros) = now.lengths;
        }
        self.values[of.coil as usize] = i32::from(one);
        self.pulsers[pulser as usize] = now;
        runs
    }

    /// Executes an NPULSE: true while it has pulses left.
    pub(crate) fn pulse_at(&mut self, code: &FlatProgram, npulse: u32, rung: bool) -> bool {
        let of = &code.npulses[npulse as usize];
        let mut now = self.npulses[npulse as usize];
        if rung && now.left < 1 {
            now = NpulseState { left: self.read_value(of.count), passed: 0 };
        }
        let runs = now.left >= 1;
        self.values[of.coil as usize] = i32::from(runs && now.passed < of.half);
        if runs {
            now.passed += 1;
            if now.passed == 2 * of.half {
                now = NpulseState { left: now.left - 1, passed: 0 };
            }
        }
        self.npulses[npulse as usize] = now;
        runs
    }

    /// Executes a STEPPER; `each` if it steps in each scan. True while steps are left.
    pub(crate) fn step_motor(&mut self, code: &FlatProgram, stepper: u32, each: bool, rung: bool) -> bool {
        let of = &code.steppers[stepper as usize];
        let rises = rung & !self.replace_memory(of.memory, rung);
        if rises && self.read_symbol(of.left) < 1 {
            self.store(code, of.left, self.read_value(of.max).into());
            if !each {
                self.store(code, of.scans, 1);
            }
        }
        let left = self.read_symbol(of.left);
        if left < 1 {
            return false;
        }
        if !each {
            self.store(code, of.scans, i64::from(self.read_symbol(of.scans)) - 1);
        }
        if each || self.read_symbol(of.scans) < 1 {
            // The pulse ends at once.
            self.values[of.coil as usize] = 0;
            self.store(code, of.left, i64::from(left) - 1);
            if !each {
                self.store(code, of.scans, self.read_value(of.period).into());
            }
        }
        true
    }

    /// Executes a QUAD_ENCOD: true in a scan with a step or a zero mark.
    pub(crate) fn count_steps(&mut self, code: &FlatProgram, encoder: u32, rung: bool) -> bool {
        if !rung {
            return false;
        }
        let of = &code.encoders[encoder as usize];
        let [a, b] = of.inputs.map(|input| self.read_symbol(input) != 0);
        let same_a = self.replace_memory(of.memories[0], a) == a;
        let same_b = self.replace_memory(of.memories[1], b) == b;
        let mut out = false;
        if same_a && !same_b {
            let step = if a != b { 1 } else { -1 };
            self.store(code, of.counter, i64::from(self.read_symbol(of.counter)) + step);
            let state = &mut self.encoders[encoder as usize];
            let bits = if of.turn > i32::from(i8::MAX) { 16 } else { 24 };
            state.ticks = (state.ticks + step as i32) << bits >> bits;
            if let Some(dir) = of.dir {
                self.values[dir as usize] = i32::from(step > 0);
            }
            out = true;
        }
        let Some(zero) = of.zero else { return out };
        let now = self.read_symbol(zero) != 0;
        let before = self.replace_memory(of.memories[2], now);
        let fires = match of.zero_kind {
            '/' => now && !before,
            '\\' => !now && before,
            '-' => now,
            _ => !now,
        };
        if fires {
            self.pass_zero(code, encoder as usize, of);
        }
        out || fires
    }

    fn pass_zero(&mut self, code: &FlatProgram, encoder: usize, of: &FlatEncoder) {
        let EncoderState { ticks, turns } = self.encoders[encoder];
        if of.turn == 0 {
            return self.store(code, of.counter, 0);
        }
        let half = of.turn / 2;
        let turn = if ticks > half {
            1
        } else if ticks < -half {
            -1
        } else {
            return;
        };
        let bits = code.cut_bits[of.counter as usize];
        let turns = (turns + turn) << bits >> bits;
        self.encoders[encoder] = EncoderState { ticks: 0, turns };
        self.store(code, of.counter, i64::from(turns) * i64::from(of.turn));
    }
}
