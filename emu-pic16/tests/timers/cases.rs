//! Runs the cases of `cases.txt`.

use emu_pic16::periph::map::{InterruptFlag, Pic16Line, Sfr};
use emu_pic16::periph::timers::{Pic16Timers, Timer1Crystal};
use emu_pic16::periph::{Device, Pic16Drive, Pic16Signal};

/// Formats a signal as the cases do.
fn text(signal: &Pic16Signal) -> String {
    match signal {
        Pic16Signal::Flag { t, flag } => format!("{flag:?}@{t}"),
        Pic16Signal::Drive { t, line, drive } => format!("{line:?}:{drive:?}@{t}"),
        Pic16Signal::Convert { t } => format!("Convert@{t}"),
        Pic16Signal::Timer2 { t } => format!("Timer2@{t}"),
        other => format!("{other:?}"),
    }
}

/// Executes what is due up to and including `to`, each at its own clock.
fn advance(timers: &mut Pic16Timers, to: u64, out: &mut Vec<Pic16Signal>) {
    while timers.next_deadline() <= to {
        timers.run_due(timers.next_deadline(), out);
    }
}

/// Returns a register by its name.
fn register(name: &str) -> Option<Sfr> {
    Sfr::ALL.iter().copied().find(|sfr| sfr.name() == name)
}

/// Runs the steps of a case; the error lists missing and unexpected signals.
fn case(steps: &str, said: &str) -> Result<(), String> {
    let (mut ccps, mut crystal) = (2, None);
    let mut todo = Vec::new();
    for token in steps.split_whitespace() {
        if let Some(n) = token.strip_prefix("ccps=") {
            ccps = n.parse().map_err(|_| format!("{token}: a number"))?;
        } else if let Some((osc, hz)) = token.strip_prefix("crystal=").and_then(|c| c.split_once('/')) {
            crystal = Some((osc.parse().map_err(|_| "hertz")?, hz.parse().map_err(|_| "hertz")?));
        } else {
            let (what, t) = token.split_once('@').ok_or(format!("{token}: no clock"))?;
            let t: u64 = t.parse().map_err(|_| format!("{token}: a clock"))?;
            todo.push((t, what));
        }
    }
    let (mut timers, mut out) =
        (Pic16Timers::new(ccps, crystal.map(|(osc, hz)| Timer1Crystal { osc, hz })), Vec::new());
    for (t, what) in todo {
        if let Some((reg, value)) = what.split_once('=') {
            let reg = register(reg).ok_or(format!("{reg}?"))?;
            let value = u8::from_str_radix(value, 16).map_err(|_| format!("{what}: hexadecimal"))?;
            advance(&mut timers, t - 1, &mut out);
            timers.write(reg, value, 0xFF, t, &mut out);
            continue;
        }
        advance(&mut timers, t, &mut out);
        if let Some((reg, value)) = what.split_once('?') {
            let reg = register(reg).ok_or(format!("{reg}?"))?;
            let read = format!("{:02X}", timers.peek(reg, t));
            if read != value {
                return Err(format!("{what}@{t}: is {read}"));
            }
        } else if let Some(line) = what.strip_suffix(['+', '-']) {
            let line = match line {
                "t1cki" => Pic16Line::T1cki,
                "ccp1" => Pic16Line::Ccp1,
                "ccp2" => Pic16Line::Ccp2,
                _ => return Err(format!("{line}?")),
            };
            timers.on_line_changed(line, what.ends_with('+'), t, &mut out);
        } else {
            match what {
                "sleep" => timers.stop_clock(t, &mut out),
                "wake" => timers.restart_clock(t, &mut out),
                "reset" => timers.reset(false, t, &mut out),
                "por" => timers.reset(true, t, &mut out),
                "listen" => timers.set_timer2_listener(true, t, &mut out),
                "end" => {}
                _ => return Err(format!("{what}?")),
            }
        }
    }
    let mut heard: Vec<String> = out.iter().map(text).collect();
    let mut wanted: Vec<&str> = said.split_whitespace().collect();
    heard.sort();
    wanted.sort_unstable();
    if heard == wanted { Ok(()) } else { Err(format!("said {heard:?}, wanted {wanted:?}")) }
}

#[test]
fn hand_worked() {
    let mut cases = 0;
    let mut failed = String::new();
    for (i, line) in include_str!("cases.txt").lines().enumerate() {
        let line = if line.starts_with('#') { "" } else { line };
        let mut fields = line.split('|').map(str::trim);
        let (Some(name), Some(steps)) = (fields.next(), fields.next()) else { continue };
        cases += 1;
        if let Err(error) = case(steps, fields.next().unwrap_or("")) {
            failed += &format!("cases.txt:{}: {name}: {error}\n", i + 1);
        }
    }
    assert!(failed.is_empty(), "\n{failed}");
    assert!(cases >= 50, "only {cases} cases");
}

#[test]
fn a_case_can_fail() {
    for (steps, said) in [
        ("T1CON=01@4 TMR1L?02@8", ""),
        ("TMR1H=FF@4 TMR1L=FE@8 T1CON=01@12 end@20", ""),
        ("TMR1H=FF@4 TMR1L=FE@8 T1CON=01@12 end@20", "TMR1IF@16"),
    ] {
        assert!(case(steps, said).is_err(), "{steps}");
    }
}

#[test]
fn names_of_the_text_are_those_of_the_part() {
    let drive = Pic16Signal::Drive { t: 3, line: Pic16Line::Ccp1, drive: Pic16Drive::High };
    assert_eq!(text(&drive), "Ccp1:High@3");
    assert_eq!(text(&Pic16Signal::Flag { t: 4, flag: InterruptFlag::CCP1IF }), "CCP1IF@4");
}
