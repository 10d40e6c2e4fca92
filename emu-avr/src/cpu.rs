//! The machine as a value: [`Avr`].

use std::sync::Arc;

use emu_core::chip::Chip;
use emu_core::cpu::{Bus, Cpu, Probe, RamInit, Reset, Stop, rewrite_bit};
use emu_core::engine::{self, Engine, Looks};
use emu_core::image::Image;
use emu_core::pins::{Level, PinId, Time};
use emu_core::rng::Rng;
use emu_core::state::Damaged;

use crate::chips::{self, Part};
use crate::flags::Flags;
use crate::lint::Lints;
use crate::periph::external;
use crate::periph::spm::Bytes;
use crate::periph::timers::Shape;
use crate::predecode::Code;
use crate::soc::{LOW, Put, Soc};
use crate::turn::{Data, Hot, MOST_RAM, RAM, SPH, SPL, SREG, Turn, ram};

/// How a machine is wired, and what its silicon is taken to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Clock before CLKPR, in Hz.
    pub hz: u64,
    /// Fuse bytes (low, high, extended) in place of those of the image.
    pub fuses: Option<[u8; 3]>,
    /// Lock bits in place of those of the image.
    pub lock: Option<u8>,
    /// Every reset takes the start-up time of the fuses; else the program begins at once.
    pub start_up: bool,
    /// Where silicon and data sheet differ.
    pub readings: Readings,
    /// The package, by its name in [`Chip::packages`]. None: the chip has the pins of all its packages.
    pub package: Option<&'static str>,
}

impl Options {
    /// A main clock of `hz` Hz, fuses and lock bits of the image, no start-up time, readings of silicon, pins of all packages.
    #[must_use]
    pub fn at(hz: u64) -> Options {
        Options { hz, fuses: None, lock: None, start_up: false, readings: Readings::default(), package: None }
    }
}

/// Where silicon does otherwise than its data sheet says. Defaults are what several people have measured on silicon, but for erased
/// words, which are most often met by a fault of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Readings {
    /// An edge on INT wakes from sleep modes in which the I/O clock stands; false is the sheet's "only level interrupt" (DS40002061,
    /// table 10-1, note 3). None is as the chip's row has it.
    pub edges_wake: Option<bool>,
    /// Erased words (FFFFh), which are no instruction, do nothing for a cycle each, as several people have seen a chip run through erased
    /// flash into its boot loader; else they stop the run.
    pub erased_is_nop: bool,
    /// ICR takes a write only in modes that have it as TOP, as the sheet says (16.11.7); else in all.
    pub icr_only_as_top: bool,
}

impl Readings {
    /// The same, with what the row of `chip` decides filled in; of a chip that is no AVR nothing is.
    #[must_use]
    pub fn resolved(self, chip: &Chip) -> Readings {
        let own = chips::part(chip.name).map(|part| part.external.edges_wake);
        Readings { edges_wake: self.edges_wake.or(own), ..self }
    }

    /// A timer as it is taken to be; one that the chip does not have has no channel.
    pub(crate) fn timer(self, shape: Option<&Shape>) -> Shape {
        let shape = shape.copied().unwrap_or(Shape::narrow(0));
        Shape { icr_only_as_top: self.icr_only_as_top, ..shape }
    }

    /// The external interrupts as they are taken to be.
    pub(crate) fn external(self, mut kind: external::Kind) -> external::Kind {
        kind.edges_wake = self.edges_wake.unwrap_or(kind.edges_wake);
        kind
    }
}

/// An AVR chip with its program. A clone is a snapshot; program memory is shared until it changes.
#[derive(Debug, Clone)]
pub struct Avr {
    pub(crate) part: &'static Part,
    pub(crate) hot: Hot,
    pub(crate) data: Data,
    pub(crate) code: Arc<Code>,
    pub(crate) soc: Soc,
    pub(crate) looks: Looks,
}

impl Avr {
    /// A chip after power-up with flash, EEPROM, fuses and RAM of `image`, at its default clock; what the image does not fill is
    /// erased (FFh) or, in RAM and the core's registers, as `init` says. A chip that is none of this family's becomes an
    /// ATmega328P. Start-up takes no time unless the image has fuses.
    #[must_use]
    pub fn new(chip: &'static Chip, image: &Image, init: RamInit) -> Avr {
        let start_up = image.bytes_in("fuse").next().is_some();
        Avr::with(chip, image, init, Options { start_up, ..Options::at(chip.default_hz) })
    }

    /// The same in a wiring of its own.
    #[must_use]
    pub fn with(chip: &'static Chip, image: &Image, init: RamInit, options: Options) -> Avr {
        let part = chips::part(chip.name).unwrap_or(&chips::PART_328P);
        let chip = part.chip;
        let mut flash = vec![0xFF; chip.flash as usize];
        image.fill("flash", &mut flash);
        let mut eeprom = vec![0xFF; usize::from(chip.eeprom)];
        image.fill("eeprom", &mut eeprom);
        let mut bytes = [0; RAM + MOST_RAM];
        if let RamInit::Random(seed) = init {
            let mut rng = Rng::new(seed);
            rng.fill(&mut bytes[..32]);
            rng.fill(&mut bytes[usize::from(chip.ram_start)..usize::from(chip.ram_start + chip.ram_len)]);
        }
        for (addr, byte) in image.bytes_in("data") {
            // What lies at the registers of the chip is theirs to say.
            let i = addr as usize;
            if i < 32 || (usize::from(chip.ram_start)..usize::from(chip.ram_start + chip.ram_len)).contains(&i) {
                bytes[i] = byte;
            }
        }
        let mut fuses = part.fuses.assumed;
        image.fill("fuse", &mut fuses);
        let mut lock = [0xFF];
        image.fill("lock", &mut lock);
        let beside = Bytes {
            lock: options.lock.unwrap_or(lock[0]),
            fuses: options.fuses.unwrap_or(fuses),
            signature: part.signature,
            calibration: CALIBRATION,
        };
        let mut soc = Soc::new(part, options, beside, Arc::new(eeprom));
        // RAM below 100h is the chip's to keep.
        soc.fill_low(&bytes[LOW..RAM]);
        soc.lints = Lints::of(image, part);
        bytes[32..RAM].fill(0);
        let mut avr = Avr {
            part,
            hot: Hot::START,
            data: Data { bytes, ram_len: chip.ram_start + chip.ram_len - RAM as u16 },
            code: Arc::new(Code::new(flash, part, options.readings.erased_is_nop)),
            soc,
            looks: Looks::START,
        };
        avr.restart();
        avr
    }

    /// The core as after a reset.
    fn restart(&mut self) {
        let sp = if self.part.stack_at_end { self.part.chip.ram_start + self.part.chip.ram_len - 1 } else { 0 };
        self.hot = Hot { sp, pc: self.soc.reset_vector(), time: self.hot.time, ..Hot::START };
        self.looks.passing = None;
        self.hot.time.force();
    }

    /// Sets the clock before CLKPR in Hz, against which other oscillators are reckoned.
    pub fn set_clock_hz(&mut self, hz: u64) {
        let now = self.cycle();
        self.soc.set_clock_hz(hz, now);
        self.hot.time.force();
    }

    /// Turns the jumping over of polling loops on (as it is at first) or off. Results do not change, only the time taken.
    pub fn set_skip(&mut self, on: bool) {
        self.looks.skip = on;
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
        let turn = Turn { hot: self.hot, data: &mut self.data, code, bus: &mut self.soc, probe };
        (turn, code)
    }
}

impl Cpu for Avr {
    fn chip(&self) -> &'static Chip {
        self.part.chip
    }

    fn clocks_per_cycle(&self) -> u32 {
        1
    }

    fn has_pin(&self, pin: PinId) -> bool {
        self.soc.has_pin(pin)
    }

    fn reset(&mut self, why: Reset) {
        self.hot.time.force();
        let now = self.hot.time.now();
        self.soc.reset(why, now);
        self.restart();
    }

    fn cycle(&self) -> u64 {
        self.hot.time.now()
    }

    fn instructions(&self) -> u64 {
        self.hot.time.instructions()
    }

    fn pc(&self) -> u32 {
        self.hot.pc & self.code.mask()
    }

    fn set_pc(&mut self, pc: u32) {
        self.hot.pc = pc & self.code.mask();
        self.looks.passing = None;
        self.hot.time.force();
    }

    fn reg(&self, name: &str) -> Option<u32> {
        Some(match register(name)? {
            Register::General(n) => u32::from(self.data.bytes[n]),
            Register::Sreg => u32::from(self.hot.flags.pack()),
            Register::Sp => u32::from(self.hot.sp),
            Register::Pc => self.pc(),
        })
    }

    fn regs(&self, into: &mut Vec<u32>) {
        into.clear();
        into.extend(self.data.bytes.iter().take(32).map(|byte| u32::from(*byte)));
        into.extend([u32::from(self.hot.flags.pack()), u32::from(self.hot.sp), self.pc()]);
    }

    fn depth(&self) -> u32 {
        u16::MAX.wrapping_sub(self.hot.sp).into()
    }

    fn set_reg(&mut self, name: &str, value: u32) -> bool {
        match register(name) {
            Some(Register::General(n)) => self.data.bytes[n] = value as u8,
            Some(Register::Sreg) => self.hot.flags = Flags::unpack(value as u8),
            Some(Register::Sp) => self.hot.sp = value as u16,
            Some(Register::Pc) => self.set_pc(value),
            None => return false,
        }
        self.hot.time.force();
        true
    }

    fn peek(&self, space: &str, addr: u32) -> Option<u8> {
        let index = addr as usize;
        match space {
            "data" => Some(match u16::try_from(addr).ok()? {
                SPL => self.hot.sp as u8,
                SPH => (self.hot.sp >> 8) as u8,
                SREG => self.hot.flags.pack(),
                addr if (0x20..RAM as u16).contains(&addr) => self.soc.peek(addr, self.cycle()),
                _ => self.data.bytes[self::index(self.part.chip, addr)?],
            }),
            "flash" => self.code.bytes.get(index).copied(),
            "eeprom" => self.soc.eeprom().get(index).copied(),
            "fuse" => self.soc.bytes().fuses.get(index).copied(),
            "lock" if index == 0 => Some(self.soc.bytes().lock),
            _ => None,
        }
    }

    fn poke(&mut self, space: &str, addr: u32, value: u8) -> bool {
        let index = addr as usize;
        match space {
            "data" => match u16::try_from(addr).unwrap_or(u16::MAX) {
                SPL => self.hot.sp = self.hot.sp & 0xFF00 | u16::from(value),
                SPH => self.hot.sp = self.hot.sp & 0x00FF | u16::from(value) << 8,
                SREG => self.hot.flags = Flags::unpack(value),
                addr if (0x20..RAM as u16).contains(&addr) => {
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
        self.hot.time.force();
        true
    }

    fn poke_bit(&mut self, space: &str, addr: u32, bit: u8, value: bool) -> bool {
        let io = (0x20..self.part.chip.ram_start.into()).contains(&addr) && !(SPL.into()..=SREG.into()).contains(&addr);
        if space != "data" || !io || self.part.whole_registers {
            return rewrite_bit(self, space, addr, bit, value);
        }
        let (now, mask) = (self.cycle(), 1 << (bit & 7));
        self.soc.write_bits(addr as u16, mask, if value { mask } else { 0 }, now);
        self.hot.time.force();
        true
    }

    fn trap(&mut self, pc: u32, on: bool) {
        let pc = pc & self.code.mask();
        if self.code.has_trap(pc) != on && Arc::make_mut(&mut self.code).trap(pc, on) {
            self.looks.passing = self.looks.passing.filter(|&p| on || p != pc);
        }
    }

    fn level(&self, pin: PinId) -> Level {
        self.soc.level(pin)
    }

    fn drive(&mut self, at: Time, pin: PinId, level: Level) {
        let now = self.cycle();
        self.soc.drive(at.cycle, now, pin, level);
        self.hot.time.force();
    }

    fn drive_volts(&mut self, at: Time, pin: PinId, millivolts: u32) -> bool {
        let now = self.cycle();
        self.soc.put(at.cycle, now, Put::Volts(pin, millivolts));
        self.hot.time.force();
        true
    }

    fn supply(&mut self, at: Time, millivolts: u32) -> bool {
        let now = self.cycle();
        self.soc.put(at.cycle, now, Put::Supply(millivolts));
        self.hot.time.force();
        true
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

/// The calibration byte of the internal oscillator, which differs from chip to chip.
const CALIBRATION: u8 = 0x80;

/// Where the core keeps what stands at a data address: a register of its own, or RAM.
fn index(chip: &Chip, addr: u32) -> Option<usize> {
    if addr < 32 {
        return Some(addr as usize);
    }
    let end = u32::from(chip.ram_start) + u32::from(chip.ram_len);
    (RAM as u32..end).contains(&addr).then(|| ram((addr - RAM as u32) as u16))
}

enum Register {
    General(usize),
    Sreg,
    Sp,
    Pc,
}

fn register(name: &str) -> Option<Register> {
    match name.to_ascii_lowercase().as_str() {
        "sreg" => Some(Register::Sreg),
        "sp" => Some(Register::Sp),
        "pc" => Some(Register::Pc),
        other => {
            let number = (0..32).find(|n| other.strip_prefix('r').is_some_and(|digits| digits == n.to_string()))?;
            Some(Register::General(number))
        }
    }
}
