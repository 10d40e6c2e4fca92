//! The channels, the memory M, and the images of outputs in M.

use emu_core::device::Device;
use emu_core::pins::{CycleTime, PinId};
use emu_core::state;

use crate::chips::{CLEAR_PIN, FIRST_OUTPUT, POWER_PIN};
use crate::config::{Ap101Config, INPUTS, InputSampling, OUTPUTS};
use crate::operands::{BitLocation, CELL_COUNT, IMAGE_START, M_START};
use crate::soc::{Ap101Outbox, Ap101Signal};

/// The first bit of M that enables a program.
const ENABLES: u16 = M_START + 248;

/// Channels and memory.
#[derive(Debug, Clone)]
pub(crate) struct Ap101Channels {
    /// Input latches, then M with the images of outputs. With live inputs, a latch is the level of its pin.
    pub cells: [bool; CELL_COUNT],
    /// The bistables of the outputs.
    outputs: [bool; OUTPUTS as usize],
    /// The outputs that the present program cycle has written.
    written_outputs: [bool; OUTPUTS as usize],
    input_channels: u16,
    output_channels: u16,
    reads_inputs_live: bool,
}

state! { Ap101Channels { cells, outputs, written_outputs } stays { input_channels, output_channels, reads_inputs_live } }

/// A register is a cell or an output, and its value is 0 or 1. The time of a write is the machine cycle from
/// which it is visible. The program cycle says when inputs are latched and outputs reloaded, so nothing is
/// due here.
impl Device<Ap101Signal> for Ap101Channels {
    type Reg = BitLocation;

    #[inline(always)]
    fn peek(&self, reg: BitLocation, _t: u64) -> u8 {
        match reg {
            BitLocation::Cell(cell) => self.get(cell).into(),
            BitLocation::Output(n) => self.get(IMAGE_START + n).into(),
            _ => 0,
        }
    }

    /// Writing an output writes its bistable and its image.
    #[inline(always)]
    fn write(&mut self, reg: BitLocation, value: u8, _mask: u8, t: u64, out: &mut Ap101Outbox) {
        let bit = value & 1 != 0;
        match reg {
            BitLocation::Output(n) => {
                self.set(IMAGE_START + n, bit);
                self.written_outputs[usize::from(n % OUTPUTS)] = true;
                self.set_output(n, bit, CycleTime::at(t), out);
            }
            BitLocation::Cell(cell) if cell >= M_START || !self.reads_inputs_live => self.set(cell, bit),
            _ => {}
        }
    }

    /// The level of an input pin, which reaches its latch at once if inputs are read live.
    fn on_line_changed(&mut self, pin: PinId, high: bool, _t: u64, _out: &mut Ap101Outbox) {
        if self.reads_inputs_live && pin < self.input_channels {
            self.set(pin, high);
        }
    }

    /// The supply is lost: everything that is not protected becomes 0.
    fn reset(&mut self, _power_on: bool, t: u64, out: &mut Ap101Outbox) {
        for n in 0..OUTPUTS {
            self.set_output(n, false, CycleTime::at(t), out);
        }
        self.written_outputs = [false; OUTPUTS as usize];
        if !self.reads_inputs_live {
            self.cells[..usize::from(M_START)].fill(false);
        }
    }
}

impl Ap101Channels {
    /// The state without supply: all bits are 0.
    pub(crate) fn new(config: &Ap101Config, inputs: InputSampling) -> Ap101Channels {
        Ap101Channels {
            cells: [false; CELL_COUNT],
            outputs: [false; OUTPUTS as usize],
            written_outputs: [false; OUTPUTS as usize],
            input_channels: config.input_channels,
            output_channels: config.output_channels,
            reads_inputs_live: inputs == InputSampling::Live,
        }
    }

    /// Whether the machine has this channel or pin.
    pub(crate) fn has_pin(&self, pin: PinId) -> bool {
        match pin {
            0..INPUTS => pin < self.input_channels,
            FIRST_OUTPUT..POWER_PIN => pin - FIRST_OUTPUT < self.output_channels,
            _ => pin <= CLEAR_PIN,
        }
    }

    /// Whether it has the maximum number of channels.
    pub(crate) fn has_all_channels(&self) -> bool {
        self.input_channels == INPUTS && self.output_channels == OUTPUTS
    }

    /// Reads a bit of memory.
    #[inline(always)]
    pub(crate) const fn get(&self, cell: u16) -> bool {
        self.cells[cell as usize % CELL_COUNT]
    }

    /// Writes a bit of memory.
    #[inline(always)]
    pub(crate) const fn set(&mut self, cell: u16, bit: bool) {
        self.cells[cell as usize % CELL_COUNT] = bit;
    }

    /// The bistable of an output.
    pub(crate) const fn output(&self, n: u16) -> bool {
        self.outputs[n as usize % OUTPUTS as usize]
    }

    /// Sets the bistable of an output, and leaves a signal if that changes it.
    #[inline(always)]
    pub(crate) fn set_output(&mut self, n: u16, bit: bool, at: CycleTime, out: &mut Ap101Outbox) {
        if std::mem::replace(&mut self.outputs[usize::from(n % OUTPUTS)], bit) != bit {
            out.push(Ap101Signal { at, pin: FIRST_OUTPUT + n % OUTPUTS, high: bit });
        }
    }

    /// Whether inputs are read live.
    pub(crate) const fn reads_inputs_live(&self) -> bool {
        self.reads_inputs_live
    }

    /// Number of output channels, which is also the number of machine cycles of a reload.
    pub(crate) const fn output_channel_count(&self) -> u64 {
        self.output_channels as u64
    }

    /// Starts a program cycle with the levels of the input pins: inputs are latched, and no output counts as
    /// written.
    pub(crate) fn begin(&mut self, levels: impl Iterator<Item = bool>) {
        self.written_outputs = [false; OUTPUTS as usize];
        if !self.reads_inputs_live {
            for (latch, level) in self.cells.iter_mut().zip(levels).take(self.input_channels.into()) {
                *latch = level;
            }
        }
    }

    /// Reloads the output channels that are due in the machine cycles `from` to `to` (exclusive) of a reload
    /// that began at `first`. An output that was not written is set to its image at the end of its cycle.
    pub(crate) fn reload(&mut self, first: u64, from: u64, to: u64, out: &mut Ap101Outbox) {
        let channels = (from - first) as usize..(to - first).min(self.output_channel_count()) as usize;
        let images = usize::from(IMAGE_START)..usize::from(IMAGE_START + OUTPUTS);
        let (Some(outputs), Some(written), Some(images)) = (
            self.outputs.get(channels.clone()),
            self.written_outputs.get(channels.clone()),
            self.cells.get(images).and_then(|images| images.get(channels.clone())),
        ) else {
            return;
        };
        let stale = |((output, written), image): ((&bool, &bool), &bool)| !written & (output ^ image);
        if !outputs.iter().zip(written).zip(images).map(stale).fold(false, |any, stale| any | stale) {
            return;
        }
        for n in channels {
            let image = self.get(IMAGE_START + n as u16);
            if !self.written_outputs.get(n).copied().unwrap_or(true) {
                self.set_output(n as u16, image, CycleTime::at(first + n as u64 + 1), out);
            }
        }
    }

    /// Whether the bit of M for the program `entry` of the table enables it.
    pub(crate) const fn is_enabled(&self, entry: u8) -> bool {
        self.get(ENABLES + entry as u16)
    }

    /// A cold start clears M and, in reconfigurable mode, initializes the bits that enable programs.
    pub(crate) fn clear(&mut self, config: &Ap101Config) {
        self.cells[usize::from(M_START)..].fill(false);
        if config.reconfigurable {
            for (bit, &enabled) in (ENABLES..).zip(&config.enabled) {
                self.set(bit, enabled);
            }
        }
    }
}
