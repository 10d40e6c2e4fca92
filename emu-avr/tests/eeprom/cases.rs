//! Cases from DS40002061, one per line: section, topic, steps. A step is `edge:NAME=value` (a write),
//! `edge:NAME|mask` and `edge:NAME&mask` (SBI, CBI), `cycle:NAME?value` or `edge:what`. Values are
//! hexadecimal, times decimal. The clock is 1,000,000 Hz, and the cell n of 1024 holds n + 40h.

use std::sync::Arc;

use emu_avr::periph::eeprom::{AvrEeprom, AvrEepromKind, EepromRegister};
use emu_avr::periph::{AvrOutbox, AvrSignal, Device};
use emu_core::NEVER;

const REGS: [EepromRegister; 4] =
    [EepromRegister::EEARL, EepromRegister::EEARH, EepromRegister::EEDR, EepromRegister::EECR];

fn step(dut: &mut AvrEeprom, stalls: &mut Vec<String>, step: &str) -> Result<(), String> {
    let (t, what) = step.split_once(':').ok_or("no time")?;
    let t: u64 = t.parse().map_err(|_| "time")?;
    let hex = |text: &str| usize::from_str_radix(text, 16).map_err(|e| e.to_string());
    let mut out = AvrOutbox::new();
    let place = what.find(['?', '=', '|', '&']);
    let (name, value) = place.map_or((what, ""), |at| (&what[..at], &what[at + 1..]));
    let reg = REGS.into_iter().find(|reg| format!("{reg:?}") == name);
    if what.contains('?') {
        let got = match (reg, name.strip_prefix('@')) {
            (Some(reg), _) => format!("{:02X}", dut.read(reg, t, &mut out)),
            (_, Some(cell)) => {
                dut.run_due(t, &mut out);
                format!("{:02X}", dut.cells()[hex(cell)?])
            }
            _ if name == "irq" => {
                dut.run_due(t, &mut out);
                dut.interrupt_requests().to_string()
            }
            _ if name == "next" && dut.next_deadline() == NEVER => "-".to_string(),
            _ if name == "next" => dut.next_deadline().to_string(),
            _ if name == "halts" => std::mem::take(stalls).join(","),
            _ => return Err("no such thing".into()),
        };
        return if got == value { Ok(()) } else { Err(format!("it is {got}")) };
    }
    match (reg, name) {
        (Some(reg), _) => {
            let (value, mask) = match &what[place.unwrap_or(0)..][..1] {
                "=" => (hex(value)?, 0xFF),
                "|" => (0xFF, hex(value)?),
                _ => (0, hex(value)?),
            };
            dut.write(reg, value as u8, mask as u8, t, &mut out);
        }
        (_, "blocked") => dut.block_until(value.parse().map_err(|_| "until")?, t),
        (_, "hz") => dut.set_clock_hz(value.parse().map_err(|_| "hz")?, t),
        (_, "sleep") => dut.stop_clock(t, &mut out),
        (_, "wake") => dut.restart_clock(t, &mut out),
        (_, "reset") => dut.reset(false, t, &mut out),
        _ => return Err("no such step".into()),
    }
    for signal in out {
        let AvrSignal::Stall { until } = signal else { return Err(format!("{signal:?}")) };
        stalls.push(format!("{t}-{until}"));
    }
    Ok(())
}

fn run(line: &str) -> Result<(), String> {
    let steps = line.split('|').collect::<Vec<_>>()[1..].join("|");
    let old = line.starts_with("mega8");
    let cells = (0..if old { 512 } else { 1024 }).map(|n| (n as u8).wrapping_add(0x40)).collect();
    let kind = if old { AvrEepromKind::MEGA8 } else { AvrEepromKind::MEGA48 };
    let mut dut = AvrEeprom::new(kind, Arc::new(cells), 1_000_000);
    let mut stalls = Vec::new();
    for text in steps.split_whitespace() {
        step(&mut dut, &mut stalls, text).map_err(|said| format!("{line}\n  at {text}: {said}"))?;
    }
    Ok(())
}

const CASES: &str = "
    8.6.3 a read: data at once, the core halts 4 cycles     | 8:EEARL=05 9:EECR=01 9:EECR?00 9:EEDR?45 9:halts?9-13
    8.6.1 from all of the memory                            | 7:EEARL=05 8:EEARH=03 9:EECR|01 9:EEDR?45 9:EEARH?03
    8.6.1 EEAR has the bits that the memory needs           | 7:EEARL=FF 8:EEARH=FF 9:EEARL?FF 9:EEARH?03
    8.6.3 a write: 3.4 ms, the core halts 2 cycles          | 7:EEARL=05 7:EEDR=5A 9:EECR=04 10:EECR=02 10:halts?10-12 10:EECR?02 3409:EECR?02 3409:@5?45 3410:EECR?00 3410:@5?5A
    8.6.3 EEMPE stays for four cycles                       | 9:EECR=04 9:EECR?04 12:EECR?04 13:EECR?00
    8.6.3 EEPE in the last of them                          | 9:EECR|04 13:EECR|02 13:halts?13-15 13:EECR?02
    8.6.3 EEPE after them                                   | 9:EECR|04 14:EECR|02 14:halts? 14:EECR?00
    8.6.3 EEPE without EEMPE                                | 9:EECR=02 9:EECR?00 9:halts?
    8.6.3 both at once start nothing                        | 9:EECR=06 9:EECR?04 9:halts? 11:EECR=02 11:EECR?02
    8.6.3 EEMPE stays after EEPE                            | 9:EECR|04 11:EECR|02 12:EECR?06 13:EECR?02
    8.6.3 EEMPE written 0 closes                            | 9:EECR=04 10:EECR=00 10:EECR?00 11:EECR=02 11:EECR?00
    8.6.3 EEMPE again opens anew                            | 9:EECR=04 13:EECR=04 17:EECR=02 17:EECR?02
    8.6.3 EEPE written 0 does not stop it                   | 9:EECR|04 11:EECR|02 50:EECR=00 50:EECR?02 3410:EECR?02 3411:EECR?00
    8.6.3 erase only: 1.8 ms                                | 7:EEARL=05 8:EECR=10 9:EECR|04 11:EECR|02 11:EECR?16 1810:EECR?12 1811:EECR?10 1811:@5?FF
    8.6.3 write only: 1.8 ms, and 1s stay as they are       | 7:EEARL=05 7:EEDR=3C 8:EECR=20 9:EECR|04 11:EECR|02 1810:EECR?22 1811:EECR?20 1811:@5?04
    8.6.3 the reserved mode changes nothing                 | 7:EEARL=05 7:EEDR=3C 8:EECR=30 9:EECR|04 11:EECR|02 1811:EECR?30 1811:@5?45
    8.6.3 EEPM in the write of EEMPE                        | 7:EEARL=05 9:EECR=14 11:EECR|02 1811:EECR?10 1811:@5?FF
    8.6.3 EEPM cannot change in a write                     | 9:EECR|04 11:EECR|02 20:EECR=10 20:EECR?02
    8.6.3 nor EEAR                                          | 7:EEARL=05 9:EECR|04 11:EECR|02 20:EEARL=07 20:EEARH=01 20:EEARL?05 20:EEARH?00 3411:EEARL=07 3411:EEARL?07
    8.6.2 EEDR can, and the write keeps the old one         | 7:EEARL=05 7:EEDR=5A 9:EECR|04 11:EECR|02 20:EEDR=66 20:EEDR?66 3411:@5?5A
    8.6.3 no read in a write                                | 7:EEARL=05 7:EEDR=5A 9:EECR|04 11:EECR|02 11:halts?11-13 20:EECR|01 20:EEDR?5A 20:halts?
    8.6.3 no second write                                   | 9:EECR|04 11:EECR|02 20:EECR|04 22:EECR|02 22:halts?11-13 3411:EECR?00
    8.6.3 EEPE overrides EERE                               | 9:EECR|04 11:EECR=03 11:halts?11-13 11:EEDR?00 11:EECR?02
    8.6.3 EERIE asks while EEPE is clear                    | 9:EECR=08 9:irq?1 10:EECR=0C 12:EECR=0A 12:irq?0 12:next?3412 3411:irq?0 3412:irq?1 3500:EECR=00 3500:irq?0
    8.6.3 without EERIE nothing is due                      | 9:EECR|04 11:EECR|02 11:next?-
    8.6.3 no write while program memory is written          | 5:blocked=100 9:EECR|04 11:EECR|02 11:EECR?04 11:halts? 98:EECR|04 100:EECR|02 100:EECR?06
    8.6.3 nor the interrupt                                 | 5:EECR=08 6:blocked=100 6:irq?0 6:next?100 99:irq?0 100:irq?1
    8.6.3 reads go on                                       | 5:blocked=100 7:EEARL=05 9:EECR|01 9:EEDR?45
    8.6   EECR has six bits                                 | 9:EECR=FC 9:EECR?3C
    8.6   reset: EEDR and EECR, but not EEAR                | 7:EEARL=05 7:EEARH=01 7:EEDR=5A 9:EECR=3C 10:reset 10:EECR?00 10:EEDR?00 10:EEARL?05 10:EEARH?01
    8.4.2 a write goes on in reset                          | 7:EEARL=05 7:EEDR=3C 8:EECR=28 9:EECR|04 11:EECR|02 12:reset 12:EECR?22 1810:EECR?22 1811:EECR?20 1811:@5?04
    8.4.1 and in sleep                                      | 7:EEARL=05 7:EEDR=3C 9:EECR|04 11:EECR|02 12:sleep 3411:@5?3C 4000:wake 4000:EECR?00
    8.6.3 the time is that of another oscillator            | 9:EECR|04 11:EECR|02 1011:hz=2000000 5810:EECR?02 5811:EECR?00
    mega8 no modes, 8,448 us                                | 7:EEARL=05 7:EEDR=5A 9:EECR=34 9:EECR?04 10:EECR=02 8457:EECR?02 8458:EECR?00 8458:@5?5A
    mega8 nine bits of EEAR                                 | 7:EEARH=FF 7:EEARH?01
";

#[test]
fn the_cases_of_the_data_sheet() {
    for line in CASES.lines().map(str::trim).filter(|line| !line.is_empty()) {
        run(line).unwrap_or_else(|said| panic!("{said}"));
    }
}

#[test]
fn a_wrong_case_is_found() {
    assert!(run("x | 9:EECR=04 13:EECR?04").is_err());
    assert!(run("x | 9:EECR=01 9:halts?9-12").is_err());
}

#[test]
fn cells_are_set_from_outside() {
    let mut dut = AvrEeprom::new(AvrEepromKind::MEGA48, Arc::new(vec![1, 2, 3]), 1_000_000);
    let before = Arc::clone(dut.cells());
    assert!(dut.set_cell(1, 9) && !dut.set_cell(3, 9));
    assert_eq!((dut.cells()[..].to_vec(), before[..].to_vec()), (vec![1, 9, 3], vec![1, 2, 3]));
    // Three cells need two address bits, and the fourth cell does not exist.
    let mut out = AvrOutbox::new();
    dut.write(EepromRegister::EEARL, 0xFF, 0xFF, 1, &mut out);
    dut.write(EepromRegister::EECR, 1, 1, 2, &mut out);
    assert_eq!([dut.peek(EepromRegister::EEARL, 2), dut.peek(EepromRegister::EEDR, 2)], [3, 0xFF]);
    let mut none = AvrEeprom::new(AvrEepromKind::MEGA48, Arc::default(), 1_000_000);
    none.write(EepromRegister::EECR, 1, 1, 2, &mut out);
    assert_eq!(none.peek(EepromRegister::EEDR, 2), 0xFF);
}
