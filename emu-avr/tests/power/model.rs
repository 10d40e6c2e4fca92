//! A model of the chip around the core by sections 9 to 12 of DS40002061 that steps cycle by cycle. Timer 0
//! with the core clock shows whether the I/O clock runs.

pub const CLKPCE: u8 = 0x80;
pub const TSM: u8 = 0x80;
/// Bits of MCUCR.
pub const BODS: u8 = 0x40;
pub const BODSE: u8 = 0x20;
pub const PUD: u8 = 0x10;
pub const IVSEL: u8 = 0x02;
pub const IVCE: u8 = 0x01;
/// Bits of PRR.
pub const PRTIM0: u8 = 0x20;
/// TCCR0B: clock of the core.
const CS00: u8 = 0x01;

/// Settings that follow from fuse bytes: CLKPS after reset, clocks of a wake-up from power-down and of a
/// reset, microseconds of a reset, threshold of the brown-out detector in millivolts (0 is off). Tables 9-4,
/// 9-11, 9-13, 28-5, 28-7.
pub struct Fuses {
    pub bytes: [u8; 3],
    pub clkps: u8,
    pub wake: u64,
    pub start: (u64, u64),
    pub bod: u32,
}

#[rustfmt::skip]
pub const FUSES: [Fuses; 6] = [
    Fuses { bytes: [0x62, 0xD9, 0xFF], clkps: 3, wake: 6,      start: (20, 65_000),     bod: 0 },
    Fuses { bytes: [0xE2, 0xD9, 0xFD], clkps: 0, wake: 6,      start: (20, 65_000),     bod: 2_700 },
    Fuses { bytes: [0xC2, 0xD9, 0xFE], clkps: 0, wake: 6,      start: (20, 0),          bod: 1_800 },
    Fuses { bytes: [0xD0, 0xD9, 0xFC], clkps: 0, wake: 6,      start: (20, 4_100),      bod: 4_300 },
    Fuses { bytes: [0xEE, 0xD9, 0xFC], clkps: 0, wake: 1_024,  start: (1_038, 0),       bod: 4_300 },
    Fuses { bytes: [0x7E, 0xD9, 0xFD], clkps: 3, wake: 1_024,  start: (1_038, 4_100),   bod: 2_700 },
];

/// Supply in millivolts below which the chip is without power.
const POWER_ON: u32 = 1_400;

/// Action of the core in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Act {
    Nothing,
    Write(u16, u8),
    Sleep,
}

pub struct Model {
    fuses: &'static Fuses,
    /// True if start-up takes time.
    waits: bool,
    /// Frequency of the oscillator in Hz.
    hz: u64,
    pub clkps: u8,
    pub mcusr: u8,
    pub mcucr: u8,
    pub smcr: u8,
    pub prr: u8,
    pub gtccr: u8,
    pub osccal: u8,
    pub gpior: u8,
    /// Remaining cycles of CLKPCE, IVCE, BODS with BODSE, and BODS.
    clkpce: u8,
    ivce: u8,
    bodse: u8,
    bods: u8,
    tccr0b: u8,
    tcnt0: u8,
    /// Cycles until the core runs; counts down while nothing holds the chip in reset.
    pub standing: u64,
    low: bool,
    supply: u32,
    brown: bool,
    /// Sleep mode (bits SM), and whether the detector is off; None while awake.
    pub asleep: Option<(u8, bool)>,
    /// Cycles until the clock runs after a wake-up.
    pub waking: u64,
}

impl Model {
    pub fn new(fuses: &'static Fuses, waits: bool, hz: u64) -> Model {
        let mut model = Model {
            fuses,
            waits,
            hz,
            clkps: 0,
            mcusr: 0,
            mcucr: 0,
            smcr: 0,
            prr: 0,
            gtccr: 0,
            osccal: 0,
            gpior: 0,
            clkpce: 0,
            ivce: 0,
            bodse: 0,
            bods: 0,
            tccr0b: 0,
            tcnt0: 0,
            standing: 0,
            low: false,
            supply: 5_000,
            brown: false,
            asleep: None,
            waking: 0,
        };
        model.reset(1);
        model
    }

    /// Resets all registers except MCUSR, in which the cause is set (11.9.1); PORF clears the other causes.
    fn reset(&mut self, cause: u8) {
        self.mcusr = if cause == 1 { 1 } else { self.mcusr | cause };
        (self.clkps, self.mcucr, self.smcr, self.prr, self.gtccr) = (self.fuses.clkps, 0, 0, 0, 0);
        (self.osccal, self.gpior, self.tccr0b, self.tcnt0) = (0x80, 0, 0, 0);
        (self.clkpce, self.ivce, self.bodse, self.bods) = (0, 0, 0, 0);
        (self.asleep, self.waking) = (None, 0);
        self.starts_anew();
    }

    /// Start-up is counted from the end of a reset (11.2): clocks of the oscillator, then a time, in cycles
    /// rounded up.
    fn starts_anew(&mut self) {
        let (clocks, us) = if self.waits { self.fuses.start } else { (0, 0) };
        let hz = self.hz >> self.clkps;
        self.standing = (clocks >> self.clkps) + (us * hz).div_ceil(1_000_000);
    }

    pub fn held(&self) -> bool {
        self.low || self.brown
    }

    /// Sets the level of the reset pin.
    pub fn pin(&mut self, low: bool) {
        let before = self.held();
        if low && !self.low {
            self.reset(2);
        }
        self.low = low;
        if before {
            self.starts_anew();
        }
    }

    /// Sets the supply in millivolts; requests a brown-out reset, or a power-on reset below the minimum
    /// supply.
    pub fn power(&mut self, millivolts: u32) {
        self.supply = millivolts;
        let was_held = self.held();
        if millivolts < POWER_ON {
            self.reset(1);
            self.brown = true;
        } else {
            let off = self.asleep.is_some_and(|(_, off)| off);
            let below = millivolts < self.fuses.bod && !off;
            if below && !self.brown {
                self.reset(4);
            }
            self.brown = below;
        }
        if was_held {
            self.starts_anew();
        }
    }

    /// Reports whether the I/O clock of timer 0 runs.
    fn counts(&self) -> bool {
        let sleeps = self.waking > 0 || self.asleep.is_some_and(|(mode, _)| matches!(mode, 1 | 2 | 3 | 6 | 7));
        !sleeps && self.prr & PRTIM0 == 0
    }

    /// Returns the read value of a register in this cycle.
    pub fn read(&self, reg: u16) -> u8 {
        let shut = self.prr & PRTIM0 != 0;
        match reg {
            0x61 => self.clkps | if self.clkpce > 0 { CLKPCE } else { 0 },
            0x55 => self.mcucr | if self.ivce > 0 { IVCE } else { 0 },
            0x54 => self.mcusr,
            0x53 => self.smcr,
            0x64 => self.prr,
            0x43 => self.gtccr,
            0x66 => self.osccal,
            0x3E => self.gpior,
            0x45 if !shut => self.tccr0b,
            0x46 if !shut => self.tcnt0,
            _ => 0,
        }
    }

    /// Writes a register in this cycle, at the edge that ends it.
    fn write(&mut self, reg: u16, value: u8) {
        let shut = self.prr & PRTIM0 != 0;
        match reg {
            // Writing CLKPCE again neither extends the time nor clears it (9.12.2).
            0x61 if value == CLKPCE => self.clkpce = if self.clkpce > 0 { self.clkpce } else { 5 },
            0x61 if self.clkpce > 0 && value & CLKPCE == 0 => {
                (self.clkps, self.clkpce) = ((value & 15).min(8), 0);
            }
            0x55 => {
                self.mcucr = self.mcucr & !PUD | value & PUD;
                if value & IVCE != 0 {
                    self.ivce = 5;
                } else if self.ivce > 0 {
                    (self.mcucr, self.ivce) = (self.mcucr & !IVSEL | value & IVSEL, 0);
                }
                if value & (BODS | BODSE) == BODS | BODSE {
                    self.bodse = 5;
                } else if value & (BODS | BODSE) == BODS && self.bodse > 0 {
                    self.bods = 4;
                }
            }
            0x54 => self.mcusr &= value,
            0x53 => self.smcr = value & 15,
            0x64 => self.prr = value & 0xEF,
            // PSRASY and PSRSYNC stay set only while TSM holds them (17.4.1).
            0x43 => self.gtccr = if value & TSM != 0 { value & 0x83 } else { 0 },
            0x66 => self.osccal = value,
            0x3E => self.gpior = value,
            0x45 if !shut => self.tccr0b = value & CS00,
            0x46 if !shut => self.tcnt0 = value,
            _ => {}
        }
    }

    /// Wakes the core in this cycle; its clock runs after `waking` cycles. The detector is on again; returns
    /// whether it holds the chip in reset.
    pub fn look_and_wake(&mut self) -> bool {
        let Some((mode, _)) = self.asleep.take() else { return false };
        self.waking = match mode {
            2 | 3 => self.fuses.wake.div_ceil(1 << self.clkps),
            6 | 7 => 6,
            _ => 0,
        };
        self.supply >= POWER_ON && self.supply < self.fuses.bod
    }

    /// The detector detects a low supply that began during sleep.
    pub fn power_again(&mut self) {
        self.power(self.supply);
    }

    /// Executes the edge that ends this cycle.
    pub fn edge(&mut self, act: Act) {
        if self.standing > 0 && !self.held() {
            self.standing -= 1;
        }
        if self.counts() && self.tccr0b & CS00 != 0 {
            self.tcnt0 = self.tcnt0.wrapping_add(1);
        }
        match act {
            Act::Write(reg, value) => self.write(reg, value),
            Act::Sleep if self.smcr & 1 != 0 => self.asleep = Some((self.smcr >> 1 & 7, self.bods > 0)),
            Act::Sleep | Act::Nothing => {}
        }
        self.waking = self.waking.saturating_sub(1);
        for left in [&mut self.clkpce, &mut self.ivce, &mut self.bodse, &mut self.bods] {
            *left = left.saturating_sub(1);
        }
    }
}
