//! The families of chips: the only place that lists them. All other code reads a chip's row or is generic
//! over its machine.

use emu_8051::Mcs51;
use emu_ap101::Ap101;
use emu_avr::Avr;
use emu_avr::chips::unit_index;
use emu_avr::periph;
use emu_core::chip::{Chip, ChipFamily};
use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::Image;
use emu_core::pins::PinId;
use emu_pic16::Pic16;

pub use crate::shared::chip_names::{ChipChoice, ChipChoiceParser, ChipParser, find_chip, parse_chip};

/// Returns all chips, family by family.
pub fn chips() -> impl Iterator<Item = &'static Chip> {
    let avr = emu_avr::chips::AVR_CHIPS.iter().copied();
    avr.chain(emu_8051::chips::chips()).chain(emu_pic16::chips::chips()).chain(emu_ap101::chips::chips())
}

/// Returns true if the chip has a serial port whose bytes can be shown or awaited.
pub fn has_uart(chip: &Chip) -> bool {
    chip.family != ChipFamily::Ap101 && emu_pic16::chips::part(chip.name).is_none_or(|part| part.usart)
}

/// Returns true if each address of a memory holds one bit instead of a byte.
pub fn is_of_bits(chip: &Chip, space: &str) -> bool {
    chip.family == ChipFamily::Ap101 && emu_ap101::chips::BIT_SPACES.contains(&space)
}

/// Returns the receive pin of the chip's first serial port.
pub fn receive_pin(chip: &Chip) -> Option<PinId> {
    match chip.family {
        ChipFamily::Avr => {
            let lines = emu_avr::chips::part(chip.name)?.peripheral_pins;
            lines.iter().find(|row| (row.0, row.1) == (unit_index::USART, periph::AvrLine::Rxd)).map(|row| row.2)
        }
        ChipFamily::Mcs51 => chip.pin("P3.0"),
        ChipFamily::Pic16 => {
            emu_pic16::chips::part(chip.name)?.line(emu_pic16::periph::map::Pic16Line::Rx).map(|line| line.pin)
        }
        ChipFamily::Ap101 => None,
    }
}

/// Finds the chip that a tool of the manufacturer calls `name`: 16F873, PIC16F873, P16LF873.
pub fn find_by_maker_name(name: &str) -> Option<&'static Chip> {
    let core = |name: &str| {
        let name = name.to_ascii_lowercase().replace("lf", "f");
        name.strip_prefix("pic").or_else(|| name.strip_prefix('p')).unwrap_or(&name).to_owned()
    };
    chips().find(|chip| core(chip.name) == core(name)).or_else(|| find_chip(name))
}

/// The options for building a machine of any family.
#[derive(Debug, Clone, Copy)]
pub struct MachineSetup {
    /// The contents of RAM after power-up.
    pub ram: RamInit,
    /// Show the signals of the external bus on the pins (8051).
    pub bus: bool,
    /// Options of the AVR family, including its oscillator.
    pub avr: emu_avr::Options,
    /// Options of the 8051 family.
    pub mcs51: emu_8051::Options,
    /// Options of the PIC16 family, including its oscillator.
    pub pic16: emu_pic16::Options,
    /// Options that override the configuration of an AP101.
    pub ap101: emu_ap101::Options,
}

impl MachineSetup {
    /// The default options of each family for a chip with this image, as `new` of its machine has them.
    pub fn new(chip: &'static Chip, image: &Image, ram: RamInit) -> MachineSetup {
        let start_up = image.bytes_in("fuse").next().is_some();
        MachineSetup {
            ram,
            bus: false,
            avr: emu_avr::Options { start_up, ..emu_avr::Options::at_hz(chip.default_hz) },
            mcs51: Default::default(),
            pic16: Default::default(),
            ap101: Default::default(),
        }
    }
}

/// A job that runs on a machine of any family.
pub trait MachineVisitor {
    /// The result of the job.
    type Output;
    /// Runs the job on a machine after power-up.
    fn visit<C: Cpu + 'static>(self, cpu: C) -> Self::Output;
}

/// Builds the machine of `chip` with `image` in its memories, and runs `job` on it.
pub fn visit_machine<J: MachineVisitor>(chip: &'static Chip, image: &Image, setup: &MachineSetup, job: J) -> J::Output {
    match chip.family {
        ChipFamily::Avr => job.visit(Avr::with(chip, image, setup.ram, setup.avr)),
        ChipFamily::Mcs51 => {
            let mut cpu = Mcs51::with(chip, image, setup.ram, setup.mcs51);
            cpu.set_bus_on_pins(setup.bus);
            job.visit(cpu)
        }
        ChipFamily::Pic16 => job.visit(Pic16::with(chip, image, setup.ram, setup.pic16)),
        ChipFamily::Ap101 => job.visit(Ap101::with(image, setup.ap101)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the pins against the pin tables of the data sheets.
    #[test]
    fn the_first_serial_port_receives_at_its_pin() {
        let pins = [
            ("atmega328p", "PD0"),
            ("atmega8", "PD0"),
            ("atmega16", "PD0"),
            ("atmega32", "PD0"),
            ("atmega64", "PE0"),
            ("atmega128", "PE0"),
            ("atmega162", "PD0"),
            ("atmega644", "PD0"),
            ("atmega1284p", "PD0"),
            ("8051", "P3.0"),
            ("at89c2051", "P3.0"),
            ("pic16f873", "RC7"),
            ("pic16f877a", "RC7"),
            ("pic16f628a", "RB1"),
            ("pic16f88", "RB2"),
            ("pic16f84a", "none"),
        ];
        for (name, wanted) in pins {
            let chip = parse_chip(name).expect("a chip");
            let pin = receive_pin(chip).and_then(|pin| chip.pins.get(usize::from(pin)));
            assert_eq!(pin.map_or("none", |pin| pin.name), wanted, "{name}");
        }
    }
}
