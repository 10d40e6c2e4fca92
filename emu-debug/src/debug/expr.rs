//! Expressions as C and gdb write them, over places of the machine.

use super::place::Place;
use super::scope::Scope;
use super::target::Target;
use crate::text::unescape;

/// Deepest nesting, so that no text can exhaust the stack.
const DEEPEST: u32 = 100;

/// Most operators, for the same reason: a row of them is a tree as deep as it is long.
const MOST: u32 = 1_000;

/// An expression: numbers, places, and the operators of C on 64-bit integers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Expr {
    /// A number.
    Number(i64),
    /// The value of a place.
    Place(Place),
    /// The byte of data memory at an address that is computed.
    At(&'static str, Box<Expr>),
    /// One bit of a value.
    Bit(Box<Expr>, u8),
    /// `-`, `!` or `~`.
    Unary(char, Box<Expr>),
    /// Two operands.
    Binary(Operator, Box<Expr>, Box<Expr>),
}

/// An operator of two operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "they are those of C")]
#[rustfmt::skip]
pub enum Operator { Or, And, BitOr, BitXor, BitAnd, Eq, Ne, Le, Ge, Lt, Gt, Shl, Shr, Add, Sub, Mul, Div, Rem }

/// Operators by how tightly they bind; longer spellings before those that they begin with.
#[rustfmt::skip]
const OPERATORS: &[(&str, Operator, u8)] = &[
    ("||", Operator::Or, 1), ("&&", Operator::And, 2),
    ("==", Operator::Eq, 6), ("!=", Operator::Ne, 6),
    ("<<", Operator::Shl, 8), (">>", Operator::Shr, 8), ("<=", Operator::Le, 7), (">=", Operator::Ge, 7),
    ("<", Operator::Lt, 7), (">", Operator::Gt, 7), ("|", Operator::BitOr, 3), ("^", Operator::BitXor, 4), ("&", Operator::BitAnd, 5),
    ("+", Operator::Add, 9), ("-", Operator::Sub, 9), ("*", Operator::Mul, 10), ("/", Operator::Div, 10), ("%", Operator::Rem, 10),
];

impl Expr {
    /// The value now. Nothing where something in it has none: a pin that floats, memory that is not there, a division by 0.
    #[must_use]
    pub fn value(&self, target: &dyn Target) -> Option<i64> {
        Some(match self {
            Expr::Number(number) => *number,
            Expr::Place(place) => place.value(target)?,
            Expr::At(space, addr) => target.peek(space, u32::try_from(addr.value(target)?).ok()?)?.into(),
            Expr::Bit(of, bit) => of.value(target)? >> bit & 1,
            Expr::Unary(sign, of) => {
                let value = of.value(target)?;
                match sign {
                    '-' => value.wrapping_neg(),
                    '!' => i64::from(value == 0),
                    _ => !value,
                }
            }
            // Nobody is asked for what makes no difference.
            Expr::Binary(Operator::And, a, b) => i64::from(a.value(target)? != 0 && b.value(target)? != 0),
            Expr::Binary(Operator::Or, a, b) => i64::from(a.value(target)? != 0 || b.value(target)? != 0),
            Expr::Binary(operator, a, b) => operator.of(a.value(target)?, b.value(target)?)?,
        })
    }

    /// Nothing but the program's writes can change its value: all places in it are bytes of RAM.
    pub(super) fn is_of_ram(&self, target: &dyn Target) -> bool {
        let kept = |space: &str, addr: u32, bytes: u32| {
            space == target.chip().ram && (addr..addr + bytes).all(|addr| target.ram_at(addr).is_some())
        };
        match self {
            Expr::Number(_) => true,
            Expr::Place(Place::Memory { space, addr, bytes, .. }) => kept(space, *addr, (*bytes).into()),
            Expr::Place(Place::Bit { space, addr, .. }) => kept(space, *addr, 1),
            // Where it points may be anything.
            Expr::Place(_) | Expr::At(..) => false,
            Expr::Bit(of, _) | Expr::Unary(_, of) => of.is_of_ram(target),
            Expr::Binary(_, a, b) => a.is_of_ram(target) && b.is_of_ram(target),
        }
    }

    /// Time alone changes its value.
    #[must_use]
    pub fn is_of_time(&self) -> bool {
        match self {
            Expr::Place(place) => matches!(place, Place::Cycle | Place::Instructions),
            Expr::Number(_) => false,
            Expr::At(_, of) | Expr::Bit(of, _) | Expr::Unary(_, of) => of.is_of_time(),
            Expr::Binary(_, a, b) => a.is_of_time() || b.is_of_time(),
        }
    }

    /// Tells the addresses of all bytes of memory in it.
    pub(super) fn bytes(&self, tell: &mut dyn FnMut(u32)) {
        match self {
            Expr::Place(Place::Memory { addr, bytes, .. }) => (0..u32::from(*bytes)).for_each(|n| tell(addr + n)),
            Expr::Place(Place::Bit { addr, .. }) => tell(*addr),
            Expr::Number(_) | Expr::Place(_) | Expr::At(..) => {}
            Expr::Bit(of, _) | Expr::Unary(_, of) => of.bytes(tell),
            Expr::Binary(_, a, b) => {
                a.bytes(tell);
                b.bytes(tell);
            }
        }
    }

    /// The place that it is, if it is one and nothing more.
    #[must_use]
    pub fn place(&self, target: &dyn Target) -> Option<Place> {
        match self {
            Expr::Place(place) => Some(*place),
            Expr::At(space, addr) => {
                let addr = u32::try_from(addr.value(target)?).ok()?;
                Some(Place::Memory { space, addr, bytes: 1, signed: false })
            }
            Expr::Bit(of, bit) => match of.place(target)? {
                Place::Memory { space, addr, bytes, .. } if *bit < 8 * bytes => {
                    Some(Place::Bit { space, addr: addr + u32::from(bit / 8), bit: bit % 8 })
                }
                Place::Reg(name) if super::place::register_max(target, name) >> bit & 1 == 1 => {
                    Some(Place::RegBit { name, bit: *bit })
                }
                _ => None,
            },
            _ => None,
        }
    }
}

impl Operator {
    fn of(self, a: i64, b: i64) -> Option<i64> {
        let shift = u32::try_from(b).ok().filter(|shift| *shift < 64);
        Some(match self {
            Operator::Or => i64::from(a != 0 || b != 0),
            Operator::And => i64::from(a != 0 && b != 0),
            Operator::BitOr => a | b,
            Operator::BitXor => a ^ b,
            Operator::BitAnd => a & b,
            Operator::Eq => i64::from(a == b),
            Operator::Ne => i64::from(a != b),
            Operator::Le => i64::from(a <= b),
            Operator::Ge => i64::from(a >= b),
            Operator::Lt => i64::from(a < b),
            Operator::Gt => i64::from(a > b),
            Operator::Shl => a.wrapping_shl(shift?),
            Operator::Shr => a >> shift?,
            Operator::Add => a.wrapping_add(b),
            Operator::Sub => a.wrapping_sub(b),
            Operator::Mul => a.wrapping_mul(b),
            Operator::Div => a.checked_div(b)?,
            Operator::Rem => a.checked_rem(b)?,
        })
    }
}

/// Reads an expression.
///
/// # Errors
/// What is wrong with it, in a sentence.
pub(super) fn parse(scope: &Scope, text: &str) -> Result<Expr, String> {
    let mut parser = Parser { scope, text, rest: text.trim(), depth: 0, operators: 0 };
    let expr = parser.binary(0)?;
    match parser.rest {
        "" => Ok(expr),
        rest => Err(format!("`{rest}` in `{text}` makes no sense there")),
    }
}

struct Parser<'a> {
    scope: &'a Scope,
    text: &'a str,
    rest: &'a str,
    depth: u32,
    operators: u32,
}

impl<'a> Parser<'a> {
    fn take(&mut self, wanted: &str) -> bool {
        match self.rest.strip_prefix(wanted) {
            Some(rest) => {
                self.rest = rest.trim_start();
                true
            }
            None => false,
        }
    }

    fn binary(&mut self, least: u8) -> Result<Expr, String> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err("the expression is nested too deeply".to_owned());
        }
        let mut left = self.unary()?;
        while let Some(&(sign, operator, binds)) = OPERATORS.iter().find(|(sign, ..)| self.rest.starts_with(sign)) {
            if binds <= least {
                break;
            }
            self.operators += 1;
            if self.operators > MOST {
                return Err(format!("the expression has more than {MOST} operators"));
            }
            self.take(sign);
            let right = self.binary(binds)?;
            left = Expr::Binary(operator, Box::new(left), Box::new(right));
        }
        self.depth -= 1;
        Ok(left)
    }

    fn unary(&mut self) -> Result<Expr, String> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err("the expression is nested too deeply".to_owned());
        }
        let expr = match ['-', '!', '~', '+', '*', '('].into_iter().find(|sign| self.rest.starts_with(*sign)) {
            Some('(') => {
                self.take("(");
                let inner = self.binary(0)?;
                if !self.take(")") {
                    return Err(format!("a ) is missing in `{}`", self.text));
                }
                self.bits(inner)?
            }
            Some('*') => {
                self.take("*");
                Expr::At(self.scope.chip().ram, Box::new(self.unary()?))
            }
            Some('+') => {
                self.take("+");
                self.unary()?
            }
            Some(sign) => {
                self.rest = self.rest[1..].trim_start();
                Expr::Unary(sign, Box::new(self.unary()?))
            }
            None => self.atom()?,
        };
        self.depth -= 1;
        Ok(expr)
    }

    /// `.3` behind something in parentheses.
    fn bits(&mut self, of: Expr) -> Result<Expr, String> {
        let Some(rest) = self.rest.strip_prefix('.') else { return Ok(of) };
        let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let bit = rest[..digits].parse().ok().filter(|bit| *bit < 64);
        self.rest = rest[digits..].trim_start();
        bit.map(|bit| Expr::Bit(Box::new(of), bit))
            .ok_or_else(|| format!("no bit is named behind the . in `{}`", self.text))
    }

    fn atom(&mut self) -> Result<Expr, String> {
        if let Some(rest) = self.rest.strip_prefix('\'') {
            // Behind a backslash a ' ends nothing, and neither does a backslash begin anything.
            let mut escaped = false;
            let end = rest.char_indices().find_map(|(at, c)| {
                let ends = c == '\'' && !escaped && at > 0;
                escaped = c == '\\' && !escaped;
                ends.then_some(at)
            });
            let end = end.ok_or_else(|| format!("a ' is missing in `{}`", self.text))?;
            let bytes = unescape(&rest[..end])?;
            self.rest = rest[end + 1..].trim_start();
            return match bytes.as_slice() {
                [byte] => Ok(Expr::Number((*byte).into())),
                _ => Err(format!("'{}' is not one byte", &rest[..end])),
            };
        }
        let word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | ':' | '$' | '@' | '#');
        let end = self.rest.find(|c: char| !word(c)).unwrap_or(self.rest.len());
        let end = self.scope.mangled_name(self.rest).map_or(end, |name| name.max(end));
        let (name, rest) = self.rest.split_at(end);
        self.rest = rest.trim_start();
        if name.is_empty() {
            let found = self.rest.chars().next().map_or("nothing".to_owned(), |c| format!("`{c}`"));
            return Err(format!("a number or a name is wanted in `{}`, not {found}", self.text));
        }
        if name.starts_with(|c: char| c.is_ascii_digit()) && !name.contains(':') {
            return number(name).map(Expr::Number);
        }
        self.scope.named(name)
    }
}

/// A number: decimal, 0x, 0b or 0o, with underscores.
fn number(text: &str) -> Result<i64, String> {
    let plain = text.replace('_', "").to_ascii_lowercase();
    let radix = [("0x", 16), ("0b", 2), ("0o", 8)];
    let found = radix.into_iter().find_map(|(prefix, radix)| Some((plain.strip_prefix(prefix)?, radix)));
    let (digits, radix) = found.unwrap_or((&plain, 10));
    let wrong = || format!("`{text}` is no number; write 418, 0x1a2 or 0b101");
    if digits.starts_with(['+', '-']) {
        return Err(wrong());
    }
    i64::from_str_radix(digits, radix).map_err(|_| wrong())
}
