//! [`Pic16`]: a PIC16 machine as one value.

mod cpu_engine;

use std::sync::Arc;

use emu_core::chip::Chip;
use emu_core::cpu::{Bus, Cpu, Probe, RamInit, ResetCause};
use emu_core::engine::{ReadyExecutor, RunState};
use emu_core::image::Image;

use crate::chips::{self, Pic16Part};
use crate::core_state::{BANK, CoreRegisters, PD, TO};
use crate::executor::{DATA_ADDRESSES, Executor, OPS};
use crate::isa::SPAN;
use crate::lint::LintState;
use crate::operands::FileAddress;
use crate::options::power_up_ram;
pub use crate::options::{Options, Pic16Readings, TimingCorner};
use crate::periph::map::Sfr;
use crate::predecode::CodeMemory;
use crate::soc::Pic16Soc;

/// A mid-range PIC16 with its program. A clone is a snapshot; clones share program memory until it changes.
#[derive(Debug, Clone)]
pub struct Pic16 {
    /// The row of the chip.
    pub(crate) part: &'static Pic16Part,
    /// Registers and clock of the core.
    pub(crate) core: CoreRegisters,
    /// Data memory, by file address with all banks.
    pub(crate) ram: [u8; DATA_ADDRESSES],
    /// The return addresses.
    pub(crate) stack: [u16; 8],
    /// Program memory with its predecoded form; copied on write.
    pub(crate) code: Arc<CodeMemory>,
    /// The chip around the core.
    pub(crate) soc: Pic16Soc,
    /// What the run loop remembers between bursts.
    pub(crate) run_state: RunState,
    /// What lints need to know about the run so far.
    pub(crate) lints: LintState,
    /// Content of RAM after power-up.
    init: RamInit,
}

/// The hardware stack.
#[derive(Debug, Clone, Copy)]
pub struct Pic16Stack<'a> {
    /// The return addresses.
    pub entries: &'a [u16; 8],
    /// The index that the next push uses, 0 to 7.
    pub next: usize,
}

impl Pic16 {
    /// Creates a chip after power-up with the program of `image` and default options. Memory that the image
    /// does not fill is erased; RAM is filled according to `ram`. A chip of another family becomes a
    /// PIC16F873.
    #[must_use]
    pub fn new(chip: &'static Chip, image: &Image, ram: RamInit) -> Pic16 {
        Pic16::with(chip, image, ram, Options::default())
    }

    /// Creates a chip as [`Pic16::new`] does, but with the given options.
    #[must_use]
    pub fn with(chip: &'static Chip, image: &Image, init: RamInit, options: Options) -> Pic16 {
        let part = chips::part(chip.name).unwrap_or(&chips::PIC16F873);
        let ram = power_up_ram(init, 0);
        let cells = |space: &str, count: u32| -> Vec<u16> {
            let mut bytes = vec![0xFF; 2 * count as usize];
            image.fill(space, &mut bytes);
            bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect()
        };
        let eeprom: Vec<u8> = cells("eeprom", part.chip.eeprom_bytes.into()).iter().map(|&cell| cell as u8).collect();
        let mut file_addresses = Box::new([FileAddress::NONE; DATA_ADDRESSES]);
        for (file_address, slot) in file_addresses.iter_mut().zip(part.file_slots()) {
            *file_address = match slot {
                chips::FileSlot::Ram(canonical) => FileAddress(canonical % DATA_ADDRESSES as u16),
                chips::FileSlot::Sfr(sfr) => FileAddress::sfr(sfr),
                chips::FileSlot::None => FileAddress::NONE,
            };
        }
        let words = part.chip.flash_bytes / 2;
        let mut pic = Pic16 {
            part,
            core: CoreRegisters::START,
            ram,
            stack: [0; 8],
            code: Arc::new(CodeMemory::new(&cells("flash", words), words, file_addresses)),
            soc: Pic16Soc::new(part, options, &cells("config", 16), &eeprom),
            run_state: RunState::START,
            lints: LintState::default(),
            init,
        };
        pic.core.clock.expire();
        pic
    }

    /// Returns the chip around the core.
    #[must_use]
    pub fn soc(&self) -> &Pic16Soc {
        &self.soc
    }

    /// Returns the eight stack entries, and the index that the next push uses.
    #[must_use]
    pub fn stack(&self) -> Pic16Stack<'_> {
        Pic16Stack { entries: &self.stack, next: self.core.sp as usize % 8 }
    }

    /// Returns an executor for a burst or a single instruction, and the code memory.
    fn executor<'a, P: Probe>(&'a mut self, probe: &'a mut P) -> ReadyExecutor<Executor<'a, P>, &'a CodeMemory> {
        let code: &CodeMemory = &self.code;
        let executor = Executor {
            core: self.core,
            ram: &mut self.ram,
            stack: &mut self.stack,
            file_addresses: &code.file_addresses,
            lowest_addresses: &code.lowest_addresses,
            lints: &mut self.lints,
            words: &code.words,
            bus: &mut self.soc,
            probe,
        };
        ReadyExecutor { executor, code }
    }

    fn set_fsr(&mut self, value: u32) {
        self.core.indirect_address = self.core.indirect_address & 0x100 | value;
    }

    fn op_index(&self, pc: u32) -> usize {
        (self.core.bank_and_pc & BANK | pc) as usize % OPS
    }

    /// Reads a resolved file address without side effects.
    fn peek_address(&self, file_address: FileAddress) -> u8 {
        match as_core_register(file_address) {
            Some(Sfr::STATUS) => self.core.status(),
            Some(Sfr::FSR) => self.core.indirect_address as u8,
            Some(Sfr::PCL) => self.core.bank_and_pc as u8,
            Some(Sfr::PCLATH) => self.core.pclath as u8,
            Some(_) => 0,
            None if file_address.0 < DATA_ADDRESSES as u16 => self.ram[usize::from(file_address.0)],
            None => self.soc.peek(file_address.0 - DATA_ADDRESSES as u16, self.cycle()),
        }
    }

    fn poke_address(&mut self, file_address: FileAddress, value: u8) {
        match as_core_register(file_address) {
            Some(Sfr::STATUS) => {
                self.core.set_status(value.into());
                self.core.timeout_bits = u32::from(value) & (TO | PD);
            }
            Some(Sfr::FSR) => self.set_fsr(value.into()),
            Some(Sfr::PCL) => self.set_pc(self.core.pclath << 8 | u32::from(value)),
            Some(Sfr::PCLATH) => self.core.pclath = u32::from(value) & 0x1F,
            Some(_) => {}
            None if file_address.0 < DATA_ADDRESSES as u16 => self.ram[usize::from(file_address.0)] = value,
            None => {
                let now = self.cycle();
                self.soc.poke(file_address.0 - DATA_ADDRESSES as u16, value, now);
            }
        }
    }

    /// Resolves an address of data memory; INDF resolves to the address in FSR.
    fn file_address(&self, addr: u16) -> FileAddress {
        match self.code.file_addresses[usize::from(addr) % DATA_ADDRESSES] {
            file_address if file_address == FileAddress::sfr(Sfr::INDF) => {
                self.code.file_addresses[self.core.indirect_address as usize % DATA_ADDRESSES]
            }
            file_address => file_address,
        }
    }
}

/// Returns the core register at a file address, if there is one.
fn as_core_register(file_address: FileAddress) -> Option<Sfr> {
    const CORE: [Sfr; 5] = [Sfr::INDF, Sfr::PCL, Sfr::STATUS, Sfr::FSR, Sfr::PCLATH];
    let unimplemented = (file_address == FileAddress::NONE).then_some(Sfr::INDF);
    CORE.into_iter().find(|&sfr| file_address == FileAddress::sfr(sfr)).or(unimplemented)
}

emu_core::cpu_parts!(Pic16, Pic16Soc);

impl Cpu for Pic16 {
    emu_core::run_by_engine!();

    fn chip(&self) -> &'static Chip {
        &self.part.chip
    }

    fn clocks_per_cycle(&self) -> u32 {
        4
    }

    fn reset(&mut self, why: ResetCause) {
        self.core.clock.expire();
        let now = self.core.clock.now();
        let (before, asleep) = (self.core, self.soc.in_standby());
        // DS30292, tables 12-3 and 12-6: what a reset leaves unchanged, and TO and PD by its cause.
        let to_pd = match (why, asleep) {
            (ResetCause::PowerOn | ResetCause::BrownOut, _) => TO | PD,
            (ResetCause::External, false) => before.timeout_bits,
            (ResetCause::External, true) => TO,
            (ResetCause::Watchdog, _) => PD,
        };
        self.core = CoreRegisters {
            clock: before.clock,
            w: before.w,
            z: before.z,
            dc: before.dc,
            c: before.c,
            indirect_address: before.indirect_address & 0xFF,
            timeout_bits: to_pd,
            ..CoreRegisters::START
        };
        self.run_state.breakpoint_to_pass = None;
        self.lints = LintState::default();
        if why == ResetCause::PowerOn {
            self.ram = power_up_ram(self.init, now);
        }
        self.soc.reset(why, now);
    }

    fn pc(&self) -> u32 {
        self.core.pc()
    }

    fn set_pc(&mut self, pc: u32) {
        self.core.set_pc(pc);
        self.run_state.breakpoint_to_pass = None;
        self.core.clock.expire();
    }

    fn reg(&self, name: &str) -> Option<u32> {
        Some(match name.to_ascii_uppercase().as_str() {
            "W" => self.core.w,
            "STATUS" => self.core.status().into(),
            "FSR" => self.core.indirect_address & 0xFF,
            "PCLATH" => self.core.pclath,
            "PC" => self.pc(),
            _ => return None,
        })
    }

    fn read_regs(&self, into: &mut Vec<u32>) {
        into.clear();
        let status = self.core.status().into();
        into.extend([self.core.w, status, self.core.indirect_address & 0xFF, self.core.pclath, self.pc()]);
    }

    fn return_stack(&self) -> Vec<u32> {
        (1..=8).map(|back| self.stack[(self.core.sp as usize + 8 - back) % 8].into()).collect()
    }

    fn stack_depth(&self) -> u32 {
        self.core.sp % 8
    }

    fn interrupt_flags(&self) -> Vec<&'static str> {
        self.soc.requesting_flags(self.cycle())
    }

    fn set_reg(&mut self, name: &str, value: u32) -> bool {
        match name.to_ascii_uppercase().as_str() {
            "W" => self.core.w = value & 0xFF,
            "STATUS" => self.poke_address(FileAddress::sfr(Sfr::STATUS), value as u8),
            "FSR" => self.set_fsr(value & 0xFF),
            "PCLATH" => self.core.pclath = value & 0x1F,
            "PC" => self.set_pc(value),
            _ => return false,
        }
        self.core.clock.expire();
        true
    }

    fn peek(&self, space: &str, addr: u32) -> Option<u8> {
        let index = addr as usize;
        match space {
            "data" if index < DATA_ADDRESSES => Some(self.peek_address(self.file_address(addr as u16))),
            "flash" if addr < self.part.chip.flash_bytes => Some(self.code.words[index / 2].to_le_bytes()[index % 2]),
            "eeprom" => self.soc.eeprom().get(index).copied(),
            "config" if index < 32 => Some(self.soc.config(index / 2).to_le_bytes()[index % 2]),
            _ => None,
        }
    }

    fn poke(&mut self, space: &str, addr: u32, value: u8) -> bool {
        let index = addr as usize;
        match space {
            "data" if index < DATA_ADDRESSES => self.poke_address(self.file_address(addr as u16), value),
            "flash" if addr < self.part.chip.flash_bytes => {
                let mut bytes = self.code.words[index / 2].to_le_bytes();
                bytes[index % 2] = value;
                Arc::make_mut(&mut self.code).poke(addr / 2, u16::from_le_bytes(bytes));
            }
            "eeprom" if index < self.soc.eeprom().len() => self.soc.set_eeprom(index, value),
            _ => return false,
        }
        self.core.clock.expire();
        true
    }

    fn set_breakpoint(&mut self, pc: u32, on: bool) {
        let pc = pc % SPAN as u32;
        if self.code.has_breakpoint(pc) != on && Arc::make_mut(&mut self.code).set_breakpoint(pc, on) {
            self.run_state.breakpoint_to_pass = self.run_state.breakpoint_to_pass.filter(|&p| on || p != pc);
        }
    }

    fn canonical_ram_address(&self, addr: u32) -> Option<u32> {
        let slot = u16::try_from(addr)
            .ok()
            .filter(|&addr| usize::from(addr) < DATA_ADDRESSES)
            .map(|addr| self.part.file_slot(addr));
        match slot {
            Some(chips::FileSlot::Ram(canonical)) => Some(canonical.into()),
            _ => None,
        }
    }
}
