//! Values that a session remembers: the value history, and user variables.

use std::collections::BTreeMap;

use super::dyn_machine::DynMachine;
use super::error::DebugError;
use super::expression::DebugExpression;

/// The value history, and the user's variables.
#[derive(Debug, Clone, Default)]
pub struct RememberedValues {
    /// `$1`, `$2`, ..; `None` for a sequence of objects, which is not a single value.
    history: Vec<Option<DebugExpression>>,
    variables: BTreeMap<String, DebugExpression>,
}

impl RememberedValues {
    /// Appends a value to the history; returns its number, from 1.
    pub fn push(&mut self, value: Option<DebugExpression>) -> usize {
        self.history.push(value);
        self.history.len()
    }

    /// Returns true if the history is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.history.is_empty()
    }

    /// Sets the user variable `$name`.
    pub fn set(&mut self, name: &str, value: DebugExpression) {
        self.variables.insert(name.to_owned(), value);
    }

    /// Returns `$`, `$$`, `$$2`, `$1` or `$i`; `None` for other names.
    ///
    /// # Errors
    /// The history has no such value.
    pub(super) fn named(&self, name: &str) -> Option<Result<DebugExpression, DebugError>> {
        let own = name.strip_prefix('$')?;
        let count = self.history.len();
        let number = match (own, own.strip_prefix('$')) {
            ("", _) => Some(count),
            (_, Some("")) => Some(count.saturating_sub(1)),
            (_, Some(back)) => Some(count.saturating_sub(back.parse().ok()?)),
            (own, None) => own.parse().ok(),
        };
        let Some(number) = number else { return self.variables.get(own).cloned().map(Ok) };
        let found = number.checked_sub(1).and_then(|at| self.history.get(at));
        Some(match found {
            Some(Some(value)) => Ok(value.clone()),
            Some(None) => Err(DebugError::RowInHistory { name: name.to_owned() }),
            None if count == 0 => Err(DebugError::EmptyHistory { name: name.to_owned() }),
            None => Err(DebugError::NotInHistory { name: name.to_owned(), count }),
        })
    }
}

impl DebugExpression {
    /// Returns the current value as a constant; `None` if it has none.
    #[must_use]
    pub fn kept(&self, machine: &dyn DynMachine) -> Option<DebugExpression> {
        match self {
            DebugExpression::Object(object) => Some(DebugExpression::Object(Box::new(object.kept(machine)))),
            other => Some(match other.evaluate(machine)? {
                super::ExpressionValue::Whole(value) => DebugExpression::Number(value),
                super::ExpressionValue::Real(value, _) => DebugExpression::Real(value.to_bits()),
            }),
        }
    }
}
