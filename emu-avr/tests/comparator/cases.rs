//! Cases from DS40002061, one per line: section, topic, steps. A step is `edge:NAME=value` (a write or a
//! level), `cycle:NAME?value` or `edge:what`. Registers are hexadecimal, levels in millivolts. The clock is
//! 1,000,000 Hz.

use emu_avr::periph::comparator::{AvrComparator, ComparatorInput, ComparatorRegister};
use emu_avr::periph::{AvrDrive, AvrOutbox, AvrSignal, Device};

struct TestBench {
    dut: AvrComparator,
    out: AvrOutbox,
    flags: Vec<u64>,
    /// All changes of the signal to timer 1.
    icp: Vec<String>,
}

impl TestBench {
    fn step(&mut self, step: &str) -> Result<(), String> {
        let (t, what) = step.split_once(':').ok_or("no time")?;
        let t: u64 = t.parse().map_err(|_| "time")?;
        let hex = |text: &str| u8::from_str_radix(text, 16).map_err(|e| e.to_string());
        if let Some((name, want)) = what.split_once('?') {
            self.dut.run_due(t, &mut self.out);
            self.drain();
            let got = match name {
                "irq" => self.dut.interrupt_requests().to_string(),
                "flags" => self.flags.iter().map(u64::to_string).collect::<Vec<_>>().join(","),
                "icp" => self.icp.join(","),
                "ACSR" => format!("{:02X}", self.dut.read(ComparatorRegister::ACSR, t, &mut self.out)),
                _ => format!("{:02X}", self.dut.read(ComparatorRegister::DIDR1, t, &mut self.out)),
            };
            return if got == want { Ok(()) } else { Err(format!("it is {got}")) };
        }
        let out = &mut self.out;
        if let Some((name, value)) = what.split_once('=') {
            let number = || value.parse().map_err(|_| "number");
            match name {
                "ACSR" => self.dut.write(ComparatorRegister::ACSR, hex(value)?, 0xFF, t, out),
                "DIDR1" => self.dut.write(ComparatorRegister::DIDR1, hex(value)?, 0xFF, t, out),
                "AIN0" => self.dut.set_millivolts(ComparatorInput::Ain0, number()?, t, out),
                "AIN1" => self.dut.set_millivolts(ComparatorInput::Ain1, number()?, t, out),
                "channel" => self.dut.select(value.parse().ok(), t, out),
                "kept" => self.dut.hold_reference_on(value == "1", t, out),
                "hz" => self.dut.set_clock_hz(value.parse().map_err(|_| "hz")?, t),
                _ => self.dut.set_millivolts(ComparatorInput::Adc(hex(&name[3..])?), number()?, t, out),
            }
        } else {
            match what {
                "taken" => self.dut.on_interrupt_taken(0, t, out),
                "sleep" => self.dut.stop_clock(t, out),
                "wake" => self.dut.restart_clock(t, out),
                "reset" => self.dut.reset(false, t, out),
                _ => return Err("no such step".into()),
            }
        }
        self.drain();
        Ok(())
    }

    fn drain(&mut self) {
        for signal in self.out.drain(..) {
            match signal {
                AvrSignal::Flag { t, irq: 0 } => self.flags.push(t),
                AvrSignal::Drive { t, drive, .. } => self.icp.push(match drive {
                    AvrDrive::Value(high) => format!("{t}{}", if high { "H" } else { "L" }),
                    AvrDrive::Port => format!("{t}-"),
                    other => panic!("{other:?}"),
                }),
                other => panic!("{other:?}"),
            }
        }
    }
}

fn run(line: &str) -> Result<(), String> {
    let steps = line.split('|').nth(1).ok_or("two columns")?;
    let dut = AvrComparator::new(1_100, 1_000_000);
    let mut bench = TestBench { dut, out: AvrOutbox::new(), flags: Vec::new(), icp: Vec::new() };
    for text in steps.split_whitespace() {
        bench.step(text).map_err(|said| format!("{line}\n  at {text}: {said}"))?;
    }
    Ok(())
}

const CASES: &str = "
    23     high while AIN0 is above AIN1                       | 9:AIN0=2 9:AIN1=1 20:ACSR?30 30:AIN1=2 40:ACSR?10 50:AIN1=3 60:ACSR?10
    23.3.2 ACO comes two cycles after an edge                  | 10:AIN0=1 11:ACSR?00 12:ACSR?30
    23.3.2 a pulse of one cycle gets through                   | 10:AIN0=1 11:AIN0=0 12:ACSR?30 13:ACSR?10
    23.3.2 a shorter one does not                              | 10:AIN0=1 10:AIN0=0 12:ACSR?00 13:ACSR?00
    23.3.2 ACIS 0: every change                                | 10:AIN0=1 20:AIN0=0 30:flags?12 30:ACSR=10 40:AIN0=1 50:flags?12,42
    23.3.2 ACIS 2: falling                                     | 5:ACSR=02 10:AIN0=1 20:ACSR?22 20:AIN0=0 21:ACSR?22 22:ACSR?12 30:flags?22
    23.3.2 ACIS 3: rising                                      | 5:ACSR=03 10:AIN0=1 12:ACSR?33 13:ACSR=13 20:AIN0=0 30:ACSR?03 30:flags?12
    23.3.2 ACIS 1 is reserved                                  | 5:ACSR=01 10:AIN0=1 20:AIN0=0 30:ACSR?01
    23.3.2 a change of ACIS alone sets nothing                 | 5:ACSR=02 10:AIN0=1 20:ACSR=03 30:ACSR=00 40:ACSR?20
    23.3.2 ACI and ACIE ask, the entry clears                  | 5:ACSR=0B 10:AIN0=1 11:irq?0 12:irq?1 20:taken 20:irq?0 21:ACSR?2B
    23.3.2 without ACIE nothing is asked                       | 10:AIN0=1 20:ACSR?30 20:irq?0 21:ACSR=08 21:irq?1
    23.3.2 ACI is cleared by a 1, kept by a 0                  | 10:AIN0=1 20:ACSR=00 20:ACSR?30 21:ACSR=10 21:ACSR?20
    23.3.2 not at the edge that sets it                        | 10:AIN0=1 12:ACSR=10 12:ACSR?30 13:ACSR=10 13:ACSR?20
    23.3.2 ACO cannot be written                               | 10:ACSR=20 13:ACSR?00
    23.3.2 ACD: off, and low; the switch is a change           | 10:AIN0=1 13:ACSR=10 20:ACSR=80 21:ACSR?A0 22:ACSR?90 30:ACSR=10 32:ACSR?30
    23.3.2 ACBG: 1.1 V in place of AIN0, after 40 us           | 5:AIN1=1099 10:ACSR=43 51:ACSR?43 52:ACSR?73
    23.3.2 not above 1.1 V                                     | 5:AIN1=1100 10:ACSR=43 90:ACSR?43
    23.3.2 AIN0 is out of it                                   | 5:AIN0=5000 5:AIN1=1100 10:ACSR=53 12:ACSR?43 90:ACSR?43
    11.7.1 a reference that is on needs no start-up            | 5:AIN1=1000 10:kept=1 100:ACSR=43 101:ACSR?43 102:ACSR?73
    11.7.1 one that was off does anew                          | 5:AIN1=1000 10:ACSR=43 100:ACSR=03 110:ACSR=53 150:ACSR?43 152:ACSR?73
    11.7.1 40 us are 40 us at another clock                    | 5:AIN1=1000 10:ACSR=43 30:hz=2000000 71:ACSR?43 72:ACSR?73
    23.2   a channel of the converter                          | 5:AIN0=2000 5:AIN1=3000 5:ADC6=1999 20:ACSR?00 20:channel=6 22:ACSR?30 30:channel=- 32:ACSR?10
    23.2   another one                                         | 5:AIN0=2000 5:ADC6=1999 5:ADC7=2001 5:channel=7 20:ACSR?00 20:channel=6 22:ACSR?30
    23.3.2 ACIC: timer 1 gets the output before the flip-flops | 5:ACSR=04 10:AIN0=1 20:AIN0=0 30:ACSR=10 40:AIN0=1 50:icp?5L,10H,20L,30-
    23.3.2 ACIC set while it is high                           | 10:AIN0=1 20:ACSR=04 30:icp?20H
    23.3.2 with the reference                                  | 5:AIN1=500 10:ACSR=44 100:ACSR=84 200:icp?10L,50H,100L
    23.3.3 DIDR1                                               | 5:DIDR1=FF 5:DIDR1?03
    23     asleep, ACO is frozen; timer 1's line does not      | 5:ACSR=04 10:sleep 20:AIN0=1 40:ACSR?04 50:wake 51:ACSR?04 52:ACSR?34 60:icp?5L,20H
    23     what is on its way comes after it                   | 10:AIN0=1 11:sleep 40:ACSR?00 50:wake 51:ACSR?30
    23.3.2 reset                                               | 5:ACSR=0C 10:AIN0=1 20:reset 20:ACSR?20 20:irq?0 30:icp?5L,10H,20-
";

#[test]
fn the_cases_of_the_data_sheet() {
    for line in CASES.lines().map(str::trim).filter(|line| !line.is_empty()) {
        run(line).unwrap_or_else(|said| panic!("{said}"));
    }
}

#[test]
fn a_wrong_case_is_found() {
    assert!(run("x | 10:AIN0=1 11:ACSR?30").is_err());
    assert!(run("x | 10:AIN0=1 20:flags?13").is_err());
}
