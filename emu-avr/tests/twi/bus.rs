//! Two interfaces on one bus, each with its model, and a source of disturbances.

use emu_avr::periph::twi::{AvrTwi, TwiRegister};
use emu_avr::periph::{AvrDrive, AvrLine, AvrSignal, Device};

use crate::model::Model;

/// Applies a list of signals to the overrides of the lines.
fn apply(out: &[AvrSignal], t: u64, drives: &mut [AvrDrive; 2]) {
    for signal in out {
        let AvrSignal::Drive { t: at, line, drive } = *signal else { panic!("{signal:?}") };
        assert_eq!(at, t, "{signal:?} comes late");
        drives[usize::from(line == AvrLine::Sda)] = drive;
    }
}

/// An interface with its model.
pub struct Node {
    pub part: AvrTwi,
    pub model: Model,
    out: Vec<AvrSignal>,
    drives: [AvrDrive; 2],
    ought: [AvrDrive; 2],
    /// Guaranteed register values: the value, and the cycle up to which it is guaranteed.
    steady: [(u8, u64); 6],
    pub asleep: bool,
}

impl Node {
    pub fn new() -> Node {
        Node {
            part: AvrTwi::new(),
            model: Model::new(),
            out: Vec::new(),
            drives: [AvrDrive::Port; 2],
            ought: [AvrDrive::Port; 2],
            steady: [(0, 0); 6],
            asleep: false,
        }
    }

    pub fn write(&mut self, reg: TwiRegister, value: u8, t: u64) {
        self.part.write(reg, value, 0xFF, t, &mut self.out);
        self.model.write(reg, value, t);
        self.steady = [(0, 0); 6];
    }

    pub fn sleep(&mut self, t: u64) {
        self.asleep = true;
        self.part.stop_clock(t, &mut self.out);
        self.model.sleep(t);
        self.steady = [(0, 0); 6];
    }

    pub fn wake(&mut self, t: u64) {
        self.asleep = false;
        self.part.restart_clock(t, &mut self.out);
        self.model.wake(t);
        self.steady = [(0, 0); 6];
    }

    pub fn reset(&mut self, t: u64) {
        self.part.reset(false, t, &mut self.out);
        self.model.reset(t);
        self.steady = [(0, 0); 6];
    }

    pub fn tick(&mut self, t: u64) {
        self.model.tick(t);
        if self.part.next_deadline() <= t {
            self.part.run_due(t, &mut self.out);
        }
    }

    fn line(&mut self, line: AvrLine, high: bool, t: u64) {
        self.part.on_line_changed(line, high, t, &mut self.out);
        self.model.line(line, high, t);
        self.steady = [(0, 0); 6];
    }

    /// Compares interface and model; returns how they drive the lines.
    pub fn compare(&mut self, t: u64, ctx: &str) {
        apply(&self.out, t, &mut self.drives);
        apply(&self.model.out, t, &mut self.ought);
        self.out.clear();
        self.model.out.clear();
        assert_eq!(self.drives, self.ought, "{ctx}, clock {t}: SCL, SDA of part and model");
        let regs = [
            TwiRegister::TWBR,
            TwiRegister::TWSR,
            TwiRegister::TWAR,
            TwiRegister::TWDR,
            TwiRegister::TWCR,
            TwiRegister::TWAMR,
        ];
        for (reg, promise) in regs.into_iter().zip(&mut self.steady) {
            let value = self.model.peek(reg);
            assert_eq!(self.part.peek(reg, t), value, "{ctx}, clock {t}: {reg:?}");
            if t < promise.1 {
                assert_eq!(value, promise.0, "{ctx}, clock {t}: {reg:?} steady up to {}", promise.1);
            } else {
                *promise = (value, self.part.steady_until(reg, t));
            }
        }
        assert_eq!(self.part.interrupt_requests(), self.model.requests(), "{ctx}, clock {t}");
    }
}

/// The two lines of the bus.
#[derive(Default)]
pub struct Wires {
    levels: [Option<bool>; 2],
    /// True for a line that is pulled low from outside.
    pub pulled: [bool; 2],
}

impl Wires {
    /// Compares all nodes and passes the line levels to them.
    pub fn settle(&mut self, nodes: &mut [Node], t: u64, ctx: &str) {
        for node in nodes.iter_mut() {
            node.compare(t, ctx);
        }
        for (n, line) in [AvrLine::Scl, AvrLine::Sda].into_iter().enumerate() {
            let low = self.pulled[n] || nodes.iter().any(|node| node.drives[n] == AvrDrive::Output(false));
            if self.levels[n] != Some(!low) {
                self.levels[n] = Some(!low);
                for node in nodes.iter_mut() {
                    node.line(line, !low, t);
                }
            }
        }
        for node in nodes.iter_mut() {
            node.compare(t, ctx);
        }
    }
}
