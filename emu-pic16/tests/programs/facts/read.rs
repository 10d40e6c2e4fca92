//! Parses facts: programs, how they run, what they show.

use crate::script::{self, Program};

/// A fact of the page.
pub struct Fact {
    pub name: String,
    pub runs: Vec<Run>,
    pub want: String,
}

/// A program and its observations.
pub struct Run {
    pub name: String,
    pub program: Program,
    /// Watched bits: the text that names each, its address and number.
    pub watched: Vec<(String, u16, u8)>,
    pub show: String,
}

/// Returns all facts of a text.
pub fn facts(text: &str) -> Vec<Fact> {
    format!("\n{text}").split("\n== ").skip(1).map(fact).collect()
}

/// Returns the text after `key`, if the line starts with it.
fn value<'a>(line: &'a str, key: &str) -> Option<&'a str> {
    line.strip_prefix(key)?.strip_prefix(' ')
}

fn fact(text: &str) -> Fact {
    let (name, body) = text.split_once('\n').expect("a fact has a body");
    let find = |key| body.lines().find_map(|line| value(line, key));
    let each: Vec<&str> = find("each").map_or_else(|| vec!["$"], |values| values.split_whitespace().collect());
    let runs = each.iter().map(|value| run(name, &body.replace('$', value))).collect();
    Fact { name: name.to_owned(), runs, want: find("want").unwrap_or_else(|| panic!("{name}: want")).to_owned() }
}

fn run(name: &str, body: &str) -> Run {
    let asks = |line: &&str| ["each", "want", "watch", "show"].iter().any(|key| value(line, key).is_some());
    let (asks, program): (Vec<&str>, Vec<&str>) = body.lines().partition(asks);
    let program = Program::new(name, &program.join("\n"));
    let watch = |place: &str| {
        let (reg, bit) = place.split_once('.')?;
        Some((place.to_owned(), script::register(program.part, reg)?, bit.parse().ok()?))
    };
    let watches = asks.iter().filter_map(|line| value(line, "watch"));
    Run {
        name: name.to_owned(),
        watched: watches.map(|place| watch(place).unwrap_or_else(|| panic!("{name}: watch {place}"))).collect(),
        show: asks.iter().find_map(|line| value(line, "show")).unwrap_or("").to_owned(),
        program,
    }
}
