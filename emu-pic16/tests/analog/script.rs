//! Cases, one per line: name | converter | comparators | steps. A step is `clock:NAME=value`,
//! `clock:NAME?value` or `clock:NAME`. Registers and PORTD are hexadecimal, voltages in millivolts.

use emu_core::NEVER;
use emu_pic16::chips;
use emu_pic16::periph::adc::{ClockFraction, Pic16Adc};
use emu_pic16::periph::comparator::Pic16Comparators;
use emu_pic16::periph::map::{InterruptFlag, Pic16Line, Sfr};
use emu_pic16::periph::psp::ParallelSlavePort;
use emu_pic16::periph::{Device, Pic16Drive, Pic16Outbox, Pic16Signal};

struct TestBench {
    adc: Pic16Adc,
    comparators: Pic16Comparators,
    psp: ParallelSlavePort,
    out: Pic16Outbox,
    flags: Vec<(u64, InterruptFlag)>,
    drives: Vec<(Pic16Line, Pic16Drive)>,
}

pub fn adc_kind(name: &str) -> chips::Pic16AdcKind {
    match name {
        "8" => chips::Pic16AdcKind::Bits8,
        "87X" => chips::Pic16AdcKind::Bits10,
        "87XA" => chips::Pic16AdcKind::Bits10Adcs2,
        "88" => chips::Pic16AdcKind::Ansel,
        _ => chips::Pic16AdcKind::None,
    }
}

pub fn comparator_kind(name: &str) -> chips::ComparatorKind {
    match name {
        "62X" => chips::ComparatorKind::F62x,
        "87XA" => chips::ComparatorKind::F87xA,
        "88" => chips::ComparatorKind::F88,
        _ => chips::ComparatorKind::None,
    }
}

/// Runs every line at 4 MHz, with a TAD of 16 clocks on the converter's own oscillator.
pub fn check(text: &str) {
    let mut lines = 0;
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')) {
        let columns: Vec<&str> = line.split('|').map(str::trim).collect();
        let [_, adc, comparators, steps] = columns[..] else { panic!("four columns: {line}") };
        let kind = adc_kind(adc);
        let channels = if kind == chips::Pic16AdcKind::Bits8 { 4 } else { 8 };
        let mut bench = TestBench {
            adc: Pic16Adc::new(kind, channels, ClockFraction { num: 16, den: 1 }, 4_000_000),
            comparators: Pic16Comparators::new(comparator_kind(comparators)),
            psp: ParallelSlavePort::new(),
            out: Vec::new(),
            flags: Vec::new(),
            drives: Vec::new(),
        };
        for step in steps.split_whitespace() {
            bench.step(step).unwrap_or_else(|said| panic!("{line}\n  at {step}: {said}"));
        }
        bench.run(1_000_000);
        assert!(bench.flags.is_empty(), "{line}\n  flags that the line does not name: {:?}", bench.flags);
        lines += 1;
    }
    assert!(lines > 0);
}

impl TestBench {
    fn run(&mut self, t: u64) {
        let parts: [&mut dyn Device<Pic16Signal, Reg = Sfr>; 3] = [&mut self.adc, &mut self.comparators, &mut self.psp];
        for part in parts {
            part.run_due(t, &mut self.out);
            assert!(part.next_deadline() > t);
        }
        self.drain();
    }

    fn drain(&mut self) {
        for signal in self.out.drain(..) {
            match signal {
                Pic16Signal::Flag { t, flag } => self.flags.push((t, flag)),
                Pic16Signal::Drive { line, drive, .. } => {
                    self.drives.retain(|driven| driven.0 != line);
                    self.drives.push((line, drive));
                }
                other => panic!("{other:?}"),
            }
        }
    }

    fn device(&mut self, reg: Sfr) -> &mut dyn Device<Pic16Signal, Reg = Sfr> {
        match reg {
            Sfr::CMCON | Sfr::CVRCON => &mut self.comparators,
            Sfr::TRISE => &mut self.psp,
            _ => &mut self.adc,
        }
    }

    fn step(&mut self, step: &str) -> Result<(), String> {
        let (clock, what) = step.split_once(':').ok_or("no clock")?;
        let t: u64 = clock.parse().map_err(|_| "clock")?;
        if let Some((name, want)) = what.split_once('?') {
            self.run(t);
            let got = self.ask(name, t)?;
            return if got == want { Ok(()) } else { Err(format!("it is {got}")) };
        }
        if let Some((name, value)) = what.split_once('=') {
            // A write itself executes what is due at its clock.
            self.run(if name.parse_sfr().is_some() { t - 1 } else { t });
            self.set(name, value, t)?;
        } else {
            self.run(t);
            match what {
                "sleep" => {
                    self.adc.stop_clock(t, &mut self.out);
                    self.comparators.stop_clock(t, &mut self.out);
                    self.psp.stop_clock(t, &mut self.out);
                }
                "wake" => {
                    self.adc.restart_clock(t, &mut self.out);
                    self.comparators.restart_clock(t, &mut self.out);
                    self.psp.restart_clock(t, &mut self.out);
                }
                "reset" => {
                    self.adc.reset(false, t, &mut self.out);
                    self.comparators.reset(false, t, &mut self.out);
                    self.psp.reset(false, t, &mut self.out);
                }
                "start" => self.adc.start(t, &mut self.out),
                flag => {
                    let found = self.flags.iter().position(|(at, f)| *at == t && format!("{f:?}") == flag);
                    self.flags.remove(found.ok_or_else(|| format!("flags are {:?}", self.flags))?);
                }
            }
        }
        self.drain();
        Ok(())
    }

    fn set(&mut self, name: &str, value: &str, t: u64) -> Result<(), String> {
        if let Some(reg) = name.parse_sfr() {
            let value = hex(value)?;
            let mut out = std::mem::take(&mut self.out);
            self.device(reg).write(reg, value, 0xFF, t, &mut out);
            self.out = out;
            return Ok(());
        }
        let number = || value.parse::<u32>().map_err(|_| "number");
        let strobe = match name {
            "RD" => Pic16Line::Rd,
            "WR" => Pic16Line::Wr,
            "CS" => Pic16Line::Cs,
            "bus" => return hex(value).map(|levels| self.psp.set_bus_levels(levels, t)),
            "PORTD" => return hex(value).map(|value| self.psp.write_port(value, t)),
            "Rs" => return Ok(number().map(|ohms| self.adc.set_source_ohms(ohms, t))?),
            "VDD" => {
                self.adc.set_supply(number()?, t);
                self.comparators.set_supply(number()?, t, &mut self.out);
                return Ok(());
            }
            _ => {
                let (kind, pin) = name.split_at(2);
                let pin = pin.parse().map_err(|_| "pin")?;
                match kind {
                    "AN" => self.adc.set_input(pin, number()?, t),
                    "RA" => self.comparators.set_input(pin, number()?, t, &mut self.out),
                    _ => return Err("name".into()),
                }
                return Ok(());
            }
        };
        self.psp.on_line_changed(strobe, value == "1", t, &mut self.out);
        Ok(())
    }

    fn ask(&mut self, name: &str, t: u64) -> Result<String, String> {
        let drive = |line| match self.drives.iter().find(|driven| driven.0 == line).map_or(Pic16Drive::Port, |d| d.1) {
            Pic16Drive::Port => "port",
            Pic16Drive::Low => "L",
            Pic16Drive::High => "H",
            Pic16Drive::Float | Pic16Drive::Open => "Z",
        };
        let byte = |value: u8| format!("{value:02X}");
        Ok(match name {
            "acquired" => u8::from(self.adc.is_acquired(t)).to_string(),
            "digital" => byte(self.adc.digital_pins()),
            "pins" => format!("{:04b}", self.comparators.digital_pins()),
            "mismatch" => u8::from(self.comparators.has_mismatch()).to_string(),
            "reference" => self.comparators.reference().to_string(),
            "out" => self.comparators.reference_out().map_or("-".into(), |mv| mv.to_string()),
            "C1out" => drive(Pic16Line::C1out).into(),
            "C2out" => drive(Pic16Line::C2out).into(),
            "driving" => self.psp.driven_byte().map_or("-".into(), byte),
            "PORTD" => byte(self.psp.read_port(t)),
            _ if name.starts_with("steady.") => {
                let reg = name[7..].parse_sfr().ok_or("register")?;
                match self.device(reg).steady_until(reg, t) {
                    NEVER => "-".into(),
                    until => until.to_string(),
                }
            }
            _ if name.starts_with("peek.") => {
                let reg = name[5..].parse_sfr().ok_or("register")?;
                byte(self.device(reg).peek(reg, t))
            }
            _ => {
                let reg = name.parse_sfr().ok_or("register")?;
                let mut out = std::mem::take(&mut self.out);
                let value = byte(self.device(reg).read(reg, t, &mut out));
                self.out = out;
                self.drain();
                value
            }
        })
    }
}

fn hex(value: &str) -> Result<u8, String> {
    u8::from_str_radix(value, 16).map_err(|e| e.to_string())
}

trait ParseSfr {
    fn parse_sfr(&self) -> Option<Sfr>;
}

impl ParseSfr for str {
    /// Parses a register name, except PORTD, for which the port has separate functions.
    fn parse_sfr(&self) -> Option<Sfr> {
        Sfr::ALL.iter().copied().find(|reg| reg.name() == self && *reg != Sfr::PORTD)
    }
}
