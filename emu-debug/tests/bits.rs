//! Memories of several kinds, and bits with addresses of their own, case by case in `bits.txt`: user
//! notation, and the accesses that are observed.

use emu_avr::chips::ATMEGA328P;
use emu_core::chip::{Chip, ChipSpace, NamedAddress, PinDef};
use emu_core::cpu::Probe;
use emu_core::image::SymbolAt;
use emu_debug::access_monitor::{AccessWatch, RamCheck};
use emu_debug::stimulus::PinAndLevel;
use emu_debug::stimulus::parse_pin_level;
use emu_debug::stop_condition::parse_condition;
use emu_debug::{AccessMonitor, AddressNames, InputError, StopCondition};
use emu_test_support::case_lines;

/// The memories of an 8052.
const CHIP: Chip = Chip {
    name: "test",
    code_space: "code",
    flash_bytes: 0x1_0000,
    ram_space: "idata",
    ram_start: 0,
    ram_len: 256,
    word_bytes: 1,
    reg_space: "sfr",
    regs: &[
        NamedAddress { name: "TCON", addr: 0x88 },
        NamedAddress { name: "TL0", addr: 0x8A },
        NamedAddress { name: "P1", addr: 0x90 },
    ],
    bits: &[NamedAddress { name: "TF0", addr: 0x8D }],
    pins: &[PinDef { name: "P1.0", dip: 1, note: "" }, PinDef { name: "RST", dip: 9, note: "" }],
    packages: &[],
    spaces: &[
        ChipSpace::new("code", 0x1_0000, 1),
        ChipSpace::new("idata", 256, 1),
        ChipSpace::new("sfr", 256, 1),
        ChipSpace::new("xdata", 0x1_0000, 1),
        ChipSpace::new("bit", 256, 1),
    ],
    observable_spaces: &[("idata", 0), ("sfr", 0), ("xdata", 0), ("bit", 0)],
    ..ATMEGA328P
};

/// Parses `write idata:0x20 read bit:3` as watches in order, executes an access such as `write bit:0=1`, and
/// returns what was observed.
fn seen(waits: &str, done: &str) -> String {
    let names = AddressNames { chip: &CHIP, symbols: &[] };
    let mut watches = Vec::new();
    let trap = waits.trim() == "trap";
    if !trap {
        match parse_condition(&names, waits) {
            Ok(StopCondition::Read(range)) => watches.push(AccessWatch { range, write: false }),
            Ok(StopCondition::Write(range)) => watches.push(AccessWatch { range, write: true }),
            other => panic!("{waits}: {other:?}"),
        }
    }
    let ram = RamCheck { canonical_address: &|addr| (addr < 256).then_some(addr), initialized: &[] };
    let mut close = AccessMonitor::new(&CHIP, watches, trap.then_some(&ram));
    for (i, access) in done.split(',').map(str::trim).enumerate() {
        let (word, rest) = access.split_once(' ').expect("read or write");
        let (place, value) = rest.split_once('=').expect("a value");
        let range = names.parse_range(place).expect("a place");
        let space = CHIP.space_index(range.space).expect("a memory");
        let stop = close.on_data_access(0, space, range.start as u16, value.parse().expect("a byte"), word == "write");
        assert_eq!(stop, close.first_access.is_some() || close.unwritten_read.is_some());
        if let Some(a) = close.first_access {
            return format!("{i} {}:0x{:02x} {}", a.space, a.addr, a.value);
        }
        if let Some((_, fault)) = close.unwritten_read {
            return format!("{i} {fault}");
        }
    }
    "nothing".to_owned()
}

fn read(section: &str, text: &str) -> Result<String, InputError> {
    let symbol = |name: &str, space, addr| SymbolAt::new(name, space, addr, 1);
    let symbols = [
        symbol("_main", "code", 0x62),
        symbol("_flags", "idata", 0x21),
        symbol("_count", "idata", 0x30),
        symbol("_done", "bit", 0x09),
        symbol("_count", "xdata", 0x200),
    ];
    let names = AddressNames { chip: &CHIP, symbols: &symbols };
    match section {
        "range" => names.parse_range(text).map(|r| format!("{} {} {}", r.space, r.start, r.end)),
        "until" => parse_condition(&names, text).map(|u| u.describe(&names)),
        "pin" => parse_pin_level(&CHIP, text).map(|PinAndLevel { pin, level }| format!("{pin} {level:?}")),
        "near" => Ok(names.nearest_symbol(text.parse().expect("an address")).unwrap_or_default()),
        "seen" => {
            let (waits, done) = text.split_once('|').expect("waits | accesses");
            Ok(seen(waits, done.trim()))
        }
        other => panic!("no section {other}"),
    }
}

#[test]
fn readers_and_watches() {
    let (mut section, mut wrong, mut count) = ("", Vec::new(), 0);
    for line in case_lines(include_str!("bits.txt")) {
        if let Some(rest) = line.strip_prefix('[') {
            section = rest.split(']').next().unwrap_or_default();
            continue;
        }
        let (text, wanted) = line.rsplit_once("= ").expect("text = meaning");
        let found = read(section, text.trim_end());
        let same = match (&found, wanted.strip_prefix('!')) {
            (Err(error), Some(part)) => error.to_string().contains(part),
            (Ok(found), None) => found == wanted,
            _ => false,
        };
        count += 1;
        if !same {
            wrong.push(format!("[{section}] {line}\n    found {found:?}"));
        }
    }
    assert!(count > 50, "only {count} cases were read");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Every bit belongs to one byte, and that byte contains it: bits 00h to 7Fh are in bytes 20h to 2Fh, bits
/// 80h to FFh in the registers at multiples of 8.
#[test]
fn bits_and_bytes_agree() {
    for bit in 0..256u32 {
        let at = emu_debug::bit_space::byte_of_bit(&CHIP, bit).expect("a bit");
        assert_eq!(
            (at.space, at.byte * 8 + at.bit),
            if bit < 128 { ("idata", 256 + bit) } else { ("sfr", (bit - bit % 8) * 8 + bit % 8) }
        );
        let eight = emu_debug::bit_space::bits_of_byte(&CHIP, at.space, at.byte).expect("bits");
        assert_eq!(eight.start + at.bit, bit);
    }
    assert_eq!(emu_debug::bit_space::byte_of_bit(&CHIP, 256), None);
    assert_eq!(emu_debug::bit_space::byte_of_bit(&ATMEGA328P, 0), None);
    let with_bits =
        |space: &str| (0..256).filter(|&b| emu_debug::bit_space::bits_of_byte(&CHIP, space, b).is_some()).count();
    assert_eq!(["idata", "sfr", "xdata", "code", "bit"].map(with_bits), [16, 16, 0, 0, 0]);
}
