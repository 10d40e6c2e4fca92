//! The parts around the core: input latches, M, output channels, modules, and their pins.

use std::convert::Infallible;

use emu_core::cpu::{Bus, BusEffect, NEVER};
use emu_core::external_io::{DriveQueue, EventLog, OutsideInput};
use emu_core::pins::{ChipEvent, CycleTime, PinId, PinLevel};
use emu_core::state::{SnapshotDamaged, SnapshotState, StateTape};

use crate::chips::{CLEAR_PIN, FIRST_OUTPUT, PIN_COUNT, POWER_PIN};
use crate::config::{Ap101Config, INPUTS, InputSampling, MODULES, OUTPUTS};
use crate::modules::Ap101Module;
use crate::operands::{BitAddress, BitLocation, CELL_COUNT, IMAGE_START, M_START};

/// Clocks per machine cycle.
pub(crate) const CLOCKS: u64 = 2;

/// The first bit of M that enables a program.
const ENABLES: u16 = M_START + 248;

/// Channels, memory and modules.
#[derive(Debug, Clone)]
pub struct Ap101Soc {
    /// Input latches, then M with the images of outputs. With live inputs, a latch is the level of its pin.
    pub(crate) cells: [bool; CELL_COUNT],
    /// The bistables of the outputs.
    outputs: [bool; OUTPUTS as usize],
    /// The outputs that the present program cycle has written.
    written_outputs: [bool; OUTPUTS as usize],
    pub(crate) modules: Box<[Ap101Module; MODULES]>,
    /// Levels driven on the pins from outside.
    driven_levels: Box<[PinLevel; PIN_COUNT]>,
    /// Future drives; their times are in clocks.
    drives: DriveQueue,
    pub(crate) log: EventLog,
    input_channels: u16,
    output_channels: u16,
    reads_inputs_live: bool,
    /// The first machine cycle of the present program cycle.
    cycle_start: u64,
    /// Whether an output has changed or the program has changed a preset, which a comparison of two states
    /// cannot show.
    pub(crate) has_changed: bool,
    /// Whether the machine works, so that its pins have an effect: it has its supply since the last boundary.
    pub(crate) is_supplied: bool,
    /// Whether the supply was lost since the last boundary.
    supply_was_lost: bool,
    /// Whether a cold start was requested since the last boundary.
    cold_start_requested: bool,
}

/// What has happened to the supply.
pub(crate) struct SupplyEvents {
    /// It was gone.
    pub was_lost: bool,
    /// A cold start was asked for.
    pub cold_start_requested: bool,
}

impl SnapshotState for Ap101Soc {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        #[rustfmt::skip]
        let Ap101Soc {
            log, input_channels: _, output_channels: _, reads_inputs_live: _, is_supplied: _, cells, outputs, written_outputs: written, modules, driven_levels: outside, drives, cycle_start: begun, has_changed: moved, supply_was_lost: dipped, cold_start_requested: rose,
        } = self;
        *begun = tape.now();
        cells.pass_state(tape)?;
        outputs.pass_state(tape)?;
        written.pass_state(tape)?;
        tape.pass_slice(modules.as_mut_slice())?;
        tape.pass_slice(outside.as_mut_slice())?;
        drives.pass_state(tape)?;
        moved.pass_state(tape)?;
        dipped.pass_state(tape)?;
        rose.pass_state(tape)?;
        *log = EventLog::OFF;
        Ok(())
    }
}

/// The level of a pin as a bit; an undriven pin reads 0.
const fn is_high(level: PinLevel) -> bool {
    matches!(level, PinLevel::High | PinLevel::PullUp)
}

impl Ap101Soc {
    /// The state without supply: all bits are 0.
    pub(crate) fn new(config: &Ap101Config, inputs: InputSampling, hz: u64) -> Ap101Soc {
        Ap101Soc {
            cells: [false; CELL_COUNT],
            outputs: [false; OUTPUTS as usize],
            written_outputs: [false; OUTPUTS as usize],
            modules: Box::new(config.modules.map(|settings| Ap101Module::new(settings, hz))),
            driven_levels: Box::new([PinLevel::Float; PIN_COUNT]),
            drives: DriveQueue::NONE,
            log: EventLog::OFF,
            input_channels: config.input_channels,
            output_channels: config.output_channels,
            reads_inputs_live: inputs == InputSampling::Live,
            cycle_start: 0,
            has_changed: false,
            is_supplied: false,
            supply_was_lost: false,
            cold_start_requested: false,
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

    /// The clock of the next drive, or [`NEVER`](emu_core::cpu::NEVER).
    #[inline(always)]
    pub(crate) fn next(&self) -> u64 {
        self.drives.next_cycle()
    }

    /// Applies drives up to the clock `now`; returns true if there were any.
    #[inline(always)]
    pub(crate) fn apply_drives(&mut self, now: u64) -> bool {
        self.drives.next_cycle() <= now && self.drive_up_to(now)
    }

    /// As [`Ap101Soc::apply_drives`], if there is a drive.
    #[cold]
    fn drive_up_to(&mut self, now: u64) -> bool {
        let mut fired = false;
        while self.drives.next_cycle() <= now {
            let clock = self.drives.next_cycle();
            let Some((pin, level)) = self.drives.pop_due(now) else { break };
            let at = CycleTime { cycle: clock / CLOCKS, phase: (clock % CLOCKS) as u8 };
            self.apply_level(at, pin, level);
            fired = true;
        }
        fired
    }

    /// Applies a drive of a pin.
    fn apply_level(&mut self, at: CycleTime, pin: PinId, level: PinLevel) {
        if (FIRST_OUTPUT..POWER_PIN).contains(&pin) {
            // A drive of an output changes its bistable but not its image. A drive without a level, or
            // without supply, has no effect.
            if matches!(level, PinLevel::Low | PinLevel::High) && self.is_supplied && self.has_pin(pin) {
                self.set_output(pin - FIRST_OUTPUT, level == PinLevel::High, at);
            }
            return;
        }
        let before = self.level(pin);
        let Some(outside) = self.driven_levels.get_mut(usize::from(pin)) else { return };
        let was_high = is_high(*outside);
        *outside = level;
        let after = self.level(pin);
        if after != before {
            self.log.record(ChipEvent::Edge { at, pin, level: after });
        }
        match pin {
            POWER_PIN => self.supply_was_lost |= after == PinLevel::Low,
            CLEAR_PIN => self.cold_start_requested |= self.is_supplied && is_high(level) && !was_high,
            _ if self.reads_inputs_live && pin < self.input_channels => self.set(pin, is_high(level)),
            _ => {}
        }
    }

    /// Whether the supply is present.
    pub(crate) fn has_supply(&self) -> bool {
        self.level(POWER_PIN) != PinLevel::Low
    }

    /// Whether CLEAR requests a cold start.
    pub(crate) fn has_clear_request(&self) -> bool {
        self.level(CLEAR_PIN) == PinLevel::High
    }

    /// What has happened to the supply since it was last asked.
    pub(crate) fn take_supply_events(&mut self) -> SupplyEvents {
        SupplyEvents {
            was_lost: std::mem::take(&mut self.supply_was_lost),
            cold_start_requested: std::mem::take(&mut self.cold_start_requested),
        }
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

    /// Sets the bistable of an output; returns true if that changed it.
    #[inline(always)]
    pub(crate) fn set_output(&mut self, n: u16, bit: bool, at: CycleTime) -> bool {
        let changed = std::mem::replace(&mut self.outputs[usize::from(n % OUTPUTS)], bit) != bit;
        if changed {
            self.has_changed = true;
            if self.log.is_enabled() {
                self.log.record(ChipEvent::Edge {
                    at,
                    pin: FIRST_OUTPUT + n % OUTPUTS,
                    level: PinLevel::from_bit(bit),
                });
            }
        }
        changed
    }

    /// The program writes an output: bistable and image. The change is visible from the machine cycle `cycle`
    /// on.
    #[inline(always)]
    pub(crate) fn write_output(&mut self, n: u16, bit: bool, cycle: u64) -> bool {
        self.set(IMAGE_START + n, bit);
        self.written_outputs[usize::from(n % OUTPUTS)] = true;
        self.set_output(n, bit, CycleTime::at(cycle))
    }

    /// A module, by number.
    pub(crate) fn module(&self, n: u16) -> &Ap101Module {
        &self.modules[usize::from(n) % MODULES]
    }

    /// A module, by number, for changes.
    pub(crate) fn module_mut(&mut self, n: u16) -> &mut Ap101Module {
        &mut self.modules[usize::from(n) % MODULES]
    }

    /// The program sets the preset of a module.
    pub(crate) fn set_preset(&mut self, n: u16, preset: u16) {
        self.has_changed |= self.module(n).preset() != preset;
        self.module_mut(n).set_preset(preset);
    }

    /// The modules that exist.
    pub(crate) fn existing_modules(&self) -> impl Iterator<Item = &Ap101Module> {
        self.modules.iter().filter(|module| module.exists())
    }

    /// Whether inputs are read live.
    pub(crate) const fn reads_inputs_live(&self) -> bool {
        self.reads_inputs_live
    }

    /// Number of output channels, which is also the number of machine cycles of a reload.
    pub(crate) const fn channels(&self) -> u64 {
        self.output_channels as u64
    }

    /// Starts a program cycle: inputs are latched, and no output counts as written.
    pub(crate) fn begin(&mut self, cycle: u64) {
        self.cycle_start = cycle;
        self.written_outputs = [false; OUTPUTS as usize];
        if !self.reads_inputs_live {
            self.latch_inputs();
        }
    }

    /// Copies the pin levels to the input latches.
    fn latch_inputs(&mut self) {
        for (latch, &level) in self.cells.iter_mut().zip(self.driven_levels.iter()).take(self.input_channels.into()) {
            *latch = is_high(level);
        }
    }

    /// Reloads the output channels that are due in the machine cycles `from` to `to` (exclusive) of a reload
    /// that began at `first`. An output that was not written is set to its image at the end of its cycle.
    pub(crate) fn reload(&mut self, first: u64, from: u64, to: u64) {
        let channels = (from - first) as usize..(to - first).min(self.channels()) as usize;
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
                self.set_output(n as u16, image, CycleTime::at(first + n as u64 + 1));
            }
        }
    }

    /// Whether the bit of M for the program `entry` of the table enables it.
    pub(crate) const fn is_enabled(&self, entry: u8) -> bool {
        self.get(ENABLES + entry as u16)
    }

    /// The supply is lost at a machine cycle: everything that is not protected becomes 0.
    pub(crate) fn reset_on_power_loss(&mut self, config: &Ap101Config, hz: u64, cycle: u64) {
        for n in 0..OUTPUTS {
            self.set_output(n, false, CycleTime::at(cycle));
        }
        for (module, settings) in self.modules.iter_mut().zip(config.modules) {
            *module = Ap101Module::new(settings, hz);
        }
        self.written_outputs = [false; OUTPUTS as usize];
        if !self.reads_inputs_live {
            self.cells[..usize::from(M_START)].fill(false);
        }
    }

    /// A cold start clears M and, in reconfigurable mode, initialises the bits that enable programs.
    pub(crate) fn clear(&mut self, config: &Ap101Config) {
        self.cells[usize::from(M_START)..].fill(false);
        if config.reconfigurable {
            for (bit, &enabled) in (ENABLES..).zip(&config.enabled) {
                self.set(bit, enabled);
            }
        }
    }
}

impl Ap101Soc {
    /// Reads a location in the machine cycle `now`.
    #[inline(never)]
    fn read_location(&self, place: BitAddress, now: u64) -> bool {
        match place.location() {
            BitLocation::Cell(cell) => self.get(cell),
            BitLocation::Output(n) => self.get(IMAGE_START + n),
            BitLocation::Module(n) => self.module(n).q(now),
            BitLocation::Running(n) => self.module(n).is_running(now),
            BitLocation::Port(_) | BitLocation::Nothing(_) => false,
        }
    }

    /// Writes to a location; the change is visible from the machine cycle `next` on. Returns true if a pin
    /// changes.
    #[inline(never)]
    fn write_location(&mut self, place: BitAddress, bit: bool, next: u64) -> bool {
        match place.location() {
            BitLocation::Output(n) => return self.write_output(n, bit, next),
            BitLocation::Cell(cell) if cell >= M_START || !self.reads_inputs_live => self.set(cell, bit),
            BitLocation::Module(n) => {
                let cycle_start = self.cycle_start;
                self.module_mut(n).write(bit, next, cycle_start);
            }
            BitLocation::Running(n) if bit => self.module_mut(n).clear(next),
            _ => {}
        }
        false
    }
}

/// A register is a [`BitAddress`], and its value is 0 or 1.
impl Bus for Ap101Soc {
    type Request = Infallible;

    #[inline(always)]
    fn read(&mut self, reg: u16, now: u64) -> (u8, BusEffect) {
        (self.read_location(BitAddress(reg), now).into(), BusEffect::NONE)
    }

    fn peek(&self, reg: u16, now: u64) -> u8 {
        self.read_location(BitAddress(reg), now).into()
    }

    #[inline(always)]
    fn write(&mut self, reg: u16, value: u8, now: u64) -> BusEffect {
        let changed = self.write_location(BitAddress(reg), value & 1 != 0, now.wrapping_add(1));
        if changed { BusEffect::RECHECK } else { BusEffect::NONE }
    }

    fn write_bits(&mut self, reg: u16, mask: u8, value: u8, now: u64) -> BusEffect {
        if mask & 1 != 0 { self.write(reg, value, now) } else { BusEffect::NONE }
    }

    /// Applies the drives at the first clock of the cycle `now`, and all before.
    #[inline(always)]
    fn fire(&mut self, now: u64) -> u64 {
        self.apply_drives(CLOCKS * now);
        if self.next() == NEVER { NEVER } else { self.next().div_ceil(CLOCKS) }
    }

    fn is_core_stopped(&self) -> bool {
        !self.is_supplied
    }

    /// Only a drive of the supply or of CLEAR starts a machine that does not run.
    fn can_wake(&self, _: bool) -> bool {
        false
    }

    fn is_busy(&self) -> bool {
        self.next() != NEVER
    }

    fn level(&self, pin: PinId) -> PinLevel {
        match pin {
            FIRST_OUTPUT..POWER_PIN if self.has_pin(pin) => PinLevel::from_bit(self.output(pin - FIRST_OUTPUT)),
            FIRST_OUTPUT..POWER_PIN => PinLevel::Float,
            _ => match self.driven_levels.get(usize::from(pin)) {
                None | Some(PinLevel::Float) => PinLevel::Float,
                Some(&level) => PinLevel::from_bit(is_high(level)),
            },
        }
    }

    /// Models levels only.
    fn queue_input(&mut self, at: CycleTime, now: u64, input: OutsideInput) -> bool {
        let OutsideInput::Level(pin, level) = input else { return false };
        let clock = at.cycle.saturating_mul(CLOCKS).saturating_add(at.phase.into());
        self.drives.push(clock.max(CLOCKS * now).min(NEVER - 1), (pin, level));
        true
    }

    fn set_event_log(&mut self, on: bool, now: u64) {
        self.log.set_enabled(on, now, std::iter::empty());
    }

    #[inline]
    fn event_log(&mut self) -> &mut EventLog {
        &mut self.log
    }
}
