//! Reads the project around a program: its units (POUs), variables, tasks.

use diag::{Diagnostic, Pos, Severity};

use crate::codes;
use crate::il::{
    IecType, IlName, IlProgram, IlQualifier, IlSection, IlVariable, address_of_text, declared_type,
    instructions_of_text, is_plain_name, link_faults, literal_of_text,
};
use crate::xml::{XmlElement, read_xml};

use super::body::read_ladder;

/// Most errors that are reported.
const MAX_FAULTS: usize = 100;

/// A program and the interval of its task.
pub(crate) struct PlcOpenProgram {
    /// The program.
    pub program: IlProgram,
    /// Interval of its task in microseconds, if the project has one.
    pub cycle_us: Option<u64>,
}

/// Reads a project that has one program.
///
/// # Errors
/// Returns all faults: what is damaged, and by name what is not read.
pub(crate) fn read(file: &str, text: &str) -> Result<PlcOpenProgram, Vec<Diagnostic>> {
    let project = read_xml(file, text).map_err(|fault| vec![fault])?;
    let mut reader = ProjectReader { file, faults: Vec::new() };
    let program = reader.project(&project);
    reader.faults.truncate(MAX_FAULTS);
    match program {
        Some(program) if reader.faults.is_empty() => {
            let cycle_us = interval(&project);
            let faults = link_faults(&program);
            if faults.iter().any(Diagnostic::is_error) { Err(faults) } else { Ok(PlcOpenProgram { program, cycle_us }) }
        }
        _ => {
            reader.faults.sort_by_key(|fault| fault.pos);
            Err(reader.faults)
        }
    }
}

struct ProjectReader<'a> {
    file: &'a str,
    faults: Vec<Diagnostic>,
}

impl ProjectReader<'_> {
    fn refuse(&mut self, pos: Pos, cause: impl Into<String>, hint: &str) {
        self.faults.push(Diagnostic::new(Severity::Error, codes::PART_NOT_READ, self.file, pos, cause, hint));
    }

    fn project(&mut self, project: &XmlElement) -> Option<IlProgram> {
        let types = project.child("types");
        for data_type in types.and_then(|types| types.child("dataTypes")).into_iter().flat_map(|types| &types.children)
        {
            let name = data_type.attribute("name").unwrap_or_default();
            self.refuse(data_type.pos, format!("the data type `{name}` is not read"), "use elementary types");
        }
        let mut program = None;
        for unit in
            types.and_then(|types| types.child("pous")).into_iter().flat_map(|units| units.children_named("pou"))
        {
            let name = unit.attribute("name").unwrap_or_default();
            match unit.attribute("pouType").unwrap_or_default() {
                "program" if program.is_none() => program = Some(self.program(unit, name)),
                "program" => {
                    self.refuse(unit.pos, format!("`{name}` is a second program"), "keep one program in the file");
                }
                kind => {
                    let kind = match kind {
                        "functionBlock" => "function block",
                        "function" => "function",
                        other => other,
                    };
                    let hint = "use the standard functions and blocks";
                    self.refuse(unit.pos, format!("`{name}` is a {kind} by the user"), hint);
                }
            }
        }
        let Some(mut program) = program else {
            self.refuse(project.pos, "the project has no program", "give a project with a `pou` of type program");
            return None;
        };
        self.global_variables(project, &mut program);
        Some(program)
    }

    /// Adds the variables of configurations and resources, and refuses a second instance.
    fn global_variables(&mut self, project: &XmlElement, program: &mut IlProgram) {
        let Some(instances) = project.child("instances") else { return };
        let (mut lists, mut uses) = (Vec::new(), Vec::new());
        instances.visit(&mut |element| match element.name.as_str() {
            "globalVars" => lists.push(element),
            "pouInstance" => uses.push(element),
            _ => {}
        });
        for list in lists {
            self.variables(list, IlSection::Global, program);
        }
        for second in uses.into_iter().skip(1) {
            let name = second.attribute("name").unwrap_or_default();
            self.refuse(second.pos, format!("`{name}` is a second instance of a program"), "keep one instance");
        }
    }

    fn program(&mut self, unit: &XmlElement, name: &str) -> IlProgram {
        let mut program = IlProgram { file: self.file.to_owned(), ..IlProgram::default() };
        if is_plain_name(name) {
            program.name = Some(IlName { text: name.to_owned(), pos: unit.pos });
        }
        let text = unit.child("documentation").map(XmlElement::all_text).unwrap_or_default();
        program.remarks.extend(text.lines().map(str::trim).filter(|line| !line.is_empty()).map(comment));
        for list in unit.child("interface").into_iter().flat_map(|interface| &interface.children) {
            let section = match list.name.as_str() {
                "inputVars" => IlSection::Input,
                "outputVars" => IlSection::Output,
                "inOutVars" => IlSection::InOut,
                "localVars" => IlSection::Local,
                "tempVars" => IlSection::Temporary,
                "globalVars" => IlSection::Global,
                // The project declares them elsewhere.
                "externalVars" | "documentation" | "addData" => continue,
                other => {
                    self.refuse(list.pos, format!("`{other}` is not read"), "declare the variables as localVars");
                    continue;
                }
            };
            self.variables(list, section, &mut program);
        }
        for part in ["actions", "transitions"] {
            for part in unit.child(part).into_iter().flat_map(|list| &list.children) {
                self.refuse(part.pos, format!("`{name}` has an {}", part.name), "put all in the body of the program");
            }
        }
        let bodies: Vec<&XmlElement> = unit.children_named("body").collect();
        if bodies.is_empty() {
            self.refuse(unit.pos, format!("`{name}` has no body"), "draw the program");
        }
        for body in bodies {
            self.body(body, name, &mut program);
        }
        program
    }

    fn body(&mut self, body: &XmlElement, name: &str, program: &mut IlProgram) {
        for part in &body.children {
            match part.name.as_str() {
                "LD" => match read_ladder(self.file, part, &mut program.variables) {
                    Ok(lines) => program.instructions.extend(lines),
                    Err(faults) => self.faults.extend(faults),
                },
                "IL" => {
                    let inner = part.children.first().unwrap_or(part);
                    match instructions_of_text(self.file, &inner.all_text(), inner.text_pos) {
                        Ok(lines) => program.instructions.extend(lines),
                        Err(faults) => self.faults.extend(faults),
                    }
                }
                "documentation" | "addData" => {}
                language => {
                    let language = match language {
                        "ST" => "Structured Text",
                        "FBD" => "Function Block Diagram",
                        "SFC" => "Sequential Function Chart",
                        other => other,
                    };
                    let hint = "give a body in LD or IL";
                    self.refuse(part.pos, format!("the body of `{name}` is {language}, which is not read"), hint);
                }
            }
        }
    }

    fn variables(&mut self, list: &XmlElement, section: IlSection, program: &mut IlProgram) {
        let qualifier = match (list.is_true("constant"), list.is_true("retain") || list.is_true("persistent")) {
            (true, _) => Some(IlQualifier::Constant),
            (false, true) => Some(IlQualifier::Retain),
            (false, false) => None,
        };
        for variable in list.children_named("variable") {
            match self.variable(variable, section, qualifier) {
                Ok(variable) => program.variables.push(variable),
                Err(fault) => self.faults.push(fault),
            }
        }
    }

    fn variable(
        &self,
        variable: &XmlElement,
        section: IlSection,
        qualifier: Option<IlQualifier>,
    ) -> Result<IlVariable, Diagnostic> {
        let (file, pos) = (self.file, variable.pos);
        let refusal = |code, pos, cause: String, hint| Diagnostic::new(Severity::Error, code, file, pos, cause, hint);
        let name = variable.attribute("name").unwrap_or_default();
        if !is_plain_name(name) {
            let hint = "use letters, digits and `_`, and no keyword";
            return Err(refusal(codes::PART_NOT_READ, pos, format!("`{name}` is no name of a variable"), hint));
        }
        let iec_type = match variable.child("type").and_then(|found| found.children.first()) {
            Some(found) if found.name == "derived" => {
                declared_type(file, found.attribute("name").unwrap_or_default(), found.pos)?
            }
            Some(found) => declared_type(file, &found.name.to_ascii_uppercase(), found.pos)?,
            None => {
                let cause = format!("the variable `{name}` has no type");
                return Err(refusal(codes::PART_NOT_READ, pos, cause, "give it a type, such as <BOOL/>"));
            }
        };
        let address = match variable.attribute("address").filter(|text| !text.trim().is_empty()) {
            Some(text) => Some(address_of_text(file, text, pos)?),
            None => None,
        };
        let initial = match variable.child("initialValue") {
            Some(value) => Some(self.initial_value(value, &iec_type, name)?),
            None => None,
        };
        let text = variable.child("documentation").map(XmlElement::all_text).unwrap_or_default();
        let text: Vec<&str> = text.split_whitespace().collect();
        Ok(IlVariable {
            name: IlName { text: name.to_owned(), pos },
            section,
            qualifier,
            iec_type,
            address,
            initial,
            comment: (!text.is_empty()).then(|| comment(&text.join(" "))),
        })
    }

    fn initial_value(
        &self,
        value: &XmlElement,
        iec_type: &IecType,
        name: &str,
    ) -> Result<crate::il::IlLiteral, Diagnostic> {
        let text = value.child("simpleValue").and_then(|simple| simple.attribute("value"));
        match text {
            Some(text) if !iec_type.is_block() => literal_of_text(self.file, text, value.pos),
            _ => {
                let cause = format!("the initial value of `{name}` is not read");
                let hint = "give one value, such as <simpleValue value=\"1\"/>, for a variable that is no block";
                Err(Diagnostic::new(Severity::Error, codes::PART_NOT_READ, self.file, value.pos, cause, hint))
            }
        }
    }
}

/// Returns a text as the line of a comment.
fn comment(text: &str) -> String {
    text.replace("*)", "* )")
}

/// Returns the interval of the first task in microseconds.
fn interval(project: &XmlElement) -> Option<u64> {
    let mut found = None;
    project.child("instances")?.visit(&mut |element| {
        if element.name == "task" && found.is_none() {
            found = element.attribute("interval").and_then(microseconds);
        }
    });
    found.filter(|us| *us > 0)
}

/// Reads `T#10ms`, `PT0.01S` and `00:00:00.010000`.
fn microseconds(text: &str) -> Option<u64> {
    let seconds = |text: &str| -> Option<u64> {
        let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
        let digits: String = fraction.chars().chain("000000".chars()).take(6).collect();
        whole.parse::<u64>().ok()?.checked_mul(1_000_000)?.checked_add(digits.parse::<u64>().ok()?)
    };
    let upper = text.trim().to_ascii_uppercase();
    if let Some(rest) = upper.strip_prefix("PT") {
        return seconds(rest.strip_suffix('S')?);
    }
    if upper.contains('#') {
        let literal = literal_of_text("", &upper, Pos::default()).ok()?;
        return match literal.value {
            crate::il::IlValue::Time(nanoseconds) => u64::try_from(nanoseconds / 1000).ok(),
            _ => None,
        };
    }
    let mut parts = upper.split(':');
    let (hours, minutes, rest) = (parts.next()?, parts.next()?, parts.next()?);
    let whole = hours.parse::<u64>().ok()?.checked_mul(60)?.checked_add(minutes.parse::<u64>().ok()?)?;
    whole.checked_mul(60_000_000)?.checked_add(seconds(rest)?)
}
