//! The machine as a value: [`Mcs51`].

use std::sync::Arc;

use emu_core::chip::Chip;
use emu_core::cpu::{Bus, Cpu, Probe, RamInit, Reset, Stop, rewrite_bit};
use emu_core::engine::{self, Engine, Looks};
use emu_core::image::Image;
use emu_core::pins::{Level, PinId, Time};
use emu_core::rng::Rng;
use emu_core::state::Damaged;

use crate::chips::{self, Part};
use crate::hot::Hot;
use crate::operands::RamBit;
use crate::predecode::{Code, External};
use crate::soc::Soc;
use crate::turn::{SPAN, Turn};

/// How a machine is wired and how the manual is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Program memory and XDATA are one memory (PSEN and RD combined outside): a write changes the program.
    pub von_neumann: bool,
    /// Level of the EA pin: low takes all of the program from outside, over P0 and P2.
    pub ea: bool,
    /// 6 clocks a machine cycle, on chips that can.
    pub x2: bool,
    /// Readings of the manual.
    pub readings: Readings,
}

impl Default for Options {
    /// Two memories, EA high, 12 clocks, the manual by its letter.
    fn default() -> Options {
        Options { von_neumann: false, ea: true, x2: false, readings: Readings::default() }
    }
}

/// Where the manual can be read in two ways. Defaults are the letter of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Readings {
    /// "The values polled are those that were present at S5P2 of the previous machine cycle" ("How interrupts are
    /// handled"): false takes that by its letter, so that three whole cycles pass at least; true polls what is present in
    /// the last cycle of the instruction, and what has been cleared by then is not served.
    pub sample_now: bool,
    /// An instruction is executed after "any write to the IE or IP registers" (condition 3), or after "any access" (the text
    /// that explains it): true holds interrupts after reads too.
    pub hold_on_read: bool,
}

/// An MCS-51 chip with its program. A clone is a snapshot; memories that are large are shared until they change.
#[derive(Debug, Clone)]
pub struct Mcs51 {
    pub(crate) part: &'static Part,
    pub(crate) hot: Hot,
    pub(crate) ram: [u8; 256],
    pub(crate) xdata: Arc<[u8; SPAN]>,
    pub(crate) code: Arc<Code>,
    pub(crate) soc: Soc,
    pub(crate) unified: bool,
    pub(crate) looks: Looks,
}

impl Mcs51 {
    /// A chip after power-up with the program of `image`, in the usual wiring; what the image does not fill is erased
    /// (FFh) or, in RAM and XDATA, as `ram` says. A chip that is none of this family's becomes an 8051.
    #[must_use]
    pub fn new(chip: &'static Chip, image: &Image, ram: RamInit) -> Mcs51 {
        Mcs51::with(chip, image, ram, Options::default())
    }

    /// The same in a wiring of its own. X2 is taken for false on a chip that cannot, EA for low on one without program
    /// memory.
    #[must_use]
    pub fn with(chip: &'static Chip, image: &Image, init: RamInit, options: Options) -> Mcs51 {
        let part = chips::part(chip.name).unwrap_or(&chips::I8051);
        let options = Options { x2: options.x2 && part.x2, ..options };
        let mut program = vec![0xFF; image.end("code") as usize];
        image.fill("code", &mut program);
        let (mut ram, mut xdata) = ([0u8; 256], [0u8; SPAN]);
        if let RamInit::Random(seed) = init {
            let mut rng = Rng::new(seed);
            rng.fill(&mut ram[..usize::from(part.iram)]);
            rng.fill(&mut xdata);
        }
        let unified = options.von_neumann && part.bus;
        if unified || !part.bus {
            xdata.fill(0xFF);
        }
        if unified {
            image.fill("code", &mut xdata);
        }
        let external = match (part.bus, unified) {
            (false, _) => External::Absent,
            (true, true) => External::Unified,
            (true, false) => External::Separate,
        };
        let outside = part.bus && (!options.ea || program.len() as u64 > u64::from(part.chip.on_chip));
        let mut mcs51 = Mcs51 {
            part,
            hot: Hot::START,
            ram,
            xdata: Arc::new(xdata),
            code: Arc::new(Code::new(&program, part.chip.flash, external)),
            soc: Soc::new(part, options, outside),
            unified,
            looks: Looks::START,
        };
        mcs51.hot.time.force();
        mcs51
    }

    /// Turns the jumping over of polling loops on (as it is at first) or off. Results do not change, only the time taken.
    pub fn set_skip(&mut self, on: bool) {
        self.looks.skip = on;
    }

    /// Lets a probe see the edges of the bus under MOVX, or not (as it is at first, since they are many).
    pub fn show_bus(&mut self, on: bool) {
        self.soc.show_bus(on);
    }

    /// The chip around the core.
    #[must_use]
    pub fn soc(&self) -> &Soc {
        &self.soc
    }

    /// Interrupt that would be taken at the next instruction boundary, as a vector number.
    #[must_use]
    pub fn pending_interrupt(&self) -> Option<u8> {
        self.soc.pending(self.cycle())
    }

    /// The core at its boundary, ready for a burst.
    pub(crate) fn turn<'a, P: Probe>(&'a mut self, probe: &'a mut P) -> (Turn<'a, P>, &'a Code) {
        let code: &Code = &self.code;
        let turn = Turn {
            hot: self.hot,
            cycles: 0,
            upper: self.part.iram > 128,
            dual: self.part.at89s,
            ram: &mut self.ram,
            xdata: Arc::make_mut(&mut self.xdata),
            code: &code.bytes,
            bus: &mut self.soc,
            probe,
        };
        (turn, code)
    }

    /// Writes a byte of external memory, which may be program memory too.
    pub(crate) fn write_external(&mut self, addr: u16, value: u8) {
        Arc::make_mut(&mut self.xdata)[usize::from(addr)] = value;
        if self.unified {
            Arc::make_mut(&mut self.code).poke(addr, value);
        }
    }

    fn peek_direct(&self, addr: u8) -> u8 {
        self.hot.core(addr, self.part.at89s).unwrap_or_else(|| self.soc.peek(addr.into(), self.cycle()))
    }

    fn poke_direct(&mut self, addr: u8, mask: u8, value: u8) {
        if let Some(old) = self.hot.core(addr, self.part.at89s) {
            self.hot.set_core(addr, old & !mask | value & mask, self.part.at89s);
        } else {
            let now = self.cycle();
            self.soc.poke(addr.into(), mask, value, now);
        }
    }
}

impl Cpu for Mcs51 {
    fn chip(&self) -> &'static Chip {
        &self.part.chip
    }

    fn clocks_per_cycle(&self) -> u32 {
        self.soc.clocks_per_cycle()
    }

    fn reset(&mut self, why: Reset) {
        self.hot.time.force();
        let now = self.hot.time.now();
        self.hot = Hot { time: self.hot.time, ..Hot::START };
        self.looks.passing = None;
        self.soc.reset(why, now);
    }

    fn cycle(&self) -> u64 {
        self.hot.time.now()
    }

    fn instructions(&self) -> u64 {
        self.hot.time.instructions()
    }

    fn pc(&self) -> u32 {
        self.hot.pc & 0xFFFF
    }

    fn set_pc(&mut self, pc: u32) {
        self.hot.pc = pc & 0xFFFF;
        self.looks.passing = None;
        self.hot.time.force();
    }

    fn reg(&self, name: &str) -> Option<u32> {
        Some(match register(name)? {
            Register::Bank(n) => u32::from(self.ram[self.hot.bank as usize + n]),
            Register::Acc => self.hot.acc,
            Register::B => self.hot.b,
            Register::Psw => u32::from(self.hot.psw()),
            Register::Sp => self.hot.sp,
            Register::Dptr => self.hot.dptr,
            Register::Pc => self.pc(),
        })
    }

    fn regs(&self, into: &mut Vec<u32>) {
        into.clear();
        into.extend(self.ram.iter().skip(self.hot.bank as usize).take(8).map(|byte| u32::from(*byte)));
        into.extend([self.hot.acc, self.hot.b, self.hot.psw().into(), self.hot.sp, self.hot.dptr, self.pc()]);
    }

    fn depth(&self) -> u32 {
        self.hot.sp
    }

    fn set_reg(&mut self, name: &str, value: u32) -> bool {
        match register(name) {
            Some(Register::Bank(n)) => self.ram[self.hot.bank as usize + n] = value as u8,
            Some(Register::Acc) => self.hot.acc = value & 0xFF,
            Some(Register::B) => self.hot.b = value & 0xFF,
            Some(Register::Psw) => self.hot.set_psw(value as u8),
            Some(Register::Sp) => self.hot.sp = value & 0xFF,
            Some(Register::Dptr) => self.hot.dptr = value & 0xFFFF,
            Some(Register::Pc) => self.set_pc(value),
            None => return false,
        }
        self.hot.time.force();
        true
    }

    fn peek(&self, space: &str, addr: u32) -> Option<u8> {
        let index = addr as usize;
        match space {
            "code" if addr < self.part.chip.flash => self.code.bytes.get(index).copied(),
            "idata" if addr < u32::from(self.part.iram) => self.ram.get(index).copied(),
            "sfr" => u8::try_from(addr).ok().filter(|&a| a >= 0x80).map(|a| self.peek_direct(a)),
            "bit" => {
                let bit = u8::try_from(addr).ok()?;
                let at = RamBit::at(bit);
                let byte = if bit < 0x80 { self.ram[usize::from(at.byte)] } else { self.peek_direct(bit & 0xF8) };
                Some(u8::from(byte & at.mask != 0))
            }
            "xdata" if self.part.bus => self.xdata.get(index).copied(),
            _ => None,
        }
    }

    fn poke(&mut self, space: &str, addr: u32, value: u8) -> bool {
        let (index, word) = (addr as usize, addr as u16);
        match space {
            "code" if addr < self.part.chip.flash => {
                Arc::make_mut(&mut self.code).poke(word, value);
                if self.unified {
                    Arc::make_mut(&mut self.xdata)[index] = value;
                }
            }
            "idata" if addr < u32::from(self.part.iram) => self.ram[index] = value,
            "sfr" if (0x80..0x100).contains(&addr) => self.poke_direct(addr as u8, 0xFF, value),
            "bit" if addr < 0x80 => {
                let at = RamBit::at(addr as u8);
                let byte = &mut self.ram[usize::from(at.byte)];
                *byte = *byte & !at.mask | if value & 1 != 0 { at.mask } else { 0 };
            }
            "bit" if addr < 0x100 => {
                let mask = 1 << (addr & 7);
                self.poke_direct(addr as u8 & 0xF8, mask, if value & 1 != 0 { mask } else { 0 });
            }
            "xdata" if self.part.bus && index < SPAN => self.write_external(word, value),
            _ => return false,
        }
        self.hot.time.force();
        true
    }

    fn poke_bit(&mut self, space: &str, addr: u32, bit: u8, value: bool) -> bool {
        if space != "sfr" || !(0x80..0x100).contains(&addr) {
            return rewrite_bit(self, space, addr, bit, value);
        }
        let mask = 1 << (bit & 7);
        self.poke_direct(addr as u8, mask, if value { mask } else { 0 });
        self.hot.time.force();
        true
    }

    fn trap(&mut self, pc: u32, on: bool) {
        let pc = pc & 0xFFFF;
        if self.code.has_trap(pc) != on && Arc::make_mut(&mut self.code).trap(pc, on) {
            self.looks.passing = self.looks.passing.filter(|&p| on || p != pc);
        }
    }

    fn level(&self, pin: PinId) -> Level {
        self.soc.level(pin)
    }

    fn stopping(&self) -> Option<u8> {
        self.soc.stopping()
    }

    fn drive(&mut self, at: Time, pin: PinId, level: Level) {
        let now = self.cycle();
        self.soc.drive(at.cycle, now, pin, level);
        self.hot.time.force();
    }

    fn save(&self) -> Vec<u8> {
        self.to_bytes()
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), Damaged> {
        *self = self.of_bytes(bytes)?;
        Ok(())
    }

    fn run<P: Probe>(&mut self, until: u64, probe: &mut P) -> Stop {
        engine::run(self, until, probe)
    }

    fn sleeps(&self) -> bool {
        Engine::asleep(self)
    }

    fn insist(&mut self, on: bool) {
        self.looks.insists = on;
    }

    fn waits_for_ever(&mut self) -> bool {
        engine::waits_for_ever(self)
    }

    fn step_until<P: Probe>(&mut self, until: u64, probe: &mut P) -> Stop {
        engine::step_until(self, until, probe)
    }
}

enum Register {
    Bank(usize),
    Acc,
    B,
    Psw,
    Sp,
    Dptr,
    Pc,
}

fn register(name: &str) -> Option<Register> {
    Some(match name.to_ascii_lowercase().as_str() {
        "a" | "acc" => Register::Acc,
        "b" => Register::B,
        "psw" => Register::Psw,
        "sp" => Register::Sp,
        "dptr" => Register::Dptr,
        "pc" => Register::Pc,
        other => Register::Bank((0..8).find(|n| other.strip_prefix('r') == Some(&n.to_string()))?),
    })
}
