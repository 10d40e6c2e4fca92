//! Tests the named constants of the chips by themselves, and against the headers of avr-libc (`cargo test -p
//! emu-avr --test names -- --ignored`; needs avr-gcc and avr-libc).

use emu_core::NamedConstant;
use std::collections::{BTreeMap, BTreeSet};

use emu_avr::chips::{AVR_PARTS, AvrPart, part};

mod gcc;

use gcc::gcc;

/// Samples of each kind: chip, name, value.
const SOME: &str = "
    atmega328p  PORTB5          5
    atmega328p  PB5             5
    atmega328p  DDB5            5
    atmega328p  OCIE1A          1
    atmega328p  UDORD0          2
    atmega328p  RAMEND          0x8FF
    atmega328p  XRAMEND         0x8FF
    atmega328p  TCNT1           0x84
    atmega328p  ADCW            0x78
    atmega328p  SIGNATURE_2     0x0F
    atmega328   SIGNATURE_2     0x14
    atmega328p  FUSE_CKDIV8     0x7F
    atmega328p  HFUSE_DEFAULT   0xD9
    atmega168   EFUSE_DEFAULT   0xF9
    atmega48pa  BLB0_MODE_1     -
    atmega48pa  FUSE_SELFPRGEN  0xFE
    atmega88    SLEEP_MODE_PWR_SAVE 6
    atmega8     OCIE1A          4
    atmega8     PE              2
    atmega8     EFUSE_DEFAULT   -
    atmega8     SLEEP_MODE_EXT_STANDBY -
    atmega16    SLEEP_MODE_STANDBY 0xA0
    atmega32    SLEEP_MODE_STANDBY 0x60
    atmega128   SLEEP_MODE_STANDBY 0x14
    atmega128   XRAMEND         0xFFFF
    atmega128   PG4             4
    atmega128   PG5             -
    atmega128   ADFR            5
    atmega64    ADATE           5
    atmega162   PE3             -
    atmega162   UBRR0           -
    atmega162   TOV1            7
    atmega644   FUSE_JTAGEN     0xBF
    atmega644   PRUSART1        -
    atmega644   UBRR1           -
    atmega644   EEAR11          -
    atmega644p  PRUSART1        4
    atmega644p  JTD             7
    atmega644p  ISC21           5
    atmega164a  PCINT31         7
    atmega164a  RAMPZ0          -
    atmega1284p RAMPZ0          0
    atmega1284  TCNT3           0x94
    atmega1284  LFUSE_DEFAULT   0x62
    atmega1284  EEAR11          3
";

fn number(text: &str) -> i32 {
    text.strip_prefix("0x").map_or_else(|| text.parse(), |hex| i32::from_str_radix(hex, 16)).expect("a number")
}

fn names(part: &AvrPart) -> BTreeMap<&'static str, i32> {
    (part.chip.constants)().into_iter().map(|one| (one.name, one.value)).collect()
}

#[test]
fn some_names_and_their_values() {
    for line in SOME.lines().filter(|line| !line.trim().is_empty()) {
        let &[chip, name, value] = &line.split_whitespace().collect::<Vec<_>>()[..] else { panic!("{line}") };
        let ours = names(part(chip).expect("a chip")).get(name).copied();
        assert_eq!(ours, (value != "-").then(|| number(value)), "{line}");
    }
}

/// No name has two meanings, and none is the name of a register.
#[test]
fn names_are_clear() {
    for part in AVR_PARTS {
        let all = (part.chip.constants)();
        let once = names(part);
        assert!(all.len() > 300, "{}: {} names", part.chip.name, all.len());
        for NamedConstant { name, value } in all {
            assert_eq!(once.get(name), Some(&value), "{}: {name}", part.chip.name);
            assert_eq!(part.chip.reg(name), None, "{}: {name}", part.chip.name);
            assert!(name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_'), "{name}");
        }
    }
}

/// Names of the headers that are left out: the name, its end after `*`, or its beginning before `*`; then the
/// reason.
const LEFT_OUT: &str = "
    *_vect_num            numbers of vectors: the names of the vectors are in the row
    *_BIT                 the bit of a pin by each of its functions: only the header of the ATmega88PA has them
    _AVR*                 guards of the headers
    _UBRR*                guards of the headers
    _SFR_ASM_COMPAT       how the headers themselves are read
    _HAVE_AVR*            how the headers themselves are read
    _EEPROM_REG_LOCATIONS_ how avr-libc finds its functions
    EEPROM_REG_LOCATIONS  how avr-libc finds its functions
    XRAMSTART             only the headers of the ATmega324PA and 644PA have it, as 0
    XRAMSIZE              only the header of the ATmega88PA has it, as 0
    SP1*                  bits of SPH counted from SPL: only the header of the ATmega162 has them
    SP8                   the same
    SP9                   the same
";

/// Chips, name, the header's value, and the reason why the value of this crate differs.
const OTHERWISE: &str = "
    328p 328 168p 88p 48p | TWAM6 | 6 | the sheet (22.9.6) has TWAM6 to TWAM0 in bits 7 to 1
    328p 328 168p 88p 48p | TWAM5 | 5 | the same
    328p 328 168p 88p 48p | TWAM4 | 4 | the same
    328p 328 168p 88p 48p | TWAM3 | 3 | the same
    328p 328 168p 88p 48p | TWAM2 | 2 | the same
    328p 328 168p 88p 48p | TWAM1 | 1 | the same
    328p 328 168p 88p 48p | TWAM0 | 0 | the same
    48p | BLB0_MODE_1 | 0xff | there is no boot section, so no such lock bits (28.1)
    48p | BLB0_MODE_2 | 0xfb | there is no boot section, so no such lock bits (28.1)
    48p | BLB0_MODE_3 | 0xf3 | there is no boot section, so no such lock bits (28.1)
    48p | BLB0_MODE_4 | 0xf7 | there is no boot section, so no such lock bits (28.1)
    48p | BLB1_MODE_1 | 0xff | there is no boot section, so no such lock bits (28.1)
    48p | BLB1_MODE_2 | 0xef | there is no boot section, so no such lock bits (28.1)
    48p | BLB1_MODE_3 | 0xcf | there is no boot section, so no such lock bits (28.1)
    48p | BLB1_MODE_4 | 0xdf | there is no boot section, so no such lock bits (28.1)
    164a | SIGNATURE_2 | 0x0a | the headers of the ATmega164A and 164P have each other's signature (8272 and 8011, signature bytes)
    164p | SIGNATURE_2 | 0x0f | the same
    164a 164p 324pa 644 644a 644p 644pa 1284p | LFUSE_DEFAULT | 0x42 | SUT is 10 at delivery (8272, fuse bits), not 00
    1284p | HFUSE_DEFAULT | 0x9d | BOOTSZ is 00 at delivery (8272, fuse bits), not 10
    644pa 1284p | SPDR0 | 0 | bit 0 of SPDR: other headers name the register itself SPDR0
    162 | SLEEP_MODE_IDLE | 0 | a number of avr-libc's own: the bits are in three registers
    162 | SLEEP_MODE_ADC | 3 | a number of avr-libc's own: the bits are in three registers
    162 | SLEEP_MODE_PWR_DOWN | 1 | a number of avr-libc's own: the bits are in three registers
    162 | SLEEP_MODE_PWR_SAVE | 2 | a number of avr-libc's own: the bits are in three registers
    162 | SLEEP_MODE_EXT_STANDBY | 5 | the same
    162 | SLEEP_MODE_STANDBY | 4 | a number of avr-libc's own: the bits are in three registers
";

/// Names that no header of the chip's data sheet has, with the reason.
const OURS: &str = "
    FLASHSTART    only newer headers have it
    E2START       only newer headers have it
    E2SIZE        only newer headers have it
    E2PAGESIZE    only newer headers have it
    RAMSIZE       only newer headers have it
    _VECTOR_SIZE  only newer headers have it
    LFUSE_DEFAULT the header of the ATmega644 has another value (see above)
    SIGNATURE_2   the header of the ATmega164A has another value (see above)
    SRW           an older name of SRW10: the header of the ATmega128 has it
";

fn left_out(name: &str) -> bool {
    LEFT_OUT.lines().filter_map(|line| line.split_whitespace().next()).any(|pattern| {
        match (pattern.strip_prefix('*'), pattern.strip_suffix('*')) {
            (Some(end), _) => name.ends_with(end),
            (_, Some(start)) => name.starts_with(start),
            _ => name == pattern,
        }
    })
}

fn otherwise(mcu: &str, name: &str, theirs: i32) -> bool {
    OTHERWISE.lines().map(|line| line.split('|').map(str::trim).collect::<Vec<_>>()).any(|row| match row[..] {
        [chips, bit, value, _] => {
            bit == name && number(value) == theirs && chips.split(' ').any(|chip| mcu == format!("atmega{chip}"))
        }
        _ => false,
    })
}

/// Returns all macros of the header that are numbers.
fn header(mcu: &str) -> BTreeMap<String, i32> {
    let macros = |source: &str| -> BTreeSet<String> {
        let text = gcc(mcu, &["-E", "-dM", "-x", "c", "-"], source);
        let defined = text.lines().filter_map(|line| line.strip_prefix("#define ")?.split_once(' '));
        defined.map(|(name, _)| name.to_owned()).filter(|name| !name.contains('(')).collect()
    };
    let without = macros("#include <inttypes.h>\n");
    let wanted: Vec<String> = macros("#include <avr/io.h>\n")
        .into_iter()
        .filter(|name| !without.contains(name) && !name.starts_with("__"))
        .collect();
    let mut source = "#include <avr/io.h>\n".to_owned();
    wanted.iter().enumerate().for_each(|(n, name)| source += &format!("@@ {n} {name}\n"));
    let expanded = gcc(mcu, &["-E", "-P", "-x", "c", "-"], &source);
    // Macros that consist only of numbers.
    let number = |text: &str| {
        let text = text.replace("unsigned char", "");
        text.starts_with(|first: char| first.is_ascii_digit() || first == '(')
            && text.chars().any(|c| c.is_ascii_digit())
            && !text.split(|c: char| !c.is_ascii_alphanumeric()).any(|word| {
                let hex = word.strip_prefix("0x").or_else(|| word.strip_prefix("0X"));
                let digits = hex.unwrap_or(word).trim_end_matches(['U', 'L', 'u', 'l']);
                !digits.bytes().all(|b| if hex.is_some() { b.is_ascii_hexdigit() } else { b.is_ascii_digit() })
            })
    };
    let mut ask = "void f(void) {\n".to_owned();
    for line in expanded.lines().filter_map(|line| line.strip_prefix("@@ ")) {
        let (n, text) = line.split_once(' ').unwrap_or((line, ""));
        if number(text) {
            ask += &format!("__asm__ volatile(\"@@ {n} %0\" :: \"i\"((long)({text})));\n");
        }
    }
    ask += "}\n";
    let listing = gcc(mcu, &["-S", "-o", "-", "-x", "c", "-"], &ask);
    let answers = listing.lines().filter_map(|line| line.trim().strip_prefix("@@ ")?.split_once(' '));
    answers
        .map(|(n, value)| (wanted[n.parse::<usize>().expect("a number")].clone(), value.parse().expect("a number")))
        .collect()
}

/// Every number that a header names is a constant of this crate, and every constant is in the header of some
/// chip with the same data sheet; not every header has all spellings.
#[test]
#[ignore = "needs avr-gcc and avr-libc"]
fn names_are_those_of_the_headers() {
    let headers: Vec<_> = AVR_PARTS.iter().map(|part| (*part, header(part.chip.name))).collect();
    let (mut wrong, mut count) = (Vec::new(), 0);
    for (part, header) in &headers {
        let (mcu, ours) = (part.chip.name, names(part));
        assert!(header.len() > 350, "{mcu}: {} names", header.len());
        for (name, theirs) in header {
            count += 1;
            if ours.get(name.as_str()) != Some(theirs) && !left_out(name) && !otherwise(mcu, name, *theirs) {
                wrong.push(format!("{mcu}: {name} is {theirs:#x} in the header, ours {:x?}", ours.get(name.as_str())));
            }
        }
        let sheet = || headers.iter().filter(|other| other.0.chip.data_sheet == part.chip.data_sheet);
        for (name, value) in ours {
            let known = sheet().any(|other| other.1.get(name) == Some(&value));
            let pair = part.chip.reg(&format!("{name}L")).is_some() || name == "ADCW";
            let listed = OURS.lines().any(|line| line.split_whitespace().next() == Some(name));
            if !known && !pair && !listed {
                wrong.push(format!("{mcu}: no header has {name} as {value:#x}"));
            }
        }
    }
    println!("{} chips, {count} names", AVR_PARTS.len());
    assert!(wrong.is_empty(), "{} differences\n{}", wrong.len(), wrong.join("\n"));
}
