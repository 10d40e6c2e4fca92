//! Programs of IEC 61131-3 as programs of LDmicro.

use std::collections::{BTreeMap, BTreeSet};

use diag::{Diagnostic, Pos, Severity};

use crate::il::{
    IecType, IlAction, IlOperand, IlOperandKind, IlQualifier, IlSource, IlValue, LadderNetwork, StandardBlock,
    TypedSymbol, ladder_of,
};
use crate::model::{
    Element, FlowOp, IoEntry, LadderDialect, LadderOperand, LadderProgram, LdFormat, ProgramSettings, Rung, RungNode,
    SourceStyle, SymbolKind, VarEntry,
};
use crate::symbols::kind_by_letter;

use super::codes;

/// A program of IEC 61131-3 as a program of LDmicro.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConvertedLadder {
    /// The program, in dialect ldmicro-5. Positions are those of the source file.
    pub program: LadderProgram,
    /// Symbols that have another name, each with the name in its place.
    pub renamed: Vec<(String, String)>,
    /// Notes about these names and about settings.
    pub notes: Vec<Diagnostic>,
}

/// Clock of a program that names none.
const CRYSTAL_HZ: u64 = 4_000_000;

/// Converts a program of IEC 61131-3 to a program of LDmicro 5.
///
/// # Errors
/// Each line and each variable that LDmicro cannot express, with its position (CV001).
pub fn to_ldmicro(program: &LadderProgram) -> Result<ConvertedLadder, Vec<Diagnostic>> {
    let mut builder = LdBuilder::new(program);
    builder.check_declarations();
    for (index, rung) in (0..).zip(&program.rungs) {
        builder.network = index;
        builder.convert_network(rung);
    }
    if !builder.diagnostics.is_empty() {
        return Err(builder.diagnostics);
    }
    if builder.rungs.len() > crate::MAX_RUNGS {
        let cause = format!("the result has more than {} rungs", crate::MAX_RUNGS);
        builder.refuse(Pos::new(1, 1, 1), cause, "split the program");
        return Err(builder.diagnostics);
    }
    let converted = builder.finish();
    // LDmicro refuses programs that IEC 61131-3 does not, such as a loop without a condition.
    let faults: Vec<Diagnostic> = crate::check(&converted.program)
        .into_iter()
        .filter(Diagnostic::is_error)
        .map(|fault| Diagnostic { code: codes::NOT_CONVERTED, ..fault })
        .collect();
    if faults.is_empty() { Ok(converted) } else { Err(faults) }
}

/// State of one conversion to LDmicro.
pub(super) struct LdBuilder<'a> {
    source: &'a LadderProgram,
    /// Name in LDmicro of each symbol, by its name in capitals.
    names: BTreeMap<String, String>,
    taken: BTreeSet<String>,
    /// Number of calls of each instance.
    calls: BTreeMap<String, usize>,
    /// The networks that a scan may pass over or repeat, by their indices.
    unsteady: BTreeSet<u32>,
    /// Index of the network in work.
    network: u32,
    rungs: Vec<Rung>,
    /// The rung in work.
    series: Vec<RungNode>,
    /// Input of a call whose value is the power of the rung in work.
    pub direct_input: Option<String>,
    /// Position of the line in work.
    pub pos: Pos,
    /// Integers that are not two bytes wide.
    widths: BTreeMap<String, u8>,
    diagnostics: Vec<Diagnostic>,
}

impl<'a> LdBuilder<'a> {
    fn new(source: &'a LadderProgram) -> Self {
        let mut builder = LdBuilder {
            source,
            names: BTreeMap::new(),
            taken: BTreeSet::new(),
            calls: BTreeMap::new(),
            unsteady: BTreeSet::new(),
            network: 0,
            rungs: Vec::new(),
            series: Vec::new(),
            direct_input: None,
            pos: Pos::default(),
            widths: BTreeMap::new(),
            diagnostics: Vec::new(),
        };
        let symbols = source.symbols();
        for symbol in symbols.iter().filter(|symbol| is_kept(&symbol.name, symbol.kind)) {
            builder.taken.insert(symbol.name.clone());
            builder.names.insert(symbol.name.to_ascii_uppercase(), symbol.name.clone());
        }
        for symbol in &symbols {
            if !builder.names.contains_key(&symbol.name.to_ascii_uppercase()) {
                let name = builder.free_name(&with_letter(&symbol.name, symbol.kind));
                builder.names.insert(symbol.name.to_ascii_uppercase(), name);
            }
            if !symbol.kind.is_bit() && symbol.bytes != 2 {
                builder.widths.insert(builder.name_of(&symbol.name), symbol.bytes);
            }
        }
        for at in source.elements() {
            let Element::Instruction(step) = at.element else { continue };
            let here = at.id.rung;
            match &step.action {
                IlAction::Call { call, .. } => {
                    *builder.calls.entry(call.instance.to_ascii_uppercase()).or_default() += 1;
                }
                IlAction::Jump { target, .. } if *target > here => builder.unsteady.extend(here..*target),
                IlAction::Jump { target, .. } => builder.unsteady.extend(*target..=here),
                IlAction::Return(_) => builder.unsteady.extend(here..source.rungs.len() as u32),
                // Behind all others the scan goes on with the next line.
                _ => {}
            }
        }
        builder
    }

    /// Returns a name that is not taken yet, and takes it.
    pub(super) fn free_name(&mut self, stem: &str) -> String {
        let mut name = stem.to_owned();
        let mut number = 1_usize;
        while !self.taken.insert(name.clone()) {
            number += 1;
            name = format!("{stem}_{number}");
        }
        name
    }

    /// Reports what LDmicro cannot express.
    pub(super) fn refuse(&mut self, pos: Pos, cause: impl Into<String>, hint: &str) {
        let file = &self.source.file;
        self.diagnostics.push(Diagnostic::new(Severity::Error, codes::NOT_CONVERTED, file, pos, cause, hint));
    }

    /// Returns the name in LDmicro of a symbol.
    pub(super) fn name_of(&self, symbol: &str) -> String {
        self.names.get(&symbol.to_ascii_uppercase()).cloned().unwrap_or_else(|| symbol.to_owned())
    }

    /// Time of a scan in microseconds.
    pub(super) fn cycle_us(&self) -> u64 {
        self.source.settings.cycle_us
    }

    /// Whether the network in work is executed once in every scan.
    pub(super) fn is_steady(&self) -> bool {
        !self.unsteady.contains(&self.network)
    }

    /// Whether exactly one line calls an instance.
    pub(super) fn is_called_once(&self, instance: &str) -> bool {
        self.calls.get(&instance.to_ascii_uppercase()) == Some(&1)
    }

    /// Whether an element reads or writes a symbol other than by its block.
    pub(super) fn is_used(&self, symbol: &str) -> bool {
        self.source.elements().any(|at| match at.element {
            Element::Instruction(step) => match &step.action {
                IlAction::Call { call, .. } => {
                    call.outputs.iter().any(|output| output.part.name == symbol)
                        || call.inputs.iter().any(|(_, source)| is_symbol(source, symbol))
                }
                action => {
                    step.sources().any(|source| is_symbol(source, symbol))
                        || matches!(action, IlAction::Store { target, .. } if target.name == symbol)
                }
            },
            _ => false,
        })
    }

    /// Reports variables that begin with another value than 0, and numbers from outside.
    fn check_declarations(&mut self) {
        for variable in &self.source.declarations {
            let is_constant = variable.qualifier == Some(IlQualifier::Constant);
            if variable.initial != 0 && !is_constant {
                let cause = format!(
                    "`{}` begins with {}, and in LDmicro everything begins with 0",
                    variable.name, variable.initial
                );
                self.refuse(variable.pos, cause, "store the value in the first scan, or declare it CONSTANT");
            }
            if variable.kind == Some(SymbolKind::Variable) && variable.is_given() {
                let cause = format!("`{}` is a number from outside, and LDmicro has none", variable.name);
                self.refuse(variable.pos, cause, "read it with READ_ADC in LDmicro");
            }
        }
    }

    /// Adds an element to the rung in work.
    pub(super) fn push(&mut self, element: Element) {
        self.series.push(RungNode::Leaf(element, self.pos));
    }

    /// Adds a node to the rung in work.
    pub(super) fn push_node(&mut self, node: RungNode) {
        self.series.push(node);
    }

    /// Ends the rung in work.
    pub(super) fn end_rung(&mut self) {
        let series = std::mem::take(&mut self.series);
        if !series.is_empty() {
            self.rungs.push(Rung { series, pos: self.pos });
        }
    }

    /// Adds a rung.
    pub(super) fn rung(&mut self, elements: impl IntoIterator<Item = Element>) {
        self.end_rung();
        elements.into_iter().for_each(|element| self.push(element));
        self.end_rung();
    }

    /// Converts a network.
    fn convert_network(&mut self, rung: &Rung) {
        self.pos = rung.pos;
        match ladder_of(rung) {
            Ok(network) => {
                self.comments(&network.comments);
                self.begin_network(&network);
                self.stages(&network);
            }
            Err(why) => {
                if let Err(fault) = self.integer_network(rung) {
                    let (pos, cause) = match fault {
                        Some((pos, cause)) => (pos, cause),
                        None => (why.pos, format!("`{}`: {}", why.line, why.why)),
                    };
                    let hint =
                        "LDmicro has BOOL networks, standard timers and counters, moves, arithmetic and comparisons";
                    self.refuse(pos, cause, hint);
                }
            }
        }
        self.end_rung();
    }

    fn comments(&mut self, comments: &[String]) {
        if !comments.is_empty() {
            self.rung([Element::Comment(comments.join("\n"))]);
        }
    }

    fn begin_network(&mut self, network: &LadderNetwork) {
        if let Some(label) = &network.label {
            self.push(Element::Flow { op: FlowOp::Label, label: label_text(&label.text) });
        }
    }

    /// Returns the symbol that an operand names, and its type; `None` for a literal.
    pub(super) fn symbol_of(&self, operand: &IlOperand) -> Option<(String, IecType)> {
        let declarations = &self.source.declarations;
        match &operand.kind {
            IlOperandKind::Variable { name, member } => {
                let variable = declarations.iter().find(|variable| variable.name.eq_ignore_ascii_case(name))?;
                let IecType::Block(block) = variable.iec_type else {
                    return Some((variable.name.clone(), variable.iec_type.clone()));
                };
                // The name of an instance alone is its output.
                let output = if block == StandardBlock::Ctud { "QU" } else { "Q" };
                let part = block.part(member.as_deref().unwrap_or(output))?;
                Some((format!("{}.{}", variable.name, part.name), part.iec_type()))
            }
            IlOperandKind::Address(address) => {
                let is_at = |found: &crate::il::DirectAddress, iec_type: &IecType| {
                    let bits = address.size.map_or(1, crate::il::AddressSize::bits);
                    found.area == address.area && found.path == address.path && iec_type.bits() == bits
                };
                let variable = declarations
                    .iter()
                    .find(|variable| variable.address.as_ref().is_some_and(|found| is_at(found, &variable.iec_type)))?;
                Some((variable.name.clone(), variable.iec_type.clone()))
            }
            IlOperandKind::Literal(_) => None,
        }
    }

    /// Returns the value of a symbol that is a constant.
    pub(super) fn constant_of(&self, symbol: &str) -> Option<i64> {
        let is_it = |name: &str| name == symbol;
        let variable = self.source.declarations.iter().find(|variable| is_it(&variable.name))?;
        (variable.qualifier == Some(IlQualifier::Constant)).then_some(variable.initial)
    }

    /// Returns an operand of an integer element.
    ///
    /// # Errors
    /// LDmicro has no integer of this type.
    pub(super) fn integer(&self, operand: &IlOperand) -> Result<LadderOperand, OperandFault> {
        match (self.symbol_of(operand), &operand.kind) {
            (Some((name, iec_type)), _) => self.integer_symbol(&name, &iec_type),
            (None, IlOperandKind::Literal(literal)) => match literal.value {
                IlValue::Integer { value, .. } => Ok(constant(value)),
                IlValue::Bool(_) | IlValue::Time(_) => Err(OperandFault::NoInteger),
            },
            (None, _) => Err(OperandFault::NoInteger),
        }
    }

    /// Returns a symbol as an operand of an integer element.
    fn integer_symbol(&self, name: &str, iec_type: &IecType) -> Result<LadderOperand, OperandFault> {
        if !matches!(iec_type, IecType::Sint | IecType::Int | IecType::Dint) {
            return Err(OperandFault::Type { name: name.to_owned(), keyword: iec_type.keyword().to_owned() });
        }
        Ok(self.constant_of(name).map_or_else(|| LadderOperand::Var(self.name_of(name)), constant))
    }

    /// Returns a source of a line as an operand.
    pub(super) fn source_integer(&self, source: &IlSource) -> Result<LadderOperand, OperandFault> {
        match source {
            IlSource::Constant(value) => Ok(constant(*value)),
            IlSource::Symbol(TypedSymbol { name, iec_type, .. }) => self.integer_symbol(name, iec_type),
            IlSource::Result => Err(OperandFault::Result),
        }
    }

    fn finish(mut self) -> ConvertedLadder {
        let mut notes = Vec::new();
        let file = &self.source.file;
        let mut renamed = Vec::new();
        for variable in &self.source.declarations {
            for symbol in variable.symbols() {
                let name = self.name_of(&symbol.name);
                let is_part = variable.kind.is_none() && !self.is_used(&symbol.name);
                if name != symbol.name {
                    if !is_part {
                        let cause = format!("`{}` is `{name}` in LDmicro", symbol.name);
                        let hint = "inputs begin with X, outputs with Y, relays with R";
                        notes.push(Diagnostic::new(Severity::Note, codes::RENAMED, file, variable.pos, cause, hint));
                    }
                    renamed.push((symbol.name, name));
                }
            }
        }
        let cause = format!("the program names no clock; CRYSTAL={CRYSTAL_HZ} is written");
        let hint = "choose chip and clock in LDmicro, or give --mcu and --clock";
        notes.push(Diagnostic::new(Severity::Note, codes::LEFT_BEHIND, file, Pos::new(1, 1, 1), cause, hint));
        notes.sort_by_key(|note| note.pos);
        let io = self
            .source
            .symbols()
            .into_iter()
            .filter(|symbol| matches!(symbol.kind, SymbolKind::Input | SymbolKind::Output));
        let io =
            io.map(|symbol| IoEntry { name: self.name_of(&symbol.name), pin: 0, modbus: None, pos: Pos::default() });
        let io = io.collect();
        let used: BTreeSet<String> = self.rungs.iter().flat_map(|rung| names_in(&rung.series)).collect();
        let vars: Vec<VarEntry> = std::mem::take(&mut self.widths)
            .into_iter()
            .filter(|(name, _)| used.contains(name))
            .map(|(name, bytes)| VarEntry { text: format!("{bytes} bytes {name}"), name, bytes, pos: Pos::default() })
            .collect();
        let settings = ProgramSettings { crystal_hz: CRYSTAL_HZ, ..self.source.settings.clone() };
        let program = LadderProgram {
            file: file.clone(),
            format: LdFormat::V02,
            dialect: LadderDialect::Ldmicro5,
            style: SourceStyle::default(),
            settings,
            io,
            vars: (!vars.is_empty()).then_some(vars),
            pull_ups: None,
            declarations: Vec::new(),
            rungs: self.rungs,
        };
        ConvertedLadder { program, renamed, notes }
    }

    /// Gives an integer its width.
    pub(super) fn set_width(&mut self, name: &str, iec_type: &IecType) {
        if let Some(bytes) = u8::try_from(iec_type.bits() / 8).ok().filter(|bytes| *bytes != 2) {
            self.widths.insert(name.to_owned(), bytes);
        }
    }
}

/// Why LDmicro has no such operand.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum OperandFault {
    /// It is neither a symbol nor a number.
    #[error("the operand is no integer")]
    NoInteger,
    /// It has another type.
    #[error("`{name}` is {keyword}; integers of LDmicro are SINT, INT and DINT")]
    Type {
        /// Name of the symbol.
        name: String,
        /// Keyword of its type.
        keyword: String,
    },
    /// It is the current result.
    #[error("the line takes the current result")]
    Result,
}

/// Returns a constant operand.
pub(super) fn constant(value: i64) -> LadderOperand {
    LadderOperand::Const { value, text: value.to_string() }
}

/// Label of LDmicro: names are case-sensitive there.
pub(super) fn label_text(label: &str) -> String {
    label.to_ascii_uppercase()
}

fn is_symbol(source: &IlSource, name: &str) -> bool {
    matches!(source, IlSource::Symbol(symbol) if symbol.name == name)
}

/// Whether a name of Instruction List is a name of LDmicro for the same kind of symbol.
fn is_kept(name: &str, kind: SymbolKind) -> bool {
    crate::il::is_name(name) && kind_by_letter(name) == kind
}

/// Returns a name with the letter of its kind.
fn with_letter(name: &str, kind: SymbolKind) -> String {
    let plain: String = name.trim_start_matches('%').chars().map(|c| if c == '.' { '_' } else { c }).collect();
    match kind {
        SymbolKind::Input => format!("X{plain}"),
        SymbolKind::Output => format!("Y{plain}"),
        SymbolKind::Relay => format!("R{plain}"),
        SymbolKind::Timer | SymbolKind::Counter | SymbolKind::Adc | SymbolKind::Variable
            if kind_by_letter(&plain) == SymbolKind::Variable && !plain.starts_with(|c: char| c.is_ascii_digit()) =>
        {
            plain
        }
        SymbolKind::Timer | SymbolKind::Counter | SymbolKind::Adc | SymbolKind::Variable => format!("v{plain}"),
    }
}

/// Names of the symbols in a series.
fn names_in(series: &[RungNode]) -> Vec<String> {
    let mut names = Vec::new();
    for node in series {
        match node {
            RungNode::Leaf(element, _) => {
                names.extend(element.facts().symbols.iter().map(|symbol| symbol.name.clone().into_owned()));
            }
            RungNode::Parallel(branches, _) => names.extend(branches.iter().flat_map(|branch| names_in(branch))),
        }
    }
    names
}
