//! Makes a ladder program of a program in Instruction List: networks become rungs, lines become elements
//! whose operands are resolved and typed.

use std::collections::BTreeMap;

use diag::{Diagnostic, Pos, Severity};

use crate::model::{Element, LadderDialect, LadderProgram, LdFormat, Rung, RungNode};
use crate::program_parts::{ProgramSettings, SourceStyle};

use super::check::{check, types_around};
use super::codes;
use super::flow::{LineTypes, ResultType};
use super::implied::with_implied_names;
use super::links::parentheses;
use super::model::{IlBinaryOperand, IlInstruction, IlOperation, IlProgram, IlSection};
use super::steps::{IlAction, IlStep};
use super::symbols::SymbolTable;
use super::types::{IecType, StandardBlock};

/// A program as rungs, and what was noticed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResolvedIlProgram {
    /// The program, of dialect [`LadderDialect::Iec`].
    pub program: LadderProgram,
    /// Notes and warnings of the type check and of the resolution.
    pub warnings: Vec<Diagnostic>,
}

/// Makes a ladder program of a program that was read without an error.
///
/// A rung is a network: one begins at every label, and at every load that replaces a result which was stored
/// or that decided a jump or a call. Every line with a label or an operation is one element.
///
/// # Errors
/// Returns all diagnostics if the type check or the resolution finds an error.
pub fn to_ladder(program: &IlProgram, settings: ProgramSettings) -> Result<ResolvedIlProgram, Vec<Diagnostic>> {
    let (complete, declared) = with_implied_names(program);
    let mut diagnostics = check(&complete);
    for mixed in diagnostics.iter_mut().filter(|d| d.code == codes::IL_MIXED) {
        // What runs needs one type on every path.
        mixed.severity = Severity::Error;
    }
    if diagnostics.iter().any(Diagnostic::is_error) {
        return Err(diagnostics);
    }
    let mut resolver = IlResolver::new(&complete, declared);
    resolver.check_cycle(settings.cycle_us);
    let rungs = resolver.rungs();
    if program.instructions.iter().all(|line| line.label.is_none() && line.operation.is_none()) {
        let hint = "write instructions such as LD a and ST b";
        let cause = "the program has no instruction, so it does nothing";
        resolver.report(Severity::Warning, codes::IL_NO_INSTRUCTION, Pos::new(1, 1, 1), cause, hint);
    }
    resolver.note_declarations();
    diagnostics.append(&mut resolver.diagnostics);
    diagnostics.sort_by(|a, b| (a.pos, a.code).cmp(&(b.pos, b.code)));
    if diagnostics.iter().any(Diagnostic::is_error) {
        return Err(diagnostics);
    }
    let program = LadderProgram {
        file: program.file.clone(),
        format: LdFormat::V02,
        dialect: LadderDialect::Iec,
        style: SourceStyle::default(),
        settings,
        io: Vec::new(),
        vars: None,
        pull_ups: None,
        declarations: resolver.table.into_variables(),
        rungs,
    };
    Ok(ResolvedIlProgram { program, warnings: diagnostics })
}

/// Returns the settings of a program in Instruction List, whose text has no head: no chip, no clock and no
/// serial line.
#[must_use]
pub fn il_settings(cycle_us: u64) -> ProgramSettings {
    ProgramSettings {
        micro: None,
        cycle_us,
        cycle_rest: String::new(),
        crystal_hz: 0,
        crystal_rest: String::new(),
        baud: None,
        baud_rest: String::new(),
        compiler: None,
        compiled: None,
    }
}

/// State of the resolution of one program.
pub(super) struct IlResolver<'a> {
    /// The program, with the declarations that it leaves out.
    pub program: &'a IlProgram,
    /// Its variables.
    pub table: SymbolTable,
    /// Type of the current result before each line.
    pub before: Vec<ResultType>,
    /// Type of the current result after each line.
    after: Vec<ResultType>,
    /// Line of the operator for each line with `)`.
    openers: BTreeMap<usize, usize>,
    /// What was found so far.
    pub diagnostics: Vec<Diagnostic>,
}

/// Rungs in work, and comments that wait for the next element.
#[derive(Default)]
struct RungBuilder {
    rungs: Vec<Rung>,
    comments: Vec<String>,
    comment_pos: Pos,
    /// Whether the last element leaves no result that a load would lose.
    is_ended: bool,
}

impl<'a> IlResolver<'a> {
    fn new(program: &'a IlProgram, declared: usize) -> Self {
        let LineTypes { before, after } = types_around(program);
        let (_, openers) = parentheses(program);
        let (table, diagnostics) = SymbolTable::new(program, declared);
        IlResolver { program, table, before, after, openers, diagnostics }
    }

    /// Adds a diagnostic.
    pub(super) fn report(
        &mut self,
        severity: Severity,
        code: &'static str,
        pos: Pos,
        cause: impl Into<String>,
        hint: &str,
    ) {
        self.diagnostics.push(Diagnostic::new(severity, code, &self.program.file, pos, cause, hint));
    }

    /// Adds an error.
    pub(super) fn error(&mut self, code: &'static str, pos: Pos, cause: impl Into<String>, hint: &str) {
        self.report(Severity::Error, code, pos, cause, hint);
    }

    /// Timers count whole milliseconds of scans.
    fn check_cycle(&mut self, cycle_us: u64) {
        let timer = self.program.instructions.iter().find(|line| {
            let block = match &line.operation {
                Some(IlOperation::ShortBlock { block, .. }) => Some(*block),
                Some(IlOperation::Call { instance, .. } | IlOperation::BlockInput { instance, .. }) => {
                    self.table.block(&instance.text)
                }
                _ => None,
            };
            block.is_some_and(StandardBlock::is_timer)
        });
        let Some(line) = timer.filter(|_| cycle_us == 0 || !cycle_us.is_multiple_of(1000)) else { return };
        let cause = format!("the program has a timer, and the cycle of {cycle_us} us is not a whole number of ms");
        self.error(codes::IL_CYCLE, line.pos, cause, "choose a cycle in whole milliseconds, such as --cycle 10");
    }

    /// Returns the rungs; reports what does not run.
    fn rungs(&mut self) -> Vec<Rung> {
        let program = self.program;
        let (groups, _) = parentheses(program);
        let mut builder = RungBuilder { comments: program.remarks.clone(), ..RungBuilder::default() };
        for (index, line) in program.instructions.iter().enumerate() {
            if line.label.is_none() && line.operation.is_none() {
                builder.add_comment(line);
                continue;
            }
            let is_inside = groups.get(index).is_some_and(|group| *group > 0);
            if let Some(label) = line.label.as_ref().filter(|_| is_inside) {
                let cause = format!("the label `{}` is inside parentheses", label.text);
                self.error(codes::IL_NOT_RUN, label.pos, cause, "put the label before the parentheses");
            }
            self.warn_unreached(index, line);
            let Some(action) = self.action(index, line) else { continue };
            let step = IlStep {
                label: line.label.as_ref().map(|label| label.text.clone()),
                action,
                before: self.before.get(index).and_then(concrete),
                after: self.after.get(index).and_then(concrete),
                operation: line.operation.clone().map(IlOperation::without_positions),
                comment: line.comment.clone(),
            };
            builder.add(step, line.pos, is_inside);
        }
        let mut rungs = builder.finish();
        resolve_jumps(&mut rungs);
        rungs
    }

    /// Warns at the first line of a part that no path reaches.
    fn warn_unreached(&mut self, index: usize, line: &IlInstruction) {
        let is_unreached = |index: usize| self.before.get(index) == Some(&ResultType::Unreached);
        let is_first = index.checked_sub(1).is_none_or(|last| !is_unreached(last));
        if is_unreached(index) && is_first && line.operation.is_some() {
            let hint = "remove the line, or give it a label and a jump to it";
            self.report(Severity::Warning, codes::IL_UNREACHED, line.pos, "no path leads to this line", hint);
        }
    }

    /// Returns what a line does; `None` if it was reported as an error.
    fn action(&mut self, index: usize, line: &IlInstruction) -> Option<IlAction> {
        let Some(operation) = &line.operation else { return Some(IlAction::Nothing) };
        let before = self.before.get(index).map_or(ResultType::Unknown, without_call);
        Some(match operation {
            IlOperation::Load { operand, .. } if self.input_of(operand, "LD").is_some() => {
                self.input_call(&self.instance_name(operand), "LD", line.pos)?
            }
            IlOperation::Load { negated, operand } => {
                let (source, found) = self.source(operand)?;
                IlAction::Load { negated: *negated, source, iec_type: concrete(&found)? }
            }
            IlOperation::Store { negated, target } => {
                IlAction::Store { negated: *negated, target: self.target(target)? }
            }
            IlOperation::Set(target) if self.input_of(target, "S").is_some() => {
                self.input_call(&self.instance_name(target), "S", line.pos)?
            }
            IlOperation::Reset(target) if self.input_of(target, "R").is_some() => {
                self.input_call(&self.instance_name(target), "R", line.pos)?
            }
            IlOperation::Set(target) => IlAction::Set(self.target(target)?),
            IlOperation::Reset(target) => IlAction::Reset(self.target(target)?),
            IlOperation::NoTarget { operator } => {
                let cause = format!("{operator} has no operand and does nothing");
                let hint = format!("write {operator} and a variable or an address such as %QX0.0");
                self.report(Severity::Warning, codes::IL_NO_TARGET, line.pos, cause, &hint);
                IlAction::Nothing
            }
            IlOperation::Not => IlAction::Not { iec_type: concrete(&before).unwrap_or(IecType::Bool) },
            IlOperation::Binary { operator, negated, operand: IlBinaryOperand::Value(operand) } => {
                let (source, found) = self.source(operand)?;
                let iec_type = operation_type(&before, &found);
                IlAction::Binary { operator: *operator, negated: *negated, source, iec_type }
            }
            IlOperation::Binary { operand: IlBinaryOperand::Deferred(operand), .. } => match operand {
                Some(operand) => {
                    let (source, found) = self.source(operand)?;
                    IlAction::Open { source: Some(source), iec_type: concrete(&found) }
                }
                None => IlAction::Open { source: None, iec_type: None },
            },
            IlOperation::Close => self.close(index, &before)?,
            IlOperation::Jump { condition, label } => {
                // The rung is known when all rungs are.
                IlAction::Jump { condition: *condition, label: label.text.clone(), target: 0 }
            }
            IlOperation::Return(condition) => IlAction::Return(*condition),
            IlOperation::Call { condition, instance, parameters } => {
                let call = self.block_call(instance, parameters)?;
                IlAction::Call { condition: *condition, call }
            }
            IlOperation::BlockInput { input, instance } => {
                self.input_call(&instance.text, input.keyword(), instance.pos)?
            }
            IlOperation::ShortBlock { block, instance, preset } => self.short_call(*block, instance, preset)?,
            IlOperation::Function { name, parenthesized, arguments } => {
                let first = (!parenthesized).then_some(before);
                IlAction::Function(self.function_call(name, first, arguments)?)
            }
        })
    }

    fn close(&self, index: usize, inner: &ResultType) -> Option<IlAction> {
        let opener = *self.openers.get(&index)?;
        let operation = self.program.instructions.get(opener)?.operation.as_ref()?;
        let IlOperation::Binary { operator, negated, .. } = operation else { return None };
        let outer = self.before.get(opener).map_or(ResultType::Unknown, without_call);
        let iec_type = operation_type(&outer, inner);
        Some(IlAction::Close { operator: *operator, negated: *negated, iec_type })
    }

    /// Notes what a declaration says that has no effect here.
    fn note_declarations(&mut self) {
        for variable in &self.program.variables {
            let name = &variable.name;
            if variable.section == IlSection::Temporary {
                let hint = "declare it with VAR";
                let cause = format!("`{}` is in VAR_TEMP, which does not run here", name.text);
                self.diagnostics.push(Diagnostic::new(
                    Severity::Error,
                    codes::IL_NOT_RUN,
                    &self.program.file,
                    name.pos,
                    cause,
                    hint,
                ));
            }
        }
        let notes = self.table.notes(&self.program.file);
        self.diagnostics.extend(notes);
    }
}

impl RungBuilder {
    fn add_comment(&mut self, line: &IlInstruction) {
        if self.comments.is_empty() {
            self.comment_pos = line.pos;
        }
        self.comments.extend(line.comment.clone());
    }

    /// Adds an element; begins a rung if a network begins with it.
    fn add(&mut self, step: IlStep, pos: Pos, is_inside: bool) {
        let begins = self.is_ended && !is_inside && step.is_load();
        if self.rungs.is_empty() || begins || step.label.is_some() && !is_inside {
            self.rungs.push(Rung { series: Vec::new(), pos });
        }
        self.is_ended = step.ends_network();
        self.flush_comments(pos);
        if let Some(rung) = self.rungs.last_mut() {
            rung.series.push(RungNode::Leaf(Element::Instruction(Box::new(step)), pos));
        }
    }

    /// Moves the comments that wait to the rung in work.
    fn flush_comments(&mut self, pos: Pos) {
        let text = std::mem::take(&mut self.comments).join("\n");
        let pos = if self.comment_pos.line > 0 { self.comment_pos } else { pos };
        if let Some(rung) = self.rungs.last_mut().filter(|_| !text.is_empty()) {
            rung.series.push(RungNode::Leaf(Element::Comment(text), pos));
        }
    }

    fn finish(mut self) -> Vec<Rung> {
        self.flush_comments(Pos::default());
        self.rungs
    }
}

/// Gives each jump the rung of its label.
fn resolve_jumps(rungs: &mut [Rung]) {
    let label_of = |rung: &Rung| {
        rung.series.iter().find_map(|node| match node {
            RungNode::Leaf(Element::Instruction(step), _) => step.label.as_ref().map(|l| l.to_ascii_uppercase()),
            _ => None,
        })
    };
    let labels: BTreeMap<String, u32> =
        (0..).zip(rungs.iter()).filter_map(|(index, rung)| Some((label_of(rung)?, index))).collect();
    for node in rungs.iter_mut().flat_map(|rung| &mut rung.series) {
        if let RungNode::Leaf(Element::Instruction(step), _) = node
            && let IlAction::Jump { label, target, .. } = &mut step.action
        {
            *target = labels.get(&label.to_ascii_uppercase()).copied().unwrap_or(0);
        }
    }
}

/// Returns the type of the current result after CAL, which keeps it.
pub(super) fn without_call(result: &ResultType) -> ResultType {
    match result {
        ResultType::AfterCall(kept) => (**kept).clone(),
        other => other.clone(),
    }
}

/// Returns the type in which a value is held; `None` if there is no value.
pub(super) fn concrete(result: &ResultType) -> Option<IecType> {
    Some(match result {
        ResultType::Of(iec_type) => iec_type.clone(),
        ResultType::Number(_) => IecType::Dint,
        ResultType::Sized(1) | ResultType::Unknown => IecType::Bool,
        ResultType::Sized(8) => IecType::Byte,
        ResultType::Sized(16) => IecType::Word,
        ResultType::Sized(_) => IecType::Dword,
        ResultType::AfterCall(kept) => return concrete(kept),
        ResultType::Unreached | ResultType::NotLoaded | ResultType::Mixed => return None,
    })
}

/// Returns the type in which an operator works on a current result and an operand.
pub(super) fn operation_type(result: &ResultType, operand: &ResultType) -> IecType {
    let time = ResultType::Of(IecType::Time);
    if *result == time {
        // TIME also multiplies and divides with an integer.
        return IecType::Time;
    }
    let unified = if result.is_value() { result.unify(operand).ok() } else { None };
    unified.as_ref().and_then(concrete).or_else(|| concrete(operand)).unwrap_or(IecType::Bool)
}
