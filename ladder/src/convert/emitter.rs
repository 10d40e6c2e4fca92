//! Emits lines of Instruction List, and keeps account of the rung bit.

use std::collections::BTreeMap;

use diag::{Diagnostic, Pos, Severity};

use crate::il::{
    IecType, IlBinaryOperand, IlBinaryOperator, IlCondition, IlInstruction, IlLiteral, IlName, IlOperand,
    IlOperandKind, IlOperation, IlProgram, IlSection, IlValue, IlVariable, StandardBlock,
};
use crate::model::{LadderProgram, SymbolKind, TimerKind};

use super::facts::SourceFacts;
use super::names::NameTable;
use super::{SECTIONS, codes};

/// Where the rung bit is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RungBit {
    /// It is 1 and not loaded.
    One,
    /// It is the current result.
    Loaded,
}

/// State of one conversion.
pub(super) struct IlEmitter<'a> {
    /// The program in work.
    pub source: &'a LadderProgram,
    /// What is known of it.
    pub facts: &'a SourceFacts<'a>,
    /// Its names.
    pub names: NameTable,
    /// Lines so far.
    lines: Vec<IlInstruction>,
    /// Variables that the conversion adds: name, type, and initial value of a BOOL.
    added: Vec<(String, IecType)>,
    /// Relays for rung bits, which every rung uses again.
    powers: Vec<String>,
    /// Number of these relays that the rung in work uses.
    powers_used: usize,
    /// Label that the next line gets.
    pending_label: Option<String>,
    /// Labels of the rungs to which a GOTO leads.
    pub rung_labels: BTreeMap<u32, String>,
    /// Relay of MASTER_RELAY.
    pub master: Option<String>,
    /// Relay that LOCK sets.
    pub lock: Option<String>,
    /// Where the rung bit is.
    pub bit: RungBit,
    /// Position of the element in work.
    pub pos: Pos,
    /// What was found so far.
    pub diagnostics: Vec<Diagnostic>,
}

impl<'a> IlEmitter<'a> {
    /// Returns an emitter without instructions.
    pub(super) fn new(source: &'a LadderProgram, facts: &'a SourceFacts<'a>, names: NameTable) -> Self {
        IlEmitter {
            source,
            facts,
            names,
            lines: Vec::new(),
            added: Vec::new(),
            powers: Vec::new(),
            powers_used: 0,
            pending_label: None,
            rung_labels: BTreeMap::new(),
            master: None,
            lock: None,
            bit: RungBit::One,
            pos: Pos::default(),
            diagnostics: Vec::new(),
        }
    }

    /// Reports an element that Instruction List cannot express.
    pub(super) fn refuse(&mut self, cause: impl Into<String>, hint: &str) {
        let file = &self.source.file;
        self.diagnostics.push(Diagnostic::new(Severity::Error, codes::NOT_CONVERTED, file, self.pos, cause, hint));
    }

    /// Adds a note.
    pub(super) fn note(&mut self, code: &'static str, pos: Pos, cause: impl Into<String>, hint: &str) {
        self.diagnostics.push(Diagnostic::new(Severity::Note, code, &self.source.file, pos, cause, hint));
    }

    /// Adds a line.
    pub(super) fn emit(&mut self, operation: IlOperation) {
        let label = self.pending_label.take().map(|text| IlName { text, pos: self.pos });
        self.lines.push(IlInstruction { label, operation: Some(operation), comment: None, pos: self.pos });
    }

    /// Adds a line with a comment.
    pub(super) fn comment(&mut self, text: &str) {
        for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
            // Comments do not nest.
            let comment = Some(line.replace("(*", "( *").replace("*)", "* )"));
            self.lines.push(IlInstruction { label: None, operation: None, comment, pos: self.pos });
        }
    }

    /// Gives the next line a label.
    pub(super) fn label(&mut self, label: String) {
        if let Some(text) = self.pending_label.replace(label) {
            let label = Some(IlName { text, pos: self.pos });
            self.lines.push(IlInstruction { label, operation: None, comment: None, pos: self.pos });
        }
    }

    /// Returns an unused label.
    pub(super) fn new_label(&mut self) -> String {
        self.names.add("L")
    }

    /// JMP, JMPC or JMPCN.
    pub(super) fn jump(&mut self, condition: IlCondition, label: &str) {
        let label = IlName { text: label.to_owned(), pos: self.pos };
        self.emit(IlOperation::Jump { condition, label });
    }

    /// Adds a variable.
    pub(super) fn add_variable(&mut self, stem: &'static str, iec_type: IecType) -> String {
        let name = self.names.add(stem);
        self.added.push((name.clone(), iec_type));
        name
    }

    /// Returns a relay that holds a bit until the end of the rung.
    pub(super) fn scratch(&mut self) -> String {
        if self.powers_used == self.powers.len() {
            let name = self.add_variable("Power", IecType::Bool);
            self.powers.push(name);
        }
        self.powers_used += 1;
        self.powers.get(self.powers_used - 1).cloned().unwrap_or_default()
    }

    /// Begins a rung: its relays are free.
    pub(super) fn begin_rung(&mut self) {
        self.powers_used = 0;
    }

    /// Returns a variable or a part of an instance as an operand.
    pub(super) fn variable(&self, name: &str, member: Option<&str>) -> IlOperand {
        let kind = IlOperandKind::Variable { name: name.to_owned(), member: member.map(str::to_owned) };
        IlOperand { kind, pos: self.pos }
    }

    /// Returns a symbol of the source as an operand.
    pub(super) fn symbol(&self, name: &str) -> IlOperand {
        self.variable(&self.names.name(name), None)
    }

    /// Returns a literal as an operand.
    pub(super) fn literal(&self, value: IlValue, prefix: Option<IecType>) -> IlOperand {
        IlOperand { kind: IlOperandKind::Literal(IlLiteral { prefix, value }), pos: self.pos }
    }

    /// Returns TRUE or FALSE as an operand.
    pub(super) fn bool_literal(&self, value: bool) -> IlOperand {
        self.literal(IlValue::Bool(value), None)
    }

    /// Returns a number of a type, wrapped to its range, as an operand.
    pub(super) fn number(&self, value: i64, iec_type: &IecType) -> IlOperand {
        let value = IlValue::Integer { value: iec_type.wrap(value), base: 10 };
        self.literal(value, Some(iec_type.clone()))
    }

    /// LD or LDN.
    pub(super) fn load(&mut self, operand: IlOperand, negated: bool) {
        self.emit(IlOperation::Load { negated, operand });
    }

    /// LD of a relay or of an output of an instance; then the rung bit is loaded.
    pub(super) fn load_bit(&mut self, name: &str) {
        let operand = self.variable(name, None);
        self.load(operand, false);
        self.bit = RungBit::Loaded;
    }

    /// LDN of a relay; then the rung bit is loaded.
    pub(super) fn load_not(&mut self, name: &str) {
        let operand = self.variable(name, None);
        self.load(operand, true);
        self.bit = RungBit::Loaded;
    }

    /// LD or LDN of the output Q of an instance; then the rung bit is loaded.
    pub(super) fn load_output(&mut self, instance: &str, negated: bool) {
        let operand = self.variable(instance, Some("Q"));
        self.load(operand, negated);
        self.bit = RungBit::Loaded;
    }

    /// An operator with an operand.
    pub(super) fn binary(&mut self, operator: IlBinaryOperator, negated: bool, operand: IlOperand) {
        self.emit(IlOperation::Binary { operator, negated, operand: IlBinaryOperand::Value(operand) });
    }

    /// AND, OR or XOR with a relay.
    pub(super) fn combine(&mut self, operator: IlBinaryOperator, negated: bool, name: &str) {
        let operand = self.variable(name, None);
        self.binary(operator, negated, operand);
    }

    /// Opens a parenthesis.
    pub(super) fn open(&mut self, operator: IlBinaryOperator) {
        self.emit(IlOperation::Binary { operator, negated: false, operand: IlBinaryOperand::Deferred(None) });
    }

    /// ST.
    pub(super) fn store(&mut self, name: &str) {
        let target = self.variable(name, None);
        self.emit(IlOperation::Store { negated: false, target });
    }

    /// Loads the rung bit if it is the 1 of the left rail.
    pub(super) fn ensure_loaded(&mut self) {
        if self.bit == RungBit::One {
            let one = self.bool_literal(true);
            self.load(one, false);
            self.bit = RungBit::Loaded;
        }
    }

    /// Stores the rung bit in a relay and returns its name.
    pub(super) fn save(&mut self) -> String {
        self.ensure_loaded();
        let name = self.scratch();
        self.store(&name);
        name
    }

    /// Emits lines that are executed if the rung bit is 1. Then the rung bit is loaded again, if it is
    /// needed.
    pub(super) fn if_powered(&mut self, is_needed: bool, lines: impl FnOnce(&mut Self)) {
        if self.bit == RungBit::One {
            return lines(self);
        }
        let saved = is_needed.then(|| self.save());
        let label = self.new_label();
        self.jump(IlCondition::IfFalse, &label);
        lines(self);
        self.label(label);
        if let Some(saved) = saved {
            self.load_bit(&saved);
        }
    }

    /// Emits lines that are executed if a bit is 1, which is the current result.
    pub(super) fn if_result(&mut self, lines: impl FnOnce(&mut Self)) {
        let label = self.new_label();
        self.jump(IlCondition::IfFalse, &label);
        lines(self);
        self.label(label);
    }

    /// Returns the program with its declarations, the changed names and the notes.
    pub(super) fn finish(mut self) -> (IlProgram, Vec<(String, String)>, Vec<Diagnostic>) {
        if let Some(text) = self.pending_label.take() {
            let label = Some(IlName { text, pos: self.pos });
            self.lines.push(IlInstruction { label, operation: None, comment: None, pos: self.pos });
        }
        let renamed = self.names.renamed();
        for (from, to) in &renamed {
            let element = self.source.elements().find(|at| at.element.facts().symbols.iter().any(|s| s.name == *from));
            let line = self.source.io.iter().find(|entry| entry.name == *from).map(|entry| entry.pos);
            let pos = element.map(|at| at.pos).or(line).unwrap_or_default();
            self.note(codes::RENAMED, pos, format!("`{from}` is `{to}` in Instruction List"), "nothing to do");
        }
        self.note_settings();
        let variables = self.variables();
        let program = IlProgram {
            file: self.source.file.clone(),
            name: None,
            remarks: Vec::new(),
            variables,
            instructions: self.lines,
        };
        (program, renamed, self.diagnostics)
    }

    /// Notes what the head of the source says and Instruction List does not.
    fn note_settings(&mut self) {
        let settings = &self.source.settings;
        let mut flags = Vec::new();
        if let Some(chip) = settings.micro.as_deref().and_then(crate::chip_of) {
            flags.push(format!("--mcu {chip}"));
        }
        let cycle = settings.cycle_us;
        if cycle != crate::IL_CYCLE_US {
            let decimals = format!("{:03}", cycle % 1000);
            let decimals = decimals.trim_end_matches('0');
            let point = if decimals.is_empty() { "" } else { "." };
            flags.push(format!("--cycle {}{point}{decimals}", cycle / 1000));
        }
        flags.push(format!("--clock {}", settings.crystal_hz));
        for entry in self.source.io.iter().filter(|entry| entry.pin != 0) {
            let pin = settings.micro.as_deref().and_then(|micro| crate::package_pin_name(micro, entry.pin));
            flags.extend(pin.map(|pin| format!("--pin {}={pin}", self.names.name(&entry.name))));
        }
        let cause = "chip, clock, pins and time of a scan are not part of Instruction List";
        let hint = format!("give them to the other verbs: {}", flags.join(" "));
        self.note(codes::LEFT_BEHIND, Pos::new(1, 1, 1), cause, &hint);
    }

    /// Returns the declarations: inputs, outputs, relays and integers of the source, then what was added.
    fn variables(&self) -> Vec<IlVariable> {
        let blocks = self.facts.block_timers();
        let mut variables = Vec::new();
        let mut symbols: Vec<_> = self.facts.symbols();
        symbols.sort_by_key(|(_, kind)| SECTIONS.iter().position(|section| *section == section_of(*kind)));
        for (name, kind) in &symbols {
            let block = blocks.get(name.as_str()).map(|kind| match kind {
                TimerKind::Tof => StandardBlock::Tof,
                _ => StandardBlock::Ton,
            });
            let iec_type = match block {
                Some(block) => IecType::Block(block),
                None if kind.is_bit() => IecType::Bool,
                None => self.facts.type_of(name).unwrap_or(IecType::Dint),
            };
            let start = self.facts.starts.get(name.as_str()).filter(|start| **start != 0 && block.is_none());
            let initial =
                start.map(|value| IlLiteral { prefix: None, value: IlValue::Integer { value: *value, base: 10 } });
            variables.push(declared(self.names.name(name), section_of(*kind), iec_type, initial));
        }
        for (name, iec_type) in &self.added {
            variables.push(declared(name.clone(), IlSection::Local, iec_type.clone(), None));
        }
        variables
    }
}

/// Section in which a symbol is declared.
fn section_of(kind: SymbolKind) -> IlSection {
    match kind {
        SymbolKind::Input => IlSection::Input,
        SymbolKind::Output => IlSection::Output,
        SymbolKind::Relay | SymbolKind::Timer | SymbolKind::Counter | SymbolKind::Adc | SymbolKind::Variable => {
            IlSection::Local
        }
    }
}

fn declared(text: String, section: IlSection, iec_type: IecType, initial: Option<IlLiteral>) -> IlVariable {
    let name = IlName { text, pos: Pos::default() };
    IlVariable { name, section, qualifier: None, iec_type, address: None, initial, comment: None }
}
