//! The EEPROM, and program memory written by the program: hand-made cases from the data sheets, and random
//! programs compared with a model that steps cycle by cycle.

mod model;
mod random;

use emu_pic16::chips::NonvolatileKind;
use emu_pic16::periph::eeprom::{FlashAccess, Pic16Eeprom};
use emu_pic16::periph::map::{InterruptFlag, Sfr};
use emu_pic16::periph::{Device, Pic16Outbox, Pic16Signal};
use emu_test_support::case_lines;

/// Returns the content of program memory.
fn word_at(addr: u16) -> u16 {
    addr ^ 0x1555
}

/// Answers the reads of program memory among the signals from `from` on.
fn answer(eeprom: &mut Pic16Eeprom, out: &Pic16Outbox, from: usize) {
    for signal in &out[from..] {
        if let Pic16Signal::FlashRead { addr } = signal {
            eeprom.flash_data(word_at(*addr));
        }
    }
}

fn text(signal: &Pic16Signal) -> String {
    let list = |words: &[u16]| words.iter().map(|w| format!("{w:04X}")).collect::<Vec<_>>().join(",");
    match signal {
        Pic16Signal::Flag { flag: InterruptFlag::EEIF, .. } => "EEIF".into(),
        Pic16Signal::FlashRead { addr } => format!("READ:{addr:04X}"),
        Pic16Signal::FlashWrite { addr, words } if words[..] == [0x3FFF; 32] => format!("ERASE:{addr:04X}"),
        Pic16Signal::FlashWrite { addr, words } => format!("WRITE:{addr:04X}={}", list(words)),
        Pic16Signal::FlashProgram { addr, words } => format!("PROGRAM:{addr:04X}={}", list(words)),
        Pic16Signal::Ignore { from, until } => format!("NOP:{from}-{until}"),
        Pic16Signal::Stall { until } => format!("STALL:{until}"),
        other => format!("{other:?}"),
    }
}

fn kind(name: &str) -> Option<NonvolatileKind> {
    use NonvolatileKind::{Block4, F62x, F84, None, Read, Row32, Word};
    [None, F84, F62x, Word, Block4, Read, Row32].into_iter().find(|k| format!("{k:?}") == name)
}

/// Runs one case; returns what is wrong with it as the error.
fn check(line: &str) -> Result<(), String> {
    let parts: Vec<&str> = line.split('|').map(str::trim).collect();
    let [name, done, seen] = parts[..] else { return Err("not three columns".into()) };
    let kind = kind(name.split(' ').next().unwrap()).ok_or("no such kind")?;
    let bytes: Vec<u8> = (0x40..0x80).collect();
    let mut eeprom =
        Pic16Eeprom::new(kind, &bytes, 1000, FlashAccess { words: 0x800, writable: 0x100..0x800, clocks: 2000 });
    let items = |text: &str| -> Vec<(u64, String, Option<u8>)> {
        let mut items = Vec::new();
        for item in text.split(';').map(str::trim).filter(|i| !i.is_empty()) {
            let words: Vec<&str> = item.split(' ').collect();
            let t = words[0].parse().unwrap();
            match words[1] {
                "key" => {
                    items.push((t, "EECON2".to_string(), Some(0x55)));
                    items.push((t + 8, "EECON2".to_string(), Some(0xAA)));
                }
                what => items.push((t, what.to_string(), words.get(2).map(|v| u8::from_str_radix(v, 16).unwrap()))),
            }
        }
        items
    };
    let (done, seen) = (items(done), items(seen));
    let register = |name: &str| Sfr::ALL.iter().copied().find(|r| r.name() == name).unwrap();
    let (mut reported, mut wrong) = (Vec::new(), Vec::new());
    for t in 0..=done.iter().chain(&seen).map(|i| i.0).max().unwrap_or(0) {
        let mut out = Pic16Outbox::new();
        let mut written = false;
        for (_, what, value) in done.iter().filter(|i| i.0 == t) {
            written = true;
            match what.as_str() {
                "SLEEP" => eeprom.stop_clock(t, &mut out),
                "RESET" => eeprom.reset(*value == Some(1), t, &mut out),
                reg => eeprom.write(register(reg), value.unwrap(), 0xFF, t, &mut out),
            }
        }
        if !written && eeprom.next_deadline() <= t {
            eeprom.run_due(t, &mut out);
        }
        answer(&mut eeprom, &out, 0);
        reported.extend(out.iter().map(|s| format!("{t} {}", text(s))));
        for (_, what, value) in seen.iter().filter(|i| i.0 == t) {
            let Some(value) = value else { continue };
            let got = match what.strip_prefix('@') {
                Some(cell) => eeprom.bytes()[usize::from_str_radix(cell, 16).unwrap()],
                None => eeprom.peek(register(what), t),
            };
            if got != *value {
                wrong.push(format!("{t}: {what} is {got:02X}, not {value:02X}"));
            }
        }
    }
    let expected: Vec<String> = seen.iter().filter(|i| i.2.is_none()).map(|i| format!("{} {}", i.0, i.1)).collect();
    if reported != expected {
        wrong.push(format!("signals {reported:?}, not {expected:?}"));
    }
    if wrong.is_empty() { Ok(()) } else { Err(wrong.join("; ")) }
}

#[test]
fn the_cases_of_the_data_sheets() {
    let lines: Vec<&str> = case_lines(include_str!("cases.txt")).collect();
    assert!(lines.len() >= 50, "{} cases", lines.len());
    let wrong: Vec<String> = lines.iter().filter_map(|l| check(l).err().map(|e| format!("{l}\n    {e}"))).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_wrong_case_is_found() {
    assert!(check("Word a | 4 EEADR 05; 8 EECON1 01 | 8 EEDATA 46").is_err());
    assert!(check("Word a | 12 EECON1 04; 20 key; 32 EECON1 06 | 1036 EECON1 04").is_err());
}

#[test]
fn cells_are_set_from_outside() {
    let mut eeprom = Pic16Eeprom::new(NonvolatileKind::Word, &[1, 2, 3], 1000, FlashAccess::default());
    eeprom.set_byte(1, 9);
    eeprom.set_byte(3, 9);
    assert_eq!(eeprom.bytes(), [1, 9, 3]);
}
