//! Expressions as C and gdb write them, over places of the machine.

use super::amount::Amount;
use super::object::ObjectExpr;
use super::place::Place;
use super::target::Target;

/// An expression: numbers, places, and the operators of C on 64-bit integers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Expr {
    /// A number.
    Number(i64),
    /// A number with a point, by the bits of its `f64`.
    Real(u64),
    /// The value of a place.
    Place(Place),
    /// The byte of data memory at an address that is computed.
    At(&'static str, Box<Expr>),
    /// An object of C.
    Object(Box<ObjectExpr>),
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

impl Expr {
    /// The value now as a whole number: of one with a point what is before it. Nothing where something in it has none: a pin that
    /// floats, memory that is not there, a division by 0.
    #[must_use]
    pub fn value(&self, target: &dyn Target) -> Option<i64> {
        self.amount(target).map(Amount::whole)
    }

    /// The value now; nothing as for [`Expr::value`].
    #[must_use]
    pub fn amount(&self, target: &dyn Target) -> Option<Amount> {
        let truth = |of: &Expr| Some(of.amount(target)?.is_true());
        Some(match self {
            Expr::Number(number) => Amount::Whole(*number),
            Expr::Real(bits) => Amount::Real(f64::from_bits(*bits), 0),
            Expr::Place(place) => Amount::Whole(place.value(target)?),
            Expr::At(space, addr) => {
                Amount::Whole(target.peek(space, u32::try_from(addr.value(target)?).ok()?)?.into())
            }
            Expr::Object(object) => object.amount(target)?,
            Expr::Bit(of, bit) => match of.amount(target)? {
                Amount::Whole(value) => Amount::Whole(value >> bit & 1),
                Amount::Real(..) => return None,
            },
            Expr::Unary(sign, of) => of.amount(target)?.signed(*sign)?,
            // Nobody is asked for what makes no difference.
            Expr::Binary(Operator::And, a, b) => Amount::Whole(i64::from(truth(a)? && truth(b)?)),
            Expr::Binary(Operator::Or, a, b) => Amount::Whole(i64::from(truth(a)? || truth(b)?)),
            Expr::Binary(operator, a, b) => a.amount(target)?.with(*operator, b.amount(target)?)?,
        })
    }

    /// What a watchpoint compares: of an object of C its bits, of anything else its value.
    pub(super) fn seen(&self, target: &dyn Target) -> Option<i64> {
        match self {
            Expr::Object(object) => object.number(target),
            _ => self.value(target),
        }
    }

    /// Nothing can change its value.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        match self {
            Expr::Number(_) | Expr::Real(_) => true,
            Expr::Place(_) | Expr::At(..) => false,
            Expr::Object(object) => object.is_constant(),
            Expr::Bit(of, _) | Expr::Unary(_, of) => of.is_constant(),
            Expr::Binary(_, a, b) => a.is_constant() && b.is_constant(),
        }
    }

    /// Nothing but the program's writes can change its value: all places in it are bytes of RAM.
    pub(super) fn is_of_ram(&self, target: &dyn Target) -> bool {
        let kept = |space: &str, addr: u32, bytes: u32| {
            space == target.chip().ram && (addr..addr + bytes).all(|addr| target.ram_at(addr).is_some())
        };
        match self {
            Expr::Number(_) | Expr::Real(_) => true,
            Expr::Place(Place::Memory { space, addr, bytes, .. }) => kept(space, *addr, (*bytes).into()),
            Expr::Place(Place::Bit { space, addr, .. }) => kept(space, *addr, 1),
            // Where it points may be anything.
            Expr::Place(_) | Expr::At(..) | Expr::Object(_) => false,
            Expr::Bit(of, _) | Expr::Unary(_, of) => of.is_of_ram(target),
            Expr::Binary(_, a, b) => a.is_of_ram(target) && b.is_of_ram(target),
        }
    }

    /// Time alone changes its value.
    #[must_use]
    pub fn is_of_time(&self) -> bool {
        match self {
            Expr::Place(place) => matches!(place, Place::Cycle | Place::Instructions),
            Expr::Number(_) | Expr::Real(_) => false,
            Expr::Object(object) => object.is_of_time(),
            Expr::At(_, of) | Expr::Bit(of, _) | Expr::Unary(_, of) => of.is_of_time(),
            Expr::Binary(_, a, b) => a.is_of_time() || b.is_of_time(),
        }
    }

    /// Tells the addresses of all bytes of memory in it.
    pub(super) fn bytes(&self, tell: &mut dyn FnMut(u32)) {
        match self {
            Expr::Place(Place::Memory { addr, bytes, .. }) => (0..u32::from(*bytes)).for_each(|n| tell(addr + n)),
            Expr::Place(Place::Bit { addr, .. }) => tell(*addr),
            Expr::Number(_) | Expr::Real(_) | Expr::Place(_) | Expr::At(..) | Expr::Object(_) => {}
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
            Expr::Object(object) => object.place(target),
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

impl Expr {
    /// The same with the place that an object of C has now, which it keeps: a local variable of a call is watched where that call has
    /// it.
    #[must_use]
    pub fn in_its_place(self, target: &dyn Target) -> Expr {
        match &self {
            Expr::Object(object) => object.place(target).map_or(self, Expr::Place),
            _ => self,
        }
    }

    /// The object of C that it is.
    #[must_use]
    pub fn object(&self) -> Option<&ObjectExpr> {
        match self {
            Expr::Object(object) => Some(object),
            _ => None,
        }
    }
}

impl Operator {
    pub(super) fn of(self, a: i64, b: i64) -> Option<i64> {
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
