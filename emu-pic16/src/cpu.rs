//! The machine as a value: [`Pic16`].

use std::sync::Arc;

use emu_core::chip::Chip;
use emu_core::countdown::Countdown;
use emu_core::cpu::{Bus, Cpu, NEVER, Probe, RamInit, Reset, Stop};
use emu_core::engine::{self, Engine, Looks, Mark};
use emu_core::image::Image;
use emu_core::pins::{Event, Level, PinId, Time};
use emu_core::state::Damaged;

use crate::chips::{self, Part};
use crate::hot::{BANK, Hot, PD, TO};
use crate::isa::{Kind, SPAN};
use crate::lint::Lints;
use crate::operands::Place;
use crate::options::power_up;
pub use crate::options::{Corner, Options, Readings};
use crate::periph::map::Sfr;
use crate::predecode::Code;
use crate::soc::{Order, Soc};
use crate::turn::{DATA, OPS, Turn};

/// A mid-range PIC16 with its program. A clone is a snapshot; program memory is shared until it changes.
#[derive(Debug, Clone)]
pub struct Pic16 {
    pub(crate) part: &'static Part,
    pub(crate) hot: Hot,
    pub(crate) ram: [u8; DATA],
    pub(crate) stack: [u16; 8],
    pub(crate) code: Arc<Code>,
    pub(crate) soc: Soc,
    pub(crate) looks: Looks,
    pub(crate) lints: Lints,
    /// What RAM holds after power-up.
    init: RamInit,
}

impl Pic16 {
    /// A chip after power-up with the program of `image`, in the usual wiring; what the image does not fill is erased or, in
    /// RAM, as `ram` says. A chip that is none of this family's becomes a PIC16F873.
    #[must_use]
    pub fn new(chip: &'static Chip, image: &Image, ram: RamInit) -> Pic16 {
        Pic16::with(chip, image, ram, Options::default())
    }

    /// The same in a wiring of its own.
    #[must_use]
    pub fn with(chip: &'static Chip, image: &Image, init: RamInit, options: Options) -> Pic16 {
        let part = chips::part(chip.name).unwrap_or(&chips::PIC16F873);
        let ram = power_up(init, 0);
        let cells = |space: &str, count: u32| -> Vec<u16> {
            let mut bytes = vec![0xFF; 2 * count as usize];
            image.fill(space, &mut bytes);
            bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect()
        };
        let eeprom: Vec<u8> = cells("eeprom", part.chip.eeprom.into()).iter().map(|&cell| cell as u8).collect();
        let mut places = Box::new([Place::NONE; DATA]);
        for (place, found) in places.iter_mut().zip(part.places()) {
            *place = match found {
                chips::Place::Ram(kept) => Place(kept % DATA as u16),
                chips::Place::Sfr(sfr) => Place::sfr(sfr),
                chips::Place::None => Place::NONE,
            };
        }
        let words = part.chip.flash / 2;
        let mut pic = Pic16 {
            part,
            hot: Hot::START,
            ram,
            stack: [0; 8],
            code: Arc::new(Code::new(&cells("flash", words), words, places)),
            soc: Soc::new(part, options, &cells("config", 16), &eeprom),
            looks: Looks::START,
            lints: Lints::default(),
            init,
        };
        pic.hot.time.force();
        pic
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

    /// The eight places of the stack, and the one that the next push takes.
    #[must_use]
    pub fn stack(&self) -> (&[u16; 8], usize) {
        (&self.stack, self.hot.sp as usize % 8)
    }

    /// The core at its boundary, ready for a burst.
    fn turn<'a, P: Probe>(&'a mut self, probe: &'a mut P) -> (Turn<'a, P>, &'a Code) {
        let code: &Code = &self.code;
        let turn = Turn {
            hot: self.hot,
            ram: &mut self.ram,
            stack: &mut self.stack,
            places: &code.places,
            lowest: &code.lowest,
            lints: &mut self.lints,
            words: &code.words,
            bus: &mut self.soc,
            probe,
        };
        (turn, code)
    }

    fn set_fsr(&mut self, value: u32) {
        self.hot.pointer = self.hot.pointer & 0x100 | value;
    }

    fn op_index(&self, pc: u32) -> usize {
        (self.hot.at & BANK | pc) as usize % OPS
    }

    /// Reads a place without side effects.
    fn peek_place(&self, place: Place) -> u8 {
        match core_register(place) {
            Some(Sfr::STATUS) => self.hot.status(),
            Some(Sfr::FSR) => self.hot.pointer as u8,
            Some(Sfr::PCL) => self.hot.at as u8,
            Some(Sfr::PCLATH) => self.hot.pclath as u8,
            Some(_) => 0,
            None if place.0 < DATA as u16 => self.ram[usize::from(place.0)],
            None => self.soc.peek(place.0 - DATA as u16, self.cycle()),
        }
    }

    fn poke_place(&mut self, place: Place, value: u8) {
        match core_register(place) {
            Some(Sfr::STATUS) => {
                self.hot.set_status(value.into());
                self.hot.to_pd = u32::from(value) & (TO | PD);
            }
            Some(Sfr::FSR) => self.set_fsr(value.into()),
            Some(Sfr::PCL) => self.set_pc(self.hot.pclath << 8 | u32::from(value)),
            Some(Sfr::PCLATH) => self.hot.pclath = u32::from(value) & 0x1F,
            Some(_) => {}
            None if place.0 < DATA as u16 => self.ram[usize::from(place.0)] = value,
            None => {
                let now = self.cycle();
                self.soc.poke(place.0 - DATA as u16, value, now);
            }
        }
    }

    /// The place of an address of data memory; INDF is where FSR points.
    fn place(&self, addr: u16) -> Place {
        match self.code.places[usize::from(addr) % DATA] {
            place if place == Place::sfr(Sfr::INDF) => self.code.places[self.hot.pointer as usize % DATA],
            place => place,
        }
    }
}

/// The register of the core at a place.
fn core_register(place: Place) -> Option<Sfr> {
    const CORE: [Sfr; 5] = [Sfr::INDF, Sfr::PCL, Sfr::STATUS, Sfr::FSR, Sfr::PCLATH];
    let nowhere = (place == Place::NONE).then_some(Sfr::INDF);
    CORE.into_iter().find(|&sfr| place == Place::sfr(sfr)).or(nowhere)
}

impl Cpu for Pic16 {
    fn chip(&self) -> &'static Chip {
        &self.part.chip
    }

    fn clocks_per_cycle(&self) -> u32 {
        4
    }

    fn reset(&mut self, why: Reset) {
        self.hot.time.force();
        let now = self.hot.time.now();
        let (hot, asleep) = (self.hot, self.soc.in_standby());
        // DS30292, tables 12-3 and 12-6: what a reset leaves as it was, and TO and PD by its cause.
        let to_pd = match (why, asleep) {
            (Reset::PowerOn | Reset::BrownOut, _) => TO | PD,
            (Reset::External, false) => hot.to_pd,
            (Reset::External, true) => TO,
            (Reset::Watchdog, _) => PD,
        };
        self.hot = Hot {
            time: hot.time,
            w: hot.w,
            z: hot.z,
            dc: hot.dc,
            c: hot.c,
            pointer: hot.pointer & 0xFF,
            to_pd,
            ..Hot::START
        };
        self.looks.passing = None;
        self.lints = Lints::default();
        if why == Reset::PowerOn {
            self.ram = power_up(self.init, now);
        }
        self.soc.reset(why, now);
    }

    fn cycle(&self) -> u64 {
        self.hot.time.now()
    }

    fn instructions(&self) -> u64 {
        self.hot.time.instructions()
    }

    fn pc(&self) -> u32 {
        self.hot.pc()
    }

    fn set_pc(&mut self, pc: u32) {
        self.hot.set_pc(pc);
        self.looks.passing = None;
        self.hot.time.force();
    }

    fn reg(&self, name: &str) -> Option<u32> {
        Some(match name.to_ascii_uppercase().as_str() {
            "W" => self.hot.w,
            "STATUS" => self.hot.status().into(),
            "FSR" => self.hot.pointer & 0xFF,
            "PCLATH" => self.hot.pclath,
            "PC" => self.pc(),
            _ => return None,
        })
    }

    fn regs(&self, into: &mut Vec<u32>) {
        into.clear();
        let status = self.hot.status().into();
        into.extend([self.hot.w, status, self.hot.pointer & 0xFF, self.hot.pclath, self.pc()]);
    }

    fn return_stack(&self) -> Vec<u32> {
        (1..=8).map(|back| self.stack[(self.hot.sp as usize + 8 - back) % 8].into()).collect()
    }

    fn depth(&self) -> u32 {
        self.hot.sp % 8
    }

    fn interrupt_flags(&self) -> Vec<&'static str> {
        self.soc.wanted_flags(self.cycle())
    }

    fn set_reg(&mut self, name: &str, value: u32) -> bool {
        match name.to_ascii_uppercase().as_str() {
            "W" => self.hot.w = value & 0xFF,
            "STATUS" => self.poke_place(Place::sfr(Sfr::STATUS), value as u8),
            "FSR" => self.set_fsr(value & 0xFF),
            "PCLATH" => self.hot.pclath = value & 0x1F,
            "PC" => self.set_pc(value),
            _ => return false,
        }
        self.hot.time.force();
        true
    }

    fn peek(&self, space: &str, addr: u32) -> Option<u8> {
        let index = addr as usize;
        match space {
            "data" if index < DATA => Some(self.peek_place(self.place(addr as u16))),
            "flash" if addr < self.part.chip.flash => Some(self.code.words[index / 2].to_le_bytes()[index % 2]),
            "eeprom" => self.soc.eeprom().get(index).copied(),
            "config" if index < 32 => Some(self.soc.config(index / 2).to_le_bytes()[index % 2]),
            _ => None,
        }
    }

    fn poke(&mut self, space: &str, addr: u32, value: u8) -> bool {
        let index = addr as usize;
        match space {
            "data" if index < DATA => self.poke_place(self.place(addr as u16), value),
            "flash" if addr < self.part.chip.flash => {
                let mut bytes = self.code.words[index / 2].to_le_bytes();
                bytes[index % 2] = value;
                Arc::make_mut(&mut self.code).poke(addr / 2, u16::from_le_bytes(bytes));
            }
            "eeprom" if index < self.soc.eeprom().len() => self.soc.set_eeprom(index, value),
            _ => return false,
        }
        self.hot.time.force();
        true
    }

    fn trap(&mut self, pc: u32, on: bool) {
        let pc = pc % SPAN as u32;
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
        self.soc.drive(at, now, pin, level);
        self.hot.time.force();
    }

    fn drive_volts(&mut self, at: Time, pin: PinId, millivolts: u32) -> bool {
        let now = self.cycle();
        self.soc.put_volts(at, now, pin, millivolts);
        self.hot.time.force();
        true
    }

    fn supply(&mut self, at: Time, millivolts: u32) -> bool {
        let now = self.cycle();
        self.soc.put_supply(at, now, millivolts);
        self.hot.time.force();
        true
    }

    fn ram_at(&self, addr: u32) -> Option<u32> {
        let place = u16::try_from(addr).ok().filter(|&addr| usize::from(addr) < DATA).map(|addr| self.part.place(addr));
        match place {
            Some(chips::Place::Ram(kept)) => Some(kept.into()),
            _ => None,
        }
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

impl Engine for Pic16 {
    type Held = (u32, u8, u32, u32);

    fn clock(&mut self) -> &mut Countdown {
        &mut self.hot.time
    }
    fn stop(&mut self) -> &mut bool {
        &mut self.hot.stop
    }
    fn escaped(&mut self) -> &mut bool {
        &mut self.hot.escape
    }
    fn looks(&mut self) -> &mut Looks {
        &mut self.looks
    }
    fn fire(&mut self, now: u64) -> u64 {
        self.soc.fire(now)
    }
    fn log(&mut self, on: bool) {
        let now = self.cycle();
        self.soc.log(on, now);
    }
    fn drain(&mut self) -> Option<Event> {
        self.soc.drain()
    }
    fn reset_requested(&mut self) -> Option<Reset> {
        self.soc.reset_requested()
    }

    fn obey(&mut self) -> bool {
        let now = self.hot.time.now();
        let Some(order) = self.soc.order(now) else { return false };
        match order {
            Order::Woken { by_watchdog } => {
                // DS30292, table 12-3: the watchdog clears TO as it wakes; SLEEP has cleared PD.
                if by_watchdog {
                    self.hot.to_pd = 0;
                }
            }
            Order::ReadWord { addr } => {
                let word = self.code.words[usize::from(addr) % SPAN];
                self.soc.word_read(word);
            }
            Order::WriteWords { addr, words, erased } => {
                let code = Arc::make_mut(&mut self.code);
                for (at, word) in (u32::from(addr)..).zip(words) {
                    let old = if erased { 0x3FFF } else { code.words[at as usize % SPAN] };
                    code.poke(at, old & word);
                }
            }
            Order::Stand { until } => {
                self.hot.time.pass(until - now);
                self.hot.time.force();
            }
            Order::Ignore { until } => {
                self.hot.time.pass(until - now);
                self.hot.time.force();
                self.hot.set_pc(self.hot.pc() + (until - now) as u32);
            }
        }
        true
    }

    fn interrupt_pending(&self, now: u64) -> bool {
        self.soc.pending(now).is_some()
    }

    fn enter_interrupt<P: Probe>(&mut self, now: u64, probe: &mut P) -> bool {
        let Some(since) = self.soc.interrupt_since(now) else { return false };
        // Two cycles without an instruction; the second cycle of the instruction before counts when the interrupt was there by
        // then, so that the latency is the same after instructions of one and two cycles (DS30292, 12.10.1).
        let cycles = if since < now { 1 } else { 2 };
        self.soc.take(1, now);
        probe.irq(now, 1);
        self.hot = self.turn(probe).0.interrupt(cycles);
        true
    }

    fn asleep(&self) -> bool {
        self.soc.asleep()
    }
    fn halted(&self) -> bool {
        !self.soc.busy() && !self.soc.can_wake(true)
    }
    fn has_trap(&self, pc: u32) -> bool {
        self.code.has_trap(pc)
    }
    fn mark(&self, pc: u32) -> Mark {
        self.code.mark(self.hot.at & BANK, pc)
    }
    fn head(&self, end: u32) -> Option<u32> {
        self.code.look(self.hot.at & BANK, end).map(|found| found.head)
    }
    fn steady(&self, end: u32, at: u64) -> u64 {
        let looks = self.code.look(self.hot.at & BANK, end).map_or(&[][..], |found| &found.looks);
        looks.iter().map(|&sfr| self.soc.steady_until(sfr as u16, at)).min().unwrap_or(NEVER)
    }
    fn renews(&self, end: u32) -> bool {
        self.code.look(self.hot.at & BANK, end).is_some_and(|found| found.renews)
    }
    fn counter(&self, end: u32) -> Option<u64> {
        self.ram.get(usize::from(self.code.look(self.hot.at & BANK, end)?.counter?)).map(|&byte| byte.into())
    }
    fn set_counter(&mut self, end: u32, value: u64) {
        let place = self.code.look(self.hot.at & BANK, end).and_then(|found| found.counter);
        place.and_then(|at| self.ram.get_mut(usize::from(at))).into_iter().for_each(|byte| *byte = value as u8);
    }
    fn held(&self) -> Self::Held {
        (self.hot.w, self.hot.status(), self.hot.pointer, self.hot.pclath)
    }

    fn burst<P: Probe>(&mut self, looks: bool, probe: &mut P) {
        let (turn, code) = self.turn(probe);
        self.hot = turn.burst(&code.ops[usize::from(looks)]);
    }

    fn single<P: Probe>(&mut self, pc: u32, probe: &mut P) -> Result<(), Stop> {
        self.hot.set_pc(pc);
        let op = self.code.plain[self.op_index(pc)];
        if op.kind == Kind::Illegal {
            return Err(Stop::Illegal { pc, word: self.code.words[pc as usize % SPAN] });
        }
        self.hot = self.turn(probe).0.single(op);
        Ok(())
    }
}
