//! Checks of the registers of ports: what the chip has, what may be written, and what a direction means.

use diag::Severity;

use crate::check::Checker;
use crate::codes;
use crate::model::{Element, LadderDialect, LadderOperand, ProgramElement};
use crate::registers::{self, PortRegister, RegisterFamily, RegisterKind, SharedPin};

/// Runs the checks of all elements that name a register.
pub(crate) fn check_registers(checker: &mut Checker<'_>) {
    let program = checker.program;
    let all = registers::port_registers(program);
    if all.is_empty() || program.dialect == LadderDialect::Ldmicro23 {
        return;
    }
    let (shared, micro) = (registers::shared_pins(program), program.settings.micro.as_deref());
    // What was said of a register is not repeated.
    let mut said = Vec::new();
    for ProgramElement { id, element, pos } in program.elements() {
        let at = ProgramElement { id, element, pos };
        let facts = element.facts();
        for symbol in &facts.symbols {
            let Some(register) = PortRegister::from_name(&symbol.name) else { continue };
            if let Some(micro) = micro.filter(|micro| !registers::has_port(micro, register.port)) {
                let cause = format!("{micro} has no port {}", register.port);
                checker.error(codes::REGISTER, at, cause, "name a port of the chip");
                continue;
            }
            if symbol.write.is_some() {
                check_write(checker, at, register, &mut said);
            }
            let has = |output: bool| shared.iter().any(|pin| pin.port == register.port && pin.output == output);
            let directed = all.contains(&PortRegister { kind: RegisterKind::Direction, ..register });
            if !said.contains(&register) {
                check_effect(checker, at, register, (has(false), has(true), directed));
                said.push(register);
            }
        }
        check_shared_coil(checker, at, &shared);
    }
}

/// A register of inputs is not written, and a direction must have a meaning.
fn check_write(checker: &mut Checker<'_>, at: ProgramElement<'_>, register: PortRegister, said: &mut [PortRegister]) {
    let name = register.name();
    if register.kind == RegisterKind::Level {
        let cause = format!("{name} is the levels of the pins, which the program cannot write");
        checker.error(codes::REGISTER, at, cause, format!("write #PORT{}", register.port));
    }
    if register.kind != RegisterKind::Direction {
        return;
    }
    let zero = matches!(at.element, Element::Move { src: LadderOperand::Const { value: 0, .. }, .. });
    match checker.program.settings.micro.as_deref().and_then(registers::register_family) {
        Some(RegisterFamily::Avr) if zero => {
            let cause = format!("0 in {name} makes inputs: it is DDR{} on AVR; on PIC it makes outputs", register.port);
            checker.warning(codes::DIRECTION, at, cause, "write 255 (-1) for outputs on AVR");
        }
        Some(RegisterFamily::Avr) if !said.contains(&register) => {
            let cause = format!("{name} is DDR{} on AVR, where 1 is an output; on PIC 0 is", register.port);
            checker.report(Severity::Note, codes::DIRECTION, at, &cause, "nothing to do if this is meant");
        }
        Some(RegisterFamily::Pic16) if !said.contains(&register) => {
            let cause = format!("0 in {name} is an output on PIC; on AVR, where it is DDR{}, 1 is", register.port);
            checker.report(Severity::Note, codes::DIRECTION, at, &cause, "nothing to do if this is meant");
        }
        _ => {}
    }
}

/// What a register does not reach: `inputs`, `outputs` say whether `IO LIST` has some on the port, `directed`
/// whether the program names its direction.
fn check_effect(
    checker: &mut Checker<'_>,
    at: ProgramElement<'_>,
    register: PortRegister,
    (inputs, outputs, directed): (bool, bool, bool),
) {
    let (name, port) = (register.name(), register.port);
    match register.kind {
        RegisterKind::Direction
            if checker.program.settings.micro.as_deref().and_then(registers::register_family).is_none() =>
        {
            let cause = format!("{name} has a meaning only with a chip: 0 is an output on PIC, 1 on AVR");
            checker.error(codes::REGISTER, at, cause, "name the chip with MICRO=");
        }
        RegisterKind::Latch if !outputs && !directed => {
            let cause = format!("no pin of port {port} is an output: neither IO LIST nor #TRIS{port} makes one");
            checker.warning(
                codes::REGISTER_EFFECT,
                at,
                cause,
                format!("write #TRIS{port}, or put a Y at the pins in IO LIST"),
            );
        }
        RegisterKind::Level if !inputs && !outputs && !directed => {
            let cause = format!("IO LIST has no pin of port {port}, and {name} reads the others as 0");
            checker.warning(codes::REGISTER_EFFECT, at, cause, "put an X at each pin in IO LIST that is to be read");
        }
        RegisterKind::Direction | RegisterKind::Latch | RegisterKind::Level => {}
    }
}

/// A coil cannot be an output at a pin that another symbol has: two symbols at one shared pin are refused.
fn check_shared_coil(checker: &mut Checker<'_>, at: ProgramElement<'_>, shared: &[SharedPin]) {
    let Element::Coil { name, .. } = at.element else { return };
    let program = checker.program;
    let own = |name: &str| program.io.iter().find(|entry| entry.name == name && entry.pin != 0).map(|entry| entry.pin);
    let Some(pin) = own(name) else { return };
    if let Some(other) = shared.iter().find(|other| other.name != *name && own(&other.name) == Some(pin)) {
        let cause = format!("{name} and {} have one pin, of which the program names the register", other.name);
        checker.error(codes::REGISTER, at, cause, "give each of them a pin of its own in IO LIST");
    }
}
