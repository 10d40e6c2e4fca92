//! Names of variables that a drawing does not name.

use std::collections::BTreeSet;

use diag::Pos;

use crate::il::{IecType, IlName, IlSection, IlVariable};

/// Makes names that the program does not use, and declares them.
#[derive(Debug, Clone, Default)]
pub(crate) struct NameMaker {
    /// Names in use, in capitals.
    used: BTreeSet<String>,
    /// Variables made so far.
    pub variables: Vec<IlVariable>,
}

impl NameMaker {
    /// Marks a name as used.
    pub fn reserve(&mut self, name: &str) {
        self.used.insert(name.to_ascii_uppercase());
    }

    /// Returns `stem_1`, `stem_2` or the first one of these that is not used.
    pub fn unused(&mut self, stem: &str) -> String {
        let found =
            (1..).map(|n: u32| format!("{stem}_{n}")).find(|name| !self.used.contains(&name.to_ascii_uppercase()));
        let name = found.unwrap_or_default();
        self.reserve(&name);
        name
    }

    /// Declares a new variable with this name, or with a number behind it if it is used, and returns it.
    pub fn declare_as(&mut self, name: &str, iec_type: IecType, pos: Pos) -> IlName {
        if self.used.contains(&name.to_ascii_uppercase()) {
            return self.declare(name, iec_type, pos);
        }
        self.reserve(name);
        self.add(name.to_owned(), iec_type, pos)
    }

    /// Declares a new variable and returns its name.
    pub fn declare(&mut self, stem: &str, iec_type: IecType, pos: Pos) -> IlName {
        let name = self.unused(stem);
        self.add(name, iec_type, pos)
    }

    fn add(&mut self, text: String, iec_type: IecType, pos: Pos) -> IlName {
        let name = IlName { text, pos };
        self.variables.push(IlVariable {
            name: name.clone(),
            section: IlSection::Local,
            qualifier: None,
            iec_type,
            address: None,
            initial: None,
            comment: None,
        });
        name
    }
}
