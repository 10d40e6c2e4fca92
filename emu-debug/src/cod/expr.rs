//! Expressions: their text read, and their value found.

use super::value::{Op, Value};

/// An expression.
#[derive(Debug, Clone, PartialEq)]
pub enum Expr {
    /// A number, a truth or a text.
    Value(Value),
    /// A name.
    Name(String),
    /// `&name`: the address of what the name stands for.
    Address(String),
    /// `*expression` or `reg(expression)`: the register at an address.
    At(Box<Expr>),
    /// `- ~ !` before an expression.
    Before(char, Box<Expr>),
    /// An operator between two.
    Between(Op, Box<Expr>, Box<Expr>),
}

/// How deep expressions may be nested.
const DEEPEST: usize = 60;

/// What names stand for.
pub trait World {
    /// The value of a name.
    ///
    /// # Errors
    /// Nothing has that name, or it has no value.
    fn value(&self, name: &str) -> Result<Value, String>;
    /// The address of what a name stands for.
    ///
    /// # Errors
    /// Nothing has that name, or it has no address.
    fn address(&self, name: &str) -> Result<i64, String>;
    /// The register at an address.
    ///
    /// # Errors
    /// There is none.
    fn at(&self, addr: i64) -> Result<Value, String>;
}

impl Expr {
    /// The names in it, in their order.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        match self {
            Expr::Value(_) | Expr::Address(_) => Vec::new(),
            Expr::Name(name) => vec![name],
            Expr::At(of) | Expr::Before(_, of) => of.names(),
            Expr::Between(_, a, b) => a.names().into_iter().chain(b.names()).collect(),
        }
    }

    /// The value.
    ///
    /// # Errors
    /// A name that is unknown, or an operation without a result.
    pub fn eval(&self, world: &dyn World) -> Result<Value, String> {
        match self {
            Expr::Value(value) => Ok(value.clone()),
            Expr::Name(name) => world.value(name),
            Expr::Address(name) => world.address(name).map(Value::Int),
            Expr::At(addr) => world.at(addr.eval(world)?.int().ok_or("a text is no address")?),
            Expr::Before(op, of) => match (op, of.eval(world)?) {
                (_, Value::Text(_)) => Err(format!("`{op}` before a text")),
                ('!', value) => Ok(Value::Bool(value.truth() != Some(true))),
                ('-', Value::Real(r)) => Ok(Value::Real(-r)),
                ('-', value) => Ok(Value::Int(value.int().unwrap_or(0).wrapping_neg())),
                (_, Value::Real(_)) => Err(format!("`{op}` before a decimal")),
                (_, value) => Ok(Value::Int(!value.int().unwrap_or(0))),
            },
            Expr::Between(op, a, b) => op.apply(&a.eval(world)?, &b.eval(world)?),
        }
    }
}

/// A text being read.
#[derive(Debug, Clone, Copy)]
pub struct Reader<'t> {
    rest: &'t str,
    depth: usize,
}

impl<'t> Reader<'t> {
    /// Reads from the beginning of a text.
    #[must_use]
    pub fn new(text: &'t str) -> Self {
        Reader { rest: text.trim(), depth: 0 }
    }

    /// What has not been read.
    #[must_use]
    pub fn rest(&self) -> &'t str {
        self.rest
    }

    /// Passes over `token` if it comes next.
    pub fn take(&mut self, token: &str) -> bool {
        match self.rest.strip_prefix(token) {
            Some(rest) => {
                self.rest = rest.trim_start();
                true
            }
            None => false,
        }
    }

    /// The next characters as far as they are of a kind.
    pub fn run_of(&mut self, of: impl Fn(char) -> bool) -> &'t str {
        let end = self.rest.find(|c| !of(c)).unwrap_or(self.rest.len());
        let (found, rest) = self.rest.split_at(end);
        self.rest = rest.trim_start();
        found
    }

    /// A name: letters, digits, underscores and points, no digit first.
    pub fn name(&mut self) -> Option<&'t str> {
        let starts = self.rest.starts_with(|c: char| c.is_ascii_alphabetic() || matches!(c, '_' | '.'));
        starts.then(|| self.run_of(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '$')))
    }

    /// A text between quotes of one kind, up to the last such quote: a text may hold quotes.
    pub fn quoted(&mut self) -> Option<&'t str> {
        let mut rest = self.rest;
        rest = rest.strip_prefix('\\').unwrap_or(rest);
        let quote = rest.chars().next().filter(|c| matches!(c, '"' | '\''))?;
        let inner = rest.get(1..)?;
        let end = inner.rfind(quote)?;
        self.rest = inner.get(end + 1..)?.trim_start();
        inner.get(..end).map(|text| text.strip_suffix('\\').unwrap_or(text))
    }

    /// An expression.
    ///
    /// # Errors
    /// What stands next is none.
    pub fn expr(&mut self) -> Result<Expr, String> {
        self.binding(1)
    }

    /// An expression of operators that bind at least so tightly; those of one strength group to the left.
    fn binding(&mut self, least: u8) -> Result<Expr, String> {
        let mut left = self.unary()?;
        loop {
            let found = Op::ALL.iter().find(|(text, ..)| self.rest.starts_with(text));
            let Some(&(text, op, strength)) = found.filter(|(.., strength)| *strength >= least) else {
                return Ok(left);
            };
            self.take(text);
            let right = self.deeper(|reader| reader.binding(strength + 1))?;
            left = Expr::Between(op, Box::new(left), Box::new(right));
        }
    }

    fn deeper<T>(&mut self, read: impl FnOnce(&mut Self) -> Result<T, String>) -> Result<T, String> {
        if self.depth >= DEEPEST {
            return Err("the expression is nested too deeply".to_owned());
        }
        self.depth += 1;
        let found = read(self);
        self.depth -= 1;
        found
    }

    fn unary(&mut self) -> Result<Expr, String> {
        if let Some(text) = self.quoted() {
            return Ok(Expr::Value(Value::Text(text.to_owned())));
        }
        if let Some(number) = self.number()? {
            return Ok(Expr::Value(number));
        }
        for op in ['-', '~', '!'] {
            if self.take(op.encode_utf8(&mut [0; 4])) {
                return Ok(Expr::Before(op, Box::new(self.deeper(Self::unary)?)));
            }
        }
        if self.take("+") {
            return self.deeper(Self::unary);
        }
        if self.take("*") {
            return Ok(Expr::At(Box::new(self.deeper(Self::unary)?)));
        }
        if self.take("&") {
            return self.name().map(|name| Expr::Address(name.to_owned())).ok_or_else(|| self.wanted("a name"));
        }
        if self.take("(") {
            return self.closed();
        }
        match self.name() {
            Some("true") => Ok(Expr::Value(Value::Bool(true))),
            Some("false") => Ok(Expr::Value(Value::Bool(false))),
            Some("reg") if self.take("(") => Ok(Expr::At(Box::new(self.closed()?))),
            Some(name) => Ok(Expr::Name(name.to_owned())),
            None => Err(self.wanted("a number, a name or a text")),
        }
    }

    fn closed(&mut self) -> Result<Expr, String> {
        let inner = self.deeper(Self::expr)?;
        if self.take(")") { Ok(inner) } else { Err(self.wanted("`)`")) }
    }

    fn wanted(&self, what: &str) -> String {
        let found: String = self.rest.chars().take(20).collect();
        if found.is_empty() {
            format!("the text ends, wanted {what}")
        } else {
            format!("found `{found}`, wanted {what}")
        }
    }

    /// `25 0x19 $19 0b11001 b'11001' d'25' 2.5 1e6`; nothing where no number begins.
    fn number(&mut self) -> Result<Option<Value>, String> {
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
        let digits = self.run_of(|c| c.is_ascii_alphanumeric());
        if lower.ends_with('\'') && !self.take("'") {
            return Err(self.wanted("`'`"));
        }
        let wrong = |_| format!("`{digits}` is no number to the base {radix}");
        i64::from_str_radix(digits, radix).map(|i| Some(Value::Int(i))).map_err(wrong)
    }

    fn decimal(&mut self) -> Result<Value, String> {
        let mut sign = false;
        // A sign belongs to a number only after its exponent mark.
        let end = self.rest.find(|c: char| {
            let part = c.is_ascii_digit() || c == '.' || matches!(c, 'e' | 'E') || (sign && matches!(c, '+' | '-'));
            sign = matches!(c, 'e' | 'E');
            !part
        });
        let (text, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.rest = rest.trim_start();
        let whole = text.bytes().all(|b| b.is_ascii_digit());
        let value = if whole { text.parse().ok().map(Value::Int) } else { text.parse().ok().map(Value::Real) };
        value.ok_or_else(|| format!("`{text}` is no number"))
    }
}
