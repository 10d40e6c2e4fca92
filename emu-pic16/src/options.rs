//! How a PIC16 is wired, and what its RAM holds then.

use emu_core::cpu::RamInit;
use emu_core::rng::Rng;

use crate::executor::DATA_ADDRESSES;

/// Which of the times that a data sheet gives in bounds a run takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TimingCorner {
    /// The shortest.
    Min,
    /// The typical.
    #[default]
    Typ,
    /// The longest.
    Max,
}

/// Where the text of the data sheet and its figures can be read in two ways. Defaults are the figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pic16Readings {
    /// TRMT is "set when the TSR register is empty" (DS39582, register 10-1): true takes that for the begin of the stop bit, which TSR
    /// does not hold; false for the middle of the stop bit, where figure 10-2 of DS30292 draws it.
    pub trmt_as_stop_begins: bool,
    /// SS raised within a byte resets the bit counter of the SPI slave (DS39582, 9.3.7): true leaves what was shifted in SSPSR; false puts
    /// the byte of SSPBUF there again, as figure 9-4 draws it.
    pub ss_keeps_bits: bool,
}

/// How a machine is wired.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Oscillator, in Hz.
    pub hz: u64,
    /// Watchdog, power-up timer, EEPROM and RC times.
    pub corner: TimingCorner,
    /// The first configuration word, in place of that of the image.
    pub config: Option<u16>,
    /// The start-up timers run after power-on; else the program begins at cycle 0.
    pub start_up: bool,
    /// The crystal of timer 1's oscillator, in Hz; `None` where there is none.
    pub timer1_hz: Option<u64>,
    /// The holding capacitor of the converter is charged at once; else in the time of the data sheet's
    /// equation (DS30292, 11.1).
    pub ideal_acquisition: bool,
    /// Readings of the data sheet.
    pub readings: Pic16Readings,
}

impl Default for Options {
    /// 4 MHz, typical times, a watch crystal.
    fn default() -> Options {
        Options {
            hz: 4_000_000,
            corner: TimingCorner::Typ,
            config: None,
            start_up: true,
            timer1_hz: Some(32_768),
            ideal_acquisition: false,
            readings: Pic16Readings::default(),
        }
    }
}

/// What RAM holds when the supply has come up at the machine cycle `now`.
pub(crate) fn power_up_ram(init: RamInit, now: u64) -> [u8; DATA_ADDRESSES] {
    let mut ram = [0; DATA_ADDRESSES];
    if let RamInit::Random(seed) = init {
        Rng::new(seed ^ now).fill(&mut ram);
    }
    ram
}
