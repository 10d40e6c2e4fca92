//! Cases, one per line: section (of DS40002061, or the chip), topic, steps. A step is `edge:NAME=value` (a
//! write, or the level of a pin: INTn, PCn), `cycle:NAME?value` or `edge:what`. Registers are hexadecimal.
//! `NAME.n=v` writes one bit.

use emu_avr::periph::external::{ExternalInterrupts, ExternalKind, ExternalRegister};
use emu_avr::periph::{AvrLine, AvrOutbox, AvrSignal, Device};
use emu_core::NEVER;

struct TestBench {
    dut: ExternalInterrupts,
    out: AvrOutbox,
    flags: Vec<u64>,
}

fn reg(name: &str) -> Result<ExternalRegister, String> {
    Ok(match name {
        "EICRA" => ExternalRegister::EICRA,
        "EICRB" => ExternalRegister::EICRB,
        "EIMSK" => ExternalRegister::EIMSK,
        "EIFR" => ExternalRegister::EIFR,
        "PCICR" => ExternalRegister::PCICR,
        "PCIFR" => ExternalRegister::PCIFR,
        "PCMSK0" => ExternalRegister::PCMSK0,
        "PCMSK1" => ExternalRegister::PCMSK1,
        "PCMSK2" => ExternalRegister::PCMSK2,
        "PCMSK3" => ExternalRegister::PCMSK3,
        _ => return Err(format!("no register {name}")),
    })
}

fn number(text: &str) -> Result<u8, String> {
    text.parse().map_err(|_| format!("not a number: {text}"))
}

impl TestBench {
    fn ask(&mut self, name: &str, t: u64) -> Result<String, String> {
        self.dut.run_due(t, &mut self.out);
        self.drain();
        Ok(match name {
            "irq" => format!("{:02X}", self.dut.interrupt_requests()),
            "flags" => self.flags.iter().map(u64::to_string).collect::<Vec<_>>().join(","),
            "flag" => u8::from(self.dut.flag()).to_string(),
            "next" if self.dut.next_deadline() == NEVER => "-".into(),
            "next" => self.dut.next_deadline().to_string(),
            "steady" if self.dut.steady_until(ExternalRegister::EIFR, t) == NEVER => "-".into(),
            "steady" => self.dut.steady_until(ExternalRegister::EIFR, t).to_string(),
            _ => format!("{:02X}", self.dut.read(reg(name)?, t, &mut self.out)),
        })
    }

    fn step(&mut self, step: &str) -> Result<(), String> {
        let (t, what) = step.split_once(':').ok_or("no time")?;
        let t: u64 = t.parse().map_err(|_| "time")?;
        if let Some((name, want)) = what.split_once('?') {
            let got = self.ask(name, t)?;
            return if got == want { Ok(()) } else { Err(format!("it is {got}")) };
        }
        let out = &mut self.out;
        match what.split_once('=') {
            Some(("taken", irq)) => self.dut.on_interrupt_taken(number(irq)?, t, out),
            Some(("listen", on)) => self.dut.set_flag_listener(on == "1", t, out),
            Some((name, level)) if name.starts_with("INT") => {
                self.dut.on_line_changed(AvrLine::Int(number(&name[3..])?), level == "1", t, out);
            }
            Some((name, level)) if name.starts_with("PC") && !name[2..].starts_with(['I', 'M']) => {
                self.dut.on_line_changed(AvrLine::Pc(number(&name[2..])?), level == "1", t, out);
            }
            Some((name, value)) => {
                // NAME.n=v writes one bit as SBI and CBI do.
                let (name, bit) = name.split_once('.').map_or((name, None), |(name, bit)| (name, Some(bit)));
                let value = u8::from_str_radix(value, 16).map_err(|e| e.to_string())?;
                let (value, mask) = match bit {
                    Some(bit) => (value << number(bit)?, 1 << number(bit)?),
                    None => (value, 0xFF),
                };
                self.dut.write(reg(name)?, value, mask, t, out);
            }
            None => match what {
                "sleep" => self.dut.stop_clock(t, out),
                "wake" => self.dut.restart_clock(t, out),
                "reset" => self.dut.reset(false, t, out),
                _ => return Err("no such step".into()),
            },
        }
        self.drain();
        Ok(())
    }

    fn drain(&mut self) {
        for signal in self.out.drain(..) {
            match signal {
                AvrSignal::Flag { t, irq: 0 } => self.flags.push(t),
                other => panic!("{other:?}"),
            }
        }
    }
}

fn run(line: &str) -> Result<(), String> {
    let (head, steps) = line.split_once('|').ok_or("two columns")?;
    let kind = match head.split_whitespace().next() {
        Some("m8") => ExternalKind::MEGA8,
        Some("m16") => ExternalKind::MEGA16,
        Some("m162") => ExternalKind::MEGA162,
        Some("m128") => ExternalKind::MEGA128,
        Some("2545") => ExternalKind::MEGA48,
        _ => ExternalKind::MEGA328,
    };
    let mut bench = TestBench { dut: ExternalInterrupts::new(kind), out: AvrOutbox::new(), flags: Vec::new() };
    for text in steps.split_whitespace() {
        bench.step(text).map_err(|said| format!("{line}\n  at {text}: {said}"))?;
    }
    Ok(())
}

const CASES: &str = "
    13.2.1 ISC0 = 3: rising, three cycles after the pin    | 2:EICRA=03 10:INT0=1 12:EIFR?00 13:EIFR?01 20:EIFR=01 30:INT0=0 40:EIFR?00
    13.2.1 ISC0 = 2: falling                               | 2:EICRA=02 10:INT0=1 20:EIFR?00 30:INT0=0 32:EIFR?00 33:EIFR?01
    13.2.1 ISC0 = 1: any change                            | 2:EICRA=01 10:INT0=1 13:EIFR?01 14:EIFR=01 15:EIFR?00 20:INT0=0 23:EIFR?01
    13.2.1 ISC1 is by itself                               | 2:EICRA=0C 10:INT1=1 10:INT0=1 13:EIFR?02
    13.2.1 a pulse of one cycle gets through               | 2:EICRA=03 10:INT0=1 11:INT0=0 13:EIFR?01
    13.2.1 a shorter one does not                          | 2:EICRA=01 10:INT0=1 10:INT0=0 20:EIFR?00
    13.2.1 low: asks as long as it is low, and has no flag | 2:EIMSK=01 2:irq?01 9:EIFR?00 10:INT0=1 10:irq?00 20:INT0=0 20:irq?01 20:EIFR?00
    13.2.1 the entry does not end it                       | 2:EIMSK=01 3:taken=0 3:irq?01
    13.2.3 INTF is always clear at low level               | 2:EICRA=03 10:INT0=1 13:EIFR?01 15:EICRA=00 15:EIFR?00 16:EICRA=03 16:EIFR?00
    13.2.1 what is on its way counts by the new ISC        | 2:EICRA=03 10:INT0=1 12:EICRA=02 20:EIFR?00
    13.2.1 a write at the edge of the flag is too late     | 2:EICRA=03 10:INT0=1 13:EICRA=02 20:EIFR?01
    13.2.1 a change of ISC alone sets nothing              | 5:INT0=1 20:EICRA=02 30:EICRA=03 40:EICRA=01 50:EIFR?00
    13.2.2 the flag does not need EIMSK, the interrupt does| 2:EICRA=03 10:INT0=1 12:next?- 13:irq?00 20:EIMSK=01 20:irq?01
    13.2.2 with EIMSK the flag is reported                 | 2:EICRA=03 2:EIMSK=01 10:INT0=1 10:next?13 13:next?- 13:irq?01
    13.2.2 but not what sets nothing                       | 2:EICRA=03 2:EIMSK=01 10:INT0=1 20:INT0=0 20:next?-
    13.2.3 the entry clears                                | 2:EICRA=0F 2:EIMSK=03 10:INT0=1 10:INT1=1 13:irq?03 14:taken=1 14:irq?01 15:EIFR?01
    13.2.3 1 clears, 0 keeps                               | 2:EICRA=0F 10:INT0=1 10:INT1=1 15:EIFR=02 15:EIFR?01 16:EIFR=00 16:EIFR?01
    13.2.3 one bit                                         | 2:EICRA=0F 10:INT0=1 10:INT1=1 15:EIFR.1=1 15:EIFR?01 16:EIFR.0=0 16:EIFR?01
    13.2.3 not at the edge that sets it                    | 2:EICRA=03 10:INT0=1 13:EIFR=01 13:EIFR?01 14:EIFR=01 14:EIFR?00
    13.2   registers                                       | 2:EICRA=FF 2:EICRA?0F 2:EICRB=FF 2:EICRB?00 2:EIMSK=FF 2:EIMSK?03 2:PCICR=FF 2:PCICR?07 2:EIFR?00
    13.2   masks                                           | 2:PCMSK0=FF 2:PCMSK0?FF 2:PCMSK1=FF 2:PCMSK1?7F 2:PCMSK2=A5 2:PCMSK2?A5 2:PCMSK3=FF 2:PCMSK3?00
    13.2   reads are steady until a flag comes             | 2:EICRA=03 2:steady?- 10:INT0=1 10:steady?13 13:steady?-
    f13-1  PCIF comes three cycles after the pin           | 2:PCMSK0=01 10:PC0=1 12:PCIFR?00 13:PCIFR?01 14:PCIFR=01 14:PCIFR?00 20:PC0=0 23:PCIFR?01
    f13-1  of the pins of PCMSK only                       | 2:PCMSK0=01 10:PC1=1 20:PCIFR?00 20:PC0=1 30:PCIFR?01
    f13-1  each group has its own                          | 2:PCMSK1=40 2:PCMSK2=80 10:PC14=1 13:PCIFR?02 20:PC23=1 23:PCIFR?06
    f13-1  PCMSK counts in the cycle of the change         | 10:PC0=1 10:PCMSK0=01 13:PCIFR?01
    f13-1  and not after it                                | 10:PC0=1 11:PCMSK0=01 20:PCIFR?00
    f13-1  taken away later, the change still counts       | 2:PCMSK0=01 10:PC0=1 11:PCMSK0=00 13:PCIFR?01
    f13-1  PCMSK alone sets nothing                        | 10:PC0=1 20:PCMSK0=01 30:PCMSK0=00 40:PCIFR?00
    f13-1  one pin up and another down is a change         | 2:PCMSK0=03 10:PC0=1 20:PCIFR=01 20:PC0=0 20:PC1=1 23:PCIFR?01
    13.2.4 the interrupts behind those of INT              | 2:PCMSK0=01 2:PCMSK1=01 2:PCMSK2=01 2:PCICR=07 10:PC0=1 13:irq?04 20:PC8=1 23:irq?0C 30:PC16=1 33:irq?1C
    13.2.4 the entry clears                                | 2:PCMSK1=01 2:PCICR=07 10:PC8=1 13:irq?08 14:taken=3 14:irq?00 14:PCIFR?00
    13.2.4 PCIF does not need PCIE, the interrupt does     | 2:PCMSK0=01 10:PC0=1 12:next?- 13:irq?00 20:PCICR=01 20:irq?04
    13.2.5 not at the edge that sets it                    | 2:PCMSK0=01 10:PC0=1 13:PCIFR=01 13:PCIFR?01 14:PCIFR=01 14:PCIFR?00
    13.2.5 three changes one after the other               | 2:PCMSK0=01 10:PC0=1 11:PC0=0 12:PC0=1 13:PCIFR?01 14:PCIFR=01 14:PCIFR?01 15:PCIFR=01 15:PCIFR?01 16:PCIFR=01 16:PCIFR?00
    2545   edges of INT need the clock: none is seen       | 2:EICRA=01 2:EIMSK=01 10:sleep 20:INT0=1 25:INT0=0 30:irq?00 40:wake 50:EIFR?00
    2545   one that stays is seen when it runs again       | 2:EICRA=01 2:EIMSK=01 10:sleep 20:INT0=1 30:irq?00 40:wake 42:EIFR?00 43:EIFR?01
    2545   what is on its way waits                        | 2:EICRA=01 2:EIMSK=01 10:INT0=1 12:sleep 20:next?- 20:irq?00 40:wake 40:next?41 41:irq?01
    2545   the change at the edge of sleep is not sampled  | 2:EICRA=01 10:INT0=1 10:sleep 40:wake 42:EIFR?00 43:EIFR?01
    13     any edge of INT wakes, as on silicon            | 2:EICRA=01 2:EIMSK=01 10:sleep 20:INT0=1 20:irq?01 20:EIFR?01 40:wake 41:taken=0 50:EIFR?00
    13     one that is back leaves its interrupt           | 2:EICRA=03 2:EIMSK=01 10:sleep 20:INT0=1 25:INT0=0 30:irq?01 40:wake 40:irq?01 50:EIFR?01
    13     rising and falling, INT1                        | 2:EICRA=08 2:EIMSK=03 10:sleep 20:INT1=1 20:irq?01 25:INT1=0 25:irq?03 30:INT0=1 30:irq?02
    13     one on its way wakes, and comes once            | 2:EICRA=03 2:EIMSK=01 10:INT0=1 12:sleep 12:irq?01 40:wake 40:taken=0 50:EIFR?00
    13     one at the edge of sleep does                   | 2:EICRA=03 2:EIMSK=01 10:INT0=1 10:sleep 10:irq?01
    13     the wrong one does not                          | 2:EICRA=02 2:EIMSK=01 10:sleep 20:INT0=1 30:irq?00 40:wake 50:EIFR?00
    13     nor one that EIMSK leaves out                   | 2:EICRA=03 10:sleep 20:INT0=1 30:irq?00 40:wake 50:EIFR?01
    13     low level wakes                                 | 2:INT0=1 3:EIMSK=01 10:sleep 15:irq?00 20:INT0=0 20:irq?01 40:wake 40:irq?01
    13.1   gone before the end of start-up: no interrupt   | 2:INT0=1 3:EIMSK=01 10:sleep 20:INT0=0 20:irq?01 30:INT0=1 30:irq?00 40:wake 50:irq?00
    13     a pin change wakes, and has its flag then       | 2:PCMSK0=01 2:PCICR=01 10:sleep 20:PC0=1 20:irq?04 20:PCIFR?00 40:wake 40:irq?00 43:irq?04 43:PCIFR?01
    13     without PCIE or PCMSK it does not               | 2:PCMSK0=01 2:PCICR=02 10:sleep 20:PC0=1 20:PC8=1 20:irq?00
    f13-1  a pin that is back in time leaves no flag       | 2:PCMSK0=01 2:PCICR=01 10:sleep 20:PC0=1 25:PC0=0 25:irq?00 40:wake 50:PCIFR?00
    f13-1  a change on its way wakes too                   | 2:PCMSK0=01 2:PCICR=01 10:PC0=1 12:sleep 12:irq?04 40:wake 41:PCIFR?01
    13     reset                                           | 2:EICRA=03 2:EIMSK=03 2:PCMSK0=01 2:PCICR=01 10:INT0=1 10:PC0=1 20:reset 20:EICRA?00 20:EIMSK?00 20:EIFR?00 20:PCIFR?00 20:PCICR?00 20:PCMSK0?00
    13     reset loses what is on its way                  | 2:PCMSK0=01 10:PC0=1 12:reset 20:PCIFR?00
    24.9.2 INTF0 is reported to the converter              | 2:EICRA=0F 2:listen=1 10:INT1=1 10:INT0=1 10:next?13 20:flag?1 20:INT0=0 30:INT0=1 30:next?- 40:flags?13
    24.9.2 again when it was cleared                       | 2:EICRA=03 2:listen=1 10:INT0=1 20:EIFR=01 20:flag?0 20:INT0=0 30:INT0=1 40:flags?13,33
    24.9.2 not to nobody                                   | 2:EICRA=03 10:INT0=1 20:flags? 20:flag?1
    m8     two inputs and no groups                        | 2:PCICR=FF 2:PCICR?00 2:PCMSK0=FF 2:PCMSK0?00 2:EICRA=FF 2:EICRA?0F 10:PC0=1 20:PCIFR?00
    m8     what it does not have is ignored                | 2:EICRA=FF 10:INT2=1 10:INT7=1 10:INT9=1 10:PC40=1 20:EIFR?00
    m16    INT2: ISC2 alone                                | 2:EICRA=FF 2:EICRA?1F 2:EIMSK=FF 2:EIMSK?07
    m16    falling by ISC2 = 0, at once and without a clock| 5:INT2=1 10:EIMSK=04 10:sleep 20:irq?00 30:INT2=0 30:irq?04 40:wake 40:EIFR?04 41:taken=2 41:irq?00
    m16    no low level                                    | 2:EIMSK=04 10:irq?00 20:EIFR?00
    m16    rising by ISC2 = 1, however short               | 2:EICRA=10 10:INT2=1 10:INT2=0 10:EIFR?04 20:EIFR=04 20:INT2=0 30:EIFR?00
    m16    a change of ISC2 can be an edge                 | 5:INT2=1 10:EICRA=10 10:EIFR?04 20:EIFR=04 20:EICRA=00 20:EIFR?00 30:INT2=0 30:EIFR?04
    m16    not cleared at the edge that sets it            | 2:EICRA=10 10:INT2=1 10:EIFR=04 10:EIFR?04 11:EIFR=04 11:EIFR?00
    m162   groups behind three inputs                      | 2:PCMSK0=80 2:PCMSK1=01 2:PCICR=03 10:PC7=1 10:PC8=1 13:irq?18 14:taken=3 14:irq?10
    m128   eight inputs                                    | 2:EICRA=FF 2:EICRA?FF 2:EICRB=1B 2:EICRB?1B 2:EIMSK=FF 2:EIMSK?FF
    m128   INT3 to INT0 at once, INT7 to INT4 synchronised | 2:EICRA=FF 2:EICRB=FF 10:INT0=1 10:INT3=1 10:INT4=1 10:INT7=1 10:EIFR?09 12:EIFR?09 13:EIFR?99
    m128   INT3 to INT0 need no clock, INT7 to INT4 do     | 2:EICRA=FF 2:EICRB=FF 2:EIMSK=FF 10:sleep 20:INT0=1 20:INT4=1 20:irq?01
    m128   ISC = 1: any change of INT7 to INT4             | 2:EICRB=01 10:INT4=1 20:EIFR?10 20:EIFR=10 30:INT4=0 33:EIFR?10
    m128   which is reserved for INT3 to INT0              | 2:EICRA=01 2:EIMSK=01 10:irq?00 10:INT0=1 20:INT0=0 30:EIFR?00 30:irq?00
    m128   low levels of all                               | 2:EIMSK=FF 2:irq?FF 10:INT7=1 10:INT2=1 10:irq?7B
    m128   from low level to the rising edge of a high pin | 5:INT0=1 10:EICRA=03 10:EIFR?01
    m128   INT0 is reported when the pin changes           | 2:EICRA=03 2:listen=1 10:INT0=1 20:flags?10
";

#[test]
fn the_cases_of_the_data_sheet() {
    for line in CASES.lines().map(str::trim).filter(|line| !line.is_empty()) {
        run(line).unwrap_or_else(|said| panic!("{said}"));
    }
}

#[test]
fn a_wrong_case_is_found() {
    assert!(run("x | 2:EICRA=03 10:INT0=1 12:EIFR?01").is_err());
    assert!(run("x | 2:PCMSK0=01 10:PC0=1 13:PCIFR?00").is_err());
}
