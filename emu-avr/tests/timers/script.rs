//! Cases as text. A line is `title | t:what ...`; an instruction in cycle `t` writes at the edge `t + 1` and reads what is at `t`.
//!
//! `REG=hh` writes, `REG?hh` looks, `REG!hh` reads with side effects, `REG&hh=hh` looks at some bits; `T=1`, `ICP=0` change a
//! line at the edge `t`; `OCA?1` is the level that OCnA is given, `OCA?-` none; `gtccr=hh` writes GTCCR (any of the lower bits
//! clears the prescaler); `irq?hh` are the interrupts asked for, `take=n`, `next?n` (`-` for never), `steady.REG?n`,
//! `listen=hh`, `flag?n` (irq `n` was told to be set at `t`), `sleep`, `wake`, `reset`, `osc=0`, `rate=n`, `xtal=n`.

use emu_avr::periph::timers::{Reg, Shape, Timer};
use emu_avr::periph::{Device, Drive, Line, Signal};
use emu_core::NEVER;
use emu_core::parts::prescaler::Prescaler;

fn reg(name: &str) -> Option<Reg> {
    Some(match name {
        "TCCRA" => Reg::TCCRA,
        "TCCRB" => Reg::TCCRB,
        "TCCRC" => Reg::TCCRC,
        "TCNTL" | "TCNT" => Reg::TCNTL,
        "TCNTH" => Reg::TCNTH,
        "OCRAL" | "OCRA" => Reg::OCRAL,
        "OCRAH" => Reg::OCRAH,
        "OCRBL" | "OCRB" => Reg::OCRBL,
        "OCRBH" => Reg::OCRBH,
        "OCRCL" => Reg::OCRCL,
        "OCRCH" => Reg::OCRCH,
        "ICRL" => Reg::ICRL,
        "ICRH" => Reg::ICRH,
        "TIMSK" => Reg::TIMSK,
        "TIFR" => Reg::TIFR,
        "ASSR" => Reg::ASSR,
        _ => return None,
    })
}

fn hex(text: &str) -> u8 {
    u8::from_str_radix(text, 16).unwrap_or_else(|_| panic!("{text}: two hexadecimal digits"))
}

fn cycle(text: &str) -> u64 {
    if text == "-" { NEVER } else { text.parse().unwrap_or_else(|_| panic!("{text}: a cycle")) }
}

struct Rig {
    timer: Timer,
    prescaler: Prescaler,
    out: Vec<Signal>,
}

impl Rig {
    fn due(&mut self, t: u64) {
        while self.timer.next() <= t {
            let next = self.timer.next();
            self.timer.run(next, &mut self.out);
        }
    }

    fn driven(&self, name: &str) -> &'static str {
        let line =
            [Line::OcA, Line::OcB, Line::OcC][["OCA", "OCB", "OCC"].iter().position(|n| *n == name).expect(name)];
        let last = self.out.iter().rev().find_map(|signal| match signal {
            Signal::Drive { line: of, drive, .. } if *of == line => Some(*drive),
            _ => None,
        });
        match last.unwrap_or_default() {
            Drive::Port => "-",
            Drive::Value(true) => "1",
            Drive::Value(false) => "0",
            other => panic!("{other:?}"),
        }
    }

    /// What is done at an edge.
    fn act(&mut self, t: u64, name: &str, value: &str) {
        let Rig { timer, prescaler, out } = self;
        match name {
            "T" => timer.line(Line::T, value == "1", t, out),
            "ICP" => timer.line(Line::Icp, value == "1", t, out),
            "gtccr" => {
                let value = hex(value);
                if value & 3 != 0 || prescaler.held() {
                    prescaler.clear(t, value & 0x80 != 0 && value & 3 != 0);
                    timer.prescaler(*prescaler, t, out);
                }
            }
            "listen" => timer.listen(hex(value), t, out),
            "take" => timer.taken(value.parse().expect("a number"), t, out),
            "sleep" => timer.sleep(t, out),
            "wake" => timer.wake(t, out),
            "reset" => timer.reset(t, out),
            "osc" => timer.oscillator(value == "1", t, out),
            "rate" => timer.rate(cycle(value), t),
            "xtal" => timer.crystal_hz(cycle(value), t, out),
            name => timer.write(reg(name).expect(name), hex(value), 0xFF, t, out),
        }
    }

    fn ask(&mut self, t: u64, name: &str, value: &str, title: &str) {
        let at = || format!("{title}: {name} in cycle {t}");
        if let Some(name) = name.strip_prefix("steady.") {
            return assert_eq!(self.timer.steady(reg(name).expect(name), t), cycle(value), "{}", at());
        }
        match name {
            "irq" => assert_eq!(self.timer.requests(), hex(value), "{}", at()),
            "next" => assert_eq!(self.timer.next(), cycle(value), "{}", at()),
            "flag" => {
                let signal = Signal::Flag { t, irq: value.parse().expect("a number") };
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

/// Runs the cases of `text`, each with a timer of its own after power-on.
pub fn check(shape: Shape, text: &str) {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    for line in lines {
        let (title, steps) = line.split_once('|').expect(line);
        let title = title.trim();
        let mut rig = Rig { timer: Timer::new(shape), prescaler: Prescaler::new(0), out: Vec::new() };
        let mut last = 0;
        for step in steps.split_whitespace() {
            let (t, what) = step.split_once(':').expect(step);
            let t: u64 = t.parse().expect(step);
            assert!(t >= last, "{title}: {step} goes back in time");
            if let Some((name, value)) = what.split_once('?') {
                rig.due(t);
                rig.ask(t, name, value, title);
            } else if let Some((name, value)) = what.split_once('!') {
                rig.due(t);
                let got = rig.timer.read(reg(name).expect(name), t, &mut rig.out);
                assert_eq!(shown(got), shown(hex(value)), "{title}: {step}");
            } else if let Some((part, value)) = what.split_once('&') {
                let (mask, want) = value.split_once('=').expect(step);
                rig.due(t);
                let got = rig.timer.peek(reg(part).expect(part), t) & hex(mask);
                assert_eq!(shown(got), shown(hex(want)), "{title}: {step}");
            } else {
                let (name, value) = what.split_once('=').unwrap_or((what, ""));
                let at = if reg(name).is_some() || name == "gtccr" { t + 1 } else { t };
                rig.due(t);
                rig.act(at, name, value);
            }
            last = t;
        }
    }
}
