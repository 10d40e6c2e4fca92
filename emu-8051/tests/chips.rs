//! Compares the chip rows with tables typed from the manuals, in the layout of the manuals.
//!
//! Sources: Intel 272383 (registers, bits, vectors, pins), Intel 272318 and 272335, Atmel 0265, 0313, 2487,
//! 1919, 0368, 1001.

use std::collections::BTreeSet;

use emu_8051::chips::{MCS51_PARTS, Mcs51Part, Timer2Kind, chip, chips, part};
use emu_core::chip::{ChipFamily, NamedAddress};

/// Chip, document, bytes of program memory on the chip, bytes of RAM, highest clock in MHz, other features.
const CHIPS: &str = "
    8031      | 272318 | 0    | 128 | 12 | bus
    8051      | 272318 | 4096 | 128 | 12 | bus
    8751      | 272318 | 4096 | 128 | 12 | bus
    8032      | 272318 | 0    | 256 | 12 | bus timer2
    8052      | 272318 | 8192 | 256 | 12 | bus timer2
    8752      | 272318 | 8192 | 256 | 12 | bus timer2
    80c51     | 272335 | 4096 | 128 | 24 | bus cmos x2
    at89c51   | 0265   | 4096 | 128 | 24 | bus cmos
    at89c52   | 0313   | 8192 | 256 | 24 | bus cmos timer2 t2mod
    at89s51   | 2487   | 4096 | 128 | 33 | bus cmos at89s
    at89s52   | 1919   | 8192 | 256 | 33 | bus cmos timer2 t2mod at89s
    at89c2051 | 0368   | 2048 | 128 | 24 | cmos comparator
    at89c4051 | 1001   | 4096 | 128 | 24 | cmos comparator
";

/// Chips, then a line of the register map: address of its first byte, and the eight registers. Empty lines of
/// the map are left out.
const REGISTER_MAP: &str = "
    all       | F0 | B
    all       | E0 | ACC
    all       | D0 | PSW
    8032 8052 8752  | C8 | T2CON - RCAP2L RCAP2H TL2 TH2
    at89c52 at89s52 | C8 | T2CON T2MOD RCAP2L RCAP2H TL2 TH2
    all       | B8 | IP
    all       | B0 | P3
    all       | A8 | IE
    8031 8051 8751 8032 8052 8752 80c51 at89c51 at89c52 | A0 | P2
    at89s51 at89s52 | A0 | P2 - AUXR1 - - - WDTRST
    all       | 98 | SCON SBUF
    all       | 90 | P1
    8031 8051 8751 8032 8052 8752 80c51 at89c51 at89c52 at89c2051 at89c4051 | 88 | TCON TMOD TL0 TL1 TH0 TH1
    at89s51 at89s52 | 88 | TCON TMOD TL0 TL1 TH0 TH1 AUXR
    8031 8051 8751 8032 8052 8752 80c51 at89c51 at89c52 | 80 | P0 SP DPL DPH - - - PCON
    at89s51 at89s52 | 80 | P0 SP DPL=DP0L DPH=DP0H DP1L DP1H - PCON
    at89c2051 at89c4051 | 80 | - SP DPL DPH - - - PCON
";

/// Features that a chip must have (`!`: must not have), then a register and its bits from 7 down to 0.
const BITS: &str = "
    bus     | 80 | P0.7 P0.6 P0.5 P0.4 P0.3 P0.2 P0.1 P0.0
    -       | 88 | TF1 TR1 TF0 TR0 IE1 IT1 IE0 IT0
    -       | 90 | P1.7 P1.6 P1.5 P1.4 P1.3 P1.2 P1.1 P1.0
    -       | 98 | SM0 SM1 SM2 REN TB8 RB8 TI RI
    bus     | A0 | P2.7 P2.6 P2.5 P2.4 P2.3 P2.2 P2.1 P2.0
    timer2  | A8 | EA IE.6 ET2 ES ET1 EX1 ET0 EX0
    !timer2 | A8 | EA IE.6 IE.5 ES ET1 EX1 ET0 EX0
    -       | B0 | P3.7 P3.6 P3.5 P3.4 P3.3 P3.2 P3.1 P3.0
    timer2  | B8 | IP.7 IP.6 PT2 PS PT1 PX1 PT0 PX0
    !timer2 | B8 | IP.7 IP.6 IP.5 PS PT1 PX1 PT0 PX0
    timer2  | C8 | TF2 EXF2 RCLK TCLK EXEN2 TR2 C_T2 CP_RL2
    -       | D0 | CY AC F0 RS1 RS0 OV PSW.1 P
    -       | E0 | ACC.7 ACC.6 ACC.5 ACC.4 ACC.3 ACC.2 ACC.1 ACC.0
    -       | F0 | B.7 B.6 B.5 B.4 B.3 B.2 B.1 B.0
";

/// The packages, pin 1 first; `-` is a supply, crystal or bus pin that no program can access.
const DIP40: &str = "
    P1.0 P1.1 P1.2 P1.3 P1.4 P1.5 P1.6 P1.7 RST P3.0 P3.1 P3.2 P3.3 P3.4 P3.5 P3.6 P3.7 - - -
    P2.0 P2.1 P2.2 P2.3 P2.4 P2.5 P2.6 P2.7 - - - P0.7 P0.6 P0.5 P0.4 P0.3 P0.2 P0.1 P0.0 -
";
const DIP20: &str = "
    RST P3.0 P3.1 - - P3.2 P3.3 P3.4 P3.5 -
    P3.7 P1.0 P1.1 P1.2 P1.3 P1.4 P1.5 P1.6 P1.7 -
";

/// Features that a chip must have, then a port and the alternative functions of its pins, pin 0 first.
const NOTES: &str = "
    bus                | P0 | AD0 AD1 AD2 AD3 AD4 AD5 AD6 AD7
    bus                | P2 | A8 A9 A10 A11 A12 A13 A14 A15
    bus                | P3 | RXD TXD INT0 INT1 T0 T1 WR RD
    bus !timer2 !at89s | P1 | - - - - - - - -
    bus timer2 !at89s  | P1 | T2 T2EX - - - - - -
    !timer2 at89s      | P1 | - - - - - MOSI MISO SCK
    timer2 at89s       | P1 | T2 T2EX - - - MOSI MISO SCK
    !bus               | P0 | absent absent absent absent absent absent absent absent
    !bus               | P1 | AIN0 AIN1 - - - - - -
    !bus               | P2 | absent absent absent absent absent absent absent absent
    !bus               | P3 | RXD TXD INT0 INT1 T0 T1 comparator_output -
";

/// Features that a chip must have, then address and interrupt.
const VECTORS: &str = "
    -      | 0003 | INT0
    -      | 000B | TIMER0
    -      | 0013 | INT1
    -      | 001B | TIMER1
    -      | 0023 | SERIAL
    timer2 | 002B | TIMER2
";

fn table(text: &str) -> impl Iterator<Item = Vec<&str>> {
    text.lines().map(str::trim).filter(|l| !l.is_empty()).map(|l| l.split('|').map(str::trim).collect())
}

fn hex(text: &str) -> u16 {
    u16::from_str_radix(text, 16).expect("a hexadecimal number in the table")
}

fn find(name: &str) -> &'static Mcs51Part {
    part(name).unwrap_or_else(|| panic!("no chip {name}"))
}

fn features(p: &Mcs51Part) -> BTreeSet<&'static str> {
    let has = [
        ("bus", p.has_bus),
        ("cmos", p.is_cmos),
        ("timer2", p.timer2 != Timer2Kind::None),
        ("t2mod", p.timer2 == Timer2Kind::Full),
        ("at89s", p.is_at89s),
        ("comparator", p.has_comparator),
        ("x2", p.has_x2),
    ];
    has.into_iter().filter(|(_, has)| *has).map(|(name, _)| name).collect()
}

/// Whether a line with this condition applies to the part.
fn holds(condition: &str, p: &Mcs51Part) -> bool {
    let has = features(p);
    condition.split_whitespace().all(|c| match c.strip_prefix('!') {
        Some(not) => !has.contains(not),
        None => c == "-" || has.contains(c),
    })
}

fn sorted(mut regs: Vec<(u16, String)>) -> Vec<(u16, String)> {
    regs.sort();
    regs
}

fn owned(regs: &[NamedAddress]) -> Vec<(u16, String)> {
    sorted(regs.iter().map(|r| (r.addr, r.name.to_string())).collect())
}

#[test]
fn what_each_chip_has() {
    let mut named = Vec::new();
    for row in table(CHIPS) {
        let [name, source, internal, ram, mhz, has] = row[..] else { panic!("{row:?}") };
        let p = find(name);
        let number = |text: &str| text.parse::<u32>().expect("a number in the table");
        let clocks = (p.chip.max_hz, p.chip.default_hz);
        assert_eq!(p.chip.data_sheet, source, "{name}");
        assert_eq!((p.chip.on_chip_flash_bytes, u32::from(p.iram_bytes)), (number(internal), number(ram)), "{name}");
        assert_eq!(clocks, (u64::from(number(mhz)) * 1_000_000, 12_000_000), "{name}");
        assert_eq!(features(p), has.split_whitespace().collect(), "{name}");
        named.push(name);
    }
    assert_eq!(named, chips().map(|c| c.name).collect::<Vec<_>>());
}

#[test]
fn memories() {
    for p in MCS51_PARTS {
        let (c, name) = (&p.chip, p.chip.name);
        let code = if p.has_bus { 65536 } else { p.chip.on_chip_flash_bytes };
        let mut wanted = vec![("code", code, 1), ("idata", u32::from(p.iram_bytes), 1), ("sfr", 256, 1)];
        wanted.push(("bit", 256, 1));
        wanted.extend(p.has_bus.then_some(("xdata", 65536, 1)));
        let spaces: Vec<_> = c.spaces.iter().map(|space| (space.name, space.size, space.width)).collect();
        assert_eq!(spaces, wanted, "{name}");
        assert_eq!((c.code_space, c.ram_space, c.reg_space), ("code", "idata", "sfr"), "{name}");
        assert_eq!(
            (c.flash_bytes, c.ram_start, c.ram_len, c.eeprom_bytes, c.word_bytes),
            (code, 0, p.iram_bytes, 0, 1),
            "{name}"
        );
        for windows in [c.hex_spaces, c.elf_spaces] {
            let [window] = windows else { panic!("{name}: {windows:?}") };
            assert_eq!((window.name, window.start, window.len, window.word), ("code", 0, code, 1), "{name}");
        }
        assert_eq!((c.family, c.elf_machine), (ChipFamily::Mcs51, 165), "{name}");
        let registers = "r0 r1 r2 r3 r4 r5 r6 r7 ACC B PSW SP DPTR PC";
        assert_eq!(c.cpu_regs, registers.split(' ').collect::<Vec<_>>(), "{name}");
    }
}

#[test]
fn register_map() {
    for c in chips() {
        let mut wanted = Vec::new();
        for row in table(REGISTER_MAP) {
            let [names, line, registers] = row[..] else { panic!("{row:?}") };
            if names != "all" && !names.split_whitespace().any(|n| n == c.name) {
                continue;
            }
            for (register, addr) in registers.split_whitespace().zip(hex(line)..) {
                let aliases = register.split('=').filter(|&r| r != "-");
                wanted.extend(aliases.map(|r| (addr, r.to_string())));
            }
        }
        assert_eq!(owned(c.regs), sorted(wanted), "{}", c.name);
        assert!(c.regs.is_sorted_by_key(|r| r.addr), "{}", c.name);
    }
}

#[test]
fn named_bits() {
    for p in MCS51_PARTS {
        let (c, mut wanted) = (&p.chip, Vec::new());
        for row in table(BITS) {
            let [condition, register, bits] = row[..] else { panic!("{row:?}") };
            let bits: Vec<_> = bits.split_whitespace().collect();
            assert_eq!(bits.len(), 8, "{row:?}");
            if holds(condition, p) {
                let addrs = (hex(register)..).take(8);
                wanted.extend(bits.iter().rev().zip(addrs).map(|(bit, addr)| (addr, (*bit).to_string())));
            }
        }
        assert_eq!(owned(c.bits), sorted(wanted), "{}", c.name);
    }
}

#[test]
fn registers_that_have_bits() {
    for c in chips() {
        let bytes: BTreeSet<u16> = c.regs.iter().map(|r| r.addr).filter(|a| a % 8 == 0).collect();
        let of_bits: BTreeSet<u16> = c.bits.iter().map(|b| b.addr & !7).collect();
        assert_eq!(bytes, of_bits, "{}", c.name);
        let addrs: BTreeSet<u16> = c.bits.iter().map(|b| b.addr).collect();
        assert_eq!(addrs.len(), 8 * bytes.len(), "{}: eight bits for each", c.name);
        assert_eq!(addrs.len(), c.bits.len(), "{}: one name for each", c.name);
    }
}

#[test]
fn packages() {
    for p in MCS51_PARTS {
        let (c, package) = (&p.chip, if p.has_bus { DIP40 } else { DIP20 });
        let (mut on_package, size) = (0, package.split_whitespace().count());
        assert_eq!(size, if p.has_bus { 40 } else { 20 });
        for (place, name) in (1..).zip(package.split_whitespace()).filter(|(_, name)| *name != "-") {
            let pin = c.pin(name).unwrap_or_else(|| panic!("{}: no pin {name}", c.name));
            assert_eq!(c.pins[usize::from(pin)].dip, place, "{}: {name}", c.name);
            on_package += 1;
        }
        assert_eq!(c.pins.iter().filter(|pin| pin.dip != 0).count(), on_package, "{}", c.name);
        for (i, pin) in c.pins.iter().enumerate() {
            let wanted = if i == 32 { "RST".to_string() } else { format!("P{}.{}", i / 8, i % 8) };
            assert_eq!(pin.name, wanted, "{}: pin {i}", c.name);
        }
        assert_eq!((c.pins.len(), c.pins[32].note), (33, "reset"), "{}", c.name);
    }
}

#[test]
fn other_functions_of_pins() {
    for p in MCS51_PARTS {
        let lines: Vec<_> = table(NOTES).filter(|row| holds(row[0], p)).collect();
        assert_eq!(lines.iter().map(|row| row[1]).collect::<BTreeSet<_>>().len(), 4, "{}", p.chip.name);
        assert_eq!(lines.len(), 4, "{}", p.chip.name);
        for row in lines {
            for (bit, note) in row[2].split_whitespace().enumerate() {
                let name = format!("{}.{bit}", row[1]);
                let pin = p.chip.pin(&name).unwrap_or_else(|| panic!("{}: no pin {name}", p.chip.name));
                let wanted = if note == "-" { String::new() } else { note.replace('_', " ") };
                assert_eq!(p.chip.pins[usize::from(pin)].note, wanted, "{}: {name}", p.chip.name);
            }
        }
    }
}

#[test]
fn vectors() {
    for p in MCS51_PARTS {
        let (c, mut count) = (&p.chip, 1);
        assert_eq!(c.vectors[0], "RESET", "{}", c.name);
        for row in table(VECTORS).filter(|row| holds(row[0], p)) {
            let number = c.vectors.iter().position(|v| *v == row[2]);
            let number = number.unwrap_or_else(|| panic!("{}: no vector {}", c.name, row[2]));
            let addr = 3 + c.words_per_vector * (number as u32 - 1);
            assert_eq!(addr, u32::from(hex(row[1])), "{}: {}", c.name, row[2]);
            count += 1;
        }
        assert_eq!(c.vectors.len(), count, "{}", c.name);
    }
}

#[test]
fn names() {
    assert_eq!(chip("AT89S52").map(|c| c.name), Some("at89s52"));
    assert_eq!(part("80C51").map(|p| p.chip.name), Some("80c51"));
    assert!(chip("8053").is_none());
    let s52 = &find("at89s52").chip;
    let at = [s52.reg("dpl"), s52.reg("DP0L"), s52.bit("p1.0"), s52.bit("acc.7"), s52.reg("P4")];
    assert_eq!(at, [Some(0x82), Some(0x82), Some(0x90), Some(0xE7), None]);
    assert_eq!(s52.regs.iter().find(|r| r.addr == 0x82).map(|r| r.name), Some("DPL"), "the name of all chips first");
    for c in chips() {
        let all = c.regs.iter().chain(c.bits).map(|r| r.name.to_ascii_lowercase());
        let distinct: BTreeSet<_> = all.collect();
        assert_eq!(distinct.len(), c.regs.len() + c.bits.len(), "{}: a name twice", c.name);
        assert!(c.title.to_ascii_lowercase().starts_with(&format!("{}: ", c.name)), "{}", c.title);
    }
}

/// Features that a chip must have (`!`: must not have), then names of bits and their addresses.
const CONSTANTS: &str = "
    -       | RXD=B0 TXD=B1 INT0=B2 INT1=B3 T0=B4 T1=B5
    bus     | WR=B6 RD=B7
    !bus    | WR=- RD=-
    timer2  | T2=90 T2EX=91 CPRL2=C8 CT2=C9
    !timer2 | T2=- T2EX=- CPRL2=- CT2=-
";

#[test]
fn pins_have_the_names_of_what_they_do() {
    for part in MCS51_PARTS {
        let ours: Vec<_> = (part.chip.constants)();
        for (wanted, names) in CONSTANTS.lines().filter_map(|line| line.split_once('|')) {
            let has = |feature: &str| match feature {
                "bus" => part.has_bus,
                "timer2" => part.timer2 != Timer2Kind::None,
                _ => true,
            };
            let wanted = wanted.trim();
            if !wanted.strip_prefix('!').map_or_else(|| has(wanted), |feature| !has(feature)) {
                continue;
            }
            for (name, addr) in names.split_whitespace().filter_map(|pair| pair.split_once('=')) {
                let found = ours.iter().find(|row| row.name == name).map(|row| format!("{:X}", row.value));
                assert_eq!(found.as_deref().unwrap_or("-"), addr, "{}: {name}", part.chip.name);
            }
        }
    }
}
