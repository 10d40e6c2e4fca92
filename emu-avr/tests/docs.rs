//! The pages of instructions and chips match the tables. `EMU_BLESS=1 cargo test -p plcemu-avr --test docs`
//! writes them again.

use emu_core::table::SyntaxAlias;
use std::fs;

use emu_avr::chips::{AVR_PARTS, AvrPart, unit_index};
use emu_avr::periph::AvrLine;
use emu_core::chip::PinDef;
use emu_core::pins::PinId;
use emu_test_support::assert_file;

#[test]
fn the_page_of_instructions_is_the_table() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/isa/avr.md");
    let mut page = String::from(
        "# Instructions of the AVR (ATmega328P)\n\nRead off the table in `emu-avr/src/isa.rs`. In the column of bits a letter is a bit \
         of that operand; several cycle counts\nare those of the outcomes: not taken, taken, taken over an instruction of two \
         words. Source: AVR Instruction Set Manual DS40002198.\n\n",
    );
    page.push_str(&emu_core::table::instruction_list_markdown(emu_avr::isa::ROWS));
    page.push_str("\nOther spellings that the assembler takes:\n\n| written | means |\n|---|---|\n");
    for SyntaxAlias { mnemonic: name, syntax, row_mnemonic: target, row_operands: text } in emu_avr::isa::ALIASES {
        page.push_str(&format!("| `{name} {syntax}` | `{target} {}` |\n", text.replace(',', ", ")));
    }
    assert_file(path, &page);
}

/// Returns the data sheet's name for a line of a unit.
fn line(part: &AvrPart, number: usize, line: AvrLine) -> String {
    let timer = number.wrapping_sub(unit_index::TIMER);
    let one = part.timers.get(timer).is_some_and(|shape| shape.channels == 1);
    let both = part.peripheral_pins.iter().any(|row| row.0 == unit_index::USART + 1);
    let usart = if both { (number - unit_index::USART.min(number)).to_string() } else { String::new() };
    match line {
        AvrLine::T => format!("T{timer}"),
        AvrLine::Icp => format!("ICP{timer}"),
        AvrLine::OcA if one => format!("OC{timer}"),
        AvrLine::OcA => format!("OC{timer}A"),
        AvrLine::OcB => format!("OC{timer}B"),
        AvrLine::OcC => format!("OC{timer}C"),
        AvrLine::Txd => format!("TXD{usart}"),
        AvrLine::Rxd => format!("RXD{usart}"),
        AvrLine::Xck => format!("XCK{usart}"),
        AvrLine::Int(n) => format!("INT{n}"),
        AvrLine::Pc(n) => format!("PCINT{n}"),
        AvrLine::Sck | AvrLine::Miso | AvrLine::Mosi | AvrLine::Ss | AvrLine::Scl | AvrLine::Sda => {
            format!("{line:?}").to_uppercase()
        }
    }
}

/// Returns the functions of a part's units on a pin.
fn uses(part: &AvrPart, pin: PinId) -> String {
    let lines = part.peripheral_pins.iter().filter(|row| row.2 == pin).map(|&(number, of, _)| line(part, number, of));
    let analog = part.analog_pins.iter().enumerate().filter(|row| *row.1 == pin).map(|(n, _)| format!("ADC{n}"));
    let compared = part.comparator_pins.iter().enumerate().filter(|row| *row.1 == pin).map(|(n, _)| format!("AIN{n}"));
    let changes = part.pin_changes.iter().filter(|row| row.0 == pin).map(|row| format!("PCINT{}", row.1));
    let reset = (part.reset_pin == pin).then(|| "RESET".to_owned());
    lines.chain(analog).chain(compared).chain(changes).chain(reset).collect::<Vec<_>>().join(" ")
}

fn timers(part: &AvrPart) -> String {
    let of = |(n, shape): (usize, &emu_avr::periph::timers::TimerShape)| {
        let (wide, crystal) = (if shape.wide { "w" } else { "" }, if shape.asynchronous { "x" } else { "" });
        format!("{n}:{}{wide}{crystal}", shape.channels)
    };
    part.timers.iter().enumerate().map(of).collect::<Vec<_>>().join(" ")
}

fn table_of_chips() -> String {
    let mut table = String::from(
        "\n| Chip | Flash | RAM from | RAM | EEPROM | Page | Timers | USARTs | SPI, TWI | ADC | INT | PCINT | Vectors | Signature | Fuses |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for part in AVR_PARTS {
        let chip = part.chip;
        let has = |number: usize| part.peripheral_pins.iter().any(|row| row.0 == number);
        let serial =
            [(unit_index::SPI, "SPI"), (unit_index::TWI, "TWI")].iter().filter(|row| has(row.0)).map(|row| row.1);
        let ints = part.peripheral_pins.iter().filter(|row| matches!(row.1, AvrLine::Int(_))).count();
        let fuse_bytes = chip.space("fuse").map_or(0, |space| space.size as usize);
        let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ");
        table += &format!(
            "| {} | {} | {:X}h | {} | {} | {} | {} | {} | {} | {} | {ints} | {} | {} | {} | {} |\n",
            chip.name,
            chip.flash_bytes,
            chip.ram_start,
            chip.ram_len,
            chip.eeprom_bytes,
            part.spm_kind.page,
            timers(part),
            (0..2).filter(|n| has(unit_index::USART + n)).count(),
            serial.collect::<Vec<_>>().join(" "),
            part.analog_pins.len(),
            part.pin_changes.len(),
            chip.vectors.len(),
            hex(&part.signature),
            hex(&part.fuses.default_bytes[..fuse_bytes]),
        );
    }
    table
}

/// Returns the number of a pin in the usual package, or the number with the name of the first other package
/// that has it.
fn number(part: &AvrPart, id: PinId, pin: &PinDef) -> String {
    let other = || part.chip.packages.iter().find_map(|of| Some(format!("{} of {}", of.pin_number(id)?, of.name)));
    if pin.dip != 0 { pin.dip.to_string() } else { other().unwrap_or_default() }
}

/// Returns the pins of each group of chips; chips with equal pins share one table.
fn table_of_pins() -> String {
    let mut kinds: Vec<(Vec<&str>, String)> = Vec::new();
    for part in AVR_PARTS.iter().filter(|part| part.chip.name != "atmega328p") {
        let mut table = String::from("| Pin | No. | Units | Pin | No. | Units |\n|---|---|---|---|---|---|\n");
        let there = |(id, pin): &(PinId, &PinDef)| part.ports[usize::from(*id / 8)] >> (id % 8) & 1 == 1 || pin.dip > 0;
        let cells: Vec<String> = (0..)
            .zip(part.chip.pins)
            .filter(there)
            .map(|(id, pin)| format!("{} | {} | {} |", pin.name, number(part, id, pin), uses(part, id)))
            .collect();
        for pair in cells.chunks(2) {
            table += &format!("| {} {}\n", pair[0], pair.get(1).map_or("| | |", String::as_str));
        }
        match kinds.iter_mut().find(|kind| kind.1 == table) {
            Some(kind) => kind.0.push(part.chip.name),
            None => kinds.push((vec![part.chip.name], table)),
        }
    }
    kinds.iter().map(|(names, table)| format!("\n### {}\n\n{table}", names.join(", "))).collect()
}

#[test]
fn the_page_of_chips_is_what_the_rows_say() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/chips/avr.md");
    let page = fs::read_to_string(path).expect("the page");
    let mut wanted = page.clone();
    for (name, table) in [("chips", table_of_chips()), ("pins", table_of_pins())] {
        let (begin, end) =
            (format!("<!-- {name}: written by emu-avr/tests/docs.rs -->\n"), format!("<!-- end of {name} -->\n"));
        let (before, rest) = wanted.split_once(&begin).expect("the beginning of the table");
        let (_, after) = rest.split_once(&end).expect("the end of the table");
        wanted = format!("{before}{begin}{table}\n{end}{after}");
    }
    assert_file(path, &wanted);
}
