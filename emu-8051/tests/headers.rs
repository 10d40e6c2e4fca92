//! Compares the rows of the chips, and the bits that their registers keep, with the headers of the installed
//! SDCC. `cargo test -p plcemu-8051 --test headers -- --ignored`

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use emu_8051::Mcs51;
use emu_8051::chips::{MCS51_PARTS, Mcs51Part};
use emu_core::Cpu;
use emu_core::cpu::RamInit;
use emu_core::image::Image;

/// Directory of the headers in Debian's package `sdcc-libraries`.
const DIRECTORY: &str = "/usr/share/sdcc/include/mcs51";

/// Chips and the header that describes them.
const HEADERS: &str = "
    8031 8051 8751 80c51 | 8051.h
    8032 8052 8752       | 8052.h
    at89c51 at89s51      | at89x51.h
    at89c52 at89s52      | at89x52.h
    at89c2051 at89c4051  | at89x051.h
";

/// Chips, the difference, and why the row is right.
const EXCEPTIONS: &str = "
    8031 8051 8751 80c51 8032 8052 8752 at89c2051 at89c4051 | no bit F1 D1 | PSW.1 has no name; 272383, PSW
    at89c51 at89c52 at89s51 at89s52 | no bit FL D1      | PSW.1 has no name; 272383, PSW
    at89c51 at89c52 at89s51 at89s52 | no register A E0  | Keil's name of ACC
    8031 8051 8751 80c51 8032 8052 8752 at89c51 at89c52 at89s51 at89s52 at89c2051 at89c4051 | PSW has FF, ours FE  | P is the parity of ACC, here 0; 272383, PSW
    8031 8051 8751 80c51 8032 8052 8752 at89c51 at89c52 at89s51 at89s52 at89c2051 at89c4051 | SBUF has FF, ours 00 | a write starts sending, a read gives the received byte; 272383, serial interface
    8031 8051 8751 8032 8052 8752   | PCON has 8F, ours 80 | NMOS has SMOD only; 272383, PCON
    at89c2051 at89c4051 | no bit RD B7          | no external bus; 0368 and 1001, pin configuration
    at89c2051 at89c4051 | no bit WR B6          | no external bus; 0368 and 1001, pin configuration
    at89c2051 at89c4051 | P3 has FF, ours BF    | bit 6 is the output of the comparator, here 0; 0368 and 1001, pin description
    at89s51 at89s52     | register AUXR 8E      | not in the header of the AT89C; 2487 and 1919, table 5-1
    at89s51 at89s52     | register AUXR1 A2     | not in the header of the AT89C; 2487 and 1919, table 5-1
    at89s51 at89s52     | register WDTRST A6    | not in the header of the AT89C; 2487 and 1919, table 5-1
    at89s51 at89s52     | register DP0L 82      | not in the header of the AT89C; 2487 and 1919, table 5-1
    at89s51 at89s52     | register DP0H 83      | not in the header of the AT89C; 2487 and 1919, table 5-1
    at89s51 at89s52     | register DP1L 84      | not in the header of the AT89C; 2487 and 1919, table 5-1
    at89s51 at89s52     | register DP1H 85      | not in the header of the AT89C; 2487 and 1919, table 5-1
    at89s51 at89s52     | AUXR has 00, ours 19  | DISALE, DISRTO, WDIDLE; 2487 and 1919, AUXR
    at89s51 at89s52     | AUXR1 has 00, ours 01 | DPS; 2487 and 1919, AUXR1
    at89s51 at89s52     | DP1L has 00, ours FF  | the second data pointer; 2487 and 1919, dual data pointer registers
    at89s51 at89s52     | DP1H has 00, ours FF  | the second data pointer; 2487 and 1919, dual data pointer registers
    at89s51 at89s52     | PCON has 8F, ours 9F  | POF; 2487 and 1919, power-off flag
";

/// Content of a header.
#[derive(Default)]
struct Header {
    /// Registers by name.
    registers: BTreeMap<String, u16>,
    /// Bits by name, with their addresses in the memory `bit`.
    bits: BTreeMap<String, u16>,
    /// Named bits by register.
    masks: BTreeMap<String, u8>,
}

/// The first number with the prefix `0x` in a line.
fn number(line: &str) -> Option<u16> {
    let digits = line.split_once("0x")?.1;
    let end = digits.find(|c: char| !c.is_ascii_hexdigit()).unwrap_or(digits.len());
    u16::from_str_radix(&digits[..end], 16).ok()
}

impl Header {
    fn read(&mut self, file: &str) {
        let path = format!("{DIRECTORY}/{file}");
        let text = String::from_utf8_lossy(&fs::read(&path).unwrap_or_else(|e| panic!("{path}: {e}"))).into_owned();
        let mut of_bits = None;
        for line in text.lines() {
            let words: Vec<&str> = line.split(|c: char| c.is_whitespace() || "();".contains(c)).collect();
            let words: Vec<&str> = words.into_iter().filter(|word| !word.is_empty()).collect();
            match (&words[..], number(line)) {
                (["#include", file, ..], _) => self.read(file.trim_matches(['<', '>', '"'])),
                (["__sfr", "__at", _, name, ..], Some(at)) => _ = self.registers.insert((*name).to_owned(), at),
                (["__sbit", "__at", _, name, ..], Some(at)) => _ = self.bits.insert((*name).to_owned(), at),
                (["#undef", name, ..], _) => {
                    self.registers.remove(*name);
                    self.bits.remove(*name);
                }
                (["/*", name, "bits", "*/"], _) => of_bits = Some((*name).to_owned()),
                (["/*", ..], _) => of_bits = None,
                (["#define", _, value], Some(mask)) if value.starts_with("0x") => {
                    if let Some(register) = &of_bits {
                        *self.masks.entry(register.clone()).or_default() |= u8::try_from(mask).expect("a byte");
                    }
                }
                _ => {}
            }
        }
    }

    fn of(part: &Mcs51Part) -> Header {
        let mut lines = HEADERS.lines().filter_map(|line| line.split_once('|'));
        let (_, file) = lines
            .find(|(chips, _)| chips.split_whitespace().any(|chip| chip == part.chip.name))
            .unwrap_or_else(|| panic!("{} has no header", part.chip.name));
        let mut header = Header::default();
        header.read(file.trim());
        for (name, at) in &header.registers {
            let bits = header.bits.values().filter(|&&bit| bit & !7 == *at).fold(0, |mask, bit| mask | 1 << (bit & 7));
            if bits != 0 {
                header.masks.insert(name.clone(), bits);
            }
        }
        header
    }
}

/// The bits of a register that can be read as ones after a write of ones or of zeros to a copy of `fresh`.
fn kept_bits(fresh: &Mcs51, addr: u16) -> u8 {
    [0x00, 0xFF].into_iter().fold(0, |seen, value| {
        let mut cpu = fresh.clone();
        cpu.poke("sfr", addr.into(), value);
        seen | cpu.peek("sfr", addr.into()).unwrap_or(0)
    })
}

fn check_names(part: &Mcs51Part, header: &Header, found: &mut BTreeSet<String>) -> usize {
    let chip = &part.chip;
    for (name, &at) in header.registers.iter().filter(|(name, at)| chip.reg(name) != Some(**at)) {
        found.insert(format!("no register {name} {at:X}"));
    }
    for reg in chip.regs.iter().filter(|reg| header.registers.get(reg.name) != Some(&reg.addr)) {
        found.insert(format!("register {} {:X}", reg.name, reg.addr));
    }
    let constants: BTreeMap<_, _> = (part.chip.constants)().into_iter().map(|one| (one.name, one.value)).collect();
    for (name, &at) in &header.bits {
        // Pins and numbered bits have an underscore in place of the dot.
        let ours = chip.bit(name).or_else(|| chip.bit(&name.replace('_', ".")));
        let ours = ours.or_else(|| constants.get(name.as_str()).and_then(|&at| u16::try_from(at).ok()));
        let numbered =
            name.rsplit_once('_').and_then(|(register, bit)| Some(chip.reg(register)? + bit.parse::<u16>().ok()?));
        if ours.or(numbered) != Some(at) {
            found.insert(format!("no bit {name} {at:X}"));
        }
    }
    header.registers.len() + header.bits.len()
}

fn check_masks(part: &'static Mcs51Part, header: &Header, found: &mut BTreeSet<String>) {
    let fresh = Mcs51::new(&part.chip, &Image::default(), RamInit::Zero);
    for addr in 0x80..0x100 {
        let name = header.registers.iter().find(|(_, at)| **at == addr).map(|(name, _)| name.as_str());
        let theirs = name.map_or(0, |name| header.masks.get(name).copied().unwrap_or(0xFF));
        let ours = kept_bits(&fresh, addr);
        if ours != theirs {
            let ours_name = part.chip.regs.iter().find(|reg| reg.addr == addr).map(|reg| reg.name);
            let name = name.or(ours_name).map_or_else(|| format!("{addr:X}"), str::to_owned);
            found.insert(format!("{name} has {theirs:02X}, ours {ours:02X}"));
        }
    }
}

#[test]
#[ignore = "needs sdcc"]
fn rows_are_what_the_headers_say() {
    let mut expected: BTreeSet<(String, String)> = BTreeSet::new();
    for line in EXCEPTIONS.lines().filter(|line| !line.trim().is_empty()) {
        let &[chips, what, why] = &line.split('|').map(str::trim).collect::<Vec<_>>()[..] else { panic!("{line}") };
        assert!(!why.is_empty(), "{line}");
        for chip in chips.split(' ') {
            assert!(expected.insert((chip.to_owned(), what.to_owned())), "twice: {line}");
        }
    }
    let (mut all, mut count) = (BTreeSet::new(), 0);
    for part in MCS51_PARTS {
        let (header, mut found) = (Header::of(part), BTreeSet::new());
        count += check_names(part, &header, &mut found);
        check_masks(part, &header, &mut found);
        all.extend(found.into_iter().map(|what| (part.chip.name.to_owned(), what)));
    }
    let new: Vec<_> = all.difference(&expected).collect();
    let gone: Vec<_> = expected.difference(&all).collect();
    assert!(new.is_empty() && gone.is_empty(), "not in the list: {new:#?}\nno longer there: {gone:#?}");
    assert!(count > 1200, "{count} names were read");
}
