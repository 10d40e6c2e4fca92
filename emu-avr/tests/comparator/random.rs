//! A model of the comparator that steps cycle by cycle, with two flip-flops after the inputs, and random
//! programs: both must agree in every cycle in register reads, the interrupt, and the edges to timer 1.

use emu_avr::periph::comparator::{AvrComparator, ComparatorInput, ComparatorRegister};
use emu_avr::periph::{AvrDrive, AvrLine, AvrOutbox, AvrSignal, Device};
use emu_core::rng::Rng;

const SECOND_PS: u64 = 1_000_000_000_000;
/// Clocks in Hz with a whole number of picoseconds per cycle.
const RATES: [u64; 6] = [50_000, 125_000, 500_000, 1_000_000, 2_000_000, 16_000_000];

struct Model {
    ain: [u32; 2],
    adc: [u32; 8],
    channel: Option<u8>,
    hz: u64,
    kept: bool,
    /// Picoseconds until the reference is stable; None while it is off.
    reference: Option<u64>,
    acsr: u8,
    didr: u8,
    clock_on: bool,
    flops: [bool; 2],
    flag_now: bool,
    icp: AvrDrive,
}

impl Model {
    fn output(&self) -> bool {
        let positive = match (self.acsr & 0x40 != 0, self.reference) {
            (true, Some(0)) => 1_100,
            (true, _) => 0,
            _ => self.ain[0],
        };
        let negative = self.channel.map_or(self.ain[1], |n| self.adc[usize::from(n)]);
        self.acsr & 0x80 == 0 && positive > negative
    }

    /// Executes the edge that ends a cycle: the flip-flops sample the level of the cycle.
    fn tick(&mut self) {
        self.flag_now = false;
        if self.clock_on {
            let before = self.flops[1];
            self.flops = [self.output(), self.flops[0]];
            let mode = self.acsr & 3;
            self.flag_now = match (before, self.flops[1]) {
                (false, true) => mode == 0 || mode == 3,
                (true, false) => mode == 0 || mode == 2,
                _ => false,
            };
            if self.flag_now {
                self.acsr |= 0x10;
            }
        }
        if let Some(left) = &mut self.reference {
            *left = left.saturating_sub(SECOND_PS / self.hz);
        }
        self.follow();
    }

    /// Updates the signal to timer 1.
    fn follow(&mut self) {
        self.icp = if self.acsr & 4 != 0 { AvrDrive::Value(self.output()) } else { AvrDrive::Port };
    }

    fn power(&mut self) {
        if self.kept || self.acsr & 0x40 != 0 {
            self.reference = self.reference.or(Some(40_000_000));
        } else {
            self.reference = None;
        }
    }

    fn acsr(&self) -> u8 {
        self.acsr | if self.flops[1] { 0x20 } else { 0 }
    }
}

fn live(seed: u64, seen: &mut [u64; 3]) {
    let mut rng = Rng::new(seed);
    let hz = RATES[rng.below(6) as usize];
    let mut dut = AvrComparator::new(1_100, hz);
    let mut model = Model {
        ain: [0; 2],
        adc: [0; 8],
        channel: None,
        hz,
        kept: false,
        reference: None,
        acsr: 0,
        didr: 0,
        clock_on: true,
        flops: [false; 2],
        flag_now: false,
        icp: AvrDrive::Port,
    };
    let busy = [2, 4, 15][rng.below(3) as usize];
    let mut icp = AvrDrive::Port;
    let mut promised = (0, 0);
    for t in 1..100 + rng.below(400) {
        let at = || format!("seed {seed}, cycle {t}");
        let mut out = AvrOutbox::new();
        let flag_before = model.acsr & 0x10 != 0;
        model.tick();
        let rose = model.flag_now && !flag_before;
        let reference_up = model.reference == Some(0);
        if dut.next_deadline() <= t || rng.one_in(20) {
            dut.run_due(t, &mut out);
        }
        assert!(promised.0 <= t || model.acsr() == promised.1, "ACSR promised until {}, {}", promised.0, at());
        for _ in 0..if rng.one_in(busy) { 1 + rng.below(3) } else { 0 } {
            promised = (0, 0);
            let byte = rng.next_u64() as u8;
            let mask = if rng.one_in(4) { 1 << rng.below(8) } else { 0xFF };
            match rng.below(18) {
                0..=6 => {
                    let mv = [0, 1_000, 1_100, 1_101, 2_000][rng.below(5) as usize];
                    let (input, level) = match rng.below(4) {
                        0 | 1 => (ComparatorInput::Ain0, &mut model.ain[0]),
                        2 => (ComparatorInput::Ain1, &mut model.ain[1]),
                        _ => (ComparatorInput::Adc(byte & 7), &mut model.adc[usize::from(byte & 7)]),
                    };
                    *level = mv;
                    dut.set_millivolts(input, mv, t, &mut out);
                }
                7 => {
                    model.channel = rng.one_in(2).then_some(byte & 7);
                    dut.select(model.channel, t, &mut out);
                }
                8 => {
                    model.kept = byte & 1 != 0;
                    model.power();
                    dut.hold_reference_on(model.kept, t, &mut out);
                }
                9 if model.clock_on => {
                    model.clock_on = false;
                    dut.stop_clock(t, &mut out);
                }
                9 | 10 if !model.clock_on => {
                    model.clock_on = true;
                    dut.restart_clock(t, &mut out);
                }
                10 => {
                    model.hz = RATES[rng.below(6) as usize];
                    dut.set_clock_hz(model.hz, t);
                }
                11 => {
                    model.acsr &= !0x10;
                    dut.on_interrupt_taken(0, t, &mut out);
                }
                12 if rng.one_in(5) => {
                    (model.acsr, model.didr, model.channel, model.clock_on) = (0, 0, None, true);
                    model.power();
                    dut.reset(false, t, &mut out);
                }
                13 => {
                    model.didr = model.didr & !(mask & 3) | byte & mask & 3;
                    dut.write(ComparatorRegister::DIDR1, byte, mask, t, &mut out);
                }
                _ => {
                    // Only a few writes switch the comparator off.
                    let byte = if rng.one_in(5) { byte } else { byte & 0x7F };
                    let clears = byte & mask & 0x10 != 0 && !model.flag_now;
                    let flag = model.acsr & if clears { 0 } else { 0x10 };
                    model.acsr = (model.acsr & !mask | byte & mask) & 0xCF | flag;
                    model.power();
                    dut.write(ComparatorRegister::ACSR, byte, mask, t, &mut out);
                }
            }
        }
        model.follow();
        let mut flagged = false;
        for signal in out.drain(..) {
            match signal {
                AvrSignal::Drive { t: when, line: AvrLine::Icp, drive } if when == t => icp = drive,
                AvrSignal::Flag { t: when, irq: 0 } if when == t => flagged = true,
                other => panic!("{other:?}, {}", at()),
            }
        }
        assert_eq!(flagged, rose, "the reported flag, {}", at());
        assert_eq!(icp, model.icp, "what timer 1 gets, {}", at());
        assert_eq!(dut.peek(ComparatorRegister::ACSR, t), model.acsr(), "ACSR, {}", at());
        assert_eq!(dut.peek(ComparatorRegister::DIDR1, t), model.didr, "DIDR1, {}", at());
        assert_eq!(dut.digital_off(), model.didr, "{}", at());
        assert_eq!(dut.interrupt_requests(), u8::from(model.acsr & 0x18 == 0x18), "interrupt, {}", at());
        assert_eq!(dut.flag(), model.acsr & 0x10 != 0, "{}", at());
        seen[0] += u64::from(flagged);
        seen[1] += u64::from(reference_up && model.acsr & 0x40 != 0 && model.output());
        seen[2] += u64::from(model.icp == AvrDrive::Value(true));
        if rng.one_in(3) {
            promised = (dut.steady_until(ComparatorRegister::ACSR, t), model.acsr());
            assert!(promised.0 >= t, "{}", at());
        }
    }
}

#[test]
fn random_programs_agree_with_the_ticked_model() {
    let mut seen = [0; 3];
    let lives = if cfg!(debug_assertions) { 3_000 } else { 100_000 };
    for seed in 0..lives {
        live(seed, &mut seen);
    }
    assert!(seen.iter().all(|&n| n > lives / 10), "{seen:?}");
}
