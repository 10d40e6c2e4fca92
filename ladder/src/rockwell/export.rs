//! Reads a file: neutral text alone, or an export (L5X) with tags and routines.

use diag::{Diagnostic, Pos, Severity};

use crate::codes;
use crate::il::{IecType, IlInstruction, IlProgram, is_plain_name, link_faults};
use crate::xml::{XmlElement, read_xml};

use super::lower::RungLowering;
use super::tags::{TagKind, Tags};
use super::text::{NeutralItem, NeutralRung, TextFault, read_rungs};

/// Reads a program.
///
/// # Errors
/// Returns all faults: what is damaged, and by name what is not read.
pub(crate) fn read(file: &str, text: &str) -> Result<IlProgram, Vec<Diagnostic>> {
    let mut faults = Vec::new();
    let mut tags = Tags::default();
    let rungs = if text.trim_start_matches('\u{feff}').trim_start().starts_with('<') {
        let export = read_xml(file, text).map_err(|fault| vec![fault])?;
        export_rungs(file, &export, &mut tags, &mut faults)
    } else {
        read_rungs(text, Pos::new(1, 1, 1)).unwrap_or_else(|fault| {
            faults.push(text_fault(file, fault));
            Vec::new()
        })
    };
    if !tags.is_declared {
        declare_timers(&rungs, &mut tags);
    }
    let mut lowering = RungLowering::new(file, &mut tags);
    rungs.iter().for_each(|rung| lowering.rung(rung));
    if let Some(label) = lowering.label.take() {
        let pos = label.pos;
        lowering.lines.push(IlInstruction { label: Some(label), pos, ..IlInstruction::default() });
    }
    for comment in std::mem::take(&mut lowering.comments) {
        lowering.lines.push(IlInstruction { comment: Some(comment), ..IlInstruction::default() });
    }
    let (instructions, found) = (lowering.lines, lowering.faults);
    faults.extend(found);
    if !faults.is_empty() {
        faults.truncate(100);
        return Err(faults);
    }
    let variables = tags.into_variables();
    let program = IlProgram { file: file.to_owned(), variables, instructions, ..IlProgram::default() };
    let faults = link_faults(&program);
    if faults.iter().any(Diagnostic::is_error) { Err(faults) } else { Ok(program) }
}

fn text_fault(file: &str, fault: TextFault) -> Diagnostic {
    let (code, hint) = match fault.is_damaged {
        true => (codes::NEUTRAL_TEXT, "write rungs such as XIC(a)[XIC(b),XIO(c)]OTE(d);"),
        false => (codes::PART_NOT_READ, "docs/languages/rockwell.md lists the instructions"),
    };
    Diagnostic::new(Severity::Error, code, file, fault.pos, fault.cause, hint)
}

fn refusal(file: &str, pos: Pos, cause: String, hint: &str) -> Diagnostic {
    Diagnostic::new(Severity::Error, codes::PART_NOT_READ, file, pos, cause, hint)
}

/// Declares the timers and counters of rungs without declarations, so that their bits can be used above.
fn declare_timers(rungs: &[NeutralRung], tags: &mut Tags) {
    fn visit(items: &[NeutralItem], tags: &mut Tags) {
        for item in items {
            match item {
                NeutralItem::Branch(branches) => branches.iter().for_each(|branch| visit(branch, tags)),
                NeutralItem::Instruction { name, operands, .. } => {
                    use crate::il::StandardBlock::{Tof, Ton, Tona};
                    let kind = match name.as_str() {
                        "TON" => TagKind::Timer(Some(Ton), None),
                        "TOF" => TagKind::Timer(Some(Tof), None),
                        "RTO" => TagKind::Timer(Some(Tona), None),
                        "CTU" | "CTD" => TagKind::Counter(None),
                        _ => continue,
                    };
                    if let Some(operand) = operands.first().filter(|operand| is_plain_name(&operand.text)) {
                        tags.add(&operand.text, kind, operand.pos);
                    }
                }
            }
        }
    }
    rungs.iter().for_each(|rung| visit(&rung.items, tags));
}

/// Returns the rungs of the one routine of an export; adds its tags.
fn export_rungs(file: &str, export: &XmlElement, tags: &mut Tags, faults: &mut Vec<Diagnostic>) -> Vec<NeutralRung> {
    let (mut declared, mut routines, mut others) = (Vec::new(), Vec::new(), Vec::new());
    export.visit(&mut |element| match element.name.as_str() {
        "Tag" => declared.push(element),
        "Routine" => routines.push(element),
        "AddOnInstructionDefinition" | "DataType" => others.push(element),
        _ => {}
    });
    for other in others {
        let name = other.attribute("Name").unwrap_or_default();
        faults.push(refusal(
            file,
            other.pos,
            format!("`{name}` is a type by the user"),
            "use BOOL, SINT, INT, DINT, TIMER, COUNTER",
        ));
    }
    for tag in declared {
        add_tag(file, tag, tags, faults);
    }
    tags.is_declared = true;
    let mut rungs = Vec::new();
    for (index, routine) in routines.iter().enumerate() {
        let name = routine.attribute("Name").unwrap_or_default();
        let kind = routine.attribute("Type").unwrap_or("RLL");
        if kind != "RLL" {
            let kind = match kind {
                "ST" => "Structured Text",
                "FBD" => "Function Block Diagram",
                "SFC" => "Sequential Function Chart",
                other => other,
            };
            faults.push(refusal(
                file,
                routine.pos,
                format!("the routine `{name}` is {kind}, which is not read"),
                "give a routine of ladder",
            ));
        } else if index > 0 {
            faults.push(refusal(
                file,
                routine.pos,
                format!("`{name}` is a second routine"),
                "keep one routine in the file",
            ));
        } else {
            routine_rungs(file, routine, &mut rungs, faults);
        }
    }
    if routines.is_empty() {
        faults.push(refusal(file, export.pos, "the export has no routine".to_owned(), "export a routine of ladder"));
    }
    rungs
}

fn routine_rungs(file: &str, routine: &XmlElement, rungs: &mut Vec<NeutralRung>, faults: &mut Vec<Diagnostic>) {
    for rung in routine.children_named("RLLContent").flat_map(|content| content.children_named("Rung")) {
        let comment = rung.child("Comment").map(XmlElement::all_text).unwrap_or_default();
        let lines = comment.lines().map(str::trim).filter(|line| !line.is_empty());
        let mut comments: Vec<String> = lines.map(|line| line.replace("*)", "* )")).collect();
        for text in rung.children_named("Text") {
            // The text is inside of CDATA, which begins at its first character that is no space.
            match read_rungs(&text.text, text.text_pos) {
                Ok(mut found) => {
                    if let Some(first) = found.first_mut() {
                        first.comments.splice(0..0, std::mem::take(&mut comments));
                    }
                    rungs.extend(found);
                }
                Err(fault) => faults.push(text_fault(file, fault)),
            }
        }
    }
}

fn add_tag(file: &str, tag: &XmlElement, tags: &mut Tags, faults: &mut Vec<Diagnostic>) {
    let name = tag.attribute("Name").unwrap_or_default();
    if !is_plain_name(name) {
        faults.push(refusal(
            file,
            tag.pos,
            format!("`{name}` is no name of a tag here"),
            "use letters, digits and `_`, and no keyword",
        ));
        return;
    }
    let mut values: Vec<(&str, &str)> = Vec::new();
    tag.visit(&mut |part| {
        if matches!(part.name.as_str(), "DataValue" | "DataValueMember") {
            values.push((part.attribute("Name").unwrap_or_default(), part.attribute("Value").unwrap_or_default()));
        }
    });
    let number =
        |part: &str| values.iter().find(|(name, _)| *name == part).and_then(|(_, value)| value.parse::<i64>().ok());
    let is_array = tag.attribute("Dimensions").is_some_and(|dimensions| !dimensions.is_empty());
    let alias = tag.attribute("AliasFor");
    let kind = match tag.attribute("DataType").unwrap_or(if alias.is_some() { "BOOL" } else { "" }) {
        _ if is_array => Err("an array".to_owned()),
        "BOOL" | "BIT" => Ok(TagKind::Elementary(IecType::Bool)),
        "SINT" => Ok(TagKind::Elementary(IecType::Sint)),
        "INT" => Ok(TagKind::Elementary(IecType::Int)),
        "DINT" => Ok(TagKind::Elementary(IecType::Dint)),
        "TIMER" => Ok(TagKind::Timer(None, number("PRE"))),
        "COUNTER" => Ok(TagKind::Counter(number("PRE"))),
        other => Err(format!("of type {other}")),
    };
    match kind {
        Ok(kind) => {
            let text = tag.child("Description").map(XmlElement::all_text).unwrap_or_default();
            let words: Vec<&str> = text.split_whitespace().collect();
            let is_bool = kind == TagKind::Elementary(IecType::Bool);
            let added = tags.add(name, kind, tag.pos);
            added.comment = (!words.is_empty()).then(|| words.join(" ").replace("*)", "* )"));
            added.initial = number("").filter(|_| tag.child("Data").is_some()).unwrap_or(0);
            added.section = match alias {
                Some(alias) if is_bool && alias.contains(":I.") => Some(crate::il::IlSection::Input),
                Some(alias) if is_bool && alias.contains(":O.") => Some(crate::il::IlSection::Output),
                _ => None,
            };
        }
        Err(kind) => {
            faults.push(refusal(
                file,
                tag.pos,
                format!("the tag `{name}` is {kind}"),
                "use BOOL, SINT, INT, DINT, TIMER, COUNTER",
            ));
        }
    }
}
