//! The machine as a value: [`Mcs51`].

use std::sync::Arc;

use emu_core::chip::Chip;
use emu_core::cpu::{Bus, Cpu, Probe, RamInit, ResetCause, rewrite_bit};
use emu_core::engine::{ReadyExecutor, RunState};
use emu_core::image::Image;
use emu_core::rng::Rng;
use emu_core::state::SnapshotDamaged;

use crate::chips::{self, Mcs51Part};
use crate::core_state::CoreRegisters;
use crate::executor::{ADDRESS_SPACE, Executor};
use crate::operands::RamBit;
use crate::predecode::{CodeMemory, XdataBus};
use crate::soc::Mcs51Soc;

/// How a machine is wired, and how the manual is interpreted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Program memory and XDATA are one memory (PSEN and RD combined outside), so that a write changes the
    /// program.
    pub von_neumann: bool,
    /// Level of the EA pin: low means that all of the program is read from outside, over P0 and P2.
    pub ea: bool,
    /// 6 clocks per machine cycle, on chips that support it.
    pub x2: bool,
    /// Interpretations of the manual.
    pub readings: Mcs51Readings,
}

impl Default for Options {
    /// Two memories, EA high, 12 clocks per cycle, and the literal interpretation of the manual.
    fn default() -> Options {
        Options { von_neumann: false, ea: true, x2: false, readings: Mcs51Readings::default() }
    }
}

/// Choices where the manual can be interpreted in two ways. The defaults are the literal ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Mcs51Readings {
    /// "The values polled are those that were present at S5P2 of the previous machine cycle" ("How interrupts
    /// are handled"). False is the literal interpretation: at least three whole cycles pass. True polls the
    /// values of the last cycle of the instruction, and a request that is cleared by then is not served.
    pub samples_interrupt_at_once: bool,
    /// One more instruction is executed after "any write to the IE or IP registers" (condition 3), or after
    /// "any access" (the text that explains it). True holds interrupts after reads too.
    pub read_holds_interrupts: bool,
}

/// An MCS-51 chip with its program. A clone is a snapshot; large memories are shared until they change.
#[derive(Debug, Clone)]
pub struct Mcs51 {
    /// The row of the chip.
    pub(crate) part: &'static Mcs51Part,
    /// Registers and clock of the core.
    pub(crate) core: CoreRegisters,
    /// Internal RAM. Chips with 128 bytes use the lower half.
    pub(crate) ram: [u8; 256],
    /// External data memory; copied on write.
    pub(crate) xdata: Arc<[u8; ADDRESS_SPACE]>,
    /// Program memory with its predecoded form; copied on write.
    pub(crate) code: Arc<CodeMemory>,
    /// The chip around the core.
    pub(crate) soc: Mcs51Soc,
    /// Whether program and external data memory are one memory.
    pub(crate) is_unified: bool,
    /// What the run loop remembers between bursts.
    pub(crate) run_state: RunState,
}

impl Mcs51 {
    /// A chip after power-up with the program of `image`, in the default wiring. Program memory outside of
    /// the image is erased (FFh); RAM and XDATA are filled as `ram` says. A chip of another family becomes an
    /// 8051.
    #[must_use]
    pub fn new(chip: &'static Chip, image: &Image, ram: RamInit) -> Mcs51 {
        Mcs51::with(chip, image, ram, Options::default())
    }

    /// As [`Mcs51::new`], with other wiring. X2 is ignored on a chip that does not support it, and EA is
    /// taken as low on a chip without program memory.
    #[must_use]
    pub fn with(chip: &'static Chip, image: &Image, init: RamInit, options: Options) -> Mcs51 {
        let part = chips::part(chip.name).unwrap_or(&chips::I8051);
        let options = Options { x2: options.x2 && part.has_x2, ..options };
        let mut program = vec![0xFF; image.end("code") as usize];
        image.fill("code", &mut program);
        let (mut ram, mut xdata) = ([0u8; 256], [0u8; ADDRESS_SPACE]);
        if let RamInit::Random(seed) = init {
            let mut rng = Rng::new(seed);
            rng.fill(&mut ram[..usize::from(part.iram_bytes)]);
            rng.fill(&mut xdata);
        }
        let unified = options.von_neumann && part.has_bus;
        if unified || !part.has_bus {
            xdata.fill(0xFF);
        }
        if unified {
            image.fill("code", &mut xdata);
        }
        let external = match (part.has_bus, unified) {
            (false, _) => XdataBus::Absent,
            (true, true) => XdataBus::Unified,
            (true, false) => XdataBus::Separate,
        };
        let outside = part.has_bus && (!options.ea || program.len() as u64 > u64::from(part.chip.on_chip_flash_bytes));
        let mut mcs51 = Mcs51 {
            part,
            core: CoreRegisters::START,
            ram,
            xdata: Arc::new(xdata),
            code: Arc::new(CodeMemory::new(&program, part.chip.flash_bytes, external)),
            soc: Mcs51Soc::new(part, options, outside),
            is_unified: unified,
            run_state: RunState::START,
        };
        mcs51.core.clock.expire();
        mcs51
    }

    /// Enables or disables (the default) reporting of the bus edges of MOVX to probes; they are many.
    pub fn set_bus_on_pins(&mut self, on: bool) {
        self.soc.set_bus_on_pins(on);
    }

    /// The chip without its core.
    #[must_use]
    pub fn soc(&self) -> &Mcs51Soc {
        &self.soc
    }

    /// Vector number of the interrupt that would be taken at the next instruction boundary.
    #[must_use]
    pub fn pending_interrupt(&self) -> Option<u8> {
        self.soc.pending_interrupt(self.cycle())
    }

    /// The core at an instruction boundary, ready for a burst.
    pub(crate) fn executor<'a, P: Probe>(
        &'a mut self,
        probe: &'a mut P,
    ) -> ReadyExecutor<Executor<'a, P>, &'a CodeMemory> {
        let code: &CodeMemory = &self.code;
        let executor = Executor {
            core: self.core,
            cycles: 0,
            has_upper_ram: self.part.iram_bytes > 128,
            has_two_dptrs: self.part.is_at89s,
            ram: &mut self.ram,
            xdata: Arc::make_mut(&mut self.xdata),
            code: &code.bytes,
            bus: &mut self.soc,
            probe,
        };
        ReadyExecutor { executor, code }
    }

    /// Writes a byte of external memory, which can be program memory too.
    pub(crate) fn write_external(&mut self, addr: u16, value: u8) {
        Arc::make_mut(&mut self.xdata)[usize::from(addr)] = value;
        if self.is_unified {
            Arc::make_mut(&mut self.code).poke(addr, value);
        }
    }

    fn peek_direct(&self, addr: u8) -> u8 {
        self.core.read_core_sfr(addr, self.part.is_at89s).unwrap_or_else(|| self.soc.peek(addr.into(), self.cycle()))
    }

    fn poke_direct(&mut self, addr: u8, mask: u8, value: u8) {
        if let Some(old) = self.core.read_core_sfr(addr, self.part.is_at89s) {
            self.core.write_core_sfr(addr, old & !mask | value & mask, self.part.is_at89s);
        } else {
            let now = self.cycle();
            self.soc.poke(addr.into(), mask, value, now);
        }
    }
}

emu_core::cpu_parts!(Mcs51, Mcs51Soc);

impl Cpu for Mcs51 {
    emu_core::run_by_engine!();

    fn chip(&self) -> &'static Chip {
        &self.part.chip
    }

    fn clocks_per_cycle(&self) -> u32 {
        self.soc.clocks_per_cycle()
    }

    fn reset(&mut self, why: ResetCause) {
        self.core.clock.expire();
        let now = self.core.clock.now();
        self.core = CoreRegisters { clock: self.core.clock, ..CoreRegisters::START };
        self.run_state.breakpoint_to_pass = None;
        self.soc.reset(why, now);
    }

    fn pc(&self) -> u32 {
        self.core.pc & 0xFFFF
    }

    fn set_pc(&mut self, pc: u32) {
        self.core.pc = pc & 0xFFFF;
        self.run_state.breakpoint_to_pass = None;
        self.core.clock.expire();
    }

    fn reg(&self, name: &str) -> Option<u32> {
        Some(match register_by_name(name)? {
            CoreRegister::Bank(n) => u32::from(self.ram[self.core.bank as usize + n]),
            CoreRegister::Acc => self.core.acc,
            CoreRegister::B => self.core.b,
            CoreRegister::Psw => u32::from(self.core.psw()),
            CoreRegister::Sp => self.core.sp,
            CoreRegister::Dptr => self.core.dptr,
            CoreRegister::Pc => self.pc(),
        })
    }

    fn read_regs(&self, into: &mut Vec<u32>) {
        into.clear();
        into.extend(self.ram.iter().skip(self.core.bank as usize).take(8).map(|byte| u32::from(*byte)));
        into.extend([self.core.acc, self.core.b, self.core.psw().into(), self.core.sp, self.core.dptr, self.pc()]);
    }

    fn stack_depth(&self) -> u32 {
        self.core.sp
    }

    fn set_reg(&mut self, name: &str, value: u32) -> bool {
        match register_by_name(name) {
            Some(CoreRegister::Bank(n)) => self.ram[self.core.bank as usize + n] = value as u8,
            Some(CoreRegister::Acc) => self.core.acc = value & 0xFF,
            Some(CoreRegister::B) => self.core.b = value & 0xFF,
            Some(CoreRegister::Psw) => self.core.set_psw(value as u8),
            Some(CoreRegister::Sp) => self.core.sp = value & 0xFF,
            Some(CoreRegister::Dptr) => self.core.dptr = value & 0xFFFF,
            Some(CoreRegister::Pc) => self.set_pc(value),
            None => return false,
        }
        self.core.clock.expire();
        true
    }

    fn peek(&self, space: &str, addr: u32) -> Option<u8> {
        let index = addr as usize;
        match space {
            "code" if addr < self.part.chip.flash_bytes => self.code.bytes.get(index).copied(),
            "idata" if addr < u32::from(self.part.iram_bytes) => self.ram.get(index).copied(),
            "sfr" => u8::try_from(addr).ok().filter(|&a| a >= 0x80).map(|a| self.peek_direct(a)),
            "bit" => {
                let bit = u8::try_from(addr).ok()?;
                let at = RamBit::of_address(bit);
                let byte = if bit < 0x80 { self.ram[usize::from(at.byte)] } else { self.peek_direct(bit & 0xF8) };
                Some(u8::from(byte & at.mask != 0))
            }
            "xdata" if self.part.has_bus => self.xdata.get(index).copied(),
            _ => None,
        }
    }

    fn poke(&mut self, space: &str, addr: u32, value: u8) -> bool {
        let (index, word) = (addr as usize, addr as u16);
        match space {
            "code" if addr < self.part.chip.flash_bytes => {
                Arc::make_mut(&mut self.code).poke(word, value);
                if self.is_unified {
                    Arc::make_mut(&mut self.xdata)[index] = value;
                }
            }
            "idata" if addr < u32::from(self.part.iram_bytes) => self.ram[index] = value,
            "sfr" if (0x80..0x100).contains(&addr) => self.poke_direct(addr as u8, 0xFF, value),
            "bit" if addr < 0x80 => {
                let at = RamBit::of_address(addr as u8);
                let byte = &mut self.ram[usize::from(at.byte)];
                *byte = *byte & !at.mask | if value & 1 != 0 { at.mask } else { 0 };
            }
            "bit" if addr < 0x100 => {
                let mask = 1 << (addr & 7);
                self.poke_direct(addr as u8 & 0xF8, mask, if value & 1 != 0 { mask } else { 0 });
            }
            "xdata" if self.part.has_bus && index < ADDRESS_SPACE => self.write_external(word, value),
            _ => return false,
        }
        self.core.clock.expire();
        true
    }

    fn poke_bit(&mut self, space: &str, addr: u32, bit: u8, value: bool) -> bool {
        if space != "sfr" || !(0x80..0x100).contains(&addr) {
            return rewrite_bit(self, space, addr, bit, value);
        }
        let mask = 1 << (bit & 7);
        self.poke_direct(addr as u8, mask, if value { mask } else { 0 });
        self.core.clock.expire();
        true
    }

    fn set_breakpoint(&mut self, pc: u32, on: bool) {
        let pc = pc & 0xFFFF;
        if self.code.has_breakpoint(pc) != on && Arc::make_mut(&mut self.code).set_breakpoint(pc, on) {
            self.run_state.breakpoint_to_pass = self.run_state.breakpoint_to_pass.filter(|&p| on || p != pc);
        }
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotDamaged> {
        *self = self.restored(bytes)?;
        Ok(())
    }
}

enum CoreRegister {
    Bank(usize),
    Acc,
    B,
    Psw,
    Sp,
    Dptr,
    Pc,
}

fn register_by_name(name: &str) -> Option<CoreRegister> {
    Some(match name.to_ascii_lowercase().as_str() {
        "a" | "acc" => CoreRegister::Acc,
        "b" => CoreRegister::B,
        "psw" => CoreRegister::Psw,
        "sp" => CoreRegister::Sp,
        "dptr" => CoreRegister::Dptr,
        "pc" => CoreRegister::Pc,
        other => CoreRegister::Bank((0..8).find(|n| other.strip_prefix('r') == Some(&n.to_string()))?),
    })
}
