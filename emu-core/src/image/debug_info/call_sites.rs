//! Values of parameters at the time of a call: `DW_TAG_call_site` and its parameters, and GNU's before DWARF
//! 5 (DWARF 5, section 3.4).

use crate::image::debug_info::place::{FinishedEvaluation, LeadingRegister};
use std::collections::BTreeMap;

use gimli::Location as Piece;

use super::place::single_register;
use super::{DebugInfo, FrameView, FunctionInfo, VariableInfo};

/// A parameter that a call passes.
#[derive(Debug, Clone, PartialEq, Eq)]
struct CallParameter {
    /// The register of its first byte.
    register: u16,
    /// The register holds all of it.
    whole: bool,
    /// Its value, as an expression in the frame of the caller.
    value: Vec<u8>,
}

/// Calls with their parameters, by the byte address behind the call.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(in crate::image) struct CallSites(BTreeMap<u32, Vec<CallParameter>>);

impl CallSites {
    /// Adds a parameter; one that is passed in memory is left out.
    pub(super) fn add(&mut self, behind: u32, location: &[u8], value: Vec<u8>) {
        let Some(LeadingRegister { register, rest }) = single_register(location) else { return };
        self.0.entry(behind).or_default().push(CallParameter { register, whole: rest.is_empty(), value });
    }
}

impl DebugInfo {
    /// Returns the value that a register had when a function was called, from what the compiler says of the
    /// call. `behind` is the byte address behind the call, `caller` the frame that contains it.
    #[must_use]
    pub fn value_at_call(&self, behind: u32, register: u16, caller: &dyn FrameView) -> Option<u64> {
        self.call_value(behind, register, false, caller)
    }

    /// Returns the value of a parameter when its function was called, if all of it was in one register.
    #[must_use]
    pub fn parameter_at_call(
        &self,
        variable: &VariableInfo,
        function: &FunctionInfo,
        behind: u32,
        caller: &dyn FrameView,
    ) -> Option<u64> {
        let first = function.block.ranges.iter().map(|range| range.start).min()?;
        let LeadingRegister { register, rest } = single_register(variable.location.expression_at(first)?)?;
        self.call_value(behind, register, true, caller).filter(|_| rest.is_empty())
    }

    fn call_value(&self, behind: u32, register: u16, whole: bool, caller: &dyn FrameView) -> Option<u64> {
        let parameters = self.call_sites.0.get(&behind)?;
        let found = parameters.iter().find(|own| own.register == register && (own.whole || !whole))?;
        let function = self.function_at(caller.pc_byte())?;
        let FinishedEvaluation { evaluation, .. } =
            self.run_evaluation(self.units.get(function.unit)?, &found.value, Some(function), caller)?;
        match evaluation.result().first()?.location {
            Piece::Address { address } => Some(address),
            Piece::Value { value } => value.to_u64(u64::MAX).ok(),
            _ => None,
        }
    }
}
