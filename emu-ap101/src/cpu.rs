//! The machine as a value: [`Ap101`].

use std::sync::Arc;

use emu_core::chip::Chip;
use emu_core::cpu::{Bus, Cpu, Probe, ResetCause, StopReason, Subcycle};
use emu_core::engine::RunState;
use emu_core::external_io::OutsideInput;
use emu_core::image::Image;
use emu_core::pins::{CycleTime, PinId, PinLevel};

use crate::chips::{AP101, POWER_PIN};
use crate::config::{Ap101Config, InputSampling, MODULES, OUTPUTS, ProgramEntry};
use crate::executor::CoreRegisters;
use crate::isa::{NOP, SPAN};
use crate::operands::M_START;
use crate::predecode::{AddressMap, CodeMemory};
use crate::program_cycle::ProgramPhase;
use crate::repetition::RepetitionDetector;
use crate::soc::{Ap101Soc, CLOCKS};

/// Options that override the configuration of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options {
    /// Clock in Hz.
    pub hz: Option<u64>,
    /// When inputs are sampled.
    pub inputs: Option<InputSampling>,
}

/// An AP101 with its program. A clone is a snapshot; program memory is shared until it changes.
#[derive(Debug, Clone)]
pub struct Ap101 {
    /// The configuration block of the image.
    pub(crate) config: Arc<Ap101Config>,
    /// The clock in hertz.
    pub(crate) hz: u64,
    /// The result register, and what else the core holds.
    pub(crate) core: CoreRegisters,
    /// The program.
    pub(crate) code: Arc<CodeMemory>,
    /// The channels, modules and cells around the core.
    pub(crate) soc: Ap101Soc,
    /// Where in its cycle of program and input reading the controller is.
    pub(crate) phase: ProgramPhase,
    /// The instruction fetched last.
    pub(crate) ric: u16,
    /// If an instruction was fetched and not executed yet: the value of RIC before the fetch.
    pub(crate) fetched_word: Option<u16>,
    /// The program that runs, or would run, by its index among those that are present.
    pub(crate) program_index: usize,
    /// The program that ran last, after which the search for the next one starts.
    pub(crate) running_program: Option<usize>,
    /// Number of program cycles that took longer than the period.
    pub(crate) overruns: u16,
    /// What the run loop remembers between bursts.
    pub(crate) run_state: RunState,
    /// Detects that the state repeats, so that whole cycles can be skipped.
    pub(crate) repetition: RepetitionDetector,
}

impl Ap101 {
    /// A machine at its first cold start with the program of `image`, configured as in the image. A damaged
    /// configuration block, which [`Ap101Config::read_config`] reports, is ignored.
    #[must_use]
    pub fn new(image: &Image) -> Ap101 {
        Ap101::with(image, Options::default())
    }

    /// As [`Ap101::new`], with options that override the image.
    #[must_use]
    pub fn with(image: &Image, options: Options) -> Ap101 {
        let config = Ap101Config::read_config(image).unwrap_or_default();
        let (hz, inputs) = (options.hz.unwrap_or(config.hz).max(1), options.inputs.unwrap_or(config.inputs));
        let mut bytes = vec![0xFF; 2 * SPAN];
        image.fill("code", &mut bytes);
        let mut words = Box::new([NOP; SPAN]);
        for (word, pair) in words.iter_mut().zip(bytes.chunks_exact(2)) {
            *word = u16::from_le_bytes([pair[0], pair[1]]);
        }
        let last = (image.end("code") / 2).checked_sub(1).map(|last| last.min(SPAN as u32 - 1) as u16);
        let whole_memory = last.map(|last| ProgramEntry { entry: 0, start: 0, last, rx: 0 });
        let programs =
            if config.programs.is_empty() { whole_memory.into_iter().collect() } else { config.programs.clone() };
        let soc = Ap101Soc::new(&config, inputs, hz);
        let mut machine = Ap101 {
            code: Arc::new(CodeMemory::new(words, &programs, AddressMap::new(&config, inputs))),
            config: Arc::new(config),
            hz,
            core: CoreRegisters::START,
            soc,
            phase: ProgramPhase::NoSupply,
            ric: 0,
            fetched_word: None,
            program_index: 0,
            running_program: None,
            overruns: 0,
            run_state: RunState::START,
            repetition: RepetitionDetector::START,
        };
        machine.start(true);
        machine
    }

    /// The configuration of the machine.
    #[must_use]
    pub fn config(&self) -> &Ap101Config {
        &self.config
    }

    /// Clock in Hz.
    #[must_use]
    pub const fn hz(&self) -> u64 {
        self.hz
    }

    /// Whether no instruction is next: outputs are reloaded, a period is not over, no program is enabled, or
    /// there is no supply.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        !matches!(self.phase, ProgramPhase::Run { .. }) || self.is_at_program_end()
    }

    /// Whether an instruction was fetched into RIC and not executed yet.
    #[must_use]
    pub const fn has_fetched(&self) -> bool {
        self.fetched_word.is_some()
    }

    /// Runs the next subcycle, or a machine cycle without subcycles. The stop reasons are those of
    /// [`Cpu::step`].
    pub fn step_subcycle<P: Probe>(&mut self, probe: &mut P) -> StopReason {
        struct StopAtSubcycle;
        impl Probe for StopAtSubcycle {
            const SUBCYCLE: bool = true;
            fn on_subcycle(&mut self, _: CycleTime, _: Subcycle, _: u32, _: u16) -> bool {
                true
            }
        }
        self.run_to::<_, false>(self.core.clock.now() + 1, &mut (probe, StopAtSubcycle))
    }

    /// The program that runs, or would run.
    fn program(&self) -> Option<ProgramEntry> {
        self.code.programs.get(self.program_index).map(|ops| ops.program)
    }
}

emu_core::cpu_parts!(Ap101, Ap101Soc);

impl Cpu for Ap101 {
    fn chip(&self) -> &'static Chip {
        &AP101
    }

    fn clocks_per_cycle(&self) -> u32 {
        CLOCKS as u32
    }

    /// Without supply there is nothing to start.
    fn reset(&mut self, why: ResetCause) {
        if self.phase != ProgramPhase::NoSupply {
            self.core.clock.expire();
            self.start(why == ResetCause::PowerOn);
        }
    }

    fn pc(&self) -> u32 {
        self.core.next_address % SPAN as u32
    }

    fn set_pc(&mut self, pc: u32) {
        self.core.next_address = pc % SPAN as u32;
        (self.fetched_word, self.run_state.breakpoint_to_pass) = (None, None);
        self.core.clock.expire();
        self.forget_repetition();
    }

    fn reg(&self, name: &str) -> Option<u32> {
        Some(match name.to_ascii_uppercase().as_str() {
            "A" => self.core.a.into(),
            "NA" => self.pc(),
            "RIC" => self.ric.into(),
            "RX" => self.program().map_or(0, |program| program.rx.into()),
            "PROG" => self.program().map_or(0, |program| program.entry.into()),
            "OVR" => self.overruns.into(),
            _ => return None,
        })
    }

    fn set_reg(&mut self, name: &str, value: u32) -> bool {
        match name.to_ascii_uppercase().as_str() {
            "A" => self.core.a = value & 1 != 0,
            "NA" => self.set_pc(value),
            "RIC" => self.ric = value as u16,
            "OVR" => self.overruns = value as u16,
            // Only the program table sets them.
            _ => return false,
        }
        self.forget_repetition();
        true
    }

    fn peek(&self, space: &str, addr: u32) -> Option<u8> {
        let (n, now) = (addr as u16, self.cycle());
        let byte = |word: u16| word.to_le_bytes().get(addr as usize % 2).copied();
        let module = |n: u32| (n < MODULES as u32).then(|| self.soc.modules.module(n as u16));
        match space {
            "code" if addr < 2 * SPAN as u32 => byte(self.code.word(addr / 2)),
            "i" if addr < u32::from(M_START) => Some(self.soc.channels.get(n).into()),
            "e" if addr < u32::from(OUTPUTS) => Some(self.soc.channels.output(n).into()),
            "m" if addr < 512 => Some(self.soc.channels.get(M_START + n).into()),
            "r" if addr < 384 => Some(match (module(addr % MODULES as u32)?, addr / MODULES as u32) {
                (module, 0) => module.q(now).into(),
                (module, 1) => module.is_running(now).into(),
                _ => 0,
            }),
            "preset" => byte(module(addr / 2)?.preset()),
            "value" => byte(module(addr / 2)?.value(now)),
            _ => None,
        }
    }

    /// Writes a latch, a bistable, a bit of M, a preset, a count or a word. Times that modules have measured
    /// in milliseconds cannot be written, nor can live inputs.
    fn poke(&mut self, space: &str, addr: u32, value: u8) -> bool {
        let (n, bit, now) = (addr as u16, value & 1 != 0, self.cycle());
        match space {
            "code" if addr < 2 * SPAN as u32 => {
                let mut bytes = self.code.word(addr / 2).to_le_bytes();
                bytes[addr as usize % 2] = value;
                Arc::make_mut(&mut self.code).poke(addr / 2, u16::from_le_bytes(bytes));
            }
            "i" if addr < u32::from(M_START) && !self.soc.channels.reads_inputs_live() => self.soc.channels.set(n, bit),
            "e" if addr < u32::from(OUTPUTS) => self.soc.set_output(n, bit, CycleTime::at(now)),
            "m" if addr < 512 => self.soc.channels.set(M_START + n, bit),
            "preset" if addr < 2 * MODULES as u32 => {
                let module = self.soc.modules.module_mut(n / 2);
                let mut bytes = module.preset().to_le_bytes();
                bytes[addr as usize % 2] = value;
                module.set_preset(u16::from_le_bytes(bytes));
            }
            "value" if addr < 2 * MODULES as u32 => {
                let module = self.soc.modules.module_mut(n / 2);
                let mut bytes = module.value(now).to_le_bytes();
                bytes[addr as usize % 2] = value;
                if !module.exists() || !module.poke(i16::from_le_bytes(bytes)) {
                    return false;
                }
            }
            _ => return false,
        }
        self.forget_repetition();
        true
    }

    fn set_breakpoint(&mut self, pc: u32, on: bool) {
        let pc = pc % SPAN as u32;
        if self.code.has_breakpoint(pc) != on {
            Arc::make_mut(&mut self.code).set_breakpoint(pc, on);
            self.run_state.breakpoint_to_pass = self.run_state.breakpoint_to_pass.filter(|&p| on || p != pc);
        }
    }

    fn has_pin(&self, pin: PinId) -> bool {
        self.soc.channels.has_pin(pin)
    }

    fn pins_to_show(&self) -> Vec<PinId> {
        let all = 0..self.chip().pins.len() as PinId;
        if !self.soc.channels.has_all_channels() {
            return all.filter(|pin| self.has_pin(*pin)).collect();
        }
        let named = self.code.channels();
        all.filter(|pin| *pin >= POWER_PIN && self.has_pin(*pin) || named.contains(pin)).collect()
    }

    fn drive(&mut self, at: CycleTime, pin: PinId, level: PinLevel) {
        let now = self.cycle();
        let earliest = CycleTime { cycle: now, phase: self.fetched_word.is_some().into() };
        self.soc.queue_input(at.max(earliest), now, OutsideInput::Level(pin, level));
    }

    /// M is 0 after a cold start, so no bit of it is ever unknown.
    fn canonical_ram_address(&self, _: u32) -> Option<u32> {
        None
    }

    fn run<P: Probe>(&mut self, until: u64, probe: &mut P) -> StopReason {
        self.run_to::<P, true>(until, probe)
    }

    /// Continues even if nothing changes any more, where [`Cpu::run`] halts.
    fn step_until<P: Probe>(&mut self, until: u64, probe: &mut P) -> StopReason {
        let now = self.cycle();
        // If no instruction is next, the step ends where one is next, or at what is due before.
        let next = match self.phase {
            _ if self.fetched_word.is_some() => now,
            ProgramPhase::Reload { from, .. } => from + self.soc.channels.output_channel_count(),
            ProgramPhase::Ready { at } => at,
            ProgramPhase::NoSupply | ProgramPhase::Run { .. } => now,
        };
        let due = self.soc.next().div_ceil(CLOCKS);
        self.run_to::<P, false>(next.min(due).min(until).max(now + 1), probe)
    }
}
