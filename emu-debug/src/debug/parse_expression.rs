//! Parses expressions.

use super::arithmetic;
use super::c_objects::ObjectExpr;
use emu_core::image::{AVR_DATA, DebugInfo};

use super::c_type_queries::{CTypeQueries as _, CTypeRef};
use super::c_types;
use super::error::DebugError;
use super::expression::{BinaryOperator, DebugExpression};
use super::expression_place::ExpressionPlace;
use super::scope::{FrameContext, NameScope};

/// Maximum nesting, so that no text can exhaust the stack.
const MAX_DEPTH: u32 = 100;

/// Maximum number of operators, for the same reason: a sequence of them is a tree as deep as it is long.
const MAX_OPERATORS: u32 = 1_000;

/// Operators with their binding strength; longer spellings come before their own prefixes.
#[rustfmt::skip]
const OPERATORS: &[(&str, BinaryOperator, u8)] = &[
    ("||", BinaryOperator::Or, 1), ("&&", BinaryOperator::And, 2),
    ("==", BinaryOperator::Eq, 6), ("!=", BinaryOperator::Ne, 6),
    ("<<", BinaryOperator::Shl, 8), (">>", BinaryOperator::Shr, 8), ("<=", BinaryOperator::Le, 7), (">=", BinaryOperator::Ge, 7),
    ("<", BinaryOperator::Lt, 7), (">", BinaryOperator::Gt, 7), ("|", BinaryOperator::BitOr, 3), ("^", BinaryOperator::BitXor, 4), ("&", BinaryOperator::BitAnd, 5),
    ("+", BinaryOperator::Add, 9), ("-", BinaryOperator::Sub, 9), ("*", BinaryOperator::Mul, 10), ("/", BinaryOperator::Div, 10), ("%", BinaryOperator::Rem, 10),
];

/// Parses an expression.
///
/// # Errors
/// The first fault in it.
pub(super) fn parse(scope: &NameScope, here: Option<&FrameContext>, text: &str) -> Result<DebugExpression, DebugError> {
    let mut parser = DebugExpressionParser { scope, here, text, rest: text.trim(), depth: 0, operators: 0, choices: 0 };
    let expr = parser.list()?;
    match parser.rest {
        "" => Ok(expr),
        rest => Err(DebugError::TrailingText { rest: rest.to_owned(), text: text.to_owned() }),
    }
}

/// Parses one expression from left to right.
pub(super) struct DebugExpressionParser<'a> {
    /// The names of the program.
    pub(super) scope: &'a NameScope,
    /// The location of the machine, for names that are defined only there.
    pub(super) here: Option<&'a FrameContext>,
    /// The whole expression, for messages.
    pub(super) text: &'a str,
    /// The part that is not parsed yet.
    pub(super) rest: &'a str,
    depth: u32,
    operators: u32,
    /// Number of `?` whose `:` has not been read yet.
    choices: u32,
}

/// The type in a cast.
#[derive(Debug, Clone, Copy)]
struct CastType<'a> {
    /// The frame in which the type is known.
    here: &'a FrameContext,
    /// The type.
    kind: CTypeRef,
}

impl<'a> DebugExpressionParser<'a> {
    fn take(&mut self, wanted: &str) -> bool {
        match self.rest.strip_prefix(wanted) {
            Some(rest) => {
                self.rest = rest.trim_start();
                true
            }
            None => false,
        }
    }

    /// Parses expressions with commas between them; the value is that of the last.
    fn list(&mut self) -> Result<DebugExpression, DebugError> {
        let mut last = self.choice()?;
        while self.take(",") {
            last = self.choice()?;
        }
        Ok(last)
    }

    /// Parses `a ? b : c`.
    fn choice(&mut self) -> Result<DebugExpression, DebugError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(DebugError::NestedTooDeeply);
        }
        let condition = self.binary(0)?;
        let found = if self.take("?") {
            self.choices += 1;
            let then = self.list()?;
            self.choices -= 1;
            self.expect(":")?;
            DebugExpression::Choice(Box::new([condition, then, self.choice()?]))
        } else {
            condition
        };
        self.depth -= 1;
        Ok(found)
    }

    /// The call stack at the location of the machine, if it is known.
    pub(super) fn calls(&self) -> Option<&'a super::call_stack::CallStack> {
        self.here.map(|here| &here.calls)
    }

    fn binary(&mut self, least: u8) -> Result<DebugExpression, DebugError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(DebugError::NestedTooDeeply);
        }
        let mut left = self.unary()?;
        while let Some(&(sign, operator, binds)) = OPERATORS.iter().find(|(sign, ..)| self.rest.starts_with(sign)) {
            if binds <= least {
                break;
            }
            self.operators += 1;
            if self.operators > MAX_OPERATORS {
                return Err(DebugError::TooManyOperators { most: MAX_OPERATORS });
            }
            self.take(sign);
            let right = self.binary(binds)?;
            left = combine(self.calls(), operator, left, right);
        }
        self.depth -= 1;
        Ok(left)
    }

    fn unary(&mut self) -> Result<DebugExpression, DebugError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(DebugError::NestedTooDeeply);
        }
        let sign = ['-', '!', '~', '+', '*', '&', '(', '{'].into_iter().find(|sign| self.rest.starts_with(*sign));
        let expr = match sign {
            Some('(') => match self.cast() {
                Some(CastType { here, kind }) => {
                    let value = self.unary()?;
                    if let Some(typed) = value.object().and_then(|object| object.with_declared_type(kind)) {
                        self.depth -= 1;
                        return Ok(DebugExpression::Object(Box::new(typed)));
                    }
                    // A pointer keeps its memory.
                    let memory = value.object().and_then(ObjectExpr::memory_of_target);
                    let kind = CTypeRef { memory: memory.filter(|_| kind.pointer_depth > 0), ..kind };
                    DebugExpression::Object(Box::new(ObjectExpr::value_of(here.calls.clone(), value, kind)))
                }
                None => {
                    self.take("(");
                    let inner = self.list()?;
                    self.expect(")")?;
                    self.postfix(inner)?
                }
            },
            Some('{') => {
                let wrong = DebugError::MissingSign { sign: "}", text: self.text.to_owned() };
                let (inner, rest) = self.rest[1..].split_once('}').ok_or(wrong)?;
                self.rest = rest.trim_start();
                let unknown = || DebugError::UnknownType { text: inner.trim().to_owned() };
                let here = self.here.ok_or_else(unknown)?;
                let kind = c_types::find_type(&here.calls.info, inner).ok_or_else(unknown)?;
                DebugExpression::Object(Box::new(ObjectExpr::at(here.calls.clone(), self.unary()?, kind)))
            }
            Some('*') => {
                self.take("*");
                match self.unary()? {
                    DebugExpression::Object(object) if object.element_type().is_some() => {
                        DebugExpression::Object(Box::new(object.element(DebugExpression::Number(0))?))
                    }
                    // In a C program it is an `int`, as in gdb.
                    DebugExpression::Number(address) if self.here.is_some() => self.int_at(address),
                    address => DebugExpression::At(self.scope.chip().ram_space, Box::new(address)),
                }
            }
            Some('&') => {
                self.take("&");
                self.address()?
            }
            Some('+') => {
                self.take("+");
                self.unary()?
            }
            Some(sign) => {
                self.rest = self.rest[1..].trim_start();
                arithmetic::unary(self.calls(), sign, self.unary()?)
            }
            None => {
                let atom = self.atom()?;
                self.postfix(atom)?
            }
        };
        self.depth -= 1;
        Ok(expr)
    }

    fn int_at(&self, address: i64) -> DebugExpression {
        let (address, calls) = (DebugExpression::Number(address), self.calls().cloned().unwrap_or_default());
        let int = CTypeRef::new(DebugInfo::builtin_type("int"));
        DebugExpression::Object(Box::new(ObjectExpr::at(calls, address, int)))
    }

    fn expect(&mut self, sign: &'static str) -> Result<(), DebugError> {
        if self.take(sign) { Ok(()) } else { Err(DebugError::MissingSign { sign, text: self.text.to_owned() }) }
    }

    /// Parses `(type)`; `None` if the parentheses contain anything else.
    fn cast(&mut self) -> Option<CastType<'a>> {
        let here = self.here?;
        let (inner, rest) = self.rest.strip_prefix('(')?.split_once(')')?;
        let kind = c_types::find_type(&here.calls.info, inner)?;
        self.rest = rest.trim_start();
        Some(CastType { here, kind })
    }

    /// Parses `&x`.
    fn address(&mut self) -> Result<DebugExpression, DebugError> {
        let width = |space: &str| i64::from(self.scope.chip().bytes_per_address(space).max(1));
        let nothing = DebugError::NoAddress { text: Some(self.rest.to_owned()) };
        match self.unary()? {
            DebugExpression::Object(object) => {
                object.address().map(|address| DebugExpression::Object(Box::new(address)))
            }
            DebugExpression::Place(ExpressionPlace::Memory { space, addr, .. }) => {
                Ok(DebugExpression::Number(i64::from(addr) / width(space)))
            }
            DebugExpression::At(_, addr) => Ok(*addr),
            // A function or label represents its address.
            DebugExpression::Number(number) => Ok(DebugExpression::Number(number)),
            _ => Err(nothing),
        }
    }

    /// Parses what may follow an object: `.member`, `->member`, `[index]`, and `.3` for a bit.
    fn postfix(&mut self, mut of: DebugExpression) -> Result<DebugExpression, DebugError> {
        loop {
            of = match of {
                DebugExpression::Object(object) if self.rest.starts_with('(') => {
                    let is_code = object.is_function() || object.is_function_pointer();
                    return Err(match is_code {
                        true => DebugError::Call,
                        false => DebugError::NotAFunction { text: self.text.to_owned() },
                    });
                }
                DebugExpression::Number(_) if self.rest.starts_with('(') => return Err(DebugError::Call),
                of if self.rest.starts_with('[') => {
                    self.take("[");
                    let index = self.list()?;
                    self.expect("]")?;
                    match (of, index, self.calls()) {
                        (DebugExpression::Text(text), DebugExpression::Number(index), Some(calls)) => {
                            text_element(calls, &text, index)?
                        }
                        (of, index, _) => index_into(of, index)?,
                    }
                }
                DebugExpression::Object(object) if self.rest.starts_with("->") || self.rest.starts_with('.') => {
                    let rest = self.rest.trim_start_matches("->").trim_start_matches('.');
                    if rest.starts_with(|c: char| c.is_ascii_digit()) {
                        return self.bit_suffix(DebugExpression::Object(object));
                    }
                    let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
                    self.rest = rest[end..].trim_start();
                    DebugExpression::Object(Box::new(object.member(&rest[..end])?))
                }
                of => return self.bit_suffix(of),
            };
        }
    }

    /// Parses `.3` after an object or after parentheses.
    fn bit_suffix(&mut self, of: DebugExpression) -> Result<DebugExpression, DebugError> {
        let Some(rest) = self.rest.strip_prefix('.') else { return Ok(of) };
        let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let bit = rest[..digits].parse().ok().filter(|bit| *bit < 64);
        self.rest = rest[digits..].trim_start();
        bit.map(|bit| DebugExpression::Bit(Box::new(of), bit))
            .ok_or_else(|| DebugError::MissingBitNumber { text: self.text.to_owned() })
    }

    /// Parses `sizeof x` and `sizeof (type)`.
    fn size(&mut self) -> Result<DebugExpression, DebugError> {
        if let Some(CastType { here, kind }) = self.cast() {
            let size = here.calls.info.size_of(kind).ok_or(DebugError::UnknownSize { what: "that type" })?;
            return Ok(DebugExpression::Number(size.into()));
        }
        let bytes = match self.unary()? {
            DebugExpression::Object(object) => object.bytes(),
            DebugExpression::Place(ExpressionPlace::Memory { bytes, .. }) => Some(bytes.into()),
            DebugExpression::Text(text) => u32::try_from(text.len() + 1).ok(),
            of => match (self.here, arithmetic::ArithmeticType::of(&of)) {
                (Some(here), Some(kind)) => here.calls.info.size_of(kind.ctype()),
                _ => None,
            },
        };
        bytes.map(|bytes| DebugExpression::Number(bytes.into())).ok_or(DebugError::NoSize)
    }

    /// Parses `::x`, a name outside of functions.
    fn global(&mut self, rest: &str) -> Result<DebugExpression, DebugError> {
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        let (name, _) = rest.split_at(end);
        self.rest = self.rest["::".len() + end..].trim_start();
        let found = self.here.and_then(|here| self.scope.find_global(here, name));
        match found {
            Some(found) => Ok(DebugExpression::Object(Box::new(found))),
            None => self.scope.find_name(name),
        }
    }

    /// Returns the end of a word that may contain the `:` of a choice: `a?1:2`.
    fn choice_end(&self, end: usize) -> usize {
        let word = &self.rest[..end];
        let single = word.match_indices(':').map(|(at, _)| at).find(|at| {
            let near = |at: Option<usize>| at.and_then(|at| word.as_bytes().get(at)) == Some(&b':');
            !near(at.checked_sub(1)) && !near(at.checked_add(1))
        });
        let is_space = |at: usize| self.scope.chip().spaces.iter().any(|space| space.name == &word[..at]);
        single.filter(|at| self.choices > 0 && !is_space(*at)).unwrap_or(end)
    }

    fn atom(&mut self) -> Result<DebugExpression, DebugError> {
        if self.rest.starts_with('"') {
            return self.text_literal();
        }
        if let Some(rest) = self.rest.strip_prefix("::").filter(|_| self.here.is_some()) {
            return self.global(rest);
        }
        if let Some(rest) = self.rest.strip_prefix('\'') {
            return self.quoted(rest);
        }
        let word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | ':' | '$' | '@' | '#');
        let end = self.rest.find(|c: char| !word(c)).unwrap_or(self.rest.len());
        let end = self.scope.mangled_name_length(self.rest).map_or(end, |name| name.max(end));
        let end = self.choice_end(end);
        let (name, rest) = self.rest.split_at(end);
        // What follows a C variable is a member of it, or a bit.
        let (head, _) = name.split_at(name.find('.').unwrap_or(name.len()));
        if let Some(object) = self.here.and_then(|here| self.scope.find_variable(here, head)) {
            self.rest = self.rest[head.len()..].trim_start();
            return Ok(DebugExpression::Object(Box::new(object)));
        }
        if let Some(value) = self.scope.values.named(head) {
            self.rest = self.rest[head.len()..].trim_start();
            return value;
        }
        self.rest = rest.trim_start();
        if name == "sizeof" {
            return self.size();
        }
        if let Some(here) = self.here
            && let Some(found) = self.scope.find_in_frame(here, name).or_else(|| self.scope.find_qualified(here, name))
        {
            return Ok(found);
        }
        if name.is_empty() {
            let found = self.rest.chars().next().map_or("nothing".to_owned(), |c| format!("`{c}`"));
            return Err(DebugError::MissingOperand { text: self.text.to_owned(), found });
        }
        if name.starts_with(|c: char| c.is_ascii_digit()) && !name.contains(':') {
            let hex = name.starts_with("0x") || name.starts_with("0X");
            if name.contains('.') || !hex && name.contains(['e', 'E']) {
                return self.real(name);
            }
            return self.whole(name);
        }
        if matches!(name, "struct" | "union" | "enum") {
            let end = self.rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(self.rest.len());
            return Err(DebugError::UnknownTag { keyword: name.to_owned(), name: self.rest[..end].to_owned() });
        }
        let plain = name.chars().all(|c| c.is_alphanumeric() || c == '_');
        match self.scope.find_name(name) {
            // The wording of gdb, for programs with information on their variables.
            Err(_) if self.here.is_some() && plain => Err(DebugError::UnknownSymbolHere { name: name.to_owned() }),
            found => found,
        }
    }
}

/// Combines two operands; a number that is added to a pointer counts elements.
fn combine(
    calls: Option<&super::call_stack::CallStack>,
    operator: BinaryOperator,
    left: DebugExpression,
    right: DebugExpression,
) -> DebugExpression {
    // An address in the form in which pointers are printed can be compared with a pointer.
    let linked = |of: DebugExpression, other: &DebugExpression| match of {
        DebugExpression::Number(value)
            if other.object().is_some_and(ObjectExpr::is_linked_pointer)
                && (AVR_DATA.into()..i64::from(AVR_DATA) + 0x1_0000).contains(&value) =>
        {
            DebugExpression::Number(value - i64::from(AVR_DATA))
        }
        of => of,
    };
    let left = linked(left, &right);
    let right = linked(right, &left);
    let pointer = |of: &DebugExpression| of.object().filter(|object| object.element_type().is_some()).cloned();
    let moved = match (operator, pointer(&left), pointer(&right)) {
        (BinaryOperator::Add | BinaryOperator::Sub, Some(pointer), None) => pointer.offset_by(operator, &right),
        (BinaryOperator::Add, None, Some(pointer)) => pointer.offset_by(operator, &left),
        (BinaryOperator::Sub, Some(of), Some(_)) => {
            let size = of.element_type().and_then(|kind| of.info().size_of(kind)).unwrap_or(1).max(1);
            let calls = of.calls.clone();
            let bytes = DebugExpression::Binary(operator, Box::new(left), Box::new(right));
            let size = DebugExpression::Number(size.into());
            let count = DebugExpression::Binary(BinaryOperator::Div, Box::new(bytes), Box::new(size));
            let kind = CTypeRef::new(DebugInfo::builtin_type("long"));
            return DebugExpression::Object(Box::new(ObjectExpr::value_of(calls, count, kind)));
        }
        _ => None,
    };
    match moved {
        Some(moved) => DebugExpression::Object(Box::new(moved)),
        None => arithmetic::binary(calls, operator, left, right),
    }
}

/// Returns a character of a text.
fn text_element(calls: &super::call_stack::CallStack, text: &[u8], index: i64) -> Result<DebugExpression, DebugError> {
    let at = usize::try_from(index).ok().filter(|at| *at <= text.len()).ok_or(DebugError::IndexTooLarge)?;
    let value = DebugExpression::Number(text.get(at).copied().unwrap_or(0).into());
    let kind = CTypeRef::new(DebugInfo::builtin_type("char"));
    Ok(DebugExpression::Object(Box::new(ObjectExpr::value_of(calls.clone(), value, kind))))
}

/// Returns an element; an element of memory without a type is a byte.
fn index_into(of: DebugExpression, index: DebugExpression) -> Result<DebugExpression, DebugError> {
    match (of, index) {
        (DebugExpression::Object(object), index) => Ok(DebugExpression::Object(Box::new(object.element(index)?))),
        (DebugExpression::Place(ExpressionPlace::Memory { space, addr, .. }), DebugExpression::Number(index)) => {
            let addr = i64::from(addr).checked_add(index).and_then(|addr| u32::try_from(addr).ok());
            let addr = addr.ok_or(DebugError::IndexTooLarge)?;
            Ok(DebugExpression::Place(ExpressionPlace::Memory { space, addr, bytes: 1, signed: false }))
        }
        (DebugExpression::Place(ExpressionPlace::Memory { space, addr, .. }), index) => Ok(DebugExpression::At(
            space,
            Box::new(DebugExpression::Binary(
                BinaryOperator::Add,
                Box::new(DebugExpression::Number(addr.into())),
                Box::new(index),
            )),
        )),
        _ => Err(DebugError::NoElements),
    }
}
