//! Finds all elements of a program that cannot be compiled, before any code is generated.

use diag::{Diagnostic, Severity};
use emu_core::chip::ChipFamily;
use ladder::registers::{self, PortRegister, RegisterFamily, RegisterKind};
use ladder::{ChipPart, Element, LadderDialect, LadderOperand, LadderProgram, ProgramElement, SymbolKind};

use crate::codes;
use crate::lower;
use crate::target::CompileTarget;

/// Returns every reason why elements of `program` cannot be compiled for `target`, in text order.
///
/// The caller must drop those that repeat an error of `ladder::check` at the same position.
#[must_use]
pub fn unsupported_elements(program: &LadderProgram, target: Option<&CompileTarget>) -> Vec<Diagnostic> {
    let symbols = program.symbols();
    let is_bit = |name: &str| symbols.iter().find(|s| s.name == name).is_none_or(|s| s.kind.is_bit());
    let mut cells = lower::eeprom_cells(program).into_iter();
    let mut refusals = Vec::new();
    for ProgramElement { id, element, pos } in program.elements() {
        let facts = element.facts();
        let mut error = |code, cause: String, hint: &str| {
            refusals.push(Diagnostic::new(Severity::Error, code, &program.file, pos, format!("{id}: {cause}"), hint));
        };
        if let Some(target) = target {
            let last = if facts.part == Some(ChipPart::Eeprom) { cells.next() } else { None };
            let needed = last.map_or(0, |(addr, bytes)| u32::from(addr) + u32::from(bytes));
            let chip = target.chip.name;
            if let Some(part) = facts.part.filter(|part| !has_part(target, *part)) {
                let cause = format!("{}: {chip} has no {}", facts.keyword, part.text());
                error(codes::LACKS, cause, hint_without(part));
            } else if needed > u32::from(target.eeprom) {
                let cause = format!("PERSIST needs cells up to {needed} of the EEPROM, {chip} has {}", target.eeprom);
                error(codes::LACKS, cause, "keep fewer variables");
            }
        }
        for symbol in &facts.symbols {
            let Some(register) = PortRegister::from_name(&symbol.name) else { continue };
            if let Err((cause, hint)) = has_register(program, target, register) {
                error(codes::LACKS, format!("{}: {cause}", facts.keyword), hint);
            }
        }
        for symbol in facts.symbols.iter().filter(|symbol| symbol.kind.is_bit() != is_bit(&symbol.name)) {
            let cause = format!("`{}` is used as a bit and as a number", symbol.name);
            error(codes::MIXED_NAME, cause, "rename one of the two");
        }
        for constant in facts.constants {
            let (low, high) = match program.dialect {
                LadderDialect::Ldmicro23 => (i64::from(i16::MIN), i64::from(i16::MAX)),
                LadderDialect::Ldmicro5 | LadderDialect::Iec => (i64::from(i32::MIN), i64::from(i32::MAX)),
            };
            if !(low..=high).contains(&constant) {
                let cause = format!("the constant {constant} is not in {low}..{high}");
                error(codes::WIDE_CONSTANT, cause, "choose a smaller number");
            }
        }
        match element {
            Element::ReadAdc { refs: Some(refs @ 2..), .. } => {
                if let Some(target) = target.filter(|target| !has_reference(target, *refs)) {
                    let cause = format!("READ_ADC: {} has no reference {refs}", target.chip.name);
                    error(codes::LACKS, cause, "write 0 for the supply, or take an AVR that has this one (REFS)");
                }
            }
            Element::Placeholder => {
                error(codes::NOT_COMPILED, "PLACEHOLDER has no meaning".to_owned(), "put an element here");
            }
            Element::Coil { name, .. } | Element::Contacts { name, .. }
                if !ladder::symbols::kind_by_letter(name).is_bit() =>
            {
                error(codes::MIXED_NAME, format!("`{name}` is not a bit"), "bits begin with X, Y or R");
            }
            Element::Coil { name, .. } if ladder::symbols::kind_by_letter(name) == SymbolKind::Input => {
                error(codes::DRIVEN_INPUT, format!("the coil drives the input `{name}`"), "drive an output or a relay");
            }
            Element::Timer { delay, adjust, .. } if !can_count(program, delay, adjust.as_ref()) => {
                error(
                    codes::TIMER_RANGE,
                    format!(
                        "the scans of the delay are not a constant of at least 1 (cycle {} us)",
                        program.settings.cycle_us
                    ),
                    "choose a delay of at least two cycles",
                );
            }
            // The checks above that use the table of element facts cover the other elements.
            _ => {}
        }
    }
    refusals
}

/// True if the target has this part.
fn has_part(target: &CompileTarget, part: ChipPart) -> bool {
    match part {
        ChipPart::Transmitter | ChipPart::Receiver => target.uart.is_some(),
        ChipPart::Converter => !target.adc.is_empty(),
        ChipPart::Pwm => !target.pwm.is_empty(),
        ChipPart::Eeprom => target.eeprom > 0,
        ChipPart::I2c => target.i2c.is_some(),
        ChipPart::Spi => target.spi.is_some(),
    }
}

/// True if the converter of the target has an internal reference with this number.
fn has_reference(target: &CompileTarget, refs: u32) -> bool {
    let kind = emu_avr::chips::part(target.chip.name).map(|part| part.adc_kind);
    kind.is_some_and(|kind| refs == 3 || kind.low_reference_mv.is_some())
}

/// Why a program for `target` cannot have a register of a port; sources have none.
fn has_register(
    program: &LadderProgram,
    target: Option<&CompileTarget>,
    register: PortRegister,
) -> Result<(), (String, &'static str)> {
    let name = register.name();
    let Some(target) = target else {
        return Err((format!("{name} is a register of a chip, which a source does not have"), "compile for a chip"));
    };
    let chip = target.chip;
    let family = match chip.family {
        ChipFamily::Avr => Some(RegisterFamily::Avr),
        ChipFamily::Pic16 => Some(RegisterFamily::Pic16),
        _ => None,
    };
    let is_here = |pin: &&str| pin.chars().nth(1) == Some(register.port);
    if family.is_none() || !target.pins.iter().any(is_here) {
        return Err((format!("{} has no {name}", chip.name), "take a chip that has this port"));
    }
    let named = program.settings.micro.as_deref().and_then(registers::register_family);
    if register.kind == RegisterKind::Direction && named != family {
        let cause = format!("{name} has the opposite meaning on {}, which is of another family than MICRO=", chip.name);
        return Err((cause, "compile for a chip of the family that MICRO= names"));
    }
    Ok(())
}

/// Whether a timer can be compiled: its scans are a constant, or in ldmicro-5 a variable.
fn can_count(program: &LadderProgram, delay: &LadderOperand, adjust: Option<&LadderOperand>) -> bool {
    match delay {
        LadderOperand::Var(_) => program.dialect == LadderDialect::Ldmicro5,
        LadderOperand::Const { .. } => lower::timer_scans(program, delay, adjust).is_some(),
    }
}

/// What to do where a chip lacks a part.
fn hint_without(part: ChipPart) -> &'static str {
    match part {
        ChipPart::Converter => {
            "choose an AVR or a PIC16 with a converter, such as atmega328p or pic16f877, or read a comparator at an input X.."
        }
        ChipPart::Pwm => {
            "choose an AVR or a PIC16 with a PWM output, such as atmega328p or pic16f877, or make slow pulses at an output Y.. with TON and TOF"
        }
        ChipPart::Transmitter | ChipPart::Receiver => {
            "choose a chip with a serial line, such as at89s52, atmega328p or pic16f877, or pass single bits by X.. and Y.."
        }
        ChipPart::Eeprom => {
            "choose an AVR or a PIC16, such as atmega328p or pic16f877, or take PERSIST out: the value is then 0 at power-up"
        }
        ChipPart::I2c | ChipPart::Spi => {
            "choose a chip with I2C and SPI, such as atmega328p or pic16f877, or take the element out and pass single bits by X.. and Y.."
        }
    }
}
