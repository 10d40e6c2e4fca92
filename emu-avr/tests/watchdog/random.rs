//! A model of the watchdog that steps cycle by cycle, and random programs: both must agree in every cycle in
//! register reads, the interrupt and the resets.

use emu_avr::periph::watchdog::{AvrWatchdog, WatchdogKind, WatchdogRegister};
use emu_avr::periph::{AvrOutbox, AvrSignal, Device};
use emu_core::rng::Rng;

const SECOND_PS: u64 = 1_000_000_000_000;
/// Clocks in Hz with a whole number of picoseconds per cycle, so slow that the shortest time-out is 8 to 128
/// cycles.
const RATES: [u64; 5] = [500, 1_000, 2_000, 4_000, 8_000];

struct Model {
    /// True for the watchdog of the ATmega328, false for the older one.
    new: bool,
    /// True if WDP can be written at any time.
    free: bool,
    wdton: bool,
    wdrf: bool,
    cycle_ps: u64,
    wdif: bool,
    wdie: bool,
    wde: bool,
    wdp: u8,
    /// Remaining cycles of WDCE, and whether it was set in the cycle before.
    wdce: u8,
    wdce_was: bool,
    /// The counter in clocks, and the rest in picoseconds.
    clocks: u64,
    rest_ps: u64,
    /// Events at the current edge.
    flag_now: bool,
    reset_now: bool,
}

impl Model {
    fn runs(&self) -> bool {
        self.wde || self.wdie
    }

    fn period(&self) -> u64 {
        let (shortest, longest) = if self.new { (2_048, 9) } else { (16_384, 7) };
        (0..self.wdp.min(longest)).fold(shortest, |clocks, _| clocks * 2)
    }

    /// Executes the edge that ends a cycle.
    fn tick(&mut self) {
        (self.flag_now, self.reset_now) = (false, false);
        self.wdce_was = self.wdce > 0;
        self.wdce = self.wdce.saturating_sub(1);
        if !self.runs() {
            return;
        }
        let clock_ps = if self.new { 7_812_500 } else { 1_000_000 };
        self.rest_ps += self.cycle_ps;
        let before = self.clocks;
        self.clocks += self.rest_ps / clock_ps;
        self.rest_ps %= clock_ps;
        // The shortest time-out is longer than a cycle, so there is at most one.
        let tap = self.period();
        if self.clocks / tap == before / tap {
            return;
        }
        match (self.wdie, self.wde) {
            (true, true) if self.wdif => self.reset_now = true,
            (true, _) => (self.wdif, self.flag_now) = (true, true),
            (false, _) => self.reset_now = true,
        }
    }

    fn zero(&mut self) {
        (self.clocks, self.rest_ps) = (0, 0);
    }

    /// Applies what forces WDE and WDIE, and clears the counter while it is off.
    fn settle(&mut self) {
        self.wde |= self.wdton || self.wdrf && self.new;
        self.wdie &= !self.wdton && self.new;
        if !self.runs() {
            self.zero();
        }
    }

    fn write(&mut self, value: u8, mask: u8) {
        let value = value & mask | self.read() & 0x6F & !mask;
        let in_window = self.wdce_was && value & 0x10 == 0;
        self.wdie = value & 0x40 != 0;
        self.wde = value & 8 != 0 || self.wde && !in_window;
        if in_window || self.free {
            self.wdp = value & 7 | if self.new { (value & 0x20) >> 2 } else { 0 };
        }
        if value & 0x80 != 0 && !self.flag_now {
            self.wdif = false;
        }
        self.wdce = if value & 0x18 == 0x18 { 4 } else { 0 };
        self.wdce_was = false;
        self.settle();
    }

    fn read(&self) -> u8 {
        let mut value = self.wdp & 7 | (self.wdp & 8) << 2;
        for (bit, set) in [(0x80, self.wdif), (0x40, self.wdie), (8, self.wde)] {
            value |= if set { bit } else { 0 };
        }
        value
    }

    fn shown(&self) -> u8 {
        self.read() | if self.wdce > 0 { 0x10 } else { 0 }
    }

    fn taken(&mut self) {
        self.wdif = false;
        if self.wde {
            self.wdie = false;
        }
    }

    fn reset(&mut self) {
        (self.wdif, self.wdie, self.wde, self.wdp, self.wdce, self.wdce_was) = (false, false, false, 0, 0, false);
        self.zero();
        self.settle();
    }
}

fn live(seed: u64, seen: &mut [u64; 4]) {
    let mut rng = Rng::new(seed);
    let (kind, new, free) = match rng.below(4) {
        0 => (WatchdogKind::MEGA8, false, false),
        1 => (WatchdogKind::MEGA16, false, true),
        _ => (WatchdogKind::MEGA48, true, false),
    };
    let wdton = !free && rng.one_in(8);
    let hz = RATES[rng.below(5) as usize];
    let mut dut = AvrWatchdog::new(kind, wdton, hz);
    let mut model = Model {
        new,
        free,
        wdton,
        wdrf: false,
        cycle_ps: SECOND_PS / hz,
        wdif: false,
        wdie: false,
        wde: wdton,
        wdp: 0,
        wdce: 0,
        wdce_was: false,
        clocks: 0,
        rest_ps: 0,
        flag_now: false,
        reset_now: false,
    };
    let busy = [4, 20, 60][rng.below(3) as usize];
    let mut promised = (0, 0);
    // Second write of a sequence: cycle and value.
    let mut plan = (0, 0);
    for t in 1..200 + rng.below(400) {
        let at = || format!("seed {seed}, cycle {t}");
        let mut out = AvrOutbox::new();
        model.tick();
        if dut.next_deadline() <= t || rng.one_in(20) {
            dut.run_due(t, &mut out);
        }
        assert!(promised.0 <= t || model.shown() == promised.1, "promised until {}, {}", promised.0, at());
        let byte = rng.next_u64() as u8;
        // The core writes once per cycle.
        let mut written = plan.0 == t;
        if written {
            promised = (0, 0);
            model.write(plan.1, 0xFF);
            dut.write(WatchdogRegister::WDTCSR, plan.1, 0xFF, t, &mut out);
        }
        for _ in 0..if rng.one_in(busy) { 1 + rng.below(2) } else { 0 } {
            promised = (0, 0);
            match rng.below(16) {
                0..=4 if !written => {
                    written = true;
                    // Short time-outs, so that there are many.
                    let value = byte & [0xEF, 0x49, 0x4B, 0x43][rng.below(4) as usize];
                    plan = (t + 1 + rng.below(5), value);
                    model.write(0x18 | byte & 0x40, 0xFF);
                    dut.write(WatchdogRegister::WDTCSR, 0x18 | byte & 0x40, 0xFF, t, &mut out);
                }
                5..=7 if !written => {
                    written = true;
                    let mask = if rng.one_in(3) { 1 << rng.below(8) } else { 0xFF };
                    model.write(byte, mask);
                    dut.write(WatchdogRegister::WDTCSR, byte, mask, t, &mut out);
                }
                8 => {
                    model.zero();
                    dut.restart(t, &mut out);
                }
                9 | 10 if model.new => {
                    model.taken();
                    dut.on_interrupt_taken(0, t, &mut out);
                    model.settle();
                }
                11 => {
                    let hz = RATES[rng.below(5) as usize];
                    model.cycle_ps = SECOND_PS / hz;
                    dut.set_clock_hz(hz, t);
                }
                12 if rng.one_in(3) => {
                    model.reset();
                    dut.reset(false, t, &mut out);
                }
                13 if rng.one_in(3) => {
                    model.wdrf = byte & 1 != 0;
                    dut.set_forced_on(model.wdrf, t, &mut out);
                    model.settle();
                }
                14 => dut.stop_clock(t, &mut out),
                15 => dut.restart_clock(t, &mut out),
                _ => {}
            }
        }
        let want = if model.reset_now { vec![AvrSignal::Reset { t }] } else { Vec::new() };
        assert_eq!(out, want, "resets, {}", at());
        assert_eq!(dut.peek(WatchdogRegister::WDTCSR, t), model.shown(), "WDTCSR, {}", at());
        assert_eq!(dut.interrupt_requests(), u8::from(model.wdif && model.wdie), "interrupt, {}", at());
        assert_eq!(dut.is_running(), model.runs(), "{}", at());
        seen[0] += u64::from(model.flag_now);
        seen[1] += u64::from(model.reset_now);
        seen[2] += u64::from(model.reset_now && model.wdie);
        seen[3] += u64::from((model.flag_now || model.reset_now) && model.wdp > 1);
        if rng.one_in(6) {
            promised = (dut.steady_until(WatchdogRegister::WDTCSR, t), model.shown());
        }
    }
}

#[test]
fn random_programs_agree_with_the_ticked_model() {
    let mut seen = [0; 4];
    let lives = if cfg!(debug_assertions) { 3_000 } else { 100_000 };
    for seed in 0..lives {
        live(seed, &mut seen);
    }
    assert!(seen.iter().all(|&n| n > lives / 10), "{seen:?}");
}
