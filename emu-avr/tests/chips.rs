//! Compares the rows of the chips with tables typed from the data sheets, and tests behaviour that differs
//! between chips.

use std::collections::BTreeSet;

use emu_avr::chips::{ATMEGA328P, AVR_CHIPS, AVR_PARTS, AvrPart, RegisterSlot, chip, part, unit_index};
use emu_avr::soc::AvrSoc;
use emu_avr::{Avr, Options};
use emu_core::chip::{Chip, ChipPackage, PinDef};
use emu_core::cpu::{Bus, ResetCause};
use emu_core::image::{Image, Segment};
use emu_core::{Cpu, PinLevel, ProgramError, RamInit, StopReason};

/// Chip, document, KB of flash, page size in bytes, largest boot section in bytes, first RAM address, bytes
/// of RAM, bytes of EEPROM, ports, number of vectors, signature.
const SIZES: &str = "
    atmega48    | DS40002061 |   4 |  64 |    0 | 100 |  512 |  256 | BCD     | 26 | 1E9205
    atmega48a   | DS40002061 |   4 |  64 |    0 | 100 |  512 |  256 | BCD     | 26 | 1E9205
    atmega48p   | DS40002061 |   4 |  64 |    0 | 100 |  512 |  256 | BCD     | 26 | 1E920A
    atmega48pa  | DS40002061 |   4 |  64 |    0 | 100 |  512 |  256 | BCD     | 26 | 1E920A
    atmega88    | DS40002061 |   8 |  64 | 2048 | 100 | 1024 |  512 | BCD     | 26 | 1E930A
    atmega88a   | DS40002061 |   8 |  64 | 2048 | 100 | 1024 |  512 | BCD     | 26 | 1E930A
    atmega88p   | DS40002061 |   8 |  64 | 2048 | 100 | 1024 |  512 | BCD     | 26 | 1E930F
    atmega88pa  | DS40002061 |   8 |  64 | 2048 | 100 | 1024 |  512 | BCD     | 26 | 1E930F
    atmega168   | DS40002061 |  16 | 128 | 2048 | 100 | 1024 |  512 | BCD     | 26 | 1E9406
    atmega168a  | DS40002061 |  16 | 128 | 2048 | 100 | 1024 |  512 | BCD     | 26 | 1E9406
    atmega168p  | DS40002061 |  16 | 128 | 2048 | 100 | 1024 |  512 | BCD     | 26 | 1E940B
    atmega168pa | DS40002061 |  16 | 128 | 2048 | 100 | 1024 |  512 | BCD     | 26 | 1E940B
    atmega328   | DS40002061 |  32 | 128 | 4096 | 100 | 2048 | 1024 | BCD     | 26 | 1E9514
    atmega328p  | DS40002061 |  32 | 128 | 4096 | 100 | 2048 | 1024 | BCD     | 26 | 1E950F
    atmega8     | Atmel 2486 |   8 |  64 | 2048 |  60 | 1024 |  512 | BCD     | 19 | 1E9307
    atmega16    | Atmel 2466 |  16 | 128 | 2048 |  60 | 1024 |  512 | ABCD    | 21 | 1E9403
    atmega32    | Atmel 2503 |  32 | 128 | 4096 |  60 | 2048 | 1024 | ABCD    | 21 | 1E9502
    atmega64    | Atmel 2490 |  64 | 256 | 8192 | 100 | 4096 | 2048 | ABCDEFG | 35 | 1E9602
    atmega128   | Atmel 2467 | 128 | 256 | 8192 | 100 | 4096 | 4096 | ABCDEFG | 35 | 1E9702
    atmega162   | Atmel 2513 |  16 | 128 | 2048 | 100 | 1024 |  512 | ABCDE   | 28 | 1E9404
    atmega164p  | Atmel 8011 |  16 | 128 | 2048 | 100 | 1024 |  512 | ABCD    | 31 | 1E940A
    atmega164pa | Atmel 8272 |  16 | 128 | 2048 | 100 | 1024 |  512 | ABCD    | 31 | 1E940A
    atmega164a  | Atmel 8272 |  16 | 128 | 2048 | 100 | 1024 |  512 | ABCD    | 31 | 1E940F
    atmega324p  | Atmel 8011 |  32 | 128 | 4096 | 100 | 2048 | 1024 | ABCD    | 31 | 1E9508
    atmega324pa | Atmel 8272 |  32 | 128 | 4096 | 100 | 2048 | 1024 | ABCD    | 31 | 1E9511
    atmega324a  | Atmel 8272 |  32 | 128 | 4096 | 100 | 2048 | 1024 | ABCD    | 31 | 1E9515
    atmega644   | Atmel 2593 |  64 | 256 | 8192 | 100 | 4096 | 2048 | ABCD    | 28 | 1E9609
    atmega644p  | Atmel 8011 |  64 | 256 | 8192 | 100 | 4096 | 2048 | ABCD    | 31 | 1E960A
    atmega644pa | Atmel 8272 |  64 | 256 | 8192 | 100 | 4096 | 2048 | ABCD    | 31 | 1E960A
    atmega644a  | Atmel 8272 |  64 | 256 | 8192 | 100 | 4096 | 2048 | ABCD    | 31 | 1E9609
    atmega1284  | Atmel 8272 | 128 | 256 | 8192 | 100 | 16384 | 4096 | ABCD   | 35 | 1E9706
    atmega1284p | Atmel 8272 | 128 | 256 | 8192 | 100 | 16384 | 4096 | ABCD   | 35 | 1E9705
";

#[test]
fn sizes_are_those_of_the_data_sheets() {
    let mut named = BTreeSet::new();
    for line in SIZES.lines().filter(|line| !line.trim().is_empty()) {
        let part = part(line.split('|').next().unwrap_or_default().trim()).unwrap_or_else(|| panic!("{line}"));
        let c = part.chip;
        let boot = if part.spm_kind.boot { c.flash_bytes - part.spm_kind.nrww } else { 0 };
        let ports: BTreeSet<char> =
            c.pins.iter().filter(|pin| pin.name.starts_with('P')).filter_map(|pin| pin.name.chars().nth(1)).collect();
        let ports: String = ports.into_iter().collect();
        let signature: String = part.signature.iter().map(|byte| format!("{byte:02X}")).collect();
        let found = format!(
            "{} | {} | {} | {} | {boot} | {:x} | {} | {} | {ports} | {} | {signature}",
            c.name,
            c.data_sheet,
            c.flash_bytes / 1024,
            part.spm_kind.page,
            c.ram_start,
            c.ram_len,
            c.eeprom_bytes,
            c.vectors.len(),
        );
        let squeezed: Vec<&str> = line.split('|').map(str::trim).collect();
        assert_eq!(found, squeezed.join(" | "));
        named.insert(c.name);
    }
    assert_eq!(named, AVR_CHIPS.iter().map(|chip| chip.name).collect());
    assert_eq!(AVR_CHIPS.len(), AVR_PARTS.len());
}

/// Everything that a row refers to exists: pins, units, interrupts, addresses.
#[test]
fn rows_name_what_exists() {
    for part in AVR_PARTS {
        let name = part.chip.name;
        let exists = |pin: u16| part.ports.get(usize::from(pin / 8)).is_some_and(|bits| bits >> (pin % 8) & 1 == 1);
        assert!(
            part.peripheral_pins.iter().all(|&(number, _, pin)| number < unit_index::COUNT && exists(pin)),
            "{name}: lines"
        );
        assert!(part.pin_changes.iter().all(|&(pin, _)| exists(pin)), "{name}: pin changes");
        assert!(part.analog_pins.iter().chain(&part.comparator_pins).all(|&pin| exists(pin)), "{name}: analog pins");
        let reset = part.chip.pins.get(usize::from(part.reset_pin)).map_or("", |pin| pin.note);
        assert_eq!(reset, "RESET", "{name}");
        for (i, pin) in part.chip.pins.iter().enumerate() {
            assert_eq!(exists(i as u16), pin.name != "RESET" && pin.note != "absent", "{name}: {}", pin.name);
            assert_eq!(pin.name.starts_with("ADC"), pin.note == PinDef::ANALOG_INPUT_NOTE, "{name}: {}", pin.name);
            if pin.name == "RESET" || pin.note == PinDef::ANALOG_INPUT_NOTE {
                continue;
            }
            let letter = pin.name.chars().nth(1).unwrap_or_default() as usize;
            let first = if part.chip.pins[0].name == "PA0" { 'A' } else { 'B' } as usize;
            assert!(pin.name == format!("P{}{}", pin.name.chars().nth(1).unwrap_or('?'), i % 8));
            assert!(letter - first == i / 8, "{name}: {}", pin.name);
        }
        let dips: Vec<u8> = part.chip.pins.iter().map(|pin| pin.dip).filter(|&dip| dip != 0).collect();
        assert_eq!(dips.len(), dips.iter().collect::<BTreeSet<_>>().len(), "{name}: package pins");
        assert_eq!(part.interrupt_sources.len() + 1, part.chip.vectors.len(), "{name}: vectors");
        let once: BTreeSet<_> = part.interrupt_sources.iter().collect();
        assert_eq!(once.len(), part.interrupt_sources.len(), "{name}: a source asks for two vectors");
        assert!(
            part.interrupt_sources.iter().all(|&(number, irq)| number < unit_index::COUNT && irq < 8)
                && part.adc_triggers.iter().all(|on| on.unit < unit_index::COUNT && on.interrupt < 8),
            "{name}"
        );
    }
}

/// Packages with their own pin numbers: the pins of each in order of their numbers from 1 on; `-` is supply
/// or reference.
const PACKAGES: &str = "
    atmega328p DIP28  | PC6 PD0 PD1 PD2 PD3 PD4 - - PB6 PB7 PD5 PD6 PD7 PB0 PB1 PB2 PB3 PB4 PB5 - - - PC0 PC1 PC2 PC3 PC4 PC5
    atmega328p TQFP32 | PD3 PD4 - - - - PB6 PB7 PD5 PD6 PD7 PB0 PB1 PB2 PB3 PB4 PB5 - ADC6 - - ADC7 PC0 PC1 PC2 PC3 PC4 PC5 PC6 PD0 PD1 PD2
    atmega328p MLF32  | PD3 PD4 - - - - PB6 PB7 PD5 PD6 PD7 PB0 PB1 PB2 PB3 PB4 PB5 - ADC6 - - ADC7 PC0 PC1 PC2 PC3 PC4 PC5 PC6 PD0 PD1 PD2
    atmega328p MLF28  | PD3 PD4 - - PB6 PB7 PD5 PD6 PD7 PB0 PB1 PB2 PB3 PB4 PB5 - - - PC0 PC1 PC2 PC3 PC4 PC5 PC6 PD0 PD1 PD2
    atmega8    DIP28  | PC6 PD0 PD1 PD2 PD3 PD4 - - PB6 PB7 PD5 PD6 PD7 PB0 PB1 PB2 PB3 PB4 PB5 - - - PC0 PC1 PC2 PC3 PC4 PC5
    atmega8    TQFP32 | PD3 PD4 - - - - PB6 PB7 PD5 PD6 PD7 PB0 PB1 PB2 PB3 PB4 PB5 - ADC6 - - ADC7 PC0 PC1 PC2 PC3 PC4 PC5 PC6 PD0 PD1 PD2
    atmega8    MLF32  | PD3 PD4 - - - - PB6 PB7 PD5 PD6 PD7 PB0 PB1 PB2 PB3 PB4 PB5 - ADC6 - - ADC7 PC0 PC1 PC2 PC3 PC4 PC5 PC6 PD0 PD1 PD2
    atmega644  DIP40  | PB0 PB1 PB2 PB3 PB4 PB5 PB6 PB7 RESET - - - - PD0 PD1 PD2 PD3 PD4 PD5 PD6 PD7 PC0 PC1 PC2 PC3 PC4 PC5 PC6 PC7 - - - PA7 PA6 PA5 PA4 PA3 PA2 PA1 PA0
    atmega644  TQFP44 | PB5 PB6 PB7 RESET - - - - PD0 PD1 PD2 PD3 PD4 PD5 PD6 PD7 - - PC0 PC1 PC2 PC3 PC4 PC5 PC6 PC7 - - - PA7 PA6 PA5 PA4 PA3 PA2 PA1 PA0 - - PB0 PB1 PB2 PB3 PB4
";

#[test]
fn packages_have_the_pins_of_the_data_sheets() {
    let mut read = Vec::new();
    for line in PACKAGES.lines().filter(|line| !line.trim().is_empty()) {
        let (head, pins) = line.split_once('|').expect("two columns");
        let (name, package) = head.trim().split_once(' ').expect("a chip and a package");
        let chip = chip(name).expect("a chip");
        let found = chip.package(package.trim()).expect("a package");
        for (number, name) in (1..).zip(pins.split_whitespace()) {
            let at = (0..).zip(chip.pins).find(|&(pin, _)| found.pin_number(pin) == Some(number));
            assert_eq!(at.map_or("-", |(_, def)| def.name), name, "{head}: pin {number}");
        }
        read.push((chip.name, found.name));
    }
    for part in AVR_PARTS {
        let chip = part.chip;
        // Chips that differ only in other things share their packages.
        let pins = |packages: &[ChipPackage]| packages.iter().map(|of| (of.name, of.pins)).collect::<Vec<_>>();
        let same = |other: &Chip| pins(other.packages) == pins(chip.packages);
        let there = read.iter().any(|(name, _)| emu_avr::chips::chip(name).is_some_and(same));
        assert!(chip.packages.iter().all(|package| package.pins.len() == chip.pins.len()), "{}", chip.name);
        assert_eq!(chip.packages.len() == 1, !there, "{}", chip.name);
        // Every pin is in a package, and every channel of the converter has a pin.
        assert!((0..).zip(chip.pins).all(|(pin, def)| chip.has_pin(pin) || def.note == "absent"), "{}", chip.name);
        assert!(part.analog_pins.iter().all(|&pin| chip.has_pin(pin)), "{}", chip.name);
    }
}

fn options(chip: &Chip) -> Options {
    Options::at_hz(chip.default_hz)
}

/// Returns the chip around the core after power-on.
fn soc(chip: &'static Chip) -> AvrSoc {
    Avr::with(chip, &Image::default(), RamInit::Zero, options(chip)).soc().clone()
}

/// Chip, then steps, each with its cycle: `REG=` writes, `REG|` and `REG&` set and clear bits by SBI and CBI,
/// `REG?` peeks, `REG!` reads with side effects, `PIN?` is a level (H, L, Z).
const CASES: &str = "
# Bits in old places, and bits that are none.
    atmega8   | 0:TIMSK=FF 1:TIMSK?FD 1:TCCR1A=FF 2:TCCR1A?F3 2:MCUCR=FF 3:MCUCR?FF 3:SFIOR=FF 4:SFIOR?0C 4:TCCR2=F8 5:TCCR2?78
    atmega8   | 0:GICR=C0 1:GICR?C0 1:TCCR0=FF 2:TCCR0?07 2:TCCR1B=FF 3:TCCR1B?DF
    atmega16  | 0:TIMSK=FF 1:TIMSK?FF 1:MCUCR=40 2:MCUCR?40 2:MCUCSR=C0 3:MCUCSR?C0 3:SFIOR=FF 4:SFIOR?EC 4:TCCR0=F8 5:TCCR0?78
    atmega32  | 0:MCUCR=80 1:MCUCR?80 1:MCUCR=0F 2:MCUCR?0F 2:GICR=E0 3:GICR?E0
    atmega64  | 0:ADCSRB=FF 1:ADCSRB?07 1:SFIOR=08 2:SFIOR?08 2:ADCSRB?07 3:UCSR0C=FF 4:UCSR0C?7F 4:XDIV=81 5:XDIV?81
    atmega128 | 0:TIMSK=FF 1:TIMSK?FF 1:ETIMSK=FF 2:ETIMSK?3F 2:MCUCR=FC 3:MCUCR?FC 3:RAMPZ=FF 4:RAMPZ?01 4:UCSR1C=FF 5:UCSR1C?7F
    atmega128 | 0:EICRA=FF 1:EICRA?FF 1:EICRB=FF 2:EICRB?FF 2:EIMSK=FF 3:EIMSK?FF 3:PORTG=FF 4:PORTG?1F 4:TCCR1A=FF 5:TCCR1A?FF
    atmega162 | 0:TIMSK=FF 1:TIMSK?FF 1:ETIMSK=FF 2:ETIMSK?3C 2:GICR=F8 3:GICR?F8 3:EMCUCR=FF 4:EMCUCR?FF 4:SFIOR=7C 5:SFIOR?7C
    atmega162 | 0:MCUCR=FF 1:MCUCR?FF 1:MCUCSR=A0 2:MCUCSR?A0 2:TCCR3A=FF 3:TCCR3A?F3 3:PORTE=FF 4:PORTE?07
# MCUCSR: PORF after power-on; flags are cleared by a zero.
    atmega8   | 0:MCUCSR?01 1:MCUCSR=00 2:MCUCSR?00
# The window of IVCE, in GICR or MCUCR; not on the ATmega48.
    atmega8   | 0:GICR=01 1:GICR?01 2:GICR=02 3:GICR?02
    atmega8   | 0:GICR=02 1:GICR?00
    atmega128 | 0:MCUCR=01 2:MCUCR=02 3:MCUCR?02
    atmega88  | 0:MCUCR=01 2:MCUCR=02 3:MCUCR?02
    atmega48  | 0:MCUCR=01 1:MCUCR?00 2:MCUCR=02 3:MCUCR?00
# URSEL: what is written by bit 7; the first read gives UBRRH, one in the next cycle UCSRC.
    atmega8   | 0:UBRRH!00 1:UBRRH!86 5:UBRRH!00
    atmega8   | 0:UBRRH=85 1:UBRRH!00 2:UCSRC!85 3:UCSRC=0B 4:UCSRC!0B 5:UCSRC!85 6:UCSRC!85 8:UCSRC!0B
    atmega162 | 0:UCSR1C=EF 1:UBRR1H=03 2:UCSR0C!00 3:UCSR0C!86 4:UCSR1C!03 5:UCSR1C!EF
# SBI and CBI write all of a register, flags that read as one included; not so on the newer chips.
    atmega8   | 0:ADCSRA=C0 60:ADCSRA?90 61:ADCSRA|08 62:ADCSRA?88
    atmega328p| 0:ADCSRA=C0 60:ADCSRA?90 61:ADCSRA|08 62:ADCSRA?98
    atmega16  | 0:ADCSRA=C0 60:ADCSRA&80 61:ADCSRA?00
    atmega8   | 0:PORTB=A5 1:PORTB|02 2:PORTB?A7 3:PORTB&80 4:PORTB?27
# A one to PINx toggles on the newer chips only.
    atmega8   | 0:PINB=FF 1:PORTB?00
    atmega168 | 0:PINB=FF 1:PORTB?FF
# PUD in SFIOR takes all pull-ups away.
    atmega16  | 0:PORTA=01 1:PINA?00 2:PINA?01 2:SFIOR=04 3:PA0?Z
# Force compare, with the action of the same write: FOC2 in TCCR2, FOC1A in TCCR1A, FOC3B in TCCR3C or TCCR3A.
    atmega8   | 0:DDRB=0F 1:TCCR2=B0 2:PB3?H 2:TCCR2=30 3:PB3?H 3:TCCR2=A0 4:PB3?L
    atmega8   | 0:DDRB=0F 1:TCCR1A=C8 2:PB1?H 2:PB2?L
    atmega128 | 0:DDRE=FF 1:TCCR3A=30 2:PE4?L 2:TCCR3C=40 3:PE4?H 3:PE3?L
    atmega162 | 0:DDRB=FF 1:TCCR3A=34 2:PB4?H
# Clocks: timer 3 of the ATmega162 divides by 16 and 32, timers 0 of ATmega64 and 128 by 32 and 1024, timer 2 by 64.
    atmega162 | 0:SFIOR=01 1:TCCR3B=06 161:TCNT3L?0A 162:TCCR3B=07 163:TCNT3L=00 483:TCNT3L?0A
    atmega128 | 0:SFIOR=02 1:TCCR0=03 321:TCNT0?0A
    atmega128 | 0:SFIOR=01 1:TCCR2=03 641:TCNT2?0A
    atmega8   | 0:SFIOR=01 1:TCCR0=03 641:TCNT0?0A
# TSM of the chips that have it.
    atmega64  | 0:SFIOR=81 1:TCCR2=02 100:TCNT2?00 100:SFIOR?81 101:SFIOR=00 182:TCNT2?0A
# JTD and PUD of ATmega164 to 1284 stay; BODS only of the P and PA variants; PRR1, RAMPZ and timer 3 only of the largest.
    atmega644  | 0:MCUCR=90 1:MCUCR?90 1:MCUCR=60 2:MCUCR?00 2:PRR0=FF 3:PRR0?EF
    atmega644p | 0:PRR0=FF 1:PRR0?FF 1:UCSR1B=18 2:UCSR1B?00 2:PRR0=EF 3:UCSR1B=18 4:UCSR1B?18
    atmega1284 | 0:PRR1=FF 1:PRR1?01 1:PRR0?00 1:TCCR3B=01 2:TCCR3B?00 2:PRR1=00 3:PRR1?00 3:TCCR3B=01 4:TCCR3B?01
    atmega1284 | 0:PRR0=28 1:PRR0?28 1:PRR1=01 2:PRR0?28 2:PRR1?01 2:PRR0=00 3:PRR0?00 3:PRR1?01 3:RAMPZ=FF 4:RAMPZ?01
    atmega1284 | 0:GTCCR=01 1:TCCR3B=02 81:TCNT3L?0A 82:DDRB=FF 82:TCCR3A=30 83:PB7?L 83:TCCR3C=40 84:PB7?H 84:PB6?L
    atmega644  | 0:EICRA=FF 1:EICRA?3F 1:EIMSK=FF 2:EIMSK?07 2:PCICR=FF 3:PCICR?0F 3:PCMSK3=FF 4:PCMSK3?FF 4:DIDR0=FF 5:DIDR0?FF
    atmega324a | 0:ADMUX=FF 1:ADMUX?FF 1:ADCSRB=FF 2:ADCSRB?47 2:EEARH=FF 3:EEARH?03 3:PIND=81 4:PORTD?81
# The watchdog's window; the newer chips have an interrupt.
    atmega16  | 0:WDTCR=FF 1:WDTCR?1F 6:WDTCR?0F 7:WDTCR=00 8:WDTCR?08
";

fn step(soc: &mut AvrSoc, chip: &Chip, step: &str) -> Result<(), String> {
    let (cycle, what) = step.split_once(':').ok_or("no cycle")?;
    let now: u64 = cycle.parse().map_err(|_| "no cycle")?;
    let at = what.find(['=', '|', '&', '?', '!']).ok_or("no operator")?;
    let (name, operator, value) = (&what[..at], &what[at..=at], &what[at + 1..]);
    soc.fire(now);
    if let Some(pin) = chip.pin(name) {
        let level = match soc.level(pin) {
            PinLevel::High => "H",
            PinLevel::Low => "L",
            _ => "Z",
        };
        return if level == value { Ok(()) } else { Err(level.to_owned()) };
    }
    let reg = chip.reg(name).ok_or("no such register")?;
    let value = u8::from_str_radix(value, 16).map_err(|_| "no value")?;
    let got = match operator {
        "=" => return soc.write(reg, value, now).ok(),
        "|" => return soc.write_bits(reg, value, value, now).ok(),
        "&" => return soc.write_bits(reg, value, 0, now).ok(),
        "?" => soc.peek(reg, now),
        _ => soc.read(reg, now).value,
    };
    if got == value { Ok(()) } else { Err(format!("{got:02X}")) }
}

trait Done {
    fn ok(self) -> Result<(), String>;
}

impl Done for emu_core::BusEffect {
    fn ok(self) -> Result<(), String> {
        Ok(())
    }
}

#[test]
fn registers_in_old_places() {
    let mut wrong = Vec::new();
    for line in CASES.lines().filter(|line| line.contains('|') && !line.starts_with('#')) {
        let (name, steps) = line.split_once('|').expect("a chip");
        let chip = chip(name.trim()).unwrap_or_else(|| panic!("{line}"));
        let mut soc = soc(chip);
        for text in steps.split_whitespace() {
            if let Err(error) = step(&mut soc, chip, text) {
                wrong.push(format!("{line}\n  {text}: {error}"));
                break;
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Chip, registers written one after another, and the vector that the program then reaches.
const VECTORS: &str = "
    atmega8   | TIMSK=01 TCNT0=F0 TCCR0=01 | TIMER0_OVF
    atmega8   | TIMSK=40 TCNT2=F0 TCCR2=01 | TIMER2_OVF
    atmega8   | TIMSK=80 OCR2=20 TCCR2=01 | TIMER2_COMP
    atmega8   | TIMSK=04 TCNT1H=FF TCNT1L=F0 TCCR1B=01 | TIMER1_OVF
    atmega8   | TIMSK=10 OCR1AL=20 TCCR1B=01 | TIMER1_COMPA
    atmega8   | TIMSK=08 OCR1BL=20 TCCR1B=01 | TIMER1_COMPB
    atmega8   | GICR=40 | INT0
    atmega8   | GICR=80 | INT1
    atmega8   | UCSRB=28 | USART_UDRE
    atmega8   | UCSRB=48 UDR=55 | USART_TXC
    atmega8   | ADCSRA=C8 | ADC
    atmega8   | EECR=08 | EE_RDY
    atmega8   | PORTC=30 TWCR=A5 | TWI
    atmega8   | SPMCR=80 | SPM_RDY
    atmega8   | DDRB=04 SPCR=D0 SPDR=00 | SPI_STC
    atmega16  | TIMSK=02 OCR0=20 TCCR0=01 | TIMER0_COMP
    atmega16  | TIMSK=01 TCNT0=F0 TCCR0=01 | TIMER0_OVF
    atmega16  | MCUCSR=00 GICR=20 GIFR=E0 DDRB=04 PORTB=04 MCUCSR=40 PORTB=00 PORTB=04 | INT2
    atmega32  | TIMSK=02 OCR0=20 TCCR0=01 | TIMER0_COMP
    atmega32  | TIMSK=40 TCNT2=F0 TCCR2=01 | TIMER2_OVF
    atmega32  | ADCSRA=C8 | ADC
    atmega64  | TIMSK=02 OCR0=20 TCCR0=01 | TIMER0_COMP
    atmega64  | EECR=08 | EE_READY
    atmega128 | ETIMSK=04 TCNT3H=FF TCNT3L=F0 TCCR3B=01 | TIMER3_OVF
    atmega128 | ETIMSK=02 OCR3CL=20 TCCR3B=01 | TIMER3_COMPC
    atmega128 | ETIMSK=01 OCR1CL=20 TCCR1B=01 | TIMER1_COMPC
    atmega128 | TIMSK=04 TCNT1H=FF TCNT1L=F0 TCCR1B=01 | TIMER1_OVF
    atmega128 | TIMSK=80 OCR2=20 TCCR2=01 | TIMER2_COMP
    atmega128 | UCSR0B=28 | USART0_UDRE
    atmega128 | UCSR1B=28 | USART1_UDRE
    atmega128 | EIMSK=01 | INT0
    atmega128 | EIMSK=80 | INT7
    atmega128 | PORTD=03 TWCR=A5 | TWI
    atmega162 | ETIMSK=04 TCNT3H=FF TCNT3L=F0 TCCR3B=01 | TIMER3_OVF
    atmega162 | ETIMSK=10 OCR3AL=20 TCCR3B=01 | TIMER3_COMPA
    atmega162 | TIMSK=01 OCR0=20 TCCR0=01 | TIMER0_COMP
    atmega162 | TIMSK=80 TCNT1H=FF TCNT1L=F0 TCCR1B=01 | TIMER1_OVF
    atmega162 | UCSR0B=28 | USART0_UDRE
    atmega162 | UCSR1B=28 | USART1_UDRE
    atmega162 | GICR=10 PCMSK1=01 DDRC=01 PORTC=01 | PCINT1
    atmega88  | TIMSK0=01 TCNT0=F0 TCCR0B=01 | TIMER0_OVF
    atmega48  | UCSR0B=28 | USART_UDRE
    atmega168 | SPMCSR=80 | SPM_READY
    atmega644 | SPMCSR=80 | SPM_READY
    atmega644 | PCICR=08 PCMSK3=80 DDRD=80 PORTD=80 | PCINT3
    atmega644 | EICRA=30 EIMSK=04 DDRB=04 PORTB=04 | INT2
    atmega164a | UCSR1B=28 | USART1_UDRE
    atmega324pa | UCSR0B=28 | USART0_UDRE
    atmega644p | ADCSRA=C8 | ADC
    atmega1284 | TIMSK3=01 TCNT3H=FF TCNT3L=F0 TCCR3B=01 | TIMER3_OVF
    atmega1284p | TIMSK3=04 TCCR3B=01 | TIMER3_COMPB
";

/// Returns a chip with these lines in flash, each at its program word.
fn machine(chip: &'static Chip, lines: &[(u32, &str)]) -> Avr {
    let text: String = lines.iter().map(|(at, line)| format!(".org {}\n{line}\n", 2 * at)).collect();
    let image = emu_asm::assemble_text(chip, &text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    Avr::new(chip, &image, RamInit::Zero)
}

#[test]
fn interrupts_arrive_at_their_vectors() {
    for line in VECTORS.lines().filter(|line| line.contains('|')) {
        let &[name, writes, vector] = &line.split('|').map(str::trim).collect::<Vec<_>>()[..] else { panic!("{line}") };
        let chip = chip(name).unwrap_or_else(|| panic!("{line}"));
        let number = chip.vectors.iter().position(|known| *known == vector).unwrap_or_else(|| panic!("{line}"));
        let wanted = number as u32 * chip.words_per_vector;
        // The program loops after the vectors, and each vector is its own loop.
        let mut lines: Vec<(u32, &str)> =
            (0..chip.vectors.len() as u32).map(|n| (n * chip.words_per_vector, "rjmp .-2")).collect();
        lines.extend([(0x100, "nop"), (0x101, "rjmp .-4")]);
        let mut avr = machine(chip, &lines);
        for write in writes.split(' ') {
            let (reg, value) = write.split_once('=').expect("REG=value");
            let addr = chip.reg(reg).unwrap_or_else(|| panic!("{line}: {reg}"));
            let value = u8::from_str_radix(value, 16).expect("a value");
            assert!(avr.poke("data", addr.into(), value), "{line}");
            avr.set_pc(0x100);
            (0..8).for_each(|_| assert_eq!(avr.step(&mut ()), StopReason::Limit, "{line}"));
        }
        assert!(avr.set_reg("SP", u32::from(chip.ram_start + chip.ram_len - 1)) && avr.set_reg("SREG", 0x80));
        for _ in 0..40_000 {
            if avr.pc() < 0x100 {
                break;
            }
            assert_eq!(avr.step(&mut ()), StopReason::Limit, "{line}");
        }
        assert_eq!(avr.pc(), wanted, "{line}");
    }
}

/// RAM below 100h behaves as RAM for the program, the debugger, the image, and the random values at power-up.
#[test]
fn ram_below_100h() {
    for name in ["atmega8", "atmega16", "atmega32"] {
        let chip = chip(name).expect("a chip");
        let code =
            [(0, "ldi r16,0x5A"), (1, "sts 0x60,r16"), (3, "lds r17,0xFF"), (5, "lds r18,0x100"), (7, "lds r19,0x60")];
        let mut avr = machine(chip, &code);
        assert_eq!(avr.reg("SP"), Some(0));
        assert!(avr.poke("data", 0xFF, 0x77) && avr.poke("data", 0x100, 0x88));
        (0..5).for_each(|_| assert_eq!(avr.step(&mut ()), StopReason::Limit));
        assert_eq!(avr.cycle(), 1 + 4 * 2);
        assert_eq!([17, 18, 19].map(|r| avr.peek("data", r)), [Some(0x77), Some(0x88), Some(0x5A)]);
        assert_eq!(avr.peek("data", 0x60), Some(0x5A));
        assert_eq!(avr.clone().peek("data", 0x60), Some(0x5A));
        avr.reset(ResetCause::External);
        assert_eq!(avr.peek("data", 0x60), Some(0x5A), "a reset leaves RAM");

        let data = Segment { space: "data", addr: 0x5F, bytes: vec![0x11, 0x22, 0x33] };
        let image = Image { segments: vec![data], ..Image::default() };
        let avr = Avr::new(chip, &image, RamInit::Random(7));
        assert_eq!([0x60, 0x61].map(|addr| avr.peek("data", addr)), [Some(0x22), Some(0x33)]);
        let random: BTreeSet<_> = (0x62..0x100).map(|addr| avr.peek("data", addr)).collect();
        assert!(random.len() > 32, "{name}: {random:?}");
    }
    // The larger chips have registers there.
    assert_eq!(
        AVR_PARTS
            .iter()
            .filter(|part| part.register_slots.iter().any(|site| matches!(site, RegisterSlot::Low(_))))
            .count(),
        3
    );
}

/// JMP and CALL need more than 8 KB, ELPM more than 64 KB.
#[test]
fn instructions_that_a_chip_lacks() {
    let largest = chip("atmega128").expect("a chip");
    for part in AVR_PARTS {
        let (chip, jumps) = (part.chip, part.chip.flash_bytes > 0x2000);
        for (line, there) in
            [("jmp 0x200", jumps), ("call 0x200", jumps), ("elpm", chip.flash_bytes > 0x1_0000), ("movw r0,r2", true)]
        {
            // The assembler for the chip rejects the instruction, so it is given as words.
            let words = emu_asm::assemble_line(largest, line, 0).expect(line);
            let text = words.iter().map(|word| format!(".word {word:#x}\n")).collect::<String>();
            let mut avr = machine(chip, &[(0, &text)]);
            let stop = avr.step(&mut ());
            assert_eq!(emu_asm::assemble_line(chip, line, 0).is_ok(), there, "{}: {line}", chip.name);
            assert_eq!(
                matches!(stop, StopReason::Error(ProgramError::Illegal { pc: 0, .. })),
                !there,
                "{}: {line}: {stop:?}",
                chip.name
            );
            let shown = (chip.isa.disassemble)(&words, 0).text;
            assert_eq!(shown.starts_with(".word"), !there, "{}: {line}: {shown}", chip.name);
        }
        let stack = if part.stack_starts_at_ram_end { chip.ram_start + chip.ram_len - 1 } else { 0 };
        assert_eq!(machine(chip, &[]).reg("SP"), Some(stack.into()), "{}", chip.name);
    }
}

/// Fuses at other positions: low, high and extended byte, and the program word at which a reset starts.
#[test]
fn resets_go_where_the_fuses_say() {
    let cases: &[(&str, [u8; 3], u32)] = &[
        ("atmega328p", [0xFF, 0xD8, 0xFF], 0x3800),
        ("atmega328p", [0xFF, 0xDE, 0xFF], 0x3F00),
        ("atmega168", [0xFF, 0xDF, 0xF8], 0x1C00),
        ("atmega168pa", [0xFF, 0xDF, 0xFC], 0x1F00),
        ("atmega88", [0xFF, 0xDF, 0xF8], 0x0C00),
        ("atmega88", [0xFF, 0xDE, 0xFF], 0),
        ("atmega48", [0xFF, 0x00, 0xF8], 0),
        ("atmega8", [0xE0, 0xD8, 0xFF], 0x0C00),
        ("atmega8", [0xE0, 0xDE, 0xFF], 0x0F80),
        ("atmega16", [0xE0, 0xDA, 0xFF], 0x1E00),
        ("atmega32", [0xE0, 0xD8, 0xFF], 0x3800),
        ("atmega64", [0xE0, 0xD8, 0xFF], 0x7000),
        ("atmega128", [0xE0, 0xD8, 0xFF], 0xF000),
        ("atmega128", [0xE0, 0xDE, 0xFF], 0xFE00),
        ("atmega162", [0xFF, 0xD8, 0xFF], 0x1C00),
        ("atmega164a", [0xFF, 0xD8, 0xFF], 0x1C00),
        ("atmega324p", [0xFF, 0xDE, 0xFF], 0x3F00),
        ("atmega644", [0xFF, 0xD8, 0xFF], 0x7000),
        ("atmega1284p", [0xFF, 0xD8, 0xFF], 0xF000),
        ("atmega1284", [0xFF, 0xDE, 0xFF], 0xFE00),
    ];
    for &(name, fuses, wanted) in cases {
        let chip = chip(name).expect("a chip");
        let avr = Avr::with(chip, &Image::default(), RamInit::Zero, Options { fuses: Some(fuses), ..options(chip) });
        assert_eq!(avr.pc(), wanted, "{name}: {fuses:x?}");
    }
}

#[test]
fn names_are_found_in_any_case() {
    assert_eq!(chip("ATmega328P").map(|chip| chip.name), Some(ATMEGA328P.name));
    let row: Option<&AvrPart> = part("ATMEGA162");
    assert_eq!(row.map(|part| part.chip.name), Some("atmega162"));
    assert!(chip("atmega169").is_none());
}

/// JTAG pins by the pin configurations of the data sheets (TCK, TMS, TDO, TDI).
#[test]
fn jtag_pins() {
    let pins = [
        ("atmega16", "PC2 PC3 PC4 PC5"),
        ("atmega32", "PC2 PC3 PC4 PC5"),
        ("atmega64", "PF4 PF5 PF6 PF7"),
        ("atmega128", "PF4 PF5 PF6 PF7"),
        ("atmega162", "PC4 PC5 PC6 PC7"),
    ];
    for part in AVR_PARTS {
        let named = part.chip.pins.iter().map(|pin| pin.name).filter(|name| part.is_jtag_pin(name));
        let of_644 = ["Atmel 8272", "Atmel 8011", "Atmel 2593"].contains(&part.chip.data_sheet);
        let row = pins.iter().find(|(chip, _)| *chip == part.chip.name || of_644 && *chip == "atmega16");
        let wanted = row.map_or("", |row| row.1);
        assert_eq!(named.collect::<Vec<_>>().join(" "), wanted, "{}", part.chip.name);
    }
}
