//! What the conversion must know of the whole program before its first rung.

use std::collections::{BTreeMap, BTreeSet};

use crate::il::IecType;
use crate::integer_widths::{IntegerWidths, max_value, timer_preset};
use crate::model::{
    CounterKind, Element, FlowOp, LadderDialect, LadderOperand, LadderProgram, ProgramElement, SymbolKind, TimerKind,
};

/// Facts of a program of LDmicro.
pub(super) struct SourceFacts<'a> {
    program: &'a LadderProgram,
    widths: IntegerWidths<'a>,
    /// How many elements use each name.
    uses: BTreeMap<String, usize>,
    /// Values at power-up other than 0.
    pub starts: BTreeMap<&'a str, i64>,
    /// Rank and start value of the counter that says what RES stores.
    resets: BTreeMap<&'a str, (u8, LadderOperand)>,
    /// Whether a MASTER_RELAY is in the program.
    pub has_master: bool,
    /// Whether a LOCK is in the program.
    pub has_lock: bool,
    /// Whether a scan may leave elements out.
    pub has_jumps: bool,
    /// Indices of the rungs to which a GOTO leads.
    pub targets: BTreeSet<u32>,
}

impl<'a> SourceFacts<'a> {
    /// Collects the facts of a program.
    pub(super) fn new(program: &'a LadderProgram) -> SourceFacts<'a> {
        let mut facts = SourceFacts {
            program,
            widths: IntegerWidths::new(program),
            uses: BTreeMap::new(),
            starts: BTreeMap::new(),
            resets: BTreeMap::new(),
            has_master: false,
            has_lock: false,
            has_jumps: false,
            targets: BTreeSet::new(),
        };
        for ProgramElement { element, .. } in program.elements() {
            let names: BTreeSet<String> =
                element.facts().symbols.iter().map(|symbol| symbol.name.clone().into_owned()).collect();
            names.into_iter().for_each(|name| *facts.uses.entry(name).or_default() += 1);
            facts.has_master |= *element == Element::MasterRelay;
            facts.has_lock |= *element == Element::Lock;
            facts.has_jumps |= crate::flow::changes_order(element);
            if let Element::Flow { op: FlowOp::Goto, label } = element {
                facts.targets.extend(facts.target(label));
            }
            facts.add_start(element);
        }
        facts
    }

    /// Notes the values that a timer or counter has at power-up and after RES.
    fn add_start(&mut self, element: &'a Element) {
        match element {
            Element::Timer { kind: TimerKind::Tof, name, delay, adjust } if self.is_ldmicro5() => {
                let preset = match delay {
                    LadderOperand::Const { .. } => timer_preset(self.program, delay, adjust.as_ref()),
                    LadderOperand::Var(_) => Some(-1),
                };
                if let Some(preset) = preset.and_then(|preset| i64::try_from(preset).ok()) {
                    self.starts.insert(name, self.type_of(name).map_or(preset, |iec_type| iec_type.wrap(preset)));
                }
            }
            Element::Counter { kind, name, init, .. } => {
                let rank = match kind {
                    CounterKind::Ctu => 0,
                    CounterKind::Ctd => 1,
                    CounterKind::Ctc => 2,
                    CounterKind::Ctr => 3,
                };
                let start = init.clone().unwrap_or(LadderOperand::Const { value: 0, text: "0".to_owned() });
                if let LadderOperand::Const { value, .. } = start {
                    self.starts.insert(name, self.type_of(name).map_or(value, |iec_type| iec_type.wrap(value)));
                }
                let slot = self.resets.entry(name).or_insert((rank, start.clone()));
                if rank < slot.0 {
                    *slot = (rank, start);
                }
            }
            // No other element has a start value.
            _ => {}
        }
    }

    /// Returns true if the dialect is that of LDmicro 5.
    pub(super) fn is_ldmicro5(&self) -> bool {
        self.program.dialect == LadderDialect::Ldmicro5
    }

    /// Index of the rung to which a GOTO leads; `None` for the end of the scan.
    pub(super) fn target(&self, label: &str) -> Option<u32> {
        crate::flow::ProgramFlow::new(self.program)
            .target(label)
            .filter(|rung| (*rung as usize) < self.program.rungs.len())
    }

    /// Type of an integer; `None` if no type of IEC 61131-3 has its width.
    pub(super) fn type_of(&self, name: &str) -> Option<IecType> {
        type_of_bytes(self.widths.bytes_of_symbol(name))
    }

    /// Width of an operand in bytes.
    pub(super) fn bytes_of(&self, operand: &LadderOperand) -> u8 {
        match self.program.dialect {
            LadderDialect::Ldmicro23 => 2,
            LadderDialect::Ldmicro5 | LadderDialect::Iec => self.widths.bytes_of_operand(operand),
        }
    }

    /// What RES stores in dialect ldmicro-5.
    pub(super) fn reset_value(&self, name: &str) -> LadderOperand {
        let zero = LadderOperand::Const { value: 0, text: "0".to_owned() };
        let start = self.resets.get(name).filter(|_| self.is_ldmicro5() && name.starts_with('C'));
        start.map_or(zero, |(_, start)| start.clone())
    }

    /// P of a timer with a constant delay.
    pub(super) fn preset(&self, delay: &LadderOperand, adjust: Option<&LadderOperand>) -> Option<i64> {
        timer_preset(self.program, delay, adjust).and_then(|preset| i64::try_from(preset).ok())
    }

    /// Largest number of an integer.
    pub(super) fn max_of(&self, name: &str) -> i64 {
        i64::try_from(max_value(self.widths.bytes_of_symbol(name))).unwrap_or(i64::MAX)
    }

    /// PT in milliseconds of the block that does the same as a timer element; `None` if none does.
    ///
    /// A block counts time and not executions, and its count is not an integer of the program. So the element
    /// must be executed in every scan, and nothing else may use its name.
    pub(super) fn block_delay(&self, element: &Element) -> Option<i64> {
        let Element::Timer { kind: TimerKind::Ton | TimerKind::Tof, name, delay, adjust } = element else {
            return None;
        };
        let preset = self.preset(delay, adjust.as_ref()).filter(|preset| (1..=self.max_of(name)).contains(preset))?;
        let cycle = i64::try_from(self.program.settings.cycle_us).ok().filter(|cycle| cycle % 1000 == 0)? / 1000;
        let delay = preset.checked_mul(cycle).filter(|delay| *delay <= i64::from(i32::MAX))?;
        (!self.has_jumps && self.uses.get(name.as_str()) == Some(&1)).then_some(delay)
    }

    /// Names of the timers that become blocks, with the keyword of the block.
    pub(super) fn block_timers(&self) -> BTreeMap<&'a str, TimerKind> {
        let elements = self.program.elements().filter(|at| self.block_delay(at.element).is_some());
        elements
            .filter_map(|at| match at.element {
                Element::Timer { kind, name, .. } => Some((name.as_str(), *kind)),
                _ => None,
            })
            .collect()
    }

    /// The symbols of the program: name and kind.
    pub(super) fn symbols(&self) -> Vec<(String, SymbolKind)> {
        self.program.symbols().into_iter().map(|symbol| (symbol.name, symbol.kind)).collect()
    }
}

/// The signed type of a width.
pub(super) fn type_of_bytes(bytes: u8) -> Option<IecType> {
    match bytes {
        1 => Some(IecType::Sint),
        2 => Some(IecType::Int),
        4 => Some(IecType::Dint),
        _ => None,
    }
}
