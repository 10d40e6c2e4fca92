//! The parsers of times, addresses, conditions and texts, case by case in `read.txt`.

use emu_avr::chips::ATMEGA328P;
use emu_core::image::{CONSTANT_SPACE, SymbolAt};
use emu_debug::stimulus::{ExternalDrive, parse_timed_drive};
use emu_debug::stop_condition::parse_condition;
use emu_debug::text_escapes::{escape, unescape};
use emu_debug::time::{parse_duration, parse_hertz};
use emu_debug::{AddressNames, CycleClock, InputError};
use emu_test_support::case_lines;

fn read(section: &str, text: &str) -> Result<String, InputError> {
    let symbol = |name: &str, space, addr| SymbolAt::new(name, space, addr, 2);
    let constant = |name: &str, value| symbol(name, CONSTANT_SPACE, value);
    let places = [
        symbol("main", "flash", 0x80),
        symbol("twin", "flash", 0x200),
        symbol("cell", "data", 0x104),
        symbol("twin", "data", 0x118),
        symbol("pair", "data", 0x120),
        symbol("pair", "data", 0x130),
        symbol("edge", "data", 0x8FF),
    ];
    let symbols = [constant("LAST", 0x120), constant("BIT", 5), constant("main", 7)].into_iter().chain(places);
    let symbols: Vec<SymbolAt> = symbols.collect();
    let names = AddressNames { chip: &ATMEGA328P, symbols: &symbols };
    match section {
        "cycles" | "moment" => {
            let (hz, rest) = text.split_once(' ').expect("Hz");
            let (per_cycle, text) = rest.split_once(' ').expect("clocks a cycle");
            let clock =
                CycleClock { hz: hz.parse().expect("Hz"), clocks_per_cycle: per_cycle.parse().expect("clocks") };
            match section {
                "cycles" => clock.parse_cycles(text).map(|c| c.to_string()),
                _ => clock.parse_moment(text).map(|time| format!("{} {}", time.cycle, time.phase)),
            }
        }
        "hertz" => parse_hertz(text).map(|hz| hz.to_string()),
        "duration" => parse_duration(text).map(|d| d.as_nanos().to_string()),
        "range" => names.parse_range(text).map(|r| format!("{} {} {}", r.space, r.start, r.end)),
        "until" => parse_condition(&names, text).map(|u| format!("{u:?}")),
        "drive" => parse_timed_drive(&ATMEGA328P, CycleClock { hz: 16_000_000, clocks_per_cycle: 1 }, text).map(|d| {
            match d.drive {
                ExternalDrive::Level(pin, level) => format!("{} 8*{}+{} {level:?}", d.at.cycle, pin / 8, pin % 8),
                ExternalDrive::Volts(pin, millivolts) => {
                    format!("{} 8*{}+{} {millivolts} mV", d.at.cycle, pin / 8, pin % 8)
                }
                ExternalDrive::Counts(pin, count) => format!("{} 8*{}+{} {count} counts", d.at.cycle, pin / 8, pin % 8),
                ExternalDrive::Supply(millivolts) => format!("{} {millivolts} mV", d.at.cycle),
            }
        }),
        "unescape" => unescape(text).map(|b| b.iter().map(|b| format!("{b:02x}")).collect::<Vec<_>>().join(" ")),
        other => panic!("no section {other}"),
    }
}

#[test]
fn readers() {
    let (mut section, mut wrong, mut count) = ("", Vec::new(), 0);
    for line in case_lines(include_str!("read.txt")) {
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
    assert!(count > 100, "only {count} cases were read");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Bytes that are escaped as text can be parsed back.
#[test]
fn escapes_come_back() {
    let all: Vec<u8> = (0..=255).collect();
    let text = escape(&all);
    let inner = text.strip_prefix('"').and_then(|t| t.strip_suffix('"')).expect("quotes");
    assert!(text.is_ascii());
    assert_eq!(unescape(inner), Ok(all));
}
