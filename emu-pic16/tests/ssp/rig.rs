//! A port with its lines: collects its signals, and checks that every signal has the clock at which it is
//! sent.

use emu_core::NEVER;
use emu_pic16::periph::map::{InterruptFlag, Pic16Line, Sfr};
use emu_pic16::periph::ssp::Pic16Ssp;
use emu_pic16::periph::{Device, Pic16Drive, Pic16Outbox, Pic16Signal};

/// Registers of the port.
pub const REGS: [Sfr; 5] = [Sfr::SSPBUF, Sfr::SSPCON, Sfr::SSPCON2, Sfr::SSPADD, Sfr::SSPSTAT];

/// A port that is called only when something is due.
pub struct TestBench {
    pub port: Pic16Ssp,
    /// Overrides of SCK, SDI and SDO.
    pub drives: [Pic16Drive; 3],
    /// Flags set, with their clocks.
    pub flags: Vec<(u64, InterruptFlag)>,
    out: Pic16Outbox,
    /// Guarantee of [`Device::steady_until`]: a register, its value, and the clock before which it does
    /// not change.
    promised: Option<(Sfr, u8, u64)>,
}

impl TestBench {
    pub fn new(port: Pic16Ssp) -> TestBench {
        TestBench { port, drives: [Pic16Drive::Port; 3], flags: Vec::new(), out: Vec::new(), promised: None }
    }

    fn collect(&mut self, now: u64) {
        for signal in self.out.drain(..) {
            match signal {
                Pic16Signal::Flag { t, flag } => {
                    assert_eq!(t, now, "a flag out of its time");
                    self.flags.push((t, flag));
                }
                Pic16Signal::Drive { t, line, drive } => {
                    assert_eq!(t, now, "a drive out of its time");
                    let place = match line {
                        Pic16Line::Sck => 0,
                        Pic16Line::Sdi => 1,
                        Pic16Line::Sdo => 2,
                        _ => panic!("{line:?} is not driven"),
                    };
                    assert_ne!(self.drives[place], drive, "a drive that changes nothing");
                    self.drives[place] = drive;
                }
                other => panic!("{other:?}"),
            }
        }
    }

    /// Runs only when the port reports something due.
    pub fn tick(&mut self, t: u64) {
        assert!(self.port.next_deadline() >= t || t == 0, "something was due before");
        if self.port.next_deadline() == t {
            self.port.run_due(t, &mut self.out);
            assert!(self.port.next_deadline() > t);
            self.collect(t);
        }
        let promised = *self.promised.get_or_insert_with(|| {
            let reg = REGS[t as usize % REGS.len()];
            (reg, self.port.peek(reg, t), self.port.steady_until(reg, t))
        });
        if t < promised.2 {
            assert_eq!(self.port.peek(promised.0, t), promised.1, "{promised:?} at {t}");
        } else {
            self.promised = None;
        }
    }

    pub fn line(&mut self, line: Pic16Line, high: bool, t: u64) {
        self.promised = None;
        self.port.on_line_changed(line, high, t, &mut self.out);
        self.collect(t);
    }

    pub fn write(&mut self, reg: Sfr, value: u8, t: u64) {
        self.promised = None;
        self.port.write(reg, value, 0xFF, t, &mut self.out);
        self.collect(t);
    }

    pub fn read(&mut self, reg: Sfr, t: u64) -> u8 {
        self.promised = None;
        let value = self.port.read(reg, t, &mut self.out);
        self.collect(t);
        value
    }

    pub fn timer2(&mut self, t: u64) {
        self.port.timer2(t, &mut self.out);
        self.collect(t);
    }

    pub fn sleep(&mut self, t: u64) {
        self.promised = None;
        self.port.stop_clock(t, &mut self.out);
        self.collect(t);
        assert_eq!(self.port.next_deadline(), NEVER);
    }

    pub fn wake(&mut self, t: u64) {
        self.promised = None;
        self.port.restart_clock(t, &mut self.out);
        self.collect(t);
    }

    pub fn regs(&self, t: u64) -> [u8; 5] {
        REGS.map(|reg| self.port.peek(reg, t))
    }

    /// Reports whether it pulls SCL and SDA low.
    pub fn pulls(&self) -> [bool; 2] {
        [self.drives[0] == Pic16Drive::Low, self.drives[1] == Pic16Drive::Low]
    }

    /// Returns how often a flag was set.
    pub fn count(&self, flag: InterruptFlag) -> usize {
        self.flags.iter().filter(|&&(_, f)| f == flag).count()
    }
}
