//! Expressions: parsing and evaluation.

use super::error::CodError;
use super::value::{CodOperator, CodValue};

/// An expression.
#[derive(Debug, Clone, PartialEq)]
pub enum CodExpression {
    /// A number, a truth value or a text.
    Value(CodValue),
    /// A name.
    Name(String),
    /// `&name`: the address of the named object.
    Address(String),
    /// `*expression` or `reg(expression)`: the register at an address.
    At(Box<CodExpression>),
    /// `- ~ !` before an expression.
    Unary(char, Box<CodExpression>),
    /// An operator with two operands.
    Binary(CodOperator, Box<CodExpression>, Box<CodExpression>),
}

/// Maximum nesting of expressions.
const MAX_DEPTH: usize = 60;

/// Resolves names in expressions.
pub trait CodWorld {
    /// Returns the value of a name.
    ///
    /// # Errors
    /// The name is not defined, or it has no value.
    fn value(&self, name: &str) -> Result<CodValue, CodError>;
    /// Returns the address of a named object.
    ///
    /// # Errors
    /// The name is not defined, or it has no address.
    fn address(&self, name: &str) -> Result<i64, CodError>;
    /// Returns the value of the register at an address.
    ///
    /// # Errors
    /// There is no such register.
    fn at(&self, addr: i64) -> Result<CodValue, CodError>;
}

impl CodExpression {
    /// Returns the names in the expression, in order.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        match self {
            CodExpression::Value(_) | CodExpression::Address(_) => Vec::new(),
            CodExpression::Name(name) => vec![name],
            CodExpression::At(of) | CodExpression::Unary(_, of) => of.names(),
            CodExpression::Binary(_, a, b) => a.names().into_iter().chain(b.names()).collect(),
        }
    }

    /// Evaluates the expression.
    ///
    /// # Errors
    /// A name that is unknown, or an operation without a result.
    pub fn eval(&self, world: &dyn CodWorld) -> Result<CodValue, CodError> {
        match self {
            CodExpression::Value(value) => Ok(value.clone()),
            CodExpression::Name(name) => world.value(name),
            CodExpression::Address(name) => world.address(name).map(CodValue::Int),
            CodExpression::At(addr) => {
                world.at(addr.eval(world)?.to_integer().ok_or(CodError::TextIsNo { wanted: "address" })?)
            }
            CodExpression::Unary(op, of) => match (op, of.eval(world)?) {
                (_, CodValue::Text(_)) => Err(CodError::BadOperand { operator: *op, operand: "text" }),
                ('!', value) => Ok(CodValue::Bool(value.to_bool() != Some(true))),
                ('-', CodValue::Real(r)) => Ok(CodValue::Real(-r)),
                ('-', value) => Ok(CodValue::Int(value.to_integer().unwrap_or(0).wrapping_neg())),
                (_, CodValue::Real(_)) => Err(CodError::BadOperand { operator: *op, operand: "decimal" }),
                (_, value) => Ok(CodValue::Int(!value.to_integer().unwrap_or(0))),
            },
            CodExpression::Binary(op, a, b) => op.apply(&a.eval(world)?, &b.eval(world)?),
        }
    }
}

/// A text that is being parsed.
#[derive(Debug, Clone, Copy)]
pub struct CodTextReader<'t> {
    rest: &'t str,
    depth: usize,
}

impl<'t> CodTextReader<'t> {
    /// Returns a reader at the start of a text.
    #[must_use]
    pub fn new(text: &'t str) -> Self {
        CodTextReader { rest: text.trim(), depth: 0 }
    }

    /// Returns the text that has not been read.
    #[must_use]
    pub fn rest(&self) -> &'t str {
        self.rest
    }

    /// Skips `token` if it comes next; returns whether it did.
    pub fn take(&mut self, token: &str) -> bool {
        match self.rest.strip_prefix(token) {
            Some(rest) => {
                self.rest = rest.trim_start();
                true
            }
            None => false,
        }
    }

    /// Reads characters while `of` is true.
    pub fn take_while(&mut self, of: impl Fn(char) -> bool) -> &'t str {
        let end = self.rest.find(|c| !of(c)).unwrap_or(self.rest.len());
        let (found, rest) = self.rest.split_at(end);
        self.rest = rest.trim_start();
        found
    }

    /// Reads a name: letters, digits, underscores and dots, not beginning with a digit.
    pub fn name(&mut self) -> Option<&'t str> {
        let starts = self.rest.starts_with(|c: char| c.is_ascii_alphabetic() || matches!(c, '_' | '.'));
        starts.then(|| self.take_while(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '$')))
    }

    /// Reads a text between two quotes of one kind, up to the last such quote: a text may contain quotes.
    pub fn quoted(&mut self) -> Option<&'t str> {
        let mut rest = self.rest;
        rest = rest.strip_prefix('\\').unwrap_or(rest);
        let quote = rest.chars().next().filter(|c| matches!(c, '"' | '\''))?;
        let inner = rest.get(1..)?;
        let end = inner.rfind(quote)?;
        self.rest = inner.get(end + 1..)?.trim_start();
        inner.get(..end).map(|text| text.strip_suffix('\\').unwrap_or(text))
    }

    /// Reads an expression.
    ///
    /// # Errors
    /// The next text is not an expression.
    pub fn expr(&mut self) -> Result<CodExpression, CodError> {
        self.binding(1)
    }

    /// Reads an expression whose operators bind at least with strength `least`; operators of equal strength
    /// associate to the left.
    fn binding(&mut self, least: u8) -> Result<CodExpression, CodError> {
        let mut left = self.unary()?;
        loop {
            let found = CodOperator::ALL.iter().find(|(text, ..)| self.rest.starts_with(text));
            let Some(&(text, op, strength)) = found.filter(|(.., strength)| *strength >= least) else {
                return Ok(left);
            };
            self.take(text);
            let right = self.read_nested(|reader| reader.binding(strength + 1))?;
            left = CodExpression::Binary(op, Box::new(left), Box::new(right));
        }
    }

    fn read_nested<T>(&mut self, read: impl FnOnce(&mut Self) -> Result<T, CodError>) -> Result<T, CodError> {
        if self.depth >= MAX_DEPTH {
            return Err(CodError::NestedTooDeeply);
        }
        self.depth += 1;
        let found = read(self);
        self.depth -= 1;
        found
    }

    fn unary(&mut self) -> Result<CodExpression, CodError> {
        if let Some(text) = self.quoted() {
            return Ok(CodExpression::Value(CodValue::Text(text.to_owned())));
        }
        if let Some(number) = self.number()? {
            return Ok(CodExpression::Value(number));
        }
        for op in ['-', '~', '!'] {
            if self.take(op.encode_utf8(&mut [0; 4])) {
                return Ok(CodExpression::Unary(op, Box::new(self.read_nested(Self::unary)?)));
            }
        }
        if self.take("+") {
            return self.read_nested(Self::unary);
        }
        if self.take("*") {
            return Ok(CodExpression::At(Box::new(self.read_nested(Self::unary)?)));
        }
        if self.take("&") {
            return self
                .name()
                .map(|name| CodExpression::Address(name.to_owned()))
                .ok_or_else(|| self.wanted("a name"));
        }
        if self.take("(") {
            return self.closed();
        }
        match self.name() {
            Some("true") => Ok(CodExpression::Value(CodValue::Bool(true))),
            Some("false") => Ok(CodExpression::Value(CodValue::Bool(false))),
            Some("reg") if self.take("(") => Ok(CodExpression::At(Box::new(self.closed()?))),
            Some(name) => Ok(CodExpression::Name(name.to_owned())),
            None => Err(self.wanted("a number, a name or a text")),
        }
    }

    fn closed(&mut self) -> Result<CodExpression, CodError> {
        let inner = self.read_nested(Self::expr)?;
        if self.take(")") { Ok(inner) } else { Err(self.wanted("`)`")) }
    }

    fn wanted(&self, wanted: &'static str) -> CodError {
        CodError::Unexpected { found: self.rest.chars().take(20).collect(), wanted }
    }

    /// Reads `25 0x19 $19 0b11001 b'11001' d'25' 2.5 1e6`; `None` if no number begins here.
    fn number(&mut self) -> Result<Option<CodValue>, CodError> {
        let lower = self.rest.get(..2).unwrap_or(self.rest).to_ascii_lowercase();
        let radix = match lower.as_str() {
            "0x" => 16,
            "0b" | "b'" => 2,
            "d'" => 10,
            _ if lower.starts_with('$') => 16,
            _ if lower.starts_with(|c: char| c.is_ascii_digit()) => 0,
            _ if lower.starts_with('.') && lower.ends_with(|c: char| c.is_ascii_digit()) => 0,
            _ => return Ok(None),
        };
        if radix == 0 {
            return self.decimal().map(Some);
        }
        let skip = if lower.starts_with('$') { 1 } else { 2 };
        self.rest = self.rest.get(skip..).unwrap_or("");
        let digits = self.take_while(|c| c.is_ascii_alphanumeric());
        if lower.ends_with('\'') && !self.take("'") {
            return Err(self.wanted("`'`"));
        }
        let wrong = |_| CodError::BadNumber { digits: digits.to_owned(), radix: Some(radix) };
        i64::from_str_radix(digits, radix).map(|i| Some(CodValue::Int(i))).map_err(wrong)
    }

    fn decimal(&mut self) -> Result<CodValue, CodError> {
        let mut sign = false;
        // Within a number, a sign is only valid after the exponent mark.
        let end = self.rest.find(|c: char| {
            let part = c.is_ascii_digit() || c == '.' || matches!(c, 'e' | 'E') || (sign && matches!(c, '+' | '-'));
            sign = matches!(c, 'e' | 'E');
            !part
        });
        let (text, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.rest = rest.trim_start();
        let whole = text.bytes().all(|b| b.is_ascii_digit());
        let value = if whole { text.parse().ok().map(CodValue::Int) } else { text.parse().ok().map(CodValue::Real) };
        value.ok_or_else(|| CodError::BadNumber { digits: text.to_owned(), radix: None })
    }
}
