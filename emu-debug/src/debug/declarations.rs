//! Declarations of a C program outside of functions: functions, variables and types, with their text as gdb
//! prints it.

use emu_core::image::{CType, DebugInfo, NumberedType, TypeDefinition};

use super::c_type_queries::CTypeRef;
use super::c_types::declaration;
use super::scope::NameScope;

/// A function, variable or type of the program.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Declaration {
    /// The source file; empty if unknown.
    pub file: String,
    /// Other compilation units cannot refer to it.
    pub is_static: bool,
    /// Its name; for a struct, union or enumeration, its tag.
    pub name: String,
    /// Line of the declaration, 0 if unknown.
    pub line: u32,
    /// Its text: `static int depth;`, `struct pump;`, `char`.
    pub text: String,
}

/// Kinds of declarations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeclarationKind {
    /// Functions that have code.
    Function,
    /// Variables outside of functions.
    Variable,
    /// Types that have a name.
    Type,
}

impl NameScope {
    /// Returns the declarations of the program, sorted by file and name, each once.
    #[must_use]
    pub fn declarations(&self, kind: DeclarationKind) -> Vec<Declaration> {
        let info = &self.calls().info;
        let mut found = match kind {
            DeclarationKind::Function => functions(info),
            DeclarationKind::Variable => self.variables_of_program(info),
            DeclarationKind::Type => types(info),
        };
        found.sort();
        found.dedup();
        found
    }

    fn variables_of_program(&self, info: &DebugInfo) -> Vec<Declaration> {
        // Start-up code also describes the registers of the chip.
        let is_own = |name: &str| self.chip().reg(name).is_none() || self.symbols.iter().any(|own| own.is_named(name));
        let own = info.globals.iter().filter(|own| is_own(&own.name));
        own.map(|own| {
            let text = declaration(info, CTypeRef::new(own.variable_type), &own.name);
            of(info.file_of_variable(own), &own.name, own.line, declared(text, own.external), !own.external)
        })
        .collect()
    }
}

fn of(file: &str, name: &str, line: u32, text: String, is_static: bool) -> Declaration {
    Declaration { file: file.to_owned(), is_static, name: name.to_owned(), line, text }
}

fn declared(text: String, external: bool) -> String {
    format!("{}{text};", if external { "" } else { "static " })
}

fn functions(info: &DebugInfo) -> Vec<Declaration> {
    let each = info.functions.iter().map(|own| {
        let text = declaration(info, CTypeRef::new(Some(own.of)), &own.name);
        of(info.file_of_function(own), &own.name, own.line, declared(text, own.external), !own.external)
    });
    each.collect()
}

fn types(info: &DebugInfo) -> Vec<Declaration> {
    let each = info.types().filter_map(|NumberedType { id, kind }| {
        let TypeDefinition { file, line } = info.definition_of(id);
        let text = match kind {
            CType::Base { .. } => declaration(info, CTypeRef::new(Some(id)), ""),
            CType::Named { of, name } => format!("typedef {} {name};", declaration(info, CTypeRef::new(*of), "")),
            CType::Record { keyword, name: Some(name), members, .. } if !members.is_empty() => {
                format!("{keyword} {name};")
            }
            CType::Enum { name: Some(name), .. } => format!("enum {name};"),
            _ => return None,
        };
        let name = match kind {
            CType::Named { name, .. }
            | CType::Record { name: Some(name), .. }
            | CType::Enum { name: Some(name), .. } => name,
            _ => &text,
        };
        Some(of(file, name, line, text.clone(), false))
    });
    each.collect()
}
