//! Timers and counters: as blocks where a block does the same, else step by step.

use crate::il::{IecType, IlBinaryOperator, IlName, IlOperation, IlValue, StandardBlock};
use crate::model::{CounterKind, Element, LadderOperand, TimerKind};

use super::emitter::{IlEmitter, RungBit};

fn constant(value: i64) -> LadderOperand {
    LadderOperand::Const { value, text: String::new() }
}

/// A condition of a step: relays, each as it is or complemented, of which all must agree.
type StepCondition<'a> = &'a [(&'a str, bool)];

impl IlEmitter<'_> {
    /// Emits a timer.
    pub(super) fn timer(&mut self, element: &Element, is_needed: bool) {
        let Element::Timer { kind, name, delay, adjust } = element else { return };
        if let Some(delay) = self.facts.block_delay(element) {
            return self.timer_block(*kind, name, delay, is_needed);
        }
        let limit = match delay {
            LadderOperand::Const { .. } => {
                let preset = self.facts.preset(delay, adjust.as_ref());
                if preset.is_none_or(|preset| preset > self.facts.max_of(name)) {
                    let cause = format!("the timer `{name}` counts more scans than its integer holds");
                    return self.refuse(cause, "give a shorter delay, or a longer cycle");
                }
                // Below 1 the timer has expired at once, as with 0.
                constant(preset.unwrap_or(0).max(0))
            }
            // LDmicro 5 has expired at once.
            LadderOperand::Var(_) if matches!(kind, TimerKind::Rto | TimerKind::Rtl) => constant(-1),
            LadderOperand::Var(_) => delay.clone(),
        };
        if *kind == TimerKind::Tof && !self.facts.is_ldmicro5() {
            self.preset_at_first(name, &limit);
        }
        let now = self.save();
        let runs = self.scratch();
        let iec_type = self.type_of(name);
        let wide = [iec_type, self.operand_type(&limit)].into_iter().max_by_key(IecType::bits).unwrap_or(IecType::Int);
        self.load_as(&LadderOperand::Var(name.clone()), &wide);
        self.combine_as(IlBinaryOperator::Lt, &limit, &wide);
        self.bit = RungBit::Loaded;
        self.store(&runs);
        let (now, runs) = (now.as_str(), runs.as_str());
        match kind {
            TimerKind::Ton => {
                self.count_if(&[(now, true), (runs, true)], name);
                self.clear_if(&[(now, false)], name);
                self.load_conditions(&[(now, true), (runs, false)], is_needed);
            }
            TimerKind::Tof => {
                self.count_if(&[(now, false), (runs, true)], name);
                self.clear_if(&[(now, true)], name);
                if is_needed {
                    self.load_bit(now);
                    self.combine(IlBinaryOperator::Or, false, runs);
                }
            }
            TimerKind::Rto => {
                self.count_if(&[(now, true), (runs, true)], name);
                self.load_conditions(&[(runs, false)], is_needed);
            }
            TimerKind::Rtl => {
                self.count_if(&[(now, false), (runs, true)], name);
                self.load_conditions(&[(runs, false)], is_needed);
            }
            TimerKind::Tcy => self.cyclic_timer(name, now, runs, is_needed),
            TimerKind::Thi => self.high_timer(name, now, runs, is_needed),
            TimerKind::Tlo => self.low_timer(name, now, runs, is_needed),
        }
    }

    fn timer_block(&mut self, kind: TimerKind, name: &str, milliseconds: i64, is_needed: bool) {
        self.ensure_loaded();
        let block = if kind == TimerKind::Tof { StandardBlock::Tof } else { StandardBlock::Ton };
        let instance = IlName { text: self.names.name(name), pos: self.pos };
        let preset = self.literal(IlValue::Time(milliseconds * 1_000_000), None);
        self.emit(IlOperation::ShortBlock { block, instance: instance.clone(), preset });
        if is_needed {
            self.load_output(&instance.text, false);
        }
    }

    /// A TOF of release 2.3 begins with its preset when it is executed for the first time.
    fn preset_at_first(&mut self, name: &str, limit: &LadderOperand) {
        let saved = if self.bit == RungBit::Loaded { Some(self.save()) } else { None };
        let ran = self.add_variable("Ran", IecType::Bool);
        self.load_not(&ran);
        self.if_result(|emitter| {
            emitter.move_to(name, limit);
            emitter.bit = RungBit::One;
            emitter.ensure_loaded();
            emitter.store(&ran);
        });
        match saved {
            Some(saved) => self.load_bit(&saved),
            None => self.bit = RungBit::One,
        }
    }

    /// Loads whether all conditions hold.
    fn load_conditions(&mut self, conditions: StepCondition<'_>, is_needed: bool) {
        for (index, (relay, value)) in conditions.iter().enumerate().filter(|_| is_needed) {
            let operand = self.variable(relay, None);
            match index {
                0 => self.load(operand, !value),
                _ => self.binary(IlBinaryOperator::And, !value, operand),
            }
        }
        self.bit = RungBit::Loaded;
    }

    /// Counts a scan if all conditions hold.
    fn count_if(&mut self, conditions: StepCondition<'_>, name: &str) {
        self.load_conditions(conditions, true);
        self.if_result(|emitter| emitter.add(name, 1));
    }

    fn clear_if(&mut self, conditions: StepCondition<'_>, name: &str) {
        self.load_conditions(conditions, true);
        self.if_result(|emitter| emitter.move_to(name, &constant(0)));
    }

    fn set_if(&mut self, conditions: StepCondition<'_>, relay: &str, value: bool) {
        self.load_conditions(conditions, true);
        let target = self.variable(relay, None);
        self.emit(if value { IlOperation::Set(target) } else { IlOperation::Reset(target) });
    }

    /// TCY: changes its output each time that it has counted.
    fn cyclic_timer(&mut self, name: &str, now: &str, runs: &str, is_needed: bool) {
        let out = self.add_variable("Out", IecType::Bool);
        self.count_if(&[(now, true), (runs, true)], name);
        self.clear_if(&[(now, false)], name);
        self.clear_if(&[(runs, false)], name);
        self.load_conditions(&[(now, true), (runs, false)], true);
        self.combine(IlBinaryOperator::Xor, false, &out);
        self.store(&out);
        self.load_conditions(&[(now, true), (&out, true)], is_needed);
    }

    /// THI: one pulse of ones.
    fn high_timer(&mut self, name: &str, now: &str, runs: &str, is_needed: bool) {
        let pulse = self.add_variable("Pulse", IecType::Bool);
        let out = self.scratch();
        self.set_if(&[(now, true)], &pulse, true);
        self.load_conditions(&[(&pulse, true), (runs, true)], true);
        self.store(&out);
        self.count_if(&[(&out, true)], name);
        let ends = [(pulse.as_str(), true), (runs, false), (now, false)];
        self.clear_if(&ends, name);
        self.set_if(&ends, &pulse, false);
        self.load_conditions(&[(&out, true)], is_needed);
    }

    /// TLO: one pulse of zeros.
    fn low_timer(&mut self, name: &str, now: &str, runs: &str, is_needed: bool) {
        let (pulse, high) = (self.add_variable("Pulse", IecType::Bool), self.add_variable("High", IecType::Bool));
        let out = self.scratch();
        self.set_if(&[(now, true)], &high, true);
        self.set_if(&[(now, false), (&high, true)], &pulse, true);
        // The output is 1 if the pulse is over, or if there is none and there was a 1.
        self.load_conditions(&[(&pulse, false), (&high, true)], true);
        self.store(&out);
        self.set_if(&[(&pulse, true), (runs, false)], &out, true);
        self.count_if(&[(&pulse, true), (runs, true)], name);
        let ends = [(pulse.as_str(), true), (runs, false), (now, true)];
        self.clear_if(&ends, name);
        self.set_if(&ends, &pulse, false);
        self.load_conditions(&[(&out, true)], is_needed);
    }

    /// Emits a counter.
    pub(super) fn counter(&mut self, element: &Element, is_needed: bool) {
        let Element::Counter { kind, name, max, init, input } = element else { return };
        if let Some(LadderOperand::Var(start)) = init {
            let cause = format!("the counter `{name}` begins with the variable `{start}`");
            return self.refuse(cause, "give a constant start value");
        }
        let start = init.clone().unwrap_or_else(|| constant(0));
        // CTC of release 2.3 passes the rung bit.
        let passes = *kind == CounterKind::Ctc && !self.facts.is_ldmicro5();
        let saved = if passes && is_needed && self.bit == RungBit::Loaded { Some(self.save()) } else { None };
        self.ensure_loaded();
        self.counting_event(*input);
        let is_carry = self.facts.is_ldmicro5() && matches!(kind, CounterKind::Ctc | CounterKind::Ctr);
        let carry = is_carry.then(|| self.scratch());
        let events = self.save();
        if let Some(carry) = &carry {
            let zero = self.bool_literal(false);
            self.load(zero, false);
            self.store(carry);
        }
        self.load_bit(&events);
        self.if_result(|emitter| emitter.counter_step(*kind, name, max, &start, carry.as_deref()));
        if !is_needed {
            return;
        }
        match (carry, *kind) {
            (Some(carry), _) => self.load_bit(&carry),
            (None, CounterKind::Ctc) => match saved {
                Some(saved) => self.load_bit(&saved),
                None => self.bit = RungBit::One,
            },
            (None, kind) => {
                // CTD of release 2.3 compares as CTU does.
                let is_floor = kind == CounterKind::Ctd && self.facts.is_ldmicro5();
                let operator = if is_floor { IlBinaryOperator::Gt } else { IlBinaryOperator::Ge };
                self.load_comparison(name, operator, max);
            }
        }
    }

    /// Makes the current result 1 if the counter counts.
    fn counting_event(&mut self, input: Option<char>) {
        match input {
            Some('-') => {}
            Some('o') => self.emit(IlOperation::Not),
            Some('\\') => {
                let last = self.add_variable("Last", IecType::Bool);
                let (now, event) = (self.save(), self.scratch());
                self.load_conditions(&[(&now, false), (&last, true)], true);
                self.store(&event);
                self.load_bit(&now);
                self.store(&last);
                self.load_bit(&event);
            }
            _ => {
                let edge = self.edge();
                self.load_output(&edge, false);
            }
        }
    }

    fn load_comparison(&mut self, name: &str, operator: IlBinaryOperator, limit: &LadderOperand) {
        let types = [self.type_of(name), self.operand_type(limit)];
        let wide = types.into_iter().max_by_key(IecType::bits).unwrap_or(IecType::Int);
        self.load_as(&LadderOperand::Var(name.to_owned()), &wide);
        self.combine_as(operator, limit, &wide);
        self.bit = RungBit::Loaded;
    }

    fn counter_step(
        &mut self,
        kind: CounterKind,
        name: &str,
        max: &LadderOperand,
        start: &LadderOperand,
        carry: Option<&str>,
    ) {
        let is_bounded = self.facts.is_ldmicro5();
        match kind {
            CounterKind::Ctu if is_bounded => {
                self.load_comparison(name, IlBinaryOperator::Lt, max);
                self.if_result(|emitter| emitter.add(name, 1));
            }
            CounterKind::Ctd if is_bounded => {
                self.load_comparison(name, IlBinaryOperator::Gt, max);
                self.if_result(|emitter| emitter.add(name, -1));
            }
            CounterKind::Ctu => self.add(name, 1),
            CounterKind::Ctd => self.add(name, -1),
            CounterKind::Ctc if !is_bounded => {
                let (again, end) = (self.new_label(), self.new_label());
                self.load_comparison(name, IlBinaryOperator::Ge, max);
                self.jump(crate::il::IlCondition::IfTrue, &again);
                self.add(name, 1);
                self.jump(crate::il::IlCondition::Always, &end);
                self.label(again);
                self.move_to(name, &constant(0));
                self.label(end);
            }
            CounterKind::Ctc | CounterKind::Ctr => {
                let (step, operator) =
                    if kind == CounterKind::Ctc { (1, IlBinaryOperator::Gt) } else { (-1, IlBinaryOperator::Lt) };
                self.add(name, step);
                self.load_comparison(name, operator, max);
                if let Some(carry) = carry {
                    self.store(carry);
                }
                self.if_result(|emitter| emitter.move_to(name, start));
            }
        }
    }

    /// Adds to an integer.
    fn add(&mut self, name: &str, step: i64) {
        let iec_type = self.type_of(name);
        self.load_as(&LadderOperand::Var(name.to_owned()), &iec_type);
        let operator = if step < 0 { IlBinaryOperator::Sub } else { IlBinaryOperator::Add };
        self.combine_as(operator, &constant(step.abs()), &iec_type);
        self.store_integer(name, &iec_type);
    }
}
