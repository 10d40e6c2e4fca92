//! Cases from DS40002061, one per line: section, topic, steps. A step is `edge:CSR=value`, `cycle:CSR?value`,
//! `edge:spm.Z=R1R0@PC` (ends at the edge), `cycle:lpm.Z@PC?value` (starts in the cycle; `-` means program
//! memory) or `edge:what`. Addresses are byte addresses; addresses and values are hexadecimal, times decimal.
//! The clock is 1,000,000 Hz; the boot section starts at 7800, NRWW at 7000.

use emu_avr::periph::spm::{ConfigBytes, SelfProgramming, SpmKind, SpmRegister};
use emu_avr::periph::{AvrOutbox, AvrSignal, Device};
use emu_core::NEVER;

const REG: SpmRegister = SpmRegister::SPMCSR;

fn hex(text: &str) -> Result<u32, String> {
    u32::from_str_radix(text, 16).map_err(|e| format!("{text}: {e}"))
}

/// Formats a signal; of the words only those other than FFFF, with their positions.
fn text(signal: &AvrSignal) -> String {
    match signal {
        AvrSignal::ErasePage { addr } => format!("E{addr:X}"),
        AvrSignal::WritePage { addr, words } => {
            let loaded = words.iter().enumerate().filter(|(_, word)| **word != 0xFFFF);
            format!("W{addr:X}/{}", words.len())
                + &loaded.map(|(n, word)| format!("+{n}={word:04X}")).collect::<String>()
        }
        AvrSignal::Stall { until } => format!("H{until}"),
        other => format!("{other:?}"),
    }
}

fn step(dut: &mut SelfProgramming, said: &mut Vec<String>, step: &str) -> Result<(), String> {
    let (t, what) = step.split_once(':').ok_or("no time")?;
    let t: u64 = t.parse().map_err(|_| "time")?;
    let mut out = AvrOutbox::new();
    if let Some((name, want)) = what.split_once('?') {
        let got = match name.split_once('.') {
            Some((_, place)) => {
                let (z, pc) = place.split_once('@').ok_or("PC")?;
                dut.lpm(hex(z)?, hex(pc)?, t).map_or("-".into(), |byte| format!("{byte:02X}"))
            }
            None => {
                dut.run_due(t, &mut out);
                match name {
                    "CSR" => format!("{:02X}", dut.read(REG, t, &mut out)),
                    "irq" => dut.interrupt_requests().to_string(),
                    "next" if dut.next_deadline() == NEVER => "-".into(),
                    "next" => dut.next_deadline().to_string(),
                    "busy" => dut.busy_until().to_string(),
                    "lock" => format!("{:02X}", dut.config_bytes().lock),
                    _ => std::mem::take(said).join(","),
                }
            }
        };
        return if got == want { Ok(()) } else { Err(format!("it is {got}")) };
    }
    let (name, value) = what.split_once('=').unwrap_or((what, ""));
    match name {
        "CSR" => dut.write(REG, hex(value)? as u8, 0xFF, t, &mut out),
        "eeprom" => dut.block_until(value.parse().map_err(|_| "until")?, t),
        "hz" => dut.set_clock_hz(value.parse().map_err(|_| "hz")?, t),
        "sleep" => dut.stop_clock(t, &mut out),
        "wake" => dut.restart_clock(t, &mut out),
        "reset" => dut.reset(false, t, &mut out),
        _ => {
            let z = name.strip_prefix("spm.").ok_or("no such step")?;
            let (data, pc) = value.split_once('@').ok_or("PC")?;
            dut.spm(hex(z)?, hex(data)? as u16, hex(pc)?, t, &mut out);
        }
    }
    said.extend(out.iter().map(text));
    Ok(())
}

fn run(line: &str) -> Result<(), String> {
    let (head, steps) = line.split_once('|').ok_or("two columns")?;
    let (kind, boot) = match head.split_whitespace().next() {
        Some("mega48") => (SpmKind::MEGA48, 0),
        Some("mega8") => (SpmKind::MEGA8, 0x1E00),
        Some("mega128") => (SpmKind::MEGA128, 0x1_FC00),
        _ => (SpmKind::MEGA328, 0x7800),
    };
    // The head of a case contains its lock bits.
    let lock =
        head.split_once("lock=").map_or(Ok(0xFF), |(_, lock)| hex(lock.split_whitespace().next().unwrap_or("")))?;
    let bytes =
        ConfigBytes { lock: lock as u8, fuses: [0x62, 0xD9, 0xFE], signature: [0x1E, 0x95, 0x14], calibration: 0xA7 };
    let (mut dut, mut said) = (SelfProgramming::new(kind, bytes, boot, 1_000_000), Vec::new());
    for text in steps.split_whitespace() {
        step(&mut dut, &mut said, text).map_err(|said| format!("{line}\n  at {text}: {said}"))?;
    }
    if said.is_empty() { Ok(()) } else { Err(format!("{line}\n  not named: {said:?}")) }
}

const CASES: &str = "
    27.9.1 SPMEN stays for four cycles                    | 9:CSR=01 9:CSR?01 12:CSR?01 13:CSR?00
    27.9.1 SPM in the last of them                        | 9:CSR=03 13:spm.100=0@7800 13:CSR?43 13:said?E100
    27.9.1 SPM after them                                 | 9:CSR=03 14:spm.100=0@7800 14:CSR?00
    27.9.1 SPM without SPMEN                              | 9:spm.100=0@7800 9:CSR?00
    27.9.1 other combinations have no effect              | 9:CSR=07 9:CSR?00 9:CSR=19 9:CSR?00 9:CSR=02 9:CSR?00 9:CSR=23 9:CSR?00
    27.9.1 nor do they end one in progress                | 9:CSR=03 10:CSR=80 10:CSR?83 11:CSR=86 11:CSR?83 12:spm.100=0@7800 12:said?E100
    27.9.1 a new one replaces it, with its own time       | 9:CSR=03 12:CSR=01 12:CSR?01 15:CSR?01 16:CSR?00
    27.8.1 page erase: 4.1 ms                             | 9:CSR=03 10:spm.1FE=0@7800 10:said?E180 10:CSR?43 10:busy?4110 4109:CSR?43 4110:CSR?40
    27.8.3 page write: words that were not loaded are FFFF | 1:CSR=01 2:spm.04=1234@7800 5:CSR=01 6:spm.7F=ABCD@7800 9:CSR=05 10:spm.100=0@7800 10:said?W100/64+2=1234+63=ABCD 10:CSR?45 4110:CSR?40
    27.8.2 a load is over at once                         | 1:CSR=01 2:spm.04=1234@7800 2:CSR?00
    27.8.2 each word is loaded once                       | 1:CSR=01 2:spm.04=1234@7800 5:CSR=01 6:spm.05=ABCD@7800 9:CSR=05 10:spm.0=0@7800 10:said?W0/64+2=1234
    27.8.2 the page of Z is not looked at                 | 1:CSR=01 2:spm.1204=1234@7800 9:CSR=05 10:spm.0=0@7800 10:said?W0/64+2=1234
    27.8.2 a page write erases the buffer                 | 1:CSR=01 2:spm.04=1234@7800 9:CSR=05 10:spm.0=0@7800 5009:CSR=05 5010:spm.0=0@7800 5010:said?W0/64+2=1234,W0/64
    27.8.2 so does the write of RWWSRE                    | 1:CSR=01 2:spm.04=1234@7800 5:CSR=11 9:CSR=05 10:spm.0=0@7800 10:said?W0/64
    27.8.2 and a reset                                    | 1:CSR=01 2:spm.04=1234@7800 5:reset 9:CSR=05 10:spm.0=0@7800 10:said?W0/64
    27.8.1 and a write of the EEPROM                      | 1:CSR=01 2:spm.04=1234@7800 3:eeprom=6 9:CSR=05 10:spm.0=0@7800 10:said?W0/64
    27.8.2 not a page erase                               | 1:CSR=01 2:spm.04=1234@7800 9:CSR=03 10:spm.0=0@7800 5009:CSR=05 5010:spm.0=0@7800 5010:said?E0,W0/64+2=1234
    27.5   NRWW: the core halts, RWWSB stays clear        | 9:CSR=03 10:spm.7000=0@7800 10:said?E7000,H4110 10:CSR?03 4110:CSR?00
    27.5   the last page of RWW                           | 9:CSR=03 10:spm.6FFF=0@7800 10:said?E6F80 10:CSR?43
    27.5   RWW is unreadable until RWWSRE, NRWW is not    | 9:CSR=03 10:spm.0=0@7800 11:lpm.6FFF@7800?FF 11:lpm.7000@7800?- 5000:lpm.0@7800?FF 5001:CSR=11 5002:spm.0=0@7800 5002:CSR?00 5003:lpm.0@7800?- 5003:said?E0
    27.9.1 not while SPMEN is set                         | 9:CSR=03 10:spm.0=0@7800 20:CSR=11 20:CSR?43 21:spm.0=0@7800 21:CSR?43 21:said?E0
    27.9.1 a page load clears RWWSB too                   | 9:CSR=03 10:spm.0=0@7800 5001:CSR=01 5002:spm.0=0@7800 5002:CSR?00 5003:said?E0
    27.9.1 SPMIE can be written at any time               | 9:CSR=03 10:spm.0=0@7800 20:CSR=80 20:CSR?C3 30:CSR=00 30:CSR?43 30:said?E0
    27.9.1 the interrupt asks while SPMEN is clear        | 8:CSR=80 8:irq?1 9:CSR=83 9:irq?0 9:next?13 10:spm.0=0@7800 10:irq?0 10:next?4110 4109:irq?0 4110:irq?1 4110:next?- 4110:said?E0
    27.9.1 and while the EEPROM is not written            | 8:CSR=80 9:eeprom=100 9:irq?0 9:next?100 99:irq?0 100:irq?1
    27.8.5 an EEPROM write keeps SPMCSR from being written | 8:eeprom=100 9:CSR=83 9:CSR?00 99:CSR=01 99:CSR?00 100:CSR=81 100:CSR?81
    27.4   only from the boot section                     | 9:CSR=03 10:spm.0=0@77FE 10:CSR?00 10:said?
    27.4   loads too                                      | 9:CSR=01 10:spm.0=1234@77FE 15:CSR=05 16:spm.0=0@7800 16:said?W0/64
    27.8.9 lock bits: Z = 1                               | 9:CSR=09 10:lpm.1@0?FF 10:CSR?00
    27.8.9 lock bits once more lock=EF                    | 9:CSR=09 10:lpm.1@0?EF 11:lpm.1@0?-
    27.8.9 fuses: low at 0, extended at 2, high at 3      | 9:CSR=09 10:lpm.0@0?62 19:CSR=09 20:lpm.2@0?FE 29:CSR=09 30:lpm.3@0?D9
    27.8.9 others are reserved                            | 9:CSR=09 10:lpm.4@0?FF
    27.8.9 LPM in the third cycle                         | 9:CSR=09 11:lpm.0@0?62
    27.8.9 in the fourth it reads program memory          | 9:CSR=09 12:lpm.0@0?-
    27.8.10 signature and calibration                     | 9:CSR=21 9:CSR?21 9:lpm.0@0?1E 19:CSR=21 20:lpm.2@0?95 29:CSR=21 30:lpm.4@0?14 39:CSR=21 40:lpm.1@0?A7 49:CSR=21 50:lpm.3@0?FF
    27.9.1 SPM after SIGRD does nothing                   | 9:CSR=21 10:spm.0=0@7800 10:CSR?00
    27.9.1 LPM after other commands is an LPM             | 9:CSR=01 10:lpm.0@0?- 10:CSR?01
    27.8.7 lock bits are programmed, the core goes on     | 9:CSR=09 10:spm.1=00CF@7800 10:CSR?09 10:next?4110 10:lpm.0@7800?- 4109:lock?FF 4110:lock?CF 4110:next?- 4110:CSR?00
    27.8.7 never back to 1; bits 7 and 6 stay   lock=FC   | 9:CSR=09 10:spm.1=003F@7800 4110:lock?FC 4119:CSR=09 4120:spm.1=0000@7800 9000:lock?C0
    27.3   BLB01 programmed: the application stays  lock=FB | 9:CSR=03 10:spm.77FF=0@7800 10:CSR?00 19:CSR=03 20:spm.7800=0@7800 20:said?E7800,H4120
    27.3   BLB11 programmed: the boot section stays lock=EF | 9:CSR=05 10:spm.7800=0@7800 10:CSR?00 19:CSR=05 20:spm.7780=0@7800 20:said?W7780/64,H4120
    27.3   BLB02 programmed: no LPM from boot to application lock=F7 | 9:lpm.77FF@7800?FF 9:lpm.7800@7800?- 9:lpm.0@0?- 9:lpm.7800@0?-
    27.3   BLB12 programmed: no LPM from application to boot lock=DF | 9:lpm.7800@77FE?FF 9:lpm.77FF@7800?- 9:lpm.7800@7800?-
    27.9.1 reset                                          | 9:CSR=83 10:spm.0=0@7800 20:reset 20:CSR?00 20:busy?0 20:lpm.0@0?- 20:said?E0
    27.8.7 a reset takes lock bits to their end           | 9:CSR=09 10:spm.1=00CF@7800 20:reset 20:lock?CF
    27.8   the time is that of another oscillator         | 9:CSR=03 10:spm.0=0@7800 2010:hz=2000000 6209:CSR?43 6210:CSR?40 6210:said?E0
    27.8   and goes on in sleep                           | 9:CSR=03 10:spm.0=0@7800 20:sleep 5000:wake 5000:CSR?40 5000:said?E0
    27.8   addresses wrap                                 | 9:CSR=03 10:spm.8100=0@F800 10:said?E100
    mega48 from anywhere, and the core halts              | 9:CSR=03 10:spm.47=0@0 10:said?E40,H4110 10:CSR?03
    mega48 32 words; two lock bits                        | 9:CSR=05 10:spm.47=0@0 10:said?W40/32,H4110 5009:CSR=09 5010:spm.1=0@0 9110:lock?FC
    mega8  no SIGRD; four lock bits                       | 9:CSR=21 9:CSR?01 10:lpm.0@0?- 19:CSR=09 20:spm.1=0@1E00 4120:lock?C3
    mega128 17 bits of address                            | 9:CSR=03 10:spm.12345=0@1FC00 10:said?E12300 10:CSR?43 11:lpm.1E000@1FC00?- 11:lpm.1DFFF@1FC00?FF
";

#[test]
fn the_cases_of_the_data_sheet() {
    for line in CASES.lines().map(str::trim).filter(|line| !line.is_empty()) {
        run(line).unwrap_or_else(|said| panic!("{said}"));
    }
}

#[test]
fn a_wrong_case_is_found() {
    assert!(run("x | 9:CSR=03 10:spm.100=0@7800").is_err());
    assert!(run("x | 9:CSR=09 12:lpm.0@0?62").is_err());
}

#[test]
fn boot_lock_bits_bar_interrupts() {
    let bytes = ConfigBytes { lock: 0xFF, fuses: [0; 3], signature: [0; 3], calibration: 0 };
    let bars = |lock, pc, ivsel| {
        SelfProgramming::new(SpmKind::MEGA328, ConfigBytes { lock, ..bytes }, 0x7800, 1).bars_interrupts(pc, ivsel)
    };
    // BLB02: vectors in the boot section while the application runs. BLB12: the opposite.
    for (lock, pc, ivsel, barred) in [
        (0xF7, 0x0000, true, true),
        (0xF7, 0x0000, false, false),
        (0xF7, 0x7800, true, false),
        (0xDF, 0x7800, false, true),
        (0xDF, 0x7800, true, false),
        (0xDF, 0x0000, false, false),
        (0xFF, 0x0000, true, false),
        (0xEB, 0x0000, true, false),
    ] {
        assert_eq!(bars(lock, pc, ivsel), barred, "lock {lock:02X}, {pc:04X}, IVSEL {ivsel}");
    }
}
