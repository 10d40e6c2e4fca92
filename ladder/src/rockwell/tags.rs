//! Tags as variables: the type of each, and the variables that stand for the parts of timers and counters.

use std::collections::BTreeMap;

use diag::Pos;

use crate::diagram::NameMaker;
use crate::il::{IecType, IlLiteral, IlName, IlOperand, IlOperandKind, IlSection, IlValue, IlVariable, StandardBlock};

/// What a tag is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum TagKind {
    /// A BOOL or an integer.
    Elementary(IecType),
    /// A TIMER; its block, once an instruction decides, and its preset in milliseconds.
    Timer(Option<StandardBlock>, Option<i64>),
    /// A COUNTER and its preset.
    Counter(Option<i64>),
}

/// A tag.
#[derive(Debug, Clone)]
pub(super) struct Tag {
    pub name: IlName,
    pub kind: TagKind,
    pub initial: i64,
    pub comment: Option<String>,
    /// Whether an instruction writes it.
    pub is_written: bool,
    /// Whether an instruction uses it.
    pub is_used: bool,
    /// Section that an alias decides.
    pub section: Option<IlSection>,
}

/// All tags by name in capitals, and the variables of counters.
#[derive(Debug, Default)]
pub(super) struct Tags {
    tags: BTreeMap<String, Tag>,
    /// Order of the declarations.
    order: Vec<String>,
    /// Variable of `NAME.PART`, in capitals.
    parts: BTreeMap<(String, String), IlName>,
    pub names: NameMaker,
    /// Whether the program declares its tags.
    pub is_declared: bool,
}

impl Tags {
    /// Adds a tag.
    pub fn add(&mut self, name: &str, kind: TagKind, pos: Pos) -> &mut Tag {
        let upper = name.to_ascii_uppercase();
        if !self.tags.contains_key(&upper) {
            self.order.push(upper.clone());
            self.names.reserve(name);
        }
        let name = IlName { text: name.to_owned(), pos };
        self.tags.entry(upper).or_insert(Tag {
            name,
            kind,
            initial: 0,
            comment: None,
            is_written: false,
            is_used: false,
            section: None,
        })
    }

    /// Returns a tag.
    pub fn get(&mut self, name: &str) -> Option<&mut Tag> {
        self.tags.get_mut(&name.to_ascii_uppercase())
    }

    /// Returns the tag; without declarations the first use declares it.
    pub fn get_or_add(&mut self, name: &str, kind: TagKind, pos: Pos) -> Option<&mut Tag> {
        if !self.is_declared {
            self.add(name, kind, pos);
        }
        self.get(name)
    }

    /// Returns the variable that holds a part of a counter, or the time of a timer as a number.
    pub fn part(&mut self, tag: &str, part: &str, iec_type: IecType, pos: Pos) -> IlOperand {
        let key = (tag.to_ascii_uppercase(), part.to_owned());
        if let Some(name) = self.parts.get(&key) {
            return variable(&name.text, pos);
        }
        let stem = format!("{tag}_{part}");
        let declared = self.get(tag).map_or(pos, |tag| tag.name.pos);
        let name = self.names.declare_as(&stem, iec_type, declared);
        self.parts.insert(key, name.clone());
        variable(&name.text, pos)
    }

    /// Returns the variables of all tags that are used, then those made for them.
    pub fn into_variables(mut self) -> Vec<IlVariable> {
        let mut variables = Vec::new();
        for name in &self.order {
            let Some(tag) = self.tags.remove(name) else { continue };
            let iec_type = match &tag.kind {
                TagKind::Elementary(iec_type) => iec_type.clone(),
                TagKind::Timer(Some(block), _) => IecType::Block(*block),
                TagKind::Timer(None, _) | TagKind::Counter(_) => continue,
            };
            if !tag.is_used {
                continue;
            }
            let upper = tag.name.text.to_ascii_uppercase();
            let digits = upper.strip_prefix(['M', 'R', 'F']);
            let is_relay =
                digits.is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()));
            let section = match (&iec_type, tag.is_written) {
                (IecType::Bool, false) => IlSection::Input,
                (IecType::Bool, true) if !is_relay => IlSection::Output,
                _ => IlSection::Local,
            };
            let value = match iec_type {
                IecType::Bool => IlValue::Bool(tag.initial != 0),
                _ => IlValue::Integer { value: tag.initial, base: 10 },
            };
            let has_initial = tag.initial != 0 && !iec_type.is_block() && section != IlSection::Input;
            variables.push(IlVariable {
                name: tag.name,
                section: tag.section.unwrap_or(section),
                qualifier: None,
                iec_type,
                address: None,
                initial: has_initial.then_some(IlLiteral { prefix: None, value }),
                comment: tag.comment,
            });
        }
        variables.append(&mut self.names.variables);
        variables
    }
}

/// Returns the operand that names a variable.
pub(super) fn variable(name: &str, pos: Pos) -> IlOperand {
    IlOperand { kind: IlOperandKind::Variable { name: name.to_owned(), member: None }, pos }
}

/// Returns the operand that names an input or output of an instance.
pub(super) fn member(name: &str, part: &str, pos: Pos) -> IlOperand {
    IlOperand { kind: IlOperandKind::Variable { name: name.to_owned(), member: Some(part.to_owned()) }, pos }
}

/// Returns the operand of a decimal number without a type.
pub(super) fn number(value: i64, pos: Pos) -> IlOperand {
    let literal = IlLiteral { prefix: None, value: IlValue::Integer { value, base: 10 } };
    IlOperand { kind: IlOperandKind::Literal(literal), pos }
}
