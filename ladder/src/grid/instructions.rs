//! Grids as Instruction List.

use std::collections::BTreeSet;

use diag::Pos;

use crate::il::{
    IecType, IlBinaryOperand, IlBinaryOperator, IlCondition, IlInstruction, IlLiteral, IlName, IlOperand,
    IlOperandKind, IlOperation, IlParameter, IlProgram, IlSection, IlValue, IlVariable, StandardBlock,
};

use super::model::{GridArea, GridCell, GridContact, GridOperand, GridOutput, GridOutputKind, GridProgram};
use super::paths::paths_to;

/// Returns the program in Instruction List. Positions are those of the grids.
///
/// Each output is an OR of the ANDs of its paths. A timer is TON; a counter counts when its power falls, by a
/// CTU whose input is one scan TRUE.
#[must_use]
pub fn to_instruction_list(program: &GridProgram) -> IlProgram {
    let mut writer = GridWriter { program, lines: Vec::new(), pos: Pos::default(), used: BTreeSet::new() };
    for grid in &program.grids {
        for comment in &grid.comments {
            writer.lines.push(IlInstruction {
                comment: Some(comment.clone()),
                pos: grid.pos,
                ..IlInstruction::default()
            });
        }
        for (row, cells) in grid.rows.iter().enumerate() {
            let Some(GridCell::Output(output)) = cells.last() else { continue };
            writer.power(&paths_to(grid, row).unwrap_or_default());
            writer.output(output);
        }
    }
    let variables = writer.variables();
    IlProgram { file: program.file.clone(), name: None, remarks: Vec::new(), variables, instructions: writer.lines }
}

struct GridWriter<'a> {
    program: &'a GridProgram,
    lines: Vec<IlInstruction>,
    pos: Pos,
    used: BTreeSet<GridOperand>,
}

impl GridWriter<'_> {
    fn emit(&mut self, operation: IlOperation) {
        self.lines.push(IlInstruction { operation: Some(operation), pos: self.pos, ..IlInstruction::default() });
    }

    fn variable(&self, name: String, member: Option<&str>) -> IlOperand {
        let kind = IlOperandKind::Variable { name, member: member.map(str::to_owned) };
        IlOperand { kind, pos: self.pos }
    }

    fn literal(&self, value: IlValue) -> IlOperand {
        IlOperand { kind: IlOperandKind::Literal(IlLiteral { prefix: None, value }), pos: self.pos }
    }

    /// Returns the BOOL of a contact, and whether it is read as its complement.
    fn contact(&mut self, contact: &GridContact) -> (IlOperand, bool) {
        self.pos = contact.pos;
        self.used.insert(contact.operand);
        let is_inverted = self.program.is_active_low && contact.operand.area == GridArea::Input;
        let member = matches!(contact.operand.area, GridArea::Timer | GridArea::Counter).then_some("Q");
        (self.variable(contact.operand.to_string(), member), contact.negated != is_inverted)
    }

    /// Loads the OR of the ANDs of all paths.
    fn power(&mut self, paths: &[Vec<GridContact>]) {
        for (index, path) in paths.iter().enumerate() {
            let contacts: Vec<(IlOperand, bool)> = path.iter().map(|contact| self.contact(contact)).collect();
            let one = (self.literal(IlValue::Bool(true)), false);
            let ((operand, negated), more) =
                contacts.split_first().map_or((one, Vec::new()), |(first, more)| (first.clone(), more.to_vec()));
            self.pos = operand.pos;
            let binary = |operator, negated, operand| IlOperation::Binary { operator, negated, operand };
            match (index, more.is_empty()) {
                (0, _) => self.emit(IlOperation::Load { negated, operand }),
                (_, true) => self.emit(binary(IlBinaryOperator::Or, negated, IlBinaryOperand::Value(operand))),
                (_, false) if negated => {
                    self.emit(binary(IlBinaryOperator::Or, false, IlBinaryOperand::Deferred(None)));
                    self.emit(IlOperation::Load { negated, operand });
                }
                (_, false) => self.emit(binary(IlBinaryOperator::Or, false, IlBinaryOperand::Deferred(Some(operand)))),
            }
            let has_parenthesis = index > 0 && !more.is_empty();
            for (operand, negated) in more {
                self.pos = operand.pos;
                self.emit(binary(IlBinaryOperator::And, negated, IlBinaryOperand::Value(operand)));
            }
            if has_parenthesis {
                self.emit(IlOperation::Close);
            }
        }
    }

    fn output(&mut self, output: &GridOutput) {
        self.pos = output.pos;
        self.used.insert(output.operand);
        let name = output.operand.to_string();
        let target = self.variable(name.clone(), None);
        match output.kind {
            GridOutputKind::Ote => self.emit(IlOperation::Store { negated: false, target }),
            GridOutputKind::Otl => self.emit(IlOperation::Set(target)),
            GridOutputKind::Otu => self.emit(IlOperation::Reset(target)),
            GridOutputKind::Ton(milliseconds) => {
                let preset = self.literal(IlValue::Time(milliseconds * 1_000_000));
                self.store(&name, Some("IN"), false);
                self.call(&name, IlCondition::Always, vec![("PT", preset)]);
            }
            GridOutputKind::Ctu(preset) => {
                // It counts when the power falls: low, and it was high since the last count.
                let (armed, low) = (armed(output.operand), low(output.operand));
                let target = self.variable(armed.clone(), None);
                self.emit(IlOperation::Set(target.clone()));
                self.store(&low, None, true);
                self.load(&low);
                self.and(&armed);
                self.store(&name, Some("CU"), false);
                let preset = self.literal(IlValue::Integer { value: preset, base: 10 });
                let no = self.literal(IlValue::Bool(false));
                self.call(&name, IlCondition::Always, vec![("R", no), ("PV", preset)]);
                self.load(&low);
                self.emit(IlOperation::Reset(target));
            }
            GridOutputKind::Res if output.operand.area == GridArea::Timer => {
                let no = self.literal(IlValue::Bool(false));
                self.call(&name, IlCondition::IfTrue, vec![("IN", no)]);
            }
            GridOutputKind::Res => {
                let target = self.variable(armed(output.operand), None);
                self.emit(IlOperation::Reset(target));
                self.store(&name, Some("R"), false);
                let no = self.literal(IlValue::Bool(false));
                self.call(&name, IlCondition::Always, vec![("CU", no)]);
            }
        }
    }

    fn store(&mut self, name: &str, member: Option<&str>, negated: bool) {
        let target = self.variable(name.to_owned(), member);
        self.emit(IlOperation::Store { negated, target });
    }

    fn load(&mut self, name: &str) {
        let operand = self.variable(name.to_owned(), None);
        self.emit(IlOperation::Load { negated: false, operand });
    }

    fn and(&mut self, name: &str) {
        let operand = IlBinaryOperand::Value(self.variable(name.to_owned(), None));
        self.emit(IlOperation::Binary { operator: IlBinaryOperator::And, negated: false, operand });
    }

    fn call(&mut self, instance: &str, condition: IlCondition, inputs: Vec<(&str, IlOperand)>) {
        let named = |text: &str| IlName { text: text.to_owned(), pos: self.pos };
        let parameters =
            inputs.into_iter().map(|(name, value)| IlParameter::Input { name: named(name), value }).collect();
        let instance = named(instance);
        self.emit(IlOperation::Call { condition, instance, parameters });
    }

    /// Returns a declaration for each operand that the program uses, in the order of areas and numbers.
    fn variables(&self) -> Vec<IlVariable> {
        let mut variables = Vec::new();
        let mut add = |text: String, section, iec_type| {
            let name = IlName { text, pos: Pos::default() };
            let (qualifier, address, initial, comment) = (None, None, None, None);
            variables.push(IlVariable { name, section, qualifier, iec_type, address, initial, comment });
        };
        for operand in &self.used {
            let (section, iec_type) = match operand.area {
                GridArea::Input => (IlSection::Input, IecType::Bool),
                GridArea::Output => (IlSection::Output, IecType::Bool),
                GridArea::Flag => (IlSection::Local, IecType::Bool),
                GridArea::Timer => (IlSection::Local, IecType::Block(StandardBlock::Ton)),
                GridArea::Counter => (IlSection::Local, IecType::Block(StandardBlock::Ctu)),
            };
            add(operand.to_string(), section, iec_type);
            if operand.area == GridArea::Counter {
                add(armed(*operand), IlSection::Local, IecType::Bool);
                add(low(*operand), IlSection::Local, IecType::Bool);
            }
        }
        variables
    }
}

/// Relay of a counter: its power was TRUE since the last count.
fn armed(operand: GridOperand) -> String {
    format!("{operand}_armed")
}

/// Relay of a counter: its power is FALSE.
fn low(operand: GridOperand) -> String {
    format!("{operand}_low")
}
