//! A model of the parallel slave port that steps clock by clock, with flip-flops clocked by Q2 and Q4.

use emu_core::rng::Rng;
use emu_pic16::periph::map::{InterruptFlag, Pic16Line, Sfr};
use emu_pic16::periph::psp::ParallelSlavePort;
use emu_pic16::periph::{Device, Pic16Outbox, Pic16Signal};

/// A pending end of a strobe: not detected by a Q2 yet, or detected.
#[derive(Default, Clone, Copy)]
struct Path {
    waiting: bool,
    found: bool,
}

#[derive(Default)]
struct Model {
    mode: bool,
    ibf: bool,
    obf: bool,
    ibov: bool,
    low: [bool; 3],
    bus: u8,
    input: u8,
    output: u8,
    write: Path,
    read: Path,
    asleep: bool,
    flagged: bool,
}

impl Model {
    fn both(&self, strobe: usize) -> bool {
        self.mode && self.low[strobe] && self.low[2]
    }

    fn byte_came(&mut self) {
        self.ibov |= self.ibf;
        self.ibf = true;
        self.flagged = true;
    }

    fn q4(&mut self) {
        if self.write.found {
            self.byte_came();
        }
        self.flagged |= self.read.found;
        (self.write.found, self.read.found) = (false, false);
    }

    fn q2(&mut self) {
        for path in [&mut self.write, &mut self.read] {
            path.found |= path.waiting;
            path.waiting = false;
        }
    }

    /// Applies a change and its effect on the strobes.
    fn change(&mut self, what: impl FnOnce(&mut Model)) {
        let before = [self.both(0), self.both(1)];
        what(self);
        let after = [self.both(0), self.both(1)];
        if after[1] {
            self.input = self.bus;
        }
        if after[0] && !before[0] {
            self.obf = false;
        }
        if self.mode && before[0] && !after[0] {
            self.read.waiting = true;
        }
        if self.mode && before[1] && !after[1] {
            self.write.waiting = true;
        }
        if self.asleep {
            self.q2();
            self.q4();
        }
    }

    fn trise(&self) -> u8 {
        u8::from(self.ibf) << 7 | u8::from(self.obf) << 6 | u8::from(self.ibov) << 5 | u8::from(self.mode) << 4
    }

    fn write_trise(&mut self, value: u8) {
        self.change(|m| {
            m.ibov = value & 0x20 != 0;
            m.mode = value & 0x10 != 0;
            if !m.mode {
                (m.ibf, m.obf) = (false, false);
                (m.write, m.read) = (Path::default(), Path::default());
            }
        });
    }
}

#[test]
fn the_port_agrees_with_flip_flops() {
    let (mut flags, mut overflows) = (0, 0);
    for seed in 0..60 {
        let mut rng = Rng::new(seed);
        let (mut dut, mut model) = (ParallelSlavePort::new(), Model::default());
        let lazy = rng.one_in(2);
        for t in 1..6_000u64 {
            model.flagged = false;
            if t % 4 == 3 && !model.asleep {
                model.q4();
            }
            let mut out: Pic16Outbox = Vec::new();
            let at_work = t % 4 == 0 && !model.asleep;
            let writes = at_work && rng.one_in(8);
            if !lazy || dut.next_deadline() <= t || !writes {
                dut.run_due(if writes { t - 1 } else { t }, &mut out);
            }
            if writes {
                let value = rng.next_u64() as u8 | if rng.one_in(6) { 0 } else { 0x10 };
                model.write_trise(value);
                dut.write(Sfr::TRISE, value, 0xFF, t, &mut out);
            } else if at_work && rng.one_in(6) {
                let value = rng.next_u64() as u8;
                model.output = value;
                model.obf |= model.mode;
                dut.write_port(value, t);
            } else if at_work && model.mode && rng.one_in(5) {
                model.ibf = false;
                assert_eq!(dut.read_port(t), model.input, "PORTD, seed {seed}, clock {t}");
            }
            if rng.one_in(3) {
                let (strobe, high) = (rng.below(3) as usize, rng.one_in(2));
                model.change(|m| m.low[strobe] = !high);
                dut.on_line_changed([Pic16Line::Rd, Pic16Line::Wr, Pic16Line::Cs][strobe], high, t, &mut out);
            }
            if rng.one_in(4) {
                let levels = rng.next_u64() as u8;
                model.change(|m| m.bus = levels);
                dut.set_bus_levels(levels, t);
            }
            if t % 4 == 1 && !model.asleep {
                model.q2();
            }
            if t % 4 == 0 && rng.one_in(25) {
                if model.asleep {
                    model.asleep = false;
                    dut.restart_clock(t, &mut out);
                } else {
                    model.q4();
                    model.q2();
                    model.q4();
                    model.asleep = true;
                    dut.stop_clock(t, &mut out);
                }
            }
            assert_eq!(dut.peek(Sfr::TRISE, t), model.trise(), "TRISE, seed {seed}, clock {t}");
            assert_eq!(dut.peek_port(), model.input, "input latch, seed {seed}, clock {t}");
            assert_eq!(dut.driven_byte(), model.both(0).then_some(model.output), "port D, seed {seed}, clock {t}");
            for signal in &out {
                assert_eq!(*signal, Pic16Signal::Flag { t, flag: InterruptFlag::PSPIF }, "seed {seed}, clock {t}");
            }
            assert_eq!(!out.is_empty(), model.flagged, "PSPIF, seed {seed}, clock {t}");
            flags += u64::from(model.flagged);
            overflows += u64::from(model.ibov);
        }
    }
    assert!(flags > 1_000 && overflows > 100, "{flags} flags, {overflows} clocks of overflow");
}
