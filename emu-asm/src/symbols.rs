//! Names of a program and their values, from pass to pass.

use std::collections::HashMap;
use std::rc::Rc;

use crate::value::AsmValue;

/// What a name is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum AsmSymbolKind {
    /// An address in a memory, in bytes.
    Label {
        /// Name of the memory.
        space: &'static str,
        /// Byte address within it.
        addr: u32,
    },
    /// A constant number.
    Equ,
    /// A number that may be redefined.
    Set,
    /// A core register under another name.
    Alias {
        /// The register.
        of: Rc<str>,
        /// The name may be redefined.
        redefinable: bool,
    },
}

impl AsmSymbolKind {
    /// Reports whether a name of this kind may be redefined.
    fn is_redefinable(&self) -> bool {
        matches!(self, AsmSymbolKind::Set | AsmSymbolKind::Alias { redefinable: true, .. })
    }
}

/// A line of the source or of a file that it includes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct LineNumber {
    /// Number of the file's text.
    pub file: u32,
    /// Number of the line, from 1.
    pub number: u32,
}

/// A name and its value.
#[derive(Debug, Clone)]
pub(crate) struct AsmSymbol {
    /// Its value.
    pub value: AsmValue,
    /// What it is.
    pub kind: AsmSymbolKind,
    /// The pass that last defined it.
    pub pass: u32,
    /// The line that defined it.
    pub place: LineNumber,
    /// Its value at the end of the previous pass.
    previous_value: AsmValue,
    /// It was read in this pass before its definition.
    read_before_definition: bool,
}

/// All names.
#[derive(Debug, Default)]
pub(crate) struct AsmSymbols {
    names: HashMap<Rc<str>, AsmSymbol>,
    /// Names by their lower-case spelling, if that is different.
    lower: HashMap<String, Rc<str>>,
}

impl AsmSymbols {
    /// Returns the symbol of a name; with `any_case` also one whose name differs only in case.
    pub fn get(&self, name: &str, any_case: bool) -> Option<&AsmSymbol> {
        self.names.get(name).or_else(|| {
            let lower = any_case.then(|| name.to_ascii_lowercase())?;
            self.names.get(lower.as_str()).or_else(|| self.names.get(self.lower.get(&lower)?))
        })
    }

    /// Returns the symbol of a name for modification.
    fn get_mut(&mut self, name: &str, any_case: bool) -> Option<&mut AsmSymbol> {
        if self.names.contains_key(name) || !any_case {
            return self.names.get_mut(name);
        }
        let lower = name.to_ascii_lowercase();
        let found = if self.names.contains_key(lower.as_str()) {
            lower.as_str().into()
        } else {
            self.lower.get(&lower)?.clone()
        };
        self.names.get_mut(&found)
    }

    /// Returns the value of a name, and whether this pass has defined it.
    pub fn read_value(&mut self, name: &str, any_case: bool, pass: u32) -> Option<(AsmValue, bool)> {
        let symbol = self.get_mut(name, any_case)?;
        let given = symbol.pass == pass;
        symbol.read_before_definition |= !given;
        Some((symbol.value, given))
    }

    /// Defines a name.
    ///
    /// # Errors
    /// The line that defined it differently in this pass.
    pub fn define(
        &mut self,
        name: &str,
        value: AsmValue,
        kind: AsmSymbolKind,
        pass: u32,
        place: LineNumber,
    ) -> Result<(), LineNumber> {
        match self.names.get_mut(name) {
            Some(old) => {
                let twice = old.pass == pass && !(old.kind.is_redefinable() && kind.is_redefinable());
                if twice && (old.value != value || old.kind != kind) {
                    return Err(old.place);
                }
                (old.value, old.kind, old.pass, old.place) = (value, kind, pass, place);
            }
            None => {
                let shared: Rc<str> = name.into();
                let lower = name.to_ascii_lowercase();
                if lower != name {
                    self.lower.entry(lower).or_insert_with(|| shared.clone());
                }
                let before = AsmValue { is_unknown: true, ..AsmValue::default() };
                self.names.insert(
                    shared,
                    AsmSymbol { value, kind, pass, place, previous_value: before, read_before_definition: false },
                );
            }
        }
        Ok(())
    }

    /// Ends a pass; returns the names that were read before their definition and have changed since, and
    /// those that disappeared.
    pub fn end_pass(&mut self, pass: u32) -> Vec<Rc<str>> {
        let gone: Vec<Rc<str>> =
            self.names.iter().filter(|(_, symbol)| symbol.pass != pass).map(|(name, _)| name.clone()).collect();
        let mut moved: Vec<Rc<str>> = gone
            .iter()
            .filter(|name| self.names.get(*name).is_some_and(|s| s.read_before_definition))
            .cloned()
            .collect();
        for name in gone {
            self.names.remove(&name);
        }
        for (name, symbol) in &mut self.names {
            if symbol.read_before_definition && symbol.previous_value != symbol.value {
                moved.push(name.clone());
            }
            symbol.previous_value = symbol.value;
            symbol.read_before_definition = false;
        }
        self.lower.retain(|_, name| self.names.contains_key(name));
        moved.sort();
        moved
    }

    /// Returns all symbols, sorted by name.
    pub fn all(&self) -> Vec<(&Rc<str>, &AsmSymbol)> {
        let mut all: Vec<_> = self.names.iter().collect();
        all.sort_by(|a, b| a.0.cmp(b.0));
        all
    }

    /// Returns all names.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.keys().map(AsRef::as_ref)
    }
}
