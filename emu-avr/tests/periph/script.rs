//! Runs one line of text against a chip.
//!
//! A line is `section title | steps`. Each step starts with its cycle:
//!
//! - `5:DDRB=20` writes; `5:PINB|20` is SBI and `5:PORTB&20` CBI on these bits.
//! - `5:PINB?20` peeks a register; `5:UDR0!41` reads it as a program does.
//! - `5:PB5=H` drives a pin (H, L, Z); `5:PB5?L` checks its level.
//! - `5:irq?WDT` is the pending interrupt (`-` for none); `5:take=WDT` enters it.
//! - `5:wdr` executes WDR; `5:reset?y` checks for a requested watchdog reset and executes it.
//! - `5:deadline?9` is the next deadline (`-` for never); `5:wakes?y` is with interrupts enabled; also
//!   `5:busy?n` and `5:steady.PINB?9`.
//!
//! Register values are hexadecimal, cycles decimal.

use emu_avr::chips::ATMEGA328P as CHIP;
use emu_avr::soc::AvrSoc;
use emu_avr::{Avr, Options};
use emu_core::CycleTime;
use emu_core::external_io::OutsideInput;
use emu_core::image::Image;
use emu_core::{Bus, NEVER, PinLevel, RamInit, ResetCause};

/// Runs every line of `text` on a fresh chip with a clock of `hz` Hz; panics with a list of all failures.
pub fn check(hz: u64, text: &str) {
    let mut failures = String::new();
    let mut lines = 0;
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')) {
        lines += 1;
        let (title, steps) = line.split_once('|').unwrap_or_else(|| panic!("no '|' in: {line}"));
        let mut soc = chip();
        soc.set_clock_hz(hz, 0);
        for step in steps.split_whitespace() {
            if let Err(why) = run(&mut soc, step) {
                failures += &format!("{title}: {step}: {why}\n");
            }
        }
    }
    assert!(lines > 0, "no cases");
    assert!(failures.is_empty(), "\n{failures}");
}

fn run(soc: &mut AvrSoc, step: &str) -> Result<(), String> {
    let (at, rest) = step.split_once(':').ok_or("no cycle")?;
    let now: u64 = at.parse().map_err(|_| "bad cycle")?;
    if rest == "wdr" {
        soc.clear_watchdog(now);
        return Ok(());
    }
    let place = rest.find(['=', '|', '&', '?', '!']).ok_or("no operator")?;
    let (name, operator, want) = (&rest[..place], &rest[place..=place], &rest[place + 1..]);
    let expect = |got: String| if got == want { Ok(()) } else { Err(format!("got {got}")) };
    let yes = |bit: bool| String::from(if bit { "y" } else { "n" });
    let cycle = |at: u64| if at == NEVER { "-".into() } else { at.to_string() };
    match (name, operator) {
        ("irq", "?") => {
            soc.fire(now);
            return expect(soc.pending_interrupt(now).map_or("-", |v| CHIP.vectors[usize::from(v)]).into());
        }
        ("take", "=") => {
            let vector = CHIP.vectors.iter().position(|v| *v == want).ok_or("no such vector")?;
            soc.acknowledge_interrupt(vector as u8, now);
            return Ok(());
        }
        ("reset", "?") => {
            let asked = soc.requested_reset(now).is_some();
            if asked {
                soc.reset(ResetCause::Watchdog, now);
            }
            return expect(yes(asked));
        }
        ("deadline", "?") => return expect(cycle(soc.fire(now))),
        ("wakes", "?") => {
            soc.fire(now);
            return expect(yes(soc.can_wake(true)));
        }
        ("busy", "?") => {
            soc.fire(now);
            return expect(yes(soc.is_busy()));
        }
        _ => {}
    }
    if let Some(reg) = name.strip_prefix("steady.").and_then(|name| CHIP.reg(name)) {
        return expect(cycle(soc.steady_until(reg, now)));
    }
    if let Some(pin) = CHIP.pin(name) {
        if operator == "?" {
            soc.fire(now);
            return expect(String::from(match soc.level(pin) {
                PinLevel::High => "H",
                PinLevel::Low => "L",
                PinLevel::Float | PinLevel::PullUp | PinLevel::PullDown => "Z",
            }));
        }
        let level = match want {
            "H" => PinLevel::High,
            "L" => PinLevel::Low,
            "Z" => PinLevel::Float,
            _ => return Err("no such level".into()),
        };
        soc.queue_input(CycleTime::at(now), now, OutsideInput::Level(pin, level));
        return Ok(());
    }
    let reg = CHIP.reg(name).ok_or("no such name")?;
    let value = u8::from_str_radix(want, 16).map_err(|_| "bad value")?;
    let got = match operator {
        "=" => return soc.write(reg, value, now).none(),
        "|" => return soc.write_bits(reg, value, value, now).none(),
        "&" => return soc.write_bits(reg, value, 0, now).none(),
        "?" => soc.peek(reg, now),
        _ => soc.read(reg, now).value,
    };
    if got == value { Ok(()) } else { Err(format!("got {got:02x}")) }
}

trait Ignore {
    fn none(self) -> Result<(), String>;
}

impl Ignore for emu_core::BusEffect {
    fn none(self) -> Result<(), String> {
        Ok(())
    }
}

/// Returns the chip around the core after power-on, with the reset pin as a port pin (RSTDISBL).
pub fn chip() -> AvrSoc {
    let fuses = Some([0xFF, 0x59, 0xFF]);
    let options = Options { fuses, ..Options::at_hz(CHIP.default_hz) };
    Avr::with(&CHIP, &Image::default(), RamInit::Zero, options).soc().clone()
}
