//! Names of a program of LDmicro in Instruction List, and names for what the conversion adds.

use std::collections::{BTreeMap, BTreeSet};

use crate::il::is_name;

use super::facts::SourceFacts;

/// The names of the result.
pub(super) struct NameTable {
    /// Name of each symbol of the source.
    names: BTreeMap<String, String>,
    /// All names that are taken, in capitals.
    taken: BTreeSet<String>,
    /// Number of the last added name of each stem.
    numbers: BTreeMap<&'static str, usize>,
}

impl NameTable {
    /// Chooses a name of Instruction List for every symbol of a program.
    pub(super) fn new(facts: &SourceFacts<'_>) -> NameTable {
        let mut table = NameTable { names: BTreeMap::new(), taken: BTreeSet::new(), numbers: BTreeMap::new() };
        let symbols = facts.symbols();
        // Names that stay have precedence over names that change.
        for (name, _) in &symbols {
            if is_name(name) && table.taken.insert(name.to_ascii_uppercase()) {
                table.names.insert(name.clone(), name.clone());
            }
        }
        for (name, _) in symbols {
            if !table.names.contains_key(&name) {
                let other = table.changed(&name);
                table.names.insert(name, other);
            }
        }
        table
    }

    /// Returns a free name that resembles one that cannot stay.
    fn changed(&mut self, name: &str) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' };
        let mut stem: String = name.chars().map(plain).take(100).collect();
        if !stem.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_') {
            stem.insert(0, '_');
        }
        let mut number = 1_usize;
        let mut found = stem.clone();
        while !is_name(&found) || !self.taken.insert(found.to_ascii_uppercase()) {
            number += 1;
            found = format!("{stem}_{number}");
        }
        found
    }

    /// Returns the name of a symbol in Instruction List.
    pub(super) fn name(&self, symbol: &str) -> String {
        self.names.get(symbol).cloned().unwrap_or_else(|| symbol.to_owned())
    }

    /// Returns the changed names, each with the name in its place.
    pub(super) fn renamed(&self) -> Vec<(String, String)> {
        let changed = self.names.iter().filter(|(from, to)| from != to);
        changed.map(|(from, to)| (from.clone(), to.clone())).collect()
    }

    /// Returns a free name: the stem and a number.
    pub(super) fn add(&mut self, stem: &'static str) -> String {
        let number = self.numbers.entry(stem).or_default();
        loop {
            *number += 1;
            let name = format!("{stem}{number}");
            if self.taken.insert(name.to_ascii_uppercase()) {
                return name;
            }
        }
    }
}
