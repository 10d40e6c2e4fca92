//! Expressions in the notation of C and gdb, over locations of the machine.

use super::c_objects::ObjectExpr;
use super::dyn_machine::DynMachine;
use super::expression_place::ExpressionPlace;
use super::expression_value::ExpressionValue;
use emu_core::image::SpaceAddress;

/// An expression: numbers, locations, and the operators of C on 64-bit integers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DebugExpression {
    /// A number.
    Number(i64),
    /// A floating-point number, as the bits of its `f64`.
    Real(u64),
    /// The value of a location.
    Place(ExpressionPlace),
    /// The byte of data memory at a computed address.
    At(&'static str, Box<DebugExpression>),
    /// A C object.
    Object(Box<ObjectExpr>),
    /// One bit of a value.
    Bit(Box<DebugExpression>, u8),
    /// `-`, `!` or `~`.
    Unary(char, Box<DebugExpression>),
    /// Two operands.
    Binary(BinaryOperator, Box<DebugExpression>, Box<DebugExpression>),
    /// `a ? b : c`.
    Choice(Box<[DebugExpression; 3]>),
    /// The characters of a string literal, without the 0 at its end.
    Text(Vec<u8>),
}

/// An operator of two operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "they are those of C")]
#[rustfmt::skip]
pub enum BinaryOperator { Or, And, BitOr, BitXor, BitAnd, Eq, Ne, Le, Ge, Lt, Gt, Shl, Shr, Add, Sub, Mul, Div, Rem }

impl DebugExpression {
    /// Returns the current value as an integer; floating-point values lose their fraction. `None` if a part
    /// has no value: a floating pin, missing memory, a division by 0.
    #[must_use]
    pub fn value(&self, machine: &dyn DynMachine) -> Option<i64> {
        self.evaluate(machine).map(ExpressionValue::to_integer)
    }

    /// Returns the current value; `None` as for [`DebugExpression::value`].
    #[must_use]
    pub fn evaluate(&self, machine: &dyn DynMachine) -> Option<ExpressionValue> {
        let truth = |of: &DebugExpression| Some(of.evaluate(machine)?.is_true());
        Some(match self {
            DebugExpression::Number(number) => ExpressionValue::Whole(*number),
            DebugExpression::Real(bits) => ExpressionValue::Real(f64::from_bits(*bits), 0),
            DebugExpression::Place(place) => ExpressionValue::Whole(place.value(machine)?),
            DebugExpression::At(space, addr) => {
                let SpaceAddress { space, addr } = address_in(machine, space, addr)?;
                ExpressionValue::Whole(machine.peek(space, addr)?.into())
            }
            DebugExpression::Object(object) => object.amount(machine)?,
            DebugExpression::Bit(of, bit) => match of.evaluate(machine)? {
                ExpressionValue::Whole(value) => ExpressionValue::Whole(value >> bit & 1),
                ExpressionValue::Real(..) => return None,
            },
            DebugExpression::Unary(sign, of) => of.evaluate(machine)?.apply_unary(*sign)?,
            // Operands without influence on the result are not evaluated.
            DebugExpression::Binary(BinaryOperator::And, a, b) => {
                ExpressionValue::Whole(i64::from(truth(a)? && truth(b)?))
            }
            DebugExpression::Binary(BinaryOperator::Or, a, b) => {
                ExpressionValue::Whole(i64::from(truth(a)? || truth(b)?))
            }
            DebugExpression::Binary(operator, a, b) => {
                a.evaluate(machine)?.apply_binary(*operator, b.evaluate(machine)?)?
            }
            DebugExpression::Choice(parts) => {
                let [condition, then, otherwise] = &**parts;
                if truth(condition)? { then } else { otherwise }.evaluate(machine)?
            }
            DebugExpression::Text(_) => return None,
        })
    }

    /// Returns the value that a watchpoint compares: the bits of a C object, or the value of anything else.
    pub(super) fn watched_value(&self, machine: &dyn DynMachine) -> Option<i64> {
        match self {
            DebugExpression::Object(object) => object.number(machine),
            _ => self.value(machine),
        }
    }

    /// Returns the operands of an operator; a C object has none.
    pub(super) fn operands(&self) -> Vec<&DebugExpression> {
        match self {
            DebugExpression::At(_, of) | DebugExpression::Bit(of, _) | DebugExpression::Unary(_, of) => vec![of],
            DebugExpression::Binary(_, a, b) => vec![a, b],
            DebugExpression::Choice(parts) => parts.iter().collect(),
            DebugExpression::Number(_)
            | DebugExpression::Real(_)
            | DebugExpression::Text(_)
            | DebugExpression::Place(_)
            | DebugExpression::Object(_) => Vec::new(),
        }
    }

    /// Returns true if nothing can change its value.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        match self {
            DebugExpression::Place(_) | DebugExpression::At(..) => false,
            DebugExpression::Object(object) => object.is_constant(),
            _ => self.operands().into_iter().all(DebugExpression::is_constant),
        }
    }

    /// Returns true if only writes of the program can change its value: all locations in it are bytes of RAM.
    pub(super) fn depends_only_on_ram(&self, machine: &dyn DynMachine) -> bool {
        let kept = |space: &str, addr: u32, bytes: u32| {
            space == machine.chip().ram_space
                && (addr..addr + bytes).all(|addr| machine.canonical_ram_address(addr).is_some())
        };
        match self {
            DebugExpression::Place(ExpressionPlace::Memory { space, addr, bytes, .. }) => {
                kept(space, *addr, (*bytes).into())
            }
            DebugExpression::Place(ExpressionPlace::Bit { space, addr, .. }) => kept(space, *addr, 1),
            // The target of a pointer may be anything.
            DebugExpression::Place(_) | DebugExpression::At(..) | DebugExpression::Object(_) => false,
            _ => self.operands().into_iter().all(|of| of.depends_only_on_ram(machine)),
        }
    }

    /// Returns true if it contains a local variable of a call.
    #[must_use]
    pub fn is_local(&self) -> bool {
        match self {
            DebugExpression::Object(object) => object.is_local(),
            _ => self.operands().into_iter().any(DebugExpression::is_local),
        }
    }

    /// Returns true if its first local variable is that of another expression: the same variable of the same
    /// block, in whichever call.
    #[must_use]
    pub fn is_in_scope_of(&self, other: &DebugExpression) -> bool {
        self.first_local_scope() == other.first_local_scope()
    }

    /// Returns the code in which its first local variable is in scope.
    pub(super) fn first_local_scope(&self) -> Option<&[std::ops::Range<u32>]> {
        match self {
            DebugExpression::Object(object) => object.local_scope(),
            _ => self.operands().into_iter().find_map(DebugExpression::first_local_scope),
        }
    }

    /// Returns true if the compiler has optimized away something that it is computed from.
    #[must_use]
    pub fn is_optimized_out(&self, machine: &dyn DynMachine) -> bool {
        match self {
            DebugExpression::Object(object) => object.is_optimized_out(machine),
            _ => self.operands().into_iter().any(|of| of.is_optimized_out(machine)),
        }
    }

    /// Returns true if the variables in it are in scope at the location of the machine.
    #[must_use]
    pub fn is_known(&self, machine: &dyn DynMachine) -> bool {
        match self {
            DebugExpression::Object(object) => object.is_known(machine),
            _ => self.operands().into_iter().all(|of| of.is_known(machine)),
        }
    }

    /// Returns true if only time changes its value.
    #[must_use]
    pub fn depends_only_on_time(&self) -> bool {
        match self {
            DebugExpression::Place(place) => matches!(place, ExpressionPlace::Cycle | ExpressionPlace::Instructions),
            DebugExpression::Object(object) => object.depends_only_on_time(),
            _ => self.operands().into_iter().any(DebugExpression::depends_only_on_time),
        }
    }

    /// Calls `on_address` with the addresses of all bytes of memory in it.
    pub(super) fn visit_byte_addresses(&self, on_address: &mut dyn FnMut(u32)) {
        match self {
            DebugExpression::Place(ExpressionPlace::Memory { addr, bytes, .. }) => {
                (0..u32::from(*bytes)).for_each(|n| on_address(addr + n))
            }
            DebugExpression::Place(ExpressionPlace::Bit { addr, .. }) => on_address(*addr),
            DebugExpression::At(..) => {}
            _ => self.operands().into_iter().for_each(|of| of.visit_byte_addresses(on_address)),
        }
    }

    /// Returns its location, if it is a location and nothing else.
    #[must_use]
    pub fn place(&self, machine: &dyn DynMachine) -> Option<ExpressionPlace> {
        match self {
            DebugExpression::Place(place) => Some(*place),
            DebugExpression::At(space, addr) => {
                let SpaceAddress { space, addr } = address_in(machine, space, addr)?;
                Some(ExpressionPlace::Memory { space, addr, bytes: 1, signed: false })
            }
            DebugExpression::Object(object) => object.place(machine),
            DebugExpression::Bit(of, bit) => match of.place(machine)? {
                ExpressionPlace::Memory { space, addr, bytes, .. } if *bit < 8 * bytes => {
                    Some(ExpressionPlace::Bit { space, addr: addr + u32::from(bit / 8), bit: bit % 8 })
                }
                ExpressionPlace::Reg(name)
                    if super::expression_place::max_register_value(machine, name) >> bit & 1 == 1 =>
                {
                    Some(ExpressionPlace::RegBit { name, bit: *bit })
                }
                _ => None,
            },
            _ => None,
        }
    }
}

impl DebugExpression {
    /// Returns the expression with a C object replaced by its current location: a local variable of a call is
    /// watched where that call has it.
    #[must_use]
    pub fn bind_to_place(self, machine: &dyn DynMachine) -> DebugExpression {
        match self {
            DebugExpression::Object(object) => match object.place(machine) {
                Some(place) => DebugExpression::Place(place),
                None => DebugExpression::Object(Box::new(object.with_bound_value(machine))),
            },
            other => other.with_bound_operands(machine),
        }
    }

    /// Returns the expression with the variables of calls in it replaced by their current locations.
    pub(super) fn with_bound_operands(self, machine: &dyn DynMachine) -> DebugExpression {
        let bound = |of: Box<DebugExpression>| Box::new(of.with_bound_operands(machine));
        match self {
            DebugExpression::Object(object) if object.is_local() && !object.is_real() && object.is_scalar() => {
                DebugExpression::Object(object).bind_to_place(machine)
            }
            DebugExpression::At(space, of) => DebugExpression::At(space, bound(of)),
            DebugExpression::Bit(of, bit) => DebugExpression::Bit(bound(of), bit),
            DebugExpression::Unary(sign, of) => DebugExpression::Unary(sign, bound(of)),
            DebugExpression::Binary(operator, a, b) => DebugExpression::Binary(operator, bound(a), bound(b)),
            other => other,
        }
    }

    /// Returns its C object, if it is one.
    #[must_use]
    pub fn object(&self) -> Option<&ObjectExpr> {
        match self {
            DebugExpression::Object(object) => Some(object),
            _ => None,
        }
    }
}

/// Returns the memory and the address of a computed address; a data address of an ELF file of the AVR, such
/// as 0x800100, is accepted too.
fn address_in(machine: &dyn DynMachine, space: &'static str, addr: &DebugExpression) -> Option<SpaceAddress> {
    let addr = u32::try_from(addr.value(machine)?).ok()?;
    Some(super::call_stack::linked_memory_at(machine.chip(), addr).unwrap_or(SpaceAddress { space, addr }))
}

impl BinaryOperator {
    /// Returns true if the result is a truth value.
    pub(super) fn is_truth(self) -> bool {
        use BinaryOperator::{And, Eq, Ge, Gt, Le, Lt, Ne, Or};
        matches!(self, Or | And | Eq | Ne | Le | Ge | Lt | Gt)
    }

    /// Computes the value for two numbers; None if it is not defined, as for a division by 0.
    pub(super) fn apply(self, a: i64, b: i64) -> Option<i64> {
        let shift = u32::try_from(b).ok().filter(|shift| *shift < 64);
        Some(match self {
            BinaryOperator::Or => i64::from(a != 0 || b != 0),
            BinaryOperator::And => i64::from(a != 0 && b != 0),
            BinaryOperator::BitOr => a | b,
            BinaryOperator::BitXor => a ^ b,
            BinaryOperator::BitAnd => a & b,
            BinaryOperator::Eq => i64::from(a == b),
            BinaryOperator::Ne => i64::from(a != b),
            BinaryOperator::Le => i64::from(a <= b),
            BinaryOperator::Ge => i64::from(a >= b),
            BinaryOperator::Lt => i64::from(a < b),
            BinaryOperator::Gt => i64::from(a > b),
            BinaryOperator::Shl => a.wrapping_shl(shift?),
            BinaryOperator::Shr => a >> shift?,
            BinaryOperator::Add => a.wrapping_add(b),
            BinaryOperator::Sub => a.wrapping_sub(b),
            BinaryOperator::Mul => a.wrapping_mul(b),
            BinaryOperator::Div => a.checked_div(b)?,
            BinaryOperator::Rem => a.checked_rem(b)?,
        })
    }
}
