//! Options of a machine: clock, times, start-up, readings of the data sheet; and the content of RAM at
//! power-up.

use emu_core::cpu::RamInit;
use emu_core::rng::Rng;

use crate::executor::DATA_ADDRESSES;

/// Selects one of the times that a data sheet gives as a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TimingCorner {
    /// The shortest time.
    Min,
    /// The typical time.
    #[default]
    Typ,
    /// The longest time.
    Max,
}

/// Interpretation of the data sheet where text and figures contradict each other. The defaults follow the
/// figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pic16Readings {
    /// TRMT is "set when the TSR register is empty" (DS39582, register 10-1). If true, TRMT is set at the
    /// start of the stop bit, which TSR does not hold; if false, in the middle of the stop bit, as in figure
    /// 10-2 of DS30292.
    pub trmt_as_stop_begins: bool,
    /// Raising SS within a byte resets the bit counter of the SPI slave (DS39582, 9.3.7). If true, SSPSR
    /// keeps the bits shifted in; if false, SSPSR is loaded again from SSPBUF, as in figure 9-4.
    pub ss_keeps_bits: bool,
}

/// Configuration of a machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Frequency of the oscillator in Hz.
    pub hz: u64,
    /// Range value for the times of watchdog, power-up timer, EEPROM and RC oscillator.
    pub corner: TimingCorner,
    /// First configuration word, which overrides that of the image.
    pub config: Option<u16>,
    /// If true, the start-up timers run after power-on; otherwise the program starts at cycle 0.
    pub start_up: bool,
    /// Frequency of timer 1's crystal in Hz; None if there is no crystal.
    pub timer1_hz: Option<u64>,
    /// If true, the holding capacitor of the converter charges at once; otherwise it charges by the equation
    /// of the data sheet (DS30292, 11.1).
    pub ideal_acquisition: bool,
    /// Interpretations of the data sheet.
    pub readings: Pic16Readings,
}

impl Default for Options {
    /// 4 MHz, typical times, a watch crystal at timer 1.
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

/// Returns the content of RAM after power-up at the machine cycle `now`.
pub(crate) fn power_up_ram(init: RamInit, now: u64) -> [u8; DATA_ADDRESSES] {
    let mut ram = [0; DATA_ADDRESSES];
    if let RamInit::Random(seed) = init {
        Rng::new(seed ^ now).fill(&mut ram);
    }
    ram
}
