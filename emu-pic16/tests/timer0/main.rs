//! Timer 0, its prescaler and the watchdog: hand-made cases from the data sheets, and random programs
//! compared with a model that steps clock by clock.

mod model;
mod random;

use emu_pic16::periph::map::{InterruptFlag, Pic16Line, Sfr};
use emu_pic16::periph::timer0::Timer0;
use emu_pic16::periph::{Device, Pic16Outbox, Pic16Signal};
use emu_test_support::case_lines;

fn register(name: &str) -> Option<Sfr> {
    Sfr::ALL.iter().copied().find(|r| r.name() == name)
}

/// Runs one case; returns what is wrong with it as the error.
fn check(line: &str) -> Result<(), String> {
    let parts: Vec<&str> = line.split('|').map(str::trim).collect();
    let [name, done, seen] = parts[..] else { return Err("not three columns".into()) };
    let mut timer = match name.split(' ').collect::<Vec<_>>()[..] {
        ["wdt", n, ..] => Timer0::new(true, n.parse().unwrap(), false),
        ["con", n, ..] => Timer0::new(false, n.parse().unwrap(), true),
        _ => Timer0::new(false, 100, false),
    };
    let items = |text: &str| -> Vec<(u64, String, Option<u8>)> {
        text.split(';')
            .map(str::trim)
            .filter(|item| !item.is_empty())
            .map(|item| {
                let mut words = item.split(' ');
                let clock = words.next().unwrap().parse().unwrap();
                let what = words.next().unwrap().to_string();
                (clock, what, words.next().map(|v| u8::from_str_radix(v, 16).unwrap()))
            })
            .collect()
    };
    let (done, seen) = (items(done), items(seen));
    let end = done.iter().chain(&seen).map(|i| i.0).max().unwrap_or(0);
    let mut out = Pic16Outbox::new();
    let mut wrong = Vec::new();
    for t in 0..=end {
        for (_, what, value) in done.iter().filter(|i| i.0 == t) {
            let value = value.unwrap();
            match what.as_str() {
                "T0CKI" => timer.on_line_changed(Pic16Line::T0cki, value != 0, t, &mut out),
                "SLEEP" => timer.stop_clock(t, &mut out),
                "WAKE" => timer.restart_clock(t, &mut out),
                "CLRWDT" => timer.clear_watchdog(t, &mut out),
                "RESET" => timer.reset(false, t, &mut out),
                reg => timer.write(register(reg).unwrap(), value, 0xFF, t, &mut out),
            }
        }
        for (_, what, value) in seen.iter().filter(|i| i.0 == t) {
            if let Some(value) = value {
                let got = timer.peek(register(what).unwrap(), t);
                if got != *value {
                    wrong.push(format!("{t}: {what} is {got:02X}, not {value:02X}"));
                }
            }
        }
        if timer.next_deadline() <= t {
            timer.run_due(t, &mut out);
        }
    }
    let reported: Vec<(u64, &str)> = out
        .iter()
        .map(|s| match s {
            Pic16Signal::Flag { t, flag: InterruptFlag::T0IF } => (*t, "T0IF"),
            Pic16Signal::Watchdog { t } => (*t, "WDT"),
            _ => (0, "another signal"),
        })
        .collect();
    let expected: Vec<(u64, &str)> = seen.iter().filter(|i| i.2.is_none()).map(|i| (i.0, i.1.as_str())).collect();
    if reported != expected {
        wrong.push(format!("signals {reported:?}, not {expected:?}"));
    }
    if wrong.is_empty() { Ok(()) } else { Err(wrong.join("; ")) }
}

#[test]
fn the_cases_of_the_data_sheets() {
    let lines: Vec<&str> = case_lines(include_str!("cases.txt")).collect();
    assert!(lines.len() >= 40, "{} cases", lines.len());
    let wrong: Vec<String> = lines.iter().filter_map(|l| check(l).err().map(|e| format!("{l}\n    {e}"))).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_wrong_case_is_found() {
    assert!(check("a | 4 OPTION 08; 40 TMR0 00 | 52 TMR0 00").is_err());
    assert!(check("a | 4 OPTION 08; 40 TMR0 FF | 52 TMR0 00").is_err());
}
