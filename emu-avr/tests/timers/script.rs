//! Cases as text. A line is `title | t:what ...`; an instruction in cycle `t` writes at the edge `t + 1` and
//! reads the state at `t`.
//!
//! - `REG=hh` writes, `REG?hh` peeks, `REG!hh` reads with side effects, `REG&hh=hh` checks some bits.
//! - `T=1`, `ICP=0` change a line at the edge `t`; `OCA?1` is the level that drives OCnA, `OCA?-` is none.
//! - `gtccr=hh` writes GTCCR (any of the lower bits clears the prescaler).
//! - `irq?hh` are the requested interrupts, `take=n` enters one, `next?n` is the next event (`-` for never).
//! - `steady.REG?n`, `listen=hh`, `flag?n` (a signal of the flag of irq `n` at `t`).
//! - `sleep`, `wake`, `reset`, `osc=0`, `rate=n`, `xtal=n`.

use emu_avr::periph::timers::{AvrTimer, TimerRegister, TimerShape};
use emu_avr::periph::{AvrDrive, AvrLine, AvrSignal, Device};
use emu_core::NEVER;
use emu_core::parts::prescaler::Prescaler;

fn reg(name: &str) -> Option<TimerRegister> {
    Some(match name {
        "TCCRA" => TimerRegister::TCCRA,
        "TCCRB" => TimerRegister::TCCRB,
        "TCCRC" => TimerRegister::TCCRC,
        "TCNTL" | "TCNT" => TimerRegister::TCNTL,
        "TCNTH" => TimerRegister::TCNTH,
        "OCRAL" | "OCRA" => TimerRegister::OCRAL,
        "OCRAH" => TimerRegister::OCRAH,
        "OCRBL" | "OCRB" => TimerRegister::OCRBL,
        "OCRBH" => TimerRegister::OCRBH,
        "OCRCL" => TimerRegister::OCRCL,
        "OCRCH" => TimerRegister::OCRCH,
        "ICRL" => TimerRegister::ICRL,
        "ICRH" => TimerRegister::ICRH,
        "TIMSK" => TimerRegister::TIMSK,
        "TIFR" => TimerRegister::TIFR,
        "ASSR" => TimerRegister::ASSR,
        _ => return None,
    })
}

fn hex(text: &str) -> u8 {
    u8::from_str_radix(text, 16).unwrap_or_else(|_| panic!("{text}: two hexadecimal digits"))
}

fn cycle(text: &str) -> u64 {
    if text == "-" { NEVER } else { text.parse().unwrap_or_else(|_| panic!("{text}: a cycle")) }
}

struct TestBench {
    timer: AvrTimer,
    prescaler: Prescaler,
    out: Vec<AvrSignal>,
}

impl TestBench {
    fn due(&mut self, t: u64) {
        while self.timer.next_deadline() <= t {
            let next = self.timer.next_deadline();
            self.timer.run_due(next, &mut self.out);
        }
    }

    fn driven(&self, name: &str) -> &'static str {
        let line = [AvrLine::OcA, AvrLine::OcB, AvrLine::OcC]
            [["OCA", "OCB", "OCC"].iter().position(|n| *n == name).expect(name)];
        let last = self.out.iter().rev().find_map(|signal| match signal {
            AvrSignal::Drive { line: of, drive, .. } if *of == line => Some(*drive),
            _ => None,
        });
        match last.unwrap_or_default() {
            AvrDrive::Port => "-",
            AvrDrive::Value(true) => "1",
            AvrDrive::Value(false) => "0",
            other => panic!("{other:?}"),
        }
    }

    /// Executes an action at an edge.
    fn act(&mut self, t: u64, name: &str, value: &str) {
        let TestBench { timer, prescaler, out } = self;
        match name {
            "T" => timer.on_line_changed(AvrLine::T, value == "1", t, out),
            "ICP" => timer.on_line_changed(AvrLine::Icp, value == "1", t, out),
            "gtccr" => {
                let value = hex(value);
                if value & 3 != 0 || prescaler.is_held() {
                    prescaler.restart(t, value & 0x80 != 0 && value & 3 != 0);
                    timer.prescaler(*prescaler, t, out);
                }
            }
            "listen" => timer.set_listened_interrupts(hex(value), t, out),
            "take" => timer.on_interrupt_taken(value.parse().expect("a number"), t, out),
            "sleep" => timer.stop_clock(t, out),
            "wake" => timer.restart_clock(t, out),
            "reset" => timer.reset(false, t, out),
            "osc" => timer.set_oscillator_running(value == "1", t, out),
            "rate" => timer.set_clock_hz(cycle(value), t),
            "xtal" => timer.crystal_hz(cycle(value), t, out),
            name => timer.write(reg(name).expect(name), hex(value), 0xFF, t, out),
        }
    }

    fn ask(&mut self, t: u64, name: &str, value: &str, title: &str) {
        let at = || format!("{title}: {name} in cycle {t}");
        if let Some(name) = name.strip_prefix("steady.") {
            return assert_eq!(self.timer.steady_until(reg(name).expect(name), t), cycle(value), "{}", at());
        }
        match name {
            "irq" => assert_eq!(self.timer.interrupt_requests(), hex(value), "{}", at()),
            "next" => assert_eq!(self.timer.next_deadline(), cycle(value), "{}", at()),
            "flag" => {
                let signal = AvrSignal::Flag { t, irq: value.parse().expect("a number") };
                assert!(self.out.contains(&signal), "{}: {:?}", at(), self.out);
            }
            "OCA" | "OCB" | "OCC" => assert_eq!(self.driven(name), value, "{}", at()),
            _ => assert_eq!(shown(self.timer.peek(reg(name).expect(name), t)), shown(hex(value)), "{}", at()),
        }
    }
}

fn shown(byte: u8) -> String {
    format!("{byte:02X}")
}

/// Runs the cases of `text`, each with a new timer after power-on.
pub fn check(shape: TimerShape, text: &str) {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    for line in lines {
        let (title, steps) = line.split_once('|').expect(line);
        let title = title.trim();
        let mut bench = TestBench { timer: AvrTimer::new(shape), prescaler: Prescaler::new(0), out: Vec::new() };
        let mut last = 0;
        for step in steps.split_whitespace() {
            let (t, what) = step.split_once(':').expect(step);
            let t: u64 = t.parse().expect(step);
            assert!(t >= last, "{title}: {step} goes back in time");
            if let Some((name, value)) = what.split_once('?') {
                bench.due(t);
                bench.ask(t, name, value, title);
            } else if let Some((name, value)) = what.split_once('!') {
                bench.due(t);
                let got = bench.timer.read(reg(name).expect(name), t, &mut bench.out);
                assert_eq!(shown(got), shown(hex(value)), "{title}: {step}");
            } else if let Some((part, value)) = what.split_once('&') {
                let (mask, want) = value.split_once('=').expect(step);
                bench.due(t);
                let got = bench.timer.peek(reg(part).expect(part), t) & hex(mask);
                assert_eq!(shown(got), shown(hex(want)), "{title}: {step}");
            } else {
                let (name, value) = what.split_once('=').unwrap_or((what, ""));
                let at = if reg(name).is_some() || name == "gtccr" { t + 1 } else { t };
                bench.due(t);
                bench.act(at, name, value);
            }
            last = t;
        }
    }
}
