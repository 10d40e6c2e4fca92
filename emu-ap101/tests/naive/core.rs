//! The crate as a subject of these tests, through its public interface only.

use emu_ap101::{Ap101, Ap101Config};
use emu_core::cpu::{Cpu, Probe, ProgramError, ProgramFault, ResetCause, StopReason};
use emu_core::image::{Image, Segment};
use emu_core::pins::{ChipEvent, CycleTime, PinId, PinLevel};

use super::config::{BLOCK, LENGTH};
use super::machine::{End, Line, When};
use super::script::Subject;

/// The order of pins is inputs, outputs, supply, CLEAR.
const OUTPUTS: PinId = 512;
const POWER: PinId = 768;
const CLEAR: PinId = 769;

/// The machine with the edges of its outputs.
pub struct Core {
    pub machine: Ap101,
    edges: Vec<(When, usize, bool)>,
}

struct Log<'a>(&'a mut Vec<(When, usize, bool)>);

impl Probe for Log<'_> {
    const EVENTS: bool = true;

    fn on_event(&mut self, event: ChipEvent) -> bool {
        if let ChipEvent::Edge { at, pin, level } = event
            && (OUTPUTS..POWER).contains(&pin)
        {
            self.0.push(((at.cycle, at.phase), usize::from(pin - OUTPUTS), level == PinLevel::High));
        }
        false
    }
}

/// Makes an image from bytes; bytes that are not given are not part of it.
pub fn image(bytes: &[Option<u8>]) -> Image {
    let mut image = Image::default();
    for (space, start, end) in [("code", 0, BLOCK), ("config", BLOCK, BLOCK + LENGTH)] {
        let mut next = None;
        let given = bytes.iter().enumerate().take(end).skip(start);
        for (at, byte) in given.filter_map(|(at, byte)| byte.map(|byte| (at, byte))) {
            match image.segments.last_mut() {
                Some(segment) if next == Some(at) => segment.bytes.push(byte),
                _ => image.segments.push(Segment { space, addr: (at - start) as u32, bytes: vec![byte] }),
            }
            next = Some(at + 1);
        }
    }
    image
}

impl Subject for Core {
    fn make(bytes: &[Option<u8>]) -> Result<Core, usize> {
        let image = image(bytes);
        let damaged = Ap101Config::read_config(&image).err();
        if let Some(first) = damaged.and_then(|damages| damages.first().map(|damage| damage.addr as usize)) {
            return Err(first - BLOCK);
        }
        Ok(Core { machine: Ap101::new(&image), edges: Vec::new() })
    }
    fn drive(&mut self, (cycle, phase): When, line: Line, level: bool) {
        let pin = match line {
            Line::Input(n) => n as PinId,
            Line::Output(n) => OUTPUTS + n as PinId,
            Line::Power => POWER,
            Line::Clear => CLEAR,
        };
        self.machine.drive(CycleTime { cycle, phase }, pin, PinLevel::from_bit(level));
    }
    fn run(&mut self, until: u64) -> End {
        match self.machine.run(until, &mut Log(&mut self.edges)) {
            StopReason::Limit => End::Limit,
            StopReason::Halted => End::Halted,
            StopReason::Error(ProgramError::Fault { pc, fault: ProgramFault::JumpOutOfProgram { target } }) => {
                End::Jump { pc: pc as u16, target }
            }
            StopReason::Error(ProgramError::Fault { pc, fault: ProgramFault::CycleTooLong }) => {
                End::Watchdog { pc: pc as u16 }
            }
            other => panic!("{other:?}"),
        }
    }
    fn cycle(&self) -> u64 {
        self.machine.cycle()
    }
    fn instructions(&self) -> u64 {
        self.machine.instructions()
    }
    fn reg(&self, name: &str) -> Option<u32> {
        // The program counter is NA.
        if name == "NA" { Some(self.machine.pc()) } else { self.machine.reg(name) }
    }
    fn peek(&self, space: &str, at: usize) -> Option<u8> {
        self.machine.peek(space, at as u32)
    }
    fn output(&self, n: usize) -> bool {
        self.machine.pin_level(OUTPUTS + n as PinId) == PinLevel::High
    }
    fn reset(&mut self, cold: bool) {
        self.machine.reset(if cold { ResetCause::PowerOn } else { ResetCause::BrownOut });
    }
    fn poke_ram(&mut self, at: usize, bit: bool) {
        assert!(self.machine.poke("m", at as u32, u8::from(bit)));
    }
    fn edges(&self) -> Vec<(When, usize, bool)> {
        self.edges.clone()
    }
    fn clear(&self) -> bool {
        self.machine.pin_level(CLEAR) == PinLevel::High
    }
}
