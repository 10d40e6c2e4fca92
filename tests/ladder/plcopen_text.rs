//! PLCopen projects from a short text, for tests of several crates.
//!
//! Variables: `in|out|var|const NAME TYPE [@ADDRESS] [= VALUE]`. Elements: `NUMBER KIND .. < SOURCES`, in
//! which a source is a number (0 is the left rail) or `NUMBER.OUTPUT`; `contact` and `coil` take `not`,
//! `rise`, `fall`, `set` or `reset` before the name; `block TYPE INSTANCE|- PIN<SOURCE,..` names its
//! connected inputs; `value TEXT` and `into NAME < SOURCE` are variables; `label NAME`, `jump NAME <
//! SOURCES`, `return < SOURCES`, `comment TEXT`.

use std::fmt::Write as _;

fn connections(sources: &str) -> String {
    let mut out = "<connectionPointIn>".to_owned();
    for source in sources.split([' ', ',']).filter(|source| !source.is_empty()) {
        let (number, output) = source.split_once('.').unwrap_or((source, ""));
        let output = if output.is_empty() { String::new() } else { format!(" formalParameter=\"{output}\"") };
        _ = write!(out, "<connection refLocalId=\"{number}\"{output}/>");
    }
    out + "</connectionPointIn>"
}

fn variable(list: &str, words: &[&str]) -> String {
    let mut out = format!("<{list}><variable name=\"{}\"", words[0]);
    if let Some(address) = words.iter().find_map(|word| word.strip_prefix('@')) {
        _ = write!(out, " address=\"{address}\"");
    }
    let block = ["TON", "TOF", "TP", "CTU", "CTD", "CTUD", "SR", "RS", "R_TRIG", "F_TRIG"].contains(&words[1]);
    let iec_type = if block { format!("<derived name=\"{}\"/>", words[1]) } else { format!("<{}/>", words[1]) };
    _ = write!(out, "><type>{iec_type}</type>");
    if let Some(at) = words.iter().position(|word| *word == "=") {
        _ = write!(out, "<initialValue><simpleValue value=\"{}\"/></initialValue>", words[at + 1]);
    }
    out + &format!("</variable></{}>", list.split(' ').next().unwrap_or_default())
}

fn element(words: &[&str], sources: &str, row: usize) -> String {
    let (number, kind) = (words[0], words[1]);
    let position = format!("<position x=\"0\" y=\"{}\"/>", 10 * row);
    let head = format!("localId=\"{number}\"");
    let rest = &words[2..];
    match kind {
        "contact" | "coil" => {
            let mut attributes = String::new();
            for word in &rest[..rest.len() - 1] {
                attributes += match *word {
                    "not" => " negated=\"true\"",
                    "rise" => " edge=\"rising\"",
                    "fall" => " edge=\"falling\"",
                    "set" => " storage=\"set\"",
                    "reset" => " storage=\"reset\"",
                    other => panic!("unknown word {other}"),
                };
            }
            let name = rest[rest.len() - 1];
            let input = connections(sources);
            format!(
                "<{kind} {head}{attributes}>{position}{input}<connectionPointOut/><variable>{name}</variable></{kind}>"
            )
        }
        "block" => {
            let instance = if rest[1] == "-" { String::new() } else { format!(" instanceName=\"{}\"", rest[1]) };
            let mut out = format!("<block {head} typeName=\"{}\"{instance}>{position}<inputVariables>", rest[0]);
            for pin in &rest[2..] {
                let (name, sources) = pin.split_once('<').expect("PIN<SOURCE");
                let (negated, name) = name.strip_prefix('!').map_or(("", name), |name| (" negated=\"true\"", name));
                _ = write!(out, "<variable formalParameter=\"{name}\"{negated}>{}</variable>", connections(sources));
            }
            out + "</inputVariables><inOutVariables/><outputVariables/></block>"
        }
        "value" => format!(
            "<inVariable {head}>{position}<connectionPointOut/><expression>{}</expression></inVariable>",
            rest[0]
        ),
        "into" => {
            let input = connections(sources);
            format!("<outVariable {head}>{position}{input}<expression>{}</expression></outVariable>", rest[0])
        }
        "label" => format!("<label {head} label=\"{}\">{position}</label>", rest[0]),
        "jump" => format!("<jump {head} label=\"{}\">{position}{}</jump>", rest[0], connections(sources)),
        "return" => format!("<return {head}>{position}{}</return>", connections(sources)),
        "comment" => format!("<comment {head}>{position}<content><p>{}</p></content></comment>", rest.join(" ")),
        other => panic!("unknown element {other}"),
    }
}

/// Returns the project of a short text.
pub fn project(text: &str) -> String {
    let (mut interface, mut body) = (String::new(), String::new());
    for (row, line) in text.lines().enumerate() {
        let is_block = line.split_whitespace().nth(1) == Some("block");
        let (head, sources) = if is_block { (line, "") } else { line.split_once('<').unwrap_or((line, "")) };
        let words: Vec<&str> = head.split_whitespace().collect();
        match words.first() {
            Some(&"in") => interface += &variable("inputVars", &words[1..]),
            Some(&"out") => interface += &variable("outputVars", &words[1..]),
            Some(&"var") => interface += &variable("localVars", &words[1..]),
            Some(&"const") => interface += &variable("localVars constant=\"true\"", &words[1..]),
            Some(_) => _ = writeln!(body, "{}", element(&words, sources, row)),
            None => {}
        }
    }
    format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\">\n<types><dataTypes/>\
         <pous><pou name=\"t\" pouType=\"program\"><interface>{interface}</interface><body><LD>\n\
         <leftPowerRail localId=\"0\"><position x=\"0\" y=\"0\"/><connectionPointOut formalParameter=\"\"/></leftPowerRail>\n\
         {body}</LD></body></pou></pous></types></project>\n"
    )
}
