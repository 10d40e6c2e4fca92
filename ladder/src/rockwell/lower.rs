//! Networks of a rung. A rung is executed from left to right, the branches of a parallel from top to bottom.

use diag::{Diagnostic, Pos, Severity};

use crate::codes;
use crate::il::{
    CoilKind, IecType, IlBinaryOperator, IlInstruction, IlOperand, IlOperandKind, IlOperation, IlSection, LadderLogic,
    LadderNetwork, LadderOutput, LadderStage, StandardBlock, instructions_of, is_plain_name, literal_of_text,
};

use super::tags::{TagKind, Tags, member, variable};
use super::text::{NeutralItem, NeutralOperand, NeutralRung};

/// Whether the rest of a rung uses the power behind a part.
pub(super) type IsUsed = bool;

/// Makes instructions of the rungs of neutral text.
pub(super) struct RungLowering<'a> {
    pub file: &'a str,
    pub tags: &'a mut Tags,
    pub lines: Vec<IlInstruction>,
    /// Lines before the network in work.
    pub before: Vec<IlInstruction>,
    pub stages: Vec<LadderStage>,
    pub comments: Vec<String>,
    /// Label of the next line.
    pub label: Option<crate::il::IlName>,
    pub faults: Vec<Diagnostic>,
}

fn comparison(name: &str) -> Option<IlBinaryOperator> {
    Some(match name {
        "EQU" => IlBinaryOperator::Eq,
        "NEQ" => IlBinaryOperator::Ne,
        "GRT" => IlBinaryOperator::Gt,
        "GEQ" => IlBinaryOperator::Ge,
        "LES" => IlBinaryOperator::Lt,
        "LEQ" => IlBinaryOperator::Le,
        _ => return None,
    })
}

/// Whether a part has only contacts and comparisons.
fn is_logic(item: &NeutralItem) -> bool {
    match item {
        NeutralItem::Instruction { name, .. } => matches!(name.as_str(), "XIC" | "XIO") || comparison(name).is_some(),
        NeutralItem::Branch(branches) => branches.iter().flatten().all(is_logic),
    }
}

/// Whether a branch has only coils.
fn is_coils(items: &[NeutralItem]) -> bool {
    let is_coil = |item: &NeutralItem| matches!(item, NeutralItem::Instruction { name, .. } if matches!(name.as_str(), "OTE" | "OTL" | "OTU"));
    !items.is_empty() && items.iter().all(is_coil)
}

impl<'a> RungLowering<'a> {
    pub fn new(file: &'a str, tags: &'a mut Tags) -> Self {
        RungLowering {
            file,
            tags,
            lines: Vec::new(),
            before: Vec::new(),
            stages: Vec::new(),
            comments: Vec::new(),
            label: None,
            faults: Vec::new(),
        }
    }

    pub fn rung(&mut self, rung: &NeutralRung) {
        self.comments.extend(rung.comments.iter().cloned());
        self.resume(LadderLogic::Wire);
        self.series(&rung.items, false);
        self.flush();
    }

    pub fn refuse(&mut self, pos: Pos, cause: impl Into<String>, hint: &str) {
        self.faults.push(Diagnostic::new(Severity::Error, codes::PART_NOT_READ, self.file, pos, cause, hint));
    }

    /// Begins a network with this power.
    pub fn resume(&mut self, logic: LadderLogic) {
        self.stages = vec![LadderStage { logic, outputs: Vec::new() }];
    }

    /// Writes the network in work, if it has an output.
    pub fn flush(&mut self) {
        self.lines.append(&mut self.before);
        let mut stages = std::mem::take(&mut self.stages);
        while stages.last().is_some_and(|stage| stage.outputs.is_empty()) {
            stages.pop();
        }
        if stages.is_empty() {
            return;
        }
        let (label, comments) = (self.label.take(), std::mem::take(&mut self.comments));
        self.lines.extend(instructions_of(&LadderNetwork { label, comments, stages }));
    }

    /// Writes an operation behind the networks.
    pub fn push(&mut self, operation: IlOperation, pos: Pos) {
        let label = self.label.take();
        let comments = std::mem::take(&mut self.comments);
        let comment = |text| IlInstruction { comment: Some(text), ..IlInstruction::default() };
        self.lines.extend(comments.into_iter().map(comment));
        self.lines.push(IlInstruction { label, operation: Some(operation), pos, ..IlInstruction::default() });
    }

    /// Lets the power pass a part.
    pub fn and(&mut self, logic: LadderLogic) {
        match self.stages.last_mut() {
            Some(stage) if stage.outputs.is_empty() => {
                let before = std::mem::replace(&mut stage.logic, LadderLogic::Wire);
                stage.logic = if before == LadderLogic::Wire { logic } else { before.and(logic) };
            }
            _ => self.stages.push(LadderStage { logic, outputs: Vec::new() }),
        }
    }

    /// Adds an output.
    pub fn output(&mut self, output: LadderOutput) {
        if let Some(stage) = self.stages.last_mut() {
            stage.outputs.push(output);
        }
    }

    /// Holds the power in a variable and returns its contact; a wire needs none. The next network begins with
    /// this power.
    pub fn hold(&mut self, pos: Pos) -> LadderLogic {
        let is_wire = self.stages.iter().all(|stage| stage.logic == LadderLogic::Wire);
        let held = if is_wire {
            LadderLogic::Wire
        } else if let Some(held) = self.held() {
            held
        } else {
            let name = self.tags.names.declare("power", IecType::Bool, pos);
            let target = variable(&name.text, pos);
            self.output(LadderOutput::Coil { kind: CoilKind::Store, target: target.clone() });
            LadderLogic::Contact { negated: false, operand: target }
        };
        self.flush();
        self.resume(held.clone());
        held
    }

    /// Returns the power of the network in work if a variable holds it already.
    fn held(&self) -> Option<LadderLogic> {
        let [LadderStage { logic, outputs }] = self.stages.as_slice() else { return None };
        let LadderLogic::Contact { negated: false, operand } = logic else { return None };
        let IlOperandKind::Variable { name, member: None } = &operand.kind else { return None };
        let is_held = name.starts_with("power_") || name.starts_with("pulse_");
        let is_own = self.tags.names.variables.iter().any(|variable| variable.name.text == *name);
        (is_held && is_own && outputs.is_empty()).then(|| logic.clone())
    }

    /// Executes a series. `is_used` tells whether something behind it uses its power.
    fn series(&mut self, items: &[NeutralItem], is_used: IsUsed) {
        for (index, item) in items.iter().enumerate() {
            let is_used = is_used || index + 1 < items.len();
            match item {
                NeutralItem::Instruction { name, operands, pos } => self.instruction(name, operands, *pos, is_used),
                item if is_logic(item) => {
                    let logic = self.logic(item);
                    self.and(logic);
                }
                NeutralItem::Branch(branches) if branches.iter().all(|branch| is_coils(branch)) => {
                    branches.iter().for_each(|branch| self.series(branch, false));
                }
                NeutralItem::Branch(branches) => self.branches(branches, is_used),
            }
        }
    }

    /// Executes branches that have outputs, one after the other with the same power.
    fn branches(&mut self, branches: &[Vec<NeutralItem>], is_used: IsUsed) {
        let power = self.hold(Pos::default());
        let mut ends = Vec::new();
        for branch in branches {
            self.flush();
            self.resume(power.clone());
            self.series(branch, is_used);
            if is_used {
                ends.push(self.hold(Pos::default()));
            }
        }
        self.flush();
        self.resume(ends.into_iter().reduce(LadderLogic::or).unwrap_or(LadderLogic::Wire));
    }

    /// Returns the logic of contacts and comparisons.
    fn logic(&mut self, item: &NeutralItem) -> LadderLogic {
        match item {
            NeutralItem::Instruction { name, operands, pos } => self.contact(name, operands, *pos),
            NeutralItem::Branch(branches) => {
                let mut joined: Option<LadderLogic> = None;
                for branch in branches {
                    let parts: Vec<LadderLogic> = branch.iter().map(|item| self.logic(item)).collect();
                    let branch = parts.into_iter().reduce(LadderLogic::and).unwrap_or(LadderLogic::Wire);
                    joined = Some(joined.map_or(branch.clone(), |joined| joined.or(branch)));
                }
                joined.unwrap_or(LadderLogic::Wire)
            }
        }
    }

    /// Returns a contact or a comparison.
    pub fn contact(&mut self, name: &str, operands: &[NeutralOperand], pos: Pos) -> LadderLogic {
        if let (Some(operator), [left, right]) = (comparison(name), operands) {
            let (Some(left), Some(right)) = (self.value(left), self.value(right)) else { return LadderLogic::Open };
            return LadderLogic::Compare { operator, left, right };
        }
        let logic = operands.first().and_then(|operand| self.bit(operand)).unwrap_or(LadderLogic::Open);
        _ = pos;
        if name == "XIO" { logic.complement() } else { logic }
    }

    /// Returns the contact of a bit: a BOOL tag, or a bit of a timer or counter.
    fn bit(&mut self, operand: &NeutralOperand) -> Option<LadderLogic> {
        let pos = operand.pos;
        let contact = |operand| LadderLogic::Contact { negated: false, operand };
        let complement = |operand| LadderLogic::Contact { negated: true, operand };
        let Some((name, part)) = operand.text.split_once('.') else {
            return self.bool_tag(operand, false).map(contact);
        };
        let part = part.to_ascii_uppercase();
        let kind = self.known_tag(name, None, pos)?;
        Some(match (kind, part.as_str()) {
            (TagKind::Timer(..), "EN") => contact(member(name, "IN", pos)),
            (TagKind::Timer(..), "DN") => contact(member(name, "Q", pos)),
            (TagKind::Timer(Some(StandardBlock::Tof), _), "TT") => {
                contact(member(name, "Q", pos)).and(complement(member(name, "IN", pos)))
            }
            (TagKind::Timer(..), "TT") => contact(member(name, "IN", pos)).and(complement(member(name, "Q", pos))),
            (TagKind::Counter(_), "CU" | "CD" | "DN") => contact(self.tags.part(name, &part, IecType::Bool, pos)),
            _ => {
                self.refuse(pos, format!("`{}` is not read", operand.text), "use EN, TT, DN, CU, CD, ACC and tags");
                return None;
            }
        })
    }

    /// Returns the kind of a tag; without declarations `kind` declares it.
    pub fn known_tag(&mut self, name: &str, kind: Option<TagKind>, pos: Pos) -> Option<TagKind> {
        if !is_plain_name(name) {
            let hint = "give a tag: letters, digits and `_`, no index and no address";
            self.refuse(pos, format!("`{name}` is not read as a tag"), hint);
            return None;
        }
        let found = match kind {
            Some(kind) => self.tags.get_or_add(name, kind, pos),
            None => self.tags.get(name),
        };
        if let Some(tag) = found {
            tag.is_used = true;
            return Some(tag.kind.clone());
        }
        self.refuse(pos, format!("there is no tag `{name}`"), "declare it, or use its timer or counter in a rung");
        None
    }

    /// Returns a BOOL tag as an operand.
    pub fn bool_tag(&mut self, operand: &NeutralOperand, is_written: bool) -> Option<IlOperand> {
        let (name, pos) = (operand.text.as_str(), operand.pos);
        if matches!(name, "0" | "1") && !is_written {
            return Some(crate::il::bool_operand(name == "1", pos));
        }
        match self.known_tag(name, Some(TagKind::Elementary(IecType::Bool)), pos)? {
            TagKind::Elementary(IecType::Bool) => {}
            _ => {
                self.refuse(pos, format!("`{name}` is no BOOL"), "give a BOOL tag");
                return None;
            }
        }
        let tag = self.tags.get(name)?;
        tag.is_written |= is_written;
        if is_written && tag.section == Some(IlSection::Input) {
            let cause = format!("`{name}` is an input and is written");
            self.refuse(pos, cause, "write an output or another tag");
            return None;
        }
        Some(variable(name, pos))
    }

    /// Returns a number: a literal, an integer tag, or ACC of a timer or counter.
    pub fn value(&mut self, operand: &NeutralOperand) -> Option<IlOperand> {
        let (text, pos) = (operand.text.as_str(), operand.pos);
        if text.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+') {
            return match literal_of_text(self.file, text, pos) {
                Ok(literal) => Some(IlOperand { kind: IlOperandKind::Literal(literal), pos }),
                Err(fault) => {
                    self.faults.push(fault);
                    None
                }
            };
        }
        let Some((name, part)) = text.split_once('.') else { return self.number_tag(operand, false) };
        match (self.known_tag(name, None, pos)?, part.to_ascii_uppercase().as_str()) {
            (TagKind::Counter(_), "ACC") => Some(self.tags.part(name, "ACC", IecType::Dint, pos)),
            (TagKind::Counter(Some(preset)) | TagKind::Timer(_, Some(preset)), "PRE") => {
                Some(super::tags::number(preset, pos))
            }
            (TagKind::Timer(block, _), "ACC") if block != Some(StandardBlock::Tof) => {
                let target = self.tags.part(name, "ACC", IecType::Dint, pos);
                self.copy_time(name, &target, pos);
                Some(target)
            }
            _ => {
                self.refuse(pos, format!("`{text}` is not read as a number"), "give ACC of a TON, RTO or counter");
                None
            }
        }
    }

    /// Copies the time of a timer in milliseconds to a number, before the network in work.
    fn copy_time(&mut self, name: &str, target: &IlOperand, pos: Pos) {
        let convert = IlOperation::Function {
            name: crate::il::IlName { text: "TIME_TO_DINT".to_owned(), pos },
            parenthesized: false,
            arguments: Vec::new(),
        };
        let load = IlOperation::Load { negated: false, operand: member(name, "ET", pos) };
        let store = IlOperation::Store { negated: false, target: target.clone() };
        for operation in [load, convert, store] {
            let label = self.label.take();
            self.before.push(IlInstruction { label, operation: Some(operation), pos, ..IlInstruction::default() });
        }
    }

    /// Returns an integer tag as an operand.
    pub fn number_tag(&mut self, operand: &NeutralOperand, is_written: bool) -> Option<IlOperand> {
        let (name, pos) = (operand.text.as_str(), operand.pos);
        match self.known_tag(name, Some(TagKind::Elementary(IecType::Dint)), pos)? {
            TagKind::Elementary(iec_type) if iec_type != IecType::Bool => {}
            _ => {
                self.refuse(pos, format!("`{name}` is no integer"), "give a tag of type SINT, INT or DINT");
                return None;
            }
        }
        self.tags.get(name)?.is_written |= is_written;
        Some(variable(name, pos))
    }
}
