//! Checks of declarations: block types, addresses, initial values.

use super::super::codes;
use super::super::flow::{ResultType, size_of};
use super::super::types::{IecType, StandardBlock};
use super::IlChecker;

impl IlChecker<'_> {
    /// Checks types, initial values and addresses of the declarations.
    pub(super) fn check_declarations(&mut self) {
        let program = self.program;
        for variable in &program.variables {
            let (name, pos) = (&variable.name.text, variable.name.pos);
            if let IecType::Named(block) = &variable.iec_type {
                let known = StandardBlock::ALL.iter().map(|block| block.keyword());
                let other = "the blocks are TON, TOF, TP, TONA, TOFA, CTU, CTD, CTUD, R_TRIG, F_TRIG, SR and RS";
                let hint =
                    diag::nearest(block, known).map_or(other.to_owned(), |meant| format!("did you mean {meant}?"));
                self.error(codes::IL_FUNCTION, pos, format!("`{name}` has the unknown type {block}"), &hint);
            }
            if let Some(address) = &variable.address {
                let bits = address.size.map_or(size_of(&variable.iec_type), |size| size.bits());
                if variable.iec_type.is_block() || bits != size_of(&variable.iec_type) {
                    let cause = format!("the address of `{name}` does not fit {}", variable.iec_type.keyword());
                    let hint = "use X for BOOL, B for 8 bits, W for 16 bits, D for 32 bits, or no letter";
                    self.error(codes::IL_LOCATION, pos, cause, hint);
                }
            }
            if let Some(initial) = &variable.initial {
                let value = self.literal_type(initial, pos);
                self.expect(&ResultType::Of(variable.iec_type.clone()), &value, pos, "the initial value");
            }
        }
    }
}
