//! Values of names in expressions.

use std::ops::Range;

use crate::dialect::AsmArithmetic;
use crate::engine::Assembler;
use crate::expression::NameValues;
use crate::fault::LineFault;
use crate::symbols::AsmSymbolKind;
use crate::value::AsmValue;

impl NameValues for Assembler<'_> {
    fn value_of_name(&mut self, name: &str, at: Range<usize>) -> Result<AsmValue, LineFault> {
        if let Some((value, given)) = self.symbols.read_value(name, self.dialect.ignores_case, self.pass) {
            self.has_forward_reference |= !given || value.is_unknown;
            let alias = self
                .symbols
                .get(name, self.dialect.ignores_case)
                .is_some_and(|symbol| matches!(symbol.kind, AsmSymbolKind::Alias { .. }));
            return if alias { Err(register_fault(name, at)) } else { Ok(value) };
        }
        if let Some(value) = self.chip_names.get(name) {
            let name = self.folded_name(name).into_owned();
            self.chip_names_read.insert(name);
            let io = value.is_register
                && (0x20..0x60).contains(&value.number)
                && (self.dialect.hooks.names_io_addresses)(self);
            return Ok(if io { AsmValue::of(value.number - 0x20) } else { value });
        }
        if let Some(n) = (self.dialect.hooks.own_name_value)(self, name) {
            let name = self.folded_name(name).into_owned();
            self.chip_names_read.insert(name);
            return Ok(AsmValue::of(n));
        }
        if self.is_register(name) {
            return Err(register_fault(name, at));
        }
        let refused = |row: &&(&str, &str)| row.0.eq_ignore_ascii_case(name);
        if let Some((_, hint)) = self.dialect.hooks.refused_operators.iter().find(refused) {
            return Err(LineFault::new("ASM005", at, format!("the operator `{name}` is not taken"), *hint));
        }
        self.has_forward_reference = true;
        if self.pass > 1 && (self.dialect.hooks.is_external)(self, name) {
            let line = self.line.clone();
            self.externals.entry(name.to_owned()).or_insert((line, at));
            return Ok(AsmValue { is_label: true, ..AsmValue::default() });
        }
        if self.pass > 1 {
            let shown = name.split('\u{1}').next().unwrap_or(name);
            let fault = if self.externs.contains(shown) {
                let cause = format!("`{shown}` is extern: another module gives it, and one module is assembled here");
                LineFault::new(
                    "ASM049",
                    at,
                    cause,
                    "include the source that gives it, or take the module out of the program",
                )
            } else {
                let hint = "give it with equ, or as a label; names of registers and bits are those of the chip";
                LineFault::new("ASM006", at, format!("`{shown}` is not defined"), hint).with_similar_name(shown)
            };
            self.undefined.push(fault);
        }
        Ok(AsmValue { is_unknown: true, ..AsmValue::default() })
    }

    fn location_counter(&self, token: &str) -> i64 {
        let here = if self.dialect.counter_at_line_start && token != "." {
            self.line_address
        } else {
            self.out.next_address()
        };
        here + self.instruction_length
    }

    fn radix(&self) -> u32 {
        self.radix
    }

    fn arithmetic(&self) -> AsmArithmetic {
        self.dialect.arithmetic
    }

    fn local_label_name(&self, digits: &str, way: u8) -> String {
        let given = self.numbered.get(digits).copied().unwrap_or(0);
        match way {
            b'f' => format!("{digits}\u{1}{}", given + 1),
            b'b' => format!("{digits}\u{1}{given}"),
            _ => format!("{digits}$\u{1}{}", self.dollar_label_scope),
        }
    }
}

impl Assembler<'_> {
    /// Reports whether the word is a core register, or another word of the instruction syntax.
    pub fn is_register(&self, name: &str) -> bool {
        let lower = name.to_ascii_lowercase();
        self.table.words.binary_search(&lower).is_ok() || self.chip_register(name)
    }

    /// Reports whether only an operand kind knows the word. If case matters, the pointers of the syntax may
    /// be variable names.
    pub fn chip_register(&self, name: &str) -> bool {
        let pointer = !self.dialect.ignores_case && self.table.words.binary_search(&name.to_ascii_lowercase()).is_ok();
        !pointer && self.table.kinds.iter().any(|kind| (kind.parse_name)(name).is_some())
    }
}

fn register_fault(name: &str, at: Range<usize>) -> LineFault {
    let cause = format!("`{name}` is a register of the core and no number");
    LineFault::new("ASM008", at, cause, "give the names of your own program other names than registers have")
}
