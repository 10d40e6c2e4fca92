//! The parts around the core: input latches, M, output channels, modules, and their pins.

use emu_core::RegisterRead;
use std::convert::Infallible;

use emu_core::cpu::{Bus, BusEffect, NEVER};
use emu_core::device::{Device, DeviceSignal, Outbox, SignalReceiver};
use emu_core::external_io::{DriveQueue, EventLog, OutsideInput};
use emu_core::pins::{ChipEvent, CycleTime, PinId, PinLevel};
use emu_core::state::{SnapshotDamaged, SnapshotState, StateTape};

use crate::channels::Ap101Channels;
use crate::chips::{CLEAR_PIN, FIRST_OUTPUT, PIN_COUNT, POWER_PIN};
use crate::config::{Ap101Config, InputSampling};
use crate::modules::Ap101Modules;
use crate::operands::{BitAddress, BitLocation};

/// Clocks per machine cycle.
pub(crate) const CLOCKS: u64 = 2;

emu_core::device_list!($ CHANNELS: channels, MODULES: modules);

/// A signal of the channels: the bistable of an output has changed.
#[derive(Debug, Clone, Copy)]
pub struct Ap101Signal {
    /// The time.
    pub at: CycleTime,
    /// The pin.
    pub pin: PinId,
    /// The new level.
    pub high: bool,
}

impl DeviceSignal for Ap101Signal {
    type Line = PinId;
}

/// The list in which devices leave their signals.
pub type Ap101Outbox = Outbox<Ap101Signal>;

/// Channels, memory and modules.
#[derive(Debug, Clone)]
pub struct Ap101Soc {
    /// Inputs and outputs.
    pub(crate) channels: Ap101Channels,
    /// Timers and counters.
    pub(crate) modules: Ap101Modules,
    /// Levels driven on the pins from outside.
    driven_levels: Box<[PinLevel; PIN_COUNT]>,
    /// Future drives; their times are in clocks.
    drives: DriveQueue,
    /// The edges for a probe.
    pub(crate) log: EventLog,
    /// Signals that wait; empty between calls.
    out: Ap101Outbox,
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
        let Ap101Soc {
            channels,
            modules,
            driven_levels,
            drives,
            log,
            out: _,
            has_changed,
            is_supplied: _,
            supply_was_lost,
            cold_start_requested,
        } = self;
        channels.pass_state(tape)?;
        modules.pass_state(tape)?;
        tape.pass_slice(driven_levels.as_mut_slice())?;
        drives.pass_state(tape)?;
        has_changed.pass_state(tape)?;
        supply_was_lost.pass_state(tape)?;
        cold_start_requested.pass_state(tape)?;
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
            channels: Ap101Channels::new(config, inputs),
            modules: Ap101Modules::new(config, hz),
            driven_levels: Box::new([PinLevel::Float; PIN_COUNT]),
            drives: DriveQueue::NONE,
            log: EventLog::OFF,
            out: Ap101Outbox::new(),
            has_changed: false,
            is_supplied: false,
            supply_was_lost: false,
            cold_start_requested: false,
        }
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
            if matches!(level, PinLevel::Low | PinLevel::High) && self.is_supplied && self.channels.has_pin(pin) {
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
            _ => self.channels.on_line_changed(pin, is_high(level), at.cycle, &mut self.out),
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

    /// The program sets the preset of a module.
    pub(crate) fn set_preset(&mut self, n: u16, preset: u16) {
        let module = self.modules.module_mut(n);
        self.has_changed |= module.preset() != preset;
        module.set_preset(preset);
    }

    /// Sets the bistable of an output from outside.
    pub(crate) fn set_output(&mut self, n: u16, bit: bool, at: CycleTime) {
        self.channels.set_output(n, bit, at, &mut self.out);
        self.apply_signals(());
    }

    /// Starts a program cycle.
    pub(crate) fn begin(&mut self, cycle: u64) {
        self.modules.begin(cycle);
        self.channels.begin(self.driven_levels.iter().map(|&level| is_high(level)));
    }

    /// Reloads outputs, as [`Ap101Channels::reload`].
    pub(crate) fn reload(&mut self, first: u64, from: u64, to: u64) {
        self.channels.reload(first, from, to, &mut self.out);
        self.apply_signals(());
    }

    /// The supply is lost at a machine cycle.
    pub(crate) fn reset(&mut self, cycle: u64) {
        for_each_unit!(self, unit => unit.reset(true, cycle, &mut self.out));
        self.apply_signals(());
    }
}

impl SignalReceiver for Ap101Soc {
    type Signal = Ap101Signal;
    type Sender = ();

    #[inline(always)]
    fn outbox(&mut self) -> &mut Ap101Outbox {
        &mut self.out
    }

    #[inline(always)]
    fn apply_signal(&mut self, _: (), Ap101Signal { at, pin, high }: Ap101Signal) {
        self.has_changed = true;
        self.log.record(ChipEvent::Edge { at, pin, level: PinLevel::from_bit(high) });
    }
}

impl Ap101Soc {
    /// Reads a location in the machine cycle `now`.
    #[inline(never)]
    fn read_location(&self, place: BitAddress, now: u64) -> u8 {
        match place.location() {
            reg @ (BitLocation::Cell(_) | BitLocation::Output(_)) => self.channels.peek(reg, now),
            reg => self.modules.peek(reg, now),
        }
    }

    /// Writes to a location; the change is visible from the machine cycle `next` on. Returns true if a pin
    /// changes.
    #[inline(never)]
    fn write_location(&mut self, place: BitAddress, bit: u8, next: u64) -> bool {
        match place.location() {
            reg @ (BitLocation::Cell(_) | BitLocation::Output(_)) => {
                self.channels.write(reg, bit, 1, next, &mut self.out);
            }
            reg => self.modules.write(reg, bit, 1, next, &mut self.out),
        }
        let changed = !self.out.is_empty();
        self.apply_signals(());
        changed
    }
}

/// A register is a [`BitAddress`], and its value is 0 or 1.
impl Bus for Ap101Soc {
    type Request = Infallible;

    #[inline(always)]
    fn read(&mut self, reg: u16, now: u64) -> RegisterRead {
        RegisterRead { value: self.read_location(BitAddress(reg), now), effect: BusEffect::NONE }
    }

    fn peek(&self, reg: u16, now: u64) -> u8 {
        self.read_location(BitAddress(reg), now)
    }

    #[inline(always)]
    fn write(&mut self, reg: u16, value: u8, now: u64) -> BusEffect {
        let changed = self.write_location(BitAddress(reg), value & 1, now.wrapping_add(1));
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
            FIRST_OUTPUT..POWER_PIN if self.channels.has_pin(pin) => {
                PinLevel::from_bit(self.channels.output(pin - FIRST_OUTPUT))
            }
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

    #[inline]
    fn event_log(&mut self) -> &mut EventLog {
        &mut self.log
    }
}
