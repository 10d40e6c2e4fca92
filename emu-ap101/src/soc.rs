//! What lies around the core: input latches, M, output channels, modules, and the pins of all that.

use emu_core::outside::{Drives, Log};
use emu_core::pins::{Event, Level, PinId, Time};
use emu_core::state::{Damaged, State, Tape};

use crate::chips::{CLEAR, FIRST_OUTPUT, PINS, POWER};
use crate::config::{Config, INPUTS, Inputs, MODULES, OUTPUTS};
use crate::modules::Module;
use crate::operands::{CELLS, IMAGE, M};

/// Clocks of a machine cycle.
pub(crate) const CLOCKS: u64 = 2;

/// The first bit of M that enables a program.
const ENABLES: u16 = M + 248;

/// Channels, memory and modules.
#[derive(Debug, Clone)]
pub(crate) struct Soc {
    /// Input latches, then M with the images of outputs. Where inputs are live, a latch is what stands on the pin.
    pub cells: [bool; CELLS],
    /// The bistables of the outputs.
    outputs: [bool; OUTPUTS as usize],
    /// Those that the running program cycle has written.
    written: [bool; OUTPUTS as usize],
    pub modules: Box<[Module; MODULES]>,
    /// What stands on the pins from outside.
    outside: Box<[Level; PINS]>,
    /// By clocks.
    drives: Drives,
    pub log: Log,
    input_channels: u16,
    output_channels: u16,
    live: bool,
    /// The first machine cycle of the running program cycle.
    begun: u64,
    /// An output has moved, or the program has changed a preset: what the state of the machine at a later moment need not show.
    pub moved: bool,
    /// Since the last boundary the supply was gone.
    dipped: bool,
    /// Since the last boundary a cold start was asked for.
    rose: bool,
}

impl State for Soc {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        #[rustfmt::skip]
        let Soc {
            log, input_channels: _, output_channels: _, live: _, cells, outputs, written, modules, outside, drives, begun, moved, dipped, rose,
        } = self;
        *begun = tape.now();
        cells.state(tape)?;
        outputs.state(tape)?;
        written.state(tape)?;
        tape.all(modules.as_mut_slice())?;
        tape.all(outside.as_mut_slice())?;
        drives.state(tape)?;
        moved.state(tape)?;
        dipped.state(tape)?;
        rose.state(tape)?;
        *log = Log::OFF;
        Ok(())
    }
}

/// What stands on a pin, as a bit: nothing reads 0.
const fn high(level: Level) -> bool {
    matches!(level, Level::High | Level::PullUp)
}

impl Soc {
    /// Without supply, all bits 0.
    pub(crate) fn new(config: &Config, inputs: Inputs, hz: u64) -> Soc {
        Soc {
            cells: [false; CELLS],
            outputs: [false; OUTPUTS as usize],
            written: [false; OUTPUTS as usize],
            modules: Box::new(config.modules.map(|settings| Module::new(settings, hz))),
            outside: Box::new([Level::Float; PINS]),
            drives: Drives::NONE,
            log: Log::OFF,
            input_channels: config.input_channels,
            output_channels: config.output_channels,
            live: inputs == Inputs::Live,
            begun: 0,
            moved: false,
            dipped: false,
            rose: false,
        }
    }

    /// The chip has this channel, or pin.
    pub(crate) fn has_pin(&self, pin: PinId) -> bool {
        match pin {
            0..INPUTS => pin < self.input_channels,
            FIRST_OUTPUT..POWER => pin - FIRST_OUTPUT < self.output_channels,
            _ => pin <= CLEAR,
        }
    }

    /// It has as many channels as there can be.
    pub(crate) fn has_all_channels(&self) -> bool {
        self.input_channels == INPUTS && self.output_channels == OUTPUTS
    }

    /// What stands on a pin.
    pub(crate) fn level(&self, pin: PinId) -> Level {
        match pin {
            FIRST_OUTPUT..POWER if self.has_pin(pin) => Level::of(self.output(pin - FIRST_OUTPUT)),
            FIRST_OUTPUT..POWER => Level::Float,
            _ => match self.outside.get(usize::from(pin)) {
                None | Some(Level::Float) => Level::Float,
                Some(&level) => Level::of(high(level)),
            },
        }
    }

    /// The outside will drive a pin at a clock.
    pub(crate) fn drive(&mut self, clock: u64, pin: PinId, level: Level) {
        self.drives.add(clock, (pin, level));
    }

    /// The clock of the next drive, [`NEVER`](emu_core::cpu::NEVER) where there is none.
    #[inline(always)]
    pub(crate) fn next(&self) -> u64 {
        self.drives.next()
    }

    /// Drives pins up to the clock `now`; true when there was something to drive. `supplied`: the machine has its supply.
    #[inline(always)]
    pub(crate) fn fire(&mut self, now: u64, supplied: bool) -> bool {
        self.drives.next() <= now && self.drive_up_to(now, supplied)
    }

    /// The same where there is something.
    #[cold]
    fn drive_up_to(&mut self, now: u64, supplied: bool) -> bool {
        let mut fired = false;
        while self.drives.next() <= now {
            let clock = self.drives.next();
            let Some((pin, level)) = self.drives.take(now) else { break };
            let at = Time { cycle: clock / CLOCKS, phase: (clock % CLOCKS) as u8 };
            self.put(at, pin, level, supplied);
            fired = true;
        }
        fired
    }

    /// A pin is driven.
    fn put(&mut self, at: Time, pin: PinId, level: Level, supplied: bool) {
        if (FIRST_OUTPUT..POWER).contains(&pin) {
            // A bistable is struck, its image not; what does not drive, or hits no supply, does nothing.
            if matches!(level, Level::Low | Level::High) && supplied && self.has_pin(pin) {
                self.set_output(pin - FIRST_OUTPUT, level == Level::High, at);
            }
            return;
        }
        let before = self.level(pin);
        let Some(outside) = self.outside.get_mut(usize::from(pin)) else { return };
        let was_high = high(*outside);
        *outside = level;
        let after = self.level(pin);
        if after != before {
            self.log.note(Event::Edge { at, pin, level: after });
        }
        match pin {
            POWER => self.dipped |= after == Level::Low,
            CLEAR => self.rose |= supplied && high(level) && !was_high,
            _ if self.live && pin < self.input_channels => self.set(pin, high(level)),
            _ => {}
        }
    }

    /// The supply is there.
    pub(crate) fn supplied(&self) -> bool {
        self.level(POWER) != Level::Low
    }

    /// CLEAR asks for a cold start.
    pub(crate) fn asks_to_clear(&self) -> bool {
        self.level(CLEAR) == Level::High
    }

    /// Since it was last asked: the supply was gone; a cold start was asked for.
    pub(crate) fn take_troubles(&mut self) -> (bool, bool) {
        (std::mem::take(&mut self.dipped), std::mem::take(&mut self.rose))
    }

    /// A bit of memory.
    #[inline(always)]
    pub(crate) const fn get(&self, cell: u16) -> bool {
        self.cells[cell as usize % CELLS]
    }

    /// Changes a bit of memory.
    #[inline(always)]
    pub(crate) const fn set(&mut self, cell: u16, bit: bool) {
        self.cells[cell as usize % CELLS] = bit;
    }

    /// The bistable of an output.
    pub(crate) const fn output(&self, n: u16) -> bool {
        self.outputs[n as usize % OUTPUTS as usize]
    }

    /// Changes the bistable of an output; true when it was the other way.
    #[inline(always)]
    pub(crate) fn set_output(&mut self, n: u16, bit: bool, at: Time) -> bool {
        let changed = std::mem::replace(&mut self.outputs[usize::from(n % OUTPUTS)], bit) != bit;
        if changed {
            self.moved = true;
            if self.log.is_on() {
                self.log.note(Event::Edge { at, pin: FIRST_OUTPUT + n % OUTPUTS, level: Level::of(bit) });
            }
        }
        changed
    }

    /// The program writes an output: bistable and image. It shows from the machine cycle `cycle` on.
    #[inline(always)]
    pub(crate) fn write_output(&mut self, n: u16, bit: bool, cycle: u64) -> bool {
        self.set(IMAGE + n, bit);
        self.written[usize::from(n % OUTPUTS)] = true;
        self.set_output(n, bit, Time::at(cycle))
    }

    /// A module.
    pub(crate) fn module(&self, n: u16) -> &Module {
        &self.modules[usize::from(n) % MODULES]
    }

    /// The same to change it.
    pub(crate) fn module_mut(&mut self, n: u16) -> &mut Module {
        &mut self.modules[usize::from(n) % MODULES]
    }

    /// The program gives a module a preset.
    pub(crate) fn set_preset(&mut self, n: u16, preset: u16) {
        self.moved |= self.module(n).preset() != preset;
        self.module_mut(n).set_preset(preset);
    }

    /// The modules that there are.
    pub(crate) fn fitted(&self) -> impl Iterator<Item = &Module> {
        self.modules.iter().filter(|module| module.exists())
    }

    /// The first machine cycle of the running program cycle.
    pub(crate) const fn begun(&self) -> u64 {
        self.begun
    }

    /// Inputs are read as they are now.
    pub(crate) const fn live(&self) -> bool {
        self.live
    }

    /// Output channels, and so the machine cycles of a reload.
    pub(crate) const fn channels(&self) -> u64 {
        self.output_channels as u64
    }

    /// A program cycle begins: inputs are latched, no output is written yet.
    pub(crate) fn begin(&mut self, cycle: u64) {
        self.begun = cycle;
        self.written = [false; OUTPUTS as usize];
        if !self.live {
            self.latch();
        }
    }

    /// Latches take what stands on the pins.
    fn latch(&mut self) {
        for (latch, &level) in self.cells.iter_mut().zip(self.outside.iter()).take(self.input_channels.into()) {
            *latch = high(level);
        }
    }

    /// Looks at the output channels that have their turn in the machine cycles `from` to `to` (excluded) of a reload that began at
    /// `first`: what was not written becomes what its image is, each at the end of its cycle.
    pub(crate) fn reload(&mut self, first: u64, from: u64, to: u64) {
        let channels = (from - first) as usize..(to - first).min(self.channels()) as usize;
        let images = usize::from(IMAGE)..usize::from(IMAGE + OUTPUTS);
        let (Some(outputs), Some(written), Some(images)) = (
            self.outputs.get(channels.clone()),
            self.written.get(channels.clone()),
            self.cells.get(images).and_then(|images| images.get(channels.clone())),
        ) else {
            return;
        };
        let stale = |((output, written), image): ((&bool, &bool), &bool)| !written & (output ^ image);
        if !outputs.iter().zip(written).zip(images).map(stale).fold(false, |any, stale| any | stale) {
            return;
        }
        for n in channels {
            let image = self.get(IMAGE + n as u16);
            if !self.written.get(n).copied().unwrap_or(true) {
                self.set_output(n as u16, image, Time::at(first + n as u64 + 1));
            }
        }
    }

    /// The bit of M that enables the program `entry` of the table.
    pub(crate) const fn enabled(&self, entry: u8) -> bool {
        self.get(ENABLES + entry as u16)
    }

    /// The supply goes at a machine cycle: what is not protected is 0.
    pub(crate) fn lose(&mut self, config: &Config, hz: u64, cycle: u64) {
        for n in 0..OUTPUTS {
            self.set_output(n, false, Time::at(cycle));
        }
        for (module, settings) in self.modules.iter_mut().zip(config.modules) {
            *module = Module::new(settings, hz);
        }
        self.written = [false; OUTPUTS as usize];
        if !self.live {
            self.cells[..usize::from(M)].fill(false);
        }
    }

    /// A cold start clears M, and enables programs where they can be.
    pub(crate) fn clear(&mut self, config: &Config) {
        self.cells[usize::from(M)..].fill(false);
        if config.reconfigurable {
            for (bit, &enabled) in (ENABLES..).zip(&config.enabled) {
                self.set(bit, enabled);
            }
        }
    }
}
