//! [`Avr`]: an AVR machine as one value.

use std::sync::Arc;

use emu_core::chip::Chip;
use emu_core::cpu::{Bus, Cpu, Probe, RamInit, ResetCause, rewrite_bit};
use emu_core::engine::{ReadyExecutor, RunState};
use emu_core::image::{AddressedByte, Image};
use emu_core::pins::PinId;
use emu_core::rng::Rng;

use crate::chips::{self, AvrPart};
use crate::executor::{CoreRegisters, DataMemory, Executor, MAX_RAM, RAM_START, SPH, SPL, SREG, ram};
use crate::flags::SregFlags;
use crate::lint::LintState;
use crate::periph::external;
use crate::periph::spm::ConfigBytes;
use crate::periph::timers::TimerShape;
use crate::predecode::CodeMemory;
use crate::soc::{AvrSoc, LOW_BYTES};

/// Configuration of a machine: clock, fuses, package, and the assumed behaviour of the silicon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Main clock before the division by CLKPR, in Hz.
    pub hz: u64,
    /// Fuse bytes (low, high, extended) that override those of the image.
    pub fuses: Option<[u8; 3]>,
    /// Lock bits that override those of the image.
    pub lock: Option<u8>,
    /// If true, every reset takes the start-up time that the fuses select; otherwise the program starts at
    /// once.
    pub start_up: bool,
    /// Behaviour where silicon and data sheet differ.
    pub readings: AvrReadings,
    /// Package, by its name in [`Chip::packages`]. None: the chip has the pins of all its packages.
    pub package: Option<&'static str>,
}

impl Options {
    /// Returns options with a main clock of `hz` Hz, fuses and lock bits of the image, no start-up time,
    /// default readings, and the pins of all packages.
    #[must_use]
    pub fn at_hz(hz: u64) -> Options {
        Options { hz, fuses: None, lock: None, start_up: false, readings: AvrReadings::default(), package: None }
    }
}

/// Behaviour of the silicon where it differs from the data sheet. The defaults are what several people have
/// measured on silicon; the exception is erased words, because a program that reaches one usually has a
/// fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AvrReadings {
    /// If true, an edge on INT wakes the core from sleep modes that stop the I/O clock. If false, only a
    /// level does, as the data sheet says (DS40002061, table 10-1, note 3). None: as in the chip's row.
    pub edges_wake: Option<bool>,
    /// If true, an erased word (FFFFh), which is not an instruction, does nothing for one cycle: several
    /// people have seen a chip run through erased flash into its boot loader. If false, it stops the run.
    pub erased_is_nop: bool,
    /// If true, ICR accepts a write only in modes that have it as TOP, as the data sheet says (16.11.7);
    /// otherwise in all modes.
    pub icr_only_as_top: bool,
}

impl AvrReadings {
    /// Returns these readings with the open ones taken from the row of `chip`. A chip of another family
    /// changes nothing.
    #[must_use]
    pub fn resolved(self, chip: &Chip) -> AvrReadings {
        let own = chips::part(chip.name).map(|part| part.external_kind.edges_wake);
        AvrReadings { edges_wake: self.edges_wake.or(own), ..self }
    }

    /// Returns the shape of a timer under these readings; a timer that the chip does not have gets no
    /// channels.
    pub(crate) fn apply_to_timer(self, shape: Option<&TimerShape>) -> TimerShape {
        let shape = shape.copied().unwrap_or(TimerShape::narrow(0));
        TimerShape { icr_only_as_top: self.icr_only_as_top, ..shape }
    }

    /// Returns the variant of the external interrupts under these readings.
    pub(crate) fn apply_to_external(self, mut kind: external::ExternalKind) -> external::ExternalKind {
        kind.edges_wake = self.edges_wake.unwrap_or(kind.edges_wake);
        kind
    }
}

/// An AVR chip with its program. A clone is a snapshot; clones share program memory until it changes.
#[derive(Debug, Clone)]
pub struct Avr {
    /// The row of the chip.
    pub(crate) part: &'static AvrPart,
    /// Program counter, flags and clock of the core.
    pub(crate) core: CoreRegisters,
    /// Data memory; the core's registers are its first 32 bytes.
    pub(crate) data: DataMemory,
    /// Program memory with its predecoded form; copied on write.
    pub(crate) code: Arc<CodeMemory>,
    /// The chip around the core.
    pub(crate) soc: AvrSoc,
    /// What the run loop remembers between bursts.
    pub(crate) run_state: RunState,
}

impl Avr {
    /// Creates a chip after power-up with flash, EEPROM, fuses and RAM of `image`, at its default clock.
    /// Memory that the image does not fill is erased (FFh); RAM and the core's registers are filled according
    /// to `init`. A chip of another family becomes an ATmega328P. Start-up takes no time unless the image has
    /// fuses.
    #[must_use]
    pub fn new(chip: &'static Chip, image: &Image, init: RamInit) -> Avr {
        let start_up = image.bytes_in("fuse").next().is_some();
        Avr::with(chip, image, init, Options { start_up, ..Options::at_hz(chip.default_hz) })
    }

    /// Creates a chip as [`Avr::new`] does, but with the given options.
    #[must_use]
    pub fn with(chip: &'static Chip, image: &Image, init: RamInit, options: Options) -> Avr {
        let part = chips::part(chip.name).unwrap_or(&chips::PART_328P);
        let chip = part.chip;
        let mut flash = vec![0xFF; chip.flash_bytes as usize];
        image.fill("flash", &mut flash);
        let mut eeprom = vec![0xFF; usize::from(chip.eeprom_bytes)];
        image.fill("eeprom", &mut eeprom);
        let mut bytes = [0; RAM_START + MAX_RAM];
        if let RamInit::Random(seed) = init {
            let mut rng = Rng::new(seed);
            rng.fill(&mut bytes[..32]);
            rng.fill(&mut bytes[usize::from(chip.ram_start)..usize::from(chip.ram_start + chip.ram_len)]);
        }
        for AddressedByte { addr, byte } in image.bytes_in("data") {
            // The peripherals initialize the chip's registers, so image bytes there are ignored.
            let i = addr as usize;
            if i < 32 || (usize::from(chip.ram_start)..usize::from(chip.ram_start + chip.ram_len)).contains(&i) {
                bytes[i] = byte;
            }
        }
        let mut fuses = part.fuses.default_bytes;
        image.fill("fuse", &mut fuses);
        let mut lock = [0xFF];
        image.fill("lock", &mut lock);
        let beside = ConfigBytes {
            lock: options.lock.unwrap_or(lock[0]),
            fuses: options.fuses.unwrap_or(fuses),
            signature: part.signature,
            calibration: CALIBRATION,
        };
        let mut soc = AvrSoc::new(part, options, beside, Arc::new(eeprom));
        // The chip around the core holds the RAM below 100h.
        soc.fill_low(&bytes[LOW_BYTES..RAM_START]);
        soc.lints = LintState::for_program(image, part);
        bytes[32..RAM_START].fill(0);
        let mut avr = Avr {
            part,
            core: CoreRegisters::START,
            data: DataMemory { bytes, ram_len: chip.ram_start + chip.ram_len - RAM_START as u16 },
            code: Arc::new(CodeMemory::new(flash, part, options.readings.erased_is_nop)),
            soc,
            run_state: RunState::START,
        };
        avr.restart_core();
        avr
    }

    /// Sets the core to its state after a reset.
    fn restart_core(&mut self) {
        let sp =
            if self.part.stack_starts_at_ram_end { self.part.chip.ram_start + self.part.chip.ram_len - 1 } else { 0 };
        self.core = CoreRegisters { sp, pc: self.soc.reset_vector(), clock: self.core.clock, ..CoreRegisters::START };
        self.run_state.breakpoint_to_pass = None;
        self.core.clock.expire();
    }

    /// Sets the clock before the division by CLKPR, in Hz. The times of other oscillators are converted with
    /// it.
    pub fn set_clock_hz(&mut self, hz: u64) {
        let now = self.cycle();
        self.soc.set_clock_hz(hz, now);
        self.core.clock.expire();
    }

    /// Returns the chip around the core.
    #[must_use]
    pub fn soc(&self) -> &AvrSoc {
        &self.soc
    }

    /// Returns the vector number of the interrupt that would be taken at the next instruction boundary.
    #[must_use]
    pub fn pending_interrupt(&self) -> Option<u8> {
        self.soc.pending_interrupt(self.cycle())
    }

    /// Returns an executor for a burst or a single instruction, and the code memory.
    pub(crate) fn executor<'a, P: Probe>(
        &'a mut self,
        probe: &'a mut P,
    ) -> ReadyExecutor<Executor<'a, P>, &'a CodeMemory> {
        let code: &CodeMemory = &self.code;
        let executor = Executor { core: self.core, data: &mut self.data, code, bus: &mut self.soc, probe };
        ReadyExecutor { executor, code }
    }
}

emu_core::cpu_parts!(Avr, AvrSoc);

impl Cpu for Avr {
    emu_core::run_by_engine!();

    fn chip(&self) -> &'static Chip {
        self.part.chip
    }

    fn clocks_per_cycle(&self) -> u32 {
        1
    }

    fn has_pin(&self, pin: PinId) -> bool {
        self.soc.has_pin(pin)
    }

    fn reset(&mut self, why: ResetCause) {
        self.core.clock.expire();
        let now = self.core.clock.now();
        self.soc.reset(why, now);
        self.restart_core();
    }

    fn pc(&self) -> u32 {
        self.core.pc & self.code.mask()
    }

    fn set_pc(&mut self, pc: u32) {
        self.core.pc = pc & self.code.mask();
        self.run_state.breakpoint_to_pass = None;
        self.core.clock.expire();
    }

    fn reg(&self, name: &str) -> Option<u32> {
        Some(match register_by_name(name)? {
            CoreRegister::General(n) => u32::from(self.data.bytes[n]),
            CoreRegister::Sreg => u32::from(self.core.flags.pack()),
            CoreRegister::Sp => u32::from(self.core.sp),
            CoreRegister::Pc => self.pc(),
        })
    }

    fn read_regs(&self, into: &mut Vec<u32>) {
        into.clear();
        into.extend(self.data.bytes.iter().take(32).map(|byte| u32::from(*byte)));
        into.extend([u32::from(self.core.flags.pack()), u32::from(self.core.sp), self.pc()]);
    }

    fn stack_depth(&self) -> u32 {
        u16::MAX.wrapping_sub(self.core.sp).into()
    }

    fn set_reg(&mut self, name: &str, value: u32) -> bool {
        match register_by_name(name) {
            Some(CoreRegister::General(n)) => self.data.bytes[n] = value as u8,
            Some(CoreRegister::Sreg) => self.core.flags = SregFlags::unpack(value as u8),
            Some(CoreRegister::Sp) => self.core.sp = value as u16,
            Some(CoreRegister::Pc) => self.set_pc(value),
            None => return false,
        }
        self.core.clock.expire();
        true
    }

    fn peek(&self, space: &str, addr: u32) -> Option<u8> {
        let index = addr as usize;
        match space {
            "data" => Some(match u16::try_from(addr).ok()? {
                SPL => self.core.sp as u8,
                SPH => (self.core.sp >> 8) as u8,
                SREG => self.core.flags.pack(),
                addr if (0x20..RAM_START as u16).contains(&addr) => self.soc.peek(addr, self.cycle()),
                _ => self.data.bytes[self::index(self.part.chip, addr)?],
            }),
            "flash" => self.code.bytes.get(index).copied(),
            "eeprom" => self.soc.eeprom().get(index).copied(),
            "fuse" => self.soc.config_bytes().fuses.get(index).copied(),
            "lock" if index == 0 => Some(self.soc.config_bytes().lock),
            _ => None,
        }
    }

    fn poke(&mut self, space: &str, addr: u32, value: u8) -> bool {
        let index = addr as usize;
        match space {
            "data" => match u16::try_from(addr).unwrap_or(u16::MAX) {
                SPL => self.core.sp = self.core.sp & 0xFF00 | u16::from(value),
                SPH => self.core.sp = self.core.sp & 0x00FF | u16::from(value) << 8,
                SREG => self.core.flags = SregFlags::unpack(value),
                addr if (0x20..RAM_START as u16).contains(&addr) => {
                    let now = self.cycle();
                    self.soc.write(addr, value, now);
                }
                addr => match self::index(self.part.chip, addr.into()) {
                    Some(i) => self.data.bytes[i] = value,
                    None => return false,
                },
            },
            "flash" if index < self.code.bytes.len() => Arc::make_mut(&mut self.code).poke(index, value),
            "eeprom" if self.soc.set_eeprom(index, value) => {}
            _ => return false,
        }
        self.core.clock.expire();
        true
    }

    fn poke_bit(&mut self, space: &str, addr: u32, bit: u8, value: bool) -> bool {
        let io = (0x20..self.part.chip.ram_start.into()).contains(&addr) && !(SPL.into()..=SREG.into()).contains(&addr);
        if space != "data" || !io || self.part.bit_writes_whole_register {
            return rewrite_bit(self, space, addr, bit, value);
        }
        let (now, mask) = (self.cycle(), 1 << (bit & 7));
        self.soc.write_bits(addr as u16, mask, if value { mask } else { 0 }, now);
        self.core.clock.expire();
        true
    }

    fn set_breakpoint(&mut self, pc: u32, on: bool) {
        let pc = pc & self.code.mask();
        if self.code.has_breakpoint(pc) != on && Arc::make_mut(&mut self.code).set_breakpoint(pc, on) {
            self.run_state.breakpoint_to_pass = self.run_state.breakpoint_to_pass.filter(|&p| on || p != pc);
        }
    }
}

/// Calibration byte of the internal oscillator. The real value differs from chip to chip.
const CALIBRATION: u8 = 0x80;

/// Returns the index in [`DataMemory`] of the register or RAM byte at a data address.
fn index(chip: &Chip, addr: u32) -> Option<usize> {
    if addr < 32 {
        return Some(addr as usize);
    }
    let end = u32::from(chip.ram_start) + u32::from(chip.ram_len);
    (RAM_START as u32..end).contains(&addr).then(|| ram((addr - RAM_START as u32) as u16))
}

/// A register that can be named on the command line or by a debugger.
enum CoreRegister {
    General(usize),
    Sreg,
    Sp,
    Pc,
}

/// Looks up a register by its name, in upper or lower case.
fn register_by_name(name: &str) -> Option<CoreRegister> {
    match name.to_ascii_lowercase().as_str() {
        "sreg" => Some(CoreRegister::Sreg),
        "sp" => Some(CoreRegister::Sp),
        "pc" => Some(CoreRegister::Pc),
        other => {
            let number = (0..32).find(|n| other.strip_prefix('r').is_some_and(|digits| digits == n.to_string()))?;
            Some(CoreRegister::General(number))
        }
    }
}
