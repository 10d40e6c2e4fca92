//! A model of timer 2 that is ticked one state at a time.

use emu_core::NEVER;

/// Everything that the closed form computes, found by ticking.
#[derive(Clone)]
pub struct Model {
    pub cycle: u64,
    /// T2CON without TF2 and EXF2.
    pub con: u8,
    pub t2mod: u8,
    pub value: u16,
    pub rcap: u16,
    pub tf2: bool,
    pub exf2: bool,
    tf2_since: u64,
    exf2_since: u64,
    pub overflows: u64,
    pub clock: bool,
    /// Levels in the next cycle: T2, T2EX.
    pub pins: [bool; 2],
    sample: [bool; 2],
    t2_edge: bool,
    s6_done: bool,
    /// Since the logs were cleared: times of flags, states of overflows and of toggles.
    pub flag_log: Vec<u64>,
    pub overflow_log: Vec<u64>,
    pub toggle_log: Vec<u64>,
}

impl Model {
    pub fn new(cycle: u64) -> Model {
        Model {
            cycle,
            con: 0,
            t2mod: 0,
            value: 0,
            rcap: 0,
            tf2: false,
            exf2: false,
            tf2_since: NEVER,
            exf2_since: NEVER,
            overflows: 0,
            clock: true,
            pins: [true; 2],
            sample: [true; 2],
            t2_edge: false,
            s6_done: true,
            flag_log: Vec::new(),
            overflow_log: Vec::new(),
            toggle_log: Vec::new(),
        }
    }

    fn bit(&self, n: u8) -> bool {
        self.con >> n & 1 != 0
    }

    pub fn clock_on(&self) -> bool {
        self.t2mod & 2 != 0 && !self.bit(1)
    }

    fn generator(&self) -> bool {
        self.bit(5) || self.bit(4) || self.clock_on()
    }

    fn updown(&self) -> bool {
        !self.generator() && !self.bit(0) && self.t2mod & 1 != 0
    }

    pub fn t2con(&self) -> u8 {
        self.con | u8::from(self.tf2) << 7 | u8::from(self.exf2) << 6
    }

    pub fn since(&self) -> u64 {
        let tf2 = if self.tf2 { self.tf2_since } else { NEVER };
        let exf2 = if self.exf2 && !self.updown() { self.exf2_since } else { NEVER };
        tf2.min(exf2)
    }

    /// Executes S6 of the present cycle, which comes before a write.
    pub fn finish(&mut self) {
        if !self.s6_done {
            self.state(5);
            self.s6_done = true;
        }
    }

    pub fn write_t2con(&mut self, value: u8) {
        let requested = self.exf2 && !self.updown();
        if value & 0x80 != 0 && !self.tf2 {
            self.tf2_since = self.cycle + 1;
        }
        (self.tf2, self.exf2, self.con) = (value & 0x80 != 0, value & 0x40 != 0, value & 0x3F);
        if !requested {
            self.exf2_since = self.cycle + 1;
        }
    }

    pub fn write_t2mod(&mut self, value: u8) {
        let requested = self.exf2 && !self.updown();
        self.t2mod = value & 3;
        if !requested {
            self.exf2_since = self.cycle + 1;
        }
    }

    /// Executes from S6 of the cycle before to S5 of the next.
    pub fn tick(&mut self) {
        self.finish();
        self.cycle += 1;
        (0..5).for_each(|state| self.state(state));
        self.s6_done = false;
    }

    fn state(&mut self, state: u64) {
        let counter = self.bit(1);
        let by_state = self.generator() && !counter;
        let count = self.bit(2) && if by_state { true } else { state == 2 && (!counter || self.t2_edge) };
        if count {
            self.count(self.cycle * 6 + state);
        }
        if state == 4 {
            self.t2_edge = self.sample[0] && !self.pins[0];
            let edge = self.sample[1] && !self.pins[1];
            if edge && self.bit(3) && !self.updown() {
                self.flag_log.push(self.cycle);
                if !self.exf2 {
                    self.exf2_since = self.cycle;
                }
                self.exf2 = true;
                match (self.generator(), self.bit(0)) {
                    (true, _) => {}
                    (false, true) => self.rcap = self.value,
                    (false, false) => self.value = self.rcap,
                }
            }
            self.sample = self.pins;
        }
    }

    fn count(&mut self, state: u64) {
        let capture = self.bit(0) && !self.generator();
        let down = self.updown() && !self.pins[1];
        let last = if down { self.rcap } else { 0xFFFF };
        if self.value != last {
            self.value = if down { self.value.wrapping_sub(1) } else { self.value + 1 };
            return;
        }
        self.value = match (down, capture) {
            (true, _) => 0xFFFF,
            (false, true) => 0,
            (false, false) => self.rcap,
        };
        if self.generator() {
            self.overflows += 1;
            self.overflow_log.push(state);
            if self.clock_on() {
                self.clock = !self.clock;
                self.toggle_log.push(state);
            }
            return;
        }
        self.flag_log.push(self.cycle - 1);
        // A TF2 written at the end of the cycle before would be polled a cycle later than this one.
        if !self.tf2 || self.tf2_since == self.cycle {
            self.tf2_since = self.cycle - 1;
        }
        self.tf2 = true;
        if self.updown() {
            self.exf2 = !self.exf2;
        }
    }
}
