//! Names that directives define: `equ`, `set` and `=`, and their values in the listing.

use std::ops::Range;

use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::trim;
use crate::symbols::AsmSymbolKind;
use crate::value::AsmValue;

impl Assembler<'_> {
    /// Shows this value in the line of the listing.
    pub fn list_value(&mut self, value: AsmValue) {
        if let Some(last) = self.out.list.last_mut() {
            last.value = Some(value.number);
        }
    }

    /// Defines the name `label` of a directive.
    pub fn define_from_directive(&mut self, call: &DirectiveCall<'_>, kind: AsmSymbolKind) {
        let Some(label) = call.label.clone() else {
            let word = call.get(call.word.clone());
            let cause = format!("`{word}` needs a name before it");
            return self.report(LineFault::new("ASM023", call.word.clone(), cause, "write `name equ value`"));
        };
        let rest = trim(call.text, call.rest.clone());
        let name = call.get(label.clone());
        self.define_value(name, label, call.text, rest, kind);
    }

    /// Defines a name as the value of `text[rest]`, or as another name of a core register.
    pub fn define_value(&mut self, name: &str, at: Range<usize>, text: &str, rest: Range<usize>, kind: AsmSymbolKind) {
        let rest = trim(text, rest);
        let written = text.get(rest.clone()).unwrap_or_default();
        if self.dialect.zones && self.is_register(name) {
            return self.report(self.name_taken_fault(name, at, "given with equ, set or ="));
        }
        if self.symbols.get(written, self.dialect.ignores_case).is_none()
            && self.chip_names.get(written).is_none()
            && self.chip_register(written)
        {
            let again = kind == AsmSymbolKind::Set;
            return self.define_symbol(
                name,
                AsmValue::default(),
                AsmSymbolKind::Alias { of: written.into(), redefinable: again },
                at,
            );
        }
        let Some(value) = self.evaluate(text, rest) else { return };
        self.list_value(value);
        self.define_symbol(name, value, kind, at);
    }
}
