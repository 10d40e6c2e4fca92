//! A model of the external interrupts that steps cycle by cycle: every pin with its flip-flops, as in section
//! 13 and figure 13-1.

/// The pins of a chip: INT inputs, inputs with asynchronous edges, inputs with ISCn0 only, whether edges
/// wake, pins by group.
pub struct Chip {
    pub ints: usize,
    pub unclocked: &'static [usize],
    pub edge_only: &'static [usize],
    /// True if clocked edges are also detected while the clock is stopped.
    pub edges_wake: bool,
    pub masks: [u8; 4],
}

#[derive(Clone, Copy, PartialEq)]
enum Sense {
    Low,
    Any,
    Falling,
    Rising,
    Nothing,
}

pub struct Model {
    chip: &'static Chip,
    /// EICRA and EICRB.
    eicr: [u8; 2],
    eimsk: u8,
    intf: [bool; 8],
    pcicr: u8,
    pcif: [bool; 4],
    pcmsk: [u8; 4],
    clock_on: bool,
    int: [bool; 8],
    /// Three flip-flops after each input.
    flops: [[bool; 3]; 8],
    pc: [bool; 32],
    pin_sync: [bool; 32],
    pcint_syn: [bool; 4],
    pcint_setflag: [bool; 4],
    /// Flags set at the current edge.
    pub set_now: ([bool; 8], [bool; 4]),
    /// True if INTF0 was set at the current edge and was clear before.
    pub reported: bool,
}

impl Model {
    pub fn new(chip: &'static Chip) -> Model {
        Model {
            chip,
            eicr: [0; 2],
            eimsk: 0,
            intf: [false; 8],
            pcicr: 0,
            pcif: [false; 4],
            pcmsk: [0; 4],
            clock_on: true,
            int: [false; 8],
            flops: [[false; 3]; 8],
            pc: [false; 32],
            pin_sync: [false; 32],
            pcint_syn: [false; 4],
            pcint_setflag: [false; 4],
            set_now: Default::default(),
            reported: false,
        }
    }

    fn isc(&self, n: usize) -> u8 {
        self.eicr[n / 4] >> (n % 4 * 2) & 3
    }

    fn sense(&self, n: usize) -> Sense {
        let isc = self.isc(n) | if self.chip.edge_only.contains(&n) { 2 } else { 0 };
        match isc {
            0 => Sense::Low,
            1 if self.chip.unclocked.contains(&n) => Sense::Nothing,
            1 => Sense::Any,
            2 => Sense::Falling,
            _ => Sense::Rising,
        }
    }

    fn set_int(&mut self, n: usize) {
        self.reported |= n == 0 && !self.intf[0];
        self.intf[n] = true;
        self.set_now.0[n] = true;
    }

    /// Executes the edge that ends a cycle.
    pub fn tick(&mut self) {
        self.set_now = Default::default();
        self.reported = false;
        if !self.clock_on {
            return;
        }
        for n in 0..self.chip.ints {
            let [sampled, second, third] = self.flops[n];
            let edge = match self.sense(n) {
                Sense::Any => second != third,
                Sense::Falling => !second && third,
                Sense::Rising => second && !third,
                Sense::Low | Sense::Nothing => false,
            };
            if edge && !self.chip.unclocked.contains(&n) {
                self.set_int(n);
            }
            self.flops[n] = [self.int[n], sampled, second];
        }
        for group in 0..4 {
            if self.pcint_setflag[group] {
                self.pcif[group] = true;
                self.set_now.1[group] = true;
            }
            self.pcint_setflag[group] = self.pcint_syn[group];
            self.pcint_syn[group] = self.pcint_in(group);
        }
        self.pin_sync = self.pc;
    }

    fn pcint_in(&self, group: usize) -> bool {
        (0..8).any(|bit| {
            let pin = group * 8 + bit;
            self.pc[pin] != self.pin_sync[pin] && self.pcmsk[group] >> bit & 1 != 0
        })
    }

    pub fn int(&mut self, n: usize, high: bool) {
        if n >= self.chip.ints {
            return;
        }
        let rises = !self.int[n] && high;
        let falls = self.int[n] && !high;
        self.int[n] = high;
        let sense = self.sense(n);
        if self.chip.unclocked.contains(&n) && (rises && sense == Sense::Rising || falls && sense == Sense::Falling) {
            self.set_int(n);
        }
        if !self.clock_on && self.chip.edges_wake {
            self.catch(n);
        }
    }

    /// Sets the flag for an edge anywhere in the chain of flip-flops, without a clock.
    fn catch(&mut self, n: usize) {
        let [first, second, third] = self.flops[n];
        let steps = [(third, second), (second, first), (first, self.int[n])];
        let (rises, falls) = (steps.contains(&(false, true)), steps.contains(&(true, false)));
        let edge = match self.sense(n) {
            Sense::Any => rises || falls,
            Sense::Falling => falls,
            Sense::Rising => rises,
            Sense::Low | Sense::Nothing => false,
        };
        if edge && !self.chip.unclocked.contains(&n) {
            self.set_int(n);
        }
        self.flops[n] = [self.int[n]; 3];
    }

    pub fn pc(&mut self, n: usize, high: bool) {
        if self.chip.masks[n / 8] >> (n % 8) & 1 != 0 {
            self.pc[n] = high;
        }
    }

    /// Writes a register, by its index in the list of the random programs.
    pub fn write(&mut self, reg: usize, value: u8, mask: u8) {
        let mix = |old: u8, there: u8| (old & !mask | value & mask) & there;
        match reg {
            0 | 1 => self.write_isc(reg, value, mask),
            2 => self.eimsk = mix(self.eimsk, (0..self.chip.ints).map(|n| 1 << n).sum()),
            3 => {
                for n in 0..8 {
                    if value & mask & 1 << n != 0 && !self.set_now.0[n] {
                        self.intf[n] = false;
                    }
                }
            }
            4 => self.pcicr = mix(self.pcicr, (0..4).filter(|&g| self.chip.masks[g] != 0).map(|g| 1 << g).sum()),
            5 => {
                for g in 0..4 {
                    if value & mask & 1 << g != 0 && !self.set_now.1[g] {
                        self.pcif[g] = false;
                    }
                }
            }
            _ => self.pcmsk[reg - 6] = mix(self.pcmsk[reg - 6], self.chip.masks[reg - 6]),
        }
    }

    fn write_isc(&mut self, which: usize, value: u8, mask: u8) {
        for n in which * 4..which * 4 + 4 {
            let (isc0, isc1) = (1 << (n % 4 * 2), 2 << (n % 4 * 2));
            let there = match (n < self.chip.ints, self.chip.edge_only.contains(&n)) {
                (false, _) => 0,
                (true, true) => isc0,
                (true, false) => isc0 | isc1,
            };
            let wanted_high = self.eicr[which] & isc0 != 0;
            let bits = mask & there;
            self.eicr[which] = self.eicr[which] & !bits | value & bits;
            let wants_high = self.eicr[which] & isc0 != 0;
            match self.sense(n) {
                Sense::Low => self.intf[n] = false,
                // The selected edge is reversed, to the level that the pin already has.
                Sense::Falling | Sense::Rising
                    if self.chip.unclocked.contains(&n) && wants_high != wanted_high && wants_high == self.int[n] =>
                {
                    self.set_int(n);
                }
                _ => {}
            }
        }
    }

    pub fn taken(&mut self, irq: usize) {
        match irq.checked_sub(self.chip.ints) {
            None => self.intf[irq] = false,
            Some(group) => self.pcif[group] = false,
        }
    }

    pub fn interrupts(&self) -> usize {
        self.chip.ints + self.chip.masks.iter().filter(|&&m| m != 0).count()
    }

    pub fn clock(&mut self, on: bool) {
        if self.clock_on && !on && self.chip.edges_wake {
            (0..self.chip.ints).for_each(|n| self.catch(n));
        }
        self.clock_on = on;
    }

    pub fn clock_is_on(&self) -> bool {
        self.clock_on
    }

    /// Resets registers and the flip-flops after the first one.
    pub fn reset(&mut self) {
        let first: Vec<bool> = self.flops.iter().map(|flops| flops[0]).collect();
        let new = Model::new(self.chip);
        *self = Model { int: self.int, pc: self.pc, pin_sync: self.pin_sync, reported: self.reported, ..new };
        for (flops, first) in self.flops.iter_mut().zip(first) {
            *flops = [first; 3];
        }
    }

    pub fn get(&self, reg: usize) -> u8 {
        match reg {
            0 | 1 => self.eicr[reg],
            2 => self.eimsk,
            3 => self.intf.iter().rev().fold(0, |bits, &flag| bits << 1 | u8::from(flag)),
            4 => self.pcicr,
            5 => self.pcif.iter().rev().fold(0, |bits, &flag| bits << 1 | u8::from(flag)),
            _ => self.pcmsk[reg - 6],
        }
    }

    pub fn requests(&self) -> u8 {
        let mut asked = 0;
        for n in 0..self.chip.ints {
            let wants = self.intf[n] || self.sense(n) == Sense::Low && !self.int[n];
            if wants && self.eimsk >> n & 1 != 0 {
                asked |= 1 << n;
            }
        }
        for group in 0..self.interrupts() - self.chip.ints {
            let wakes = self.pcint_in(group) || self.pcint_syn[group] || self.pcint_setflag[group];
            let wants = self.pcif[group] || !self.clock_on && wakes;
            if wants && self.pcicr >> group & 1 != 0 {
                asked |= 1 << (self.chip.ints + group);
            }
        }
        asked
    }
}
