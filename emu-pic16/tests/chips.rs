//! Compares the rows of the chips with tables typed from the data sheets, in the arrangement of the data
//! sheets.

use std::collections::BTreeSet;

use emu_core::chip::ChipFamily;
use emu_core::pins::PinId;
use emu_pic16::chips::{
    ComparatorKind, FileSlot, NO_PIN, NonvolatileKind, PIC16_PARTS, Pic16Part, SfrBit, SfrBitPlace, SspKind, chip,
    chips, part,
};
use emu_pic16::periph::map::{InterruptFlag, Sfr};

/// Chip, document, K words of program, bytes of RAM, bytes of EEPROM, pins, highest clock in MHz, device ID,
/// other peripherals.
const CHIPS: &str = "
    pic16c71   | DS30272 | 1 |  36 |   0 | 18 | 20 | -    | adc
    pic16c84   | DS30445 | 1 |  36 |  64 | 18 | 10 | -    |
    pic16f84   | DS30430 | 1 |  68 |  64 | 18 | 10 | -    |
    pic16f84a  | DS35007 | 1 |  68 |  64 | 18 | 20 | 0560 |
    pic16f628  | DS40300 | 2 | 224 | 128 | 18 | 20 | 07C0 | bor ccp1 usart comparators
    pic16f628a | DS40044 | 2 | 224 | 128 | 18 | 20 | 1060 | bor ccp1 usart comparators
    pic16f648a | DS40044 | 4 | 256 | 256 | 18 | 20 | 1100 | bor ccp1 usart comparators
    pic16f818  | DS39598 | 1 | 128 | 128 | 18 | 20 | 04C0 | bor flash ccp1 ssp adc
    pic16f819  | DS39598 | 2 | 256 | 256 | 18 | 20 | 04E0 | bor flash ccp1 ssp adc
    pic16f87   | DS30487 | 4 | 368 | 256 | 18 | 20 | 0720 | bor flash ccp1 ssp usart comparators
    pic16f88   | DS30487 | 4 | 368 | 256 | 18 | 20 | 0760 | bor flash ccp1 ssp usart comparators adc
    pic16f870  | DS30569 | 2 | 128 |  64 | 28 | 20 | 0D00 | bor flash ccp1 usart adc
    pic16f871  | DS30569 | 2 | 128 |  64 | 40 | 20 | 0D20 | bor flash ccp1 usart adc psp
    pic16f872  | DS30221 | 2 | 128 |  64 | 28 | 20 | 08E0 | bor flash ccp1 mssp adc
    pic16f873  | DS30292 | 4 | 192 | 128 | 28 | 20 | 0960 | bor flash ccp1 ccp2 mssp usart adc
    pic16f873a | DS39582 | 4 | 192 | 128 | 28 | 20 | 0E40 | bor flash ccp1 ccp2 mssp usart adc comparators
    pic16f874  | DS30292 | 4 | 192 | 128 | 40 | 20 | 0920 | bor flash ccp1 ccp2 mssp usart adc psp
    pic16f874a | DS39582 | 4 | 192 | 128 | 40 | 20 | 0E60 | bor flash ccp1 ccp2 mssp usart adc psp comparators
    pic16f876  | DS30292 | 8 | 368 | 256 | 28 | 20 | 09E0 | bor flash ccp1 ccp2 mssp usart adc
    pic16f876a | DS39582 | 8 | 368 | 256 | 28 | 20 | 0E00 | bor flash ccp1 ccp2 mssp usart adc comparators
    pic16f877  | DS30292 | 8 | 368 | 256 | 40 | 20 | 09A0 | bor flash ccp1 ccp2 mssp usart adc psp
    pic16f877a | DS39582 | 8 | 368 | 256 | 40 | 20 | 0E20 | bor flash ccp1 ccp2 mssp usart adc psp comparators
";

/// Registers with several addresses on chips with four banks; all others have one.
const MIRRORS: &str = "
    INDF 0 80 100 180 | TMR0 1 101 | PCL 2 82 102 182 | STATUS 3 83 103 183 | FSR 4 84 104 184 | PORTB 6 106
    PCLATH A 8A 10A 18A | INTCON B 8B 10B 18B | OPTION_REG 81 181 | TRISB 86 186
";

/// Registers with several addresses on chips with two banks, on which banks 2 and 3 mirror banks 0 and 1.
const MIRRORS_84: &str = "
    INDF 0 80 100 180 | TMR0 1 101 | PCL 2 82 102 182 | STATUS 3 83 103 183 | FSR 4 84 104 184 | PORTA 5 105 | PORTB 6 106
    EEDATA 8 108 | EEADR 9 109 | ADCON0 8 108 | ADRES 9 89 109 189 | PCLATH A 8A 10A 18A | INTCON B 8B 10B 18B
    OPTION_REG 81 181 | TRISA 85 185 | TRISB 86 186 | EECON1 88 188 | EECON2 89 189 | ADCON1 88 188
";

/// Chips, then every range of RAM: its addresses, and after `=` the addresses that it mirrors instead of
/// having its own bytes.
const RAM_MAP: &str = "
    84 84a | 0C-4F 8C-CF=0C 10C-14F=0C 18C-1CF=0C
    c71 c84 | 0C-2F 8C-AF=0C 10C-12F=0C 18C-1AF=0C
    628 628a | 20-7F A0-EF F0-FF=70 120-14F 170-17F=70 1F0-1FF=70
    648a | 20-7F A0-EF F0-FF=70 120-16F 170-17F=70 1F0-1FF=70
    818 | 20-7F A0-BF C0-FF=40 120-17F=20 1A0-1FF=20
    819 | 20-7F A0-EF F0-FF=70 120-16F 170-17F=70 1A0-1EF=20 1F0-1FF=70
    87 88 876 876a 877 877a | 20-7F A0-EF F0-FF=70 110-16F 170-17F=70 190-1EF 1F0-1FF=70
    870 871 872 | 20-7F A0-BF F0-FF=70 120-16F=20 170-17F=70 1A0-1BF=A0 1F0-1FF=70
    873 873a 874 874a | 20-7F A0-FF 120-17F=20 1A0-1FF=A0
";

/// Chips, then the pins of the package from 1 on; supply and oscillator pins are `-`.
const PACKAGES: &str = "
    c71 c84 84 84a | RA2 RA3 RA4 MCLR - RB0 RB1 RB2 RB3 RB4 RB5 RB6 RB7 - - - RA0 RA1
    628 628a 648a 818 819 87 88 | RA2 RA3 RA4 RA5 - RB0 RB1 RB2 RB3 RB4 RB5 RB6 RB7 - RA6 RA7 RA0 RA1
    870 872 873 873a 876 876a | MCLR RA0 RA1 RA2 RA3 RA4 RA5 - - - RC0 RC1 RC2 RC3 RC4 RC5 RC6 RC7 - - RB0 RB1 RB2 RB3 RB4 RB5 RB6 RB7
    871 874 874a 877 877a | MCLR RA0 RA1 RA2 RA3 RA4 RA5 RE0 RE1 RE2 - - - - RC0 RC1 RC2 RC3 RD0 RD1 RD2 RD3 RC4 RC5 RC6 RC7 RD4 RD5 RD6 RD7 - - RB0 RB1 RB2 RB3 RB4 RB5 RB6 RB7
";

/// Chips; lines with their pins (`!`: independent of TRIS), in the order of the lines; pins of AN0, AN1, ..;
/// bits with an open drain; bits that are only inputs.
const LINES: &str = "
    c71 | T0cki=RA4 Int=RB0 | RA0 RA1 RA2 RA3 | RA4 |
    c84 84 84a | T0cki=RA4 Int=RB0 | | RA4 |
    628 628a 648a | T0cki=RA4 Int=RB0 T1cki=RB6 Ccp1=RB3 Tx=RB2! Rx=RB1! C1out=RA3 C2out=RA4 | RA0 RA1 RA2 RA3 | RA4 | RA5
    818 819 | T0cki=RA4 Int=RB0 T1cki=RB6 Ccp1=RB2 Sck=RB4 Sdi=RB1 Sdo=RB2 Ss=RB5 | RA0 RA1 RA2 RA3 RA4 | | RA5
    87 | T0cki=RA4 Int=RB0 T1cki=RB6 Ccp1=RB0 Tx=RB5! Rx=RB2! Sck=RB4 Sdi=RB1 Sdo=RB2 Ss=RB5 C1out=RA3 C2out=RA4 | RA0 RA1 RA2 RA3 | | RA5
    88 | T0cki=RA4 Int=RB0 T1cki=RB6 Ccp1=RB0 Tx=RB5! Rx=RB2! Sck=RB4 Sdi=RB1 Sdo=RB2 Ss=RB5 C1out=RA3 C2out=RA4 | RA0 RA1 RA2 RA3 RA4 RB6 RB7 | | RA5
    870 | T0cki=RA4 Int=RB0 T1cki=RC0 Ccp1=RC2 Tx=RC6! Rx=RC7! | RA0 RA1 RA2 RA3 RA5 | RA4 |
    871 | T0cki=RA4 Int=RB0 T1cki=RC0 Ccp1=RC2 Tx=RC6! Rx=RC7! Rd=RE0 Wr=RE1 Cs=RE2 | RA0 RA1 RA2 RA3 RA5 RE0 RE1 RE2 | RA4 |
    872 | T0cki=RA4 Int=RB0 T1cki=RC0 Ccp1=RC2 Sck=RC3 Sdi=RC4 Sdo=RC5 Ss=RA5 | RA0 RA1 RA2 RA3 RA5 | RA4 |
    873 876 | T0cki=RA4 Int=RB0 T1cki=RC0 Ccp1=RC2 Ccp2=RC1 Tx=RC6! Rx=RC7! Sck=RC3 Sdi=RC4 Sdo=RC5 Ss=RA5 | RA0 RA1 RA2 RA3 RA5 | RA4 |
    873a 876a | T0cki=RA4 Int=RB0 T1cki=RC0 Ccp1=RC2 Ccp2=RC1 Tx=RC6! Rx=RC7! Sck=RC3 Sdi=RC4 Sdo=RC5 Ss=RA5 C1out=RA4 C2out=RA5 | RA0 RA1 RA2 RA3 RA5 | RA4 |
    874 877 | T0cki=RA4 Int=RB0 T1cki=RC0 Ccp1=RC2 Ccp2=RC1 Tx=RC6! Rx=RC7! Sck=RC3 Sdi=RC4 Sdo=RC5 Ss=RA5 Rd=RE0 Wr=RE1 Cs=RE2 | RA0 RA1 RA2 RA3 RA5 RE0 RE1 RE2 | RA4 |
    874a 877a | T0cki=RA4 Int=RB0 T1cki=RC0 Ccp1=RC2 Ccp2=RC1 Tx=RC6! Rx=RC7! Sck=RC3 Sdi=RC4 Sdo=RC5 Ss=RA5 C1out=RA4 C2out=RA5 Rd=RE0 Wr=RE1 Cs=RE2 | RA0 RA1 RA2 RA3 RA5 RE0 RE1 RE2 | RA4 |
";

/// Chips, configuration word, oscillator, bits of port A that are ports, power-up timer (by PWRTE or BOREN),
/// pin of CCP1 by CCPMX, program words that the program may write, if it can write any.
const CONFIG: &str = "
    873 | 3FFF | Rc       | 00 | on  | -   | 0-FFF
    873 | 3FBF | Rc       | 00 | off | -   | 0-FFF
    873 | 3FBC | Lp       | 00 | off | -   | 0-FFF
    873 | 3FB5 | Xt       | 00 | on  | -   | 0-FFF
    873 | 3DBF | Rc       | 00 | off | -   | -
    873 | 2FAF | Rc       | 00 | off | -   | 0-EFF
    873 | 1F9F | Rc       | 00 | off | -   | 0-7FF
    873 | 0F8F | Rc       | 00 | off | -   | -
    876 | 2FAF | Rc       | 00 | off | -   | 0-1EFF
    876 | 1F9F | Rc       | 00 | off | -   | 0-FFF
    872 | 0F8F | Rc       | 00 | off | -   | -
    873a | 3FBE | Hs      | 00 | off | -   | 0-FFF
    873a | 3DBF | Rc      | 00 | off | -   | 100-FFF
    873a | 3BBF | Rc      | 00 | off | -   | 400-FFF
    873a | 39BF | Rc      | 00 | off | -   | 800-FFF
    873a | 1DBF | Rc      | 00 | off | -   | 100-FFF
    877a | 3BBF | Rc      | 00 | off | -   | 800-1FFF
    877a | 39BF | Rc      | 00 | off | -   | 1000-1FFF
    84   | 3FF1 | Xt      | 00 | on  | -   | 0-3FF
    c84  | 3FF9 | Xt      | 00 | on  | -   | 0-3FF
    c84  | 3FF1 | Xt      | 00 | off | -   | 0-3FF
    628  | 3DAF | Ec      | 40 | off | -   | 0-7FF
    628  | 3DAC | Lp      | 00 | off | -   | 0-7FF
    628  | 3DBC | Internal| C0 | off | -   | 0-7FF
    628  | 3DBD | Internal| 80 | off | -   | 0-7FF
    628a | 21B6 | Rc      | 40 | on  | -   | 0-7FF
    818  | 3DBF | Rc      | 00 | off | RB2 | 200-3FF
    818  | 3BBF | Rc      | 00 | off | RB2 | -
    819  | 2BBF | Rc      | 00 | off | RB3 | 400-7FF
    819  | 39BF | Rc      | 00 | off | RB2 | 600-7FF
    88   | 3FBF | Rc      | 00 | off | RB0 | 0-FFF
    88   | 2DBF | Rc      | 00 | off | RB3 | 100-FFF
    88   | 3BB8 | Internal| C0 | off | RB0 | 800-FFF
    88   | 39B7 | Rc      | 00 | on  | RB0 | -
";

/// Chips, then minimum, typical and maximum of: watchdog, power-up timer, byte of EEPROM, program memory
/// (milliseconds).
const TIMES: &str = "
    84 c84 | 7 18 33 | 28 72 132 | 10 10 20 | -
    84a | 7 18 33 | 28 72 132 | 4 4 8 | -
    c71 | 7 18 33 | 28 72 132 | - | -
    628 628a 648a | 7 18 33 | 28 72 132 | 4 4 8 | -
    818 819 87 88 | 13.6 16 18.4 | 61.2 72 82.8 | 4 4 8 | 2 2 4
    870 871 872 873 874 876 877 873a 874a 876a 877a | 7 18 33 | 28 72 132 | 4 4 8 | 4 4 8
";

fn cells(line: &str) -> Vec<&str> {
    line.split('|').map(str::trim).collect()
}

fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().map(str::trim).filter(|l| !l.is_empty())
}

/// Expands a short name: `84a` is pic16f84a, `c84` is pic16c84.
fn short(name: &str) -> &'static Pic16Part {
    let whole = if name.starts_with('c') { format!("pic16{name}") } else { format!("pic16f{name}") };
    part(&whole).unwrap_or_else(|| panic!("{name}"))
}

/// Returns every chip with its line of a table, whose first cell names chips. Checks that no chip is missing
/// or named twice.
fn table(text: &'static str) -> Vec<(&'static Pic16Part, Vec<&'static str>)> {
    let mut all = Vec::new();
    for line in lines(text) {
        let cells = cells(line);
        all.extend(cells[0].split_whitespace().map(|n| (short(n), cells[1..].to_vec())));
    }
    let names: BTreeSet<_> = all.iter().map(|(p, _)| p.chip.name).collect();
    assert_eq!((names.len(), all.len()), (PIC16_PARTS.len(), PIC16_PARTS.len()));
    all
}

fn hex(text: &str) -> u16 {
    u16::from_str_radix(text, 16).unwrap_or_else(|e| panic!("{text}: {e}"))
}

fn pin(part: &Pic16Part, id: PinId) -> &'static str {
    part.chip.pins.get(usize::from(id)).map_or("-", |p| p.name)
}

#[test]
fn chips_have_what_their_sheets_promise() {
    assert_eq!(lines(CHIPS).count(), PIC16_PARTS.len());
    for (line, part) in lines(CHIPS).zip(PIC16_PARTS) {
        let (c, want) = (&part.chip, cells(line));
        assert_eq!((c.name, c.data_sheet, c.family), (want[0], want[1], ChipFamily::Pic16), "{line}");
        let sizes = [c.flash_bytes / 0x800, c.on_chip_flash_bytes / 0x800, c.ram_len.into(), c.eeprom_bytes.into()];
        assert_eq!(sizes.map(|n| n.to_string()), [want[2], want[2], want[3], want[4]], "{line}");
        assert_eq!(c.max_hz / 1_000_000, want[6].parse::<u64>().unwrap(), "{line}");
        assert_eq!(part.device_id, (want[7] != "-").then(|| hex(want[7])), "{line}");
        for text in [c.name[3..].to_uppercase(), format!("{}K words", want[2]), format!("{} pins", want[5])] {
            assert!(c.title.contains(&text), "{line}: {}", c.title);
        }
        let has = [
            ("bor", part.config.boren != 0),
            ("flash", matches!(part.memory, NonvolatileKind::Word | NonvolatileKind::Block4 | NonvolatileKind::Row32)),
            ("ccp1", part.ccps >= 1 && part.timers),
            ("ccp2", part.ccps == 2),
            ("ssp", part.ssp == SspKind::Basic),
            ("mssp", matches!(part.ssp, SspKind::Master | SspKind::MasterStretch)),
            ("usart", part.usart),
            ("adc", part.adc != emu_pic16::chips::Pic16AdcKind::None),
            ("comparators", part.comparators != ComparatorKind::None),
            ("psp", part.psp),
        ];
        for (name, has) in has {
            assert_eq!(has, want[8].split_whitespace().any(|w| w == name), "{line}: {name}");
        }
    }
}

#[test]
fn names_are_found() {
    assert_eq!(part("PIC16F873").map(|p| p.chip.name), Some("pic16f873"));
    assert_eq!(chip("pic16F877a").map(|c| c.eeprom_bytes), Some(256));
    assert!(part("16f873").is_none() && chip("pic16f875").is_none());
    assert_eq!(chips().map(|c| c.name).collect::<BTreeSet<_>>().len(), PIC16_PARTS.len());
}

#[test]
fn ram_is_where_the_figures_show_it() {
    for (part, want) in table(RAM_MAP) {
        let mut map = [None; 0x200];
        for range in want[0].split_whitespace() {
            let (addrs, kept) = range.split_once('=').map_or((range, None), |(a, k)| (a, Some(hex(k))));
            let (first, last) = addrs.split_once('-').map(|(a, b)| (hex(a), hex(b))).unwrap();
            for addr in first..=last {
                map[usize::from(addr)] = Some(kept.unwrap_or(first) + addr - first);
            }
        }
        for addr in 0..0x200_u16 {
            let ram = match part.file_slot(addr) {
                FileSlot::Ram(kept) => Some(kept),
                _ => None,
            };
            assert_eq!(ram, map[usize::from(addr)], "{} {addr:X}", part.chip.name);
        }
        let own: BTreeSet<_> = map.iter().flatten().collect();
        assert_eq!(own.len(), usize::from(part.chip.ram_len), "{}", part.chip.name);
        assert_eq!(own.first().map(|a| **a), Some(part.chip.ram_start), "{}", part.chip.name);
    }
}

#[test]
fn registers_are_in_the_banks_of_the_figures() {
    for part in PIC16_PARTS {
        let text = if part.timers { MIRRORS } else { MIRRORS_84 };
        let rows: Vec<Vec<&str>> = text.split(['|', '\n']).map(|r| r.split_whitespace().collect()).collect();
        for reg in part.chip.regs {
            let here = |addr: &u16| part.file_slot(*addr) == part.file_slot(reg.addr);
            let at: Vec<_> = (0..0x200).filter(here).collect();
            let want = rows.iter().find(|r| r.first() == Some(&reg.name));
            let want = want.map_or(vec![reg.addr], |r| r[1..].iter().map(|a| hex(a)).collect());
            assert_eq!(at, want, "{} {}", part.chip.name, reg.name);
        }
    }
}

#[test]
fn packages_are_as_drawn() {
    for (part, want) in table(PACKAGES) {
        let drawn: Vec<_> = want[0].split_whitespace().collect();
        for (i, name) in drawn.iter().enumerate() {
            let at: Vec<_> = part.chip.pins.iter().filter(|p| usize::from(p.dip) == i + 1).map(|p| p.name).collect();
            assert_eq!(at.join(" "), if *name == "-" { "" } else { name }, "{} pin {}", part.chip.name, i + 1);
        }
        assert_eq!(part.chip.pins.len(), drawn.iter().filter(|n| **n != "-").count(), "{}", part.chip.name);
        assert!(part.chip.title.contains(&format!("{} pins", drawn.len())), "{}", part.chip.name);
        let order: Vec<_> = part.chip.pins.iter().map(|p| p.name).filter(|n| *n != "MCLR").collect();
        assert!(order.is_sorted(), "{}: {order:?}", part.chip.name);
        assert_eq!(pin(part, part.mclr), if drawn.contains(&"MCLR") { "MCLR" } else { "RA5" }, "{}", part.chip.name);
    }
}

#[test]
fn lines_reach_their_pins() {
    for (part, want) in table(LINES) {
        let mut lines = part.lines.to_vec();
        lines.sort_by_key(|l| l.line as u8);
        let ours: Vec<_> = lines
            .iter()
            .map(|l| format!("{:?}={}{}", l.line, pin(part, l.pin), if l.over_tris { "!" } else { "" }))
            .collect();
        assert_eq!(ours.join(" "), want[0], "{}", part.chip.name);
        let analog: Vec<_> = part.analog.iter().map(|&id| pin(part, id)).collect();
        assert_eq!(analog.join(" "), want[1], "{}", part.chip.name);
        let bits = |mask: fn(&emu_pic16::chips::PortPins) -> u8| {
            let pins =
                part.ports.iter().flat_map(|p| (0..8).filter(move |&b| mask(p) >> b & 1 == 1).map(|b| p.pins[b]));
            pins.map(|id| pin(part, id)).collect::<Vec<_>>().join(" ")
        };
        assert_eq!((bits(|p| p.open), bits(|p| p.inputs)), (want[2].into(), want[3].into()), "{}", part.chip.name);
        for l in part.lines {
            assert_eq!(part.line(l.line), Some(l), "{}", part.chip.name);
        }
    }
}

#[test]
fn configuration_words_say_what_the_registers_say() {
    for line in lines(CONFIG) {
        let want = cells(line);
        let (part, word) = (short(want[0]), hex(want[1]));
        let c = &part.config;
        assert_eq!(format!("{:?}", c.oscillator_mode(word)), want[2], "{line}");
        assert_eq!(format!("{:02X}", c.ports_of_oscillator(word)), want[3], "{line}");
        assert_eq!(c.has_power_up_timer(word), want[4] == "on", "{line}");
        assert_eq!(c.ccp1(word).map_or("-", |id| pin(part, id)), want[5], "{line}");
        let (first, last) =
            want[6].split_once('-').filter(|w| !w.0.is_empty()).map_or((1, 0), |(a, b)| (hex(a), hex(b)));
        for addr in 0..u16::try_from(part.chip.flash_bytes / 2).unwrap() {
            assert_eq!(c.may_write(word, addr), (first..=last).contains(&addr), "{line}: {addr:X}");
        }
    }
}

#[test]
fn times_are_those_of_the_tables() {
    let us =
        |text: &str| text.split_whitespace().map(|n| (n.parse::<f64>().unwrap() * 1000.0) as u32).collect::<Vec<_>>();
    for (part, want) in table(TIMES) {
        let t = &part.times;
        for (ours, want) in [t.wdt, t.pwrt, t.eeprom, t.flash].iter().zip(want).filter(|(_, w)| *w != "-") {
            assert_eq!(ours.as_slice(), us(want), "{}", part.chip.name);
        }
        assert_eq!(t.adc_rc_ns, [2_000, 4_000, 6_000], "{}", part.chip.name);
    }
}

/// The bits of the flags have the names of the flags, and the bits of the enables the names with E instead of
/// F at the end (and INTE for INTIE).
#[test]
fn flags_are_at_the_bits_of_their_names() {
    for part in PIC16_PARTS {
        let called = |SfrBitPlace { sfr, bit }: SfrBitPlace, name: &str| {
            part.bits.iter().any(|of| (of.sfr, of.name, of.bit) == (sfr, name, bit))
        };
        for f in part.flags {
            let name = format!("{:?}", f.flag);
            let names: &[&str] = match f.flag {
                InterruptFlag::T0IF => &["T0IF", "TMR0IF"],
                _ => &[&name],
            };
            let enable = |n: &&str| if *n == "INTF" { "INTE".to_string() } else { n.replace("IF", "IE") };
            assert!(names.iter().any(|n| called(f.at, n)), "{} {name}", part.chip.name);
            assert!(names.iter().any(|n| called(f.enable, &enable(n))), "{} {name}", part.chip.name);
            assert_eq!(f.peripheral, f.enable.sfr != Sfr::INTCON, "{} {name}", part.chip.name);
        }
        // PIE1 and PIE2 enable the flags in the same bits of PIR1 and PIR2, INTCON the flags three bits
        // below. At most one flag is in a register of its peripheral.
        let elsewhere = part.flags.iter().filter(|f| match f.at.sfr {
            Sfr::PIR1 => f.enable != SfrBitPlace { sfr: Sfr::PIE1, bit: f.at.bit },
            Sfr::PIR2 => f.enable != SfrBitPlace { sfr: Sfr::PIE2, bit: f.at.bit },
            Sfr::INTCON => f.enable != SfrBitPlace { sfr: Sfr::INTCON, bit: f.at.bit + 3 },
            _ => true,
        });
        assert!(elsewhere.count() <= 1, "{}", part.chip.name);
        let flags: BTreeSet<_> = part.flags.iter().map(|f| f.flag as u8).collect();
        assert_eq!(flags.len(), part.flags.len(), "{}", part.chip.name);
        let registers = [Sfr::PIR1, Sfr::PIR2];
        let named: BTreeSet<_> =
            part.bits.iter().filter(|b| registers.contains(&b.sfr)).map(|b| (b.sfr as u8, b.bit)).collect();
        let has = part.flags.iter().filter(|f| registers.contains(&f.at.sfr)).count();
        assert_eq!(has, named.len(), "{}: a bit of PIR1 or PIR2 without a flag", part.chip.name);
    }
}

#[test]
fn rows_are_consistent() {
    for part in PIC16_PARTS {
        let c = &part.chip;
        let at: BTreeSet<_> = part.sfr.iter().map(|s| s.0).collect();
        assert_eq!(at.len(), part.sfr.len(), "{}: two registers at one address", c.name);
        let places = part.file_slots();
        for addr in 0..0x200_u16 {
            let holds = part.chip.ram_ranges.iter().filter(|r| r.first <= addr && addr <= r.last).count();
            assert!(holds + usize::from(at.contains(&addr)) <= 1, "{} {addr:X}", c.name);
            assert_eq!(places[usize::from(addr)], part.file_slot(addr), "{} {addr:X}", c.name);
            assert_eq!(part.file_slot(addr + 0x200), part.file_slot(addr), "{} {addr:X}", c.name);
            if let FileSlot::Ram(kept) = part.file_slot(addr) {
                assert_eq!(part.file_slot(kept), FileSlot::Ram(kept), "{} {addr:X}", c.name);
            }
        }
        let registers: BTreeSet<_> = part.sfr.iter().map(|s| s.1 as u8).collect();
        let names: BTreeSet<_> = c.regs.iter().map(|r| r.name).collect();
        assert_eq!((c.regs.len(), names.len()), (registers.len(), registers.len()), "{}", c.name);
        assert!(c.regs.is_sorted_by_key(|r| r.addr), "{}", c.name);
        for r in c.regs {
            let FileSlot::Sfr(sfr) = part.file_slot(r.addr) else { panic!("{} {}", c.name, r.name) };
            assert!(part.has(sfr) && part.addr(sfr) == Some(r.addr), "{} {}", c.name, r.name);
        }
        let bits: BTreeSet<_> = part.bits.iter().map(|b| (b.sfr as u8, b.name)).collect();
        assert_eq!(bits.len(), part.bits.len(), "{}: a bit twice", c.name);
        assert!(part.bits.iter().all(|b| part.has(b.sfr) && b.bit < 8), "{}: a bit of nothing", c.name);

        let pins: BTreeSet<_> = c.pins.iter().map(|p| p.name).collect();
        assert_eq!(pins.len(), c.pins.len(), "{}", c.name);
        let mut ports = 0;
        for port in part.ports {
            assert!(part.has(port.port) && part.has(port.tris), "{}", c.name);
            for (bit, &id) in port.pins.iter().enumerate().filter(|(_, id)| **id != NO_PIN) {
                ports += 1;
                assert_eq!(pin(part, id), format!("R{}{bit}", &port.port.name()[4..]), "{}", c.name);
                let named =
                    part.bits.iter().any(|b| *b == SfrBit { sfr: port.port, name: pin(part, id), bit: bit as u8 });
                assert!(named, "{} {}", c.name, pin(part, id));
                let note = c.pins[usize::from(id)].note;
                assert_eq!(note.contains("open drain"), port.open >> bit & 1 == 1, "{} {note}", c.name);
                assert_eq!(note.contains("input only"), port.inputs >> bit & 1 == 1, "{} {note}", c.name);
            }
        }
        assert_eq!(ports + usize::from(pins.contains("MCLR")), c.pins.len(), "{}", c.name);
        let noted = |id: PinId, word: &str| c.pins.get(usize::from(id)).is_some_and(|p| p.note.contains(word));
        assert!(part.analog.iter().enumerate().all(|(i, &id)| noted(id, &format!("AN{i}")) || !part.has(Sfr::ADCON0)));
        assert_eq!(part.config.lvp != 0, noted(part.config.pgm, "PGM"), "{}", c.name);
        assert_eq!(part.config.mclre != 0, noted(part.mclr, "MCLR"), "{}", c.name);
        let (mask, one, zero) = part.config.ccpmx;
        assert_eq!(mask != 0, noted(one, "CCP1") && noted(zero, "CCP1"), "{}", c.name);
    }
}

#[test]
fn configuration_masks_do_not_overlap() {
    for part in PIC16_PARTS {
        let c = &part.config;
        let masks = [c.fosc.0, c.wdte, c.pwrte.0, c.boren, c.mclre, c.lvp, c.ccpmx.0, c.cpd, c.cp, c.wrt.0];
        assert_eq!(masks.iter().sum::<u16>(), masks.iter().fold(0, |a, m| a | m), "{}", part.chip.name);
        assert_eq!(c.cp_first.0 & !c.cp, 0, "{}", part.chip.name);
        assert_eq!(c.words.len(), c.erased.len(), "{}", part.chip.name);
        assert!(c.erased.iter().all(|w| w & !0x3FFF == 0), "{}", part.chip.name);
        // Erased means unprotected, and every bit with a meaning is 1.
        assert_eq!(masks.iter().fold(0, |a, m| a | m) & !c.erased[0], 0, "{}", part.chip.name);
        assert_eq!(c.fcmen | c.ieso, if c.words.len() == 2 { 3 } else { 0 }, "{}", part.chip.name);
        for (mask, len) in [(c.fosc.0, c.fosc.1.len()), (c.wrt.0, c.wrt.1.len()), (c.cp_first.0, c.cp_first.1.len())] {
            assert_eq!(if mask == 0 { 0 } else { 1 << mask.count_ones() }, len, "{}", part.chip.name);
        }
        assert!(c.osc_ports.is_empty() || c.osc_ports.len() == c.fosc.1.len(), "{}", part.chip.name);
    }
}
