//! `.comm`: variables in RAM that avr-ld places after those of `.bss`.
//!
//! avr-ld takes them from its table of names, so their order is that of a hash of the name (`bfd_hash_hash`
//! of the GNU binutils). The addresses of a pass come from the names of the pass before it.

use std::collections::{BTreeMap, BTreeSet};

use super::super::common::{Alignment, align_to, required_arguments};
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::cut;

/// Number of rows of the linker's table of names.
const TABLE_ROWS: u64 = 4051;

/// The subsection of `.bss` in which avr-as places single variables, behind the others.
const LOCAL_PART: u16 = 1;

/// State of the AVR dialect during a pass.
#[derive(Debug, Default)]
pub(crate) struct AvrPassState {
    /// The common variables of this pass: name, size, alignment.
    commons: Vec<(String, i64, i64)>,
    /// Their places by the previous pass, counted from the first, and the end of the last.
    placed: (BTreeMap<String, i64>, i64),
    /// Names that the source declares as its own.
    locals: BTreeSet<String>,
}

impl AvrPassState {
    /// Returns the state for the next pass: places the variables.
    pub fn next(mut self) -> AvrPassState {
        self.commons.sort_by_key(|(name, ..)| row_of(name));
        let (mut places, mut end) = (BTreeMap::new(), 0i64);
        for (name, size, step) in self.commons {
            let at = end + (-end).rem_euclid(step);
            places.insert(name, at);
            end = at + size;
        }
        AvrPassState { placed: (places, end), ..AvrPassState::default() }
    }
}

/// Returns the row of a name in the linker's table.
fn row_of(name: &str) -> u64 {
    let add = |hash: u64, n: u64| {
        let sum = hash.wrapping_add(n).wrapping_add(n << 17);
        sum ^ sum >> 2
    };
    let hash = name.bytes().fold(0, |hash, byte| add(hash, byte.into()));
    add(hash, name.len() as u64) % TABLE_ROWS
}

/// `.local name`: a later `.comm` of the name reserves room in `.bss`, as for static variables of C.
pub(super) fn local(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let names = cut(asm.dialect, call.text, call.rest.clone()).into_iter().map(|part| call.get(part).to_owned());
    asm.family_state.avr.locals.extend(names);
}

/// `.comm name, size, alignment`: reserves RAM. Without an alignment, `.comm` aligns as avr-as does: to the
/// size, rounded up to a power of 2, up to 16. `.lcomm`, and `.comm` of a local name, do not align.
pub(super) fn common(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, place: &str) {
    let parts = required_arguments(asm, call);
    let [name, size, more @ ..] = parts.as_slice() else {
        let hint = "write `.comm buffer, 16`";
        return asm.report(LineFault::new("ASM023", call.rest.clone(), "a name and a size are wanted", hint));
    };
    let size = asm.evaluate_number(call.text, size.clone()).unwrap_or(0).clamp(0, 0x1_0000);
    let written = call.get(name.clone());
    let is_shared = place == "COMMON" && !asm.family_state.avr.locals.contains(written);
    let step = match more.first() {
        Some(given) => asm.evaluate_number(call.text, given.clone()).unwrap_or(1),
        None if is_shared => i64::from((size as u32).next_power_of_two().min(16)),
        None => 1,
    };
    if !(1..=0x1_0000).contains(&step) || !(step as u64).is_power_of_two() {
        let at = more.first().cloned().unwrap_or_else(|| call.rest.clone());
        return asm.report(LineFault::new("ASM003", at, format!("{step} is no alignment"), "give a number such as 2"));
    }
    // Another `.comm` of the same name is about the same variable.
    if is_shared && asm.family_state.avr.commons.iter().any(|(known, ..)| known == written) {
        return;
    }
    let now = (asm.out.current, asm.out.previous);
    let _ = asm.out.enter_named(if is_shared { place } else { "bss" });
    if !is_shared {
        let _ = asm.out.enter_part(LOCAL_PART);
    }
    let start = asm.out.initial_sections.get(asm.out.current).map_or(0, |first| first.pos);
    let end = asm.out.next_address();
    if is_shared {
        let state = &mut asm.family_state.avr;
        state.commons.push((written.to_owned(), size, step));
        if let Some(at) = state.placed.0.get(written) {
            asm.out.set_address(start + at);
        }
        // Only the next pass knows the order.
        asm.has_forward_reference |= asm.pass == 1;
    }
    align_to(asm, call, &Alignment { step, fill: 0, size: 1, most: None });
    asm.define_label(written, name.clone());
    let behind = asm.out.next_address() + size;
    asm.out.set_address(if is_shared { behind.max(end).max(start + asm.family_state.avr.placed.1) } else { behind });
    (asm.out.current, asm.out.previous) = now;
}
