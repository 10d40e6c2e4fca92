//! Cases, one per line: section (of DS40002061, or the chip), topic, steps. A step is `edge:W=value` (a write
//! of WDTCSR or WDTCR), `cycle:NAME?value` or `edge:what`. Registers are hexadecimal. The clock is 128,000 Hz
//! initially, so that a clock of the newer watchdog oscillator is one cycle and 2K of them are 2,048.

use emu_avr::periph::watchdog::{AvrWatchdog, WatchdogKind, WatchdogRegister};
use emu_avr::periph::{AvrOutbox, AvrSignal, Device};
use emu_core::NEVER;

struct TestBench {
    dut: AvrWatchdog,
    out: AvrOutbox,
    resets: Vec<u64>,
}

impl TestBench {
    fn ask(&mut self, name: &str, t: u64) -> Result<String, String> {
        self.dut.run_due(t, &mut self.out);
        self.drain();
        let moment = |t: u64| if t == NEVER { "-".into() } else { t.to_string() };
        Ok(match name {
            "W" => format!("{:02X}", self.dut.read(WatchdogRegister::WDTCSR, t, &mut self.out)),
            "irq" => self.dut.interrupt_requests().to_string(),
            "runs" => u8::from(self.dut.is_running()).to_string(),
            "next" => moment(self.dut.next_deadline()),
            "steady" => moment(self.dut.steady_until(WatchdogRegister::WDTCSR, t)),
            "resets" => self.resets.iter().map(u64::to_string).collect::<Vec<_>>().join(","),
            _ => return Err("no such question".into()),
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
            Some(("W", value)) => {
                let value = u8::from_str_radix(value, 16).map_err(|e| e.to_string())?;
                self.dut.write(WatchdogRegister::WDTCSR, value, 0xFF, t, out);
            }
            Some(("hz", hz)) => self.dut.set_clock_hz(hz.parse().map_err(|_| "hz")?, t),
            Some(("WDRF", on)) => self.dut.set_forced_on(on == "1", t, out),
            Some((name, bit)) => {
                let n: u8 = name.strip_prefix("W.").and_then(|n| n.parse().ok()).ok_or("no such step")?;
                self.dut.write(WatchdogRegister::WDTCSR, u8::from(bit == "1") << n, 1 << n, t, out);
            }
            None => match what {
                "wdr" => self.dut.restart(t, out),
                "taken" => self.dut.on_interrupt_taken(0, t, out),
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
                AvrSignal::Reset { t } => self.resets.push(t),
                other => panic!("{other:?}"),
            }
        }
    }
}

fn run(line: &str) -> Result<(), String> {
    let (head, steps) = line.split_once('|').ok_or("two columns")?;
    let (kind, always_on) = match head.split_whitespace().next() {
        Some("on") => (WatchdogKind::MEGA48, true),
        Some("m8") => (WatchdogKind::MEGA8, false),
        Some("m8on") => (WatchdogKind::MEGA8, true),
        Some("m16") => (WatchdogKind::MEGA16, false),
        _ => (WatchdogKind::MEGA48, false),
    };
    let mut bench =
        TestBench { dut: AvrWatchdog::new(kind, always_on, 128_000), out: AvrOutbox::new(), resets: Vec::new() };
    for text in steps.split_whitespace() {
        bench.step(text).map_err(|said| format!("{line}\n  at {text}: {said}"))?;
    }
    Ok(())
}

const CASES: &str = "
    11.8   off at first                                    | 0:W?00 0:runs?0 0:next?- 99999:resets?
    t11-1  interrupt mode                                  | 10:W=40 10:next?2058 2057:W?40 2058:W?C0 2058:irq?1 2058:resets? 9999:resets?
    t11-1  taken, and again                                | 10:W=40 2100:taken 2100:W?40 2100:irq?0 2100:next?4106 4106:irq?1
    t11-1  not taken, nothing more happens                 | 10:W=40 2100:next?- 9000:W?C0 9000:taken 9000:next?10250
    t11-1  reset mode, WDE set without a sequence          | 10:W=08 10:W?08 10:next?2058 2058:W?08 2058:irq?0 2058:resets?2058
    t11-1  interrupt and reset: taken, WDIE is cleared     | 10:W=48 2058:irq?1 2058:resets? 2070:taken 2070:W?08 4106:resets?4106
    t11-1  not taken, the next time-out resets             | 10:W=48 2058:irq?1 4105:resets? 4106:resets?4106
    t11-1  to stay in it, WDIE is set again                | 10:W=48 2070:taken 3000:W=48 4106:W?C8 4106:resets?
    11.9.2 WDIF is cleared by 1, kept by 0                 | 10:W=40 2060:W=40 2060:W?C0 2061:W=C0 2061:W?40
    11.9.2 not at the edge that sets it                    | 10:W=40 2058:W=C0 2058:W?C0 2059:W=C0 2059:W?40
    11.9.2 nor at one that sets it once more               | 10:W=40 4106:W=C0 4106:W?C0 6155:W=C0 6155:W?40
    11.9.2 without WDIE it does not ask                    | 10:W=40 2060:W=00 2060:W?80 2060:irq?0 2060:runs?0
    11.9.2 WDCE stays for four cycles                      | 10:W=18 10:W?18 13:W?18 14:W?08 10:steady?14
    11.8   the sequence changes WDE and WDP                | 10:W=18 14:W=21 14:W?21 14:runs?0
    11.8   too late, WDP stays and so does WDE             | 10:W=18 15:W=21 15:W?08
    11.8   with WDCE in it, it changes nothing             | 10:W=18 12:W=13 12:W?08 13:W=00 13:W?08
    11.8   opened anew                                     | 10:W=18 13:W=1F 13:W?18 17:W=07 17:W?07
    11.8   once only                                       | 10:W=18 11:W=09 11:W?09 12:W=00 12:W?09
    11.8   WDCE without WDE opens nothing                  | 10:W=10 10:W?00 11:W=09 11:W?08
    11.8   WDIE needs no sequence                          | 10:W=08 11:W=40 11:W?48 12:W=00 12:W?08
    11.8   one bit                                         | 10:W.3=1 10:W?08 11:W.6=1 11:W?48 12:W.0=1 12:W?48 13:W.6=0 13:W?08 14:W.3=0 14:W?08
    t11-2  WDP = 0 to 9, in K of clocks                    | 10:W=18 11:W=0F 11:next?262154 20:W=18 21:W=28 21:next?524298 30:W=18 31:W=29 31:next?1048586
    t11-2  the others are as 9                             | 10:W=18 11:W=2F 11:W?2F 11:next?1048586
    11.8   WDR                                             | 10:W=08 2000:wdr 2000:next?4048 4000:wdr 6047:resets? 6048:resets?6048
    11.8   WDR does not clear WDIF                         | 10:W=40 2060:wdr 2060:W?C0
    11.8   WDP changed on the way: the next multiple       | 10:W=18 11:W=09 11:next?4106 3000:W=18 3001:W=08 3001:next?4106 3002:W=18 3003:W=0A 3003:next?8202
    11.8   it does not begin anew by a write               | 10:W=08 1000:W=08 1000:next?2058
    11.8   it does by being off                            | 10:W=18 11:W=00 1000:W=08 1000:next?3048
    11.8   its time does not depend on the core's clock    | 10:W=08 1034:hz=256000 1034:next?3082 2058:hz=128000 2058:next?2570
    11.8   it runs in sleep                                | 10:W=40 20:sleep 2057:irq?0 2058:irq?1 2060:wake 2060:W?C0
    11.9.2 WDRF forces WDE                                 | 10:WDRF=1 10:W?08 10:next?2058 20:W=18 21:W=00 21:W?08 22:W=18 23:W=01 23:W?09
    11.9.2 WDE stays when it goes                          | 10:WDRF=1 20:WDRF=0 20:W?08 30:W=18 31:W=00 31:W?00
    11.9.2 and through a reset                             | 10:W=18 11:W=29 20:WDRF=1 20:reset 20:W?08 20:next?2068
    11.8   reset                                           | 10:W=18 11:W=4F 20:reset 20:W?00 20:next?- 21:W=00 21:W?00
    on     WDE is locked to 1 and WDIE to 0                | 0:W?08 0:next?2048 10:W=40 10:W?08 20:W=18 21:W=41 21:W?09 21:next?4096
    on     after reset                                     | 10:W=18 11:W=29 20:reset 20:W?08 20:next?2068
    m8     16K clocks of 1 MHz: 2,097.152 cycles           | 10:W=08 10:W?08 10:next?2108 2108:resets?2108
    m8     no interrupt, no WDP3                           | 10:W=F8 10:W?18 11:W=FF 11:W?18 12:W=EF 12:W?0F 99999:resets?
    m8     2048K clocks                                    | 10:W=18 11:W=0F 11:next?268446
    m8     WDP needs the sequence                          | 10:W=0F 10:W?08
    m8     WDRF does not force it                          | 10:WDRF=1 10:W?00
    m8on   safety level 2                                  | 0:W?08 10:W=18 11:W=02 11:W?0A 20:W=07 20:W?0A
    m16    WDP needs none, turning off does                | 10:W=07 10:W?07 11:W=0F 12:W=01 12:W?09 20:W=18 21:W=00 21:W?00
";

#[test]
fn the_cases_of_the_data_sheet() {
    for line in CASES.lines().map(str::trim).filter(|line| !line.is_empty()) {
        run(line).unwrap_or_else(|said| panic!("{said}"));
    }
}

#[test]
fn a_wrong_case_is_found() {
    assert!(run("x | 10:W=08 10:next?2057").is_err());
    assert!(run("x | 10:W=08 2060:resets?").is_err());
}

/// Table 11-2 at 16 MHz: a clock of the watchdog oscillator is 125 cycles.
#[test]
fn the_times_of_the_table() {
    for (wdp, clocks) in (0..10).zip([2u64, 4, 8, 16, 32, 64, 128, 256, 512, 1024]) {
        let mut dut = AvrWatchdog::new(WatchdogKind::MEGA48, false, 16_000_000);
        let mut out = AvrOutbox::new();
        dut.write(WatchdogRegister::WDTCSR, 0x18, 0xFF, 100, &mut out);
        dut.write(WatchdogRegister::WDTCSR, 0x08 | wdp >> 3 << 5 | wdp & 7, 0xFF, 104, &mut out);
        assert_eq!(dut.next_deadline(), 100 + clocks * 1_024 * 125, "WDP = {wdp}");
    }
}

/// At extreme times and clocks nothing overflows.
#[test]
fn the_ends_of_time() {
    for hz in [0, 1, u64::MAX] {
        let mut dut = AvrWatchdog::new(WatchdogKind::MEGA48, false, hz);
        let mut out = AvrOutbox::new();
        dut.write(WatchdogRegister::WDTCSR, 0x48, 0xFF, u64::MAX - 9, &mut out);
        dut.set_clock_hz(hz.wrapping_add(3), u64::MAX - 5);
        dut.run_due(u64::MAX - 3, &mut out);
        dut.restart(u64::MAX - 2, &mut out);
        assert!(dut.next_deadline() > u64::MAX - 3, "{hz} Hz");
    }
}
