//! What names in expressions stand for.

use std::ops::Range;

use crate::dialect::Arithmetic;
use crate::engine::Asm;
use crate::expr::{Names, Value};
use crate::fault::Fault;
use crate::symbols::Kind;

impl Names for Asm<'_> {
    fn name(&mut self, name: &str, at: Range<usize>) -> Result<Value, Fault> {
        if let Some((value, given)) = self.symbols.read(name, self.d.any_case, self.pass) {
            self.forward |= !given || value.unknown;
            let alias =
                self.symbols.get(name, self.d.any_case).is_some_and(|symbol| matches!(symbol.kind, Kind::Alias { .. }));
            return if alias { Err(register(name, at)) } else { Ok(value) };
        }
        if let Some(value) = self.known.get(name) {
            let name = self.as_read(name).into_owned();
            self.chips.insert(name);
            return Ok(value);
        }
        if let Some(n) = (self.d.hooks.names)(&self.own, name) {
            let name = self.as_read(name).into_owned();
            self.chips.insert(name);
            return Ok(Value::of(n));
        }
        if self.is_register(name) {
            return Err(register(name, at));
        }
        self.forward = true;
        if self.pass > 1 && (self.d.hooks.external)(self, name) {
            let line = self.line.clone();
            self.externals.entry(name.to_owned()).or_insert((line, at));
            return Ok(Value { label: true, ..Value::default() });
        }
        if self.pass > 1 {
            let shown = name.split('\u{1}').next().unwrap_or(name);
            let fault = if self.externs.contains(shown) {
                let cause = format!("`{shown}` is extern: another module gives it, and one module is assembled here");
                Fault::new(
                    "ASM049",
                    at,
                    cause,
                    "include the source that gives it, or take the module out of the program",
                )
            } else {
                let hint = "give it with equ, or as a label; names of registers and bits are those of the chip";
                Fault::new("ASM006", at, format!("`{shown}` is not defined"), hint).near(shown)
            };
            self.undefined.push(fault);
        }
        Ok(Value { unknown: true, ..Value::default() })
    }

    fn here(&self, token: &str) -> i64 {
        let here = if self.d.here_is_line && token != "." { self.line_at } else { self.out.here() };
        here + self.behind
    }

    fn radix(&self) -> u32 {
        self.radix
    }

    fn arithmetic(&self) -> Arithmetic {
        if self.dotted && !self.d.hooks.is_sdas { Arithmetic::Signed } else { self.d.arithmetic }
    }

    fn local(&self, digits: &str, way: u8) -> String {
        let given = self.numbered.get(digits).copied().unwrap_or(0);
        match way {
            b'f' => format!("{digits}\u{1}{}", given + 1),
            b'b' => format!("{digits}\u{1}{given}"),
            _ => format!("{digits}$\u{1}{}", self.stretch),
        }
    }
}

impl Asm<'_> {
    /// The word is a register of the core, or another word of the instructions' syntax.
    pub fn is_register(&self, name: &str) -> bool {
        let lower = name.to_ascii_lowercase();
        self.table.words.binary_search(&lower).is_ok() || self.chip_register(name)
    }

    /// The word is one that only some kind of operand knows. Where case matters, the pointers of the syntax may be names of variables.
    pub fn chip_register(&self, name: &str) -> bool {
        let pointer = !self.d.any_case && self.table.words.binary_search(&name.to_ascii_lowercase()).is_ok();
        !pointer && self.table.kinds.iter().any(|kind| (kind.named)(name).is_some())
    }
}

fn register(name: &str, at: Range<usize>) -> Fault {
    let cause = format!("`{name}` is a register of the core and no number");
    Fault::new("ASM008", at, cause, "give the names of your own program other names than registers have")
}
