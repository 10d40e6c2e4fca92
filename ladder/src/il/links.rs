//! Checks what needs the whole program: labels and jumps, parentheses, names declared twice, calls.

use std::collections::{BTreeMap, BTreeSet};

use diag::{Diagnostic, Pos, Severity, nearest};

use super::codes;
use super::model::{IlName, IlOperation, IlProgram};
use super::types::{IecType, StandardBlock};

struct LinkChecker<'a> {
    program: &'a IlProgram,
    diagnostics: Vec<Diagnostic>,
}

/// Returns the errors of labels, jumps, declarations and calls.
pub(super) fn check_links(program: &IlProgram) -> Vec<Diagnostic> {
    let mut links = LinkChecker { program, diagnostics: Vec::new() };
    links.check_declarations();
    links.check_jumps();
    links.check_calls();
    links.diagnostics
}

/// Returns for each line the number of the innermost parenthesis around it, 0 outside of all; and for each
/// `)` the line of its operator.
pub(super) fn parentheses(program: &IlProgram) -> (Vec<usize>, BTreeMap<usize, usize>) {
    let (mut groups, mut openers) = (Vec::with_capacity(program.instructions.len()), BTreeMap::new());
    let mut stack: Vec<usize> = Vec::new();
    for (index, line) in program.instructions.iter().enumerate() {
        groups.push(stack.last().map_or(0, |opener| opener + 1));
        match &line.operation {
            Some(operation) if operation.is_opening() => stack.push(index),
            Some(IlOperation::Close) => {
                if let Some(opener) = stack.pop() {
                    openers.insert(index, opener);
                }
            }
            _ => {}
        }
    }
    (groups, openers)
}

/// Returns the line of each label, by its name in capitals.
pub(super) fn label_lines(program: &IlProgram) -> BTreeMap<String, usize> {
    let labels = program.instructions.iter().enumerate().rev();
    labels.filter_map(|(i, line)| Some((line.label.as_ref()?.text.to_ascii_uppercase(), i))).collect()
}

impl LinkChecker<'_> {
    fn error(&mut self, code: &'static str, pos: Pos, cause: String, hint: impl Into<String>) {
        self.diagnostics.push(Diagnostic::new(Severity::Error, code, &self.program.file, pos, cause, hint));
    }

    fn check_declarations(&mut self) {
        let mut seen: BTreeMap<String, Pos> = BTreeMap::new();
        for variable in &self.program.variables {
            let name = &variable.name;
            if let Some(first) = seen.insert(name.text.to_ascii_uppercase(), name.pos) {
                let cause = format!("`{}` is declared twice; first in line {}", name.text, first.line);
                self.error(codes::IL_NAME_TWICE, name.pos, cause, "remove one of the declarations");
            }
        }
    }

    fn check_jumps(&mut self) {
        let program = self.program;
        let (groups, _) = parentheses(program);
        let lines = label_lines(program);
        let mut seen: BTreeSet<String> = BTreeSet::new();
        for (index, line) in program.instructions.iter().enumerate() {
            if let Some(label) = line.label.as_ref().filter(|label| !seen.insert(label.text.to_ascii_uppercase())) {
                let first = &program.instructions[lines[&label.text.to_ascii_uppercase()]];
                let first_line = first.label.as_ref().map_or(0, |l| l.pos.line);
                let cause = format!("the label `{}` occurs twice; first in line {first_line}", label.text);
                self.error(codes::IL_LABEL_TWICE, label.pos, cause, "give each label its own name");
            }
            match &line.operation {
                Some(IlOperation::Jump { label, .. }) => self.check_jump(label, groups[index], &groups, &lines),
                Some(IlOperation::Return(_)) if groups[index] > 0 => {
                    let hint = "close the parentheses before RET";
                    let cause = "RET leaves parentheses in which an operation waits".to_owned();
                    self.error(codes::IL_JUMP_PARENTHESIS, line.pos, cause, hint);
                }
                _ => {}
            }
        }
    }

    fn check_jump(&mut self, label: &IlName, group: usize, groups: &[usize], lines: &BTreeMap<String, usize>) {
        let Some(target) = lines.get(&label.text.to_ascii_uppercase()) else {
            let names = self.program.instructions.iter().filter_map(|line| Some(line.label.as_ref()?.text.as_str()));
            let meant = nearest(&label.text, names);
            let other = format!("add a line `{}:`", label.text);
            let hint = meant.map_or(other, |meant| format!("did you mean {meant}?"));
            return self.error(codes::IL_NO_LABEL, label.pos, format!("there is no label `{}`", label.text), hint);
        };
        if groups[*target] != group {
            let way = if groups[*target] == 0 { "out of" } else { "into" };
            let cause = format!("the jump to `{}` leads {way} parentheses", label.text);
            self.error(codes::IL_JUMP_PARENTHESIS, label.pos, cause, "jump between lines of the same parentheses");
        }
    }

    fn check_calls(&mut self) {
        let variables = self.program.variables.iter();
        let types: BTreeMap<String, &IecType> =
            variables.map(|variable| (variable.name.text.to_ascii_uppercase(), &variable.iec_type)).collect();
        for line in &self.program.instructions {
            match &line.operation {
                Some(IlOperation::Call { instance, .. } | IlOperation::BlockInput { instance, .. }) => {
                    self.check_instance(instance, None, &types);
                }
                Some(IlOperation::ShortBlock { block, instance, .. }) => {
                    self.check_instance(instance, Some(*block), &types);
                }
                _ => {}
            }
        }
    }

    fn check_instance(&mut self, instance: &IlName, block: Option<StandardBlock>, types: &BTreeMap<String, &IecType>) {
        let Some(iec_type) = types.get(&instance.text.to_ascii_uppercase()) else { return };
        let is_wrong = match (iec_type, block) {
            (IecType::Block(declared), Some(block)) => *declared != block,
            (declared, _) => !declared.is_block(),
        };
        if is_wrong {
            let cause = format!("`{}` is {}", instance.text, iec_type.keyword());
            let wanted = block.map_or("TON", StandardBlock::keyword);
            let hint = format!("give an instance of a function block, declared as in `{} : {wanted};`", instance.text);
            self.error(codes::IL_NO_BLOCK, instance.pos, cause, hint);
        }
    }
}
